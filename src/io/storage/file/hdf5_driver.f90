! SPDX-License-Identifier: MIT
!> Results files that are written in commits: all changes since the last commit reach the file, or none; a reader finds
!> every row of the last commit at any moment; after a kill the file can be returned to the state of a checkpoint. The
!> HDF5 file driver in hdf5_driver_shim.c does the work and describes it. Used by rockdda_io_hdf5_adapter.
module rockdda_io_hdf5_driver
   use, intrinsic :: iso_c_binding, only : c_char, c_int, c_int64_t, c_null_char
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_io_output_lock, only : errno_text
   implicit none
   private
   public :: use_driver, use_driver_for_trial, walk, commit_pieces, sync_pieces, drop_pieces, begin_undo, &
      explain_errno, check_undo, roll_back, undo_path, digest_length

   !> Bytes of a digest (SHA-256).
   integer, parameter :: digest_length = 32

   interface

      !> Set access properties with which files are written in commits; these functions return 0, or < 0 for a failure.
      integer(c_int) function use_driver(access) bind(C, name='rockdda_pieces_set')
         import :: c_int, c_int64_t
         integer(c_int64_t), value :: access    !! property list
      end function use_driver

      !> Files opened with these access properties show their state at the checkpoint with this digest, or after the
      !> preceding trial, and what is written to them remains in memory.
      integer(c_int) function use_driver_for_trial(access, undo, digest, again) bind(C, name='rockdda_pieces_set_trial')
         import :: c_char, c_int, c_int64_t
         integer(c_int64_t), value :: access
         character(kind=c_char), intent(in) :: undo(*), digest(*)
         integer(c_int), value :: again
      end function use_driver_for_trial

      !> Open every object and attribute of a file.
      integer(c_int) function walk(file) bind(C, name='rockdda_pieces_walk')
         import :: c_int, c_int64_t
         integer(c_int64_t), value :: file      !! of the library
      end function walk

      !> Write all waiting changes, or none. The library was flushed before. This function and those below return 0, or
      !> the number of an error.
      integer(c_int) function commit_pieces(file) bind(C, name='rockdda_pieces_commit')
         import :: c_int, c_int64_t
         integer(c_int64_t), value :: file
      end function commit_pieces

      !> Wait until what was committed is on the disk.
      integer(c_int) function sync_pieces(file) bind(C, name='rockdda_pieces_sync')
         import :: c_int, c_int64_t
         integer(c_int64_t), value :: file
      end function sync_pieces

      !> Keep an undo file that leads back to the last commit, the state of the checkpoint with this digest.
      integer(c_int) function begin_undo(file, path, digest) bind(C, name='rockdda_pieces_keep_undo')
         import :: c_char, c_int, c_int64_t
         integer(c_int64_t), value :: file
         character(kind=c_char), intent(in) :: path(*), digest(*)
      end function begin_undo

      integer(c_int) function c_undo_is_whole(undo, digest, whole) bind(C, name='rockdda_undo_is_whole')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: undo(*), digest(*)
         integer(c_int), intent(out) :: whole
      end function c_undo_is_whole

      integer(c_int) function c_roll_back(results, undo, digest, done) bind(C, name='rockdda_undo_roll_back')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: results(*), undo(*), digest(*)
         integer(c_int), intent(out) :: done
      end function c_roll_back

      !> Discard all changes from now on, also those at the close.
      subroutine drop_pieces(file) bind(C, name='rockdda_pieces_abandon')
         import :: c_int64_t
         integer(c_int64_t), value :: file
      end subroutine drop_pieces

   end interface

contains

   !> Path of the undo file of a results file.
   pure function undo_path(results) result(path)
      character(len=*), intent(in) :: results
      character(len=:), allocatable :: path
      path = results//'.undo'
   end function undo_path

   !> Report (code input) that the undo file of that checkpoint is damaged or cut off.
   subroutine check_undo(results, digest, error)
      character(len=*), intent(in) :: results
      character(len=digest_length), intent(in) :: digest
      type(error_type), allocatable, intent(out) :: error
      integer(c_int) :: status, whole
      status = c_undo_is_whole(undo_path(results)//c_null_char, digest, whole)
      if (status /= 0) then
         call make_error(error, error_code%input, undo_path(results)//': error: '//errno_text(status))
      else if (whole == 0) then
         call make_error(error, error_code%input, undo_path(results)// &
                         ': error: this file is damaged; without it the results cannot be returned to the checkpoint')
      end if
   end subroutine check_undo

   !> Return a closed results file to the state of the checkpoint with this digest. Without an undo file of that
   !> checkpoint nothing is changed.
   subroutine roll_back(results, digest, done, error)
      character(len=*), intent(in) :: results
      character(len=digest_length), intent(in) :: digest
      logical, intent(out) :: done          !! an undo file was applied
      type(error_type), allocatable, intent(out) :: error
      integer(c_int) :: status, was_there
      status = c_roll_back(results//c_null_char, undo_path(results)//c_null_char, digest, was_there)
      done = was_there /= 0
      call explain_errno(status, results, error)
   end subroutine roll_back

   !> Turn an error number into an error.
   subroutine explain_errno(status, path, error)
      integer(c_int), intent(in) :: status
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(out) :: error
      if (status /= 0) call make_error(error, error_code%output, path//': '//errno_text(status))
   end subroutine explain_errno

end module rockdda_io_hdf5_driver
