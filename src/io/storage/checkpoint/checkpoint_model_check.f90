! SPDX-License-Identifier: MIT
!> Validate the model of a checkpoint: shapes, ranges of numbers and indices, finite values, consistency of its parts.
!>
!> The digest of a checkpoint finds damage but is no signature: a value is not trusted because the digest matches. The
!> procedures return the first problem, as "model/vertices has an unexpected shape", or ''. Each relies on the checks of
!> those before it: parameters, blocks, and then those of rockdda_io_checkpoint_state_check.
module rockdda_io_checkpoint_model_check
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : to_string
   use rockdda_model_analysis_input, only : joint_material_type
   use rockdda_model_bolt_numbers, only : bolt_problem
   use rockdda_model_blocks, only : block_system_type, point_set_type, largest_coordinate
   use rockdda_model_options, only : is_set
   use rockdda_model_parameters, only : parameters_type
   use rockdda_io_checkpoint_ground, only : check_ground, check_table
   use rockdda_base_value_check, only : value_check_type
   implicit none
   private
   public :: parameters_problem, blocks_problem

contains

   !> Numbers of the run, materials, loads, stages.
   function parameters_problem(p) result(problem)
      type(parameters_type), intent(in) :: p
      character(len=:), allocatable :: problem
      type(value_check_type) :: check
      integer :: i
      check%group = 'parameters'
      call check%is_there(allocated(p%title), 'title')
      call check%is_there(allocated(p%solver_method), 'method')
      call check%is_there(allocated(p%preconditioner), 'preconditioner')
      call check%is_there(allocated(p%block_materials), 'block_materials')
      call check%is_there(allocated(p%joint_materials), 'joint_materials')
      call check%is_there(allocated(p%line_loads), 'line_loads')
      call check%is_there(allocated(p%stages), 'stages')
      call check%is_there(allocated(p%boundaries), 'boundaries')
      call check%is_there(allocated(p%in_situ), 'in_situ')
      call check%is_there(allocated(p%changes), 'changes')
      call check%is_there(allocated(p%water), 'water')
      call check%is_there(allocated(p%quakes), 'quakes')
      call check%is_there(allocated(p%fixed_tables), 'fixed_table_rows')
      call check%is_there(allocated(p%loading_tables), 'loading_table_rows')
      if (allocated(p%bolts)) call check%holds(all([(len(bolt_problem(p%bolts(i))) == 0, i=1, size(p%bolts))]), 'bolts')
      call check%holds(p%n_steps >= 0, 'steps')
      call check%holds(p%t_end >= 0, 't_end')
      call check%holds(p%k01 >= 0 .and. p%k01 <= 1, 'k01')
      call check%holds(p%dt_max > 0 .and. p%dt_max <= huge(p%dt_max), 'dt_max')
      call check%holds(p%dt_min > 0 .and. p%dt_min <= p%dt_max, 'dt_min')
      call check%holds(p%cut_factor > 0 .and. p%cut_factor < 1, 'cut_factor')
      call check%holds(p%max_open_close >= 1 .and. p%max_open_close <= 1000, 'max_open_close')
      call check%holds(p%max_growth >= 1 .and. p%max_growth <= huge(1.0_wp), 'max_growth')
      call check%holds(p%sleep_tolerance > 0 .and. p%sleep_tolerance < 1, 'sleep_tolerance')
      call check%holds(p%displacement_ratio > 0 .and. p%displacement_ratio <= huge(1.0_wp), 'displacement_ratio')
      call check%holds(p%rho_infinity >= 0 .and. p%rho_infinity <= 1, 'rho_infinity')
      call check%holds(p%w0 > 0 .and. p%w0 <= largest_coordinate, 'w0')
      call check%holds(p%normal_stiffness > 0 .and. p%normal_stiffness <= huge(1.0_wp), 'stiffness')
      call check%holds(p%shear_stiffness > 0 .and. p%shear_stiffness <= huge(1.0_wp), 'shear_stiffness')
      call check%holds(p%stiffness_length >= 0 .and. p%stiffness_length <= huge(1.0_wp), 'stiffness_length')
      call check%holds(p%fixed_stiffness > 0 .and. p%fixed_stiffness <= huge(1.0_wp), 'fixed_stiffness')
      call check%holds(p%corner_radius >= 0 .and. p%corner_radius < 0.5_wp, 'corner_radius')
      call check%holds(p%search_distance >= 0 .and. p%search_distance <= huge(1.0_wp), 'search_distance')
      call check%holds(p%angle_tolerance >= 0 .and. p%angle_tolerance < 1.6_wp, 'angle_tolerance')
      call check%holds(p%close_tolerance >= 0 .and. p%close_tolerance <= p%w0, 'close_tolerance')
      call check%holds(p%open_tolerance >= 0 .and. p%open_tolerance <= p%w0, 'open_tolerance')
      call check%holds(p%mass_damping >= 0 .and. p%mass_damping <= huge(1.0_wp), 'mass_proportional')
      call check%holds(abs(p%gravity) <= huge(1.0_wp), 'gravity')
      call check%holds(abs(p%given_gravity) <= huge(1.0_wp), 'given_gravity')
      call check%is_finite(p%weight_direction, 'weight_direction')
      call check%holds(p%solver_tolerance > 0 .and. p%solver_tolerance < 1, 'tolerance')
      call check%holds(p%sor_factor >= 1 .and. p%sor_factor < 2, 'omega')
      call check_table(check, 'base_acceleration', 3, p%base%table)
      if (allocated(p%base%harmonics)) then
         call check%has_shape(size(p%base%harmonics, 1) == 5, 'harmonic')
         call check%is_finite(p%base%harmonics, 'harmonic')
      end if
      if (check%passed()) then
         call check_materials(check, p)
         call check_loads(check, p)
         call check_stages(check, p)
         call check_ground(check, p)
      end if
      problem = check%problem()
   end function parameters_problem

   !> Check block and joint materials, and laws of joints.
   subroutine check_materials(check, p)
      type(value_check_type), intent(inout) :: check
      type(parameters_type), intent(in) :: p
      integer :: i
      call check%holds(size(p%block_materials) >= 1, 'block_materials')
      call check%holds(size(p%joint_materials) >= 1, 'joint_materials')
      do i = 1, size(p%block_materials)
         associate (m => p%block_materials(i))
            call check%is_finite([m%density, m%weight, m%youngs_modulus, m%stress, m%stress_gradient, m%velocity], &
                                 'block_materials')
            call check%holds(m%density > 0 .and. m%youngs_modulus > 0 .and. m%poisson_ratio > -1 .and. &
                             m%poisson_ratio < 0.5_wp, 'block_materials')
         end associate
      end do
      do i = 1, size(p%joint_materials)
         call check%holds(all(p%joint_materials(i)%reduction > 0), 'joint_reductions')
         call check_joint(check, p%joint_materials(i), 'joint_material_'//to_string(i))
      end do
   end subroutine check_materials

   !> Check line loads, and tables of fixed and loading points.
   subroutine check_loads(check, p)
      type(value_check_type), intent(inout) :: check
      type(parameters_type), intent(in) :: p
      integer :: i
      do i = 1, size(p%line_loads)
         associate (load => p%line_loads(i), name => 'line_load_'//to_string(i))
            call check%holds(all(abs(load%ends) <= largest_coordinate), name//'_ends')
            call check%is_finite(load%force_start, name//'_force_start')
            call check%is_finite(load%force_end, name//'_force_end')
            call check_table(check, name//'_table', 2, load%table)
         end associate
      end do
      do i = 1, size(p%fixed_tables)
         call check_table(check, 'fixed_table_rows', 3, p%fixed_tables(i)%rows)
      end do
      do i = 1, size(p%loading_tables)
         call check_table(check, 'loading_table_rows', 3, p%loading_tables(i)%rows)
      end do
   end subroutine check_loads

   !> Check ends, k01 and weights of stages.
   subroutine check_stages(check, p)
      type(value_check_type), intent(inout) :: check
      type(parameters_type), intent(in) :: p
      integer :: i
      do i = 1, size(p%stages)
         associate (stage => p%stages(i), name => 'stage_'//to_string(i))
            call check%holds(.not. is_set(stage%until_step) .or. stage%until_step >= 0, name//'_until_step')
            call check%is_finite([stage%until_time], name//'_until_time')
            call check%is_finite([stage%k01], name//'_k01')
            call check%holds(.not. is_set(stage%k01) .or. (stage%k01 >= 0 .and. stage%k01 <= 1), name//'_k01')
            call check%is_finite([stage%gravity, stage%relax, stage%duration], name//'_gravity')
            call check%holds(stage%tolerance > 0 .and. stage%tolerance < 1, name//'_tolerance')
            call check%holds(stage%max_steps >= 1, name//'_max_steps')
            call check%holds(stage%relax_steps >= 1, name//'_relax_steps')
         end associate
      end do
   end subroutine check_stages

   !> Outlines, materials, points and bolts of blocks.
   function blocks_problem(blocks, p) result(problem)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: p          !! checked
      character(len=:), allocatable :: problem
      type(value_check_type) :: check
      integer :: nb, nv
      nb = blocks%n_blocks
      check%group = 'model'
      call check%is_there(allocated(blocks%vertex_offset), 'vertex_offset')
      call check%is_there(allocated(blocks%vertices), 'vertices')
      call check%is_there(allocated(blocks%edge_joint), 'edge_joint')
      call check%is_there(allocated(blocks%block_material), 'block_material')
      nv = 0
      if (check%passed()) then
         nv = size(blocks%edge_joint)
         call check%holds(nb >= 1, 'n_blocks')
         call check%has_shape(size(blocks%block_material) == nb, 'block_material')
         call check%has_shape(size(blocks%vertex_offset) - 1 == nb, 'vertex_offset')
         call check%has_shape(size(blocks%vertices, 1) == 2 .and. size(blocks%vertices, 2) >= nv, 'vertices')
      end if
      if (check%passed()) then
         call check%are_offsets(blocks%vertex_offset, nv, 3, 'vertex_offset')
         call check%holds(all(abs(blocks%vertices(:, 1:nv)) <= largest_coordinate), 'vertices')
         call check%in_range(blocks%edge_joint, 0, size(p%joint_materials), 'edge_joint')
         call check%in_range(blocks%block_material, 1, size(p%block_materials), 'block_material')
         if (allocated(blocks%file_line)) call check%has_shape(size(blocks%file_line) == nb, 'file_line')
         if (allocated(blocks%parent)) then
            call check%has_shape(size(blocks%parent) == nb, 'parent')
            call check%in_range(blocks%parent, 1, nb, 'parent')
         end if
      end if
      if (check%passed()) call check%holds(bridges_pair(blocks), 'edge_joint')
      call check_points(check, 'fixed', blocks%fixed, blocks%n_blocks)
      call check_points(check, 'loading', blocks%loading, blocks%n_blocks)
      call check_points(check, 'measured', blocks%measured, blocks%n_blocks)
      call check_bolts(check, blocks)
      check%group = 'parameters'
      call check%has_shape(size(p%fixed_tables) == blocks%fixed%n, 'fixed_table_offset')
      call check%has_shape(size(p%loading_tables) == blocks%loading%n, 'loading_table_offset')
      problem = check%problem()
   end function blocks_problem

   !> One joint material. Whether its values make a law is found when the run starts.
   subroutine check_joint(check, m, name)
      type(value_check_type), intent(inout) :: check
      type(joint_material_type), intent(in) :: m
      character(len=*), intent(in) :: name
      call check%is_there(allocated(m%law), name//'_law')
      call check%is_finite([m%cohesion, m%tension, m%normal_stiffness, m%shear_stiffness, m%damping_ratio], name)
      call check%is_finite([m%residual_friction, m%residual_cohesion, m%residual_tension, m%slip_length, m%slip_rate, &
                            m%jrc, m%jcs, m%dilation_slip, m%restitution, m%maximum_closure], name)
      if (allocated(m%parameters)) call check%is_finite(m%parameters, name//'_parameters')
      call check%holds(m%friction_angle >= 0 .and. m%friction_angle < 90, name//'_friction')
      call check%holds(m%cohesion >= 0, name//'_cohesion')
      call check%holds(m%tension >= 0, name//'_tension')
      call check%holds(m%normal_stiffness >= 0, name//'_normal_stiffness')
      call check%holds(m%shear_stiffness >= 0, name//'_shear_stiffness')
      call check%holds(m%dilation >= 0 .and. m%dilation < 90, name//'_dilation')
      call check%holds(m%damping_ratio >= 0, name//'_damping_ratio')
      call check%holds(m%restitution <= 1, name//'_restitution')
   end subroutine check_joint

   !> Is each bridge edge (joint 0) walked back exactly once in the same block?
   pure logical function bridges_pair(blocks)
      type(block_system_type), intent(in) :: blocks
      integer :: i, j, k, first, last, n
      bridges_pair = .true.
      do i = 1, blocks%n_blocks
         first = blocks%vertex_offset(i) + 1
         last = blocks%vertex_offset(i + 1)
         if (all(blocks%edge_joint(first:last) > 0)) cycle
         do k = first, last
            if (blocks%edge_joint(k) > 0) cycle
            n = 0
            do j = first, last
               if (j == k .or. blocks%edge_joint(j) > 0) cycle
               if (same(j, next(k)) .and. same(next(j), k)) n = n + 1
            end do
            if (n /= 1) bridges_pair = .false.
            if (n /= 1) return
         end do
      end do

   contains

      !> The vertex behind vertex m of block i.
      pure integer function next(m)
         integer, intent(in) :: m
         next = merge(first, m + 1, m == last)
      end function next

      !> Are two vertices in one place?
      pure logical function same(a, b)
         integer, intent(in) :: a, b
         same = .not. any(abs(blocks%vertices(:, a) - blocks%vertices(:, b)) > 0)
      end function same

   end function bridges_pair

   !> Check points on blocks.
   subroutine check_points(check, name, points, nb)
      type(value_check_type), intent(inout) :: check
      character(len=*), intent(in) :: name
      type(point_set_type), intent(in) :: points
      integer, intent(in) :: nb
      integer :: n
      n = points%n
      call check%holds(n >= 0, name//'_n')
      if (n == 0 .or. .not. check%passed()) return
      call check%is_there(allocated(points%position), name//'_position')
      call check%is_there(allocated(points%block), name//'_block')
      if (.not. check%passed()) return
      call check%has_shape(size(points%position, 1) == 2 .and. size(points%position, 2) >= n, name//'_position')
      call check%has_shape(size(points%block) >= n, name//'_block')
      if (.not. check%passed()) return
      call check%holds(all(abs(points%position(:, 1:n)) <= largest_coordinate), name//'_position')
      call check%in_range(points%block(1:n), 1, nb, name//'_block')
      if (.not. allocated(points%number)) return
      call check%has_shape(size(points%number) >= n, name//'_number')
      if (check%passed()) call check%are_increasing(points%number(1:n), 1, name//'_number')
   end subroutine check_points

   !> Check bolts between blocks, or a block and the fixed outside.
   subroutine check_bolts(check, blocks)
      type(value_check_type), intent(inout) :: check
      type(block_system_type), intent(in) :: blocks
      integer :: n
      associate (bolts => blocks%bolts)
         n = bolts%n
         call check%holds(n >= 0, 'bolt_n')
         if (n == 0 .or. .not. check%passed()) return
         call check%is_there(allocated(bolts%ends), 'bolt_ends')
         call check%is_there(allocated(bolts%blocks), 'bolt_blocks')
         call check%is_there(allocated(bolts%stiffness), 'bolt_stiffness')
         call check%is_there(allocated(bolts%pretension), 'bolt_pretension')
         call check%is_there(allocated(bolts%strength), 'bolt_strength')
         if (.not. check%passed()) return
         call check%has_shape(size(bolts%ends, 1) == 4 .and. size(bolts%ends, 2) >= n, 'bolt_ends')
         call check%has_shape(size(bolts%blocks, 1) == 2 .and. size(bolts%blocks, 2) >= n, 'bolt_blocks')
         call check%has_shape(size(bolts%stiffness) >= n, 'bolt_stiffness')
         call check%has_shape(size(bolts%pretension) >= n, 'bolt_pretension')
         call check%has_shape(size(bolts%strength) >= n, 'bolt_strength')
         if (.not. check%passed()) return
         call check%holds(all(abs(bolts%ends(:, 1:n)) <= largest_coordinate), 'bolt_ends')
         call check%in_range(reshape(bolts%blocks(:, 1:n), [2*n]), 0, blocks%n_blocks, 'bolt_blocks')
         call check%is_finite(bolts%stiffness(1:n), 'bolt_stiffness')
         call check%holds(all(bolts%stiffness(1:n) > 0), 'bolt_stiffness')
         call check%is_finite(bolts%pretension(1:n), 'bolt_pretension')
         call check%is_finite(bolts%strength(1:n), 'bolt_strength')
         call check%holds(all(bolts%strength(1:n) >= 0), 'bolt_strength')
      end associate
   end subroutine check_bolts

end module rockdda_io_checkpoint_model_check
