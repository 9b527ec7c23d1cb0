! SPDX-License-Identifier: MIT
!> The only module that uses the HDF5 library.
!>
!> Files have the library's default (oldest) format, which stays readable after a kill once it was flushed.
!> Arrays travel as flat lists with their shape in Fortran order; readers that count in C order (h5py) see the
!> shape reversed: (2, nv) here is nv x 2 there. Reals are 64-bit, integers 32-bit, both little endian; text is
!> UTF-8 of variable length. HDF5's own messages are switched off; the reason goes into the error.
module rockdda_io_hdf5_adapter
   use, intrinsic :: iso_c_binding, only : c_ptr, c_null_ptr, c_loc, c_char, c_null_char, c_f_pointer, c_associated, &
      c_int, c_size_t
   use hdf5, only : hid_t, hsize_t, size_t, H5F_ACC_TRUNC_F, H5F_ACC_RDONLY_F, H5F_ACC_RDWR_F, H5F_SCOPE_GLOBAL_F, &
      H5F_CLOSE_STRONG_F, H5P_FILE_ACCESS_F, H5P_DATASET_CREATE_F, H5P_DEFAULT_F, H5S_SCALAR_F, H5S_SELECT_SET_F, &
      H5S_UNLIMITED_F, H5T_CSET_UTF8_F, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, H5T_NATIVE_INTEGER, H5T_STD_I32LE, &
      H5T_STRING, h5aclose_f, h5acreate_f, h5aexists_f, h5aget_space_f, h5aget_type_f, h5aopen_f, h5aread_f, &
      h5awrite_f, h5dclose_f, h5dcreate_f, h5dget_space_f, h5dopen_f, h5dread_f, h5dset_extent_f, h5dwrite_f, &
      h5eset_auto_f, h5fclose_f, h5fcreate_f, h5fflush_f, h5fget_filesize_f, &
      h5fopen_f, h5gclose_f, h5gcreate_f, h5get_libversion_f, &
      h5lexists_f, h5oclose_f, h5oopen_f, h5open_f, h5pclose_f, h5pcreate_f, h5pset_chunk_f, h5pset_deflate_f, &
      h5pset_fclose_degree_f, h5pset_shuffle_f, h5sclose_f, h5screate_f, h5screate_simple_f, &
      h5sget_simple_extent_dims_f, h5sget_simple_extent_ndims_f, h5sselect_hyperslab_f, h5tclose_f, h5tcopy_f, &
      h5tis_variable_str_f, h5tset_cset_f
   use rockdda_base_kinds, only : wp, i8
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_strings, only : to_string
   use rockdda_io_hdf5_reason, only : get_reason, disable_file_locking
   implicit none
   private
   public :: hdf5_file_type, hdf5_version

   !> Compression level: most of the gain for the least time.
   integer, parameter :: gzip_level = 1

   type :: hdf5_file_type
      character(len=:), allocatable :: path
      logical :: is_open = .false.
      integer(hid_t), private :: id = -1
      integer, private :: failure = 5          !! error code of this file's failures: output, or input when only read
   contains
      procedure :: create => create_file
      procedure :: open => open_file
      procedure :: close => close_file
      procedure :: flush => flush_file
      procedure :: size_in_bytes
      procedure :: create_group
      procedure :: exists
      procedure :: get_shape
      generic :: set_attribute => set_text_attribute, set_integer_attribute, set_integers_attribute, &
         set_texts_attribute
      generic :: get_attribute => get_text_attribute, get_integer_attribute
      generic :: write => write_reals, write_integers, write_text
      generic :: read => read_reals, read_integers, read_text
      procedure :: create_table
      generic :: append => append_reals, append_integers
      procedure :: truncate
      procedure, private :: set_text_attribute, set_integer_attribute, set_integers_attribute, set_texts_attribute
      procedure, private :: get_text_attribute, get_integer_attribute
      procedure, private :: write_reals, write_integers, write_text, read_reals, read_integers, read_text
      procedure, private :: append_reals, append_integers
      procedure, private :: fail
      procedure, private :: create_dataset
      procedure, private :: open_attribute
      procedure, private :: write_texts_attribute
      procedure, private :: open_rows
   end type hdf5_file_type

