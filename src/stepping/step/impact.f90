! SPDX-License-Identifier: MIT
!> The law of impact: the motion of a step in which contacts with a coefficient of restitution close.
!>
!> A contact that lasts less than a step rebounds by what the place of the impact within the step makes of it.
!> Contacts of joints with `restitution` e that close in a step with a speed of approach are therefore kept open while
!> the step is solved (`mark`): that gives the smooth motion, with all other forces. At the instant at which a gap
!> closes impulses act between blocks that are rigid for that instant (Newton's law):
!>
!>     contacts that meet            v+ = -e v-,            P >= 0,    |Q| <= mu P
!>     contacts that touch           v+ >= min(0, v-),      P >= 0,    |Q| <= mu P
!>     ties and bonds that hold      v+ = v-, along both lines
!>
!> P the normal and Q the shear impulse, which stops the slip or is limited by friction; v- of the smooth motion. A blow
!> so goes through a pile at once, as between rigid blocks; a closed contact that a blow does not press gets no impulse.
!> All contacts that blows reach are solved for together (Gauss-Seidel). The motion of the step changes by what the
!> impulses move the blocks in the rest of the step. Blocks with two fixed points take part as immovable, blocks with
!> one as turning about it. No set of impulses on blocks that reach each other may give energy: they are scaled down to
!> what these had.
!>
!> Each end of an interval meets by itself: in the step the whole interval has impulses at both ends in place of
!> springs. Springs decide where loads change the velocity in a step by half the speed of approach, so that contacts
!> come to rest. Bolts are soft: they take part in the smooth motion alone.
module rockdda_stepping_impact
   use rockdda_base_kinds, only : wp, i1
   use rockdda_contact_interval_law, only : at_point, end_gaps
   use rockdda_contact_table, only : contact_table_type, contact_state, is_of_interval, other_row
   use rockdda_interaction_attempt, only : attempt_type
   use rockdda_interaction_joint_strength, only : joint_law_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_intervals, only : end_gap, interval_response_type, respond
   use rockdda_interaction_joint_response, only : joint_settings_type
   use rockdda_interaction_open_close, only : open_close_type, closing_gap
   use rockdda_interaction_trial_states, only : at_level
   use rockdda_stepping_impulses, only : line_type, demand_type, set_lines, n_held, motion, set_demand, solve, &
      limit_energy
   implicit none
   private
   public :: impact_type

   !> Blocks that a gap below this share of w0 parts pass a blow on at once.
   real(wp), parameter :: touching = 1.0e-6_wp

   type :: impact_type
      logical :: happened = .false.                    !! in this step
      logical, allocatable, private :: yields(:)       !! (rows) no impact in this attempt: springs decide
      logical, allocatable, private :: takes_part(:)   !! (nb)
      real(wp), allocatable, private :: change(:, :)   !! (3, nb) of velocities, from those by the motion of the step
   contains
      procedure :: begin
      procedure :: mark
      procedure :: find
      procedure :: keep_slip
      procedure :: finish
   end type impact_type

contains

   !> Begin an attempt at a step: nothing is known of its contacts.
   pure subroutine begin(self, n)
      class(impact_type), intent(inout) :: self
      integer, intent(in) :: n       !! rows of the contact table
      if (allocated(self%yields)) then
         if (size(self%yields) < n) deallocate (self%yields)
      end if
      if (.not. allocated(self%yields)) allocate (self%yields(n + n/4))
      self%yields = .false.
   end subroutine begin

   !> After a solution: keep contacts open that meet in the step by the law of impact, and leave those to their springs
   !> that turn out to meet too slowly. The step is to be solved again unless all is settled. A row changes twice at
   !> most.
   subroutine mark(self, context, attempt, table, trial, laws, x, is_settled)
      class(impact_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(contact_table_type), intent(in) :: table       !! of the step's start
      type(open_close_type), intent(inout) :: trial
      type(joint_law_type), intent(in) :: laws(:)       !! per joint material
      real(wp), intent(in), contiguous :: x(:, :)         !! (6, nb) unknowns of the step
      logical, intent(out) :: is_settled
      real(wp), allocatable :: free(:, :), gap(:)
      type(line_type) :: lines(2)
      type(demand_type) :: demand
      integer :: c
      is_settled = .true.
      if (.not. any(laws%restitution >= 0)) return
      gap = [(trial%gap_at_end(table, c), c=1, table%n)]
      do c = 1, table%n
         if (.not. was_apart(table, c) .or. laws(table%joint(c))%restitution < 0) cycle
         if (self%yields(c)) cycle
         if (trial%joint(c)%strikes) then
            if (.not. allocated(free)) free = free_velocity(context, attempt, x)
            call set_lines(context, attempt, table, c, lines)
            call set_demand(lines(1), context%state%velocity, free, 1.0_wp, laws(table%joint(c))%restitution, demand)
            if (demand%is_impact) cycle
            self%yields(c) = .true.
            trial%joint(c)%strikes = .false.
            is_settled = .false.
         else if (has_met(table, trial, gap, c)) then
            call set_lines(context, attempt, table, c, lines)
            if (.not. motion(lines(1), context%state%velocity) < 0) cycle
            trial%joint(c)%strikes = .true.
            trial%joint(c)%state = int(contact_state%open, i1)
            is_settled = .false.
         end if
      end do
      ! an interval is open as a whole
      do c = 1, table%n
         if (table%station(c) /= 1) cycle
         if (any(trial%joint(c:c + 1)%strikes)) trial%joint(c:c + 1)%state = int(contact_state%open, i1)
      end do
   end subroutine mark

   !> Were the blocks apart, at the start of the step, at a contact or at that end of an interval?
   pure logical function was_apart(table, c)
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: c                 !! row
      was_apart = table%state(c) == contact_state%open
      if (.not. was_apart .and. is_of_interval(table, c) .and. .not. table%tied(c)) &
         was_apart = end_gap(table, table%gap, c) > 0
   end function was_apart

   !> Are they together there in the solution?
   pure logical function has_met(table, trial, gap, c)
      type(contact_table_type), intent(in) :: table
      type(open_close_type), intent(in) :: trial
      real(wp), intent(in), contiguous :: gap(:)   !! (>= rows) at the end of the step [length]
      integer, intent(in) :: c                 !! row
      real(wp) :: there
      has_met = trial%state_used(c) /= contact_state%open
      if (.not. is_of_interval(table, c) .or. table%tied(c)) return
      there = end_gap(table, gap, c)
      has_met = has_met .and. there < 0
      ! where the other end meets, an end meets with it that would in the next step
      if (trial%joint(other_row(table, c))%strikes) has_met = has_met .or. 2*there < end_gap(table, table%gap, c)
   end function has_met

   !> Are they, or as near to each other as passes a blow on?
   pure logical function touches(context, table, trial, gap, c)
      type(step_context_type), intent(in) :: context
      type(contact_table_type), intent(in) :: table
      type(open_close_type), intent(in) :: trial
      real(wp), intent(in), contiguous :: gap(:)   !! (>= rows) at the end of the step [length]
      integer, intent(in) :: c                 !! row
      touches = has_met(table, trial, gap, c) .or. end_gap(table, gap, c) <= touching*context%parameters%w0
   end function touches

   !> Velocities and spins at the end of a step by its motion.
   pure function free_velocity(context, attempt, x) result(free)
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      real(wp), intent(in) :: x(:, :)        !! (6, nb)
      real(wp), allocatable :: free(:, :)
      free = (2/attempt%dt)*x(1:3, :) - context%state%velocity(1:3, :)
   end function free_velocity

   !> Before a step is taken over: put the motion of the impacts into the unknowns of the blocks that they reach.
   subroutine find(self, context, attempt, table, trial, settings, laws, x)
      class(impact_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(contact_table_type), intent(in) :: table       !! of the step's start
      type(open_close_type), intent(in) :: trial
      type(joint_settings_type), intent(in) :: settings
      type(joint_law_type), intent(in) :: laws(:)       !! per joint material
      real(wp), intent(inout), contiguous :: x(:, :)      !! (6, nb) unknowns of the step
      type(line_type), allocatable :: lines(:, :)         !! (normal and shear, contacts)
      type(demand_type), allocatable :: demands(:)
      real(wp), allocatable :: free(:, :), v(:, :), w(:, :), gap(:)
      logical, allocatable :: reached(:)
      integer, allocatable :: rows(:), group(:)
      real(wp), allocatable :: pressed(:)
      integer :: b, c, i, n
      self%happened = .false.
      if (.not. any(trial%joint(1:table%n)%strikes)) return
      free = free_velocity(context, attempt, x)
      gap = [(trial%gap_at_end(table, c), c=1, table%n)]
      allocate (reached(size(x, 2)), source=.false.)
      allocate (v, w, mold=free)
      do
         call find_reached(context, attempt, table, trial, gap, reached)
         rows = pack([(c, c=1, table%n)], reached(table%block_a(1:table%n)) .or. reached(table%block_b(1:table%n)))
         n = size(rows)
         if (allocated(lines)) deallocate (lines, demands)
         allocate (lines(2, n), demands(n))
         do i = 1, n
            call set_lines(context, attempt, table, rows(i), lines(:, i))
            call set_demands(rows(i), lines(:, i), demands(i))
         end do
         if (.not. any(demands%is_impact)) return
         v = free
         call solve(lines, demands, laws(table%joint(rows)), v)
         ! what the contacts let the blocks move
         w = 0
         do i = 1, n
            call set_places(rows(i), lines(1, i), demands(i))
         end do
         call solve(lines, demands, laws(table%joint(rows)), w)
         ! blocks that are pushed push others
         if (all(reached .or. .not. [(any(abs(w(:, b)) > 0), b=1, size(w, 2))])) exit
         reached = reached .or. [(any(abs(w(:, b)) > 0), b=1, size(w, 2))]
      end do
      group = groups_of(context, attempt, table, pack(rows, demands%acts))
      allocate (pressed(size(group)), source=0.0_wp)
      do i = 1, n
         if (demands(i)%is_impact .or. trial%state_used(rows(i)) == contact_state%open) cycle
         b = max(group(table%block_a(rows(i))), group(table%block_b(rows(i))))
         if (b > 0) pressed(b) = pressed(b) + 0.5_wp*table%k_n(rows(i))*min(0.0_wp, attempt%dt*motion(lines(1, i), &
            w))**2
      end do
      do b = 1, size(group)
         if (group(b) == b) call limit_energy(context, group == b, free, pressed(b), v, w)
      end do
      x(1:3, :) = x(1:3, :) + attempt%dt*w
      self%happened = .true.
      self%takes_part = [(any(abs(v(:, b) - free(:, b)) > 0 .or. abs(w(:, b)) > 0), b=1, size(v, 2))]
      self%change = (v - free) - attempt%scheme%velocity_of_motion()*w

   contains

      !> Velocities that the law demands of a contact at the end of the step.
      subroutine set_demands(c, line, demand)
         integer, intent(in) :: c                 !! row
         type(line_type), intent(in) :: line(2)
         type(demand_type), intent(out) :: demand
         logical :: strikes
         strikes = trial%joint(c)%strikes
         ! with the other end of its interval
         if (is_of_interval(table, c)) strikes = strikes .or. trial%joint(other_row(table, c))%strikes .and. &
                                                 end_gap(table, gap, c) < 0
         if (strikes .and. table%state(c) == contact_state%open .and. .not. has_met(table, trial, gap, c)) &
            strikes = end_gap(table, gap, c) < closing_gap(settings, table%offset(c), .false.)
         if (strikes) then
            call set_demand(line(1), context%state%velocity, free, share_before(end_gap(table, table%gap, c), &
                                                                                end_gap(table, gap, c)), &
                            laws(table%joint(c))%restitution, demand)
            ! `mark` has kept it open for this
            demand%is_impact = demand%speed > 0 .and. line(1)%mobility > 0
            demand%acts = demand%is_impact
         end if
         if (demand%acts) return
         if (touches(context, table, trial, gap, c)) then
            ! what touches without force passes a blow on, too
            demand%acts = line(1)%mobility > 0
            demand%target(1) = motion(line(1), free)
            demand%holds = table%tied(c) .or. (trial%joint(c)%bonded .and. laws(table%joint(c))%tension > 0)
            if (demand%holds) then
               demand%target(2) = motion(line(2), free)
            else
               demand%target(1) = min(0.0_wp, demand%target(1))
            end if
         end if
      end subroutine set_demands

      !> Mean velocities that correct the motion of the step: contacts that meet are apart at its end as they leave each
      !> other, closed ones are not pressed further, and what is open does not get deeper than it is or was.
      subroutine set_places(c, line, demand)
         integer, intent(in) :: c                 !! row
         type(line_type), intent(in) :: line
         type(demand_type), intent(inout) :: demand
         demand%is_smooth = .true.
         if (demand%is_impact) then
            demand%target(1) = (max(0.0_wp, motion(line, v))*(1 - demand%share)*attempt%dt - &
                                end_gap(table, gap, c))/attempt%dt
         else if (has_met(table, trial, gap, c)) then
            demand%target = 0
         else
            demand%acts = line%mobility > 0
            demand%target(1) = min(0.0_wp, (min(0.0_wp, end_gap(table, table%gap, c)) - end_gap(table, gap, c))/ &
                                   attempt%dt)
         end if
      end subroutine set_places

   end subroutine find

   !> Blocks that some contacts join, by the first one of each group; 0 where a block cannot move.
   pure function groups_of(context, attempt, table, rows) result(group)
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: rows(:)
      integer, allocatable :: group(:)         !! (nb)
      integer :: b, i, sides(2)
      logical :: changed
      group = [(merge(b, 0, n_held(context, attempt, b) < 2), b=1, context%blocks%n_blocks)]
      changed = .true.
      do while (changed)
         changed = .false.
         do i = 1, size(rows)
            sides = [table%block_a(rows(i)), table%block_b(rows(i))]
            if (any(group(sides) == 0) .or. group(sides(1)) == group(sides(2))) cycle
            group(sides) = minval(group(sides))
            changed = .true.
         end do
      end do
   end function groups_of

   !> Share of the step after which a gap closes that is linear in it.
   pure real(wp) function share_before(before, after) result(share)
      real(wp), intent(in) :: before, after     !! gaps at the start and the end of the step [length]
      share = 0
      if (before > 0) share = 1
      if (before > 0 .and. after < 0) share = before/(before - after)
   end function share_before

   !> Blocks that impacts can reach: those that meet, and those that hang on them, or on blocks reached before, by
   !> closed contacts, but for those that cannot move.
   subroutine find_reached(context, attempt, table, trial, gap, reached)
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(contact_table_type), intent(in) :: table
      type(open_close_type), intent(in) :: trial
      real(wp), intent(in), contiguous :: gap(:)         !! (>= rows) at the end of the step [length]
      logical, intent(inout) :: reached(:)               !! (nb)
      logical, allocatable :: moves(:)
      integer :: b, c, sides(2)
      logical :: changed
      allocate (moves(size(reached)))
      do b = 1, size(reached)
         moves(b) = n_held(context, attempt, b) < 2
      end do
      do
         changed = .false.
         do c = 1, table%n
            sides = [table%block_a(c), table%block_b(c)]
            if (trial%joint(c)%strikes) then
               if (all(reached(sides) .or. .not. moves(sides))) cycle
            else
               if (.not. touches(context, table, trial, gap, c)) cycle
               if (.not. (any(reached(sides)) .and. any(moves(sides) .and. .not. reached(sides)))) cycle
            end if
            reached(sides) = moves(sides)
            changed = .true.
         end do
         if (.not. changed) return
      end do
   end subroutine find_reached

   !> After the motions of all links have been found anew: shear springs of closed contacts have the slip of the smooth
   !> motion, as if they had slid by the rest.
   pure subroutine keep_slip(self, slip, trial)
      class(impact_type), intent(in) :: self
      real(wp), intent(in) :: slip(:)              !! (>= rows) of the smooth motion [length]
      type(open_close_type), intent(inout) :: trial
      integer :: n
      n = size(self%yields)
      n = min(n, size(slip), size(trial%slip))
      trial%slip(1:n) = slip(1:n)
   end subroutine keep_slip

   !> After the blocks have moved: their velocities. What open contacts overlap at the end is a gap that is free of
   !> force. Where one end of an interval met, the other one stays pressed as it was.
   subroutine finish(self, context, laws, table, trial, stored)
      class(impact_type), intent(in) :: self
      type(step_context_type), intent(inout) :: context
      type(joint_law_type), intent(in) :: laws(:)       !! per joint material
      type(contact_table_type), intent(inout) :: table    !! of the step's end
      type(open_close_type), intent(in) :: trial
      real(wp), intent(inout) :: stored                   !! in the springs [energy]
      integer :: b, c
      do b = 1, size(self%takes_part)
         if (self%takes_part(b)) context%state%velocity(1:3, b) = context%state%velocity(1:3, b) + self%change(:, b)
      end do
      do c = 1, table%n
         if (.not. (self%takes_part(table%block_a(c)) .or. self%takes_part(table%block_b(c)))) cycle
         if (table%state(c) /= contact_state%open .or. table%partner(c) /= 0) cycle
         if (.not. is_of_interval(table, c)) then
            table%offset(c) = table%offset(c) + min(0.0_wp, trial%gap(c))
         else if (table%station(c) == 1) then
            call leave_interval(laws(table%joint(c)), trial, c, table, stored)
         end if
      end do
   end subroutine finish

   !> `finish` of an interval.
   pure subroutine leave_interval(law, trial, c, table, stored)
      type(joint_law_type), intent(in) :: law
      type(open_close_type), intent(in) :: trial
      integer, intent(in) :: c                            !! first row
      type(contact_table_type), intent(inout) :: table
      real(wp), intent(inout) :: stored                   !! [energy]
      type(interval_response_type) :: interval
      real(wp) :: before(2), free(2), gap(2), bond(2)
      before = 0
      free = end_gaps(trial%gap(c:c + 1))
      if (trial%start(c) /= at_level%closes) before = min(0.0_wp, end_gaps(table%gap(c:c + 1)))
      ! what leaves is let go
      where (free > before) before = 0
      free = min(0.0_wp, free - before)
      free = at_point(free, free([2, 1]))
      table%offset(c:c + 1) = table%offset(c:c + 1) + free
      gap = trial%gap(c:c + 1) - free
      bond = 0
      call respond(law, table, c, .false., gap, 0.0_wp, bond, interval)
      if (.not. interval%lowest < 0) return
      table%state(c:c + 1) = int(contact_state%locked, i1)
      table%normal_force(c:c + 1) = interval%force
      table%energy(c:c + 1) = -0.5_wp*interval%force*gap
      stored = stored + sum(table%energy(c:c + 1))
   end subroutine leave_interval

end module rockdda_stepping_impact
