! SPDX-License-Identifier: MIT
!> Records of an analysis file of a given dialect, and the rules for their values.
module rockdda_io_analysis_body
   use rockdda_base_kinds, only : wp, i8
   use rockdda_base_strings, only : to_string
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_model_analysis_input, only : analysis_input_type, block_material_type, joint_material_type, &
                                            time_table_type, dialect
   use rockdda_io_counting, only : analysis_needs
   use rockdda_io_record_reader, only : record_reader_type, largest_value
   use rockdda_io_tokens, only : token_list_type
   implicit none
   private
   public :: read_analysis_header, read_analysis_body, sor_name

   character(len=*), parameter :: sor_name = 'SOR factor'

   character(len=*), parameter :: block_names(13) = [character(len=19) :: 'density', 'weight', 'Young''s modulus', &
      'Poisson''s ratio', 'initial stress s11', 'initial stress s22', 'initial stress s12', 'stress gradient t11', &
      'stress gradient t22', 'stress gradient t12', 'velocity vx', 'velocity vy', 'angular velocity vr']
   character(len=*), parameter :: joint_names(3) = [character(len=16) :: &
      'friction angle', 'cohesion', 'tensile strength']
   character(len=*), parameter :: row_names(3) = [character(len=1) :: 't', 'x', 'y']

