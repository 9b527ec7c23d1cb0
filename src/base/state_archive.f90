! SPDX-License-Identifier: MIT
!> Values of a state that go into a checkpoint and come back by the same call, as those see it who own them:
!>
!>     call archive%section('held_forces')
!>     call archive%item('force', self%force)       ! written; or read and allocated, not allocated when it is missing
!>
!>     if (archive%has_loaded()) call archive%check%list(self%force, n, 'force')
!>
!> so that writer and reader cannot differ. The file behind it is that of rockdda_io_archive.
module rockdda_base_state_archive
   use rockdda_base_kinds, only : wp
   use rockdda_base_value_check, only : value_check_type
   implicit none
   private
   public :: state_archive_type

   type, abstract :: state_archive_type
      logical :: saving = .false.                      !! otherwise loading
      type(value_check_type) :: check                  !! of what is loaded; its group is the section
   contains
      procedure(has_loaded_all), deferred :: has_loaded
      procedure(begin_section), deferred :: section
      generic :: item => integer_item, real_item, logical_item, integers_item, reals_item, real_rows_item, logicals_item
      procedure(exchange_integer), deferred :: integer_item
      procedure(exchange_real), deferred :: real_item
      procedure(exchange_logical), deferred :: logical_item
      procedure(exchange_integers), deferred :: integers_item
      procedure(exchange_reals), deferred :: reals_item
      procedure(exchange_real_rows), deferred :: real_rows_item
      procedure(exchange_logicals), deferred :: logicals_item
   end type state_archive_type

   abstract interface

      !> Have the items so far been loaded, without a failure? Then they are to be checked.
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

      !> Save or load a whole number.
      subroutine exchange_integer(self, name, value)
         import :: state_archive_type
         class(state_archive_type), intent(inout) :: self
         character(len=*), intent(in) :: name
         integer, intent(inout) :: value
      end subroutine exchange_integer

      !> Save or load a real.
      subroutine exchange_real(self, name, value)
         import :: state_archive_type, wp
         class(state_archive_type), intent(inout) :: self
         character(len=*), intent(in) :: name
         real(wp), intent(inout) :: value
      end subroutine exchange_real

      !> Save or load a logical.
      subroutine exchange_logical(self, name, value)
         import :: state_archive_type
         class(state_archive_type), intent(inout) :: self
         character(len=*), intent(in) :: name
         logical, intent(inout) :: value
      end subroutine exchange_logical

      !> Save or load a list of integers.
      subroutine exchange_integers(self, name, values)
         import :: state_archive_type
         class(state_archive_type), intent(inout) :: self
         character(len=*), intent(in) :: name
         integer, allocatable, intent(inout) :: values(:)
      end subroutine exchange_integers

      !> Save or load a list of reals.
      subroutine exchange_reals(self, name, values)
         import :: state_archive_type, wp
         class(state_archive_type), intent(inout) :: self
         character(len=*), intent(in) :: name
         real(wp), allocatable, intent(inout) :: values(:)
      end subroutine exchange_reals

      !> Save or load a table of reals.
      subroutine exchange_real_rows(self, name, values)
         import :: state_archive_type, wp
         class(state_archive_type), intent(inout) :: self
         character(len=*), intent(in) :: name
         real(wp), allocatable, intent(inout) :: values(:, :)
      end subroutine exchange_real_rows

      !> Save or load a list of logicals.
      subroutine exchange_logicals(self, name, values)
         import :: state_archive_type
         class(state_archive_type), intent(inout) :: self
         character(len=*), intent(in) :: name
         logical, allocatable, intent(inout) :: values(:)
      end subroutine exchange_logicals

   end interface

end module rockdda_base_state_archive
