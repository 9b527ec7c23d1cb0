! SPDX-License-Identifier: MIT
!> First use of large arrays. The system gives the memory of a new array page by page, at the first number that is
!> written to each, and such a fault takes longer than clearing the page. Here one call takes many pages, and very large
!> arrays ask for huge ones.
module rockdda_base_first_use
   use, intrinsic :: iso_c_binding, only : c_ptr, c_loc, c_size_t
   use, intrinsic :: iso_fortran_env, only : real32
   use rockdda_base_kinds, only : wp, i8
   implicit none
   private
   public :: set_zero, take_pages, take_bytes

   !> Bytes that are taken and cleared at a time: they stay in the cache in between.
   integer(i8), parameter :: part = 2_i8**22
   !> Smaller arrays are left to faults [bytes].
   integer(i8), parameter :: large = 2_i8**20
   !> Arrays from here on take huge pages as far as these fit whole into them [bytes].
   integer(i8), parameter :: huge_pages = 2_i8**27

   !> Set all numbers of an array, or of a contiguous section, to zero.
   interface set_zero
      module procedure set_zero_1
      module procedure set_zero_2
      module procedure set_zero_3
      module procedure set_zero_of_integers
      module procedure set_zero_of_integers_2
   end interface set_zero

   !> Take the pages of an array of which all numbers are written next.
   interface take_pages
      module procedure take_pages_1
      module procedure take_pages_2
      module procedure take_pages_3
      module procedure take_pages_of_real32
   end interface take_pages

   interface
      pure subroutine c_take(from, bytes) bind(C, name='rockdda_memory_take')
         import :: c_ptr, c_size_t
         type(c_ptr), value, intent(in) :: from
         integer(c_size_t), value, intent(in) :: bytes
      end subroutine c_take

      pure subroutine c_widen(from, bytes) bind(C, name='rockdda_memory_widen')
         import :: c_ptr, c_size_t
         type(c_ptr), value, intent(in) :: from
         integer(c_size_t), value, intent(in) :: bytes
      end subroutine c_widen
   end interface

contains

   !> Numbers.
   pure subroutine set_zero_1(array)
      real(wp), intent(inout), contiguous :: array(:)
      call clear_reals(size(array, kind=i8), array)
   end subroutine set_zero_1

   !> Columns.
   pure subroutine set_zero_2(array)
      real(wp), intent(inout), contiguous :: array(:, :)
      call clear_reals(size(array, kind=i8), array)
   end subroutine set_zero_2

   !> Matrices.
   pure subroutine set_zero_3(array)
      real(wp), intent(inout), contiguous :: array(:, :, :)
      call clear_reals(size(array, kind=i8), array)
   end subroutine set_zero_3

   !> Integers.
   pure subroutine set_zero_of_integers(array)
      integer, intent(inout), contiguous :: array(:)
      call clear_integers(size(array, kind=i8), array)
   end subroutine set_zero_of_integers

   !> Columns of integers.
   pure subroutine set_zero_of_integers_2(array)
      integer, intent(inout), contiguous :: array(:, :)
      call clear_integers(size(array, kind=i8), array)
   end subroutine set_zero_of_integers_2

   !> Numbers.
   pure subroutine take_pages_1(array)
      real(wp), intent(inout), contiguous, target :: array(:)
      call take_bytes(c_loc(array), 8*size(array, kind=i8))
   end subroutine take_pages_1

   !> Columns.
   pure subroutine take_pages_2(array)
      real(wp), intent(inout), contiguous, target :: array(:, :)
      call take_bytes(c_loc(array), 8*size(array, kind=i8))
   end subroutine take_pages_2

   !> Matrices.
   pure subroutine take_pages_3(array)
      real(wp), intent(inout), contiguous, target :: array(:, :, :)
      call take_bytes(c_loc(array), 8*size(array, kind=i8))
   end subroutine take_pages_3

   !> Columns in single precision.
   pure subroutine take_pages_of_real32(array)
      real(real32), intent(inout), contiguous, target :: array(:, :)
      call take_bytes(c_loc(array), 4*size(array, kind=i8))
   end subroutine take_pages_of_real32

   !> Take the pages of other memory all of which is written next.
   pure subroutine take_bytes(from, bytes)
      type(c_ptr), intent(in) :: from
      integer(i8), intent(in) :: bytes
      if (bytes < large) return
      if (bytes >= huge_pages) call c_widen(from, int(bytes, c_size_t))
      call c_take(from, int(bytes, c_size_t))
   end subroutine take_bytes

   !> n numbers to zero.
   pure subroutine clear_reals(n, array)
      integer(i8), intent(in) :: n
      real(wp), intent(inout), target :: array(n)
      integer(i8) :: first, last
      if (8*n >= huge_pages) call c_widen(c_loc(array), int(8*n, c_size_t))
      do first = 1, n, part/8
         last = min(n, first + part/8 - 1)
         if (8*n >= large) call c_take(c_loc(array(first)), int(8*(last - first + 1), c_size_t))
         array(first:last) = 0
      end do
   end subroutine clear_reals

   !> n integers to zero.
   pure subroutine clear_integers(n, array)
      integer(i8), intent(in) :: n
      integer, intent(inout), target :: array(n)
      integer(i8) :: first, last
      if (4*n >= huge_pages) call c_widen(c_loc(array), int(4*n, c_size_t))
      do first = 1, n, part/4
         last = min(n, first + part/4 - 1)
         if (4*n >= large) call c_take(c_loc(array(first)), int(4*(last - first + 1), c_size_t))
         array(first:last) = 0
      end do
   end subroutine clear_integers

end module rockdda_base_first_use
