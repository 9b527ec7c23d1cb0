! SPDX-License-Identifier: MIT
!> Values written to an HDF5 file and read from it by the same call, each under its name:
!>
!>     call archive%section('state')
!>     call archive%item('time', state%time)           ! written to or read from state/time
!>     call archive%item('vertices', state%vertices)   ! allocated when read; missing: not allocated
!>
!> so that writer and reader cannot differ. Reals are restored bit by bit. After the first failure, kept in `error`, all
!> calls return at once.
module rockdda_io_archive
   use rockdda_base_kinds, only : wp, i8
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_state_archive, only : state_archive_type
   use rockdda_io_hdf5_adapter, only : hdf5_file_type
   implicit none
   private
   public :: archive_type

   type, extends(state_archive_type) :: archive_type
      type(hdf5_file_type) :: file
      type(error_type), allocatable :: error           !! the first failure
      character(len=:), allocatable, private :: prefix !! 'state/'
   contains
      procedure :: section
      procedure :: has_item
      procedure :: length
      procedure :: refuse
      generic :: item => text_item, integer_rows_item
      generic :: fixed => fixed_reals, fixed_integers
      generic :: part => integer_part, real_part, logical_part
      procedure :: integer_item, real_item, logical_item, integers_item, reals_item, real_rows_item, logicals_item
      procedure, private :: text_item, integer_rows_item, fixed_reals, fixed_integers
      procedure, private :: integer_part, real_part, logical_part
      procedure, private :: is_there, has_rows, wrong_size
   end type archive_type

