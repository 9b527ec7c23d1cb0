! SPDX-License-Identifier: MIT
!> The text log of a run: what was read, the numbers it runs with, and one line per reported step.
!>
!> It is written beside the results: OUT.log for OUT.h5. The numbers of a run are one "quantity = value" for each row of
!> the table of options, then materials and time tables.
module rockdda_io_log
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type
   use rockdda_base_strings, only : printable, to_string, counted
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_options, only : run_options_type, is_set
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_state, only : step_record_type, n_energies, energy_names
   use rockdda_model_analysis_input, only : time_table_type
   use rockdda_model_option, only : option_type, option_value_type, option_kind, choice, n_choices
   use rockdda_model_option_rows, only : option_rows_type, fill_defaults
   use rockdda_model_option_table, only : describe_parameters
   use rockdda_model_units, only : unit_system_type, unit_system
   use rockdda_io_file_sink, only : file_sink_type
   implicit none
   private
   public :: log_type, log_path, model_text, parameters_text, columns_text, step_text

   !> Rows of a table that share a line.
   integer, parameter :: rows_per_line = 4

   type :: parameter_text_type
      character(len=:), allocatable :: text          !! lines so far, each behind a line end
      type(unit_system_type) :: system
   contains
      procedure, private :: line
   end type parameter_text_type

   !> The file. A failure is reported by `put`, or by `flush` or `close` later.
   type, extends(file_sink_type) :: log_type
   contains
      procedure :: put
   end type log_type

