! SPDX-License-Identifier: MIT
!> The matrix of a real step: to a file for other solvers, and timed passes over it.
module bench_matrix
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type
   use rockdda_linear_matrix, only : block_matrix_type, subtract_own, n_stored_blocks
   use rockdda_linear_solver, only : linear_solver_type, solve_report_type
   use rockdda_linear_factory, only : new_solver
   use bench_clock, only : stopwatch_type
   use bench_lines, only : line_type
   implicit none
   private
   public :: write_matrix, time_passes

contains

   !> Stream of native binary numbers: n and the number of stored blocks (two 32-bit integers), row_start (n + 1) and
   !> column (stored), counted from 1, then as doubles values (6, 6, stored; column by column), f (6, n) and x (6, n).
   subroutine write_matrix(path, matrix, f, x)
      character(len=*), intent(in) :: path
      type(block_matrix_type), intent(in) :: matrix
      real(wp), intent(in) :: f(:, :), x(:, :)
      integer :: unit, stored
      stored = n_stored_blocks(matrix)
      open (newunit=unit, file=path, access='stream', form='unformatted', action='write', status='replace')
      write (unit) matrix%n, stored, matrix%row_start(1:matrix%n + 1), matrix%column(1:stored), &
         matrix%values(:, :, 1:stored), f(:, 1:matrix%n), x(:, 1:matrix%n)
      close (unit)
   end subroutine write_matrix

   !> Shortest times [s] of a residual f - K x, of a PCG iteration, and of a whole solve. That of an iteration is the
   !> difference between two solves from zero, one to the tolerance, one stopped early, over that of their iterations.
   subroutine time_passes(matrix, f, tolerance, n_passes, line)
      type(block_matrix_type), intent(in) :: matrix
      real(wp), intent(in) :: f(:, :)         !! (6, n)
      real(wp), intent(in) :: tolerance
      integer, intent(in) :: n_passes
      type(line_type), intent(inout) :: line
      type(stopwatch_type) :: watch
      real(wp), allocatable :: x(:, :), y(:, :)
      real(wp) :: product_seconds, solve_seconds(2)
      integer :: iterations(2), pass
      allocate (x(6, matrix%n), y(6, matrix%n))
      product_seconds = huge(1.0_wp)
      solve_seconds = huge(1.0_wp)
      do pass = 1, n_passes
         x = f
         call watch%start()
         call subtract_own(1, matrix%n, matrix%row_start, matrix%column, matrix%values, f, x, y)
         call watch%stop()
         product_seconds = min(product_seconds, watch%wall)
      end do
      call repeat_solve(1, max(1.0e-3_wp, tolerance))
      call repeat_solve(2, tolerance)
      call line%real('product_seconds', product_seconds)
      call line%real('pcg_solve_seconds', solve_seconds(2))
      call line%integer('pcg_iterations', iterations(2))
      if (iterations(2) > iterations(1)) call line%real('pcg_iteration_seconds', &
         (solve_seconds(2) - solve_seconds(1))/(iterations(2) - iterations(1)))

   contains

      !> Shortest time of a PCG solve from zero with a known pattern.
      subroutine repeat_solve(which, wanted)
         integer, intent(in) :: which
         real(wp), intent(in) :: wanted
         class(linear_solver_type), allocatable :: solver
         type(solve_report_type) :: report
         type(error_type), allocatable :: error
         integer :: k
         iterations(which) = 0
         call new_solver('pcg', wanted, 1.4_wp, '', solver, error)
         if (allocated(error)) return
         do k = 0, n_passes
            x = 0
            call watch%start()
            call solver%solve(matrix, f, x, report, error)
            call watch%stop()
            if (allocated(error)) return
            if (.not. report%converged) return
            iterations(which) = report%iterations
            if (k > 0) solve_seconds(which) = min(solve_seconds(which), watch%wall)
         end do
      end subroutine repeat_solve

   end subroutine time_passes

end module bench_matrix
