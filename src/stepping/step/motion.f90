! SPDX-License-Identifier: MIT
!> Blocks at the start of a run, their motion at the end of an accepted step, and their energy.
module rockdda_stepping_motion
   use, intrinsic :: ieee_arithmetic, only : ieee_value, ieee_positive_inf
   use rockdda_base_kinds, only : wp
   use rockdda_base_parallel, only : parallel_blocks
   use rockdda_geometry_polygons, only : polygon_properties
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_in_situ, only : initial_stress_type, find_initial_stress
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_state, only : block_state_type, step_record_type
   use rockdda_interaction_kinematics, only : mass_times, move_points, move_point, rotate_stress, rotate_strain_rate, &
      displacement_at, logarithmic_strain
   use rockdda_interaction_elasticity, only : elasticity_type, stress_of, strain_energy
   use rockdda_interaction_inertia, only : new_velocity
   use rockdda_interaction_time_scheme, only : time_scheme_type
   implicit none
   private
   public :: reset_measured, start_state, move_blocks, measure_points, largest_displacement, is_finite_motion, &
      block_energies

contains

   !> State at time 0: positions of the model, initial stresses at the centroids and velocities.
   pure subroutine start_state(blocks, parameters, state, field)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(block_state_type), intent(out) :: state
      type(initial_stress_type), intent(out), optional :: field   !! of the stress
      type(initial_stress_type) :: stress
      integer :: i, nb
      nb = blocks%n_blocks
      state%step = 0
      state%time = 0
      state%vertices = blocks%vertices
      call find_initial_stress(blocks, parameters, stress)
      allocate (state%centroid(2, nb), state%rotation(nb), state%velocity(6, nb), state%area(nb), &
                state%moments(3, nb), state%mass(nb))
      allocate (state%active(nb), source=.true.)
      allocate (state%asleep(nb), source=.false.)
      allocate (state%calm(nb), source=0)
      allocate (state%acceleration(6, nb), source=0.0_wp)
      allocate (state%quiet_force(0))
      do i = 1, nb
         associate (m => parameters%block_materials(blocks%block_material(i)))
            call polygon_properties(blocks%vertices(:, blocks%vertex_offset(i) + 1:blocks%vertex_offset(i + 1)), &
                                    state%area(i), state%centroid(:, i), state%moments(:, i))
            state%mass(i) = m%density*state%area(i)
            state%rotation(i) = 0
            state%velocity(:, i) = [m%velocity, 0.0_wp, 0.0_wp, 0.0_wp]
         end associate
      end do
      state%stress = stress%stress
      if (present(field)) field = stress
      state%fixed_position = points_or_none(blocks%fixed%n, blocks%fixed%position)
      state%loading_position = points_or_none(blocks%loading%n, blocks%loading%position)
      state%measured_position = points_or_none(blocks%measured%n, blocks%measured%position)
      allocate (state%measured_from(3, blocks%measured%n), source=0.0_wp)
      if (blocks%measured%n > 0) state%measured_from(1:2, :) = state%measured_position
      allocate (state%bolt_ends(4, blocks%bolts%n), state%bolt_elongation(blocks%bolts%n), &
                state%bolt_plastic(blocks%bolts%n), source=0.0_wp)
      if (blocks%bolts%n > 0) state%bolt_ends = blocks%bolts%ends(:, 1:blocks%bolts%n)
   end subroutine start_state

   !> A copy of the first n points; the array may not be allocated when there are none.
   pure function points_or_none(n, position) result(copy)
      integer, intent(in) :: n
      real(wp), allocatable, intent(in) :: position(:, :)
      real(wp) :: copy(2, n)
      if (n > 0) copy = position(:, 1:n)
   end function points_or_none

   !> Largest displacement T d of any vertex; infinite when one is not a number.
   real(wp) function largest_displacement(blocks, state, d) result(largest)
      type(block_system_type), intent(in) :: blocks
      type(block_state_type), intent(in) :: state
      real(wp), intent(in) :: d(:, :)    !! (6, nb)
      real(wp) :: u(2), square
      integer :: i, v, n_bad
      largest = 0
      n_bad = 0
      !$omp parallel do default(none) shared(blocks, state, d) private(i, v, u, square) &
      !$omp reduction(max:largest) reduction(+:n_bad) schedule(static) if (blocks%n_blocks > parallel_blocks)
      do i = 1, blocks%n_blocks
         do v = blocks%vertex_offset(i) + 1, blocks%vertex_offset(i + 1)
            u = displacement_at(d(:, i), state%vertices(:, v), state%centroid(:, i))
            square = u(1)**2 + u(2)**2
            if (.not. square <= huge(square)) n_bad = n_bad + 1
            largest = max(largest, square)
         end do
      end do
      !$omp end parallel do
      largest = sqrt(largest)
      if (n_bad > 0) largest = ieee_value(largest, ieee_positive_inf)
   end function largest_displacement

   !> Are all unknowns finite?
   logical function is_finite_motion(d)
      real(wp), intent(in), contiguous :: d(:, :)   !! (6, nb)
      integer :: i, n_bad
      n_bad = 0
      !$omp parallel do default(none) shared(d) private(i) reduction(+:n_bad) schedule(static) &
      !$omp if (size(d, 2) > parallel_blocks)
      do i = 1, size(d, 2)
         ! a sum of magnitudes that cannot overflow
         if (.not. sum(0.125_wp*abs(d(:, i))) <= huge(1.0_wp)) n_bad = n_bad + 1
      end do
      !$omp end parallel do
      is_finite_motion = n_bad == 0
   end function is_finite_motion

   !> Move everything by the unknowns of an accepted step; stresses, velocities, area and moments follow.
   !>
   !> Velocity: v = (2/dt) d - v_old. With exact rotation its strain rates turn with the block, and the spin is
   !> scaled so that the angular momentum about the centroid, (M v)_3, survives the change of the moments of inertia
   !> by strain. `velocity` is the full new velocity; the caller applies k01. With a scheme of second order the
   !> acceleration follows, too.
   subroutine move_blocks(blocks, parameters, elasticity, dt, d, state, scheme, jump)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(elasticity_type), intent(in) :: elasticity
      real(wp), intent(in) :: dt   !! step [time]
      real(wp), intent(in) :: d(:, :)    !! (6, nb)
      type(block_state_type), intent(inout) :: state
      type(time_scheme_type), intent(in), optional :: scheme   !! of second order; absent: Shi's
      real(wp), intent(in), optional :: jump(:, :)             !! (6, nb) of velocities, with the scheme
      real(wp) :: momentum(6), v(6), a(6), strain(3), spin, polar
      integer :: i, p, first, last, side, b
      logical :: exact, carries
      carries = present(scheme) .and. present(jump)
      exact = parameters%exact_rotation
      do p = 1, blocks%fixed%n
         call move_point(d(:, blocks%fixed%block(p)), state%centroid(:, blocks%fixed%block(p)), exact, &
                         state%fixed_position(:, p))
      end do
      do p = 1, blocks%loading%n
         call move_point(d(:, blocks%loading%block(p)), state%centroid(:, blocks%loading%block(p)), exact, &
                         state%loading_position(:, p))
      end do
      do p = 1, blocks%measured%n
         b = blocks%measured%block(p)
         if (b < 1) cycle
         call move_point(d(:, b), state%centroid(:, b), exact, state%measured_position(:, p))
      end do
      do p = 1, blocks%bolts%n
         do side = 1, 2
            b = blocks%bolts%blocks(side, p)
            if (b > 0) call move_point(d(:, b), state%centroid(:, b), exact, state%bolt_ends(2*side - 1:2*side, p))
         end do
         state%bolt_elongation(p) = norm2(state%bolt_ends(3:4, p) - state%bolt_ends(1:2, p)) &
                                    - norm2(blocks%bolts%ends(3:4, p) - blocks%bolts%ends(1:2, p))
      end do
      !$omp parallel do default(none) shared(blocks, parameters, elasticity, dt, d, state, exact, carries) &
      !$omp shared(scheme, jump) private(i, first, last, momentum, v, a, strain, spin, polar) &
      !$omp schedule(static) &
      !$omp if (blocks%n_blocks > parallel_blocks)
      do i = 1, blocks%n_blocks
         if (state%asleep(i)) cycle
         first = blocks%vertex_offset(i) + 1
         last = blocks%vertex_offset(i + 1)
         if (carries) then
            a = scheme%new_acceleration(d(:, i), state%velocity(:, i), state%acceleration(:, i), jump(:, i), dt)
            v = state%velocity(:, i) + scheme%velocity_change(state%acceleration(:, i), a, jump(:, i), dt)
            if (exact) a(4:6) = rotate_strain_rate(a(4:6), d(3, i))
            state%acceleration(:, i) = a
         else
            v = new_velocity(d(:, i), state%velocity(:, i), dt)
         end if
         momentum = mass_times(state%mass(i), state%area(i), state%moments(:, i), v)
         spin = momentum(3)
         call move_points(d(:, i), state%centroid(:, i), exact, state%vertices(:, first:last))
         call polygon_properties(state%vertices(:, first:last), state%area(i), state%centroid(:, i), &
                                 state%moments(:, i))
         state%rotation(i) = state%rotation(i) + d(3, i)
         strain = d(4:6, i)
         if (exact) strain = logarithmic_strain(strain)
         state%stress(:, i) = state%stress(:, i) + stress_of(elasticity%e(:, :, blocks%block_material(i)), strain)
         if (parameters%mass_from_area) state%mass(i) = &
            parameters%block_materials(blocks%block_material(i))%density*state%area(i)
         if (exact) then
            state%stress(:, i) = rotate_stress(state%stress(:, i), d(3, i))
            v(4:6) = rotate_strain_rate(v(4:6), d(3, i))
            v(3) = 0
            momentum = mass_times(state%mass(i), state%area(i), state%moments(:, i), v)
            polar = state%mass(i)*(state%moments(1, i) + state%moments(2, i))/state%area(i)
            v(3) = (spin - momentum(3))/polar
         end if
         state%velocity(:, i) = v
      end do
      !$omp end parallel do
   end subroutine move_blocks

   !> Strain and kinetic energy of each block.
   pure function block_energies(blocks, elasticity, state) result(energies)
      type(block_system_type), intent(in) :: blocks
      type(elasticity_type), intent(in) :: elasticity
      type(block_state_type), intent(in) :: state
      real(wp) :: energies(blocks%n_blocks)
      integer :: i
      associate (s => state)
         do i = 1, size(energies)
            energies(i) = strain_energy(s%stress(:, i), elasticity%c(:, :, blocks%block_material(i)), s%area(i)) &
                          + 0.5_wp*dot_product(s%velocity(:, i), mass_times(s%mass(i), s%area(i), s%moments(:, i), &
                                                                            s%velocity(:, i)))
         end do
      end associate
   end function block_energies

   !> Measured displacements and rotations count from now on.
   pure subroutine reset_measured(blocks, state)
      type(block_system_type), intent(in) :: blocks
      type(block_state_type), intent(inout) :: state
      integer :: p, b
      do p = 1, blocks%measured%n
         b = blocks%measured%block(p)
         state%measured_from(1:2, p) = state%measured_position(:, p)
         if (b > 0) state%measured_from(3, p) = state%rotation(b)
      end do
   end subroutine reset_measured

   !> Displacement, stress and rotation at the measured points.
   pure subroutine measure_points(blocks, state, record)
      type(block_system_type), intent(in) :: blocks
      type(block_state_type), intent(in) :: state
      type(step_record_type), intent(inout) :: record
      integer :: p, b
      do p = 1, blocks%measured%n
         b = blocks%measured%block(p)
         if (b < 1) cycle
         record%measured_displacement(:, p) = state%measured_position(:, p) - state%measured_from(1:2, p)
         record%measured_stress(:, p) = state%stress(:, b)
         record%measured_rotation(p) = state%rotation(b) - state%measured_from(3, p)
      end do
   end subroutine measure_points

end module rockdda_stepping_motion
