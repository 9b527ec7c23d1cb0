! SPDX-License-Identifier: MIT
!> Block terms of a step: everything in K and f that belongs to one block alone.
!>
!> Inertia, elasticity, initial stress, weight, base motion, mass damping, point loads, line loads, fixed points
!> (docs/theory.md, "Submatrices"). Loads from tables are taken at the end of the step; the base acceleration is
!> taken in the middle of the step, where a constant acceleration over the step gives the velocity to second order.
module rockdda_stepping_loads
   use rockdda_base_kinds, only : wp
   use rockdda_base_parallel, only : parallel_blocks
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_base_strings, only : to_string
   use rockdda_geometry_polygons, only : distance_to_outline
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_state, only : block_state_type
   use rockdda_interaction_kinematics, only : mass_matrix, point_load, displacement_at
   use rockdda_interaction_elastic, only : elasticity, compliance, add_elastic, add_stress
   use rockdda_interaction_inertia, only : add_inertia, add_mass_damping
   use rockdda_interaction_loads, only : body_force, line_load, table_value, load_factor, base_acceleration
   use rockdda_interaction_points, only : add_point_spring
   implicit none
   private
   public :: material_matrices_type, step_loads_type, new_material_matrices, set_block_terms, &
      attach_line_loads, support_stretch, support_forces

   !> Elasticity of the block materials.
   type :: material_matrices_type
      real(wp), allocatable :: e(:, :, :)   !! (3, 3, materials)
      real(wp), allocatable :: c(:, :, :)   !! (3, 3, materials) inverse of e
   end type material_matrices_type

   !> Loads of one attempt, kept apart for the ledger.
   type :: step_loads_type
      real(wp), allocatable :: weight(:, :)        !! (6, nb) gravity
      real(wp), allocatable :: external(:, :)      !! (6, nb) point loads, line loads, base motion
      real(wp), allocatable :: target_start(:, :)  !! (2, nf) prescribed displacement at the step's start
      real(wp), allocatable :: target_end(:, :)    !! (2, nf) and at its end
   end type step_loads_type

