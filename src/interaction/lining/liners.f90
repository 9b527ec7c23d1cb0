! SPDX-License-Identifier: MIT
!> All linings: chains of segments along the wall of an opening (docs/theory.md, "Linings"). One lining is
!> rockdda_interaction_liner; where it lies is found by rockdda_interaction_liner_placing, its links in a step are
!> those of rockdda_interaction_liner_links, what lasts of it is rockdda_interaction_liner_state, what is shown
!> rockdda_interaction_liner_nodes.
module rockdda_interaction_liners
   use rockdda_base_kinds, only : wp
   use rockdda_base_state_archive, only : state_archive_type
   use rockdda_base_strings, only : is_given, to_string
   use rockdda_model_options, only : is_set
   use rockdda_model_regions, only : same_name
   use rockdda_model_stage_options, only : stage_name
   use rockdda_model_state, only : energy, liner_nodes_type
   use rockdda_interaction_attempt, only : attempt_type
   use rockdda_interaction_balance, only : energy_balance_type
   use rockdda_interaction_block_forces, only : block_forces_type
   use rockdda_interaction_joint_strength, only : joint_law_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_elasticity, only : compliance, strain_energy
   use rockdda_interaction_equations, only : equations_type
   use rockdda_interaction_linked_interaction, only : linked_interaction_type
   use rockdda_interaction_liner, only : liner_type, links_of, energy_of
   use rockdda_interaction_liner_friction, only : liner_friction_type, set_dashpots, add_impulses_of, changes_of
   use rockdda_interaction_liner_links, only : join_liner, begin_liner, place_liner, add_to_links_of, predict_liner, &
      forces_of_links, measure_placement_of, judge_liner
   use rockdda_interaction_liner_beam, only : beam_response_type, forces_at, n_sections, respond_beam
   use rockdda_interaction_liner_nodes, only : shares_of_nodes, show_nodes_of
   use rockdda_interaction_liner_placing, only : draw_liner, append_segments, install_liner, harden
   use rockdda_interaction_liner_state, only : finish_liner, commit_liner, add_forces_of, exchange_liner
   implicit none
   private
   public :: liners_type

   type, extends(linked_interaction_type) :: liners_type
      type(liner_type), allocatable :: liners(:)
      type(joint_law_type), allocatable :: laws(:)   !! of the joint materials, of the step
      type(liner_friction_type), private :: friction
      real(wp) :: stored = 0                     !! energy at the end of the last step
      real(wp), private :: level = 1             !! share of the step's motion up to where forces act
   contains
      procedure :: init
      procedure :: add_segments
      procedure :: start
      procedure :: begin_stage
      procedure :: n_nodes
      procedure :: show_nodes
      procedure :: shear_stress
      procedure :: find_peak
      procedure :: stored_energy
      procedure :: count_links
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
      procedure :: tell_changes
      procedure :: begin_friction
      procedure :: improve_friction
      procedure :: add_friction
      procedure :: predict_sliding
      procedure :: add_impulses
      procedure :: reach_end
      procedure :: add_energies
      procedure :: commit
      procedure :: add_forces
      procedure :: exchange_state
   end type liners_type

