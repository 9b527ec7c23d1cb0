! SPDX-License-Identifier: MIT
!> Block successive over-relaxation, the solver of the original DDA (Shi 1988).
!>
!> One sweep visits the blocks in order:
!>
!>     x_i := x_i + omega (K_ii^-1 (f_i - sum_{j /= i} K_ij x_j) - x_i)
!>
!> It converges for 0 < omega < 2, but slowly where contact springs are much stiffer than inertia. Sweeps
!> exhausted means not converged, and is reported.
module rockdda_linear_sor
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type
   use rockdda_base_strings, only : to_string
   use rockdda_linear_matrix, only : block_matrix_type
   use rockdda_linear_solver, only : linear_solver_type, solve_report_type
   use rockdda_linear_residual, only : residual_type
   use rockdda_linear_small_blocks, only : solve_block
   implicit none
   private
   public :: sor_solver_type

   type, extends(linear_solver_type) :: sor_solver_type
      real(wp) :: tolerance = 1.0e-10_wp   !! wanted relative residual, see rockdda_linear_residual
      real(wp) :: omega = 1.4_wp           !! relaxation factor, 0 < omega < 2
      integer :: max_sweeps = 2000
      integer :: check_every = 8           !! sweeps between two looks at the residual
      type(residual_type) :: residual
      real(wp), allocatable :: lower(:, :) !! (6, n) f_i - sum_{j < i} K_ij x_j of the running sweep
   contains
      procedure :: solve => solve_sor
      procedure :: name => name_sor
   end type sor_solver_type

contains

   !> Solve K x = f from the guess in x.
   subroutine solve_sor(self, matrix, f, x, report, error)
      class(sor_solver_type), intent(inout) :: self
      type(block_matrix_type), intent(in) :: matrix
      real(wp), intent(in), contiguous :: f(:, :)     !! (6, n)
      real(wp), intent(inout), contiguous :: x(:, :)  !! (6, n)
      type(solve_report_type), intent(out) :: report
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: relative
      logical :: done
      integer :: sweeps, s

      call self%residual%start(matrix, f, x, report, done, error)
      if (done .or. allocated(error)) return
      if (allocated(self%lower)) then
         if (size(self%lower, 2) /= matrix%n) deallocate (self%lower)
      end if
      if (.not. allocated(self%lower)) allocate (self%lower(6, matrix%n))
      call self%residual%evaluate(matrix, f, x, relative)
      if (.not. relative < huge(1.0_wp)) then
         x = 0
         relative = 1
      end if
      sweeps = 0
      do while (relative > self%tolerance .and. relative < huge(1.0_wp) .and. sweeps < self%max_sweeps)
         do s = 1, min(self%check_every, self%max_sweeps - sweeps)
            call sweep(matrix, self%residual%factor, f, self%omega, self%lower, x)
            sweeps = sweeps + 1
         end do
         call self%residual%evaluate(matrix, f, x, relative)
      end do
      report%iterations = sweeps
      call self%residual%judge(matrix, f, x, relative, self%tolerance, report)
      if (.not. report%converged .and. sweeps >= self%max_sweeps) report%detail = &
         'SOR: '//to_string(sweeps)//' sweeps exhausted, '//report%detail
   end subroutine solve_sor

   !> One sweep over all blocks. Each stored block serves its own row and, transposed, the row of its column.
   pure subroutine sweep(matrix, factor, f, omega, lower, x)
      type(block_matrix_type), intent(in) :: matrix
      real(wp), intent(in), contiguous :: factor(:, :, :)   !! (6, 6, n) of the diagonal blocks
      real(wp), intent(in), contiguous :: f(:, :)           !! (6, n)
      real(wp), intent(in) :: omega
      real(wp), intent(inout), contiguous :: lower(:, :)    !! (6, n) work
      real(wp), intent(inout), contiguous :: x(:, :)        !! (6, n)
      real(wp) :: b(6)
      integer :: i, j, k
      lower = f
      do i = 1, matrix%n
         b = lower(:, i)
         do k = matrix%row_start(i) + 1, matrix%row_start(i + 1) - 1
            b = b - matmul(matrix%values(:, :, k), x(:, matrix%column(k)))
         end do
         call solve_block(factor(:, :, i), b)
         x(:, i) = x(:, i) + omega*(b - x(:, i))
         do k = matrix%row_start(i) + 1, matrix%row_start(i + 1) - 1
            j = matrix%column(k)
            lower(:, j) = lower(:, j) - matmul(x(:, i), matrix%values(:, :, k))
         end do
      end do
   end subroutine sweep

   !> Name as in the options.
   pure function name_sor(self) result(name)
      class(sor_solver_type), intent(in) :: self
      character(len=:), allocatable :: name
      name = 'sor'
      associate (unused => self%tolerance)
      end associate
   end function name_sor

end module rockdda_linear_sor
