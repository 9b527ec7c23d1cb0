! SPDX-License-Identifier: MIT
!> Contacts that stay open, and those with friction alone that go on sliding as they do, as most do at most times: what
!> the law of the joint (rockdda_interaction_joint_law) finds for them, at a fraction of the cost.
module rockdda_interaction_sliding
   use rockdda_base_kinds, only : wp, i1, l1
   use rockdda_contact_table, only : contact_table_type, contact_state
   use rockdda_interaction_closing, only : closing_gap
   use rockdda_interaction_contact_law, only : contact_law_type
   use rockdda_interaction_joint_law, only : joint_settings_type, joint_state_type
   implicit none
   private
   public :: friction_of_sliding, judge_steady

contains

   !> Friction force of a contact that goes on sliding as it does, of a model with friction alone and without dashpots
   !> (`have_friction_alone`); negative: it does not, or `map_joint` is to find it.
   pure real(wp) function friction_of_sliding(laws, settings, table, c, state, widest, mean, slip) result(friction)
      type(contact_law_type), intent(in) :: laws(:)        !! per joint material
      type(joint_settings_type), intent(in) :: settings
      type(contact_table_type), intent(in) :: table        !! at the start of the step
      integer, intent(in) :: c                             !! row
      type(joint_state_type), intent(in) :: state
      real(wp), intent(in) :: widest, mean                 !! gaps that decide, `find_extremes` [length]
      real(wp), intent(in) :: slip                         !! of the step [length]
      real(wp) :: limit
      friction = -1
      if (state%state /= contact_state%sliding .or. state%tied .or. state%bonded .or. state%worn) return
      if (.not. widest <= settings%open_tolerance .or. table%partner(c) /= 0) return
      limit = laws(table%joint(c))%friction*max(-table%k_n(c)*mean, 0.0_wp)
      if (table%k_s(c)*(table%shear(c) + slip)*state%slip_sign < limit - table%k_s(c)*settings%round_off) return
      friction = limit
   end function friction_of_sliding

   !> Judge a contact without a partner that stays open, or goes on sliding: what the last solve had of it, what its
   !> force misses of its law, its normal force, and its new friction force.
   pure subroutine judge_steady(simple, laws, settings, table, c, lowest, widest, mean, gap, slip, joint, state_used, &
                                sign_used, friction_used, bonded_used, miss, normal_force, worst, is_steady)
      logical, intent(in) :: simple                         !! for `friction_of_sliding`
      type(contact_law_type), intent(in) :: laws(:)         !! per joint material
      type(joint_settings_type), intent(in) :: settings
      type(contact_table_type), intent(in) :: table         !! at the start of the step
      integer, intent(in) :: c                              !! row
      real(wp), intent(in) :: lowest, widest, mean          !! gaps that decide, `find_extremes` [length]
      real(wp), intent(in) :: gap, slip                     !! at the end of the step, of the step [length]
      type(joint_state_type), intent(inout) :: joint
      integer(i1), intent(inout) :: state_used, sign_used
      real(wp), intent(inout) :: friction_used              !! [force]
      logical(l1), intent(inout) :: bonded_used
      real(wp), intent(inout) :: miss, normal_force         !! [force]
      real(wp), intent(inout) :: worst                      !! largest miss of a friction force [force]
      logical, intent(out) :: is_steady                     !! else nothing has changed
      real(wp) :: friction, pressing
      is_steady = .false.
      if (joint%state == contact_state%open) then
         if (table%partner(c) /= 0) return
         if (.not. lowest >= closing_gap(settings, table%offset(c), logical(joint%strikes))) return
         friction = 0
         pressing = 0
         miss = 0
      else
         if (.not. simple) return
         friction = friction_of_sliding(laws, settings, table, c, joint, widest, mean, slip)
         if (friction < 0) return
         pressing = -table%k_n(c)*gap
         miss = abs(friction - joint%friction)
         worst = max(worst, miss)
      end if
      is_steady = .true.
      state_used = joint%state
      sign_used = joint%slip_sign
      friction_used = joint%friction
      bonded_used = joint%bonded
      normal_force = pressing
      joint%friction = friction
   end subroutine judge_steady

end module rockdda_interaction_sliding
