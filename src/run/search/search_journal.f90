! SPDX-License-Identifier: MIT
!> The trials of a search on disk, so that a search that was stopped or killed continues where it was.
!>
!> Two files with the name of the results and the first digits of the digest of the search's options, in the folder of
!> the results: STEM.fos-12345678.ckpt.h5 is a checkpoint of the settled state, STEM.fos-12345678.txt has a line for
!> each finished trial. It begins with the digest of the model, with which a line ends: those of another model do not
!> count, and neither does one that was cut off. The same search of an edited model takes the files over.
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
   public :: search_journal_type, new_journal

   type :: search_journal_type
      character(len=:), allocatable :: stem       !! of both files
      character(len=16) :: model = ''             !! digits that belong to a model, with the files that it reads
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

   !> Length of a line; a block of the mechanism takes 24, a support 62.
   integer, parameter :: line_length = 1000000

contains

   !> The journal of a search beside results of this stem.
   type(search_journal_type) function new_journal(stem, input, options) result(journal)
      character(len=*), intent(in) :: stem
      type(model_input_type), intent(in) :: input
      type(search_options_type), intent(in) :: options
      character(len=2*digest_length) :: digest
      digest = hexadecimal(digest_of_text(search_names(options%kind)//achar(0)//options%joints//achar(0)// &
         options%loads//achar(0)//options%factors//achar(0)//options%stage//achar(0)//to_string(options%max_steps)))
      journal%stem = stem//'.fos-'//digest(1:8)
      digest = hexadecimal(digest_of_text(input%model_text//achar(0)//input%analysis_text//achar(0)// &
         input%config_text//achar(0)//build_description()//achar(0)//input%parameters%solver_method//achar(0)// &
         water_text(input%parameters)))
      journal%model = digest(:len(journal%model))
   end function new_journal

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

   !> Is there a settled state of this model, and a list of trials?
   logical function has_state(self)
      class(search_journal_type), intent(in) :: self
      character(len=len(self%model)) :: model
      integer :: unit, status
      has_state = get_path_kind(checkpoint_path(self%results())) == path_kind%file
      if (.not. has_state) return
      open (newunit=unit, file=self%path(), status='old', action='read', iostat=status)
      has_state = status == 0
      if (.not. has_state) return
      read (unit, '(a)', iostat=status) model
      close (unit)
      has_state = status == 0 .and. model == self%model
   end function has_state

   !> Begin an empty list.
   subroutine begin(self, error)
      class(search_journal_type), intent(in) :: self
      type(error_type), allocatable, intent(out) :: error
      type(file_sink_type) :: sink
      call sink%open(self%path(), error)
      if (.not. allocated(error)) call sink%put(self%model//' rockdda search, trials'//new_line('a')// &
                                                to_exact_string(self%strength)//' times the strength'//new_line('a'), &
                                                error)
      if (.not. allocated(error)) call sink%close(error, sync=.true.)
   end subroutine begin

   !> Add a finished trial: numbers of its blocks, joint materials and supports, its facts, and those.
   subroutine add(self, trial, error)
      class(search_journal_type), intent(in) :: self
      type(trial_type), intent(in) :: trial
      type(error_type), allocatable, intent(out) :: error
      type(file_sink_type) :: sink
      character(len=line_length) :: line
      integer :: status
      if (.not. self%is_kept) return
      if (allocated(trial%mechanism%blocks)) then
         write (line, *, iostat=status) size(trial%mechanism%blocks), size(trial%open), size(trial%supports), &
            trial%trial_facts_type, trial%mechanism%blocks, trial%mechanism%kinds, trial%open, trial%supports
      else
         write (line, *, iostat=status) 0, size(trial%open), size(trial%supports), trial%trial_facts_type, trial%open, &
            trial%supports
      end if
      if (status /= 0) return   ! too long: it would be computed again
      call sink%open(self%path(), error, append=.true.)
      if (.not. allocated(error)) call sink%put(trim(line)//' '//self%model//new_line('a'), error)
      if (.not. allocated(error)) call sink%close(error, sync=.true.)
   end subroutine add

   !> Read the strength of the settled state and the finished trials.
   subroutine read_journal(self, trials)
      class(search_journal_type), intent(inout) :: self
      type(trial_type), allocatable, intent(out) :: trials(:)
      character(len=line_length + len(self%model) + 1) :: line
      integer :: unit, status, n
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
         n = len_trim(line) - len(self%model)
         if (n < 1) cycle
         if (line(n + 1:) /= self%model) cycle
         call take_line(line(:n), trial, ok)
         if (ok) trials = [trials, trial]
      end do
      close (unit)
   end subroutine read_journal

   !> One line as a trial.
   subroutine take_line(line, trial, ok)
      character(len=*), intent(in) :: line
      type(trial_type), intent(out) :: trial
      logical, intent(out) :: ok
      integer :: n(3), status
      read (line, *, iostat=status) n
      ok = status == 0 .and. all(n >= 0) .and. all(n <= len(line))
      if (.not. ok) return
      allocate (trial%mechanism%blocks(n(1)), trial%mechanism%kinds(n(1)), trial%open(n(2)), trial%supports(n(3)))
      read (line, *, iostat=status) n, trial%trial_facts_type, trial%mechanism%blocks, trial%mechanism%kinds, &
         trial%open, trial%supports
      ok = status == 0
   end subroutine take_line

   !> Remove both files.
   subroutine remove(self)
      class(search_journal_type), intent(in) :: self
      call remove_file(checkpoint_path(self%results()))
      call remove_file(self%path())
   end subroutine remove

end module rockdda_run_search_journal
