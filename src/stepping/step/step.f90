! SPDX-License-Identifier: MIT
!> A step: the model and the state that it begins with, and the attempt at it.
module rockdda_stepping_step
   use rockdda_base_phase_times, only : phase_times_type
   use rockdda_contact_table, only : contact_table_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_equations, only : equations_type
   use rockdda_interaction_families, only : families_type
   use rockdda_linear_solver, only : linear_solver_type
   use rockdda_stepping_control, only : step_control_type
   use rockdda_stepping_trial_step, only : trial_step_type
   implicit none
   private
   public :: step_type

   type, extends(step_context_type) :: step_type
      ! the rest of the state on which a step depends
      type(contact_table_type) :: contacts      !! of the last accepted step
      type(step_control_type) :: control
      ! changed by attempts, too: families keep what they commit apart from their trial states, and a step that fails
      ! gives back x and what the solver remembers
      type(families_type) :: families
      type(equations_type) :: equations         !! x: last solution, the start of the next iterative solve
      class(linear_solver_type), allocatable :: solver
      ! the attempt, and scratch
      type(trial_step_type) :: trial
      type(contact_table_type) :: room          !! of the next table of contacts
      integer, allocatable :: skipped(:)        !! stages that were over before their first step, since the last step
      type(phase_times_type) :: times           !! where the time went; nothing depends on it
   end type step_type

end module rockdda_stepping_step
