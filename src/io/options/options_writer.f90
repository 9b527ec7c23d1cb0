! SPDX-License-Identifier: MIT
!> Options as the text of an options file: each value that is given, by the table of options. Numbers read back exactly.
module rockdda_io_options_writer
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : origin_type
   use rockdda_base_strings, only : to_string
   use rockdda_model_option, only : option_visitor_type, option_type
   use rockdda_model_option_table, only : describe_options
   use rockdda_model_options, only : run_options_type, is_set
   use rockdda_model_parameters, only : parameters_type
   use rockdda_io_option_list, only : option_list_type, list_options
   use rockdda_io_text_output, only : exact_text
   implicit none
   private
   public :: options_text

   !> Lines are broken between values beyond this length.
   integer, parameter :: longest_line = 110

   type, extends(option_visitor_type) :: options_writer_type
      character(len=:), allocatable :: head          !! &model and materials, which come first
      character(len=:), allocatable :: text          !! other groups that are complete
      character(len=:), allocatable :: group         !! name of the present group
      logical :: in_list = .false.
      character(len=:), allocatable :: entries       !! of the present group or element so far
      type(option_list_type), pointer :: defaults => null()   !! for logicals, which are always given
   contains
      procedure :: begin => write_begin
      procedure :: start_element => write_element
      procedure :: add_real => write_real
      procedure :: add_integer => write_integer
      procedure :: add_logical => write_logical
      procedure :: add_text => write_text
      procedure :: add_choice => write_choice
      procedure :: add_reals => write_reals
      procedure :: add_list => write_list
      procedure :: add_integers => write_integers
      procedure :: add_rows => write_rows
      procedure :: add_file => write_file
      procedure, private :: put, end_group
   end type options_writer_type

