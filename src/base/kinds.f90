! SPDX-License-Identifier: MIT
!> Number kinds used everywhere.
module rockdda_base_kinds
   use, intrinsic :: iso_c_binding, only : c_bool
   use, intrinsic :: iso_fortran_env, only : real64, int64, int8, int16
   implicit none
   private
   public :: wp, i8, i2, i1, l1, pi

   !> Working precision: every real in the program.
   integer, parameter :: wp = real64
   !> Integers for byte counts, offsets into large arrays, random numbers.
   integer, parameter :: i8 = int64
   !> Integers and logicals of one and two bytes, for states, signs and counts of all contacts.
   integer, parameter :: i1 = int8, i2 = int16, l1 = c_bool
   real(wp), parameter :: pi = 3.141592653589793238462643383279502884_wp

end module rockdda_base_kinds
