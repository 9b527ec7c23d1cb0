! SPDX-License-Identifier: MIT
!> What a results file says about its run, how far it goes, and whether it is the one that belongs to a checkpoint.
module rockdda_io_results_header
   use rockdda_base_kinds, only : wp, i8
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_strings, only : to_string
   use rockdda_model_state, only : step_record_type
   use rockdda_io_hdf5_adapter, only : hdf5_file_type
   use rockdda_io_series, only : series_type
   implicit none
   private
   public :: results_header_type, results_rows_type, results_format_version, check_belongs, check_reaches

   integer, parameter :: results_format_version = 1

   !> What the file says about itself and where it came from.
   type :: results_header_type
      character(len=:), allocatable :: title
      character(len=:), allocatable :: program_version
      character(len=:), allocatable :: created           !! UTC, as 2026-01-31T12:00:00Z
      character(len=:), allocatable :: geometry, analysis, config  !! the input files as read; '' when there was none
      logical :: frames = .true.                         !! keep frames
      logical :: contacts = .true.                       !! keep the contacts of each frame
      real(wp) :: flush_interval = 2                     !! seconds between flushes
   end type results_header_type

   !> How far a results file goes.
   type :: results_rows_type
      integer :: steps = 0             !! rows of history
      integer :: frames = 0
      integer :: contacts = 0          !! rows of the contacts of all frames
   end type results_rows_type

contains

   !> Is this open file of the run with this header?
   subroutine check_belongs(file, header, series, error)
      type(hdf5_file_type), intent(in) :: file
      type(results_header_type), intent(in) :: header
      type(series_type), intent(in) :: series(:)        !! its tables
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: created, geometry, analysis, config
      integer(i8), allocatable :: shape(:)
      integer :: i
      logical :: same
      call file%get_attribute('/', 'created', created, error)
      if (.not. allocated(error)) call file%read('input/geometry', geometry, error)
      if (.not. allocated(error)) call file%read('input/analysis', analysis, error)
      if (.not. allocated(error)) call file%read('input/config', config, error)
      same = .not. allocated(error)
      if (same) same = created == header%created .and. geometry == header%geometry .and. &
                       analysis == header%analysis .and. config == header%config
      do i = 1, size(series)
         if (.not. same) exit
         call file%get_shape(series(i)%name, shape, error)
         same = .not. allocated(error)
         if (same) same = size(shape) == size(series(i)%row_shape) + 1
         if (same) same = all(shape(1:size(shape) - 1) == series(i)%row_shape)
      end do
      if (.not. same) call make_error(error, error_code%input, file%path//': these results are not those of the '// &
                                      'checkpoint; it was written by another run')
   end subroutine check_belongs

   !> Does an open file hold all rows of the checkpoint, and the same last one?
   subroutine check_reaches(file, rows, record, error)
      type(hdf5_file_type), intent(in) :: file
      type(results_rows_type), intent(in) :: rows
      type(step_record_type), intent(in) :: record
      type(error_type), allocatable, intent(out) :: error
      integer(i8), allocatable :: shape(:)
      real(wp), allocatable :: time(:), total(:)
      integer(i8) :: n
      logical :: same
      n = rows%steps
      call file%get_shape('history/fixed_force', shape, error)
      if (.not. allocated(error)) then
         if (shape(size(shape)) < n) call too_short()
      end if
      if (.not. allocated(error)) call file%get_shape('frames/contact_blocks', shape, error)
      if (.not. allocated(error)) then
         if (shape(size(shape)) < rows%contacts) call too_short()
      end if
      if (.not. allocated(error)) call file%get_shape('frames/velocity', shape, error)
      if (.not. allocated(error)) then
         if (shape(size(shape)) < rows%frames) call too_short()
      end if
      if (allocated(error) .or. n == 0) return
      call file%read('history/time', time, error, n - 1, 1_i8)
      if (.not. allocated(error)) call file%read('history/energy', total, error, n - 1, 1_i8)
      if (allocated(error)) return
      same = .not. abs(time(1) - record%time) > 0
      if (same) same = .not. any(abs(total - record%energy) > 0)
      if (.not. same) call make_error(error, error_code%input, file%path//': these results are not those of the '// &
                                      'checkpoint; they differ in step '//to_string(record%step))

   contains

      subroutine too_short()
         call make_error(error, error_code%input, file%path//': these results end before the checkpoint (step '// &
                         to_string(record%step)//'); was the file replaced by an older copy?')
      end subroutine too_short

   end subroutine check_reaches

end module rockdda_io_results_header
