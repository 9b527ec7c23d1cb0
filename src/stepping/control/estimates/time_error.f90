! SPDX-License-Identifier: MIT
!> Estimate of the error of time integration in dynamic steps.
!>
!> Shi's scheme takes the forces of a step's end for the whole step. With a the acceleration of a step, the velocity of
!> a block is wrong afterwards by what has changed since the step before, 1/2 (a1 - a0) dt. These errors keep their
!> direction: over vibrations that the step does not resolve, and over an impact, their sum is small. The sum is carried
!> on with each block (`drift`), at most the speed that the block has had lately; it displaces the block by drift dt in
!> a step. The generalised-alpha scheme has no such drift; it displaces a block by (beta - 1/6) (a1 - a0) dt**2
!> (Zienkiewicz and Xie 1991), and by half the way that the velocity w of contacts that close makes in the step.
!>
!> Displacements are summed with their direction until they are `bin` of the largest displacement, then the sum b is
!> counted and begins anew: Q grows by b b^T/|b|, so that the trace of Q (turning thrice) is the way of
!> the error. That of motions which
!> come back is counted, that of small vibrations is not. The error of a run is that of the worst block over U, the
!> largest displacement of any block since the dynamic part began, at least g2 w0. Motions are those of corners: turning
!> counts with the distance of a rectangle's corner.
!>
!> Two blocks cannot be wrong against each other along the normal of a contact that is closed at the end of the step.
!> There drift and sum lose their difference, shared by mass, and the larger Q becomes the mean of both. Along contacts
!> that are locked the sum loses its difference. With the generalised-alpha scheme, which resolves vibrations without
!> damping them, they keep of it what the spring of the contact swings: it is held no closer. Blocks with two fixed
!> points have no error. Rows are taken once, in their order; ties bend and are left out. A block that lies still on
!> the ground thus has no error across it, however it came there.
module rockdda_stepping_time_error
   use rockdda_base_kinds, only : wp
   use rockdda_base_room, only : resize
   use rockdda_base_parallel, only : parallel_blocks
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_state, only : block_state_type, energy, n_energies, radius_of_inertia
   use rockdda_contact_table, only : contact_table_type, contact_state
   use rockdda_interaction_attempt, only : attempt_type
   use rockdda_interaction_context, only : step_context_type
   implicit none
   private
   public :: time_error_type

   !> Rows of `of_blocks`: displacement, last acceleration, drift, error that is not counted yet (each of both
   !> directions and of turning, times the radius of inertia), Q (xx yy tt xy xt yt), recent speed, inverse of the
   !> radius of inertia, number of fixed points, inverse of the mass or 0 for a block that is held.
   integer, parameter :: n_rows = 22, at_displacement = 0, at_acceleration = 3, at_drift = 6, at_sum = 9, at_q = 12, &
                         at_speed = 19, at_inertia = 20, at_fixed = 21, at_give = 22
   !> Errors of this share of the largest displacement are counted. Springs that swing by less hold as if they were
   !> rigid: no error across them is larger than twice their amplitude.
   real(wp), parameter :: bin = 1.0e-4_wp
   !> Contacts take from Q in every eighth step.
   integer, parameter :: every_q = 8
   !> Differences across contacts below this share of the largest displacement may wait.
   real(wp), parameter :: small = 1.0e-6_wp
   !> Share of a block's recent speed that is kept in a step.
   real(wp), parameter :: fading = 0.9_wp

   !> Part of the state of a run.
   type :: time_error_type
      logical :: counts = .false.          !! the last step was a dynamic one
      real(wp) :: largest = 0              !! displacement of any block since then [length]
      real(wp) :: error = 0                !! largest of any block [length]
      real(wp) :: relative = 0             !! the same over the largest displacement
      real(wp), allocatable :: of_blocks(:, :)   !! (n_rows, nb); no columns before the first dynamic step
      ! with a ledger
      real(wp) :: friction_before = 0      !! work of friction before the dynamic part [energy]
      real(wp) :: friction = 0             !! the same in it
      real(wp) :: largest_kinetic = 0      !! kinetic energy in it
   contains
      procedure :: init
      procedure :: add
      procedure :: has_shape
      procedure :: reference
      procedure :: note_energies
   end type time_error_type

