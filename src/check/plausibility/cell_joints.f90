! SPDX-License-Identifier: MIT
!> Tied and bonded joints between cells of different blocks, each on its own lattice. Every interval holds the mean of
!> what it covers: an edge with several of them leaves a cell of uniform strain less freedom to bend, and shear on the
!> joint has peaks. A cantilever of two layers, one cell of 0.5 m each, on cells of 0.35 and 0.25 m and on some shifted
!> by half: 0.71, 0.84 and 0.97 of its deflection with ties, 0.80, 0.82 and 0.62 with bonds.
!>
!> Tied blocks with many neighbours. An interval of a tie holds two displacements at its middle, and two blocks share
!> them: blocks of six numbers with five or six intervals, or four and a free edge, or two on one edge, have little
!> left that bends. Deflection of cantilevers of such blocks, whoever drew them: 0.64, 0.58, 0.86, 0.90 of 20, 80, 320
!> and 720 Voronoi cells, 0.68 to 0.92 of bricks 2:1 in running bond, 0.25 to 0.53 of bricks 4:1. Triangles have three
!> sides, rectangles four; of cells that &subdivide makes along an oblique outline up to a third have five.
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
   !> Sides of a tied block that leave it little to bend, and the share of such blocks from which on a body is stiff.
   integer, parameter :: many = 5
   real(wp), parameter :: fair_share = 0.4_wp
   !> One interval.
   type :: interval_type
      integer :: edge = 0, blocks(2) = 0, joint = 0
      real(wp) :: length = 0
      logical :: is_part = .false.             !! one of both edges is longer than it
   end type interval_type

contains

   !> One warning for each joint material, and one of blocks that are tied too often.
   subroutine check_cell_joints(blocks, parameters, messages)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(diagnostics_type), intent(inout) :: messages
      type(interval_type), allocatable :: intervals(:)
      integer, allocatable :: n_ties(:)                  !! (edges)
      integer :: c, i, n, first
      real(wp) :: total, bad
      if (.not. (allocated(blocks%parent) .or. any(parameters%joint_materials%tie))) return
      call find_intervals(blocks, parameters, intervals, n, n_ties)
      call check_neighbours(blocks, parameters, n_ties, messages)
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

   !> Warn of blocks with many ties where they are a fair share of those that have any.
   subroutine check_neighbours(blocks, parameters, n_ties, messages)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      integer, intent(in) :: n_ties(:)                   !! (edges)
      type(diagnostics_type), intent(inout) :: messages
      logical :: stiff(blocks%n_blocks), tied(blocks%n_blocks)
      integer :: b, i
      do b = 1, blocks%n_blocks
         associate (ties => n_ties(blocks%vertex_offset(b) + 1:blocks%vertex_offset(b + 1)))
            tied(b) = any(ties > 0)
            ! two rows of such blocks have a free edge each: rectangles have four sides, and no more than three ties
            stiff(b) = (sum(ties) >= many - 1 .and. sum(max(ties, 1)) >= many) .or. any(ties > 1)
         end associate
      end do
      if (.not. count(stiff) > fair_share*count(tied)) return
      b = findloc(stiff, .true., dim=1)
      i = findloc(parameters%joint_materials%tie, .true., dim=1)
      associate (at => blocks%vertices(:, blocks%vertex_offset(b) + 1))
         call messages%add(severity%warning, to_string(count(stiff))//' of '//to_string(count(tied))// &
            ' blocks that are tied have '//to_string(many)//' or more ties, one less and a free edge, or several '// &
            'on one edge, as block '//to_string(b)//' at ('//to_string(at(1), 5)//', '//to_string(at(2), 5)// &
            '): such polygons hardly bend; bodies of them deflect by 36 % too little with 20 Voronoi cells, 10 % '// &
            'with 720, bricks in running bond by 8 to 75 %. Draw the body as one block and let &subdivide cut it '// &
            'into triangles or rectangles', &
            parameters%joint_materials(i)%origin)
      end associate
   end subroutine check_neighbours

   !> Intervals of joints with a tie or a tensile strength between cells of different blocks, and how many ties each
   !> edge has.
   subroutine find_intervals(blocks, parameters, intervals, n, n_ties)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(interval_type), allocatable, intent(out) :: intervals(:)
      integer, intent(out) :: n
      integer, allocatable, intent(out) :: n_ties(:)     !! (edges)
      type(box_pairs_work_type) :: work
      type(interval_type) :: one
      type(interval_type), allocatable :: longer(:)
      integer, allocatable :: pairs(:, :), n_cells(:)
      real(wp) :: stretch(2), tolerance
      integer :: a, b, k, l, n_pairs, p
      logical :: are_cells                               !! of different blocks
      allocate (intervals(16), n_ties(blocks%n_vertices()))
      n = 0
      n_ties = 0
      tolerance = max(blocks%edge_node_distance, 1.0e-9_wp*parameters%w0)
      if (allocated(blocks%parent)) then
         allocate (n_cells(maxval(blocks%parent)), source=0)
         do b = 1, size(blocks%parent)
            n_cells(blocks%parent(b)) = n_cells(blocks%parent(b)) + 1
         end do
      end if
      call find_box_pairs(boxes_of(blocks), tolerance, pairs, n_pairs, work)
      do p = 1, n_pairs
         a = pairs(1, p)
         b = pairs(2, p)
         are_cells = .false.
         if (allocated(blocks%parent)) then
            if (max(a, b) <= size(blocks%parent)) are_cells = blocks%parent(a) /= blocks%parent(b) .and. &
                                                              all(n_cells(blocks%parent([a, b])) > 1)
         end if
         do k = blocks%vertex_offset(a) + 1, blocks%vertex_offset(a + 1)
            do l = blocks%vertex_offset(b) + 1, blocks%vertex_offset(b + 1)
               one%joint = max(blocks%edge_joint(k), blocks%edge_joint(l))
               if (min(blocks%edge_joint(k), blocks%edge_joint(l)) < 1) cycle
               associate (material => parameters%joint_materials(one%joint))
                  if (.not. (material%tie .or. are_cells .and. (material%tension > 0 .or. material%cohesion > 0))) cycle
               end associate
               associate (v => blocks%vertices, to => [next_vertex(blocks, a, k), next_vertex(blocks, b, l)])
                  stretch = common_stretch(v(:, k), v(:, to(1)), v(:, l), v(:, to(2)), tolerance)
                  one%length = stretch(2) - stretch(1)
                  if (.not. one%length > 0) cycle
                  if (parameters%joint_materials(one%joint)%tie) n_ties([k, l]) = n_ties([k, l]) + 1
                  if (.not. are_cells) cycle
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
