! SPDX-License-Identifier: MIT
!> Writer of the results file, format version 2 (docs/file-formats.md, "results").
!>
!> Rows of history and frames wait in memory; each flush writes all of them or none. After a kill at any moment the file
!> contains all rows up to the last flush, and `reopen` returns it to a checkpoint. Block numbers start at 0, material
!> numbers at 1. During a run, and after a kill, `complete` is 0 and `exit_reason` is "running".
module rockdda_io_results
   use, intrinsic :: iso_fortran_env, only : int64
   use rockdda_base_kinds, only : wp, i8
   use rockdda_base_strings, only : to_string
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_contact_view, only : contact_view_type
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_state, only : block_state_type, bolt_nodes_type, liner_nodes_type, step_record_type, &
      n_energies, energy_names
   use rockdda_io_hdf5_adapter, only : hdf5_file_type
   use rockdda_io_hdf5_driver, only : undo_path, check_undo, roll_back, digest_length
   use rockdda_io_posix, only : get_path_kind, path_kind, remove_file
   use rockdda_io_output_lock, only : output_lock_type, part_path
   use rockdda_io_results_check, only : check_results, cut_tables, total_of_model
   use rockdda_io_results_header, only : results_header_type, results_rows_type, results_format_version, n_tables, &
      n_totals
   use rockdda_io_results_model, only : write_run
   use rockdda_io_results_units, only : write_units
   use rockdda_io_series, only : series_type
   implicit none
   private
   public :: results_type, results_header_type, results_rows_type, results_format_version

   !> Rows in memory beyond this many bytes are to be flushed.
   integer(i8), parameter :: largest_buffer = 1048576_i8

   !> Contacts of a block that are expected.
   integer, parameter :: usual_contacts = 6
   !> Frames beyond which chunks do not grow: a run of few blocks and many steps that ends early, for instance because
   !> the disk is full, shall not have reserved much.
   integer, parameter :: most_expected = 256

   !> Places in the list of tables.
   integer, parameter :: s_step = 1, s_time = 2, s_dt = 3, s_iterations = 4, s_attempts = 5, s_solver = 6, &
                         s_contacts = 7, s_displacement = 8, s_energy = 9, s_measured_displacement = 10, &
                         s_measured_stress = 11, s_measured_rotation = 12, s_fixed_force = 13, &
                         s_boundary_force = 14, s_unbalanced = 15, s_stage = 16, s_relaxation = 17, &
                         s_time_error = 18, s_bolt_largest = 19, s_bolt_head = 20, s_bolt_dowel = 21, &
                         s_bolt_energy = 22, s_frame_step = 23, s_frame_time = 24, s_vertices = 25, s_centroid = 26, &
                         s_rotation = 27, s_stress = 28, s_velocity = 29, s_bolt_ends = 30, s_bolt_force = 31, &
                         s_bolt_node = 32, s_bolt_slip = 33, s_bolt_state = 34, s_bolt_use = 35, s_active = 36, &
                         s_liner_point = 37, s_liner_force = 38, s_liner_back = 39, s_liner_section = 40, &
                         s_liner_use = 41, s_liner_state = 42, s_offset = 43, s_point = 44, s_force = 45, &
                         s_state = 46, s_blocks = 47, s_opening = 48, s_slip = 49, s_length = 50, &
                         s_normal_stress = 51, s_shear_stress = 52, s_strength = 53, &
                         n_series = n_tables

   type :: results_type
      integer(i8) :: long_table = 16777216_i8    !! bytes of one table that wait for a flush at most
      type(hdf5_file_type), private :: file
      type(output_lock_type), private :: lock
      type(series_type), private :: series(n_series)
      logical, private :: frames = .true., contacts = .true.
      logical, private :: is_long = .false.      !! the tables of contacts of a frame do not wait for a flush
      type(results_rows_type), private :: so_far !! rows in the file and waiting
      real(wp), private :: flush_interval = 2
      integer(int64), private :: last_flush = 0  !! clock count
      logical, private :: failed = .false.       !! nothing more is written
   contains
      procedure :: create
      procedure :: publish
      procedure :: discard
      procedure :: append_history
      procedure :: append_frame
      procedure :: append_contacts
      procedure :: reopen
      procedure :: rows
      procedure :: flush
      procedure :: is_flush_due
      procedure :: waiting_bytes
      procedure :: sync
      procedure :: keep_undo
      procedure :: has_failed
      procedure :: close => close_results
      procedure, private :: add_tables, write_long_tables
   end type results_type

