! SPDX-License-Identifier: MIT
!> Dense kernels for one 6x6 block, with sizes known to the compiler.
module rockdda_linear_small_blocks
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use rockdda_base_kinds, only : wp
   implicit none
   private
   public :: factorize_block, solve_lower, solve_lower_transposed, solve_block, invert_lower, n_packed, pack_lower, &
      unpack_lower, solve_packed

   !> Numbers of a lower triangle that is packed column by column.
   integer, parameter :: n_packed = 21

contains

   !> Cholesky factor of a symmetric block, A = L L^T, with 1/L(j,j) on the diagonal of `l`.
   !>
   !> A pivot counts as failed when it is not above the rounding error of the diagonal entry it came from.
   pure subroutine factorize_block(a, l, ok)
      real(wp), intent(in) :: a(6, 6)     !! symmetric; the lower triangle is read
      real(wp), intent(out) :: l(6, 6)    !! lower triangle of L, reciprocal diagonal; zero above; undefined if not ok
      logical, intent(out) :: ok          !! positive definite and finite
      real(wp), parameter :: least = 4*epsilon(1.0_wp)
      real(wp) :: c1(6), c2(6), c3(3:6), c4(3:6), c5(5:6), c6(5:6), pivot
      ok = is_finite(a)
      if (.not. ok) return
      ! columns in pairs of one length, which the compiler keeps in registers; what is computed above the diagonal of
      ! the second of a pair is discarded
      c1 = a(:, 1)
      ok = c1(1) > least*a(1, 1)
      if (.not. ok) return
      pivot = 1/sqrt(c1(1))
      c1 = c1*pivot
      c1(1) = pivot
      c2 = a(:, 2) - c1*c1(2)
      ok = c2(2) > least*a(2, 2)
      if (.not. ok) return
      pivot = 1/sqrt(c2(2))
      c2 = c2*pivot
      c2(2) = pivot
      c3 = (a(3:6, 3) - c1(3:6)*c1(3)) - c2(3:6)*c2(3)
      ok = c3(3) > least*a(3, 3)
      if (.not. ok) return
      pivot = 1/sqrt(c3(3))
      c3 = c3*pivot
      c3(3) = pivot
      c4 = ((a(3:6, 4) - c1(3:6)*c1(4)) - c2(3:6)*c2(4)) - c3*c3(4)
      ok = c4(4) > least*a(4, 4)
      if (.not. ok) return
      pivot = 1/sqrt(c4(4))
      c4 = c4*pivot
      c4(4) = pivot
      c5 = (((a(5:6, 5) - c1(5:6)*c1(5)) - c2(5:6)*c2(5)) - c3(5:6)*c3(5)) - c4(5:6)*c4(5)
      ok = c5(5) > least*a(5, 5)
      if (.not. ok) return
      pivot = 1/sqrt(c5(5))
      c5 = c5*pivot
      c5(5) = pivot
      c6 = ((((a(5:6, 6) - c1(5:6)*c1(6)) - c2(5:6)*c2(6)) - c3(5:6)*c3(6)) - c4(5:6)*c4(6)) - c5*c5(6)
      ok = c6(6) > least*a(6, 6)
      if (.not. ok) return
      pivot = 1/sqrt(c6(6))
      c6 = c6*pivot
      c6(6) = pivot
      l(:, 1) = c1
      l(:, 2) = [0.0_wp, c2(2:6)]
      l(1:2, 3:6) = 0
      l(3:6, 3) = c3
      l(3:6, 4) = [0.0_wp, c4(4:6)]
      l(3:4, 5:6) = 0
      l(5:6, 5) = c5
      l(5:6, 6) = [0.0_wp, c6(6)]
   end subroutine factorize_block

   !> Are all entries finite? Sums of magnitudes, which cannot overflow, are not finite otherwise.
   pure logical function is_finite(a)
      real(wp), intent(in) :: a(6, 6)
      real(wp) :: lane(6)
      integer :: j
      lane = 0
      do j = 1, 6
         lane = lane + 0.125_wp*abs(a(:, j))
      end do
      is_finite = all(ieee_is_finite(lane))
   end function is_finite

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

   !> The lower triangle of a factor without the zeros above.
   pure subroutine pack_lower(l, packed)
      real(wp), intent(in) :: l(6, 6)
      real(wp), intent(out) :: packed(n_packed)
      packed = [l(1:6, 1), l(2:6, 2), l(3:6, 3), l(4:6, 4), l(5:6, 5), l(6, 6)]
   end subroutine pack_lower

   !> A factor from its packed form.
   pure subroutine unpack_lower(packed, l)
      real(wp), intent(in) :: packed(n_packed)
      real(wp), intent(out) :: l(6, 6)
      l = 0
      l(1:6, 1) = packed(1:6)
      l(2:6, 2) = packed(7:11)
      l(3:6, 3) = packed(12:15)
      l(4:6, 4) = packed(16:18)
      l(5:6, 5) = packed(19:20)
      l(6, 6) = packed(21)
   end subroutine unpack_lower

   !> `solve_lower` with a packed factor.
   pure subroutine solve_packed(l, b)
      real(wp), intent(in) :: l(n_packed)
      real(wp), intent(inout) :: b(6)
      b(1) = b(1)*l(1)
      b(2:6) = b(2:6) - l(2:6)*b(1)
      b(2) = b(2)*l(7)
      b(3:6) = b(3:6) - l(8:11)*b(2)
      b(3) = b(3)*l(12)
      b(4:6) = b(4:6) - l(13:15)*b(3)
      b(4) = b(4)*l(16)
      b(5:6) = b(5:6) - l(17:18)*b(4)
      b(5) = b(5)*l(19)
      b(6) = b(6) - l(20)*b(5)
      b(6) = b(6)*l(21)
   end subroutine solve_packed

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

end module rockdda_linear_small_blocks
