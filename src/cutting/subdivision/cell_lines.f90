! SPDX-License-Identifier: MIT
!> Cut the cells of a block along one family of lattice lines.
!>
!>   1. Every node gets its place s in the family: line i is at s = i. A node nearer to a line than a share of the
!>      spacing (`snap`) counts as a node on that line, which bends a little to pass through it: cells get
!>      neither slivers nor short edges there. Nodes on bridges, which go in the end, move no line.
!>   2. An edge with ends on different sides of a line gets a node on it. Its two half-edges share the node, so that
!>      neighbouring cells have the same coordinates, bit for bit.
!>   3. At each node on a line the loop of a cell opens to the left or right along the line, or not:
!>
!>          ------- x <- opens to the right        the edges of the loop at a node, each above the line, on it to the
!>                 / ================== line       right, below or on it to the left, decide this without numbers;
!>          ______/                                only two edges on the same side are compared by their directions
!>
!>      Along a line each node that opens to the right must meet the next one, which opens to the left: the two are
!>      joined by an edge. When they do not alternate (the snap is too large for such a narrow block), `ok` is false.
module rockdda_cutting_cell_lines
   use rockdda_base_kinds, only : wp
   use rockdda_base_room, only : grow
   use rockdda_base_sorting, only : sorted_order
   use rockdda_geometry_segments, only : cross_product, segment_point
   use rockdda_cutting_cell_lattice, only : lattice_type
   use rockdda_cutting_cell_map, only : cell_map_type
   implicit none
   private
   public :: place_nodes, cut_along_lines

   !> Directions of an edge at a node on a line, counter-clockwise; the line has smaller s to its right.
   integer, parameter :: ahead = 0, left = 1, behind = 2, right = 3

   !> The family being cut.
   type :: family_type
      real(wp) :: normal(2) = 0                  !! s = normal . (u, v)
      real(wp), allocatable :: exact(:)          !! (nodes) s
      real(wp), allocatable :: at(:)             !! (nodes) s, a whole number for a node on a line
      real(wp), allocatable :: along(:)          !! (nodes) coordinate along the lines
   end type family_type

