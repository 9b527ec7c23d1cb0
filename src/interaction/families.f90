! SPDX-License-Identifier: MIT
!> The list of families: everything that acts on blocks, in the order in which it is added up.
!>
!> A new family of the program is one more component, one more line in `family`, and `n_own` one higher. Others can be
!> added to a run from outside with `add`; they come last.
module rockdda_interaction_families
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : diagnostics_type
   use rockdda_base_state_archive, only : state_archive_type
   use rockdda_interaction_attempt, only : attempt_type
   use rockdda_interaction_balance, only : energy_balance_type
   use rockdda_interaction_block_forces, only : block_forces_type
   use rockdda_interaction_bars, only : bars_type
   use rockdda_interaction_bolts, only : bolts_type
   use rockdda_interaction_boundaries, only : boundaries_type
   use rockdda_interaction_joint_strength, only : new_joint_laws, act_along_length
   use rockdda_interaction_contacts, only : contacts_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_elasticity, only : elasticity_type
   use rockdda_interaction_equations, only : equations_type
   use rockdda_interaction_held_forces, only : held_forces_type
   use rockdda_interaction_inertia, only : inertia_type
   use rockdda_interaction_initial_traction, only : start_with_stress
   use rockdda_interaction_interaction, only : interaction_type
   use rockdda_interaction_kinematics, only : mass_matrix
   use rockdda_interaction_linked_interaction, only : linked_interaction_type, motion_change_type
   use rockdda_interaction_liners, only : liners_type
   use rockdda_interaction_loads, only : loads_type
   use rockdda_interaction_quiet_boundaries, only : quiet_boundaries_type
   use rockdda_interaction_supports, only : supports_type
   use rockdda_interaction_water, only : water_family_type
   use rockdda_interaction_water_at_start, only : pressure_on_contacts, pressure_on_edges
   use rockdda_linear_small_blocks, only : factorize_block, solve_block
   implicit none
   private
   public :: families_type

   !> Number of families of the program: as many as `family` has cases.
   integer, parameter :: n_own = 12

   !> A family that was added.
   type :: added_family_type
      class(interaction_type), allocatable :: item
   end type added_family_type

   type :: families_type
      type(contacts_type) :: contacts
      type(inertia_type) :: inertia
      type(elasticity_type) :: elasticity
      type(loads_type) :: loads
      type(supports_type) :: supports
      type(bolts_type) :: bolts
      type(boundaries_type) :: boundaries
      type(quiet_boundaries_type) :: quiet
      type(held_forces_type) :: held
      type(water_family_type) :: water
      type(bars_type) :: bars
      type(liners_type) :: liners
      type(added_family_type), allocatable, private :: added(:)
   contains
      procedure :: init
      procedure :: add
      procedure :: count => count_families
      procedure :: family
      procedure, private :: linked
      procedure :: prepare
      procedure :: begin
      procedure :: place
      procedure :: add_to_links
      procedure :: predict
      procedure :: keep
      procedure :: shorten
      procedure :: lawful_forces
      procedure :: measure_placement
      procedure :: judge
      procedure :: add_energies
      procedure :: add_moved_energies
      procedure :: add_forces
      procedure :: reach_end
      procedure :: commit
      procedure :: exchange_state
   end type families_type

