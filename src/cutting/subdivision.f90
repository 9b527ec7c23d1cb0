! SPDX-License-Identifier: MIT
!> Cut blocks of a model into cells: the cells take the place of their block in the list of blocks.
!>
!>     blocks before   1   2   3        blocks after   1   2 3 4 5   6
!>                         |                               cells of block 2
!>                       cut           parent          1   2 2 2 2   3
!>
!> Nodes on the outline of a block that lie, up to rounding, on a vertex of another block or on a node of its cells
!> take the coordinates of that. No vertex of a block that stays whole changes, and none is added to it.
!>
!> A point on a block, or the end of a bolt, goes to the cell that contains it; of several the one with the smallest
!> number.
!>
!> One block is cut along the lines of a lattice:
!>
!>     call cut_polygon(vertices, edge_joint, lattice, joint, cells, ok)
!>
!> The cells tile the block: inner edges occur in two cells, in opposite directions, with equal coordinates; outer edges
!> keep their joint material and their vertices. Cells of a convex block are convex. They are ordered by rows of the
!> lattice, from below to above, and from left to right within a row. Nothing is cut when the block lies between lines.
module rockdda_cutting_subdivision
   use rockdda_base_kinds, only : wp
   use rockdda_base_sorting, only : sorted_order
   use rockdda_geometry_point_bins, only : point_bins_type
   use rockdda_geometry_polygons, only : point_in_polygon, distance_to_outline, polygon_area, polygon_properties
   use rockdda_geometry_simplicity, only : find_crossing
   use rockdda_model_blocks, only : block_system_type, point_set_type
   use rockdda_cutting_cell_lattice, only : lattice_type, box_lattice, rectangle_lattice
   use rockdda_cutting_cell_lines, only : place_nodes, cut_along_lines
   use rockdda_cutting_cell_map, only : cell_map_type
   use rockdda_cutting_cell_merging, only : remove_bridges, merge_slivers, drop_straight_nodes, is_convex
   implicit none
   private
   public :: cell_choice_type, subdivide_blocks, count_cells

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

   !> How some blocks are cut.
   type :: cell_choice_type
      real(wp) :: size = 0                       !! of the cells, > 0 [L]
      integer :: kind = 0                        !! one of cell_kind%...
      integer :: joint = 0                       !! joint material of the inner edges, > 0
   end type cell_choice_type

