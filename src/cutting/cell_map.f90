! SPDX-License-Identifier: MIT
!> A block that is cut into cells, as a map of half-edges: nodes that neighbouring cells share, and for each cell the
!> loop of the half-edges around it, counter-clockwise.
!>
!>     next(h), previous(h)   neighbours of half-edge h in its loop
!>     twin(h)                the same edge in the loop on its other side, 0 on the outline of the block
!>     joint(h)               joint material; 0 on a bridge to an island (rockdda_cutting_outlines)
!>
!> The outline of a block with islands is one loop from the beginning; the two copies of a bridge edge are twins.
module rockdda_cutting_cell_map
   use rockdda_base_kinds, only : wp
   use rockdda_base_room, only : grow
   use rockdda_geometry_bridges, only : match_bridges
   implicit none
   private
   public :: cell_map_type

   type :: cell_map_type
      integer :: n_nodes = 0
      real(wp), allocatable :: position(:, :)    !! (2, nodes)
      real(wp), allocatable :: place(:, :)       !! (2, nodes) in the lattice: a whole number on a line of the family
      logical, allocatable :: is_corner(:)       !! (nodes) vertex of the block
      logical, allocatable :: on_bridge(:)       !! (nodes) new, on a bridge
      integer :: n = 0                           !! half-edges, removed ones included
      integer, allocatable :: origin(:), next(:), previous(:), twin(:), joint(:)
      logical, allocatable :: alive(:)
   contains
      procedure :: init
      procedure :: add_node
      procedure :: split
      procedure :: join
      procedure :: remove_chain
      procedure :: drop_node
      procedure :: target
      procedure :: loop_of
      procedure, private :: add_half_edge
   end type cell_map_type

