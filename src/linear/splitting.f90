! SPDX-License-Identifier: MIT
!> The matrix prepared for preconditioned conjugate gradients, in single precision.
!>
!> With K = D + L + L^T (block diagonal, couplings below and above it) and pivots D~ = G G^T the preconditioner is
!>
!>     M = (D~ + L) D~^-1 (D~ + L)^T
!>
!> Everything is scaled by G, block by block, so that the pivots become the identity and only the scaled
!> couplings and the remainder of the diagonal are kept (^ marks scaled blocks):
!>
!>     G^-1 K G^-T = (I + L^) + (I + L^)^T + N^,    N^ = G^-1 D G^-T - 2 I
!>
!> - ssor:   D~ = D
!> - ic0:    D~_i = D_i - sum_{j<i} K_ij D~_j^-1 K_ij^T, the pivots of an incomplete Cholesky factorisation
!>           that keeps the couplings as they are; a pivot that is not well positive is replaced by D_i
!> - jacobi: D~ = D, and the couplings belong to N^ instead of L^
!>
!> For threads the blocks are ordered in groups, the number of which depends on the size of the model alone:
!> parts of the graph that do not touch each other (phase 1), the separators between them (phase 2), and what
!> of the separators touches another separator (phase 3, mostly empty). The groups of a phase are independent,
!> and no coupling is dropped. Couplings inside a group are stored once, above the diagonal; those between
!> groups in both rows, so that no two groups write to the same place.
!>
!> Single precision is enough because the solver corrects with residuals in working precision.
module rockdda_linear_splitting
   use, intrinsic :: iso_fortran_env, only : real32
   use rockdda_base_kinds, only : wp, i8
   use rockdda_linear_matrix, only : block_matrix_type
   use rockdda_linear_graph, only : graph_type, reverse_cuthill_mckee
   use rockdda_linear_small_blocks, only : factorize_block, invert_lower
   implicit none
   private
   public :: splitting_type, sp

   !> Precision of the preconditioned iteration.
   integer, parameter :: sp = real32
   !> Blocks in a part, about, and the largest number of parts.
   integer, parameter :: part_size = 1250
   integer, parameter :: max_parts = 32

   type :: splitting_type
      integer :: n = 0
      integer :: n_groups = 0
      integer, allocatable :: group(:)         !! (n_groups + 1) blocks group(g) : group(g+1)-1 in the new order
      integer :: phase(4) = 1                  !! groups phase(f) : phase(f+1)-1 belong to phase f
      integer, allocatable :: order(:)         !! (n) old number of the block in place i
      integer, allocatable :: upper_start(:)   !! (n + 1) couplings inside groups, above the diagonal
      integer, allocatable :: upper_column(:)
      integer, allocatable :: upper_place(:)   !! place in the matrix, negative: transposed
      integer, allocatable :: other_start(:)   !! (n + 1) couplings between groups, both directions
      integer, allocatable :: other_after(:)   !! (n) first of those with a group of a later phase
      integer, allocatable :: other_column(:)
      integer, allocatable :: other_place(:)   !! place in the matrix, negative: transposed
      real(sp), allocatable :: upper(:, :, :)  !! (6, 6, couplings) scaled
      real(sp), allocatable :: other(:, :, :)  !! (6, 6, couplings) scaled
      real(sp), allocatable :: rest(:, :, :)   !! (6, 6, n) G^-1 D G^-T - 2 I
      real(wp), allocatable :: scale(:, :, :)  !! (6, 6, n) G^-1, lower triangle
      integer :: replaced_pivots = 0           !! pivots of ic0 that were not well positive
      logical :: has_sweeps = .true.           !! false for jacobi
      logical, private :: modify_pivots = .true.
   contains
      procedure :: choose
      procedure :: set_pattern
      procedure :: set_values
   end type splitting_type

