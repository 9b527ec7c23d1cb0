! SPDX-License-Identifier: MIT
!> Try work that may crash or never end in a child process first.
!>
!> HDF5 does not survive every damaged file: a wrong byte in the heap of its texts makes it read for ever. Usage:
!>
!>     call run_in_child(0.5_wp, outcome, error)
!>     if (outcome == guard%in_child) then
!>        ... the work, whose results are discarded ...
!>        call end_child(error)
!>     end if
!>     call explain(outcome, path, 'the file', error)
!>     if (allocated(error)) return      ! what the child refused is not read again
!>     call begin_reading(path)
!>     ... the work ...
!>     call end_reading()
!>
!> A file that the child could read may still crash the process itself, because what HDF5 does with a wrong byte depends
!> on what lies in the memory. Between `begin_reading` and `end_reading` the program reports such a crash as damage of
!> the file.
module rockdda_io_guard
   use, intrinsic :: iso_c_binding, only : c_char, c_double, c_int, c_null_char
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type, error_code, make_error
   implicit none
   private
   public :: run_in_child, end_child, explain, begin_reading, end_reading, guard

   type :: guard_enum
      integer :: in_child = 0
      integer :: passed = 1
      integer :: crashed = 2         !! or did not end
      integer :: no_process = 3      !! no child could be made: nothing was tried
      integer :: refused = 4         !! with an error
      integer :: no_memory = 5       !! with an error: the memory does not suffice
   end type guard_enum
   !> What `run_in_child` returns.
   type(guard_enum), parameter :: guard = guard_enum()

   !> Bytes of a message at most.
   integer, parameter :: longest = 4096

   interface
      integer(c_int) function c_begin(seconds, message, room) bind(C, name='rockdda_guard_begin')
         import :: c_char, c_double, c_int
         real(c_double), value :: seconds
         integer(c_int), value :: room
         character(kind=c_char), intent(inout) :: message(*)
      end function c_begin
      subroutine c_end(message, n) bind(C, name='rockdda_guard_end')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: message(*)
         integer(c_int), value :: n
      end subroutine c_end
      subroutine c_begin_reading(path) bind(C, name='rockdda_guard_begin_reading')
         import :: c_char
         character(kind=c_char), intent(in) :: path(*)
      end subroutine c_begin_reading
      subroutine end_reading() bind(C, name='rockdda_guard_end_reading')
      end subroutine end_reading
   end interface

contains

   !> Make a child process and return guard%in_child in it. In the parent wait for the end of the child.
   subroutine run_in_child(seconds, outcome, error)
      real(wp), intent(in) :: seconds  !! processor time that the work may take
      integer, intent(out) :: outcome  !! one of guard%...
      type(error_type), allocatable, intent(out) :: error   !! that of the child
      character(len=longest) :: message
      message = ''
      outcome = int(c_begin(real(seconds, c_double), message, int(longest, c_int)))
      if (outcome == guard%refused) call make_error(error, error_code%input, trim(message))
      if (outcome == guard%no_memory) call make_error(error, error_code%computation, 'out of memory', is_fatal=.true.)
   end subroutine run_in_child

   !> Why a file is not to be read, by how its trial in a child ended; `error` holds that of the child.
   subroutine explain(outcome, path, what, error)
      integer, intent(in) :: outcome                             !! one of guard%...
      character(len=*), intent(in) :: path
      character(len=*), intent(in) :: what                       !! 'the file'
      type(error_type), allocatable, intent(inout) :: error      !! unallocated: the file can be read
      select case (outcome)
      case (guard%crashed)
         call make_error(error, error_code%input, path//': '//what//' is damaged: HDF5 cannot read it')
      case (guard%no_memory)
         error%message = path//': '//error%message//' while it is read'
      end select
   end subroutine explain

   !> The file that the library reads from now on.
   subroutine begin_reading(path)
      character(len=*), intent(in) :: path
      call c_begin_reading(path//c_null_char)
   end subroutine begin_reading

   !> End the child; an error goes to the parent. Does not return.
   subroutine end_child(error)
      type(error_type), allocatable, intent(in) :: error
      if (allocated(error)) then
         call c_end(error%message, len(error%message, c_int))
      else
         call c_end('', 0_c_int)
      end if
   end subroutine end_child

end module rockdda_io_guard
