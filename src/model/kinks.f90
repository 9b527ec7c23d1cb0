! SPDX-License-Identifier: MIT
!> Tips that begin in a kink of another block's outline, with contact by length.
!>
!>          \    3    |             Block 3 lies along one side of the kink of block 1 and slides down on it. Its tip
!>           \        |    2        meets the other side at a point, under block 2. Between rigid blocks the tip would
!>        1   \       |_______      hold it there; rock of no width bears nothing and crushes. The tip is let into that
!>             \______/ 1           side by `crushed` of its shorter edge before it bears.
!>            kink
module rockdda_model_kinks
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_base_strings, only : to_string, counted
   use rockdda_model_blocks, only : block_system_type
   implicit none
   private
   public :: edges_met_by_tips, report_tips, crushed

   !> Share of the shorter edge at a tip by which it is crushed. Factors of safety are judged within 0.4 % of the size
   !> of a block; a tip cut by 0.3 % gives that of slip on both planes.
   real(wp), parameter :: crushed = 0.01_wp
   !> A tip is in a kink when it is nearer than this share of its shorter edge.
   real(wp), parameter :: near = 1.0e-3_wp
   !> Cosine and sine of the angle between directions that are one, 3 degrees.
   real(wp), parameter :: same = 0.99863_wp, turned = 0.0523_wp

contains

   !> The edge of another block that each vertex meets as a tip in a kink, 0 none: the end of that edge is the kink, and
   !> the vertex has an edge along the kink's other side.
   pure function edges_met_by_tips(blocks) result(met)
      type(block_system_type), intent(in) :: blocks
      integer, allocatable :: met(:)             !! (nv) first vertex of the edge
      real(wp), allocatable :: along(:, :), length(:)
      integer, allocatable :: before(:), owner(:)
      integer :: i, k, v, first, last
      allocate (met(blocks%n_vertices()), before(blocks%n_vertices()), owner(blocks%n_vertices()), source=0)
      allocate (along(2, size(met)), length(size(met)))
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
      do k = 1, size(met)
         if (.not. is_concave(k)) cycle
         do v = 1, size(met)
            if (owner(v) == owner(k)) cycle
            if (norm2(blocks%vertices(:, v) - blocks%vertices(:, k)) > near*min(length(v), length(before(v)))) cycle
            if (is_concave(v)) cycle
            ! what runs the other way lies along
            if (faces(before(v), k) .and. .not. faces(v, before(k))) met(v) = before(k)
            if (faces(v, before(k)) .and. .not. faces(before(v), k)) met(v) = k
         end do
      end do

   contains

      !> Does the outline of a block turn inwards at a vertex?
      pure logical function is_concave(k)
         integer, intent(in) :: k
         associate (into => along(:, before(k)), out => along(:, k))
            is_concave = into(1)*out(2) - into(2)*out(1) < -turned
         end associate
         if (blocks%edge_joint(k) <= 0 .or. blocks%edge_joint(before(k)) <= 0) is_concave = .false.
      end function is_concave

      !> Do two edges run in opposite directions?
      pure logical function faces(f, e)
         integer, intent(in) :: f, e
         faces = dot_product(along(:, f), along(:, e)) <= -same
      end function faces

   end function edges_met_by_tips

   !> A note on the tips in kinks.
   subroutine report_tips(blocks, messages)
      type(block_system_type), intent(in) :: blocks
      type(diagnostics_type), intent(inout) :: messages
      integer, allocatable :: met(:), tips(:)
      character(len=:), allocatable :: text
      integer :: k
      met = edges_met_by_tips(blocks)
      tips = pack([(k, k=1, size(met))], met > 0)
      if (size(tips) == 0) return
      associate (v => tips(1))
         text = 'the tip of block '//to_string(owner_of(v))//' at ('//to_string(blocks%vertices(1, v), 5)//', '// &
                to_string(blocks%vertices(2, v), 5)//')'
         if (size(tips) > 1) text = text//', and '//counted(size(tips) - 1, 'more tip')//','
         call messages%add(severity%note, text//' begins in a kink of block '//to_string(owner_of(met(v)))// &
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
