! SPDX-License-Identifier: MIT
!> Stop request at a time of the wall clock. The program extends it by signals.
module rockdda_run_stop_request
   use rockdda_base_kinds, only : wp
   use rockdda_base_interruption, only : interruption_type
   use rockdda_io_timestamp, only : wall_seconds
   implicit none
   private
   public :: deadline_type

   type, extends(interruption_type) :: deadline_type
      real(wp) :: deadline = huge(1.0_wp)   !! wall clock [s]
   contains
      procedure :: is_requested => is_late
   end type deadline_type

contains

   !> Has the deadline passed? NaN counts as passed.
   logical function is_late(self)
      class(deadline_type), intent(in) :: self
      is_late = .not. wall_seconds() < self%deadline
   end function is_late

end module rockdda_run_stop_request
