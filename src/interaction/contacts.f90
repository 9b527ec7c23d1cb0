! SPDX-License-Identifier: MIT
!> Contacts: one link per row of the contact table, along the normal of the edge (1) and the edge (2).
!>
!> Which rows exist is found by the search (folder contact); forces and states come from the joint law
!> (rockdda_interaction_joint_law), trial states from rockdda_interaction_open_close.
module rockdda_interaction_contacts
   use rockdda_base_kinds, only : wp
   use rockdda_base_parallel, only : parallel_contacts, piece, n_pieces
   use rockdda_model_analysis_input, only : joint_material_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_state, only : energy
   use rockdda_contact_table, only : contact_table_type, contact_state
   use rockdda_interaction_balance, only : energy_balance_type
   use rockdda_interaction_block_forces, only : block_forces_type
   use rockdda_interaction_contact_law, only : contact_law_type, dilated_gap
   use rockdda_interaction_contact_spring, only : dashpot_coefficient
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_equations, only : equations_type
   use rockdda_interaction_contact_lengths, only : contact_vectors, contact_lengths, move_contacts
   use rockdda_interaction_finite_rotation, only : turns
   use rockdda_interaction_friction_search, only : friction_search_type
   use rockdda_interaction_initial_traction, only : start_with_stress
   use rockdda_interaction_interaction, only : interaction_type
   use rockdda_interaction_joint_law, only : joint_settings_type, joint_end_type, linearise_joint, &
      spring_energy
   use rockdda_interaction_open_close, only : open_close_type
   use rockdda_interaction_ties, only : tie_stiffness, break_ties
   implicit none
   private
   public :: contacts_type, set_stiffness, force_on_a

   !> Lengths below this share of w0 are round-off.
   real(wp), parameter :: round_off = 1.0e-12_wp

   type, extends(interaction_type) :: contacts_type
      type(contact_law_type), allocatable :: laws(:)   !! per joint material
      type(contact_table_type) :: table                !! of this step
      type(joint_settings_type) :: settings            !! of the attempt at hand
      type(open_close_type) :: trial
      type(friction_search_type) :: friction
      integer :: weak_starts(2) = 0                    !! see `start_with_stress`
      logical :: stiffness_is_new = .false.            !! of joints, with this step: forces stay
      real(wp), allocatable, private :: kept_gap(:), kept_slip(:)   !! (>= n) [length]
   contains
      procedure :: count_links
      procedure :: prepare
      procedure :: begin
      procedure :: place
      procedure :: add_to_links
      procedure :: add_friction
      procedure :: predict
      procedure :: predict_sliding
      procedure :: keep
      procedure :: shorten
      procedure :: lawful_forces
      procedure :: measure_placement
      procedure :: judge
      procedure :: foresee
      procedure :: add_energies
      procedure :: commit
      procedure :: add_forces
      procedure :: slip_share
   end type contacts_type

