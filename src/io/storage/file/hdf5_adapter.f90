! SPDX-License-Identifier: MIT
!> The adapter to the HDF5 library: datasets, tables that grow by rows, in chunks, and what rockdda_io_hdf5_file
!> (files, groups) and rockdda_io_hdf5_attributes make. Of the other modules only rockdda_io_hdf5_extras and
!> rockdda_io_hdf5_driver use the library, for what its Fortran interface lacks.
!>
!> Files have the library's default (oldest) format, which stays readable after a kill once it was flushed.
!> Arrays travel as flat lists with their shape in Fortran order; readers that count in C order (h5py) see the
!> shape reversed: (2, nv) here is nv x 2 there. Reals are 64-bit (some tables of frames on request 32-bit), integers
!> 32-bit, all little endian; text is UTF-8 of variable length. HDF5's own messages are switched off; the reason goes
!> into the error.
module rockdda_io_hdf5_adapter
   use, intrinsic :: iso_fortran_env, only : sp => real32
   use, intrinsic :: iso_c_binding, only : c_ptr, c_null_ptr, c_loc, c_char, c_null_char
   use hdf5, only : hid_t, hsize_t, size_t, h5dget_type_f, h5tget_size_f, H5P_DATASET_XFER_F, H5S_SCALAR_F, &
      H5S_SELECT_SET_F, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, H5T_NATIVE_INTEGER, H5T_STD_I32LE, h5dclose_f, &
      h5dcreate_f, h5dopen_f, h5dread_f, h5dwrite_f, h5pclose_f, h5pcreate_f, h5pset_buffer_f, h5sclose_f, &
      h5screate_f, h5screate_simple_f, h5sselect_hyperslab_f, h5tclose_f, H5P_DATASET_CREATE_F, H5S_UNLIMITED_F, &
      H5T_IEEE_F32LE, h5dget_create_plist_f, h5dget_space_f, h5dset_extent_f, h5pget_chunk_f, h5pset_chunk_f, &
      h5pset_deflate_f, h5pset_shuffle_f, h5sget_simple_extent_dims_f, h5sget_simple_extent_ndims_f
   use rockdda_base_kinds, only : wp, i8
   use rockdda_base_error, only : error_type
   use rockdda_io_hdf5_structure, only : kind_of_values, value_kind
   use rockdda_io_hdf5_file, only : hdf5_version, new_space, new_text_type, new_fixed_text_type, take_text
   use rockdda_io_hdf5_attributes, only : hdf5_attributes_type
   use rockdda_io_hdf5_extras, only : write_chunk
   implicit none
   private
   public :: hdf5_file_type, hdf5_version

   !> Compression level: most of the gain for the least time.
   integer, parameter :: gzip_level = 1

   !> Size of the conversion buffer for a text [bytes]; the default of the library is 1 MiB, cleared each time.
   integer(hsize_t), parameter :: text_buffer = 4096

   !> Letters of a list of texts at most.
   integer(i8), parameter :: most_texts = 1000000_i8

   type, extends(hdf5_attributes_type) :: hdf5_file_type
   contains
      procedure :: create_table
      procedure :: resize
      procedure :: get_chunk
      generic :: write_plain_chunks => write_plain_reals, write_plain_singles, write_plain_integers
      procedure :: open_rows
      procedure :: get_shape
      procedure :: has_type
      generic :: write => write_reals, write_integers, write_text
      procedure :: write_texts
      procedure :: read_texts
      generic :: read => read_reals, read_integers, read_text
      generic :: write_rows => write_real_rows, write_integer_rows
      procedure, private :: write_reals, write_integers, write_text, read_reals, read_integers, read_text
      procedure, private :: write_real_rows, write_integer_rows
      procedure, private :: create_dataset, write_plain_reals, write_plain_singles, write_plain_integers
   end type hdf5_file_type

   !> Rows of an open dataset, selected in the file and in memory.
   type :: selection_type
      integer(hid_t) :: dataset = -1, memory = -1, space = -1
      integer(i8) :: n = 0                     !! entries
   end type selection_type

