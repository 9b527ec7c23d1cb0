! SPDX-License-Identifier: MIT
!> How well x solves K x = f: one measure for every solver.
!>
!> The unknowns of a block have mixed units, and so have the equations: forces, a moment, stress times area.
!> They are made comparable by the block's own stiffness D_i = K_ii,
!>
!>     |r|^2 = sum_i r_i^T D_i^-1 r_i,        residual = |f - K x| / max(|f|, |reference load|),
!>
!> that is twice the energy which the unbalanced forces would put into each block alone. The measure does
!> not depend on units, on the point the unknowns refer to, or on the size of the blocks.
!>
!> In working precision f - K x cannot be made smaller than the rounding of the products in K x. Where
!> contact springs are many orders of magnitude stiffer than inertia that may be above the tolerance; x is
!> then accepted as long as its residual is no larger than that rounding, and the rounding itself below
!> `rounding_limit`. Beyond the limit the matrix is too ill-conditioned, and the report says so.
module rockdda_linear_residual
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_strings, only : to_string
   use rockdda_linear_matrix, only : block_matrix_type
   use rockdda_linear_solver, only : solve_report_type
   use rockdda_linear_products, only : residual_vector, rounding_level
   use rockdda_linear_small_blocks, only : factorize_block, solve_lower
   implicit none
   private
   public :: residual_type, rounding_limit, not_positive_definite

   !> Largest relative rounding error of K x at which a solution still counts.
   real(wp), parameter :: rounding_limit = 1.0e-6_wp
   !> Multiples of epsilon by which a backward stable solution may exceed the rounding of K x.
   real(wp), parameter :: rounding_factor = 16.0_wp
   !> An iteration whose unknowns are larger has diverged; beyond it squares of forces would overflow.
   real(wp), parameter :: diverged = 1.0e60_wp
   !> Blocks whose terms are added up together, see rockdda_linear_products.
   integer, parameter :: chunk = 256

   !> Measures residuals; keeps its arrays between solves.
   type :: residual_type
      real(wp), allocatable :: factor(:, :, :)   !! (6, 6, n) Cholesky factors of the diagonal blocks
      real(wp), allocatable :: r(:, :)           !! (6, n) f - K x of the last evaluation
      real(wp), allocatable :: work(:, :)        !! (6, n)
      real(wp) :: load_norm = 0                  !! |f|, or that of the reference load if it is larger
      real(wp) :: from_zero = 1                  !! relative residual of x = 0
   contains
      procedure :: start
      procedure :: norm
      procedure :: evaluate
      procedure :: judge
   end type residual_type