contains

   !> The text of an options file with these options.
   function options_text(options) result(text)
      type(run_options_type), intent(in) :: options
      character(len=:), allocatable :: text
      type(options_writer_type) :: writer
      type(option_list_type), target, allocatable :: defaults
      type(run_options_type) :: given
      type(parameters_type) :: no_parameters
      allocate (defaults)
      call list_options(defaults)
      writer%defaults => defaults
      writer%head = ''
      writer%text = ''
      writer%entries = ''
      given = options
      call describe_options(writer, given, no_parameters)
      call writer%end_group()
      text = writer%head//writer%text
   end function options_text

   !> Begin a group.
   subroutine write_begin(self, name, meaning, is_list)
      class(options_writer_type), intent(inout) :: self
      character(len=*), intent(in) :: name, meaning
      logical, intent(in), optional :: is_list
      call self%end_group()
      self%group = name
      self%in_list = .false.
      if (present(is_list)) self%in_list = is_list
      associate (unused => meaning)
      end associate
   end subroutine write_begin

   !> Begin an element of a list: a group of its own.
   subroutine write_element(self, i, origin)
      class(options_writer_type), intent(inout) :: self
      integer, intent(in) :: i
      type(origin_type), intent(inout) :: origin
      call self%end_group()
      associate (unused_1 => i, unused_2 => origin)
      end associate
   end subroutine write_element

   !> Write the present group, when it has entries.
   subroutine end_group(self)
      class(options_writer_type), intent(inout) :: self
      character(len=:), allocatable :: group
      if (len(self%entries) == 0) return
      group = '&'//self%group//self%entries//' /'//new_line('a')
      select case (self%group)
      case ('model', 'block_material', 'joint_material'); self%head = self%head//group
      case default; self%text = self%text//group
      end select
      self%entries = ''
   end subroutine end_group

   !> Add "name = value" to the present group.
   subroutine put(self, row, value)
      class(options_writer_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      character(len=*), intent(in) :: value
      character(len=:), allocatable :: line
      line = self%entries(index(self%entries, new_line('a'), back=.true.) + 1:)
      if (len(self%entries) > 0) self%entries = self%entries//','
      if (len(line) + len(self%group) + len(row%name) + len(value) > longest_line .and. len(line) > 0) &
         self%entries = self%entries//new_line('a')//'  '
      self%entries = self%entries//' '//row%name//' = '//value
   end subroutine put

   !> Write a real.
   subroutine write_real(self, row, given, used, origin)
      class(options_writer_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      real(wp), intent(inout) :: given
      real(wp), intent(inout), optional :: used
      type(origin_type), intent(inout), optional :: origin
      logical :: wanted
      ! a value on an excluded bound stands for none, as 0 does for a stiffness of joints
      wanted = is_set(given) .and. .not. (row%above .and. given <= row%least)
      if (self%in_list .and. is_set(row%default)) wanted = wanted .and. abs(given - row%default) > 0
      if (wanted) call self%put(row, exact_text(given))
      associate (unused_1 => present(used), unused_2 => present(origin))
      end associate
   end subroutine write_real

   !> Write a whole number.
   subroutine write_integer(self, row, given, used)
      class(options_writer_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      integer, intent(inout) :: given
      integer, intent(inout), optional :: used
      if (is_set(given)) call self%put(row, to_string(given))
      associate (unused => present(used))
      end associate
   end subroutine write_integer

   !> Write .true. or .false., where it was given or is not the default.
   subroutine write_logical(self, row, given, used, is_given)
      class(options_writer_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      logical, intent(inout) :: given
      logical, intent(inout), optional :: used
      logical, intent(inout), optional :: is_given
      logical :: wanted
      integer :: i
      wanted = .true.
      if (present(is_given)) then
         wanted = is_given
      else
         do i = 1, self%defaults%n
            if (self%defaults%group_of(i) == self%group .and. self%defaults%names(i) == row%name) &
               wanted = given .neqv. self%defaults%options(i)%default_flag
         end do
      end if
      if (wanted) call self%put(row, trim(merge('.true. ', '.false.', given)))
      associate (unused => present(used))
      end associate
   end subroutine write_logical

   !> Write a text that is not blank.
   subroutine write_text(self, row, given, used)
      class(options_writer_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      character(len=:), allocatable, intent(inout) :: given
      character(len=:), allocatable, intent(inout), optional :: used
      if (allocated(given)) then
         if (len_trim(given) > 0) call self%put(row, quoted(given))
      end if
      associate (unused => present(used))
      end associate
   end subroutine write_text

   !> Write one of several words.
   subroutine write_choice(self, row, given, used, true_for)
      class(options_writer_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      character(len=:), allocatable, intent(inout) :: given
      logical, intent(inout) :: used
      integer, intent(in) :: true_for
      call self%add_text(row, given)
      associate (unused_1 => used, unused_2 => true_for)
      end associate
   end subroutine write_choice

   !> Write a fixed number of reals.
   subroutine write_reals(self, row, given, otherwise)
      class(options_writer_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      real(wp), intent(inout) :: given(:)
      real(wp), intent(in), optional :: otherwise(:)
      if (all(is_set_each(given))) call self%put(row, numbers(given))
      associate (unused => present(otherwise))
      end associate
   end subroutine write_reals

   !> Write any number of reals.
   subroutine write_list(self, row, given)
      class(options_writer_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      real(wp), allocatable, intent(inout) :: given(:)
      if (.not. allocated(given)) return
      if (size(given) > 0) call self%put(row, numbers(given))
   end subroutine write_list

   !> Write any number of whole numbers.
   subroutine write_integers(self, row, given)
      class(options_writer_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      integer, allocatable, intent(inout) :: given(:)
      character(len=:), allocatable :: text
      integer :: i
      if (.not. allocated(given)) return
      if (size(given) == 0) return
      text = to_string(given(1))
      do i = 2, size(given)
         text = text//', '//to_string(given(i))
      end do
      call self%put(row, text)
   end subroutine write_integers

   !> Write rows of reals, each on a line of its own.
   subroutine write_rows(self, row, given, used)
      class(options_writer_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      real(wp), allocatable, intent(inout) :: given(:, :)
      real(wp), allocatable, intent(inout), optional :: used(:, :)
      character(len=:), allocatable :: text
      integer :: i
      if (.not. allocated(given)) return
      if (size(given, 2) == 0) return
      text = numbers(given(:, 1))
      do i = 2, size(given, 2)
         text = text//','//new_line('a')//'    '//numbers(given(:, i))
      end do
      call self%put(row, text)
      associate (unused => present(used))
      end associate
   end subroutine write_rows

   !> Write the name of a file.
   subroutine write_file(self, row, given, used, name)
      class(options_writer_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      real(wp), allocatable, intent(inout) :: given(:, :), used(:, :)
      character(len=:), allocatable, intent(inout), optional :: name
      if (present(name)) call self%add_text(row, name)
      associate (unused_1 => allocated(given), unused_2 => allocated(used))
      end associate
   end subroutine write_file

   !> Which of these were given?
   pure function is_set_each(values) result(given)
      real(wp), intent(in) :: values(:)
      logical :: given(size(values))
      integer :: i
      do i = 1, size(values)
         given(i) = is_set(values(i))
      end do
   end function is_set_each

   !> Numbers with commas between them.
   pure function numbers(values) result(text)
      real(wp), intent(in) :: values(:)
      character(len=:), allocatable :: text
      integer :: i
      text = ''
      do i = 1, size(values)
         if (i > 1) text = text//', '
         text = text//exact_text(values(i))
      end do
   end function numbers

   !> A text in quotes; a quote in it is doubled.
   pure function quoted(text)
      character(len=*), intent(in) :: text
      character(len=:), allocatable :: quoted
      integer :: i
      quoted = "'"
      do i = 1, len_trim(text)
         quoted = quoted//text(i:i)
         if (text(i:i) == "'") quoted = quoted//"'"
      end do
      quoted = quoted//"'"
   end function quoted

end module rockdda_io_options_writer
