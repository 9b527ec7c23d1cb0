! SPDX-License-Identifier: MIT
!> Check that results belong to a checkpoint, are undamaged, and can be continued.
!>
!> HDF5 detects some damage only when it reads or overwrites the damaged place, and some never. Therefore a trial first
!> performs in memory all operations that the run will perform on the file, then compares all rows with checksums.
module rockdda_io_results_check
   use rockdda_base_kinds, only : wp, i8
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_strings, only : to_string
   use rockdda_model_state, only : step_record_type, energy_names, n_energies
   use rockdda_io_digest, only : digest_length
   use rockdda_io_guard, only : run_in_child, end_child, explain, guard
   use rockdda_io_hdf5_adapter, only : hdf5_file_type
   use rockdda_io_output_lock, only : output_lock_type
   use rockdda_io_posix, only : get_file_size
   use rockdda_io_results_tables, only : tables, total_of_model, results_header_type, results_rows_type, &
      results_format_version, n_tables, n_totals
   use rockdda_io_series, only : series_type
   implicit none
   private
   public :: check_results, cut_tables

   !> Limit of the processor time [s]: a constant and a share per byte, of the uncompressed tables or of the file. Usual
   !> are some tens of milliseconds and at most a tenth of that share, fifty times as much under valgrind.
   real(wp), parameter :: least_seconds = 4
   real(wp), parameter :: slowest_reading = 1.0e7_wp

