! SPDX-License-Identifier: MIT
!> SHA-256 of texts and files; checksums of growing lists.
module rockdda_io_digest
   use, intrinsic :: iso_c_binding, only : c_char, c_double, c_int, c_int64_t, c_long_long, c_null_char
   use rockdda_base_kinds, only : wp, i8
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_io_hdf5_driver, only : digest_length
   use rockdda_io_output_lock, only : errno_text
   implicit none
   private
   public :: digest_of_text, digest_of_file, hexadecimal, digest_length, fold

   !> The checksum of a list after more values; it begins with 0.
   interface fold
      module procedure fold_reals, fold_integers
   end interface fold

   interface
      subroutine c_bytes(bytes, n, portable, digest) bind(C, name='rockdda_sha256_bytes')
         import :: c_char, c_int, c_long_long
         character(kind=c_char), intent(in) :: bytes(*)
         integer(c_long_long), value :: n
         integer(c_int), value :: portable
         character(kind=c_char), intent(inout) :: digest(*)
      end subroutine c_bytes

      integer(c_int) function c_file(path, n, digest) bind(C, name='rockdda_sha256_file')
         import :: c_char, c_int, c_long_long
         character(kind=c_char), intent(in) :: path(*)
         integer(c_long_long), value :: n
         character(kind=c_char), intent(inout) :: digest(*)
      end function c_file

      pure integer(c_int64_t) function c_fold_reals(total, values, n) bind(C, name='rockdda_fold_reals')
         import :: c_double, c_int64_t, c_long_long
         integer(c_int64_t), value :: total
         real(c_double), intent(in) :: values(*)
         integer(c_long_long), value :: n
      end function c_fold_reals

      pure integer(c_int64_t) function c_fold_integers(total, values, n) bind(C, name='rockdda_fold_integers')
         import :: c_int, c_int64_t, c_long_long
         integer(c_int64_t), value :: total
         integer(c_int), intent(in) :: values(*)
         integer(c_long_long), value :: n
      end function c_fold_integers
   end interface

contains

   !> Digest of a text, by the processor's instructions for it where it has them.
   function digest_of_text(text, portable) result(digest)
      character(len=*), intent(in) :: text
      logical, intent(in), optional :: portable     !! without these instructions
      character(len=digest_length) :: digest
      integer(c_int) :: how
      digest = ''
      how = 0
      if (present(portable)) how = merge(1_c_int, 0_c_int, portable)
      call c_bytes(text, len(text, c_long_long), how, digest)
   end function digest_of_text

   !> Compute the digest of the first n bytes of a file, of all of it when n < 0.
   subroutine digest_of_file(path, n, digest, error)
      character(len=*), intent(in) :: path
      integer(i8), intent(in) :: n
      character(len=digest_length), intent(out) :: digest
      type(error_type), allocatable, intent(out) :: error
      integer(c_int) :: status
      digest = ''
      status = c_file(path//c_null_char, int(n, c_long_long), digest)
      if (status /= 0) call make_error(error, error_code%input, path//': '//errno_text(status))
   end subroutine digest_of_file

   !> Add reals, bit by bit.
   pure integer(i8) function fold_reals(total, values)
      integer(i8), intent(in) :: total
      real(wp), intent(in) :: values(:)
      fold_reals = int(c_fold_reals(int(total, c_int64_t), values, size(values, kind=c_long_long)), i8)
   end function fold_reals

   !> Add integers.
   pure integer(i8) function fold_integers(total, values)
      integer(i8), intent(in) :: total
      integer, intent(in) :: values(:)
      fold_integers = int(c_fold_integers(int(total, c_int64_t), values, size(values, kind=c_long_long)), i8)
   end function fold_integers

   !> Digits 0 … f of bytes.
   pure function hexadecimal(bytes) result(text)
      character(len=*), intent(in) :: bytes
      character(len=2*len(bytes)) :: text
      character(len=*), parameter :: digits = '0123456789abcdef'
      integer :: i, value
      do i = 1, len(bytes)
         value = ichar(bytes(i:i))
         text(2*i - 1:2*i - 1) = digits(value/16 + 1:value/16 + 1)
         text(2*i:2*i) = digits(mod(value, 16) + 1:mod(value, 16) + 1)
      end do
   end function hexadecimal

end module rockdda_io_digest
