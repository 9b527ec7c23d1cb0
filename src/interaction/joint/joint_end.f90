! SPDX-License-Identifier: MIT
!> Closed contacts at the end of an accepted step: forces, memory and energy by the law of their joints
!> (rockdda_interaction_joint_response).
module rockdda_interaction_joint_end
   use rockdda_base_kinds, only : wp, i1
   use rockdda_contact_table, only : contact_state
   use rockdda_interaction_joint_response, only : joint_type, joint_state_type
   implicit none
   private
   public :: joint_end_type, end_joint, end_joints

   !> A closed contact at the end of an accepted step.
   type :: joint_end_type
      real(wp) :: shear                !! elongation of the shear spring [length]
      real(wp) :: normal_force         !! of the spring, compression positive
      real(wp) :: shear_force          !! on block a along the edge
      real(wp) :: slipped              !! slip to sum up [length], >= 0
      real(wp) :: energy               !! in both springs
   end type joint_end_type

contains

   !> A contact that was closed in the last solve, at the end of the step: what the step leaves in its memory. State,
   !> slip direction and friction force are those of the solve, which the joint may have left since.
   pure subroutine end_joint(joint, state, slip_sign, friction, gap, slip, last)
      type(joint_type), intent(in) :: joint
      integer(i1), intent(in) :: state, slip_sign
      real(wp), intent(in) :: friction             !! [force]
      real(wp), intent(in) :: gap, slip            !! [length]
      type(joint_end_type), intent(out) :: last
      real(wp) :: limit
      last%shear = joint%shear + slip
      last%normal_force = -joint%k_n*gap
      if (state == contact_state%locked) then
         last%shear_force = -joint%k_s*last%shear
         last%slipped = 0
      else
         limit = friction/joint%k_s
         last%shear = max(-limit, min(limit, last%shear))
         last%shear_force = -slip_sign*friction
         last%slipped = abs(slip)
      end if
      last%energy = 0.5_wp*joint%k_n*gap**2 + 0.5_wp*joint%k_s*last%shear**2
   end subroutine end_joint

   !> `end_joint` for rows of the table at the start of the step; nothing for those that were open.
   pure subroutine end_joints(n, k_n, k_s, shear, joint, state, slip_sign, friction, gap, slip, last)
      integer, intent(in) :: n
      real(wp), intent(in) :: k_n(n), k_s(n)         !! [force/length]
      real(wp), intent(in) :: shear(n)               !! elongation at the start of the step [length]
      type(joint_state_type), intent(in) :: joint(n)
      integer(i1), intent(in) :: state(n), slip_sign(n)
      real(wp), intent(in) :: friction(n), gap(n), slip(n)
      type(joint_end_type), intent(inout) :: last(n)
      type(joint_type) :: whole
      integer :: c
      do c = 1, n
         if (state(c) == contact_state%open) cycle
         whole%shear = shear(c)
         if (joint(c)%worn) whole%shear = 0
         whole%k_n = k_n(c)
         whole%k_s = k_s(c)
         call end_joint(whole, state(c), slip_sign(c), friction(c), gap(c), slip(c), last(c))
      end do
   end subroutine end_joints

end module rockdda_interaction_joint_end
