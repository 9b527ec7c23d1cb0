! SPDX-License-Identifier: MIT
!> The labelled file of a model that was read from other files: run by itself it gives the same results, bit for bit.
module rockdda_run_labelled_text
   use rockdda_base_kinds, only : wp
   use rockdda_linear_factory, only : default_solver
   use rockdda_model_analysis_input, only : analysis_input_type, time_table_type, dialect
   use rockdda_model_options, only : run_options_type, point_table_type, stage_type, unset_real, is_set
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_regions, only : same_name
   use rockdda_model_stage_options, only : has_end, has_base_motion, stage_name
   use rockdda_io_namelist_parser, only : beside
   use rockdda_io_options_writer, only : options_text
   use rockdda_run_input, only : model_input_type
   implicit none
   private
   public :: labelled_text

contains

   !> The text, without the line end of the last line.
   function labelled_text(input) result(text)
      type(model_input_type), intent(in) :: input    !! read without errors
      character(len=:), allocatable :: text
      character(len=*), parameter :: nl = new_line('a')
      type(run_options_type) :: options
      integer :: i
      options = input%options
      options%geometry = input%model_file
      options%model_title = input%parameters%title
      options%title = ''
      options%analysis = ''
      options%units = trim(input%parameters%units)
      if (allocated(options%base%file)) options%base%file = beside(input%config_file, options%base%file)
      if (.not. input%labelled .and. has_base_motion(options%base, options%quakes) .and. &
          .not. is_given(options%base%stage)) then
         ! in a labelled file it would begin with the first dynamic stage
         if (size(options%stages) > 0) options%base%stage = stage_name(options%stages, 1)
      end if
      if (allocated(options%water)) then
         do i = 1, size(options%water)
            if (is_given(options%water(i)%file)) options%water(i)%file = beside(input%config_file, &
                                                                                options%water(i)%file)
         end do
      end if
      if (allocated(options%quakes)) then
         do i = 1, size(options%quakes)
            if (is_given(options%quakes(i)%file)) options%quakes(i)%file = beside(input%config_file, &
                                                                                  options%quakes(i)%file)
         end do
      end if
      if (options%method == default_solver()) options%method = ''
      if (allocated(input%analysis%block_materials)) call take_analysis(input%analysis, input%parameters, options)
      if (.not. input%labelled .and. .not. is_given(options%plane)) options%plane = 'stress'
      if (.not. input%labelled .and. .not. is_given(options%integrator)) options%integrator = 'shi'
      if (.not. input%labelled .and. .not. is_set(options%sliding_damping)) options%sliding_damping = 0
      call take_materials(input%parameters, options)
      options%fixed_points = tables_of(input%parameters%fixed_tables)
      options%loading_points = [tables_of(input%parameters%loading_tables(1:size(input%parameters%loading_tables) - &
                                                                           n_placed(options%loading_points))), &
                                placed(options%loading_points)]
      text = '! Labelled file of '//input%model_file
      if (len(input%analysis_file) > 0) text = text//', '//input%analysis_file
      if (len(input%config_file) > 0) text = text//', '//input%config_file
      text = text//nl//'! Paths are relative to the folder of this file.'//nl//options_text(options)
      text = text(:len(text) - 1)
   end function labelled_text

   !> Run control of the analysis file, where the options do not have it, and what its dialect and a legacy file imply.
   subroutine take_analysis(analysis, parameters, options)
      type(analysis_input_type), intent(in) :: analysis
      type(parameters_type), intent(in) :: parameters
      type(run_options_type), intent(inout) :: options
      integer :: i
      if (.not. is_set(options%steps) .and. .not. is_set(options%t_end)) options%steps = analysis%n_steps
      call take(analysis%k01, options%k01)
      call take(analysis%displacement_ratio, options%displacement_ratio)
      call take(analysis%dt_max, options%dt_max)
      call take(analysis%stiffness, options%stiffness)
      call take(analysis%sor_factor, options%omega)
      if (analysis%dialect == dialect%windows) then
         call take(parameters%dt_min, options%dt_min)
         if (.not. is_given(options%length_scale)) options%length_scale = 'largest'
      end if
      if (.not. allocated(options%stages)) return
      ! after the last of its stages this run goes on, that of a labelled file does not
      if (size(options%stages) > 0 .and. .not. parameters%ends_with_stages) then
         if (has_end(options%stages(size(options%stages)))) options%stages = [options%stages, stage_type()]
      end if
      do i = 1, size(options%stages)
         call take(parameters%k01, options%stages(i)%k01)
      end do

   contains

      !> A number that the options do not give.
      pure subroutine take(value, given)
         real(wp), intent(in) :: value
         real(wp), intent(inout) :: given
         if (.not. is_set(given)) given = value
      end subroutine take

   end subroutine take_analysis

   !> All materials as the run has them. Weights stand there where gravity is not that of the options.
   subroutine take_materials(parameters, options)
      type(parameters_type), intent(in) :: parameters
      type(run_options_type), intent(inout) :: options
      integer :: i
      options%block_materials = parameters%block_materials
      options%joint_materials = parameters%joint_materials
      deallocate (options%joint_laws)
      allocate (options%joint_laws(0))
      do i = 1, size(options%block_materials)
         associate (m => options%block_materials(i))
            m%number = i
            if (parameters%gravity >= 0) m%weight = unset_real
            if (.not. any(abs(m%stress) > 0)) m%stress = unset_real
            if (.not. any(abs(m%stress_gradient) > 0)) m%stress_gradient = unset_real
            if (.not. any(abs(m%velocity) > 0)) m%velocity = unset_real
         end associate
      end do
      do i = 1, size(options%joint_materials)
         associate (m => options%joint_materials(i))
            if (m%law == 'coulomb') m%law = ''
            if (.not. abs(m%dilation) > 0) m%dilation = unset_real
            if (.not. abs(m%damping_ratio) > 0) m%damping_ratio = unset_real
            m%brittle_given = .true.
         end associate
      end do
   end subroutine take_materials

   !> Tables of points as groups; points with the same table share a group.
   function tables_of(tables) result(groups)
      type(time_table_type), intent(in) :: tables(:)
      type(point_table_type), allocatable :: groups(:)
      type(point_table_type), allocatable :: all_groups(:)
      logical :: done(size(tables))
      integer :: i, k, n
      allocate (all_groups(size(tables)))
      n = 0
      done = .false.
      do i = 1, size(tables)
         if (done(i) .or. .not. allocated(tables(i)%rows)) cycle
         if (size(tables(i)%rows, 2) == 0) cycle
         n = n + 1
         all_groups(n)%rows = tables(i)%rows
         if (allocated(tables(i)%name)) all_groups(n)%name = tables(i)%name
         allocate (all_groups(n)%points(0))
         do k = i, size(tables)
            if (.not. (same_rows(tables(i), tables(k)) .and. same_load(tables(i), tables(k)))) cycle
            all_groups(n)%points = [all_groups(n)%points, k]
            done(k) = .true.
         end do
      end do
      groups = all_groups(1:n)
   end function tables_of

   !> Are two tables the same?
   pure logical function same_rows(a, b)
      type(time_table_type), intent(in) :: a, b
      same_rows = .false.
      if (.not. allocated(b%rows)) return
      if (size(a%rows) /= size(b%rows)) return
      same_rows = .not. any(abs(a%rows - b%rows) > 0)
   end function same_rows

   !> Do two tables belong to loads of one name, or of none?
   pure logical function same_load(a, b)
      type(time_table_type), intent(in) :: a, b
      same_load = is_given(a%name) .eqv. is_given(b%name)
      if (is_given(a%name) .and. is_given(b%name)) same_load = same_name(a%name, b%name)
   end function same_load

   !> Number of loading points that groups add to those of the geometry.
   pure integer function n_placed(groups)
      type(point_table_type), intent(in) :: groups(:)
      integer :: i
      n_placed = 0
      do i = 1, size(groups)
         if (allocated(groups(i)%at)) n_placed = n_placed + size(groups(i)%at, 2)
      end do
   end function n_placed

   !> The groups that add loading points, without the numbers of these.
   pure function placed(groups)
      type(point_table_type), intent(in) :: groups(:)
      type(point_table_type), allocatable :: placed(:)
      integer :: i
      allocate (placed(0))
      do i = 1, size(groups)
         if (.not. allocated(groups(i)%at)) cycle
         placed = [placed, groups(i)]
         deallocate (placed(size(placed))%points)
      end do
   end function placed

   !> Is a text given and not blank?
   pure logical function is_given(text)
      character(len=:), allocatable, intent(in) :: text
      is_given = .false.
      if (allocated(text)) is_given = len_trim(text) > 0
   end function is_given

end module rockdda_run_labelled_text
