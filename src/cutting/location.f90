! SPDX-License-Identifier: MIT
!> Find the block that contains a point, and the parts of a line in a block.
!>
!> A point closer than e0 to the outline of a block belongs to that block, and so does a point inside; of several
!> blocks the one with the smallest number. Bridges to islands do not belong to an outline.
module rockdda_cutting_location
   use rockdda_base_kinds, only : wp
   use rockdda_base_sorting, only : sorted_order
   use rockdda_geometry_grid, only : grid_type, grid_query_type
   use rockdda_geometry_polygons, only : point_in_polygon, distance_to_outline
   use rockdda_geometry_segments, only : line_intersection, nearest_parameter, segment_point, distance_to_segment
   use rockdda_model_blocks, only : block_system_type
   implicit none
   private
   public :: block_locator_type, line_part_type, line_part

   !> Kinds of parts of a line.
   type :: line_part_enum
      integer :: inside = 1     !! through the inside of the block
      integer :: along = 2      !! along its outline, closer than e0
   end type line_part_enum
   type(line_part_enum), parameter :: line_part = line_part_enum()

   !> A part of a line: parameters from 0 at the start of the line to 1 at its end.
   type :: line_part_type
      integer :: kind = 0       !! one of line_part%...
      real(wp) :: from = 0, to = 0
   end type line_part_type

   type :: block_locator_type
      real(wp) :: e0 = 0                     !! [L]
      type(grid_type) :: grid                !! of the blocks' boxes
      type(grid_query_type) :: query
   contains
      procedure :: init
      procedure :: block_at
      procedure :: blocks_near_line
      procedure :: parts_in_block
   end type block_locator_type

contains

   !> Set up the search structure.
   subroutine init(self, blocks, e0)
      class(block_locator_type), intent(inout) :: self
      type(block_system_type), intent(in) :: blocks
      real(wp), intent(in) :: e0             !! distance within which an outline contains a point [L]
      real(wp), allocatable :: boxes(:, :)
      integer :: i, first, last
      self%e0 = e0
      allocate (boxes(4, blocks%n_blocks))
      do i = 1, blocks%n_blocks
         first = blocks%vertex_offset(i) + 1
         last = blocks%vertex_offset(i + 1)
         boxes(1:2, i) = minval(blocks%vertices(:, first:last), 2) - 1.001_wp*e0
         boxes(3:4, i) = maxval(blocks%vertices(:, first:last), 2) + 1.001_wp*e0
      end do
      call self%grid%build_boxes(boxes, 0.0_wp)
   end subroutine init

   !> Number of the block that a point belongs to, 0 if none.
   integer function block_at(self, blocks, point)
      class(block_locator_type), intent(inout) :: self
      type(block_system_type), intent(in) :: blocks
      real(wp), intent(in) :: point(2)
      integer :: k, i, first, last
      block_at = 0
      call self%grid%query_point(point, self%query)
      do k = 1, self%query%n
         i = self%query%ids(k)
         if (block_at > 0 .and. i > block_at) cycle
         first = blocks%vertex_offset(i) + 1
         last = blocks%vertex_offset(i + 1)
         if (any(point < minval(blocks%vertices(:, first:last), 2) - 1.001_wp*self%e0)) cycle
         if (any(point > maxval(blocks%vertices(:, first:last), 2) + 1.001_wp*self%e0)) cycle
         if (.not. point_in_polygon(point, blocks%vertices(:, first:last))) then
            if (distance_to_outline(point, blocks%vertices(:, first:last), blocks%edge_joint(first:last) == 0) &
                > self%e0) cycle
         end if
         block_at = i
      end do
   end function block_at

   !> Numbers of the blocks whose boxes a line may meet, ascending.
   subroutine blocks_near_line(self, p, q, ids)
      class(block_locator_type), intent(inout) :: self
      real(wp), intent(in) :: p(2), q(2)
      integer, allocatable, intent(out) :: ids(:)
      call self%grid%query_segment(p, q, 0.0_wp, self%query)
      ids = self%query%ids(1:self%query%n)
      ids = ids(sorted_order(ids))
   end subroutine blocks_near_line

   !> Parts of the line p q inside a block or along its outline, from p to q. Parts that touch are joined.
   !>
   !> A part is inside when it is longer than e0 and lies deeper than e0 (in thin blocks: than a quarter of
   !> its length) below the outline; a line that lies entirely within the outline is inside however short it is.
   subroutine parts_in_block(self, blocks, block, p, q, parts)
      class(block_locator_type), intent(in) :: self
      type(block_system_type), intent(in) :: blocks
      integer, intent(in) :: block
      real(wp), intent(in) :: p(2), q(2)
      type(line_part_type), allocatable, intent(out) :: parts(:)
      type(line_part_type) :: part
      real(wp), allocatable :: v(:, :), t(:)
      logical, allocatable :: bridge(:)
      real(wp) :: a(2), b(2), x(2), s, u, length, reach, depth, d
      integer :: first, last, n, k, m, n_t
      logical :: parallel, within, all_near
      allocate (parts(0))
      first = blocks%vertex_offset(block) + 1
      last = blocks%vertex_offset(block + 1)
      n = last - first + 1
      v = blocks%vertices(:, first:last)
      bridge = blocks%edge_joint(first:last) == 0
      length = hypot(q(1) - p(1), q(2) - p(2))
      reach = self%e0/length
      if (any(max(p, q) < minval(v, 2) - self%e0) .or. any(min(p, q) > maxval(v, 2) + self%e0)) return

      ! parameters at which the state may change
      allocate (t(2 + 2*n))
      t(1:2) = [0.0_wp, 1.0_wp]
      n_t = 2
      do k = 1, n
         a = v(:, k)
         b = v(:, 1 + mod(k, n))
         if (distance_to_segment(a, p, q) < self%e0) then
            n_t = n_t + 1
            t(n_t) = nearest_parameter(a, p, q)
         end if
         if (bridge(k)) cycle
         call line_intersection(p, q, a, b, s, u, parallel)
         if (parallel .or. s <= 0 .or. s >= 1 .or. u < 0 .or. u > 1) cycle
         n_t = n_t + 1
         t(n_t) = s
      end do
      t = t(1:n_t)
      t = t(sorted_order(t))

      do k = 1, n_t - 1
         if (.not. t(k + 1) - t(k) > 1.0e-12_wp) cycle
         part%from = t(k)
         part%to = t(k + 1)
         depth = 0
         within = .true.
         all_near = .true.
         do m = 1, 3
            x = segment_point(p, q, part%from + 0.25_wp*m*(part%to - part%from))
            d = distance_to_outline(x, v, bridge)
            within = within .and. point_in_polygon(x, v)
            depth = max(depth, d)
            all_near = all_near .and. d <= self%e0
         end do
         part%kind = 0
         if (within .and. part%to - part%from > reach .and. &
             depth > min(self%e0, 0.24_wp*length*(part%to - part%from))) then
            part%kind = line_part%inside
         else if (within .and. part%from <= 0 .and. part%to >= 1 .and. depth > 0) then
            part%kind = line_part%inside
         else if (all_near) then
            part%kind = line_part%along
         end if
         if (part%kind == 0) cycle
         if (size(parts) > 0) then
            if (parts(size(parts))%kind == part%kind .and. part%from - parts(size(parts))%to <= 1.0e-12_wp) then
               parts(size(parts))%to = part%to
               cycle
            end if
         end if
         parts = [parts, part]
      end do
   end subroutine parts_in_block

end module rockdda_cutting_location
