! SPDX-License-Identifier: MIT
!> Recoverable failures as values.
!>
!> A procedure that can fail takes `type(error_type), allocatable, intent(out) :: error` as its
!> last argument; unallocated on return means success. The caller tests at once and either
!> handles it or returns, usually after `add_context`. Nothing outside `src/app` stops or prints.
!> The codes are the program's exit codes (docs/file-formats.md, "exit codes").
module rockdda_base_error
   implicit none
   private
   public :: error_type, error_code, make_error, add_context

   !> Names of the failure classes; the value is the exit code of the program.
   type :: error_code_enum
      integer :: internal = 1     !! a bug in RockDDA
      integer :: input = 2        !! bad usage or bad input
      integer :: computation = 3  !! no convergence, non-finite values
      integer :: stopped = 4      !! stopped by a signal or a time limit, can be resumed
      integer :: output = 5       !! output could not be written
   end type error_code_enum
   type(error_code_enum), parameter :: error_code = error_code_enum()

   type :: error_type
      integer :: code = 1                    !! one of error_code%...
      logical :: is_fatal = .false.        !! a smaller time step does not help: memory is lacking
      character(len=:), allocatable :: message !! one or more lines, no trailing newline
   end type error_type

contains

   !> Allocate `error` with a code and a message.
   pure subroutine make_error(error, code, message, is_fatal)
      type(error_type), allocatable, intent(out) :: error !! the new error
      integer, intent(in) :: code                         !! one of error_code%...
      character(len=*), intent(in) :: message             !! what happened, where, and what was expected
      logical, intent(in), optional :: is_fatal         !! a smaller time step does not help
      allocate (error)
      if (present(is_fatal)) error%is_fatal = is_fatal
      error%code = code
      error%message = message
   end subroutine make_error

   !> Prefix the message with where it happened: "context: message".
   pure subroutine add_context(error, context)
      type(error_type), allocatable, intent(inout) :: error !! stays unallocated when it is
      character(len=*), intent(in) :: context               !! for example "step 42"
      if (.not. allocated(error)) return
      error%message = context//': '//error%message
   end subroutine add_context

end module rockdda_base_error
