! SPDX-License-Identifier: MIT
!> Intervals of the joints between close blocks, as rows of a contact table: one for each station; and what they cover.
module rockdda_contact_interval_search
   use rockdda_base_kinds, only : wp
   use rockdda_model_blocks, only : block_system_type
   use rockdda_contact_broad_phase, only : close_pairs_type
   use rockdda_contact_exposure, only : exposure_type
   use rockdda_contact_history, only : contact_history_type
   use rockdda_contact_table, only : contact_table_type, contact_state
   use rockdda_contact_topology, only : contact_topology_type
   use rockdda_contact_outlines, only : outlines_type
   use rockdda_contact_candidates, only : candidate_type, candidate_list_type
   use rockdda_contact_intervals, only : interval_type, measure_interval, is_facing, most_points
   use rockdda_contact_near_lists, only : near_lists_type, near_part_type, near_pair_type, edges_with_edges
   use rockdda_contact_search_limits, only : search_limits_type
   use rockdda_contact_narrow_phase, only : collect_pair, is_beyond
   implicit none
   private
   public :: search_faces, joint_of

contains

   !> Intervals of all joints, and what they cover. Contacts of vertices on edges need but the latter.
   !> Many arguments: all that the search knows of the step.
   subroutine search_faces(pairs, lists, blocks, topology, outlines, vertices, limits, previous, history, exposure, &
                           found)
      type(close_pairs_type), intent(in) :: pairs
      type(near_lists_type), intent(in) :: lists             !! of the pairs, by length
      type(block_system_type), intent(in) :: blocks
      type(contact_topology_type), intent(in) :: topology
      type(outlines_type), intent(in) :: outlines
      real(wp), intent(in), contiguous :: vertices(:, :)
      type(search_limits_type), intent(in) :: limits
      type(contact_table_type), intent(in) :: previous       !! last step's table
      type(contact_history_type), intent(in) :: history      !! its index
      type(exposure_type), intent(inout) :: exposure
      type(candidate_list_type), intent(inout) :: found(:)   !! (parts)
      integer :: part, n_parts, k, before, n
      logical :: is_tied
      n_parts = pairs%n_parts()
      found%n_intervals = 0
      found%n_kept = 0
      !$omp parallel do default(none) shared(pairs, lists, blocks, topology, outlines, vertices, limits, previous) &
      !$omp shared(history, found, n_parts) private(part) schedule(dynamic) if (n_parts > 1)
      do part = 1, n_parts
         if (limits%by_length) then
            call search_listed_edges(lists%parts(part), pairs, vertices, topology, outlines, blocks%edge_joint, &
                                     limits, previous, history, found(part))
         else
            call search_close(part, pairs, blocks, topology, outlines, vertices, limits, previous, history, &
                              found(part))
         end if
      end do
      !$omp end parallel do
      if (allocated(limits%sunk)) then
         call exposure%clear(size(vertices, 2), limits%smooth, limits%sunk, topology%block)
      else
         call exposure%clear(size(vertices, 2), limits%smooth)
      end if
      do part = 1, n_parts
         n = 0
         do k = 1, found(part)%n
            associate (row => found(part)%rows(k))
               if (row%station /= 1) cycle
               n = n + 1
               before = history%find(previous, row%vertex, row%edge, 1)
               is_tied = .false.
               if (before > 0) is_tied = previous%tied(before)
               call exposure%cover(row%vertex, row%edge, found(part)%intervals(n), is_tied)
            end associate
         end do
      end do
      if (.not. limits%by_length) found%n = 0
      do part = 1, merge(n_parts, 0, limits%by_length)
         call drop_hidden_intervals(exposure, outlines, topology, vertices, found(part))
      end do
   end subroutine search_faces

   !> A block that rides on another, and stands deeper in it than the surface ahead, faces the side of the next block by
   !> that depth: too short an interval to count, when its corner cannot strike that side.
   pure subroutine drop_hidden_intervals(exposure, outlines, topology, vertices, list)
      type(exposure_type), intent(in) :: exposure
      type(outlines_type), intent(in) :: outlines
      type(contact_topology_type), intent(in) :: topology
      real(wp), intent(in), contiguous :: vertices(:, :)
      type(candidate_list_type), intent(inout) :: list
      type(interval_type) :: interval
      integer :: i, k, n
      logical :: is_dropped
      i = 0
      n = 0
      is_dropped = .false.
      do k = 1, list%n
         if (list%rows(k)%station == 1) then
            i = i + 1
            is_dropped = .false.
            associate (f => list%rows(k)%vertex, e => list%rows(k)%edge)
               if (list%intervals(i)%high - list%intervals(i)%low <= exposure%between(f, e)) then
                  call measure_interval(f, e, vertices, topology, outlines, interval)
                  is_dropped = is_end_hidden(interval%vertex_low, interval%edge_low) .or. &
                               is_end_hidden(interval%vertex_high, interval%edge_high)
               end if
            end associate
         end if
         if (is_dropped) cycle
         n = n + 1
         list%rows(n) = list%rows(k)
      end do
      list%n = n

   contains

      !> Is the corner at an end of the interval one that cannot strike the edge?
      pure logical function is_end_hidden(v, e)
         integer, intent(in) :: v, e
         real(wp) :: foot
         foot = dot_product(vertices(:, v) - vertices(:, e), outlines%tangent(:, e))
         is_end_hidden = exposure%is_hidden(v, e, foot, vertices, topology, outlines)
      end function is_end_hidden

   end subroutine drop_hidden_intervals

   !> Intervals of one part of the pairs, with contacts of vertices on edges: of all edges that are close.
   pure subroutine search_close(part, pairs, blocks, topology, outlines, vertices, limits, previous, history, list)
      integer, intent(in) :: part
      type(close_pairs_type), intent(in) :: pairs
      type(block_system_type), intent(in) :: blocks
      type(contact_topology_type), intent(in) :: topology
      type(outlines_type), intent(in) :: outlines        !! of the vertices now
      real(wp), intent(in), contiguous :: vertices(:, :) !! (2, nv) now
      type(search_limits_type), intent(in) :: limits
      type(contact_table_type), intent(in) :: previous   !! last step's table
      type(contact_history_type), intent(in) :: history  !! its index
      type(candidate_list_type), intent(inout) :: list
      integer :: i, j, k, f, e
      do k = pairs%first_of(part), pairs%first_of(part + 1) - 1
         if (.not. pairs%is_close(k)) cycle
         associate (a => pairs%candidates(1, k), b => pairs%candidates(2, k))
            call collect_pair([blocks%vertex_offset(a) + 1, blocks%vertex_offset(a + 1)], &
                              [blocks%vertex_offset(b) + 1, blocks%vertex_offset(b + 1)], pairs%boxes(:, a), &
                              pairs%boxes(:, b), vertices, topology, limits%reach, list)
         end associate
         call list%keep_near()
         do i = 1, list%n_edges_a
            f = list%edges_a(i)
            do j = 1, list%n_edges_b
               e = list%edges_b(j)
               if (may_face(f, e, size(vertices, 2), vertices, outlines%tangent, outlines%length, limits)) &
                  call try_interval(f, e, vertices, topology, outlines, blocks%edge_joint, limits, previous, history, &
                                    list)
            end do
         end do
      end do
   end subroutine search_close

   !> Intervals of one part of the pairs by length: of the edges listed, as far as they are close to the other block.
   pure subroutine search_listed_edges(part, pairs, vertices, topology, outlines, joint, limits, previous, history, &
                                       list)
      type(near_part_type), intent(in) :: part
      type(close_pairs_type), intent(in) :: pairs
      real(wp), intent(in), contiguous :: vertices(:, :)
      type(contact_topology_type), intent(in) :: topology
      type(outlines_type), intent(in) :: outlines
      integer, intent(in) :: joint(:)                    !! (nv) joint material of each edge
      type(search_limits_type), intent(in) :: limits
      type(contact_table_type), intent(in) :: previous
      type(contact_history_type), intent(in) :: history
      type(candidate_list_type), intent(inout) :: list
      type(near_pair_type) :: at
      integer :: l
      logical :: found
      do
         call at%advance(part, found)
         if (.not. found) exit
         if (at%last(edges_with_edges) < at%first(edges_with_edges)) cycle
         if (.not. pairs%is_close(at%pair)) cycle
         do l = at%first(edges_with_edges), at%last(edges_with_edges), 2
            associate (f => part%items(l), e => part%items(l + 1), &
                       box_a => pairs%boxes(:, pairs%candidates(1, at%pair)), &
                       box_b => pairs%boxes(:, pairs%candidates(2, at%pair)))
               if (.not. is_facing(f, e, outlines, limits%cosine)) cycle
               if (is_beyond(vertices(:, f), vertices(:, topology%next(f)), box_b, limits%reach)) cycle
               if (is_beyond(vertices(:, e), vertices(:, topology%next(e)), box_a, limits%reach)) cycle
               call try_interval(f, e, vertices, topology, outlines, joint, limits, previous, history, list)
            end associate
         end do
      end do
   end subroutine search_listed_edges

   !> Append the stations of the interval of two edges, if they face each other within reach.
   pure subroutine try_interval(f, e, vertices, topology, outlines, joint, limits, previous, history, list)
      integer, intent(in) :: f, e
      real(wp), intent(in), contiguous :: vertices(:, :)
      type(contact_topology_type), intent(in) :: topology
      type(outlines_type), intent(in) :: outlines
      integer, intent(in) :: joint(:)                    !! (nv) joint material of each edge
      type(search_limits_type), intent(in) :: limits
      type(contact_table_type), intent(in) :: previous
      type(contact_history_type), intent(in) :: history
      type(candidate_list_type), intent(inout) :: list
      type(interval_type) :: interval
      integer :: k
      call measure_interval(f, e, vertices, topology, outlines, interval)
      if (interval%is_deep) interval%exists = was_closed(f, e, previous, history)
      if (.not. interval%exists) return
      if (min(interval%gap_low, interval%gap_high) > limits%reach) return
      if (max(interval%gap_low, interval%gap_high) < -limits%penetration) return
      call list%append_interval(interval%stretch_type)
      do k = 1, limits%points(joint_of(f, e, joint))
         call list%append(candidate_type(f, e, station=k))
      end do
   end subroutine try_interval

   !> May two edges face each other on an interval within reach? Only then is it measured. Their directions differ from
   !> opposite ones by less than the angle tolerance, so that positions and gaps by e differ from those of the interval
   !> by less than its sine times the lengths.
   pure logical function may_face(f, e, nv, vertices, tangent, length, limits)
      integer, intent(in) :: f, e, nv
      real(wp), intent(in) :: vertices(2, nv), tangent(2, nv), length(nv)
      type(search_limits_type), intent(in) :: limits
      real(wp) :: d(2), along, gap, slack
      may_face = tangent(1, f)*tangent(1, e) + tangent(2, f)*tangent(2, e) <= -limits%cosine
      if (.not. may_face) return
      d(1) = vertices(1, f) - vertices(1, e)
      d(2) = vertices(2, f) - vertices(2, e)
      along = d(1)*tangent(1, e) + d(2)*tangent(2, e)
      gap = d(1)*tangent(2, e) - d(2)*tangent(1, e)
      slack = (limits%sine + 1.0e-9_wp)*(abs(d(1)) + abs(d(2)) + length(f) + length(e))
      may_face = along >= -slack .and. along - length(f) <= length(e) + slack .and. gap <= limits%reach + slack .and. &
                 gap >= -limits%penetration - slack
   end function may_face

   !> Was a station of these edges closed at the end of the last step?
   pure logical function was_closed(f, e, previous, history)
      integer, intent(in) :: f, e
      type(contact_table_type), intent(in) :: previous
      type(contact_history_type), intent(in) :: history
      integer :: k, row
      was_closed = .false.
      do k = 1, most_points
         row = history%find(previous, f, e, k)
         if (row == 0) cycle
         was_closed = previous%state(row) /= contact_state%open
         if (was_closed) return
      end do
   end function was_closed

   !> Joint material of two edges that face each other: the same whichever comes first.
   pure integer function joint_of(f, e, joint)
      integer, intent(in) :: f, e
      integer, intent(in) :: joint(:)   !! (nv) of each edge
      joint_of = max(joint(f), joint(e))
   end function joint_of

end module rockdda_contact_interval_search
