! SPDX-License-Identifier: MIT
!> The affine motion of a block since it was drawn, by its vertices: by it points move that are fixed to the block.
module rockdda_interaction_affine_motion
   use rockdda_base_kinds, only : wp
   use rockdda_model_blocks, only : block_system_type
   implicit none
   private
   public :: affine_motion

contains

   !> Motion of a block since it was drawn: place = m(:, 1) + m(:, 2:3) place when drawn, the least-squares fit of its
   !> vertices.
   pure function affine_motion(blocks, vertices, block) result(m)
      type(block_system_type), intent(in) :: blocks   !! as drawn
      real(wp), intent(in) :: vertices(:, :)          !! (2, vertices) where they are now [length]
      integer, intent(in) :: block
      real(wp) :: m(2, 3), was(2), is(2), a(2, 2), b(2, 2), x(2)
      integer :: first, last, v
      first = blocks%vertex_offset(block) + 1
      last = blocks%vertex_offset(block + 1)
      associate (old => blocks%vertices(:, first:last), new => vertices(:, first:last))
         m(:, 1) = 0
         m(:, 2:3) = reshape([1.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [2, 2])
         if (all(abs(old - new) <= 0)) return
         was = sum(old, 2)/size(old, 2)
         is = sum(new, 2)/size(new, 2)
         a = 0
         b = 0
         do v = 1, size(old, 2)
            x = old(:, v) - was
            a = a + spread(new(:, v) - is, 2, 2)*spread(x, 1, 2)
            b = b + spread(x, 2, 2)*spread(x, 1, 2)
         end do
         b = reshape([b(2, 2), -b(2, 1), -b(1, 2), b(1, 1)], [2, 2])/(b(1, 1)*b(2, 2) - b(1, 2)*b(2, 1))
         m(:, 2:3) = matmul(a, b)
         m(:, 1) = is - matmul(m(:, 2:3), was)
      end associate
   end function affine_motion

end module rockdda_interaction_affine_motion
