! SPDX-License-Identifier: MIT
!> rockdda resume: continue a run from its checkpoint, with the results of a run without a stop.
module rockdda_app_command_resume
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_base_strings, only : to_string
   use rockdda_model_options, only : is_set
   use rockdda_stepping_simulation, only : simulation_type
   use rockdda_io_timestamp, only : wall_seconds
   use rockdda_run_model_run, only : run_type
   use rockdda_app_arguments, only : command_line_type
   use rockdda_app_process, only : print_error, watch_signals
   use rockdda_app_progress, only : progress_type
   use rockdda_app_report, only : report_failure, show_messages
   use rockdda_app_run_summary, only : print_summary
   use rockdda_app_running, only : step_until_done, end_run, prepare_sudden_end
   use rockdda_app_viewer, only : viewer_type
   implicit none
   private
   public :: run_resume

contains

   !> Run the command; returns the exit code.
   subroutine run_resume(line, exit_code)
      type(command_line_type), intent(in) :: line
      integer, intent(out) :: exit_code
      type(run_type) :: run
      type(progress_type) :: progress
      type(viewer_type) :: viewer
      type(diagnostics_type) :: messages
      type(error_type), allocatable :: error
      logical :: is_complete, ok

      run%start = wall_seconds()
      ! a checkpoint exists already: a signal during reading ends the run in order, too
      call prepare_sudden_end(line, run, messages)
      call watch_signals()
      if (size(line%files) /= 1) then
         call make_error(error, error_code%input, "'rockdda resume' needs one checkpoint file; found "// &
                         to_string(size(line%files))//trim(merge(' file ', ' files', size(line%files) == 1))// &
                         ", see 'rockdda resume --help'")
      else
         call run%load(line%files(1)%text, messages, error)
      end if
      if (.not. allocated(error)) call apply_command_line(line, run, error)
      if (allocated(error)) then
         call report_failure(line, messages, error, exit_code)
         return
      end if
      call prepare_sudden_end(line, run, messages)
      if (.not. line%quiet) call show_messages(messages, severity%warning)
      call run%check_completion(is_complete)
      if (is_complete) then
         exit_code = 0
         if (.not. line%quiet) call print_error('rockdda: nothing left to do: '//end_of(run%sim))
         call print_summary(line, run, messages, error, exit_code, ok)
         if (.not. ok) exit_code = error_code%output
         return
      end if
      call run%reopen(messages, error)
      if (allocated(error)) then
         call report_failure(line, messages, error, exit_code)
         return
      end if
      if (line%watch) call viewer%open(run%output)
      call progress%begin(line%quiet)
      call step_until_done(run, line%quiet, progress, error)
      call progress%finish()
      call end_run(line, run, messages, error, exit_code)
      call viewer%wait()
   end subroutine run_resume

   !> Apply the options of the command line: end of the run, threads, limits.
   subroutine apply_command_line(line, run, error)
      type(command_line_type), intent(in) :: line
      type(run_type), intent(inout) :: run
      type(error_type), allocatable, intent(out) :: error
      associate (parameters => run%sim%parameters, step => run%sim%state%step, time => run%sim%state%time)
         if (is_set(line%t_end)) then
            if (line%t_end < time*(1 - 1.0e-12_wp)) then
               call make_error(error, error_code%input, 'option --t-end: the checkpoint is at time '// &
                               to_string(time)//' already')
               return
            end if
            parameters%t_end = line%t_end
            ! with only an end time given, the number of steps is not a limit
            if (.not. is_set(line%steps)) parameters%n_steps = huge(1)
         end if
         if (is_set(line%steps)) then
            parameters%n_steps = step + min(line%steps, huge(1) - step)
            ! more steps after an end time that has been reached
            if (.not. (is_set(line%t_end) .or. time < parameters%t_end*(1 - 1.0e-12_wp))) &
               parameters%t_end = huge(1.0_wp)
         end if
      end associate
      if (is_set(line%threads)) run%facts%threads = line%threads
      call run%threads%start(run%sim%blocks%n_blocks, run%facts%threads)
      if (is_set(line%checkpoint_every)) run%facts%checkpoint_every = line%checkpoint_every
      if (is_set(line%max_wall)) run%deadline = run%start + line%max_wall
      run%strict = line%strict
   end subroutine apply_command_line

   !> Why a run is done, and what continues it.
   pure function end_of(sim) result(text)
      type(simulation_type), intent(in) :: sim
      character(:), allocatable :: text
      if (sim%state%step >= sim%parameters%n_steps) then
         text = 'the run has done all its '//to_string(sim%state%step)//' steps; --steps N adds N more'
      else if (.not. sim%state%time < sim%parameters%t_end*(1 - 1.0e-12_wp)) then
         text = 'the run has reached its end, time '//to_string(sim%state%time)//'; --t-end T or --steps N continues it'
      else
         text = 'the last stage of the run is over, after '//to_string(sim%state%step)//' steps; '// &
                'to continue, run the model with one more &stage'
      end if
   end function end_of

end module rockdda_app_command_resume
