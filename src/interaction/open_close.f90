! SPDX-License-Identifier: MIT
!> Trial states of the contacts of a step: the open-close iteration judges each by the motion of the last solve.
!>
!> Whether a contact is open follows from its gap, and that of its partner, here; forces and states of closed contacts
!> come from their law (rockdda_interaction_joint_law). Only `commit` changes the contact table.
module rockdda_interaction_open_close
   use rockdda_base_kinds, only : wp
   use rockdda_base_parallel, only : parallel_contacts
   use rockdda_contact_table, only : contact_table_type, contact_state
   use rockdda_interaction_contact_law, only : contact_law_type
   use rockdda_interaction_joint_law, only : joint_settings_type, joint_type, joint_response_type, joint_end_type, &
      map_joint, miss_of_joint, end_joint, opening_gap, sliding_friction
   implicit none
   private
   public :: open_close_type

   !> `state_used` of contacts that have not been in a solve of the attempt.
   integer, parameter :: no_state = -1

   !> Trial states and predicted motion of one step's contacts.
   type :: open_close_type
      integer, allocatable :: state(:)        !! trial state
      integer, allocatable :: slip_sign(:)    !! direction of slip used for friction, +1/-1
      logical, allocatable :: bonded(:)       !! still bonded in this trial
      real(wp), allocatable :: normal_force(:)  !! of the last solve; before the first, of the last step
      real(wp), allocatable :: friction(:)    !! friction force for the next solve while sliding, >= 0
      real(wp), allocatable :: friction_used(:) !! friction force of the last solve
      real(wp), allocatable :: miss(:)        !! what the force of the last solve misses of its law [force]
      integer, allocatable :: state_used(:)   !! state in the last solve (preset peer: may differ from state)
      integer, allocatable :: sign_used(:)    !! slip direction in the last solve
      real(wp), allocatable :: normal_drag(:) !! normal dashpot coefficient over dt, while closed [force/length]
      real(wp), allocatable :: drag(:)        !! shear dashpot coefficient over dt, while locked [force/length]
      real(wp), allocatable :: gap(:)         !! predicted gap
      real(wp), allocatable :: slip(:)        !! predicted slip in this step
      integer, allocatable :: changes(:)      !! changes of state in this step so far
   contains
      procedure :: begin
      procedure :: judge
      procedure :: foresee
      procedure :: deepest_force
      procedure :: count_unsettled
      procedure :: forces_between
      procedure :: friction_limit
      procedure :: joint_of
      procedure :: joint_used
      procedure :: commit
   end type open_close_type

