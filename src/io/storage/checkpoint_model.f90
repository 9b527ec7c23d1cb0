! SPDX-License-Identifier: MIT
!> The model and the numbers of a run, to and from a checkpoint. Where the values came from in the input files
!> (needed for messages about the input only) is not kept.
!>
!> A component that is added to these types has to be added here; tests/app/test_resume.py then has to see it change
!> the results of a resumed run.
module rockdda_io_checkpoint_model
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_code, make_error
   use rockdda_base_strings, only : to_string
   use rockdda_model_analysis_input, only : time_table_type
   use rockdda_model_blocks, only : block_system_type, point_set_type, bolt_set_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_io_archive, only : archive_type
   use rockdda_io_value_check, only : value_check_type
   implicit none
   private
   public :: exchange_blocks, exchange_parameters

contains

   !> Blocks, points and bolts.
   subroutine exchange_blocks(archive, blocks)
      type(archive_type), intent(inout) :: archive
      type(block_system_type), intent(inout) :: blocks
      call archive%section('model')
      call archive%item('n_blocks', blocks%n_blocks)
      call archive%item('vertex_offset', blocks%vertex_offset)
      call archive%item('vertices', blocks%vertices)
      call archive%item('edge_joint', blocks%edge_joint)
      call archive%item('block_material', blocks%block_material)
      call archive%item('edge_node_distance', blocks%edge_node_distance)
      call archive%item('file_line', blocks%file_line)
      call exchange_points(archive, 'fixed', blocks%fixed)
      call exchange_points(archive, 'loading', blocks%loading)
      call exchange_points(archive, 'measured', blocks%measured)
      call exchange_bolts(archive, blocks%bolts)
   end subroutine exchange_blocks

   !> Points that move with blocks.
   subroutine exchange_points(archive, name, points)
      type(archive_type), intent(inout) :: archive
      character(len=*), intent(in) :: name
      type(point_set_type), intent(inout) :: points
      call archive%item(name//'_n', points%n)
      call archive%item(name//'_position', points%position)
      call archive%item(name//'_block', points%block)
      call archive%item(name//'_number', points%number)   ! older files do not have it
   end subroutine exchange_points

   !> Bolts.
   subroutine exchange_bolts(archive, bolts)
      type(archive_type), intent(inout) :: archive
      type(bolt_set_type), intent(inout) :: bolts
      call archive%item('bolt_n', bolts%n)
      call archive%item('bolt_ends', bolts%ends)
      call archive%item('bolt_blocks', bolts%blocks)
      call archive%item('bolt_stiffness', bolts%stiffness)
      call archive%item('bolt_pretension', bolts%pretension)
      call archive%item('bolt_strength', bolts%strength)
   end subroutine exchange_bolts

   !> All numbers of the run.
   subroutine exchange_parameters(archive, parameters)
      type(archive_type), intent(inout) :: archive
      type(parameters_type), intent(inout) :: parameters
      call archive%section('parameters')
      associate (p => parameters)
         call archive%item('title', p%title)
         call archive%item('n_steps', p%n_steps)
         call archive%item('t_end', p%t_end)
         call archive%item('k01', p%k01)
         call archive%item('dt_max', p%dt_max)
         call archive%item('dt_min', p%dt_min)
         call archive%item('cut_factor', p%cut_factor)
         call archive%item('max_open_close', p%max_open_close)
         call archive%item('displacement_ratio', p%displacement_ratio)
         call archive%item('w0', p%w0)
         call archive%item('exact_rotation', p%exact_rotation)
         call archive%item('peer_contacts', p%peer_contacts)
         call archive%item('normal_stiffness', p%normal_stiffness)
         call archive%item('shear_stiffness', p%shear_stiffness)
         call archive%item('fixed_stiffness', p%fixed_stiffness)
         call archive%item('search_distance', p%search_distance)
         call archive%item('angle_tolerance', p%angle_tolerance)
         call archive%item('close_tolerance', p%close_tolerance)
         call archive%item('open_tolerance', p%open_tolerance)
         call archive%item('plane_strain', p%plane_strain)
         call archive%item('mass_from_area', p%mass_from_area)
         call archive%item('mass_damping', p%mass_damping)
         call archive%item('gravity', p%gravity)
         call archive%item('base_table', p%base%table)
         call archive%item('base_harmonics', p%base%harmonics)
         call archive%item('solver_method', p%solver_method)
         call archive%item('preconditioner', p%preconditioner)
         call archive%item('solver_tolerance', p%solver_tolerance)
         call archive%item('sor_factor', p%sor_factor)
      end associate
      call exchange_materials(archive, parameters)
      call exchange_joint_laws(archive, parameters)
      call exchange_line_loads(archive, parameters)
      call exchange_tables(archive, 'fixed_table', parameters%fixed_tables)
      call exchange_tables(archive, 'loading_table', parameters%loading_tables)
      call exchange_stages(archive, parameters)
   end subroutine exchange_parameters

   !> Block and joint materials: a column each.
   subroutine exchange_materials(archive, parameters)
      type(archive_type), intent(inout) :: archive
      type(parameters_type), intent(inout) :: parameters
      real(wp), allocatable :: blocks(:, :), joints(:, :)
      integer :: i
      if (archive%saving) then
         allocate (blocks(13, size(parameters%block_materials)), joints(3, size(parameters%joint_materials)))
         do i = 1, size(blocks, 2)
            associate (m => parameters%block_materials(i))
               blocks(:, i) = [m%density, m%weight, m%youngs_modulus, m%poisson_ratio, m%stress, m%stress_gradient, &
                               m%velocity]
            end associate
         end do
         do i = 1, size(joints, 2)
            associate (m => parameters%joint_materials(i))
               joints(:, i) = [m%friction_angle, m%cohesion, m%tension]
            end associate
         end do
      end if
      call archive%item('block_materials', blocks)
      call archive%item('joint_materials', joints)
      if (archive%saving .or. .not. (allocated(blocks) .and. allocated(joints))) return
      if (size(blocks, 1) /= 13) call archive%refuse('block_materials', 'has an unexpected shape')
      if (size(joints, 1) /= 3) call archive%refuse('joint_materials', 'has an unexpected shape')
      if (allocated(archive%error)) return
      allocate (parameters%block_materials(size(blocks, 2)), parameters%joint_materials(size(joints, 2)))
      do i = 1, size(blocks, 2)
         associate (m => parameters%block_materials(i))
            m%density = blocks(1, i)
            m%weight = blocks(2, i)
            m%youngs_modulus = blocks(3, i)
            m%poisson_ratio = blocks(4, i)
            m%stress = blocks(5:7, i)
            m%stress_gradient = blocks(8:10, i)
            m%velocity = blocks(11:13, i)
         end associate
      end do
      do i = 1, size(joints, 2)
         associate (m => parameters%joint_materials(i))
            m%friction_angle = joints(1, i)
            m%cohesion = joints(2, i)
            m%tension = joints(3, i)
         end associate
      end do
   end subroutine exchange_materials

   !> Laws of joints: a few.
   subroutine exchange_joint_laws(archive, parameters)
      type(archive_type), intent(inout) :: archive
      type(parameters_type), intent(inout) :: parameters
      character(len=:), allocatable :: name
      integer :: i, n
      n = 0
      if (archive%saving) n = size(parameters%joint_laws)
      call archive%item('joint_laws', n)
      call check_number(archive, 'joint_laws', n, 'joint_law_'//to_string(n)//'_material')
      if (.not. archive%saving) allocate (parameters%joint_laws(n))
      do i = 1, n
         name = 'joint_law_'//to_string(i)
         associate (law => parameters%joint_laws(i))
            call archive%item(name//'_material', law%material)
            call archive%item(name//'_law', law%law)
            call archive%item(name//'_parameters', law%parameters)
            call archive%item(name//'_damping_ratio', law%damping_ratio)
         end associate
      end do
   end subroutine exchange_joint_laws

   !> Loads on edges: a few.
   subroutine exchange_line_loads(archive, parameters)
      type(archive_type), intent(inout) :: archive
      type(parameters_type), intent(inout) :: parameters
      character(len=:), allocatable :: name
      integer :: i, n
      n = 0
      if (archive%saving) n = size(parameters%line_loads)
      call archive%item('line_loads', n)
      call check_number(archive, 'line_loads', n, 'line_load_'//to_string(n)//'_ends')
      if (.not. archive%saving) allocate (parameters%line_loads(n))
      do i = 1, n
         name = 'line_load_'//to_string(i)
         associate (load => parameters%line_loads(i))
            call archive%fixed(name//'_ends', load%ends)
            call archive%fixed(name//'_force_start', load%force_start)
            call archive%fixed(name//'_force_end', load%force_end)
            call archive%item(name//'_table', load%table)
         end associate
      end do
   end subroutine exchange_line_loads

   !> Stages of the run: a few.
   subroutine exchange_stages(archive, parameters)
      type(archive_type), intent(inout) :: archive
      type(parameters_type), intent(inout) :: parameters
      character(len=:), allocatable :: name
      integer :: i, n
      n = 0
      if (archive%saving) n = size(parameters%stages)
      call archive%item('stages', n)
      call check_number(archive, 'stages', n, 'stage_'//to_string(n)//'_until_step')
      if (.not. archive%saving) allocate (parameters%stages(n))
      do i = 1, n
         name = 'stage_'//to_string(i)
         associate (stage => parameters%stages(i))
            call archive%item(name//'_until_step', stage%until_step)
            call archive%item(name//'_until_time', stage%until_time)
            call archive%item(name//'_k01', stage%k01)
            call archive%item(name//'_gravity', stage%gravity)
            call archive%item(name//'_release', stage%release)
         end associate
      end do
   end subroutine exchange_stages

   !> A number of things that comes from a file: the last one must be there. Else it becomes 0, and loading fails.
   subroutine check_number(archive, name, n, last)
      type(archive_type), intent(inout) :: archive
      character(len=*), intent(in) :: name
      integer, intent(inout) :: n
      character(len=*), intent(in) :: last        !! an item of the last one
      logical :: there
      if (archive%saving) return
      there = archive%has_item(last)
      if (n < 0 .or. (n > 0 .and. .not. there)) call archive%refuse(name, 'holds an impossible number')
      if (allocated(archive%error)) n = 0
   end subroutine check_number

   !> Tables of points, of which there may be many: all rows one after another, and where each table ends.
   subroutine exchange_tables(archive, name, tables)
      type(archive_type), intent(inout) :: archive
      character(len=*), intent(in) :: name
      type(time_table_type), allocatable, intent(inout) :: tables(:)
      integer, allocatable :: offset(:)
      real(wp), allocatable :: rows(:, :)
      type(value_check_type) :: check
      integer :: i
      check%group = 'parameters'
      if (archive%saving) then
         allocate (offset(size(tables) + 1))
         offset(1) = 0
         do i = 1, size(tables)
            offset(i + 1) = offset(i)
            if (allocated(tables(i)%rows)) offset(i + 1) = offset(i) + size(tables(i)%rows, 2)
         end do
         allocate (rows(3, offset(size(offset))))
         do i = 1, size(tables)
            if (allocated(tables(i)%rows)) rows(:, offset(i) + 1:offset(i + 1)) = tables(i)%rows
         end do
      end if
      call archive%item(name//'_offset', offset)
      call archive%item(name//'_rows', rows)
      if (archive%saving .or. .not. (allocated(offset) .and. allocated(rows))) return
      call check%has_shape(size(rows, 1) == 3, name//'_rows')
      call check%are_offsets(offset, size(rows, 2), 0, name//'_offset')
      if (.not. check%passed()) call make_error(archive%error, error_code%input, archive%file%path// &
                                                ': the checkpoint is damaged: '//check%problem())
      if (allocated(archive%error)) return
      allocate (tables(size(offset) - 1))
      do i = 1, size(tables)
         tables(i)%rows = rows(:, offset(i) + 1:offset(i + 1))
      end do
   end subroutine exchange_tables

end module rockdda_io_checkpoint_model
