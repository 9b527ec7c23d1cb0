! SPDX-License-Identifier: MIT
!> One row of the table of options, and the base type of all visitors of the table.
!>
!> rockdda_model_option_table describes each option once and binds it to the variable that keeps what the user gives
!> and, where there is one, to the number that the run uses:
!>
!>     call table%begin('time', 'Time steps.')
!>     call table%add(option('steps', 'number of time steps', least=0.0_wp), options%steps, parameters%n_steps)
!>
!> Each extension does its own work with a row: the reader takes the value from a file, the list collects the rows for
!> hints and documents, others fill in defaults, write the log, or exchange numbers with a checkpoint. An extension
!> redefines the procedures that it needs; those of this base do nothing.
module rockdda_model_option
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : origin_type
   use rockdda_model_options, only : unset_real
   implicit none
   private
   public :: option_type, option_visitor_type, option, option_kind, list_rule, choice, n_choices, index_of_choice

   type :: option_kind_enum
      integer :: number = 1
      integer :: whole = 2
      integer :: logical = 3
      integer :: text = 4
      integer :: choice = 5      !! one of several words
      integer :: numbers = 6     !! a fixed number of them
      integer :: list = 7        !! any number of numbers
      integer :: wholes = 8      !! any number of whole numbers
      integer :: rows = 9        !! rows of numbers one after another
      integer :: file = 10       !! name of a file with rows of numbers
   end type option_kind_enum
   type(option_kind_enum), parameter :: option_kind = option_kind_enum()

   !> What the numbers of a list must fulfil together.
   type :: list_rule_enum
      integer :: none = 0
      integer :: two_points = 1     !! x1 y1 x2 y2 are two different points
      integer :: rising = 2         !! the first number of the rows does not decrease
      integer :: frequency = 3      !! the third number of each row is not negative
      integer :: any_order = 4      !! rows of a file: the first number may decrease
      integer :: or_constant = 5    !! as rising, or one row without its first number, which is 0
   end type list_rule_enum
   type(list_rule_enum), parameter :: list_rule = list_rule_enum()

   !> One option. Texts that were not given are empty.
   type :: option_type
      character(len=:), allocatable :: name          !! in the options file
      character(len=:), allocatable :: meaning       !! for documents
      character(len=:), allocatable :: unit          !! in terms of the units of the model; empty: a pure number
      character(len=:), allocatable :: applies       !! where it counts; empty: everywhere
      character(len=:), allocatable :: see           !! page of the documentation
      character(len=:), allocatable :: quantity      !! what the run uses: label of the log and of messages
      character(len=:), allocatable :: choices       !! words, '|' between them
      character(len=:), allocatable :: old_choice    !! former spelling of the first word, still accepted
      character(len=:), allocatable :: columns       !! names of the numbers of a row, ', ' between them
      character(len=:), allocatable :: default_word  !! of a text
      character(len=:), allocatable :: preset_word   !! of a text, with the preset dda_windows, where it differs
      character(len=:), allocatable :: default_text  !! a default that depends on something, in words
      character(len=:), allocatable :: remark        !! added to the message about a value out of bounds
      real(wp) :: default = unset_real               !! of a number
      real(wp) :: preset_default = unset_real        !! with the preset dda_windows, where it differs
      real(wp) :: least = -huge(1.0_wp), most = huge(1.0_wp)
      logical :: above = .false., below = .false.    !! the bound itself is excluded
      logical :: in_analysis = .false.               !! the analysis file has this number, too
      logical :: required = .false.
      logical :: adds_up = .false.                   !! given again in a group: one row more
      logical :: not_blank = .false.                 !! a text that must have a character
      logical :: or_number = .false.                 !! a text for which a whole number >= 1 may stand
      character(len=:), allocatable :: form, column  !! of a record; empty: not given
      integer :: rule = 0                            !! one of list_rule%...
   end type option_type

   type, abstract :: option_visitor_type
   contains
      procedure :: begin
      procedure :: resize
      procedure :: start_element
      generic :: add => add_real, add_integer, add_logical, add_text, add_list, add_integers, add_rows
      procedure :: add_real, add_integer, add_logical, add_text, add_reals, add_list, add_integers, add_rows
      procedure :: add_choice
      procedure :: add_file, add_record
      procedure :: used
      procedure :: locate
   end type option_visitor_type

