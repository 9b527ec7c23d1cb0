! SPDX-License-Identifier: MIT
!> rockdda run: blocks move in time.
module rockdda_app_command_run
!$ use omp_lib, only : omp_set_num_threads
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_base_strings, only : to_string
   use rockdda_base_version, only : version, build_description
   use rockdda_model_options, only : is_set
   use rockdda_model_state, only : energy_names, n_energies
   use rockdda_stepping_simulation, only : simulation_type
   use rockdda_io_log, only : log_type, log_path
   use rockdda_io_output_lock, only : is_same_file
   use rockdda_io_posix, only : get_path_kind, path_kind
   use rockdda_io_results, only : results_type, results_header_type
   use rockdda_io_timestamp, only : utc_now
   use rockdda_app_arguments, only : command_line_type
   use rockdda_app_frame_plan, only : frame_plan_type, new_frame_plan
   use rockdda_app_json, only : json_type
   use rockdda_app_model_input, only : model_input_type, find_files, read_model, stem_of
   use rockdda_app_process, only : say, complain, watch_signals, seen_signal, set_writing, wall_seconds
   use rockdda_app_progress, only : progress_type
   use rockdda_app_report, only : show_messages, show_error, begin_json, end_json, report_failure
   implicit none
   private
   public :: run_run

   !> The results are flushed at least this often [s], whatever the user says.
   real(wp), parameter :: longest_flush_interval = 2
   !> The log has about this many lines for steps.
   integer, parameter :: log_lines = 1000

   !> A run on its way.
   type :: running_type
      character(len=:), allocatable :: output, log_file
      type(simulation_type) :: sim
      type(results_type) :: results
      type(log_type) :: log
      type(frame_plan_type) :: plan
      type(progress_type) :: progress
      logical :: write_frames = .true.
      integer :: n_frames = 0                      !! in the file
      integer :: last_frame = -1, last_logged = -1 !! steps
      real(wp) :: start = 0                        !! wall clock
      character(len=:), allocatable :: reason      !! 'finished' or why it stopped
      real(wp), allocatable :: force(:, :)         !! scratch: contact forces
   end type running_type

contains

   !> Do the command; returns the exit code.
   subroutine run_run(line, exit_code)
      type(command_line_type), intent(in) :: line
      integer, intent(out) :: exit_code
      type(model_input_type) :: input
      type(diagnostics_type) :: messages
      type(error_type), allocatable :: error
      type(running_type) :: run

      run%start = wall_seconds()
      call find_files(line, input, messages, error)
      if (.not. allocated(error) .and. .not. messages%has_errors()) call read_model(line, input, messages, error)
      if (.not. allocated(error) .and. .not. messages%has_errors()) call choose_output(line, input, run%output, error)
      if (.not. allocated(error) .and. .not. messages%has_errors()) then
