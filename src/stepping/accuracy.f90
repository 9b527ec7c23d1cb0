! SPDX-License-Identifier: MIT
!> Length of dynamic steps by their error in time (`&time accuracy`).
!>
!> The error E of the worst block (rockdda_stepping_time_error) may grow to aim*accuracy*U (1 + s)/2 at the share s of
!> the dynamic part, U the largest displacement so far: half of it with the motion, half evenly with time. Steps keep
!> their length over a window of at least `few` steps and a part of the time since the beginning. At its end the mean
!> rate r of E in the window is continued over a horizon h:
!>
!> - generalised alpha: E + r h, h as long as the motion has lasted, at most to the end; r goes with dt**2;
!> - Shi's scheme, whose errors are velocities that stay to the end: E + r h + 1/2 r' h**2, r' the change of r since the
!>   window before. Only r' goes with dt: what is left of the allowance after E + r h is for it.
!>
!> Where contacts flutter a shorter step makes no smaller errors. Each step that is shortened is therefore tried for one
!> window. If r (or r') has not fallen by half of its order, the longer step comes back for a window; if it is not worse
!> there either, it is held for a while.
!>
!> A step is repeated with a shorter one when an acceleration changes in it so that the velocity error 1/2 da dt would
!> use up a part of the allowance until the end, if one of these holds:
!>
!> - it changes suddenly, by `sudden` times the largest change per time lately: cut to g1, the first step of the run.
!>   Afterwards steps grow back quickly while the error stands still;
!> - a contact of the block begins or ends to slide, or its slip turns round (a kink): cut to least_kink*g1, in steps of
!>   the cut factor. Steps then keep their length until the kink has passed, or is not found any more, and grow up to
!>   twice in each step, as their changes allow, to the one before, after `most_of_kink` steps to g1. The first step of
!>   a dynamic part is one with a kink: loads may act at once. Where contacts flutter kinks follow each other: one that
!>   comes within `calm_steps` after the last is passed over, and so are those that would make kinks take more steps
!>   than all else.
module rockdda_stepping_accuracy
   use rockdda_base_kinds, only : wp
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_state, only : energy, n_energies
   implicit none
   private
   public :: accuracy_type, dynamic_step_type, new_accuracy, rest_steps, step_to_row

   !> Share of the accuracy that steps are chosen for.
   real(wp), parameter :: aim = 0.5_wp
   !> Factors of one window's step on that of the one before; changes by less than the other two are not worth it.
   real(wp), parameter :: most_growth = 1.5_wp, most_shrink = 0.3_wp, least_growth = 1.2_wp, least_shrink = 0.9_wp
   !> Least steps of a window, and its part of the time since the beginning. It ends before when the error has used
   !> this part of what is left of the allowance.
   integer, parameter :: few = 8
   real(wp), parameter :: part_of_time = 0.1_wp, part_of_rest = 0.1_wp
   !> With Shi's scheme no step is shortened for an error of a window below this part of the allowance.
   real(wp), parameter :: noise = 0.02_wp
   !> A dynamic part takes at most these numbers of steps, over accuracy (Shi) and its root: ten swings need as many.
   real(wp), parameter :: most_steps(2) = [50.0_wp, 1000.0_wp]
   !> Part of the allowance that counts as left when there is less.
   real(wp), parameter :: least_left = 0.1_wp
   !> A step that a shorter one does not improve is held for this part of the dynamic part, and for so many windows.
   real(wp), parameter :: held_part = 0.05_wp
   integer, parameter :: held_windows = 5
   !> Steps without growth after a step that was cut.
   integer, parameter :: rest_steps = 10
   !> A change of accelerations is sudden beyond this factor on the largest one lately, which fades in each step by the
   !> other.
   real(wp), parameter :: sudden = 4.0_wp, fading = 0.75_wp
   !> Least step for a kink over g1; steps that one may take; steps without one before the next is followed; steps that
   !> all may take beyond the number of the others.
   real(wp), parameter :: least_kink = 0.01_wp
   integer, parameter :: most_of_kink = 30, calm_steps = 5, first_credit = 100
   !> Times are the same within this part of a step.
   real(wp), parameter :: same = 1.0e-6_wp
   !> What a window is for.
   integer, parameter :: usual = 0, tries_shorter = 1, tries_longer = 2

   !> What is to be known of a step.
   type :: dynamic_step_type
      integer :: order = 1         !! of the scheme
      real(wp) :: first_dt = 0     !! first step of the run [time]
      real(wp) :: dt = 0           !! step, before it was divided to land on a time [time]
      real(wp) :: time = 0         !! at its end
      real(wp) :: length = 0       !! of the dynamic part, huge: not known [time]
      real(wp) :: error = 0        !! of the worst block [length]
      real(wp) :: largest = 0      !! displacement to which errors are compared [length]
      real(wp) :: change = 0       !! largest of an acceleration in the step [length/time**2]
      real(wp) :: at_kink = 0      !! the same of blocks of which a contact begins or ends to slide, or turns its slip
      real(wp) :: kink_end = 0     !! time before which there is a kink, 0: none known; of accepted steps
      real(wp) :: last_dt = 0      !! step that was tried first [time]
      real(wp) :: least_dt = 0     !! no step is shorter [time]
   end type dynamic_step_type

   !> Part of the state of a run.
   type :: accuracy_type
      real(wp) :: begin = 0        !! time at which the dynamic part began
      real(wp) :: since = 0        !! time at which the window began
      real(wp) :: error = 0        !! at that time [length]
      real(wp) :: rate = 0         !! mean of the error's growth in the window before [length/time]
      real(wp) :: window = 0       !! length of that window [time]
      integer :: n = 0             !! steps in the window
      integer :: purpose = usual
      logical :: is_first = .true. !! with this step; the change of the rate is then still that of the step before
      real(wp) :: other_dt = 0     !! step of the window before, while one is tried [time]
      real(wp) :: other_growth = 0 !! what goes with its order, in that window
      real(wp) :: held_until = 0   !! no step is shortened until then [time]
      integer :: rest = 0          !! steps before one may grow
      real(wp) :: regrow = 0       !! step before a sudden change, to which steps grow back quickly; 0: they have
      real(wp) :: wanted = 0       !! the next step [time]
      real(wp) :: jerk = 0         !! largest change of an acceleration over dt lately [length/time**3]
      integer :: n_held = 0        !! times that a step was held
      real(wp) :: first_held = 0   !! when, the first time
      real(wp) :: kink_dt = 0      !! step before the kink at hand, 0: none [time]
      real(wp) :: kink_end = 0     !! time before which it comes; 0: it has passed
      integer :: of_kink = 0       !! steps for it so far
      integer :: of_kinks = 0      !! steps for kinks so far
      integer :: of_others = 0     !! all other steps
      integer :: calm = calm_steps !! of them, since the last kink
      integer :: n_kinks = 0       !! kinks followed
      integer :: n_passed = 0      !! steps with a kink that was passed over
      real(wp) :: passed = 0       !! sum of the squares of the displacements by which those steps are wrong [length**2]
      integer :: n_least = 0       !! steps as short as they may be
      type(dynamic_step_type) :: attempt   !! at the step at hand, scratch
      real(wp) :: sudden_load = 0  !! unbalanced force after the first step on joints without damping, or bolts
      ! also without a wanted accuracy, with a ledger
      real(wp) :: at_begin(2) = 0  !! friction and dissipation before the dynamic part [energy]
      real(wp) :: taken(2) = 0     !! by both in it
      real(wp) :: kinetic = 0      !! largest kinetic energy in it
   contains
      procedure :: begin_part
      procedure :: judge_step
      procedure, private :: may_follow
      procedure :: next_step
      procedure :: note_energies
      procedure :: kinks_matter
      procedure :: values
      procedure :: counts
      procedure :: has_purpose
   end type accuracy_type

contains

   !> A dynamic part begins.
   pure type(accuracy_type) function new_accuracy(time) result(self)
      real(wp), intent(in) :: time
      self%begin = time
      self%since = time
      self%held_until = time
   end function new_accuracy

   !> The same for the dynamic part that begins; counts go on.
   pure subroutine begin_part(self, time)
      class(accuracy_type), intent(inout) :: self
      real(wp), intent(in) :: time
      type(accuracy_type) :: fresh
      fresh = new_accuracy(time)
      fresh%n_held = self%n_held
      fresh%first_held = self%first_held
      fresh%n_kinks = self%n_kinks
      fresh%n_passed = self%n_passed
      fresh%passed = self%passed
      fresh%n_least = self%n_least
      select type (self)
      type is (accuracy_type)
         self = fresh
      end select
   end subroutine begin_part

   !> Should the step at hand be shorter? Then `shorter` is the one to try.
   pure subroutine judge_step(self, accuracy, factor, step, is_kink, is_sudden, shorter)
      class(accuracy_type), intent(in) :: self
      real(wp), intent(in) :: accuracy         !! that is wanted
      real(wp), intent(in) :: factor           !! by which a step is cut
      type(dynamic_step_type), intent(in) :: step   !! an attempt; `error` does not matter
      logical, intent(out) :: is_kink, is_sudden   !! why; neither: it may be accepted
      real(wp), intent(out) :: shorter         !! [time]
      real(wp) :: share
      is_kink = .false.
      is_sudden = .false.
      shorter = step%dt
      share = share_of(self, accuracy, step, step%at_kink)
      ! the run may begin with loads that act at once
      if (self%of_others + self%of_kinks == 0) share = share_of(self, accuracy, step, step%change)
      if (self%may_follow() .and. share > 1) then
         shorter = max(least_kink*step%first_dt, factor*step%dt, step%dt/share)
         is_kink = shorter < step%dt*(1 - same)
      end if
      if (is_kink) return
      if (step%change > sudden*self%jerk*step%dt .and. share_of(self, accuracy, step, step%change) > 1) then
         shorter = max(step%first_dt, factor*step%dt)
         is_sudden = shorter < step%dt*(1 - same)
      end if
   end subroutine judge_step

   !> Velocity error of a change of an acceleration in a step, to the end, over what is allowed to it.
   pure real(wp) function share_of(self, accuracy, step, change) result(share)
      type(accuracy_type), intent(in) :: self
      real(wp), intent(in) :: accuracy, change
      type(dynamic_step_type), intent(in) :: step
      real(wp) :: left
      left = step%time - self%begin
      if (step%length < huge(1.0_wp)) left = max(0.0_wp, step%length - left) + step%dt
      share = 0.5_wp*change*step%dt*left/(part_of_rest*aim*accuracy*step%largest)
   end function share_of

   !> May steps be cut for a kink?
   pure logical function may_follow(self)
      class(accuracy_type), intent(in) :: self
      if (self%kink_dt > 0) then
         may_follow = self%of_kink < most_of_kink
      else
         may_follow = self%calm >= calm_steps .and. self%of_kinks <= self%of_others + first_credit
      end if
   end function may_follow

   !> A step while a kink is followed: `wanted` is the next one.
   pure subroutine follow_kink(self, step, has_kink, share)
      class(accuracy_type), intent(inout) :: self
      type(dynamic_step_type), intent(in) :: step
      logical, intent(in) :: has_kink          !! in this step
      real(wp), intent(in) :: share            !! of the allowance, that the change of accelerations takes
      real(wp) :: longest
      self%of_kink = self%of_kink + 1
      self%of_kinks = self%of_kinks + 1
      if (has_kink .or. step%time > self%kink_end - same*step%dt .or. self%of_kink >= most_of_kink) self%kink_end = 0
      self%calm = 0
      if (self%kink_end > 0) return
      longest = self%kink_dt
      self%wanted = 2*step%dt
      if (self%of_kink < most_of_kink) then
         self%wanted = step%dt*max(1.0_wp, min(2.0_wp, share**(-0.5_wp)))
      else
         longest = min(longest, max(step%first_dt, step%dt))
      end if
      self%wanted = min(self%wanted, longest)
      if (self%wanted < longest) return
      if (longest < self%kink_dt) self%regrow = self%kink_dt
      self%kink_dt = 0
   end subroutine follow_kink

   !> Note what the ledger says at the end of a dynamic step.
   pure subroutine note_energies(self, is_first, before, now)
      class(accuracy_type), intent(inout) :: self
      logical, intent(in) :: is_first                    !! a dynamic part begins
      real(wp), intent(in) :: before(n_energies), now(n_energies)
      if (is_first) then
         self%at_begin = before([energy%friction, energy%dissipated])
         self%kinetic = before(energy%kinetic)
      end if
      self%taken = now([energy%friction, energy%dissipated]) - self%at_begin
      self%kinetic = max(self%kinetic, now(energy%kinetic))
   end subroutine note_energies

   !> Choose the step that follows an accepted one.
   pure subroutine next_step(self, accuracy, step)
      class(accuracy_type), intent(inout) :: self
      real(wp), intent(in) :: accuracy         !! that is wanted
      type(dynamic_step_type), intent(in) :: step
      real(wp) :: lasted, window, horizon, allowed, rate, used
      logical :: is_noise, has_kink
      self%wanted = step%dt
      self%jerk = max(step%change/step%dt, fading*self%jerk)
      if (step%kink_end > 0 .and. .not. self%kink_dt > 0) then
         self%n_kinks = self%n_kinks + 1
         self%of_kink = 0
         self%kink_dt = step%last_dt
      end if
      if (.not. step%dt > step%least_dt*(1 + same)) self%n_least = self%n_least + 1
      has_kink = share_of(self, accuracy, step, step%at_kink) > merge(0.25_wp, 1.0_wp, self%kink_dt > 0)
      if (self%kink_dt > 0) then
         if (step%kink_end > 0) self%kink_end = step%kink_end
         call follow_kink(self, step, has_kink, max(tiny(1.0_wp), share_of(self, accuracy, step, step%change)))
         return
      end if
      self%of_others = self%of_others + 1
      self%calm = merge(0, min(self%calm + 1, calm_steps), has_kink)
      if (has_kink) then
         self%n_passed = self%n_passed + 1
         self%passed = self%passed + (0.5_wp*step%at_kink*step%dt**2)**2
      end if
      self%n = self%n + 1
      self%rest = max(self%rest - 1, 0)
      lasted = step%time - self%begin
      window = step%time - self%since
      horizon = lasted
      allowed = aim*accuracy*step%largest
      if (step%length < huge(1.0_wp)) then
         ! velocity errors of Shi's scheme stay to the end
         if (step%order == 1) horizon = step%length
         horizon = max(step%dt, min(horizon, step%length - lasted))
         allowed = 0.5_wp*allowed*(1 + min(1.0_wp, (lasted + horizon)/step%length))
      end if
      if (self%n < merge(few/4, few, self%regrow > 0)) return
      used = step%error - self%error
      rate = max(0.0_wp, used/window)
      if (self%regrow > 0 .and. used < noise*allowed) then
         self%wanted = min(most_growth*step%dt, max(step%dt, self%regrow))
         if (.not. self%wanted < self%regrow) self%regrow = 0
         self%since = step%time
         self%error = step%error
         self%rate = rate
         self%window = window
         self%n = 0
         self%is_first = .true.
         self%purpose = usual
         return
      end if
      self%regrow = 0
      is_noise = step%order == 1 .and. used < noise*allowed
      if (step%order == 1) used = used + (rate - self%rate)*horizon
      if (window < part_of_time*lasted .and. &
          (is_noise .or. used < part_of_rest*max(allowed - step%error, least_left*allowed))) return
      call end_window(self, accuracy, step, horizon, allowed, is_noise)
   end subroutine next_step

   !> Choose the step of the next window.
   pure subroutine end_window(self, accuracy, step, horizon, allowed, is_noise)
      class(accuracy_type), intent(inout) :: self
      real(wp), intent(in) :: accuracy
      type(dynamic_step_type), intent(in) :: step
      real(wp), intent(in) :: horizon          !! [time]
      real(wp), intent(in) :: allowed          !! error at its end [length]
      logical, intent(in) :: is_noise          !! the error of the window is too small to shorten a step for it
      real(wp) :: window, rate, growth, left, share, shortest
      logical :: is_first
      window = step%time - self%since
      rate = max(0.0_wp, (step%error - self%error)/window)
      is_first = self%is_first .and. step%order == 1
      self%is_first = .false.
      if (step%order > 1) then
         growth = rate
         left = allowed - step%error
         share = rate*horizon
      else
         growth = 2*max(0.0_wp, rate - self%rate)/(window + self%window)
         left = allowed - step%error - rate*horizon
         share = 0.5_wp*growth*horizon**2
      end if
      share = share/max(left, least_left*allowed)
      self%since = step%time
      self%error = step%error
      self%rate = rate
      self%window = window
      self%n = 0
      if (is_first) return
      select case (self%purpose)
      case (tries_shorter)
         if (.not. is_better(step%dt, growth, self%other_dt, self%other_growth)) then
            self%is_first = .true.
            self%wanted = self%other_dt
            self%other_dt = step%dt
            self%other_growth = growth
            self%purpose = tries_longer
            return
         end if
      case (tries_longer)
         if (is_better(self%other_dt, self%other_growth, step%dt, growth)) then
            self%is_first = .true.
            self%wanted = self%other_dt
            self%purpose = usual
            return
         end if
         if (self%n_held == 0) self%first_held = step%time
         self%n_held = self%n_held + 1
         self%held_until = step%time + max(held_part*merge(step%length, step%time - self%begin, &
                                                           step%length < huge(1.0_wp)), held_windows*window)
      end select
      self%purpose = usual
      if (share*least_shrink**step%order > 1) then
         shortest = 0
         if (step%length < huge(1.0_wp)) &
            shortest = step%length*accuracy**(1.0_wp/step%order)/most_steps(step%order)
         shortest = max(shortest, step%least_dt*(1 + same))
         if (is_noise .or. step%time < self%held_until .or. .not. step%dt > shortest) return
         self%purpose = tries_shorter
         self%other_dt = step%dt
         self%other_growth = growth
         self%wanted = max(step%dt*max(most_shrink, share**(-1.0_wp/step%order)), min(step%dt, shortest))
      else if (self%rest == 0 .and. share*least_growth**step%order < 1) then
         self%wanted = most_growth*step%dt
         if (share*most_growth**step%order > 1) self%wanted = step%dt*share**(-1.0_wp/step%order)
      end if
      self%is_first = abs(self%wanted - step%dt) > 0

   contains

      !> Has a shorter step brought at least half of what its order promises?
      pure logical function is_better(short, short_growth, long, long_growth)
         real(wp), intent(in) :: short, short_growth, long, long_growth
         is_better = short_growth <= long_growth*(short/long)**(0.5_wp*step%order)
      end function is_better

   end subroutine end_window

   !> A step that lands on the next row of a table in time of loads or supports, or an equal part of the way there.
   pure real(wp) function step_to_row(parameters, motion_start, time, dt, last_dt) result(step)
      type(parameters_type), intent(in) :: parameters
      real(wp), intent(in) :: motion_start     !! time at which base motion begins
      real(wp), intent(in) :: time             !! at the start of the step
      real(wp), intent(in) :: dt, last_dt      !! longest step, and the last one [time]
      real(wp) :: row
      integer :: i
      row = time + 2*dt
      do i = 1, size(parameters%fixed_tables)
         row = first(row, parameters%fixed_tables(i)%rows, 0.0_wp)
      end do
      do i = 1, size(parameters%loading_tables)
         row = first(row, parameters%loading_tables(i)%rows, 0.0_wp)
      end do
      if (allocated(parameters%line_loads)) then
         do i = 1, size(parameters%line_loads)
            row = first(row, parameters%line_loads(i)%table, 0.0_wp)
         end do
      end if
      if (allocated(parameters%boundaries)) then
         do i = 1, size(parameters%boundaries)
            row = first(row, parameters%boundaries(i)%table, 0.0_wp)
         end do
      end if
      if (allocated(parameters%water)) then
         do i = 1, size(parameters%water)
            row = first(row, parameters%water(i)%level, 0.0_wp)
         end do
      end if
      if (motion_start < huge(1.0_wp)) then
         row = first(row, parameters%base%table, motion_start)
         if (allocated(parameters%quakes)) then
            do i = 1, size(parameters%quakes)
               row = first(row, parameters%quakes(i)%rows, motion_start)
            end do
         end if
      end if
      step = dt
      if (row < time + 2*dt) step = (row - time)/ceiling((row - time)/dt - same)
      ! equal parts have the same bits, so that solvers see the same matrix
      if (abs(step - last_dt) < same*step .and. row - time > 1.5_wp*step) step = last_dt

   contains

      !> The first row that is still to come, unless `row` is before it.
      pure real(wp) function first(row, rows, start)
         real(wp), intent(in) :: row                       !! [time]
         real(wp), allocatable, intent(in) :: rows(:, :)   !! times first
         real(wp), intent(in) :: start                     !! of these times
         integer :: k
         first = row
         if (.not. allocated(rows)) return
         do k = 1, size(rows, 2)
            if (.not. start + rows(1, k) > time + same*dt) cycle
            first = min(row, start + rows(1, k))
            return
         end do
      end function first

   end function step_to_row

   !> Are kinks that were passed over worth a warning? Contacts that flutter lock again, or turn back, within few steps:
   !> the velocity error of a kink then lasts no longer, and displaces its block by 1/2 da dt**2, this way or that.
   !> Their sum, as of random signs, is compared with what steps leave of the accuracy.
   pure logical function kinks_matter(self, accuracy, largest)
      class(accuracy_type), intent(in) :: self
      real(wp), intent(in) :: accuracy         !! that is wanted
      real(wp), intent(in) :: largest          !! displacement to which errors are compared [length]
      kinks_matter = sqrt(self%passed) > (1 - aim)*accuracy*largest
   end function kinks_matter

   !> All numbers that must be finite and not negative.
   pure function values(self)
      class(accuracy_type), intent(in) :: self
      real(wp) :: values(16)
      values = [self%begin, self%since, self%error, self%rate, self%window, self%other_dt, self%other_growth, &
                self%held_until, self%wanted, self%jerk, self%first_held, self%sudden_load, self%regrow, &
                self%kink_dt, self%kink_end, self%passed]
   end function values

   !> All counts.
   pure function counts(self)
      class(accuracy_type), intent(in) :: self
      integer :: counts(10)
      counts = [self%n, self%rest, self%n_held, self%of_kink, self%of_kinks, self%of_others, self%calm, self%n_kinks, &
                self%n_passed, self%n_least]
   end function counts

   !> Is the purpose of the window one of those there are?
   pure logical function has_purpose(self)
      class(accuracy_type), intent(in) :: self
      has_purpose = any(self%purpose == [usual, tries_shorter, tries_longer])
   end function has_purpose

end module rockdda_stepping_accuracy