contains

   !> Trial states of the first round are those of the last step.
   subroutine begin(self, table, laws, settings)
      class(open_close_type), intent(inout) :: self
      type(contact_table_type), intent(in) :: table
      type(contact_law_type), intent(in) :: laws(:)  !! per joint material
      type(joint_settings_type), intent(in) :: settings
      integer :: c, n
      n = table%n
      call make_room(self, n)
      !$omp parallel do default(none) shared(self, table, laws, settings, n) private(c) schedule(static) &
      !$omp if (n > parallel_contacts)
      do c = 1, n
         self%state(c) = table%state(c)
         self%slip_sign(c) = table%slip_sign(c)
         self%bonded(c) = table%bonded(c)
         self%normal_force(c) = table%normal_force(c)
         self%gap(c) = table%gap(c)
         self%slip(c) = 0
         self%drag(c) = 0
         self%normal_drag(c) = 0
         self%changes(c) = 0
         self%friction(c) = 0
         self%miss(c) = 0
         self%state_used(c) = no_state
         if (self%state(c) == contact_state%sliding) self%friction(c) = sliding_friction( &
            laws(table%joint(c)), settings, self%joint_of(table, c), self%normal_force(c), 0.0_wp)
      end do
      !$omp end parallel do
   end subroutine begin

   !> Judge every contact by the predicted gap and slip of the last solve. A contact with a partner looks at the
   !> partner's state, which may be new already: these come after all others, in their order.
   subroutine judge(self, table, laws, settings, n_changes, worst_friction)
      class(open_close_type), intent(inout) :: self
      type(contact_table_type), intent(in) :: table
      type(contact_law_type), intent(in) :: laws(:)   !! per joint material
      type(joint_settings_type), intent(in) :: settings
      integer, intent(out) :: n_changes               !! contacts whose state changed
      real(wp), intent(out) :: worst_friction         !! largest miss of a friction force used [force]
      call judge_all(self, table, laws, settings, .false., n_changes, worst_friction)
   end subroutine judge

   !> First states and friction forces of a step from a motion that was predicted, not solved for; nothing counts as
   !> changed, and bonds are left to the rounds.
   subroutine foresee(self, table, laws, settings)
      class(open_close_type), intent(inout) :: self
      type(contact_table_type), intent(in) :: table
      type(contact_law_type), intent(in) :: laws(:)   !! per joint material
      type(joint_settings_type), intent(in) :: settings
      integer :: n_changes
      real(wp) :: worst_friction
      call judge_all(self, table, laws, settings, .true., n_changes, worst_friction)
      self%changes(1:table%n) = 0
      self%miss(1:table%n) = 0
      self%state_used(1:table%n) = no_state
   end subroutine foresee

   !> Judge all contacts, or all that are not bonded.
   subroutine judge_all(self, table, laws, settings, spare_bonds, n_changes, worst_friction)
      type(open_close_type), intent(inout) :: self
      type(contact_table_type), intent(in) :: table
      type(contact_law_type), intent(in) :: laws(:)
      type(joint_settings_type), intent(in) :: settings
      logical, intent(in) :: spare_bonds
      integer, intent(out) :: n_changes
      real(wp), intent(out) :: worst_friction
      real(wp) :: miss
      integer :: c, n, n_partners
      n = 0
      n_partners = 0
      miss = 0
      !$omp parallel do default(none) shared(self, table, laws, settings, spare_bonds) private(c) schedule(static) &
      !$omp reduction(+:n, n_partners) reduction(max:miss) if (table%n > parallel_contacts)
      do c = 1, table%n
         if (spare_bonds .and. self%bonded(c)) cycle
         if (table%partner(c) == 0) then
            call judge_contact(self, table, laws, settings, c, n, miss)
         else
            n_partners = n_partners + 1
         end if
      end do
      !$omp end parallel do
      do c = 1, merge(table%n, 0, n_partners > 0)
         if (spare_bonds .and. self%bonded(c)) cycle
         if (table%partner(c) /= 0) call judge_contact(self, table, laws, settings, c, n, miss)
      end do
      n_changes = n
      worst_friction = miss
   end subroutine judge_all

   !> Largest normal force at the motion of the last solve, with the states that it had.
   real(wp) function deepest_force(self, table) result(deepest)
      class(open_close_type), intent(in) :: self
      type(contact_table_type), intent(in) :: table
      integer :: c
      deepest = 0
      !$omp parallel do default(none) shared(self, table) private(c) reduction(max:deepest) schedule(static) &
      !$omp if (table%n > parallel_contacts)
      do c = 1, table%n
         if (self%state(c) /= contact_state%open) deepest = max(deepest, abs(table%k_n(c)*self%gap(c)))
      end do
      !$omp end parallel do
   end function deepest_force

   !> Judge one contact.
   pure subroutine judge_contact(self, table, laws, settings, c, n_changes, worst_friction)
      type(open_close_type), intent(inout) :: self
      type(contact_table_type), intent(in) :: table
      type(contact_law_type), intent(in) :: laws(:)
      type(joint_settings_type), intent(in) :: settings
      integer, intent(in) :: c
      integer, intent(inout) :: n_changes
      real(wp), intent(inout) :: worst_friction
      type(joint_type) :: joint
      type(joint_response_type) :: response
      real(wp) :: gap
      integer :: old, new
      logical :: is_closed
      old = self%state(c)
      self%state_used(c) = old
      self%sign_used(c) = self%slip_sign(c)
      self%friction_used(c) = self%friction(c)
      self%friction(c) = 0
      self%miss(c) = 0
      self%normal_force(c) = 0
      gap = self%gap(c)
      if (old == contact_state%open .and. gap >= closing_gap(settings, table%offset(c))) return
      call gather(self, table, c, joint)
      joint%friction = self%friction_used(c)
      is_closed = stays_closed(self, table, laws(table%joint(c)), settings, joint, c, gap, &
                               self%gap(max(1, table%partner(c))))
      if (old /= contact_state%open) self%normal_force(c) = -table%k_n(c)*gap
      new = contact_state%open
      if (is_closed) then
         call map_joint(laws(table%joint(c)), settings, joint, gap, self%slip(c), response)
         new = response%state
         self%slip_sign(c) = response%slip_sign
         self%bonded(c) = response%bonded
         ! the overlap of a motion without the contact says nothing about the force it will carry: friction of a contact
         ! that closes starts from zero
         if (old /= contact_state%open) self%friction(c) = response%friction
      else if (old /= contact_state%open) then
         self%bonded(c) = .false.
         self%slip_sign(c) = 0
      end if
      self%state(c) = new
      if (new == contact_state%sliding .and. old == contact_state%sliding) then
         self%miss(c) = abs(self%friction(c) - self%friction_used(c))
         worst_friction = max(worst_friction, self%miss(c))
      end if
      if (new == old .and. (new /= contact_state%sliding .or. self%slip_sign(c) == self%sign_used(c))) return
      self%changes(c) = self%changes(c) + 1
      if (settings%peer .and. min(old, new) > 0) return
      self%miss(c) = miss_of_joint(joint, gap, self%slip(c), new, self%slip_sign(c), &
                                   self%friction(c))
      n_changes = n_changes + 1
   end subroutine judge_contact

   !> Memory of a contact with its trial state.
   pure type(joint_type) function joint_of(self, table, c) result(joint)
      class(open_close_type), intent(in) :: self
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: c                       !! row
      call gather(self, table, c, joint)
      joint%friction = self%friction(c)
   end function joint_of

   !> The same with the state that the last solve had.
   pure type(joint_type) function joint_used(self, table, c) result(joint)
      class(open_close_type), intent(in) :: self
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: c                       !! row
      call gather(self, table, c, joint)
      joint%friction = self%friction_used(c)
      joint%state = self%state_used(c)
      joint%slip_sign = self%sign_used(c)
   end function joint_used

   !> All of a joint but the friction force.
   pure subroutine gather(self, table, c, joint)
      type(open_close_type), intent(in) :: self
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: c                       !! row
      type(joint_type), intent(out) :: joint         !! without its friction
      joint%gap = table%gap(c)
      joint%shear = table%shear(c)
      joint%total_slip = table%total_slip(c)
      joint%length = table%length(c)
      joint%k_n = table%k_n(c)
      joint%k_s = table%k_s(c)
      joint%normal_drag = self%normal_drag(c)
      joint%drag = self%drag(c)
      joint%state = self%state(c)
      joint%slip_sign = self%slip_sign(c)
      joint%bonded = self%bonded(c)
      joint%tied = table%tied(c)
   end subroutine gather

   !> The accepted step: the table then holds the contacts at the step's end.
   subroutine commit(self, table)
      class(open_close_type), intent(in) :: self
      type(contact_table_type), intent(inout) :: table
      type(joint_end_type) :: last
      integer :: c
      !$omp parallel do default(none) shared(self, table) private(c, last) schedule(static) &
      !$omp if (table%n > parallel_contacts)
      do c = 1, table%n
         table%bonded(c) = self%bonded(c)
         if (self%state_used(c) == contact_state%open) then
            ! a contact that would close after the last solve has no spring yet
            call table%open_row(c)
            cycle
         end if
         last = end_joint(self%joint_used(table, c), self%gap(c), self%slip(c))
         table%state(c) = self%state(c)
         table%slip_sign(c) = self%slip_sign(c)
         table%shear(c) = last%shear
         table%normal_force(c) = last%normal_force
         table%shear_force(c) = last%shear_force
         table%total_slip(c) = table%total_slip(c) + last%slipped
         table%energy(c) = last%energy
      end do
      !$omp end parallel do
   end subroutine commit

   !> Contacts that the rounds have not settled: the force that the last solve gave them misses their law at its motion
   !> by more than `tolerance` times the largest normal force on the less loaded of their two blocks, and, if it
   !> is only the friction force of a contact that goes on sliding, by more than `small`.
   subroutine count_unsettled(self, table, tolerance, small, largest, n)
      class(open_close_type), intent(in) :: self
      type(contact_table_type), intent(in) :: table
      real(wp), intent(in) :: tolerance
      real(wp), intent(in) :: small           !! [force]
      real(wp), intent(inout) :: largest(:)   !! (blocks) work
      integer, intent(out) :: n
      real(wp) :: allowed
      integer :: c
      n = 0
      !$omp parallel do default(none) shared(self, table) private(c) reduction(+:n) schedule(static) &
      !$omp if (table%n > parallel_contacts)
      do c = 1, table%n
         if (self%miss(c) > 0) n = n + 1
      end do
      !$omp end parallel do
      if (n == 0) return
      n = 0
      largest = 0
      do c = 1, table%n
         associate (a => table%block_a(c), b => table%block_b(c), force => self%normal_force(c))
            largest(a) = max(largest(a), force)
            largest(b) = max(largest(b), force)
         end associate
      end do
      do c = 1, table%n
         if (.not. self%miss(c) > 0) cycle
         allowed = tolerance*min(largest(table%block_a(c)), largest(table%block_b(c)))
         if (self%state(c) == self%state_used(c) .and. self%slip_sign(c) == self%sign_used(c)) &
            allowed = max(allowed, small)
         if (self%miss(c) > allowed) n = n + 1
      end do
   end subroutine count_unsettled

   !> Forces that all contacts would have at the fraction a of the way from a motion to the present one if they followed
   !> their laws there, whatever their trial states.
   subroutine forces_between(self, table, laws, settings, a, gap, slip, force)
      class(open_close_type), intent(in) :: self
      type(contact_table_type), intent(in) :: table
      type(contact_law_type), intent(in) :: laws(:)   !! per joint material
      type(joint_settings_type), intent(in) :: settings
      real(wp), intent(in) :: a
      real(wp), intent(in), contiguous :: gap(:), slip(:)     !! (>= contacts) of the motion at a = 0 [length]
      real(wp), intent(inout), contiguous :: force(:, :)      !! (2, >= contacts) along the lines of the links
      type(joint_type) :: joint
      type(joint_response_type) :: response
      real(wp) :: gap_there, partner_gap
      integer :: c, p
      !$omp parallel do default(none) private(c, p, gap_there, partner_gap, joint, response) schedule(static) &
      !$omp shared(self, table, laws, settings, a, gap, slip, force) if (table%n > parallel_contacts)
      do c = 1, table%n
         gap_there = gap(c) + a*(self%gap(c) - gap(c))
         force(:, c) = 0
         if (self%state(c) == contact_state%open .and. gap_there >= closing_gap(settings, table%offset(c))) cycle
         p = max(1, table%partner(c))
         partner_gap = gap(p) + a*(self%gap(p) - gap(p))
         call gather(self, table, c, joint)
         associate (law => laws(table%joint(c)))
            if (.not. stays_closed(self, table, law, settings, joint, c, gap_there, partner_gap)) cycle
            call map_joint(law, settings, joint, gap_there, slip(c) + a*(self%slip(c) - slip(c)), response)
         end associate
         force(1, c) = -response%normal
         force(2, c) = response%shear
      end do
      !$omp end parallel do
   end subroutine forces_between

   !> Friction force that a sliding contact should have at the motion of the last solve [force].
   pure real(wp) function friction_limit(self, table, laws, settings, c)
      class(open_close_type), intent(in) :: self
      type(contact_table_type), intent(in) :: table
      type(contact_law_type), intent(in) :: laws(:)   !! per joint material
      type(joint_settings_type), intent(in) :: settings
      integer, intent(in) :: c                        !! row
      friction_limit = sliding_friction(laws(table%joint(c)), settings, self%joint_of(table, c), &
                                        -table%k_n(c)*self%gap(c), self%slip(c))
   end function friction_limit

   !> Is a contact closed at the end of a motion? An open one must close, a closed one must not open.
   pure logical function stays_closed(self, table, law, settings, joint, c, gap, partner_gap)
      type(open_close_type), intent(in) :: self
      type(contact_table_type), intent(in) :: table
      type(contact_law_type), intent(in) :: law
      type(joint_settings_type), intent(in) :: settings
      type(joint_type), intent(in) :: joint
      integer, intent(in) :: c                        !! row
      real(wp), intent(in) :: gap, partner_gap        !! the partner's is not used without one [length]
      real(wp) :: limit, between
      integer :: p
      stays_closed = .true.
      if (joint%tied) return
      if (joint%state == contact_state%open) then
         stays_closed = closes(self, table, settings, c, gap, partner_gap)
      else
         limit = settings%open_tolerance
         if (joint%bonded .or. law%residual_tension > 0) limit = opening_gap(law, settings, joint)
         stays_closed = .not. gap > limit
         ! outside the partner's line: the corner has been passed
         p = table%partner(c)
         if (p > 0) then
            between = partner_gap + table%offset(p)
            if (between > settings%open_tolerance .and. between > gap + table%offset(c)) stays_closed = .false.
         end if
      end if
   end function stays_closed

   !> Gap of the springs below which an open contact closes. The tolerance counts from where the blocks touch: what the
   !> offset has used up of it is gone.
   pure real(wp) function closing_gap(settings, offset)
      type(joint_settings_type), intent(in) :: settings
      real(wp), intent(in) :: offset   !! gap that is free of force [length]
      closing_gap = -max(settings%close_tolerance + min(0.0_wp, offset), &
                         min(settings%close_tolerance, settings%open_tolerance))
   end function closing_gap

   !> Does an open contact close with this motion?
   pure logical function closes(self, table, settings, c, gap, partner_gap)
      type(open_close_type), intent(in) :: self
      type(contact_table_type), intent(in) :: table
      type(joint_settings_type), intent(in) :: settings
      integer, intent(in) :: c                        !! row
      real(wp), intent(in) :: gap, partner_gap        !! the partner's is not used without one [length]
      real(wp) :: start(2), between(2)                !! of the contact and its partner, offsets left aside [length]
      integer :: p
      closes = .false.
      if (gap >= closing_gap(settings, table%offset(c))) return
      p = table%partner(c)
      if (p > 0) then
         ! inside only when behind both lines; the line with the larger gap closes: through it is the shorter way out
         if (self%state(p) /= contact_state%open) return
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

   !> Arrays for at least n contacts.
   pure subroutine make_room(self, n)
      class(open_close_type), intent(inout) :: self
      integer, intent(in) :: n
      integer :: m
      if (allocated(self%state)) then
         if (size(self%state) >= n) return
         deallocate (self%state, self%slip_sign, self%bonded, self%normal_force, self%friction, self%friction_used, &
                     self%miss, self%gap, self%slip, self%changes, &
                     self%state_used, self%sign_used, self%drag, self%normal_drag)
      end if
      m = n + n/4 + 16
      allocate (self%state(m), self%slip_sign(m), self%changes(m), self%state_used(m), self%sign_used(m), source=0)
      allocate (self%bonded(m), source=.false.)
      allocate (self%normal_force(m), self%friction(m), self%friction_used(m), self%miss(m), &
                self%gap(m), self%slip(m), self%drag(m), self%normal_drag(m), source=0.0_wp)
   end subroutine make_room

end module rockdda_interaction_open_close
