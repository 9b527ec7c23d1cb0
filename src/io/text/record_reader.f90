! SPDX-License-Identifier: MIT
!> Reads records of numbers from a list of tokens, with the names of the expected quantities.
!>
!> A record is one count, the five numbers of a line, the thirteen of a material … and may spread over lines.
!> A token that is not a number is an error inside a record; after a complete record it and the rest of its line
!> are comment. Text at the start of a record on a line of its own is comment, too; in `strict` mode (used
!> when the numbers of the file do not agree with its counts otherwise) it counts as a mistyped number.
module rockdda_io_record_reader
   use rockdda_base_kinds, only : wp, i8
   use rockdda_base_strings, only : to_string
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_io_tokens, only : token_list_type, token_kind
   use rockdda_io_numbers, only : is_whole
   implicit none
   private
   public :: record_reader_type, largest_coordinate, smallest_length, largest_value
   public :: append_in_order, note_comment, report_decimal_comma, report_large_count

   !> Largest coordinate accepted (fourth powers must stay finite).
   real(wp), parameter :: largest_coordinate = 1.0e30_wp
   !> Smallest length accepted: products of areas must not underflow.
   real(wp), parameter :: smallest_length = 1.0e-30_wp
   !> Largest material value and load accepted.
   real(wp), parameter :: largest_value = 1.0e60_wp
   !> Reading stops after this number of messages.
   integer, parameter :: most_errors = 1000
   integer, parameter :: longest_record = 16

   !> The last record.
   type :: record_type
      integer :: n = 0                          !! numbers
      real(wp) :: value(longest_record) = 0     !! 0 without a valid number
      integer :: token(longest_record) = 0      !! token of each; 0: not read or not a number
      integer :: first_token = 0                !! 0: no token read
   end type record_type

   type :: record_reader_type
      integer :: at = 1               !! next token
      integer :: n_taken = 0          !! numbers read, mistyped ones counted
      integer :: n_bad = 0            !! tokens that are not numbers in place of numbers
      integer :: n_missing = 0        !! numbers missing at the end of the file
      integer :: broken_at = 0        !! first token of the first record that does not fit the lines of the file
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
   end type record_reader_type

