! SPDX-License-Identifier: MIT
!> A run with its results: what the program and the Python package have in common.
!>
!>     call run%prepare(request, input, error)           nothing is written
!>     call run%open(request, input, messages, error)    results and log, with the start as first frame
!>     do while (.not. run%sim%is_finished())
!>        call run%sim%advance(error)
!>        call run%keep(error)                           what is kept of the step
!>     end do
!>     call run%close(error)                             the last frame, and how it ended
!>
!> Several runs may go on at a time in threads of one process: HDF5 is then used by one after the other.
module rockdda_driver_run
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_diagnostics, only : diagnostics_type
   use rockdda_base_strings, only : to_string
   use rockdda_base_version, only : version, build_description
   use rockdda_model_options, only : is_set
   use rockdda_stepping_simulation, only : simulation_type
   use rockdda_io_log, only : log_type, log_path
   use rockdda_io_output_lock, only : is_same_file
   use rockdda_io_posix, only : get_path_kind, path_kind
   use rockdda_io_results, only : results_type, results_header_type
   use rockdda_io_timestamp, only : utc_now, wall_seconds
   use rockdda_driver_frame_plan, only : frame_plan_type, new_frame_plan
   use rockdda_driver_model_input, only : model_input_type, run_request_type, stem_of
   implicit none
   private
   public :: run_type, first_line

   !> The results are flushed at least this often [s], whatever the user says.
   real(wp), parameter :: longest_flush_interval = 2
   !> The log has about this many lines for steps.
   integer, parameter :: log_lines = 1000

   type :: run_type
      type(simulation_type) :: sim
      character(len=:), allocatable :: output, log_file
      character(len=:), allocatable :: reason      !! 'finished' or why it stopped
      integer :: n_frames = 0                      !! in the file
      real(wp) :: start = 0                        !! wall clock
      logical :: is_open = .false.                 !! results are being written
      type(results_type), private :: results
      type(log_type), private :: log
      type(frame_plan_type), private :: plan
      logical, private :: write_frames = .true.
      integer, private :: last_frame = -1, last_logged = -1 !! steps
      character(len=:), allocatable, private :: last_choice !! of the automatic solver, as logged
      real(wp), allocatable, private :: force(:, :)         !! scratch: contact forces
   contains
      procedure :: prepare
      procedure :: open => open_run
      procedure :: keep
      procedure :: close => close_run
      procedure :: fraction_done
      procedure, private :: begin_files, write_log_head, keep_step, log_step, log_choice, save_frame, end_files
   end type run_type

   interface
      subroutine take_turn() bind(C, name='rockdda_driver_take_turn')
      end subroutine take_turn
      subroutine end_turn() bind(C, name='rockdda_driver_end_turn')
      end subroutine end_turn
   end interface

