! SPDX-License-Identifier: MIT
!> The rows of the table of options as a list: for hints about mistyped names, documents and the schema.
module rockdda_io_option_list
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : origin_type
   use rockdda_model_option, only : option_visitor_type, option_type, option_kind
   use rockdda_model_option_table, only : describe_options
   use rockdda_model_options, only : run_options_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_io_name_hints, only : name_length
   implicit none
   private
   public :: option_list_type, listed_option_type, listed_group_type, list_options

   type :: listed_group_type
      character(len=name_length) :: name = ''
      character(len=:), allocatable :: meaning
      logical :: is_list = .false.               !! each such group is one element of a list
   end type listed_group_type

   type :: listed_option_type
      type(option_type) :: row
      integer :: kind = 0                        !! one of option_kind%...
      logical :: default_flag = .false.          !! of a logical
      integer :: n_values = 0                    !! of a fixed number of them
   end type listed_option_type

   type, extends(option_visitor_type) :: option_list_type
      integer :: n = 0, n_groups = 0
      type(listed_group_type) :: groups(30)
      character(len=name_length) :: group_of(300) = '' !! the group of each option
      character(len=name_length) :: names(300) = ''
      type(listed_option_type) :: options(300)
   contains
      procedure :: begin => list_group
      procedure :: resize => list_one
      procedure :: add_real => list_real
      procedure :: add_integer => list_integer
      procedure :: add_logical => list_logical
      procedure :: add_text => list_text
      procedure :: add_choice => list_choice
      procedure :: add_reals => list_reals
      procedure :: add_list => list_list
      procedure :: add_integers => list_integers
      procedure :: add_rows => list_rows
      procedure :: add_file => list_file
      procedure, private :: append
   end type option_list_type

contains

   !> List all options.
   subroutine list_options(list)
      type(option_list_type), intent(out) :: list
      type(run_options_type) :: options
      type(parameters_type) :: parameters
      call describe_options(list, options, parameters)
   end subroutine list_options

   !> List a group.
   subroutine list_group(self, name, meaning, is_list)
      class(option_list_type), intent(inout) :: self
      character(len=*), intent(in) :: name, meaning
      logical, intent(in), optional :: is_list
      self%n_groups = self%n_groups + 1
      self%groups(self%n_groups)%name = name
      self%groups(self%n_groups)%meaning = meaning
      if (present(is_list)) self%groups(self%n_groups)%is_list = is_list
   end subroutine list_group

   !> Give each list one element, so that its rows are visited.
   subroutine list_one(self, n)
      class(option_list_type), intent(inout) :: self
      integer, intent(inout) :: n
      n = 1
      associate (unused => self)
      end associate
   end subroutine list_one

   !> Keep a row.
   subroutine append(self, row, kind)
      class(option_list_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      integer, intent(in) :: kind
      self%n = self%n + 1
      self%group_of(self%n) = self%groups(self%n_groups)%name
      self%names(self%n) = row%name
      self%options(self%n)%row = row
      self%options(self%n)%kind = kind
   end subroutine append

   !> List a real.
   subroutine list_real(self, row, given, used, origin)
      class(option_list_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      real(wp), intent(inout) :: given
      real(wp), intent(inout), optional :: used
      type(origin_type), intent(inout), optional :: origin
      call self%append(row, option_kind%number)
      associate (unused_1 => given, unused_2 => present(used), unused_3 => present(origin))
      end associate
   end subroutine list_real

   !> List a whole number.
   subroutine list_integer(self, row, given, used)
      class(option_list_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      integer, intent(inout) :: given
      integer, intent(inout), optional :: used
      call self%append(row, option_kind%whole)
      associate (unused_1 => given, unused_2 => present(used))
      end associate
   end subroutine list_integer

   !> .true. or .false.
   subroutine list_logical(self, row, given, used, is_given)
      class(option_list_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      logical, intent(inout) :: given
      logical, intent(inout), optional :: used
      logical, intent(inout), optional :: is_given
      call self%append(row, option_kind%logical)
      self%options(self%n)%default_flag = given
      associate (unused_1 => present(used), unused_2 => present(is_given))
      end associate
   end subroutine list_logical

   !> List a text, or one of several words.
   subroutine list_text(self, row, given, used)
      class(option_list_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      character(len=:), allocatable, intent(inout) :: given
      character(len=:), allocatable, intent(inout), optional :: used
      call self%append(row, merge(option_kind%choice, option_kind%text, len(row%choices) > 0))
      associate (unused_1 => allocated(given), unused_2 => present(used))
      end associate
   end subroutine list_text

   !> List one of several words.
   subroutine list_choice(self, row, given, used, true_for)
      class(option_list_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      character(len=:), allocatable, intent(inout) :: given
      logical, intent(inout) :: used
      integer, intent(in) :: true_for
      call self%append(row, option_kind%choice)
      associate (unused_1 => allocated(given), unused_2 => used, unused_3 => true_for)
      end associate
   end subroutine list_choice

   !> List a fixed number of reals.
   subroutine list_reals(self, row, given, otherwise)
      class(option_list_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      real(wp), intent(inout) :: given(:)
      real(wp), intent(in), optional :: otherwise(:)
      call self%append(row, option_kind%numbers)
      self%options(self%n)%n_values = size(given)
      associate (unused => present(otherwise))
      end associate
   end subroutine list_reals

   !> List any number of reals.
   subroutine list_list(self, row, given)
      class(option_list_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      real(wp), allocatable, intent(inout) :: given(:)
      call self%append(row, option_kind%list)
      associate (unused => allocated(given))
      end associate
   end subroutine list_list

   !> List any number of whole numbers.
   subroutine list_integers(self, row, given)
      class(option_list_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      integer, allocatable, intent(inout) :: given(:)
      call self%append(row, option_kind%wholes)
      associate (unused => allocated(given))
      end associate
   end subroutine list_integers

   !> List rows of reals.
   subroutine list_rows(self, row, given, used)
      class(option_list_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      real(wp), allocatable, intent(inout) :: given(:, :)
      real(wp), allocatable, intent(inout), optional :: used(:, :)
      call self%append(row, option_kind%rows)
      associate (unused_1 => allocated(given), unused_2 => present(used))
      end associate
   end subroutine list_rows

   !> List rows of reals in a file.
   subroutine list_file(self, row, given, used, name)
      class(option_list_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      real(wp), allocatable, intent(inout) :: given(:, :), used(:, :)
      character(len=:), allocatable, intent(inout), optional :: name  !! of the file
      call self%append(row, option_kind%file)
      associate (unused_1 => allocated(given), unused_2 => allocated(used), unused_3 => present(name))
      end associate
   end subroutine list_file

end module rockdda_io_option_list
