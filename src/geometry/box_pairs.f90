! SPDX-License-Identifier: MIT
!> Pairs of boxes that come closer than a margin in both directions.
!>
!> Every box is widened by half the margin and listed in the cells of a grid that it covers. A pair is counted in one
!> cell only, the one that holds the lower left corner x of the intersection:
!>
!>     +--------------+
!>     | i            |
!>     |     +--------|----+
!>     |     |        |    |
!>     +-----x--------+    |
!>           |           j |
!>           +-------------+
!>
!> The cost is linear in the number of boxes as long as the boxes are not stacked on each other.
module rockdda_geometry_box_pairs
   use rockdda_base_kinds, only : wp
   use rockdda_base_room, only : grow, reserve
   use rockdda_geometry_grid, only : grid_type
   implicit none
   private
   public :: box_pairs_work_type, find_box_pairs

   !> Arrays of `find_box_pairs`, kept for the next call.
   type :: box_pairs_work_type
      private
      type(grid_type) :: grid
      integer, allocatable :: start(:), sorted(:, :)
   end type box_pairs_work_type

contains

   !> All pairs (i < j) of boxes that come closer than the margin, sorted by (i, j).
   pure subroutine find_box_pairs(boxes, margin, pairs, n_pairs, work)
      real(wp), intent(in), contiguous :: boxes(:, :)      !! (4, n) xmin, ymin, xmax, ymax
      real(wp), intent(in) :: margin                       !! largest distance of interest [L], 0 or more
      integer, allocatable, intent(inout) :: pairs(:, :)   !! (2, >= n_pairs)
      integer, intent(out) :: n_pairs
      type(box_pairs_work_type), intent(inout) :: work
      real(wp) :: half, corner(2)
      integer :: n, i, j, k, l, ix, iy, c
      n = size(boxes, 2)
      n_pairs = 0
      if (.not. allocated(pairs)) allocate (pairs(2, 4*n + 16))
      if (n < 2) return
      half = 0.5_wp*margin
      call work%grid%build_boxes(boxes, margin)
      associate (grid => work%grid, raster => work%grid%raster)
         do iy = 1, raster%ny
            do ix = 1, raster%nx
               c = ix + (iy - 1)*raster%nx
               do k = grid%start(c) + 1, grid%start(c + 1)
                  i = grid%items(k)
                  do l = k + 1, grid%start(c + 1)
                     j = grid%items(l)
                     corner = max(boxes(1:2, i), boxes(1:2, j)) - half
                     if (any(corner > min(boxes(3:4, i), boxes(3:4, j)) + half)) cycle
                     if (raster%column(corner(1)) /= ix .or. raster%row(corner(2)) /= iy) cycle
                     n_pairs = n_pairs + 1
                     call grow(pairs, n_pairs, 2)
                     pairs(:, n_pairs) = [min(i, j), max(i, j)]
                  end do
               end do
            end do
         end do
      end associate
      call sort_pairs(n, n_pairs, pairs, work)
   end subroutine find_box_pairs

   !> Sort by first, then second box: by the second ones, then, without changing the order of what is equal, by the
   !> first ones. A box that covers most others has as many pairs as there are boxes.
   pure subroutine sort_pairs(n, n_pairs, pairs, work)
      integer, intent(in) :: n, n_pairs
      integer, intent(inout), contiguous :: pairs(:, :)
      type(box_pairs_work_type), intent(inout) :: work
      call reserve(work%start, n + 1)
      if (allocated(work%sorted)) then
         if (size(work%sorted, 2) < n_pairs) deallocate (work%sorted)
      end if
      if (.not. allocated(work%sorted)) allocate (work%sorted(2, n_pairs + n_pairs/8))
      call sort_by(2, n, n_pairs, pairs, work%start, work%sorted)
      call sort_by(1, n, n_pairs, work%sorted, work%start, pairs)
   end subroutine sort_pairs

   !> Counting sort by the first (1) or second box.
   pure subroutine sort_by(which, n, n_pairs, pairs, start, sorted)
      integer, intent(in) :: which
      integer, intent(in) :: n, n_pairs
      integer, intent(in), contiguous :: pairs(:, :)
      integer, intent(inout) :: start(:)                   !! (>= n + 1) scratch
      integer, intent(inout), contiguous :: sorted(:, :)   !! (2, >= n_pairs)
      integer :: i, k
      start(1:n + 1) = 0
      do k = 1, n_pairs
         start(pairs(which, k) + 1) = start(pairs(which, k) + 1) + 1
      end do
      do i = 2, n + 1
         start(i) = start(i) + start(i - 1)
      end do
      do k = 1, n_pairs
         i = pairs(which, k)
         start(i) = start(i) + 1
         sorted(:, start(i)) = pairs(:, k)
      end do
   end subroutine sort_by

end module rockdda_geometry_box_pairs
