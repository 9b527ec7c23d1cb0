! SPDX-License-Identifier: MIT
!> Options that do not fit the model: told before a run begins, each where it was read.
module rockdda_stepping_options_check
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_model_analysis_input, only : joint_material_type
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_stage_options, only : stage_name, seeks_equilibrium
   use rockdda_interaction_contact_law, only : contact_law_type, new_contact_laws
   use rockdda_stepping_control, only : check_stages
   use rockdda_stepping_ground_check, only : check_ground
   use rockdda_interaction_loads, only : loads_type
   use rockdda_stepping_parameter_check, only : check_parameters
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
   end subroutine check_options

   !> Warn where stages and other options have different ideas of time 0: base motion that passes while blocks come to
   !> rest, and water that presses on blocks which begin with a stress of their own.
   subroutine warn_of_time(parameters, messages)
      type(parameters_type), intent(in) :: parameters
      type(diagnostics_type), intent(inout) :: messages
      logical :: shakes
      integer :: i
      if (.not. allocated(parameters%stages)) return
      shakes = .false.
      if (allocated(parameters%base%table)) shakes = size(parameters%base%table, 2) > 0
      if (allocated(parameters%base%harmonics)) shakes = shakes .or. size(parameters%base%harmonics, 2) > 0
      do i = 1, merge(size(parameters%stages), 0, shakes)
         if (.not. seeks_equilibrium(parameters%stages(i))) cycle
         call messages%add(severity%warning, "stage '"//stage_name(parameters%stages, i)// &
                           "' lasts until equilibrium, but base motion counts from time 0 of the run and acts in "// &
                           'it: give the stage a duration, and begin the record after it', &
                           parameters%stages(i)%origin)
      end do
      if (.not. (allocated(parameters%in_situ) .and. allocated(parameters%water))) return
      if (size(parameters%in_situ) == 0 .or. size(parameters%water) == 0) return
      call messages%add(severity%warning, 'stress in the ground is that of the blocks, and of the joints without '// &
                        'water: water that acts from the start compresses the blocks; begin with a stage until '// &
                        'equilibrium', parameters%water(1)%origin)
   end subroutine warn_of_time

   !> Joint laws alone.
   subroutine check_joints(joints, messages)
      type(joint_material_type), intent(in) :: joints(:)
      type(diagnostics_type), intent(inout) :: messages
      type(contact_law_type), allocatable :: laws(:)
      call new_contact_laws(joints, laws, messages)
   end subroutine check_joints

end module rockdda_stepping_options_check