contains

   !> Cut blocks.
   pure subroutine subdivide_blocks(blocks, choices, choice, uncut)
      type(block_system_type), intent(inout) :: blocks
      type(cell_choice_type), intent(in) :: choices(:)
      integer, intent(in) :: choice(:)           !! (blocks) place among the choices, 0: the block stays whole
      logical, allocatable, intent(out) :: uncut(:) !! (blocks) such a block stays whole because it cannot be cut
      type(polygon_cells_type), allocatable :: cells(:)
      type(lattice_type), allocatable :: lattices(:)
      type(lattice_type) :: lattice
      type(point_bins_type) :: bins
      integer :: i, from, to
      logical :: found, ok
      allocate (cells(blocks%n_blocks), lattices(size(choices)), uncut(blocks%n_blocks))
      uncut = .false.
      do i = 1, size(choices)
         if (any(choice == i)) lattices(i) = box_lattice(box_of_blocks(blocks, choice == i), choices(i)%size, &
                                                         choices(i)%kind)
      end do
      call fill_bins(blocks, bins)
      do i = 1, blocks%n_blocks
         if (choice(i) == 0) cycle
         from = blocks%vertex_offset(i) + 1
         to = blocks%vertex_offset(i + 1)
         found = .false.
         associate (c => choices(choice(i)))
            if (all(blocks%edge_joint(from:to) /= 0)) &
               call rectangle_lattice(blocks%vertices(:, from:to), c%size, c%kind, lattice, found)
            if (.not. found) lattice = lattices(choice(i))
            call cut_polygon(blocks%vertices(:, from:to), blocks%edge_joint(from:to), lattice, c%joint, cells(i), ok)
         end associate
         uncut(i) = .not. ok
         if (ok) call weld_outer_nodes(to - from + 1, cells(i), bins)
      end do
      call replace_blocks(cells, choice > 0 .and. .not. uncut, blocks)
   end subroutine subdivide_blocks

   !> About how many cells a choice makes of some blocks.
   pure real(wp) function count_cells(blocks, choice, chosen)
      type(block_system_type), intent(in) :: blocks
      type(cell_choice_type), intent(in) :: choice
      logical, intent(in) :: chosen(:)           !! (blocks)
      integer :: i
      count_cells = 0
      do i = 1, blocks%n_blocks
         if (chosen(i)) count_cells = count_cells + choice%kind*max(1.0_wp, polygon_area(blocks%vertices(:, &
            blocks%vertex_offset(i) + 1:blocks%vertex_offset(i + 1)))/choice%size**2)
      end do
   end function count_cells

   !> Box around some blocks.
   pure function box_of_blocks(blocks, chosen) result(box)
      type(block_system_type), intent(in) :: blocks
      logical, intent(in) :: chosen(:)           !! (blocks), at least one
      real(wp) :: box(4)
      integer :: i
      box(1:2) = huge(1.0_wp)
      box(3:4) = -huge(1.0_wp)
      do i = 1, blocks%n_blocks
         if (.not. chosen(i)) cycle
         associate (v => blocks%vertices(:, blocks%vertex_offset(i) + 1:blocks%vertex_offset(i + 1)))
            box(1:2) = min(box(1:2), minval(v, 2))
            box(3:4) = max(box(3:4), maxval(v, 2))
         end associate
      end do
   end function box_of_blocks

   !> The vertices of all blocks in bins.
   pure subroutine fill_bins(blocks, bins)
      type(block_system_type), intent(in) :: blocks
      type(point_bins_type), intent(inout) :: bins
      real(wp) :: box(4)
      integer :: k, n, number
      n = blocks%n_vertices()
      box(1:2) = minval(blocks%vertices(:, 1:n), 2)
      box(3:4) = maxval(blocks%vertices(:, 1:n), 2)
      ! points closer than this differ by rounding only
      call bins%init(box, 4*n + 1000, 64*epsilon(1.0_wp)*maxval(abs(box)))
      do k = 1, n
         call bins%add(blocks%vertices(:, k), number)
      end do
   end subroutine fill_bins

   !> Give new nodes on the outline the coordinates of nodes of other blocks at the same place.
   pure subroutine weld_outer_nodes(n_vertices, cells, bins)
      integer, intent(in) :: n_vertices          !! of the block
      type(polygon_cells_type), intent(inout) :: cells
      type(point_bins_type), intent(inout) :: bins
      integer :: k, number
      do k = n_vertices + 1, size(cells%is_outer)
         if (.not. cells%is_outer(k)) cycle
         number = bins%nearest(cells%position(:, k), 64*epsilon(1.0_wp)*maxval(abs(cells%position(:, k))))
         if (number > 0) then
            cells%position(:, k) = bins%position(:, number)
         else
            call bins%add(cells%position(:, k), number)
         end if
      end do
   end subroutine weld_outer_nodes

   !> Put the cells in the places of their blocks.
   pure subroutine replace_blocks(cells, is_cut, blocks)
      type(polygon_cells_type), intent(in) :: cells(:)   !! (blocks)
      logical, intent(in) :: is_cut(:)                   !! (blocks)
      type(block_system_type), intent(inout) :: blocks
      type(block_system_type) :: new
      integer, allocatable :: first(:)
      integer :: i, n, n_blocks, n_vertices, c
      n_blocks = sum(cells%n, mask=is_cut) + count(.not. is_cut)
      n_vertices = 0
      do i = 1, blocks%n_blocks
         n = blocks%vertex_offset(i + 1) - blocks%vertex_offset(i)
         if (is_cut(i)) n = cells(i)%offset(cells(i)%n + 1)
         n_vertices = n_vertices + n
      end do
      new%edge_node_distance = blocks%edge_node_distance
      allocate (new%vertex_offset(n_blocks + 1), new%vertices(2, n_vertices), new%edge_joint(n_vertices), &
                new%block_material(n_blocks), new%parent(n_blocks), first(blocks%n_blocks + 1))
      if (allocated(blocks%file_line)) allocate (new%file_line(n_blocks))
      new%vertex_offset(1) = 0
      do i = 1, blocks%n_blocks
         first(i) = new%n_blocks + 1
         if (is_cut(i)) then
            do c = 1, cells(i)%n
               associate (from => cells(i)%offset(c) + 1, to => cells(i)%offset(c + 1))
                  call add_block(blocks, i, cells(i)%position(:, cells(i)%node(from:to)), cells(i)%joint(from:to), new)
               end associate
            end do
         else
            associate (from => blocks%vertex_offset(i) + 1, to => blocks%vertex_offset(i + 1))
               call add_block(blocks, i, blocks%vertices(:, from:to), blocks%edge_joint(from:to), new)
            end associate
         end if
      end do
      first(blocks%n_blocks + 1) = new%n_blocks + 1
      new%fixed = blocks%fixed
      new%loading = blocks%loading
      new%measured = blocks%measured
      new%bolts = blocks%bolts
      call move_points(new, first, new%fixed)
      call move_points(new, first, new%loading)
      call move_points(new, first, new%measured)
      do i = 1, new%bolts%n
         do c = 1, 2
            if (new%bolts%blocks(c, i) > 0) new%bolts%blocks(c, i) = cell_at(new, first, new%bolts%blocks(c, i), &
                                                                             new%bolts%ends(2*c - 1:2*c, i))
         end do
      end do
      blocks = new
   end subroutine replace_blocks

   !> Append a cell of a block, or the block itself.
   pure subroutine add_block(old, parent, vertices, joint, new)
      type(block_system_type), intent(in) :: old
      integer, intent(in) :: parent                      !! block of the old list
      real(wp), intent(in) :: vertices(:, :)             !! (2, n)
      integer, intent(in) :: joint(:)                    !! (n)
      type(block_system_type), intent(inout) :: new      !! with room
      integer :: at
      at = new%vertex_offset(new%n_blocks + 1)
      new%n_blocks = new%n_blocks + 1
      new%vertices(:, at + 1:at + size(joint)) = vertices
      new%edge_joint(at + 1:at + size(joint)) = joint
      new%vertex_offset(new%n_blocks + 1) = at + size(joint)
      new%block_material(new%n_blocks) = old%block_material(parent)
      new%parent(new%n_blocks) = parent
      if (allocated(old%file_line)) new%file_line(new%n_blocks) = old%file_line(parent)
   end subroutine add_block

   !> Points go to the cells that contain them.
   pure subroutine move_points(blocks, first, points)
      type(block_system_type), intent(in) :: blocks      !! cells
      integer, intent(in) :: first(:)                    !! (old blocks + 1) first cell of each
      type(point_set_type), intent(inout) :: points
      integer :: k
      do k = 1, points%n
         points%block(k) = cell_at(blocks, first, points%block(k), points%position(:, k))
      end do
   end subroutine move_points

   !> The cell of a block at a point: the first that contains it, on its outline or inside, else the nearest.
   pure integer function cell_at(blocks, first, block, point)
      type(block_system_type), intent(in) :: blocks      !! cells
      integer, intent(in) :: first(:), block
      real(wp), intent(in) :: point(2)
      real(wp) :: distance, best, rounding
      integer :: i
      rounding = 64*epsilon(1.0_wp)*maxval(abs(blocks%vertices(:, blocks%vertex_offset(first(block)) + 1: &
                                                               blocks%vertex_offset(first(block + 1)))))
      best = huge(1.0_wp)
      cell_at = first(block)
      do i = first(block), first(block + 1) - 1
         associate (from => blocks%vertex_offset(i) + 1, to => blocks%vertex_offset(i + 1))
            if (point_in_polygon(point, blocks%vertices(:, from:to))) then
               distance = 0
            else
               distance = distance_to_outline(point, blocks%vertices(:, from:to), blocks%edge_joint(from:to) == 0)
            end if
         end associate
         if (distance < best) then
            best = distance
            cell_at = i
         end if
         if (best <= rounding) return
      end do
   end function cell_at

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

end module rockdda_cutting_subdivision
