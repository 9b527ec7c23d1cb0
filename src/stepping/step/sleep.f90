! SPDX-License-Identifier: MIT
!> Blocks at rest are left out of dynamic steps until something disturbs them (docs/theory.md, "Blocks asleep").
!>
!> A block is calm in a step when the resultant force is at most `sleep_tolerance` times the sum of the magnitudes of
!> the forces, and the motion at most what that force gives it in a step. It falls asleep after ten calm steps in a row,
!> or sooner when it is so much calmer that it would remain calm, as long as its neighbours are calm. It then keeps its
!> place and its stress, and the forces between blocks asleep stay what they are.
!>
!> At the end of a step blocks asleep wake on which forces balance no better than `wakes` times the tolerance. Where
!> one lacks more than `strikes` times the tolerance, as when something falls on it, the step is done again with those
!> awake; each time a further ring of neighbours wakes with them, twice as wide as the last.
module rockdda_stepping_sleep
   use rockdda_base_kinds, only : wp
   use rockdda_model_state, only : energy, radius_of_inertia
   use rockdda_contact_table, only : contact_table_type, contact_state
   use rockdda_interaction_attempt, only : attempt_type
   use rockdda_interaction_balance, only : energy_balance_type
   use rockdda_interaction_block_forces, only : block_forces_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_equations, only : equations_type
   use rockdda_interaction_kinematics, only : mass_times
   implicit none
   private
   public :: fall_asleep, wake_disturbed

   !> A block sleeps after this number of calm steps in a row, or sooner when it is likely to stay calm for the rest.
   integer, parameter :: calm_steps = 10
   !> Instead of this number: a block asleep that wakes with the next step.
   integer, parameter :: disturbed = -1
   !> A block with a bolt, which never sleeps.
   integer, parameter :: bolted = -2
   !> It wakes beyond this many times the tolerance: it must not wake by what it fell asleep with.
   real(wp), parameter :: wakes = 2
   !> And the step is repeated beyond this many times.
   real(wp), parameter :: strikes = 20

