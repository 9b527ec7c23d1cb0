! SPDX-License-Identifier: MIT
!> rockdda cut: lines to blocks.
module rockdda_app_command_cut
   use rockdda_base_error, only : error_type, error_code
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : counted, to_string
   use rockdda_model_analysis_input, only : dialect
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_options, only : run_options_type
   use rockdda_model_resolve, only : units_of
   use rockdda_model_units, only : unit_system, unit_system_type
   use rockdda_cutting_cut, only : cut_blocks, cut_report_type
   use rockdda_io_block_writer, only : write_block_file
   use rockdda_io_file_content, only : file_content_type
   use rockdda_io_recognise, only : file_kind
   use rockdda_run_parts, only : make_parts_of_options
   use rockdda_app_arguments, only : command_line_type
   use rockdda_app_conversion, only : prepare_conversion
   use rockdda_app_report, only : show_messages, report_failure, begin_json, end_json
   use rockdda_app_json, only : json_type
   use rockdda_app_process, only : print_line
   implicit none
   private
   public :: run_cut

contains

   !> Run the command; returns the exit code.
   subroutine run_cut(line, exit_code)
      type(command_line_type), intent(in) :: line
      integer, intent(out) :: exit_code
      type(file_content_type) :: content
      type(block_system_type) :: blocks
      type(cut_report_type) :: report
      type(diagnostics_type) :: messages
      type(error_type), allocatable :: error
      character(len=:), allocatable :: output
      integer :: n_parents
      logical :: ok

      call prepare_conversion(line, file_kind%geometry, '.blk', output, messages, error)
      if (.not. allocated(error) .and. .not. messages%has_errors()) &
         call content%read(line%files(1)%text, file_kind%geometry, dialect%auto, [-1, -1], messages)
      if (len(line%config) > 0 .and. .not. allocated(error) .and. .not. messages%has_errors()) &
         call content%read(line%config, file_kind%options, dialect%auto, [-1, -1], messages)
      content%geometry%allow_open = line%allow_open .or. content%options%allow_open
      if (.not. allocated(error) .and. .not. messages%has_errors()) &
         call cut_blocks(content%geometry, blocks, report, messages, error)
      n_parents = blocks%n_blocks
      if (len(line%config) > 0 .and. .not. allocated(error) .and. .not. messages%has_errors()) &
         call make_parts_of_options(content%options, blocks, messages)
      if (.not. allocated(error) .and. .not. messages%has_errors()) call write_block_file(output, blocks, error)
      if (allocated(error) .or. messages%has_errors()) then
         call report_failure(line, messages, error, exit_code)
         return
      end if
      exit_code = 0
      messages = messages%summarised()
      if (.not. line%quiet) call show_messages(messages, severity%warning)
      call print_summary(line, n_parents, blocks, report, output, content%options, messages, ok)
      if (.not. ok) exit_code = error_code%output
   end subroutine run_cut

   !> Print the summary.
   subroutine print_summary(line, n_parents, blocks, report, output, options, messages, ok)
      type(command_line_type), intent(in) :: line
      integer, intent(in) :: n_parents        !! blocks before some were cut into cells
      type(block_system_type), intent(in) :: blocks
      type(cut_report_type), intent(in) :: report
      character(len=*), intent(in) :: output
      type(run_options_type), intent(in) :: options
      type(diagnostics_type), intent(in) :: messages
      logical, intent(out) :: ok
      type(json_type) :: json
      type(error_type), allocatable :: none
      character(len=1), parameter :: nl = new_line('a')
      character(len=:), allocatable :: cells
      type(unit_system_type) :: units
      real(wp) :: difference
      difference = report%area_sum + report%hole_area - report%enclosed_area
      if (line%json) then
         call begin_json(json, line, 'done', 0)
         call json%put('input', line%files(1)%text)
         call json%put('output', output)
         call json%put('blocks', blocks%n_blocks)
         if (allocated(blocks%parent)) call json%put('blocks_before_subdivision', n_parents)
         call json%put('vertices', blocks%n_vertices())
         call json%put('lines', report%n_lines)
         call json%put('dropped_lines', report%n_dropped_lines)
         call json%put('shortened_lines', report%n_shortened_lines)
         call json%put('islands', report%n_islands)
         call json%put('holes', report%n_holes)
         call json%put('area_of_blocks', report%area_sum)
         call json%put('area_of_holes', report%hole_area)
         call json%put('enclosed_area', report%enclosed_area)
         call json%put('area_difference', difference)
         call json%put('fixed_points', blocks%fixed%n)
         call json%put('loading_points', blocks%loading%n)
         call json%put('measured_points', blocks%measured%n)
         call json%put('bolts', blocks%bolts%n)
         call end_json(json, messages, none, ok)
         return
      end if
      units = unit_system(units_of(options))
      cells = ''
      if (allocated(blocks%parent)) cells = ' (cut from '//to_string(n_parents)//' blocks)'
      call print_line(output//': '//counted(blocks%n_blocks, 'block')//cells//', '// &
               to_string(blocks%n_vertices())//' vertices'//nl// &
               'area: blocks '//units%shown(report%area_sum, 'length^2', 10)//' + holes '// &
               units%shown(report%hole_area, 'length^2', 10)//', enclosed '// &
               units%shown(report%enclosed_area, 'length^2', 10)//', difference '// &
               units%shown(difference, 'length^2', 3)//nl// &
               'lines: '//to_string(report%n_lines)//', dropped '//to_string(report%n_dropped_lines)// &
               ', shortened '//to_string(report%n_shortened_lines)//nl// &
               'points: '//to_string(blocks%fixed%n)//' fixed, '//to_string(blocks%loading%n)//' loading, '// &
               to_string(blocks%measured%n)//' measured; bolts: '//to_string(blocks%bolts%n)//', holes: '// &
               to_string(report%n_holes)//', islands: '//to_string(report%n_islands), ok)
   end subroutine print_summary

end module rockdda_app_command_cut
