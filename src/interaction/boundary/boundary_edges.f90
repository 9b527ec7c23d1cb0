! SPDX-License-Identifier: MIT
!> Which edges of blocks belong to a boundary.
!>
!> An outer edge lies on no edge of another block. It belongs to a boundary when both its ends lie within e0 of the
!> polyline, and at each end it runs along a segment that is so close: within 30 degrees, so that chords of a
!> curve count, but no edge that leads from one end of a bent polyline to the other.
module rockdda_interaction_boundary_edges
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_base_strings, only : to_string
   use rockdda_geometry_box_pairs, only : box_pairs_work_type, find_box_pairs
   use rockdda_geometry_segments, only : distance_to_segment
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_parameters, only : parameters_type
   implicit none
   private
   public :: boxes_of, find_outer_edges, common_stretch, edges_along, nearest_outer_edge, next_vertex, report_missing, &
      place

   !> Cosine of the largest angle between an edge and the polyline.
   real(wp), parameter :: least_cosine = 0.86602540378443865_wp

contains

   !> Vertex at which edge k of block b ends.
   pure integer function next_vertex(blocks, b, k)
      type(block_system_type), intent(in) :: blocks
      integer, intent(in) :: b, k
      next_vertex = k + 1
      if (k == blocks%vertex_offset(b + 1)) next_vertex = blocks%vertex_offset(b) + 1
   end function next_vertex

   !> Least and largest coordinates of each block.
   pure function boxes_of(blocks) result(boxes)
      type(block_system_type), intent(in) :: blocks
      real(wp) :: boxes(4, blocks%n_blocks)    !! [length]
      integer :: b
      do b = 1, blocks%n_blocks
         associate (v => blocks%vertices(:, blocks%vertex_offset(b) + 1:blocks%vertex_offset(b + 1)))
            boxes(:, b) = [minval(v, dim=2), maxval(v, dim=2)]
         end associate
      end do
   end function boxes_of

   !> Which edges lie on no edge of another block? Bridges to islands are none.
   pure function find_outer_edges(blocks, tolerance) result(outer)
      type(block_system_type), intent(in) :: blocks
      real(wp), intent(in) :: tolerance    !! [length]
      logical, allocatable :: outer(:)     !! (nv)
      type(box_pairs_work_type) :: work
      integer, allocatable :: pairs(:, :)
      integer :: b, i, j, k, l, n
      allocate (outer(blocks%n_vertices()))
      outer = blocks%edge_joint(1:size(outer)) /= 0
      call find_box_pairs(boxes_of(blocks), tolerance, pairs, n, work)
      do b = 1, n
         i = pairs(1, b)
         j = pairs(2, b)
         do k = blocks%vertex_offset(i) + 1, blocks%vertex_offset(i + 1)
            do l = blocks%vertex_offset(j) + 1, blocks%vertex_offset(j + 1)
               if (.not. outer(k) .and. .not. outer(l)) cycle
               if (.not. lie_on_each_other(blocks%vertices(:, k), blocks%vertices(:, next_vertex(blocks, i, k)), &
                                           blocks%vertices(:, l), blocks%vertices(:, next_vertex(blocks, j, l)), &
                                           tolerance)) cycle
               outer(k) = .false.
               outer(l) = .false.
            end do
         end do
      end do
   end function find_outer_edges

   !> Do two edges that run in opposite directions have a stretch in common that is longer than the tolerance?
   pure logical function lie_on_each_other(p, q, r, s, tolerance)
      real(wp), intent(in) :: p(2), q(2), r(2), s(2)    !! ends of both edges
      real(wp), intent(in) :: tolerance                 !! [length]
      real(wp) :: stretch(2)
      stretch = common_stretch(p, q, r, s, tolerance)
      lie_on_each_other = stretch(2) > stretch(1)
   end function lie_on_each_other

   !> From where to where along p q the edge r s lies on it, in the opposite direction; zeros when this is not longer
   !> than the tolerance.
   pure function common_stretch(p, q, r, s, tolerance) result(stretch)
      real(wp), intent(in) :: p(2), q(2), r(2), s(2)    !! ends of both edges
      real(wp), intent(in) :: tolerance                 !! [length]
      real(wp) :: stretch(2)                            !! distances from p [length]
      real(wp) :: t(2), length, along(2), off(2), low, high, slope
      stretch = 0
      length = norm2(q - p)
      if (.not. length > 0) return
      t = (q - p)/length
      along = [dot_product(r - p, t), dot_product(s - p, t)]
      if (.not. along(1) > along(2)) return
      low = max(0.0_wp, along(2))
      high = min(length, along(1))
      if (.not. high - low > tolerance) return
      off = [t(1)*(r(2) - p(2)) - t(2)*(r(1) - p(1)), t(1)*(s(2) - p(2)) - t(2)*(s(1) - p(1))]
      slope = (off(1) - off(2))/(along(1) - along(2))
      if (abs(off(2) + slope*(low - along(2))) <= tolerance .and. &
          abs(off(2) + slope*(high - along(2))) <= tolerance) stretch = [low, high]
   end function common_stretch

   !> Outer edges along a polyline, and the unit normal of the segment along which each lies.
   pure subroutine edges_along(blocks, outer, polyline, tolerance, edges, edge_blocks, normals)
      type(block_system_type), intent(in) :: blocks
      logical, intent(in) :: outer(:)                       !! (nv)
      real(wp), intent(in) :: polyline(:, :)                !! (2, m)
      real(wp), intent(in) :: tolerance                     !! [length]
      integer, allocatable, intent(out) :: edges(:)         !! (n) by their first vertices, increasing
      integer, allocatable, intent(out) :: edge_blocks(:)   !! (n)
      real(wp), allocatable, intent(out) :: normals(:, :)   !! (2, n)
      real(wp) :: box(4), normal(2)
      integer :: b, k
      logical :: belongs
      allocate (edges(0), edge_blocks(0), normals(2, 0))
      box = [minval(polyline, dim=2) - tolerance, maxval(polyline, dim=2) + tolerance]
      do b = 1, blocks%n_blocks
         do k = blocks%vertex_offset(b) + 1, blocks%vertex_offset(b + 1)
            if (.not. outer(k)) cycle
            if (any(blocks%vertices(:, k) < box(1:2)) .or. any(blocks%vertices(:, k) > box(3:4))) cycle
            call find_segment(blocks%vertices(:, k), blocks%vertices(:, next_vertex(blocks, b, k)), polyline, &
                              tolerance, belongs, normal)
            if (.not. belongs) cycle
            edges = [edges, k]
            edge_blocks = [edge_blocks, b]
            normals = reshape([normals, normal], [2, size(edges)])
         end do
      end do
   end subroutine edges_along

   !> Does an edge belong to a polyline? The segment along which it lies is the one next to its middle.
   pure subroutine find_segment(p, q, polyline, tolerance, belongs, normal)
      real(wp), intent(in) :: p(2), q(2)              !! ends of the edge
      real(wp), intent(in) :: polyline(:, :)
      real(wp), intent(in) :: tolerance               !! [length]
      logical, intent(out) :: belongs
      real(wp), intent(out) :: normal(2)              !! of the segment
      real(wp) :: t(2), u(2), off, least
      integer :: m
      logical :: is_close(2)
      is_close = .false.
      normal = 0
      least = huge(least)
      t = (q - p)/norm2(q - p)
      do m = 1, size(polyline, 2) - 1
         associate (a => polyline(:, m), b => polyline(:, m + 1))
            u = (b - a)/norm2(b - a)
            if (abs(dot_product(t, u)) < least_cosine) cycle
            is_close(1) = is_close(1) .or. distance_to_segment(p, a, b) <= tolerance
            is_close(2) = is_close(2) .or. distance_to_segment(q, a, b) <= tolerance
            off = distance_to_segment(0.5_wp*(p + q), a, b)
            if (off < least) normal = [u(2), -u(1)]
            least = min(least, off)
         end associate
      end do
      belongs = all(is_close)
   end subroutine find_segment

   !> The outer edge whose ends are nearest to a polyline, and how far the farther of them is; 0 when there is none.
   pure subroutine nearest_outer_edge(blocks, outer, polyline, edge, block, distance)
      type(block_system_type), intent(in) :: blocks
      logical, intent(in) :: outer(:)                 !! (nv)
      real(wp), intent(in) :: polyline(:, :)
      integer, intent(out) :: edge, block
      real(wp), intent(out) :: distance               !! [length]
      real(wp) :: off
      integer :: b, k
      edge = 0
      block = 0
      distance = huge(distance)
      do b = 1, blocks%n_blocks
         do k = blocks%vertex_offset(b) + 1, blocks%vertex_offset(b + 1)
            if (.not. outer(k)) cycle
            off = max(distance_to(blocks%vertices(:, k)), distance_to(blocks%vertices(:, next_vertex(blocks, b, k))))
            if (off >= distance) cycle
            edge = k
            block = b
            distance = off
         end do
      end do

   contains

      !> Distance of a point from the polyline.
      pure real(wp) function distance_to(point)
         real(wp), intent(in) :: point(2)
         integer :: m
         distance_to = huge(distance_to)
         do m = 1, size(polyline, 2) - 1
            distance_to = min(distance_to, distance_to_segment(point, polyline(:, m), polyline(:, m + 1)))
         end do
      end function distance_to

   end subroutine nearest_outer_edge

   !> A boundary without an edge.
   subroutine report_missing(blocks, outer, parameters, g, tolerance, messages)
      type(block_system_type), intent(in) :: blocks
      logical, intent(in) :: outer(:)
      type(parameters_type), intent(in) :: parameters
      integer, intent(in) :: g                   !! boundary
      real(wp), intent(in) :: tolerance          !! [length]
      type(diagnostics_type), intent(inout) :: messages
      character(len=:), allocatable :: text
      real(wp) :: distance
      integer :: edge, block
      text = '&boundary '//to_string(g)//': no outer edge of a block has both ends within '// &
             parameters%shown(tolerance, 'length')//' of the polyline'
      call nearest_outer_edge(blocks, outer, parameters%boundaries(g)%along, edge, block, distance)
      if (edge > 0) then
         text = text//'; the nearest one leads from '//place(blocks%vertices(:, edge))//' to '// &
                place(blocks%vertices(:, next_vertex(blocks, block, edge)))//', '
         if (distance > tolerance) then
            text = text//parameters%shown(distance, 'length')//' away'
         else
            text = text//'across it'
         end if
      end if
      call messages%add(severity%error, text, parameters%boundaries(g)%origin)
   end subroutine report_missing

   !> "(1, 2.5)"
   pure function place(point) result(text)
      real(wp), intent(in) :: point(2)
      character(len=:), allocatable :: text
      text = '('//to_string(point(1), 6)//', '//to_string(point(2), 6)//')'
   end function place

end module rockdda_interaction_boundary_edges
