! SPDX-License-Identifier: MIT
!> rockdda new: a labelled model to begin with, with comments; the list of these models.
module rockdda_app_command_new
   use rockdda_base_diagnostics, only : diagnostics_type
   use rockdda_base_strings, only : replaced
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_io_posix, only : get_path_kind, path_kind
   use rockdda_base_suggest, only : did_you_mean
   use rockdda_io_text_output, only : text_writer_type
   use rockdda_run_output_choice, only : require_folder
   use rockdda_app_arguments, only : command_line_type
   use rockdda_app_json, only : json_type
   use rockdda_app_command_options, only : model_kinds, model_line, list_of_models, joined
   use rockdda_app_texts, only : text_of
   use rockdda_app_process, only : print_line
   use rockdda_app_report, only : begin_json, end_json, report_failure
   implicit none
   private
   public :: run_new

   character(len=*), parameter :: nl = new_line('a')

contains

   !> Write NAME.nml and NAME.dc of a model of a kind; returns the exit code.
   subroutine run_new(line, exit_code)
      type(command_line_type), intent(in) :: line       !! files: the kind and the name, which may end in .nml
      integer, intent(out) :: exit_code
      type(json_type) :: json
      type(diagnostics_type) :: messages
      type(error_type), allocatable :: error
      character(len=:), allocatable :: path
      logical :: ok

      if (line%list) then
         call print_list(line, exit_code)
         return
      end if
      call choose_path(line, path, error)
      if (.not. allocated(error)) call write_file(path//'.dc', text_of(line%files(1)%text//'.dc'), error)
      if (.not. allocated(error)) &
         call write_file(path//'.nml', replaced(text_of(line%files(1)%text//'.nml'), '@NAME@', name_of(path)), error)
      if (allocated(error)) then
         call report_failure(line, messages, error, exit_code)
         return
      end if
      exit_code = 0
      if (line%json) then
         call begin_json(json, line, 'done', 0)
         call json%put('model', path//'.nml')
         call json%put('geometry', path//'.dc')
         call end_json(json, messages, error, ok)
      else
         call print_line(path//'.nml: the model, with comments; '//path//'.dc: its lines'//nl// &
                         'next: rockdda run '//path//'.nml', ok)
      end if
      if (.not. ok) exit_code = error_code%output
   end subroutine run_new

   !> Print a line for each kind of model.
   subroutine print_list(line, exit_code)
      type(command_line_type), intent(in) :: line
      integer, intent(out) :: exit_code
      type(json_type) :: json
      type(diagnostics_type) :: messages
      type(error_type), allocatable :: no_error
      logical :: ok
      integer :: i
      if (line%json) then
         call begin_json(json, line, 'done', 0)
         call json%open('{', 'models')
         do i = 1, size(model_kinds)
            call json%put(trim(model_kinds(i)), model_line(model_kinds(i)))
         end do
         call json%close('}')
         call end_json(json, messages, no_error, ok)
      else
         call print_line(list_of_models(), ok)
      end if
      exit_code = merge(0, error_code%output, ok)
   end subroutine print_list

   !> Check the kind and the name: path is the name without .nml; files that exist are kept without --force.
   subroutine choose_path(line, path, error)
      type(command_line_type), intent(in) :: line
      character(len=:), allocatable, intent(out) :: path
      type(error_type), allocatable, intent(out) :: error
      character(len=3), parameter :: endings(2) = [character(len=3) :: 'nml', 'dc']
      integer :: i
      path = ''
      if (size(line%files) /= 2) then
         call make_error(error, error_code%input, &
                         "'rockdda new' needs the kind of a model ("//joined(model_kinds, ', ')//") and a name; "// &
                         "see 'rockdda new --list'")
         return
      end if
      path = trim(line%files(2)%text)
      if (.not. any(model_kinds == line%files(1)%text)) then
         call make_error(error, error_code%input, "'"//line%files(1)%text//"' is none of "// &
                         joined(model_kinds, ', ')// &
                         did_you_mean(line%files(1)%text, model_kinds))
         return
      end if
      if (len(path) > 4) then
         if (path(len(path) - 3:) == '.nml') path = path(1:len(path) - 4)
      end if
      if (len(name_of(path)) == 0 .or. scan(path, '''"!'//achar(9)//nl) > 0) then
         call make_error(error, error_code%input, "'"//path//"': expected a name of a file without quotes and '!'")
         return
      end if
      call require_folder(path, error)
      do i = 1, size(endings)
         if (allocated(error)) return
         if (get_path_kind(path//'.'//trim(endings(i))) /= path_kind%missing .and. .not. line%force) &
            call make_error(error, error_code%input, &
                            path//'.'//trim(endings(i))//': the file exists; use --force to overwrite it')
      end do
   end subroutine choose_path

   !> Write a text whose last character is a line end.
   subroutine write_file(path, text, error)
      character(len=*), intent(in) :: path, text
      type(error_type), allocatable, intent(out) :: error
      type(text_writer_type) :: writer
      call writer%open(path, error)
      if (allocated(error)) return
      call writer%line(text(1:len(text) - 1))
      call writer%close(error)
   end subroutine write_file

   !> The last part of a path.
   pure function name_of(path) result(name)
      character(len=*), intent(in) :: path
      character(len=:), allocatable :: name
      name = path(index(path, '/', back=.true.) + 1:)
   end function name_of

end module rockdda_app_command_new
