! SPDX-License-Identifier: MIT
!> The run of the failing trial nearest to the factor as a results file, with the search in the group `search`
!> (docs/file-formats.md, "results").
module rockdda_run_search_results
   use rockdda_base_error, only : error_type
   use rockdda_base_diagnostics, only : diagnostics_type
   use rockdda_base_kinds, only : wp
   use rockdda_model_options, only : is_set
   use rockdda_io_checkpoint, only : checkpoint_path
   use rockdda_io_hdf5_adapter, only : hdf5_file_type
   use rockdda_io_posix, only : remove_file
   use rockdda_io_results_tables, only : write_units
   use rockdda_io_timestamp, only : wall_seconds
   use rockdda_run_factor_search, only : factor_search_type
   use rockdda_run_hdf5_lock, only : lock_hdf5, unlock_hdf5
   use rockdda_run_input, only : model_input_type, run_request_type
   use rockdda_run_model_run, only : run_type
   use rockdda_run_mechanism, only : kind_of
   use rockdda_run_search_options, only : search_names
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
      call compute_trial(search%settled, search%options, search%searched, trial%value, .not. trial%is_sure, &
                         observer, run, again, interrupted, error)
      if (interrupted) run%reason = 'stopped'
      call run%close(error)
      if (allocated(error) .or. interrupted) return
      ! nothing is left to be continued
      call remove_file(checkpoint_path(output))
      call lock_hdf5()
      call write_search(search, trial, output, error)
      call unlock_hdf5()
   end subroutine write_failing_trial

   !> Write the group `search`.
   subroutine write_search(search, trial, path, error)
      type(factor_search_type), intent(in) :: search
      type(trial_type), intent(in) :: trial      !! that of the file
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(out) :: error
      type(hdf5_file_type) :: file
      real(wp) :: low, high
      low = min(search%state%stable, search%state%failing)
      high = max(search%state%stable, search%state%failing)
      call file%open(path, .true., error)
      if (.not. allocated(error)) call file%create_group('search', error)
      if (.not. allocated(error)) call file%set_attribute('search', 'search', &
                                                          trim(search_names(search%options%kind)), error)
      if (.not. allocated(error)) call file%set_attribute('search', 'kind', kind_of(trial%mechanism), error)
      call put_reals('factor', [low + (high - low)/2])
      call put_reals('low', [low])
      call put_reals('high', [high])
      call put_reals('settled_strength', [search%strength])
      call put_reals('value', search%tried%value)
      call put_reals('unbalanced', search%tried%unbalanced)
      call put_reals('displacement', search%tried%displacement)
      call put_reals('seconds', search%tried%seconds)
      call put_integers('stable', merge(1, 0, search%tried%stable))
      call put_integers('steps', search%tried%steps)
      ! segments of linings are no blocks of the results
      associate (m => trial%mechanism, all => search%settled%blocks)
         call put_integers('blocks', pack(m%blocks, m%blocks <= all%n_blocks - all%n_segments) - 1)
         call put_integers('block_kind', pack(m%kinds, m%blocks <= all%n_blocks - all%n_segments))
      end associate
      if (.not. allocated(error)) call write_units(file, search%settled%parameters%units, error, group='search')
      if (allocated(error)) then
         call file%abandon()
      else
         call file%close(error)
      end if

   contains

      !> One dataset.
      subroutine put_reals(name, values)
         character(len=*), intent(in) :: name
         real(wp), intent(in) :: values(:)
         if (.not. allocated(error)) call file%write('search/'//name, [size(values)], values, error)
      end subroutine put_reals

      !> One dataset.
      subroutine put_integers(name, values)
         character(len=*), intent(in) :: name
         integer, intent(in) :: values(:)
         if (.not. allocated(error)) call file%write('search/'//name, [size(values)], values, error)
      end subroutine put_integers

   end subroutine write_search

end module rockdda_run_search_results
