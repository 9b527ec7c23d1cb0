! SPDX-License-Identifier: MIT
!> Contacts with friction alone that go on sliding as they do, as most that slide do at most times: what the law of the
!> joint (rockdda_interaction_joint_law) finds for them, at a fraction of the cost.
module rockdda_interaction_sliding
   use rockdda_base_kinds, only : wp, i1, l1
   use rockdda_contact_table, only : contact_table_type, contact_state
   use rockdda_interaction_contact_law, only : contact_law_type
   use rockdda_interaction_joint_law, only : joint_settings_type, joint_state_type
   implicit none
   private
   public :: friction_of_sliding, go_on_sliding

contains

   !> Friction force of a contact that goes on sliding as it does, of a model with friction alone and without dashpots
   !> (`have_friction_alone`); negative: it does not, or `map_joint` is to find it.
   pure real(wp) function friction_of_sliding(laws, settings, table, c, state, gap, slip) result(friction)
      type(contact_law_type), intent(in) :: laws(:)        !! per joint material
      type(joint_settings_type), intent(in) :: settings
      type(contact_table_type), intent(in) :: table        !! at the start of the step
      integer, intent(in) :: c                             !! row
      type(joint_state_type), intent(in) :: state
      real(wp), intent(in) :: gap, slip                    !! at the end of the step, of the step [length]
      real(wp) :: limit
      friction = -1
      if (state%state /= contact_state%sliding .or. state%tied .or. state%bonded .or. state%worn) return
      if (.not. gap <= settings%open_tolerance .or. table%partner(c) /= 0) return
      limit = laws(table%joint(c))%friction*max(-table%k_n(c)*gap, 0.0_wp)
      if (table%k_s(c)*(table%shear(c) + slip)*state%slip_sign < limit - table%k_s(c)*settings%round_off) return
      friction = limit
   end function friction_of_sliding

   !> Note what the last solve had of such a contact, what its force misses of its law, and its new friction force.
   pure subroutine go_on_sliding(friction, k_n, gap, joint, state_used, sign_used, friction_used, bonded_used, miss, &
                                 normal_force, worst)
      real(wp), intent(in) :: friction                      !! of `friction_of_sliding` [force]
      real(wp), intent(in) :: k_n, gap                      !! [force/length], [length]
      type(joint_state_type), intent(inout) :: joint
      integer(i1), intent(out) :: state_used, sign_used
      real(wp), intent(out) :: friction_used                !! [force]
      logical(l1), intent(out) :: bonded_used
      real(wp), intent(out) :: miss, normal_force           !! [force]
      real(wp), intent(inout) :: worst                      !! largest miss of a friction force [force]
      state_used = joint%state
      sign_used = joint%slip_sign
      friction_used = joint%friction
      bonded_used = joint%bonded
      normal_force = -k_n*gap
      miss = abs(friction - joint%friction)
      worst = max(worst, miss)
      joint%friction = friction
   end subroutine go_on_sliding

end module rockdda_interaction_sliding
