! SPDX-License-Identifier: MIT
!> Kernels of a Cholesky factor by blocks of 6x6, in block_kernels_shim.c. Blocks are counted from 1.
module rockdda_linear_block_kernels
   use, intrinsic :: iso_c_binding, only : c_int, c_double
   implicit none
   private
   public :: take_blocks, subtract_sources, divide_blocks, subtract_column, subtract_row

   interface
      !> Copies of n blocks of the matrix, from number `first` of c on: transposed when the place is negative, zero when
      !> it is 0.
      pure subroutine take_blocks(first, n, place, values, c) bind(c, name='rockdda_take_blocks')
         import :: c_int, c_double
         integer(c_int), value :: first, n
         integer(c_int), intent(in) :: place(*)          !! of each block of c
         real(c_double), intent(in) :: values(6, 6, *)
         real(c_double), intent(inout) :: c(6, 6, *)
      end subroutine take_blocks

      !> Take off a column j of the matrix what the blocks L_jk give that `source` has from `first` to `last`:
      !> L_jk L_jk^T off `own`, at least its lower half, L_ik L_jk^T off the block L_ij of `lower`.
      pure subroutine subtract_sources(first, last, source, column, start, first_target, target, own, lower) &
         bind(c, name='rockdda_subtract_sources')
         import :: c_int, c_double
         integer(c_int), value :: first, last
         integer(c_int), intent(in) :: source(*), column(*), start(*), first_target(*), target(*)   !! of elimination
         real(c_double), intent(inout) :: own(6, 6), lower(6, 6, *)
      end subroutine subtract_sources

      !> C := C L^-T for n blocks, from number `first` of c on, with a factor L of `factorize_block`.
      pure subroutine divide_blocks(first, n, l, c) bind(c, name='rockdda_divide_blocks')
         import :: c_int, c_double
         integer(c_int), value :: first, n
         real(c_double), intent(in) :: l(6, 6)
         real(c_double), intent(inout) :: c(6, 6, *)
      end subroutine divide_blocks

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

end module rockdda_linear_block_kernels
