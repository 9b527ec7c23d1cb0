! SPDX-License-Identifier: MIT
!> Broad phase of the contact search: pairs of blocks whose boxes come close.
!>
!> The pairs are found for a wider margin than the search radius, and kept until a box has moved too far from its place
!> at that time. They are candidates: the caller tests each with `is_close`, which uses the present boxes. The pairs
!> that pass, and their order, therefore do not depend on when the candidates were found.
module rockdda_contact_broad_phase
   use rockdda_base_kinds, only : wp
   use rockdda_base_parallel, only : parallel_blocks, parallel_contacts
   use rockdda_geometry_box_pairs, only : box_pairs_work_type, find_box_pairs
   use rockdda_geometry_grid, only : typical_size
   use rockdda_model_blocks, only : block_system_type
   implicit none
   private
   public :: close_pairs_type, many_parts, boxes_close

   !> Parts in which the pairs of a large model are searched.
   integer, parameter :: many_parts = 16

   !> Candidate pairs of blocks. A pure cache: nothing in it is part of the state.
   type :: close_pairs_type
      logical :: keep = .true.                      !! reuse the candidates while they are complete
      logical :: was_kept = .false.                 !! the last update did
      integer :: n = 0                              !! candidates
      integer, allocatable :: candidates(:, :)      !! (2, >= n) first < second block, sorted
      real(wp), allocatable :: boxes(:, :)          !! (4, nb) xmin ymin xmax ymax now
      real(wp) :: reach = 0                         !! largest distance of interest now
      logical, allocatable :: active(:)             !! (nb) active blocks; not allocated: all
      logical, allocatable :: asleep(:)             !! (nb) blocks that do not move; not allocated: none
      logical, allocatable :: resting(:)            !! (nb) those close to no block that may move
      real(wp), allocatable, private :: places(:, :)   !! (4, nb) boxes when the candidates were found
      real(wp), private :: margin = -1              !! and the margin
      type(box_pairs_work_type), private :: work
   contains
      procedure :: update
      procedure :: is_close
      procedure :: allowance
      procedure :: n_parts
      procedure :: first_of
   end type close_pairs_type

