! SPDX-License-Identifier: MIT
!> What every interaction reads: the model, its state at the start of the step, and the attempt at hand.
module rockdda_interaction_context
   use rockdda_base_kinds, only : wp
   use rockdda_base_parallel, only : parallel_blocks
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_datum, only : move_model
   use rockdda_model_in_situ, only : initial_stress_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_state, only : block_state_type
   use rockdda_interaction_finite_rotation, only : moving_block_type, new_moving_block, moved_block_type, turns, &
      new_moved_block
   use rockdda_interaction_kinematics, only : mass_times
   use rockdda_interaction_ground_motion, only : ground_motion_type
   use rockdda_interaction_time_scheme, only : time_scheme_type, purpose
   implicit none
   private
   public :: step_context_type

   type :: step_context_type
      ! the model
      type(block_system_type) :: blocks
      type(parameters_type) :: parameters
      type(ground_motion_type) :: ground_motion !! by records
      ! the state
      type(block_state_type) :: state
      real(wp), allocatable :: line_ends(:, :)  !! (4, line loads) where they are now
      type(initial_stress_type) :: initial_stress   !! the field of which state%stress is the mean at time 0
      ! the attempt
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
      logical, allocatable :: bolted(:)         !! (nb) blocks that a bolt with nodes crosses; no array: none
      logical, allocatable :: held(:)           !! (nb) blocks with an edge that a boundary holds in all directions
      type(moving_block_type), allocatable :: moving(:)   !! (nb) blocks with the motion expected of them
      logical, allocatable :: renewed(:)        !! (nb) for which that is new
      logical, allocatable :: resting(:)        !! (nb) asleep, and close to no block that is awake; no array: none
      type(moved_block_type), allocatable :: moved(:)     !! (nb) blocks with the motion of the last solve
      logical, allocatable :: is_turning(:)     !! (nb) turned by that motion, or expected to turn
   contains
      procedure :: renew_all
      procedure :: expect
      procedure :: find_moved
      procedure :: follows_rotation
      procedure :: motion_time
      procedure :: ground_step
      procedure :: stress_at_start
      procedure :: velocity_at_start
      procedure :: knows_acceleration
      procedure :: acceleration_at_start
      procedure :: model_blocks
      procedure :: load_time
      procedure :: is_left_out
      procedure :: momentum
   end type step_context_type

