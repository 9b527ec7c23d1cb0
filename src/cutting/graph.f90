! SPDX-License-Identifier: MIT
!> Net of nodes and edges of the input lines, before and after dead ends are removed.
!>
!>     pieces   straight parts of input lines between two nodes; several lines may share one interval
!>     edges    the distinct intervals; edge e joins nodes ends(1, e) and ends(2, e)
!>
!> An edge takes the joint material of the last of its lines in the file.
module rockdda_cutting_graph
   use rockdda_base_kinds, only : wp
   use rockdda_base_room, only : grow
   use rockdda_base_sorting, only : sorted_order
   implicit none
   private
   public :: graph_type, pieces_type, build_graph

   !> Parts of input lines between consecutive nodes.
   type :: pieces_type
      integer :: n = 0
      integer, allocatable :: ends(:, :)   !! (2, capacity) node numbers, in the line's direction
      integer, allocatable :: line(:)      !! (capacity) input line
   contains
      procedure :: add => add_piece
   end type pieces_type

   type :: graph_type
      integer :: n_nodes = 0
      real(wp), allocatable :: position(:, :)  !! (2, n_nodes)
      integer, allocatable :: node_key(:, :)   !! (2, n_nodes) the first pair of lines, i < j, that meets here
      integer :: n_edges = 0
      integer, allocatable :: ends(:, :)       !! (2, n_edges)
      integer, allocatable :: line(:)          !! (n_edges) last input line on it
      logical, allocatable :: alive(:)         !! (n_edges) not removed
      integer, allocatable :: piece_edge(:)    !! (n_pieces) edge of each piece
   end type graph_type

contains

   !> Append a piece.
   pure subroutine add_piece(self, a, b, line)
      class(pieces_type), intent(inout) :: self
      integer, intent(in) :: a, b          !! nodes
      integer, intent(in) :: line          !! input line
      self%n = self%n + 1
      call grow(self%ends, self%n, 2)
      call grow(self%line, self%n)
      self%ends(:, self%n) = [a, b]
      self%line(self%n) = line
   end subroutine add_piece

   !> Nodes in the order of their keys, and the distinct edges among the pieces.
   !> Node numbers in `pieces` are changed to the new order.
   pure subroutine build_graph(position, node_key, pieces, graph)
      real(wp), intent(in) :: position(:, :)   !! (2, n)
      integer, intent(in) :: node_key(:, :)    !! (2, n)
      type(pieces_type), intent(inout) :: pieces
      type(graph_type), intent(out) :: graph
      integer, allocatable :: order(:), second(:), new_number(:), first(:), low(:), high(:)
      integer :: n, i, k, e, a, b
      n = size(position, 2)
      graph%n_nodes = n
      ! stable sorting twice: by the second line, then by the first
      allocate (second(n), order(n))
      second(:) = sorted_order(node_key(2, :))
      order(:) = second(sorted_order(node_key(1, second)))
      allocate (graph%position(2, n), graph%node_key(2, n), new_number(n))
      do i = 1, n
         graph%position(:, i) = position(:, order(i))
         graph%node_key(:, i) = node_key(:, order(i))
         new_number(order(i)) = i
      end do
      do k = 1, pieces%n
         pieces%ends(1, k) = new_number(pieces%ends(1, k))
         pieces%ends(2, k) = new_number(pieces%ends(2, k))
      end do

      ! pieces by their smaller node, then by their larger one: equal ones become neighbours
      allocate (low(pieces%n), high(pieces%n))
      do k = 1, pieces%n
         low(k) = min(pieces%ends(1, k), pieces%ends(2, k))
         high(k) = max(pieces%ends(1, k), pieces%ends(2, k))
      end do
      deallocate (second)
      allocate (first(pieces%n), second(pieces%n))
      second(:) = sorted_order(high)
      first(:) = second(sorted_order(low(second)))
      allocate (graph%piece_edge(pieces%n), graph%ends(2, pieces%n), graph%line(pieces%n))
      e = 0
      a = 0
      b = 0
      do i = 1, pieces%n
         k = first(i)
         if (low(k) /= a .or. high(k) /= b) then
            e = e + 1
            a = low(k)
            b = high(k)
            graph%ends(:, e) = [a, b]
            graph%line(e) = 0
         end if
         graph%piece_edge(k) = e
         graph%line(e) = max(graph%line(e), pieces%line(k))
      end do
      graph%n_edges = e
      graph%ends = graph%ends(:, 1:e)
      graph%line = graph%line(1:e)
      allocate (graph%alive(e), source=.true.)
   end subroutine build_graph

end module rockdda_cutting_graph
