! SPDX-License-Identifier: MIT
!> rockdda info: contents of files.
module rockdda_app_command_info
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type, error_code
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_base_strings, only : to_string
   use rockdda_model_analysis_input, only : analysis_input_type, dialect
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_geometry_input, only : geometry_input_type
   use rockdda_model_options, only : run_options_type
   use rockdda_lines_statistics, only : statistics_type
   use rockdda_geometry_polygons, only : polygon_area
   use rockdda_io_analysis_file, only : read_analysis_file
   use rockdda_io_block_file, only : read_block_file
   use rockdda_io_checkpoint, only : results_path
   use rockdda_io_checkpoint_info, only : checkpoint_info_type, read_checkpoint_info
   use rockdda_io_geometry_file, only : read_geometry_file
   use rockdda_io_namelist_file, only : read_options_file
   use rockdda_io_namelist_parser, only : namelist_type, parse_namelist
   use rockdda_io_recognise, only : file_kind, kind_name, ddaml_advice
   use rockdda_io_results_info, only : results_info_type, read_results_info
   use rockdda_io_statistics_file, only : read_statistics_file
   use rockdda_io_source, only : source_type, read_source
   use rockdda_run_model_input, only : model_input_type, recognise_file, read_blocks, count_points
   use rockdda_app_arguments, only : command_line_type
   use rockdda_app_facts, only : facts_type
   use rockdda_app_file_list, only : list_files
   use rockdda_app_json, only : json_type
   use rockdda_app_process, only : argument_type, print_line
   use rockdda_app_report, only : show_messages, begin_json, end_json, report_failure
   implicit none
   private
   public :: run_info