contains

   !> Create the file with header and model; `publish` gives it its name. An existing file is an input error without
   !> `force`; a file that another run writes is always one.
   subroutine create(self, path, force, header, blocks, state, error)
      class(results_type), intent(inout) :: self
      character(len=*), intent(in) :: path
      logical, intent(in) :: force
      type(results_header_type), intent(in) :: header
      type(block_system_type), intent(in) :: blocks
      type(block_state_type), intent(in) :: state      !! at the start
      type(error_type), allocatable, intent(out) :: error
      integer :: i
      self%frames = header%frames
      self%contacts = header%contacts
      self%flush_interval = header%flush_interval
      self%so_far = results_rows_type()
      self%failed = .false.
      call self%lock%create(path, force, error)
      if (allocated(error)) return
      call self%add_tables(blocks, header)
      call self%file%create(part_path(path), error, in_commits=.true., name=path)
      if (.not. allocated(error)) call write_run(self%file, header, blocks, state, error)
      if (.not. allocated(error)) call total_of_model(self%file, self%so_far%totals(n_totals), error)
      do i = 1, n_series
         if (.not. allocated(error)) call self%series(i)%create(self%file, error)
      end do
      if (.not. allocated(error)) call self%file%set_attribute('history/energy', 'columns', energy_names, error)
      if (.not. allocated(error)) call write_units(self%file, header%units, error)
      call self%series(s_offset)%add([0], 1)
      if (allocated(error)) call self%discard()
   end subroutine create

   !> Flush a file that was created, with the rows added so far, and rename it to its final name. On error it is
   !> removed, and an older file stays.
   subroutine publish(self, error)
      class(results_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      call self%flush(error)
      if (.not. allocated(error)) call self%lock%publish(error)
      if (allocated(error)) then
         call self%discard()
      else
         call remove_file(undo_path(self%file%path))   ! of the run that was here
      end if
   end subroutine publish

   !> Remove a file that was not published.
   subroutine discard(self)
      class(results_type), intent(inout) :: self
      self%failed = .true.
      call self%file%abandon()
      call self%lock%discard()
   end subroutine discard

   !> Add names and row shapes of all growing tables. Places and times have 64 bits with any precision: far from the
   !> origin of coordinates 32 bits would round displacements away.
   subroutine add_tables(self, blocks, header)
      class(results_type), intent(inout) :: self
      type(block_system_type), intent(in) :: blocks
      type(results_header_type), intent(in) :: header
      integer :: nb, nv, nm, nf, n_bolts, n_nodes, n_with_nodes
      integer(i8) :: n, nc
      logical :: small
      integer, parameter :: single(0) = [integer ::]
      logical, parameter :: reals = .true., integers = .false.
      nb = blocks%n_blocks
      nv = blocks%n_vertices()
      nm = blocks%measured%n
      nf = blocks%fixed%n
      n_bolts = blocks%bolts%n
      n_nodes = header%n_bolt_nodes
      n_with_nodes = 0
      if (n_nodes > 0) n_with_nodes = size(header%bolt_spacing)
      small = header%single
      n = min(header%n_frames_expected, most_expected)
      nc = usual_contacts*nb*n
      call self%series(s_step)%init('history/step', integers, single)
      call self%series(s_time)%init('history/time', reals, single)
      call self%series(s_dt)%init('history/dt', reals, single)
      call self%series(s_iterations)%init('history/open_close_iterations', integers, single)
      call self%series(s_attempts)%init('history/attempts', integers, single)
      call self%series(s_solver)%init('history/solver_iterations', integers, single)
      call self%series(s_contacts)%init('history/contacts', integers, [3])
      call self%series(s_displacement)%init('history/max_displacement', reals, single)
      call self%series(s_energy)%init('history/energy', reals, [n_energies])
      call self%series(s_measured_displacement)%init('history/measured_displacement', reals, [2, nm])
      call self%series(s_measured_stress)%init('history/measured_stress', reals, [3, nm])
      call self%series(s_measured_rotation)%init('history/measured_rotation', reals, [nm])
      call self%series(s_fixed_force)%init('history/fixed_force', reals, [2, nf])
      call self%series(s_boundary_force)%init('history/boundary_force', reals, [2, header%n_boundaries])
      call self%series(s_unbalanced)%init('history/unbalanced', reals, single)
      call self%series(s_stage)%init('history/stage', integers, single)
      call self%series(s_relaxation)%init('history/relaxation', reals, single)
      call self%series(s_time_error)%init('history/time_error', reals, single)
      call self%series(s_bolt_largest)%init('history/bolt_force', reals, [n_with_nodes], only_filled=.true.)
      call self%series(s_bolt_head)%init('history/bolt_head_force', reals, [n_with_nodes], only_filled=.true.)
      call self%series(s_bolt_dowel)%init('history/bolt_dowel', reals, [n_with_nodes], only_filled=.true.)
      call self%series(s_bolt_energy)%init('history/bolt_energy', reals, [merge(4, 0, n_with_nodes > 0)], &
                                           only_filled=.true.)
      call self%series(s_frame_step)%init('frames/step', integers, single, n_expected=n)
      call self%series(s_frame_time)%init('frames/time', reals, single, n_expected=n)
      call self%series(s_vertices)%init('frames/vertices', reals, [2, nv], n_expected=n)
      call self%series(s_centroid)%init('frames/centroid', reals, [2, nb], n_expected=n)
      call self%series(s_rotation)%init('frames/rotation', reals, [nb], small, n)
      call self%series(s_stress)%init('frames/stress', reals, [3, nb], small, n)
      call self%series(s_velocity)%init('frames/velocity', reals, [6, nb], small, n)
      call self%series(s_bolt_ends)%init('frames/bolt_ends', reals, [2, 2, n_bolts], n_expected=n)
      call self%series(s_bolt_force)%init('frames/bolt_force', reals, [max(n_bolts, n_nodes)], small, n)
      call self%series(s_bolt_node)%init('frames/bolt_node', reals, [2, n_nodes], n_expected=n, only_filled=.true.)
      call self%series(s_bolt_slip)%init('frames/bolt_slip', reals, [n_nodes], small, n, only_filled=.true.)
      call self%series(s_bolt_use)%init('frames/bolt_use', reals, [n_nodes], small, n, only_filled=.true.)
      call self%series(s_bolt_state)%init('frames/bolt_state', integers, [n_nodes], n_expected=n, only_filled=.true.)
      call self%series(s_active)%init('frames/active', integers, [nb], n_expected=n)
      n_nodes = header%n_liner_nodes
      call self%series(s_liner_point)%init('frames/liner_point', reals, [2, n_nodes], n_expected=n, only_filled=.true.)
      call self%series(s_liner_force)%init('frames/liner_force', reals, [3, n_nodes], small, n, only_filled=.true.)
      call self%series(s_liner_back)%init('frames/liner_back', reals, [2, n_nodes], small, n, only_filled=.true.)
      call self%series(s_liner_section)%init('frames/liner_section', reals, [6, n_nodes], small, n, only_filled=.true.)
      call self%series(s_liner_use)%init('frames/liner_use', reals, [n_nodes], small, n, only_filled=.true.)
      call self%series(s_liner_state)%init('frames/liner_state', integers, [n_nodes], n_expected=n, only_filled=.true.)
      call self%series(s_offset)%init('frames/contact_offset', integers, single, n_expected=n)
      call self%series(s_point)%init('frames/contact_point', reals, [2], n_expected=nc)
      call self%series(s_force)%init('frames/contact_force', reals, [2], small, nc)
      call self%series(s_state)%init('frames/contact_state', integers, single, n_expected=nc)
      call self%series(s_blocks)%init('frames/contact_blocks', integers, [2], n_expected=nc)
      call self%series(s_opening)%init('frames/contact_opening', reals, single, small, nc)
      call self%series(s_slip)%init('frames/contact_slip', reals, single, small, nc)
      call self%series(s_length)%init('frames/contact_length', reals, single, small, nc)
      call self%series(s_normal_stress)%init('frames/contact_normal_stress', reals, single, small, nc)
      call self%series(s_shear_stress)%init('frames/contact_shear_stress', reals, single, small, nc)
      call self%series(s_strength)%init('frames/contact_strength', reals, single, small, nc)
   end subroutine add_tables

   !> Append the row of an accepted step to the history.
   subroutine append_history(self, record)
      class(results_type), intent(inout) :: self
      type(step_record_type), intent(in) :: record
      integer :: nm, nf, n_boundaries
      nm = self%series(s_measured_rotation)%row_size
      nf = self%series(s_fixed_force)%row_size/2
      n_boundaries = self%series(s_boundary_force)%row_size/2
      self%so_far%steps = self%so_far%steps + 1
      associate (s => self%series)
         call s(s_step)%add([record%step], 1)
         call s(s_time)%add([record%time], 1)
         call s(s_dt)%add([record%dt], 1)
         call s(s_iterations)%add([record%open_close_iterations], 1)
         call s(s_attempts)%add([record%attempts], 1)
         call s(s_solver)%add([record%solver_iterations], 1)
         call s(s_contacts)%add(record%contacts, 1)
         call s(s_displacement)%add([record%max_displacement], 1)
         call s(s_energy)%add(record%energy, 1)
         call s(s_measured_displacement)%add(reshape(record%measured_displacement(:, 1:nm), [2*nm]), 1)
         call s(s_measured_stress)%add(reshape(record%measured_stress(:, 1:nm), [3*nm]), 1)
         call s(s_measured_rotation)%add(record%measured_rotation(1:nm), 1)
         call s(s_fixed_force)%add(reshape(record%fixed_force(:, 1:nf), [2*nf]), 1)
         call s(s_boundary_force)%add(reshape(record%boundary_force(:, 1:n_boundaries), [2*n_boundaries]), 1)
         call s(s_unbalanced)%add([record%unbalanced], 1)
         call s(s_stage)%add([record%stage], 1)
         call s(s_relaxation)%add([record%relaxation], 1)
         call s(s_time_error)%add([record%time_error], 1)
         if (.not. s(s_bolt_energy)%is_absent) then
            call s(s_bolt_largest)%add(record%bolt_force, 1)
            call s(s_bolt_head)%add(record%bolt_head_force, 1)
            call s(s_bolt_dowel)%add(record%bolt_dowel, 1)
            call s(s_bolt_energy)%add(record%bolt_energy, 1)
         end if
      end associate
   end subroutine append_history

   !> One frame: the blocks after a step (or at the start). The contacts of that step follow (`append_contacts`), all of
   !> them before anything else is appended.
   subroutine append_frame(self, state, n_contacts, bolt_force, error, nodes, liner_nodes)
      class(results_type), intent(inout) :: self
      type(block_state_type), intent(in) :: state
      integer, intent(in) :: n_contacts
      real(wp), intent(in) :: bolt_force(:)             !! (springs, nodes) axial, tension positive
      type(error_type), allocatable, intent(out) :: error
      type(bolt_nodes_type), intent(in), optional :: nodes   !! where bolts have them
      type(liner_nodes_type), intent(in), optional :: liner_nodes   !! where there are linings
      integer :: nb, nv, n_bolts, n
      if (.not. self%frames) return
      n = merge(n_contacts, 0, self%contacts)
      if (n > huge(n) - self%so_far%contacts) then
         call make_error(error, error_code%output, self%file%path// &
                         ': too many contact rows; save fewer frames or set contacts = .false. in &output')
         return
      end if
      nb = self%series(s_rotation)%row_size
      nv = self%series(s_vertices)%row_size/2
      n_bolts = self%series(s_bolt_ends)%row_size/4
      associate (s => self%series)
         call s(s_frame_step)%add([state%step], 1)
         call s(s_frame_time)%add([state%time], 1)
         call s(s_vertices)%add(reshape(state%vertices(:, 1:nv) + spread(state%datum, 2, nv), [2*nv]), 1)
         call s(s_centroid)%add(reshape(state%centroid(:, 1:nb) + spread(state%datum, 2, nb), [2*nb]), 1)
         call s(s_rotation)%add(state%rotation(1:nb), 1)
         call s(s_stress)%add(reshape(state%stress(:, 1:nb), [3*nb]), 1)
         call s(s_velocity)%add(reshape(state%velocity(:, 1:nb), [6*nb]), 1)
         if (n_bolts > 0) then
            call s(s_bolt_ends)%add(reshape(state%bolt_ends(:, 1:n_bolts) + &
                                            spread([state%datum, state%datum], 2, n_bolts), [4*n_bolts]), 1)
         else
            call s(s_bolt_ends)%add([real(wp) ::], 1)
         end if
         call s(s_bolt_force)%add(bolt_force(1:s(s_bolt_force)%row_size), 1)
         if (present(nodes) .and. .not. s(s_bolt_node)%is_absent) then
            call s(s_bolt_node)%add(reshape(nodes%place, [size(nodes%place)]), 1)
            call s(s_bolt_slip)%add(nodes%slip, 1)
            call s(s_bolt_state)%add(nodes%state, 1)
            call s(s_bolt_use)%add(nodes%use, 1)
         end if
         call s(s_active)%add(merge(1, 0, state%active(1:nb)), 1)
         if (present(liner_nodes) .and. .not. s(s_liner_point)%is_absent) then
            call s(s_liner_point)%add(reshape(liner_nodes%place, [size(liner_nodes%place)]), 1)
            call s(s_liner_force)%add(reshape(liner_nodes%force, [size(liner_nodes%force)]), 1)
            call s(s_liner_back)%add(reshape(liner_nodes%back, [size(liner_nodes%back)]), 1)
            call s(s_liner_section)%add(reshape(liner_nodes%section, [size(liner_nodes%section)]), 1)
            call s(s_liner_use)%add(liner_nodes%use, 1)
            call s(s_liner_state)%add(liner_nodes%state, 1)
         end if
         self%so_far%frames = self%so_far%frames + 1
         self%so_far%contacts = self%so_far%contacts + n
         call s(s_offset)%add([self%so_far%contacts], 1)
      end associate
      call self%write_long_tables(self%long_table, error)
      self%is_long = 8_i8*n > self%long_table
   end subroutine append_frame

   !> Some of the contacts of a frame, in the moved configuration.
   subroutine append_contacts(self, datum, contacts, stress, error)
      class(results_type), intent(inout) :: self
      real(wp), intent(in) :: datum(2)                  !! of the positions [length]
      type(contact_view_type), intent(in) :: contacts
      real(wp), intent(in) :: stress(:, :)              !! (3, the same rows) normal, tension positive, shear, strength
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: point(:, :)
      integer :: k, n
      if (.not. (self%frames .and. self%contacts)) return
      n = size(contacts%state)
      allocate (point(2, n))
      do k = 1, n
         point(:, k) = contacts%point(:, k) + datum
      end do
      associate (s => self%series)
         call s(s_point)%add(reshape(point, [2*n]), n)
         call s(s_force)%add(reshape(contacts%force, [2*n]), n)
         call s(s_state)%add(contacts%state, n)
         call s(s_blocks)%add(reshape(contacts%blocks - 1, [2*n]), n)
         call s(s_opening)%add(contacts%opening, n)
         call s(s_slip)%add(contacts%slip, n)
         call s(s_length)%add(contacts%length, n)
         call s(s_normal_stress)%add(stress(1, 1:n), n)
         call s(s_shear_stress)%add(stress(2, 1:n), n)
         call s(s_strength)%add(stress(3, 1:n), n)
      end associate
      call self%write_long_tables(merge(0_i8, self%long_table, self%is_long), error)
   end subroutine append_contacts

   !> Numbers of rows of the file, including those in memory.
   pure type(results_rows_type) function rows(self)
      class(results_type), intent(in) :: self
      rows = self%so_far
      rows%totals(1:n_series) = self%series%total
   end function rows

   !> Has a write failed? Then nothing more is written.
   pure logical function has_failed(self)
      class(results_type), intent(in) :: self
      has_failed = self%failed
   end function has_failed

   !> Write all waiting rows. After a failure the file remains as after the last flush, and nothing is written any more.
   subroutine flush(self, error)
      class(results_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      integer :: i
      if (self%failed) return
      call system_clock(self%last_flush)
      call self%lock%check(error)
      do i = 1, n_series
         if (.not. allocated(error)) call self%series(i)%write(self%file, error)
      end do
      if (.not. allocated(error)) call self%file%flush(error)
      self%failed = allocated(error)
   end subroutine flush

   !> Wait until what was flushed is on the disk.
   subroutine sync(self, error)
      class(results_type), intent(in) :: self
      type(error_type), allocatable, intent(out) :: error
      if (.not. self%failed) call self%file%sync(error)
   end subroutine sync

   !> Begin the undo file that returns the results to the last flush, the state of the checkpoint with this digest.
   subroutine keep_undo(self, digest, error)
      class(results_type), intent(in) :: self
      character(len=digest_length), intent(in) :: digest
      type(error_type), allocatable, intent(out) :: error
      if (.not. self%failed) call self%file%keep_undo(undo_path(self%file%path), digest, error)
   end subroutine keep_undo

   !> Is it time to flush: has the interval passed since the last time, or do the waiting rows take much memory?
   logical function is_flush_due(self)
      class(results_type), intent(in) :: self
      integer(int64) :: now, rate
      call system_clock(now, rate)
      is_flush_due = real(now - self%last_flush, wp) >= self%flush_interval*real(rate, wp) .or. &
                     self%waiting_bytes() > largest_buffer
   end function is_flush_due

   !> Hand the rows of tables of which many wait to the file, which commits them at the next flush.
   subroutine write_long_tables(self, most, error)
      class(results_type), intent(inout) :: self
      integer(i8), intent(in) :: most            !! bytes of a table that may wait
      type(error_type), allocatable, intent(out) :: error
      integer :: i
      do i = 1, n_series
         if (self%failed) return
         if (self%series(i)%waiting_bytes() > most) call self%series(i)%write(self%file, error)
         self%failed = allocated(error)
      end do
   end subroutine write_long_tables

   !> Bytes waiting in memory.
   pure integer(i8) function waiting_bytes(self)
      class(results_type), intent(in) :: self
      integer :: i
      waiting_bytes = 0
      do i = 1, n_series
         waiting_bytes = waiting_bytes + self%series(i)%waiting_bytes()
      end do
   end function waiting_bytes

   !> Write the waiting rows and the reason for the end of the run, close the file and release its lock.
   subroutine close_results(self, complete, exit_reason, error, planned_time)
      class(results_type), intent(inout) :: self
      logical, intent(in) :: complete                    !! the run reached its end
      character(len=*), intent(in) :: exit_reason        !! 'finished' or the reason of the stop
      type(error_type), allocatable, intent(out) :: error
      real(wp), intent(in), optional :: planned_time     !! of the run when no step is cut
      if (.not. self%file%is_open) then
         call self%lock%release()
         return
      end if
      call self%flush(error)
      if (.not. self%failed) then
         call self%file%set_attribute('/', 'exit_reason', exit_reason, error)
         if (.not. allocated(error)) call self%file%set_attribute('/', 'complete', merge(1, 0, complete), error)
         if (.not. allocated(error) .and. present(planned_time)) &
            call self%file%set_attribute('/', 'planned_time', to_string(planned_time, 17), error)
         if (.not. allocated(error)) call self%file%flush(error)
         if (.not. allocated(error)) call self%file%sync(error)
         self%failed = allocated(error)
      end if
      if (self%failed) then
         ! the file remains as after the last flush
         call self%file%abandon()
      else
         call self%file%close(error)
         if (.not. allocated(error)) call remove_file(undo_path(self%file%path))
      end if
      call self%lock%release()
   end subroutine close_results

   !> Return the file of a run to a checkpoint and continue it. A file that does not belong to the checkpoint is not
   !> changed (code input).
   subroutine reopen(self, path, header, digest, rows, blocks, record, error)
      class(results_type), intent(inout) :: self
      character(len=*), intent(in) :: path
      type(results_header_type), intent(in) :: header
      character(len=digest_length), intent(in) :: digest !! of the checkpoint
      type(results_rows_type), intent(in) :: rows        !! at the checkpoint
      type(block_system_type), intent(in) :: blocks
      type(step_record_type), intent(in) :: record       !! of the checkpoint's step
      type(error_type), allocatable, intent(out) :: error
      logical :: put_back
      self%frames = header%frames
      self%contacts = header%contacts
      self%flush_interval = header%flush_interval
      self%so_far = rows
      self%failed = .false.
      if (get_path_kind(path) == path_kind%missing) then
         call make_error(error, error_code%input, path//': the results of this checkpoint are missing')
         return
      end if
      call self%lock%reopen(path, error)
      if (allocated(error)) return
      call self%add_tables(blocks, header)
      call check_undo(path, digest, error)
      if (.not. allocated(error)) call check_results(path, self%lock, digest, header, rows, lengths(rows), record, &
                                                     self%series, error)
      if (.not. allocated(error)) call roll_back(path, digest, put_back, error)
      if (.not. allocated(error)) call self%file%open(path, .true., error)
      if (.not. allocated(error)) call self%keep_undo(digest, error)
      if (.not. allocated(error)) call cut_tables(self%file, lengths(rows), rows, self%series, error)
      if (.not. allocated(error)) call self%flush(error)
      if (.not. allocated(error)) return
      self%failed = .true.
      call self%file%abandon()
      call self%lock%release()
   end subroutine reopen

   !> Rows of all tables.
   pure function lengths(rows)
      type(results_rows_type), intent(in) :: rows
      integer(i8) :: lengths(n_series)
      lengths(:s_bolt_energy) = rows%steps
      lengths(s_bolt_energy + 1:) = rows%frames
      lengths(s_offset) = rows%frames + 1
      lengths(s_point:) = rows%contacts
   end function lengths

end module rockdda_io_results
