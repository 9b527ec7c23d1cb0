! SPDX-License-Identifier: MIT
!> Impulses between blocks that are rigid for an instant: lines along which they act, what the law of impact
!> (rockdda_stepping_impact) demands along them, and the impulses that fulfil it.
module rockdda_stepping_impulses
   use rockdda_base_kinds, only : wp
   use rockdda_contact_interval_law, only : at_end
   use rockdda_contact_table, only : contact_table_type, is_of_interval, other_row
   use rockdda_interaction_attempt, only : attempt_type
   use rockdda_interaction_joint_strength, only : joint_law_type, friction_coefficient
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_kinematics, only : mass_times
   implicit none
   private
   public :: line_type, demand_type, set_lines, n_held, motion, set_demand, solve, limit_energy

   !> Sweeps over all impulses at most, and the change over the speed of approach that is small enough.
   integer, parameter :: most_sweeps = 500
   real(wp), parameter :: settled = 1.0e-10_wp
   !> Below this many times the change of velocity in the step a speed of approach is no impact.
   real(wp), parameter :: least_speed = 2

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

   !> Normal and shear line of a contact, or of an interval at the end that the row is next to.
   pure subroutine set_lines(context, attempt, table, c, lines)
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: c                 !! row
      type(line_type), intent(out) :: lines(2)
      real(wp) :: along(2), point(2), r(2)
      integer :: d, k
      along = table%normal(:, c)
      point = table%point(:, c)
      if (is_of_interval(table, c)) then
         ! that end of the interval
         d = other_row(table, c)
         along = at_end(along, table%normal(:, d))
         along = along/norm2(along)
         point = at_end(point, table%point(:, d))
      end if
      do k = 1, 2
         lines(k)%a = table%block_a(c)
         lines(k)%b = table%block_b(c)
         r = point - context%state%centroid(:, lines(k)%a)
         lines(k)%of_a = [along, r(1)*along(2) - r(2)*along(1)]
         r = point - context%state%centroid(:, lines(k)%b)
         lines(k)%of_b = -[along, r(1)*along(2) - r(2)*along(1)]
         lines(k)%change_a = change(context, attempt, lines(k)%a, lines(k)%of_a)
         lines(k)%change_b = change(context, attempt, lines(k)%b, lines(k)%of_b)
         lines(k)%mobility = dot_product(lines(k)%of_a, lines(k)%change_a) + &
                             dot_product(lines(k)%of_b, lines(k)%change_b)
         ! the edge lies a quarter turn from its normal
         along = [-along(2), along(1)]
      end do
   end subroutine set_lines

   !> Change of velocity and spin of a rigid block by an impulse and its moment.
   pure function change(context, attempt, block, impulse) result(v)
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      integer, intent(in) :: block
      real(wp), intent(in) :: impulse(3)
      real(wp) :: v(3), arm(2), spin(3), inertia
      integer :: p
      associate (state => context%state)
         inertia = state%mass(block)*(state%moments(1, block) + state%moments(2, block))/state%area(block)
         v = [impulse(1:2)/state%mass(block), impulse(3)/inertia]
         if (n_held(context, attempt, block) == 0) return
         v = 0
         if (n_held(context, attempt, block) > 1) return
         arm = 0
         do p = 1, context%blocks%fixed%n
            if (is_held(context, attempt, p, block)) arm = state%centroid(:, block) - state%fixed_position(:, p)
         end do
         spin = [-arm(2), arm(1), 1.0_wp]
         v = spin*(dot_product(spin, impulse)/(inertia + state%mass(block)*dot_product(arm, arm)))
      end associate
   end function change

   !> Number of fixed points that hold a block; an edge that a boundary holds counts as two.
   pure integer function n_held(context, attempt, block)
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      integer, intent(in) :: block
      integer :: p
      n_held = count([(is_held(context, attempt, p, block), p=1, context%blocks%fixed%n)])
      if (allocated(context%held)) n_held = n_held + merge(2, 0, context%held(block))
   end function n_held

   !> Does fixed point p hold this block?
   pure logical function is_held(context, attempt, p, block)
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      integer, intent(in) :: p, block
      is_held = context%blocks%fixed%block(p) == block
      if (is_held .and. allocated(attempt%released)) is_held = .not. attempt%released(p)
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
   !> approach, the rest comes after it, and presses no deeper what has met.
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
      demand%target(1) = max(0.0_wp, restitution*demand%speed + gained*(1 - share))
      demand%is_impact = demand%speed > least_speed*abs(gained) .and. line%mobility > 0
      demand%acts = demand%is_impact
   end subroutine set_demand

   !> Impulses that fulfil the law at all contacts.
   pure subroutine solve(lines, demands, laws, v)
      type(line_type), intent(in) :: lines(:, :)
      type(demand_type), intent(in) :: demands(:)
      type(joint_law_type), intent(in) :: laws(:)
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

   !> Scale the changes of velocities and places of some blocks down until they give no energy. Forces of the smooth
   !> motion, which are those of its mean accelerations, do the work of the change of places.
   pure subroutine limit_energy(context, chosen, free, pressed, v, w)
      type(step_context_type), intent(in) :: context
      logical, intent(in) :: chosen(:)         !! (nb) blocks that act on each other
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
         if (.not. chosen(b)) cycle
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
         do b = 1, size(w, 2)
            if (chosen(b)) w(:, b) = w(:, b)*max(0.0_wp, -(share*linear + share**2*square)/lifted)
         end do
      else
         ! the largest share that gives none
         share = (-linear + sqrt(max(0.0_wp, linear**2 - 4*square*lifted)))/(2*square)
         share = max(0.0_wp, min(1.0_wp, share))
      end if
      do b = 1, size(v, 2)
         if (chosen(b)) v(:, b) = free(:, b) + share*(v(:, b) - free(:, b))
      end do
   end subroutine limit_energy

end module rockdda_stepping_impulses
