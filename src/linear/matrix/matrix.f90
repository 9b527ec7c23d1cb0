! SPDX-License-Identifier: MIT
!> Symmetric block-sparse matrix with 6x6 blocks: the stiffness of a block system.
!>
!> Stored is the upper half with the diagonal, row by row, columns ascending; the diagonal block comes first:
!>
!>     row        1              2        3
!>     column     1  2  5        2  3     3  4          column(row_start(i) : row_start(i+1)-1)
!>     values     6x6 each: values(:, :, k) is K_ij with j = column(k) >= i
!>
!> The pattern comes from the contact graph; `pattern_id` changes with it, and a solver then repeats its analysis.
!> `values_id` changes whenever values may have changed: while it is the same number, not 0, a solver may reuse its
!> factors of the matrix. When few rows change, `base_id` is the number of the matrix before and `changed` marks these
!> rows: K_ij differs from its value in that matrix only if rows i and j both are marked.
module rockdda_linear_matrix
   use, intrinsic :: iso_c_binding, only : c_int, c_double
   use rockdda_base_kinds, only : wp
   implicit none
   private
   public :: block_matrix_type, rounding_level, n_stored_blocks, subtract_own, subtract_foreign

   ! in residual_kernels_shim.c
   interface
      !> r := f - K x as far as the rows first to last of the matrix hold it: all of their upper half, and its transpose
      !> within these rows.
      pure subroutine subtract_own(first, last, row_start, column, values, f, x, r) bind(c, name='rockdda_subtract_own')
         import :: c_int, c_double
         integer(c_int), value :: first, last
         integer(c_int), intent(in) :: row_start(*), column(*)
         real(c_double), intent(in) :: values(36, *), f(6, *), x(6, *)
         real(c_double), intent(inout) :: r(6, *)
      end subroutine subtract_own

      !> r := r - K x in the rows first to last as far as earlier rows hold it.
      pure subroutine subtract_foreign(first, last, start, neighbour, place, values, x, r) &
         bind(c, name='rockdda_subtract_foreign')
         import :: c_int, c_double
         integer(c_int), value :: first, last
         integer(c_int), intent(in) :: start(*), neighbour(*), place(*)    !! of the graph
         real(c_double), intent(in) :: values(36, *), x(6, *)
         real(c_double), intent(inout) :: r(6, *)
      end subroutine subtract_foreign
   end interface

   type :: block_matrix_type
      integer :: n = 0                          !! block rows
      integer :: pattern_id = 0                 !! differs whenever the pattern differs
      integer :: values_id = 0                  !! differs whenever values differ; 0: not tracked
      integer :: base_id = 0                    !! values_id from which only rows in `changed` differ; 0: unknown
      logical, allocatable :: changed(:)        !! (n) valid where base_id is not 0
      integer, allocatable :: row_start(:)      !! (n + 1)
      integer, allocatable :: column(:)         !! (number of stored blocks)
      real(wp), allocatable :: values(:, :, :)  !! (6, 6, number of stored blocks)
      integer, allocatable :: scratch(:)        !! of rockdda_linear_pattern
   end type block_matrix_type

contains

   !> Number of blocks stored in the upper half with the diagonal.
   pure integer function n_stored_blocks(matrix)
      type(block_matrix_type), intent(in) :: matrix
      n_stored_blocks = 0
      if (matrix%n > 0) n_stored_blocks = matrix%row_start(matrix%n + 1) - 1
   end function n_stored_blocks

   !> w = |K| |x| + |f|, entry by entry: epsilon times w bounds the rounding error of f - K x.
   pure subroutine rounding_level(matrix, x, f, w)
      type(block_matrix_type), intent(in) :: matrix
      real(wp), intent(in), contiguous :: x(:, :), f(:, :)   !! (6, n)
      real(wp), intent(out), contiguous :: w(:, :)           !! (6, n)
      integer :: i, j, k
      real(wp) :: a(6, 6), own(6), other(6)
      w = abs(f)
      do i = 1, matrix%n
         own = abs(x(:, i))
         do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
            j = matrix%column(k)
            a = abs(matrix%values(:, :, k))
            other = abs(x(:, j))
            call add_product(a, other, w(:, i))
            if (j > i) call add_transposed_product(a, own, w(:, j))
         end do
      end do
   end subroutine rounding_level

   !> y := y + A x.
   pure subroutine add_product(a, x, y)
      real(wp), intent(in) :: a(6, 6), x(6)
      real(wp), intent(inout) :: y(6)
      integer :: j
      do j = 1, 6
         y = y + a(:, j)*x(j)
      end do
   end subroutine add_product

   !> y := y + A^T x. Two sums of three for each column, as registers of two numbers add them.
   pure subroutine add_transposed_product(a, x, y)
      real(wp), intent(in) :: a(6, 6), x(6)
      real(wp), intent(inout) :: y(6)
      real(wp) :: t(2)
      integer :: j
      do j = 1, 6
         t = (a(1:2, j)*x(1:2) + a(3:4, j)*x(3:4)) + a(5:6, j)*x(5:6)
         y(j) = y(j) + (t(1) + t(2))
      end do
   end subroutine add_transposed_product

end module rockdda_linear_matrix
