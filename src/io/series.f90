! SPDX-License-Identifier: MIT
!> A table of a results file that grows by rows: rows wait in memory until they are written together.
module rockdda_io_series
   use rockdda_base_kinds, only : wp, i8
   use rockdda_base_error, only : error_type
   use rockdda_io_hdf5_adapter, only : hdf5_file_type
   implicit none
   private
   public :: series_type

   !> Bytes of a chunk to aim at, and the largest.
   integer, parameter :: usual_chunk = 16384, largest_chunk = 1048576
   !> Rows of a chunk at most.
   integer, parameter :: most_chunk_rows = 1024

   type :: series_type
      character(len=:), allocatable :: name         !! dataset
      logical :: is_real = .true.                   !! else integers
      integer, allocatable :: row_shape(:)          !! Fortran order; size 0: one number a row
      integer :: row_size = 1                       !! entries in a row
      integer(i8) :: n_written = 0                  !! rows in the file
      integer :: n_waiting = 0                      !! rows in memory
      real(wp), allocatable, private :: reals(:)
      integer, allocatable, private :: integers(:)
   contains
      procedure :: init
      generic :: add => add_reals, add_integers
      procedure :: create
      procedure :: write => write_waiting
      procedure :: waiting_bytes
      procedure :: room_needed
      procedure, private :: add_reals, add_integers, chunk_shape
   end type series_type

contains

   !> Name the table and the shape of its rows.
   subroutine init(self, name, is_real, row_shape)
      class(series_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      logical, intent(in) :: is_real
      integer, intent(in) :: row_shape(:)
      self%name = name
      self%is_real = is_real
      self%row_shape = row_shape
      self%row_size = product(row_shape)
      self%n_written = 0
      self%n_waiting = 0
      if (allocated(self%reals)) deallocate (self%reals)
      if (allocated(self%integers)) deallocate (self%integers)
      if (is_real) allocate (self%reals(max(1, self%row_size)))
      if (.not. is_real) allocate (self%integers(max(1, self%row_size)))
   end subroutine init

   !> Create the table in a file.
   subroutine create(self, file, error)
      class(series_type), intent(in) :: self
      type(hdf5_file_type), intent(in) :: file
      type(error_type), allocatable, intent(out) :: error
      call file%create_table(self%name, self%row_shape, self%is_real, self%chunk_shape(), error)
   end subroutine create

   !> Shape of a chunk: several short rows, or a part of a long one.
   pure function chunk_shape(self) result(shape)
      class(series_type), intent(in) :: self
      integer, allocatable :: shape(:)
      integer :: bytes, rank, inner
      rank = size(self%row_shape) + 1
      allocate (shape(rank))
      bytes = merge(8, 4, self%is_real)
      shape(1:rank - 1) = max(1, self%row_shape)
      if (rank > 1) then
         inner = bytes*product(shape(1:rank - 2))
         shape(rank - 1) = min(shape(rank - 1), max(1, largest_chunk/inner))
      end if
      shape(rank) = max(1, min(most_chunk_rows, usual_chunk/(bytes*product(shape(1:rank - 1)))))
   end function chunk_shape

   !> Add rows of reals.
   subroutine add_reals(self, values, n_rows)
      class(series_type), intent(inout) :: self
      real(wp), intent(in) :: values(:)       !! (row_size*n_rows)
      integer, intent(in) :: n_rows
      real(wp), allocatable :: larger(:)
      integer :: n
      n = self%row_size*self%n_waiting
      if (n + size(values) > size(self%reals)) then
         allocate (larger(2*(n + size(values))))
         larger(1:n) = self%reals(1:n)
         call move_alloc(larger, self%reals)
      end if
      self%reals(n + 1:n + size(values)) = values
      self%n_waiting = self%n_waiting + n_rows
   end subroutine add_reals

   !> Add rows of integers.
   subroutine add_integers(self, values, n_rows)
      class(series_type), intent(inout) :: self
      integer, intent(in) :: values(:)        !! (row_size*n_rows)
      integer, intent(in) :: n_rows
      integer, allocatable :: larger(:)
      integer :: n
      n = self%row_size*self%n_waiting
      if (n + size(values) > size(self%integers)) then
         allocate (larger(2*(n + size(values))))
         larger(1:n) = self%integers(1:n)
         call move_alloc(larger, self%integers)
      end if
      self%integers(n + 1:n + size(values)) = values
      self%n_waiting = self%n_waiting + n_rows
   end subroutine add_integers

   !> Append the waiting rows to the file. They keep waiting when that fails.
   subroutine write_waiting(self, file, error)
      class(series_type), intent(inout) :: self
      type(hdf5_file_type), intent(in) :: file
      type(error_type), allocatable, intent(out) :: error
      integer :: n
      if (self%n_waiting == 0) return
      n = self%row_size*self%n_waiting
      if (self%is_real) then
         call file%append(self%name, self%reals(1:n), self%n_waiting, error)
      else
         call file%append(self%name, self%integers(1:n), self%n_waiting, error)
      end if
      if (allocated(error)) return
      self%n_written = self%n_written + self%n_waiting
      self%n_waiting = 0
   end subroutine write_waiting

   !> Bytes in memory.
   pure integer(i8) function waiting_bytes(self)
      class(series_type), intent(in) :: self
      waiting_bytes = int(self%row_size, i8)*self%n_waiting*merge(8, 4, self%is_real)
   end function waiting_bytes

   !> Bytes by which the file grows at most when the waiting rows are written: they may not compress, and the
   !> last chunk is written anew.
   pure integer(i8) function room_needed(self)
      class(series_type), intent(in) :: self
      integer(i8) :: chunk
      room_needed = 0
      if (self%n_waiting == 0) return
      chunk = product(int(self%chunk_shape(), i8))*merge(8, 4, self%is_real)
      room_needed = self%waiting_bytes() + self%waiting_bytes()/64 + 2*chunk + 4096
   end function room_needed

end module rockdda_io_series
