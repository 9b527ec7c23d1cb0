! SPDX-License-Identifier: MIT
!> Options that were not given take the constant defaults of the table; options that the run keeps as they are go to
!> its parameters.
module rockdda_model_option_defaults
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : to_string
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_model_option, only : option_visitor_type, option_type, choice, index_of_choice
   use rockdda_model_options, only : is_set
   implicit none
   private
   public :: defaults_type, transfer_type

   !> Fills options that were not given.
   type, extends(option_visitor_type) :: defaults_type
      logical :: preset = .false.                  !! the preset dda_windows holds
   contains
      procedure :: add_real => default_real
      procedure :: add_integer => default_integer
      procedure :: add_text => default_text
      procedure :: add_choice => default_choice
   end type defaults_type

   !> Copies given options to the parameters of the run. A note names each value of the analysis file that is replaced.
   type, extends(option_visitor_type) :: transfer_type
      type(diagnostics_type) :: notes
   contains
      procedure :: add_real => transfer_real
      procedure :: add_integer => transfer_integer
      procedure :: add_logical => transfer_logical
      procedure :: add_text => transfer_text
      procedure :: add_choice => transfer_choice
      procedure :: add_rows => transfer_rows
      procedure :: add_file => transfer_file
   end type transfer_type

contains

   !> Fill in a real.
   subroutine default_real(self, row, given, used, origin)
      class(defaults_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      real(wp), intent(inout) :: given
      real(wp), intent(inout), optional :: used
      type(origin_type), intent(inout), optional :: origin
      if (.not. is_set(given)) given = constant_default(self, row)
      associate (unused_1 => present(used), unused_2 => present(origin))
      end associate
   end subroutine default_real

   !> Fill in a whole number.
   subroutine default_integer(self, row, given, used)
      class(defaults_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      integer, intent(inout) :: given
      integer, intent(inout), optional :: used
      real(wp) :: value
      value = constant_default(self, row)
      if (.not. is_set(given) .and. is_set(value)) given = nint(value)
      associate (unused => present(used))
      end associate
   end subroutine default_integer

   !> Fill in a text.
   subroutine default_text(self, row, given, used)
      class(defaults_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      character(len=:), allocatable, intent(inout) :: given
      character(len=:), allocatable, intent(inout), optional :: used
      call fill_text(self, row, given)
      associate (unused => present(used))
      end associate
   end subroutine default_text

   !> Fill in one of several words.
   subroutine default_choice(self, row, given, used, true_for)
      class(defaults_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      character(len=:), allocatable, intent(inout) :: given
      logical, intent(inout) :: used
      integer, intent(in) :: true_for
      call fill_text(self, row, given)
      associate (unused_1 => used, unused_2 => true_for)
      end associate
   end subroutine default_choice

   !> A text that was not given, or is blank, becomes the default, which may be empty.
   subroutine fill_text(self, row, given)
      class(defaults_type), intent(in) :: self
      type(option_type), intent(in) :: row
      character(len=:), allocatable, intent(inout) :: given
      if (.not. allocated(given)) given = ''
      given = trim(given)
      if (len(given) > 0) return
      given = row%default_word
      if (self%preset .and. len(row%preset_word) > 0) given = row%preset_word
   end subroutine fill_text

   !> The constant default of a number; unset when there is none.
   pure real(wp) function constant_default(self, row)
      class(defaults_type), intent(in) :: self
      type(option_type), intent(in) :: row
      constant_default = row%default
      if (self%preset .and. is_set(row%preset_default)) constant_default = row%preset_default
   end function constant_default

   !> Transfer a real.
   subroutine transfer_real(self, row, given, used, origin)
      class(transfer_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      real(wp), intent(inout) :: given
      real(wp), intent(inout), optional :: used
      type(origin_type), intent(inout), optional :: origin
      if (.not. present(used) .or. .not. is_set(given)) return
      call note_replaced(self, row, used, given)
      used = given
      associate (unused => present(origin))
      end associate
   end subroutine transfer_real

   !> Transfer a whole number.
   subroutine transfer_integer(self, row, given, used)
      class(transfer_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      integer, intent(inout) :: given
      integer, intent(inout), optional :: used
      if (.not. present(used) .or. .not. is_set(given)) return
      call note_replaced(self, row, real(used, wp), real(given, wp))
      used = given
   end subroutine transfer_integer

   !> .true. or .false.
   subroutine transfer_logical(self, row, given, used, is_given)
      class(transfer_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      logical, intent(inout) :: given
      logical, intent(inout), optional :: used
      logical, intent(inout), optional :: is_given
      if (present(used)) used = given
      associate (unused_self => self, unused_1 => row, unused_2 => present(is_given))
      end associate
   end subroutine transfer_logical

   !> Transfer a text.
   subroutine transfer_text(self, row, given, used)
      class(transfer_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      character(len=:), allocatable, intent(inout) :: given
      character(len=:), allocatable, intent(inout), optional :: used
      if (present(used)) used = given
      associate (unused_self => self, unused => row)
      end associate
   end subroutine transfer_text

   !> Transfer one of several words.
   subroutine transfer_choice(self, row, given, used, true_for)
      class(transfer_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      character(len=:), allocatable, intent(inout) :: given
      logical, intent(inout) :: used
      integer, intent(in) :: true_for
      integer :: i
      i = index_of_choice(row, given)
      used = i == true_for
      ! one spelling from here on
      if (i > 0) given = choice(row, i)
      associate (unused_self => self)
      end associate
   end subroutine transfer_choice

   !> Transfer rows of reals.
   subroutine transfer_rows(self, row, given, used)
      class(transfer_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      real(wp), allocatable, intent(inout) :: given(:, :)
      real(wp), allocatable, intent(inout), optional :: used(:, :)
      if (present(used) .and. allocated(given)) used = given
      associate (unused_self => self, unused => row)
      end associate
   end subroutine transfer_rows

   !> Transfer rows of reals from a file.
   subroutine transfer_file(self, row, given, used, name)
      class(transfer_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      real(wp), allocatable, intent(inout) :: given(:, :), used(:, :)
      character(len=:), allocatable, intent(inout), optional :: name  !! of the file
      if (allocated(given)) used = given
      associate (unused_self => self, unused_1 => row, unused_2 => present(name))
      end associate
   end subroutine transfer_file

   !> Note that an option replaces another value of the analysis file.
   subroutine note_replaced(self, row, old, new)
      class(transfer_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      real(wp), intent(in) :: old, new
      if (row%in_analysis .and. abs(old - new) > 0) call self%notes%add(severity%note, row%quantity//' '// &
         to_string(new)//' replaces '//to_string(old)//' of the analysis file')
   end subroutine note_replaced

end module rockdda_model_option_defaults
