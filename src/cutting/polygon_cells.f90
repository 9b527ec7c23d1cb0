! SPDX-License-Identifier: MIT
!> Cut one block into cells along the lines of a lattice.
!>
!>     call cut_polygon(vertices, edge_joint, lattice, joint, cells, ok)
!>
!> The cells tile the block: inner edges occur in two cells, in opposite directions, with equal coordinates; outer edges
!> keep their joint material and their vertices. Cells of a convex block are convex. They are ordered by rows of the
!> lattice, from below to above, and from left to right within a row. Nothing is cut when the block lies between lines.
module rockdda_cutting_polygon_cells
   use rockdda_base_kinds, only : wp
   use rockdda_base_sorting, only : sorted_order
   use rockdda_geometry_polygons, only : polygon_area, polygon_properties
   use rockdda_geometry_simplicity, only : find_crossing
   use rockdda_cutting_cell_lattice, only : lattice_type
   use rockdda_cutting_cell_lines, only : place_nodes, cut_along_lines
   use rockdda_cutting_cell_map, only : cell_map_type
   use rockdda_cutting_cell_merging, only : remove_bridges, merge_slivers, drop_straight_nodes, is_convex
   implicit none
   private
   public :: polygon_cells_type, cut_polygon, sliver_share

   !> Cells below this share of the thickness of a whole cell are united with a neighbour.
   real(wp), parameter :: sliver_share = 0.3_wp
   !> Shares of the spacing within which a lattice line bends to pass through a node: the first with which the block can
   !> be cut holds. A block with features as narrow as that needs a smaller one.
   real(wp), parameter :: snaps(3) = [0.1_wp, 0.01_wp, 1.0e-9_wp]

   !> The cells of one block.
   type :: polygon_cells_type
      integer :: n = 0
      integer, allocatable :: offset(:)          !! (n + 1) cell i owns entries offset(i)+1 ... offset(i+1)
      integer, allocatable :: node(:)            !! node of each corner
      integer, allocatable :: joint(:)           !! joint material of the edge that starts there
      real(wp), allocatable :: position(:, :)    !! (2, nodes); the vertices of the block come first
      logical, allocatable :: is_outer(:)        !! (nodes) on the outline of the block
   end type polygon_cells_type

contains

   !> Cut a block.
   pure subroutine cut_polygon(vertices, edge_joint, lattice, joint, cells, ok)
      real(wp), intent(in) :: vertices(:, :)     !! (2, n) outline, counter-clockwise
      integer, intent(in) :: edge_joint(:)       !! (n) joint material of the edge that starts at the vertex
      type(lattice_type), intent(in) :: lattice
      integer, intent(in) :: joint               !! joint material of the inner edges
      type(polygon_cells_type), intent(out) :: cells
      logical, intent(out) :: ok                 !! false: the block cannot be cut
      type(cell_map_type) :: map
      integer :: k
      do k = 1, size(snaps)
         call make_cells(snaps(k), map, ok)
         if (.not. ok) cycle
         call collect_cells(map, lattice, cells)
         ok = all_are_sound(cells)
         if (ok) return
      end do

   contains

      !> Cut with a snap.
      pure subroutine make_cells(snap, map, ok)
         real(wp), intent(in) :: snap
         type(cell_map_type), intent(out) :: map
         logical, intent(out) :: ok
         integer :: family
         call map%init(vertices, edge_joint)
         call place_nodes(map, lattice)
         do family = 1, lattice%n_families()
            call cut_along_lines(map, lattice, family, snap, joint, ok)
            if (.not. ok) return
         end do
         call remove_bridges(map)
         call drop_straight_nodes(map)
         call merge_slivers(map, sliver_share*lattice%thickness(), is_convex(vertices))
         call drop_straight_nodes(map)
      end subroutine make_cells

   end subroutine cut_polygon

   !> The loops of the map as polygons, in their final order.
   pure subroutine collect_cells(map, lattice, cells)
      type(cell_map_type), intent(in) :: map
      type(lattice_type), intent(in) :: lattice
      type(polygon_cells_type), intent(out) :: cells
      logical, allocatable :: seen(:)
      integer, allocatable :: first(:), order(:), nodes(:)
      real(wp), allocatable :: row(:), along(:)
      real(wp) :: area, centroid(2), moments(3), place(2)
      integer :: h, k, n, start
      allocate (seen(map%n), first(map%n), row(map%n), along(map%n))
      allocate (cells%is_outer(map%n_nodes))
      seen = .not. map%alive(:map%n)
      cells%is_outer = .false.
      n = 0
      do h = 1, map%n
         if (map%alive(h) .and. map%twin(h) == 0) cells%is_outer([map%origin(h), map%target(h)]) = .true.
         if (seen(h)) cycle
         n = n + 1
         ! the corner in the lowest row, of these the one to the left, and so on: the same for any order of cutting
         start = h
         k = h
         do
            seen(k) = .true.
            if (comes_before(map%position(:, map%origin(k)), map%position(:, map%origin(start)))) start = k
            k = map%next(k)
            if (k == h) exit
         end do
         first(n) = start
         call polygon_properties(map%position(:, map%loop_of(h)), area, centroid, moments)
         place = lattice%place(centroid)
         row(n) = aint(place(2)) - merge(1, 0, place(2) < 0)
         along(n) = place(1)
      end do
      order = sorted_order(along(1:n))
      order = order(sorted_order(row(order)))
      cells%n = n
      allocate (cells%offset(n + 1), cells%node(count(map%alive(:map%n))), cells%joint(count(map%alive(:map%n))))
      cells%offset(1) = 0
      do k = 1, n
         nodes = map%loop_of(first(order(k)))
         cells%offset(k + 1) = cells%offset(k) + size(nodes)
         cells%node(cells%offset(k) + 1:cells%offset(k + 1)) = nodes
         h = first(order(k))
         do start = cells%offset(k) + 1, cells%offset(k + 1)
            cells%joint(start) = map%joint(h)
            h = map%next(h)
         end do
      end do
      cells%position = map%position(:, 1:map%n_nodes)

   contains

      !> Is a lower than b, or as low and further left?
      pure logical function comes_before(a, b)
         real(wp), intent(in) :: a(2), b(2)
         comes_before = a(2) < b(2) .or. (.not. b(2) < a(2) .and. a(1) < b(1))
      end function comes_before

   end subroutine collect_cells

   !> Has every cell a positive area, and does no outline cross itself?
   pure logical function all_are_sound(cells)
      type(polygon_cells_type), intent(in) :: cells
      integer :: k, first, second
      all_are_sound = .false.
      do k = 1, cells%n
         associate (outline => cells%position(:, cells%node(cells%offset(k) + 1:cells%offset(k + 1))))
            if (.not. polygon_area(outline) > 0) return
            call find_crossing(outline, 0.0_wp, first, second)
            if (first > 0) return
         end associate
      end do
      all_are_sound = .true.
   end function all_are_sound

end module rockdda_cutting_polygon_cells
