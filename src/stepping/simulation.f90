! SPDX-License-Identifier: MIT
!> A run: the model, its state, and one accepted step at a time.
!>
!> `advance` is the whole of DDA's forward analysis: begin stages, find the motion of the step (search the contacts,
!> prepare all interactions, find the equilibrium with all laws, with a shorter step when that fails), then commit, move
!> the blocks, record. Only an accepted step changes the state; an attempt that fails or is interrupted leaves no trace.
module rockdda_stepping_simulation
   use rockdda_base_kinds, only : wp
   use rockdda_base_room, only : resize
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_interruption, only : interruption_type
   use rockdda_base_diagnostics, only : diagnostics_type
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_bolt_layout, only : name_of_spring
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_state, only : step_record_type, bolt_nodes_type, liner_nodes_type
   use rockdda_model_datum, only : find_datum, move_model
   use rockdda_contact_table, only : cut_no_interval
   use rockdda_contact_view, only : contact_view_type, view_contacts
   use rockdda_interaction_block_forces, only : block_forces_type
   use rockdda_interaction_interaction, only : interaction_type
   use rockdda_interaction_joint_stress, only : joint_stresses, mobilised_shares
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_liner_placing, only : add_liner_materials
   use rockdda_stepping_acceptance, only : accept_step, start_record
   use rockdda_stepping_construction, only : construction_type
   use rockdda_stepping_ledger, only : ledger_type
   use rockdda_stepping_stage_change, only : change_stage
   use rockdda_stepping_step, only : step_type
   use rockdda_stepping_trial_step, only : trial_report_type
   use rockdda_stepping_control, only : new_step_control
   use rockdda_stepping_motion, only : start_state
   use rockdda_linear_factory, only : new_solver, default_solver, has_cholmod
   use rockdda_check_options, only : check_start
   implicit none
   private
   public :: simulation_type

   !> The model, its state and the step at hand are those of `step_type`.
   type, extends(step_type) :: simulation_type
      ! the rest of the state: what a checkpoint has to hold
      type(construction_type) :: construction
      type(ledger_type) :: ledger
      type(step_record_type) :: record          !! of the last accepted step
      logical :: interrupted = .false.          !! the last `advance` stopped before its step was complete
      type(block_forces_type) :: forces         !! of the last accepted step of this process
   contains
      procedure :: init
      procedure :: add_interaction
      procedure :: advance
      procedure :: is_finished
      procedure :: ends_stage
      procedure :: set_interruption
      procedure :: planned_time
      procedure :: view
      procedure :: contact_stresses
      procedure :: contact_slab
      procedure :: bonds_hold
      procedure :: show_bolts
      procedure :: list_bolts
      procedure :: show_liners
      procedure :: list_liners
      procedure :: list_boundaries
      procedure :: list_water
      procedure :: weak_starts
   end type simulation_type

