! SPDX-License-Identifier: MIT
!> Dense kernels for one 6x6 block, with sizes known to the compiler.
module rockdda_linear_small_blocks
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use rockdda_base_kinds, only : wp
   implicit none
   private
   public :: factorize_block, factorize_packed, solve_lower, solve_lower_transposed, solve_block, invert_lower, &
      invert_packed, n_packed, pack_lower, unpack_lower, scale_rows, add_symmetric_product

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
      real(wp) :: packed(n_packed)
      call factorize_packed(a, packed, ok)
      if (ok) call unpack_lower(packed, l)
   end subroutine factorize_block

   !> The same with a packed factor.
   pure subroutine factorize_packed(a, packed, ok)
      real(wp), intent(in) :: a(6, 6)              !! symmetric; the lower triangle is read
      real(wp), intent(out) :: packed(n_packed)    !! lower triangle of L, reciprocal diagonal; undefined if not ok
      logical, intent(out) :: ok                   !! positive definite and finite
      real(wp), parameter :: least = 4*epsilon(1.0_wp)
      real(wp) :: pivot(6)
      real(wp) :: c21, c31, c41, c51, c61, c32, c42, c52, c62, c43, c53, c63, c54, c64, c65, rest
      ok = is_finite(a)
      if (.not. ok) return
      ! single numbers, which stay in registers: each pivot waits for the root and the quotient of the one before, and
      ! vectors of numbers that were written one by one would wait for the memory as well
      rest = a(1, 1)
      ok = rest > least*a(1, 1)
      if (.not. ok) return
      pivot(1) = 1/sqrt(rest)
      c21 = a(2, 1)*pivot(1)
      c31 = a(3, 1)*pivot(1)
      c41 = a(4, 1)*pivot(1)
      c51 = a(5, 1)*pivot(1)
      c61 = a(6, 1)*pivot(1)
      rest = a(2, 2) - c21*c21
      ok = rest > least*a(2, 2)
      if (.not. ok) return
      pivot(2) = 1/sqrt(rest)
      c32 = (a(3, 2) - c31*c21)*pivot(2)
      c42 = (a(4, 2) - c41*c21)*pivot(2)
      c52 = (a(5, 2) - c51*c21)*pivot(2)
      c62 = (a(6, 2) - c61*c21)*pivot(2)
      rest = (a(3, 3) - c31*c31) - c32*c32
      ok = rest > least*a(3, 3)
      if (.not. ok) return
      pivot(3) = 1/sqrt(rest)
      c43 = ((a(4, 3) - c41*c31) - c42*c32)*pivot(3)
      c53 = ((a(5, 3) - c51*c31) - c52*c32)*pivot(3)
      c63 = ((a(6, 3) - c61*c31) - c62*c32)*pivot(3)
      rest = ((a(4, 4) - c41*c41) - c42*c42) - c43*c43
      ok = rest > least*a(4, 4)
      if (.not. ok) return
      pivot(4) = 1/sqrt(rest)
      c54 = (((a(5, 4) - c51*c41) - c52*c42) - c53*c43)*pivot(4)
      c64 = (((a(6, 4) - c61*c41) - c62*c42) - c63*c43)*pivot(4)
      rest = (((a(5, 5) - c51*c51) - c52*c52) - c53*c53) - c54*c54
      ok = rest > least*a(5, 5)
      if (.not. ok) return
      pivot(5) = 1/sqrt(rest)
      c65 = ((((a(6, 5) - c61*c51) - c62*c52) - c63*c53) - c64*c54)*pivot(5)
      rest = ((((a(6, 6) - c61*c61) - c62*c62) - c63*c63) - c64*c64) - c65*c65
      ok = rest > least*a(6, 6)
      if (.not. ok) return
      pivot(6) = 1/sqrt(rest)
      packed = [pivot(1), c21, c31, c41, c51, c61, pivot(2), c32, c42, c52, c62, pivot(3), c43, c53, c63, &
                pivot(4), c54, c64, pivot(5), c65, pivot(6)]
   end subroutine factorize_packed

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
      real(wp) :: b1, b2, b3, b4, b5, b6
      b1 = b(1)*l(1, 1)
      b2 = (b(2) - l(2, 1)*b1)*l(2, 2)
      b3 = ((b(3) - l(3, 1)*b1) - l(3, 2)*b2)*l(3, 3)
      b4 = (((b(4) - l(4, 1)*b1) - l(4, 2)*b2) - l(4, 3)*b3)*l(4, 4)
      b5 = ((((b(5) - l(5, 1)*b1) - l(5, 2)*b2) - l(5, 3)*b3) - l(5, 4)*b4)*l(5, 5)
      b6 = (((((b(6) - l(6, 1)*b1) - l(6, 2)*b2) - l(6, 3)*b3) - l(6, 4)*b4) - l(6, 5)*b5)*l(6, 6)
      b = [b1, b2, b3, b4, b5, b6]
   end subroutine solve_lower

   !> A lower triangle from its packed form.
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

   !> Pack the lower triangle of a block.
   pure subroutine pack_lower(a, packed)
      real(wp), intent(in) :: a(6, 6)
      real(wp), intent(out) :: packed(n_packed)
      packed(1:6) = a(1:6, 1)
      packed(7:11) = a(2:6, 2)
      packed(12:15) = a(3:6, 3)
      packed(16:18) = a(4:6, 4)
      packed(19:20) = a(5:6, 5)
      packed(21) = a(6, 6)
   end subroutine pack_lower

   !> y := y + A x with a symmetric block of which the lower triangle is packed. Single numbers instead of arrays: no
   !> vector waits for parts of it.
   pure subroutine add_symmetric_product(a, x, y)
      real(wp), intent(in) :: a(n_packed), x(6)
      real(wp), intent(inout) :: y(6)
      y(1) = (((((y(1) + a(1)*x(1)) + a(2)*x(2)) + a(3)*x(3)) + a(4)*x(4)) + a(5)*x(5)) + a(6)*x(6)
      y(2) = (((((y(2) + a(2)*x(1)) + a(7)*x(2)) + a(8)*x(3)) + a(9)*x(4)) + a(10)*x(5)) + a(11)*x(6)
      y(3) = (((((y(3) + a(3)*x(1)) + a(8)*x(2)) + a(12)*x(3)) + a(13)*x(4)) + a(14)*x(5)) + a(15)*x(6)
      y(4) = (((((y(4) + a(4)*x(1)) + a(9)*x(2)) + a(13)*x(3)) + a(16)*x(4)) + a(17)*x(5)) + a(18)*x(6)
      y(5) = (((((y(5) + a(5)*x(1)) + a(10)*x(2)) + a(14)*x(3)) + a(17)*x(4)) + a(19)*x(5)) + a(20)*x(6)
      y(6) = (((((y(6) + a(6)*x(1)) + a(11)*x(2)) + a(15)*x(3)) + a(18)*x(4)) + a(20)*x(5)) + a(21)*x(6)
   end subroutine add_symmetric_product

   !> b := L^-T b with a factor made by `factorize_block`.
   pure subroutine solve_lower_transposed(l, b)
      real(wp), intent(in) :: l(6, 6)
      real(wp), intent(inout) :: b(6)
      real(wp) :: b1, b2, b3, b4, b5, b6
      b6 = b(6)*l(6, 6)
      b5 = (b(5) - l(6, 5)*b6)*l(5, 5)
      b4 = (b(4) - (l(5, 4)*b5 + l(6, 4)*b6))*l(4, 4)
      b3 = (b(3) - ((l(4, 3)*b4 + l(5, 3)*b5) + l(6, 3)*b6))*l(3, 3)
      b2 = (b(2) - (((l(3, 2)*b3 + l(4, 2)*b4) + l(5, 2)*b5) + l(6, 2)*b6))*l(2, 2)
      b1 = (b(1) - ((((l(2, 1)*b2 + l(3, 1)*b3) + l(4, 1)*b4) + l(5, 1)*b5) + l(6, 1)*b6))*l(1, 1)
      b = [b1, b2, b3, b4, b5, b6]
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

   !> The same for packed triangles.
   pure subroutine invert_packed(l, inverse)
      real(wp), intent(in) :: l(n_packed)
      real(wp), intent(out) :: inverse(n_packed)
      real(wp) :: s21, s31, s41, s51, s61, s32, s42, s52, s62, s43, s53, s63, s54, s64, s65
      s21 = -l(2)*l(1)*l(7)
      s31 = (-l(3)*l(1) - l(8)*s21)*l(12)
      s41 = ((-l(4)*l(1) - l(9)*s21) - l(13)*s31)*l(16)
      s51 = (((-l(5)*l(1) - l(10)*s21) - l(14)*s31) - l(17)*s41)*l(19)
      s61 = ((((-l(6)*l(1) - l(11)*s21) - l(15)*s31) - l(18)*s41) - l(20)*s51)*l(21)
      s32 = -l(8)*l(7)*l(12)
      s42 = (-l(9)*l(7) - l(13)*s32)*l(16)
      s52 = ((-l(10)*l(7) - l(14)*s32) - l(17)*s42)*l(19)
      s62 = (((-l(11)*l(7) - l(15)*s32) - l(18)*s42) - l(20)*s52)*l(21)
      s43 = -l(13)*l(12)*l(16)
      s53 = (-l(14)*l(12) - l(17)*s43)*l(19)
      s63 = ((-l(15)*l(12) - l(18)*s43) - l(20)*s53)*l(21)
      s54 = -l(17)*l(16)*l(19)
      s64 = (-l(18)*l(16) - l(20)*s54)*l(21)
      s65 = -l(20)*l(19)*l(21)
      inverse = [l(1), s21, s31, s41, s51, s61, l(7), s32, s42, s52, s62, l(12), s43, s53, s63, l(16), s54, s64, &
                 l(19), s65, l(21)]
   end subroutine invert_packed

   !> a := S a with S lower triangular.
   pure subroutine scale_rows(s, a)
      real(wp), intent(in) :: s(6, 6)
      real(wp), intent(inout) :: a(6, 6)
      real(wp) :: b(6)
      integer :: j
      do j = 1, 6
         b = a(:, j)
         a(1:2, j) = s(1:2, 1)*b(1) + s(1:2, 2)*b(2)
         a(3:4, j) = (s(3:4, 1)*b(1) + s(3:4, 2)*b(2)) + (s(3:4, 3)*b(3) + s(3:4, 4)*b(4))
         a(5:6, j) = (s(5:6, 1)*b(1) + s(5:6, 2)*b(2)) + (s(5:6, 3)*b(3) + s(5:6, 4)*b(4)) &
            + (s(5:6, 5)*b(5) + s(5:6, 6)*b(6))
      end do
   end subroutine scale_rows

end module rockdda_linear_small_blocks
