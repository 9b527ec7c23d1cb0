! SPDX-License-Identifier: MIT
!> Services of the system that Fortran lacks: kinds of paths, permissions, directory listings, renaming.
!> The C side is posix_shim.c.
module rockdda_io_posix
   use, intrinsic :: iso_c_binding, only : c_char, c_double, c_int, c_int64_t, c_null_char, c_ptr, &
                                           c_associated
   use rockdda_base_kinds, only : i8, wp
   implicit none
   private
   public :: path_kind, get_path_kind, get_file_size, is_readable, list_directory
   public :: rename_file, remove_file, file_name_type, format_real

   type :: path_kind_enum
      integer :: missing = 0
      integer :: file = 1       !! a regular file
      integer :: directory = 2
      integer :: other = 3      !! a device, a pipe, ...
      integer :: unknown = -1   !! not accessible, no permission along the path
   end type path_kind_enum
   type(path_kind_enum), parameter :: path_kind = path_kind_enum()

   !> A name, for lists of names of different lengths.
   type :: file_name_type
      character(len=:), allocatable :: name
   end type file_name_type

   interface
      integer(c_int) function c_path_kind(path) bind(C, name='rockdda_posix_path_kind')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: path(*)
      end function c_path_kind

      integer(c_int64_t) function c_file_size(path) bind(C, name='rockdda_posix_file_size')
         import :: c_char, c_int64_t
         character(kind=c_char), intent(in) :: path(*)
      end function c_file_size

      integer(c_int) function c_may_access(path, mode) bind(C, name='rockdda_posix_may_access')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int), value :: mode
      end function c_may_access

      type(c_ptr) function c_open_directory(path) bind(C, name='rockdda_posix_open_directory')
         import :: c_char, c_ptr
         character(kind=c_char), intent(in) :: path(*)
      end function c_open_directory

      integer(c_int) function c_next_entry(directory, name, size) bind(C, name='rockdda_posix_next_entry')
         import :: c_char, c_int, c_ptr
         type(c_ptr), value :: directory
         character(kind=c_char), intent(inout) :: name(*)
         integer(c_int), value :: size
      end function c_next_entry

      subroutine c_close_directory(directory) bind(C, name='rockdda_posix_close_directory')
         import :: c_ptr
         type(c_ptr), value :: directory
      end subroutine c_close_directory

      integer(c_int) function c_rename(from, to) bind(C, name='rockdda_posix_rename')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: from(*), to(*)
      end function c_rename

      pure subroutine c_format_real(value, digits, text, size, length) bind(C, name='rockdda_posix_format_real')
         import :: c_char, c_double, c_int
         real(c_double), value :: value
         integer(c_int), value :: digits, size
         character(kind=c_char), intent(inout) :: text(*)
         integer(c_int), intent(inout) :: length
      end subroutine c_format_real

      integer(c_int) function c_is_removable(path) bind(C, name='rockdda_posix_is_removable')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: path(*)
      end function c_is_removable

      integer(c_int) function c_remove(path) bind(C, name='rockdda_posix_remove')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: path(*)
      end function c_remove
   end interface

contains

   !> One of path_kind%...
   integer function get_path_kind(path)
      character(len=*), intent(in) :: path
      get_path_kind = int(c_path_kind(trim(path)//c_null_char))
   end function get_path_kind

   !> Size in bytes, -1 when it is not accessible.
   integer(i8) function get_file_size(path)
      character(len=*), intent(in) :: path
      get_file_size = int(c_file_size(trim(path)//c_null_char), i8)
   end function get_file_size

   !> May this process read the path?
   logical function is_readable(path)
      character(len=*), intent(in) :: path
      is_readable = c_may_access(trim(path)//c_null_char, 4_c_int) /= 0
   end function is_readable

   !> List all names in a folder, sorted by character code, without `.` and `..`; ok is false when it cannot be read.
   subroutine list_directory(path, names, ok)
      character(len=*), intent(in) :: path
      type(file_name_type), allocatable, intent(out) :: names(:)
      logical, intent(out) :: ok
      integer(c_int), parameter :: longest = 4096
      character(kind=c_char, len=longest) :: buffer
      type(file_name_type), allocatable :: larger(:)
      type(c_ptr) :: directory
      integer :: n, length
      allocate (names(0))
      directory = c_open_directory(trim(path)//c_null_char)
      ok = c_associated(directory)
      if (.not. ok) return
      allocate (larger(64))
      call move_alloc(larger, names)
      n = 0
      do
         length = int(c_next_entry(directory, buffer, longest))
         if (length < 0) exit
         if (buffer(1:length) == '.' .or. buffer(1:length) == '..') cycle
         if (n == size(names)) then
            allocate (larger(2*n))
            larger(1:n) = names
            call move_alloc(larger, names)
         end if
         n = n + 1
         names(n)%name = buffer(1:length)
      end do
      call c_close_directory(directory)
      names = names(1:n)
      call sort_names(names)
   end subroutine list_directory

   !> Sort names by insertion: folders of models are short lists.
   pure subroutine sort_names(names)
      type(file_name_type), intent(inout) :: names(:)
      character(len=:), allocatable :: held
      integer :: i, k
      do i = 2, size(names)
         held = names(i)%name
         k = i - 1
         do while (k > 0)
            if (lle(names(k)%name, held)) exit
            names(k + 1)%name = names(k)%name
            k = k - 1
         end do
         names(k + 1)%name = held
      end do
   end subroutine sort_names

   !> Replace `to` by `from` in one step; ok is false when the system refuses.
   subroutine rename_file(from, to, ok)
      character(len=*), intent(in) :: from, to
      logical, intent(out) :: ok
      ok = c_rename(trim(from)//c_null_char, trim(to)//c_null_char) == 0
   end subroutine rename_file

   !> Remove a file, of a symbolic link the link; a missing one is not an error.
   subroutine remove_file(path)
      character(len=*), intent(in) :: path
      integer(c_int) :: status
      if (c_is_removable(trim(path)//c_null_char) == 0) return
      status = c_remove(trim(path)//c_null_char)
      if (status /= 0) return
   end subroutine remove_file

   !> Text of a finite number with a given number of significant digits, trailing zeros left out.
   pure function format_real(value, digits) result(text)
      real(wp), intent(in) :: value
      integer, intent(in) :: digits               !! 1 to 17
      character(len=:), allocatable :: text
      character(kind=c_char, len=40) :: buffer
      integer(c_int) :: length
      length = 0
      call c_format_real(real(value, c_double), int(digits, c_int), buffer, len(buffer, c_int), length)
      text = buffer(1:length)
   end function format_real

end module rockdda_io_posix