contains

   !> State at time 0. Errors: input that no run can start from.
   subroutine init(self, blocks, parameters, error)
      class(simulation_type), intent(inout) :: self
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(error_type), allocatable, intent(out) :: error
      call start_step(blocks, parameters, self%step_type, self%construction, error)
      if (allocated(error)) return
      call self%ledger%start(self%step_context_type, self%families)
      call start_record(self%step_type, self%ledger, self%record)
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
      if (self%parameters%ends_with_stages .and. .not. is_finished) is_finished = &
         self%control%next_stage(self%parameters, self%state%step, self%state%time) > size(self%parameters%stages)
   end function is_finished

   !> Is the present stage over with the last accepted step? In runs that end with their last stage.
   pure logical function ends_stage(self)
      class(simulation_type), intent(in) :: self
      ends_stage = self%state%step > 0
      if (ends_stage) ends_stage = self%control%next_stage(self%parameters, self%state%step, self%state%time) > &
                                   self%control%stage
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

   !> Compute one step. The state is then that of its end; after a stop on request (`interrupted`) or an error (exit
   !> code 3) it is that of the last accepted step, from which the same step can be repeated.
   subroutine advance(self, error)
      class(simulation_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      type(trial_report_type) :: report
      self%interrupted = .false.
      call self%times%start()
      call change_stage(self%step_type, self%construction, self%forces, self%record%unbalanced, self%ledger, &
                        error)
      if (allocated(error)) return
      ! of the last step, from the record: a checkpoint holds it, and a resumed run continues alike
      self%control%unbalanced = self%record%unbalanced
      self%control%idle = self%record%solver_iterations == 0
      self%control%releases = self%families%held%is_releasing()
      call self%trial%find_motion(self%step_context_type, self%contacts, self%control, self%families, self%equations, &
                                  self%solver, self%times, report, error)
      self%interrupted = report%interrupted
      if (allocated(error) .or. report%interrupted) return
      call accept_step(self%step_type, report, self%ledger, self%forces, self%record)
      ! blocks that a stage has placed are new in their first step alone
      self%construction%newborn = .false.
   end subroutine advance

   !> The contacts of the last accepted step as they are written.
   subroutine view(self, contacts)
      class(simulation_type), intent(in) :: self
      type(contact_view_type), intent(inout) :: contacts
      call view_contacts(self%contacts, self%state%vertices, 1, self%contacts%n, contacts, self%bonds_hold())
   end subroutine view

   !> Normal (1, tension positive) and shear (2) stress of every contact of the last accepted step, zero for open ones.
   subroutine contact_stresses(self, stress)
      class(simulation_type), intent(in) :: self
      real(wp), allocatable, intent(inout) :: stress(:, :)   !! (2, contacts%n) [force/length^2]
      if (allocated(stress)) deallocate (stress)
      allocate (stress(2, self%contacts%n))
      call joint_stresses(self%contacts, stress, holds=self%bonds_hold())
   end subroutine contact_stresses

   !> Some of the contacts, a slab of about `most` rows that cuts no interval, their stresses, and the share of the
   !> shear strength that they mobilise.
   subroutine contact_slab(self, first, most, last, contacts, stress)
      class(simulation_type), intent(in) :: self
      integer, intent(in) :: first, most
      integer, intent(out) :: last                           !! row that the slab ends with
      type(contact_view_type), intent(inout) :: contacts
      real(wp), allocatable, intent(inout) :: stress(:, :)   !! (3, last - first + 1)
      integer :: begin
      begin = first
      last = min(self%contacts%n, first + most - 1)
      call cut_no_interval(self%contacts%n, self%contacts%station, begin, last)
      call resize(stress, 3, last - first + 1)
      call view_contacts(self%contacts, self%state%vertices, first, last, contacts, self%bonds_hold())
      call joint_stresses(self%contacts, stress(1:2, :), first, self%bonds_hold())
      call mobilised_shares(self%families%contacts%laws, self%contacts, stress(3, :), first)
   end subroutine contact_slab

   !> Joint materials whose bonds carry tension.
   pure function bonds_hold(self) result(hold)
      class(simulation_type), intent(in) :: self
      logical :: hold(size(self%families%contacts%laws))
      hold = self%families%contacts%laws%tension > 0
   end function bonds_hold

   !> Bolts in the present state: the springs, each by its head alone, then the nodes of all others. Without nodes only
   !> the forces of the springs.
   subroutine show_bolts(self, nodes)
      class(simulation_type), intent(in) :: self
      type(bolt_nodes_type), intent(out) :: nodes
      real(wp) :: of_springs(self%blocks%bolts%n)
      integer :: k, n, m
      of_springs = self%families%bolts%present_forces(self%step_context_type)
      n = size(of_springs)
      m = self%families%bars%n_nodes()
      allocate (nodes%force(n + m), source=[of_springs, (0.0_wp, k=1, m)])
      if (m == 0) return
      allocate (nodes%place(2, n + m), nodes%slip(n + m), nodes%use(n + m), source=0.0_wp)
      allocate (nodes%state(n + m), source=1)
      if (n > 0) then
         nodes%place(:, :n) = self%state%bolt_ends(1:2, :)
         associate (strength => self%blocks%bolts%strength(1:n))
            where (strength > 0) nodes%use(:n) = abs(of_springs)/strength
         end associate
      end if
      call self%families%bars%show_nodes(self%step_context_type, nodes%place(:, n + 1:), nodes%force(n + 1:), &
                                         nodes%slip(n + 1:), nodes%use(n + 1:), nodes%state(n + 1:))
      nodes%place = nodes%place + spread(self%state%datum, 2, n + m)
   end subroutine show_bolts

   !> Names of all bolts, where some have nodes, and how many nodes are before those of each.
   pure subroutine list_bolts(self, n_nodes, names, first, spacing)
      class(simulation_type), intent(in) :: self
      integer, intent(out) :: n_nodes                               !! 0: no bolt has nodes
      character(len=:), allocatable, intent(inout) :: names(:)
      integer, allocatable, intent(inout) :: first(:)
      real(wp), allocatable, intent(inout) :: spacing(:)
      integer :: l, longest, n
      n_nodes = 0
      if (allocated(names)) deallocate (names)
      if (self%families%bars%n_nodes() == 0) return
      associate (bolts => self%families%bars%bolts)
         n = self%blocks%bolts%n
         longest = 1
         do l = 1, n
            longest = max(longest, len(name_of_spring(self%parameters%bolts, n, l)))
         end do
         do l = 1, size(bolts)
            longest = max(longest, len(bolts(l)%name))
         end do
         allocate (character(len=longest) :: names(n + size(bolts)))
         do l = 1, n
            names(l) = name_of_spring(self%parameters%bolts, n, l)
         end do
         first = [(l, l=0, n)]
         spacing = [(1.0_wp, l=1, n), bolts%spacing]
         do l = 1, size(bolts)
            names(n + l) = bolts(l)%name
            first = [first, first(size(first)) + bolts(l)%bar%n]
         end do
         n_nodes = first(size(first))
      end associate
   end subroutine list_bolts

   !> Nodes of all linings in the present state.
   subroutine show_liners(self, nodes)
      class(simulation_type), intent(in) :: self
      type(liner_nodes_type), intent(out) :: nodes
      if (self%families%liners%n_nodes() == 0) return
      call self%families%liners%show_nodes(self%step_context_type, nodes)
      nodes%place = nodes%place + spread(self%state%datum, 2, size(nodes%place, 2))
   end subroutine show_liners

   !> Names of all linings, how many nodes are before those of each, and their sections.
   pure subroutine list_liners(self, n_nodes, names, first, section)
      class(simulation_type), intent(in) :: self
      integer, intent(out) :: n_nodes
      character(len=:), allocatable, intent(inout) :: names(:)
      integer, allocatable, intent(inout) :: first(:)
      real(wp), allocatable, intent(inout) :: section(:, :)   !! (5, linings) thickness, strengths, 1: closed, side
      integer :: k, longest
      n_nodes = self%families%liners%n_nodes()
      if (allocated(names)) deallocate (names)
      if (n_nodes == 0) return
      associate (liners => self%families%liners%liners)
         longest = maxval([(len(liners(k)%name), k=1, size(liners))])
         allocate (character(len=longest) :: names(size(liners)))
         if (allocated(section)) deallocate (section)
         allocate (section(5, size(liners)))
         first = [0]
         do k = 1, size(liners)
            names(k) = liners(k)%name
            first = [first, first(k) + liners(k)%layout%n]
            section(:, k) = [liners(k)%section%thickness, liners(k)%section%compression, liners(k)%section%tension, &
                             merge(1.0_wp, 0.0_wp, liners(k)%layout%closed), real(liners(k)%side, wp)]
         end do
      end associate
   end subroutine list_liners

   !> Edges of the boundaries, each by its boundary and its first vertex, and what kinds the boundaries are of.
   pure subroutine list_boundaries(self, n, edges, kinds)
      class(simulation_type), intent(in) :: self
      integer, intent(out) :: n
      integer, allocatable, intent(inout) :: edges(:, :)            !! (2, edges)
      character(len=10), allocatable, intent(inout) :: kinds(:)     !! (n)
      integer :: g
      n = size(self%families%boundaries%force, 2)
      edges = self%families%boundaries%edges([1, 3], :)
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

end module rockdda_stepping_simulation
