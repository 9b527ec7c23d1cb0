! SPDX-License-Identifier: MIT
!> Writing text files: to a temporary name first, so that the old file survives a failure.
module rockdda_io_text_output
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_io_file_sink, only : file_sink_type
   use rockdda_base_numbers, only : parse_number, number_status
   use rockdda_io_posix, only : format_real, path_kind, get_path_kind, rename_file, remove_file
   implicit none
   private
   public :: text_writer_type, exact_text, exact_row

   type :: text_writer_type
      character(len=:), allocatable, private :: path       !! the final name
      character(len=:), allocatable, private :: temporary  !! name during writing
      type(file_sink_type), private :: sink
   contains
      procedure :: open => open_writer
      procedure :: line
      procedure :: close => close_writer
   end type text_writer_type

contains

   !> Open a file. An existing one is replaced only when `close` succeeds.
   subroutine open_writer(self, path, error)
      class(text_writer_type), intent(inout) :: self
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(out) :: error
      self%path = trim(path)
      select case (get_path_kind(path))
      case (path_kind%directory)
         call make_error(error, error_code%output, self%path//': is a directory, cannot be written as a file')
         return
      case (path_kind%missing, path_kind%file)
         self%temporary = self%path//'.part'
      case default
         self%temporary = self%path  ! a device or a pipe cannot be replaced
      end select
      call self%sink%open(self%temporary, error, name=self%path, in_place=self%temporary == self%path)
      if (allocated(error)) self%temporary = self%path  ! nothing to remove
   end subroutine open_writer

   !> Write one line; a failure is reported by `close`.
   subroutine line(self, text)
      class(text_writer_type), intent(inout) :: self
      character(len=*), intent(in) :: text
      type(error_type), allocatable :: error
      call self%sink%put(text//new_line('a'), error)
   end subroutine line

   !> Close the file: it is on disk under its final name, or there is an error and the old file is unchanged.
   subroutine close_writer(self, error)
      class(text_writer_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      logical :: ok
      call self%sink%close(error, sync=.true.)
      if (self%temporary == self%path) return
      ok = .not. allocated(error)
      if (ok) call rename_file(self%temporary, self%path, ok)
      if (ok) return
      call remove_file(self%temporary)
      if (.not. allocated(error)) call make_error(error, error_code%output, self%path//': could not be written')
   end subroutine close_writer

   !> The shorter of 15 or 17 significant digits that reads back as the same real, bit for bit.
   pure function exact_text(value) result(text)
      real(wp), intent(in) :: value
      character(len=:), allocatable :: text
      real(wp) :: again
      integer :: status
      if (.not. abs(value) > 0) then
         text = '0'
         if (sign(1.0_wp, value) < 0) text = '-0'
         return
      end if
      text = format_real(value, 15)
      call parse_number(text, again, status)
      if (status == number_status%ok .and. .not. abs(again - value) > 0) return
      text = format_real(value, 17)
   end function exact_text

   !> Numbers in a row.
   pure function exact_row(values, separator) result(text)
      real(wp), intent(in) :: values(:)
      character(len=*), intent(in) :: separator
      character(len=:), allocatable :: text
      integer :: i
      text = ''
      do i = 1, size(values)
         if (i > 1) text = text//separator
         text = text//exact_text(values(i))
      end do
   end function exact_row

end module rockdda_io_text_output
