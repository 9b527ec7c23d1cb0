! SPDX-License-Identifier: MIT
!> rockdda lines: joint statistics to lines, and the statistics of the lines drawn beside those wanted.
module rockdda_app_command_lines
   use rockdda_base_error, only : error_type, error_code
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : to_string
   use rockdda_lines_generate, only : generate_lines
   use rockdda_lines_report, only : lines_report_type, set_report_type
   use rockdda_lines_statistics, only : statistics_type, joint_set_type
   use rockdda_lines_joint_sets, only : is_endless
   use rockdda_model_analysis_input, only : dialect
   use rockdda_model_geometry_input, only : geometry_input_type
   use rockdda_model_options, only : is_set
   use rockdda_io_block_writer, only : write_geometry_file
   use rockdda_io_file_content, only : file_content_type
   use rockdda_io_recognise, only : file_kind
   use rockdda_app_arguments, only : command_line_type
   use rockdda_app_conversion, only : prepare_conversion
   use rockdda_app_report, only : show_messages, report_failure, begin_json, end_json
   use rockdda_app_json, only : json_type
   use rockdda_app_process, only : print_line
   implicit none
   private
   public :: run_lines

   character(len=1), parameter :: nl = new_line('a')

contains

   !> Run the command; returns the exit code.
   subroutine run_lines(line, exit_code)
      type(command_line_type), intent(in) :: line
      integer, intent(out) :: exit_code
      type(file_content_type) :: content
      type(geometry_input_type) :: geometry
      type(lines_report_type) :: report
      type(diagnostics_type) :: messages
      type(error_type), allocatable :: error
      character(len=:), allocatable :: output
      logical :: ok

      call prepare_conversion(line, file_kind%statistics, '.dc', output, messages, error)
      if (.not. allocated(error) .and. .not. messages%has_errors()) &
         call content%read(line%files(1)%text, file_kind%statistics, dialect%auto, [-1, -1], messages)
      if (.not. allocated(error) .and. .not. messages%has_errors()) then
         if (is_set(line%seed)) content%statistics%seed = line%seed
         call generate_lines(content%statistics, geometry, report, messages)
      end if
      if (.not. allocated(error) .and. .not. messages%has_errors()) call write_geometry_file(output, geometry, error)
      if (allocated(error) .or. messages%has_errors()) then
         call report_failure(line, messages, error, exit_code)
         return
      end if
      exit_code = 0
      if (.not. line%quiet) call show_messages(messages, severity%warning)
      call print_summary(line, content%statistics, geometry, report, output, messages, ok)
      if (.not. ok) exit_code = error_code%output
   end subroutine run_lines

   !> Print the summary.
   subroutine print_summary(line, statistics, geometry, report, output, messages, ok)
      type(command_line_type), intent(in) :: line
      type(statistics_type), intent(in) :: statistics
      type(geometry_input_type), intent(in) :: geometry
      type(lines_report_type), intent(in) :: report
      character(len=*), intent(in) :: output
      type(diagnostics_type), intent(in) :: messages
      logical, intent(out) :: ok
      type(json_type) :: json
      type(error_type), allocatable :: none
      character(len=:), allocatable :: text
      integer :: i
      if (line%json) then
         call begin_json(json, line, 'done', 0)
         call json%put('input', line%files(1)%text)
         call json%put('output', output)
         call json%put('seed', statistics%seed)
         call json%put('lines', size(geometry%line_joint))
         call json%put('boundary_lines', geometry%n_boundary)
         call json%put('openings', size(statistics%openings))
         call json%put('dropped_lines', report%n_short)
         call json%put('rock_area', report%rock_area)
         call json%open('[', 'joint_sets')
         do i = 1, size(report%sets)
            call set_to_json(report%sets(i), json)
         end do
         call json%close(']')
         call end_json(json, messages, none, ok)
         return
      end if
      text = output//': '//to_string(size(geometry%line_joint))//' lines, of which '// &
             to_string(geometry%n_boundary)//' boundary lines; seed '//to_string(statistics%seed)//nl// &
             'rock area '//to_string(report%rock_area, 10)//', openings: '//to_string(size(statistics%openings))// &
             ', pieces too short to keep: '//to_string(report%n_short)
      do i = 1, size(report%sets)
         text = text//nl//'joint set '//to_string(i)//': '//set_to_text(statistics%sets(i), report%sets(i))
      end do
      call print_line(text, ok)
   end subroutine print_summary

   !> Write a set as JSON; quantities without a sample are null.
   subroutine set_to_json(set, json)
      type(set_report_type), intent(in) :: set
      type(json_type), intent(inout) :: json
      call json%open('{', '')
      call json%put('lines', set%n_lines)
      call json%put('traces', set%n_traces)
      call json%put('whole_traces', set%n_whole)
      call json%put('total_length', set%length)
      call put_mean(json, 'spacing', set%n_lines - 1, set%spacing, set%spacing_deviation)
      call put_mean(json, 'trace', set%n_drawn, set%trace, set%trace_deviation)
      call put_mean(json, 'bridge', set%n_bridges, set%bridge, set%bridge_deviation)
      call json%close('}')
   end subroutine set_to_json

   !> Write mean and deviation of a sample.
   subroutine put_mean(json, name, n, mean, deviation)
      type(json_type), intent(inout) :: json
      character(len=*), intent(in) :: name
      integer, intent(in) :: n                      !! size of the sample
      real(wp), intent(in) :: mean, deviation
      call json%put(name, mean, n > 0)
      call json%put(name//'_deviation', deviation, n > 0)
   end subroutine put_mean

   !> A set as text: the statistics drawn, and the wanted values in brackets.
   function set_to_text(set, drawn) result(text)
      type(joint_set_type), intent(in) :: set
      type(set_report_type), intent(in) :: drawn
      character(len=:), allocatable :: text
      text = 'inclination '//to_string(set%inclination)//' deg, '//to_string(drawn%n_lines)//' lines, '// &
             to_string(drawn%n_traces)//' traces'
      if (drawn%n_lines > 1) text = text//nl//'  spacing '// &
                                    plus_minus(drawn%spacing, drawn%spacing_deviation, set%spacing)
      if (.not. is_endless(set) .and. drawn%n_drawn > 0) text = text//nl//'  trace '// &
         plus_minus(drawn%trace, drawn%trace_deviation, set%trace)//', whole traces: '//to_string(drawn%n_whole)
      if (drawn%n_bridges > 0) text = text//nl//'  bridge '// &
                                      plus_minus(drawn%bridge, drawn%bridge_deviation, set%bridge)
   end function set_to_text

   !> "1.02 +- 0.3 (wanted: 1)"
   pure function plus_minus(mean, deviation, wanted) result(text)
      real(wp), intent(in) :: mean, deviation, wanted
      character(len=:), allocatable :: text
      text = to_string(mean)//' +- '//to_string(deviation, 3)//' (wanted: '//to_string(wanted)//')'
   end function plus_minus

end module rockdda_app_command_lines
