! SPDX-License-Identifier: MIT
!> Loop over steps and end of a run, used by `run` and `resume`.
module rockdda_app_running
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type, error_code
   use rockdda_base_diagnostics, only : diagnostics_type
   use rockdda_base_strings, only : to_string
   use rockdda_model_stage_options, only : stage_name
   use rockdda_io_posix, only : get_path_kind, path_kind
   use rockdda_run_model_run, only : run_type
   use rockdda_run_outcome, only : stage_share
   use rockdda_run_step_loop, only : step_observer_type, advance_run
   use rockdda_app_arguments, only : command_line_type
   use rockdda_app_json, only : json_type
   use rockdda_app_process, only : print_error, set_writing, set_last_words
   use rockdda_app_progress, only : progress_type
   use rockdda_app_report, only : show_error, begin_json, finish_json
   use rockdda_app_run_summary, only : print_summary
   use rockdda_app_stop_request, only : stop_request_type
   implicit none
   private
   public :: step_until_done, end_run, prepare_sudden_end

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
                                part_share(run), min(run%sim%control%stage, n_parts(run)), n_parts(run))
   end subroutine end_step

   !> Parts of the run for an estimate of its time: stages, where these end it.
   pure integer function n_parts(run)
      type(run_type), intent(in) :: run
      n_parts = 1
      if (run%sim%parameters%ends_with_stages) n_parts = max(1, size(run%sim%parameters%stages))
   end function n_parts

   !> Share of the present part that is done.
   pure real(wp) function part_share(run)
      type(run_type), intent(in) :: run
      part_share = run%fraction_done()
      if (run%sim%parameters%ends_with_stages) part_share = stage_share(run%sim)
   end function part_share

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

end module rockdda_app_running
