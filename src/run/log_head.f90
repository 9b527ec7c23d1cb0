! SPDX-License-Identifier: MIT
!> The head of the log: files, model, messages, and every number of the run with the value that it has.
module rockdda_run_log_head
!$ use omp_lib, only : omp_get_max_threads
   use rockdda_base_error, only : error_type
   use rockdda_base_diagnostics, only : diagnostics_type
   use rockdda_base_version, only : build_description
   use rockdda_model_options, only : run_options_type
   use rockdda_model_resolve, only : length_scale
   use rockdda_io_log, only : log_type
   use rockdda_io_results_header, only : results_header_type
   use rockdda_run_frame_plan, only : frame_plan_type
   use rockdda_run_model_input, only : model_input_type
   implicit none
   private
   public :: write_log_head

contains

   !> Write the head of the log.
   subroutine write_log_head(log, input, header, output, plan, messages, error)
      type(log_type), intent(inout) :: log
      type(model_input_type), intent(in) :: input
      type(results_header_type), intent(in) :: header
      character(len=*), intent(in) :: output              !! path of the results
      type(frame_plan_type), intent(in) :: plan
      type(diagnostics_type), intent(in) :: messages
      type(error_type), allocatable, intent(out) :: error
      call log%put(build_description(), error)
      if (.not. allocated(error)) call log%put('title: '//header%title, error)
      if (.not. allocated(error)) call log%put('created: '//header%created, error)
      if (.not. allocated(error)) call log%put('geometry or blocks: '//input%model_file, error)
      if (.not. allocated(error) .and. len(input%analysis_file) > 0) call log%put('analysis: '//input%analysis_file, &
                                                                                  error)
      if (.not. allocated(error) .and. len(input%config_file) > 0) call log%put('options: '//input%config_file, error)
      if (.not. allocated(error)) call log%put('results: '//output, error)
      if (.not. allocated(error)) call log%put_model(input%blocks, error)
      if (.not. allocated(error)) call log%put_messages(messages, error)
      if (.not. allocated(error)) call log%put_parameters(input%parameters, error, &
                                                          options_in_effect(input, output, plan))
      if (.not. allocated(error)) call log%put_columns(error)
      if (.not. allocated(error)) call log%flush(error)
   end subroutine write_log_head

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

end module rockdda_run_log_head
