! SPDX-License-Identifier: MIT
!> Where the nodes and segments of a lining lie on its line.
!>
!> A node lies at both ends of an open line and at each corner. Where one block follows another a segment ends, so that
!> no segment holds two blocks together: they have one or more segments each, with a node in the middle. Along one block
!> nodes have equal distances, and a segment reaches from the middle between two nodes to the next one. The path holds
!> the points of the line, the nodes and the ends of the segments, in this order along it; that of a closed
!> line begins and ends half-way before the first node.
module rockdda_model_liner_layout
   use rockdda_base_kinds, only : wp
   use rockdda_base_room, only : grow
   use rockdda_base_sorting, only : sorted_order
   use rockdda_base_strings, only : is_given, to_string
   use rockdda_model_blocks, only : block_system_type, largest_coordinate
   use rockdda_model_bolt_layout, only : outer_line
   use rockdda_model_options, only : liner_type, region_type, is_set
   use rockdda_model_regions, only : blocks_of_region, same_name
   implicit none
   private
   public :: liner_layout_type, new_liner_layout, line_of_liner, title_of_liner, lower_liner, liner_number, &
      layout_problem, lift, last_below

   !> More nodes are a slip of a coordinate, or of `element`.
   integer, parameter :: most_nodes = 10000
   !> Nodes around a closed line, at least, where `element` is not given.
   integer, parameter :: least_around = 24
   !> A line that turns by more is no curve there, but has a corner: cosine of 30 degrees.
   real(wp), parameter :: corner = 0.866_wp

   !> Chords of a curve are no longer than their neighbours by this factor; it leaves them by at most this share of the
   !> thickness; its parts turn by this angle. Points at which a line turns by less than `straight` are none of it.
   real(wp), parameter :: alike = 1.5_wp
   real(wp), parameter :: most_beside = 0.25_wp
   real(wp), parameter :: part = 0.0087_wp
   real(wp), parameter :: straight = 1.0e-3_wp

   !> Blocks along less of the line than this share of the largest distance lie below the segment of the next one.
   real(wp), parameter :: sliver = 0.25_wp
   !> Share of the next block that a segment at a corner takes.
   real(wp), parameter :: small = 0.05_wp

   type :: liner_layout_type
      integer :: n = 0                       !! nodes, and segments
      logical :: closed = .false.
      real(wp), allocatable :: path(:, :)    !! (2, points) [length]
      integer, allocatable :: node(:)        !! (n) points of the path
      integer, allocatable :: first(:), last(:)   !! (n) points that the segments begin and end with
      real(wp) :: start = 0                  !! of the path, distance from the start of the line, <= 0 [length]
      real(wp) :: largest = 0                !! distance of nodes [length]
   end type liner_layout_type

