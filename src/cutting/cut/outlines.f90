! SPDX-License-Identifier: MIT
!> Polygons from faces: join islands by bridges, drop straight corners, order the blocks.
!>
!> A face with islands becomes one polygon: from a corner of the outline over a bridge to the leftmost corner of the
!> island, clockwise around it, and back over the bridge. Bridge edges have joint material 0. The corner is the one
!> that a ray from the island to the left leads to, or a nearer one in between, so that bridges cross no edge.
!>
!> A corner between two edges of one joint material is dropped when it lies on the line between its neighbours up to
!> rounding (1e-10 of that line's length, and far below e0): T junctions add no corner to the straight side, unless
!> the polygon visits that corner again.
!>
!> Order: nodes are numbered by the first pair of lines that meets there, (1,2), (1,3), ..., (2,3), ...; a polygon
!> starts at its first node, and blocks are numbered by their first nodes (as the original programs do); blocks that
!> share their first node follow each other counter-clockwise around it, by the direction of their first edge
!> from +x.
module rockdda_cutting_outlines
   use rockdda_base_kinds, only : wp, pi
   use rockdda_base_room, only : grow
   use rockdda_base_sorting, only : sorted_order
   use rockdda_geometry_polygons, only : polygon_area
   use rockdda_cutting_graph, only : graph_type
   use rockdda_cutting_faces, only : face_set_type, half_edge_origin, twin
   use rockdda_cutting_nesting, only : nesting_type
   implicit none
   private
   public :: outline_set_type, make_outlines

   !> Polygons of all faces, in their final order.
   type :: outline_set_type
      integer :: n = 0
      integer, allocatable :: offset(:)        !! (n + 1) polygon i owns entries offset(i)+1 ... offset(i+1)
      integer, allocatable :: node(:)          !! graph node of each corner
      integer, allocatable :: joint(:)         !! joint material of the edge that starts at the corner
      integer, allocatable :: face(:)          !! (n) cycle that the polygon came from
      integer, allocatable :: n_islands(:)     !! (n) islands joined by bridges
      integer, allocatable :: n_touching(:)    !! (n) corners that the outline visits again
      integer, allocatable :: touching(:)      !! (n) the first of these nodes; 0: none
      real(wp), allocatable :: area(:)         !! (n)
   end type outline_set_type

   !> One polygon as a closed chain.
   type :: chain_type
      integer :: n = 0
      integer, allocatable :: node(:), joint(:), next(:), previous(:)
   end type chain_type

contains

   !> Polygons of all faces.
   pure subroutine make_outlines(graph, faces, nesting, line_joint, e0, outlines)
      type(graph_type), intent(in) :: graph
      type(face_set_type), intent(in) :: faces
      type(nesting_type), intent(in) :: nesting
      integer, intent(in) :: line_joint(:)     !! (lines) joint material
      real(wp), intent(in) :: e0               !! [L]
      type(outline_set_type), intent(out) :: outlines
      type(outline_set_type) :: raw
      type(chain_type) :: chain
      integer, allocatable :: first_group(:), next_group(:), order(:), seen(:), visits(:)
      real(wp), allocatable :: direction(:)
      real(wp) :: d(2)
      integer :: c, g, k, i, n, total, first, from, to
      ! islands of each face from left to right, as lists
      allocate (first_group(faces%n_cycles), next_group(faces%n_groups), source=0)
      do k = faces%n_groups, 1, -1
         g = nesting%order(k)
         c = nesting%face(g)
         if (c == 0) cycle
         next_group(g) = first_group(c)
         first_group(c) = g
      end do
      n = count(faces%area > 0)
      total = count(faces%cycle > 0) + 2*faces%n_groups
      allocate (raw%offset(n + 1), raw%node(total), raw%joint(total), raw%n_islands(n), raw%face(n), source=0)
      allocate (seen(graph%n_nodes), visits(graph%n_nodes), source=0)
      allocate (direction(n))
      do c = 1, faces%n_cycles
         if (.not. faces%area(c) > 0) cycle
         raw%n = raw%n + 1
         i = raw%n
         raw%face(i) = c
         chain%n = 0
         call add_cycle(graph, faces, line_joint, c, chain, first)
         g = first_group(c)
         do while (g > 0)
            call join_island(graph, faces, nesting, line_joint, g, chain)
            raw%n_islands(i) = raw%n_islands(i) + 1
            g = next_group(g)
         end do
         call drop_straight_corners(graph, e0, visits, chain)
         call store_chain(chain, raw)
         d = graph%position(:, raw%node(raw%offset(i) + 2)) - graph%position(:, raw%node(raw%offset(i) + 1))
         direction(i) = modulo(atan2(d(2), d(1)), 2*pi)
      end do

      ! final order
      order = sorted_order(direction)
      order = order(sorted_order(raw%node(raw%offset(order) + 1)))
      outlines%n = n
      allocate (outlines%offset(n + 1), source=0)
      allocate (outlines%node(raw%offset(n + 1)), outlines%joint(raw%offset(n + 1)), outlines%area(n))
      allocate (outlines%n_touching(n), outlines%touching(n), source=0)
      outlines%n_islands = raw%n_islands(order)
      outlines%face = raw%face(order)
      do k = 1, n
         i = order(k)
         from = outlines%offset(k) + 1
         to = outlines%offset(k) + raw%offset(i + 1) - raw%offset(i)
         outlines%offset(k + 1) = to
         outlines%node(from:to) = raw%node(raw%offset(i) + 1:raw%offset(i + 1))
         outlines%joint(from:to) = raw%joint(raw%offset(i) + 1:raw%offset(i + 1))
         outlines%area(k) = polygon_area(graph%position(:, outlines%node(from:to)))
         do g = from, to
            if (seen(outlines%node(g)) == k) outlines%n_touching(k) = outlines%n_touching(k) + 1
            seen(outlines%node(g)) = k
         end do
         ! both ends of every bridge are visited twice, without contact
         outlines%n_touching(k) = outlines%n_touching(k) - count(outlines%joint(from:to) == 0)
         if (outlines%n_touching(k) > 0) &
            outlines%touching(k) = touching_node(outlines%node(from:to), outlines%joint(from:to))
      end do
   end subroutine make_outlines

   !> The first node that an outline visits again, if possible not at a bridge.
   pure integer function touching_node(node, joint) result(found)
      integer, intent(in) :: node(:), joint(:)   !! of each edge the node at its start, and 0: a bridge
      integer :: k
      found = 0
      do k = 2, size(node)
         if (.not. any(node(1:k - 1) == node(k))) cycle
         if (found == 0) found = node(k)
         if (any(node == node(k) .and. (joint == 0 .or. cshift(joint, -1) == 0))) cycle
         found = node(k)
         return
      end do
   end function touching_node

   !> Append a closed chain with the corners of a cycle; `first` is its first entry.
   pure subroutine add_cycle(graph, faces, line_joint, c, chain, first)
      type(graph_type), intent(in) :: graph
      type(face_set_type), intent(in) :: faces
      integer, intent(in) :: line_joint(:), c
      type(chain_type), intent(inout) :: chain
      integer, intent(out) :: first
      integer :: h
      first = chain%n + 1
      h = faces%first(c)
      do
         call add_entry(chain, half_edge_origin(graph, h), line_joint(graph%line((h + 1)/2)))
         chain%next(chain%n) = chain%n + 1
         chain%previous(chain%n) = chain%n - 1
         h = faces%next(h)
         if (h == faces%first(c)) exit
      end do
      chain%next(chain%n) = first
      chain%previous(first) = chain%n
   end subroutine add_cycle

   !> Append an unlinked entry. By value: what comes from the chain itself must outlast its move.
   pure subroutine add_entry(chain, node, joint)
      type(chain_type), intent(inout) :: chain
      integer, value :: node, joint
      chain%n = chain%n + 1
      call grow(chain%node, chain%n)
      call grow(chain%joint, chain%n)
      call grow(chain%next, chain%n)
      call grow(chain%previous, chain%n)
      chain%node(chain%n) = node
      chain%joint(chain%n) = joint
   end subroutine add_entry

   !> Join the contour of a group to the chain by a bridge.
   pure subroutine join_island(graph, faces, nesting, line_joint, g, chain)
      type(graph_type), intent(in) :: graph
      type(face_set_type), intent(in) :: faces
      type(nesting_type), intent(in) :: nesting
      integer, intent(in) :: line_joint(:), g
      type(chain_type), intent(inout) :: chain
      integer :: island_node, outline_node, first, last, island, outline, back_island, back_outline, k
      island_node = nesting%leftmost(g)
      outline_node = visible_node(graph, nesting%hit(g), graph%position(:, island_node), chain)
      last = chain%n
      call add_cycle(graph, faces, line_joint, faces%contour(g), chain, first)
      outline = 0
      do k = 1, last
         if (chain%node(k) /= outline_node) cycle
         if (outline == 0) outline = k
         if (opens_towards(graph, chain, k, graph%position(:, island_node))) outline = k
      end do
      island = 0
      do k = first, chain%n
         if (chain%node(k) /= island_node) cycle
         if (island == 0) island = k
         if (opens_towards(graph, chain, k, graph%position(:, outline_node))) island = k
      end do
      call add_entry(chain, outline_node, chain%joint(outline))
      back_outline = chain%n
      call add_entry(chain, island_node, 0)
      back_island = chain%n
      ! ... outline, island ... back_island, back_outline ...
      chain%joint(outline) = 0
      k = chain%next(outline)
      chain%next(back_outline) = k
      chain%previous(k) = back_outline
      k = chain%previous(island)
      chain%next(k) = back_island
      chain%previous(back_island) = k
      chain%next(outline) = island
      chain%previous(island) = outline
      chain%next(back_island) = back_outline
      chain%previous(back_outline) = back_island
   end subroutine join_island

   !> A corner of the chain that is visible from a point, with the half-edge `hit` to its left.
   pure integer function visible_node(graph, hit, point, chain)
      type(graph_type), intent(in) :: graph
      integer, intent(in) :: hit
      real(wp), intent(in) :: point(2)
      type(chain_type), intent(in) :: chain
      real(wp) :: a(2), b(2), corner(2), meet_x, slope, best_slope, best_x, x(2), along
      integer :: k
      a = graph%position(:, half_edge_origin(graph, hit))
      b = graph%position(:, half_edge_origin(graph, twin(hit)))
      ! the ray ends at meet_x; the end of the edge that lies further left spans a triangle with the ray
      meet_x = a(1) + (b(1) - a(1))*((point(2) - a(2))/(b(2) - a(2)))
      visible_node = half_edge_origin(graph, hit)
      corner = a
      if (b(1) < a(1)) then
         visible_node = half_edge_origin(graph, twin(hit))
         corner = b
      end if
      best_slope = abs(corner(2) - point(2))/(point(1) - corner(1))
      best_x = corner(1)
      ! corners inside that triangle block the view: the one nearest to the ray is visible
      do k = 1, chain%n
         x = graph%position(:, chain%node(k))
         if (.not. (x(1) < point(1) .and. x(1) >= corner(1))) cycle
         if ((x(2) - point(2))*(corner(2) - point(2)) < 0) cycle
         slope = abs(x(2) - point(2))/(point(1) - x(1))
         if (slope > best_slope) cycle
         ! not beyond the edge
         along = (x(2) - point(2))*(corner(1) - meet_x)
         if (abs(corner(2) - point(2)) > 0) along = along/(corner(2) - point(2))
         if (x(1) < meet_x + along) cycle
         if (slope < best_slope .or. x(1) > best_x) then
            best_slope = slope
            best_x = x(1)
            visible_node = chain%node(k)
         end if
      end do
   end function visible_node

   !> Does the inside of the chain at entry k lie towards a point?
   pure logical function opens_towards(graph, chain, k, point)
      type(graph_type), intent(in) :: graph
      type(chain_type), intent(in) :: chain
      integer, intent(in) :: k
      real(wp), intent(in) :: point(2)
      real(wp) :: x(2), to_next, to_previous, to_point, d(2), opening
      x = graph%position(:, chain%node(k))
      d = graph%position(:, chain%node(chain%next(k))) - x
      to_next = atan2(d(2), d(1))
      d = graph%position(:, chain%node(chain%previous(k))) - x
      to_previous = atan2(d(2), d(1))
      d = point - x
      to_point = atan2(d(2), d(1))
      opening = modulo(to_previous - to_next, 2*pi)
      ! both edges in one direction: all around is inside
      if (.not. opening > 0) opening = 2*pi
      opens_towards = modulo(to_point - to_next, 2*pi) < opening
   end function opens_towards

   !> Unlink corners that lie on the straight line between their neighbours.
   pure subroutine drop_straight_corners(graph, e0, visits, chain)
      type(graph_type), intent(in) :: graph
      real(wp), intent(in) :: e0
      integer, intent(inout) :: visits(:)      !! (nodes) all 0, before and after
      type(chain_type), intent(inout) :: chain
      real(wp) :: p(2), x(2), q(2), u(2), v(2), length, tolerance
      integer :: k
      do k = 1, chain%n
         visits(chain%node(k)) = visits(chain%node(k)) + 1
      end do
      do k = 1, chain%n
         if (chain%joint(k) /= chain%joint(chain%previous(k)) .or. chain%joint(k) == 0) cycle
         if (visits(chain%node(k)) > 1) cycle
         p = graph%position(:, chain%node(chain%previous(k)))
         x = graph%position(:, chain%node(k))
         q = graph%position(:, chain%node(chain%next(k)))
         u = x - p
         v = q - x
         if (.not. dot_product(u, v) > 0) cycle
         length = hypot(q(1) - p(1), q(2) - p(2))
         tolerance = min(1.0e-3_wp*e0, 1.0e-10_wp*length + 8*epsilon(1.0_wp)*maxval(abs([p, q])))
         if (abs(u(1)*v(2) - u(2)*v(1)) > tolerance*length) cycle
         chain%next(chain%previous(k)) = chain%next(k)
         chain%previous(chain%next(k)) = chain%previous(k)
         visits(chain%node(k)) = 0
         chain%node(k) = 0
      end do
      do k = 1, chain%n
         if (chain%node(k) > 0) visits(chain%node(k)) = 0
      end do
   end subroutine drop_straight_corners

   !> Append the chain as a polygon that starts at its first node.
   pure subroutine store_chain(chain, raw)
      type(chain_type), intent(in) :: chain
      type(outline_set_type), intent(inout) :: raw
      integer :: k, first, at
      first = 0
      do k = 1, chain%n
         if (chain%node(k) == 0) cycle
         if (first == 0) first = k
         if (chain%node(k) < chain%node(first)) first = k
      end do
      at = raw%offset(raw%n)
      k = first
      do
         at = at + 1
         raw%node(at) = chain%node(k)
         raw%joint(at) = chain%joint(k)
         k = chain%next(k)
         if (k == first) exit
      end do
      raw%offset(raw%n + 1) = at
   end subroutine store_chain

end module rockdda_cutting_outlines
