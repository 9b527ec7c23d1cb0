! SPDX-License-Identifier: MIT
!> Times the solvers on systems from real steps.
!>
!>     bench_solvers columns=50 courses=40 ratio=40 k01=0 steps=8 solver="'pcg'" preconditioner="'ic0'" stem="'wall'"
!>
!> Runs a wall (see step_systems) for the given number of steps and prints open-close rounds, iterations and time of
!> each step; then the time to solve the last system again, from zero and from the solution of the step before. With a
!> stem that system is written in Matrix Market format: STEM.mtx, and STEM_vectors.mtx with the load, the solution, the
!> guess and the blocks' centroids.
program bench_solvers
   use, intrinsic :: iso_fortran_env, only : output_unit, error_unit, int64
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type
   use rockdda_linear_solver, only : solve_report_type
   use rockdda_stepping_simulation, only : simulation_type
   use step_systems, only : wall_type, start_wall, write_matrix_market
   implicit none
   type(wall_type) :: wall
   type(simulation_type), allocatable :: sim
   type(error_type), allocatable :: error
   type(solve_report_type) :: cold_report, warm_report
   real(wp), allocatable :: guess(:, :), x(:, :), vectors(:, :, :)
   real(wp) :: step_time, cold_time, warm_time
   character(len=80) :: word, stem, solver, preconditioner
   character(len=1000) :: words
   integer :: steps, s, repeat, columns, courses, status
   real(wp) :: ratio, k01, tilt, friction, bond
   namelist /run/ columns, courses, ratio, k01, steps, solver, preconditioner, tilt, friction, bond, stem

   columns = 50
   courses = 40
   steps = 5
   ratio = wall%ratio
   k01 = wall%k01
   tilt = wall%tilt
   friction = wall%friction
   bond = wall%bond
   solver = ''
   preconditioner = ''
   stem = ''
   words = '&run '
   do s = 1, command_argument_count()
      call get_command_argument(s, word)
      words = trim(words)//' '//word
   end do
   words = trim(words)//' /'
   read (words, nml=run, iostat=status, iomsg=word)
   if (status /= 0) then
      write (error_unit, '(a)') trim(word)
      stop 2
   end if
   wall = wall_type(columns=columns, courses=courses, ratio=ratio, k01=k01, tilt=tilt, friction=friction, bond=bond, &
                    solver=solver, preconditioner=preconditioner)
   allocate (sim)
   call start_wall(wall, sim, error)
   call stop_on_error()
   do s = 1, steps
      guess = sim%equations%x
      step_time = seconds()
      call sim%advance(error)
      call stop_on_error()
      step_time = seconds() - step_time
      if (s <= 3 .or. s == steps) call show('step', s, sim%record%open_close_iterations, &
                                            sim%record%solver_iterations, step_time)
      if (s == steps) write (output_unit, '(a, es10.3)') 'dt ', sim%record%dt
   end do
   cold_time = huge(1.0_wp)
   warm_time = huge(1.0_wp)
   do repeat = 1, 3
      x = 0*guess
      call time_solve(cold_time, cold_report)
      x = guess
      call time_solve(warm_time, warm_report)
   end do
   call show('cold', steps, 1, cold_report%iterations, cold_time)
   call show('warm', steps, 1, warm_report%iterations, warm_time)
   if (allocated(cold_report%detail)) write (output_unit, '(a)') cold_report%detail
   if (len_trim(stem) > 0) then
      allocate (vectors(6, sim%blocks%n_blocks, 4), source=0.0_wp)
      vectors(:, :, 1) = sim%equations%f
      vectors(:, :, 2) = sim%equations%x
      vectors(:, :, 3) = guess
      vectors(1:2, :, 4) = sim%state%centroid
      call write_matrix_market(trim(stem), sim%equations%matrix, vectors)
   end if

contains

   !> Solve once from the guess in x; keep the shortest time.
   subroutine time_solve(shortest, report)
      real(wp), intent(inout) :: shortest
      type(solve_report_type), intent(out) :: report
      real(wp) :: start
      start = seconds()
      call sim%solver%solve(sim%equations%matrix, sim%equations%f, x, report, error)
      shortest = min(shortest, seconds() - start)
      call stop_on_error()
   end subroutine time_solve

   !> Print one line.
   subroutine show(what, step, rounds, iterations, time)
      character(len=*), intent(in) :: what
      integer, intent(in) :: step, rounds, iterations
      real(wp), intent(in) :: time
      write (output_unit, '(a, i5, a, i3, a, i6, a, f10.2, a)') what, step, '  rounds', rounds, '  iterations', &
         iterations, '  ', 1.0e3_wp*time, ' ms'
   end subroutine show

   !> Processor time of the process: unlike wall-clock time it hardly depends on other processes.
   real(wp) function seconds()
      call cpu_time(seconds)
   end function seconds

   !> Print an error and stop.
   subroutine stop_on_error()
      if (.not. allocated(error)) return
      write (error_unit, '(a)') error%message
      stop 1
   end subroutine stop_on_error

end program bench_solvers
