! SPDX-License-Identifier: MIT
!> Lines that lie on each other, and the parts of them that count.
!>
!> Of lines on one line, up to the resolution of their coordinates, the last one in the file holds where they overlap.
!> They are split where one of them begins or ends, and of those between two such places the last one is kept: n lines
!> have at most 2n - 1 parts, and not n^2 meetings and pieces.
!>
!>     line 1   o---------------o
!>     line 2            o--------------o          line    1        2      2
!>     parts    o--------o------o-------o          first   1        1      2
!>
!> Nodes are numbered by the first lines that meet there. Lines without an overlap are one part each.
module rockdda_cutting_overlaps
   use rockdda_base_kinds, only : wp, pi
   use rockdda_base_sorting, only : sorted_order
   use rockdda_geometry_segments, only : cross_product
   use rockdda_cutting_intersections, only : meeting_list_type
   implicit none
   private
   public :: visible_lines_type, find_visible

   type :: visible_lines_type
      integer :: n = 0
      real(wp), allocatable :: segments(:, :)   !! (4, n) x1, y1, x2, y2 of each part, in the direction of its line
      integer, allocatable :: line(:)           !! (n) its line, in ascending order
      integer, allocatable :: first(:)          !! (n) the first of all lines there
      integer, allocatable :: at_ends(:, :, :)  !! (2, 2, n) first two lines that meet at its start and end; 0: alone
      logical, allocatable :: continues(:, :)   !! (2, n) does a line go on beyond its start, its end?
      logical, allocatable :: skip(:)           !! (n) of a line to ignore
      integer, allocatable :: along(:)          !! (n) numbers of the parts: those of overlapping lines along them
      integer, allocatable :: from(:), to(:)    !! (lines) places in `along` of the parts over which the line extends
      type(meeting_list_type) :: meetings       !! of the parts, when they have been found
      integer, allocatable :: part(:)           !! (pieces) part of each piece, in ascending order; likewise
   contains
      procedure :: pairs
      procedure, private :: split, add_part
   end type visible_lines_type

   !> Lines of about one direction: far above its rounding, far below what lines of one joint set differ by.
   real(wp), parameter :: same_direction = 1.0e-9_wp

