! SPDX-License-Identifier: MIT
!> Fortran side of a Python object: a model and, once it is started, a run.
!>
!> The flat layer (api.f90, values.f90) passes addresses of sessions to Python as opaque integers. Each session belongs
!> to one Python object, which uses it from one thread at a time; different sessions do not share anything.
module rockdda_python_session
!$ use omp_lib, only : omp_get_max_threads, omp_set_num_threads
   use, intrinsic :: iso_c_binding, only : c_int64_t, c_intptr_t, c_ptr, c_loc, c_f_pointer
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type, error_code
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_base_strings, only : to_string
   use rockdda_contact_view, only : contact_view_type
   use rockdda_lines_generate, only : generate_lines
   use rockdda_lines_report, only : lines_report_type
   use rockdda_lines_statistics, only : statistics_type
   use rockdda_model_options, only : is_set
   use rockdda_io_source, only : source_type
   use rockdda_io_statistics_file, only : read_statistics_source
   use rockdda_io_timestamp, only : wall_seconds
   use rockdda_run_input, only : model_input_type, run_request_type
   use rockdda_run_model_run, only : run_type
   use rockdda_run_step_loop, only : step_observer_type, advance_run
   use rockdda_run_stop_request, only : deadline_type
   implicit none
   private
   public :: session_type, new_session, get_session, drop_session, messages_text

   type :: session_type
      type(run_request_type) :: request
      type(model_input_type) :: input
      type(diagnostics_type) :: messages
      type(error_type), allocatable :: error      !! the last failure
      type(lines_report_type) :: drawn            !! of joint statistics
      real(wp), allocatable :: motion(:, :)       !! (2, n) time and values of a record
      real(wp) :: motion_unit = 0                 !! of its values [m/s^2], 0: not named
      type(source_type) :: table                  !! with plain separators
      type(run_type) :: run
      logical :: is_started = .false.             !! the simulation has a state
      type(contact_view_type) :: contacts         !! of the last step
      character(len=:), allocatable :: text       !! for `get_text`
   contains
      procedure :: status
      procedure :: draw
      procedure :: start
      procedure :: advance
      procedure :: finish
   end type session_type

   !> Collects the warnings of a run.
   type, extends(step_observer_type) :: message_observer_type
      type(diagnostics_type), pointer :: messages => null()
   contains
      procedure :: end_step
   end type message_observer_type

