! SPDX-License-Identifier: MIT
!> The choice between conjugate gradients and a direct solver, made by counting work.
!>
!> The work of a factorisation is known from the pattern. The iterations of PCG follow from the matrix: moving
!> all blocks together strains no contact, so that the force it takes on block i, over the force it takes to
!> move the block alone,
!>
!>     rho_i = e^T sum_j K_ij e / e^T K_ii e,    e = (1, 1, 0, 0, 0, 0),
!>
!> is the share of inertia in the block's stiffness. With rho their geometric mean the condition is about
!> 1/rho, and PCG needs about 0.36 ln(1/reduction)/sqrt(rho) iterations with the ic0 preconditioner (on brick
!> walls the factor is 0.32 to 0.41 for stiffness ratios from 1 to 100).
!>
!> Nothing but the matrix, the load and the guess enters: the same solve makes the same choice, on any machine
!> and after a restart. When PCG does not get there in the iterations granted, the direct solver takes over.
module rockdda_linear_auto
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type
   use rockdda_base_strings, only : to_string
   use rockdda_linear_matrix, only : block_matrix_type
   use rockdda_linear_solver, only : linear_solver_type, solve_report_type
   use rockdda_linear_direct, only : direct_solver_type
   use rockdda_linear_pcg, only : pcg_solver_type
   use rockdda_linear_products, only : n_stored_blocks
   implicit none
   private
   public :: auto_solver_type

   type, extends(linear_solver_type) :: auto_solver_type
      type(pcg_solver_type) :: pcg
      class(direct_solver_type), allocatable :: direct
      integer :: direct_limit = huge(1)        !! models with more blocks never go to the direct solver
      character(len=:), allocatable :: choice  !! what was chosen last, and why
      real(wp), allocatable :: together(:), alone(:)   !! (n) work
   contains
      procedure :: solve => solve_auto
      procedure :: name => name_auto
   end type auto_solver_type

   ! Work in units of 1 ns on the machine the constants were measured on; only their ratios matter.
   real(wp), parameter :: per_iteration = 33      !! PCG, for each stored block
   real(wp), parameter :: per_preparation = 400   !! PCG, for each stored block
   real(wp), parameter :: per_operation = 0.06_wp !! factorisation
   real(wp), parameter :: per_fill = 20           !! factorisation and solution, for each entry of the factor
   !> The analysis is paid once for many solves; without one at hand it is worth making when PCG is expected to
   !> cost more than this for each block and sqrt(block).
   real(wp), parameter :: worth_analysis = 300
   !> Iterations for a condition of one and a reduction by e.
   real(wp), parameter :: iterations_per_digit = 0.36_wp
   !> Iterations granted, in multiples of those expected.
   real(wp), parameter :: patience = 3

contains

   !> Solve K x = f with what promises least work.
   subroutine solve_auto(self, matrix, f, x, report, error)
      class(auto_solver_type), intent(inout) :: self
      type(block_matrix_type), intent(in) :: matrix
      real(wp), intent(in), contiguous :: f(:, :)     !! (6, n)
      real(wp), intent(inout), contiguous :: x(:, :)  !! (6, n)
      type(solve_report_type), intent(out) :: report
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: inertia_share, expected, work_pcg, work_direct, operations, fill
      integer :: wasted
      character(len=:), allocatable :: failure

      call measure_inertia(self, matrix, inertia_share)
      call pass_reference(self)
      expected = iterations_per_digit*log(1/self%pcg%tolerance)/sqrt(inertia_share)
      work_pcg = n_stored_blocks(matrix)*(per_preparation + expected*per_iteration)
      self%choice = 'pcg: about '//to_string(nint(min(expected, 1.0e9_wp)))//' iterations expected'
      if (matrix%n <= self%direct_limit .and. work_pcg > worth_analysis*real(matrix%n, wp)**1.5_wp) then
         call self%direct%count_work(matrix, operations, fill, error)
         work_direct = per_operation*operations + per_fill*fill
         if (allocated(error)) then
            ! no room for the analysis: leave it to PCG
            deallocate (error)
         else if (work_direct < work_pcg) then
            self%choice = self%direct%name()//': counted work is '//to_string(work_direct/work_pcg)//' of that of pcg'
            call self%direct%solve(matrix, f, x, report, error)
            if (.not. allocated(report%detail)) report%detail = self%choice
            return
         end if
      end if
      self%pcg%max_iterations = nint(min(patience*expected + 100, 1.0e4_wp))
      call self%pcg%solve(matrix, f, x, report, error)
      if (allocated(error)) return
      if (report%converged .or. matrix%n > self%direct_limit) then
         if (.not. allocated(report%detail)) report%detail = self%choice
         return
      end if
      wasted = report%iterations
      failure = report%detail
      call self%direct%solve(matrix, f, x, report, error)
      report%iterations = wasted
      self%choice = self%direct%name()//' took over: '//failure
      if (.not. allocated(report%detail)) report%detail = self%choice
   end subroutine solve_auto

   !> Hand the reference load on to the solvers that do the work.
   subroutine pass_reference(self)
      type(auto_solver_type), intent(inout) :: self
      if (.not. allocated(self%reference_load)) return
      self%pcg%reference_load = self%reference_load
      self%direct%reference_load = self%reference_load
   end subroutine pass_reference

   !> Geometric mean over the blocks of rho_i, see the head of the module.
   subroutine measure_inertia(self, matrix, share)
      type(auto_solver_type), intent(inout) :: self
      type(block_matrix_type), intent(in) :: matrix
      real(wp), intent(out) :: share   !! between 1e-12 and 1
      real(wp) :: total
      integer :: i, k
      if (allocated(self%alone)) then
         if (size(self%alone) /= matrix%n) deallocate (self%alone, self%together)
      end if
      if (.not. allocated(self%alone)) allocate (self%alone(matrix%n), self%together(matrix%n))
      associate (alone => self%alone, together => self%together)
         do i = 1, matrix%n
            alone(i) = sum(matrix%values(1:2, 1:2, matrix%row_start(i)))
         end do
         together = alone
         do i = 1, matrix%n
            do k = matrix%row_start(i) + 1, matrix%row_start(i + 1) - 1
               total = sum(matrix%values(1:2, 1:2, k))
               together(i) = together(i) + total
               together(matrix%column(k)) = together(matrix%column(k)) + total
            end do
         end do
         total = 0
         do i = 1, matrix%n
            if (alone(i) > 0) total = total + log(min(1.0_wp, max(1.0e-12_wp, together(i)/alone(i))))
         end do
      end associate
      share = exp(total/max(1, matrix%n))
   end subroutine measure_inertia

   !> Name as in the options.
   pure function name_auto(self) result(name)
      class(auto_solver_type), intent(in) :: self
      character(len=:), allocatable :: name
      name = 'auto'
      associate (unused => self%direct_limit)
      end associate
   end function name_auto

end module rockdda_linear_auto