contains

   !> Run the command; returns the exit code.
   subroutine run_info(line, exit_code)
      type(command_line_type), intent(in) :: line
      integer, intent(out) :: exit_code
      type(diagnostics_type) :: messages
      type(error_type), allocatable :: error
      type(argument_type), allocatable :: files(:)
      type(facts_type), allocatable :: facts(:)
      type(json_type) :: json
      integer :: i, points(2)
      logical :: ok, printed

      call list_files(line, files, messages, error)
      if (allocated(error)) then
         call report_failure(line, messages, error, exit_code)
         return
      end if
      allocate (facts(size(files)))
      call find_points(files, points)
      do i = 1, size(files)
         call describe_file(line, files(i)%text, points, facts(i), messages)
      end do
      exit_code = merge(error_code%input, 0, messages%has_errors())
      call show_messages(messages, merge(severity%error, severity%warning, line%quiet))
      ok = .true.
      if (line%json) then
         call begin_json(json, line, trim(merge('error', 'done ', messages%has_errors())), exit_code)
         call json%open('[', 'files')
         do i = 1, size(facts)
            call facts(i)%to_json(json)
         end do
         call json%close(']')
         call end_json(json, messages, error, ok)
      else
         do i = 1, size(facts)
            if (facts(i)%n == 0) cycle
            call print_line(facts(i)%to_text(), printed)
            ok = ok .and. printed
         end do
      end if
      if (.not. ok) exit_code = error_code%output
   end subroutine run_info

   !> Fixed and loading points of the first model among the files, which the reader of an analysis file may need;
   !> -1 without a model.
   subroutine find_points(files, points)
      type(argument_type), intent(in) :: files(:)
      integer, intent(out) :: points(2)
      type(model_input_type) :: input
      type(diagnostics_type) :: told_later
      type(error_type), allocatable :: error
      integer :: kinds(size(files)), i
      logical :: ok
      points = -1
      do i = 1, size(kinds)
         call recognise_file(files(i)%text, kinds(i), told_later, ok)
      end do
      if (count(kinds == file_kind%analysis) == 0) return
      do i = 1, size(kinds)
         if (kinds(i) /= file_kind%geometry .and. kinds(i) /= file_kind%blocks) cycle
         input%model_file = files(i)%text
         input%model_kind = kinds(i)
         call read_blocks(input, told_later, error)
         call count_points(input, points(1), points(2))
         return
      end do
   end subroutine find_points

   !> Facts about one file; its problems go into `messages`.
   subroutine describe_file(line, path, points, facts, messages)
      type(command_line_type), intent(in) :: line
      character(len=*), intent(in) :: path
      integer, intent(in) :: points(2)           !! fixed and loading points, -1 unknown
      type(facts_type), intent(inout) :: facts
      type(diagnostics_type), intent(inout) :: messages
      type(origin_type) :: origin
      integer :: kind
      logical :: ok
      call recognise_file(path, kind, messages, ok)
      facts%title = path
      if (.not. ok) return
      if (kind /= file_kind%hdf5 .and. kind /= file_kind%checkpoint) call facts%add('kind', kind_name(kind))
      select case (kind)
      case (1); call describe_geometry(path, facts, messages)
      case (2); call describe_analysis(line, path, points, facts, messages)
      case (3); call describe_blocks(path, facts, messages)
      case (4); call describe_options(path, facts, messages)
      case (5); call describe_statistics(path, facts, messages)
      case (7); call describe_results(path, facts, messages)
      case (8); call describe_checkpoint(path, facts, messages)
      case (6)
         origin%file = path
         call messages%add(severity%warning, ddaml_advice, origin)
      case default
         origin%file = path
         call messages%add(severity%warning, 'this version says no more about a file of this kind: '//kind_name(kind), &
                           origin)
      end select
   end subroutine describe_file

   !> A joint statistics file.
   subroutine describe_statistics(path, facts, messages)
      character(len=*), intent(in) :: path
      type(facts_type), intent(inout) :: facts
      type(diagnostics_type), intent(inout) :: messages
      type(statistics_type) :: statistics
      integer :: before, i
      before = messages%n_errors
      call read_statistics_file(path, statistics, messages)
      if (messages%n_errors > before) return
      call facts%add('seed', statistics%seed)
      call facts%add('area', abs(polygon_area(statistics%region%vertices)))
      call facts%add('openings', size(statistics%openings))
      call facts%add('joint_sets', size(statistics%sets))
      do i = 1, size(statistics%sets)
         call facts%add('inclination_'//to_string(i), statistics%sets(i)%inclination)
         call facts%add('spacing_'//to_string(i), statistics%sets(i)%spacing)
      end do
      call facts%add('lines', size(statistics%lines))
      call facts%add('measured_points', size(statistics%measured, 2))
   end subroutine describe_statistics

   !> A geometry file.
   subroutine describe_geometry(path, facts, messages)
      character(len=*), intent(in) :: path
      type(facts_type), intent(inout) :: facts
      type(diagnostics_type), intent(inout) :: messages
      type(geometry_input_type) :: geometry
      integer :: before
      before = messages%n_errors
      call read_geometry_file(path, geometry, messages)
      if (messages%n_errors > before) return
      call facts%add('edge_node_distance', geometry%edge_node_distance)
      call facts%add('lines', size(geometry%lines, 2))
      call facts%add('boundary_lines', geometry%n_boundary)
      call facts%add('material_lines', size(geometry%material_lines, 2))
      call facts%add('bolts', size(geometry%bolts, 2))
      call facts%add('fixed_lines', size(geometry%fixed_lines, 2))
      call facts%add('loading_points', size(geometry%loading_points, 2))
      call facts%add('measured_points', size(geometry%measured_points, 2))
      call facts%add('hole_points', size(geometry%hole_points, 2))
      if (size(geometry%lines, 2) == 0) return
      call facts%add('joint_materials', maxval(geometry%line_joint))
      call facts%add('x_min', min(minval(geometry%lines(1, :)), minval(geometry%lines(3, :))))
      call facts%add('x_max', max(maxval(geometry%lines(1, :)), maxval(geometry%lines(3, :))))
      call facts%add('y_min', min(minval(geometry%lines(2, :)), minval(geometry%lines(4, :))))
      call facts%add('y_max', max(maxval(geometry%lines(2, :)), maxval(geometry%lines(4, :))))
   end subroutine describe_geometry

   !> An analysis file.
   subroutine describe_analysis(line, path, points, facts, messages)
      type(command_line_type), intent(in) :: line
      character(len=*), intent(in) :: path
      integer, intent(in) :: points(2)
      type(facts_type), intent(inout) :: facts
      type(diagnostics_type), intent(inout) :: messages
      type(analysis_input_type) :: analysis
      integer :: before, i
      before = messages%n_errors
      call read_analysis_file(path, points(1), points(2), line%dialect, analysis, messages)
      if (messages%n_errors > before) return
      call facts%add('dialect', trim(merge('peer', 'g0  ', analysis%dialect == dialect%peer)))
      call facts%add('k01', analysis%k01)
      call facts%add('steps', analysis%n_steps)
      call facts%add('displacement_ratio', analysis%displacement_ratio)
      call facts%add('largest_time_step', analysis%dt_max)
      call facts%add('contact_stiffness', analysis%stiffness)
      call facts%add('sor_factor', analysis%sor_factor)
      call facts%add('block_materials', size(analysis%block_materials))
      do i = 1, size(analysis%block_materials)
         associate (m => analysis%block_materials(i))
            call facts%add('block_material_'//to_string(i), 'density '//to_string(m%density, 10)//', weight '// &
                           to_string(m%weight, 10)//', E '//to_string(m%youngs_modulus, 10)//', nu '// &
                           to_string(m%poisson_ratio, 10))
         end associate
      end do
      call facts%add('joint_materials', size(analysis%joint_materials))
      do i = 1, size(analysis%joint_materials)
         associate (m => analysis%joint_materials(i))
            call facts%add('joint_material_'//to_string(i), 'friction '//to_string(m%friction_angle, 10)// &
                           ' deg, cohesion '//to_string(m%cohesion, 10)//', tension '//to_string(m%tension, 10))
         end associate
      end do
   end subroutine describe_analysis

   !> A block file.
   subroutine describe_blocks(path, facts, messages)
      character(len=*), intent(in) :: path
      type(facts_type), intent(inout) :: facts
      type(diagnostics_type), intent(inout) :: messages
      type(block_system_type) :: blocks
      integer :: before, i, nv
      real(wp) :: area
      before = messages%n_errors
      call read_block_file(path, blocks, messages)
      if (messages%n_errors > before) return
      nv = blocks%n_vertices()
      call facts%add('blocks', blocks%n_blocks)
      call facts%add('vertices', nv)
      call facts%add('fixed_points', blocks%fixed%n)
      call facts%add('loading_points', blocks%loading%n)
      call facts%add('measured_points', blocks%measured%n)
      call add_numbers(facts, blocks%measured%numbers())
      call facts%add('bolts', blocks%bolts%n)
      if (blocks%n_blocks == 0) return
      area = 0
      do i = 1, blocks%n_blocks
         area = area + polygon_area(blocks%vertices(:, blocks%vertex_offset(i) + 1:blocks%vertex_offset(i + 1)))
      end do
      call facts%add('area', area)
      call facts%add('block_materials', maxval(blocks%block_material))
      call facts%add('joint_materials', maxval(blocks%edge_joint))
      call facts%add('x_min', minval(blocks%vertices(1, 1:nv)))
      call facts%add('x_max', maxval(blocks%vertices(1, 1:nv)))
      call facts%add('y_min', minval(blocks%vertices(2, 1:nv)))
      call facts%add('y_max', maxval(blocks%vertices(2, 1:nv)))
   end subroutine describe_blocks

   !> An options file: its groups and names.
   subroutine describe_options(path, facts, messages)
      character(len=*), intent(in) :: path
      type(facts_type), intent(inout) :: facts
      type(diagnostics_type), intent(inout) :: messages
      type(run_options_type) :: options
      type(namelist_type) :: namelist
      type(source_type) :: source
      type(diagnostics_type) :: told
      character(len=:), allocatable :: names
      integer :: i, k
      logical :: ok
      call read_options_file(path, options, messages)
      call read_source(path, source, told, ok)
      if (.not. ok) return
      call parse_namelist(source, namelist, told)
      do i = 1, namelist%n
         names = ''
         do k = 1, namelist%groups(i)%n
            if (k > 1) names = names//', '
            names = names//namelist%groups(i)%entries(k)%name
         end do
         call facts%add('&'//namelist%groups(i)%name, names)
      end do
   end subroutine describe_options

   !> A results file.
   subroutine describe_results(path, facts, messages)
      character(len=*), intent(in) :: path
      type(facts_type), intent(inout) :: facts
      type(diagnostics_type), intent(inout) :: messages
      type(results_info_type) :: info
      type(error_type), allocatable :: error
      type(origin_type) :: origin
      call read_results_info(path, info, error)
      if (allocated(error)) then
         origin%file = path
         call messages%add(severity%error, error%message(index(error%message, ': error: ') + 9:), origin)
         return
      end if
      call facts%add('kind', 'results file')
      call facts%add('title', info%title)
      call facts%add('format_version', info%format_version)
      call facts%add('program_version', info%program_version)
      call facts%add('created', info%created)
      call facts%add('complete', info%complete)
      call facts%add('exit_reason', info%exit_reason)
      call facts%add('blocks', int(info%n_blocks))
      call facts%add('vertices', int(info%n_vertices))
      call facts%add('fixed_points', int(info%n_fixed))
      call facts%add('loading_points', int(info%n_loading))
      call facts%add('measured_points', int(info%n_measured))
      if (allocated(info%measured_number)) call add_numbers(facts, info%measured_number)
      call facts%add('steps', int(info%n_steps))
      call facts%add('last_step', info%last_step)
      call facts%add('last_time', info%last_time)
      call facts%add('frames', int(info%n_frames))
      call facts%add('first_frame_time', info%first_frame)
      call facts%add('last_frame_time', info%last_frame)
   end subroutine describe_results

   !> A checkpoint.
   subroutine describe_checkpoint(path, facts, messages)
      character(len=*), intent(in) :: path
      type(facts_type), intent(inout) :: facts
      type(diagnostics_type), intent(inout) :: messages
      type(checkpoint_info_type) :: info
      type(error_type), allocatable :: error
      type(origin_type) :: origin
      call read_checkpoint_info(path, info, error)
      if (allocated(error)) then
         origin%file = path
         call messages%add(severity%error, error%message(len(path) + 3:), origin)
         return
      end if
      call facts%add('kind', 'checkpoint file')
      call facts%add('title', info%facts%header%title)
      call facts%add('program_version', info%facts%header%program_version)
      call facts%add('created', info%facts%header%created)
      call facts%add('written', info%facts%written)
      call facts%add('results', results_path(path, info%facts%results_ending))
      call facts%add('geometry_or_blocks', info%facts%model_file)
      call facts%add('analysis', info%facts%analysis_file)
      if (len(info%facts%config_file) > 0) call facts%add('options', info%facts%config_file)
      call facts%add('blocks', info%n_blocks)
      call facts%add('contacts', info%n_contacts)
      call facts%add('solver', info%solver)
      call facts%add('step', info%step)
      call facts%add('time', info%time)
      if (info%n_steps < huge(1)) call facts%add('last_step_of_run', info%n_steps)
      if (info%t_end < huge(1.0_wp)) call facts%add('end_time_of_run', info%t_end)
      call facts%add('frames', info%facts%rows%frames)
      call facts%add('sha256', info%digest)
      call facts%add('sha256_of_geometry', info%input_digests(1))
      call facts%add('sha256_of_analysis', info%input_digests(2))
      call facts%add('sha256_of_options', info%input_digests(3))
   end subroutine describe_checkpoint

   !> Numbers of the measured points where they are not 1 ... n: points of the input were ignored.
   subroutine add_numbers(facts, numbers)
      type(facts_type), intent(inout) :: facts
      integer, intent(in) :: numbers(:)
      integer, parameter :: most_shown = 20
      character(len=:), allocatable :: text
      integer :: i
      if (all(numbers == [(i, i=1, size(numbers))])) return
      text = to_string(numbers(1))
      do i = 2, min(size(numbers), most_shown)
         text = text//', '//to_string(numbers(i))
      end do
      if (size(numbers) > most_shown) text = text//', ... '//to_string(numbers(size(numbers)))
      call facts%add('measured_point_numbers', text)
   end subroutine add_numbers

end module rockdda_app_command_info
