! SPDX-License-Identifier: MIT
!> Read the files of a run, or texts in memory, into a model and the parameters of its run.
!>
!> Materials that files describe, and whether they are those of the model.
module rockdda_run_model_input
   use rockdda_base_error, only : error_type
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_model_options, only : run_options_type
   use rockdda_model_resolve, only : resolve_parameters, put_materials_together
   use rockdda_model_in_situ, only : check_in_situ
   use rockdda_check_plausibility, only : check_plausibility
   use rockdda_linear_factory, only : default_solver
   use rockdda_run_find_files, only : find_named_files
   use rockdda_run_input, only : model_input_type, run_name, run_request_type, apply_request
   use rockdda_run_parts, only : make_parts, check_stage_water, place_loads, check_load_names, find_described
   use rockdda_run_read_files, only : read_config, read_blocks, read_analysis
   use rockdda_run_cells, only : check_names
   use rockdda_check_options, only : check_options, check_joints
   use rockdda_check_boundaries, only : check_boundaries
   use rockdda_model_parameters, only : parameters_type
   use rockdda_check_material_use, only : check_lines_described, check_blocks_described
   use rockdda_io_recognise, only : file_kind
   implicit none
   private
   public :: model_input_type, run_request_type, read_model

contains

   !> Read all files, cut a geometry into blocks and blocks into cells, and resolve the parameters of the run.
   !> Every problem is added to `messages`; `error` is a failure of the cutting.
   subroutine read_model(request, input, messages, error)
      class(run_request_type), intent(in) :: request
      type(model_input_type), intent(inout) :: input
      type(diagnostics_type), intent(inout) :: messages
      type(error_type), allocatable, intent(out) :: error
      integer :: before
      logical :: ok
      call read_config(input, messages)
      call check_without_model(input%options, messages)
      if (input%labelled .or. input%options%labelled) then
         call find_named_files(input, messages, ok)
         if (.not. ok) return
      end if
      call apply_request(request, input%options, messages)
      call read_blocks(input, messages, error)
      before = messages%n_errors
      if (len(input%analysis_file) > 0) call read_analysis(request%dialect, input, messages)
      if (.not. allocated(input%analysis_text)) input%analysis_text = ''
      if (messages%n_errors > before) return
      call complete_lists(input%options)
      call check_materials(input, messages)
      if (.not. input%has_blocks) return
      if (messages%has_errors() .and. .not. input%labelled) return
      call make_parts(input, messages)
      call place_loads(input%options, input%blocks, messages)
      if (messages%has_errors() .and. input%labelled) call check_laws(input, messages)
      if (messages%has_errors()) return
      call choose_solver(input%options, messages)
      call resolve_parameters(input%blocks, input%analysis, input%options, input%parameters, messages)
      call check_options(input%blocks, input%parameters, messages)
      if (.not. messages%has_errors()) call check_plausibility(input%blocks, input%parameters, input%options, &
         input%analysis_file, input%config_file, messages)
      if (len(input%parameters%title) == 0) input%parameters%title = run_name(input)
   end subroutine read_model

   !> Groups that the options do not have are lists without an item.
   subroutine complete_lists(options)
      type(run_options_type), intent(inout) :: options
      if (.not. allocated(options%block_materials)) allocate (options%block_materials(0))
      if (.not. allocated(options%joint_materials)) allocate (options%joint_materials(0))
      if (.not. allocated(options%joint_laws)) allocate (options%joint_laws(0))
      if (.not. allocated(options%loading_points)) allocate (options%loading_points(0))
      if (.not. allocated(options%regions)) allocate (options%regions(0))
      if (.not. allocated(options%subdivisions)) allocate (options%subdivisions(0))
      if (.not. allocated(options%stages)) allocate (options%stages(0))
      if (.not. allocated(options%changes)) allocate (options%changes(0))
      if (.not. allocated(options%bolts)) allocate (options%bolts(0))
      if (.not. allocated(options%liners)) allocate (options%liners(0))
   end subroutine complete_lists

   !> Set the default solver of this build, unless the user chose one.
   subroutine choose_solver(options, messages)
      type(run_options_type), intent(inout) :: options
      type(diagnostics_type), intent(inout) :: messages
      if (allocated(options%method)) then
         if (len_trim(options%method) > 0) return
      end if
      options%method = default_solver()
      call messages%add(severity%note, 'solver: '//options%method//' (the default)')
   end subroutine choose_solver

   !> Groups of &boundary and &in_situ, as far as they can be judged without a model, groups of &water that stages name,
   !> and names of loads.
   subroutine check_without_model(options, messages)
      type(run_options_type), intent(in) :: options
      type(diagnostics_type), intent(inout) :: messages
      integer :: i
      if (allocated(options%boundaries)) call check_boundaries(options%boundaries, messages)
      if (allocated(options%in_situ)) then
         call check_in_situ(options%in_situ, messages)
         do i = 1, size(options%in_situ)
            if (allocated(options%in_situ(i)%region)) call check_names('&in_situ', options%regions, &
               options%in_situ(i)%region, options%in_situ(i)%origin, messages)
         end do
      end if
      call check_stage_water(options, messages)
      call check_load_names(options, messages)
   end subroutine check_without_model

   !> Check that the materials of the model are described.
   subroutine check_materials(input, messages)
      type(model_input_type), intent(in) :: input
      type(diagnostics_type), intent(inout) :: messages
      logical, allocatable :: blocks(:), joints(:)      !! described, by number
      logical :: in_analysis
      call find_described(input, blocks, joints)
      in_analysis = .not. input%labelled
      if (allocated(input%analysis%block_materials)) in_analysis = in_analysis .or. &
                                                                   size(input%analysis%block_materials) > 0
      if (input%model_kind == file_kind%geometry .and. allocated(input%geometry%line_joint)) then
         call check_lines_described(input%geometry, input%blocks, blocks, joints, in_analysis, input%model_file, &
                                    messages)
      else if (input%has_blocks) then
         call check_blocks_described(input%blocks, blocks, joints, in_analysis, input%model_file, messages)
      end if
   end subroutine check_materials

   !> What the next attempt would report of a labelled file with errors: materials, laws of joints, end of the run.
   subroutine check_laws(input, messages)
      type(model_input_type), intent(in) :: input
      type(diagnostics_type), intent(inout) :: messages
      type(parameters_type) :: parameters
      call put_materials_together(input%analysis, input%options, parameters, messages)
      call check_joints(parameters%joint_materials, messages)
   end subroutine check_laws

end module rockdda_run_model_input
