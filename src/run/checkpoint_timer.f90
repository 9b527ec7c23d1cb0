! SPDX-License-Identifier: MIT
!> When the next checkpoint of a run is due.
module rockdda_run_checkpoint_timer
   use rockdda_base_kinds, only : wp
   implicit none
   private
   public :: checkpoint_timer_type

   !> The first checkpoint of a run comes after this time at the latest [s]. A shorter run writes one, at its end.
   real(wp), parameter :: first_interval = 0.2_wp

   type :: checkpoint_timer_type
      real(wp), private :: last = 0           !! wall clock when the run began or its last checkpoint ended [s]
      logical, private :: is_first = .false.  !! no checkpoint has been written yet
   contains
      procedure :: start
      procedure :: waits_for_first
      procedure :: restart
      procedure :: is_due
   end type checkpoint_timer_type

contains

   !> A new run begins at this time.
   subroutine start(self, now)
      class(checkpoint_timer_type), intent(inout) :: self
      real(wp), intent(in) :: now             !! wall clock [s]
      self%last = now
      self%is_first = .true.
   end subroutine start

   !> Has a new run no checkpoint yet?
   pure logical function waits_for_first(self)
      class(checkpoint_timer_type), intent(in) :: self
      waits_for_first = self%is_first
   end function waits_for_first

   !> A checkpoint ended at this time.
   subroutine restart(self, now)
      class(checkpoint_timer_type), intent(inout) :: self
      real(wp), intent(in) :: now             !! wall clock [s]
      self%last = now
      self%is_first = .false.
   end subroutine restart

   !> Has the interval passed since the last checkpoint, or a shorter one since the start? A run that is finished writes
   !> its checkpoint at the close.
   pure logical function is_due(self, now, interval, is_finished)
      class(checkpoint_timer_type), intent(in) :: self
      real(wp), intent(in) :: now             !! wall clock [s]
      real(wp), intent(in) :: interval        !! [s]
      logical, intent(in) :: is_finished
      real(wp) :: wait
      wait = interval
      if (self%is_first) wait = min(first_interval, interval)
      is_due = now - self%last >= wait .and. .not. is_finished
   end function is_due

end module rockdda_run_checkpoint_timer
