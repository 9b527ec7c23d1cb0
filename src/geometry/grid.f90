! SPDX-License-Identifier: MIT
!> Uniform spatial grid over many boxes or segments: which of them may be near a box, a segment or a point?
!>
!> Items are listed per cell in one array (CSR), built in two passes without an allocation per cell:
!>
!>     start(c) + 1 ... start(c + 1)   positions in items of what touches cell c (cell numbers from 0 here)
!>
!> Building and asking are linear in the number of (item, cell) pairs. The cell width adapts to the items, the
!> number of cells stays below about eight per item. A query returns candidates, each once, none missing;
!> the caller tests them. Queries from several threads need one grid_query_type each.
module rockdda_geometry_grid
   use rockdda_base_kinds, only : wp
   use rockdda_geometry_cells, only : cell_raster_type, new_raster
   implicit none
   private
   public :: grid_type, grid_query_type

   !> Workspace and answer of a query.
   type :: grid_query_type
      integer :: n = 0                    !! candidates found
      integer, allocatable :: ids(:)      !! their numbers are ids(1:n), in no useful order
      integer, allocatable :: mark(:)     !! (items) stamp of the last query that met the item
      integer :: stamp = 0
   end type grid_query_type

   type :: grid_type
      integer :: n_items = 0
      type(cell_raster_type) :: raster
      integer, allocatable :: start(:)    !! (cells + 1)
      integer, allocatable :: items(:)    !! item numbers by cell
   contains
      procedure :: build_boxes
      procedure :: build_segments
      procedure :: query_segment
      procedure :: query_point
      procedure :: query_box
   end type grid_type

contains

   !> Grid over boxes. Enlarge the boxes first when near misses are wanted.
   pure subroutine build_boxes(self, boxes)
      class(grid_type), intent(inout) :: self
      real(wp), intent(in) :: boxes(:, :)      !! (4, n) xmin, ymin, xmax, ymax
      real(wp) :: frame(4), width
      integer :: n, i, ix, iy, pass, c
      n = size(boxes, 2)
      frame = frame_of(boxes)
      width = 0
      ! twice the mean size: a typical box touches a few cells, and a few giants do not spoil it for the others
      if (n > 0) width = (sum(boxes(3, :) - boxes(1, :)) + sum(boxes(4, :) - boxes(2, :)))/n
      self%n_items = n
      self%raster = new_raster(frame, min(width, max(frame(3) - frame(1), frame(4) - frame(2))), 4*n + 16)
      call begin_lists(self)
      do pass = 1, 2
         do i = 1, n
            do iy = self%raster%row(boxes(2, i)), self%raster%row(boxes(4, i))
               do ix = self%raster%column(boxes(1, i)), self%raster%column(boxes(3, i))
                  c = ix + (iy - 1)*self%raster%nx
                  call put(self, c, i, pass)
               end do
            end do
         end do
         call end_pass(self, pass)
      end do
   end subroutine build_boxes

   !> Grid over segments: only the cells along a segment hold it, so long oblique lines are welcome.
   pure subroutine build_segments(self, segments, margin)
      class(grid_type), intent(inout) :: self
      real(wp), intent(in) :: segments(:, :)   !! (4, n) x1, y1, x2, y2
      real(wp), intent(in) :: margin           !! a segment is also held by the cells within this distance [L]
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
      ! as many cells as cell crossings: a cell then sees one or two lines on average
      if (length > 0) width = area/length
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

   !> Zero the counters.
   pure subroutine begin_lists(self)
      class(grid_type), intent(inout) :: self
      if (allocated(self%start)) deallocate (self%start)
      if (allocated(self%items)) deallocate (self%items)
      allocate (self%start(self%raster%n_cells() + 1), source=0)
   end subroutine begin_lists

   !> First pass: count. Second pass: store, running start(c) downwards to its final value.
   pure subroutine put(self, c, item, pass)
      class(grid_type), intent(inout) :: self
      integer, intent(in) :: c, item, pass
      if (pass == 2) self%items(self%start(c)) = item
      self%start(c) = self%start(c) + merge(1, -1, pass == 1)
   end subroutine put

   !> After the first pass: counts to ends.
   pure subroutine end_pass(self, pass)
      class(grid_type), intent(inout) :: self
      integer, intent(in) :: pass
      integer :: c, total
      if (pass == 2) return
      total = 0
      do c = 1, size(self%start)
         total = total + self%start(c)
         self%start(c) = total
      end do
      allocate (self%items(total))
   end subroutine end_pass

   !> Forget the last answer; fit the workspace to the grid.
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

   !> Add what cell c holds and the query has not met.
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
