! SPDX-License-Identifier: MIT
!> The rows of the table of options with their values, bound to the variables that hold them.
!>
!> rockdda_model_option_table describes each option in one statement: what it is, the variable that keeps what the user
!> gives and, where there is one, the number that the run uses:
!>
!>     call table%begin('time', 'Time steps.')
!>     call table%add(option('steps', 'number of time steps', least=0.0_wp), options%steps, parameters%n_steps)
!>
!> The description is gone through twice: first each statement takes its values into a row, and after `give_back` it
!> gives those of the row to the variables. In between, what is done with options is a loop over the rows.
!>
!> Options that were not given take the constant defaults of the table; options that the run keeps as they are go to
!> its parameters.
module rockdda_model_option_rows
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : origin_type, diagnostics_type, severity
   use rockdda_base_strings, only : is_given, to_string
   use rockdda_model_options, only : is_set
   use rockdda_model_option, only : option_type, option, option_kind, name_length, choice, constant_default, &
      index_of_choice
   implicit none
   private
   public :: option_rows_type, option_group_type, has_value, fill_defaults, transfer_options

   type :: option_group_type
      character(len=name_length) :: name = ''
      character(len=:), allocatable :: meaning
      logical :: is_list = .false.               !! each such group is one element of a list
      integer :: n = 1                           !! elements of the list
   end type option_group_type

   type :: option_rows_type
      integer :: n = 0, n_groups = 0
      type(option_type), allocatable :: rows(:)
      type(option_group_type), allocatable :: groups(:)
      logical, private :: gives_back = .false.
      integer, private :: group = 0, element = 0, row = 0   !! the present ones
      type(origin_type), private :: origin                  !! of the present element
      logical, private :: one_each = .false.                !! lists have one element
      type(option_group_type), allocatable, private :: wanted(:)   !! lists that begin with a number of elements
   contains
      procedure :: want
      procedure :: want_one_each
      procedure :: give_back
      procedure :: take_given
      procedure :: begin
      procedure :: begin_list
      procedure :: n_wanted
      procedure :: start_element
      generic :: add => add_real, add_integer, add_logical, add_text, add_list, add_integers, add_rows
      procedure :: add_reals
      procedure :: add_choice
      procedure :: add_file
      procedure :: add_record
      procedure :: add_computed
      procedure :: locate
      procedure :: group_names
      procedure :: names
      procedure :: group_of_names
      procedure :: find
      procedure :: is_beside
      procedure, private :: add_real, add_integer, add_logical, add_text, add_list, add_integers, add_rows
      procedure, private :: next
   end type option_rows_type

   !> Copy a value between a variable and a row.
   interface exchange
      module procedure exchange_real, exchange_integer, exchange_logical, exchange_text, exchange_reals
      module procedure exchange_integers, exchange_rows
   end interface exchange

