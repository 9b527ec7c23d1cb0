! SPDX-License-Identifier: MIT
!> One thread at a time may use HDF5: runs in several threads of one process take turns. Who takes the turn waits until
!> it is free, and does not take it again before ending it.
module rockdda_run_turn
   implicit none
   private
   public :: take_turn, end_turn

   interface
      !> Wait for the turn and take it.
      subroutine take_turn() bind(C, name='rockdda_run_take_turn')
      end subroutine take_turn

      !> Let others have it.
      subroutine end_turn() bind(C, name='rockdda_run_end_turn')
      end subroutine end_turn
   end interface

end module rockdda_run_turn
