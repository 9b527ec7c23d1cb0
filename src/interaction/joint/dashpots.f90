! SPDX-License-Identifier: MIT
!> Dashpots of closed contacts, a share of critical damping of the blocks on their joints.
!>
!> All contacts of a block are springs side by side, for any length that each represents. With K the sum of their
!> stiffness on a block of mass m, two blocks a and b vibrate against each other with
!>
!>     omega**2 = K_a/m_a + K_b/m_b         c = 2 zeta k/omega for each contact, of stiffness k
!>
!> so that the dashpots, like the springs, add up along a joint: a block on a joint has the damping ratio zeta, however
!> many contacts and blocks there are below it; so has the fastest vibration of a column. A held block is infinitely
!> heavy. Contacts count that are closed, or close in the step with the velocities of its start. Where the contacts of a
!> block act in different directions the ratio along one of them is smaller than zeta.
!>
!> In dynamic stages the contacts that slide have the run's ratio where their joint has a smaller one or none: undamped,
!> friction feeds the vibration of normal forces, and blocks slide further with shorter steps.
module rockdda_interaction_dashpots
   use rockdda_base_kinds, only : wp
   use rockdda_contact_interval_law, only : end_gaps
   use rockdda_contact_table, only : contact_table_type, contact_state, is_of_interval, other_row
   use rockdda_interaction_attempt, only : attempt_type
   use rockdda_interaction_joint_strength, only : joint_law_type, opened_last
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_joint_response, only : joint_extra_type
   implicit none
   private
   public :: has_dashpots, set_dashpots, dashpots_of, dashpot_coefficient, opening_speed

