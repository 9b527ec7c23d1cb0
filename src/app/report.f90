! SPDX-License-Identifier: MIT
!> Messages and failures as text on standard error and as JSON on standard output.
module rockdda_app_report
   use rockdda_base_error, only : error_type
   use rockdda_base_diagnostics, only : diagnostics_type, severity, severity_names, max_shown
   use rockdda_app_arguments, only : command_line_type
   use rockdda_app_json, only : json_type
   use rockdda_app_process, only : print_line, print_error
   implicit none
   private
   public :: show_messages, show_error, begin_json, finish_json, end_json, put_messages, report_failure

contains

   !> Print messages of at least this severity, if there are any.
   subroutine show_messages(messages, at_least, with_places)
      type(diagnostics_type), intent(in) :: messages
      integer, intent(in) :: at_least          !! one of severity%...
      logical, intent(in), optional :: with_places !! also notes that point to a line
      character(len=:), allocatable :: text
      text = messages%format(at_least, with_places)
      if (len(text) > 0) call print_error(text)
   end subroutine show_messages

   !> Print an error. One that already reads as a compiler's message is printed as it is.
   subroutine show_error(error)
      type(error_type), intent(in) :: error
      character(len=:), allocatable :: rest
      integer :: cut
      if (is_formatted(error%message)) then
         call print_error(error%message)
         return
      end if
      ! problems of the command line are listed one per line
      rest = error%message
      cut = index(rest, new_line('a'))
      do while (cut > 0)
         if (rest(cut + 1:cut + 1) == ' ' .or. .not. starts_option(rest)) exit
         call print_error('rockdda: error: '//rest(1:cut - 1))
         rest = rest(cut + 1:)
         cut = index(rest, new_line('a'))
      end do
      call print_error('rockdda: error: '//rest)
   end subroutine show_error

   !> Does a message already contain its place and severity?
   pure logical function is_formatted(text)
      character(len=*), intent(in) :: text
      is_formatted = index(text, ': error: ') > 0 .or. index(text, 'error: ') == 1
   end function is_formatted

   !> Is this a problem of the command line?
   pure logical function starts_option(text)
      character(len=*), intent(in) :: text
      starts_option = index(text, 'option ') == 1 .or. index(text, 'unknown ') == 1
   end function starts_option

   !> Begin the JSON summary: command, status, exit code. The caller adds members and ends it with `end_json`.
   subroutine begin_json(json, line, status, exit_code)
      type(json_type), intent(inout) :: json
      type(command_line_type), intent(in) :: line
      character(len=*), intent(in) :: status
      integer, intent(in) :: exit_code
      call json%open('{', '')
      call json%put('command', line%command)
      call json%put('status', status)
      call json%put('exit_code', exit_code)
   end subroutine begin_json

   !> Add the messages, end the JSON summary and print it; ok is false when printing fails.
   subroutine end_json(json, messages, error, ok)
      type(json_type), intent(inout) :: json
      type(diagnostics_type), intent(in) :: messages
      type(error_type), allocatable, intent(in) :: error
      logical, intent(out) :: ok
      call finish_json(json, messages, error)
      call print_line(json%text, ok)
   end subroutine end_json

   !> Add the messages and end the JSON summary.
   subroutine finish_json(json, messages, error)
      type(json_type), intent(inout) :: json
      type(diagnostics_type), intent(in) :: messages
      type(error_type), allocatable, intent(in) :: error
      call json%put('errors', messages%n_errors + merge(1, 0, allocated(error)))
      call json%put('warnings', messages%n_warnings)
      call put_messages(json, messages, error)
      call json%close('}')
   end subroutine finish_json

   !> Add the messages, and an error.
   subroutine put_messages(json, messages, error)
      type(json_type), intent(inout) :: json
      type(diagnostics_type), intent(in) :: messages
      type(error_type), allocatable, intent(in) :: error
      integer :: i
      call json%open('[', 'messages')
      do i = 1, min(messages%n, 20*max_shown)
         call json%open('{', '')
         associate (m => messages%items(i))
            call json%put('severity', trim(severity_names(m%severity)))
            call json%put('message', m%message)
            if (allocated(m%origin%file)) call json%put('file', m%origin%file)
            if (m%origin%line > 0) call json%put('line', m%origin%line)
            if (m%origin%line > 0 .and. m%origin%column > 0) call json%put('column', m%origin%column)
         end associate
         call json%close('}')
      end do
      if (allocated(error)) then
         call json%open('{', '')
         call json%put('severity', 'error')
         call json%put('message', error%message)
         call json%close('}')
      end if
      call json%close(']')
   end subroutine put_messages

   !> End a command that failed: print messages, notes only beside errors of the input, and error.
   subroutine report_failure(line, messages, error, exit_code)
      type(command_line_type), intent(in) :: line
      type(diagnostics_type), intent(in) :: messages
      type(error_type), allocatable, intent(in) :: error
      integer, intent(out) :: exit_code
      type(json_type) :: json
      logical :: ok
      exit_code = 2
      if (allocated(error)) exit_code = error%code
      call show_messages(messages%summarised(), merge(severity%error, severity%warning, line%quiet), &
                         with_places=.not. line%quiet .and. messages%has_errors())
      if (allocated(error)) call show_error(error)
      if (.not. line%json) return
      call begin_json(json, line, 'error', exit_code)
      call end_json(json, messages%summarised(), error, ok)
   end subroutine report_failure

end module rockdda_app_report
