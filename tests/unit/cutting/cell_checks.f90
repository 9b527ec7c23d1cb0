! SPDX-License-Identifier: MIT
!> One block as a model, and the checks that all its cells must pass.
module cell_checks
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : to_string
   use rockdda_geometry_polygons, only : polygon_area, inradius_bound
   use rockdda_geometry_simplicity, only : find_crossing
   use rockdda_model_blocks, only : block_system_type
   use rockdda_cutting_cell_merging, only : is_convex
   use rockdda_cutting_subdivision, only : cell_choice_type, subdivide_blocks
   implicit none
   private
   public :: one_block, subdivide, fault_of_cells, outline_of, joints_of, smallest_area, largest_area, &
             smallest_thickness, inner_joint

   !> Joint material of inner edges; blocks must not have it.
   integer, parameter :: inner_joint = 7

contains

   !> A model of one block; joint material 1 unless given.
   function one_block(coordinates, joint) result(blocks)
      real(wp), intent(in) :: coordinates(:)      !! x1, y1, x2, y2, ...
      integer, intent(in), optional :: joint(:)
      type(block_system_type) :: blocks
      integer :: n
      n = size(coordinates)/2
      blocks%n_blocks = 1
      blocks%vertex_offset = [0, n]
      blocks%vertices = reshape(coordinates, [2, n])
      allocate (blocks%edge_joint(n), source=1)
      if (present(joint)) blocks%edge_joint = joint
      blocks%block_material = [1]
   end function one_block

   !> Cut a model of one block and check the cells.
   subroutine subdivide(blocks, size, kind, fault)
      type(block_system_type), intent(inout) :: blocks
      real(wp), intent(in) :: size
      integer, intent(in) :: kind
      character(len=:), allocatable, intent(out) :: fault
      type(block_system_type) :: parent
      logical, allocatable :: uncut(:)
      parent = blocks
      call subdivide_blocks(blocks, [cell_choice_type(size, kind, inner_joint)], [1], uncut)
      fault = ''
      if (uncut(1)) fault = 'the block was not cut'
      if (len(fault) == 0) fault = fault_of_cells(parent, blocks)
   end subroutine subdivide

   !> What is wrong with the cells of a model of one block; '' when nothing is.
   function fault_of_cells(parent, blocks) result(fault)
      type(block_system_type), intent(in) :: parent, blocks
      character(len=:), allocatable :: fault
      real(wp) :: area, outer, whole
      integer :: i, first, second
      logical :: convex
      fault = ''
      convex = is_convex(parent%vertices)
      area = 0
      do i = 1, blocks%n_blocks
         associate (outline => outline_of(blocks, i))
            if (.not. polygon_area(outline) > 0) fault = 'cell '//to_string(i)//' has no area'
            call find_crossing(outline, 0.0_wp, first, second)
            if (first > 0) fault = 'cell '//to_string(i)//' crosses itself'
            if (convex .and. .not. is_convex(outline)) fault = 'cell '//to_string(i)//' of a convex block is not convex'
            area = area + polygon_area(outline)
         end associate
      end do
      ! nodes on the outline are rounded to epsilon of their coordinates, which moves edges sideways
      whole = polygon_area(parent%vertices)
      if (abs(area - whole) > 1e-12_wp*whole + 4*epsilon(1.0_wp)*maxval(abs(parent%vertices))*sqrt(whole)) &
         fault = 'areas differ by '//to_string(area - whole)
      call check_inner_edges(blocks, fault)
      outer = outer_length(blocks)
      if (abs(outer - outer_length(parent)) > 1e-12_wp*outer + 64*epsilon(1.0_wp)*maxval(abs(parent%vertices))) &
         fault = 'outer edges differ in length by '//to_string(outer - outer_length(parent))
   end function fault_of_cells

   !> Every inner edge occurs twice, in opposite directions, bit for bit.
   subroutine check_inner_edges(blocks, fault)
      type(block_system_type), intent(in) :: blocks
      character(len=:), allocatable, intent(inout) :: fault
      real(wp), allocatable :: edges(:, :)
      logical, allocatable :: has_twin(:)
      integer :: i, k, m, n, first, last
      allocate (edges(4, size(blocks%edge_joint)))
      n = 0
      do i = 1, blocks%n_blocks
         first = blocks%vertex_offset(i) + 1
         last = blocks%vertex_offset(i + 1)
         do k = first, last
            if (blocks%edge_joint(k) /= inner_joint) cycle
            n = n + 1
            edges(1:2, n) = blocks%vertices(:, k)
            edges(3:4, n) = blocks%vertices(:, merge(first, k + 1, k == last))
         end do
      end do
      allocate (has_twin(n), source=.false.)
      do k = 1, n
         if (has_twin(k)) cycle
         do m = k + 1, n
            if (any(abs(edges(1:2, k) - edges(3:4, m)) > 0)) cycle
            if (any(abs(edges(3:4, k) - edges(1:2, m)) > 0)) cycle
            if (has_twin(m)) fault = 'an inner edge occurs three times'
            has_twin([k, m]) = .true.
            exit
         end do
      end do
      if (.not. all(has_twin)) fault = to_string(count(.not. has_twin))//' inner edges occur once'
   end subroutine check_inner_edges

   !> Length of the edges that are not inner, and no bridges.
   real(wp) function outer_length(blocks)
      type(block_system_type), intent(in) :: blocks
      integer :: i, k, first, last
      outer_length = 0
      do i = 1, blocks%n_blocks
         first = blocks%vertex_offset(i) + 1
         last = blocks%vertex_offset(i + 1)
         do k = first, last
            if (blocks%edge_joint(k) == inner_joint .or. blocks%edge_joint(k) == 0) cycle
            outer_length = outer_length + norm2(blocks%vertices(:, merge(first, k + 1, k == last)) - &
                                                blocks%vertices(:, k))
         end do
      end do
   end function outer_length

   !> Vertices of a block.
   function outline_of(blocks, i) result(outline)
      type(block_system_type), intent(in) :: blocks
      integer, intent(in) :: i
      real(wp), allocatable :: outline(:, :)
      allocate (outline, source=blocks%vertices(:, blocks%vertex_offset(i) + 1:blocks%vertex_offset(i + 1)))
   end function outline_of

   !> Joint materials of a block.
   function joints_of(blocks, i) result(joints)
      type(block_system_type), intent(in) :: blocks
      integer, intent(in) :: i
      integer, allocatable :: joints(:)
      allocate (joints, source=blocks%edge_joint(blocks%vertex_offset(i) + 1:blocks%vertex_offset(i + 1)))
   end function joints_of

   !> Smallest area of a cell.
   real(wp) function smallest_area(blocks)
      type(block_system_type), intent(in) :: blocks
      integer :: i
      smallest_area = huge(1.0_wp)
      do i = 1, blocks%n_blocks
         smallest_area = min(smallest_area, polygon_area(outline_of(blocks, i)))
      end do
   end function smallest_area

   !> Largest area of a cell.
   real(wp) function largest_area(blocks)
      type(block_system_type), intent(in) :: blocks
      integer :: i
      largest_area = 0
      do i = 1, blocks%n_blocks
         largest_area = max(largest_area, polygon_area(outline_of(blocks, i)))
      end do
   end function largest_area

   !> Smallest thickness of a cell.
   real(wp) function smallest_thickness(blocks)
      type(block_system_type), intent(in) :: blocks
      integer :: i
      smallest_thickness = huge(1.0_wp)
      do i = 1, blocks%n_blocks
         smallest_thickness = min(smallest_thickness, inradius_bound(outline_of(blocks, i)))
      end do
   end function smallest_thickness

end module cell_checks
