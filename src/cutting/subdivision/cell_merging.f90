! SPDX-License-Identifier: MIT
!> Unite cells of a block: across bridges to islands, and slivers with a neighbour.
!>
!> A cell is a sliver when twice its area over its perimeter (the radius of its inscribed circle, up to a factor of 2)
!> is below a limit. It is united with the neighbour along its longest side, of those with which it makes a convex cell;
!> in a block that is not convex, with another one when there is none of these.
!>
!>     +------+------+        the node at the end of the removed edge stays in the cells on its other side,
!>     |      |      |        so that every inner edge belongs to two cells and has the same ends in both
!>     |      |  N   |
!>     +------+- - - +        S is united with N
!>     |      |__S_/
!>     |___/
module rockdda_cutting_cell_merging
   use rockdda_base_kinds, only : wp
   use rockdda_geometry_polygons, only : inradius_bound
   use rockdda_geometry_segments, only : cross_product
   use rockdda_cutting_cell_map, only : cell_map_type
   implicit none
   private
   public :: remove_bridges, merge_slivers, drop_straight_nodes, is_convex

   !> Sines up to this count as 0.
   real(wp), parameter :: straight = 1.0e-9_wp
   !> A cell that has been united is judged again, at most so often.
   integer, parameter :: most_passes = 10

