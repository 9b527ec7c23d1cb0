! SPDX-License-Identifier: MIT
!> A flush of the results in a thread of its own, while the next step is computed.
!>
!>     call flush%begin(results)      after the rows of a step were added, when there is much to write
!>        …                           no use of the results
!>     call flush%finish(error)       before the next use
module rockdda_run_background_flush
   use, intrinsic :: iso_c_binding, only : c_associated, c_f_pointer, c_funloc, c_funptr, c_loc, c_null_ptr, c_ptr
   use rockdda_base_error, only : error_type
   use rockdda_io_results, only : results_type
   use rockdda_run_hdf5_lock, only : lock_hdf5, unlock_hdf5
   implicit none
   private
   public :: background_flush_type

   !> What the thread works on.
   type :: task_type
      type(results_type), pointer :: results => null()
      type(error_type), allocatable :: error
   end type task_type

   type :: background_flush_type
      type(task_type), private :: task
      type(c_ptr), private :: thread = c_null_ptr
   contains
      procedure :: begin
      procedure :: finish
   end type background_flush_type

   interface
      type(c_ptr) function c_begin(work, argument) bind(C, name='rockdda_run_begin_beside')
         import :: c_funptr, c_ptr
         type(c_funptr), value :: work
         type(c_ptr), value :: argument
      end function c_begin

      subroutine c_finish(thread) bind(C, name='rockdda_run_end_beside')
         import :: c_ptr
         type(c_ptr), value :: thread
      end subroutine c_finish
   end interface

contains

   !> Begin to write all waiting rows. Without a thread they are written before the return. A failure is returned by
   !> `finish`. Until then neither `self` nor `results` may be used or moved.
   subroutine begin(self, results)
      class(background_flush_type), intent(inout), target :: self
      type(results_type), intent(inout), target :: results
      self%task%results => results
      self%thread = c_begin(c_funloc(flush_in_thread), c_loc(self%task))
      if (.not. c_associated(self%thread)) call flush_rows(self%task)
   end subroutine begin

   !> Wait until the rows are written, and return the failure if they could not be.
   subroutine finish(self, error)
      class(background_flush_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      if (c_associated(self%thread)) call c_finish(self%thread)
      self%thread = c_null_ptr
      self%task%results => null()
      if (allocated(self%task%error)) call move_alloc(self%task%error, error)
   end subroutine finish

   !> The work of the thread.
   subroutine flush_in_thread(argument) bind(C, name='rockdda_run_flush_in_thread')
      type(c_ptr), value :: argument
      type(task_type), pointer :: task
      call c_f_pointer(argument, task)
      call flush_rows(task)
   end subroutine flush_in_thread

   !> Write the rows. HDF5 is used by one thread at a time.
   subroutine flush_rows(task)
      type(task_type), intent(inout) :: task
      call lock_hdf5()
      call task%results%flush(task%error)
      call unlock_hdf5()
   end subroutine flush_rows

end module rockdda_run_background_flush
