! SPDX-License-Identifier: MIT
!> Check blocks and points of a block file. Used by all readers of block files.
!>
!> Two blocks overlap when an inner point of one, or a point of its outline, lies inside the other one and farther from
!> its outline than a tolerance: touching, and overlaps of round-off size, are allowed. The tolerance is e0, but at
!> least 1e-5 of the size of the smaller block (files with six digits) and at most a tenth of its thickness (its area
!> over half its perimeter), so that splinters count, too.
module rockdda_io_block_check
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : to_string
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_base_sorting, only : sorted_order
   use rockdda_geometry_bridges, only : match_bridges
   use rockdda_geometry_polygons, only : polygon_area, point_in_polygon, distance_to_outline
   use rockdda_geometry_simplicity, only : find_crossing
   use rockdda_geometry_grid, only : grid_type, grid_query_type
   use rockdda_model_blocks, only : block_system_type, point_set_type, largest_coordinate
   use rockdda_io_record_reader, only : smallest_length
   use rockdda_io_tokens, only : token_list_type
   implicit none
   private
   public :: check_blocks

   !> Largest number of pairs reported.
   integer, parameter :: most_errors = 1000

   !> Edges that cross by less than this share of the block size count as contact: files may have six digits.
   real(wp), parameter :: few_digits = 1.0e-5_wp

