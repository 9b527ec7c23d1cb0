! SPDX-License-Identifier: MIT
!> The fuzzer: spoils input files and looks whether the program stays in order.
!>
!>     fuzz --inputs DIR --bad DIR --work DIR [--shared DIR] [--n 1000] [--seed 1] [--jobs 2] [--first 1]
!>          [--seconds 10] [--megabytes 512] [--keep failures|slow|all] [--only labelled|holes]
!>
!> Input k of seed s is always the same, whatever the number of jobs. Each one is digested by the program's own
!> commands in a child with limits on time and memory. The fuzzer fails when a child crashes, hangs, takes too much
!> memory, prints a message of the run-time system, or ends with a code that its commands must not give. Such inputs
!> are kept in WORK/failures, as they are and with all lines removed that do not matter.
program fuzz
   use, intrinsic :: iso_c_binding, only : c_int32_t
   use, intrinsic :: iso_fortran_env, only : output_unit, error_unit
!$ use omp_lib, only : omp_set_num_threads
   use fuzz_corpus, only : corpus_type, set_kind
   use fuzz_system, only : fork_child, wait_for_child, leave, share, make_folder, clear_folder, children_seconds, &
                           trap_nothing, read_text, write_text
   use fuzz_trial, only : trial_type, limits_type, make_trial, execute, minimise, command_lines, n_slots
   use fuzz_prepare, only : add_made_files
   use rockdda_base_error, only : error_type
   use rockdda_io_hdf5_adapter, only : hdf5_file_type
   use rockdda_io_posix, only : file_name_type, list_directory, get_path_kind, path_kind, remove_file
   implicit none
   integer, parameter :: n_counters = 8         !! runs by exit code 0 … 5, inputs, failures
   type(corpus_type) :: corpus
   type(limits_type) :: limits
   character(len=:), allocatable :: inputs, bad, shared, work, kept, only
   integer(c_int32_t), pointer :: counters(:), slots(:)
   integer :: n, seed, jobs, first, job, totals(n_counters)
   integer, allocatable :: children(:)

   call trap_nothing()
   call read_options()