contains

   !> Let a list begin with `n` more elements, before its rows are taken.
   subroutine want(self, name, n)
      class(option_rows_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: n
      type(option_group_type) :: new
      integer :: i
      if (.not. allocated(self%wanted)) allocate (self%wanted(0))
      do i = 1, size(self%wanted)
         if (self%wanted(i)%name /= name) cycle
         self%wanted(i)%n = self%wanted(i)%n + n
         return
      end do
      new%name = name
      new%n = n
      call append(self%wanted, new)
   end subroutine want

   !> One group more.
   subroutine append(groups, new)
      type(option_group_type), allocatable, intent(inout) :: groups(:)
      type(option_group_type), intent(in) :: new
      type(option_group_type), allocatable :: more(:)
      allocate (more(size(groups) + 1))
      more(1:size(groups)) = groups
      more(size(more)) = new
      call move_alloc(more, groups)
   end subroutine append

   !> Take one element of each list, for what describes the table itself, and no number that is computed.
   subroutine want_one_each(self)
      class(option_rows_type), intent(inout) :: self
      self%one_each = .true.
   end subroutine want_one_each

   !> From now on the description gives values of the rows to the variables.
   subroutine give_back(self)
      class(option_rows_type), intent(inout) :: self
      self%gives_back = .true.
      self%group = 0
      self%row = 0
   end subroutine give_back

   !> Take the values that are given in the rows of another table of the same description.
   pure subroutine take_given(self, other)
      class(option_rows_type), intent(inout) :: self
      class(option_rows_type), intent(in) :: other
      integer :: i
      do i = 1, self%n
         if (.not. has_value(other%rows(i))) cycle
         self%rows(i)%given = other%rows(i)%given
         if (allocated(self%rows(i)%given%text)) self%rows(i)%given%text = trim(adjustl(self%rows(i)%given%text))
      end do
   end subroutine take_given

   !> Is a value given, and no blank text?
   pure logical function has_value(row)
      type(option_type), intent(in) :: row
      associate (given => row%given)
         select case (row%kind)
         case (option_kind%number); has_value = is_set(given%number)
         case (option_kind%whole); has_value = is_set(given%whole)
         case (option_kind%logical); has_value = given%is_given
         case (option_kind%text, option_kind%choice); has_value = is_given(given%text)
         case (option_kind%numbers); has_value = is_set(given%numbers(1))
         case (option_kind%list); has_value = allocated(given%numbers)
         case (option_kind%wholes); has_value = allocated(given%wholes)
         case default; has_value = allocated(given%rows)
         end select
      end associate
   end function has_value

   !> Begin a group.
   subroutine begin(self, name, meaning)
      class(option_rows_type), intent(inout) :: self
      character(len=*), intent(in) :: name, meaning
      type(option_group_type) :: new
      self%element = 0
      self%origin = origin_type()
      self%group = self%group + 1
      if (self%gives_back) return
      new%name = name
      new%meaning = meaning
      if (.not. allocated(self%groups)) allocate (self%groups(0))
      call append(self%groups, new)
      self%n_groups = size(self%groups)
   end subroutine begin

   !> Begin a list of groups.
   subroutine begin_list(self, name, meaning)
      class(option_rows_type), intent(inout) :: self
      character(len=*), intent(in) :: name, meaning
      call self%begin(name, meaning)
      self%groups(self%group)%is_list = .true.
      if (.not. self%gives_back) self%groups(self%group)%n = 0
   end subroutine begin_list

   !> Number of elements with which the present list begins, where it is not allocated.
   pure integer function n_wanted(self) result(n)
      class(option_rows_type), intent(in) :: self
      integer :: i
      n = merge(1, 0, self%one_each)
      if (.not. allocated(self%wanted)) return
      do i = 1, size(self%wanted)
         if (self%wanted(i)%name == self%groups(self%group)%name) n = self%wanted(i)%n
      end do
   end function n_wanted

   !> Begin the rows of element i.
   subroutine start_element(self, i, origin)
      class(option_rows_type), intent(inout) :: self
      integer, intent(in) :: i
      type(origin_type), intent(inout) :: origin          !! where it was read
      self%element = i
      self%groups(self%group)%n = i
      if (self%gives_back) origin = self%rows(self%row + 1)%origin
      self%origin = origin
   end subroutine start_element

   !> Go on to the next row, which is this one.
   subroutine next(self, row, kind, in_run)
      class(option_rows_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      integer, intent(in) :: kind
      logical, intent(in), optional :: in_run
      type(option_type), allocatable :: more(:)
      self%row = self%row + 1
      if (self%gives_back) return
      if (.not. allocated(self%rows)) allocate (self%rows(100))
      if (self%n == size(self%rows)) then
         allocate (more(2*self%n))
         more(1:self%n) = self%rows
         call move_alloc(more, self%rows)
      end if
      self%n = self%row
      self%rows(self%n) = row
      associate (new => self%rows(self%n))
         new%kind = kind
         new%group = self%group
         new%element = self%element
         new%origin = self%origin
         if (present(in_run)) new%in_run = in_run
      end associate
   end subroutine next

   !> A real.
   subroutine add_real(self, row, given, used)
      class(option_rows_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      real(wp), intent(inout) :: given
      real(wp), intent(inout), optional :: used           !! in the run, in the same unit
      call self%next(row, option_kind%number, present(used))
      call exchange(self%gives_back, given, self%rows(self%row)%given%number)
      if (present(used)) call exchange(self%gives_back, used, self%rows(self%row)%used%number)
      if (self%one_each) call take_default(self%rows(self%row), given, used)
   end subroutine add_real

   !> The default of a number that a new element of a list, or the run, has from the start.
   pure subroutine take_default(row, given, used)
      type(option_type), intent(inout) :: row
      real(wp), intent(in) :: given
      real(wp), intent(in), optional :: used
      if (row%required .or. row%in_analysis .or. len(row%default_text) > 0 .or. is_set(row%default)) return
      if (present(used)) then
         row%default = used
      else
         row%default = given
      end if
   end subroutine take_default

   !> A whole number.
   subroutine add_integer(self, row, given, used)
      class(option_rows_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      integer, intent(inout) :: given
      integer, intent(inout), optional :: used
      call self%next(row, option_kind%whole, present(used))
      call exchange(self%gives_back, given, self%rows(self%row)%given%whole)
      if (present(used)) call exchange(self%gives_back, used, self%rows(self%row)%used%whole)
      if (.not. self%one_each) return
      if (present(used)) call take_default(self%rows(self%row), real(given, wp), real(used, wp))
      if (.not. present(used) .and. is_set(given)) call take_default(self%rows(self%row), real(given, wp))
   end subroutine add_integer

   !> .true. or .false.; the value of an empty record is the default.
   subroutine add_logical(self, row, given, used, is_given)
      class(option_rows_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      logical, intent(inout) :: given
      logical, intent(inout), optional :: used
      logical, intent(inout), optional :: is_given        !! becomes true when a value stands there
      call self%next(row, option_kind%logical, present(used))
      call exchange(self%gives_back, given, self%rows(self%row)%given%flag)
      if (present(used)) call exchange(self%gives_back, used, self%rows(self%row)%used%flag)
      if (present(is_given)) call exchange(self%gives_back, is_given, self%rows(self%row)%given%is_given)
   end subroutine add_logical

   !> A text, or one of several words.
   subroutine add_text(self, row, given, used)
      class(option_rows_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      character(len=:), allocatable, intent(inout) :: given
      character(len=:), allocatable, intent(inout), optional :: used
      call self%next(row, merge(option_kind%choice, option_kind%text, len(row%choices) > 0), present(used))
      call exchange(self%gives_back, given, self%rows(self%row)%given%text)
      if (present(used)) call exchange(self%gives_back, used, self%rows(self%row)%used%text)
   end subroutine add_text

   !> One of several words that the run keeps as a logical: true for word `true_for`.
   subroutine add_choice(self, row, given, used, true_for)
      class(option_rows_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      character(len=:), allocatable, intent(inout) :: given
      logical, intent(inout) :: used
      integer, intent(in) :: true_for
      call self%next(row, option_kind%choice, .true.)
      self%rows(self%row)%true_for = true_for
      call exchange(self%gives_back, given, self%rows(self%row)%given%text)
      call exchange(self%gives_back, used, self%rows(self%row)%used%flag)
   end subroutine add_choice

   !> A fixed number of reals.
   subroutine add_reals(self, row, given)
      class(option_rows_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      real(wp), intent(inout) :: given(:)
      call self%next(row, option_kind%numbers)
      if (self%gives_back) then
         given = self%rows(self%row)%given%numbers
      else
         self%rows(self%row)%given%numbers = given
      end if
   end subroutine add_reals

   !> Any number of reals.
   subroutine add_list(self, row, given)
      class(option_rows_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      real(wp), allocatable, intent(inout) :: given(:)
      call self%next(row, option_kind%list)
      call exchange(self%gives_back, given, self%rows(self%row)%given%numbers)
   end subroutine add_list

   !> Any number of whole numbers.
   subroutine add_integers(self, row, given)
      class(option_rows_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      integer, allocatable, intent(inout) :: given(:)
      call self%next(row, option_kind%wholes)
      call exchange(self%gives_back, given, self%rows(self%row)%given%wholes)
   end subroutine add_integers

   !> Rows of reals, (columns, rows).
   subroutine add_rows(self, row, given, used)
      class(option_rows_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      real(wp), allocatable, intent(inout) :: given(:, :)
      real(wp), allocatable, intent(inout), optional :: used(:, :)
      call self%next(row, option_kind%rows, present(used))
      call exchange(self%gives_back, given, self%rows(self%row)%given%rows)
      if (present(used)) call exchange(self%gives_back, used, self%rows(self%row)%used%rows)
   end subroutine add_rows

   !> Rows of reals in a file that the option names.
   subroutine add_file(self, row, given, name, used)
      class(option_rows_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      real(wp), allocatable, intent(inout) :: given(:, :)
      character(len=:), allocatable, intent(inout) :: name            !! of the file
      real(wp), allocatable, intent(inout), optional :: used(:, :)
      call self%next(row, option_kind%file, present(used))
      call exchange(self%gives_back, given, self%rows(self%row)%given%rows)
      call exchange(self%gives_back, name, self%rows(self%row)%given%text)
      if (present(used)) call exchange(self%gives_back, used, self%rows(self%row)%used%rows)
   end subroutine add_file

   !> The rows of a record in a file. Its options `format`, `column` and `scale` say how it is read.
   subroutine add_record(self, row, given, name, unit)
      class(option_rows_type), intent(inout) :: self
      type(option_type), intent(in) :: row
      real(wp), allocatable, intent(inout) :: given(:, :)
      character(len=:), allocatable, intent(inout) :: name            !! of the file
      real(wp), intent(inout) :: unit                                 !! of the values [m/s^2], 0: not named
      call self%next(row, option_kind%record)
      call exchange(self%gives_back, given, self%rows(self%row)%given%rows)
      call exchange(self%gives_back, name, self%rows(self%row)%given%text)
      call exchange(self%gives_back, unit, self%rows(self%row)%given%number)
   end subroutine add_record

   !> A number of the run that is computed from options and model, for log and checkpoint.
   subroutine add_computed(self, name, quantity, unit, value)
      class(option_rows_type), intent(inout) :: self
      character(len=*), intent(in) :: name                !! in the checkpoint
      character(len=*), intent(in) :: quantity            !! in the log
      character(len=*), intent(in) :: unit
      real(wp), intent(inout) :: value
      if (self%one_each) return
      call self%next(option(name, quantity, unit=unit, quantity=quantity), option_kind%computed, .true.)
      call exchange(self%gives_back, value, self%rows(self%row)%used%number)
   end subroutine add_computed

   !> The place of the row before: where it was read, unchanged when it was not given.
   subroutine locate(self, origin)
      class(option_rows_type), intent(inout) :: self
      type(origin_type), intent(inout) :: origin
      if (self%gives_back) then
         origin = self%rows(self%row)%origin
      else
         self%rows(self%row)%origin = origin
      end if
   end subroutine locate

   !> Names of all groups.
   pure function group_names(self) result(names)
      class(option_rows_type), intent(in) :: self
      character(len=name_length) :: names(self%n_groups)
      names = self%groups%name
   end function group_names

   !> Names of all rows.
   pure function names(self)
      class(option_rows_type), intent(in) :: self
      character(len=name_length) :: names(self%n)
      integer :: i
      do i = 1, self%n
         names(i) = self%rows(i)%name
      end do
   end function names

   !> Names of the groups of all rows.
   pure function group_of_names(self) result(names)
      class(option_rows_type), intent(in) :: self
      character(len=name_length) :: names(self%n)
      integer :: i
      do i = 1, self%n
         names(i) = self%groups(self%rows(i)%group)%name
      end do
   end function group_of_names

   !> Number of the row of a name in the group, or the element of a list, of row i; 0: there is none.
   pure integer function find(self, i, name) result(k)
      class(option_rows_type), intent(in) :: self
      integer, intent(in) :: i
      character(len=*), intent(in) :: name
      k = i
      do while (self%is_beside(i, k - 1))
         k = k - 1
      end do
      do while (self%is_beside(i, k))
         if (self%rows(k)%name == name) return
         k = k + 1
      end do
      k = 0
   end function find

   !> Is there a row k, in the group, or the element of a list, of row i?
   pure logical function is_beside(self, i, k)
      class(option_rows_type), intent(in) :: self
      integer, intent(in) :: i, k
      is_beside = k > 0 .and. k <= self%n
      if (is_beside) is_beside = self%rows(k)%group == self%rows(i)%group .and. &
                                 self%rows(k)%element == self%rows(i)%element
   end function is_beside

   !> Copy to the variable (back) or to the row.
   pure subroutine exchange_real(back, variable, row)
      logical, intent(in) :: back
      real(wp), intent(inout) :: variable, row
      if (back) variable = row
      if (.not. back) row = variable
   end subroutine exchange_real

   pure subroutine exchange_integer(back, variable, row)
      logical, intent(in) :: back
      integer, intent(inout) :: variable, row
      if (back) variable = row
      if (.not. back) row = variable
   end subroutine exchange_integer

   pure subroutine exchange_logical(back, variable, row)
      logical, intent(in) :: back
      logical, intent(inout) :: variable, row
      if (back) variable = row
      if (.not. back) row = variable
   end subroutine exchange_logical

   !> What is not allocated stays as it is.
   pure subroutine exchange_text(back, variable, row)
      logical, intent(in) :: back
      character(len=:), allocatable, intent(inout) :: variable, row
      if (back .and. allocated(row)) variable = row
      if (.not. back .and. allocated(variable)) row = variable
   end subroutine exchange_text

   pure subroutine exchange_reals(back, variable, row)
      logical, intent(in) :: back
      real(wp), allocatable, intent(inout) :: variable(:), row(:)
      if (back .and. allocated(row)) variable = row
      if (.not. back .and. allocated(variable)) row = variable
   end subroutine exchange_reals

   pure subroutine exchange_integers(back, variable, row)
      logical, intent(in) :: back
      integer, allocatable, intent(inout) :: variable(:), row(:)
      if (back .and. allocated(row)) variable = row
      if (.not. back .and. allocated(variable)) row = variable
   end subroutine exchange_integers

   pure subroutine exchange_rows(back, variable, row)
      logical, intent(in) :: back
      real(wp), allocatable, intent(inout) :: variable(:, :), row(:, :)
      if (back .and. allocated(row)) variable = row
      if (.not. back .and. allocated(variable)) row = variable
   end subroutine exchange_rows

   !> Fill in options that were not given.
   pure subroutine fill_defaults(table, preset)
      type(option_rows_type), intent(inout) :: table
      logical, intent(in) :: preset                   !! the preset dda_windows holds
      integer :: i
      do i = 1, table%n
         call fill_default(table%rows(i), preset)
      end do
   end subroutine fill_defaults

   !> Fill in one option. A text that was not given, or is blank, becomes the default, which may be empty.
   pure subroutine fill_default(row, preset)
      type(option_type), intent(inout) :: row
      logical, intent(in) :: preset
      associate (given => row%given, default => constant_default(row, preset))
         select case (row%kind)
         case (option_kind%number)
            if (.not. is_set(given%number)) given%number = default
         case (option_kind%whole)
            if (.not. is_set(given%whole) .and. is_set(default)) given%whole = nint(default)
         case (option_kind%text, option_kind%choice)
            if (.not. allocated(given%text)) given%text = ''
            given%text = trim(given%text)
            if (len(given%text) > 0) return
            given%text = row%default_word
            if (preset .and. len(row%preset_word) > 0) given%text = row%preset_word
         end select
      end associate
   end subroutine fill_default

   !> Copy given options to the parameters of the run. A note names each value of the analysis file that is replaced.
   subroutine transfer_options(table, notes)
      type(option_rows_type), intent(inout) :: table
      type(diagnostics_type), intent(inout) :: notes
      integer :: i
      do i = 1, table%n
         if (table%rows(i)%in_run) call transfer_option(table%rows(i), notes)
      end do
   end subroutine transfer_options

   !> Copy one option.
   subroutine transfer_option(row, notes)
      type(option_type), intent(inout) :: row
      type(diagnostics_type), intent(inout) :: notes
      integer :: word
      associate (given => row%given, used => row%used)
         select case (row%kind)
         case (option_kind%number)
            if (.not. is_set(given%number)) return
            call note_replaced(row, used%number, given%number, notes)
            used%number = given%number
         case (option_kind%whole)
            if (.not. is_set(given%whole)) return
            call note_replaced(row, real(used%whole, wp), real(given%whole, wp), notes)
            used%whole = given%whole
         case (option_kind%logical)
            used%flag = given%flag
         case (option_kind%text, option_kind%choice)
            if (row%true_for == 0) then
               used%text = given%text
               return
            end if
            word = index_of_choice(row, given%text)
            used%flag = word == row%true_for
            ! one spelling from here on
            if (word > 0) given%text = choice(row, word)
         case (option_kind%rows, option_kind%file)
            if (allocated(given%rows)) used%rows = given%rows
         end select
      end associate
   end subroutine transfer_option

   !> Note that an option replaces another value of the analysis file.
   subroutine note_replaced(row, old, new, notes)
      type(option_type), intent(in) :: row
      real(wp), intent(in) :: old, new
      type(diagnostics_type), intent(inout) :: notes
      if (row%in_analysis .and. abs(old - new) > 0) call notes%add(severity%note, row%quantity//' '// &
         to_string(new)//' replaces '//to_string(old)//' of the analysis file')
   end subroutine note_replaced

end module rockdda_model_option_rows
