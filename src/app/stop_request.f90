! SPDX-License-Identifier: MIT
!> Requests of the program to stop a run before its end: a stop signal, or the time limit --max-wall.
module rockdda_app_stop_request
   use rockdda_run_stop_request, only : deadline_type
   use rockdda_app_process, only : seen_signal
   implicit none
   private
   public :: stop_request_type

   type, extends(deadline_type) :: stop_request_type
   contains
      procedure :: is_requested
      procedure :: reason
   end type stop_request_type

contains

   !> Has a stop signal arrived, or is the time limit reached?
   logical function is_requested(self)
      class(stop_request_type), intent(in) :: self
      is_requested = len(self%reason()) > 0
   end function is_requested

   !> Reason of the request, the `exit_reason` of the results; '' without a request.
   function reason(self) result(text)
      class(stop_request_type), intent(in) :: self
      character(len=:), allocatable :: text
      text = seen_signal()
      if (len(text) > 0) then
         text = 'signal '//text
      else if (self%deadline_type%is_requested()) then
         text = 'max-wall'
      end if
   end function reason

end module rockdda_app_stop_request
