! SPDX-License-Identifier: MIT
!> Gap and slip of the rows of a contact table: their derivatives, and their values and places at the end of a step.
!>
!> A row stands at a vertex of block a on an edge of block b (share 0), at a vertex of block b on an edge of block a
!> (share 1), or half-way between two edges or corners (share 1/2). Seen from the other block gap and slip are the same,
!> with the normal reversed; between edges the mean of both views is taken.
!>
!> Source: Shi's contact submatrices (thesis Eqs. 3.14-3.21), written with vectors: a length x between two
!> blocks changes by e.d_a + g.d_b in a step, to first order. A spring of stiffness k along it then gives
!> k e e^T, k e g^T, k g g^T and the loads -k x e, -k x g; a force f the loads f e, f g; a dashpot (Voigt) c/dt in
!> place of k and no load (rockdda_interaction_equations).
!> Unknowns per block: d = (u0, v0, r0, ex, ey, gxy) [length, length, rad, -, -, -].
!> Sign: gap > 0 is open. The edge of block b runs counter-clockwise, from s to q, its outward normal is
!> n = (ty, -tx) with t = (q - s)/|q - s|.
module rockdda_interaction_contact_lengths
   use, intrinsic :: iso_c_binding, only : c_int, c_double, c_signed_char
   use rockdda_base_kinds, only : wp
   use rockdda_base_parallel, only : parallel_contacts, piece, n_pieces
   use rockdda_contact_table, only : contact_table_type, contact_state
   use rockdda_interaction_attempt, only : attempt_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_equations, only : equations_type
   use rockdda_interaction_finite_rotation, only : moving_block_type, moved_block_type
   use rockdda_interaction_open_close, only : open_close_type
   implicit none
   private
   public :: place_contacts, measure_lengths, place_rows, find_lengths, move_contacts

   !> Lengths that differ by this number of roundings of their coordinates are not wrong: a stiff tie on
   !> which little acts would never be right.
   real(wp), parameter :: roundings = 16.0_wp

   interface
      !> Derivatives of gap (1) and slip (2) of some rows over the step, for the expected motion of their blocks, packed
      !> (rockdda_interaction_link_vectors): in contact_kernels_shim.c.
      !>
      !> Of a vertex p of block a and an edge of block b, with what the blocks turn by in the step left aside:
      !>
      !> Normal: the gap is (p - s).n, s any point of the edge. Its exact first derivative, the turning of the edge
      !> included, is n.(motion of p with block a - motion of the foot p - gap n with block b), which is Eq. 3.14 over
      !> the length.
      !> Tangential: the slip is t.(motion of p with block a - motion of p with block b), both at the one point p, so
      !> that the couple of the two shear forces is zero. A rigid motion of both blocks together changes neither, to
      !> first order.
      pure subroutine place_rows(n, rows, block_a, block_b, point, distance, normal, share, lean, moving, vectors) &
         bind(c, name='rockdda_place_contacts')
         import :: c_int, c_double, moving_block_type
         integer(c_int), value :: n
         integer(c_int), intent(in) :: rows(*)                 !! (n)
         integer(c_int), intent(in) :: block_a(*), block_b(*)  !! of all rows, as what follows
         real(c_double), intent(in) :: point(2, *), distance(*), normal(2, *), share(*)
         real(c_double), intent(in) :: lean(3, *)              !! where the slip is: from the point, and the gap there
         type(moving_block_type), intent(in) :: moving(*)      !! all blocks
         real(c_double), intent(inout) :: vectors(18, *)       !! of all rows
      end subroutine place_rows

      !> Distance (1) of the blocks at some rows, and slip (2), at the end of a step [length].
      pure subroutine find_lengths(n, rows, block_a, block_b, point, distance, normal, share, lean, moved, lengths) &
         bind(c, name='rockdda_contact_lengths')
         import :: c_int, c_double, moved_block_type
         integer(c_int), value :: n
         integer(c_int), intent(in) :: rows(*)                 !! (n)
         integer(c_int), intent(in) :: block_a(*), block_b(*)  !! of all rows, as what follows
         real(c_double), intent(in) :: point(2, *), distance(*), normal(2, *), share(*), lean(3, *)
         type(moved_block_type), intent(in) :: moved(*)        !! all blocks
         real(c_double), intent(inout) :: lengths(2, *)        !! (2, n)
      end subroutine find_lengths

      !> Distances and points of rows at the end of a step. A point between two edges stays half-way between the two
      !> points of the blocks that it stood between.
      pure subroutine move_rows(first, last, block_a, block_b, station, normal, share, gap_before, gap, moved, &
                                distance, point) bind(c, name='rockdda_move_contacts')
         import :: c_int, c_double, c_signed_char, moved_block_type
         integer(c_int), value :: first, last
         integer(c_int), intent(in) :: block_a(*), block_b(*)  !! of all rows, as what follows
         integer(c_signed_char), intent(in) :: station(*)
         real(c_double), intent(in) :: normal(2, *), share(*)
         real(c_double), intent(in) :: gap_before(*), gap(*)   !! of the springs, at the start and the end of the step
         type(moved_block_type), intent(in) :: moved(*)        !! all blocks
         real(c_double), intent(inout) :: distance(*), point(2, *)
      end subroutine move_rows
   end interface