contains

   !> Elasticity and compliance of all block materials.
   pure subroutine new_material_matrices(parameters, matrices)
      type(parameters_type), intent(in) :: parameters
      type(material_matrices_type), intent(out) :: matrices
      integer :: i, n
      n = size(parameters%block_materials)
      allocate (matrices%e(3, 3, n), matrices%c(3, 3, n))
      do i = 1, n
         associate (m => parameters%block_materials(i))
            matrices%e(:, :, i) = elasticity(m%youngs_modulus, m%poisson_ratio, parameters%plane_strain)
            matrices%c(:, :, i) = compliance(m%youngs_modulus, m%poisson_ratio, parameters%plane_strain)
         end associate
      end do
   end subroutine new_material_matrices

   !> Prescribed displacement of a fixed point at a time; zero without a table.
   pure function fixed_target(parameters, point, t) result(target)
      type(parameters_type), intent(in) :: parameters
      integer, intent(in) :: point
      real(wp), intent(in) :: t
      real(wp) :: target(2)
      target = 0
      if (.not. allocated(parameters%fixed_tables(point)%rows)) return
      if (size(parameters%fixed_tables(point)%rows, 2) == 0) return
      target = table_value(parameters%fixed_tables(point)%rows, t)
   end function fixed_target

   !> Stiffness and load of every block for a step of length dt from the given state.
   subroutine set_block_terms(blocks, parameters, matrices, state, released, line_blocks, line_ends, &
                                   gravity_factor, dt, loads, k, f, magnitude)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(material_matrices_type), intent(in) :: matrices
      type(block_state_type), intent(in) :: state
      logical, intent(in) :: released(:)          !! (nf) fixed points that were let go
      integer, intent(in) :: line_blocks(:)       !! block of each line load
      real(wp), intent(in) :: line_ends(:, :)     !! (4, line loads) where they are now
      real(wp), intent(in) :: gravity_factor      !! of the present stage
      real(wp), intent(in) :: dt                  !! [time]
      type(step_loads_type), intent(inout) :: loads
      real(wp), intent(inout) :: k(:, :, :)       !! (6, 6, nb)
      real(wp), intent(inout) :: f(:, :)          !! (6, nb)
      real(wp), intent(inout) :: magnitude(:, :)  !! (6, nb) of the contributions to f, summed up
      real(wp) :: m(6, 6), before(6), base(2), force(2), moved(2), factor, t_end, gravity
      integer :: i, p, b, material

      t_end = state%time + dt
      base = -base_acceleration(parameters%base, state%time + 0.5_wp*dt)
      if (.not. allocated(loads%weight)) allocate (loads%weight(6, blocks%n_blocks), &
         loads%external(6, blocks%n_blocks), loads%target_start(2, blocks%fixed%n), loads%target_end(2, blocks%fixed%n))
      !$omp parallel do default(none) private(i, material, gravity, m) schedule(static) &
      !$omp shared(blocks, parameters, matrices, state, gravity_factor, dt, loads, k, f, magnitude, base) &
      !$omp if (blocks%n_blocks > parallel_blocks)
      do i = 1, blocks%n_blocks
         material = blocks%block_material(i)
         associate (mat => parameters%block_materials(material))
            gravity = mat%weight/mat%density
            if (parameters%gravity >= 0) gravity = parameters%gravity
            m = mass_matrix(state%mass(i), state%area(i), state%moments(:, i))
            k(:, :, i) = 0
            f(:, i) = 0
            call add_inertia(m, state%velocity(:, i), dt, k(:, :, i), f(:, i))
            call add_elastic(matrices%e(:, :, material), state%area(i), k(:, :, i))
            magnitude(:, i) = abs(f(:, i))
            call add_stress(state%stress(:, i), state%area(i), f(:, i))
            magnitude(4:6, i) = magnitude(4:6, i) + state%area(i)*abs(state%stress(:, i))
            if (parameters%mass_damping > 0) call add_mass_damping(parameters%mass_damping, m, dt, k(:, :, i))
            loads%weight(:, i) = body_force(state%mass(i), [0.0_wp, -gravity*gravity_factor])
            loads%external(:, i) = body_force(state%mass(i), base)
         end associate
      end do
      !$omp end parallel do
      do p = 1, blocks%loading%n
         if (.not. allocated(parameters%loading_tables(p)%rows)) cycle
         if (size(parameters%loading_tables(p)%rows, 2) == 0) cycle
         b = blocks%loading%block(p)
         force = table_value(parameters%loading_tables(p)%rows, t_end)
         loads%external(:, b) = loads%external(:, b) + point_load(force, state%loading_position(:, p), &
                                                                  state%centroid(:, b))
      end do
      do p = 1, size(line_blocks)
         b = line_blocks(p)
         factor = load_factor(parameters%line_loads(p)%table, t_end)
         loads%external(:, b) = loads%external(:, b) + line_load(line_ends(1:2, p), line_ends(3:4, p), &
            state%centroid(:, b), factor*parameters%line_loads(p)%force_start, &
            factor*parameters%line_loads(p)%force_end)
      end do
      !$omp parallel do default(none) shared(blocks, loads, f, magnitude) private(i) schedule(static) &
      !$omp if (blocks%n_blocks > parallel_blocks)
      do i = 1, blocks%n_blocks
         f(:, i) = f(:, i) + loads%weight(:, i) + loads%external(:, i)
         magnitude(:, i) = magnitude(:, i) + abs(loads%weight(:, i)) + abs(loads%external(:, i))
      end do
      !$omp end parallel do
      do p = 1, blocks%fixed%n
         loads%target_start(:, p) = fixed_target(parameters, p, state%time)
         loads%target_end(:, p) = fixed_target(parameters, p, t_end)
         if (released(p)) cycle
         b = blocks%fixed%block(p)
         before = f(:, b)
         moved = state%fixed_position(:, p) - blocks%fixed%position(:, p)
         call add_point_spring(parameters%fixed_stiffness, state%fixed_position(:, p), state%centroid(:, b), moved, &
                               loads%target_end(:, p), k(:, :, b), f(:, b))
         magnitude(:, b) = magnitude(:, b) + abs(f(:, b) - before)
      end do
   end subroutine set_block_terms

   !> Stretch of the springs of a fixed point at the start of a step and at its end, with its target there.
   pure subroutine support_stretch(point, blocks, state, loads, d, x0, x1)
      integer, intent(in) :: point
      type(block_system_type), intent(in) :: blocks
      type(block_state_type), intent(in) :: state   !! at the start of the step
      type(step_loads_type), intent(in) :: loads
      real(wp), intent(in) :: d(:, :)               !! (6, nb) unknowns of the step
      real(wp), intent(out) :: x0(2), x1(2)         !! [length]
      integer :: b
      b = blocks%fixed%block(point)
      x0 = state%fixed_position(:, point) - blocks%fixed%position(:, point) - loads%target_start(:, point)
      x1 = x0 + displacement_at(d(:, b), state%fixed_position(:, point), state%centroid(:, b)) &
           - (loads%target_end(:, point) - loads%target_start(:, point))
   end subroutine support_stretch

   !> Forces of all fixed points on their blocks at the end of a step.
   pure subroutine support_forces(blocks, stiffness, state, loads, released, d, force)
      type(block_system_type), intent(in) :: blocks
      real(wp), intent(in) :: stiffness             !! [force/length]
      type(block_state_type), intent(in) :: state   !! at the start of the step
      type(step_loads_type), intent(in) :: loads
      logical, intent(in) :: released(:)            !! (nf)
      real(wp), intent(in) :: d(:, :)               !! (6, nb) unknowns of the step
      real(wp), intent(out) :: force(:, :)          !! (2, nf)
      real(wp) :: x0(2), x1(2)
      integer :: p
      force = 0
      do p = 1, blocks%fixed%n
         if (released(p)) cycle
         call support_stretch(p, blocks, state, loads, d, x0, x1)
         force(:, p) = -stiffness*x1
      end do
   end subroutine support_forces

   !> Find the block that carries each line load: both ends within e0 of its outline.
   subroutine attach_line_loads(blocks, parameters, line_blocks, line_ends, messages)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      integer, allocatable, intent(out) :: line_blocks(:)   !! (line loads)
      real(wp), allocatable, intent(out) :: line_ends(:, :) !! (4, line loads) where they are now
      type(diagnostics_type), intent(inout) :: messages
      real(wp) :: tolerance
      integer :: l, i, first, last, n
      n = size(parameters%line_loads)
      allocate (line_ends(4, n), line_blocks(n))
      tolerance = max(blocks%edge_node_distance, 1.0e-9_wp*parameters%w0)
      do l = 1, n
         line_ends(:, l) = parameters%line_loads(l)%ends
         line_blocks(l) = 0
         do i = 1, blocks%n_blocks
            first = blocks%vertex_offset(i) + 1
            last = blocks%vertex_offset(i + 1)
            if (distance_to_outline(line_ends(1:2, l), blocks%vertices(:, first:last)) > tolerance) cycle
            if (distance_to_outline(line_ends(3:4, l), blocks%vertices(:, first:last)) > tolerance) cycle
            line_blocks(l) = i
            exit
         end do
         if (line_blocks(l) == 0) call messages%add(severity%error, 'line load '//to_string(l)// &
            ': no block has both ends ('//to_string(line_ends(1, l))//', '//to_string(line_ends(2, l))//') and ('// &
            to_string(line_ends(3, l))//', '//to_string(line_ends(4, l))//') on its outline', &
            parameters%line_loads(l)%origin)
      end do
   end subroutine attach_line_loads

end module rockdda_stepping_loads
