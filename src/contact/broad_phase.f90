! SPDX-License-Identifier: MIT
!> Broad phase of the contact search: pairs of blocks whose boxes come close.
!>
!> A uniform grid of cells about as large as a mean box; every block is listed in the cells that its box covers,
!> and a pair is counted in one cell only: the one that holds the lower left corner of the boxes' intersection.
!> Cost is linear in the number of blocks as long as the boxes are not stacked on each other.
module rockdda_contact_broad_phase
   use rockdda_base_kinds, only : wp, i8
   implicit none
   private
   public :: find_close_pairs

contains

   !> All pairs (i < j) whose boxes, widened by half the margin on each side, overlap; sorted by (i, j).
   pure subroutine find_close_pairs(boxes, margin, pairs, n_pairs)
      real(wp), intent(in) :: boxes(:, :)             !! (4, n) xmin ymin xmax ymax
      real(wp), intent(in) :: margin                  !! largest distance of interest
      integer, allocatable, intent(inout) :: pairs(:, :) !! (2, >= n_pairs)
      integer, intent(out) :: n_pairs
      real(wp) :: low(2), high(2), cell(2), corner(2)
      integer, allocatable :: start(:), list(:)
      integer :: n, i, j, k, l, ix, iy, c, cells(2), a(2), b(2)

      n = size(boxes, 2)
      n_pairs = 0
      if (.not. allocated(pairs)) allocate (pairs(2, 4*n + 16))
      if (n < 2) return
      low = minval(boxes(1:2, :), dim=2) - margin
      high = maxval(boxes(3:4, :), dim=2) + margin
      call choose_cells(boxes, margin, low, high, cell, cells)

      allocate (start(cells(1)*cells(2) + 1), source=0)
      do i = 1, n
         call covered_cells(boxes(:, i), margin, low, cell, cells, a, b)
         do iy = a(2), b(2)
            do ix = a(1), b(1)
               c = iy*cells(1) + ix + 1
               start(c + 1) = start(c + 1) + 1
            end do
         end do
      end do
      do c = 2, size(start)
         start(c) = start(c) + start(c - 1)
      end do
      allocate (list(start(size(start))))
      do i = 1, n
         call covered_cells(boxes(:, i), margin, low, cell, cells, a, b)
         do iy = a(2), b(2)
            do ix = a(1), b(1)
               c = iy*cells(1) + ix + 1
               start(c) = start(c) + 1
               list(start(c)) = i
            end do
         end do
      end do
      do c = size(start), 2, -1
         start(c) = start(c - 1)
      end do
      start(1) = 0

      do iy = 0, cells(2) - 1
         do ix = 0, cells(1) - 1
            c = iy*cells(1) + ix + 1
            do k = start(c) + 1, start(c + 1)
               i = list(k)
               do l = k + 1, start(c + 1)
                  j = list(l)
                  if (.not. boxes_close(boxes(:, i), boxes(:, j), margin)) cycle
                  corner = max(boxes(1:2, i), boxes(1:2, j)) - 0.5_wp*margin
                  a = cell_of(corner, low, cell, cells)
                  if (a(1) /= ix .or. a(2) /= iy) cycle
                  call append_pair(i, j, pairs, n_pairs)
               end do
            end do
         end do
      end do
      call sort_pairs(n, n_pairs, pairs)
   end subroutine find_close_pairs

   !> Add one pair, growing the list when needed.
   pure subroutine append_pair(first, second, pairs, n_pairs)
      integer, intent(in) :: first, second
      integer, allocatable, intent(inout) :: pairs(:, :)
      integer, intent(inout) :: n_pairs
      integer, allocatable :: larger(:, :)
      if (n_pairs == size(pairs, 2)) then
         allocate (larger(2, 2*n_pairs))
         larger(:, 1:n_pairs) = pairs
         call move_alloc(larger, pairs)
      end if
      n_pairs = n_pairs + 1
      pairs(:, n_pairs) = [first, second]
   end subroutine append_pair

   !> Cell size near the mean box, and at most about 4 cells per block.
   pure subroutine choose_cells(boxes, margin, low, high, cell, cells)
      real(wp), intent(in) :: boxes(:, :), margin, low(2), high(2)
      real(wp), intent(out) :: cell(2)
      integer, intent(out) :: cells(2)
      integer :: n
      real(wp) :: extent(2), least
      n = size(boxes, 2)
      extent = max(high - low, tiny(1.0_wp))
      ! median-like size: a few huge blocks (abutments) must not make the cells huge
      cell = [n/sum(1/max(boxes(3, :) - boxes(1, :) + margin, tiny(1.0_wp)*1.0e20_wp)), &
              n/sum(1/max(boxes(4, :) - boxes(2, :) + margin, tiny(1.0_wp)*1.0e20_wp))]
      least = sqrt(extent(1)*extent(2)/(4.0_wp*n))
      if (cell(1)*cell(2) < least**2) cell = cell*(least/sqrt(cell(1)*cell(2)))
      cells = int(min(max(extent/cell, 1.0_wp), 2.0e4_wp))
      do while (int(cells(1), i8)*cells(2) > 8_i8*n + 64)
         cells = max(cells/2, 1)
      end do
      cell = extent/cells
   end subroutine choose_cells

   !> Cell numbers (from 0) that a widened box covers.
   pure subroutine covered_cells(box, margin, low, cell, cells, first, last)
      real(wp), intent(in) :: box(4), margin, low(2), cell(2)
      integer, intent(in) :: cells(2)
      integer, intent(out) :: first(2), last(2)
      first = cell_of(box(1:2) - 0.5_wp*margin, low, cell, cells)
      last = cell_of(box(3:4) + 0.5_wp*margin, low, cell, cells)
   end subroutine covered_cells

   !> Cell of a point, clipped to the grid.
   pure function cell_of(point, low, cell, cells) result(index)
      real(wp), intent(in) :: point(2), low(2), cell(2)
      integer, intent(in) :: cells(2)
      integer :: index(2)
      index = max(0, min(cells - 1, int((point - low)/cell)))
   end function cell_of

   !> Do two boxes come closer than the margin in both directions?
   pure logical function boxes_close(p, q, margin)
      real(wp), intent(in) :: p(4), q(4), margin
      boxes_close = all(p(1:2) - margin <= q(3:4)) .and. all(q(1:2) - margin <= p(3:4))
   end function boxes_close

   !> Sort by first, then second block: counting sort by the first, insertion sort within.
   pure subroutine sort_pairs(n, n_pairs, pairs)
      integer, intent(in) :: n, n_pairs
      integer, intent(inout) :: pairs(:, :)
      integer, allocatable :: start(:), second(:)
      integer :: i, k, l, j
      allocate (start(n + 1), source=0)
      allocate (second(n_pairs))
      do k = 1, n_pairs
         start(pairs(1, k) + 1) = start(pairs(1, k) + 1) + 1
      end do
      do i = 2, n + 1
         start(i) = start(i) + start(i - 1)
      end do
      do k = 1, n_pairs
         i = pairs(1, k)
         start(i) = start(i) + 1
         second(start(i)) = pairs(2, k)
      end do
      do i = n + 1, 2, -1
         start(i) = start(i - 1)
      end do
      start(1) = 0
      do i = 1, n
         do k = start(i) + 2, start(i + 1)
            j = second(k)
            l = k - 1
            do while (l > start(i))
               if (second(l) <= j) exit
               second(l + 1) = second(l)
               l = l - 1
            end do
            second(l + 1) = j
         end do
         pairs(1, start(i) + 1:start(i + 1)) = i
         pairs(2, start(i) + 1:start(i + 1)) = second(start(i) + 1:start(i + 1))
      end do
   end subroutine sort_pairs

end module rockdda_contact_broad_phase
