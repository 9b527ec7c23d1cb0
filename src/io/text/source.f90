! SPDX-License-Identifier: MIT
!> Text file in memory, with the positions of its lines.
!>
!> A file is read as a whole: input files are small compared with the model. Its text has LF at each line end, wherever
!> the file has LF, CR LF or CR, and no byte-order mark; UTF-16 with a mark becomes UTF-8, and Ctrl-Z at the end, as DOS
!> writes it, is left out. Other bytes stay as they are: Latin-1 in titles and names, for example.
module rockdda_io_source
   use rockdda_base_kinds, only : i8
   use rockdda_base_strings, only : to_string
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_io_posix, only : path_kind, get_path_kind, get_file_size, is_readable
   implicit none
   private
   public :: source_type, read_source, new_source, line_range, file_text_problem, begins_as_xml

   !> Largest file accepted [bytes].
   integer(i8), parameter :: largest_file = 1000000000_i8
   !> Lines longer than this are not repeated in messages.
   integer, parameter :: longest_quoted_line = 400
   character(len=*), parameter :: ctrl_z = achar(26)

   type :: source_type
      character(len=:), allocatable :: file   !! name as given by the user
      character(len=:), allocatable :: text   !! as readers take it
      character(len=:), allocatable :: bytes  !! of the file; not allocated: as `text`
      character(len=:), allocatable :: written !! as messages repeat it, of the same length; not allocated: as `text`
      integer :: n_lines = 0
      integer, allocatable :: line_start(:)   !! (n_lines) position of the first byte of each line in text
   contains
      procedure :: line_text
      procedure :: origin => origin_at
      procedure :: file_origin
   end type source_type

