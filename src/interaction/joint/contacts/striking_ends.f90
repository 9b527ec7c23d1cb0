! SPDX-License-Identifier: MIT
!> Ends of intervals that may strike: intervals that are closed on a part at the start of a dynamic step, whose springs
!> are too stiff for the step to resolve their vibration.
!>
!> Where the open end closes, forces that act within the step (`level` < 1) leave it as deep as its gap was: the springs
!> would hold energy that no work has supplied. By a force that acts at the end of the step a convex potential gives
!> none: from where it closes in the step on, such an interval acts there (`judge` of rockdda_interaction_open_close).
!> The accelerations that it leaves would throw the end back faster than it came: they are found anew (`accept_step`).
!> At the end acts one as well that becomes much stiffer between where forces act and the end of the step: it
!> would be pressed beyond its largest closure.
!>
!> And blows: contacts of a block that touches one other block only, closed at the start of the step, that the step
!> does not resolve either. A force within the step leaves an acceleration, which continues to move the block after it
!> has left: a mass that strikes a wall by one spring leaves with up to 1.3 times its energy. As an impulse at the end
!> of the step, as the force with which it closed, a convex potential gives none, and what leaves is free. Blocks that
!> are pressed from several sides keep forces within the step, which damp their vibration.
module rockdda_interaction_striking_ends
   use rockdda_base_kinds, only : wp, i1
   use rockdda_base_parallel, only : parallel_contacts
   use rockdda_contact_interval_law, only : at_end, end_gaps
   use rockdda_contact_table, only : contact_table_type, contact_state
   use rockdda_interaction_attempt, only : attempt_type
   use rockdda_interaction_joint_strength, only : joint_law_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_kinematics, only : displacement_at
   use rockdda_interaction_trial_states, only : at_level
   implicit none
   private
   public :: mark_striking_ends

   !> The step resolves vibrations up to this angle [rad] per step: 12 steps a period.
   real(wp), parameter :: resolved = 0.5_wp

