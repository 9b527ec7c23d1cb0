! SPDX-License-Identifier: MIT
!> Words of a text file: separated by blanks, tabs, commas and line ends; `#` and `!` start comments.
module rockdda_io_tokens
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : lower_case
   use rockdda_base_diagnostics, only : origin_type
   use rockdda_base_numbers, only : parse_number, number_status
   use rockdda_io_source, only : source_type
   implicit none
   private
   public :: token_list_type, tokenise, token_kind

   type :: token_kind_enum
      integer :: number = 0        !! its value is in `value`
      integer :: text = 1
      integer :: out_of_range = 2  !! a number outside the range of double precision
   end type token_kind_enum
   type(token_kind_enum), parameter :: token_kind = token_kind_enum()

   !> All tokens of a source, one entry of each array per token.
   type :: token_list_type
      type(source_type) :: source
      integer :: n = 0
      integer, allocatable :: first(:), last(:)  !! positions in source%text
      integer, allocatable :: line(:)            !! 1-based
      integer, allocatable :: kind(:)            !! one of token_kind%...
      real(wp), allocatable :: value(:)
      integer :: n_text = 0                      !! tokens that are not numbers
      integer :: n_numbers = 0                   !! numbers outside comments: on each line those before its first text
   contains
      procedure :: text => token_text
      procedure :: origin => token_origin
      procedure :: end_origin
      procedure :: is_not_finite
      procedure :: numbers_left_on_line
      procedure :: has_decimal_comma
      procedure :: nth_number
      procedure :: number_places
   end type token_list_type

