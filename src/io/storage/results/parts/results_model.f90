! SPDX-License-Identifier: MIT
!> What a results file says of the run and its model: attributes, input texts, blocks, points, bolts, surroundings.
!>
!> Water in a results file: which stretches of edges it wets, and its pressure. Only files of models with water have
!> these datasets.
!>
!>     model/water_edges         (n, 4) group, both vertices of the edge, joint material on the other side (0: free)
!>     model/water_ends          (n, 2) ends of the stretch, shares of the edge's length
!>     model/water_unit_weight   (groups) of groups with a table, else 0
!>     model/water_table         (m, 2) points x, y of all tables, and water_table_group (m)
!>     model/water_level_rise    (m) with water_level_time and water_level_group
!>     model/water_pressure      (m) with water_points (m, 2) and water_points_group
!>
!> Groups and vertices count from 0; model/water_names holds the names of the groups and model/water_stage
!> for each stage the names of those that act (empty: all).
module rockdda_io_results_model
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type
   use rockdda_model_options, only : water_type, is_set
   use rockdda_model_blocks, only : block_system_type, point_set_type, bolt_set_type
   use rockdda_model_state, only : block_state_type
   use rockdda_io_hdf5_adapter, only : hdf5_file_type
   use rockdda_io_results_tables, only : results_header_type, results_format_version
   implicit none
   private
   public :: write_run