contains

   !> Read a whole file; a problem becomes an error in `messages` and ok is false.
   subroutine read_source(path, source, messages, ok)
      character(len=*), intent(in) :: path
      type(source_type), intent(out) :: source
      type(diagnostics_type), intent(inout) :: messages
      logical, intent(out) :: ok
      character(len=:), allocatable :: problem, text
      type(origin_type) :: origin
      integer :: unit, status, zero, dos_end
      ok = .false.
      origin%file = path
      problem = file_text_problem(path)
      text = ''
      if (len(problem) == 0) then
         text = repeat(' ', int(get_file_size(path)))
         open (newunit=unit, file=path, status='old', action='read', access='stream', form='unformatted', iostat=status)
         if (status /= 0) then
            problem = 'cannot be opened for reading'
         else
            read (unit, iostat=status) text
            close (unit)
            if (status /= 0) problem = 'cannot be read'
         end if
      end if
      if (len(problem) > 0) then
         call messages%add(severity%error, problem, origin)
         return
      end if
      call new_source(path, text, source)
      zero = index(source%text, achar(0))
      dos_end = index(source%text, ctrl_z)
      if (len(source%text) == 0) then
         origin%line = 1
         origin%column = 1
         call messages%add(severity%error, 'the file is empty', origin)
      else if (index(source%text, char(137)//'HDF') == 1) then
         origin%line = 1
         origin%column = 1
         call messages%add(severity%error, 'this is an HDF5 file, not text', origin)
      else if (zero > 0) then
         origin%line = count(source%line_start <= zero)
         origin%column = zero - source%line_start(origin%line) + 1
         call messages%add(severity%error, 'this is a binary file, not text', origin)
      else if (dos_end > 0) then
         origin%line = count(source%line_start <= dos_end)
         call messages%add(severity%error, 'there is a Ctrl-Z (the end of a file for DOS) and more text behind it: '// &
                           'delete one of them', &
                           source%origin(origin%line, dos_end - source%line_start(origin%line) + 1))
      else if (begins_as_xml(source%text)) then
         zero = index(source%text, '<')
         origin%line = count(source%line_start <= zero)
         call messages%add(severity%error, "this is an XML file (DDAML); convert it first with "// &
                           "'rockdda-post convert'", &
                           source%origin(origin%line, zero - source%line_start(origin%line) + 1))
      else
         ok = .true.
      end if
   end subroutine read_source

   !> Why a path cannot be read as a file; empty when it can.
   function file_text_problem(path, any_size) result(problem)
      character(len=*), intent(in) :: path
      logical, intent(in), optional :: any_size  !! true: accept any size
      character(len=:), allocatable :: problem
      integer :: kind
      problem = ''
      kind = path_kind%missing
      if (len_trim(path) > 0) kind = get_path_kind(path)
      if (kind == path_kind%missing) then
         problem = 'no such file'
      else if (kind == path_kind%directory) then
         problem = 'is a directory, not a file'
      else if (kind == path_kind%other) then
         problem = 'is not a regular file'
      else if (kind == path_kind%unknown) then
         problem = 'permission denied'
      else if (.not. is_readable(path)) then
         problem = 'permission denied'
      else if (get_file_size(path) > largest_file) then
         if (present(any_size)) then
            if (any_size) return
         end if
         problem = 'is too large to be an input file ('//to_string(get_file_size(path))//' bytes)'
      end if
   end function file_text_problem

   !> Create a source from text in memory.
   pure subroutine new_source(file, text, source)
      character(len=*), intent(in) :: file      !! name for messages
      character(len=*), intent(in) :: text
      type(source_type), intent(out) :: source
      integer :: i, n
      source%file = file
      source%text = plain_text(text)
      if (len(source%text) /= len(text)) then
         source%bytes = text
      else if (source%text /= text) then
         source%bytes = text
      end if
      n = 1
      do i = 1, len(source%text)
         if (source%text(i:i) == achar(10)) n = n + 1
      end do
      allocate (source%line_start(n))
      source%line_start(1) = 1
      n = 1
      do i = 1, len(source%text)
         if (source%text(i:i) == achar(10)) then
            n = n + 1
            source%line_start(n) = i + 1
         end if
      end do
      ! text after the last line end is a line only when it is not empty
      if (n > 1 .and. source%line_start(n) > len(source%text)) n = n - 1
      source%n_lines = n
   end subroutine new_source

   !> The text of some bytes: without a byte-order mark, each line end as LF, without Ctrl-Z at the end.
   pure function plain_text(bytes) result(text)
      character(len=*), intent(in) :: bytes
      character(len=:), allocatable :: text
      character(len=1) :: this, previous
      integer :: i, n, first
      first = 1
      if (index(bytes, char(239)//char(187)//char(191)) == 1) first = 4
      if (index(bytes, char(255)//char(254)) == 1) then
         text = utf_16_text(bytes(3:), low_first=.true.)
      else if (index(bytes, char(254)//char(255)) == 1) then
         text = utf_16_text(bytes(3:), low_first=.false.)
      else
         text = bytes(first:)
      end if
      n = 0
      previous = ' '
      do i = 1, len(text)
         this = text(i:i)
         if (this /= achar(10) .or. previous /= achar(13)) then
            n = n + 1
            text(n:n) = merge(achar(10), this, this == achar(13))
         end if
         previous = this
      end do
      call blank_spaces(text(:n))
      i = index(text(:n), ctrl_z)
      if (i > 0) then
         if (verify(text(i:n), ctrl_z//achar(0)//' '//achar(9)//achar(10)) == 0) n = i - 1
      end if
      text = text(:n)
   end function plain_text

   !> Blanks for the other spaces of Unicode, which appear alike: no-break (also of Latin-1), thin, ideographic ones.
   pure subroutine blank_spaces(text)
      character(len=*), intent(inout) :: text
      integer :: i, a, b
      do i = 1, len(text)
         if (ichar(text(i:i)) < 128) cycle
         a = 0
         b = 0
         if (i > 1) a = ichar(text(i - 1:i - 1))
         if (i > 2) b = ichar(text(i - 2:i - 2))
         select case (ichar(text(i:i)))
         case (160)
            if (a == 194) then                         ! U+00A0
               text(i - 1:i) = ' '
            else if (a < 128) then
               text(i:i) = ' '
            end if
         end select
         if (ichar(text(i:i)) < 128) cycle
         ! U+2000 to U+200A, U+202F, U+3000
         if (b == 226 .and. a == 128 .and. (ichar(text(i:i)) <= 138 .or. ichar(text(i:i)) == 175)) text(i - 2:i) = ' '
         if (b == 227 .and. a == 128 .and. ichar(text(i:i)) == 128) text(i - 2:i) = ' '
      end do
   end subroutine blank_spaces

   !> UTF-16 as UTF-8; what is no character becomes U+FFFD.
   pure function utf_16_text(bytes, low_first) result(text)
      character(len=*), intent(in) :: bytes
      logical, intent(in) :: low_first           !! true: the lower byte of each pair comes first
      character(len=:), allocatable :: text
      integer, parameter :: replacement = 65533
      integer :: i, n, code, low
      allocate (character(len=3*(len(bytes)/2 + 1)) :: text)
      n = 0
      i = 1
      do while (i <= len(bytes))
         code = unit_at(i)
         i = i + 2
         if (code >= 55296 .and. code < 57344) then   ! a pair, its higher half first
            low = unit_at(i)
            if (code < 56320 .and. low >= 56320 .and. low < 57344) then
               code = 65536 + 1024*(code - 55296) + low - 56320
               i = i + 2
            else
               code = replacement
            end if
         end if
         if (code < 128) then
            call put(text, n, code)
         else if (code < 2048) then
            call put(text, n, 192 + code/64)
            call put(text, n, 128 + modulo(code, 64))
         else
            if (code < 65536) then
               call put(text, n, 224 + code/4096)
            else
               call put(text, n, 240 + code/262144)
               call put(text, n, 128 + modulo(code/4096, 64))
            end if
            call put(text, n, 128 + modulo(code/64, 64))
            call put(text, n, 128 + modulo(code, 64))
         end if
      end do
      text = text(:n)

   contains

      !> The two bytes at a place as a number.
      pure integer function unit_at(at)
         integer, intent(in) :: at
         unit_at = replacement
         if (at >= len(bytes)) return
         if (low_first) then
            unit_at = ichar(bytes(at:at)) + 256*ichar(bytes(at + 1:at + 1))
         else
            unit_at = ichar(bytes(at + 1:at + 1)) + 256*ichar(bytes(at:at))
         end if
      end function unit_at

   end function utf_16_text

   !> Append a byte.
   pure subroutine put(text, n, byte)
      character(len=*), intent(inout) :: text
      integer, intent(inout) :: n            !! bytes of the text so far
      integer, intent(in) :: byte
      n = n + 1
      text(n:n) = char(byte)
   end subroutine put

   !> Find the first and last position of a line in the text, without its line end; last < first for an empty line.
   pure subroutine line_range(source, line, first, last)
      class(source_type), intent(in) :: source
      integer, intent(in) :: line                !! 1-based
      integer, intent(out) :: first, last
      first = 1
      last = 0
      if (line < 1 .or. line > source%n_lines) return
      first = source%line_start(line)
      last = len(source%text)
      if (line < size(source%line_start)) last = source%line_start(line + 1) - 2
   end subroutine line_range

   !> Text of a line without its end.
   pure function line_text(self, line) result(text)
      class(source_type), intent(in) :: self
      integer, intent(in) :: line                !! 1-based
      character(len=:), allocatable :: text
      integer :: first, last
      call line_range(self, line, first, last)
      text = self%text(first:last)
   end function line_text

   !> Place in the file, with the source line unless it is very long.
   pure function origin_at(self, line, column) result(origin)
      class(source_type), intent(in) :: self
      integer, intent(in) :: line, column       !! 1-based
      type(origin_type) :: origin
      integer :: first, last
      origin%file = self%file
      origin%line = line
      origin%column = column
      if (line < 1 .or. line > self%n_lines) return
      call line_range(self, line, first, last)
      if (last - first >= longest_quoted_line) return
      if (allocated(self%written)) then
         origin%text = self%written(first:last)
      else
         origin%text = self%text(first:last)
      end if
   end function origin_at

   !> The file as a whole.
   pure function file_origin(self) result(origin)
      class(source_type), intent(in) :: self
      type(origin_type) :: origin
      origin%file = self%file
   end function file_origin

   !> Does the text begin as XML does?
   pure logical function begins_as_xml(text)
      character(len=*), intent(in) :: text
      integer :: i
      begins_as_xml = .false.
      i = verify(text, ' '//achar(9)//achar(10)//achar(13))
      if (i > 0) begins_as_xml = text(i:i) == '<'
   end function begins_as_xml

end module rockdda_io_source
