! SPDX-License-Identifier: MIT
!> Writer of block files (.blk), format version 1. Format: docs/file-formats.md; reader: block_file.f90.
!>
!> Writes geometry input as a legacy text file that reads back exactly.
module rockdda_io_block_writer
   use rockdda_base_strings, only : to_string
   use rockdda_base_error, only : error_type
   use rockdda_model_blocks, only : block_system_type, point_set_type
   use rockdda_io_text_output, only : text_writer_type, exact_text, exact_row
   use rockdda_base_kinds, only : wp
   use rockdda_model_geometry_input, only : geometry_input_type
   implicit none
   private
   public :: write_block_file, write_geometry_file

contains

   !> Write a block system; it reads back bit for bit. The file appears complete or not at all.
   subroutine write_block_file(path, blocks, error)
      character(len=*), intent(in) :: path
      type(block_system_type), intent(in) :: blocks
      type(error_type), allocatable, intent(out) :: error   !! code error_code%output
      type(text_writer_type) :: writer
      integer :: i, k
      call writer%open(path, error)
      if (allocated(error)) return
      call writer%line('rockdda-blocks 1')
      call writer%line('# blocks of a discontinuous deformation analysis; numbers count from 1')
      call writer%line('e0 '//exact_text(blocks%edge_node_distance))
      call writer%line('blocks '//to_string(blocks%n_blocks))
      call writer%line('vertices '//to_string(blocks%n_vertices()))
      call writer%line('fixed '//to_string(blocks%fixed%n))
      call writer%line('loading '//to_string(blocks%loading%n))
      call writer%line('measured '//to_string(blocks%measured%n))
      call writer%line('bolts '//to_string(blocks%bolts%n))
      call writer%line('# block: number, material, vertices; then x, y, joint material of the edge that starts there')
      do i = 1, blocks%n_blocks
         call writer%line('block '//to_string(i)//' '//to_string(blocks%block_material(i))//' '// &
                          to_string(blocks%vertex_offset(i + 1) - blocks%vertex_offset(i)))
         do k = blocks%vertex_offset(i) + 1, blocks%vertex_offset(i + 1)
            call writer%line(exact_row(blocks%vertices(:, k), ' ')//' '//to_string(blocks%edge_joint(k)))
         end do
      end do
      call write_points('fixed_points  # x, y, block', blocks%fixed)
      call write_points('loading_points  # x, y, block', blocks%loading)
      call write_points('measured_points  # x, y, block, number of the input where it is not the position here', &
                        blocks%measured)
      call writer%line('bolt_list  # x1, y1, x2, y2, blocks of both ends (0: fixed outside), stiffness, '// &
                       'pretension, strength')
      do i = 1, blocks%bolts%n
         call writer%line(exact_row(blocks%bolts%ends(:, i), ' ')//' '// &
                          to_string(blocks%bolts%blocks(1, i))//' '//to_string(blocks%bolts%blocks(2, i))//' '// &
                          exact_row([blocks%bolts%stiffness(i), blocks%bolts%pretension(i), &
                                     blocks%bolts%strength(i)], ' '))
      end do
      call writer%line('end')
      call writer%close(error)

   contains

      !> Write one section of points.
      subroutine write_points(title, points)
         character(len=*), intent(in) :: title
         type(point_set_type), intent(in) :: points
         character(len=:), allocatable :: number
         integer, allocatable :: numbers(:)
         integer :: k
         allocate (numbers, source=points%numbers())
         call writer%line(title)
         do k = 1, points%n
            number = ''
            if (numbers(k) /= k) number = ' '//to_string(numbers(k))
            call writer%line(exact_row(points%position(:, k), ' ')//' '//to_string(points%block(k))//number)
         end do
      end subroutine write_points

   end subroutine write_block_file

   !> Write a geometry file; bolts with their three values.
   subroutine write_geometry_file(path, geometry, error)
      character(len=*), intent(in) :: path
      type(geometry_input_type), intent(in) :: geometry
      type(error_type), allocatable, intent(out) :: error
      type(text_writer_type) :: writer
      integer :: i
      call writer%open(path, error)
      if (allocated(error)) return
      call writer%line(exact_text(geometry%edge_node_distance)//'  # minimum edge-node distance e0')
      call writer%line(to_string(size(geometry%line_joint))//' '//to_string(geometry%n_boundary)// &
                       '  # lines, of which boundary lines come first')
      call writer%line(to_string(size(geometry%line_material))//'  # material lines')
      call writer%line(to_string(size(geometry%bolts))//'  # bolts')
      call writer%line(to_string(size(geometry%fixed_lines, 2))//'  # fixed lines')
      call writer%line(to_string(size(geometry%loading_points, 2))//'  # loading points')
      call writer%line(to_string(size(geometry%measured_points, 2))//'  # measured points')
      call writer%line(to_string(size(geometry%hole_points, 2))//'  # hole points')
      do i = 1, size(geometry%line_joint)
         call writer%line(exact_row(geometry%lines(:, i), ' ')//' '//to_string(geometry%line_joint(i)))
      end do
      do i = 1, size(geometry%line_material)
         call writer%line(exact_row(geometry%material_lines(:, i), ' ')//' '//to_string(geometry%line_material(i)))
      end do
      do i = 1, size(geometry%bolts)
         associate (bolt => geometry%bolts(i))
            call writer%line(exact_row([bolt%from, bolt%to, bolt%stiffness, bolt%pretension, bolt%yield_force], ' '))
         end associate
      end do
      call write_rows(geometry%fixed_lines)
      call write_rows(geometry%loading_points)
      call write_rows(geometry%measured_points)
      call write_rows(geometry%hole_points)
      call writer%close(error)

   contains

      !> Write one line for each column of an array.
      subroutine write_rows(values)
         real(wp), intent(in) :: values(:, :)
         integer :: k
         do k = 1, size(values, 2)
            call writer%line(exact_row(values(:, k), ' '))
         end do
      end subroutine write_rows

   end subroutine write_geometry_file

end module rockdda_io_block_writer
