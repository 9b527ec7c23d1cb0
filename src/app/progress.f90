! SPDX-License-Identifier: MIT
!> Progress of a run on standard error: a bar with the remaining time on a terminal, otherwise one line at intervals.
module rockdda_app_progress
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : to_string
   use rockdda_io_timestamp, only : wall_seconds
   use rockdda_app_process, only : print_error, show_status, is_terminal
   implicit none
   private
   public :: progress_type

   integer, parameter :: bar_width = 30
   !> Seconds between updates on a terminal and elsewhere.
   real(wp), parameter :: terminal_interval = 0.2_wp, line_interval = 10
   !> Longer times that are left are not shown [s].
   real(wp), parameter :: longest_left = 1.0e8_wp

   type :: progress_type
      logical, private :: active = .false., terminal = .false., drawn = .false.
      real(wp), private :: start = 0, last = 0
      real(wp), private :: fraction = 0, reached = 0   !! of the run, and when it was reached [s]
   contains
      procedure :: begin
      procedure :: update
      procedure :: finish
   end type progress_type

contains

   !> Start the clock.
   subroutine begin(self, quiet)
      class(progress_type), intent(inout) :: self
      logical, intent(in) :: quiet
      self%active = .not. quiet
      self%terminal = is_terminal()
      self%drawn = .false.
      self%start = wall_seconds()
      self%last = self%start
      self%fraction = 0
      self%reached = self%start
   end subroutine begin

   !> Show the progress of the run, unless it has been shown within the interval.
   subroutine update(self, fraction, text)
      class(progress_type), intent(inout) :: self
      real(wp), intent(in) :: fraction          !! of the run, 0 … 1
      character(len=*), intent(in) :: text      !! for example "step 12, time 0.1"
      real(wp) :: now, left
      integer :: full
      character(len=:), allocatable :: tail
      if (.not. self%active) return
      now = wall_seconds()
      if (now - self%last < merge(terminal_interval, line_interval, self%terminal)) return
      self%last = now
      tail = text
      if (fraction > self%fraction) then
         self%fraction = fraction
         self%reached = now
      end if
      if (fraction > 0 .and. fraction < 1) then
         ! a stage until equilibrium does not know its end: the fraction stands until the next one
         left = (self%reached - self%start)*(1 - fraction)/fraction - (now - self%reached)
         if (left > 0 .and. left < longest_left) tail = tail//', '//duration(left)//' left'
      end if
      if (self%terminal) then
         full = nint(bar_width*min(1.0_wp, max(0.0_wp, fraction)))
         call show_status(achar(13)//'['//repeat('#', full)//repeat('.', bar_width - full)//'] '// &
                          percent(fraction)//'  '//tail//achar(27)//'[K')
         self%drawn = .true.
      else
         call print_error(percent(fraction)//'  '//tail)
      end if
   end subroutine update

   !> End the line of the bar on a terminal.
   subroutine finish(self)
      class(progress_type), intent(inout) :: self
      if (self%drawn) call show_status(achar(13)//achar(27)//'[K')
      self%drawn = .false.
      self%active = .false.
   end subroutine finish

   !> " 42 %"
   pure function percent(fraction) result(text)
      real(wp), intent(in) :: fraction
      character(len=5) :: text
      write (text, '(i3, a)') int(100*min(1.0_wp, max(0.0_wp, fraction))), ' %'
   end function percent

   !> Duration as text: 12 s, 3 min 20 s, 5 h 10 min.
   pure function duration(seconds) result(text)
      real(wp), intent(in) :: seconds
      character(len=:), allocatable :: text
      integer :: s
      s = nint(min(seconds, 1.0e8_wp))
      if (s < 60) then
         text = to_string(s)//' s'
      else if (s < 3600) then
         text = to_string(s/60)//' min '//to_string(mod(s, 60))//' s'
      else
         text = to_string(s/3600)//' h '//to_string(mod(s, 3600)/60)//' min'
      end if
   end function duration

end module rockdda_app_progress
