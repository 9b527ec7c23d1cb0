! SPDX-License-Identifier: MIT
!> The numbers of a run as lines of the log: one "quantity = value" for each row of the table of options, then materials
!> and time tables.
module rockdda_io_parameter_text
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : origin_type
   use rockdda_base_strings, only : counted, to_string
   use rockdda_model_analysis_input, only : time_table_type
   use rockdda_model_boundary_options, only : describe_boundaries
   use rockdda_model_option, only : option_visitor_type, option_type, choice
   use rockdda_model_option_defaults, only : defaults_type
   use rockdda_model_option_table, only : describe_settings, describe_lists
   use rockdda_model_region_options, only : describe_regions
   use rockdda_model_options, only : run_options_type, is_set
   use rockdda_model_quake_options, only : describe_quakes
   use rockdda_model_water_options, only : describe_water
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_units, only : unit_system_type, unit_system
   implicit none
   private
   public :: parameters_text

   !> Rows of a table that share a line.
   integer, parameter :: rows_per_line = 4

   type, extends(option_visitor_type) :: parameter_text_type
      character(len=:), allocatable :: text          !! lines so far, each behind a line end
      character(len=:), allocatable :: group
      logical :: in_list = .false.
      logical :: has_options = .false.
      type(unit_system_type) :: system
   contains
      procedure :: begin => text_begin
      procedure :: start_element => text_element
      procedure :: add_real => text_real
      procedure :: add_integer => text_integer
      procedure :: add_logical => text_logical
      procedure :: add_text => text_text
      procedure :: add_choice => text_choice
      procedure :: add_reals => text_reals
      procedure :: add_list => text_list
      procedure :: add_integers => text_integers
      procedure :: add_rows => text_rows
      procedure :: add_file => text_file
      procedure :: add_record => text_record
      procedure :: used => text_used
      procedure, private :: put
      procedure, private :: line
   end type parameter_text_type