contains

   !> Read k01, number of steps, numbers of materials, g2, g1. ok is false when the numbers of materials are unknown.
   subroutine read_analysis_header(tokens, reader, analysis, counts, messages, ok)
      type(token_list_type), intent(in) :: tokens
      type(record_reader_type), intent(inout) :: reader
      type(analysis_input_type), intent(inout) :: analysis
      integer, intent(out) :: counts(2)           !! block materials, joint materials
      type(diagnostics_type), intent(inout) :: messages
      logical, intent(out) :: ok
      call reader%read_record(tokens, ['k01'], '', 0, messages)
      analysis%k01 = reader%record%value(1)
      call reader%require(tokens, analysis%k01 >= 0 .and. analysis%k01 <= 1, 1, &
                          'must be between 0 (static) and 1 (dynamic)', messages)
      call reader%read_count(tokens, 'number of time steps', analysis%n_steps, messages)
      call reader%read_count(tokens, 'number of block materials', counts(1), messages)
      call reader%require(tokens, counts(1) /= 0, 1, 'must be at least 1', messages)
      call reader%read_count(tokens, 'number of joint materials', counts(2), messages)
      call reader%require(tokens, counts(2) /= 0, 1, 'must be at least 1', messages)
      call read_positive('displacement ratio g2', analysis%displacement_ratio)
      call read_positive('largest time step g1', analysis%dt_max)
      ok = all(counts > 0)
      if (reader%n_missing > 0) then
         call messages%add(severity%error, reader%missing_name//': the file ends here', tokens%end_origin())
         ok = .false.
      end if

   contains

      !> Read a record of one number greater than 0.
      subroutine read_positive(name, value)
         character(len=*), intent(in) :: name
         real(wp), intent(out) :: value
         call reader%read_record(tokens, [name], '', 0, messages)
         value = reader%record%value(1)
         call reader%require(tokens, value > 0, 1, 'must be greater than 0', messages)
         call reader%require_size(tokens, largest_value, messages)
      end subroutine read_positive

   end subroutine read_analysis_header

   !> Read all records after g1. `exact` is true when the file has exactly the numbers that were read; otherwise the
   !> content is invalid.
   subroutine read_analysis_body(tokens, reader, n_points, counts, analysis, messages, exact)
      type(token_list_type), intent(in) :: tokens
      type(record_reader_type), intent(inout) :: reader  !! after the header
      integer, intent(in) :: n_points(2)                 !! fixed and loading points, used in dialect g0
      integer, intent(in) :: counts(2)                   !! block materials, joint materials
      type(analysis_input_type), intent(inout) :: analysis !! with its dialect
      type(diagnostics_type), intent(inout) :: messages
      logical, intent(out) :: exact
      integer :: i
      exact = .false.
      ! counts that exceed the file by far are refused before memory is allocated
      if (analysis_needs(counts(1), counts(2)) > 2_i8*tokens%n) return
      allocate (analysis%block_materials(counts(1)), analysis%joint_materials(counts(2)))
      if (analysis%dialect == dialect%g0) then
         call reader%read_record(tokens, ['contact stiffness g0'], '', 0, messages)
         analysis%stiffness = reader%record%value(1)
         call reader%require(tokens, analysis%stiffness >= 0, 1, 'must not be negative (0: automatic)', messages)
         call reader%require_size(tokens, largest_value, messages)
         call read_tables(tokens, reader, n_points, analysis%fixed_tables, analysis%loading_tables, messages, exact)
         if (.not. exact) return
      else
         allocate (analysis%fixed_tables(0), analysis%loading_tables(0))
      end if
      do i = 1, counts(1)
         if (.not. reader%goes_on(messages)) exit
         call read_block_material(tokens, reader, i, analysis%block_materials(i), messages)
      end do
      do i = 1, counts(2)
         if (.not. reader%goes_on(messages)) exit
         call read_joint_material(tokens, reader, i, analysis%joint_materials(i), messages)
      end do
      if (reader%n_missing == 0 .and. reader%numbers_left(tokens) > 0) &
         call read_sor_factor(tokens, reader, analysis%sor_factor, messages)
      exact = reader%is_exact(tokens) .or. reader%too_many_errors(messages)
   end subroutine read_analysis_body

   !> Read time-dependent values: all counts, then all rows, fixed points first.
   subroutine read_tables(tokens, reader, n_points, fixed, loading, messages, ok)
      type(token_list_type), intent(in) :: tokens
      type(record_reader_type), intent(inout) :: reader
      integer, intent(in) :: n_points(2)                 !! fixed, loading
      type(time_table_type), allocatable, intent(out) :: fixed(:), loading(:)
      type(diagnostics_type), intent(inout) :: messages
      logical, intent(out) :: ok
      integer :: n_rows(sum(n_points))
      integer :: k
      ok = .false.
      do k = 1, size(n_rows)
         if (reader%n_missing > 0) return
         call reader%read_count(tokens, 'number of time-dependent values of '// &
                                point_name(merge(1, 2, k <= n_points(1)))//' '// &
                                to_string(merge(k, k - n_points(1), k <= n_points(1))), n_rows(k), messages)
      end do
      n_rows = max(n_rows, 0)
      if (3*sum(int(n_rows, i8)) > tokens%n - reader%at + 1) return
      allocate (fixed(n_points(1)), loading(n_points(2)))
      do k = 1, n_points(1)
         call read_table(tokens, reader, point_name(1), k, n_rows(k), fixed(k), messages)
      end do
      do k = 1, n_points(2)
         call read_table(tokens, reader, point_name(2), k, n_rows(n_points(1) + k), loading(k), messages)
      end do
      ok = reader%goes_on(messages)
   end subroutine read_tables

   !> "fixed point" for 1, "loading point" for 2.
   pure function point_name(kind) result(name)
      integer, intent(in) :: kind
      character(len=:), allocatable :: name
      name = trim(merge('fixed point  ', 'loading point', kind == 1))
   end function point_name

   !> Read the rows t x y of one point.
   subroutine read_table(tokens, reader, object, number, n_rows, table, messages)
      type(token_list_type), intent(in) :: tokens
      type(record_reader_type), intent(inout) :: reader
      character(len=*), intent(in) :: object             !! 'fixed point'
      integer, intent(in) :: number, n_rows
      type(time_table_type), intent(inout) :: table
      type(diagnostics_type), intent(inout) :: messages
      integer :: row
      allocate (table%rows(3, n_rows))
      do row = 1, n_rows
         if (.not. reader%goes_on(messages)) return
         call reader%read_record(tokens, row_names, 'row '//to_string(row)//' of '//object, number, messages)
         table%rows(:, row) = reader%record%value(1:3)
         call reader%require_size(tokens, largest_value, messages)
         if (row == 1) then
            table%origin = reader%record_origin(tokens)
            cycle
         end if
         call reader%require(tokens, table%rows(1, row) >= table%rows(1, row - 1), 1, &
                             'must not be smaller than in the row before', messages)
      end do
   end subroutine read_table

   !> Read the 13 numbers of a block material.
   subroutine read_block_material(tokens, reader, number, material, messages)
      type(token_list_type), intent(in) :: tokens
      type(record_reader_type), intent(inout) :: reader
      integer, intent(in) :: number
      type(block_material_type), intent(inout) :: material
      type(diagnostics_type), intent(inout) :: messages
      call reader%read_record(tokens, block_names, 'block material', number, messages)
      associate (v => reader%record%value)
         material%density = v(1)
         material%weight = v(2)
         material%youngs_modulus = v(3)
         material%poisson_ratio = v(4)
         material%stress = v(5:7)
         material%stress_gradient = v(8:10)
         material%velocity = v(11:13)
      end associate
      call reader%require(tokens, material%density > 0, 1, 'must be greater than 0', messages)
      call reader%require(tokens, material%youngs_modulus > 0, 3, 'must be greater than 0', messages)
      call reader%require(tokens, material%poisson_ratio > -1 .and. material%poisson_ratio < 0.5_wp, 4, &
                          'must be between -1 and 0.5', messages)
      call reader%require_size(tokens, largest_value, messages)
   end subroutine read_block_material

   !> Read the 3 numbers of a joint material.
   subroutine read_joint_material(tokens, reader, number, material, messages)
      type(token_list_type), intent(in) :: tokens
      type(record_reader_type), intent(inout) :: reader
      integer, intent(in) :: number
      type(joint_material_type), intent(inout) :: material
      type(diagnostics_type), intent(inout) :: messages
      call reader%read_record(tokens, joint_names, 'joint material', number, messages)
      material%friction_angle = reader%record%value(1)
      material%cohesion = reader%record%value(2)
      material%tension = reader%record%value(3)
      call reader%require(tokens, material%friction_angle >= 0 .and. material%friction_angle < 90, 1, &
                          'must be at least 0 and less than 90 degrees', messages)
      call reader%require(tokens, material%cohesion >= 0, 2, 'must not be negative', messages)
      call reader%require(tokens, material%tension >= 0, 3, 'must not be negative', messages)
      call reader%require_size(tokens, largest_value, messages)
   end subroutine read_joint_material

   !> Read the factor at the end of the file.
   subroutine read_sor_factor(tokens, reader, factor, messages)
      type(token_list_type), intent(in) :: tokens
      type(record_reader_type), intent(inout) :: reader
      real(wp), intent(inout) :: factor              !! unchanged when the file has no valid one
      type(diagnostics_type), intent(inout) :: messages
      real(wp) :: found
      integer :: place, before
      logical :: behind                              !! other numbers of its line, one of which it may be
      call reader%read_record(tokens, [sor_name], '', 0, messages)
      if (reader%record%token(1) == 0) return
      found = reader%record%value(1)
      place = reader%record%token(1)
      behind = .false.
      if (place > 1) behind = tokens%line(place - 1) == tokens%line(place)
      before = messages%n_errors
      if (found >= 1 .and. found < 2) then
         factor = found
         if (behind) call report_shift(found, tokens, .false., messages)
      else
         if (before == 0) call report_shift(found, tokens, behind, messages)
         if (messages%n_errors == before) call messages%add(severity%note, 'SOR factor '//to_string(found)// &
            ' is outside [1, 2): 1.4 is used', tokens%origin(place))
      end if
   end subroutine read_sor_factor

   !> Report a decimal comma in a file with an SOR factor: one number too many shifts all that follow it, so that the
   !> last
   !> one is taken as the factor.
   subroutine report_shift(factor, tokens, in_a_row, messages)
      real(wp), intent(in) :: factor
      type(token_list_type), intent(in) :: tokens
      logical, intent(in) :: in_a_row                !! also commas of which several follow one another
      type(diagnostics_type), intent(inout) :: messages
      character(len=:), allocatable :: first, second
      integer :: i
      do i = 1, tokens%n - 1
         if (.not. tokens%has_decimal_comma(i, in_a_row)) cycle
         first = tokens%text(i)
         second = tokens%text(i + 1)
         call messages%add(severity%error, "'"//first//','//second//"' is two numbers, because a comma separates "// &
                           'numbers, and the last number of the file, '//to_string(factor)//', is then read as an '// &
                           'SOR factor: for a decimal comma write '//first//'.'//second//', for two numbers '// &
                           first//' '//second, tokens%origin(i))
         return
      end do
   end subroutine report_shift

end module rockdda_io_analysis_body
