! SPDX-License-Identifier: MIT
!> Find the face around each island: a connected group of lines that touches no other lines.
!>
!> From the leftmost node of each group a ray goes left to the first edge of another group: the face on the near side
!> of that edge contains the island, or that edge lies on the contour of a group that lies in the same face.
!> The ray runs an infinitesimal bit above the node's level, so that it passes no node.
module rockdda_cutting_nesting
   use rockdda_base_kinds, only : wp
   use rockdda_base_sorting, only : sorted_order
   use rockdda_geometry_grid, only : grid_type
   use rockdda_cutting_graph, only : graph_type
   use rockdda_cutting_faces, only : face_set_type, half_edge_origin, twin
   implicit none
   private
   public :: nesting_type, find_nesting

   type :: nesting_type
      integer, allocatable :: face(:)       !! (groups) cycle of the face that contains the group; 0: the open plane
      integer, allocatable :: leftmost(:)   !! (groups) leftmost node
      integer, allocatable :: hit(:)        !! (groups) half-edge that the ray meets; 0: none
      integer, allocatable :: order(:)      !! groups from left to right
   end type nesting_type

contains

   !> Find the face around each group.
   pure subroutine find_nesting(graph, faces, nesting)
      type(graph_type), intent(in) :: graph
      type(face_set_type), intent(in) :: faces
      type(nesting_type), intent(out) :: nesting
      type(grid_type) :: grid
      real(wp), allocatable :: segments(:, :)
      integer, allocatable :: edge(:)
      integer :: g, k, c, e, n
      allocate (nesting%face(faces%n_groups), nesting%hit(faces%n_groups), source=0)
      nesting%leftmost = leftmost_nodes(graph, faces)
      nesting%order = sorted_order(graph%position(1, nesting%leftmost))
      if (faces%n_groups < 2) return

      n = count(graph%alive)
      allocate (segments(4, n), edge(n))
      n = 0
      do e = 1, graph%n_edges
         if (.not. graph%alive(e)) cycle
         n = n + 1
         edge(n) = e
         segments(1:2, n) = graph%position(:, graph%ends(1, e))
         segments(3:4, n) = graph%position(:, graph%ends(2, e))
      end do
      call grid%build_segments(segments, 0.0_wp)
      do k = 1, faces%n_groups
         g = nesting%order(k)
         call first_hit(graph%position(:, nesting%leftmost(g)), g, nesting%hit(g))
         if (nesting%hit(g) == 0) cycle
         c = faces%cycle(nesting%hit(g))
         if (faces%area(c) > 0) then
            nesting%face(g) = c
         else
            ! that group begins further left, so that its face is found already
            nesting%face(g) = nesting%face(faces%group(c))
         end if
      end do

   contains

      !> The half-edge, facing the point, of the first edge to the left of it that belongs to another group.
      pure subroutine first_hit(point, own, hit)
         real(wp), intent(in) :: point(2)
         integer, intent(in) :: own
         integer, intent(out) :: hit
         real(wp) :: best, best_slope, x, slope, low(2), high(2)
         integer :: ix, iy, i, id, down
         hit = 0
         best = -huge(best)
         best_slope = -huge(best)
         iy = grid%raster%row(point(2))
         do ix = grid%raster%column(point(1)), 1, -1
            do i = grid%start(ix + (iy - 1)*grid%raster%nx) + 1, grid%start(ix + (iy - 1)*grid%raster%nx + 1)
               id = grid%items(i)
               down = 2*edge(id) - 1
               low = segments(3:4, id)
               high = segments(1:2, id)
               if (low(2) > high(2)) then
                  down = twin(down)
                  low = segments(1:2, id)
                  high = segments(3:4, id)
               end if
               if (.not. (low(2) <= point(2) .and. point(2) < high(2))) cycle
               if (faces%group(faces%cycle(down)) == own) cycle
               slope = (high(1) - low(1))/(high(2) - low(2))
               x = low(1) + slope*(point(2) - low(2))
               if (.not. x < point(1)) cycle
               if (x < best) cycle
               if (.not. x > best .and. slope <= best_slope) cycle
               best = x
               best_slope = slope
               hit = down
            end do
            ! nothing in the cells further left can be nearer
            if (hit > 0) then
               if (grid%raster%column(best) >= ix) exit
            end if
         end do
      end subroutine first_hit

   end subroutine find_nesting

   !> Leftmost node of each group, the lowest of several.
   pure function leftmost_nodes(graph, faces) result(leftmost)
      type(graph_type), intent(in) :: graph
      type(face_set_type), intent(in) :: faces
      integer :: leftmost(faces%n_groups)
      integer :: h, c, g, v
      leftmost = 0
      do h = 1, 2*graph%n_edges
         c = faces%cycle(h)
         if (c == 0) cycle
         g = faces%group(c)
         v = half_edge_origin(graph, h)
         if (leftmost(g) == 0) leftmost(g) = v
         if (is_left_of(graph%position(:, v), graph%position(:, leftmost(g)))) leftmost(g) = v
      end do
   end function leftmost_nodes

   !> Smaller x, or the same x and smaller y.
   pure logical function is_left_of(p, q)
      real(wp), intent(in) :: p(2), q(2)
      is_left_of = p(1) < q(1) .or. (.not. p(1) > q(1) .and. p(2) < q(2))
   end function is_left_of

end module rockdda_cutting_nesting
