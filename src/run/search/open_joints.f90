! SPDX-License-Identifier: MIT
!> How much of the joints of each material is open: there cohesion and tension do not act.
module rockdda_run_open_joints
   use rockdda_base_kinds, only : wp
   use rockdda_contact_table, only : contact_state, contact_table_type, is_of_interval
   use rockdda_contact_view, only : contact_view_type
   use rockdda_stepping_simulation, only : simulation_type
   implicit none
   private
   public :: joint_lengths, open_shares

contains

   !> Length of joint between blocks that face each other, by joint material.
   pure function joint_lengths(sim) result(length)
      type(simulation_type), intent(in) :: sim
      real(wp) :: length(size(sim%parameters%joint_materials))
      integer :: c
      length = 0
      associate (table => sim%contacts)
         do c = 1, table%n
            if (counts(sim, c)) length(table%joint(c)) = length(table%joint(c)) + table%length(c)
         end do
      end associate
   end function joint_lengths

   !> Share of a length of joints, by joint material, that is not closed now; 0 where there are no joints.
   function open_shares(sim, length) result(share)
      type(simulation_type), intent(in) :: sim
      real(wp), intent(in) :: length(:)      !! `joint_lengths` in the settled state
      real(wp) :: share(size(length))
      type(contact_view_type) :: view
      integer :: c
      share = length
      associate (table => sim%contacts)
         call sim%view(view)
         do c = 1, table%n
            if (.not. counts(sim, c) .or. table%state(c) == contact_state%open) cycle
            share(table%joint(c)) = share(table%joint(c)) - view%length(c)
         end do
      end associate
      where (length > 0) share = max(0.0_wp, share/length)
      where (.not. length > 0) share = 0
   end function open_shares

   !> Is a row a part of a joint?
   pure logical function counts(sim, c)
      type(simulation_type), intent(in) :: sim
      integer, intent(in) :: c
      counts = sim%contacts%joint(c) >= 1
      if (sim%parameters%by_length) counts = counts .and. is_of_interval(sim%contacts, c)
   end function counts

end module rockdda_run_open_joints