contains

   !> Before the first step.
   pure subroutine init(self)
      class(time_error_type), intent(inout) :: self
      self%counts = .false.
      self%largest = 0
      self%error = 0
      self%relative = 0
      if (allocated(self%of_blocks)) deallocate (self%of_blocks)
      allocate (self%of_blocks(n_rows, 0))
   end subroutine init

   !> Are there the rows that a model with nb blocks has?
   pure logical function has_shape(self, nb)
      class(time_error_type), intent(in) :: self
      integer, intent(in) :: nb
      has_shape = .false.
      if (.not. allocated(self%of_blocks)) return
      has_shape = size(self%of_blocks, 1) == n_rows .and. &
                  (size(self%of_blocks, 2) == nb .or. (size(self%of_blocks, 2) == 0 .and. .not. self%counts))
   end function has_shape

   !> Displacement to which errors are compared [length].
   pure real(wp) function reference(self, parameters)
      class(time_error_type), intent(in) :: self
      type(parameters_type), intent(in) :: parameters
      reference = max(self%largest, parameters%displacement_ratio*parameters%w0, tiny(1.0_wp))
   end function reference

   !> Take up a step that is accepted, before the blocks move. In other steps the error of dynamic ones stays, until
   !> the next dynamic one.
   subroutine add(self, context, attempt, x, table, is_dynamic)
      class(time_error_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      real(wp), intent(in), contiguous :: x(:, :)          !! (6, nb) motion
      type(contact_table_type), intent(in) :: table        !! with the states of the step's end
      logical, intent(in) :: is_dynamic
      real(wp) :: error, largest, scale
      logical :: is_first
      integer :: i
      is_first = .not. self%counts
      self%counts = is_dynamic
      if (.not. is_dynamic) return
      if (is_first) call begin(self, context%state)
      scale = reference(self, context%parameters)
      call context%blocks%count_holds(self%of_blocks(at_fixed, :), attempt%released, context%held)
      !$omp parallel do default(none) shared(self, context, attempt, x, is_first) private(i) schedule(static) &
      !$omp if (size(x, 2) > parallel_blocks)
      do i = 1, size(x, 2)
         if (context%state%active(i)) call add_error(self%of_blocks(:, i), context, attempt, i, x(1:3, i), is_first)
      end do
      !$omp end parallel do
      call keep_contacts(self%of_blocks, size(x, 2), context, attempt, table, small*scale, bin*scale)
      error = 0
      largest = 0
      !$omp parallel do default(none) shared(self, context, attempt, x, scale) private(i) &
      !$omp reduction(max:error, largest) schedule(static) if (size(x, 2) > parallel_blocks)
      do i = 1, size(x, 2)
         if (context%state%active(i)) call count_error(self%of_blocks(:, i), scale, largest, error)
      end do
      !$omp end parallel do
      self%largest = max(self%largest, largest)
      self%error = error
      self%relative = error/reference(self, context%parameters)
   end subroutine add

   !> Note friction and motion at the end of a dynamic step.
   pure subroutine note_energies(self, is_first, before, now)
      class(time_error_type), intent(inout) :: self
      logical, intent(in) :: is_first                      !! a dynamic part begins
      real(wp), intent(in) :: before(n_energies), now(n_energies)
      if (is_first) then
         self%friction_before = before(energy%friction)
         self%largest_kinetic = before(energy%kinetic)
      end if
      self%friction = now(energy%friction) - self%friction_before
      self%largest_kinetic = max(self%largest_kinetic, now(energy%kinetic))
   end subroutine note_energies

   !> A dynamic part begins.
   pure subroutine begin(self, state)
      class(time_error_type), intent(inout) :: self
      type(block_state_type), intent(in) :: state
      call resize(self%of_blocks, n_rows, size(state%mass))
      self%of_blocks = 0
      self%largest = 0
      self%error = 0
   end subroutine begin

   !> Add motion and error of a step to one block.
   pure subroutine add_error(rows, context, attempt, i, x, is_first)
      real(wp), intent(inout), contiguous :: rows(:)       !! (n_rows)
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      integer, intent(in) :: i                             !! block
      real(wp), intent(in) :: x(3)
      logical, intent(in) :: is_first                      !! nothing is known of the step before
      real(wp) :: a(3), change(3), drift(3), factors(3), speed
      factors = [1.0_wp, 1.0_wp, radius_of_inertia(context%state, i)]
      call find_change(rows, context, attempt, i, x, is_first, factors, a, change)
      rows(at_displacement + 1:at_displacement + 3) = rows(at_displacement + 1:at_displacement + 3) + factors*x
      rows(at_acceleration + 1:at_acceleration + 3) = a
      rows(at_inertia) = 1/factors(3)
      rows(at_give) = 0
      if (rows(at_fixed) > 1) return
      rows(at_give) = 1/context%state%mass(i)
      associate (sum => rows(at_sum + 1:at_sum + 3), dt => attempt%dt, scheme => attempt%scheme)
         if (scheme%second_order) then
            sum = sum + (scheme%beta - 1/6.0_wp)*dt**2*change + 0.5_wp*dt*factors*attempt%jump(1:3, i)
         else
            speed = size_of(factors*((2/dt)*x - context%state%velocity(1:3, i)))
            rows(at_speed) = max(speed, fading*rows(at_speed))
            drift = rows(at_drift + 1:at_drift + 3) + 0.5_wp*dt*change
            if (size_of(drift) > rows(at_speed)) drift = drift*(rows(at_speed)/size_of(drift))
            rows(at_drift + 1:at_drift + 3) = drift
            sum = sum + drift*dt
         end if
      end associate
   end subroutine add_error

   !> Take away what closed contacts hold. Less than `least` waits until it has become more.
   pure subroutine keep_contacts(of_blocks, n, context, attempt, table, least, least_swing)
      integer, intent(in) :: n                             !! blocks
      ! of constant shape: the place of a column is worked out many times
      real(wp), intent(inout) :: of_blocks(n_rows, n)
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(contact_table_type), intent(in) :: table
      real(wp), intent(in) :: least                        !! [length]
      real(wp), intent(in) :: least_swing                  !! amplitude [length]
      real(wp) :: line(3, 2), weight(3, 2), arms(2, 2), along(2), give(2), swing
      logical :: turn_of_q
      integer :: c, k, pair(2)
      turn_of_q = mod(context%state%step, every_q) == 0
      do c = 1, table%n
         if (table%state(c) == contact_state%open .or. table%tied(c)) cycle
         pair = [table%block_a(c), table%block_b(c)]
         associate (a => of_blocks(:, pair(1)), b => of_blocks(:, pair(2)), drift => at_drift + 1, total => at_sum + 1)
            give = [a(at_give), b(at_give)]
            if (.not. sum(give) > 0) cycle
            do k = 1, 2
               arms(:, k) = (table%point(:, c) - context%state%centroid(:, pair(k)))*of_blocks(at_inertia, pair(k))
            end do
            line = lines(arms, table%normal(:, c))
            along = [difference(a(drift:drift + 2), b(drift:drift + 2), line), &
                     difference(a(total:total + 2), b(total:total + 2), line)]
            if (turn_of_q .or. max(attempt%dt*abs(along(1)), abs(along(2))) > least) then
               weight = weights(give, line)
               swing = swing_of(table%k_n(c), table%gap(c))
               call take_away(a(drift:drift + 2), b(drift:drift + 2), along(1), weight)
               call take_away(a(total:total + 2), b(total:total + 2), beyond(along(2), swing), weight)
               if (turn_of_q) call level_q(of_blocks, pair, line, weight, swing)
            end if
            if (table%state(c) /= contact_state%locked) cycle
            line = lines(arms, [-table%normal(2, c), table%normal(1, c)])
            along(2) = difference(a(total:total + 2), b(total:total + 2), line)
            if (abs(along(2)) > least) then
               swing = swing_of(table%k_s(c), table%shear(c))
               call take_away(a(total:total + 2), b(total:total + 2), beyond(along(2), swing), weights(give, line))
            end if
         end associate
      end do

   contains

      !> Amplitude of the vibration of both blocks on the spring of a contact, by its length and its speed along `line`;
      !> 0 with Shi's scheme, and below `least_swing`.
      pure real(wp) function swing_of(stiffness, length)
         real(wp), intent(in) :: stiffness                 !! of the spring [force/length]
         real(wp), intent(in) :: length                    !! of the spring, 0: free of force [length]
         real(wp) :: v(3, 2), speed, inertia
         integer :: side
         swing_of = 0
         if (.not. (attempt%scheme%second_order .and. stiffness > 0)) return
         do side = 1, 2
            associate (i => pair(side))
               v(:, side) = context%state%velocity(1:3, i)
               if (of_blocks(at_inertia, i) > 0) v(3, side) = v(3, side)/of_blocks(at_inertia, i)
            end associate
         end do
         speed = difference(v(:, 1), v(:, 2), line)
         inertia = give(1)*(1 + line(3, 1)**2) + give(2)*(1 + line(3, 2)**2)
         swing_of = sqrt(length**2 + speed**2/(stiffness*inertia))
         if (swing_of < least_swing) swing_of = 0
      end function swing_of

   end subroutine keep_contacts

   !> The part of a length beyond an amplitude.
   pure real(wp) function beyond(length, amplitude)
      real(wp), intent(in) :: length, amplitude            !! [length]
      beyond = sign(max(abs(length) - amplitude, 0.0_wp), length)
   end function beyond

   !> Rows of the motion of two blocks along a direction at a point that both touch: what they move against each other
   !> is the sum over both of line . motion.
   pure function lines(arms, along)
      real(wp), intent(in) :: arms(2, 2)                   !! from the centroids over the radii of inertia
      real(wp), intent(in) :: along(2)
      real(wp) :: lines(3, 2)
      lines(1:2, 1) = along
      lines(3, 1) = arms(1, 1)*along(2) - arms(2, 1)*along(1)
      lines(1:2, 2) = -along
      lines(3, 2) = arms(2, 2)*along(1) - arms(1, 2)*along(2)
   end function lines

   !> Motions of both blocks by the impulse that moves them by 1 against each other along a line.
   pure function weights(give, line) result(weight)
      real(wp), intent(in) :: give(2)                      !! 1/mass
      real(wp), intent(in) :: line(3, 2)
      real(wp) :: weight(3, 2), impulse
      impulse = 1/(give(1)*(1 + line(3, 1)**2) + give(2)*(1 + line(3, 2)**2))
      weight(:, 1) = (impulse*give(1))*line(:, 1)
      weight(:, 2) = (impulse*give(2))*line(:, 2)
   end function weights

   !> By how much the vectors a and b of two blocks differ along a line.
   pure real(wp) function difference(a, b, line)
      real(wp), intent(in) :: a(3), b(3)
      real(wp), intent(in) :: line(3, 2)
      difference = line(1, 1)*(a(1) - b(1)) + line(2, 1)*(a(2) - b(2)) + line(3, 1)*a(3) + line(3, 2)*b(3)
   end function difference

   !> Take that away.
   pure subroutine take_away(a, b, along, weight)
      real(wp), intent(inout) :: a(3), b(3)
      real(wp), intent(in) :: along, weight(3, 2)
      a = a - along*weight(:, 1)
      b = b - along*weight(:, 2)
   end subroutine take_away

   !> Reduce the larger Q of two blocks along a line to the mean of both by mass, at least to `least`. The smaller one
   !> stays, so that no Q grows by contacts.
   pure subroutine level_q(of_blocks, pair, line, weight, least)
      real(wp), intent(inout), contiguous :: of_blocks(:, :)
      integer, intent(in) :: pair(2)
      real(wp), intent(in) :: line(3, 2), weight(3, 2)     !! of `lines`, `weights`
      real(wp), intent(in) :: least                        !! [length]
      real(wp) :: row(3, 2), along(2), share(2), mean, factor
      integer :: k
      do k = 1, 2
         associate (q => of_blocks(at_q + 1:at_q + 6, pair(k)), l => line(:, k))
            row(:, k) = [q(1)*l(1) + q(4)*l(2) + q(5)*l(3), q(4)*l(1) + q(2)*l(2) + q(6)*l(3), &
                         q(5)*l(1) + q(6)*l(2) + q(3)*l(3)]
            along(k) = dot_product(l, row(:, k))/(1 + l(3)**2)
            share(k) = dot_product(l, weight(:, k))   ! the mass of the other block over that of both
         end associate
      end do
      mean = max(share(2)*along(1) + share(1)*along(2), least)
      k = merge(1, 2, along(1) > along(2))
      ! rounding may leave a Q below zero
      if (.not. (along(k) > max(mean, 0.0_wp) .and. share(k) > 0)) return
      factor = (1 - sqrt(max(mean, 0.0_wp)/along(k)))/(1 + line(3, k)**2)
      row(:, k) = row(:, k) - (0.5_wp*factor*(1 + line(3, k)**2)*along(k))*line(:, k)
      call subtract(of_blocks(at_q + 1:at_q + 6, pair(k)), factor*line(:, k), row(:, k))
   end subroutine level_q

   !> q - a b^T - b a^T
   pure subroutine subtract(q, a, b)
      real(wp), intent(inout) :: q(6)
      real(wp), intent(in) :: a(3), b(3)
      q(1:3) = q(1:3) - 2*a*b
      q(4:5) = q(4:5) - a(1)*b(2:3) - b(1)*a(2:3)
      q(6) = q(6) - a(2)*b(3) - b(2)*a(3)
   end subroutine subtract

   !> Count the error of one block when it has become large enough.
   pure subroutine count_error(rows, scale, largest, error)
      real(wp), intent(inout), contiguous :: rows(:)       !! (n_rows)
      real(wp), intent(in) :: scale                        !! largest displacement of any block before the step
      real(wp), intent(inout) :: largest, error            !! of any block: displacement, error
      real(wp) :: b(3), q(6), u(3), uncounted
      b = rows(at_sum + 1:at_sum + 3)
      q = rows(at_q + 1:at_q + 6)
      u = rows(at_displacement + 1:at_displacement + 3)
      uncounted = size_of(b)
      if (uncounted > bin*scale) then
         call subtract(q, b, -b/(2*uncounted))
         rows(at_q + 1:at_q + 6) = q
         rows(at_sum + 1:at_sum + 3) = 0
         uncounted = 0
      end if
      largest = max(largest, size_of(u))
      error = max(error, q(1) + q(2) + 3*q(3) + uncounted)
   end subroutine count_error

   !> Acceleration of a block in a step, and its change since the step before, of corners.
   pure subroutine find_change(rows, context, attempt, i, x, is_first, factors, a, change)
      real(wp), intent(in), contiguous :: rows(:)
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      integer, intent(in) :: i                             !! block
      real(wp), intent(in) :: x(3)
      logical, intent(in) :: is_first                      !! nothing is known of the step before
      real(wp), intent(in) :: factors(3)                   !! of unknowns to motions
      real(wp), intent(out) :: a(3), change(3)
      associate (state => context%state, scheme => attempt%scheme, dt => attempt%dt)
         if (scheme%second_order) then
            a = scheme%new_acceleration(x, state%velocity(1:3, i), state%acceleration(1:3, i), attempt%jump(1:3, i), dt)
            change = factors*(a - state%acceleration(1:3, i))
            a = factors*a
         else
            a = factors*(2/dt)*(x/dt - state%velocity(1:3, i))
            change = 0
            if (.not. is_first) change = a - rows(at_acceleration + 1:at_acceleration + 3)
         end if
      end associate
   end subroutine find_change

   !> Magnitude of a motion at the corner, which in a rectangle is sqrt(3) radii of inertia from the centroid.
   pure real(wp) function size_of(motion)
      real(wp), intent(in) :: motion(3)                    !! turning times the radius of inertia
      size_of = sqrt(motion(1)**2 + motion(2)**2 + 3*motion(3)**2)
   end function size_of

end module rockdda_stepping_time_error