contains

   !> Check the results of a checkpoint; an error (code input) when a run cannot continue them. Nothing is changed.
   subroutine check_results(path, lock, digest, header, rows, length, record, series, error)
      character(len=*), intent(in) :: path
      type(output_lock_type), intent(inout) :: lock      !! held on the file
      character(len=digest_length), intent(in) :: digest !! of the checkpoint
      type(results_header_type), intent(in) :: header
      type(results_rows_type), intent(in) :: rows        !! at the checkpoint
      integer(i8), intent(in) :: length(:)               !! (n_tables) rows of the tables at the checkpoint
      type(step_record_type), intent(in) :: record       !! of the checkpoint's step
      type(series_type), intent(in) :: series(:)         !! (n_tables) the tables
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: bytes
      integer :: outcome
      bytes = max(real(get_file_size(path), wp), sum(8*real(length, wp)*series%row_size))
      call run_in_child(least_seconds + bytes/slowest_reading, outcome, error)
      select case (outcome)
      case (guard%in_child)
         ! otherwise the lock would outlive a killed parent until the child ends
         call lock%release()
         call run_trial(error)
         call end_child(error)
      case (guard%no_process)
         call run_trial(error)
      end select
      call explain(outcome, path, 'the file', error)

   contains

      !> Perform in memory all operations of the run on the file, then verify its content.
      subroutine run_trial(error)
         type(error_type), allocatable, intent(out) :: error
         type(hdf5_file_type) :: file
         type(series_type) :: table(n_tables)
         integer :: i
         call file%open(path, .true., error, digest, again=.false.)
         if (.not. allocated(error)) call check_belongs(file, header, series, error)
         if (.not. allocated(error)) call check_reaches(file, error)
         if (.not. allocated(error)) then
            table = series
            call cut_tables(file, length, rows, table, error)
            if (.not. allocated(error)) call file%flush(error)
            do i = 1, n_tables
               if (allocated(error)) exit
               call table(i)%add_zeros()
               call table(i)%write(file, error)
            end do
            call file%set_attribute('/', 'exit_reason', 'finished', error)
            if (.not. allocated(error)) call file%flush(error)
            if (allocated(error)) call mark_as_damaged(path, error)
         end if
         call file%abandon()
         ! verify the changed file: with a damaged address or length, new rows may have overwritten old ones
         if (.not. allocated(error)) call file%open(path, .true., error, digest, again=.true.)
         if (.not. allocated(error)) call check_content(file, error)
         call file%abandon()
      end subroutine run_trial

      !> Check that an open file contains all rows of the checkpoint in all tables, and the same last row.
      subroutine check_reaches(file, error)
         type(hdf5_file_type), intent(in) :: file
         type(error_type), allocatable, intent(out) :: error
         integer(i8), allocatable :: shape(:)
         integer(i8) :: beyond(n_tables)
         real(wp), allocatable :: time(:), energy(:)
         character(len=:), allocatable :: reason
         integer(i8) :: n
         integer :: i
         logical :: same
         do i = 1, n_tables
            beyond(i) = 0
            if (series(i)%is_absent) cycle
            call file%get_shape(series(i)%name, shape, error)
            if (allocated(error)) return
            beyond(i) = shape(size(shape)) - length(i)
            if (beyond(i) < 0) then
               call make_error(error, error_code%input, file%path//': these results end before the checkpoint '// &
                               '(step '//to_string(record%step)//'); was the file replaced by an older copy?')
               return
            end if
         end do
         call file%get_attribute('/', 'exit_reason', reason, error)
         if (allocated(error)) return
         do i = 2, n_tables
            ! after a kill during a flush some tables are longer than others
            if (series(i)%is_absent .or. series(i - 1)%is_absent) cycle
            if (reason == 'running' .or. tables(i)%of /= tables(i - 1)%of) cycle
            if (beyond(i) /= beyond(i - 1)) then
               call not_as_written(file%path, 'the numbers of rows', error)
               call mark_as_damaged(file%path, error)
               return
            end if
         end do
         n = rows%steps
         if (n == 0) return
         call file%read('history/time', time, error, n - 1, 1_i8)
         call file%read('history/energy', energy, error, n - 1, 1_i8)
         if (allocated(error)) then
            call mark_as_damaged(file%path, error)
            return
         end if
         same = .not. abs(time(1) - record%time) > 0
         if (same) same = .not. any(abs(energy - record%energy) > 0)
         if (.not. same) call make_error(error, error_code%input, file%path//': these results are not those of the '// &
                                         'checkpoint; they differ in step '//to_string(record%step))

      end subroutine check_reaches

      !> Compare model and all rows up to the checkpoint with their checksums.
      subroutine check_content(file, error)
         type(hdf5_file_type), intent(in) :: file
         type(error_type), allocatable, intent(out) :: error
         integer(i8) :: total
         integer :: i
         call file%visit_all(error)
         if (.not. allocated(error)) call total_of_model(file, total, error)
         if (.not. allocated(error) .and. total /= rows%totals(n_totals)) &
            call not_as_written(file%path, 'the model', error)
         do i = 1, n_tables
            if (allocated(error)) exit
            call series(i)%total_in_file(file, length(i), total, error)
            if (.not. allocated(error) .and. total /= rows%totals(i)) &
               call not_as_written(file%path, series(i)%name, error)
         end do
         if (allocated(error)) call mark_as_damaged(file%path, error)
      end subroutine check_content

   end subroutine check_results

   !> Cut the tables of an open file back to a checkpoint.
   subroutine cut_tables(file, length, rows, series, error)
      type(hdf5_file_type), intent(in) :: file
      integer(i8), intent(in) :: length(:)
      type(results_rows_type), intent(in) :: rows
      type(series_type), intent(inout) :: series(:)
      type(error_type), allocatable, intent(out) :: error
      integer :: i
      do i = 1, n_tables
         if (.not. allocated(error)) call series(i)%cut(file, length(i), rows%totals(i), error)
      end do
      call file%set_attribute('/', 'complete', 0, error)
      call file%set_attribute('/', 'exit_reason', 'running', error)
   end subroutine cut_tables

   !> Check that this open file belongs to the run with this header.
   subroutine check_belongs(file, header, series, error)
      type(hdf5_file_type), intent(in) :: file
      type(results_header_type), intent(in) :: header
      type(series_type), intent(in) :: series(:)        !! its tables
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: created, found, wanted
      integer(i8), allocatable :: shape(:)
      integer :: i, version, complete
      logical :: same
      call file%get_attribute('/', 'created', created, error)
      same = .not. allocated(error)
      if (same) same = created == header%created
      if (.not. same) then
         call make_error(error, error_code%input, file%path//': these results are not those of the checkpoint; it '// &
                         'was written by another run')
         return
      end if
      call compare_text('/', 'format', 'rockdda')
      call file%get_attribute('/', 'format_version', version, error)
      if (.not. allocated(error) .and. version /= results_format_version) &
         call not_as_written(file%path, 'format_version', error)
      ! a continued run overwrites these two
      call file%get_attribute('/', 'complete', complete, error)
      call file%get_attribute('/', 'exit_reason', found, error)
      call compare_text('/', 'program_version', header%program_version)
      call compare_text('/', 'title', header%title)
      call compare_text('input/geometry', '', header%geometry)
      call compare_text('input/analysis', '', header%analysis)
      call compare_text('input/config', '', header%config)
      wanted = trim(energy_names(1))
      do i = 2, n_energies
         wanted = wanted//new_line('a')//trim(energy_names(i))
      end do
      call compare_text('history/energy', 'columns', wanted)
      if (.not. allocated(error) .and. allocated(header%stage_names)) then
         wanted = trim(header%stage_names(1))
         do i = 2, size(header%stage_names)
            wanted = wanted//new_line('a')//trim(header%stage_names(i))
         end do
         call file%read_texts('model/stage_names', found, error)
         if (.not. allocated(error)) then
            if (found /= wanted .or. len(found) /= len(wanted)) &
               call not_as_written(file%path, 'model/stage_names', error)
         end if
      end if
      do i = 1, size(series)
         if (allocated(error)) exit
         if (series(i)%is_absent) cycle
         call file%get_shape(series(i)%name, shape, error)
         if (allocated(error)) exit
         same = size(shape) == size(series(i)%row_shape) + 1
         if (same) same = all(shape(1:size(shape) - 1) == series(i)%row_shape)
         if (.not. same) call not_as_written(file%path, series(i)%name, error)
      end do
      if (allocated(error)) call mark_as_damaged(file%path, error)

   contains

      !> Compare an attribute or a dataset with this text.
      subroutine compare_text(object, attribute, text)
         character(len=*), intent(in) :: object, attribute, text
         if (allocated(error)) return
         if (len(attribute) > 0) then
            call file%get_attribute(object, attribute, found, error)
         else
            call file%read(object, found, error)
         end if
         if (allocated(error)) return
         ! == ignores trailing blanks
         if (found /= text .or. len(found) /= len(text)) &
            call not_as_written(file%path, trim(object//' '//attribute), error)
      end subroutine compare_text

   end subroutine check_belongs

   !> Report readable values that are wrong.
   subroutine not_as_written(path, what, error)
      character(len=*), intent(in) :: path, what
      type(error_type), allocatable, intent(out) :: error
      call make_error(error, error_code%input, path//': '//what//' differ from what the run has written')
   end subroutine not_as_written

   !> Change "FILE: what" to "FILE: these results are damaged: what".
   subroutine mark_as_damaged(path, error)
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(inout) :: error
      character(len=:), allocatable :: what
      what = error%message
      if (index(what, path//': ') == 1) what = what(len(path) + 3:)
      call make_error(error, error_code%input, path//': these results are damaged: '//what)
   end subroutine mark_as_damaged

end module rockdda_io_results_check
