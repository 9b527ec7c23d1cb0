! SPDX-License-Identifier: MIT
!> Summary of a results file, without reading the results.
!>
!> Do the arrays of a results file fit each other? Names, types and shapes of all tables, and the numbers by which
!> others are found: offsets of vertices and contacts, blocks of points. The rows of history and frames are not read.
!>
!> The Python package has the same rules and messages (postprocess/rockdda/storage/check.py).
module rockdda_io_results_info
   use rockdda_base_kinds, only : wp, i8
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_strings, only : to_string
   use rockdda_base_value_check, only : value_check_type
   use rockdda_io_guard, only : run_in_child, end_child, explain, begin_reading, end_reading, guard
   use rockdda_io_hdf5_adapter, only : hdf5_file_type
   use rockdda_io_posix, only : get_file_size
   use rockdda_io_results_tables, only : tables, per, n_sizes, row_shape, results_format_version, &
      oldest_format_version, n_tables
   implicit none
   private
   public :: results_info_type, read_results_info, stage_motion_type

   !> Displacements of the measured points in a stage.
   type :: stage_motion_type
      character(len=:), allocatable :: name
      real(wp), allocatable :: change(:, :)        !! (2, points) in the stage [length]
      real(wp), allocatable :: total(:, :)         !! (2, points) from the start of the run to its end [length]
   end type stage_motion_type

   type :: results_info_type
      character(len=:), allocatable :: title, program_version, created, exit_reason
      character(len=4) :: units = 'none'           !! system of units; older files do not have it
      integer :: format_version = 0
      logical :: complete = .false.
      integer(i8) :: n_blocks = 0, n_vertices = 0, n_steps = 0, n_frames = 0, n_contact_rows = 0
      integer(i8) :: n_fixed = 0, n_loading = 0, n_measured = 0
      integer, allocatable :: measured_number(:)   !! of the input; unallocated: 1 ... n
      integer :: n_cells = 0, n_parents = 0  !! cells, and the blocks before some were cut into cells
      integer :: last_step = 0               !! of the history
      real(wp) :: last_time = 0
      type(stage_motion_type), allocatable :: stages(:)   !! none where the file does not hold them
      real(wp) :: first_frame = 0, last_frame = 0   !! times
   end type results_info_type

   !> Limit of the processor time for a summary: a constant [s] and a share per byte. Usual are milliseconds.
   real(wp), parameter :: seconds_to_read = 0.5_wp, slowest_reading = 1.0e8_wp

   !> Types of the values of a table.
   logical, parameter :: reals = .true., integers = .false.

