! SPDX-License-Identifier: MIT
!> rockdda run: compute the motion of blocks in time.
module rockdda_app_command_run
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
   use rockdda_app_process, only : watch_signals, set_writing
   use rockdda_app_progress, only : progress_type
   use rockdda_app_report, only : show_messages, report_failure
   use rockdda_app_running, only : step_until_done, end_run, prepare_sudden_end
   use rockdda_app_viewer, only : viewer_type
   implicit none
   private
   public :: run_run, find_run_files

contains

   !> Run the command; returns the exit code.
   subroutine run_run(line, exit_code)
      type(command_line_type), intent(in) :: line
      integer, intent(out) :: exit_code
      type(model_input_type), allocatable :: input
      type(diagnostics_type) :: messages
      type(error_type), allocatable :: error
      type(run_type) :: run
      type(progress_type) :: progress
      type(viewer_type) :: viewer

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
      if (line%watch) call viewer%open(run%output)
      call progress%begin(line%quiet)
      call step_until_done(run, line%quiet, progress, error)
      call progress%finish()
      call end_run(line, run, messages, error, exit_code)
      call viewer%wait()
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

end module rockdda_app_command_run