contains

   !> Find the visible parts of lines.
   pure subroutine find_visible(lines, skip, visible)
      real(wp), intent(in) :: lines(:, :)      !! (4, n) x1, y1, x2, y2
      logical, intent(in) :: skip(:)           !! (n) lines to ignore
      type(visible_lines_type), intent(out) :: visible
      integer, allocatable :: order(:)
      real(wp) :: angle(size(skip)), resolution, d(2)
      integer :: i, n, first, last
      n = size(skip)
      resolution = 64*epsilon(1.0_wp)*maxval(abs(lines))
      ! k lines that overlap have at most 2k - 1 parts
      allocate (visible%segments(4, 2*n), visible%line(2*n), visible%first(2*n), visible%at_ends(2, 2, 2*n))
      allocate (visible%continues(2, 2*n))
      allocate (visible%from(n), visible%to(n), source=0)
      do i = 1, n
         d = lines(3:4, i) - lines(1:2, i)
         angle(i) = atan2(d(2), d(1))
         if (angle(i) <= -0.5_wp*pi) angle(i) = angle(i) + pi
         if (angle(i) > 0.5_wp*pi) angle(i) = angle(i) - pi
      end do
      order = pack([(i, i=1, n)],.not. skip)
      order = order(sorted_order(angle(order)))
      first = 1
      do while (first <= size(order))
         last = first
         do while (last < size(order))
            if (angle(order(last + 1)) - angle(order(last)) > same_direction) exit
            last = last + 1
         end do
         if (last > first) call split_parallel(lines, order(first:last), resolution, visible)
         first = last + 1
      end do
      do i = 1, n
         if (visible%from(i) > 0) cycle
         call visible%add_part(lines(:, i), i, i)
         visible%from(i) = visible%n
         visible%to(i) = visible%n
      end do
      ! in the order of the lines
      n = visible%n
      order = sorted_order(visible%line(1:n))
      visible%segments = visible%segments(:, order)
      visible%line = visible%line(order)
      visible%first = visible%first(order)
      visible%at_ends = visible%at_ends(:, :, order)
      visible%continues = visible%continues(:, order)
      allocate (visible%along(n))
      visible%along(order) = [(i, i=1, n)]
      visible%skip = skip(visible%line)
   end subroutine find_visible

   !> Split lines of one direction where they overlap.
   pure subroutine split_parallel(lines, members, resolution, visible)
      real(wp), intent(in) :: lines(:, :)
      integer, intent(in) :: members(:)
      real(wp), intent(in) :: resolution       !! of coordinates [L]
      type(visible_lines_type), intent(inout) :: visible
      real(wp) :: offset(size(members)), u(2), origin(2)
      integer :: order(size(members)), k, first, last
      call take_longest(lines, members, origin, u)
      do k = 1, size(members)
         associate (line => lines(:, members(k)))
            offset(k) = cross_product(u, 0.5_wp*(line(1:2) - origin) + 0.5_wp*(line(3:4) - origin))
         end associate
      end do
      order(:) = sorted_order(offset)
      first = 1
      do while (first <= size(members))
         last = first
         do while (last < size(members))
            if (offset(order(last + 1)) - offset(order(last)) > resolution) exit
            last = last + 1
         end do
         if (last > first) call split_collinear(lines, members(order(first:last)), resolution, visible)
         first = last + 1
      end do
   end subroutine split_parallel

   !> Start and direction of the longest of some lines.
   pure subroutine take_longest(lines, members, origin, u)
      real(wp), intent(in) :: lines(:, :)
      integer, intent(in) :: members(:)
      real(wp), intent(out) :: origin(2), u(2)
      integer :: k
      k = members(maxloc(hypot(lines(3, members) - lines(1, members), lines(4, members) - lines(2, members)), 1))
      origin = lines(1:2, k)
      u = lines(3:4, k) - origin
      u = u/hypot(u(1), u(2))
   end subroutine take_longest

   !> Split those of some lines that lie on the longest one's line, where they overlap.
   pure subroutine split_collinear(lines, members, resolution, visible)
      real(wp), intent(in) :: lines(:, :)
      integer, intent(in) :: members(:)
      real(wp), intent(in) :: resolution
      type(visible_lines_type), intent(inout) :: visible
      real(wp) :: ends(2, size(members)), origin(2), u(2), reach
      integer, allocatable :: order(:)
      logical :: lies_there(size(members))
      integer :: k, j, first, last
      call take_longest(lines, members, origin, u)
      do k = 1, size(members)
         do j = 1, 2
            associate (d => lines(2*j - 1:2*j, members(k)) - origin)
               ends(j, k) = dot_product(u, d)
               lies_there(k) = abs(cross_product(u, d)) <= resolution .and. (j == 1 .or. lies_there(k))
            end associate
         end do
      end do
      order = pack([(k, k=1, size(members))], lies_there)
      order = order(sorted_order(minval(ends(:, order), 1)))
      first = 1
      do while (first <= size(order))
         last = first
         reach = maxval(ends(:, order(first)))
         do while (last < size(order))
            if (minval(ends(:, order(last + 1))) >= reach - resolution) exit
            last = last + 1
            reach = max(reach, maxval(ends(:, order(last))))
         end do
         if (last > first) call visible%split(lines, members(order(first:last)), ends(:, order(first:last)), resolution)
         first = last + 1
      end do
   end subroutine split_collinear

   !> Split lines that overlap.
   pure subroutine split(self, lines, members, ends, resolution)
      class(visible_lines_type), intent(inout) :: self
      real(wp), intent(in) :: lines(:, :)
      integer, intent(in) :: members(:)
      real(wp), intent(in) :: ends(:, :)           !! (2, members) places of start and end along the line
      real(wp), intent(in) :: resolution
      real(wp) :: place(2, 2*size(members)), coordinate(2*size(members))
      integer :: low(size(members)), high(size(members)), at(2, size(members)), order(2*size(members))
      integer, dimension(0:2*size(members)) :: last, first, second
      integer, dimension(2*size(members)) :: ending, across
      integer, allocatable :: ascending(:)
      integer :: k, j, n, i, before
      ! places where lines begin or end; equal ones are one. No line is shorter than the resolution
      order(:) = sorted_order(reshape(ends, [size(ends)]))
      n = 0
      before = 0
      do i = 1, size(order)
         k = (order(i) + 1)/2
         j = order(i) - 2*(k - 1)
         if (n > 0) then
            if (ends(j, k) - coordinate(n) > 0.25_wp*resolution) n = n + 1
         else
            n = 1
         end if
         if (n > before) then
            coordinate(n) = ends(j, k)
            place(:, n) = lines(2*j - 1:2*j, members(k))
            before = n
         end if
         at(j, k) = n
      end do
      low = minval(at, 1)
      high = maxval(at, 1)
      ! the lines of each interval between neighbouring places: the last, the first, and the one after it
      ascending = sorted_order(members)
      last = 0
      first = 0
      second = 0
      call paint(ascending(size(members):1:-1), low, high, last(1:n - 1))
      call paint(ascending, low, high, first(1:n - 1), second(1:n - 1))
      ! the first line that begins or ends at each place, and how many go on there
      ending = 0
      across = 0
      do i = size(members), 1, -1
         k = ascending(i)
         ending(low(k)) = k
         ending(high(k)) = k
         across(low(k) + 1) = across(low(k) + 1) + 1
         across(high(k)) = across(high(k)) - 1
      end do
      do i = 2, n
         across(i) = across(i - 1) + across(i)
      end do
      self%from(members) = self%n + low
      self%to(members) = self%n + high - 1
      do i = 1, n - 1
         k = last(i)
         associate (line => lines(:, members(k)))
            if (at(1, k) < at(2, k)) then
               call self%add_part(part_of(line, i, i + 1, at(:, k)), members(k), members(first(i)))
               self%at_ends(:, 1, self%n) = lines_at(i)
               self%at_ends(:, 2, self%n) = lines_at(i + 1)
               self%continues(:, self%n) = across(i:i + 1) > 0
            else
               call self%add_part(part_of(line, i + 1, i, at(:, k)), members(k), members(first(i)))
               self%at_ends(:, 1, self%n) = lines_at(i + 1)
               self%at_ends(:, 2, self%n) = lines_at(i)
               self%continues(:, self%n) = across(i + 1:i:-1) > 0
            end if
         end associate
      end do

   contains

      !> The part of a line from one place to another. Its own ends are its own.
      pure function part_of(line, a, b, at) result(segment)
         real(wp), intent(in) :: line(4)
         integer, intent(in) :: a, b, at(2)
         real(wp) :: segment(4)
         segment = [place(:, a), place(:, b)]
         if (at(1) == a) segment(1:2) = line(1:2)
         if (at(2) == b) segment(3:4) = line(3:4)
      end function part_of

      !> The first two lines i < j that meet at a place: one of them begins or ends there. 0, 0 where one line is alone.
      pure function lines_at(p) result(pair)
         integer, intent(in) :: p
         integer :: pair(2), there(5), k, one
         there = [first(p - 1), second(p - 1), first(p), second(p), ending(p)]
         pair = huge(pair)
         do k = 1, 4
            if (there(k) == 0) cycle
            one = members(there(k))
            if (one < pair(1)) pair = [one, pair(1)]
            if (one > pair(1) .and. one < pair(2)) pair(2) = one
         end do
         one = members(there(5))
         if (pair(1) /= one) pair(2) = one
         if (pair(2) == huge(pair)) pair = 0
      end function lines_at

   end subroutine split

   !> Give each interval the first of the lines that cover it, and the second. Intervals that have them are skipped:
   !> each line continues from the next one that has not.
   pure subroutine paint(order, low, high, color, second)
      integer, intent(in) :: order(:)                !! lines, the first one first
      integer, intent(in) :: low(:), high(:)         !! of each line: intervals low ... high - 1
      integer, intent(inout) :: color(:)             !! 0 before
      integer, intent(inout), optional :: second(:)  !! 0 before
      integer :: next(size(color) + 1), k, i
      next = [(i, i=1, size(next))]
      do k = 1, size(order)
         i = low(order(k))
         do
            call go_to_free(next, i)
            if (i >= high(order(k))) exit
            if (color(i) == 0) then
               color(i) = order(k)
            else if (present(second)) then
               second(i) = order(k)
            end if
            if (.not. present(second)) then
               next(i) = i + 1
            else if (second(i) > 0) then
               next(i) = i + 1
            end if
            i = i + 1
         end do
      end do
   end subroutine paint

   !> Go from interval i on to the next one that is not painted; halves the way there.
   pure subroutine go_to_free(next, i)
      integer, intent(inout) :: next(:)            !! (intervals + 1) a later interval, or itself where not painted
      integer, intent(inout) :: i
      do while (next(i) /= i)
         next(i) = next(next(i))
         i = next(i)
      end do
   end subroutine go_to_free

   !> Append a part.
   pure subroutine add_part(self, segment, line, first)
      class(visible_lines_type), intent(inout) :: self
      real(wp), intent(in) :: segment(4)
      integer, intent(in) :: line, first
      self%n = self%n + 1
      self%segments(:, self%n) = segment
      self%line(self%n) = line
      self%first(self%n) = first
      self%at_ends(:, :, self%n) = 0
      self%continues(:, self%n) = .false.
   end subroutine add_part

   !> The first lines i < j of parts that meet (second part 0: none, at an end); j huge where no other line is there.
   pure function pairs(self, parts, parameter) result(lines)
      class(visible_lines_type), intent(in) :: self
      integer, intent(in) :: parts(:, :)           !! (2, n)
      real(wp), intent(in), optional :: parameter(:, :)   !! (2, n) 0 at the start of a part, 1 at its end
      integer :: lines(2, size(parts, 2))
      integer :: m, a, b
      do m = 1, size(parts, 2)
         a = parts(1, m)
         b = parts(2, m)
         lines(:, m) = [self%first(a), huge(lines)]
         if (b > 0) then
            if (self%first(a) /= self%first(b)) lines(:, m) = [min(self%first(a), self%first(b)), &
                                                               max(self%first(a), self%first(b))]
         else if (present(parameter)) then
            associate (there => self%at_ends(:, merge(1, 2, parameter(1, m) < 0.5_wp), a))
               if (there(1) > 0) lines(:, m) = there
            end associate
         end if
      end do
   end function pairs

end module rockdda_cutting_overlaps
