! SPDX-License-Identifier: MIT
!> Units that records of ground motion name: in the header of a column, or in that of a file of PEER.
module rockdda_io_acceleration_units
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : lower_case, replaced
   implicit none
   private
   public :: acceleration_unit, time_unit, is_of_other_quantity, known_units

   character(len=*), parameter :: known_units = 'g, m/s2, cm/s2 (gal), mm/s2, ft/s2, in/s2'

contains

   !> A unit of acceleration in m/s², 0: it is none.
   pure real(wp) function acceleration_unit(text) result(metres)
      character(len=*), intent(in) :: text
      select case (plain(text))
      case ('g', "g's", 'gs'); metres = 9.81_wp
      case ('m/s2', 'm/s/s', 'ms-2'); metres = 1.0_wp
      case ('cm/s2', 'cm/s/s', 'cms-2', 'gal', 'gals'); metres = 0.01_wp
      case ('mm/s2', 'mm/s/s', 'mms-2'); metres = 0.001_wp
      case ('ft/s2', 'ft/s/s'); metres = 0.3048_wp
      case ('in/s2', 'in/s/s'); metres = 0.0254_wp
      case default; metres = 0.0_wp
      end select
   end function acceleration_unit

   !> A unit of time in seconds, 0: it is none.
   pure real(wp) function time_unit(text) result(seconds)
      character(len=*), intent(in) :: text
      select case (plain(text))
      case ('s', 'ss', 'second', 'seconds'); seconds = 1.0_wp
      case ('ms', 'msec'); seconds = 0.001_wp
      case ('min', 'minutes'); seconds = 60.0_wp
      case default; seconds = 0.0_wp
      end select
   end function time_unit

   !> Is this a unit of velocity or of length?
   pure logical function is_of_other_quantity(text)
      character(len=*), intent(in) :: text
      select case (plain(text))
      case ('m', 'cm', 'mm', 'ft', 'in', 'm/s', 'cm/s', 'mm/s', 'ft/s', 'in/s'); is_of_other_quantity = .true.
      case default; is_of_other_quantity = .false.
      end select
   end function is_of_other_quantity

   !> The text in one spelling: "CM/SEC**2." is cm/s2.
   pure function plain(text) result(word)
      character(len=*), intent(in) :: text
      character(len=:), allocatable :: word
      character(len=*), parameter :: square_utf_8 = char(194)//char(178), square_latin_1 = char(178)
      word = lower_case(text)
      word = replaced(word, square_utf_8, '2')
      word = replaced(word, square_latin_1, '2')
      word = replaced(word, 'sec', 's')
      word = replaced(word, ' ', '')
      word = replaced(word, achar(9), '')
      word = replaced(word, '*', '')
      word = replaced(word, '^', '')
      word = replaced(word, '.', '')
      word = replaced(word, ',', '')
   end function plain

end module rockdda_io_acceleration_units