contains

   !> Name of a lining, or its number.
   pure function title_of_liner(liner, number) result(title)
      type(liner_type), intent(in) :: liner
      integer, intent(in) :: number
      character(len=:), allocatable :: title
      title = 'liner '//to_string(number)
      if (is_given(liner%name)) title = trim(adjustl(liner%name))
   end function title_of_liner

   !> Number of the lining with a name; 0: none.
   pure integer function liner_number(liners, name) result(k)
      type(liner_type), intent(in) :: liners(:)
      character(len=*), intent(in) :: name
      do k = 1, size(liners)
         if (same_name(title_of_liner(liners(k), k), name)) return
      end do
      k = 0
   end function liner_number

   !> The lining on which a layer lies; 0: the rock.
   pure integer function lower_liner(liners, k) result(lower)
      type(liner_type), intent(in) :: liners(:)
      integer, intent(in) :: k
      lower = 0
      if (.not. is_given(liners(k)%on)) return
      lower = liner_number(liners(1:k - 1), trim(adjustl(liners(k)%on)))
   end function lower_liner

   !> The line of a lining: x y of its points, rounded; that of the lining on which it lies.
   pure recursive function line_of_liner(liners, k, blocks, regions, as_drawn) result(line)
      type(liner_type), intent(in) :: liners(:)
      integer, intent(in) :: k
      type(block_system_type), intent(in) :: blocks
      type(region_type), intent(in) :: regions(:)
      logical, intent(in), optional :: as_drawn      !! not rounded
      real(wp), allocatable :: line(:)
      if (lower_liner(liners, k) > 0) then
         line = line_of_liner(liners, lower_liner(liners, k), blocks, regions, as_drawn)
         return
      end if
      allocate (line(0))
      if (allocated(liners(k)%along)) then
         line = liners(k)%along
      else if (is_given(liners(k)%outline)) then
         line = outer_line(blocks, blocks_of_region(blocks, regions, liners(k)%outline))
      end if
      if (.not. present(as_drawn)) line = rounded(line, liners(k)%thickness)
   end function line_of_liner

   !> A line with arcs where its points lie on a curve, which a chain of chords bends like a polygon: by N/24 s^2/R, a
   !> quarter of the moment in a round hole of 64 edges. Two points in a row that turn alike, with alike distances
   !> around them, are points of a curve, which continues to a corner or an end.
   pure function rounded(line, thickness) result(curve)
      real(wp), intent(in) :: line(:)        !! x y of its points [length]
      real(wp), intent(in) :: thickness      !! [length]
      real(wp), allocatable :: curve(:)
      real(wp), allocatable :: v(:, :), s(:), chord(:, :), length(:), bend(:)
      real(wp) :: bow, t, turn
      logical, allocatable :: ends(:)
      integer :: before, i, k, m, n
      logical :: closed
      curve = line
      call measure(line, v, s, closed)
      if (closed) v = v(:, :size(v, 2) - 1)
      m = size(v, 2)
      v = v(:, pack([(k, k=1, m)], [((.not. closed .and. (k == 1 .or. k == m)) .or. &
                                    abs(turn_at(k)) > straight, k=1, m)]))
      m = size(v, 2)
      n = m - merge(0, 1, closed)            ! chords, from the points of their number
      if (n < 3) return
      chord = v(:, [(1 + mod(k, m), k=1, n)]) - v(:, :n)
      length = norm2(chord, 1)
      allocate (bend(m), source=0.0_wp)
      allocate (ends(m), source=.false.)
      do k = 1, m
         ends(k) = .not. closed .and. (k == 1 .or. k == m)
         if (ends(k)) cycle
         before = 1 + modulo(k - 2, m)
         ends(k) = turns(chord(:, before), chord(:, k))
         if (ends(k) .or. max(length(before), length(k)) > alike*min(length(before), length(k))) cycle
         turn = turn_at(k)
         bend(k) = 4*sin(0.5_wp*turn)/(length(before) + length(k))
      end do
      curve = v(:, 1)
      do k = 1, n
         bow = 0.125_wp*length(k)**2*bend_of(k, 1 + mod(k, m))
         if (abs(bow) > most_beside*thickness) bow = 0
         m = max(1, ceiling(8*abs(bow)/(length(k)*part)))
         do i = 1, m
            t = real(i, wp)/m
            curve = [curve, v(:, k) + t*chord(:, k) + 4*bow*t*(1 - t)*[chord(2, k), -chord(1, k)]/length(k)]
         end do
         m = size(v, 2)
      end do

   contains

      !> Angle by which the line turns at a point, positive to the left.
      pure real(wp) function turn_at(k)
         integer, intent(in) :: k
         real(wp) :: a(2), b(2)
         a = v(:, k) - v(:, 1 + modulo(k - 2, size(v, 2)))
         b = v(:, 1 + modulo(k, size(v, 2))) - v(:, k)
         turn_at = atan2(a(1)*b(2) - a(2)*b(1), dot_product(a, b))
      end function turn_at

      !> Curvature between two points; 0: they lie on no curve.
      pure real(wp) function bend_of(a, b)
         integer, intent(in) :: a, b
         bend_of = 0
         if (bend(a)*bend(b) > 0) then
            bend_of = 0.5_wp*(bend(a) + bend(b))
         else if (ends(b)) then
            if (bend(a)*bend(1 + modulo(a - 2, size(bend))) > 0) bend_of = bend(a)
         else if (ends(a)) then
            if (bend(b)*bend(1 + modulo(b, size(bend))) > 0) bend_of = bend(b)
         end if
      end function bend_of

   end function rounded

   !> Why a line cannot be divided: it has no length, no finite one, or would have too many nodes. Empty: it can.
   pure function layout_problem(line, thickness, element) result(problem)
      real(wp), intent(in) :: line(:)        !! x y of its points [length]
      real(wp), intent(in) :: thickness      !! [length]
      real(wp), intent(in) :: element        !! largest distance of nodes, or not given [length]
      character(len=:), allocatable :: problem
      real(wp), allocatable :: v(:, :), s(:)
      real(wp) :: largest, n
      integer :: k
      logical :: closed
      problem = ''
      do k = 1, size(line)
         if (abs(line(k)) <= largest_coordinate) cycle
         problem = 'a coordinate of its line is '//to_string(line(k), 4)//', possible is up to '// &
                   to_string(largest_coordinate, 4)
         return
      end do
      call measure(line, v, s, closed)
      if (size(s) < 2) return
      largest = distance_of_nodes(s(size(s)), closed, thickness, element)
      n = max(s(size(s))/largest, real(size(s), wp) - 1)
      if (n <= most_nodes) return
      problem = 'it would have '//to_string(n, 3)//' segments, at most '//to_string(most_nodes)//' are possible: '// &
                'its line is '//to_string(s(size(s)), 4)//' long, x from '//range_of(1)//', y from '//range_of(2)
      if (n > s(size(s))/largest) then
         problem = problem//', with '//to_string(size(s))//' points: leave points out'
      else if (is_set(element)) then
         problem = problem//', and element = '//to_string(element, 4)//': correct the coordinates or make '// &
                   'element larger'
      else
         problem = problem//', and nodes are '//to_string(largest, 4)//' apart, as thickness = '// &
                   to_string(thickness, 4)//' has it: correct the coordinates or the thickness, or give element'
      end if

   contains

      !> '-5 to 5'
      pure function range_of(axis) result(text)
         integer, intent(in) :: axis
         character(len=:), allocatable :: text
         text = to_string(minval(line(axis::2)), 4)//' to '//to_string(maxval(line(axis::2)), 4)
      end function range_of

   end function layout_problem

   !> Points of a line, no two in a row one, and their distances from its start; whether it ends where it begins.
   pure subroutine measure(line, v, s, closed)
      real(wp), intent(in) :: line(:)
      real(wp), allocatable, intent(out) :: v(:, :), s(:)
      logical, intent(out) :: closed
      real(wp) :: near
      integer :: k, m
      m = size(line)/2
      v = reshape(line(1:2*m), [2, m])
      near = nearness(v)
      v = distinct(v, near)
      m = size(v, 2)
      closed = .false.
      if (m > 3) closed = norm2(v(:, m) - v(:, 1)) <= near
      allocate (s(m))
      if (m > 0) s(1) = 0
      do k = 2, m
         s(k) = s(k - 1) + norm2(v(:, k) - v(:, k - 1))
      end do
   end subroutine measure

   !> Points closer than this are one.
   pure real(wp) function nearness(v)
      real(wp), intent(in) :: v(:, :)
      nearness = 1.0e-9_wp*maxval([0.0_wp, maxval(v, 2) - minval(v, 2)])
   end function nearness

   !> Largest distance of nodes.
   pure real(wp) function distance_of_nodes(length, closed, thickness, element) result(largest)
      real(wp), intent(in) :: length, thickness, element
      logical, intent(in) :: closed
      largest = 2*thickness
      if (closed) largest = min(largest, length/least_around)
      if (is_set(element)) largest = element
   end function distance_of_nodes

   !> Nodes and segments on a line; each segment lies on one block. Without points where the line has no length.
   pure type(liner_layout_type) function new_liner_layout(line, thickness, element, breaks, seams) result(layout)
      real(wp), intent(in) :: line(:)        !! x y of its points [length]
      real(wp), intent(in) :: thickness      !! [length]
      real(wp), intent(in) :: element        !! largest distance of nodes, or not given [length]
      real(wp), intent(in), optional :: breaks(:)   !! distances from its start at which there are nodes, too [length]
      real(wp), intent(in), optional :: seams(:)    !! at which one block of the rock follows another [length]
      real(wp), allocatable :: v(:, :), s(:), nodes(:), ends(:), places(:), corners(:), joints(:)
      real(wp) :: near, length, largest
      integer :: k, m, n
      logical :: smooth
      call measure(line, v, s, layout%closed)
      m = size(v, 2)
      if (m < 2) return
      near = nearness(v)
      length = s(m)
      largest = max(distance_of_nodes(length, layout%closed, thickness, element), length/most_nodes)
      layout%largest = largest
      ! stretches between corners
      corners = pack(s(2:m - 1), [(turns(v(:, k) - v(:, k - 1), v(:, k + 1) - v(:, k)), k=2, m - 1)])
      if (layout%closed) then
         if (turns(v(:, m) - v(:, m - 1), v(:, 2) - v(:, 1))) corners = [s(1), corners]
      else
         corners = [s(1), corners]
      end if
      if (present(breaks)) then
         do k = 1, size(breaks)
            call add_break(modulo(breaks(k), length), corners)
         end do
         corners = corners(sorted_order(corners))
      end if
      smooth = size(corners) == 0
      if (smooth) corners = [s(1)]
      corners = [corners, corners(1) + length]
      allocate (nodes(0), ends(0), joints(0))
      if (present(seams)) joints = modulo(seams, length)
      if (present(seams) .and. layout%closed) joints = [joints - length, joints, joints + length]
      if (size(joints) > 0) joints = joints(sorted_order(joints))
      n = 0
      do k = 1, size(corners) - 1
         call divide(corners(k), corners(k + 1), smooth, joints, nodes, ends, n)
      end do
      nodes = nodes(:n)
      ends = ends(:n)
      if (.not. layout%closed) then
         nodes = [nodes, length]
         ends = [0.0_wp, ends, length]
      else if (.not. ends(1) < nodes(1)) then
         ends = [ends(size(ends)) - length, ends]
      else
         ends = [ends, ends(1) + length]
      end if
      layout%n = size(nodes)
      layout%start = ends(1)
      ! points of the line, not where a node or an end of a segment is
      places = [s(:m - 1) - length, s(:m - 1), s + length]
      places = pack(places, places >= ends(1) - near .and. places <= ends(size(ends)) + near)
      places = pack(places, [(min(gap(places(k), nodes), gap(places(k), ends)) > near, k=1, size(places))])
      places = [nodes, ends, places]
      places = places(sorted_order(places))
      places = pack(places, [.true., places(2:) - places(:size(places) - 1) > near])
      allocate (layout%path(2, size(places)), layout%node(layout%n), layout%first(layout%n), layout%last(layout%n))
      do k = 1, size(places)
         layout%path(:, k) = at(places(k))
      end do
      do k = 1, layout%n
         layout%node(k) = closest(nodes(k), places)
         layout%first(k) = closest(ends(k), places)
         layout%last(k) = closest(ends(k + 1), places)
      end do

   contains

      !> Nodes and ends of segments between two corners, the first of which has a node, but where a smooth line begins.
      pure subroutine divide(a, b, smooth, joints, nodes, ends, n)
         real(wp), intent(in) :: a, b
         logical, intent(in) :: smooth
         real(wp), intent(in) :: joints(:)         !! ascending
         real(wp), allocatable, intent(inout) :: nodes(:), ends(:)
         integer, intent(inout) :: n               !! of both
         real(wp), allocatable :: cells(:), parts(:)
         integer :: i, j, k, n_parts
         ! where a smooth line begins one block may follow another, too
         i = last_below(a + merge(-0.01_wp, 0.01_wp, smooth)*largest, joints)
         j = last_below(b - 0.01_wp*largest, joints)
         allocate (cells, source=joints(i + 1:j))
         if (size(cells) > 1) cells = pack(cells, [.true., cells(2:) - cells(:size(cells) - 1) > sliver*largest])
         if (smooth .and. size(cells) > 0) then
            cells = [cells, cells(1) + length]
         else
            cells = [a, cells, b]
         end if
         if (size(cells) < 3 .and. .not. (has_seam(a) .or. has_seam(b))) then
            j = max(1, ceiling((b - a)/largest - 1.0e-6_wp))
            if (layout%closed .and. smooth) j = max(3, j)
            call add([(a + i*(b - a)/j, i=0, j - 1)], nodes, n)
            n = n - j
            call add([(a + (i - 0.5_wp)*(b - a)/j, i=1, j)], ends, n)
            return
         end if
         allocate (parts(0))
         n_parts = 0
         call add([cells(1)], parts, n_parts)
         do i = 2, size(cells)
            associate (c => cells(i) - cells(i - 1))
               j = max(1, nint(c/largest))
               call add([(cells(i - 1) + k*c/j, k=1, j)], parts, n_parts)
            end associate
         end do
         j = n_parts
         if (smooth) then
            call add(0.5_wp*(parts(2:j) + parts(:j - 1)), nodes, n)
            n = n - (j - 1)
            call add(parts(:j - 1), ends, n)
         else
            call add([a, 0.5_wp*(parts(2:j) + parts(:j - 1))], nodes, n)
            n = n - j
            call add([a + merge(0.0_wp, small, has_seam(a))*(parts(2) - a), parts(2:j - 1), b - small* &
                      (b - parts(j - 1))], ends, n)
         end if
      end subroutine divide

      !> Does one block follow another there? A segment that lay on both would hold them together. Where one of them
      !> goes in a later stage it holds the one that stays.
      pure logical function has_seam(place)
         real(wp), intent(in) :: place
         has_seam = any(abs(joints - place) < 0.01_wp*largest)
         if (present(breaks)) has_seam = has_seam .and. .not. &
                                         any(abs(modulo(breaks, length) - modulo(place, length)) < 0.1_wp*thickness)
      end function has_seam

      !> Numbers behind the n of a list, which grows by more than they need.
      pure subroutine add(more, list, n)
         real(wp), intent(in) :: more(:)
         real(wp), allocatable, intent(inout) :: list(:)
         integer, intent(inout) :: n
         call grow(list, n + size(more))
         list(n + 1:n + size(more)) = more
         n = n + size(more)
      end subroutine add

      !> One more place of a node, unless one is close.
      pure subroutine add_break(at, corners)
         real(wp), intent(in) :: at
         real(wp), allocatable, intent(inout) :: corners(:)
         if (any(min(abs(corners - at), length - abs(corners - at)) < 0.1_wp*thickness)) return
         corners = [corners, at]
      end subroutine add_break

      !> Point of the line at a distance from its start.
      pure function at(distance) result(point)
         real(wp), intent(in) :: distance
         real(wp) :: point(2), d, share
         integer :: k
         d = distance
         if (layout%closed) d = modulo(d, length)
         k = max(1, min(m - 1, last_below(d, s)))
         share = max(0.0_wp, min(1.0_wp, (d - s(k))/(s(k + 1) - s(k))))
         point = v(:, k) + share*(v(:, k + 1) - v(:, k))
      end function at

   end function new_liner_layout

   !> Points of which no two in a row are one.
   pure function distinct(v, near) result(points)
      real(wp), intent(in) :: v(:, :), near
      real(wp), allocatable :: points(:, :)
      integer :: k, n, kept(size(v, 2))
      n = 0
      do k = 1, size(v, 2)
         if (n > 0) then
            if (norm2(v(:, k) - v(:, kept(n))) <= near) cycle
         end if
         n = n + 1
         kept(n) = k
      end do
      points = v(:, kept(:n))
   end function distinct

   !> The last of ascending numbers that lies below x; 0: none.
   pure integer function last_below(x, numbers) result(k)
      real(wp), intent(in) :: x, numbers(:)
      integer :: above, middle
      k = 0
      above = size(numbers) + 1
      do while (above - k > 1)
         middle = (k + above)/2
         if (numbers(middle) < x) then
            k = middle
         else
            above = middle
         end if
      end do
   end function last_below

   !> The one of ascending numbers that is nearest to x; of two the first.
   pure integer function closest(x, numbers) result(k)
      real(wp), intent(in) :: x, numbers(:)   !! one or more
      k = max(1, last_below(x, numbers))
      if (k == size(numbers)) return
      if (abs(numbers(k + 1) - x) < abs(numbers(k) - x)) k = k + 1
   end function closest

   !> Distance from x to the nearest of ascending numbers.
   pure real(wp) function gap(x, numbers)
      real(wp), intent(in) :: x, numbers(:)
      gap = abs(numbers(closest(x, numbers)) - x)
   end function gap

   !> Is there a corner between two directions?
   pure logical function turns(a, b)
      real(wp), intent(in) :: a(2), b(2)
      turns = dot_product(a, b) < corner*norm2(a)*norm2(b)
   end function turns

   !> A path at a distance from another one, to its left. Between corners it keeps the shares of its length: where it is
   !> shorter than the other one no part of it turns back.
   pure function lift(path, closed, distance) result(lifted)
      real(wp), intent(in) :: path(:, :)     !! (2, points) [length]
      logical, intent(in) :: closed          !! its last point is the first one
      real(wp), intent(in) :: distance       !! < 0: to its right [length]
      real(wp) :: lifted(2, size(path, 2))
      real(wp), dimension(size(path, 2)) :: s, cut, shift
      real(wp) :: before(2), after(2), n(2), back, forth
      integer, allocatable :: corners(:)
      integer :: k, m
      m = size(path, 2)
      s(1) = 0
      cut = 0
      do k = 2, m
         s(k) = s(k - 1) + norm2(path(:, k) - path(:, k - 1))
      end do
      do k = 1, m
         call find_directions(k, before, after)
         ! what the lifted line lacks beside a corner
         if (turns(before, after)) cut(k) = distance*(before(1)*after(2) - before(2)*after(1))/ &
                                            max(1 + dot_product(before, after), 0.25_wp)
      end do
      corners = pack([(k, k=1, m)], abs(cut) > 0)
      do k = 1, m
         shift(k) = 0
         if (size(corners) == 0 .or. abs(cut(k)) > 0) cycle
         associate (last => corners(max(1, count(corners < k))), next => corners(min(size(corners), &
                                                                                 1 + count(corners < k))))
            back = s(k) - s(last)
            forth = s(next) - s(k)
            if (.not. closed) then
               if (last < k) shift(k) = cut(last)*(1 - back/(merge(s(next), s(m), next > k) - s(last)))
               if (next > k) shift(k) = shift(k) - cut(next)*(1 - forth/(s(next) - merge(s(last), 0.0_wp, last < k)))
            else
               back = modulo(s(k) - s(merge(last, corners(size(corners)), last < k)), s(m))
               forth = modulo(s(merge(next, corners(1), next > k)) - s(k), s(m))
               shift(k) = (cut(merge(last, corners(size(corners)), last < k))*forth - &
                           cut(merge(next, corners(1), next > k))*back)/(back + forth)
            end if
         end associate
      end do
      do k = 1, m
         call find_directions(k, before, after)
         n = [-before(2) - after(2), before(1) + after(1)]
         ! the corner of the lifted line: n/(n.n/2)
         lifted(:, k) = path(:, k) + distance*n/max(0.5_wp*dot_product(n, n), 0.25_wp) + &
                        0.5_wp*shift(k)*(before + after)
      end do

   contains

      !> Directions before and behind a point.
      pure subroutine find_directions(k, before, after)
         integer, intent(in) :: k
         real(wp), intent(out) :: before(2), after(2)
         integer :: i, j
         i = merge(merge(m, 2, closed), k, k == 1)
         j = merge(merge(1, m - 1, closed), k, k == m)
         before = path(:, i) - path(:, i - 1)
         after = path(:, j + 1) - path(:, j)
         before = before/max(norm2(before), tiny(1.0_wp))
         after = after/max(norm2(after), tiny(1.0_wp))
      end subroutine find_directions

   end function lift

end module rockdda_model_liner_layout
