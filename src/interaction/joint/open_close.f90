! SPDX-License-Identifier: MIT
!> Trial states of the contacts of a step: the open-close iteration judges each by the motion of the last solve.
!>
!> Whether a contact is open follows from its gap, and that of its partner, here; forces and states of closed contacts
!> come from their law (rockdda_interaction_joint_response). They do not change the contact table.
module rockdda_interaction_open_close
   use rockdda_base_kinds, only : wp, i1, i2, l1
   use rockdda_base_parallel, only : parallel_contacts, n_pieces
   use rockdda_base_runs, only : run_length
   use rockdda_contact_interval_law, only : end_gaps
   use rockdda_contact_table, only : contact_table_type, contact_state, is_of_interval, other_row
   use rockdda_interaction_joint_strength, only : joint_law_type
   use rockdda_interaction_intervals, only : find_extremes, mean_gap, interval_response_type, respond, &
      place_to_linearise
   use rockdda_interaction_joint_response, only : joint_settings_type, joint_state_type, joint_extra_type, &
      joint_type, joint_response_type, map_joint, map_steady, keep_steady, miss_of_joint, spring_force, opening_gap
   use rockdda_interaction_trial_states, only : trial_states_type, no_state, at_level, piece_of_rows, widest_piece
   implicit none
   private
   public :: open_close_type, count_unsettled, largest_normal, closing_gap

   !> A contact that closes after this number of changes in an attempt has opened twice: its shear spring is free.
   integer, parameter :: worn_changes = 3
   !> The closed part of an interval has changed when its stiffness has by more than this share; loads follow smaller
   !> changes with the matrix of the last solve.
   real(wp), parameter :: same_part = 1.0e-3_wp

   !> Trial states and predicted motion of one step's contacts.
   type, extends(trial_states_type) :: open_close_type
   contains
      procedure :: judge
      procedure :: foresee
      procedure :: forces_between
   end type open_close_type

