! SPDX-License-Identifier: MIT
!> One input of the fuzzer: spoiled files, the commands that are to digest them, and what went wrong.
module fuzz_trial
   use, intrinsic :: iso_c_binding, only : c_int32_t
   use fuzz_corpus, only : corpus_type, file_type, set_type, set_kind
   use fuzz_holes, only : draw_holes
   use fuzz_mutations, only : mutate_text, mutate_bytes
   use fuzz_random, only : random_type, new_random
   use fuzz_system, only : fork_child, limit_child, wait_for_child, leave, enter_folder, clear_folder, read_text, &
                           write_text
   use rockdda_base_error, only : error_type
   use rockdda_io_posix, only : get_path_kind, path_kind
   use rockdda_io_recognise, only : recognise, file_kind
   use rockdda_app_command_options, only : command_names
   use rockdda_app_process, only : argument_type, start_process, end_process
   use rockdda_app_program, only : run_program
   implicit none
   private
   public :: trial_type, limits_type, make_trial, execute, minimise, command_lines, n_slots

   !> Commands of a trial at most, and numbers that a child reports: their exit codes, and whether the files are of
   !> the kinds that a run takes.
   integer, parameter :: most_commands = 6, n_slots = most_commands + 1

   type :: command_type
      type(argument_type), allocatable :: arguments(:)
      integer :: n = 0
   end type command_type

   type :: trial_type
      type(set_type) :: set
      type(command_type) :: commands(most_commands)
      integer :: n_commands = 0
      logical :: spoiled_output = .false.      !! the output cannot be written, as chance will have it
   end type trial_type

   type :: limits_type
      integer :: seconds = 10          !! processor time of a trial
      integer :: megabytes = 512       !! memory beyond that of the fuzzer; 0: any
      integer :: steps = 3
   end type limits_type

   !> A program that is in order never says these.
   character(len=*), parameter :: alarming(18) = [character(len=24) :: &
      'At line ', 'Fortran runtime', 'forrtl', 'Error termination', 'Backtrace for', 'AddressSanitizer', &
      'LeakSanitizer', 'runtime error:', 'internal error', 'HDF5-DIAG', 'corrupted', 'free():', 'libgomp:', &
      'On entry to', 'parameter number', 'CHOLMOD error', 'terminate called', 'stack smashing']

