! SPDX-License-Identifier: MIT
!> The mark of a test that returns because something it needs is missing, for the stand-in and for pFUnit itself, which
!> cannot skip a test at run time.
module skipped_tests
   use, intrinsic :: iso_fortran_env, only : output_unit
   implicit none
   private
   public :: skip_test

contains

   !> Print the line that scripts/summarize_tests.py counts as a skipped test; the test then returns.
   subroutine skip_test(reason)
      character(len=*), intent(in) :: reason
      write (output_unit, '(/,2a)') 'SKIPPED | ', reason
   end subroutine skip_test

end module skipped_tests
