! SPDX-License-Identifier: MIT
!> Base of the direct solvers: factorise, solve, evaluate the residual, refine once when it is above the tolerance.
!>
!> The residual that rounding leaves is a share of |K| |x|. It is evaluated for the first load solved with a factor;
!> for further ones it is estimated from that, and evaluated only where the estimate is near the tolerance.
!>
!> Where soft motions are composed of stiff parts, as in a slender body of tied cells, the rounding of the products in
!> K x is large against the load, but x is accurate: rounding of the stiff parts hardly moves the soft ones. The
!> factor measures this. With the residual r = f - K x the error of x is e = K^-1 r, and
!>
!>     sqrt(e^T K e / x^T K x) = sqrt(r^T K^-1 r / f^T x)
!>
!> is its share of x in the energy of the motion; up to `rounding_limit` the solution counts.
!>
!> Check of the memory for BLAS. OpenBLAS allocates 128 MB at the first call and repeats the request for ever when the
!> system refuses.
module rockdda_linear_direct
   use, intrinsic :: iso_c_binding, only : c_int, c_size_t
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_room, only : resize
   use rockdda_base_strings, only : to_string
   use rockdda_linear_matrix, only : block_matrix_type
   use rockdda_linear_solver, only : linear_solver_type, solve_report_type, solve_effort_type
   use rockdda_linear_residual, only : residual_type, sum_of_magnitudes, not_finite, rounding_limit
   implicit none
   private
   public :: direct_solver_type, least_pivot, check_workspace

   !> Required address space [bytes]: that of OpenBLAS, its code and some for the factor.
   integer(c_size_t), parameter :: least_room = 210000000_c_size_t

   interface
      integer(c_int) function c_is_there(bytes) bind(C, name='rockdda_memory_is_there')
         import :: c_int, c_size_t
         integer(c_size_t), value :: bytes
      end function c_is_there
   end interface

   !> A pivot below this share of its diagonal entry consists of rounding errors and counts as zero.
   real(wp), parameter :: least_pivot = 64*epsilon(1.0_wp)
   !> An estimated residual below this share of the tolerance is not evaluated.
   real(wp), parameter :: clearly_small = 0.01_wp

   type, abstract, extends(linear_solver_type) :: direct_solver_type
      character(len=8) :: label = 'cholmod'  !! in the log of the automatic choice
      real(wp) :: tolerance = 1.0e-10_wp     !! wanted relative residual, see rockdda_linear_residual
      ! time of the parts of a solve, in the unit of rockdda_linear_auto
      real(wp) :: per_operation = 0.05_wp    !! factorisation
      real(wp) :: per_fill = 13              !! factorisation and solution, for each entry of the factor
      real(wp) :: per_backsolve = 2          !! one more solution, for each entry of the factor
      type(residual_type) :: residual
      integer :: values_id = 0               !! matrix that is factorised, 0 none
      real(wp), private :: left = -1         !! |f - K x| over the size of x, first solution with the factor; < 0: none
      real(wp), allocatable :: correction(:, :) !! (6, n) of the refinement step
   contains
      procedure :: solve => solve_direct
      procedure(count_work_interface), deferred :: count_work
      procedure(factorize_interface), deferred :: factorize
      procedure(backsolve_interface), deferred :: backsolve
   end type direct_solver_type

   abstract interface
      !> Work of a factorisation of K, counted from its pattern.
      subroutine count_work_interface(self, matrix, operations, fill, error)
         import :: direct_solver_type, block_matrix_type, error_type, wp
         class(direct_solver_type), intent(inout) :: self
         type(block_matrix_type), intent(in) :: matrix
         real(wp), intent(out) :: operations   !! floating point operations
         real(wp), intent(out) :: fill         !! entries of the factor
         type(error_type), allocatable, intent(out) :: error
      end subroutine count_work_interface

      !> Factorise K; an error names the block of the failed pivot.
      subroutine factorize_interface(self, matrix, error)
         import :: direct_solver_type, block_matrix_type, error_type
         class(direct_solver_type), intent(inout) :: self
         type(block_matrix_type), intent(in) :: matrix
         type(error_type), allocatable, intent(out) :: error
      end subroutine factorize_interface

      !> x = K^-1 b with the present factor.
      subroutine backsolve_interface(self, b, x, error)
         import :: direct_solver_type, error_type, wp
         class(direct_solver_type), intent(inout) :: self
         real(wp), intent(in), contiguous :: b(:, :)     !! (6, n)
         real(wp), intent(inout), contiguous :: x(:, :)  !! (6, n)
         type(error_type), allocatable, intent(out) :: error
      end subroutine backsolve_interface
   end interface

