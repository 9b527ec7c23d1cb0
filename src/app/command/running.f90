! SPDX-License-Identifier: MIT
!> Loop over steps and end of a run, used by `run` and `resume`.
!>
!> Summary of `rockdda run` and `rockdda resume`.
module rockdda_app_running
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type, error_code
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_base_strings, only : to_string, counted
   use rockdda_model_stage_options, only : stage_name
   use rockdda_io_posix, only : get_path_kind, path_kind
   use rockdda_run_model_run, only : run_type
   use rockdda_run_outcome, only : stage_share, done_share, last_stage, share_after_strikes
   use rockdda_run_step_loop, only : step_observer_type, advance_run
   use rockdda_app_arguments, only : command_line_type
   use rockdda_app_json, only : json_type
   use rockdda_app_process, only : print_error, set_writing, set_last_words, is_terminal, print_line
   use rockdda_app_progress, only : progress_type
   use rockdda_app_report, only : show_error, begin_json, finish_json, end_json
   use rockdda_app_stop_request, only : stop_request_type
   use rockdda_model_state, only : energy_names, n_energies
   use rockdda_model_units, only : unit_system_type, unit_system
   use rockdda_stepping_control, only : cut_names, n_cut_reasons
   use rockdda_io_timestamp, only : wall_seconds
   use rockdda_run_supports, only : lining_summary_type, bolt_summary_type, summarise_linings, summarise_bolts, &
      supports_text
   use rockdda_app_file_facts, only : displacements_text, put_displacements
   implicit none
   private
   public :: step_until_done, end_run, prepare_sudden_end, print_summary

   !> Signals, progress and warnings of a run in a terminal.
   type, extends(step_observer_type) :: terminal_observer_type
      type(stop_request_type) :: request
      type(progress_type), pointer :: progress => null()
      logical :: quiet = .false.                   !! no warnings
   contains
      procedure :: stop_reason
      procedure :: begin_writing
      procedure :: end_step
   end type terminal_observer_type