contains

   !> A new session and its handle.
   subroutine new_session(handle)
      integer(c_int64_t), intent(out) :: handle
      type(session_type), pointer :: session
      allocate (session)
      session%request%output = ''
      session%request%config = ''
      session%request%solver = ''
      session%text = ''
      handle = int(transfer(c_loc(session), 0_c_intptr_t), c_int64_t)
   end subroutine new_session

   !> The session of a handle.
   subroutine get_session(handle, session)
      integer(c_int64_t), intent(in) :: handle
      type(session_type), pointer, intent(out) :: session
      type(c_ptr) :: address
      address = transfer(int(handle, c_intptr_t), address)
      call c_f_pointer(address, session)
   end subroutine get_session

   !> Draw the lines that joint statistics give.
   subroutine draw(self, source, seed)
      class(session_type), intent(inout) :: self
      type(source_type), intent(in) :: source
      integer, intent(in) :: seed                 !! -1: that of the text
      type(statistics_type) :: statistics
      if (self%status() == 0) call read_statistics_source(source, statistics, self%messages)
      if (self%status() /= 0) return
      if (seed >= 0) statistics%seed = seed
      call generate_lines(statistics, self%input%geometry, self%drawn, self%messages)
   end subroutine draw

   !> Delete a session. Open results are closed.
   subroutine drop_session(handle)
      integer(c_int64_t), intent(in) :: handle
      type(session_type), pointer :: session
      call get_session(handle, session)
      if (session%run%is_open) call session%finish('closed')
      deallocate (session)
   end subroutine drop_session

   !> Error code of the last failure, 0: none.
   pure integer function status(self)
      class(session_type), intent(in) :: self
      status = 0
      if (self%messages%has_errors()) status = error_code%input
      if (allocated(self%error)) status = self%error%code
   end function status

   !> Set the state at time 0, and open the results if they are wanted.
   subroutine start(self, write_results)
      class(session_type), intent(inout) :: self
      logical, intent(in) :: write_results
      type(deadline_type) :: limit
      integer :: before
      call keep_threads(before)
      call self%run%threads%start(self%input%blocks%n_blocks, self%input%options%threads)
      self%run%start = wall_seconds()
      self%run%reason = 'finished'
      if (write_results) then
         call self%run%prepare(self%request, self%input, self%error)
         if (.not. allocated(self%error)) &
            call self%run%open(self%request, self%input, self%messages, self%error)
      else
         call self%run%sim%init(self%input%blocks, self%input%parameters, self%error)
      end if
      call restore_threads(before)
      self%is_started = .not. allocated(self%error)
      self%run%strict = self%input%options%strict
      if (self%is_started .and. is_set(self%request%max_wall)) then
         limit%deadline = self%run%start + self%request%max_wall
         call self%run%sim%set_interruption(limit)
      end if
      if (self%is_started) call self%run%sim%view(self%contacts)
   end subroutine start

   !> Compute steps until their number or the wall-clock time is reached (at least one step), or the run is
   !> finished. On failure the results are closed; they keep the last accepted step.
   subroutine advance(self, n_steps, seconds, n_done)
      class(session_type), intent(inout), target :: self
      integer, intent(in) :: n_steps
      real(wp), intent(in) :: seconds
      integer, intent(out) :: n_done
      type(message_observer_type) :: observer
      integer :: before
      observer%messages => self%messages
      call keep_threads(before)
      call self%run%threads%apply()
      call advance_run(self%run, observer, self%error, n_steps, seconds, n_done)
      call restore_threads(before)
      call self%run%sim%view(self%contacts)
      if (allocated(self%error) .and. self%run%is_open) call self%run%close(self%error)
   end subroutine advance

   !> Add the warnings of a step to the messages of the session.
   subroutine end_step(self, run, accepted)
      class(message_observer_type), intent(inout) :: self
      type(run_type), intent(in) :: run
      logical, intent(in) :: accepted
      if (accepted .and. allocated(run%warning)) call self%messages%add(severity%warning, run%warning)
   end subroutine end_step

   !> Close the results; `reason` is stored unless the run has reached its end.
   subroutine finish(self, reason)
      class(session_type), intent(inout) :: self
      character(len=*), intent(in) :: reason
      if (.not. self%run%is_open) return
      if (.not. self%run%sim%is_finished()) self%run%reason = reason
      call self%run%close(self%error)
      if (allocated(self%run%warning)) call self%messages%add(severity%warning, self%run%warning)
   end subroutine finish

   !> The number of threads of this thread of Python, which a session changes while it computes.
   subroutine keep_threads(before)
      integer, intent(out) :: before
      before = 0
!$    before = omp_get_max_threads()
   end subroutine keep_threads

   !> Restore the number of threads.
   subroutine restore_threads(before)
      integer, intent(in) :: before
!$    if (before > 0) call omp_set_num_threads(before)
   end subroutine restore_threads

   !> All messages in a form for Python: records that end with character 30 of fields that end with character 31:
   !> severity, file, line, column, message, the message as a compiler prints it.
   function messages_text(messages) result(text)
      type(diagnostics_type), intent(in) :: messages
      character(len=:), allocatable :: text
      character(len=1), parameter :: field = achar(31), record = achar(30)
      character(len=:), allocatable :: file
      integer :: i
      text = ''
      do i = 1, messages%n
         associate (m => messages%items(i))
            file = ''
            if (allocated(m%origin%file)) file = m%origin%file
            text = text//to_string(m%severity)//field//file//field//to_string(m%origin%line)//field// &
                   to_string(m%origin%column)//field//m%message//field//m%format()//field//record
         end associate
      end do
   end function messages_text

end module rockdda_python_session
