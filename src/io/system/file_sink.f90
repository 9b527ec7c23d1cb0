! SPDX-License-Identifier: MIT
!> Write text to a file or a standard stream and report every failure (the Fortran run-time library does not report a
!> full disk).
module rockdda_io_file_sink
   use, intrinsic :: iso_c_binding, only : c_char, c_int, c_long_long, c_null_char
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_io_output_lock, only : errno_text
   implicit none
   private
   public :: file_sink_type

   integer, parameter :: buffer_size = 65536
   !> Ways to open a file, as in the shim.
   integer(c_int), parameter :: new_file = 0, at_end = 1, as_it_is = 2

   type :: file_sink_type
      character(len=:), allocatable :: path                !! for messages
      integer(c_int), private :: handle = -1
      character(len=:), allocatable, private :: buffer
      integer, private :: n = 0                            !! characters in the buffer
      integer(c_int), private :: problem = 0               !! errno of the first failure
   contains
      procedure :: open => open_sink
      procedure :: attach
      procedure :: put
      procedure :: flush => flush_sink
      procedure :: close => close_sink
      procedure :: is_open
   end type file_sink_type

   interface
      integer(c_int) function c_open(path, how) bind(C, name='rockdda_sink_open')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int), value :: how
      end function c_open
      integer(c_int) function c_write(handle, bytes, n) bind(C, name='rockdda_sink_write')
         import :: c_char, c_int, c_long_long
         integer(c_int), value :: handle
         character(kind=c_char), intent(in) :: bytes(*)
         integer(c_long_long), value :: n
      end function c_write
      integer(c_int) function c_close(handle, sync) bind(C, name='rockdda_sink_close')
         import :: c_int
         integer(c_int), value :: handle, sync
      end function c_close
   end interface

contains

   !> Create a file in the place of an existing one, append to it, or write to it in place. Only writing in place
   !> follows a symbolic link.
   subroutine open_sink(self, path, error, name, append, in_place)
      class(file_sink_type), intent(inout) :: self
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(out) :: error
      character(len=*), intent(in), optional :: name       !! for messages, when it is not the path
      logical, intent(in), optional :: append              !! true: write behind its end
      logical, intent(in), optional :: in_place            !! true: a device or a pipe
      integer(c_int) :: how
      how = new_file
      if (present(append)) how = merge(at_end, new_file, append)
      if (present(in_place)) how = merge(as_it_is, how, in_place)
      call self%attach(-1, path)
      if (present(name)) self%path = name
      self%handle = c_open(path//c_null_char, how)
      if (self%handle >= 0) return
      self%problem = -self%handle
      self%handle = -1
      call explain(self, error)
   end subroutine open_sink

   !> Use a standard stream: 1 output, 2 error. It is not closed.
   subroutine attach(self, stream, name)
      class(file_sink_type), intent(inout) :: self
      integer, intent(in) :: stream
      character(len=*), intent(in) :: name                 !! for messages
      self%path = name
      self%handle = int(stream, c_int)
      self%n = 0
      self%problem = 0
      if (.not. allocated(self%buffer)) self%buffer = repeat(' ', buffer_size)
   end subroutine attach

   !> Add text as it is; line ends are part of it. A failure is reported here or by `flush` or `close`.
   subroutine put(self, text, error)
      class(file_sink_type), intent(inout) :: self
      character(len=*), intent(in) :: text
      type(error_type), allocatable, intent(out) :: error
      if (self%handle < 0) return
      if (self%n + len(text) > buffer_size) call self%flush(error)
      if (allocated(error)) return
      if (len(text) > buffer_size) then
         if (self%problem == 0) self%problem = c_write(self%handle, text, len(text, c_long_long))
         call explain(self, error)
      else
         self%buffer(self%n + 1:self%n + len(text)) = text
         self%n = self%n + len(text)
      end if
   end subroutine put

   !> Write everything to the system.
   subroutine flush_sink(self, error)
      class(file_sink_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      if (self%handle < 0) return
      if (self%problem == 0 .and. self%n > 0) self%problem = c_write(self%handle, self%buffer, int(self%n, c_long_long))
      self%n = 0
      call explain(self, error)
   end subroutine flush_sink

   !> Write the rest and close. Without an open file nothing happens.
   subroutine close_sink(self, error, sync)
      class(file_sink_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      logical, intent(in), optional :: sync                !! true: wait until it is on the disk
      integer(c_int) :: status, wait
      if (self%handle < 0) return
      call self%flush(error)
      wait = 0
      if (present(sync)) wait = merge(1_c_int, 0_c_int, sync)
      if (self%handle > 2) then
         status = c_close(self%handle, wait)
         if (self%problem == 0) self%problem = status
      end if
      self%handle = -1
      if (.not. allocated(error)) call explain(self, error)
   end subroutine close_sink

   !> Is a file open?
   pure logical function is_open(self)
      class(file_sink_type), intent(in) :: self
      is_open = self%handle >= 0
   end function is_open

   !> Make an error of the first failure.
   subroutine explain(self, error)
      class(file_sink_type), intent(in) :: self
      type(error_type), allocatable, intent(out) :: error
      if (self%problem /= 0) call make_error(error, error_code%output, self%path//': '//errno_text(self%problem))
   end subroutine explain

end module rockdda_io_file_sink
