! SPDX-License-Identifier: MIT
!> What a results file says of the run and its model: attributes, input texts, blocks, points, bolts, surroundings.
module rockdda_io_results_model
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type
   use rockdda_model_blocks, only : block_system_type, point_set_type, bolt_set_type
   use rockdda_model_state, only : block_state_type
   use rockdda_io_hdf5_adapter, only : hdf5_file_type
   use rockdda_io_results_header, only : results_header_type, results_format_version
   use rockdda_io_results_water, only : write_water
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
      call write_header(file, header, error)
      if (.not. allocated(error)) call write_model(file, blocks, state, error)
      if (.not. allocated(error) .and. header%n_bolt_nodes > 0) call write_nodes(file, header, error)
      if (.not. allocated(error) .and. header%n_liner_nodes > 0) call write_liners(file, header, error)
      if (.not. allocated(error)) call write_boundaries(file, header, error)
      if (.not. allocated(error)) call write_stage_names(file, header, error)
      if (.not. allocated(error)) call write_water(file, header, error)
   end subroutine write_run

   !> Write the names of the stages.
   subroutine write_stage_names(file, header, error)
      type(hdf5_file_type), intent(in) :: file
      type(results_header_type), intent(in) :: header
      type(error_type), allocatable, intent(out) :: error
      if (allocated(header%stage_names)) then
         call file%write_texts('model/stage_names', header%stage_names, error)
         if (allocated(header%stage_resets) .and. .not. allocated(error)) &
            call file%set_attribute('model/stage_names', 'reset_displacement', header%stage_resets, error)
      else
         call file%write_texts('model/stage_names', ['stage 1'], error)
      end if
   end subroutine write_stage_names

   !> Write attributes of the file and the input texts.
   subroutine write_header(file, header, error)
      type(hdf5_file_type), intent(in) :: file
      type(results_header_type), intent(in) :: header
      type(error_type), allocatable, intent(out) :: error
      character(len=*), parameter :: groups(4) = [character(len=7) :: 'input', 'model', 'history', 'frames']
      integer :: i
      call file%set_attribute('/', 'format', 'rockdda', error)
      if (.not. allocated(error)) call file%set_attribute('/', 'format_version', results_format_version, error)
      if (.not. allocated(error)) call file%set_attribute('/', 'program_version', header%program_version, error)
      if (.not. allocated(error)) call file%set_attribute('/', 'title', header%title, error)
      if (.not. allocated(error)) call file%set_attribute('/', 'created', header%created, error)
      if (.not. allocated(error)) call file%set_attribute('/', 'units', trim(header%units), error)
      if (.not. allocated(error)) call file%set_attribute('/', 'complete', 0, error)
      if (.not. allocated(error)) call file%set_attribute('/', 'exit_reason', 'running', error)
      do i = 1, size(groups)
         if (.not. allocated(error)) call file%create_group(trim(groups(i)), error)
      end do
      if (.not. allocated(error)) call file%write('input/geometry', header%geometry, error)
      if (.not. allocated(error)) call file%write('input/analysis', header%analysis, error)
      if (.not. allocated(error)) call file%write('input/config', header%config, error)
   end subroutine write_header

   !> Write the model at the start.
   subroutine write_model(file, blocks, state, error)
      type(hdf5_file_type), intent(in) :: file
      type(block_system_type), intent(in) :: blocks
      type(block_state_type), intent(in) :: state
      type(error_type), allocatable, intent(out) :: error
      integer :: nb, nv
      nb = blocks%n_blocks
      nv = blocks%n_vertices()
      call file%write('model/vertex_offset', [nb + 1], blocks%vertex_offset, error)
      if (.not. allocated(error)) call file%write('model/vertices', [2, nv], &
                                                       reshape(blocks%vertices(:, 1:nv), [2*nv]), error)
      if (.not. allocated(error)) call file%write('model/edge_joint', [nv], blocks%edge_joint, error)
      if (.not. allocated(error)) call file%write('model/block_material', [nb], blocks%block_material, error)
      if (.not. allocated(error) .and. allocated(blocks%parent)) &
         call file%write('model/parent', [nb], blocks%parent - 1, error)
      if (.not. allocated(error)) call file%write('model/block_area', [nb], state%area, error)
      if (.not. allocated(error)) call file%write('model/block_centroid', [2, nb], &
                                                       reshape(state%centroid + spread(state%datum, 2, nb), &
                                                          [2*nb]), error)
      if (.not. allocated(error)) call write_points(file, 'model/fixed_points', blocks%fixed, error)
      if (.not. allocated(error)) call write_points(file, 'model/loading_points', blocks%loading, error)
      if (.not. allocated(error)) call write_points(file, 'model/measured_points', blocks%measured, error)
      if (.not. allocated(error)) call file%set_attribute('model/measured_points', 'number', &
                                                               blocks%measured%numbers(), error)
      if (.not. allocated(error)) call write_bolts(file, blocks%bolts, error)
   end subroutine write_model

   !> Write bolts: ends at the start, blocks of the two ends from 0 (-1: outside), and stiffness, pretension, strength.
   subroutine write_bolts(file, bolts, error)
      type(hdf5_file_type), intent(in) :: file
      type(bolt_set_type), intent(in) :: bolts
      type(error_type), allocatable, intent(out) :: error
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
      if (.not. allocated(error)) call file%write('model/bolt_blocks', [2, n], block, error)
      if (.not. allocated(error)) call file%write('model/bolt_properties', [3, n], reshape(values, [3*n]), error)
   end subroutine write_bolts

   !> Write the names of all bolts and how many nodes are before those of each.
   subroutine write_nodes(file, header, error)
      type(hdf5_file_type), intent(in) :: file
      type(results_header_type), intent(in) :: header
      type(error_type), allocatable, intent(out) :: error
      call file%write_texts('model/bolt_names', header%bolt_names, error)
      if (.not. allocated(error)) call file%write('model/bolt_first', [size(header%bolt_first)], header%bolt_first, &
                                                       error)
      if (.not. allocated(error)) call file%set_attribute('model/bolt_names', 'spacing_out_of_plane', &
                                                               header%bolt_spacing, error)
      if (.not. allocated(error)) call file%set_attribute('model/bolt_first', 'spacing_out_of_plane', &
                                                               header%bolt_spacing, error)
   end subroutine write_nodes

   !> Write the names of all linings, how many nodes are before those of each, their sections, and which are closed.
   subroutine write_liners(file, header, error)
      type(hdf5_file_type), intent(in) :: file
      type(results_header_type), intent(in) :: header
      type(error_type), allocatable, intent(out) :: error
      integer :: n
      n = size(header%liner_section, 2)
      call file%write_texts('model/liner_names', header%liner_names, error)
      if (.not. allocated(error)) call file%write('model/liner_first', [size(header%liner_first)], header%liner_first, &
                                                       error)
      if (.not. allocated(error)) call file%write('model/liner_section', [5, n], reshape(header%liner_section, [5*n]), &
                                                       error)
   end subroutine write_liners

   !> Write the edges of the boundaries, if there are any: each by the number of its boundary and its first vertex.
   subroutine write_boundaries(file, header, error)
      type(hdf5_file_type), intent(in) :: file
      type(results_header_type), intent(in) :: header
      type(error_type), allocatable, intent(out) :: error
      if (header%n_boundaries == 0) return
      call file%write('model/boundary_edges', [2, size(header%boundary_edges, 2)], &
                      reshape(header%boundary_edges - 1, [size(header%boundary_edges)]), error)
      if (.not. allocated(error)) call file%set_attribute('model/boundary_edges', 'kind', header%boundary_kinds, error)
   end subroutine write_boundaries

   !> Write points with the attribute `block`, counted from 0.
   subroutine write_points(file, name, points, error)
      type(hdf5_file_type), intent(in) :: file
      character(len=*), intent(in) :: name
      type(point_set_type), intent(in) :: points
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: position(:)
      integer, allocatable :: block(:)
      allocate (position(0), block(0))
      if (points%n > 0) then
         position = reshape(points%position(:, 1:points%n), [2*points%n])
         block = points%block(1:points%n) - 1
      end if
      call file%write(name, [2, points%n], position, error)
      if (.not. allocated(error)) call file%set_attribute(name, 'block', block, error)
   end subroutine write_points

end module rockdda_io_results_model
