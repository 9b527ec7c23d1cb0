! SPDX-License-Identifier: MIT
!> Contacts: one link per row of the contact table, along the normal of the edge (1) and the edge (2).
!>
!> Which rows exist is found by the search (folder contact); forces and states come from the joint law
!> (rockdda_interaction_joint_response), trial states from rockdda_interaction_open_close.
module rockdda_interaction_contacts
   use, intrinsic :: iso_c_binding, only : c_int, c_double, c_signed_char
   use rockdda_base_kinds, only : wp, i2
   use rockdda_base_parallel, only : parallel_contacts, piece, n_pieces, n_ranges, range_of
   use rockdda_base_room, only : reserve
   use rockdda_contact_table, only : contact_table_type, contact_state, is_of_interval, other_row
   use rockdda_interaction_attempt, only : attempt_type
   use rockdda_interaction_balance, only : energy_balance_type
   use rockdda_interaction_block_forces, only : block_forces_type
   use rockdda_interaction_contact_end, only : joint_end_type, end_motion => reach_end, &
 find_ends, measure_energies, end_contacts
   use rockdda_interaction_joint_strength, only : joint_law_type
   use rockdda_interaction_contact_lengths, only : place_contacts, measure_lengths
   use rockdda_interaction_contact_start, only : start_contacts, set_dashpots, expect_dilation, &
      joint_stiffness_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_equations, only : equations_type
   use rockdda_interaction_friction_search, only : friction_search_type
   use rockdda_interaction_intervals, only : share_slips, couple_of
   use rockdda_interaction_joint_response, only : joint_settings_type, joint_type, new_joint_settings, &
      linearise_joints
   use rockdda_interaction_linked_interaction, only : linked_interaction_type, motion_change_type
   use rockdda_interaction_time_scheme, only : time_scheme_type
   use rockdda_interaction_open_close, only : open_close_type
   use rockdda_interaction_trial_states, only : at_level
   use rockdda_interaction_striking_ends, only : mark_striking_ends
   implicit none
   private
   public :: contacts_type

   type, extends(linked_interaction_type) :: contacts_type
      type(joint_law_type), allocatable :: laws(:)   !! per joint material
      type(contact_table_type) :: table                !! of this step
      type(joint_settings_type) :: settings            !! of the attempt at hand
      type(open_close_type) :: trial
      type(friction_search_type) :: friction
      integer :: weak_starts(2) = 0                    !! without the whole initial traction: `start_with_stress`
      type(joint_stiffness_type) :: stiffness
      logical :: stiffness_is_new = .false.            !! of joints, with this step: forces stay
      logical :: delays = .false.                      !! dilation opens within the step: `expect_dilation`
      real(wp), allocatable :: kept_gap(:), kept_slip(:)   !! (>= n) of the line search [length]
      real(wp), allocatable :: lean(:, :)              !! (3, >= n) of `share_slips` [length]
      real(wp), allocatable :: twist(:)                !! (>= n) of `share_slips` [length]
      type(joint_end_type), allocatable :: ends(:)     !! (>= n) of `find_ends`
   contains
      procedure :: prepare
      procedure :: begin_slips
      procedure :: begin
      procedure :: place
      procedure :: add_to_links
      procedure :: add_friction
      procedure :: set_motion
      procedure :: predict_sliding
      procedure :: lawful_forces
      procedure :: lawful_forces_of
      procedure :: measure_placement
      procedure :: judge
      procedure :: take_back
      procedure :: foresee
      procedure :: add_energies
      procedure :: commit
      procedure :: add_forces
      procedure :: slip_share
      procedure :: reach_end
      procedure :: add_impulses
      procedure :: has_struck
   end type contacts_type

   interface
      !> Forces of some rows on the blocks of a range, `force_on_a` of rockdda_contact_view and its reaction: in
      !> contact_kernels_shim.c.
      pure subroutine add_contact_forces(first, last, range, state, station, vertex, block_a, block_b, normal_force, &
                                         shear_force, normal, point, lean, vertices, centroid, resultant, &
                                         magnitude) &
         bind(c, name='rockdda_add_contact_forces')
         import :: c_int, c_double, c_signed_char
         integer(c_int), value :: first, last
         integer(c_int), intent(in) :: range(2)             !! first and last block
         integer(c_signed_char), intent(in) :: state(*), station(*)   !! of all rows, as what follows
         integer(c_int), intent(in) :: vertex(*), block_a(*), block_b(*)
         real(c_double), intent(in) :: normal_force(*), shear_force(*), normal(2, *), point(2, *), lean(3, *)
         real(c_double), intent(in) :: vertices(2, *)       !! of all blocks
         real(c_double), intent(in) :: centroid(2, *)
         real(c_double), intent(inout) :: resultant(3, *)   !! forces and moments
         real(c_double), intent(inout) :: magnitude(*)
      end subroutine add_contact_forces
   end interface

