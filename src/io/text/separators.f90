! SPDX-License-Identifier: MIT
!> What separates the numbers of a table with a row on each line, and whether commas are decimal signs in it.
!>
!> Between semicolons or tabs a comma within digits is a decimal sign, as spreadsheets write it in some countries.
!> Commas that may be decimal signs and may as well separate numbers are an error: a table is never read as other
!> numbers than it was written for.
module rockdda_io_separators
   use rockdda_base_strings, only : to_string
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_io_source, only : source_type, line_range
   implicit none
   private
   public :: settle_separators

   character(len=*), parameter :: digits = '0123456789', tab = achar(9), blanks = ' '//tab//achar(11)//achar(12)
   !> What begins a row of numbers; text before the first one is a header.
   character(len=*), parameter :: begins = digits//'+-.,;'

   !> Places in the text of what the rows have, the first of each; 0: none.
   type :: found_type
      integer :: semicolon = 0
      integer :: tab = 0, blank = 0    !! alone between two numbers
      integer :: comma = 0             !! with digits alone before and behind it
      integer :: chained = 0           !! such a comma beside another one: 1,234,5
      integer :: other_comma = 0
      integer :: point = 0
      integer :: zero = 0              !! comma before digits that begin with 0, as in 0,05
      integer :: empty = 0             !! separator without a number before it
      logical :: all_long = .true.     !! each row has enough numbers that some may be halves of others
   end type found_type

