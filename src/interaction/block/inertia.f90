! SPDX-License-Identifier: MIT
!> Inertia and mass-proportional damping of one block.
!>
!> Source: thesis Eqs. 3.10.3, 3.10.4 and 3.23, Newmark with beta = 1/2, gamma = 1: the acceleration is constant
!> in the step,
!>
!>     d = v0 dt + a dt**2/2,   v1 = 2/dt d - v0,
!>
!> and the inertia force is M a = 2/dt**2 M d - 2/dt M v0. Its work in a step is the change of the kinetic
!> energy: d.M(v1 - v0)/dt = 1/2 v1.M v1 - 1/2 v0.M v0.
!>
!> A static step has no v0, and its inertia, a damper, may take the acceleration a0 of the last step into account
!> (rockdda_stepping_control, carry):
!>
!>     M (a + c (a - a0)),   a = 2/dt**2 d.
!>
!> Not here: M itself (rockdda_interaction_kinematics), the share k01 of v1 that the next step starts with.
module rockdda_interaction_inertia
   use rockdda_base_kinds, only : wp
   use rockdda_base_parallel, only : parallel_blocks, piece, n_pieces
   use rockdda_model_state, only : energy
   use rockdda_interaction_attempt, only : attempt_type
   use rockdda_interaction_balance, only : energy_balance_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_equations, only : equations_type
   use rockdda_interaction_interaction, only : interaction_type
   use rockdda_interaction_kinematics, only : mass_matrix
   use rockdda_linear_small_blocks, only : pack_lower, unpack_lower
   implicit none
   private
   public :: inertia_type, add_inertia, new_velocity, add_mass_damping, mass_damping_dissipation, &
      carried_velocity

   type, extends(interaction_type) :: inertia_type
   contains
      procedure :: place
      procedure :: add_energies
      procedure, nopass :: add_moved_energies
   end type inertia_type

