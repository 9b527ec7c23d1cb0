! SPDX-License-Identifier: MIT
!> Work that may crash or never end is tried in a child process first.
!>
!> HDF5 is not made for files that are damaged: a wrong byte in the heap of its texts, and it reads for ever. Usage:
!>
!>     select case (try_first(5))
!>     case (0); ... the work, its results dropped ...; call leave_child()
!>     case (2); ... refuse ...
!>     end select
module rockdda_io_guard
   use, intrinsic :: iso_c_binding, only : c_int
   implicit none
   private
   public :: try_first, leave_child

   interface
      integer(c_int) function c_begin(seconds) bind(C, name='rockdda_guard_begin')
         import :: c_int
         integer(c_int), value :: seconds
      end function c_begin
      subroutine c_end() bind(C, name='rockdda_guard_end')
      end subroutine c_end
   end interface

contains

   !> Make a child, in which this returns 0. In the parent wait for its end: 1 it came through (or there could be no
   !> child), 2 it crashed or did not end.
   integer function try_first(seconds)
      integer, intent(in) :: seconds   !! processor time that the work may take
      try_first = int(c_begin(int(seconds, c_int)))
   end function try_first

   !> End the child. Does not return.
   subroutine leave_child()
      call c_end()
   end subroutine leave_child

end module rockdda_io_guard
