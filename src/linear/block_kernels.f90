! SPDX-License-Identifier: MIT
!> Kernels of a Cholesky factor by blocks of 6x6: products are in block_kernels_shim.c.
module rockdda_linear_block_kernels
   use, intrinsic :: iso_c_binding, only : c_int, c_double
   use rockdda_base_kinds, only : wp
   implicit none
   private
   public :: subtract_products_of_rows, subtract_square, subtract_column, subtract_row, divide_by_factor

   interface
      !> C_t := C_t - A_q B^T for n blocks A, t = target(q).
      pure subroutine subtract_products_of_rows(n, target, a, b, c) bind(c, name='rockdda_subtract_products')
         import :: c_int, c_double
         integer(c_int), value :: n
         integer(c_int), intent(in) :: target(*)
         real(c_double), intent(in) :: a(6, 6, *), b(6, 6)
         real(c_double), intent(inout) :: c(6, 6, *)
      end subroutine subtract_products_of_rows

      !> C := C - A A^T, at least its lower half.
      pure subroutine subtract_square(a, c) bind(c, name='rockdda_subtract_square')
         import :: c_double
         real(c_double), intent(in) :: a(6, 6)
         real(c_double), intent(inout) :: c(6, 6)
      end subroutine subtract_square

      !> y_i := y_i - A_q x for n blocks A, i = row(q).
      pure subroutine subtract_column(n, row, a, x, y) bind(c, name='rockdda_subtract_column')
         import :: c_int, c_double
         integer(c_int), value :: n
         integer(c_int), intent(in) :: row(*)
         real(c_double), intent(in) :: a(6, 6, *), x(6)
         real(c_double), intent(inout) :: y(6, *)
      end subroutine subtract_column

      !> x := x - sum of A_q^T y_i over n blocks A, i = row(q).
      pure subroutine subtract_row(n, row, a, y, x) bind(c, name='rockdda_subtract_row')
         import :: c_int, c_double
         integer(c_int), value :: n
         integer(c_int), intent(in) :: row(*)
         real(c_double), intent(in) :: a(6, 6, *), y(6, *)
         real(c_double), intent(inout) :: x(6)
      end subroutine subtract_row
   end interface

contains

   !> C := C L^-T with a factor of `factorize_block`.
   pure subroutine divide_by_factor(l, c)
      real(wp), intent(in) :: l(6, 6)
      real(wp), intent(inout) :: c(6, 6)
      c(:, 1) = c(:, 1)*l(1, 1)
      c(:, 2) = (c(:, 2) - c(:, 1)*l(2, 1))*l(2, 2)
      c(:, 3) = (c(:, 3) - (c(:, 1)*l(3, 1) + c(:, 2)*l(3, 2)))*l(3, 3)
      c(:, 4) = (c(:, 4) - ((c(:, 1)*l(4, 1) + c(:, 2)*l(4, 2)) + c(:, 3)*l(4, 3)))*l(4, 4)
      c(:, 5) = (c(:, 5) - ((c(:, 1)*l(5, 1) + c(:, 2)*l(5, 2)) + (c(:, 3)*l(5, 3) + c(:, 4)*l(5, 4))))*l(5, 5)
      c(:, 6) = (c(:, 6) - (((c(:, 1)*l(6, 1) + c(:, 2)*l(6, 2)) + (c(:, 3)*l(6, 3) + c(:, 4)*l(6, 4))) &
                            + c(:, 5)*l(6, 5)))*l(6, 6)
   end subroutine divide_by_factor

end module rockdda_linear_block_kernels
