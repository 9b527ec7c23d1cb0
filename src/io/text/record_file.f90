! SPDX-License-Identifier: MIT
!> Records of ground motion in text files: tables with a time in the first column, and files of the PEER database (AT2).
module rockdda_io_record_file
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : lower_case, to_string
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_io_numbers, only : parse_number, number_status, is_whole
   use rockdda_io_row_reader, only : semicolon_hint
   use rockdda_io_source, only : source_type, read_source
   use rockdda_io_suggest, only : did_you_mean
   use rockdda_io_tokens, only : token_list_type, token_kind, tokenise
   implicit none
   private
   public :: read_record

   !> Largest value accepted.
   real(wp), parameter :: largest_value = 1.0e60_wp
   !> Reading stops after this number of messages.
   integer, parameter :: most_errors = 1000
   !> The line with NPTS and DT is among the first so many lines of a file of PEER.
   integer, parameter :: head_lines = 10
   !> Longest name of a column.
   integer, parameter :: name_length = 80

contains

   !> Read a record. A problem becomes an error in `messages`, at its place; `rows` is then not complete.
   subroutine read_record(path, form, column, rows, messages)
      character(len=*), intent(in) :: path
      character(len=*), intent(in) :: form              !! 'csv' | 'at2'
      character(len=*), intent(in) :: column            !! of a table: name or number; empty: the second
      real(wp), allocatable, intent(out) :: rows(:, :)  !! (2, n) time and value, times not decreasing
      type(diagnostics_type), intent(inout) :: messages
      type(source_type) :: source
      type(token_list_type) :: tokens
      logical :: ok
      allocate (rows(2, 0))
      call read_source(path, source, messages, ok)
      if (.not. ok) return
      call tokenise(source, tokens)
      if (form == 'at2') then
         call read_peer(source, tokens, rows, messages)
      else
         call read_table(source, tokens, column, rows, messages)
      end if
   end subroutine read_record

   !> A table: an optional header, then a row of numbers on each line.
   subroutine read_table(source, tokens, column, rows, messages)
      type(source_type), intent(in) :: source
      type(token_list_type), intent(in) :: tokens
      character(len=*), intent(in) :: column
      real(wp), allocatable, intent(inout) :: rows(:, :)
      type(diagnostics_type), intent(inout) :: messages
      integer :: i, n, last, wanted, n_columns, at(2)
      logical :: ok
      i = 1
      call find_column(source, tokens, column, i, wanted, messages)
      if (wanted == 0) return
      deallocate (rows)
      allocate (rows(2, tokens%n - i + 1))   ! as many lines as there can be
      n = 0
      n_columns = 0
      do while (i <= tokens%n)
         if (messages%n_errors > most_errors) exit
         last = i
         do while (last < tokens%n)
            if (tokens%line(last + 1) /= tokens%line(i)) exit
            last = last + 1
         end do
         if (n_columns == 0) n_columns = last - i + 1
         n = n + 1
         at = [i, min(i + wanted - 1, last)]
         if (last - i + 1 < wanted) then
            call messages%add(severity%error, 'row '//to_string(n)//': expected at least '//to_string(wanted)// &
                              ' numbers on this line, found '//to_string(last - i + 1)// &
                              semicolon_hint(tokens, i, last), tokens%origin(last))
            if (n == 1) then
               rows = rows(:, 1:0)
               return
            end if
         else if (last - i + 1 /= n_columns) then
            call messages%add(severity%error, 'row '//to_string(n)//': expected '//to_string(n_columns)// &
                              ' numbers on this line, as in the first row, found '//to_string(last - i + 1), &
                              tokens%origin(last))
         end if
         call take(tokens, at(1), 'time of row '//to_string(n), rows(1, n), ok, messages)
         if (last - i + 1 >= wanted) &
            call take(tokens, at(2), 'value of row '//to_string(n), rows(2, n), ok, messages)
         if (n > 1) then
            if (rows(1, n) < rows(1, n - 1)) call messages%add(severity%error, 'time of row '//to_string(n)// &
               ": must not be smaller than in the row before, found '"//tokens%text(i)//"'", tokens%origin(i))
         end if
         i = last + 1
      end do
      rows = rows(:, 1:n)
      if (n == 0) call messages%add(severity%error, 'the record has no rows', tokens%end_origin())
   end subroutine read_table

   !> A number of the table.
   subroutine take(tokens, i, what, value, ok, messages)
      type(token_list_type), intent(in) :: tokens
      integer, intent(in) :: i
      character(len=*), intent(in) :: what
      real(wp), intent(out) :: value
      logical, intent(out) :: ok
      type(diagnostics_type), intent(inout) :: messages
      value = 0
      ok = tokens%kind(i) == token_kind%number
      if (.not. ok) then
         call messages%add(severity%error, what//": expected a number, found '"//tokens%text(i)//"'", tokens%origin(i))
         return
      end if
      ok = abs(tokens%value(i)) <= largest_value
      if (ok) then
         value = tokens%value(i)
      else
         call messages%add(severity%error, what//': must not be larger than '//to_string(largest_value)// &
                           ", found '"//tokens%text(i)//"'", tokens%origin(i))
      end if
   end subroutine take

   !> Number of the column of the values, 0 on error; `i` becomes the first token behind the header.
   subroutine find_column(source, tokens, column, i, wanted, messages)
      type(source_type), intent(in) :: source
      type(token_list_type), intent(in) :: tokens
      character(len=*), intent(in) :: column
      integer, intent(inout) :: i
      integer, intent(out) :: wanted
      type(diagnostics_type), intent(inout) :: messages
      character(len=name_length), allocatable :: names(:)
      integer :: k, status
      real(wp) :: number
      wanted = 2
      allocate (names(0))
      if (tokens%n > 0) then
         if (tokens%kind(1) == token_kind%text .and. .not. tokens%is_not_finite(1)) then
            call split_header(source, tokens%line(1), names)
            do while (i <= tokens%n)
               if (tokens%line(i) /= tokens%line(1)) exit
               i = i + 1
            end do
         end if
      end if
      if (len(column) == 0) return
      call parse_number(column, number, status)
      if (status == number_status%ok) then
         wanted = 0
         if (is_whole(number) .and. number >= 2 .and. number < 1.0e6_wp) wanted = nint(number)
         if (wanted == 0) call messages%add(severity%error, "column '"//column//"' is not possible: the first one "// &
                                            'holds the time, expected a number from 2', first_place())
         return
      end if
      wanted = 0
      do k = 2, size(names)
         if (names(k) == lower_case(column)) wanted = k
      end do
      if (wanted > 0) return
      if (size(names) == 0) then
         call messages%add(severity%error, "column '"//column//"' has a name, but this file has no header with "// &
                           'names: give its number', first_place())
      else
         call messages%add(severity%error, "no column '"//column//"' in the header"// &
                           did_you_mean(lower_case(column), names(min(2, size(names)):)), first_place())
      end if

   contains

      !> Where the table begins.
      pure type(origin_type) function first_place()
         first_place = tokens%end_origin()
         if (tokens%n > 0) first_place = tokens%origin(1)
      end function first_place

   end subroutine find_column

   !> Names of a header: between commas where there are any, else between blanks; lower case, without quotes.
   pure subroutine split_header(source, line, names)
      type(source_type), intent(in) :: source
      integer, intent(in) :: line
      character(len=name_length), allocatable, intent(out) :: names(:)
      character(len=:), allocatable :: text, name
      integer :: i, start
      character :: separator
      text = line_text(source, line)
      do i = 1, len(text)
         if (text(i:i) == achar(9)) text(i:i) = ' '
      end do
      separator = merge(',', ' ', index(text, ',') > 0)
      allocate (names(0))
      start = 1
      do i = 1, len(text) + 1
         if (i <= len(text)) then
            if (text(i:i) /= separator) cycle
         end if
         name = lower_case(trim(adjustl(text(start:i - 1))))
         start = i + 1
         if (len(name) >= 2) then
            if (name(1:1) == '"' .and. name(len(name):) == '"') name = name(2:len(name) - 1)
         end if
         if (len(name) == 0 .and. separator == ' ') cycle
         names = [character(len=name_length) :: names, name]
      end do
   end subroutine split_header

   !> Text of a line without its end.
   pure function line_text(source, line) result(text)
      type(source_type), intent(in) :: source
      integer, intent(in) :: line
      character(len=:), allocatable :: text
      integer :: last
      last = len(source%text)
      if (line < size(source%line_start)) last = source%line_start(line + 1) - 2
      text = source%text(source%line_start(line):last)
      if (len(text) > 0) then
         if (text(len(text):) == achar(13)) text = text(:len(text) - 1)
      end if
   end function line_text

   !> A file of PEER: lines of text, one with NPTS and DT, and the values one after another.
   subroutine read_peer(source, tokens, rows, messages)
      type(source_type), intent(in) :: source
      type(token_list_type), intent(in) :: tokens
      real(wp), allocatable, intent(inout) :: rows(:, :)
      type(diagnostics_type), intent(inout) :: messages
      real(wp) :: dt
      integer :: head, i, k, n
      logical :: ok
      call find_head(source, head, n, dt, messages)
      if (head == 0) return
      deallocate (rows)
      allocate (rows(2, n))
      k = 0
      do i = 1, tokens%n
         if (tokens%line(i) <= head) cycle
         k = k + 1
         if (k > n) then
            call messages%add(severity%error, 'the file has more than the '//counted_values(n)//' of NPTS', &
                              tokens%origin(i))
            return
         end if
         if (messages%n_errors > most_errors) return
         rows(1, k) = (k - 1)*dt
         call take(tokens, i, 'value '//to_string(k), rows(2, k), ok, messages)
      end do
      if (k < n) then
         call messages%add(severity%error, 'the file ends after '//counted_values(k)//', NPTS is '//to_string(n), &
                           tokens%end_origin())
         rows = rows(:, 1:k)
      end if
   end subroutine read_peer

   !> "1 value", "4000 values"
   pure function counted_values(n) result(text)
      integer, intent(in) :: n
      character(len=:), allocatable :: text
      text = to_string(n)//trim(merge(' value ', ' values', n == 1))
   end function counted_values

   !> Find the line with NPTS and DT: "NPTS= 4000, DT= .0050 SEC" or "4000 0.0050 NPTS, DT".
   subroutine find_head(source, head, n, dt, messages)
      type(source_type), intent(in) :: source
      integer, intent(out) :: head        !! 0: not found (reported)
      integer, intent(out) :: n
      real(wp), intent(out) :: dt         !! [time]
      type(diagnostics_type), intent(inout) :: messages
      character(len=:), allocatable :: text
      real(wp) :: numbers(2)
      integer :: i, line, found, start, status
      head = 0
      n = 0
      dt = 0
      do line = 1, min(head_lines, source%n_lines)
         text = lower_case(line_text(source, line))
         if (index(text, 'npts') == 0 .or. index(text, 'dt') == 0) cycle
         head = line
         exit
      end do
      if (head == 0) then
         call messages%add(severity%error, "this is no file of PEER (AT2): expected a line such as 'NPTS= 4000, "// &
                           "DT= .005 SEC' among the first "//to_string(head_lines), source%origin(1, 1))
         return
      end if
      found = 0
      numbers = 0
      start = 0
      do i = 1, len(text) + 1
         if (i <= len(text)) then
            if (index(' ,='//achar(9), text(i:i)) == 0) then
               if (start == 0) start = i
               cycle
            end if
         end if
         if (start == 0) cycle
         if (found < 2) then
            call parse_number(text(start:i - 1), numbers(found + 1), status)
            if (status == number_status%ok) found = found + 1
         end if
         start = 0
      end do
      if (found == 2 .and. is_whole(numbers(1)) .and. numbers(1) >= 1 .and. numbers(1) < 1.0e8_wp .and. &
          numbers(2) > 0) then
         n = nint(numbers(1))
         dt = numbers(2)
         return
      end if
      call messages%add(severity%error, 'expected the number of values (NPTS) and the step in time (DT) on this line', &
                        source%origin(head, 1))
      head = 0
   end subroutine find_head

end module rockdda_io_record_file
