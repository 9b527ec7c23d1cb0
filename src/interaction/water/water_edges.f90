! SPDX-License-Identifier: MIT
!> Stretches of the edges of blocks at the start: which of them lie on an edge of another block, and which are free.
!>
!>           +-----+                 the upper edge of the lower block has three stretches: free, a joint, free
!>           |     |
!>     +-----+-----+------+
!>     | free  joint free |
!>
!> Stretches belong to the material of an edge: they move with it, and do not change.
module rockdda_interaction_water_edges
   use rockdda_base_kinds, only : wp
   use rockdda_base_sorting, only : sorted_order
   use rockdda_geometry_box_pairs, only : box_pairs_work_type, find_box_pairs
   use rockdda_model_blocks, only : block_system_type
   use rockdda_interaction_boundary_edges, only : common_stretch, next_vertex
   implicit none
   private
   public :: edge_stretch_type, find_stretches

   type :: edge_stretch_type
      integer :: block = 0
      integer :: vertices(2) = 0     !! of the edge
      real(wp) :: ends(2) = 0        !! of the stretch, shares of the edge's length
      integer :: joints(2) = 0       !! materials of the edge and of the one on which the stretch lies, 0: it is free
   end type edge_stretch_type

   !> Where an edge lies on another.
   type :: cover_type
      integer :: edge = 0            !! by its first vertex
      integer :: joint = 0           !! material of the other
      real(wp) :: ends(2) = 0        !! shares
   end type cover_type

contains

   !> All stretches, by blocks and edges. Bridges to islands have none.
   pure subroutine find_stretches(blocks, tolerance, stretches)
      type(block_system_type), intent(in) :: blocks
      real(wp), intent(in) :: tolerance          !! e0: shorter stretches count to their neighbours [length]
      type(edge_stretch_type), allocatable, intent(out) :: stretches(:)
      type(edge_stretch_type), allocatable :: more(:)
      type(cover_type), allocatable :: covers(:)
      integer, allocatable :: order(:)
      real(wp) :: least
      integer :: b, k, n, first, last
      call find_covers(blocks, tolerance, covers)
      allocate (order, source=sorted_order(covers%edge))
      allocate (stretches(blocks%n_vertices() + 2*size(covers)))
      n = 0
      last = 0
      do b = 1, blocks%n_blocks
         do k = blocks%vertex_offset(b) + 1, blocks%vertex_offset(b + 1)
            first = last + 1
            do while (last < size(covers))
               if (covers(order(last + 1))%edge /= k) exit
               last = last + 1
            end do
            if (blocks%edge_joint(k) == 0) cycle
            least = norm2(blocks%vertices(:, next_vertex(blocks, b, k)) - blocks%vertices(:, k))
            if (.not. least > 0) cycle
            least = min(tolerance/least, 0.5_wp)
            call divide_edge(covers(order(first:last)), least, more)
            more%block = b
            more%vertices(1) = k
            more%vertices(2) = next_vertex(blocks, b, k)
            more%joints(1) = blocks%edge_joint(k)
            stretches(n + 1:n + size(more)) = more
            n = n + size(more)
         end do
      end do
      stretches = stretches(1:n)
   end subroutine find_stretches

   !> Stretches of one edge.
   pure subroutine divide_edge(covers, least, stretches)
      type(cover_type), intent(in) :: covers(:)  !! of the edge
      real(wp), intent(in) :: least              !! share of the shortest stretch
      type(edge_stretch_type), allocatable, intent(out) :: stretches(:)
      real(wp) :: cuts(2*size(covers) + 2), all_cuts(2*size(covers))
      integer :: i, c, n
      all_cuts = [covers%ends(1), covers%ends(2)]
      if (size(covers) > 0) all_cuts = all_cuts(sorted_order(all_cuts))
      n = 1
      cuts(1) = 0
      do i = 1, size(all_cuts)
         if (all_cuts(i) - cuts(n) <= least .or. 1 - all_cuts(i) <= least) cycle
         n = n + 1
         cuts(n) = all_cuts(i)
      end do
      cuts(n + 1) = 1
      allocate (stretches(n))
      do i = 1, n
         stretches(i)%ends = cuts(i:i + 1)
         do c = 1, size(covers)
            if (abs(0.5_wp*(cuts(i) + cuts(i + 1)) - 0.5_wp*sum(covers(c)%ends)) > &
                0.5_wp*(covers(c)%ends(2) - covers(c)%ends(1))) cycle
            stretches(i)%joints(2) = covers(c)%joint
            exit
         end do
      end do
   end subroutine divide_edge

   !> Where edges lie on each other.
   pure subroutine find_covers(blocks, tolerance, covers)
      type(block_system_type), intent(in) :: blocks
      real(wp), intent(in) :: tolerance          !! [length]
      type(cover_type), allocatable, intent(out) :: covers(:)
      type(box_pairs_work_type) :: work
      type(cover_type), allocatable :: more(:)
      real(wp), allocatable :: boxes(:, :)
      real(wp) :: stretch(2)
      integer, allocatable :: pairs(:, :)
      integer :: b, i, j, k, l, n_pairs, n, ends(4)
      allocate (boxes(4, blocks%n_blocks), covers(4*blocks%n_vertices()))
      do b = 1, blocks%n_blocks
         associate (v => blocks%vertices(:, blocks%vertex_offset(b) + 1:blocks%vertex_offset(b + 1)))
            boxes(:, b) = [minval(v, dim=2), maxval(v, dim=2)]
         end associate
      end do
      n = 0
      call find_box_pairs(boxes, tolerance, pairs, n_pairs, work)
      do b = 1, n_pairs
         i = pairs(1, b)
         j = pairs(2, b)
         do k = blocks%vertex_offset(i) + 1, blocks%vertex_offset(i + 1)
            do l = blocks%vertex_offset(j) + 1, blocks%vertex_offset(j + 1)
               if (blocks%edge_joint(k) == 0 .or. blocks%edge_joint(l) == 0) cycle
               ends = [k, next_vertex(blocks, i, k), l, next_vertex(blocks, j, l)]
               stretch = common_stretch(blocks%vertices(:, ends(1)), blocks%vertices(:, ends(2)), &
                                        blocks%vertices(:, ends(3)), blocks%vertices(:, ends(4)), tolerance)
               if (.not. stretch(2) > stretch(1)) cycle
               if (n + 2 > size(covers)) then
                  allocate (more(2*n + 2))
                  more(1:n) = covers(1:n)
                  call move_alloc(more, covers)
               end if
               covers(n + 1) = cover_type(k, blocks%edge_joint(l), stretch/length_of(ends(1:2)))
               ! the other edge runs the other way
               stretch = common_stretch(blocks%vertices(:, ends(3)), blocks%vertices(:, ends(4)), &
                                        blocks%vertices(:, ends(1)), blocks%vertices(:, ends(2)), tolerance)
               covers(n + 2) = cover_type(l, blocks%edge_joint(k), stretch/length_of(ends(3:4)))
               n = n + 2
            end do
         end do
      end do
      covers = covers(1:n)

   contains

      !> Length of an edge.
      pure real(wp) function length_of(vertices)
         integer, intent(in) :: vertices(2)
         length_of = norm2(blocks%vertices(:, vertices(2)) - blocks%vertices(:, vertices(1)))
      end function length_of

   end subroutine find_covers

end module rockdda_interaction_water_edges
