! SPDX-License-Identifier: MIT
!> Where a lining meets the rock when it is installed: how its line has moved with the rock, which edges of blocks lie
!> along it, and the outlines of its segments.
module rockdda_interaction_liner_places
   use rockdda_base_kinds, only : wp
   use rockdda_base_sorting, only : sorted_order
   use rockdda_geometry_polygons, only : distance_to_outline
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_liner_layout, only : lift
   use rockdda_interaction_kinematics, only : affine_motion
   implicit none
   private
   public :: stretch_type, find_stretches, follow_rock, faces_of_path, segment_outline, opening_side, &
      reach_over_thickness, rock_ends, block_ends, distances_along

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
      real(wp), allocatable :: cuts(:), low(:, :), high(:, :)
      real(wp) :: total, middle
      integer, allocatable :: near(:)
      integer :: i, j, k, n, n_near, n_found, n_stretches, start(size(path, 2))
      allocate (near(blocks%n_blocks), low(2, blocks%n_blocks), high(2, blocks%n_blocks), found(16), stretches(16))
      n_near = 0
      do i = 1, blocks%n_blocks - blocks%n_segments
         if (.not. active(i)) cycle
         associate (v => vertices(:, blocks%vertex_offset(i) + 1:blocks%vertex_offset(i + 1)))
            low(:, n_near + 1) = minval(v, 2) - reach
            high(:, n_near + 1) = maxval(v, 2) + reach
         end associate
         if (any(high(:, n_near + 1) < minval(path, 2)) .or. any(low(:, n_near + 1) > maxval(path, 2))) cycle
         n_near = n_near + 1
         near(n_near) = i
      end do
      total = 0
      n_found = 0
      do k = 1, size(path, 2) - 1
         start(k) = n_found
         if (.not. norm2(path(:, k + 1) - path(:, k)) > 0) cycle
         call edges_along(k, found, n_found)
         do j = start(k) + 1, n_found
            total = total + found(j)%side*(found(j)%ends(2) - found(j)%ends(1))*norm2(path(:, k + 1) - path(:, k))
         end do
      end do
      start(size(path, 2)) = n_found
      side = 0
      n_stretches = 0
      if (n_found > 0) side = merge(1, -1, total >= 0)
      ! the nearest edge of each part
      do k = 1, size(path, 2) - 1
         i = start(k + 1)
         of_piece = pack(found(start(k) + 1:i), found(start(k) + 1:i)%side == side)
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
            call append(new, stretches, n_stretches)
         end do
      end do
      stretches = stretches(:n_stretches)

   contains

      !> One more stretch of a list.
      pure subroutine append(new, list, n)
         type(stretch_type), intent(in) :: new
         type(stretch_type), allocatable, intent(inout) :: list(:)
         integer, intent(inout) :: n
         type(stretch_type), allocatable :: longer(:)
         if (n == size(list)) then
            allocate (longer(2*n))
            longer(:n) = list
            call move_alloc(longer, list)
         end if
         n = n + 1
         list(n) = new
      end subroutine append

      !> Edges along one piece, behind those of others.
      pure subroutine edges_along(k, found, n_found)
         integer, intent(in) :: k
         type(stretch_type), allocatable, intent(inout) :: found(:)
         integer, intent(inout) :: n_found
         type(stretch_type) :: new
         real(wp) :: t(2), l, s(2), h(2), edge(2), d, share
         integer :: i, b, v, first, last, next
         l = norm2(path(:, k + 1) - path(:, k))
         t = (path(:, k + 1) - path(:, k))/l
         do i = 1, n_near
            if (any(high(:, i) < min(path(:, k), path(:, k + 1))) .or. &
                any(low(:, i) > max(path(:, k), path(:, k + 1)))) cycle
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
               call append(new, found, n_found)
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
      real(wp) :: from(size(stretches) + 1), reached(0:size(stretches)), both(2, size(stretches) + 1)
      logical :: gap(2, size(stretches) + 1)
      integer :: n
      n = size(stretches)
      call find_distances(path, stretches, from(:n), reached)
      from(n + 1) = sum(norm2(path(:, 2:) - path(:, :size(path, 2) - 1), 1))
      both(1, :) = reached
      both(2, :) = from
      gap = spread(from - reached > least, 1, 2)
      gap(1, 1) = .false.
      gap(2, n + 1) = .false.
      if (n == 0) gap = .false.
      ends = pack(both, gap)
   end function rock_ends

   !> Distances from the start of a path at which stretches begin, and that rock has reached behind each; 0 before the
   !> first.
   pure subroutine find_distances(path, stretches, from, reached)
      real(wp), intent(in) :: path(:, :)         !! (2, points) [length]
      type(stretch_type), intent(in) :: stretches(:)   !! ascending along the path
      real(wp), intent(out) :: from(:)           !! (stretches)
      real(wp), intent(out) :: reached(0:)       !! (0:stretches)
      real(wp) :: s(size(path, 2))
      integer :: j
      s = distances_along(path)
      reached(0) = 0
      do j = 1, size(stretches)
         associate (k => stretches(j)%piece, shares => stretches(j)%ends)
            from(j) = s(k) + shares(1)*(s(k + 1) - s(k))
            reached(j) = max(reached(j - 1), s(k) + shares(2)*(s(k + 1) - s(k)))
         end associate
      end do
   end subroutine find_distances

   !> Distances of the points of a path from its start, along it.
   pure function distances_along(path) result(s)
      real(wp), intent(in) :: path(:, :)
      real(wp) :: s(size(path, 2))
      integer :: k
      s(1) = 0
      do k = 2, size(path, 2)
         s(k) = s(k - 1) + norm2(path(:, k) - path(:, k - 1))
      end do
   end function distances_along

   !> Distances from the start of a path at which one block follows another, without a gap, ascending.
   pure function block_ends(path, stretches, least) result(ends)
      real(wp), intent(in) :: path(:, :)         !! (2, points) [length]
      type(stretch_type), intent(in) :: stretches(:)   !! ascending along the path
      real(wp), intent(in) :: least              !! gaps below are none [length]
      real(wp), allocatable :: ends(:)
      real(wp) :: s(size(path, 2)), reached(0:size(stretches)), from(size(stretches))
      logical :: follows(size(stretches))
      integer :: j
      s = distances_along(path)
      call find_distances(path, stretches, from, reached)
      follows = .false.
      do j = 2, size(stretches)
         follows(j) = stretches(j)%block /= stretches(j - 1)%block .and. from(j) - reached(j - 1) <= least
      end do
      ! around a closed line
      if (size(stretches) > 1) then
         j = size(stretches)
         follows(1) = stretches(1)%block /= stretches(j)%block .and. norm2(path(:, size(s)) - path(:, 1)) <= &
                      1.0e-9_wp*s(size(s)) .and. from(1) + s(size(s)) - reached(j) <= least
      end if
      ends = pack(from, follows)
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
      real(wp) :: low(2, blocks%n_blocks), high(2, blocks%n_blocks)
      logical :: known(size(path, 2))
      integer :: b, i, j, k, n
      u = 0
      known = .false.
      near = 1.0e-6_wp*maxval(maxval(path, 2) - minval(path, 2))
      s = distances_along(path)
      do b = 1, blocks%n_blocks
         associate (v => blocks%vertices(:, blocks%vertex_offset(b) + 1:blocks%vertex_offset(b + 1)))
            low(:, b) = minval(v, 2) - reach
            high(:, b) = maxval(v, 2) + reach
         end associate
      end do
      do k = 1, size(path, 2)
         nearest = huge(nearest)
         n = 0
         do b = 1, blocks%n_blocks - blocks%n_segments
            if (.not. active(b)) cycle
            if (any(path(:, k) < low(:, b)) .or. any(path(:, k) > high(:, b))) cycle
            distance = distance_to_outline(path(:, k), blocks%vertices(:, blocks%vertex_offset(b) + 1: &
                                                                       blocks%vertex_offset(b + 1)))
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
      i = 0   ! the last known point
      j = 0   ! the next one, from k on
      do k = 1, size(path, 2)
         if (.not. any(known)) exit
         if (known(k)) i = k
         if (j < k .and. .not. known(k)) then
            j = k + findloc(known(k:), .true., 1) - 1
            if (j < k) j = size(path, 2) + 1
         end if
         if (known(k)) cycle
         if (i == 0) then
            u(:, k) = u(:, j)
         else if (j > size(path, 2)) then
            u(:, k) = u(:, i)
         else
            u(:, k) = u(:, i) + (s(k) - s(i))/(s(j) - s(i))*(u(:, j) - u(:, i))
         end if
      end do
      moved = path + u
   end function follow_rock

   !> Both faces of a lining, half of its thickness on either side of a path.
   pure function faces_of_path(path, closed, side, thickness) result(faces)
      real(wp), intent(in) :: path(:, :)
      logical, intent(in) :: closed
      integer, intent(in) :: side                !! of the opening: 1 left, -1 right
      real(wp), intent(in) :: thickness          !! [length]
      real(wp) :: faces(2, size(path, 2), 2)
      faces(:, :, 1) = lift(path, closed, -0.5_wp*side*thickness)
      faces(:, :, 2) = lift(path, closed, 0.5_wp*side*thickness)
   end function faces_of_path

   !> Outline of a segment, counter-clockwise: its part of both faces.
   pure function segment_outline(faces, first, last, side) result(outline)
      real(wp), intent(in) :: faces(:, :, :)     !! of `faces_of_path`
      integer, intent(in) :: first, last         !! points of the path
      integer, intent(in) :: side                !! of the opening: 1 left, -1 right
      real(wp) :: outline(2, 2*(last - first + 1))
      integer :: n, outer
      n = last - first + 1
      outer = merge(1, 2, side > 0)
      outline(:, 1:n) = faces(:, first:last, outer)
      outline(:, n + 1:) = faces(:, last:first:-1, 3 - outer)
   end function segment_outline

end module rockdda_interaction_liner_places
