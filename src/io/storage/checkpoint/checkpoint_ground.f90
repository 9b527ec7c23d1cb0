! SPDX-License-Identifier: MIT
!> Validate values of a checkpoint: time tables, boundaries, stress in the ground, water.
module rockdda_io_checkpoint_ground
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : to_string
   use rockdda_model_options, only : region_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_base_value_check, only : value_check_type
   implicit none
   private
   public :: check_ground, check_table

contains

   !> Check boundaries, the stress in the ground and water. Whether they fit the model is checked when the run begins.
   subroutine check_ground(check, p)
      type(value_check_type), intent(inout) :: check
      type(parameters_type), intent(in) :: p
      integer :: i
      do i = 1, size(p%boundaries)
         associate (b => p%boundaries(i), name => 'boundary_'//to_string(i))
            call check%is_there(allocated(b%along), name//'_along')
            call check%is_there(allocated(b%kind), name//'_kind')
            if (.not. check%passed()) return
            call check%has_shape(size(b%along, 1) == 2, name//'_along')
            call check%holds(all(abs(b%along) <= huge(1.0_wp)), name//'_along')
            call check%holds(any(b%kind == [character(len=10) :: 'fixed', 'roller', 'moving', 'traction', 'viscous', &
                                            'free_field']), name//'_kind')
            call check_rows(check, name//'_velocity', 2, b%velocity)
            call check_rows(check, name//'_stress', 3, b%stress)
            call check_rows(check, name//'_traction', 2, b%traction)
            call check%is_finite([b%pressure], name//'_pressure')
            call check_table(check, name//'_table', 2, b%table)
         end associate
      end do
      if (size(p%in_situ) > 0) call check%is_there(allocated(p%regions), 'regions')
      if (.not. check%passed()) return
      if (size(p%in_situ) > 0) call check_regions(check, p%regions)
      do i = 1, size(p%in_situ)
         associate (g => p%in_situ(i), name => 'in_situ_'//to_string(i))
            call check_rows(check, name//'_profile', 2, g%profile)
            call check_rows(check, name//'_stress', 3, g%stress)
            call check_rows(check, name//'_gradient', 3, g%gradient)
            call check%is_finite([g%surface], name//'_surface')
            call check%is_finite([g%k0], name//'_k0')
            call check%is_finite([g%unit_weight], name//'_unit_weight')
            call check%is_finite([g%surcharge], name//'_surcharge')
         end associate
      end do
      do i = 1, size(p%water)
         associate (w => p%water(i), name => 'water_'//to_string(i))
            call check_rows(check, name//'_table', 2, w%table)
            call check_rows(check, name//'_pressure_file', 3, w%pressure)
            call check_table(check, name//'_level', 2, w%level)
            call check%is_finite([w%unit_weight], name//'_unit_weight')
         end associate
      end do
      do i = 1, size(p%quakes)
         associate (q => p%quakes(i), name => 'quake_'//to_string(i))
            call check%is_there(allocated(q%rows), name//'_record')
            call check%is_there(allocated(q%direction) .and. allocated(q%apply), name//'_apply')
            if (.not. check%passed()) return
            call check_table(check, name//'_record', 2, q%rows)
            call check%holds(size(q%rows, 2) > 0, name//'_record')
            call check%is_finite([q%scale], name//'_scale')
            call check%holds(q%direction == 'x' .or. q%direction == 'y', name//'_direction')
            call check%holds(any(q%apply == &
                             [character(len=17) :: 'base_acceleration', 'base_motion', 'viscous_base']), &
                             name//'_apply')
         end associate
      end do
   end subroutine check_ground

   !> Check regions, which stress in the ground may name.
   subroutine check_regions(check, regions)
      type(value_check_type), intent(inout) :: check
      type(region_type), intent(in) :: regions(:)
      integer :: i
      do i = 1, size(regions)
         associate (name => 'region_'//to_string(i))
            call check%is_there(allocated(regions(i)%name), name//'_name')
            call check_rows(check, name//'_box', 4, regions(i)%boxes)
            call check_rows(check, name//'_circle', 3, regions(i)%circles)
            call check_rows(check, name//'_polygon', 2, regions(i)%polygon)
         end associate
      end do
   end subroutine check_regions

   !> Check rows of m finite numbers, where they are given.
   subroutine check_rows(check, name, m, rows)
      type(value_check_type), intent(inout) :: check
      character(len=*), intent(in) :: name
      integer, intent(in) :: m
      real(wp), allocatable, intent(in) :: rows(:, :)
      if (.not. allocated(rows)) return
      call check%has_shape(size(rows, 1) == m, name)
      call check%is_finite(rows, name)
   end subroutine check_rows

   !> Check a table of m columns: finite, times in order. A missing table is empty.
   subroutine check_table(check, name, m, rows)
      type(value_check_type), intent(inout) :: check
      character(len=*), intent(in) :: name
      integer, intent(in) :: m
      real(wp), allocatable, intent(in) :: rows(:, :)
      integer :: n
      if (.not. allocated(rows)) return
      call check%has_shape(size(rows, 1) == m, name)
      call check%is_finite(rows, name)
      if (.not. check%passed()) return
      n = size(rows, 2)
      call check%holds(all(rows(1, 2:n) >= rows(1, 1:n - 1)), name)
   end subroutine check_table

end module rockdda_io_checkpoint_ground
