! SPDX-License-Identifier: MIT
!> All linings: chains of segments along the wall of an opening (docs/theory.md, "Linings"). One lining is
!> rockdda_interaction_liner; where it lies is found by rockdda_interaction_liner_placing, what lasts of it is
!> rockdda_interaction_liner_state, what is shown rockdda_interaction_liner_nodes.
!>
!> A joint of two bodies, beam or tie, has a point on each of them, and axes that turn with the mean rotation of both
!> (beam) or with the segment (tie). With D the way from the first point to the second, its change in a step along an
!> axis n is
!>
!>     n1.D1 - n0.D0 = (n1 + n0)/2 . (D1 - D0) + (n1 - n0).(D1 + D0)/2
!>
!> exactly, linear in the unknowns once the rotations in it are those that are expected.
!>
!> Each round linearises at the motion of the last one, and is repeated until forces follow their laws there.
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
   use rockdda_interaction_finite_rotation, only : moving_block_type, mean_load, mean_displacement
   use rockdda_interaction_time_scheme, only : time_scheme_type
   use rockdda_interaction_liner_ties, only : tie_response_type, tie_state
   use rockdda_interaction_linked_interaction, only : linked_interaction_type, motion_change_type
   use rockdda_interaction_liner, only : liner_type, beam_links, links_of, energy_of, moved_beam, moved_tie, &
      on_segment, &
      first_point, acts, respond, largest_pressure
   use rockdda_interaction_liner_friction, only : liner_friction_type, friction_agreement, set_dashpots, &
      add_impulses_of, changes_of
   use rockdda_interaction_liner_beam, only : beam_response_type, forces_at, n_sections, respond_beam
   use rockdda_interaction_liner_nodes, only : shares_of_nodes, show_nodes_of
   use rockdda_interaction_liner_placing, only : draw_liner, append_segments, install_liner, harden
   use rockdda_interaction_liner_state, only : finish_liner, commit_liner, add_forces_of, exchange_liner
   implicit none
   private
   public :: liners_type

   !> Forces agree with their laws to this share.
   real(wp), parameter :: agreement = 1.0e-8_wp
   !> Rounding of deformations, as a share of them.
   real(wp), parameter :: rounding = 1.0e-13_wp

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
      procedure :: prepare
      procedure :: begin
      procedure :: place
      procedure :: add_to_links
      procedure :: set_motion
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

   !> Links at the start of the step: four of a beam, one of a tie.
   subroutine prepare(self, context, attempt, equations)
      class(liners_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(equations_type), intent(inout) :: equations
      integer :: c, i, k, l
      self%first_link = equations%n_links
      do k = 1, n_liners(self)
         associate (liner => self%liners(k))
            call equations%add_links(links_of(liner), liner%first_link)
            if (.not. liner%is_there) cycle
            c = liner%first_link
            do i = 1, size(liner%joints)
               do l = 1, beam_links
                  call equations%join(c + l, liner%joints(i)%block)
               end do
               c = c + beam_links
            end do
            do i = 1, size(liner%ties)
               associate (tie => liner%ties(i))
                  tie%acts = acts(context, tie)
                  c = c + 1
                  call equations%join(c, merge([tie%a, tie%b], 0, tie%acts))
               end associate
            end do
         end associate
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
      real(wp) :: v(6, 2, 2), line(6, 2, 2)
      integer :: c, i, j, k
      do k = 1, n_liners(self)
         associate (liner => self%liners(k))
            if (.not. liner%is_there) cycle
            c = liner%first_link
            do i = 1, size(liner%joints)
               associate (joint => liner%joints(i), a => liner%joints(i)%block(1), b => liner%joints(i)%block(2))
                  call joint_vectors(attempt%moving(a), attempt%moving(b), on_segment(context, a, joint%arm(:, 1)), &
                                     on_segment(context, b, joint%arm(:, 2)), joint%beam%angle + 0.5_wp* &
                                     (context%state%rotation(a) + context%state%rotation(b)), [0.5_wp, 0.5_wp], &
                                     [.true., .true.], v)
               end associate
               do j = 1, 2
                  line = 0
                  line(:, 1, :) = v(:, j, :)
                  call equations%set_vectors(c + j, line(:, :, 1), line(:, :, 2))
               end do
               line = 0
               line(:, 1, :) = v(:, 1, :)
               call equations%set_vectors(c + 4, line(:, :, 1), line(:, :, 2))
               line = 0
               line(3, 1, 1) = -1
               line(3, 1, 2) = 1
               call equations%set_vectors(c + 3, line(:, :, 1), line(:, :, 2))
               c = c + beam_links
            end do
            do i = 1, size(liner%ties)
               c = c + 1
               associate (tie => liner%ties(i))
                  if (.not. tie%acts) cycle
                  call joint_vectors(attempt%moving(tie%a), attempt%moving(tie%b), first_point(context, tie), &
                                     on_segment(context, tie%b, tie%arm), tie%angle + context%state%rotation(tie%b), &
                                     [0.0_wp, 1.0_wp], [.not. tie%on_rock, .true.], v)
                  v(4, 1, 2) = tie%shape(1)
                  v(5, 2, 2) = tie%shape(2)
                  v(6, 1, 2) = tie%shape(3)
                  call equations%set_vectors(c, v(:, :, 1), v(:, :, 2))
               end associate
            end do
         end associate
      end do
   end subroutine place

   !> Stiffness and load of the links, linear at the motion of the last round.
   subroutine add_to_links(self, equations)
      class(liners_type), intent(in) :: self
      type(equations_type), intent(inout) :: equations
      real(wp) :: f(3), stiffness(2, beam_links), force(2, beam_links), coupling(beam_links)
      integer, parameter :: rows(beam_links) = [1, 2, 3, 4]
      integer :: c, i, k
      do k = 1, n_liners(self)
         associate (liner => self%liners(k))
            if (.not. liner%is_there) cycle
            c = liner%first_link
            do i = 1, size(liner%joints)
               associate (joint => liner%joints(i), t => liner%joints(i)%tangent)
                  f = t%f - matmul(t%stiffness, joint%at)
                  stiffness = 0
                  force = 0
                  stiffness(1, :) = self%level*[t%stiffness(1, 1), t%stiffness(2, 2), t%stiffness(3, 3), 0.0_wp]
                  coupling = self%level*[t%stiffness(1, 2), t%stiffness(2, 3), t%stiffness(3, 1), 0.0_wp]
                  force(1, 1:3) = -f
               end associate
               call equations%set_links(beam_links, rows, c, stiffness, force, coupling)
               c = c + beam_links
            end do
            do i = 1, size(liner%ties)
               c = c + 1
               associate (tie => liner%ties(i))
                  stiffness = 0
                  force = 0
                  if (tie%acts) then
                     stiffness(:, 1) = tie%tangent
                     force(:, 1) = stiffness(:, 1)*tie%at - tie%force
                  end if
                  call equations%set_links(1, [1], c - 1, tie%factor*tie%level*stiffness(:, 1:1), &
                                           tie%factor*force(:, 1:1), [0.0_wp])
               end associate
            end do
         end associate
      end do
   end subroutine add_to_links

   !> Changes of deformation.
   subroutine set_motion(self, equations, change)
      class(liners_type), intent(inout) :: self
      type(equations_type), intent(in) :: equations
      type(motion_change_type), intent(in) :: change
      real(wp) :: motion(2)
      integer :: c, i, j, k
      do k = 1, n_liners(self)
         associate (liner => self%liners(k))
            if (.not. liner%is_there) cycle
            c = liner%first_link
            do i = 1, size(liner%joints)
               associate (joint => liner%joints(i))
                  if (change%to_solution) then
                     do j = 1, 3
                        call equations%link_motion(c + j, motion)
                        joint%move(j) = self%level*motion(1)
                     end do
                  else
                     call change%apply(joint%move, joint%kept)
                  end if
               end associate
               c = c + beam_links
            end do
            do i = 1, size(liner%ties)
               associate (tie => liner%ties(i))
                  c = c + 1
                  if (.not. change%to_solution) then
                     call change%apply(tie%move, tie%kept)
                  else if (tie%acts) then
                     call equations%link_motion(c, motion)
                     tie%move = tie%level*motion
                  else
                     tie%move = 0
                  end if
               end associate
            end do
         end associate
      end do
   end subroutine set_motion

   !> Forces by the laws at a fraction of the way.
   subroutine lawful_forces(self, fraction, force)
      class(liners_type), intent(in) :: self
      real(wp), intent(in) :: fraction
      real(wp), intent(inout), contiguous :: force(:, :)
      type(beam_response_type) :: response
      type(tie_response_type) :: of_tie
      integer :: c, i, k
      do k = 1, n_liners(self)
         associate (liner => self%liners(k))
            if (.not. liner%is_there) cycle
            c = liner%first_link
            do i = 1, size(liner%joints)
               associate (joint => liner%joints(i))
                  call respond_beam(joint%beam, liner%section, joint%state, joint%d + joint%kept + &
                                    fraction*(joint%move - joint%kept), response)
               end associate
               force(:, c + 1:c + beam_links) = 0
               force(1, c + 1:c + 3) = response%f
               c = c + beam_links
            end do
            do i = 1, size(liner%ties)
               c = c + 1
               force(:, c) = 0
               associate (tie => liner%ties(i))
                  if (.not. tie%acts) cycle
                  call respond(self%laws, liner, tie, tie%motion + tie%kept + fraction*(tie%move - tie%kept), of_tie)
               end associate
               force(:, c) = liner%ties(i)%factor*of_tie%force
            end do
         end associate
      end do
   end subroutine lawful_forces

   !> Deformations that the expected motion gives otherwise than the solution.
   subroutine measure_placement(self, context, equations)
      class(liners_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(equations_type), intent(inout) :: equations
      real(wp) :: way(2), d(3), scale, largest
      integer :: c, i, k
      do k = 1, n_liners(self)
         associate (liner => self%liners(k))
            if (.not. liner%is_there) cycle
            ! a link without force among others has lengths that are off by rounding alone
            largest = maxval([0.0_wp, (norm2(liner%joints(i)%tangent%f(1:2)), i=1, size(liner%joints)), &
                              (norm2(liner%ties(i)%force), i=1, size(liner%ties))])
            c = liner%first_link
            do i = 1, size(liner%joints)
               associate (joint => liner%joints(i), a => liner%joints(i)%block(1), b => liner%joints(i)%block(2))
                  d = moved_beam(context, joint, equations%x)
                  scale = max(largest, min(equations%block_force(a), equations%block_force(b)))
                  d = matmul(joint%tangent%stiffness, d - joint%d - joint%move/self%level)
                  if (scale > 0) equations%link_off(c + 1) = norm2(d(1:2))/scale
               end associate
               c = c + beam_links
            end do
            do i = 1, size(liner%ties)
               c = c + 1
               associate (tie => liner%ties(i))
                  if (.not. tie%acts) cycle
                  way = moved_tie(context, tie, equations%x) - tie%motion - tie%move/tie%level
                  scale = max(largest, min(equations%block_force(tie%a), equations%block_force(tie%b)))
                  if (scale > 0) equations%link_off(c) = norm2(tie%tangent*way)/scale
               end associate
            end do
         end associate
      end do
   end subroutine measure_placement

   !> Linear at the present motion; the last round holds where its forces follow the laws there.
   subroutine judge(self, n_changes, n_unsettled)
      class(liners_type), intent(inout) :: self
      integer, intent(out) :: n_changes, n_unsettled
      type(beam_response_type) :: response
      type(tie_response_type) :: of_tie
      real(wp) :: missing(3), scale(3), used(2), largest
      integer :: i, k
      n_changes = 0
      n_unsettled = 0
      do k = 1, n_liners(self)
         associate (liner => self%liners(k))
            if (.not. liner%is_there) cycle
            do i = 1, size(liner%joints)
               associate (joint => liner%joints(i), t => liner%joints(i)%tangent)
                  call respond_beam(joint%beam, liner%section, joint%state, joint%d + joint%move, response)
                  missing = response%f - (t%f + matmul(t%stiffness, joint%move - joint%at))
                  scale = sqrt(joint%beam%flexibility)
                  if (maxval(abs(missing)*scale) > agreement*maxval(abs(response%f)*scale) + rounding*maxval( &
                      (abs(joint%d) + abs(joint%move))*liner%section%modulus/scale)) n_changes = n_changes + 1
                  joint%at = joint%move
                  joint%tangent = response
               end associate
            end do
            largest = largest_pressure(liner)
            do i = 1, size(liner%ties)
               associate (tie => liner%ties(i))
                  if (.not. tie%acts) cycle
                  call respond(self%laws, liner, tie, tie%motion + tie%move, of_tie)
                  used = tie%force + tie%tangent*(tie%move - tie%at)
                  ! one that slides back holds first
                  if (slides(tie%state) .and. slides(of_tie%state) .and. of_tie%force(2)*tie%force(2) < 0) then
                     of_tie%state = merge(tie_state%held, tie_state%at_tension, of_tie%state == tie_state%slides)
                     of_tie%force(2) = of_tie%trial
                     of_tie%stiffness(2) = liner%stiffness(2)*tie%length + tie%drag(2)
                  end if
                  if (of_tie%state /= tie%state) then
                     n_changes = n_changes + 1
                     tie%changes = tie%changes + 1
                  else if (norm2(of_tie%force - used) > friction_agreement*max(norm2(used), tie%length*largest) .and. &
                           of_tie%state /= tie_state%held) then
                     n_unsettled = n_unsettled + 1
                  end if
                  tie%state = of_tie%state
                  tie%force = of_tie%force
                  tie%tangent = of_tie%stiffness
                  tie%at = tie%move
               end associate
            end do
         end associate
      end do
      n_unsettled = n_unsettled + n_changes

   contains

      !> Is the shear force of a tie at its limit?
      pure logical function slides(state)
         integer, intent(in) :: state
         slides = state == tie_state%slides .or. state == tie_state%parts
      end function slides

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

   !> Begin an attempt: no motion, and where in the step ties act. One that is open at the start closes at an unknown
   !> time: its force at the end is an impulse (rockdda_interaction_time_scheme), or it would give energy.
   subroutine begin_liner(liner, laws, level, scheme)
      type(liner_type), intent(inout) :: liner
      type(joint_law_type), allocatable, intent(in) :: laws(:)   !! of the joint materials
      real(wp), intent(in) :: level          !! share of the step's motion up to where forces act
      type(time_scheme_type), intent(in) :: scheme
      type(tie_response_type) :: at_start
      integer :: i, j
      do j = 1, size(liner%joints)
         liner%joints(j)%move = 0
      end do
      do i = 1, size(liner%ties)
         associate (tie => liner%ties(i))
            tie%move = 0
            tie%level = level
            tie%factor = 1
            if (liner%joint == 0 .or. .not. (scheme%second_order .and. tie%acts)) cycle
            call respond(laws, liner, tie, tie%motion, at_start)
            if (at_start%state /= tie_state%open) cycle
            tie%level = 1
            tie%factor = scheme%impact
         end associate
      end do
   end subroutine begin_liner

   !> Derivatives of the components of the way between two points, of which axes turn with shares of the rotations of
   !> their blocks.
   pure subroutine joint_vectors(a, b, x, y, angle, share, rigid, v)
      type(moving_block_type), intent(in) :: a, b
      real(wp), intent(in) :: x(2), y(2)         !! points on both blocks at the start of the step [length]
      real(wp), intent(in) :: angle              !! of the first axis there
      real(wp), intent(in) :: share(2)
      logical, intent(in) :: rigid(2)            !! strains of the block do not move its point: it is a segment
      real(wp), intent(out) :: v(6, 2, 2)        !! unknowns, axes, blocks
      real(wp) :: turn, middle, chord, n(2), mean(2), d(6, 2)
      integer :: j
      turn = share(1)*a%angle + share(2)*b%angle
      middle = angle + 0.5_wp*turn
      chord = 1
      if (abs(turn) > 0) chord = 2*sin(0.5_wp*turn)/turn
      d = reshape([a%d, b%d], [6, 2])
      where (spread(rigid, 1, 3)) d(4:6, :) = 0
      mean = (y - x) + 0.5_wp*(mean_displacement(d(:, 2), y, b) - mean_displacement(d(:, 1), x, a))
      n = [cos(middle), sin(middle)]
      do j = 1, 2
         v(:, j, 1) = -mean_load(cos(0.5_wp*turn)*n, x, a)
         v(:, j, 2) = mean_load(cos(0.5_wp*turn)*n, y, b)
         where (spread(rigid, 1, 3)) v(4:6, j, :) = 0
         v(3, j, :) = v(3, j, :) + share*chord*(-n(2)*mean(1) + n(1)*mean(2))
         n = [-n(2), n(1)]
      end do
   end subroutine joint_vectors

end module rockdda_interaction_liners
