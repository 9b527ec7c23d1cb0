! SPDX-License-Identifier: MIT
!> HDF5 files: opening, closing and groups. Attributes are in rockdda_io_hdf5_attributes, datasets in
!> rockdda_io_hdf5_adapter, the module for all other code.
module rockdda_io_hdf5_file
   use, intrinsic :: iso_c_binding, only : c_ptr, c_char, c_f_pointer, c_associated, c_int, c_size_t
   use hdf5, only : hid_t, hsize_t, size_t, H5T_NATIVE_CHARACTER, H5T_STR_NULLPAD_F, h5tset_size_f, h5tset_strpad_f, &
      H5F_ACC_TRUNC_F, H5F_ACC_RDONLY_F, H5F_ACC_RDWR_F, H5F_SCOPE_GLOBAL_F, &
      H5F_CLOSE_STRONG_F, H5P_FILE_ACCESS_F, H5P_DEFAULT_F, H5S_SCALAR_F, H5T_CSET_UTF8_F, H5T_STRING, &
      h5eset_auto_f, h5fclose_f, h5fcreate_f, h5fflush_f, h5fopen_f, h5gclose_f, h5gcreate_f, h5get_libversion_f, &
      h5lexists_f, h5open_f, h5pclose_f, h5pcreate_f, h5pset_cache_f, h5pset_fclose_degree_f, &
      h5pset_libver_bounds_f, H5F_LIBVER_EARLIEST_F, H5F_LIBVER_LATEST_F, &
      h5screate_f, h5screate_simple_f, h5tcopy_f, h5tset_cset_f
   use rockdda_base_kinds, only : i8
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_strings, only : to_string
   use rockdda_io_hdf5_driver, only : use_driver, use_driver_for_trial, walk, commit_pieces, sync_pieces, &
      drop_pieces, begin_undo, digest_length
   use rockdda_io_hdf5_extras, only : get_reason, disable_file_locking, is_valid
   use rockdda_io_hdf5_structure, only : structure_problem
   implicit none
   private
   public :: hdf5_handle_type, hdf5_version, new_space, new_text_type, new_fixed_text_type, take_text

   !> Cache of each dataset: chunks (a prime number), bytes.
   integer(size_t), parameter :: cached_chunks = 11, cached_bytes = 1048576

   type :: hdf5_handle_type
      character(len=:), allocatable :: path
      logical :: is_open = .false.
      integer(hid_t) :: id = -1                !! for the extensions of this type
      integer, private :: failure = 5          !! error code of this file's failures: output, or input when only read
      logical, private :: in_commits = .false. !! changes wait for `flush`, see rockdda_io_hdf5_driver
   contains
      procedure :: create => create_file
      procedure :: open => open_file
      procedure :: open_for_trial
      procedure :: close => close_file
      procedure :: abandon
      procedure :: flush => flush_file
      procedure :: sync => sync_file
      procedure :: keep_undo
      procedure :: visit_all
      procedure :: create_group
      procedure :: exists
      procedure :: fail
   end type hdf5_handle_type

