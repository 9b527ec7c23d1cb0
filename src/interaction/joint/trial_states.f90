! SPDX-License-Identifier: MIT
!> Trial states, forces and predicted motion of the contacts of a step. They do not change the contact table.
module rockdda_interaction_trial_states
   use rockdda_base_kinds, only : wp, i1, i2, l1
   use rockdda_base_parallel, only : parallel_contacts, piece, n_pieces
   use rockdda_contact_interval_law, only : end_gaps
   use rockdda_contact_table, only : contact_table_type, contact_state, cut_no_interval, is_of_interval, &
      other_row
   use rockdda_interaction_dashpots, only : has_dashpots
   use rockdda_interaction_joint_strength, only : joint_law_type, is_friction_alone
   use rockdda_interaction_intervals, only : interval_response_type, is_two_springs, mean_gap, respond
   use rockdda_interaction_joint_response, only : joint_settings_type, joint_state_type, joint_extra_type, &
      joint_type, recall_joint, sliding_friction, spring_force_of => spring_force, joint_end_type, end_joint
   implicit none
   private
   public :: trial_states_type, no_state, at_level, piece_of_rows, widest_piece

   !> Rows of a piece at most, which cuts no interval.
   integer, parameter :: widest_piece = piece + 1

   !> `state_used` of contacts that have not been in a solve of the attempt.
   integer(i1), parameter :: no_state = -1
   !> After which share of the step's motion the force of a contact acts: of one that is closed at its start, that of
   !> the scheme; of one that closes in the step, 1, as an impulse; of an interval whose open end may strike, or strikes
   !> (rockdda_interaction_striking_ends), that of the scheme, or 1; of one in a blow (there), 1, as an impulse.
   type :: at_level_enum
      integer(i1) :: closed = 1, closes = 2, may_strike = 3, strikes = 4, blow = 5
   end type at_level_enum
   type(at_level_enum), parameter :: at_level = at_level_enum()

   !> Trial states and predicted motion of one step's contacts.
   type :: trial_states_type
      !> When the last solve has paused: contacts change their states only if the force that they miss, over the root of
      !> their stiffness, is larger [root of energy].
      real(wp) :: doubt = 0
      type(joint_state_type), allocatable :: joint(:)   !! trial state, slip direction, friction force and bond
      type(joint_extra_type), allocatable :: extra(:)   !! with dashpots or dilation, else none
      real(wp), allocatable :: normal_force(:)  !! of the last solve; before the first, of the last step
      real(wp), allocatable :: miss(:)        !! what the force of the last solve misses of its law [force]
      integer(i1), allocatable :: state_used(:)   !! state in the last solve (not the trial's with windows_rules)
      integer(i1), allocatable :: sign_used(:)    !! slip direction in the last solve
      real(wp), allocatable :: friction_used(:) !! friction force of the last solve
      logical(l1), allocatable :: bonded_used(:)  !! bond of the last solve
      !> Stiffness along the normal of rows of intervals that are closed on a part: their own, and with the other row;
      !> of the trial and in the last solve [force/length].
      real(wp), allocatable :: own(:), cross(:), own_used(:), cross_used(:)
      real(wp), allocatable :: push(:), push_used(:)   !! their forces at the gaps 0, of a law that is not linear
      logical(l1), allocatable :: partly_used(:)   !! was one of these in the last solve
      real(wp), allocatable :: bond(:)        !! as `bond_end` of the table, what is sound in this attempt
      real(wp), allocatable :: gap(:)         !! predicted gap
      real(wp), allocatable :: slip(:)        !! predicted slip in this step
      integer(i2), allocatable :: changes(:)      !! changes of state in this step so far
      logical(l1), allocatable :: opened(:)       !! at the end of the step, after forces have acted in it
      integer(i1), allocatable :: start(:)    !! one of at_level%...
      !> Share of the step's motion after which the forces of contacts act, by `start`; gap and slip are those there
      !> until `reach_end`. And the factor of their forces in the equations.
      real(wp) :: level(5) = 1, factor(5) = 1
      integer, private :: n_begun = 0         !! rows that have been in use; those behind take no memory yet
   contains
      procedure :: begin
      procedure :: friction_limit
      procedure :: find_ends
      procedure :: recall
      procedure :: strike
      procedure :: gap_at_end
      procedure :: spring_force
      procedure :: force_used
      procedure :: both_bonded
      procedure :: drag_used
   end type trial_states_type

contains

   !> First and last row of piece p, which cuts no interval.
   pure subroutine piece_of_rows(table, p, first, last)
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: p
      integer, intent(out) :: first, last
      first = (p - 1)*piece + 1
      last = min(p*piece, table%n)
      call cut_no_interval(table%n, table%station, first, last)
   end subroutine piece_of_rows

   !> Trial states of the first round are those of the last step.
   subroutine begin(self, table, laws, settings)
      class(trial_states_type), intent(inout) :: self
      type(contact_table_type), intent(in) :: table
      type(joint_law_type), intent(in) :: laws(:)  !! per joint material
      type(joint_settings_type), intent(in) :: settings
      integer :: first, last, n, p
      n = table%n
      self%doubt = 0
      ! one that is open at the start and closes does so at an unknown time: its force at the end is an impulse
      self%level = [settings%level, 1.0_wp, settings%level, 1.0_wp, 1.0_wp]
      self%factor = [1.0_wp, settings%impact, 1.0_wp, 1.0_wp, settings%impact]
      call make_room(self, n)
      call make_extra_room(self, table, laws)
      if (allocated(self%extra)) self%extra(1:n) = joint_extra_type()
      !$omp parallel do default(none) shared(self, table, laws, settings, n) private(p, first, last) schedule(static) &
      !$omp if (n > parallel_contacts)
      do p = 1, n_pieces(n)
         call piece_of_rows(table, p, first, last)
         call begin_rows(first, last, self, table, laws, settings)
      end do
      !$omp end parallel do
   end subroutine begin

   !> `begin` for some of the rows.
   pure subroutine begin_rows(first, last, self, table, laws, settings)
      integer, intent(in) :: first, last
      class(trial_states_type), intent(inout) :: self
      type(contact_table_type), intent(in) :: table
      type(joint_law_type), intent(in) :: laws(:)  !! per joint material
      type(joint_settings_type), intent(in) :: settings
      integer :: c
      self%normal_force(first:last) = table%normal_force(first:last)
      self%gap(first:last) = table%gap(first:last)
      self%slip(first:last) = 0
      self%changes(first:last) = 0
      self%miss(first:last) = 0
      self%opened(first:last) = .false.
      self%state_used(first:last) = no_state
      self%bond(first:last) = table%bond_end(first:last)
      self%partly_used(first:last) = .false.
      do c = first, last
         self%joint(c)%friction = 0
         self%joint(c)%state = table%state(c)
         self%joint(c)%slip_sign = table%slip_sign(c)
         self%joint(c)%bonded = table%bonded(c)
         self%joint(c)%tied = table%tied(c)
         self%joint(c)%worn = .false.
         self%joint(c)%strikes = .false.
         self%joint(c)%partly = .false.
         self%start(c) = merge(at_level%closes, at_level%closed, table%state(c) == contact_state%open)
         if (table%state(c) == contact_state%sliding) call set_friction(self, table, laws, settings, c)
      end do
      do c = first, last
         if (table%station(c) == 1 .and. table%state(c) /= contact_state%open .and. .not. table%tied(c)) &
            call begin_interval(c, self, table, laws, settings)
      end do
   end subroutine begin_rows

   !> An interval that is closed on a part begins with that part.
   pure subroutine begin_interval(c, self, table, laws, settings)
      integer, intent(in) :: c                       !! first row
      class(trial_states_type), intent(inout) :: self
      type(contact_table_type), intent(in) :: table
      type(joint_law_type), intent(in) :: laws(:)  !! per joint material
      type(joint_settings_type), intent(in) :: settings
      type(interval_response_type) :: interval
      type(joint_type) :: joint
      real(wp) :: widest
      integer :: i
      if (is_two_springs(laws(table%joint(c)), table%gap(c:c + 1))) return
      widest = maxval(end_gaps(table%gap(c:c + 1)))
      ! where it touches without force, rounding would decide on which part it is closed, or that it has no stiffness;
      ! in a dynamic step it may have none
      if (.not. any(abs(table%normal_force(c:c + 1)) > 0) .and. &
          .not. (settings%level < 1 .and. widest > settings%open_tolerance)) return
      call respond(laws(table%joint(c)), table, c, logical(table%bonded(c) .and. table%bonded(c + 1)), &
                   table%gap(c:c + 1), settings%open_tolerance, self%bond(c:c + 1), interval)
      self%joint(c:c + 1)%partly = .true.
      self%own(c:c + 1) = interval%own
      self%cross(c:c + 1) = interval%cross
      self%push(c:c + 1) = interval%push
      do i = 1, 2
         if (table%state(c + i - 1) /= contact_state%sliding) cycle
         call self%recall(table, c + i - 1, joint)
         joint%length = interval%length
         joint%broken = interval%broken
         self%joint(c + i - 1)%friction = sliding_friction(laws(table%joint(c)), settings, joint, &
                                                           interval%pressing, 0.0_wp)
      end do
   end subroutine begin_interval

   !> Friction force that a contact begins with.
   pure subroutine set_friction(self, table, laws, settings, c)
      class(trial_states_type), intent(inout) :: self
      type(contact_table_type), intent(in) :: table
      type(joint_law_type), intent(in) :: laws(:)  !! per joint material
      type(joint_settings_type), intent(in) :: settings
      integer, intent(in) :: c                       !! row
      type(joint_type) :: joint
      real(wp) :: pressing
      call self%recall(table, c, joint)
      pressing = table%normal_force(c)
      if (is_of_interval(table, c)) pressing = 0.5_wp*(pressing + table%normal_force(other_row(table, c)))
      self%joint(c)%friction = sliding_friction(laws(table%joint(c)), settings, joint, pressing, 0.0_wp)
   end subroutine set_friction

   !> Force of the normal spring of a contact that was closed in the last solve, at its motion, compression positive.
   pure real(wp) function spring_force(self, table, c) result(force)
      class(trial_states_type), intent(in) :: self
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: c                         !! row
      if (self%joint(c)%partly) then
         force = self%push(c) - (self%own(c)*self%gap(c) + self%cross(c)*self%gap(other_row(table, c)))
      else
         force = spring_force_of(table%k_n(c), self%gap(c))
      end if
   end function spring_force

   !> Are both rows of an interval bonded?
   pure logical function both_bonded(self, c)
      class(trial_states_type), intent(in) :: self
      integer, intent(in) :: c                         !! first row
      both_bonded = self%joint(c)%bonded .and. self%joint(c + 1)%bonded
   end function both_bonded

   !> The same force as the last solve had it, after the contact was judged.
   pure real(wp) function force_used(self, table, c) result(force)
      class(trial_states_type), intent(in) :: self
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: c                         !! row
      if (self%partly_used(c)) then
         force = self%push_used(c) - (self%own_used(c)*self%gap(c) + self%cross_used(c)*self%gap(other_row(table, c)))
      else
         force = spring_force_of(table%k_n(c), self%gap(c))
      end if
   end function force_used

   !> Force of the normal dashpot of a contact in the last solve, against the opening: `force_used` for the dashpots.
   pure real(wp) function drag_used(self, table, c) result(force)
      class(trial_states_type), intent(in) :: self
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: c                         !! row
      integer :: d
      associate (extra => self%extra)
         force = extra(c)%normal_drag*(self%gap(c) - extra(c)%drag_gap)
         if (.not. self%partly_used(c)) return
         d = other_row(table, c)
         force = (self%own_used(c)*force + self%cross_used(c)*extra(c)%normal_drag*(self%gap(d) - extra(d)%drag_gap))/ &
                 table%k_n(c)
      end associate
   end function drag_used

   !> Contacts first to last that were closed in the last solve, at the end of the step.
   pure subroutine find_ends(self, table, first, last, ends)
      class(trial_states_type), intent(in) :: self
      type(contact_table_type), intent(in) :: table    !! at the start of the step
      integer, intent(in) :: first, last               !! rows, at most a piece of them
      type(joint_end_type), intent(inout) :: ends(:)   !! of row first at 1
      integer :: c
      do c = first, last
         if (self%state_used(c) == contact_state%open) cycle
         call end_joint(table%k_n(c), table%k_s(c), merge(0.0_wp, table%shear(c), self%joint(c)%worn), &
                        self%state_used(c), self%sign_used(c), self%friction_used(c), self%gap(c), self%slip(c), &
                        ends(c - first + 1))
      end do
   end subroutine find_ends

   !> A contact with its memory in the table.
   pure subroutine recall(self, table, c, joint)
      class(trial_states_type), intent(in) :: self
      type(contact_table_type), intent(in) :: table    !! at the start of the step
      integer, intent(in) :: c                         !! row
      type(joint_type), intent(inout) :: joint
      call recall_joint(table, c, self%joint(c), self%extra, joint)
      joint%closes = any(self%start(c) == [at_level%closes, at_level%strikes, at_level%blow])
   end subroutine recall

   !> From now on an interval acts at the end of the step.
   pure subroutine strike(self, table, c)
      class(trial_states_type), intent(inout) :: self
      type(contact_table_type), intent(in) :: table    !! at the start of the step
      integer, intent(in) :: c                         !! first row
      real(wp) :: level
      integer :: r
      level = self%level(self%start(c))
      do r = c, c + 1
         self%gap(r) = self%gap_at_end(table, r)
         self%slip(r) = self%slip(r)/level
         self%start(r) = at_level%strikes
         if (.not. allocated(self%extra)) cycle
         self%extra(r)%normal_drag = level*self%extra(r)%normal_drag
         self%extra(r)%drag = level*self%extra(r)%drag
         self%extra(r)%late = -self%extra(r)%opens
      end do
   end subroutine strike

   !> Gap at the end of the step, by the gap where the forces act.
   pure real(wp) function gap_at_end(self, table, c) result(gap)
      class(trial_states_type), intent(in) :: self
      type(contact_table_type), intent(in) :: table  !! at the start of the step
      integer, intent(in) :: c                       !! row
      real(wp) :: late
      late = 0
      if (allocated(self%extra)) late = self%extra(c)%late
      gap = self%gap(c)
      associate (level => self%level(self%start(c)))
         if (level < 1 .or. abs(late) > 0) gap = table%gap(c) + ((gap - table%gap(c)) - late)/level
      end associate
      if (allocated(self%extra)) gap = gap - self%extra(c)%opens
   end function gap_at_end

   !> Friction force that a sliding contact should have at the motion of the last solve [force].
   pure real(wp) function friction_limit(self, table, laws, settings, c)
      class(trial_states_type), intent(in) :: self
      type(contact_table_type), intent(in) :: table
      type(joint_law_type), intent(in) :: laws(:)   !! per joint material
      type(joint_settings_type), intent(in) :: settings
      integer, intent(in) :: c                        !! row
      type(joint_type) :: joint
      type(interval_response_type) :: interval
      real(wp) :: pressing, bond(2)
      integer :: r
      pressing = spring_force_of(table%k_n(c), mean_gap(table, self%gap, c))
      r = c
      if (self%joint(c)%partly) then
         r = min(c, other_row(table, c))
         pressing = 0.5_wp*(self%spring_force(table, r) + self%spring_force(table, r + 1))
      end if
      associate (law => laws(table%joint(c)))
         if (is_friction_alone(law)) then
            friction_limit = law%friction*max(pressing, 0.0_wp)
            return
         end if
         call self%recall(table, c, joint)
         if (self%joint(c)%partly) then
            bond = self%bond(r:r + 1)
            call respond(law, table, r, self%both_bonded(r), self%gap(r:r + 1), settings%open_tolerance, bond, interval)
            joint%length = interval%length
            joint%broken = interval%broken
         end if
         friction_limit = sliding_friction(law, settings, joint, pressing, self%slip(c))
      end associate
   end function friction_limit

   !> Arrays for at least n contacts.
   pure subroutine make_room(self, n)
      class(trial_states_type), intent(inout) :: self
      integer, intent(in) :: n
      integer :: m
      if (allocated(self%gap)) then
         if (size(self%gap) < n) deallocate (self%joint, self%normal_force, self%miss, self%gap, self%slip, &
                                               self%changes, self%state_used, self%sign_used, self%friction_used, &
                                               self%bonded_used, self%opened, self%start, self%own, self%cross, &
                                               self%own_used, self%cross_used, self%partly_used, self%bond, &
                                               self%push, self%push_used)
      end if
      if (.not. allocated(self%gap)) then
         m = n + n/32 + 16
         allocate (self%joint(m), self%changes(m), self%state_used(m), self%sign_used(m), self%opened(m), &
                   self%bonded_used(m), self%start(m), self%normal_force(m), self%miss(m), self%gap(m), self%slip(m), &
                   self%friction_used(m), self%own(m), self%cross(m), self%own_used(m), self%cross_used(m), &
                   self%partly_used(m), self%bond(m), self%push(m), self%push_used(m))
         self%n_begun = 0
      end if
      if (n <= self%n_begun) return
      m = self%n_begun + 1
      ! what `begin_rows` does not set
      self%sign_used(m:n) = 0
      self%bonded_used(m:n) = .false.
      self%friction_used(m:n) = 0
      self%n_begun = n
   end subroutine make_room

   !> What n contacts have with some laws only.
   pure subroutine make_extra_room(self, table, laws)
      class(trial_states_type), intent(inout) :: self
      type(contact_table_type), intent(in) :: table
      type(joint_law_type), intent(in) :: laws(:)   !! per joint material
      logical :: is_needed
      is_needed = any(laws%dilation > 0) .or. has_dashpots(laws, table)
      if (allocated(self%extra)) then
         if (size(self%extra) < table%n .or. .not. is_needed) deallocate (self%extra)
      end if
      if (is_needed .and. .not. allocated(self%extra)) allocate (self%extra(table%n + table%n/32 + 16))
   end subroutine make_extra_room

end module rockdda_interaction_trial_states
