! SPDX-License-Identifier: MIT
!> Area that a polygon has in common with the union of polygons and circles.
!>
!> The plane is cut into vertical strips at all ends and crossings of the outlines, so that nothing crosses within a
!> strip: there the outlines are curves one above the other, and the area between two of them that bound a piece inside
!> both is an integral in closed form. Outlines that lie on one another give strips or pieces of no area, in any
!> order rounding puts them, so that no tolerance is needed. Polygons may touch themselves (bridges).
module rockdda_geometry_common_area
   use rockdda_base_kinds, only : wp
   use rockdda_base_room, only : grow
   use rockdda_base_sorting, only : sorted_order
   use rockdda_geometry_polygons, only : polygon_area, point_in_polygon
   implicit none
   private
   public :: shape_type, set_polygon, set_box, set_circle, common_area

   !> A polygon, or a circle.
   type :: shape_type
      real(wp), allocatable :: corners(:, :)   !! (2, n) either direction; not allocated: a circle
      real(wp) :: centre(2) = 0                !! of the circle
      real(wp) :: radius = 0                   !! of the circle
      real(wp) :: box(4) = 0                   !! xmin ymin xmax ymax
   end type shape_type

   !> A line, or the upper or lower half of a circle, between x(1) and x(2), relative to a corner of the polygon.
   type :: curve_type
      integer :: shape = 0                     !! 0: the polygon
      integer :: side = 0                      !! 1, -1: upper, lower half of a circle; 0: straight
      real(wp) :: x(2) = 0, y(2) = 0           !! ends; of a half circle its centre in x(1), y(1), its radius in y(2)
      real(wp) :: range(2) = 0                 !! of x
   end type curve_type

