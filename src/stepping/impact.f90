! SPDX-License-Identifier: MIT
!> The law of impact: the motion of a step in which contacts with a coefficient of restitution close.
!>
!> A contact that lasts less than a step rebounds with whatever the place of the impact within the step makes of it.
!> Where contacts of joints with `restitution` e close in a step, their blocks therefore get a motion of their own
!> (Newton's law, blocks rigid in the impact): the impulses of the springs of these contacts are taken back, the blocks
!> go on freely until the gap closes, and there such impulses act that they leave each other at each contact with e
!> times the normal speed at which they meet,
!>
!>     v+ = -e v-,    P >= 0,    |Q| <= mu P,
!>
!> P the normal and Q the shear impulse, which stops the slip or is limited by friction. Contacts that close together
!> are solved for together (Gauss-Seidel). After the impact the blocks move on for the rest of the step; the contacts
!> are open at its end. Blocks with two fixed points take part as immovable, blocks with one as turning about it. No set
!> of impulses may give energy: they are scaled down to what the blocks had.
!>
!> Springs decide where loads change the velocity in a step by half the speed of approach, so that the contact comes to
!> rest, and where a block that is not held touches others in the step as well, or hangs on a bolt: their forces answer
!> those that the law takes back.
module rockdda_stepping_impact
   use rockdda_base_kinds, only : wp
   use rockdda_contact_table, only : contact_table_type, contact_state
   use rockdda_interaction_contact_law, only : contact_law_type, friction_coefficient
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_joint_end, only : joint_end_type
   use rockdda_interaction_joint_law, only : joint_type
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
      integer, allocatable :: rows(:)                  !! contacts that meet
      logical, allocatable, private :: takes_part(:)   !! (nb)
      real(wp), allocatable, private :: velocity(:, :) !! (6, nb) at the end of the step, of blocks that take part
   contains
      procedure :: find
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
      real(wp) :: target = 0                        !! normal velocity at the end of the step
      real(wp) :: speed = 0                         !! of approach
      real(wp) :: share = 1                         !! of the step that passes before the impact
      logical :: is_impact = .false.
   end type demand_type

contains

   !> Before a step is taken over: find contacts that meet in it, and put the motion of an impact into the unknowns of
   !> their blocks. The springs of these contacts have not acted.
   subroutine find(self, context, table, trial, laws, x)
      class(impact_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(contact_table_type), intent(in) :: table       !! of the step's start
      type(open_close_type), intent(inout) :: trial
      type(contact_law_type), intent(in) :: laws(:)       !! per joint material
      real(wp), intent(inout), contiguous :: x(:, :)      !! (6, nb) unknowns of the step
      type(line_type), allocatable :: lines(:, :)         !! (normal and shear, contacts)
      type(demand_type), allocatable :: demands(:)
      real(wp), allocatable :: free(:, :), v(:, :), impulse(:, :), of_springs(:, :)
      integer :: i, c, n
      self%happened = .false.
      if (.not. any(laws%restitution >= 0)) return
      self%rows = pack([(c, c=1, table%n)], [(table%state(c) == contact_state%open .and. trial%state_used(c) /= &
                       contact_state%open .and. laws(table%joint(c))%restitution >= 0, c=1, table%n)])
      n = size(self%rows)
      if (n == 0) return
      allocate (lines(2, n), demands(n), impulse(2, n), of_springs(2, n))
      free = (2/context%dt)*x(1:3, :) - context%state%velocity(1:3, :)
      do i = 1, n
         call set_lines(context, table, self%rows(i), lines(:, i))
         of_springs(:, i) = spring_impulse(context, table, trial, self%rows(i))
         call push(lines(:, i), -of_springs(:, i), free)
      end do
      do i = 1, n
         c = self%rows(i)
         call set_demand(lines(1, i), table%gap(c), context%state%velocity, free, context%dt, &
                         laws(table%joint(c))%restitution, demands(i))
      end do
      call exclude_touched(context, table, trial, self%rows, demands%is_impact)
      if (.not. any(demands%is_impact)) return
      do i = 1, n
         if (.not. demands(i)%is_impact) call push(lines(:, i), of_springs(:, i), free)
      end do
      allocate (v, mold=free)
      call solve(lines, demands, laws(table%joint(self%rows)), free, v, impulse)
      call limit_energy(context, free, v)
      self%happened = .true.
      call move(self, context, lines, demands, impulse(1, :), free, v, x)
      self%rows = pack(self%rows, demands%is_impact)
      trial%state_used(self%rows) = contact_state%open
   end subroutine find

   !> Leave to the springs all contacts of blocks that have other closed contacts or bolts.
   pure subroutine exclude_touched(context, table, trial, rows, is_impact)
      type(step_context_type), intent(in) :: context
      type(contact_table_type), intent(in) :: table
      type(open_close_type), intent(in) :: trial
      integer, intent(in) :: rows(:)
      logical, intent(inout) :: is_impact(:)       !! of the rows
      logical :: touched(context%blocks%n_blocks), meets(table%n)
      integer :: b, c, i, n_before
      touched = .false.
      do i = 1, context%blocks%bolts%n
         do c = 1, 2
            b = context%blocks%bolts%blocks(c, i)
            if (b > 0) touched(b) = .true.
         end do
      end do
      do
         meets = .false.
         meets(rows) = is_impact
         do c = 1, table%n
            if (meets(c) .or. trial%state_used(c) == contact_state%open) cycle
            touched(table%block_a(c)) = .true.
            touched(table%block_b(c)) = .true.
         end do
         do b = 1, size(touched)
            if (.not. touched(b)) cycle
            if (n_held(context, b) > 1) touched(b) = .false.
         end do
         n_before = count(is_impact)
         is_impact = is_impact .and. .not. (touched(table%block_a(rows)) .or. touched(table%block_b(rows)))
         if (count(is_impact) == n_before) exit
      end do
   end subroutine exclude_touched

   !> Normal and shear impulse of the springs and the dashpot of a row in the step, on block a.
   pure function spring_impulse(context, table, trial, c) result(impulse)
      type(step_context_type), intent(in) :: context
      type(contact_table_type), intent(in) :: table
      type(open_close_type), intent(in) :: trial
      integer, intent(in) :: c
      real(wp) :: impulse(2)
      type(joint_type) :: joint
      type(joint_end_type) :: last(1)
      call trial%find_ends(table, c, c, last)
      call trial%recall(table, c, joint)
      impulse(1) = last(1)%normal_force - joint%normal_drag*(trial%gap(c) - joint%drag_gap)
      impulse(2) = last(1)%shear_force
      impulse = context%dt*impulse
   end function spring_impulse

   !> Motion of the blocks in the step: as they were without the impact until it comes, with the velocity that it leaves
   !> from there on; their strain stays. Immovable blocks keep the motion of the step.
   subroutine move(self, context, lines, demands, weight, free, v, x)
      class(impact_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(line_type), intent(in) :: lines(:, :)
      type(demand_type), intent(in) :: demands(:)
      real(wp), intent(in) :: weight(:)             !! normal impulses
      real(wp), intent(in) :: free(:, :), v(:, :)   !! velocities at the end without and with the impact
      real(wp), intent(inout) :: x(:, :)
      real(wp), allocatable :: share(:), total(:)
      real(wp) :: gained(3)
      integer :: i, b, side
      if (allocated(self%takes_part)) deallocate (self%takes_part)
      allocate (self%takes_part(size(v, 2)), source=.false.)
      allocate (share(size(v, 2)), total(size(v, 2)), source=0.0_wp)
      do i = 1, size(demands)
         if (.not. demands(i)%is_impact) cycle
         do side = 1, 2
            b = merge(lines(1, i)%a, lines(1, i)%b, side == 1)
            self%takes_part(b) = n_held(context, b) < 2
            share(b) = share(b) + demands(i)%share*weight(i)
            total(b) = total(b) + weight(i)
         end do
      end do
      self%velocity = context%state%velocity
      do b = 1, size(v, 2)
         if (.not. self%takes_part(b)) cycle
         x(4:6, b) = 0
         associate (start => context%state%velocity(1:3, b))
            share(b) = merge(share(b)/max(total(b), tiny(1.0_wp)), 1.0_wp, total(b) > 0)
            gained = free(:, b) - start
            x(1:3, b) = context%dt*(share(b)*(start + 0.5_wp*gained*share(b)) + &
                                    (1 - share(b))*(v(:, b) - 0.5_wp*gained*(1 - share(b))))
            self%velocity(1:3, b) = v(:, b)
         end associate
      end do
   end subroutine move

   !> After the blocks have moved: their velocities. What open contacts overlap at the end is a gap that is free of
   !> force.
   subroutine finish(self, context, table, trial)
      class(impact_type), intent(in) :: self
      type(step_context_type), intent(inout) :: context
      type(contact_table_type), intent(inout) :: table    !! of the step's end
      type(open_close_type), intent(in) :: trial
      integer :: b, c
      do b = 1, size(self%takes_part)
         if (self%takes_part(b)) context%state%velocity(:, b) = self%velocity(:, b)
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

   !> Normal velocity that a contact must have at the end of the step. The impact is where the gap closes; what loads
   !> add up to there belongs to the approach, the rest comes after it.
   pure subroutine set_demand(line, gap, before, free, dt, restitution, demand)
      type(line_type), intent(in) :: line
      real(wp), intent(in) :: gap                      !! at the start of the step [length]
      real(wp), intent(in) :: before(:, :), free(:, :) !! velocities at the start, and at the end without the impact
      real(wp), intent(in) :: dt, restitution
      type(demand_type), intent(out) :: demand
      real(wp) :: start, gained, path
      start = motion(line, before)
      gained = motion(line, free) - start
      path = -(start + 0.5_wp*gained)*dt
      if (path > gap) demand%share = max(gap, 0.0_wp)/path
      demand%speed = -(start + gained*demand%share)
      demand%target = restitution*demand%speed + gained*(1 - demand%share)
      demand%is_impact = demand%speed > least_speed*abs(gained) .and. line%mobility > 0
   end subroutine set_demand

   !> Impulses that fulfil the law at all contacts.
   pure subroutine solve(lines, demands, laws, free, v, impulse)
      type(line_type), intent(in) :: lines(:, :)
      type(demand_type), intent(in) :: demands(:)
      type(contact_law_type), intent(in) :: laws(:)
      real(wp), intent(in) :: free(:, :)               !! velocities without them
      real(wp), intent(out) :: v(:, :)                 !! with them
      real(wp), intent(out) :: impulse(:, :)           !! normal and shear
      real(wp) :: old(2), slip, bound, worst
      integer :: i, sweep
      v = free
      impulse = 0
      do sweep = 1, most_sweeps
         worst = 0
         do i = 1, size(demands)
            if (.not. demands(i)%is_impact) cycle
            old = impulse(:, i)
            impulse(1, i) = max(0.0_wp, old(1) + (demands(i)%target - motion(lines(1, i), v))/lines(1, i)%mobility)
            call push(lines(:, i), [impulse(1, i) - old(1), 0.0_wp], v)
            slip = motion(lines(2, i), v)
            bound = impulse(1, i)*friction_coefficient(laws(i), slip, 0.0_wp, huge(1.0_wp), .false.)
            impulse(2, i) = max(-bound, min(bound, old(2) - slip/max(lines(2, i)%mobility, tiny(1.0_wp))))
            call push(lines(:, i), [0.0_wp, impulse(2, i) - old(2)], v)
            worst = max(worst, maxval(abs(impulse(:, i) - old)*lines(:, i)%mobility))
         end do
         if (worst <= settled*maxval(demands%speed)) return
      end do
   end subroutine solve

   !> Scale the change of velocities down until it gives no energy.
   pure subroutine limit_energy(context, free, v)
      type(step_context_type), intent(in) :: context
      real(wp), intent(in) :: free(:, :)       !! without the impulses
      real(wp), intent(inout) :: v(:, :)       !! with them
      real(wp) :: linear, square, change_of(6), momentum(6)
      integer :: b
      linear = 0
      square = 0
      do b = 1, size(v, 2)
         if (.not. any(abs(v(:, b) - free(:, b)) > 0)) cycle
         change_of = [v(:, b) - free(:, b), 0.0_wp, 0.0_wp, 0.0_wp]
         momentum = mass_times(context%state%mass(b), context%state%area(b), context%state%moments(:, b), change_of)
         linear = linear + dot_product(momentum(1:3), free(:, b))
         square = square + 0.5_wp*dot_product(momentum, change_of)
      end do
      if (linear + square > 0 .and. square > 0) v = free + max(0.0_wp, min(1.0_wp, -linear/square))*(v - free)
   end subroutine limit_energy

end module rockdda_stepping_impact
