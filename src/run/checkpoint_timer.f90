! SPDX-License-Identifier: MIT
!> When the next checkpoint of a run is due.
module rockdda_run_checkpoint_timer
   use rockdda_base_kinds, only : wp
   implicit none
   private
   public :: checkpoint_timer_type

   type :: checkpoint_timer_type
      real(wp), private :: last = 0           !! wall clock when the last checkpoint ended [s]
   contains
      procedure :: restart
      procedure :: is_due
   end type checkpoint_timer_type

contains

   !> Measure the interval from this time.
   subroutine restart(self, now)
      class(checkpoint_timer_type), intent(inout) :: self
      real(wp), intent(in) :: now             !! wall clock [s]
      self%last = now
   end subroutine restart

   !> Has the interval passed since the last checkpoint? A run that is finished writes its checkpoint at the close.
   pure logical function is_due(self, now, interval, is_finished)
      class(checkpoint_timer_type), intent(in) :: self
      real(wp), intent(in) :: now             !! wall clock [s]
      real(wp), intent(in) :: interval        !! [s]
      logical, intent(in) :: is_finished
      is_due = now - self%last >= interval .and. .not. is_finished
   end function is_due

end module rockdda_run_checkpoint_timer
