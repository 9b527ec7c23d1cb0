! SPDX-License-Identifier: MIT
!> Contacts at time 0 begin with the traction that the initial stress of their blocks demands.
!>
!> The traction on the surface of block a, whose outward normal is -n, is -s n, s the mean stress of both blocks at
!> the contact; where one is fixed or has no initial stress, that of the other. A contact that represents the length l
!> of the joint carries the compression -n.s n l and, along the edge, -t.s n l, no more than its strength. The contacts
!> of an interval do the work of a stress that is linear along it exactly, by Lobatto's rule: blocks whose stress
!> balances their weight stay.
!>
!> The stress is the total one: where water stands in the joint the springs carry what the water leaves.
module rockdda_interaction_initial_traction
   use rockdda_base_kinds, only : wp
   use rockdda_contact_interval_law, only : closed_part_type, find_closed_part, part_energies, press_points
   use rockdda_contact_table, only : contact_table_type, contact_state
   use rockdda_interaction_joint_strength, only : joint_law_type, shear_strength
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_joint_response, only : spring_energy
   implicit none
   private
   public :: start_with_stress

   !> Smaller shares of the stress are rounding.
   real(wp), parameter :: round_off = 1.0e-9_wp

contains

   !> Give the closed contacts of the first step the force of the initial stress.
   pure subroutine start_with_stress(context, laws, table, weak, pressure)
      type(step_context_type), intent(in) :: context
      type(joint_law_type), intent(in) :: laws(:)      !! per joint material
      type(contact_table_type), intent(inout) :: table   !! states, gaps and stiffness of the first step
      !> contacts without the whole traction: its shear exceeds the strength (1), it is tension (2)
      integer, intent(out), optional :: weak(2)
      real(wp), intent(in), optional :: pressure(:)      !! (contacts) of the water in the joint [stress]
      logical, allocatable :: counts(:)
      real(wp) :: stress(3), n(2), traction(2), normal, shear, strength, rounding
      real(wp), allocatable :: scale(:)   !! largest stress of each block
      integer :: c, n_weak(2)
      n_weak = 0
      if (present(weak)) weak = 0
      allocate (counts(context%blocks%n_blocks), scale(context%blocks%n_blocks))
      do c = 1, size(counts)
         scale(c) = maxval(abs(context%state%stress(:, c)))
         counts(c) = scale(c) > 0
      end do
      if (.not. any(counts)) return
      do c = 1, context%blocks%fixed%n
         counts(context%blocks%fixed%block(c)) = .false.
      end do
      do c = 1, table%n
         if (table%state(c) == contact_state%open) cycle
         associate (a => table%block_a(c), b => table%block_b(c))
            if (.not. (counts(a) .or. counts(b))) cycle
            stress = 0
            if (counts(a)) stress = context%stress_at_start(a, table%point(:, c))
            if (counts(b)) stress = stress + context%stress_at_start(b, table%point(:, c))
            if (counts(a) .and. counts(b)) stress = 0.5_wp*stress
         end associate
         n = table%normal(:, c)
         traction = [stress(1)*n(1) + stress(3)*n(2), stress(3)*n(1) + stress(2)*n(2)]
         normal = -dot_product(n, traction)*table%length(c)
         if (present(pressure)) normal = normal - pressure(c)*table%length(c)
         rounding = round_off*max(scale(table%block_a(c)), scale(table%block_b(c)))*table%length(c)
         if (.not. (normal > 0 .or. table%tied(c))) then
            if (normal < -rounding) n_weak(2) = n_weak(2) + 1
            cycle
         end if
         shear = -(-n(2)*traction(1) + n(1)*traction(2))*table%length(c)
         strength = shear_strength(laws(table%joint(c)), normal, table%length(c), logical(table%bonded(c)), &
                                   0.0_wp, 0.0_wp)
         if (.not. table%tied(c)) then
            if (abs(shear) > strength + rounding) n_weak(1) = n_weak(1) + 1
            shear = max(-strength, min(strength, shear))
         end if
         associate (closure => normal/laws(table%joint(c))%normal%secant(table%k_n(c), normal))
            table%offset(c) = table%offset(c) + table%gap(c) + closure
            table%gap(c) = -closure
         end associate
         table%shear(c) = -shear/table%k_s(c)
         table%normal_force(c) = normal
         if (allocated(table%shear_force)) table%shear_force(c) = shear
         table%energy(c) = spring_energy(table%k_n(c), table%k_s(c), table%gap(c), table%shear(c))
      end do
      do c = 1, table%n
         if (table%station(c) /= 1 .or. .not. laws(table%joint(c))%normal%is_curved()) cycle
         if (table%state(c) /= contact_state%open .and. all(table%normal_force(c:c + 1) > 0)) &
            call press_both(laws(table%joint(c)), c, table)
      end do
      if (present(weak)) weak = n_weak
   end subroutine start_with_stress

   !> Both rows of an interval of which neither is a spring by itself, by their forces.
   pure subroutine press_both(law, c, table)
      type(joint_law_type), intent(in) :: law
      integer, intent(in) :: c                           !! first row
      type(contact_table_type), intent(inout) :: table
      type(closed_part_type) :: part
      real(wp) :: gap(2), stiffness
      stiffness = sum(table%k_n(c:c + 1))
      gap = press_points(law%normal, stiffness, table%normal_force(c:c + 1))
      table%offset(c:c + 1) = table%offset(c:c + 1) + (table%gap(c:c + 1) - gap)
      table%gap(c:c + 1) = gap
      call find_closed_part(gap, [0.0_wp, 0.0_wp], law%normal, part)
      table%energy(c:c + 1) = spring_energy(0.0_wp, table%k_s(c:c + 1), gap, table%shear(c:c + 1)) + &
                              part_energies(part, stiffness, gap)
   end subroutine press_both

end module rockdda_interaction_initial_traction
