! SPDX-License-Identifier: MIT
!> All points where input lines meet: crossings, T junctions, corners, the ends of overlaps.
!>
!> Two lines meet where they cross, or would cross if each were no more than e0 longer at its ends. Lines that run
!> side by side closer than e0 (duplicates, collinear overlaps) do not cross: they meet at their ends, projected
!> on the other line. An end closer than e0 to a line meets it in any case.
!>
!> Each meeting is a candidate for a node, and so is each end of a line. When candidates are merged into one node,
!> the point on most lines that continue on both sides is kept, so that long straight lines stay straight and short
!> ends move; next the point on most lines; next a crossing or an end before a projected end.
module rockdda_cutting_intersections
   use rockdda_base_kinds, only : wp
   use rockdda_base_room, only : grow
   use rockdda_base_sorting, only : sorted_order
   use rockdda_geometry_grid, only : grid_type, grid_query_type
   use rockdda_geometry_point_bins, only : point_bins_type
   use rockdda_geometry_segments, only : line_intersection, nearest_parameter, segment_point, distance_to_segment
   implicit none
   private
   public :: meeting_list_type, find_meetings

   type :: meeting_list_type
      integer :: n = 0
      real(wp), allocatable :: position(:, :)   !! (2, capacity)
      integer, allocatable :: lines(:, :)       !! (2, capacity) lines i < j that meet; (i, 0): a free end of i
      real(wp), allocatable :: parameter(:, :)  !! (2, capacity) position along them: 0 at the start, 1 at the end
      logical, allocatable :: through(:, :)     !! (2, capacity) does the line continue for more than e0 on both sides?
      logical, allocatable :: foot(:)           !! (capacity) a projected end
      integer, allocatable :: pair(:, :)        !! (2, n) what the node is numbered by; not allocated: by the lines
      integer, allocatable :: rank(:)           !! (n) the highest is kept
   contains
      procedure, private :: add
   end type meeting_list_type

