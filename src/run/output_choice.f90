! SPDX-License-Identifier: MIT
!> Choose the output of a new run without overwriting other files.
module rockdda_run_output_choice
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_io_checkpoint, only : checkpoint_path, results_path, checkpoint_info_type, read_checkpoint_info
   use rockdda_io_log, only : log_path
   use rockdda_io_output_lock, only : is_same_file
   use rockdda_io_posix, only : get_path_kind, path_kind
   use rockdda_run_input, only : model_input_type, run_name, run_request_type
   use rockdda_run_hdf5_lock, only : lock_hdf5, unlock_hdf5
   implicit none
   private
   public :: choose_output, require_folder

contains

   !> Choose the path of the results: from the command line, the options, or the name of the run; never an
   !> input file, and an existing file only with `force`.
   subroutine choose_output(request, input, output, error)
      class(run_request_type), intent(in) :: request
      type(model_input_type), intent(in) :: input
      character(len=:), allocatable, intent(out) :: output
      type(error_type), allocatable, intent(out) :: error
      output = run_name(input)//'.h5'
      if (allocated(input%options%output_file)) then
         if (len_trim(input%options%output_file) > 0) output = trim(input%options%output_file)
      end if
      if (.not. input%in_memory) call protect_inputs(output)
      if (.not. allocated(error) .and. .not. input%in_memory) call protect_inputs(log_path(output))
      if (.not. allocated(error) .and. .not. input%in_memory) call protect_inputs(checkpoint_path(output))
      if (.not. allocated(error)) call protect_neighbour(output, error)
      if (.not. allocated(error)) call require_folder(output, error)
      if (allocated(error)) return
      if (request%force) return
      if (get_path_kind(output) == path_kind%file) &
         call make_error(error, error_code%input, output//': the file exists; use --force to overwrite it')

   contains

      !> Refuse an output that is an input file.
      subroutine protect_inputs(path)
         character(len=*), intent(in) :: path
         logical :: same(3)
         same(1) = is_same_file(path, input%model_file)
         same(2) = is_same_file(path, input%analysis_file)
         same(3) = is_same_file(path, input%config_file)
         if (any(same)) call make_error(error, error_code%input, path//': the output would overwrite an input file')
      end subroutine protect_inputs

   end subroutine choose_output

   !> Require that the folder of an output exists. It is not created, because a mistyped name would create one.
   subroutine require_folder(output, error)
      character(len=*), intent(in) :: output
      type(error_type), allocatable, intent(out) :: error
      integer :: slash
      slash = index(output, '/', back=.true.)
      if (slash < 2) return
      if (get_path_kind(output(1:slash - 1)) == path_kind%missing) call make_error(error, error_code%output, output// &
         ": the folder '"//output(1:slash - 1)//"' does not exist; make it first: mkdir -p '"//output(1:slash - 1)//"'")
   end subroutine require_folder

   !> Refuse an output whose checkpoint belongs to other existing results, also with `force`: results whose names differ
   !> only in the ending share the name of the checkpoint.
   subroutine protect_neighbour(output, error)
      character(len=*), intent(in) :: output
      type(error_type), allocatable, intent(out) :: error
      type(checkpoint_info_type) :: info
      type(error_type), allocatable :: no_checkpoint
      character(len=:), allocatable :: checkpoint, neighbour
      checkpoint = checkpoint_path(output)
      if (get_path_kind(checkpoint) /= path_kind%file) return
      call lock_hdf5()
      call read_checkpoint_info(checkpoint, info, no_checkpoint)
      call unlock_hdf5()
      if (allocated(no_checkpoint)) return
      neighbour = results_path(checkpoint, info%facts%results_ending)
      if (neighbour == output) return
      if (get_path_kind(neighbour) /= path_kind%file) return
      call make_error(error, error_code%input, output//': these results would have the checkpoint '//checkpoint// &
                      ', which is that of '//neighbour//'; take another name')
   end subroutine protect_neighbour

end module rockdda_run_output_choice
