! SPDX-License-Identifier: MIT
!> Messages about input, collected so that one run reports every problem.
!>
!> Printed as compilers do (docs/file-formats.md):
!>
!>     slope.df:41:12: error: tensile strength of joint material 3: expected a number, found 'abcd'
!>         30.0  0.0  abcd
!>                    ^
module rockdda_base_diagnostics
   use rockdda_base_strings, only : printable, to_string
   use rockdda_base_error, only : error_type, error_code, make_error
   implicit none
   private
   public :: origin_type, diagnostic_type, diagnostics_type, severity, severity_names, max_shown, at_word, place_text

   !> Where a value came from. line = 0: the file as a whole; empty file: no file (made in memory).
   type :: origin_type
      character(len=:), allocatable :: file   !! name as given by the user
      integer :: line = 0                     !! 1-based
      integer :: column = 0                   !! 1-based, 0 unknown
      character(len=:), allocatable :: text   !! the source line, tabs kept
   end type origin_type

   type :: severity_enum
      integer :: note = 1
      integer :: warning = 2
      integer :: error = 3
   end type severity_enum
   type(severity_enum), parameter :: severity = severity_enum()
   character(len=*), parameter :: severity_names(3) = [character(len=7) :: 'note', 'warning', 'error']

   !> Number of problems shown; more are only counted.
   integer, parameter :: max_shown = 50
   !> Number of messages kept of one severity; more are only counted, since a broken file can have one at every byte.
   integer, parameter :: max_kept = 1000

   type :: diagnostic_type
      integer :: severity = 3                  !! one of severity%...
      type(origin_type) :: origin
      character(len=:), allocatable :: message
      integer :: summary = 0                   !! the summary that may replace it, 0: none
   contains
      procedure :: format => format_diagnostic
   end type diagnostic_type

   !> One message that replaces many of one kind, where not all are shown.
   type :: summary_type
      integer :: n = 0                         !! messages it replaces
      type(diagnostic_type) :: item
   end type summary_type

   !> A growing list of messages.
   type :: diagnostics_type
      integer :: n = 0                                  !! messages kept
      integer :: n_errors = 0, n_warnings = 0           !! all, also those beyond what is kept
      type(diagnostic_type), allocatable :: items(:)
      type(summary_type), allocatable, private :: summaries(:)
      integer, private :: n_added(3) = 0                !! all, by severity
      integer, private :: n_kept(3) = 0
   contains
      procedure :: add => add_diagnostic
      procedure :: add_error
      procedure :: add_summary
      procedure :: append => append_diagnostics
      procedure :: summarised
      procedure :: has_errors
      procedure :: has_error_about
      procedure :: format => format_diagnostics
      procedure :: to_error
   end type diagnostics_type

