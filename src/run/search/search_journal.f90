! SPDX-License-Identifier: MIT
!> The trials of a search on disk, so that a search that was stopped or killed continues where it was.
!>
!> Two files with the name of the results and the first digits of the digest of model and search, in the folder of the
!> results: STEM.fos-12345678.ckpt.h5 is a checkpoint of the settled state, STEM.fos-12345678.txt has a line for each
!> finished trial. A line counts when its number of words and its end are right: the last one may be cut off.
module rockdda_run_search_journal
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type
   use rockdda_base_strings, only : to_string, to_exact_string
   use rockdda_base_version, only : build_description
   use rockdda_model_parameters, only : parameters_type
   use rockdda_io_digest, only : digest_of_text, digest_length, hexadecimal
   use rockdda_io_file_sink, only : file_sink_type
   use rockdda_io_posix, only : get_path_kind, path_kind, remove_file
   use rockdda_io_checkpoint, only : checkpoint_path
   use rockdda_run_input, only : model_input_type
   use rockdda_run_search_options, only : search_options_type, search_names
   use rockdda_run_trial, only : trial_type
   implicit none
   private
   public :: search_journal_type, search_digest

   character(len=*), parameter :: head = 'rockdda search, trials: value stable decided steps '// &
                                         'beginning unbalanced displacement pull limit shear inside unused '// &
                                         'seconds, then the blocks of the mechanism with their motion, the '// &
                                         'share of the joints '// &
                                         'of each material that is open, and force, use and state of each support'

   type :: search_journal_type
      character(len=:), allocatable :: stem       !! of both files
      logical :: is_kept = .true.                 !! false: the folder cannot be written
      real(wp) :: strength = 1                    !! of the searched joints in the settled state, times their own
   contains
      procedure :: results
      procedure :: has_state
      procedure :: begin
      procedure :: add
      procedure :: read => read_journal
      procedure :: remove
      procedure, private :: path
   end type search_journal_type

