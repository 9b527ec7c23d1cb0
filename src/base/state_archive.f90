! SPDX-License-Identifier: MIT
!> Values of a state that go into a checkpoint and come back by the same call of the type that owns them:
!>
!>     call archive%section('held_forces')
!>     call archive%item('n', self%n, least=0)
!>     call archive%item('force', self%force, [2, self%n])     ! written; or read, allocated and checked
!>
!> so that writer and reader cannot differ. All reals must be finite. A list or a table whose size is given must be in
!> the file, and have it; without a size what is missing is not allocated. The first value that is wrong ends loading:
!> all calls behind it do nothing. The file is that of rockdda_io_archive: all numbers go through its `exchange`, as
!> reals, which hold every integer of 32 bits.
module rockdda_base_state_archive
   use rockdda_base_kinds, only : wp, i1, l1
   implicit none
   private
   public :: state_archive_type, positive

   !> The least of numbers that must be above 0.
   real(wp), parameter :: positive = tiny(1.0_wp)

   type, abstract :: state_archive_type
      logical :: saving = .false.                      !! otherwise loading
   contains
      procedure(has_loaded_all), deferred :: has_loaded
      procedure(begin_section), deferred :: section
      procedure(demand_value), deferred :: demand
      procedure(exchange_numbers), deferred :: exchange
      generic :: item => integer_item, real_item, logical_item, integers_item, reals_item, integer_rows_item, &
         real_rows_item, logicals_item
      !> A list that keeps its size.
      generic :: fixed => fixed_reals, fixed_integers, fixed_bytes, fixed_logicals
      procedure, private :: integer_item, real_item, logical_item, integers_item, reals_item, integer_rows_item
      procedure, private :: real_rows_item, logicals_item, fixed_reals, fixed_integers, fixed_bytes, fixed_logicals
   end type state_archive_type

   abstract interface

      !> Have the items so far been loaded, without a failure?
      pure logical function has_loaded_all(self)
         import :: state_archive_type
         class(state_archive_type), intent(in) :: self
      end function has_loaded_all

      !> Begin a section: the group of the items that follow.
      subroutine begin_section(self, name)
         import :: state_archive_type
         class(state_archive_type), intent(inout) :: self
         character(len=*), intent(in) :: name
      end subroutine begin_section

      !> Refuse a value of the present section that was loaded, unless it can be.
      subroutine demand_value(self, ok, name)
         import :: state_archive_type
         class(state_archive_type), intent(inout) :: self
         logical, intent(in) :: ok
         character(len=*), intent(in) :: name
      end subroutine demand_value

      !> Save or load numbers. What is not allocated is not saved; what cannot be loaded is not allocated.
      subroutine exchange_numbers(self, name, is_real, required, shape, values, least, most)
         import :: state_archive_type, wp
         class(state_archive_type), intent(inout) :: self
         character(len=*), intent(in) :: name
         logical, intent(in) :: is_real                      !! else integers
         logical, intent(in) :: required                     !! they must be in the file
         integer, intent(inout) :: shape(:)                  !! Fortran order; < 0: as the file has it
         real(wp), allocatable, intent(inout) :: values(:)   !! (product(shape))
         real(wp), intent(in) :: least, most
      end subroutine exchange_numbers

   end interface

