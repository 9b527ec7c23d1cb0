! SPDX-License-Identifier: MIT
!> All solvers by name, for tests that hold for each of them.
module each_solver
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type
   use rockdda_linear_matrix, only : block_matrix_type
   use rockdda_linear_solver, only : linear_solver_type, solve_report_type
   use rockdda_linear_factory, only : new_solver, has_cholmod
   implicit none
   private
   public :: names, solve_with, is_built

   !> The direct solvers are the first two, the last one chooses between some of the others.
   character(len=*), parameter :: names(5) = [character(len=8) :: 'dense', 'cholmod', 'sor', 'pcg', 'auto']

contains

   !> Solve with the solver of that name, from x = 0.
   subroutine solve_with(name, tolerance, matrix, f, x, report, error)
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: tolerance
      type(block_matrix_type), intent(in) :: matrix
      real(wp), intent(in) :: f(:, :)
      real(wp), allocatable, intent(out) :: x(:, :)
      type(solve_report_type), intent(out) :: report
      type(error_type), allocatable, intent(out) :: error
      class(linear_solver_type), allocatable :: solver
      call new_solver(name, tolerance, 1.4_wp, '', solver, error)
      if (allocated(error)) return
      allocate (x(6, matrix%n))
      x = 0
      call solver%solve(matrix, f, x, report, error)
   end subroutine solve_with

   !> Is this solver there to be tested?
   logical function is_built(name)
      character(len=*), intent(in) :: name
      is_built = name /= 'cholmod' .or. has_cholmod()
   end function is_built

end module each_solver
