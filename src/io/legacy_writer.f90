! SPDX-License-Identifier: MIT
!> Writes geometry and analysis input as legacy text files that read back exactly.
module rockdda_io_legacy_writer
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : to_string
   use rockdda_base_error, only : error_type
   use rockdda_model_analysis_input, only : analysis_input_type, dialect, time_table_type
   use rockdda_model_geometry_input, only : geometry_input_type
   use rockdda_io_text_output, only : text_writer_type, exact_text
   implicit none
   private
   public :: write_geometry_file, write_analysis_file

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
      call writer%line(to_string(size(geometry%bolts, 2))//'  # bolts')
      call writer%line(to_string(size(geometry%fixed_lines, 2))//'  # fixed lines')
      call writer%line(to_string(size(geometry%loading_points, 2))//'  # loading points')
      call writer%line(to_string(size(geometry%measured_points, 2))//'  # measured points')
      call writer%line(to_string(size(geometry%hole_points, 2))//'  # hole points')
      do i = 1, size(geometry%line_joint)
         call writer%line(row_text(geometry%lines(:, i))//' '//to_string(geometry%line_joint(i)))
      end do
      do i = 1, size(geometry%line_material)
         call writer%line(row_text(geometry%material_lines(:, i))//' '//to_string(geometry%line_material(i)))
      end do
      do i = 1, size(geometry%bolts, 2)
         call writer%line(row_text(geometry%bolts(:, i))//' '//row_text(geometry%bolt_values(:, i)))
      end do
      call write_rows(geometry%fixed_lines)
      call write_rows(geometry%loading_points)
      call write_rows(geometry%measured_points)
      call write_rows(geometry%hole_points)
      call writer%close(error)

   contains

      !> One line for each column of an array.
      subroutine write_rows(values)
         real(wp), intent(in) :: values(:, :)
         integer :: k
         do k = 1, size(values, 2)
            call writer%line(row_text(values(:, k)))
         end do
      end subroutine write_rows

   end subroutine write_geometry_file

   !> Write an analysis file in one dialect. Dialect peer leaves out g0 and the time-dependent values.
   subroutine write_analysis_file(path, analysis, way, error)
      character(len=*), intent(in) :: path
      type(analysis_input_type), intent(in) :: analysis
      integer, intent(in) :: way           !! dialect%peer or dialect%g0
      type(error_type), allocatable, intent(out) :: error
      type(text_writer_type) :: writer
      integer :: i
      call writer%open(path, error)
      if (allocated(error)) return
      call writer%line(exact_text(analysis%k01)//'  # k01: 0 static to 1 dynamic')
      call writer%line(to_string(analysis%n_steps)//'  # time steps')
      call writer%line(to_string(size(analysis%block_materials))//'  # block materials')
      call writer%line(to_string(size(analysis%joint_materials))//'  # joint materials')
      call writer%line(exact_text(analysis%displacement_ratio)//'  # g2: allowed displacement ratio')
      call writer%line(exact_text(analysis%dt_max)//'  # g1: largest time step')
      if (way == dialect%g0) then
         call writer%line(exact_text(analysis%stiffness)//'  # g0: contact stiffness, 0 automatic')
         if (allocated(analysis%fixed_tables)) call write_counts(analysis%fixed_tables)
         if (allocated(analysis%loading_tables)) call write_counts(analysis%loading_tables)
         if (allocated(analysis%fixed_tables)) call write_tables(analysis%fixed_tables)
         if (allocated(analysis%loading_tables)) call write_tables(analysis%loading_tables)
      end if
      do i = 1, size(analysis%block_materials)
         associate (material => analysis%block_materials(i))
            call writer%line(row_text([material%density, material%weight, material%youngs_modulus, &
                                       material%poisson_ratio])//'  # density, weight, E, nu')
            call writer%line(row_text(material%stress)//'  # initial stress s11 s22 s12')
            call writer%line(row_text(material%stress_gradient)//'  # its gradient with y')
            call writer%line(row_text(material%velocity)//'  # initial velocity vx vy vr')
         end associate
      end do
      do i = 1, size(analysis%joint_materials)
         call writer%line(row_text([analysis%joint_materials(i)%friction_angle, analysis%joint_materials(i)%cohesion, &
                                    analysis%joint_materials(i)%tension])//'  # friction angle, cohesion, tension')
      end do
      call writer%line(exact_text(analysis%sor_factor)//'  # SOR factor')
      call writer%close(error)

   contains

      !> Number of rows of each table.
      subroutine write_counts(tables)
         type(time_table_type), intent(in) :: tables(:)
         integer :: k
         do k = 1, size(tables)
            call writer%line(to_string(size(tables(k)%rows, 2)))
         end do
      end subroutine write_counts

      !> Rows of all tables.
      subroutine write_tables(tables)
         type(time_table_type), intent(in) :: tables(:)
         integer :: k, row
         do k = 1, size(tables)
            do row = 1, size(tables(k)%rows, 2)
               call writer%line(row_text(tables(k)%rows(:, row)))
            end do
         end do
      end subroutine write_tables

   end subroutine write_analysis_file

   !> Numbers in a row.
   pure function row_text(values) result(text)
      real(wp), intent(in) :: values(:)
      character(len=:), allocatable :: text
      integer :: i
      text = ''
      do i = 1, size(values)
         if (i > 1) text = text//' '
         text = text//exact_text(values(i))
      end do
   end function row_text

end module rockdda_io_legacy_writer