!$ call omp_set_num_threads(1)
   call make_folder(work)
   call make_folder(work//'/failures')
   call clear_folder(work//'/failures')
   call collect()
   call wake_library()
   call share(jobs*(n_counters + n_slots), counters)
   allocate (children(jobs))
   do job = 1, jobs
      flush (output_unit)
      children(job) = fork_child()
      if (children(job) == 0) call do_job(job)
   end do
   do job = 1, jobs
      if (wait_for_child(children(job)) /= 0) write (error_unit, '(a)') 'fuzz: a job ended before its time'
   end do
   totals = 0
   do job = 1, jobs
      totals = totals + int(counters((job - 1)*(n_counters + n_slots) + 1:job*(n_counters + n_slots) - n_slots))
   end do
   call tell(totals)
   if (totals(7) /= n .or. totals(8) > 0) call leave(1)
   ! at once: what the main program holds is no leak
   call leave(0)

contains

   !> Every job takes each of its inputs in turn. Does not return.
   subroutine do_job(job)
      integer, intent(in) :: job
      type(trial_type) :: trial
      character(len=:), allocatable :: folder, failure
      character(len=12) :: number
      double precision :: seconds
      integer :: i, k, offset
      write (number, '(i0)') job
      folder = work//'/job'//trim(number)
      call make_folder(folder)
      call make_folder(folder//'/files')
      offset = (job - 1)*(n_counters + n_slots)
      slots => counters(offset + n_counters + 1:offset + n_counters + n_slots)
      do i = first + job - 1, first + n - 1, jobs
         call make_trial(corpus, limits, seed, i, trial)
         seconds = children_seconds()
         call execute(trial, folder, limits, slots, failure)
         seconds = children_seconds() - seconds
         do k = 1, trial%n_commands
            if (slots(k) >= 0 .and. slots(k) <= 5) counters(offset + 1 + slots(k)) = counters(offset + 1 + slots(k)) + 1
         end do
         counters(offset + 7) = counters(offset + 7) + 1
         if (seconds > 0.3d0*limits%seconds) then
            write (error_unit, '(a,i0,a,f0.1,a)') 'fuzz: input ', i, ' took ', seconds, ' s'
            flush (error_unit)
         end if
         if (len(failure) > 0) then
            counters(offset + 8) = counters(offset + 8) + 1
            call keep(i, trial, folder, failure)
         else if (kept == 'all' .or. (kept == 'slow' .and. seconds > 0.3d0*limits%seconds)) then
            call keep(i, trial, folder, '')
         end if
      end do
      call clear_folder(folder)
      call leave(0)
   end subroutine do_job

   !> Keep an input, in most cases because the program does not digest it.
   subroutine keep(i, trial, folder, failure)
      integer, intent(in) :: i
      type(trial_type), intent(inout) :: trial
      character(len=*), intent(in) :: folder, failure
      character(len=:), allocatable :: place
      character(len=32) :: name
      integer :: k
      write (name, '(i0,a,i0)') seed, '_', i
      place = work//'/failures/'//trim(name)
      call make_folder(place)
      call write_text(place//'/output.txt', read_text(folder//'/output.txt'))
      call write_text(place//'/failure.txt', failure//new_line('a')//command_lines(trial))
      do k = 1, trial%set%n
         call write_text(place//'/'//trial%set%files(k)%name, trial%set%files(k)%text)
      end do
      if (len(failure) == 0) return
      write (error_unit, '(a,i0,2a)') 'fuzz: input ', i, ': ', failure
      flush (error_unit)
      if (failure == 'hang') return
      call minimise(trial, folder, limits, slots, failure, 300)
      call make_folder(place//'/smallest')
      do k = 1, trial%set%n
         call write_text(place//'/smallest/'//trial%set%files(k)%name, trial%set%files(k)%text)
      end do
   end subroutine keep

   !> The shipped models, the shared ones where they are, the bad files, and what the program makes of some.
   subroutine collect()
      type(file_name_type), allocatable :: names(:)
      integer :: i, n_text
      logical :: ok
      allocate (names(0))
      call list_directory(inputs, names, ok)
      do i = 1, size(names)
         call corpus%add_folder(inputs//'/'//names(i)%name)
      end do
      do i = 1, size(names)
         call corpus%add_labelled(inputs//'/'//names(i)%name)
      end do
      call list_directory(bad//'/../labelled', names, ok)
      do i = 1, size(names)
         call corpus%add_labelled(bad//'/../labelled/'//names(i)%name)
      end do
      call corpus%add_singles(bad)
      if (corpus%n < 50) then
         write (error_unit, '(a)') 'fuzz: no models in '//inputs//' or no files in '//bad
         call leave(2)
      end if
      if (len(shared) > 0) then
         call corpus%add_folder(shared//'/legacy')
         call corpus%add_folder(shared//'/legacy/ddaml')
         call corpus%add_folder(shared//'/legacy/ddaml/fixedlines')
         call list_directory(shared//'/reference/peer', names, ok)
         do i = 1, size(names)
            call corpus%add_folder(shared//'/reference/peer/'//names(i)%name)
         end do
      end if
      n_text = corpus%n
      call add_made_files(corpus, work//'/made', limits, ok)
      if (.not. ok) then
         write (error_unit, '(a)') 'fuzz: the program cannot digest the files as they are'
         call leave(2)
      end if
      if (only == 'labelled') call corpus%keep_kind(set_kind%labelled)
      if (only == 'labelled') corpus%share_of_holes = 0
      if (only == 'holes') corpus%share_of_holes = 1
      n_text = min(n_text, corpus%n)
      write (output_unit, '(a,i0,a,i0,a)') 'fuzz: ', n_text, ' sets of files and ', corpus%n - n_text, &
         ' that the program made of them'
   end subroutine collect

   !> HDF5 makes its types when it is first used; here, so that not each child has to.
   subroutine wake_library()
      type(hdf5_file_type) :: file
      type(error_type), allocatable :: error
      call file%create(work//'/first.h5', error)
      if (.not. allocated(error)) call file%close(error)
      call remove_file(work//'/first.h5')
   end subroutine wake_library

   !> What came out.
   subroutine tell(totals)
      integer, intent(in) :: totals(:)
      integer :: i
      write (output_unit, '(a,i0,a,i0,a,i0,a,f0.1,a)') 'fuzz: seed ', seed, ', ', totals(7), ' inputs, ', totals(8), &
         ' failures, ', children_seconds(), ' s of processor time'
      write (output_unit, '(a,6(1x,i0,a,i0,:,","))') 'fuzz: commands by exit code:', (i, ' × ', totals(i + 1), i=0, 5)
      if (totals(8) > 0) write (output_unit, '(a)') 'fuzz: see '//work//'/failures'
      flush (output_unit)
   end subroutine tell

   !> The command line.
   subroutine read_options()
      character(len=:), allocatable :: name, value
      integer :: i
      inputs = ''; bad = ''; shared = ''; work = 'fuzz_work'; kept = 'failures'; only = ''
      n = 1000
      seed = 1
      jobs = 2
      first = 1
      i = 1
      do while (i < command_argument_count())
         name = argument(i)
         value = argument(i + 1)
         i = i + 2
         select case (name)
         case ('--inputs'); inputs = value
         case ('--bad'); bad = value
         case ('--shared'); shared = value
         case ('--work'); work = value
         case ('--keep'); kept = value
         case ('--n'); n = whole(name, value)
         case ('--only')
            only = value
            if (only /= 'labelled' .and. only /= 'holes') then
               write (error_unit, '(a)') 'fuzz: --only takes: labelled, holes'
               call leave(2)
            end if
         case ('--seed'); seed = whole(name, value)
         case ('--jobs'); jobs = max(1, whole(name, value))
         case ('--first'); first = whole(name, value)
         case ('--seconds'); limits%seconds = whole(name, value)
         case ('--megabytes'); limits%megabytes = whole(name, value)
         case default
            write (error_unit, '(a)') 'fuzz: unknown option '//name
            call leave(2)
         end select
      end do
      if (i == command_argument_count()) then
         write (error_unit, '(a)') 'fuzz: option without a value: '//argument(i)
         call leave(2)
      end if
      if (get_path_kind(shared) /= path_kind%directory) shared = ''
   end subroutine read_options

   !> Word i of the command line.
   function argument(i) result(text)
      integer, intent(in) :: i
      character(len=:), allocatable :: text
      integer :: length
      call get_command_argument(i, length=length)
      allocate (character(len=length) :: text)
      call get_command_argument(i, text)
   end function argument

   !> The whole number that an option takes.
   integer function whole(name, value)
      character(len=*), intent(in) :: name, value
      integer :: status
      read (value, *, iostat=status) whole
      if (status == 0) return
      write (error_unit, '(a)') 'fuzz: '//name//' takes a whole number'
      call leave(2)
   end function whole

end program fuzz
