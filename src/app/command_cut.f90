! SPDX-License-Identifier: MIT
!> rockdda cut: lines to blocks.
module rockdda_app_command_cut
   use rockdda_base_error, only : error_type, error_code
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_geometry_input, only : geometry_input_type
   use rockdda_model_options, only : run_options_type
   use rockdda_cutting_cut, only : cut_blocks, cut_report_type
   use rockdda_io_block_writer, only : write_block_file
   use rockdda_io_geometry_file, only : read_geometry_file
   use rockdda_io_namelist_file, only : read_options_file
   use rockdda_io_recognise, only : file_kind
   use rockdda_run_parts, only : make_parts_of_options
   use rockdda_app_arguments, only : command_line_type
   use rockdda_app_conversion, only : prepare_conversion
   use rockdda_app_cut_summary, only : print_summary
   use rockdda_app_report, only : show_messages, report_failure
   implicit none
   private
   public :: run_cut

contains

   !> Run the command; returns the exit code.
   subroutine run_cut(line, exit_code)
      type(command_line_type), intent(in) :: line
      integer, intent(out) :: exit_code
      type(geometry_input_type) :: geometry
      type(run_options_type) :: options
      type(block_system_type) :: blocks
      type(cut_report_type) :: report
      type(diagnostics_type) :: messages
      type(error_type), allocatable :: error
      character(len=:), allocatable :: output
      integer :: n_parents
      logical :: ok

      call prepare_conversion(line, file_kind%geometry, '.blk', output, messages, error)
      if (.not. allocated(error) .and. .not. messages%has_errors()) &
         call read_geometry_file(line%files(1)%text, geometry, messages)
      if (len(line%config) > 0 .and. .not. allocated(error) .and. .not. messages%has_errors()) &
         call read_options_file(line%config, options, messages)
      geometry%allow_open = line%allow_open .or. options%allow_open
      if (.not. allocated(error) .and. .not. messages%has_errors()) &
         call cut_blocks(geometry, blocks, report, messages, error)
      n_parents = blocks%n_blocks
      if (len(line%config) > 0 .and. .not. allocated(error) .and. .not. messages%has_errors()) &
         call make_parts_of_options(options, blocks, messages)
      if (.not. allocated(error) .and. .not. messages%has_errors()) call write_block_file(output, blocks, error)
      if (allocated(error) .or. messages%has_errors()) then
         call report_failure(line, messages, error, exit_code)
         return
      end if
      exit_code = 0
      messages = messages%summarised()
      if (.not. line%quiet) call show_messages(messages, severity%warning)
      call print_summary(line, n_parents, blocks, report, output, options, messages, ok)
      if (.not. ok) exit_code = error_code%output
   end subroutine run_cut

end module rockdda_app_command_cut