contains

   !> Error for a matrix that has no Cholesky factor.
   pure subroutine not_positive_definite(block, error)
      integer, intent(in) :: block    !! block number of the failed pivot
      type(error_type), allocatable, intent(out) :: error
      call make_error(error, error_code%computation, &
                      'the stiffness matrix is not positive definite: pivot of block '//to_string(block)//' failed')
   end subroutine not_positive_definite

   !> Take a new system: factorise the diagonal blocks and measure the load.
   !>
   !> Without a usable load the report is final: `done` with x = 0 for a zero load, not converged for a
   !> load that is not finite.
   subroutine start(self, matrix, f, reference, x, report, done, error)
      class(residual_type), intent(inout) :: self
      type(block_matrix_type), intent(in) :: matrix
      real(wp), intent(in), contiguous :: f(:, :)      !! (6, n)
      real(wp), intent(in), allocatable :: reference(:, :) !! (6, n) reference load, may be unallocated
      real(wp), intent(inout), contiguous :: x(:, :)   !! (6, n) set to zero when done
      type(solve_report_type), intent(inout) :: report
      logical, intent(out) :: done                     !! nothing is left to solve
      type(error_type), allocatable, intent(out) :: error
      logical :: ok
      integer :: i

      done = .true.
      if (allocated(self%r)) then
         if (size(self%r, 2) /= matrix%n) deallocate (self%factor, self%r, self%work)
      end if
      if (.not. allocated(self%r)) allocate (self%factor(6, 6, matrix%n), self%r(6, matrix%n), self%work(6, matrix%n))
      do i = 1, matrix%n
         call factorize_block(matrix%values(:, :, matrix%row_start(i)), self%factor(:, :, i), ok)
         if (.not. ok) then
            call not_positive_definite(i, error)
            return
         end if
      end do
      do i = 1, matrix%n
         if (all(ieee_is_finite(f(:, i)))) cycle
         report%detail = 'the load of block '//to_string(i)//' is not finite'
         report%residual = huge(1.0_wp)
         return
      end do
      self%load_norm = self%norm(f)
      done = .not. self%load_norm > 0
      if (.not. done) then
         self%from_zero = self%load_norm
         if (allocated(reference)) self%load_norm = max(self%load_norm, self%norm(reference))
         self%from_zero = self%from_zero/self%load_norm
         return
      end if
      x = 0
      report%converged = .true.
   end subroutine start

   !> |v| of a vector of forces.
   pure real(wp) function norm(self, v)
      class(residual_type), intent(in) :: self
      real(wp), intent(in), contiguous :: v(:, :)   !! (6, n)
      real(wp) :: total, part, b(6)
      integer :: first, i
      total = 0
      do first = 1, size(v, 2), chunk
         part = 0
         do i = first, min(first + chunk - 1, size(v, 2))
            b = v(:, i)
            call solve_lower(self%factor(:, :, i), b)
            part = part + dot_product(b, b)
         end do
         total = total + part
      end do
      norm = sqrt(total)
   end function norm

   !> Relative residual of x; leaves f - K x in `r`. huge() when x is not finite or so large (diverged) that
   !> its square could not be trusted to be.
   subroutine evaluate(self, matrix, f, x, relative)
      class(residual_type), intent(inout) :: self
      type(block_matrix_type), intent(in) :: matrix
      real(wp), intent(in), contiguous :: f(:, :), x(:, :)   !! (6, n)
      real(wp), intent(out) :: relative                      !! |f - K x| / |f|
      relative = huge(1.0_wp)
      if (.not. all(ieee_is_finite(x))) return
      if (maxval(abs(x)) > diverged) return
      call residual_vector(matrix, x, f, self%r)
      relative = self%norm(self%r)/self%load_norm
      if (.not. ieee_is_finite(relative)) relative = huge(1.0_wp)
   end subroutine evaluate

   !> Fill the report for x with the given relative residual.
   subroutine judge(self, matrix, f, x, relative, tolerance, report)
      class(residual_type), intent(inout) :: self
      type(block_matrix_type), intent(in) :: matrix
      real(wp), intent(in), contiguous :: f(:, :), x(:, :)   !! (6, n)
      real(wp), intent(in) :: relative                       !! from `evaluate`
      real(wp), intent(in) :: tolerance                      !! wanted relative residual
      type(solve_report_type), intent(inout) :: report
      real(wp) :: attainable
      report%residual = relative
      report%converged = relative <= tolerance
      if (report%converged) return
      if (.not. relative < huge(1.0_wp)) then
         report%detail = 'the solution is not finite'
         return
      end if
      call rounding_level(matrix, x, f, self%work)
      attainable = rounding_factor*epsilon(1.0_wp)*self%norm(self%work)/self%load_norm
      report%converged = relative <= attainable .and. attainable <= rounding_limit
      if (report%converged) then
         report%detail = 'residual '//to_string(relative)//' is at the rounding of K x, above the tolerance '// &
            to_string(tolerance)
      else if (relative <= attainable) then
         report%detail = 'the matrix is too ill-conditioned: rounding alone leaves a residual of '//to_string(relative)
      else
         report%detail = 'residual '//to_string(relative)//' is above the tolerance '//to_string(tolerance)
      end if
   end subroutine judge

end module rockdda_linear_residual