contains

   !> Places of all nodes in the lattice.
   pure subroutine place_nodes(map, lattice)
      type(cell_map_type), intent(inout) :: map
      type(lattice_type), intent(in) :: lattice
      integer :: k
      do k = 1, map%n_nodes
         map%place(:, k) = lattice%place(map%position(:, k))
      end do
   end subroutine place_nodes

   !> Cut all cells along the lines of a family.
   pure subroutine cut_along_lines(map, lattice, family, snap, joint, ok)
      type(cell_map_type), intent(inout) :: map
      type(lattice_type), intent(in) :: lattice
      integer, intent(in) :: family
      real(wp), intent(in) :: snap               !! share of the spacing, less than a half
      integer, intent(in) :: joint               !! joint material of the new edges
      logical, intent(out) :: ok                 !! false: the map is of no use
      type(family_type) :: lines
      real(wp) :: reach
      integer :: k
      lines%normal = lattice%normal(family)
      allocate (lines%exact(map%n_nodes), lines%at(map%n_nodes), lines%along(map%n_nodes))
      do k = 1, map%n_nodes
         associate (place => lattice%place(map%position(:, k)))
            lines%exact(k) = dot_product(lines%normal, place)
            lines%along(k) = cross_product(place, lines%normal)
         end associate
         ! map%place has whole numbers for the lines that the node lies on already
         lines%at(k) = dot_product(lines%normal, map%place(:, k))
         ! lines of diagonals are farther apart than those of the first two families
         reach = snap*sum(abs(lines%normal))*norm2(lines%normal)
         if (map%on_bridge(k)) reach = 0
         if (abs(lines%at(k) - anint(lines%at(k))) <= reach) lines%at(k) = anint(lines%at(k))
      end do
      call split_edges(map, lattice, lines)
      if (family <= 2) map%place(family, 1:map%n_nodes) = lines%at(1:map%n_nodes)
      call join_nodes(map, lines, joint, ok)
   end subroutine cut_along_lines

   !> Put a node on each edge that crosses a line.
   pure subroutine split_edges(map, lattice, lines)
      type(cell_map_type), intent(inout) :: map
      type(lattice_type), intent(in) :: lattice
      type(family_type), intent(inout) :: lines
      integer :: h, k, p, q, i, last, step, n
      n = map%n
      do h = 1, n
         if (.not. map%alive(h) .or. (map%twin(h) > 0 .and. map%twin(h) < h)) cycle
         p = map%origin(h)
         q = map%target(h)
         if (lines%at(p) < lines%at(q)) then
            i = floor(lines%at(p)) + 1
            last = ceiling(lines%at(q)) - 1
            step = 1
         else
            i = ceiling(lines%at(p)) - 1
            last = floor(lines%at(q)) + 1
            step = -1
         end if
         k = h
         do while (step*i <= step*last .and. abs(lines%at(p) - lines%at(q)) > 0)
            call put_node(map, lattice, lines, k, p, q, i)
            k = map%next(k)
            i = i + step
         end do
      end do
   end subroutine split_edges

   !> Put a node on half-edge h, a part of the edge from node p to node q, where that crosses line i.
   pure subroutine put_node(map, lattice, lines, h, p, q, i)
      type(cell_map_type), intent(inout) :: map
      type(lattice_type), intent(in) :: lattice
      type(family_type), intent(inout) :: lines
      integer, intent(in) :: h, p, q, i
      real(wp), parameter :: short = 0.01_wp     !! share of the spacing
      real(wp) :: t
      integer :: node, a, b
      ! the same numbers for both directions of an edge: a neighbouring block may have the edge, too
      a = p
      b = q
      if (map%position(1, q) < map%position(1, p) .or. (.not. map%position(1, p) < map%position(1, q) .and. &
                                                        map%position(2, q) < map%position(2, p))) then
         a = q
         b = p
      end if
      t = (i - lines%at(a))/(lines%at(b) - lines%at(a))
      associate (before => (i - lines%exact(a))*sign(1.0_wp, lines%at(b) - lines%at(a)), &
                 behind_it => (lines%exact(b) - i)*sign(1.0_wp, lines%at(b) - lines%at(a)))
         ! beside an end that was moved onto another line the crossing could lie beyond that end
         if (min(before, behind_it) > short) t = before/(before + behind_it)
      end associate
      call map%add_node(segment_point(map%position(:, a), map%position(:, b), t), node)
      map%on_bridge(node) = map%joint(h) == 0
      call map%split(h, node)
      map%place(:, node) = lattice%place(map%position(:, node))
      ! an edge along a line stays on it
      where (abs(map%place(:, a) - map%place(:, b)) <= 0 .and. abs(map%place(:, a) - anint(map%place(:, a))) <= 0) &
         map%place(:, node) = map%place(:, a)
      call grow(lines%exact, node)
      call grow(lines%at, node)
      call grow(lines%along, node)
      lines%exact(node) = i
      lines%at(node) = i
      lines%along(node) = cross_product(lattice%place(map%position(:, node)), lines%normal)
   end subroutine put_node

   !> Join the nodes on each line through the cells.
   pure subroutine join_nodes(map, lines, joint, ok)
      type(cell_map_type), intent(inout) :: map
      type(family_type), intent(in) :: lines
      integer, intent(in) :: joint
      logical, intent(out) :: ok
      integer, allocatable :: event(:), way(:), order(:), second(:)
      integer :: h, k, n, a, b, chord, n_before
      ok = .true.
      n_before = map%n
      allocate (event(2*n_before), way(2*n_before), second(n_before))
      second = 0
      n = 0
      do h = 1, n_before
         if (.not. map%alive(h)) cycle
         associate (at => lines%at(map%origin(h)))
            if (abs(at - anint(at)) > 0) cycle
         end associate
         do k = behind, ahead, -2
            if (.not. opens(map, lines, h, k)) cycle
            n = n + 1
            event(n) = h
            way(n) = k
         end do
      end do
      if (n == 0) return
      ! along each line; at one place the nodes that open backwards come first
      order = sorted_order(-way(1:n))
      order = order(sorted_order(lines%along(map%origin(event(order)))))
      order = order(sorted_order(lines%at(map%origin(event(order)))))
      ok = mod(n, 2) == 0
      if (.not. ok) return
      do k = 1, n, 2
         a = event(order(k))
         b = event(order(k + 1))
         ok = way(order(k)) == ahead .and. way(order(k + 1)) == behind
         if (ok) ok = abs(lines%at(map%origin(a)) - lines%at(map%origin(b))) <= 0 .and. &
                      lines%along(map%origin(a)) < lines%along(map%origin(b))
         if (.not. ok) return
         ! a node that opens both ways has two loops after the first edge
         if (second(a) > 0) a = loop_that_opens(a, ahead)
         if (second(b) > 0) b = loop_that_opens(b, behind)
         call map%join(a, b, joint, chord)
         if (a <= n_before) second(a) = chord
         if (b <= n_before) second(b) = map%twin(chord)
      end do

   contains

      !> Of the two loops at the node of a half-edge the one that opens in a direction.
      pure integer function loop_that_opens(h, direction)
         integer, intent(in) :: h, direction
         loop_that_opens = h
         if (.not. opens(map, lines, h, direction)) loop_that_opens = second(h)
      end function loop_that_opens

   end subroutine join_nodes

   !> Does the loop open at the origin of a half-edge, in this direction of the line?
   pure logical function opens(map, lines, h, direction)
      type(cell_map_type), intent(in) :: map
      type(family_type), intent(in) :: lines
      integer, intent(in) :: h
      integer, intent(in) :: direction           !! ahead or behind
      integer :: node, to, from, side_to, side_from
      node = map%origin(h)
      to = map%target(h)
      from = map%origin(map%previous(h))
      side_to = side(lines, node, to)
      side_from = side(lines, node, from)
      if (side_to == side_from) then
         ! a corner of less than 180 degrees lies on this side; a larger one opens both ways
         opens = mod(side_to, 2) == 1 .and. cross_product(map%position(:, to) - map%position(:, node), &
                                                          map%position(:, from) - map%position(:, node)) <= 0
      else
         opens = modulo(direction - side_to, 4) > 0 .and. &
                 modulo(direction - side_to, 4) < modulo(side_from - side_to, 4)
      end if
   end function opens

   !> On which side of the line through a node another node lies.
   pure integer function side(lines, node, other)
      type(family_type), intent(in) :: lines
      integer, intent(in) :: node, other
      if (lines%at(other) > lines%at(node)) then
         side = left
      else if (lines%at(other) < lines%at(node)) then
         side = right
      else
         side = merge(ahead, behind, lines%along(other) > lines%along(node))
      end if
   end function side

end module rockdda_cutting_cell_lines
