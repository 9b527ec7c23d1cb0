! SPDX-License-Identifier: MIT
!> What a file holds, read by itself according to its kind, for commands that take files of any kind.
module rockdda_io_file_content
   use rockdda_base_error, only : error_type
   use rockdda_base_diagnostics, only : diagnostics_type
   use rockdda_model_analysis_input, only : analysis_input_type
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_geometry_input, only : geometry_input_type
   use rockdda_model_options, only : run_options_type
   use rockdda_lines_statistics, only : statistics_type
   use rockdda_io_analysis_file, only : read_analysis_source
   use rockdda_io_block_file, only : read_block_source
   use rockdda_io_geometry_file, only : read_geometry_source
   use rockdda_io_namelist_file, only : read_options_source
   use rockdda_io_recognise, only : file_kind
   use rockdda_io_results_info, only : results_info_type, read_results_info
   use rockdda_io_source, only : source_type, read_source
   use rockdda_io_statistics_file, only : read_statistics_source
   implicit none
   private
   public :: file_content_type

   !> Of these, the one of the file's kind.
   type :: file_content_type
      logical :: valid = .false.               !! read without errors
      type(geometry_input_type) :: geometry
      type(analysis_input_type) :: analysis
      type(block_system_type) :: blocks
      type(run_options_type) :: options
      type(statistics_type) :: statistics
      type(results_info_type) :: results
   contains
      procedure :: read => read_content
   end type file_content_type

contains

   !> Read a file of a known kind. Checkpoints, and kinds that the program does not read, are left to the caller.
   subroutine read_content(self, path, kind, dialect, points, messages)
      class(file_content_type), intent(inout) :: self
      character(len=*), intent(in) :: path
      integer, intent(in) :: kind                  !! one of file_kind%...
      integer, intent(in) :: dialect               !! of an analysis file, one of dialect%...
      integer, intent(in) :: points(2)             !! fixed and loading points of its model, -1 unknown
      type(diagnostics_type), intent(inout) :: messages
      type(source_type) :: source
      type(error_type), allocatable :: error
      integer :: before
      logical :: ok
      before = messages%n_errors
      self%valid = .false.
      if (all(kind /= [file_kind%hdf5, file_kind%checkpoint, file_kind%ddaml, file_kind%unknown])) then
         call read_source(path, source, messages, ok)
         if (.not. ok) return
      end if
      select case (kind)
      case (file_kind%geometry)
         call read_geometry_source(source, self%geometry, messages)
      case (file_kind%analysis)
         call read_analysis_source(source, points(1), points(2), dialect, self%analysis, messages)
      case (file_kind%blocks)
         call read_block_source(source, self%blocks, messages)
      case (file_kind%options, file_kind%labelled)
         call read_options_source(source, self%options, messages)
      case (file_kind%statistics)
         call read_statistics_source(source, self%statistics, messages)
      case (file_kind%hdf5)
         call read_results_info(path, self%results, error)
         if (allocated(error)) call messages%add_error(error)
      end select
      self%valid = messages%n_errors == before
   end subroutine read_content

end module rockdda_io_file_content
