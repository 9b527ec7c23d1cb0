! SPDX-License-Identifier: MIT
!> Intervals of a joint: where an edge f of one block and an edge e of another face each other.
!>
!>              block a above
!>           f --------------------------- next(f)      edge f of block a, from left to right
!>      next(e) ------------------------ e              edge e of block b, from right to left
!>              block b below
!>           |<-------- L ------------->|
!>                 2           1                        points, in the direction of e; gap and slip are linear
!>
!> An interval is two rows of the contact table, at the points of Gauss's rule, each for L/2. Its ends are those of one
!> of the two edges: corners on edges, of which gap, place and normal at the points are interpolated. What the joint
!> does when it is closed on a part of its length is found in rockdda_contact_interval_law. The points of a tie stand
!> close to the middle, so that two equal springs have a stiff mean and a soft linear part.
!>
!> Edges face each other when they run in opposite directions within the angle tolerance, overlap by more than they
!> are deep in each other, and neither lies deeper than a circle fits into the other's block. An interval that was
!> closed at the end of the last step may be deeper: soft joints press splinters by more than they are thick.
module rockdda_contact_intervals
   use rockdda_base_kinds, only : wp
   use rockdda_contact_interval_law, only : first_place, n_points
   use rockdda_contact_topology, only : contact_topology_type
   use rockdda_contact_outlines, only : outlines_type
   implicit none
   private
   public :: interval_type
   public :: measure_interval, place_intervals, place_points, is_facing, tie_place

   !> Overlaps shorter than this share of the shorter edge are none.
   real(wp), parameter :: least_overlap = 1.0e-9_wp

   !> Place of the first point of a tie: the springs are 1000 times as stiff for the mean as for the linear part
   !> (rockdda_interaction_ties), (1/2 - place)^2 = 1/(12 * 1000).
   real(wp), parameter :: tie_place = 0.5_wp - 0.0091287092917527685_wp

   !> Where an interval lies, and how far its edges are apart. (No values to begin with: `measure_interval` sets what
   !> there is.)
   type :: interval_type
      real(wp) :: low, high                    !! along the mean direction from the first vertex of e [length]
      real(wp) :: start                        !! of the first vertex of f, along the same [length]
      real(wp) :: gap_low, gap_high            !! [length]
      real(wp) :: tangent(2)                   !! mean direction of the edges, along e
      integer :: f, e                          !! edges
      integer :: joint                         !! joint material, by length
      integer :: row                           !! its first one in the table, once rows are sorted
      integer :: vertex_low, vertex_high       !! corner at each end; 0 where the edges do not overlap
      integer :: edge_low, edge_high           !! and the edge that it stands on
      logical :: exists
      logical :: is_deep                       !! not for its depth in a thin block alone
      logical :: is_tied                       !! intact rock
   end type interval_type