contains

   !> The place of a word behind an origin, where it stands on its line; else the origin.
   pure type(origin_type) function at_word(origin, word) result(place)
      type(origin_type), intent(in) :: origin
      character(len=*), intent(in) :: word
      character(len=*), parameter :: between = ' ,=''"'//achar(9)
      character(len=:), allocatable :: text
      integer :: at, first
      place = origin
      if (.not. allocated(origin%text) .or. len_trim(word) == 0) return
      text = ' '//origin%text//' '
      at = max(1, origin%column)
      do
         first = index(text(at + 1:), trim(adjustl(word)))
         if (first == 0) return
         at = at + first
         if (index(between, text(at - 1:at - 1)) == 0) cycle
         if (index(between//'/', text(at + len_trim(adjustl(word)):at + len_trim(adjustl(word)))) > 0) exit
      end do
      place%column = at - 1
   end function at_word

   !> "file:line:column", for a message about another place.
   pure function place_text(origin) result(text)
      type(origin_type), intent(in) :: origin
      character(len=:), allocatable :: text
      text = origin%file//':'//to_string(origin%line)//':'//to_string(origin%column)
   end function place_text

   !> Add one message.
   subroutine add_diagnostic(self, level, message, origin, summary)
      class(diagnostics_type), intent(inout) :: self
      integer, intent(in) :: level                       !! one of severity%...
      character(len=*), intent(in) :: message
      type(origin_type), intent(in), optional :: origin  !! where; absent: unknown
      integer, intent(in), optional :: summary           !! number from `add_summary`
      type(diagnostic_type), allocatable :: larger(:)
      if (level == severity%error) self%n_errors = self%n_errors + 1
      if (level == severity%warning) self%n_warnings = self%n_warnings + 1
      self%n_added(level) = self%n_added(level) + 1
      if (self%n_kept(level) == max_kept) return
      self%n_kept(level) = self%n_kept(level) + 1
      if (.not. allocated(self%items)) allocate (self%items(16))
      if (self%n == size(self%items)) then
         allocate (larger(2*self%n))
         larger(1:self%n) = self%items
         call move_alloc(larger, self%items)
      end if
      self%n = self%n + 1
      self%items(self%n)%severity = level
      self%items(self%n)%message = message
      if (present(origin)) self%items(self%n)%origin = origin
      if (present(summary)) self%items(self%n)%summary = summary
   end subroutine add_diagnostic

   !> Add a message that replaces n others, which are then added with its number `summary`.
   subroutine add_summary(self, level, n, message, origin, summary)
      class(diagnostics_type), intent(inout) :: self
      integer, intent(in) :: level                       !! that of the others, too
      integer, intent(in) :: n
      character(len=*), intent(in) :: message
      type(origin_type), intent(in) :: origin
      integer, intent(out) :: summary
      type(summary_type) :: new
      new%n = n
      new%item%severity = level
      new%item%message = message
      new%item%origin = origin
      if (.not. allocated(self%summaries)) allocate (self%summaries(0))
      self%summaries = [self%summaries, new]
      summary = size(self%summaries)
   end subroutine add_summary

   !> The list with each summary in the place of the messages that it replaces.
   function summarised(self) result(short)
      class(diagnostics_type), intent(in) :: self
      type(diagnostics_type) :: short
      logical, allocatable :: shown(:)
      integer :: i, k, level
      allocate (shown(0))
      if (allocated(self%summaries)) shown = [(.false., k=1, size(self%summaries))]
      do i = 1, self%n
         associate (item => self%items(i))
            if (item%summary == 0) then
               call short%add(item%severity, item%message, item%origin)
            else if (.not. shown(item%summary)) then
               shown(item%summary) = .true.
               associate (one => self%summaries(item%summary)%item)
                  call short%add(one%severity, one%message, one%origin)
               end associate
            end if
         end associate
      end do
      ! messages that have only been counted
      short%n_added = self%n_added
      do k = 1, size(shown)
         if (.not. shown(k)) cycle
         level = self%summaries(k)%item%severity
         short%n_added(level) = short%n_added(level) - self%summaries(k)%n + 1
      end do
      short%n_warnings = short%n_added(severity%warning)
      short%n_errors = short%n_added(severity%error)
   end function summarised

   !> Add an error about a file, of the form "FILE: error: what".
   subroutine add_error(self, error)
      class(diagnostics_type), intent(inout) :: self
      type(error_type), intent(in) :: error
      type(origin_type) :: origin
      character(len=*), parameter :: mark = ': error: '
      integer :: first
      first = index(error%message, mark)
      origin%file = error%message(1:first - 1)
      call self%add(severity%error, error%message(first + merge(len(mark), 1, first > 0):), origin)
   end subroutine add_error

   !> Is there an error about a name at or below a line of a file? That it is missing there follows from it.
   pure logical function has_error_about(self, name, origin)
      class(diagnostics_type), intent(in) :: self
      character(len=*), intent(in) :: name
      type(origin_type), intent(in) :: origin
      integer :: i
      has_error_about = .false.
      if (.not. allocated(origin%file)) return
      do i = 1, self%n
         associate (item => self%items(i))
            if (item%severity /= severity%error .or. item%origin%line < origin%line) cycle
            if (.not. allocated(item%origin%file)) cycle
            if (item%origin%file /= origin%file) cycle
            if (index(item%message, name//':') == 1 .or. index(item%message, "mean '"//name//"'") > 0) &
               has_error_about = .true.
         end associate
      end do
   end function has_error_about

   !> Append all messages of another list.
   subroutine append_diagnostics(self, other, order)
      class(diagnostics_type), intent(inout) :: self
      type(diagnostics_type), intent(in) :: other
      integer, intent(in), optional :: order(:)   !! (other%n) numbers of its messages in the order wanted
      integer :: i, k, first
      first = 0
      if (allocated(self%summaries)) first = size(self%summaries)
      if (allocated(other%summaries)) then
         if (first == 0) self%summaries = other%summaries
         if (first > 0) self%summaries = [self%summaries, other%summaries]
      end if
      do i = 1, other%n
         k = i
         if (present(order)) k = order(i)
         associate (item => other%items(k))
            call self%add(item%severity, item%message, item%origin, merge(0, first + item%summary, item%summary == 0))
         end associate
      end do
      ! messages that the other list has only counted
      self%n_added = self%n_added + other%n_added - other%n_kept
      self%n_errors = self%n_errors + other%n_added(severity%error) - other%n_kept(severity%error)
      self%n_warnings = self%n_warnings + other%n_added(severity%warning) - other%n_kept(severity%warning)
   end subroutine append_diagnostics

   !> Was any error reported?
   pure logical function has_errors(self)
      class(diagnostics_type), intent(in) :: self
      has_errors = self%n_errors > 0
   end function has_errors

   !> The message as a compiler prints it: one line, or three when the source line is known.
   function format_diagnostic(self) result(text)
      class(diagnostic_type), intent(in) :: self
      character(len=:), allocatable :: text
      character(len=:), allocatable :: blank
      integer :: i, before
      text = ''
      if (allocated(self%origin%file)) then
         text = printable(self%origin%file, '')//':'
         if (self%origin%line > 0) text = text//to_string(self%origin%line)//':'
         if (self%origin%line > 0 .and. self%origin%column > 0) text = text//to_string(self%origin%column)//':'
         text = text//' '
      end if
      text = text//trim(severity_names(self%severity))//': '//printable(self%message, achar(9)//new_line('a'))
      if (.not. allocated(self%origin%text) .or. self%origin%column < 1) return
      ! the mark stands under its byte of the line as it is shown
      before = min(self%origin%column - 1, len(self%origin%text))
      blank = printable(self%origin%text(1:before), achar(9))
      do i = 1, len(blank)
         if (blank(i:i) /= achar(9)) blank(i:i) = ' '
      end do
      blank = blank//repeat(' ', self%origin%column - 1 - before)
      text = text//new_line('a')//'    '//printable(self%origin%text, achar(9))//new_line('a')//'    '//blank//'^'
   end function format_diagnostic

   !> All messages of at least the given severity, one under the other; at most `max_shown`, then a count.
   function format_diagnostics(self, at_least, with_places) result(text)
      class(diagnostics_type), intent(in) :: self
      integer, intent(in) :: at_least      !! one of severity%...
      logical, intent(in), optional :: with_places !! also notes that point to a line: they help to find an error
      character(len=:), allocatable :: text
      integer :: i, shown, left
      logical :: all_places
      all_places = .false.
      if (present(with_places)) all_places = with_places
      text = ''
      shown = 0
      do i = 1, self%n
         if (shown == max_shown) exit
         associate (item => self%items(i))
            if (item%severity < at_least .and. .not. (all_places .and. item%origin%line > 0)) cycle
            if (len(text) > 0) text = text//new_line('a')
            text = text//item%format()
            if (item%severity >= at_least) shown = shown + 1
         end associate
      end do
      left = sum(self%n_added(at_least:)) - shown
      if (left > 0) text = text//new_line('a')//'... and '//to_string(left)//' more'
   end function format_diagnostics

   !> All errors as one input error; unallocated when there are none.
   subroutine to_error(self, error)
      class(diagnostics_type), intent(in) :: self
      type(error_type), allocatable, intent(out) :: error
      if (.not. self%has_errors()) return
      call make_error(error, error_code%input, self%format(severity%error))
   end subroutine to_error

end module rockdda_base_diagnostics
