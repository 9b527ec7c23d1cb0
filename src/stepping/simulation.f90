! SPDX-License-Identifier: MIT
!> A run: the model, its state, and one accepted step at a time.
!>
!> `advance` is the whole of DDA's forward analysis: search the contacts, prepare all interactions, find the equilibrium
!> with all laws (rockdda_stepping_newton), cut the step when that fails, commit, move the blocks, record. Each attempt
!> starts from the same saved state: only an accepted step changes it.
module rockdda_stepping_simulation
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type, error_code, make_error, add_context
   use rockdda_base_diagnostics, only : diagnostics_type
   use rockdda_base_interruption, only : interruption_type
   use rockdda_base_strings, only : to_string
   use rockdda_base_phase_times, only : phase_times_type, phase
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_options, only : is_set
   use rockdda_model_state, only : step_record_type, energy
   use rockdda_contact_table, only : contact_table_type, contact_state
   use rockdda_contact_topology, only : contact_topology_type, new_contact_topology
   use rockdda_contact_search, only : contact_search_type, search_limits_type, placing_share
   use rockdda_interaction_block_forces, only : block_forces_type
   use rockdda_interaction_bolts, only : bolt_force, is_there
   use rockdda_interaction_contact_law, only : new_contact_laws
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_elasticity, only : strain_energy
   use rockdda_interaction_equations, only : equations_type
   use rockdda_interaction_families, only : families_type
   use rockdda_interaction_interaction, only : interaction_type
   use rockdda_interaction_joint_stress, only : joint_stresses
   use rockdda_interaction_kinematics, only : mass_times
   use rockdda_linear_solver, only : linear_solver_type
   use rockdda_linear_factory, only : new_solver, default_solver
   use rockdda_stepping_construction, only : construction_type, retire_block, change_materials, &
      show_blocks, longest_edge
   use rockdda_stepping_control, only : step_control_type, new_step_control, check_stages, cut_for_displacement, &
      cut_reason, n_cut_reasons
   use rockdda_stepping_equilibrium, only : varies_with_time, report_no_equilibrium
   use rockdda_stepping_failure, only : attempt, find_ruined_block, report_failure
   use rockdda_stepping_impact, only : impact_type
   use rockdda_stepping_ledger, only : ledger_type
   use rockdda_stepping_ground_check, only : check_ground
   use rockdda_stepping_newton, only : newton_type, newton_report_type
   use rockdda_stepping_parameter_check, only : check_parameters
   use rockdda_stepping_reach, only : predicted_reach, set_search_limits, quantised
   use rockdda_stepping_motion, only : start_state, move_blocks, measure_points, largest_displacement, &
      reset_measured
   implicit none
   private
   public :: simulation_type

   !> The model, its state and the attempt at hand are those of `step_context_type`.
   type, extends(step_context_type) :: simulation_type
      ! the rest of the state: what a checkpoint has to hold
      type(contact_table_type) :: contacts      !! of the last accepted step
      type(step_control_type) :: control
      type(construction_type) :: construction
      type(ledger_type) :: ledger
      type(step_record_type) :: record          !! of the last accepted step
      type(equations_type) :: equations         !! x: last solution, the start of the next iterative solve
      type(phase_times_type) :: times           !! where the time went; nothing depends on it
      logical :: interrupted = .false.          !! the last `advance` stopped before its step was complete
      ! tools and scratch
      class(linear_solver_type), allocatable :: solver
      type(contact_search_type) :: search       !! search%pairs%keep = .false.: never with pairs of an earlier step
      type(contact_topology_type), private :: topology
      type(search_limits_type), private :: limits
      type(families_type) :: families           !! families%held is a part of the state
      type(newton_type), private :: newton
      type(block_forces_type) :: forces         !! of the last accepted step of this process
      real(wp), allocatable, private :: last_motion(:, :)   !! (6, nb) to go back to when the step is interrupted
      integer, private :: step_cuts(n_cut_reasons) = 0   !! of the step at hand
   contains
      procedure :: init
      procedure :: add_interaction
      procedure :: advance
      procedure :: is_finished
      procedure :: ends_stage
      procedure :: set_interruption
      procedure :: planned_time
      procedure :: contact_forces
      procedure :: contact_stresses
      procedure :: bolt_forces
      procedure :: list_boundaries
      procedure :: list_water
      procedure :: weak_starts
      procedure, private :: begin_stages
      procedure, private :: find_first_forces
      procedure, private :: block_energies
      procedure, private :: prepare
      procedure, private :: try_step
      procedure, private :: expect_motion
      procedure, private :: shorten_step
      procedure, private :: accept
      procedure, private :: fill_record
   end type simulation_type

