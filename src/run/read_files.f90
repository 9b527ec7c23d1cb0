! SPDX-License-Identifier: MIT
!> Read the files of a run: options, blocks or a geometry that is cut into blocks, analysis file.
module rockdda_run_read_files
   use rockdda_base_error, only : error_type
   use rockdda_base_diagnostics, only : diagnostics_type
   use rockdda_cutting_cut, only : cut_blocks
   use rockdda_io_analysis_file, only : read_analysis_source
   use rockdda_io_block_file, only : read_block_source
   use rockdda_io_geometry_file, only : read_geometry_source
   use rockdda_io_namelist_file, only : read_options_source
   use rockdda_io_recognise, only : file_kind
   use rockdda_io_source, only : source_type, read_source, new_source
   use rockdda_run_input, only : model_input_type
   implicit none
   private
   public :: read_config, read_blocks, read_analysis, count_points

contains

   !> Read the options, if there is a file of them.
   subroutine read_config(input, messages)
      type(model_input_type), intent(inout) :: input
      type(diagnostics_type), intent(inout) :: messages
      type(source_type) :: source
      logical :: ok
      if (.not. allocated(input%config_text)) input%config_text = ''
      if (len(input%config_file) == 0) return
      call get_source(input%in_memory, input%config_file, input%config_text, source, messages, ok)
      if (.not. ok) return
      call read_options_source(source, input%options, messages)
   end subroutine read_config

   !> Get the text of a file; `text` is given when it is in memory, and set otherwise.
   subroutine get_source(in_memory, file, text, source, messages, ok)
      logical, intent(in) :: in_memory
      character(len=*), intent(in) :: file
      character(len=:), allocatable, intent(inout) :: text
      type(source_type), intent(out) :: source
      type(diagnostics_type), intent(inout) :: messages
      logical, intent(out) :: ok
      if (in_memory) then
         call new_source(file, text, source)
         ok = .true.
         return
      end if
      text = ''
      call read_source(file, source, messages, ok)
      if (ok) text = source%text
      if (ok .and. allocated(source%bytes)) text = source%bytes
   end subroutine get_source

   !> Read a block file, or read a geometry file and cut it.
   subroutine read_blocks(input, messages, error)
      type(model_input_type), intent(inout) :: input
      type(diagnostics_type), intent(inout) :: messages
      type(error_type), allocatable, intent(out) :: error
      type(source_type) :: source
      integer :: before
      logical :: ok
      input%has_blocks = .false.
      before = messages%n_errors
      call get_source(input%in_memory, input%model_file, input%model_text, source, messages, ok)
      if (.not. ok) return
      if (input%model_kind == file_kind%blocks) then
         call read_block_source(source, input%blocks, messages)
      else
         call read_geometry_source(source, input%geometry, messages)
         if (messages%n_errors > before) then
            ! what was read only in part cannot be checked further
            if (allocated(input%geometry%line_joint)) deallocate (input%geometry%line_joint)
            return
         end if
         input%geometry%allow_open = input%options%allow_open
         call cut_blocks(input%geometry, input%blocks, input%cut, messages, error)
      end if
      input%has_blocks = messages%n_errors == before .and. .not. allocated(error)
   end subroutine read_blocks

   !> Read the analysis file; the number of points of the model, when available, decides between dialects.
   subroutine read_analysis(way, input, messages)
      integer, intent(in) :: way                   !! one of dialect%...
      type(model_input_type), intent(inout) :: input
      type(diagnostics_type), intent(inout) :: messages
      type(source_type) :: source
      integer :: n_fixed, n_loading
      logical :: ok
      call get_source(input%in_memory, input%analysis_file, input%analysis_text, source, messages, ok)
      if (.not. ok) return
      call count_points(input, n_fixed, n_loading)
      call read_analysis_source(source, n_fixed, n_loading, way, input%analysis, messages)
   end subroutine read_analysis

   !> Count the fixed and loading points of the model; -1 when a geometry with errors does not determine them.
   subroutine count_points(input, n_fixed, n_loading)
      type(model_input_type), intent(in) :: input
      integer, intent(out) :: n_fixed, n_loading
      n_fixed = -1
      n_loading = -1
      if (input%has_blocks) then
         n_fixed = input%blocks%fixed%n
         n_loading = input%blocks%loading%n
      else if (allocated(input%geometry%fixed_lines)) then
         ! cutting does not change the number of fixed lines that are points
         if (any(abs(input%geometry%fixed_lines(1:2, :) - input%geometry%fixed_lines(3:4, :)) > 0)) return
         n_fixed = size(input%geometry%fixed_lines, 2)
         n_loading = size(input%geometry%loading_points, 2)
      end if
   end subroutine count_points

end module rockdda_run_read_files