contains

   !> All numbers of a run; with options also what does not enter the computation (frames, threads, files).
   function parameters_text(parameters, options) result(text)
      type(parameters_type), intent(in) :: parameters
      type(run_options_type), intent(in), optional :: options
      character(len=:), allocatable :: text
      type(parameters_type) :: p
      type(run_options_type) :: o
      type(parameter_text_type) :: table
      type(defaults_type) :: defaults
      character(len=:), allocatable :: label
      integer :: i
      p = parameters
      if (present(options)) o = options
      defaults%preset = p%peer_contacts
      call describe_settings(defaults, o, p)
      table%has_options = present(options)
      table%system = unit_system(p%units)
      table%text = ''
      call table%line('units', table%system%description())
      call describe_settings(table, o, p)
      do i = 1, size(p%block_materials)
         associate (m => p%block_materials(i))
            label = 'block material '//to_string(i)
            if (allocated(m%name)) label = trim(label//' '//m%name)
            call table%line(label, 'density '//shown(m%density, 'mass/length^2')//', weight '// &
                            shown(m%weight, 'force/length^2')//', E '//shown(m%youngs_modulus, 'stress')//', nu '// &
                            number(m%poisson_ratio)//', stress '//numbers(m%stress)//of('stress')// &
                            ', its gradient with y '//numbers(m%stress_gradient)//of('stress/length')// &
                            ', velocity '//numbers(m%velocity)//of('length/time'))
         end associate
      end do
      call describe_lists(table, p%line_loads, p%joint_materials, p%stages)
      call describe_regions(table, p%regions, p%subdivisions)
      call describe_boundaries(table, p%boundaries, p%in_situ)
      call describe_water(table, p%water)
      call describe_quakes(table, p%quakes)
      call put_time_tables(table, 'fixed point', 't, x, y', p%fixed_tables)
      call put_time_tables(table, 'loading point', 't, fx, fy', p%loading_tables)
      text = table%text

   contains

      !> A value with its unit.
      function shown(value, dimension)
         real(wp), intent(in) :: value
         character(len=*), intent(in) :: dimension
         character(len=:), allocatable :: shown
         shown = table%system%shown(value, dimension, 10)
      end function shown

      !> The unit of numbers as they stand there.
      function of(dimension)
         character(len=*), intent(in) :: dimension
         character(len=:), allocatable :: of
         of = ''
         if (table%system%is_known()) of = ' '//table%system%unit_of(dimension)
      end function of

   end function parameters_text

   !> Write the tables of points; points with equal tables one after another share an entry.
   subroutine put_time_tables(table, what, columns, tables)
      class(parameter_text_type), intent(inout) :: table
      character(len=*), intent(in) :: what, columns
      type(time_table_type), intent(in) :: tables(:)
      character(len=:), allocatable :: label
      integer :: i, last
      i = 1
      do while (i <= size(tables))
         last = i
         do while (last < size(tables))
            if (.not. same_rows(tables(i)%rows, tables(last + 1)%rows)) exit
            if (name_of(tables(i)) /= name_of(tables(last + 1))) exit
            last = last + 1
         end do
         if (allocated(tables(i)%rows)) then
            label = 'table of '//what//' '//to_string(i)
            if (last > i) label = label//' to '//to_string(last)
            if (len(name_of(tables(i))) > 0) label = label//' ('//name_of(tables(i))//')'
            if (size(tables(i)%rows, 2) > 0) call table%line(label, rows_text(columns, tables(i)%rows))
         end if
         i = last + 1
      end do
   end subroutine put_time_tables

   !> The name of a load; '' without one.
   pure function name_of(table) result(name)
      type(time_table_type), intent(in) :: table
      character(len=:), allocatable :: name
      name = ''
      if (allocated(table%name)) name = trim(table%name)
   end function name_of

   !> Are both tables equal, or both absent?
   pure logical function same_rows(a, b)
      real(wp), allocatable, intent(in) :: a(:, :), b(:, :)
      same_rows = allocated(a) .eqv. allocated(b)
      if (.not. (allocated(a) .and. allocated(b))) return
      same_rows = size(a) == size(b)
      if (same_rows) same_rows = .not. any(abs(a - b) > 0)
   end function same_rows

   !> Begin a group.
   subroutine text_begin(self, name, meaning, is_list)
      class(parameter_text_type), intent(inout) :: self
      character(len=*), intent(in) :: name, meaning
      logical, intent(in), optional :: is_list
      self%group = name
      self%in_list = .false.
      if (present(is_list)) self%in_list = is_list
      associate (unused => meaning)
      end associate
   end subroutine text_begin

   !> Begin the line of an element.
   subroutine text_element(self, i, origin)
      class(parameter_text_type), intent(inout) :: self
      integer, intent(in) :: i
      type(origin_type), intent(inout) :: origin
      call self%line(self%group//' '//to_string(i), '')
      associate (unused => origin)
      end associate
   end subroutine text_element

   !> Write one "quantity = value" line.
   subroutine line(self, quantity, value)
      class(parameter_text_type), intent(inout) :: self
      character(len=*), intent(in) :: quantity, value
      self%text = self%text//new_line('a')//'  '//quantity//repeat(' ', max(0, 34 - len(quantity)))//' = '//value
   end subroutine line

   !> Write a value of a row: on a line of its own, or in a list at the end of the line of the element.
   subroutine put(self, row, value, is_used)
      class(parameter_text_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      character(len=*), intent(in) :: value           !! empty: not given
      logical, intent(in) :: is_used                  !! a number of the run
      character(len=:), allocatable :: shown
      shown = value
      if (self%in_list) then
         if (len(value) == 0) return
         if (self%text(len(self%text) - 1:) /= '= ') self%text = self%text//', '
         self%text = self%text//row%name//' '//value
      else if (is_used .or. self%has_options) then
         if (len(shown) == 0) shown = row%default_text
         if (len(shown) == 0) shown = 'none'
         call self%line(row%quantity, shown)
      end if
   end subroutine put

   !> Write a real. One below its bounds was not given.
   subroutine text_real(self, row, given, used, origin)
      class(parameter_text_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      real(wp), intent(inout) :: given
      real(wp), intent(inout), optional :: used
      type(origin_type), intent(inout), optional :: origin
      real(wp) :: value
      value = given
      if (present(used)) value = used
      if (.not. (row%above .and. value <= row%least) .and. value >= row%least .and. &
          abs(value) < 0.5_wp*huge(value)) then
         call self%put(row, self%system%shown(value, row%unit, 10), present(used))
      else
         call self%put(row, '', present(used))
      end if
      associate (unused => present(origin))
      end associate
   end subroutine text_real

   !> Write a whole number.
   subroutine text_integer(self, row, given, used)
      class(parameter_text_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      integer, intent(inout) :: given
      integer, intent(inout), optional :: used
      integer :: value
      value = given
      if (present(used)) value = used
      if (.not. is_set(value)) then
         call self%put(row, '', present(used))
      else if (value < row%least) then
         call self%put(row, 'none', present(used))
      else if (value == huge(value)) then
         call self%put(row, 'no limit', present(used))
      else
         call self%put(row, to_string(value), present(used))
      end if
   end subroutine text_integer

   !> .true. or .false.
   subroutine text_logical(self, row, given, used, is_given)
      class(parameter_text_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      logical, intent(inout) :: given
      logical, intent(inout), optional :: used
      logical, intent(inout), optional :: is_given
      logical :: value
      value = given
      if (present(used)) value = used
      call self%put(row, trim(merge('.true. ', '.false.', value)), present(used))
      associate (unused => present(is_given))
      end associate
   end subroutine text_logical

   !> Write a text.
   subroutine text_text(self, row, given, used)
      class(parameter_text_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      character(len=:), allocatable, intent(inout) :: given
      character(len=:), allocatable, intent(inout), optional :: used
      character(len=:), allocatable :: value
      value = ''
      if (present(used)) then
         if (allocated(used)) value = used
      else if (allocated(given)) then
         value = given
      end if
      if (len(value) == 0) value = row%default_word
      call self%put(row, value, present(used))
   end subroutine text_text

   !> Write one of several words.
   subroutine text_choice(self, row, given, used, true_for)
      class(parameter_text_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      character(len=:), allocatable, intent(inout) :: given
      logical, intent(inout) :: used
      integer, intent(in) :: true_for
      if (used) then
         call self%put(row, choice(row, true_for), .true.)
      else if (index(row%choices, '|') > 0) then
         call self%put(row, choice(row, 3 - true_for), .true.)
      else
         call self%put(row, '', .true.)
      end if
      associate (unused => allocated(given))
      end associate
   end subroutine text_choice

   !> Write a fixed number of reals.
   subroutine text_reals(self, row, given, otherwise)
      class(parameter_text_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      real(wp), intent(inout) :: given(:)
      real(wp), intent(in), optional :: otherwise(:)
      call self%put(row, numbers(given)//unit_text(self, row), .true.)
      associate (unused => present(otherwise))
      end associate
   end subroutine text_reals

   !> Write any number of reals.
   subroutine text_list(self, row, given)
      class(parameter_text_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      real(wp), allocatable, intent(inout) :: given(:)
      if (allocated(given)) call self%put(row, numbers(given), .true.)
   end subroutine text_list

   !> Write any number of whole numbers.
   subroutine text_integers(self, row, given)
      class(parameter_text_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      integer, allocatable, intent(inout) :: given(:)
      if (allocated(given)) call self%put(row, numbers(real(given, wp)), .true.)
   end subroutine text_integers

   !> Write rows of reals.
   subroutine text_rows(self, row, given, used)
      class(parameter_text_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      real(wp), allocatable, intent(inout) :: given(:, :)
      real(wp), allocatable, intent(inout), optional :: used(:, :)
      if (present(used)) then
         call put_rows(self, row, used)
      else
         call put_rows(self, row, given)
      end if
   end subroutine text_rows

   !> Write rows of reals from a file.
   subroutine text_file(self, row, given, used, name)
      class(parameter_text_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      real(wp), allocatable, intent(inout) :: given(:, :), used(:, :)
      character(len=:), allocatable, intent(inout), optional :: name  !! of the file
      if (self%in_list) then
         call put_rows(self, row, given)
      else
         call put_rows(self, row, used)
      end if
      associate (unused => present(name))
      end associate
   end subroutine text_file

   !> Write what there is in a record.
   subroutine text_record(self, row, given, used, name, has_scale, unit)
      class(parameter_text_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      real(wp), allocatable, intent(inout) :: given(:, :), used(:, :)
      character(len=:), allocatable, intent(inout) :: name            !! of the file
      logical, intent(in) :: has_scale
      real(wp), intent(inout) :: unit
      if (allocated(given)) call self%put(row, record_text(given), .true.)
      associate (unused_1 => allocated(used), unused_2 => allocated(name), unused_3 => has_scale, unused_4 => unit)
      end associate
   end subroutine text_record

   !> Write a number that is computed from options and model.
   subroutine text_used(self, quantity, value, name)
      class(parameter_text_type), intent(inout) :: self
      character(len=*), intent(in) :: quantity
      real(wp), intent(inout) :: value
      character(len=*), intent(in), optional :: name
      character(len=:), allocatable :: dimension
      ! a bound that there is not
      if (.not. value < huge(1.0_wp)) return
      select case (quantity)
      case ('angle tolerance [rad]'); dimension = ''
      case ('longest step with accuracy'); dimension = 'time'
      case ('contact stiffness, shear', 'stiffness of fixed points'); dimension = 'force/length'
      case default; dimension = 'length'
      end select
      call self%line(quantity, self%system%shown(value, dimension, 10))
      associate (unused => present(name))
      end associate
   end subroutine text_used

   !> Write rows, if there are any.
   subroutine put_rows(self, row, rows)
      class(parameter_text_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      real(wp), allocatable, intent(in) :: rows(:, :)
      if (allocated(rows)) then
         call self%put(row, rows_text(row%columns, rows)//unit_text(self, row), .true.)
      else
         call self%put(row, '', .true.)
      end if
   end subroutine put_rows

   !> The unit of the numbers of a row as they stand there, ' m'; nothing where it is not known.
   pure function unit_text(self, row) result(text)
      class(parameter_text_type), intent(in) :: self
      type(option_type), intent(in) :: row
      character(len=:), allocatable :: text
      text = ''
      if (self%system%is_known() .and. len(row%unit) > 0 .and. index(row%unit, ',') == 0) &
         text = ' '//self%system%unit_of(row%unit)
   end function unit_text

   !> "4000 rows from t = 0 to 19.995, largest value 2.1"
   pure function record_text(rows) result(text)
      real(wp), intent(in) :: rows(:, :)
      character(len=:), allocatable :: text
      text = counted(size(rows, 2), 'row')
      if (size(rows, 2) == 0) return
      text = text//' from t = '//number(rows(1, 1))//' to '//number(rows(1, size(rows, 2)))//', largest value '// &
             number(maxval(abs(rows(2, :))))
   end function record_text

   !> "3 rows of t, ax, ay: (0 0 0) (1 2 0.5) (2 0 0)"
   function rows_text(columns, rows) result(text)
      character(len=*), intent(in) :: columns
      real(wp), intent(in) :: rows(:, :)
      character(len=:), allocatable :: text
      character(len=:), allocatable :: buffer
      integer :: i, n
      text = counted(size(rows, 2), 'row')//' of '//columns//':'
      ! grows by doubling: a table of an earthquake has many rows
      allocate (character(len=1000) :: buffer)
      n = 0
      do i = 1, size(rows, 2)
         if (i > rows_per_line .and. mod(i, rows_per_line) == 1) call append(new_line('a')//'   ')
         call append(' '//numbers(rows(:, i)))
      end do
      text = text//buffer(1:n)

   contains

      !> Append text to the buffer.
      subroutine append(more)
         character(len=*), intent(in) :: more
         do while (n + len(more) > len(buffer))
            buffer = buffer//repeat(' ', len(buffer))
         end do
         buffer(n + 1:n + len(more)) = more
         n = n + len(more)
      end subroutine append

   end function rows_text

   !> A real with enough digits to distinguish values.
   pure function number(value) result(text)
      real(wp), intent(in) :: value
      character(len=:), allocatable :: text
      text = to_string(value, 10)
   end function number

   !> Numbers between parentheses.
   pure function numbers(values) result(text)
      real(wp), intent(in) :: values(:)
      character(len=:), allocatable :: text
      integer :: i
      text = '('
      do i = 1, size(values)
         if (i > 1) text = text//' '
         text = text//number(values(i))
      end do
      text = text//')'
   end function numbers

end module rockdda_io_parameter_text
