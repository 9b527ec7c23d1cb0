! SPDX-License-Identifier: MIT
!> The files of a command with any number of files.
module rockdda_app_file_list
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_io_model_folder, only : find_model_files
   use rockdda_io_posix, only : get_path_kind, path_kind
   use rockdda_app_arguments, only : command_line_type
   use rockdda_app_process, only : argument_type, add_argument
   implicit none
   private
   public :: list_files

contains

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

end module rockdda_app_file_list
