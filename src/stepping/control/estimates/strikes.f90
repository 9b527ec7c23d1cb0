! SPDX-License-Identifier: MIT
!> Blocks that struck others in dynamic steps, and how far they have moved since: the part of a motion that the estimate
!> of the error in time leaves out, because it depends on when and how hard the blocks met.
!>
!> A contact strikes when it closes in a step and its points approached, along its normal and at the start of the step,
!> faster than `least_share` of the largest speed of any block so far. Of each block the fastest strike counts; slow
!> ones are forgotten as blocks become faster. What counts is the largest distance from there at the end of any step:
!> a block that bounces and comes back to where it was struck depends on the step all the same. With a coefficient of
!> restitution the first rebound does not, and the distance is that at the end. Where records move the
!> supports, distances are those from the ground that moves with them.
module rockdda_stepping_strikes
   use rockdda_base_kinds, only : wp, i1
   use rockdda_contact_table, only : contact_table_type, contact_state
   use rockdda_interaction_attempt, only : attempt_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_dashpots, only : opening_speed
   implicit none
   private
   public :: strikes_type

   !> Share of the largest speed below which blocks that meet do not strike each other.
   real(wp), parameter :: least_share = 0.05_wp
   !> Rows of `of_blocks`: centroid from the ground at the fastest strike, speed of that strike or 0, largest distance
   !> since the first strike that counts, 1 where the fastest strike has no law of impact.
   integer, parameter :: n_rows = 5, at_speed = 3, at_way = 4, at_lawless = 5

   !> Part of the state of a run.
   type :: strikes_type
      real(wp) :: fastest = 0                    !! mean speed of any vertex in a step since the dynamic part began
      real(wp), allocatable :: of_blocks(:, :)   !! (n_rows, nb); no columns before the first dynamic step
   contains
      procedure :: init
      procedure :: add
      procedure :: has_shape
      procedure :: count_struck
      procedure :: way_after
      procedure, private :: counts
      procedure, private :: way_of
   end type strikes_type

contains

   !> Before the first step.
   pure subroutine init(self)
      class(strikes_type), intent(inout) :: self
      self%fastest = 0
      if (allocated(self%of_blocks)) deallocate (self%of_blocks)
      allocate (self%of_blocks(n_rows, 0))
   end subroutine init

   !> Are there the rows that a model with nb blocks has?
   pure logical function has_shape(self, nb)
      class(strikes_type), intent(in) :: self
      integer, intent(in) :: nb
      has_shape = .false.
      if (allocated(self%of_blocks)) has_shape = size(self%of_blocks, 1) == n_rows .and. &
                                                 any(size(self%of_blocks, 2) == [0, nb])
   end function has_shape

   !> Take up a dynamic step that is accepted, before the blocks move and contacts take their new states.
   subroutine add(self, context, attempt, table, states, restitution, speed, is_first)
      class(strikes_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(contact_table_type), intent(in) :: table    !! with the states of the step's start
      integer(i1), intent(in) :: states(:)             !! (>= rows) of its end
      real(wp), intent(in) :: restitution(:)           !! of joint materials, < 0: no law of impact
      real(wp), intent(in) :: speed                    !! of the fastest vertex, mean of the step
      logical, intent(in) :: is_first                  !! a dynamic part begins
      real(wp) :: approach                             !! of the points of a contact
      integer :: c, i
      if (is_first) then
         call self%init()
         deallocate (self%of_blocks)
         allocate (self%of_blocks(n_rows, context%blocks%n_blocks), source=0.0_wp)
      end if
      do i = 1, size(self%of_blocks, 2)
         if (self%of_blocks(at_lawless, i) > 0) self%of_blocks(at_way, i) = self%way_of(context, attempt, i)
      end do
      self%fastest = max(self%fastest, speed)
      do c = 1, table%n
         if (table%state(c) /= contact_state%open .or. states(c) == contact_state%open) cycle
         approach = -opening_speed(context, attempt, table, c)
         call mark(table%block_a(c), approach, restitution(table%joint(c)) < 0)
         call mark(table%block_b(c), approach, restitution(table%joint(c)) < 0)
      end do

   contains

      !> A block strikes another one.
      subroutine mark(i, at, is_lawless)
         integer, intent(in) :: i                      !! block
         real(wp), intent(in) :: at                    !! speed of approach
         logical, intent(in) :: is_lawless             !! no law of impact holds
         if (.not. at > max(least_share*self%fastest, self%of_blocks(at_speed, i))) return
         ! the way after a strike that counts is not lost by a faster one
         if (.not. self%counts(i)) self%of_blocks(at_way, i) = 0
         self%of_blocks(:at_speed, i) = [from_ground(context, attempt, i), at]
         self%of_blocks(at_lawless, i) = merge(1, 0, is_lawless)
      end subroutine mark

   end subroutine add

   !> Has a block struck another one, fast enough to count now?
   pure logical function counts(self, i)
      class(strikes_type), intent(in) :: self
      integer, intent(in) :: i
      counts = self%of_blocks(at_speed, i) > least_share*self%fastest
   end function counts

   !> How many blocks have struck others.
   pure integer function count_struck(self)
      class(strikes_type), intent(in) :: self
      integer :: i
      count_struck = 0
      do i = 1, size(self%of_blocks, 2)
         if (self%counts(i)) count_struck = count_struck + 1
      end do
   end function count_struck

   !> Largest distance of a block from where it was struck fastest, up to now [length].
   pure real(wp) function way_of(self, context, attempt, i)
      class(strikes_type), intent(in) :: self
      type(step_context_type), intent(in) :: context   !! now
      type(attempt_type), intent(in) :: attempt
      integer, intent(in) :: i                         !! block
      way_of = max(self%of_blocks(at_way, i), norm2(from_ground(context, attempt, i) - self%of_blocks(1:2, i)))
   end function way_of

   !> Centroid of a block less the displacement of the ground.
   pure function from_ground(context, attempt, i) result(place)
      type(step_context_type), intent(in) :: context   !! now
      type(attempt_type), intent(in) :: attempt
      integer, intent(in) :: i                         !! block
      real(wp) :: place(2)
      place = context%state%centroid(:, i)
      if (context%ground_motion%acts('base_motion')) place = place - &
         context%ground_motion%displacement('base_motion', context%state%time - attempt%motion_start)
   end function from_ground

   !> The same of all blocks.
   pure real(wp) function way_after(self, context, attempt)
      class(strikes_type), intent(in) :: self
      type(step_context_type), intent(in) :: context   !! now
      type(attempt_type), intent(in) :: attempt
      integer :: i
      way_after = 0
      do i = 1, size(self%of_blocks, 2)
         if (self%counts(i)) way_after = max(way_after, self%way_of(context, attempt, i))
      end do
   end function way_after

end module rockdda_stepping_strikes
