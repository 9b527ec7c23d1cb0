! SPDX-License-Identifier: MIT
!> Attributes of HDF5 files and of what is in them: texts and integers, scalars and lists.
module rockdda_io_hdf5_attributes
   use, intrinsic :: iso_c_binding, only : c_ptr, c_null_ptr, c_loc, c_char, c_null_char
   use hdf5, only : hid_t, hsize_t, H5T_NATIVE_INTEGER, H5T_STD_I32LE, H5T_NATIVE_DOUBLE, H5T_IEEE_F64LE, &
      h5aclose_f, h5acreate_f, h5aexists_f, h5aget_space_f, h5aget_type_f, h5aopen_f, h5aread_f, &
      h5awrite_f, h5oclose_f, h5oopen_f, h5sclose_f, &
      h5sget_simple_extent_ndims_f, h5sget_simple_extent_dims_f, h5tclose_f, h5tequal_f, h5tis_variable_str_f
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type
   use rockdda_io_hdf5_file, only : hdf5_handle_type, new_space, new_text_type, take_text
   implicit none
   private
   public :: hdf5_attributes_type

   !> Values of an attribute at most.
   integer(hsize_t), parameter :: most_values = 1000000

   type, extends(hdf5_handle_type) :: hdf5_attributes_type
   contains
      generic :: set_attribute => set_text_attribute, set_integer_attribute, set_integers_attribute, &
         set_reals_attribute, set_texts_attribute
      generic :: get_attribute => get_text_attribute, get_integer_attribute, get_integers_attribute
      procedure :: has_attribute
      procedure, private :: set_text_attribute, set_integer_attribute, set_integers_attribute, &
         set_reals_attribute, set_texts_attribute
      procedure, private :: get_text_attribute, get_integer_attribute, get_integers_attribute
      procedure, private :: open_attribute
      procedure, private :: write_texts_attribute
   end type hdf5_attributes_type

