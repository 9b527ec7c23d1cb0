! SPDX-License-Identifier: MIT
!> Products of 6x6 blocks in single precision with the vectors of several blocks.
!>
!> They are laid out for processors that work on four numbers at a time: a block is cut into 2x2 tiles, row by row,
!> each tile stored column by column, a11 a21 a12 a22. Its product with [x1 x1 x2 x2] has the terms of the first row
!> in lanes 1 and 3 and those of the second in 2 and 4; the product with [t1 t2 t1 t2] has those of the first row of the
!> transpose in 1 and 2 and those of the second in 3 and 4. So neither product shuffles the block. Lanes are added up
!> when a row is complete.
!>
!> They have a file of their own so that compilers do not inline them: how the result is stored would then change how
!> the products are computed.
module rockdda_linear_kernels
   use, intrinsic :: iso_fortran_env, only : real32
   use rockdda_base_kinds, only : wp
   implicit none
   private
   public :: sp, pack_block, pack_transposed, subtract_products, cg_update

   !> Precision of the preconditioned iteration.
   integer, parameter :: sp = real32

contains

   !> sums := sums - sum over the blocks first to last of A x, lanes 1 and 3, 2 and 4 of each column to be added.
   pure subroutine subtract_products(first, last, column, a, x, sums)
      integer, value :: first, last                !! blocks of the row
      integer, intent(in) :: column(*)             !! number of the vector that a block is multiplied with
      real(sp), intent(in) :: a(36, *), x(6, *)
      real(sp), intent(inout) :: sums(4, 3)        !! two rows in each column
      real(sp) :: u(4), v(4), w(4)
      integer :: k, j
      u = sums(:, 1)
      v = sums(:, 2)
      w = sums(:, 3)
      do k = first, last
         j = column(k)
         associate (x1 => x(1, j), x2 => x(2, j), x3 => x(3, j), x4 => x(4, j), x5 => x(5, j), x6 => x(6, j))
            u = u - ((a(1:4, k)*[x1, x1, x2, x2] + a(5:8, k)*[x3, x3, x4, x4]) + a(9:12, k)*[x5, x5, x6, x6])
            v = v - ((a(13:16, k)*[x1, x1, x2, x2] + a(17:20, k)*[x3, x3, x4, x4]) + a(21:24, k)*[x5, x5, x6, x6])
            w = w - ((a(25:28, k)*[x1, x1, x2, x2] + a(29:32, k)*[x3, x3, x4, x4]) + a(33:36, k)*[x5, x5, x6, x6])
         end associate
      end do
      sums(:, 1) = u
      sums(:, 2) = v
      sums(:, 3) = w
   end subroutine subtract_products

   !> A step of conjugate gradients: d := d + alpha t, r := r - alpha (q + t), p := r + beta p.
   pure subroutine cg_update(n, alpha, beta, q, t, d, r, p)
      integer, intent(in) :: n                     !! numbers in each vector
      real(sp), intent(in) :: alpha, beta
      real(sp), intent(in) :: q(n), t(n)
      real(sp), intent(inout) :: d(n), r(n), p(n)
      integer :: i
      do i = 1, n
         d(i) = d(i) + alpha*t(i)
         r(i) = r(i) - alpha*(q(i) + t(i))
         p(i) = r(i) + beta*p(i)
      end do
   end subroutine cg_update

   !> Pack a block in this layout.
   pure subroutine pack_block(a, packed)
      real(wp), intent(in) :: a(6, 6)
      real(sp), intent(out) :: packed(4, 3, 3)
      integer :: r, c
      do r = 1, 3
         do c = 1, 3
            packed(1:2, c, r) = real(a(2*r - 1:2*r, 2*c - 1), sp)
            packed(3:4, c, r) = real(a(2*r - 1:2*r, 2*c), sp)
         end do
      end do
   end subroutine pack_block

   !> Pack the transpose of a block in this layout.
   pure subroutine pack_transposed(a, packed)
      real(wp), intent(in) :: a(6, 6)
      real(sp), intent(out) :: packed(4, 3, 3)
      integer :: r, c
      do r = 1, 3
         do c = 1, 3
            packed(1:3:2, c, r) = real(a(2*c - 1:2*c, 2*r - 1), sp)
            packed(2:4:2, c, r) = real(a(2*c - 1:2*c, 2*r), sp)
         end do
      end do
   end subroutine pack_transposed

end module rockdda_linear_kernels
