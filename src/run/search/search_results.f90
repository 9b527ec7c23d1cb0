! SPDX-License-Identifier: MIT
!> The run of the failing trial nearest to the factor as a results file, with the search in the group `search`
!> (docs/file-formats.md, "results").
module rockdda_run_search_results
   use rockdda_base_error, only : error_type
   use rockdda_base_diagnostics, only : diagnostics_type
   use rockdda_model_options, only : is_set
   use rockdda_io_checkpoint, only : checkpoint_path
   use rockdda_io_posix, only : remove_file
   use rockdda_io_timestamp, only : wall_seconds
   use rockdda_run_factor_search, only : factor_search_type
   use rockdda_run_hdf5_lock, only : lock_hdf5, unlock_hdf5
   use rockdda_run_input, only : model_input_type, run_request_type
   use rockdda_run_model_run, only : run_type
   use rockdda_run_search_group, only : write_search
   use rockdda_run_trial, only : trial_type, search_observer_type, begin_trial, compute_trial
   implicit none
   private
   public :: write_failing_trial

   !> Frames of the file, about.
   integer, parameter :: usual_frames = 100

contains

   !> Compute the failing trial once more and write it. `interrupted`: a stop was requested; the file ends there.
   subroutine write_failing_trial(search, request, input, output, messages, observer, interrupted, error)
      type(factor_search_type), intent(in) :: search
      class(run_request_type), intent(in) :: request
      type(model_input_type), intent(in) :: input
      character(len=*), intent(in) :: output          !! path of the results
      type(diagnostics_type), intent(in) :: messages
      class(search_observer_type), intent(in) :: observer
      logical, intent(out) :: interrupted
      type(error_type), allocatable, intent(out) :: error
      type(run_type), allocatable :: run
      type(model_input_type) :: shown
      type(trial_type) :: trial, again
      interrupted = .false.
      trial = search%limit_trial(stable=.false.)
      allocate (run)
      call begin_trial(search%settled, search%searched, trial%value, trial%beginning, run%sim, error)
      if (allocated(error)) return
      run%sim%parameters%n_steps = run%sim%state%step + trial%steps
      shown = input
      shown%parameters = run%sim%parameters
      if (.not. (is_set(shown%options%save_every) .or. is_set(shown%options%save_dt))) &
         shown%options%save_every = max(1, trial%steps/usual_frames)
      run%output = output
      run%reason = 'finished'
      run%start = wall_seconds()
      call run%open(request, shown, messages, error)
      if (allocated(error)) return
      call compute_trial(search%settled, search%options, search%searched, trial%value, observer, run, again, &
                         interrupted, error)
      if (interrupted) run%reason = 'stopped'
      call run%close(error)
      if (allocated(error) .or. interrupted) return
      ! nothing is left to be continued
      call remove_file(checkpoint_path(output))
      call lock_hdf5()
      call write_search(search, trial, output, error)
      call unlock_hdf5()
   end subroutine write_failing_trial

end module rockdda_run_search_results