contains

   !> The linings of a model, on their lines as drawn; none is there yet. The context holds the blocks of the model
   !> alone.
   subroutine init(self, context)
      class(liners_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      integer :: k, n
      if (allocated(self%liners)) deallocate (self%liners)
      n = 0
      if (allocated(context%parameters%liners)) n = size(context%parameters%liners)
      allocate (self%liners(n))
      self%stored = 0
      n = context%blocks%n_blocks
      do k = 1, size(self%liners)
         call draw_liner(context, k, n, self%liners)
         n = n + self%liners(k)%layout%n
      end do
   end subroutine init

   !> Append the segments of all linings, absent, to blocks and state.
   subroutine add_segments(self, context)
      class(liners_type), intent(in) :: self
      type(step_context_type), intent(inout) :: context
      if (n_liners(self) > 0) call append_segments(self%liners, context)
   end subroutine add_segments

   !> Relative to the datum of the run; linings that are there from the start are installed.
   subroutine start(self, context)
      class(liners_type), intent(inout) :: self
      type(step_context_type), intent(inout) :: context
      integer :: k
      do k = 1, n_liners(self)
         associate (liner => self%liners(k))
            if (liner%layout%n == 0) cycle
            liner%layout%path = liner%layout%path - spread(context%state%datum, 2, size(liner%layout%path, 2))
            liner%path = liner%path - spread(context%state%datum, 2, size(liner%path, 2))
         end associate
      end do
      do k = 1, n_liners(self)
         if (self%liners(k)%installs == 0) call install_liner(self%liners, k, context)
      end do
   end subroutine start

   !> Remove and install linings when a stage begins, and take new moduli, under which stress stays. What has gone is
   !> discarded.
   subroutine begin_stage(self, stage, context, balance)
      class(liners_type), intent(inout) :: self
      integer, intent(in) :: stage
      type(step_context_type), intent(inout) :: context
      class(energy_balance_type), intent(inout) :: balance
      real(wp) :: left, lost, c(3, 3)
      integer :: b, i, k, l
      if (n_liners(self) == 0) return
      lost = 0
      do k = 1, n_liners(self)
         associate (liner => self%liners(k))
            if (liner%removes == stage .and. liner%is_there) then
               liner%is_there = .false.
               liner%ties%acts = .false.
               associate (m => context%parameters%block_materials(context%parameters%first_liner_material + k))
                  c = compliance(m%youngs_modulus, m%poisson_ratio, context%parameters%plane_strain)
               end associate
               do b = liner%before + 1, liner%before + liner%layout%n
                  lost = lost + 0.5_wp*dot_product(context%state%velocity(:, b), &
                                                   context%momentum(b, context%state%velocity(:, b))) + &
                         strain_energy(context%state%stress(:, b), c, context%state%area(b))
                  context%state%active(b) = .false.
                  context%state%velocity(:, b) = 0
                  context%state%acceleration(:, b) = 0
                  context%state%stress(:, b) = 0
               end do
            end if
            ! rock that goes, and comes back as it was drawn, is no longer behind the lining
            do l = 1, size(liner%ties)
               if (liner%ties(l)%a == 0) cycle
               if (.not. context%state%active(liner%ties(l)%a)) liner%ties(l)%a = 0
            end do
            do i = 1, size(context%parameters%changes)
               associate (change => context%parameters%changes(i))
                  if (.not. (is_given(change%liner) .and. is_set(change%young) .and. is_given(change%stage))) cycle
                  if (.not. same_name(change%liner, liner%name)) cycle
                  if (.not. same_name(change%stage, stage_name(context%parameters%stages, stage))) cycle
                  call harden(self%laws, context, change%young, liner)
               end associate
            end do
         end associate
      end do
      left = self%stored_energy(context)
      call balance%add(energy%discarded, lost + self%stored - left)
      self%stored = left
      do k = 1, n_liners(self)
         if (self%liners(k)%installs == stage) call install_liner(self%liners, k, context)
      end do
   end subroutine begin_stage

   !> Energy of all linings in the present state.
   pure real(wp) function stored_energy(self, context) result(stored)
      class(liners_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      integer :: k
      stored = 0
      do k = 1, n_liners(self)
         stored = stored + energy_of(self%laws, context, self%liners(k))
      end do
   end function stored_energy

   !> Number of linings; before `init` there are none.
   pure integer function n_liners(self)
      class(liners_type), intent(in) :: self
      n_liners = 0
      if (allocated(self%liners)) n_liners = size(self%liners)
   end function n_liners

   !> Nodes of all linings.
   pure integer function n_nodes(self) result(n)
      class(liners_type), intent(in) :: self
      integer :: k
      n = 0
      if (.not. allocated(self%liners)) return
      do k = 1, n_liners(self)
         n = n + self%liners(k)%layout%n
      end do
   end function n_nodes

   !> Place, forces and state of all nodes.
   pure subroutine show_nodes(self, context, nodes)
      class(liners_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(liner_nodes_type), intent(out) :: nodes
      integer :: first, k, last
      allocate (nodes%place(2, self%n_nodes()), nodes%force(3, self%n_nodes()), nodes%sides(4, self%n_nodes()), &
                nodes%back(2, self%n_nodes()), nodes%section(6, self%n_nodes()), nodes%use(self%n_nodes()), &
                nodes%state(self%n_nodes()))
      last = 0
      do k = 1, n_liners(self)
         first = last + 1
         last = last + self%liners(k)%layout%n
         call show_nodes_of(self%laws, context, self%liners, k, nodes%place(:, first:last), &
                            nodes%force(:, first:last), nodes%sides(:, first:last), nodes%back(:, first:last), &
                            nodes%section(:, first:last), nodes%state(first:last))
         nodes%use(first:last) = shares_of_nodes(self%liners(k), nodes%force(2, first:last), &
                                                 nodes%sides(:, first:last), nodes%section(:, first:last), &
                                                 nodes%state(first:last))
      end do
   end subroutine show_nodes

   !> Largest mean shear stress in the middle of a beam of a lining, 0 where it is not there [force/length^2].
   pure real(wp) function shear_stress(self, k) result(largest)
      class(liners_type), intent(in) :: self
      integer, intent(in) :: k                   !! the lining
      real(wp) :: forces(3, size(self%liners(k)%joints))
      largest = 0
      if (.not. self%liners(k)%is_there) return
      forces = middle_forces(self%liners(k))
      largest = maxval([0.0_wp, abs(forces(3, :))/self%liners(k)%section%thickness])
   end function shear_stress

   !> N, M and Q in the middle of each beam of a lining.
   pure function middle_forces(liner) result(forces)
      type(liner_type), intent(in) :: liner
      real(wp) :: forces(3, size(liner%joints))
      type(beam_response_type) :: response
      integer :: i
      do i = 1, size(liner%joints)
         associate (joint => liner%joints(i))
            call respond_beam(joint%beam, liner%section, joint%state, joint%d, response)
            forces(:, i) = forces_at(joint%beam, response%f, (n_sections + 1)/2)
         end associate
      end do
   end function middle_forces

   !> The axial force of the beam of a lining that exceeds those of both its neighbours most, the larger one of these,
   !> and the largest of all, without signs [force/length]; 0 without three beams.
   pure subroutine find_peak(self, k, peak, beside, largest)
      class(liners_type), intent(in) :: self
      integer, intent(in) :: k                   !! the lining
      real(wp), intent(out) :: peak, beside, largest
      real(wp) :: n(0:size(self%liners(k)%joints) + 1), forces(3, size(self%liners(k)%joints))
      integer :: i, m
      peak = 0
      beside = 0
      largest = 0
      m = size(self%liners(k)%joints)
      if (m < 3 .or. .not. self%liners(k)%is_there) return
      forces = middle_forces(self%liners(k))
      n(1:m) = abs(forces(1, :))
      ! the first and the last of an open one are no peaks
      n(0) = merge(n(m), huge(1.0_wp), self%liners(k)%layout%closed)
      n(m + 1) = merge(n(1), huge(1.0_wp), self%liners(k)%layout%closed)
      i = maxloc(n(1:m) - max(n(0:m - 1), n(2:)), 1)
      peak = n(i)
      beside = max(n(i - 1), n(i + 1))
      largest = maxval(n(1:m))
   end subroutine find_peak

   !> Four of a beam, one of a tie.
   pure integer function count_links(self) result(n)
      class(liners_type), intent(in) :: self
      integer :: k
      n = 0
      do k = 1, n_liners(self)
         n = n + links_of(self%liners(k))
      end do
   end function count_links

   !> Links at the start of the step.
   subroutine prepare(self, context, attempt, equations)
      class(liners_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(equations_type), intent(inout) :: equations
      integer :: k, n
      n = self%first_link
      do k = 1, n_liners(self)
         self%liners(k)%first_link = n
         if (self%liners(k)%is_there) call join_liner(self%liners(k), context, equations)
         n = n + links_of(self%liners(k))
      end do
   end subroutine prepare

   !> Begin an attempt: linear at the start of the step.
   subroutine begin(self, context, attempt)
      class(liners_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      integer :: changes, k, unsettled
      self%level = attempt%scheme%level
      if (n_liners(self) == 0) return
      do k = 1, n_liners(self)
         if (self%liners(k)%is_there) call begin_liner(self%liners(k), self%laws, self%level, attempt%scheme)
      end do
      call set_dashpots(self%liners, self%laws, self%level, context, attempt)
      call self%judge(changes, unsettled)
      do k = 1, n_liners(self)
         self%liners(k)%ties%changes = 0
      end do
   end subroutine begin

   !> Vectors of all links.
   subroutine place(self, context, attempt, equations)
      class(liners_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(equations_type), intent(inout) :: equations
      integer :: k
      do k = 1, n_liners(self)
         if (self%liners(k)%is_there) call place_liner(self%liners(k), context, attempt, equations)
      end do
   end subroutine place

   !> Stiffness and load of the links, linear at the motion of the last round.
   subroutine add_to_links(self, equations)
      class(liners_type), intent(in) :: self
      type(equations_type), intent(inout) :: equations
      integer :: k
      do k = 1, n_liners(self)
         if (self%liners(k)%is_there) call add_to_links_of(self%liners(k), self%level, equations)
      end do
   end subroutine add_to_links

   !> Changes of deformation.
   subroutine predict(self, equations)
      class(liners_type), intent(inout) :: self
      type(equations_type), intent(in) :: equations
      integer :: k
      do k = 1, n_liners(self)
         if (self%liners(k)%is_there) call predict_liner(self%liners(k), self%level, equations)
      end do
   end subroutine predict

   !> Keep the present motion.
   subroutine keep(self)
      class(liners_type), intent(inout) :: self
      integer :: i, k
      do k = 1, n_liners(self)
         do i = 1, size(self%liners(k)%joints)
            self%liners(k)%joints(i)%kept = self%liners(k)%joints(i)%move
         end do
         do i = 1, size(self%liners(k)%ties)
            self%liners(k)%ties(i)%kept = self%liners(k)%ties(i)%move
         end do
      end do
   end subroutine keep

   !> A motion at a fraction of the way.
   subroutine shorten(self, fraction)
      class(liners_type), intent(inout) :: self
      real(wp), intent(in) :: fraction
      integer :: i, k
      do k = 1, n_liners(self)
         do i = 1, size(self%liners(k)%joints)
            associate (joint => self%liners(k)%joints(i))
               joint%move = joint%kept + fraction*(joint%move - joint%kept)
            end associate
         end do
         do i = 1, size(self%liners(k)%ties)
            associate (tie => self%liners(k)%ties(i))
               tie%move = tie%kept + fraction*(tie%move - tie%kept)
            end associate
         end do
      end do
   end subroutine shorten

   !> Forces by the laws at a fraction of the way.
   subroutine lawful_forces(self, fraction, force)
      class(liners_type), intent(in) :: self
      real(wp), intent(in) :: fraction
      real(wp), intent(inout), contiguous :: force(:, :)
      integer :: k
      do k = 1, n_liners(self)
         if (self%liners(k)%is_there) call forces_of_links(self%liners(k), self%laws, fraction, force)
      end do
   end subroutine lawful_forces

   !> Deformations that the expected motion gives otherwise than the solution.
   subroutine measure_placement(self, context, attempt, equations)
      class(liners_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(equations_type), intent(inout) :: equations
      integer :: k
      do k = 1, n_liners(self)
         if (self%liners(k)%is_there) call measure_placement_of(self%liners(k), self%level, context, equations)
      end do
   end subroutine measure_placement

   !> Linear at the present motion; the last round holds where its forces follow the laws there.
   subroutine judge(self, n_changes, n_unsettled)
      class(liners_type), intent(inout) :: self
      integer, intent(out) :: n_changes, n_unsettled
      integer :: k
      n_changes = 0
      n_unsettled = 0
      do k = 1, n_liners(self)
         if (self%liners(k)%is_there) call judge_liner(self%liners(k), self%laws, n_changes, n_unsettled)
      end do
      n_unsettled = n_unsettled + n_changes
   end subroutine judge

   !> Lines on the ties that changed their state most often in an attempt.
   function tell_changes(self, context, most) result(text)
      class(liners_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      integer, intent(in) :: most              !! lines of a lining
      character(len=:), allocatable :: text
      text = ''
      if (n_liners(self) > 0) text = changes_of(self%liners, context, most)
   end function tell_changes

   !> Begin a search for friction that agrees with the normal forces, while all states stay as they are.
   subroutine begin_friction(self)
      class(liners_type), intent(inout) :: self
      if (n_liners(self) > 0) call self%friction%begin(self%liners)
   end subroutine begin_friction

   !> Compare the friction forces of the last solve with the limits at its motion, and replace them by a better guess.
   subroutine improve_friction(self, to_end, is_enough)
      class(liners_type), intent(inout) :: self
      logical, intent(in) :: to_end          !! as well as a round must be accepted
      logical, intent(out) :: is_enough
      is_enough = .true.
      if (n_liners(self) > 0) call self%friction%improve(self%laws, to_end, self%liners, is_enough)
   end subroutine improve_friction

   !> The friction forces alone, where all states are those of the last solve.
   subroutine add_friction(self, equations)
      class(liners_type), intent(in) :: self
      type(equations_type), intent(inout) :: equations
      if (n_liners(self) > 0) call self%friction%add(self%liners, equations)
   end subroutine add_friction

   !> Motion of the ties that slide, for new friction forces.
   subroutine predict_sliding(self, equations)
      class(liners_type), intent(inout) :: self
      type(equations_type), intent(in) :: equations
      if (n_liners(self) > 0) call self%friction%predict(self%liners, equations)
   end subroutine predict_sliding

   !> Impulses on the blocks by ties that have closed in the step.
   subroutine add_impulses(self, equations, dt, impulse)
      class(liners_type), intent(in) :: self
      type(equations_type), intent(in) :: equations
      real(wp), intent(in) :: dt                             !! step [time]
      real(wp), intent(inout), contiguous :: impulse(:, :)   !! (6, nb)
      if (n_liners(self) > 0) call add_impulses_of(self%liners, self%level, equations, dt, impulse)
   end subroutine add_impulses

   !> What the linings do in a step that is accepted: for `add_energies` and `commit`.
   subroutine reach_end(self, equations)
      class(liners_type), intent(inout) :: self
      type(equations_type), intent(in) :: equations
      integer :: k
      do k = 1, n_liners(self)
         call finish_liner(self%laws, self%level, equations, self%liners(k))
      end do
   end subroutine reach_end

   !> Stored energy, and the work of slip and of breaking.
   subroutine add_energies(self, context, attempt, d, balance)
      class(liners_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      real(wp), intent(in), contiguous :: d(:, :)
      class(energy_balance_type), intent(inout) :: balance
      real(wp) :: start
      integer :: k
      if (n_liners(self) == 0) return
      start = 0
      do k = 1, n_liners(self)
         associate (liner => self%liners(k))
            call balance%add(energy%friction, liner%slipped)
            call balance%add(energy%dissipated, liner%work - (liner%stored(2) - liner%stored(1)) - liner%slipped - &
                             liner%freed)
            call balance%add(energy%discarded, liner%freed)
            start = start + liner%stored(1)
            balance%other_energy = balance%other_energy + liner%stored(2)
         end associate
      end do
      call balance%add(energy%geometry, start - self%stored)
   end subroutine add_energies

   !> States at the end of the step, and places in the rock.
   subroutine commit(self, context, attempt, d)
      class(liners_type), intent(inout) :: self
      type(step_context_type), intent(inout) :: context
      type(attempt_type), intent(inout) :: attempt
      real(wp), intent(in), contiguous :: d(:, :)
      integer :: k
      self%stored = 0
      do k = 1, n_liners(self)
         if (.not. self%liners(k)%is_there) cycle
         call commit_liner(context, d, self%liners(k))
         self%stored = self%stored + self%liners(k)%stored(2)
      end do
   end subroutine commit

   !> Forces on the blocks at their new places.
   subroutine add_forces(self, context, attempt, forces)
      class(liners_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(block_forces_type), intent(inout) :: forces
      integer :: k
      do k = 1, n_liners(self)
         if (self%liners(k)%is_there) call add_forces_of(self%laws, context, self%liners(k), forces)
      end do
   end subroutine add_forces

   !> Save or load what lasts.
   subroutine exchange_state(self, context, archive)
      class(liners_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      class(state_archive_type), intent(inout) :: archive
      integer :: k
      if (.not. allocated(self%liners)) allocate (self%liners(0))
      call archive%section('liners')
      call archive%item('stored', self%stored, -0.5_wp*huge(1.0_wp))
      do k = 1, size(self%liners)
         call exchange_liner(archive, 'liner_'//to_string(k), context%blocks%n_blocks, self%liners(k))
      end do
   end subroutine exchange_state

end module rockdda_interaction_liners
