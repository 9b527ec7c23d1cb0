! SPDX-License-Identifier: MIT
!> Runs of equal values.
module rockdda_base_runs
   use rockdda_base_kinds, only : l1
   implicit none
   private
   public :: run_length

contains

   !> Length of the run that n values begin with.
   pure integer function run_length(n, values)
      integer, intent(in) :: n         !! > 0
      logical(l1), intent(in) :: values(n)
      do run_length = 1, n - 1
         if (values(run_length + 1) .neqv. values(1)) return
      end do
      run_length = n
   end function run_length

end module rockdda_base_runs