contains

   !> Make a shape a polygon.
   pure subroutine set_polygon(shape, corners)
      type(shape_type), intent(inout) :: shape
      real(wp), intent(in) :: corners(:, :)    !! (2, n)
      shape%corners = corners
      shape%box = [minval(corners, dim=2), maxval(corners, dim=2)]
   end subroutine set_polygon

   !> Make a shape a box.
   pure subroutine set_box(shape, box)
      type(shape_type), intent(inout) :: shape
      real(wp), intent(in) :: box(4)           !! xmin ymin xmax ymax
      call set_polygon(shape, reshape(box([1, 2, 3, 2, 3, 4, 1, 4]), [2, 4]))
   end subroutine set_box

   !> Make a shape a circle.
   pure subroutine set_circle(shape, centre, radius)
      type(shape_type), intent(inout) :: shape
      real(wp), intent(in) :: centre(2), radius
      if (allocated(shape%corners)) deallocate (shape%corners)
      shape%centre = centre
      shape%radius = radius
      shape%box = [centre - radius, centre + radius]
   end subroutine set_circle

   !> Area that a polygon has in common with the union of shapes.
   pure real(wp) function common_area(polygon, shapes) result(area)
      real(wp), intent(in) :: polygon(:, :)            !! (2, n) corners
      type(shape_type), intent(in) :: shapes(:)
      type(curve_type), allocatable :: curves(:)
      real(wp) :: box(4)
      integer :: k, n
      logical :: meets
      area = 0
      box = [minval(polygon, dim=2), maxval(polygon, dim=2)]
      n = 0
      do k = 1, size(shapes)
         if (any(shapes(k)%box(1:2) >= box(3:4)) .or. any(shapes(k)%box(3:4) <= box(1:2))) cycle
         call meets_outline(shapes(k), box, meets)
         if (meets) then
            if (n == 0) then
               allocate (curves(16))
               call add_polygon(polygon, 0, box, polygon(:, 1), curves, n)
            end if
            call add_shape(shapes(k), k, box, polygon(:, 1), curves, n)
         else if (holds_corner(shapes(k), polygon(:, 1))) then
            area = abs(polygon_area(polygon))
            return
         end if
      end do
      if (n == 0) return
      area = area_of_strips(curves(1:n), size(shapes))
   end function common_area

   !> Does the outline of a shape enter a box?
   pure subroutine meets_outline(shape, box, meets)
      type(shape_type), intent(in) :: shape
      real(wp), intent(in) :: box(4)
      logical, intent(out) :: meets
      real(wp) :: p(2), q(2), far(2)
      integer :: k, n
      if (allocated(shape%corners)) then
         n = size(shape%corners, 2)
         meets = .true.
         do k = 1, n
            p = shape%corners(:, k)
            q = shape%corners(:, 1 + mod(k, n))
            if (any(max(p, q) < box(1:2)) .or. any(min(p, q) > box(3:4))) cycle
            return
         end do
         meets = .false.
      else
         p = min(max(shape%centre, box(1:2)), box(3:4)) - shape%centre
         far = max(abs(box(1:2) - shape%centre), abs(box(3:4) - shape%centre))
         meets = norm2(p) <= shape%radius .and. norm2(far) >= shape%radius
      end if
   end subroutine meets_outline

   !> Does a shape hold a point that is not near its outline?
   pure logical function holds_corner(shape, point)
      type(shape_type), intent(in) :: shape
      real(wp), intent(in) :: point(2)
      if (allocated(shape%corners)) then
         holds_corner = point_in_polygon(point, shape%corners)
      else
         holds_corner = norm2(point - shape%centre) < shape%radius
      end if
   end function holds_corner

   !> Curves of a shape.
   pure subroutine add_shape(shape, number, box, origin, curves, n)
      type(shape_type), intent(in) :: shape
      integer, intent(in) :: number
      real(wp), intent(in) :: box(4), origin(2)
      type(curve_type), allocatable, intent(inout) :: curves(:)
      integer, intent(inout) :: n
      type(curve_type) :: new
      integer :: side
      if (allocated(shape%corners)) then
         call add_polygon(shape%corners, number, box, origin, curves, n)
         return
      end if
      new%shape = number
      new%x = shape%centre(1) - origin(1)
      new%y = [shape%centre(2) - origin(2), shape%radius]
      new%range = [max(shape%box(1), box(1)), min(shape%box(3), box(3))] - origin(1)
      do side = -1, 1, 2
         new%side = side
         call append(new, curves, n)
      end do
   end subroutine add_shape

   !> Curves of a polygon within the width of a box: those above it do not count, those below it lie along a line there.
   pure subroutine add_polygon(corners, number, box, origin, curves, n)
      real(wp), intent(in) :: corners(:, :)
      integer, intent(in) :: number
      real(wp), intent(in) :: box(4), origin(2)
      type(curve_type), allocatable, intent(inout) :: curves(:)
      integer, intent(inout) :: n
      type(curve_type) :: new
      real(wp) :: p(2), q(2)
      integer :: k, m
      m = size(corners, 2)
      new%shape = number
      do k = 1, m
         p = corners(:, k)
         q = corners(:, 1 + mod(k, m))
         if (max(p(1), q(1)) <= box(1) .or. min(p(1), q(1)) >= box(3) .or. min(p(2), q(2)) > box(4)) cycle
         if (.not. abs(q(1) - p(1)) > 0) cycle
         if (max(p(2), q(2)) < box(2)) then
            p(2) = box(2) - (box(4) - box(2))
            q(2) = p(2)
         end if
         if (q(1) < p(1)) then
            new%x = [q(1), p(1)] - origin(1)
            new%y = [q(2), p(2)] - origin(2)
         else
            new%x = [p(1), q(1)] - origin(1)
            new%y = [p(2), q(2)] - origin(2)
         end if
         new%range = [max(new%x(1), box(1) - origin(1)), min(new%x(2), box(3) - origin(1))]
         call append(new, curves, n)
      end do
   end subroutine add_polygon

   !> Append a curve.
   pure subroutine append(new, curves, n)
      type(curve_type), intent(in) :: new
      type(curve_type), allocatable, intent(inout) :: curves(:)
      integer, intent(inout) :: n
      type(curve_type), allocatable :: more(:)
      if (n == size(curves)) then
         allocate (more(2*n))
         more(1:n) = curves
         call move_alloc(more, curves)
      end if
      n = n + 1
      curves(n) = new
   end subroutine append

   !> Sum of the areas in all strips.
   pure real(wp) function area_of_strips(curves, n_shapes) result(area)
      type(curve_type), intent(in) :: curves(:)
      integer, intent(in) :: n_shapes
      real(wp), allocatable :: cuts(:)
      integer :: i
      call find_strips(curves, cuts)
      area = 0
      do i = 2, size(cuts)
         if (cuts(i) > cuts(i - 1)) area = area + area_in_strip(curves, n_shapes, cuts(i - 1), cuts(i))
      end do
   end function area_of_strips

   !> Ends and crossings of the curves, by x.
   pure subroutine find_strips(curves, cuts)
      type(curve_type), intent(in) :: curves(:)
      real(wp), allocatable, intent(out) :: cuts(:)
      real(wp), allocatable :: more(:)
      integer, allocatable :: order(:)
      real(wp) :: found(4)
      integer :: i, k, m, n, n_found
      n = size(curves)
      allocate (cuts(8*n))
      do i = 1, n
         cuts(2*i - 1:2*i) = curves(i)%range
      end do
      m = 2*n
      do i = 1, n
         do k = i + 1, n
            ! the polygon does not cross itself
            if (curves(i)%shape == 0 .and. curves(k)%shape == 0) cycle
            call crossings(curves(i), curves(k), found, n_found)
            call grow(cuts, m + n_found)
            cuts(m + 1:m + n_found) = found(1:n_found)
            m = m + n_found
         end do
      end do
      order = sorted_order(cuts(1:m))
      more = cuts(order)
      call move_alloc(more, cuts)
   end subroutine find_strips

   !> Where two curves may cross, by x: those of whole circles count for both their halves.
   pure subroutine crossings(a, b, found, n)
      type(curve_type), intent(in) :: a, b
      real(wp), intent(out) :: found(4)
      integer, intent(out) :: n
      real(wp) :: candidates(2), low, high
      integer :: k
      n = 0
      low = max(a%range(1), b%range(1))
      high = min(a%range(2), b%range(2))
      if (.not. high > low) return
      if (a%side == 0 .and. b%side == 0) then
         candidates = line_and_line(a, b)
      else if (a%side /= 0 .and. b%side /= 0) then
         candidates = circle_and_circle(a, b)
      else if (a%side /= 0) then
         candidates = line_and_circle(b, a)
      else
         candidates = line_and_circle(a, b)
      end if
      do k = 1, 2
         if (.not. (candidates(k) > low .and. candidates(k) < high)) cycle
         n = n + 1
         found(n) = candidates(k)
      end do
   end subroutine crossings

   !> Two straight lines; huge: none.
   pure function line_and_line(a, b) result(x)
      type(curve_type), intent(in) :: a, b
      real(wp) :: x(2)
      real(wp) :: low, high, d1, d2
      x = huge(1.0_wp)
      low = max(a%range(1), b%range(1))
      high = min(a%range(2), b%range(2))
      d1 = height(a, low) - height(b, low)
      d2 = height(a, high) - height(b, high)
      if ((d1 > 0 .and. d2 < 0) .or. (d1 < 0 .and. d2 > 0)) x(1) = low + (high - low)*(d1/(d1 - d2))
   end function line_and_line

   !> A straight line and a circle.
   pure function line_and_circle(line, circle) result(x)
      type(curve_type), intent(in) :: line, circle
      real(wp) :: x(2)
      real(wp) :: d(2), u(2), foot, half
      x = huge(1.0_wp)
      d = [line%x(2) - line%x(1), line%y(2) - line%y(1)]
      d = d/norm2(d)
      u = [circle%x(1) - line%x(1), circle%y(1) - line%y(1)]
      foot = dot_product(u, d)
      half = circle%y(2)**2 - (u(1)*d(2) - u(2)*d(1))**2
      if (half < 0) return
      half = sqrt(half)
      x = line%x(1) + d(1)*[foot - half, foot + half]
   end function line_and_circle

   !> Two circles.
   pure function circle_and_circle(a, b) result(x)
      type(curve_type), intent(in) :: a, b
      real(wp) :: x(2)
      real(wp) :: d(2), distance, along, half
      x = huge(1.0_wp)
      d = [b%x(1) - a%x(1), b%y(1) - a%y(1)]
      distance = norm2(d)
      if (.not. distance > 0) return
      along = 0.5_wp*(distance + (a%y(2) - b%y(2))*(a%y(2) + b%y(2))/distance)
      half = a%y(2)**2 - along**2
      if (half < 0) return
      half = sqrt(half)
      x = a%x(1) + (along*d(1) + half*d(2)*[-1, 1])/distance
   end function circle_and_circle

   !> Height of a curve at x.
   pure real(wp) function height(curve, x)
      type(curve_type), intent(in) :: curve
      real(wp), intent(in) :: x
      if (curve%side == 0) then
         height = curve%y(1) + (curve%y(2) - curve%y(1))*((x - curve%x(1))/(curve%x(2) - curve%x(1)))
      else
         height = curve%y(1) + curve%side*sqrt(max(0.0_wp, curve%y(2)**2 - (x - curve%x(1))**2))
      end if
   end function height

   !> Integral of the height of a curve between two values of x.
   pure real(wp) function integral(curve, low, high)
      type(curve_type), intent(in) :: curve
      real(wp), intent(in) :: low, high
      if (curve%side == 0) then
         integral = height(curve, 0.5_wp*(low + high))*(high - low)
      else
         integral = curve%y(1)*(high - low) + curve%side*(below_arc(high - curve%x(1), curve%y(2)) - &
                                                          below_arc(low - curve%x(1), curve%y(2)))
      end if
   end function integral

   !> Area below a circle about the origin between 0 and x.
   pure real(wp) function below_arc(x, r)
      real(wp), intent(in) :: x, r
      real(wp) :: s
      s = min(1.0_wp, max(-1.0_wp, x/r))
      below_arc = 0.5_wp*r*r*(s*sqrt(1 - s*s) + asin(s))
   end function below_arc

   !> Area in one strip without crossings: up from below, between curves where the polygon and a shape are entered.
   pure real(wp) function area_in_strip(curves, n_shapes, low, high) result(area)
      type(curve_type), intent(in) :: curves(:)
      integer, intent(in) :: n_shapes
      real(wp), intent(in) :: low, high
      logical :: inside(0:n_shapes)
      integer, allocatable :: here(:), order(:)
      real(wp), allocatable :: y(:)
      real(wp) :: x
      integer :: i, n_inside
      x = 0.5_wp*(low + high)
      here = pack([(i, i=1, size(curves))], curves%range(1) <= x .and. curves%range(2) >= x)
      y = [(height(curves(here(i)), x), i=1, size(here))]
      order = here(sorted_order(y))
      area = 0
      inside = .false.
      n_inside = 0
      do i = 1, size(order)
         if (i > 1 .and. inside(0) .and. n_inside > 0) &
            area = area + integral(curves(order(i)), low, high) - integral(curves(order(i - 1)), low, high)
         associate (k => curves(order(i))%shape)
            inside(k) = .not. inside(k)
            if (k > 0) n_inside = n_inside + merge(1, -1, inside(k))
         end associate
      end do
   end function area_in_strip

end module rockdda_geometry_common_area
