! SPDX-License-Identifier: MIT
!> Syntax of namelist files, with the place of every group, name and value.
!>
!> The namelist read of Fortran reports neither place nor reason of a failure. Groups `&name … /`; entries
!> `name = value, value`; values are numbers, logicals, text in '…' or "…", repeated as 3*1.0; comments start
!> with `!` or `#`. The meaning of the names is defined by the caller.
module rockdda_io_namelist_parser
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : lower_case, to_string
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_base_numbers, only : parse_number, number_status, is_whole
   use rockdda_io_source, only : source_type
   implicit none
   private
   public :: namelist_type, group_type, entry_type, value_kind, parse_namelist, find_entry, beside

   type :: value_kind_enum
      integer :: number = 1
      integer :: logical = 2
      integer :: text = 3     !! in quotes
      integer :: word = 4     !! unquoted text
   end type value_kind_enum
   type(value_kind_enum), parameter :: value_kind = value_kind_enum()

   type :: value_type
      integer :: kind = 0                     !! one of value_kind%...
      real(wp) :: number = 0
      logical :: flag = .false.
      character(len=:), allocatable :: text   !! as written, without quotes
      integer :: place = 0                    !! position in the source's text
   end type value_type

   type :: entry_type
      character(len=:), allocatable :: name   !! lower case
      integer :: place = 0
      integer :: n = 0
      type(value_type), allocatable :: values(:) !! n of them are in use
   end type entry_type

   type :: group_type
      character(len=:), allocatable :: name   !! lower case, without &
      integer :: place = 0
      integer :: n = 0
      type(entry_type), allocatable :: entries(:)
   end type group_type

   type :: namelist_type
      type(source_type) :: source
      integer :: n = 0
      type(group_type), allocatable :: groups(:)
      type(diagnostics_type) :: messages      !! about what was read so far
   contains
      procedure :: origin => origin_of_place
      procedure :: fail
   end type namelist_type

   character(len=*), parameter :: letters = 'abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ'
   character(len=*), parameter :: name_characters = letters//'0123456789_%'
   character(len=*), parameter :: blanks = ' '//achar(9)//achar(10)//achar(11)//achar(12)//achar(13)
   !> Largest repeat count accepted.
   integer, parameter :: largest_repeat = 1000000
   !> Largest number of values of a name.
   integer, parameter :: most_values = 100000
   !> Longest name.
   integer, parameter :: longest_name = 60

