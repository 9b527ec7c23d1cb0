! SPDX-License-Identifier: MIT
!> The way of a search: which value comes next, after what is known of the values before.
!>
!> The search begins at a value at which the model should be stable, goes up (or, where it may, down) until it has a
!> value on either side. Halving this interval again and again would end in one of many cells, no longer than the
!> tolerance, and the search ends in the same one. It comes there sooner: the pull of the mechanism that two failing
!> trials have left goes to zero where the next ones should be, and the ends of that cell are tried. Without two failing
!> trials, and after two that have taken less than a quarter of the interval, the middle is. The way is replayed from
!> its beginning each time, so that it depends on nothing but its trials: those that were computed ahead, or before the
!> search was interrupted, are used when the way comes to their values.
module rockdda_run_search_path
   use rockdda_base_kinds, only : wp
   use rockdda_model_options, only : is_set
   use rockdda_run_search_options, only : search_kind, search_options_type, default_tolerance
   implicit none
   private
   public :: search_path_type, search_state_type, search_end, new_search_path

   !> How a search stands.
   type :: search_end_enum
      integer :: open = 0          !! a value has to be tried
      integer :: found = 1         !! low and high are as near as wanted
      integer :: never_stable = 2  !! not stable at the lower end
      integer :: never_fails = 3   !! stable at the upper end
   end type search_end_enum
   type(search_end_enum), parameter :: search_end = search_end_enum()

   !> A load factor below this is none, and neither is one above its inverse.
   real(wp), parameter :: least_load = 1.0e-6_wp
   !> Pulls are followed to zero where the least is smaller than the next one by this factor: no further than twice the
   !> distance between the two trials.
   real(wp), parameter :: far = 1.5_wp
   !> Limits by work are followed to their own value while they change by less than this share of the change of values.
   real(wp), parameter :: steepest = 0.9_wp
   !> After this number of trials in a row that leave more than this share of the interval the middle is tried.
   integer, parameter :: slow_trials = 2
   real(wp), parameter :: hardly_shorter = 0.75_wp

   !> Rules. Values are multiplied by `sign`, so that a search to the left also goes up.
   type :: search_path_type
      real(wp) :: sign = 1
      real(wp) :: start = 1
      real(wp) :: end = 0              !! where the model should fail, when has_end
      logical :: has_end = .false.
      logical :: may_halve = .false.   !! values below the start may be tried
      real(wp) :: lowest = 0, highest = huge(1.0_wp)
      real(wp) :: first_step = 0       !! 0: the value is doubled; else added, and larger each time
      real(wp) :: growth = 2           !! by this factor
      real(wp) :: tolerance = 0.01_wp
      logical :: relative = .false.    !! the tolerance is a share of the value
      logical :: by_inverse = .false.  !! pulls change with the inverse of the value
   contains
      procedure :: follow
      procedure :: candidates
      procedure, private :: is_near
      procedure, private :: expected
   end type search_path_type

   type :: search_state_type
      integer :: outcome = 0                !! one of search_end%...
      real(wp) :: next = 0                  !! the value to be tried
      real(wp) :: stable = 0, failing = 0   !! the nearest values of both sides, as far as known
      integer, allocatable :: used(:)       !! verdicts on the way, in order
   end type search_state_type

