! SPDX-License-Identifier: MIT
!> Uses the library: prints its version and x of 2 x = 1, solved with every direct solver that is built in.
program consumer
   use rockdda_base_version, only : version
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : to_string
   use rockdda_base_error, only : error_type
   use rockdda_linear_matrix, only : block_matrix_type
   use rockdda_linear_solver, only : linear_solver_type, solve_report_type
   use rockdda_linear_pattern, only : build_pattern
   use rockdda_linear_factory, only : new_solver, has_cholmod
   implicit none
   real(wp) :: x(6, 1)

   call solve('dense')
   if (has_cholmod()) call solve('cholmod')
   print '(a)', version//' '//to_string(x(1, 1))

contains

   !> Solve 2 x = 1.
   subroutine solve(name)
      character(len=*), intent(in) :: name   !! of the solver
      type(block_matrix_type) :: matrix
      class(linear_solver_type), allocatable :: solver
      type(solve_report_type) :: report
      type(error_type), allocatable :: error
      real(wp) :: f(6, 1)
      integer :: no_pairs(2, 0), no_slots(0), i
      call build_pattern(1, no_pairs, matrix, no_slots)
      matrix%values(:, :, 1) = 0
      do i = 1, 6
         matrix%values(i, i, 1) = 2
      end do
      call new_solver(name, 1.0e-10_wp, 1.4_wp, ' ', solver, error)
      if (allocated(error)) error stop 'no such solver'
      f = 1
      x = 0
      call solver%solve(matrix, f, x, report, error)
      if (allocated(error)) error stop 'not solved'
   end subroutine solve

end program consumer
