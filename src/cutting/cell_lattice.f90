! SPDX-License-Identifier: MIT
!> The lattice along whose lines a block is cut into cells.
!>
!> In lattice coordinates (u, v) the lines of the first two families are u = i and v = j, for whole numbers i and j. For
!> triangles two more families halve the squares, by diagonals of alternating direction:
!>
!>     +-----+-----+        rectangles:  u = i,  v = j
!>     | \   |   / |        triangles:   also (u + v)/2 = i and (u - v)/2 = j
!>     |   \ | /   |
!>     +-----+-----+
!>     |   / | \   |
!>     | /   |   \ |
!>     +-----+-----+
!>
!> A block that is a rectangle, in any direction, has a lattice of its own with nx times ny cells, their sides as
!> near to the wanted size as whole numbers allow. Other blocks share one lattice along the axes, which fits a box.
module rockdda_cutting_cell_lattice
   use rockdda_base_kinds, only : wp
   use rockdda_geometry_segments, only : cross_product
   implicit none
   private
   public :: lattice_type, cell_kind, box_lattice, rectangle_lattice

   type :: cell_kind_enum
      integer :: rectangles = 1
      integer :: triangles = 2
   end type cell_kind_enum
   type(cell_kind_enum), parameter :: cell_kind = cell_kind_enum()

   !> Sines up to this count as 0, in the judgement whether a block is a rectangle: input may have six digits.
   real(wp), parameter :: rectangle_tolerance = 1.0e-6_wp

   type :: lattice_type
      integer :: kind = cell_kind%rectangles
      real(wp) :: origin(2) = 0
      real(wp) :: axis(2) = [1.0_wp, 0.0_wp]     !! direction of u; v is a quarter turn to the left
      real(wp) :: spacing(2) = 1                 !! of the lines of the first two families [L]
   contains
      procedure :: n_families
      procedure, nopass :: normal
      procedure :: place
      procedure :: thickness
   end type lattice_type

contains

   !> Lattice along the axes that fits a box.
   pure function box_lattice(box, size, kind) result(lattice)
      real(wp), intent(in) :: box(4)             !! xmin, ymin, xmax, ymax
      real(wp), intent(in) :: size               !! wanted length of the sides [L]
      integer, intent(in) :: kind                !! one of cell_kind%...
      type(lattice_type) :: lattice
      lattice%kind = kind
      lattice%origin = box(1:2)
      lattice%spacing = (box(3:4) - box(1:2))/number_of_parts(box(3:4) - box(1:2), size)
   end function box_lattice

   !> Lattice of a block that is a rectangle; vertices on its sides are allowed. Not found: the block is none.
   pure subroutine rectangle_lattice(vertices, size, kind, lattice, found)
      real(wp), intent(in) :: vertices(:, :)     !! (2, n) outline without bridges, counter-clockwise
      real(wp), intent(in) :: size               !! wanted length of the sides [L]
      integer, intent(in) :: kind                !! one of cell_kind%...
      type(lattice_type), intent(out) :: lattice
      logical, intent(out) :: found
      real(wp) :: corner(2, 4), side(2, 4), length(4), a(2), b(2)
      integer :: k, n, m, first
      found = .false.
      n = ubound(vertices, 2)
      m = 0
      do k = 1, n
         a = vertices(:, k) - vertices(:, 1 + mod(k - 2 + n, n))
         b = vertices(:, 1 + mod(k, n)) - vertices(:, k)
         if (abs(cross_product(a, b)) <= rectangle_tolerance*norm2(a)*norm2(b) .and. dot_product(a, b) > 0) cycle
         m = m + 1
         if (m > 4) return
         corner(:, m) = vertices(:, k)
      end do
      if (m < 4) return
      side = cshift(corner, 1, 2) - corner
      length = norm2(side, 1)
      do k = 1, 4
         if (abs(dot_product(side(:, k), side(:, 1 + mod(k, 4)))) > &
             rectangle_tolerance*length(k)*length(1 + mod(k, 4))) return
      end do
      found = .true.
      first = maxloc(side(1, :)/length, 1)
      lattice%kind = kind
      lattice%origin = corner(:, first)
      lattice%axis = side(:, first)/length(first)
      lattice%spacing = [length(first), length(1 + mod(first, 4))]
      lattice%spacing = lattice%spacing/number_of_parts(lattice%spacing, size)
   end subroutine rectangle_lattice

   !> Into how many parts of about this size a length is divided.
   elemental real(wp) function number_of_parts(length, size)
      real(wp), intent(in) :: length, size
      number_of_parts = max(1.0_wp, anint(length/size))
   end function number_of_parts

   !> Number of families of lines.
   pure integer function n_families(self)
      class(lattice_type), intent(in) :: self
      n_families = merge(2, 4, self%kind == cell_kind%rectangles)
   end function n_families

   !> Family f consists of the lines normal . (u, v) = i.
   pure function normal(family)
      integer, intent(in) :: family
      real(wp) :: normal(2)
      real(wp), parameter :: normals(2, 4) = reshape([1.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.5_wp, 0.5_wp, &
                                                      0.5_wp, -0.5_wp], [2, 4])
      normal = normals(:, family)
   end function normal

   !> Lattice coordinates (u, v) of a point.
   pure function place(self, point)
      class(lattice_type), intent(in) :: self
      real(wp), intent(in) :: point(2)
      real(wp) :: place(2), d(2)
      d = point - self%origin
      place(1) = dot_product(d, self%axis)/self%spacing(1)
      place(2) = cross_product(self%axis, d)/self%spacing(2)
   end function place

   !> Twice the area over the perimeter of a whole cell.
   pure real(wp) function thickness(self)
      class(lattice_type), intent(in) :: self
      associate (a => self%spacing(1), b => self%spacing(2))
         if (self%kind == cell_kind%rectangles) then
            thickness = a*b/(a + b)
         else
            thickness = a*b/(a + b + hypot(a, b))
         end if
      end associate
   end function thickness

end module rockdda_cutting_cell_lattice
