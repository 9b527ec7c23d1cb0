! SPDX-License-Identifier: MIT
!> The open-close loop's judgement: what every contact should be, given the motion of the last solve.
!>
!> Signs: gap > 0 open; normal force > 0 compression; slip > 0 when the vertex moves along the edge
!> (counter-clockwise on block b); the shear spring's elongation has the sign of slip.
!>
!> States of a contact and what acts while it has them:
!>     open      nothing
!>     locked    normal spring k_n at the gap, shear spring k_s at the elongation carried from the step's start
!>     sliding   normal spring, and a friction force of the last solve's normal force against the slip direction
!>
!> The shear spring never forgets: while a contact slides, its elongation stays at the friction limit over k_s (it
!> grows there with the slip), so a contact that locks again starts from the force it had. A sliding contact goes on
!> sliding as long as the spring, stretched by the step's slip from where it was, would exceed the limit: the return
!> mapping of plasticity. That also holds when the limit falls faster than the spring relaxes; the bare sign of the slip
!> would then lock and release the contact for ever.
!>
!> All comparisons have a margin of round-off size: blocks that move together without a force between them would
!> otherwise change states for ever.
module rockdda_contact_open_close
   use rockdda_base_kinds, only : wp
   use rockdda_base_parallel, only : parallel_contacts
   use rockdda_contact_table, only : contact_table_type, contact_state
   use rockdda_contact_law, only : contact_law_type, contact_law, shear_strength
   implicit none
   private
   public :: open_close_type, judge_settings_type

   !> Stiffness and tolerances of the judgement.
   type :: judge_settings_type
      real(wp) :: k_n = 0              !! normal stiffness [force/length]
      real(wp) :: k_s = 0              !! shear stiffness [force/length]
      real(wp) :: close_tolerance = 0  !! an open contact closes beyond this penetration [length]
      real(wp) :: open_tolerance = 0   !! a closed contact opens beyond this gap [length]
      real(wp) :: slip_tolerance = 0   !! shear force counts as beyond or below the limit by this much [force]
      logical :: peer = .false.        !! slide-lock changes do not count; locked up to a 2.5 times smaller shear
      real(wp) :: dt = 1               !! step, for slip rates
   end type judge_settings_type

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
   end type open_close_type