contains

   !> Vectors of the links of all rows between blocks for which the expected motion is new.
   subroutine place_contacts(table, lean, first_link, attempt, equations)
      type(contact_table_type), intent(in) :: table
      !> (3, >= rows) Where the slip is: from the point, and the gap there [length].
      real(wp), intent(in), contiguous :: lean(:, :)
      integer, intent(in) :: first_link                  !! row c is the link first_link + c
      type(attempt_type), intent(in) :: attempt
      type(equations_type), intent(inout) :: equations
      integer :: rows(piece)
      integer :: c, n, p
      !$omp parallel do default(none) shared(table, lean, first_link, attempt, equations) private(c, n, p, rows) &
      !$omp schedule(static) if (table%n > parallel_contacts)
      do p = 1, n_pieces(table%n)
         n = 0
         do c = (p - 1)*piece + 1, min(p*piece, table%n)
            if (.not. (attempt%renewed(table%block_a(c)) .or. attempt%renewed(table%block_b(c)))) cycle
            n = n + 1
            rows(n) = c
         end do
         call place_rows(n, rows, table%block_a, table%block_b, table%point, table%distance, table%normal, &
                         table%share, lean, attempt%moving, equations%vectors(:, first_link + 1:first_link + table%n))
      end do
      !$omp end parallel do
   end subroutine place_contacts

   !> Gaps of closed contacts, and slips of locked ones, that the expected motion gives otherwise than the solution.
   subroutine measure_lengths(table, lean, trial, first_link, context, attempt, was_judged, mixed_only, equations)
      type(contact_table_type), intent(in) :: table
      !> (3, >= rows) Where the slip is: from the point, and the gap there [length].
      real(wp), intent(in), contiguous :: lean(:, :)
      type(open_close_type), intent(in) :: trial
      integer, intent(in) :: first_link                  !! row c is the link first_link + c
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      logical, intent(in) :: was_judged                  !! states are those of a judgement, not of the last solve
      logical, intent(in) :: mixed_only                  !! only contacts of which one block alone is renewed
      type(equations_type), intent(inout) :: equations
      integer :: p
      !$omp parallel do default(none) private(p) schedule(static) &
      !$omp shared(table, lean, trial, first_link, context, attempt, was_judged, mixed_only, equations) &
      !$omp if (table%n > parallel_contacts)
      do p = 1, n_pieces(table%n)
         call measure_rows((p - 1)*piece + 1, min(p*piece, table%n), table, lean, trial, first_link, context, attempt, &
                           was_judged, mixed_only, equations)
      end do
      !$omp end parallel do
   end subroutine measure_lengths

   !> `measure_lengths` of some of the rows.
   pure subroutine measure_rows(first, last, table, lean, trial, first_link, context, attempt, was_judged, mixed_only, &
                                equations)
      integer, intent(in) :: first, last                 !! at most a piece
      type(contact_table_type), intent(in) :: table
      real(wp), intent(in), contiguous :: lean(:, :)
      type(open_close_type), intent(in) :: trial
      integer, intent(in) :: first_link
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      logical, intent(in) :: was_judged                  !! states are those of a judgement, not of the last solve
      logical, intent(in) :: mixed_only                  !! only contacts of which one block alone is renewed
      type(equations_type), intent(inout) :: equations
      real(wp) :: lengths(2, piece), off(2), force, scale
      integer :: rows(piece), a, b, c, k, n
      logical :: acts_at_end
      acts_at_end = .not. (any(abs(trial%level - 1) > 0) .or. allocated(trial%extra))
      n = 0
      do c = first, last
         ! most blocks do not turn, and nothing else of the contact is read
         if (.not. (attempt%is_turning(table%block_a(c)) .or. attempt%is_turning(table%block_b(c)))) cycle
         if (state_of(c) == contact_state%open) cycle
         if (mixed_only) then
            if (attempt%renewed(table%block_a(c)) .eqv. attempt%renewed(table%block_b(c))) cycle
         end if
         n = n + 1
         rows(n) = c
      end do
      call find_lengths(n, rows, table%block_a, table%block_b, table%point, table%distance, table%normal, table%share, &
                        lean, attempt%moved, lengths)
      do k = 1, n
         c = rows(k)
         a = table%block_a(c)
         b = table%block_b(c)
         if (acts_at_end) then
            off(1) = lengths(1, k) - (trial%gap(c) + (table%distance(c) - table%gap(c)))
            off(2) = lengths(2, k) - trial%slip(c)
         else
            off = lengths(:, k) - [trial%gap_at_end(table, c) + (table%distance(c) - table%gap(c)), &
                                   trial%slip(c)/trial%level(trial%start(c))]
         end if
         where (abs(off) <= roundings*epsilon(1.0_wp)*max(maxval(abs(table%point(:, c))), &
                                                          maxval(abs(context%state%centroid(:, a))), &
                                                          maxval(abs(context%state%centroid(:, b))))) off = 0
         force = table%k_n(c)*abs(off(1))
         if (trial%joint(c)%partly .and. abs(trial%push(c)) > 0) force = trial%own(c)*abs(off(1))
         if (state_of(c) == contact_state%locked) force = max(force, table%k_s(c)*abs(off(2)))
         scale = max(table%k_n(c)*abs(trial%gap(c)), &
                     min(equations%block_force(a), equations%block_force(b)))
         if (scale > 0) equations%link_off(first_link + c) = force/scale
      end do

   contains

      !> State in the last solve.
      pure integer function state_of(c)
         integer, intent(in) :: c
         state_of = merge(trial%state_used(c), trial%joint(c)%state, was_judged)
      end function state_of

   end subroutine measure_rows

   !> Distances and points of all rows at the end of a step.
   subroutine move_contacts(gap, moved, table)
      real(wp), intent(in), contiguous :: gap(:)       !! (>= n) of the springs at the end of the step [length]
      type(moved_block_type), intent(in), contiguous :: moved(:)   !! (nb) with the motion of the step
      type(contact_table_type), intent(inout) :: table
      integer :: p
      !$omp parallel do default(none) shared(gap, moved, table) private(p) schedule(static) &
      !$omp if (table%n > parallel_contacts)
      do p = 1, n_pieces(table%n)
         call move_rows((p - 1)*piece + 1, min(p*piece, table%n), table%block_a, table%block_b, table%station, &
                        table%normal, table%share, table%gap, gap, moved, table%distance, table%point)
      end do
      !$omp end parallel do
   end subroutine move_contacts

end module rockdda_interaction_contact_lengths
