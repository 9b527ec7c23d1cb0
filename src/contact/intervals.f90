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
   use rockdda_contact_outlines, only : outlines_type
   implicit none
   private
   public :: interval_type
   public :: measure_interval, place_intervals, place_stations, station_share, is_facing, most_points

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

   !> Where an interval lies, and how far its edges are apart. (No values to begin with: `measure_interval` sets what
   !> there is.)
   type :: interval_type
      real(wp) :: low, high                    !! along the mean direction from the first vertex of e [length]
      real(wp) :: start                        !! of the first vertex of f, along the same [length]
      real(wp) :: gap_low, gap_high            !! [length]
      real(wp) :: tangent(2)                   !! mean direction of the edges, along e
      integer :: f, e                          !! edges
      integer :: joint                         !! joint material, by length
      integer :: row                           !! of its first station in the table, once rows are sorted
      integer :: vertex_low, vertex_high       !! corner at each end; 0 where the edges do not overlap
      integer :: edge_low, edge_high           !! and the edge that it stands on
      logical :: exists
      logical :: is_deep                       !! not for its depth in a thin block alone
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

   !> Geometry of the stations of all intervals of a list, in their rows.
   pure subroutine place_intervals(intervals, points, nv, vertices, tangent, n, point, share, normal, gap, weight)
      type(interval_type), intent(in) :: intervals(:)
      integer, intent(in) :: points(:)             !! (joints) stations of an interval
      integer, intent(in) :: nv, n                 !! vertices, rows
      real(wp), intent(in) :: vertices(2, nv), tangent(2, nv)
      real(wp), intent(inout) :: point(2, n), share(n), normal(2, n), gap(n), weight(n)   !! as of `place_stations`
      integer :: i
      do i = 1, size(intervals)
         associate (row => intervals(i)%row)
            call place_stations(intervals(i), points(intervals(i)%joint), nv, vertices, tangent, point(1, row), &
                                share(row), normal(1, row), gap(row), weight(row))
         end associate
      end do
   end subroutine place_intervals

   !> Geometry of the n stations of an interval. Their normals are those of the edges on which corners stand, between
   !> the ends the mean of both edges.
   pure subroutine place_stations(interval, n, nv, vertices, tangent, point, share, normal, gap, weight)
      type(interval_type), intent(in) :: interval
      integer, intent(in) :: n, nv
      real(wp), intent(in) :: vertices(2, nv), tangent(2, nv)
      real(wp), intent(out) :: point(2, n)    !! corner, or between the edges [length]
      real(wp), intent(out) :: share(n)       !! of the gap between the point and block a
      real(wp), intent(out) :: normal(2, n)   !! unit vector from block b to block a
      real(wp), intent(out) :: gap(n)         !! [length]
      real(wp), intent(out) :: weight(n)      !! length of joint that each stands for [length]
      real(wp) :: t(2), foot(2), head(2), overlap, along, along_e, along_f, part
      integer :: k
      overlap = interval%high - interval%low
      call place_end(interval%vertex_low, interval%edge_low, interval%f, nv, vertices, tangent, point(:, 1), share(1), &
                     normal(:, 1))
      call place_end(interval%vertex_high, interval%edge_high, interval%f, nv, vertices, tangent, point(:, n), &
                     share(n), normal(:, n))
      gap(1) = interval%gap_low
      gap(n) = interval%gap_high
      weight(1) = station_share(1, n)*overlap
      weight(n) = station_share(n, n)*overlap
      t = interval%tangent
      associate (f => interval%f, e => interval%e)
         along_e = tangent(1, e)*t(1) + tangent(2, e)*t(2)
         along_f = tangent(1, f)*t(1) + tangent(2, f)*t(2)
         do k = 2, n - 1
            select case (n)
            case (4)
               part = position_4(k)
            case (5)
               part = position_5(k)
            case default
               part = position_3(k)
            end select
            along = interval%low + part*overlap
            foot = vertices(:, e) + along/along_e*tangent(:, e)
            head = vertices(:, f) + (along - interval%start)/along_f*tangent(:, f)
            normal(1, k) = t(2)
            normal(2, k) = -t(1)
            gap(k) = (head(1) - foot(1))*t(2) + (head(2) - foot(2))*(-t(1))
            share(k) = 0.5_wp
            point(:, k) = 0.5_wp*(foot + head)
            weight(k) = station_share(k, n)*overlap
         end do
      end associate
   end subroutine place_stations

   !> The station at the end of an interval, where a corner stands on an edge.
   pure subroutine place_end(v, edge, f, nv, vertices, tangent, point, share, normal)
      integer, intent(in) :: v, edge
      integer, intent(in) :: f, nv          !! edge of block a, vertices
      real(wp), intent(in) :: vertices(2, nv), tangent(2, nv)
      real(wp), intent(out) :: point(2), share, normal(2)
      point = vertices(:, v)
      if (edge == f) then
         ! on an edge of block a it is a corner of block b
         share = 1
         normal(1) = -tangent(2, edge)
         normal(2) = tangent(1, edge)
      else
         share = 0
         normal(1) = tangent(2, edge)
         normal(2) = -tangent(1, edge)
      end if
   end subroutine place_end

end module rockdda_contact_intervals