contains

   !> Meetings of all lines, in the order of the pairs (1,2), (1,3), ..., (2,3), ...; then the free ends.
   subroutine find_meetings(lines, skip, e0, meetings, continues)
      real(wp), intent(in) :: lines(:, :)   !! (4, n) x1, y1, x2, y2
      logical, intent(in) :: skip(:)        !! (n) lines to ignore
      real(wp), intent(in) :: e0            !! merging distance [L], > 0
      type(meeting_list_type), intent(out) :: meetings
      logical, intent(in), optional :: continues(:, :)   !! (2, n) does another line go on at the start, at the end?
      type(grid_type) :: grid
      type(grid_query_type) :: query
      integer, allocatable :: others(:)
      integer :: i, k, n, n_others
      n = size(lines, 2)
      call grid%build_segments(lines, e0)
      allocate (others(n))
      do i = 1, n
         if (skip(i)) cycle
         call grid%query_segment(lines(1:2, i), lines(3:4, i), e0, query)
         n_others = 0
         do k = 1, query%n
            if (query%ids(k) <= i) cycle
            if (skip(query%ids(k))) cycle
            n_others = n_others + 1
            others(n_others) = query%ids(k)
         end do
         others(1:n_others) = others(sorted_order(others(1:n_others)))
         do k = 1, n_others
            call meet(lines, i, others(k), e0, meetings)
         end do
      end do
      do i = 1, n
         if (skip(i)) cycle
         call meetings%add(lines(1:2, i), [i, 0], [0.0_wp, 0.0_wp], [.false., .false.], .false.)
         call meetings%add(lines(3:4, i), [i, 0], [1.0_wp, 0.0_wp], [.false., .false.], .false.)
      end do
      if (present(continues)) call go_on(lines, e0, continues, meetings)
      call rank_meetings(e0, meetings)
   end subroutine find_meetings

   !> Lines that others continue go through the meetings at that end.
   pure subroutine go_on(lines, e0, continues, meetings)
      real(wp), intent(in) :: lines(:, :)
      real(wp), intent(in) :: e0
      logical, intent(in) :: continues(:, :)
      type(meeting_list_type), intent(inout) :: meetings
      real(wp) :: length, t
      integer :: m, k, i
      do m = 1, meetings%n
         if (meetings%lines(2, m) == 0) cycle
         do k = 1, 2
            i = meetings%lines(k, m)
            if (.not. any(continues(:, i))) cycle
            length = hypot(lines(3, i) - lines(1, i), lines(4, i) - lines(2, i))
            t = meetings%parameter(k, m)
            meetings%through(k, m) = (t*length > e0 .or. continues(1, i)) .and. &
                                     ((1 - t)*length > e0 .or. continues(2, i))
         end do
      end do
   end subroutine go_on

   !> Meetings of two lines.
   pure subroutine meet(lines, i, j, e0, meetings)
      real(wp), intent(in) :: lines(:, :)
      integer, intent(in) :: i, j
      real(wp), intent(in) :: e0
      type(meeting_list_type), intent(inout) :: meetings
      real(wp) :: p(2, 2), q(2, 2), length(2), t(2), x(2), foot(2, 4), foot_t(2, 4), end(2), d
      integer :: n_feet, a, b, k
      logical :: parallel, crossing, beside
      p = reshape([lines(1:2, i), lines(1:2, j)], [2, 2])
      q = reshape([lines(3:4, i), lines(3:4, j)], [2, 2])
      if (maxval([p(1, 1), q(1, 1)]) + e0 < minval([p(1, 2), q(1, 2)])) return
      if (maxval([p(1, 2), q(1, 2)]) + e0 < minval([p(1, 1), q(1, 1)])) return
      if (maxval([p(2, 1), q(2, 1)]) + e0 < minval([p(2, 2), q(2, 2)])) return
      if (maxval([p(2, 2), q(2, 2)]) + e0 < minval([p(2, 1), q(2, 1)])) return
      length = [hypot(q(1, 1) - p(1, 1), q(2, 1) - p(2, 1)), hypot(q(1, 2) - p(1, 2), q(2, 2) - p(2, 2))]

      call line_intersection(p(:, 1), q(:, 1), p(:, 2), q(:, 2), t(1), t(2), parallel)
      crossing = .not. parallel
      if (crossing) crossing = all(t*length >= -e0) .and. all((1 - t)*length >= -e0)
      x = 0
      if (crossing) x = meeting_point(p, q, length, t, e0)

      ! ends of one line closer than e0 to the other one
      n_feet = 0
      do a = 1, 2
         b = 3 - a
         do k = 0, 1
            end = merge(p(:, a), q(:, a), k == 0)
            if (.not. distance_to_segment(end, p(:, b), q(:, b)) < e0) cycle
            n_feet = n_feet + 1
            foot_t(a, n_feet) = k
            foot_t(b, n_feet) = nearest_parameter(end, p(:, b), q(:, b))
            foot(:, n_feet) = segment_point(p(:, b), q(:, b), foot_t(b, n_feet))
         end do
      end do
      ! two of them apart: the lines run side by side between them
      beside = .false.
      do a = 1, n_feet
         do b = a + 1, n_feet
            beside = beside .or. hypot(foot(1, a) - foot(1, b), foot(2, a) - foot(2, b)) > e0
         end do
      end do
      if (crossing .and. .not. beside) call meetings%add(x, [i, j], t, passes(t, length, e0), .false.)
      do k = 1, n_feet
         if (crossing .and. .not. beside) then
            d = hypot(foot(1, k) - x(1), foot(2, k) - x(2))
            if (d < e0) cycle
         end if
         call meetings%add(foot(:, k), [i, j], foot_t(:, k), passes(foot_t(:, k), length, e0), .true.)
      end do
   end subroutine meet

   !> Position of a crossing: exactly an end of a line where it is one up to rounding, else on the line that continues.
   pure function meeting_point(p, q, length, t, e0) result(x)
      real(wp), intent(in) :: p(2, 2), q(2, 2)   !! starts and ends of both lines
      real(wp), intent(in) :: length(2), t(2), e0
      real(wp) :: x(2)
      real(wp) :: tiny_distance, end(2)
      logical :: through(2)
      integer :: a, k
      through = passes(t, length, e0)
      a = 1
      if (through(2) .and. .not. through(1)) a = 2
      x = p(:, a) + t(a)*(q(:, a) - p(:, a))
      if (t(a) > 0.5_wp) x = q(:, a) - (1 - t(a))*(q(:, a) - p(:, a))
      ! a coordinate that is constant along a line is exact
      do a = 1, 2
         do k = 1, 2
            if (.not. abs(q(k, a) - p(k, a)) > 0) x(k) = p(k, a)
         end do
      end do
      tiny_distance = 64*epsilon(1.0_wp)*max(maxval(abs(p)), maxval(abs(q)))
      do a = 1, 2
         do k = 0, 1
            end = merge(p(:, a), q(:, a), k == 0)
            if (all(abs(x - end) <= tiny_distance)) then
               x = end
               return
            end if
         end do
      end do
   end function meeting_point

   !> Does a line continue for more than e0 on both sides of parameter t?
   pure elemental logical function passes(t, length, e0)
      real(wp), intent(in) :: t, length, e0
      passes = t*length > e0 .and. (1 - t)*length > e0
   end function passes

   !> Ranks from the lines that meet in one point, up to a millionth of e0.
   pure subroutine rank_meetings(e0, meetings)
      real(wp), intent(in) :: e0
      type(meeting_list_type), intent(inout) :: meetings
      type(point_bins_type) :: places
      integer, allocatable :: place(:), order(:), n_lines(:), n_through(:), line(:)
      logical, allocatable :: through(:)
      real(wp) :: box(4)
      integer :: n, m, k, i, last
      logical :: last_through
      n = meetings%n
      allocate (meetings%rank(n), place(2*n), line(2*n), through(2*n))
      if (n == 0) return
      box = [minval(meetings%position(1, 1:n)), minval(meetings%position(2, 1:n)), &
             maxval(meetings%position(1, 1:n)), maxval(meetings%position(2, 1:n))]
      call places%init(box, n, 1.0e-6_wp*e0)
      do m = 1, n
         k = places%nearest(meetings%position(:, m), 1.0e-6_wp*e0)
         if (k == 0) call places%add(meetings%position(:, m), k)
         place(2*m - 1:2*m) = k
         line(2*m - 1:2*m) = meetings%lines(:, m)
         through(2*m - 1:2*m) = meetings%through(:, m)
      end do
      ! the distinct lines of each point: equal ones become neighbours
      allocate (order(2*n), n_lines(places%n), n_through(places%n))
      order(:) = sorted_order(line)
      order(:) = order(sorted_order(place(order)))
      n_lines = 0
      n_through = 0
      last = 0
      last_through = .false.
      do i = 1, 2*n
         k = order(i)
         if (line(k) == 0) cycle
         if (line(k) == last .and. i > 1) then
            if (place(order(i - 1)) == place(k)) then
               if (through(k) .and. .not. last_through) n_through(place(k)) = n_through(place(k)) + 1
               last_through = last_through .or. through(k)
               cycle
            end if
         end if
         last = line(k)
         last_through = through(k)
         n_lines(place(k)) = n_lines(place(k)) + 1
         if (through(k)) n_through(place(k)) = n_through(place(k)) + 1
      end do
      do m = 1, n
         k = place(2*m)
         meetings%rank(m) = 2000*min(n_through(k), 1000) + 2*min(n_lines(k), 999) + merge(0, 1, meetings%foot(m))
      end do
   end subroutine rank_meetings

   !> Append a candidate.
   pure subroutine add(self, position, lines, parameter, through, foot)
      class(meeting_list_type), intent(inout) :: self
      real(wp), intent(in) :: position(2), parameter(2)
      integer, intent(in) :: lines(2)
      logical, intent(in) :: through(2), foot
      logical, allocatable :: throughs(:, :)
      integer :: n
      n = self%n + 1
      call grow(self%position, n, 2)
      call grow(self%parameter, n, 2)
      call grow(self%lines, n, 2)
      call grow(self%foot, n)
      if (.not. allocated(self%through)) allocate (self%through(2, 0))
      if (n > size(self%through, 2)) then
         allocate (throughs(2, size(self%foot)))
         throughs(:, :n - 1) = self%through(:, :n - 1)
         call move_alloc(throughs, self%through)
      end if
      self%n = n
      self%position(:, n) = position
      self%parameter(:, n) = parameter
      self%lines(:, n) = lines
      self%through(:, n) = through
      self%foot(n) = foot
   end subroutine add

end module rockdda_cutting_intersections