contains

   !> Judge every contact by the predicted gap and slip of the last solve. A contact with a partner uses the
   !> partner's state, which may be new already: these come after all others, in their order.
   subroutine judge(self, table, laws, settings, n_changes)
      class(open_close_type), intent(inout) :: self
      type(contact_table_type), intent(in) :: table
      type(joint_law_type), intent(in) :: laws(:)   !! per joint material
      type(joint_settings_type), intent(in) :: settings
      integer, intent(out) :: n_changes               !! contacts whose state changed
      call judge_all(self, table, laws, settings, .false., n_changes)
   end subroutine judge

   !> First states and friction forces of a step from a motion that was predicted, not solved for; nothing counts as
   !> changed, and bonds are left to the rounds.
   subroutine foresee(self, table, laws, settings)
      class(open_close_type), intent(inout) :: self
      type(contact_table_type), intent(in) :: table
      type(joint_law_type), intent(in) :: laws(:)   !! per joint material
      type(joint_settings_type), intent(in) :: settings
      integer :: n_changes
      call judge_all(self, table, laws, settings, .true., n_changes)
      self%changes(1:table%n) = 0
      self%miss(1:table%n) = 0
      self%state_used(1:table%n) = no_state
   end subroutine foresee

   !> Judge all contacts, or all that are not bonded.
   subroutine judge_all(self, table, laws, settings, spare_bonds, n_changes)
      type(open_close_type), intent(inout) :: self
      type(contact_table_type), intent(in) :: table
      type(joint_law_type), intent(in) :: laws(:)
      type(joint_settings_type), intent(in) :: settings
      logical, intent(in) :: spare_bonds
      integer, intent(out) :: n_changes
      integer :: c, n, n_partners, p
      n = 0
      n_partners = 0
      !$omp parallel do default(none) shared(self, table, laws, settings, spare_bonds) private(p) schedule(static) &
      !$omp reduction(+:n, n_partners) if (table%n > parallel_contacts)
      do p = 1, n_pieces(table%n)
         call judge_rows(p, self, table, laws, settings, spare_bonds, n, n_partners)
      end do
      !$omp end parallel do
      do c = 1, merge(table%n, 0, n_partners > 0)
         if (spare_bonds .and. self%joint(c)%bonded) cycle
         if (table%partner(c) /= 0) call judge_contact(self, table, laws, settings, c, n)
      end do
      n_changes = n
   end subroutine judge_all

   !> Judge some of the rows, but for those with partners, which are counted.
   pure subroutine judge_rows(p, self, table, laws, settings, spare_bonds, n_changes, n_partners)
      integer, intent(in) :: p                         !! piece
      type(open_close_type), intent(inout) :: self
      type(contact_table_type), intent(in) :: table
      type(joint_law_type), intent(in) :: laws(:)
      type(joint_settings_type), intent(in) :: settings
      logical, intent(in) :: spare_bonds
      integer, intent(inout) :: n_changes, n_partners
      logical(l1) :: steady(widest_piece)
      real(wp) :: lowest(widest_piece), widest(widest_piece), mean(widest_piece), force(2, widest_piece)
      logical :: is_apart
      integer :: c, first, i, judged, k, last, n
      judged = 0
      call piece_of_rows(table, p, first, last)
      n = last - first + 1
      call find_extremes(table, first, last, self%gap(first:last), lowest, widest, mean)
      call map_steady(laws, table, first, settings, self%joint, self%extra, widest(1:n), mean(1:n), &
                      self%gap(first:last), self%slip(first:last), steady(1:n), force(:, 1:n))
      do c = first, last
         k = c - first + 1
         if (self%joint(c)%partly .or. self%joint(c)%strikes .or. self%start(c) == at_level%may_strike) &
            steady(k) = .false.
         if (spare_bonds) steady(k) = steady(k) .and. .not. self%joint(c)%bonded
      end do
      c = first
      do while (c <= last)
         k = c - first + 1
         n = run_length(last - c + 1, steady(k:last - first + 1))
         associate (e => c + n - 1)
            if (steady(k)) then
               call keep_steady(n, table%k_n(c:e), self%gap(c:e), force(:, k:k + n - 1), self%joint(c:e), &
                                self%state_used(c:e), self%sign_used(c:e), self%friction_used(c:e), &
                                self%bonded_used(c:e), self%miss(c:e), self%normal_force(c:e))
               if (any(self%partly_used(c:e))) self%partly_used(c:e) = .false.
            else
               do i = c, e
                  if (spare_bonds .and. self%joint(i)%bonded) cycle
                  if (i == judged) cycle
                  ! an interval that is open and apart at both ends stays so as two contacts do
                  is_apart = self%joint(i)%state == contact_state%open .and. lowest(i - first + 1) >= 0 .and. &
                             .not. (self%joint(i)%partly .or. an_end_strikes(self, table, i))
                  if (.not. is_apart .and. &
                      is_one_contact(widest(i - first + 1), self%joint(i), table%station(i), laws(table%joint(i)), &
                                     self%joint(i)%partly .or. self%start(i) == at_level%may_strike)) then
                     ! both rows at a time
                     judged = i + 1
                     if (table%station(i) == 1) &
                        call judge_interval(self, table, laws(table%joint(i)), settings, i, n_changes)
                     cycle
                  end if
                  self%partly_used(i) = .false.
                  if (table%partner(i) /= 0) then
                     n_partners = n_partners + 1
                  else
                     call judge_contact(self, table, laws, settings, i, n_changes)
                  end if
               end do
            end if
         end associate
         c = c + n
      end do
   end subroutine judge_rows

   !> Is a contact, or an end of the interval of this row, kept open by the law of impact?
   pure logical function an_end_strikes(self, table, c)
      type(open_close_type), intent(in) :: self
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: c                         !! row
      an_end_strikes = self%joint(c)%strikes
      if (is_of_interval(table, c)) an_end_strikes = an_end_strikes .or. self%joint(other_row(table, c))%strikes
   end function an_end_strikes

   !> Is a row one of an interval whose rows are not two contacts by themselves: open, closed on a part, or of a law
   !> that is not linear?
   pure logical function is_one_contact(widest, joint, station, law, is_sure)
      real(wp), intent(in) :: widest                  !! `find_extremes` [length]
      type(joint_state_type), intent(in) :: joint
      integer(i1), intent(in) :: station
      type(joint_law_type), intent(in) :: law
      logical, intent(in) :: is_sure                  !! it is, if it is one of an interval
      is_one_contact = (station == 1 .or. station == 2) .and. .not. joint%tied
      if (is_one_contact) is_one_contact = widest > 0 .or. is_sure .or. joint%strikes .or. &
                                           joint%state == contact_state%open .or. law%normal%is_curved()
   end function is_one_contact

   !> Judge an interval that is open, or closed on a part, or was so in the last solve.
   pure subroutine judge_interval(self, table, law, settings, c, n_changes)
      type(open_close_type), intent(inout) :: self
      type(contact_table_type), intent(in) :: table
      type(joint_law_type), intent(in) :: law
      type(joint_settings_type), intent(in) :: settings
      integer, intent(in) :: c                        !! first row
      integer, intent(inout) :: n_changes
      type(interval_response_type) :: interval, next
      type(joint_type) :: memory
      type(joint_response_type) :: response
      real(wp) :: used(2), bond(2), again(2), at_end(2), place(2), missed
      integer :: old, new, new_sign, i, r
      logical :: is_closed, was_open, is_new, is_stiffer, keeps_matrix, strikes
      was_open = self%joint(c)%state == contact_state%open
      strikes = self%start(c) == at_level%may_strike
      if (strikes) then
         at_end = end_gaps([self%gap_at_end(table, c), self%gap_at_end(table, c + 1)])
         strikes = any(end_gaps(table%gap(c:c + 1)) > 0 .and. at_end < 0) .or. &
                   law%normal%is_stiff_at(minval(at_end), minval(end_gaps(self%gap(c:c + 1))))
      end if
      if (strikes) call self%strike(table, c)
      bond = self%bond(c:c + 1)
      call respond(law, table, c, self%both_bonded(c), self%gap(c:c + 1), settings%open_tolerance, bond, interval)
      is_closed = interval%lowest <= settings%open_tolerance .or. bond(2) > bond(1)
      if (was_open) is_closed = interval%lowest < closing_gap(settings, minval(table%offset(c:c + 1)), &
                                                              logical(any(self%joint(c:c + 1)%strikes)))
      used = 0
      if (.not. was_open) used = [self%spring_force(table, c), self%spring_force(table, c + 1)]
      next = interval
      if (is_closed .and. law%normal%is_curved()) then
         again = bond
         place = place_to_linearise(law, table%k_n(c), self%gap(c:c + 1), used)
         call respond(law, table, c, self%both_bonded(c), place, settings%open_tolerance, again, next)
      end if
      is_new = strikes
      keeps_matrix = is_closed .and. law%normal%is_curved() .and. .not. (was_open .or. strikes)
      do r = c, c + 1
         i = r - c + 1
         associate (joint => self%joint(r))
            old = joint%state
            self%state_used(r) = joint%state
            self%sign_used(r) = joint%slip_sign
            self%friction_used(r) = joint%friction
            self%bonded_used(r) = joint%bonded
            self%partly_used(r) = joint%partly
            self%own_used(r) = self%own(r)
            self%cross_used(r) = self%cross(r)
            self%push_used(r) = self%push(r)
            self%miss(r) = 0
            self%normal_force(r) = 0
            if (.not. was_open) self%normal_force(r) = interval%force(i)
            ! cohesion that holds shear without compression may have no equilibrium, neither open nor closed
            if (is_closed .and. was_open .and. self%changes(r) >= worn_changes) joint%worn = .true.
            call self%recall(table, r, memory)
            memory%length = interval%length
            memory%broken = interval%broken
            new = contact_state%open
            new_sign = 0
            joint%friction = 0
            if (is_closed) then
               call map_joint(law, settings, memory, self%gap(r), self%slip(r), response, interval%pressing)
               new = response%state
               new_sign = response%slip_sign
               joint%bonded = response%bonded
               if (new == contact_state%sliding .and. turns_back(old, int(self%sign_used(r)), response)) then
                  new = contact_state%locked
                  new_sign = 0
                  response%friction = 0
               end if
               ! friction of a contact that closes starts from zero
               if (.not. was_open) joint%friction = response%friction
            else if (.not. was_open) then
               joint%bonded = .false.
               new_sign = 0
            else
               new_sign = self%sign_used(r)
            end if
            if (new == contact_state%sliding .and. old == contact_state%sliding) then
               self%miss(r) = abs(joint%friction - self%friction_used(r))
            end if
            missed = 0
            ! where it opens, all that it had
            if (.not. was_open) missed = abs(interval%force(i) - used(i))
            ! the last solve had it act within the step
            if (strikes) missed = table%k_n(r)*maxval(abs(self%gap(c:c + 1) - table%gap(c:c + 1)))
            if (strikes .and. law%normal%is_curved()) missed = max(missed, maxval(abs(interval%force)))
            if (missed > table%k_n(r)*settings%round_off) self%miss(r) = max(self%miss(r), missed)
            if (new /= old .or. (new == contact_state%sliding .and. new_sign /= self%sign_used(r))) then
               self%miss(r) = max(self%miss(r), miss_of_joint(memory, 0.0_wp, self%slip(r), new, new_sign, &
                                                              joint%friction))
               if (is_closed .eqv. was_open) self%miss(r) = self%miss(r) + abs(interval%force(i))
               n_changes = n_changes + 1
               if (self%changes(r) < huge(1_i2)) self%changes(r) = self%changes(r) + 1_i2
            end if
            is_stiffer = abs(next%own(i) - merge(self%own(r), table%k_n(r), logical(joint%partly))) > &
                         same_part*max(table%k_n(r), merge(next%own(i), 0.0_wp, law%normal%is_curved()))
            keeps_matrix = keeps_matrix .and. .not. is_stiffer
            is_new = is_new .or. (is_closed .and. is_stiffer)
            joint%state = int(new, i1)
            joint%slip_sign = int(new_sign, i1)
            joint%partly = is_closed
            self%own(r) = next%own(i)
            self%cross(r) = next%cross
            self%push(r) = next%push(i)
         end associate
      end do
      if (keeps_matrix) then
         ! the matrix stays: the forces are right at this place, with the stiffness that it has
         self%own(c:c + 1) = merge(self%own_used(c:c + 1), table%k_n(c:c + 1), self%partly_used(c:c + 1))
         self%cross(c:c + 1) = merge(self%cross_used(c:c + 1), 0.0_wp, self%partly_used(c:c + 1))
         self%push(c:c + 1) = next%force + self%own(c:c + 1)*place + self%cross(c)*place([2, 1])
      end if
      ! bonds break for good
      self%bond(c:c + 1) = bond
      if (is_new) n_changes = n_changes + 1
   end subroutine judge_interval

   !> Did a contact slide, and would it slide the other way? It locks first: where nothing else holds two blocks, both
   !> friction forces would drive them to and fro for ever.
   pure logical function turns_back(old, sign_used, response)
      integer, intent(in) :: old, sign_used             !! state and direction in the last solve
      type(joint_response_type), intent(in) :: response
      turns_back = old == contact_state%sliding .and. response%slip_sign /= sign_used .and. response%friction > 0
   end function turns_back

   !> Judge one contact.
   pure subroutine judge_contact(self, table, laws, settings, c, n_changes)
      type(open_close_type), intent(inout) :: self
      type(contact_table_type), intent(in) :: table
      type(joint_law_type), intent(in) :: laws(:)
      type(joint_settings_type), intent(in) :: settings
      integer, intent(in) :: c
      integer, intent(inout) :: n_changes
      type(joint_type) :: memory
      type(joint_response_type) :: response
      real(wp) :: gap, slip
      integer :: old, new, new_sign
      logical :: is_closed
      associate (joint => self%joint(c), friction_used => self%friction_used(c), sign_used => self%sign_used(c))
         old = joint%state
         self%state_used(c) = joint%state
         sign_used = joint%slip_sign
         friction_used = joint%friction
         self%bonded_used(c) = joint%bonded
         self%miss(c) = 0
         self%normal_force(c) = 0
         gap = self%gap(c)
         if (old == contact_state%open .and. gap >= closing_gap(settings, table%offset(c), logical(joint%strikes))) then
            joint%friction = 0
            return
         end if
         slip = self%slip(c)
         call self%recall(table, c, memory)
         is_closed = stays_closed(memory, self%joint, table, laws(table%joint(c)), settings, c, gap, &
                                  self%gap(max(1, table%partner(c))))
         ! cohesion that holds shear without compression may have no equilibrium, neither open nor closed
         if (is_closed .and. old == contact_state%open .and. self%changes(c) >= worn_changes .and. &
             .not. settings%windows_rules) then
            joint%worn = .true.
            call self%recall(table, c, memory)
         end if
         if (is_closed) call map_joint(laws(table%joint(c)), settings, memory, gap, slip, response, &
                                       spring_force(memory%k_n, mean_gap(table, self%gap, c)))
         if (old /= contact_state%open) self%normal_force(c) = spring_force(memory%k_n, gap)
         new = contact_state%open
         new_sign = sign_used
         if (is_closed) then
            new = response%state
            new_sign = response%slip_sign
            joint%bonded = response%bonded
         else if (old /= contact_state%open) then
            new_sign = 0
            joint%bonded = .false.
         end if
         if (table%station(c) > 0 .and. new == contact_state%sliding .and. turns_back(old, int(sign_used), response)) &
            then
            new = contact_state%locked
            new_sign = 0
            response%friction = 0
         end if
         ! the overlap of a motion without the contact says nothing about the force it will carry: friction of a contact
         ! that closes starts from zero
         joint%friction = 0
         if (is_closed .and. old /= contact_state%open) joint%friction = response%friction
         if (new == contact_state%sliding .and. old == contact_state%sliding) then
            self%miss(c) = abs(joint%friction - friction_used)
         end if
         if (new /= old .or. (new == contact_state%sliding .and. new_sign /= sign_used)) then
            if (.not. (settings%windows_rules .and. min(old, new) > 0)) then
               self%miss(c) = miss_of_joint(memory, gap, slip, new, new_sign, joint%friction)
               if (self%miss(c) < self%doubt*sqrt(memory%k_n)) then   ! as it was
                  joint%friction = friction_used
                  joint%bonded = self%bonded_used(c)
                  return
               end if
               n_changes = n_changes + 1
            end if
            if (self%changes(c) < huge(1_i2)) self%changes(c) = self%changes(c) + 1_i2
         end if
         joint%state = int(new, i1)
         joint%slip_sign = int(new_sign, i1)
      end associate
   end subroutine judge_contact

   !> Forces that all contacts, or runs of them, would have at the fraction a of the way from a motion to the present
   !> one if they followed their laws there, for any trial states.
   subroutine forces_between(self, table, laws, settings, a, gap, slip, force, runs)
      class(open_close_type), intent(in) :: self
      type(contact_table_type), intent(in) :: table
      type(joint_law_type), intent(in) :: laws(:)   !! per joint material
      type(joint_settings_type), intent(in) :: settings
      real(wp), intent(in) :: a
      real(wp), intent(in), contiguous :: gap(:), slip(:)     !! (>= contacts) of the motion at a = 0 [length]
      real(wp), intent(inout), contiguous :: force(:, :)      !! (2, >= contacts) along the lines of the links
      integer, intent(in), optional :: runs(:, :)             !! (2, n) first and last row, at most a piece of them
      integer :: n, p, run(2)
      n = n_pieces(table%n)
      if (present(runs)) n = size(runs, 2)
      !$omp parallel do default(none) private(p, run) schedule(static) if (table%n > parallel_contacts) &
      !$omp shared(self, table, laws, settings, a, gap, slip, force, runs, n)
      do p = 1, n
         if (present(runs)) then
            run = runs(:, p)
         else
            call piece_of_rows(table, p, run(1), run(2))
         end if
         call find_forces(run(1), run(2), self, table, laws, settings, a, gap, slip, force)
      end do
      !$omp end parallel do
   end subroutine forces_between

   !> `forces_between` for some of the rows, with its arguments.
   pure subroutine find_forces(first, last, self, table, laws, settings, a, gap, slip, force)
      integer, intent(in) :: first, last
      class(open_close_type), intent(in) :: self
      type(contact_table_type), intent(in) :: table
      type(joint_law_type), intent(in) :: laws(:)
      type(joint_settings_type), intent(in) :: settings
      real(wp), intent(in) :: a
      real(wp), intent(in), contiguous :: gap(:), slip(:)
      real(wp), intent(inout), contiguous :: force(:, :)
      real(wp) :: gap_there(widest_piece), slip_there(widest_piece), partner_gap
      real(wp) :: lowest(widest_piece), widest(widest_piece), mean(widest_piece)
      logical(l1) :: steady(widest_piece)
      real(wp) :: of_interval(2, 2)
      integer :: c, k, n, p
      n = last - first + 1
      gap_there(1:n) = gap(first:last) + a*(self%gap(first:last) - gap(first:last))
      slip_there(1:n) = slip(first:last) + a*(self%slip(first:last) - slip(first:last))
      call find_extremes(table, first, last, gap_there(1:n), lowest, widest, mean)
      call map_steady(laws, table, first, settings, self%joint, self%extra, widest(1:n), mean(1:n), gap_there(1:n), &
                      slip_there(1:n), steady(1:n), force(:, first:last))
      associate (joint => self%joint, partner => table%partner, law => table%joint)
         do c = first, last
            k = c - first + 1
            if (steady(k)) cycle
            if (is_one_contact(widest(k), joint(c), table%station(c), laws(law(c)), .false.)) then
               force(:, c) = 0
               if (joint(c)%state == contact_state%open .and. lowest(k) >= 0) cycle
               ! both rows at a time
               if (table%station(c) == 1) then
                  call lawful_interval(self, table, laws(law(c)), settings, c, gap_there(k:k + 1), &
                                       slip_there(k:k + 1), of_interval)
               end if
               force(:, c) = of_interval(:, table%station(c))
               cycle
            end if
            if (joint(c)%state == contact_state%open .and. &
                gap_there(k) >= closing_gap(settings, table%offset(c), logical(joint(c)%strikes))) then
               force(:, c) = 0
               cycle
            end if
            partner_gap = 0
            p = partner(c)
            if (p > 0) partner_gap = gap(p) + a*(self%gap(p) - gap(p))
            call lawful_force(self, table, laws(law(c)), settings, c, gap_there(k), mean(k), slip_there(k), &
               partner_gap, &
                              force(:, c))
         end do
      end associate
   end subroutine find_forces

   !> Force that a contact would have at a motion by its law.
   pure subroutine lawful_force(self, table, law, settings, c, gap, mean, slip, partner_gap, force)
      type(open_close_type), intent(in) :: self
      type(contact_table_type), intent(in) :: table
      type(joint_law_type), intent(in) :: law
      type(joint_settings_type), intent(in) :: settings
      integer, intent(in) :: c                        !! row
      real(wp), intent(in) :: gap, mean, slip, partner_gap   !! the partner's is not used without one [length]
      real(wp), intent(out) :: force(2)
      type(joint_type) :: joint
      type(joint_response_type) :: response
      force = 0
      call self%recall(table, c, joint)
      if (.not. stays_closed(joint, self%joint, table, law, settings, c, gap, partner_gap)) return
      call map_joint(law, settings, joint, gap, slip, response, spring_force(joint%k_n, mean))
      force = [-response%normal, response%shear]
   end subroutine lawful_force

   !> Forces that the rows of an interval would have at a motion by their law.
   pure subroutine lawful_interval(self, table, law, settings, c, gap, slip, force)
      type(open_close_type), intent(in) :: self
      type(contact_table_type), intent(in) :: table
      type(joint_law_type), intent(in) :: law
      type(joint_settings_type), intent(in) :: settings
      integer, intent(in) :: c                        !! first row
      real(wp), intent(in) :: gap(2), slip(2)         !! [length]
      real(wp), intent(out) :: force(2, 2)            !! (normal and along the edge, rows)
      type(interval_response_type) :: interval
      type(joint_type) :: joint
      type(joint_response_type) :: response
      real(wp) :: bond(2), drag(2)
      integer :: i
      force = 0
      bond = self%bond(c:c + 1)
      call respond(law, table, c, self%both_bonded(c), gap, settings%open_tolerance, bond, interval)
      if (self%joint(c)%state == contact_state%open) then
         if (any(self%joint(c:c + 1)%strikes)) return
         if (.not. interval%lowest < closing_gap(settings, minval(table%offset(c:c + 1)), .false.)) return
      else if (interval%lowest > settings%open_tolerance .and. .not. bond(2) > bond(1)) then
         return
      end if
      drag = 0
      if (allocated(self%extra)) drag = interval_drag(self%extra(c:c + 1), table%k_n(c), interval, gap)
      do i = 1, 2
         call self%recall(table, c + i - 1, joint)
         joint%length = interval%length
         joint%broken = interval%broken
         call map_joint(law, settings, joint, gap(i), slip(i), response, interval%pressing)
         force(:, i) = [drag(i) - interval%force(i), response%shear]
      end do
   end subroutine lawful_interval

   !> Forces of the dashpots of an interval, which act on its closed part as the springs do.
   pure function interval_drag(extra, k_n, interval, gap) result(force)
      type(joint_extra_type), intent(in) :: extra(2)
      real(wp), intent(in) :: k_n                     !! of one of the rows [force/length]
      type(interval_response_type), intent(in) :: interval
      real(wp), intent(in) :: gap(2)                  !! [length]
      real(wp) :: force(2), moved(2)
      moved = gap - extra%drag_gap
      force = (extra(1)%normal_drag/k_n)*(interval%own*moved + interval%cross*moved([2, 1]))
   end function interval_drag

   !> Contacts that the rounds have not settled: the force that the last solve gave them misses their law at its motion
   !> by more than `tolerance` times the largest force on the less loaded of their two blocks, and, if it is only the
   !> friction force of a contact that keeps sliding, by more than `small`. Forces on a block are the normal forces of
   !> its contacts and the one given, its weight: in blocks that fall together normal forces are rounding.
   subroutine count_unsettled(trial, table, tolerance, small, largest, n)
      type(open_close_type), intent(in) :: trial
      type(contact_table_type), intent(in) :: table
      real(wp), intent(in) :: tolerance
      real(wp), intent(in) :: small           !! [force]
      real(wp), intent(inout) :: largest(:)   !! (blocks) weight on entry [force]; the largest force
      integer, intent(out) :: n
      real(wp) :: allowed
      integer :: c
      n = 0
      !$omp parallel do default(none) shared(trial, table) private(c) reduction(+:n) schedule(static) &
      !$omp if (table%n > parallel_contacts)
      do c = 1, table%n
         if (trial%miss(c) > 0) n = n + 1
      end do
      !$omp end parallel do
      if (n == 0) return
      n = 0
      do c = 1, table%n
         associate (a => table%block_a(c), b => table%block_b(c), force => trial%normal_force(c))
            largest(a) = max(largest(a), force)
            largest(b) = max(largest(b), force)
         end associate
      end do
      do c = 1, table%n
         if (.not. trial%miss(c) > 0) cycle
         allowed = tolerance*min(largest(table%block_a(c)), largest(table%block_b(c)))
         if (trial%joint(c)%state == trial%state_used(c) .and. trial%joint(c)%slip_sign == trial%sign_used(c)) &
            allowed = max(allowed, small)
         if (trial%miss(c) > allowed) n = n + 1
      end do
   end subroutine count_unsettled

   !> Largest normal force of the last solve, of n contacts.
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

   !> Is a contact closed at the end of a motion? An open one must close, a closed one must not open.
   pure logical function stays_closed(joint, states, table, law, settings, c, gap, partner_gap)
      type(joint_type), intent(in) :: joint           !! of row c
      type(joint_state_type), intent(in), contiguous :: states(:)   !! (>= rows)
      type(contact_table_type), intent(in) :: table
      type(joint_law_type), intent(in) :: law
      type(joint_settings_type), intent(in) :: settings
      integer, intent(in) :: c                        !! row
      real(wp), intent(in) :: gap, partner_gap        !! the partner's is not used without one [length]
      real(wp) :: limit, between
      integer :: p
      stays_closed = .true.
      if (joint%tied) return
      if (joint%state == contact_state%open) then
         stays_closed = closes(states, table, settings, c, gap, partner_gap)
         return
      end if
      limit = settings%open_tolerance
      if (((joint%bonded .and. law%tension > 0) .or. law%residual_tension > 0) .and. .not. joint%worn) &
         limit = opening_gap(law, settings, joint)
      stays_closed = .not. gap > limit
      ! outside the partner's line: the corner has been passed
      p = table%partner(c)
      if (p == 0) return
      between = partner_gap + table%offset(p)
      if (between > settings%open_tolerance .and. between > gap + table%offset(c)) stays_closed = .false.
   end function stays_closed

   !> Gap of the springs below which an open contact closes. The tolerance counts from where the blocks touch: what the
   !> offset has used up of it is gone.
   pure real(wp) function closing_gap(settings, offset, strikes)
      type(joint_settings_type), intent(in) :: settings
      real(wp), intent(in) :: offset   !! gap that is free of force [length]
      logical, intent(in) :: strikes   !! it never closes in this attempt
      if (strikes) then
         closing_gap = -huge(closing_gap)
         return
      end if
      closing_gap = -max(settings%close_tolerance + min(0.0_wp, offset), &
                         min(settings%close_tolerance, settings%open_tolerance))
   end function closing_gap

   !> Does an open contact close with this motion?
   pure logical function closes(states, table, settings, c, gap, partner_gap)
      type(joint_state_type), intent(in), contiguous :: states(:)   !! (>= rows)
      type(contact_table_type), intent(in) :: table
      type(joint_settings_type), intent(in) :: settings
      integer, intent(in) :: c                        !! row
      real(wp), intent(in) :: gap, partner_gap        !! the partner's is not used without one [length]
      real(wp) :: start(2), between(2)                !! of the contact and its partner, offsets left aside [length]
      integer :: p
      closes = .false.
      if (gap >= closing_gap(settings, table%offset(c), logical(states(c)%strikes))) return
      p = table%partner(c)
      if (p > 0) then
         ! inside only when behind both lines; the line with the larger gap closes: through it is the shorter way out
         if (states(p)%state /= contact_state%open) return
         between = [gap + table%offset(c), partner_gap + table%offset(p)]
         if (between(2) >= -settings%close_tolerance) return
         start = [table%gap(c) + table%offset(c), table%gap(p) + table%offset(p)]
         if (minval(start) < -settings%close_tolerance) then
            ! behind one of them from the start: the corner comes through the other
            if (start(1) < start(2)) return
            if (start(1) <= start(2) .and. p < c) return
         else
            if (between(1) < between(2)) return
            if (between(1) <= between(2) .and. p < c) return
         end if
      end if
      closes = .true.
   end function closes

end module rockdda_interaction_open_close
