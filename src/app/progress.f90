! SPDX-License-Identifier: MIT
!> Progress of a run on standard error: on a terminal a bar with the remaining time and a curve of the unbalanced force,
!> otherwise one line at intervals. The remaining time never grows: where an estimate is above the one shown, that
!> stays.
module rockdda_app_progress
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : to_string
   use rockdda_io_timestamp, only : wall_seconds
   use rockdda_app_process, only : print_error, show_status, is_terminal, terminal_columns
   implicit none
   private
   public :: progress_type

   integer, parameter :: bar_width = 20
   !> Values in the curve.
   integer, parameter :: curve_length = 16
   !> Seconds between updates on a terminal and elsewhere.
   real(wp), parameter :: terminal_interval = 0.2_wp, line_interval = 10
   !> Longer times that are left are not shown [s].
   real(wp), parameter :: longest_left = 1.0e8_wp
   !> Seconds before which an estimate of the time left is none.
   real(wp), parameter :: first_estimate = 2

   type :: progress_type
      logical, private :: active = .false., terminal = .false., drawn = .false.
      real(wp), private :: start = 0, last = 0
      integer, private :: part = 1                     !! of the run: its stage
      real(wp), private :: part_start = 0, share = 0   !! when that began [s], and the largest share of it
      real(wp), private :: longest_part = 0            !! duration of the longest part before it [s]
      real(wp), private :: left = longest_left         !! the time left that was shown last [s]
      real(wp), private :: levels(curve_length) = 0    !! the latest values of the curve, the last one behind
      integer, private :: n_levels = 0
      logical, private :: unicode = .false.            !! the terminal shows UTF-8
   contains
      procedure :: begin
      procedure :: update
      procedure :: finish
      procedure, private :: estimate, add_level
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
      self%part = 1
      self%part_start = self%start
      self%share = 0
      self%longest_part = 0
      self%left = longest_left
      self%n_levels = 0
      self%unicode = shows_unicode()
   end subroutine begin

   !> Show the progress of the run, unless it has been shown within the interval.
   subroutine update(self, fraction, text, level, share, part, n_parts)
      class(progress_type), intent(inout) :: self
      real(wp), intent(in) :: fraction          !! of the run, 0 … 1
      character(len=*), intent(in) :: text      !! for example "step 12, time 0.1"
      real(wp), intent(in), optional :: level   !! next value of the curve, shown behind the text
      real(wp), intent(in), optional :: share   !! of a part of the run; without it the run is one part
      integer, intent(in), optional :: part, n_parts
      real(wp) :: now
      integer :: full
      character(len=:), allocatable :: tail
      if (.not. self%active) return
      now = wall_seconds()
      if (now - self%last < merge(terminal_interval, line_interval, self%terminal)) return
      self%last = now
      tail = text
      if (present(level)) call self%add_level(level)
      if (present(level) .and. self%terminal .and. self%unicode) tail = tail//' '//curve(self%levels(1:self%n_levels))
      if (present(share) .and. present(part) .and. present(n_parts)) then
         call self%estimate(share, part, n_parts, now)
      else
         call self%estimate(fraction, 1, 1, now)
      end if
      if (self%left > 0.5_wp .and. self%left < longest_left .and. fraction < 1) tail = tail//', '// &
         duration(self%left)//' left'
      if (self%terminal) then
         full = nint(bar_width*min(1.0_wp, max(0.0_wp, fraction)))
         tail = '['//repeat('#', full)//repeat('.', bar_width - full)//'] '//percent(fraction)//'  '//tail
         call show_status(achar(13)//first_columns(tail, terminal_columns() - 1)//achar(27)//'[K')
         self%drawn = .true.
      else
         call print_error(percent(fraction)//'  '//tail)
      end if
   end subroutine update

   !> Estimate the time that is left: of this part by the share that is done, for each later part the longest one so
   !> far.
   subroutine estimate(self, share, part, n_parts, now)
      class(progress_type), intent(inout) :: self
      real(wp), intent(in) :: share             !! of the present part that is done
      integer, intent(in) :: part, n_parts
      real(wp), intent(in) :: now               !! [s]
      real(wp) :: whole
      if (part > self%part) then
         self%longest_part = max(self%longest_part, now - self%part_start)
         self%part = part
         self%part_start = now
         self%share = 0
      end if
      self%share = max(self%share, share)
      if (.not. self%share > 0 .or. now - self%start < first_estimate) return
      whole = (now - self%part_start)/self%share
      self%left = max(0.0_wp, min(self%left, whole*(1 - self%share) + (n_parts - part)*max(whole, self%longest_part)))
   end subroutine estimate

   !> Append a value to the curve; the oldest one goes when there is no room.
   subroutine add_level(self, level)
      class(progress_type), intent(inout) :: self
      real(wp), intent(in) :: level
      if (self%n_levels == curve_length) then
         self%levels(1:curve_length - 1) = self%levels(2:)
      else
         self%n_levels = self%n_levels + 1
      end if
      self%levels(self%n_levels) = level
   end subroutine add_level

   !> Positive values as columns of eight heights, by their logarithm between the least and the largest of them; at
   !> least a factor of ten from the lowest to the highest column.
   pure function curve(levels) result(text)
      real(wp), intent(in) :: levels(:)
      character(len=:), allocatable :: text
      character(len=3), parameter :: columns(8) = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█']
      real(wp) :: powers(size(levels)), low, high
      integer :: i
      powers = log10(max(levels, tiny(1.0_wp)))
      low = minval(powers)
      high = max(maxval(powers), low + 1)
      text = ''
      do i = 1, size(levels)
         text = text//columns(1 + nint(7*(powers(i) - low)/(high - low)))
      end do
   end function curve

   !> The beginning of a text in UTF-8 that fits into a number of columns; with fewer than one, all of it.
   pure function first_columns(text, n) result(cut)
      character(len=*), intent(in) :: text
      integer, intent(in) :: n
      character(len=:), allocatable :: cut
      integer :: i, used
      used = 0
      do i = 1, len(text)
         ! bytes 128 … 191 continue a letter
         if (iachar(text(i:i)) < 128 .or. iachar(text(i:i)) > 191) used = used + 1
         if (n > 0 .and. used > n) exit
      end do
      cut = text(1:i - 1)
   end function first_columns

   !> Does the terminal show UTF-8, by the variables of the locale?
   function shows_unicode() result(yes)
      logical :: yes
      character(len=*), parameter :: names(3) = [character(len=8) :: 'LC_ALL', 'LC_CTYPE', 'LANG']
      character(len=200) :: locale
      integer :: i, length
      yes = .false.
      do i = 1, size(names)
         call get_environment_variable(trim(names(i)), locale, length)
         if (length == 0) cycle
         yes = index(locale, 'UTF-8') > 0 .or. index(locale, 'utf8') > 0 .or. index(locale, 'UTF8') > 0 .or. &
               index(locale, 'utf-8') > 0
         return
      end do
   end function shows_unicode

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
