! SPDX-License-Identifier: MIT
!> Clip segments to the rock: inside the outline of the region, outside every opening, not along an outline.
module rockdda_lines_clipping
   use rockdda_base_kinds, only : wp
   use rockdda_base_sorting, only : sorted_order
   use rockdda_geometry_polygons, only : point_in_polygon, distance_to_outline
   use rockdda_geometry_segments, only : cross_product
   implicit none
   private
   public :: rock_type, clip_segment

   type :: outline_type
      real(wp), allocatable :: vertices(:, :)   !! (2, n)
   end type outline_type

   type :: rock_type
      type(outline_type) :: region
      type(outline_type), allocatable :: openings(:)
      real(wp) :: tolerance = 0                 !! pieces shorter than this, and nearer to an outline, are dropped [L]
   end type rock_type

contains

   !> The pieces of a segment that lie in the rock, in its own order.
   subroutine clip_segment(rock, ends, pieces, n_pieces, n_short, whole)
      type(rock_type), intent(in) :: rock
      real(wp), intent(in) :: ends(4)                       !! x1 y1 x2 y2
      real(wp), allocatable, intent(inout) :: pieces(:, :)  !! (4, at least n_pieces)
      integer, intent(out) :: n_pieces
      integer, intent(inout) :: n_short                     !! raised by the number of pieces too short to keep
      logical, intent(out) :: whole                         !! the segment was not clipped
      real(wp), allocatable :: cuts(:)
      real(wp) :: p(2), d(2), length, a, b
      integer :: i, n
      n_pieces = 0
      whole = .false.
      p = ends(1:2)
      d = ends(3:4) - p
      length = hypot(d(1), d(2))
      if (.not. length > rock%tolerance) return
      n = 2 + 2*size(rock%region%vertices, 2)
      do i = 1, size(rock%openings)
         n = n + 2*size(rock%openings(i)%vertices, 2)
      end do
      allocate (cuts(n))
      cuts(1:2) = [0.0_wp, 1.0_wp]
      n = 2
      call add_cuts(rock%region%vertices, p, d, length, rock%tolerance, cuts, n)
      do i = 1, size(rock%openings)
         call add_cuts(rock%openings(i)%vertices, p, d, length, rock%tolerance, cuts, n)
      end do
      cuts(1:n) = cuts(sorted_order(cuts(1:n)))
      if (.not. allocated(pieces)) allocate (pieces(4, n))
      if (size(pieces, 2) < n) then
         deallocate (pieces)
         allocate (pieces(4, 2*n))
      end if
      ! intervals in the rock; neighbouring ones form one piece (a segment that touches a corner is not split there)
      a = -1
      do i = 1, n - 1
         b = cuts(i + 1)
         if ((b - cuts(i))*length <= 1.0e-3_wp*rock%tolerance) cycle
         if (is_in_rock(rock, p + 0.5_wp*(cuts(i) + b)*d)) then
            if (a < 0) a = cuts(i)
         else
            if (a >= 0) call add_piece(a, cuts(i))
            a = -1
         end if
      end do
      if (a >= 0) call add_piece(a, 1.0_wp)

   contains

      !> Append a piece, unless it is too short.
      subroutine add_piece(from, to)
         real(wp), intent(in) :: from, to
         if ((to - from)*length <= rock%tolerance) then
            n_short = n_short + 1
            return
         end if
         n_pieces = n_pieces + 1
         pieces(1:2, n_pieces) = p + from*d
         pieces(3:4, n_pieces) = ends(3:4) - (1 - to)*d
         whole = from <= 0 .and. to >= 1
      end subroutine add_piece

   end subroutine clip_segment

   !> Parameters where an outline meets the segment: crossings with its edges, and corners on the segment.
   subroutine add_cuts(vertices, p, d, length, tolerance, cuts, n)
      real(wp), intent(in) :: vertices(:, :), p(2), d(2), length, tolerance
      real(wp), intent(inout) :: cuts(:)
      integer, intent(inout) :: n
      real(wp) :: side, next, t, edge(2)
      integer :: i, k, m
      m = size(vertices, 2)
      do i = 1, m
         k = 1 + mod(i, m)
         edge = vertices(:, k) - vertices(:, i)
         side = cross_product(d, vertices(:, i) - p)/length
         next = cross_product(d, vertices(:, k) - p)/length
         if (abs(side) <= 1.0e-3_wp*tolerance) then
            call add(dot_product(vertices(:, i) - p, d)/length**2)
         else if ((side > 0 .and. next < 0) .or. (side < 0 .and. next > 0)) then
            t = dot_product(vertices(:, i) + side/(side - next)*edge - p, d)/length**2
            call add(t)
         end if
      end do

   contains

      !> Append a parameter inside the segment.
      subroutine add(t)
         real(wp), intent(in) :: t
         if (.not. (t > 0 .and. t < 1)) return
         n = n + 1
         cuts(n) = t
      end subroutine add

   end subroutine add_cuts

   !> Is a point in the rock and not on an outline?
   pure logical function is_in_rock(rock, point)
      type(rock_type), intent(in) :: rock
      real(wp), intent(in) :: point(2)
      integer :: i
      is_in_rock = .false.
      if (.not. point_in_polygon(point, rock%region%vertices)) return
      if (distance_to_outline(point, rock%region%vertices) <= 1.0e-3_wp*rock%tolerance) return
      do i = 1, size(rock%openings)
         if (point_in_polygon(point, rock%openings(i)%vertices)) return
         if (distance_to_outline(point, rock%openings(i)%vertices) <= 1.0e-3_wp*rock%tolerance) return
      end do
      is_in_rock = .true.
   end function is_in_rock

end module rockdda_lines_clipping
