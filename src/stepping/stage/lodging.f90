! SPDX-License-Identifier: MIT
!> Blocks that stand inside each other at the end of a step.
!>
!> How deep: of two convex blocks, the least way along the normal of an edge that takes them apart; of others, the
!> largest distance of a vertex inside the other block from its outline, and their area in common over the diagonal of
!> what their boxes have in common, if that is more. These change by no more than what the blocks move towards each
!> other, so that after one search of all pairs none is needed until the blocks have moved by what the nearest of them
!> is short of the limit. What is found, and in which step, hence does not depend on when was looked.
module rockdda_stepping_lodging
   use rockdda_base_kinds, only : wp
   use rockdda_geometry_box_pairs, only : box_pairs_work_type, find_box_pairs
   use rockdda_geometry_common_area, only : shape_type, set_polygon, common_area
   use rockdda_geometry_polygons, only : inradius_bound, point_in_polygon, distance_to_outline
   use rockdda_geometry_segments, only : side_of_line
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_state, only : block_state_type
   implicit none
   private
   public :: lodging_type, lodged_pair_type, lodged_share, lodged_growth

   !> Blocks that are deeper in each other than this share of the smaller inradius are reported.
   real(wp), parameter :: lodged_share = 0.02_wp
   !> Pairs are reported again when they are deeper by this factor.
   real(wp), parameter :: lodged_growth = 5.0_wp
   !> Pairs are listed when their boxes are closer than this share of the mean inradius.
   real(wp), parameter :: reach = 0.5_wp
   !> The search for the least way apart ends with less than this share of the limit.
   real(wp), parameter :: enough = 0.25_wp

   !> Two blocks that stand inside each other.
   type :: lodged_pair_type
      integer :: blocks(2) = 0
      real(wp) :: depth = 0        !! [length]
      real(wp) :: share = 0        !! of the smaller inradius
      real(wp) :: place(2) = 0     !! relative to the datum [length]
   end type lodged_pair_type

   type :: lodging_type
      private
      type(lodged_pair_type), allocatable, public :: found(:)   !! of the last step, to be reported now
      type(lodged_pair_type), allocatable, public :: told(:)    !! all that have been: a part of the state of a run
      logical, public :: strain_was_reported = .false.          !! a large strain is reported once
      logical, allocatable :: convex(:)                         !! (nb)
      real(wp), allocatable :: inradius(:)                      !! (nb) at the start
      logical, allocatable :: active(:)                         !! (nb) when last looked
      real(wp), allocatable :: listed_at(:, :), looked_at(:, :) !! (2, nv) vertices when pairs were listed, when looked
      integer, allocatable :: pairs(:, :)                       !! (2, >= n_pairs)
      integer :: n_pairs = 0
      real(wp) :: margin = 0, slack = 0
      type(box_pairs_work_type) :: work
   contains
      procedure :: look
      procedure, private :: begin
      procedure, private :: list_pairs
      procedure, private :: test_pair
   end type lodging_type

