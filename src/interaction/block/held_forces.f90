! SPDX-License-Identifier: MIT
!> Forces that blocks gave which have been excavated: held on the blocks that stay, and released step by step.
!>
!> Each is a dead load at a point that moves with its block. Of the force at the excavation the share `released` has
!> gone; a stage with relax = share brings it to that share in equal parts over its first relax_steps steps. A force is
!> never held again.
module rockdda_interaction_held_forces
   use rockdda_base_kinds, only : wp
   use rockdda_base_state_archive, only : state_archive_type
   use rockdda_model_blocks, only : largest_coordinate
   use rockdda_model_state, only : energy
   use rockdda_interaction_attempt, only : attempt_type
   use rockdda_interaction_balance, only : energy_balance_type
   use rockdda_interaction_block_forces, only : block_forces_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_equations, only : equations_type
   use rockdda_interaction_finite_rotation, only : mean_load
   use rockdda_interaction_interaction, only : interaction_type
   use rockdda_interaction_kinematics, only : move_point
   implicit none
   private
   public :: held_forces_type

   type, extends(interaction_type) :: held_forces_type
      integer :: n = 0
      integer, allocatable :: block(:)         !! (n)
      real(wp), allocatable :: point(:, :)     !! (2, n) where it acts now [length]
      real(wp), allocatable :: force(:, :)     !! (2, n) at the excavation
      real(wp), allocatable :: released(:)     !! (n) share of it that has gone
      real(wp), allocatable :: goal(:)         !! (n) share that goes in this stage
      integer, allocatable :: steps_left(:)    !! (n) in which it goes
   contains
      procedure :: hold
      procedure :: relax
      procedure :: drop
      procedure :: relaxation
      procedure :: is_releasing
      procedure :: place
      procedure :: add_energies
      procedure :: commit
      procedure :: add_forces
      procedure :: exchange_state
   end type held_forces_type

