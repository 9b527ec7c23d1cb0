! SPDX-License-Identifier: MIT
!> Tied and bonded joints between cells of different blocks, each on its own lattice. Every interval holds the mean of
!> what it covers: an edge with several of them leaves a cell of uniform strain less freedom to bend, and shear on the
!> joint has peaks. A cantilever of two layers, one cell of 0.5 m each, on cells of 0.35 and 0.25 m and on some shifted
!> by half: 0.71, 0.84 and 0.97 of its deflection with ties, 0.80, 0.82 and 0.62 with bonds.
module rockdda_check_cell_joints
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : to_string
   use rockdda_geometry_box_pairs, only : box_pairs_work_type, find_box_pairs
   use rockdda_interaction_boundary_edges, only : boxes_of, common_stretch, next_vertex
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_parameters, only : parameters_type
   implicit none
   private
   public :: check_cell_joints

   !> Share of the length of a joint that may be so: a corner, a last cell.
   real(wp), parameter :: largest_share = 0.05_wp
   !> One interval.
   type :: interval_type
      integer :: edge = 0, blocks(2) = 0, joint = 0
      real(wp) :: length = 0
      logical :: is_part = .false.             !! one of both edges is longer than it
   end type interval_type

contains

   !> One warning for each joint material.
   subroutine check_cell_joints(blocks, parameters, messages)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(diagnostics_type), intent(inout) :: messages
      type(interval_type), allocatable :: intervals(:)
      integer :: c, i, n, first
      real(wp) :: total, bad
      if (.not. allocated(blocks%parent)) return
      call find_intervals(blocks, parameters, intervals, n)
      do i = 1, size(parameters%joint_materials)
         total = 0
         bad = 0
         first = 0
         do c = 1, n
            associate (one => intervals(c))
               if (one%joint /= i) cycle
               total = total + one%length
               if (.not. one%is_part) cycle
               bad = bad + one%length
               if (first == 0) first = c
            end associate
         end do
         if (.not. bad > largest_share*total) cycle
         associate (one => intervals(first), material => parameters%joint_materials(i))
            call messages%add(severity%warning, 'joint material '//to_string(i)//' holds cells of different blocks '// &
               'whose edges do not match, on '//to_string(100*bad/total, 2)//' % of its length, as those of blocks '// &
               to_string(blocks%parent(one%blocks(1)))//' and '//to_string(blocks%parent(one%blocks(2)))//' at ('// &
               to_string(blocks%vertices(1, one%edge), 5)//', '//to_string(blocks%vertices(2, one%edge), 5)// &
               '): layers of few cells bend too little, by up to 40 %, and the joint breaks early; give both sides '// &
               'the same size in &subdivide, so that cells end at the same places', material%origin)
         end associate
      end do
   end subroutine check_cell_joints

   !> Intervals of joints with a tie or a tensile strength between cells of different blocks.
   subroutine find_intervals(blocks, parameters, intervals, n)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(interval_type), allocatable, intent(out) :: intervals(:)
      integer, intent(out) :: n
      type(box_pairs_work_type) :: work
      type(interval_type) :: one
      type(interval_type), allocatable :: longer(:)
      integer, allocatable :: pairs(:, :), n_cells(:)
      real(wp) :: stretch(2), tolerance
      integer :: a, b, k, l, n_pairs, p
      allocate (intervals(16), n_cells(maxval(blocks%parent)))
      n = 0
      n_cells = 0
      tolerance = max(blocks%edge_node_distance, 1.0e-9_wp*parameters%w0)
      do b = 1, size(blocks%parent)
         n_cells(blocks%parent(b)) = n_cells(blocks%parent(b)) + 1
      end do
      call find_box_pairs(boxes_of(blocks), tolerance, pairs, n_pairs, work)
      do p = 1, n_pairs
         a = pairs(1, p)
         b = pairs(2, p)
         if (max(a, b) > size(blocks%parent)) cycle
         if (blocks%parent(a) == blocks%parent(b) .or. any(n_cells(blocks%parent([a, b])) < 2)) cycle
         do k = blocks%vertex_offset(a) + 1, blocks%vertex_offset(a + 1)
            do l = blocks%vertex_offset(b) + 1, blocks%vertex_offset(b + 1)
               one%joint = max(blocks%edge_joint(k), blocks%edge_joint(l))
               if (min(blocks%edge_joint(k), blocks%edge_joint(l)) < 1) cycle
               associate (material => parameters%joint_materials(one%joint))
                  if (.not. (material%tie .or. material%tension > 0 .or. material%cohesion > 0)) cycle
               end associate
               associate (v => blocks%vertices, to => [next_vertex(blocks, a, k), next_vertex(blocks, b, l)])
                  stretch = common_stretch(v(:, k), v(:, to(1)), v(:, l), v(:, to(2)), tolerance)
                  one%length = stretch(2) - stretch(1)
                  if (.not. one%length > 0) cycle
                  one%edge = k
                  one%blocks = [a, b]
                  one%is_part = one%length < max(norm2(v(:, to(1)) - v(:, k)), norm2(v(:, to(2)) - v(:, l))) - &
                                             2*tolerance
               end associate
               if (n == size(intervals)) then
                  allocate (longer(2*n))
                  longer(:n) = intervals
                  call move_alloc(longer, intervals)
               end if
               n = n + 1
               intervals(n) = one
            end do
         end do
      end do
   end subroutine find_intervals

end module rockdda_check_cell_joints
