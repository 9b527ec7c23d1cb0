! SPDX-License-Identifier: MIT
!> rockdda run: compute the motion of blocks in time.
!>
!> rockdda resume: continue a run from its checkpoint, with the results of a run without a stop.
module rockdda_app_command_run
   use, intrinsic :: iso_c_binding, only : c_char, c_int, c_null_char
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_base_strings, only : to_string
   use rockdda_model_options, only : is_set
   use rockdda_io_posix, only : get_path_kind, path_kind
   use rockdda_io_recognise, only : file_kind, kind_of_ending, recognise
   use rockdda_io_timestamp, only : wall_seconds
   use rockdda_run_find_files, only : find_files
   use rockdda_run_model_input, only : model_input_type, read_model
   use rockdda_run_model_run, only : run_type
   use rockdda_app_arguments, only : command_line_type
   use rockdda_app_process, only : watch_signals, set_writing, print_error
   use rockdda_app_progress, only : progress_type
   use rockdda_app_report, only : show_messages, report_failure
   use rockdda_app_running, only : step_until_done, end_run, prepare_sudden_end, print_summary
   use rockdda_base_kinds, only : wp
   use rockdda_stepping_simulation, only : simulation_type
   implicit none
   private
   public :: run_run, find_run_files, run_resume

   interface
      integer(c_int) function c_start(name, path) bind(C, name='rockdda_viewer_start')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: name(*), path(*)
      end function c_start
      subroutine c_wait(process) bind(C, name='rockdda_viewer_wait')
         import :: c_int
         integer(c_int), value :: process
      end subroutine c_wait
   end interface

contains

   !> Run the command; returns the exit code.
   subroutine run_run(line, exit_code)
      type(command_line_type), intent(in) :: line
      integer, intent(out) :: exit_code
      type(model_input_type), allocatable :: input
      type(diagnostics_type) :: messages
      type(error_type), allocatable :: error
      type(run_type) :: run

      run%start = wall_seconds()
      allocate (input)
      call find_run_files(line, input, messages, error)
      if (.not. allocated(error) .and. .not. messages%has_errors()) call read_model(line, input, messages, error)
      if (.not. allocated(error) .and. .not. messages%has_errors()) then
         call run%threads%start(input%blocks%n_blocks, input%options%threads)
         call run%prepare(line, input, error)
      end if
      if (is_set(input%options%max_wall)) run%deadline = run%start + input%options%max_wall
      run%strict = input%options%strict
      ! no output exists so far, and none is written for invalid input; from here on a signal ends the run in order, and
      ! a second one once there is a checkpoint
      call watch_signals()
      call set_writing(.true.)
      if (.not. allocated(error) .and. .not. messages%has_errors()) call run%open(line, input, messages, error)
      if (allocated(error) .or. messages%has_errors()) then
         call report_failure(line, messages, error, exit_code)
         return
      end if
      ! the run has copies of what it needs
      deallocate (input)
      ! the log contains all of them
      messages = messages%summarised()
      call prepare_sudden_end(line, run, messages)
      call set_writing(.false.)
      if (.not. line%quiet) call show_messages(messages, severity%warning)
      call compute(line, run, messages, exit_code)
   end subroutine run_run

   !> Find the files of the command line.
   subroutine find_run_files(line, input, messages, error)
      type(command_line_type), intent(in) :: line
      type(model_input_type), intent(inout) :: input
      type(diagnostics_type), intent(inout) :: messages
      type(error_type), allocatable, intent(out) :: error
      type(error_type), allocatable :: unreadable
      integer :: kind
      if (size(line%files) == 1) then
         kind = kind_of_ending(line%files(1)%text)
         if (get_path_kind(line%files(1)%text) == path_kind%file) call recognise(line%files(1)%text, kind, unreadable)
         if (allocated(unreadable)) then
            call move_alloc(unreadable, error)
            return
         end if
         if (get_path_kind(line%files(1)%text) /= path_kind%file .or. &
             any(kind == [file_kind%options, file_kind%labelled, file_kind%hdf5, file_kind%checkpoint])) then
            call find_files(line%files(1)%text, '', line%config, input, messages, error)
            return
         end if
      end if
      if (size(line%files) == 2) then
         call find_files(line%files(1)%text, line%files(2)%text, line%config, input, messages, error)
         return
      end if
      call make_error(error, error_code%input, "'rockdda "//line%command//"' needs a geometry or block file and "// &
                      'an analysis file, one labelled file, or one folder with them; found '// &
                      to_string(size(line%files))// &
                      trim(merge(' file ', ' files', size(line%files) == 1))// &
                      ", see 'rockdda "//line%command//" --help'")
   end subroutine find_run_files

   !> Run the command; returns the exit code.
   subroutine run_resume(line, exit_code)
      type(command_line_type), intent(in) :: line
      integer, intent(out) :: exit_code
      type(run_type) :: run
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
      call compute(line, run, messages, exit_code)
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

   !> Compute the steps of a run, with the viewer of its results file beside it where the user wants that. Without a
   !> viewer the run continues, with a warning; it ends when the user has ended the viewer.
   subroutine compute(line, run, messages, exit_code)
      type(command_line_type), intent(in) :: line
      type(run_type), intent(inout) :: run
      type(diagnostics_type), intent(in) :: messages
      integer, intent(out) :: exit_code
      type(progress_type) :: progress
      type(error_type), allocatable :: error
      integer(c_int) :: viewer
      viewer = -1
      if (line%watch) then
         viewer = c_start('rockdda-post'//c_null_char, run%output//c_null_char)
         if (viewer < 0) call print_error('rockdda: warning: --watch: rockdda-post lies neither beside rockdda '// &
                                          'nor on the PATH; the run continues without a viewer')
      end if
      call progress%begin(line%quiet)
      call step_until_done(run, line%quiet, progress, error)
      call progress%finish()
      call end_run(line, run, messages, error, exit_code)
      if (viewer < 0) return
      call print_error('rockdda: the viewer runs until Ctrl-C')
      call c_wait(viewer)
   end subroutine compute

end module rockdda_app_command_run
