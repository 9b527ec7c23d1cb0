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
      energy_names
   use rockdda_io_hdf5_adapter, only : hdf5_file_type
   use rockdda_io_hdf5_driver, only : undo_path, check_undo, roll_back, digest_length
   use rockdda_io_posix, only : get_path_kind, path_kind, remove_file
   use rockdda_io_output_lock, only : output_lock_type, part_path
   use rockdda_io_results_check, only : check_results, cut_tables
   use rockdda_io_results_model, only : write_run
   use rockdda_io_results_tables, only : tables, per, n_sizes, kind_of_row, row_shape, write_units, total_of_model, &
      results_header_type, results_rows_type, results_format_version, n_tables, n_totals
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

   type :: results_type
      integer(i8) :: long_table = 16777216_i8    !! bytes of one table that wait for a flush at most
      type(hdf5_file_type), private :: file
      type(output_lock_type), private :: lock
      type(series_type), private :: series(n_tables)
      integer, private :: sizes(n_sizes) = 0     !! of the model, at -per%...
      integer, private :: present = 0            !! table that was found last
      integer(i8), private :: waiting = 0        !! bytes of rows in memory
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
      generic, private :: put => put_reals, put_integers
      procedure, private :: put_reals, put_integers, find
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
      self%waiting = 0
      call self%lock%create(path, force, error)
      if (allocated(error)) return
      call self%add_tables(blocks, header)
      call self%file%create(part_path(path), error, in_commits=.true., name=path)
      if (.not. allocated(error)) call write_run(self%file, header, blocks, state, error)
      if (.not. allocated(error)) call total_of_model(self%file, self%so_far%totals(n_totals), error)
      do i = 1, n_tables
         if (.not. allocated(error)) call self%series(i)%create(self%file, error)
      end do
      call self%file%set_attribute('history/energy', 'columns', energy_names, error)
      if (.not. allocated(error)) call write_units(self%file, header%units, error)
      call self%put('frames/contact_offset', [0])
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

   !> Make all growing tables ready for rows.
   subroutine add_tables(self, blocks, header)
      class(results_type), intent(inout) :: self
      type(block_system_type), intent(in) :: blocks
      type(results_header_type), intent(in) :: header
      integer :: i, n_bars
      integer(i8) :: n_expected(3)                !! rows of each kind; 0: few, or not known
      n_bars = 0
      if (header%n_bolt_nodes > 0) n_bars = size(header%bolt_spacing)
      self%sizes(-per%block) = blocks%n_blocks
      self%sizes(-per%vertex) = blocks%n_vertices()
      self%sizes(-per%fixed) = blocks%fixed%n
      self%sizes(-per%measured) = blocks%measured%n
      self%sizes(-per%boundary) = header%n_boundaries
      self%sizes(-per%bolt) = blocks%bolts%n
      self%sizes(-per%bar) = n_bars
      self%sizes(-per%bar_energy) = merge(4, 0, n_bars > 0)
      self%sizes(-per%node) = header%n_bolt_nodes
      self%sizes(-per%bolt_force) = max(blocks%bolts%n, header%n_bolt_nodes)
      self%sizes(-per%liner_node) = header%n_liner_nodes
      n_expected = 0
      n_expected(kind_of_row%frame) = min(header%n_frames_expected, most_expected)
      n_expected(kind_of_row%contact) = usual_contacts*blocks%n_blocks*n_expected(kind_of_row%frame)
      do i = 1, n_tables
         associate (t => tables(i))
            call self%series(i)%init(trim(t%name), t%is_real, row_shape(t, self%sizes), &
                                     header%single .and. .not. t%is_double, n_expected(t%of), t%only_filled)
         end associate
      end do
   end subroutine add_tables

   !> The table of a name; those that follow one another are found at once.
   integer function find(self, name) result(i)
      class(results_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer :: k
      i = self%present
      do k = 1, n_tables
         i = merge(1, i + 1, i == n_tables)
         if (self%series(i)%name == name) exit
      end do
      self%present = i
   end function find

   !> Append rows of reals to a table: one, or as many as the values are of tables of contacts.
   subroutine put_reals(self, name, values)
      class(results_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: values(:)
      associate (table => self%series(self%find(name)))
         self%waiting = self%waiting + size(values)*merge(4, 8, table%is_single)
         call table%add(values, merge(1, size(values)/max(1, table%row_size), table%row_size == 0))
      end associate
   end subroutine put_reals

   !> Append rows of integers.
   subroutine put_integers(self, name, values)
      class(results_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: values(:)
      associate (table => self%series(self%find(name)))
         self%waiting = self%waiting + size(values)*4
         call table%add(values, merge(1, size(values)/max(1, table%row_size), table%row_size == 0))
      end associate
   end subroutine put_integers

   !> Append the row of an accepted step to the history.
   subroutine append_history(self, record)
      class(results_type), intent(inout) :: self
      type(step_record_type), intent(in) :: record
      integer :: nm, nf, n_boundaries
      nm = self%sizes(-per%measured)
      nf = self%sizes(-per%fixed)
      n_boundaries = self%sizes(-per%boundary)
      self%so_far%steps = self%so_far%steps + 1
      call self%put('history/step', [record%step])
      call self%put('history/time', [record%time])
      call self%put('history/dt', [record%dt])
      call self%put('history/open_close_iterations', [record%open_close_iterations])
      call self%put('history/attempts', [record%attempts])
      call self%put('history/solver_iterations', [record%solver_iterations])
      call self%put('history/contacts', record%contacts)
      call self%put('history/max_displacement', [record%max_displacement])
      call self%put('history/energy', record%energy)
      call self%put('history/measured_displacement', reshape(record%measured_displacement(:, 1:nm), [2*nm]))
      call self%put('history/measured_stress', reshape(record%measured_stress(:, 1:nm), [3*nm]))
      call self%put('history/measured_rotation', record%measured_rotation(1:nm))
      call self%put('history/fixed_force', reshape(record%fixed_force(:, 1:nf), [2*nf]))
      call self%put('history/boundary_force', reshape(record%boundary_force(:, 1:n_boundaries), [2*n_boundaries]))
      call self%put('history/unbalanced', [record%unbalanced])
      call self%put('history/stage', [record%stage])
      call self%put('history/relaxation', [record%relaxation])
      call self%put('history/time_error', [record%time_error])
      if (self%sizes(-per%bar) > 0) then
         call self%put('history/bolt_force', record%bolt_force)
         call self%put('history/bolt_head_force', record%bolt_head_force)
         call self%put('history/bolt_dowel', record%bolt_dowel)
         call self%put('history/bolt_energy', record%bolt_energy)
      end if
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
      nb = self%sizes(-per%block)
      nv = self%sizes(-per%vertex)
      n_bolts = self%sizes(-per%bolt)
      call self%put('frames/step', [state%step])
      call self%put('frames/time', [state%time])
      call self%put('frames/vertices', reshape(state%vertices(:, 1:nv) + spread(state%datum, 2, nv), [2*nv]))
      call self%put('frames/centroid', reshape(state%centroid(:, 1:nb) + spread(state%datum, 2, nb), [2*nb]))
      call self%put('frames/rotation', state%rotation(1:nb))
      call self%put('frames/stress', reshape(state%stress(:, 1:nb), [3*nb]))
      call self%put('frames/velocity', reshape(state%velocity(:, 1:nb), [6*nb]))
      if (n_bolts > 0) then
         call self%put('frames/bolt_ends', reshape(state%bolt_ends(:, 1:n_bolts) + &
                                         spread([state%datum, state%datum], 2, n_bolts), [4*n_bolts]))
      else
         call self%put('frames/bolt_ends', [real(wp) ::])
      end if
      call self%put('frames/bolt_force', bolt_force(1:self%sizes(-per%bolt_force)))
      if (present(nodes) .and. self%sizes(-per%node) > 0) then
         call self%put('frames/bolt_node', reshape(nodes%place, [size(nodes%place)]))
         call self%put('frames/bolt_slip', nodes%slip)
         call self%put('frames/bolt_state', nodes%state)
         call self%put('frames/bolt_use', nodes%use)
      end if
      call self%put('frames/active', merge(1, 0, state%active(1:nb)))
      if (present(liner_nodes) .and. self%sizes(-per%liner_node) > 0) then
         call self%put('frames/liner_point', reshape(liner_nodes%place, [size(liner_nodes%place)]))
         call self%put('frames/liner_force', reshape(liner_nodes%force, [size(liner_nodes%force)]))
         call self%put('frames/liner_sides', reshape(liner_nodes%sides, [size(liner_nodes%sides)]))
         call self%put('frames/liner_back', reshape(liner_nodes%back, [size(liner_nodes%back)]))
         call self%put('frames/liner_section', reshape(liner_nodes%section, [size(liner_nodes%section)]))
         call self%put('frames/liner_use', liner_nodes%use)
         call self%put('frames/liner_state', liner_nodes%state)
      end if
      self%so_far%frames = self%so_far%frames + 1
      self%so_far%contacts = self%so_far%contacts + n
      call self%put('frames/contact_offset', [self%so_far%contacts])
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
      call self%put('frames/contact_point', reshape(point, [2*n]))
      call self%put('frames/contact_force', reshape(contacts%force, [2*n]))
      call self%put('frames/contact_state', contacts%state)
      call self%put('frames/contact_blocks', reshape(contacts%blocks - 1, [2*n]))
      call self%put('frames/contact_opening', contacts%opening)
      call self%put('frames/contact_slip', contacts%slip)
      call self%put('frames/contact_length', contacts%length)
      call self%put('frames/contact_normal_stress', stress(1, 1:n))
      call self%put('frames/contact_shear_stress', stress(2, 1:n))
      call self%put('frames/contact_strength', stress(3, 1:n))
      call self%write_long_tables(merge(0_i8, self%long_table, self%is_long), error)
   end subroutine append_contacts

   !> Numbers of rows of the file, including those in memory.
   pure type(results_rows_type) function rows(self)
      class(results_type), intent(in) :: self
      rows = self%so_far
      rows%totals(1:n_tables) = self%series%total
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
      do i = 1, n_tables
         if (.not. allocated(error)) call self%series(i)%write(self%file, error)
      end do
      self%waiting = 0
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
      if (.not. self%failed) call self%file%keep_undo(digest, error)
   end subroutine keep_undo

   !> Is it time to flush: has the interval passed since the last time, or do the waiting rows take much memory?
   logical function is_flush_due(self)
      class(results_type), intent(in) :: self
      integer(int64) :: now, rate
      call system_clock(now, rate)
      is_flush_due = real(now - self%last_flush, wp) >= self%flush_interval*real(rate, wp) .or. &
                     self%waiting > largest_buffer
   end function is_flush_due

   !> Hand the rows of tables of which many wait to the file, which commits them at the next flush.
   subroutine write_long_tables(self, most, error)
      class(results_type), intent(inout) :: self
      integer(i8), intent(in) :: most            !! bytes of a table that may wait
      type(error_type), allocatable, intent(out) :: error
      integer :: i
      do i = 1, n_tables
         if (self%failed) return
         associate (bytes => self%series(i)%waiting_bytes())
            if (bytes <= most) cycle
            call self%series(i)%write(self%file, error)
            self%waiting = self%waiting - bytes
         end associate
         self%failed = allocated(error)
      end do
   end subroutine write_long_tables

   !> Bytes waiting in memory.
   pure integer(i8) function waiting_bytes(self)
      class(results_type), intent(in) :: self
      waiting_bytes = self%waiting
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
         call self%file%set_attribute('/', 'complete', merge(1, 0, complete), error)
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
      self%waiting = 0
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
      integer(i8) :: lengths(n_tables)
      integer :: i
      do i = 1, n_tables
         select case (tables(i)%of)
         case (kind_of_row%step); lengths(i) = rows%steps
         case (kind_of_row%frame); lengths(i) = rows%frames
         case default; lengths(i) = rows%contacts
         end select
         ! where the contacts of the next frame begin
         if (tables(i)%name == 'frames/contact_offset') lengths(i) = rows%frames + 1
      end do
   end function lengths

end module rockdda_io_results
