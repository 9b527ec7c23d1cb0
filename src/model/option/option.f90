! SPDX-License-Identifier: MIT
!> One row of the table of options: what an option is called, what it may be, where it applies, and its values.
module rockdda_model_option
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : origin_type
   use rockdda_model_options, only : unset_real, unset_integer, is_set
   implicit none
   private
   public :: option_type, option_value_type, option, option_kind, list_rule, choice, n_choices, index_of_choice, &
             columns_of, in_bounds, constant_default

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
      integer :: record = 11     !! name of a file with a record of ground motion
      integer :: computed = 12   !! no option, but a number of the run that follows from options and model
   end type option_kind_enum
   type(option_kind_enum), parameter :: option_kind = option_kind_enum()

   !> What the numbers of a list must fulfil together.
   type :: list_rule_enum
      integer :: none = 0
      integer :: two_points = 1     !! x1 y1 x2 y2 are two different points
      integer :: rising = 2         !! the first number of the rows does not decrease
      integer :: frequency = 3      !! the third number of each row is not negative
      integer :: any_order = 4      !! rows of a file: the first number may decrease
      integer :: pair = 6           !! two numbers, or none
      integer :: or_constant = 5    !! as rising, or one row without its first number, which is 0
      integer :: box = 7            !! xmin, ymin, xmax, ymax with an area
   end type list_rule_enum
   type(list_rule_enum), parameter :: list_rule = list_rule_enum()

   !> Length of the names of groups and options.
   integer, parameter, public :: name_length = 22
   !> Where options apply that count in contacts by length alone.
   character(len=*), parameter :: with_length = 'formulation length'

   !> A value: the component of the kind of the option counts.
   type :: option_value_type
      real(wp) :: number = unset_real              !! of a record: the unit of its values
      integer :: whole = unset_integer
      logical :: flag = .false.
      logical :: is_given = .false.                !! a flag was given
      character(len=:), allocatable :: text        !! of rows in a file: its name
      real(wp), allocatable :: numbers(:)          !! numbers, list
      integer, allocatable :: wholes(:)
      real(wp), allocatable :: rows(:, :)          !! (columns, rows)
   end type option_value_type

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
      character(len=:), allocatable :: default_from  !! option before it whose value it has when it is not given
      character(len=:), allocatable :: remark        !! added to the message about a value out of bounds
      real(wp) :: default = unset_real               !! of a number
      real(wp) :: preset_default = unset_real        !! with the preset dda_windows, where it differs
      real(wp) :: least = -huge(1.0_wp), most = huge(1.0_wp)
      logical :: above = .false., below = .false.    !! the bound itself is excluded
      logical :: by_length = .false.                 !! counts in contacts by length alone
      logical :: in_analysis = .false.               !! the analysis file has this number, too
      logical :: required = .false.
      logical :: adds_up = .false.                   !! given again in a group: one row more
      logical :: not_blank = .false.                 !! a text that must have a character
      !> a text for which a whole number >= 1 may stand, with a unit any number
      logical :: or_number = .false.
      logical :: is_file = .false.                   !! a text that names a file, which becomes a path
      integer :: n_in_unit = huge(1)                 !! how many numbers of a row are in the unit, not those behind
      integer :: rule = 0                            !! one of list_rule%...
      ! what follows from the place of the row in the table
      integer :: kind = 0                            !! one of option_kind%...
      integer :: group = 0                           !! number of its group
      integer :: element = 0                         !! of a list of such groups; 0: the group is no list
      integer :: true_for = 0                        !! word of a choice that is .true. in the run; 0: it has the word
      logical :: in_run = .false.                    !! the run has the value under a name of its own
      type(option_value_type) :: given               !! by the user
      type(option_value_type) :: used                !! by the run
      type(origin_type) :: origin                    !! where it was read; of a list the group
   end type option_type

contains

   !> A row of the table.
   pure function option(name, meaning, unit, applies, see, quantity, choices, old_choice, columns, default, &
                        preset_default, default_word, preset_word, default_text, default_from, remark, least, above, &
                        most, below, by_length, in_analysis, required, adds_up, not_blank, or_number, is_file, &
                        n_in_unit, rule) result(row)
      character(len=*), intent(in) :: name, meaning
      character(len=*), intent(in), optional :: unit, applies, see, quantity, choices, old_choice, columns
      real(wp), intent(in), optional :: default, preset_default
      character(len=*), intent(in), optional :: default_word, preset_word, default_text, default_from, remark
      real(wp), intent(in), optional :: least, above, most, below    !! bounds; above and below exclude the bound
      logical, intent(in), optional :: by_length, in_analysis, required, adds_up, not_blank, or_number, is_file
      integer, intent(in), optional :: n_in_unit, rule
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
      row%default_from = text(default_from)
      if (len(row%default_from) > 0) row%default_text = row%default_from
      row%remark = text(remark)
      if (present(default)) row%default = default
      if (present(preset_default)) row%preset_default = preset_default
      if (present(least)) row%least = least
      if (present(most)) row%most = most
      row%above = present(above)
      row%below = present(below)
      if (present(above)) row%least = above
      if (present(below)) row%most = below
      if (present(by_length)) row%by_length = by_length
      if (row%by_length) row%applies = with_length
      if (present(in_analysis)) row%in_analysis = in_analysis
      if (present(required)) row%required = required
      if (present(adds_up)) row%adds_up = adds_up
      if (present(not_blank)) row%not_blank = not_blank
      if (present(or_number)) row%or_number = or_number
      if (present(is_file)) row%is_file = is_file
      if (present(n_in_unit)) row%n_in_unit = n_in_unit
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

   !> Names of the numbers of a row.
   pure function columns_of(row) result(names)
      type(option_type), intent(in) :: row
      character(len=name_length), allocatable :: names(:)
      integer :: at, comma, i
      allocate (names(count([(row%columns(i:i) == ',', i=1, len(row%columns))]) + 1))
      at = 1
      do i = 1, size(names)
         comma = index(row%columns(at:)//',', ',')
         names(i) = adjustl(row%columns(at:at + comma - 2))
         at = at + comma
      end do
   end function columns_of

   !> Is a number within the bounds?
   pure logical function in_bounds(row, value)
      type(option_type), intent(in) :: row
      real(wp), intent(in) :: value
      in_bounds = merge(value > row%least, value >= row%least, row%above) .and. &
                  merge(value < row%most, value <= row%most, row%below)
   end function in_bounds

   !> The constant default of a number; unset when there is none.
   pure real(wp) function constant_default(row, preset)
      type(option_type), intent(in) :: row
      logical, intent(in) :: preset              !! the preset dda_windows holds
      constant_default = row%default
      if (preset .and. is_set(row%preset_default)) constant_default = row%preset_default
   end function constant_default

end module rockdda_model_option
