! SPDX-License-Identifier: MIT
!> One contact by the kernels that the program has for many rows (rockdda_interaction_contact_lengths).
module contact_rows
   use rockdda_base_kinds, only : wp
   use rockdda_interaction_contact_lengths, only : place_rows, find_lengths
   use rockdda_interaction_finite_rotation, only : moving_block_type, moved_block_type
   use rockdda_interaction_link_vectors, only : link_numbers, unpack_vectors
   implicit none
   private
   public :: contact_vectors, contact_lengths

contains

   !> Derivatives of gap (1) and slip (2) over a step, for the expected motion of the blocks.
   subroutine contact_vectors(point, gap, normal, share, lean, a, b, e, g)
      real(wp), intent(in) :: point(2), gap, normal(2), share, lean(3)
      type(moving_block_type), intent(in) :: a, b
      real(wp), intent(out) :: e(6, 2), g(6, 2)   !! with respect to the motions of a and b
      real(wp) :: packed(link_numbers)
      packed = 0
      call place_rows(1, [1], [1], [2], point, [gap], normal, [share], lean, [a, b], packed)
      call unpack_vectors(packed, .true., e)
      call unpack_vectors(packed, .false., g)
   end subroutine contact_vectors

   !> Distance and slip at the end of a step.
   function contact_lengths(point, gap, normal, share, lean, a, b) result(lengths)
      real(wp), intent(in) :: point(2), gap, normal(2), share, lean(3)
      type(moved_block_type), intent(in) :: a, b
      real(wp) :: lengths(2)
      lengths = 0
      call find_lengths(1, [1], [1], [2], point, [gap], normal, [share], lean, [a, b], lengths)
   end function contact_lengths

end module contact_rows
