! SPDX-License-Identifier: MIT
!> Checks of values that were read from a file; the first one that fails is kept as text:
!>
!>     check%group = 'model'
!>     call check%in_range(block, 1, n_blocks, 'fixed_block')   ! 'model/fixed_block holds an impossible number'
!>     if (.not. check%passed()) return
!>
!> The Python package has the same messages (postprocess/rockdda/storage/check.py).
module rockdda_base_value_check
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type
   implicit none
   private
   public :: value_check_type

   !> Size of a number; the square of one is a number, too.
   real(wp), parameter :: largest_size = 1.0e30_wp

   type :: value_check_type
      character(len=:), allocatable :: group    !! group of the names that follow
      character(len=:), allocatable, private :: first   !! what is wrong
   contains
      procedure :: passed
      procedure :: problem
      procedure :: is_there
      procedure :: is_read
      procedure :: has_type
      procedure :: has_shape
      procedure :: holds
      procedure :: in_range
      procedure :: are_offsets
      procedure :: are_increasing
      generic :: is_finite => list_is_finite, table_is_finite
      procedure :: has_squares
      procedure, private :: list_is_finite, table_is_finite, need
   end type value_check_type

contains

   !> Have all checks passed so far?
   pure logical function passed(self)
      class(value_check_type), intent(in) :: self
      passed = .not. allocated(self%first)
   end function passed

   !> The first problem; '' without one.
   pure function problem(self) result(text)
      class(value_check_type), intent(in) :: self
      character(len=:), allocatable :: text
      text = ''
      if (allocated(self%first)) text = self%first
   end function problem

   !> Keep the first failure.
   subroutine need(self, ok, name, what)
      class(value_check_type), intent(inout) :: self
      logical, intent(in) :: ok
      character(len=*), intent(in) :: name, what
      if (ok .or. allocated(self%first)) return
      self%first = self%group//'/'//name//' '//what
   end subroutine need

   !> Require a value in the file.
   subroutine is_there(self, ok, name)
      class(value_check_type), intent(inout) :: self
      logical, intent(in) :: ok
      character(len=*), intent(in) :: name
      call self%need(ok, name, 'is missing')
   end subroutine is_there

   !> Require that a value was read without an error.
   subroutine is_read(self, error, path, name)
      class(value_check_type), intent(inout) :: self
      type(error_type), allocatable, intent(in) :: error   !! of reading it
      character(len=*), intent(in) :: path                 !! of the file
      character(len=*), intent(in) :: name
      character(len=:), allocatable :: what
      if (.not. allocated(error)) return
      what = error%message
      if (index(what, path//': ') == 1) what = what(len(path) + 3:)
      call self%need(.false., name, 'cannot be read: '//what)
   end subroutine is_read

   !> Require a value of reals, or of integers.
   subroutine has_type(self, ok, name, reals)
      class(value_check_type), intent(inout) :: self
      logical, intent(in) :: ok
      character(len=*), intent(in) :: name
      logical, intent(in) :: reals
      call self%need(ok, name, 'cannot be read: it holds no '//trim(merge('reals   ', 'integers', reals)))
   end subroutine has_type

   !> Require that the shape of a value matches that of other values.
   subroutine has_shape(self, ok, name)
      class(value_check_type), intent(inout) :: self
      logical, intent(in) :: ok
      character(len=*), intent(in) :: name
      call self%need(ok, name, 'has an unexpected shape')
   end subroutine has_shape

   !> Require a possible value.
   subroutine holds(self, ok, name)
      class(value_check_type), intent(inout) :: self
      logical, intent(in) :: ok
      character(len=*), intent(in) :: name
      call self%need(ok, name, 'holds an impossible number')
   end subroutine holds

   !> Require numbers that are all at least `low` and at most `high`.
   subroutine in_range(self, values, low, high, name)
      class(value_check_type), intent(inout) :: self
      integer, intent(in) :: values(:)
      integer, intent(in) :: low, high
      character(len=*), intent(in) :: name
      call self%holds(all(values >= low .and. values <= high), name)
   end subroutine in_range

   !> Require numbers each of which is above the one before, the first at least `least`.
   subroutine are_increasing(self, numbers, least, name)
      class(value_check_type), intent(inout) :: self
      integer, intent(in) :: numbers(:)
      integer, intent(in) :: least
      character(len=*), intent(in) :: name
      integer :: n
      n = size(numbers)
      call self%holds(all(numbers >= least) .and. all(numbers(2:n) > numbers(1:n - 1)), name)
   end subroutine are_increasing

   !> Require numbers that begin with 0, grow by at least `step` each, and end with n.
   subroutine are_offsets(self, offsets, n, step, name)
      class(value_check_type), intent(inout) :: self
      integer, intent(in) :: offsets(:)
      integer, intent(in) :: n, step
      character(len=*), intent(in) :: name
      integer :: m
      m = size(offsets)
      call self%has_shape(m >= 1, name)
      if (.not. self%passed()) return
      call self%in_range(offsets, 0, n, name)
      call self%holds(offsets(1) == 0 .and. offsets(m) == n, name)
      ! no overflow: all of them are in range
      if (self%passed()) call self%holds(all(offsets(2:m) - offsets(1:m - 1) >= step), name)
   end subroutine are_offsets

   !> List all reals must be finite.
   subroutine list_is_finite(self, values, name)
      class(value_check_type), intent(inout) :: self
      real(wp), intent(in) :: values(:)
      character(len=*), intent(in) :: name
      call self%need(all(abs(values) <= huge(1.0_wp)), name, 'holds a number that is not finite')
   end subroutine list_is_finite

   !> Require a table of finite numbers.
   subroutine table_is_finite(self, values, name)
      class(value_check_type), intent(inout) :: self
      real(wp), intent(in) :: values(:, :)
      character(len=*), intent(in) :: name
      call self%need(all(abs(values) <= huge(1.0_wp)), name, 'holds a number that is not finite')
   end subroutine table_is_finite

   !> Require numbers that are finite, and so are their squares.
   subroutine has_squares(self, values, name)
      class(value_check_type), intent(inout) :: self
      real(wp), intent(in) :: values(:)
      character(len=*), intent(in) :: name
      call self%is_finite(values, name)
      call self%need(all(abs(values) <= largest_size), name, 'holds a number above 1e+30 in size')
   end subroutine has_squares

end module rockdda_base_value_check