contains

   !> Parse a source; valid entries are kept.
   subroutine parse_namelist(source, namelist)
      type(source_type), intent(in) :: source
      type(namelist_type), intent(out) :: namelist     !! with its problems
      integer :: at
      namelist%source = source
      allocate (namelist%groups(8))
      at = 1
      do
         call skip_blanks(source%text, at)
         if (at > len(source%text)) exit
         if (source%text(at:at) == '&' .or. source%text(at:at) == '$') then
            call parse_group(namelist, at)
         else
            call namelist%messages%add(severity%error, "expected a group such as &run, found '"//word_at(source%text, &
                                       at)//"'", namelist%origin(at))
            at = next_group(source%text, at)
         end if
      end do
   end subroutine parse_namelist

   !> Parse a group from its & to its end.
   subroutine parse_group(namelist, at)
      type(namelist_type), intent(inout) :: namelist
      integer, intent(inout) :: at
      type(group_type) :: group
      character(len=:), allocatable :: word
      logical :: closed
      integer :: last
      group%place = at
      allocate (group%entries(8))
      last = name_end(namelist%source%text, at + 1)
      group%name = name_of(namelist%source%text(at + 1:last))
      at = last + 1
      closed = .false.
      associate (text => namelist%source%text)
         do
            call skip_blanks(text, at)
            if (at <= len(text)) then
               if (text(at:at) == ',' .or. text(at:at) == ';') then
                  at = at + 1
                  cycle
               end if
            end if
            if (at > len(text)) exit
            if (text(at:at) == '/') then
               at = at + 1
               closed = .true.
               exit
            else if (text(at:at) == '&' .or. text(at:at) == '$') then
               word = lower_case(text(at + 1:name_end(text, at + 1)))
               if (word == 'end') at = at + 4
               closed = word == 'end'
               exit
            else if (name_end(text, at) < at .or. scan(text(at:at), letters) == 0) then
               call namelist%messages%add(severity%error, "expected a name or '/', found '"//word_at(text, at)//"'", &
                                 namelist%origin(at))
               at = at + len(word_at(text, at))
            else
               call parse_entry(namelist, group, at)
            end if
         end do
      end associate
      if (.not. closed) call namelist%messages%add(severity%error, "group &"//group%name//" is not closed by '/'", &
                                          namelist%origin(group%place))
      call add_group(namelist, group)
   end subroutine parse_group

   !> Parse one `name = values`.
   subroutine parse_entry(namelist, group, at)
      type(namelist_type), intent(inout) :: namelist
      type(group_type), intent(inout) :: group
      integer, intent(inout) :: at
      type(entry_type) :: entry
      type(entry_type), allocatable :: larger(:)
      integer :: last
      last = name_end(namelist%source%text, at)
      entry%name = name_of(namelist%source%text(at:last))
      entry%place = at
      allocate (entry%values(4))
      at = last + 1
      call skip_blanks(namelist%source%text, at)
      if (.not. is_at(namelist%source%text, at, '=')) then
         call namelist%messages%add(severity%error, "expected '=' after '"//entry%name//"'", &
                                    namelist%origin(entry%place))
         return
      end if
      at = at + 1
      call parse_values(namelist, entry, at)
      if (entry%n == 0) call namelist%messages%add(severity%error, entry%name//': expected a value', &
                                          namelist%origin(entry%place))
      if (group%n == size(group%entries)) then
         allocate (larger(2*group%n))
         larger(1:group%n) = group%entries
         call move_alloc(larger, group%entries)
      end if
      group%n = group%n + 1
      group%entries(group%n) = entry
   end subroutine parse_entry

   !> Parse the values behind '=', up to the next name, group or end.
   subroutine parse_values(namelist, entry, at)
      type(namelist_type), intent(inout) :: namelist
      type(entry_type), intent(inout) :: entry
      integer, intent(inout) :: at
      type(value_type) :: value
      integer :: start, last, after, repeat_count, i
      logical :: comma, ok, too_many

      comma = .false.
      too_many = .false.
      associate (text => namelist%source%text)
         do
            call skip_blanks(text, at)
            if (at > len(text)) exit
            if (text(at:at) == ',') then
               if (comma .or. entry%n == 0) call namelist%messages%add(severity%error, entry%name// &
                  ': expected a value before the comma', namelist%origin(at))
               comma = .true.
               at = at + 1
               cycle
            end if
            if (scan(text(at:at), '/&$') > 0) exit
            ! a name and '=' begin the next entry
            last = name_end(text, at)
            if (last >= at .and. scan(text(at:at), letters) > 0) then
               after = last + 1
               call skip_blanks(text, after)
               if (is_at(text, after, '=')) exit
            end if
            start = at
            repeat_count = 1
            last = value_end(text, at)
            i = index(text(at:last), '*')
            if (i > 1) then
               call read_repeat(text(at:at + i - 2), repeat_count, ok)
               if (ok) at = at + i
               if (.not. ok) repeat_count = 1
               if (at > len(text)) exit
            end if
            if (scan(text(at:at), '''"') > 0) then
               call parse_text(namelist, entry%name, at, value)
            else
               last = value_end(text, at)
               if (last < at) then
                  call namelist%messages%add(severity%error, entry%name//": expected a value, found '"//word_at(text, &
                                             at)//"'", namelist%origin(at))
                  at = at + 1
                  cycle
               end if
               call read_word(text(at:last), value)
               at = last + 1
            end if
            value%place = start
            comma = .false.
            if (repeat_count > most_values - entry%n) then
               if (.not. too_many) call namelist%messages%add(severity%error, entry%name//': more than '// &
                  to_string(most_values)//' values', namelist%origin(start))
               too_many = .true.
               if (entry%n == 0) call add_values(entry, value, 1)
            else
               call add_values(entry, value, repeat_count)
            end if
         end do
      end associate
   end subroutine parse_values

   !> Parse text in quotes; a doubled quote is the quote itself.
   subroutine parse_text(namelist, name, at, value)
      type(namelist_type), intent(inout) :: namelist
      character(len=*), intent(in) :: name
      integer, intent(inout) :: at
      type(value_type), intent(out) :: value
      character(len=1) :: quote
      integer :: start
      start = at
      value%kind = value_kind%text
      value%text = ''
      associate (text => namelist%source%text)
         quote = text(at:at)
         at = at + 1
         do
            if (at > len(text)) exit
            if (text(at:at) == achar(10) .or. text(at:at) == achar(13)) exit
            if (text(at:at) == quote) then
               at = at + 1
               if (.not. is_at(text, at, quote)) return
            end if
            value%text = value%text//text(at:at)
            at = at + 1
         end do
      end associate
      call namelist%messages%add(severity%error, name//': the text has no closing quote', namelist%origin(start))
   end subroutine parse_text

   !> Find the kind of an unquoted value: number, logical or word.
   pure subroutine read_word(word, value)
      character(len=*), intent(in) :: word
      type(value_type), intent(out) :: value
      integer :: status
      value%text = word
      call parse_number(word, value%number, status)
      value%kind = value_kind%number
      if (status == number_status%ok) return
      value%kind = value_kind%logical
      select case (lower_case(word))
      case ('t', 'true', '.t.', '.true.')
         value%flag = .true.
      case ('f', 'false', '.f.', '.false.')
         value%flag = .false.
      case default
         value%kind = value_kind%word
      end select
   end subroutine read_word

   !> Read the count of a repeated value.
   pure subroutine read_repeat(text, count, ok)
      character(len=*), intent(in) :: text
      integer, intent(out) :: count
      logical, intent(out) :: ok
      real(wp) :: number
      integer :: status
      count = 1
      ok = verify(text, '0123456789') == 0
      if (.not. ok) return
      call parse_number(text, number, status)
      ok = status == number_status%ok .and. is_whole(number) .and. number >= 1 .and. number <= largest_repeat
      if (ok) count = nint(number)
   end subroutine read_repeat

   !> Append copies of a value.
   subroutine add_values(entry, value, copies)
      type(entry_type), intent(inout) :: entry
      type(value_type), intent(in) :: value
      integer, intent(in) :: copies
      type(value_type), allocatable :: larger(:)
      integer :: i
      if (entry%n + copies > size(entry%values)) then
         allocate (larger(2*(entry%n + copies)))
         larger(1:entry%n) = entry%values(1:entry%n)
         call move_alloc(larger, entry%values)
      end if
      do i = 1, copies
         entry%values(entry%n + i) = value
      end do
      entry%n = entry%n + copies
   end subroutine add_values

   !> Append a group.
   subroutine add_group(namelist, group)
      type(namelist_type), intent(inout) :: namelist
      type(group_type), intent(in) :: group
      type(group_type), allocatable :: larger(:)
      if (namelist%n == size(namelist%groups)) then
         allocate (larger(2*namelist%n))
         larger(1:namelist%n) = namelist%groups
         call move_alloc(larger, namelist%groups)
      end if
      namelist%n = namelist%n + 1
      namelist%groups(namelist%n) = group
   end subroutine add_group

   !> Skip blanks, line ends and comments.
   pure subroutine skip_blanks(text, at)
      character(len=*), intent(in) :: text
      integer, intent(inout) :: at
      do while (at <= len(text))
         if (text(at:at) == '!' .or. text(at:at) == '#') then
            do while (at <= len(text))
               if (text(at:at) == achar(10)) exit
               at = at + 1
            end do
         else if (scan(text(at:at), blanks) > 0) then
            at = at + 1
         else
            exit
         end if
      end do
   end subroutine skip_blanks

   !> Last character of the name that begins at `at`; at - 1 when there is none.
   pure integer function name_end(text, at)
      character(len=*), intent(in) :: text
      integer, intent(in) :: at
      name_end = at - 1
      do while (name_end < len(text))
         if (scan(text(name_end + 1:name_end + 1), name_characters) == 0) exit
         name_end = name_end + 1
      end do
   end function name_end

   !> Last character of the unquoted value that begins at `at`.
   pure integer function value_end(text, at)
      character(len=*), intent(in) :: text
      integer, intent(in) :: at
      value_end = at - 1
      do while (value_end < len(text))
         if (scan(text(value_end + 1:value_end + 1), blanks//',!#/&=''"') > 0) exit
         value_end = value_end + 1
      end do
   end function value_end

   !> Stored form of a name: lower case; too long names are shortened for messages.
   pure function name_of(text) result(name)
      character(len=*), intent(in) :: text
      character(len=:), allocatable :: name
      name = lower_case(text(1:min(len(text), longest_name)))
      if (len(text) > longest_name) name = name//'...'
   end function name_of

   !> The word at a place, for messages; never empty.
   pure function word_at(text, at) result(word)
      character(len=*), intent(in) :: text
      integer, intent(in) :: at
      character(len=:), allocatable :: word
      integer :: limit
      ! the search ends at the limit: a line of 100 kB without a separator is not read once for each of its words
      limit = min(len(text), at + 39)
      word = text(at:min(limit, max(at, value_end(text(:limit), at))))
   end function word_at

   !> Is this character at this position?
   pure logical function is_at(text, at, character)
      character(len=*), intent(in) :: text
      integer, intent(in) :: at
      character(len=1), intent(in) :: character
      is_at = .false.
      if (at <= len(text)) is_at = text(at:at) == character
   end function is_at

   !> The next & that begins a line, or the end.
   pure integer function next_group(text, at)
      character(len=*), intent(in) :: text
      integer, intent(in) :: at
      next_group = at
      do
         do while (next_group <= len(text))
            if (text(next_group:next_group) == achar(10)) exit
            next_group = next_group + 1
         end do
         call skip_blanks(text, next_group)
         if (next_group > len(text)) return
         if (scan(text(next_group:next_group), '&$') > 0) return
      end do
   end function next_group

   !> Line and column of a position in the text.
   pure function origin_of_place(self, place) result(origin)
      class(namelist_type), intent(in) :: self
      integer, intent(in) :: place
      type(origin_type) :: origin
      integer :: low, high, middle
      low = 1
      high = self%source%n_lines
      do while (low < high)
         middle = (low + high + 1)/2
         if (self%source%line_start(middle) <= place) then
            low = middle
         else
            high = middle - 1
         end if
      end do
      origin = self%source%origin(low, place - self%source%line_start(low) + 1)
   end function origin_of_place

   !> An error about value k of an entry, or about all of it (k = 0): "<name>: …".
   subroutine fail(self, entry, k, text)
      class(namelist_type), intent(inout) :: self
      type(entry_type), intent(in) :: entry
      integer, intent(in) :: k
      character(len=*), intent(in) :: text
      integer :: place
      place = entry%place
      if (k > 0) place = entry%values(k)%place
      call self%messages%add(severity%error, entry%name//': '//text, self%origin(place))
   end subroutine fail

   !> Place of the last entry of this name in the group, 0 when there is none.
   pure integer function find_entry(group, name)
      type(group_type), intent(in) :: group
      character(len=*), intent(in) :: name          !! lower case
      integer :: k
      find_entry = 0
      do k = 1, group%n
         if (group%entries(k)%name == name) find_entry = k
      end do
   end function find_entry

   !> A path relative to the folder of another file.
   pure function beside(file, path) result(joined)
      character(len=*), intent(in) :: file, path
      character(len=:), allocatable :: joined
      joined = path
      if (path(1:1) /= '/') joined = file(1:index(file, '/', back=.true.))//path
   end function beside

end module rockdda_io_namelist_parser
