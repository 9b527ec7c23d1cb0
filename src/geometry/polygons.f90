! SPDX-License-Identifier: MIT
!> Polygons: area, centroid and moments by simplex integrals; point location.
!>
!> A polygon is an array (2, n) of vertices, not closed (the edge from the last to the first vertex is implied).
!> Counter-clockwise gives positive areas. Polygons may touch themselves (a bridge to an island is walked in both
!> directions, a corner may be visited twice); they must not cross themselves.
!>
!> Source: simplex integration over triangles with one corner in the origin (Shi 1988; thesis 3.2):
!>     S   = sum f/2,            f = x1 y2 - x2 y1
!>     Sx  = sum f (x1 + x2)/6,  Sxx = sum f (x1 x1 + x1 x2 + x2 x2)/12,
!>     Sxy = sum f (2 x1 y1 + x1 y2 + x2 y1 + 2 x2 y2)/24.
!> They lose digits when the polygon is far from the origin, so that every routine first moves the first vertex there,
!> and second moments are summed about the centroid itself.
!> Units: lengths in the user's unit L; area L^2, second moments L^4.
module rockdda_geometry_polygons
   use rockdda_base_kinds, only : wp
   use rockdda_geometry_segments, only : distance_to_segment
   implicit none
   private
   public :: polygon_area, inradius_bound, polygon_properties, point_in_polygon, distance_to_outline

contains

   !> Signed area, positive when counter-clockwise.
   pure function polygon_area(vertices) result(area)
      real(wp), intent(in) :: vertices(:, :)  !! (2, n) corners, n >= 1
      real(wp) :: area
      real(wp) :: x0, y0
      integer :: k, n
      n = size(vertices, 2)
      x0 = vertices(1, 1)
      y0 = vertices(2, 1)
      area = 0
      do k = 2, n - 1
         area = area + (vertices(1, k) - x0)*(vertices(2, k + 1) - y0) - &
                (vertices(1, k + 1) - x0)*(vertices(2, k) - y0)
      end do
      area = 0.5_wp*area
   end function polygon_area

   !> Twice the area over the perimeter of a polygon. No circle inside a convex polygon has a larger radius, since the
   !> triangles from its centre to the edges fill the area and are at least as high as the radius.
   pure real(wp) function inradius_bound(polygon)
      real(wp), intent(in) :: polygon(:, :)   !! (2, n) vertices
      real(wp) :: p(2), q(2), area, perimeter
      integer :: k, n
      n = size(polygon, 2)
      area = 0
      perimeter = 0
      do k = 1, n
         p = polygon(:, k) - polygon(:, 1)
         q = polygon(:, merge(1, k + 1, k == n)) - polygon(:, 1)
         area = area + 0.5_wp*(p(1)*q(2) - p(2)*q(1))
         perimeter = perimeter + norm2(q - p)
      end do
      inradius_bound = 2*abs(area)/max(perimeter, tiny(1.0_wp))
   end function inradius_bound

   !> Area, centroid and second moments about the centroid.
   pure subroutine polygon_properties(vertices, area, centroid, moments)
      real(wp), intent(in) :: vertices(:, :)  !! (2, n) corners, counter-clockwise, n >= 3
      real(wp), intent(out) :: area           !! S [L^2]
      real(wp), intent(out) :: centroid(2)    !! (x, y)
      real(wp), intent(out) :: moments(3)     !! Sxx, Syy, Sxy about the centroid [L^4]
      real(wp) :: x0, y0, x1, y1, x2, y2, f, sx, sy, cx, cy
      integer :: k, n
      n = size(vertices, 2)
      x0 = vertices(1, 1)
      y0 = vertices(2, 1)
      area = 0
      sx = 0
      sy = 0
      do k = 2, n - 1
         x1 = vertices(1, k) - x0
         y1 = vertices(2, k) - y0
         x2 = vertices(1, k + 1) - x0
         y2 = vertices(2, k + 1) - y0
         f = x1*y2 - x2*y1
         area = area + f
         sx = sx + f*(x1 + x2)
         sy = sy + f*(y1 + y2)
      end do
      area = 0.5_wp*area
      cx = 0
      cy = 0
      if (abs(area) > 0) then
         cx = sx/(6*area)
         cy = sy/(6*area)
      end if
      centroid = [x0 + cx, y0 + cy]
      moments = 0
      x1 = (vertices(1, n) - x0) - cx
      y1 = (vertices(2, n) - y0) - cy
      do k = 1, n
         x2 = (vertices(1, k) - x0) - cx
         y2 = (vertices(2, k) - y0) - cy
         f = x1*y2 - x2*y1
         moments(1) = moments(1) + f*(x1*x1 + x1*x2 + x2*x2)
         moments(2) = moments(2) + f*(y1*y1 + y1*y2 + y2*y2)
         moments(3) = moments(3) + f*(x1*y1 + 0.5_wp*(x1*y2 + x2*y1) + x2*y2)
         x1 = x2
         y1 = y2
      end do
      moments = moments/12
   end subroutine polygon_properties

   !> Does the polygon contain the point? On the outline either result is possible: test distance_to_outline first.
   pure logical function point_in_polygon(point, vertices)
      real(wp), intent(in) :: point(2)
      real(wp), intent(in) :: vertices(:, :)  !! (2, n) corners, either direction
      real(wp) :: x1, y1, x2, y2, f
      integer :: k, n
      n = size(vertices, 2)
      point_in_polygon = .false.
      x1 = vertices(1, n) - point(1)
      y1 = vertices(2, n) - point(2)
      do k = 1, n
         x2 = vertices(1, k) - point(1)
         y2 = vertices(2, k) - point(2)
         ! half-open rule: an edge contains its lower end only, so that a ray through a corner crosses once
         if ((y1 > 0) .neqv. (y2 > 0)) then
            f = x1*y2 - x2*y1
            if (y2 < y1) f = -f
            ! the same result for both directions of an edge: a bridge has no effect, even for points on it
            if (f > 0) point_in_polygon = .not. point_in_polygon
         end if
         x1 = x2
         y1 = y2
      end do
   end function point_in_polygon

   !> Smallest distance from a point to the edges of a polygon.
   pure function distance_to_outline(point, vertices, skip) result(distance)
      real(wp), intent(in) :: point(2)
      real(wp), intent(in) :: vertices(:, :)       !! (2, n) corners
      logical, intent(in), optional :: skip(:)     !! (n) true: ignore the edge that starts at this corner
      real(wp) :: distance                         !! [L], huge when all edges are ignored
      integer :: k, n
      n = size(vertices, 2)
      distance = huge(distance)
      do k = 1, n
         if (present(skip)) then
            if (skip(k)) cycle
         end if
         distance = min(distance, distance_to_segment(point, vertices(:, k), vertices(:, 1 + mod(k, n))))
      end do
   end function distance_to_outline

end module rockdda_geometry_polygons
