! SPDX-License-Identifier: MIT
!> Groups of blocks that lie together, for the coarse space of rockdda_linear_deflation.
module rockdda_linear_aggregates
   use rockdda_base_kinds, only : wp, i8
   implicit none
   private
   public :: divide_by_place

contains

   !> Divide blocks into groups of equal number, to one block, by recursive bisection across the longer side of the box
   !> around the centroids of a group (Berger and Bokhari 1987). Equal coordinates: by number of the block.
   pure subroutine divide_by_place(centroid, n_groups, group)
      real(wp), intent(in) :: centroid(:, :)   !! (2, n) [length]
      integer, intent(in) :: n_groups          !! >= 1, at most n
      integer, intent(out) :: group(:)         !! (n) group of each block, 1 to n_groups
      integer :: block(size(group))
      integer :: first(n_groups), groups(n_groups)   ! of the pieces: place of the first block, groups to be made of it
      integer :: i, at, n_pieces, last, middle, left, axis
      block = [(i, i=1, size(group))]
      first(1) = 1
      groups(1) = n_groups
      n_pieces = 1
      at = 1
      do while (at <= n_pieces)
         if (groups(at) == 1) then
            at = at + 1
            cycle
         end if
         last = size(group)
         if (at < n_pieces) last = first(at + 1) - 1
         left = groups(at)/2
         middle = first(at) - 1 + int(int(last - first(at) + 1, i8)*left/groups(at))
         axis = longer_side(centroid, block(first(at):last))
         call part(centroid, axis, middle, first(at), last, block)
         first(at + 2:n_pieces + 1) = first(at + 1:n_pieces)
         groups(at + 2:n_pieces + 1) = groups(at + 1:n_pieces)
         first(at + 1) = middle + 1
         groups(at + 1) = groups(at) - left
         groups(at) = left
         n_pieces = n_pieces + 1
      end do
      do at = 1, n_pieces
         last = size(group)
         if (at < n_pieces) last = first(at + 1) - 1
         group(block(first(at):last)) = at
      end do
   end subroutine divide_by_place

   !> Axis of the longer side of the box around some blocks.
   pure integer function longer_side(centroid, block)
      real(wp), intent(in) :: centroid(:, :)   !! (2, n)
      integer, intent(in) :: block(:)
      real(wp) :: low(2), high(2)
      integer :: i
      low = huge(1.0_wp)
      high = -huge(1.0_wp)
      do i = 1, size(block)
         low = min(low, centroid(:, block(i)))
         high = max(high, centroid(:, block(i)))
      end do
      longer_side = merge(1, 2, high(1) - low(1) >= high(2) - low(2))
   end function longer_side

   !> Order block(first:last) such that none up to place `middle` comes after one beyond it (quickselect, Hoare 1961).
   pure subroutine part(centroid, axis, middle, first, last, block)
      real(wp), intent(in) :: centroid(:, :)  !! (2, n)
      integer, intent(in) :: axis, middle, first, last
      integer, intent(inout) :: block(:)      !! (n)
      integer :: low, high, i, j, pivot, other
      low = first
      high = last
      do while (low < high)
         pivot = block(low + (high - low)/2)
         i = low
         j = high
         do
            do while (comes_before(block(i), pivot))
               i = i + 1
            end do
            do while (comes_before(pivot, block(j)))
               j = j - 1
            end do
            if (i <= j) then
               other = block(i)
               block(i) = block(j)
               block(j) = other
               i = i + 1
               j = j - 1
            end if
            if (i > j) exit
         end do
         if (j < middle) low = i
         if (middle < i) high = j
      end do

   contains

      !> Order by coordinate, then by number.
      pure logical function comes_before(a, b)
         integer, intent(in) :: a, b
         comes_before = centroid(axis, a) < centroid(axis, b)
         if (.not. (comes_before .or. centroid(axis, b) < centroid(axis, a))) comes_before = a < b
      end function comes_before

   end subroutine part

end module rockdda_linear_aggregates
