! SPDX-License-Identifier: MIT
!> Files of the PEER database (AT2): lines of text, of which one names quantity and unit of the values, number of values
!> (NPTS) and step in time (DT), in one line or two, then the values one after another.
module rockdda_io_peer_record
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : counted, lower_case, to_string
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_io_acceleration_units, only : acceleration_unit, time_unit, is_of_other_quantity, known_units
   use rockdda_base_numbers, only : parse_number, number_status, is_whole
   use rockdda_io_row_reader, only : decimal_comma, take_number
   use rockdda_io_source, only : source_type
   use rockdda_io_tokens, only : token_list_type
   implicit none
   private
   public :: read_peer

   !> Reading stops after this number of messages.
   integer, parameter :: most_errors = 1000
   !> NPTS and DT are in the first so many lines.
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

   !> Read the values; `rows` is complete when no error was added.
   subroutine read_peer(source, tokens, has_scale, rows, unit, messages)
      type(source_type), intent(in) :: source
      type(token_list_type), intent(in) :: tokens
      logical, intent(in) :: has_scale                     !! a factor is given: the unit does not matter
      real(wp), allocatable, intent(inout) :: rows(:, :)   !! (2, n) time and value
      real(wp), intent(out) :: unit                        !! of the values [m/s^2]
      type(diagnostics_type), intent(inout) :: messages
      type(head_type) :: head
      real(wp) :: number
      integer :: first, i, k, n
      logical :: ok
      unit = 0
      call find_head(source, head, ok, messages)
      if (.not. ok) return
      call find_unit(source, head%last, has_scale, unit, messages)
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
   subroutine find_head(source, head, ok, messages)
      type(source_type), intent(in) :: source
      type(head_type), intent(out) :: head
      logical, intent(out) :: ok
      type(diagnostics_type), intent(inout) :: messages
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
         call messages%add(severity%error, 'expected the number of values too (NPTS= 4000), here or in the first '// &
                           counted(head_lines, 'line'), source%origin(head%places(2), 1))
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

   !> Find the unit of the values: "ACCELERATION TIME SERIES IN UNITS OF CM/S/S"; g where no line names one.
   subroutine find_unit(source, head, has_scale, unit, messages)
      type(source_type), intent(in) :: source
      integer, intent(in) :: head              !! the lines before the values are so many
      logical, intent(in) :: has_scale
      real(wp), intent(out) :: unit            !! [m/s^2]
      type(diagnostics_type), intent(inout) :: messages
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

end module rockdda_io_peer_record
