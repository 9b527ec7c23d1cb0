! SPDX-License-Identifier: MIT
!> Candidate rows of all close pairs of blocks.
!>
!> Intervals first, of edges that face each other, because what they cover hides corners and vertices (`search_faces`;
!> each becomes two rows of the contact table); then the pairs in a few parts, one after the other or side by side.
!> With contacts by length the searches test what is listed for each pair (rockdda_contact_near_lists); with contacts
!> of vertices on edges, all vertices and edges of a pair that are close, and of intervals what they cover alone
!> (`corrected`), or nothing.
module rockdda_contact_narrow_search
   use rockdda_model_blocks, only : block_system_type
   use rockdda_contact_broad_phase, only : close_pairs_type, many_parts
   use rockdda_contact_candidates, only : candidate_list_type
   use rockdda_contact_corner_search, only : try_rounded_corner
   use rockdda_contact_exposure, only : search_input_type
   use rockdda_contact_vertex_search, only : search_pair, try_vertex, is_beyond, collect_pair
   use rockdda_contact_near_lists, only : near_lists_type, near_part_type, near_pair_type, corners_with_corners, &
      vertices_of_first, vertices_of_second, edges_with_edges
   use rockdda_base_kinds, only : wp
   use rockdda_contact_history, only : faces
   use rockdda_contact_table, only : contact_state
   use rockdda_contact_interval_law, only : n_points
   use rockdda_contact_intervals, only : interval_type, measure_interval
   use rockdda_contact_search_limits, only : search_limits_type, placing_share
   implicit none
   private
   public :: narrow_search_type

   !> Scratch, kept from step to step; nothing in it is part of the state.
   type :: narrow_search_type
      type(near_lists_type) :: lists                  !! by length
      type(candidate_list_type) :: found(many_parts)  !! candidate rows of each part
   contains
      procedure :: run
   end type narrow_search_type