contains

   !> Eight digits that belong to a model, with the files that it reads, and to a search.
   function search_digest(input, options) result(digits)
      type(model_input_type), intent(in) :: input
      type(search_options_type), intent(in) :: options
      character(len=8) :: digits
      character(len=2*digest_length) :: digest
      digest = hexadecimal(digest_of_text(input%model_text//achar(0)//input%analysis_text//achar(0)// &
         input%config_text//achar(0)//build_description()//achar(0)//search_names(options%kind)//achar(0)// &
         options%joints//achar(0)//options%loads//achar(0)//options%factors//achar(0)// &
         options%stage//achar(0)//to_string(options%max_steps)//achar(0)// &
         input%parameters%solver_method//achar(0)//water_text(input%parameters)))
      digits = digest(1:8)
   end function search_digest

   !> Pressures of water at points, which stand in files of their own.
   pure function water_text(parameters) result(text)
      type(parameters_type), intent(in) :: parameters
      character(len=:), allocatable :: text
      integer :: g, i
      text = ''
      if (.not. allocated(parameters%water)) return
      do g = 1, size(parameters%water)
         if (.not. allocated(parameters%water(g)%pressure)) cycle
         associate (points => parameters%water(g)%pressure)
            do i = 1, size(points, 2)
               text = text//to_exact_string(points(1, i))//' '//to_exact_string(points(2, i))//' '// &
                      to_exact_string(points(3, i))//new_line('a')
            end do
         end associate
      end do
   end function water_text

   !> The results of which the checkpoint of the settled state would be the checkpoint; they are never written.
   pure function results(self) result(path)
      class(search_journal_type), intent(in) :: self
      character(len=:), allocatable :: path
      path = self%stem//'.h5'
   end function results

   !> Path of the list of trials.
   pure function path(self)
      class(search_journal_type), intent(in) :: self
      character(len=:), allocatable :: path
      path = self%stem//'.txt'
   end function path

   !> Is there a settled state and a list of trials?
   logical function has_state(self)
      class(search_journal_type), intent(in) :: self
      has_state = get_path_kind(checkpoint_path(self%results())) == path_kind%file
      if (has_state) has_state = get_path_kind(self%path()) == path_kind%file
   end function has_state

   !> Begin an empty list.
   subroutine begin(self, error)
      class(search_journal_type), intent(in) :: self
      type(error_type), allocatable, intent(out) :: error
      type(file_sink_type) :: sink
      call sink%open(self%path(), error)
      if (.not. allocated(error)) call sink%put(head//new_line('a')//to_exact_string(self%strength)// &
                                                 ' times the strength'//new_line('a'), error)
      if (.not. allocated(error)) call sink%close(error, sync=.true.)
   end subroutine begin

   !> Add a finished trial.
   subroutine add(self, trial, error)
      class(search_journal_type), intent(in) :: self
      type(trial_type), intent(in) :: trial
      type(error_type), allocatable, intent(out) :: error
      type(file_sink_type) :: sink
      character(len=:), allocatable :: line
      integer :: i, n
      n = 0
      if (allocated(trial%mechanism%blocks)) n = size(trial%mechanism%blocks)
      line = to_exact_string(trial%value)//' '//merge('1 ', '0 ', trial%stable)//merge('1 ', '0 ', trial%decided)// &
             to_string(trial%steps)//' '//to_string(trial%beginning)//' '// &
             to_exact_string(trial%unbalanced)//' '//to_exact_string(trial%displacement)//' '// &
             to_exact_string(trial%pull)//' '//to_exact_string(trial%limit)//' '//to_exact_string(trial%shear)//' '// &
             to_exact_string(trial%inside)//' '//to_string(trial%unused)//' '// &
             to_exact_string(trial%seconds)//' '//to_string(n)
      do i = 1, n
         line = line//' '//to_string(trial%mechanism%blocks(i))//' '//to_string(trial%mechanism%kinds(i))
      end do
      line = line//' '//to_string(size(trial%open))
      do i = 1, size(trial%open)
         line = line//' '//to_exact_string(trial%open(i))
      end do
      line = line//' '//to_string(size(trial%supports))
      do i = 1, size(trial%supports)
         associate (one => trial%supports(i))
            line = line//' '//to_exact_string(one%force)//' '//to_exact_string(one%use)//' '//to_string(one%state)
         end associate
      end do
      if (.not. self%is_kept) return
      call sink%open(self%path(), error, append=.true.)
      if (.not. allocated(error)) call sink%put(line//' end'//new_line('a'), error)
      if (.not. allocated(error)) call sink%close(error, sync=.true.)
   end subroutine add

   !> Read the strength of the settled state and the finished trials.
   subroutine read_journal(self, trials)
      class(search_journal_type), intent(inout) :: self
      type(trial_type), allocatable, intent(out) :: trials(:)
      character(len=100000) :: line
      integer :: unit, status
      type(trial_type) :: trial
      logical :: ok
      allocate (trials(0))
      open (newunit=unit, file=self%path(), status='old', action='read', iostat=status)
      if (status /= 0) return
      read (unit, '(a)', iostat=status) line
      if (status == 0) read (unit, *, iostat=status) self%strength
      do while (status == 0)
         read (unit, '(a)', iostat=status) line
         if (status /= 0) exit
         call take_line(trim(line), trial, ok)
         if (ok) trials = [trials, trial]
      end do
      close (unit)
   end subroutine read_journal

   !> One line as a trial.
   subroutine take_line(line, trial, ok)
      character(len=*), intent(in) :: line
      type(trial_type), intent(out) :: trial
      logical, intent(out) :: ok
      real(wp), allocatable :: numbers(:)
      integer :: i, k, last, status
      ok = .false.
      if (len(line) < 4) return
      if (line(len(line) - 3:) /= ' end') return
      allocate (numbers(count([(line(i:i) == ' ', i=1, len(line))])))
      read (line, *, iostat=status) numbers
      if (status /= 0) return
      last = 0
      trial%value = next()
      trial%stable = next() > 0
      trial%decided = next() > 0
      trial%steps = nint(next())
      trial%beginning = nint(next())
      trial%unbalanced = next()
      trial%displacement = next()
      trial%pull = next()
      trial%limit = next()
      trial%shear = next()
      trial%inside = next()
      trial%unused = nint(next())
      trial%seconds = next()
      allocate (trial%mechanism%blocks(n_items()))
      allocate (trial%mechanism%kinds(size(trial%mechanism%blocks)))
      do k = 1, size(trial%mechanism%blocks)
         trial%mechanism%blocks(k) = nint(next())
         trial%mechanism%kinds(k) = nint(next())
      end do
      allocate (trial%open(n_items()))
      do k = 1, size(trial%open)
         trial%open(k) = next()
      end do
      allocate (trial%supports(n_items()))
      do k = 1, size(trial%supports)
         trial%supports(k)%force = next()
         trial%supports(k)%use = next()
         trial%supports(k)%state = nint(next())
      end do
      ok = last == size(numbers)

   contains

      !> The next number; 0 behind the last one.
      real(wp) function next()
         last = last + 1
         next = 0
         if (last <= size(numbers)) next = numbers(last)
      end function next

      !> The next number as one of items that follow.
      integer function n_items()
         n_items = max(0, min(nint(next()), size(numbers)))
      end function n_items

   end subroutine take_line

   !> Remove both files.
   subroutine remove(self)
      class(search_journal_type), intent(in) :: self
      call remove_file(checkpoint_path(self%results()))
      call remove_file(self%path())
   end subroutine remove

end module rockdda_run_search_journal
