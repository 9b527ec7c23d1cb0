! SPDX-License-Identifier: MIT
!> Plan of the steps that are saved as frames.
!>
!> save_every = K: frame k is step k*K. save_dt = T: the first step at or after each multiple of T. Both: both.
!> Neither: K so that the run has about 100 frames; every tenth step, and the last one of each stage, where the run
!> ends with its last stage.
module rockdda_run_frame_plan
   use rockdda_base_kinds, only : wp
   use rockdda_model_options, only : run_options_type, is_set
   use rockdda_model_parameters, only : parameters_type
   implicit none
   private
   public :: frame_plan_type, new_frame_plan

   integer, parameter :: usual_frames = 100
   !> Steps from frame to frame where the number of steps is not known before.
   integer, parameter :: usual_steps = 10
   !> Frames beyond which their number does not matter.
   integer, parameter :: many_frames = 10000

   type :: frame_plan_type
      integer :: every = 0                      !! steps; 0: not by steps
      real(wp) :: interval = 0                  !! time; 0: not by time
      integer :: passed = 0                     !! multiples of the interval reached so far
   contains
      procedure :: is_due
      procedure :: expected_frames
   end type frame_plan_type

contains

   !> The plan of a run.
   pure function new_frame_plan(options, parameters) result(plan)
      type(run_options_type), intent(in) :: options
      type(parameters_type), intent(in) :: parameters
      type(frame_plan_type) :: plan
      real(wp) :: steps
      if (is_set(options%save_every)) plan%every = max(1, options%save_every)
      if (is_set(options%save_dt)) plan%interval = max(0.0_wp, options%save_dt)
      if (plan%every > 0 .or. plan%interval > 0) return
      if (parameters%n_steps == huge(1) .and. .not. parameters%t_end < huge(1.0_wp)) then
         ! how many steps the stages need is not known; each also ends with a frame
         plan%every = usual_steps
         return
      end if
      steps = parameters%n_steps
      if (parameters%t_end < steps*parameters%dt_max) steps = parameters%t_end/parameters%dt_max
      plan%every = max(1, int(min(steps/usual_frames, 1.0e9_wp)))
   end function new_frame_plan

   !> Is this accepted step a frame? Call it once for each step, in order.
   logical function is_due(self, step, time)
      class(frame_plan_type), intent(inout) :: self
      integer, intent(in) :: step
      real(wp), intent(in) :: time               !! at the end of the step
      integer :: reached
      is_due = .false.
      if (self%every > 0) is_due = mod(step, self%every) == 0
      if (.not. self%interval > 0) return
      ! a step that ends on a multiple up to rounding has reached it
      reached = int(min(time/self%interval*(1 + 1.0e-12_wp), real(huge(1), wp)))
      if (reached > self%passed) is_due = .true.
      self%passed = max(self%passed, reached)
   end function is_due

   !> Number of frames when no step is cut; 0 where the number of steps is not known before.
   pure integer function expected_frames(self, parameters)
      class(frame_plan_type), intent(in) :: self
      type(parameters_type), intent(in) :: parameters
      real(wp) :: frames, steps
      steps = huge(1.0_wp)
      if (parameters%n_steps < huge(1)) steps = parameters%n_steps
      frames = 0
      if (self%every > 0 .and. steps < huge(1.0_wp)) frames = steps/self%every
      if (self%interval > 0) then
         if (parameters%t_end < huge(1.0_wp)) frames = frames + parameters%t_end/self%interval
         if (steps < huge(1.0_wp)) frames = min(frames, steps)
      end if
      expected_frames = int(min(frames, real(many_frames, wp)))
   end function expected_frames

end module rockdda_run_frame_plan
