! SPDX-License-Identifier: MIT
!> The part of pFUnit that the tests of this project use, for machines without it; names and behaviour are pFUnit's.
!>
!> pf.py turns an assertion into a call of `funit_compare`, `funit_judge` or `funit_is_finite`. Operands of a comparison
!> are wrapped: `funit_value` (elemental) brings each kind to one type, `funit_flat` (one procedure a rank) keeps the
!> shape beside the values. One procedure then compares all kinds and ranks; operands that differ in shape, or are of
!> kinds that pFUnit does not compare, fail as wrong values do.
!> Not thread-safe: the state of the running test is in module variables, as it is in pFUnit.
module funit
   use, intrinsic :: iso_fortran_env, only : int8, int16, int32, int64, real32, real64, output_unit
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   implicit none
   private
   public :: SourceLocation, anyExceptions, WhitespaceOptions, TRIM_ALL, KEEP_ALL
   public :: funit_value, funit_flat, funit_compare, funit_judge, funit_is_finite, funit_run, funit_finish

   !> Where an assertion stands.
   type :: SourceLocation
      character(len=128) :: fileName = '<unknown file>' !! without its folder
      integer :: lineNumber = -1
   end type SourceLocation

   !> How blanks count when strings are compared.
   type :: WhitespaceOptions
      integer :: value = 1
   end type WhitespaceOptions
   type(WhitespaceOptions), parameter :: TRIM_ALL = WhitespaceOptions(1) !! those at the ends do not
   type(WhitespaceOptions), parameter :: KEEP_ALL = WhitespaceOptions(2)

   enum, bind(c)
      enumerator :: kind_logical = 1, kind_int8, kind_int16, kind_int32, kind_int64, kind_real32, kind_real64, kind_text
   end enum

   !> A number or a logical (0 or 1) of any kind.
   type :: value_type
      integer :: kind = 0
      integer(int64) :: whole = 0
      real(real64) :: real = 0
   end type value_type

   !> An operand: a scalar or an array of values, or of texts of one length.
   type :: operand_type
      integer, allocatable :: shape(:)
      type(value_type), allocatable :: values(:)       !! flattened
      integer :: length = 0                            !! of each text
      character(len=:), allocatable :: text            !! all texts, one behind the other
   end type operand_type

   interface funit_value
      module procedure value_logical, value_int8, value_int16, value_int32, value_int64, value_real32, value_real64, &
         value_text, value_texts
   end interface funit_value

   interface funit_flat
      module procedure flat_0, flat_1, flat_2, flat_3, flat_4, flat_text
   end interface funit_flat

   interface funit_judge
      module procedure judge, judge_all
   end interface funit_judge

   abstract interface
      subroutine test_procedure()
      end subroutine test_procedure
   end interface

   character(len=*), parameter :: nl = new_line('a')
   character(len=:), allocatable :: running   ! suite and name of the running test
   character(len=:), allocatable :: report    ! the failures of all tests so far
   logical :: has_failed = .false.            ! the running test
   integer :: n_run = 0, n_failed = 0

