! SPDX-License-Identifier: MIT
!> Intervals of the joints between a close pair of blocks, as rows of a contact table: one for each station.
module rockdda_contact_interval_search
   use rockdda_base_kinds, only : wp
   use rockdda_contact_topology, only : contact_topology_type
   use rockdda_contact_outlines, only : outlines_type
   use rockdda_contact_candidates, only : candidate_type, candidate_list_type
   use rockdda_contact_intervals, only : interval_type, measure_interval, is_facing
   use rockdda_contact_search_limits, only : search_limits_type
   use rockdda_contact_narrow_phase, only : collect_near
   implicit none
   private
   public :: search_intervals, joint_of

contains

   !> Append the stations of all intervals of blocks a < b.
   pure subroutine search_intervals(range_a, range_b, box_a, box_b, vertices, topology, outlines, joint, limits, list)
      integer, intent(in) :: range_a(2), range_b(2)      !! first and last vertex of each block
      real(wp), intent(in) :: box_a(4), box_b(4)         !! xmin ymin xmax ymax
      real(wp), intent(in), contiguous :: vertices(:, :) !! (2, nv) now
      type(contact_topology_type), intent(in) :: topology
      type(outlines_type), intent(in) :: outlines        !! of the vertices now
      integer, intent(in) :: joint(:)                    !! (nv) joint material of each edge
      type(search_limits_type), intent(in) :: limits
      type(candidate_list_type), intent(inout) :: list
      type(interval_type) :: interval
      integer :: i, j, k, f, e
      call collect_near(range_a, box_b, size(vertices, 2), vertices, topology, limits%reach, list%near_a, &
                        list%n_near_a, list%edges_a, list%n_edges_a)
      if (list%n_edges_a == 0) return
      call collect_near(range_b, box_a, size(vertices, 2), vertices, topology, limits%reach, list%near_b, &
                        list%n_near_b, list%edges_b, list%n_edges_b)
      do i = 1, list%n_edges_a
         f = list%edges_a(i)
         do j = 1, list%n_edges_b
            e = list%edges_b(j)
            if (.not. is_facing(f, e, outlines, limits%cosine)) cycle
            call measure_interval(f, e, vertices, topology, outlines, interval)
            if (.not. interval%exists) cycle
            if (min(interval%gap_low, interval%gap_high) > limits%reach) cycle
            if (max(interval%gap_low, interval%gap_high) < -limits%penetration) cycle
            call list%append_interval(interval)
            do k = 1, limits%points(joint_of(f, e, joint))
               call list%append(candidate_type(f, e, station=k))
            end do
         end do
      end do
   end subroutine search_intervals

   !> Joint material of two edges that face each other: the same whichever comes first.
   pure integer function joint_of(f, e, joint)
      integer, intent(in) :: f, e
      integer, intent(in) :: joint(:)   !! (nv) of each edge
      joint_of = max(joint(f), joint(e))
   end function joint_of

end module rockdda_contact_interval_search