contains

   !> Do two edges run in opposite directions, within the angle tolerance?
   pure logical function is_facing(f, e, outlines, cosine)
      integer, intent(in) :: f, e
      type(outlines_type), intent(in) :: outlines
      real(wp), intent(in) :: cosine   !! of the angle tolerance
      associate (t => outlines%tangent)
         is_facing = t(1, f)*t(1, e) + t(2, f)*t(2, e) <= -cosine
      end associate
   end function is_facing

   !> The stretch on which edge f of block a and edge e of block b, which face each other, overlap.
   pure subroutine measure_interval(f, e, vertices, topology, outlines, interval)
      integer, intent(in) :: f, e
      real(wp), intent(in), contiguous :: vertices(:, :)   !! (2, nv) now
      type(contact_topology_type), intent(in) :: topology
      type(outlines_type), intent(in) :: outlines
      type(interval_type), intent(out) :: interval
      real(wp) :: depth
      call measure(f, e, topology%next(f), topology%next(e), size(vertices, 2), vertices, outlines%tangent, &
                   outlines%length, interval)
      interval%exists = .false.
      interval%is_deep = .false.
      interval%is_tied = .false.
      if (interval%vertex_low == 0) return
      depth = -max(interval%gap_low, interval%gap_high)
      if (.not. depth < interval%high - interval%low) return
      interval%exists = depth < min(topology%inradius(topology%block(f)), topology%inradius(topology%block(e)))
      interval%is_deep = .not. interval%exists
   end subroutine measure_interval

   !> Place, ends and gaps of an interval. (Arrays of constant shape and single numbers: this is done for each interval
   !> in each step.)
   pure subroutine measure(f, e, next_f, next_e, nv, vertices, tangent, length, interval)
      integer, intent(in) :: f, e, next_f, next_e
      integer, intent(in) :: nv
      real(wp), intent(in) :: vertices(2, nv), tangent(2, nv), length(nv)
      type(interval_type), intent(out) :: interval
      real(wp) :: t(2), x, y, first, last, along, norm
      interval%f = f
      interval%e = e
      t(1) = tangent(1, e) - tangent(1, f)
      t(2) = tangent(2, e) - tangent(2, f)
      norm = sqrt(t(1)**2 + t(2)**2)
      t(1) = t(1)/norm
      t(2) = t(2)/norm
      interval%tangent = t
      along = length(e)*(tangent(1, e)*t(1) + tangent(2, e)*t(2))
      x = vertices(1, e)
      y = vertices(2, e)
      first = (vertices(1, next_f) - x)*t(1) + (vertices(2, next_f) - y)*t(2)
      last = (vertices(1, f) - x)*t(1) + (vertices(2, f) - y)*t(2)
      interval%start = last
      interval%low = max(0.0_wp, first)
      interval%high = min(along, last)
      interval%vertex_low = 0
      if (interval%high - interval%low <= least_overlap*min(along, length(f))) return
      if (first > 0) then
         interval%vertex_low = next_f
         interval%edge_low = e
         interval%gap_low = gap_of(next_f, e, nv, vertices, tangent)
      else
         interval%vertex_low = e
         interval%edge_low = f
         interval%gap_low = gap_of(e, f, nv, vertices, tangent)
      end if
      if (last < along) then
         interval%vertex_high = f
         interval%edge_high = e
         interval%gap_high = gap_of(f, e, nv, vertices, tangent)
      else
         interval%vertex_high = next_e
         interval%edge_high = f
         interval%gap_high = gap_of(next_e, f, nv, vertices, tangent)
      end if
   end subroutine measure

   !> Distance of a vertex from the line of an edge, > 0 on its outer side.
   pure real(wp) function gap_of(v, e, nv, vertices, tangent)
      integer, intent(in) :: v, e, nv
      real(wp), intent(in) :: vertices(2, nv), tangent(2, nv)
      gap_of = (vertices(1, v) - vertices(1, e))*tangent(2, e) + (vertices(2, v) - vertices(2, e))*(-tangent(1, e))
   end function gap_of

   !> Geometry of the points of all intervals of a list, in their rows.
   pure subroutine place_intervals(intervals, nv, vertices, tangent, n, point, share, normal, gap, length)
      type(interval_type), intent(in) :: intervals(:)
      integer, intent(in) :: nv, n                 !! vertices, rows
      real(wp), intent(in) :: vertices(2, nv), tangent(2, nv)
      real(wp), intent(inout) :: point(2, n), share(n), normal(2, n), gap(n), length(n)   !! as of `place_points`
      integer :: i
      do i = 1, size(intervals)
         associate (row => intervals(i)%row)
            call place_points(intervals(i), nv, vertices, tangent, point(1, row), share(row), normal(1, row), &
               gap(row), &
                              length(row))
         end associate
      end do
   end subroutine place_intervals

   !> Geometry of the points of an interval. Gaps and normals lie on the line between those of the ends, where corners
   !> stand on edges.
   pure subroutine place_points(interval, nv, vertices, tangent, point, share, normal, gap, length)
      type(interval_type), intent(in) :: interval
      integer, intent(in) :: nv
      real(wp), intent(in) :: vertices(2, nv), tangent(2, nv)
      real(wp), intent(out) :: point(2, n_points)    !! half-way between the edges [length]
      real(wp), intent(out) :: share(n_points)       !! of the gap between the point and block a
      real(wp), intent(out) :: normal(2, n_points)   !! unit vector from block b to block a
      real(wp), intent(out) :: gap(n_points)         !! [length]
      real(wp), intent(out) :: length(n_points)      !! of joint that each represents [length]
      real(wp) :: t(2), foot(2), head(2), low(2), high(2), overlap, along, along_e, along_f, place
      integer :: k
      overlap = interval%high - interval%low
      low = end_normal(interval%edge_low, interval%f, nv, tangent)
      high = end_normal(interval%edge_high, interval%f, nv, tangent)
      t = interval%tangent
      associate (f => interval%f, e => interval%e)
         along_e = tangent(1, e)*t(1) + tangent(2, e)*t(2)
         along_f = tangent(1, f)*t(1) + tangent(2, f)*t(2)
         do k = 1, n_points
            place = merge(tie_place, first_place, interval%is_tied)
            if (k == n_points) place = 1 - place
            along = interval%low + place*overlap
            foot = vertices(:, e) + along/along_e*tangent(:, e)
            head = vertices(:, f) + (along - interval%start)/along_f*tangent(:, f)
            normal(:, k) = low + place*(high - low)
            normal(:, k) = normal(:, k)/sqrt(normal(1, k)**2 + normal(2, k)**2)
            gap(k) = interval%gap_low + place*(interval%gap_high - interval%gap_low)
            share(k) = 0.5_wp
            point(:, k) = 0.5_wp*(foot + head)
            length(k) = overlap/n_points
         end do
      end associate
   end subroutine place_points

   !> Normal, from block b to block a, of the edge on which a corner stands at the end of an interval.
   pure function end_normal(edge, f, nv, tangent) result(normal)
      integer, intent(in) :: edge
      integer, intent(in) :: f, nv          !! edge of block a, vertices
      real(wp), intent(in) :: tangent(2, nv)
      real(wp) :: normal(2)
      normal(1) = tangent(2, edge)
      normal(2) = -tangent(1, edge)
      if (edge == f) normal = -normal
   end function end_normal

end module rockdda_contact_intervals
