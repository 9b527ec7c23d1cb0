! SPDX-License-Identifier: MIT
!> The program: reads its command line, does the command, ends with its exit code.
program rockdda_program
   use rockdda_base_error, only : error_type, error_code
   use rockdda_base_diagnostics, only : diagnostics_type
   use rockdda_app_arguments, only : command_line_type, parse_command_line
   use rockdda_app_command_check, only : run_check
   use rockdda_app_command_cut, only : run_cut
   use rockdda_app_command_info, only : run_info
   use rockdda_app_command_run, only : run_run
   use rockdda_app_command_version, only : run_version
   use rockdda_app_process, only : argument_type, get_arguments, start_process, end_process, say, complain
   use rockdda_app_report, only : report_failure
   use rockdda_app_usage, only : usage_text
   implicit none
   type(argument_type), allocatable :: arguments(:)
   type(command_line_type) :: line
   type(diagnostics_type) :: messages
   type(error_type), allocatable :: error
   integer :: exit_code
   logical :: ok

   call start_process()
   call get_arguments(arguments)
   call parse_command_line(arguments, line, error)
   exit_code = 0
   ok = .true.
   if (line%help) then
      call say(usage_text(line%command), ok)
   else if (allocated(error)) then
      call report_failure(line, messages, error, exit_code)
   else if (line%version) then
      call run_version(line, ok)
   else
      select case (line%command)
      case ('cut'); call run_cut(line, exit_code)
      case ('run'); call run_run(line, exit_code)
      case ('check'); call run_check(line, exit_code)
      case ('info'); call run_info(line, exit_code)
      case default
         call complain(usage_text('')//new_line('a')//'rockdda: error: no command given')
         exit_code = error_code%input
      end select
   end if
   if (.not. ok) exit_code = error_code%output
   call end_process(exit_code)
end program rockdda_program
