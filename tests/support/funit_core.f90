! SPDX-License-Identifier: MIT
!> Exceptions, tests, suites and the runner of the pFUnit stand-in.
!>
!> Only what a test executable needs when pFUnit itself is not installed; names and behaviour are pFUnit's.
!> Not thread-safe: the list of exceptions is a module variable, as it is there.
module funit_core
   use, intrinsic :: iso_fortran_env, only : int64, output_unit
   implicit none
   private
   public :: SourceLocation, throw, anyExceptions, catch, assertFail, assertExceptionRaised
   public :: TestMethod, TestSuite, run_suites, report_failure, located

   !> Where an assertion stands.
   type :: SourceLocation
      character(len=128) :: fileName = '<unknown file>' !! without its folder
      integer :: lineNumber = -1
   end type SourceLocation

   !> Something that went wrong in the running test.
   type :: exception_type
      character(len=:), allocatable :: message
      type(SourceLocation) :: location
   end type exception_type

   abstract interface
      subroutine test_procedure()
      end subroutine test_procedure
   end interface

   !> One test procedure with its set-up and tear-down.
   type :: TestMethod
      character(len=:), allocatable :: name
      procedure(test_procedure), pointer, nopass :: method => null() !! null when disabled
      procedure(test_procedure), pointer, nopass :: setUp => null()
      procedure(test_procedure), pointer, nopass :: tearDown => null()
   end type TestMethod

   interface TestMethod
      module procedure new_test_method
   end interface TestMethod

   !> The tests of one file.
   type :: TestSuite
      character(len=:), allocatable :: name
      integer :: n = 0                                  !! number of tests
      type(TestMethod), allocatable :: tests(:)
   contains
      procedure :: addTest
   end type TestSuite

   interface TestSuite
      module procedure new_test_suite
   end interface TestSuite

   interface anyExceptions
      module procedure any_exceptions
   end interface anyExceptions

   interface catch
      module procedure catch_any
      module procedure catch_message
   end interface catch

   interface assertExceptionRaised
      module procedure assert_any_exception_raised
      module procedure assert_exception_raised
   end interface assertExceptionRaised

   integer, parameter :: max_exceptions = 64
   type(exception_type) :: exceptions(max_exceptions)   ! raised and not caught in the running test
   integer :: n_exceptions = 0

