! SPDX-License-Identifier: MIT
!> Straight segments: side of a line, distance, crossing of two segments.
!>
!> All routines work with differences of coordinates, so a common offset of the model costs no digits beyond
!> those that the coordinates themselves have lost. Points are not merged here: the caller applies tolerances.
module rockdda_geometry_segments
   use rockdda_base_kinds, only : wp
   implicit none
   private
   public :: cross_product, side_of_line, distance_to_segment, nearest_parameter, segment_point, segments_cross, &
             line_intersection

contains

   !> z component of u x v.
   pure real(wp) function cross_product(u, v)
      real(wp), intent(in) :: u(2), v(2)
      cross_product = u(1)*v(2) - u(2)*v(1)
   end function cross_product

   !> Twice the signed area of the triangle p q r: positive when r lies to the left of the line from p to q.
   pure real(wp) function side_of_line(p, q, r)
      real(wp), intent(in) :: p(2), q(2), r(2)
      side_of_line = (q(1) - p(1))*(r(2) - p(2)) - (q(2) - p(2))*(r(1) - p(1))
   end function side_of_line

   !> Parameter t in [0, 1] of the point p + t (q - p) of a segment that is nearest to a point.
   pure real(wp) function nearest_parameter(point, p, q)
      real(wp), intent(in) :: point(2), p(2), q(2)
      real(wp) :: d(2), length2
      d = q - p
      length2 = d(1)*d(1) + d(2)*d(2)
      nearest_parameter = 0
      if (length2 > 0) nearest_parameter = min(1.0_wp, max(0.0_wp, dot_product(point - p, d)/length2))
   end function nearest_parameter

   !> The point p + t (q - p), exactly q at t = 1.
   pure function segment_point(p, q, t) result(point)
      real(wp), intent(in) :: p(2), q(2), t
      real(wp) :: point(2)
      if (t < 0.5_wp) then
         point = p + t*(q - p)
      else
         point = q - (1 - t)*(q - p)
      end if
   end function segment_point

   !> Distance from a point to the segment p q.
   pure real(wp) function distance_to_segment(point, p, q)
      real(wp), intent(in) :: point(2), p(2), q(2)
      real(wp) :: t
      t = nearest_parameter(point, p, q)
      ! in the middle the perpendicular distance has fewer rounding errors than the difference of two points
      if (t > 0 .and. t < 1) then
         distance_to_segment = abs(side_of_line(p, q, point))/hypot(q(1) - p(1), q(2) - p(2))
      else if (t > 0) then
         distance_to_segment = hypot(point(1) - q(1), point(2) - q(2))
      else
         distance_to_segment = hypot(point(1) - p(1), point(2) - p(2))
      end if
   end function distance_to_segment

   !> Do the segments p1 q1 and p2 q2 have a point in common (ends included), other than by lying on one line?
   pure logical function segments_cross(p1, q1, p2, q2)
      real(wp), intent(in) :: p1(2), q1(2), p2(2), q2(2)
      real(wp) :: a, b, c, d
      segments_cross = .false.
      a = side_of_line(p1, q1, p2)
      b = side_of_line(p1, q1, q2)
      if ((a > 0 .and. b > 0) .or. (a < 0 .and. b < 0)) return
      c = side_of_line(p2, q2, p1)
      d = side_of_line(p2, q2, q1)
      if ((c > 0 .and. d > 0) .or. (c < 0 .and. d < 0)) return
      segments_cross = abs(a - b) > 0 .and. abs(c - d) > 0
   end function segments_cross

   !> Intersection of the lines through p1 q1 and p2 q2, as parameters along both (0 at p, 1 at q).
   pure subroutine line_intersection(p1, q1, p2, q2, s, t, parallel)
      real(wp), intent(in) :: p1(2), q1(2), p2(2), q2(2)
      real(wp), intent(out) :: s, t          !! along the first and the second line; 0 when parallel
      logical, intent(out) :: parallel       !! sine of the angle below 1e-14: no accurate intersection
      real(wp) :: u(2), v(2), w(2), d
      u = q1 - p1
      v = q2 - p2
      w = p2 - p1
      d = cross_product(u, v)
      s = 0
      t = 0
      parallel = abs(d) <= 1.0e-14_wp*hypot(u(1), u(2))*hypot(v(1), v(2))
      if (parallel) return
      s = cross_product(w, v)/d
      t = cross_product(w, u)/d
   end subroutine line_intersection

end module rockdda_geometry_segments