contains

   !> Write header and model into a new file.
   subroutine write_run(file, header, blocks, state, error)
      type(hdf5_file_type), intent(in) :: file
      type(results_header_type), intent(in) :: header
      type(block_system_type), intent(in) :: blocks
      type(block_state_type), intent(in) :: state      !! at the start
      type(error_type), allocatable, intent(out) :: error
      call write_header()
      call write_model()
      if (header%n_bolt_nodes > 0) call write_nodes()
      if (header%n_liner_nodes > 0) call write_liners()
      call write_boundaries()
      call write_stage_names()
      if (.not. allocated(error)) call write_water(file, header, error)

   contains

      !> Write the model at the start.
      subroutine write_model()
         integer :: nb, nv
         nb = blocks%n_blocks
         nv = blocks%n_vertices()
         call file%write('model/vertex_offset', [nb + 1], blocks%vertex_offset, error)
         call file%write('model/vertices', [2, nv], reshape(blocks%vertices(:, 1:nv), [2*nv]), error)
         call file%write('model/edge_joint', [nv], blocks%edge_joint, error)
         call file%write('model/block_material', [nb], blocks%block_material, error)
         if (allocated(blocks%parent)) call file%write('model/parent', [nb], blocks%parent - 1, error)
         call file%write('model/block_area', [nb], state%area, error)
         call file%write('model/block_centroid', [2, nb], reshape(state%centroid + spread(state%datum, 2, nb), &
                         [2*nb]), error)
         call write_points('model/fixed_points', blocks%fixed)
         call write_points('model/loading_points', blocks%loading)
         call write_points('model/measured_points', blocks%measured)
         call file%set_attribute('model/measured_points', 'number', blocks%measured%numbers(), error)
         call write_bolts(blocks%bolts)
      end subroutine write_model

      !> Write the names of the stages.
      subroutine write_stage_names()
         if (allocated(header%stage_names)) then
            call file%write_texts('model/stage_names', header%stage_names, error)
            if (allocated(header%stage_resets)) &
               call file%set_attribute('model/stage_names', 'reset_displacement', header%stage_resets, error)
         else
            call file%write_texts('model/stage_names', ['stage 1'], error)
         end if
      end subroutine write_stage_names

      !> Write the names of all bolts and how many nodes are before those of each.
      subroutine write_nodes()
         call file%write_texts('model/bolt_names', header%bolt_names, error)
         call file%write('model/bolt_first', [size(header%bolt_first)], header%bolt_first, error)
         call file%set_attribute('model/bolt_names', 'spacing_out_of_plane', header%bolt_spacing, error)
         call file%set_attribute('model/bolt_first', 'spacing_out_of_plane', header%bolt_spacing, error)
      end subroutine write_nodes

      !> Write the names of all linings, how many nodes are before those of each, their sections, and which are closed.
      subroutine write_liners()
         integer :: n
         n = size(header%liner_section, 2)
         call file%write_texts('model/liner_names', header%liner_names, error)
         call file%write('model/liner_first', [size(header%liner_first)], header%liner_first, error)
         call file%write('model/liner_section', [5, n], reshape(header%liner_section, [5*n]), error)
      end subroutine write_liners

      !> Write attributes of the file and the input texts.
      subroutine write_header()
         character(len=*), parameter :: groups(4) = [character(len=7) :: 'input', 'model', 'history', 'frames']
         integer :: i
         call file%set_attribute('/', 'format', 'rockdda', error)
         call file%set_attribute('/', 'format_version', results_format_version, error)
         call file%set_attribute('/', 'program_version', header%program_version, error)
         call file%set_attribute('/', 'title', header%title, error)
         call file%set_attribute('/', 'created', header%created, error)
         call file%set_attribute('/', 'units', trim(header%units), error)
         call file%set_attribute('/', 'complete', 0, error)
         call file%set_attribute('/', 'exit_reason', 'running', error)
         do i = 1, size(groups)
            call file%create_group(trim(groups(i)), error)
         end do
         call file%write('input/geometry', header%geometry, error)
         call file%write('input/analysis', header%analysis, error)
         call file%write('input/config', header%config, error)
      end subroutine write_header

      !> Write the edges of the boundaries, if there are any: each by the number of its boundary and its first vertex.
      subroutine write_boundaries()
         if (header%n_boundaries == 0) return
         call file%write('model/boundary_edges', [2, size(header%boundary_edges, 2)], &
                         reshape(header%boundary_edges - 1, [size(header%boundary_edges)]), error)
         call file%set_attribute('model/boundary_edges', 'kind', header%boundary_kinds, error)
      end subroutine write_boundaries

      !> Write points with the attribute `block`, counted from 0.
      subroutine write_points(name, points)
         character(len=*), intent(in) :: name
         type(point_set_type), intent(in) :: points
         real(wp), allocatable :: position(:)
         integer, allocatable :: block(:)
         allocate (position(0), block(0))
         if (points%n > 0) then
            position = reshape(points%position(:, 1:points%n), [2*points%n])
            block = points%block(1:points%n) - 1
         end if
         call file%write(name, [2, points%n], position, error)
         call file%set_attribute(name, 'block', block, error)
      end subroutine write_points

      !> Write bolts: ends at the start, blocks of the two ends from 0 (-1: outside), and stiffness, pretension,
      !> strength.
      subroutine write_bolts(bolts)
         type(bolt_set_type), intent(in) :: bolts
         real(wp), allocatable :: ends(:), values(:, :)
         integer, allocatable :: block(:)
         integer :: n
         n = bolts%n
         allocate (ends(0), block(0), values(3, n))
         if (n > 0) then
            ends = reshape(bolts%ends(:, 1:n), [4*n])
            block = reshape(bolts%blocks(:, 1:n) - 1, [2*n])
            values(1, :) = bolts%stiffness(1:n)
            values(2, :) = bolts%pretension(1:n)
            values(3, :) = bolts%strength(1:n)
         end if
         call file%write('model/bolt_ends', [2, 2, n], ends, error)
         call file%write('model/bolt_blocks', [2, n], block, error)
         call file%write('model/bolt_properties', [3, n], reshape(values, [3*n]), error)
      end subroutine write_bolts

   end subroutine write_run

   !> Write the water of the header, if there is any.
   subroutine write_water(file, header, error)
      type(hdf5_file_type), intent(in) :: file
      type(results_header_type), intent(in) :: header
      type(error_type), allocatable, intent(out) :: error
      character(len=80), allocatable :: names(:)
      real(wp), allocatable :: rows(:, :), unit_weight(:)
      integer, allocatable :: group(:)
      integer :: g, n
      if (.not. allocated(header%water)) return
      if (size(header%water) == 0) return
      n = size(header%water_edges, 2)
      call file%write('model/water_edges', [4, n], &
                      reshape(header%water_edges - spread([1, 1, 1, 0], 2, n), [4*n]), error)
      allocate (names(size(header%water)), unit_weight(size(header%water)))
      names = ''
      unit_weight = 0
      do g = 1, size(names)
         if (allocated(header%water(g)%name)) names(g) = adjustl(header%water(g)%name)
         if (is_set(header%water(g)%unit_weight)) unit_weight(g) = header%water(g)%unit_weight
      end do
      call file%write_texts('model/water_names', names, error)
      if (allocated(header%stage_water)) call file%write_texts('model/water_stage', header%stage_water, error)
      call file%write('model/water_ends', [2, n], reshape(header%water_ends, [2*n]), error)
      call file%write('model/water_unit_weight', [size(names)], unit_weight, error)
      call collect(header%water, 1, rows, group)
      call put('model/water_table', rows(1:2, :))
      call put_group('model/water_table_group')
      call collect(header%water, 2, rows, group)
      call put('model/water_level_time', rows(1:1, :))
      call put('model/water_level_rise', rows(2:2, :))
      call put_group('model/water_level_group')
      call collect(header%water, 3, rows, group)
      call put('model/water_points', rows(1:2, :))
      call put('model/water_pressure', rows(3:3, :))
      call put_group('model/water_points_group')

   contains

      !> Write columns.
      subroutine put(name, columns)
         character(len=*), intent(in) :: name
         real(wp), intent(in) :: columns(:, :)
         if (size(columns, 1) == 1) then
            call file%write(name, [size(columns, 2)], columns(1, :), error)
         else
            call file%write(name, [size(columns, 1), size(columns, 2)], reshape(columns, [size(columns)]), error)
         end if
      end subroutine put

      !> Write the groups of rows.
      subroutine put_group(name)
         character(len=*), intent(in) :: name
         call file%write(name, [size(group)], group - 1, error)
      end subroutine put_group

   end subroutine write_water

   !> Rows of all groups: of tables (1), levels (2) or pressures (3), and their groups.
   subroutine collect(water, what, rows, group)
      type(water_type), intent(in) :: water(:)
      integer, intent(in) :: what
      real(wp), allocatable, intent(out) :: rows(:, :)      !! (3, n)
      integer, allocatable, intent(out) :: group(:)         !! (n)
      integer :: g, k
      allocate (rows(3, 0), group(0))
      do g = 1, size(water)
         select case (what)
         case (1)
            if (allocated(water(g)%table)) call append(water(g)%table)
         case (2)
            if (allocated(water(g)%level)) call append(water(g)%level)
         case default
            if (allocated(water(g)%pressure)) call append(water(g)%pressure)
         end select
      end do

   contains

      !> Append the rows of one group.
      subroutine append(more)
         real(wp), intent(in) :: more(:, :)
         real(wp), allocatable :: longer(:, :)
         allocate (longer(3, size(rows, 2) + size(more, 2)))
         longer(:, 1:size(rows, 2)) = rows
         longer(:, size(rows, 2) + 1:) = 0
         longer(1:size(more, 1), size(rows, 2) + 1:) = more
         call move_alloc(longer, rows)
         group = [group, [(g, k=1, size(more, 2))]]
      end subroutine append

   end subroutine collect

end module rockdda_io_results_model
