! SPDX-License-Identifier: MIT
!> Smallest sizes of loops that use several threads, and the chunks of sums.
!>
!> Waking threads takes some microseconds, on a machine with other load much longer: loops over fewer items run on one
!> thread. Results are the same for any number of threads, and without OpenMP: a loop writes each number once, and
!> sums are taken over pieces of a fixed size, which are then added in their order. A maximum is the same in any order.
module rockdda_base_parallel
   implicit none
   private
   public :: parallel_blocks, parallel_contacts, piece, n_pieces

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

end module rockdda_base_parallel
