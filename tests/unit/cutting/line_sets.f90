! SPDX-License-Identifier: MIT
!> Input lines for tests of the cutter, and a check of its result that shares no code with it.
module line_sets
   use rockdda_base_kinds, only : wp, i8
   use rockdda_base_diagnostics, only : diagnostics_type
   use rockdda_base_error, only : error_type
   use rockdda_base_sorting, only : sorted_order
   use rockdda_base_strings, only : to_string
   use rockdda_geometry_polygons, only : polygon_area, point_in_polygon
   use rockdda_geometry_segments, only : side_of_line, distance_to_segment, nearest_parameter
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_geometry_input, only : geometry_input_type
   use rockdda_cutting_cut, only : cut_blocks, cut_report_type
   implicit none
   private
   public :: new_geometry, add_rectangle, cut, area_of, corners_of, n_corners, next_vertex, fault_of, random_type

   !> The same numbers on every machine (a 32-bit linear congruential generator, high bits).
   type :: random_type
      integer(i8) :: state = 1
   contains
      procedure :: next
   end type random_type

contains

   !> Uniform in [0, 1).
   function next(self) result(value)
      class(random_type), intent(inout) :: self
      real(wp) :: value
      integer(i8) :: bits
      self%state = modulo(self%state*1664525_i8 + 1013904223_i8, 4294967296_i8)
      bits = self%state/65536
      self%state = modulo(self%state*1664525_i8 + 1013904223_i8, 4294967296_i8)
      value = (real(bits, wp) + real(self%state, wp)/4294967296.0_wp)/65536
   end function next

   !> Geometry of lines of joint material 1; e0 = 0.001.
   function new_geometry(lines) result(geometry)
      real(wp), intent(in) :: lines(:)          !! x1, y1, x2, y2 of the first line, of the second, ...
      type(geometry_input_type) :: geometry
      integer :: i
      call geometry%allocate_all(size(lines)/4, 0, 0, 0, 0, 0, 0)
      geometry%edge_node_distance = 0.001_wp
      geometry%lines = reshape(lines, [4, size(lines)/4])
      do i = 1, size(geometry%line_origin)
         geometry%line_origin(i)%file = 'test.dc'
         geometry%line_origin(i)%line = 10 + i
      end do
   end function new_geometry

   !> Lines followed by the four sides of a rectangle.
   function add_rectangle(lines, x1, y1, x2, y2) result(more)
      real(wp), intent(in) :: lines(:), x1, y1, x2, y2
      real(wp), allocatable :: more(:)
      more = [lines, x1, y1, x2, y1, x2, y1, x2, y2, x2, y2, x1, y2, x1, y2, x1, y1]
   end function add_rectangle

   !> Cut; `text` is empty, or the error and its code. Results are checked before they come back.
   subroutine cut(geometry, blocks, report, warnings, text)
      type(geometry_input_type), intent(in) :: geometry
      type(block_system_type), intent(out) :: blocks
      type(cut_report_type), intent(out) :: report
      character(len=:), allocatable, intent(out) :: warnings
      character(len=:), allocatable, intent(out) :: text
      type(diagnostics_type) :: messages
      type(error_type), allocatable :: error
      call cut_blocks(geometry, blocks, report, messages, error)
      warnings = messages%format(1)
      text = ''
      if (allocated(error)) then
         text = to_string(error%code)//': '//error%message
      else
         text = fault_of(blocks, report)
      end if
   end subroutine cut

   !> Area of one block.
   function area_of(blocks, i) result(area)
      type(block_system_type), intent(in) :: blocks
      integer, intent(in) :: i
      real(wp) :: area
      area = polygon_area(corners_of(blocks, i))
   end function area_of

   !> Corners of one block, (2, n).
   function corners_of(blocks, i) result(corners)
      type(block_system_type), intent(in) :: blocks
      integer, intent(in) :: i
      real(wp), allocatable :: corners(:, :)
      corners = blocks%vertices(:, blocks%vertex_offset(i) + 1:blocks%vertex_offset(i + 1))
   end function corners_of

   !> Number of corners of one block.
   integer function n_corners(blocks, i)
      type(block_system_type), intent(in) :: blocks
      integer, intent(in) :: i
      n_corners = blocks%vertex_offset(i + 1) - blocks%vertex_offset(i)
   end function n_corners

   !> Empty, or what is wrong with the blocks:
   !> every block has a positive area and no two of its edges cross; areas add up; split at all corners on them, no edge
   !> is walked twice in the same direction, edges walked once have no block on their right, nodes, edges and blocks
   !> obey Euler's relation.
   function fault_of(blocks, report) result(fault)
      type(block_system_type), intent(in) :: blocks
      type(cut_report_type), intent(in) :: report
      character(len=:), allocatable :: fault
      real(wp), allocatable :: nodes(:, :)
      integer, allocatable :: node_of(:), ends(:, :)
      real(wp) :: total, area, tolerance
      integer :: i, k, l, first, last
      fault = ''
      total = 0
      do i = 1, blocks%n_blocks
         first = blocks%vertex_offset(i) + 1
         last = blocks%vertex_offset(i + 1)
         area = polygon_area(blocks%vertices(:, first:last))
         total = total + area
         if (.not. area > 0) fault = 'block '//to_string(i)//' has no area'
         do k = first, last
            do l = k + 1, last
               if (edges_cross(i, k, l)) fault = 'edges of block '//to_string(i)//' cross'
            end do
         end do
      end do
      ! the cutter drops corners that are straight to 1e-10 and coordinates carry about 1e-16 of their size
      tolerance = 1.0e-9_wp*report%enclosed_area + 1.0e-14_wp*maxval(abs(blocks%vertices))**2
      if (abs(total - report%area_sum) > tolerance) fault = 'area sum of the report'
      if (abs(total + report%hole_area - report%enclosed_area) > tolerance) fault = 'area lost'
      if (report%n_faces /= blocks%n_blocks + report%n_holes) fault = 'numbers of faces and blocks'
      if (len(fault) > 0) return
      call number_nodes(blocks%vertices, nodes, node_of)
      call split_edges(blocks, nodes, node_of, ends)
      call check_net(blocks, report, nodes, ends, fault)

   contains

      !> Do two edges of block i cross, each strictly between the ends of the other one?
      logical function edges_cross(i, k, l)
         integer, intent(in) :: i, k, l
         real(wp) :: p(2), q(2), r(2), s(2)
         real(wp), parameter :: rounding = 1.0e-14_wp
         p = blocks%vertices(:, k)
         q = blocks%vertices(:, next_vertex(blocks, i, k))
         r = blocks%vertices(:, l)
         s = blocks%vertices(:, next_vertex(blocks, i, l))
         ! edges on one line have sides of either sign at the level of rounding
         edges_cross = min(side_of_line(p, q, r), side_of_line(p, q, s)) < -rounding .and. &
                       max(side_of_line(p, q, r), side_of_line(p, q, s)) > rounding .and. &
                       min(side_of_line(r, s, p), side_of_line(r, s, q)) < -rounding .and. &
                       max(side_of_line(r, s, p), side_of_line(r, s, q)) > rounding
      end function edges_cross

   end function fault_of

   !> Distinct corners (blocks repeat the same numbers to the last bit).
   subroutine number_nodes(vertices, nodes, node_of)
      real(wp), intent(in) :: vertices(:, :)
      real(wp), allocatable, intent(out) :: nodes(:, :)
      integer, allocatable, intent(out) :: node_of(:)
      integer :: k, v, n
      allocate (nodes(2, size(vertices, 2)), node_of(size(vertices, 2)))
      n = 0
      do k = 1, size(vertices, 2)
         do v = 1, n
            if (all(.not. abs(nodes(:, v) - vertices(:, k)) > 0)) exit
         end do
         if (v > n) then
            n = v
            nodes(:, n) = vertices(:, k)
         end if
         node_of(k) = v
      end do
      nodes = nodes(:, 1:n)
   end subroutine number_nodes

   !> The vertex after `vertex` on block `block`, counter-clockwise.
   pure integer function next_vertex(blocks, block, vertex)
      type(block_system_type), intent(in) :: blocks
      integer, intent(in) :: block, vertex
      next_vertex = vertex + 1
      if (vertex == blocks%vertex_offset(block + 1)) next_vertex = blocks%vertex_offset(block) + 1
   end function next_vertex

   !> All block edges split at the nodes on them: (from, to, block) of the parts; bridges left out.
   subroutine split_edges(blocks, nodes, node_of, ends)
      type(block_system_type), intent(in) :: blocks
      real(wp), intent(in) :: nodes(:, :)
      integer, intent(in) :: node_of(:)
      integer, allocatable, intent(out) :: ends(:, :)
      integer, allocatable :: on(:), larger(:, :)
      real(wp), allocatable :: t(:)
      real(wp) :: p(2), q(2), reach
      integer :: i, k, v, n, m, a, b
      allocate (ends(3, 64), on(size(nodes, 2)), t(size(nodes, 2)))
      ! twice what the cutter takes for straight
      reach = 2.0e-10_wp
      m = 0
      do i = 1, blocks%n_blocks
         do k = blocks%vertex_offset(i) + 1, blocks%vertex_offset(i + 1)
            if (blocks%edge_joint(k) == 0) cycle
            a = node_of(k)
            b = node_of(next_vertex(blocks, i, k))
            p = nodes(:, a)
            q = nodes(:, b)
            n = 0
            do v = 1, size(nodes, 2)
               if (v == a .or. v == b) cycle
               if (any(nodes(:, v) < min(p, q) - 1.0e-6_wp) .or. any(nodes(:, v) > max(p, q) + 1.0e-6_wp)) cycle
               if (distance_to_segment(nodes(:, v), p, q) > reach*(hypot(q(1) - p(1), q(2) - p(2)) + &
                                                                   1.0e-4_wp*maxval(abs(nodes)))) cycle
               n = n + 1
               on(n) = v
               t(n) = nearest_parameter(nodes(:, v), p, q)
            end do
            if (n > 0) on(1:n) = on(sorted_order(t(1:n)))
            if (m + n + 1 > size(ends, 2)) then
               allocate (larger(3, 2*(m + n + 1)))
               larger(:, 1:m) = ends(:, 1:m)
               call move_alloc(larger, ends)
            end if
            do v = 1, n
               m = m + 1
               ends(:, m) = [a, on(v), i]
               a = on(v)
            end do
            m = m + 1
            ends(:, m) = [a, b, i]
         end do
      end do
      ends = ends(:, 1:m)
   end subroutine split_edges

   !> Directions of the parts, what lies to the right of parts walked once, Euler's relation.
   subroutine check_net(blocks, report, nodes, ends, fault)
      type(block_system_type), intent(in) :: blocks
      type(cut_report_type), intent(in) :: report
      real(wp), intent(in) :: nodes(:, :)
      integer, intent(in) :: ends(:, :)
      character(len=:), allocatable, intent(inout) :: fault
      integer, allocatable :: order(:), low(:), high(:), group(:)
      real(wp) :: d(2), x(2)
      integer :: m, n, i, j, n_edges, n_groups, once(3), v, w
      n = size(ends, 2)
      low = min(ends(1, :), ends(2, :))
      high = max(ends(1, :), ends(2, :))
      allocate (order(n))
      order(:) = sorted_order(high)
      order(:) = order(sorted_order(low(order)))
      group = [(v, v=1, size(nodes, 2))]
      n_edges = 0
      i = 1
      do while (i <= n)
         j = i
         do while (j < n)
            if (low(order(j + 1)) /= low(order(i)) .or. high(order(j + 1)) /= high(order(i))) exit
            j = j + 1
         end do
         n_edges = n_edges + 1
         v = root(low(order(i)))
         w = root(high(order(i)))
         group(max(v, w)) = min(v, w)
         if (j - i > 1) fault = 'an edge is walked more than twice'
         if (j - i == 1) then
            if (ends(1, order(i)) /= ends(2, order(j))) fault = 'an edge is walked twice in one direction'
         else if (j == i) then
            once = ends(:, order(i))
            d = nodes(:, once(2)) - nodes(:, once(1))
            ! a short step to the right of the middle; shorter than e0/10 it may fall into a corner
            if (hypot(d(1), d(2)) > 0.1_wp*report%merging_distance) then
               x = 0.5_wp*(nodes(:, once(1)) + nodes(:, once(2))) + &
                   1.0e-3_wp*report%merging_distance*[d(2), -d(1)]/hypot(d(1), d(2))
               do m = 1, blocks%n_blocks
                  if (point_in_polygon(x, corners_of(blocks, m))) fault = 'block '//to_string(m)// &
                     ' lies beside an edge of block '//to_string(once(3))//' without an edge of its own there'
               end do
            end if
         end if
         i = j + 1
      end do
      if (len(fault) > 0 .or. report%n_holes > 0) return
      n_groups = 0
      do v = 1, size(nodes, 2)
         if (group(v) == v) n_groups = n_groups + 1
      end do
      if (size(nodes, 2) - n_edges + blocks%n_blocks /= n_groups) fault = 'Euler: '//to_string(size(nodes, 2))// &
         ' corners, '//to_string(n_edges)//' edges, '//to_string(blocks%n_blocks)//' blocks, '// &
         to_string(n_groups)//' groups'
      if (n_groups /= report%n_groups) fault = 'number of groups'

   contains

      !> Representative of a node's group.
      integer function root(node)
         integer, intent(in) :: node
         root = node
         do while (group(root) /= root)
            root = group(root)
         end do
      end function root

   end subroutine check_net

end module line_sets
