! SPDX-License-Identifier: MIT
!> Where the bolts of the options lie: single ones and patterns along a line, and the blocks that each of them crosses.
module rockdda_model_bolt_layout
   use rockdda_base_kinds, only : wp
   use rockdda_base_sorting, only : sorted_order
   use rockdda_base_strings, only : is_given, to_string
   use rockdda_geometry_polygons, only : distance_to_outline, point_in_polygon
   use rockdda_geometry_segments, only : line_intersection
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_geometry_input, only : bolt_type, is_spring
   use rockdda_model_options, only : region_type, stage_type, is_set
   use rockdda_model_regions, only : blocks_of_region, count_words, word_of, same_name
   implicit none
   private
   public :: bolt_line_type, bolt_lines, trace_bolt, hold_ends, rock_at, stage_with, title_of_bolt, &
      name_of_spring, most_bolts, outer_line

   !> Bolts of one pattern, at most: more are a slip of the spacing.
   integer, parameter :: most_bolts = 2000
   !> Parts of a bolt in a block below this share of its length are touches of corners.
   real(wp), parameter :: least_part = 1.0e-7_wp

   !> A single bolt.
   type :: bolt_line_type
      integer :: group = 0                      !! of the options
      character(len=:), allocatable :: name
      real(wp) :: head(2) = 0, toe(2) = 0       !! at the start [length]
   end type bolt_line_type

