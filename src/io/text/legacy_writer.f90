! SPDX-License-Identifier: MIT
!> Writes geometry input as a legacy text file that reads back exactly.
module rockdda_io_legacy_writer
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : to_string
   use rockdda_base_error, only : error_type
   use rockdda_model_geometry_input, only : geometry_input_type
   use rockdda_io_text_output, only : text_writer_type, exact_text, exact_row
   implicit none
   private
   public :: write_geometry_file

contains

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

end module rockdda_io_legacy_writer
