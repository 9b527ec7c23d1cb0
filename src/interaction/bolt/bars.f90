! SPDX-License-Identifier: MIT
!> All bolts with nodes along their length, in all blocks that they cross (docs/theory.md, "Bolts"): one bolt is
!> rockdda_interaction_bar_bolt, its links in a step rockdda_interaction_bar_links, what lasts and what is shown of it
!> rockdda_interaction_bars, its steel and grout rockdda_interaction_bar.
module rockdda_interaction_bars
   use rockdda_base_kinds, only : wp
   use rockdda_base_state_archive, only : state_archive_type
   use rockdda_base_strings, only : to_string
   use rockdda_model_blocks, only : block_system_type, largest_coordinate
   use rockdda_model_bolt_layout, only : bolt_line_type, bolt_lines, rock_at, stage_with
   use rockdda_model_bolt_numbers, only : numbers_of_bolt
   use rockdda_model_geometry_input, only : is_spring
   use rockdda_model_state, only : energy
   use rockdda_interaction_attempt, only : attempt_type
   use rockdda_interaction_balance, only : energy_balance_type
   use rockdda_interaction_bar, only : bar_response_type, copy_state, bar_state_type, respond, accept, node_forces
   use rockdda_interaction_bar_bolt, only : bolt_type, draw_bolt, install, forget_step, measure_bolt, &
      measure_between, direction, find_forces, dowel_response, find_points, energy_of, place_at, is_lost
   use rockdda_interaction_bar_links, only : links_of, join_bolt, find_tension, place_bolt, add_to_links_of, &
      predict_bolt, forces_of_links, measure_placement_of, judge_bolt, force_across
   use rockdda_interaction_block_forces, only : block_forces_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_equations, only : equations_type
   use rockdda_interaction_kinematics, only : move_point
   use rockdda_interaction_linked_interaction, only : linked_interaction_type, motion_change_type
   implicit none
   private
   public :: bars_type

   !> What carries this share of its strength is shown as slipping or yielding, also at rest.
   real(wp), parameter :: at_limit = 1 - 1.0e-6_wp

   !> What a node is at the end of a step.
   type :: node_state_enum
      integer :: absent = 0
      integer :: elastic = 1
      integer :: slipping = 2
      integer :: yielding = 3
      integer :: ruptured = 4
   end type node_state_enum
   type(node_state_enum), parameter :: node_state = node_state_enum()

   type, extends(linked_interaction_type) :: bars_type
      type(bolt_type), allocatable :: bolts(:)
      real(wp) :: work(3) = 0                   !! of slip, of yield, set free by breaking [energy]
      real(wp), private :: level = 1            !! share of the step's motion up to where forces act
   contains
      procedure :: init
      procedure :: begin_stage
      procedure :: start_energy
      procedure :: subtract_datum
      procedure :: n_nodes
      procedure :: show_nodes
      procedure :: show_bolts
      procedure :: prepare
      procedure :: begin
      procedure :: place
      procedure :: add_to_links
      procedure :: set_motion
      procedure :: lawful_forces
      procedure :: measure_placement
      procedure :: judge
      procedure :: reach_end
      procedure :: add_energies
      procedure :: commit
      procedure :: add_forces
      procedure :: exchange_state
   end type bars_type

