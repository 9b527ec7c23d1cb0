! SPDX-License-Identifier: MIT
!> Stiffness and loads of contacts in their trial states, as the equations of a step have them.
module rockdda_interaction_joint_links
   use rockdda_base_kinds, only : wp
   use rockdda_contact_table, only : contact_table_type, contact_state, other_row
   use rockdda_interaction_joint_response, only : joint_state_type, joint_extra_type, joint_type
   implicit none
   private
   public :: linearise_joint, linearise_joints

contains

   !> Stiffness and load of a contact in its present state, along the normal (1) and the edge (2). The normal force that
   !> friction depends on is left to the iteration, so that the stiffness is symmetric.
   pure subroutine linearise_joint(joint, stiffness, force)
      type(joint_type), intent(in) :: joint
      real(wp), intent(out) :: stiffness(2)   !! [force/length]
      real(wp), intent(out) :: force(2)       !! [force]
      stiffness = 0
      force = 0
      if (joint%state == contact_state%open) return
      stiffness(1) = joint%k_n + joint%normal_drag
      force(1) = -joint%k_n*(joint%gap + joint%late) - joint%normal_drag*((joint%gap + joint%late) - joint%drag_gap)
      if (joint%state == contact_state%locked) then
         stiffness(2) = joint%k_s + joint%drag
         force(2) = -joint%k_s*joint%shear
      else
         force(2) = -joint%slip_sign*joint%friction
      end if
   end subroutine linearise_joint

   !> `linearise_joint` for some rows of the table at the start of the step. Those of an interval that is closed on a
   !> part are coupled along the normal, by the second one.
   pure subroutine linearise_joints(n, rows, table, state, extra, own, cross, push, stiffness, force, coupling)
      integer, intent(in) :: n
      integer, intent(in) :: rows(n)
      type(contact_table_type), intent(in) :: table
      type(joint_state_type), intent(in), contiguous :: state(:)    !! (>= rows)
      type(joint_extra_type), allocatable, intent(in) :: extra(:)   !! (>= rows), or none
      real(wp), intent(in), contiguous :: own(:), cross(:)          !! (>= rows) stiffness of those closed on a part
      real(wp), intent(in), contiguous :: push(:)                   !! (>= rows) their forces at the gaps 0
      real(wp), intent(inout) :: stiffness(2, n), force(2, n)       !! [force/length], [force]
      real(wp), intent(inout) :: coupling(n)                        !! with the next row [force/length]
      type(joint_type) :: joint
      real(wp) :: other, drag_ratio
      integer :: c, d, k
      logical :: has_extra
      has_extra = allocated(extra)
      joint%normal_drag = 0
      joint%drag = 0
      do k = 1, n
         c = rows(k)
         ! what the springs need of `recall_joint`, without a call
         joint%joint_state_type = state(c)
         joint%gap = table%gap(c)
         joint%shear = table%shear(c)
         if (joint%worn) joint%shear = 0
         joint%k_n = table%k_n(c)
         joint%k_s = table%k_s(c)
         if (has_extra) then
            joint%normal_drag = extra(c)%normal_drag
            joint%drag = extra(c)%drag
            joint%drag_gap = extra(c)%drag_gap
            joint%late = extra(c)%late
         end if
         coupling(k) = 0
         if (joint%partly .and. joint%state /= contact_state%open) then
            ! the dashpot acts on the closed part as the spring does
            drag_ratio = joint%normal_drag/joint%k_n
            joint%k_n = own(c)
            joint%normal_drag = drag_ratio*own(c)
            d = other_row(table, c)
            call linearise_joint(joint, stiffness(:, k), force(:, k))
            other = table%gap(d)
            if (has_extra) other = other + extra(d)%late
            force(1, k) = force(1, k) - cross(c)*other + push(c)
            if (has_extra) force(1, k) = force(1, k) - drag_ratio*cross(c)*(other - extra(d)%drag_gap)
            if (c < d) coupling(k) = (1 + drag_ratio)*cross(c)
         else
            call linearise_joint(joint, stiffness(:, k), force(:, k))
         end if
      end do
   end subroutine linearise_joints

end module rockdda_interaction_joint_links
