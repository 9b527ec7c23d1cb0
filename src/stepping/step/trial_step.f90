! SPDX-License-Identifier: MIT
!> The step at hand: attempts to solve it, each with a shorter dt than the last, until the motion can be accepted.
!>
!> Every attempt starts from the state of the last accepted step and leaves it as it is: what it finds of the start of
!> the step, and of blocks asleep, is kept beside it. The accepted motion is applied in rockdda_stepping_acceptance. A
!> step that fails or is interrupted gives back the last motion and the memory of the solver (`drop_attempts`).
module rockdda_stepping_trial_step
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type, add_context
   use rockdda_base_phase_times, only : phase_times_type, phase
   use rockdda_base_strings, only : to_string
   use rockdda_model_parameters, only : parameters_type
   use rockdda_contact_table, only : contact_table_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_equations, only : equations_type
   use rockdda_interaction_families, only : families_type
   use rockdda_interaction_time_scheme, only : time_scheme_type, scheme_of_start, purpose
   use rockdda_linear_solver, only : linear_solver_type
   use rockdda_stepping_contact_finder, only : contact_finder_type
   use rockdda_stepping_control, only : step_control_type, cut_for_displacement, cut_reason, n_cut_reasons
   use rockdda_stepping_failure, only : most_listed, attempt, judge_motion, report_failure
   use rockdda_stepping_sleep, only : wake_disturbed
   use rockdda_stepping_smooth_motion, only : smooth_motion_type, newton_report_type, conditions_type
   implicit none
   private
   public :: trial_step_type, trial_report_type

   !> In steps in which no block turns by more [rad] forces need not be turned from mid-step to where they act: a
   !> pendulum gains less than 1e-5 of its energy in a second.
   real(wp), parameter :: least_turn = 1.0e-5_wp

   !> The model, its state and the attempt at hand are those of `step_context_type`.
   type, extends(step_context_type) :: trial_step_type
      ! the rest of the state on which a step depends
      type(contact_table_type) :: contacts      !! of the last accepted step
      type(step_control_type) :: control
      type(families_type) :: families           !! families%held is a part of the state
      type(equations_type) :: equations         !! x: last solution, the start of the next iterative solve
      ! tools and scratch
      class(linear_solver_type), allocatable :: solver
      type(contact_finder_type) :: finder
      type(smooth_motion_type) :: newton
      type(contact_table_type) :: room          !! scratch of the next table of contacts
      integer, allocatable :: skipped(:)        !! stages that were over before their first step, since the last step
      type(phase_times_type) :: times           !! where the time went; nothing depends on it
      real(wp), allocatable :: last_motion(:, :)       !! (6, nb) x at the start of the step
      real(wp), allocatable, private :: memory(:)      !! of the solver, there
   contains
      procedure :: find_motion
      procedure :: find_contacts
      procedure, private :: begin_step
      procedure, private :: try_step
      procedure, private :: expect_motion
      procedure, private :: find_acceleration
      procedure, private :: turn_forces
      procedure, private :: drop_attempts
   end type trial_step_type

   !> A motion that can be accepted, unless the search for it was interrupted.
   type :: trial_report_type
      logical :: interrupted = .false.   !! a stop was requested; nothing has changed
      logical :: shortened = .false.     !! dt was shortened to land on an end
      real(wp) :: displacement = 0       !! largest of any vertex [length]
      integer :: rounds = 0              !! of the open-close iteration, of the accepted attempt
      integer :: attempts = 0
      integer :: iterations = 0          !! of the solver, of all attempts
      integer :: cuts(n_cut_reasons) = 0 !! attempts that failed, by reason
   end type trial_report_type