contains

   !> Find the candidate rows within the limits: `found` of all parts.
   subroutine run(self, pairs, blocks, given)
      class(narrow_search_type), intent(inout) :: self
      type(close_pairs_type), intent(in) :: pairs
      type(block_system_type), intent(in) :: blocks
      type(search_input_type), intent(in) :: given
      integer :: part, n_parts
      if (given%limits%by_length) call self%lists%update(pairs, blocks, given%topology, given%outlines, &
         given%vertices, given%limits)
      n_parts = pairs%n_parts()
      call self%found%clear()
      if (given%limits%by_length .or. given%limits%corrected) &
         call search_faces(pairs, self%lists, blocks, given, self%found(1:n_parts))
      !$omp parallel do default(none) private(part) schedule(dynamic) if (n_parts > 1) &
      !$omp shared(self, pairs, blocks, given, n_parts)
      do part = 1, n_parts
         if (given%limits%by_length) then
            call search_listed_vertices(self%lists%parts(part), pairs, given, self%found(part))
         else
            call search_part(part, pairs, blocks, given, self%found(part))
         end if
      end do
      !$omp end parallel do
   end subroutine run

   !> Candidate rows of one part of the pairs, with contacts of vertices on edges.
   pure subroutine search_part(part, pairs, blocks, given, list)
      integer, intent(in) :: part
      type(close_pairs_type), intent(in) :: pairs
      type(block_system_type), intent(in) :: blocks
      type(search_input_type), intent(in) :: given
      type(candidate_list_type), intent(inout) :: list
      integer :: k
      do k = pairs%first_of(part), pairs%first_of(part + 1) - 1
         if (.not. pairs%is_close(k)) cycle
         associate (a => pairs%candidates(1, k), b => pairs%candidates(2, k))
            call search_pair([blocks%vertex_offset(a) + 1, blocks%vertex_offset(a + 1)], [blocks%vertex_offset(b) + 1, &
                             blocks%vertex_offset(b + 1)], pairs%boxes(:, a), pairs%boxes(:, b), given, list)
         end associate
      end do
   end subroutine search_part

   !> Candidate rows of corners and of vertices on edges by length, of one part of the pairs.
   pure subroutine search_listed_vertices(part, pairs, given, list)
      type(near_part_type), intent(in) :: part
      type(close_pairs_type), intent(in) :: pairs
      type(search_input_type), intent(in) :: given
      type(candidate_list_type), intent(inout) :: list
      type(near_pair_type) :: at
      logical :: found
      integer :: l
      do
         call at%advance(part, found)
         if (.not. found) exit
         ! from this kind on: edges with edges are those of `search_faces`
         if (all(at%last(corners_with_corners:) < at%first(corners_with_corners:))) cycle
         if (.not. pairs%is_close(at%pair)) cycle
         list%n_corners = 0
         associate (items => part%items, box_a => pairs%boxes(:, pairs%candidates(1, at%pair)), &
                    box_b => pairs%boxes(:, pairs%candidates(2, at%pair)))
            do l = at%first(corners_with_corners), at%last(corners_with_corners), 2
               associate (v => given%vertices(:, items(l)), w => given%vertices(:, items(l + 1)))
                  if (is_beyond(v, v, box_b, given%limits%reach)) cycle
                  if (is_beyond(w, w, box_a, given%limits%reach)) cycle
               end associate
               call try_rounded_corner(items(l), items(l + 1), given, list)
            end do
            do l = at%first(vertices_of_first), at%last(vertices_of_first), 2
               call try_vertex(items(l), items(l + 1), 1, box_a, box_b, size(given%vertices, 2), given%vertices, &
                               given%outlines%tangent, given%outlines%length, given, list)
            end do
            do l = at%first(vertices_of_second), at%last(vertices_of_second), 2
               call try_vertex(items(l), items(l + 1), 2, box_b, box_a, size(given%vertices, 2), given%vertices, &
                               given%outlines%tangent, given%outlines%length, given, list)
            end do
         end associate
      end do
   end subroutine search_listed_vertices

   !> Intervals of all joints, and what they cover: `exposure`. Contacts of vertices on edges need but the latter.
   subroutine search_faces(pairs, lists, blocks, given, found)
      type(close_pairs_type), intent(in) :: pairs
      type(near_lists_type), intent(in) :: lists             !! of the pairs, by length
      type(block_system_type), intent(in) :: blocks
      type(search_input_type), intent(in) :: given
      type(candidate_list_type), intent(inout) :: found(:)   !! (parts)
      integer :: part, n_parts, k, before
      logical :: may_be_tied
      n_parts = pairs%n_parts()
      !$omp parallel do default(none) shared(pairs, lists, blocks, given, found, n_parts) private(part) &
      !$omp schedule(dynamic) if (n_parts > 1)
      do part = 1, n_parts
         if (given%limits%by_length) then
            call search_listed_edges(lists%parts(part), pairs, size(given%vertices, 2), given%vertices, &
                                     given%outlines%tangent, given%topology%next, blocks%edge_joint, given, found(part))
         else
            call search_close(part, pairs, blocks, given, found(part))
         end if
      end do
      !$omp end parallel do
      if (allocated(given%limits%sunk)) then
         call given%exposure%clear(size(given%vertices, 2), given%limits%smooth, given%limits%sunk, &
                                   given%topology%block, given%topology%inradius)
      else
         call given%exposure%clear(size(given%vertices, 2), given%limits%smooth)
      end if
      may_be_tied = .false.
      if (allocated(given%limits%is_tied)) may_be_tied = any(given%limits%is_tied)
      do part = 1, n_parts
         do k = 1, found(part)%n_intervals
            associate (interval => found(part)%intervals(k))
               if (may_be_tied) then
                  before = given%history%find(given%previous, interval%f, interval%e, 1)
                  if (before > 0) then
                     interval%is_tied = given%previous%tied(before)
                  else if (given%limits%is_tied(max(blocks%edge_joint(interval%f), blocks%edge_joint(interval%e)))) then
                     interval%is_tied = begins_tied(interval, given)
                  end if
               end if
               call given%exposure%cover(interval, interval%is_tied)
            end associate
         end do
      end do
      if (.not. given%limits%by_length) found%n_intervals = 0
      do part = 1, merge(n_parts, 0, given%limits%by_length)
         call drop_hidden_intervals(given, found(part))
      end do
   end subroutine search_faces

   !> Do the edges of an interval of intact rock touch where blocks are placed?
   pure logical function begins_tied(interval, given)
      type(interval_type), intent(in) :: interval
      type(search_input_type), intent(in) :: given
      real(wp) :: touch
      begins_tied = allocated(given%limits%is_born)
      if (.not. begins_tied) return
      associate (f => interval%f, e => interval%e)
         touch = min(given%limits%touch, placing_share*min(given%outlines%length(f), given%outlines%length(e)))
         begins_tied = (given%limits%is_born(given%topology%block(f)) .or. &
                        given%limits%is_born(given%topology%block(e))) .and. max(abs(interval%gap_low), &
                        abs(interval%gap_high)) <= touch
      end associate
   end function begins_tied

   !> A block that rides on another, and stands deeper in it than the surface ahead, faces the side of the next block by
   !> that depth: too short an interval to count, when its corner cannot strike that side.
   pure subroutine drop_hidden_intervals(given, list)
      type(search_input_type), intent(in) :: given
      type(candidate_list_type), intent(inout) :: list
      integer :: i, n
      real(wp) :: tolerance
      logical :: is_dropped
      n = 0
      tolerance = given%exposure%tolerance
      do i = 1, list%n_intervals
         associate (interval => list%intervals(i))
            if (given%exposure%has_own) tolerance = max(given%exposure%tolerance, given%exposure%own(interval%f), &
                                                         given%exposure%own(interval%e))
            is_dropped = interval%high - interval%low <= tolerance
            if (is_dropped) is_dropped = is_end_hidden(interval%vertex_low, interval%edge_low) .or. &
                                         is_end_hidden(interval%vertex_high, interval%edge_high)
         end associate
         if (is_dropped) cycle
         n = n + 1
         if (n < i) list%intervals(n) = list%intervals(i)
      end do
      list%n_intervals = n

   contains

      !> Is the corner at an end of the interval one that cannot strike the edge?
      pure logical function is_end_hidden(v, e)
         integer, intent(in) :: v, e
         real(wp) :: foot
         foot = dot_product(given%vertices(:, v) - given%vertices(:, e), given%outlines%tangent(:, e))
         is_end_hidden = given%exposure%is_hidden(v, e, foot, given%vertices, given%topology, given%outlines)
      end function is_end_hidden

   end subroutine drop_hidden_intervals

   !> Intervals of one part of the pairs, with contacts of vertices on edges: of all edges that are close.
   pure subroutine search_close(part, pairs, blocks, given, list)
      integer, intent(in) :: part
      type(close_pairs_type), intent(in) :: pairs
      type(block_system_type), intent(in) :: blocks
      type(search_input_type), intent(in) :: given
      type(candidate_list_type), intent(inout) :: list
      integer :: i, j, k, f, e
      do k = pairs%first_of(part), pairs%first_of(part + 1) - 1
         if (.not. pairs%is_close(k)) cycle
         associate (a => pairs%candidates(1, k), b => pairs%candidates(2, k))
            call collect_pair([blocks%vertex_offset(a) + 1, blocks%vertex_offset(a + 1)], &
                              [blocks%vertex_offset(b) + 1, blocks%vertex_offset(b + 1)], pairs%boxes(:, a), &
                              pairs%boxes(:, b), given%vertices, given%topology, given%limits%reach, list)
         end associate
         do i = 1, list%n_edges_a
            f = list%edges_a(i)
            do j = 1, list%n_edges_b
               e = list%edges_b(j)
               if (.not. may_face(f, e, size(given%vertices, 2), given%vertices, given%outlines%tangent, &
                   given%outlines%length, given%limits)) cycle
               if (list%n_intervals == list%room_for_intervals) call list%make_room_for_interval()
               associate (interval => list%intervals(list%n_intervals + 1))
                  call measure_interval(f, e, given%vertices, given%topology, given%outlines, interval)
                  if (counts(interval, given)) list%n_intervals = list%n_intervals + 1
               end associate
            end do
         end do
      end do
   end subroutine search_close

   !> Intervals of one part of the pairs by length: of the edges listed, as far as they are close to the other block.
   !> Many arguments: arrays of constant shape spare the place of each number.
   pure subroutine search_listed_edges(part, pairs, nv, vertices, tangent, next, joint, given, list)
      type(near_part_type), intent(in) :: part
      type(close_pairs_type), intent(in) :: pairs
      integer, intent(in) :: nv
      real(wp), intent(in) :: vertices(2, nv), tangent(2, nv)
      integer, intent(in) :: next(nv)                    !! of `topology`
      type(search_input_type), intent(in) :: given
      integer, intent(in) :: joint(nv)                   !! joint material of each edge
      type(candidate_list_type), intent(inout) :: list
      real(wp) :: box_a(4), box_b(4), opposite
      type(near_pair_type) :: at
      logical :: found
      integer :: l, f, e
      call list%reserve_intervals(part%n_faces)
      do
         call at%advance(part, found)
         if (.not. found) exit
         if (at%last(edges_with_edges) < at%first(edges_with_edges)) cycle
         if (.not. pairs%is_close(at%pair)) cycle
         box_a = widened(pairs%boxes(:, pairs%candidates(1, at%pair)))
         box_b = widened(pairs%boxes(:, pairs%candidates(2, at%pair)))
         do l = at%first(edges_with_edges), at%last(edges_with_edges), 2
            f = part%items(l)
            e = part%items(l + 1)
            opposite = tangent(1, f)*tangent(1, e) + tangent(2, f)*tangent(2, e)
            if (.not. opposite <= -given%limits%cosine) then
               if (.not. faces(f, e, opposite, given%limits, given%previous, given%history)) cycle
            end if
            if (is_beyond(f, next(f), box_b)) cycle
            if (is_beyond(e, next(e), box_a)) cycle
            if (list%n_intervals == list%room_for_intervals) call list%make_room_for_interval()
            associate (interval => list%intervals(list%n_intervals + 1))
               call measure_interval(f, e, vertices, given%topology, given%outlines, interval)
               if (.not. counts(interval, given)) cycle
               interval%joint = max(joint(f), joint(e))
               list%n_intervals = list%n_intervals + 1
            end associate
         end do
      end do

   contains

      !> A box that is larger by the reach on all sides.
      pure function widened(box)
         real(wp), intent(in) :: box(4)    !! xmin ymin xmax ymax [length]
         real(wp) :: widened(4)
         widened(1) = box(1) - given%limits%reach
         widened(2) = box(2) - given%limits%reach
         widened(3) = box(3) + given%limits%reach
         widened(4) = box(4) + given%limits%reach
      end function widened

      !> Do both ends of an edge lie beyond one side of a box?
      pure logical function is_beyond(p, q, box)
         integer, intent(in) :: p, q       !! vertices
         real(wp), intent(in) :: box(4)
         is_beyond = max(vertices(1, p), vertices(1, q)) < box(1) .or. max(vertices(2, p), vertices(2, q)) < box(2) &
                     .or. min(vertices(1, p), vertices(1, q)) > box(3) .or. &
                     min(vertices(2, p), vertices(2, q)) > box(4)
      end function is_beyond

   end subroutine search_listed_edges

   !> Does an interval exist within reach? One that is too deep does where it was closed in the last step.
   pure logical function counts(interval, given)
      type(interval_type), intent(in) :: interval
      type(search_input_type), intent(in) :: given
      counts = interval%exists
      if (interval%is_deep) counts = was_closed(interval%f, interval%e, given)
      if (counts) counts = .not. (is_let_in(interval%f, interval%e) .or. is_let_in(interval%e, interval%f))
      if (counts) counts = min(interval%gap_low, interval%gap_high) <= given%limits%reach .and. &
                           max(interval%gap_low, interval%gap_high) >= -given%limits%penetration

   contains

      !> Does edge e let in a tip at an end of edge f?
      pure logical function is_let_in(f, e)
         integer, intent(in) :: f, e
         associate (depth => -min(interval%gap_low, interval%gap_high), length => given%outlines%length)
            is_let_in = given%topology%lets_in(f, e, depth, length) .or. &
                        given%topology%lets_in(given%topology%next(f), e, depth, length)
         end associate
      end function is_let_in

   end function counts

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
      slack = (limits%facing_sine() + 1.0e-9_wp)*(abs(d(1)) + abs(d(2)) + length(f) + length(e))
      may_face = along >= -slack .and. along - length(f) <= length(e) + slack .and. gap <= limits%reach + slack .and. &
                 gap >= -limits%penetration - slack
   end function may_face

   !> Was the interval of these edges closed at the end of the last step?
   pure logical function was_closed(f, e, given)
      integer, intent(in) :: f, e
      type(search_input_type), intent(in) :: given
      integer :: k, row
      was_closed = .false.
      do k = 1, n_points
         row = given%history%find(given%previous, f, e, k)
         if (row == 0) cycle
         was_closed = given%previous%state(row) /= contact_state%open
         if (was_closed) return
      end do
   end function was_closed

end module rockdda_contact_narrow_search
