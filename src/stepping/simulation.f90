! SPDX-License-Identifier: MIT
!> A run: the model, its state, and one accepted step at a time.
!>
!> `advance` is the whole of DDA's forward analysis: search the contacts, put the equations together, solve, judge
!> every contact, repeat until nothing changes (open-close), cut the step when that fails, move the blocks, keep the
!> energy ledger. Each attempt starts from the same saved state: only an accepted step changes it.
module rockdda_stepping_simulation
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type, error_code, make_error, add_context
   use rockdda_base_diagnostics, only : diagnostics_type
   use rockdda_base_interruption, only : interruption_type
   use rockdda_base_strings, only : to_string
   use rockdda_base_parallel, only : parallel_contacts
   use rockdda_base_phase_times, only : phase_times_type, phase
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_state, only : block_state_type, step_record_type, energy
   use rockdda_contact_table, only : contact_table_type, contact_state
   use rockdda_contact_topology, only : contact_topology_type, new_contact_topology
   use rockdda_contact_search, only : contact_search_type, search_limits_type
   use rockdda_interaction_friction_search, only : friction_search_type
   use rockdda_interaction_contact_law, only : contact_law_type, new_contact_laws
   use rockdda_interaction_open_close, only : open_close_type
   use rockdda_interaction_joint_law, only : joint_settings_type
   use rockdda_interaction_bolts, only : bolt_force
   use rockdda_interaction_kinematics, only : move_point
   use rockdda_interaction_equations, only : equations_type
   use rockdda_linear_solver, only : linear_solver_type, solve_report_type
   use rockdda_linear_factory, only : new_solver, default_solver
   use rockdda_stepping_control, only : step_control_type, new_step_control, check_stages, cut_for_displacement, &
      cut_reason, n_cut_reasons
   use rockdda_stepping_failure, only : attempt, find_ruined_block, report_failure
   use rockdda_stepping_ledger, only : ledger_type
   use rockdda_stepping_links, only : bolt_round_type, set_drag, set_link_vectors, set_link_forces, &
      set_friction_forces, predict_contacts, predict_sliding, judge_bolts, commit_bolts
   use rockdda_stepping_line_search, only : line_search_type
   use rockdda_stepping_loads, only : material_matrices_type, step_loads_type, new_material_matrices, set_block_terms, &
      attach_line_loads, support_forces
   use rockdda_stepping_parameter_check, only : check_parameters
   use rockdda_stepping_reach, only : predicted_reach, search_limits, quantised
   use rockdda_stepping_motion, only : start_state, move_blocks, measure_points, largest_displacement, is_finite_motion
   implicit none
   private
   public :: simulation_type

   !> Friction forces must agree with the normal forces they come from to this share of the largest normal force.
   real(wp), parameter :: friction_tolerance = 1.0e-5_wp
   !> Contact forces may miss their laws by this share of the largest normal force on the less loaded of the two blocks;
   !> by the second one when the rounds given have not done better.
   real(wp), parameter :: force_tolerance = 1.0e-5_wp, coarse_tolerance = 1.0e-3_wp
   integer, parameter :: fine_rounds = 10
   !> The misfit of friction and normal forces is brought down in at most so many solves a round.
   integer, parameter :: friction_solves = 12
   !> Models of so few blocks, for which a solve costs nothing, leave no correction of friction to the next round.
   integer, parameter :: few_blocks = 30
   !> A predicted motion is taken when its residual is below this share of that of the last motion.
   real(wp), parameter :: good_prediction = 0.1_wp
   !> An attempt is given up when so large a share of the rounds allowed, and so many, were shortened in a row.
   real(wp), parameter :: patience = 0.4_wp
   integer, parameter :: least_patience = 6

   !> Lengths below this share of w0 are round-off.
   real(wp), parameter :: round_off = 1.0e-12_wp

   type :: simulation_type
      ! the model
      type(block_system_type) :: blocks
      type(parameters_type) :: parameters
      ! the state: what a checkpoint has to hold
      type(block_state_type) :: state
      type(contact_table_type) :: contacts      !! of the last accepted step
      type(step_control_type) :: control
      type(ledger_type) :: ledger
      type(step_record_type) :: record          !! of the last accepted step
      real(wp), allocatable :: line_ends(:, :)  !! (4, line loads) where they are now
      type(equations_type) :: equations         !! x: last solution, the start of the next iterative solve
      type(phase_times_type) :: times           !! where the time went; nothing depends on it
      logical :: interrupted = .false.          !! the last `advance` stopped before its step was complete
      ! derived from the model
      type(contact_topology_type), private :: topology
      type(contact_law_type), allocatable, private :: laws(:)
      type(material_matrices_type), private :: matrices
      integer, allocatable, private :: line_blocks(:)
      ! tools and scratch
      class(linear_solver_type), allocatable :: solver
      type(contact_search_type) :: search       !! search%pairs%keep = .false.: never with pairs of an earlier step
      type(contact_table_type), private :: table
      type(open_close_type), private :: trial
      type(joint_settings_type), private :: settings   !! of the attempt at hand
      type(friction_search_type), private :: friction
      type(bolt_round_type), private :: bolts
      type(step_loads_type), private :: loads
      type(line_search_type), private :: line
      real(wp), allocatable, private :: largest(:)   !! (nb)
      real(wp), allocatable, private :: last_motion(:, :)   !! (6, nb) to go back to when the step is interrupted
      integer, private :: step_cuts(n_cut_reasons) = 0   !! of the step at hand
   contains
      procedure :: init
      procedure :: advance
      procedure :: is_finished
      procedure :: set_interruption
      procedure :: planned_time
      procedure :: contact_forces
      procedure :: bolt_forces
      procedure, private :: prepare_contacts
      procedure, private :: try_step
      procedure, private :: predict_motion
      procedure, private :: solve_round
      procedure, private :: settle_friction
      procedure, private :: accept
      procedure, private :: count_cut
   end type simulation_type

