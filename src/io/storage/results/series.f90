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
!>
!> The library's work for a chunk hardly depends on its size; that of the last one is room that may stay empty. Chunks
!> are therefore larger where many rows are expected.
module rockdda_io_series
   use, intrinsic :: iso_c_binding, only : c_ptr, c_loc
   use, intrinsic :: iso_fortran_env, only : sp => real32
   use rockdda_base_kinds, only : wp, i8
   use rockdda_base_error, only : error_type
   use rockdda_io_digest, only : fold
   use rockdda_io_hdf5_adapter, only : hdf5_file_type
   implicit none
   private
   public :: series_type

   !> Size of a chunk [bytes]: usually, where many rows are expected, and at most.
   integer, parameter :: usual_chunk = 4096, large_chunk = 65536, largest_chunk = 1048576
   !> Rows of a usual chunk at most.
   integer, parameter :: most_chunk_rows = 1024
   !> Chunks that the expected rows fill at least, so that no more than a fifth of the table stays empty.
   integer, parameter :: least_chunks = 4
   !> Entries to read at a time.
   integer(i8), parameter :: most_read = 1048576
   !> Room in memory beyond this number of entries is taken as it is needed, and given back.
   integer, parameter :: large_room = 131072

   type :: series_type
      character(len=:), allocatable :: name         !! dataset
      logical :: is_real = .true.                   !! else integers
      logical :: is_single = .false.                !! reals of 32 bits
      integer, allocatable :: row_shape(:)          !! Fortran order; size 0: one number a row
      integer :: row_size = 1                       !! entries in a row
      logical :: is_absent = .false.                !! the file does not have it
      integer(i8) :: n_written = 0                  !! rows in the file
      integer :: n_waiting = 0                      !! rows in memory
      integer(i8) :: total = 0                      !! checksum of all rows, including those in memory
      integer, private :: per_chunk = 1             !! rows of a chunk
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
      procedure, private :: add_reals, add_integers, store, make_room, chunk_shape, take_chunk
      procedure, private :: write_plain, write_complete, keep_last, value_bytes, is_divided
   end type series_type