contains

   !> One link per row: blocks and springs.
   subroutine prepare(self, context, attempt, equations)
      class(contacts_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(equations_type), intent(inout) :: equations
      integer :: c
      logical :: is_same
      call equations%add_links(self%table%n, self%first_link)
      is_same = equations%same_pairs
      !$omp parallel do default(none) shared(self, equations) private(c) reduction(.and.:is_same) schedule(static) &
      !$omp if (self%table%n > parallel_contacts)
      do c = 1, self%table%n
         associate (a => equations%pair(1, self%first_link + c), b => equations%pair(2, self%first_link + c))
            is_same = is_same .and. a == self%table%block_a(c) .and. b == self%table%block_b(c)
            a = self%table%block_a(c)
            b = self%table%block_b(c)
         end associate
      end do
      !$omp end parallel do
      equations%same_pairs = is_same
      call self%stiffness%renew(context%blocks, context%parameters, self%stiffness_is_new)
      call start_contacts(context, attempt, self%laws, self%stiffness, self%stiffness_is_new, self%table)
   end subroutine prepare

   !> One slip for both rows of an interval: until `commit` the table has shear and stiffness of what is closed.
   subroutine begin_slips(self)
      class(contacts_type), intent(inout) :: self
      call share_slips(self%laws, self%table, self%lean, self%twist)
   end subroutine begin_slips

   !> Vectors of all rows, and couples of the shear springs of intervals, for the blocks of which the expected motion is
   !> new.
   subroutine place(self, context, attempt, equations)
      class(contacts_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(equations_type), intent(inout) :: equations
      real(wp) :: load(3)
      integer :: c
      call place_contacts(self%table, self%lean, self%first_link, attempt, equations)
      do c = 1, self%table%n
         if (.not. abs(self%twist(c)) > 0 .or. self%table%station(c) /= 1) cycle
         load = couple_of(self%table, self%twist, c)
         associate (a => self%table%block_a(c), b => self%table%block_b(c))
            equations%block_load(4:6, a) = equations%block_load(4:6, a) + load
            equations%block_load(4:6, b) = equations%block_load(4:6, b) - load
            equations%block_magnitude(4:6, a) = equations%block_magnitude(4:6, a) + abs(load)
            equations%block_magnitude(4:6, b) = equations%block_magnitude(4:6, b) + abs(load)
         end associate
      end do
   end subroutine place

   !> Begin an attempt with the states of the last step.
   subroutine begin(self, context, attempt)
      class(contacts_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      self%settings = new_joint_settings(context%parameters, attempt%dt, attempt%scheme)
      ! blocks that thrust alone will hold would slide off before their joints have opened into hinges
      self%settings%sticks = context%parameters%by_length .and. .not. (attempt%scheme%is_dynamic .or. &
                                                              any(abs(self%table%normal_force(1:self%table%n)) > 0))
      self%laws%sliding_damping = 0
      ! the dashpot of a rebound was not given
      if (attempt%scheme%is_dynamic) where (.not. context%parameters%joint_materials%damping_ratio > 0) &
         self%laws%sliding_damping = context%parameters%sliding_damping
      call self%trial%begin(self%table, self%laws, self%settings)
      if (context%parameters%by_length .and. attempt%scheme%is_dynamic .and. attempt%scheme%second_order) &
         call mark_striking_ends(context, attempt, self%laws, self%table, self%trial%start)
      if (allocated(self%trial%extra)) &
         call set_dashpots(context, attempt, self%laws, self%table, &
                             self%trial%level(self%trial%start(1:self%table%n)), self%trial%extra)
      self%delays = any(self%laws%dilation > 0) .and. self%trial%level(1) < 1
      if (self%delays) call expect_dilation(context, attempt, self%laws, self%table, &
                                              self%trial%level(self%trial%start(1:self%table%n)), &
                                              self%trial%extra, self%trial%gap)
   end subroutine begin

   !> Springs, dashpots and friction of the trial states. The links of contacts that stay open or locked since the last
   !> solve of the attempt are as they were.
   subroutine add_to_links(self, equations)
      class(contacts_type), intent(in) :: self
      type(equations_type), intent(inout) :: equations
      integer :: p
      !$omp parallel do default(none) shared(self, equations) private(p) schedule(static) &
      !$omp if (self%table%n > parallel_contacts)
      do p = 1, n_pieces(self%table%n)
         call add_rows((p - 1)*piece + 1, min(p*piece, self%table%n), self, equations)
      end do
      !$omp end parallel do
   end subroutine add_to_links

   !> `add_to_links` for some of the rows.
   pure subroutine add_rows(first, last, self, equations)
      integer, intent(in) :: first, last               !! at most a piece
      class(contacts_type), intent(in) :: self
      type(equations_type), intent(inout) :: equations
      real(wp) :: stiffness(2, piece), force(2, piece), coupling(piece)
      integer :: rows(piece), c, k, n
      n = 0
      do c = first, last
         if (self%trial%joint(c)%state == self%trial%state_used(c) .and. &
             self%trial%joint(c)%state /= contact_state%sliding .and. &
             .not. (self%trial%joint(c)%partly .or. self%trial%partly_used(c))) cycle
         n = n + 1
         rows(n) = c
      end do
      call linearise_joints(n, rows, self%table, self%trial%joint, self%trial%extra, self%trial%own, self%trial%cross, &
                            self%trial%push, stiffness, force, coupling)
      if (any(abs(self%trial%level - 1) > 0 .or. abs(self%trial%factor - 1) > 0)) then
         do k = 1, n
            c = rows(k)
            associate (factor => self%trial%factor(self%trial%start(c)), level => self%trial%level(self%trial%start(c)))
               stiffness(:, k) = factor*level*stiffness(:, k)
               force(:, k) = factor*force(:, k)
               coupling(k) = factor*level*coupling(k)
            end associate
         end do
      end if
      call equations%set_links(n, rows, self%first_link, stiffness, force, coupling)
   end subroutine add_rows

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
                                 [equations%force(1, l), -self%trial%factor(self%trial%start(c))* &
                                  self%trial%joint(c)%slip_sign*self%trial%joint(c)%friction])
      end do
      !$omp end parallel do
   end subroutine add_friction

   !> Gap and slip of every contact.
   subroutine set_motion(self, equations, change)
      class(contacts_type), intent(inout) :: self
      type(equations_type), intent(in) :: equations
      type(motion_change_type), intent(in) :: change
      integer :: n, p
      n = self%table%n
      if (.not. change%to_solution) then
         call reserve(self%kept_gap, n)
         call reserve(self%kept_slip, n)
         call change%apply(self%trial%gap(:n), self%kept_gap(:n))
         call change%apply(self%trial%slip(:n), self%kept_slip(:n))
         return
      end if
      !$omp parallel do default(none) shared(self, equations, n) private(p) schedule(static) if (n > parallel_contacts)
      do p = 1, n_pieces(n)
         call predict_rows((p - 1)*piece + 1, min(p*piece, n), self, equations)
      end do
      !$omp end parallel do
   end subroutine set_motion

   !> Motion of some of the rows for the solution.
   pure subroutine predict_rows(first, last, self, equations)
      integer, intent(in) :: first, last               !! at most a piece
      class(contacts_type), intent(inout) :: self
      type(equations_type), intent(in) :: equations
      real(wp) :: along(2, piece), level
      integer :: c, l
      l = self%first_link
      call equations%link_motions(l + first, l + last, along)
      if (.not. (any(abs(self%trial%level - 1) > 0) .or. allocated(self%trial%extra))) then
         do c = first, last
            self%trial%gap(c) = self%table%gap(c) + along(1, c - first + 1)
            self%trial%slip(c) = along(2, c - first + 1)
         end do
         return
      end if
      do c = first, last
         level = self%trial%level(self%trial%start(c))
         self%trial%gap(c) = self%table%gap(c) + level*along(1, c - first + 1)
         if (self%delays) self%trial%gap(c) = self%trial%gap(c) + self%trial%extra(c)%late
         self%trial%slip(c) = level*along(2, c - first + 1)
      end do
   end subroutine predict_rows

   !> Predict gap and slip of the contacts whose friction forces the open-close loop iterates.
   subroutine predict_sliding(self, equations)
      class(contacts_type), intent(inout) :: self
      type(equations_type), intent(in) :: equations
      integer :: c, d, i
      !$omp parallel do default(none) shared(self, equations) private(c, d, i) if (self%friction%n > parallel_contacts)
      do i = 1, self%friction%n
         c = self%friction%rows(i)
         call predict_row(c)
         ! friction follows from the gaps of both rows of an interval: where the other one slides too it is predicted by
         ! itself
         if (.not. is_of_interval(self%table, c)) cycle
         d = other_row(self%table, c)
         if (self%trial%joint(d)%state /= contact_state%sliding) call predict_row(d)
      end do
      !$omp end parallel do

   contains

      !> Predict gap and slip of one of the rows.
      subroutine predict_row(c)
         integer, intent(in) :: c
         call predict_contact(self%table%gap(c), self%trial%level(self%trial%start(c)), equations, &
                              self%first_link + c, self%trial%gap(c), self%trial%slip(c))
         if (self%delays) self%trial%gap(c) = self%trial%gap(c) + self%trial%extra(c)%late
      end subroutine predict_row

   end subroutine predict_sliding

   !> Gap and slip of the contact of link l for the solution x, where its forces act.
   pure subroutine predict_contact(start_gap, level, equations, l, gap, slip)
      real(wp), intent(in) :: start_gap   !! [length]
      real(wp), intent(in) :: level       !! share of the motion of the step
      type(equations_type), intent(in) :: equations
      integer, intent(in) :: l
      real(wp), intent(out) :: gap, slip  !! [length]
      real(wp) :: along(2)
      call equations%link_motion(l, along)
      gap = start_gap + level*along(1)
      slip = level*along(2)
   end subroutine predict_contact

   !> Forces by the joint laws at a fraction of the way.
   subroutine lawful_forces(self, fraction, force)
      class(contacts_type), intent(in) :: self
      real(wp), intent(in) :: fraction
      real(wp), intent(inout), contiguous :: force(:, :)
      call self%trial%forces_between(self%table, self%laws, self%settings, fraction, self%kept_gap, self%kept_slip, &
                                     force(:, self%first_link + 1:self%first_link + self%table%n))
      call weigh_impacts(self, 1, self%table%n, force)
   end subroutine lawful_forces

   !> `lawful_forces` of runs of rows.
   subroutine lawful_forces_of(self, runs, fraction, force)
      class(contacts_type), intent(in) :: self
      integer, intent(in) :: runs(:, :)                    !! (2, n) first and last row, at most a piece of them
      real(wp), intent(in) :: fraction
      real(wp), intent(inout), contiguous :: force(:, :)
      integer :: i
      call self%trial%forces_between(self%table, self%laws, self%settings, fraction, self%kept_gap, self%kept_slip, &
                                     force(:, self%first_link + 1:self%first_link + self%table%n), runs)
      do i = 1, size(runs, 2)
         call weigh_impacts(self, runs(1, i), runs(2, i), force)
      end do
   end subroutine lawful_forces_of

   !> Multiply the forces of some rows by their factors in the equations.
   pure subroutine weigh_impacts(self, first, last, force)
      class(contacts_type), intent(in) :: self
      integer, intent(in) :: first, last                   !! rows
      real(wp), intent(inout), contiguous :: force(:, :)   !! (2, >= links)
      integer :: c
      if (abs(self%settings%impact - 1) <= 0) return
      do c = first, last
         force(:, self%first_link + c) = self%trial%factor(self%trial%start(c))*force(:, self%first_link + c)
      end do
   end subroutine weigh_impacts

   !> Gaps of closed contacts, and slips of locked ones, that the expected motion gives otherwise than the solution.
   subroutine measure_placement(self, context, attempt, was_judged, mixed_only, equations)
      class(contacts_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      logical, intent(in) :: was_judged       !! states are those of a judgement, not of the last solve
      logical, intent(in) :: mixed_only       !! only contacts of which one block alone is renewed
      type(equations_type), intent(inout) :: equations
      call measure_lengths(self%table, self%lean, self%trial, self%first_link, context, attempt, was_judged, &
                           mixed_only, equations)
   end subroutine measure_placement

   !> Closed contacts at the end of the step, from their motion there.
   subroutine reach_end(self, scheme, closed_part_slips)
      class(contacts_type), intent(inout) :: self
      type(time_scheme_type), intent(in) :: scheme
      logical, intent(in) :: closed_part_slips          !! in static steps
      if (scheme%second_order) call end_motion(self%trial, self%table, self%laws, self%settings)
      call find_ends(self%trial, self%laws, self%table, self%twist, closed_part_slips .and. .not. scheme%is_dynamic, &
                     self%ends)
   end subroutine reach_end

   !> Impulses on the blocks by contacts that have closed in the step or are in a blow.
   subroutine add_impulses(self, equations, dt, impulse)
      class(contacts_type), intent(in) :: self
      type(equations_type), intent(in) :: equations
      real(wp), intent(in) :: dt                             !! step [time]
      real(wp), intent(inout), contiguous :: impulse(:, :)   !! (6, nb)
      type(joint_type) :: joint
      type(joint_end_type) :: last(1)
      real(wp) :: p(2)
      integer :: c, l
      do c = 1, self%table%n
         if (all(self%trial%start(c) /= [at_level%closes, at_level%blow])) cycle
         if (self%trial%state_used(c) == contact_state%open) cycle
         call self%trial%find_ends(self%table, c, c, last)
         call self%trial%recall(self%table, c, joint)
         p = dt*[self%trial%force_used(self%table, c), last(1)%shear_force]
         if (allocated(self%trial%extra)) p(1) = p(1) - dt*self%trial%drag_used(self%table, c)
         if (self%trial%state_used(c) == contact_state%locked) p(2) = p(2) - dt*joint%drag*self%trial%slip(c)
         l = self%first_link + c
         call equations%add_link_force(l, p, impulse)
      end do
   end subroutine add_impulses

   !> Has the open end of an interval struck in the step (rockdda_interaction_striking_ends), a blow that is more than
   !> what the interval bore before? Asked before the step is taken over.
   pure logical function has_struck(self)
      class(contacts_type), intent(in) :: self
      integer :: c
      has_struck = .true.
      do c = 1, self%table%n
         if (self%table%station(c) /= 1 .or. self%trial%start(c) /= at_level%strikes) cycle
         if (self%trial%state_used(c) == contact_state%open) cycle
         if (self%trial%force_used(self%table, c) + self%trial%force_used(self%table, c + 1) > &
             2*sum(self%table%normal_force(c:c + 1))) return
      end do
      has_struck = .false.
   end function has_struck

   !> Judge all contacts. Whether their forces are settled is decided by `count_unsettled`.
   subroutine judge(self, n_changes, n_unsettled)
      class(contacts_type), intent(inout) :: self
      integer, intent(out) :: n_changes, n_unsettled
      call self%trial%judge(self%table, self%laws, self%settings, n_changes)
      n_unsettled = 0
   end subroutine judge

   !> Back to the states, friction forces and bonds of the last solve, as if they had not been judged.
   subroutine take_back(self)
      class(contacts_type), intent(inout) :: self
      integer :: c
      !$omp parallel do default(none) shared(self) private(c) schedule(static) if (self%table%n > parallel_contacts)
      do c = 1, self%table%n
         associate (joint => self%trial%joint(c), state => self%trial%state_used(c), &
                    sign => self%trial%sign_used(c))
            if (joint%state /= state .or. (state == contact_state%sliding .and. joint%slip_sign /= sign)) &
               self%trial%changes(c) = self%trial%changes(c) - 1_i2
            joint%state = state
            joint%slip_sign = sign
            joint%friction = self%trial%friction_used(c)
            joint%bonded = self%trial%bonded_used(c)
            joint%partly = self%trial%partly_used(c)
            if (joint%partly) then
               self%trial%own(c) = self%trial%own_used(c)
               self%trial%cross(c) = self%trial%cross_used(c)
               self%trial%push(c) = self%trial%push_used(c)
            end if
         end associate
      end do
      !$omp end parallel do
   end subroutine take_back

   !> First states and friction forces of a step from a motion that was predicted, not solved for.
   subroutine foresee(self)
      class(contacts_type), intent(inout) :: self
      call self%trial%foresee(self%table, self%laws, self%settings)
   end subroutine foresee

   !> Springs, friction, dashpots and changes of state of an accepted step.
   subroutine add_energies(self, context, attempt, d, balance)
      class(contacts_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      real(wp), intent(in), contiguous :: d(:, :)
      class(energy_balance_type), intent(inout) :: balance
      call measure_energies(self%trial, self%laws, self%table, self%twist, self%ends, d, self%settings%windows_rules, &
                            balance)
   end subroutine add_energies

   !> The table becomes that of the step's end.
   subroutine commit(self, context, attempt, d)
      class(contacts_type), intent(inout) :: self
      type(step_context_type), intent(inout) :: context
      type(attempt_type), intent(inout) :: attempt
      real(wp), intent(in), contiguous :: d(:, :)
      call end_contacts(self%trial, self%laws, self%stiffness, context, attempt, d, self%ends, self%table)
   end subroutine commit

   !> Forces of the springs, and friction, where the contacts are now.
   subroutine add_forces(self, context, attempt, forces)
      class(contacts_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(block_forces_type), intent(inout) :: forces
      integer :: p, ranges
      ranges = n_ranges(self%table%n > parallel_contacts)
      !$omp parallel do default(none) shared(self, context, forces, ranges) private(p) schedule(static) if (ranges > 1)
      do p = 1, ranges
         call add_forces_to(range_of(p, ranges, context%blocks%n_blocks), self%table, self%lean, context, forces)
      end do
      !$omp end parallel do
   end subroutine add_forces

   !> `add_forces` for a range of blocks.
   pure subroutine add_forces_to(ends, table, lean, context, forces)
      integer, intent(in) :: ends(2)                 !! first and last block
      type(contact_table_type), intent(in) :: table
      real(wp), intent(in), contiguous :: lean(:, :) !! (3, >= rows) of `share_slips` [length]
      type(step_context_type), intent(in) :: context
      type(block_forces_type), intent(inout) :: forces
      call add_contact_forces(1, table%n, ends, table%state, table%station, table%vertex, table%block_a, &
                              table%block_b, table%normal_force, table%shear_force, table%normal, table%point, lean, &
                              context%state%vertices, context%state%centroid, forces%resultant, forces%magnitude)
   end subroutine add_forces_to

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

end module rockdda_interaction_contacts
