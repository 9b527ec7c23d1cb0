! SPDX-License-Identifier: MIT
!> Did a vertex that lies behind an edge enter the block through that edge?
!>
!> A vertex v that touches a block on one side f lies behind the line of its other edges e as well:
!>
!>                  \        /
!>      ---------- v \  B   /      v is at depth |gap| behind e, but it has not come through e: a spring born
!>        A        /  f    /       there would throw the blocks apart
!>                     \__/
!>                      e
!>
!> It has entered through e when it lies in the block, no other edge that its corner can pass is nearer, it is not at
!> another corner of the block, and it is not deeper than a circle that fits into the block. A contact that was closed
!> at the end of the last step has entered, however deep its spring has been compressed since.
module rockdda_contact_penetration
   use rockdda_base_kinds, only : wp
   use rockdda_geometry_polygons, only : point_in_polygon
   use rockdda_contact_topology, only : contact_topology_type
   use rockdda_contact_outlines, only : outlines_type, outward, is_outside
   implicit none
   private
   public :: is_entered

   !> A vertex that is less deep than this share of the edge's length need not lie in the block: its neighbour may hide
   !> the edge there by the compression of its own spring.
   real(wp), parameter :: shallow = 1.0e-4_wp
   !> The inner point that is tested in place of the vertex lies this share of the edge's length further inside.
   real(wp), parameter :: inwards = 1.0e-6_wp
   !> A vertex nearer to another corner than this share of its depth is at that corner.
   real(wp), parameter :: at_corner = 0.5_wp

contains

   !> Has vertex v entered the block of edge e through e?
   pure logical function is_entered(v, e, gap, s, topology, outlines, vertices, sine, was_closed)
      integer, intent(in) :: v, e
      real(wp), intent(in) :: gap          !! of the vertex, < 0 [length]
      real(wp), intent(in) :: s            !! distance of its foot from the start of the edge [length]
      type(contact_topology_type), intent(in) :: topology
      type(outlines_type), intent(in) :: outlines
      real(wp), intent(in), contiguous :: vertices(:, :)   !! (2, nv) now
      real(wp), intent(in) :: sine         !! of the angle tolerance
      logical, intent(in) :: was_closed    !! the contact was closed at the end of the last step
      real(wp) :: point(2), r(2), t(2), in_v(2), out_v(2), gap_k, foot, length
      integer :: k, last
      is_entered = .false.
      length = outlines%length(e)
      if (gap < -shallow*length) then
         t = outlines%tangent(:, e)
         point = vertices(:, v) + inwards*((0.5_wp*length - s)*t - length*outward(t))
         if (.not. is_inside(point, e, vertices, topology)) return
      end if
      is_entered = .true.
      if (was_closed) return
      is_entered = .false.
      if (gap < -topology%inradius(topology%block(e))) return
      in_v = outlines%tangent(:, topology%edge_in(v))
      out_v = outlines%tangent(:, topology%edge_out(v))
      last = topology%next(e)
      k = last
      do while (k /= e)
         r = vertices(:, v) - vertices(:, k)
         if (k /= last) then
            if (r(1)**2 + r(2)**2 < (at_corner*gap)**2) return
         end if
         if (topology%is_edge(k)) then
            t = outlines%tangent(:, k)
            gap_k = r(1)*t(2) - r(2)*t(1)
            foot = r(1)*t(1) + r(2)*t(2)
            if (abs(gap_k) < -gap .and. foot >= 0 .and. foot <= outlines%length(k)) then
               if (is_outside(in_v, out_v, outward(t), sine)) return
            end if
         end if
         k = topology%next(k)
      end do
      is_entered = .true.
   end function is_entered

   !> Does a point lie in the block that owns edge e?
   pure logical function is_inside(point, e, vertices, topology)
      real(wp), intent(in), contiguous :: vertices(:, :)   !! (2, nv)
      real(wp), intent(in) :: point(2)
      integer, intent(in) :: e
      type(contact_topology_type), intent(in) :: topology
      integer :: block
      block = topology%block(e)
      is_inside = point_in_polygon(point, vertices(:, topology%first(block):topology%first(block + 1) - 1))
   end function is_inside

end module rockdda_contact_penetration
