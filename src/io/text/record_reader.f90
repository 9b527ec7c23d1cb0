! SPDX-License-Identifier: MIT
!> Reads records of numbers from a list of tokens, with the names of the expected quantities.
!>
!> A record is one count, the five numbers of a line, the thirteen of a material … and may spread over lines.
!> A token that is not a number is an error inside a record; after a complete record it and the rest of its line
!> are comment. Text at the start of a record on a line of its own is comment, too, with a warning; in `strict` mode
!> (used when the numbers of the file do not agree with its counts otherwise) it counts as a mistyped number.
module rockdda_io_record_reader
   use rockdda_base_kinds, only : wp, i8
   use rockdda_base_strings, only : to_string
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_io_tokens, only : token_list_type, token_kind
   use rockdda_base_numbers, only : is_whole
   implicit none
   private
   public :: record_reader_type, smallest_length, largest_value
   public :: append_in_order, comes_before, note_comment, report_decimal_comma, report_large_count

   !> Smallest length accepted: products of areas must not underflow.
   real(wp), parameter :: smallest_length = 1.0e-30_wp
   !> Largest material value and load accepted.
   real(wp), parameter :: largest_value = 1.0e60_wp
   !> Reading stops after this number of messages.
   integer, parameter :: most_errors = 1000
   integer, parameter :: longest_record = 16, longest_name = 80

   !> The last record.
   type :: record_type
      integer :: n = 0                          !! numbers
      character(len=longest_name) :: names(longest_record) = ''   !! of the numbers
      character(len=:), allocatable :: object   !! object that the numbers belong to; empty: none
      integer :: number = 0                     !! of the object; 0: it has none
      real(wp) :: value(longest_record) = 0     !! 0 without a valid number
      integer :: token(longest_record) = 0      !! token of each; 0: not read or not a number
      integer :: first_token = 0                !! 0: no token read
   end type record_type

   type :: record_reader_type
      type(token_list_type), pointer :: tokens => null()
      type(diagnostics_type) :: messages  !! of what was read
      integer :: at = 1               !! next token
      integer :: n_bad = 0            !! tokens that are not numbers in place of numbers
      integer :: n_missing = 0        !! numbers missing at the end of the file
      integer :: broken_at = 0        !! first token of the first record that does not fit the lines of the file
      character(len=:), allocatable :: broken_name  !! "block material 2", empty when the record has no object
      integer :: end_line = 0         !! line on which the last complete record ended, 0: none yet
      logical :: strict = .false.
      logical :: check = .true.       !! check values, not only syntax
      character(len=:), allocatable :: missing_name !! the first number that is missing
      type(record_type) :: record
   contains
      procedure :: read_record
      procedure :: read_count
      procedure :: skip_comment
      procedure :: numbers_left
      procedure :: is_exact
      procedure :: require
      procedure :: require_size
      procedure :: to_whole
      procedure :: record_origin
      procedure :: too_many_errors
      procedure :: goes_on
      procedure :: report_break
   end type record_reader_type