contains

   !> Solve K x = f; the starting guess in x is not used.
   subroutine solve_direct(self, matrix, f, x, report, error, effort)
      class(direct_solver_type), intent(inout) :: self
      type(block_matrix_type), intent(in) :: matrix
      real(wp), intent(in), contiguous :: f(:, :)     !! (6, n)
      real(wp), intent(inout), contiguous :: x(:, :)  !! (6, n)
      type(solve_report_type), intent(out) :: report
      type(error_type), allocatable, intent(out) :: error
      type(solve_effort_type), intent(in), optional :: effort
      type(error_type), allocatable :: cause
      real(wp) :: relative, refined
      logical :: done

      if (self%left >= 0 .and. matrix%values_id /= 0 .and. matrix%values_id == self%values_id .and. &
          allocated(self%reference_load)) then
         ! loads are measured by the reference load, that of the first one
         call solve_further(self, f, x, report, error)
         if (report%converged .or. allocated(error)) return
      end if
      call self%residual%start(matrix, f, self%reference_load, x, report, done, error)
      if (done .or. allocated(error)) return
      if (matrix%values_id == 0 .or. matrix%values_id /= self%values_id) then
         self%values_id = 0
         self%left = -1
         call self%factorize(matrix, error)
         if (allocated(error)) then
            if (error%code == error_code%computation) call not_finite(matrix, cause)
            if (allocated(cause)) call move_alloc(cause, error)
            return
         end if
         self%values_id = matrix%values_id
      end if
      call self%backsolve(f, x, error)
      if (allocated(error)) return
      call self%residual%evaluate(matrix, f, x, relative)
      self%left = -1
      if (relative <= self%tolerance) self%left = self%residual%r_norm/sum_of_magnitudes(1, matrix%n, x)
      if (relative > self%tolerance .and. relative < huge(1.0_wp)) then
         call resize(self%correction, 6, matrix%n)
         call self%backsolve(self%residual%r, self%correction, error)
         if (allocated(error)) return
         self%correction = x + self%correction
         call self%residual%evaluate(matrix, f, self%correction, refined)
         if (refined < relative) then
            x = self%correction
            relative = refined
         end if
      end if
      call self%residual%judge(matrix, f, x, relative, self%tolerance, report)
      if (.not. report%converged .and. relative < huge(1.0_wp)) call judge_error(self, matrix, f, x, report, error)
   end subroutine solve_direct

   !> Solve for a further load, and accept x if its estimated residual is clearly small.
   subroutine solve_further(self, f, x, report, error)
      class(direct_solver_type), intent(inout) :: self
      real(wp), intent(in), contiguous :: f(:, :)     !! (6, n)
      real(wp), intent(inout), contiguous :: x(:, :)  !! (6, n)
      type(solve_report_type), intent(inout) :: report
      type(error_type), allocatable, intent(out) :: error
      call self%backsolve(f, x, error)
      if (allocated(error)) return
      report%residual = self%left*sum_of_magnitudes(1, size(x, 2), x)/self%residual%load_norm
      ! not for what is not a number
      report%converged = report%residual <= clearly_small*self%tolerance
   end subroutine solve_further

   !> Accept x when its error, measured in energy, is small.
   subroutine judge_error(self, matrix, f, x, report, error)
      class(direct_solver_type), intent(inout) :: self
      type(block_matrix_type), intent(in) :: matrix
      real(wp), intent(in), contiguous :: f(:, :), x(:, :)   !! (6, n)
      type(solve_report_type), intent(inout) :: report
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: relative, energy, of_error
      call self%residual%evaluate(matrix, f, x, relative)
      call self%backsolve(self%residual%r, self%correction, error)
      if (allocated(error)) return
      energy = sum(f*x)
      of_error = sum(self%residual%r*self%correction)
      report%converged = energy > 0 .and. of_error <= rounding_limit**2*energy
      if (report%converged) report%detail = 'residual '//to_string(relative)// &
         ' is at the rounding of K x; the error of the solution in energy is '// &
         to_string(sqrt(max(of_error, 0.0_wp)/energy))//' of it'
   end subroutine judge_error

   !> To be called before the first call of BLAS. Error: too little memory.
   subroutine check_workspace(name, error)
      character(len=*), intent(in) :: name   !! of the solver
      type(error_type), allocatable, intent(out) :: error
      if (c_is_there(least_room) == 0) call make_error(error, error_code%computation, &
         'out of memory: the solver '//name//' needs 210 MB of address space to begin; choose pcg', &
         is_fatal=.true.)
   end subroutine check_workspace

end module rockdda_linear_direct
