! SPDX-License-Identifier: MIT
!> Summary of a results file, without reading the results.
module rockdda_io_results_info
   use rockdda_base_kinds, only : wp, i8
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_strings, only : to_string
   use rockdda_base_value_check, only : value_check_type
   use rockdda_io_guard, only : run_in_child, end_child, explain, begin_reading, end_reading, guard
   use rockdda_io_hdf5_adapter, only : hdf5_file_type
   use rockdda_io_posix, only : get_file_size
   use rockdda_io_results_header, only : results_format_version, oldest_format_version
   use rockdda_io_results_shape, only : check_results_shape
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
      call check_format(file, info%format_version, error)
      if (.not. allocated(error)) call read_attributes(file, info, error)
      if (.not. allocated(error)) call check_results_shape(file, error)
      if (.not. allocated(error)) call read_sizes(file, info, error)
      if (.not. allocated(error)) call read_ends(file, info, error)
      if (.not. allocated(error)) call read_stages(file, info, error)
   end subroutine read_all

   !> Is it a file of results, of a format that this program knows?
   subroutine check_format(file, version, error)
      type(hdf5_file_type), intent(in) :: file
      integer, intent(inout) :: version
      type(error_type), allocatable, intent(out) :: error
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
   subroutine read_attributes(file, info, error)
      type(hdf5_file_type), intent(in) :: file
      type(results_info_type), intent(inout) :: info
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: units
      integer :: complete
      call file%get_attribute('/', 'title', info%title, error)
      if (.not. allocated(error)) call file%get_attribute('/', 'program_version', info%program_version, error)
      if (.not. allocated(error)) call file%get_attribute('/', 'created', info%created, error)
      if (.not. allocated(error)) call file%get_attribute('/', 'complete', complete, error)
      if (.not. allocated(error)) call file%get_attribute('/', 'exit_reason', info%exit_reason, error)
      if (.not. allocated(error)) info%complete = complete /= 0
      if (allocated(error)) return
      if (.not. file%has_attribute('/', 'units')) return
      call file%get_attribute('/', 'units', units, error)
      if (.not. allocated(error)) info%units = units
   end subroutine read_attributes

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

   !> First and last times.
   subroutine read_ends(file, info, error)
      type(hdf5_file_type), intent(in) :: file
      type(results_info_type), intent(inout) :: info
      type(error_type), allocatable, intent(out) :: error
      integer, allocatable :: step(:)
      real(wp), allocatable :: time(:)
      if (info%n_steps > 0) then
         call file%read('history/step', step, error, info%n_steps - 1, 1_i8)
         if (.not. allocated(error)) call file%read('history/time', time, error, info%n_steps - 1, 1_i8)
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
      if (.not. allocated(error)) call file%read_texts('model/stage_names', names, error)
      if (.not. allocated(error)) call file%read('history/stage', stage, error)
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

end module rockdda_io_results_info