contains

   !> Skip comment at the start of a record.
   pure subroutine skip_comment(self)
      class(record_reader_type), intent(inout) :: self
      integer :: line
      do while (self%at <= self%tokens%n)
         if (self%tokens%kind(self%at) /= token_kind%text) return
         line = self%tokens%line(self%at)
         if (line /= self%end_line) then
            if (self%strict .or. self%end_line == 0) return
         else if (self%strict .and. self%tokens%is_not_finite(self%at)) then
            return
         end if
         do while (self%at <= self%tokens%n)
            if (self%tokens%line(self%at) /= line) exit
            self%at = self%at + 1
         end do
      end do
   end subroutine skip_comment

   !> Read the numbers of one record. Messages name them "<name> of <object> <number>".
   subroutine read_record(self, names, object, number)
      class(record_reader_type), intent(inout) :: self
      character(len=*), intent(in) :: names(:)     !! of the numbers, at most 16
      character(len=*), intent(in) :: object       !! object that the numbers belong to; empty: none
      integer, intent(in) :: number                !! of the object; 0: it has none
      integer :: k, n
      n = size(names)
      call report_lone_words(self)
      call self%skip_comment()
      self%record = record_type(n=n, object=object, number=number)
      self%record%names(1:n) = names
      if (self%at <= self%tokens%n) self%record%first_token = self%at
      do k = 1, n
         if (k > 1) call skip_stray_word(self, k)
         if (self%at > self%tokens%n) then
            if (self%n_missing == 0) self%missing_name = full_name(self%record, k)
            self%n_missing = self%n_missing + n - k + 1
            return
         end if
         if (self%tokens%kind(self%at) == token_kind%number) then
            self%record%value(k) = self%tokens%value(self%at)
            self%record%token(k) = self%at
         else
            call report_bad_token(self, k)
         end if
         self%at = self%at + 1
      end do
      self%end_line = self%tokens%line(self%at - 1)
      if (self%broken_at == 0 .and. n > 1 .and. is_broken(self)) then
         self%broken_at = self%record%first_token
         self%broken_name = full_name(self%record, 0)
      end if
   end subroutine read_record

   !> Warn of words that begin lines before the next record: these lines are taken as comment.
   subroutine report_lone_words(self)
      class(record_reader_type), intent(inout) :: self
      integer :: i, line
      if (self%strict .or. self%end_line == 0) return   ! taken as mistyped numbers
      line = self%end_line
      do i = self%at, self%tokens%n
         if (self%tokens%line(i) == line) cycle
         if (self%tokens%kind(i) /= token_kind%text) return
         line = self%tokens%line(i)
         call self%messages%add(severity%warning, "'"//self%tokens%text(i)// &
                                "' and the rest of its line are taken as "//'comment; begin such a line with #', &
                                self%tokens%origin(i))
      end do
   end subroutine report_lone_words

   !> Skip a stray word before number k: the rest of its line has all the numbers that the record still needs, so that
   !> the word is an error, but not in place of a number.
   subroutine skip_stray_word(self, k)
      class(record_reader_type), intent(inout) :: self
      integer, intent(in) :: k
      if (self%at >= self%tokens%n) return
      associate (line => self%tokens%line)
         if (self%tokens%kind(self%at) /= token_kind%text .or. line(self%at + 1) /= line(self%at)) return
      end associate
      if (self%tokens%numbers_left_on_line(self%at + 1) /= self%record%n - k + 1) return
      call report_bad_token(self, k)
      self%at = self%at + 1
   end subroutine skip_stray_word

   !> Report the next token, which is not a number, in place of number k.
   subroutine report_bad_token(self, k)
      class(record_reader_type), intent(inout) :: self
      integer, intent(in) :: k
      character(len=:), allocatable :: problem
      self%n_bad = self%n_bad + 1
      problem = "expected a number, found '"//self%tokens%text(self%at)//"'"
      if (self%tokens%kind(self%at) == token_kind%out_of_range) &
         problem = "the number '"//self%tokens%text(self%at)//"' is out of range"
      call self%messages%add(severity%error, full_name(self%record, k)//': '//problem, self%tokens%origin(self%at))
   end subroutine report_bad_token

   !> Does the last record spread over lines that it does not fill: begin or end within a line of other numbers?
   pure logical function is_broken(self)
      class(record_reader_type), intent(in) :: self
      integer :: first
      first = self%record%first_token
      is_broken = .false.
      if (self%tokens%line(first) == self%end_line) return
      if (first > 1) is_broken = self%tokens%line(first - 1) == self%tokens%line(first)
      if (self%at > self%tokens%n) return
      if (self%tokens%line(self%at) /= self%end_line) return
      is_broken = is_broken .or. self%tokens%kind(self%at) /= token_kind%text
   end function is_broken

   !> Read a record of one whole number >= 0; -1 when there is none.
   subroutine read_count(self, name, count)
      class(record_reader_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(out) :: count
      count = -1
      call self%read_record([name], '', 0)
      if (self%record%token(1) == 0) return
      associate (value => self%record%value(1))
         call self%require(abs(value) <= real(huge(1), wp), 1, 'must not be larger than '//to_string(huge(1)))
         if (abs(value) > real(huge(1), wp)) return
         call self%require(is_whole(value), 1, 'expected a whole number')
         if (.not. is_whole(value)) return
         call self%require(value >= 0, 1, 'must not be negative')
         if (value >= 0) count = nint(value)
      end associate
   end subroutine read_count

   !> Numbers from here to the end of the file, without comments.
   integer function numbers_left(self)
      class(record_reader_type), intent(in) :: self
      type(record_reader_type) :: ahead
      numbers_left = 0
      ahead%tokens => self%tokens
      ahead%at = self%at
      ahead%end_line = self%end_line
      do
         call ahead%skip_comment()
         if (ahead%at > self%tokens%n) exit
         numbers_left = numbers_left + 1
         ahead%end_line = self%tokens%line(ahead%at)
         ahead%at = ahead%at + 1
      end do
   end function numbers_left

   !> Does the file have exactly the numbers that were read?
   logical function is_exact(self)
      class(record_reader_type), intent(in) :: self
      is_exact = self%n_missing == 0
      if (is_exact) is_exact = self%numbers_left() == 0
   end function is_exact

   !> Report number `k` of the record unless `condition` holds: "<name> …: must be …, found '…'".
   subroutine require(self, condition, k, rule)
      class(record_reader_type), intent(inout) :: self
      logical, intent(in) :: condition
      integer, intent(in) :: k                          !! place in the record
      character(len=*), intent(in) :: rule              !! "must be greater than 0"
      if (condition .or. .not. self%check) return
      if (self%record%token(k) == 0) return
      call self%messages%add(severity%error, full_name(self%record, k)//': '//rule//", found '"// &
                        self%tokens%text(self%record%token(k))//"'", self%tokens%origin(self%record%token(k)))
   end subroutine require

   !> Report each of the first n numbers of the record (default: all) beyond a limit on the absolute value.
   subroutine require_size(self, limit, n)
      class(record_reader_type), intent(inout) :: self
      real(wp), intent(in) :: limit
      integer, intent(in), optional :: n
      integer :: k, last
      last = self%record%n
      if (present(n)) last = n
      do k = 1, last
         if (abs(self%record%value(k)) > limit) call self%require(.false., k, 'must not be larger than '// &
                                                                  to_string(limit))
      end do
   end subroutine require_size

   !> Number `k` of the record as a material number >= 1; 1 when it is none (reported).
   integer function to_whole(self, k)
      class(record_reader_type), intent(inout) :: self
      integer, intent(in) :: k
      to_whole = 1
      if (.not. is_whole(self%record%value(k))) then
         call self%require(.false., k, 'must be a whole number')
      else if (self%record%value(k) < 1) then
         call self%require(.false., k, 'must be at least 1')
      else
         to_whole = nint(self%record%value(k))
      end if
   end function to_whole

   !> Where the record begins.
   function record_origin(self) result(origin)
      class(record_reader_type), intent(in) :: self
      type(origin_type) :: origin
      if (self%record%first_token > 0) origin = self%tokens%origin(self%record%first_token)
   end function record_origin

   !> Has the number of errors reached that at which reading stops?
   pure logical function too_many_errors(self)
      class(record_reader_type), intent(in) :: self
      too_many_errors = self%messages%n_errors >= most_errors .or. self%n_bad >= most_errors
   end function too_many_errors

   !> May the next record be read: no number is missing so far, and there are not too many errors?
   pure logical function goes_on(self)
      class(record_reader_type), intent(in) :: self
      goes_on = self%n_missing == 0 .and. .not. self%too_many_errors()
   end function goes_on

   !> Point at the first record that does not fit the lines of the file, if there is one.
   subroutine report_break(self, level)
      class(record_reader_type), intent(inout) :: self   !! after all records
      integer, intent(in) :: level                       !! one of severity%...
      character(len=:), allocatable :: place
      if (self%broken_at == 0) return
      place = 'from here on'
      if (len(self%broken_name) > 0) place = place//' ('//self%broken_name//')'
      call self%messages%add(level, place//' the numbers do not fit the lines of the file: one may be missing or '// &
                             'too many', self%tokens%origin(self%broken_at))
   end subroutine report_break

   !> Point at the first text on a line of its own, in a file whose numbers do not add up.
   subroutine note_comment(tokens, messages)
      type(token_list_type), intent(in) :: tokens
      type(diagnostics_type), intent(inout) :: messages
      integer :: i
      do i = 2, tokens%n
         if (tokens%kind(i) /= token_kind%text .or. tokens%line(i) == tokens%line(i - 1)) cycle
         call messages%add(severity%note, "'"//tokens%text(i)//"' and the rest of its line are taken as comment", &
                           tokens%origin(i))
         return
      end do
   end subroutine note_comment

   !> Point at the first number that seems to have a decimal comma, in a file whose numbers do not add up.
   subroutine report_decimal_comma(tokens, messages)
      type(token_list_type), intent(in) :: tokens
      type(diagnostics_type), intent(inout) :: messages
      integer :: i, k
      do k = 1, messages%n    ! one is reported already
         if (index(messages%items(k)%message, 'because a comma separates numbers') > 0) return
      end do
      do i = 1, tokens%n - 1
         if (.not. tokens%has_decimal_comma(i)) cycle
         call messages%add(severity%error, "'"//tokens%text(i)//','//tokens%text(i + 1)// &
            "' is two numbers, because a "// &
                           'comma separates numbers; if it is meant as a decimal comma, write a point: '// &
                           tokens%text(i)//'.'//tokens%text(i + 1), tokens%origin(i))
         return
      end do
   end subroutine report_decimal_comma

   !> Report a count that alone needs more numbers than the file holds.
   subroutine report_large_count(tokens, place, name, count, each, messages)
      type(token_list_type), intent(in) :: tokens
      integer, intent(in) :: place                   !! the count is this number of the file
      character(len=*), intent(in) :: name           !! 'number of lines'
      integer, intent(in) :: count, each             !! the count, and the numbers that each needs
      type(diagnostics_type), intent(inout) :: messages
      if (int(count, i8)*each <= tokens%n_numbers) return
      call messages%add(severity%error, name//': '//to_string(count)//' seems to be wrong, the file holds '// &
                        to_string(tokens%n_numbers)//' numbers in all', tokens%origin(max(1, tokens%nth_number(place))))
   end subroutine report_large_count

   !> Append messages in the order of the file; those without a line come last, those of other files stay.
   subroutine append_in_order(messages, found)
      type(diagnostics_type), intent(inout) :: messages
      type(diagnostics_type), intent(in) :: found
      integer :: order(found%n), i, k, held
      do i = 1, found%n
         held = i
         k = i - 1
         do while (k > 0)
            if (.not. comes_before(found%items(held)%origin, found%items(order(k))%origin)) exit
            order(k + 1) = order(k)
            k = k - 1
         end do
         order(k + 1) = held
      end do
      call messages%append(found, order)
   end subroutine append_in_order

   !> Does place a come before place b?
   pure logical function comes_before(a, b)
      type(origin_type), intent(in) :: a, b
      integer :: line_a, line_b
      comes_before = .false.
      if (allocated(a%file) .and. allocated(b%file)) then
         if (a%file /= b%file) return
      end if
      line_a = merge(a%line, huge(1), a%line > 0)
      line_b = merge(b%line, huge(1), b%line > 0)
      comes_before = line_a < line_b .or. (line_a == line_b .and. a%column < b%column)
   end function comes_before

   !> "x1 of line 3", "cohesion of joint material 2"; for k = 0 "line 3".
   pure function full_name(record, k) result(text)
      type(record_type), intent(in) :: record
      integer, intent(in) :: k                   !! place in the record, 0: the record itself
      character(len=:), allocatable :: text
      text = ''
      if (k > 0) text = trim(record%names(k))
      if (k > 0 .and. len(record%object) > 0) text = text//' of '
      text = text//record%object
      if (record%number > 0) text = text//' '//to_string(record%number)
   end function full_name

end module rockdda_io_record_reader