contains

   !> The families of a run at time 0, whose blocks, numbers and state are in the context; they add to it where line
   !> loads act and which blocks are held. What is wrong with the numbers was found before.
   subroutine init(self, context, attempt)
      class(families_type), intent(inout) :: self
      type(step_context_type), intent(inout) :: context
      type(attempt_type), intent(in) :: attempt
      type(diagnostics_type) :: known
      real(wp), allocatable :: pressure(:, :)   !! of water at time 0
      associate (blocks => context%blocks, parameters => context%parameters)
         call new_joint_laws(parameters%joint_materials, self%contacts%laws, known)
         if (parameters%by_length) call act_along_length(parameters%joint_materials, self%contacts%laws)
         call self%elasticity%init(parameters)
         call self%loads%init(blocks, parameters, context%line_ends, known)
         call self%supports%init(blocks, parameters)
         call self%bolts%init(blocks%bolts)
         call self%bars%init(context)
         call self%liners%init(context)
         self%liners%laws = self%contacts%laws
         call self%water%init(blocks, parameters, known)
         call self%water%begin(context, attempt)
         call pressure_on_edges(self%water, blocks, parameters, pressure)
         call self%boundaries%init(blocks, parameters, context%initial_stress, context%state%active, known, pressure)
         call self%quiet%init(blocks, parameters, self%boundaries%edges)
         context%held = self%boundaries%springs%held_blocks(blocks%n_blocks)
      end associate
   end subroutine init

   !> Family i of the list.
   function family(self, i) result(item)
      class(families_type), intent(in), target :: self
      integer, intent(in) :: i
      class(interaction_type), pointer :: item
      select case (i)
      case (1); item => self%contacts
      case (2); item => self%inertia
      case (3); item => self%elasticity
      case (4); item => self%loads
      case (5); item => self%supports
      case (6); item => self%bolts
      case (7); item => self%boundaries
      case (8); item => self%quiet
      case (9); item => self%held
      case (10); item => self%water
      case (11); item => self%bars
      case (12); item => self%liners
      case default; item => self%added(i - n_own)%item
      end select
   end function family

   !> Family i of the list where it has links, none otherwise.
   function linked(self, i) result(item)
      class(families_type), intent(in), target :: self
      integer, intent(in) :: i
      class(linked_interaction_type), pointer :: item
      class(interaction_type), pointer :: any_item
      any_item => self%family(i)
      item => null()
      select type (any_item)
      class is (linked_interaction_type)
         item => any_item
      end select
   end function linked

   !> Number of families.
   pure integer function count_families(self) result(n)
      class(families_type), intent(in) :: self
      n = n_own
      if (allocated(self%added)) n = n + size(self%added)
   end function count_families

   !> One more family, at the end of the list.
   subroutine add(self, item)
      class(families_type), intent(inout) :: self
      class(interaction_type), intent(in) :: item
      type(added_family_type), allocatable :: longer(:)
      integer :: i, n
      n = self%count() - n_own
      allocate (longer(n + 1))
      do i = 1, n
         call move_alloc(self%added(i)%item, longer(i)%item)
      end do
      allocate (longer(n + 1)%item, source=item)
      call move_alloc(longer, self%added)
   end subroutine add

   !> Links of all families for the geometry at the start of a step; the graph of the equations is then to be set.
   subroutine prepare(self, context, attempt, equations)
      class(families_type), intent(inout), target :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(equations_type), intent(inout) :: equations
      class(linked_interaction_type), pointer :: item
      integer :: i
      if (self%liners%n_nodes() > 0) self%liners%laws = self%contacts%laws
      call equations%set_size(context%blocks%n_blocks, 0)
      equations%same_pairs = .true.
      do i = 1, self%count()
         item => self%linked(i)
         if (.not. associated(item)) cycle
         call item%prepare(context, attempt, equations)
         ! families of others may set pairs by themselves
         if (i > n_own) equations%same_pairs = .false.
      end do
      if (context%state%step == 0 .and. .not. context%parameters%has_legacy_rules()) &
         call stress_contacts(self, context, attempt)
      call self%contacts%begin_slips()
      call self%quiet%field%take_joints(context, attempt, self%contacts%laws, self%contacts%table)
   end subroutine prepare

   !> Contacts at time 0 begin with the stress of the blocks, less the water that acts in the first stage.
   subroutine stress_contacts(self, context, attempt)
      class(families_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      real(wp), allocatable :: pressure(:)
      call self%water%begin(context, attempt)
      call pressure_on_contacts(self%water, context, self%contacts%table, pressure)
      call start_with_stress(context, self%contacts%laws, self%contacts%table, self%contacts%weak_starts, pressure)
   end subroutine stress_contacts

   !> Begin an attempt: first trial states.
   subroutine begin(self, context, attempt)
      class(families_type), intent(inout), target :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      class(interaction_type), pointer :: item
      integer :: i
      do i = 1, self%count()
         item => self%family(i)
         call item%begin(context, attempt)
      end do
   end subroutine begin

   !> Vectors of links and terms of blocks for the motion that is expected of the blocks.
   subroutine place(self, context, attempt, equations)
      class(families_type), intent(inout), target :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(equations_type), intent(inout) :: equations
      class(interaction_type), pointer :: item
      integer :: i
      if (all(attempt%renewed)) then
         call equations%clear_blocks()
      else
         call equations%clear_blocks(attempt%renewed)
      end if
      do i = 1, self%count()
         item => self%family(i)
         call item%place(context, attempt, equations)
      end do
   end subroutine place

   !> Stiffness and load of all links in their trial states.
   subroutine add_to_links(self, equations)
      class(families_type), intent(inout), target :: self
      type(equations_type), intent(inout) :: equations
      class(linked_interaction_type), pointer :: item
      integer :: i
      do i = 1, self%count()
         item => self%linked(i)
         if (associated(item)) call item%add_to_links(equations)
      end do
   end subroutine add_to_links

   !> Motion of all links for the solution x.
   subroutine predict(self, equations)
      class(families_type), intent(inout) :: self
      type(equations_type), intent(in) :: equations
      call set_motion(self, equations, motion_change_type(to_solution=.true.))
   end subroutine predict

   !> Keep the present motion.
   subroutine keep(self, equations)
      class(families_type), intent(inout) :: self
      type(equations_type), intent(in) :: equations
      call set_motion(self, equations, motion_change_type(keeps=.true.))
   end subroutine keep

   !> Replace the present motion by one between that which was kept (fraction 0) and itself (1).
   subroutine shorten(self, equations, fraction)
      class(families_type), intent(inout) :: self
      type(equations_type), intent(in) :: equations
      real(wp), intent(in) :: fraction
      call set_motion(self, equations, motion_change_type(fraction=fraction))
   end subroutine shorten

   !> Change the motion of all links.
   subroutine set_motion(self, equations, change)
      class(families_type), intent(inout), target :: self
      type(equations_type), intent(in) :: equations
      type(motion_change_type), intent(in) :: change
      class(linked_interaction_type), pointer :: item
      integer :: i
      do i = 1, self%count()
         item => self%linked(i)
         if (associated(item)) call item%set_motion(equations, change)
      end do
   end subroutine set_motion

   !> Forces that all links would have at such a motion if they followed their laws there, or, of contacts, those of
   !> some runs of rows.
   subroutine lawful_forces(self, fraction, force, runs)
      class(families_type), intent(in), target :: self
      real(wp), intent(in) :: fraction
      real(wp), intent(inout), contiguous :: force(:, :)   !! (2, >= links)
      integer, intent(in), optional :: runs(:, :)          !! (2, n) first and last row, at most a piece of them
      class(linked_interaction_type), pointer :: item
      integer :: i, first
      first = 1
      if (present(runs)) then
         call self%contacts%lawful_forces_of(runs, fraction, force)
         first = 2
      end if
      do i = first, self%count()
         item => self%linked(i)
         if (associated(item)) call item%lawful_forces(fraction, force)
      end do
   end subroutine lawful_forces

   !> How far lengths by the expected motion are off at the solution x: forces that come from lengths which both give
   !> differently, as a share of the link's own force, or of the load (with inertia) of the less loaded of its blocks if
   !> that is larger: link_off of the links of a family, and block_off, which is only to be raised.
   subroutine measure_placement(self, context, attempt, was_judged, mixed_only, equations)
      class(families_type), intent(in), target :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      logical, intent(in) :: was_judged     !! states of contacts are those of a judgement, not of the last solve
      logical, intent(in) :: mixed_only     !! of contacts only those of which one block alone is renewed
      type(equations_type), intent(inout) :: equations
      call equations%clear_placement()
      call self%contacts%measure_placement(context, attempt, was_judged, mixed_only, equations)
      call self%supports%measure_placement(context, attempt, equations)
      call self%bolts%measure_placement(context, attempt, equations)
      call self%boundaries%springs%measure_placement(context, attempt, equations)
      call self%water%measure_placement(context, attempt, equations)
      call self%bars%measure_placement(attempt, equations)
      call self%liners%measure_placement(context, equations)
   end subroutine measure_placement

   !> Trial states by the present motion.
   subroutine judge(self, n_changes, n_unsettled)
      class(families_type), intent(inout), target :: self
      integer, intent(out) :: n_changes, n_unsettled
      integer :: changes, unsettled
      class(linked_interaction_type), pointer :: item
      integer :: i
      n_changes = 0
      n_unsettled = 0
      do i = 1, self%count()
         item => self%linked(i)
         if (.not. associated(item)) cycle
         call item%judge(changes, unsettled)
         n_changes = n_changes + changes
         n_unsettled = n_unsettled + unsettled
      end do
   end subroutine judge

   !> From the motion of links where their forces act to that of the end of the step; velocity jumps of blocks by
   !> contacts that have closed in it.
   subroutine reach_end(self, context, attempt, equations)
      class(families_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(inout) :: attempt
      type(equations_type), intent(in) :: equations
      real(wp) :: l(6, 6)
      integer :: i
      logical :: ok
      call self%bars%reach_end()
      call self%liners%reach_end(equations)
      if (attempt%scheme%second_order) then
         attempt%jump = 0
         call self%contacts%add_impulses(equations, attempt%dt, attempt%jump)
         call self%liners%add_impulses(equations, attempt%dt, attempt%jump)
         do i = 1, context%blocks%n_blocks
            if (context%state%asleep(i)) attempt%jump(:, i) = 0
            if (.not. any(abs(attempt%jump(:, i)) > 0)) cycle
            call factorize_block(mass_matrix(context%state%mass(i), context%state%area(i), &
                                             context%state%moments(:, i)), l, ok)
            if (ok) call solve_block(l, attempt%jump(:, i))
         end do
      end if
      call self%contacts%reach_end(attempt%scheme, context%parameters%closed_part_slips)
   end subroutine reach_end

   !> Energies of an accepted step, before anything is changed.
   subroutine add_energies(self, context, attempt, d, balance)
      class(families_type), intent(in), target :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      real(wp), intent(in), contiguous :: d(:, :)   !! (6, nb)
      class(energy_balance_type), intent(inout) :: balance
      class(interaction_type), pointer :: item
      integer :: i
      do i = 1, self%count()
         item => self%family(i)
         call item%add_energies(context, attempt, d, balance)
      end do
   end subroutine add_energies

   !> Energies that depend on the moved blocks: kinetic and strain energy.
   subroutine add_moved_energies(self, context, balance)
      class(families_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      class(energy_balance_type), intent(inout) :: balance
      call self%inertia%add_moved_energies(context, balance)
      call self%elasticity%add_moved_energies(context, balance)
   end subroutine add_moved_energies

   !> Take the state of the end of an accepted step.
   subroutine commit(self, context, attempt, d)
      class(families_type), intent(inout), target :: self
      type(step_context_type), intent(inout) :: context
      type(attempt_type), intent(inout) :: attempt
      real(wp), intent(in), contiguous :: d(:, :)   !! (6, nb)
      class(interaction_type), pointer :: item
      integer :: i
      do i = 1, self%count()
         item => self%family(i)
         call item%commit(context, attempt, d)
      end do
   end subroutine commit

   !> Forces on the moved blocks.
   subroutine add_forces(self, context, attempt, forces)
      class(families_type), intent(inout), target :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(block_forces_type), intent(inout) :: forces
      class(interaction_type), pointer :: item
      integer :: i
      do i = 1, self%count()
         item => self%family(i)
         call item%add_forces(context, attempt, forces)
      end do
   end subroutine add_forces

   !> Save or load what families keep from step to step, beside the contact table and the state of the blocks. What is
   !> loaded is checked by `archive%check`: shapes, and ranges of numbers. Families that were added are not in
   !> checkpoints.
   subroutine exchange_state(self, context, archive)
      class(families_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context   !! its blocks and numbers have been checked
      class(state_archive_type), intent(inout) :: archive
      call self%quiet%field%exchange_state(archive)
      call self%held%exchange_state(context, archive)
      call self%bars%exchange_state(archive)
      call self%liners%exchange_state(context, archive)
   end subroutine exchange_state

end module rockdda_interaction_families
