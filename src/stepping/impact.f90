! SPDX-License-Identifier: MIT
!> The law of impact: the motion of a step in which contacts with a coefficient of restitution close.
!>
!> A contact that lasts less than a step rebounds with whatever the place of the impact within the step makes of it.
!> Contacts of joints with `restitution` e that close in a step with a speed of approach are therefore kept open while
!> the step is solved (`mark`): that gives the smooth motion, with all other forces. At the instant at which a gap
!> closes impulses act between blocks that are rigid for that instant (Newton's law):
!>
!>     contacts that meet            v+ = -e v-,            P >= 0,    |Q| <= mu P
!>     contacts that are closed      v+ >= min(0, v-),      P >= 0,    |Q| <= mu P
!>     ties and bonds that hold      v+ = v-, along both lines
!>
!> P the normal and Q the shear impulse, which stops the slip or is limited by friction; v- of the smooth motion. A blow
!> so goes through a pile at once, as between rigid blocks; a closed contact that a blow does not press gets no impulse.
!> All contacts that blows reach are solved for together (Gauss-Seidel). The motion of the step changes by what the
!> impulses move the blocks in the rest of the step. Blocks with two fixed points take part as immovable, blocks with
!> one as turning about it. No set of impulses may give energy: they are scaled down to what the blocks had.
!>
!> Of an interval the ends meet, and stations between with them. Springs decide where loads change the velocity in a
!> step by half the speed of approach, so that contacts come to rest. Bolts are soft: they take part in the smooth
!> motion alone.
module rockdda_stepping_impact
   use rockdda_base_kinds, only : wp, i1
   use rockdda_contact_corners, only : corner_station
   use rockdda_contact_table, only : contact_table_type, contact_state
   use rockdda_interaction_closed_part, only : last_of_interval
   use rockdda_interaction_closing, only : closing_gap
   use rockdda_interaction_contact_law, only : contact_law_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_joint_law, only : joint_settings_type
   use rockdda_interaction_open_close, only : open_close_type
   use rockdda_stepping_impulses, only : line_type, demand_type, set_lines, n_held, motion, set_demand, solve, &
      limit_energy
   implicit none
   private
   public :: impact_type

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
   subroutine mark(self, context, table, trial, laws, x, is_settled)
      class(impact_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(contact_table_type), intent(in) :: table       !! of the step's start
      type(open_close_type), intent(inout) :: trial
      type(contact_law_type), intent(in) :: laws(:)       !! per joint material
      real(wp), intent(in), contiguous :: x(:, :)         !! (6, nb) unknowns of the step
      logical, intent(out) :: is_settled
      real(wp), allocatable :: free(:, :)
      type(line_type) :: lines(2)
      type(demand_type) :: demand
      integer :: c, first, i, last
      is_settled = .true.
      if (.not. any(laws%restitution >= 0)) return
      first = 1
      do while (first <= table%n)
         last = last_of_interval(table, first)
         do c = first, last
            if (table%state(c) /= contact_state%open .or. laws(table%joint(c))%restitution < 0) cycle
            if (self%yields(c)) cycle
            if (trial%joint(c)%strikes) then
               if (is_between(table, first, last, c)) cycle
               if (.not. allocated(free)) free = free_velocity(context, x)
               call set_lines(context, table, c, lines)
               call set_demand(lines(1), context%state%velocity, free, 1.0_wp, laws(table%joint(c))%restitution, demand)
               if (demand%is_impact) cycle
               self%yields(c) = .true.
               trial%joint(c)%strikes = .false.
               is_settled = .false.
            else if (trial%state_used(c) /= contact_state%open .and. .not. is_between(table, first, last, c)) then
               call set_lines(context, table, c, lines)
               if (.not. motion(lines(1), context%state%velocity) < 0) cycle
               call keep_open(c)
            end if
         end do
         ! between ends that meet nothing may press
         if (any(trial%joint(first:last)%strikes)) then
            do c = first, last
               if (is_between(table, first, last, c) .and. closes(c)) call keep_open(c)
            end do
         end if
         do c = first, last
            if (.not. (is_between(table, first, last, c) .and. trial%joint(c)%strikes)) cycle
            if (any(trial%joint(first:last)%strikes .and. &
                    .not. [(is_between(table, first, last, i), i=first, last)])) cycle
            trial%joint(c)%strikes = .false.
            is_settled = .false.
         end do
         first = last + 1
      end do

   contains

      !> Has a row closed in the solution?
      pure logical function closes(c)
         integer, intent(in) :: c
         closes = table%state(c) == contact_state%open .and. trial%state_used(c) /= contact_state%open .and. &
                  .not. trial%joint(c)%strikes
      end function closes

      !> Keep a row open in the next solution.
      subroutine keep_open(c)
         integer, intent(in) :: c
         trial%joint(c)%strikes = .true.
         trial%joint(c)%state = int(contact_state%open, i1)
         is_settled = .false.
      end subroutine keep_open

   end subroutine mark

   !> Is a row of an interval a station between its ends?
   pure logical function is_between(table, first, last, c)
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: first, last, c     !! rows: first and last of the interval, and this one
      is_between = c > first .and. c < last
      if (is_between) is_between = all(table%station(c:c + 1) /= corner_station)
   end function is_between

   !> Velocities and spins at the end of a step by its motion.
   pure function free_velocity(context, x) result(free)
      type(step_context_type), intent(in) :: context
      real(wp), intent(in) :: x(:, :)        !! (6, nb)
      real(wp), allocatable :: free(:, :)
      free = (2/context%dt)*x(1:3, :) - context%state%velocity(1:3, :)
   end function free_velocity

   !> Before a step is taken over: put the motion of the impacts into the unknowns of the blocks that they reach.
   subroutine find(self, context, table, trial, settings, laws, x)
      class(impact_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(contact_table_type), intent(in) :: table       !! of the step's start
      type(open_close_type), intent(in) :: trial
      type(joint_settings_type), intent(in) :: settings
      type(contact_law_type), intent(in) :: laws(:)       !! per joint material
      real(wp), intent(inout), contiguous :: x(:, :)      !! (6, nb) unknowns of the step
      type(line_type), allocatable :: lines(:, :)         !! (normal and shear, contacts)
      type(demand_type), allocatable :: demands(:)
      real(wp), allocatable :: free(:, :), v(:, :), w(:, :)
      logical, allocatable :: reached(:)
      integer, allocatable :: rows(:)
      real(wp) :: pressed
      integer :: b, c, i, n
      self%happened = .false.
      if (.not. any(trial%joint(1:table%n)%strikes)) return
      free = free_velocity(context, x)
      allocate (reached(size(x, 2)), source=.false.)
      allocate (v, w, mold=free)
      do
         call find_reached(context, table, trial, reached)
         rows = pack([(c, c=1, table%n)], reached(table%block_a(1:table%n)) .or. reached(table%block_b(1:table%n)))
         n = size(rows)
         if (allocated(lines)) deallocate (lines, demands)
         allocate (lines(2, n), demands(n))
         do i = 1, n
            call set_lines(context, table, rows(i), lines(:, i))
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
      pressed = 0
      do i = 1, n
         if (demands(i)%is_impact .or. trial%state_used(rows(i)) == contact_state%open) cycle
         pressed = pressed + 0.5_wp*table%k_n(rows(i))*min(0.0_wp, context%dt*motion(lines(1, i), w))**2
      end do
      call limit_energy(context, free, pressed, v, w)
      x(1:3, :) = x(1:3, :) + context%dt*w
      self%happened = .true.
      self%takes_part = [(any(abs(v(:, b) - free(:, b)) > 0 .or. abs(w(:, b)) > 0), b=1, size(v, 2))]
      self%change = (v - free) - context%scheme%velocity_of_motion()*w

   contains

      !> Velocities that the law demands of a contact at the end of the step.
      subroutine set_demands(c, line, demand)
         integer, intent(in) :: c                 !! row
         type(line_type), intent(in) :: line(2)
         type(demand_type), intent(out) :: demand
         if (trial%joint(c)%strikes) then
            if (.not. trial%gap(c) < closing_gap(settings, table%offset(c), .false.)) return
            call set_demand(line(1), context%state%velocity, free, share_before(table%gap(c), trial%gap(c)), &
                            laws(table%joint(c))%restitution, demand)
            ! `mark` has kept it open for this
            demand%is_impact = demand%speed > 0 .and. line(1)%mobility > 0
            demand%acts = demand%is_impact
         else if (trial%state_used(c) /= contact_state%open) then
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
            demand%target(1) = (max(0.0_wp, motion(line, v))*(1 - demand%share)*context%dt - trial%gap(c))/context%dt
         else if (trial%state_used(c) /= contact_state%open) then
            demand%target = 0
         else
            demand%acts = line%mobility > 0
            demand%target(1) = min(0.0_wp, (min(0.0_wp, table%gap(c)) - trial%gap(c))/context%dt)
         end if
      end subroutine set_places

   end subroutine find

   !> Share of the step after which a gap closes that is linear in it.
   pure real(wp) function share_before(before, after) result(share)
      real(wp), intent(in) :: before, after     !! gaps at the start and the end of the step [length]
      share = 0
      if (before > 0) share = 1
      if (before > 0 .and. after < 0) share = before/(before - after)
   end function share_before

   !> Blocks that impacts can reach: those that meet, and those that hang on them, or on blocks reached before, by
   !> closed contacts, but for those that cannot move.
   subroutine find_reached(context, table, trial, reached)
      type(step_context_type), intent(in) :: context
      type(contact_table_type), intent(in) :: table
      type(open_close_type), intent(in) :: trial
      logical, intent(inout) :: reached(:)               !! (nb)
      logical, allocatable :: moves(:)
      integer :: b, c, sides(2)
      logical :: changed
      allocate (moves(size(reached)))
      do b = 1, size(reached)
         moves(b) = n_held(context, b) < 2
      end do
      do
         changed = .false.
         do c = 1, table%n
            sides = [table%block_a(c), table%block_b(c)]
            if (trial%joint(c)%strikes) then
               if (all(reached(sides) .or. .not. moves(sides))) cycle
            else
               if (trial%state_used(c) == contact_state%open) cycle
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
   !> force.
   subroutine finish(self, context, table, trial)
      class(impact_type), intent(in) :: self
      type(step_context_type), intent(inout) :: context
      type(contact_table_type), intent(inout) :: table    !! of the step's end
      type(open_close_type), intent(in) :: trial
      integer :: b, c
      do b = 1, size(self%takes_part)
         if (self%takes_part(b)) context%state%velocity(1:3, b) = context%state%velocity(1:3, b) + self%change(:, b)
      end do
      do c = 1, table%n
         if (.not. (self%takes_part(table%block_a(c)) .or. self%takes_part(table%block_b(c)))) cycle
         if (table%state(c) == contact_state%open .and. table%partner(c) == 0) &
            table%offset(c) = table%offset(c) + min(0.0_wp, trial%gap(c))
      end do
   end subroutine finish

end module rockdda_stepping_impact
