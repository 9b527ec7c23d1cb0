! SPDX-License-Identifier: MIT
!> Blocks that have moved from their places in the lists of what is close (rockdda_contact_near_lists), in groups that
!> have moved alike: by one translation, but for a part of the allowance of the lists.
!>
!> The places of a group are moved by its translation, so that its blocks keep their places against each other, and the
!> lists of their pairs hold on. Rock that slides as a whole needs new lists along the sliding planes only.
module rockdda_contact_moved_groups
   use rockdda_base_kinds, only : wp
   use rockdda_base_parallel, only : parallel_blocks
   use rockdda_model_blocks, only : block_system_type
   implicit none
   private
   public :: moved_groups_type

   !> Largest number of groups.
   integer, parameter :: most_groups = 16
   !> Blocks have moved when a vertex has, by this share of the allowance; in a group vertices are left, by the second
   !> share at most, beside their new places.
   real(wp), parameter :: far = 0.5_wp, beside = 0.25_wp
   !> Groups of blocks that stay, and of those that have moved alone.
   integer, parameter :: stays = 0, alone = -1

   !> A pure cache: nothing in it is part of the state.
   type :: moved_groups_type
      logical :: none_has_moved = .false.              !! no vertex further than the allowance: groups are not new
      integer, allocatable, private :: group(:)        !! (nb)
      real(wp), private :: shift(2, most_groups) = 0   !! translations [length]
      integer, private :: n_groups = 0
      integer, private :: n_shifts = 0                 !! of any block since all have moved alone
   contains
      procedure :: find
      procedure :: move_all
      procedure :: move_places
      procedure :: are_together
   end type moved_groups_type

contains

   !> All blocks get new places of their own.
   pure subroutine move_all(self, n_blocks)
      class(moved_groups_type), intent(inout) :: self
      integer, intent(in) :: n_blocks
      if (allocated(self%group)) then
         if (size(self%group) /= n_blocks) deallocate (self%group)
      end if
      if (.not. allocated(self%group)) allocate (self%group(n_blocks))
      self%group = alone
      self%n_groups = 0
      self%n_shifts = 0
   end subroutine move_all

   !> Have two blocks kept their places against each other?
   elemental logical function are_together(self, a, b)
      class(moved_groups_type), intent(in) :: self
      integer, intent(in) :: a, b                      !! blocks
      are_together = self%group(a) == self%group(b) .and. self%group(a) /= alone
   end function are_together

   !> Has no vertex moved further than the allowance? Else put blocks into groups. There is a bound for the rounding of
   !> coordinates, and of places that were moved.
   subroutine find(self, blocks, vertices, places, allowance)
      class(moved_groups_type), intent(inout) :: self
      type(block_system_type), intent(in) :: blocks
      real(wp), intent(in), contiguous :: vertices(:, :), places(:, :)   !! (2, nv)
      real(wp), intent(in) :: allowance                                  !! [length]
      real(wp) :: square, most, rounding, mean(2)
      integer :: members(most_groups), b, g, v
      square = 0
      most = 0
      !$omp parallel do default(none) shared(vertices, places) private(v) reduction(max:square, most) schedule(static) &
      !$omp if (size(vertices, 2) > 4*parallel_blocks)
      do v = 1, size(vertices, 2)
         square = max(square, (vertices(1, v) - places(1, v))**2 + (vertices(2, v) - places(2, v))**2)
         most = max(most, abs(vertices(1, v)), abs(vertices(2, v)))
      end do
      !$omp end parallel do
      rounding = (16 + 2*self%n_shifts)*epsilon(most)*most
      self%none_has_moved = sqrt(square) + rounding <= allowance
      if (self%none_has_moved) return
      self%n_groups = 0
      members = 0
      do b = 1, blocks%n_blocks
         associate (first => blocks%vertex_offset(b) + 1, last => blocks%vertex_offset(b + 1))
            self%group(b) = stays
            if (is_near([0.0_wp, 0.0_wp], far)) cycle
            self%group(b) = alone
            do g = 1, self%n_groups
               if (.not. is_near(self%shift(:, g), beside)) cycle
               self%group(b) = g
               members(g) = members(g) + 1
               exit
            end do
            if (self%group(b) /= alone .or. self%n_groups == most_groups) cycle
            mean = 0
            do v = first, last
               mean = mean + (vertices(:, v) - places(:, v))
            end do
            mean = mean/(last - first + 1)
            if (.not. is_near(mean, beside)) cycle
            self%n_groups = self%n_groups + 1
            self%group(b) = self%n_groups
            self%shift(:, self%n_groups) = mean
            members(self%n_groups) = 1
         end associate
      end do
      self%n_shifts = self%n_shifts + 1
      ! what is alone stands in its places exactly
      do b = 1, blocks%n_blocks
         if (self%group(b) <= stays) cycle
         if (members(self%group(b)) == 1) self%group(b) = alone
      end do

   contains

      !> Are the vertices of block b within a share of the allowance of their places, moved by `shift`? Written so that
      !> a place that is no number is not near.
      pure logical function is_near(shift, share)
         real(wp), intent(in) :: shift(2)              !! [length]
         real(wp), intent(in) :: share
         real(wp) :: limit
         integer :: i
         limit = share*allowance - rounding
         is_near = limit > 0
         do i = blocks%vertex_offset(b) + 1, blocks%vertex_offset(b + 1)
            if (.not. is_near) return
            is_near = (vertices(1, i) - places(1, i) - shift(1))**2 + &
                      (vertices(2, i) - places(2, i) - shift(2))**2 <= limit**2
         end do
      end function is_near

   end subroutine find

   !> New places of the blocks that have moved, and the boxes of these.
   subroutine move_places(self, blocks, vertices, boxes, places, boxes_of_places)
      class(moved_groups_type), intent(in) :: self
      type(block_system_type), intent(in) :: blocks
      real(wp), intent(in), contiguous :: vertices(:, :)       !! (2, nv) now
      real(wp), intent(in), contiguous :: boxes(:, :)          !! (4, nb) of these
      real(wp), intent(inout), contiguous :: places(:, :), boxes_of_places(:, :)
      integer :: b, v
      !$omp parallel do default(none) shared(self, blocks, vertices, boxes, places, boxes_of_places) private(b, v) &
      !$omp schedule(static) if (blocks%n_blocks > parallel_blocks)
      do b = 1, blocks%n_blocks
         associate (g => self%group(b))
            if (g == stays) cycle
            if (g == alone) then
               boxes_of_places(:, b) = boxes(:, b)
               do v = blocks%vertex_offset(b) + 1, blocks%vertex_offset(b + 1)
                  places(:, v) = vertices(:, v)
               end do
            else
               boxes_of_places(1:2, b) = boxes_of_places(1:2, b) + self%shift(:, g)
               boxes_of_places(3:4, b) = boxes_of_places(3:4, b) + self%shift(:, g)
               do v = blocks%vertex_offset(b) + 1, blocks%vertex_offset(b + 1)
                  places(:, v) = places(:, v) + self%shift(:, g)
               end do
            end if
         end associate
      end do
      !$omp end parallel do
   end subroutine move_places

end module rockdda_contact_moved_groups
