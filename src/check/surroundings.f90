! SPDX-License-Identifier: MIT
!> What stands around the blocks, the stress in them, the water between them and the motion of the base: &boundary,
!> &in_situ, &water and &quake, as far as they do not fit the model.
module rockdda_check_surroundings
   use rockdda_base_diagnostics, only : diagnostics_type
   use rockdda_check_boundaries, only : check_boundaries
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_in_situ, only : initial_stress_type, find_initial_stress, check_in_situ, check_in_situ_blocks
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_water_check, only : check_water
   use rockdda_interaction_boundaries, only : boundaries_type
   use rockdda_interaction_water, only : water_family_type
   use rockdda_check_base_motion, only : check_motion
   implicit none
   private
   public :: check_ground

contains

   !> Report what is wrong in the groups, boundaries without an edge, and water that wets nothing.
   subroutine check_ground(blocks, parameters, messages)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(diagnostics_type), intent(inout) :: messages
      type(boundaries_type) :: boundaries
      type(water_family_type) :: water
      type(initial_stress_type) :: field
      integer :: before
      call check_motion(parameters, messages)
      before = messages%n_errors
      if (allocated(parameters%in_situ)) call check_in_situ(parameters%in_situ, messages)
      if (allocated(parameters%boundaries)) call check_boundaries(parameters%boundaries, messages)
      if (allocated(parameters%water)) call check_water(parameters%water, messages)
      if (messages%n_errors > before) return
      if (allocated(parameters%in_situ)) call check_in_situ_blocks(blocks, parameters, messages)
      call find_initial_stress(blocks, parameters, field)
      call boundaries%init(blocks, parameters, field, spread(.true., 1, blocks%n_blocks), messages)
      call water%init(blocks, parameters, messages)
   end subroutine check_ground

end module rockdda_check_surroundings
