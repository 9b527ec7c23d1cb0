! SPDX-License-Identifier: MIT
!> Number kinds used everywhere.
module rockdda_base_kinds
   use, intrinsic :: iso_fortran_env, only : real64, int64
   implicit none
   private
   public :: wp, i8, pi

   !> Working precision: every real in the program.
   integer, parameter :: wp = real64
   !> Integers for byte counts, offsets into large arrays, random numbers.
   integer, parameter :: i8 = int64
   real(wp), parameter :: pi = 3.141592653589793238462643383279502884_wp

end module rockdda_base_kinds
