! SPDX-License-Identifier: MIT
!> The step at hand: attempts to solve it, each with a shorter dt than the last, until the motion can be accepted.
!>
!> Every attempt starts from the model, the state of its blocks, the contacts and the step control of the last accepted
!> step, and only reads them: what it finds of the start of the step, and of blocks asleep, is in the attempt. The
!> accepted motion is applied in rockdda_stepping_acceptance. A step that fails or is interrupted gives back the last
!> motion and the memory of the solver.
!>
!> Contacts that meet by the law of impact stay open: the equilibrium (rockdda_stepping_newton) is found anew until it
!> shows no more such contacts.
module rockdda_stepping_trial_step
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type, add_context
   use rockdda_base_phase_times, only : phase_times_type, phase
   use rockdda_base_strings, only : to_string
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_blocks, only : block_system_type
   use rockdda_contact_table, only : contact_table_type
   use rockdda_contact_search, only : contact_search_type
   use rockdda_contact_search_limits, only : search_limits_type, placing_share
   use rockdda_contact_topology, only : contact_topology_type, new_contact_topology
   use rockdda_interaction_attempt, only : attempt_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_equations, only : equations_type
   use rockdda_interaction_families, only : families_type
   use rockdda_interaction_time_scheme, only : time_scheme_type, scheme_of_start, purpose
   use rockdda_linear_solver, only : linear_solver_type
   use rockdda_stepping_control, only : step_control_type, cut_for_displacement, cut_reason, n_cut_reasons
   use rockdda_stepping_failure, only : most_listed, attempt_end, judge_motion, report_failure
   use rockdda_stepping_sleep, only : wake_disturbed
   use rockdda_stepping_impact, only : impact_type
   use rockdda_stepping_newton, only : newton_type, newton_report_type, conditions_type
   use rockdda_stepping_reach, only : predicted_reach, set_search_limits, quantised
   implicit none
   private
   public :: trial_step_type, trial_report_type

   !> Gaps up to this share of w0 count as touching at the start of a run.
   real(wp), parameter :: touching = 1.0e-6_wp

   !> Scratch; nothing in it is part of the state.
   type :: contact_finder_type
      type(contact_search_type) :: search       !! search%pairs%keep = .false.: never with pairs of an earlier step
      type(contact_topology_type), private :: topology
      type(search_limits_type), private :: limits
      logical, private :: places = .false.      !! some stage places blocks
      logical :: needs_forces = .false.               !! shear forces are read before the end of the step
   contains
      procedure :: init
      procedure :: show_blocks
      procedure :: first_reach
      procedure, nopass :: longer_reach
      procedure :: find
   end type contact_finder_type

   !> In steps in which no block turns by more [rad] forces need not be turned from mid-step to where they act: a
   !> pendulum gains less than 1e-5 of its energy in a second.
   real(wp), parameter :: least_turn = 1.0e-5_wp

   !> The attempt at hand, and what finds its motion. Nothing in it is a part of the state.
   type, extends(attempt_type) :: trial_step_type
      type(contact_finder_type) :: finder
      type(newton_type) :: newton
      type(impact_type) :: impact                      !! of the attempt
      real(wp), allocatable :: last_motion(:, :)       !! (6, nb) x at the start of the step
      real(wp), allocatable, private :: memory(:)      !! of the solver, there
   contains
      procedure :: find_motion
      procedure :: find_contacts
      procedure, private :: begin_step
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
   subroutine find_motion(self, context, contacts, control, families, equations, solver, times, report, error)
      class(trial_step_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(contact_table_type), intent(in) :: contacts       !! of the last accepted step
      type(step_control_type), intent(in) :: control
      type(families_type), intent(inout) :: families
      type(equations_type), intent(inout) :: equations       !! x: the motion of the last step
      class(linear_solver_type), intent(inout) :: solver
      type(phase_times_type), intent(inout) :: times
      type(trial_report_type), intent(out) :: report
      type(error_type), allocatable, intent(out) :: error
      type(newton_report_type) :: of_attempt
      real(wp) :: reach
      logical :: at_floor    !! there is no smaller step to fall back to
      logical :: is_first    !! nothing has been solved in this step: x is the motion of the last one
      integer :: n_woken, n_solved
      if (.not. allocated(self%last_motion)) allocate (self%last_motion, mold=equations%x)
      self%last_motion(:, :) = equations%x
      call solver%pack(self%memory)
      call self%begin_step(context, control)
      solver%enough = control%residual_enough(context%parameters, context%blocks%n_blocks)
      if (abs(self%dt - control%last_dt) <= 0 .and. control%is_static(context%parameters)) &
         call control%trend%expect(self%dt, context%state%acceleration, equations%x)
      reach = self%finder%first_reach(context, control, self%dt)
      call self%find_contacts(context, contacts, reach, families, equations, solver, times)
      n_solved = 0
      is_first = .true.
      do
         report%attempts = report%attempts + 1
         ! the negation: a step that is no number has no smaller one
         at_floor = .not. self%dt > context%parameters%dt_min*(1 + 1.0e-12_wp)
         call try_step()
         is_first = .false.
         report%iterations = report%iterations + of_attempt%iterations
         if (allocated(error)) then
            call add_context(error, 'step '//to_string(context%state%step + 1))
            call drop()
            return
         end if
         select case (of_attempt%outcome)
         case (attempt_end%converged)
            ! a motion that disturbs blocks asleep is no attempt that failed: wake them, and begin again
            n_solved = n_solved + 1
            call wake_disturbed(context, equations, contacts, n_solved, self%attempt_type, n_woken)
            if (n_woken == 0) exit
            call self%find_contacts(context, contacts, reach, families, equations, solver, times)
            report%attempts = report%attempts - 1
         case (attempt_end%interrupted)
            report%interrupted = .true.
            call drop()
            return
         case (attempt_end%search_again)
            ! the motion could be accepted, but goes beyond the search: search further, and begin again
            reach = self%finder%longer_reach(reach, report%displacement, context%parameters%w0)
            call self%find_contacts(context, contacts, reach, families, equations, solver, times)
            report%attempts = report%attempts - 1
         case default
            if (at_floor) then
               call report_failure(of_attempt%outcome, self%dt, of_attempt%detail, context%blocks, context%parameters, &
                                   context%state, families%contacts%table, families%contacts%trial, &
                                   families%liners%tell_changes(context, most_listed), &
                                   equations%x, error)
               call drop()
               return
            end if
            call shorten_step(context%parameters, of_attempt%outcome, report%displacement, self%dt, report%cuts)
         end select
      end do
      report%rounds = of_attempt%rounds
      report%shortened = abs(self%dt - control%dt) > 0 .and. report%attempts == 1
      call times%lap(phase%other)

   contains

      !> One attempt with a fixed dt: find the equilibrium, and check that its motion can be accepted.
      subroutine try_step()
         type(conditions_type) :: conditions
         of_attempt = newton_report_type()
         report%displacement = 0
         times%attempts = times%attempts + 1
         call times%lap(phase%other)
         self%scheme = control%scheme(context%parameters)
         self%scheme%carried = control%carry(context%parameters, self%dt)
         if (self%scheme%second_order .and. .not. self%knows_acceleration(context)) then
            call find_acceleration()
            if (allocated(error) .or. of_attempt%outcome /= attempt_end%converged) return
         end if
         if (self%scheme%second_order) call turn_forces()
         conditions%method = control%method
         conditions%slack = control%force_slack(context%parameters)
         conditions%may_predict = is_first .and. abs(self%dt - control%last_dt) <= 0 .and. &
                                  control%is_dynamic(context%parameters)
         conditions%is_like_last = is_first .and. control%is_like_last(context%parameters, self%dt)
         conditions%at_floor = at_floor
         conditions%is_trial = control%brisk%is_on
         call expect_motion(conditions%may_predict)
         call families%begin(context, self%attempt_type)
         call families%place(context, self%attempt_type, equations)
         call times%lap(phase%block_terms)
         call find_smooth_motion(conditions)
         if (allocated(error)) return
         ! only a motion that would be accepted is measured: in earlier rounds blocks may be loose
         if (of_attempt%outcome /= attempt_end%converged) return
         call judge_motion(context, equations%x, reach, at_floor, report%displacement, of_attempt%outcome)
      end subroutine try_step

      !> Find the motion x and the states of all links at the end of a step, `find_equilibrium`; in dynamic steps again
      !> and again until it is settled which contacts meet by the law of impact. Rounds and iterations are those of all.
      subroutine find_smooth_motion(conditions)
         type(conditions_type), intent(inout) :: conditions
         integer :: iterations, rounds
         logical :: is_settled
         iterations = 0
         rounds = 0
         associate (contacts => families%contacts)
            call self%impact%begin(contacts%table%n)
            do
               call self%newton%find_equilibrium(conditions, context, self%attempt_type, families, equations, &
                                                 solver, times, of_attempt, error)
               iterations = iterations + of_attempt%iterations
               rounds = rounds + of_attempt%rounds
               of_attempt%iterations = iterations
               of_attempt%rounds = rounds
               if (allocated(error) .or. of_attempt%outcome /= attempt_end%converged .or. &
                   control%is_static(context%parameters)) return
               call self%impact%mark(context, self%attempt_type, contacts%table, contacts%trial, contacts%laws, &
                                     equations%x, is_settled)
               if (is_settled) return
               conditions%may_predict = .false.
               conditions%is_like_last = .false.
            end do
         end associate
      end subroutine find_smooth_motion

      !> Set the motion expected of each block in the step; its rotation turns the arms of forces. It is 2 v dt - d (d:
      !> motion of the last step) where the rounds may begin there, v dt where velocities are carried on, and d in
      !> statics.
      subroutine expect_motion(may_predict)
         logical, intent(in) :: may_predict   !! the rounds may begin with a predicted motion
         call self%renew_all(context)
         if (may_predict) then
            call self%expect(context, context%state%velocity, 2*self%dt, less=equations%x)
         else if (.not. control%is_static(context%parameters)) then
            call self%expect(context, context%state%velocity, self%dt)
         else if (is_first .and. abs(self%dt - control%last_dt) <= 0) then
            call self%expect(context, equations%x)
         else
            call self%expect(context)
         end if
      end subroutine expect_motion

      !> Accelerations at the start of the step, by the loads and the springs of that time: (M + dt**2 K/8) a = F.
      !> Springs that are far too stiff for the step do not throw blocks by it; for others it is M a = F to second
      !> order.
      subroutine find_acceleration()
         type(time_scheme_type) :: scheme
         real(wp), allocatable :: last(:, :), force(:, :)
         real(wp) :: dt
         scheme = self%scheme
         dt = self%dt
         allocate (last, source=equations%x)
         self%dt = 0.5_wp*dt
         call self%renew_all(context)
         call self%expect(context)
         call assemble_start(scheme_of_start(purpose%acceleration, 0.0_wp))
         allocate (force, source=equations%f)
         if (context%parameters%mass_damping > 0) call add_damping(force)
         call assemble_start(scheme_of_start(purpose%acceleration, 1.0_wp))
         equations%x = 0
         call self%newton%solve_once(equations, force, solver, of_attempt, error)
         if (of_attempt%outcome == attempt_end%converged .and. .not. allocated(error)) &
            self%acceleration = (2/self%dt**2)*equations%x
         equations%x = last
         self%scheme = scheme
         self%dt = dt
      end subroutine find_acceleration

      !> Mass-proportional damping of the velocities at the start.
      subroutine add_damping(force)
         real(wp), intent(inout) :: force(:, :)   !! (6, nb)
         integer :: i
         do i = 1, context%blocks%n_blocks
            if (self%is_left_out(i)) cycle
            force(:, i) = force(:, i) - context%parameters%mass_damping* &
                          context%momentum(i, context%state%velocity(:, i))
         end do
      end subroutine add_damping

      !> Find the loads that turn forces from mid-step to where they act. They are those by which forces at the start of
      !> the step, on vectors and arms of that level, exceed those on the vectors and arms of mid-step, which the
      !> equations take; with them the scheme is of second order in blocks that turn. A step of 2 level dt has its
      !> middle where forces act in one of dt. Dashpots act with the mean velocity of the step, at its middle.
      subroutine turn_forces()
         type(time_scheme_type) :: scheme
         call self%renew_all(context)
         if (.not. allocated(self%jump)) allocate (self%jump(6, context%blocks%n_blocks), &
                                                   self%turning(6, context%blocks%n_blocks), source=0.0_wp)
         self%turning = 0
         scheme = self%scheme
         if (.not. abs(2*scheme%level - 1) > 0) return   ! forces act at mid-step
         if (.not. maxval(abs(context%state%velocity(3, :)))*self%dt > least_turn) return
         call self%expect(context, context%state%velocity, self%dt)
         call assemble_start(scheme_of_start(purpose%turning, 0.0_wp))
         self%turning = -equations%f
         call self%expect(context, context%state%velocity, 2*scheme%level*self%dt)
         call assemble_start(scheme_of_start(purpose%turning, 0.0_wp))
         self%turning = self%turning + equations%f
         self%scheme = scheme
      end subroutine turn_forces

      !> Assemble the equations of a motion from rest in the states of the start, with the arms of the expected motion.
      subroutine assemble_start(scheme)
         type(time_scheme_type), intent(in) :: scheme   !! of the start
         self%scheme = scheme
         call families%begin(context, self%attempt_type)
         call families%place(context, self%attempt_type, equations)
         call families%add_to_links(equations)
         call equations%assemble()
      end subroutine assemble_start

      !> Forget the attempts at the step: the same step can be repeated with the same bits.
      subroutine drop()
         equations%x = self%last_motion
         call solver%unpack(self%memory)
         if (allocated(self%acceleration)) deallocate (self%acceleration)
      end subroutine drop

   end subroutine find_motion

   !> Loads, supports and dt that the present stage gives the step.
   pure subroutine begin_step(self, context, control)
      class(trial_step_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(step_control_type), intent(in) :: control
      integer :: p
      self%asleep = context%state%asleep
      self%calm = context%state%calm
      self%released = control%released
      do p = 1, context%blocks%fixed%n
         if (.not. context%state%active(context%blocks%fixed%block(p))) self%released(p) = .true.
      end do
      self%gravity = control%gravity(context%parameters)
      self%motion_start = control%motion_start
      self%water = control%water(context%parameters)
      self%dt = control%step_size(context%parameters, context%state%time)
   end subroutine begin_step

   !> Find the contacts of the step from the state at its start, and set up the links of all interactions.
   subroutine find_contacts(self, context, contacts, reach, families, equations, solver, times)
      class(trial_step_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(contact_table_type), intent(in) :: contacts   !! of the last accepted step
      real(wp), intent(in) :: reach                      !! [length]
      type(families_type), intent(inout) :: families
      type(equations_type), intent(inout) :: equations
      class(linear_solver_type), intent(inout) :: solver
      type(phase_times_type), intent(inout) :: times
      integer :: pattern_id
      call times%lap(phase%other)
      call self%finder%find(context, self%attempt_type, contacts, reach, families%contacts%table)
      if (allocated(self%resting)) deallocate (self%resting)
      if (allocated(self%finder%search%pairs%resting)) self%resting = self%finder%search%pairs%resting
      times%searches = times%searches + 1
      if (self%finder%search%pairs%was_kept) times%reused = times%reused + 1
      call times%lap(phase%search)
      call families%prepare(context, self%attempt_type, equations)
      call equations%set_rows(self%asleep)
      if (allocated(equations%block_of)) then
         solver%centroid = context%state%centroid(:, equations%block_of)
      else
         solver%centroid = context%state%centroid
      end if
      call times%lap(phase%links)
      pattern_id = equations%matrix%pattern_id
      call equations%set_graph()
      if (equations%matrix%pattern_id /= pattern_id) times%patterns = times%patterns + 1
      call times%lap(phase%graph)
   end subroutine find_contacts

   !> A shorter step after a failed attempt; count why.
   pure subroutine shorten_step(parameters, outcome, displacement, dt, cuts)
      type(parameters_type), intent(in) :: parameters
      integer, intent(in) :: outcome              !! one of attempt%...
      real(wp), intent(in) :: displacement        !! largest of any vertex [length]
      real(wp), intent(inout) :: dt               !! step [time]
      integer, intent(inout) :: cuts(:)           !! (n_cut_reasons)
      integer :: reason
      select case (outcome)
      case (attempt_end%too_far)
         reason = cut_reason%displacement
      case (attempt_end%ruined)
         reason = cut_reason%ruined_block
      case (attempt_end%no_solution)
         reason = cut_reason%solver
      case default
         reason = cut_reason%contacts
      end select
      cuts(reason) = cuts(reason) + 1
      if (outcome == attempt_end%too_far) then
         dt = cut_for_displacement(parameters, dt, displacement)
      else
         dt = max(parameters%dt_min, parameters%cut_factor*dt)
      end if
   end subroutine shorten_step

   !> Who is whose neighbour on the outlines of the blocks.
   subroutine init(self, blocks)
      class(contact_finder_type), intent(inout) :: self
      type(block_system_type), intent(in) :: blocks
      call new_contact_topology(blocks, self%topology)
   end subroutine init

   !> Let the search find no contacts of blocks that are not there, and make those of new ones free of stress.
   pure subroutine show_blocks(self, active, newborn, places)
      class(contact_finder_type), intent(inout) :: self
      logical, intent(in) :: active(:), newborn(:)   !! (nb)
      logical, intent(in) :: places                  !! some stage of the run places blocks
      if (allocated(self%search%pairs%active)) deallocate (self%search%pairs%active)
      if (.not. all(active)) self%search%pairs%active = active
      if (allocated(self%search%newborn)) deallocate (self%search%newborn)
      if (any(newborn)) self%search%newborn = newborn
      self%places = places
   end subroutine show_blocks

   !> The distance of the first search of a step [length].
   real(wp) function first_reach(self, context, control, dt) result(reach)
      class(contact_finder_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(step_control_type), intent(in) :: control
      real(wp), intent(in) :: dt                         !! step [time]
      reach = predicted_reach(context%blocks, context%parameters, context%state, control, dt)
      if (allocated(self%search%newborn)) reach = max(reach, quantised(2*placing_share*longest_edge( &
         context%blocks, self%search%newborn), context%parameters%w0))
   end function first_reach

   !> The distance to search when the motion found is too large for the contacts that were found [length].
   pure real(wp) function longer_reach(reach, displacement, w0)
      real(wp), intent(in) :: reach          !! of the search before [length]
      real(wp), intent(in) :: displacement   !! largest of any vertex [length]
      real(wp), intent(in) :: w0             !! [length]
      longer_reach = max(2*reach, quantised(2.5_wp*displacement, w0))
   end function longer_reach

   !> Find the contacts of a step from the state at its start, with the history of those of the last one.
   subroutine find(self, context, attempt, last, reach, table)
      class(contact_finder_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(contact_table_type), intent(in) :: last       !! of the last accepted step
      real(wp), intent(in) :: reach                      !! [length]
      type(contact_table_type), intent(inout) :: table
      ! pairs of blocks asleep, among others that are, are left out
      if (allocated(self%search%pairs%asleep)) deallocate (self%search%pairs%asleep)
      if (any(attempt%asleep)) self%search%pairs%asleep = attempt%asleep
      associate (parameters => context%parameters)
         call set_search_limits(last, parameters, context%blocks%n_blocks, reach, self%limits, self%places)
         if (parameters%by_length .and. any(self%limits%bears_tension) .and. .not. allocated(self%limits%edge_joint)) &
            self%limits%edge_joint = context%blocks%edge_joint
         table%waits_for_forces = .not. (parameters%sleeps .or. self%needs_forces)
         call self%search%run(context%blocks, self%topology, context%state%vertices, self%limits, last, &
                              context%state%step == 0, touching*parameters%w0, table)
      end associate
   end subroutine find

   !> Length of the longest edge of some blocks.
   pure real(wp) function longest_edge(blocks, chosen) result(longest)
      type(block_system_type), intent(in) :: blocks
      logical, intent(in) :: chosen(:)               !! (nb)
      integer :: i, v, next
      longest = 0
      do i = 1, blocks%n_blocks
         if (.not. chosen(i)) cycle
         do v = blocks%vertex_offset(i) + 1, blocks%vertex_offset(i + 1)
            next = merge(blocks%vertex_offset(i) + 1, v + 1, v == blocks%vertex_offset(i + 1))
            longest = max(longest, norm2(blocks%vertices(:, next) - blocks%vertices(:, v)))
         end do
      end do
   end function longest_edge

end module rockdda_stepping_trial_step
