! SPDX-License-Identifier: MIT
!> rockdda fos: search the factor at which a model loses its equilibrium.
module rockdda_app_command_fos
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_base_kinds, only : wp
   use rockdda_model_options, only : is_set
   use rockdda_io_timestamp, only : wall_seconds
   use rockdda_run_factor_search, only : factor_search_type
   use rockdda_run_model_input, only : model_input_type, read_model
   use rockdda_run_output_choice, only : choose_output
   use rockdda_run_search_results, only : write_failing_trial
   use rockdda_run_thread_choice, only : thread_choice_type
   use rockdda_app_arguments, only : command_line_type
   use rockdda_app_command_run, only : find_run_files
   use rockdda_app_process, only : print_error, watch_signals
   use rockdda_app_report, only : show_messages, report_failure
   use rockdda_app_search_report, only : search_watch_type, print_factor, stem_of_search
   implicit none
   private
   public :: run_fos

contains

   !> Run the command; returns the exit code.
   subroutine run_fos(line, exit_code)
      type(command_line_type), intent(in) :: line
      integer, intent(out) :: exit_code
      type(command_line_type) :: request
      type(model_input_type) :: input
      type(diagnostics_type) :: messages
      type(error_type), allocatable :: error
      type(factor_search_type), allocatable :: search
      type(search_watch_type) :: watch
      character(len=:), allocatable :: output
      logical :: ok, over
      type(thread_choice_type) :: threads
      allocate (search)
      output = ''
      watch%request%deadline = huge(1.0_wp)
      ! a model without stages need not say where its run ends
      request = line
      if (.not. is_set(request%steps)) request%steps = huge(1)
      call find_run_files(line, input, messages, error)
      if (.not. allocated(error) .and. .not. messages%has_errors()) call read_model(request, input, messages, error)
      if (.not. allocated(error) .and. .not. messages%has_errors()) then
         call threads%start(input%blocks%n_blocks, input%options%threads)
         if (len(line%output) > 0) call choose_output(line, input, output, error)
         if (.not. allocated(error)) call search%prepare(input, line%search, stem_of_search(output, input), error)
      end if
      if (is_set(input%options%max_wall)) watch%request%deadline = wall_seconds() + input%options%max_wall
      if (allocated(error) .or. messages%has_errors()) then
         call report_failure(line, messages, error, exit_code)
         return
      end if
      messages = messages%summarised()
      if (.not. line%quiet) call show_messages(messages, severity%warning)
      call watch_signals()
      call watch%begin(line%quiet)
      call search%run(input, watch, error)
      ! a search without a factor is over, too; one that failed may go on from its trials
      over = .not. search%interrupted
      if (len(search%note) > 0) call messages%add(severity%warning, search%note)
      if (over .and. .not. allocated(error) .and. len(output) > 0 .and. search%has_factor()) &
         call write_failing_trial(search, line, input, output, messages, watch, search%interrupted, error)
      call watch%finish()
      if (over .and. .not. search%interrupted) call search%clean_up()
      if (search%interrupted .and. .not. allocated(error)) call make_error(error, error_code%stopped, 'stopped ('// &
         watch%request%reason()//'); the same command continues from the trials in '//search%stem()//'.txt')
      if (allocated(error)) then
         call report_failure(line, no_messages(), error, exit_code)
         return
      end if
      call print_factor(line, search, output, ok)
      exit_code = 0
      if (search%options%has_factors() .and. .not. search%stands()) exit_code = error_code%computation
      if (.not. ok) exit_code = error_code%output
   end subroutine run_fos

   !> Messages that were shown already.
   pure type(diagnostics_type) function no_messages()
      no_messages%n = 0
   end function no_messages

end module rockdda_app_command_fos
