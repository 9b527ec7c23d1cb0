! SPDX-License-Identifier: MIT
!> Check of the memory for BLAS. OpenBLAS allocates 128 MB at the first call and repeats the request for ever when the
!> system refuses.
module rockdda_linear_workspace
   use, intrinsic :: iso_c_binding, only : c_int, c_size_t
   use rockdda_base_error, only : error_type, error_code, make_error
   implicit none
   private
   public :: check_workspace

   !> Required address space [bytes]: that of OpenBLAS, its code and some for the factor.
   integer(c_size_t), parameter :: least_room = 210000000_c_size_t

   interface
      integer(c_int) function c_is_there(bytes) bind(C, name='rockdda_memory_is_there')
         import :: c_int, c_size_t
         integer(c_size_t), value :: bytes
      end function c_is_there
   end interface

contains

   !> To be called before the first call of BLAS. Error: too little memory.
   subroutine check_workspace(name, error)
      character(len=*), intent(in) :: name   !! of the solver
      type(error_type), allocatable, intent(out) :: error
      if (c_is_there(least_room) == 0) call make_error(error, error_code%computation, &
         'out of memory: the solver '//name//' needs 210 MB of address space to begin; choose pcg', &
         is_fatal=.true.)
   end subroutine check_workspace

end module rockdda_linear_workspace
