! SPDX-License-Identifier: MIT
!> Stable sorting by index.
module rockdda_base_sorting
   use rockdda_base_kinds, only : wp
   implicit none
   private
   public :: sorted_order

   !> order such that keys(order) ascends; equal keys keep their order. n log n; already sorted input costs n.
   interface sorted_order
      module procedure sorted_order_real
      module procedure sorted_order_integer
   end interface sorted_order

contains

   !> Order of real keys.
   pure function sorted_order_real(keys) result(order)
      real(wp), intent(in) :: keys(:)
      integer, allocatable :: order(:)    !! allocatable: long lists must not live on the stack
      integer, allocatable :: other(:)
      integer :: i, j, k, n, width, left, middle, right
      n = size(keys)
      allocate (order(n))
      do i = 1, n
         order(i) = i
      end do
      if (n < 2) return
      if (all(keys(1:n - 1) <= keys(2:n))) return
      allocate (other(n))
      width = 1
      do while (width < n)
         do left = 1, n, 2*width
            middle = min(left + width, n + 1)
            right = min(middle + width, n + 1)
            i = left
            j = middle
            do k = left, right - 1
               if (i < middle .and. j < right) then
                  if (keys(order(j)) < keys(order(i))) then
                     other(k) = order(j)
                     j = j + 1
                  else
                     other(k) = order(i)
                     i = i + 1
                  end if
               else if (i < middle) then
                  other(k) = order(i)
                  i = i + 1
               else
                  other(k) = order(j)
                  j = j + 1
               end if
            end do
         end do
         order = other
         width = 2*width
      end do
   end function sorted_order_real

   !> Order of integer keys.
   pure function sorted_order_integer(keys) result(order)
      integer, intent(in) :: keys(:)
      integer, allocatable :: order(:)
      ! default integers fit into a real without loss
      order = sorted_order_real(real(keys, wp))
   end function sorted_order_integer

end module rockdda_base_sorting