contains

   !> Name the table and the shape of its rows.
   subroutine init(self, name, is_real, row_shape, is_single, n_expected, only_filled)
      class(series_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      logical, intent(in) :: is_real
      integer, intent(in) :: row_shape(:)
      logical, intent(in), optional :: is_single        !! reals are rounded to 32 bits, default .false.
      integer(i8), intent(in), optional :: n_expected   !! rows of a new table in the end, default few
      logical, intent(in), optional :: only_filled      !! no table in the file when rows have no entries
      integer :: shape(size(row_shape) + 1)
      integer(i8) :: row_bytes, rows
      self%name = name
      self%is_real = is_real
      self%row_shape = row_shape
      self%row_size = product(row_shape)
      self%is_absent = .false.
      if (present(only_filled)) self%is_absent = only_filled .and. self%row_size == 0
      self%n_written = 0
      self%n_waiting = 0
      self%n_begun = 0
      self%total = 0
      self%is_single = .false.
      if (present(is_single)) self%is_single = is_single .and. is_real
      shape = self%chunk_shape()
      row_bytes = self%value_bytes()*product(int(shape(:size(row_shape)), i8))
      rows = min(int(most_chunk_rows, i8), usual_chunk/row_bytes)
      if (present(n_expected)) rows = max(rows, min(large_chunk/row_bytes, n_expected/least_chunks))
      self%per_chunk = int(max(1_i8, rows))
      if (allocated(self%values)) deallocate (self%values)
      allocate (self%values(max(1, self%row_size)))
   end subroutine init

   !> Create the table in a file.
   subroutine create(self, file, error)
      class(series_type), intent(in) :: self
      type(hdf5_file_type), intent(in) :: file
      type(error_type), allocatable, intent(out) :: error
      if (.not. self%is_absent) call file%create_table(self%name, self%row_shape, self%is_real, self%chunk_shape(), &
         error, &
                             self%is_single)
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
      if (self%is_absent) return
      call self%take_chunk(file, error)
      call file%resize(self%name, n_rows, error)
      if (allocated(error)) return
      self%n_written = n_rows
      self%total = total
      self%n_waiting = 0
      self%n_begun = 0
      if (self%row_size == 0) return
      self%n_begun = int(mod(n_rows, int(self%per_chunk, i8)))
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
      integer :: rank, inner
      rank = size(shape)
      shape(1:rank - 1) = max(1, self%row_shape)
      if (rank > 1) then
         inner = self%value_bytes()*product(shape(1:rank - 2))
         shape(rank - 1) = min(shape(rank - 1), max(1, largest_chunk/inner))
      end if
      shape(rank) = self%per_chunk
   end function chunk_shape

   !> Take the number of rows of a chunk from the table of a file. An error when its chunks have another shape, or when
   !> its values are of another kind.
   subroutine take_chunk(self, file, error)
      class(series_type), intent(inout) :: self
      type(hdf5_file_type), intent(in) :: file
      type(error_type), allocatable, intent(out) :: error
      integer(i8), allocatable :: found(:)
      integer(i8) :: row_bytes
      integer :: wanted(size(self%row_shape) + 1), rank
      logical :: same
      rank = size(wanted)
      wanted = self%chunk_shape()
      row_bytes = self%value_bytes()*product(int(wanted(:rank - 1), i8))
      call file%get_chunk(self%name, found, error)
      if (allocated(error)) return
      same = size(found) == rank .and. file%has_type(self%name, self%is_real, self%is_single)
      if (same) same = all(found(:rank - 1) == wanted(:rank - 1)) .and. found(rank) >= 1
      if (same) same = found(rank) == 1 .or. found(rank) <= max(int(most_chunk_rows, i8), large_chunk/row_bytes)
      if (same .and. self%is_divided()) same = found(rank) == 1
      if (same) self%per_chunk = int(found(rank))
      if (.not. same) call file%fail('the chunks of '//self%name//' are not as the run has written them', error)
   end subroutine take_chunk

   !> Bytes of a value in the file.
   pure integer function value_bytes(self)
      class(series_type), intent(in) :: self
      value_bytes = merge(8, 4, self%is_real .and. .not. self%is_single)
   end function value_bytes

   !> Add rows of reals.
   subroutine add_reals(self, values, n_rows)
      class(series_type), intent(inout) :: self
      real(wp), intent(in) :: values(:)       !! (row_size*n_rows)
      integer, intent(in) :: n_rows
      real(wp), allocatable :: rounded(:)
      if (self%is_single) then
         allocate (rounded(size(values)))
         rounded(:) = real(real(values, sp), wp)
         self%total = fold(self%total, rounded)
         call self%store(rounded, n_rows)
      else
         self%total = fold(self%total, values)
         call self%store(values, n_rows)
      end if
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
      integer :: n
      n = self%row_size*(self%n_begun + self%n_waiting)
      call self%make_room(n + size(values))
      self%values(n + 1:n + size(values)) = values
      self%n_waiting = self%n_waiting + n_rows
   end subroutine store

   !> Take memory for a number of values, those there are kept.
   pure subroutine make_room(self, needed)
      class(series_type), intent(inout) :: self
      integer, intent(in) :: needed
      real(wp), allocatable :: larger(:)
      integer :: n
      n = size(self%values)
      if (needed <= n) return
      allocate (larger(needed + merge(needed, n/2, needed <= large_room)))
      larger(1:n) = self%values
      call move_alloc(larger, self%values)
   end subroutine make_room

   !> Add as many rows of zeros as a chunk has.
   subroutine add_zeros(self)
      class(series_type), intent(inout) :: self
      integer :: i, n
      n = self%per_chunk
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
      n = self%per_chunk
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
      integer :: n_rows, done, n
      if (self%is_absent) self%n_waiting = 0
      if (self%n_waiting == 0) return
      first = self%n_written - self%n_begun
      n_rows = self%n_begun + self%n_waiting
      done = 0
      if (self%row_size == 0) then
         call file%resize(self%name, first + n_rows, error)
      else if (self%is_real .and. .not. self%is_divided()) then
         call self%write_plain(file, first, 0, n_rows, error)
      else
         if (self%n_begun > 0 .and. n_rows >= self%per_chunk) then
            call self%write_plain(file, first, 0, self%per_chunk, error)
            done = self%per_chunk
         end if
         n = self%per_chunk*((n_rows - done)/self%per_chunk)
         if (n > 0 .and. .not. allocated(error)) call self%write_complete(file, first, done, n, error)
         done = done + n
         if (n_rows > done .and. .not. allocated(error)) call self%write_plain(file, first, done, n_rows, error)
      end if
      if (allocated(error)) return
      self%n_written = self%n_written + self%n_waiting
      self%n_waiting = 0
      call self%keep_last(n_rows, self%per_chunk*(n_rows/self%per_chunk))
   end subroutine write_waiting

   !> Write complete chunks through the filters, or rows that are divided: n rows after the first `done` in memory.
   subroutine write_complete(self, file, first, done, n, error)
      class(series_type), intent(in) :: self
      type(hdf5_file_type), intent(in) :: file
      integer(i8), intent(in) :: first          !! rows in the file before those in memory
      integer, intent(in) :: done, n
      type(error_type), allocatable, intent(out) :: error
      integer :: a, b
      a = self%row_size*done + 1
      b = self%row_size*(done + n)
      call file%resize(self%name, first + done + n, error)
      if (allocated(error)) return
      if (self%is_real) then
         call file%write_rows(self%name, first + done, n, self%values(a:b), error)
      else
         call file%write_rows(self%name, first + done, n, int(self%values(a:b)), error)
      end if
   end subroutine write_complete

   !> Write the rows in memory from `done` on as chunks that are not compressed.
   subroutine write_plain(self, file, first, done, n_rows, error)
      class(series_type), intent(inout), target :: self
      type(hdf5_file_type), intent(in) :: file
      integer(i8), intent(in) :: first          !! rows in the file before those in memory
      integer, intent(in) :: done, n_rows       !! in memory
      type(error_type), allocatable, intent(out) :: error
      real(sp), allocatable, target :: singles(:)
      integer, allocatable, target :: integers(:)
      type(c_ptr) :: place
      integer :: a, b, n_chunks
      n_chunks = (n_rows - done + self%per_chunk - 1)/self%per_chunk
      a = self%row_size*done + 1
      b = a - 1 + self%row_size*self%per_chunk*n_chunks
      call self%make_room(b)
      self%values(self%row_size*n_rows + 1:b) = 0
      if (self%is_single) then
         singles = real(self%values(a:b), sp)
         place = c_loc(singles)
      else if (self%is_real) then
         place = c_loc(self%values(a))
      else
         integers = int(self%values(a:b))
         place = c_loc(integers)
      end if
      call file%write_plain_chunks(self%name, first + done, first + n_rows, self%per_chunk, n_chunks, &
                                   int(self%value_bytes(), i8)*self%row_size*self%per_chunk, place, error)
   end subroutine write_plain

   !> Keep the rows of the incomplete chunk in memory and remove those before.
   subroutine keep_last(self, n_rows, done)
      class(series_type), intent(inout) :: self
      integer, intent(in) :: n_rows, done       !! in memory; of complete chunks
      real(wp), allocatable :: smaller(:)
      integer :: a, b
      a = self%row_size*done
      b = self%row_size*(n_rows - done)
      self%n_begun = n_rows - done
      if (size(self%values) > max(large_room, 2*b)) then
         allocate (smaller(max(1, b)))
         smaller(1:b) = self%values(a + 1:a + b)
         call move_alloc(smaller, self%values)
      else if (done > 0) then
         self%values(1:b) = self%values(a + 1:a + b)
      end if
   end subroutine keep_last

   !> Is a row divided into several chunks? Then each has one row, and is always complete.
   pure logical function is_divided(self)
      class(series_type), intent(in) :: self
      integer :: shape(size(self%row_shape) + 1)
      shape = self%chunk_shape()
      is_divided = any(shape(:size(self%row_shape)) < self%row_shape)
   end function is_divided

   !> Bytes in memory.
   pure integer(i8) function waiting_bytes(self)
      class(series_type), intent(in) :: self
      waiting_bytes = int(self%row_size, i8)*self%n_waiting*self%value_bytes()
   end function waiting_bytes

end module rockdda_io_series