contains

   !> Create a file, replacing what is there. The caller has made sure that it may be replaced.
   subroutine create_file(self, path, error)
      class(hdf5_file_type), intent(inout) :: self
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(out) :: error
      integer(hid_t) :: access
      integer :: status
      self%path = path
      self%failure = error_code%output
      call start_library(access, status)
      if (status == 0) call h5fcreate_f(path, H5F_ACC_TRUNC_F, self%id, status, access_prp=access)
      if (status /= 0) then
         call self%fail('cannot create the file', error)
         return
      end if
      self%is_open = .true.
      call h5pclose_f(access, status)
   end subroutine create_file

   !> Open an existing file, to read it or to continue it.
   subroutine open_file(self, path, writable, error)
      class(hdf5_file_type), intent(inout) :: self
      character(len=*), intent(in) :: path
      logical, intent(in) :: writable
      type(error_type), allocatable, intent(out) :: error
      integer(hid_t) :: access
      integer :: status
      self%path = path
      self%failure = merge(error_code%output, error_code%input, writable)
      call start_library(access, status)
      if (status == 0) call h5fopen_f(path, merge(H5F_ACC_RDWR_F, H5F_ACC_RDONLY_F, writable), self%id, status, &
                                      access_prp=access)
      if (status /= 0) then
         call self%fail('cannot open the file', error)
         return
      end if
      self%is_open = .true.
      call h5pclose_f(access, status)
   end subroutine open_file

   !> Write what is left and close. Nothing happens when no file is open.
   subroutine close_file(self, error)
      class(hdf5_file_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      integer :: status
      if (.not. self%is_open) return
      self%is_open = .false.
      call h5fclose_f(self%id, status)
      if (status /= 0) call self%fail('cannot finish the file', error)
   end subroutine close_file

   !> Hand everything to the system, so that it survives a kill.
   subroutine flush_file(self, error)
      class(hdf5_file_type), intent(in) :: self
      type(error_type), allocatable, intent(out) :: error
      integer :: status
      call h5fflush_f(self%id, H5F_SCOPE_GLOBAL_F, status)
      if (status /= 0) call self%fail('cannot write', error)
   end subroutine flush_file

   !> Length of the file in bytes; after a flush, the end of what was written. 0 when it cannot be told.
   integer(i8) function size_in_bytes(self)
      class(hdf5_file_type), intent(in) :: self
      integer(hsize_t) :: n
      integer :: status
      call h5fget_filesize_f(self%id, n, status)
      size_in_bytes = 0
      if (status == 0) size_in_bytes = int(n, i8)
   end function size_in_bytes

   !> Create a group; its parents exist.
   subroutine create_group(self, name, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: name
      type(error_type), allocatable, intent(out) :: error
      integer(hid_t) :: group
      integer :: status
      call h5gcreate_f(self%id, name, group, status)
      if (status == 0) call h5gclose_f(group, status)
      if (status /= 0) call self%fail('cannot create group '//name, error)
   end subroutine create_group

   !> Does the object exist? Every part of the path is looked at.
   logical function exists(self, name)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: name      !! without leading slash
      integer :: status, slash, first
      exists = .false.
      first = 1
      do
         slash = index(name(first:), '/')
         if (slash == 0) exit
         call h5lexists_f(self%id, name(1:first + slash - 2), exists, status)
         if (status /= 0 .or. .not. exists) then
            exists = .false.
            return
         end if
         first = first + slash
      end do
      call h5lexists_f(self%id, name, exists, status)
      if (status /= 0) exists = .false.
   end function exists

   !> Shape of a dataset in Fortran order; size 0 for a scalar.
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

   !> Set a text attribute of an object ('/' is the file), replacing its value.
   subroutine set_text_attribute(self, object, name, text, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: object, name, text
      type(error_type), allocatable, intent(out) :: error
      character(len=len(text)) :: texts(1)
      texts(1) = text
      call self%write_texts_attribute(object, name, texts, .true., error)
   end subroutine set_text_attribute

   !> Set an attribute that is a list of texts; trailing blanks are not kept.
   subroutine set_texts_attribute(self, object, name, texts, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: object, name, texts(:)
      type(error_type), allocatable, intent(out) :: error
      call self%write_texts_attribute(object, name, texts, .false., error)
   end subroutine set_texts_attribute

   !> Set a text attribute, scalar or list.
   subroutine write_texts_attribute(self, object, name, texts, scalar, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: object, name, texts(:)
      logical, intent(in) :: scalar
      type(error_type), allocatable, intent(out) :: error
      character(kind=c_char, len=1), allocatable, target :: buffer(:, :)
      type(c_ptr), target :: pointers(size(texts))
      integer(hid_t) :: attribute, type
      integer(hsize_t), allocatable :: dims(:)
      integer :: i, k, length, status
      allocate (dims(merge(0, 1, scalar)))
      dims = size(texts, kind=hsize_t)
      allocate (buffer(len(texts) + 1, size(texts)))
      do i = 1, size(texts)
         length = merge(len(texts), len_trim(texts(i)), scalar)
         do k = 1, length
            buffer(k, i) = texts(i) (k:k)
         end do
         buffer(length + 1, i) = c_null_char
         pointers(i) = c_loc(buffer(1, i))
      end do
      call new_text_type(type, status)
      if (status == 0) call self%open_attribute(object, name, type, dims, attribute, status)
      if (status == 0) call h5awrite_f(attribute, type, c_loc(pointers), status)
      if (status /= 0) call self%fail('cannot write attribute '//name, error)
      call h5aclose_f(attribute, status)
      call h5tclose_f(type, status)
   end subroutine write_texts_attribute

   !> Set an integer attribute, replacing its value.
   subroutine set_integer_attribute(self, object, name, value, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: object, name
      integer, intent(in) :: value
      type(error_type), allocatable, intent(out) :: error
      integer(hid_t) :: attribute
      integer(hsize_t) :: dims(0)
      integer :: status
      call self%open_attribute(object, name, H5T_STD_I32LE, dims, attribute, status)
      if (status == 0) call h5awrite_f(attribute, H5T_NATIVE_INTEGER, value, dims, status)
      if (status /= 0) call self%fail('cannot write attribute '//name, error)
      call h5aclose_f(attribute, status)
   end subroutine set_integer_attribute

   !> Set an attribute that is a list of integers (of the same length as before).
   subroutine set_integers_attribute(self, object, name, values, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: object, name
      integer, intent(in) :: values(:)
      type(error_type), allocatable, intent(out) :: error
      integer(hid_t) :: attribute
      integer(hsize_t) :: dims(1)
      integer :: status
      dims = size(values, kind=hsize_t)
      call self%open_attribute(object, name, H5T_STD_I32LE, dims, attribute, status)
      if (status == 0 .and. size(values) > 0) call h5awrite_f(attribute, H5T_NATIVE_INTEGER, values, dims, status)
      if (status /= 0) call self%fail('cannot write attribute '//name, error)
      call h5aclose_f(attribute, status)
   end subroutine set_integers_attribute

   !> Open an attribute, creating it when it is not there; dims of size 0: scalar.
   subroutine open_attribute(self, object, name, type, dims, attribute, status)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: object, name
      integer(hid_t), intent(in) :: type
      integer(hsize_t), intent(in) :: dims(:)
      integer(hid_t), intent(out) :: attribute
      integer, intent(out) :: status
      integer(hid_t) :: owner, space
      logical :: there
      integer :: ignored
      attribute = -1
      call h5oopen_f(self%id, object, owner, status)
      if (status /= 0) return
      call h5aexists_f(owner, name, there, status)
      if (status == 0 .and. there) then
         call h5aopen_f(owner, name, attribute, status)
      else if (status == 0) then
         call new_space(dims, space, status)
         if (status == 0) call h5acreate_f(owner, name, type, space, attribute, status)
         call h5sclose_f(space, ignored)
      end if
      call h5oclose_f(owner, ignored)
   end subroutine open_attribute

   !> Value of a text attribute.
   subroutine get_text_attribute(self, object, name, text, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: object, name
      character(len=:), allocatable, intent(out) :: text
      type(error_type), allocatable, intent(out) :: error
      type(c_ptr), target :: pointer(1)
      type(c_ptr) :: place
      integer(hid_t) :: owner, attribute, type, stored
      logical :: variable
      integer :: status
      text = ''
      pointer = c_null_ptr
      place = c_loc(pointer)
      variable = .false.
      attribute = -1
      call h5oopen_f(self%id, object, owner, status)
      if (status == 0) call h5aopen_f(owner, name, attribute, status)
      if (status == 0) call h5aget_type_f(attribute, stored, status)
      if (status == 0) call h5tis_variable_str_f(stored, variable, status)
      if (status == 0 .and. variable) then
         call new_text_type(type, status)
         call h5aread_f(attribute, type, place, status)
         if (status == 0) text = take_text(pointer(1))
         call h5tclose_f(type, status)
      else
         call self%fail('cannot read text attribute '//name, error)
      end if
      call h5aclose_f(attribute, status)
      call h5oclose_f(owner, status)
   end subroutine get_text_attribute

   !> Value of an integer attribute.
   subroutine get_integer_attribute(self, object, name, value, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: object, name
      integer, intent(out) :: value
      type(error_type), allocatable, intent(out) :: error
      integer(hid_t) :: owner, attribute, space
      integer(hsize_t) :: dims(0)
      integer :: status, rank, ignored
      value = 0
      attribute = -1
      rank = -1
      call h5oopen_f(self%id, object, owner, status)
      if (status == 0) call h5aopen_f(owner, name, attribute, status)
      if (status == 0) call h5aget_space_f(attribute, space, status)
      if (status == 0) call h5sget_simple_extent_ndims_f(space, rank, status)
      if (rank == 0) call h5aread_f(attribute, H5T_NATIVE_INTEGER, value, dims, status)
      if (rank /= 0 .or. status < 0) call self%fail('cannot read integer attribute '//name, error)
      call h5aclose_f(attribute, ignored)
      call h5oclose_f(owner, ignored)
   end subroutine get_integer_attribute

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
      integer(hid_t) :: dataset, space, type
      integer :: status, ignored
      dataset = -1
      buffer = text//c_null_char
      pointer(1) = c_loc(buffer(1:1))
      call new_text_type(type, status)
      call h5screate_f(H5S_SCALAR_F, space, status)
      call h5dcreate_f(self%id, name, type, space, dataset, status)
      if (status == 0) call h5dwrite_f(dataset, type, c_loc(pointer), status)
      if (status /= 0) call self%fail('cannot write '//name, error)
      call h5dclose_f(dataset, ignored)
      call h5sclose_f(space, ignored)
      call h5tclose_f(type, ignored)
   end subroutine write_text

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

   !> Create a table without rows that grows along its last dimension, in chunks.
   !>
   !> Chunks that are written once are shuffled and compressed. A chunk of several rows is written again as it fills:
   !> compressed, it would change its length and move, and a kill in the midst of a flush could leave the table
   !> pointing at a place that is in use for something else. Plain, it is rewritten where it lies.
   subroutine create_table(self, name, row_shape, is_real, chunk_shape, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: row_shape(:)     !! shape of one row in Fortran order; size 0: one number
      logical, intent(in) :: is_real          !! else integers
      integer, intent(in) :: chunk_shape(:)   !! of size(row_shape) + 1 entries, all > 0
      type(error_type), allocatable, intent(out) :: error
      integer(hid_t) :: space, creation, dataset
      integer(hsize_t) :: dims(size(row_shape) + 1), largest(size(row_shape) + 1)
      integer :: status, ignored, rank
      rank = size(row_shape) + 1
      dims(1:rank - 1) = row_shape
      dims(rank) = 0
      largest = dims
      largest(rank) = H5S_UNLIMITED_F
      ! a chunk has at least one entry each way, which must fit below the upper bound
      where (dims == 0) largest = H5S_UNLIMITED_F
      dataset = -1
      call h5screate_simple_f(rank, dims, space, status, largest)
      call h5pcreate_f(H5P_DATASET_CREATE_F, creation, status)
      call h5pset_chunk_f(creation, rank, int(chunk_shape, hsize_t), status)
      if (chunk_shape(rank) == 1) then
         if (status == 0) call h5pset_shuffle_f(creation, status)
         if (status == 0) call h5pset_deflate_f(creation, gzip_level, status)
      end if
      if (status == 0) call h5dcreate_f(self%id, name, merge(H5T_IEEE_F64LE, H5T_STD_I32LE, is_real), space, dataset, &
                                        status, creation)
      if (status /= 0) call self%fail('cannot create '//name, error)
      call h5dclose_f(dataset, ignored)
      call h5pclose_f(creation, ignored)
      call h5sclose_f(space, ignored)
   end subroutine create_table

   !> Append rows of reals to a table.
   subroutine append_reals(self, name, values, n_rows, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: values(:)       !! (entries of a row * n_rows)
      integer, intent(in) :: n_rows
      type(error_type), allocatable, intent(out) :: error
      integer(hid_t) :: dataset, memory, space
      integer :: status
      call append_space(self, name, n_rows, dataset, memory, space, error)
      if (allocated(error)) return
      status = 0
      if (size(values) > 0) call h5dwrite_f(dataset, H5T_NATIVE_DOUBLE, values, [size(values, kind=hsize_t)], status, &
                                            memory, space)
      if (status /= 0) call self%fail('cannot write '//name, error)
      call close_rows(dataset, memory, space)
   end subroutine append_reals

   !> Append rows of integers to a table.
   subroutine append_integers(self, name, values, n_rows, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: values(:)        !! (entries of a row * n_rows)
      integer, intent(in) :: n_rows
      type(error_type), allocatable, intent(out) :: error
      integer(hid_t) :: dataset, memory, space
      integer :: status
      call append_space(self, name, n_rows, dataset, memory, space, error)
      if (allocated(error)) return
      status = 0
      if (size(values) > 0) call h5dwrite_f(dataset, H5T_NATIVE_INTEGER, values, [size(values, kind=hsize_t)], status, &
                                            memory, space)
      if (status /= 0) call self%fail('cannot write '//name, error)
      call close_rows(dataset, memory, space)
   end subroutine append_integers

   !> Make room for more rows and select them.
   subroutine append_space(self, name, n_rows, dataset, memory, space, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: n_rows
      integer(hid_t), intent(out) :: dataset, memory, space
      type(error_type), allocatable, intent(out) :: error
      integer(hsize_t), allocatable :: dims(:)
      integer :: status, rank
      memory = -1
      call self%open_rows(name, dataset, space, dims, error)
      if (allocated(error)) return
      call h5sclose_f(space, status)
      rank = size(dims)
      dims(rank) = dims(rank) + n_rows
      call h5dset_extent_f(dataset, dims, status)
      if (status == 0) call select_rows(dataset, dims, dims(rank) - n_rows, int(n_rows, hsize_t), memory, space, status)
      if (status == 0) return
      call self%fail('cannot extend '//name, error)
      call h5dclose_f(dataset, status)
   end subroutine append_space

   !> Cut a table back to its first rows.
   subroutine truncate(self, name, n_rows, error)
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
      if (status /= 0) call self%fail('cannot cut '//name, error)
      call h5sclose_f(space, status)
      call h5dclose_f(dataset, status)
   end subroutine truncate

   !> Read a dataset of reals, or `count` rows of its last dimension after the first `skip`.
   subroutine read_reals(self, name, values, error, skip, count)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: name
      real(wp), allocatable, intent(out) :: values(:)   !! in array element order
      type(error_type), allocatable, intent(out) :: error
      integer(i8), intent(in), optional :: skip, count
      integer(hid_t) :: dataset, memory, space
      integer(i8) :: n
      integer :: status
      call read_space(self, name, dataset, memory, space, n, error, skip, count)
      if (allocated(error)) return
      allocate (values(n))
      status = 0
      if (n > 0) call h5dread_f(dataset, H5T_NATIVE_DOUBLE, values, [int(n, hsize_t)], status, memory, space)
      if (status /= 0) call self%fail('cannot read '//name, error)
      call close_rows(dataset, memory, space)
   end subroutine read_reals

   !> Read a dataset of integers, or some rows of it.
   subroutine read_integers(self, name, values, error, skip, count)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: name
      integer, allocatable, intent(out) :: values(:)
      type(error_type), allocatable, intent(out) :: error
      integer(i8), intent(in), optional :: skip, count
      integer(hid_t) :: dataset, memory, space
      integer(i8) :: n
      integer :: status
      call read_space(self, name, dataset, memory, space, n, error, skip, count)
      if (allocated(error)) return
      allocate (values(n))
      status = 0
      if (n > 0) call h5dread_f(dataset, H5T_NATIVE_INTEGER, values, [int(n, hsize_t)], status, memory, space)
      if (status /= 0) call self%fail('cannot read '//name, error)
      call close_rows(dataset, memory, space)
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
      if (status == 0) call h5dread_f(dataset, type, place, status)
      if (status == 0) then
         text = take_text(pointer(1))
      else
         call self%fail('cannot read '//name, error)
      end if
      call h5dclose_f(dataset, status)
      call h5tclose_f(type, status)
   end subroutine read_text

   !> Select all of a dataset or some rows of it.
   subroutine read_space(self, name, dataset, memory, space, n, error, skip, count)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: name
      integer(hid_t), intent(out) :: dataset, memory, space
      integer(i8), intent(out) :: n            !! entries selected
      type(error_type), allocatable, intent(out) :: error
      integer(i8), intent(in), optional :: skip, count
      integer(hsize_t), allocatable :: dims(:)
      integer(hsize_t) :: first, rows
      integer :: status, rank
      memory = -1
      n = 0
      call self%open_rows(name, dataset, space, dims, error)
      if (allocated(error)) return
      call h5sclose_f(space, status)
      rank = size(dims)
      first = 0
      if (rank > 0) rows = dims(rank)
      if (present(skip)) first = skip
      if (present(count)) rows = count
      if (rank > 0) then
         call select_rows(dataset, dims, first, rows, memory, space, status)
         n = int(product(dims(1:rank - 1))*rows, i8)
         if (status == 0) return
      end if
      call self%fail('cannot read rows of '//name, error)
      call h5dclose_f(dataset, status)
   end subroutine read_space

   !> Open a dataset and its space and look at its shape.
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

   !> Select rows of the last dimension in the file, and as much memory.
   subroutine select_rows(dataset, dims, first, rows, memory, space, status)
      integer(hid_t), intent(in) :: dataset
      integer(hsize_t), intent(in) :: dims(:)
      integer(hsize_t), intent(in) :: first, rows
      integer(hid_t), intent(out) :: memory, space
      integer, intent(out) :: status
      integer(hsize_t) :: start(size(dims)), count(size(dims))
      memory = -1
      start = 0
      start(size(dims)) = first
      count = dims
      count(size(dims)) = rows
      call h5dget_space_f(dataset, space, status)
      if (status == 0) call h5sselect_hyperslab_f(space, H5S_SELECT_SET_F, start, count, status)
      if (status == 0) call h5screate_simple_f(size(dims), count, memory, status)
   end subroutine select_rows

   !> Close what `append_space` or `read_space` opened.
   subroutine close_rows(dataset, memory, space)
      integer(hid_t), intent(in) :: dataset, memory, space
      integer :: status
      call h5sclose_f(memory, status)
      call h5sclose_f(space, status)
      call h5dclose_f(dataset, status)
   end subroutine close_rows

   !> A data space; dims of size 0: scalar.
   subroutine new_space(dims, space, status)
      integer(hsize_t), intent(in) :: dims(:)
      integer(hid_t), intent(out) :: space
      integer, intent(out) :: status
      if (size(dims) == 0) then
         call h5screate_f(H5S_SCALAR_F, space, status)
      else
         call h5screate_simple_f(size(dims), dims, space, status)
      end if
   end subroutine new_space

   !> UTF-8 text of variable length.
   subroutine new_text_type(type, status)
      integer(hid_t), intent(out) :: type
      integer, intent(out) :: status
      call h5tcopy_f(H5T_STRING, type, status)
      if (status == 0) call h5tset_cset_f(type, H5T_CSET_UTF8_F, status)
   end subroutine new_text_type

   !> Start the library and make the access properties of every file: no file locking (readers may look on
   !> while a run writes; runs are kept apart by rockdda_io_output_lock), everything closed with the file.
   subroutine start_library(access, status)
      integer(hid_t), intent(out) :: access
      integer, intent(out) :: status
      access = H5P_DEFAULT_F
      call h5open_f(status)
      if (status == 0) call h5eset_auto_f(0, status)
      if (status == 0) call h5pcreate_f(H5P_FILE_ACCESS_F, access, status)
      if (status == 0) call h5pset_fclose_degree_f(access, H5F_CLOSE_STRONG_F, status)
      if (status == 0) call disable_file_locking(int(access, i8), status)
   end subroutine start_library

   !> Copy a C text and free it.
   function take_text(pointer) result(text)
      type(c_ptr), intent(in) :: pointer
      character(len=:), allocatable :: text
      character(kind=c_char, len=1), pointer :: bytes(:)
      integer :: i, n
      interface
         integer(c_size_t) function c_strlen(text) bind(C, name='strlen')
            import :: c_ptr, c_size_t
            type(c_ptr), value :: text
         end function c_strlen
         integer(c_int) function c_free(memory) bind(C, name='H5free_memory')
            import :: c_ptr, c_int
            type(c_ptr), value :: memory
         end function c_free
      end interface
      text = ''
      if (.not. c_associated(pointer)) return
      n = int(c_strlen(pointer))
      call c_f_pointer(pointer, bytes, [n])
      text = repeat(' ', n)
      do i = 1, n
         text(i:i) = bytes(i)
      end do
      i = int(c_free(pointer))
   end function take_text

   !> An error that names the file, what could not be done and why.
   subroutine fail(self, what, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: what
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: reason
      reason = get_reason()
      if (len(reason) > 0) reason = ' ('//reason//')'
      call make_error(error, self%failure, self%path//': '//what//reason)
   end subroutine fail

   !> Version of the HDF5 library in use.
   function hdf5_version() result(text)
      character(len=:), allocatable :: text
      integer :: major, minor, release, status
      call h5get_libversion_f(major, minor, release, status)
      text = to_string(major)//'.'//to_string(minor)//'.'//to_string(release)
   end function hdf5_version

end module rockdda_io_hdf5_adapter
