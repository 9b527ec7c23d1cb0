! SPDX-License-Identifier: MIT
!> Corner against corner, with contact by length: one row, whose normal turns from one edge to the next.
!>
!> Seen from corner b, corner a must not enter a wedge: the difference of the two corners. Its sides are edges of one
!> block that have the other's whole corner on their outer side. The tip of the wedge is rounded:
!>
!>                 normal 1                 gap of a:  outside of the dotted lines the distance from a side,
!>            ^   .                                    between them the distance from the arc,
!>       _____|___.                                    deep inside the one that is less deep
!>       side 1   . ` .   _-> normal
!>                c....\.....
!>                     |                    c lies one radius inside both sides
!>                     |---> normal 2
!>              side 2 |
!>
!> A vertex on an edge represents a length of joint too, with contact by length (`vertex_weight`).
module rockdda_contact_corners
   use rockdda_base_kinds, only : wp
   use rockdda_contact_topology, only : contact_topology_type
   use rockdda_contact_outlines, only : outlines_type
   implicit none
   private
   public :: corner_type, meet_corners, corner_station, vertex_weight

   !> Share of an interval that its end represents.
   real(wp), parameter :: end_share = 1.0_wp/6
   !> A vertex represents at least this share of the end of the shortest of the three edges.
   real(wp), parameter :: least_share = 0.25_wp

   !> Station of rows of this kind.
   integer, parameter :: corner_station = 6
   !> The arc takes at most this share of the shortest edge at the two corners.
   real(wp), parameter :: largest_arc = 0.2_wp
   !> Sides whose normals differ less are one.
   real(wp), parameter :: same_side = 1.0e-9_wp

   type :: corner_type
      logical :: exists = .false.
      integer :: edge(2) = 0                  !! edges that are sides of the wedge, 0 none
      integer :: vertex(2) = 0                !! and the corner of the other block
      real(wp) :: gap = 0                     !! of a [length]
      real(wp) :: normal(2) = 0               !! from b to a
      real(wp) :: weight = 0                  !! [length]
      real(wp) :: point(2) = 0                !! the corner on a side; on the arc it passes from one to the other
      real(wp) :: share = 0                   !! of the gap between the point and a
   end type corner_type

contains

   !> Corner a of one block and corner b of another; weight, point and share on request: most corners that are
   !> examined have no row.
   pure subroutine meet_corners(a, b, vertices, topology, outlines, sine, cosine, radius, corner, is_weighed)
      integer, intent(in) :: a, b
      real(wp), intent(in), contiguous :: vertices(:, :)   !! (2, nv) now
      type(contact_topology_type), intent(in) :: topology
      type(outlines_type), intent(in) :: outlines
      real(wp), intent(in) :: sine, cosine                 !! of the angle tolerance
      real(wp), intent(in) :: radius                       !! share of the shortest edge
      type(corner_type), intent(out) :: corner
      logical, intent(in), optional :: is_weighed          !! default: yes
      real(wp) :: r(2), normal(2, 4), sides(2, 2), shortest, share, part
      integer :: edge(4), vertex(4), side(4), chosen(2), i, k, n_sides, v
      logical :: is_along(4), weighs, passes(4)
      weighs = .true.
      if (present(is_weighed)) weighs = is_weighed
      edge(1) = topology%edge_out(b)
      edge(2) = topology%edge_in(b)
      edge(3) = topology%edge_out(a)
      edge(4) = topology%edge_in(a)
      vertex = [a, a, b, b]
      r(1) = vertices(1, a) - vertices(1, b)
      r(2) = vertices(2, a) - vertices(2, b)
      do k = 1, 4
         normal(1, k) = outlines%tangent(2, edge(k))
         normal(2, k) = -outlines%tangent(1, edge(k))
      end do
      call find_passes(normal, sine, passes)
      normal(:, 3:4) = -normal(:, 3:4)
      n_sides = 0
      do k = 1, 4
         if (.not. passes(k)) cycle
         n_sides = n_sides + 1
         side(n_sides) = k
      end do
      if (n_sides == 0) return
      corner%exists = .true.
      call take_extremes(normal, side, n_sides, chosen)
      do k = 1, merge(2, 1, chosen(1) /= chosen(2))
         corner%edge(k) = edge(chosen(k))
         corner%vertex(k) = vertex(chosen(k))
      end do
      if (chosen(1) == chosen(2)) then
         corner%gap = r(1)*normal(1, chosen(1)) + r(2)*normal(2, chosen(1))
         corner%normal = normal(:, chosen(1))
         share = 0
      else
         sides(:, 1) = normal(:, chosen(1))
         sides(:, 2) = normal(:, chosen(2))
         shortest = min(outlines%length(edge(1)), outlines%length(edge(2)), outlines%length(edge(3)), &
                        outlines%length(edge(4)))
         call round_wedge(r, sides, shortest, radius, weighs, corner%gap, corner%normal, share)
      end if
      if (.not. weighs) return
      do k = 1, 2
         if (corner%edge(k) == 0) cycle
         ! of edges of both blocks that lie along one side each takes its part, whichever block comes first
         do i = 1, n_sides
            is_along(i) = normal(1, chosen(k))*normal(1, side(i)) + normal(2, chosen(k))*normal(2, side(i)) >= &
                          1 - same_side
         end do
         part = merge(1 - share, share, k == 1)/count(is_along(1:n_sides))
         do i = 1, n_sides
            if (.not. is_along(i)) cycle
            v = vertex(side(i))
            corner%weight = corner%weight + part*vertex_weight(v, edge(side(i)), vertices(:, v), vertices, topology, &
                                                               outlines, cosine)
            corner%point = corner%point + part*vertices(:, v)
            if (v == b) corner%share = corner%share + part
         end do
      end do
   end subroutine meet_corners

   !> Which edges are sides of the wedge: they have both edges of the other corner on their outer side (`is_outside`).
   pure subroutine find_passes(n, sine, passes)
      real(wp), intent(in) :: n(2, 4)     !! outward normals of the edges that leave and reach b, leave and reach a
      real(wp), intent(in) :: sine        !! of the angle tolerance
      logical, intent(out) :: passes(4)
      real(wp) :: c31, c41, c32, c42
      ! an edge of a along the outward normal of an edge of b: the same the other way round but for the sign
      c31 = n(1, 3)*n(2, 1) - n(2, 3)*n(1, 1)
      c41 = n(1, 4)*n(2, 1) - n(2, 4)*n(1, 1)
      c32 = n(1, 3)*n(2, 2) - n(2, 3)*n(1, 2)
      c42 = n(1, 4)*n(2, 2) - n(2, 4)*n(1, 2)
      passes(1) = c31 >= -sine .and. c41 <= sine
      passes(2) = c32 >= -sine .and. c42 <= sine
      passes(3) = c31 <= sine .and. c32 >= -sine
      passes(4) = c41 <= sine .and. c42 >= -sine
   end subroutine find_passes

   !> The two sides of a wedge whose directions differ most; twice the same when all are parallel.
   pure subroutine take_extremes(normal, side, n_sides, chosen)
      real(wp), intent(in) :: normal(2, 4)
      integer, intent(in) :: n_sides
      integer, intent(in) :: side(n_sides)   !! those of the four that count, at least one
      integer, intent(out) :: chosen(2)
      real(wp) :: least, cosine
      integer :: i, j
      chosen = side(1)
      least = 1 - same_side
      do i = 1, n_sides
         do j = i + 1, n_sides
            cosine = normal(1, side(i))*normal(1, side(j)) + normal(2, side(i))*normal(2, side(j))
            if (cosine < least) then
               least = cosine
               chosen(1) = side(i)
               chosen(2) = side(j)
            end if
         end do
      end do
   end subroutine take_extremes

   !> Distance from a wedge of two sides with a rounded tip at the origin, and the direction in which it grows.
   pure subroutine round_wedge(r, n, shortest, share, weighs, gap, normal, second)
      real(wp), intent(in) :: r(2)       !! place [length]
      real(wp), intent(in) :: n(2, 2)    !! outward unit normals of the sides
      real(wp), intent(in) :: shortest   !! edge at the tip [length]
      real(wp), intent(in) :: share      !! radius over that edge
      logical, intent(in) :: weighs      !! `second` is wanted
      real(wp), intent(out) :: gap       !! [length]
      real(wp), intent(out) :: normal(2)
      real(wp), intent(out) :: second    !! how far the direction has turned from side 1 to side 2, 0 to 1
      real(wp) :: half_sum(2), radius, cosine, x(2), distance, side(2), turn
      half_sum = n(:, 1) + n(:, 2)
      ! |n1 + n2|/2 is the cosine of half the angle by which the normal turns
      cosine = 0.5_wp*sqrt(half_sum(1)**2 + half_sum(2)**2)
      side = [dot_product(r, n(:, 1)), dot_product(r, n(:, 2))]
      if (cosine > 1.0e-6_wp) then
         ! the arc begins at radius*tan(half the turn) from the tip
         turn = sqrt(max(0.0_wp, 1 - cosine**2))/cosine
         radius = min(share, largest_arc/max(turn, tiny(1.0_wp)))*shortest
         ! the centre lies on the bisector, one radius from both sides
         x = r + half_sum*(radius/(2*cosine**2))
         ! between the normals: x = a n1 + b n2 with a, b > 0
         if (is_between(x, n)) then
            distance = sqrt(x(1)**2 + x(2)**2)
            if (distance > 0) then
               gap = distance - radius
               normal = x/distance
               second = 0
               if (.not. weighs) return
               second = norm2(normal - n(:, 1))
               second = second/(second + norm2(normal - n(:, 2)))
               return
            end if
         end if
      end if
      if (side(1) >= side(2)) then
         gap = side(1)
         normal = n(:, 1)
         second = 0
      else
         gap = side(2)
         normal = n(:, 2)
         second = 1
      end if
   end subroutine round_wedge

   !> Does a vector lie between two others, less than half a turn apart?
   pure logical function is_between(x, n)
      real(wp), intent(in) :: x(2), n(2, 2)
      real(wp) :: turn
      turn = n(1, 1)*n(2, 2) - n(2, 1)*n(1, 2)
      is_between = (n(1, 1)*x(2) - n(2, 1)*x(1))*turn >= 0 .and. (x(1)*n(2, 2) - x(2)*n(1, 2))*turn >= 0
   end function is_between

   !> Weight of vertex v on edge e.
   !>
   !>          in \         / out     The edges that reach and leave v make the angles alpha and beta with e. When alpha
   !>              \       /          becomes 0 the edge that reaches v lies on e, over a length of l_in: v is then the
   !>         alpha \     / beta      end of an interval, of weight l_in/6. The weight goes there without a jump:
   !>    <-----------\ v /----- e
   !>                 |<- s ->|         (l_in beta + l_out alpha)/(6 (alpha + beta)),  angles beyond the angle tolerance
   !>
   pure real(wp) function vertex_weight(v, e, point, vertices, topology, outlines, cosine) result(weight)
      integer, intent(in) :: v, e
      real(wp), intent(in) :: point(2)                     !! the vertex [length]
      real(wp), intent(in), contiguous :: vertices(:, :)   !! (2, nv) now
      type(contact_topology_type), intent(in) :: topology
      type(outlines_type), intent(in) :: outlines
      real(wp), intent(in) :: cosine                       !! of the angle tolerance
      real(wp) :: t(2), into(2), outof(2), s, alpha, beta, length, l_in, l_out, tolerance
      tolerance = acos(min(1.0_wp, cosine))
      t = outlines%tangent(:, e)
      length = outlines%length(e)
      s = min(max(dot_product(point - vertices(:, e), t), 0.0_wp), length)
      ! seen from v the edge that reaches it runs along e, the one that leaves it against e
      ! (no expressions of sections as arguments: they are temporary arrays on the heap)
      into = outlines%tangent(:, topology%edge_in(v))
      outof = outlines%tangent(:, topology%edge_out(v))
      alpha = max(0.0_wp, angle_from_opposite(into, t) - tolerance)
      beta = max(0.0_wp, angle_from_opposite(outof, t) - tolerance)
      l_in = min(outlines%length(topology%edge_in(v)), length - s)
      l_out = min(outlines%length(topology%edge_out(v)), s)
      if (alpha + beta > 0) then
         weight = end_share*(l_in*beta + l_out*alpha)/(alpha + beta)
      else
         weight = 0.5_wp*end_share*(l_in + l_out)
      end if
      weight = max(weight, least_share*end_share*min(length, outlines%length(topology%edge_in(v)), &
                                                     outlines%length(topology%edge_out(v))))
   end function vertex_weight

   !> Angle between a unit vector and the opposite of another one, 0 to pi.
   pure real(wp) function angle_from_opposite(a, b) result(angle)
      real(wp), intent(in) :: a(2), b(2)
      angle = atan2(abs(a(1)*b(2) - a(2)*b(1)), -(a(1)*b(1) + a(2)*b(2)))
   end function angle_from_opposite

end module rockdda_contact_corners
