! SPDX-License-Identifier: MIT
!> Tips that begin in a kink of the rock below, of one block or between several, with contact by length.
!>
!>          \    3    |             Block 3 lies along one side of the kink and slides down on it. Its tip meets the
!>           \        |    2        other side at a point, under block 2. Between rigid blocks the tip would hold it
!>        1   \       |_______      there; rock of no width bears nothing and crushes. The tip is let into that side
!>             \______/ 1           by `crushed` of its shorter edge before it bears.
!>            kink
module rockdda_model_kinks
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_base_sorting, only : sorted_order
   use rockdda_base_strings, only : to_string, counted
   use rockdda_model_blocks, only : block_system_type
   implicit none
   private
   public :: kinks_type, find_kinks, report_tips, crushed

   !> Share of the shorter edge at a tip by which it is crushed. Factors of safety are judged within 0.4 % of the size
   !> of a block; a tip cut by 0.3 % gives that of slip on both planes.
   real(wp), parameter :: crushed = 0.01_wp
   !> A tip is in a kink when it is nearer than this share of its shorter edge.
   real(wp), parameter :: near = 1.0e-3_wp
   !> Cosine and sine of the angle between directions that are one, 3 degrees.
   real(wp), parameter :: same = 0.99863_wp, turned = 0.0523_wp

   !> Vertices that lie in a kink at the start.
   type :: kinks_type
      integer, allocatable :: node(:)        !! (nv) the same number for those of one kink, 0 others
      integer, allocatable :: met(:)         !! (nv) first vertex of the edge that a tip meets, 0: no tip
      integer, allocatable :: beside(:, :)   !! (2, nv) edges along the two edges of a tip, 0 none
   end type kinks_type

