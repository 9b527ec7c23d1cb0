! SPDX-License-Identifier: MIT
!> Arguments of the commands that convert one file to another.
!>
!> The files of a command with any number of files.
module rockdda_app_conversion
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_base_strings, only : to_string
   use rockdda_io_output_lock, only : is_same_file
   use rockdda_io_posix, only : get_path_kind, path_kind
   use rockdda_io_recognise, only : file_kind, kind_name, ddaml_advice, find_model_files
   use rockdda_run_output_choice, only : require_folder
   use rockdda_run_find_files, only : recognise_file, with_article
   use rockdda_run_input, only : stem_of
   use rockdda_app_arguments, only : command_line_type
   use rockdda_app_process, only : argument_type, add_argument
   implicit none
   private
   public :: prepare_conversion, list_files

contains

   !> Check the arguments: one file of the right kind, and an output that may be written.
   subroutine prepare_conversion(line, wanted, ending, output, messages, error)
      type(command_line_type), intent(in) :: line
      integer, intent(in) :: wanted                            !! one of file_kind%...
      character(len=*), intent(in) :: ending                   !! of the default output
      character(len=:), allocatable, intent(out) :: output
      type(diagnostics_type), intent(inout) :: messages
      type(error_type), allocatable, intent(out) :: error
      type(origin_type) :: origin
      integer :: kind
      logical :: ok
      output = line%output
      if (size(line%files) /= 1) then
         call make_error(error, error_code%input, "'rockdda "//line%command//"' needs one "//kind_name(wanted)// &
                         ', found '//to_string(size(line%files))//"; see 'rockdda "//line%command//" --help'")
         return
      end if
      call recognise_file(line%files(1)%text, kind, messages, ok)
      if (.not. ok) return
      if (kind /= wanted) then
         origin%file = line%files(1)%text
         if (kind == file_kind%ddaml) then
            call messages%add(severity%error, ddaml_advice, origin)
         else
            call messages%add(severity%error, 'expected a '//kind_name(wanted)//', found '// &
                              with_article(kind_name(kind)), origin)
         end if
         return
      end if
      if (len(output) == 0) output = stem_of(line%files(1)%text)//ending
      call require_folder(output, error)
      if (allocated(error)) return
      if (get_path_kind(output) /= path_kind%file) return
      if (is_same_file(output, line%files(1)%text)) then
         call make_error(error, error_code%input, output//': the output would overwrite the input')
      else if (.not. line%force) then
         call make_error(error, error_code%input, output//': the file exists; use --force to overwrite it')
      end if
   end subroutine prepare_conversion

   !> List the named files, folders replaced by the model files in them.
   subroutine list_files(line, files, messages, error)
      type(command_line_type), intent(in) :: line
      type(argument_type), allocatable, intent(out) :: files(:)
      type(diagnostics_type), intent(inout) :: messages     !! of folders that hold no model
      type(error_type), allocatable, intent(out) :: error   !! when no file is named
      type(error_type), allocatable :: problem
      character(len=:), allocatable :: model, analysis, config, unread
      integer :: i
      allocate (files(0))
      if (size(line%files) == 0) then
         call make_error(error, error_code%input, "'rockdda "//line%command// &
                         "' needs at least one file; see 'rockdda "//line%command//" --help'")
         return
      end if
      do i = 1, size(line%files)
         if (get_path_kind(line%files(i)%text) /= path_kind%directory) then
            call add_argument(line%files(i)%text, files)
            cycle
         end if
         call find_model_files(line%files(i)%text, model, analysis, config, unread, problem)
         if (allocated(problem)) then
            call messages%add_error(problem)
         else
            if (len(model) > 0) call add_argument(model, files)
            if (len(analysis) > 0) call add_argument(analysis, files)
            if (allocated(config)) call add_argument(config, files)
            if (len(unread) > 0) call messages%add(severity%warning, unread//' in the folder '// &
               line%files(i)%text//' is not read: '//config//' with &model is the whole model')
         end if
      end do
   end subroutine list_files

end module rockdda_app_conversion
