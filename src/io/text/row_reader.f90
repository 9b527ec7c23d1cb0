! SPDX-License-Identifier: MIT
!> Reads files in which every record is one line: a keyword and numbers, or numbers alone.
module rockdda_io_row_reader
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : to_string
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_base_numbers, only : is_whole
   use rockdda_io_tokens, only : token_list_type, token_kind
   implicit none
   private
   public :: row_reader_type, decimal_comma, take_number

   integer, parameter :: longest_row = 16
   !> Largest number of a table.
   real(wp), parameter :: largest_value = 1.0e60_wp

   type :: row_reader_type
      type(token_list_type), pointer :: tokens => null()
      type(diagnostics_type), pointer :: messages => null()
      integer :: n_rows = 0
      integer, allocatable :: first(:)      !! (n_rows + 1) first token of each line that has tokens
      integer :: at = 1                     !! next row
      integer :: row = 0                    !! number of the last row
      real(wp) :: value(longest_row) = 0    !! its numbers
      integer :: token(longest_row) = 0     !! token of each; 0: not a number
      logical :: row_ok = .false.           !! all numbers are valid
      integer :: unfit = 0                  !! the last row that was reported as another than the expected one
   contains
      procedure :: start
      procedure :: keyword
      procedure :: read_row
      procedure :: skip_to_keyword
      procedure :: place
      procedure :: whole
      procedure :: fail
   end type row_reader_type