contains

   !> Hold one more force.
   pure subroutine hold(self, block, point, force)
      class(held_forces_type), intent(inout) :: self
      integer, intent(in) :: block
      real(wp), intent(in) :: point(2)     !! [length]
      real(wp), intent(in) :: force(2)
      integer :: n
      n = self%n
      if (.not. allocated(self%block)) allocate (self%block(0), self%point(2, 0), self%force(2, 0), &
                                                 self%released(0), self%goal(0), self%steps_left(0))
      self%block = [self%block(1:n), block]
      self%point = reshape([self%point(:, 1:n), point], [2, n + 1])
      self%force = reshape([self%force(:, 1:n), force], [2, n + 1])
      self%released = [self%released(1:n), 0.0_wp]
      self%goal = [self%goal(1:n), 0.0_wp]
      self%steps_left = [self%steps_left(1:n), 0]
      self%n = n + 1
   end subroutine hold

   !> Release the forces from number `first` on, up to a share.
   pure subroutine relax(self, first, share, steps)
      class(held_forces_type), intent(inout) :: self
      integer, intent(in) :: first
      real(wp), intent(in) :: share
      integer, intent(in) :: steps
      integer :: i
      do i = first, self%n
         if (.not. share > self%released(i)) cycle
         self%goal(i) = share
         self%steps_left(i) = steps
      end do
   end subroutine relax

   !> Forget the forces on blocks that are no more, and those that are released.
   pure subroutine drop(self, active)
      class(held_forces_type), intent(inout) :: self
      logical, intent(in) :: active(:)   !! (nb)
      logical, allocatable :: stays(:)
      integer, allocatable :: kept(:)
      integer :: i
      if (self%n == 0) return
      allocate (stays(self%n))
      do i = 1, self%n
         stays(i) = active(self%block(i)) .and. self%released(i) < 1
      end do
      kept = pack([(i, i=1, self%n)], stays)
      self%block = self%block(kept)
      self%point = self%point(:, kept)
      self%force = self%force(:, kept)
      self%released = self%released(kept)
      self%goal = self%goal(kept)
      self%steps_left = self%steps_left(kept)
      self%n = size(kept)
   end subroutine drop

   !> Share that has gone of the forces of the last excavation; what it was where none of them are left.
   pure real(wp) function relaxation(self, before)
      class(held_forces_type), intent(in) :: self
      real(wp), intent(in) :: before
      relaxation = before
      if (self%n > 0) relaxation = self%released(self%n)
   end function relaxation

   !> Are forces still to be released in this stage?
   pure logical function is_releasing(self)
      class(held_forces_type), intent(in) :: self
      is_releasing = .false.
      if (self%n > 0) is_releasing = any(self%steps_left > 0)
   end function is_releasing

   !> Share that has gone at the end of the step.
   pure real(wp) function released_then(self, i) result(share)
      type(held_forces_type), intent(in) :: self
      integer, intent(in) :: i
      share = self%released(i)
      if (self%steps_left(i) == 1) then
         share = self%goal(i)
      else if (self%steps_left(i) > 1) then
         share = share + (self%goal(i) - share)/self%steps_left(i)
      end if
   end function released_then

   !> Load of force i at the end of the step.
   pure function load_of(self, attempt, i) result(load)
      type(held_forces_type), intent(in) :: self
      type(attempt_type), intent(in) :: attempt
      integer, intent(in) :: i
      real(wp) :: load(6)
      load = mean_load((1 - released_then(self, i))*self%force(:, i), self%point(:, i), attempt%moving(self%block(i)))
   end function load_of

   !> Loads of the step.
   subroutine place(self, context, attempt, equations)
      class(held_forces_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(equations_type), intent(inout) :: equations
      real(wp) :: load(6)
      integer :: b, i
      do i = 1, self%n
         b = self%block(i)
         load = load_of(self, attempt, i)
         equations%block_load(:, b) = equations%block_load(:, b) + load
         equations%block_magnitude(:, b) = equations%block_magnitude(:, b) + abs(load)
      end do
   end subroutine place

   !> Their work is that of loads.
   subroutine add_energies(self, context, attempt, d, balance)
      class(held_forces_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      real(wp), intent(in), contiguous :: d(:, :)
      class(energy_balance_type), intent(inout) :: balance
      real(wp) :: work
      integer :: i
      work = 0
      do i = 1, self%n
         work = work + dot_product(load_of(self, attempt, i), d(:, self%block(i)))
      end do
      if (self%n > 0) call balance%add(energy%external, work)
   end subroutine add_energies

   !> The points move with their blocks; one part more has gone.
   subroutine commit(self, context, attempt, d)
      class(held_forces_type), intent(inout) :: self
      type(step_context_type), intent(inout) :: context
      type(attempt_type), intent(inout) :: attempt
      real(wp), intent(in), contiguous :: d(:, :)
      integer :: b, i
      do i = 1, self%n
         b = self%block(i)
         self%released(i) = released_then(self, i)
         self%steps_left(i) = max(0, self%steps_left(i) - 1)
         call move_point(d(:, b), context%state%centroid(:, b), context%parameters%exact_rotation, self%point(:, i))
      end do
   end subroutine commit

   !> The part that is still held; while it changes there is no equilibrium.
   subroutine add_forces(self, context, attempt, forces)
      class(held_forces_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(block_forces_type), intent(inout) :: forces
      integer :: i
      do i = 1, self%n
         call forces%add_force(self%block(i), (1 - self%released(i))*self%force(:, i), &
                               self%point(:, i) - context%state%centroid(:, self%block(i)))
         if (self%steps_left(i) > 0) forces%driven = .true.
      end do
   end subroutine add_forces

   !> Save or load all forces.
   subroutine exchange_state(self, context, archive)
      class(held_forces_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      class(state_archive_type), intent(inout) :: archive
      call archive%section('held_forces')
      call archive%item('n', self%n, 0)
      if (self%n == 0) return
      call archive%item('block', self%block, self%n, 1, context%blocks%n_blocks)
      call archive%item('point', self%point, [2, self%n], largest_coordinate)
      call archive%item('force', self%force, [2, self%n])
      call archive%item('released', self%released, self%n, 0.0_wp, 1.0_wp)
      call archive%item('goal', self%goal, self%n, 0.0_wp, 1.0_wp)
      call archive%item('steps_left', self%steps_left, self%n, 0)
   end subroutine exchange_state

end module rockdda_interaction_held_forces
