! SPDX-License-Identifier: MIT
!> Fixed points and points with a prescribed movement: two equal springs to a target.
!>
!> The springs are those of rockdda_interaction_point_springs; the target of a fixed point is zero.
module rockdda_interaction_supports
   use rockdda_base_kinds, only : wp
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_state, only : energy
   use rockdda_interaction_attempt, only : attempt_type
   use rockdda_interaction_balance, only : energy_balance_type
   use rockdda_interaction_block_forces, only : block_forces_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_equations, only : equations_type
   use rockdda_interaction_finite_rotation, only : mean_displacement
   use rockdda_interaction_interaction, only : interaction_type
   use rockdda_interaction_point_springs, only : add_point_spring, measure_point, spring_step_energy, &
      support_stiffness
   use rockdda_interaction_time_tables, only : table_value
   use rockdda_linear_small_blocks, only : pack_lower, unpack_lower
   implicit none
   private
   public :: supports_type

   !> All fixed points.
   type, extends(interaction_type) :: supports_type
      real(wp), allocatable :: target_start(:, :)  !! (2, nf) prescribed displacement at the step's start
      real(wp), allocatable :: target_end(:, :)    !! (2, nf) and at its end
      real(wp), allocatable :: force(:, :)         !! (2, nf) on the blocks, of the last accepted step
      real(wp), allocatable :: stiffness(:)        !! (nf) of the springs [force/length]
   contains
      procedure :: init
      procedure :: place
      procedure :: measure_placement
      procedure :: add_energies
      procedure :: commit
      procedure :: add_forces
   end type supports_type