contains

   !> Find the lines.
   subroutine start(self, tokens, messages)
      class(row_reader_type), intent(inout) :: self
      type(token_list_type), intent(in), target :: tokens
      type(diagnostics_type), intent(inout), target :: messages
      integer :: i
      self%tokens => tokens
      self%messages => messages
      allocate (self%first(tokens%n + 1))
      self%n_rows = 0
      do i = 1, tokens%n
         if (i > 1) then
            if (tokens%line(i) == tokens%line(i - 1)) cycle
         end if
         self%n_rows = self%n_rows + 1
         self%first(self%n_rows) = i
      end do
      self%first(self%n_rows + 1) = tokens%n + 1
      self%at = 1
   end subroutine start

   !> The word that begins the next row; empty when it begins with a number or there is none.
   pure function keyword(self) result(word)
      class(row_reader_type), intent(in) :: self
      character(len=:), allocatable :: word
      word = ''
      if (self%at > self%n_rows) return
      if (self%tokens%kind(self%first(self%at)) == token_kind%text) word = self%tokens%text(self%first(self%at))
   end function keyword

   !> Read a row: the keyword, if one is given, then exactly the numbers named. A row that begins with
   !> another word is not read; row_ok is false then.
   subroutine read_row(self, word, names, object, optional_names)
      class(row_reader_type), intent(inout) :: self
      character(len=*), intent(in) :: word           !! empty: numbers alone
      character(len=*), intent(in) :: names(:)       !! of the numbers
      character(len=*), intent(in) :: object         !! description of the row, for messages
      character(len=*), intent(in), optional :: optional_names(:)   !! of optional numbers at the end
      character(len=:), allocatable :: hint, name
      integer :: k, i, first, n, most
      self%row_ok = .false.
      self%value = 0
      self%token = 0
      if (.not. begins_with(self, word, size(names), object)) return
      self%row = self%at
      self%at = self%at + 1
      first = self%first(self%row) + merge(1, 0, len(word) > 0)
      n = self%first(self%row + 1) - first
      hint = decimal_comma(self%tokens, first, first + n - 1, in_a_row=.false.)
      most = size(names)
      ! a decimal comma adds a number, too
      if (present(optional_names) .and. len(hint) == 0) most = most + size(optional_names)
      self%row_ok = n >= size(names) .and. n <= most
      do k = 1, min(most, n)
         i = first + k - 1
         if (self%tokens%kind(i) == token_kind%number) then
            self%value(k) = self%tokens%value(i)
            self%token(k) = i
            cycle
         end if
         if (k <= size(names)) then
            name = trim(names(k))
         else
            name = trim(optional_names(k - size(names)))
         end if
         self%row_ok = .false.
         call self%messages%add(severity%error, name//' of '//object//": expected a number, found '"// &
                                self%tokens%text(i)//"'", self%tokens%origin(i))
      end do
      if (n >= size(names) .and. n <= most) return
      hint = decimal_comma(self%tokens, first, first + n - 1)
      if (n < size(names)) hint = semicolon_hint(self%tokens, first, first + n - 1)
      call self%messages%add(severity%error, object//': expected '//to_string(size(names))// &
                             ' numbers on this line, found '//to_string(n)//hint, self%tokens%origin(first + min(most, &
                             n - 1)))
   end subroutine read_row

   !> Does the next row begin with this word, or without a word with a number? If not, that is
   !> reported, once for each row.
   logical function begins_with(self, word, n, object)
      class(row_reader_type), intent(inout) :: self
      character(len=*), intent(in) :: word           !! empty: a number
      integer, intent(in) :: n                       !! numbers of the row
      character(len=*), intent(in) :: object
      character(len=:), allocatable :: expected
      begins_with = .false.
      if (self%at > self%n_rows) then
         call self%messages%add(severity%error, object//': the file ends here', self%tokens%end_origin())
         return
      end if
      associate (first => self%first(self%at))
         begins_with = self%keyword() == word
         ! a word in the place of the first number is reported with the name of the number
         if (len(word) == 0 .and. .not. begins_with) &
            begins_with = self%tokens%is_not_finite(first) .or. self%first(self%at + 1) - first == n
         if (begins_with .or. self%unfit == self%at) return
         self%unfit = self%at
         expected = 'a number'
         if (len(word) > 0) expected = "'"//word//"'"
         call self%messages%add(severity%error, object//': expected '//expected//", found '"// &
                                self%tokens%text(first)//"'", self%tokens%origin(first))
      end associate
   end function begins_with

   !> A hint at the first pair of numbers of a row that seems to be one with a decimal comma; empty when there is none.
   function decimal_comma(tokens, from, to, in_a_row) result(text)
      type(token_list_type), intent(in) :: tokens
      integer, intent(in) :: from, to                !! tokens
      logical, intent(in), optional :: in_a_row      !! default: also commas of which several follow one another
      character(len=:), allocatable :: text
      integer :: j
      logical :: any_comma
      any_comma = .true.
      if (present(in_a_row)) any_comma = in_a_row
      text = ''
      do j = from, to - 1
         if (.not. tokens%has_decimal_comma(j, any_comma)) cycle
         text = "; if '"//tokens%text(j)//','//tokens%text(j + 1)//"' has a decimal comma, write "// &
                tokens%text(j)//'.'//tokens%text(j + 1)
         return
      end do
   end function decimal_comma

   !> A hint where numbers of a row are separated by semicolons; empty when they are not.
   pure function semicolon_hint(tokens, from, to) result(text)
      type(token_list_type), intent(in) :: tokens
      integer, intent(in) :: from, to                !! tokens
      character(len=:), allocatable :: text
      integer :: j
      text = ''
      do j = from, to
         if (index(tokens%text(j), ';') > 0) &
            text = "; numbers are separated by commas or blanks, not by ';', and have a decimal point"
      end do
   end function semicolon_hint

   !> Skip rows of numbers.
   pure subroutine skip_to_keyword(self)
      class(row_reader_type), intent(inout) :: self
      do while (self%at <= self%n_rows)
         if (self%tokens%kind(self%first(self%at)) == token_kind%text) exit
         self%at = self%at + 1
      end do
   end subroutine skip_to_keyword

   !> Place of number k of the last row (of the row itself for k = 0).
   pure function place(self, k) result(origin)
      class(row_reader_type), intent(in) :: self
      integer, intent(in) :: k
      type(origin_type) :: origin
      if (k > 0) then
         if (self%token(k) > 0) origin = self%tokens%origin(self%token(k))
      else if (self%row > 0) then
         origin = self%tokens%origin(self%first(self%row))
      end if
   end function place

   !> Number k of the row as a whole number of at least `least`; `least` when it is none (reported).
   integer function whole(self, k, least, name)
      class(row_reader_type), intent(inout) :: self
      integer, intent(in) :: k, least
      character(len=*), intent(in) :: name
      whole = least
      if (self%token(k) == 0) return
      if (.not. is_whole(self%value(k))) then
         call self%fail(k, name//': must be a whole number')
      else if (self%value(k) < least) then
         call self%fail(k, name//': must be at least '//to_string(least))
      else
         whole = nint(self%value(k))
      end if
   end function whole

   !> Report number k of the row.
   subroutine fail(self, k, message)
      class(row_reader_type), intent(inout) :: self
      integer, intent(in) :: k
      character(len=*), intent(in) :: message
      if (self%token(k) == 0) return
      self%row_ok = .false.
      call self%messages%add(severity%error, message//", found '"//self%tokens%text(self%token(k))//"'", self%place(k))
   end subroutine fail

   !> Take a token as a number of sensible size.
   subroutine take_number(tokens, i, what, value, ok, messages)
      type(token_list_type), intent(in) :: tokens
      integer, intent(in) :: i
      character(len=*), intent(in) :: what
      real(wp), intent(out) :: value
      logical, intent(out) :: ok
      type(diagnostics_type), intent(inout) :: messages
      value = 0
      ok = tokens%kind(i) == token_kind%number
      if (.not. ok) then
         call messages%add(severity%error, what//": expected a number, found '"//tokens%text(i)//"'"// &
                           run_together(tokens%text(i)), tokens%origin(i))
         return
      end if
      ok = abs(tokens%value(i)) <= largest_value
      if (ok) then
         value = tokens%value(i)
      else
         call messages%add(severity%error, what//': must not be larger than '//to_string(largest_value)// &
                           ", found '"//tokens%text(i)//"'", tokens%origin(i))
      end if
   end subroutine take_number

   !> A hint where numbers of a fixed width have no blank between them: 1.2E-01-3.4E-01; else empty.
   pure function run_together(text) result(hint)
      character(len=*), intent(in) :: text
      character(len=:), allocatable :: hint
      integer :: i
      hint = ''
      if (verify(text, '0123456789.+-eEdD') > 0 .and. text(max(1, len(text) - 2):) /= '...') return
      do i = 2, len(text)
         if (scan(text(i:i), '+-') == 0 .or. scan(text(i - 1:i - 1), '0123456789.') == 0) cycle
         hint = ': are there numbers without blanks between them?'
         return
      end do
   end function run_together

end module rockdda_io_row_reader