contains

   !> Do the arms of forces follow the rotation of the blocks in the step? Not for the linear rotation of Shi's program,
   !> nor in the iteration of DDA for Windows, which takes them at the start of the step.
   pure logical function follows_rotation(self)
      class(step_context_type), intent(in) :: self
      follows_rotation = self%parameters%exact_rotation .and. .not. self%parameters%peer_contacts
   end function follows_rotation

   !> Time since base motion began, at the start of the step (share 0) to its end (1); far below zero: not yet.
   pure real(wp) function motion_time(self, share)
      class(step_context_type), intent(in) :: self
      real(wp), intent(in) :: share
      motion_time = (self%state%time - self%motion_start) + share*self%dt
   end function motion_time

   !> Motion of the ground in the step by records that are applied in this way.
   pure function ground_step(self, apply) result(u)
      class(step_context_type), intent(in) :: self
      character(len=*), intent(in) :: apply
      real(wp) :: u(2)                                     !! [length]
      u = 0
      if (self%ground_motion%acts(apply)) u = self%ground_motion%displacement(apply, self%motion_time(1.0_wp)) - &
                                              self%ground_motion%displacement(apply, self%motion_time(0.0_wp))
   end function ground_step

   !> Stress of a block at one of its points at time 0. Without a field it is uniform.
   pure function stress_at_start(self, block, point) result(stress)
      class(step_context_type), intent(in) :: self
      integer, intent(in) :: block
      real(wp), intent(in) :: point(2)
      real(wp) :: stress(3)
      if (allocated(self%initial_stress%stress)) then
         stress = self%initial_stress%at(block, point)
      else
         stress = self%state%stress(:, block)
      end if
   end function stress_at_start

   !> Velocity of a block at the start of the step, as the equations have it: zero in those of the start itself.
   pure function velocity_at_start(self, block) result(velocity)
      class(step_context_type), intent(in) :: self
      integer, intent(in) :: block
      real(wp) :: velocity(6)
      velocity = 0
      if (self%scheme%purpose == purpose%step) velocity = self%state%velocity(:, block)
   end function velocity_at_start

   !> Are accelerations at the start of the step known?
   pure logical function knows_acceleration(self)
      class(step_context_type), intent(in) :: self
      knows_acceleration = self%state%accelerates .or. allocated(self%acceleration)
   end function knows_acceleration

   !> Acceleration of a block at the start of the step.
   pure function acceleration_at_start(self, block) result(acceleration)
      class(step_context_type), intent(in) :: self
      integer, intent(in) :: block
      real(wp) :: acceleration(6)
      if (allocated(self%acceleration)) then
         acceleration = self%acceleration(:, block)
      else
         acceleration = self%state%acceleration(:, block)
      end if
   end function acceleration_at_start

   !> The model in the coordinates of its files.
   function model_blocks(self) result(blocks)
      class(step_context_type), intent(in) :: self
      type(block_system_type) :: blocks
      blocks = self%blocks
      call drop_segments(blocks)
      call move_model(self%state%datum, blocks)
   end function model_blocks

   !> Leave out the segments of linings.
   pure subroutine drop_segments(blocks)
      type(block_system_type), intent(inout) :: blocks
      integer :: n
      if (blocks%n_segments == 0) return
      blocks%n_blocks = blocks%n_blocks - blocks%n_segments
      blocks%n_segments = 0
      n = blocks%n_blocks
      blocks%vertex_offset = blocks%vertex_offset(:n + 1)
      blocks%vertices = blocks%vertices(:, :blocks%n_vertices())
      blocks%edge_joint = blocks%edge_joint(:blocks%n_vertices())
      blocks%block_material = blocks%block_material(:n)
      if (allocated(blocks%file_line)) blocks%file_line = blocks%file_line(:n)
      if (allocated(blocks%parent)) blocks%parent = blocks%parent(:n)
   end subroutine drop_segments

   !> Is a block asleep among blocks that are asleep too? It has no terms and no links in this step.
   pure logical function is_left_out(self, block)
      class(step_context_type), intent(in) :: self
      integer, intent(in) :: block
      is_left_out = .false.
      if (allocated(self%resting)) is_left_out = self%resting(block)
   end function is_left_out

   !> Momentum of a block: its mass matrix times a velocity.
   pure function momentum(self, block, velocity) result(p)
      class(step_context_type), intent(in) :: self
      integer, intent(in) :: block
      real(wp), intent(in) :: velocity(6)
      real(wp) :: p(6)
      p = mass_times(self%state%mass(block), self%state%area(block), self%state%moments(:, block), velocity)
   end function momentum

   !> Time at which loads of the step are taken.
   pure real(wp) function load_time(self)
      class(step_context_type), intent(in) :: self
      load_time = self%state%time + self%scheme%level*self%dt
   end function load_time

   !> What is expected next is new for all blocks.
   pure subroutine renew_all(self)
      class(step_context_type), intent(inout) :: self
      if (.not. allocated(self%moving)) allocate (self%moving(self%blocks%n_blocks), &
                                                  self%moved(self%blocks%n_blocks), &
                                                  self%is_turning(self%blocks%n_blocks), &
                                                  self%renewed(self%blocks%n_blocks))
      self%renewed = .true.
   end subroutine renew_all

   !> Set the motion expected of the `renewed` blocks in this step: `factor` times d, less another one; without d none.
   subroutine expect(self, d, factor, less)
      class(step_context_type), intent(inout) :: self
      real(wp), intent(in), contiguous, optional :: d(:, :)   !! (6, nb)
      real(wp), intent(in), optional :: factor                !! default 1
      real(wp), intent(in), contiguous, optional :: less(:, :)   !! (6, nb)
      real(wp) :: motion(6), share
      integer :: i
      logical :: moves
      share = 1
      if (present(factor)) share = factor
      moves = present(d)
      if (moves) moves = self%follows_rotation()
      !$omp parallel do default(none) shared(self, d, moves, share, less) private(i, motion) schedule(static) &
      !$omp if (self%blocks%n_blocks > parallel_blocks)
      do i = 1, self%blocks%n_blocks
         if (.not. self%renewed(i)) cycle
         motion = 0
         if (moves) motion = share*d(1:6, i)
         if (moves .and. present(less)) motion = motion - less(1:6, i)
         self%moving(i) = new_moving_block(self%state%centroid(:, i), motion)
      end do
      !$omp end parallel do
   end subroutine expect

   !> Take the motion of a solve, with the rotation of the run: exact or linear.
   subroutine find_moved(self, d)
      class(step_context_type), intent(inout) :: self
      real(wp), intent(in), contiguous :: d(:, :)   !! (6, nb)
      integer :: i
      !$omp parallel do default(none) shared(self, d) private(i) schedule(static) &
      !$omp if (self%blocks%n_blocks > parallel_blocks)
      do i = 1, self%blocks%n_blocks
         self%moved(i) = new_moved_block(self%state%centroid(:, i), d(:, i), self%parameters%exact_rotation)
         self%is_turning(i) = turns(d(:, i)) .or. abs(self%moving(i)%angle) > 0
      end do
      !$omp end parallel do
   end subroutine find_moved

end module rockdda_interaction_context
