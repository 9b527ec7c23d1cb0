! SPDX-License-Identifier: MIT
!> Runs the command of the command line.
module rockdda_app_program
   use rockdda_base_error, only : error_type, error_code
   use rockdda_base_diagnostics, only : diagnostics_type
   use rockdda_base_version, only : version, build_description
   use rockdda_app_arguments, only : command_line_type, parse_command_line
   use rockdda_app_command_check, only : run_check
   use rockdda_app_command_cut, only : run_cut
   use rockdda_app_command_fos, only : run_fos
   use rockdda_app_command_help, only : run_help, refuse_nothing
   use rockdda_app_command_info, only : run_info
   use rockdda_app_command_lines, only : run_lines
   use rockdda_app_command_new, only : run_new
   use rockdda_app_command_run, only : run_run, run_resume
   use rockdda_app_process, only : argument_type, promise_json, print_line
   use rockdda_app_report, only : report_failure, begin_json, end_json
   use rockdda_app_json, only : json_type
   use rockdda_io_hdf5_adapter, only : hdf5_version
   implicit none
   private
   public :: run_program

contains

   !> Run the command; returns the exit code.
   subroutine run_program(arguments, exit_code)
      type(argument_type), intent(in) :: arguments(:)   !! without the program's name
      integer, intent(out) :: exit_code
      type(command_line_type) :: line
      type(diagnostics_type) :: messages
      type(error_type), allocatable :: error
      logical :: ok

      call parse_command_line(arguments, line, error)
      if (line%json) call promise_json(line%command)
      exit_code = 0
      ok = .true.
      if (allocated(error) .and. .not. line%help) then
         call report_failure(line, messages, error, exit_code)
      else if (line%help .or. len(line%completion) > 0) then
         call run_help(line, ok, exit_code)
      else if (line%version) then
         call run_version(line, ok)
      else
         select case (line%command)
         case ('new'); call run_new(line, exit_code)
         case ('lines'); call run_lines(line, exit_code)
         case ('cut'); call run_cut(line, exit_code)
         case ('run'); call run_run(line, exit_code)
         case ('resume'); call run_resume(line, exit_code)
         case ('fos'); call run_fos(line, exit_code)
         case ('check'); call run_check(line, exit_code)
         case ('info'); call run_info(line, exit_code)
         case default
            call refuse_nothing(line, exit_code)
         end select
      end if
      if (.not. ok) exit_code = error_code%output
   end subroutine run_program

   !> Print version, compiler, flags, options and libraries; ok is false when printing fails.
   subroutine run_version(line, ok)
      type(command_line_type), intent(in) :: line
      logical, intent(out) :: ok
      type(json_type) :: json
      type(diagnostics_type) :: messages
      type(error_type), allocatable :: none
      if (.not. line%json) then
         call print_line(build_description(), ok)
         return
      end if
      call begin_json(json, line, 'done', 0)
      call json%put('version', version)
      call json%put('hdf5', hdf5_version())
      call json%put('build', build_description())
      call end_json(json, messages, none, ok)
   end subroutine run_version

end module rockdda_app_program
