! SPDX-License-Identifier: MIT
!> Permitted structure of an HDF5 file: groups, and plain datasets and attributes of numbers and texts in the file.
!> External storage, links other than hard ones, virtual datasets, unknown filters, groups that contain each other and
!> sizes that the file cannot contain are refused before anything is read or written: hdf5_structure_shim.c. Used by the
!> hdf5_… modules only.
module rockdda_io_hdf5_structure
   use, intrinsic :: iso_c_binding, only : c_char, c_int, c_int64_t, c_null_char
   use rockdda_base_kinds, only : i8
   implicit none
   private
   public :: structure_problem, kind_of_values, value_kind

   type :: value_kind_enum
      integer :: other = 0
      integer :: integers = 1     !! of 32 bits
      integer :: reals = 2        !! of 64 bits
      integer :: text = 3         !! one text of variable length
      integer :: texts = 4        !! of one length
      integer :: singles = 5      !! reals of 32 bits
   end type value_kind_enum
   !> What `kind_of_values` returns.
   type(value_kind_enum), parameter :: value_kind = value_kind_enum()

   !> Bytes of a message at most.
   integer, parameter :: longest = 1200

   interface
      integer(c_int) function c_check(file, message, room) bind(C, name='rockdda_structure_check')
         import :: c_char, c_int, c_int64_t
         integer(c_int64_t), value :: file
         character(kind=c_char), intent(inout) :: message(*)
         integer(c_int), value :: room
      end function c_check

      integer(c_int) function c_kind(dataset) bind(C, name='rockdda_structure_kind')
         import :: c_int, c_int64_t
         integer(c_int64_t), value :: dataset
      end function c_kind
   end interface

contains

   !> The first problem of the structure of an open file; '' without one.
   function structure_problem(file) result(problem)
      integer(i8), intent(in) :: file       !! of the library
      character(len=:), allocatable :: problem
      character(kind=c_char, len=longest) :: message
      message = c_null_char
      problem = ''
      if (c_check(int(file, c_int64_t), message, int(longest, c_int)) == 0) return
      problem = message(1:index(message, c_null_char) - 1)
   end function structure_problem

   !> The values of an open dataset: one of value_kind%...
   integer function kind_of_values(dataset)
      integer(i8), intent(in) :: dataset    !! of the library
      kind_of_values = int(c_kind(int(dataset, c_int64_t)))
   end function kind_of_values

end module rockdda_io_hdf5_structure
