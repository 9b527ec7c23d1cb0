! SPDX-License-Identifier: MIT
!> Facts about one file of any kind, for `rockdda info`.
module rockdda_app_file_facts
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_base_strings, only : to_string
   use rockdda_model_analysis_input, only : dialect
   use rockdda_model_options, only : dda_windows
   use rockdda_model_units, only : unit_system
   use rockdda_geometry_polygons, only : polygon_area
   use rockdda_io_checkpoint, only : results_path, checkpoint_info_type, read_checkpoint_info
   use rockdda_io_file_content, only : file_content_type
   use rockdda_io_namelist_file, only : given_group_type, list_given_options
   use rockdda_io_results_info, only : results_info_type, read_results_info
   use rockdda_io_recognise, only : file_kind, kind_name, ddaml_advice
   use rockdda_app_facts, only : facts_type, json_type
   implicit none
   private
   public :: describe_file, displacements_text, put_displacements

contains

   !> Find facts about one file; its problems go into `messages`.
   subroutine describe_file(path, kind, named_dialect, points, facts, messages)
      character(len=*), intent(in) :: path
      integer, intent(in) :: kind                !! one of file_kind%...
      integer, intent(in) :: named_dialect       !! of an analysis file, dialect%auto when the user named none
      integer, intent(in) :: points(2)           !! fixed and loading points, -1 unknown
      type(facts_type), intent(inout) :: facts
      type(diagnostics_type), intent(inout) :: messages
      type(file_content_type) :: content
      type(origin_type) :: origin
      if (kind /= file_kind%hdf5 .and. kind /= file_kind%checkpoint) call facts%add('kind', kind_name(kind))
      call content%read(path, kind, named_dialect, points, messages)
      if (kind == file_kind%options .or. kind == file_kind%labelled) call describe_options()
      if (.not. content%valid) return
      origin%file = path
      select case (kind)
      case (file_kind%geometry); call describe_geometry()
      case (file_kind%analysis); call describe_analysis()
      case (file_kind%blocks); call describe_blocks()
      case (file_kind%statistics); call describe_statistics()
      case (file_kind%hdf5); call describe_results()
      case (file_kind%checkpoint); call describe_checkpoint()
      case (file_kind%ddaml); call messages%add(severity%warning, ddaml_advice, origin)
      case (file_kind%unknown)
         call messages%add(severity%warning, 'this version does not describe files of this kind: '//kind_name(kind), &
                           origin)
      end select

   contains

      !> Describe a checkpoint.
      subroutine describe_checkpoint()
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
         call facts%add('time', info%time, 'time')
         if (info%n_steps < huge(1)) call facts%add('last_step_of_run', info%n_steps)
         if (info%t_end < huge(1.0_wp)) call facts%add('end_time_of_run', info%t_end, 'time')
         call facts%add('frames', info%facts%rows%frames)
         call facts%add('sha256', info%digest)
         call facts%add('sha256_of_geometry', info%input_digests(1))
         call facts%add('sha256_of_analysis', info%input_digests(2))
         call facts%add('sha256_of_options', info%input_digests(3))
      end subroutine describe_checkpoint

      !> Describe a joint statistics file.
      subroutine describe_statistics()
         integer :: i
         associate (statistics => content%statistics)
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
         end associate
      end subroutine describe_statistics

      !> Describe a results file.
      subroutine describe_results()
         associate (info => content%results)
            call facts%add('kind', 'results file')
            facts%system = unit_system(info%units)
            call facts%add('title', info%title)
            call facts%add('units', facts%system%description())
            call facts%add('format_version', info%format_version)
            call facts%add('program_version', info%program_version)
            call facts%add('created', info%created)
            call facts%add('complete', info%complete)
            call facts%add('exit_reason', info%exit_reason)
            call facts%add('blocks', int(info%n_blocks))
            if (info%n_cells > 0) call facts%add('cells', info%n_cells)
            if (info%n_cells > 0) call facts%add('blocks_before_subdivision', info%n_parents)
            call facts%add('vertices', int(info%n_vertices))
            call facts%add('fixed_points', int(info%n_fixed))
            call facts%add('loading_points', int(info%n_loading))
            call facts%add('measured_points', int(info%n_measured))
            if (allocated(info%measured_number)) call add_numbers(facts, info%measured_number)
            call facts%add('steps', int(info%n_steps))
            call facts%add('last_step', info%last_step)
            call facts%add('last_time', info%last_time, 'time')
            call facts%add('frames', int(info%n_frames))
            call facts%add('first_frame_time', info%first_frame, 'time')
            call facts%add('last_frame_time', info%last_frame, 'time')
            call add_displacements(facts, info)
         end associate
      end subroutine describe_results

      !> Describe an options file: its groups and names.
      subroutine describe_options()
         type(given_group_type), allocatable :: groups(:)
         integer :: i
         call list_given_options(path, groups)
         do i = 1, size(groups)
            call facts%add('&'//groups(i)%name, groups(i)%entries)
         end do
      end subroutine describe_options

      !> Describe a geometry file.
      subroutine describe_geometry()
         associate (geometry => content%geometry)
            call facts%add('edge_node_distance', geometry%edge_node_distance)
            call facts%add('lines', size(geometry%lines, 2))
            call facts%add('boundary_lines', geometry%n_boundary)
            call facts%add('material_lines', size(geometry%material_lines, 2))
            call facts%add('bolts', size(geometry%bolts))
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
         end associate
      end subroutine describe_geometry

      !> Describe a block file.
      subroutine describe_blocks()
         integer :: i, nv
         real(wp) :: area
         associate (blocks => content%blocks)
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
         end associate
      end subroutine describe_blocks

      !> Describe an analysis file.
      subroutine describe_analysis()
         integer :: i
         associate (analysis => content%analysis)
            call facts%add('dialect', trim(merge(dda_windows, 'g0         ', analysis%dialect == dialect%windows)))
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
         end associate
      end subroutine describe_analysis

   end subroutine describe_file

   !> The displacements of measured points in a results file as text; '' without.
   function displacements_text(path) result(text)
      character(len=*), intent(in) :: path
      character(len=:), allocatable :: text
      type(facts_type) :: facts
      call read_displacements(path, facts)
      facts%title = 'displacements of measured points, by stage and since the start'
      text = ''
      if (facts%n > 0) text = facts%to_text()
   end function displacements_text

   !> Write the displacements of measured points in a results file as an object.
   subroutine put_displacements(path, json)
      character(len=*), intent(in) :: path
      type(json_type), intent(inout) :: json
      type(facts_type) :: facts
      call read_displacements(path, facts)
      facts%title = path
      call facts%to_json(json, 'measured_displacements')
   end subroutine put_displacements

   !> Find the displacements of measured points in a results file; nothing where it cannot be read.
   subroutine read_displacements(path, facts)
      character(len=*), intent(in) :: path
      type(facts_type), intent(inout) :: facts
      type(results_info_type) :: info
      type(error_type), allocatable :: unreadable
      call read_results_info(path, info, unreadable)
      if (allocated(unreadable)) return
      facts%system = unit_system(info%units)
      call add_displacements(facts, info)
   end subroutine read_displacements

   !> Add the displacements of measured points, stage by stage.
   subroutine add_displacements(facts, info)
      type(facts_type), intent(inout) :: facts
      type(results_info_type), intent(in) :: info
      integer :: s, p
      do s = 1, size(info%stages)
         associate (stage => info%stages(s))
            do p = 1, size(stage%change, 2)
               call facts%add_motion('stage_'//to_string(s)//'_point_'//to_string(number(p)), stage%name, &
                                     stage%change(:, p), stage%total(:, p))
            end do
         end associate
      end do

   contains

      !> Number of a measured point in the input.
      pure integer function number(p)
         integer, intent(in) :: p
         number = p
         if (allocated(info%measured_number)) number = info%measured_number(p)
      end function number

   end subroutine add_displacements

   !> Add the numbers of the measured points where they are not 1 ... n: points of the input were ignored.
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

end module rockdda_app_file_facts
