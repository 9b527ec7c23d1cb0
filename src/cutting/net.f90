! SPDX-License-Identifier: MIT
!> The net of lines: nodes where they meet, pieces between nodes that do not cross, distinct edges.
!>
!> Repeats until the pieces form a plane net: no piece passes a node closer than e0, no two pieces cross.
!>
!> Merging nodes moves the ends of pieces by up to e0, which can move a piece onto a node or across another piece.
!> 1. A piece that passes a node closer than e0 is led through it.
!> 2. Two pieces that cross get a common node: a node closer than e0 to the crossing, else a new one.
!> A piece is only ever replaced by shorter ones (otherwise rule 1 is not applied: it could cycle between the corners
!> of a triangle that is about e0 wide) and nodes stay apart, so that the repetition ends.
!>
!> Nodes are meetings of lines merged so that they are at least e0 apart. Candidates come in the order of their rank.
!> Each joins the nearest node closer than e0, or becomes a node. A candidate moves by less than e0, however long a
!> chain of close candidates is.
module rockdda_cutting_net
   use rockdda_base_kinds, only : wp
   use rockdda_base_room, only : grow
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_cutting_graph, only : graph_type, pieces_type, build_graph
   use rockdda_cutting_intersections, only : find_meetings, meeting_list_type
   use rockdda_cutting_overlaps, only : visible_lines_type, find_visible
   use rockdda_base_strings, only : to_string
   use rockdda_base_sorting, only : sorted_order
   use rockdda_geometry_grid, only : grid_type, grid_query_type
   use rockdda_geometry_segments, only : nearest_parameter, distance_to_segment, line_intersection, side_of_line
   use rockdda_geometry_point_bins, only : point_bins_type
   implicit none
   private
   public :: make_net, clean_pieces, node_set_type, merge_meetings

   !> Nodes with the first pair of lines that meets there.
   type :: node_set_type
      type(point_bins_type) :: bins
      integer, allocatable :: key(:, :)     !! (2, capacity)
   contains
      procedure :: add => add_node
      procedure :: note_pair
   end type node_set_type

   !> Largest number of rounds (random line sets need up to about 10).
   integer, parameter :: max_rounds = 60

   !> Changes of a piece in one round.
   type :: piece_state_enum
      integer :: whole = 0     !! no change
      integer :: split = 1     !! new nodes on it; further ones are possible
      integer :: bent = 2      !! led through nodes beside it; no further change in this round
   end type piece_state_enum
   type(piece_state_enum), parameter :: piece_state = piece_state_enum()

   !> Nodes to be inserted into pieces.
   type :: insertion_list_type
      integer :: n = 0
      integer, allocatable :: piece(:), node(:)
      real(wp), allocatable :: parameter(:)
   contains
      procedure :: add => add_insertion
   end type insertion_list_type

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

   !> Apply rules 1 and 2 until nothing changes.
   subroutine clean_pieces(e0, nodes, pieces, rounds, error)
      real(wp), intent(in) :: e0                   !! merging distance [L]
      type(node_set_type), intent(inout) :: nodes
      type(pieces_type), intent(inout) :: pieces
      integer, intent(out) :: rounds               !! rounds with changes
      type(error_type), allocatable, intent(out) :: error
      type(insertion_list_type) :: insertions
      integer, allocatable :: state(:)
      integer :: round
      rounds = 0
      do round = 1, max_rounds
         insertions%n = 0
         if (allocated(state)) deallocate (state)
         allocate (state(pieces%n), source=piece_state%whole)
         call lead_through_near_nodes(e0, nodes, pieces, insertions, state)
         call cut_crossings(e0, nodes, pieces, insertions, state)
         if (insertions%n == 0) return
         rounds = round
         call insert_nodes(insertions, pieces)
      end do
      call make_error(error, error_code%input, 'the lines cannot be merged at the edge-node distance '// &
                      to_string(e0)//': after '//to_string(max_rounds)// &
                      ' rounds lines still cross between nodes; use a smaller distance')
   end subroutine clean_pieces

   !> Rule 1.
   subroutine lead_through_near_nodes(e0, nodes, pieces, insertions, state)
      real(wp), intent(in) :: e0
      type(node_set_type), intent(in) :: nodes
      type(pieces_type), intent(in) :: pieces
      type(insertion_list_type), intent(inout) :: insertions
      integer, intent(inout) :: state(:)           !! (pieces) change in this round
      integer, allocatable :: near(:), order(:)
      real(wp), allocatable :: t(:)
      integer :: i, k, n_near, v, a, b, n
      real(wp) :: p(2), q(2), x(2), last(2), length
      do i = 1, pieces%n
         a = pieces%ends(1, i)
         b = pieces%ends(2, i)
         p = nodes%bins%position(:, a)
         q = nodes%bins%position(:, b)
         call nodes%bins%along(p, q, e0, near, n_near)
         n = 0
         do k = 1, n_near
            v = near(k)
            if (v == a .or. v == b) cycle
            x = nodes%bins%position(:, v)
            if (.not. distance_to_segment(x, p, q) < e0) cycle
            if (.not. shortens(x, p, q)) cycle
            n = n + 1
            near(n) = v
         end do
         if (n == 0) cycle
         state(i) = piece_state%bent
         t = [(nearest_parameter(nodes%bins%position(:, near(k)), p, q), k=1, n)]
         order = sorted_order(t)
         length = hypot(q(1) - p(1), q(2) - p(2))
         last = p
         do k = 1, n
            x = nodes%bins%position(:, near(order(k)))
            ! the part between two new nodes must be shorter as well
            if (.not. hypot(x(1) - last(1), x(2) - last(2)) < length) cycle
            call insertions%add(i, near(order(k)), t(order(k)))
            last = x
         end do
      end do
   end subroutine lead_through_near_nodes

   !> Rule 2, among pieces that are not bent in this round.
   subroutine cut_crossings(e0, nodes, pieces, insertions, state)
      real(wp), intent(in) :: e0
      type(node_set_type), intent(inout) :: nodes
      type(pieces_type), intent(in) :: pieces
      type(insertion_list_type), intent(inout) :: insertions
      integer, intent(inout) :: state(:)           !! (pieces)
      type(grid_type) :: grid
      type(grid_query_type) :: query
      real(wp), allocatable :: segments(:, :)
      integer, allocatable :: others(:)
      integer :: i, j, k, n
      allocate (segments(4, pieces%n), others(pieces%n))
      do i = 1, pieces%n
         segments(1:2, i) = nodes%bins%position(:, pieces%ends(1, i))
         segments(3:4, i) = nodes%bins%position(:, pieces%ends(2, i))
      end do
      call grid%build_segments(segments, 0.0_wp)
      do i = 1, pieces%n
         if (state(i) == piece_state%bent) cycle
         call grid%query_segment(segments(1:2, i), segments(3:4, i), 0.0_wp, query)
         n = 0
         do k = 1, query%n
            j = query%ids(k)
            if (j <= i) cycle
            if (any(pieces%ends(1, i) == pieces%ends(:, j)) .or. any(pieces%ends(2, i) == pieces%ends(:, j))) cycle
            if (.not. crosses(segments(:, i), segments(:, j))) cycle
            n = n + 1
            others(n) = j
         end do
         if (n > 1) others(1:n) = others(sorted_order(others(1:n)))
         do k = 1, n
            call join(i, others(k))
         end do
      end do

   contains

      !> Put a common node at the crossing of two pieces. Crossings of bent pieces are left to the next round.
      subroutine join(i, j)
         integer, intent(in) :: i, j
         real(wp) :: s, t, x(2), v(2)
         integer :: node, k, piece
         logical :: parallel
         if (state(i) == piece_state%bent .or. state(j) == piece_state%bent) return
         call line_intersection(segments(1:2, i), segments(3:4, i), segments(1:2, j), segments(3:4, j), s, t, parallel)
         if (parallel) return
         x = segments(1:2, i) + s*(segments(3:4, i) - segments(1:2, i))
         node = nodes%bins%nearest(x, e0)
         if (node > 0) then
            v = nodes%bins%position(:, node)
            if (.not. (fits(node, v, i) .and. fits(node, v, j))) then
               node = 0
            else if ((state(i) == piece_state%split .and. all(pieces%ends(:, i) /= node)) .or. &
                     (state(j) == piece_state%split .and. all(pieces%ends(:, j) /= node))) then
               return
            end if
         end if
         if (node > 0) then
            do k = 1, 2
               piece = merge(i, j, k == 1)
               if (any(pieces%ends(:, piece) == node)) cycle
               call insertions%add(piece, node, nearest_parameter(v, segments(1:2, piece), segments(3:4, piece)))
               state(piece) = piece_state%bent
            end do
         else
            call nodes%add(x, [min(pieces%line(i), pieces%line(j)), max(pieces%line(i), pieces%line(j))], node)
            call insertions%add(i, node, s)
            call insertions%add(j, node, t)
            state([i, j]) = piece_state%split
         end if
      end subroutine join

      !> Is the node an end of the piece, or does leading the piece through it give shorter pieces?
      pure logical function fits(node, position, piece)
         integer, intent(in) :: node, piece
         real(wp), intent(in) :: position(2)
         fits = any(pieces%ends(:, piece) == node)
         if (.not. fits) fits = shortens(position, segments(1:2, piece), segments(3:4, piece))
      end function fits

   end subroutine cut_crossings

   !> Would a piece p q led through x become two shorter pieces?
   pure logical function shortens(x, p, q)
      real(wp), intent(in) :: x(2), p(2), q(2)
      real(wp) :: whole
      whole = sum((q - p)**2)
      shortens = sum((x - p)**2) < whole .and. sum((x - q)**2) < whole
   end function shortens

   !> Do two segments without a common end cross?
   pure logical function crosses(a, b)
      real(wp), intent(in) :: a(4), b(4)
      crosses = .false.
      if (max(a(1), a(3)) < min(b(1), b(3)) .or. max(b(1), b(3)) < min(a(1), a(3))) return
      if (max(a(2), a(4)) < min(b(2), b(4)) .or. max(b(2), b(4)) < min(a(2), a(4))) return
      if ((side_of_line(a(1:2), a(3:4), b(1:2)) > 0) .eqv. (side_of_line(a(1:2), a(3:4), b(3:4)) > 0)) return
      crosses = (side_of_line(b(1:2), b(3:4), a(1:2)) > 0) .neqv. (side_of_line(b(1:2), b(3:4), a(3:4)) > 0)
   end function crosses

   !> Replace pieces by chains through their new nodes.
   pure subroutine insert_nodes(insertions, pieces)
      type(insertion_list_type), intent(in) :: insertions
      type(pieces_type), intent(inout) :: pieces
      type(pieces_type) :: old
      integer, allocatable :: order(:)
      integer :: i, k, n, node
      n = insertions%n
      ! by piece, and along each piece
      allocate (order(n))
      order(:) = sorted_order(insertions%parameter(1:n))
      order(:) = order(sorted_order(insertions%piece(order)))
      old = pieces
      pieces%n = 0
      k = 1
      do i = 1, old%n
         node = old%ends(1, i)
         do while (k <= n)
            if (insertions%piece(order(k)) /= i) exit
            if (insertions%node(order(k)) /= node) call pieces%add(node, insertions%node(order(k)), old%line(i))
            node = insertions%node(order(k))
            k = k + 1
         end do
         if (old%ends(2, i) /= node) call pieces%add(node, old%ends(2, i), old%line(i))
      end do
   end subroutine insert_nodes

   !> Append an insertion.
   pure subroutine add_insertion(self, piece, node, parameter)
      class(insertion_list_type), intent(inout) :: self
      integer, intent(in) :: piece, node
      real(wp), intent(in) :: parameter
      integer :: n
      n = self%n + 1
      call grow(self%piece, n)
      call grow(self%node, n)
      call grow(self%parameter, n)
      self%n = n
      self%piece(n) = piece
      self%node(n) = node
      self%parameter(n) = parameter
   end subroutine add_insertion

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

end module rockdda_cutting_net
