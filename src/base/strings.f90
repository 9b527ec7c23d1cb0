! SPDX-License-Identifier: MIT
!> Numbers to text, for messages and text files; the encoding of text; text made safe to show.
module rockdda_base_strings
   use, intrinsic :: ieee_arithmetic, only : ieee_is_nan
   use rockdda_base_kinds, only : wp, i8
   implicit none
   private
   public :: is_given, to_string, to_exact_string, counted, lower_case, printable, utf8_length, as_utf8, first_line, &
      replaced

   !> Text of a number for messages.
   interface to_string
      module procedure integer_to_string
      module procedure long_to_string
      module procedure real_to_string
   end interface to_string

contains

   !> A text with another one in each place of an old one.
   pure function replaced(text, old, new) result(filled)
      character(len=*), intent(in) :: text, old, new
      character(len=:), allocatable :: filled
      integer :: first, found
      filled = ''
      first = 1
      do
         found = index(text(first:), old)
         if (found == 0) exit
         filled = filled//text(first:first + found - 2)//new
         first = first + found - 1 + len(old)
      end do
      filled = filled//text(first:)
   end function replaced

   !> Does a text hold something?
   pure logical function is_given(text)
      character(len=:), allocatable, intent(in) :: text
      is_given = .false.
      if (allocated(text)) is_given = len_trim(text) > 0
   end function is_given

   !> Decimal text of an integer without blanks.
   pure function integer_to_string(value) result(text)
      integer, intent(in) :: value
      character(len=:), allocatable :: text
      text = long_to_string(int(value, i8))
   end function integer_to_string

   !> Decimal text of a long integer without blanks. Digit by digit: a formatted write takes a hundred times as long.
   pure function long_to_string(value) result(text)
      integer(i8), intent(in) :: value
      character(len=:), allocatable :: text
      character(len=24) :: buffer
      integer(i8) :: rest
      integer :: first
      first = len(buffer) + 1
      rest = value
      do
         first = first - 1
         ! of negative numbers the rest is negative: the lowest one has no opposite
         buffer(first:first) = achar(iachar('0') + int(abs(mod(rest, 10_i8))))
         rest = rest/10
         if (rest == 0) exit
      end do
      if (value < 0) then
         first = first - 1
         buffer(first:first) = '-'
      end if
      text = buffer(first:)
   end function long_to_string

   !> Text of a real with at most `digits` significant digits (default 6) and no trailing zeros:
   !> 0.5, 20000, 1e+10, -3.25e-07. Below a million the digits before the point are all written, even if
   !> `digits` is smaller.
   pure function real_to_string(value, digits) result(text)
      real(wp), intent(in) :: value
      integer, intent(in), optional :: digits !! significant digits, 1 to 17
      character(len=:), allocatable :: text
      character(len=40) :: buffer
      character(len=16) :: form
      character(len=:), allocatable :: mantissa
      integer :: n, exponent, k, io
      n = 6
      if (present(digits)) n = max(1, min(17, digits))
      if (ieee_is_nan(value)) then
         text = 'NaN'
         return
      else if (abs(value) > huge(value)) then
         text = merge('-inf', 'inf ', value < 0)
         text = trim(text)
         return
      else if (abs(value) <= 0.0_wp) then
         text = '0'
         return
      end if
      write (form, '(a,i0,a,i0,a)') '(es', n + 9, '.', n - 1, 'e3)'
      write (buffer, form) value
      buffer = adjustl(buffer)
      k = index(buffer, 'E')
      read (buffer(k + 1:), *, iostat=io) exponent
      if (io /= 0) exponent = 0
      if (exponent >= -4 .and. exponent < max(6, n)) then
         write (form, '(a,i0,a)') '(f0.', max(0, n - 1 - exponent), ')'
         write (buffer, form) value
         text = trim(adjustl(buffer))
         if (index(text, '.') > 0) text = strip_zeros(text)
         if (text(1:1) == '.') text = '0'//text
         if (len(text) > 1) then
            if (text(1:2) == '-.') text = '-0'//text(2:)
         end if
      else
         mantissa = strip_zeros(buffer(1:k - 1))
         write (form, '(i0.2)') abs(exponent)
         text = mantissa//'e'//merge('-', '+', exponent < 0)//trim(form)
      end if
   end function real_to_string

   !> Text that reads back as exactly the same real (17 significant digits).
   pure function to_exact_string(value) result(text)
      real(wp), intent(in) :: value
      character(len=:), allocatable :: text
      character(len=32) :: buffer
      write (buffer, '(es24.16e3)') value
      text = trim(adjustl(buffer))
   end function to_exact_string

   !> Drop trailing zeros after the point, and the point if no digit follows it.
   pure function strip_zeros(text) result(short)
      character(len=*), intent(in) :: text
      character(len=:), allocatable :: short
      integer :: n
      n = len_trim(text)
      do while (n > 1)
         if (text(n:n) /= '0') exit
         n = n - 1
      end do
      if (text(n:n) == '.') n = n - 1
      short = text(1:n)
   end function strip_zeros

   !> ASCII lower case.
   pure function lower_case(text) result(lower)
      character(len=*), intent(in) :: text
      character(len=len(text)) :: lower
      integer :: i, c
      lower = text
      do i = 1, len(text)
         c = iachar(text(i:i))
         if (c >= iachar('A') .and. c <= iachar('Z')) lower(i:i) = achar(c + 32)
      end do
   end function lower_case

   !> "1 number", "3 numbers".
   pure function counted(n, noun) result(text)
      integer, intent(in) :: n
      character(len=*), intent(in) :: noun
      character(len=:), allocatable :: text
      text = to_string(n)//' '//noun
      if (n /= 1) text = text//'s'
   end function counted

   !> Text that is safe to show in a terminal: control characters, also those beyond ASCII, become \xHH, those of
   !> `keep` stay.
   pure function printable(text, keep) result(shown)
      character(len=*), intent(in) :: text
      character(len=*), intent(in) :: keep
      character(len=:), allocatable :: shown
      character(len=2) :: digits
      integer :: i, n, pass, length, code
      length = 0
      do pass = 1, 2
         if (pass == 2) allocate (character(len=length) :: shown)
         length = 0
         i = 1
         do while (i <= len(text))
            n = 1
            code = iachar(text(i:i))
            if (code >= 128) n = max(1, utf8_length(text(i:)))
            if (n == 2 .and. code == 194) code = iachar(text(i + 1:i + 1))
            if (is_control(code, n) .and. index(keep, text(i:i)) == 0) then
               write (digits, '(z2.2)') code
               if (pass == 2) shown(length + 1:length + 4) = achar(92)//'x'//lower_case(digits)
               length = length + 4
            else
               if (pass == 2) shown(length + 1:length + n) = text(i:i + n - 1)
               length = length + n
            end if
            i = i + n
         end do
      end do
   end function printable

   !> Is this a control character? Its code, and its length in UTF-8.
   pure logical function is_control(code, n)
      integer, intent(in) :: code, n
      is_control = n < 3 .and. (code < 32 .or. (code > 126 .and. code < 160))
   end function is_control

   !> Bytes of the well-formed UTF-8 character (beyond ASCII) at the beginning of a text; 0 when there is none.
   pure integer function utf8_length(text)
      character(len=*), intent(in) :: text
      integer :: lead, next, i, n, smallest, largest
      utf8_length = 0
      lead = iachar(text(1:1))
      smallest = 128
      largest = 191
      select case (lead)
      case (194:223)
         n = 2
      case (224:239)
         n = 3
         if (lead == 224) smallest = 160
         if (lead == 237) largest = 159
      case (240:244)
         n = 4
         if (lead == 240) smallest = 144
         if (lead == 244) largest = 143
      case default
         return
      end select
      if (len(text) < n) return
      next = iachar(text(2:2))
      if (next < smallest .or. next > largest) return
      do i = 3, n
         next = iachar(text(i:i))
         if (next < 128 .or. next > 191) return
      end do
      utf8_length = n
   end function utf8_length

   !> Text as UTF-8: bytes that are not UTF-8 are read as ISO 8859-1 (Latin-1).
   pure function as_utf8(text) result(utf8)
      character(len=*), intent(in) :: text
      character(len=:), allocatable :: utf8
      character(len=2*len(text)) :: buffer
      integer :: i, n, used, code
      used = 0
      i = 1
      do while (i <= len(text))
         n = 1
         code = iachar(text(i:i))
         if (code >= 128) n = utf8_length(text(i:))
         if (n > 0) then
            buffer(used + 1:used + n) = text(i:i + n - 1)
            used = used + n
         else
            n = 1
            buffer(used + 1:used + 2) = achar(192 + code/64)//achar(128 + mod(code, 64))
            used = used + 2
         end if
         i = i + n
      end do
      utf8 = buffer(1:used)
   end function as_utf8

   !> Text up to its first line end.
   pure function first_line(text) result(line)
      character(len=*), intent(in) :: text
      character(len=:), allocatable :: line
      integer :: n
      n = index(text, new_line('a'))
      if (n == 0) n = len(text) + 1
      line = text(1:n - 1)
   end function first_line

end module rockdda_base_strings