!$       if (is_set(input%options%threads)) call omp_set_num_threads(input%options%threads)
         call run%sim%init(input%blocks, input%parameters, error)
      end if
      ! nothing has been written so far, and nothing is when the input is bad; from here on a signal ends the run in
      ! order
      call watch_signals()
      if (.not. allocated(error) .and. .not. messages%has_errors()) call begin_output(line, input, messages, run, error)
      if (allocated(error) .or. messages%has_errors()) then
         call report_failure(line, messages, error, exit_code)
         return
      end if
      if (.not. line%quiet) call show_messages(messages, severity%warning)
      call run%progress%begin(line%quiet)
      call step_until_done(input, run, error)
      call run%progress%finish()
      call end_run(line, run, messages, error, exit_code)
   end subroutine run_run

   !> Where the results go: the command line, the options, or the analysis file's stem; never over an input file,
   !> and over an older result only by force.
   subroutine choose_output(line, input, output, error)
      type(command_line_type), intent(in) :: line
      type(model_input_type), intent(in) :: input
      character(len=:), allocatable, intent(out) :: output
      type(error_type), allocatable, intent(out) :: error
      output = stem_of(input%analysis_file)//'.h5'
      if (allocated(input%options%output_file)) then
         if (len_trim(input%options%output_file) > 0) output = trim(input%options%output_file)
      end if
      call keep_apart(output)
      if (.not. allocated(error)) call keep_apart(log_path(output))
      if (allocated(error)) return
      if (line%force) return
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
   subroutine begin_output(line, input, messages, run, error)
      type(command_line_type), intent(in) :: line
      type(model_input_type), intent(in) :: input
      type(diagnostics_type), intent(in) :: messages
      type(running_type), intent(inout) :: run
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
      call run%results%create(run%output, line%force, header, input%blocks, run%sim%state, error)
      if (allocated(error)) return
      run%log_file = log_path(run%output)
      call run%log%open(run%log_file, error)
      if (.not. allocated(error)) call write_log_head(input, messages, header, run, error)
      run%write_frames = header%frames
      run%plan = new_frame_plan(input%options, input%parameters)
      if (.not. allocated(error)) call save_frame(run, error)
      if (.not. allocated(error)) call run%results%flush(error)
   end subroutine begin_output

   !> Head of the log.
   subroutine write_log_head(input, messages, header, run, error)
      type(model_input_type), intent(in) :: input
      type(diagnostics_type), intent(in) :: messages
      type(results_header_type), intent(in) :: header
      type(running_type), intent(inout) :: run
      type(error_type), allocatable, intent(out) :: error
      call run%log%put(build_description(), error)
      if (.not. allocated(error)) call run%log%put('title: '//header%title, error)
      if (.not. allocated(error)) call run%log%put('created: '//header%created, error)
      if (.not. allocated(error)) call run%log%put('geometry or blocks: '//input%model_file, error)
      if (.not. allocated(error)) call run%log%put('analysis: '//input%analysis_file, error)
      if (.not. allocated(error) .and. len(input%config_file) > 0) &
         call run%log%put('options: '//input%config_file, error)
      if (.not. allocated(error)) call run%log%put('results: '//run%output, error)
      if (.not. allocated(error)) call run%log%put_model(input%blocks, error)
      if (.not. allocated(error)) call run%log%put_messages(messages, error)
      if (.not. allocated(error)) call run%log%put_parameters(input%parameters, error)
      if (.not. allocated(error)) call run%log%put_columns(error)
      if (.not. allocated(error)) call run%log%flush(error)
   end subroutine write_log_head

   !> The loop over steps. On return `run%reason` says why it ended; an error is a failure of the computation or
   !> of the output.
   subroutine step_until_done(input, run, error)
      type(model_input_type), intent(in) :: input
      type(running_type), intent(inout) :: run
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: deadline
      deadline = huge(1.0_wp)
      if (is_set(input%options%max_wall)) deadline = run%start + input%options%max_wall
      run%reason = 'finished'
      do while (.not. run%sim%is_finished())
         if (len(seen_signal()) > 0) then
            run%reason = 'signal '//seen_signal()
            return
         end if
         if (wall_seconds() >= deadline) then
            run%reason = 'max-wall'
            return
         end if
         call run%sim%advance(error)
         if (allocated(error)) then
            run%reason = 'failed: '//first_line(error%message)
            return
         end if
         call set_writing(.true.)
         call save_step(run, error)
         call set_writing(.false.)
         if (allocated(error)) then
            run%reason = 'output: '//first_line(error%message)
            return
         end if
         call run%progress%update(fraction_done(run), 'step '//to_string(run%sim%state%step)//', time '// &
                                  to_string(run%sim%state%time))
      end do
   end subroutine step_until_done

   !> What is kept of an accepted step.
   subroutine save_step(run, error)
      type(running_type), intent(inout) :: run
      type(error_type), allocatable, intent(out) :: error
      integer :: every
      call run%results%append_history(run%sim%record, error)
      if (allocated(error)) return
      if (run%plan%is_due(run%sim%state%step, run%sim%state%time)) call save_frame(run, error)
      if (allocated(error)) return
      every = 1
      if (run%sim%parameters%n_steps < huge(1)) every = max(1, run%sim%parameters%n_steps/log_lines)
      if (run%sim%state%step == 1 .or. mod(run%sim%state%step, every) == 0 .or. &
          run%last_frame == run%sim%state%step .or. run%sim%record%attempts > 1) call log_step(run, error)
      if (.not. allocated(error)) call run%results%flush_if_due(error)
   end subroutine save_step

   !> One line in the log.
   subroutine log_step(run, error)
      type(running_type), intent(inout) :: run
      type(error_type), allocatable, intent(out) :: error
      call run%log%put_step(run%sim%record, run%sim%parameters, error)
      run%last_logged = run%sim%state%step
   end subroutine log_step

   !> One frame.
   subroutine save_frame(run, error)
      type(running_type), intent(inout) :: run
      type(error_type), allocatable, intent(out) :: error
      run%last_frame = run%sim%state%step
      if (.not. run%write_frames) return
      call run%sim%contact_forces(run%force)
      call run%results%append_frame(run%sim%state, run%sim%contacts, run%force, error)
      run%n_frames = run%n_frames + 1
   end subroutine save_frame

   !> Write the last frame, close the files, and say how it ended.
   subroutine end_run(line, run, messages, error, exit_code)
      type(command_line_type), intent(in) :: line
      type(running_type), intent(inout) :: run
      type(diagnostics_type), intent(in) :: messages
      type(error_type), allocatable, intent(inout) :: error   !! of the loop
      integer, intent(out) :: exit_code
      type(error_type), allocatable :: output_error
      logical :: ok
      call set_writing(.true.)
      if (run%last_frame /= run%sim%state%step) call save_frame(run, output_error)
      if (.not. allocated(output_error) .and. run%last_logged /= run%sim%state%step .and. run%sim%state%step > 0) &
         call log_step(run, output_error)
      call keep_first(output_error)
      call run%results%close(run%reason == 'finished', run%reason, output_error)
      call keep_first(output_error)
      call run%log%put('end: '//run%reason//' after '//to_string(run%sim%state%step)//' steps at time '// &
                       to_string(run%sim%state%time, 10)//', '//to_string(wall_seconds() - run%start, 3)// &
                       ' s on the wall clock', output_error)
      call keep_first(output_error)
      call run%log%close(output_error)
      call keep_first(output_error)
      call set_writing(.false.)
      exit_code = 0
      if (allocated(error)) then
         exit_code = error%code
      else if (run%reason /= 'finished') then
         exit_code = error_code%stopped
      end if
      if (allocated(error)) call show_error(error)
      if (exit_code == error_code%stopped) call complain('rockdda: stopped ('//run%reason//') after step '// &
         to_string(run%sim%state%step)//'; the results so far are kept, this version cannot resume them')
      if (exit_code == error_code%computation .or. exit_code == error_code%output) then
         if (get_path_kind(run%output) == path_kind%file) &
            call complain('rockdda: the results up to the last flush are kept in '//run%output)
      end if
      call summarise(line, run, messages, error, exit_code, ok)
      if (.not. ok .and. exit_code == 0) exit_code = error_code%output

   contains

      !> The first failure is the one to report.
      subroutine keep_first(other)
         type(error_type), allocatable, intent(inout) :: other
         if (allocated(other) .and. .not. allocated(error)) then
            run%reason = 'output: '//first_line(other%message)
            call move_alloc(other, error)
         end if
         if (allocated(other)) deallocate (other)
      end subroutine keep_first

   end subroutine end_run

   !> The summary on standard output.
   subroutine summarise(line, run, messages, error, exit_code, ok)
      type(command_line_type), intent(in) :: line
      type(running_type), intent(in) :: run
      type(diagnostics_type), intent(in) :: messages
      type(error_type), allocatable, intent(in) :: error
      integer, intent(in) :: exit_code
      logical, intent(out) :: ok
      type(json_type) :: json
      character(len=:), allocatable :: status
      integer :: i
      status = 'done'
      if (exit_code == error_code%stopped) status = 'stopped'
      if (allocated(error)) status = 'error'
      if (.not. line%json) then
         call say(status//': '//to_string(run%sim%state%step)//' steps to time '// &
                  to_string(run%sim%state%time, 10)//', '//to_string(run%sim%blocks%n_blocks)//' blocks, contacts '// &
                  to_string(run%sim%record%contacts(1))//' open '//to_string(run%sim%record%contacts(2))// &
                  ' sliding '//to_string(run%sim%record%contacts(3))//' locked'//new_line('a')// &
                  'results: '//run%output//' ('//to_string(run%n_frames)//' frames), log: '//run%log_file, ok)
         return
      end if
      call begin_json(json, line, status, exit_code)
      call json%put('exit_reason', run%reason)
      call json%put('output', run%output)
      call json%put('log', run%log_file)
      call json%put('title', run%sim%parameters%title)
      call json%put('solver', run%sim%parameters%solver_method)
      call json%put('blocks', run%sim%blocks%n_blocks)
      call json%put('steps', run%sim%state%step)
      call json%put('time', run%sim%state%time)
      call json%put('frames', run%n_frames)
      call json%open('{', 'contacts')
      call json%put('open', run%sim%record%contacts(1))
      call json%put('sliding', run%sim%record%contacts(2))
      call json%put('locked', run%sim%record%contacts(3))
      call json%close('}')
      call json%open('{', 'energy')
      do i = 1, n_energies
         call json%put(trim(energy_names(i)), run%sim%record%energy(i))
      end do
      call json%close('}')
      call json%put('wall_seconds', wall_seconds() - run%start)
      call end_json(json, messages, error, ok)
   end subroutine summarise

   !> Share of the run that is done.
   pure real(wp) function fraction_done(run)
      type(running_type), intent(in) :: run
      fraction_done = 0
      if (run%sim%parameters%n_steps > 0) &
         fraction_done = real(run%sim%state%step, wp)/real(run%sim%parameters%n_steps, wp)
      if (run%sim%parameters%t_end > 0) fraction_done = max(fraction_done, run%sim%state%time/run%sim%parameters%t_end)
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

end module rockdda_app_command_run