contains

   !> Inertia of one step: 2/dt**2 M to the stiffness, 2/dt M v to the load.
   pure subroutine add_inertia(m, velocity, dt, k, f)
      real(wp), intent(in) :: m(6, 6)        !! mass matrix
      real(wp), intent(in) :: velocity(6)    !! at the start of the step
      real(wp), intent(in) :: dt             !! step [time], > 0
      real(wp), intent(inout) :: k(6, 6)     !! diagonal block
      real(wp), intent(inout) :: f(6)        !! load
      k = k + (2/dt**2)*m
      f = f + (2/dt)*matmul(m, velocity)
   end subroutine add_inertia

   !> What a static step carries on: c 2/dt**2 M to the stiffness, c M a0 to the load.
   pure subroutine add_carried_damping(m, context, attempt, i, k, f)
      real(wp), intent(in) :: m(6, 6)        !! mass matrix
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      integer, intent(in) :: i               !! block
      real(wp), intent(inout) :: k(6, 6)     !! diagonal block
      real(wp), intent(inout) :: f(6)        !! load
      associate (c => attempt%scheme%carried)
         k = k + (c*(2/attempt%dt**2))*m
         f = f + c*matmul(m, context%state%acceleration(:, i))
      end associate
   end subroutine add_carried_damping

   !> Inertia in a scheme of second order: c/dt**2 M to the stiffness, c/dt M v + (c/2 - 1) M a to the load; and the
   !> loads that turn forces to where in the step they act.
   pure subroutine add_carried_inertia(m, context, attempt, i, k, f)
      real(wp), intent(in) :: m(6, 6)        !! mass matrix
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      integer, intent(in) :: i               !! block
      real(wp), intent(inout) :: k(6, 6)     !! diagonal block
      real(wp), intent(inout) :: f(6)        !! load
      real(wp) :: carried(6)
      associate (c => attempt%scheme%inertia, dt => attempt%dt)
         k = k + (c/dt**2)*m
         carried = (c/dt)*context%state%velocity(:, i) + (0.5_wp*c - 1)*attempt%acceleration_at_start(context, i)
         f = f + matmul(m, carried) + attempt%turning(:, i)
      end associate
   end subroutine add_carried_inertia

   !> Velocity at the end of the step.
   pure function new_velocity(d, velocity, dt) result(v)
      real(wp), intent(in) :: d(6)           !! unknowns of the step
      real(wp), intent(in) :: velocity(6)    !! at the start of the step
      real(wp), intent(in) :: dt             !! step [time], > 0
      real(wp) :: v(6)
      v = (2/dt)*d - velocity
   end function new_velocity

   !> Damping force -alpha M d/dt of one step: alpha/dt M to the stiffness.
   pure subroutine add_mass_damping(alpha, m, dt, k)
      real(wp), intent(in) :: alpha          !! coefficient [1/time], >= 0
      real(wp), intent(in) :: m(6, 6)        !! mass matrix
      real(wp), intent(in) :: dt             !! step [time], > 0
      real(wp), intent(inout) :: k(6, 6)     !! diagonal block
      k = k + (alpha/dt)*m
   end subroutine add_mass_damping

   !> Part of the velocity of block i, where the forces of a step of second order act, that its motion does not change.
   pure function carried_velocity(context, attempt, i) result(v)
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      integer, intent(in) :: i
      real(wp) :: v(6)
      real(wp) :: r, s
      call attempt%scheme%velocity_shares(r, s)
      v = (1 - r)*context%state%velocity(:, i) + (s*attempt%dt)*attempt%acceleration_at_start(context, i)
   end function carried_velocity

   !> Energy that mass-proportional damping takes in a step: alpha/dt d.M d.
   pure real(wp) function mass_damping_dissipation(alpha, m, dt, d)
      real(wp), intent(in) :: alpha          !! coefficient [1/time]
      real(wp), intent(in) :: m(6, 6)        !! mass matrix
      real(wp), intent(in) :: dt             !! step [time], > 0
      real(wp), intent(in) :: d(6)           !! unknowns of the step
      mass_damping_dissipation = alpha/dt*dot_product(d, matmul(m, d))
   end function mass_damping_dissipation

   !> Inertia of all blocks.
   subroutine place(self, context, attempt, equations)
      class(inertia_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(equations_type), intent(inout) :: equations
      real(wp) :: m(6, 6), k(6, 6), f(6)
      integer :: i
      !$omp parallel do default(none) shared(context, attempt, equations) private(i, m, k, f) schedule(static) &
      !$omp if (context%blocks%n_blocks > parallel_blocks)
      do i = 1, context%blocks%n_blocks
         if (attempt%is_left_out(i)) cycle
         m = mass_matrix(context%state%mass(i), context%state%area(i), context%state%moments(:, i))
         call unpack_lower(equations%block_matrix(:, i), k)
         f = 0
         if (attempt%scheme%second_order) then
            call add_carried_inertia(m, context, attempt, i, k, f)
         else
            call add_inertia(m, attempt%velocity_at_start(context, i), attempt%dt, k, f)
            if (attempt%scheme%carried > 0) call add_carried_damping(m, context, attempt, i, k, f)
         end if
         call pack_lower(k, equations%block_matrix(:, i))
         equations%block_load(:, i) = equations%block_load(:, i) + f
         equations%block_magnitude(:, i) = equations%block_magnitude(:, i) + abs(f)
      end do
      !$omp end parallel do
   end subroutine place

   !> Kinetic energy at the end of the step with the masses of its start; in a scheme of second order, and in a static
   !> step that carries accelerations on, what the work of all forces exceeds its change by is numerical dissipation.
   subroutine add_energies(self, context, attempt, d, balance)
      class(inertia_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      real(wp), intent(in), contiguous :: d(:, :)
      class(energy_balance_type), intent(inout) :: balance
      integer :: i, p
      call balance%make_room(context%blocks%n_blocks)
      !$omp parallel do default(none) shared(context, attempt, d, balance) private(i, p) schedule(static) &
      !$omp if (context%blocks%n_blocks > parallel_blocks)
      do p = 1, n_pieces(context%blocks%n_blocks)
         balance%sums(1:2, p) = 0
         do i = (p - 1)*piece + 1, min(p*piece, context%blocks%n_blocks)
            if (attempt%scheme%second_order) then
               call add_carried(i, context, attempt, d(:, i), balance%sums(1, p), balance%sums(2, p))
            else
               call add_kinetic(i, context, new_velocity(d(:, i), context%state%velocity(:, i), attempt%dt), &
                                balance%sums(1, p))
               if (attempt%scheme%carried > 0) balance%sums(2, p) = balance%sums(2, p) + &
                  work_of_carried(i, context, attempt, d(:, i))
            end if
         end do
      end do
      !$omp end parallel do
      balance%predicted(1) = sum(balance%sums(1, 1:n_pieces(context%blocks%n_blocks)))
      if (attempt%scheme%second_order .or. attempt%scheme%carried > 0) call balance%add( &
         energy%dissipated, sum(balance%sums(2, 1:n_pieces(context%blocks%n_blocks))))
   end subroutine add_energies

   !> Kinetic energy of the state.
   subroutine add_moved_energies(context, balance)
      type(step_context_type), intent(in) :: context
      class(energy_balance_type), intent(inout) :: balance
      integer :: i, p
      call balance%make_room(context%blocks%n_blocks)
      !$omp parallel do default(none) shared(context, balance) private(i, p) schedule(static) &
      !$omp if (context%blocks%n_blocks > parallel_blocks)
      do p = 1, n_pieces(context%blocks%n_blocks)
         balance%sums(1, p) = 0
         do i = (p - 1)*piece + 1, min(p*piece, context%blocks%n_blocks)
            call add_kinetic(i, context, context%state%velocity(:, i), balance%sums(1, p))
         end do
      end do
      !$omp end parallel do
      balance%moved(1) = sum(balance%sums(1, 1:n_pieces(context%blocks%n_blocks)))
   end subroutine add_moved_energies

   !> Kinetic energy of block i at the end of a step of second order, and what the scheme dissipates.
   pure subroutine add_carried(i, context, attempt, d, kinetic, lost)
      integer, intent(in) :: i
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      real(wp), intent(in) :: d(6)           !! motion of the step
      real(wp), intent(inout) :: kinetic, lost
      real(wp) :: a(6), v(6), momentum(6), before, after
      associate (state => context%state, jump => attempt%jump(:, i))
         a = attempt%scheme%new_acceleration(d, state%velocity(:, i), state%acceleration(:, i), jump, attempt%dt)
         v = state%velocity(:, i) + attempt%scheme%velocity_change(state%acceleration(:, i), a, jump, attempt%dt)
         momentum = context%momentum(i, d)
         before = 0
         after = 0
         call add_kinetic(i, context, state%velocity(:, i), before)
         call add_kinetic(i, context, v, after)
         kinetic = kinetic + after
         lost = lost + attempt%scheme%inertia_work(momentum, state%acceleration(:, i), a, jump, attempt%dt) &
                - (after - before) - dot_product(d, attempt%turning(:, i))
      end associate
   end subroutine add_carried

   !> Work against what a static step carries on, c d.M (a - a0), for block i.
   pure real(wp) function work_of_carried(i, context, attempt, d) result(work)
      integer, intent(in) :: i
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      real(wp), intent(in) :: d(6)           !! motion of the step
      associate (state => context%state)
         work = attempt%scheme%carried*dot_product(context%momentum(i, d), &
                                                   (2/attempt%dt**2)*d - state%acceleration(:, i))
      end associate
   end function work_of_carried

   !> Kinetic energy of block i with a given velocity.
   pure subroutine add_kinetic(i, context, velocity, total)
      integer, intent(in) :: i
      type(step_context_type), intent(in) :: context
      real(wp), intent(in) :: velocity(6)
      real(wp), intent(inout) :: total
      total = total + 0.5_wp*dot_product(velocity, context%momentum(i, velocity))
   end subroutine add_kinetic

end module rockdda_interaction_inertia
