! SPDX-License-Identifier: MIT
!> rockdda lines: joint statistics to lines.
module rockdda_app_command_lines
   use rockdda_base_error, only : error_type, error_code
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_lines_generate, only : generate_lines
   use rockdda_lines_report, only : lines_report_type
   use rockdda_lines_statistics, only : statistics_type
   use rockdda_model_geometry_input, only : geometry_input_type
   use rockdda_model_options, only : is_set
   use rockdda_io_legacy_writer, only : write_geometry_file
   use rockdda_io_recognise, only : file_kind
   use rockdda_io_statistics_file, only : read_statistics_file
   use rockdda_app_arguments, only : command_line_type
   use rockdda_app_conversion, only : prepare_conversion
   use rockdda_app_lines_summary, only : print_summary
   use rockdda_app_report, only : show_messages, report_failure
   implicit none
   private
   public :: run_lines

contains

   !> Run the command; returns the exit code.
   subroutine run_lines(line, exit_code)
      type(command_line_type), intent(in) :: line
      integer, intent(out) :: exit_code
      type(statistics_type) :: statistics
      type(geometry_input_type) :: geometry
      type(lines_report_type) :: report
      type(diagnostics_type) :: messages
      type(error_type), allocatable :: error
      character(len=:), allocatable :: output
      logical :: ok

      call prepare_conversion(line, file_kind%statistics, '.dc', output, messages, error)
      if (.not. allocated(error) .and. .not. messages%has_errors()) &
         call read_statistics_file(line%files(1)%text, statistics, messages)
      if (.not. allocated(error) .and. .not. messages%has_errors()) then
         if (is_set(line%seed)) statistics%seed = line%seed
         call generate_lines(statistics, geometry, report, messages)
      end if
      if (.not. allocated(error) .and. .not. messages%has_errors()) call write_geometry_file(output, geometry, error)
      if (allocated(error) .or. messages%has_errors()) then
         call report_failure(line, messages, error, exit_code)
         return
      end if
      exit_code = 0
      if (.not. line%quiet) call show_messages(messages, severity%warning)
      call print_summary(line, statistics, geometry, report, output, messages, ok)
      if (.not. ok) exit_code = error_code%output
   end subroutine run_lines

end module rockdda_app_command_lines
