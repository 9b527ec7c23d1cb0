! SPDX-License-Identifier: MIT
!> Raster of square cells over a rectangle; the cells that a box or a segment touches.
!>
!>     columns 1 ... nx from x0 rightwards, rows 1 ... ny from y0 upwards; cell number = ix + (iy - 1) nx
!>
!> Everything outside belongs to the nearest border cell, so that every point has a cell.
module rockdda_geometry_cells
   use rockdda_base_kinds, only : wp
   implicit none
   private
   public :: cell_raster_type, new_raster

   type :: cell_raster_type
      real(wp) :: x0 = 0, y0 = 0    !! lower left corner
      real(wp) :: width = 1         !! of a cell [L]
      integer :: nx = 1, ny = 1
   contains
      procedure :: column
      procedure :: row
      procedure :: n_cells
      procedure :: rows_of_segment
   end type cell_raster_type

contains

   !> A raster over a box with cells of at least `width`, and no more than `max_cells` of them (about).
   pure function new_raster(box, width, max_cells) result(raster)
      real(wp), intent(in) :: box(4)       !! xmin, ymin, xmax, ymax
      real(wp), intent(in) :: width        !! wanted width of a cell [L]; 0: as small as max_cells allows
      integer, intent(in) :: max_cells
      type(cell_raster_type) :: raster
      real(wp) :: a, b, w, limit
      a = max(box(3) - box(1), 0.0_wp)
      b = max(box(4) - box(2), 0.0_wp)
      limit = real(max(max_cells, 1), wp)
      w = max(width, sqrt(a*b/limit), max(a, b)/limit)
      if (.not. w > tiny(w)*1.0e10_wp) w = 1
      raster%x0 = box(1)
      raster%y0 = box(2)
      raster%width = w
      raster%nx = 1 + int(a/w)
      raster%ny = 1 + int(b/w)
   end function new_raster

   !> Column that holds x.
   pure integer function column(self, x)
      class(cell_raster_type), intent(in) :: self
      real(wp), intent(in) :: x
      column = 1 + int(max(0.0_wp, min(self%nx*self%width, x - self%x0))/self%width)
      column = min(column, self%nx)
   end function column

   !> Row that holds y.
   pure integer function row(self, y)
      class(cell_raster_type), intent(in) :: self
      real(wp), intent(in) :: y
      row = 1 + int(max(0.0_wp, min(self%ny*self%width, y - self%y0))/self%width)
      row = min(row, self%ny)
   end function row

   !> Number of cells.
   pure integer function n_cells(self)
      class(cell_raster_type), intent(in) :: self
      n_cells = self%nx*self%ny
   end function n_cells

   !> Rows of column ix whose cells may come within `margin` of the segment p q. The columns of the segment are those
   !> from column(min(px, qx) - margin) to column(max(px, qx) + margin). first > last: none.
   pure subroutine rows_of_segment(self, p, q, margin, ix, first, last)
      class(cell_raster_type), intent(in) :: self
      real(wp), intent(in) :: p(2), q(2), margin
      integer, intent(in) :: ix
      integer, intent(out) :: first, last
      real(wp) :: left, right, ya, yb, slope
      left = -huge(left)
      right = huge(right)
      ! border columns extend to infinity; one per mille of a cell covers the rounding of column()
      if (ix > 1) left = self%x0 + (ix - 1.001_wp)*self%width - margin
      if (ix < self%nx) right = self%x0 + (ix + 0.001_wp)*self%width + margin
      left = max(left, min(p(1), q(1)))
      right = min(right, max(p(1), q(1)))
      first = 1
      last = 0
      if (left > right) return
      ya = min(p(2), q(2))
      yb = max(p(2), q(2))
      if (abs(q(1) - p(1)) > self%width) then
         slope = (q(2) - p(2))/(q(1) - p(1))
         if (slope >= 0) then
            ya = max(ya, p(2) + slope*(left - p(1)))
            yb = min(yb, p(2) + slope*(right - p(1)))
         else
            ya = max(ya, p(2) + slope*(right - p(1)))
            yb = min(yb, p(2) + slope*(left - p(1)))
         end if
      end if
      first = self%row(ya - margin - 0.001_wp*self%width)
      last = self%row(yb + margin + 0.001_wp*self%width)
   end subroutine rows_of_segment

end module rockdda_geometry_cells