contains

   !> A row of the table.
   pure function option(name, meaning, unit, applies, see, quantity, choices, old_choice, columns, default, &
                        preset_default, default_word, preset_word, default_text, remark, least, above, most, below, &
                        in_analysis, required, adds_up, not_blank, or_number, rule) result(row)
      character(len=*), intent(in) :: name, meaning
      character(len=*), intent(in), optional :: unit, applies, see, quantity, choices, old_choice, columns
      real(wp), intent(in), optional :: default, preset_default
      character(len=*), intent(in), optional :: default_word, preset_word, default_text, remark
      real(wp), intent(in), optional :: least, above, most, below    !! bounds; above and below exclude the bound
      logical, intent(in), optional :: in_analysis, required, adds_up, not_blank, or_number
      integer, intent(in), optional :: rule
      type(option_type) :: row
      row%name = name
      row%meaning = meaning
      row%unit = text(unit)
      row%applies = text(applies)
      row%see = text(see)
      row%quantity = text(quantity)
      if (len(row%quantity) == 0) row%quantity = name
      row%choices = text(choices)
      row%old_choice = text(old_choice)
      row%columns = text(columns)
      row%default_word = text(default_word)
      row%preset_word = text(preset_word)
      row%default_text = text(default_text)
      row%remark = text(remark)
      row%form = ''
      row%column = ''
      if (present(default)) row%default = default
      if (present(preset_default)) row%preset_default = preset_default
      if (present(least)) row%least = least
      if (present(most)) row%most = most
      row%above = present(above)
      row%below = present(below)
      if (present(above)) row%least = above
      if (present(below)) row%most = below
      if (present(in_analysis)) row%in_analysis = in_analysis
      if (present(required)) row%required = required
      if (present(adds_up)) row%adds_up = adds_up
      if (present(not_blank)) row%not_blank = not_blank
      if (present(or_number)) row%or_number = or_number
      if (present(rule)) row%rule = rule

   contains

      !> The text, empty when it was not given.
      pure function text(given)
         character(len=*), intent(in), optional :: given
         character(len=:), allocatable :: text
         text = ''
         if (present(given)) text = given
      end function text

   end function option

   !> Number of words of a choice.
   pure integer function n_choices(row)
      type(option_type), intent(in) :: row
      integer :: k
      n_choices = count([(row%choices(k:k) == '|', k=1, len(row%choices))]) + 1
      if (len(row%choices) == 0) n_choices = 0
   end function n_choices

   !> Word i of a choice.
   pure function choice(row, i) result(word)
      type(option_type), intent(in) :: row
      integer, intent(in) :: i
      character(len=:), allocatable :: word
      integer :: k, bar
      word = row%choices
      do k = 2, i
         word = word(index(word, '|') + 1:)
      end do
      bar = index(word, '|')
      if (bar > 0) word = word(1:bar - 1)
   end function choice

   !> Place of a word among the choices, 0 when it is none. The former spelling of the first word counts as this.
   pure integer function index_of_choice(row, word)
      type(option_type), intent(in) :: row
      character(len=*), intent(in) :: word
      integer :: i
      index_of_choice = 0
      do i = n_choices(row), 1, -1
         if (choice(row, i) == word) index_of_choice = i
      end do
      if (index_of_choice == 0 .and. len(row%old_choice) > 0 .and. row%old_choice == word) index_of_choice = 1
   end function index_of_choice

   !> Begin a group.
   subroutine begin(self, name, meaning, is_list)
      class(option_visitor_type), intent(inout) :: self
      character(len=*), intent(in) :: name, meaning
      logical, intent(in), optional :: is_list            !! true: each such group is one element of a list
      associate (unused_self => self, unused_1 => name, unused_2 => meaning, unused_3 => present(is_list))
      end associate
   end subroutine begin

   !> Change the number of elements of the list of this group, where the visitor determines it.
   subroutine resize(self, n)
      class(option_visitor_type), intent(inout) :: self
      integer, intent(inout) :: n
      associate (unused_self => self, unused => n)
      end associate
   end subroutine resize

   !> Begin the rows of element i.
   subroutine start_element(self, i, origin)
      class(option_visitor_type), intent(inout) :: self
      integer, intent(in) :: i
      type(origin_type), intent(inout) :: origin          !! where it was read
      associate (unused_self => self, unused_1 => i, unused_2 => origin)
      end associate
   end subroutine start_element

   !> Visit a real.
   subroutine add_real(self, row, given, used, origin)
      class(option_visitor_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      real(wp), intent(inout) :: given
      real(wp), intent(inout), optional :: used           !! in the run, in the same unit
      type(origin_type), intent(inout), optional :: origin !! where it was read
      associate (unused_self => self, unused_1 => row, unused_2 => given, unused_3 => present(used), &
                 unused_4 => present(origin))
      end associate
   end subroutine add_real

   !> Visit a whole number.
   subroutine add_integer(self, row, given, used)
      class(option_visitor_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      integer, intent(inout) :: given
      integer, intent(inout), optional :: used
      associate (unused_self => self, unused_1 => row, unused_2 => given, unused_3 => present(used))
      end associate
   end subroutine add_integer

   !> .true. or .false.
   subroutine add_logical(self, row, given, used, is_given)
      class(option_visitor_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      logical, intent(inout) :: given
      logical, intent(inout), optional :: used
      logical, intent(inout), optional :: is_given        !! becomes true when a value stands there
      associate (unused_self => self, unused_1 => row, unused_2 => given, unused_3 => present(used), &
                 unused_4 => present(is_given))
      end associate
   end subroutine add_logical

   !> Visit a text, or one of several words.
   subroutine add_text(self, row, given, used)
      class(option_visitor_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      character(len=:), allocatable, intent(inout) :: given
      character(len=:), allocatable, intent(inout), optional :: used
      associate (unused_self => self, unused_1 => row, unused_2 => allocated(given), unused_3 => present(used))
      end associate
   end subroutine add_text

   !> Visit one of several words that the run keeps as a logical: true for word `true_for`.
   subroutine add_choice(self, row, given, used, true_for)
      class(option_visitor_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      character(len=:), allocatable, intent(inout) :: given
      logical, intent(inout) :: used
      integer, intent(in) :: true_for
      associate (unused_self => self, unused_1 => row, unused_2 => allocated(given), unused_3 => used, &
                 unused_4 => true_for)
      end associate
   end subroutine add_choice

   !> Visit a fixed number of reals.
   subroutine add_reals(self, row, given, otherwise)
      class(option_visitor_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      real(wp), intent(inout) :: given(:)
      real(wp), intent(in), optional :: otherwise(:)      !! taken when none are given
      associate (unused_self => self, unused_1 => row, unused_2 => given, unused_3 => present(otherwise))
      end associate
   end subroutine add_reals

   !> Visit any number of reals.
   subroutine add_list(self, row, given)
      class(option_visitor_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      real(wp), allocatable, intent(inout) :: given(:)
      associate (unused_self => self, unused_1 => row, unused_2 => allocated(given))
      end associate
   end subroutine add_list

   !> Visit any number of whole numbers.
   subroutine add_integers(self, row, given)
      class(option_visitor_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      integer, allocatable, intent(inout) :: given(:)
      associate (unused_self => self, unused_1 => row, unused_2 => allocated(given))
      end associate
   end subroutine add_integers

   !> Visit rows of reals, (columns, rows).
   subroutine add_rows(self, row, given, used)
      class(option_visitor_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      real(wp), allocatable, intent(inout) :: given(:, :)
      real(wp), allocatable, intent(inout), optional :: used(:, :)
      associate (unused_self => self, unused_1 => row, unused_2 => allocated(given), unused_3 => present(used))
      end associate
   end subroutine add_rows

   !> Visit rows of reals in a file that the option names.
   subroutine add_file(self, row, given, used, name)
      class(option_visitor_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      real(wp), allocatable, intent(inout) :: given(:, :), used(:, :)
      character(len=:), allocatable, intent(inout), optional :: name  !! of the file
      associate (unused_self => self, unused_1 => row, unused_2 => allocated(given), unused_3 => allocated(used), &
                 unused_4 => present(name))
      end associate
   end subroutine add_file

   !> Visit the rows of a record in a file, whose unit the file may name.
   subroutine add_record(self, row, given, used, name, has_scale, unit)
      class(option_visitor_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      real(wp), allocatable, intent(inout) :: given(:, :), used(:, :)
      character(len=:), allocatable, intent(inout) :: name            !! of the file
      logical, intent(in) :: has_scale                                !! a factor of the values is given
      real(wp), intent(inout) :: unit                                 !! of the values [m/s^2], 0: not named
      call self%add_file(row, given, used, name)
      associate (unused_1 => has_scale, unused_2 => unit)
      end associate
   end subroutine add_record

   !> Visit a number of the run that is computed from options and model.
   subroutine used(self, quantity, value, name)
      class(option_visitor_type), intent(inout) :: self
      character(len=*), intent(in) :: quantity            !! in the log
      real(wp), intent(inout) :: value
      character(len=*), intent(in), optional :: name      !! in the checkpoint; absent: that of the row before
      associate (unused_self => self, unused_1 => quantity, unused_2 => value, unused_3 => present(name))
      end associate
   end subroutine used

   !> Visit the place of the row before: where it was read, unchanged when it was not given.
   subroutine locate(self, origin)
      class(option_visitor_type), intent(inout) :: self
      type(origin_type), intent(inout) :: origin
      associate (unused_self => self, unused => origin)
      end associate
   end subroutine locate

end module rockdda_model_option
