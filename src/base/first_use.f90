! SPDX-License-Identifier: MIT
!> First use of large arrays. The system gives the memory of a new array page by page, at the first number that is
!> written to each, and such a fault takes longer than clearing the page. Here one call takes many pages, all threads
!> share the work, and very large arrays ask for huge pages.
module rockdda_base_first_use
   use, intrinsic :: iso_c_binding, only : c_ptr, c_loc, c_size_t, c_int
   use, intrinsic :: iso_fortran_env, only : real32
   use rockdda_base_kinds, only : wp, i8
   implicit none
   private
   public :: set_zero, take_pages, take_bytes

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
      pure subroutine c_take(from, bytes, clears, is_huge) bind(C, name='rockdda_memory_take')
         import :: c_ptr, c_size_t, c_int
         type(c_ptr), value, intent(in) :: from
         integer(c_size_t), value, intent(in) :: bytes
         integer(c_int), value, intent(in) :: clears, is_huge   !! 0 or 1
      end subroutine c_take
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
      if (bytes >= large) call take(from, bytes, 0_c_int)
   end subroutine take_bytes

   !> n numbers to zero.
   pure subroutine clear_reals(n, array)
      integer(i8), intent(in) :: n
      real(wp), intent(inout), target :: array(n)
      if (8*n < large) then
         array = 0
      else
         call take(c_loc(array), 8*n, 1_c_int)
      end if
   end subroutine clear_reals

   !> n integers to zero.
   pure subroutine clear_integers(n, array)
      integer(i8), intent(in) :: n
      integer, intent(inout), target :: array(n)
      if (4*n < large) then
         array = 0
      else
         call take(c_loc(array), 4*n, 1_c_int)
      end if
   end subroutine clear_integers

   !> Take pages, and set them to zero if wanted.
   pure subroutine take(from, bytes, clears)
      type(c_ptr), intent(in) :: from
      integer(i8), intent(in) :: bytes
      integer(c_int), intent(in) :: clears   !! 0 or 1
      call c_take(from, int(bytes, c_size_t), clears, merge(1_c_int, 0_c_int, bytes >= huge_pages))
   end subroutine take

end module rockdda_base_first_use
