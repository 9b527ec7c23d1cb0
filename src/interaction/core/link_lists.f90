! SPDX-License-Identifier: MIT
!> Which links belong to each block.
module rockdda_interaction_link_lists
   implicit none
   private
   public :: list_links

contains

   !> Links of each block, in their order: those of block i are incident(start(i)+1 : start(i+1)), negative where the
   !> block is the second of their pair.
   pure subroutine list_links(n_blocks, n_links, pair, start, incident)
      integer, intent(in) :: n_blocks, n_links
      integer, intent(in) :: pair(2, n_links)
      integer, intent(out) :: start(n_blocks + 1), incident(2*n_links)
      integer :: c, i, k, side
      start = 0
      do c = 1, n_links
         do side = 1, 2
            i = pair(side, c)
            if (i > 0) start(i + 1) = start(i + 1) + 1
         end do
      end do
      do i = 2, n_blocks + 1
         start(i) = start(i) + start(i - 1)
      end do
      do c = 1, n_links
         do side = 1, 2
            i = pair(side, c)
            if (i == 0) cycle
            k = start(i) + 1
            start(i) = k
            incident(k) = merge(c, -c, side == 1)
         end do
      end do
      do i = n_blocks + 1, 2, -1
         start(i) = start(i - 1)
      end do
      start(1) = 0
   end subroutine list_links

end module rockdda_interaction_link_lists
