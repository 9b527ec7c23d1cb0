! SPDX-License-Identifier: MIT
!> Where the nodes and segments of a lining lie on its line.
!>
!> A node lies at both ends of an open line and at each corner. Where the rock is of blocks not much longer than
!> segments, a node lies in the middle of each block, or of several; else nodes have equal distances, and a segment
!> reaches from the middle between two nodes to the next one. The path holds the points of the line, the nodes and the
!> ends of the segments, in this order along it; that of a closed line begins and ends half-way before the first node.
module rockdda_model_liner_layout
   use rockdda_base_kinds, only : wp
   use rockdda_base_sorting, only : sorted_order
   use rockdda_base_strings, only : is_given, to_string
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_bolt_layout, only : outer_line
   use rockdda_model_options, only : liner_type, region_type, is_set
   use rockdda_model_regions, only : blocks_of_region, same_name
   implicit none
   private
   public :: liner_layout_type, new_liner_layout, line_of_liner, title_of_liner, lower_liner, liner_number, &
      most_nodes, lift

   !> More nodes are a slip of `element`.
   integer, parameter :: most_nodes = 10000
   !> Nodes around a closed line, at least, where `element` is not given.
   integer, parameter :: least_around = 24
   !> A line that turns by more is no curve there, but has a corner: cosine of 30 degrees.
   real(wp), parameter :: corner = 0.866_wp

   !> Blocks along more of the line than this number of largest distances are divided as if there were none.
   real(wp), parameter :: long_block = 2.5_wp
   !> Share of the next block that a segment at a corner takes.
   real(wp), parameter :: small = 0.05_wp

   type :: liner_layout_type
      integer :: n = 0                       !! nodes, and segments
      logical :: closed = .false.
      real(wp), allocatable :: path(:, :)    !! (2, points) [length]
      integer, allocatable :: node(:)        !! (n) points of the path
      integer, allocatable :: first(:), last(:)   !! (n) points that the segments begin and end with
      real(wp) :: start = 0                  !! of the path, distance from the start of the line, <= 0 [length]
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

   !> The line of a lining: x y of its points; that of the lining on which it lies.
   pure recursive function line_of_liner(liners, k, blocks, regions) result(line)
      type(liner_type), intent(in) :: liners(:)
      integer, intent(in) :: k
      type(block_system_type), intent(in) :: blocks
      type(region_type), intent(in) :: regions(:)
      real(wp), allocatable :: line(:)
      if (lower_liner(liners, k) > 0) then
         line = line_of_liner(liners, lower_liner(liners, k), blocks, regions)
      else if (allocated(liners(k)%along)) then
         line = liners(k)%along
      else if (is_given(liners(k)%outline)) then
         line = outer_line(blocks, blocks_of_region(blocks, regions, liners(k)%outline))
      else
         allocate (line(0))
      end if
   end function line_of_liner

   !> Nodes and segments on a line; where blocks are not far longer than segments, these are as long as one or more
   !> blocks, so that each block meets one segment, and nodes lie in their middle. Without points where the line has no
   !> length.
   pure type(liner_layout_type) function new_liner_layout(line, thickness, element, breaks, seams) result(layout)
      real(wp), intent(in) :: line(:)        !! x y of its points [length]
      real(wp), intent(in) :: thickness      !! [length]
      real(wp), intent(in) :: element        !! largest distance of nodes, or not given [length]
      real(wp), intent(in), optional :: breaks(:)   !! distances from its start at which there are nodes, too [length]
      real(wp), intent(in), optional :: seams(:)    !! at which one block of the rock follows another [length]
      real(wp), allocatable :: v(:, :), s(:), nodes(:), ends(:), places(:), corners(:), joints(:)
      real(wp) :: near, length, largest
      integer :: k, m
      logical :: smooth
      m = size(line)/2
      v = reshape(line(1:2*m), [2, m])
      near = 1.0e-9_wp*maxval([0.0_wp, maxval(v, 2) - minval(v, 2)])
      v = distinct(v, near)
      m = size(v, 2)
      if (m < 2) return
      layout%closed = m > 3 .and. norm2(v(:, m) - v(:, 1)) <= near
      allocate (s(m))
      s(1) = 0
      do k = 2, m
         s(k) = s(k - 1) + norm2(v(:, k) - v(:, k - 1))
      end do
      length = s(m)
      largest = 2*thickness
      if (layout%closed) largest = min(largest, length/least_around)
      if (is_set(element)) largest = element
      largest = max(largest, length/most_nodes)
      ! stretches between corners
      corners = [s(1)]
      do k = 2, m - 1
         if (turns(v(:, k) - v(:, k - 1), v(:, k + 1) - v(:, k))) corners = [corners, s(k)]
      end do
      if (present(breaks)) then
         do k = 1, size(breaks)
            call add_break(modulo(breaks(k), length), corners)
         end do
         corners = corners(sorted_order(corners))
      end if
      if (layout%closed .and. size(corners) > 1) then
         ! the line may begin between corners
         if (.not. turns(v(:, m) - v(:, m - 1), v(:, 2) - v(:, 1))) corners = [corners(2:), corners(2) + length]
      end if
      if (abs(corners(size(corners)) - corners(1) - length) > near) corners = [corners, corners(1) + length]
      smooth = layout%closed .and. size(corners) == 2 .and. .not. turns(v(:, m) - v(:, m - 1), v(:, 2) - v(:, 1))
      if (present(breaks)) smooth = smooth .and. size(breaks) == 0
      allocate (nodes(0), ends(0), joints(0))
      if (present(seams)) joints = modulo(seams, length)
      if (present(seams) .and. layout%closed) joints = [joints - length, joints, joints + length]
      if (size(joints) > 0) joints = joints(sorted_order(joints))
      do k = 1, size(corners) - 1
         call divide(corners(k), corners(k + 1), smooth, joints, nodes, ends)
      end do
      if (.not. layout%closed) then
         nodes = [nodes, length]
         ends = [0.0_wp, ends, length]
      else if (ends(1) > nodes(1)) then
         ends = [ends(size(ends)) - length, ends]
      else
         ends = [ends, ends(1) + length]
      end if
      layout%n = size(nodes)
      layout%start = ends(1)
      places = [nodes, ends]
      do k = 1, m
         call add_place(s(k) - length, places)
         call add_place(s(k), places)
         call add_place(s(k) + length, places)
      end do
      places = places(sorted_order(places))
      places = pack(places, [.true., places(2:) - places(:size(places) - 1) > near])
      allocate (layout%path(2, size(places)), layout%node(layout%n), layout%first(layout%n), layout%last(layout%n))
      do k = 1, size(places)
         layout%path(:, k) = at(places(k))
      end do
      do k = 1, layout%n
         layout%node(k) = minloc(abs(places - nodes(k)), 1)
         layout%first(k) = minloc(abs(places - ends(k)), 1)
         layout%last(k) = minloc(abs(places - ends(k + 1)), 1)
      end do

   contains

      !> Nodes and ends of segments between two corners, the first of which has a node, but where a smooth line begins.
      pure subroutine divide(a, b, smooth, joints, nodes, ends)
         real(wp), intent(in) :: a, b
         logical, intent(in) :: smooth
         real(wp), intent(in) :: joints(:)         !! ascending
         real(wp), allocatable, intent(inout) :: nodes(:), ends(:)
         real(wp), allocatable :: cells(:), parts(:)
         integer :: i, j, k
         cells = pack(joints, joints > a + 0.01_wp*largest .and. joints < b - 0.01_wp*largest)
         if (size(cells) > 1) cells = pack(cells, [.true., cells(2:) - cells(:size(cells) - 1) > 0.01_wp*largest])
         if (smooth .and. size(cells) > 0) then
            cells = [cells, cells(1) + length]
         else
            cells = [a, cells, b]
         end if
         if (size(cells) < 3 .or. maxval(cells(2:) - cells(:size(cells) - 1)) > long_block*largest) then
            j = max(1, ceiling((b - a)/largest - 1.0e-6_wp))
            if (layout%closed .and. smooth) j = max(3, j)
            nodes = [nodes, [(a + i*(b - a)/j, i=0, j - 1)]]
            ends = [ends, [(a + (i - 0.5_wp)*(b - a)/j, i=1, j)]]
            return
         end if
         parts = [cells(1)]
         do i = 2, size(cells)
            associate (last => parts(size(parts)), c => cells(i) - cells(i - 1))
               if (c > 1.5_wp*largest) then
                  if (last < cells(i - 1)) parts = [parts, cells(i - 1)]
                  j = nint(c/largest)
                  parts = [parts, [(cells(i - 1) + k*c/j, k=1, j)]]
               else if (cells(i) - last > 1.25_wp*largest) then
                  parts = [parts, cells(i - 1)]
               end if
            end associate
         end do
         if (cells(size(cells)) > parts(size(parts)) + 0.01_wp*largest) parts = [parts, cells(size(cells))]
         j = size(parts)
         if (smooth) then
            nodes = [nodes, 0.5_wp*(parts(2:) + parts(:j - 1))]
            ends = [ends, parts(:j - 1)]
         else
            nodes = [nodes, a, 0.5_wp*(parts(2:) + parts(:j - 1))]
            ends = [ends, a + small*(parts(2) - a), parts(2:j - 1), b - small*(b - parts(j - 1))]
         end if
      end subroutine divide

      !> One more place of a node, unless one is close.
      pure subroutine add_break(at, corners)
         real(wp), intent(in) :: at
         real(wp), allocatable, intent(inout) :: corners(:)
         if (any(abs(corners - at) < 0.1_wp*thickness) .or. length - at < 0.1_wp*thickness) return
         corners = [corners, at]
      end subroutine add_break

      !> A point of the line is one of the path.
      pure subroutine add_place(at, places)
         real(wp), intent(in) :: at
         real(wp), allocatable, intent(inout) :: places(:)
         if (at < ends(1) - near .or. at > ends(size(ends)) + near) return
         if (any(abs(places - at) <= near)) return
         places = [places, at]
      end subroutine add_place

      !> Point of the line at a distance from its start.
      pure function at(distance) result(point)
         real(wp), intent(in) :: distance
         real(wp) :: point(2), d, share
         integer :: k
         d = distance
         if (layout%closed) d = modulo(d, length)
         do k = 1, m - 2
            if (s(k + 1) >= d) exit
         end do
         share = max(0.0_wp, min(1.0_wp, (d - s(k))/(s(k + 1) - s(k))))
         point = v(:, k) + share*(v(:, k + 1) - v(:, k))
      end function at

   end function new_liner_layout

   !> Points of which no two in a row are one.
   pure function distinct(v, near) result(points)
      real(wp), intent(in) :: v(:, :), near
      real(wp), allocatable :: points(:, :)
      integer :: k
      points = v(:, 1:min(1, size(v, 2)))
      do k = 2, size(v, 2)
         if (norm2(v(:, k) - points(:, size(points, 2))) > near) &
            points = reshape([points, v(:, k)], [2, size(points, 2) + 1])
      end do
   end function distinct

   !> Is there a corner between two directions?
   pure logical function turns(a, b)
      real(wp), intent(in) :: a(2), b(2)
      turns = dot_product(a, b) < corner*norm2(a)*norm2(b)
   end function turns

   !> A path at a distance from another one, to its left.
   pure function lift(path, closed, distance) result(lifted)
      real(wp), intent(in) :: path(:, :)     !! (2, points) [length]
      logical, intent(in) :: closed          !! its last point is the first one
      real(wp), intent(in) :: distance       !! < 0: to its right [length]
      real(wp) :: lifted(2, size(path, 2))
      real(wp) :: before(2), after(2), n(2)
      integer :: k, m
      m = size(path, 2)
      do k = 1, m
         if (k > 1) then
            before = path(:, k) - path(:, k - 1)
         else if (closed) then
            before = path(:, m) - path(:, m - 1)
         else
            before = path(:, 2) - path(:, 1)
         end if
         if (k < m) then
            after = path(:, k + 1) - path(:, k)
         else if (closed) then
            after = path(:, 2) - path(:, 1)
         else
            after = path(:, m) - path(:, m - 1)
         end if
         before = before/max(norm2(before), tiny(1.0_wp))
         after = after/max(norm2(after), tiny(1.0_wp))
         n = [-before(2) - after(2), before(1) + after(1)]
         ! the corner of the lifted line: n/(n.n/2)
         lifted(:, k) = path(:, k) + distance*n/max(0.5_wp*dot_product(n, n), 0.25_wp)
      end do
   end function lift

end module rockdda_model_liner_layout
