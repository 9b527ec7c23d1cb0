! SPDX-License-Identifier: MIT
!> Checkpoints: the state from which a run continues as if it had never stopped (docs/file-formats.md, "checkpoints").
!>
!> A checkpoint is an HDF5 file, followed by one line with the SHA-256 digest of all bytes before it (HDF5 ignores it).
!> It is written under a temporary name in the same folder and then renamed over the older one: at any moment a complete
!> checkpoint exists. A file with another digest is refused before HDF5 opens it.
!>
!>     call checkpoint%begin_saving(path, facts, error)            call checkpoint%begin_loading(path, facts, error)
!>     … the exchange_… procedures on checkpoint%archive …         … the same procedures …
!>     call checkpoint%end_saving(error)                           call checkpoint%end_loading(error)
!>
!> Summary of a checkpoint.
module rockdda_io_checkpoint
   use, intrinsic :: iso_c_binding, only : c_char, c_int, c_null_char
   use rockdda_base_kinds, only : wp, i8
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_state_archive, only : positive
   use rockdda_base_strings, only : to_string
   use rockdda_base_version, only : version, build_description
   use rockdda_model_options, only : most_threads
   use rockdda_io_archive, only : archive_type
   use rockdda_io_digest, only : digest_of_text, digest_of_file, hexadecimal, digest_length
   use rockdda_io_output_lock, only : errno_text, part_path
   use rockdda_io_posix, only : get_file_size, get_path_kind, is_readable, path_kind, remove_file
   use rockdda_io_results_tables, only : results_header_type, results_rows_type
   use rockdda_io_guard, only : run_in_child, end_child, explain, begin_reading, end_reading, guard
   implicit none
   private
   public :: checkpoint_type, checkpoint_facts_type, checkpoint_path, results_path, is_checkpoint, &
      checkpoint_info_type, read_checkpoint_info

   integer, parameter :: checkpoint_format_version = 40
   !> Attribute `format` of the file.
   character(len=*), parameter :: checkpoint_format = 'rockdda-checkpoint'
   character(len=*), parameter :: seal_start = 'rockdda checkpoint, SHA-256 of all bytes before this line: '
   !> Bytes of the last line.
   integer, parameter :: seal_length = len(seal_start) + 2*digest_length + 1
   character(len=*), parameter :: ending = '.ckpt.h5'
   !> Endings of results files for which the checkpoint's name does not hold the ending.
   character(len=*), parameter :: endings(3) = [character(len=5) :: '.h5', '.hdf5', '.hdf']

   !> The run of a checkpoint and its progress.
   type :: checkpoint_facts_type
      type(results_header_type) :: header         !! of the results
      type(results_rows_type) :: rows             !! of the results
      character(len=:), allocatable :: results_ending            !! '.h5' for OUT.h5
      character(len=:), allocatable :: build                     !! of the program that wrote it
      character(len=:), allocatable :: written                   !! UTC
      character(len=:), allocatable :: model_file, analysis_file, config_file !! as given by the user
      integer :: frame_every = 0                  !! see rockdda_run_frame_plan
      real(wp) :: frame_interval = 0
      integer :: frames_passed = 0
      integer :: last_frame = -1                  !! step of the last planned frame
      integer :: threads = 0                      !! 0: not chosen
      real(wp) :: checkpoint_every = 60           !! [s]
   end type checkpoint_facts_type

   type :: checkpoint_type
      type(archive_type) :: archive
      character(len=digest_length) :: digest = ''
      character(len=:), allocatable, private :: path
   contains
      procedure :: begin_saving
      procedure :: end_saving
      procedure :: begin_loading
      procedure :: end_loading
   end type checkpoint_type

   interface
      integer(c_int) function c_begin(path) bind(C, name='rockdda_checkpoint_begin')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: path(*)
      end function c_begin

      integer(c_int) function c_seal(path, bytes, n) bind(C, name='rockdda_checkpoint_seal')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: path(*), bytes(*)
         integer(c_int), value :: n
      end function c_seal

      integer(c_int) function c_replace(from, to) bind(C, name='rockdda_checkpoint_replace')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: from(*), to(*)
      end function c_replace
   end interface

   type :: checkpoint_info_type
      type(checkpoint_facts_type) :: facts
      character(len=2*digest_length) :: digest = ''
      character(len=2*digest_length) :: input_digests(3) = ''   !! geometry, analysis, config
      integer :: step = 0
      real(wp) :: time = 0
      integer :: n_steps = 0                       !! where the run is to end, huge: no limit
      real(wp) :: t_end = huge(1.0_wp)
      integer :: n_blocks = 0, n_contacts = 0
      character(len=:), allocatable :: solver
   end type checkpoint_info_type

   !> Processor time to read a summary: this many seconds, and one for this many bytes, of which a digest is computed.
   real(wp), parameter :: least_seconds = 0.5_wp, slowest_reading = 1.0e7_wp

