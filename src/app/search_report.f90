! SPDX-License-Identifier: MIT
!> What `rockdda fos` shows: its progress, and the factor as text and JSON.
module rockdda_app_search_report
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : to_string
   use rockdda_io_checkpoint, only : checkpoint_path
   use rockdda_run_factor_search, only : factor_search_type
   use rockdda_run_mechanism, only : kind_of
   use rockdda_run_input, only : model_input_type, run_name
   use rockdda_run_search_options, only : search_kind, search_names
   use rockdda_run_search_group, only : failing_trial
   use rockdda_run_trial, only : search_observer_type, trial_type
   use rockdda_app_arguments, only : command_line_type
   use rockdda_app_json, only : json_type
   use rockdda_app_process, only : print_error, print_line
   use rockdda_app_progress, only : progress_type
   use rockdda_app_stop_request, only : stop_request_type
   implicit none
   private
   public :: search_watch_type, print_factor, stem_of_search

   !> Largest number of blocks in a line.
   integer, parameter :: most_listed = 20

   !> Signals and progress of a search in a terminal.
   type, extends(search_observer_type) :: search_watch_type
      type(stop_request_type) :: request
      type(progress_type), pointer, private :: bar => null()
      logical, private :: quiet = .false.
   contains
      procedure :: begin
      procedure :: finish
      procedure :: is_requested
      procedure :: progress => show_progress
      procedure :: warn => show_warning
   end type search_watch_type

contains

   !> Stem of the files of a search: that of its results, or the name of the run.
   function stem_of_search(output, input) result(stem)
      character(len=*), intent(in) :: output            !! '': none
      type(model_input_type), intent(in) :: input
      character(len=:), allocatable :: stem
      stem = run_name(input)
      if (len(output) == 0) return
      stem = checkpoint_path(output)
      stem = stem(1:index(stem, '.ckpt.h5', back=.true.) - 1)
   end function stem_of_search

   !> Begin to show progress.
   subroutine begin(self, quiet)
      class(search_watch_type), intent(inout) :: self
      logical, intent(in) :: quiet
      self%quiet = quiet
      allocate (self%bar)
      call self%bar%begin(quiet)
   end subroutine begin

   !> End it.
   subroutine finish(self)
      class(search_watch_type), intent(inout) :: self
      if (.not. associated(self%bar)) return
      call self%bar%finish()
      deallocate (self%bar)
   end subroutine finish

   !> Has a signal arrived, or is the time over?
   logical function is_requested(self)
      class(search_watch_type), intent(in) :: self
      is_requested = self%request%is_requested()
   end function is_requested

   !> Show what is tried. Trials in several threads call this.
   subroutine show_progress(self, text)
      class(search_watch_type), intent(in) :: self
      character(len=*), intent(in) :: text
      if (self%quiet) return
      !$omp critical (rockdda_show_progress)
      call self%bar%update(0.0_wp, text)
      !$omp end critical (rockdda_show_progress)
   end subroutine show_progress

   !> Print a warning.
   subroutine show_warning(self, text)
      class(search_watch_type), intent(in) :: self
      character(len=*), intent(in) :: text
      if (.not. self%quiet) call print_error('rockdda: warning: '//text)
   end subroutine show_warning

   !> Print the factor.
   subroutine print_factor(line, search, output, ok)
      type(command_line_type), intent(in) :: line
      type(factor_search_type), intent(in) :: search
      character(len=*), intent(in) :: output            !! path of the results, '': none
      logical, intent(out) :: ok
      type(trial_type) :: failing
      character(len=:), allocatable :: text
      real(wp) :: factor
      integer :: i
      factor = middle(search)
      failing = failing_trial(search)
      if (line%json) then
         call print_json(search, failing, ok)
         return
      end if
      text = 'mechanism: '//kind_of(failing%mechanism)//' of '
      associate (blocks => failing%mechanism%blocks)
         text = text//trim(merge('block ', 'blocks', size(blocks) == 1))
         do i = 1, min(size(blocks), most_listed)
            text = text//trim(merge(' ', ',', i == 1))//' '//to_string(blocks(i))
         end do
         if (size(blocks) > most_listed) text = text//', ... ('//to_string(size(blocks))//' blocks)'
      end associate
      if (len(output) > 0) text = text//new_line('a')//'results of the failing trial: '//output
      text = text//new_line('a')//name_of(search%options%kind)//': '//decimals(factor, search%options%kind)// &
             ' (stable at '//decimals(search%state%stable, search%options%kind)//', fails at '// &
             decimals(search%state%failing, search%options%kind)//'; '//to_string(size(search%trials))//' trials)'
      call print_line(text, ok)
   end subroutine print_factor

   !> The searched quantity.
   pure function name_of(kind) result(name)
      integer, intent(in) :: kind
      character(len=:), allocatable :: name
      select case (kind)
      case (search_kind%tilt); name = 'critical tilt'
      case (search_kind%push); name = 'critical push'
      case (search_kind%gravity); name = 'critical gravity'
      case default; name = 'factor of safety'
      end select
   end function name_of

   !> A value with as many decimals as its tolerance deserves.
   pure function decimals(value, kind) result(text)
      real(wp), intent(in) :: value
      integer, intent(in) :: kind
      character(len=:), allocatable :: text
      character(len=24) :: buffer
      select case (kind)
      case (search_kind%tilt); write (buffer, '(f0.2)') value
      case (search_kind%push); write (buffer, '(f0.4)') value
      case default; write (buffer, '(f0.3)') value
      end select
      text = trim(adjustl(buffer))
      if (text(1:1) == '.') text = '0'//text
      if (index(text, '-.') == 1) text = '-0'//text(2:)
   end function decimals

   !> The middle between the stable and the failing value.
   pure real(wp) function middle(search)
      type(factor_search_type), intent(in) :: search
      real(wp) :: low
      low = min(search%state%stable, search%state%failing)
      middle = low + (max(search%state%stable, search%state%failing) - low)/2
   end function middle

   !> The search as JSON.
   subroutine print_json(search, failing, ok)
      type(factor_search_type), intent(in) :: search
      type(trial_type), intent(in) :: failing
      logical, intent(out) :: ok
      type(json_type) :: json
      integer :: i
      call json%open('{', '')
      call json%put('factor', middle(search))
      call json%put('low', min(search%state%stable, search%state%failing))
      call json%put('high', max(search%state%stable, search%state%failing))
      call json%put('search', trim(search_names(search%options%kind)))
      call json%put('settled_strength', search%strength)
      call json%open('[', 'trials')
      do i = 1, size(search%trials)
         associate (trial => search%trials(i))
            call json%open('{', '')
            call json%put('value', trial%value)
            call json%put('stable', trial%stable)
            call json%put('steps', trial%steps)
            call json%put('unbalanced', trial%unbalanced)
            call json%put('displacement', trial%displacement)
            call json%put('seconds', trial%seconds)
            call json%close('}')
         end associate
      end do
      call json%close(']')
      call json%open('{', 'mechanism')
      call json%open('[', 'blocks')
      do i = 1, size(failing%mechanism%blocks)
         call json%put('', failing%mechanism%blocks(i) - 1)
      end do
      call json%close(']')
      call json%put('kind', kind_of(failing%mechanism))
      call json%close('}')
      call json%close('}')
      call print_line(json%text, ok)
   end subroutine print_json

end module rockdda_app_search_report
