! SPDX-License-Identifier: MIT
!> A table of a results file that grows by rows: rows wait in memory until they are written together.
!>
!> Integers are compressed. A compressed chunk that is written again changes its size and therefore its address, and
!> another chunk may occupy the old address before the index is updated: a reader would find the wrong rows. A chunk is
!> therefore compressed only if it is complete when it is first written; an incomplete chunk stays uncompressed at its
!> address.
!>
!>     rows     | chunk: complete | chunk: complete | last chunk: incomplete . . |
!>              |  compressed     |  compressed     |  uncompressed, then zeros  |
module rockdda_io_series
   use rockdda_base_kinds, only : wp, i8
   use rockdda_base_error, only : error_type
   use rockdda_io_digest, only : fold
   use rockdda_io_hdf5_adapter, only : hdf5_file_type
   implicit none
   private
   public :: series_type

   !> Preferred and largest size of a chunk [bytes].
   integer, parameter :: usual_chunk = 4096, largest_chunk = 1048576
   !> Rows of a chunk at most.
   integer, parameter :: most_chunk_rows = 1024
   !> Entries to read at a time.
   integer(i8), parameter :: most_read = 1048576

   type :: series_type
      character(len=:), allocatable :: name         !! dataset
      logical :: is_real = .true.                   !! else integers
      integer, allocatable :: row_shape(:)          !! Fortran order; size 0: one number a row
      integer :: row_size = 1                       !! entries in a row
      integer(i8) :: n_written = 0                  !! rows in the file
      integer :: n_waiting = 0                      !! rows in memory
      integer(i8) :: total = 0                      !! checksum of all rows, including those in memory
      integer, private :: n_begun = 0               !! rows of the last, incomplete chunk in the file
      real(wp), allocatable, private :: values(:)   !! rows of the last chunk, then rows waiting; integers are exact
   contains
      procedure :: init
      generic :: add => add_reals, add_integers
      procedure :: create
      procedure :: cut
      procedure :: write => write_waiting
      procedure :: add_zeros
      procedure :: total_in_file
      procedure :: waiting_bytes
      procedure, private :: add_reals, add_integers, store, chunk_shape, rows_of_chunk
      procedure, private :: write_complete, write_begun, keep_last
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
      self%n_begun = 0
      self%total = 0
      if (allocated(self%values)) deallocate (self%values)
      allocate (self%values(max(1, self%row_size)))
   end subroutine init

   !> Create the table in a file.
   subroutine create(self, file, error)
      class(series_type), intent(in) :: self
      type(hdf5_file_type), intent(in) :: file
      type(error_type), allocatable, intent(out) :: error
      call file%create_table(self%name, self%row_shape, self%is_real, self%chunk_shape(), error)
   end subroutine create

   !> Shorten the table of a file to its first rows; the next rows are appended behind them.
   subroutine cut(self, file, n_rows, total, error)
      class(series_type), intent(inout) :: self
      type(hdf5_file_type), intent(in) :: file
      integer(i8), intent(in) :: n_rows
      integer(i8), intent(in) :: total       !! checksum of these rows
      type(error_type), allocatable, intent(out) :: error
      integer, allocatable :: integers(:)
      integer(i8) :: first
      call file%resize(self%name, n_rows, error)
      if (allocated(error)) return
      self%n_written = n_rows
      self%total = total
      self%n_waiting = 0
      self%n_begun = 0
      if (self%row_size == 0) return
      self%n_begun = int(mod(n_rows, int(self%rows_of_chunk(), i8)))
      if (self%n_begun == 0) return
      first = n_rows - self%n_begun
      if (self%is_real) then
         call file%read(self%name, self%values, error, first, int(self%n_begun, i8))
      else
         call file%read(self%name, integers, error, first, int(self%n_begun, i8))
         if (.not. allocated(error)) self%values = real(integers, wp)
      end if
   end subroutine cut

   !> Shape of a chunk: several short rows, or a part of a long one.
   pure function chunk_shape(self) result(shape)
      class(series_type), intent(in) :: self
      integer :: shape(size(self%row_shape) + 1)
      integer :: bytes, rank, inner
      rank = size(shape)
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
      self%total = fold(self%total, values)
      call self%store(values, n_rows)
   end subroutine add_reals

   !> Add rows of integers.
   subroutine add_integers(self, values, n_rows)
      class(series_type), intent(inout) :: self
      integer, intent(in) :: values(:)        !! (row_size*n_rows)
      integer, intent(in) :: n_rows
      self%total = fold(self%total, values)
      call self%store(real(values, wp), n_rows)
   end subroutine add_integers

   !> Store rows in memory.
   subroutine store(self, values, n_rows)
      class(series_type), intent(inout) :: self
      real(wp), intent(in) :: values(:)
      integer, intent(in) :: n_rows
      real(wp), allocatable :: larger(:)
      integer :: n
      n = self%row_size*(self%n_begun + self%n_waiting)
      if (n + size(values) > size(self%values)) then
         allocate (larger(2*(n + size(values))))
         larger(1:n) = self%values(1:n)
         call move_alloc(larger, self%values)
      end if
      self%values(n + 1:n + size(values)) = values
      self%n_waiting = self%n_waiting + n_rows
   end subroutine store

   !> Add as many rows of zeros as a chunk has.
   subroutine add_zeros(self)
      class(series_type), intent(inout) :: self
      integer :: i, n
      n = self%rows_of_chunk()
      if (self%is_real) call self%add([(0.0_wp, i=1, n*self%row_size)], n)
      if (.not. self%is_real) call self%add([(0, i=1, n*self%row_size)], n)
   end subroutine add_zeros

   !> Compute the checksum of the first rows of the table, as they are read from a file.
   subroutine total_in_file(self, file, n_rows, total, error)
      class(series_type), intent(in) :: self
      type(hdf5_file_type), intent(in) :: file
      integer(i8), intent(in) :: n_rows
      integer(i8), intent(out) :: total
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: reals(:)
      integer, allocatable :: integers(:)
      integer(i8) :: skip, n, most
      total = 0
      if (self%row_size == 0) return
      ! whole chunks, so that none is unpacked twice
      n = self%rows_of_chunk()
      most = n*max(1_i8, most_read/(n*self%row_size))
      skip = 0
      do while (skip < n_rows)
         n = min(most, n_rows - skip)
         if (self%is_real) then
            call file%read(self%name, reals, error, skip, n)
            if (.not. allocated(error)) total = fold(total, reals)
         else
            call file%read(self%name, integers, error, skip, n)
            if (.not. allocated(error)) total = fold(total, integers)
         end if
         if (allocated(error)) return
         skip = skip + n
      end do
   end subroutine total_in_file

   !> Append the waiting rows to the file. After a failure the table must not be used.
   subroutine write_waiting(self, file, error)
      class(series_type), intent(inout) :: self
      type(hdf5_file_type), intent(in) :: file
      type(error_type), allocatable, intent(out) :: error
      integer(i8) :: first
      integer :: per_chunk, n_rows, done, n
      if (self%n_waiting == 0) return
      per_chunk = self%rows_of_chunk()
      first = self%n_written - self%n_begun
      n_rows = self%n_begun + self%n_waiting
      call file%resize(self%name, first + n_rows, error)
      if (allocated(error)) return
      done = 0
      if (self%row_size > 0) then
         if (self%n_begun > 0 .and. n_rows >= per_chunk) then
            call self%write_begun(file, first, per_chunk, done, error)
            if (allocated(error)) return
            done = per_chunk
         end if
         n = per_chunk*((n_rows - done)/per_chunk)
         if (n > 0) call self%write_complete(file, first, done, n, error)
         if (allocated(error)) return
         done = done + n
         if (n_rows > done) call self%write_begun(file, first, n_rows - done, done, error)
         if (allocated(error)) return
      end if
      self%n_written = self%n_written + self%n_waiting
      self%n_waiting = 0
      call self%keep_last(n_rows, done)
   end subroutine write_waiting

   !> Write complete chunks: n rows after the first `done` in memory.
   subroutine write_complete(self, file, first, done, n, error)
      class(series_type), intent(in) :: self
      type(hdf5_file_type), intent(in) :: file
      integer(i8), intent(in) :: first          !! rows in the file before those in memory
      integer, intent(in) :: done, n
      type(error_type), allocatable, intent(out) :: error
      integer :: a, b
      a = self%row_size*done + 1
      b = self%row_size*(done + n)
      if (self%is_real) then
         call file%write_rows(self%name, first + done, n, self%values(a:b), error)
      else
         call file%write_rows(self%name, first + done, n, int(self%values(a:b)), error)
      end if
   end subroutine write_complete

   !> Write an incomplete chunk of n rows, which follow the first `done` rows in memory.
   subroutine write_begun(self, file, first, n, done, error)
      class(series_type), intent(in) :: self
      type(hdf5_file_type), intent(in) :: file
      integer(i8), intent(in) :: first
      integer, intent(in) :: n, done
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: chunk(:)
      integer :: a, b
      a = self%row_size*done
      b = self%row_size*n
      allocate (chunk(self%row_size*self%rows_of_chunk()), source=0.0_wp)
      chunk(1:b) = self%values(a + 1:a + b)
      if (self%is_real) then
         call file%write_plain_chunk(self%name, first + done, chunk, error)
      else
         call file%write_plain_chunk(self%name, first + done, int(chunk), error)
      end if
   end subroutine write_begun

   !> Keep the rows of the incomplete chunk in memory and remove those before.
   subroutine keep_last(self, n_rows, done)
      class(series_type), intent(inout) :: self
      integer, intent(in) :: n_rows, done       !! in memory; of complete chunks
      integer :: a, b
      a = self%row_size*done
      b = self%row_size*(n_rows - done)
      self%n_begun = n_rows - done
      if (done > 0) self%values(1:b) = self%values(a + 1:a + b)
   end subroutine keep_last

   !> Number of rows of a chunk. A row divided into several chunks has one row per chunk, which is always complete.
   pure integer function rows_of_chunk(self)
      class(series_type), intent(in) :: self
      integer :: shape(size(self%row_shape) + 1)
      shape = self%chunk_shape()
      rows_of_chunk = shape(size(shape))
   end function rows_of_chunk

   !> Bytes in memory.
   pure integer(i8) function waiting_bytes(self)
      class(series_type), intent(in) :: self
      waiting_bytes = int(self%row_size, i8)*self%n_waiting*merge(8, 4, self%is_real)
   end function waiting_bytes

end module rockdda_io_series
