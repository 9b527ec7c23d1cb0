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
   use rockdda_base_kinds, only : wp, i8
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_base_strings, only : first_line, to_string
   use rockdda_base_version, only : version, build_description
   use rockdda_model_state, only : energy
   use rockdda_stepping_simulation, only : simulation_type
   use rockdda_io_timestamp, only : wall_seconds
   use rockdda_io_results_info, only : results_info_type, read_results_info
   use rockdda_io_checkpoint, only : checkpoint_path, results_path
   use rockdda_io_hdf5_driver, only : undo_path
   use rockdda_io_posix, only : get_path_kind, path_kind, remove_file
   use rockdda_run_files, only : run_files_type
   use rockdda_run_hdf5_lock, only : lock_hdf5, unlock_hdf5
   use rockdda_run_input, only : model_input_type, run_request_type
   use rockdda_run_outcome, only : stage_share, short_run_warning, weak_start_warning, skipped_stages_warning, &
      unreached_tables_text, time_error_warning, strikes_warning, overlaps_warning, unrested_warning, lost_text, &
      lodged_warning, strain_warning, slid_lining_warning, sheared_lining_warning, peaked_lining_warning, &
      unreached_stages_warning
   use rockdda_run_output_choice, only : choose_output
   use rockdda_run_thread_choice, only : thread_choice_type
   use rockdda_run_checkpointing, only : load_checkpoint
   implicit none
   private
   public :: run_type

   !> Number of blocks up to which the first checkpoint waits (checkpoint_timer_type): it takes longer than a step.
   integer, parameter :: few_blocks = 200
   !> Bytes that take longer to write than a thread takes to start.
   integer(i8), parameter :: much = 1048576_i8

   type, extends(run_files_type) :: run_type
      type(simulation_type) :: sim
      type(thread_choice_type) :: threads          !! where the program chooses their number
      character(len=:), allocatable :: reason      !! 'finished' or the reason of the stop
      character(len=:), allocatable :: warning     !! of the last `write_step` or `close`
      type(diagnostics_type) :: warnings           !! all of them, for the summary
      logical :: strict = .false.                  !! an answer that is not to be trusted ends the run
      integer :: first_step = 0                    !! step at which this process began
      real(wp) :: start = 0                        !! wall clock
      real(wp) :: deadline = huge(1.0_wp)          !! wall clock, for the caller's loop
      logical :: is_open = .false.                 !! results are being written
      logical, private :: energy_was_reported = .false.
      integer, private :: planned_steps = 0        !! end of the run in the checkpoint
      real(wp), private :: planned_end = 0
   contains
      procedure :: prepare
      procedure :: open => open_run
      procedure :: load => load_run
      procedure :: reopen => reopen_run
      procedure :: check_completion
      procedure :: find_kept_part
      procedure :: has_results
      procedure :: write_step
      procedure :: has_much_to_flush
      procedure :: close => close_run
      procedure :: fraction_done
      procedure, private :: warn, object, check_energy, check_strain, check_load
      procedure, private :: write_rows, continue_files, end_files, end_log, read_own_results
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

   !> Create results and log with header, model and frame 0, and the first checkpoint where a step may take long: the
   !> run can be resumed from it on.
   subroutine open_run(self, request, input, messages, error)
      class(run_type), intent(inout) :: self
      class(run_request_type), intent(in) :: request
      type(model_input_type), intent(in) :: input
      type(diagnostics_type), intent(in) :: messages
      type(error_type), allocatable, intent(out) :: error
      call lock_hdf5()
      call self%run_files_type%create_files(input, request%force, self%sim, messages, error)
      if (.not. allocated(error) .and. self%sim%blocks%n_blocks > few_blocks) &
         call self%run_files_type%save(self%sim, error)
      call unlock_hdf5()
      self%is_open = .not. allocated(error)
   end subroutine open_run

   !> Write what an accepted step adds: its row of the history and, when due, frame, log line, flush and checkpoint. A
   !> flush that `has_much_to_flush` announces is left to the caller.
   !> A run without results only checks its energy balance.
   subroutine write_step(self, error)
      class(run_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      call self%sim%construction%lodging%look(self%sim%blocks, self%sim%state)
      if (.not. self%is_open) then
         if (self%strict) call self%check_energy(error)
         if (self%strict .and. .not. allocated(error)) &
            call self%object(lodged_warning(self%sim), error)
         if (self%strict .and. .not. allocated(error)) call self%object(unrested_warning(self%sim), error)
         if (.not. allocated(error)) call self%check_load(error)
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
      call self%end_log(error)
      self%is_open = .false.
   end subroutine close_run

   !> End the log: reason, steps, time, and how far the results reach after a failure.
   subroutine end_log(self, error)
      class(run_type), intent(inout) :: self
      type(error_type), allocatable, intent(inout) :: error
      type(error_type), allocatable :: problem, second
      integer :: n_steps, n_frames
      real(wp) :: time
      logical :: found
      call self%find_kept_part(n_steps, n_frames, time, found)
      call self%log%put('end: '//self%reason//' after '//to_string(self%sim%state%step)//' steps at time '// &
                        to_string(self%sim%state%time, 10)//', '//to_string(wall_seconds() - self%start, 3)// &
                        ' s on the wall clock', problem)
      if (.not. allocated(problem) .and. self%results%has_failed()) &
         call self%log%put('# the results hold '//to_string(n_steps)//' steps to time '//to_string(time, 10), problem)
      call self%log%close(second)
      if (.not. allocated(problem) .and. allocated(second)) call move_alloc(second, problem)
      if (allocated(error) .or. .not. allocated(problem)) return
      self%reason = 'output: '//first_line(problem%message)
      call move_alloc(problem, error)
   end subroutine end_log

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
      self%output = results_path(path, self%facts%results_ending)
      if (len(self%output) == 0) then
         call make_error(error, error_code%input, path//": error: the name of a checkpoint ends in '.ckpt.h5': "// &
                         'the path of its results follows from it')
         return
      end if
      call self%take_names()
      self%checkpoint_file = path
      call self%take_progress(self%sim%state%step)
      self%planned_steps = self%sim%parameters%n_steps
      self%planned_end = self%sim%parameters%t_end
      self%first_step = self%sim%state%step
   end subroutine load_run

   !> Does the output file exist and belong to this run? It may have been removed or replaced.
   logical function has_results(self)
      class(run_type), intent(in) :: self
      type(results_info_type) :: info
      call self%read_own_results(info, has_results)
   end function has_results

   !> Steps, frames and time in the output file, 0 when it is not there: after a failure of the output they are fewer
   !> than were computed.
   subroutine find_kept_part(self, n_steps, n_frames, time, found)
      class(run_type), intent(in) :: self
      integer, intent(out) :: n_steps, n_frames
      real(wp), intent(out) :: time
      logical, intent(out) :: found
      type(results_info_type) :: info
      n_steps = self%sim%state%step
      n_frames = self%n_frames
      time = self%sim%state%time
      found = .true.
      if (.not. self%results%has_failed()) return
      call self%read_own_results(info, found)
      if (.not. found) info = results_info_type()
      n_steps = int(info%n_steps)
      n_frames = int(info%n_frames)
      time = info%last_time
   end subroutine find_kept_part

   !> Find out whether a loaded run has reached its end with complete results. Then remove its undo file.
   subroutine check_completion(self, is_complete)
      class(run_type), intent(inout) :: self
      logical, intent(out) :: is_complete
      type(results_info_type) :: info
      is_complete = self%sim%is_finished()
      if (.not. is_complete) return
      call self%read_own_results(info, is_complete)
      if (is_complete) is_complete = info%complete .and. info%last_step == self%sim%state%step
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
      call self%continue_files(messages, error)
      call unlock_hdf5()
      self%is_open = .not. allocated(error)
   end subroutine reopen_run

   !> Reopen the files at the checkpoint. A new end of the run is saved: a kill before the next checkpoint would lose
   !> it.
   subroutine continue_files(self, messages, error)
      class(run_type), intent(inout) :: self
      type(diagnostics_type), intent(in) :: messages
      type(error_type), allocatable, intent(out) :: error
      call self%run_files_type%reopen_files(self%sim, messages, error)
      if (allocated(error)) then
         if (error%code == error_code%input) call format_as_compiler(self%output, error)
         return
      end if
      if (self%sim%parameters%n_steps /= self%planned_steps .or. &
          abs(self%sim%parameters%t_end - self%planned_end) > 0) call self%run_files_type%save(self%sim, error)
   end subroutine continue_files

   !> Write history row, frame and log line of an accepted step, then flush or write a checkpoint when due. Where there
   !> is much to flush, that is left to the caller.
   subroutine write_rows(self, error)
      class(run_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      type(error_type), allocatable :: problem
      if (allocated(self%warning)) deallocate (self%warning)
      call self%results%append_history(self%sim%record)
      call self%check_energy(error)
      if (.not. allocated(error) .and. self%sim%state%step == 1) call self%warn(weak_start_warning(self%sim), error)
      if (.not. allocated(error)) call self%warn(skipped_stages_warning(self%sim, .false.), error)
      if (.not. allocated(error)) call self%warn(overlaps_warning(self%sim), error)
      if (.not. allocated(error)) call self%object(lodged_warning(self%sim), error)
      if (.not. (allocated(error) .or. self%sim%construction%lodging%strain_was_reported)) call self%check_strain(error)
      if (.not. allocated(error)) call self%object(unrested_warning(self%sim), error)
      if (.not. allocated(error)) call self%check_load(error)
      if (allocated(error)) return
      if (self%plan%saves(self%sim%state%step, self%sim%state%time) .or. self%sim%ends_stage()) &
         call self%run_files_type%save_frame(self%sim, error)
      if (allocated(error)) return
      if (self%log%is_line_due(self%sim, self%last_frame == self%sim%state%step)) &
         call self%log%write_step(self%sim, error)
      if (allocated(error)) return
      if (.not. self%run_files_type%is_checkpoint_due(self%sim)) then
         if (self%has_much_to_flush()) return
         if (self%results%is_flush_due()) call self%results%flush(error)
         return
      end if
      ! a failed checkpoint ends the run only if the results failed too: otherwise warn, and try again at the next one
      call self%run_files_type%save(self%sim, problem)
      if (.not. allocated(problem)) return
      if (self%results%has_failed()) then
         call move_alloc(problem, error)
         return
      end if
      call self%warn('no checkpoint of step '//to_string(self%sim%state%step)//': '//first_line(problem%message)// &
                     '; the run continues, and the older checkpoint is unchanged', error)
   end subroutine write_rows

   !> Are there enough rows to flush that a thread of its own is worth while?
   logical function has_much_to_flush(self)
      class(run_type), intent(in) :: self
      has_much_to_flush = .false.
      if (.not. self%is_open .or. self%results%has_failed()) return
      has_much_to_flush = self%results%is_flush_due() .and. self%results%waiting_bytes() > much
   end function has_much_to_flush

   !> Report a false energy balance: one warning; with `strict` an error.
   subroutine check_energy(self, error)
      class(run_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: text
      if (self%energy_was_reported .and. .not. self%strict) return
      associate (ledger => self%sim%ledger)
         text = ledger%given%describe(self%sim%state%step, ledger%total(energy%dissipated), abs(ledger%at_start) + &
                                      abs(ledger%total(energy%gravity)) + abs(ledger%total(energy%external)))
      end associate
      if (len(text) == 0) return
      call self%object(text, error)
      self%energy_was_reported = .true.
   end subroutine check_energy

   !> Report a strain beyond linear elasticity, once.
   subroutine check_strain(self, error)
      class(run_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: text
      text = strain_warning(self%sim)
      if (len(text) > 0) self%sim%construction%lodging%strain_was_reported = .true.
      call self%warn(text, error)
   end subroutine check_strain

   !> An error when the model no longer follows its load.
   subroutine check_load(self, error)
      class(run_type), intent(in) :: self
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: text
      text = lost_text(self%sim)
      if (len(text) > 0) call make_error(error, error_code%computation, text)
   end subroutine check_load

   !> Warn of an answer that is not to be trusted; with `strict` it is an error that ends the run.
   subroutine object(self, text, error)
      class(run_type), intent(inout) :: self
      character(len=*), intent(in) :: text                    !! '': of nothing
      type(error_type), allocatable, intent(out) :: error
      if (len(text) == 0) return
      if (self%strict) then
         call make_error(error, error_code%computation, text)
      else
         call self%warn(text, error)
      end if
   end subroutine object

   !> Add a warning to the log, to the summary and to `warning` for the caller.
   subroutine warn(self, text, error)
      class(run_type), intent(inout) :: self
      character(len=*), intent(in) :: text                    !! '': of nothing
      type(error_type), allocatable, intent(out) :: error
      if (len(text) == 0) return
      if (allocated(self%warning)) then
         self%warning = self%warning//new_line('a')//'rockdda: warning: '//text
      else
         self%warning = text
      end if
      call self%warnings%add(severity%warning, text)
      call self%log%put('warning: '//text, error)
   end subroutine warn

   !> Write the checkpoint, the last frame and the exit reason, and close the files.
   !>
   !> The checkpoint precedes the frame of the last step, which may be no frame of a continued run. After a failed step
   !> the older checkpoint stays, because the failed attempts have changed the starting vectors of the solver; where
   !> there is none yet, the one that is written leads to a failure all the same.
   subroutine end_files(self, error)
      class(run_type), intent(inout) :: self
      type(error_type), allocatable, intent(inout) :: error   !! of the run so far
      type(error_type), allocatable :: output_error, no_checkpoint
      logical :: wanted

      if (allocated(self%warning)) deallocate (self%warning)
      wanted = .not. allocated(error)
      if (allocated(error)) wanted = error%code == error_code%computation .and. self%lacks_checkpoint()
      if (wanted) call self%run_files_type%save(self%sim, no_checkpoint)
      if (self%last_frame /= self%sim%state%step) call self%run_files_type%save_frame(self%sim, output_error)
      if (.not. allocated(output_error) .and. self%log%last_step /= self%sim%state%step .and. &
          self%sim%state%step > 0) call self%log%write_step(self%sim, output_error)
      call keep_first(output_error)
      call warn_of(short_run_warning(self%sim))
      call warn_of(skipped_stages_warning(self%sim, .true.))
      call warn_of(time_error_warning(self%sim))
      call warn_of(strikes_warning(self%sim))
      call warn_of(slid_lining_warning(self%sim))
      call warn_of(sheared_lining_warning(self%sim))
      call warn_of(peaked_lining_warning(self%sim))
      if (self%reason == 'finished' .and. .not. allocated(error)) then
         call self%object(unreached_stages_warning(self%sim), output_error)
         call keep_first(output_error)
         call self%object(unreached_tables_text(self%sim%parameters, self%sim%state%step, self%sim%state%time), &
                          output_error)
         call keep_first(output_error)
      end if
      call self%log%write_outcome(self%sim, output_error)
      call keep_first(output_error)
      call self%results%close(self%reason == 'finished', self%reason, output_error, self%sim%planned_time())
      call keep_first(output_error)
      call keep_first(no_checkpoint)

   contains

      !> Warn at the end of a run that has finished.
      subroutine warn_of(text)
         character(len=*), intent(in) :: text   !! '': of nothing
         if (self%reason /= 'finished' .or. allocated(error)) return
         call self%warn(text, output_error)
         call keep_first(output_error)
      end subroutine warn_of

      !> Keep the first failure.
      subroutine keep_first(other)
         type(error_type), allocatable, intent(inout) :: other
         if (allocated(other) .and. .not. allocated(error)) then
            self%reason = merge('output: ', 'failed: ', other%code == error_code%output)//first_line(other%message)
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
         fraction_done = min(1.0_wp, (self%sim%control%stage - 1 + stage_share(self%sim))/ &
                             real(size(self%sim%parameters%stages), wp))
      if (self%sim%parameters%t_end > 0) &
         fraction_done = max(fraction_done, self%sim%state%time/self%sim%parameters%t_end)
   end function fraction_done

   !> Read about the results, if they exist and are those of this run.
   subroutine read_own_results(self, info, are_own)
      class(run_type), intent(in) :: self
      type(results_info_type), intent(out) :: info
      logical, intent(out) :: are_own
      type(error_type), allocatable :: unreadable
      call lock_hdf5()
      call read_results_info(self%output, info, unreadable)
      call unlock_hdf5()
      are_own = .not. allocated(unreadable)
      if (are_own) are_own = info%created == self%facts%header%created
   end subroutine read_own_results

   !> Format a message about a file as "FILE: error: what".
   subroutine format_as_compiler(path, error)
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(inout) :: error
      if (index(error%message, path//': ') /= 1 .or. index(error%message, ': error: ') > 0) return
      error%message = path//': error: '//error%message(len(path) + 3:)
   end subroutine format_as_compiler

end module rockdda_run_model_run