contains

   !> Choose the preconditioner; `known` is false for a name that does not exist.
   subroutine choose(self, preconditioner, known)
      class(splitting_type), intent(inout) :: self
      character(len=*), intent(in) :: preconditioner   !! '[block_]jacobi', 'ssor' or '[block_]ic0'
      logical, intent(out) :: known
      known = .true.
      select case (preconditioner)
      case ('jacobi', 'block_jacobi')
         self%has_sweeps = .false.
         self%modify_pivots = .false.
      case ('ssor')
         self%has_sweeps = .true.
         self%modify_pivots = .false.
      case ('ic0', 'block_ic0')
         self%has_sweeps = .true.
         self%modify_pivots = .true.
      case default
         known = .false.
      end select
   end subroutine choose

   !> Order the blocks of a new graph and lay out the couplings.
   subroutine set_pattern(self, graph)
      class(splitting_type), intent(inout) :: self
      type(graph_type), intent(in) :: graph
      integer, allocatable :: new_number(:), owner(:)
      integer :: n, i, j, k, n_upper, n_other, pass, from

      n = graph%n
      self%n = n
      if (allocated(self%group)) deallocate (self%group, self%order, self%upper_start, self%other_start, &
         self%other_after, self%upper_column, self%upper_place, self%other_column, self%other_place, self%upper, &
         self%other, self%rest, self%scale)
      allocate (self%order(n), self%upper_start(n + 1), self%other_start(n + 1), self%other_after(n))
      allocate (new_number(n), owner(n), self%rest(6, 6, n), self%scale(6, 6, n))
      call make_groups(self, graph)
      do k = 1, self%n_groups
         do i = self%group(k), self%group(k + 1) - 1
            new_number(self%order(i)) = i
            owner(i) = merge(k, -i, self%has_sweeps)
         end do
      end do

      ! first count, then fill
      do pass = 1, 2
         n_upper = 0
         n_other = 0
         do i = 1, n
            self%upper_start(i) = n_upper + 1
            self%other_start(i) = n_other + 1
            do k = graph%start(self%order(i)), graph%start(self%order(i) + 1) - 1
               j = new_number(graph%neighbour(k))
               from = merge(graph%place(k), -graph%place(k), graph%neighbour(k) > self%order(i))
               if (owner(j) /= owner(i)) then
                  n_other = n_other + 1
                  if (pass == 2) call insert(j, from, self%other_start(i), n_other, self%other_column, self%other_place)
               else if (j > i) then
                  n_upper = n_upper + 1
                  if (pass == 2) call insert(j, from, self%upper_start(i), n_upper, self%upper_column, self%upper_place)
               end if
            end do
            if (pass == 2) self%other_after(i) = self%other_start(i) + &
               count(self%other_column(self%other_start(i):n_other) < i)
         end do
         self%upper_start(n + 1) = n_upper + 1
         self%other_start(n + 1) = n_other + 1
         if (pass == 1) allocate (self%upper_column(n_upper), self%upper_place(n_upper), self%upper(6, 6, n_upper), &
                                  self%other_column(n_other), self%other_place(n_other), self%other(6, 6, n_other))
      end do

   contains

      !> Put a coupling into its row, columns ascending.
      pure subroutine insert(to, place, first, last, columns, places)
         integer, intent(in) :: to, place           !! column in the new order, place in the matrix
         integer, intent(in) :: first, last         !! the row so far; last is free
         integer, intent(inout) :: columns(:), places(:)
         integer :: m
         do m = last, first + 1, -1
            if (columns(m - 1) < to) exit
            columns(m) = columns(m - 1)
            places(m) = places(m - 1)
         end do
         columns(m) = to
         places(m) = place
      end subroutine insert

   end subroutine set_pattern

   !> Cut the graph into parts along an order that keeps neighbours close; the first blocks of each part, those
   !> that touch an earlier part, become the separator.
   subroutine make_groups(self, graph)
      class(splitting_type), intent(inout) :: self
      type(graph_type), intent(in) :: graph
      integer, allocatable :: order(:), part(:), phase(:)
      integer :: n_parts, i, k, p, f, at, block

      n_parts = max(1, min(max_parts, graph%n/part_size))
      allocate (order(graph%n), part(graph%n), phase(graph%n))
      call reverse_cuthill_mckee(graph, order)
      do i = 1, graph%n
         part(order(i)) = 1 + int(int(i - 1, i8)*n_parts/graph%n)
      end do
      phase = 1
      do i = 1, merge(graph%n, 0, self%has_sweeps)
         do k = graph%start(i), graph%start(i + 1) - 1
            if (part(graph%neighbour(k)) < part(i)) phase(i) = 2
         end do
      end do
      do i = 1, graph%n
         if (phase(i) == 1) cycle
         do k = graph%start(i), graph%start(i + 1) - 1
            if (phase(graph%neighbour(k)) > 1 .and. part(graph%neighbour(k)) < part(i)) phase(i) = 3
         end do
      end do

      self%n_groups = 2*n_parts + 1
      allocate (self%group(self%n_groups + 1))
      self%phase = [1, n_parts + 1, 2*n_parts + 1, 2*n_parts + 2]
      ! a part at a time: `order` runs through the parts one after the other
      at = 0
      do f = 1, 2
         p = 0
         do i = 1, graph%n
            block = order(i)
            do while (p < part(block))
               p = p + 1
               self%group((f - 1)*n_parts + p) = at + 1
            end do
            if (phase(block) /= f) cycle
            at = at + 1
            self%order(at) = block
         end do
         do while (p < n_parts)
            p = p + 1
            self%group((f - 1)*n_parts + p) = at + 1
         end do
      end do
      self%group(2*n_parts + 1) = at + 1
      do i = 1, graph%n
         if (phase(order(i)) /= 3) cycle
         at = at + 1
         self%order(at) = order(i)
      end do
      self%group(2*n_parts + 2) = at + 1
   end subroutine make_groups

   !> Factorise the pivots and scale the couplings. The diagonal blocks have to be positive definite.
   subroutine set_values(self, matrix)
      class(splitting_type), intent(inout) :: self
      type(block_matrix_type), intent(in) :: matrix
      integer :: f, g, i, k, replaced
      real(wp) :: a(6, 6)

      replaced = 0
      !$omp parallel if(self%n > part_size) default(none) shared(self, matrix, replaced) private(f, g, i, k, a)
      do f = 1, 3
         !$omp do schedule(static) reduction(+:replaced)
         do g = self%phase(f), self%phase(f + 1) - 1
            call factorize_group(self, matrix, g, replaced)
         end do
         !$omp end do
      end do
      !$omp do schedule(static)
      do i = 1, self%n
         do k = self%upper_start(i), self%upper_start(i + 1) - 1
            ! G_i^-1 K_ij is there already
            a = self%upper(:, :, k)
            call times_transposed(a, self%scale(:, :, self%upper_column(k)))
            self%upper(:, :, k) = real(a, sp)
         end do
         do k = self%other_start(i), self%other_start(i + 1) - 1
            call take(matrix, self%other_place(k), a)
            call scale_rows(self%scale(:, :, i), a)
            call times_transposed(a, self%scale(:, :, self%other_column(k)))
            self%other(:, :, k) = real(a, sp)
         end do
      end do
      !$omp end do
      !$omp end parallel
      self%replaced_pivots = replaced
   end subroutine set_values

   !> Pivots of one group; leaves G_i^-1 K_ij in `upper`.
   subroutine factorize_group(self, matrix, g, replaced)
      class(splitting_type), intent(inout) :: self
      type(block_matrix_type), intent(in) :: matrix
      integer, intent(in) :: g                !! group
      integer, intent(inout) :: replaced      !! counts pivots replaced
      real(wp) :: a(6, 6), d(6, 6), l(6, 6)
      logical :: ok
      integer :: i, k, c
      do i = self%group(g), self%group(g + 1) - 1
         self%scale(:, :, i) = matrix%values(:, :, matrix%row_start(self%order(i)))
      end do
      do i = self%group(g), self%group(g + 1) - 1
         if (self%modify_pivots) then
            do k = self%other_start(i), self%other_after(i) - 1
               call take(matrix, -self%other_place(k), a)
               call scale_rows(self%scale(:, :, self%other_column(k)), a)
               call subtract_square(a, self%scale(:, :, i))
            end do
         end if
         d = matrix%values(:, :, matrix%row_start(self%order(i)))
         call factorize_block(self%scale(:, :, i), l, ok)
         if (ok .and. self%modify_pivots) then
            do c = 1, 6
               ok = ok .and. l(c, c)**2*d(c, c) < 1.0e4_wp
            end do
         end if
         if (.not. ok) then
            replaced = replaced + 1
            call factorize_block(d, l, ok)
         end if
         call invert_lower(l, self%scale(:, :, i))
         call scale_rows(self%scale(:, :, i), d)
         call times_transposed(d, self%scale(:, :, i))
         do c = 1, 6
            d(c, c) = d(c, c) - 2
         end do
         self%rest(:, :, i) = real(d, sp)
         do k = self%upper_start(i), self%upper_start(i + 1) - 1
            call take(matrix, self%upper_place(k), a)
            call scale_rows(self%scale(:, :, i), a)
            self%upper(:, :, k) = real(a, sp)
            if (self%modify_pivots) call subtract_square(a, self%scale(:, :, self%upper_column(k)))
         end do
      end do
   end subroutine factorize_group

   !> The block in a place of the matrix, transposed when the place is negative.
   pure subroutine take(matrix, place, a)
      type(block_matrix_type), intent(in) :: matrix
      integer, intent(in) :: place
      real(wp), intent(out) :: a(6, 6)
      if (place > 0) then
         a = matrix%values(:, :, place)
      else
         a = transpose(matrix%values(:, :, -place))
      end if
   end subroutine take

   !> a := S a.
   pure subroutine scale_rows(s, a)
      real(wp), intent(in) :: s(6, 6)
      real(wp), intent(inout) :: a(6, 6)
      real(wp) :: b(6)
      integer :: j
      do j = 1, 6
         b = a(:, j)
         a(:, j) = (s(:, 1)*b(1) + s(:, 2)*b(2)) + (s(:, 3)*b(3) + s(:, 4)*b(4)) + (s(:, 5)*b(5) + s(:, 6)*b(6))
      end do
   end subroutine scale_rows

   !> a := a S^T with S lower triangular.
   pure subroutine times_transposed(a, s)
      real(wp), intent(inout) :: a(6, 6)
      real(wp), intent(in) :: s(6, 6)
      a(:, 6) = (a(:, 1)*s(6, 1) + a(:, 2)*s(6, 2)) + (a(:, 3)*s(6, 3) + a(:, 4)*s(6, 4)) &
         + (a(:, 5)*s(6, 5) + a(:, 6)*s(6, 6))
      a(:, 5) = (a(:, 1)*s(5, 1) + a(:, 2)*s(5, 2)) + (a(:, 3)*s(5, 3) + a(:, 4)*s(5, 4)) + a(:, 5)*s(5, 5)
      a(:, 4) = (a(:, 1)*s(4, 1) + a(:, 2)*s(4, 2)) + (a(:, 3)*s(4, 3) + a(:, 4)*s(4, 4))
      a(:, 3) = (a(:, 1)*s(3, 1) + a(:, 2)*s(3, 2)) + a(:, 3)*s(3, 3)
      a(:, 2) = a(:, 1)*s(2, 1) + a(:, 2)*s(2, 2)
      a(:, 1) = a(:, 1)*s(1, 1)
   end subroutine times_transposed

   !> d := d - a^T a.
   pure subroutine subtract_square(a, d)
      real(wp), intent(in) :: a(6, 6)
      real(wp), intent(inout) :: d(6, 6)
      real(wp) :: b(6, 6)
      integer :: j
      b = transpose(a)
      do j = 1, 6
         d(:, j) = d(:, j) - ((b(:, 1)*a(1, j) + b(:, 2)*a(2, j)) + (b(:, 3)*a(3, j) + b(:, 4)*a(4, j)) &
                              + (b(:, 5)*a(5, j) + b(:, 6)*a(6, j)))
      end do
   end subroutine subtract_square

end module rockdda_linear_splitting
