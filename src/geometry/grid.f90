! SPDX-License-Identifier: MIT
!> Uniform spatial grid over many boxes or segments: the candidates near a box, a segment or a point.
!>
!> Items are listed per cell in one array (CSR), built in two passes without an allocation per cell:
!>
!>     cell        1        2    3              n_cells
!>     start     | 0      | 3  | 3 |    ...   | 27     |  n_pairs      start(c) + 1 : start(c + 1) are the positions of
!>     items     | 1 5 8  |    | 2 5  ...     | 7      |               the items of cell c; item 5 lies in cells 1 and 3
!>
!> The cost of building and of queries is linear in the number of (item, cell) pairs. The cell width adapts to the
!> items, the number of cells stays below about eight per item. A query returns candidates, each once, none missing;
!> the caller tests them. Queries from several threads need one grid_query_type each.
module rockdda_geometry_grid
   use rockdda_base_kinds, only : wp
   use rockdda_base_room, only : reserve
   use rockdda_geometry_cells, only : cell_raster_type, new_raster
   implicit none
   private
   public :: grid_type, grid_query_type, typical_size

   !> Workspace and result of a query.
   type :: grid_query_type
      integer :: n = 0                    !! candidates found
      integer, allocatable :: ids(:)      !! their numbers are ids(1:n), in no useful order
      integer, allocatable :: mark(:)     !! (items) stamp of the last query that found the item
      integer :: stamp = 0
   end type grid_query_type

   type :: grid_type
      integer :: n_items = 0
      type(cell_raster_type) :: raster
      integer, allocatable :: start(:)    !! (>= cells + 1)
      integer, allocatable :: items(:)    !! (>= start(cells + 1)) item numbers by cell
   contains
      procedure :: build_boxes
      procedure :: build_segments
      procedure :: query_segment
      procedure :: query_point
      procedure :: query_box
   end type grid_type

