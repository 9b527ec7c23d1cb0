! SPDX-License-Identifier: MIT
!> Trial states of the contacts of a step: the open-close iteration judges each by the motion of the last solve.
!>
!> Whether a contact is open follows from its gap, and that of its partner, here; forces and states of closed contacts
!> come from their law (rockdda_interaction_joint_law). They do not change the contact table.
module rockdda_interaction_open_close
   use, intrinsic :: iso_c_binding, only : c_loc
   use rockdda_base_first_use, only : set_zero, take_bytes, take_pages
   use rockdda_base_kinds, only : wp, i1, i2, i8, l1
   use rockdda_base_parallel, only : parallel_contacts, piece, n_pieces
   use rockdda_base_runs, only : run_length
   use rockdda_contact_table, only : contact_table_type, contact_state
   use rockdda_interaction_closing, only : closing_gap, stays_closed
   use rockdda_interaction_closed_part, only : has_closed_part, set_closed_parts
   use rockdda_interaction_contact_law, only : contact_law_type
   use rockdda_interaction_dashpots, only : has_dashpots
   use rockdda_interaction_joint_end, only : joint_end_type, end_joints
   use rockdda_interaction_joint_law, only : joint_settings_type, joint_state_type, joint_extra_type, joint_type, &
      joint_response_type, recall_joint, find_held, stay_locked, map_joint, miss_of_joint, sliding_friction, &
      have_friction_alone
   use rockdda_interaction_ligament, only : set_tip_strengths
   use rockdda_interaction_sliding, only : friction_of_sliding, judge_steady
   implicit none
   private
   public :: open_close_type

   !> `state_used` of contacts that have not been in a solve of the attempt.
   integer(i1), parameter :: no_state = -1
   !> A contact that closes after so many changes of state in an attempt has opened twice: its shear spring is free.
   integer, parameter :: worn_changes = 3

   !> Trial states and predicted motion of one step's contacts.
   type :: open_close_type
      !> When the last solve has paused: contacts change their states only if the force that they miss, over the root of
      !> their stiffness, is larger [root of energy].
      real(wp) :: doubt = 0
      type(joint_state_type), allocatable :: joint(:)   !! trial state, slip direction, friction force and bond
      type(joint_extra_type), allocatable :: extra(:)   !! with cohesion, tensile strength or dashpots, else none
      real(wp), allocatable :: normal_force(:)  !! of the last solve; before the first, of the last step
      real(wp), allocatable :: miss(:)        !! what the force of the last solve misses of its law [force]
      integer(i1), allocatable :: state_used(:)   !! state in the last solve (preset peer: may differ from the trial's)
      integer(i1), allocatable :: sign_used(:)    !! slip direction in the last solve
      real(wp), allocatable :: friction_used(:) !! friction force of the last solve
      logical(l1), allocatable :: bonded_used(:)  !! bond of the last solve
      real(wp), allocatable :: gap(:)         !! predicted gap
      real(wp), allocatable :: slip(:)        !! predicted slip in this step
      integer(i2), allocatable :: changes(:)      !! changes of state in this step so far
      logical(l1), allocatable :: opened(:)       !! at the end of the step, after forces have acted in it
      integer(i1), allocatable :: start(:)    !! 1: closed at the start of the step, 2: open
      !> Share of the step's motion after which the forces of contacts act that are closed at the start (1) or open (2):
      !> that of the scheme, and 1; gap and slip are those there until `reach_end`. And the factor of their forces in
      !> the equations.
      real(wp) :: level(2) = 1, factor(2) = 1
      integer, private :: n_begun = 0         !! rows that have been in use; those behind take no memory yet
   contains
      procedure :: begin
      procedure :: judge
      procedure :: foresee
      procedure :: forces_between
      procedure :: friction_limit
      procedure :: find_ends
      procedure :: recall
      procedure :: gap_at_end
   end type open_close_type

contains

   !> Trial states of the first round are those of the last step.
   subroutine begin(self, table, laws, settings)
      class(open_close_type), intent(inout) :: self
      type(contact_table_type), intent(in) :: table
      type(contact_law_type), intent(in) :: laws(:)  !! per joint material
      type(joint_settings_type), intent(in) :: settings
      integer :: c, n, p
      n = table%n
      self%doubt = 0
      ! one that is open at the start and closes does not know when: its force at the end is an impulse
      self%level = [settings%level, 1.0_wp]
      self%factor = [1.0_wp, settings%impact]
      call make_room(self, n)
      call make_extra_room(self, table, laws)
      if (allocated(self%extra)) self%extra(1:n) = joint_extra_type()
      !$omp parallel do default(none) shared(self, table, laws, settings, n) private(p) schedule(static) &
      !$omp if (n > parallel_contacts)
      do p = 1, n_pieces(n)
         call begin_rows((p - 1)*piece + 1, min(p*piece, n), self, table, laws, settings)
      end do
      !$omp end parallel do
      if (.not. allocated(self%extra)) return
      call set_tip_strengths(table, laws, self%extra)
      if (.not. any(has_closed_part(laws))) return
      call set_closed_parts(table, laws, settings, self%extra)
      do c = 1, n
         if (self%joint(c)%state == contact_state%sliding .and. abs(self%extra(c)%more_length) > 0) &
            call set_friction(self, table, laws, settings, c)
      end do
   end subroutine begin

   !> `begin` for some of the rows.
   pure subroutine begin_rows(first, last, self, table, laws, settings)
      integer, intent(in) :: first, last
      class(open_close_type), intent(inout) :: self
      type(contact_table_type), intent(in) :: table
      type(contact_law_type), intent(in) :: laws(:)  !! per joint material
      type(joint_settings_type), intent(in) :: settings
      integer :: c
      self%normal_force(first:last) = table%normal_force(first:last)
      self%gap(first:last) = table%gap(first:last)
      self%slip(first:last) = 0
      self%changes(first:last) = 0
      self%miss(first:last) = 0
      self%opened(first:last) = .false.
      self%state_used(first:last) = no_state
      do c = first, last
         self%joint(c)%friction = 0
         self%joint(c)%state = table%state(c)
         self%joint(c)%slip_sign = table%slip_sign(c)
         self%joint(c)%bonded = table%bonded(c)
         self%joint(c)%tied = table%tied(c)
         self%joint(c)%worn = .false.
         self%joint(c)%strikes = .false.
         self%start(c) = merge(2_i1, 1_i1, table%state(c) == contact_state%open)
         if (table%state(c) == contact_state%sliding) call set_friction(self, table, laws, settings, c)
      end do
   end subroutine begin_rows

   !> Friction force that a contact begins with.
   pure subroutine set_friction(self, table, laws, settings, c)
      class(open_close_type), intent(inout) :: self
      type(contact_table_type), intent(in) :: table
      type(contact_law_type), intent(in) :: laws(:)  !! per joint material
      type(joint_settings_type), intent(in) :: settings
      integer, intent(in) :: c                       !! row
      type(joint_type) :: joint
      call self%recall(table, c, joint)
      self%joint(c)%friction = sliding_friction(laws(table%joint(c)), settings, joint, self%normal_force(c), 0.0_wp)
   end subroutine set_friction

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
      integer :: c, n, n_partners, p
      n = 0
      n_partners = 0
      miss = 0
      !$omp parallel do default(none) shared(self, table, laws, settings, spare_bonds) private(p) schedule(static) &
      !$omp reduction(+:n, n_partners) reduction(max:miss) if (table%n > parallel_contacts)
      do p = 1, n_pieces(table%n)
         call judge_rows((p - 1)*piece + 1, min(p*piece, table%n), self, table, laws, settings, spare_bonds, &
                         n, n_partners, miss)
      end do
      !$omp end parallel do
      do c = 1, merge(table%n, 0, n_partners > 0)
         if (spare_bonds .and. self%joint(c)%bonded) cycle
         if (table%partner(c) /= 0) call judge_contact(self, table, laws, settings, c, n, miss)
      end do
      n_changes = n
      worst_friction = miss
   end subroutine judge_all

   !> Judge some of the rows, but for those with partners, which are counted.
   pure subroutine judge_rows(first, last, self, table, laws, settings, spare_bonds, n_changes, n_partners, &
                              worst_friction)
      integer, intent(in) :: first, last               !! at most a piece
      type(open_close_type), intent(inout) :: self
      type(contact_table_type), intent(in) :: table
      type(contact_law_type), intent(in) :: laws(:)
      type(joint_settings_type), intent(in) :: settings
      logical, intent(in) :: spare_bonds
      integer, intent(inout) :: n_changes, n_partners
      real(wp), intent(inout) :: worst_friction
      logical(l1) :: stays(piece)
      logical :: simple, is_steady
      integer :: c, i, k, n
      simple = have_friction_alone(laws) .and. .not. allocated(self%extra)
      call find_held(laws, table, first, settings, self%joint, self%extra, self%gap(first:last), &
                     self%slip(first:last), stays(1:last - first + 1))
      do c = first, last
         k = c - first + 1
         stays(k) = stays(k) .and. table%partner(c) == 0
         if (spare_bonds) stays(k) = stays(k) .and. .not. self%joint(c)%bonded
      end do
      c = first
      do while (c <= last)
         n = run_length(last - c + 1, stays(c - first + 1:last - first + 1))
         associate (e => c + n - 1)
            if (stays(c - first + 1)) then
               call stay_locked(n, table%k_n(c:e), self%gap(c:e), self%joint(c:e), self%state_used(c:e), &
                                self%sign_used(c:e), self%friction_used(c:e), self%bonded_used(c:e), self%miss(c:e), &
                                self%normal_force(c:e))
            else
               do i = c, e
                  if (spare_bonds .and. self%joint(i)%bonded) cycle
                  call judge_steady(simple, laws, settings, table, i, self%gap(i), self%slip(i), self%joint(i), &
                                    self%state_used(i), self%sign_used(i), self%friction_used(i), self%bonded_used(i), &
                                    self%miss(i), self%normal_force(i), worst_friction, is_steady)
                  if (is_steady) cycle
                  if (table%partner(i) /= 0) then
                     n_partners = n_partners + 1
                  else
                     call judge_contact(self, table, laws, settings, i, n_changes, worst_friction)
                  end if
               end do
            end if
         end associate
         c = c + n
      end do
   end subroutine judge_rows

   !> Judge one contact.
   pure subroutine judge_contact(self, table, laws, settings, c, n_changes, worst_friction)
      type(open_close_type), intent(inout) :: self
      type(contact_table_type), intent(in) :: table
      type(contact_law_type), intent(in) :: laws(:)
      type(joint_settings_type), intent(in) :: settings
      integer, intent(in) :: c
      integer, intent(inout) :: n_changes
      real(wp), intent(inout) :: worst_friction
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
             .not. settings%peer) then
            joint%worn = .true.
            call self%recall(table, c, memory)
         end if
         if (is_closed) call map_joint(laws(table%joint(c)), settings, memory, gap, slip, response)
         if (old /= contact_state%open) self%normal_force(c) = -memory%k_n*gap
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
         ! the overlap of a motion without the contact says nothing about the force it will carry: friction of a contact
         ! that closes starts from zero
         joint%friction = 0
         if (is_closed .and. old /= contact_state%open) joint%friction = response%friction
         if (new == contact_state%sliding .and. old == contact_state%sliding) then
            self%miss(c) = abs(joint%friction - friction_used)
            worst_friction = max(worst_friction, self%miss(c))
         end if
         if (new /= old .or. (new == contact_state%sliding .and. new_sign /= sign_used)) then
            if (.not. (settings%peer .and. min(old, new) > 0)) then
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

   !> Contacts first to last that were closed in the last solve, at the end of the step.
   pure subroutine find_ends(self, table, first, last, ends)
      class(open_close_type), intent(in) :: self
      type(contact_table_type), intent(in) :: table    !! at the start of the step
      integer, intent(in) :: first, last               !! rows, at most a piece of them
      type(joint_end_type), intent(inout) :: ends(:)   !! of row first at 1
      call end_joints(last - first + 1, table%k_n(first:last), table%k_s(first:last), table%shear(first:last), &
                      self%joint(first:last), self%state_used(first:last), self%sign_used(first:last), &
                      self%friction_used(first:last), self%gap(first:last), self%slip(first:last), ends)
   end subroutine find_ends

   !> A contact with its memory in the table.
   pure subroutine recall(self, table, c, joint)
      class(open_close_type), intent(in) :: self
      type(contact_table_type), intent(in) :: table    !! at the start of the step
      integer, intent(in) :: c                         !! row
      type(joint_type), intent(inout) :: joint
      call recall_joint(table, c, self%joint(c), self%extra, joint)
   end subroutine recall

   !> Gap at the end of the step, by the gap where the forces act.
   pure real(wp) function gap_at_end(self, table, c) result(gap)
      class(open_close_type), intent(in) :: self
      type(contact_table_type), intent(in) :: table  !! at the start of the step
      integer, intent(in) :: c                       !! row
      real(wp) :: late
      late = 0
      if (allocated(self%extra)) late = self%extra(c)%late
      gap = self%gap(c)
      associate (level => self%level(self%start(c)))
         if (level < 1) gap = table%gap(c) + ((gap - table%gap(c)) - late)/level
      end associate
      if (allocated(self%extra)) gap = gap - self%extra(c)%opens
   end function gap_at_end

   !> Forces that all contacts, or runs of them, would have at the fraction a of the way from a motion to the present
   !> one if they followed their laws there, whatever their trial states.
   subroutine forces_between(self, table, laws, settings, a, gap, slip, force, runs)
      class(open_close_type), intent(in) :: self
      type(contact_table_type), intent(in) :: table
      type(contact_law_type), intent(in) :: laws(:)   !! per joint material
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
         run = [(p - 1)*piece + 1, min(p*piece, table%n)]
         if (present(runs)) run = runs(:, p)
         call find_forces(run(1), run(2), self, table, laws, settings, a, gap, slip, force)
      end do
      !$omp end parallel do
   end subroutine forces_between

   !> `forces_between` for some of the rows, with its arguments.
   pure subroutine find_forces(first, last, self, table, laws, settings, a, gap, slip, force)
      integer, intent(in) :: first, last
      class(open_close_type), intent(in) :: self
      type(contact_table_type), intent(in) :: table
      type(contact_law_type), intent(in) :: laws(:)
      type(joint_settings_type), intent(in) :: settings
      real(wp), intent(in) :: a
      real(wp), intent(in), contiguous :: gap(:), slip(:)
      real(wp), intent(inout), contiguous :: force(:, :)
      real(wp) :: gap_there(piece), slip_there(piece), partner_gap
      logical(l1) :: held(piece)
      logical :: simple
      real(wp) :: friction
      integer :: c, k, n, p
      simple = have_friction_alone(laws) .and. .not. allocated(self%extra)
      n = last - first + 1
      gap_there(1:n) = gap(first:last) + a*(self%gap(first:last) - gap(first:last))
      slip_there(1:n) = slip(first:last) + a*(self%slip(first:last) - slip(first:last))
      call find_held(laws, table, first, settings, self%joint, self%extra, gap_there(1:n), slip_there(1:n), &
                     held(1:n), force(:, first:last))
      associate (joint => self%joint, partner => table%partner, law => table%joint)
         do c = first, last
            k = c - first + 1
            p = partner(c)
            if (held(k) .and. p == 0) cycle
            if (joint(c)%state == contact_state%open .and. &
                gap_there(k) >= closing_gap(settings, table%offset(c), logical(joint(c)%strikes))) then
               force(1, c) = 0
               force(2, c) = 0
               cycle
            end if
            friction = -1
            if (simple) friction = friction_of_sliding(laws, settings, table, c, joint(c), gap_there(k), slip_there(k))
            if (friction >= 0) then
               force(:, c) = [table%k_n(c)*gap_there(k), joint(c)%slip_sign*friction]
               cycle
            end if
            partner_gap = 0
            if (p > 0) partner_gap = gap(p) + a*(self%gap(p) - gap(p))
            call lawful_force(self, table, laws(law(c)), settings, c, gap_there(k), slip_there(k), partner_gap, &
                              force(:, c))
         end do
      end associate
   end subroutine find_forces

   !> Force that a contact would have at a motion by its law.
   pure subroutine lawful_force(self, table, law, settings, c, gap, slip, partner_gap, force)
      type(open_close_type), intent(in) :: self
      type(contact_table_type), intent(in) :: table
      type(contact_law_type), intent(in) :: law
      type(joint_settings_type), intent(in) :: settings
      integer, intent(in) :: c                        !! row
      real(wp), intent(in) :: gap, slip, partner_gap  !! the partner's is not used without one [length]
      real(wp), intent(out) :: force(2)
      type(joint_type) :: joint
      type(joint_response_type) :: response
      force = 0
      call self%recall(table, c, joint)
      if (.not. stays_closed(joint, self%joint, table, law, settings, c, gap, partner_gap)) return
      call map_joint(law, settings, joint, gap, slip, response)
      force = [-response%normal, response%shear]
   end subroutine lawful_force

   !> Friction force that a sliding contact should have at the motion of the last solve [force].
   pure real(wp) function friction_limit(self, table, laws, settings, c)
      class(open_close_type), intent(in) :: self
      type(contact_table_type), intent(in) :: table
      type(contact_law_type), intent(in) :: laws(:)   !! per joint material
      type(joint_settings_type), intent(in) :: settings
      integer, intent(in) :: c                        !! row
      type(joint_type) :: joint
      call self%recall(table, c, joint)
      friction_limit = sliding_friction(laws(table%joint(c)), settings, joint, &
                                        -table%k_n(c)*self%gap(c), self%slip(c))
   end function friction_limit

   !> Arrays for at least n contacts.
   pure subroutine make_room(self, n)
      class(open_close_type), intent(inout), target :: self
      integer, intent(in) :: n
      integer :: m
      if (allocated(self%gap)) then
         if (size(self%gap) < n) deallocate (self%joint, self%normal_force, self%miss, self%gap, self%slip, &
                                               self%changes, self%state_used, self%sign_used, self%friction_used, &
                                               self%bonded_used, self%opened, self%start)
      end if
      if (.not. allocated(self%gap)) then
         m = n + n/32 + 16
         allocate (self%joint(m), self%changes(m), self%state_used(m), self%sign_used(m), self%opened(m), &
                   self%bonded_used(m), self%start(m), self%normal_force(m), self%miss(m), self%gap(m), self%slip(m), &
                   self%friction_used(m))
         self%n_begun = 0
      end if
      if (n <= self%n_begun) return
      m = self%n_begun + 1
      call take_bytes(c_loc(self%joint(m)), int(storage_size(self%joint)/8, i8)*(n - m + 1))
      call take_pages(self%normal_force(m:n))
      call take_pages(self%miss(m:n))
      call take_pages(self%gap(m:n))
      call take_pages(self%slip(m:n))
      ! what `begin_rows` does not set
      self%sign_used(m:n) = 0
      self%bonded_used(m:n) = .false.
      call set_zero(self%friction_used(m:n))
      self%n_begun = n
   end subroutine make_room

   !> What the contacts of a table have with some laws only.
   pure subroutine make_extra_room(self, table, laws)
      class(open_close_type), intent(inout) :: self
      type(contact_table_type), intent(in) :: table
      type(contact_law_type), intent(in) :: laws(:)   !! per joint material
      logical :: is_needed
      is_needed = any(laws%tension > 0) .or. any(laws%dilation > 0) .or. any(has_closed_part(laws)) .or. &
                  has_dashpots(laws, table)
      if (allocated(self%extra)) then
         if (size(self%extra) < table%n .or. .not. is_needed) deallocate (self%extra)
      end if
      if (is_needed .and. .not. allocated(self%extra)) allocate (self%extra(table%n + table%n/32 + 16))
   end subroutine make_extra_room

end module rockdda_interaction_open_close
