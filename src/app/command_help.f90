! SPDX-License-Identifier: MIT
!> rockdda help: on the program, a command, the groups of a model file, one of them, or an option; and the script for
!> shells.
module rockdda_app_command_help
   use rockdda_base_diagnostics, only : diagnostics_type
   use rockdda_base_strings, only : lower_case
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_io_option_documents, only : group_help, group_names, groups_help, group_suggestion, named_option_help
   use rockdda_app_arguments, only : command_line_type
   use rockdda_app_command_options, only : command_names
   use rockdda_app_completion, only : completion_script
   use rockdda_app_process, only : print_line, print_error
   use rockdda_app_report, only : report_failure
   use rockdda_app_usage, only : usage_text
   implicit none
   private
   public :: run_help, refuse_nothing

contains

   !> Print the help or the script; ok is false when printing fails, the exit code tells of an unknown topic.
   subroutine run_help(line, ok, exit_code)
      type(command_line_type), intent(in) :: line    !! topic: a command is not one of them
      logical, intent(out) :: ok
      integer, intent(out) :: exit_code
      type(diagnostics_type) :: messages
      type(error_type), allocatable :: error
      character(len=:), allocatable :: text, group
      exit_code = 0
      group = lower_case(line%topic)
      if (index(group, '&') == 1) group = group(2:)
      if (len(line%completion) > 0 .and. .not. line%help) then
         text = completion_script(line%completion, group_names())
      else if (len(line%topic) == 0 .or. line%topic == 'completion') then
         text = line%command
         if (len(line%topic) > 0) text = line%topic
         text = usage_text(text)
      else if (group == 'groups') then
         text = groups_help()
      else
         text = group_help(group)
         if (len(text) == 0) text = named_option_help(group)
      end if
      if (len(text) > 0) then
         call print_line(text, ok)
         return
      end if
      ok = .true.
      call make_error(error, error_code%input, "no help on '"//line%topic//"'"// &
                      group_suggestion(group, [character(len=10) :: command_names, 'groups', 'completion']))
      call report_failure(line, messages, error, exit_code)
   end subroutine run_help

   !> Tell that there is no command, after the help of the program.
   subroutine refuse_nothing(line, exit_code)
      type(command_line_type), intent(in) :: line
      integer, intent(out) :: exit_code
      type(diagnostics_type) :: messages
      type(error_type), allocatable :: error
      if (.not. line%json) call print_error(usage_text(''))
      call make_error(error, error_code%input, 'no command given')
      call report_failure(line, messages, error, exit_code)
   end subroutine refuse_nothing

end module rockdda_app_command_help