contains

   !> Split a source into tokens.
   subroutine tokenise(source, tokens)
      type(source_type), intent(in) :: source
      type(token_list_type), intent(out) :: tokens
      integer :: i, n, line, start, status
      logical :: comment, text_before
      n = count_tokens(source%text)
      tokens%source = source
      tokens%n = n
      allocate (tokens%first(n), tokens%last(n), tokens%line(n), tokens%kind(n), tokens%value(n))
      n = 0
      line = 1
      start = 0
      comment = .false.
      text_before = .false.
      do i = 1, len(source%text) + 1
         if (i <= len(source%text)) then
            if (.not. (comment .or. ends_token(source%text(i:i)))) then
               if (start == 0) start = i
               cycle
            end if
         end if
         if (start > 0) then
            n = n + 1
            tokens%first(n) = start
            tokens%last(n) = i - 1
            tokens%line(n) = line
            call parse_number(source%text(start:i - 1), tokens%value(n), status)
            tokens%kind(n) = token_kind%number
            if (status == number_status%text) then
               tokens%kind(n) = token_kind%text
               tokens%n_text = tokens%n_text + 1
               text_before = .true.
            else
               if (status == number_status%out_of_range) tokens%kind(n) = token_kind%out_of_range
               if (.not. text_before) tokens%n_numbers = tokens%n_numbers + 1
            end if
            start = 0
         end if
         if (i > len(source%text)) exit
         select case (source%text(i:i))
         case ('#', '!')
            comment = .true.
         case (achar(10))
            comment = .false.
            text_before = .false.
            line = line + 1
         end select
      end do
   end subroutine tokenise

   !> Number of tokens of a text.
   pure integer function count_tokens(text)
      character(len=*), intent(in) :: text
      logical :: inside, comment
      integer :: i
      count_tokens = 0
      inside = .false.
      comment = .false.
      do i = 1, len(text)
         if (text(i:i) == achar(10)) comment = .false.
         if (text(i:i) == '#' .or. text(i:i) == '!') comment = .true.
         if (comment .or. ends_token(text(i:i))) then
            inside = .false.
         else if (.not. inside) then
            inside = .true.
            count_tokens = count_tokens + 1
         end if
      end do
   end function count_tokens

   !> Separators and the starts of comments.
   pure logical function ends_token(c)
      character(len=1), intent(in) :: c
      select case (c)
      case (' ', ',', '#', '!', achar(9), achar(10), achar(11), achar(12), achar(13))
         ends_token = .true.
      case default
         ends_token = .false.
      end select
   end function ends_token

   !> A token as written; long ones are shortened.
   pure function token_text(self, i) result(text)
      class(token_list_type), intent(in) :: self
      integer, intent(in) :: i
      character(len=:), allocatable :: text
      text = self%source%text(self%first(i):self%last(i))
      if (len(text) > 40) text = text(1:37)//'...'
   end function token_text

   !> Place where a token begins.
   pure function token_origin(self, i) result(origin)
      class(token_list_type), intent(in) :: self
      integer, intent(in) :: i
      type(origin_type) :: origin
      origin = self%source%origin(self%line(i), self%first(i) - self%source%line_start(self%line(i)) + 1)
   end function token_origin

   !> Place directly after the last token, for messages about missing tokens.
   pure function end_origin(self) result(origin)
      class(token_list_type), intent(in) :: self
      type(origin_type) :: origin
      if (self%n == 0) then
         origin = self%source%origin(self%source%n_lines, 1)
      else
         origin = self%source%origin(self%line(self%n), &
                                     self%last(self%n) - self%source%line_start(self%line(self%n)) + 2)
      end if
   end function end_origin

   !> Is this text NaN or an infinity?
   pure logical function is_not_finite(self, i)
      class(token_list_type), intent(in) :: self
      integer, intent(in) :: i
      character(len=:), allocatable :: word
      word = lower_case(self%text(i))
      if (word(1:1) == '+' .or. word(1:1) == '-') word = word(2:)
      is_not_finite = word == 'nan' .or. word == 'inf' .or. word == 'infinity'
   end function is_not_finite

   !> Numbers from token `i` on that stand on its line before the first text.
   pure integer function numbers_left_on_line(self, i)
      class(token_list_type), intent(in) :: self
      integer, intent(in) :: i
      integer :: k
      numbers_left_on_line = 0
      if (i > self%n) return
      do k = i, self%n
         if (self%line(k) /= self%line(i) .or. self%kind(k) == token_kind%text) exit
         numbers_left_on_line = numbers_left_on_line + 1
      end do
   end function numbers_left_on_line

   !> Do tokens `i` and i + 1 make one number with a decimal comma? Two runs of digits with only a comma
   !> between them, and no such comma before or after them.
   pure logical function has_decimal_comma(self, i, in_a_row)
      class(token_list_type), intent(in) :: self
      integer, intent(in) :: i
      logical, intent(in), optional :: in_a_row    !! true: also where more commas follow, as in 35,5,0,0
      character(len=*), parameter :: digits = '0123456789'
      integer :: first, last, next
      has_decimal_comma = .false.
      if (i < 1 .or. i >= self%n) return
      first = self%first(i)
      last = self%last(i)
      next = self%first(i + 1)
      if (next /= last + 2) return
      if (self%source%text(last + 1:last + 1) /= ',') return
      if (scan(self%source%text(first:first), '+-') > 0) first = first + 1
      if (first > last) return
      if (verify(self%source%text(first:last), digits) > 0) return
      if (verify(self%source%text(next:next), digits) > 0) return
      if (verify(self%source%text(next:self%last(i + 1)), digits//'eEdD+-') > 0) return
      has_decimal_comma = .true.
      if (present(in_a_row)) then
         if (in_a_row) return
      end if
      has_decimal_comma = .false.
      if (self%first(i) > 1) then
         if (self%source%text(self%first(i) - 1:self%first(i) - 1) == ',') return
      end if
      if (self%last(i + 1) < len(self%source%text)) then
         if (self%source%text(self%last(i + 1) + 1:self%last(i + 1) + 1) == ',') return
      end if
      has_decimal_comma = .true.
   end function has_decimal_comma

   !> The tokens that are numbers outside comments: on each line those before its first text.
   pure function number_places(self) result(places)
      class(token_list_type), intent(in) :: self
      integer, allocatable :: places(:)
      integer :: i, n, text_line
      allocate (places(self%n_numbers))
      n = 0
      text_line = 0
      do i = 1, self%n
         if (self%line(i) == text_line) cycle
         if (self%kind(i) == token_kind%text) then
            text_line = self%line(i)
         else
            n = n + 1
            places(n) = i
         end if
      end do
   end function number_places

   !> The token that is the n-th number outside comments; 0 when there are fewer.
   pure integer function nth_number(self, n) result(i)
      class(token_list_type), intent(in) :: self
      integer, intent(in) :: n
      i = 0
      if (n < 1 .or. n > self%n_numbers) return
      associate (places => self%number_places())
         i = places(n)
      end associate
   end function nth_number

end module rockdda_io_tokens
