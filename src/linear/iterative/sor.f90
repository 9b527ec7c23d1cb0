! SPDX-License-Identifier: MIT
!> Block successive over-relaxation, the solver of the original DDA (Shi 1988).
!>
!> One sweep visits the blocks one after the other:
!>
!>     x_i := x_i + omega (K_ii^-1 (f_i - sum_{j /= i} K_ij x_j) - x_i)
!>
!> The order is by colours: blocks of one colour are not coupled, so that threads can share them and the result
!> does not depend on the distribution.
!> It converges for 0 < omega < 2, but slowly where contact springs are much stiffer than inertia. A solve
!> that reaches the largest number of sweeps is reported as not converged.
module rockdda_linear_sor
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type
   use rockdda_base_strings, only : to_string
   use rockdda_linear_matrix, only : block_matrix_type
   use rockdda_linear_solver, only : linear_solver_type, solve_report_type, solve_effort_type
   use rockdda_linear_residual, only : residual_type
   use rockdda_linear_graph, only : colour_blocks
   use rockdda_linear_small_blocks, only : n_packed, solve_block, unpack_lower
   implicit none
   private
   public :: sor_solver_type

   !> Up to this number of blocks threads cost more than they save.
   integer, parameter :: few_blocks = 500

   type, extends(linear_solver_type) :: sor_solver_type
      real(wp) :: tolerance = 1.0e-10_wp   !! wanted relative residual, see rockdda_linear_residual
      real(wp) :: omega = 1.4_wp           !! relaxation factor, 0 < omega < 2
      integer :: max_sweeps = 2000
      integer :: check_every = 8           !! sweeps between two evaluations of the residual
      type(residual_type) :: residual
      integer, private :: graph_id = 0     !! graph of the colours, 0 none
      integer, allocatable :: first(:)     !! (colours + 1) order(first(c) : first(c+1)-1) has colour c
      integer, allocatable :: order(:)     !! (n) blocks by colour
   contains
      procedure :: solve => solve_sor
   end type sor_solver_type

contains

   !> Solve K x = f from the guess in x.
   subroutine solve_sor(self, matrix, f, x, report, error, effort)
      class(sor_solver_type), intent(inout) :: self
      type(block_matrix_type), intent(in) :: matrix
      real(wp), intent(in), contiguous :: f(:, :)     !! (6, n)
      real(wp), intent(inout), contiguous :: x(:, :)  !! (6, n)
      type(solve_report_type), intent(out) :: report
      type(error_type), allocatable, intent(out) :: error
      type(solve_effort_type), intent(in), optional :: effort
      real(wp) :: relative
      logical :: done
      integer :: sweeps

      call self%residual%start(matrix, f, self%reference_load, x, report, done, error)
      if (done .or. allocated(error)) return
      if (self%graph_id /= self%residual%graph_id) call colour_blocks(self%residual%graph, self%first, self%order)
      self%graph_id = self%residual%graph_id
      call self%residual%evaluate(matrix, f, x, relative)
      if (.not. relative < huge(1.0_wp)) then
         x = 0
         relative = self%residual%zero_guess_residual
      end if
      sweeps = 0
      do while (relative > max(self%tolerance, self%enough) .and. &
                relative < huge(1.0_wp) .and. sweeps < self%max_sweeps)
         call sweep(self, matrix, f, min(self%check_every, self%max_sweeps - sweeps), x)
         sweeps = min(sweeps + self%check_every, self%max_sweeps)
         call self%residual%evaluate(matrix, f, x, relative)
         report%interrupted = self%is_interrupted()
         if (report%interrupted) exit
      end do
      report%iterations = sweeps
      if (report%interrupted) return
      call self%residual%judge(matrix, f, x, relative, max(self%tolerance, self%enough), report)
      if (.not. report%converged .and. sweeps >= self%max_sweeps) report%detail = &
         'SOR: '//to_string(sweeps)//' sweeps exhausted, '//report%detail
   end subroutine solve_sor

   !> Sweeps over all blocks, colour by colour.
   subroutine sweep(self, matrix, f, sweeps, x)
      type(sor_solver_type), intent(in) :: self
      type(block_matrix_type), intent(in) :: matrix
      real(wp), intent(in), contiguous :: f(:, :)           !! (6, n)
      integer, intent(in) :: sweeps                         !! number of sweeps
      real(wp), intent(inout), contiguous :: x(:, :)        !! (6, n)
      integer :: s, c, place
      !$omp parallel if(matrix%n > few_blocks) default(none) shared(self, matrix, f, sweeps, x) private(s, c, place)
      do s = 1, sweeps
         do c = 1, size(self%first) - 1
            !$omp do schedule(static)
            do place = self%first(c), self%first(c + 1) - 1
               call relax(self, matrix, f, self%order(place), x)
            end do
            !$omp end do
         end do
      end do
      !$omp end parallel
   end subroutine sweep

   !> Relax one block: replace x_i by the formula of the module.
   pure subroutine relax(self, matrix, f, i, x)
      type(sor_solver_type), intent(in) :: self
      type(block_matrix_type), intent(in) :: matrix
      real(wp), intent(in), contiguous :: f(:, :)           !! (6, n)
      integer, intent(in) :: i                              !! block
      real(wp), intent(inout), contiguous :: x(:, :)        !! (6, n)
      real(wp) :: b(6), y(6), l(6, 6), packed(n_packed)
      integer :: j, k, c
      b = f(:, i)
      do k = self%residual%graph%start(i), self%residual%graph%start(i + 1) - 1
         j = self%residual%graph%neighbour(k)
         y = x(:, j)
         associate (a => matrix%values(:, :, self%residual%graph%place(k)))
            if (j > i) then
               b = b - ((a(:, 1)*y(1) + a(:, 2)*y(2)) + (a(:, 3)*y(3) + a(:, 4)*y(4)) + (a(:, 5)*y(5) + a(:, 6)*y(6)))
            else
               do c = 1, 6
                  b(c) = b(c) - ((a(1, c)*y(1) + a(2, c)*y(2)) + (a(3, c)*y(3) + a(4, c)*y(4)) &
                                 + (a(5, c)*y(5) + a(6, c)*y(6)))
               end do
            end if
         end associate
      end do
      call self%residual%weights%get_factor(i, packed)
      call unpack_lower(packed, l)
      call solve_block(l, b)
      x(:, i) = x(:, i) + self%omega*(b - x(:, i))
   end subroutine relax

end module rockdda_linear_sor
