! SPDX-License-Identifier: MIT
!> Options that do not fit the model: told before a run begins, each where it was read.
module rockdda_check_options
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : to_string
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_model_analysis_input, only : joint_material_type
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_boundary_options, only : is_quiet
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_stage_options, only : stage_name, seeks_equilibrium, is_given, has_base_motion, stage_number, &
      stage_k01
   use rockdda_interaction_contact_law, only : contact_law_type, new_contact_laws
   use rockdda_check_surroundings, only : check_ground
   use rockdda_interaction_loads, only : loads_type
   use rockdda_check_parameters, only : check_parameters
   use rockdda_check_stage_effects, only : report_stage_effects
   use rockdda_check_tables, only : warn_of_tables
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
      call check_releases(parameters, blocks%fixed%n, messages)
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
      call warn_of_weight(parameters, messages)
      call warn_of_velocity(parameters, messages)
      call warn_of_supports(blocks, parameters, messages)
      call warn_of_tables(parameters, messages)
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

   !> Warn of velocities that a static stage takes away before they act.
   subroutine warn_of_velocity(parameters, messages)
      type(parameters_type), intent(in) :: parameters
      type(diagnostics_type), intent(inout) :: messages
      real(wp) :: k01
      integer :: i
      k01 = parameters%k01
      if (allocated(parameters%stages)) then
         if (size(parameters%stages) > 0) k01 = stage_k01(parameters%stages(1), k01)
      end if
      if (k01 > 0) return
      do i = 1, size(parameters%block_materials)
         if (.not. any(abs(parameters%block_materials(i)%velocity) > 0)) cycle
         call messages%add(severity%warning, 'block material '//to_string(i)//' has a velocity, but the run begins '// &
                           'with static steps, which begin at rest: it is lost; begin with a dynamic stage', &
                           parameters%block_materials(i)%origin)
         return
      end do
   end subroutine warn_of_velocity

   !> Warn of supports that are soft beside joints which stiffen: they are springs of a multiple of the stiffness that
   !> these begin with.
   subroutine warn_of_supports(blocks, parameters, messages)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(diagnostics_type), intent(inout) :: messages
      integer :: i
      if (blocks%fixed%n == 0 .and. size(parameters%boundaries) == 0) return
      do i = 1, size(parameters%joint_materials)
         if (.not. parameters%joint_materials(i)%maximum_closure > 0) cycle
         call messages%add(severity%warning, 'joint material '//to_string(i)//' stiffens (maximum_closure): fixed '// &
                           'points and boundaries are springs of a multiple (&contact '// &
                           'fixed_stiffness_factor) of the stiffness with which joints begin, and sink by '// &
                           'stress over that; where that '// &
                           'counts, give a larger one', parameters%joint_materials(i)%origin)
         return
      end do
   end subroutine warn_of_supports

   !> Warn of weight that nothing carries: quiet boundaries hold in static steps only.
   subroutine warn_of_weight(parameters, messages)
      type(parameters_type), intent(in) :: parameters
      type(diagnostics_type), intent(inout) :: messages
      real(wp) :: k01
      integer :: g
      if (.not. allocated(parameters%boundaries)) return
      if (allocated(parameters%in_situ)) then
         if (size(parameters%in_situ) > 0) return
      end if
      k01 = parameters%k01
      if (allocated(parameters%stages)) then
         if (size(parameters%stages) > 0) k01 = stage_k01(parameters%stages(1), k01)
      end if
      if (k01 < 1 .or. .not. any(abs(parameters%block_materials%weight) > 0)) return
      do g = 1, size(parameters%boundaries)
         if (.not. is_quiet(parameters%boundaries(g))) cycle
         call messages%add(severity%warning, '&boundary '//to_string(g)//' ('//parameters%boundaries(g)%kind// &
                           ') holds in static steps only, but the run begins with dynamic ones: nothing carries '// &
                           "the weight there; begin with a stage until = 'equilibrium'", &
                           parameters%boundaries(g)%origin)
         return
      end do
   end subroutine warn_of_weight

   !> Joint laws alone.
   subroutine check_joints(joints, messages)
      type(joint_material_type), intent(in) :: joints(:)
      type(diagnostics_type), intent(inout) :: messages
      type(contact_law_type), allocatable :: laws(:)
      call new_contact_laws(joints, laws, messages)
   end subroutine check_joints

   !> Stages may release only fixed points that exist.
   subroutine check_releases(parameters, n_fixed, messages)
      type(parameters_type), intent(in) :: parameters
      integer, intent(in) :: n_fixed
      type(diagnostics_type), intent(inout) :: messages
      integer :: i, p
      do i = 1, size(parameters%stages)
         if (.not. allocated(parameters%stages(i)%release)) cycle
         do p = 1, size(parameters%stages(i)%release)
            if (parameters%stages(i)%release(p) < 1 .or. parameters%stages(i)%release(p) > n_fixed) then
               call messages%add(severity%error, 'stage '//to_string(i)//' releases fixed point '// &
                                 to_string(parameters%stages(i)%release(p))//', but the model has '// &
                                 to_string(n_fixed), parameters%stages(i)%origin)
            end if
         end do
      end do
   end subroutine check_releases

end module rockdda_check_options