contains

   !> State at time 0. Errors: input that no run can start from.
   subroutine init(self, blocks, parameters, error)
      class(simulation_type), intent(inout) :: self
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(error_type), allocatable, intent(out) :: error
      type(diagnostics_type) :: problems
      self%blocks = blocks
      self%parameters = parameters
      if (blocks%n_blocks < 1) then
         call make_error(error, error_code%input, 'the model has no blocks')
         return
      end if
      call new_contact_laws(parameters%joint_materials, parameters%joint_laws, self%laws, problems)
      call check_parameters(parameters, problems)
      call check_stages(parameters, blocks%fixed%n, problems)
      call attach_line_loads(blocks, parameters, self%line_blocks, self%line_ends, problems)
      call problems%to_error(error)
      if (allocated(error)) return
      if (len_trim(parameters%solver_method) == 0) self%parameters%solver_method = default_solver()
      call new_solver(self%parameters%solver_method, parameters%solver_tolerance, parameters%sor_factor, &
                      parameters%preconditioner, self%solver, error)
      if (allocated(error)) return
      call start_state(blocks, parameters, self%state)
      call new_contact_topology(blocks, self%topology)
      call new_material_matrices(parameters, self%matrices)
      call new_step_control(parameters, blocks%fixed%n, self%control)
      call self%contacts%resize(0)
      if (allocated(self%largest)) deallocate (self%largest)
      allocate (self%largest(blocks%n_blocks))
      call self%equations%set_size(blocks%n_blocks, 0)
      self%equations%x = 0
      call self%ledger%start(blocks, self%matrices, self%state)
      self%record = step_record_type()
      self%record%energy = self%ledger%total
      allocate (self%record%measured_displacement(2, blocks%measured%n), &
                self%record%measured_stress(3, blocks%measured%n), &
                self%record%measured_rotation(blocks%measured%n), self%record%fixed_force(2, blocks%fixed%n))
      self%record%measured_displacement = 0
      self%record%measured_stress = 0
      self%record%measured_rotation = 0
      self%record%fixed_force = 0
   end subroutine init

   !> Has the run done all its steps or reached its end time?
   pure logical function is_finished(self)
      class(simulation_type), intent(in) :: self
      is_finished = self%state%step >= self%parameters%n_steps .or. &
                    .not. self%state%time < self%parameters%t_end*(1 - 1.0e-12_wp)
   end function is_finished

   !> Stop on request: within a step too, between solves and between iterations of the solver.
   subroutine set_interruption(self, interruption)
      class(simulation_type), intent(inout) :: self
      class(interruption_type), intent(in) :: interruption
      if (allocated(self%solver%interruption)) deallocate (self%solver%interruption)
      allocate (self%solver%interruption, source=interruption)
   end subroutine set_interruption

   !> Time at the end of the run when no step is cut.
   pure real(wp) function planned_time(self)
      class(simulation_type), intent(in) :: self
      planned_time = min(self%parameters%t_end, self%parameters%n_steps*self%parameters%dt_max)
   end function planned_time

   !> One accepted step, unless a stop is requested: `interrupted` is then true, and the state is that of the last
   !> accepted step, from which the same step can be repeated. On error (code 3) the state is that of the last accepted
   !> step too.
   subroutine advance(self, error)
      class(simulation_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: dt, wanted, reach, displacement, limit
      integer :: outcome, attempts, rounds, iterations
      logical :: at_floor, is_first
      character(len=:), allocatable :: detail
      real(wp), allocatable :: memory(:)

      self%interrupted = .false.
      if (allocated(self%solver%interruption)) self%last_motion = self%equations%x
      call self%solver%pack(memory)
      call self%times%start()
      call self%control%end_stages(self%parameters, self%state%step, self%state%time)
      wanted = self%control%dt
      dt = self%control%step_size(self%parameters, self%state%time)
      limit = self%parameters%displacement_ratio*self%parameters%w0
      reach = predicted_reach(self%blocks, self%parameters, self%state, self%control, dt)
      call self%prepare_contacts(reach)
      attempts = 0
      iterations = 0
      is_first = .true.
      self%step_cuts = 0
      do
         attempts = attempts + 1
         ! the negation: a step that is no number has no smaller one
         at_floor = .not. dt > self%parameters%dt_min*(1 + 1.0e-12_wp)
         call self%try_step(dt, reach, is_first, at_floor, outcome, rounds, iterations, displacement, detail, error)
         is_first = .false.
         if (allocated(error)) then
            call add_context(error, 'step '//to_string(self%state%step + 1))
            return
         end if
         if (outcome == attempt%interrupted) then
            self%interrupted = .true.
            self%equations%x = self%last_motion
            call self%solver%unpack(memory)
            return
         end if
         if (outcome == attempt%converged .or. outcome == attempt%search_again) then
            if (.not. displacement <= limit .and. .not. at_floor) then
               call self%count_cut(cut_reason%displacement)
               dt = cut_for_displacement(self%parameters, dt, displacement)
               cycle
            else if (.not. displacement <= max(limit, self%parameters%w0)) then
               outcome = attempt%thrown
            else if (outcome == attempt%converged) then
               exit
            else
               ! a step that may be: look further, and begin again
               reach = max(2*reach, quantised(2.5_wp*displacement, self%parameters%w0))
               call self%prepare_contacts(reach)
               attempts = attempts - 1
               cycle
            end if
         end if
         if (at_floor) then
            call report_failure(outcome, dt, detail, self%blocks, self%parameters, self%state, self%table, &
                                self%trial, self%equations%x, error)
            return
         end if
         if (outcome == attempt%ruined) then
            call self%count_cut(cut_reason%ruined_block)
         else if (outcome == attempt%no_solution) then
            call self%count_cut(cut_reason%solver)
         else
            call self%count_cut(cut_reason%contacts)
         end if
         dt = max(self%parameters%dt_min, self%parameters%cut_factor*dt)
      end do
      self%control%cuts = self%control%cuts + self%step_cuts
      call self%times%lap(phase%other)
      call self%accept(dt, abs(dt - wanted) > 0 .and. attempts == 1, displacement)
      self%record%open_close_iterations = rounds
      self%record%attempts = attempts
      self%record%solver_iterations = iterations
      self%times%steps = self%times%steps + 1
      self%times%solver_iterations = self%times%solver_iterations + iterations
      call self%times%lap(phase%update)
   end subroutine advance

   !> Count a cut of the step at hand.
   pure subroutine count_cut(self, reason)
      class(simulation_type), intent(inout) :: self
      integer, intent(in) :: reason   !! one of cut_reason%...
      self%step_cuts(reason) = self%step_cuts(reason) + 1
   end subroutine count_cut

   !> Search the contacts of the step from the state at its start, and set up their links.
   subroutine prepare_contacts(self, reach)
      class(simulation_type), intent(inout) :: self
      real(wp), intent(in) :: reach
      type(search_limits_type) :: limits
      integer :: pattern_id
      limits = search_limits(self%contacts, self%parameters, reach)
      call self%times%lap(phase%other)
      call self%search%run(self%blocks, self%topology, self%state%vertices, limits, self%contacts, &
                           self%state%step == 0, 1.0e-6_wp*self%parameters%w0, self%table)
      self%times%searches = self%times%searches + 1
      if (self%search%pairs%was_kept) self%times%reused = self%times%reused + 1
      call self%times%lap(phase%search)
      call set_link_vectors(self%blocks, self%state, self%table, self%bolts, self%equations)
      call self%times%lap(phase%links)
      pattern_id = self%equations%matrix%pattern_id
      call self%equations%set_graph()
      if (self%equations%matrix%pattern_id /= pattern_id) self%times%patterns = self%times%patterns + 1
      call self%times%lap(phase%graph)
   end subroutine prepare_contacts

   !> One attempt: open-close rounds with a fixed dt.
   subroutine try_step(self, dt, reach, is_first, at_floor, outcome, rounds, iterations, displacement, detail, error)
      class(simulation_type), intent(inout) :: self
      real(wp), intent(in) :: dt        !! step [time]
      real(wp), intent(in) :: reach     !! of the search that found the contacts [length]
      logical, intent(in) :: is_first   !! nothing has been solved in this step: x is the motion of the last one
      logical, intent(in) :: at_floor   !! there is no smaller step to fall back to
      integer, intent(out) :: outcome            !! one of attempt%...
      integer, intent(out) :: rounds             !! of the open-close loop
      integer, intent(inout) :: iterations       !! of the solver, in this step so far
      real(wp), intent(out) :: displacement      !! largest of any vertex [length]
      character(len=:), allocatable, intent(out) :: detail
      type(error_type), allocatable, intent(out) :: error
      integer :: n_changes, n_bolts, n_unsettled, n_shortened, ruined
      real(wp) :: worst_friction, fraction, factor
      logical :: solved

      self%settings%k_n = self%parameters%normal_stiffness
      self%settings%k_s = self%parameters%shear_stiffness
      self%settings%close_tolerance = self%parameters%close_tolerance
      self%settings%open_tolerance = self%parameters%open_tolerance
      self%settings%slip_tolerance = self%settings%k_s*round_off*self%parameters%w0
      self%settings%peer = self%parameters%peer_contacts
      self%settings%dt = dt
      displacement = 0
      detail = ''
      self%times%attempts = self%times%attempts + 1
      call self%times%lap(phase%other)
      call set_block_terms(self%blocks, self%parameters, self%matrices, self%state, self%control%released, &
                           self%line_blocks, self%line_ends, self%control%gravity(self%parameters), dt, self%loads, &
                           self%equations%block_matrix, self%equations%block_load, self%equations%block_magnitude)
      call self%equations%renew()
      call self%times%lap(phase%block_terms)
      call self%trial%begin(self%table, self%laws, self%settings)
      call set_drag(self%parameters, self%laws, self%state, self%table, dt, self%trial)
      self%bolts%yields = .false.
      self%bolts%stretch = 0
      if (is_first .and. .not. self%settings%peer .and. abs(dt - self%control%last_dt) <= 0 .and. &
          abs(self%control%k01(self%parameters) - 1) <= 0) call self%predict_motion(dt)
      call self%friction%forget()
      n_changes = 1
      n_bolts = 0
      n_shortened = 0
      do rounds = 1, self%parameters%max_open_close
         if (rounds > 1 .and. .not. self%settings%peer) &
            call self%line%keep(self%table, self%trial, self%bolts, self%equations)
         outcome = attempt%no_solution
         call self%solve_round(.false., n_changes + n_bolts > 0 .or. self%settings%peer, iterations, solved, detail, &
                               error)
         if (solved) call self%settle_friction(iterations, solved, detail, error)
         if (self%interrupted) outcome = attempt%interrupted
         if (.not. solved) return
         fraction = 1
         if (rounds > 1 .and. .not. self%settings%peer) call self%line%search(self%blocks, self%laws, self%settings, &
            self%table, friction_tolerance, self%trial, self%bolts, self%equations, fraction)
         call self%trial%judge(self%table, self%laws, self%settings, n_changes, worst_friction)
         call judge_bolts(self%blocks, self%bolts, n_bolts)
         call self%times%lap(phase%judge)
         outcome = attempt%not_converged
         n_shortened = merge(n_shortened + 1, 0, fraction < 1)
         if (n_shortened >= max(least_patience, nint(patience*self%parameters%max_open_close)) .and. .not. at_floor) &
            exit
         if (n_bolts > 0 .or. fraction < 1) cycle
         call self%trial%count_unsettled(self%table, merge(force_tolerance, coarse_tolerance, rounds <= fine_rounds), &
                                         friction_tolerance*largest_normal(self%trial, self%table%n), &
                                         self%largest, n_unsettled)
         if (n_unsettled > 0) cycle
         outcome = attempt%converged
         exit
      end do
      rounds = min(rounds, self%parameters%max_open_close)
      displacement = largest_displacement(self%blocks, self%state, self%equations%x)
      ! only a motion that would be accepted asks for a wider search: in earlier rounds blocks may be loose
      if (outcome /= attempt%converged) return
      call find_ruined_block(self%blocks, self%parameters, self%state, self%equations%x, ruined, factor)
      if (ruined > 0) then
         outcome = attempt%ruined
      else if (2*displacement > reach .and. displacement <= 1.0e3_wp*self%parameters%w0) then
         outcome = attempt%search_again
      end if
   end subroutine try_step

   !> In dynamics: the motion of the step if accelerations stayed what they were in the last one, d = v dt + a dt^2/2
   !> with a dt^2/2 = v dt - (last motion). If it comes much closer to equilibrium than the last motion, it
   !> is where the first solve starts, and the first states are judged by it. Where contacts vibrate from step to step
   !> (stiff springs, long steps) it does not.
   subroutine predict_motion(self, dt)
      class(simulation_type), intent(inout) :: self
      real(wp), intent(in) :: dt   !! step [time]
      real(wp) :: ratio
      call predict_contacts(self%table, self%equations, self%blocks%bolts%n, self%trial, self%bolts)
      call self%line%keep(self%table, self%trial, self%bolts, self%equations)
      self%equations%x = 2*dt*self%state%velocity - self%equations%x
      call predict_contacts(self%table, self%equations, self%blocks%bolts%n, self%trial, self%bolts)
      call self%line%compare(self%blocks, self%laws, self%settings, self%table, self%trial, self%bolts, self%equations, &
                             ratio)
      if (ratio < good_prediction) then
         call self%trial%foresee(self%table, self%laws, self%settings)
      else
         call self%line%go_back(self%equations)
      end if
      self%bolts%stretch = 0
      call self%times%lap(phase%judge)
   end subroutine predict_motion

   !> Solve the equations with the present states and friction forces, and predict the motion of all contacts, or, with
   !> the states of the last solve, of those that slide.
   subroutine solve_round(self, friction_only, new_states, iterations, solved, detail, error)
      class(simulation_type), intent(inout) :: self
      logical, intent(in) :: friction_only   !! only friction forces found within the round differ from the last solve
      logical, intent(in) :: new_states   !! else only friction forces differ from the last solve: K is the same
      integer, intent(inout) :: iterations
      logical, intent(out) :: solved      !! else `detail` or `error` says why
      character(len=:), allocatable, intent(inout) :: detail
      type(error_type), allocatable, intent(out) :: error
      type(solve_report_type) :: report
      integer :: n_assembled
      solved = .false.
      self%interrupted = self%solver%is_interrupted()
      if (self%interrupted) return
      if (friction_only) then
         call set_friction_forces(self%friction, self%trial, self%equations)
      else
         call set_link_forces(self%blocks, self%settings, self%table, self%trial, self%bolts, self%equations)
      end if
      call self%equations%assemble(n_assembled)
      if (new_states) self%solver%reference_load = self%equations%magnitude
      self%times%rounds = self%times%rounds + 1
      self%times%contacts = self%times%contacts + self%table%n
      self%times%assembled = self%times%assembled + n_assembled
      call self%times%lap(phase%assembly)
      call self%solver%solve(self%equations%matrix, self%equations%f, self%equations%x, report, error)
      call self%times%lap(phase%solve)
      if (allocated(error)) then
         if (error%code /= error_code%computation .or. error%is_fatal) return
         detail = error%message
         deallocate (error)
         return
      end if
      iterations = iterations + report%iterations
      self%interrupted = report%interrupted
      if (.not. report%converged) then
         if (allocated(report%detail)) detail = report%detail
         return
      end if
      if (.not. is_finite_motion(self%equations%x)) then
         detail = 'the solution is not finite'
         return
      end if
      if (friction_only) then
         call predict_sliding(self%table, self%equations, self%friction, self%trial)
      else
         call predict_contacts(self%table, self%equations, self%blocks%bolts%n, self%trial, self%bolts)
      end if
      solved = .true.
   end subroutine solve_round

   !> Find the friction forces that agree with the normal forces they cause, for the states as they are: with the
   !> last solve that makes a full step of Newton's method, without an unsymmetric matrix. Only loads change.
   subroutine settle_friction(self, iterations, solved, detail, error)
      class(simulation_type), intent(inout) :: self
      integer, intent(inout) :: iterations
      logical, intent(out) :: solved
      character(len=:), allocatable, intent(inout) :: detail
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: worst, small
      integer :: k
      logical :: is_enough
      solved = .true.
      call self%friction%begin(self%table, self%trial)
      do k = 1, friction_solves
         call self%friction%improve(self%table, self%laws, self%settings, self%trial, worst)
         if (k == 1) small = friction_tolerance*self%trial%deepest_force(self%table%n, self%settings)
         call self%friction%assess(worst, small, self%blocks%n_blocks > few_blocks, is_enough)
         if (is_enough) then
            call self%friction%take_used(self%trial)
            exit
         end if
         call self%solve_round(.true., .false., iterations, solved, detail, error)
         if (.not. solved) return
      end do
      if (k > 1) call predict_contacts(self%table, self%equations, self%blocks%bolts%n, self%trial, self%bolts)
   end subroutine settle_friction

   !> Largest normal force of a trial.
   real(wp) function largest_normal(trial, n) result(largest)
      type(open_close_type), intent(in) :: trial
      integer, intent(in) :: n
      integer :: c
      largest = 0
      !$omp parallel do default(none) shared(trial, n) private(c) reduction(max:largest) schedule(static) &
      !$omp if (n > parallel_contacts)
      do c = 1, n
         largest = max(largest, abs(trial%normal_force(c)))
      end do
      !$omp end parallel do
   end function largest_normal

   !> Book the energies, move the blocks, fill the record.
   subroutine accept(self, dt, shortened, displacement)
      class(simulation_type), intent(inout) :: self
      real(wp), intent(in) :: dt   !! step [time]
      logical, intent(in) :: shortened
      real(wp), intent(in) :: displacement
      real(wp) :: k01, kinetic_predicted, strain_predicted, kinetic_moved, strain_moved
      integer :: p, b, side

      k01 = self%control%k01(self%parameters)
      call self%ledger%add_contacts(self%settings, self%trial, self%state%step + 1, self%table)
      call self%ledger%add_blocks(self%blocks, self%parameters, self%matrices, self%state, self%loads, dt, &
                                  self%equations%x)
      call self%ledger%add_supports(self%blocks, self%parameters, self%state, self%loads, self%control%released, &
                                    self%bolts, self%equations%x)
      call self%trial%commit(self%settings, self%table)
      call commit_bolts(self%blocks, self%bolts, self%state%bolt_plastic)
      call support_forces(self%blocks, self%parameters%fixed_stiffness, self%state, self%loads, self%control%released, &
                          self%equations%x, self%record%fixed_force)
      do p = 1, size(self%line_blocks)
         b = self%line_blocks(p)
         do side = 1, 3, 2
            call move_point(self%equations%x(:, b), self%state%centroid(:, b), self%parameters%exact_rotation, &
                            self%line_ends(side:side + 1, p))
         end do
      end do
      call self%ledger%predicted_energies(self%blocks, self%matrices, self%state, dt, self%equations%x, &
                                          kinetic_predicted, strain_predicted)
      call move_blocks(self%blocks, self%parameters, self%matrices, dt, self%equations%x, self%state)
      call self%ledger%stored_energies(self%blocks, self%matrices, self%state, kinetic_moved, strain_moved)
      call self%ledger%add_motion(kinetic_predicted, strain_predicted, kinetic_moved, strain_moved, k01)
      call self%ledger%close_step(self%parameters, self%loads, self%table%n)
      self%state%velocity = k01*self%state%velocity
      self%state%step = self%state%step + 1
      self%state%time = self%state%time + dt
      call self%control%accepted(self%parameters, dt, displacement, shortened, k01)

      ! the table of this step becomes the last one; the old one is room for the next
      call self%contacts%exchange(self%table)

      self%record%step = self%state%step
      self%record%time = self%state%time
      self%record%dt = dt
      self%record%max_displacement = displacement
      self%record%energy = self%ledger%total
      self%record%contacts = [count(self%contacts%state(1:self%contacts%n) == contact_state%open), &
                              count(self%contacts%state(1:self%contacts%n) == contact_state%sliding), &
                              count(self%contacts%state(1:self%contacts%n) == contact_state%locked)]
      call measure_points(self%blocks, self%state, self%record)
   end subroutine accept

   !> Force of every contact of the last accepted step on its block_a: compression along the edge's outward normal,
   !> shear along the edge. Zero for open contacts.
   subroutine contact_forces(self, force)
      class(simulation_type), intent(in) :: self
      real(wp), allocatable, intent(inout) :: force(:, :)   !! (2, contacts%n)
      integer :: c
      if (allocated(force)) deallocate (force)
      allocate (force(2, self%contacts%n))
      do c = 1, self%contacts%n
         associate (n => self%contacts%normal(:, c))
            ! the tangent is the normal turned by +90 degrees: normal = (t2, -t1)
            force(:, c) = self%contacts%normal_force(c)*n + self%contacts%shear_force(c)*[-n(2), n(1)]
         end associate
      end do
   end subroutine contact_forces

   !> Axial forces of the bolts in the present state, tension positive.
   pure function bolt_forces(self) result(force)
      class(simulation_type), intent(in) :: self
      real(wp) :: force(self%blocks%bolts%n)
      integer :: l
      do l = 1, size(force)
         force(l) = bolt_force(self%blocks%bolts%stiffness(l), self%blocks%bolts%pretension(l), &
                               self%state%bolt_elongation(l), self%state%bolt_plastic(l))
      end do
   end function bolt_forces

end module rockdda_stepping_simulation
