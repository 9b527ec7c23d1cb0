! SPDX-License-Identifier: MIT
!> Allocation of work arrays that are kept from call to call.
module rockdda_base_room
   use, intrinsic :: iso_fortran_env, only : real32, real64
   implicit none
   private
   public :: reserve, resize

   !> Give an array exactly n columns; contents are lost when the number changes.
   interface resize
      module procedure resize_real32
      module procedure resize_real64
   end interface resize

contains

   !> Allocate at least n numbers. A quarter more makes that rare while n grows; contents are lost then.
   pure subroutine reserve(array, n)
      integer, allocatable, intent(inout) :: array(:)   !! (>= n)
      integer, intent(in) :: n
      if (allocated(array)) then
         if (size(array) >= n) return
         deallocate (array)
      end if
      allocate (array(n + n/4 + 16))
   end subroutine reserve

   !> Columns in single precision.
   pure subroutine resize_real32(array, rows, n)
      real(real32), allocatable, intent(inout) :: array(:, :)   !! (rows, n)
      integer, intent(in) :: rows, n                            !! rows: the same in all calls for one array
      if (allocated(array)) then
         if (size(array, 2) == n) return
         deallocate (array)
      end if
      allocate (array(rows, n))
   end subroutine resize_real32

   !> Columns in double precision.
   pure subroutine resize_real64(array, rows, n)
      real(real64), allocatable, intent(inout) :: array(:, :)   !! (rows, n)
      integer, intent(in) :: rows, n                            !! rows: the same in all calls for one array
      if (allocated(array)) then
         if (size(array, 2) == n) return
         deallocate (array)
      end if
      allocate (array(rows, n))
   end subroutine resize_real64

end module rockdda_base_room
