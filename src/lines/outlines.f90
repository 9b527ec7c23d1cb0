! SPDX-License-Identifier: MIT
!> Outlines of openings and slopes as polygons, counter-clockwise.
!>
!> Clip segments to the rock: inside the outline of the region, outside every opening, not along an outline.
module rockdda_lines_outlines
   use rockdda_base_kinds, only : wp
   use rockdda_geometry_polygons, only : polygon_area, point_in_polygon, distance_to_outline
   use rockdda_geometry_segments, only : segments_cross, cross_product
   use rockdda_lines_statistics, only : opening_type
   use rockdda_base_sorting, only : sorted_order
   implicit none
   private
   public :: opening_outline, slope_outline, inner_point, crosses_itself, counter_clockwise, rock_type, clip_segment

   real(wp), parameter :: pi = acos(-1.0_wp)

   type :: outline_type
      real(wp), allocatable :: vertices(:, :)   !! (2, n)
   end type outline_type

   type :: rock_type
      type(outline_type) :: region
      type(outline_type), allocatable :: openings(:)
      real(wp) :: tolerance = 0                 !! pieces shorter than this, and nearer to an outline, are dropped [L]
   end type rock_type

contains

   !> Vertices of an opening. Corners of arches and circles lie on the curve.
   pure function opening_outline(opening) result(vertices)
      type(opening_type), intent(in) :: opening
      real(wp), allocatable :: vertices(:, :)   !! (2, n)
      integer :: i, n
      real(wp) :: angle
      select case (opening%shape)
      case (1)
         vertices = horseshoe(opening)
      case (2)
         n = opening%segments
         if (n == 0) n = 36
         allocate (vertices(2, n))
         do i = 1, n
            angle = 2*pi*(i - 1)/n
            vertices(:, i) = opening%center + opening%radius*[cos(angle), sin(angle)]
         end do
      case (3)
         vertices = reshape(0.5_wp*[-opening%width, -opening%height, opening%width, -opening%height, &
                                    opening%width, opening%height, -opening%width, opening%height], [2, 4])
         do i = 1, 4
            vertices(:, i) = vertices(:, i) + opening%center
         end do
      case default
         vertices = opening%vertices
         do i = 1, size(vertices, 2)
            vertices(:, i) = vertices(:, i) + opening%center
         end do
      end select
      call counter_clockwise(vertices)
   end function opening_outline

   !> Upright walls under a circular arch over the whole span (thesis, Fig. 7.1: B = 2a, height b + c).
   pure function horseshoe(opening) result(vertices)
      type(opening_type), intent(in) :: opening
      real(wp), allocatable :: vertices(:, :)
      real(wp) :: a, radius, half_angle, angle, floor_level, springline
      integer :: i, n
      a = 0.5_wp*opening%span
      floor_level = opening%center(2) - 0.5_wp*(opening%wall_height + opening%arch_height)
      springline = floor_level + opening%wall_height
      ! a circle through both springings and the crown: r = (a^2 + c^2)/(2c)
      radius = (a**2 + opening%arch_height**2)/(2*opening%arch_height)
      half_angle = 2*atan2(opening%arch_height, a)
      n = opening%segments
      if (n == 0) n = 2*max(2, nint(half_angle/(pi/18)))
      allocate (vertices(2, n + 1 + merge(2, 0, opening%wall_height > 0)))
      do i = 0, n
         angle = half_angle*(1 - 2*real(i, wp)/n)
         vertices(:, i + 1) = opening%center(1:2)*[1, 0] + [radius*sin(angle), &
                                                            springline + opening%arch_height - radius*(1 - cos(angle))]
      end do
      ! exact corners, without rounding of the trigonometric functions
      vertices(:, 1) = [opening%center(1) + a, springline]
      vertices(:, n + 1) = [opening%center(1) - a, springline]
      if (modulo(n, 2) == 0) vertices(1, n/2 + 1) = opening%center(1)
      if (.not. opening%wall_height > 0) return
      vertices(:, n + 2) = [opening%center(1) - a, floor_level]
      vertices(:, n + 3) = [opening%center(1) + a, floor_level]
   end function horseshoe

   !> A window with a slope cut into it: the face rises from the toe at an angle to the window's top; in front of
   !> it the ground is horizontal at the height of the toe. Up to 90 degrees the face rises to the right, above to the
   !> left.
   !> Empty when the face does not fit into the window.
   pure function slope_outline(window, toe, angle) result(vertices)
      real(wp), intent(in) :: window(4)         !! xmin, ymin, xmax, ymax
      real(wp), intent(in) :: toe(2)
      real(wp), intent(in) :: angle             !! [deg], 0 < angle < 180
      real(wp), allocatable :: vertices(:, :)   !! (2, 6)
      real(wp) :: crest(2)
      crest(2) = window(4)
      crest(1) = toe(1) + (window(4) - toe(2))*cos(angle*pi/180)/sin(angle*pi/180)
      if (abs(angle - 90) <= 0) crest(1) = toe(1)
      if (.not. (toe(2) > window(2) .and. toe(2) < window(4) .and. min(toe(1), crest(1)) > window(1) .and. &
                 max(toe(1), crest(1)) < window(3))) then
         allocate (vertices(2, 0))
      else if (angle <= 90) then
         vertices = reshape([window(1), window(2), window(3), window(2), window(3), window(4), crest, toe, &
                             window(1), toe(2)], [2, 6])
      else
         vertices = reshape([window(1), window(2), window(3), window(2), window(3), toe(2), toe, crest, &
                             window(1), window(4)], [2, 6])
      end if
   end function slope_outline

   !> Reverse a clockwise polygon; its first vertex stays the first.
   pure subroutine counter_clockwise(vertices)
      real(wp), intent(inout) :: vertices(:, :)
      if (size(vertices, 2) < 3) return
      if (polygon_area(vertices) < 0) vertices(:, 2:) = vertices(:, size(vertices, 2):2:-1)
   end subroutine counter_clockwise

   !> Do two edges of the polygon that are not neighbours meet?
   pure logical function crosses_itself(vertices)
      real(wp), intent(in) :: vertices(:, :)
      integer :: i, k, n
      n = size(vertices, 2)
      crosses_itself = .false.
      do i = 1, n
         do k = i + 2, n
            if (i == 1 .and. k == n) cycle
            if (segments_cross(vertices(:, i), vertices(:, 1 + mod(i, n)), &
                               vertices(:, k), vertices(:, 1 + mod(k, n)))) &
               crosses_itself = .true.
         end do
      end do
   end function crosses_itself

   !> A point inside the polygon, away from its outline: the middle of the longest interval of a horizontal line.
   pure function inner_point(vertices) result(point)
      real(wp), intent(in) :: vertices(:, :)    !! (2, n)
      real(wp) :: point(2)
      real(wp) :: low, high, y, best, depth, candidate(2)
      real(wp) :: x(size(vertices, 2))
      integer :: level, i, n_cross
      integer, parameter :: levels = 15
      low = minval(vertices(2, :))
      high = maxval(vertices(2, :))
      point = sum(vertices, dim=2)/size(vertices, 2)
      best = -1
      if (point_in_polygon(point, vertices)) best = distance_to_outline(point, vertices)
      do level = 1, levels
         y = low + (high - low)*level/(levels + 1.0_wp)
         call crossings(y, x, n_cross)
         do i = 1, n_cross - 1
            candidate = [0.5_wp*(x(i) + x(i + 1)), y]
            if (.not. point_in_polygon(candidate, vertices)) cycle
            depth = distance_to_outline(candidate, vertices)
            ! the first of intervals that are equal up to rounding
            if (depth > best*(1 + 1.0e-9_wp)) then
               best = depth
               point = candidate
            end if
         end do
      end do

   contains

      !> Ascending abscissae where a horizontal line meets the edges.
      pure subroutine crossings(y, x, n)
         real(wp), intent(in) :: y
         real(wp), intent(out) :: x(:)
         integer, intent(out) :: n
         real(wp) :: p(2), q(2), this
         integer :: e, k
         n = 0
         x = 0
         do e = 1, size(vertices, 2)
            p = vertices(:, e)
            q = vertices(:, 1 + mod(e, size(vertices, 2)))
            if ((p(2) > y) .eqv. (q(2) > y)) cycle
            this = p(1) + (y - p(2))*(q(1) - p(1))/(q(2) - p(2))
            k = n
            do while (k > 0)
               if (x(k) <= this) exit
               x(k + 1) = x(k)
               k = k - 1
            end do
            x(k + 1) = this
            n = n + 1
         end do
      end subroutine crossings

   end function inner_point

   !> The pieces of a segment that lie in the rock, in its own order.
   subroutine clip_segment(rock, ends, pieces, n_pieces, n_short, whole)
      type(rock_type), intent(in) :: rock
      real(wp), intent(in) :: ends(4)                       !! x1 y1 x2 y2
      real(wp), allocatable, intent(inout) :: pieces(:, :)  !! (4, at least n_pieces)
      integer, intent(out) :: n_pieces
      integer, intent(inout) :: n_short                     !! raised by the number of pieces too short to keep
      logical, intent(out) :: whole                         !! the segment was not clipped
      real(wp), allocatable :: cuts(:)
      real(wp) :: p(2), d(2), length, a, b
      integer :: i, n
      n_pieces = 0
      whole = .false.
      p = ends(1:2)
      d = ends(3:4) - p
      length = hypot(d(1), d(2))
      if (.not. length > rock%tolerance) return
      n = 2 + 2*size(rock%region%vertices, 2)
      do i = 1, size(rock%openings)
         n = n + 2*size(rock%openings(i)%vertices, 2)
      end do
      allocate (cuts(n))
      cuts(1:2) = [0.0_wp, 1.0_wp]
      n = 2
      call add_cuts(rock%region%vertices, p, d, length, rock%tolerance, cuts, n)
      do i = 1, size(rock%openings)
         call add_cuts(rock%openings(i)%vertices, p, d, length, rock%tolerance, cuts, n)
      end do
      cuts(1:n) = cuts(sorted_order(cuts(1:n)))
      if (.not. allocated(pieces)) allocate (pieces(4, n))
      if (size(pieces, 2) < n) then
         deallocate (pieces)
         allocate (pieces(4, 2*n))
      end if
      ! intervals in the rock; neighbouring ones form one piece (a segment that touches a corner is not split there)
      a = -1
      do i = 1, n - 1
         b = cuts(i + 1)
         if ((b - cuts(i))*length <= 1.0e-3_wp*rock%tolerance) cycle
         if (is_in_rock(rock, p + 0.5_wp*(cuts(i) + b)*d)) then
            if (a < 0) a = cuts(i)
         else
            if (a >= 0) call add_piece(a, cuts(i))
            a = -1
         end if
      end do
      if (a >= 0) call add_piece(a, 1.0_wp)

   contains

      !> Append a piece, unless it is too short.
      subroutine add_piece(from, to)
         real(wp), intent(in) :: from, to
         if ((to - from)*length <= rock%tolerance) then
            n_short = n_short + 1
            return
         end if
         n_pieces = n_pieces + 1
         pieces(1:2, n_pieces) = p + from*d
         pieces(3:4, n_pieces) = ends(3:4) - (1 - to)*d
         whole = from <= 0 .and. to >= 1
      end subroutine add_piece

   end subroutine clip_segment

   !> Parameters where an outline meets the segment: crossings with its edges, and corners on the segment.
   subroutine add_cuts(vertices, p, d, length, tolerance, cuts, n)
      real(wp), intent(in) :: vertices(:, :), p(2), d(2), length, tolerance
      real(wp), intent(inout) :: cuts(:)
      integer, intent(inout) :: n
      real(wp) :: side, next, t, edge(2)
      integer :: i, k, m
      m = size(vertices, 2)
      do i = 1, m
         k = 1 + mod(i, m)
         edge = vertices(:, k) - vertices(:, i)
         side = cross_product(d, vertices(:, i) - p)/length
         next = cross_product(d, vertices(:, k) - p)/length
         if (abs(side) <= 1.0e-3_wp*tolerance) then
            call add(dot_product(vertices(:, i) - p, d)/length**2)
         else if ((side > 0 .and. next < 0) .or. (side < 0 .and. next > 0)) then
            t = dot_product(vertices(:, i) + side/(side - next)*edge - p, d)/length**2
            call add(t)
         end if
      end do

   contains

      !> Append a parameter inside the segment.
      subroutine add(t)
         real(wp), intent(in) :: t
         if (.not. (t > 0 .and. t < 1)) return
         n = n + 1
         cuts(n) = t
      end subroutine add

   end subroutine add_cuts

   !> Is a point in the rock and not on an outline?
   pure logical function is_in_rock(rock, point)
      type(rock_type), intent(in) :: rock
      real(wp), intent(in) :: point(2)
      integer :: i
      is_in_rock = .false.
      if (.not. point_in_polygon(point, rock%region%vertices)) return
      if (distance_to_outline(point, rock%region%vertices) <= 1.0e-3_wp*rock%tolerance) return
      do i = 1, size(rock%openings)
         if (point_in_polygon(point, rock%openings(i)%vertices)) return
         if (distance_to_outline(point, rock%openings(i)%vertices) <= 1.0e-3_wp*rock%tolerance) return
      end do
      is_in_rock = .true.
   end function is_in_rock

end module rockdda_lines_outlines
