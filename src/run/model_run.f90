! SPDX-License-Identifier: MIT
!> A run with its results, for the program and the Python package.
!>
!>     call run%prepare(request, input, error)           nothing is written
!>     call run%open(request, input, messages, error)    results and log; frame 0 is the start
!>     call advance_run(run, observer, error)            the steps (rockdda_run_step_loop), each followed by
!>        call run%write_step(error)                     its rows of the results
!>     call run%close(error)                             checkpoint, last frame and exit reason
!>
!> To continue from a checkpoint, instead of `prepare` and `open`:
!>
!>     call run%load(path, messages, error)              nothing is written
!>     run%sim%parameters%n_steps = …                    optional: another end
!>     call run%reopen(messages, error)                  results and log as they were at the checkpoint
!>
!> Several threads of one process may compute runs at the same time; a lock lets one of them at a time use HDF5.
module rockdda_run_model_run
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_base_strings, only : to_string, as_utf8
   use rockdda_base_version, only : version, build_description
   use rockdda_model_options, only : is_set
   use rockdda_model_stage_options, only : stage_names, water_of_stages
   use rockdda_stepping_simulation, only : simulation_type
   use rockdda_io_checkpoint, only : checkpoint_facts_type, checkpoint_path, results_path
   use rockdda_io_digest, only : digest_length
   use rockdda_io_hdf5_driver, only : undo_path
   use rockdda_io_log, only : log_type, log_path
   use rockdda_io_posix, only : get_path_kind, path_kind, remove_file
   use rockdda_io_results, only : results_type
   use rockdda_io_results_info, only : results_info_type, read_results_info
   use rockdda_io_timestamp, only : utc_now, wall_seconds
   use rockdda_run_checkpoint_timer, only : checkpoint_timer_type
   use rockdda_run_checkpointing, only : save_checkpoint, load_checkpoint
   use rockdda_run_log_head, only : write_log_head
   use rockdda_run_frame_plan, only : frame_plan_type, new_frame_plan
   use rockdda_run_model_input, only : model_input_type, run_request_type
   use rockdda_run_outcome, only : short_run_warning, cuts_text, weak_start_warning, reactions_text
   use rockdda_run_output_choice, only : choose_output
   use rockdda_run_hdf5_lock, only : lock_hdf5, unlock_hdf5
   implicit none
   private
   public :: run_type, first_line

   !> Longest time between flushes of the results, whatever the options [s].
   real(wp), parameter :: longest_flush_interval = 2
   !> Default time between checkpoints [s].
   real(wp), parameter :: usual_checkpoint_interval = 60
   !> Approximate number of lines for steps in the log.
   integer, parameter :: log_lines = 1000

   type :: run_type
      type(simulation_type) :: sim
      character(len=:), allocatable :: output, log_file, checkpoint_file
      character(len=:), allocatable :: reason      !! 'finished' or the reason of the stop
      character(len=:), allocatable :: warning     !! of the last `write_step` or `close`
      type(diagnostics_type) :: warnings           !! all of them, for the summary
      logical :: strict = .false.                  !! a false energy balance ends the run
      type(checkpoint_facts_type) :: facts         !! facts about the run in its checkpoints
      integer :: first_step = 0                    !! step at which this process began
      integer :: n_frames = 0                      !! in the file
      real(wp) :: start = 0                        !! wall clock
      real(wp) :: deadline = huge(1.0_wp)          !! wall clock, for the caller's loop
      logical :: is_open = .false.                 !! results are being written
      type(results_type), private :: results
      type(log_type), private :: log
      type(frame_plan_type), private :: plan
      logical, private :: energy_was_reported = .false.
      character(len=digest_length), private :: digest = ''  !! of the loaded checkpoint
      type(checkpoint_timer_type), private :: timer
      integer, private :: planned_steps = 0                 !! end of the run in the checkpoint
      real(wp), private :: planned_end = 0
      integer, private :: last_frame = -1, last_logged = -1 !! steps
      character(len=:), allocatable, private :: last_choice !! of the automatic solver, as logged
      real(wp), allocatable, private :: force(:, :), stress(:, :)   !! scratch: forces and stresses of contacts
   contains
      procedure :: prepare
      procedure :: open => open_run
      procedure :: load => load_run
      procedure :: reopen => reopen_run
      procedure :: check_completion
      procedure :: has_results
      procedure :: write_step
      procedure :: close => close_run
      procedure :: fraction_done
      procedure, private :: warn, check_energy
      procedure, private :: begin_files, write_rows, log_step, log_choice, save_frame, save, &
         reopen_files, end_files
   end type run_type

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

   !> Create results and log with header, model and frame 0, and write the first checkpoint: from now on the run can be
   !> resumed.
   subroutine open_run(self, request, input, messages, error)
      class(run_type), intent(inout) :: self
      class(run_request_type), intent(in) :: request
      type(model_input_type), intent(in) :: input
      type(diagnostics_type), intent(in) :: messages
      type(error_type), allocatable, intent(out) :: error
      call lock_hdf5()
      call self%begin_files(request, input, messages, error)
      call unlock_hdf5()
      self%is_open = .not. allocated(error)
   end subroutine open_run

   !> Write what an accepted step adds: its row of the history and, when due, frame, log line, flush and checkpoint.
   !> A run without results only checks its energy balance.
   subroutine write_step(self, error)
      class(run_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      if (.not. self%is_open) then
         if (self%strict) call self%check_energy(error)
         return
      end if
      call lock_hdf5()
      call self%write_rows(error)
      call unlock_hdf5()
   end subroutine write_step

   !> Write checkpoint, last frame and exit reason, and close the files. Returns the first failure, of the run so far or
   !> of the output; a failure of the output becomes the reason.
   subroutine close_run(self, error)
      class(run_type), intent(inout) :: self
      type(error_type), allocatable, intent(inout) :: error
      call lock_hdf5()
      call self%end_files(error)
      call unlock_hdf5()
      self%is_open = .false.
   end subroutine close_run

   !> Read a checkpoint and find the results beside it. Nothing is changed.
   subroutine load_run(self, path, messages, error)
      class(run_type), intent(inout) :: self
      character(len=*), intent(in) :: path
      type(diagnostics_type), intent(inout) :: messages
      type(error_type), allocatable, intent(out) :: error
      self%reason = 'finished'
      call lock_hdf5()
      call load_checkpoint(path, self%sim, self%facts, self%digest, error)
      call unlock_hdf5()
      if (allocated(error)) then
         call format_as_compiler(path, error)
         if (len(results_path(path, '.h5')) > 0) return
         if (get_path_kind(checkpoint_path(path)) == path_kind%file) &
            error%message = error%message//'; the checkpoint of these results is '//checkpoint_path(path)
         return
      end if
      if (self%facts%header%program_version /= version) then
         call make_error(error, error_code%input, path//': error: was written by version '// &
                         self%facts%header%program_version//' of the program, this is version '//version// &
                         '; resume with the version that began the run')
         return
      end if
      if (self%facts%build /= build_description()) call messages%add(severity%warning, path// &
         ' was written by another build of this version: last digits of the results may differ')
      self%checkpoint_file = path
      self%output = results_path(path, self%facts%results_ending)
      if (len(self%output) == 0) then
         call make_error(error, error_code%input, path//": error: the name of a checkpoint ends in '.ckpt.h5': "// &
                         'the path of its results follows from it')
         return
      end if
      self%log_file = log_path(self%output)
      self%planned_steps = self%sim%parameters%n_steps
      self%planned_end = self%sim%parameters%t_end
      self%plan%every = self%facts%frame_every
      self%plan%interval = self%facts%frame_interval
      self%plan%passed = self%facts%frames_passed
      self%last_frame = self%facts%last_frame
      self%n_frames = self%facts%rows%frames
      self%first_step = self%sim%state%step
      self%last_logged = self%sim%state%step
   end subroutine load_run

   !> Does the output file exist and belong to this run? It may have been removed or replaced.
   logical function has_results(self)
      class(run_type), intent(in) :: self
      type(results_info_type) :: info
      type(error_type), allocatable :: unreadable
      call lock_hdf5()
      call read_results_info(self%output, info, unreadable)
      call unlock_hdf5()
      has_results = .not. allocated(unreadable)
      if (has_results) has_results = info%created == self%facts%header%created
   end function has_results

   !> Find out whether a loaded run has reached its end with complete results. Then remove its undo file.
   subroutine check_completion(self, is_complete)
      class(run_type), intent(inout) :: self
      logical, intent(out) :: is_complete
      type(results_info_type) :: info
      type(error_type), allocatable :: unreadable
      is_complete = .false.
      if (.not. self%sim%is_finished()) return
      call lock_hdf5()
      call read_results_info(self%output, info, unreadable)
      call unlock_hdf5()
      if (allocated(unreadable)) return
      is_complete = info%complete .and. info%last_step == self%sim%state%step .and. &
                    info%created == self%facts%header%created
      if (.not. is_complete) return
      self%n_frames = int(info%n_frames)
      ! left by a kill after the results were complete
      call remove_file(undo_path(self%output))
   end subroutine check_completion

   !> Return the results of a loaded run to the checkpoint and continue the log.
   subroutine reopen_run(self, messages, error)
      class(run_type), intent(inout) :: self
      type(diagnostics_type), intent(in) :: messages
      type(error_type), allocatable, intent(out) :: error
      call lock_hdf5()
      call self%reopen_files(messages, error)
      call unlock_hdf5()
      self%is_open = .not. allocated(error)
   end subroutine reopen_run

   !> Reopen results and log at the checkpoint.
   subroutine reopen_files(self, messages, error)
      class(run_type), intent(inout) :: self
      type(diagnostics_type), intent(in) :: messages
      type(error_type), allocatable, intent(out) :: error
      self%facts%header%flush_interval = min(longest_flush_interval, self%facts%checkpoint_every)
      self%facts%header%n_boundaries = size(self%sim%parameters%boundaries)
      self%facts%header%stage_names = stage_names(self%sim%parameters%stages, self%sim%parameters%ends_with_stages)
      call self%results%reopen(self%output, self%facts%header, self%digest, self%facts%rows, self%sim%blocks, &
                               self%sim%record, error)
      if (allocated(error)) then
         if (error%code == error_code%input) call format_as_compiler(self%output, error)
         return
      end if
      call self%timer%restart(wall_seconds())
      call self%log%open(self%log_file, error, append=.true.)
      if (.not. allocated(error)) call self%log%put('resumed: from step '//to_string(self%sim%state%step)// &
         ' at time '//to_string(self%sim%state%time, 10)//', '//utc_now(), error)
      if (.not. allocated(error)) call self%log%put_messages(messages, error)
      if (.not. allocated(error)) call self%log%put_columns(error)
      ! save a new end of the run, which a kill before the next checkpoint would lose
      if (allocated(error)) return
      if (self%sim%parameters%n_steps /= self%planned_steps .or. &
          abs(self%sim%parameters%t_end - self%planned_end) > 0) call self%save(.true., error)
   end subroutine reopen_files

   !> Format a message about a file as "FILE: error: what".
   subroutine format_as_compiler(path, error)
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(inout) :: error
      if (index(error%message, path//': ') /= 1 .or. index(error%message, ': error: ') > 0) return
      error%message = path//': error: '//error%message(len(path) + 3:)
   end subroutine format_as_compiler

   !> Create results, log and the first checkpoint.
   subroutine begin_files(self, request, input, messages, error)
      class(run_type), intent(inout) :: self
      class(run_request_type), intent(in) :: request
      type(model_input_type), intent(in) :: input
      type(diagnostics_type), intent(in) :: messages
      type(error_type), allocatable, intent(out) :: error
      self%facts%model_file = input%model_file
      self%facts%analysis_file = input%analysis_file
      self%facts%config_file = input%config_file
      if (is_set(input%options%threads)) self%facts%threads = input%options%threads
      self%facts%checkpoint_every = usual_checkpoint_interval
      if (is_set(input%options%checkpoint_every)) self%facts%checkpoint_every = input%options%checkpoint_every
      self%checkpoint_file = checkpoint_path(self%output)
      self%log_file = log_path(self%output)
      associate (header => self%facts%header)
         header%title = as_utf8(input%parameters%title)
         header%program_version = version
         header%created = utc_now()
         header%geometry = input%model_text
         header%analysis = input%analysis_text
         header%config = input%config_text
         header%frames = input%options%write_frames
         header%contacts = input%options%write_contacts
         header%flush_interval = min(longest_flush_interval, self%facts%checkpoint_every)
         call self%sim%list_boundaries(header%n_boundaries, header%boundary_edges, header%boundary_kinds)
         header%stage_names = stage_names(input%parameters%stages, input%parameters%ends_with_stages)
         call self%sim%list_water(header%water_edges, header%water_ends)
         header%water = self%sim%parameters%water
         header%stage_water = water_of_stages(input%parameters%stages)
         call self%results%create(self%output, request%force, header, input%blocks, self%sim%state, error)
      end associate
      if (allocated(error)) return
      ! that of an older run
      call remove_file(self%checkpoint_file)
      call self%log%open(self%log_file, error)
      self%plan = new_frame_plan(input%options, input%parameters)
      if (.not. allocated(error)) call write_log_head(self%log, input, self%facts%header, self%output, self%plan, &
                                                      messages, error)
      if (.not. allocated(error)) call self%save_frame(error)
      if (.not. allocated(error)) call self%save(.false., error)
   end subroutine begin_files

   !> Write history row, frame and log line of an accepted step, then flush or write a checkpoint when due.
   subroutine write_rows(self, error)
      class(run_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      type(error_type), allocatable :: problem
      integer :: every
      if (allocated(self%warning)) deallocate (self%warning)
      call self%results%append_history(self%sim%record, error)
      if (.not. allocated(error)) call self%check_energy(error)
      if (.not. allocated(error) .and. self%sim%state%step == 1) then
         if (len(weak_start_warning(self%sim)) > 0) call self%warn(weak_start_warning(self%sim), error)
      end if
      if (allocated(error)) return
      if (self%plan%is_due(self%sim%state%step, self%sim%state%time) .or. self%sim%ends_stage()) &
         call self%save_frame(error)
      if (allocated(error)) return
      every = 1
      if (self%sim%parameters%n_steps < huge(1)) every = max(1, self%sim%parameters%n_steps/log_lines)
      if (self%sim%state%step == 1 .or. mod(self%sim%state%step, every) == 0 .or. &
          self%last_frame == self%sim%state%step .or. self%sim%record%attempts > 1) call self%log_step(error)
      if (allocated(error)) return
      if (.not. self%timer%is_due(wall_seconds(), self%facts%checkpoint_every, self%sim%is_finished())) then
         call self%results%flush_if_due(error)
         return
      end if
      ! a failed checkpoint ends the run only if the results failed too: otherwise warn, and try again at the next one
      call self%save(.true., problem)
      if (.not. allocated(problem)) return
      if (self%results%has_failed()) then
         call move_alloc(problem, error)
         return
      end if
      call self%warn('no checkpoint of step '//to_string(self%sim%state%step)//': '//first_line(problem%message)// &
                     '; the run continues, and the older checkpoint is unchanged', error)
   end subroutine write_rows

   !> Report a false energy balance: one warning; with `strict` an error.
   subroutine check_energy(self, error)
      class(run_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: text
      if (self%sim%ledger%given%false_column() == 0) return
      if (self%energy_was_reported .and. .not. self%strict) return
      text = self%sim%ledger%given%describe(self%sim%state%step)
      if (self%strict) then
         call make_error(error, error_code%computation, text)
      else
         call self%warn(text, error)
      end if
      self%energy_was_reported = .true.
   end subroutine check_energy

   !> Add a warning to the log, to the summary and to `warning` for the caller.
   subroutine warn(self, text, error)
      class(run_type), intent(inout) :: self
      character(len=*), intent(in) :: text
      type(error_type), allocatable, intent(out) :: error
      if (allocated(self%warning)) then
         self%warning = self%warning//new_line('a')//'rockdda: warning: '//text
      else
         self%warning = text
      end if
      call self%warnings%add(severity%warning, text)
      call self%log%put('warning: '//text, error)
   end subroutine warn

   !> Write a checkpoint of the last accepted step. The results reach the disk first, so that they contain all its rows.
   !> On error the older checkpoint and its undo file are unchanged.
   subroutine save(self, sync, error)
      class(run_type), intent(inout) :: self
      logical, intent(in) :: sync                      !! wait until it is on the disk
      type(error_type), allocatable, intent(out) :: error
      character(len=digest_length) :: digest
      call self%timer%restart(wall_seconds())
      call self%results%flush(error)
      if (.not. allocated(error) .and. sync) call self%results%sync(error)
      if (allocated(error) .or. self%results%has_failed()) return
      self%facts%rows = self%results%rows()
      self%facts%written = utc_now()
      self%facts%frame_every = self%plan%every
      self%facts%frame_interval = self%plan%interval
      self%facts%frames_passed = self%plan%passed
      self%facts%last_frame = self%last_frame
      call save_checkpoint(self%output, self%sim, self%facts, sync, digest, error)
      call self%timer%restart(wall_seconds())
      if (.not. allocated(error)) call self%results%keep_undo(digest, error)
   end subroutine save

   !> Write the line of a step to the log.
   subroutine log_step(self, error)
      class(run_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      call self%log%put_step(self%sim%record, self%sim%parameters, error)
      if (.not. allocated(error)) call self%log_choice(error)
      self%last_logged = self%sim%state%step
   end subroutine log_step

   !> Write a line to the log when the automatic solver has changed its method.
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

   !> Save a frame.
   subroutine save_frame(self, error)
      class(run_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      self%last_frame = self%sim%state%step
      if (.not. self%facts%header%frames) return
      call self%sim%contact_forces(self%force)
      call self%sim%contact_stresses(self%stress)
      call self%results%append_frame(self%sim%state, self%sim%contacts, self%force, self%stress, &
                                     self%sim%bolt_forces(), error)
      self%n_frames = self%n_frames + 1
   end subroutine save_frame

   !> Write the checkpoint, the last frame and the exit reason, and close the files.
   !>
   !> The checkpoint precedes the frame of the last step, which may be no frame of a continued run. After a failed step
   !> the older checkpoint stays, because the failed attempts have changed the starting vectors of the solver.
   subroutine end_files(self, error)
      class(run_type), intent(inout) :: self
      type(error_type), allocatable, intent(inout) :: error   !! of the run so far
      type(error_type), allocatable :: output_error, no_checkpoint
      character(len=:), allocatable :: short

      if (allocated(self%warning)) deallocate (self%warning)
      if (.not. allocated(error)) call self%save(.true., no_checkpoint)
      if (self%last_frame /= self%sim%state%step) call self%save_frame(output_error)
      if (.not. allocated(output_error) .and. self%last_logged /= self%sim%state%step .and. &
          self%sim%state%step > 0) call self%log_step(output_error)
      call keep_first(output_error)
      short = ''
      if (self%reason == 'finished' .and. .not. allocated(error)) short = short_run_warning(self%sim)
      if (len(short) > 0) call self%warn(short, output_error)
      call keep_first(output_error)
      if (size(self%sim%parameters%boundaries) > 0) call self%log%put(reactions_text(self%sim), output_error)
      call keep_first(output_error)
      call self%log%put('# planned time: '//to_string(self%sim%planned_time(), 10)//'. '//cuts_text(self%sim), &
                        output_error)
      call keep_first(output_error)
      call self%results%close(self%reason == 'finished', self%reason, output_error, self%sim%planned_time())
      call keep_first(output_error)
      call keep_first(no_checkpoint)
      call self%log%put('end: '//self%reason//' after '//to_string(self%sim%state%step)//' steps at time '// &
                        to_string(self%sim%state%time, 10)//', '//to_string(wall_seconds() - self%start, 3)// &
                        ' s on the wall clock', output_error)
      call keep_first(output_error)
      call self%log%close(output_error)
      call keep_first(output_error)

   contains

      !> Keep the first failure.
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
      ! the steps that stages need are not known: each is as long as another
      if (self%sim%parameters%n_steps == huge(1) .and. self%sim%parameters%ends_with_stages) &
         fraction_done = real(self%sim%control%stage - 1, wp)/real(size(self%sim%parameters%stages), wp)
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

end module rockdda_run_model_run
