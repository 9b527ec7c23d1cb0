! SPDX-License-Identifier: MIT
!> Records of an analysis file of a given dialect, and the rules for their values.
module rockdda_io_analysis_body
   use rockdda_base_kinds, only : wp, i8
   use rockdda_base_strings, only : to_string
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_model_analysis_input, only : analysis_input_type, time_table_type, dialect
   use rockdda_io_counting, only : analysis_needs
   use rockdda_io_record_reader, only : record_reader_type, largest_value
   use rockdda_io_tokens, only : token_list_type
   implicit none
   private
   public :: read_analysis_header, read_analysis_body

   character(len=*), parameter :: block_names(13) = [character(len=19) :: 'density', 'weight', 'Young''s modulus', &
      'Poisson''s ratio', 'initial stress s11', 'initial stress s22', 'initial stress s12', 'stress gradient t11', &
      'stress gradient t22', 'stress gradient t12', 'velocity vx', 'velocity vy', 'angular velocity vr']
   character(len=*), parameter :: joint_names(3) = [character(len=16) :: &
      'friction angle', 'cohesion', 'tensile strength']
   character(len=*), parameter :: row_names(3) = [character(len=1) :: 't', 'x', 'y']

contains

   !> k01, number of steps, numbers of materials, g2, g1. ok is false when the numbers of materials are unknown.
   subroutine read_analysis_header(tokens, reader, analysis, counts, messages, ok)
      type(token_list_type), intent(in) :: tokens
      type(record_reader_type), intent(inout) :: reader
      type(analysis_input_type), intent(inout) :: analysis
      integer, intent(out) :: counts(2)           !! block materials, joint materials
      type(diagnostics_type), intent(inout) :: messages
      logical, intent(out) :: ok
      call read_single('k01')
      analysis%k01 = reader%record%value(1)
      call reader%require(tokens, analysis%k01 >= 0 .and. analysis%k01 <= 1, 1, 'k01', '', 0, &
                          'must be between 0 (static) and 1 (dynamic)', messages)
      call reader%read_count(tokens, 'number of time steps', analysis%n_steps, messages)
      call reader%read_count(tokens, 'number of block materials', counts(1), messages)
      call reader%require(tokens, counts(1) /= 0, 1, 'number of block materials', '', 0, 'must be at least 1', messages)
      call reader%read_count(tokens, 'number of joint materials', counts(2), messages)
      call reader%require(tokens, counts(2) /= 0, 1, 'number of joint materials', '', 0, 'must be at least 1', messages)
      call read_single('displacement ratio g2')
      analysis%displacement_ratio = reader%record%value(1)
      call check_positive('displacement ratio g2')
      call read_single('largest time step g1')
      analysis%dt_max = reader%record%value(1)
      call check_positive('largest time step g1')
      ok = all(counts > 0)
      if (reader%n_missing > 0) then
         call messages%add(severity%error, reader%missing_name//': the file ends here', tokens%end_origin())
         ok = .false.
      end if

   contains

      !> A record of one number.
      subroutine read_single(name)
         character(len=*), intent(in) :: name
         character(len=len(name)) :: names(1)
         names(1) = name
         call reader%read_record(tokens, names, '', 0, messages)
      end subroutine read_single

      !> Finite and greater than 0.
      subroutine check_positive(name)
         character(len=*), intent(in) :: name
         call reader%require(tokens, reader%record%value(1) > 0, 1, name, '', 0, 'must be greater than 0', messages)
         call reader%require(tokens, reader%record%value(1) <= largest_value, 1, name, '', 0, &
                             'must not be larger than '//to_string(largest_value), messages)
      end subroutine check_positive

   end subroutine read_analysis_header

   !> Read all records after g1. `exact` is true when the file has exactly the numbers that were read; otherwise the
   !> content is invalid.
   subroutine read_analysis_body(tokens, reader, way, n_fixed, n_loading, counts, analysis, messages, exact)
      type(token_list_type), intent(in) :: tokens
      type(record_reader_type), intent(inout) :: reader  !! after the header
      integer, intent(in) :: way                         !! dialect%peer or dialect%g0
      integer, intent(in) :: n_fixed, n_loading          !! points, used in dialect g0
      integer, intent(in) :: counts(2)                   !! block materials, joint materials
      type(analysis_input_type), intent(inout) :: analysis
      type(diagnostics_type), intent(inout) :: messages
      logical, intent(out) :: exact
      character(len=10) :: single(1)
      integer :: i

      exact = .false.
      if (analysis_needs(counts(1), counts(2)) > tokens%n) return
      analysis%dialect = way
      allocate (analysis%block_materials(counts(1)), analysis%joint_materials(counts(2)))
      if (way == dialect%g0) then
         single(1) = 'g0'
         call reader%read_record(tokens, single, '', 0, messages)
         analysis%stiffness = reader%record%value(1)
         call reader%require(tokens, analysis%stiffness >= 0, 1, 'contact stiffness g0', '', 0, &
                             'must not be negative (0: automatic)', messages)
         call reader%require_size(tokens, largest_value, single, '', 0, messages)
         call read_tables(exact)
         if (.not. exact) return
         exact = .false.
      else
         allocate (analysis%fixed_tables(0), analysis%loading_tables(0))
      end if
      do i = 1, counts(1)
         if (reader%n_missing > 0 .or. reader%too_many_errors(messages)) exit
         call read_block_material(i)
      end do
      do i = 1, counts(2)
         if (reader%n_missing > 0 .or. reader%too_many_errors(messages)) exit
         call read_joint_material(i)
      end do
      if (reader%n_missing == 0 .and. reader%numbers_left(tokens) > 0) call read_sor_factor()
      exact = reader%is_exact(tokens) .or. reader%too_many_errors(messages)

   contains

      !> Time-dependent values: all counts, then all rows, fixed points first.
      subroutine read_tables(ok)
         logical, intent(out) :: ok
         integer :: n_rows(n_fixed + n_loading)
         integer(i8) :: total
         integer :: k, row, n, number
         character(len=:), allocatable :: object
         ok = .false.
         total = 0
         do k = 1, n_fixed + n_loading
            if (reader%n_missing > 0) return
            object = 'fixed point'
            number = k
            if (k > n_fixed) object = 'loading point'
            if (k > n_fixed) number = k - n_fixed
            call reader%read_count(tokens, 'number of time-dependent values of '//object//' '//to_string(number), &
                                   n_rows(k), messages)
            if (n_rows(k) < 0) n_rows(k) = 0
            total = total + n_rows(k)
         end do
         if (3*total > tokens%n - reader%at + 1) return
         allocate (analysis%fixed_tables(n_fixed), analysis%loading_tables(n_loading))
         do k = 1, n_fixed + n_loading
            n = n_rows(k)
            if (k <= n_fixed) then
               allocate (analysis%fixed_tables(k)%rows(3, n))
            else
               allocate (analysis%loading_tables(k - n_fixed)%rows(3, n))
            end if
            do row = 1, n
               if (reader%n_missing > 0 .or. reader%too_many_errors(messages)) return
               if (k <= n_fixed) then
                  call read_row('fixed point', k, row, analysis%fixed_tables(k)%rows)
               else
                  call read_row('loading point', k - n_fixed, row, analysis%loading_tables(k - n_fixed)%rows)
               end if
            end do
         end do
         ok = .true.
      end subroutine read_tables

      !> One row t x y.
      subroutine read_row(object, number, row, rows)
         character(len=*), intent(in) :: object
         integer, intent(in) :: number, row
         real(wp), intent(inout) :: rows(:, :)
         character(len=:), allocatable :: name
         name = 'row '//to_string(row)//' of '//object
         call reader%read_record(tokens, row_names, name, number, messages)
         rows(:, row) = reader%record%value(1:3)
         call reader%require_size(tokens, largest_value, row_names, name, number, messages)
         if (row == 1) return
         call reader%require(tokens, rows(1, row) >= rows(1, row - 1), 1, 't', name, number, &
                             'must not be smaller than in the row before', messages)
      end subroutine read_row

      !> The 13 numbers of a block material.
      subroutine read_block_material(number)
         integer, intent(in) :: number
         real(wp) :: v(13)
         call reader%read_record(tokens, block_names, 'block material', number, messages)
         v = reader%record%value(1:13)
         associate (material => analysis%block_materials(number))
            material%density = v(1)
            material%weight = v(2)
            material%youngs_modulus = v(3)
            material%poisson_ratio = v(4)
            material%stress = v(5:7)
            material%stress_gradient = v(8:10)
            material%velocity = v(11:13)
         end associate
         call check(v(1) > 0, 1, 'must be greater than 0')
         call check(v(3) > 0, 3, 'must be greater than 0')
         call check(v(4) > -1 .and. v(4) < 0.5_wp, 4, 'must be between -1 and 0.5')
         call reader%require_size(tokens, largest_value, block_names, 'block material', number, messages)
      end subroutine read_block_material

      !> A rule for number k of the block material being read.
      subroutine check(condition, k, rule)
         logical, intent(in) :: condition
         integer, intent(in) :: k
         character(len=*), intent(in) :: rule
         call reader%require(tokens, condition, k, block_names(k), 'block material', i, rule, messages)
      end subroutine check

      !> The 3 numbers of a joint material.
      subroutine read_joint_material(number)
         integer, intent(in) :: number
         real(wp) :: v(3)
         call reader%read_record(tokens, joint_names, 'joint material', number, messages)
         v = reader%record%value(1:3)
         analysis%joint_materials(number)%friction_angle = v(1)
         analysis%joint_materials(number)%cohesion = v(2)
         analysis%joint_materials(number)%tension = v(3)
         call reader%require(tokens, v(1) >= 0 .and. v(1) < 90, 1, joint_names(1), 'joint material', number, &
                             'must be at least 0 and less than 90 degrees', messages)
         call reader%require(tokens, v(2) >= 0, 2, joint_names(2), 'joint material', number, &
                             'must not be negative', messages)
         call reader%require(tokens, v(3) >= 0, 3, joint_names(3), 'joint material', number, &
                             'must not be negative', messages)
         call reader%require_size(tokens, largest_value, joint_names, 'joint material', number, messages)
      end subroutine read_joint_material

      !> The factor at the end of the file.
      subroutine read_sor_factor()
         real(wp) :: factor
         single(1) = 'SOR factor'
         call reader%read_record(tokens, single, '', 0, messages)
         if (reader%record%token(1) == 0) return
         factor = reader%record%value(1)
         if (factor >= 1 .and. factor < 2) then
            analysis%sor_factor = factor
         else
            call report_sor_factor(factor, tokens, reader%record%token(1), messages)
         end if
      end subroutine read_sor_factor

   end subroutine read_analysis_body

   !> The last number is no SOR factor. With a decimal comma further up, one number too many has shifted all that
   !> follow it.
   subroutine report_sor_factor(factor, tokens, place, messages)
      real(wp), intent(in) :: factor
      type(token_list_type), intent(in) :: tokens
      integer, intent(in) :: place   !! its token
      type(diagnostics_type), intent(inout) :: messages
      character(len=:), allocatable :: first, second
      integer :: i
      do i = 1, tokens%n - 1
         if (messages%has_errors()) exit
         if (.not. tokens%has_decimal_comma(i)) cycle
         first = tokens%text(i)
         second = tokens%text(i + 1)
         call messages%add(severity%warning, "'"//first//','//second//"' is two numbers, because a comma separates "// &
                           'numbers. The last number of the file, '//to_string(factor)//', is then read as an SOR '// &
                           'factor, but is outside [1, 2): if a decimal comma is meant, write '//first//'.'//second, &
                           tokens%origin(i))
         return
      end do
      call messages%add(severity%note, 'SOR factor '//to_string(factor)//' is outside [1, 2): 1.4 is used', &
                        tokens%origin(place))
   end subroutine report_sor_factor

end module rockdda_io_analysis_body