contains

   !> Create a file, replacing an existing one. The caller has checked that it may be replaced.
   subroutine create_file(self, path, error, in_commits, name)
      class(hdf5_handle_type), intent(inout) :: self
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

   !> Open an existing file, to read it or to continue it.
   subroutine open_file(self, path, writable, error)
      class(hdf5_handle_type), intent(inout) :: self
      character(len=*), intent(in) :: path
      logical, intent(in) :: writable               !! then what is written waits for `flush`
      type(error_type), allocatable, intent(out) :: error
      integer(hid_t) :: access
      integer :: status
      self%path = path
      self%failure = merge(error_code%output, error_code%input, writable)
      self%in_commits = writable
      call start_library(self%in_commits, access, status)
      if (status == 0) call h5fopen_f(path, merge(H5F_ACC_RDWR_F, H5F_ACC_RDONLY_F, writable), self%id, status, &
                                      access_prp=access)
      call end_opening(self, 'cannot open the file', access, status, error)
      if (.not. allocated(error)) call check_structure(self, error)
   end subroutine open_file

   !> Open an existing file in its state at the checkpoint with this digest and change it in memory only: no change
   !> reaches the disk. Every failure is one of the file (code input).
   subroutine open_for_trial(self, path, digest, again, error)
      class(hdf5_handle_type), intent(inout) :: self
      character(len=*), intent(in) :: path
      character(len=digest_length), intent(in) :: digest
      logical, intent(in) :: again                  !! with the changes of the preceding, closed trial
      type(error_type), allocatable, intent(out) :: error
      integer(hid_t) :: access
      integer :: status
      self%path = path
      self%failure = error_code%input
      self%in_commits = .true.
      call start_library(.true., access, status)
      if (status == 0) call use_driver_for_trial(int(access, i8), path, digest, again, status)
      if (status == 0) call h5fopen_f(path, H5F_ACC_RDWR_F, self%id, status, access_prp=access)
      call end_opening(self, 'cannot open the file', access, status, error)
      if (.not. allocated(error)) call check_structure(self, error)
   end subroutine open_for_trial

   !> End the opening of a file: release the properties, and make an error of a bad status.
   subroutine end_opening(self, failure, access, status, error)
      class(hdf5_handle_type), intent(inout) :: self
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
      class(hdf5_handle_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: problem
      problem = structure_problem(int(self%id, i8))
      if (len(problem) == 0) return
      call self%abandon()
      call make_error(error, error_code%input, self%path//': the file is not as RockDDA writes it: '//problem)
   end subroutine check_structure

   !> Write the waiting changes and close. Without an open file nothing happens.
   subroutine close_file(self, error)
      class(hdf5_handle_type), intent(inout) :: self
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
      class(hdf5_handle_type), intent(inout) :: self
      integer :: status
      if (.not. self%is_open) return
      self%is_open = .false.
      if (self%in_commits) call drop_pieces(int(self%id, i8))
      call h5fclose_f(self%id, status)
   end subroutine abandon

   !> Write everything to the system, so that it survives a kill; in commits: all changes or none.
   subroutine flush_file(self, error)
      class(hdf5_handle_type), intent(in) :: self
      type(error_type), allocatable, intent(out) :: error
      integer :: status
      call h5fflush_f(self%id, H5F_SCOPE_GLOBAL_F, status)
      if (status /= 0) then
         call self%fail('cannot write', error)
      else if (self%in_commits) then
         call commit_pieces(int(self%id, i8), self%path, error)
      end if
   end subroutine flush_file

   !> Wait until what was flushed is on the disk. For files in commits.
   subroutine sync_file(self, error)
      class(hdf5_handle_type), intent(in) :: self
      type(error_type), allocatable, intent(out) :: error
      call sync_pieces(int(self%id, i8), self%path, error)
   end subroutine sync_file

   !> Begin the undo file that returns to the last flush, the state of the checkpoint with this digest. For files in
   !> commits.
   subroutine keep_undo(self, undo_path, digest, error)
      class(hdf5_handle_type), intent(in) :: self
      character(len=*), intent(in) :: undo_path
      character(len=digest_length), intent(in) :: digest
      type(error_type), allocatable, intent(out) :: error
      call begin_undo(int(self%id, i8), undo_path, digest, error)
   end subroutine keep_undo

   !> Open every object and attribute, also those that RockDDA does not use.
   subroutine visit_all(self, error)
      class(hdf5_handle_type), intent(in) :: self
      type(error_type), allocatable, intent(out) :: error
      integer :: status
      call walk(int(self%id, i8), status)
      if (status < 0) call self%fail('cannot list what is in the file', error)
   end subroutine visit_all

   !> Create a group; its parents exist.
   subroutine create_group(self, name, error)
      class(hdf5_handle_type), intent(in) :: self
      character(len=*), intent(in) :: name
      type(error_type), allocatable, intent(out) :: error
      integer(hid_t) :: group
      integer :: status
      call h5gcreate_f(self%id, name, group, status)
      if (status == 0) call h5gclose_f(group, status)
      if (status /= 0) call self%fail('cannot create group '//name, error)
   end subroutine create_group

   !> Does the object exist? Tests every part of the path.
   logical function exists(self, name)
      class(hdf5_handle_type), intent(in) :: self
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

   !> UTF-8 text of a fixed number of bytes, nulls behind it.
   subroutine new_fixed_text_type(length, type, status)
      integer, intent(in) :: length              !! > 0
      integer(hid_t), intent(out) :: type
      integer, intent(out) :: status
      call h5tcopy_f(H5T_NATIVE_CHARACTER, type, status)
      if (status == 0) call h5tset_size_f(type, int(length, size_t), status)
      if (status == 0) call h5tset_strpad_f(type, H5T_STR_NULLPAD_F, status)
      if (status == 0) call h5tset_cset_f(type, H5T_CSET_UTF8_F, status)
   end subroutine new_fixed_text_type

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
      if (.not. is_valid(int(H5T_NATIVE_CHARACTER, i8))) call h5open_f(status)
      if (status == 0) call h5eset_auto_f(0, status)
      if (status == 0) call h5pcreate_f(H5P_FILE_ACCESS_F, access, status)
      ! the oldest layout that serves, by default in HDF5 1: the driver and the reader of the package know no other
      if (status == 0) call h5pset_libver_bounds_f(access, H5F_LIBVER_EARLIEST_F, H5F_LIBVER_LATEST_F, status)
      if (status == 0) call h5pset_fclose_degree_f(access, H5F_CLOSE_STRONG_F, status)
      if (status == 0) call h5pset_cache_f(access, 0, cached_chunks, cached_bytes, 0.75, status)
      if (status == 0 .and. in_commits) then
         call use_driver(int(access, i8), status)
      else if (status == 0) then
         call disable_file_locking(int(access, i8), status)
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
      class(hdf5_handle_type), intent(in) :: self
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

   !> Version of the HDF5 library in use.
   function hdf5_version() result(text)
      character(len=:), allocatable :: text
      integer :: major, minor, release, status
      call h5get_libversion_f(major, minor, release, status)
      text = to_string(major)//'.'//to_string(minor)//'.'//to_string(release)
   end function hdf5_version

end module rockdda_io_hdf5_file
