! SPDX-License-Identifier: MIT
!> Work that may crash or never end is tried in a child process first.
!>
!> HDF5 is not made for files that are damaged: a wrong byte in the heap of its texts, and it reads for ever. Usage:
!>
!>     call try_first(0.5_wp, outcome, error)
!>     select case (outcome)
!>     case (guard%in_child)
!>        ... the work, its results dropped ...
!>        call leave_child(error)
!>     case (guard%crashed)
!>        ... refuse ...
!>     end select
module rockdda_io_guard
   use, intrinsic :: iso_c_binding, only : c_char, c_double, c_int
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type, error_code, make_error
   implicit none
   private
   public :: try_first, leave_child, guard

   type :: guard_enum
      integer :: in_child = 0
      integer :: came_through = 1
      integer :: crashed = 2         !! or did not end
      integer :: no_process = 3      !! there could be no child: nothing was tried
      integer :: refused = 4         !! with an error
      integer :: no_memory = 5       !! with an error: the work needs more than there is
   end type guard_enum
   !> What `try_first` returns.
   type(guard_enum), parameter :: guard = guard_enum()

   !> Bytes of a message at most.
   integer, parameter :: longest = 4096

   interface
      integer(c_int) function c_begin(seconds, message, room) bind(C, name='rockdda_guard_begin')
         import :: c_char, c_double, c_int
         real(c_double), value :: seconds
         integer(c_int), value :: room
         character(kind=c_char), intent(inout) :: message(*)
      end function c_begin
      subroutine c_end(message, n) bind(C, name='rockdda_guard_end')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: message(*)
         integer(c_int), value :: n
      end subroutine c_end
   end interface

contains

   !> Make a child, in which this returns guard%in_child. In the parent wait for its end.
   subroutine try_first(seconds, outcome, error)
      real(wp), intent(in) :: seconds  !! processor time that the work may take
      integer, intent(out) :: outcome  !! one of guard%...
      type(error_type), allocatable, intent(out) :: error   !! that of the child
      character(len=longest) :: message
      message = ''
      outcome = int(c_begin(real(seconds, c_double), message, int(longest, c_int)))
      if (outcome == guard%refused) call make_error(error, error_code%input, trim(message))
      if (outcome == guard%no_memory) call make_error(error, error_code%computation, 'out of memory', is_fatal=.true.)
   end subroutine try_first

   !> End the child; an error goes to the parent. Does not return.
   subroutine leave_child(error)
      type(error_type), allocatable, intent(in) :: error
      if (allocated(error)) then
         call c_end(error%message, len(error%message, c_int))
      else
         call c_end('', 0_c_int)
      end if
   end subroutine leave_child

end module rockdda_io_guard
