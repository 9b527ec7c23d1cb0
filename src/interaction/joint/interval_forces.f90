! SPDX-License-Identifier: MIT
!> Forces of springs and dashpots of intervals in an accepted step, for its energies.
module rockdda_interaction_interval_forces
   use rockdda_base_kinds, only : wp
   use rockdda_contact_table, only : contact_table_type, other_row
   use rockdda_interaction_contact_law, only : contact_law_type
   use rockdda_interaction_intervals, only : interval_response_type, respond
   use rockdda_interaction_joint_law, only : spring_force
   use rockdda_interaction_open_close, only : open_close_type
   implicit none
   private
   public :: interval_forces, drag_force

contains

   !> Forces of the springs of an interval: (rows, at the start of the step and where they act in it), and their
   !> energies at the start.
   pure subroutine interval_forces(trial, law, table, c, forces, energy)
      type(open_close_type), intent(in) :: trial
      type(contact_law_type), intent(in) :: law
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: c                    !! first row
      real(wp), intent(out) :: forces(2, 2)
      real(wp), intent(out) :: energy(2)
      type(interval_response_type) :: interval
      real(wp) :: where_acts(2), bond(2)
      integer :: i
      bond = table%bond_end(c:c + 1)
      call respond(law, table, c, logical(table%bonded(c) .and. table%bonded(c + 1)), &
                   table%gap(c:c + 1), 0.0_wp, bond, interval)
      forces(:, 1) = interval%force
      energy = interval%energy
      do i = 1, 2
         where_acts(i) = acting_gap(trial, table, c + i - 1)
      end do
      if (trial%partly_used(c)) then
         forces(:, 2) = trial%push_used(c:c + 1) - (trial%own_used(c:c + 1)*where_acts + &
                                                    trial%cross_used(c)*where_acts([2, 1]))
      else
         forces(:, 2) = spring_force(table%k_n(c:c + 1), where_acts)
      end if
   end subroutine interval_forces

   !> Gap at which the spring of a contact acts in the step, by that at its end.
   pure real(wp) function acting_gap(trial, table, c) result(gap)
      type(open_close_type), intent(in) :: trial
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: c
      real(wp) :: opens, late
      opens = 0
      late = 0
      if (allocated(trial%extra)) opens = trial%extra(c)%opens
      if (allocated(trial%extra)) late = trial%extra(c)%late
      gap = table%gap(c) + trial%level(trial%start(c))*((trial%gap(c) - table%gap(c)) + opens) + late
   end function acting_gap

   !> Force of the dashpot of a row of an interval.
   pure real(wp) function drag_force(trial, table, c) result(force)
      type(open_close_type), intent(in) :: trial
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: c
      integer :: d
      force = trial%extra(c)%normal_drag*(acting_gap(trial, table, c) - trial%extra(c)%drag_gap)
      if (.not. trial%partly_used(c)) return
      d = other_row(table, c)
      force = (trial%own_used(c)/table%k_n(c))*force + trial%extra(c)%normal_drag*(trial%cross_used(c)/table%k_n(c))* &
              (acting_gap(trial, table, d) - trial%extra(d)%drag_gap)
   end function drag_force

end module rockdda_interaction_interval_forces
