! SPDX-License-Identifier: MIT
!> The net of lines: nodes where they meet, pieces between nodes that do not cross, distinct edges.
module rockdda_cutting_net
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type
   use rockdda_cutting_cleaning, only : clean_pieces
   use rockdda_cutting_graph, only : graph_type, pieces_type, build_graph
   use rockdda_cutting_intersections, only : meeting_list_type, find_meetings
   use rockdda_cutting_nodes, only : node_set_type, merge_meetings
   implicit none
   private
   public :: make_net

contains

   !> Make the net; dead ends are in it.
   subroutine make_net(lines, skip, e0, meetings, pieces, graph, n_rounds, error)
      real(wp), intent(in) :: lines(:, :)                  !! (4, n)
      logical, intent(in) :: skip(:)                       !! (n) lines to ignore
      real(wp), intent(in) :: e0                           !! merging distance [L], > 0
      type(meeting_list_type), intent(out) :: meetings
      type(pieces_type), intent(out) :: pieces
      type(graph_type), intent(out) :: graph
      integer, intent(out) :: n_rounds                     !! of cleaning with changes
      type(error_type), allocatable, intent(out) :: error
      type(node_set_type) :: nodes
      call find_meetings(lines, skip, e0, meetings)
      call merge_meetings(meetings, size(skip), e0, nodes, pieces)
      call clean_pieces(e0, nodes, pieces, n_rounds, error)
      if (allocated(error)) return
      call build_graph(nodes%bins%position(:, 1:nodes%bins%n), nodes%key(:, 1:nodes%bins%n), pieces, graph)
   end subroutine make_net

end module rockdda_cutting_net
