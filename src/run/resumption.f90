! SPDX-License-Identifier: MIT
!> Results and checkpoint of a run that is to be continued.
module rockdda_run_resumption
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_base_version, only : version, build_description
   use rockdda_stepping_simulation, only : simulation_type
   use rockdda_io_checkpoint, only : checkpoint_path, results_path
   use rockdda_io_hdf5_driver, only : undo_path
   use rockdda_io_posix, only : get_path_kind, path_kind, remove_file
   use rockdda_io_results_info, only : results_info_type, read_results_info
   use rockdda_run_checkpointing, only : load_checkpoint
   use rockdda_run_files, only : run_files_type
   use rockdda_run_hdf5_lock, only : lock_hdf5, unlock_hdf5
   implicit none
   private
   public :: load_files, have_results, find_kept, find_completion, format_as_compiler

contains

   !> Read a checkpoint and find the results beside it. Nothing is changed.
   subroutine load_files(path, files, sim, messages, error)
      character(len=*), intent(in) :: path
      class(run_files_type), intent(inout) :: files
      type(simulation_type), intent(inout) :: sim
      type(diagnostics_type), intent(inout) :: messages
      type(error_type), allocatable, intent(out) :: error
      call lock_hdf5()
      call load_checkpoint(path, sim, files%facts, files%digest, error)
      call unlock_hdf5()
      if (allocated(error)) then
         call format_as_compiler(path, error)
         if (len(results_path(path, '.h5')) > 0) return
         if (get_path_kind(checkpoint_path(path)) == path_kind%file) &
            error%message = error%message//'; the checkpoint of these results is '//checkpoint_path(path)
         return
      end if
      if (files%facts%header%program_version /= version) then
         call make_error(error, error_code%input, path//': error: was written by version '// &
                         files%facts%header%program_version//' of the program, this is version '//version// &
                         '; resume with the version that began the run')
         return
      end if
      if (files%facts%build /= build_description()) call messages%add(severity%warning, path// &
         ' was written by another build of this version: last digits of the results may differ')
      files%output = results_path(path, files%facts%results_ending)
      if (len(files%output) == 0) then
         call make_error(error, error_code%input, path//": error: the name of a checkpoint ends in '.ckpt.h5': "// &
                         'the path of its results follows from it')
         return
      end if
      call files%take_names()
      files%checkpoint_file = path
      call files%take_progress(sim%state%step)
   end subroutine load_files

   !> Does the output file exist and belong to this run? It may have been removed or replaced.
   logical function have_results(files)
      class(run_files_type), intent(in) :: files
      type(results_info_type) :: info
      call read_own_results(files, info, have_results)
   end function have_results

   !> What is in the output file, if it is there and belongs to this run: after a failure it may be less than was
   !> computed.
   subroutine find_kept(files, info, found)
      class(run_files_type), intent(in) :: files
      type(results_info_type), intent(out) :: info
      logical, intent(out) :: found
      call read_own_results(files, info, found)
      if (.not. found) info = results_info_type()
   end subroutine find_kept

   !> Find out whether a loaded run has reached its end with complete results. Then remove its undo file.
   subroutine find_completion(files, sim, is_complete)
      class(run_files_type), intent(inout) :: files
      type(simulation_type), intent(in) :: sim
      logical, intent(out) :: is_complete
      type(results_info_type) :: info
      is_complete = sim%is_finished()
      if (.not. is_complete) return
      call read_own_results(files, info, is_complete)
      if (is_complete) is_complete = info%complete .and. info%last_step == sim%state%step
      if (.not. is_complete) return
      files%n_frames = int(info%n_frames)
      ! left by a kill after the results were complete
      call remove_file(undo_path(files%output))
   end subroutine find_completion

   !> Read about the results, if they exist and are those of this run.
   subroutine read_own_results(files, info, are_own)
      class(run_files_type), intent(in) :: files
      type(results_info_type), intent(out) :: info
      logical, intent(out) :: are_own
      type(error_type), allocatable :: unreadable
      call lock_hdf5()
      call read_results_info(files%output, info, unreadable)
      call unlock_hdf5()
      are_own = .not. allocated(unreadable)
      if (are_own) are_own = info%created == files%facts%header%created
   end subroutine read_own_results

   !> Format a message about a file as "FILE: error: what".
   subroutine format_as_compiler(path, error)
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(inout) :: error
      if (index(error%message, path//': ') /= 1 .or. index(error%message, ': error: ') > 0) return
      error%message = path//': error: '//error%message(len(path) + 3:)
   end subroutine format_as_compiler

end module rockdda_run_resumption
