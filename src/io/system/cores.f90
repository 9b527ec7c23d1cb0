! SPDX-License-Identifier: MIT
!> The cores that the process may use, and how busy they are.
module rockdda_io_cores
   use, intrinsic :: iso_c_binding, only : c_double, c_int
   use rockdda_base_kinds, only : wp
   implicit none
   private
   public :: core_times_type, cores_allowed, read_core_times, sleep_seconds

   !> State of the clocks at one moment [s].
   type :: core_times_type
      logical :: is_known = .false.   !! false where the system does not report them
      real(wp) :: idle = 0            !! sum over the allowed cores of the time without work
      real(wp) :: own = 0             !! processor time of this process
      real(wp) :: now = 0             !! wall clock
   end type core_times_type

   interface
      integer(c_int) function c_allowed() bind(C, name='rockdda_cores_allowed')
         import :: c_int
      end function c_allowed

      integer(c_int) function c_times(idle, own, now) bind(C, name='rockdda_cores_times')
         import :: c_double, c_int
         real(c_double), intent(inout) :: idle, own, now
      end function c_times

      subroutine c_sleep(seconds) bind(C, name='rockdda_cores_sleep')
         import :: c_double
         real(c_double), value :: seconds
      end subroutine c_sleep
   end interface

contains

   !> Number of cores by affinity and by the quota of the control groups (batch systems, containers).
   integer function cores_allowed()
      cores_allowed = max(1, int(c_allowed()))
   end function cores_allowed

   !> Read the clocks.
   type(core_times_type) function read_core_times() result(times)
      real(c_double) :: idle, own, now
      idle = 0
      own = 0
      now = 0
      times%is_known = c_times(idle, own, now) == 0
      times%idle = real(idle, wp)
      times%own = real(own, wp)
      times%now = real(now, wp)
   end function read_core_times

   !> Wait.
   subroutine sleep_seconds(seconds)
      real(wp), intent(in) :: seconds
      call c_sleep(real(seconds, c_double))
   end subroutine sleep_seconds

end module rockdda_io_cores