contains

   !> A test; without a method it is a disabled one.
   function new_test_method(name, method, setUp, tearDown) result(test)
      character(len=*), intent(in) :: name
      procedure(test_procedure), optional :: method, setUp, tearDown
      type(TestMethod) :: test
      test%name = name
      if (present(method)) test%method => method
      if (present(setUp)) test%setUp => setUp
      if (present(tearDown)) test%tearDown => tearDown
   end function new_test_method

   !> An empty suite.
   function new_test_suite(name) result(suite)
      character(len=*), intent(in) :: name
      type(TestSuite) :: suite
      suite%name = name
      allocate (suite%tests(16))
   end function new_test_suite

   !> Add one test to a suite.
   subroutine addTest(self, test)
      class(TestSuite), intent(inout) :: self
      type(TestMethod), intent(in) :: test
      type(TestMethod), allocatable :: larger(:)
      if (self%n == size(self%tests)) then
         allocate (larger(2*self%n))
         larger(1:self%n) = self%tests
         call move_alloc(larger, self%tests)
      end if
      self%n = self%n + 1
      self%tests(self%n) = test
   end subroutine addTest

   !> Raise an exception; the running test has failed unless somebody catches it.
   subroutine throw(message, location)
      character(len=*), intent(in) :: message
      type(SourceLocation), intent(in), optional :: location
      if (n_exceptions == max_exceptions) return
      n_exceptions = n_exceptions + 1
      exceptions(n_exceptions)%message = message
      exceptions(n_exceptions)%location = located(location)
   end subroutine throw

   !> The location given, or the unknown one.
   pure function located(location) result(place)
      type(SourceLocation), intent(in), optional :: location
      type(SourceLocation) :: place
      if (present(location)) place = location
   end function located

   !> Is there an exception that nobody has caught?
   logical function any_exceptions()
      any_exceptions = n_exceptions > 0
   end function any_exceptions

   !> Was something raised? It counts as handled then.
   logical function catch_any() result(caught)
      caught = n_exceptions > 0
      if (caught) call drop(n_exceptions)
   end function catch_any

   !> Was an exception with this text raised? It counts as handled then.
   logical function catch_message(message) result(caught)
      character(len=*), intent(in) :: message
      integer :: i
      caught = .false.
      do i = 1, n_exceptions
         if (exceptions(i)%message /= message) cycle
         caught = .true.
         call drop(i)
         return
      end do
   end function catch_message

   !> Take exception k off the list.
   subroutine drop(k)
      integer, intent(in) :: k
      integer :: i
      do i = k, n_exceptions - 1
         exceptions(i) = exceptions(i + 1)
      end do
      n_exceptions = n_exceptions - 1
   end subroutine drop

   !> Fail unconditionally.
   subroutine assertFail(message, location)
      character(len=*), intent(in) :: message
      type(SourceLocation), intent(in), optional :: location
      call throw(message, location)
   end subroutine assertFail

   !> Something must have been raised.
   subroutine assert_any_exception_raised(location)
      type(SourceLocation), intent(in), optional :: location
      if (.not. catch()) call throw('Failed to throw exception.', location)
   end subroutine assert_any_exception_raised

   !> An exception with exactly this text must have been raised.
   subroutine assert_exception_raised(exceptionMessage, location)
      character(len=*), intent(in) :: exceptionMessage
      type(SourceLocation), intent(in), optional :: location
      if (.not. catch(exceptionMessage)) then
         call throw('Failed to throw exception: <'//exceptionMessage//'>', location)
      end if
   end subroutine assert_exception_raised

   !> Raise a failure: the user's message on its own line before the details.
   subroutine report_failure(details, message, location)
      character(len=*), intent(in) :: details
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      character(len=:), allocatable :: text
      text = ''
      if (present(message)) text = trim(message)
      if (len(text) > 0 .and. len(details) > 0) text = text//new_line('a')
      call throw(text//details, location)
   end subroutine report_failure

   !> Run the suites as the command line asks, report, and stop with 2 when anything failed.
   subroutine run_suites(suites)
      type(TestSuite), intent(in) :: suites(:)
      character(len=:), allocatable :: filter, failures, name
      logical :: verbose
      integer :: i, j, n_run, n_failed, n_disabled, column
      integer(int64) :: start, finish, rate
      call read_options(verbose, filter)
      n_run = 0
      n_failed = 0
      n_disabled = 0
      column = 0
      failures = ''
      call system_clock(start, rate)
      do i = 1, size(suites)
         do j = 1, suites(i)%n
            name = suites(i)%name//'.'//suites(i)%tests(j)%name
            if (len(filter) > 0) then
               if (index(name, filter) == 0) cycle
            end if
            if (verbose) write (output_unit, '(/,a)') 'Start: <'//name//'>'
            if (.not. associated(suites(i)%tests(j)%method)) then
               n_disabled = n_disabled + 1
               call put('I', column)
            else
               n_run = n_run + 1
               call put('.', column)
               call run_test(suites(i)%tests(j))
               if (n_exceptions > 0) then
                  n_failed = n_failed + 1
                  call put('F', column)
                  call describe_failures(name, failures)
               end if
            end if
            if (verbose) write (output_unit, '(/,a)') '  end: <'//name//'>'
         end do
      end do
      call system_clock(finish)
      write (output_unit, '(/,a,f0.3,a)') 'Time:         ', real(finish - start)/real(rate), ' seconds'
      if (n_failed == 0) then
         write (output_unit, '(/,a)') ' OK'
         if (n_disabled == 0) then
            write (output_unit, '(a,i0,a)') ' (', n_run, ' tests)'
         else
            write (output_unit, '(a,i0,a,i0,a)') ' (', n_run, ' tests, ', n_disabled, ' disabled)'
         end if
         return
      end if
      write (output_unit, '(a)') failures
      write (output_unit, '(a)') ' FAILURES!!!'
      write (output_unit, '(a,i0,a,i0,a)') 'Tests run: ', n_run, ', Failures: ', n_failed, ', Errors: 0'
      write (output_unit, '(a,i0)') ', Disabled: ', n_disabled
      write (output_unit, '(a)') ' *** Encountered 1 or more failures/errors during testing ***'
      flush (output_unit)
      stop 2
   end subroutine run_suites

   !> Set up, run, tear down. When the set-up fails the rest is skipped.
   subroutine run_test(test)
      type(TestMethod), intent(in) :: test
      n_exceptions = 0
      if (associated(test%setUp)) call test%setUp()
      if (n_exceptions > 0) return
      call test%method()
      if (associated(test%tearDown)) call test%tearDown()
   end subroutine run_test

   !> Append what the failed test raised to the report, and forget it.
   subroutine describe_failures(name, failures)
      character(len=*), intent(in) :: name
      character(len=:), allocatable, intent(inout) :: failures
      character(len=*), parameter :: nl = new_line('a')
      character(len=16) :: number
      integer :: i
      do i = 1, n_exceptions
         write (number, '(i0)') exceptions(i)%location%lineNumber
         failures = failures//nl//'Failure'//nl//' in: '//nl//name//nl//'  Location: '//nl &
                    //'['//trim(exceptions(i)%location%fileName)//':'//trim(number)//']'//nl &
                    //exceptions(i)%message//nl
      end do
      n_exceptions = 0
   end subroutine describe_failures

   !> One progress mark; lines wrap at 80.
   subroutine put(mark, column)
      character(len=1), intent(in) :: mark
      integer, intent(inout) :: column   !! marks on the current line
      if (column == 80) then
         write (output_unit, '(a)') ''
         column = 0
      end if
      write (output_unit, '(a)', advance='no') mark
      flush (output_unit)
      column = column + 1
   end subroutine put

   !> -v/-d/--verbose/--debug and -f/--filter TEXT.
   subroutine read_options(verbose, filter)
      logical, intent(out) :: verbose
      character(len=:), allocatable, intent(out) :: filter !! empty: all tests
      character(len=512) :: argument
      integer :: i
      verbose = .false.
      filter = ''
      i = 0
      do while (i < command_argument_count())
         i = i + 1
         call get_command_argument(i, argument)
         select case (argument)
         case ('-v', '-d', '--verbose', '--debug')
            verbose = .true.
         case ('-f', '--filter')
            i = i + 1
            if (i > command_argument_count()) error stop 'option --filter needs a text'
            call get_command_argument(i, argument)
            filter = trim(argument)
         case default
            write (output_unit, '(a)') 'unknown option '//trim(argument)//'; known: --verbose, --filter TEXT'
            error stop 1
         end select
      end do
   end subroutine read_options

end module funit_core