contains

   !> Path of the log beside a results file: its ending .h5, .hdf5 or .hdf replaced by .log, else .log added.
   pure function log_path(results_path) result(path)
      character(len=*), intent(in) :: results_path
      character(len=:), allocatable :: path
      character(len=*), parameter :: endings(3) = [character(len=5) :: '.h5', '.hdf5', '.hdf']
      integer :: i, n
      do i = 1, size(endings)
         n = len(results_path) - len_trim(endings(i))
         if (n < 1) cycle
         if (results_path(n + 1:) /= trim(endings(i))) cycle
         path = results_path(1:n)//'.log'
         return
      end do
      path = results_path//'.log'
   end function log_path

   !> Write one line (or several, separated by line ends).
   subroutine put(self, text, error)
      class(log_type), intent(inout) :: self
      character(len=*), intent(in) :: text
      type(error_type), allocatable, intent(out) :: error
      call self%file_sink_type%put(printable(text, achar(9)//new_line('a'))//new_line('a'), error)
   end subroutine put

   !> The size of the model.
   pure function model_text(blocks) result(text)
      type(block_system_type), intent(in) :: blocks
      character(len=:), allocatable :: text
      text = 'model: '//to_string(blocks%n_blocks)//' blocks, '//to_string(blocks%n_vertices())//' vertices, '// &
             to_string(blocks%fixed%n)//' fixed points, '//to_string(blocks%loading%n)//' loading points, '// &
             to_string(blocks%measured%n)//' measured points, '//to_string(blocks%bolts%n)//' bolts'
   end function model_text

   !> The head of the table of steps.
   pure function columns_text() result(head)
      character(len=:), allocatable :: head
      integer :: i
      head = '#     step          time            dt  tries rounds   solver     open  sliding   locked'// &
             '      disp/w0       penalty   unbalanced stage'
      do i = 1, n_energies
         head = head//' '//right(trim(energy_names(i)), 21)
      end do
   end function columns_text

   !> The line of an accepted step.
   pure function step_text(record, parameters) result(line)
      type(step_record_type), intent(in) :: record
      type(parameters_type), intent(in) :: parameters
      character(len=:), allocatable :: line
      character(len=400) :: text
      real(wp) :: ratio
      ratio = 0
      if (parameters%w0 > 0) ratio = record%max_displacement/parameters%w0
      write (text, '(i10, 2es14.6, i7, i7, i9, 3i9, es13.4, es14.6, es13.4, i6, *(es22.13))') record%step, &
         record%time, record%dt, record%attempts, record%open_close_iterations, record%solver_iterations, &
         record%contacts, ratio, parameters%normal_stiffness, record%unbalanced, record%stage + 1, record%energy
      line = trim(text)
   end function step_text

   !> Text at the right end of a column.
   pure function right(text, width) result(column)
      character(len=*), intent(in) :: text
      integer, intent(in) :: width
      character(len=width) :: column
      column = adjustr(text//repeat(' ', max(0, width - len(text))))
   end function right

   !> All numbers of a run, also what does not enter the computation (frames, threads, files).
   function parameters_text(parameters, options) result(text)
      type(parameters_type), intent(in) :: parameters
      type(run_options_type), intent(in) :: options
      character(len=:), allocatable :: text
      type(parameters_type) :: p
      type(run_options_type) :: o
      type(parameter_text_type) :: log
      type(option_rows_type) :: table
      integer :: i
      logical :: has_materials
      p = parameters
      o = options
      call describe_parameters(table, o, p)
      call fill_defaults(table, p%windows_contacts)
      log%system = unit_system(p%units)
      log%text = 'parameters:'
      call log%line('units', log%system%description())
      has_materials = .false.
      do i = 1, table%n
         associate (row => table%rows(i), name => table%groups(table%rows(i)%group)%name)
            if (name == 'change') cycle
            if (row%element == 0) then
               call put_setting(log, row)
               cycle
            end if
            if (.not. has_materials) call put_materials()
            has_materials = .true.
            if (.not. table%is_beside(i, i - 1)) call log%line(trim(name)//' '//to_string(row%element), '')
            call put_in_list(log, row)
         end associate
      end do
      if (.not. has_materials) call put_materials()
      call put_time_tables(log, 'fixed point', 't, x, y', p%fixed_tables)
      call put_time_tables(log, 'loading point', 't, fx, fy', p%loading_tables)
      text = log%text

   contains

      !> A line for each block material.
      subroutine put_materials()
         character(len=:), allocatable :: label
         integer :: k
         do k = 1, size(p%block_materials)
            associate (m => p%block_materials(k))
               label = 'block material '//to_string(k)
               if (allocated(m%name)) label = trim(label//' '//m%name)
               call log%line(label, 'density '//shown(m%density, 'mass/length^2')//', weight '// &
                             shown(m%weight, 'force/length^2')//', E '//shown(m%youngs_modulus, 'stress')//', nu '// &
                             number(m%poisson_ratio)//', stress '//numbers(m%stress)//of('stress')// &
                             ', its gradient with y '//numbers(m%stress_gradient)//of('stress/length')// &
                             ', velocity '//numbers(m%velocity)//of('length/time'))
            end associate
         end do
      end subroutine put_materials

      !> A value with its unit.
      function shown(value, dimension)
         real(wp), intent(in) :: value
         character(len=*), intent(in) :: dimension
         character(len=:), allocatable :: shown
         shown = log%system%shown(value, dimension, 10)
      end function shown

      !> The unit of numbers as they stand there.
      function of(dimension)
         character(len=*), intent(in) :: dimension
         character(len=:), allocatable :: of
         of = ''
         if (log%system%is_known()) of = ' '//log%system%unit_of(dimension)
      end function of

   end function parameters_text

   !> Write the tables of points; points with equal tables one after another share an entry.
   subroutine put_time_tables(log, what, columns, tables)
      type(parameter_text_type), intent(inout) :: log
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
            if (size(tables(i)%rows, 2) > 0) call log%line(label, rows_text(columns, tables(i)%rows))
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

   !> Write one "quantity = value" line.
   subroutine line(self, quantity, value)
      class(parameter_text_type), intent(inout) :: self
      character(len=*), intent(in) :: quantity, value
      self%text = self%text//new_line('a')//'  '//quantity//repeat(' ', max(0, 34 - len(quantity)))//' = '//value
   end subroutine line

   !> Write a setting on a line of its own; a bound that there is not is left out.
   subroutine put_setting(log, row)
      type(parameter_text_type), intent(inout) :: log
      type(option_type), intent(in) :: row
      character(len=:), allocatable :: value
      if (row%kind == option_kind%computed .and. .not. row%used%number < huge(1.0_wp)) return
      value = value_text(log, row)
      if (len(value) == 0) value = row%default_text
      if (len(value) == 0) value = 'none'
      call log%line(row%quantity, value)
   end subroutine put_setting

   !> Write a value of an element of a list, if it is given, at the end of the line of the element.
   subroutine put_in_list(log, row)
      type(parameter_text_type), intent(inout) :: log
      type(option_type), intent(in) :: row
      character(len=:), allocatable :: value
      value = value_text(log, row)
      if (len(value) == 0) return
      if (log%text(len(log%text) - 1:) /= '= ') log%text = log%text//', '
      log%text = log%text//row%name//' '//value
   end subroutine put_in_list

   !> The value that the run uses, or else the one that is given; empty: none.
   function value_text(log, row) result(text)
      type(parameter_text_type), intent(in) :: log
      type(option_type), intent(in) :: row
      character(len=:), allocatable :: text
      type(option_value_type) :: value
      value = row%given
      if (row%in_run) value = row%used
      text = ''
      select case (row%kind)
      case (option_kind%number, option_kind%computed)
         ! one below its bounds was not given
         if (.not. (row%above .and. value%number <= row%least) .and. value%number >= row%least .and. &
             abs(value%number) < 0.5_wp*huge(1.0_wp)) text = log%system%shown(value%number, row%unit, 10)
      case (option_kind%whole)
         if (.not. is_set(value%whole)) return
         text = to_string(value%whole)
         if (value%whole == huge(1)) text = 'no limit'
         if (value%whole < row%least) text = 'none'
      case (option_kind%logical)
         text = trim(merge('.true. ', '.false.', value%flag))
      case (option_kind%text, option_kind%choice)
         if (row%true_for > 0) then
            if (value%flag) text = choice(row, row%true_for)
            if (.not. value%flag .and. n_choices(row) > 1) text = choice(row, 3 - row%true_for)
         else
            if (allocated(value%text)) text = value%text
            if (len(text) == 0) text = row%default_word
         end if
      case (option_kind%numbers, option_kind%list)
         if (allocated(value%numbers)) text = numbers(value%numbers)//unit_text(log, row)
      case (option_kind%wholes)
         if (allocated(value%wholes)) text = numbers(real(value%wholes, wp))
      case (option_kind%rows, option_kind%file)
         if (allocated(value%rows)) text = rows_text(row%columns, value%rows)//unit_text(log, row)
      case (option_kind%record)
         if (allocated(value%rows)) text = record_text(value%rows)
      end select
   end function value_text

   !> The unit of the numbers of a row as they stand there, ' m'; nothing where it is not known.
   pure function unit_text(log, row) result(text)
      type(parameter_text_type), intent(in) :: log
      type(option_type), intent(in) :: row
      character(len=:), allocatable :: text
      text = ''
      if (log%system%is_known() .and. len(row%unit) > 0 .and. index(row%unit, ',') == 0) &
         text = ' '//log%system%unit_of(row%unit)
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

end module rockdda_io_log