contains

   !> Save or load a whole number.
   subroutine integer_item(self, name, value, least, most)
      class(state_archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(inout) :: value
      integer, intent(in), optional :: least, most
      integer :: values(1)
      values = value
      call self%fixed(name, values, least, most)
      value = values(1)
   end subroutine integer_item

   !> Save or load a real.
   subroutine real_item(self, name, value, least, most)
      class(state_archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), intent(inout) :: value
      real(wp), intent(in), optional :: least, most
      real(wp) :: values(1)
      values = value
      call self%fixed(name, values, least, most)
      value = values(1)
   end subroutine real_item

   !> Save or load a logical, stored as 0 or 1.
   subroutine logical_item(self, name, value)
      class(state_archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      logical, intent(inout) :: value
      integer :: values(1)
      values = merge(1, 0, value)
      call self%fixed(name, values, 0, 1)
      value = values(1) /= 0
   end subroutine logical_item

   !> Save or load a list of integers.
   subroutine integers_item(self, name, values, n, least, most)
      class(state_archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, allocatable, intent(inout) :: values(:)
      integer, intent(in), optional :: n, least, most
      real(wp), allocatable :: list(:)
      integer :: shape(1)
      shape = -1
      if (present(n)) shape = n
      if (self%saving .and. allocated(values)) then
         list = real(values, wp)
         shape = size(values)
      end if
      call self%exchange(name, .false., present(n), shape, list, integer_bound(-huge(1.0_wp), least), &
                         integer_bound(huge(1.0_wp), most))
      if (self%saving) return
      if (allocated(values)) deallocate (values)
      if (allocated(list)) values = nint(list)
   end subroutine integers_item

   !> Save or load a list of reals.
   subroutine reals_item(self, name, values, n, least, most)
      class(state_archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), allocatable, intent(inout) :: values(:)
      integer, intent(in), optional :: n
      real(wp), intent(in), optional :: least, most
      integer :: shape(1)
      shape = -1
      if (present(n)) shape = n
      if (self%saving .and. allocated(values)) shape = size(values)
      call self%exchange(name, .true., present(n), shape, values, real_bound(-huge(1.0_wp), least), &
                         real_bound(huge(1.0_wp), most))
   end subroutine reals_item

   !> Save or load a table of integers.
   subroutine integer_rows_item(self, name, values, known, least, most)
      class(state_archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, allocatable, intent(inout) :: values(:, :)
      integer, intent(in), optional :: known(2), least, most
      real(wp), allocatable :: reals(:, :)
      if (self%saving .and. allocated(values)) reals = real(values, wp)
      call exchange_rows(self, name, .false., reals, integer_bound(-huge(1.0_wp), least), integer_bound(huge(1.0_wp), &
                         most), known)
      if (self%saving) return
      if (allocated(values)) deallocate (values)
      if (allocated(reals)) values = nint(reals)
   end subroutine integer_rows_item

   !> Save or load a table of reals.
   subroutine real_rows_item(self, name, values, known, largest)
      class(state_archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), allocatable, intent(inout) :: values(:, :)
      integer, intent(in), optional :: known(2)   !! its shape; any number of columns where the second is negative
      real(wp), intent(in), optional :: largest   !! magnitude
      real(wp) :: most
      most = real_bound(huge(1.0_wp), largest)
      call exchange_rows(self, name, .true., values, -most, most, known)
   end subroutine real_rows_item

   !> Save or load a table.
   subroutine exchange_rows(self, name, is_real, values, least, most, known)
      class(state_archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      logical, intent(in) :: is_real
      real(wp), allocatable, intent(inout) :: values(:, :)
      real(wp), intent(in) :: least, most
      integer, intent(in), optional :: known(2)
      real(wp), allocatable :: list(:)
      integer :: n(2)
      n = -1
      if (present(known)) n = known
      if (self%saving .and. allocated(values)) then
         n = shape(values)
         list = reshape(values, [size(values)])
      end if
      call self%exchange(name, is_real, present(known), n, list, least, most)
      if (self%saving) return
      if (allocated(values)) deallocate (values)
      if (self%has_loaded() .and. allocated(list)) values = reshape(list, n)
   end subroutine exchange_rows

   !> Save or load a list of logicals.
   subroutine logicals_item(self, name, values, n)
      class(state_archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      logical, allocatable, intent(inout) :: values(:)
      integer, intent(in), optional :: n
      integer, allocatable :: numbers(:)
      if (self%saving .and. allocated(values)) then
         allocate (numbers(size(values)))
         numbers(:) = merge(1, 0, values)
      end if
      call self%item(name, numbers, n, 0, 1)
      if (self%saving) return
      if (allocated(values)) deallocate (values)
      if (allocated(numbers)) values = numbers /= 0
   end subroutine logicals_item

   !> Save or load integers that keep their number.
   subroutine fixed_integers(self, name, values, least, most)
      class(state_archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(inout) :: values(:)
      integer, intent(in), optional :: least, most
      real(wp), allocatable :: list(:)
      integer :: n(1)
      n = size(values)
      if (self%saving) list = real(values, wp)
      call self%exchange(name, .false., .true., n, list, integer_bound(-huge(1.0_wp), least), &
                         integer_bound(huge(1.0_wp), most))
      if (self%has_loaded()) values = nint(list)
   end subroutine fixed_integers

   !> Save or load reals that keep their number.
   subroutine fixed_reals(self, name, values, least, most)
      class(state_archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), intent(inout) :: values(:)
      real(wp), intent(in), optional :: least, most
      real(wp), allocatable :: list(:)
      integer :: n(1)
      n = size(values)
      if (self%saving) list = values
      call self%exchange(name, .true., .true., n, list, real_bound(-huge(1.0_wp), least), real_bound(huge(1.0_wp), &
                         most))
      if (self%has_loaded()) values = list
   end subroutine fixed_reals

   !> Save or load small integers that keep their number.
   subroutine fixed_bytes(self, name, values, least, most)
      class(state_archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer(i1), intent(inout) :: values(:)
      integer, intent(in) :: least, most
      integer, allocatable :: numbers(:)
      allocate (numbers(size(values)))
      numbers(:) = values
      call self%fixed(name, numbers, least, most)
      if (self%has_loaded()) values = int(numbers, i1)
   end subroutine fixed_bytes

   !> Save or load logicals that keep their number.
   subroutine fixed_logicals(self, name, values)
      class(state_archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      logical(l1), intent(inout) :: values(:)
      integer, allocatable :: numbers(:)
      allocate (numbers(size(values)))
      numbers(:) = merge(1, 0, values)
      call self%fixed(name, numbers, 0, 1)
      if (self%has_loaded()) values = numbers /= 0
   end subroutine fixed_logicals

   !> A bound that need not be given.
   pure real(wp) function integer_bound(default, given) result(bound)
      real(wp), intent(in) :: default
      integer, intent(in), optional :: given
      bound = default
      if (present(given)) bound = given
   end function integer_bound

   pure real(wp) function real_bound(default, given) result(bound)
      real(wp), intent(in) :: default
      real(wp), intent(in), optional :: given
      bound = default
      if (present(given)) bound = given
   end function real_bound

end module rockdda_base_state_archive