contains

   !> Candidates for all pairs of blocks that come closer than `reach`.
   subroutine update(self, blocks, vertices, reach)
      class(close_pairs_type), intent(inout) :: self
      type(block_system_type), intent(in) :: blocks
      real(wp), intent(in), contiguous :: vertices(:, :)   !! (2, nv) now
      real(wp), intent(in) :: reach
      real(wp) :: moved, rounding, size_of_blocks(2)
      self%reach = reach
      if (.not. allocated(self%boxes)) then
         allocate (self%boxes(4, blocks%n_blocks), self%places(4, blocks%n_blocks))
         self%margin = -1
      end if
      call update_boxes(blocks, vertices, self%boxes)
      self%was_kept = .false.
      if (self%keep .and. self%margin >= 0) then
         call measure_motion(self%boxes, self%places, moved, rounding)
         self%was_kept = reach + 2*moved + rounding <= self%margin
      end if
      if (.not. self%was_kept) then
         size_of_blocks = typical_size(self%boxes, 0.0_wp)
         self%margin = 1.5_wp*reach + 0.2_wp*minval(size_of_blocks)
         self%places = self%boxes
         call find_box_pairs(self%boxes, self%margin, self%candidates, self%n, self%work)
      end if
      if (allocated(self%resting)) deallocate (self%resting)
      if (allocated(self%asleep)) call find_resting(self, blocks, vertices)
   end subroutine update

   !> Mark the blocks asleep that are close to none awake: pairs of them need no search. Boxes do not suffice: that
   !> of a long base of a slope holds most of the rock.
   pure subroutine find_resting(self, blocks, vertices)
      class(close_pairs_type), intent(inout) :: self
      type(block_system_type), intent(in) :: blocks
      real(wp), intent(in), contiguous :: vertices(:, :)   !! (2, nv) now
      logical, allocatable :: resting(:)
      integer :: k
      allocate (resting, source=self%asleep)
      do k = 1, self%n
         associate (a => self%candidates(1, k), b => self%candidates(2, k))
            if (self%asleep(a) .eqv. self%asleep(b)) cycle
            if (.not. (resting(a) .or. resting(b))) cycle
            if (.not. self%is_close(k)) cycle
            if (.not. has_edge_close(blocks, vertices, a, b, self%boxes(:, b), self%reach)) cycle
            if (.not. has_edge_close(blocks, vertices, b, a, self%boxes(:, a), self%reach)) cycle
            resting(a) = .false.
            resting(b) = .false.
         end associate
      end do
      call move_alloc(resting, self%resting)
   end subroutine find_resting

   !> Does a block have an edge that may come closer to another block than a margin? Such an edge meets the box of that
   !> block, and has it not on one side.
   pure logical function has_edge_close(blocks, vertices, block, other, box, margin) result(has)
      type(block_system_type), intent(in) :: blocks
      real(wp), intent(in), contiguous :: vertices(:, :)
      integer, intent(in) :: block, other
      real(wp), intent(in) :: box(4)   !! of the other one
      real(wp), intent(in) :: margin
      real(wp) :: begin(2), end(2), along(2), side, lowest, highest
      integer :: v, k
      has = .true.
      begin = vertices(:, blocks%vertex_offset(block + 1))
      do v = blocks%vertex_offset(block) + 1, blocks%vertex_offset(block + 1)
         end = vertices(:, v)
         if (all(min(begin, end) <= box(3:4) + margin) .and. all(max(begin, end) >= box(1:2) - margin)) then
            along = end - begin
            lowest = huge(lowest)
            highest = -huge(highest)
            do k = blocks%vertex_offset(other) + 1, blocks%vertex_offset(other + 1)
               side = along(1)*(vertices(2, k) - begin(2)) - along(2)*(vertices(1, k) - begin(1))
               lowest = min(lowest, side)
               highest = max(highest, side)
            end do
            if (max(lowest, -highest) <= margin*norm2(along)) return
         end if
         begin = end
      end do
      has = .false.
   end function has_edge_close

   !> Are the blocks of candidate k at present closer than `reach`?
   pure logical function is_close(self, k)
      class(close_pairs_type), intent(in) :: self
      integer, intent(in) :: k
      is_close = .false.
      if (allocated(self%active)) then
         if (.not. (self%active(self%candidates(1, k)) .and. self%active(self%candidates(2, k)))) return
      end if
      if (allocated(self%resting)) then
         associate (a => self%candidates(1, k), b => self%candidates(2, k))
            if (self%resting(a) .and. (self%resting(b) .or. .not. self%asleep(b))) return
            if (self%resting(b) .and. .not. self%asleep(a)) return
         end associate
      end if
      associate (a => self%candidates(1, k), b => self%candidates(2, k))
         is_close = boxes_close(self%boxes(:, a), self%boxes(:, b), self%reach)
      end associate
   end function is_close

   !> How far vertices may move while lists of what is close in the pairs are kept: a part of what boxes may.
   pure real(wp) function allowance(self)
      class(close_pairs_type), intent(in) :: self
      allowance = 0.025_wp*self%margin
   end function allowance

   !> Number of parts into which the candidates are divided.
   pure integer function n_parts(self)
      class(close_pairs_type), intent(in) :: self
      n_parts = merge(many_parts, 1, self%n > parallel_contacts)
   end function n_parts

   !> First candidate of a part; that of the part after the last one is n + 1.
   pure integer function first_of(self, part)
      class(close_pairs_type), intent(in) :: self
      integer, intent(in) :: part
      first_of = int(real(part - 1, wp)/self%n_parts()*self%n) + 1
   end function first_of

   !> Bounding boxes of all blocks.
   subroutine update_boxes(blocks, vertices, boxes)
      type(block_system_type), intent(in) :: blocks
      real(wp), intent(in), contiguous :: vertices(:, :)
      real(wp), intent(inout) :: boxes(:, :)
      real(wp) :: low(2), high(2)
      integer :: i, v
      !$omp parallel do default(none) shared(blocks, vertices, boxes) private(i, v, low, high) schedule(static) &
      !$omp if (blocks%n_blocks > parallel_blocks)
      do i = 1, blocks%n_blocks
         low = vertices(:, blocks%vertex_offset(i) + 1)
         high = low
         do v = blocks%vertex_offset(i) + 2, blocks%vertex_offset(i + 1)
            low = min(low, vertices(:, v))
            high = max(high, vertices(:, v))
         end do
         boxes(:, i) = [low, high]
      end do
      !$omp end parallel do
   end subroutine update_boxes

   !> Largest distance by which a box extends beyond its earlier place, and a bound for the rounding of coordinates.
   subroutine measure_motion(boxes, places, moved, rounding)
      real(wp), intent(in), contiguous :: boxes(:, :), places(:, :)
      real(wp), intent(out) :: moved, rounding
      integer :: i
      moved = 0
      rounding = 0
      !$omp parallel do default(none) shared(boxes, places) private(i) reduction(max:moved, rounding) schedule(static) &
      !$omp if (size(boxes, 2) > 4*parallel_blocks)
      do i = 1, size(boxes, 2)
         moved = max(moved, places(1, i) - boxes(1, i), places(2, i) - boxes(2, i), boxes(3, i) - places(3, i), &
                     boxes(4, i) - places(4, i))
         rounding = max(rounding, abs(boxes(1, i)), abs(boxes(2, i)), abs(boxes(3, i)), abs(boxes(4, i)))
      end do
      !$omp end parallel do
      rounding = 16*epsilon(rounding)*rounding
   end subroutine measure_motion

   !> Do two boxes come closer than the margin in both directions?
   pure logical function boxes_close(p, q, margin)
      real(wp), intent(in) :: p(4), q(4), margin
      boxes_close = p(1) - margin <= q(3) .and. p(2) - margin <= q(4) .and. q(1) - margin <= p(3) .and. &
                    q(2) - margin <= p(4)
   end function boxes_close

end module rockdda_contact_broad_phase
