! SPDX-License-Identifier: MIT
!> The first stages of a cut one after the other, for tests of the later ones; random lines.
module nets
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type
   use rockdda_cutting_net, only : clean_pieces, node_set_type, merge_meetings
   use rockdda_cutting_faces, only : face_set_type, prune_dead_ends, trace_faces
   use rockdda_cutting_graph, only : graph_type, pieces_type, build_graph
   use rockdda_cutting_intersections, only : meeting_list_type, find_meetings
   use line_sets, only : random_type
   implicit none
   private
   public :: random_lines, merge_lines, build_net, trace_net

contains

   !> n lines with both ends uniform in the unit square.
   function random_lines(n, seed) result(lines)
      integer, intent(in) :: n, seed
      real(wp) :: lines(4, n)
      type(random_type) :: random
      integer :: i, k
      random%state = seed
      do i = 1, n
         do k = 1, 4
            lines(k, i) = random%next()
         end do
      end do
   end function random_lines

   !> Nodes and pieces of the lines, not cleaned.
   subroutine merge_lines(lines, e0, meetings, nodes, pieces)
      real(wp), intent(in) :: lines(:, :)   !! (4, n)
      real(wp), intent(in) :: e0            !! [length]
      type(meeting_list_type), intent(out) :: meetings
      type(node_set_type), intent(out) :: nodes
      type(pieces_type), intent(out) :: pieces
      logical :: skip(size(lines, 2))
      skip = .false.
      call find_meetings(lines, skip, e0, meetings)
      call merge_meetings(meetings, size(lines, 2), e0, nodes, pieces)
   end subroutine merge_lines

   !> Net of the lines after cleaning, dead ends included.
   subroutine build_net(lines, e0, graph)
      real(wp), intent(in) :: lines(:, :)   !! (4, n)
      real(wp), intent(in) :: e0            !! [length]
      type(graph_type), intent(out) :: graph
      type(meeting_list_type) :: meetings
      type(node_set_type) :: nodes
      type(pieces_type) :: pieces
      type(error_type), allocatable :: error
      integer :: rounds
      call merge_lines(lines, e0, meetings, nodes, pieces)
      call clean_pieces(e0, nodes, pieces, rounds, error)
      if (allocated(error)) return          ! an empty graph, which no test takes for a result
      call build_graph(nodes%bins%position(:, 1:nodes%bins%n), nodes%key(:, 1:nodes%bins%n), pieces, graph)
   end subroutine build_net

   !> Faces of the lines.
   subroutine trace_net(lines, e0, graph, faces)
      real(wp), intent(in) :: lines(:, :)   !! (4, n)
      real(wp), intent(in) :: e0            !! [length]
      type(graph_type), intent(out) :: graph
      type(face_set_type), intent(out) :: faces
      call build_net(lines, e0, graph)
      call prune_dead_ends(graph)
      call trace_faces(graph, faces)
   end subroutine trace_net

end module nets