contains

   !> Find the pairs to report at the end of a step.
   subroutine look(self, blocks, state)
      class(lodging_type), intent(inout) :: self
      type(block_system_type), intent(in) :: blocks
      type(block_state_type), intent(in) :: state
      integer :: k
      logical :: is_new
      if (.not. allocated(self%convex)) call self%begin(blocks)
      if (size(self%found) > 0) self%found = self%found(1:0)
      is_new = .not. allocated(self%active)
      if (.not. is_new) is_new = any(self%active .neqv. state%active)
      if (.not. is_new) then
         ! two blocks may have moved towards each other
         if (2*largest_motion(state%vertices, self%looked_at) < self%slack) return
         is_new = 2*largest_motion(state%vertices, self%listed_at) >= 0.5_wp*self%margin
      end if
      if (is_new) call self%list_pairs(blocks, state)
      self%looked_at = state%vertices
      self%slack = 0.5_wp*self%margin
      do k = 1, self%n_pairs
         call self%test_pair(self%pairs(1, k), self%pairs(2, k), blocks, state)
      end do
   end subroutine look

   !> Largest motion of a vertex.
   pure real(wp) function largest_motion(now, before)
      real(wp), intent(in) :: now(:, :), before(:, :)   !! (2, nv)
      integer :: v
      largest_motion = 0
      do v = 1, size(now, 2)
         largest_motion = max(largest_motion, (now(1, v) - before(1, v))**2 + (now(2, v) - before(2, v))**2)
      end do
      largest_motion = sqrt(largest_motion)
   end function largest_motion

   !> What does not change.
   subroutine begin(self, blocks)
      class(lodging_type), intent(inout) :: self
      type(block_system_type), intent(in) :: blocks
      integer :: i
      if (.not. allocated(self%told)) allocate (self%told(0))
      allocate (self%found(0), self%convex(blocks%n_blocks), self%inradius(blocks%n_blocks))
      do i = 1, blocks%n_blocks
         associate (v => blocks%vertices(:, blocks%vertex_offset(i) + 1:blocks%vertex_offset(i + 1)))
            self%convex(i) = is_convex(v)
            self%inradius(i) = inradius_bound(v)
         end associate
      end do
      self%margin = reach*sum(self%inradius)/blocks%n_blocks
   end subroutine begin

   !> Does no corner turn to the right, but by rounding?
   pure logical function is_convex(v)
      real(wp), intent(in) :: v(:, :)      !! (2, n) counter-clockwise
      real(wp) :: a(2), b(2), turned
      integer :: k, n
      n = size(v, 2)
      is_convex = .false.
      turned = 0
      do k = 1, n
         a = v(:, 1 + mod(k, n)) - v(:, k)
         b = v(:, 1 + mod(k + 1, n)) - v(:, 1 + mod(k, n))
         if (a(1)*b(2) - a(2)*b(1) < -1.0e-9_wp*norm2(a)*norm2(b)) return
         turned = turned + atan2(a(1)*b(2) - a(2)*b(1), dot_product(a, b))
      end do
      ! one turn, not two
      is_convex = turned < 7
   end function is_convex

   !> List pairs of blocks that are there and whose boxes come close.
   subroutine list_pairs(self, blocks, state)
      class(lodging_type), intent(inout) :: self
      type(block_system_type), intent(in) :: blocks
      type(block_state_type), intent(in) :: state
      real(wp), allocatable :: boxes(:, :)
      integer, allocatable :: there(:)
      integer :: i, k
      there = pack([(i, i=1, blocks%n_blocks - blocks%n_segments)], &
                   state%active(:blocks%n_blocks - blocks%n_segments))
      allocate (boxes(4, size(there)))
      do k = 1, size(there)
         associate (v => state%vertices(:, blocks%vertex_offset(there(k)) + 1:blocks%vertex_offset(there(k) + 1)))
            boxes(:, k) = [minval(v(1, :)), minval(v(2, :)), maxval(v(1, :)), maxval(v(2, :))]
         end associate
      end do
      call find_box_pairs(boxes, self%margin, self%pairs, self%n_pairs, self%work)
      do k = 1, self%n_pairs
         self%pairs(:, k) = there(self%pairs(:, k))
      end do
      self%listed_at = state%vertices
      self%active = state%active
   end subroutine list_pairs

   !> Test two blocks; take the slack of all from them.
   subroutine test_pair(self, a, b, blocks, state)
      class(lodging_type), intent(inout) :: self
      integer, intent(in) :: a, b
      type(block_system_type), intent(in) :: blocks
      type(block_state_type), intent(in) :: state
      type(lodged_pair_type) :: pair
      real(wp) :: allowed, smallest
      integer :: k
      smallest = min(self%inradius(a), self%inradius(b))
      allowed = lodged_share*smallest
      do k = 1, size(self%told)
         if (all(self%told(k)%blocks == [a, b])) allowed = lodged_growth*self%told(k)%depth
      end do
      associate (va => state%vertices(:, blocks%vertex_offset(a) + 1:blocks%vertex_offset(a + 1)), &
                 vb => state%vertices(:, blocks%vertex_offset(b) + 1:blocks%vertex_offset(b + 1)))
         if (self%convex(a) .and. self%convex(b)) then
            call take_apart(va, vb, enough*allowed, pair%depth, pair%place)
         else
            call find_deepest(va, vb, allowed, pair%depth, pair%place)
         end if
      end associate
      if (.not. pair%depth > allowed) then
         self%slack = min(self%slack, allowed - pair%depth)
         return
      end if
      self%slack = min(self%slack, (lodged_growth - 1)*pair%depth)
      pair%blocks = [a, b]
      pair%share = pair%depth/smallest
      self%found = [self%found, pair]
      do k = 1, size(self%told)
         if (.not. all(self%told(k)%blocks == [a, b])) cycle
         self%told(k) = pair
         return
      end do
      self%told = [self%told, pair]
   end subroutine test_pair

   !> The least way, along the normal of an edge, that takes two convex polygons apart: negative when they are. It
   !> is not sought below `least`.
   pure subroutine take_apart(p, q, least, depth, place)
      real(wp), intent(in) :: p(:, :), q(:, :)
      real(wp), intent(in) :: least
      real(wp), intent(out) :: depth
      real(wp), intent(out) :: place(2)       !! deepest vertex
      depth = huge(depth)
      place = 0
      call take_along_normals(p, q, least, depth, place)
      if (depth > least) call take_along_normals(q, p, least, depth, place)
   end subroutine take_apart

   !> Along the normals of the edges of p.
   pure subroutine take_along_normals(p, q, least, depth, place)
      real(wp), intent(in) :: p(:, :), q(:, :)
      real(wp), intent(in) :: least
      real(wp), intent(inout) :: depth, place(2)
      real(wp) :: t(2), inside, deepest, length
      integer :: k, m, n, at
      n = size(p, 2)
      do k = 1, n
         t = p(:, 1 + mod(k, n)) - p(:, k)
         length = norm2(t)
         if (.not. length > 0) cycle
         t = t/length
         deepest = -huge(deepest)
         at = 1
         do m = 1, size(q, 2)
            inside = t(1)*(q(2, m) - p(2, k)) - t(2)*(q(1, m) - p(1, k))
            if (inside > deepest) then
               deepest = inside
               at = m
            end if
         end do
         if (deepest < depth) then
            depth = deepest
            place = q(:, at)
         end if
         if (depth < least) return
      end do
   end subroutine take_along_normals

   !> The deepest vertex of each of two polygons in the other one. They also cross without one: then it is their area
   !> in common over the diagonal of what their boxes have in common.
   pure subroutine find_deepest(p, q, allowed, depth, place)
      real(wp), intent(in) :: p(:, :), q(:, :)
      real(wp), intent(in) :: allowed
      real(wp), intent(out) :: depth
      real(wp), intent(out) :: place(2)
      type(shape_type) :: shape(1)
      real(wp) :: low(2), high(2), in_common
      depth = 0
      place = 0
      low = max(minval(p, dim=2), minval(q, dim=2))
      high = min(maxval(p, dim=2), maxval(q, dim=2))
      ! a vertex may enter as soon as the boxes meet
      if (any(low >= high)) then
         depth = -max(0.0_wp, maxval(low - high))
         return
      end if
      call take_deepest(p, q, depth, place)
      call take_deepest(q, p, depth, place)
      if (depth > allowed .or. minval(high - low) < enough*allowed .or. .not. runs_through(p, q, low, high)) return
      call set_polygon(shape(1), q)
      in_common = common_area(p, shape)/norm2(high - low)
      if (in_common <= depth) return
      depth = in_common
      place = 0.5_wp*(low + high)
   end subroutine find_deepest

   !> Does an edge of one of two polygons cross the outline of the other one twice?
   pure logical function runs_through(p, q, low, high)
      real(wp), intent(in) :: p(:, :), q(:, :)
      real(wp), intent(in) :: low(2), high(2)       !! what their boxes have in common
      integer :: crossings(size(p, 2)), k, m, n, n_q
      real(wp) :: a(2), b(2)
      crossings = 0
      runs_through = .false.
      do m = 1, size(q, 2)
         a = q(:, m)
         b = q(:, 1 + mod(m, size(q, 2)))
         if (any(max(a, b) < low) .or. any(min(a, b) > high)) cycle
         n_q = 0
         do k = 1, size(p, 2)
            n = 1 + mod(k, size(p, 2))
            if (any(max(a, b) < min(p(:, k), p(:, n))) .or. any(min(a, b) > max(p(:, k), p(:, n)))) cycle
            if ((side_of_line(a, b, p(:, k)) > 0) .eqv. (side_of_line(a, b, p(:, n)) > 0)) cycle
            if ((side_of_line(p(:, k), p(:, n), a) > 0) .eqv. (side_of_line(p(:, k), p(:, n), b) > 0)) cycle
            n_q = n_q + 1
            crossings(k) = crossings(k) + 1
            runs_through = runs_through .or. n_q > 1 .or. crossings(k) > 1
         end do
      end do
   end function runs_through

   !> The vertex of q that is deepest in p.
   pure subroutine take_deepest(p, q, depth, place)
      real(wp), intent(in) :: p(:, :), q(:, :)
      real(wp), intent(inout) :: depth, place(2)
      real(wp) :: low(2), high(2), d
      integer :: m
      low = minval(p, dim=2)
      high = maxval(p, dim=2)
      do m = 1, size(q, 2)
         if (any(q(:, m) <= low) .or. any(q(:, m) >= high)) cycle
         if (.not. point_in_polygon(q(:, m), p)) cycle
         d = distance_to_outline(q(:, m), p)
         if (.not. d > depth) cycle
         depth = d
         place = q(:, m)
      end do
   end subroutine take_deepest

end module rockdda_stepping_lodging
