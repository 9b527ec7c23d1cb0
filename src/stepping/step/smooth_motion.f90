! SPDX-License-Identifier: MIT
!> The equilibrium of an attempt at a step (rockdda_stepping_newton) while contacts that meet by the law of impact stay
!> open: it is found anew until it shows no more such contacts.
module rockdda_stepping_smooth_motion
   use rockdda_base_error, only : error_type
   use rockdda_base_phase_times, only : phase_times_type
   use rockdda_interaction_attempt, only : attempt_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_equations, only : equations_type
   use rockdda_interaction_families, only : families_type
   use rockdda_linear_solver, only : linear_solver_type
   use rockdda_stepping_failure, only : attempt_end
   use rockdda_stepping_impact, only : impact_type
   use rockdda_stepping_newton, only : newton_type, newton_report_type, conditions_type
   implicit none
   private
   public :: smooth_motion_type, newton_report_type, conditions_type

   type, extends(newton_type) :: smooth_motion_type
      type(impact_type) :: impact               !! of the attempt
   contains
      procedure :: find_smooth_motion
   end type smooth_motion_type

contains

   !> Find the motion x and the states of all links at the end of a step, `find_equilibrium`; in dynamic steps again and
   !> again until it is settled which contacts meet by the law of impact. Rounds and iterations are those of all.
   subroutine find_smooth_motion(self, is_dynamic, first_conditions, context, attempt, families, equations, solver, &
                                 times, report, error)
      class(smooth_motion_type), intent(inout) :: self
      logical, intent(in) :: is_dynamic
      type(conditions_type), intent(in) :: first_conditions
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(inout) :: attempt
      type(families_type), intent(inout) :: families
      type(equations_type), intent(inout) :: equations
      class(linear_solver_type), intent(inout) :: solver
      type(phase_times_type), intent(inout) :: times
      type(newton_report_type), intent(out) :: report
      type(error_type), allocatable, intent(out) :: error
      type(conditions_type) :: conditions
      integer :: iterations, rounds
      logical :: is_settled
      conditions = first_conditions
      iterations = 0
      rounds = 0
      associate (contacts => families%contacts)
         call self%impact%begin(contacts%table%n)
         do
            call self%find_equilibrium(conditions, context, attempt, families, equations, solver, times, report, error)
            iterations = iterations + report%iterations
            rounds = rounds + report%rounds
            report%iterations = iterations
            report%rounds = rounds
            if (allocated(error) .or. report%outcome /= attempt_end%converged .or. .not. is_dynamic) return
            call self%impact%mark(context, attempt, contacts%table, contacts%trial, contacts%laws, equations%x, &
                                  is_settled)
            if (is_settled) return
            conditions%may_predict = .false.
            conditions%is_like_last = .false.
         end do
      end associate
   end subroutine find_smooth_motion

end module rockdda_stepping_smooth_motion
