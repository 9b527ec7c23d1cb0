! SPDX-License-Identifier: MIT
!> Records of ground motion in text files: tables with a time in the first column, and files of the PEER database (AT2).
!> The program and the Python package read them here.
!>
!> Files of the PEER database (AT2): lines of text, of which one names quantity and unit of the values, number of values
!> (NPTS) and step in time (DT), in one line or two, then the values one after another.
module rockdda_io_record_file
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : counted, lower_case, to_string, replaced
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_base_sorting, only : sorted_order
   use rockdda_base_numbers, only : parse_number, number_status, is_whole
   use rockdda_io_row_reader, only : decimal_comma, take_number
   use rockdda_io_separators, only : settle_separators
   use rockdda_io_source, only : source_type, read_source
   use rockdda_base_suggest, only : did_you_mean
   use rockdda_io_tokens, only : token_list_type, token_kind, tokenise
   implicit none
   private
   public :: read_record

   character(len=*), parameter :: known_units = 'g, m/s2, cm/s2 (gal), mm/s2, ft/s2, in/s2'

   !> Reading stops after this number of messages.
   integer, parameter :: most_errors = 1000
   !> Longest name of a column.
   integer, parameter :: name_length = 80
   !> Fewest rows whose steps are expected to be equal.
   integer, parameter :: fewest_samples = 20

   !> Names and units of the columns in a header.
   type :: header_type
      character(len=name_length), allocatable :: names(:)   !! lower case, without quotes
      logical :: is_sure = .false.                          !! separators show where each name ends
   contains
      procedure :: bare_name
      procedure :: unit_of
   end type header_type

   !> Number of first lines that hold NPTS and DT.
   integer, parameter :: head_lines = 10
   character(len=*), parameter :: letters = 'abcdefghijklmnopqrstuvwxyz'

   !> What the lines before the values say.
   type :: head_type
      integer :: last = 0           !! line of NPTS and DT, or of the latter of them
      real(wp) :: n = -1            !! number of values, < 0: not found
      real(wp) :: dt = -1           !! step [s], < 0: not found
      integer :: places(2) = 0      !! lines that name n and dt
   end type head_type

