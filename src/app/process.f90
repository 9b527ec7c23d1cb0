! SPDX-License-Identifier: MIT
!> The process: arguments, standard streams, signals, exit. Only this module prints and stops.
module rockdda_app_process
   use, intrinsic :: iso_c_binding, only : c_char, c_int
   use rockdda_base_error, only : error_type
   use rockdda_base_strings, only : printable
   use rockdda_io_file_sink, only : file_sink_type
   implicit none
   private
   public :: argument_type, add_argument, get_arguments, start_process, end_process
   public :: print_line, print_error, show_status, is_terminal, terminal_columns
   public :: watch_signals, seen_signal, set_writing, set_last_words, promise_json

   !> Control characters of the program's own texts; all others come from input and are printed as \xHH.
   character(len=*), parameter :: own_controls = achar(9)//new_line('a')

   !> One word of the command line.
   type :: argument_type
      character(len=:), allocatable :: text
   end type argument_type

   interface
      !> Install the handler for crashes. To be called first.
      subroutine start_process() bind(C, name='rockdda_process_start')
      end subroutine start_process
      !> End the program with an exit code.
      subroutine end_process(code) bind(C, name='rockdda_process_exit')
         import :: c_int
         integer(c_int), value :: code
      end subroutine end_process
      !> Record stop signals (SIGTERM, SIGINT, SIGUSR1, SIGUSR2, SIGXCPU, SIGHUP unless it is ignored) from now on
      !> instead of ending the program. A second SIGINT ends it at once, unless output is being written.
      subroutine watch_signals() bind(C, name='rockdda_process_watch_signals')
      end subroutine watch_signals
      integer(c_int) function c_signal() bind(C, name='rockdda_process_signal')
         import :: c_int
      end function c_signal
      subroutine c_set_writing(yes) bind(C, name='rockdda_process_set_writing')
         import :: c_int
         integer(c_int), value :: yes
      end subroutine c_set_writing
      subroutine c_promise_json(command, n) bind(C, name='rockdda_process_promise_json')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: command(*)
         integer(c_int), value :: n
      end subroutine c_promise_json
      subroutine c_set_last_words(text, n) bind(C, name='rockdda_process_set_last_words')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: text(*)
         integer(c_int), value :: n
      end subroutine c_set_last_words
      integer(c_int) function c_is_terminal(descriptor) bind(C, name='rockdda_process_is_terminal')
         import :: c_int
         integer(c_int), value :: descriptor
      end function c_is_terminal
      integer(c_int) function c_columns(descriptor) bind(C, name='rockdda_process_columns')
         import :: c_int
         integer(c_int), value :: descriptor
      end function c_columns
   end interface

contains

   !> Append a word. (An array constructor with a structure constructor of a text inside gets one letter of it.)
   subroutine add_argument(text, arguments)
      character(len=*), intent(in) :: text
      type(argument_type), allocatable, intent(inout) :: arguments(:)
      type(argument_type), allocatable :: more(:)
      allocate (more(size(arguments) + 1))
      more(1:size(arguments)) = arguments
      more(size(more))%text = text
      call move_alloc(more, arguments)
   end subroutine add_argument

   !> Get the command line, without the program's name.
   subroutine get_arguments(arguments)
      type(argument_type), allocatable, intent(out) :: arguments(:)
      integer :: i, n
      allocate (arguments(command_argument_count()))
      do i = 1, size(arguments)
         call get_command_argument(i, length=n)
         arguments(i)%text = repeat(' ', n)
         if (n > 0) call get_command_argument(i, arguments(i)%text)
      end do
   end subroutine get_arguments

   !> Print to standard output, control characters shown as \xHH; ok is false when that fails.
   subroutine print_line(text, ok)
      character(len=*), intent(in) :: text
      logical, intent(out) :: ok
      call write_stream(1, printable(text, own_controls)//new_line('a'), ok)
   end subroutine print_line

   !> Print to standard error, control characters shown as \xHH.
   subroutine print_error(text)
      character(len=*), intent(in) :: text
      logical :: ok
      call write_stream(2, printable(text, own_controls)//new_line('a'), ok)
   end subroutine print_error

   !> Print to standard error as it is, without a line end: for the program's own texts only.
   subroutine show_status(text)
      character(len=*), intent(in) :: text
      logical :: ok
      call write_stream(2, text, ok)
   end subroutine show_status

   !> Write to a standard stream at once.
   subroutine write_stream(stream, text, ok)
      integer, intent(in) :: stream
      character(len=*), intent(in) :: text
      logical, intent(out) :: ok
      type(file_sink_type) :: sink
      type(error_type), allocatable :: error
      call sink%attach(stream, 'standard stream')
      call sink%put(text, error)
      if (.not. allocated(error)) call sink%flush(error)
      ok = .not. allocated(error)
   end subroutine write_stream

   !> Is standard error a terminal?
   logical function is_terminal()
      is_terminal = c_is_terminal(2_c_int) /= 0
   end function is_terminal

   !> Columns of the terminal at standard error; 0 where they are not known.
   integer function terminal_columns()
      terminal_columns = int(c_columns(2_c_int))
   end function terminal_columns

   !> Name of the stop signal that came first; empty when none came.
   function seen_signal() result(name)
      character(len=:), allocatable :: name
      select case (c_signal())
      case (0); name = ''
      case (1); name = 'SIGTERM'
      case (2); name = 'SIGINT'
      case (3); name = 'SIGUSR1'
      case (4); name = 'SIGUSR2'
      case (5); name = 'SIGXCPU'
      case default; name = 'SIGHUP'
      end select
   end function seen_signal

   !> Set the text that a second SIGINT prints to standard output.
   subroutine set_last_words(text)
      character(len=*), intent(in) :: text
      character(len=:), allocatable :: shown
      shown = printable(text, own_controls)//new_line('a')
      call c_set_last_words(shown, len(shown, c_int))
   end subroutine set_last_words

   !> Set the command that prints a summary in JSON. When memory is exhausted or the program crashes, a short summary is
   !> printed; in all other cases the command prints its own.
   subroutine promise_json(command)
      character(len=*), intent(in) :: command
      call c_promise_json(command, len(command, c_int))
   end subroutine promise_json

   !> Mark the begin and end of writing output.
   subroutine set_writing(yes)
      logical, intent(in) :: yes
      call c_set_writing(merge(1_c_int, 0_c_int, yes))
   end subroutine set_writing

end module rockdda_app_process
