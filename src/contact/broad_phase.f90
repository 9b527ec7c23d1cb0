! SPDX-License-Identifier: MIT
!> Broad phase of the contact search: pairs of blocks whose boxes come close.
!>
!> A uniform grid of cells about as large as a mean box; every block is listed in the cells that its box covers,
!> and a pair is counted in one cell only: the one that holds the lower left corner of the boxes' intersection.
!> Cost is linear in the number of blocks as long as the boxes are not stacked on each other.
!>
!> The pairs are found for a wider margin than asked for, and kept until a box has left the place it had then by too
!> much. They are candidates: the caller asks `is_close` of each, with the boxes as they are now. Which pairs pass, and
!> in which order, therefore does not depend on when the candidates were found.
module rockdda_contact_broad_phase
   use rockdda_base_kinds, only : wp, i8
   use rockdda_base_parallel, only : parallel_blocks
   use rockdda_base_room, only : reserve
   use rockdda_model_blocks, only : block_system_type
   implicit none
   private
   public :: close_pairs_type, grid_work_type, find_close_pairs

   !> Arrays of `find_close_pairs`, kept for the next time.
   type :: grid_work_type
      integer, allocatable :: start(:), list(:)
   end type grid_work_type

   !> Candidate pairs of blocks. A pure cache: nothing in it is part of the state.
   type :: close_pairs_type
      logical :: keep = .true.                      !! use the candidates again while they are complete
      logical :: was_kept = .false.                 !! the last update did
      integer :: n = 0                              !! candidates
      integer, allocatable :: candidates(:, :)      !! (2, >= n) first < second block, sorted
      real(wp), allocatable :: boxes(:, :)          !! (4, nb) xmin ymin xmax ymax now
      real(wp) :: reach = 0                         !! largest distance of interest now
      real(wp), allocatable, private :: places(:, :)   !! (4, nb) boxes when the candidates were found
      real(wp), private :: margin = -1              !! and the margin
      type(grid_work_type), private :: work
   contains
      procedure :: update
      procedure :: is_close
   end type close_pairs_type