contains

   !> State at time 0. Errors: input that no run can start from.
   subroutine init(self, blocks, parameters, error)
      class(simulation_type), intent(inout) :: self
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(error_type), allocatable, intent(out) :: error
      type(diagnostics_type) :: problems
      integer :: i
      self%blocks = blocks
      self%parameters = parameters
      if (blocks%n_blocks < 1) then
         call make_error(error, error_code%input, 'the model has no blocks')
         return
      end if
      call new_contact_laws(parameters%joint_materials, self%families%contacts%laws, problems)
      call check_parameters(parameters, problems)
      call check_stages(parameters, blocks%fixed%n, problems)
      call self%families%loads%init(blocks, parameters, self%line_ends, problems)
      call check_ground(blocks, parameters, problems)
      call problems%to_error(error)
      if (allocated(error)) return
      if (len_trim(parameters%solver_method) == 0) self%parameters%solver_method = default_solver()
      call new_solver(self%parameters%solver_method, parameters%solver_tolerance, parameters%sor_factor, &
                      parameters%preconditioner, self%solver, error)
      if (allocated(error)) return
      call start_state(blocks, parameters, self%state, self%initial_stress)
      call new_contact_topology(blocks, self%topology)
      call self%construction%init(blocks, parameters)
      do i = 1, blocks%n_blocks
         if (any(self%construction%placed(i, :) > 0)) call retire_block(self%state, i)
      end do
      call self%families%elasticity%init(parameters)
      call self%families%supports%init(blocks, parameters)
      call self%families%bolts%init(blocks%bolts)
      call self%families%boundaries%init(blocks, parameters, self%initial_stress, self%state%active, &
                                         problems)
      self%held = self%families%boundaries%held_blocks(blocks%n_blocks)
      call self%families%water%init(blocks, parameters, problems)
      self%water = ''
      call new_step_control(parameters, blocks%fixed%n, self%control)
      call self%contacts%resize(0)
      call self%equations%set_size(blocks%n_blocks, 0)
      self%equations%x = 0
      call self%ledger%start(self%step_context_type, self%families)
      self%record = step_record_type()
      if (parameters%energy) self%record%energy = self%ledger%total
      allocate (self%record%measured_displacement(2, blocks%measured%n), &
                self%record%measured_stress(3, blocks%measured%n), &
                self%record%measured_rotation(blocks%measured%n), self%record%fixed_force(2, blocks%fixed%n), &
                self%record%boundary_force(2, size(self%families%boundaries%force, 2)))
      self%record%measured_displacement = 0
      self%record%measured_stress = 0
      self%record%measured_rotation = 0
      self%record%fixed_force = 0
      self%record%boundary_force = 0
   end subroutine init

   !> One more interaction, added from outside, for all steps to come. Checkpoints do not hold it.
   subroutine add_interaction(self, interaction)
      class(simulation_type), intent(inout) :: self
      class(interaction_type), intent(in) :: interaction
      call self%families%add(interaction)
   end subroutine add_interaction

   !> Has the run done all its steps or reached its end time?
   pure logical function is_finished(self)
      class(simulation_type), intent(in) :: self
      is_finished = self%state%step >= self%parameters%n_steps .or. &
                    .not. self%state%time < self%parameters%t_end*(1 - 1.0e-12_wp)
      if (.not. is_finished) is_finished = self%control%is_over(self%parameters, self%state%step, self%state%time)
   end function is_finished

   !> Is the present stage over with the last accepted step? In runs that end with their last stage.
   pure logical function ends_stage(self)
      class(simulation_type), intent(in) :: self
      type(step_control_type) :: next
      ends_stage = .false.
      if (.not. self%parameters%ends_with_stages .or. self%state%step == 0) return
      next = self%control
      call next%end_stages(self%parameters, self%state%step, self%state%time)
      ends_stage = next%stage > self%control%stage
   end function ends_stage

   !> Stop on request: within a step too, between solves and between iterations of the solver.
   subroutine set_interruption(self, interruption)
      class(simulation_type), intent(inout) :: self
      class(interruption_type), intent(in) :: interruption
      if (allocated(self%solver%interruption)) deallocate (self%solver%interruption)
      allocate (self%solver%interruption, source=interruption)
   end subroutine set_interruption

   !> Time at the end of the run when no step is cut, 0 when that depends on the stages.
   pure real(wp) function planned_time(self)
      class(simulation_type), intent(in) :: self
      planned_time = 0
      if (self%parameters%n_steps == huge(1) .and. .not. self%parameters%t_end < huge(1.0_wp)) return
      planned_time = min(self%parameters%t_end, self%parameters%n_steps*self%parameters%dt_max)
   end function planned_time

   !> One accepted step, unless a stop is requested: `interrupted` is then true, and the state is that of the last
   !> accepted step, from which the same step can be repeated. On error (code 3) the state is that of the last accepted
   !> step too.
   subroutine advance(self, error)
      class(simulation_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      type(newton_report_type) :: report
      real(wp) :: wanted, reach, displacement
      integer :: attempts, iterations, p
      logical :: at_floor, is_first
      real(wp), allocatable :: memory(:)

      self%interrupted = .false.
      if (allocated(self%solver%interruption)) self%last_motion = self%equations%x
      call self%solver%pack(memory)
      call self%times%start()
      call self%control%end_stages(self%parameters, self%state%step, self%state%time)
      if (self%control%has_failed(self%parameters, self%state%step)) then
         if (.not. allocated(self%forces%magnitude)) call self%forces%clear(self%blocks%n_blocks)
         call report_no_equilibrium(self%parameters, self%control%stage, self%state, self%forces, &
                                    self%record%unbalanced, error)
         return
      end if
      call self%begin_stages()
      self%released = self%control%released
      do p = 1, self%blocks%fixed%n
         if (.not. self%state%active(self%blocks%fixed%block(p))) self%released(p) = .true.
      end do
      self%gravity = self%control%gravity(self%parameters)
      self%water = self%control%water(self%parameters)
      wanted = self%control%dt
      self%dt = self%control%step_size(self%parameters, self%state%time)
      reach = predicted_reach(self%blocks, self%parameters, self%state, self%control, self%dt)
      if (any(self%construction%newborn)) reach = max(reach, quantised(2*placing_share*longest_edge( &
         self%blocks, self%construction%newborn), self%parameters%w0))
      call self%prepare(reach)
      attempts = 0
      iterations = 0
      is_first = .true.
      self%step_cuts = 0
      do
         attempts = attempts + 1
         ! the negation: a step that is no number has no smaller one
         at_floor = .not. self%dt > self%parameters%dt_min*(1 + 1.0e-12_wp)
         call self%try_step(reach, is_first, at_floor, report, displacement, error)
         is_first = .false.
         iterations = iterations + report%iterations
         if (allocated(error)) then
            call add_context(error, 'step '//to_string(self%state%step + 1))
            return
         end if
         select case (report%outcome)
         case (attempt%converged)
            exit
         case (attempt%interrupted)
            self%interrupted = .true.
            self%equations%x = self%last_motion
            call self%solver%unpack(memory)
            return
         case (attempt%search_again)
            ! a step that may be: search further, and begin again
            reach = max(2*reach, quantised(2.5_wp*displacement, self%parameters%w0))
            call self%prepare(reach)
            attempts = attempts - 1
         case default
            if (at_floor) then
               call report_failure(report%outcome, self%dt, report%detail, self%blocks, self%parameters, self%state, &
                                   self%families%contacts%table, self%families%contacts%trial, self%equations%x, error)
               return
            end if
            call self%shorten_step(report%outcome, displacement)
         end select
      end do
      self%control%cuts = self%control%cuts + self%step_cuts
      call self%times%lap(phase%other)
      call self%accept(abs(self%dt - wanted) > 0 .and. attempts == 1, displacement, report%rounds, attempts)
      self%record%open_close_iterations = report%rounds
      self%record%attempts = attempts
      self%record%solver_iterations = iterations
      self%times%steps = self%times%steps + 1
      self%times%solver_iterations = self%times%solver_iterations + iterations
      call self%times%lap(phase%update)
   end subroutine advance

   !> Carry out the start of all stages that have begun since the last step.
   subroutine begin_stages(self)
      class(simulation_type), intent(inout) :: self
      type(diagnostics_type) :: ignored
      real(wp), allocatable :: before(:)
      real(wp) :: share
      integer :: first, s
      logical :: is_new
      if (self%state%step == 0 .and. self%control%begun == 0) call self%find_first_forces()
      do s = self%control%begun + 1, min(self%control%stage, size(self%parameters%stages))
         associate (stage => self%parameters%stages(s), held => self%families%held)
            call self%construction%place(s, self%blocks, self%state, self%ledger)
            if (self%state%step == 0) then
               call self%construction%excavate(s, self%blocks, self%families%contacts%table, self%block_energies(), &
                                               self%state, held, self%ledger, first)
            else
               call self%construction%excavate(s, self%blocks, self%contacts, self%block_energies(), self%state, held, &
                                               self%ledger, first)
            end if
            share = 1
            if (is_set(stage%relax)) share = stage%relax
            ! a share that is given holds for all forces, otherwise for those of this excavation
            if (is_set(stage%relax)) first = 1
            call held%relax(first, share, stage%relax_steps)
            before = self%block_energies()
            call change_materials(self%construction, s, self%blocks, self%parameters, self%state, is_new)
            if (is_new) then
               call new_contact_laws(self%parameters%joint_materials, self%families%contacts%laws, ignored)
               call self%families%elasticity%init(self%parameters)
               call self%ledger%add(energy%discarded, sum(before) - sum(self%block_energies()))
               self%families%contacts%stiffness_is_new = .true.
            end if
            if (stage%reset_displacement) call reset_measured(self%blocks, self%state)
         end associate
         self%control%begun = s
      end do
   end subroutine begin_stages

   !> Where the first stage excavates: contacts of all blocks with the forces that the initial stress gives them.
   subroutine find_first_forces(self)
      class(simulation_type), intent(inout) :: self
      if (size(self%construction%excavated, 2) == 0) return
      if (.not. any(self%construction%excavated(:, 1) > 0)) return
      self%released = self%control%released
      self%gravity = self%control%gravity(self%parameters)
      self%dt = self%control%step_size(self%parameters, self%state%time)
      call self%prepare(predicted_reach(self%blocks, self%parameters, self%state, self%control, self%dt))
   end subroutine find_first_forces

   !> Strain and kinetic energy of each block.
   function block_energies(self) result(energies)
      class(simulation_type), intent(in) :: self
      real(wp) :: energies(self%blocks%n_blocks)
      integer :: i
      associate (s => self%state)
         do i = 1, size(energies)
            energies(i) = strain_energy(s%stress(:, i), &
                                        self%families%elasticity%c(:, :, self%blocks%block_material(i)), s%area(i)) &
                          + 0.5_wp*dot_product(s%velocity(:, i), mass_times(s%mass(i), s%area(i), s%moments(:, i), &
                                                                            s%velocity(:, i)))
         end do
      end associate
   end function block_energies

   !> A shorter step after a failed attempt; count why.
   pure subroutine shorten_step(self, outcome, displacement)
      class(simulation_type), intent(inout) :: self
      integer, intent(in) :: outcome              !! one of attempt%...
      real(wp), intent(in) :: displacement        !! largest of any vertex [length]
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
      self%step_cuts(reason) = self%step_cuts(reason) + 1
      if (outcome == attempt%too_far) then
         self%dt = cut_for_displacement(self%parameters, self%dt, displacement)
      else
         self%dt = max(self%parameters%dt_min, self%parameters%cut_factor*self%dt)
      end if
   end subroutine shorten_step

   !> Search the contacts of the step from the state at its start, and set up the links of all interactions.
   subroutine prepare(self, reach)
      class(simulation_type), intent(inout) :: self
      real(wp), intent(in) :: reach   !! [length]
      integer :: pattern_id
      call set_search_limits(self%contacts, self%parameters, self%blocks%n_blocks, reach, self%limits, &
                             any(self%construction%placed > 0))
      call show_blocks(self%search, self%state%active, self%construction%newborn)
      call self%times%lap(phase%other)
      call self%search%run(self%blocks, self%topology, self%state%vertices, self%limits, self%contacts, &
                           self%state%step == 0, 1.0e-6_wp*self%parameters%w0, self%families%contacts%table)
      self%times%searches = self%times%searches + 1
      if (self%search%pairs%was_kept) self%times%reused = self%times%reused + 1
      call self%times%lap(phase%search)
      call self%families%prepare(self%step_context_type, self%equations)
      call self%times%lap(phase%links)
      pattern_id = self%equations%matrix%pattern_id
      call self%equations%set_graph()
      if (self%equations%matrix%pattern_id /= pattern_id) self%times%patterns = self%times%patterns + 1
      call self%times%lap(phase%graph)
   end subroutine prepare

   !> One attempt with a fixed dt: find the equilibrium, and check that its motion can be accepted.
   subroutine try_step(self, reach, is_first, at_floor, report, displacement, error)
      class(simulation_type), intent(inout) :: self
      real(wp), intent(in) :: reach     !! of the search that found the contacts [length]
      logical, intent(in) :: is_first   !! nothing has been solved in this step: x is the motion of the last one
      logical, intent(in) :: at_floor   !! there is no smaller step to fall back to
      type(newton_report_type), intent(out) :: report
      real(wp), intent(out) :: displacement      !! largest of any vertex [length]
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: limit, factor
      integer :: ruined

      displacement = 0
      self%times%attempts = self%times%attempts + 1
      call self%times%lap(phase%other)
      call self%expect_motion(is_first)
      call self%families%begin(self%step_context_type)
      call self%families%place(self%step_context_type, self%equations)
      call self%times%lap(phase%block_terms)
      self%newton%at_floor = at_floor
      self%newton%may_predict = is_first .and. abs(self%dt - self%control%last_dt) <= 0 .and. &
                                abs(self%control%k01(self%parameters) - 1) <= 0
      call self%newton%find_equilibrium(self%step_context_type, self%families, self%equations, self%solver, &
                                        self%times, report, error)
      if (allocated(error)) return
      ! only a motion that would be accepted is measured: in earlier rounds blocks may be loose
      if (report%outcome /= attempt%converged) return
      displacement = largest_displacement(self%blocks, self%state, self%equations%x)
      limit = self%parameters%displacement_ratio*self%parameters%w0
      call find_ruined_block(self%blocks, self%parameters, self%state, self%equations%x, ruined, factor)
      if (ruined > 0) then
         report%outcome = attempt%ruined
      else if (.not. displacement <= limit .and. .not. at_floor) then
         report%outcome = attempt%too_far
      else if (.not. displacement <= max(limit, self%parameters%w0)) then
         report%outcome = attempt%thrown
      else if (2*displacement > reach .and. displacement <= 1.0e3_wp*self%parameters%w0) then
         report%outcome = attempt%search_again
      end if
   end subroutine try_step

   !> Expect a motion of the step, whose rotations the arms of forces follow: that of the present velocities, or, where
   !> none are carried on, that of the last step.
   subroutine expect_motion(self, is_first)
      class(simulation_type), intent(inout) :: self
      logical, intent(in) :: is_first   !! x is the motion of the last step
      call self%renew_all()
      if (self%control%k01(self%parameters) > 0) then
         call self%expect(self%state%velocity, self%dt)
      else if (is_first .and. abs(self%dt - self%control%last_dt) <= 0) then
         call self%expect(self%equations%x)
      else
         call self%expect()
      end if
   end subroutine expect_motion

   !> Take over a step: energies, states of all interactions, motion of the blocks, record.
   subroutine accept(self, shortened, displacement, rounds, attempts)
      class(simulation_type), intent(inout) :: self
      logical, intent(in) :: shortened      !! dt was shortened to land on an end
      real(wp), intent(in) :: displacement  !! largest of any vertex [length]
      integer, intent(in) :: rounds         !! of the open-close iteration, of the accepted attempt
      integer, intent(in) :: attempts
      type(impact_type) :: impact
      logical :: may_grow
      real(wp) :: k01
      k01 = self%control%k01(self%parameters)
      associate (contacts => self%families%contacts)
         if (k01 > 0) call impact%find(self%step_context_type, contacts%table, contacts%trial, contacts%laws, &
                                       self%equations%x)
      end associate
      if (impact%happened) call self%families%predict(self%equations)
      if (self%parameters%energy) call self%ledger%add_step(self%step_context_type, self%families, self%equations%x)
      call self%families%commit(self%step_context_type, self%equations%x)
      call move_blocks(self%blocks, self%parameters, self%families%elasticity, self%dt, self%equations%x, self%state)
      if (impact%happened) call impact%finish(self%step_context_type, self%families%contacts%table, &
                                              self%families%contacts%trial)
      if (self%parameters%energy) call self%ledger%close_step(self%step_context_type, self%families, k01, &
                                                              impact%happened)
      call self%forces%clear(self%blocks%n_blocks)
      call self%families%add_forces(self%step_context_type, self%forces)
      self%record%unbalanced = self%forces%unbalanced(self%state)
      self%record%stage = self%control%stage_index()
      self%record%relaxation = self%families%held%relaxation()
      call self%control%judge_balance(self%parameters, self%record%unbalanced, self%forces%driven)
      if (self%control%is_static_search(self%parameters)) self%control%slip_share = &
         self%families%contacts%slip_share()
      self%state%velocity = k01*self%state%velocity
      self%construction%newborn = .false.
      self%families%contacts%stiffness_is_new = .false.
      self%state%step = self%state%step + 1
      self%state%time = self%state%time + self%dt
      may_grow = self%control%is_static_search(self%parameters)
      if (may_grow) may_grow = .not. varies_with_time(self%parameters, self%state%time)
      call self%control%accepted(self%parameters, self%dt, displacement, shortened, k01, &
                                 rounds*attempts, may_grow)
      ! the table of this step becomes the last one; the old one is room for the next
      call self%contacts%exchange(self%families%contacts%table)
      call self%fill_record(displacement)
   end subroutine accept

   !> The record of an accepted step.
   subroutine fill_record(self, displacement)
      class(simulation_type), intent(inout) :: self
      real(wp), intent(in) :: displacement  !! largest of any vertex [length]
      self%record%step = self%state%step
      self%record%time = self%state%time
      self%record%dt = self%dt
      self%record%max_displacement = displacement
      if (self%parameters%energy) self%record%energy = self%ledger%total
      associate (states => self%contacts%state(1:self%contacts%n))
         self%record%contacts = [count(states == contact_state%open), count(states == contact_state%sliding), &
                                 count(states == contact_state%locked)]
      end associate
      self%record%fixed_force = self%families%supports%force
      self%record%boundary_force = self%families%boundaries%force
      call measure_points(self%blocks, self%state, self%record)
   end subroutine fill_record

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

   !> Normal (1, tension positive) and shear (2) stress of every contact of the last accepted step, zero for open ones.
   subroutine contact_stresses(self, stress)
      class(simulation_type), intent(in) :: self
      real(wp), allocatable, intent(inout) :: stress(:, :)   !! (2, contacts%n) [force/length^2]
      if (allocated(stress)) deallocate (stress)
      allocate (stress(2, self%contacts%n))
      call joint_stresses(self%contacts, stress)
   end subroutine contact_stresses

   !> Axial forces of the bolts in the present state, tension positive.
   pure function bolt_forces(self) result(force)
      class(simulation_type), intent(in) :: self
      real(wp) :: force(self%blocks%bolts%n)
      integer :: l
      force = 0
      do l = 1, size(force)
         if (.not. all(is_there(self%state%active, self%blocks%bolts%blocks(:, l)))) cycle
         force(l) = bolt_force(self%blocks%bolts%stiffness(l), self%blocks%bolts%pretension(l), &
                               self%state%bolt_elongation(l), self%state%bolt_plastic(l))
      end do
   end function bolt_forces

   !> Edges of the boundaries, each by its boundary and its first vertex, and what kinds the boundaries are of.
   pure subroutine list_boundaries(self, n, edges, kinds)
      class(simulation_type), intent(in) :: self
      integer, intent(out) :: n
      integer, allocatable, intent(inout) :: edges(:, :)            !! (2, edges)
      character(len=8), allocatable, intent(inout) :: kinds(:)      !! (n)
      integer :: g
      n = size(self%families%boundaries%force, 2)
      edges = self%families%boundaries%edges
      if (allocated(kinds)) deallocate (kinds)
      allocate (kinds(n))
      do g = 1, n
         kinds(g) = self%parameters%boundaries(g)%kind
      end do
   end subroutine list_boundaries

   !> Contact points of the first step that could not begin with the whole traction of the initial stress: where its
   !> shear exceeds the strength (1), and where it would be tension (2).
   pure function weak_starts(self) result(n)
      class(simulation_type), intent(in) :: self
      integer :: n(2)
      n = self%families%contacts%weak_starts
   end function weak_starts

   !> Stretches of edges that groups of &water wet, where they act: group, both vertices, joint material beyond or 0;
   !> and their ends.
   pure subroutine list_water(self, edges, ends)
      class(simulation_type), intent(in) :: self
      integer, allocatable, intent(inout) :: edges(:, :)    !! (4, n)
      real(wp), allocatable, intent(inout) :: ends(:, :)    !! (2, n) shares of the edge
      integer :: g, i, n
      associate (water => self%families%water)
         if (allocated(edges)) deallocate (edges, ends)
         n = count(water%wets)
         allocate (edges(4, n), ends(2, n))
         n = 0
         do g = 1, size(water%wets, 1)
            do i = 1, size(water%wets, 2)
               if (.not. water%wets(g, i)) cycle
               n = n + 1
               edges(:, n) = [g, water%stretches(i)%vertices, water%stretches(i)%joints(2)]
               ends(:, n) = water%stretches(i)%ends
            end do
         end do
      end associate
   end subroutine list_water

end module rockdda_stepping_simulation
