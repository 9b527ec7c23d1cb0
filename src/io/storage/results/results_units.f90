! SPDX-License-Identifier: MIT
!> The attribute `units` of the datasets of a results file: the unit of their numbers, 'Pa', or where the units of the
!> file are not known their dimension, 'stress'. Columns of several dimensions have ', ' between them.
!>
!> The Python package reads them, and for files without them has the same table (postprocess/rockdda/units.py).
module rockdda_io_results_units
   use rockdda_base_error, only : error_type
   use rockdda_model_units, only : unit_system_type, unit_system
   use rockdda_io_hdf5_adapter, only : hdf5_file_type
   implicit none
   private
   public :: write_units

   type :: entry_type
      character(len=30) :: dataset
      character(len=70) :: dimensions = ''        !! ', ' between those of several columns; '': a pure number
   end type entry_type

   type(entry_type), parameter :: entries(*) = [ &
      entry_type('model/vertices', 'length'), &
      entry_type('model/block_area', 'length^2'), &
      entry_type('model/block_centroid', 'length'), &
      entry_type('model/fixed_points', 'length'), &
      entry_type('model/loading_points', 'length'), &
      entry_type('model/measured_points', 'length'), &
      entry_type('model/bolt_ends', 'length'), &
      entry_type('model/bolt_properties', 'force/length, force, force'), &
      entry_type('model/water_ends'), &
      entry_type('model/water_unit_weight', 'force/length^2'), &
      entry_type('model/water_table', 'length'), &
      entry_type('model/water_level_time', 'time'), &
      entry_type('model/water_level_rise', 'length'), &
      entry_type('model/water_points', 'length'), &
      entry_type('model/water_pressure', 'stress'), &
      entry_type('search/displacement', 'length'), &
      entry_type('history/time', 'time'), &
      entry_type('history/dt', 'time'), &
      entry_type('history/max_displacement', 'length'), &
      entry_type('history/energy', 'energy'), &
      entry_type('history/measured_displacement', 'length'), &
      entry_type('history/measured_stress', 'stress'), &
      entry_type('history/measured_rotation', 'rad'), &
      entry_type('history/fixed_force', 'force'), &
      entry_type('history/boundary_force', 'force'), &
      entry_type('history/bolt_force', 'force'), &
      entry_type('history/bolt_head_force', 'force'), &
      entry_type('history/bolt_dowel', 'force'), &
      entry_type('history/bolt_energy', 'energy'), &
      entry_type('history/unbalanced'), &
      entry_type('history/relaxation'), &
      entry_type('history/time_error'), &
      entry_type('frames/time', 'time'), &
      entry_type('frames/vertices', 'length'), &
      entry_type('frames/centroid', 'length'), &
      entry_type('frames/rotation', 'rad'), &
      entry_type('frames/stress', 'stress'), &
      entry_type('frames/velocity', 'length/time, length/time, 1/time, 1/time, 1/time, 1/time'), &
      entry_type('frames/bolt_ends', 'length'), &
      entry_type('frames/bolt_force', 'force'), &
      entry_type('frames/bolt_node', 'length'), &
      entry_type('frames/bolt_slip', 'length'), &
      entry_type('frames/bolt_use'), &
      entry_type('model/liner_section', 'length, stress, stress, , '), &
      entry_type('frames/liner_point', 'length'), &
      entry_type('frames/liner_force', 'force/length, force, force/length'), &
      entry_type('frames/liner_back', 'length'), &
      entry_type('frames/liner_section', 'force/length, force, force/length, force, force/length, force'), &
      entry_type('frames/liner_use'), &
      entry_type('frames/contact_point', 'length'), &
      entry_type('frames/contact_force', 'force'), &
      entry_type('frames/contact_opening', 'length'), &
      entry_type('frames/contact_slip', 'length'), &
      entry_type('frames/contact_length', 'length'), &
      entry_type('frames/contact_normal_stress', 'stress'), &
      entry_type('frames/contact_shear_stress', 'stress'), &
      entry_type('frames/contact_strength')]

contains

   !> Write the units of all datasets that the file has, in a group or in all of them.
   subroutine write_units(file, name, error, group)
      type(hdf5_file_type), intent(in) :: file
      character(len=*), intent(in) :: name           !! of the system of units
      type(error_type), allocatable, intent(out) :: error
      character(len=*), intent(in), optional :: group
      type(unit_system_type) :: system
      integer :: i
      system = unit_system(trim(name))
      do i = 1, size(entries)
         if (present(group)) then
            if (index(entries(i)%dataset, group//'/') /= 1) cycle
         end if
         if (.not. file%exists(trim(entries(i)%dataset))) cycle
         call file%set_attribute(trim(entries(i)%dataset), 'units', units_text(system, trim(entries(i)%dimensions)), &
                                 error)
         if (allocated(error)) return
      end do
   end subroutine write_units

   !> Units of one or several columns.
   pure function units_text(system, dimensions) result(text)
      type(unit_system_type), intent(in) :: system
      character(len=*), intent(in) :: dimensions
      character(len=:), allocatable :: text
      integer :: at, comma
      text = ''
      at = 1
      do
         comma = index(dimensions(at:)//',', ',')
         if (at > 1) text = text//', '
         text = text//system%unit_of(dimensions(at:at + comma - 2))
         at = at + comma + 1
         if (at > len(dimensions)) exit
      end do
   end function units_text

end module rockdda_io_results_units