contains

   !> Path of the checkpoint beside a results file: OUT.ckpt.h5 for OUT.h5.
   pure function checkpoint_path(results) result(path)
      character(len=*), intent(in) :: results
      character(len=:), allocatable :: path
      path = results(1:len(results) - len(ending_of(results)))//ending
   end function checkpoint_path

   !> Path of the results beside a checkpoint; '' when the name is not that of a checkpoint.
   pure function results_path(checkpoint, results_ending) result(path)
      character(len=*), intent(in) :: checkpoint
      character(len=*), intent(in) :: results_ending   !! '.h5'
      character(len=:), allocatable :: path
      integer :: n
      path = ''
      n = len(checkpoint) - len(ending)
      if (n < 1) return
      if (checkpoint(n + 1:) == ending) path = checkpoint(1:n)//results_ending
   end function results_path

   !> The ending of a results file that its checkpoint's name does not hold: '.h5', or nothing.
   pure function ending_of(results) result(text)
      character(len=*), intent(in) :: results
      character(len=:), allocatable :: text
      integer :: i, n
      text = ''
      do i = 1, size(endings)
         n = len(results) - len_trim(endings(i))
         if (n < 1) cycle
         if (results(n + 1:) == trim(endings(i)) .and. results(n:n) /= '/') text = trim(endings(i))
      end do
   end function ending_of

   !> Begin a checkpoint for a results file; the values follow.
   subroutine begin_saving(self, results, facts, error)
      class(checkpoint_type), intent(inout) :: self
      character(len=*), intent(in) :: results
      type(checkpoint_facts_type), intent(inout) :: facts
      type(error_type), allocatable, intent(out) :: error
      integer(c_int) :: status
      self%path = checkpoint_path(results)
      call self%archive%start(saving=.true.)
      facts%results_ending = ending_of(results)
      status = c_begin(part_path(self%path)//c_null_char)
      if (status /= 0) then
         call make_error(error, error_code%output, part_path(self%path)//': '//errno_text(status))
         return
      end if
      associate (file => self%archive%file)
         call file%create(part_path(self%path), error, in_commits=.true.)
         call file%set_attribute('/', 'format', checkpoint_format, error)
         call file%set_attribute('/', 'format_version', checkpoint_format_version, error)
         call file%set_attribute('/', 'program_version', version, error)
         call file%set_attribute('/', 'build', build_description(), error)
      end associate
      if (.not. allocated(error)) call exchange_facts(self%archive, facts)
      if (.not. allocated(error)) call put_digests(self%archive, facts, error)
      if (allocated(error)) call give_up(self)
   end subroutine begin_saving

   !> Finish the checkpoint, rename it over the older one and wait until it is on the disk. On error the older one is
   !> unchanged.
   subroutine end_saving(self, error)
      class(checkpoint_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: part, line
      part = part_path(self%path)
      call self%archive%put_small_values()
      if (allocated(self%archive%error)) call move_alloc(self%archive%error, error)
      if (.not. allocated(error)) call self%archive%file%close(error)
      if (.not. allocated(error)) call digest_of_file(part, -1_i8, self%digest, error)
      if (.not. allocated(error)) then
         line = seal_start//hexadecimal(self%digest)//new_line('a')
         call explain(c_seal(part//c_null_char, line, len(line, c_int)))
      end if
      if (.not. allocated(error)) call explain(c_replace(part//c_null_char, self%path//c_null_char))
      if (allocated(error)) call give_up(self)

   contains

      !> Make the error of a call to the system that failed.
      subroutine explain(status)
         integer(c_int), intent(in) :: status
         if (status /= 0) call make_error(error, error_code%output, self%path//': '//errno_text(status))
      end subroutine explain

   end subroutine end_saving

   !> Remove the incomplete file.
   subroutine give_up(self)
      class(checkpoint_type), intent(inout) :: self
      call self%archive%file%abandon()
      call remove_file(part_path(self%path))
   end subroutine give_up

   !> Check digest and version, then open the checkpoint; the values follow. Nothing is read from a file that is damaged
   !> or of another version (code input).
   subroutine begin_loading(self, path, facts, error)
      class(checkpoint_type), intent(inout) :: self
      character(len=*), intent(in) :: path
      type(checkpoint_facts_type), intent(inout) :: facts
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: text
      integer :: number
      self%path = path
      call self%archive%start(saving=.false.)
      call check_seal(path, self%digest, error)
      if (allocated(error)) return
      associate (file => self%archive%file)
         call file%open(path, .false., error)
         if (allocated(error)) return
         call file%get_attribute('/', 'format', text, error)
         if (.not. allocated(error)) then
            if (text /= checkpoint_format) call refuse('this is no checkpoint of RockDDA')
         end if
         call file%get_attribute('/', 'format_version', number, error)
         if (.not. allocated(error)) then
            if (number /= checkpoint_format_version) call refuse('this program reads checkpoints of format version '// &
               to_string(checkpoint_format_version)//', not '//to_string(number)//'; start the run again')
         end if
         call file%get_attribute('/', 'program_version', facts%header%program_version, error)
         call file%get_attribute('/', 'build', facts%build, error)
      end associate
      if (.not. allocated(error)) call self%archive%get_small_values()
      if (.not. allocated(error)) call exchange_facts(self%archive, facts)
      if (.not. allocated(error) .and. allocated(self%archive%error)) call move_alloc(self%archive%error, error)
      if (allocated(error)) call self%archive%file%abandon()

   contains

      !> Make an error that names the file.
      subroutine refuse(why)
         character(len=*), intent(in) :: why
         call make_error(error, error_code%input, path//': '//why)
      end subroutine refuse

   end subroutine begin_loading

   !> Close the checkpoint after the last value.
   subroutine end_loading(self, error)
      class(checkpoint_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      if (allocated(self%archive%error)) call move_alloc(self%archive%error, error)
      call self%archive%file%abandon()
   end subroutine end_loading

   !> Is this HDF5 file a checkpoint, or was it one: by its last line, else by its name?
   logical function is_checkpoint(path)
      character(len=*), intent(in) :: path
      character(len=seal_length) :: line
      call read_last_line(path, line)
      is_checkpoint = index(line, seal_start) == 1 .or. len(results_path(path, '')) > 0
   end function is_checkpoint

   !> Read the last line of a checkpoint; blank when the file is too short or cannot be read.
   subroutine read_last_line(path, line)
      character(len=*), intent(in) :: path
      character(len=seal_length), intent(out) :: line
      integer(i8) :: n
      integer :: unit, status
      line = ''
      n = get_file_size(path) - seal_length
      if (n <= 0) return
      open (newunit=unit, file=path, status='old', action='read', access='stream', form='unformatted', iostat=status)
      if (status /= 0) return
      read (unit, pos=n + 1, iostat=status) line
      if (status /= 0) line = ''
      close (unit)
   end subroutine read_last_line

   !> Read the last line and compare it with the digest of all bytes before it.
   subroutine check_seal(path, digest, error)
      character(len=*), intent(in) :: path
      character(len=digest_length), intent(out) :: digest
      type(error_type), allocatable, intent(out) :: error
      character(len=seal_length) :: line
      digest = ''
      if (get_path_kind(path) == path_kind%missing) then
         call refuse('there is no such file')
      else if (get_path_kind(path) /= path_kind%file) then
         call refuse('this is not a file')
      else if (.not. is_readable(path)) then
         call refuse('permission denied')
      end if
      if (allocated(error)) return
      call read_last_line(path, line)
      if (index(line, seal_start) /= 1) then
         call refuse('this is no checkpoint of RockDDA, or one that was cut off')
         return
      end if
      call digest_of_file(path, get_file_size(path) - seal_length, digest, error)
      if (allocated(error)) return
      if (line(len(seal_start) + 1:) /= hexadecimal(digest)//new_line('a')) &
         call refuse('the checkpoint is damaged: its content does not match its digest')

   contains

      !> Make an error that names the file.
      subroutine refuse(why)
         character(len=*), intent(in) :: why
         call make_error(error, error_code%input, path//': '//why)
      end subroutine refuse

   end subroutine check_seal

   !> Write or read the facts about the run: inputs, numbers of rows, plan of frames.
   subroutine exchange_facts(archive, facts)
      type(archive_type), intent(inout) :: archive
      type(checkpoint_facts_type), intent(inout) :: facts
      integer :: halves(2*size(facts%rows%totals))
      call archive%section('input')
      call archive%item('geometry', facts%header%geometry, required=.true.)
      call archive%item('analysis', facts%header%analysis, required=.true.)
      call archive%item('config', facts%header%config, required=.true.)
      call archive%item('model_file', facts%model_file, required=.true.)
      call archive%item('analysis_file', facts%analysis_file, required=.true.)
      call archive%item('config_file', facts%config_file, required=.true.)
      call archive%section('results')
      call archive%item('title', facts%header%title, required=.true.)
      call archive%item('created', facts%header%created, required=.true.)
      call archive%item('written', facts%written, required=.true.)
      call archive%item('ending', facts%results_ending, required=.true.)
      ! it becomes part of a path
      if (archive%has_loaded()) call archive%demand( &
         any(facts%results_ending == [character(len=5) :: '', endings]) .and. &
         len(facts%results_ending) == len_trim(facts%results_ending), 'ending')
      call archive%item('frames', facts%header%frames)
      call archive%item('contacts', facts%header%contacts)
      call archive%item('history_rows', facts%rows%steps, 0, huge(1) - 1)
      call archive%item('frame_rows', facts%rows%frames, 0, facts%rows%steps + 1)
      call archive%item('contact_rows', facts%rows%contacts, 0)
      halves = transfer(facts%rows%totals, halves)
      call archive%fixed('check_sums', halves)
      facts%rows%totals = transfer(halves, facts%rows%totals)
      call archive%item('frame_every', facts%frame_every, 0)
      call archive%item('frame_interval', facts%frame_interval, 0.0_wp)
      call archive%item('frames_passed', facts%frames_passed, 0)
      call archive%item('last_frame', facts%last_frame, -1, facts%rows%steps)
      call archive%item('threads', facts%threads, 0, most_threads)
      call archive%item('checkpoint_every', facts%checkpoint_every, positive)
   end subroutine exchange_facts

   !> Write digests of the input files, for people and scripts.
   subroutine put_digests(archive, facts, error)
      type(archive_type), intent(in) :: archive
      type(checkpoint_facts_type), intent(in) :: facts
      type(error_type), allocatable, intent(out) :: error
      if (allocated(archive%error)) return
      call archive%file%set_attribute('input/geometry', 'sha256', &
                                      hexadecimal(digest_of_text(facts%header%geometry)), error)
      call archive%file%set_attribute('input/analysis', 'sha256', hexadecimal(digest_of_text(facts%header%analysis)), &
                                      error)
      call archive%file%set_attribute('input/config', 'sha256', hexadecimal(digest_of_text(facts%header%config)), error)
   end subroutine put_digests

   !> Read the summary, after all tests of the file. An error (code input) when it is none or damaged. It is tried in a
   !> child first: HDF5 does not survive every file.
   subroutine read_checkpoint_info(path, info, error)
      character(len=*), intent(in) :: path
      type(checkpoint_info_type), intent(out) :: info
      type(error_type), allocatable, intent(out) :: error
      integer :: outcome
      call run_in_child(least_seconds + real(max(0_i8, get_file_size(path)), wp)/slowest_reading, outcome, error)
      if (outcome == guard%in_child) then
         call read_all(path, info, error)
         call end_child(error)
      end if
      call explain(outcome, path, 'the checkpoint', error)
      if (allocated(error)) return
      call begin_reading(path)
      call read_all(path, info, error)
      call end_reading()
   end subroutine read_checkpoint_info

   !> Read digest, facts, and some numbers of model and state.
   subroutine read_all(path, info, error)
      character(len=*), intent(in) :: path
      type(checkpoint_info_type), intent(inout) :: info
      type(error_type), allocatable, intent(out) :: error
      type(checkpoint_type) :: checkpoint
      call checkpoint%begin_loading(path, info%facts, error)
      if (allocated(error)) return
      associate (archive => checkpoint%archive)
         call archive%section('state')
         call archive%item('step', info%step)
         call archive%item('time', info%time)
         call archive%section('parameters')
         call archive%item('steps', info%n_steps)
         call archive%item('t_end', info%t_end)
         call archive%item('method', info%solver, required=.true.)
         call archive%section('model')
         call archive%item('n_blocks', info%n_blocks)
         call archive%section('contacts')
         call archive%item('n', info%n_contacts)
      end associate
      call checkpoint%end_loading(error)
      if (allocated(error)) return
      info%digest = hexadecimal(checkpoint%digest)
      info%input_digests(1) = hexadecimal(digest_of_text(info%facts%header%geometry))
      info%input_digests(2) = hexadecimal(digest_of_text(info%facts%header%analysis))
      info%input_digests(3) = hexadecimal(digest_of_text(info%facts%header%config))
   end subroutine read_all

end module rockdda_io_checkpoint