contains

   !> Candidates for all pairs of blocks that come closer than `reach`.
   subroutine update(self, blocks, vertices, reach)
      class(close_pairs_type), intent(inout) :: self
      type(block_system_type), intent(in) :: blocks
      real(wp), intent(in), contiguous :: vertices(:, :)   !! (2, nv) now
      real(wp), intent(in) :: reach
      real(wp) :: moved, rounding, size_of_blocks(2)
      self%reach = reach
      if (.not. allocated(self%boxes)) then
         allocate (self%boxes(4, blocks%n_blocks), self%places(4, blocks%n_blocks))
         self%margin = -1
      end if
      call update_boxes(blocks, vertices, self%boxes)
      if (self%keep .and. self%margin >= 0) then
         call measure_motion(self%boxes, self%places, moved, rounding)
         self%was_kept = reach + 2*moved + rounding <= self%margin
         if (self%was_kept) return
      end if
      self%was_kept = .false.
      size_of_blocks = typical_size(self%boxes, 0.0_wp)
      self%margin = 1.5_wp*reach + 0.2_wp*minval(size_of_blocks)
      self%places = self%boxes
      call find_close_pairs(self%boxes, self%margin, self%candidates, self%n, self%work)
   end subroutine update

   !> Are the blocks of candidate k closer than `reach` now?
   pure logical function is_close(self, k)
      class(close_pairs_type), intent(in) :: self
      integer, intent(in) :: k
      is_close = boxes_close(self%boxes(:, self%candidates(1, k)), self%boxes(:, self%candidates(2, k)), self%reach)
   end function is_close

   !> Bounding boxes of all blocks.
   subroutine update_boxes(blocks, vertices, boxes)
      type(block_system_type), intent(in) :: blocks
      real(wp), intent(in), contiguous :: vertices(:, :)
      real(wp), intent(inout) :: boxes(:, :)
      real(wp) :: low(2), high(2)
      integer :: i, v
      !$omp parallel do default(none) shared(blocks, vertices, boxes) private(i, v, low, high) schedule(static) &
      !$omp if (blocks%n_blocks > parallel_blocks)
      do i = 1, blocks%n_blocks
         low = vertices(:, blocks%vertex_offset(i) + 1)
         high = low
         do v = blocks%vertex_offset(i) + 2, blocks%vertex_offset(i + 1)
            low = min(low, vertices(:, v))
            high = max(high, vertices(:, v))
         end do
         boxes(:, i) = [low, high]
      end do
      !$omp end parallel do
   end subroutine update_boxes

   !> How far any box reaches out of its earlier place, and a bound for the rounding of its coordinates.
   subroutine measure_motion(boxes, places, moved, rounding)
      real(wp), intent(in), contiguous :: boxes(:, :), places(:, :)
      real(wp), intent(out) :: moved, rounding
      integer :: i
      moved = 0
      rounding = 0
      !$omp parallel do default(none) shared(boxes, places) private(i) reduction(max:moved, rounding) schedule(static) &
      !$omp if (size(boxes, 2) > 4*parallel_blocks)
      do i = 1, size(boxes, 2)
         moved = max(moved, places(1, i) - boxes(1, i), places(2, i) - boxes(2, i), boxes(3, i) - places(3, i), &
                     boxes(4, i) - places(4, i))
         rounding = max(rounding, abs(boxes(1, i)), abs(boxes(2, i)), abs(boxes(3, i)), abs(boxes(4, i)))
      end do
      !$omp end parallel do
      rounding = 16*epsilon(rounding)*rounding
   end subroutine measure_motion

   !> All pairs (i < j) whose boxes, widened by half the margin on each side, overlap; sorted by (i, j).
   pure subroutine find_close_pairs(boxes, margin, pairs, n_pairs, work)
      real(wp), intent(in), contiguous :: boxes(:, :)             !! (4, n) xmin ymin xmax ymax
      real(wp), intent(in) :: margin                  !! largest distance of interest
      integer, allocatable, intent(inout) :: pairs(:, :) !! (2, >= n_pairs)
      integer, intent(out) :: n_pairs
      type(grid_work_type), intent(inout) :: work
      real(wp) :: low(2), high(2), cell(2), corner(2)
      integer :: n, i, j, k, l, ix, iy, c, n_cells, cells(2), a(2), b(2)

      n = size(boxes, 2)
      n_pairs = 0
      if (.not. allocated(pairs)) allocate (pairs(2, 4*n + 16))
      if (n < 2) return
      low = [minval(boxes(1, :)), minval(boxes(2, :))] - margin
      high = [maxval(boxes(3, :)), maxval(boxes(4, :))] + margin
      call choose_cells(boxes, margin, low, high, cell, cells)
      n_cells = cells(1)*cells(2)
      call reserve(work%start, max(n_cells + 1, n + 1))
      associate (start => work%start)
         start(1:n_cells + 1) = 0
         do i = 1, n
            call covered_cells(boxes(:, i), margin, low, cell, cells, a, b)
            do iy = a(2), b(2)
               do ix = a(1), b(1)
                  c = iy*cells(1) + ix + 1
                  start(c + 1) = start(c + 1) + 1
               end do
            end do
         end do
         do c = 2, n_cells + 1
            start(c) = start(c) + start(c - 1)
         end do
         call reserve(work%list, start(n_cells + 1))
         do i = 1, n
            call covered_cells(boxes(:, i), margin, low, cell, cells, a, b)
            do iy = a(2), b(2)
               do ix = a(1), b(1)
                  c = iy*cells(1) + ix + 1
                  start(c) = start(c) + 1
                  work%list(start(c)) = i
               end do
            end do
         end do
         do c = n_cells + 1, 2, -1
            start(c) = start(c - 1)
         end do
         start(1) = 0

         do iy = 0, cells(2) - 1
            do ix = 0, cells(1) - 1
               c = iy*cells(1) + ix + 1
               do k = start(c) + 1, start(c + 1)
                  i = work%list(k)
                  do l = k + 1, start(c + 1)
                     j = work%list(l)
                     if (.not. boxes_close(boxes(:, i), boxes(:, j), margin)) cycle
                     corner = max(boxes(1:2, i), boxes(1:2, j)) - 0.5_wp*margin
                     a = cell_of(corner, low, cell, cells)
                     if (a(1) /= ix .or. a(2) /= iy) cycle
                     call append_pair(i, j, pairs, n_pairs)
                  end do
               end do
            end do
         end do
      end associate
      call sort_pairs(n, n_pairs, pairs, work)
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
      real(wp), intent(in), contiguous :: boxes(:, :)
      real(wp), intent(in) :: margin, low(2), high(2)
      real(wp), intent(out) :: cell(2)
      integer, intent(out) :: cells(2)
      integer :: n
      real(wp) :: extent(2), least
      n = size(boxes, 2)
      extent = max(high - low, tiny(1.0_wp))
      cell = typical_size(boxes, margin)
      least = sqrt(extent(1)*extent(2)/(4.0_wp*n))
      if (cell(1)*cell(2) < least**2) cell = cell*(least/sqrt(cell(1)*cell(2)))
      cells = int(min(max(extent/cell, 1.0_wp), 2.0e4_wp))
      do while (int(cells(1), i8)*cells(2) > 8_i8*n + 64)
         cells = max(cells/2, 1)
      end do
      cell = extent/cells
   end subroutine choose_cells

   !> Width and height of a typical box, widened by the margin. Harmonic means: a few huge blocks (abutments) must not
   !> spoil it.
   pure function typical_size(boxes, margin) result(width)
      real(wp), intent(in), contiguous :: boxes(:, :)
      real(wp), intent(in) :: margin
      real(wp) :: width(2)
      real(wp), parameter :: least = tiny(1.0_wp)*1.0e20_wp
      width = [size(boxes, 2)/sum(1/max(boxes(3, :) - boxes(1, :) + margin, least)), &
               size(boxes, 2)/sum(1/max(boxes(4, :) - boxes(2, :) + margin, least))]
   end function typical_size

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
   pure subroutine sort_pairs(n, n_pairs, pairs, work)
      integer, intent(in) :: n, n_pairs
      integer, intent(inout) :: pairs(:, :)
      type(grid_work_type), intent(inout) :: work   !! room for n + 1 starts
      integer :: i, k, l, j
      call reserve(work%list, n_pairs)
      associate (start => work%start, second => work%list)
         start(1:n + 1) = 0
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
            do k = start(i) + 1, start(i + 1)
               pairs(:, k) = [i, second(k)]
            end do
         end do
      end associate
   end subroutine sort_pairs

end module rockdda_contact_broad_phase
