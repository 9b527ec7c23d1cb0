! SPDX-License-Identifier: MIT
!> Remove dead ends and trace faces.
!>
!> Every edge e has two half-edges, 2e-1 from its first to its second node and 2e back. A half-edge belongs to the
!> face on its left. After a half-edge comes the next one clockwise around its end node, so that the cycles run
!> counter-clockwise around faces (positive area: blocks) and clockwise around connected groups of lines
!> (negative area: one outer contour for each group).
!>
!> Removed are edges with a free end, repeatedly, and edges with the same face on both sides (a line between two
!> closed loops): neither bounds a block.
module rockdda_cutting_faces
   use rockdda_base_kinds, only : wp
   use rockdda_base_sorting, only : sorted_order
   use rockdda_geometry_segments, only : distance_to_segment
   use rockdda_cutting_graph, only : graph_type
   implicit none
   private
   public :: face_set_type, prune_dead_ends, trace_faces, straighten, half_edge_origin, twin

   type :: face_set_type
      integer, allocatable :: next(:)          !! (2 n_edges) half-edge after this one; 0: cut off
      integer, allocatable :: cycle(:)         !! (2 n_edges) cycle that the half-edge belongs to; 0: cut off
      integer :: n_cycles = 0
      integer, allocatable :: first(:)         !! (n_cycles) a half-edge
      real(wp), allocatable :: area(:)         !! (n_cycles) positive: face, negative: contour of a group
      integer :: n_groups = 0                  !! connected groups of lines
      integer, allocatable :: group(:)         !! (n_cycles) group of each cycle
      integer, allocatable :: contour(:)       !! (n_groups) the cycle of negative area; 0: none (impossible)
      integer :: n_used_nodes = 0, n_used_edges = 0  !! after cutting off
   end type face_set_type