contains

   !> Can contacts have dashpots in this attempt: with a ratio of their joint, or because they slide?
   pure logical function has_dashpots(laws, table)
      type(joint_law_type), intent(in) :: laws(:)      !! per joint material
      type(contact_table_type), intent(in) :: table
      has_dashpots = any(laws%damping_ratio > 0)
      if (has_dashpots .or. .not. any(laws%sliding_damping > 0)) return
      has_dashpots = any(table%state(1:table%n) == contact_state%sliding)
   end function has_dashpots

   !> Dashpots of all contacts in an attempt, of which `context` has the step.
   pure subroutine set_dashpots(context, attempt, laws, table, level, extra)
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(joint_law_type), intent(in) :: laws(:)      !! per joint material
      type(contact_table_type), intent(in) :: table
      real(wp), intent(in), contiguous :: level(:)       !! (rows) share of the motion that gap and slip are
      type(joint_extra_type), intent(inout) :: extra(:)  !! (>= rows)
      if (has_dashpots(laws, table)) call share_damping(context, attempt, laws, table, level, extra)
   end subroutine set_dashpots

   !> Coefficients of the dashpots of all contacts.
   function dashpots_of(context, attempt, laws, table) result(drag)
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(joint_law_type), intent(in) :: laws(:)      !! per joint material
      type(contact_table_type), intent(in) :: table
      real(wp) :: drag(2, table%n)                       !! normal and shear [force time/length]
      type(joint_extra_type), allocatable :: extra(:)
      integer :: c
      allocate (extra(table%n))
      call set_dashpots(context, attempt, laws, table, [(1.0_wp, c=1, table%n)], extra)
      do c = 1, table%n
         drag(:, c) = attempt%dt*[extra(c)%normal_drag, extra(c)%drag]
      end do
   end function dashpots_of

   !> Dashpots of all contacts, for which the springs of each block are added up.
   pure subroutine share_damping(context, attempt, laws, table, level, extra)
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(joint_law_type), intent(in) :: laws(:)      !! per joint material
      type(contact_table_type), intent(in) :: table
      real(wp), intent(in), contiguous :: level(:)       !! (rows) share of the motion that gap and slip are
      type(joint_extra_type), intent(inout) :: extra(:)  !! (>= rows)
      real(wp), allocatable :: stiffness(:, :)           !! (normal and shear, blocks) of the contacts that count
      real(wp) :: holds(context%blocks%n_blocks)         !! a block with two cannot move
      logical :: counts(table%n)
      real(wp) :: springs(2), squared(2), ratio
      integer :: c, k, block
      allocate (stiffness(2, context%blocks%n_blocks), source=0.0_wp)
      call context%blocks%count_holds(holds, attempt%released, context%held)
      do c = 1, table%n
         counts(c) = table%state(c) /= contact_state%open
         if (.not. counts(c)) counts(c) = expected_gap(context, attempt, table, c) < 0
         if (.not. counts(c)) cycle
         springs = springs_of(laws, table, c)
         stiffness(:, table%block_a(c)) = stiffness(:, table%block_a(c)) + springs
         stiffness(:, table%block_b(c)) = stiffness(:, table%block_b(c)) + springs
      end do
      do c = 1, table%n
         ratio = laws(table%joint(c))%damping_ratio
         if (slides(table, c)) ratio = max(ratio, laws(table%joint(c))%sliding_damping)
         associate (share => level(c))
            if (.not. (ratio > 0 .and. share > 0)) cycle
            springs = springs_of(laws, table, c)
            squared = 0
            do k = 1, 2
               block = merge(table%block_a(c), table%block_b(c), k == 1)
               if (holds(block) > 1) cycle
               squared = squared + (stiffness(:, block) + merge(0.0_wp, springs, counts(c)))/context%state%mass(block)
            end do
            extra(c)%normal_drag = dashpot_coefficient(ratio, springs(1), squared(1))/(share*attempt%dt)
            ! it acts as the spring does: of a law that is not linear more where that is stiffer
            if (springs(1) > 0) extra(c)%normal_drag = extra(c)%normal_drag*(table%k_n(c)/springs(1))
            extra(c)%drag = dashpot_coefficient(ratio, springs(2), squared(2))/(share*attempt%dt)
            ! a dashpot that is not there before the contact closes: its force must vanish where that of the spring does
            extra(c)%drag_gap = table%gap(c)
            if (table%state(c) == contact_state%open) then
               extra(c)%drag_gap = min(table%gap(c), 0.0_wp)
            else if (laws(table%joint(c))%dilation > 0) then
               ! what dilation opens is no motion of the spring
               extra(c)%drag_gap = table%gap(c) + opened_last(laws(table%joint(c)), table%k_n(c), &
                                                              table%normal_force(c), table%gap(c), table%total_slip(c))
            end if
         end associate
      end do
   end subroutine share_damping

   !> Stiffness of the springs of a contact at the start of the step, normal and shear.
   pure function springs_of(laws, table, c) result(springs)
      type(joint_law_type), intent(in) :: laws(:)      !! per joint material
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: c
      real(wp) :: springs(2)                             !! [force/length]
      springs = [laws(table%joint(c))%normal%tangent(table%k_n(c), table%normal_force(c)), table%k_s(c)]
   end function springs_of

   !> Does a contact slide, or either row of its interval?
   pure logical function slides(table, c)
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: c
      slides = table%state(c) == contact_state%sliding
      if (is_of_interval(table, c)) slides = slides .or. table%state(other_row(table, c)) == contact_state%sliding
   end function slides

   !> Gap at the end of the step with the velocities of its start, of an interval the smaller one of both ends.
   pure real(wp) function expected_gap(context, attempt, table, c) result(gap)
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: c
      real(wp) :: other
      integer :: d
      gap = table%gap(c) + attempt%dt*opening_speed(context, attempt, table, c)
      if (.not. is_of_interval(table, c)) return
      d = other_row(table, c)
      other = table%gap(d) + attempt%dt*opening_speed(context, attempt, table, d)
      gap = minval(end_gaps([gap, other]))
   end function expected_gap

   !> Speed at which the gap of a row opens with the velocities of the step's start.
   pure real(wp) function opening_speed(context, attempt, table, c) result(speed)
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: c
      real(wp) :: arm(2), motion(6), v(2)
      integer :: k, block
      speed = 0
      do k = 1, 2
         block = merge(table%block_a(c), table%block_b(c), k == 1)
         arm = table%point(:, c) - context%state%centroid(:, block)
         motion = attempt%velocity_at_start(context, block)
         v = motion(1:2) + motion(3)*[-arm(2), arm(1)]
         speed = speed + merge(1, -1, k == 1)*dot_product(v, table%normal(:, c))
      end do
   end function opening_speed

   !> Coefficient c = 2 zeta k/omega; 0 where nothing can move.
   pure real(wp) function dashpot_coefficient(ratio, k, squared) result(coefficient)
      real(wp), intent(in) :: ratio     !! zeta [-], >= 0
      real(wp), intent(in) :: k         !! spring stiffness [force/length]
      real(wp), intent(in) :: squared   !! omega**2 [1/time^2], >= 0
      coefficient = 0
      if (squared > 0) coefficient = 2*ratio*k/sqrt(squared)
   end function dashpot_coefficient

end module rockdda_interaction_dashpots
