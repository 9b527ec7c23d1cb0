! SPDX-License-Identifier: MIT
!> Materials and tables of points: those of the analysis file with what the options say about them; the end of the run.
module rockdda_model_given_materials
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_model_analysis_input, only : analysis_input_type
   use rockdda_model_joint_options, only : take_joint_options
   use rockdda_model_material_options, only : take_block_options, take_point_tables
   use rockdda_model_options, only : run_options_type, is_set
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_stage_options, only : has_end, seeks_equilibrium, stage_k01
   implicit none
   private
   public :: put_materials_together, put_tables_together

contains

   !> Materials of the analysis file and the options; without an analysis file also the end of the run.
   subroutine put_materials_together(analysis, options, parameters, messages)
      type(analysis_input_type), intent(in) :: analysis
      type(run_options_type), intent(in) :: options             !! with all lists
      type(parameters_type), intent(inout) :: parameters
      type(diagnostics_type), intent(inout) :: messages
      if (allocated(analysis%block_materials)) then
         parameters%block_materials = analysis%block_materials
         parameters%joint_materials = analysis%joint_materials
      else
         if (allocated(parameters%block_materials)) deallocate (parameters%block_materials, parameters%joint_materials)
         allocate (parameters%block_materials(0), parameters%joint_materials(0))
         call find_extent(options, parameters, messages)
      end if
      parameters%given_gravity = parameters%gravity
      call take_block_options(options%block_materials, options%labelled, parameters%gravity, &
                              parameters%block_materials, messages)
      call take_joint_options(options%joint_materials, options%joint_laws, options%labelled, &
                              parameters%joint_materials, messages)
   end subroutine put_materials_together

   !> Tables of fixed points and of loading points.
   subroutine put_tables_together(options, parameters, messages)
      type(run_options_type), intent(in) :: options             !! with all lists
      type(parameters_type), intent(inout) :: parameters
      type(diagnostics_type), intent(inout) :: messages
      call take_point_tables('fixed point', options%fixed_points, parameters%fixed_tables, messages)
      call take_point_tables('loading point', options%loading_points, parameters%loading_tables, messages)
   end subroutine put_tables_together

   !> Where a run without an analysis file ends: its number of steps, its end time, or the end of its last stage.
   subroutine find_extent(options, parameters, messages)
      type(run_options_type), intent(in) :: options
      type(parameters_type), intent(inout) :: parameters
      type(diagnostics_type), intent(inout) :: messages
      if (.not. is_set(options%steps)) parameters%n_steps = huge(1)
      if (allocated(options%stages)) then
         if (size(options%stages) > 0) then
            associate (last => options%stages(size(options%stages)))
               if (has_end(last)) return
            end associate
         end if
      end if
      if (is_set(options%steps) .or. is_set(options%t_end)) return
      call messages%add(severity%error, 'the run has no end: give &run steps or t_end, or an end to the last &stage', &
                        options%model_origin)
   end subroutine find_extent

end module rockdda_model_given_materials