contains

   elemental type(value_type) function value_logical(x) result(value)
      logical, intent(in) :: x
      value = value_type(kind_logical, merge(1, 0, x))
   end function value_logical

   elemental type(value_type) function value_int8(x) result(value)
      integer(int8), intent(in) :: x
      value = value_type(kind_int8, int(x, int64), real(x, real64))
   end function value_int8

   elemental type(value_type) function value_int16(x) result(value)
      integer(int16), intent(in) :: x
      value = value_type(kind_int16, int(x, int64), real(x, real64))
   end function value_int16

   elemental type(value_type) function value_int32(x) result(value)
      integer(int32), intent(in) :: x
      value = value_type(kind_int32, int(x, int64), real(x, real64))
   end function value_int32

   elemental type(value_type) function value_int64(x) result(value)
      integer(int64), intent(in) :: x
      value = value_type(kind_int64, x, real(x, real64))
   end function value_int64

   elemental type(value_type) function value_real32(x) result(value)
      real(real32), intent(in) :: x
      value = value_type(kind_real32, 0_int64, real(x, real64))
   end function value_real32

   elemental type(value_type) function value_real64(x) result(value)
      real(real64), intent(in) :: x
      value = value_type(kind_real64, 0_int64, x)
   end function value_real64

   pure type(operand_type) function value_text(x) result(operand)
      character(len=*), intent(in) :: x
      operand = value_texts([x])
      operand%shape = [integer ::]
   end function value_text

   pure type(operand_type) function value_texts(x) result(operand)
      character(len=*), intent(in) :: x(:)
      integer :: i
      operand%shape = shape(x)
      operand%length = len(x)
      operand%values = [(value_type(kind_text), i=1, size(x))]
      allocate (character(len=size(x)*len(x)) :: operand%text)
      do i = 1, size(x)
         operand%text((i - 1)*len(x) + 1:i*len(x)) = x(i)
      end do
   end function value_texts

   pure type(operand_type) function flat_0(x) result(operand)
      type(value_type), intent(in) :: x
      operand = flat_1([x])
      operand%shape = [integer ::]
   end function flat_0

   pure type(operand_type) function flat_1(x) result(operand)
      type(value_type), intent(in) :: x(:)
      operand%shape = shape(x)
      operand%values = x
   end function flat_1

   pure type(operand_type) function flat_2(x) result(operand)
      type(value_type), intent(in) :: x(:, :)
      operand = flat_1(reshape(x, [size(x)]))
      operand%shape = shape(x)
   end function flat_2

   pure type(operand_type) function flat_3(x) result(operand)
      type(value_type), intent(in) :: x(:, :, :)
      operand = flat_1(reshape(x, [size(x)]))
      operand%shape = shape(x)
   end function flat_3

   pure type(operand_type) function flat_4(x) result(operand)
      type(value_type), intent(in) :: x(:, :, :, :)
      operand = flat_1(reshape(x, [size(x)]))
      operand%shape = shape(x)
   end function flat_4

   pure type(operand_type) function flat_text(x) result(operand)
      type(operand_type), intent(in) :: x
      operand = x
   end function flat_text

   !> The condition is as expected. Nothing is allocated: there are tests that count allocations.
   subroutine judge(expected, condition, message, location)
      logical, intent(in) :: expected, condition
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in) :: location
      if (condition .neqv. expected) call fail('', message, location)
   end subroutine judge

   !> All conditions are as expected.
   subroutine judge_all(expected, conditions, message, location)
      logical, intent(in) :: expected, conditions(:)
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in) :: location
      if (any(conditions .neqv. expected)) call fail('', message, location)
   end subroutine judge_all

   !> The value is neither infinite nor a NaN.
   subroutine funit_is_finite(x, message, location)
      real(real64), intent(in) :: x
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in) :: location
      if (.not. ieee_is_finite(x)) call fail('AssertIsFinite failure.', message, location)
   end subroutine funit_is_finite

   !> Compare element by element; a scalar may be expected of an array. Only the first difference is reported.
   subroutine funit_compare(relation, e, a, message, location, tolerance, whitespace)
      character(len=*), intent(in) :: relation         !! name of the assertion
      type(operand_type), intent(in) :: e, a           !! expected and actual
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in) :: location
      real(real64), intent(in), optional :: tolerance
      type(WhitespaceOptions), intent(in), optional :: whitespace
      character(len=:), allocatable :: head, text_e, text_a, place
      logical :: trims
      integer :: i, k
      head = 'Assert'//relation//' failure:'
      if (size(a%shape) > 0) head = 'Array'//head
      if (.not. same_shape(e%shape, a%shape)) then
         call fail(head//nl//'   Arrays not conformable: expected shape '//index_text(e%shape)//', actual shape ' &
                   //index_text(a%shape), message, location)
         return
      end if
      trims = .true.
      if (present(whitespace)) trims = whitespace%value == TRIM_ALL%value
      do i = 1, size(a%values)
         k = merge(1, i, size(e%shape) == 0)
         if (.not. are_comparable(e%values(k)%kind, a%values(i)%kind, relation, present(tolerance))) then
            call fail(head//nl//'   pFUnit has no such comparison of these kinds.', message, location)
            return
         end if
         text_e = text_of(e, k, trims)
         text_a = text_of(a, i, trims)
         if (e%values(k)%kind == kind_text) then
            if (len(text_e) == len(text_a) .and. text_e == text_a) cycle
         else if (holds(relation, e%values(k), a%values(i), tolerance)) then
            cycle
         end if
         place = ''
         if (size(a%shape) > 0) place = nl//'      at index: '//index_text(indices(i, a%shape))
         call fail(head//nl//'      Expected: <'//text_e//'>'//nl//'        Actual: <'//text_a//'>'//place, message, &
                   location)
         return
      end do
   end subroutine funit_compare

   !> Does the relation hold for two numbers? A NaN fulfils none; infinite numbers are equal to themselves alone.
   pure logical function holds(relation, e, a, tolerance)
      character(len=*), intent(in) :: relation
      type(value_type), intent(in) :: e, a
      real(real64), intent(in), optional :: tolerance
      logical :: less, more, equal
      less = e%real < a%real
      more = e%real > a%real
      equal = e%real >= a%real .and. e%real <= a%real
      if (a%kind < kind_real32) then
         less = e%whole < a%whole
         more = e%whole > a%whole
         equal = e%whole == a%whole
      end if
      select case (relation)
      case ('Equal', 'RelativelyEqual')
         holds = equal
         if (present(tolerance) .and. ieee_is_finite(e%real) .and. ieee_is_finite(a%real)) then
            if (relation == 'Equal') holds = abs(a%real - e%real) <= tolerance
            if (relation /= 'Equal') holds = abs(a%real - e%real)/abs(e%real) <= tolerance ! never for e = 0
         end if
      case ('NotEqual'); holds = less .or. more
      case ('LessThan'); holds = less
      case ('LessThanOrEqual'); holds = less .or. equal
      case ('GreaterThan'); holds = more
      case default; holds = more .or. equal
      end select
   end function holds

   !> Does pFUnit compare an expected value of one kind with an actual value of another?
   pure logical function are_comparable(e, a, relation, has_tolerance)
      integer, intent(in) :: e, a
      character(len=*), intent(in) :: relation
      logical, intent(in) :: has_tolerance
      are_comparable = e == a .or. (e == kind_real32 .and. a == kind_real64) &
                       .or. (e == kind_int32 .and. a > kind_logical .and. a < kind_text)
      if (relation == 'RelativelyEqual') then
         are_comparable = are_comparable .and. has_tolerance .and. any(a == [kind_real32, kind_real64])
      else if (relation /= 'Equal') then
         are_comparable = are_comparable .and. .not. (has_tolerance .or. any(a == [kind_logical, kind_text]))
      else if (has_tolerance) then
         are_comparable = are_comparable .and. any(a == [kind_real32, kind_real64])
      end if
   end function are_comparable

   !> Do the shapes agree, or is a scalar expected?
   pure logical function same_shape(e, a)
      integer, intent(in) :: e(:), a(:)
      same_shape = size(e) == 0
      if (size(e) == size(a)) same_shape = all(e == a)
   end function same_shape

   !> Element i as text.
   pure function text_of(operand, i, trims) result(text)
      type(operand_type), intent(in) :: operand
      integer, intent(in) :: i
      logical, intent(in) :: trims                     !! texts: without blanks and tabs at the ends
      character(len=:), allocatable :: text
      character(len=32) :: buffer
      buffer = ''
      select case (operand%values(i)%kind)
      case (kind_logical); buffer = merge('T', 'F', operand%values(i)%whole == 1)
      case (kind_int8:kind_int64); write (buffer, '(i0)') operand%values(i)%whole
      case (kind_real32:kind_real64); write (buffer, '(g0.17)') operand%values(i)%real
      end select
      text = trim(adjustl(buffer))
      if (operand%values(i)%kind /= kind_text) return
      text = operand%text((i - 1)*operand%length + 1:i*operand%length)
      if (trims) text = text(max(1, verify(text, ' '//achar(9))):verify(text, ' '//achar(9), back=.true.))
   end function text_of

   !> The indices of flattened element k.
   pure function indices(k, lengths)
      integer, intent(in) :: k, lengths(:)
      integer :: indices(size(lengths)), i
      do i = 1, size(lengths)
         indices(i) = mod((k - 1)/product(lengths(:i - 1)), lengths(i)) + 1
      end do
   end function indices

   !> "[3,4]"
   pure function index_text(numbers) result(text)
      integer, intent(in) :: numbers(:)
      character(len=:), allocatable :: text
      character(len=16) :: number
      integer :: i
      text = '['
      do i = 1, size(numbers)
         write (number, '(i0)') numbers(i)
         if (i > 1) text = text//','
         text = text//trim(number)
      end do
      text = text//']'
   end function index_text

   !> The running test has failed: the user's message on its own line before the details.
   subroutine fail(details, message, location)
      character(len=*), intent(in) :: details
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in) :: location
      character(len=16) :: number
      has_failed = .true.
      write (number, '(i0)') location%lineNumber
      if (.not. allocated(report)) report = ''
      report = report//nl//'Failure'//nl//' in: '//nl//running//nl//'  Location: '//nl//'['//trim(location%fileName) &
               //':'//trim(number)//']'//nl
      if (present(message)) report = report//trim(message)//nl
      report = report//details//nl
   end subroutine fail

   !> Has the running test failed?
   logical function anyExceptions()
      anyExceptions = has_failed
   end function anyExceptions

   !> Set up, run, tear down, unless the name lacks the text behind --filter. When the set-up fails the rest is skipped.
   subroutine funit_run(name, test, before, after)
      character(len=*), intent(in) :: name
      procedure(test_procedure) :: test
      procedure(test_procedure), optional :: before, after
      character(len=512) :: filter
      logical :: verbose
      call read_options(verbose, filter)
      if (index(name, trim(filter)) == 0) return
      if (verbose) write (output_unit, '(/,a)') 'Start: <'//name//'>'
      flush (output_unit)
      running = name
      has_failed = .false.
      n_run = n_run + 1
      if (present(before)) call before()
      if (.not. has_failed) then
         call test()
         if (present(after)) call after()
      end if
      if (has_failed) n_failed = n_failed + 1
      if (verbose) write (output_unit, '(/,a)') '  end: <'//name//'>'
   end subroutine funit_run

   !> Report, and stop with 2 when anything failed.
   subroutine funit_finish()
      if (n_failed == 0) then
         write (output_unit, '(/,a,/,a,i0,a)') ' OK', ' (', n_run, ' tests)'
         return
      end if
      write (output_unit, '(a,/,a)') report, ' FAILURES!!!'
      write (output_unit, '(a,i0,a,i0)') 'Tests run: ', n_run, ', Failures: ', n_failed
      write (output_unit, '(a)') ' *** Encountered 1 or more failures/errors during testing ***'
      flush (output_unit)
      stop 2
   end subroutine funit_finish

   !> -v/--verbose and -f/--filter TEXT.
   subroutine read_options(verbose, filter)
      logical, intent(out) :: verbose
      character(len=*), intent(out) :: filter !! empty: all tests
      character(len=512) :: argument
      integer :: i
      verbose = .false.
      filter = ''
      do i = 1, command_argument_count()
         call get_command_argument(i, argument)
         select case (argument)
         case ('-v', '--verbose'); verbose = .true.
         case ('-f', '--filter'); call get_command_argument(i + 1, filter)
         case default
            if (argument == filter) cycle
            write (output_unit, '(a)') 'unknown option '//trim(argument)//'; known: --verbose, --filter TEXT'
            error stop 1
         end select
      end do
   end subroutine read_options

end module funit