contains

   !> One cell: the block itself.
   pure subroutine init(self, vertices, joint)
      class(cell_map_type), intent(inout) :: self  !! empty
      real(wp), intent(in) :: vertices(:, :)     !! (2, n) outline, counter-clockwise
      integer, intent(in) :: joint(:)            !! (n) joint material of the edge that starts at the vertex
      integer, allocatable :: twin(:)
      integer :: k, n, node, half_edge
      n = size(joint)
      allocate (twin, source=match_bridges(vertices, joint == 0))
      do k = 1, n
         call self%add_node(vertices(:, k), node)
         self%is_corner(node) = .true.
      end do
      ! a vertex that the outline visits twice is two nodes at one place
      do k = 1, n
         call self%add_half_edge(k, joint(k), half_edge)
         self%next(k) = 1 + mod(k, n)
         self%previous(k) = 1 + mod(k - 2 + n, n)
         self%twin(k) = twin(k)
      end do
   end subroutine init

   !> A node; its place in the lattice is not set.
   pure subroutine add_node(self, point, node)
      class(cell_map_type), intent(inout) :: self
      real(wp), intent(in) :: point(2)
      integer, intent(out) :: node
      node = self%n_nodes + 1
      self%n_nodes = node
      call grow(self%position, node, 2)
      call grow(self%place, node, 2)
      call grow(self%is_corner, node)
      call grow(self%on_bridge, node)
      self%position(:, node) = point
      self%place(:, node) = 0
      self%is_corner(node) = .false.
      self%on_bridge(node) = .false.
   end subroutine add_node

   !> A half-edge that is not linked yet.
   pure subroutine add_half_edge(self, origin, joint, half_edge)
      class(cell_map_type), intent(inout) :: self
      integer, intent(in) :: origin, joint
      integer, intent(out) :: half_edge
      half_edge = self%n + 1
      self%n = half_edge
      call grow(self%origin, half_edge)
      call grow(self%next, half_edge)
      call grow(self%previous, half_edge)
      call grow(self%twin, half_edge)
      call grow(self%joint, half_edge)
      call grow(self%alive, half_edge)
      self%origin(half_edge) = origin
      self%joint(half_edge) = joint
      self%twin(half_edge) = 0
      self%alive(half_edge) = .true.
   end subroutine add_half_edge

   !> Node where a half-edge ends.
   pure integer function target(self, half_edge)
      class(cell_map_type), intent(in) :: self
      integer, intent(in) :: half_edge
      target = self%origin(self%next(half_edge))
   end function target

   !> Put a node on an edge: half-edge p -> q becomes p -> node, and next of it is node -> q; the twin likewise.
   !>
   !>     h:  p ------> node ------> q  : half_edge_2
   !>         p <------ node <------ q
   pure subroutine split(self, half_edge, node)
      class(cell_map_type), intent(inout) :: self
      integer, intent(in) :: half_edge, node
      integer :: other, second, second_other, joint, after
      other = self%twin(half_edge)
      joint = self%joint(half_edge)
      after = self%next(half_edge)
      call self%add_half_edge(node, joint, second)
      call link(self, second, after)
      call link(self, half_edge, second)
      if (other == 0) return
      after = self%next(other)
      call self%add_half_edge(node, joint, second_other)
      call link(self, second_other, after)
      call link(self, other, second_other)
      call be_twins(self, half_edge, second_other)
      call be_twins(self, second, other)
   end subroutine split

   !> A new edge from the origin of half-edge a to that of b, inside their loop (which it divides) or between two loops
   !> (which it joins). `chord` runs from a to b; its loop continues with b, that of its twin with a.
   pure subroutine join(self, a, b, joint, chord)
      class(cell_map_type), intent(inout) :: self
      integer, intent(in) :: a, b, joint
      integer, intent(out) :: chord
      integer :: back, before_a, before_b, node_a, node_b
      node_a = self%origin(a)
      node_b = self%origin(b)
      call self%add_half_edge(node_a, joint, chord)
      call self%add_half_edge(node_b, joint, back)
      before_a = self%previous(a)
      before_b = self%previous(b)
      call link(self, before_a, chord)
      call link(self, chord, b)
      call link(self, before_b, back)
      call link(self, back, a)
      call be_twins(self, chord, back)
   end subroutine join

   !> Remove edges that follow each other, and unite the two different cells along them.
   pure subroutine remove_chain(self, first, last)
      class(cell_map_type), intent(inout) :: self
      integer, intent(in) :: first, last         !! half-edges of one loop; their twins follow each other in the other
      integer :: h, before, after, other_before, other_after
      before = self%previous(first)
      after = self%next(last)
      other_after = self%next(self%twin(first))
      other_before = self%previous(self%twin(last))
      h = first
      do
         self%alive(h) = .false.
         self%alive(self%twin(h)) = .false.
         if (h == last) exit
         h = self%next(h)
      end do
      call link(self, before, other_after)
      call link(self, other_before, after)
   end subroutine remove_chain

   !> Take the node at the origin of a half-edge out of the one edge that runs through it.
   pure subroutine drop_node(self, half_edge)
      class(cell_map_type), intent(inout) :: self
      integer, intent(in) :: half_edge
      integer :: before, after, other, other_after
      before = self%previous(half_edge)
      after = self%next(half_edge)
      other = self%twin(half_edge)
      call link(self, before, after)
      self%alive(half_edge) = .false.
      if (other == 0) return
      other_after = self%next(other)
      after = self%next(other_after)
      call link(self, other, after)
      self%alive(other_after) = .false.
      call be_twins(self, before, other)
   end subroutine drop_node

   !> Nodes of the loop of a half-edge, from its origin on.
   pure function loop_of(self, half_edge) result(nodes)
      class(cell_map_type), intent(in) :: self
      integer, intent(in) :: half_edge
      integer, allocatable :: nodes(:)
      integer :: h, n
      n = 0
      h = half_edge
      do
         n = n + 1
         h = self%next(h)
         if (h == half_edge) exit
      end do
      allocate (nodes(n))
      do n = 1, size(nodes)
         nodes(n) = self%origin(h)
         h = self%next(h)
      end do
   end function loop_of

   !> Half-edge b follows a.
   pure subroutine link(self, a, b)
      type(cell_map_type), intent(inout) :: self
      integer, intent(in) :: a, b
      self%next(a) = b
      self%previous(b) = a
   end subroutine link

   !> Two half-edges are one edge.
   pure subroutine be_twins(self, a, b)
      type(cell_map_type), intent(inout) :: self
      integer, intent(in) :: a, b
      self%twin(a) = b
      self%twin(b) = a
   end subroutine be_twins

end module rockdda_cutting_cell_map
