! SPDX-License-Identifier: MIT
!> The program: takes its command line, does the command, ends with its exit code.
program rockdda_program
   use rockdda_app_process, only : argument_type, get_arguments, start_process, end_process
   use rockdda_app_program, only : run_program
   implicit none
   type(argument_type), allocatable :: arguments(:)
   integer :: exit_code

   call start_process()
   call get_arguments(arguments)
   call run_program(arguments, exit_code)
   call end_process(exit_code)
end program rockdda_program