contains

   !> Begin a section: the group of the items that follow.
   subroutine section(self, name)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      self%prefix = name//'/'
      if (self%saving .and. .not. allocated(self%error)) call self%file%create_group(name, self%error)
   end subroutine section

   !> Save or load a whole number.
   subroutine integer_item(self, name, value)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(inout) :: value
      integer :: values(1)
      values = value
      call self%fixed(name, values)
      value = values(1)
   end subroutine integer_item

   !> Save or load a real.
   subroutine real_item(self, name, value)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), intent(inout) :: value
      real(wp) :: values(1)
      values = value
      call self%fixed(name, values)
      value = values(1)
   end subroutine real_item

   !> Save or load a logical, stored as 0 or 1.
   subroutine logical_item(self, name, value)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      logical, intent(inout) :: value
      integer :: values(1)
      values = merge(1, 0, value)
      call self%fixed(name, values)
      value = values(1) /= 0
   end subroutine logical_item

   !> Write a text.
   subroutine text_item(self, name, text)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      character(len=:), allocatable, intent(inout) :: text
      if (allocated(self%error)) return
      if (self%saving) then
         if (allocated(text)) call self%file%write(self%prefix//name, text, self%error)
      else if (self%is_there(name)) then
         call self%file%read(self%prefix//name, text, self%error)
      else if (allocated(text)) then
         deallocate (text)
      end if
   end subroutine text_item

   !> Save or load a list of integers whose size in the file must be that of `values`.
   subroutine fixed_integers(self, name, values)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(inout) :: values(:)
      integer, allocatable :: found(:)
      if (allocated(self%error)) return
      if (self%saving) then
         call self%file%write(self%prefix//name, [size(values)], values, self%error)
         return
      end if
      call self%file%read(self%prefix//name, found, self%error)
      if (allocated(self%error)) return
      if (size(found) == size(values)) then
         values = found
      else
         call self%wrong_size(name)
      end if
   end subroutine fixed_integers

   !> Save or load a list of reals whose size in the file must be that of `values`.
   subroutine fixed_reals(self, name, values)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), intent(inout) :: values(:)
      real(wp), allocatable :: found(:)
      if (allocated(self%error)) return
      if (self%saving) then
         call self%file%write(self%prefix//name, [size(values)], values, self%error)
         return
      end if
      call self%file%read(self%prefix//name, found, self%error)
      if (allocated(self%error)) return
      if (size(found) == size(values)) then
         values = found
      else
         call self%wrong_size(name)
      end if
   end subroutine fixed_reals

   !> Save or load a list of integers.
   subroutine integers_item(self, name, values)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, allocatable, intent(inout) :: values(:)
      if (self%saving) then
         if (allocated(values)) call self%fixed(name, values)
      else if (.not. allocated(self%error)) then
         if (allocated(values)) deallocate (values)
         if (self%is_there(name)) call self%file%read(self%prefix//name, values, self%error)
      end if
   end subroutine integers_item

   !> Save or load a list of reals.
   subroutine reals_item(self, name, values)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), allocatable, intent(inout) :: values(:)
      if (self%saving) then
         if (allocated(values)) call self%fixed(name, values)
      else if (.not. allocated(self%error)) then
         if (allocated(values)) deallocate (values)
         if (self%is_there(name)) call self%file%read(self%prefix//name, values, self%error)
      end if
   end subroutine reals_item

   !> Save or load a table of integers.
   subroutine integer_rows_item(self, name, values)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, allocatable, intent(inout) :: values(:, :)
      integer, allocatable :: list(:)
      integer :: n(2)
      if (allocated(self%error)) return
      if (self%saving) then
         if (allocated(values)) call self%file%write(self%prefix//name, shape(values), &
                                                     reshape(values, [size(values)]), self%error)
         return
      end if
      if (allocated(values)) deallocate (values)
      if (.not. self%has_rows(name, n)) return
      call self%file%read(self%prefix//name, list, self%error)
      if (.not. allocated(self%error)) values = reshape(list, n)
   end subroutine integer_rows_item

   !> Save or load a table of reals.
   subroutine real_rows_item(self, name, values)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), allocatable, intent(inout) :: values(:, :)
      real(wp), allocatable :: list(:)
      integer :: n(2)
      if (allocated(self%error)) return
      if (self%saving) then
         if (allocated(values)) call self%file%write(self%prefix//name, shape(values), &
                                                     reshape(values, [size(values)]), self%error)
         return
      end if
      if (allocated(values)) deallocate (values)
      if (.not. self%has_rows(name, n)) return
      call self%file%read(self%prefix//name, list, self%error)
      if (.not. allocated(self%error)) values = reshape(list, n)
   end subroutine real_rows_item

   !> Save or load a list of logicals.
   subroutine logicals_item(self, name, values)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      logical, allocatable, intent(inout) :: values(:)
      integer, allocatable :: numbers(:)
      if (self%saving .and. allocated(values)) then
         allocate (numbers(size(values)))
         numbers(:) = merge(1, 0, values)
      end if
      call self%item(name, numbers)
      if (self%saving) return
      if (allocated(values)) deallocate (values)
      if (allocated(numbers)) values = numbers /= 0
   end subroutine logicals_item

   !> Save or load the first n entries of an allocated list.
   subroutine integer_part(self, name, n, values)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: n
      integer, allocatable, intent(inout) :: values(:)
      call self%fixed(name, values(1:n))
   end subroutine integer_part

   !> Save or load the first n entries of an allocated list of reals.
   subroutine real_part(self, name, n, values)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: n
      real(wp), allocatable, intent(inout) :: values(:)
      call self%fixed(name, values(1:n))
   end subroutine real_part

   !> Save or load the first n entries of an allocated list of logicals.
   subroutine logical_part(self, name, n, values)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: n
      logical, allocatable, intent(inout) :: values(:)
      integer, allocatable :: numbers(:)
      allocate (numbers(n))
      numbers(:) = merge(1, 0, values(1:n))
      call self%fixed(name, numbers)
      values(1:n) = numbers /= 0
   end subroutine logical_part

   !> Does the file contain this item?
   logical function is_there(self, name)
      class(archive_type), intent(in) :: self
      character(len=*), intent(in) :: name
      is_there = self%file%exists(self%prefix//name)
   end function is_there

   !> Does the file contain this table? Its shape; an error for what is no table.
   logical function has_rows(self, name, n)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(out) :: n(2)
      integer(i8), allocatable :: shape_there(:)
      n = 0
      has_rows = .false.
      if (.not. self%is_there(name)) return
      call self%file%get_shape(self%prefix//name, shape_there, self%error)
      if (allocated(self%error)) return
      has_rows = size(shape_there) == 2
      if (has_rows) then
         n = int(shape_there)
      else
         call self%wrong_size(name)
      end if
   end function has_rows

   !> Does the present section contain this item? For loading.
   logical function has_item(self, name)
      class(archive_type), intent(in) :: self
      character(len=*), intent(in) :: name
      has_item = .false.
      if (.not. allocated(self%error)) has_item = self%is_there(name)
   end function has_item

   !> Number of values of a list or rows of a table; -1 when it is missing. For loading.
   integer(i8) function length(self, name)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer(i8), allocatable :: shape_there(:)
      length = -1
      if (.not. self%has_item(name)) return
      call self%file%get_shape(self%prefix//name, shape_there, self%error)
      if (allocated(self%error)) return
      if (size(shape_there) > 0) length = shape_there(size(shape_there))
   end function length

   !> End loading with an error about a value of the present section.
   subroutine refuse(self, name, what)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      character(len=*), intent(in) :: what          !! 'holds an impossible number'
      if (allocated(self%error)) return
      call make_error(self%error, error_code%input, self%file%path//': the checkpoint is damaged: '// &
                      self%prefix//name//' '//what)
   end subroutine refuse

   !> End loading with an error about the shape of an item.
   subroutine wrong_size(self, name)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      call self%refuse(name, 'has an unexpected shape')
   end subroutine wrong_size

end module rockdda_io_archive
