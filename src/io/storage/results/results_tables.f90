! SPDX-License-Identifier: MIT
!> The header of a results file, and its datasets: its tables, which grow by a row in each step, frame or contact, and
!> the units of all.
!>
!> A table is one row here: what is written, its shape, units, and what a reader checks follow from it. The attribute
!> `units` of a dataset is the unit of its numbers, 'Pa', or where the units of the file are not known their dimension,
!> 'stress'; columns of several dimensions have ', ' between them. The Python package has the same dimensions for files
!> without them (postprocess/rockdda/units.py).
module rockdda_io_results_tables
   use rockdda_base_kinds, only : wp, i8
   use rockdda_base_error, only : error_type
   use rockdda_model_options, only : water_type
   use rockdda_model_state, only : n_energies
   use rockdda_model_units, only : unit_system_type, unit_system
   use rockdda_io_digest, only : fold
   use rockdda_io_hdf5_adapter, only : hdf5_file_type
   implicit none
   private
   public :: table_type, tables, per, n_sizes, kind_of_row, row_shape, write_units, total_of_model
   public :: results_header_type, results_rows_type, results_format_version, oldest_format_version, n_tables, n_totals

   !> Version that is written, and the oldest one that can be read: 1 has no stresses, opening and slip of contacts.
   integer, parameter :: results_format_version = 2, oldest_format_version = 1
   !> Growing tables, and checksums: one for each table, one for the model.
   integer, parameter :: n_tables = 54, n_totals = n_tables + 1

   !> Header: origin and options of the file.
   type :: results_header_type
      character(len=:), allocatable :: title
      character(len=4) :: units = 'none'                 !! system of units; not kept in checkpoints
      character(len=:), allocatable :: program_version
      character(len=:), allocatable :: created           !! UTC, as 2026-01-31T12:00:00Z
      character(len=:), allocatable :: geometry, analysis, config  !! the input files as read; '' without one
      character(len=:), allocatable :: stage_names(:)    !! for a new file; not kept in checkpoints
      integer, allocatable :: stage_resets(:)            !! 1: measured displacements count from the stage's start
      logical :: frames = .true.                         !! keep frames
      logical :: contacts = .true.                       !! keep the contacts of each frame
      logical :: single = .false.                        !! reals of frames, but places, have 32 bits
      integer :: n_frames_expected = 0                   !! of a new run; 0: not known
      real(wp) :: flush_interval = 2                     !! seconds between flushes
      integer :: n_boundaries = 0
      integer :: n_bolt_nodes = 0                        !! 0: only springs, or no bolts
      character(len=:), allocatable :: bolt_names(:)     !! where there are nodes; springs come first, with one each
      integer, allocatable :: bolt_first(:)              !! (bolts + 1) nodes before each
      real(wp), allocatable :: bolt_spacing(:)           !! (bolts) out of the plane [length]
      integer :: n_liner_nodes = 0                       !! 0: no linings
      character(len=:), allocatable :: liner_names(:)
      integer, allocatable :: liner_first(:)             !! (linings + 1) nodes before each
      real(wp), allocatable :: liner_section(:, :)       !! (5, linings) thickness, strengths, 1: closed, side
      integer, allocatable :: boundary_edges(:, :)       !! (2, n) boundary and first vertex of each edge, from 1
      character(len=10), allocatable :: boundary_kinds(:) !! (boundaries)
      type(water_type), allocatable :: water(:)          !! groups
      integer, allocatable :: water_edges(:, :)          !! (4, n) of stretches: group, vertices, joint beyond or 0
      real(wp), allocatable :: water_ends(:, :)          !! (2, n) their ends, shares of the edge
      character(len=80), allocatable :: stage_water(:)   !! groups that act in each stage; empty: all
   end type results_header_type

   !> Numbers of rows of a results file.
   type :: results_rows_type
      integer :: steps = 0             !! rows of history
      integer :: frames = 0
      integer :: contacts = 0          !! rows of the contacts of all frames
      integer(i8) :: totals(n_totals) = 0   !! checksums of the tables' rows; the last one of the model
   end type results_rows_type

   !> Sizes of the model of which a row has one entry each.
   type :: per_enum
      integer :: block = -1, vertex = -2, fixed = -3, measured = -4, boundary = -5
      integer :: bolt = -6          !! springs between two points
      integer :: bar = -7           !! all bolts of a model with nodes
      integer :: bar_energy = -8    !! four in such a model
      integer :: node = -9          !! of bolts
      integer :: bolt_force = -10   !! nodes, or springs where there are none
      integer :: liner_node = -11
   end type per_enum
   type(per_enum), parameter :: per = per_enum()
   integer, parameter :: n_sizes = 11

   !> What a row belongs to.
   type :: row_enum
      integer :: step = 1, frame = 2, contact = 3
   end type row_enum
   type(row_enum), parameter :: kind_of_row = row_enum()

   logical, parameter :: reals = .true., integers = .false.
   !> Precision of reals: of places and times, and of what never is rounded; as the user has it.
   logical, parameter :: double = .true., any = .false.
   integer, parameter :: one(3) = 0
   !> Version of the format from which on all files have a table; `some`: not all of the present one.
   integer, parameter :: always = 1, some = huge(1)

   type :: table_type
      character(len=30) :: name
      integer :: of = 1                      !! kind_of_row%...
      logical :: is_real = .true.            !! else integers
      integer :: row(3) = 0                  !! shape of a row, Fortran order: numbers, per%..., 0 behind the last
      character(len=70) :: dimensions = ''   !! ', ' between those of several columns; '': a pure number
      integer :: since = always
      logical :: is_double = .true.          !! at any precision
      logical :: only_filled = .false.       !! no table in the file when rows have no entries
   end type table_type

   type(table_type), parameter :: history(*) = [ &
      table_type('history/step', 1, integers, one), &
      table_type('history/time', 1, reals, one, 'time'), &
      table_type('history/dt', 1, reals, one, 'time'), &
      table_type('history/open_close_iterations', 1, integers, one), &
      table_type('history/attempts', 1, integers, one), &
      table_type('history/solver_iterations', 1, integers, one), &
      table_type('history/contacts', 1, integers, [3, 0, 0]), &
      table_type('history/max_displacement', 1, reals, one, 'length'), &
      table_type('history/energy', 1, reals, [n_energies, 0, 0], 'energy'), &
      table_type('history/measured_displacement', 1, reals, [2, per%measured, 0], 'length'), &
      table_type('history/measured_stress', 1, reals, [3, per%measured, 0], 'stress'), &
      table_type('history/measured_rotation', 1, reals, [per%measured, 0, 0], 'rad'), &
      table_type('history/fixed_force', 1, reals, [2, per%fixed, 0], 'force'), &
      table_type('history/boundary_force', 1, reals, [2, per%boundary, 0], 'force', some), &
      table_type('history/unbalanced', 1, reals, one, '', some), &
      table_type('history/stage', 1, integers, one, '', some), &
      table_type('history/relaxation', 1, reals, one, '', some), &
      table_type('history/time_error', 1, reals, one, '', some), &
      table_type('history/bolt_force', 1, reals, [per%bar, 0, 0], 'force', some, only_filled=.true.), &
      table_type('history/bolt_head_force', 1, reals, [per%bar, 0, 0], 'force', some, only_filled=.true.), &
      table_type('history/bolt_dowel', 1, reals, [per%bar, 0, 0], 'force', some, only_filled=.true.), &
      table_type('history/bolt_energy', 1, reals, [per%bar_energy, 0, 0], 'energy', some, only_filled=.true.)]

   !> Places and times have 64 bits with any precision: far from the origin of coordinates 32 bits would round
   !> displacements away.
   type(table_type), parameter :: frames(*) = [ &
      table_type('frames/step', 2, integers, one), &
      table_type('frames/time', 2, reals, one, 'time'), &
      table_type('frames/vertices', 2, reals, [2, per%vertex, 0], 'length'), &
      table_type('frames/centroid', 2, reals, [2, per%block, 0], 'length'), &
      table_type('frames/rotation', 2, reals, [per%block, 0, 0], 'rad', always, any), &
      table_type('frames/stress', 2, reals, [3, per%block, 0], 'stress', always, any), &
      table_type('frames/velocity', 2, reals, [6, per%block, 0], &
                 'length/time, length/time, 1/time, 1/time, 1/time, 1/time', always, any), &
      table_type('frames/bolt_ends', 2, reals, [2, 2, per%bolt], 'length', some), &
      table_type('frames/bolt_force', 2, reals, [per%bolt_force, 0, 0], 'force', some, any), &
      table_type('frames/bolt_node', 2, reals, [2, per%node, 0], 'length', some, double, .true.), &
      table_type('frames/bolt_slip', 2, reals, [per%node, 0, 0], 'length', some, any, .true.), &
      table_type('frames/bolt_state', 2, integers, [per%node, 0, 0], '', some, double, .true.), &
      table_type('frames/bolt_use', 2, reals, [per%node, 0, 0], '', some, any, .true.), &
      table_type('frames/active', 2, integers, [per%block, 0, 0], '', some), &
      table_type('frames/liner_point', 2, reals, [2, per%liner_node, 0], 'length', some, double, .true.), &
      table_type('frames/liner_force', 2, reals, [3, per%liner_node, 0], 'force/length, force, force/length', some, &
                 any, .true.), &
      table_type('frames/liner_sides', 2, reals, [4, per%liner_node, 0], &
                 'force/length, force/length, force/length, force/length', some, any, .true.), &
      table_type('frames/liner_back', 2, reals, [2, per%liner_node, 0], 'length', some, any, .true.), &
      table_type('frames/liner_section', 2, reals, [6, per%liner_node, 0], &
                 'force/length, force, force/length, force, force/length, force', some, any, .true.), &
      table_type('frames/liner_use', 2, reals, [per%liner_node, 0, 0], '', some, any, .true.), &
      table_type('frames/liner_state', 2, integers, [per%liner_node, 0, 0], '', some, double, .true.), &
      table_type('frames/contact_offset', 2, integers, one)]

   type(table_type), parameter :: contacts(*) = [ &
      table_type('frames/contact_point', 3, reals, [2, 0, 0], 'length'), &
      table_type('frames/contact_force', 3, reals, [2, 0, 0], 'force', always, any), &
      table_type('frames/contact_state', 3, integers, one), &
      table_type('frames/contact_blocks', 3, integers, [2, 0, 0]), &
      table_type('frames/contact_opening', 3, reals, one, 'length', 2, any), &
      table_type('frames/contact_slip', 3, reals, one, 'length', 2, any), &
      table_type('frames/contact_length', 3, reals, one, 'length', 2, any), &
      table_type('frames/contact_normal_stress', 3, reals, one, 'stress', 2, any), &
      table_type('frames/contact_shear_stress', 3, reals, one, 'stress', 2, any), &
      table_type('frames/contact_strength', 3, reals, one, '', some, any)]

   !> All tables, in the order of the file.
   type(table_type), parameter :: tables(n_tables) = [history, frames, contacts]

   !> A dataset that is written once. All of the model but those of linings are part of its checksum, in this order.
   type :: dataset_type
      character(len=30) :: name
      logical :: is_real = .true.            !! else integers
      character(len=30) :: dimensions = ''   !! as of tables
      logical :: only_some = .false.         !! not all files have it
   end type dataset_type

   type(dataset_type), parameter :: datasets(*) = [ &
      dataset_type('model/vertex_offset', integers), &
      dataset_type('model/edge_joint', integers), &
      dataset_type('model/block_material', integers), &
      dataset_type('model/bolt_blocks', integers), &
      dataset_type('model/vertices', reals, 'length'), &
      dataset_type('model/block_area', reals, 'length^2'), &
      dataset_type('model/block_centroid', reals, 'length'), &
      dataset_type('model/fixed_points', reals, 'length'), &
      dataset_type('model/loading_points', reals, 'length'), &
      dataset_type('model/measured_points', reals, 'length'), &
      dataset_type('model/bolt_ends', reals, 'length'), &
      dataset_type('model/bolt_properties', reals, 'force/length, force, force'), &
      dataset_type('model/parent', integers, '', .true.), &             ! where blocks were cut into cells
      dataset_type('model/boundary_edges', integers, '', .true.), &
      dataset_type('model/water_edges', integers, '', .true.), &
      dataset_type('model/water_table_group', integers, '', .true.), &
      dataset_type('model/water_level_group', integers, '', .true.), &
      dataset_type('model/water_points_group', integers, '', .true.), &
      dataset_type('model/water_ends', reals, '', .true.), &
      dataset_type('model/water_unit_weight', reals, 'force/length^2', .true.), &
      dataset_type('model/water_table', reals, 'length', .true.), &
      dataset_type('model/water_level_time', reals, 'time', .true.), &
      dataset_type('model/water_level_rise', reals, 'length', .true.), &
      dataset_type('model/water_points', reals, 'length', .true.), &
      dataset_type('model/water_pressure', reals, 'stress', .true.), &
      dataset_type('model/liner_section', reals, 'length, stress, stress, , '), &
      dataset_type('search/displacement', reals, 'length')]
   !> Datasets in the checksum of the model: the first ones.
   integer, parameter :: n_summed = size(datasets) - 2