contains

   !> Get the shape of a dataset in Fortran order; size 0 for a scalar.
   subroutine get_shape(self, name, shape, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: name
      integer(i8), allocatable, intent(out) :: shape(:)
      type(error_type), allocatable, intent(out) :: error
      integer(hid_t) :: dataset, space
      integer(hsize_t), allocatable :: dims(:)
      integer :: status
      allocate (shape(0))
      call self%open_rows(name, dataset, space, dims, error)
      if (allocated(error)) return
      shape = int(dims, i8)
      call h5sclose_f(space, status)
      call h5dclose_f(dataset, status)
   end subroutine get_shape

   !> Does a dataset hold reals, or integers, as this module writes them?
   logical function has_type(self, name, reals, single)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: name
      logical, intent(in) :: reals                 !! else integers
      logical, intent(in), optional :: single      !! reals of 32 bits, or of 64; default: either
      integer(hid_t) :: dataset
      integer :: status, kind
      has_type = .false.
      call h5dopen_f(self%id, name, dataset, status)
      if (status /= 0) return
      kind = kind_of_values(int(dataset, i8))
      has_type = kind == value_kind%integers
      if (reals) has_type = kind == value_kind%reals .or. kind == value_kind%singles
      if (reals .and. present(single)) has_type = kind == merge(value_kind%singles, value_kind%reals, single)
      call h5dclose_f(dataset, status)
   end function has_type

   !> Write a whole dataset of reals: values in array element order, shape in Fortran order.
   subroutine write_reals(self, name, shape, values, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: shape(:)
      real(wp), intent(in) :: values(:)      !! (product(shape))
      type(error_type), allocatable, intent(out) :: error
      integer(hid_t) :: dataset
      integer :: status
      call self%create_dataset(name, H5T_IEEE_F64LE, shape, dataset, status)
      if (status == 0 .and. size(values) > 0) &
         call h5dwrite_f(dataset, H5T_NATIVE_DOUBLE, values, [size(values, kind=hsize_t)], status)
      if (status /= 0) call self%fail('cannot write '//name, error)
      call h5dclose_f(dataset, status)
   end subroutine write_reals

   !> Write a whole dataset of integers.
   subroutine write_integers(self, name, shape, values, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: shape(:)
      integer, intent(in) :: values(:)       !! (product(shape))
      type(error_type), allocatable, intent(out) :: error
      integer(hid_t) :: dataset
      integer :: status
      call self%create_dataset(name, H5T_STD_I32LE, shape, dataset, status)
      if (status == 0 .and. size(values) > 0) &
         call h5dwrite_f(dataset, H5T_NATIVE_INTEGER, values, [size(values, kind=hsize_t)], status)
      if (status /= 0) call self%fail('cannot write '//name, error)
      call h5dclose_f(dataset, status)
   end subroutine write_integers

   !> Write a text as a scalar dataset.
   subroutine write_text(self, name, text, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: name, text
      type(error_type), allocatable, intent(out) :: error
      character(kind=c_char, len=:), allocatable, target :: buffer
      type(c_ptr), target :: pointer(1)
      integer(hid_t) :: dataset, space, type, transfer
      integer :: status, ignored
      dataset = -1
      buffer = text//c_null_char
      pointer(1) = c_loc(buffer(1:1))
      call new_text_type(type, status)
      call h5screate_f(H5S_SCALAR_F, space, status)
      call h5dcreate_f(self%id, name, type, space, dataset, status)
      call h5pcreate_f(H5P_DATASET_XFER_F, transfer, ignored)
      call h5pset_buffer_f(transfer, text_buffer, ignored)
      if (status == 0) call h5dwrite_f(dataset, type, c_loc(pointer), status, xfer_prp=transfer)
      if (status /= 0) call self%fail('cannot write '//name, error)
      call h5pclose_f(transfer, ignored)
      call h5dclose_f(dataset, ignored)
      call h5sclose_f(space, ignored)
      call h5tclose_f(type, ignored)
   end subroutine write_text

   !> Write a list of texts, all of the length of the longest; trailing blanks are not kept.
   subroutine write_texts(self, name, texts, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: name, texts(:)
      type(error_type), allocatable, intent(out) :: error
      character(kind=c_char, len=1), allocatable, target :: buffer(:, :)
      integer(hid_t) :: dataset, type
      integer :: i, k, status, ignored
      allocate (buffer(max(1, maxval(len_trim(texts))), size(texts)), source=c_null_char)
      do i = 1, size(texts)
         do k = 1, len_trim(texts(i))
            buffer(k, i) = texts(i) (k:k)
         end do
      end do
      call new_fixed_text_type(size(buffer, 1), type, status)
      dataset = -1
      if (status == 0) call self%create_dataset(name, type, [size(texts)], dataset, status)
      if (status == 0) call h5dwrite_f(dataset, type, c_loc(buffer), status)
      if (status /= 0) call self%fail('cannot write '//name, error)
      call h5dclose_f(dataset, ignored)
      call h5tclose_f(type, ignored)
   end subroutine write_texts

   !> Create an empty dataset of the given type and shape.
   subroutine create_dataset(self, name, type, shape, dataset, status)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: name
      integer(hid_t), intent(in) :: type
      integer, intent(in) :: shape(:)
      integer(hid_t), intent(out) :: dataset
      integer, intent(out) :: status
      integer(hid_t) :: space
      integer :: ignored
      dataset = -1
      call new_space(int(shape, hsize_t), space, status)
      if (status /= 0) return
      call h5dcreate_f(self%id, name, type, space, dataset, status)
      call h5sclose_f(space, ignored)
   end subroutine create_dataset

   !> Write rows of reals of a table, after the first `skip`.
   subroutine write_real_rows(self, name, skip, n_rows, values, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: name
      integer(i8), intent(in) :: skip
      integer, intent(in) :: n_rows
      real(wp), intent(in) :: values(:)       !! (entries of a row * n_rows)
      type(error_type), allocatable, intent(out) :: error
      type(selection_type) :: rows
      integer :: status
      call select_in_table(self, name, value_kind%reals, rows, error, skip, int(n_rows, i8))
      if (allocated(error)) return
      status = 0
      if (rows%n > 0) call h5dwrite_f(rows%dataset, H5T_NATIVE_DOUBLE, values, [int(rows%n, hsize_t)], status, &
                                      rows%memory, rows%space)
      if (status /= 0) call self%fail('cannot write '//name, error)
      call close_rows(rows)
   end subroutine write_real_rows

   !> Write rows of integers of a table, after the first `skip`.
   subroutine write_integer_rows(self, name, skip, n_rows, values, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: name
      integer(i8), intent(in) :: skip
      integer, intent(in) :: n_rows
      integer, intent(in) :: values(:)        !! (entries of a row * n_rows)
      type(error_type), allocatable, intent(out) :: error
      type(selection_type) :: rows
      integer :: status
      call select_in_table(self, name, value_kind%integers, rows, error, skip, int(n_rows, i8))
      if (allocated(error)) return
      status = 0
      if (rows%n > 0) call h5dwrite_f(rows%dataset, H5T_NATIVE_INTEGER, values, [int(rows%n, hsize_t)], status, &
                                      rows%memory, rows%space)
      if (status /= 0) call self%fail('cannot write '//name, error)
      call close_rows(rows)
   end subroutine write_integer_rows

   !> Read a dataset of reals, or `count` rows of its last dimension after the first `skip`.
   subroutine read_reals(self, name, values, error, skip, count)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: name
      real(wp), allocatable, intent(out) :: values(:)   !! in array element order
      type(error_type), allocatable, intent(out) :: error
      integer(i8), intent(in), optional :: skip, count
      type(selection_type) :: rows
      integer :: status
      call select_in_table(self, name, value_kind%reals, rows, error, skip, count)
      if (allocated(error)) return
      allocate (values(rows%n))
      status = 0
      if (rows%n > 0) call h5dread_f(rows%dataset, H5T_NATIVE_DOUBLE, values, [int(rows%n, hsize_t)], status, &
                                     rows%memory, rows%space)
      if (status /= 0) call self%fail('cannot read '//name, error)
      call close_rows(rows)
   end subroutine read_reals

   !> Read a dataset of integers, or some rows of it.
   subroutine read_integers(self, name, values, error, skip, count)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: name
      integer, allocatable, intent(out) :: values(:)
      type(error_type), allocatable, intent(out) :: error
      integer(i8), intent(in), optional :: skip, count
      type(selection_type) :: rows
      integer :: status
      call select_in_table(self, name, value_kind%integers, rows, error, skip, count)
      if (allocated(error)) return
      allocate (values(rows%n))
      status = 0
      if (rows%n > 0) call h5dread_f(rows%dataset, H5T_NATIVE_INTEGER, values, [int(rows%n, hsize_t)], status, &
                                     rows%memory, rows%space)
      if (status /= 0) call self%fail('cannot read '//name, error)
      call close_rows(rows)
   end subroutine read_integers

   !> Read a scalar text dataset.
   subroutine read_text(self, name, text, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: name
      character(len=:), allocatable, intent(out) :: text
      type(error_type), allocatable, intent(out) :: error
      type(c_ptr), target :: pointer(1)
      type(c_ptr) :: place
      integer(hid_t) :: dataset, type
      integer :: status
      text = ''
      pointer = c_null_ptr
      place = c_loc(pointer)
      call new_text_type(type, status)
      call h5dopen_f(self%id, name, dataset, status)
      if (status == 0) status = merge(0, -1, kind_of_values(int(dataset, i8)) == value_kind%text)
      if (status == 0) call h5dread_f(dataset, type, place, status)
      if (status == 0) then
         text = take_text(pointer(1))
      else
         call self%fail('cannot read '//name, error)
      end if
      call h5dclose_f(dataset, status)
      call h5tclose_f(type, status)
   end subroutine read_text

   !> Read a list of texts of one length, with a line end between them.
   subroutine read_texts(self, name, text, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: name
      character(len=:), allocatable, intent(out) :: text
      type(error_type), allocatable, intent(out) :: error
      character(kind=c_char, len=1), allocatable, target :: buffer(:, :)
      type(c_ptr) :: place
      integer(hid_t) :: dataset, type
      integer(size_t) :: length
      integer(i8), allocatable :: shape(:)
      integer :: i, k, status, ignored
      text = ''
      call self%get_shape(name, shape, error)
      if (allocated(error)) return
      call h5dopen_f(self%id, name, dataset, status)
      if (size(shape) /= 1 .or. product(shape) > most_texts) status = -1
      if (status == 0) status = merge(0, -1, kind_of_values(int(dataset, i8)) == value_kind%texts)
      type = -1
      length = 0
      if (status == 0) call h5dget_type_f(dataset, type, status)
      if (status == 0) call h5tget_size_f(type, length, status)
      if (length*product(shape) > most_texts) status = -1
      if (status == 0) then
         allocate (buffer(length, product(shape)), source=c_null_char)
         place = c_loc(buffer)
         call h5dread_f(dataset, type, place, status)
      end if
      if (status == 0) then
         do i = 1, size(buffer, 2)
            if (i > 1) text = text//new_line('a')
            do k = 1, size(buffer, 1)
               if (buffer(k, i) == c_null_char) exit
               text = text//buffer(k, i)
            end do
         end do
      else
         call self%fail('cannot read '//name, error)
      end if
      call h5tclose_f(type, ignored)
      call h5dclose_f(dataset, ignored)
   end subroutine read_texts

   !> Select all of a dataset or some rows of it. It must hold values of this kind.
   subroutine select_in_table(self, name, kind, rows, error, skip, count)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: kind              !! one of value_kind%...
      type(selection_type), intent(out) :: rows
      type(error_type), allocatable, intent(out) :: error
      integer(i8), intent(in), optional :: skip, count
      integer(hsize_t), allocatable :: dims(:), start(:)
      integer :: status, rank, found
      call self%open_rows(name, rows%dataset, rows%space, dims, error)
      if (allocated(error)) return
      rank = size(dims)
      allocate (start(rank), source=0_hsize_t)
      if (rank > 0 .and. present(skip)) start(rank) = skip
      if (rank > 0 .and. present(count)) dims(rank) = count
      status = merge(0, -1, rank > 0)
      if (status == 0) call h5sselect_hyperslab_f(rows%space, H5S_SELECT_SET_F, start, dims, status)
      if (status == 0) call h5screate_simple_f(rank, dims, rows%memory, status)
      rows%n = int(product(dims), i8)
      found = kind_of_values(int(rows%dataset, i8))
      if (found == value_kind%singles) found = value_kind%reals   ! converted
      if (status /= 0) then
         call self%fail('cannot select rows of '//name, error)
      else if (found /= kind) then
         call self%fail('cannot read '//name//': it holds no '// &
                        trim(merge('integers', 'reals   ', kind == value_kind%integers)), error)
      end if
      if (allocated(error)) call close_rows(rows)
   end subroutine select_in_table

   !> Close what `select_in_table` opened.
   subroutine close_rows(rows)
      type(selection_type), intent(in) :: rows
      integer :: status
      if (rows%memory >= 0) call h5sclose_f(rows%memory, status)
      call h5sclose_f(rows%space, status)
      call h5dclose_f(rows%dataset, status)
   end subroutine close_rows

   !> Create a table without rows that grows along its last dimension, in chunks; those of integers are compressed.
   subroutine create_table(self, name, row_shape, is_real, chunk_shape, error, is_single)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: row_shape(:)     !! shape of one row in Fortran order; size 0: one number
      logical, intent(in) :: is_real          !! else integers
      integer, intent(in) :: chunk_shape(:)   !! of size(row_shape) + 1 entries, all > 0
      type(error_type), allocatable, intent(out) :: error
      logical, intent(in), optional :: is_single   !! reals of 32 bits, default .false.
      integer(hid_t) :: space, creation, dataset, type
      integer(hsize_t) :: dims(size(row_shape) + 1), largest(size(row_shape) + 1)
      integer :: status, ignored, rank
      rank = size(row_shape) + 1
      dims(1:rank - 1) = row_shape
      dims(rank) = 0
      largest = dims
      largest(rank) = H5S_UNLIMITED_F
      ! a chunk has at least one entry each way, which must fit below the upper bound
      where (dims == 0) largest = H5S_UNLIMITED_F
      type = merge(H5T_IEEE_F64LE, H5T_STD_I32LE, is_real)
      if (present(is_single)) type = merge(H5T_IEEE_F32LE, type, is_real .and. is_single)
      dataset = -1
      call h5screate_simple_f(rank, dims, space, status, largest)
      call h5pcreate_f(H5P_DATASET_CREATE_F, creation, status)
      call h5pset_chunk_f(creation, rank, int(chunk_shape, hsize_t), status)
      ! compressed, reals take 15 % less room and a third of the time of a small run with many frames
      if (status == 0 .and. .not. is_real) call h5pset_shuffle_f(creation, status)
      if (status == 0 .and. .not. is_real) call h5pset_deflate_f(creation, gzip_level, status)
      if (status == 0) call h5dcreate_f(self%id, name, type, space, dataset, status, creation)
      if (status /= 0) call self%fail('cannot create '//name, error)
      call h5dclose_f(dataset, ignored)
      call h5pclose_f(creation, ignored)
      call h5sclose_f(space, ignored)
   end subroutine create_table

   !> Give a table this many rows: new ones are zero until they are written, surplus ones are dropped.
   subroutine resize(self, name, n_rows, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: name
      integer(i8), intent(in) :: n_rows
      type(error_type), allocatable, intent(out) :: error
      integer(hid_t) :: dataset, space
      integer(hsize_t), allocatable :: dims(:)
      integer :: status
      call self%open_rows(name, dataset, space, dims, error)
      if (allocated(error)) return
      dims(size(dims)) = n_rows
      call h5dset_extent_f(dataset, dims, status)
      if (status /= 0) call self%fail('cannot resize '//name, error)
      call h5sclose_f(space, status)
      call h5dclose_f(dataset, status)
   end subroutine resize

   !> Get the shape of the chunks of a table; an error for a dataset without chunks.
   subroutine get_chunk(self, name, chunk_shape, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: name
      integer(i8), allocatable, intent(out) :: chunk_shape(:)   !! Fortran order
      type(error_type), allocatable, intent(out) :: error
      integer(hid_t) :: dataset, space, creation
      integer(hsize_t), allocatable :: dims(:)
      integer :: status, ignored
      call self%open_rows(name, dataset, space, dims, error)
      if (allocated(error)) return
      call h5dget_create_plist_f(dataset, creation, status)
      ! the number of dimensions comes back
      if (status == 0) call h5pget_chunk_f(creation, size(dims), dims, status)
      if (status /= size(dims)) call self%fail('cannot read the chunks of '//name, error)
      chunk_shape = int(dims, i8)
      call h5pclose_f(creation, ignored)
      call h5sclose_f(space, ignored)
      call h5dclose_f(dataset, ignored)
   end subroutine get_chunk

   !> Write whole chunks of reals after the first `skip` rows, neither shuffled nor compressed, so that their addresses
   !> do not change when they are written again. The table gets n_rows rows, of which the last chunk may have fewer than
   !> its room. Readers see no difference to other chunks.
   subroutine write_plain_reals(self, name, skip, n_rows, per_chunk, values, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: name
      integer(i8), intent(in) :: skip                      !! rows before the chunks
      integer(i8), intent(in) :: n_rows                    !! of the table, these included
      integer, intent(in) :: per_chunk                     !! rows of a chunk
      real(wp), intent(in), contiguous, target :: values(:, :)   !! (entries of a chunk, chunks)
      type(error_type), allocatable, intent(out) :: error
      call write_plain(self, name, skip, n_rows, per_chunk, size(values, 2), 8_i8*size(values, 1, i8), c_loc(values), &
                       error)
   end subroutine write_plain_reals

   !> Write whole chunks of reals of 32 bits, as write_plain_reals does.
   subroutine write_plain_singles(self, name, skip, n_rows, per_chunk, values, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: name
      integer(i8), intent(in) :: skip, n_rows
      integer, intent(in) :: per_chunk
      real(sp), intent(in), contiguous, target :: values(:, :)
      type(error_type), allocatable, intent(out) :: error
      call write_plain(self, name, skip, n_rows, per_chunk, size(values, 2), 4_i8*size(values, 1, i8), c_loc(values), &
                       error)
   end subroutine write_plain_singles

   !> Write whole chunks of integers, as write_plain_reals does.
   subroutine write_plain_integers(self, name, skip, n_rows, per_chunk, values, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: name
      integer(i8), intent(in) :: skip, n_rows
      integer, intent(in) :: per_chunk
      integer, intent(in), contiguous, target :: values(:, :)
      type(error_type), allocatable, intent(out) :: error
      call write_plain(self, name, skip, n_rows, per_chunk, size(values, 2), 4_i8*size(values, 1, i8), c_loc(values), &
                       error)
   end subroutine write_plain_integers

   !> Write the bytes of chunks that lie one behind the other.
   subroutine write_plain(self, name, skip, n_rows, per_chunk, n_chunks, n_bytes, values, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: name
      integer(i8), intent(in) :: skip, n_rows
      integer, intent(in) :: per_chunk, n_chunks
      integer(i8), intent(in) :: n_bytes                   !! of a chunk
      type(c_ptr), intent(in) :: values
      type(error_type), allocatable, intent(out) :: error
      integer(hid_t) :: dataset, space
      integer(hsize_t), allocatable :: dims(:)
      integer :: k, rank, status, ignored
      call self%open_rows(name, dataset, space, dims, error)
      if (allocated(error)) return
      rank = size(dims)
      status = 0
      if (dims(rank) /= n_rows) then
         dims(rank) = n_rows
         call h5dset_extent_f(dataset, dims, status)
      end if
      do k = 0, n_chunks - 1
         if (status == 0) status = write_chunk(int(dataset, i8), skip + int(per_chunk, i8)*k, rank, n_bytes, values, &
                                               n_bytes*k)
      end do
      if (status /= 0) call self%fail('cannot write '//name, error)
      call h5sclose_f(space, ignored)
      call h5dclose_f(dataset, ignored)
   end subroutine write_plain

   !> Open a dataset and its space and get its shape.
   subroutine open_rows(self, name, dataset, space, dims, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: name
      integer(hid_t), intent(out) :: dataset, space
      integer(hsize_t), allocatable, intent(out) :: dims(:)
      type(error_type), allocatable, intent(out) :: error
      integer(hsize_t), allocatable :: largest(:)
      integer :: status, rank
      space = -1
      rank = 0
      call h5dopen_f(self%id, name, dataset, status)
      if (status == 0) call h5dget_space_f(dataset, space, status)
      if (status == 0) call h5sget_simple_extent_ndims_f(space, rank, status)
      allocate (dims(max(rank, 0)), largest(max(rank, 0)))
      if (status == 0 .and. rank > 0) call h5sget_simple_extent_dims_f(space, dims, largest, status)
      if (status < 0) call self%fail('cannot open '//name, error)
   end subroutine open_rows

end module rockdda_io_hdf5_adapter