contains

   !> Remove each part of a bridge that has different cells on its two sides.
   pure subroutine remove_bridges(map)
      type(cell_map_type), intent(inout) :: map
      integer :: h
      do h = 1, map%n
         if (.not. map%alive(h) .or. map%joint(h) /= 0 .or. map%twin(h) < h) cycle
         if (.not. is_in_loop(map, map%twin(h), h)) call map%remove_chain(h, h)
      end do
   end subroutine remove_bridges

   !> Does a half-edge belong to the loop of another?
   pure logical function is_in_loop(map, h, loop)
      type(cell_map_type), intent(in) :: map
      integer, intent(in) :: h, loop
      integer :: k
      k = loop
      do
         is_in_loop = k == h
         k = map%next(k)
         if (is_in_loop .or. k == loop) return
      end do
   end function is_in_loop

   !> Unite slivers with neighbours.
   pure subroutine merge_slivers(map, limit, convex_only)
      type(cell_map_type), intent(inout) :: map
      real(wp), intent(in) :: limit              !! smallest thickness of a cell [L]
      logical, intent(in) :: convex_only         !! united cells must be convex
      integer, allocatable :: cell(:)
      logical, allocatable :: seen(:)
      logical :: changed
      integer :: pass, h
      allocate (cell(map%n), seen(map%n))
      call label_loops(map, cell)
      do pass = 1, most_passes
         changed = .false.
         seen = .false.
         do h = 1, map%n
            if (.not. map%alive(h)) cycle
            if (seen(cell(h))) cycle
            seen(cell(h)) = .true.
            if (inradius_bound(map%position(:, map%loop_of(h))) < limit) &
               call merge_cell(map, h, convex_only, cell, changed)
         end do
         if (.not. changed) return
      end do
   end subroutine merge_slivers

   !> Number of the cell of each half-edge: its smallest half-edge.
   pure subroutine label_loops(map, cell)
      type(cell_map_type), intent(in) :: map
      integer, intent(out) :: cell(:)            !! (half-edges) 0: removed
      integer :: h
      cell = 0
      do h = 1, map%n
         if (map%alive(h) .and. cell(h) == 0) call label_loop(map, h, h, cell)
      end do
   end subroutine label_loops

   !> Label the loop of a half-edge.
   pure subroutine label_loop(map, half_edge, label, cell)
      type(cell_map_type), intent(in) :: map
      integer, intent(in) :: half_edge, label
      integer, intent(inout) :: cell(:)
      integer :: h
      h = half_edge
      do
         cell(h) = label
         h = map%next(h)
         if (h == half_edge) exit
      end do
   end subroutine label_loop

   !> Unite a cell with the best of its neighbours, if there is one.
   pure subroutine merge_cell(map, half_edge, convex_only, cell, changed)
      type(cell_map_type), intent(inout) :: map
      integer, intent(in) :: half_edge           !! of the cell
      logical, intent(in) :: convex_only         !! a united cell must be convex
      integer, intent(inout) :: cell(:)
      logical, intent(inout) :: changed
      integer :: first, last, best(2), h, neighbour
      real(wp) :: length, best_length
      logical :: convex, best_convex, one_chain
      best = 0
      best_length = 0
      best_convex = .false.
      h = half_edge
      do
         call shared_chain(map, h, cell, first, last, length, one_chain)
         if (one_chain .and. first == h) then
            convex = is_convex(united_outline(map, first, last))
            if ((convex .or. .not. convex_only) .and. ((convex .and. .not. best_convex) .or. &
                ((convex .eqv. best_convex) .and. length > best_length))) then
               best = [first, last]
               best_length = length
               best_convex = convex
            end if
         end if
         h = map%next(h)
         if (h == half_edge) exit
      end do
      if (best(1) == 0) return
      neighbour = cell(map%twin(best(1)))
      h = map%previous(best(1))
      call map%remove_chain(best(1), best(2))
      call label_loop(map, h, neighbour, cell)
      changed = .true.
   end subroutine merge_cell

   !> All edges that the cell of a half-edge shares with the cell beyond it. One chain: they follow each other in both
   !> cells, and neither cell consists of them alone.
   pure subroutine shared_chain(map, half_edge, cell, first, last, length, one_chain)
      type(cell_map_type), intent(in) :: map
      integer, intent(in) :: half_edge, cell(:)
      integer, intent(out) :: first, last        !! of the chain
      real(wp), intent(out) :: length            !! [L]
      logical, intent(out) :: one_chain
      integer :: h, neighbour, n, n_chain
      first = half_edge
      last = half_edge
      length = 0
      one_chain = .false.
      if (map%twin(half_edge) == 0) return
      neighbour = cell(map%twin(half_edge))
      if (neighbour == cell(half_edge)) return
      ! back to the beginning of the chain, then along it
      do while (follows(map%previous(first), first))
         first = map%previous(first)
         if (first == half_edge) return
      end do
      last = first
      n_chain = 1
      length = edge_length(last)
      do while (follows(last, map%next(last)))
         last = map%next(last)
         n_chain = n_chain + 1
         length = length + edge_length(last)
      end do
      n = 0
      h = half_edge
      do
         if (map%twin(h) > 0) then
            if (cell(map%twin(h)) == neighbour) n = n + 1
         end if
         h = map%next(h)
         if (h == half_edge) exit
      end do
      one_chain = n == n_chain .and. map%next(last) /= first .and. map%next(map%twin(first)) /= map%twin(last)

   contains

      !> Is b a continuation of a in both cells?
      pure logical function follows(a, b)
         integer, intent(in) :: a, b             !! half-edges of this cell; b is the next of a
         follows = .false.
         if (map%twin(a) == 0 .or. map%twin(b) == 0) return
         follows = cell(map%twin(a)) == neighbour .and. map%next(map%twin(b)) == map%twin(a)
      end function follows

      !> Length of an edge.
      pure real(wp) function edge_length(a)
         integer, intent(in) :: a
         edge_length = norm2(map%position(:, map%target(a)) - map%position(:, map%origin(a)))
      end function edge_length

   end subroutine shared_chain

   !> Outline of the two cells on both sides of a chain.
   pure function united_outline(map, first, last) result(outline)
      type(cell_map_type), intent(in) :: map
      integer, intent(in) :: first, last         !! half-edges
      real(wp), allocatable :: outline(:, :)     !! (2, n)
      integer, allocatable :: mine(:), other(:), nodes(:)
      integer :: n_chain, h
      n_chain = 1
      h = first
      do while (h /= last)
         h = map%next(h)
         n_chain = n_chain + 1
      end do
      allocate (mine, source=map%loop_of(map%next(last)))
      allocate (other, source=map%loop_of(map%next(map%twin(first))))
      ! from the end of the chain to its beginning, and back
      allocate (nodes, source=[mine(:size(mine) - n_chain), other(:size(other) - n_chain)])
      allocate (outline, source=map%position(:, nodes))
   end function united_outline

   !> Take nodes out of straight edges: those that no line ends on any more.
   pure subroutine drop_straight_nodes(map)
      type(cell_map_type), intent(inout) :: map
      integer, allocatable :: degree(:)
      real(wp) :: a(2), b(2)
      integer :: h, before, other
      allocate (degree(map%n_nodes), source=0)
      do h = 1, map%n
         if (.not. map%alive(h)) cycle
         degree(map%origin(h)) = degree(map%origin(h)) + 1
         if (map%twin(h) == 0) degree(map%target(h)) = degree(map%target(h)) + 1
      end do
      do h = 1, map%n
         if (.not. map%alive(h)) cycle
         if (map%is_corner(map%origin(h)) .or. degree(map%origin(h)) /= 2) cycle
         before = map%previous(h)
         other = map%twin(h)
         if (map%joint(before) /= map%joint(h) .or. (map%twin(before) > 0 .neqv. other > 0)) cycle
         if (other > 0) then
            if (map%next(other) /= map%twin(before)) cycle
         end if
         a = map%position(:, map%origin(h)) - map%position(:, map%origin(before))
         b = map%position(:, map%target(h)) - map%position(:, map%origin(h))
         ! on the outline such a node lies on a straight edge, even where rounding bends a short part
         if (other > 0 .and. abs(cross_product(a, b)) > straight*norm2(a)*norm2(b)) cycle
         call map%drop_node(h)
      end do
   end subroutine drop_straight_nodes

   !> Is a polygon convex? Straight corners are allowed.
   pure logical function is_convex(outline)
      real(wp), intent(in) :: outline(:, :)      !! (2, n) counter-clockwise
      real(wp) :: a(2), b(2), rounding
      integer :: k, n
      n = size(outline, 2)
      rounding = 8*epsilon(1.0_wp)*maxval(abs(outline))
      is_convex = .true.
      do k = 1, n
         a = outline(:, 1 + mod(k, n)) - outline(:, k)
         b = outline(:, 1 + mod(k + 1, n)) - outline(:, 1 + mod(k, n))
         is_convex = is_convex .and. &
                     cross_product(a, b) >= -straight*norm2(a)*norm2(b) - rounding*(norm2(a) + norm2(b))
         if (cross_product(a, b) <= 0) is_convex = is_convex .and. dot_product(a, b) >= 0
      end do
   end function is_convex

end module rockdda_cutting_cell_merging