contains

   !> Input number `index`.
   subroutine make_trial(corpus, limits, seed, index, trial)
      type(corpus_type), intent(in) :: corpus
      type(limits_type), intent(in) :: limits
      integer, intent(in) :: seed, index
      type(trial_type), intent(out) :: trial
      type(random_type) :: random
      character(len=:), allocatable :: other
      integer :: k
      random = new_random(seed, index)
      if (random%chance(corpus%share_of_holes)) then
         call plan_holes(random, trial)
         return
      end if
      trial%set = corpus%sets(corpus%pick(random))
      associate (set => trial%set)
         do
            k = 1 + random%below(set%n)
            other = corpus%any_text(random)
            if (set%kind == set_kind%results) then
               call mutate_bytes(random, set%files(k)%text, other)
            else
               call mutate_text(random, set%files(k)%text, other)
            end if
            if (.not. random%chance(0.15d0)) exit
         end do
      end associate
      select case (trial%set%kind)
      case (1); call plan_model(random, limits, trial)
      case (2); call plan_single(random, limits, trial)
      case (set_kind%labelled); call plan_labelled(random, limits, trial)
      case default; call plan_results(trial)
      end select
   end subroutine make_trial

   !> A block with many holes, spoiled in some cases: cut twice, it gives the same file.
   subroutine plan_holes(random, trial)
      type(random_type), intent(inout) :: random
      type(trial_type), intent(inout) :: trial
      trial%set%kind = set_kind%single
      trial%set%n = 1
      allocate (trial%set%files(1))
      trial%set%files(1)%name = 'holes.dc'
      trial%set%files(1)%text = draw_holes(random)
      if (random%chance(0.2d0)) call mutate_text(random, trial%set%files(1)%text, draw_holes(random))
      call put(trial, 'cut|holes.dc|-o|out.blk')
      call put(trial, 'cut|holes.dc|-o|again.blk')
      call put(trial, 'check|out.blk')
   end subroutine plan_holes

   !> Commands on the files of a model.
   subroutine plan_model(random, limits, trial)
      type(random_type), intent(inout) :: random
      type(limits_type), intent(in) :: limits
      type(trial_type), intent(inout) :: trial
      character(len=12) :: steps
      character(len=:), allocatable :: model, analysis, more
      write (steps, '(i0)') limits%steps
      model = trial%set%files(1)%name
      analysis = trial%set%files(2)%name
      select case (random%below(8))
      case (0)
         call put(trial, 'cut|'//model//'|-o|out.blk')
         call put(trial, 'check|out.blk|--quiet')
         call put(trial, 'info|out.blk')
      case (1)
         more = ''
         if (trial%set%config > 0) more = '|'//trial%set%files(trial%set%config)%name
         call put(trial, 'info|'//model//'|'//analysis//more//'|--json')
      case (2)
         ! the folder, in which options and tables are found
         call put(trial, 'check|.|--json')
         call put(trial, 'run|.|-o|out.h5|--steps|'//trim(steps)//'|--max-wall|3')
         call put(trial, 'info|out.h5')
      case default
         more = ''
         if (trial%set%config > 0) more = '|'//trial%set%files(trial%set%config)%name
         call put(trial, 'check|'//model//'|'//analysis//more)
         if (trial%set%config > 0) more = '|--config'//more
         if (random%chance(0.2d0)) call spoil_options(random, trial, more)
         call put(trial, 'run|'//model//'|'//analysis//more//'|-o|out.h5|--quiet|--json|--steps|'//trim(steps)// &
                  '|--max-wall|3')
         call put(trial, 'info|out.h5|--json')
      end select
   end subroutine plan_model

   !> Commands on a labelled file.
   subroutine plan_labelled(random, limits, trial)
      type(random_type), intent(inout) :: random
      type(limits_type), intent(in) :: limits
      type(trial_type), intent(inout) :: trial
      character(len=*), parameter :: searches(4) = [character(len=8) :: 'strength', 'tilt', 'push', 'gravity']
      character(len=12) :: steps
      character(len=:), allocatable :: name
      ! some get as far as their later stages
      write (steps, '(i0)') merge(15*limits%steps, limits%steps, random%chance(0.15d0))
      name = trial%set%files(1)%name
      ! most mistakes are found without a step, for a tenth of the time
      select case (random%below(20))
      case (0:2)
         call put(trial, 'check|--as-namelist|'//name)
         call put(trial, 'info|'//name//'|--json')
      case (3:8)
         call put(trial, 'check|'//name//'|--json')
      case (9)
         call put(trial, 'check|.|--json')
         call put(trial, 'run|.|-o|out.h5|--quiet|--steps|'//trim(steps)//'|--max-wall|3')
      case (10)
         ! a search takes models without an end, and refuses some that run
         trial%spoiled_output = .true.
         call put(trial, 'check|'//name)
         call put(trial, 'fos|'//name//'|-o|out.h5|--quiet|--json|--max-steps|20|--tolerance|2|--max-wall|3'// &
                  '|--search|'//trim(searches(1 + random%below(4))))
         call put(trial, 'info|out.h5|--json')
      case (11:13)
         call put(trial, 'check|'//name)
         call put(trial, 'run|'//name//'|-o|out.h5|--quiet|--json|--steps|'//trim(steps)//'|--max-wall|3')
         call put(trial, 'resume|out.ckpt.h5|--quiet|--json|--steps|'//trim(steps)//'|--max-wall|3')
      case default
         call put(trial, 'check|'//name)
         call put(trial, 'run|'//name//'|-o|out.h5|--quiet|--json|--steps|'//trim(steps)//'|--max-wall|3')
         call put(trial, 'info|out.h5|--json')
      end select
   end subroutine plan_labelled

   !> Options of the command line that nobody would give.
   subroutine spoil_options(random, trial, more)
      type(random_type), intent(inout) :: random
      type(trial_type), intent(inout) :: trial
      character(len=:), allocatable, intent(inout) :: more
      character(len=*), parameter :: options(24) = [character(len=40) :: '--solver|sor', '--solver|pcg', &
         '--solver|dense', '--solver|cholmod', '--solver|magic', '--solver|', '--threads|1000000000', '--threads|0', &
         '--t-end|1e308', '--t-end|1e-300', '--t-end|nan', '--t-end|-1', '--save-every|2147483648', &
         '--save-every|1000000000', '--max-wall|1e308', '--max-wall|1e-9', '--checkpoint-every|1e-300', &
         '--dialect|g0', '--dialect|peer', '--dialect|', '--', '--config|.', '--config|/dev/null', '--steps=1e3']
      integer :: i
      ! check does not see these options: no comparison of the two
      trial%n_commands = 0
      trial%spoiled_output = .true.
      i = 1 + random%below(size(options))
      more = more//'|'//trim(options(i))
   end subroutine spoil_options

   !> Commands on one file, sometimes under a name that misleads.
   subroutine plan_single(random, limits, trial)
      type(random_type), intent(inout) :: random
      type(limits_type), intent(in) :: limits
      type(trial_type), intent(inout) :: trial
      character(len=*), parameter :: endings(8) = [character(len=4) :: '.dc', '.df', '.blk', '.nml', '.dl', '.csv', &
                                                   '.h5', '']
      character(len=:), allocatable :: name
      character(len=12) :: steps
      integer :: i
      i = 1 + random%below(size(endings))
      if (random%chance(0.2d0)) trial%set%files(1)%name = 'file'//trim(endings(i))
      name = trial%set%files(1)%name
      call put(trial, 'check|'//name)
      call put(trial, 'info|'//name//'|--json')
      if (index(name, '.dc') + index(name, '.geo') > 0) call put(trial, 'cut|'//name//'|-o|out.blk')
      if (index(name, '.dl') > 0 .and. any(command_names == 'lines')) &
         call put(trial, 'lines|'//name//'|-o|out.dc|--seed|1')
      write (steps, '(i0)') limits%steps
      if (random%chance(0.1d0)) &
         call put(trial, 'run|'//name//'|'//name//'|-o|out.h5|--max-wall|3|--steps|'//trim(steps))
   end subroutine plan_single

   !> Commands on the HDF5 files of a run.
   subroutine plan_results(trial)
      type(trial_type), intent(inout) :: trial
      integer :: i
      do i = 1, min(trial%set%n, 2)
         associate (name => trial%set%files(i)%name)
            call put(trial, 'info|'//name)
            call put(trial, 'check|'//name//'|--json')
            if (index(name, '.ckpt.h5') > 0 .and. any(command_names == 'resume')) &
               call put(trial, 'resume|'//name//'|--steps|2|--max-wall|3')
         end associate
      end do
   end subroutine plan_results

   !> One more command, its words between bars.
   subroutine put(trial, words)
      type(trial_type), intent(inout) :: trial
      character(len=*), intent(in) :: words
      type(command_type) :: command
      integer :: first, length
      allocate (command%arguments(count([(words(first:first) == '|', first=1, len(words))]) + 1))
      first = 1
      do while (first <= len(words) + 1)
         length = index(words(first:)//'|', '|') - 1
         command%n = command%n + 1
         command%arguments(command%n)%text = words(first:first + length - 1)
         first = first + length + 1
      end do
      trial%n_commands = trial%n_commands + 1
      trial%commands(trial%n_commands) = command
   end subroutine put

   !> The commands as one would type them.
   function command_lines(trial) result(text)
      type(trial_type), intent(in) :: trial
      character(len=:), allocatable :: text
      integer :: i, k
      text = ''
      do i = 1, trial%n_commands
         text = text//'rockdda'
         do k = 1, trial%commands(i)%n
            text = text//' '//trial%commands(i)%arguments(k)%text
         end do
         text = text//new_line('a')
      end do
   end function command_lines

   !> Do the commands in a child in this folder. `failure` says what is wrong with how that went, '' when all is well.
   subroutine execute(trial, folder, limits, slots, failure)
      type(trial_type), intent(in) :: trial
      character(len=*), intent(in) :: folder           !! there must be the folder `files` in it
      type(limits_type), intent(in) :: limits
      integer(c_int32_t), pointer, intent(in) :: slots(:)   !! (n_slots) shared memory: exit codes of the commands
      character(len=:), allocatable, intent(out) :: failure
      integer :: i, child, ended
      call clear_folder(folder//'/files')
      do i = 1, trial%set%n
         call write_text(folder//'/files/'//trial%set%files(i)%name, trial%set%files(i)%text)
      end do
      slots = -1
      child = fork_child()
      if (child == 0) call digest(trial, folder, limits, slots)
      failure = 'no process could be made'
      if (child < 0) return
      ended = wait_for_child(child)
      failure = judge(trial, folder, slots, ended)
   end subroutine execute

   !> The child. Does not return.
   subroutine digest(trial, folder, limits, slots)
      type(trial_type), intent(in) :: trial
      character(len=*), intent(in) :: folder
      type(limits_type), intent(in) :: limits
      integer(c_int32_t), pointer, intent(in) :: slots(:)
      type(error_type), allocatable :: error
      integer :: i, code, kinds(2)
      logical :: ok
      call limit_child(folder//'/output.txt', limits%seconds, 30*limits%seconds, limits%megabytes)
      call enter_folder(folder//'/files', ok)
      if (.not. ok) call leave(99)
      call start_process()
      kinds = 0
      if (trial%set%kind == set_kind%model) then
         do i = 1, 2
            call recognise(trial%set%files(i)%name, kinds(i), error)
         end do
      end if
      slots(n_slots) = 0
      if ((kinds(1) == file_kind%geometry .or. kinds(1) == file_kind%blocks) .and. kinds(2) == file_kind%analysis) &
         slots(n_slots) = 1
      if (trial%set%kind == set_kind%labelled) then
         call recognise(trial%set%files(1)%name, kinds(1), error)
         if (kinds(1) == file_kind%labelled) slots(n_slots) = 1
      end if
      if (trial%set%config > 0) then
         call recognise(trial%set%files(trial%set%config)%name, kinds(1), error)
         if (kinds(1) /= file_kind%options) slots(n_slots) = 0
      end if
      do i = 1, trial%n_commands
         ! what was not written cannot be read
         if (i > 1 .and. names_output(trial%commands(i))) then
            if (get_path_kind(trial%commands(i)%arguments(2)%text) /= path_kind%file) cycle
         end if
         call run_program(trial%commands(i)%arguments(1:trial%commands(i)%n), code)
         slots(i) = int(code, c_int32_t)
      end do
      call end_process(0)
      call leave(98)
   end subroutine digest

   !> Does this command read what another has written?
   pure logical function names_output(command)
      type(command_type), intent(in) :: command
      names_output = any(command%arguments(2)%text == [character(len=11) :: 'out.h5', 'out.ckpt.h5', 'out.blk'])
   end function names_output

   !> What is wrong with how a trial ended; '' for nothing.
   function judge(trial, folder, slots, ended) result(failure)
      type(trial_type), intent(in) :: trial
      character(len=*), intent(in) :: folder
      integer(c_int32_t), intent(in) :: slots(:)
      integer, intent(in) :: ended
      character(len=:), allocatable :: failure
      character(len=:), allocatable :: output
      character(len=12) :: number
      integer :: i, checked, ran
      logical :: written
      failure = ''
      if (ended == 1014 .or. ended == 1024) failure = 'hang'
      if (len(failure) > 0) return
      output = read_text(folder//'/output.txt')
      do i = 1, size(alarming)
         if (index(output, trim(alarming(i))) == 0) cycle
         failure = 'output: '//trim(alarming(i))
         return
      end do
      ! HDF5 crashed in a damaged file that a child process had been able to read: the process ends, and says so
      if (ended == 2 .and. trial%set%kind == set_kind%results .and. index(output, 'HDF5 cannot read it') > 0) return
      if (ended > 1000) then
         write (number, '(i0)') ended - 1000
         failure = 'signal '//trim(number)
      else if (ended /= 0) then
         write (number, '(i0)') ended
         failure = 'the process ended with '//trim(number)
      else if (len(output) > 2000000) then
         failure = 'too much output'
      end if
      if (len(failure) > 0) return
      checked = -1
      ran = -1
      do i = 1, trial%n_commands
         associate (command => trial%commands(i)%arguments(1)%text, code => slots(i))
            write (number, '(i0)') code
            select case (command)
            case ('check')
               if (checked == -1) checked = code
               if (all(code /= [-1, 0, 2])) failure = 'check gives '//trim(number)
            case ('info', 'cut', 'lines')
               if (all(code /= [-1, 0, 2])) failure = command//' gives '//trim(number)
            case default
               ran = code
               if (all(code /= [-1, 0, 2, 3, 4])) failure = command//' gives '//trim(number)
            end select
            if (i > 1 .and. code == 2 .and. names_output(trial%commands(i))) &
               failure = command//' refuses what the program wrote'
         end associate
      end do
      if (len(failure) > 0) return
      if (get_path_kind(folder//'/files/again.blk') == path_kind%file) then
         if (read_text(folder//'/files/again.blk') /= read_text(folder//'/files/out.blk')) &
            failure = 'the same geometry gives other blocks'
      end if
      written = get_path_kind(folder//'/files/out.h5') == path_kind%file
      if (ran == 2 .and. written) then
         failure = 'refused, but something was written'
      else if (ran == 0 .and. index(output, 'NaN') > 0) then
         failure = 'NaN in the summary'
      else if (slots(n_slots) == 1 .and. trial%n_commands > 1 .and. checked >= 0 .and. .not. trial%spoiled_output) then
         if (checked == 0 .and. ran == 2) failure = 'run refuses what check accepts'
         ! the end of a labelled run may stand on the command line of run alone
         if (checked == 2 .and. any(ran == [0, 3, 4]) .and. index(output, 'the run has no end') == 0) &
            failure = 'run accepts what check refuses'
      end if
   end function judge

   !> Remove lines of the files as long as the failure stays; a limited number of attempts.
   subroutine minimise(trial, folder, limits, slots, failure, attempts)
      type(trial_type), intent(inout) :: trial
      character(len=*), intent(in) :: folder, failure
      type(limits_type), intent(in) :: limits
      integer(c_int32_t), pointer, intent(in) :: slots(:)
      integer, intent(in) :: attempts
      type(trial_type) :: smaller
      character(len=:), allocatable :: other, separators
      integer :: k, pass, left, pieces, piece, first, last, length
      left = attempts
      do pass = 1, 2
         separators = merge(new_line('a'), ' ', pass == 1)
         do k = 1, trial%set%n
            pieces = 2
            do while (left > 0 .and. pieces <= min(2000, 2*len(trial%set%files(k)%text)))
               piece = 0
               do while (piece < pieces .and. left > 0)
                  length = len(trial%set%files(k)%text)
                  first = cut_at(trial%set%files(k)%text, int(real(length)*piece/pieces))
                  last = cut_at(trial%set%files(k)%text, int(real(length)*(piece + 1)/pieces))
                  piece = piece + 1
                  if (last <= first) cycle
                  smaller = trial
                  smaller%set%files(k)%text = trial%set%files(k)%text(1:first)//trial%set%files(k)%text(last + 1:)
                  left = left - 1
                  call execute(smaller, folder, limits, slots, other)
                  if (other /= failure) cycle
                  trial = smaller
                  piece = piece - 1
                  pieces = max(pieces - 1, 1)
               end do
               pieces = 2*pieces
            end do
         end do
      end do

   contains

      !> The place behind the next separator.
      integer function cut_at(text, place)
         character(len=*), intent(in) :: text
         integer, intent(in) :: place
         integer :: next
         cut_at = place
         if (place <= 0 .or. place >= len(text)) return
         next = scan(text(place:), separators)
         cut_at = merge(len(text), place + next - 1, next == 0)
      end function cut_at

   end subroutine minimise

end module fuzz_trial
