! SPDX-License-Identifier: MIT
!> Allocation of work arrays that are kept from call to call, and of lists that grow.
module rockdda_base_room
   use, intrinsic :: iso_fortran_env, only : real32, real64
   use rockdda_base_kinds, only : wp
   implicit none
   private
   public :: reserve, resize, grow

   !> Allocate at least n numbers. A quarter more makes that rare while n grows; contents are lost then.
   interface reserve
      module procedure reserve_integers
      module procedure reserve_reals
   end interface reserve

   !> Give an array exactly n columns; contents are lost when the number changes.
   interface resize
      module procedure resize_real32
      module procedure resize_real64
   end interface resize

   !> Room for at least a given number of values, or columns, in a list that grows; what is in it is kept.
   interface grow
      module procedure grow_reals
      module procedure grow_integers
      module procedure grow_logicals
      module procedure grow_real_columns
      module procedure grow_integer_columns
   end interface grow

   !> Numbers of a list at first.
   integer, parameter :: first_room = 64

contains

   !> Integers.
   pure subroutine reserve_integers(array, n)
      integer, allocatable, intent(inout) :: array(:)    !! (>= n)
      integer, intent(in) :: n
      if (allocated(array)) then
         if (size(array) >= n) return
         deallocate (array)
      end if
      allocate (array(n + n/4 + 16))
   end subroutine reserve_integers

   !> Reals.
   pure subroutine reserve_reals(array, n)
      real(wp), allocatable, intent(inout) :: array(:)   !! (>= n)
      integer, intent(in) :: n
      if (allocated(array)) then
         if (size(array) >= n) return
         deallocate (array)
      end if
      allocate (array(n + n/4 + 16))
   end subroutine reserve_reals

   !> Columns in single precision.
   pure subroutine resize_real32(array, rows, n)
      real(real32), allocatable, intent(inout) :: array(:, :)   !! (rows, n)
      integer, intent(in) :: rows, n                            !! rows: the same in all calls for one array
      if (allocated(array)) then
         if (size(array, 2) == n) return
         deallocate (array)
      end if
      allocate (array(rows, n))
   end subroutine resize_real32

   !> Columns in double precision.
   pure subroutine resize_real64(array, rows, n)
      real(real64), allocatable, intent(inout) :: array(:, :)   !! (rows, n)
      integer, intent(in) :: rows, n                            !! rows: the same in all calls for one array
      if (allocated(array)) then
         if (size(array, 2) == n) return
         deallocate (array)
      end if
      allocate (array(rows, n))
   end subroutine resize_real64

   !> Lists of reals.
   pure subroutine grow_reals(list, needed)
      real(wp), allocatable, intent(inout) :: list(:)
      integer, intent(in) :: needed
      real(wp), allocatable :: longer(:)
      if (.not. allocated(list)) allocate (list(first_room))
      if (needed <= size(list)) return
      allocate (longer(2*needed))
      longer(:size(list)) = list
      call move_alloc(longer, list)
   end subroutine grow_reals

   !> Lists of integers.
   pure subroutine grow_integers(list, needed)
      integer, allocatable, intent(inout) :: list(:)
      integer, intent(in) :: needed
      integer, allocatable :: longer(:)
      if (.not. allocated(list)) allocate (list(first_room))
      if (needed <= size(list)) return
      allocate (longer(2*needed))
      longer(:size(list)) = list
      call move_alloc(longer, list)
   end subroutine grow_integers

   !> Lists of logicals.
   pure subroutine grow_logicals(list, needed)
      logical, allocatable, intent(inout) :: list(:)
      integer, intent(in) :: needed
      logical, allocatable :: longer(:)
      if (.not. allocated(list)) allocate (list(first_room))
      if (needed <= size(list)) return
      allocate (longer(2*needed))
      longer(:size(list)) = list
      call move_alloc(longer, list)
   end subroutine grow_logicals

   !> Real columns.
   pure subroutine grow_real_columns(list, needed, rows)
      real(wp), allocatable, intent(inout) :: list(:, :)
      integer, intent(in) :: needed
      integer, intent(in) :: rows          !! the same in all calls for one list
      real(wp), allocatable :: longer(:, :)
      if (.not. allocated(list)) allocate (list(rows, first_room))
      if (needed <= size(list, 2)) return
      allocate (longer(rows, 2*needed))
      longer(:, :size(list, 2)) = list
      call move_alloc(longer, list)
   end subroutine grow_real_columns

   !> Integer columns.
   pure subroutine grow_integer_columns(list, needed, rows)
      integer, allocatable, intent(inout) :: list(:, :)
      integer, intent(in) :: needed
      integer, intent(in) :: rows          !! the same in all calls for one list
      integer, allocatable :: longer(:, :)
      if (.not. allocated(list)) allocate (list(rows, first_room))
      if (needed <= size(list, 2)) return
      allocate (longer(rows, 2*needed))
      longer(:, :size(list, 2)) = list
      call move_alloc(longer, list)
   end subroutine grow_integer_columns

end module rockdda_base_room