contains

   !> Check that polygons have three vertices or more and run counter-clockwise around an area without crossing
   !> themselves, and that every number is in range.
   subroutine check_blocks(blocks, tokens, block_token, edge_token, messages)
      type(block_system_type), intent(in) :: blocks
      type(token_list_type), intent(in) :: tokens
      integer, intent(in) :: block_token(:)     !! (n_blocks) token where each block begins
      integer, intent(in) :: edge_token(:)      !! (n_vertices) token where the row of each edge begins
      type(diagnostics_type), intent(inout) :: messages
      integer :: i, first, last, one, other, n_errors
      real(wp) :: area, tolerance
      n_errors = messages%n_errors
      do i = 1, blocks%n_blocks
         first = blocks%vertex_offset(i) + 1
         last = blocks%vertex_offset(i + 1)
         if (last - first < 2) then
            call report('needs at least 3 vertices, has '//to_string(last - first + 1))
         else if (any(.not. abs(blocks%vertices(:, first:last)) <= largest_coordinate)) then
            call report('a coordinate is larger than '//to_string(largest_coordinate))
         else
            area = polygon_area(blocks%vertices(:, first:last))
            tolerance = max(blocks%edge_node_distance, few_digits*sqrt(abs(area)))
            call find_crossing(blocks%vertices(:, first:last), tolerance, one, other)
            if (.not. area > 0) then
               call report('its vertices must run counter-clockwise around an area greater than 0, found area '// &
                           to_string(area))
            else if (area < 0.01_wp*smallest_length**2) then
               call report('its area is too small to compute with: '//to_string(area))
            else if (one > 0) then
               call report('its edges '//to_string(one)//' and '//to_string(other)//' cross')
            end if
         end if
         if (blocks%block_material(i) < 1) call report('material must be at least 1, found '// &
                                                       to_string(blocks%block_material(i)))
         if (any(blocks%edge_joint(first:last) < 0)) call report('a joint material is negative')
         if (any(blocks%edge_joint(first:last) == 0)) call check_bridges()
      end do
      if (messages%n_errors == n_errors) call check_overlaps(blocks, tokens, block_token, messages)
      call check_points('fixed point', blocks%fixed)
      call check_points('loading point', blocks%loading)
      call check_points('measured point', blocks%measured)

   contains

      !> Report an error of block i.
      subroutine report(text)
         character(len=*), intent(in) :: text
         call messages%add(severity%error, 'block '//to_string(i)//': '//text, tokens%origin(block_token(i)))
      end subroutine report

      !> Check that each bridge edge of block i is walked in both directions.
      subroutine check_bridges()
         integer, allocatable :: twin(:)
         integer :: k
         allocate (twin, source=match_bridges(blocks%vertices(:, first:last), blocks%edge_joint(first:last) == 0))
         do k = 1, size(twin)
            if (twin(k) > 0 .or. blocks%edge_joint(first + k - 1) /= 0) cycle
            call messages%add(severity%error, 'block '//to_string(i)// &
               ': joint material 0 marks a bridge to an island, '// &
                              'but no other edge of joint material 0 leads from the end of edge '//to_string(k)// &
                              ' back to its start', tokens%origin(edge_token(first + k - 1)))
         end do
      end subroutine check_bridges

      !> Check that points lie on blocks that exist.
      subroutine check_points(name, points)
         character(len=*), intent(in) :: name
         type(point_set_type), intent(in) :: points
         type(origin_type) :: origin
         integer :: k
         do k = 1, points%n
            origin = points%origin(k)
            if (points%block(k) < 1 .or. points%block(k) > blocks%n_blocks) call messages%add(severity%error, &
               name//' '//to_string(k)//': its block must be between 1 and '//to_string(blocks%n_blocks)//', found '// &
               to_string(points%block(k)), origin)
            if (any(.not. abs(points%position(:, k)) <= largest_coordinate)) call messages%add(severity%error, &
               name//' '//to_string(k)//': a coordinate is larger than '//to_string(largest_coordinate), origin)
         end do
      end subroutine check_points

   end subroutine check_blocks

   !> Report each pair of blocks that overlap, at the line of the later one.
   subroutine check_overlaps(blocks, tokens, block_token, messages)
      type(block_system_type), intent(in) :: blocks       !! each of them valid by itself
      type(token_list_type), intent(in) :: tokens
      integer, intent(in) :: block_token(:)               !! (n_blocks) token where each block begins
      type(diagnostics_type), intent(inout) :: messages
      type(grid_type) :: grid
      type(grid_query_type) :: query
      real(wp), allocatable :: boxes(:, :), inner(:, :), area(:), thickness(:)
      real(wp), allocatable :: depth(:, :)                !! (3, pairs) how deep each pair is, and where
      real(wp) :: tolerance, common(4), deepest(3)
      integer, allocatable :: found(:)
      integer :: i, j, k, m, small
      allocate (boxes(4, blocks%n_blocks), inner(2, blocks%n_blocks), area(blocks%n_blocks), thickness(blocks%n_blocks))
      do i = 1, blocks%n_blocks
         associate (v => blocks%vertices(:, blocks%vertex_offset(i) + 1:blocks%vertex_offset(i + 1)))
            boxes(:, i) = [minval(v(1, :)), minval(v(2, :)), maxval(v(1, :)), maxval(v(2, :))]
            area(i) = polygon_area(v)
            thickness(i) = 2*area(i)/perimeter(v)
            inner(:, i) = inner_point(v)
         end associate
      end do
      call grid%build_boxes(boxes, 0.0_wp)
      allocate (found(64), depth(3, 64))
      do i = 1, blocks%n_blocks
         call grid%query_box(boxes(:, i), query)
         m = 0
         do k = 1, query%n
            j = query%ids(k)
            if (j >= i) cycle
            small = merge(i, j, area(i) < area(j))
            tolerance = min(max(blocks%edge_node_distance, few_digits*sqrt(area(small))), 0.1_wp*thickness(small))
            common = [max(boxes(1:2, i), boxes(1:2, j)), min(boxes(3:4, i), boxes(3:4, j))]
            if (any(common(3:4) - common(1:2) <= tolerance)) cycle
            call find_deepest(i, j, deepest(1), deepest(2:3))
            if (.not. deepest(1) > tolerance) cycle
            if (m == size(found)) then
               found = [found, found]
               depth = reshape([depth, depth], [3, 2*m])
            end if
            m = m + 1
            found(m) = j
            depth(:, m) = deepest
         end do
         do while (m > 0)
            k = minloc(found(1:m), dim=1)
            call messages%add(severity%error, 'block '//to_string(i)//' overlaps block '//to_string(found(k))// &
                              ' (line '//to_string(tokens%line(block_token(found(k))))//'), by '// &
                              to_string(depth(1, k), 3)//' near ('//to_string(depth(2, k), 6)//', '// &
                              to_string(depth(3, k), 6)//')', tokens%origin(block_token(i)))
            found(k) = found(m)
            depth(:, k) = depth(:, m)
            m = m - 1
         end do
         if (messages%n_errors >= most_errors) return
      end do

   contains

      !> How deep, and where, do blocks a and b lie in one another?
      pure subroutine find_deepest(a, b, depth, place)
         integer, intent(in) :: a, b
         real(wp), intent(out) :: depth, place(2)
         depth = 0
         place = inner(:, a)
         associate (va => blocks%vertices(:, blocks%vertex_offset(a) + 1:blocks%vertex_offset(a + 1)), &
                    vb => blocks%vertices(:, blocks%vertex_offset(b) + 1:blocks%vertex_offset(b + 1)))
            call take_deeper(inner(:, a), vb, depth, place)
            call take_deeper(inner(:, b), va, depth, place)
            call follow_outline(va, vb, common, depth, place)
            call follow_outline(vb, va, common, depth, place)
         end associate
      end subroutine find_deepest

   end subroutine check_overlaps

   !> The deepest point of the outline p in polygon q, if deeper. Only edges in the box that both have in common can be.
   pure subroutine follow_outline(p, q, box, depth, place)
      real(wp), intent(in) :: p(:, :), q(:, :)      !! (2, n) corners
      real(wp), intent(in) :: box(4)
      real(wp), intent(inout) :: depth, place(2)
      real(wp), allocatable :: near(:, :), cuts(:)
      real(wp) :: a(2), b(2), t
      integer :: i, k, n, m
      allocate (near(4, size(q, 2)))
      n = 0
      do k = 1, size(q, 2)
         a = q(:, k)
         b = q(:, 1 + mod(k, size(q, 2)))
         if (misses(a, b, box)) cycle
         n = n + 1
         near(:, n) = [a, b]
      end do
      allocate (cuts(n + 2))
      do i = 1, size(p, 2)
         a = p(:, i)
         b = p(:, 1 + mod(i, size(p, 2)))
         if (misses(a, b, box)) cycle
         call take_deeper(a, q, depth, place)
         ! between two crossings the edge is entirely inside or outside
         cuts(1:2) = [0.0_wp, 1.0_wp]
         m = 2
         do k = 1, n
            t = crossing(a, b, near(1:2, k), near(3:4, k))
            if (.not. (t > 0 .and. t < 1)) cycle
            m = m + 1
            cuts(m) = t
         end do
         call sort(cuts(1:m))
         do k = 1, m - 1
            call take_deeper(a + 0.5_wp*(cuts(k) + cuts(k + 1))*(b - a), q, depth, place)
         end do
      end do
   end subroutine follow_outline

   !> Take a point that lies inside a polygon, farther from its outline than the depth so far.
   pure subroutine take_deeper(point, polygon, depth, place)
      real(wp), intent(in) :: point(2), polygon(:, :)
      real(wp), intent(inout) :: depth, place(2)
      real(wp) :: d
      if (.not. point_in_polygon(point, polygon)) return
      d = distance_to_outline(point, polygon)
      if (.not. d > depth) return
      depth = d
      place = point
   end subroutine take_deeper

   !> Does the segment a b lie wholly on one side of a box?
   pure logical function misses(a, b, box)
      real(wp), intent(in) :: a(2), b(2), box(4)
      misses = any(max(a, b) < box(1:2)) .or. any(min(a, b) > box(3:4))
   end function misses

   !> Where the line of c d crosses the segment a b, as parameter on a b; -1 when c d does not reach it.
   pure real(wp) function crossing(a, b, c, d) result(t)
      real(wp), intent(in) :: a(2), b(2), c(2), d(2)
      real(wp) :: u(2), v(2), w(2), det, s
      t = -1
      u = b - a
      v = d - c
      w = c - a
      det = u(1)*v(2) - u(2)*v(1)
      if (.not. abs(det) > 0) return
      s = (w(1)*u(2) - w(2)*u(1))/det
      if (s < 0 .or. s > 1) return
      t = (w(1)*v(2) - w(2)*v(1))/det
   end function crossing

   !> A point inside a polygon: the middle of the longest interval on one of three horizontal lines between corners.
   pure function inner_point(polygon) result(point)
      real(wp), intent(in) :: polygon(:, :)
      real(wp) :: point(2)
      real(wp), allocatable :: x(:), levels(:)
      real(wp) :: y, widest, a(2), b(2)
      integer :: k, n, m, level
      n = size(polygon, 2)
      allocate (x(n), levels(n))
      levels = polygon(2, :)
      call sort(levels)
      point = polygon(:, 1)
      widest = -1
      do level = 1, 3
         ! between two corners at different heights
         k = max(1, min(n - 1, level*n/4))
         do while (k < n - 1 .and. .not. levels(k + 1) > levels(k))
            k = k + 1
         end do
         do while (k > 1 .and. .not. levels(k + 1) > levels(k))
            k = k - 1
         end do
         y = 0.5_wp*(levels(k) + levels(k + 1))
         m = 0
         do k = 1, n
            a = polygon(:, k)
            b = polygon(:, 1 + mod(k, n))
            if ((a(2) > y) .eqv. (b(2) > y)) cycle
            m = m + 1
            x(m) = a(1) + (y - a(2))/(b(2) - a(2))*(b(1) - a(1))
         end do
         call sort(x(1:m))
         do k = 1, m - 1, 2
            if (x(k + 1) - x(k) <= widest) cycle
            widest = x(k + 1) - x(k)
            point = [0.5_wp*(x(k) + x(k + 1)), y]
         end do
      end do
   end function inner_point

   !> Length of the outline.
   pure real(wp) function perimeter(polygon)
      real(wp), intent(in) :: polygon(:, :)
      integer :: k, n
      n = size(polygon, 2)
      perimeter = 0
      do k = 1, n
         perimeter = perimeter + norm2(polygon(:, 1 + mod(k, n)) - polygon(:, k))
      end do
   end function perimeter

   !> Sort numbers.
   pure subroutine sort(values)
      real(wp), intent(inout) :: values(:)
      values = values(sorted_order(values))
   end subroutine sort

end module rockdda_io_block_check
