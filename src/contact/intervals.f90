! SPDX-License-Identifier: MIT
!> Intervals of a joint: where an edge f of one block and an edge e of another face each other.
!>
!>              block a above
!>           f --------------------------- next(f)      edge f of block a, from left to right
!>      next(e) ------------------------ e              edge e of block b, from right to left
!>              block b below
!>           |<-------- L ------------->|
!>           3             2            1               stations, in the direction of e; gap and slip are linear
!>
!> The springs of a joint stand at stations of Lobatto's rule, whose weights add up to L: with three, L/6, 2L/3, L/6.
!> The ends are those of one of the two edges, so that they are contacts of a vertex with an edge, and blocks rock about
!> their corners; the weighted sum of the squares is L^3/12, so that a closed joint has its bending stiffness.
!>
!> Edges face each other when they run in opposite directions within the angle tolerance, overlap by more than they
!> are deep in each other, and neither lies deeper than a circle fits into the other's block. An interval that was
!> closed at the end of the last step may be deeper: soft joints press splinters by more than they are thick.
module rockdda_contact_intervals
   use rockdda_base_kinds, only : wp
   use rockdda_contact_topology, only : contact_topology_type
   use rockdda_contact_outlines, only : outlines_type, outward
   implicit none
   private
   public :: stretch_type, interval_type, station_type
   public :: measure_interval, station_of, station_share, is_facing, most_points

   !> Stations of an interval, at most.
   integer, parameter :: most_points = 5

   !> Overlaps shorter than this share of the shorter edge are none.
   real(wp), parameter :: least_overlap = 1.0e-9_wp

   !> Positions and weights of Lobatto's rule with 3, 4 and 5 points on [0, 1].
   real(wp), parameter :: position_3(3) = [0.0_wp, 0.5_wp, 1.0_wp]
   real(wp), parameter :: weight_3(3) = [1.0_wp, 4.0_wp, 1.0_wp]/6
   real(wp), parameter :: position_4(4) = [0.0_wp, 0.276393202250021030_wp, 0.723606797749978970_wp, 1.0_wp]
   real(wp), parameter :: weight_4(4) = [1.0_wp, 5.0_wp, 5.0_wp, 1.0_wp]/12
   real(wp), parameter :: position_5(5) = [0.0_wp, 0.172673164646011428_wp, 0.5_wp, 0.827326835353988572_wp, 1.0_wp]
   real(wp), parameter :: weight_5(5) = [9.0_wp, 49.0_wp, 64.0_wp, 49.0_wp, 9.0_wp]/180

   !> Where an interval lies, and how far its edges are apart.
   type :: stretch_type
      real(wp) :: low = 0, high = 0            !! along the mean direction from the first vertex of e [length]
      real(wp) :: start = 0                    !! of the first vertex of f, along the same [length]
      real(wp) :: gap_low = 0, gap_high = 0    !! [length]
   end type stretch_type

   type, extends(stretch_type) :: interval_type
      logical :: exists = .false.
      logical :: is_deep = .false.             !! not for its depth in a thin block alone
      real(wp) :: tangent(2) = 0               !! mean direction of the edges, along e
      integer :: vertex_low = 0, vertex_high = 0   !! corner at each end
      integer :: edge_low = 0, edge_high = 0       !! and the edge that it stands on
   end type interval_type

   !> Geometry of one station.
   type :: station_type
      real(wp) :: point(2)       !! corner, or between the edges [length]
      real(wp) :: share          !! of the gap between the point and block a
      real(wp) :: normal(2)      !! unit vector from block b to block a
      real(wp) :: gap            !! [length]
      real(wp) :: weight         !! length of joint that it stands for [length]
   end type station_type

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
      real(wp) :: t(2), first, last, length, depth
      t = outlines%tangent(:, e) - outlines%tangent(:, f)
      t = t/sqrt(t(1)**2 + t(2)**2)
      length = outlines%length(e)*dot_product(outlines%tangent(:, e), t)
      interval%tangent = t
      first = dot_product(vertices(:, topology%next(f)) - vertices(:, e), t)
      last = dot_product(vertices(:, f) - vertices(:, e), t)
      interval%start = last
      interval%low = max(0.0_wp, first)
      interval%high = min(length, last)
      if (interval%high - interval%low <= least_overlap*min(length, outlines%length(f))) return
      if (first > 0) then
         interval%vertex_low = topology%next(f)
         interval%edge_low = e
      else
         interval%vertex_low = e
         interval%edge_low = f
      end if
      if (last < length) then
         interval%vertex_high = f
         interval%edge_high = e
      else
         interval%vertex_high = topology%next(e)
         interval%edge_high = f
      end if
      interval%gap_low = gap_of(interval%vertex_low, interval%edge_low, vertices, outlines)
      interval%gap_high = gap_of(interval%vertex_high, interval%edge_high, vertices, outlines)
      depth = -max(interval%gap_low, interval%gap_high)
      if (.not. depth < interval%high - interval%low) return
      interval%exists = depth < min(topology%inradius(topology%block(f)), topology%inradius(topology%block(e)))
      interval%is_deep = .not. interval%exists
   end subroutine measure_interval

   !> Distance of a vertex from the line of an edge, > 0 on its outer side.
   pure real(wp) function gap_of(v, e, vertices, outlines)
      integer, intent(in) :: v, e
      real(wp), intent(in), contiguous :: vertices(:, :)
      type(outlines_type), intent(in) :: outlines
      associate (t => outlines%tangent)
         gap_of = (vertices(1, v) - vertices(1, e))*t(2, e) + (vertices(2, v) - vertices(2, e))*(-t(1, e))
      end associate
   end function gap_of

   !> Share of an interval's length that station k of n stands for.
   pure real(wp) function station_share(k, n)
      integer, intent(in) :: k, n
      select case (n)
      case (4)
         station_share = weight_4(k)
      case (5)
         station_share = weight_5(k)
      case default
         station_share = weight_3(k)
      end select
   end function station_share

   !> Station k of n of an interval. Its normal is that of the edge on which a corner stands, between the ends the mean
   !> of both edges.
   pure type(station_type) function station_of(interval, k, n, f, e, vertices, outlines) result(station)
      type(interval_type), intent(in) :: interval
      integer, intent(in) :: k, n
      integer, intent(in) :: f, e
      real(wp), intent(in), contiguous :: vertices(:, :)
      type(outlines_type), intent(in) :: outlines
      real(wp) :: foot(2), head(2), share, along
      integer :: v, edge
      station%weight = station_share(k, n)*(interval%high - interval%low)
      if (k == 1 .or. k == n) then
         v = merge(interval%vertex_low, interval%vertex_high, k == 1)
         edge = merge(interval%edge_low, interval%edge_high, k == 1)
         station%gap = merge(interval%gap_low, interval%gap_high, k == 1)
         station%normal = outward(outlines%tangent(:, edge))
         station%point = vertices(:, v)
         ! on an edge of block a it is a corner of block b
         station%share = merge(1.0_wp, 0.0_wp, edge == f)
         if (edge == f) station%normal = -station%normal
         return
      end if
      select case (n)
      case (4)
         share = position_4(k)
      case (5)
         share = position_5(k)
      case default
         share = position_3(k)
      end select
      station%normal = outward(interval%tangent)
      along = interval%low + share*(interval%high - interval%low)
      foot = vertices(:, e) + along/dot_product(outlines%tangent(:, e), interval%tangent)*outlines%tangent(:, e)
      head = vertices(:, f) + (along - interval%start)/dot_product(outlines%tangent(:, f), interval%tangent) &
             *outlines%tangent(:, f)
      station%gap = dot_product(head - foot, station%normal)
      station%share = 0.5_wp
      station%point = 0.5_wp*(foot + head)
   end function station_of

end module rockdda_contact_intervals