contains

   !> Tips in kinks. Of the directions from a tip
   !>
   !>     a   of its edge that lies along an edge of some block,
   !>     b   of its other edge,
   !>     d   of the edge that it meets; the block of that edge is on the other side of d,
   !>
   !> b is between a and d, and from a to d the angle is less than 180 degrees: the block of d stops the tip.
   pure function find_kinks(blocks) result(kinks)
      type(block_system_type), intent(in) :: blocks
      type(kinks_type) :: kinks
      real(wp), allocatable :: along(:, :), length(:)
      integer, allocatable :: before(:), owner(:), order(:), place(:), beside(:)
      integer :: i, k, v, nv, first, last
      nv = blocks%n_vertices()
      allocate (kinks%node(nv), kinks%met(nv), kinks%beside(2, nv), before(nv), owner(nv), source=0)
      allocate (along(2, nv), length(nv), place(nv))
      do i = 1, blocks%n_blocks
         first = blocks%vertex_offset(i) + 1
         last = blocks%vertex_offset(i + 1)
         do k = first, last
            owner(k) = i
            before(k) = merge(last, k - 1, k == first)
            along(:, k) = blocks%vertices(:, merge(first, k + 1, k == last)) - blocks%vertices(:, k)
            length(k) = norm2(along(:, k))
            along(:, k) = along(:, k)/max(length(k), tiny(1.0_wp))
         end do
      end do
      order = sorted_order(blocks%vertices(1, :))
      place(order) = [(k, k=1, size(order))]
      do v = 1, nv
         if (.not. (is_joint(v) .and. is_joint(before(v))) .or. turn(along(:, before(v)), along(:, v)) < turned) cycle
         beside = vertices_near(v, near*min(length(v), length(before(v))))
         if (size(beside) == 0) cycle
         kinks%beside(:, v) = [edge_along(v, before(beside)), edge_along(before(v), beside)]
         if (kinks%beside(1, v) > 0) kinks%met(v) = edge_ahead(along(:, v), -along(:, before(v)), 1, beside)
         if (kinks%beside(2, v) > 0 .and. kinks%met(v) == 0) &
            kinks%met(v) = edge_ahead(-along(:, before(v)), along(:, v), -1, beside)
         if (kinks%met(v) == 0) cycle
         beside = [v, beside]
         k = max(maxval(kinks%node(beside)), 0)
         kinks%node(beside) = merge(k, v, k > 0)
      end do

   contains

      !> Is an edge one of a joint, not a bridge to a hole?
      pure logical function is_joint(k)
         integer, intent(in) :: k
         is_joint = blocks%edge_joint(k) > 0
      end function is_joint

      !> Sine of the angle from one direction to another one, counter-clockwise.
      pure real(wp) function turn(from, to)
         real(wp), intent(in) :: from(2), to(2)
         turn = from(1)*to(2) - from(2)*to(1)
      end function turn

      !> Vertices of other blocks where vertex v is.
      pure function vertices_near(v, radius) result(list)
         integer, intent(in) :: v
         real(wp), intent(in) :: radius       !! [length]
         integer, allocatable :: list(:)
         integer :: low, high
         associate (x => blocks%vertices)
            low = place(v)
            do while (low > 1)
               if (x(1, order(low - 1)) < x(1, v) - radius) exit
               low = low - 1
            end do
            high = place(v)
            do while (high < size(order))
               if (x(1, order(high + 1)) > x(1, v) + radius) exit
               high = high + 1
            end do
            list = order(low:high)
            list = pack(list, hypot(x(1, list) - x(1, v), x(2, list) - x(2, v)) <= radius .and. owner(list) /= owner(v))
         end associate
      end function vertices_near

      !> The one of some edges that runs against an edge, 0 none.
      pure integer function edge_along(f, edges) result(e)
         integer, intent(in) :: f, edges(:)
         integer :: i
         do i = 1, size(edges)
            e = edges(i)
            if (is_joint(e) .and. dot_product(along(:, f), along(:, e)) <= -same) return
         end do
         e = 0
      end function edge_along

      !> The edge that a tip meets, 0 none: of several the nearest one to straight on.
      pure integer function edge_ahead(a, b, side, beside) result(met)
         real(wp), intent(in) :: a(2), b(2)
         integer, intent(in) :: side            !! 1: b is counter-clockwise of a, -1: clockwise
         integer, intent(in) :: beside(:)       !! vertices
         real(wp) :: d(2), straightest
         integer :: e, i
         met = 0
         straightest = huge(1.0_wp)
         do i = 1, size(beside)
            e = merge(beside(i), before(beside(i)), side > 0)
            d = side*along(:, e)
            if (.not. is_joint(e) .or. side*turn(a, d) <= 0 .or. side*turn(b, d) <= turned) cycle
            if (dot_product(a, d) <= -same .or. dot_product(a, d) >= straightest) cycle
            straightest = dot_product(a, d)
            met = e
         end do
      end function edge_ahead

   end function find_kinks

   !> A note on the tips in kinks.
   subroutine report_tips(blocks, messages)
      type(block_system_type), intent(in) :: blocks
      type(diagnostics_type), intent(inout) :: messages
      type(kinks_type) :: kinks
      integer, allocatable :: tips(:)
      character(len=:), allocatable :: text
      integer :: k
      kinks = find_kinks(blocks)
      tips = pack([(k, k=1, size(kinks%met))], kinks%met > 0)
      if (size(tips) == 0) return
      associate (v => tips(1))
         text = 'the tip of block '//to_string(owner_of(v))//' at ('//to_string(blocks%vertices(1, v), 5)//', '// &
                to_string(blocks%vertices(2, v), 5)//')'
         if (size(tips) > 1) text = text//', and '//counted(size(tips) - 1, 'more tip')//','
         call messages%add(severity%note, text//' begins in a kink above block '//to_string(owner_of(kinks%met(v)))// &
            ', and would hold there by a point: it crushes by '//to_string(100*crushed, 2)// &
               ' % of its shorter edge before it bears, so that blocks slide on both planes')
      end associate

   contains

      !> Block of a vertex.
      pure integer function owner_of(v)
         integer, intent(in) :: v
         owner_of = count(blocks%vertex_offset(2:) < v) + 1
      end function owner_of

   end subroutine report_tips

end module rockdda_model_kinks
