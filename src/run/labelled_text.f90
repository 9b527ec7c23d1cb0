! SPDX-License-Identifier: MIT
!> The labelled file of a model that was read from other files: run by itself it gives the same results, bit for bit.
!>
!> Options as the text of an options file: each value that is given, by the table of options. Numbers read back exactly.
module rockdda_run_labelled_text
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : is_given, replaced, to_string
   use rockdda_linear_factory, only : default_solver
   use rockdda_model_analysis_input, only : analysis_input_type, time_table_type, dialect
   use rockdda_model_options, only : run_options_type, point_table_type, stage_type, unset_real, is_set
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_regions, only : same_name
   use rockdda_model_stage_options, only : has_end, has_base_motion, stage_name
   use rockdda_io_namelist_parser, only : beside
   use rockdda_run_input, only : model_input_type
   use rockdda_model_option, only : option_type, option_kind
   use rockdda_model_option_rows, only : option_rows_type
   use rockdda_model_option_table, only : all_options, describe_options
   use rockdda_io_text_output, only : exact_text, exact_row
   implicit none
   private
   public :: labelled_text

   !> Lines are broken between values beyond this length.
   integer, parameter :: longest_line = 110

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
      ! after the last of its stages this run continues, that of a labelled file does not
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

   !> The text of an options file with these options: &model and materials come first.
   function options_text(options) result(text)
      type(run_options_type), intent(in) :: options
      character(len=:), allocatable :: text
      character(len=:), allocatable :: head, tail, name, entries, value
      type(option_rows_type) :: table, defaults
      type(run_options_type) :: given
      type(parameters_type) :: no_parameters
      integer :: i, first
      given = options
      call describe_options(table, given, no_parameters)
      defaults = all_options()
      head = ''
      tail = ''
      i = 1
      do while (i <= table%n)
         first = i
         name = trim(table%groups(table%rows(i)%group)%name)
         entries = ''
         do while (table%is_beside(first, i))
            associate (row => table%rows(i))
               value = value_text(row)
               if (is_default(row, defaults)) value = ''
               if (len(value) > 0) call put(entries, name, row%name, value)
            end associate
            i = i + 1
         end do
         if (len(entries) == 0) cycle
         entries = '&'//name//entries//' /'//new_line('a')
         select case (name)
         case ('model', 'block_material', 'joint_material'); head = head//entries
         case default; tail = tail//entries
         end select
      end do
      text = head//tail
   end function options_text

   !> Is a value that may not have been given that of an empty record?
   pure logical function is_default(row, defaults)
      type(option_type), intent(in) :: row
      type(option_rows_type), intent(in) :: defaults
      integer :: i
      is_default = .false.
      do i = 1, defaults%n
         if (defaults%rows(i)%group /= row%group .or. defaults%rows(i)%name /= row%name) cycle
         associate (given => row%given, default => defaults%rows(i)%given)
            select case (row%kind)
            case (option_kind%logical)
               is_default = .not. given%is_given .and. (given%flag .eqv. default%flag)
            case (option_kind%number)
               is_default = row%element > 0 .and. .not. (row%required .or. abs(given%number - default%number) > 0)
            end select
         end associate
      end do
   end function is_default

   !> Add "name = value" to the entries of a group.
   pure subroutine put(entries, group, name, value)
      character(len=:), allocatable, intent(inout) :: entries
      character(len=*), intent(in) :: group, name, value
      character(len=:), allocatable :: line
      line = entries(index(entries, new_line('a'), back=.true.) + 1:)
      if (len(entries) > 0) entries = entries//','
      if (len(line) + len(group) + len(name) + len(value) > longest_line .and. len(line) > 0) &
         entries = entries//new_line('a')//'  '
      entries = entries//' '//name//' = '//value
   end subroutine put

   !> The value of an option as a file has it; empty where none is given.
   pure function value_text(row) result(text)
      type(option_type), intent(in) :: row
      character(len=:), allocatable :: text
      integer :: i
      text = ''
      associate (given => row%given)
         select case (row%kind)
         case (option_kind%number)
            ! a value on an excluded bound means none, as 0 does for a stiffness of joints
            if (is_set(given%number) .and. .not. (row%above .and. given%number <= row%least)) &
               text = exact_text(given%number)
         case (option_kind%whole)
            if (is_set(given%whole)) text = to_string(given%whole)
         case (option_kind%logical)
            text = trim(merge('.true. ', '.false.', given%flag))
         case (option_kind%text, option_kind%choice, option_kind%file, option_kind%record)
            if (.not. allocated(given%text)) return
            if (len_trim(given%text) > 0) text = quoted(given%text)
         case (option_kind%numbers, option_kind%list)
            if (.not. allocated(given%numbers)) return
            if (all(is_set(given%numbers))) text = exact_row(given%numbers, ', ')
         case (option_kind%wholes)
            if (.not. allocated(given%wholes)) return
            do i = 1, size(given%wholes)
               if (i > 1) text = text//', '
               text = text//to_string(given%wholes(i))
            end do
         case (option_kind%rows)
            if (.not. allocated(given%rows)) return
            ! each on a line of its own
            do i = 1, size(given%rows, 2)
               if (i > 1) text = text//','//new_line('a')//'    '
               text = text//exact_row(given%rows(:, i), ', ')
            end do
         end select
      end associate
   end function value_text

   !> A text in quotes; a quote in it is doubled.
   pure function quoted(text)
      character(len=*), intent(in) :: text
      character(len=:), allocatable :: quoted
      quoted = "'"//replaced(trim(text), "'", "''")//"'"
   end function quoted

end module rockdda_run_labelled_text