contains

   !> One per row.
   pure integer function count_links(self, context) result(n)
      class(contacts_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      associate (unused => context%dt)
      end associate
      n = self%table%n
   end function count_links

   !> Blocks and stiffness of all rows.
   subroutine prepare(self, context, equations)
      class(contacts_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(equations_type), intent(inout) :: equations
      integer :: p
      logical :: dilates
      dilates = any(self%laws%dilation > 0)
      !$omp parallel do default(none) shared(self, context, equations, dilates) private(p) schedule(static) &
      !$omp if (self%table%n > parallel_contacts)
      do p = 1, n_pieces(self%table%n)
         call prepare_rows((p - 1)*piece + 1, min(p*piece, self%table%n), self, context, dilates, equations)
      end do
      !$omp end parallel do
      if (context%state%step == 0 .and. .not. context%parameters%keeps_old_ways()) &
         call start_with_stress(context, self%laws, self%table, self%weak_starts)
   end subroutine prepare

   !> `prepare` for some of the rows.
   pure subroutine prepare_rows(first, last, self, context, dilates, equations)
      integer, intent(in) :: first, last
      class(contacts_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      logical, intent(in) :: dilates       !! some joint opens as it slips
      type(equations_type), intent(inout) :: equations
      real(wp) :: old(2)
      integer :: a, b, c
      do c = first, last
         a = self%table%block_a(c)
         b = self%table%block_b(c)
         equations%pair(:, self%first_link + c) = [a, b]
         if (.not. self%table%tied(c)) then
            old = [self%table%k_n(c), self%table%k_s(c)]
            call set_stiffness(context%parameters, context%parameters%joint_materials(self%table%joint(c)), &
                               self%table%length(c), self%table%k_n(c), self%table%k_s(c))
            if (self%stiffness_is_new .and. context%parameters%by_length .and. old(1) > 0) &
               call keep_forces(old, self%table, c)
         else if (context%state%step == 0 .or. .not. self%table%k_n(c) > 0) then
            self%table%k_n(c) = tie_stiffness(self%table%station(c), self%table%length(c), &
                                              smaller_modulus(context, a, b), context%state%area(a), &
                                              context%state%area(b))
            self%table%k_s(c) = self%table%k_n(c)
         end if
         ! from here on the gap is that of the springs: what dilation has opened carries no stress
         if (.not. dilates) cycle
         if (self%table%state(c) /= contact_state%open) &
            self%table%gap(c) = self%table%gap(c) &
                                - dilated_gap(self%laws(self%table%joint(c)), self%table%total_slip(c))
      end do
   end subroutine prepare_rows

   !> Stiffness of the springs of one contact: that of its joint material times the length of joint for which it
   !> stands, or the run's, which belongs to a joint of mean length.
   pure subroutine set_stiffness(parameters, material, length, k_n, k_s)
      type(parameters_type), intent(in) :: parameters
      type(joint_material_type), intent(in) :: material
      real(wp), intent(in) :: length       !! [length]
      real(wp), intent(out) :: k_n, k_s    !! normal, shear [force/length]
      k_n = parameters%normal_stiffness
      k_s = parameters%shear_stiffness
      if (.not. parameters%by_length) return
      k_n = k_n/parameters%stiffness_length
      k_s = k_s/parameters%stiffness_length
      if (material%normal_stiffness > 0) k_n = material%normal_stiffness
      if (material%shear_stiffness > 0) then
         k_s = material%shear_stiffness
      else if (material%normal_stiffness > 0) then
         k_s = k_n*(parameters%shear_stiffness/parameters%normal_stiffness)
      end if
      k_n = k_n*length
      k_s = k_s*length
   end subroutine set_stiffness

   !> A closed contact keeps its forces with a new stiffness; the energy of its springs is that of the new ones.
   pure subroutine keep_forces(old, table, c)
      real(wp), intent(in) :: old(2)               !! stiffness before, normal and shear [force/length]
      type(contact_table_type), intent(inout) :: table
      integer, intent(in) :: c                     !! row
      real(wp) :: gap
      if (table%state(c) == contact_state%open) return
      gap = table%gap(c)*(old(1)/table%k_n(c))
      table%offset(c) = table%offset(c) + (table%gap(c) - gap)
      table%gap(c) = gap
      table%shear(c) = table%shear(c)*(old(2)/table%k_s(c))
      table%energy(c) = spring_energy(table%k_n(c), table%k_s(c), table%gap(c), table%shear(c))
   end subroutine keep_forces

   !> The smaller modulus of two blocks.
   pure real(wp) function smaller_modulus(context, a, b)
      class(step_context_type), intent(in) :: context
      integer, intent(in) :: a, b
      associate (materials => context%parameters%block_materials, material => context%blocks%block_material)
         smaller_modulus = min(materials(material(a))%youngs_modulus, materials(material(b))%youngs_modulus)
      end associate
   end function smaller_modulus

   !> Break the ties that have reached their strength.
   pure subroutine break_some(self, parameters)
      class(contacts_type), intent(inout) :: self
      type(parameters_type), intent(in) :: parameters
      real(wp) :: stiffness(2, size(self%laws))   !! of joints [force/length^2]
      integer :: j
      do j = 1, size(self%laws)
         call set_stiffness(parameters, parameters%joint_materials(j), 1.0_wp, stiffness(1, j), stiffness(2, j))
      end do
      call break_ties(self%laws, stiffness, self%table, self%trial%gap)
   end subroutine break_some

   !> Directions of all rows.
   subroutine place(self, context, equations)
      class(contacts_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(equations_type), intent(inout) :: equations
      integer :: c, l
      !$omp parallel do default(none) shared(self, context, equations) private(c, l) schedule(static) &
      !$omp if (self%table%n > parallel_contacts)
      do c = 1, self%table%n
         if (.not. (context%renewed(self%table%block_a(c)) .or. context%renewed(self%table%block_b(c)))) cycle
         l = self%first_link + c
         associate (a => context%moving(self%table%block_a(c)), b => context%moving(self%table%block_b(c)))
            call contact_vectors(self%table, c, a, b, equations%vector_a(:, :, l), equations%vector_b(:, :, l))
         end associate
      end do
      !$omp end parallel do
   end subroutine place

   !> Begin an attempt with the states of the last step.
   subroutine begin(self, context)
      class(contacts_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      self%settings = attempt_settings(context%parameters, context%dt)
      call self%trial%begin(self%table, self%laws, self%settings)
      call set_dashpots(self, context)
   end subroutine begin

   !> Stiffness and margins of an attempt.
   pure type(joint_settings_type) function attempt_settings(parameters, dt) result(settings)
      type(parameters_type), intent(in) :: parameters
      real(wp), intent(in) :: dt   !! step [time]
      settings%close_tolerance = parameters%close_tolerance
      settings%open_tolerance = parameters%open_tolerance
      settings%round_off = round_off*parameters%w0
      settings%peer = parameters%peer_contacts
      settings%dt = dt
   end function attempt_settings

   !> Dashpots of all contacts in a step of this length: a fraction of critical damping of the two blocks.
   pure subroutine set_dashpots(self, context)
      type(contacts_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      real(wp) :: ratio
      integer :: c
      if (.not. any(self%laws%damping_ratio > 0)) return
      do c = 1, self%table%n
         ratio = self%laws(self%table%joint(c))%damping_ratio
         if (.not. ratio > 0) cycle
         associate (mass_a => context%state%mass(self%table%block_a(c)), &
                    mass_b => context%state%mass(self%table%block_b(c)))
            self%trial%joint(c)%normal_drag = dashpot_coefficient(ratio, self%table%k_n(c), mass_a, mass_b)/context%dt
            self%trial%joint(c)%drag = dashpot_coefficient(ratio, self%table%k_s(c), mass_a, mass_b)/context%dt
         end associate
      end do
   end subroutine set_dashpots

   !> Springs, dashpots and friction of the trial states. The links of contacts that stay open or locked since the last
   !> solve of the attempt are as they were.
   subroutine add_to_links(self, equations)
      class(contacts_type), intent(in) :: self
      type(equations_type), intent(inout) :: equations
      real(wp) :: stiffness(2), force(2)
      integer :: c
      !$omp parallel do default(none) shared(self, equations) private(c, stiffness, force) schedule(static) &
      !$omp if (self%table%n > parallel_contacts)
      do c = 1, self%table%n
         if (self%trial%joint(c)%state == self%trial%state_used(c) .and. &
             self%trial%joint(c)%state /= contact_state%sliding) cycle
         call linearise_joint(self%trial%joint(c), stiffness, force)
         call equations%set_link(self%first_link + c, stiffness, force)
      end do
      !$omp end parallel do
   end subroutine add_to_links

   !> The friction forces alone, where all states are those of the last solve.
   subroutine add_friction(self, equations)
      class(contacts_type), intent(in) :: self
      type(equations_type), intent(inout) :: equations
      integer :: c, i, l
      !$omp parallel do default(none) shared(self, equations) private(c, i, l) if (self%friction%n > parallel_contacts)
      do i = 1, self%friction%n
         c = self%friction%rows(i)
         l = self%first_link + c
         call equations%set_link(l, equations%stiffness(:, l), &
                                 [equations%force(1, l), -self%trial%joint(c)%slip_sign*self%trial%joint(c)%friction])
      end do
      !$omp end parallel do
   end subroutine add_friction

   !> Predicted gap and slip of every contact.
   subroutine predict(self, equations)
      class(contacts_type), intent(inout) :: self
      type(equations_type), intent(in) :: equations
      integer :: c
      !$omp parallel do default(none) shared(self, equations) private(c) if (self%table%n > parallel_contacts)
      do c = 1, self%table%n
         call predict_contact(self%table%gap(c), equations, self%first_link + c, self%trial%gap(c), self%trial%slip(c))
      end do
      !$omp end parallel do
   end subroutine predict

   !> The same for the contacts whose friction forces are searched for.
   subroutine predict_sliding(self, equations)
      class(contacts_type), intent(inout) :: self
      type(equations_type), intent(in) :: equations
      integer :: c, i
      !$omp parallel do default(none) shared(self, equations) private(c, i) if (self%friction%n > parallel_contacts)
      do i = 1, self%friction%n
         c = self%friction%rows(i)
         call predict_contact(self%table%gap(c), equations, self%first_link + c, self%trial%gap(c), self%trial%slip(c))
      end do
      !$omp end parallel do
   end subroutine predict_sliding

   !> Gap and slip of the contact of link l for the solution x.
   pure subroutine predict_contact(start_gap, equations, l, gap, slip)
      real(wp), intent(in) :: start_gap   !! [length]
      type(equations_type), intent(in) :: equations
      integer, intent(in) :: l
      real(wp), intent(out) :: gap, slip  !! [length]
      associate (xa => equations%x(:, equations%pair(1, l)), xb => equations%x(:, equations%pair(2, l)))
         gap = start_gap + along(equations%vector_a(:, 1, l), xa, equations%vector_b(:, 1, l), xb)
         slip = along(equations%vector_a(:, 2, l), xa, equations%vector_b(:, 2, l), xb)
      end associate
   end subroutine predict_contact

   !> v . x + w . y: two sums of six, which a register of two numbers adds up.
   pure real(wp) function along(v, x, w, y)
      real(wp), intent(in) :: v(6), x(6), w(6), y(6)
      real(wp) :: t(2)
      t = ((v(1:2)*x(1:2) + v(3:4)*x(3:4)) + v(5:6)*x(5:6)) + ((w(1:2)*y(1:2) + w(3:4)*y(3:4)) + w(5:6)*y(5:6))
      along = t(1) + t(2)
   end function along

   !> Keep gaps and slips.
   subroutine keep(self)
      class(contacts_type), intent(inout) :: self
      integer :: c, n
      n = self%table%n
      if (allocated(self%kept_gap)) then
         if (size(self%kept_gap) < n) deallocate (self%kept_gap, self%kept_slip)
      end if
      if (.not. allocated(self%kept_gap)) allocate (self%kept_gap(n + n/4), self%kept_slip(n + n/4))
      !$omp parallel do default(none) shared(self, n) private(c) schedule(static) if (n > parallel_contacts)
      do c = 1, n
         self%kept_gap(c) = self%trial%gap(c)
         self%kept_slip(c) = self%trial%slip(c)
      end do
      !$omp end parallel do
   end subroutine keep

   !> Gaps and slips at a fraction of the way from those that were kept.
   subroutine shorten(self, fraction)
      class(contacts_type), intent(inout) :: self
      real(wp), intent(in) :: fraction
      integer :: c
      do c = 1, self%table%n
         self%trial%gap(c) = self%kept_gap(c) + fraction*(self%trial%gap(c) - self%kept_gap(c))
         self%trial%slip(c) = self%kept_slip(c) + fraction*(self%trial%slip(c) - self%kept_slip(c))
      end do
   end subroutine shorten

   !> Forces by the joint laws at a fraction of the way.
   subroutine lawful_forces(self, fraction, force)
      class(contacts_type), intent(in) :: self
      real(wp), intent(in) :: fraction
      real(wp), intent(inout), contiguous :: force(:, :)
      call self%trial%forces_between(self%table, self%laws, self%settings, fraction, self%kept_gap, self%kept_slip, &
                                     force(:, self%first_link + 1:self%first_link + self%table%n))
   end subroutine lawful_forces

   !> Gaps of closed contacts, and slips of locked ones, that the expected motion gives otherwise than the solution.
   subroutine measure_placement(self, context, equations)
      class(contacts_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(equations_type), intent(inout) :: equations
      real(wp) :: off(2), force, scale
      integer :: a, b, c
      !$omp parallel do default(none) shared(self, context, equations) private(a, b, c, off, force, scale) &
      !$omp schedule(static) if (self%table%n > parallel_contacts)
      do c = 1, self%table%n
         if (self%trial%joint(c)%state == contact_state%open) cycle
         a = self%table%block_a(c)
         b = self%table%block_b(c)
         if (.not. (turns(equations%x(:, a)) .or. turns(equations%x(:, b)) .or. &
                    abs(context%moving(a)%angle) > 0 .or. abs(context%moving(b)%angle) > 0)) cycle
         off = contact_lengths(self%table, c, context%moved(a), context%moved(b)) &
               - [self%trial%gap(c) + (self%table%distance(c) - self%table%gap(c)), self%trial%slip(c)]
         force = self%table%k_n(c)*abs(off(1))
         if (self%trial%joint(c)%state == contact_state%locked) force = max(force, self%table%k_s(c)*abs(off(2)))
         scale = max(self%table%k_n(c)*abs(self%trial%gap(c)), &
                     min(equations%block_force(a), equations%block_force(b)))
         if (scale > 0) equations%link_off(self%first_link + c) = force/scale
      end do
      !$omp end parallel do
   end subroutine measure_placement

   !> Judge all contacts. Whether their forces are settled is decided by `trial%count_unsettled`.
   subroutine judge(self, n_changes, n_unsettled)
      class(contacts_type), intent(inout) :: self
      integer, intent(out) :: n_changes, n_unsettled
      real(wp) :: worst_friction
      call self%trial%judge(self%table, self%laws, self%settings, n_changes, worst_friction)
      n_unsettled = 0
   end subroutine judge

   !> First states and friction forces of a step from a motion that was predicted, not solved for.
   subroutine foresee(self)
      class(contacts_type), intent(inout) :: self
      call self%trial%foresee(self%table, self%laws, self%settings)
   end subroutine foresee

   !> Springs, friction, dashpots and changes of state of an accepted step.
   subroutine add_energies(self, context, d, balance)
      class(contacts_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      real(wp), intent(in), contiguous :: d(:, :)
      class(energy_balance_type), intent(inout) :: balance
      real(wp) :: carried, friction, dissipated, discarded, geometry, stored
      integer :: p, n, column, c
      associate (unused => context%dt, not_used => d)
      end associate
      n = n_pieces(self%table%n)
      call balance%make_room(self%table%n)
      !$omp parallel do default(none) shared(self, balance, n) private(p) schedule(static) &
      !$omp if (self%table%n > parallel_contacts)
      do p = 1, n
         call measure_contacts(self, (p - 1)*piece + 1, min(p*piece, self%table%n), balance%sums(:, p))
      end do
      !$omp end parallel do
      carried = sum(balance%sums(1, 1:n))
      friction = sum(balance%sums(2, 1:n))
      dissipated = sum(balance%sums(3, 1:n))
      discarded = sum(balance%sums(4, 1:n))
      geometry = sum(balance%sums(5, 1:n))
      stored = sum(balance%sums(6, 1:n))
      ! closed contacts that the search no longer found
      discarded = discarded + (balance%contact_energy - carried)
      balance%contact_energy = stored
      balance%step_discarded = discarded
      balance%most_given = 0
      do column = 1, 2
         if (n == 0) exit
         p = maxloc(balance%sums(5 + 2*column, 1:n), dim=1)
         c = nint(balance%sums(6 + 2*column, p))
         if (c > 0) balance%most_given(:, column) = [balance%sums(5 + 2*column, p), real(self%table%block_a(c), wp), &
                                                     real(self%table%block_b(c), wp), self%table%point(:, c)]
      end do
      call balance%add(energy%friction, friction)
      call balance%add(energy%dissipated, dissipated)
      call balance%add(energy%discarded, discarded)
      call balance%add(energy%geometry, geometry)
   end subroutine add_energies

   !> The part of `add_energies` for some of the contacts.
   pure subroutine measure_contacts(self, first, last, sums)
      type(contacts_type), intent(in) :: self
      integer, intent(in) :: first, last
      !> carried, friction, dissipated, discarded, geometry, stored; what the contact that gives most by a change of
      !> state gives and its number, the same by geometry
      real(wp), intent(out) :: sums(10)
      type(joint_end_type) :: after
      real(wp) :: x1, s1, start, before, carried, friction, dissipated, discarded, geometry, stored, worst(4), gained
      integer :: c
      logical :: was_closed, dilates
      carried = 0
      friction = 0
      dissipated = 0
      discarded = 0
      geometry = 0
      stored = 0
      worst = 0
      dilates = any(self%laws%dilation > 0)
      do c = first, last
         was_closed = self%table%state(c) /= contact_state%open
         start = self%table%energy(c)
         associate (joint => self%trial%joint(c), x0 => self%trial%joint(c)%gap, s0 => self%trial%joint(c)%shear, &
                    kn => self%trial%joint(c)%k_n, ks => self%trial%joint(c)%k_s)
            before = 0
            if (was_closed) before = spring_energy(kn, ks, x0, s0)
            carried = carried + start
            geometry = geometry + (before - start)
            if (before - start > worst(3)) worst(3:4) = [before - start, real(c, wp)]
            if (self%trial%state_used(c) == contact_state%open) then
               discarded = discarded + before
               cycle
            end if
            x1 = self%trial%gap(c)
            call self%trial%find_end(c, after)
            s1 = after%shear
            if (was_closed .or. x0 < 0) then
               dissipated = dissipated + 0.5_wp*kn*(x1 - x0)**2
               if (.not. was_closed) then
                  discarded = discarded - 0.5_wp*kn*x0**2
                  if (0.5_wp*kn*x0**2 > worst(1)) worst(1:2) = [0.5_wp*kn*x0**2, real(c, wp)]
               end if
            else
               dissipated = dissipated + (kn*x1*(x1 - x0) - 0.5_wp*kn*x1**2)
            end if
            dissipated = dissipated + joint%normal_drag*(x1 - x0)*(x1 - x0)
            if (self%trial%state_used(c) == contact_state%locked) then
               dissipated = dissipated + 0.5_wp*ks*(s1 - s0)**2
               dissipated = dissipated + joint%drag*(s1 - s0)*(s1 - s0)
            else
               friction = friction + self%trial%sign_used(c)*self%trial%friction_used(c)*self%trial%slip(c) - &
                          0.5_wp*ks*(s1**2 - s0**2)
            end if
            stored = stored + after%energy
            if (.not. dilates) cycle
            gained = dilation_energy(self%laws(self%table%joint(c)), kn, x1, joint%total_slip, after%slipped)
            friction = friction - gained
            stored = stored + gained
         end associate
      end do
      sums = [carried, friction, dissipated, discarded, geometry, stored, worst]
   end subroutine measure_contacts

   !> Energy that the normal spring gains when a slip opens the joint: what it presses apart. Dilation takes it from the
   !> shear work, so that friction dissipates the less.
   pure real(wp) function dilation_energy(law, kn, gap, slip_before, slipped) result(gained)
      type(contact_law_type), intent(in) :: law
      real(wp), intent(in) :: kn              !! [force/length]
      real(wp), intent(in) :: gap             !! of the spring at the end of the step [length]
      real(wp), intent(in) :: slip_before, slipped   !! summed up, and in the step [length]
      real(wp) :: opened
      gained = 0
      if (.not. law%dilation > 0) return
      opened = dilated_gap(law, slip_before + slipped) - dilated_gap(law, slip_before)
      gained = 0.5_wp*kn*((gap - opened)**2 - gap**2)
   end function dilation_energy

   !> The table becomes that of the step's end. What the springs gain by dilation is theirs from here on.
   subroutine commit(self, context, d)
      class(contacts_type), intent(inout) :: self
      type(step_context_type), intent(inout) :: context
      real(wp), intent(in), contiguous :: d(:, :)
      real(wp), allocatable :: before(:)
      integer :: c
      if (any(self%laws%dilation > 0)) before = self%table%total_slip(1:self%table%n)
      call self%trial%commit(self%table)
      call move_contacts(self%trial%gap, context%state%centroid, d, context%parameters%exact_rotation, self%table)
      if (any(context%parameters%joint_materials%tie)) call break_some(self, context%parameters)
      if (.not. allocated(before)) return
      do c = 1, self%table%n
         if (self%trial%state_used(c) == contact_state%open) cycle
         self%table%energy(c) = self%table%energy(c) + dilation_energy(self%laws(self%table%joint(c)), &
                                self%table%k_n(c), self%trial%gap(c), before(c), self%table%total_slip(c) - before(c))
      end do
   end subroutine commit

   !> Forces of the springs, and friction, where the contacts are now.
   subroutine add_forces(self, context, forces)
      class(contacts_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(block_forces_type), intent(inout) :: forces
      real(wp) :: force(2), point(2)
      integer :: a, b, c
      associate (table => self%table)
         do c = 1, table%n
            if (table%state(c) == contact_state%open) cycle
            a = table%block_a(c)
            b = table%block_b(c)
            force = force_on_a(table, c)
            point = table%point(:, c)
            if (table%station(c) == 0) point = context%state%vertices(:, table%vertex(c))
            call forces%add_force(a, force, point - context%state%centroid(:, a))
            call forces%add_force(b, -force, point - context%state%centroid(:, b))
         end do
      end associate
   end subroutine add_forces

   !> Share of friction in the work of the contacts in the step that has just been committed.
   pure real(wp) function slip_share(self) result(share)
      class(contacts_type), intent(in) :: self
      real(wp) :: along, across, slipped, all_work
      integer :: c
      slipped = 0
      all_work = 0
      associate (table => self%table, trial => self%trial)
         do c = 1, table%n
            if (table%state(c) == contact_state%open) cycle
            across = abs(table%normal_force(c)*(trial%gap(c) - table%gap(c)))
            along = abs(table%shear_force(c)*trial%slip(c))
            all_work = all_work + across + along
            if (table%state(c) == contact_state%sliding) slipped = slipped + along
         end do
      end associate
      share = 0
      if (all_work > 0) share = slipped/all_work
   end function slip_share

   !> Force of a contact on its block_a: compression along the outward normal of the edge, shear along the edge.
   pure function force_on_a(table, c) result(force)
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: c       !! row
      real(wp) :: force(2)
      associate (n => table%normal(:, c))
         ! the tangent is the normal turned by +90 degrees: normal = (t2, -t1)
         force = table%normal_force(c)*n + table%shear_force(c)*[-n(2), n(1)]
      end associate
   end function force_on_a

end module rockdda_interaction_contacts
