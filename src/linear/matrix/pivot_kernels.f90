! SPDX-License-Identifier: MIT
!> Kernels of the preconditioner's pivots and scaled couplings, in pivot_kernels_shim.c.
module rockdda_linear_pivot_kernels
   use, intrinsic :: iso_c_binding, only : c_int, c_double, c_float
   implicit none
   private
   public :: expect_row, eliminate_couplings, scale_diagonal, scale_couplings

   interface
      !> Ask for the diagonal block of a row and its couplings, which are needed soon: rows of the preconditioner are
      !> far from each other in the matrix.
      pure subroutine expect_row(diagonal, first, last, place, values) bind(c, name='rockdda_expect_row')
         import :: c_int, c_double
         integer(c_int), value :: diagonal                !! its place in the matrix
         integer(c_int), value :: first, last             !! couplings
         integer(c_int), intent(in) :: place(*)           !! of the couplings in the matrix, negative: transposed
         real(c_double), intent(in) :: values(36, *)      !! of the matrix
      end subroutine expect_row

      !> b := K_q S_j^T for each coupling q of a row, K_q in place(q) of the matrix (negative: transposed) and
      !> j = column(q); with squares = 1 also d := d - b b^T, at least its lower half.
      pure subroutine eliminate_couplings(first, last, place, column, values, scale, squares, b, d) &
         bind(c, name='rockdda_eliminate_couplings')
         import :: c_int, c_double
         integer(c_int), value :: first, last             !! couplings
         integer(c_int), intent(in) :: place(*), column(*)
         real(c_double), intent(in) :: values(36, *)      !! of the matrix
         real(c_double), intent(in) :: scale(21, *)       !! S, lower triangles, packed
         integer(c_int), value :: squares
         real(c_double), intent(inout) :: b(36, *), d(36)
      end subroutine eliminate_couplings

      !> The remainder 2 I - S d S^T, packed as in rockdda_linear_kernels.
      pure subroutine scale_diagonal(s, d, remainder) bind(c, name='rockdda_scale_diagonal')
         import :: c_double, c_float
         real(c_double), intent(in) :: s(21), d(36)
         real(c_float), intent(inout) :: remainder(36)
      end subroutine scale_diagonal

      !> S b for each coupling q of a row, packed as in rockdda_linear_kernels, in place q of `lower`, and its transpose
      !> in place transposed(q) of `upper`, 0: none.
      pure subroutine scale_couplings(first, last, s, b, transposed, lower, upper) &
         bind(c, name='rockdda_scale_couplings')
         import :: c_int, c_double, c_float
         integer(c_int), value :: first, last             !! couplings
         real(c_double), intent(in) :: s(21), b(36, *)
         integer(c_int), intent(in) :: transposed(*)
         real(c_float), intent(inout) :: lower(36, *), upper(36, *)
      end subroutine scale_couplings
   end interface

end module rockdda_linear_pivot_kernels
