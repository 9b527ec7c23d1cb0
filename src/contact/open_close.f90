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
   use rockdda_contact_table, only : contact_table_type, contact_state
   use rockdda_contact_law, only : contact_law_type, shear_strength
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
      real(wp), allocatable :: friction_before(:) !! friction force of the solve before the last
      real(wp), allocatable :: limit_before(:)    !! and the limit that came out of it
      integer, allocatable :: sliding_solves(:)   !! solves in a row in which the contact was sliding
      integer, allocatable :: state_used(:)   !! state in the last solve (preset peer: may differ from state)
      integer, allocatable :: sign_used(:)    !! slip direction in the last solve
      real(wp), allocatable :: drag(:)        !! shear dashpot coefficient over dt, while locked [force/length]
      real(wp), allocatable :: gap(:)         !! predicted gap
      real(wp), allocatable :: slip(:)        !! predicted slip in this step
      integer, allocatable :: changes(:)      !! changes of state in this step so far
   contains
      procedure :: begin
      procedure :: judge
   end type open_close_type

contains

   !> Trial states of the first round are those of the last step.
   pure subroutine begin(self, table, laws, settings)
      class(open_close_type), intent(inout) :: self
      type(contact_table_type), intent(in) :: table
      type(contact_law_type), intent(in) :: laws(:)  !! per joint material
      type(judge_settings_type), intent(in) :: settings
      integer :: c, n
      n = table%n
      call make_room(self, n)
      do c = 1, n
         self%state(c) = table%state(c)
         self%slip_sign(c) = table%slip_sign(c)
         self%bonded(c) = table%bonded(c)
         self%normal_force(c) = table%normal_force(c)
         self%gap(c) = table%gap(c)
         self%slip(c) = 0
         self%drag(c) = 0
         self%changes(c) = 0
         self%friction(c) = 0
         self%sliding_solves(c) = 0
         if (self%state(c) == contact_state%sliding) self%friction(c) = &
            strength(laws(table%joint(c)), table, c, self%normal_force(c), .false., 0.0_wp, settings)
      end do
   end subroutine begin

   !> Judge every contact by the predicted gap and slip of the last solve.
   pure subroutine judge(self, table, laws, settings, n_changes, worst_friction)
      class(open_close_type), intent(inout) :: self
      type(contact_table_type), intent(in) :: table
      type(contact_law_type), intent(in) :: laws(:)   !! per joint material
      type(judge_settings_type), intent(in) :: settings
      integer, intent(out) :: n_changes               !! contacts whose state changed
      real(wp), intent(out) :: worst_friction         !! largest change of a friction force used [force]
      integer :: c, old, new
      real(wp) :: limit
      n_changes = 0
      worst_friction = 0
      do c = 1, table%n
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
         if (old /= contact_state%sliding) self%sliding_solves(c) = 0
         if (new == contact_state%sliding) then
            limit = strength(laws(table%joint(c)), table, c, self%normal_force(c), .false., self%slip(c), settings)
            self%friction(c) = limit
            if (old == contact_state%sliding) then
               self%sliding_solves(c) = self%sliding_solves(c) + 1
               worst_friction = max(worst_friction, abs(limit - self%friction_used(c)))
               call improve_friction(self, c, limit)
            end if
         end if
         if (new == old) cycle
         self%changes(c) = self%changes(c) + 1
         if (settings%peer .and. min(old, new) > 0) cycle
         n_changes = n_changes + 1
      end do
   end subroutine judge

   !> Friction force for the next solve. The force depends on the normal force, which depends on the friction:
   !> F = L(F). Putting L in for F diverges where L falls steeply (a steep friction angle at a lone corner), so the
   !> second guess is halfway for a contact that has just begun to slide, and a secant step follows.
   pure subroutine improve_friction(self, c, limit)
      class(open_close_type), intent(inout) :: self
      integer, intent(in) :: c
      real(wp), intent(in) :: limit     !! L of the friction used in the last solve
      real(wp) :: slope, change
      if (self%sliding_solves(c) > 1) then
         change = self%friction_used(c) - self%friction_before(c)
         if (abs(change) > 0) then
            slope = max(-4.0_wp, min(0.5_wp, (limit - self%limit_before(c))/change))
            self%friction(c) = max(0.0_wp, (limit - slope*self%friction_used(c))/(1 - slope))
         end if
      else if (self%changes(c) > 0) then
         self%friction(c) = 0.5_wp*(self%friction_used(c) + limit)
      end if
      self%friction_before(c) = self%friction_used(c)
      self%limit_before(c) = limit
   end subroutine improve_friction

   !> Arrays for at least n contacts.
   pure subroutine make_room(self, n)
      class(open_close_type), intent(inout) :: self
      integer, intent(in) :: n
      integer :: m
      if (allocated(self%state)) then
         if (size(self%state) >= n) return
         deallocate (self%state, self%slip_sign, self%bonded, self%normal_force, self%friction, self%friction_used, &
                     self%friction_before, self%limit_before, self%sliding_solves, self%gap, self%slip, self%changes, &
                     self%state_used, self%sign_used, self%drag)
      end if
      m = n + n/4 + 16
      allocate (self%state(m), self%slip_sign(m), self%sliding_solves(m), self%changes(m), self%state_used(m), &
                self%sign_used(m), source=0)
      allocate (self%bonded(m), source=.false.)
      allocate (self%normal_force(m), self%friction(m), self%friction_used(m), self%friction_before(m), &
                self%limit_before(m), self%gap(m), self%slip(m), self%drag(m), source=0.0_wp)
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
      integer :: p
      new = contact_state%open
      if (self%gap(c) >= -settings%close_tolerance) return
      p = table%partner(c)
      if (p > 0) then
         ! inside only when behind both lines; the line with the larger gap closes: through it is the shorter way out
         if (self%state(p) /= contact_state%open) return
         if (self%gap(p) >= -settings%close_tolerance) return
         if (min(table%gap(c), table%gap(p)) < -settings%close_tolerance) then
            ! behind one of them from the start: the corner comes through the other
            if (table%gap(c) < table%gap(p)) return
            if (table%gap(c) <= table%gap(p) .and. p < c) return
         else
            if (self%gap(c) < self%gap(p)) return
            if (self%gap(c) <= self%gap(p) .and. p < c) return
         end if
      end if
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
      real(wp) :: shear, limit, hold
      integer :: p
      hold = settings%open_tolerance
      if (self%bonded(c)) hold = hold + laws(table%joint(c))%tension*table%length(c)/settings%k_n
      new = self%state(c)
      p = table%partner(c)
      if (self%gap(c) > hold) new = contact_state%open
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
            ! the spring would not reach the limit in this direction: it has turned, or was not needed
            new = contact_state%locked
            self%slip_sign(c) = 0
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
      strength = shear_strength(law, normal_force, table%length(c), bonded, abs(slip)/settings%dt, &
                                table%total_slip(c) + abs(slip))
   end function strength

end module rockdda_contact_open_close
