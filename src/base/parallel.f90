! SPDX-License-Identifier: MIT
!> Smallest sizes of loops that use several threads, and the chunks of sums.
!>
!> Waking threads takes some microseconds, on a machine with other load much longer: loops over fewer items run on one
!> thread. Results are the same for any number of threads, and without OpenMP: a loop writes each number once, and
!> sums are taken over pieces of a fixed size, which are then added in their order. A maximum is the same in any order.
!> Sums to which each item adds at two places are made by ranges of places, one for each thread, which passes over all
!> items and adds to its own places.
module rockdda_base_parallel
   use, intrinsic :: iso_fortran_env, only : int64
!$ use omp_lib, only : omp_get_max_threads, omp_get_thread_num
   implicit none
   private
   public :: parallel_blocks, parallel_contacts, piece, n_pieces, n_ranges, range_of, own_range

   !> Blocks from which loops over blocks use threads.
   integer, parameter :: parallel_blocks = 1000
   !> Contacts (or pairs of blocks) from which loops over them use threads.
   integer, parameter :: parallel_contacts = 4000
   !> Items in one piece of a sum.
   integer, parameter :: piece = 512

contains

   !> Pieces of n items.
   pure integer function n_pieces(n)
      integer, intent(in) :: n
      n_pieces = (n + piece - 1)/piece
   end function n_pieces

   !> Ranges of places for a loop that uses threads or not.
   integer function n_ranges(uses_threads)
      logical, intent(in) :: uses_threads
      n_ranges = 1
!$    if (uses_threads) n_ranges = omp_get_max_threads()
   end function n_ranges

   !> First and last of n places in range p of `ranges`.
   pure function range_of(p, ranges, n) result(ends)
      integer, intent(in) :: p, ranges, n
      integer :: ends(2)
      ends(1) = int((p - 1)*int(n, int64)/ranges) + 1
      ends(2) = int(p*int(n, int64)/ranges)
   end function range_of

   !> Of `n_ranges` places that belong to threads, that of the calling thread.
   integer function own_range()
      own_range = 1
!$    own_range = omp_get_thread_num() + 1
   end function own_range

end module rockdda_base_parallel
