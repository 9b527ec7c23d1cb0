! SPDX-License-Identifier: MIT
!> Lock for HDF5, which one thread at a time may use. The lock is not recursive.
module rockdda_run_hdf5_lock
   implicit none
   private
   public :: lock_hdf5, unlock_hdf5

   interface
      !> Wait for the lock and acquire it.
      subroutine lock_hdf5() bind(C, name='rockdda_run_lock_hdf5')
      end subroutine lock_hdf5

      !> Release the lock.
      subroutine unlock_hdf5() bind(C, name='rockdda_run_unlock_hdf5')
      end subroutine unlock_hdf5
   end interface

end module rockdda_run_hdf5_lock