contains

   !> Skip comment at the start of a record.
   pure subroutine skip_comment(self, tokens)
      class(record_reader_type), intent(inout) :: self
      type(token_list_type), intent(in) :: tokens
      integer :: line
      do while (self%at <= tokens%n)
         if (tokens%kind(self%at) /= token_kind%text) return
         line = tokens%line(self%at)
         if (line /= self%end_line) then
            if (self%strict .or. self%end_line == 0) return
         else if (self%strict .and. tokens%is_not_finite(self%at)) then
            return
         end if
         do while (self%at <= tokens%n)
            if (tokens%line(self%at) /= line) exit
            self%at = self%at + 1
         end do
      end do
   end subroutine skip_comment

   !> Read the numbers of one record. Messages name them "<name> of <object> <number>".
   subroutine read_record(self, tokens, names, object, number, messages)
      class(record_reader_type), intent(inout) :: self
      type(token_list_type), intent(in) :: tokens
      character(len=*), intent(in) :: names(:)     !! of the numbers, at most 16
      character(len=*), intent(in) :: object       !! object that the numbers belong to; empty: none
      integer, intent(in) :: number                !! of the object; 0: it has none
      type(diagnostics_type), intent(inout) :: messages
      integer :: k, n, left, at
      logical :: starts_line, spans

      n = size(names)
      call self%skip_comment(tokens)
      self%record%n = n
      self%record%value = 0
      self%record%token = 0
      self%record%first_token = 0
      if (self%at <= tokens%n) self%record%first_token = self%at
      do k = 1, n
         if (self%at <= tokens%n .and. k > 1) then
            ! a stray word although no number is missing: an error, but not in place of a number
            if (tokens%kind(self%at) == token_kind%text) then
               left = tokens%numbers_left_on_line(self%at + 1)
               if (self%at < tokens%n) then
                  if (tokens%line(self%at + 1) /= tokens%line(self%at)) left = 0
               end if
               if (left == n - k + 1) then
                  call bad_token(k)
                  self%at = self%at + 1
               end if
            end if
         end if
         if (self%at > tokens%n) then
            if (self%n_missing == 0) self%missing_name = full_name(trim(names(k)), object, number)
            self%n_missing = self%n_missing + n - k + 1
            self%n_taken = self%n_taken + n - k + 1
            return
         end if
         self%n_taken = self%n_taken + 1
         select case (tokens%kind(self%at))
         case (token_kind%number)
            self%record%value(k) = tokens%value(self%at)
            self%record%token(k) = self%at
         case default
            call bad_token(k)
         end select
         self%at = self%at + 1
      end do
      at = self%at
      self%end_line = tokens%line(at - 1)
      if (self%broken_at == 0 .and. n > 1) then
         spans = tokens%line(self%record%first_token) /= self%end_line
         starts_line = self%record%first_token == 1
         if (.not. starts_line) starts_line = tokens%line(self%record%first_token - 1) < &
                                              tokens%line(self%record%first_token)
         left = 0
         if (at <= tokens%n) then
            if (tokens%line(at) == self%end_line .and. tokens%kind(at) /= token_kind%text) left = 1
         end if
         if (spans .and. (left > 0 .or. .not. starts_line)) self%broken_at = self%record%first_token
      end if

   contains

      !> Report a token in place of a number.
      subroutine bad_token(k)
         integer, intent(in) :: k
         character(len=:), allocatable :: name
         self%n_bad = self%n_bad + 1
         name = full_name(trim(names(k)), object, number)
         if (tokens%kind(self%at) == token_kind%out_of_range) then
            call messages%add(severity%error, name//": the number '"//tokens%text(self%at)//"' is out of range", &
                              tokens%origin(self%at))
         else
            call messages%add(severity%error, name//": expected a number, found '"//tokens%text(self%at)//"'", &
                              tokens%origin(self%at))
         end if
      end subroutine bad_token

   end subroutine read_record

   !> Read a record of one whole number >= 0; -1 when there is none.
   subroutine read_count(self, tokens, name, count, messages)
      class(record_reader_type), intent(inout) :: self
      type(token_list_type), intent(in) :: tokens
      character(len=*), intent(in) :: name
      integer, intent(out) :: count
      type(diagnostics_type), intent(inout) :: messages
      character(len=len(name)) :: names(1)
      names(1) = name
      count = -1
      call self%read_record(tokens, names, '', 0, messages)
      if (self%record%token(1) == 0) return
      if (abs(self%record%value(1)) > real(huge(1), wp)) then
         call messages%add(severity%error, name//': must not be larger than '//to_string(huge(1))//", found '"// &
                           tokens%text(self%record%token(1))//"'", tokens%origin(self%record%token(1)))
      else if (.not. is_whole(self%record%value(1))) then
         call messages%add(severity%error, name//": expected a whole number, found '"// &
                           tokens%text(self%record%token(1))//"'", tokens%origin(self%record%token(1)))
      else if (self%record%value(1) < 0) then
         call messages%add(severity%error, name//": must not be negative, found '"// &
                           tokens%text(self%record%token(1))//"'", tokens%origin(self%record%token(1)))
      else
         count = nint(self%record%value(1))
      end if
   end subroutine read_count

   !> Numbers from here to the end of the file, without comments.
   pure integer function numbers_left(self, tokens)
      class(record_reader_type), intent(in) :: self
      type(token_list_type), intent(in) :: tokens
      type(record_reader_type) :: ahead
      numbers_left = 0
      ahead%at = self%at
      ahead%end_line = self%end_line
      do
         call ahead%skip_comment(tokens)
         if (ahead%at > tokens%n) exit
         numbers_left = numbers_left + 1
         ahead%end_line = tokens%line(ahead%at)
         ahead%at = ahead%at + 1
      end do
   end function numbers_left

   !> Does the file have exactly the numbers that were read?
   pure logical function is_exact(self, tokens)
      class(record_reader_type), intent(in) :: self
      type(token_list_type), intent(in) :: tokens
      is_exact = self%n_missing == 0
      if (is_exact) is_exact = self%numbers_left(tokens) == 0
   end function is_exact

   !> Report number `k` of the record unless `condition` holds: "<name> …: must be …, found '…'".
   subroutine require(self, tokens, condition, k, name, object, number, rule, messages)
      class(record_reader_type), intent(in) :: self
      type(token_list_type), intent(in) :: tokens
      logical, intent(in) :: condition
      integer, intent(in) :: k                          !! place in the record
      character(len=*), intent(in) :: name, object      !! as in read_record
      integer, intent(in) :: number
      character(len=*), intent(in) :: rule              !! "must be greater than 0"
      type(diagnostics_type), intent(inout) :: messages
      if (condition .or. .not. self%check) return
      if (self%record%token(k) == 0) return
      call messages%add(severity%error, full_name(trim(name), object, number)//': '//rule//", found '"// &
                        tokens%text(self%record%token(k))//"'", tokens%origin(self%record%token(k)))
   end subroutine require

   !> Report every number of the record beyond a limit on the absolute value.
   subroutine require_size(self, tokens, limit, names, object, number, messages)
      class(record_reader_type), intent(in) :: self
      type(token_list_type), intent(in) :: tokens
      real(wp), intent(in) :: limit
      character(len=*), intent(in) :: names(:), object
      integer, intent(in) :: number
      type(diagnostics_type), intent(inout) :: messages
      integer :: k
      do k = 1, size(names)
         if (abs(self%record%value(k)) > limit) call self%require(tokens, .false., k, names(k), object, number, &
                                                           'must not be larger than '//to_string(limit), messages)
      end do
   end subroutine require_size

   !> Number `k` of the record as a material number >= 1; 1 when it is none (reported).
   integer function to_whole(self, tokens, k, name, object, number, messages)
      class(record_reader_type), intent(in) :: self
      type(token_list_type), intent(in) :: tokens
      integer, intent(in) :: k
      character(len=*), intent(in) :: name, object
      integer, intent(in) :: number
      type(diagnostics_type), intent(inout) :: messages
      to_whole = 1
      if (.not. is_whole(self%record%value(k))) then
         call self%require(tokens, .false., k, name, object, number, 'must be a whole number', messages)
      else if (self%record%value(k) < 1) then
         call self%require(tokens, .false., k, name, object, number, 'must be at least 1', messages)
      else
         to_whole = nint(self%record%value(k))
      end if
   end function to_whole

   !> Where the record begins.
   function record_origin(self, tokens) result(origin)
      class(record_reader_type), intent(in) :: self
      type(token_list_type), intent(in) :: tokens
      type(origin_type) :: origin
      if (self%record%first_token > 0) origin = tokens%origin(self%record%first_token)
   end function record_origin

   !> Is it time to give up?
   pure logical function too_many_errors(self, messages)
      class(record_reader_type), intent(in) :: self
      type(diagnostics_type), intent(in) :: messages
      too_many_errors = messages%n_errors >= most_errors .or. self%n_bad >= most_errors
   end function too_many_errors

   !> The numbers of the file do not add up and there is text on lines of its own: point at the first.
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

   !> The numbers of the file do not add up: point at the first that looks like one with a decimal comma.
   subroutine report_decimal_comma(tokens, messages)
      type(token_list_type), intent(in) :: tokens
      type(diagnostics_type), intent(inout) :: messages
      integer :: i
      do i = 1, tokens%n - 1
         if (.not. tokens%has_decimal_comma(i)) cycle
         call messages%add(severity%error, "'"//tokens%text(i)//','//tokens%text(i + 1)// &
            "' is two numbers, because a "// &
                           'comma separates numbers; if it is meant as a decimal comma, write a point: '// &
                           tokens%text(i)//'.'//tokens%text(i + 1), tokens%origin(i))
         return
      end do
   end subroutine report_decimal_comma

   !> A count that asks alone for more numbers than the file holds: it is the one that is wrong.
   subroutine report_large_count(tokens, place, name, count, each, messages)
      type(token_list_type), intent(in) :: tokens
      integer, intent(in) :: place                   !! the count is this number of the file
      character(len=*), intent(in) :: name           !! 'number of lines'
      integer, intent(in) :: count, each             !! the count, and the numbers that each needs
      type(diagnostics_type), intent(inout) :: messages
      if (int(count, i8)*each <= tokens%n_numbers) return
      call messages%add(severity%error, name//': '//to_string(count)//' looks wrong, the file holds '// &
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

   !> "x1 of line 3"; "cohesion of joint material 2" from the name 'cohesion'.
   pure function full_name(name, object, number) result(text)
      character(len=*), intent(in) :: name, object
      integer, intent(in) :: number
      character(len=:), allocatable :: text
      text = name
      if (len(object) > 0) text = text//' of '//object
      if (number > 0) text = text//' '//to_string(number)
   end function full_name

end module rockdda_io_record_reader
