! SPDX-License-Identifier: MIT
!> Bridge edges of a polygon: an edge from an island to the outline around it, walked once in each direction.
!>
!> Both copies of a bridge end are one node of the cut net, so that their coordinates agree bit for bit; a
!> tolerance is not needed, and could exceed the size of a block.
module rockdda_geometry_bridges
   use rockdda_base_kinds, only : wp
   implicit none
   private
   public :: match_bridges

contains

   !> The other copy of each bridge edge, named by the vertex where it starts; 0 where the edge is no bridge or has no
   !> counterpart. Each edge belongs to one pair at most: twin(twin(k)) = k.
   pure function match_bridges(vertices, is_bridge) result(twin)
      real(wp), intent(in) :: vertices(:, :)              !! (2, n) outline; edge k goes from vertex k to the next
      logical, intent(in) :: is_bridge(:)                 !! (n) of the edges
      integer, allocatable :: twin(:)                     !! allocatable: long lists must not live on the stack
      integer, allocatable :: bridges(:)
      integer :: n, i, j, k, m
      n = size(is_bridge)
      allocate (twin(n), source=0)
      bridges = pack([(k, k=1, n)], is_bridge)
      do i = 1, size(bridges)
         k = bridges(i)
         if (twin(k) > 0) cycle
         do j = i + 1, size(bridges)
            m = bridges(j)
            if (twin(m) > 0) cycle
            if (.not. are_equal(vertices(:, m), vertices(:, 1 + mod(k, n)))) cycle
            if (.not. are_equal(vertices(:, 1 + mod(m, n)), vertices(:, k))) cycle
            twin(k) = m
            twin(m) = k
            exit
         end do
      end do
   end function match_bridges

   !> Are two points the same, bit for bit (signs of zero aside)?
   pure logical function are_equal(a, b)
      real(wp), intent(in) :: a(2), b(2)
      are_equal = .not. any(abs(a - b) > 0)
   end function are_equal

end module rockdda_geometry_bridges
