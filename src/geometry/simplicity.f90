! SPDX-License-Identifier: MIT
!> Does the outline of a polygon cross itself?
!>
!> Touching is allowed: a corner may be visited twice, a bridge to an island is walked in both directions. Two edges
!> cross when each has its ends on both sides of the other one, farther from it than a tolerance (coordinates in
!> files have few digits).
module rockdda_geometry_simplicity
   use rockdda_base_kinds, only : wp
   use rockdda_geometry_grid, only : grid_type, grid_query_type
   use rockdda_geometry_segments, only : side_of_line
   implicit none
   private
   public :: find_crossing

   !> Below this number of corners all pairs of edges are compared.
   integer, parameter :: few_corners = 40

contains

   !> The first two edges that cross, named by the corners where they start; 0, 0 when the polygon is simple.
   pure subroutine find_crossing(vertices, tolerance, first, second)
      real(wp), intent(in) :: vertices(:, :)   !! (2, n) corners, either direction
      real(wp), intent(in) :: tolerance        !! shallower crossings count as contact without crossing [L]
      integer, intent(out) :: first, second
      type(grid_type) :: grid
      type(grid_query_type) :: query
      real(wp) :: edges(4, size(vertices, 2))
      integer :: i, j, k, n
      n = size(vertices, 2)
      first = 0
      second = 0
      do i = 1, n
         edges(:, i) = [vertices(:, i), vertices(:, 1 + mod(i, n))]
      end do
      if (n > few_corners) call grid%build_segments(edges, 0.0_wp)
      do i = 1, n
         if (n > few_corners) then
            call grid%query_segment(edges(1:2, i), edges(3:4, i), 0.0_wp, query)
            do k = 1, query%n
               j = query%ids(k)
               if (j <= i .or. (second > 0 .and. j > second)) cycle
               if (edges_cross(i, j)) second = j
            end do
         else
            do j = i + 1, n
               if (.not. edges_cross(i, j)) cycle
               second = j
               exit
            end do
         end if
         if (second == 0) cycle
         first = i
         return
      end do

   contains

      !> Do edges i and j cross?
      pure logical function edges_cross(i, j)
         integer, intent(in) :: i, j
         edges_cross = are_split(edges(1:2, i), edges(3:4, i), edges(1:2, j), edges(3:4, j)) .and. &
                       are_split(edges(1:2, j), edges(3:4, j), edges(1:2, i), edges(3:4, i))
      end function edges_cross

      !> Do r and s lie on different sides of the line p q, each farther from it than the tolerance?
      pure logical function are_split(p, q, r, s)
         real(wp), intent(in) :: p(2), q(2), r(2), s(2)
         real(wp) :: a, b, limit
         a = side_of_line(p, q, r)
         b = side_of_line(p, q, s)
         limit = tolerance*hypot(q(1) - p(1), q(2) - p(2))
         are_split = min(a, b) < -limit .and. max(a, b) > limit
      end function are_split

   end subroutine find_crossing

end module rockdda_geometry_simplicity
