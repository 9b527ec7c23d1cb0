! SPDX-License-Identifier: MIT
!> An attempt at a step: its length and scheme, what the present stage gives it, and the motion that is expected of the
!> blocks. All of it is dropped when the attempt fails; what it begins with, model and state, it reads alone
!> (rockdda_interaction_context).
module rockdda_interaction_attempt
   use rockdda_base_kinds, only : wp
   use rockdda_base_parallel, only : parallel_blocks
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_finite_rotation, only : moving_block_type, new_moving_block, moved_block_type, turns, &
      new_moved_block
   use rockdda_interaction_time_scheme, only : time_scheme_type, purpose
   implicit none
   private
   public :: attempt_type

   type :: attempt_type
      real(wp) :: dt = 0                        !! step [time]
      type(time_scheme_type) :: scheme          !! of its integration in time
      logical, allocatable :: asleep(:)         !! (nb) left out of the step
      integer, allocatable :: calm(:)           !! (nb) as in the state, of blocks that the step disturbs
      real(wp), allocatable :: acceleration(:, :)   !! (6, nb) at the start, where the state does not have it; else none
      ! with a scheme of second order
      real(wp), allocatable :: jump(:, :)       !! (6, nb) of velocities, by contacts that close in the step
      real(wp), allocatable :: turning(:, :)    !! (6, nb) loads that turn forces from mid-step to where they act
      real(wp) :: gravity = 1                   !! factor on all weights
      real(wp) :: motion_start = 0              !! time at which base motion begins; huge: not yet
      character(len=:), allocatable :: water    !! names of the groups of &water that act; empty: all
      logical, allocatable :: released(:)       !! (nf) fixed points that were let go
      type(moving_block_type), allocatable :: moving(:)   !! (nb) blocks with the motion expected of them
      logical, allocatable :: renewed(:)        !! (nb) for which that is new
      logical, allocatable :: resting(:)        !! (nb) asleep, and close to no block that is awake; no array: none
      type(moved_block_type), allocatable :: moved(:)     !! (nb) blocks with the motion of the last solve
      logical, allocatable :: is_turning(:)     !! (nb) turned by that motion, or expected to turn
   contains
      procedure :: renew_all
      procedure :: expect
      procedure :: find_moved
      procedure :: motion_time
      procedure :: ground_step
      procedure :: velocity_at_start
      procedure :: knows_acceleration
      procedure :: acceleration_at_start
      procedure :: load_time
      procedure :: is_left_out
   end type attempt_type

contains

   !> Time since base motion began, at the start of the step (share 0) to its end (1); far below zero: not yet.
   pure real(wp) function motion_time(self, context, share)
      class(attempt_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      real(wp), intent(in) :: share
      motion_time = (context%state%time - self%motion_start) + share*self%dt
   end function motion_time

   !> Motion of the ground in the step by records that are applied in this way.
   pure function ground_step(self, context, apply) result(u)
      class(attempt_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      character(len=*), intent(in) :: apply
      real(wp) :: u(2)                                     !! [length]
      u = 0
      associate (motion => context%ground_motion)
         if (motion%acts(apply)) u = motion%displacement(apply, self%motion_time(context, 1.0_wp)) - &
                                     motion%displacement(apply, self%motion_time(context, 0.0_wp))
      end associate
   end function ground_step

   !> Velocity of a block at the start of the step, as the equations have it: zero in those of the start itself.
   pure function velocity_at_start(self, context, block) result(velocity)
      class(attempt_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      integer, intent(in) :: block
      real(wp) :: velocity(6)
      velocity = 0
      if (self%scheme%purpose == purpose%step) velocity = context%state%velocity(:, block)
   end function velocity_at_start

   !> Are accelerations at the start of the step known?
   pure logical function knows_acceleration(self, context)
      class(attempt_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      knows_acceleration = context%state%accelerates .or. allocated(self%acceleration)
   end function knows_acceleration

   !> Acceleration of a block at the start of the step.
   pure function acceleration_at_start(self, context, block) result(acceleration)
      class(attempt_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      integer, intent(in) :: block
      real(wp) :: acceleration(6)
      if (allocated(self%acceleration)) then
         acceleration = self%acceleration(:, block)
      else
         acceleration = context%state%acceleration(:, block)
      end if
   end function acceleration_at_start

   !> Is a block asleep among blocks that are asleep too? It has no terms and no links in this step.
   pure logical function is_left_out(self, block)
      class(attempt_type), intent(in) :: self
      integer, intent(in) :: block
      is_left_out = .false.
      if (allocated(self%resting)) is_left_out = self%resting(block)
   end function is_left_out

   !> Time at which loads of the step are taken.
   pure real(wp) function load_time(self, context)
      class(attempt_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      load_time = context%state%time + self%scheme%level*self%dt
   end function load_time

   !> What is expected next is new for all blocks.
   pure subroutine renew_all(self, context)
      class(attempt_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      if (.not. allocated(self%moving)) allocate (self%moving(context%blocks%n_blocks), &
                                                  self%moved(context%blocks%n_blocks), &
                                                  self%is_turning(context%blocks%n_blocks), &
                                                  self%renewed(context%blocks%n_blocks))
      self%renewed = .true.
   end subroutine renew_all

   !> Set the motion expected of the `renewed` blocks in this step: `factor` times d, less another one; without d none.
   subroutine expect(self, context, d, factor, less)
      class(attempt_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      real(wp), intent(in), contiguous, optional :: d(:, :)   !! (6, nb)
      real(wp), intent(in), optional :: factor                !! default 1
      real(wp), intent(in), contiguous, optional :: less(:, :)   !! (6, nb)
      real(wp) :: motion(6), share
      integer :: i
      logical :: moves
      share = 1
      if (present(factor)) share = factor
      moves = present(d)
      if (moves) moves = context%follows_rotation()
      !$omp parallel do default(none) shared(self, context, d, moves, share, less) private(i, motion) schedule(static) &
      !$omp if (context%blocks%n_blocks > parallel_blocks)
      do i = 1, context%blocks%n_blocks
         if (.not. self%renewed(i)) cycle
         motion = 0
         if (moves) motion = share*d(1:6, i)
         if (moves .and. present(less)) motion = motion - less(1:6, i)
         self%moving(i) = new_moving_block(context%state%centroid(:, i), motion)
      end do
      !$omp end parallel do
   end subroutine expect

   !> Take the motion of a solve, with the rotation of the run: exact or linear.
   subroutine find_moved(self, context, d)
      class(attempt_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      real(wp), intent(in), contiguous :: d(:, :)   !! (6, nb)
      integer :: i
      !$omp parallel do default(none) shared(self, context, d) private(i) schedule(static) &
      !$omp if (context%blocks%n_blocks > parallel_blocks)
      do i = 1, context%blocks%n_blocks
         self%moved(i) = new_moved_block(context%state%centroid(:, i), d(:, i), context%parameters%exact_rotation)
         self%is_turning(i) = turns(d(:, i)) .or. abs(self%moving(i)%angle) > 0
      end do
      !$omp end parallel do
   end subroutine find_moved

end module rockdda_interaction_attempt
