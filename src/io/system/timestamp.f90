! SPDX-License-Identifier: MIT
!> The time of day for file headers, and a clock.
module rockdda_io_timestamp
   use, intrinsic :: iso_c_binding, only : c_char
   use, intrinsic :: iso_fortran_env, only : int64
   use rockdda_base_kinds, only : wp
   implicit none
   private
   public :: utc_now, wall_seconds

   interface
      subroutine c_utc_now(text) bind(C, name='rockdda_posix_utc_now')
         import :: c_char
         character(kind=c_char), intent(inout) :: text(20)
      end subroutine c_utc_now
   end interface

contains

   !> Now, in UTC, as 2026-01-31T12:00:00Z.
   function utc_now() result(text)
      character(len=20) :: text
      call c_utc_now(text)
   end function utc_now

   !> Seconds on the wall clock since some fixed moment.
   real(wp) function wall_seconds()
      integer(int64) :: count, rate
      call system_clock(count, rate)
      wall_seconds = real(count, wp)/real(max(1_int64, rate), wp)
   end function wall_seconds

end module rockdda_io_timestamp
