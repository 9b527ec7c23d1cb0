! SPDX-License-Identifier: MIT
!> Dense kernels for one 6x6 block, with sizes known to the compiler.
module rockdda_linear_small_blocks
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use rockdda_base_kinds, only : wp
   implicit none
   private
   public :: factorize_block, solve_lower, solve_lower_transposed, solve_block, invert_block, &
      invert_lower

contains

   !> Cholesky factor of a symmetric block, A = L L^T, with 1/L(j,j) on the diagonal of `l`.
   !>
   !> A pivot counts as failed when it is not above the rounding error of the diagonal entry it came from.
   pure subroutine factorize_block(a, l, ok)
      real(wp), intent(in) :: a(6, 6)     !! symmetric; the lower triangle is read
      real(wp), intent(out) :: l(6, 6)    !! lower triangle of L, reciprocal diagonal; zero above; undefined if not ok
      logical, intent(out) :: ok          !! positive definite and finite
      real(wp) :: pivot, pivots(6)
      integer :: j, k
      l = a
      do j = 1, 6
         pivots(j) = a(j, j)
      end do
      ok = all(ieee_is_finite(a))
      if (.not. ok) return
      ! whole columns of constant length: what is computed above the diagonal is thrown away
      do j = 1, 6
         pivot = l(j, j)
         ok = pivot > 4*epsilon(1.0_wp)*pivots(j)
         if (.not. ok) return
         pivot = 1/sqrt(pivot)
         l(:, j) = l(:, j)*pivot
         do k = j + 1, 6
            l(:, k) = l(:, k) - l(:, j)*l(k, j)
         end do
         l(j, j) = pivot
      end do
      do j = 2, 6
         l(1:j - 1, j) = 0
      end do
   end subroutine factorize_block

   !> b := L^-1 b with a factor made by `factorize_block`.
   pure subroutine solve_lower(l, b)
      real(wp), intent(in) :: l(6, 6)
      real(wp), intent(inout) :: b(6)
      integer :: j
      do j = 1, 5
         b(j) = b(j)*l(j, j)
         b(j + 1:6) = b(j + 1:6) - l(j + 1:6, j)*b(j)
      end do
      b(6) = b(6)*l(6, 6)
   end subroutine solve_lower

   !> b := L^-T b with a factor made by `factorize_block`.
   pure subroutine solve_lower_transposed(l, b)
      real(wp), intent(in) :: l(6, 6)
      real(wp), intent(inout) :: b(6)
      integer :: j
      b(6) = b(6)*l(6, 6)
      do j = 5, 1, -1
         b(j) = (b(j) - dot_product(l(j + 1:6, j), b(j + 1:6)))*l(j, j)
      end do
   end subroutine solve_lower_transposed

   !> b := A^-1 b with the factor of A.
   pure subroutine solve_block(l, b)
      real(wp), intent(in) :: l(6, 6)
      real(wp), intent(inout) :: b(6)
      call solve_lower(l, b)
      call solve_lower_transposed(l, b)
   end subroutine solve_block

   !> L^-1 from a factor made by `factorize_block`: a full lower triangle, zero above.
   pure subroutine invert_lower(l, inverse)
      real(wp), intent(in) :: l(6, 6)
      real(wp), intent(out) :: inverse(6, 6)
      real(wp) :: rows(6, 6)   ! rows(:, i) is row i of the inverse
      integer :: i, j
      rows = 0
      do j = 1, 6
         rows(j, j) = 1
      end do
      do j = 1, 6
         rows(:, j) = rows(:, j)*l(j, j)
         do i = j + 1, 6
            rows(:, i) = rows(:, i) - l(i, j)*rows(:, j)
         end do
      end do
      inverse = transpose(rows)
   end subroutine invert_lower

   !> The inverse of a symmetric block from its factor, exactly symmetric.
   pure subroutine invert_block(l, inverse)
      real(wp), intent(in) :: l(6, 6)          !! from `factorize_block`
      real(wp), intent(out) :: inverse(6, 6)   !! A^-1
      real(wp) :: m(6, 6)
      integer :: i, j
      m = 0
      do j = 1, 6
         m(j, j) = 1
         call solve_lower(l, m(:, j))
      end do
      do j = 1, 6
         do i = j, 6
            inverse(i, j) = dot_product(m(i:6, i), m(i:6, j))
            inverse(j, i) = inverse(i, j)
         end do
      end do
   end subroutine invert_block

end module rockdda_linear_small_blocks
