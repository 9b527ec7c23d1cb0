! SPDX-License-Identifier: MIT
!> Merge meetings of lines into nodes at least e0 apart; split the lines into pieces between nodes.
!>
!> Candidates come in the order of their rank. Each joins the nearest node closer than e0, or becomes a node. A
!> candidate moves by less than e0, however long a chain of close candidates is.
module rockdda_cutting_nodes
   use rockdda_base_kinds, only : wp
   use rockdda_base_room, only : grow
   use rockdda_base_sorting, only : sorted_order
   use rockdda_geometry_point_bins, only : point_bins_type
   use rockdda_cutting_graph, only : pieces_type
   use rockdda_cutting_intersections, only : meeting_list_type
   implicit none
   private
   public :: node_set_type, merge_meetings

   !> Nodes with the first pair of lines that meets there.
   type :: node_set_type
      type(point_bins_type) :: bins
      integer, allocatable :: key(:, :)     !! (2, capacity)
   contains
      procedure :: add => add_node
      procedure :: note_pair
   end type node_set_type

contains

   !> Add a node.
   pure subroutine add_node(self, position, pair, number)
      class(node_set_type), intent(inout) :: self
      real(wp), intent(in) :: position(2)
      integer, intent(in) :: pair(2)
      integer, intent(out) :: number
      call self%bins%add(position, number)
      call grow(self%key, number, 2)
      self%key(:, number) = pair
   end subroutine add_node

   !> The pair of lines also meets at this node: keep the first pair in the order (1,2), (1,3), ..., (2,3), ...
   pure subroutine note_pair(self, number, pair)
      class(node_set_type), intent(inout) :: self
      integer, intent(in) :: number
      integer, intent(in) :: pair(2)
      if (pair(1) < self%key(1, number) .or. &
          (pair(1) == self%key(1, number) .and. pair(2) < self%key(2, number))) self%key(:, number) = pair
   end subroutine note_pair

   !> Nodes from meetings, and the pieces of the lines between them.
   pure subroutine merge_meetings(meetings, n_lines, e0, nodes, pieces)
      type(meeting_list_type), intent(in) :: meetings
      integer, intent(in) :: n_lines
      real(wp), intent(in) :: e0               !! merging distance [L]
      type(node_set_type), intent(inout) :: nodes
      type(pieces_type), intent(inout) :: pieces
      integer, allocatable :: node_of(:), start(:), at(:), member(:), order(:), by_rank(:)
      real(wp), allocatable :: parameter(:)
      real(wp) :: box(4)
      integer :: m, node, i, k, n, previous
      n = meetings%n
      allocate (node_of(n), nodes%key(2, max(16, n)))
      if (n == 0) return
      box = [minval(meetings%position(1, 1:n)), minval(meetings%position(2, 1:n)), &
             maxval(meetings%position(1, 1:n)), maxval(meetings%position(2, 1:n))]
      call nodes%bins%init(box, n, e0)
      by_rank = sorted_order(-meetings%rank)
      do k = 1, n
         m = by_rank(k)
         node = nodes%bins%nearest(meetings%position(:, m), e0)
         if (node == 0) then
            call nodes%add(meetings%position(:, m), pair_of(m), node)
         else
            call nodes%note_pair(node, pair_of(m))
         end if
         node_of(m) = node
      end do

      ! meetings by line, in the order along it
      allocate (start(n_lines + 1), source=0)
      do m = 1, n
         do k = 1, 2
            i = meetings%lines(k, m)
            if (i > 0) start(i + 1) = start(i + 1) + 1
         end do
      end do
      do i = 1, n_lines
         start(i + 1) = start(i) + start(i + 1)
      end do
      allocate (member(start(n_lines + 1)), parameter(start(n_lines + 1)), at(n_lines))
      at = start(1:n_lines)
      do m = 1, n
         do k = 1, 2
            i = meetings%lines(k, m)
            if (i == 0) cycle
            at(i) = at(i) + 1
            member(at(i)) = node_of(m)
            parameter(at(i)) = meetings%parameter(k, m)
         end do
      end do
      do i = 1, n_lines
         order = start(i) + sorted_order(parameter(start(i) + 1:start(i + 1)))
         previous = 0
         do k = 1, size(order)
            node = member(order(k))
            if (previous > 0 .and. node /= previous) call pieces%add(previous, node, i)
            previous = node
         end do
      end do

   contains

      !> Lines of a meeting; a free end comes after all meetings of its line.
      pure function pair_of(m) result(pair)
         integer, intent(in) :: m
         integer :: pair(2)
         pair = meetings%lines(:, m)
         if (allocated(meetings%pair)) pair = meetings%pair(:, m)
         if (pair(2) == 0) pair(2) = huge(pair(2))
      end function pair_of

   end subroutine merge_meetings

end module rockdda_cutting_nodes
