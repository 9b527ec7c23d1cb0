! SPDX-License-Identifier: MIT
!> The adapter to the HDF5 library: files, groups, attributes, datasets, and tables that grow by rows, in chunks. Of the
!> other modules only rockdda_io_hdf5_extras and rockdda_io_hdf5_driver use the library, for what its Fortran interface
!> lacks.
!>
!> Files have the library's default (oldest) format, which stays readable after a kill once it was flushed.
!> Arrays travel as flat lists with their shape in Fortran order; readers that count in C order (h5py) see the
!> shape reversed: (2, nv) here is nv x 2 there. Reals are 64-bit (some tables of frames on request 32-bit), integers
!> 32-bit, all little endian; text is UTF-8 of variable length. HDF5's own messages are switched off; the reason goes
!> into the error. Attributes and datasets are neither read nor written while there is an error.
module rockdda_io_hdf5_adapter
   use, intrinsic :: iso_c_binding, only : c_ptr, c_null_ptr, c_loc, c_char, c_null_char, c_f_pointer, c_associated, &
      c_int, c_size_t, c_bool
   use hdf5, only : hid_t, hsize_t, size_t, &
      H5F_ACC_TRUNC_F, H5F_ACC_RDONLY_F, H5F_ACC_RDWR_F, H5F_SCOPE_GLOBAL_F, H5F_CLOSE_STRONG_F, &
      H5F_LIBVER_EARLIEST_F, H5F_LIBVER_LATEST_F, H5P_DATASET_CREATE_F, H5P_DATASET_XFER_F, H5P_DEFAULT_F, &
      H5P_FILE_ACCESS_F, H5S_SCALAR_F, H5S_SELECT_SET_F, H5S_UNLIMITED_F, H5T_CSET_UTF8_F, H5T_IEEE_F32LE, &
      H5T_IEEE_F64LE, H5T_NATIVE_CHARACTER, H5T_NATIVE_DOUBLE, H5T_NATIVE_INTEGER, H5T_STD_I32LE, &
      H5T_STR_NULLPAD_F, H5T_STRING, h5aclose_f, h5acreate_by_name_f, h5aexists_by_name_f, h5aget_space_f, &
      h5aget_type_f, h5aopen_by_name_f, h5aread_f, h5awrite_f, h5dclose_f, h5dcreate_f, h5dget_create_plist_f, &
      h5dget_space_f, h5dget_type_f, h5dopen_f, h5dread_f, h5dset_extent_f, h5dwrite_f, h5eset_auto_f, h5fclose_f, &
      h5fcreate_f, h5fflush_f, h5fopen_f, h5gclose_f, h5gcreate_f, h5get_libversion_f, h5lexists_f, h5open_f, &
      h5pclose_f, h5pcreate_f, h5pget_chunk_f, h5pset_buffer_f, h5pset_cache_f, h5pset_chunk_f, h5pset_deflate_f, &
      h5pset_fclose_degree_f, h5pset_libver_bounds_f, h5pset_shuffle_f, h5sclose_f, h5screate_f, h5screate_simple_f, &
      h5sget_simple_extent_dims_f, h5sget_simple_extent_ndims_f, h5sselect_hyperslab_f, h5tclose_f, h5tcopy_f, &
      h5tequal_f, h5tget_size_f, h5tis_variable_str_f, h5tset_cset_f, h5tset_size_f, h5tset_strpad_f
   use rockdda_base_kinds, only : wp, i8
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_strings, only : to_string
   use rockdda_io_hdf5_driver, only : use_driver, use_driver_for_trial, walk, commit_pieces, sync_pieces, drop_pieces, &
      begin_undo, explain_errno, undo_path, digest_length
   use rockdda_io_hdf5_extras, only : get_reason, set_file_locking, is_valid, write_chunk, structure_problem, &
      kind_of_values, value_kind
   implicit none
   private
   public :: hdf5_file_type, hdf5_version

   !> Cache of each dataset: chunks (a prime number), bytes.
   integer(size_t), parameter :: cached_chunks = 11, cached_bytes = 1048576
   !> Compression level: most of the gain for the least time.
   integer, parameter :: gzip_level = 1
   !> Size of the conversion buffer for a text [bytes]; the default of the library is 1 MiB, cleared each time.
   integer(hsize_t), parameter :: text_buffer = 4096
   !> Letters of a list of texts at most, and values of an attribute.
   integer(i8), parameter :: most_texts = 1000000_i8
   integer(hsize_t), parameter :: most_values = 1000000

   type :: hdf5_file_type
      character(len=:), allocatable :: path
      logical :: is_open = .false.
      integer(hid_t), private :: id = -1
      integer, private :: failure = 5          !! error code of this file's failures: output, or input when only read
      logical, private :: in_commits = .false. !! changes wait for `flush`, see rockdda_io_hdf5_driver
   contains
      procedure :: create => create_file
      procedure :: open => open_file
      procedure :: close => close_file
      procedure :: abandon
      procedure :: flush => flush_file
      procedure :: sync => sync_file
      procedure :: keep_undo
      procedure :: visit_all
      procedure :: create_group
      procedure :: exists
      procedure :: fail
      generic :: set_attribute => set_text_attribute, set_integer_attribute, set_integers_attribute, &
         set_reals_attribute, set_texts_attribute
      generic :: get_attribute => get_text_attribute, get_integer_attribute, get_integers_attribute
      procedure :: has_attribute
      generic :: write => write_reals, write_integers, write_text
      procedure :: write_texts
      generic :: read => read_reals, read_integers, read_text
      procedure :: read_texts
      generic :: write_rows => write_real_rows, write_integer_rows
      procedure :: create_table
      procedure :: resize
      procedure :: get_chunk
      procedure :: write_plain_chunks
      procedure :: get_shape
      procedure :: has_type
      procedure, private :: set_text_attribute, set_integer_attribute, set_integers_attribute, set_reals_attribute, &
         set_texts_attribute, get_text_attribute, get_integer_attribute, get_integers_attribute
      procedure, private :: write_reals, write_integers, write_text, read_reals, read_integers, read_text, &
         write_real_rows, write_integer_rows
      procedure, private :: set_values, write_attribute_texts, open_attribute, write_values, move_rows, open_rows
   end type hdf5_file_type

   !> Rows of an open dataset, selected in the file and in memory.
   type :: selection_type
      integer(hid_t) :: dataset = -1, memory = -1, space = -1
      integer(i8) :: n = 0                     !! entries
   end type selection_type

