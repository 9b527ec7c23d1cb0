! SPDX-License-Identifier: MIT
!> Room in arrays that are used again and again.
module rockdda_base_room
   implicit none
   private
   public :: reserve

contains

   !> Make room for n numbers; a quarter more, so that it seldom happens. Contents are lost when it does.
   pure subroutine reserve(array, n)
      integer, allocatable, intent(inout) :: array(:)   !! (>= n)
      integer, intent(in) :: n
      if (allocated(array)) then
         if (size(array) >= n) return
         deallocate (array)
      end if
      allocate (array(n + n/4 + 16))
   end subroutine reserve

end module rockdda_base_room
