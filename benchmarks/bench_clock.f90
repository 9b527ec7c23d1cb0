! SPDX-License-Identifier: MIT
!> Clocks and memory of this process.
module bench_clock
   use, intrinsic :: iso_c_binding, only : c_int, c_long
   use rockdda_base_kinds, only : wp, i8
   implicit none
   private
   public :: stopwatch_type, resident_bytes

   !> Seconds between start and stop: on the wall clock, processor time of all threads, and of the first thread alone.
   type :: stopwatch_type
      real(wp) :: wall = 0, cpu = 0, first_thread = 0
      integer(i8), private :: ticks = 0
      real(wp), private :: cpu_start = 0, first_start = 0
   contains
      procedure :: start
      procedure :: stop => stop_watch
   end type stopwatch_type

   !> struct timespec.
   type, bind(c) :: timespec_type
      integer(c_long) :: seconds, nanoseconds
   end type timespec_type

   !> CLOCK_THREAD_CPUTIME_ID of Linux.
   integer(c_int), parameter :: thread_clock = 3

   interface
      !> POSIX clock_gettime.
      integer(c_int) function clock_gettime(clock, time) bind(c, name='clock_gettime')
         import :: c_int, timespec_type
         integer(c_int), value, intent(in) :: clock
         type(timespec_type), intent(out) :: time
      end function clock_gettime
   end interface

contains

   !> Processor time of the calling thread.
   real(wp) function thread_seconds()
      type(timespec_type) :: time
      thread_seconds = 0
      if (clock_gettime(thread_clock, time) /= 0) return
      thread_seconds = real(time%seconds, wp) + 1.0e-9_wp*real(time%nanoseconds, wp)
   end function thread_seconds

   !> Start measuring.
   subroutine start(self)
      class(stopwatch_type), intent(inout) :: self
      call cpu_time(self%cpu_start)
      self%first_start = thread_seconds()
      call system_clock(self%ticks)
   end subroutine start

   !> Stop measuring.
   subroutine stop_watch(self)
      class(stopwatch_type), intent(inout) :: self
      integer(i8) :: ticks, rate
      real(wp) :: cpu
      call system_clock(ticks, rate)
      call cpu_time(cpu)
      self%wall = real(ticks - self%ticks, wp)/real(rate, wp)
      self%cpu = cpu - self%cpu_start
      self%first_thread = thread_seconds() - self%first_start
   end subroutine stop_watch

   !> Resident memory ('VmRSS:') or its maximum ('VmHWM:') from /proc of Linux; 0 on other systems.
   integer(i8) function resident_bytes(name)
      character(len=*), intent(in) :: name
      character(len=256) :: text
      integer :: unit, status
      resident_bytes = 0
      open (newunit=unit, file='/proc/self/status', action='read', status='old', iostat=status)
      if (status /= 0) return
      do
         read (unit, '(a)', iostat=status) text
         if (status /= 0) exit
         if (index(text, name) /= 1) cycle
         read (text(len(name) + 1:), *, iostat=status) resident_bytes
         if (status /= 0) resident_bytes = 0
         resident_bytes = 1024*resident_bytes
         exit
      end do
      close (unit)
   end function resident_bytes

end module bench_clock