contains

   !> All bolts but springs, in the order of their groups; of a pattern along its line.
   pure subroutine bolt_lines(bolts, blocks, regions, stages, lines)
      type(bolt_type), intent(in) :: bolts(:)
      type(block_system_type), intent(in) :: blocks
      type(region_type), intent(in) :: regions(:)
      type(stage_type), intent(in) :: stages(:)
      type(bolt_line_type), allocatable, intent(out) :: lines(:)
      logical, allocatable :: rock(:)
      real(wp), allocatable :: along(:)
      integer :: g
      allocate (lines(0))
      do g = 1, size(bolts)
         if (is_spring(bolts(g))) cycle
         if (allocated(bolts(g)%along) .or. is_given(bolts(g)%outline)) then
            if (allocated(bolts(g)%along)) then
               along = bolts(g)%along
            else
               along = outer_line(blocks, blocks_of_region(blocks, regions, bolts(g)%outline))
            end if
            rock = rock_at(blocks, regions, stages, max(1, stage_with(stages, bolts(g)%name, installs=.true.)))
            call add_pattern(bolts(g), g, along, blocks, rock, lines)
         else if (allocated(bolts(g)%from) .and. allocated(bolts(g)%to)) then
            call extend(lines, 1)
            associate (line => lines(size(lines)))
               line%group = g
               line%name = title_of_bolt(bolts(g), g)
               line%head = bolts(g)%from(1:2)
               line%toe = bolts(g)%to(1:2)
            end associate
         end if
      end do
   end subroutine bolt_lines

   !> Name of a bolt, or its number.
   pure function title_of_bolt(bolt, number) result(title)
      type(bolt_type), intent(in) :: bolt
      integer, intent(in) :: number
      character(len=:), allocatable :: title
      title = 'bolt '//to_string(number)
      if (is_given(bolt%name)) title = trim(adjustl(bolt%name))
   end function title_of_bolt

   !> Name of spring k of n: those of the options, which may have names, come behind those of the geometry.
   pure function name_of_spring(bolts, n, k) result(name)
      type(bolt_type), intent(in), optional :: bolts(:)     !! of the options; absent where they are not allocated
      integer, intent(in) :: n, k
      character(len=:), allocatable :: name
      integer, allocatable :: springs(:)
      integer :: i
      name = 'spring '//to_string(k)
      if (.not. present(bolts)) return
      springs = pack([(i, i=1, size(bolts))], is_spring(bolts))
      i = k - n + size(springs)
      if (i < 1) return
      if (is_given(bolts(springs(i))%name)) name = title_of_bolt(bolts(springs(i)), springs(i))
   end function name_of_spring

   !> Room for n more bolts.
   pure subroutine extend(lines, n)
      type(bolt_line_type), allocatable, intent(inout) :: lines(:)
      integer, intent(in) :: n
      type(bolt_line_type), allocatable :: longer(:)
      allocate (longer(size(lines) + n))
      longer(:size(lines)) = lines
      call move_alloc(longer, lines)
   end subroutine extend

   !> Bolts at equal distances along a line, all on the same side of it.
   pure subroutine add_pattern(bolt, group, outline, blocks, rock, lines)
      type(bolt_type), intent(in) :: bolt
      integer, intent(in) :: group
      real(wp), intent(in) :: outline(:)         !! x y of its points [length]
      type(block_system_type), intent(in) :: blocks
      logical, intent(in) :: rock(:)             !! (blocks)
      type(bolt_line_type), allocatable, intent(inout) :: lines(:)
      real(wp), parameter :: degree = acos(-1.0_wp)/180
      real(wp) :: at, ends, along(2), heads(2, most_bolts), left(2, most_bolts), angle, length, side
      integer :: before, k, n
      at = 0.5_wp*bolt%spacing
      if (is_set(bolt%offset)) at = bolt%offset
      ends = 0
      n = 0
      do k = 1, size(outline)/2 - 1
         along = outline(2*k + 1:2*k + 2) - outline(2*k - 1:2*k)
         length = norm2(along)
         if (.not. length > 0) cycle
         along = along/length
         do while (at <= ends + length*(1 + 1.0e-12_wp) .and. n < most_bolts)
            n = n + 1
            heads(:, n) = outline(2*k - 1:2*k) + (at - ends)*along
            left(:, n) = [-along(2), along(1)]
            at = at + bolt%spacing
         end do
         ends = ends + length
      end do
      side = rock_side(bolt%length, heads(:, :n), left(:, :n), blocks, rock)
      angle = 0
      if (is_set(bolt%angle)) angle = bolt%angle*degree
      before = size(lines)
      call extend(lines, n)
      do k = 1, n
         associate (normal => side*left(:, k), line => lines(before + k))
            line%group = group
            line%name = title_of_bolt(bolt, group)//' '//to_string(k)
            line%head = heads(:, k)
            line%toe = heads(:, k) + bolt%length*[cos(angle)*normal(1) - sin(angle)*normal(2), &
                                                  sin(angle)*normal(1) + cos(angle)*normal(2)]
         end associate
      end do
   end subroutine add_pattern

   !> The side of the rock, 1: to the left of the line, -1: to its right. It is the left unless there is more rock on
   !> the right, next to the heads: rock that stands over the line does not count as a side of its own.
   pure real(wp) function rock_side(length, heads, left, blocks, rock) result(side)
      real(wp), intent(in) :: length             !! of the bolts [length]
      real(wp), intent(in) :: heads(:, :), left(:, :)   !! (2, bolts)
      type(block_system_type), intent(in) :: blocks
      logical, intent(in) :: rock(:)             !! (blocks)
      real(wp), parameter :: next = 0.1_wp       !! of the length
      real(wp), parameter :: more = 1.01_wp
      real(wp), allocatable :: from(:), to(:)
      integer, allocatable :: block(:)
      real(wp) :: there(2)
      integer :: k, s
      there = 0
      do k = 1, size(heads, 2)
         do s = 1, 2
            call trace_bolt(heads(:, k), heads(:, k) + (3 - 2*s)*next*length*left(:, k), blocks, rock, block, from, to)
            there(s) = there(s) + sum(to - from)
         end do
      end do
      side = merge(-1.0_wp, 1.0_wp, there(2) > more*there(1))
   end function rock_side

   !> The outer line of the union of some blocks, closed, counter-clockwise; empty where there is none.
   pure function outer_line(blocks, inside) result(line)
      type(block_system_type), intent(in) :: blocks
      logical, intent(in) :: inside(:)           !! (blocks)
      real(wp), allocatable :: line(:)           !! x y of its points, the first one again at the end [length]
      real(wp), allocatable :: edges(:, :), pieces(:, :), loop(:), t(:)
      logical, allocatable :: is_used(:)
      real(wp) :: near, largest, area
      integer :: i, k, l, n
      allocate (edges(4, 0), pieces(4, 0), line(0))
      do i = 1, blocks%n_blocks
         if (.not. inside(i)) cycle
         associate (v => blocks%vertices(:, blocks%vertex_offset(i) + 1:blocks%vertex_offset(i + 1)))
            n = size(v, 2)
            edges = reshape([edges, [(v(:, k), v(:, 1 + mod(k, n)), k=1, n)]], [4, size(edges, 2) + n])
         end associate
      end do
      if (size(edges) == 0) return
      near = 1.0e-7_wp*maxval(maxval(edges, 2) - minval(edges, 2))
      do k = 1, size(edges, 2)
         t = free_ends(edges, k, near)
         do l = 1, size(t), 2
            pieces = reshape([pieces, along_edge(edges(:, k), t(l)), along_edge(edges(:, k), t(l + 1))], &
                             [4, size(pieces, 2) + 1])
         end do
      end do
      allocate (is_used(size(pieces, 2)), source=.false.)
      largest = 0
      do k = 1, size(pieces, 2)
         if (is_used(k)) cycle
         loop = pieces(1:2, k)
         l = k
         area = 0
         do while (l > 0)
            is_used(l) = .true.
            loop = [loop, pieces(3:4, l)]
            area = area + 0.5_wp*(pieces(1, l)*pieces(4, l) - pieces(2, l)*pieces(3, l))
            l = findloc(.not. is_used .and. norm2(pieces(1:2, :) - spread(pieces(3:4, l), 2, size(is_used)), &
               1) <= near, &
                        .true., 1)
         end do
         if (area > largest) line = loop
         largest = max(largest, area)
      end do

   contains

      !> A point of an edge.
      pure function along_edge(edge, t) result(point)
         real(wp), intent(in) :: edge(4), t
         real(wp) :: point(2)
         point = edge(1:2) + t*(edge(3:4) - edge(1:2))
      end function along_edge

   end function outer_line

   !> Starts and ends of the parts of an edge that lie on no other edge, as shares of it.
   pure function free_ends(edges, k, near) result(t)
      real(wp), intent(in) :: edges(:, :)        !! (4, edges)
      integer, intent(in) :: k
      real(wp), intent(in) :: near               !! [length]
      real(wp), allocatable :: t(:), ends(:, :)
      real(wp) :: along(2), length, s(2), reached
      integer, allocatable :: order(:)
      integer :: j
      along = edges(3:4, k) - edges(1:2, k)
      length = norm2(along)
      allocate (t(0), ends(2, 0))
      if (.not. length > near) return
      along = along/length
      do j = 1, size(edges, 2)
         if (j == k) cycle
         associate (a => edges(1:2, j) - edges(1:2, k), b => edges(3:4, j) - edges(1:2, k))
            if (max(abs(along(1)*a(2) - along(2)*a(1)), abs(along(1)*b(2) - along(2)*b(1))) > near) cycle
            s = [dot_product(along, b), dot_product(along, a)]   ! the other way round
            if (.not. min(s(2), length) - max(s(1), 0.0_wp) > near) cycle
            ends = reshape([ends, s], [2, size(ends, 2) + 1])
         end associate
      end do
      order = sorted_order(ends(1, :))
      reached = 0
      do j = 1, size(order)
         if (ends(1, order(j)) - reached > near) t = [t, reached/length, ends(1, order(j))/length]
         reached = max(reached, ends(2, order(j)))
      end do
      if (length - reached > near) t = [t, reached/length, 1.0_wp]
   end function free_ends

   !> Parts of a bolt in blocks, from its head: block, and distances of both ends from the head.
   pure subroutine trace_bolt(head, toe, blocks, rock, block, from, to)
      real(wp), intent(in) :: head(2), toe(2)     !! [length]
      type(block_system_type), intent(in) :: blocks
      logical, intent(in) :: rock(:)              !! (blocks) that are there
      integer, allocatable, intent(out) :: block(:)
      real(wp), allocatable, intent(out) :: from(:), to(:)
      real(wp), allocatable :: t(:)
      integer, allocatable :: order(:)
      real(wp) :: s, u
      integer :: i, k, n
      logical :: parallel
      allocate (block(0), from(0), to(0))
      do i = 1, blocks%n_blocks
         if (.not. rock(i)) cycle
         associate (v => blocks%vertices(:, blocks%vertex_offset(i) + 1:blocks%vertex_offset(i + 1)))
            n = size(v, 2)
            if (lies_beside()) cycle
            t = [0.0_wp, 1.0_wp]
            do k = 1, n
               call line_intersection(head, toe, v(:, k), v(:, 1 + mod(k, n)), s, u, parallel)
               if (parallel .or. s <= 0 .or. s >= 1 .or. u < 0 .or. u > 1) cycle
               t = [t, s]
            end do
            t = t(sorted_order(t))
            do k = 1, size(t) - 1
               if (t(k + 1) - t(k) < least_part) cycle
               if (.not. point_in_polygon(head + 0.5_wp*(t(k) + t(k + 1))*(toe - head), v)) cycle
               if (size(block) > 0) then
                  if (block(size(block)) == i .and. t(k) - to(size(block)) < least_part) then
                     to(size(block)) = t(k + 1)
                     cycle
                  end if
               end if
               block = [block, i]
               from = [from, t(k)]
               to = [to, t(k + 1)]
            end do
         end associate
      end do
      order = sorted_order(from)
      block = block(order)
      from = from(order)*norm2(toe - head)
      to = to(order)*norm2(toe - head)

   contains

      !> Does block i lie beside the line, all above, below, left or right of it?
      pure logical function lies_beside()
         real(wp) :: low(2), high(2)
         integer :: j
         low = huge(low)
         high = -huge(high)
         do j = blocks%vertex_offset(i) + 1, blocks%vertex_offset(i + 1)
            low = min(low, blocks%vertices(:, j))
            high = max(high, blocks%vertices(:, j))
         end do
         lies_beside = any(max(head, toe) < low) .or. any(min(head, toe) > high)
      end function lies_beside

   end subroutine trace_bolt

   !> Parts of a bolt that its ends alone hold: an end in no block gets a part without length, of the block that it
   !> touches, or 0: the fixed outside.
   pure subroutine hold_ends(head, toe, blocks, rock, block, from, to)
      real(wp), intent(in) :: head(2), toe(2)     !! [length]
      type(block_system_type), intent(in) :: blocks
      logical, intent(in) :: rock(:)              !! (blocks) that are there
      integer, allocatable, intent(inout) :: block(:)
      real(wp), allocatable, intent(inout) :: from(:), to(:)
      real(wp) :: length, near
      logical :: is_free(2)
      length = norm2(toe - head)
      near = 1.0e-6_wp*length
      is_free = .true.
      if (size(block) > 0) is_free = [from(1) > near, to(size(to)) < length - near]
      if (is_free(1)) then
         block = [touched(head), block]
         from = [0.0_wp, from]
         to = [0.0_wp, to]
      end if
      if (is_free(2)) then
         block = [block, touched(toe)]
         from = [from, length]
         to = [to, length]
      end if

   contains

      !> The first block whose outline a point touches.
      pure integer function touched(point)
         real(wp), intent(in) :: point(2)
         do touched = 1, blocks%n_blocks
            if (.not. rock(touched)) cycle
            if (distance_to_outline(point, blocks%vertices(:, blocks%vertex_offset(touched) + 1: &
                                                           blocks%vertex_offset(touched + 1))) <= &
                max(near, blocks%edge_node_distance)) return
         end do
         touched = 0
      end function touched

   end subroutine hold_ends

   !> Blocks that are there once a stage has begun; stage 0: at the start.
   pure function rock_at(blocks, regions, stages, stage) result(rock)
      type(block_system_type), intent(in) :: blocks
      type(region_type), intent(in) :: regions(:)
      type(stage_type), intent(in) :: stages(:)
      integer, intent(in) :: stage
      logical :: rock(blocks%n_blocks)
      logical :: decided(blocks%n_blocks), goes(blocks%n_blocks), comes(blocks%n_blocks)
      integer :: pass, s
      rock = .true.
      decided = .false.
      ! first what is absent at the start, then stage after stage
      do pass = 1, 2
         do s = 1, merge(size(stages), min(stage, size(stages)), pass == 1)
            comes = .false.
            goes = .false.
            if (is_given(stages(s)%place)) comes = blocks_of_region(blocks, regions, stages(s)%place)
            if (is_given(stages(s)%excavate)) goes = blocks_of_region(blocks, regions, stages(s)%excavate)
            if (pass == 1) then
               where (comes .and. .not. decided) rock = .false.
               decided = decided .or. comes .or. goes
            else
               rock = (rock .or. comes) .and. .not. goes
            end if
         end do
      end do
   end function rock_at

   !> The first stage that installs, or removes, what has a name; 0: none.
   pure integer function stage_with(stages, name, installs) result(stage)
      type(stage_type), intent(in) :: stages(:)
      character(len=*), optional, intent(in) :: name     !! absent where it is not allocated
      logical, intent(in) :: installs
      character(len=:), allocatable :: list
      integer :: k
      stage = 0
      if (.not. present(name)) return
      if (len_trim(name) == 0) return
      do stage = 1, size(stages)
         list = ''
         if (installs) then
            if (allocated(stages(stage)%install)) list = stages(stage)%install
         else
            if (allocated(stages(stage)%remove)) list = stages(stage)%remove
         end if
         do k = 1, count_words(list)
            if (same_name(word_of(list, k), name)) return
         end do
      end do
      stage = 0
   end function stage_with

end module rockdda_model_bolt_layout
