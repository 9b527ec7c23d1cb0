! SPDX-License-Identifier: MIT
!> What the fuzzer asks of the system: children with limits, shared counters, folders, whole files.
module fuzz_system
   use, intrinsic :: iso_c_binding, only : c_char, c_double, c_f_pointer, c_int, c_int32_t, c_null_char, c_ptr
   implicit none
   private
   public :: fork_child, limit_child, wait_for_child, leave, share, make_folder, enter_folder, clear_folder
   public :: children_seconds, trap_nothing, read_text, write_text

   interface
      subroutine trap_nothing() bind(C, name='fuzz_trap_nothing')
      end subroutine trap_nothing
      integer(c_int) function c_fork() bind(C, name='fuzz_fork')
         import :: c_int
      end function c_fork
      subroutine c_limit(output, seconds, wall_seconds, megabytes) bind(C, name='fuzz_limit')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: output(*)
         integer(c_int), value :: seconds, wall_seconds, megabytes
      end subroutine c_limit
      integer(c_int) function c_wait(child) bind(C, name='fuzz_wait')
         import :: c_int
         integer(c_int), value :: child
      end function c_wait
      subroutine c_leave(code) bind(C, name='fuzz_leave')
         import :: c_int
         integer(c_int), value :: code
      end subroutine c_leave
      type(c_ptr) function c_share(count) bind(C, name='fuzz_share')
         import :: c_int, c_ptr
         integer(c_int), value :: count
      end function c_share
      integer(c_int) function c_make_folder(path) bind(C, name='fuzz_make_folder')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: path(*)
      end function c_make_folder
      integer(c_int) function c_enter(path) bind(C, name='fuzz_enter')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: path(*)
      end function c_enter
      subroutine c_clear(path) bind(C, name='fuzz_clear')
         import :: c_char
         character(kind=c_char), intent(in) :: path(*)
      end subroutine c_clear
      real(c_double) function c_children_seconds() bind(C, name='fuzz_children_seconds')
         import :: c_double
      end function c_children_seconds
   end interface

contains

   !> A new process: 0 in the child, its number in the parent, negative when there can be none.
   integer function fork_child()
      fork_child = int(c_fork())
   end function fork_child

   !> In a child: send output to a file and set limits.
   subroutine limit_child(output, seconds, wall_seconds, megabytes)
      character(len=*), intent(in) :: output
      integer, intent(in) :: seconds, wall_seconds   !! processor time and time [s]
      integer, intent(in) :: megabytes               !! beyond what is in use; 0: any
      call c_limit(output//c_null_char, int(seconds, c_int), int(wall_seconds, c_int), int(megabytes, c_int))
   end subroutine limit_child

   !> Exit code of a child, or 1000 + the number of the signal that ended it.
   integer function wait_for_child(child)
      integer, intent(in) :: child
      wait_for_child = int(c_wait(int(child, c_int)))
   end function wait_for_child

   !> End this process at once.
   subroutine leave(code)
      integer, intent(in) :: code
      call c_leave(int(code, c_int))
   end subroutine leave

   !> Whole numbers, zero at first, that this process and its children share.
   subroutine share(count, values)
      integer, intent(in) :: count
      integer(c_int32_t), pointer, intent(out) :: values(:)
      call c_f_pointer(c_share(int(count, c_int)), values, [count])
   end subroutine share

   !> Make a folder; one that is there is as good.
   subroutine make_folder(path)
      character(len=*), intent(in) :: path
      integer(c_int) :: status
      status = c_make_folder(path//c_null_char)
      if (status /= 0) return
   end subroutine make_folder

   !> Change the current folder; ok is false when that cannot be.
   subroutine enter_folder(path, ok)
      character(len=*), intent(in) :: path
      logical, intent(out) :: ok
      ok = c_enter(path//c_null_char) == 0
   end subroutine enter_folder

   !> Remove everything in a folder.
   subroutine clear_folder(path)
      character(len=*), intent(in) :: path
      call c_clear(path//c_null_char)
   end subroutine clear_folder

   !> Processor time of the children that have ended [s].
   double precision function children_seconds()
      children_seconds = real(c_children_seconds(), kind(children_seconds))
   end function children_seconds

   !> A whole file; '' when it cannot be read.
   function read_text(path) result(text)
      character(len=*), intent(in) :: path
      character(len=:), allocatable :: text
      integer :: unit, status, length
      text = ''
      open (newunit=unit, file=path, status='old', action='read', access='stream', form='unformatted', iostat=status)
      if (status /= 0) return
      inquire (unit=unit, size=length)
      text = repeat(' ', max(0, length))
      if (length > 0) read (unit, iostat=status) text
      if (status /= 0) text = ''
      close (unit)
   end function read_text

   !> Make a file of these bytes.
   subroutine write_text(path, text)
      character(len=*), intent(in) :: path, text
      integer :: unit, status
      open (newunit=unit, file=path, status='replace', action='write', access='stream', form='unformatted', &
            iostat=status)
      if (status /= 0) return
      if (len(text) > 0) write (unit, iostat=status) text
      if (status == 0) then
         close (unit)
      else
         close (unit, status='delete')
      end if
   end subroutine write_text

end module fuzz_system
