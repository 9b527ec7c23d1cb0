! SPDX-License-Identifier: MIT
!> Length of joint that a vertex on an edge stands for, with contact by length.
module rockdda_contact_vertex_weight
   use rockdda_base_kinds, only : wp
   use rockdda_contact_topology, only : contact_topology_type
   use rockdda_contact_outlines, only : outlines_type
   implicit none
   private
   public :: vertex_weight

   !> Share of an interval that its end stands for.
   real(wp), parameter :: end_share = 1.0_wp/6
   !> A vertex stands for at least this share of the end of the shortest of the three edges.
   real(wp), parameter :: least_share = 0.25_wp

contains

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

end module rockdda_contact_vertex_weight
