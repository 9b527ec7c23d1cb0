! SPDX-License-Identifier: MIT
!> The time of day for file headers, and a clock.
module rockdda_io_timestamp
   use, intrinsic :: iso_fortran_env, only : int64
   use rockdda_base_kinds, only : wp
   implicit none
   private
   public :: utc_now, wall_seconds

contains

   !> Now, in UTC, as 2026-01-31T12:00:00Z.
   function utc_now() result(text)
      character(len=20) :: text
      integer :: values(8)
      call date_and_time(values=values)
      text = utc_text(values)
   end function utc_now

   !> The values of `date_and_time` in UTC.
   pure function utc_text(values) result(text)
      integer, intent(in) :: values(8)   !! year, month, day, minutes ahead of UTC, hour, minute, second, ms
      character(len=20) :: text
      integer :: year, month, day, minutes, days
      year = values(1)
      month = values(2)
      day = values(3)
      minutes = 60*values(5) + values(6) - values(4)
      days = floor(minutes/1440.0)
      minutes = minutes - 1440*days
      day = day + days
      if (day < 1) then
         month = month - 1
         if (month < 1) then
            month = 12
            year = year - 1
         end if
         day = days_of(month, year)
      else if (day > days_of(month, year)) then
         day = 1
         month = month + 1
         if (month > 12) then
            month = 1
            year = year + 1
         end if
      end if
      write (text, '(i4.4, 2("-", i2.2), "T", i2.2, 2(":", i2.2), "Z")') year, month, day, minutes/60, &
         mod(minutes, 60), values(7)
   end function utc_text

   !> Days of a month.
   pure integer function days_of(month, year)
      integer, intent(in) :: month, year
      integer, parameter :: days(12) = [31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31]
      days_of = days(month)
      if (month /= 2) return
      if ((mod(year, 4) == 0 .and. mod(year, 100) /= 0) .or. mod(year, 400) == 0) days_of = 29
   end function days_of

   !> Seconds on the wall clock since some fixed moment.
   real(wp) function wall_seconds()
      integer(int64) :: count, rate
      call system_clock(count, rate)
      wall_seconds = real(count, wp)/real(max(1_int64, rate), wp)
   end function wall_seconds

end module rockdda_io_timestamp