contains

   !> The bolts of a model, those from the start installed. Blocks are where they have been drawn; those with bolts are
   !> marked in the context.
   subroutine init(self, context)
      class(bars_type), intent(inout) :: self
      type(step_context_type), intent(inout) :: context
      type(bolt_line_type), allocatable :: lines(:)
      type(block_system_type) :: blocks
      logical, allocatable :: rock(:)
      integer :: l, last
      if (allocated(self%bolts)) deallocate (self%bolts)
      allocate (self%bolts(0))
      associate (p => context%parameters)
         if (.not. allocated(p%bolts)) return
         if (all(is_spring(p%bolts))) return
         blocks = context%model_blocks()
         call bolt_lines(p%bolts, blocks, p%regions, p%stages, lines)
         deallocate (self%bolts)
         allocate (self%bolts(size(lines)))
         if (allocated(context%bolted)) deallocate (context%bolted)
         allocate (context%bolted(blocks%n_blocks), source=.false.)
         last = 0
         do l = 1, size(lines)
            associate (bolt => self%bolts(l))
               bolt%name = lines(l)%name
               bolt%installs = stage_with(p%stages, p%bolts(lines(l)%group)%name, installs=.true.)
               bolt%removes = stage_with(p%stages, p%bolts(lines(l)%group)%name, installs=.false.)
               ! bolts of a group are installed together
               if (lines(l)%group /= last) rock = rock_at(blocks, p%regions, p%stages, bolt%installs)
               last = lines(l)%group
               call draw_bolt(lines(l)%head - context%state%datum, lines(l)%toe - context%state%datum, &
                              numbers_of_bolt(p%bolts(lines(l)%group), norm2(lines(l)%toe - lines(l)%head)), &
                              context%blocks, rock, bolt)
               if (bolt%installs == 0) call install(context, bolt)
               context%bolted(pack(bolt%block, bolt%block > 0)) = .true.
            end associate
         end do
      end associate
   end subroutine init

   !> Number of bolts; before `init` there are none.
   pure integer function n_bolts(self)
      class(bars_type), intent(in) :: self
      n_bolts = 0
      if (allocated(self%bolts)) n_bolts = size(self%bolts)
   end function n_bolts

   !> Nodes of all bolts.
   pure integer function n_nodes(self) result(n)
      class(bars_type), intent(in) :: self
      integer :: l
      n = 0
      do l = 1, n_bolts(self)
         n = n + self%bolts(l)%bar%n
      end do
   end function n_nodes

   !> Energy of all bolts at the present places of their blocks.
   pure real(wp) function start_energy(self, context) result(stored)
      class(bars_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(bolt_type) :: bolt
      integer :: l
      stored = 0
      do l = 1, n_bolts(self)
         bolt = self%bolts(l)
         if (.not. bolt%is_there) cycle
         call measure_between(context%state%active, bolt)
         stored = stored + bolt%stored
      end do
   end function start_energy

   !> Install and remove bolts when a stage begins. The energy of pretension is work from outside; what bolts lose that
   !> go, or whose rock has gone, is discarded.
   subroutine begin_stage(self, stage, context, balance)
      class(bars_type), intent(inout) :: self
      integer, intent(in) :: stage
      type(step_context_type), intent(in) :: context
      class(energy_balance_type), intent(inout) :: balance
      real(wp) :: left, now
      integer :: l
      if (n_bolts(self) == 0) return
      do l = 1, n_bolts(self)
         if (self%bolts(l)%removes == stage) self%bolts(l)%is_there = .false.
      end do
      left = self%start_energy(context)
      call balance%add(energy%discarded, balance%bar_energy - left)
      do l = 1, n_bolts(self)
         if (self%bolts(l)%installs == stage) call install(context, self%bolts(l))
      end do
      do l = 1, n_bolts(self)
         call measure_between(context%state%active, self%bolts(l))
      end do
      now = sum(self%bolts%stored)
      call balance%add(energy%external, now - left)
      balance%bar_energy = now
   end subroutine begin_stage

   !> Make places relative to a datum.
   pure subroutine subtract_datum(self, datum)
      class(bars_type), intent(inout) :: self
      real(wp), intent(in) :: datum(2)
      integer :: l
      do l = 1, n_bolts(self)
         associate (bolt => self%bolts(l))
            bolt%place = bolt%place - spread(datum, 2, size(bolt%block))
            bolt%origin = bolt%origin - spread(datum, 2, size(bolt%block))
            call forget_step(bolt)
         end associate
      end do
   end subroutine subtract_datum

   !> Place, axial force, slip, largest share of a strength, and state of all nodes.
   pure subroutine show_nodes(self, context, place, force, slip, use, state)
      class(bars_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      real(wp), intent(out) :: place(:, :)                 !! (2, nodes) [length]
      real(wp), intent(out) :: force(:), slip(:), use(:)   !! (nodes)
      integer, intent(out) :: state(:)                     !! (nodes) node_state%...
      integer :: first, last, l
      last = 0
      do l = 1, n_bolts(self)
         first = last + 1
         last = last + self%bolts(l)%bar%n
         if (self%bolts(l)%is_measured) then
            call show_nodes_of(self%bolts(l), place(:, first:last), force(first:last), slip(first:last), &
                               use(first:last), state(first:last))
         else
            call show_nodes_of(measured(self%bolts(l), context), place(:, first:last), force(first:last), &
                               slip(first:last), use(first:last), state(first:last))
         end if
      end do
   end subroutine show_nodes

   !> Of each bolt: largest axial force along it, force at its head, largest force of a dowel; and the stored energy.
   pure subroutine show_bolts(self, context, largest, head, dowel, stored)
      class(bars_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      real(wp), intent(out) :: largest(:), head(:), dowel(:)   !! (bolts)
      real(wp), intent(out) :: stored                          !! [energy]
      real(wp) :: of_one
      integer :: l
      stored = 0
      do l = 1, n_bolts(self)
         if (self%bolts(l)%is_measured) then
            call show_forces_of(self%bolts(l), largest(l), head(l), dowel(l), of_one)
         else
            call show_forces_of(measured(self%bolts(l), context), largest(l), head(l), dowel(l), of_one)
         end if
         stored = stored + of_one
      end do
   end subroutine show_bolts

   !> A bolt that is not measured: before the first step, and after a checkpoint has been loaded.
   pure type(bolt_type) function measured(bolt, context)
      type(bolt_type), intent(in) :: bolt
      type(step_context_type), intent(in) :: context
      measured = bolt
      call measure_between(context%state%active, measured)
   end function measured

   !> Places and blocks at the start of the step.
   subroutine prepare(self, context, attempt, equations)
      class(bars_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(equations_type), intent(inout) :: equations
      integer :: l
      self%first_link = equations%n_links
      do l = 1, n_bolts(self)
         call equations%add_links(links_of(self%bolts(l)), self%bolts(l)%first_link)
         if (.not. self%bolts(l)%is_measured) call measure_bolt(context%state%active, self%bolts(l))
         call join_bolt(self%bolts(l), context%state%active, equations)
      end do
   end subroutine prepare

   !> Begin an attempt: linearise at the start of the step.
   subroutine begin(self, context, attempt)
      class(bars_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      integer :: changes, unsettled, l
      self%level = attempt%scheme%level
      do l = 1, n_bolts(self)
         associate (bolt => self%bolts(l))
            if (.not. bolt%is_measured) call measure_between(context%state%active, bolt)
            bolt%is_measured = .false.
            bolt%shift = 0
            bolt%sway = 0
         end associate
      end do
      call self%judge(changes, unsettled)
      do l = 1, n_bolts(self)
         associate (bolt => self%bolts(l))
            bolt%tense = 0
            if (.not. attempt%scheme%is_dynamic) call find_tension(bolt)
         end associate
      end do
   end subroutine begin

   !> Vectors of all links.
   subroutine place(self, context, attempt, equations)
      class(bars_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(equations_type), intent(inout) :: equations
      integer :: l
      do l = 1, n_bolts(self)
         associate (bolt => self%bolts(l))
            if (size(bolt%acting) == 0) cycle
            if (any(attempt%renewed(bolt%crossed))) call place_bolt(bolt, attempt, equations)
         end associate
      end do
   end subroutine place

   !> Stiffness and load of the links, by the tangent of the last round.
   subroutine add_to_links(self, equations)
      class(bars_type), intent(in) :: self
      type(equations_type), intent(inout) :: equations
      integer :: l
      do l = 1, n_bolts(self)
         call add_to_links_of(self%bolts(l), self%level, equations)
      end do
   end subroutine add_to_links

   !> Elongations, displacements of joints, and motion across of all bolts; forces by their laws where they are kept.
   subroutine set_motion(self, equations, change)
      class(bars_type), intent(inout) :: self
      type(equations_type), intent(in) :: equations
      type(motion_change_type), intent(in) :: change
      integer :: l, n
      do l = 1, n_bolts(self)
         associate (bolt => self%bolts(l))
            if (size(bolt%acting) == 0) cycle
            if (change%to_solution) then
               call predict_bolt(bolt, self%level, equations)
               cycle
            end if
            if (change%keeps) then
               if (.not. bolt%is_found) call find_forces(bolt, near=.true.)
               bolt%kept_chain(:) = bolt%chain
               n = size(bolt%response%f_limit)
               bolt%kept_limits(:n) = bolt%response%f_limit
               bolt%kept_limits(n + 1:) = bolt%response%t_limit
            else
               bolt%is_found = .false.
            end if
            call change%apply(bolt%e, bolt%kept_e)
            call change%apply(bolt%shift, bolt%kept_shift)
            call change%apply(bolt%sway, bolt%kept_sway)
         end associate
      end do
   end subroutine set_motion

   !> Forces by the laws at a fraction of the way.
   subroutine lawful_forces(self, fraction, force)
      class(bars_type), intent(in) :: self
      real(wp), intent(in) :: fraction
      real(wp), intent(inout), contiguous :: force(:, :)
      type(bar_response_type) :: response
      integer :: l
      do l = 1, n_bolts(self)
         call forces_of_links(self%bolts(l), fraction, response, force)
      end do
   end subroutine lawful_forces

   !> Lengths that the expected motion gives otherwise than the solution.
   subroutine measure_placement(self, attempt, equations)
      class(bars_type), intent(in) :: self
      type(attempt_type), intent(in) :: attempt
      type(equations_type), intent(inout) :: equations
      integer :: l
      do l = 1, n_bolts(self)
         call measure_placement_of(self%bolts(l), self%level, attempt, equations)
      end do
   end subroutine measure_placement

   !> Linearise at the present motion; the last round holds where its forces follow the laws there.
   subroutine judge(self, n_changes, n_unsettled)
      class(bars_type), intent(inout) :: self
      integer, intent(out) :: n_changes, n_unsettled
      integer :: l
      n_changes = 0
      do l = 1, n_bolts(self)
         call judge_bolt(self%bolts(l), n_changes)
      end do
      n_unsettled = n_changes
   end subroutine judge

   !> What the bolts do in a step that is accepted: for `add_energies` and `commit`.
   subroutine reach_end(self)
      class(bars_type), intent(inout) :: self
      integer :: l
      do l = 1, n_bolts(self)
         if (size(self%bolts(l)%acting) > 0) call finish_bolt(self%level, self%bolts(l))
      end do
   end subroutine reach_end

   !> Stored energy, and the work of slip, of yield and of breaking.
   subroutine add_energies(self, context, attempt, d, balance)
      class(bars_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      real(wp), intent(in), contiguous :: d(:, :)
      class(energy_balance_type), intent(inout) :: balance
      real(wp) :: work, start, end
      integer :: k, l
      start = 0
      end = 0
      do l = 1, n_bolts(self)
         associate (bolt => self%bolts(l), outcome => self%bolts(l)%outcome)
            if (size(bolt%acting) == 0) cycle
            call balance%add(energy%friction, outcome%slipped)
            work = outcome%work
            do k = 1, size(bolt%sway)
               work = work + force_across(bolt, k, bolt%sway(k))*bolt%sway(k)
            end do
            call balance%add(energy%dissipated, work - (outcome%stored(2) - outcome%stored(1)) - outcome%slipped - &
                             outcome%freed)
            call balance%add(energy%discarded, outcome%freed)
            start = start + outcome%stored(1)
            end = end + outcome%stored(2)
         end associate
      end do
      if (n_bolts(self) == 0) return
      call balance%add(energy%geometry, start - balance%bar_energy)
      balance%bar_energy = end
   end subroutine add_energies

   !> States at the end of the step, and new places.
   subroutine commit(self, context, attempt, d)
      class(bars_type), intent(inout) :: self
      type(step_context_type), intent(inout) :: context
      type(attempt_type), intent(inout) :: attempt
      real(wp), intent(in), contiguous :: d(:, :)
      integer :: b, l, p
      do l = 1, n_bolts(self)
         associate (bolt => self%bolts(l))
            if (size(bolt%acting) > 0) then
               call copy_state(bolt%outcome%state, bolt%state)
               bolt%dowel_slip = bolt%outcome%dowel_slip
               self%work = self%work + [bolt%outcome%slipped, bolt%outcome%yielded, bolt%outcome%freed]
            end if
            do p = 1, merge(size(bolt%block), 0, bolt%is_there)
               b = bolt%block(p)
               if (b > 0) call move_point(d(:, b), context%state%centroid(:, b), context%parameters%exact_rotation, &
                                          bolt%place(:, p))
            end do
            call measure_between(context%state%active, bolt)
         end associate
      end do
   end subroutine commit

   !> Forces on the blocks at their new places.
   subroutine add_forces(self, context, attempt, forces)
      class(bars_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(block_forces_type), intent(inout) :: forces
      integer :: l
      do l = 1, n_bolts(self)
         if (self%bolts(l)%is_measured) then
            call add_forces_of(self%bolts(l))
         else
            call add_forces_of(measured(self%bolts(l), context))
         end if
      end do

   contains

      !> Of one bolt.
      subroutine add_forces_of(bolt)
         type(bolt_type), intent(in) :: bolt
         real(wp) :: dowel, force(2), n(2)
         logical :: shears
         integer :: c, k
         do k = 1, size(bolt%acting) - 1
            force = bolt%chain(k)*bolt%along(:, k)
            call add(bolt, bolt%acting(k), force)
            force = -force
            call add(bolt, bolt%acting(k + 1), force)
         end do
         do c = 1, size(bolt%crossing)
            if (.not. bolt%holds(c)) cycle
            call dowel_response(bolt, bolt%across(c) - bolt%dowel_slip(c), dowel, shears)
            n = direction(bolt, bolt%place, bolt%parts, bolt%crossing(c), bolt%crossing(c) + 1)
            force = dowel*[-n(2), n(1)]
            call add(bolt, bolt%crossing(c), force)
            force = -force
            call add(bolt, bolt%crossing(c) + 1, force)
         end do
      end subroutine add_forces_of

      !> A force on the block of a point.
      subroutine add(bolt, p, force)
         type(bolt_type), intent(in) :: bolt
         integer, intent(in) :: p
         real(wp), intent(in) :: force(2)
         real(wp) :: of_section(2), arm(2)
         if (bolt%block(p) == 0) return
         of_section = force/bolt%spacing
         arm = bolt%place(:, p) - context%state%centroid(:, bolt%block(p))
         call forces%add_force(bolt%block(p), of_section, arm)
      end subroutine add

   end subroutine add_forces

   !> Save or load what lasts of all bolts.
   subroutine exchange_state(self, archive)
      class(bars_type), intent(inout) :: self
      class(state_archive_type), intent(inout) :: archive
      integer :: l
      if (.not. allocated(self%bolts)) allocate (self%bolts(0))
      call archive%section('bars')
      call archive%fixed('work', self%work, 0.0_wp)
      do l = 1, size(self%bolts)
         call archive%section('bar_'//to_string(l))
         call exchange_bolt(archive, self%bolts(l))
         if (.not. archive%saving) call forget_step(self%bolts(l))
      end do
   end subroutine exchange_state

   !> Place, axial force, slip, largest share of a strength, and state of the nodes of a bolt.
   pure subroutine show_nodes_of(bolt, place, force, slip, use, state)
      type(bolt_type), intent(in) :: bolt                     !! measured between steps
      real(wp), intent(out) :: place(:, :)                    !! (2, nodes) [length]
      real(wp), intent(out) :: force(:), slip(:), use(:)      !! (nodes)
      integer, intent(out) :: state(:)                        !! (nodes) node_state%...
      logical :: lost(bolt%bar%n - 1)
      integer :: e, i, t
      do i = 1, bolt%bar%n
         place(:, i) = place_at(bolt, bolt%bar%place(i))
      end do
      force = 0
      slip = 0
      use = 0
      state = node_state%absent
      if (size(bolt%acting) == 0) return
      force = node_forces(bolt%bar, bolt%response)
      state = node_state%elastic
      lost = is_lost(bolt)
      associate (response => bolt%response)
         do t = 1, size(bolt%bar%node)
            if (bolt%bar%element(t) == 0 .or. .not. bolt%state%held(t)) cycle
            i = bolt%bar%node(t)
            slip(i) = response%w(i) - response%at(t)
            use(i) = max(use(i), abs(response%t(t))/slip_limit(bolt, t))
            if (abs(response%t(t)) >= at_limit*slip_limit(bolt, t)) state(i) = node_state%slipping
         end do
         do i = 1, bolt%bar%n
            e = min(i, bolt%bar%n - 1)
            use(i) = min(1.0_wp, max(use(i), maxval(abs(response%f(max(1, i - 1):e))/bolt%bar%yield(max(1, i - 1):e))))
            if (abs(response%f(e)) >= at_limit*bolt%bar%yield(e)) state(i) = node_state%yielding
            if (all(lost(max(1, i - 1):e))) state(i) = node_state%absent
            if (lost(e) .or. .not. bolt%state%broken(e)) cycle
            state(i) = node_state%ruptured
            use(i) = 1
         end do
      end associate
   end subroutine show_nodes_of

   !> Force at which a tie slips.
   pure real(wp) function slip_limit(bolt, tie)
      type(bolt_type), intent(in) :: bolt
      integer, intent(in) :: tie
      slip_limit = bolt%bar%strength(tie)
      if (bolt%state%weak(tie)) slip_limit = bolt%bar%residual*slip_limit
   end function slip_limit

   !> Largest axial force along a bolt, force at its head, largest force of a dowel; and the stored energy.
   pure subroutine show_forces_of(bolt, largest, head, dowel, stored)
      type(bolt_type), intent(in) :: bolt                     !! measured between steps
      real(wp), intent(out) :: largest, head, dowel, stored
      real(wp) :: force, forces(bolt%bar%n)
      logical :: shears
      integer :: c
      largest = 0
      head = 0
      dowel = 0
      stored = 0
      if (size(bolt%acting) == 0) return
      forces = node_forces(bolt%bar, bolt%response)
      largest = forces(maxloc(abs(forces), 1))
      head = forces(1)
      do c = 1, size(bolt%crossing)
         if (.not. bolt%holds(c)) cycle
         call dowel_response(bolt, bolt%across(c) - bolt%dowel_slip(c), force, shears)
         dowel = max(dowel, abs(force))
      end do
      stored = bolt%stored
   end subroutine show_forces_of

   !> What a bolt does in a step: its outcome.
   pure subroutine finish_bolt(level, bolt)
      real(wp), intent(in) :: level
      type(bolt_type), intent(inout) :: bolt           !! what lasts of it stays
      type(bar_state_type) :: old
      real(wp) :: end(size(bolt%block)), across(size(bolt%crossing)), slip(size(bolt%crossing))
      real(wp) :: work, slipped, yielded, stored(2), freed, dowel, before, more(2)
      logical :: changes, shears
      integer :: c
      if (.not. bolt%is_found) call find_forces(bolt)
      work = dot_product(bolt%chain, bolt%e)/level
      stored(1) = bolt%stored
      across = bolt%across + bolt%shift/level
      slip = bolt%dowel_slip
      call find_points(bolt, bolt%e/level, end)
      call respond(bolt%bar, bolt%state, end, bolt%response, near=.true.)
      bolt%is_found = .false.
      call copy_state(bolt%state, bolt%outcome%state)
      call accept(bolt%bar, bolt%response, bolt%outcome%state, slipped, yielded)
      do c = 1, size(bolt%crossing)
         if (.not. bolt%holds(c)) cycle
         call dowel_response(bolt, bolt%across(c) + bolt%shift(c) - bolt%dowel_slip(c), dowel, shears)
         work = work + dowel*bolt%shift(c)/level
         call dowel_response(bolt, across(c) - bolt%dowel_slip(c), dowel, shears)
         if (.not. shears) cycle
         slip(c) = across(c) - dowel/bolt%dowel_stiffness
         yielded = yielded + dowel*(slip(c) - bolt%dowel_slip(c))
      end do
      work = work/bolt%spacing
      freed = 0
      stored(2) = energy_of(bolt, bolt%response, across, slip)
      changes = .not. same_state(bolt%state, bolt%outcome%state)
      do while (changes .or. any(bolt%response%f_limit /= 0) .or. any(bolt%response%t_limit /= 0))
         ! what has broken or weakened lets the rest of the bolt move at once
         call respond(bolt%bar, bolt%outcome%state, end, bolt%response)
         before = stored(2)
         stored(2) = energy_of(bolt, bolt%response, across, slip)
         if (.not. changes) exit
         call copy_state(bolt%outcome%state, old)
         call accept(bolt%bar, bolt%response, bolt%outcome%state, more(1), more(2))
         slipped = slipped + more(1)
         yielded = yielded + more(2)
         freed = freed + (before - stored(2)) - sum(more)/bolt%spacing
         changes = .not. same_state(old, bolt%outcome%state)
      end do
      bolt%outcome%dowel_slip = slip
      bolt%outcome%work = work
      bolt%outcome%slipped = slipped/bolt%spacing
      bolt%outcome%yielded = yielded/bolt%spacing
      bolt%outcome%stored = stored
      bolt%outcome%freed = freed

   contains

      !> Is nothing more broken or weakened?
      pure logical function same_state(a, b)
         type(bar_state_type), intent(in) :: a, b
         same_state = all(a%broken .eqv. b%broken) .and. all(a%weak .eqv. b%weak)
      end function same_state

   end subroutine finish_bolt

   !> Save or load what lasts of a bolt.
   subroutine exchange_bolt(archive, bolt)
      class(state_archive_type), intent(inout) :: archive     !! in a section of the bolt
      type(bolt_type), intent(inout) :: bolt                  !! as drawn
      integer :: n_elements, n_ties, n_points
      n_elements = size(bolt%state%plastic)
      n_ties = size(bolt%state%slip)
      n_points = size(bolt%place, 2)
      call archive%item('is_there', bolt%is_there)
      call archive%item('displacement', bolt%state%w, size(bolt%state%w))
      call archive%item('plastic', bolt%state%plastic, n_elements)
      call archive%item('broken', bolt%state%broken, n_elements)
      call archive%item('slip', bolt%state%slip, n_ties)
      call archive%item('weak', bolt%state%weak, n_ties)
      call archive%item('place', bolt%place, [2, n_points], largest_coordinate)
      call archive%item('origin', bolt%origin, [2, n_points], largest_coordinate)
      call archive%item('dowel_slip', bolt%dowel_slip, size(bolt%dowel_slip))
   end subroutine exchange_bolt

end module rockdda_interaction_bars
