! SPDX-License-Identifier: MIT
!> The law of impact: the motion of a step in which contacts with a coefficient of restitution close.
!>
!> A contact that lasts less than a step rebounds with whatever the place of the impact within the step makes of it.
!> Contacts of joints with `restitution` e that close in a step with a speed of approach are therefore kept open while
!> the step is solved (`mark`): that gives the smooth motion, with all other forces. At the instant at which a gap closes
!> impulses act between blocks that are rigid for that instant (Newton's law):
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
!> Of an interval the ends meet, with the first station between them. Springs decide where loads change the velocity in a step by
!> half the speed of approach, so that contacts come to rest. Bolts are soft: they take part in the smooth motion alone.
module rockdda_stepping_impact
   use rockdda_base_kinds, only : wp, i1
   use rockdda_contact_corners, only : corner_station
   use rockdda_contact_table, only : contact_table_type, contact_state
   use rockdda_interaction_closed_part, only : last_of_interval
   use rockdda_interaction_closing, only : closing_gap
   use rockdda_interaction_contact_law, only : contact_law_type, friction_coefficient
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_joint_law, only : joint_settings_type
   use rockdda_interaction_kinematics, only : mass_times
   use rockdda_interaction_open_close, only : open_close_type
   implicit none
   private
   public :: impact_type

   !> Sweeps over all impulses at most, and the change over the speed of approach that is small enough.
   integer, parameter :: most_sweeps = 500
   real(wp), parameter :: settled = 1.0e-10_wp
   !> Below this many times the change of velocity in the step a speed of approach is no impact.
   real(wp), parameter :: least_speed = 2

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

   !> One impulse: rows of the motion of the contact, in the velocities and spins of both blocks.
   type :: line_type
      integer :: a = 0, b = 0                       !! blocks
      real(wp) :: of_a(3) = 0, of_b(3) = 0          !! velocity along the line = of_a . v_a + of_b . v_b
      real(wp) :: change_a(3) = 0, change_b(3) = 0  !! change of v_a and v_b by the impulse 1
      real(wp) :: mobility = 0                      !! change of velocity along the line by the impulse 1 [1/mass]
   end type line_type

   !> What the law demands of one contact.
   type :: demand_type
      real(wp) :: target(2) = 0                     !! velocity at the end of the step: normal, and along the edge
      real(wp) :: speed = 0                         !! of approach
      real(wp) :: share = 1                         !! of the step that passes before the impact
      logical :: is_impact = .false.
      logical :: acts = .false.                     !! it can have impulses
      logical :: holds = .false.                    !! of any sign
      logical :: is_smooth = .false.                !! without friction
   end type demand_type

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
            if (any(trial%joint(first:last)%strikes .and. .not. [(is_between(table, first, last, i), i=first, last)])) cycle
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

   !> Blocks that impacts can reach: those that meet, and those that hang on them, or on blocks reached before, by closed
   !> contacts, but for those that cannot move.
   subroutine find_reached(context, table, trial, reached)
      type(step_context_type), intent(in) :: context
      type(contact_table_type), intent(in) :: table
      type(open_close_type), intent(in) :: trial
      logical, intent(inout) :: reached(:)               !! (nb)
      logical, allocatable :: moves(:)
      integer :: b, c, sides(2)
      logical :: changed
      moves = [(n_held(context, b) < 2, b=1, size(reached))]
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

   !> Normal and shear line of a contact.
   pure subroutine set_lines(context, table, c, lines)
      type(step_context_type), intent(in) :: context
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: c                 !! row
      type(line_type), intent(out) :: lines(2)
      real(wp) :: along(2), r(2)
      integer :: k
      along = table%normal(:, c)
      do k = 1, 2
         lines(k)%a = table%block_a(c)
         lines(k)%b = table%block_b(c)
         r = table%point(:, c) - context%state%centroid(:, lines(k)%a)
         lines(k)%of_a = [along, r(1)*along(2) - r(2)*along(1)]
         r = table%point(:, c) - context%state%centroid(:, lines(k)%b)
         lines(k)%of_b = -[along, r(1)*along(2) - r(2)*along(1)]
         lines(k)%change_a = change(context, lines(k)%a, lines(k)%of_a)
         lines(k)%change_b = change(context, lines(k)%b, lines(k)%of_b)
         lines(k)%mobility = dot_product(lines(k)%of_a, lines(k)%change_a) + &
                             dot_product(lines(k)%of_b, lines(k)%change_b)
         ! the edge lies a quarter turn from its normal
         along = [-along(2), along(1)]
      end do
   end subroutine set_lines

   !> Change of velocity and spin of a rigid block by an impulse and its moment.
   pure function change(context, block, impulse) result(v)
      type(step_context_type), intent(in) :: context
      integer, intent(in) :: block
      real(wp), intent(in) :: impulse(3)
      real(wp) :: v(3), arm(2), spin(3), inertia
      integer :: p
      associate (state => context%state)
         inertia = state%mass(block)*(state%moments(1, block) + state%moments(2, block))/state%area(block)
         v = [impulse(1:2)/state%mass(block), impulse(3)/inertia]
         if (n_held(context, block) == 0) return
         v = 0
         if (n_held(context, block) > 1) return
         arm = 0
         do p = 1, context%blocks%fixed%n
            if (is_held(context, p, block)) arm = state%centroid(:, block) - state%fixed_position(:, p)
         end do
         spin = [-arm(2), arm(1), 1.0_wp]
         v = spin*(dot_product(spin, impulse)/(inertia + state%mass(block)*dot_product(arm, arm)))
      end associate
   end function change

   !> Number of fixed points that hold a block; an edge that a boundary holds counts as two.
   pure integer function n_held(context, block)
      type(step_context_type), intent(in) :: context
      integer, intent(in) :: block
      integer :: p
      n_held = count([(is_held(context, p, block), p=1, context%blocks%fixed%n)])
      if (allocated(context%held)) n_held = n_held + merge(2, 0, context%held(block))
   end function n_held

   !> Does fixed point p hold this block?
   pure logical function is_held(context, p, block)
      type(step_context_type), intent(in) :: context
      integer, intent(in) :: p, block
      is_held = context%blocks%fixed%block(p) == block
      if (is_held .and. allocated(context%released)) is_held = .not. context%released(p)
   end function is_held

   !> Velocity along a line.
   pure real(wp) function motion(line, v)
      type(line_type), intent(in) :: line
      real(wp), intent(in) :: v(:, :)     !! (>= 3, nb)
      motion = dot_product(line%of_a, v(1:3, line%a)) + dot_product(line%of_b, v(1:3, line%b))
   end function motion

   !> Velocities after a normal and a shear impulse.
   pure subroutine push(lines, impulse, v)
      type(line_type), intent(in) :: lines(2)
      real(wp), intent(in) :: impulse(2)
      real(wp), intent(inout) :: v(:, :)
      integer :: k
      do k = 1, 2
         v(:, lines(k)%a) = v(:, lines(k)%a) + impulse(k)*lines(k)%change_a
         v(:, lines(k)%b) = v(:, lines(k)%b) + impulse(k)*lines(k)%change_b
      end do
   end subroutine push

   !> Normal velocity that a contact must have at the end of the step. What loads add up to the impact belongs to the
   !> approach, the rest comes after it.
   pure subroutine set_demand(line, before, free, share, restitution, demand)
      type(line_type), intent(in) :: line
      real(wp), intent(in) :: before(:, :), free(:, :) !! velocities at the start, and at the end without the impact
      real(wp), intent(in) :: share                    !! of the step that passes before the impact
      real(wp), intent(in) :: restitution
      type(demand_type), intent(out) :: demand
      real(wp) :: start, gained
      start = motion(line, before)
      gained = motion(line, free) - start
      demand%share = share
      demand%speed = -(start + gained*share)
      demand%target(1) = restitution*demand%speed + gained*(1 - share)
      demand%is_impact = demand%speed > least_speed*abs(gained) .and. line%mobility > 0
      demand%acts = demand%is_impact
   end subroutine set_demand

   !> Impulses that fulfil the law at all contacts.
   pure subroutine solve(lines, demands, laws, v)
      type(line_type), intent(in) :: lines(:, :)
      type(demand_type), intent(in) :: demands(:)
      type(contact_law_type), intent(in) :: laws(:)
      real(wp), intent(inout) :: v(:, :)               !! velocities without the impulses, then with them
      real(wp) :: impulse(2, size(demands))            !! normal and shear
      real(wp) :: old(2), slip, bound, worst
      integer :: i, sweep
      impulse = 0
      do sweep = 1, most_sweeps
         worst = 0
         do i = 1, size(demands)
            if (.not. demands(i)%acts) cycle
            old = impulse(:, i)
            impulse(1, i) = old(1) + (demands(i)%target(1) - motion(lines(1, i), v))/lines(1, i)%mobility
            if (.not. demands(i)%holds) impulse(1, i) = max(0.0_wp, impulse(1, i))
            call push(lines(:, i), [impulse(1, i) - old(1), 0.0_wp], v)
            if (demands(i)%is_smooth .and. .not. demands(i)%holds) then
               worst = max(worst, abs(impulse(1, i) - old(1))*lines(1, i)%mobility)
               cycle
            end if
            slip = motion(lines(2, i), v) - demands(i)%target(2)
            bound = huge(bound)
            if (.not. demands(i)%holds) bound = impulse(1, i)*friction_coefficient(laws(i), slip, 0.0_wp, &
                                                                                  huge(1.0_wp), .false.)
            impulse(2, i) = max(-bound, min(bound, old(2) - slip/max(lines(2, i)%mobility, tiny(1.0_wp))))
            call push(lines(:, i), [0.0_wp, impulse(2, i) - old(2)], v)
            worst = max(worst, maxval(abs(impulse(:, i) - old)*lines(:, i)%mobility))
         end do
         if (worst <= settled*maxval(demands%speed)) return
      end do
   end subroutine solve

   !> Scale the changes of velocities and places down until they give no energy. Forces of the smooth motion, which are
   !> those of its mean accelerations, do the work of the change of places.
   pure subroutine limit_energy(context, free, pressed, v, w)
      type(step_context_type), intent(in) :: context
      real(wp), intent(in) :: free(:, :)       !! velocities without the impulses
      real(wp), intent(in) :: pressed          !! of second order, of springs that are pressed further [energy]
      real(wp), intent(inout) :: v(:, :)       !! with them
      real(wp), intent(inout) :: w(:, :)       !! change of places over the step
      real(wp) :: linear, square, lifted, change_of(6), momentum(6), share
      integer :: b
      linear = 0
      square = 0
      lifted = pressed
      do b = 1, size(v, 2)
         if (any(abs(v(:, b) - free(:, b)) > 0)) then
            change_of = [v(:, b) - free(:, b), 0.0_wp, 0.0_wp, 0.0_wp]
            momentum = mass_times(context%state%mass(b), context%state%area(b), context%state%moments(:, b), change_of)
            linear = linear + dot_product(momentum(1:3), free(:, b))
            square = square + 0.5_wp*dot_product(momentum, change_of)
         end if
         if (any(abs(w(:, b)) > 0)) then
            change_of = [free(:, b) - context%state%velocity(1:3, b), 0.0_wp, 0.0_wp, 0.0_wp]
            momentum = mass_times(context%state%mass(b), context%state%area(b), context%state%moments(:, b), change_of)
            lifted = lifted - dot_product(momentum(1:3), w(:, b))
         end if
      end do
      if (.not. linear + square + lifted > 0) return
      share = 1
      if (square > 0) share = max(0.0_wp, min(1.0_wp, -0.5_wp*linear/square))
      if (share*linear + share**2*square + lifted > 0) then
         w = w*max(0.0_wp, -(share*linear + share**2*square)/lifted)
      else
         ! the largest share that gives none
         share = (-linear + sqrt(max(0.0_wp, linear**2 - 4*square*lifted)))/(2*square)
         share = max(0.0_wp, min(1.0_wp, share))
      end if
      v = free + share*(v - free)
   end subroutine limit_energy

end module rockdda_stepping_impact