contains

   !> Shape of a row of a table, Fortran order; of size 0 for one number.
   pure function row_shape(table, sizes) result(shape)
      type(table_type), intent(in) :: table
      integer, intent(in) :: sizes(n_sizes)       !! at -per%...
      integer, allocatable :: shape(:)
      integer :: k
      shape = pack(table%row, table%row /= 0)
      do k = 1, size(shape)
         if (shape(k) < 0) shape(k) = sizes(-shape(k))
      end do
   end function row_shape

   !> Compute the checksum of the model in a results file.
   subroutine total_of_model(file, total, error)
      type(hdf5_file_type), intent(in) :: file
      integer(i8), intent(out) :: total
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: name
      integer, allocatable :: integers(:)
      real(wp), allocatable :: reals(:)
      integer :: i
      total = 0
      do i = 1, n_summed
         name = trim(datasets(i)%name)
         if (datasets(i)%only_some) then
            if (.not. file%exists(name)) cycle
         end if
         if (datasets(i)%is_real) then
            call file%read(name, reals, error)
            if (.not. allocated(error)) total = fold(total, reals)
         else
            call file%read(name, integers, error)
            if (.not. allocated(error)) total = fold(total, integers)
         end if
         if (allocated(error)) return
         if (index(datasets(i)%name, '_points ') > 0 .and. .not. datasets(i)%only_some) &
            call add_attribute(name, 'block')
         if (allocated(error)) return
      end do
      ! older files do not have numbers
      if (file%has_attribute('model/measured_points', 'number')) call add_attribute('model/measured_points', 'number')

   contains

      !> Add an attribute.
      subroutine add_attribute(object, attribute)
         character(len=*), intent(in) :: object, attribute
         call file%get_attribute(object, attribute, integers, error)
         if (.not. allocated(error)) total = fold(total, integers)
      end subroutine add_attribute

   end subroutine total_of_model

   !> Write the units of all datasets that the file has, in a group or in all of them.
   subroutine write_units(file, name, error, group)
      type(hdf5_file_type), intent(in) :: file
      character(len=*), intent(in) :: name           !! of the system of units
      type(error_type), allocatable, intent(out) :: error
      character(len=*), intent(in), optional :: group
      integer :: i
      do i = 1, size(datasets)
         if (datasets(i)%is_real .and. .not. allocated(error)) &
            call write_unit(trim(datasets(i)%name), trim(datasets(i)%dimensions))
      end do
      do i = 1, n_tables
         if (tables(i)%is_real .and. .not. allocated(error)) &
            call write_unit(trim(tables(i)%name), trim(tables(i)%dimensions))
      end do

   contains

      !> Those of one dataset.
      subroutine write_unit(dataset, dimensions)
         character(len=*), intent(in) :: dataset, dimensions
         if (present(group)) then
            if (index(dataset, group//'/') /= 1) return
         end if
         if (file%exists(dataset)) &
            call file%set_attribute(dataset, 'units', units_text(unit_system(trim(name)), dimensions), error)
      end subroutine write_unit

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

end module rockdda_io_results_tables
