! SPDX-License-Identifier: MIT
!> Numbers in decimal notation: 12, -3., .5, 1e3, 1.0d3, 1.0D+03.
module rockdda_base_numbers
   use rockdda_base_kinds, only : wp, i8
   implicit none
   private
   public :: parse_number, number_status, is_whole

   type :: number_status_enum
      integer :: ok = 0
      integer :: text = 1          !! not a number (NaN and Inf are text)
      integer :: out_of_range = 2  !! a number outside the range of double precision
   end type number_status_enum
   type(number_status_enum), parameter :: number_status = number_status_enum()

   !> Powers of ten that are exact in double precision.
   real(wp), parameter :: power(0:22) = [1.0e0_wp, 1.0e1_wp, 1.0e2_wp, 1.0e3_wp, 1.0e4_wp, 1.0e5_wp, 1.0e6_wp, &
                                         1.0e7_wp, 1.0e8_wp, 1.0e9_wp, 1.0e10_wp, 1.0e11_wp, 1.0e12_wp, 1.0e13_wp, &
                                         1.0e14_wp, 1.0e15_wp, 1.0e16_wp, 1.0e17_wp, 1.0e18_wp, 1.0e19_wp, &
                                         1.0e20_wp, 1.0e21_wp, 1.0e22_wp]

contains

   !> Convert a token to a number, correctly rounded.
   pure subroutine parse_number(text, value, status)
      character(len=*), intent(in) :: text
      real(wp), intent(out) :: value        !! 0 unless status is ok
      integer, intent(out) :: status        !! one of number_status%...
      integer(i8) :: digits
      integer :: i, n, n_digits, n_significant, n_behind, exponent, exponent_sign, exponent_digits
      logical :: negative, point

      value = 0
      status = number_status%text
      n = len(text)
      i = 1
      negative = .false.
      if (n == 0) return
      if (text(1:1) == '+' .or. text(1:1) == '-') then
         negative = text(1:1) == '-'
         i = 2
      end if
      digits = 0; n_digits = 0; n_significant = 0; n_behind = 0
      point = .false.
      do while (i <= n)
         if (text(i:i) >= '0' .and. text(i:i) <= '9') then
            n_digits = n_digits + 1
            if (point) n_behind = n_behind + 1
            if (n_significant > 0 .or. text(i:i) /= '0') n_significant = n_significant + 1
            if (n_significant <= 17) digits = 10*digits + iachar(text(i:i)) - iachar('0')
         else if (text(i:i) == '.' .and. .not. point) then
            point = .true.
         else
            exit
         end if
         i = i + 1
      end do
      if (n_digits == 0) return
      exponent = 0
      if (i <= n) then
         if (scan(text(i:i), 'eEdD') == 0) return
         i = i + 1
         exponent_sign = 1
         if (i <= n) then
            if (text(i:i) == '+' .or. text(i:i) == '-') then
               if (text(i:i) == '-') exponent_sign = -1
               i = i + 1
            end if
         end if
         exponent_digits = 0
         do while (i <= n)
            if (text(i:i) < '0' .or. text(i:i) > '9') return
            exponent_digits = exponent_digits + 1
            if (exponent < 100000) exponent = 10*exponent + iachar(text(i:i)) - iachar('0')
            i = i + 1
         end do
         if (exponent_digits == 0) return
         exponent = exponent_sign*exponent
      end if

      status = number_status%ok
      if (n_significant == 0) then
         if (negative) value = -value
         return
      end if
      exponent = exponent - n_behind
      if (n_significant <= 15 .and. abs(exponent) <= 22) then
         ! digits and the power of ten are both exact: one rounding
         value = real(digits, wp)
         if (exponent < 0) then
            value = value/power(-exponent)
         else
            value = value*power(exponent)
         end if
         if (negative) value = -value
      else if (is_too_large(digits, n_significant, n_significant + exponent)) then
         status = number_status%out_of_range
      else
         call read_value(text, value, status)
      end if
   end subroutine parse_number

   !> Is 0.d1d2d3… * 10**exponent beyond the largest real? (Tested before the conversion, which would raise overflow.)
   pure logical function is_too_large(digits, n_significant, exponent)
      integer(i8), intent(in) :: digits        !! the first 17 significant digits, or all when there are fewer
      integer, intent(in) :: n_significant     !! number of significant digits
      integer, intent(in) :: exponent
      integer(i8), parameter :: largest = 17976931348623157_i8  !! first 17 digits of huge(1.0_wp)
      integer(i8) :: leading
      is_too_large = exponent > 309
      if (exponent /= 309) return
      leading = digits*10_i8**max(0, 17 - n_significant)
      is_too_large = leading > largest .or. (leading == largest .and. n_significant > 17)
   end function is_too_large

   !> Convert any number: the run-time library rounds correctly.
   pure subroutine read_value(text, value, status)
      character(len=*), intent(in) :: text
      real(wp), intent(out) :: value
      integer, intent(out) :: status
      character(len=20) :: form
      integer :: io
      value = 0
      status = number_status%out_of_range
      write (form, '(a,i0,a)') '(f', len(text), '.0)'
      read (text, form, iostat=io) value
      if (io == 0 .and. abs(value) <= huge(value) .and. abs(value) > 0) then
         status = number_status%ok
      else
         value = 0
      end if
   end subroutine read_value

   !> Is a value a whole number that fits a default integer?
   pure logical function is_whole(value)
      real(wp), intent(in) :: value
      is_whole = abs(value) <= real(huge(1), wp)
      if (is_whole) is_whole = .not. abs(value - anint(value)) > 0
   end function is_whole

end module rockdda_base_numbers
