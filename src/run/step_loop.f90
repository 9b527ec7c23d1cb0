! SPDX-License-Identifier: MIT
!> The loop over the steps of a run, the same for the program and the Python package.
!>
!> The caller supplies an observer, an extension of `step_observer_type`, with the reason to stop the run and what to
!> do before and after a step is written; the defaults do nothing.
!>
!> The results are flushed in a thread of its own, while the next step is computed:
!>
!>     call flush%begin(results)      after the rows of a step were added, when there is much to write
!>        …                           no use of the results
!>     call flush%finish(error)       before the next use
module rockdda_run_step_loop
   use, intrinsic :: iso_c_binding, only : c_associated, c_f_pointer, c_funloc, c_funptr, c_loc, c_null_ptr, c_ptr
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type, error_code
   use rockdda_base_strings, only : first_line
   use rockdda_io_timestamp, only : wall_seconds
   use rockdda_io_results, only : results_type
   use rockdda_run_model_run, only : run_type
   use rockdda_run_hdf5_lock, only : lock_hdf5, unlock_hdf5
   implicit none
   private
   public :: background_flush_type, step_observer_type, advance_run

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

   type :: step_observer_type
   contains
      procedure :: stop_reason
      procedure :: begin_writing
      procedure :: end_step
   end type step_observer_type

contains

   !> Compute steps until the run reaches its end, the observer has a reason to stop, `max_steps` are accepted, or
   !> `seconds` have passed and at least one step is accepted. Much output is written while the next step is computed. A
   !> reason to stop and a failure become `run%reason`; an error is a failure of the computation or of the output.
   subroutine advance_run(run, observer, error, max_steps, seconds, n_done)
      type(run_type), intent(inout), target :: run
      class(step_observer_type), intent(inout) :: observer
      type(error_type), allocatable, intent(out) :: error
      integer, intent(in), optional :: max_steps
      real(wp), intent(in), optional :: seconds         !! on the wall clock
      integer, intent(out), optional :: n_done          !! accepted steps
      type(background_flush_type), target :: flush
      type(error_type), allocatable :: late_error
      character(len=:), allocatable :: reason
      real(wp) :: deadline
      integer :: n, n_max
      n_max = huge(1)
      if (present(max_steps)) n_max = max_steps
      deadline = huge(1.0_wp)
      if (present(seconds)) deadline = wall_seconds() + seconds
      n = 0
      do while (n < n_max .and. .not. run%sim%is_finished())
         reason = observer%stop_reason()
         if (len(reason) == 0) then
            call run%sim%advance(error)
            if (allocated(error)) then
               reason = 'failed: '//first_line(error%message)
            else if (run%sim%interrupted) then
               ! the unfinished step is discarded
               reason = observer%stop_reason()
               if (len(reason) == 0) exit
            end if
         end if
         if (len(reason) == 0) then
            call observer%begin_writing()
            call flush%finish(error)
            if (.not. allocated(error)) call run%write_step(error)
            if (allocated(error)) reason = reason_of(error)
            if (len(reason) == 0) n = n + 1
            call observer%end_step(run, len(reason) == 0)
            call run%threads%renew()
            if (len(reason) == 0) then
               if (run%has_much_to_flush()) call flush%begin(run%results)
            end if
         end if
         if (len(reason) > 0) then
            run%reason = reason
            exit
         end if
         if (wall_seconds() >= deadline) exit
      end do
      call flush%finish(late_error)
      if (allocated(late_error) .and. .not. allocated(error)) then
         run%reason = reason_of(late_error)
         call move_alloc(late_error, error)
      end if
      if (present(n_done)) n_done = n
   end subroutine advance_run

   !> The reason for the end of a run that an error is.
   pure function reason_of(error) result(reason)
      type(error_type), intent(in) :: error
      character(len=:), allocatable :: reason
      reason = trim(merge('failed', 'output', error%code == error_code%computation))//': '//first_line(error%message)
   end function reason_of

   !> The reason to stop before the next step, for the attribute `exit_reason` of the results; '' to continue.
   function stop_reason(self) result(text)
      class(step_observer_type), intent(in) :: self
      character(len=:), allocatable :: text
      text = ''
   end function stop_reason

   !> Called before the rows of an accepted step are written.
   subroutine begin_writing(self)
      class(step_observer_type), intent(inout) :: self
   end subroutine begin_writing

   !> Called after the rows of a step are written, or could not be written.
   subroutine end_step(self, run, accepted)
      class(step_observer_type), intent(inout) :: self
      type(run_type), intent(in) :: run
      logical, intent(in) :: accepted          !! false: the run ends with an error
   end subroutine end_step

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

end module rockdda_run_step_loop
