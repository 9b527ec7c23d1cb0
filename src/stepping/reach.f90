! SPDX-License-Identifier: MIT
!> How far the contact search of a step has to look.
module rockdda_stepping_reach
   use rockdda_base_kinds, only : wp
   use rockdda_base_parallel, only : parallel_blocks
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_state, only : block_state_type
   use rockdda_stepping_control, only : step_control_type
   implicit none
   private
   public :: predicted_reach, quantised

contains

   !> How far the search has to look: four times the displacement expected in the step, at least a little,
   !> rounded up to a power of two (times w0) so that the graph of candidates changes seldom.
   real(wp) function predicted_reach(blocks, parameters, state, control, dt) result(reach)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(block_state_type), intent(in) :: state
      type(step_control_type), intent(in) :: control
      real(wp), intent(in) :: dt
      real(wp) :: fastest, acceleration, expected, arm
      integer :: i
      acceleration = 0
      do i = 1, size(parameters%block_materials)
         associate (m => parameters%block_materials(i))
            acceleration = max(acceleration, abs(m%weight)/m%density)
         end associate
      end do
      if (parameters%gravity >= 0) acceleration = parameters%gravity
      fastest = 0
      !$omp parallel do default(none) shared(blocks, state) private(i, arm) reduction(max:fastest) schedule(static) &
      !$omp if (blocks%n_blocks > parallel_blocks)
      do i = 1, blocks%n_blocks
         arm = sqrt((state%moments(1, i) + state%moments(2, i))/state%area(i))
         fastest = max(fastest, norm2(state%velocity(1:2, i)) + &
                       2*arm*(abs(state%velocity(3, i)) + norm2(state%velocity(4:6, i))))
      end do
      !$omp end parallel do
      expected = fastest*dt + 0.5_wp*acceleration*abs(control%gravity(parameters))*dt**2
      if (control%last_dt > 0) expected = max(expected, control%last_displacement*dt/control%last_dt)
      ! what moves further than the search distance allows will be cut; looking that far could make every pair of
      ! blocks a candidate
      reach = parameters%search_distance
      if (4*expected < reach) reach = min(quantised(4*expected, parameters%w0), reach)
   end function predicted_reach

   !> The next power of two times w0, at least 1e-7 w0.
   pure real(wp) function quantised(length, w0)
      real(wp), intent(in) :: length, w0
      quantised = w0*2.0_wp**ceiling(log(max(length/w0, 1.0e-7_wp))/log(2.0_wp))
   end function quantised

end module rockdda_stepping_reach
