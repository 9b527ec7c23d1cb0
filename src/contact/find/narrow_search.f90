! SPDX-License-Identifier: MIT
!> Candidate rows of all close pairs of blocks.
!>
!> Intervals first, of edges that face each other, because what they cover hides corners and vertices; then the pairs in
!> a few parts, one after the other or side by side. With contacts by length the searches test what is listed for each
!> pair (rockdda_contact_near_lists); with contacts of vertices on edges, all vertices and edges of a pair that are
!> close, and of intervals what they cover alone (`corrected`), or nothing.
module rockdda_contact_narrow_search
   use rockdda_model_blocks, only : block_system_type
   use rockdda_contact_broad_phase, only : close_pairs_type, many_parts
   use rockdda_contact_candidates, only : candidate_list_type
   use rockdda_contact_corner_search, only : try_rounded_corner
   use rockdda_contact_exposure, only : search_input_type
   use rockdda_contact_interval_search, only : search_faces
   use rockdda_contact_vertex_search, only : search_pair, try_vertex, is_beyond
   use rockdda_contact_near_lists, only : near_lists_type, near_part_type, near_pair_type, corners_with_corners, &
                                           vertices_of_first, vertices_of_second
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

end module rockdda_contact_narrow_search