contains

   !> The node where a half-edge starts.
   pure integer function half_edge_origin(graph, h)
      type(graph_type), intent(in) :: graph
      integer, intent(in) :: h
      half_edge_origin = graph%ends(2 - mod(h, 2), (h + 1)/2)
   end function half_edge_origin

   !> The half-edge in the other direction.
   pure elemental integer function twin(h)
      integer, intent(in) :: h
      twin = h + 1
      if (mod(h, 2) == 0) twin = h - 1
   end function twin

   !> Cut off edges with a free end until none is left.
   pure subroutine prune_dead_ends(graph)
      type(graph_type), intent(inout) :: graph
      integer, allocatable :: degree(:), start(:), around(:)
      integer :: e, k, v, w, other
      call edges_by_node(graph, start, around)
      allocate (degree(graph%n_nodes), source=0)
      do e = 1, graph%n_edges
         if (graph%alive(e)) degree(graph%ends(:, e)) = degree(graph%ends(:, e)) + 1
      end do
      do v = 1, graph%n_nodes
         w = v
         do while (degree(w) == 1)
            other = w
            do k = start(w) + 1, start(w + 1)
               e = (around(k) + 1)/2
               if (.not. graph%alive(e)) cycle
               graph%alive(e) = .false.
               degree(graph%ends(:, e)) = degree(graph%ends(:, e)) - 1
               other = sum(graph%ends(:, e)) - w
               exit
            end do
            w = other
         end do
      end do
   end subroutine prune_dead_ends

   !> Replace two edges that meet in a node of their own by one, where that moves them by less than a tolerance.
   pure subroutine straighten(graph, line_joint, tolerance)
      type(graph_type), intent(inout) :: graph
      integer, intent(in) :: line_joint(:)     !! (lines) joint material: the two edges must agree
      real(wp), intent(in) :: tolerance        !! [L]
      integer, allocatable :: edge_at(:, :), degree(:)
      real(wp), allocatable :: moved(:)
      real(wp) :: p(2), q(2), x(2), d
      integer :: e, f, k, v, a, b
      allocate (edge_at(2, graph%n_nodes), degree(graph%n_nodes), source=0)
      allocate (moved(graph%n_edges), source=0.0_wp)
      do e = 1, graph%n_edges
         if (.not. graph%alive(e)) cycle
         do k = 1, 2
            v = graph%ends(k, e)
            degree(v) = degree(v) + 1
            if (degree(v) <= 2) edge_at(degree(v), v) = e
         end do
      end do
      do v = 1, graph%n_nodes
         if (degree(v) /= 2) cycle
         e = edge_at(1, v)
         f = edge_at(2, v)
         if (line_joint(graph%line(e)) /= line_joint(graph%line(f))) cycle
         a = sum(graph%ends(:, e)) - v
         b = sum(graph%ends(:, f)) - v
         if (a == b) cycle
         p = graph%position(:, a)
         q = graph%position(:, b)
         x = graph%position(:, v)
         if (.not. dot_product(x - p, q - x) > 0) cycle
         ! sum of the displacements of all nodes dropped from this edge: a bound of the total displacement
         d = distance_to_segment(x, p, q) + max(moved(e), moved(f))
         if (.not. d < tolerance) cycle
         moved(e) = d
         graph%alive(f) = .false.
         graph%ends(:, e) = [a, b]
         where (edge_at(:, b) == f) edge_at(:, b) = e
      end do
   end subroutine straighten

   !> Trace all cycles; cut off edges that have one face on both sides.
   pure subroutine trace_faces(graph, faces)
      type(graph_type), intent(inout) :: graph
      type(face_set_type), intent(out) :: faces
      integer :: e
      logical :: again
      call trace_cycles(graph, faces)
      again = .false.
      do e = 1, graph%n_edges
         if (.not. graph%alive(e)) cycle
         if (faces%cycle(2*e - 1) /= faces%cycle(2*e)) cycle
         graph%alive(e) = .false.
         again = .true.
      end do
      ! the net without these edges has no such edges
      if (again) call trace_cycles(graph, faces)
      call find_groups(graph, faces)
   end subroutine trace_faces

   !> Half-edges that start at each node: around(start(v) + 1 : start(v + 1)).
   pure subroutine edges_by_node(graph, start, around)
      type(graph_type), intent(in) :: graph
      integer, allocatable, intent(out) :: start(:), around(:)
      integer, allocatable :: at(:)
      integer :: h, v
      allocate (start(graph%n_nodes + 1), source=0)
      do h = 1, 2*graph%n_edges
         if (.not. graph%alive((h + 1)/2)) cycle
         v = half_edge_origin(graph, h)
         start(v + 1) = start(v + 1) + 1
      end do
      do v = 1, graph%n_nodes
         start(v + 1) = start(v) + start(v + 1)
      end do
      allocate (around(start(graph%n_nodes + 1)), at(graph%n_nodes))
      at = start(1:graph%n_nodes)
      do h = 1, 2*graph%n_edges
         if (.not. graph%alive((h + 1)/2)) cycle
         v = half_edge_origin(graph, h)
         at(v) = at(v) + 1
         around(at(v)) = h
      end do
   end subroutine edges_by_node

   !> Link half-edges to cycles.
   pure subroutine trace_cycles(graph, faces)
      type(graph_type), intent(in) :: graph
      type(face_set_type), intent(inout) :: faces
      integer, allocatable :: start(:), around(:), order(:)
      real(wp), allocatable :: angle(:)
      real(wp) :: d(2), p(2), q(2), p0(2), area
      integer :: v, k, n, h, c
      call edges_by_node(graph, start, around)
      if (allocated(faces%next)) deallocate (faces%next, faces%cycle, faces%first, faces%area)
      allocate (faces%next(2*graph%n_edges), faces%cycle(2*graph%n_edges), source=0)
      allocate (faces%first(2*graph%n_edges), faces%area(2*graph%n_edges))
      allocate (angle(maxval(start(2:) - start(:graph%n_nodes))))
      do v = 1, graph%n_nodes
         n = start(v + 1) - start(v)
         if (n == 0) cycle
         do k = 1, n
            h = around(start(v) + k)
            d = graph%position(:, half_edge_origin(graph, twin(h))) - graph%position(:, v)
            angle(k) = atan2(d(2), d(1))
         end do
         order = start(v) + sorted_order(angle(1:n))
         ! arriving on the twin of around(order(k)), leave on its neighbour clockwise
         do k = 1, n
            faces%next(twin(around(order(k)))) = around(order(1 + mod(k + n - 2, n)))
         end do
      end do
      c = 0
      do k = 1, 2*graph%n_edges
         if (faces%next(k) == 0 .or. faces%cycle(k) /= 0) cycle
         c = c + 1
         p0 = graph%position(:, half_edge_origin(graph, k))
         area = 0
         h = k
         do while (faces%cycle(h) == 0)
            faces%cycle(h) = c
            p = graph%position(:, half_edge_origin(graph, h)) - p0
            q = graph%position(:, half_edge_origin(graph, twin(h))) - p0
            area = area + (p(1)*q(2) - p(2)*q(1))
            h = faces%next(h)
         end do
         faces%first(c) = k
         faces%area(c) = 0.5_wp*area
      end do
      faces%n_cycles = c
      faces%first = faces%first(1:c)
      faces%area = faces%area(1:c)
   end subroutine trace_cycles

   !> Connected groups of edges, their contours, numbers of nodes and edges in use.
   pure subroutine find_groups(graph, faces)
      type(graph_type), intent(in) :: graph
      type(face_set_type), intent(inout) :: faces
      integer, allocatable :: parent(:), number(:)
      logical, allocatable :: used(:)
      integer :: e, a, b, c, v
      allocate (parent(graph%n_nodes), number(graph%n_nodes), used(graph%n_nodes))
      do v = 1, graph%n_nodes
         parent(v) = v
      end do
      used = .false.
      number = 0
      do e = 1, graph%n_edges
         if (.not. graph%alive(e)) cycle
         faces%n_used_edges = faces%n_used_edges + 1
         used(graph%ends(:, e)) = .true.
         call find_root(parent, graph%ends(1, e), a)
         call find_root(parent, graph%ends(2, e), b)
         parent(max(a, b)) = min(a, b)
      end do
      faces%n_used_nodes = count(used)
      do v = 1, graph%n_nodes
         if (.not. used(v) .or. parent(v) /= v) cycle
         faces%n_groups = faces%n_groups + 1
         number(v) = faces%n_groups
      end do
      allocate (faces%group(faces%n_cycles), faces%contour(faces%n_groups))
      faces%contour = 0
      do c = 1, faces%n_cycles
         call find_root(parent, half_edge_origin(graph, faces%first(c)), a)
         faces%group(c) = number(a)
         if (faces%area(c) < 0) faces%contour(number(a)) = c
      end do
   end subroutine find_groups

   !> Root of a node in the union-find forest, halving the path to it.
   pure subroutine find_root(parent, node, root)
      integer, intent(inout) :: parent(:)
      integer, intent(in) :: node
      integer, intent(out) :: root
      root = node
      do while (parent(root) /= root)
         parent(root) = parent(parent(root))
         root = parent(root)
      end do
   end subroutine find_root

end module rockdda_cutting_faces
