! SPDX-License-Identifier: MIT
!> Interface of the solvers of K x = f.
!>
!> Non-convergence is a result, not an error: the time loop then shortens the step. Errors are a solver that is not
!> built in, and a matrix that is not positive definite (with the number of its block).
module rockdda_linear_solver
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type
   use rockdda_base_interruption, only : interruption_type
   use rockdda_linear_matrix, only : block_matrix_type
   implicit none
   private
   public :: linear_solver_type, solve_report_type, solve_effort_type

   !> Outcome of a solve.
   type :: solve_report_type
      logical :: converged = .false.
      logical :: interrupted = .false.      !! a stop was requested: not converged, x is of no use
      integer :: iterations = 0             !! 0 for a direct solve
      real(wp) :: residual = 0              !! |K x - f| / |f|, see rockdda_linear_residual
      real(wp) :: left = 0                  !! |K x - f| of a solve that has paused: solving again continues it; else 0
      character(len=:), allocatable :: detail !! why it did not converge, or which block failed
   end type solve_report_type

   !> How far an iterative solve goes.
   type :: solve_effort_type
      real(wp) :: pause = 0            !! share of its first residual at which a long iteration may pause, 0: never
      logical :: continues = .false.   !! the system is that of the last solve, which has paused
   end type solve_effort_type

   type, abstract :: linear_solver_type
      !> (6, n) When allocated, residuals are measured against the larger of |f| and |reference_load|. Near
      !> equilibrium the loads in f cancel; the sum of their magnitudes is the scale for a small residual.
      real(wp), allocatable :: reference_load(:, :)
      real(wp), allocatable :: centroid(:, :)   !! (2, n) of the blocks, for coarse spaces; may be absent
      real(wp) :: enough = 0    !! relative residual at which iterative solvers may stop, above their tolerance
      class(interruption_type), allocatable :: interruption   !! requests to stop; absent: none
      character(len=:), allocatable :: choice  !! of the automatic solver: which solver solved last, and why
   contains
      procedure(solve_interface), deferred :: solve
      procedure :: is_interrupted
      procedure :: pack => pack_nothing
      procedure :: unpack => unpack_nothing
   end type linear_solver_type

   abstract interface
      !> Solve K x = f. x holds the starting guess on entry (used by iterative solvers only).
      subroutine solve_interface(self, matrix, f, x, report, error, effort)
         import :: linear_solver_type, block_matrix_type, solve_report_type, solve_effort_type, error_type, wp
         class(linear_solver_type), intent(inout) :: self
         type(block_matrix_type), intent(in) :: matrix
         real(wp), intent(in), contiguous :: f(:, :)     !! (6, n)
         real(wp), intent(inout), contiguous :: x(:, :)  !! (6, n)
         type(solve_report_type), intent(out) :: report
         type(error_type), allocatable, intent(out) :: error
         type(solve_effort_type), intent(in), optional :: effort   !! default: to the tolerance, a new system
      end subroutine solve_interface
   end interface

contains

   !> Was a stop requested? Iterative solvers call this every few iterations.
   logical function is_interrupted(self)
      class(linear_solver_type), intent(in) :: self
      is_interrupted = .false.
      if (allocated(self%interruption)) is_interrupted = self%interruption%is_requested()
   end function is_interrupted

   !> State that later solves depend on beside the matrix and the loads: a checkpoint has to hold it.
   !> Most solvers have none: the orderings and factors that they keep are functions of the matrix.
   pure subroutine pack_nothing(self, memory)
      class(linear_solver_type), intent(in) :: self
      real(wp), allocatable, intent(out) :: memory(:)   !! size 0: no state; its meaning is private to the solver
      allocate (memory(0))
   end subroutine pack_nothing

   !> Restore the state from `pack`. One of another size, from another solver, is ignored.
   pure subroutine unpack_nothing(self, memory)
      class(linear_solver_type), intent(inout) :: self
      real(wp), intent(in) :: memory(:)
   end subroutine unpack_nothing

end module rockdda_linear_solver