contains

   !> Create a file, replacing an existing one. The caller has checked that it may be replaced.
   subroutine create_file(self, path, error, in_commits, name)
      class(hdf5_file_type), intent(inout) :: self
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(out) :: error
      logical, intent(in), optional :: in_commits   !! true: what is written waits for `flush`, then all or nothing
      character(len=*), intent(in), optional :: name  !! for messages, when it is not the path
      integer(hid_t) :: access
      integer :: status
      self%path = path
      if (present(name)) self%path = name
      self%failure = error_code%output
      self%in_commits = .false.
      if (present(in_commits)) self%in_commits = in_commits
      call start_library(self%in_commits, access, status)
      if (status == 0) call h5fcreate_f(path, H5F_ACC_TRUNC_F, self%id, status, access_prp=access)
      call end_opening(self, 'cannot create the file', access, status, error)
   end subroutine create_file

   !> Open an existing file, to read it or to continue it; or, for a trial, in its state at the checkpoint with a
   !> digest: changes are then made in memory only, and every failure is one of the file (code input).
   subroutine open_file(self, path, writable, error, digest, again)
      class(hdf5_file_type), intent(inout) :: self
      character(len=*), intent(in) :: path
      logical, intent(in) :: writable               !! then what is written waits for `flush`
      type(error_type), allocatable, intent(out) :: error
      character(len=digest_length), intent(in), optional :: digest
      logical, intent(in), optional :: again        !! with the changes of the preceding, closed trial
      integer(hid_t) :: access
      integer :: status
      self%path = path
      self%failure = merge(error_code%output, error_code%input, writable .and. .not. present(digest))
      self%in_commits = writable
      call start_library(self%in_commits, access, status)
      if (status == 0 .and. present(digest)) status = use_driver_for_trial(access, undo_path(path)//c_null_char, &
          digest, merge(1_c_int, 0_c_int, again))
      if (status == 0) call h5fopen_f(path, merge(H5F_ACC_RDWR_F, H5F_ACC_RDONLY_F, writable), self%id, status, &
                                      access_prp=access)
      call end_opening(self, 'cannot open the file', access, status, error)
      if (.not. allocated(error)) call check_structure(self, error)
   end subroutine open_file

   !> End the opening of a file: release the properties, and make an error of a bad status.
   subroutine end_opening(self, failure, access, status, error)
      class(hdf5_file_type), intent(inout) :: self
      character(len=*), intent(in) :: failure       !! what it would be
      integer(hid_t), intent(in) :: access          !! properties, no longer needed
      integer, intent(in) :: status                 !! 0: the file is open
      type(error_type), allocatable, intent(out) :: error
      integer :: ignored
      if (status /= 0) then
         call self%fail(failure, error)
         return
      end if
      self%is_open = .true.
      call h5pclose_f(access, ignored)
   end subroutine end_opening

   !> Close a file with an error (code input) when it contains anything but plain data of its own.
   subroutine check_structure(self, error)
      class(hdf5_file_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: problem
      problem = structure_problem(self%id)
      if (len(problem) == 0) return
      call self%abandon()
      call make_error(error, error_code%input, self%path//': the file is not as RockDDA writes it: '//problem)
   end subroutine check_structure

   !> Write the waiting changes and close. Without an open file nothing happens.
   subroutine close_file(self, error)
      class(hdf5_file_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      integer :: status
      if (.not. self%is_open) return
      if (self%in_commits) call self%flush(error)
      if (allocated(error)) then
         call self%abandon()
         return
      end if
      self%is_open = .false.
      call h5fclose_f(self%id, status)
      if (status /= 0) call self%fail('cannot finish the file', error)
   end subroutine close_file

   !> Close without writing the waiting changes and without an error. A file in commits remains as after the last flush.
   subroutine abandon(self)
      class(hdf5_file_type), intent(inout) :: self
      integer :: status
      if (.not. self%is_open) return
      self%is_open = .false.
      if (self%in_commits) call drop_pieces(self%id)
      call h5fclose_f(self%id, status)
   end subroutine abandon

   !> Write everything to the system, so that it survives a kill; in commits: all changes or none.
   subroutine flush_file(self, error)
      class(hdf5_file_type), intent(in) :: self
      type(error_type), allocatable, intent(out) :: error
      integer :: status
      call h5fflush_f(self%id, H5F_SCOPE_GLOBAL_F, status)
      if (status /= 0) then
         call self%fail('cannot write', error)
      else if (self%in_commits) then
         call explain_errno(commit_pieces(self%id), self%path, error)
      end if
   end subroutine flush_file

   !> Wait until what was flushed is on the disk. For files in commits.
   subroutine sync_file(self, error)
      class(hdf5_file_type), intent(in) :: self
      type(error_type), allocatable, intent(out) :: error
      call explain_errno(sync_pieces(self%id), self%path, error)
   end subroutine sync_file

   !> Begin the undo file that returns to the last flush, the state of the checkpoint with this digest. For files in
   !> commits.
   subroutine keep_undo(self, digest, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=digest_length), intent(in) :: digest
      type(error_type), allocatable, intent(out) :: error
      call explain_errno(begin_undo(self%id, undo_path(self%path)//c_null_char, digest), undo_path(self%path), error)
   end subroutine keep_undo

   !> Open every object and attribute, also those that RockDDA does not use.
   subroutine visit_all(self, error)
      class(hdf5_file_type), intent(in) :: self
      type(error_type), allocatable, intent(out) :: error
      if (walk(self%id) < 0) call self%fail('cannot list what is in the file', error)
   end subroutine visit_all

   !> Create a group; its parents exist.
   subroutine create_group(self, name, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: name
      type(error_type), allocatable, intent(inout) :: error
      integer(hid_t) :: group
      integer :: status
      if (allocated(error)) return
      call h5gcreate_f(self%id, name, group, status)
      if (status == 0) call h5gclose_f(group, status)
      if (status /= 0) call self%fail('cannot create group '//name, error)
   end subroutine create_group

   !> Does the object exist? Tests every part of the path.
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

   !> Create a data space; dims of size 0: scalar.
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

   !> Create the type of UTF-8 text of variable length.
   subroutine new_text_type(type, status)
      integer(hid_t), intent(out) :: type
      integer, intent(out) :: status
      call h5tcopy_f(H5T_STRING, type, status)
      if (status == 0) call h5tset_cset_f(type, H5T_CSET_UTF8_F, status)
   end subroutine new_text_type

   !> Start the library and make the access properties of every file: no file locking (readers may read while a run
   !> writes; rockdda_io_output_lock excludes a second run), all objects closed with the file, a small cache for each
   !> dataset (tables grow chunk by chunk, and each opening clears the index of its cache).
   subroutine start_library(in_commits, access, status)
      logical, intent(in) :: in_commits
      integer(hid_t), intent(out) :: access
      integer, intent(out) :: status
      access = H5P_DEFAULT_F
      status = 0
      ! once: a second call fails in HDF5 1.10.10, that of Ubuntu 24.04
      if (is_valid(H5T_NATIVE_CHARACTER) <= 0) call h5open_f(status)
      if (status == 0) call h5eset_auto_f(0, status)
      if (status == 0) call h5pcreate_f(H5P_FILE_ACCESS_F, access, status)
      ! the oldest layout that serves, by default in HDF5 1: the driver and the reader of the package read no other
      if (status == 0) call h5pset_libver_bounds_f(access, H5F_LIBVER_EARLIEST_F, H5F_LIBVER_LATEST_F, status)
      if (status == 0) call h5pset_fclose_degree_f(access, H5F_CLOSE_STRONG_F, status)
      if (status == 0) call h5pset_cache_f(access, 0, cached_chunks, cached_bytes, 0.75, status)
      if (status == 0 .and. in_commits) then
         status = use_driver(access)
      else if (status == 0) then
         status = set_file_locking(access, .false._c_bool, .true._c_bool)
      end if
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

   !> Make an error that names the file, what could not be done and why.
   subroutine fail(self, what, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: what
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: reason
      reason = get_reason()
      ! HDF5 is refused memory before the program is
      if (index(reason, 'unable to allocate') > 0 .or. index(reason, 'memory allocation failed') > 0) then
         call make_error(error, error_code%computation, self%path//': '//what//': out of memory ('//reason//')', &
                         is_fatal=.true.)
         return
      end if
      if (len(reason) > 0) reason = ' ('//reason//')'
      call make_error(error, self%failure, self%path//': '//what//reason)
   end subroutine fail

   !> Set a text attribute of an object ('/' is the file), replacing its value.
   subroutine set_text_attribute(self, object, name, text, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: object, name, text
      type(error_type), allocatable, intent(inout) :: error
      call self%write_attribute_texts(object, name, [text], .true., error)
   end subroutine set_text_attribute

   !> Set an attribute that is a list of texts; trailing blanks are not kept.
   subroutine set_texts_attribute(self, object, name, texts, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: object, name, texts(:)
      type(error_type), allocatable, intent(inout) :: error
      call self%write_attribute_texts(object, name, texts, .false., error)
   end subroutine set_texts_attribute

   !> Set a text attribute, scalar or list.
   subroutine write_attribute_texts(self, object, name, texts, scalar, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: object, name, texts(:)
      logical, intent(in) :: scalar
      type(error_type), allocatable, intent(inout) :: error
      character(kind=c_char, len=1), allocatable, target :: buffer(:, :)
      type(c_ptr), target :: pointers(size(texts))
      integer(hid_t) :: type
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
      call self%set_values(object, name, type, type, dims, c_loc(pointers), error)
      call h5tclose_f(type, status)
   end subroutine write_attribute_texts

   !> Set an integer attribute, replacing its value.
   subroutine set_integer_attribute(self, object, name, value, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: object, name
      integer, intent(in), target :: value
      type(error_type), allocatable, intent(inout) :: error
      call self%set_values(object, name, H5T_STD_I32LE, H5T_NATIVE_INTEGER, [integer(hsize_t) ::], c_loc(value), error)
   end subroutine set_integer_attribute

   !> Set an attribute that is a list of integers (of the same length as before).
   subroutine set_integers_attribute(self, object, name, values, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: object, name
      integer, intent(in), contiguous, target :: values(:)
      type(error_type), allocatable, intent(inout) :: error
      type(c_ptr) :: place
      place = c_null_ptr
      if (size(values) > 0) place = c_loc(values)
      call self%set_values(object, name, H5T_STD_I32LE, H5T_NATIVE_INTEGER, [size(values, kind=hsize_t)], place, error)
   end subroutine set_integers_attribute

   !> Set an attribute that is a list of reals (of the same length as before).
   subroutine set_reals_attribute(self, object, name, values, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: object, name
      real(wp), intent(in), contiguous, target :: values(:)
      type(error_type), allocatable, intent(inout) :: error
      type(c_ptr) :: place
      place = c_null_ptr
      if (size(values) > 0) place = c_loc(values)
      call self%set_values(object, name, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, [size(values, kind=hsize_t)], place, error)
   end subroutine set_reals_attribute

   !> Set the values of an attribute.
   subroutine set_values(self, object, name, stored, type, dims, values, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: object, name
      integer(hid_t), intent(in) :: stored, type       !! in the file, in memory
      integer(hsize_t), intent(in) :: dims(:)          !! of size 0: a scalar
      type(c_ptr), intent(in) :: values                !! null: there are none
      type(error_type), allocatable, intent(inout) :: error
      integer(hid_t) :: attribute
      integer :: status
      if (allocated(error)) return
      call self%open_attribute(object, name, stored, dims, attribute, status)
      if (status == 0 .and. c_associated(values)) call h5awrite_f(attribute, type, values, status)
      if (status /= 0) call self%fail('cannot write attribute '//name, error)
      call h5aclose_f(attribute, status)
   end subroutine set_values

   !> Open an attribute, creating a missing one; dims of size 0: scalar.
   subroutine open_attribute(self, object, name, type, dims, attribute, status)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: object, name
      integer(hid_t), intent(in) :: type
      integer(hsize_t), intent(in) :: dims(:)
      integer(hid_t), intent(out) :: attribute
      integer, intent(out) :: status
      integer(hid_t) :: space, stored
      logical :: same
      integer :: ignored
      attribute = -1
      if (self%has_attribute(object, name)) then
         call h5aopen_by_name_f(self%id, object, name, attribute, status)
         ! HDF5 writes beyond its memory when it turns a value into a type that damage has made
         if (status == 0) call h5aget_type_f(attribute, stored, status)
         if (status == 0) call h5tequal_f(stored, type, same, status)
         if (status == 0 .and. .not. same) status = -1
         call h5tclose_f(stored, ignored)
      else
         call new_space(dims, space, status)
         if (status == 0) call h5acreate_by_name_f(self%id, object, name, type, space, attribute, status)
         call h5sclose_f(space, ignored)
      end if
   end subroutine open_attribute

   !> Does an object have this attribute?
   logical function has_attribute(self, object, name)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: object, name
      integer :: status
      call h5aexists_by_name_f(self%id, object, name, has_attribute, status)
      has_attribute = has_attribute .and. status == 0
   end function has_attribute

   !> Get the value of a text attribute; of a list of texts with a line end between them.
   subroutine get_text_attribute(self, object, name, text, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: object, name
      character(len=:), allocatable, intent(out) :: text
      type(error_type), allocatable, intent(inout) :: error
      type(c_ptr), allocatable, target :: pointers(:)
      type(c_ptr) :: place
      integer(hid_t) :: attribute, type, stored
      integer(hsize_t) :: n
      logical :: variable
      integer :: status, i
      text = ''
      if (allocated(error)) return
      variable = .false.
      call h5aopen_by_name_f(self%id, object, name, attribute, status)
      if (status == 0) call h5aget_type_f(attribute, stored, status)
      if (status == 0) call h5tis_variable_str_f(stored, variable, status)
      if (status == 0 .and. variable) call count_values(attribute, n, status)
      if (status == 0 .and. variable) then
         allocate (pointers(n))
         pointers = c_null_ptr
         place = c_loc(pointers)
         call new_text_type(type, status)
         call h5aread_f(attribute, type, place, status)
         if (status == 0) then
            do i = 1, int(n)
               if (i > 1) text = text//new_line('a')
               text = text//take_text(pointers(i))
            end do
         end if
         call h5tclose_f(type, status)
      else
         call self%fail('cannot read text attribute '//name, error)
      end if
      call h5aclose_f(attribute, status)
   end subroutine get_text_attribute

   !> Get the value of an integer attribute.
   subroutine get_integer_attribute(self, object, name, value, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: object, name
      integer, intent(out) :: value
      type(error_type), allocatable, intent(inout) :: error
      integer, allocatable :: values(:)
      value = 0
      call self%get_attribute(object, name, values, error)
      if (allocated(error)) return
      if (size(values) == 1) then
         value = values(1)
      else
         call self%fail('cannot read integer attribute '//name, error)
      end if
   end subroutine get_integer_attribute

   !> Get values of an attribute that is a list of integers, or one.
   subroutine get_integers_attribute(self, object, name, values, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: object, name
      integer, allocatable, intent(out) :: values(:)
      type(error_type), allocatable, intent(inout) :: error
      integer(hid_t) :: attribute
      integer(hsize_t) :: n
      integer :: status, ignored
      n = 0
      if (allocated(error)) return
      call h5aopen_by_name_f(self%id, object, name, attribute, status)
      if (status == 0) call count_values(attribute, n, status)
      allocate (values(n))
      if (status == 0 .and. n > 0) call h5aread_f(attribute, H5T_NATIVE_INTEGER, values, [n], status)
      if (status /= 0) call self%fail('cannot read integer attribute '//name, error)
      call h5aclose_f(attribute, ignored)
   end subroutine get_integers_attribute

   !> Count the values of an attribute; a list of a million was not written by this program.
   subroutine count_values(attribute, n, status)
      integer(hid_t), intent(in) :: attribute
      integer(hsize_t), intent(out) :: n
      integer, intent(out) :: status
      integer(hid_t) :: space
      integer(hsize_t) :: dims(1), largest(1)
      integer :: rank, ignored
      n = 1
      rank = 0
      call h5aget_space_f(attribute, space, status)
      if (status == 0) call h5sget_simple_extent_ndims_f(space, rank, status)
      if (rank == 1) then
         call h5sget_simple_extent_dims_f(space, dims, largest, status)
         n = dims(1)
      end if
      ! this call returns the rank
      status = merge(0, -1, status >= 0 .and. rank <= 1 .and. n >= 0 .and. n <= most_values)
      if (status /= 0) n = 0
      call h5sclose_f(space, ignored)
   end subroutine count_values

   !> Get the shape of a dataset in Fortran order; size 0 for a scalar.
   subroutine get_shape(self, name, shape, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: name
      integer(i8), allocatable, intent(out) :: shape(:)
      type(error_type), allocatable, intent(inout) :: error
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
      kind = kind_of_values(dataset)
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
      real(wp), intent(in), contiguous, target :: values(:)      !! (product(shape))
      type(error_type), allocatable, intent(inout) :: error
      type(c_ptr) :: place
      place = c_null_ptr
      if (size(values) > 0) place = c_loc(values)
      call self%write_values(name, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, shape, place, error)
   end subroutine write_reals

   !> Write a whole dataset of integers.
   subroutine write_integers(self, name, shape, values, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: shape(:)
      integer, intent(in), contiguous, target :: values(:)       !! (product(shape))
      type(error_type), allocatable, intent(inout) :: error
      type(c_ptr) :: place
      place = c_null_ptr
      if (size(values) > 0) place = c_loc(values)
      call self%write_values(name, H5T_STD_I32LE, H5T_NATIVE_INTEGER, shape, place, error)
   end subroutine write_integers

   !> Write a text as a scalar dataset.
   subroutine write_text(self, name, text, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: name, text
      type(error_type), allocatable, intent(inout) :: error
      character(kind=c_char, len=:), allocatable, target :: buffer
      type(c_ptr), target :: pointer(1)
      integer(hid_t) :: dataset, space, type, transfer
      integer :: status, ignored
      if (allocated(error)) return
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
      type(error_type), allocatable, intent(inout) :: error
      character(kind=c_char, len=1), allocatable, target :: buffer(:, :)
      integer(hid_t) :: type
      integer :: i, k, status
      allocate (buffer(max(1, maxval(len_trim(texts))), size(texts)), source=c_null_char)
      do i = 1, size(texts)
         do k = 1, len_trim(texts(i))
            buffer(k, i) = texts(i) (k:k)
         end do
      end do
      ! UTF-8, nulls behind it
      call h5tcopy_f(H5T_NATIVE_CHARACTER, type, status)
      if (status == 0) call h5tset_size_f(type, size(buffer, 1, size_t), status)
      if (status == 0) call h5tset_strpad_f(type, H5T_STR_NULLPAD_F, status)
      if (status == 0) call h5tset_cset_f(type, H5T_CSET_UTF8_F, status)
      call self%write_values(name, type, type, [size(texts)], c_loc(buffer), error)
      call h5tclose_f(type, status)
   end subroutine write_texts

   !> Write a whole dataset.
   subroutine write_values(self, name, stored, type, shape, values, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: name
      integer(hid_t), intent(in) :: stored, type       !! in the file, in memory
      integer, intent(in) :: shape(:)
      type(c_ptr), intent(in) :: values                !! null: there are none
      type(error_type), allocatable, intent(inout) :: error
      integer(hid_t) :: dataset, space
      integer :: status, ignored
      if (allocated(error)) return
      dataset = -1
      call new_space(int(shape, hsize_t), space, status)
      if (status == 0) call h5dcreate_f(self%id, name, stored, space, dataset, status)
      if (status == 0 .and. c_associated(values)) call h5dwrite_f(dataset, type, values, status)
      if (status /= 0) call self%fail('cannot write '//name, error)
      call h5sclose_f(space, ignored)
      call h5dclose_f(dataset, ignored)
   end subroutine write_values

   !> Write rows of reals of a table, after the first `skip`.
   subroutine write_real_rows(self, name, skip, n_rows, values, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: name
      integer(i8), intent(in) :: skip
      integer, intent(in) :: n_rows
      real(wp), intent(in), contiguous, target :: values(:)       !! (entries of a row * n_rows)
      type(error_type), allocatable, intent(inout) :: error
      type(selection_type) :: rows
      call select_in_table(self, name, value_kind%reals, rows, error, skip, int(n_rows, i8))
      if (allocated(error)) return
      call self%move_rows('write', name, H5T_NATIVE_DOUBLE, rows, c_loc(values), error)
   end subroutine write_real_rows

   !> Write rows of integers of a table, after the first `skip`.
   subroutine write_integer_rows(self, name, skip, n_rows, values, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: name
      integer(i8), intent(in) :: skip
      integer, intent(in) :: n_rows
      integer, intent(in), contiguous, target :: values(:)        !! (entries of a row * n_rows)
      type(error_type), allocatable, intent(inout) :: error
      type(selection_type) :: rows
      call select_in_table(self, name, value_kind%integers, rows, error, skip, int(n_rows, i8))
      if (allocated(error)) return
      call self%move_rows('write', name, H5T_NATIVE_INTEGER, rows, c_loc(values), error)
   end subroutine write_integer_rows

   !> Read a dataset of reals, or `count` rows of its last dimension after the first `skip`.
   subroutine read_reals(self, name, values, error, skip, count)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: name
      real(wp), allocatable, intent(out), target :: values(:)   !! in array element order
      type(error_type), allocatable, intent(inout) :: error
      integer(i8), intent(in), optional :: skip, count
      type(selection_type) :: rows
      call select_in_table(self, name, value_kind%reals, rows, error, skip, count)
      if (allocated(error)) return
      allocate (values(rows%n))
      call self%move_rows('read', name, H5T_NATIVE_DOUBLE, rows, c_loc(values), error)
   end subroutine read_reals

   !> Read a dataset of integers, or some rows of it.
   subroutine read_integers(self, name, values, error, skip, count)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: name
      integer, allocatable, intent(out), target :: values(:)
      type(error_type), allocatable, intent(inout) :: error
      integer(i8), intent(in), optional :: skip, count
      type(selection_type) :: rows
      call select_in_table(self, name, value_kind%integers, rows, error, skip, count)
      if (allocated(error)) return
      allocate (values(rows%n))
      call self%move_rows('read', name, H5T_NATIVE_INTEGER, rows, c_loc(values), error)
   end subroutine read_integers

   !> Write or read selected rows, and close what `select_in_table` opened.
   subroutine move_rows(self, action, name, type, rows, values, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: action           !! 'write' or 'read'
      character(len=*), intent(in) :: name
      integer(hid_t), intent(in) :: type               !! in memory
      type(selection_type), intent(in) :: rows
      type(c_ptr), intent(in) :: values
      type(error_type), allocatable, intent(out) :: error
      type(c_ptr) :: place
      integer :: status
      status = 0
      place = values
      if (rows%n > 0 .and. action == 'write') then
         call h5dwrite_f(rows%dataset, type, place, status, rows%memory, rows%space)
      else if (rows%n > 0) then
         call h5dread_f(rows%dataset, type, place, status, rows%memory, rows%space)
      end if
      if (status /= 0) call self%fail('cannot '//action//' '//name, error)
      call close_rows(rows)
   end subroutine move_rows

   !> Read a scalar text dataset.
   subroutine read_text(self, name, text, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: name
      character(len=:), allocatable, intent(out) :: text
      type(error_type), allocatable, intent(inout) :: error
      type(c_ptr), target :: pointer(1)
      type(c_ptr) :: place
      integer(hid_t) :: dataset, type
      integer :: status
      text = ''
      if (allocated(error)) return
      pointer = c_null_ptr
      place = c_loc(pointer)
      call new_text_type(type, status)
      call h5dopen_f(self%id, name, dataset, status)
      if (status == 0) status = merge(0, -1, kind_of_values(dataset) == value_kind%text)
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
      type(error_type), allocatable, intent(inout) :: error
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
      if (status == 0) status = merge(0, -1, kind_of_values(dataset) == value_kind%texts)
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
      type(error_type), allocatable, intent(inout) :: error
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
      found = kind_of_values(rows%dataset)
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
      type(error_type), allocatable, intent(inout) :: error
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
      type(error_type), allocatable, intent(inout) :: error
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
      type(error_type), allocatable, intent(inout) :: error
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

   !> Write whole chunks after the first `skip` rows, neither shuffled nor compressed, so that their addresses do not
   !> change when they are written again. The table gets n_rows rows, of which the last chunk may have fewer than its
   !> room. Readers see no difference to other chunks.
   subroutine write_plain_chunks(self, name, skip, n_rows, per_chunk, n_chunks, n_bytes, values, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: name
      integer(i8), intent(in) :: skip                      !! rows before the chunks
      integer(i8), intent(in) :: n_rows                    !! of the table, these included
      integer, intent(in) :: per_chunk, n_chunks           !! rows of a chunk, chunks
      integer(i8), intent(in) :: n_bytes                   !! of a chunk
      type(c_ptr), intent(in) :: values                    !! of the kind that is stored
      type(error_type), allocatable, intent(inout) :: error
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
         if (status == 0) status = write_chunk(dataset, skip + int(per_chunk, i8)*k, rank, n_bytes, values, &
                                               n_bytes*k)
      end do
      if (status /= 0) call self%fail('cannot write '//name, error)
      call h5sclose_f(space, ignored)
      call h5dclose_f(dataset, ignored)
   end subroutine write_plain_chunks

   !> Open a dataset and its space and get its shape.
   subroutine open_rows(self, name, dataset, space, dims, error)
      class(hdf5_file_type), intent(in) :: self
      character(len=*), intent(in) :: name
      integer(hid_t), intent(out) :: dataset, space
      integer(hsize_t), allocatable, intent(out) :: dims(:)
      type(error_type), allocatable, intent(inout) :: error
      integer(hsize_t), allocatable :: largest(:)
      integer :: status, rank
      space = -1
      rank = 0
      if (allocated(error)) return
      call h5dopen_f(self%id, name, dataset, status)
      if (status == 0) call h5dget_space_f(dataset, space, status)
      if (status == 0) call h5sget_simple_extent_ndims_f(space, rank, status)
      allocate (dims(max(rank, 0)), largest(max(rank, 0)))
      if (status == 0 .and. rank > 0) call h5sget_simple_extent_dims_f(space, dims, largest, status)
      if (status < 0) call self%fail('cannot open '//name, error)
   end subroutine open_rows

   !> Version of the HDF5 library in use.
   function hdf5_version() result(text)
      character(len=:), allocatable :: text
      integer :: major, minor, release, status
      call h5get_libversion_f(major, minor, release, status)
      text = to_string(major)//'.'//to_string(minor)//'.'//to_string(release)
   end function hdf5_version

end module rockdda_io_hdf5_adapter
