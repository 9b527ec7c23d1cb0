! SPDX-License-Identifier: MIT
!> Contacts at the start of a step: stiffness, gap and traction of their springs, and their dashpots.
module rockdda_interaction_contact_start
   use rockdda_base_kinds, only : wp
   use rockdda_base_parallel, only : parallel_contacts, piece, n_pieces
   use rockdda_contact_interval_law, only : n_points
   use rockdda_contact_table, only : contact_table_type, contact_state
   use rockdda_interaction_attempt, only : attempt_type
   use rockdda_interaction_joint_strength, only : joint_law_type, dilated_gap, opened_last
   use rockdda_interaction_contact_stiffness, only : joint_stiffness_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_dashpots, only : set_dashpots
   use rockdda_interaction_joint_response, only : joint_extra_type
   use rockdda_interaction_kinematics, only : displacement_at
   use rockdda_interaction_ties, only : tie_stiffness
   implicit none
   private
   public :: start_contacts, set_dashpots, expect_dilation, joint_stiffness_type

   !> Width by which the rock that bears a tie grows with the distance from it: a half-plane turns under a linear
   !> traction on a length L by as much as a beam of this height and the length 0.42 L (16/(12 pi)).
   real(wp), parameter :: spread = 0.589048622548086232_wp*2

contains

   !> Springs of all rows at the start of a step.
   subroutine start_contacts(context, attempt, laws, stiffness, keep_force, table)
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(joint_law_type), intent(in) :: laws(:)      !! per joint material
      type(joint_stiffness_type), intent(in) :: stiffness
      logical, intent(in) :: keep_force                  !! closed contacts keep it with a new stiffness
      type(contact_table_type), intent(inout) :: table
      real(wp) :: holds(context%blocks%n_blocks)
      integer :: p
      logical :: dilates
      dilates = any(laws%dilation > 0)
      if (any(context%parameters%joint_materials%tie)) &
         call context%blocks%count_holds(holds, attempt%released, context%held)
      !$omp parallel do default(none) shared(context, laws, stiffness, holds, keep_force, table, dilates) private(p) &
      !$omp schedule(static) if (table%n > parallel_contacts)
      do p = 1, n_pieces(table%n)
         call set_some_springs((p - 1)*piece + 1, min(p*piece, table%n), context, laws, stiffness, holds, &
                               keep_force, table)
         ! from here on the gap is that of the springs: what dilation has opened carries no stress
         if (dilates) call take_off_dilation((p - 1)*piece + 1, min(p*piece, table%n), laws, table)
      end do
      !$omp end parallel do
   end subroutine start_contacts

   !> Stiffness of some of the rows.
   pure subroutine set_some_springs(first, last, context, laws, stiffness, holds, keep_force, table)
      integer, intent(in) :: first, last
      type(step_context_type), intent(in) :: context
      type(joint_law_type), intent(in) :: laws(:)      !! per joint material
      type(joint_stiffness_type), intent(in) :: stiffness
      real(wp), intent(in) :: holds(:)             !! (nb) a block with two cannot move
      logical, intent(in) :: keep_force
      type(contact_table_type), intent(inout) :: table
      real(wp) :: old(2), k(2), length, compliance
      integer :: a, b, c
      logical :: by_length
      by_length = context%parameters%by_length
      length = 1
      do c = first, last
         if (.not. table%tied(c)) then
            old = [table%k_n(c), table%k_s(c)]
            if (by_length) length = table%length(c)
            k = stiffness%given(:, table%joint(c))
            if (.not. k(1) > 0) k = stiffness%of_pair(table%joint(c), table%block_a(c), table%block_b(c))
            table%k_n(c) = k(1)*length
            table%k_s(c) = k(2)*length
            ! a law that is not linear has its stiffness for good
            if (keep_force .and. by_length .and. old(1) > 0 .and. .not. laws(table%joint(c))%normal%is_curved()) &
               call keep_forces(old, table, c)
         else if (context%state%step == 0 .or. .not. table%k_n(c) > 0) then
            a = table%block_a(c)
            b = table%block_b(c)
            compliance = compliance_of(context, a, table, c, holds) + compliance_of(context, b, table, c, holds)
            if (.not. compliance > 0) compliance = compliance_of(context, a, table, c) + &
                                                   compliance_of(context, b, table, c)
            table%k_n(c) = tie_stiffness(table%length(c), compliance)
            table%k_s(c) = table%k_n(c)
         end if
      end do
   end subroutine set_some_springs

   !> A closed contact keeps its forces with a new stiffness; the energy of its springs is that of the new ones.
   pure subroutine keep_forces(old, table, c)
      real(wp), intent(in) :: old(2)               !! stiffness before, normal and shear [force/length]
      type(contact_table_type), intent(inout) :: table
      integer, intent(in) :: c                     !! row
      real(wp) :: gap, shear_energy
      if (table%state(c) == contact_state%open) return
      gap = table%gap(c)*(old(1)/table%k_n(c))
      table%offset(c) = table%offset(c) + (table%gap(c) - gap)
      table%gap(c) = gap
      shear_energy = 0.5_wp*old(2)*table%shear(c)**2
      table%energy(c) = (table%energy(c) - shear_energy)*(old(1)/table%k_n(c)) + &
                        shear_energy*(old(2)/table%k_s(c))
      table%shear(c) = table%shear(c)*(old(2)/table%k_s(c))
   end subroutine keep_forces

   !> Compliance of a block between its centroid and a tie, per area of the tie: the distance over the modulus, E or in
   !> plane strain E/(1 - nu^2). Beyond the ends of the tie the block helps to bear what is linear along it, which
   !> spreads with the distance y as length + spread*y,
   !>
   !>     integral from 0 to d of (length/min(width, length + spread*y))^3 dy.
   !>
   !> A block that is held does not give way.
   pure real(wp) function compliance_of(context, block, table, c, holds) result(compliance)
      class(step_context_type), intent(in) :: context
      integer, intent(in) :: block
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: c                     !! row
      real(wp), intent(in), optional :: holds(:)   !! (nb) a block with two cannot move; absent: none is held
      real(wp) :: along(2), distance, length, width, widest
      compliance = 0
      if (present(holds)) then
         if (holds(block) > 1) return
      end if
      associate (vertices => context%state%vertices(:, context%blocks%vertex_offset(block) + 1: &
                                                    context%blocks%vertex_offset(block + 1)), &
                 material => context%parameters%block_materials(context%blocks%block_material(block)))
         along = [-table%normal(2, c), table%normal(1, c)]
         distance = abs(dot_product(table%point(:, c) - context%state%centroid(:, block), table%normal(:, c)))
         length = n_points*table%length(c)
         width = maxval(matmul(along, vertices)) - minval(matmul(along, vertices))
         ! where the whole width bears
         widest = min(distance, max(0.0_wp, width - length)/spread)
         compliance = length/(2*spread)*(1 - (length/(length + spread*widest))**2) + &
                      (distance - widest)*(length/max(length, width))**3
         compliance = compliance/material%youngs_modulus
         if (context%parameters%plane_strain) compliance = compliance*(1 - material%poisson_ratio**2)
      end associate
   end function compliance_of

   !> Take from the gaps of some of the rows what dilation has opened.
   pure subroutine take_off_dilation(first, last, laws, table)
      integer, intent(in) :: first, last
      type(joint_law_type), intent(in) :: laws(:)
      type(contact_table_type), intent(inout) :: table
      integer :: c
      do c = first, last
         table%gap(c) = table%gap(c) - dilated_gap(laws(table%joint(c)), table%total_slip(c))
      end do
   end subroutine take_off_dilation

   !> The opening of joints that dilate, in this step: what the velocities at its start let them slip opens evenly
   !> within it, so that the springs of blocks that slide keep their force; what the last step slipped beyond what was
   !> expected of it opens evenly too.
   pure subroutine expect_dilation(context, attempt, laws, table, level, extra, gap)
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(joint_law_type), intent(in) :: laws(:)      !! per joint material
      type(contact_table_type), intent(in) :: table
      real(wp), intent(in), contiguous :: level(:)       !! (rows) share of the step after which forces act
      type(joint_extra_type), intent(inout) :: extra(:)  !! (>= rows)
      real(wp), intent(inout) :: gap(:)                  !! (>= rows) of the springs without motion [length]
      real(wp) :: last, slip
      integer :: c
      do c = 1, table%n
         if (table%state(c) == contact_state%open) cycle
         associate (law => laws(table%joint(c)))
            last = opened_last(law, table%k_n(c), table%normal_force(c), table%gap(c), table%total_slip(c))
            if (table%state(c) == contact_state%sliding .and. law%dilation > 0) then
               slip = max(0.0_wp, table%slip_sign(c)*expected_slip(context, attempt, table, c))
               extra(c)%opens = dilated_gap(law, table%total_slip(c) + slip) - dilated_gap(law, table%total_slip(c))
            end if
         end associate
         extra(c)%late = (1 - level(c))*last - level(c)*extra(c)%opens
         gap(c) = table%gap(c) + extra(c)%late
      end do
   end subroutine expect_dilation

   !> Slip of a contact in the step by the velocities and accelerations of its start.
   pure real(wp) function expected_slip(context, attempt, table, c) result(slip)
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: c
      real(wp) :: d(6), u(2), point(2)
      integer :: k, block
      slip = 0
      if (table%station(c) == 0) then
         point = context%state%vertices(:, table%vertex(c))
      else
         point = table%point(:, c)
      end if
      do k = 1, 2
         block = merge(table%block_a(c), table%block_b(c), k == 1)
         d = attempt%dt*attempt%velocity_at_start(context, block)
         if (attempt%knows_acceleration(context)) d = d + (0.5_wp*attempt%dt**2)* &
                                                      attempt%acceleration_at_start(context, block)
         u = displacement_at(d, point, context%state%centroid(:, block))
         slip = slip + merge(1, -1, k == 1)*(table%normal(1, c)*u(2) - table%normal(2, c)*u(1))
      end do
   end function expected_slip

end module rockdda_interaction_contact_start