contains

   !> Read the summary. An error (code input) when the file is no results file of this format, or is damaged.
   subroutine read_results_info(path, info, error)
      character(len=*), intent(in) :: path
      type(results_info_type), intent(out) :: info
      type(error_type), allocatable, intent(out) :: error
      type(hdf5_file_type) :: file
      type(error_type), allocatable :: ignored
      integer :: outcome
      call run_in_child(seconds_to_read + real(max(0_i8, get_file_size(path)), wp)/slowest_reading, outcome, error)
      if (outcome == guard%in_child) then
         call file%open(path, .false., error)
         if (.not. allocated(error)) call read_all(file, info, error)
         call end_child(error)
      end if
      call explain(outcome, path, 'the file', error)
      if (.not. allocated(error)) then
         call begin_reading(path)
         call file%open(path, .false., error)
         if (.not. allocated(error)) then
            call read_all(file, info, error)
            call file%close(ignored)
         end if
         call end_reading()
      end if
      if (allocated(error)) then
         if (index(error%message, ': error: ') == 0) error%message = path//': error: '//error%message(len(path) + 3:)
      end if
   end subroutine read_results_info

   !> Read attributes and sizes.
   subroutine read_all(file, info, error)
      type(hdf5_file_type), intent(in) :: file
      type(results_info_type), intent(inout) :: info
      type(error_type), allocatable, intent(out) :: error
      call check_format(info%format_version)
      if (.not. allocated(error)) call read_attributes()
      if (.not. allocated(error)) call check_results_shape(file, error)
      if (.not. allocated(error)) call read_sizes(file, info, error)
      if (.not. allocated(error)) call read_ends()
      if (.not. allocated(error)) call read_stages(file, info, error)

   contains

      !> Is it a file of results, of a format that this program reads?
      subroutine check_format(version)
         integer, intent(inout) :: version
         character(len=:), allocatable :: format
         call file%get_attribute('/', 'format', format, error)
         if (allocated(error)) then
            call make_error(error, error_code%input, file%path//': error: this HDF5 file holds no results of RockDDA')
            return
         end if
         if (format /= 'rockdda') then
            call make_error(error, error_code%input, file%path//": error: this HDF5 file is of the format '"//format// &
                            "', not results of RockDDA")
            return
         end if
         call file%get_attribute('/', 'format_version', version, error)
         if (allocated(error)) return
         if (version < oldest_format_version .or. version > results_format_version) &
            call make_error(error, error_code%input, file%path//': error: format version '//to_string(version)// &
                            ' is not known to this program, only '//to_string(oldest_format_version)//' to '// &
                            to_string(results_format_version))
      end subroutine check_format

      !> Attributes of the file.
      subroutine read_attributes()
         character(len=:), allocatable :: units
         integer :: complete
         call file%get_attribute('/', 'title', info%title, error)
         call file%get_attribute('/', 'program_version', info%program_version, error)
         call file%get_attribute('/', 'created', info%created, error)
         call file%get_attribute('/', 'complete', complete, error)
         call file%get_attribute('/', 'exit_reason', info%exit_reason, error)
         if (.not. allocated(error)) info%complete = complete /= 0
         if (allocated(error)) return
         if (.not. file%has_attribute('/', 'units')) return
         call file%get_attribute('/', 'units', units, error)
         if (.not. allocated(error)) info%units = units
      end subroutine read_attributes

      !> First and last times.
      subroutine read_ends()
         integer, allocatable :: step(:)
         real(wp), allocatable :: time(:)
         if (info%n_steps > 0) then
            call file%read('history/step', step, error, info%n_steps - 1, 1_i8)
            call file%read('history/time', time, error, info%n_steps - 1, 1_i8)
            if (allocated(error)) return
            call check_row(file, time, 'history/time', error)
            if (allocated(error)) return
            info%last_step = step(1)
            info%last_time = time(1)
         end if
         if (info%n_frames > 0) then
            call file%read('frames/time', time, error)
            if (.not. allocated(error)) call check_row(file, time, 'frames/time', error)
            if (allocated(error)) return
            info%first_frame = time(1)
            info%last_frame = time(size(time))
         end if
      end subroutine read_ends

   end subroutine read_all

   !> How much the file holds.
   subroutine read_sizes(file, info, error)
      type(hdf5_file_type), intent(in) :: file
      type(results_info_type), intent(inout) :: info
      type(error_type), allocatable, intent(out) :: error
      integer(i8), allocatable :: shape(:)
      call rows_of('model/block_material', info%n_blocks)
      call rows_of('model/edge_joint', info%n_vertices)
      call rows_of('model/fixed_points', info%n_fixed)
      call rows_of('model/loading_points', info%n_loading)
      call rows_of('model/measured_points', info%n_measured)
      call rows_of('history/step', info%n_steps)
      call rows_of('frames/step', info%n_frames)
      call rows_of('frames/contact_state', info%n_contact_rows)
      if (allocated(error)) return
      if (file%has_attribute('model/measured_points', 'number')) &
         call file%get_attribute('model/measured_points', 'number', info%measured_number, error)
      if (allocated(error)) return
      if (file%exists('model/parent')) call read_parents()

   contains

      !> Get the length of the last dimension.
      subroutine rows_of(name, n)
         character(len=*), intent(in) :: name
         integer(i8), intent(out) :: n
         n = 0
         if (allocated(error)) return
         call file%get_shape(name, shape, error)
         if (.not. allocated(error)) n = shape(size(shape))
      end subroutine rows_of

      !> Count the cells, and the blocks before they were cut.
      subroutine read_parents()
         integer, allocatable :: parent(:), n(:)
         integer :: i
         call file%read('model/parent', parent, error)
         if (allocated(error)) return
         allocate (n(0:maxval(parent)), source=0)
         do i = 1, size(parent)
            n(parent(i)) = n(parent(i)) + 1
         end do
         info%n_parents = count(n > 0)
         info%n_cells = sum(n, mask=n > 1)
      end subroutine read_parents

   end subroutine read_sizes

   !> Check the numbers of a table.
   subroutine check_row(file, values, path, error)
      type(hdf5_file_type), intent(in) :: file
      real(wp), intent(in) :: values(:)
      character(len=*), intent(in) :: path            !! of the table
      type(error_type), allocatable, intent(out) :: error
      type(value_check_type) :: check
      check%group = path(:index(path, '/') - 1)
      call check%has_squares(values, path(index(path, '/') + 1:))
      if (.not. check%passed()) call make_error(error, error_code%input, file%path//': error: the file is damaged: '// &
                                                 check%problem())
   end subroutine check_row

   !> Displacements of the measured points, stage by stage, from the last row of each.
   subroutine read_stages(file, info, error)
      type(hdf5_file_type), intent(in) :: file
      type(results_info_type), intent(inout) :: info
      type(error_type), allocatable, intent(out) :: error
      type(stage_motion_type) :: motion
      character(len=:), allocatable :: names
      integer, allocatable :: stage(:), resets(:)
      real(wp), allocatable :: values(:), before(:), total(:)
      integer :: i, n, begun
      allocate (info%stages(0))
      if (info%n_steps == 0 .or. info%n_measured == 0) return
      if (.not. file%exists('history/stage')) return
      if (.not. file%exists('model/stage_names')) return
      if (.not. file%has_attribute('model/stage_names', 'reset_displacement')) return
      call file%get_attribute('model/stage_names', 'reset_displacement', resets, error)
      call file%read_texts('model/stage_names', names, error)
      call file%read('history/stage', stage, error)
      if (allocated(error)) return
      n = size(stage)
      allocate (before(2*info%n_measured), total(2*info%n_measured), source=0.0_wp)
      begun = -1
      do i = 1, n
         if (i < n) then
            if (stage(i + 1) == stage(i)) cycle
         end if
         if (stage(i) <= begun .or. stage(i) >= size(resets)) exit
         call file%read('history/measured_displacement', values, error, int(i - 1, i8), 1_i8)
         if (.not. allocated(error)) call check_row(file, values, 'history/measured_displacement', error)
         if (allocated(error)) return
         if (any(resets(begun + 2:stage(i) + 1) /= 0)) before = 0
         total = total + (values - before)
         motion%name = line_of(names, stage(i) + 1)
         motion%change = reshape(values - before, [2, int(info%n_measured)])
         motion%total = reshape(total, [2, int(info%n_measured)])
         info%stages = [info%stages, motion]
         before = values
         begun = stage(i)
      end do

   contains

      !> Line k of a text.
      pure function line_of(text, k) result(line)
         character(len=*), intent(in) :: text
         integer, intent(in) :: k
         character(len=:), allocatable :: line
         integer :: i, from
         from = 1
         do i = 2, k
            from = from + index(text(from:), new_line('a'))
         end do
         line = text(from:)
         if (index(line, new_line('a')) > 0) line = line(:index(line, new_line('a')) - 1)
      end function line_of

   end subroutine read_stages

   !> Check the shapes of all datasets; the error (code input) is "FILE: error: the file is damaged: …".
   subroutine check_results_shape(file, error)
      type(hdf5_file_type), intent(in) :: file
      type(error_type), allocatable, intent(out) :: error
      type(value_check_type) :: check
      integer :: nb, nv, n_linings, points(3), sizes(n_sizes)
      call check_model(file, check, nb, nv, points)
      sizes = 0
      sizes(-per%block) = nb
      sizes(-per%vertex) = nv
      sizes(-per%fixed) = points(1)
      sizes(-per%measured) = points(3)
      call check_bolts(check, sizes(-per%bolt))
      call check_boundaries(check, sizes(-per%boundary))
      call count_nodes(check, 'bolt', sizes(-per%bar), sizes(-per%node))
      if (sizes(-per%bar) > 0) sizes(-per%bar_energy) = 4
      call count_nodes(check, 'liner', n_linings, sizes(-per%liner_node))
      sizes(-per%bolt_force) = max(sizes(-per%bolt), sizes(-per%node))
      call check_tables(check)
      if (.not. check%passed()) call make_error(error, error_code%input, file%path//': error: the file is damaged: '// &
                                                check%problem())

   contains

      !> Check the tables with a row for each step, frame or contact. After a kill some may be longer than others.
      subroutine check_tables(check)
         type(value_check_type), intent(inout) :: check
         character(len=:), allocatable :: name
         integer, allocatable :: offsets(:)
         type(error_type), allocatable :: error
         integer :: i, m, n, slash, version
         call file%get_attribute('/', 'format_version', version, error)
         m = 0
         do i = 1, n_tables
            name = trim(tables(i)%name)
            if (tables(i)%since > version) then
               if (.not. file%exists(name)) cycle
            end if
            slash = index(name, '/')
            check%group = name(:slash - 1)
            n = rows_of(file, check, name(slash + 1:), tables(i)%is_real, row_shape(tables(i), sizes))
            if (name == 'frames/contact_offset') m = n
         end do
         check%group = 'frames'
         call check%has_shape(m >= 1, 'contact_offset')
         if (.not. check%passed()) return
         call file%read('frames/contact_offset', offsets, error)
         call check%is_read(error, file%path, 'contact_offset')
         ! after a kill there may be fewer contacts than the last offsets say
         if (check%passed()) call check%are_offsets(offsets, offsets(m), 0, 'contact_offset')
      end subroutine check_tables

      !> Count the boundaries and check their edges. Older files have no table of forces, models without boundaries no
      !> edges.
      subroutine check_boundaries(check, n_boundaries)
         type(value_check_type), intent(inout) :: check
         integer, intent(out) :: n_boundaries
         integer(i8), allocatable :: shape(:)
         integer, allocatable :: edges(:)
         type(error_type), allocatable :: error
         integer :: n
         n_boundaries = 0
         if (.not. check%passed()) return
         if (file%exists('history/boundary_force')) then
            check%group = 'history'
            call file%get_shape('history/boundary_force', shape, error)
            call check%is_read(error, file%path, 'boundary_force')
            if (.not. check%passed()) return
            call check%has_shape(size(shape) == 3, 'boundary_force')
            if (.not. check%passed()) return
            n_boundaries = int(min(shape(2), int(huge(1), i8)))
         end if
         if (.not. file%exists('model/boundary_edges')) return
         check%group = 'model'
         n = rows_of(file, check, 'boundary_edges', integers, [2])
         if (.not. check%passed()) return
         call file%read('model/boundary_edges', edges, error)
         call check%is_read(error, file%path, 'boundary_edges')
         if (.not. check%passed()) return
         call check%in_range(edges(1::2), 0, n_boundaries - 1, 'boundary_edges')
         call check%in_range(edges(2::2), 0, nv - 1, 'boundary_edges')
      end subroutine check_boundaries

      !> Check bolts of the model; older files do not have them.
      subroutine check_bolts(check, n_bolts)
         type(value_check_type), intent(inout) :: check
         integer, intent(out) :: n_bolts
         integer, allocatable :: blocks(:)
         type(error_type), allocatable :: error
         n_bolts = 0
         if (.not. check%passed()) return
         if (.not. file%exists('model/bolt_blocks')) return
         check%group = 'model'
         n_bolts = rows_of(file, check, 'bolt_blocks', integers, [2])
         call check%has_shape(rows_of(file, check, 'bolt_ends', reals, [2, 2]) == n_bolts, 'bolt_ends')
         call check%has_shape(rows_of(file, check, 'bolt_properties', reals, [3]) == n_bolts, 'bolt_properties')
         if (.not. check%passed()) return
         call file%read('model/bolt_blocks', blocks, error)
         call check%is_read(error, file%path, 'bolt_blocks')
         ! -1 is the fixed outside
         if (check%passed()) call check%in_range(blocks, -1, nb - 1, 'bolt_blocks')
      end subroutine check_bolts

      !> Count bolts or linings, and their nodes, where there are any.
      subroutine count_nodes(check, what, n_of, n)
         type(value_check_type), intent(inout) :: check
         character(len=*), intent(in) :: what             !! 'bolt', 'liner'
         integer, intent(out) :: n_of                     !! bolts or linings
         integer, intent(out) :: n                        !! nodes
         integer, allocatable :: first(:)
         type(error_type), allocatable :: error
         n_of = 0
         n = 0
         if (.not. check%passed()) return
         if (.not. file%exists('frames/'//what//'_state')) return
         check%group = 'model'
         call file%read('model/'//what//'_first', first, error)
         call check%is_read(error, file%path, what//'_first')
         if (.not. check%passed()) return
         call check%holds(size(first) > 0, what//'_first')
         if (.not. check%passed()) return
         n_of = size(first) - 1
         n = max(0, first(size(first)))
      end subroutine count_nodes

   end subroutine check_results_shape

   !> Check the model, and its numbers of blocks, vertices, and fixed, loading and measured points.
   subroutine check_model(file, check, nb, nv, points)
      type(hdf5_file_type), intent(in) :: file
      type(value_check_type), intent(inout) :: check
      integer, intent(out) :: nb, nv, points(3)
      character(len=*), parameter :: kinds(3) = [character(len=15) :: 'fixed_points', 'loading_points', &
                                                 'measured_points']
      integer, allocatable :: numbers(:)
      type(error_type), allocatable :: error
      integer :: i
      check%group = 'model'
      nb = rows_of(file, check, 'block_area', reals, [integer ::])
      nv = rows_of(file, check, 'vertices', reals, [2])
      call check%has_shape(nb >= 1, 'block_area')
      call check%has_shape(rows_of(file, check, 'vertex_offset', integers, [integer ::]) - 1 == nb, 'vertex_offset')
      call check%has_shape(rows_of(file, check, 'edge_joint', integers, [integer ::]) == nv, 'edge_joint')
      call check%has_shape(rows_of(file, check, 'block_material', integers, [integer ::]) == nb, 'block_material')
      call check%has_shape(rows_of(file, check, 'block_centroid', reals, [2]) == nb, 'block_centroid')
      do i = 1, 3
         points(i) = rows_of(file, check, trim(kinds(i)), reals, [2])
      end do
      call take_integers('vertex_offset')
      if (check%passed()) call check%are_offsets(numbers, nv, 3, 'vertex_offset')
      call take_integers('edge_joint')
      if (check%passed()) call check%in_range(numbers, 0, huge(1), 'edge_joint')
      call take_integers('block_material')
      if (check%passed()) call check%in_range(numbers, 1, huge(1), 'block_material')
      if (file%exists('model/parent')) then     ! only where blocks were cut into cells
         call check%has_shape(rows_of(file, check, 'parent', integers, [integer ::]) == nb, 'parent')
         call take_integers('parent')
         if (check%passed()) call check%in_range(numbers, 0, nb - 1, 'parent')
      end if
      call take_reals('vertices')
      call take_reals('block_area')
      call take_reals('block_centroid')
      do i = 1, 3
         call take_reals(trim(kinds(i)))
         if (.not. check%passed()) return
         call file%get_attribute('model/'//trim(kinds(i)), 'block', numbers, error)
         call check%has_shape(.not. allocated(error), trim(kinds(i))//'@block')
         if (.not. check%passed()) return
         call check%has_shape(size(numbers) == points(i), trim(kinds(i))//'@block')
         call check%in_range(numbers, 0, nb - 1, trim(kinds(i))//'@block')
      end do
      if (.not. check%passed()) return
      ! older files do not have numbers
      if (.not. file%has_attribute('model/measured_points', 'number')) return
      call file%get_attribute('model/measured_points', 'number', numbers, error)
      call check%has_shape(.not. allocated(error), 'measured_points@number')
      if (.not. check%passed()) return
      call check%has_shape(size(numbers) == points(3), 'measured_points@number')
      call check%are_increasing(numbers, 1, 'measured_points@number')

   contains

      !> Read a list of integers.
      subroutine take_integers(name)
         character(len=*), intent(in) :: name
         if (.not. check%passed()) return
         call file%read('model/'//name, numbers, error)
         call check%is_read(error, file%path, name)
      end subroutine take_integers

      !> Read reals, which must be finite, as their squares.
      subroutine take_reals(name)
         character(len=*), intent(in) :: name
         real(wp), allocatable :: values(:)
         if (.not. check%passed()) return
         call file%read('model/'//name, values, error)
         call check%is_read(error, file%path, name)
         if (check%passed()) call check%has_squares(values, name)
      end subroutine take_reals

   end subroutine check_model

   !> Number of rows of a table of the present group, 0 after a failure: it must exist and have rows of this shape.
   integer function rows_of(file, check, name, of_reals, row_shape) result(n)
      type(hdf5_file_type), intent(in) :: file
      type(value_check_type), intent(inout) :: check
      character(len=*), intent(in) :: name
      logical, intent(in) :: of_reals             !! else of integers
      integer, intent(in) :: row_shape(:)         !! Fortran order
      integer(i8), allocatable :: shape(:)
      type(error_type), allocatable :: error
      logical :: fits
      n = 0
      if (.not. check%passed()) return
      call check%is_there(file%exists(check%group//'/'//name), name)
      if (.not. check%passed()) return
      call file%get_shape(check%group//'/'//name, shape, error)
      call check%is_read(error, file%path, name)
      if (.not. check%passed()) return
      fits = size(shape) == size(row_shape) + 1
      if (fits) fits = all(shape(1:size(row_shape)) == row_shape) .and. shape(size(shape)) <= huge(1)
      call check%has_shape(fits, name)
      call check%has_type(file%has_type(check%group//'/'//name, of_reals), name, of_reals)
      if (fits) n = int(shape(size(shape)))
   end function rows_of

end module rockdda_io_results_info
