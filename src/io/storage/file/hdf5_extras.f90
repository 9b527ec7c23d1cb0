! SPDX-License-Identifier: MIT
!> What the Fortran interface of the HDF5 library (1.10) lacks: the reason of the last failure, opening files without a
!> lock, what an object is, writing a chunk as it is, and the structure of a file.
!>
!> Permitted are groups, and plain datasets and attributes of numbers and texts in the file. External storage, links
!> other than hard ones, virtual datasets, unknown filters, groups that contain each other and sizes that the file
!> cannot contain are refused before anything is read or written: hdf5_structure_shim.c. Used by
!> rockdda_io_hdf5_adapter.
module rockdda_io_hdf5_extras
   use, intrinsic :: iso_c_binding, only : c_ptr, c_null_char, c_char, c_int, c_int32_t, c_int64_t, c_size_t, &
      c_funptr, c_funloc, c_loc, c_f_pointer, c_associated, c_bool
   use rockdda_base_kinds, only : i8
   implicit none
   private
   public :: get_reason, set_file_locking, is_valid, write_chunk, structure_problem, kind_of_values, value_kind

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

   !> Bytes of a reason, and of the message about a structure, at most.
   integer, parameter :: longest = 600, longest_message = 1200
   !> Both filters of a table left out: shuffle and compression.
   integer(c_int32_t), parameter :: all_filters = 3

   !> H5E_error2_t
   type, bind(C) :: hdf5_error_type
      integer(c_int64_t) :: class_id, major, minor
      integer(c_int) :: line
      type(c_ptr) :: function_name, file_name, description
   end type hdf5_error_type

   !> Result of the walk along the error stack.
   type, bind(C) :: reason_type
      character(kind=c_char, len=1) :: text(longest)
   end type reason_type

   interface
      !> Call `visit` for each record of the stack of errors; these return < 0 on failure.
      integer(c_int) function c_walk(stack, direction, visit, client) bind(C, name='H5Ewalk2')
         import :: c_int, c_int64_t, c_funptr, c_ptr
         integer(c_int64_t), value :: stack
         integer(c_int), value :: direction
         type(c_funptr), value :: visit
         type(c_ptr), value :: client
      end function c_walk

      !> Lock files when they are opened, or do not.
      integer(c_int) function set_file_locking(access, use_locking, ignore_when_disabled) &
         bind(C, name='H5Pset_file_locking')
         import :: c_int, c_int64_t, c_bool
         integer(c_int64_t), value :: access
         logical(c_bool), value :: use_locking, ignore_when_disabled
      end function set_file_locking

      !> Above 0 for an object of the library, such as a type or a file that is open. Needs no library that was started.
      integer(c_int) function is_valid(object) bind(C, name='H5Iis_valid')
         import :: c_int, c_int64_t
         integer(c_int64_t), value :: object
      end function is_valid

      !> Write the bytes of a chunk as they are.
      integer(c_int) function c_write_chunk(dataset, transfer, filters_left_out, offset, n_bytes, values) &
         bind(C, name='H5Dwrite_chunk')
         import :: c_int, c_int32_t, c_int64_t, c_size_t, c_ptr
         integer(c_int64_t), value :: dataset, transfer
         integer(c_int32_t), value :: filters_left_out      !! one bit each
         integer(c_int64_t), intent(in) :: offset(*)        !! in C order
         integer(c_size_t), value :: n_bytes
         type(c_ptr), value :: values
      end function c_write_chunk

      !> Check the structure of a file: 0, or a message.
      integer(c_int) function c_check(file, message, room) bind(C, name='rockdda_structure_check')
         import :: c_char, c_int, c_int64_t
         integer(c_int64_t), value :: file
         character(kind=c_char), intent(inout) :: message(*)
         integer(c_int), value :: room
      end function c_check

      !> The values of an open dataset: one of value_kind%...
      integer(c_int) function kind_of_values(dataset) bind(C, name='rockdda_structure_kind')
         import :: c_int, c_int64_t
         integer(c_int64_t), value :: dataset
      end function kind_of_values
   end interface

contains

   !> The first problem of the structure of an open file; '' without one.
   function structure_problem(file) result(problem)
      integer(i8), intent(in) :: file       !! of the library
      character(len=:), allocatable :: problem
      character(kind=c_char, len=longest_message) :: message
      message = c_null_char
      problem = ''
      if (c_check(int(file, c_int64_t), message, int(longest_message, c_int)) == 0) return
      problem = message(1:index(message, c_null_char) - 1)
   end function structure_problem

   !> Write the bytes of a chunk with all filters left out; the file's byte order is that of this machine.
   integer function write_chunk(dataset, skip, rank, n_bytes, values, first)
      integer(i8), intent(in) :: dataset
      integer(i8), intent(in) :: skip        !! rows (of the slowest dimension) before the chunk
      integer, intent(in) :: rank
      integer(i8), intent(in) :: n_bytes
      type(c_ptr), intent(in) :: values
      integer(i8), intent(in) :: first       !! bytes of `values` before the chunk
      integer(c_int64_t) :: offset(rank)
      character(kind=c_char, len=1), pointer :: bytes(:)
      offset = 0
      offset(1) = skip
      call c_f_pointer(values, bytes, [first + n_bytes])
      write_chunk = int(c_write_chunk(dataset, 0_c_int64_t, all_filters, offset, int(n_bytes, c_size_t), &
                                      c_loc(bytes(first + 1))))
   end function write_chunk

   !> The deepest message on HDF5's error stack: that of the system if present, otherwise that of the library.
   function get_reason() result(reason)
      character(len=:), allocatable :: reason
      type(reason_type), target :: found
      integer :: i, first
      character(len=*), parameter :: mark = 'error message = '''
      found%text = c_null_char
      i = int(c_walk(0_c_int64_t, 0_c_int, c_funloc(take_first), c_loc(found)))
      reason = ''
      do i = 1, longest
         if (found%text(i) == c_null_char) exit
         reason = reason//found%text(i)
      end do
      first = index(reason, mark)
      if (first > 0) then
         reason = reason(first + len(mark):)
         i = index(reason, '''')
         if (i > 0) reason = reason(1:i - 1)
      end if
   end function get_reason

   !> Visitor of the error stack: keeps the description of the first entry.
   integer(c_int) function take_first(n, entry, client) bind(C, name='rockdda_hdf5_take_first')
      integer(c_int), value :: n
      type(hdf5_error_type), intent(in) :: entry
      type(c_ptr), value :: client
      type(reason_type), pointer :: found
      character(kind=c_char, len=1), pointer :: description(:)
      integer :: i
      take_first = 0
      if (n /= 0 .or. .not. c_associated(entry%description)) return
      call c_f_pointer(client, found)
      call c_f_pointer(entry%description, description, [longest])
      do i = 1, longest - 1
         if (description(i) == c_null_char) exit
         found%text(i) = description(i)
      end do
   end function take_first

end module rockdda_io_hdf5_extras
