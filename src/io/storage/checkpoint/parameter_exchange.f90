! SPDX-License-Identifier: MIT
!> Numbers of a run that the table of options describes, to and from a checkpoint: each under the name of its option;
!> those of element i of a list under GROUP_i_NAME.
module rockdda_io_parameter_exchange
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : origin_type
   use rockdda_base_strings, only : to_string
   use rockdda_model_option, only : option_visitor_type, option_type
   use rockdda_io_archive, only : archive_type
   implicit none
   private
   public :: parameter_exchange_type

   type, extends(option_visitor_type) :: parameter_exchange_type
      type(archive_type), pointer :: archive => null()
      character(len=:), allocatable, private :: group
      character(len=:), allocatable, private :: prefix  !! 'stage_1_' in a list, else ''
      character(len=:), allocatable, private :: last    !! name of the row before
      logical, private :: in_list = .false.
   contains
      procedure :: begin => exchange_begin
      procedure :: resize => exchange_size
      procedure :: start_element => exchange_element
      procedure :: add_real => exchange_real
      procedure :: add_integer => exchange_integer
      procedure :: add_logical => exchange_logical
      procedure :: add_text => exchange_text
      procedure :: add_choice => exchange_choice
      procedure :: add_reals => exchange_reals
      procedure :: add_list => exchange_list
      procedure :: add_integers => exchange_integers
      procedure :: add_rows => exchange_rows
      procedure :: add_file => exchange_file
      procedure :: used => exchange_used
   end type parameter_exchange_type

contains

   !> Begin a group.
   subroutine exchange_begin(self, name, meaning, is_list)
      class(parameter_exchange_type), intent(inout) :: self
      character(len=*), intent(in) :: name, meaning
      logical, intent(in), optional :: is_list
      self%group = name
      self%prefix = ''
      self%in_list = .false.
      if (present(is_list)) self%in_list = is_list
      associate (unused => meaning)
      end associate
   end subroutine exchange_begin

   !> Save or load the number of elements. When it is loaded, the last element must be in the file; otherwise it becomes
   !> 0, and loading fails.
   subroutine exchange_size(self, n)
      class(parameter_exchange_type), intent(inout) :: self
      integer, intent(inout) :: n
      logical :: there
      call self%archive%item('n_'//self%group, n)
      if (self%archive%saving) return
      if (allocated(self%archive%error)) then
         n = 0
         return
      end if
      there = n == 0
      if (n > 0) there = self%archive%has_item(self%group//'_'//to_string(n))
      if (.not. there) call self%archive%refuse('n_'//self%group, 'holds an impossible number')
      if (.not. there) n = 0
   end subroutine exchange_size

   !> Save or load element i, marked by its number.
   subroutine exchange_element(self, i, origin)
      class(parameter_exchange_type), intent(inout) :: self
      integer, intent(in) :: i
      type(origin_type), intent(inout) :: origin
      integer :: mark
      mark = i
      self%prefix = self%group//'_'//to_string(i)
      call self%archive%item(self%prefix, mark)
      self%prefix = self%prefix//'_'
      associate (unused => origin)
      end associate
   end subroutine exchange_element

   !> Save or load a real.
   subroutine exchange_real(self, row, given, used, origin)
      class(parameter_exchange_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      real(wp), intent(inout) :: given
      real(wp), intent(inout), optional :: used
      type(origin_type), intent(inout), optional :: origin
      self%last = row%name
      if (present(used)) then
         call self%archive%item(row%name, used)
      else if (self%in_list) then
         call self%archive%item(self%prefix//row%name, given)
      end if
      associate (unused => present(origin))
      end associate
   end subroutine exchange_real

   !> Save or load a whole number.
   subroutine exchange_integer(self, row, given, used)
      class(parameter_exchange_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      integer, intent(inout) :: given
      integer, intent(inout), optional :: used
      if (present(used)) then
         call self%archive%item(row%name, used)
      else if (self%in_list) then
         call self%archive%item(self%prefix//row%name, given)
      end if
   end subroutine exchange_integer

   !> .true. or .false.
   subroutine exchange_logical(self, row, given, used, is_given)
      class(parameter_exchange_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      logical, intent(inout) :: given
      logical, intent(inout), optional :: used
      logical, intent(inout), optional :: is_given
      if (present(used)) then
         call self%archive%item(row%name, used)
      else if (self%in_list) then
         call self%archive%item(self%prefix//row%name, given)
      end if
      associate (unused => present(is_given))
      end associate
   end subroutine exchange_logical

   !> Save or load a text.
   subroutine exchange_text(self, row, given, used)
      class(parameter_exchange_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      character(len=:), allocatable, intent(inout) :: given
      character(len=:), allocatable, intent(inout), optional :: used
      if (present(used)) then
         call self%archive%item(row%name, used)
      else if (self%in_list) then
         call self%archive%item(self%prefix//row%name, given)
      end if
   end subroutine exchange_text

   !> Save or load one of several words, as a logical.
   subroutine exchange_choice(self, row, given, used, true_for)
      class(parameter_exchange_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      character(len=:), allocatable, intent(inout) :: given
      logical, intent(inout) :: used
      integer, intent(in) :: true_for
      call self%archive%item(row%name, used)
      associate (unused_1 => allocated(given), unused_2 => true_for)
      end associate
   end subroutine exchange_choice

   !> Save or load a fixed number of reals.
   subroutine exchange_reals(self, row, given, otherwise)
      class(parameter_exchange_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      real(wp), intent(inout) :: given(:)
      real(wp), intent(in), optional :: otherwise(:)
      call self%archive%fixed(self%prefix//row%name, given)
      associate (unused => present(otherwise))
      end associate
   end subroutine exchange_reals

   !> Save or load any number of reals.
   subroutine exchange_list(self, row, given)
      class(parameter_exchange_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      real(wp), allocatable, intent(inout) :: given(:)
      call self%archive%item(self%prefix//row%name, given)
   end subroutine exchange_list

   !> Save or load any number of whole numbers.
   subroutine exchange_integers(self, row, given)
      class(parameter_exchange_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      integer, allocatable, intent(inout) :: given(:)
      call self%archive%item(self%prefix//row%name, given)
   end subroutine exchange_integers

   !> Save or load rows of reals.
   subroutine exchange_rows(self, row, given, used)
      class(parameter_exchange_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      real(wp), allocatable, intent(inout) :: given(:, :)
      real(wp), allocatable, intent(inout), optional :: used(:, :)
      if (present(used)) then
         call self%archive%item(row%name, used)
      else
         call self%archive%item(self%prefix//row%name, given)
      end if
   end subroutine exchange_rows

   !> Save or load rows of reals from a file.
   subroutine exchange_file(self, row, given, used, name)
      class(parameter_exchange_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      real(wp), allocatable, intent(inout) :: given(:, :), used(:, :)
      character(len=:), allocatable, intent(inout), optional :: name  !! of the file
      if (self%in_list) then
         call self%archive%item(self%prefix//row%name, given)
      else
         call self%archive%item(row%name, used)
      end if
      associate (unused => present(name))
      end associate
   end subroutine exchange_file

   !> Save or load a number that is computed from options and model.
   subroutine exchange_used(self, quantity, value, name)
      class(parameter_exchange_type), intent(inout) :: self
      character(len=*), intent(in) :: quantity
      real(wp), intent(inout) :: value
      character(len=*), intent(in), optional :: name
      if (present(name)) then
         call self%archive%item(name, value)
      else
         call self%archive%item(self%last, value)
      end if
      associate (unused => quantity)
      end associate
   end subroutine exchange_used

end module rockdda_io_parameter_exchange
