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
module rockdda_interaction_striking_ends
   use rockdda_base_kinds, only : wp, i1
   use rockdda_base_parallel, only : parallel_contacts
   use rockdda_contact_interval_law, only : at_end, end_gaps
   use rockdda_contact_table, only : contact_table_type, contact_state
   use rockdda_interaction_attempt, only : attempt_type
   use rockdda_interaction_contact_law, only : contact_law_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_trial_states, only : at_level
   implicit none
   private
   public :: mark_striking_ends

   !> The step resolves vibrations up to this angle [rad] per step: 12 steps a period.
   real(wp), parameter :: resolved = 0.5_wp

contains

   !> Mark the rows of intervals with an end that may strike. Joints with a coefficient of restitution have their own
   !> law of impact.
   subroutine mark_striking_ends(context, attempt, laws, table, start)
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(contact_law_type), intent(in) :: laws(:)          !! per joint material
      type(contact_table_type), intent(in) :: table
      integer(i1), intent(inout), contiguous :: start(:)     !! (>= rows) one of at_level%...
      real(wp) :: holds(context%blocks%n_blocks)             !! a block with two cannot move
      integer :: c
      call context%blocks%count_holds(holds, attempt%released, context%held)
      !$omp parallel do default(none) shared(context, attempt, laws, table, start, holds) private(c) schedule(static) &
      !$omp if (table%n > parallel_contacts)
      do c = 1, table%n
         if (table%station(c) /= 1 .or. table%state(c) == contact_state%open) cycle
         if (table%tied(c) .or. laws(table%joint(c))%restitution >= 0) cycle
         ! a sound bond pulls as its springs press
         if (table%bonded(c) .and. laws(table%joint(c))%tension > 0 .and. table%bond_end(c + 1) > table%bond_end(c)) &
            cycle
         if (laws(table%joint(c))%normal%is_curved() .or. may_strike(context, attempt, table, holds, c)) &
            start(c:c + 1) = at_level%may_strike
      end do
      !$omp end parallel do
   end subroutine mark_striking_ends

   !> Does an interval have an open end at which the step does not resolve vibrations?
   pure logical function may_strike(context, attempt, table, holds, c)
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(contact_table_type), intent(in) :: table
      real(wp), intent(in) :: holds(:)                       !! (nb)
      integer, intent(in) :: c                               !! first row
      real(wp) :: gap(2), normal(2), point(2), squared
      integer :: e, i, block
      may_strike = .false.
      gap = end_gaps(table%gap(c:c + 1))
      if (.not. any(gap > 0)) return
      do e = 1, 2
         if (.not. gap(e) > 0) cycle
         associate (near => merge(c, c + 1, e == 1), far => merge(c + 1, c, e == 1))
            point = at_end(table%point(:, near), table%point(:, far))
            normal = at_end(table%normal(:, near), table%normal(:, far))
         end associate
         squared = 0
         do i = 1, 2
            block = merge(table%block_a(c), table%block_b(c), i == 1)
            if (holds(block) < 2) squared = squared + sum(table%k_n(c:c + 1))*mobility(context, block, point, normal)
         end do
         may_strike = may_strike .or. squared*attempt%dt**2 > resolved**2
      end do
   end function may_strike

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