contains

   !> Choose where the results go and put the simulation into its state at time 0. Nothing is written.
   subroutine prepare(self, request, input, error)
      class(run_type), intent(inout) :: self
      class(run_request_type), intent(in) :: request
      type(model_input_type), intent(in) :: input
      type(error_type), allocatable, intent(out) :: error
      self%reason = 'finished'
      call choose_output(request, input, self%output, error)
      if (.not. allocated(error)) call self%sim%init(input%blocks, input%parameters, error)
   end subroutine prepare

   !> Where the results go: the command line, the options, or the analysis file's stem; never over an input file,
   !> and over an older result only by force.
   subroutine choose_output(request, input, output, error)
      class(run_request_type), intent(in) :: request
      type(model_input_type), intent(in) :: input
      character(len=:), allocatable, intent(out) :: output
      type(error_type), allocatable, intent(out) :: error
      output = stem_of(input%analysis_file)//'.h5'
      if (allocated(input%options%output_file)) then
         if (len_trim(input%options%output_file) > 0) output = trim(input%options%output_file)
      end if
      if (.not. input%in_memory) call keep_apart(output)
      if (.not. allocated(error) .and. .not. input%in_memory) call keep_apart(log_path(output))
      if (allocated(error)) return
      if (request%force) return
      if (get_path_kind(output) == path_kind%file) &
         call make_error(error, error_code%input, output//': the file exists; use --force to overwrite it')

   contains

      !> An output is no input.
      subroutine keep_apart(path)
         character(len=*), intent(in) :: path
         logical :: same(3)
         same(1) = is_same_file(path, input%model_file)
         same(2) = is_same_file(path, input%analysis_file)
         same(3) = is_same_file(path, input%config_file)
         if (any(same)) call make_error(error, error_code%input, path//': the output would overwrite an input file')
      end subroutine keep_apart

   end subroutine choose_output

   !> Create results and log with everything known at the start, and the first frame.
   subroutine open_run(self, request, input, messages, error)
      class(run_type), intent(inout) :: self
      class(run_request_type), intent(in) :: request
      type(model_input_type), intent(in) :: input
      type(diagnostics_type), intent(in) :: messages
      type(error_type), allocatable, intent(out) :: error
      call take_turn()
      call self%begin_files(request, input, messages, error)
      call end_turn()
      self%is_open = .not. allocated(error)
   end subroutine open_run

   !> What is kept of an accepted step: its row of the history, and what is due of frames, log and flushes.
   subroutine keep(self, error)
      class(run_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      call take_turn()
      call self%keep_step(error)
      call end_turn()
   end subroutine keep

   !> Write the last frame, say how the run ended (`reason`), close the files. The first failure, of the run so far
   !> or of the output, is the one to report; a failure of the output becomes the reason.
   subroutine close_run(self, error)
      class(run_type), intent(inout) :: self
      type(error_type), allocatable, intent(inout) :: error
      call take_turn()
      call self%end_files(error)
      call end_turn()
      self%is_open = .false.
   end subroutine close_run

   !> Begin results and log.
   subroutine begin_files(self, request, input, messages, error)
      class(run_type), intent(inout) :: self
      class(run_request_type), intent(in) :: request
      type(model_input_type), intent(in) :: input
      type(diagnostics_type), intent(in) :: messages
      type(error_type), allocatable, intent(out) :: error
      type(results_header_type) :: header
      header%title = input%parameters%title
      header%program_version = version
      header%created = utc_now()
      header%geometry = input%model_text
      header%analysis = input%analysis_text
      header%config = input%config_text
      header%frames = input%options%write_frames
      header%contacts = input%options%write_contacts
      header%flush_interval = longest_flush_interval
      if (is_set(input%options%checkpoint_every)) &
         header%flush_interval = min(longest_flush_interval, input%options%checkpoint_every)
      call self%results%create(self%output, request%force, header, input%blocks, self%sim%state, error)
      if (allocated(error)) return
      self%log_file = log_path(self%output)
      call self%log%open(self%log_file, error)
      if (.not. allocated(error)) call self%write_log_head(input, messages, header, error)
      self%write_frames = header%frames
      self%plan = new_frame_plan(input%options, input%parameters)
      if (.not. allocated(error)) call self%save_frame(error)
      if (.not. allocated(error)) call self%results%flush(error)
   end subroutine begin_files

   !> Head of the log.
   subroutine write_log_head(self, input, messages, header, error)
      class(run_type), intent(inout) :: self
      type(model_input_type), intent(in) :: input
      type(diagnostics_type), intent(in) :: messages
      type(results_header_type), intent(in) :: header
      type(error_type), allocatable, intent(out) :: error
      call self%log%put(build_description(), error)
      if (.not. allocated(error)) call self%log%put('title: '//header%title, error)
      if (.not. allocated(error)) call self%log%put('created: '//header%created, error)
      if (.not. allocated(error)) call self%log%put('geometry or blocks: '//input%model_file, error)
      if (.not. allocated(error)) call self%log%put('analysis: '//input%analysis_file, error)
      if (.not. allocated(error) .and. len(input%config_file) > 0) &
         call self%log%put('options: '//input%config_file, error)
      if (.not. allocated(error)) call self%log%put('results: '//self%output, error)
      if (.not. allocated(error)) call self%log%put_model(input%blocks, error)
      if (.not. allocated(error)) call self%log%put_messages(messages, error)
      if (.not. allocated(error)) call self%log%put_parameters(input%parameters, error)
      if (.not. allocated(error)) call self%log%put_columns(error)
      if (.not. allocated(error)) call self%log%flush(error)
   end subroutine write_log_head

   !> What is kept of an accepted step.
   subroutine keep_step(self, error)
      class(run_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      integer :: every
      call self%results%append_history(self%sim%record, error)
      if (allocated(error)) return
      if (self%plan%is_due(self%sim%state%step, self%sim%state%time)) call self%save_frame(error)
      if (allocated(error)) return
      every = 1
      if (self%sim%parameters%n_steps < huge(1)) every = max(1, self%sim%parameters%n_steps/log_lines)
      if (self%sim%state%step == 1 .or. mod(self%sim%state%step, every) == 0 .or. &
          self%last_frame == self%sim%state%step .or. self%sim%record%attempts > 1) call self%log_step(error)
      if (.not. allocated(error)) call self%results%flush_if_due(error)
   end subroutine keep_step

   !> One line in the log.
   subroutine log_step(self, error)
      class(run_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      call self%log%put_step(self%sim%record, self%sim%parameters, error)
      if (.not. allocated(error)) call self%log_choice(error)
      self%last_logged = self%sim%state%step
   end subroutine log_step

   !> A line in the log when the automatic solver has gone over to another one.
   subroutine log_choice(self, error)
      class(run_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: name
      if (.not. allocated(self%sim%solver%choice)) return
      name = self%sim%solver%choice(1:scan(self%sim%solver%choice//' ', ' :') - 1)
      if (allocated(self%last_choice)) then
         if (self%last_choice == name) return
      end if
      call self%log%put('# solver from here on: '//self%sim%solver%choice, error)
      self%last_choice = name
   end subroutine log_choice

   !> One frame.
   subroutine save_frame(self, error)
      class(run_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      self%last_frame = self%sim%state%step
      if (.not. self%write_frames) return
      call self%sim%contact_forces(self%force)
      call self%results%append_frame(self%sim%state, self%sim%contacts, self%force, error)
      self%n_frames = self%n_frames + 1
   end subroutine save_frame

   !> The last frame, the last words, the end of the files.
   subroutine end_files(self, error)
      class(run_type), intent(inout) :: self
      type(error_type), allocatable, intent(inout) :: error   !! of the run so far
      type(error_type), allocatable :: output_error
      if (self%last_frame /= self%sim%state%step) call self%save_frame(output_error)
      if (.not. allocated(output_error) .and. self%last_logged /= self%sim%state%step .and. &
          self%sim%state%step > 0) call self%log_step(output_error)
      call keep_first(output_error)
      call self%results%close(self%reason == 'finished', self%reason, output_error)
      call keep_first(output_error)
      call self%log%put('end: '//self%reason//' after '//to_string(self%sim%state%step)//' steps at time '// &
                        to_string(self%sim%state%time, 10)//', '//to_string(wall_seconds() - self%start, 3)// &
                        ' s on the wall clock', output_error)
      call keep_first(output_error)
      call self%log%close(output_error)
      call keep_first(output_error)

   contains

      !> The first failure is the one to report.
      subroutine keep_first(other)
         type(error_type), allocatable, intent(inout) :: other
         if (allocated(other) .and. .not. allocated(error)) then
            self%reason = 'output: '//first_line(other%message)
            call move_alloc(other, error)
         end if
         if (allocated(other)) deallocate (other)
      end subroutine keep_first

   end subroutine end_files

   !> Share of the run that is done.
   pure real(wp) function fraction_done(self)
      class(run_type), intent(in) :: self
      fraction_done = 0
      if (self%sim%parameters%n_steps > 0) &
         fraction_done = real(self%sim%state%step, wp)/real(self%sim%parameters%n_steps, wp)
      if (self%sim%parameters%t_end > 0) &
         fraction_done = max(fraction_done, self%sim%state%time/self%sim%parameters%t_end)
   end function fraction_done

   !> Text up to its first line end.
   pure function first_line(text) result(line)
      character(len=*), intent(in) :: text
      character(len=:), allocatable :: line
      integer :: n
      n = index(text, new_line('a'))
      if (n == 0) n = len(text) + 1
      line = text(1:n - 1)
   end function first_line

end module rockdda_driver_run
