! SPDX-License-Identifier: MIT
!> Stiffness of the springs of a contact.
module rockdda_interaction_contact_stiffness
   use rockdda_base_kinds, only : wp
   use rockdda_model_analysis_input, only : joint_material_type
   use rockdda_model_parameters, only : parameters_type
   implicit none
   private
   public :: set_stiffness, set_joint_stiffness

contains

   !> Stiffness of the springs of one contact: that of its joint material times the length of joint for which it
   !> stands, or the run's, which belongs to a joint of mean length.
   pure subroutine set_stiffness(parameters, material, length, k_n, k_s)
      type(parameters_type), intent(in) :: parameters
      type(joint_material_type), intent(in) :: material
      real(wp), intent(in) :: length       !! [length]
      real(wp), intent(out) :: k_n, k_s    !! normal, shear [force/length]
      k_n = parameters%normal_stiffness
      k_s = parameters%shear_stiffness
      if (.not. parameters%by_length) return
      k_n = k_n/parameters%stiffness_length
      k_s = k_s/parameters%stiffness_length
      if (material%normal_stiffness > 0) k_n = material%normal_stiffness
      if (material%shear_stiffness > 0) then
         k_s = material%shear_stiffness
      else if (material%normal_stiffness > 0) then
         k_s = k_n*(parameters%shear_stiffness/parameters%normal_stiffness)
      end if
      k_n = k_n*length
      k_s = k_s*length
   end subroutine set_stiffness

   !> Stiffness of the springs of all joint materials: per length of joint by length, else of a contact.
   pure subroutine set_joint_stiffness(parameters, stiffness)
      type(parameters_type), intent(in) :: parameters
      real(wp), intent(out) :: stiffness(:, :)   !! (2, joint materials) normal, shear
      integer :: j
      do j = 1, size(parameters%joint_materials)
         call set_stiffness(parameters, parameters%joint_materials(j), 1.0_wp, stiffness(1, j), stiffness(2, j))
      end do
   end subroutine set_joint_stiffness

end module rockdda_interaction_contact_stiffness
