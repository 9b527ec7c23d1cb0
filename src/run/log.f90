! SPDX-License-Identifier: MIT
!> The log of a run: files, model, messages, every number of the run with the value that it has, steps, and the end.
module rockdda_run_log
   use rockdda_base_kinds, only : wp
!$ use omp_lib, only : omp_get_max_threads
   use rockdda_base_error, only : error_type
   use rockdda_base_diagnostics, only : diagnostics_type
   use rockdda_base_strings, only : counted, to_string
   use rockdda_base_version, only : build_description
   use rockdda_model_options, only : run_options_type
   use rockdda_model_resolve, only : length_scale
   use rockdda_stepping_simulation, only : simulation_type
   use rockdda_io_log, only : log_type
   use rockdda_io_results_header, only : results_header_type
   use rockdda_io_timestamp, only : utc_now
   use rockdda_run_frame_plan, only : frame_plan_type
   use rockdda_run_input, only : model_input_type
   use rockdda_run_outcome, only : cuts_text, reactions_text, time_error_text, strikes_text
   use rockdda_run_supports, only : supports_text
   implicit none
   private
   public :: run_log_type

   !> Approximate number of lines for steps.
   integer, parameter :: log_lines = 1000

   type, extends(log_type) :: run_log_type
      integer :: last_step = -1                             !! with a line
      character(len=:), allocatable, private :: choice      !! of the automatic solver, as logged
   contains
      procedure :: begin
      procedure :: reopen
      procedure, nopass :: is_line_due
      procedure :: write_step
      procedure :: write_outcome
   end type run_log_type

contains

   !> Open the log, and write its head.
   subroutine begin(self, path, input, header, output, plan, messages, error)
      class(run_log_type), intent(inout) :: self
      character(len=*), intent(in) :: path
      type(model_input_type), intent(in) :: input
      type(results_header_type), intent(in) :: header
      character(len=*), intent(in) :: output              !! path of the results
      type(frame_plan_type), intent(in) :: plan
      type(diagnostics_type), intent(in) :: messages
      type(error_type), allocatable, intent(out) :: error
      call self%open(path, error)
      if (.not. allocated(error)) call self%put(build_description(), error)
      if (.not. allocated(error)) call self%put('title: '//header%title, error)
      if (.not. allocated(error)) call self%put('created: '//header%created, error)
      if (.not. allocated(error)) call self%put('geometry or blocks: '//input%model_file, error)
      if (.not. allocated(error) .and. len(input%analysis_file) > 0) call self%put('analysis: '//input%analysis_file, &
                                                                                  error)
      if (.not. allocated(error) .and. len(input%config_file) > 0) call self%put('options: '//input%config_file, error)
      if (.not. allocated(error)) call self%put('results: '//output, error)
      if (.not. allocated(error)) call self%put_model(input%blocks, error)
      if (.not. allocated(error)) call self%put_messages(messages, error)
      if (.not. allocated(error)) call self%put_parameters(input%parameters, error, &
                                                          options_in_effect(input, output, plan))
      if (.not. allocated(error)) call self%put_columns(error)
      if (.not. allocated(error)) call self%flush(error)
   end subroutine begin

   !> The options, those that were not given with the value that the run takes instead.
   function options_in_effect(input, output, plan) result(options)
      type(model_input_type), intent(in) :: input
      character(len=*), intent(in) :: output
      type(frame_plan_type), intent(in) :: plan
      type(run_options_type) :: options
      options = input%options
      options%save_every = plan%every
      options%output_file = output
      options%threads = 1
!$    options%threads = omp_get_max_threads()
      options%length_scale = length_scale(input%options%length_scale, input%analysis%dialect)
   end function options_in_effect

   !> Open the log of a run that continues from a checkpoint, at its end.
   subroutine reopen(self, path, sim, messages, error)
      class(run_log_type), intent(inout) :: self
      character(len=*), intent(in) :: path
      type(simulation_type), intent(in) :: sim
      type(diagnostics_type), intent(in) :: messages
      type(error_type), allocatable, intent(out) :: error
      call self%open(path, error, append=.true.)
      if (.not. allocated(error)) call self%put('resumed: from step '//to_string(sim%state%step)//' at time '// &
                                                to_string(sim%state%time, 10)//', '//utc_now(), error)
      if (.not. allocated(error)) call self%put_messages(messages, error)
      if (.not. allocated(error)) call self%put_columns(error)
   end subroutine reopen

   !> Is a line due for the last step? For the first one, for steps with several attempts or a frame, and for so many
   !> that the log has about `log_lines`.
   pure logical function is_line_due(sim, has_frame)
      type(simulation_type), intent(in) :: sim
      logical, intent(in) :: has_frame
      integer :: every
      every = 1
      if (sim%parameters%n_steps < huge(1)) every = max(1, sim%parameters%n_steps/log_lines)
      is_line_due = has_frame .or. sim%state%step == 1 .or. mod(sim%state%step, every) == 0 .or. &
                    sim%record%attempts > 1
   end function is_line_due

   !> Write the line of a step, and one more when the automatic solver has changed its method.
   subroutine write_step(self, sim, error)
      class(run_log_type), intent(inout) :: self
      type(simulation_type), intent(in) :: sim
      type(error_type), allocatable, intent(out) :: error
      call self%put_step(sim%record, sim%parameters, error)
      if (.not. allocated(error)) call write_choice(self, sim, error)
      self%last_step = sim%state%step
   end subroutine write_step

   !> Write a line when the automatic solver has changed its method.
   subroutine write_choice(self, sim, error)
      type(run_log_type), intent(inout) :: self
      type(simulation_type), intent(in) :: sim
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: name
      if (.not. allocated(sim%solver%choice)) return
      name = sim%solver%choice(1:scan(sim%solver%choice//' ', ' :') - 1)
      if (allocated(self%choice)) then
         if (self%choice == name) return
      end if
      call self%put('# solver from here on: '//sim%solver%choice, error)
      self%choice = name
   end subroutine write_choice

   !> Write forces of boundaries, planned time and cut steps.
   subroutine write_outcome(self, sim, error)
      class(run_log_type), intent(inout) :: self
      type(simulation_type), intent(in) :: sim
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: planned, supports
      if (size(sim%parameters%boundaries) > 0) call self%put(reactions_text(sim), error)
      supports = supports_text(sim, '# ')
      if (.not. allocated(error) .and. len(supports) > 0) call self%put(supports, error)
      planned = 'none, the stages decide'
      if (sim%planned_time() > 0) planned = to_string(sim%planned_time(), 10)
      if (.not. allocated(error)) call self%put('# planned time: '//planned//'. '//cuts_text(sim), error)
      if (.not. allocated(error) .and. len(time_error_text(sim)) > 0) call self%put('# '//time_error_text(sim), error)
      if (.not. allocated(error) .and. len(strikes_text(sim)) > 0) call self%put('# '//strikes_text(sim), error)
      if (.not. allocated(error) .and. sim%parameters%sleeps) &
         call self%put('# asleep: '//to_string(count(sim%state%asleep))//' of '// &
                       counted(sim%blocks%n_blocks - sim%blocks%n_segments, 'block')// &
                       '; the unbalanced force is that of the others', error)
   end subroutine write_outcome

end module rockdda_run_log
