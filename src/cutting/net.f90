! SPDX-License-Identifier: MIT
!> The net of lines: nodes where they meet, pieces between nodes that do not cross, distinct edges.
module rockdda_cutting_net
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type
   use rockdda_cutting_cleaning, only : clean_pieces
   use rockdda_cutting_graph, only : graph_type, pieces_type, build_graph
   use rockdda_cutting_intersections, only : find_meetings
   use rockdda_cutting_nodes, only : node_set_type, merge_meetings
   use rockdda_cutting_overlaps, only : visible_lines_type, find_visible
   implicit none
   private
   public :: make_net

contains

   !> Make the net; dead ends are in it.
   subroutine make_net(lines, skip, e0, visible, pieces, graph, n_rounds, error)
      real(wp), intent(in) :: lines(:, :)                  !! (4, n)
      logical, intent(in) :: skip(:)                       !! (n) lines to ignore
      real(wp), intent(in) :: e0                           !! merging distance [L], > 0
      type(visible_lines_type), intent(out) :: visible     !! with the meetings of their parts, and those of pieces
      type(pieces_type), intent(out) :: pieces
      type(graph_type), intent(out) :: graph
      integer, intent(out) :: n_rounds                     !! of cleaning with changes
      type(error_type), allocatable, intent(out) :: error
      type(node_set_type) :: nodes
      integer :: n
      call find_visible(lines, skip, visible)
      associate (meetings => visible%meetings)
         call find_meetings(visible%segments, visible%skip, e0, meetings, visible%continues)
         meetings%pair = visible%pairs(meetings%lines(:, 1:meetings%n), meetings%parameter(:, 1:meetings%n))
         call merge_meetings(meetings, visible%n, e0, nodes, pieces)
      end associate
      n = nodes%bins%n
      call clean_pieces(e0, nodes, pieces, n_rounds, error)
      if (allocated(error)) return
      ! from parts to lines
      nodes%key(:, n + 1:nodes%bins%n) = visible%pairs(nodes%key(:, n + 1:nodes%bins%n))
      visible%part = pieces%line(1:pieces%n)
      pieces%line(1:pieces%n) = visible%line(visible%part)
      call build_graph(nodes%bins%position(:, 1:nodes%bins%n), nodes%key(:, 1:nodes%bins%n), pieces, graph)
   end subroutine make_net

end module rockdda_cutting_net
