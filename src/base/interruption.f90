! SPDX-License-Identifier: MIT
!> Requests to stop a computation before it is complete.
!>
!> Long computations call `is_requested` between iterations. The caller that starts the computation supplies the
!> extension: the library itself reads neither clocks nor signals for this.
module rockdda_base_interruption
   implicit none
   private
   public :: interruption_type

   type, abstract :: interruption_type
   contains
      !> Must the computation stop now? Once true, it stays true. One thread calls it at a time.
      procedure(request_interface), deferred :: is_requested
   end type interruption_type

   abstract interface
      logical function request_interface(self)
         import :: interruption_type
         class(interruption_type), intent(in) :: self
      end function request_interface
   end interface

end module rockdda_base_interruption