contains

   !> At the end of a step: count calm steps, and let blocks sleep after enough of them. What they move by is discarded.
   subroutine fall_asleep(context, attempt, d, contacts, forces, balance)
      type(step_context_type), intent(inout) :: context
      type(attempt_type), intent(in) :: attempt
      real(wp), intent(in), contiguous :: d(:, :)            !! (6, nb) motion of the step
      type(contact_table_type), intent(in) :: contacts       !! at its end
      type(block_forces_type), intent(in) :: forces          !! there
      class(energy_balance_type), intent(inout) :: balance
      logical, allocatable :: may(:)
      real(wp) :: lost, shares(2)
      integer :: c, i, k, l
      lost = 0
      associate (state => context%state)
         ! a bolt may join blocks that are far apart
         do l = 1, context%blocks%bolts%n
            do k = 1, 2
               i = context%blocks%bolts%blocks(k, l)
               if (i > 0) state%calm(i) = bolted
            end do
         end do
         if (allocated(context%bolted)) where (context%bolted) state%calm = bolted
         allocate (may(context%blocks%n_blocks), source=.false.)
         do i = 1, context%blocks%n_blocks
            if (state%calm(i) == disturbed) then
               state%asleep(i) = .false.
               state%calm(i) = 0
               cycle
            end if
            if (state%asleep(i) .or. .not. state%active(i)) cycle
            if (state%calm(i) == bolted) then
               state%calm(i) = 0
               cycle
            end if
            shares = unrest(context, attempt, d(:, i), forces, i)
            state%calm(i) = merge(min(state%calm(i) + 1, calm_steps), 0, all(shares <= 1))
            ! a resultant that stays adds its share of the motion in each step
            may(i) = state%calm(i) > 0 .and. (calm_steps - state%calm(i))*sum(shares) <= 1
         end do
         ! what moves keeps its neighbours awake
         do c = 1, contacts%n
            if (contacts%state(c) == contact_state%open) cycle
            associate (a => contacts%block_a(c), b => contacts%block_b(c))
               may(a) = may(a) .and. (state%asleep(b) .or. state%calm(b) > 0)
               may(b) = may(b) .and. (state%asleep(a) .or. state%calm(a) > 0)
            end associate
         end do
         do i = 1, context%blocks%n_blocks
            if (.not. may(i)) cycle
            state%asleep(i) = .true.
            associate (v => state%velocity(:, i))
               lost = lost + 0.5_wp*dot_product(v, mass_times(state%mass(i), state%area(i), state%moments(:, i), v))
            end associate
            state%velocity(:, i) = 0
            state%acceleration(:, i) = 0
         end do
      end associate
      balance%total(energy%kinetic) = balance%total(energy%kinetic) - lost
      balance%total(energy%discarded) = balance%total(energy%discarded) + lost
   end subroutine fall_asleep

   !> Motion of a block in the step, and resultant of its forces, over the largest with which the block is calm. The
   !> motion is that of the step: velocities of motions far too stiff for the step alternate.
   pure function unrest(context, attempt, d, forces, i)
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      real(wp), intent(in) :: d(6)                           !! motion of the step
      type(block_forces_type), intent(in) :: forces
      integer, intent(in) :: i
      real(wp) :: unrest(2)
      real(wp) :: allowed, moved
      unrest = huge(allowed)
      associate (state => context%state)
         allowed = context%parameters%sleep_tolerance*forces%magnitude(i)
         if (.not. allowed > 0) return
         moved = norm2(d(1:2)) + 2*radius_of_inertia(state, i)*(abs(d(3)) + norm2(d(4:6)))
         unrest(1) = state%mass(i)*moved/(allowed*attempt%dt**2)
         unrest(2) = 0
         if (forces%held(i) < 2) unrest(2) = forces%force_of(i, state)/allowed
      end associate
   end function unrest

   !> Wake the blocks asleep that the solution disturbs, with neighbours over closed contacts: in the attempt, not in
   !> the state.
   subroutine wake_disturbed(context, equations, contacts, round, attempt, n_woken)
      type(step_context_type), intent(in) :: context
      type(equations_type), intent(in) :: equations
      type(contact_table_type), intent(in) :: contacts       !! of the last step
      integer, intent(in) :: round                           !! in this step, from 1
      type(attempt_type), intent(inout) :: attempt
      integer, intent(out) :: n_woken                        !! 0: the step stands
      logical, allocatable :: woken(:), ring(:)
      real(wp) :: disturbance, worst
      integer :: c, i, k
      n_woken = 0
      if (.not. any(attempt%asleep)) return
      allocate (woken(context%blocks%n_blocks), source=.false.)
      worst = 0
      do i = 1, size(woken)
         if (.not. attempt%asleep(i) .or. attempt%is_left_out(i)) cycle
         disturbance = pull_on(equations, i, radius_of_inertia(context%state, i))/context%parameters%sleep_tolerance
         woken(i) = disturbance > wakes
         worst = max(worst, disturbance)
      end do
      if (.not. any(woken)) return
      if (worst <= strikes) then
         ! with the next step
         where (woken) attempt%calm = disturbed
         return
      end if
      do k = 1, min(2**min(round - 1, 20) - 1, size(woken))
         ring = woken
         do c = 1, contacts%n
            if (contacts%state(c) == contact_state%open) cycle
            associate (a => contacts%block_a(c), b => contacts%block_b(c))
               if (woken(a) .neqv. woken(b)) ring([a, b]) = .true.
            end associate
         end do
         if (all(ring .eqv. woken)) exit
         woken = ring
      end do
      n_woken = count(woken .and. attempt%asleep)
      do i = 1, size(woken)
         if (.not. (woken(i) .and. attempt%asleep(i))) cycle
         attempt%asleep(i) = .false.
         attempt%calm(i) = 0
      end do
   end subroutine wake_disturbed

   !> What a block asleep would move by: the forces on it at the solution x, in which it does not move, over the sum of
   !> their magnitudes. Moments and the forces that strain it count on the arm `radius`.
   pure real(wp) function pull_on(equations, block, radius) result(disturbance)
      type(equations_type), intent(in) :: equations
      integer, intent(in) :: block
      real(wp), intent(in) :: radius                 !! [length]
      real(wp) :: r(6), along(2), total, v(6, 2), w(6, 2)
      integer :: b, c, l, other, side
      r = equations%block_load(:, block)
      total = norm2(r(1:2))
      do l = equations%start(block) + 1, equations%start(block + 1)
         c = abs(equations%incident(l))
         along = equations%force(:, c)
         do side = 1, 2
            b = equations%pair(side, c)
            if (b == 0) cycle
            if (equations%row_of(b) == 0) cycle   ! asleep: x = 0
            v = equations%vectors_of(c, side)
            along(1) = along(1) - equations%stiffness(1, c)*dot_product(v(:, 1), equations%x(:, b))
            ! with the row before or behind it
            do other = c - 1, c + 1, 2
               if (other < 1 .or. other > equations%n_links) cycle
               if (.not. abs(equations%coupling(min(c, other))) > 0) cycle
               w = equations%vectors_of(other, side)
               along(1) = along(1) - equations%coupling(min(c, other))*dot_product(w(:, 1), equations%x(:, b))
            end do
            along(2) = along(2) - equations%stiffness(2, c)*dot_product(v(:, 2), equations%x(:, b))
         end do
         v = equations%vectors_of(c, merge(1, 2, equations%incident(l) > 0))
         r = r + along(1)*v(:, 1) + along(2)*v(:, 2)
         total = total + norm2(along)
      end do
      r(3:6) = r(3:6)/radius
      disturbance = 0
      if (total > 0) disturbance = norm2(r)/total
   end function pull_on

end module rockdda_stepping_sleep