contains

   !> Room for all fixed points, and their stiffness.
   pure subroutine init(self, blocks, parameters)
      class(supports_type), intent(inout) :: self
      type(block_system_type), intent(in) :: blocks      !! at the start
      type(parameters_type), intent(in) :: parameters
      integer :: n_fixed, p
      n_fixed = blocks%fixed%n
      if (allocated(self%force)) deallocate (self%target_start, self%target_end, self%force, self%stiffness)
      allocate (self%target_start(2, n_fixed), self%target_end(2, n_fixed), self%force(2, n_fixed), source=0.0_wp)
      allocate (self%stiffness(n_fixed))
      do p = 1, n_fixed
         self%stiffness(p) = support_stiffness(blocks, parameters, blocks%fixed%block(p))
      end do
   end subroutine init

   !> Prescribed displacement of a fixed point at a time: of its table, and of the ground by records.
   pure function fixed_target(context, attempt, point, t) result(target)
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      integer, intent(in) :: point
      real(wp), intent(in) :: t   !! [time]
      real(wp) :: target(2)       !! [length]
      target = context%ground_motion%displacement('base_motion', t - attempt%motion_start)
      associate (table => context%parameters%fixed_tables(point))
         if (.not. allocated(table%rows)) return
         if (size(table%rows, 2) > 0) target = target + table_value(table%rows, t)
      end associate
   end function fixed_target

   !> Springs of all points that are not released.
   subroutine place(self, context, attempt, equations)
      class(supports_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(equations_type), intent(inout) :: equations
      real(wp) :: before(6), moved(2), target(2), k(6, 6)
      integer :: p, b
      do p = 1, context%blocks%fixed%n
         self%target_start(:, p) = fixed_target(context, attempt, p, context%state%time)
         self%target_end(:, p) = fixed_target(context, attempt, p, context%state%time + attempt%dt)
         if (attempt%released(p)) cycle
         b = context%blocks%fixed%block(p)
         before = equations%block_load(:, b)
         moved = context%state%fixed_position(:, p) - context%blocks%fixed%position(:, p)
         target = self%target_end(:, p)
         if (attempt%scheme%level < 1) target = self%target_start(:, p) + &
                                                attempt%scheme%level*(target - self%target_start(:, p))
         call unpack_lower(equations%block_matrix(:, b), k)
         call add_point_spring(self%stiffness(p), context%state%fixed_position(:, p), attempt%moving(b), moved, &
                               target, k, equations%block_load(:, b), attempt%scheme%level)
         call pack_lower(k, equations%block_matrix(:, b))
         equations%block_magnitude(:, b) = equations%block_magnitude(:, b) + abs(equations%block_load(:, b) - before)
      end do
   end subroutine place

   !> Stretch of the springs of a point at the start of a step and at its end, with its target there.
   pure subroutine support_stretch(self, point, context, attempt, d, x0, x1)
      class(supports_type), intent(in) :: self
      integer, intent(in) :: point
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      real(wp), intent(in), contiguous :: d(:, :)   !! (6, nb) unknowns of the step
      real(wp), intent(out) :: x0(2), x1(2)         !! [length]
      integer :: b
      b = context%blocks%fixed%block(point)
      x0 = context%state%fixed_position(:, point) - context%blocks%fixed%position(:, point) - &
           self%target_start(:, point)
      x1 = x0 + mean_displacement(d(:, b), context%state%fixed_position(:, point), attempt%moving(b)) &
           - (self%target_end(:, point) - self%target_start(:, point))
   end subroutine support_stretch

   !> Displacements of points that the expected motion gives otherwise than the solution.
   subroutine measure_placement(self, context, attempt, equations)
      class(supports_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(equations_type), intent(inout) :: equations
      integer :: p
      do p = 1, context%blocks%fixed%n
         if (attempt%released(p)) cycle
         call measure_point(attempt, self%stiffness(p), context%state%fixed_position(:, p), &
                            context%blocks%fixed%block(p), equations)
      end do
   end subroutine measure_placement

   !> Springs and work of prescribed movements.
   subroutine add_energies(self, context, attempt, d, balance)
      class(supports_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      real(wp), intent(in), contiguous :: d(:, :)
      class(energy_balance_type), intent(inout) :: balance
      real(wp) :: x0(2), x1(2), pulled(2), stored, lost, external, start_energy
      integer :: p
      do p = 1, context%blocks%fixed%n
         if (attempt%released(p)) then
            ! the energy of its spring is lost when it is let go
            call balance%add(energy%discarded, balance%fixed_energy(p))
            balance%fixed_energy(p) = 0
            cycle
         end if
         call support_stretch(self, p, context, attempt, d, x0, x1)
         pulled = self%target_end(:, p) - self%target_start(:, p)
         call spring_step_energy(self%stiffness(p), x0, x1, pulled, stored, lost, external, attempt%scheme%level)
         start_energy = 0.5_wp*self%stiffness(p)*(x0(1)**2 + x0(2)**2)
         call balance%add(energy%geometry, start_energy - balance%fixed_energy(p))
         balance%fixed_energy(p) = start_energy + stored
         call balance%add(energy%dissipated, lost)
         call balance%add(energy%external, external)
      end do
   end subroutine add_energies

   !> Support forces at the end of the step.
   subroutine commit(self, context, attempt, d)
      class(supports_type), intent(inout) :: self
      type(step_context_type), intent(inout) :: context
      type(attempt_type), intent(inout) :: attempt
      real(wp), intent(in), contiguous :: d(:, :)
      real(wp) :: x0(2), x1(2)
      integer :: p
      self%force = 0
      do p = 1, context%blocks%fixed%n
         if (attempt%released(p)) cycle
         call support_stretch(self, p, context, attempt, d, x0, x1)
         self%force(:, p) = -self%stiffness(p)*x1
      end do
   end subroutine commit

   !> Support forces, and which blocks they hold.
   subroutine add_forces(self, context, attempt, forces)
      class(supports_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(block_forces_type), intent(inout) :: forces
      real(wp) :: arm(2)
      integer :: b, p
      do p = 1, context%blocks%fixed%n
         if (attempt%released(p)) cycle
         b = context%blocks%fixed%block(p)
         arm = context%state%fixed_position(:, p) - context%state%centroid(:, b)
         call forces%add_force(b, self%force(:, p), arm)
         forces%held(b) = forces%held(b) + 1
         if (any(abs(self%target_end(:, p) - self%target_start(:, p)) > 0)) forces%driven = .true.
      end do
   end subroutine add_forces

end module rockdda_interaction_supports