contains

   !> Trial states of the first round are those of the last step.
   subroutine begin(self, table, laws, settings)
      class(open_close_type), intent(inout) :: self
      type(contact_table_type), intent(in) :: table
      type(contact_law_type), intent(in) :: laws(:)  !! per joint material
      type(judge_settings_type), intent(in) :: settings
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
         if (self%state(c) == contact_state%sliding) self%friction(c) = &
            strength(laws(table%joint(c)), table, c, self%normal_force(c), .false., 0.0_wp, settings)
      end do
      !$omp end parallel do
   end subroutine begin

   !> Judge every contact by the predicted gap and slip of the last solve. A contact with a partner looks at the
   !> partner's state, which may be new already: these come after all others, in their order.
   subroutine judge(self, table, laws, settings, n_changes, worst_friction)
      class(open_close_type), intent(inout) :: self
      type(contact_table_type), intent(in) :: table
      type(contact_law_type), intent(in) :: laws(:)   !! per joint material
      type(judge_settings_type), intent(in) :: settings
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
      type(judge_settings_type), intent(in) :: settings
      integer :: n_changes
      real(wp) :: worst_friction
      call judge_all(self, table, laws, settings, .true., n_changes, worst_friction)
      self%changes(1:table%n) = 0
      self%miss(1:table%n) = 0
   end subroutine foresee

   !> Judge all contacts, or all that are not bonded.
   subroutine judge_all(self, table, laws, settings, spare_bonds, n_changes, worst_friction)
      class(open_close_type), intent(inout) :: self
      type(contact_table_type), intent(in) :: table
      type(contact_law_type), intent(in) :: laws(:)
      type(judge_settings_type), intent(in) :: settings
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
   real(wp) function deepest_force(self, n, settings) result(deepest)
      class(open_close_type), intent(in) :: self
      integer, intent(in) :: n                        !! contacts
      type(judge_settings_type), intent(in) :: settings
      integer :: c
      deepest = 0
      !$omp parallel do default(none) shared(self, settings, n) private(c) reduction(max:deepest) schedule(static) &
      !$omp if (n > parallel_contacts)
      do c = 1, n
         if (self%state(c) /= contact_state%open) deepest = max(deepest, abs(settings%k_n*self%gap(c)))
      end do
      !$omp end parallel do
   end function deepest_force

   !> Judge one contact.
   pure subroutine judge_contact(self, table, laws, settings, c, n_changes, worst_friction)
      class(open_close_type), intent(inout) :: self
      type(contact_table_type), intent(in) :: table
      type(contact_law_type), intent(in) :: laws(:)
      type(judge_settings_type), intent(in) :: settings
      integer, intent(in) :: c
      integer, intent(inout) :: n_changes
      real(wp), intent(inout) :: worst_friction
      integer :: old, new
      real(wp) :: limit
      old = self%state(c)
      self%state_used(c) = old
      self%sign_used(c) = self%slip_sign(c)
      self%friction_used(c) = self%friction(c)
      if (old == contact_state%open) then
         self%normal_force(c) = 0
         call judge_open(self, table, laws, settings, c, new)
      else
         self%normal_force(c) = -settings%k_n*self%gap(c)
         call judge_closed(self, table, laws, settings, c, new)
      end if
      self%state(c) = new
      self%friction(c) = 0
      self%miss(c) = 0
      if (new == contact_state%sliding) then
         limit = strength(laws(table%joint(c)), table, c, self%normal_force(c), .false., self%slip(c), settings)
         self%friction(c) = limit
         if (old == contact_state%sliding) then
            self%miss(c) = abs(limit - self%friction_used(c))
            worst_friction = max(worst_friction, self%miss(c))
         end if
      end if
      if (new == old .and. (new /= contact_state%sliding .or. self%slip_sign(c) == self%sign_used(c))) return
      self%changes(c) = self%changes(c) + 1
      if (settings%peer .and. min(old, new) > 0) return
      self%miss(c) = force_miss(self, table, settings, c)
      n_changes = n_changes + 1
   end subroutine judge_contact

   !> Force by which a contact that changed its state in the last judgement departs from its law at the motion of the
   !> last solve: the force that it then had, against the one it should have had [force].
   pure real(wp) function force_miss(self, table, settings, c) result(miss)
      class(open_close_type), intent(in) :: self
      type(contact_table_type), intent(in) :: table
      type(judge_settings_type), intent(in) :: settings
      integer, intent(in) :: c                       !! row
      real(wp) :: used, due, trial
      trial = shear_trial(self, table, settings, c)
      used = 0
      if (self%state_used(c) == contact_state%locked) used = trial
      if (self%state_used(c) == contact_state%sliding) used = self%sign_used(c)*self%friction_used(c)
      due = 0
      if (self%state(c) == contact_state%locked) due = trial
      if (self%state(c) == contact_state%sliding) due = self%slip_sign(c)*self%friction(c)
      miss = abs(due - used)
      ! the normal spring came or went
      if (min(self%state(c), self%state_used(c)) == contact_state%open) miss = miss + settings%k_n*abs(self%gap(c))
   end function force_miss

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
      type(judge_settings_type), intent(in) :: settings
      real(wp), intent(in) :: a
      real(wp), intent(in), contiguous :: gap(:), slip(:)     !! (>= contacts) of the motion at a = 0 [length]
      real(wp), intent(inout), contiguous :: force(:, :)      !! (2, >= contacts) along the lines of the links
      real(wp) :: gap_there, partner_gap, normal, shear
      integer :: c, p
      !$omp parallel do default(none) private(c, p, gap_there, partner_gap, normal, shear) schedule(static) &
      !$omp shared(self, table, laws, settings, a, gap, slip, force) if (table%n > parallel_contacts)
      do c = 1, table%n
         gap_there = gap(c) + a*(self%gap(c) - gap(c))
         normal = 0
         shear = 0
         if (self%state(c) /= contact_state%open .or. gap_there < -settings%close_tolerance) then
            p = max(1, table%partner(c))
            partner_gap = gap(p) + a*(self%gap(p) - gap(p))
            call find_forces(self, table, laws, settings, c, gap_there, partner_gap, &
                             slip(c) + a*(self%slip(c) - slip(c)), normal, shear)
            normal = -normal
         end if
         force(1, c) = normal
         force(2, c) = shear
      end do
      !$omp end parallel do
   end subroutine forces_between

   !> Friction force that a sliding contact should have at the motion of the last solve [force].
   pure real(wp) function friction_limit(self, table, laws, settings, c)
      class(open_close_type), intent(in) :: self
      type(contact_table_type), intent(in) :: table
      type(contact_law_type), intent(in) :: laws(:)   !! per joint material
      type(judge_settings_type), intent(in) :: settings
      integer, intent(in) :: c                        !! row
      friction_limit = strength(laws(table%joint(c)), table, c, -settings%k_n*self%gap(c), .false., self%slip(c), &
                                settings)
   end function friction_limit

   !> Forces that a contact would have with a given motion (normal compression positive, shear against the slip
   !> positive) if it followed its law there, whatever its trial state; partners as in the judgement.
   pure subroutine find_forces(self, table, laws, settings, c, gap, partner_gap, slip, normal, shear)
      type(open_close_type), intent(in) :: self
      type(contact_table_type), intent(in) :: table
      type(contact_law_type), intent(in) :: laws(:)
      type(judge_settings_type), intent(in) :: settings
      integer, intent(in) :: c                        !! row
      real(wp), intent(in) :: gap, partner_gap, slip  !! [length]
      real(wp), intent(out) :: normal, shear          !! [force]
      real(wp) :: limit
      normal = 0
      shear = 0
      if (self%state(c) == contact_state%open) then
         if (.not. closes(self, table, settings, c, gap, partner_gap)) return
      else
         if (gap > opening_gap(self, table, laws, settings, c)) return
         if (table%partner(c) > 0 .and. partner_gap > settings%open_tolerance .and. partner_gap > gap) return
      end if
      normal = -settings%k_n*gap
      limit = strength(laws(table%joint(c)), table, c, normal, self%bonded(c), slip, settings)
      shear = settings%k_s*(table%shear(c) + slip) + self%drag(c)*slip
      ! with the margins of the judgement: else the law would never agree with the states that the judgement leaves
      if (is_frictionless(laws(table%joint(c)), limit)) then
         shear = 0
      else if (self%state(c) == contact_state%sliding .and. &
               shear*self%slip_sign(c) >= limit - settings%slip_tolerance) then
         shear = self%slip_sign(c)*limit
      else if (abs(shear) > limit + settings%slip_tolerance) then
         shear = sign(limit, shear)
      end if
      normal = normal - self%normal_drag(c)*(gap - table%gap(c))
   end subroutine find_forces

   !> Gap beyond which a closed contact opens: while it is bonded, its tensile strength t l holds it together.
   pure real(wp) function opening_gap(self, table, laws, settings, c)
      class(open_close_type), intent(in) :: self
      type(contact_table_type), intent(in) :: table
      type(contact_law_type), intent(in) :: laws(:)
      type(judge_settings_type), intent(in) :: settings
      integer, intent(in) :: c                        !! row
      opening_gap = settings%open_tolerance
      if (self%bonded(c)) opening_gap = opening_gap + laws(table%joint(c))%tension*table%length(c)/settings%k_n
   end function opening_gap

   !> Does an open contact close with this motion?
   pure logical function closes(self, table, settings, c, gap, partner_gap)
      class(open_close_type), intent(in) :: self
      type(contact_table_type), intent(in) :: table
      type(judge_settings_type), intent(in) :: settings
      integer, intent(in) :: c                        !! row
      real(wp), intent(in) :: gap, partner_gap        !! the partner's is not used without one [length]
      integer :: p
      closes = .false.
      if (gap >= -settings%close_tolerance) return
      p = table%partner(c)
      if (p > 0) then
         ! inside only when behind both lines; the line with the larger gap closes: through it is the shorter way out
         if (self%state(p) /= contact_state%open) return
         if (partner_gap >= -settings%close_tolerance) return
         if (min(table%gap(c), table%gap(p)) < -settings%close_tolerance) then
            ! behind one of them from the start: the corner comes through the other
            if (table%gap(c) < table%gap(p)) return
            if (table%gap(c) <= table%gap(p) .and. p < c) return
         else
            if (gap < partner_gap) return
            if (gap <= partner_gap .and. p < c) return
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

   !> New state of an open contact.
   pure subroutine judge_open(self, table, laws, settings, c, new)
      class(open_close_type), intent(inout) :: self
      type(contact_table_type), intent(in) :: table
      type(contact_law_type), intent(in) :: laws(:)
      type(judge_settings_type), intent(in) :: settings
      integer, intent(in) :: c
      integer, intent(out) :: new
      real(wp) :: trial, limit
      new = contact_state%open
      if (self%gap(c) >= -settings%close_tolerance) return
      if (.not. closes(self, table, settings, c, self%gap(c), self%gap(max(1, table%partner(c))))) return
      new = contact_state%locked
      limit = strength(laws(table%joint(c)), table, c, -settings%k_n*self%gap(c), self%bonded(c), &
                       self%slip(c), settings)
      trial = shear_trial(self, table, settings, c)
      if (abs(trial) > limit + settings%slip_tolerance .or. is_frictionless(laws(table%joint(c)), limit)) then
         new = contact_state%sliding
         self%slip_sign(c) = merge(1, -1, trial >= 0)
         self%bonded(c) = .false.
      end if
   end subroutine judge_open

   !> New state of a closed contact.
   pure subroutine judge_closed(self, table, laws, settings, c, new)
      class(open_close_type), intent(inout) :: self
      type(contact_table_type), intent(in) :: table
      type(contact_law_type), intent(in) :: laws(:)
      type(judge_settings_type), intent(in) :: settings
      integer, intent(in) :: c
      integer, intent(out) :: new
      real(wp) :: shear, limit
      integer :: p
      new = self%state(c)
      p = table%partner(c)
      if (self%gap(c) > opening_gap(self, table, laws, settings, c)) new = contact_state%open
      if (p > 0) then
         ! outside the partner's line: the corner has been passed
         if (self%gap(p) > settings%open_tolerance .and. self%gap(p) > self%gap(c)) new = contact_state%open
      end if
      if (new == contact_state%open) then
         self%bonded(c) = .false.
         self%slip_sign(c) = 0
         return
      end if
      if (new == contact_state%locked) then
         shear = shear_trial(self, table, settings, c)
         limit = strength(laws(table%joint(c)), table, c, self%normal_force(c), self%bonded(c), self%slip(c), settings)
         if (abs(shear) > limit + settings%slip_tolerance .or. is_frictionless(laws(table%joint(c)), limit)) then
            new = contact_state%sliding
            self%slip_sign(c) = merge(1, -1, shear >= 0)
            self%bonded(c) = .false.
         end if
      else
         limit = strength(laws(table%joint(c)), table, c, self%normal_force(c), .false., self%slip(c), settings)
         shear = shear_trial(self, table, settings, c)
         if (shear*self%slip_sign(c) < limit - settings%slip_tolerance .and. &
             .not. is_frictionless(laws(table%joint(c)), limit)) then
            ! the spring would not reach the limit in this direction: it was not needed, or has turned
            if (abs(shear) > limit + settings%slip_tolerance) then
               self%slip_sign(c) = -self%slip_sign(c)
            else
               new = contact_state%locked
               self%slip_sign(c) = 0
            end if
         end if
      end if
   end subroutine judge_closed

   !> A joint that can never hold any shear is always sliding: no spring, nothing to judge.
   pure logical function is_frictionless(law, limit)
      type(contact_law_type), intent(in) :: law
      real(wp), intent(in) :: limit     !! its present strength
      is_frictionless = limit <= 0 .and. law%friction <= 0 .and. law%final_friction <= 0
   end function is_frictionless

   !> Shear force that a locked contact has, or would have with the slip of a sliding one: spring and dashpot.
   pure real(wp) function shear_trial(self, table, settings, c)
      class(open_close_type), intent(in) :: self
      type(contact_table_type), intent(in) :: table
      type(judge_settings_type), intent(in) :: settings
      integer, intent(in) :: c                       !! row
      shear_trial = settings%k_s*(table%shear(c) + self%slip(c)) + self%drag(c)*self%slip(c)
   end function shear_trial

   !> Shear strength with the slip rate of the step.
   pure real(wp) function strength(law, table, c, normal_force, bonded, slip, settings)
      type(contact_law_type), intent(in) :: law
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: c                       !! row
      real(wp), intent(in) :: normal_force, slip
      logical, intent(in) :: bonded
      type(judge_settings_type), intent(in) :: settings
      if (law%law == contact_law%coulomb) then
         ! the law of most joints, without asking elsewhere
         strength = law%friction*max(normal_force, 0.0_wp)
         if (bonded) strength = strength + law%cohesion*table%length(c)
         return
      end if
      strength = shear_strength(law, normal_force, table%length(c), bonded, abs(slip)/settings%dt, &
                                table%total_slip(c) + abs(slip))
   end function strength

end module rockdda_contact_open_close
