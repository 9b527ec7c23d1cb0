! SPDX-License-Identifier: MIT
!> Dense Cholesky with LAPACK: the reference for the other solvers, for small systems only.
module rockdda_linear_dense
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_strings, only : to_string
   use rockdda_linear_matrix, only : block_matrix_type
   use rockdda_linear_direct, only : direct_solver_type, least_pivot, check_workspace
   use rockdda_linear_residual, only : not_positive_definite
   implicit none
   private
   public :: dense_solver_type, max_dense_blocks

   !> Above this number of blocks the dense solver refuses: work grows with the cube.
   integer, parameter :: max_dense_blocks = 300

   type, extends(direct_solver_type) :: dense_solver_type
      real(wp), allocatable :: a(:, :)   !! (6n, 6n) the matrix, then its factor in the upper triangle
   contains
      procedure :: count_work => count_work_dense
      procedure :: factorize => factorize_dense
      procedure :: backsolve => backsolve_dense
   end type dense_solver_type

   interface
      !> LAPACK: Cholesky factor of a symmetric positive definite matrix.
      subroutine dpotrf(uplo, n, a, lda, info)
         import :: wp
         character, intent(in) :: uplo
         integer, intent(in) :: n, lda
         real(wp), intent(inout) :: a(lda, *)
         integer, intent(out) :: info
      end subroutine dpotrf

      !> LAPACK: solve with the factor of `dpotrf`.
      subroutine dpotrs(uplo, n, nrhs, a, lda, b, ldb, info)
         import :: wp
         character, intent(in) :: uplo
         integer, intent(in) :: n, nrhs, lda, ldb
         real(wp), intent(in) :: a(lda, *)
         real(wp), intent(inout) :: b(ldb, *)
         integer, intent(out) :: info
      end subroutine dpotrs
   end interface

contains

   !> n^3/3 operations, n (n + 1)/2 entries.
   subroutine count_work_dense(self, matrix, operations, fill, error)
      class(dense_solver_type), intent(inout) :: self
      type(block_matrix_type), intent(in) :: matrix
      real(wp), intent(out) :: operations, fill
      type(error_type), allocatable, intent(out) :: error
      operations = (6.0_wp*matrix%n)**3/3
      fill = 3.0_wp*matrix%n*(6.0_wp*matrix%n + 1)
      if (matrix%n > max_dense_blocks) call refuse(matrix%n, error)
   end subroutine count_work_dense

   !> Too large for a dense factorisation.
   pure subroutine refuse(n, error)
      integer, intent(in) :: n   !! blocks
      type(error_type), allocatable, intent(out) :: error
      call make_error(error, error_code%input, 'the dense solver takes at most '//to_string(max_dense_blocks)// &
                      ' blocks, this model has '//to_string(n)//'; choose cholmod')
   end subroutine refuse

   !> Expand K to a dense matrix and factorise it.
   subroutine factorize_dense(self, matrix, error)
      class(dense_solver_type), intent(inout) :: self
      type(block_matrix_type), intent(in) :: matrix
      type(error_type), allocatable, intent(out) :: error
      integer :: i, j, k, info
      if (matrix%n > max_dense_blocks) then
         call refuse(matrix%n, error)
         return
      end if
      if (allocated(self%a)) then
         if (size(self%a, 1) /= 6*matrix%n) deallocate (self%a)
      end if
      if (.not. allocated(self%a)) then
         call check_workspace('dense', error)
         if (allocated(error)) return
         allocate (self%a(6*matrix%n, 6*matrix%n))
      end if
      self%a = 0
      do i = 1, matrix%n
         do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
            j = matrix%column(k)
            self%a(6*i - 5:6*i, 6*j - 5:6*j) = matrix%values(:, :, k)
         end do
      end do
      call dpotrf('U', 6*matrix%n, self%a, 6*matrix%n, info)
      if (info > 0) call not_positive_definite((info + 5)/6, error)
      if (info /= 0) return
      do i = 1, matrix%n
         do j = 1, 6
            k = 6*i - 6 + j
            ! written so that a pivot that is not a number fails too
            if (self%a(k, k)**2 > least_pivot*matrix%values(j, j, matrix%row_start(i))) cycle
            call not_positive_definite(i, error)
            return
         end do
      end do
   end subroutine factorize_dense

   !> x = K^-1 b.
   subroutine backsolve_dense(self, b, x, error)
      class(dense_solver_type), intent(inout) :: self
      real(wp), intent(in), contiguous :: b(:, :)
      real(wp), intent(inout), contiguous :: x(:, :)
      type(error_type), allocatable, intent(out) :: error
      integer :: n, info
      n = size(self%a, 1)
      x = b
      call dpotrs('U', n, 1, self%a, n, x, n, info)
      if (info /= 0) call make_error(error, error_code%internal, 'dpotrs refused its arguments')
   end subroutine backsolve_dense

end module rockdda_linear_dense
