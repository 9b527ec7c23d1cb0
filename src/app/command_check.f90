! SPDX-License-Identifier: MIT
!> rockdda check: every problem of every file, computes nothing.
module rockdda_app_command_check
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_io_option_documents, only : options_markdown, options_schema
   use rockdda_io_recognise, only : file_kind
   use rockdda_run_labelled_text, only : labelled_text
   use rockdda_run_find_files, only : recognise_file
   use rockdda_run_input, only : model_input_type
   use rockdda_app_arguments, only : command_line_type
   use rockdda_app_check_summary, only : print_summary
   use rockdda_app_file_check, only : check_alone, check_together, is_input, is_model_run
   use rockdda_app_file_list, only : list_files
   use rockdda_app_process, only : argument_type, add_argument, print_line
   use rockdda_app_report, only : show_messages, show_error
   implicit none
   private
   public :: run_check

contains

   !> Run the command; returns the exit code.
   subroutine run_check(line, exit_code)
      type(command_line_type), intent(in) :: line
      integer, intent(out) :: exit_code
      type(argument_type), allocatable :: files(:)
      type(model_input_type) :: input
      type(diagnostics_type) :: messages
      type(error_type), allocatable :: error
      integer, allocatable :: kinds(:)
      integer :: i, least
      logical :: ok
      logical, allocatable :: readable(:)

      if (line%options_table) then
         call print_options(line%json, ok)
         exit_code = merge(0, error_code%output, ok)
         return
      end if
      call list_files(line, files, messages, error)
      if (len(line%config) > 0) call add_argument(line%config, files)
      allocate (kinds(size(files)), readable(size(files)))
      do i = 1, size(files)
         call recognise_file(files(i)%text, kinds(i), messages, readable(i))
      end do
      if (line%as_namelist .and. .not. is_model_run(kinds) .and. all(readable) .and. .not. allocated(error)) &
         call make_error(error, error_code%input, '--as-namelist needs the files of one run: a geometry or block '// &
                         'file, an analysis file and, where there is one, an options file; or a folder with them')
      if (is_model_run(kinds)) then
         call check_together(line, files, kinds, input, messages, error)
         readable = readable .and. .not. (is_input(kinds) .or. kinds == file_kind%labelled)
      end if
      do i = 1, size(files)
         if (readable(i) .and. .not. line%as_namelist) call check_alone(line, files(i)%text, kinds(i), messages)
      end do
      exit_code = 0
      if (messages%has_errors() .or. allocated(error)) exit_code = error_code%input
      least = severity%note
      if (line%as_namelist) least = severity%warning
      if (line%quiet .or. line%json) least = severity%error
      call show_messages(messages, least)
      if (allocated(error)) call show_error(error)
      if (line%as_namelist .and. .not. line%json) then
         if (exit_code /= 0) return
         call print_line(labelled_text(input), ok)
         if (.not. ok) exit_code = error_code%output
         return
      end if
      call print_summary(line, files, kinds, input, messages, error, exit_code, ok)
      if (.not. ok) exit_code = error_code%output
   end subroutine run_check

   !> Print the table of options of a run: Markdown, or with --json a JSON Schema.
   subroutine print_options(json, ok)
      logical, intent(in) :: json
      logical, intent(out) :: ok
      character(len=:), allocatable :: text
      if (json) then
         text = options_schema()
      else
         text = options_markdown()
      end if
      call print_line(text(:len(text) - 1), ok)
   end subroutine print_options

end module rockdda_app_command_check