contains

   !> Mark the rows of intervals with an end that may strike, and of contacts in a blow; also of joints with a
   !> coefficient of restitution, for what meets too slowly for the law of impact.
   subroutine mark_striking_ends(context, attempt, laws, table, start)
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(joint_law_type), intent(in) :: laws(:)          !! per joint material
      type(contact_table_type), intent(in) :: table
      integer(i1), intent(inout), contiguous :: start(:)     !! (>= rows) one of at_level%...
      real(wp) :: holds(context%blocks%n_blocks)             !! a block with two cannot move
      integer :: partner(context%blocks%n_blocks)            !! of `find_partners`
      integer :: c
      call find_partners(table, partner)
      call context%blocks%count_holds(holds, attempt%released, context%held)
      !$omp parallel do default(none) shared(context, attempt, laws, table, start, holds, partner) private(c) &
      !$omp schedule(static) if (table%n > parallel_contacts)
      do c = 1, table%n
         if (table%station(c) == 2 .or. table%state(c) == contact_state%open .or. table%tied(c)) cycle
         associate (d => merge(c + 1, c, table%station(c) == 1), law => laws(table%joint(c)))
            ! a sound bond pulls as its springs press
            if (table%bonded(c) .and. law%tension > 0 .and. &
                (c == d .or. table%bond_end(d) > table%bond_end(c))) cycle
            if (law%normal%is_curved()) then
               if (c < d) start(c:d) = at_level%may_strike
            else if (bounces(context, attempt, table, holds, partner, c)) then
               start(c:d) = at_level%blow
            else if (c < d) then
               if (may_strike(context, attempt, table, holds, c)) start(c:d) = at_level%may_strike
            end if
         end associate
      end do
      !$omp end parallel do
   end subroutine mark_striking_ends

   !> The only block that a block touches by closed contacts; 0 for none, -1 for several.
   pure subroutine find_partners(table, partner)
      type(contact_table_type), intent(in) :: table
      integer, intent(out), contiguous :: partner(:)         !! (nb)
      integer :: c
      partner = 0
      do c = 1, table%n
         if (table%state(c) == contact_state%open) cycle
         associate (a => table%block_a(c), b => table%block_b(c))
            partner(a) = merge(b, -1, any(partner(a) == [0, b]))
            partner(b) = merge(a, -1, any(partner(b) == [0, a]))
         end associate
      end do
   end subroutine find_partners

   !> Is a contact one of a block that touches no third one, and in a blow?
   pure logical function bounces(context, attempt, table, holds, partner, c)
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(contact_table_type), intent(in) :: table
      real(wp), intent(in) :: holds(:)                       !! (nb)
      integer, intent(in) :: partner(:)                      !! (nb)
      integer, intent(in) :: c                               !! first row
      real(wp) :: mass(2)
      integer :: sides(2)
      sides = [table%block_a(c), table%block_b(c)]
      mass = context%state%mass(sides)
      where (holds(sides) > 1) mass = huge(1.0_wp)
      bounces = all(partner(sides) > 0 .or. mass > minval(mass))
      if (bounces) bounces = is_in_blow(context, attempt, table, holds, c)
   end function bounces

   !> Is a contact in a blow that the step does not resolve? With the velocity of the step's start its gap, that at the
   !> deepest end of an interval, would change in the step by more than it is deep, or with the acceleration it would
   !> open; faster than blocks get by their weight in a step.
   pure logical function is_in_blow(context, attempt, table, holds, c)
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(contact_table_type), intent(in) :: table
      real(wp), intent(in) :: holds(:)                       !! (nb)
      integer, intent(in) :: c                               !! first row
      real(wp) :: gaps(2), gap, moves(2), least
      integer :: e
      e = 0
      gap = table%gap(c)
      moves = expected_opening(context, attempt, table, c)
      if (table%station(c) == 1) then
         gaps = end_gaps(table%gap(c:c + 1))
         e = minloc(gaps, dim=1)
         gap = gaps(e)
         associate (near => merge(c, c + 1, e == 1), far => merge(c + 1, c, e == 1))
            moves = at_end(expected_opening(context, attempt, table, near), &
                           expected_opening(context, attempt, table, far))
         end associate
      end if
      least = attempt%dt**2*max(fall(context, attempt, table%block_a(c)), fall(context, attempt, table%block_b(c)))
      is_in_blow = (abs(moves(1)) > abs(gap) .or. gap + sum(moves) > 0) .and. &
                   max(abs(moves(1)), abs(moves(1) + 2*moves(2))) > least
      if (is_in_blow) is_in_blow = is_unresolved(context, attempt, table, holds, c, e)
   end function is_in_blow

   !> Acceleration of a block by its weight.
   pure real(wp) function fall(context, attempt, block)
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      integer, intent(in) :: block
      associate (material => context%parameters%block_materials(context%blocks%block_material(block)))
         fall = merge(context%parameters%gravity, material%weight/material%density, context%parameters%gravity >= 0)
      end associate
      fall = abs(attempt%gravity*fall)
   end function fall

   !> What the velocities and the accelerations of the step's start would open of a row in the step.
   pure function expected_opening(context, attempt, table, c) result(opening)
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: c                               !! row
      real(wp) :: opening(2)                                 !! [length]
      real(wp) :: of_a(2), of_b(2)
      associate (a => table%block_a(c), b => table%block_b(c), place => table%point(:, c), dt => attempt%dt, &
                 centroid => context%state%centroid)
         of_a = displacement_at(attempt%velocity_at_start(context, a), place, centroid(:, a))
         of_b = displacement_at(attempt%velocity_at_start(context, b), place, centroid(:, b))
         opening(1) = dt*dot_product(of_a - of_b, table%normal(:, c))
         of_a = displacement_at(attempt%acceleration_at_start(context, a), place, centroid(:, a))
         of_b = displacement_at(attempt%acceleration_at_start(context, b), place, centroid(:, b))
         opening(2) = 0.5_wp*dt**2*dot_product(of_a - of_b, table%normal(:, c))
      end associate
   end function expected_opening

   !> Does an interval have an open end at which the step does not resolve vibrations?
   pure logical function may_strike(context, attempt, table, holds, c)
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(contact_table_type), intent(in) :: table
      real(wp), intent(in) :: holds(:)                       !! (nb)
      integer, intent(in) :: c                               !! first row
      real(wp) :: gap(2)
      integer :: e
      may_strike = .false.
      gap = end_gaps(table%gap(c:c + 1))
      do e = 1, 2
         if (gap(e) > 0) may_strike = may_strike .or. is_unresolved(context, attempt, table, holds, c, e)
      end do
   end function may_strike

   !> Are the springs of a contact too stiff for the step to resolve the vibration of a block on them, at an end of an
   !> interval?
   pure logical function is_unresolved(context, attempt, table, holds, c, e)
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(contact_table_type), intent(in) :: table
      real(wp), intent(in) :: holds(:)                       !! (nb)
      integer, intent(in) :: c                               !! (first) row
      integer, intent(in) :: e                               !! end, 0: of a corner
      real(wp) :: normal(2), point(2), squared, stiffness
      integer :: i, block
      point = table%point(:, c)
      normal = table%normal(:, c)
      stiffness = table%k_n(c)
      if (e > 0) then
         associate (near => merge(c, c + 1, e == 1), far => merge(c + 1, c, e == 1))
            point = at_end(table%point(:, near), table%point(:, far))
            normal = at_end(table%normal(:, near), table%normal(:, far))
         end associate
         stiffness = sum(table%k_n(c:c + 1))
      end if
      squared = 0
      do i = 1, 2
         block = merge(table%block_a(c), table%block_b(c), i == 1)
         if (holds(block) < 2) squared = squared + stiffness*mobility(context, block, point, normal)
      end do
      is_unresolved = squared*attempt%dt**2 > resolved**2
   end function is_unresolved

   !> Acceleration of a point of a rigid block along a direction by the force 1 that acts there in this direction
   !> [1/mass].
   pure real(wp) function mobility(context, block, point, direction)
      type(step_context_type), intent(in) :: context
      integer, intent(in) :: block
      real(wp), intent(in) :: point(2)                       !! [length]
      real(wp), intent(in) :: direction(2)                   !! of length 1
      real(wp) :: arm(2)
      arm = point - context%state%centroid(:, block)
      mobility = (1 + (arm(1)*direction(2) - arm(2)*direction(1))**2*context%state%area(block)/ &
                  sum(context%state%moments(1:2, block)))/context%state%mass(block)
   end function mobility

end module rockdda_interaction_striking_ends