contains

   !> Make separators plain, blanks or commas, with points in numbers. What may be read in two ways is an error.
   subroutine settle_separators(source, least, multiple, messages, ok)
      type(source_type), intent(inout) :: source
      integer, intent(in) :: least           !! numbers of a row, at least
      integer, intent(in) :: multiple        !! their number is a multiple of this
      type(diagnostics_type), intent(inout) :: messages
      logical, intent(out) :: ok
      type(found_type) :: found
      integer :: line, first, last, names
      logical :: is_row, has_rows
      names = 0
      has_rows = .false.
      do line = 1, source%n_lines
         call find_row(source, line, first, last, is_row)
         if (is_row) then
            call scan_row(source%text, first, last, least, multiple, names, found)
         else if (.not. has_rows .and. last >= first) then
            names = count_names(source%text(first:last))
         end if
         has_rows = has_rows .or. is_row
      end do
      ok = .false.
      if (found%empty > 0) then
         call report(found%empty, 'a number is missing before this separator')
      else if (found%semicolon > 0) then
         if (max(found%blank, found%tab) > 0) then
            call report(max(found%blank, found%tab), 'expected one number between two semicolons')
         else if (max(found%chained, found%other_comma) > 0) then
            call report(max(found%chained, found%other_comma), 'between semicolons a comma is a decimal sign: '// &
                        'expected digits before and behind it, and no other comma in the number')
         else if (found%comma > 0 .and. found%point > 0) then
            call report(found%comma, 'a decimal comma, and a point in a number of line '// &
                        to_string(line_of(found%point))//': expected one of them')
         else
            call make_plain(source)
         end if
      else if (found%zero > 0 .and. found%tab == 0) then
         call report_comma(found%zero)
      else if (found%comma == 0) then
         ok = .true.
      else if (found%tab > 0 .and. max(found%chained, found%other_comma, found%point, found%blank) == 0) then
         call make_plain(source)
      else if (max(found%tab, found%blank) > 0 .or. (found%all_long .and. found%point == 0)) then
         call report_comma(found%comma)
      else
         ok = .true.
      end if
      if (allocated(source%written)) then
         ok = .true.
         if (found%comma > 0) call messages%add(severity%note, 'commas are read as decimal signs', place(found%comma))
      end if

   contains

      !> Report a comma that may be a decimal sign.
      subroutine report_comma(at)
         integer, intent(in) :: at
         integer :: a, b
         a = at - 1
         do while (a > 1)
            if (scan(source%text(a - 1:a - 1), digits//'+-') == 0) exit
            a = a - 1
         end do
         b = at + 1
         do while (b < len(source%text))
            if (scan(source%text(b + 1:b + 1), digits//'eEdD+-') == 0) exit
            b = b + 1
         end do
         associate (front => source%text(a:at - 1), back => source%text(at + 1:b))
            call report(at, "'"//front//','//back//"' may be one number with a decimal comma or two numbers: write "// &
                        front//'.'//back//' or '//front//' '//back//', or separate the numbers of the file by '// &
                        'semicolons; then a comma is a decimal sign')
         end associate
      end subroutine report_comma

      !> An error at a place.
      subroutine report(at, problem)
         integer, intent(in) :: at
         character(len=*), intent(in) :: problem
         call messages%add(severity%error, problem, place(at))
      end subroutine report

      !> Line of a position.
      integer function line_of(at)
         integer, intent(in) :: at
         line_of = count(source%line_start <= at)
      end function line_of

      !> Line and column of a position.
      type(origin_type) function place(at)
         integer, intent(in) :: at
         place = source%origin(line_of(at), at - source%line_start(line_of(at)) + 1)
      end function place

   end subroutine settle_separators

   !> Find what a line has besides blanks and a comment, and whether it is a row of numbers.
   pure subroutine find_row(source, line, first, last, is_row)
      type(source_type), intent(in) :: source
      integer, intent(in) :: line
      integer, intent(out) :: first, last      !! positions in the text; last < first: nothing
      logical, intent(out) :: is_row
      integer :: comment
      call line_range(source, line, first, last)
      comment = scan(source%text(first:last), '#!')
      if (comment > 0) last = first + comment - 2
      last = first - 1 + verify(source%text(first:last), blanks, back=.true.)
      is_row = .false.
      if (last < first) return
      first = first - 1 + verify(source%text(first:last), blanks)
      is_row = scan(source%text(first:first), begins) > 0
   end subroutine find_row

   !> Points for decimal commas, commas for semicolons; messages repeat the lines as they are.
   pure subroutine make_plain(source)
      type(source_type), intent(inout) :: source
      integer :: i, line, first, last
      logical :: is_row
      source%written = source%text
      do line = 1, source%n_lines
         call find_row(source, line, first, last, is_row)
         do i = first, last
            if (source%text(i:i) == ',' .and. is_row) source%text(i:i) = '.'
            if (source%text(i:i) == ';') source%text(i:i) = ','
         end do
      end do
   end subroutine make_plain

   !> Note what a row has.
   subroutine scan_row(text, first, row_end, least, multiple, names, found)
      character(len=*), intent(in) :: text
      integer, intent(in) :: first, row_end     !! positions in the text
      integer, intent(in) :: least, multiple    !! of the numbers of a row
      integer, intent(in) :: names              !! in the header, 0: there is none
      type(found_type), intent(inout) :: found
      integer :: i, k, n, last, before, behind
      character(len=1) :: previous              !! the last one that is no blank
      i = index(text(first:row_end), ';')
      if (i > 0) call note(found%semicolon, first - 1 + i)
      ! separators at the end of a row are those of empty cells behind it
      last = first - 1 + verify(text(first:row_end), blanks//',;', back=.true.)
      n = 0
      previous = ','
      i = first
      do while (i <= last)
         if (scan(text(i:i), ',;') > 0) then
            if (scan(previous, ',;') > 0) call note(found%empty, i)
            if (text(i:i) == ',') call note_comma()
            previous = text(i:i)
            i = i + 1
         else if (scan(text(i:i), blanks) > 0) then
            k = i - 1 + verify(text(i:last), blanks)
            if (scan(previous//text(k:k), ',;') == 0) then
               if (index(text(i:k - 1), tab) > 0) then
                  call note(found%tab, i)
               else
                  call note(found%blank, i)
               end if
            end if
            i = k
         else
            n = n + 1
            k = word_end(i)
            if (index(text(i:k), '.') > 0) call note(found%point, i - 1 + index(text(i:k), '.'))
            previous = text(k:k)
            i = k + 1
         end if
      end do
      if (multiple == 1) then
         k = n - 1      ! numbers where one comma is a decimal sign
      else
         k = merge(n/2, 0, modulo(n, 2*multiple) == 0)
      end if
      if (k < least .or. n == names) found%all_long = .false.

   contains

      !> Note the comma at `i`.
      subroutine note_comma()
         logical :: decimal
         before = i
         do while (before > first)
            if (scan(text(before - 1:before - 1), blanks//',;') > 0) exit
            before = before - 1
         end do
         behind = word_end(i + 1)
         decimal = before < i .and. behind > i
         if (decimal) then
            associate (a => text(before:i - 1), b => text(i + 1:behind))
               k = merge(2, 1, scan(a(1:1), '+-') > 0)
               decimal = len(a) >= k .and. verify(a(k:), digits) == 0 .and. verify(b(1:1), digits) == 0 .and. &
                         verify(b, digits//'eEdD+-') == 0
               if (decimal .and. b(1:1) == '0' .and. len(b) > 1) then
                  if (verify(b(2:2), digits) == 0) call note(found%zero, i)
               end if
            end associate
         end if
         if (.not. decimal) then
            call note(found%other_comma, i)
            return
         end if
         call note(found%comma, i)
         if (before > first) then
            if (text(before - 1:before - 1) == ',') call note(found%chained, i)
         end if
         if (behind < last) then
            if (text(behind + 1:behind + 1) == ',') call note(found%chained, i)
         end if
      end subroutine note_comma

      !> Last position of the word that begins at a place; the place before it when there is none.
      integer function word_end(at)
         integer, intent(in) :: at
         word_end = scan(text(at:last), blanks//',;')
         word_end = merge(last, at + word_end - 2, word_end == 0)
      end function word_end

   end subroutine scan_row

   !> Keep the first place.
   pure subroutine note(kept, place)
      integer, intent(inout) :: kept
      integer, intent(in) :: place
      if (kept == 0) kept = place
   end subroutine note

   !> Number of names between the commas, semicolons or tabs of a header; 0 where it has none of them.
   pure integer function count_names(text)
      character(len=*), intent(in) :: text
      integer :: i
      count_names = count([(scan(text(i:i), ',;'//tab) > 0, i=1, len(text))])
      if (count_names > 0) count_names = count_names + 1
   end function count_names

end module rockdda_io_separators