contains

   !> Grid over boxes, each widened by half the margin on every side.
   pure subroutine build_boxes(self, boxes, margin)
      class(grid_type), intent(inout) :: self
      real(wp), intent(in), contiguous :: boxes(:, :)   !! (4, n) xmin, ymin, xmax, ymax
      real(wp), intent(in) :: margin                    !! [L], 0 or more
      real(wp) :: frame(4), half, width
      integer :: n, i, ix, iy, pass
      n = size(boxes, 2)
      half = 0.5_wp*margin
      frame = frame_of(boxes) + [-half, -half, half, half]
      width = 0
      ! width plus height of a typical box: it touches two or three cells
      if (n > 0) width = sum(typical_size(boxes, margin))
      self%n_items = n
      self%raster = new_raster(frame, min(width, max(frame(3) - frame(1), frame(4) - frame(2))), 4*n + 16)
      call begin_lists(self)
      do pass = 1, 2
         do i = 1, n
            do iy = self%raster%row(boxes(2, i) - half), self%raster%row(boxes(4, i) + half)
               do ix = self%raster%column(boxes(1, i) - half), self%raster%column(boxes(3, i) + half)
                  call put(self, ix + (iy - 1)*self%raster%nx, i, pass)
               end do
            end do
         end do
         call end_pass(self, pass)
      end do
   end subroutine build_boxes

   !> Grid over segments: only the cells along a segment hold it, so that long oblique lines cost little.
   pure subroutine build_segments(self, segments, margin)
      class(grid_type), intent(inout) :: self
      real(wp), intent(in) :: segments(:, :)   !! (4, n) x1, y1, x2, y2
      real(wp), intent(in) :: margin           !! the cells within this distance hold the segment, too [L]
      real(wp) :: boxes(4), frame(4), length, width, area
      integer :: n, i, ix, iy, pass, c, first, last
      n = size(segments, 2)
      frame = 0
      length = 0
      do i = 1, n
         boxes = box_of(segments(:, i))
         if (i == 1) frame = boxes
         frame(1:2) = min(frame(1:2), boxes(1:2))
         frame(3:4) = max(frame(3:4), boxes(3:4))
         length = length + hypot(boxes(3) - boxes(1), boxes(4) - boxes(2))
      end do
      frame(1:2) = frame(1:2) - margin
      frame(3:4) = frame(3:4) + margin
      area = (frame(3) - frame(1))*(frame(4) - frame(2))
      width = 0
      ! as many cells as cell crossings: a cell then holds one or two lines on average. No wider than a segment is long:
      ! short ones may lie side by side in a part of the frame
      if (length > 0) width = min(area/length, length/n)
      self%n_items = n
      self%raster = new_raster(frame, max(width, 2*margin), 8*n + 500000)
      call begin_lists(self)
      do pass = 1, 2
         do i = 1, n
            do ix = self%raster%column(min(segments(1, i), segments(3, i)) - margin), &
               self%raster%column(max(segments(1, i), segments(3, i)) + margin)
               call self%raster%rows_of_segment(segments(1:2, i), segments(3:4, i), margin, ix, first, last)
               do iy = first, last
                  c = ix + (iy - 1)*self%raster%nx
                  call put(self, c, i, pass)
               end do
            end do
         end do
         call end_pass(self, pass)
      end do
   end subroutine build_segments

   !> Items that share a cell with a segment, or with its surroundings up to a margin.
   pure subroutine query_segment(self, p, q, margin, query)
      class(grid_type), intent(in) :: self
      real(wp), intent(in) :: p(2), q(2)
      real(wp), intent(in) :: margin           !! [L], 0 or more
      type(grid_query_type), intent(inout) :: query
      integer :: ix, iy, first, last
      call begin_query(self, query)
      if (self%n_items == 0) return
      do ix = self%raster%column(min(p(1), q(1)) - margin), self%raster%column(max(p(1), q(1)) + margin)
         call self%raster%rows_of_segment(p, q, margin, ix, first, last)
         do iy = first, last
            call collect(self, ix + (iy - 1)*self%raster%nx, query)
         end do
      end do
   end subroutine query_segment

   !> Items that share a cell with a point.
   pure subroutine query_point(self, point, query)
      class(grid_type), intent(in) :: self
      real(wp), intent(in) :: point(2)
      type(grid_query_type), intent(inout) :: query
      call begin_query(self, query)
      if (self%n_items == 0) return
      call collect(self, self%raster%column(point(1)) + (self%raster%row(point(2)) - 1)*self%raster%nx, query)
   end subroutine query_point

   !> Items that share a cell with a box.
   pure subroutine query_box(self, box, query)
      class(grid_type), intent(in) :: self
      real(wp), intent(in) :: box(4)           !! xmin, ymin, xmax, ymax
      type(grid_query_type), intent(inout) :: query
      integer :: ix, iy
      call begin_query(self, query)
      if (self%n_items == 0) return
      do iy = self%raster%row(box(2)), self%raster%row(box(4))
         do ix = self%raster%column(box(1)), self%raster%column(box(3))
            call collect(self, ix + (iy - 1)*self%raster%nx, query)
         end do
      end do
   end subroutine query_box

   !> Box of one segment.
   pure function box_of(segment) result(box)
      real(wp), intent(in) :: segment(4)
      real(wp) :: box(4)
      box(1:2) = min(segment(1:2), segment(3:4))
      box(3:4) = max(segment(1:2), segment(3:4))
   end function box_of

   !> Box around boxes.
   pure function frame_of(boxes) result(frame)
      real(wp), intent(in) :: boxes(:, :)
      real(wp) :: frame(4)
      frame = 0
      if (size(boxes, 2) == 0) return
      frame = [minval(boxes(1, :)), minval(boxes(2, :)), maxval(boxes(3, :)), maxval(boxes(4, :))]
   end function frame_of

   !> Width and height of a typical box, widened by the margin: harmonic means, so that a few huge boxes hardly change
   !> them.
   pure function typical_size(boxes, margin) result(width)
      real(wp), intent(in), contiguous :: boxes(:, :)   !! (4, n) xmin, ymin, xmax, ymax
      real(wp), intent(in) :: margin
      real(wp) :: width(2)
      real(wp), parameter :: least = tiny(1.0_wp)*1.0e20_wp
      width = [size(boxes, 2)/sum(1/max(boxes(3, :) - boxes(1, :) + margin, least)), &
               size(boxes, 2)/sum(1/max(boxes(4, :) - boxes(2, :) + margin, least))]
   end function typical_size

   !> Set the counters to zero.
   pure subroutine begin_lists(self)
      class(grid_type), intent(inout) :: self
      call reserve(self%start, self%raster%n_cells() + 1)
      self%start(1:self%raster%n_cells() + 1) = 0
   end subroutine begin_lists

   !> First pass: count. Second pass: store, running start(c) downwards to its final value.
   pure subroutine put(self, c, item, pass)
      class(grid_type), intent(inout) :: self
      integer, intent(in) :: c, item, pass
      if (pass == 2) self%items(self%start(c)) = item
      self%start(c) = self%start(c) + merge(1, -1, pass == 1)
   end subroutine put

   !> After the first pass: replace counts by ends.
   pure subroutine end_pass(self, pass)
      class(grid_type), intent(inout) :: self
      integer, intent(in) :: pass
      integer :: c, total
      if (pass == 2) return
      total = 0
      do c = 1, self%raster%n_cells() + 1
         total = total + self%start(c)
         self%start(c) = total
      end do
      call reserve(self%items, total)
   end subroutine end_pass

   !> Clear the last result; fit the workspace to the grid.
   pure subroutine begin_query(self, query)
      class(grid_type), intent(in) :: self
      type(grid_query_type), intent(inout) :: query
      query%n = 0
      if (allocated(query%mark)) then
         if (size(query%mark) /= self%n_items .or. query%stamp == huge(query%stamp)) then
            deallocate (query%mark, query%ids)
         end if
      end if
      if (.not. allocated(query%mark)) then
         allocate (query%mark(self%n_items), query%ids(self%n_items))
         query%mark = 0
         query%stamp = 0
      end if
      query%stamp = query%stamp + 1
   end subroutine begin_query

   !> Add the items of cell c that are not in the result yet.
   pure subroutine collect(self, c, query)
      class(grid_type), intent(in) :: self
      integer, intent(in) :: c
      type(grid_query_type), intent(inout) :: query
      integer :: k, id
      do k = self%start(c) + 1, self%start(c + 1)
         id = self%items(k)
         if (query%mark(id) == query%stamp) cycle
         query%mark(id) = query%stamp
         query%n = query%n + 1
         query%ids(query%n) = id
      end do
   end subroutine collect

end module rockdda_geometry_grid
