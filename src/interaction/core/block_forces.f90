! SPDX-License-Identifier: MIT
!> Forces on the blocks at the end of a step, and how far they are from balance (docs/theory.md, "Equilibrium").
!>
!>     unbalanced = max over blocks |resultant| / mean over blocks of the sum of the magnitudes of single forces
!>
!> The resultant is that of all forces but inertia and viscous damping; its moment about the centroid counts as the
!> force that has it on the arm of the block's radius of inertia. Blocks that are wholly fixed, and inactive ones, are
!> left out of both.
module rockdda_interaction_block_forces
   use rockdda_base_kinds, only : wp
   use rockdda_model_state, only : block_state_type, radius_of_inertia
   implicit none
   private
   public :: block_forces_type

   !> A block held at this number of points cannot move as a rigid body.
   integer, parameter :: points_that_fix = 2

   type :: block_forces_type
      real(wp), allocatable :: resultant(:, :)   !! (3, nb) Fx, Fy, moment about the centroid
      real(wp), allocatable :: magnitude(:)      !! (nb) sum of the magnitudes of single forces
      integer, allocatable :: held(:)            !! (nb) points at which supports hold the block
      logical :: driven = .false.                !! a support is moved: no equilibrium yet
   contains
      procedure :: clear
      procedure :: add_force
      procedure :: add_load
      procedure :: counts
      procedure :: force_of
      procedure :: mean_magnitude
      procedure :: unbalanced
   end type block_forces_type

contains

   !> No forces on n blocks.
   pure subroutine clear(self, n)
      class(block_forces_type), intent(inout) :: self
      integer, intent(in) :: n
      if (.not. allocated(self%magnitude)) allocate (self%resultant(3, n), self%magnitude(n), self%held(n))
      self%resultant = 0
      self%magnitude = 0
      self%held = 0
      self%driven = .false.
   end subroutine clear

   !> Add a force at a point.
   pure subroutine add_force(self, block, force, arm)
      class(block_forces_type), intent(inout) :: self
      integer, intent(in) :: block
      real(wp), intent(in) :: force(2)
      real(wp), intent(in) :: arm(2)   !! from the centroid to the point [length]
      associate (r => self%resultant(:, block))
         r(1:2) = r(1:2) + force
         r(3) = r(3) + (arm(1)*force(2) - arm(2)*force(1))
      end associate
      self%magnitude(block) = self%magnitude(block) + sqrt(force(1)**2 + force(2)**2)
   end subroutine add_force

   !> Add a load whose first three terms are force and moment.
   pure subroutine add_load(self, block, load)
      class(block_forces_type), intent(inout) :: self
      integer, intent(in) :: block
      real(wp), intent(in) :: load(3)
      self%resultant(:, block) = self%resultant(:, block) + load
      self%magnitude(block) = self%magnitude(block) + sqrt(load(1)**2 + load(2)**2)
   end subroutine add_load

   !> Does a block count? Not when it is wholly fixed, inactive or asleep.
   pure logical function counts(self, block, state)
      class(block_forces_type), intent(in) :: self
      integer, intent(in) :: block
      type(block_state_type), intent(in) :: state
      counts = self%held(block) < points_that_fix .and. state%active(block)
      if (allocated(state%asleep)) counts = counts .and. .not. state%asleep(block)
   end function counts

   !> Resultant force on a block, with its moment over the radius of inertia.
   pure real(wp) function force_of(self, block, state) result(force)
      class(block_forces_type), intent(in) :: self
      integer, intent(in) :: block
      type(block_state_type), intent(in) :: state
      associate (r => self%resultant(:, block))
         force = sqrt(r(1)**2 + r(2)**2 + (r(3)/radius_of_inertia(state, block))**2)
      end associate
   end function force_of

   !> Mean over the blocks that count of the sum of the magnitudes of their forces.
   pure real(wp) function mean_magnitude(self, state) result(mean)
      class(block_forces_type), intent(in) :: self
      type(block_state_type), intent(in) :: state
      integer :: i, n
      n = 0
      mean = 0
      do i = 1, size(self%magnitude)
         if (.not. self%counts(i, state)) cycle
         n = n + 1
         mean = mean + self%magnitude(i)
      end do
      mean = mean/max(1, n)
   end function mean_magnitude

   !> Largest resultant over the mean magnitude; 0 where there are no forces.
   pure real(wp) function unbalanced(self, state)
      class(block_forces_type), intent(in) :: self
      type(block_state_type), intent(in) :: state
      real(wp) :: mean
      integer :: i
      unbalanced = 0
      mean = self%mean_magnitude(state)
      if (.not. mean > 0) return
      do i = 1, size(self%magnitude)
         if (self%counts(i, state)) unbalanced = max(unbalanced, self%force_of(i, state)/mean)
      end do
   end function unbalanced

end module rockdda_interaction_block_forces
