! SPDX-License-Identifier: MIT
!> Lock of an output file: no file is overwritten by accident, no two runs write the same file.
!>
!> The lock is on the output file itself, ends with the process, and does not affect readers. A new file is written as
!> `part_path` until `publish` renames it, so that it is readable at any moment, however early the process is killed.
module rockdda_io_output_lock
   use, intrinsic :: iso_c_binding, only : c_char, c_int, c_null_char
   use rockdda_base_error, only : error_type, error_code, make_error
   implicit none
   private
   public :: output_lock_type, is_same_file, errno_text, part_path

   type :: output_lock_type
      private
      integer(c_int) :: handle = -1
      integer(c_int) :: replaced = -1                !! the file that it will replace
      logical :: force = .false.
      character(len=:), allocatable :: path          !! present path of the file
      character(len=:), allocatable :: target        !! final path
   contains
      procedure :: create => create_output
      procedure :: publish => publish_output
      procedure :: discard => discard_output
      procedure :: reopen => reopen_output
      procedure :: check => check_place
      procedure :: release => release_output
   end type output_lock_type

   integer(c_int), parameter :: status_ok = 0, status_exists = -1, status_busy = -2, status_special = -3, &
                               status_link = -4

   interface
      integer(c_int) function c_create(path, part, force, handle, replaced) bind(C, name='rockdda_output_create')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: path(*), part(*)
         integer(c_int), value :: force
         integer(c_int), intent(out) :: handle, replaced
      end function c_create

      integer(c_int) function c_publish(part, path, force) bind(C, name='rockdda_output_publish')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: part(*), path(*)
         integer(c_int), value :: force
      end function c_publish

      integer(c_int) function c_remove(path) bind(C, name='rockdda_posix_remove')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: path(*)
      end function c_remove

      integer(c_int) function c_reopen(path, handle) bind(C, name='rockdda_output_reopen')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int), intent(out) :: handle
      end function c_reopen

      integer(c_int) function c_is_there(path, handle) bind(C, name='rockdda_output_is_there')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int), value :: handle
      end function c_is_there

      integer(c_int) function c_is_same(one, other) bind(C, name='rockdda_output_is_same')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: one(*), other(*)
      end function c_is_same

      subroutine c_release(handle) bind(C, name='rockdda_output_release')
         import :: c_int
         integer(c_int), value :: handle
      end subroutine c_release

      subroutine c_errno_text(code, text, size) bind(C, name='rockdda_errno_text')
         import :: c_char, c_int
         integer(c_int), value :: code, size
         character(kind=c_char), intent(out) :: text(*)
      end subroutine c_errno_text
   end interface

contains

   !> Name of an output file until it is readable.
   pure function part_path(path) result(part)
      character(len=*), intent(in) :: path
      character(len=:), allocatable :: part
      part = path//'.part'
   end function part_path

   !> Create and lock an empty file part_path(path). An existing file at `path` is an input error without `force`;
   !> with it `publish` replaces the file, unless a running process writes it.
   subroutine create_output(self, path, force, error)
      class(output_lock_type), intent(inout) :: self
      character(len=*), intent(in) :: path
      logical, intent(in) :: force
      type(error_type), allocatable, intent(out) :: error
      call self%release()
      self%path = part_path(path)
      self%target = path
      self%force = force
      call explain(c_create(path//c_null_char, self%path//c_null_char, merge(1_c_int, 0_c_int, force), self%handle, &
                            self%replaced), path, error)
      if (.not. allocated(error)) return
      self%handle = -1
      self%replaced = -1
   end subroutine create_output

   !> Rename the file to its final name.
   subroutine publish_output(self, error)
      class(output_lock_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      call self%check(error)
      if (.not. allocated(error)) call explain(c_publish(self%path//c_null_char, self%target//c_null_char, &
                                                         merge(1_c_int, 0_c_int, self%force)), self%target, error)
      if (allocated(error)) return
      self%path = self%target
      if (self%replaced >= 0) call c_release(self%replaced)
      self%replaced = -1
   end subroutine publish_output

   !> Remove a file that was not published, and release its lock.
   subroutine discard_output(self)
      class(output_lock_type), intent(inout) :: self
      integer(c_int) :: status
      if (self%handle >= 0 .and. allocated(self%target)) then
         status = 0
         if (self%path /= self%target) status = c_remove(self%path//c_null_char)
         if (status /= 0) self%path = self%target
      end if
      call self%release()
   end subroutine discard_output

   !> Lock an existing file that is continued.
   subroutine reopen_output(self, path, error)
      class(output_lock_type), intent(inout) :: self
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(out) :: error
      call self%release()
      self%path = path
      self%target = path
      call explain(c_reopen(path//c_null_char, self%handle), path, error)
      if (allocated(error)) self%handle = -1
   end subroutine reopen_output

   !> Check that the file was neither removed nor replaced.
   subroutine check_place(self, error)
      class(output_lock_type), intent(in) :: self
      type(error_type), allocatable, intent(out) :: error
      if (self%handle < 0) return
      if (c_is_there(self%path//c_null_char, self%handle) == 0) call make_error(error, error_code%output, &
         self%path//': the file was removed or replaced while it was being written')
   end subroutine check_place

   !> Release the lock, if one is held.
   subroutine release_output(self)
      class(output_lock_type), intent(inout) :: self
      if (self%handle >= 0) call c_release(self%handle)
      if (self%replaced >= 0) call c_release(self%replaced)
      self%handle = -1
      self%replaced = -1
   end subroutine release_output

   !> Do two paths name one existing file?
   logical function is_same_file(one, other)
      character(len=*), intent(in) :: one, other
      is_same_file = c_is_same(one//c_null_char, other//c_null_char) /= 0
   end function is_same_file

   !> Turn a status of the shim into an error.
   subroutine explain(status, path, error)
      integer(c_int), intent(in) :: status
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(out) :: error
      select case (status)
      case (status_ok)
         return
      case (status_exists)
         call make_error(error, error_code%input, path//': the file exists; use --force to overwrite it')
      case (status_busy)
         call make_error(error, error_code%input, path//': another run is writing this file')
      case (status_special)
         call make_error(error, error_code%input, path//': this is no regular file: results cannot be written to it')
      case (status_link)
         call make_error(error, error_code%input, path//': this is a symbolic link: results are not written through it')
      case default
         call make_error(error, error_code%output, path//': '//errno_text(status))
      end select
   end subroutine explain

   !> The system's message for an error number.
   function errno_text(code) result(text)
      integer(c_int), intent(in) :: code
      character(len=:), allocatable :: text
      character(kind=c_char, len=1) :: buffer(200)
      integer :: i
      call c_errno_text(code, buffer, size(buffer, kind=c_int))
      text = ''
      do i = 1, size(buffer)
         if (buffer(i) == c_null_char) exit
         text = text//buffer(i)
      end do
   end function errno_text

end module rockdda_io_output_lock