contains

   !> Rules of a search.
   pure type(search_path_type) function new_search_path(options, strength) result(path)
      type(search_options_type), intent(in) :: options
      real(wp), intent(in) :: strength      !! with which the model is settled, times its own
      path%tolerance = options%tolerance
      if (.not. is_set(options%tolerance)) path%tolerance = default_tolerance(options)/strength
      path%by_inverse = options%kind == search_kind%strength
      select case (options%kind)
      case (search_kind%tilt)
         path%start = 0
         path%first_step = 5
         path%highest = 85
      case (search_kind%push)
         path%start = 0
         path%first_step = 0.05_wp
         path%highest = 10
      case (search_kind%load)
         path%start = 0
         path%first_step = 1
         path%growth = 4
         path%highest = 1/least_load
         path%relative = .true.
      case default
         ! the value with which the model is settled
         path%start = 1/strength
         path%may_halve = .true.
         path%lowest = 1.0_wp/64
         path%highest = 64
      end select
      path%has_end = is_set(options%to)
      if (is_set(options%from)) then
         path%start = options%from
         path%may_halve = .false.
         path%highest = max(path%highest, 64*abs(path%start))
      else if (path%has_end .and. path%may_halve) then
         if (.not. options%to > path%start) path%start = options%to/2
      end if
      if (.not. path%has_end) return
      path%end = options%to
      if (.not. path%end < path%start) return
      ! to the left
      path%sign = -1
      path%start = -path%start
      path%end = -path%end
   end function new_search_path

   !> Follow the way as far as the verdicts lead.
   pure subroutine follow(self, values, stable, pulls, limits, state)
      class(search_path_type), intent(in) :: self
      real(wp), intent(in) :: values(:)      !! tried so far, in any order
      logical, intent(in) :: stable(:)       !! their verdicts
      real(wp), intent(in) :: pulls(:)       !! of what fails, over its size; 0: not known
      real(wp), intent(in) :: limits(:)      !! by the work of what fails; 0: not known
      type(search_state_type), intent(out) :: state
      real(wp) :: first(2), low, high, next, before
      logical :: found, stays
      integer :: slow           ! trials in a row by which the interval is hardly shorter
      allocate (state%used(0))
      call bracket(self, values, stable, state, low, high, found)
      if (.not. found) return
      first = [low, high]
      slow = 0
      do while (.not. self%is_near(low, high))
         if (self%relative .and. max(abs(low), abs(high)) < least_load) then
            state%outcome = search_end%never_stable
            return
         end if
         next = low + (high - low)/2
         if (slow < slow_trials) &
            next = self%expected(low, high, values(state%used), stable(state%used), pulls(state%used), &
                                 limits(state%used))
         next = end_of_cell(self, first, high, next)
         if (.not. (next > low .and. next < high)) exit
         call ask(self, next, values, stable, state, found, stays)
         if (.not. found) return
         before = high - low
         if (stays) then
            low = next
         else
            high = next
         end if
         slow = merge(slow + 1, 0, slow < slow_trials .and. high - low > hardly_shorter*before)
      end do
      state%outcome = search_end%found
   end subroutine follow

   !> Are two values as near as wanted?
   pure logical function is_near(self, low, high)
      class(search_path_type), intent(in) :: self
      real(wp), intent(in) :: low, high
      is_near = .not. high - low > self%tolerance*merge(max(abs(low), abs(high)), 1.0_wp, self%relative)
   end function is_near

   !> Where the limit is expected between a stable and a failing value: where the work of what fails would be none, else
   !> where its pull would be zero. Where one is beyond the failing value and none between them, half as far below it as
   !> the next failing one is above; else, and within the tolerance, in the middle.
   pure real(wp) function expected(self, low, high, values, stable, pulls, limits) result(value)
      class(search_path_type), intent(in) :: self
      real(wp), intent(in) :: low, high
      real(wp), intent(in) :: values(:)      !! on the way, as tried
      logical, intent(in) :: stable(:)
      real(wp), intent(in) :: pulls(:), limits(:)
      real(wp) :: failing(count(.not. stable)), zeros(2)
      integer :: i
      failing = pack(self%sign*values, .not. stable)
      zeros = [zero_of_work(self, failing, pack(self%sign*limits, .not. stable)), &
               zero_of_pulls(self, failing, pack(pulls, .not. stable))]
      do i = 1, 2
         value = zeros(i)
         if (value > low .and. value < high) return
      end do
      value = high - (minval(failing, mask=failing > high) - high)/2
      if (.not. (any(zeros >= high .and. zeros < huge(value)) .and. value > low) .or. self%is_near(value, high)) &
         value = low + (high - low)/2
   end function expected

   !> The limit by the work of the lowest failing trial. When that of the next one is known as well: the value that
   !> would be its own limit by the line through both, as forces and mechanism change with the value, or the higher one
   !> where they differ too much: blocks that rattle do work. Huge: not known.
   pure real(wp) function zero_of_work(self, values, limits) result(zero)
      class(search_path_type), intent(in) :: self
      real(wp), intent(in) :: values(:), limits(:)   !! of failing trials, times the sign
      real(wp) :: t(2), l(2), slope
      integer :: n
      zero = huge(zero)
      call take_lowest(values, limits, t, l, n)
      if (n == 0) return
      zero = l(1)
      if (n == 1) return
      if (self%by_inverse) t = 1/t
      if (self%by_inverse) l = 1/l
      slope = (l(1) - l(2))/(t(1) - t(2))
      if (.not. abs(slope) < steepest) then
         zero = merge(min(l(1), l(2)), max(l(1), l(2)), self%by_inverse)
      else
         zero = (l(1) - slope*t(1))/(1 - slope)
      end if
      if (self%by_inverse) zero = 1/max(zero, tiny(1.0_wp))
   end function zero_of_work

   !> Where the pull of the lowest three failing trials would be zero, or two, by the curve through them of the value
   !> over the pull, of its inverse for the strength. Huge: they are far from there, or not known.
   pure real(wp) function zero_of_pulls(self, values, pulls) result(zero)
      class(search_path_type), intent(in) :: self
      real(wp), intent(in) :: values(:), pulls(:)    !! of failing trials, values times the sign
      real(wp) :: t(3), p(3), slope
      integer :: n
      zero = huge(zero)
      call take_lowest(values, pulls, t, p, n)
      if (n < 2) return
      if (.not. p(2) > far*p(1)) return
      if (self%by_inverse) t(:n) = 1/t(:n)
      slope = (t(2) - t(1))/(p(2) - p(1))
      zero = t(1) - p(1)*slope
      if (n == 3) then
         if (p(3) > p(2)) zero = zero + p(1)*p(2)*((t(3) - t(2))/(p(3) - p(2)) - slope)/(p(3) - p(1))
      end if
      if (self%by_inverse) zero = 1/max(zero, tiny(1.0_wp))
   end function zero_of_pulls

   !> The lowest failing trials of which something is known.
   pure subroutine take_lowest(values, known, lowest, of_lowest, n)
      real(wp), intent(in) :: values(:)
      real(wp), intent(in) :: known(:)         !! 0: not known
      real(wp), intent(out) :: lowest(:), of_lowest(:)
      integer, intent(out) :: n                !! number of them
      integer :: i, k, last
      n = 0
      lowest = 0
      of_lowest = 0
      last = size(lowest)
      do i = 1, size(values)
         if (.not. abs(known(i)) > 0) cycle
         k = count(lowest(:n) < values(i)) + 1
         if (k > last) cycle
         n = min(n + 1, last)
         lowest(k + 1:n) = lowest(k:n - 1)
         of_lowest(k + 1:n) = of_lowest(k:n - 1)
         lowest(k) = values(i)
         of_lowest(k) = known(i)
      end do
   end subroutine take_lowest

   !> The upper end of the cell of a value: a pull that is left there shows more of the limit than rest. The lower one
   !> when the upper one has been tried.
   pure real(wp) function end_of_cell(self, first, high, value) result(next)
      class(search_path_type), intent(in) :: self
      real(wp), intent(in) :: first(2)       !! the interval that was halved into cells
      real(wp), intent(in) :: high           !! end of a cell, tried
      real(wp), intent(in) :: value
      real(wp) :: cell(2), middle
      cell = first
      do while (.not. self%is_near(cell(1), cell(2)))
         middle = cell(1) + (cell(2) - cell(1))/2
         if (.not. (middle > cell(1) .and. middle < cell(2))) exit
         if (value > middle) then
            cell(1) = middle
         else
            cell(2) = middle
         end if
      end do
      next = merge(cell(2), cell(1), cell(2) < high)
   end function end_of_cell

   !> Find a stable and a failing value.
   pure subroutine bracket(self, values, stable, state, low, high, found)
      class(search_path_type), intent(in) :: self
      real(wp), intent(in) :: values(:)
      logical, intent(in) :: stable(:)
      type(search_state_type), intent(inout) :: state
      real(wp), intent(out) :: low, high
      logical, intent(out) :: found
      real(wp) :: step
      logical :: stays
      low = self%start
      high = self%start
      call ask(self, self%start, values, stable, state, found, stays)
      if (.not. found) return
      if (.not. stays) then
         do
            found = self%may_halve .and. high > self%lowest
            if (.not. found) state%outcome = search_end%never_stable
            if (.not. found) return
            low = max(high/2, self%lowest)
            call ask(self, low, values, stable, state, found, stays)
            if (.not. found .or. stays) return
            high = low
         end do
      end if
      step = self%first_step
      do
         high = 2*low
         if (step > 0) high = low + step
         high = min(high, self%highest)
         if (self%has_end) high = self%end
         step = self%growth*step
         call ask(self, high, values, stable, state, found, stays)
         if (.not. found .or. .not. stays) return
         found = .not. (self%has_end .or. high >= self%highest)
         if (.not. found) state%outcome = search_end%never_fails
         if (.not. found) return
         low = high
      end do
   end subroutine bracket

   !> The verdict on a value. When there is none yet, the value is the next one to be tried.
   pure subroutine ask(self, value, values, stable, state, found, stays)
      class(search_path_type), intent(in) :: self
      real(wp), intent(in) :: value
      real(wp), intent(in) :: values(:)
      logical, intent(in) :: stable(:)
      type(search_state_type), intent(inout) :: state
      logical, intent(out) :: found, stays
      integer :: i
      found = .false.
      stays = .false.
      state%next = self%sign*value + 0.0_wp   ! no negative zero
      do i = 1, size(values)
         if (abs(values(i) - state%next) > 0) cycle
         found = .true.
         stays = stable(i)
         state%used = [state%used, i]
         if (stays) then
            state%stable = state%next
         else
            state%failing = state%next
         end if
         return
      end do
   end subroutine ask

   !> Values to be tried at the same time: the next one, then those that follow from its verdict and from theirs,
   !> which are not known yet.
   pure subroutine candidates(self, values, stable, pulls, limits, n, found)
      class(search_path_type), intent(in) :: self
      real(wp), intent(in) :: values(:)
      logical, intent(in) :: stable(:)
      real(wp), intent(in) :: pulls(:), limits(:)
      integer, intent(in) :: n                         !! their largest number
      real(wp), allocatable, intent(out) :: found(:)
      type(search_state_type) :: state
      integer :: way, depth, k, j
      real(wp), allocatable :: more(:), more_pulls(:), more_limits(:)
      logical, allocatable :: guess(:)
      allocate (found(0))
      ! ways of 0, 1, 2 ... assumed verdicts, the more likely ones first
      do depth = 0, 6
         do way = 0, 2**depth - 1
            if (size(found) >= n) return
            more = values
            more_pulls = pulls
            more_limits = limits
            guess = stable
            do j = 1, depth + 1
               call self%follow(more, guess, more_pulls, more_limits, state)
               if (state%outcome /= search_end%open) exit
               if (j > depth) exit
               more = [more, state%next]
               more_pulls = [more_pulls, 0.0_wp]
               more_limits = [more_limits, 0.0_wp]
               k = way/2**(depth - j)
               guess = [guess, mod(k, 2) == 0]
            end do
            if (state%outcome /= search_end%open) cycle
            if (any(abs(found - state%next) <= 0)) cycle
            found = [found, state%next]
         end do
      end do
   end subroutine candidates

end module rockdda_run_search_path
