! SPDX-License-Identifier: MIT
!> Takes typed values out of a parsed namelist entry; wrong types and counts are reported at their place.
module rockdda_io_option_values
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : lower_case, to_string
   use rockdda_io_namelist_parser, only : namelist_type, entry_type, value_kind, beside
   use rockdda_base_numbers, only : is_whole
   use rockdda_io_record_reader, only : largest_value
   use rockdda_io_source, only : file_text_problem
   use rockdda_base_suggest, only : did_you_mean
   implicit none
   private
   public :: get_real, get_integer, get_logical, get_text, get_file, get_choice, get_reals, get_integers
   public :: demand, index_of

contains

   !> Get one number; `value` is unchanged when there is none.
   subroutine get_real(namelist, entry, value)
      type(namelist_type), intent(inout) :: namelist
      type(entry_type), intent(in) :: entry
      real(wp), intent(inout) :: value
      if (.not. is_single(namelist, entry, 'one number')) return
      if (is_number(namelist, entry, 1)) value = entry%values(1)%number
   end subroutine get_real

   !> Get one whole number of at least `least`.
   subroutine get_integer(namelist, entry, least, value)
      type(namelist_type), intent(inout) :: namelist
      type(entry_type), intent(in) :: entry
      integer, intent(in) :: least
      integer, intent(inout) :: value
      if (.not. is_single(namelist, entry, 'one whole number')) return
      if (is_whole_number(namelist, entry, 1, least)) value = nint(entry%values(1)%number)
   end subroutine get_integer

   !> Get .true. or .false.
   subroutine get_logical(namelist, entry, value)
      type(namelist_type), intent(inout) :: namelist
      type(entry_type), intent(in) :: entry
      logical, intent(inout) :: value
      if (.not. is_single(namelist, entry, 'one value')) return
      if (entry%values(1)%kind == value_kind%logical) then
         value = entry%values(1)%flag
      else
         call namelist%fail(entry, 1, "expected .true. or .false., found '"//entry%values(1)%text//"'")
      end if
   end subroutine get_logical

   !> Get a text in quotes.
   subroutine get_text(namelist, entry, value, or_number, or_real)
      type(namelist_type), intent(inout) :: namelist
      type(entry_type), intent(in) :: entry
      character(len=:), allocatable, intent(inout) :: value
      logical, intent(in), optional :: or_number     !! a whole number of at least 1 without quotes is taken, too
      logical, intent(in), optional :: or_real       !! any number without quotes is
      logical :: takes_number, takes_real
      takes_number = .false.
      if (present(or_number)) takes_number = or_number
      takes_real = .false.
      if (present(or_real)) takes_real = or_real
      if (.not. is_single(namelist, entry, 'one text')) return
      if (entry%values(1)%kind == value_kind%text) then
         value = entry%values(1)%text
      else if (takes_real .and. entry%values(1)%kind == value_kind%number) then
         value = entry%values(1)%text
      else if (takes_number) then
         if (is_whole_number(namelist, entry, 1, 1)) value = to_string(nint(entry%values(1)%number))
      else
         call namelist%fail(entry, 1, "expected text in quotes, found '"//entry%values(1)%text//"'")
      end if
   end subroutine get_text

   !> Get the path of a file that can be read, beside the file of the options; not allocated when there is none.
   subroutine get_file(namelist, entry, name, path)
      type(namelist_type), intent(inout) :: namelist
      type(entry_type), intent(in) :: entry
      character(len=:), allocatable, intent(out) :: name   !! as the entry has it; not allocated: it has none
      character(len=:), allocatable, intent(out) :: path
      character(len=:), allocatable :: problem
      call get_text(namelist, entry, name)
      if (.not. allocated(name)) return
      call demand(namelist, entry, len_trim(name) > 0, 'must name a file')
      if (len_trim(name) == 0) return
      path = beside(namelist%source%file, trim(name))
      problem = file_text_problem(path)
      if (len(problem) == 0) return
      call namelist%fail(entry, 1, path//': '//problem)
      deallocate (path)
   end subroutine get_file

   !> Get a text in quotes that is one of several words (lower case).
   subroutine get_choice(namelist, entry, choices, value, old_word, remark)
      type(namelist_type), intent(inout) :: namelist
      type(entry_type), intent(in) :: entry
      character(len=*), intent(in) :: choices(:)
      character(len=:), allocatable, intent(inout) :: value
      character(len=*), intent(in), optional :: old_word   !! former spelling of the first word
      character(len=*), intent(in), optional :: remark     !! to the message
      character(len=:), allocatable :: word, list
      integer :: i
      call get_text(namelist, entry, word)
      if (.not. allocated(word)) return
      word = lower_case(trim(word))
      if (present(old_word)) then
         if (len(old_word) > 0 .and. word == old_word) word = trim(choices(1))
      end if
      list = ''
      do i = 1, size(choices)
         if (word == lower_case(trim(choices(i)))) then
            value = trim(choices(i))
            return
         end if
         if (i > 1) list = list//', '
         list = list//"'"//trim(choices(i))//"'"
      end do
      if (size(choices) > 1) list = 'one of '//list
      if (present(remark)) then
         if (len(remark) > 0) list = list//' ('//remark//')'
      end if
      call namelist%fail(entry, 1, 'must be '//list//", found '"//word//"'"//did_you_mean(word, choices))
      ! what else depends on it is judged as if it stood there
      if (size(choices) == 1) value = trim(choices(1))
   end subroutine get_choice

   !> Get a list of numbers: exactly `n`, or a multiple of n when `multiple` holds.
   subroutine get_reals(namelist, entry, n, multiple, values)
      type(namelist_type), intent(inout) :: namelist
      type(entry_type), intent(in) :: entry
      integer, intent(in) :: n
      logical, intent(in) :: multiple
      real(wp), allocatable, intent(out) :: values(:)   !! unallocated when the list is wrong
      integer :: i
      logical :: ok
      if (entry%n == 0) return
      ok = .true.
      do i = 1, entry%n
         if (.not. is_number(namelist, entry, i)) ok = .false.
      end do
      if (multiple .and. modulo(entry%n, n) /= 0) then
         call namelist%fail(entry, 0, 'expected a multiple of '//to_string(n)//' numbers, found '// &
                            to_string(entry%n)//decimal_comma(namelist, entry))
         ok = .false.
      else if (.not. multiple .and. entry%n /= n) then
         call namelist%fail(entry, 0, 'expected '//to_string(n)//' numbers, found '//to_string(entry%n)// &
                            decimal_comma(namelist, entry))
         ok = .false.
      end if
      if (ok) call refuse_decimal_commas(namelist, entry, n, ok)
      if (.not. ok) return
      allocate (values(entry%n))
      do i = 1, entry%n
         values(i) = entry%values(i)%number
      end do
   end subroutine get_reals

   !> Report a list whose commas are decimal signs though its count fits: digits behind a comma that begin with a
   !> needless 0, as in 0,05; or blanks that part the list in rows of n numbers only when commas are decimal signs, as
   !> in 0,5,0 1,5,0 for the points 0.5 0 and 1.5 0. A list without such blanks is read as it stands.
   subroutine refuse_decimal_commas(namelist, entry, n, ok)
      type(namelist_type), intent(inout) :: namelist
      type(entry_type), intent(in) :: entry
      integer, intent(in) :: n                 !! numbers of a row
      logical, intent(inout) :: ok
      character(len=*), parameter :: digits = '0123456789'
      integer :: i, length, pairs, first, at
      logical :: joined, decimal   !! a comma without blanks goes before the next one; it may be a decimal sign
      logical :: in_rows           !! blanks part the list in rows of n numbers, some of them with decimal commas
      in_rows = n > 1
      length = 0
      pairs = 0
      first = 0
      at = 0                       ! the first comma of rows that are not whole
      decimal = .false.
      do i = 1, entry%n
         length = length + 1
         joined = .false.
         if (i < entry%n) then
            associate (a => entry%values(i), b => entry%values(i + 1), source => namelist%source%text)
               joined = b%place == a%place + len(a%text) + 1
               if (joined) joined = source(b%place - 1:b%place - 1) == ','
               if (joined .and. is_whole(a%text) .and. verify(b%text, digits) == 0) then
                  if (len(b%text) > 1 .and. b%text(1:1) == '0') then
                     call report(i)
                     return
                  end if
                  decimal = .not. decimal
                  if (decimal) pairs = pairs + 1
                  if (pairs == 1 .and. decimal) first = i
               else
                  decimal = .false.
               end if
            end associate
         end if
         if (joined) cycle
         in_rows = in_rows .and. length >= n .and. length - pairs <= n
         if (modulo(length, n) > 0 .and. pairs > 0 .and. at == 0) at = first
         length = 0
         pairs = 0
      end do
      if (in_rows .and. at > 0) call report(at)

   contains

      !> Digits alone, perhaps behind a sign?
      pure logical function is_whole(text)
         character(len=*), intent(in) :: text
         is_whole = verify(text(merge(2, 1, scan(text(1:1), '+-') > 0):), digits) == 0
      end function is_whole

      !> Report values k and k + 1.
      subroutine report(k)
         integer, intent(in) :: k
         character(len=:), allocatable :: a, b
         a = entry%values(k)%text
         b = entry%values(k + 1)%text
         call namelist%fail(entry, k, "'"//a//','//b//"' seems to be a number with a decimal comma: write "//a//'.'// &
                            b//', or '//a//', '//b//' for two numbers')
         ok = .false.
      end subroutine report

   end subroutine refuse_decimal_commas

   !> Get a list of whole numbers of at least `least`, of any length.
   subroutine get_integers(namelist, entry, least, values)
      type(namelist_type), intent(inout) :: namelist
      type(entry_type), intent(in) :: entry
      integer, intent(in) :: least
      integer, allocatable, intent(out) :: values(:)    !! unallocated when the list is wrong
      integer :: i
      logical :: ok
      ok = .true.
      do i = 1, entry%n
         if (.not. is_whole_number(namelist, entry, i, least)) ok = .false.
      end do
      if (.not. ok) return
      allocate (values(entry%n))
      do i = 1, entry%n
         values(i) = nint(entry%values(i)%number)
      end do
   end subroutine get_integers

   !> Report a value of the entry (default: the first) unless a condition holds: "<name>: must be …, found '…'".
   subroutine demand(namelist, entry, condition, rule, place)
      type(namelist_type), intent(inout) :: namelist
      type(entry_type), intent(in) :: entry
      logical, intent(in) :: condition
      character(len=*), intent(in) :: rule
      integer, intent(in), optional :: place
      integer :: k
      if (condition .or. entry%n < 1) return
      k = 1
      if (present(place)) k = place
      associate (value => entry%values(k))
         if (value%kind /= value_kind%number .and. value%kind /= value_kind%text) return
         call namelist%fail(entry, k, rule//", found '"//value%text//"'")
      end associate
   end subroutine demand

   !> Place of a name in a list of names, 0 when it is not there.
   pure integer function index_of(name, names)
      character(len=*), intent(in) :: name, names(:)
      integer :: i
      index_of = 0
      do i = 1, size(names)
         if (names(i) == name) index_of = i
      end do
   end function index_of

   !> Has the entry one value? (No value at all was reported by the parser.)
   logical function is_single(namelist, entry, what)
      type(namelist_type), intent(inout) :: namelist
      type(entry_type), intent(in) :: entry
      character(len=*), intent(in) :: what
      character(len=:), allocatable :: hint
      is_single = entry%n == 1
      if (entry%n < 2) return
      hint = decimal_comma(namelist, entry)
      if (what == 'one text') hint = '; a list of names is one text, with the commas inside the quotes'
      call namelist%fail(entry, 2, 'expected '//what//', found '//to_string(entry%n)//' values'//hint)
   end function is_single

   !> A hint at the first pair of values that reads as one number with a decimal comma, or nothing. `0,5` may be one,
   !> `0, 5`, `0.5,1` and a value of `1,2,3` are none.
   function decimal_comma(namelist, entry) result(text)
      type(namelist_type), intent(in) :: namelist
      type(entry_type), intent(in) :: entry
      character(len=:), allocatable :: text
      character(len=*), parameter :: digits = '0123456789'
      integer :: i, first, comma, next, behind
      text = ''
      do i = 1, entry%n - 1
         associate (a => entry%values(i), b => entry%values(i + 1), source => namelist%source%text)
            if (a%kind /= value_kind%number .or. b%kind /= value_kind%number) cycle
            comma = a%place + len(a%text)
            next = comma + 1
            behind = next + len(b%text)
            if (b%place /= next) cycle
            if (source(comma:comma) /= ',') cycle
            first = merge(2, 1, scan(a%text(1:1), '+-') > 0)
            if (verify(a%text(first:), digits) > 0 .or. verify(b%text(1:1), digits) > 0) cycle
            if (verify(b%text, digits//'eEdD+-') > 0) cycle
            if (source(a%place - 1:a%place - 1) == ',') cycle
            if (behind < len(source)) then
               if (source(behind:behind) == ',' .and. verify(source(behind + 1:behind + 1), digits) == 0) cycle
            end if
            text = "; if '"//a%text//','//b%text//"' has a decimal comma, write "//a%text//'.'//b%text
            return
         end associate
      end do
   end function decimal_comma

   !> Is value i a number of sensible size?
   logical function is_number(namelist, entry, i)
      type(namelist_type), intent(inout) :: namelist
      type(entry_type), intent(in) :: entry
      integer, intent(in) :: i
      is_number = entry%values(i)%kind == value_kind%number
      if (.not. is_number) then
         call namelist%fail(entry, i, "expected a number, found '"//entry%values(i)%text//"'"// &
                            dash_hint(entry%values(i)%text))
      else if (abs(entry%values(i)%number) > largest_value) then
         is_number = .false.
         call namelist%fail(entry, i, 'must not be larger than '//to_string(largest_value)//", found '"// &
                            entry%values(i)%text//"'")
      end if
   end function is_number

   !> A hint at a number behind a dash or the minus sign of a text program, as UTF-8 has them.
   pure function dash_hint(text) result(hint)
      character(len=*), intent(in) :: text
      character(len=:), allocatable :: hint
      character(len=*), parameter :: dash = char(226)    ! first byte of both
      hint = ''
      if (index(text, dash) == 1 .and. scan(text, '0123456789') == 4) hint = "; its sign is a dash, write '-'"
   end function dash_hint

   !> Is value i a whole number of at least `least`?
   logical function is_whole_number(namelist, entry, i, least)
      type(namelist_type), intent(inout) :: namelist
      type(entry_type), intent(in) :: entry
      integer, intent(in) :: i, least
      is_whole_number = is_number(namelist, entry, i)
      if (.not. is_whole_number) return
      if (.not. is_whole(entry%values(i)%number)) then
         is_whole_number = .false.
         call namelist%fail(entry, i, "expected a whole number, found '"//entry%values(i)%text//"'")
      else if (entry%values(i)%number < least) then
         is_whole_number = .false.
         call namelist%fail(entry, i, 'must be at least '//to_string(least)//", found '"//entry%values(i)%text//"'")
      end if
   end function is_whole_number

end module rockdda_io_option_values