contains

   !> Compute the steps of the run. On return `run%reason` is the reason for its end; an error is a failure of the
   !> computation or of the output.
   subroutine step_until_done(run, quiet, progress, error)
      type(run_type), intent(inout) :: run
      logical, intent(in) :: quiet                 !! no warnings
      type(progress_type), intent(inout), target :: progress
      type(error_type), allocatable, intent(out) :: error
      type(terminal_observer_type) :: observer
      observer%request%deadline = run%deadline
      observer%progress => progress
      observer%quiet = quiet
      call run%sim%set_interruption(observer%request)
      call advance_run(run, observer, error)
   end subroutine step_until_done

   !> A stop signal or `--max-wall` ends the run.
   function stop_reason(self) result(text)
      class(terminal_observer_type), intent(in) :: self
      character(len=:), allocatable :: text
      text = self%request%reason()
   end function stop_reason

   !> Let a second SIGINT wait while rows are written.
   subroutine begin_writing(self)
      class(terminal_observer_type), intent(inout) :: self
      call set_writing(.true.)
   end subroutine begin_writing

   !> Print warnings of the step and update the progress bar.
   subroutine end_step(self, run, accepted)
      class(terminal_observer_type), intent(inout) :: self
      type(run_type), intent(in) :: run
      logical, intent(in) :: accepted
      call set_writing(.false.)
      if (.not. accepted) return
      if (allocated(run%warning) .and. .not. self%quiet) call print_error('rockdda: warning: '//run%warning)
      call self%progress%update(run%fraction_done(), 'step '//to_string(run%sim%state%step)//', time '// &
                                run%sim%parameters%shown(run%sim%state%time, 'time', 6)//stage_text(run)// &
                                ', unbalanced '//to_string(run%sim%record%unbalanced, 2), run%sim%record%unbalanced, &
                                merge(stage_share(run%sim), run%fraction_done(), &
                                      run%sim%parameters%ends_with_stages), &
                                min(run%sim%control%stage, n_parts(run)), n_parts(run))
   end subroutine end_step

   !> Parts of the run for an estimate of its time: stages, where these end it.
   pure integer function n_parts(run)
      type(run_type), intent(in) :: run
      n_parts = 1
      if (run%sim%parameters%ends_with_stages) n_parts = max(1, size(run%sim%parameters%stages))
   end function n_parts

   !> ", stage 'name'" in a run with stages.
   pure function stage_text(run) result(text)
      type(run_type), intent(in) :: run
      character(len=:), allocatable :: text
      text = ''
      if (run%sim%control%stage > size(run%sim%parameters%stages)) return
      text = ", stage '"//stage_name(run%sim%parameters%stages, run%sim%control%stage)//"'"
   end function stage_text

   !> Set the summary that a second SIGINT prints to standard output. It names the files when they exist.
   subroutine prepare_sudden_end(line, run, messages)
      type(command_line_type), intent(in) :: line
      type(run_type), intent(in) :: run
      type(diagnostics_type), intent(in) :: messages
      type(error_type), allocatable :: no_error
      type(json_type) :: json
      if (line%json) then
         call begin_json(json, line, 'stopped', error_code%stopped)
         call json%put('exit_reason', 'second SIGINT')
         if (allocated(run%output)) call json%put('output', run%output)
         if (allocated(run%checkpoint_file)) call json%put('checkpoint', run%checkpoint_file)
         if (allocated(run%log_file)) call json%put('log', run%log_file)
         call finish_json(json, messages, no_error)
         call set_last_words(json%text)
      else if (allocated(run%output)) then
         call set_last_words('stopped at once'//new_line('a')//'results: '//run%output//', log: '//run%log_file)
      else
         call set_last_words('stopped at once')
      end if
   end subroutine prepare_sudden_end

   !> Write the last frame, close the files, and report the outcome.
   subroutine end_run(line, run, messages, error, exit_code)
      type(command_line_type), intent(in) :: line
      type(run_type), intent(inout) :: run
      type(diagnostics_type), intent(in) :: messages
      type(error_type), allocatable, intent(inout) :: error   !! of the loop
      integer, intent(out) :: exit_code
      logical :: ok
      ! from here on a second SIGINT has no computation to interrupt
      call set_writing(.true.)
      call run%close(error)
      if (allocated(run%warning) .and. .not. line%quiet) call print_error('rockdda: warning: '//run%warning)
      exit_code = 0
      if (allocated(error)) then
         exit_code = error%code
      else if (run%reason /= 'finished') then
         exit_code = error_code%stopped
      end if
      if (allocated(error)) call show_error(error)
      if (exit_code == error_code%stopped) call print_error('rockdda: stopped ('//run%reason//') after step '// &
         to_string(run%sim%state%step)//"; 'rockdda resume "//run%checkpoint_file//"' continues")
      if (exit_code == error_code%internal) call print_error('rockdda: internal error: this is a bug in RockDDA. '// &
         'Please report it with the command line, the input files and the lines above')
      if (exit_code == error_code%computation .or. exit_code == error_code%internal) &
         call print_error('rockdda: the results up to step '//to_string(run%sim%state%step)//' are kept in '// &
                          run%output)
      if (exit_code == error_code%output) then
         if (run%has_results()) then
            call print_error('rockdda: the results up to the last flush are kept in '//run%output)
            if (get_path_kind(run%checkpoint_file) == path_kind%file) &
               call print_error("rockdda: 'rockdda resume "//run%checkpoint_file// &
                                "' continues from the last checkpoint")
         end if
      end if
      call print_summary(line, run, messages, error, exit_code, ok)
      if (.not. ok .and. exit_code == 0) exit_code = error_code%output
   end subroutine end_run

   !> Print the summary on standard output.
   subroutine print_summary(line, run, messages, error, exit_code, ok)
      type(command_line_type), intent(in) :: line
      type(run_type), intent(in) :: run
      type(diagnostics_type), intent(in) :: messages
      type(error_type), allocatable, intent(in) :: error
      integer, intent(in) :: exit_code
      logical, intent(out) :: ok
      type(json_type) :: json
      type(diagnostics_type) :: all_messages
      character(len=:), allocatable :: status, moved, results
      integer :: i, n_steps, n_frames
      real(wp) :: time
      logical :: found
      type(unit_system_type) :: system
      system = unit_system(run%sim%parameters%units)
      call run%find_kept_part(n_steps, n_frames, time, found)
      status = 'done'
      if (exit_code == error_code%stopped) status = 'stopped'
      if (allocated(error)) status = 'error'
      if (.not. line%json) then
         results = run%output//' ('//to_string(n_frames)//' frames)'
         if (.not. found) results = 'none ('//run%output//' was removed or replaced)'
         call print_line(status//': '//counted(run%sim%state%step, 'step')//' to time '// &
                  system%shown(run%sim%state%time, 'time', 10)//kept_text(run, n_steps, time)//', '// &
                  counted(run%sim%blocks%n_blocks - run%sim%blocks%n_segments, 'block')//', contacts '// &
                  to_string(run%sim%record%contacts(1))//' open '//to_string(run%sim%record%contacts(2))// &
                  ' sliding '//to_string(run%sim%record%contacts(3))//' locked'//new_line('a')// &
                  'results: '//results//', log: '//run%log_file// &
                  warnings_text(run%warnings, run%log_file, line%quiet), ok)
         if (ok .and. found .and. .not. line%quiet) then
            moved = displacements_text(run%output)
            if (len(moved) > 0) call print_line(moved, ok)
            moved = supports_text(run%sim, '  ')
            if (ok .and. len(moved) > 0) call print_line('supports at the end'//new_line('a')//moved, ok)
         end if
         return
      end if
      call begin_json(json, line, status, exit_code)
      call json%put('exit_reason', run%reason)
      call json%put('output', run%output)
      call json%put('checkpoint', run%checkpoint_file)
      call json%put('log', run%log_file)
      call json%put('title', run%sim%parameters%title)
      call json%put('units', trim(run%sim%parameters%units))
      call json%put('solver', run%sim%parameters%solver_method)
      call json%put('blocks', run%sim%blocks%n_blocks - run%sim%blocks%n_segments)
      call json%put('first_step', run%first_step)
      call json%put('steps', n_steps)
      call json%put('time', time)
      call json%put('planned_time', run%sim%planned_time())
      call json%put('done_share', done_share(run%sim))
      call json%put('unbalanced', run%sim%record%unbalanced)
      call json%put('time_error', run%sim%record%time_error)
      call json%put('struck_blocks', run%sim%control%strikes%count_struck())
      call json%put('motion_after_strikes', share_after_strikes(run%sim))
      call json%put('asleep_blocks', count(run%sim%state%asleep))
      call json%put('stage', last_stage(run%sim))
      call json%open('{', 'cuts')
      do i = 1, n_cut_reasons
         call json%put(trim(cut_names(i)), run%sim%control%cuts(i))
      end do
      call json%close('}')
      call json%put('short_steps', run%sim%control%short_steps)
      call json%put('frames', n_frames)
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
      call json%open('{', 'energy_given')
      associate (given => run%sim%ledger%given)
         call json%put('discarded', given%given(1))
         call json%put('geometry', given%given(2))
         call json%put('compared_with', given%scale)
      end associate
      call json%close('}')
      if (found) call put_displacements(run%output, json)
      call put_supports(run, json)
      call json%put('wall_seconds', wall_seconds() - run%start)
      all_messages = messages
      do i = 1, run%warnings%n
         call all_messages%add(severity%warning, run%warnings%items(i)%message)
      end do
      call end_json(json, all_messages, error, ok)
   end subroutine print_summary

   !> Put what linings and bolts bear at the end.
   subroutine put_supports(run, json)
      type(run_type), intent(in) :: run
      type(json_type), intent(inout) :: json
      character(len=1), parameter :: names(3) = ['N', 'M', 'Q']
      type(lining_summary_type), allocatable :: linings(:)
      type(bolt_summary_type), allocatable :: bolts(:)
      integer :: i, k
      call summarise_linings(run%sim, linings)
      call summarise_bolts(run%sim, bolts)
      if (size(linings) > 0) then
         call json%open('[', 'linings')
         do k = 1, size(linings)
            associate (liner => linings(k))
               call json%open('{', '')
               call json%put('name', liner%name)
               do i = 1, 3
                  call json%put(names(i), [liner%least(i), liner%most(i)])
               end do
               call json%put('nodes', liner%n)
               call json%put('cracked', liner%n_cracked)
               call json%put('crushed', liner%n_crushed)
               call json%put('slip', liner%slip)
               call json%put('opening', liner%opening)
               call json%close('}')
            end associate
         end do
         call json%close(']')
      end if
      if (size(bolts) == 0) return
      call json%open('[', 'bolts')
      do k = 1, size(bolts)
         associate (group => bolts(k))
            call json%open('{', '')
            call json%put('name', group%name)
            call json%put('bolts', group%n)
            call json%put('force', group%force)
            call json%put('use', group%use)
            call json%put('slipping', group%n_slipping)
            call json%put('yielding', group%n_yielding)
            call json%put('ruptured', group%n_ruptured)
            call json%put('in_compression', group%n_pushed)
            call json%close('}')
         end associate
      end do
      call json%close(']')
   end subroutine put_supports

   !> Of the steps computed, those in the results, where these are fewer.
   pure function kept_text(run, n_steps, time) result(text)
      type(run_type), intent(in) :: run
      integer, intent(in) :: n_steps
      real(wp), intent(in) :: time
      character(len=:), allocatable :: text
      type(unit_system_type) :: system
      text = ''
      system = unit_system(run%sim%parameters%units)
      if (n_steps >= run%sim%state%step) return
      text = ' (the results hold '//to_string(n_steps)//', to '//system%shown(time, 'time', 10)//')'
   end function kept_text

   !> The warnings of the run, each after a line end; with quiet none. On a terminal they stand above already: then
   !> their number.
   function warnings_text(warnings, log_file, quiet) result(text)
      type(diagnostics_type), intent(in) :: warnings
      character(len=*), intent(in) :: log_file
      logical, intent(in) :: quiet
      character(len=:), allocatable :: text
      integer :: i
      text = ''
      if (quiet .or. warnings%n == 0) return
      if (is_terminal()) then
         text = new_line('a')//counted(warnings%n, 'warning')//' above, and in '//log_file
         return
      end if
      do i = 1, warnings%n
         text = text//new_line('a')//'warning: '//warnings%items(i)%message
      end do
   end function warnings_text

end module rockdda_app_running