contains

   !> Read a record. A problem becomes an error in `messages`, at its place; `rows` is then not complete.
   subroutine read_record(path, form, column, has_scale, rows, unit, messages)
      character(len=*), intent(in) :: path
      character(len=*), intent(in) :: form              !! 'csv' | 'at2'
      character(len=*), intent(in) :: column            !! of a table: name or number; empty: the second
      logical, intent(in) :: has_scale                  !! a factor for the values is given: their unit does not matter
      real(wp), allocatable, intent(out) :: rows(:, :)  !! (2, n) time and value, times not decreasing
      real(wp), intent(out) :: unit                     !! of the values [m/s^2], 0: not known
      type(diagnostics_type), intent(inout) :: messages
      type(source_type) :: source
      type(token_list_type) :: tokens
      integer, allocatable :: places(:)                 !! token of each time
      integer :: before
      logical :: ok
      allocate (rows(2, 0))
      unit = 0
      before = messages%n_errors
      call read_source(path, source, messages, ok)
      if (.not. ok) return
      if (form == 'at2') then
         call tokenise(source, tokens)
         call read_peer()
      else
         call refuse_peer()
         if (ok) call settle_separators(source, 2, 1, messages, ok)
         if (.not. ok) return
         call tokenise(source, tokens)
         call read_table(places)
      end if
      if (messages%n_errors > before) return
      if (size(rows, 2) < 2) then
         call messages%add(severity%error, 'a record needs at least two rows', tokens%end_origin())
      else if (.not. rows(1, size(rows, 2)) > rows(1, 1)) then
         call messages%add(severity%error, 'all rows of the record have the same time', tokens%end_origin())
      else if (allocated(places)) then
         call check_sampling(rows(1, :))
      end if

   contains

      !> Refuse a file of the PEER database as a table: its first lines have the number of points.
      subroutine refuse_peer()
         integer, parameter :: lines_of_head = 5
         integer :: line, at
         ok = .true.
         do line = 1, min(lines_of_head, source%n_lines)
            at = index(lower_case(source%line_text(line)), 'npts')
            if (at == 0) cycle
            ok = .false.
            call messages%add(severity%error, "this is a file of the PEER database (AT2), and no table: give "// &
                              "format = 'at2', or name it .at2", source%origin(line, at))
            return
         end do
      end subroutine refuse_peer

      !> A table: an optional header, then a row of numbers on each line.
      subroutine read_table(places)
         integer, allocatable, intent(out) :: places(:)
         real(wp) :: seconds
         type(header_type) :: header
         integer :: i, n, last, wanted, n_columns
         logical :: ok
         i = 1
         call find_column(i, header, wanted)
         if (wanted == 0) return
         call find_units(header, wanted, seconds)
         deallocate (rows)
         allocate (rows(2, tokens%n - i + 1), places(tokens%n - i + 1))   ! as many lines as there can be
         n = 0
         n_columns = 0
         do while (i <= tokens%n)
            if (messages%n_errors > most_errors) exit
            last = i
            do while (last < tokens%n)
               if (tokens%line(last + 1) /= tokens%line(i)) exit
               last = last + 1
            end do
            n = n + 1
            places(n) = i
            if (n == 1) then
               n_columns = last - i + 1
               if (header%is_sure .and. size(header%names) /= n_columns) &
                  call messages%add(severity%error, 'the header has '//counted(size(header%names), 'name')// &
                                    ', this row '//counted(n_columns, 'number')//decimal_comma(tokens, i, last)// &
                                    ' (a title begins with #)', tokens%origin(last))
            end if
            if (last - i + 1 < wanted) then
               call messages%add(severity%error, 'row '//to_string(n)//': expected at least '//to_string(wanted)// &
                                 ' numbers on this line, found '//to_string(last - i + 1), tokens%origin(last))
               if (n == 1) then
                  rows = rows(:, 1:0)
                  return
               end if
            else if (last - i + 1 /= n_columns) then
               call messages%add(severity%error, 'row '//to_string(n)//': expected '//to_string(n_columns)// &
                                 ' numbers on this line, as in the first row, found '//to_string(last - i + 1)// &
                                 decimal_comma(tokens, i, last), tokens%origin(last))
            end if
            call take_number(tokens, i, 'time of row '//to_string(n), rows(1, n), ok, messages)
            rows(1, n) = seconds*rows(1, n)
            if (last - i + 1 >= wanted) &
               call take_number(tokens, i + wanted - 1, 'value of row '//to_string(n), rows(2, n), ok, messages)
            if (n > 1) then
               if (rows(1, n) < rows(1, n - 1)) call messages%add(severity%error, 'time of row '//to_string(n)// &
                  ": must not be smaller than in the row before, found '"//tokens%text(i)//"'", tokens%origin(i))
            end if
            i = last + 1
         end do
         rows = rows(:, 1:n)
         if (n == 0) call messages%add(severity%error, 'the record has no rows', tokens%end_origin())
      end subroutine read_table

      !> Warn of a record of equal steps that misses some of them or lists a time twice.
      subroutine check_sampling(time)
         real(wp), intent(in) :: time(:)
         character(len=:), allocatable :: more
         real(wp), allocatable :: steps(:)
         integer, allocatable :: order(:)
         real(wp) :: usual
         integer :: k, n, n_others
         n = size(time)
         if (n < fewest_samples) return
         steps = time(2:) - time(:n - 1)
         order = sorted_order(steps)
         usual = steps(order(n/2))
         n_others = count(abs(steps - usual) > 0.1_wp*usual)
         if (n_others == 0 .or. 10*n_others > n) return
         k = 1
         do while (abs(steps(k) - usual) <= 0.1_wp*usual)
            k = k + 1
         end do
         more = ''
         if (n_others > 1) more = ' (nor in '//counted(n_others - 1, 'row')//' more)'
         call messages%add(severity%warning, 'the rows are '//to_string(usual, 4)//' apart, but not this one'//more// &
                           ', which follows '//to_string(steps(k), 4)//' after the one before: are rows missing or '// &
                           'there twice? In between the record is a straight line', tokens%origin(places(k + 1)))
      end subroutine check_sampling

      !> Number of the column of the values, 0 on error; `i` becomes the first token behind the header.
      subroutine find_column(i, header, wanted)
         integer, intent(inout) :: i
         type(header_type), intent(out) :: header
         integer, intent(out) :: wanted
         integer :: k, status
         real(wp) :: number
         wanted = 2
         allocate (header%names(0))
         if (tokens%n > 0) then
            if (tokens%kind(1) == token_kind%text .and. .not. tokens%is_not_finite(1)) then
               call split_header(source%line_text(tokens%line(1)), header)
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
            if (wanted == 0) call messages%add(severity%error, "column '"//column// &
                                               "' is not possible: the first one "// &
                                               'holds the time, expected a number from 2', first_place(tokens))
            return
         end if
         wanted = 0
         associate (names => header%names)
            do k = size(names), 2, -1
               if (names(k) == lower_case(column) .or. header%bare_name(k) == lower_case(column)) wanted = k
            end do
            if (wanted > 0) return
            if (size(names) == 0) then
               call messages%add(severity%error, "column '"//column// &
                                 "' has a name, but this file has no header with "//'names: give its number', &
                                 first_place(tokens))
            else
               call messages%add(severity%error, "no column '"//column//"' in the header"// &
                                 did_you_mean(lower_case(column), names(min(2, size(names)):)), first_place(tokens))
            end if
         end associate
      end subroutine find_column

      !> Find the units of times and values that the header names, that of the values also in comments before them.
      subroutine find_units(header, wanted, seconds)
         type(header_type), intent(in) :: header
         integer, intent(in) :: wanted            !! column of the values
         real(wp), intent(out) :: seconds         !! of the unit of the times
         character(len=:), allocatable :: word
         integer :: k
         seconds = 1
         unit = unit_of_comments(tokens)
         if (size(header%names) == 0) return
         do k = 2, size(header%names)
            if (is_time(header%bare_name(k)) .and. .not. is_time(header%bare_name(1))) &
               call messages%add(severity%error, 'the header names the time in column '//to_string(k)// &
               ': expected it in the first one', first_place(tokens))
         end do
         word = header%unit_of(1)
         if (len(word) > 0) then
            seconds = time_unit(word)
            if (.not. seconds > 0) call messages%add(severity%error, "the header names '"//word//"' as unit of the "// &
               'times: expected s, ms or min', first_place(tokens))
         end if
         if (size(header%names) < wanted) return
         word = header%unit_of(wanted)
         if (index(header%names(wanted), 'vel') == 1 .or. index(header%names(wanted), 'disp') == 1 .or. &
             is_of_other_quantity(word)) then
            call messages%add(severity%error, "column '"//trim(header%names(wanted))// &
                              "' is no acceleration: expected "// &
                              'a column of accelerations (name or number in column)', first_place(tokens))
         else if (len(word) > 0) then
            unit = acceleration_unit(word)
            if (.not. (unit > 0 .or. has_scale)) call messages%add(severity%error, "the header names '"//word// &
               "' as unit of column '"//trim(header%bare_name(wanted))//"': expected one of "//known_units// &
               ', or scale, the factor of the values', first_place(tokens))
         end if
      end subroutine find_units

      !> Read the values; `rows` is complete when no error was added.
      subroutine read_peer()
         type(head_type) :: head
         real(wp) :: number
         integer :: first, i, k, n
         logical :: ok
         unit = 0
         call find_head(head, ok)
         if (.not. ok) return
         call find_unit(head%last)
         n = nint(head%n)
         first = tokens%n + 1
         do i = tokens%n, 1, -1
            if (tokens%line(i) <= head%last) exit
            first = i
         end do
         k = tokens%n - first + 1
         if (k > n) then
            call messages%add(severity%error, 'the file has more than the '//counted(n, 'value')//' of NPTS'// &
                              decimal_comma(tokens, first, tokens%n), tokens%origin(first + n))
            return
         else if (k < n) then
            do i = first, tokens%n
               call take_number(tokens, i, 'value '//to_string(i - first + 1), number, ok, messages)
               if (.not. ok) return
            end do
            call messages%add(severity%error, 'the file ends after '//counted(k, 'value')//', NPTS is '//to_string(n), &
                              tokens%end_origin())
            return
         end if
         deallocate (rows)
         allocate (rows(2, n))
         do k = 1, n
            if (messages%n_errors > most_errors) return
            rows(1, k) = (k - 1)*head%dt
            call take_number(tokens, first + k - 1, 'value '//to_string(k), rows(2, k), ok, messages)
         end do
      end subroutine read_peer

      !> Find NPTS and DT: "NPTS= 4000, DT= .0050 SEC", in any order, on two lines, or "4000 0.0050 NPTS, DT".
      subroutine find_head(head, ok)
         type(head_type), intent(out) :: head
         logical, intent(out) :: ok
         integer :: line
         ok = .true.
         do line = 1, min(head_lines, source%n_lines)
            call read_line(source, line, head, ok, messages)
            if (.not. ok) return
            if (all(head%places > 0)) exit
         end do
         ok = .false.
         if (all(head%places == 0)) then
            call messages%add(severity%error, "this is no file of PEER (AT2): expected a line such as 'NPTS= 4000, "// &
                              "DT= .005 SEC' among the first "//to_string(head_lines), source%origin(1, 1))
         else if (head%places(1) == 0) then
            call messages%add(severity%error, 'expected the number of values too (NPTS= 4000), here or in the '// &
                              'first '//counted(head_lines, 'line'), source%origin(head%places(2), 1))
         else if (head%places(2) == 0) then
            call messages%add(severity%error, 'expected the step in time too (DT= .005 SEC), here or in the first '// &
                              counted(head_lines, 'line'), source%origin(head%places(1), 1))
         else if (.not. (is_whole(head%n) .and. head%n >= 1)) then
            call messages%add(severity%error, 'expected the number of values (NPTS) on this line, a whole number', &
                              source%origin(head%places(1), 1))
         else if (.not. (head%dt > 0 .and. head%dt <= 1.0e10_wp)) then
            call messages%add(severity%error, 'expected the step in time (DT), greater than 0, on this line', &
                              source%origin(head%places(2), 1))
         else
            ok = .true.
            head%last = maxval(head%places)
         end if
      end subroutine find_head

      !> Find the unit of the values: "ACCELERATION TIME SERIES IN UNITS OF CM/S/S"; g where no line names one.
      subroutine find_unit(head)
         integer, intent(in) :: head              !! number of lines before the values
         character(len=:), allocatable :: text, word
         integer :: line, at
         unit = 0
         do line = 1, head
            text = lower_case(source%line_text(line))
            text = trim(adjustl(text))
            at = index(text, 'units of ')
            if (at == 0 .and. .not. any([index(text, 'accel'), index(text, 'veloc'), index(text, 'displ')] == 1)) cycle
            word = ''
            if (at > 0) then
               word = text(at + 9:)
            else if (scan(text, '([') > 0 .and. scan(text, ')]', back=.true.) > scan(text, '([')) then
               word = text(scan(text, '([') + 1:scan(text, ')]', back=.true.) - 1)
            else if (index(text, ' in ') > 0) then
               word = text(index(text, ' in ') + 4:)
            end if
            word = trim(adjustl(word))
            unit = acceleration_unit(word)
            if (.not. unit > 0) then      ! words follow it
               if (scan(word, ',;:( ') > 1) word = word(:scan(word, ',;:( ') - 1)
               unit = acceleration_unit(word)
            end if
            if (index(text, 'veloc') > 0 .or. index(text, 'displ') > 0 .or. is_of_other_quantity(word)) then
               call messages%add(severity%error, 'this is a record of velocities or displacements: expected one of '// &
                                 'accelerations (at PEER the file that ends in .AT2)', source%origin(line, 1))
               return
            else if (at > 0 .and. .not. unit > 0 .and. .not. has_scale) then
               call messages%add(severity%error, "the values are in '"//word//"': expected one of "//known_units// &
                                 ', or scale, the factor of the values', source%origin(line, 1))
               return
            end if
            if (unit > 0) return
         end do
         if (has_scale) return
         unit = acceleration_unit('g')
         call messages%add(severity%warning, 'no line before the values names their unit; they are taken as in g '// &
                           '(give scale, the factor of the values, where they are not)', source%origin(1, 1))
      end subroutine find_unit

   end subroutine read_record

   !> Is this the name of a column of times?
   pure logical function is_time(name)
      character(len=*), intent(in) :: name
      is_time = name == 't' .or. name == 'time'
   end function is_time

   !> Where the table begins.
   type(origin_type) function first_place(tokens)
      type(token_list_type), intent(in) :: tokens
      first_place = tokens%end_origin()
      if (tokens%n > 0) first_place = tokens%origin(1)
   end function first_place

   !> Names of a header: between commas where there are any, else between tabs, else between blanks.
   pure subroutine split_header(line, header)
      character(len=*), intent(in) :: line
      type(header_type), intent(inout) :: header
      character(len=:), allocatable :: name
      integer :: i, start, n
      character :: separator
      separator = ' '
      if (index(trim(adjustl(line)), achar(9)) > 0) separator = achar(9)
      if (index(line, ',') > 0) separator = ','
      header%is_sure = separator /= ' '
      start = 1
      do i = 1, len(line) + 1
         if (i <= len(line)) then
            if (line(i:i) /= separator) cycle
         end if
         name = lower_case(trim(adjustl(line(start:i - 1))))
         start = i + 1
         if (len(name) >= 2) then
            if (name(1:1) == '"' .and. name(len(name):) == '"') name = name(2:len(name) - 1)
         end if
         n = size(header%names)
         if (separator == ' ' .and. len(name) == 0) cycle
         if (separator == ' ' .and. n > 0 .and. scan(name(1:1), '([') > 0) then
            header%names(n) = trim(header%names(n))//' '//name
         else
            header%names = [character(len=name_length) :: header%names, name]
         end if
      end do
      ! a separator at the end is that of empty cells
      do n = size(header%names), 1, -1
         if (len_trim(header%names(n)) > 0) exit
      end do
      header%names = header%names(:n)
   end subroutine split_header

   !> Name of a column without its unit.
   pure function bare_name(self, k) result(name)
      class(header_type), intent(in) :: self
      integer, intent(in) :: k
      character(len=:), allocatable :: name, unit
      call split_name(trim(self%names(k)), name, unit)
   end function bare_name

   !> Unit behind the name of a column; empty: none, or a dash.
   pure function unit_of(self, k) result(unit)
      class(header_type), intent(in) :: self
      integer, intent(in) :: k
      character(len=:), allocatable :: name, unit
      call split_name(trim(self%names(k)), name, unit)
   end function unit_of

   !> Part a name from its unit: in brackets "a [g]", or a known one as in "acceleration in g", "acc_g", "time_s". Not
   !> "a_g", the usual symbol of the acceleration of the ground.
   pure subroutine split_name(text, name, unit)
      character(len=*), intent(in) :: text
      character(len=:), allocatable, intent(out) :: name
      character(len=:), allocatable, intent(out) :: unit
      integer :: first, last
      name = text
      unit = ''
      first = scan(text, '([', back=.true.)
      last = scan(text, ')]', back=.true.)
      if (first > 0) then
         if (last > first + 1) unit = trim(adjustl(text(first + 1:last - 1)))
         if (unit == '-') unit = ''
         if (scan(text, '([') > 1) name = trim(text(:scan(text, '([') - 1))
         return
      end if
      first = index(text, ' in ', back=.true.)
      if (first > 0) then
         unit = trim(adjustl(text(first + 4:)))
         if (max(acceleration_unit(unit), time_unit(unit)) > 0 .or. is_of_other_quantity(unit)) then
            name = trim(text(:first))
            return
         end if
         unit = ''
      end if
      first = scan(text, '_ ', back=.true.)
      if (first < 2) return
      if (index(text, 'acc') == 1 .and. acceleration_unit(text(first + 1:)) > 0 .or. &
          is_time(trim(text(:first - 1))) .and. time_unit(text(first + 1:)) > 0) then
         name = trim(text(:first - 1))
         unit = text(first + 1:)
      end if
   end subroutine split_name

   !> Unit of acceleration [m/s^2] that a comment before the first number names, "# units: g"; 0: none.
   pure real(wp) function unit_of_comments(tokens) result(unit)
      type(token_list_type), intent(in) :: tokens
      character(len=:), allocatable :: text
      integer :: i, line, at
      unit = 0
      do i = 1, tokens%n - 1
         if (tokens%kind(i) == token_kind%number) exit
      end do
      if (tokens%n == 0) return
      do line = 1, tokens%line(i)
         text = lower_case(tokens%source%line_text(line))
         at = scan(text, '#!')
         if (at == 0) cycle
         text = text(at:)
         at = index(text, 'unit')
         if (at == 0) cycle
         text = text(at + 4:)
         at = scan(text, ':=')
         if (at == 0) cycle
         if (verify(text(:at - 1), 's ') > 0) cycle
         unit = acceleration_unit(text(at + 1:))
         if (unit > 0) return
      end do
   end function unit_of_comments

   !> Take NPTS and DT from a line that has one of them or both.
   subroutine read_line(source, line, head, ok, messages)
      type(source_type), intent(in) :: source
      integer, intent(in) :: line
      type(head_type), intent(inout) :: head
      logical, intent(out) :: ok
      type(diagnostics_type), intent(inout) :: messages
      character(len=:), allocatable :: text
      real(wp) :: numbers(2)                !! before the names
      real(wp) :: value
      integer :: names(2)                   !! 1: NPTS, 2: DT, in the order of the line
      integer :: first, last, last_digit, n_numbers, n_names, k
      logical :: sets, behind
      ok = .true.
      text = lower_case(source%line_text(line))
      n_numbers = 0
      n_names = 0
      behind = .false.                      ! a number behind its name
      k = 0                                 ! name that waits for its number
      sets = scan(text, '=:') > 0
      last = 0
      do
         first = verify(text(last + 1:), ' ,=:;'//achar(9))
         if (first == 0) exit
         first = last + first
         last = scan(text(first:), ' ,=:;'//achar(9))
         last = merge(len(text), first + last - 2, last == 0)
         associate (word => text(first:last))
            if (word == 'npts' .or. word == 'dt') then
               k = merge(1, 2, word == 'npts')
               if (n_names == 2) return
               n_names = n_names + 1
               names(n_names) = k
               cycle
            end if
            last_digit = verify(word, letters, back=.true.)
            if (last_digit == 0) cycle
            if (.not. is_number(word(:last_digit), value)) cycle
         end associate
         if (k > 0) then
            behind = .true.
            if (has_comma(first, last)) return
            call set(k, value)
            if (k == 2) call take_unit(first + last_digit)
            k = 0
         else if (n_names == 0 .and. n_numbers < 2) then
            n_numbers = n_numbers + 1
            numbers(n_numbers) = value
         end if
      end do
      if (n_names == 0) return
      if (.not. behind .and. n_names == 2 .and. n_numbers == 2) then
         call set(names(1), numbers(1))
         call set(names(2), numbers(2))
      else if (n_names == 2 .or. sets) then
         do k = 1, n_names
            if (head%places(names(k)) == 0) head%places(names(k)) = line
         end do
      end if

   contains

      !> Keep a number, unless this is a line of text with such a word.
      subroutine set(name, number)
         integer, intent(in) :: name
         real(wp), intent(in) :: number
         if (.not. sets .and. n_names < 2 .and. index(text, 'npts') == 0) return
         head%places(name) = line
         if (name == 1) head%n = number
         if (name == 2) head%dt = number
      end subroutine set

      !> Is there a decimal comma in a number? Reports it.
      logical function has_comma(a, b)
         integer, intent(in) :: a, b
         has_comma = .false.
         if (b + 1 >= len(text)) return
         has_comma = text(b + 1:b + 1) == ',' .and. verify(text(b + 2:b + 2), '0123456789') == 0
         if (.not. has_comma) return
         ok = .false.
         call messages%add(severity%error, "expected a number with a decimal point, found '"//text(a:b + 2)//"'", &
                           source%origin(line, a))
      end function has_comma

      !> Take the unit of the step, which follows it: seconds where there is none.
      subroutine take_unit(at)
         integer, intent(in) :: at          !! behind the digits
         integer :: a, b
         a = at - 1 + verify(text(at:)//'x', ' '//achar(9))
         if (a > len(text)) return
         b = a - 1 + verify(text(a:)//' ', letters) - 1
         if (b < a) return
         if (text(a:b) == 'npts') return
         if (time_unit(text(a:b)) > 0) then
            head%dt = time_unit(text(a:b))*head%dt
         else
            ok = .false.
            call messages%add(severity%error, "expected s, ms or min as unit of the step in time, found '"// &
                              text(a:b)//"'", source%origin(line, a))
         end if
      end subroutine take_unit

   end subroutine read_line

   !> Is this text a number?
   logical function is_number(text, value)
      character(len=*), intent(in) :: text
      real(wp), intent(out) :: value
      integer :: status
      call parse_number(text, value, status)
      is_number = status == number_status%ok
   end function is_number

   !> A unit of acceleration in m/s², 0: it is none.
   pure real(wp) function acceleration_unit(text) result(metres)
      character(len=*), intent(in) :: text
      select case (plain(text))
      case ('g', "g's", 'gs'); metres = 9.81_wp
      case ('m/s2', 'm/s/s', 'ms-2'); metres = 1.0_wp
      case ('cm/s2', 'cm/s/s', 'cms-2', 'gal', 'gals'); metres = 0.01_wp
      case ('mm/s2', 'mm/s/s', 'mms-2'); metres = 0.001_wp
      case ('ft/s2', 'ft/s/s'); metres = 0.3048_wp
      case ('in/s2', 'in/s/s'); metres = 0.0254_wp
      case default; metres = 0.0_wp
      end select
   end function acceleration_unit

   !> A unit of time in seconds, 0: it is none.
   pure real(wp) function time_unit(text) result(seconds)
      character(len=*), intent(in) :: text
      select case (plain(text))
      case ('s', 'ss', 'second', 'seconds'); seconds = 1.0_wp
      case ('ms', 'msec'); seconds = 0.001_wp
      case ('min', 'minutes'); seconds = 60.0_wp
      case default; seconds = 0.0_wp
      end select
   end function time_unit

   !> Is this a unit of velocity or of length?
   pure logical function is_of_other_quantity(text)
      character(len=*), intent(in) :: text
      select case (plain(text))
      case ('m', 'cm', 'mm', 'ft', 'in', 'm/s', 'cm/s', 'mm/s', 'ft/s', 'in/s'); is_of_other_quantity = .true.
      case default; is_of_other_quantity = .false.
      end select
   end function is_of_other_quantity

   !> The text in one spelling: "CM/SEC**2." is cm/s2.
   pure function plain(text) result(word)
      character(len=*), intent(in) :: text
      character(len=:), allocatable :: word
      character(len=*), parameter :: square_utf_8 = char(194)//char(178), square_latin_1 = char(178)
      word = lower_case(text)
      word = replaced(word, square_utf_8, '2')
      word = replaced(word, square_latin_1, '2')
      word = replaced(word, 'sec', 's')
      word = replaced(word, ' ', '')
      word = replaced(word, achar(9), '')
      word = replaced(word, '*', '')
      word = replaced(word, '^', '')
      word = replaced(word, '.', '')
      word = replaced(word, ',', '')
   end function plain

end module rockdda_io_record_file