contains

   !> Set a text attribute of an object ('/' is the file), replacing its value.
   subroutine set_text_attribute(self, object, name, text, error)
      class(hdf5_attributes_type), intent(in) :: self
      character(len=*), intent(in) :: object, name, text
      type(error_type), allocatable, intent(out) :: error
      character(len=len(text)) :: texts(1)
      texts(1) = text
      call self%write_texts_attribute(object, name, texts, .true., error)
   end subroutine set_text_attribute

   !> Set an attribute that is a list of texts; trailing blanks are not kept.
   subroutine set_texts_attribute(self, object, name, texts, error)
      class(hdf5_attributes_type), intent(in) :: self
      character(len=*), intent(in) :: object, name, texts(:)
      type(error_type), allocatable, intent(out) :: error
      call self%write_texts_attribute(object, name, texts, .false., error)
   end subroutine set_texts_attribute

   !> Set a text attribute, scalar or list.
   subroutine write_texts_attribute(self, object, name, texts, scalar, error)
      class(hdf5_attributes_type), intent(in) :: self
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
      class(hdf5_attributes_type), intent(in) :: self
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
      class(hdf5_attributes_type), intent(in) :: self
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

   !> Set an attribute that is a list of reals (of the same length as before).
   subroutine set_reals_attribute(self, object, name, values, error)
      class(hdf5_attributes_type), intent(in) :: self
      character(len=*), intent(in) :: object, name
      real(wp), intent(in) :: values(:)
      type(error_type), allocatable, intent(out) :: error
      integer(hid_t) :: attribute
      integer(hsize_t) :: dims(1)
      integer :: status
      dims = size(values, kind=hsize_t)
      call self%open_attribute(object, name, H5T_IEEE_F64LE, dims, attribute, status)
      if (status == 0 .and. size(values) > 0) call h5awrite_f(attribute, H5T_NATIVE_DOUBLE, values, dims, status)
      if (status /= 0) call self%fail('cannot write attribute '//name, error)
      call h5aclose_f(attribute, status)
   end subroutine set_reals_attribute

   !> Open an attribute, creating a missing one; dims of size 0: scalar.
   subroutine open_attribute(self, object, name, type, dims, attribute, status)
      class(hdf5_attributes_type), intent(in) :: self
      character(len=*), intent(in) :: object, name
      integer(hid_t), intent(in) :: type
      integer(hsize_t), intent(in) :: dims(:)
      integer(hid_t), intent(out) :: attribute
      integer, intent(out) :: status
      integer(hid_t) :: owner, space, stored
      logical :: there
      integer :: ignored
      attribute = -1
      call h5oopen_f(self%id, object, owner, status)
      if (status /= 0) return
      call h5aexists_f(owner, name, there, status)
      if (status == 0 .and. there) then
         call h5aopen_f(owner, name, attribute, status)
         ! HDF5 writes beyond its memory when it turns a value into a type that damage has made
         if (status == 0) call h5aget_type_f(attribute, stored, status)
         if (status == 0) call h5tequal_f(stored, type, there, status)
         if (status == 0 .and. .not. there) status = -1
         call h5tclose_f(stored, ignored)
      else if (status == 0) then
         call new_space(dims, space, status)
         if (status == 0) call h5acreate_f(owner, name, type, space, attribute, status)
         call h5sclose_f(space, ignored)
      end if
      call h5oclose_f(owner, ignored)
   end subroutine open_attribute

   !> Does an object have this attribute?
   logical function has_attribute(self, object, name)
      class(hdf5_attributes_type), intent(in) :: self
      character(len=*), intent(in) :: object, name
      integer(hid_t) :: owner
      integer :: status, ignored
      has_attribute = .false.
      call h5oopen_f(self%id, object, owner, status)
      if (status /= 0) return
      call h5aexists_f(owner, name, has_attribute, status)
      if (status /= 0) has_attribute = .false.
      call h5oclose_f(owner, ignored)
   end function has_attribute

   !> Get the value of a text attribute; of a list of texts with a line end between them.
   subroutine get_text_attribute(self, object, name, text, error)
      class(hdf5_attributes_type), intent(in) :: self
      character(len=*), intent(in) :: object, name
      character(len=:), allocatable, intent(out) :: text
      type(error_type), allocatable, intent(out) :: error
      type(c_ptr), allocatable, target :: pointers(:)
      type(c_ptr) :: place
      integer(hid_t) :: owner, attribute, type, stored
      integer(hsize_t) :: n
      logical :: variable
      integer :: status, i
      text = ''
      variable = .false.
      attribute = -1
      call h5oopen_f(self%id, object, owner, status)
      if (status == 0) call h5aopen_f(owner, name, attribute, status)
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
      call h5oclose_f(owner, status)
   end subroutine get_text_attribute

   !> Get the value of an integer attribute.
   subroutine get_integer_attribute(self, object, name, value, error)
      class(hdf5_attributes_type), intent(in) :: self
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

   !> Get values of an attribute that is a list of integers.
   subroutine get_integers_attribute(self, object, name, values, error)
      class(hdf5_attributes_type), intent(in) :: self
      character(len=*), intent(in) :: object, name
      integer, allocatable, intent(out) :: values(:)
      type(error_type), allocatable, intent(out) :: error
      integer(hid_t) :: owner, attribute
      integer(hsize_t) :: n
      integer :: status, ignored
      attribute = -1
      n = 0
      call h5oopen_f(self%id, object, owner, status)
      if (status == 0) call h5aopen_f(owner, name, attribute, status)
      if (status == 0) call count_values(attribute, n, status)
      allocate (values(n))
      if (status == 0 .and. n > 0) call h5aread_f(attribute, H5T_NATIVE_INTEGER, values, [n], status)
      if (status /= 0) call self%fail('cannot read integer attribute '//name, error)
      call h5aclose_f(attribute, ignored)
      call h5oclose_f(owner, ignored)
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

end module rockdda_io_hdf5_attributes
