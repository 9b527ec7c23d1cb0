! SPDX-License-Identifier: MIT
!> Values of a state that go into a checkpoint and come back by the same call, as those see it who own them:
!>
!>     call archive%section('held_forces')
!>     call archive%item('n', self%n, least=0)
!>     call archive%item('force', self%force, [2, self%n])     ! written; or read, allocated and checked
!>
!> so that writer and reader cannot differ. All reals must be finite. A list or a table whose size is given must be in
!> the file, and have it; without a size what is missing is not allocated. The first value that is wrong ends loading:
!> all calls behind it do nothing. The file is that of rockdda_io_archive.
module rockdda_base_state_archive
   use rockdda_base_kinds, only : wp
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
      generic :: item => integer_item, real_item, logical_item, integers_item, reals_item, real_rows_item, logicals_item
      procedure(exchange_integer), deferred :: integer_item
      procedure(exchange_real), deferred :: real_item
      procedure(exchange_logical), deferred :: logical_item
      procedure(exchange_integers), deferred :: integers_item
      procedure(exchange_reals), deferred :: reals_item
      procedure(exchange_real_rows), deferred :: real_rows_item
      procedure(exchange_logicals), deferred :: logicals_item
      generic :: fixed => fixed_reals, fixed_integers
      procedure(exchange_fixed_integers), deferred :: fixed_integers
      procedure(exchange_fixed_reals), deferred :: fixed_reals
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

      !> Save or load a whole number.
      subroutine exchange_integer(self, name, value, least, most)
         import :: state_archive_type
         class(state_archive_type), intent(inout) :: self
         character(len=*), intent(in) :: name
         integer, intent(inout) :: value
         integer, intent(in), optional :: least, most
      end subroutine exchange_integer

      !> Save or load a real.
      subroutine exchange_real(self, name, value, least, most)
         import :: state_archive_type, wp
         class(state_archive_type), intent(inout) :: self
         character(len=*), intent(in) :: name
         real(wp), intent(inout) :: value
         real(wp), intent(in), optional :: least, most
      end subroutine exchange_real

      !> Save or load a logical.
      subroutine exchange_logical(self, name, value)
         import :: state_archive_type
         class(state_archive_type), intent(inout) :: self
         character(len=*), intent(in) :: name
         logical, intent(inout) :: value
      end subroutine exchange_logical

      !> Save or load a list of integers.
      subroutine exchange_integers(self, name, values, n, least, most)
         import :: state_archive_type
         class(state_archive_type), intent(inout) :: self
         character(len=*), intent(in) :: name
         integer, allocatable, intent(inout) :: values(:)
         integer, intent(in), optional :: n, least, most
      end subroutine exchange_integers

      !> Save or load a list of reals.
      subroutine exchange_reals(self, name, values, n, least, most)
         import :: state_archive_type, wp
         class(state_archive_type), intent(inout) :: self
         character(len=*), intent(in) :: name
         real(wp), allocatable, intent(inout) :: values(:)
         integer, intent(in), optional :: n
         real(wp), intent(in), optional :: least, most
      end subroutine exchange_reals

      !> Save or load a table of reals.
      subroutine exchange_real_rows(self, name, values, known, largest)
         import :: state_archive_type, wp
         class(state_archive_type), intent(inout) :: self
         character(len=*), intent(in) :: name
         real(wp), allocatable, intent(inout) :: values(:, :)
         integer, intent(in), optional :: known(2)   !! its shape; any number of columns where the second is negative
         real(wp), intent(in), optional :: largest   !! magnitude
      end subroutine exchange_real_rows

      !> Save or load a list of logicals.
      subroutine exchange_logicals(self, name, values, n)
         import :: state_archive_type
         class(state_archive_type), intent(inout) :: self
         character(len=*), intent(in) :: name
         logical, allocatable, intent(inout) :: values(:)
         integer, intent(in), optional :: n
      end subroutine exchange_logicals

      !> Save or load a list of integers that keeps its size.
      subroutine exchange_fixed_integers(self, name, values, least, most)
         import :: state_archive_type
         class(state_archive_type), intent(inout) :: self
         character(len=*), intent(in) :: name
         integer, intent(inout) :: values(:)
         integer, intent(in), optional :: least, most
      end subroutine exchange_fixed_integers

      !> Save or load a list of reals that keeps its size.
      subroutine exchange_fixed_reals(self, name, values, least, most)
         import :: state_archive_type, wp
         class(state_archive_type), intent(inout) :: self
         character(len=*), intent(in) :: name
         real(wp), intent(inout) :: values(:)
         real(wp), intent(in), optional :: least, most
      end subroutine exchange_fixed_reals

   end interface

end module rockdda_base_state_archive
