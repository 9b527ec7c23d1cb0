! SPDX-License-Identifier: MIT
!> Growing set of points with queries in nearly constant time: the nearest point, the points along a segment.
!>
!> Points are chained per cell (head and next arrays), so that points can be added between queries.
module rockdda_geometry_point_bins
   use rockdda_base_kinds, only : wp
   use rockdda_base_room, only : grow
   use rockdda_geometry_cells, only : cell_raster_type, new_raster
   implicit none
   private
   public :: point_bins_type

   type :: point_bins_type
      integer :: n = 0                           !! points held
      real(wp), allocatable :: position(:, :)    !! (2, capacity)
      type(cell_raster_type) :: raster
      integer, allocatable :: head(:)            !! (cells) newest point of the cell, 0 none
      integer, allocatable :: next(:)            !! (capacity) the one before it in the same cell
   contains
      procedure :: init
      procedure :: add
      procedure :: nearest => nearest_point
      procedure :: along
   end type point_bins_type

contains

   !> Empty set.
   pure subroutine init(self, box, expected, radius)
      class(point_bins_type), intent(inout) :: self
      real(wp), intent(in) :: box(4)      !! xmin, ymin, xmax, ymax of most points (queries for others are slower)
      integer, intent(in) :: expected     !! number of points, a guess
      real(wp), intent(in) :: radius      !! usual radius of queries [L]
      if (allocated(self%head)) deallocate (self%head, self%next, self%position)
      self%n = 0
      self%raster = new_raster(box, radius, 2*expected + 16)
      allocate (self%head(self%raster%n_cells()), self%next(max(16, expected)), self%position(2, max(16, expected)))
      self%head = 0
   end subroutine init

   !> Add a point; its number is the next in order.
   pure subroutine add(self, point, number)
      class(point_bins_type), intent(inout) :: self
      real(wp), intent(in) :: point(2)
      integer, intent(out) :: number
      integer :: c
      self%n = self%n + 1
      call grow(self%next, self%n)
      call grow(self%position, self%n, 2)
      number = self%n
      self%position(:, number) = point
      c = self%raster%column(point(1)) + (self%raster%row(point(2)) - 1)*self%raster%nx
      self%next(number) = self%head(c)
      self%head(c) = number
   end subroutine add

   !> Number of the nearest point closer than `radius`, the smallest number of equally near ones; 0 if none.
   pure integer function nearest_point(self, point, radius)
      class(point_bins_type), intent(in) :: self
      real(wp), intent(in) :: point(2), radius
      integer :: ix, iy, k
      real(wp) :: d, best
      nearest_point = 0
      best = radius
      do iy = self%raster%row(point(2) - radius), self%raster%row(point(2) + radius)
         do ix = self%raster%column(point(1) - radius), self%raster%column(point(1) + radius)
            k = self%head(ix + (iy - 1)*self%raster%nx)
            do while (k > 0)
               d = hypot(self%position(1, k) - point(1), self%position(2, k) - point(2))
               if (d < best) then
                  best = d
                  nearest_point = k
               else if (nearest_point > 0 .and. .not. d > best) then
                  nearest_point = min(nearest_point, k)
               end if
               k = self%next(k)
            end do
         end do
      end do
   end function nearest_point

   !> Points in the cells within `margin` of the segment p q: ids(1:n), none missing; ids grows as needed.
   pure subroutine along(self, p, q, margin, ids, n)
      class(point_bins_type), intent(in) :: self
      real(wp), intent(in) :: p(2), q(2), margin
      integer, allocatable, intent(inout) :: ids(:)
      integer, intent(out) :: n
      integer :: ix, iy, k, first, last
      if (.not. allocated(ids)) allocate (ids(64))
      n = 0
      do ix = self%raster%column(min(p(1), q(1)) - margin), self%raster%column(max(p(1), q(1)) + margin)
         call self%raster%rows_of_segment(p, q, margin, ix, first, last)
         do iy = first, last
            k = self%head(ix + (iy - 1)*self%raster%nx)
            do while (k > 0)
               n = n + 1
               call grow(ids, n)
               ids(n) = k
               k = self%next(k)
            end do
         end do
      end do
   end subroutine along

end module rockdda_geometry_point_bins