contains

   !> Find the motion `equations%x` of the step. On error (exit code 3) no attempt has succeeded, not even with the
   !> smallest step.
   subroutine find_motion(self, report, error)
      class(trial_step_type), intent(inout) :: self
      type(trial_report_type), intent(out) :: report
      type(error_type), allocatable, intent(out) :: error
      type(newton_report_type) :: of_attempt
      real(wp) :: reach
      logical :: at_floor, is_first
      integer :: n_woken, n_solved
      if (.not. allocated(self%last_motion)) allocate (self%last_motion, mold=self%equations%x)
      self%last_motion(:, :) = self%equations%x
      call self%solver%pack(self%memory)
      call self%begin_step()
      if (abs(self%dt - self%control%last_dt) <= 0 .and. self%control%is_static(self%parameters)) &
         call self%control%trend%expect(self%dt, self%state%acceleration, self%equations%x)
      reach = self%finder%first_reach(self%step_context_type, self%control)
      call self%find_contacts(reach)
      n_solved = 0
      is_first = .true.
      do
         report%attempts = report%attempts + 1
         ! the negation: a step that is no number has no smaller one
         at_floor = .not. self%dt > self%parameters%dt_min*(1 + 1.0e-12_wp)
         call self%try_step(reach, is_first, at_floor, of_attempt, report%displacement, error)
         is_first = .false.
         report%iterations = report%iterations + of_attempt%iterations
         if (allocated(error)) then
            call add_context(error, 'step '//to_string(self%state%step + 1))
            call self%drop_attempts()
            return
         end if
         select case (of_attempt%outcome)
         case (attempt%converged)
            ! a motion that disturbs blocks asleep is no attempt that failed: wake them, and begin again
            n_solved = n_solved + 1
            call wake_disturbed(self, self%equations, self%contacts, n_solved, self%asleep, self%calm, n_woken)
            if (n_woken == 0) exit
            call self%find_contacts(reach)
            report%attempts = report%attempts - 1
         case (attempt%interrupted)
            report%interrupted = .true.
            call self%drop_attempts()
            return
         case (attempt%search_again)
            ! the motion could be accepted, but goes beyond the search: search further, and begin again
            reach = self%finder%longer_reach(reach, report%displacement, self%parameters%w0)
            call self%find_contacts(reach)
            report%attempts = report%attempts - 1
         case default
            if (at_floor) then
               call report_failure(of_attempt%outcome, self%dt, of_attempt%detail, self%blocks, self%parameters, &
                                   self%state, self%families%contacts%table, self%families%contacts%trial, &
                                   self%families%liners%tell_changes(self%step_context_type, most_listed), &
                                   self%equations%x, error)
               call self%drop_attempts()
               return
            end if
            call shorten_step(self%parameters, of_attempt%outcome, report%displacement, self%dt, report%cuts)
         end select
      end do
      report%rounds = of_attempt%rounds
      report%shortened = abs(self%dt - self%control%dt) > 0 .and. report%attempts == 1
      call self%times%lap(phase%other)
   end subroutine find_motion

   !> Forget the attempts at a step: the same step can be repeated with the same bits.
   subroutine drop_attempts(self)
      class(trial_step_type), intent(inout) :: self
      self%equations%x = self%last_motion
      call self%solver%unpack(self%memory)
      if (allocated(self%acceleration)) deallocate (self%acceleration)
   end subroutine drop_attempts

   !> Loads, supports and dt that the present stage gives the step.
   subroutine begin_step(self)
      class(trial_step_type), intent(inout) :: self
      integer :: p
      self%asleep = self%state%asleep
      self%calm = self%state%calm
      self%released = self%control%released
      do p = 1, self%blocks%fixed%n
         if (.not. self%state%active(self%blocks%fixed%block(p))) self%released(p) = .true.
      end do
      self%gravity = self%control%gravity(self%parameters)
      self%motion_start = self%control%motion_start
      self%water = self%control%water(self%parameters)
      self%solver%enough = self%control%residual_enough(self%parameters, self%blocks%n_blocks)
      self%dt = self%control%step_size(self%parameters, self%state%time)
   end subroutine begin_step

   !> Find the contacts of the step from the state at its start, and set up the links of all interactions.
   subroutine find_contacts(self, reach)
      class(trial_step_type), intent(inout) :: self
      real(wp), intent(in) :: reach   !! [length]
      integer :: pattern_id
      call self%times%lap(phase%other)
      call self%finder%find(self%step_context_type, self%contacts, reach, self%families%contacts%table)
      if (allocated(self%resting)) deallocate (self%resting)
      if (allocated(self%finder%search%pairs%resting)) self%resting = self%finder%search%pairs%resting
      self%times%searches = self%times%searches + 1
      if (self%finder%search%pairs%was_kept) self%times%reused = self%times%reused + 1
      call self%times%lap(phase%search)
      call self%families%prepare(self%step_context_type, self%equations)
      call self%equations%set_rows(self%asleep)
      if (allocated(self%equations%block_of)) then
         self%solver%centroid = self%state%centroid(:, self%equations%block_of)
      else
         self%solver%centroid = self%state%centroid
      end if
      call self%times%lap(phase%links)
      pattern_id = self%equations%matrix%pattern_id
      call self%equations%set_graph()
      if (self%equations%matrix%pattern_id /= pattern_id) self%times%patterns = self%times%patterns + 1
      call self%times%lap(phase%graph)
   end subroutine find_contacts

   !> One attempt with a fixed dt: find the equilibrium, and check that its motion can be accepted.
   subroutine try_step(self, reach, is_first, at_floor, report, displacement, error)
      class(trial_step_type), intent(inout) :: self
      real(wp), intent(in) :: reach     !! of the search that found the contacts [length]
      logical, intent(in) :: is_first   !! nothing has been solved in this step: x is the motion of the last one
      logical, intent(in) :: at_floor   !! there is no smaller step to fall back to
      type(newton_report_type), intent(out) :: report
      real(wp), intent(out) :: displacement      !! largest of any vertex [length]
      type(error_type), allocatable, intent(out) :: error
      type(conditions_type) :: conditions
      displacement = 0
      self%times%attempts = self%times%attempts + 1
      call self%times%lap(phase%other)
      self%scheme = self%control%scheme(self%parameters)
      self%scheme%carried = self%control%carry(self%parameters, self%dt)
      if (self%scheme%second_order .and. .not. self%knows_acceleration()) then
         call self%find_acceleration(report, error)
         if (allocated(error) .or. report%outcome /= attempt%converged) return
      end if
      if (self%scheme%second_order) call self%turn_forces()
      conditions%method = self%control%method
      conditions%slack = self%control%force_slack(self%parameters)
      conditions%may_predict = is_first .and. abs(self%dt - self%control%last_dt) <= 0 .and. &
                               self%control%is_dynamic(self%parameters)
      conditions%is_like_last = is_first .and. self%control%is_like_last(self%parameters, self%dt)
      conditions%at_floor = at_floor
      call self%expect_motion(is_first, conditions%may_predict)
      call self%families%begin(self%step_context_type)
      call self%families%place(self%step_context_type, self%equations)
      call self%times%lap(phase%block_terms)
      call self%newton%find_smooth_motion(.not. self%control%is_static(self%parameters), conditions, &
                                          self%step_context_type, self%families, self%equations, self%solver, &
                                          self%times, report, error)
      if (allocated(error)) return
      ! only a motion that would be accepted is measured: in earlier rounds blocks may be loose
      if (report%outcome /= attempt%converged) return
      call judge_motion(self%step_context_type, self%equations%x, reach, at_floor, displacement, report%outcome)

   end subroutine try_step

   !> Set the motion expected of each block in the step; its rotation turns the arms of forces. It is 2 v dt - d (d:
   !> motion of the last step) where the rounds may begin there, v dt where velocities are carried on, and d in statics.
   subroutine expect_motion(self, is_first, may_predict)
      class(trial_step_type), intent(inout) :: self
      logical, intent(in) :: is_first      !! x is the motion of the last step
      logical, intent(in) :: may_predict   !! the rounds may begin with a predicted motion
      call self%renew_all()
      if (may_predict) then
         call self%expect(self%state%velocity, 2*self%dt, less=self%equations%x)
      else if (.not. self%control%is_static(self%parameters)) then
         call self%expect(self%state%velocity, self%dt)
      else if (is_first .and. abs(self%dt - self%control%last_dt) <= 0) then
         call self%expect(self%equations%x)
      else
         call self%expect()
      end if
   end subroutine expect_motion

   !> Accelerations at the start of the step, by the loads and the springs of that time: (M + dt**2 K/8) a = F. Springs
   !> that are far too stiff for the step do not throw blocks by it; for others it is M a = F to second order.
   subroutine find_acceleration(self, report, error)
      class(trial_step_type), intent(inout) :: self
      type(newton_report_type), intent(out) :: report
      type(error_type), allocatable, intent(out) :: error
      type(time_scheme_type) :: scheme
      real(wp), allocatable :: last(:, :), force(:, :)
      real(wp) :: dt
      scheme = self%scheme
      dt = self%dt
      allocate (last, source=self%equations%x)
      self%dt = 0.5_wp*dt
      call self%renew_all()
      call self%expect()
      call assemble_start(self, scheme_of_start(purpose%acceleration, 0.0_wp))
      allocate (force, source=self%equations%f)
      if (self%parameters%mass_damping > 0) call add_damping(force)
      call assemble_start(self, scheme_of_start(purpose%acceleration, 1.0_wp))
      self%equations%x = 0
      call self%newton%solve_once(self%equations, force, self%solver, report, error)
      if (report%outcome == attempt%converged .and. .not. allocated(error)) &
         self%acceleration = (2/self%dt**2)*self%equations%x
      self%equations%x = last
      self%scheme = scheme
      self%dt = dt

   contains

      !> Mass-proportional damping of the velocities at the start.
      subroutine add_damping(force)
         real(wp), intent(inout) :: force(:, :)   !! (6, nb)
         integer :: i
         do i = 1, self%blocks%n_blocks
            if (self%is_left_out(i)) cycle
            force(:, i) = force(:, i) - self%parameters%mass_damping*self%momentum(i, self%state%velocity(:, i))
         end do
      end subroutine add_damping

   end subroutine find_acceleration

   !> Find the loads that turn forces from mid-step to where they act. They are those by which forces at the start of
   !> the step, on vectors and arms of that level, exceed those on the vectors and arms of mid-step, which the equations
   !> take; with them the scheme is of second order in blocks that turn. A step of 2 level dt has its middle where
   !> forces act in one of dt. Dashpots act with the mean velocity of the step, at its middle.
   subroutine turn_forces(self)
      class(trial_step_type), intent(inout) :: self
      type(time_scheme_type) :: scheme
      call self%renew_all()
      if (.not. allocated(self%jump)) allocate (self%jump(6, self%blocks%n_blocks), &
                                                self%turning(6, self%blocks%n_blocks), source=0.0_wp)
      self%turning = 0
      scheme = self%scheme
      if (.not. abs(2*scheme%level - 1) > 0) return   ! forces act at mid-step
      if (.not. maxval(abs(self%state%velocity(3, :)))*self%dt > least_turn) return
      call self%expect(self%state%velocity, self%dt)
      call assemble_start(self, scheme_of_start(purpose%turning, 0.0_wp))
      self%turning = -self%equations%f
      call self%expect(self%state%velocity, 2*scheme%level*self%dt)
      call assemble_start(self, scheme_of_start(purpose%turning, 0.0_wp))
      self%turning = self%turning + self%equations%f
      self%scheme = scheme
   end subroutine turn_forces

   !> Assemble the equations of a motion from rest in the states of the start, with the arms of the expected motion.
   subroutine assemble_start(self, scheme)
      class(trial_step_type), intent(inout) :: self
      type(time_scheme_type), intent(in) :: scheme   !! of the start
      self%scheme = scheme
      call self%families%begin(self%step_context_type)
      call self%families%place(self%step_context_type, self%equations)
      call self%families%add_to_links(self%equations)
      call self%equations%assemble()
   end subroutine assemble_start

   !> A shorter step after a failed attempt; count why.
   pure subroutine shorten_step(parameters, outcome, displacement, dt, cuts)
      type(parameters_type), intent(in) :: parameters
      integer, intent(in) :: outcome              !! one of attempt%...
      real(wp), intent(in) :: displacement        !! largest of any vertex [length]
      real(wp), intent(inout) :: dt               !! step [time]
      integer, intent(inout) :: cuts(:)           !! (n_cut_reasons)
      integer :: reason
      select case (outcome)
      case (attempt%too_far)
         reason = cut_reason%displacement
      case (attempt%ruined)
         reason = cut_reason%ruined_block
      case (attempt%no_solution)
         reason = cut_reason%solver
      case default
         reason = cut_reason%contacts
      end select
      cuts(reason) = cuts(reason) + 1
      if (outcome == attempt%too_far) then
         dt = cut_for_displacement(parameters, dt, displacement)
      else
         dt = max(parameters%dt_min, parameters%cut_factor*dt)
      end if
   end subroutine shorten_step

end module rockdda_stepping_trial_step
