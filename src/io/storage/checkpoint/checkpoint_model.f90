! SPDX-License-Identifier: MIT
!> Write model and parameters of a run to a checkpoint, and read them. Their places in the input files, which only
!> messages about the input need, are not kept.
!>
!> What the table of options describes follows from there (parameter_exchange.f90). Another component that is added
!> to these types has to be added here; tests/app/test_resume.py then has to see it change the results of a resumed run.
module rockdda_io_checkpoint_model
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_code, make_error
   use rockdda_model_analysis_input, only : time_table_type
   use rockdda_model_blocks, only : block_system_type, point_set_type, bolt_set_type
   use rockdda_model_options, only : run_options_type
   use rockdda_model_option_rows, only : option_rows_type
   use rockdda_model_option_table, only : describe_parameters
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_units, only : unit_system_names
   use rockdda_io_archive, only : archive_type
   use rockdda_io_parameter_exchange, only : exchange_rows, load_sizes
   use rockdda_base_value_check, only : value_check_type
   implicit none
   private
   public :: exchange_blocks, exchange_parameters

contains

   !> Save or load blocks, points and bolts.
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
      call archive%item('parent', blocks%parent)
      call exchange_points(archive, 'fixed', blocks%fixed)
      call exchange_points(archive, 'loading', blocks%loading)
      call exchange_points(archive, 'measured', blocks%measured)
      call exchange_bolts(archive, blocks%bolts)
   end subroutine exchange_blocks

   !> Save or load points that move with blocks.
   subroutine exchange_points(archive, name, points)
      type(archive_type), intent(inout) :: archive
      character(len=*), intent(in) :: name
      type(point_set_type), intent(inout) :: points
      call archive%item(name//'_n', points%n)
      call archive%item(name//'_position', points%position)
      call archive%item(name//'_block', points%block)
      call archive%item(name//'_number', points%number)   ! older files do not have it
   end subroutine exchange_points

   !> Save or load bolts.
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

   !> Save or load all numbers of the run: those of the table of options, materials, and tables of points.
   subroutine exchange_parameters(archive, parameters)
      type(archive_type), intent(inout) :: archive
      type(parameters_type), intent(inout) :: parameters
      type(option_rows_type) :: table, empty
      type(run_options_type) :: no_options
      call archive%section('parameters')
      if (.not. archive%saving) then
         call describe_parameters(empty, no_options, parameters)
         call load_sizes(archive, empty, table)
      end if
      call describe_parameters(table, no_options, parameters)
      call exchange_rows(archive, table)
      if (.not. archive%saving) then
         call table%give_back()
         call describe_parameters(table, no_options, parameters)
      end if
      call exchange_materials(archive, parameters)
      call archive%item('ends_with_stages', parameters%ends_with_stages)
      call archive%item('given_gravity', parameters%given_gravity)
      call archive%item('first_liner_material', parameters%first_liner_material)
      call exchange_units(archive, parameters)
      call archive%fixed('weight_direction', parameters%weight_direction)
      call exchange_reductions(archive, parameters)
      call exchange_tables(archive, 'fixed_table', parameters%fixed_tables)
      call exchange_tables(archive, 'loading_table', parameters%loading_tables)
   end subroutine exchange_parameters

   !> Name of the system of units.
   subroutine exchange_units(archive, parameters)
      type(archive_type), intent(inout) :: archive
      type(parameters_type), intent(inout) :: parameters
      character(len=:), allocatable :: units
      units = trim(parameters%units)
      call archive%item('units', units)
      if (archive%saving .or. allocated(archive%error)) return
      if (all(units /= unit_system_names)) call archive%refuse('units', 'holds an unknown name')
      if (.not. allocated(archive%error)) parameters%units = units
   end subroutine exchange_units

   !> By what the strength of joint materials is divided.
   subroutine exchange_reductions(archive, parameters)
      type(archive_type), intent(inout) :: archive
      type(parameters_type), intent(inout) :: parameters
      real(wp), allocatable :: reductions(:, :)
      integer :: i
      if (archive%saving) reductions = reshape([(parameters%joint_materials(i)%reduction, &
                                                 i=1, size(parameters%joint_materials))], &
                                               [3, size(parameters%joint_materials)])
      call archive%item('joint_reductions', reductions)
      if (archive%saving .or. allocated(archive%error)) return
      if (.not. allocated(reductions)) return
      if (any(shape(reductions) /= [3, size(parameters%joint_materials)])) &
         call archive%refuse('joint_reductions', 'has an unexpected shape')
      if (allocated(archive%error)) return
      do i = 1, size(reductions, 2)
         parameters%joint_materials(i)%reduction = reductions(:, i)
      end do
   end subroutine exchange_reductions

   !> Block materials: a column each. (Joint materials are a list of the table of options.)
   subroutine exchange_materials(archive, parameters)
      type(archive_type), intent(inout) :: archive
      type(parameters_type), intent(inout) :: parameters
      real(wp), allocatable :: blocks(:, :)
      integer :: i
      if (archive%saving) then
         allocate (blocks(13, size(parameters%block_materials)))
         do i = 1, size(blocks, 2)
            associate (m => parameters%block_materials(i))
               blocks(:, i) = [m%density, m%weight, m%youngs_modulus, m%poisson_ratio, m%stress, m%stress_gradient, &
                               m%velocity]
            end associate
         end do
      end if
      call archive%item('block_materials', blocks)
      if (archive%saving .or. .not. allocated(blocks)) return
      if (size(blocks, 1) /= 13) call archive%refuse('block_materials', 'has an unexpected shape')
      if (allocated(archive%error)) return
      allocate (parameters%block_materials(size(blocks, 2)))
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
   end subroutine exchange_materials

   !> Save or load time tables of points: the rows of all tables in sequence, and the last row of each table.
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
