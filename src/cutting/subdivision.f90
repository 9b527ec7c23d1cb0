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
module rockdda_cutting_subdivision
   use rockdda_base_kinds, only : wp
   use rockdda_geometry_point_bins, only : point_bins_type
   use rockdda_geometry_polygons, only : point_in_polygon, distance_to_outline, polygon_area
   use rockdda_model_blocks, only : block_system_type, point_set_type
   use rockdda_cutting_cell_lattice, only : lattice_type, box_lattice, rectangle_lattice
   use rockdda_cutting_polygon_cells, only : polygon_cells_type, cut_polygon
   implicit none
   private
   public :: cell_choice_type, subdivide_blocks, count_cells

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
      call bins%init(box, 4*n + 1000, weld_distance(box))
      do k = 1, n
         call bins%add(blocks%vertices(:, k), number)
      end do
   end subroutine fill_bins

   !> Points closer than this differ by rounding only.
   pure real(wp) function weld_distance(box)
      real(wp), intent(in) :: box(4)             !! of the model
      weld_distance = 64*epsilon(1.0_wp)*maxval(abs(box))
   end function weld_distance

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

end module rockdda_cutting_subdivision
