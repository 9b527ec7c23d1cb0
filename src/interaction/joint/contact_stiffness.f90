! SPDX-License-Identifier: MIT
!> Stiffness of the springs of a contact.
module rockdda_interaction_contact_stiffness
   use rockdda_base_kinds, only : wp
   use rockdda_model_analysis_input, only : joint_material_type
   use rockdda_model_automatic_numbers, only : stiffening_type, all_stiffenings, stiffness_between
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_parameters, only : parameters_type
   implicit none
   private
   public :: set_stiffness, joint_stiffness_type

   !> Of all joint materials, and of the blocks that meet where these decide.
   type :: joint_stiffness_type
      real(wp), allocatable :: given(:, :)   !! (2, joint materials) normal, shear; 0: by the blocks
      real(wp), private :: shear_share = 1   !! shear over normal stiffness, by the blocks
      type(stiffening_type), allocatable, private :: blocks(:)   !! no array where no joint takes it from the blocks
   contains
      procedure :: renew
      procedure :: of_pair
   end type joint_stiffness_type

contains

   !> Stiffness of the springs of one contact: that of its joint material times the length of joint for which it
   !> stands, or the run's, which belongs to a joint of mean length; 0 where that length is 0: the blocks decide.
   pure subroutine set_stiffness(parameters, material, length, k_n, k_s)
      type(parameters_type), intent(in) :: parameters
      type(joint_material_type), intent(in) :: material
      real(wp), intent(in) :: length       !! [length]
      real(wp), intent(out) :: k_n, k_s    !! normal, shear [force/length]
      k_n = parameters%normal_stiffness
      k_s = parameters%shear_stiffness
      if (.not. parameters%by_length) return
      if (parameters%stiffness_length > 0) then
         k_n = k_n/parameters%stiffness_length
         k_s = k_s/parameters%stiffness_length
      else
         k_n = 0
         k_s = 0
      end if
      if (material%normal_stiffness > 0) k_n = material%normal_stiffness
      if (material%shear_stiffness > 0) then
         k_s = material%shear_stiffness
      else if (material%normal_stiffness > 0) then
         k_s = k_n*(parameters%shear_stiffness/parameters%normal_stiffness)
      end if
      k_n = k_n*length
      k_s = k_s*length
   end subroutine set_stiffness

   !> Of the materials that joints and blocks have now: per length of joint by length, else of a contact.
   pure subroutine renew(self, blocks, parameters, is_new)
      class(joint_stiffness_type), intent(inout) :: self
      type(block_system_type), intent(in) :: blocks      !! at the start
      type(parameters_type), intent(in) :: parameters
      logical, intent(in) :: is_new                      !! materials of blocks may have changed since the last time
      integer :: j
      if (.not. allocated(self%given)) allocate (self%given(2, size(parameters%joint_materials)))
      do j = 1, size(parameters%joint_materials)
         call set_stiffness(parameters, parameters%joint_materials(j), 1.0_wp, self%given(1, j), self%given(2, j))
      end do
      if (all(self%given(1, :) > 0)) return
      if (allocated(self%blocks) .and. .not. is_new) return
      self%blocks = all_stiffenings(blocks, parameters)
      self%shear_share = parameters%shear_stiffness/parameters%normal_stiffness
   end subroutine renew

   !> Normal and shear stiffness of a joint of this material between two blocks.
   pure function of_pair(self, joint, a, b) result(stiffness)
      class(joint_stiffness_type), intent(in) :: self
      integer, intent(in) :: joint, a, b
      real(wp) :: stiffness(2)
      stiffness = self%given(:, joint)
      if (stiffness(1) > 0) return
      stiffness(1) = stiffness_between(self%blocks(a), self%blocks(b))
      if (.not. stiffness(2) > 0) stiffness(2) = self%shear_share*stiffness(1)
   end function of_pair

end module rockdda_interaction_contact_stiffness
