! SPDX-License-Identifier: MIT
!> A run at time 0: the state of the blocks and of all that acts on them.
module rockdda_stepping_start
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_diagnostics, only : diagnostics_type
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_datum, only : find_datum, move_model
   use rockdda_model_parameters, only : parameters_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_liner_placing, only : add_liner_materials
   use rockdda_linear_factory, only : new_solver, default_solver, has_cholmod
   use rockdda_stepping_construction, only : construction_type
   use rockdda_stepping_control, only : new_step_control
   use rockdda_stepping_motion, only : start_state
   use rockdda_check_options, only : check_start
   use rockdda_stepping_step, only : step_type
   implicit none
   private
   public :: start_step

contains

   !> Check a model and its numbers, and make all that the first step begins with. Errors: input that no run can start
   !> from.
   subroutine start_step(blocks, parameters, step, construction, error)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(step_type), intent(inout) :: step
      type(construction_type), intent(inout) :: construction
      type(error_type), allocatable, intent(out) :: error
      type(diagnostics_type) :: problems
      step%blocks = blocks
      step%parameters = parameters
      if (blocks%n_blocks < 1) then
         call make_error(error, error_code%input, 'the model has no blocks')
         return
      end if
      call check_start(blocks, parameters, problems)
      call problems%to_error(error)
      if (allocated(error)) return
      if (len_trim(parameters%solver_method) == 0) step%parameters%solver_method = default_solver()
      call new_solver(solver_for(step%parameters, blocks%n_blocks), parameters%solver_tolerance, &
                      parameters%sor_factor, parameters%preconditioner, step%solver, error)
      if (allocated(error)) return
      call add_liner_materials(step%parameters)
      call start_state(blocks, parameters, step%state, step%initial_stress)
      call construction%init(blocks, parameters, step%state)
      call step%ground_motion%init(parameters%quakes)
      call new_step_control(parameters, blocks%fixed%n, step%control)
      step%trial%water = step%control%water(parameters)
      call step%families%init(step%step_context_type, step%trial%attempt_type)
      call step%families%liners%add_segments(step%step_context_type)
      call step%families%loads%make_room(step%blocks%n_blocks)
      call construction%make_room(step%blocks%n_blocks)
      call subtract_datum(step%step_context_type)
      call step%families%bars%subtract_datum(step%state%datum)
      call step%families%liners%start(step%step_context_type)
      call step%trial%finder%init(step%blocks)
      call step%contacts%resize(0)
      call step%equations%set_size(step%blocks%n_blocks, 0)
      step%equations%x = 0
   end subroutine start_step

   !> The solver of the options; for linings, whose bending is far softer than their stretching, the direct one where
   !> the program may choose and blocks are few. Among many it would cost twice as much as the solver that learns.
   pure function solver_for(parameters, n_blocks) result(name)
      type(parameters_type), intent(in) :: parameters
      integer, intent(in) :: n_blocks          !! of the model, without segments
      integer, parameter :: few_blocks = 500
      character(len=:), allocatable :: name
      name = parameters%solver_method
      if (.not. allocated(parameters%liners)) return
      if (size(parameters%liners) > 0 .and. name == default_solver() .and. has_cholmod() .and. &
          len_trim(parameters%preconditioner) == 0 .and. n_blocks <= few_blocks) name = 'cholmod'
   end function solver_for

   !> Make all positions relative to a datum, for digits (rockdda_model_datum). What has been found with them stays.
   subroutine subtract_datum(self)
      class(step_context_type), intent(inout) :: self
      integer :: axis
      self%state%datum = find_datum(self%blocks)
      if (.not. any(abs(self%state%datum) > 0)) return
      call move_model(-self%state%datum, self%blocks)
      do axis = 1, 2
         self%line_ends(axis::2, :) = self%line_ends(axis::2, :) - self%state%datum(axis)
         self%initial_stress%centroid(axis, :) = self%initial_stress%centroid(axis, :) - self%state%datum(axis)
         self%state%bolt_ends(axis::2, :) = self%state%bolt_ends(axis::2, :) - self%state%datum(axis)
         self%state%measured_from(axis, :) = self%state%measured_from(axis, :) - self%state%datum(axis)
         call subtract(self%state%vertices)
         call subtract(self%state%centroid)
         call subtract(self%state%fixed_position)
         call subtract(self%state%loading_position)
         call subtract(self%state%measured_position)
      end do

   contains

      !> Along the axis.
      subroutine subtract(positions)
         real(wp), intent(inout) :: positions(:, :)
         positions(axis, :) = positions(axis, :) - self%state%datum(axis)
      end subroutine subtract

   end subroutine subtract_datum

end module rockdda_stepping_start
