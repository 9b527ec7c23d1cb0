! SPDX-License-Identifier: MIT
!> Where a lining meets the rock when it is installed: how its line has moved with the rock, which edges of blocks lie
!> along it, and the outlines of its segments.
module rockdda_interaction_liner_places
   use rockdda_base_kinds, only : wp
   use rockdda_base_sorting, only : sorted_order
   use rockdda_geometry_polygons, only : distance_to_outline
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_liner_layout, only : lift
   use rockdda_interaction_affine_motion, only : affine_motion
   implicit none
   private
   public :: stretch_type, find_stretches, follow_rock, segment_outline, opening_side, &
      reach_over_thickness, rock_ends, block_ends

   !> Rock meets a lining that lies closer to its line than this share of the thickness.
   real(wp), parameter :: reach_over_thickness = 0.5_wp

   !> A part of the path that lies along an edge of a block.
   type :: stretch_type
      integer :: piece = 0          !! between the points `piece` and `piece` + 1 of the path
      integer :: block = 0
      real(wp) :: ends(2) = 0       !! shares of the piece
      integer :: side = 0           !! of the path on which there is no rock: 1 left, -1 right
      real(wp) :: distance = 0      !! of the edge in the middle [length]
   end type stretch_type

contains

   !> Stretches of a path along edges of blocks that are there; the side without rock is that of most of them.
   pure subroutine find_stretches(path, reach, blocks, vertices, active, stretches, side)
      real(wp), intent(in) :: path(:, :)         !! (2, points) [length]
      real(wp), intent(in) :: reach              !! [length]
      type(block_system_type), intent(in) :: blocks
      real(wp), intent(in) :: vertices(:, :)     !! (2, vertices) where they are
      logical, intent(in) :: active(:)           !! (blocks)
      type(stretch_type), allocatable, intent(out) :: stretches(:)
      integer, intent(out) :: side               !! 0: there is none
      type(stretch_type), allocatable :: found(:), of_piece(:)
      type(stretch_type) :: new
      real(wp), allocatable :: cuts(:)
      real(wp) :: low(2), high(2), total, middle
      integer, allocatable :: near(:)
      integer :: i, j, k, n
      low = minval(path, 2) - reach
      high = maxval(path, 2) + reach
      allocate (near(0), found(0), stretches(0))
      do i = 1, blocks%n_blocks - blocks%n_segments
         if (.not. active(i)) cycle
         associate (v => vertices(:, blocks%vertex_offset(i) + 1:blocks%vertex_offset(i + 1)))
            if (any(maxval(v, 2) < low) .or. any(minval(v, 2) > high)) cycle
         end associate
         near = [near, i]
      end do
      total = 0
      do k = 1, size(path, 2) - 1
         if (.not. norm2(path(:, k + 1) - path(:, k)) > 0) cycle
         call edges_along(k, of_piece)
         found = [found, of_piece]
         do j = 1, size(of_piece)
            total = total + of_piece(j)%side*(of_piece(j)%ends(2) - of_piece(j)%ends(1))* &
                    norm2(path(:, k + 1) - path(:, k))
         end do
      end do
      side = 0
      if (size(found) == 0) return
      side = merge(1, -1, total >= 0)
      ! the nearest edge of each part
      do k = 1, size(path, 2) - 1
         of_piece = pack(found, found%piece == k .and. found%side == side)
         if (size(of_piece) == 0) cycle
         cuts = [of_piece%ends(1), of_piece%ends(2)]
         cuts = cuts(sorted_order(cuts))
         do j = 1, size(cuts) - 1
            if (cuts(j + 1) - cuts(j) < 1.0e-6_wp) cycle
            middle = 0.5_wp*(cuts(j) + cuts(j + 1))
            n = minloc(of_piece%distance, 1, of_piece%ends(1) < middle .and. of_piece%ends(2) > middle)
            if (n == 0) cycle
            new = of_piece(n)
            new%ends = cuts(j:j + 1)
            stretches = [stretches, new]
         end do
      end do

   contains

      !> Edges along one piece.
      pure subroutine edges_along(k, list)
         integer, intent(in) :: k
         type(stretch_type), allocatable, intent(out) :: list(:)
         type(stretch_type) :: new
         real(wp) :: t(2), l, s(2), h(2), edge(2), d, share
         integer :: i, b, v, first, last, next
         allocate (list(0))
         l = norm2(path(:, k + 1) - path(:, k))
         t = (path(:, k + 1) - path(:, k))/l
         do i = 1, size(near)
            b = near(i)
            first = blocks%vertex_offset(b) + 1
            last = blocks%vertex_offset(b + 1)
            do v = first, last
               next = merge(first, v + 1, v == last)
               edge = vertices(:, next) - vertices(:, v)
               if (abs(dot_product(edge, t)) < 0.5_wp*norm2(edge)) cycle
               s = [dot_product(vertices(:, v) - path(:, k), t), dot_product(vertices(:, next) - path(:, k), t)]/l
               h = [t(1)*(vertices(2, v) - path(2, k)) - t(2)*(vertices(1, v) - path(1, k)), &
                    t(1)*(vertices(2, next) - path(2, k)) - t(2)*(vertices(1, next) - path(1, k))]
               if (min(abs(h(1)), abs(h(2))) > reach .and. h(1)*h(2) > 0) cycle
               new = stretch_type(piece=k, block=b, ends=[max(0.0_wp, minval(s)), min(1.0_wp, maxval(s))])
               if (.not. new%ends(2) - new%ends(1) > 1.0e-6_wp) cycle
               share = (0.5_wp*sum(new%ends) - s(1))/(s(2) - s(1))
               d = h(1) + share*(h(2) - h(1))
               new%distance = abs(d)
               if (new%distance > reach) cycle
               ! counter-clockwise blocks lie to the left of their edges
               new%side = merge(-1, 1, dot_product(edge, t) > 0)
               list = [list, new]
            end do
         end do
      end subroutine edges_along

   end subroutine find_stretches

   !> Distances from the start of a path at which rock along it begins or ends.
   pure function rock_ends(path, stretches, least) result(ends)
      real(wp), intent(in) :: path(:, :)         !! (2, points) [length]
      type(stretch_type), intent(in) :: stretches(:)   !! ascending along the path
      real(wp), intent(in) :: least              !! gaps below are none [length]
      real(wp), allocatable :: ends(:)
      real(wp) :: s(size(path, 2)), from, to, reached
      integer :: j, k
      s(1) = 0
      do k = 2, size(path, 2)
         s(k) = s(k - 1) + norm2(path(:, k) - path(:, k - 1))
      end do
      allocate (ends(0))
      reached = 0
      do j = 1, size(stretches)
         associate (k => stretches(j)%piece)
            from = s(k) + stretches(j)%ends(1)*(s(k + 1) - s(k))
            to = s(k) + stretches(j)%ends(2)*(s(k + 1) - s(k))
         end associate
         if (from - reached > least) then
            if (reached > 0) ends = [ends, reached]
            ends = [ends, from]
         end if
         reached = max(reached, to)
      end do
      if (size(stretches) > 0 .and. s(size(s)) - reached > least) ends = [ends, reached]
   end function rock_ends

   !> Distances from the start of a path at which one block follows another, ascending.
   pure function block_ends(path, stretches) result(ends)
      real(wp), intent(in) :: path(:, :)         !! (2, points) [length]
      type(stretch_type), intent(in) :: stretches(:)   !! ascending along the path
      real(wp), allocatable :: ends(:)
      real(wp) :: s(size(path, 2))
      integer :: j, k
      s(1) = 0
      do k = 2, size(path, 2)
         s(k) = s(k - 1) + norm2(path(:, k) - path(:, k - 1))
      end do
      allocate (ends(0))
      do j = 2, size(stretches)
         if (stretches(j)%block == stretches(j - 1)%block) cycle
         associate (k => stretches(j)%piece)
            ends = [ends, s(k) + stretches(j)%ends(1)*(s(k + 1) - s(k))]
         end associate
      end do
      ! around a closed line
      if (size(stretches) > 1) then
         if (stretches(1)%block /= stretches(size(stretches))%block .and. norm2(path(:, size(s)) - path(:, 1)) <= &
             1.0e-9_wp*s(size(s))) ends = [ends, s(stretches(1)%piece) + stretches(1)%ends(1)* &
                                           (s(stretches(1)%piece + 1) - s(stretches(1)%piece))]
      end if
   end function block_ends

   !> The side of the opening where no rock decides: the inside of a closed line, the left of an open one.
   pure integer function opening_side(path, closed) result(side)
      real(wp), intent(in) :: path(:, :)
      logical, intent(in) :: closed
      real(wp) :: area
      integer :: k
      area = 0
      do k = 1, size(path, 2) - 1
         area = area + (path(1, k) - path(1, 1))*(path(2, k + 1) - path(2, 1)) - &
                (path(2, k) - path(2, 1))*(path(1, k + 1) - path(1, 1))
      end do
      side = merge(-1, 1, closed .and. area < 0)
   end function opening_side

   !> Where the points of a path are after the motion of the rock: each moves with the blocks that are nearest to it,
   !> those beside no rock like their neighbours along the path.
   pure function follow_rock(path, reach, blocks, vertices, active) result(moved)
      real(wp), intent(in) :: path(:, :)         !! (2, points) at the start [length]
      real(wp), intent(in) :: reach              !! [length]
      type(block_system_type), intent(in) :: blocks   !! at the start
      real(wp), intent(in) :: vertices(:, :)     !! (2, vertices) where they are now
      logical, intent(in) :: active(:)
      real(wp) :: moved(2, size(path, 2)), u(2, size(path, 2)), s(size(path, 2)), m(2, 3), distance, nearest, near
      logical :: known(size(path, 2))
      integer :: b, i, j, k, n
      u = 0
      known = .false.
      near = 1.0e-6_wp*maxval(maxval(path, 2) - minval(path, 2))
      s(1) = 0
      do k = 2, size(path, 2)
         s(k) = s(k - 1) + norm2(path(:, k) - path(:, k - 1))
      end do
      do k = 1, size(path, 2)
         nearest = huge(nearest)
         n = 0
         do b = 1, blocks%n_blocks - blocks%n_segments
            if (.not. active(b)) cycle
            associate (v => blocks%vertices(:, blocks%vertex_offset(b) + 1:blocks%vertex_offset(b + 1)))
               if (any(path(:, k) < minval(v, 2) - reach) .or. any(path(:, k) > maxval(v, 2) + reach)) cycle
               distance = distance_to_outline(path(:, k), v)
            end associate
            if (distance > min(reach, nearest + near)) cycle
            m = affine_motion(blocks, vertices, b)
            if (distance < nearest - near) then
               n = 0
               u(:, k) = 0
            end if
            nearest = min(nearest, distance)
            n = n + 1
            u(:, k) = u(:, k) + (m(:, 1) + matmul(m(:, 2:3), path(:, k)) - path(:, k))
         end do
         known(k) = n > 0
         if (n > 0) u(:, k) = u(:, k)/n
      end do
      do k = 1, size(path, 2)
         if (known(k) .or. .not. any(known)) cycle
         i = findloc(known(:k), .true., 1, back=.true.)
         j = findloc(known(k:), .true., 1) + k - 1
         if (i == 0) then
            u(:, k) = u(:, j)
         else if (j < k) then
            u(:, k) = u(:, i)
         else
            u(:, k) = u(:, i) + (s(k) - s(i))/(s(j) - s(i))*(u(:, j) - u(:, i))
         end if
      end do
      moved = path + u
   end function follow_rock

   !> Outline of a segment, counter-clockwise: its part of the path between two distances towards the opening.
   pure function segment_outline(path, closed, first, last, side, from, to) result(outline)
      real(wp), intent(in) :: path(:, :)
      logical, intent(in) :: closed
      integer, intent(in) :: first, last         !! points of the path
      integer, intent(in) :: side                !! of the opening: 1 left, -1 right
      real(wp), intent(in) :: from, to           !! [length]
      real(wp) :: outline(2, 2*(last - first + 1)), outer(2, size(path, 2)), inner(2, size(path, 2))
      integer :: n
      n = last - first + 1
      outer = lift(path, closed, side*from)
      inner = lift(path, closed, side*to)
      if (side > 0) then
         outline(:, 1:n) = outer(:, first:last)
         outline(:, n + 1:) = inner(:, last:first:-1)
      else
         outline(:, 1:n) = inner(:, first:last)
         outline(:, n + 1:) = outer(:, last:first:-1)
      end if
   end function segment_outline

end module rockdda_interaction_liner_places
