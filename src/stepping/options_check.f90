! SPDX-License-Identifier: MIT
!> Options that do not fit the model: told before a run begins, each where it was read.
module rockdda_stepping_options_check
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_model_analysis_input, only : joint_material_type
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_stage_options, only : stage_name, seeks_equilibrium, is_given, has_base_motion, stage_number
   use rockdda_interaction_contact_law, only : contact_law_type, new_contact_laws
   use rockdda_stepping_control, only : check_stages
   use rockdda_stepping_ground_check, only : check_ground
   use rockdda_interaction_loads, only : loads_type
   use rockdda_stepping_parameter_check, only : check_parameters
   use rockdda_stepping_stage_effects, only : report_stage_effects
   implicit none
   private
   public :: check_start, check_options, check_joints

contains

   !> With what no run can start: joint laws, numbers, points that stages release, line loads, boundaries, stress in the
   !> ground. What a run makes of them is dropped here.
   subroutine check_start(blocks, parameters, messages)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(diagnostics_type), intent(inout) :: messages
      type(contact_law_type), allocatable :: laws(:)
      type(loads_type) :: loads
      real(wp), allocatable :: line_ends(:, :)
      call new_contact_laws(parameters%joint_materials, laws, messages)
      call check_parameters(parameters, messages)
      call check_stages(parameters, blocks%fixed%n, messages)
      call loads%init(blocks, parameters, line_ends, messages)
      call check_ground(blocks, parameters, messages)
   end subroutine check_start

   !> The same before the run begins, with warnings.
   subroutine check_options(blocks, parameters, messages)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(diagnostics_type), intent(inout) :: messages
      call check_start(blocks, parameters, messages)
      call warn_of_time(parameters, messages)
      if (.not. messages%has_errors()) call report_stage_effects(blocks, parameters, messages)
   end subroutine check_options

   !> Warn of base motion that passes while blocks come to rest.
   subroutine warn_of_time(parameters, messages)
      type(parameters_type), intent(in) :: parameters
      type(diagnostics_type), intent(inout) :: messages
      character(len=:), allocatable :: since
      integer :: i, first
      if (.not. allocated(parameters%stages)) return
      if (.not. has_base_motion(parameters%base, parameters%quakes)) return
      first = 1
      since = 'time 0 of the run'
      if (is_given(parameters%base%stage)) then
         first = max(1, stage_number(parameters%stages, parameters%base%stage))
         since = "the start of stage '"//parameters%base%stage//"'"
      end if
      do i = first, size(parameters%stages)
         if (.not. seeks_equilibrium(parameters%stages(i))) cycle
         call messages%add(severity%warning, "stage '"//stage_name(parameters%stages, i)// &
                           "' lasts until equilibrium, but base motion counts from "//since//' and acts in it: let '// &
                           'the motion begin with a later stage (&load base_stage)', parameters%stages(i)%origin)
      end do
   end subroutine warn_of_time

   !> Joint laws alone.
   subroutine check_joints(joints, messages)
      type(joint_material_type), intent(in) :: joints(:)
      type(diagnostics_type), intent(inout) :: messages
      type(contact_law_type), allocatable :: laws(:)
      call new_contact_laws(joints, laws, messages)
   end subroutine check_joints

end module rockdda_stepping_options_check
