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
!> and no coupling is dropped.
!>
!> Couplings are stored once, row by row (`before`). The forward sweep gathers with them. The backward sweep hands each
!> row, once it is known, on to the earlier rows of its group, transposed. Couplings with rows of other groups are
!> stored a second time as transposes (`after`), with which rows gather: so no two groups ever write to the same place.
!>
!> Single precision is enough because the solver corrects with residuals in working precision.
module rockdda_linear_splitting
   use rockdda_base_kinds, only : wp, i8
   use rockdda_linear_matrix, only : block_matrix_type
   use rockdda_linear_graph, only : graph_type, reverse_cuthill_mckee
   use rockdda_linear_small_blocks, only : factorize_block, invert_lower
   use rockdda_linear_kernels, only : sp, lay_out, lay_out_transposed
   implicit none
   private
   public :: splitting_type

   !> Blocks in a part, about, and the largest number of parts.
   integer, parameter :: part_size = 1250
   integer, parameter :: max_parts = 32

   type :: splitting_type
      integer :: n = 0
      integer :: n_groups = 0
      integer, allocatable :: group(:)         !! (n_groups + 1) blocks group(g) : group(g+1)-1 in the new order
      integer :: phase(4) = 1                  !! groups phase(f) : phase(f+1)-1 belong to phase f
      integer, allocatable :: order(:)         !! (n) old number of the block in place i
      integer, allocatable :: before_start(:)  !! (n + 1) couplings with blocks of a lower place
      integer, allocatable :: before_column(:)
      integer, allocatable :: before_place(:)  !! place in the matrix, negative: transposed
      integer, allocatable :: own_start(:)     !! (n) the first of them with a block of the same group
      integer, allocatable :: twin(:)          !! the same coupling in `after`, 0 where there is none
      integer, allocatable :: after_start(:)   !! (0:n) couplings with blocks of later groups, see set_pattern
      integer, allocatable :: after_column(:)
      real(sp), allocatable :: before(:, :)    !! (36, couplings) scaled, laid out as in rockdda_linear_kernels
      real(sp), allocatable :: after(:, :)     !! (36, couplings) the transposes
      real(sp), allocatable :: rest(:, :)      !! (36, n) -N^ = 2 I - G^-1 D G^-T
      real(wp), allocatable :: scale(:, :, :)  !! (6, 6, n) G^-1, lower triangle
      integer :: most_before = 0               !! largest number of couplings before a block
      integer :: replaced_pivots = 0           !! pivots of ic0 that were not well positive
      logical, allocatable, private :: is_new(:)  !! (n) pivots that differ from those before, in the new order
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
   !>
   !> The backward sweep visits the last block first, and the rows of `after` lie in that order: row i has the places
   !> after_start(i) : after_start(i - 1) - 1. Without sweeps (jacobi) `after` holds all couplings.
   subroutine set_pattern(self, graph)
      class(splitting_type), intent(inout) :: self
      type(graph_type), intent(in) :: graph
      integer, allocatable :: new_number(:), next(:)
      integer :: n, n_couplings, n_after, g, i, j, k, m

      n = graph%n
      self%n = n
      if (allocated(self%group)) deallocate (self%group, self%order, self%before_start, self%own_start, &
         self%after_start, self%scale, self%before_column, self%before_place, self%twin, self%after_column, &
         self%before, self%after, self%rest, self%is_new)
      n_couplings = size(graph%neighbour)/2
      allocate (self%order(n), self%before_start(n + 1), self%own_start(n), self%after_start(0:n))
      allocate (new_number(n), next(n))
      allocate (self%before_column(n_couplings), self%before_place(n_couplings), self%twin(n_couplings), &
                self%before(36, n_couplings))
      allocate (self%rest(36, n), self%scale(6, 6, n), self%is_new(n))
      call make_groups(self, graph)
      do i = 1, n
         new_number(self%order(i)) = i
      end do

      self%before_start(1) = 1
      self%most_before = 0
      do i = 1, n
         m = 0
         do k = graph%start(self%order(i)), graph%start(self%order(i) + 1) - 1
            j = new_number(graph%neighbour(k))
            if (j > i) cycle
            m = m + 1
            call insert(j, merge(graph%place(k), -graph%place(k), graph%neighbour(k) > self%order(i)), &
                        self%before_start(i), self%before_start(i) + m - 1)
         end do
         self%most_before = max(self%most_before, m)
         self%before_start(i + 1) = self%before_start(i) + m
      end do

      ! columns are ascending, so those of the same group come last
      next = 0
      do g = 1, self%n_groups
         do i = self%group(g), self%group(g + 1) - 1
            k = self%before_start(i)
            do while (k < self%before_start(i + 1))
               j = self%before_column(k)
               if (self%has_sweeps .and. j >= self%group(g)) exit
               next(j) = next(j) + 1
               k = k + 1
            end do
            self%own_start(i) = k
         end do
      end do
      self%after_start(n) = 1
      do i = n, 1, -1
         self%after_start(i - 1) = self%after_start(i) + next(i)
      end do
      n_after = self%after_start(0) - 1
      allocate (self%after_column(n_after), self%after(36, n_after))
      ! rows are visited in order, so that the columns of each row of `after` come ascending
      next = self%after_start(1:n)
      self%twin = 0
      do i = 1, n
         do k = self%before_start(i), self%own_start(i) - 1
            j = self%before_column(k)
            self%twin(k) = next(j)
            self%after_column(next(j)) = i
            next(j) = next(j) + 1
         end do
      end do

   contains

      !> Put a coupling into its row of `before`, columns ascending.
      subroutine insert(to, place, first, last)
         integer, intent(in) :: to, place           !! column in the new order, place in the matrix
         integer, intent(in) :: first, last         !! the row so far; last is free
         integer :: at
         do at = last, first + 1, -1
            if (self%before_column(at - 1) < to) exit
            self%before_column(at) = self%before_column(at - 1)
            self%before_place(at) = self%before_place(at - 1)
         end do
         self%before_column(at) = to
         self%before_place(at) = place
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
      do i = 1, graph%n
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
   !>
   !> With `few` the splitting was that of the matrix base_id, and only rows in `changed` get new pivots. A pivot of ic0
   !> should then follow in the rows after it; these keep what they have: any pivot will do, it only has to be
   !> used consistently.
   subroutine set_values(self, matrix, few)
      class(splitting_type), intent(inout) :: self
      type(block_matrix_type), intent(in) :: matrix
      logical, intent(in) :: few
      integer :: f, g, replaced

      replaced = 0
      if (few) replaced = self%replaced_pivots
      !$omp parallel if(self%n_groups > 3) default(none) shared(self, matrix, few, replaced) private(f, g)
      do f = 1, 3
         !$omp do schedule(static) reduction(+:replaced)
         do g = self%phase(f), self%phase(f + 1) - 1
            call factorize_group(self, matrix, few, g, replaced)
         end do
         !$omp end do
      end do
      !$omp end parallel
      self%replaced_pivots = replaced
   end subroutine set_values

   !> Pivots and couplings of one group.
   subroutine factorize_group(self, matrix, few, g, replaced)
      class(splitting_type), intent(inout) :: self
      type(block_matrix_type), intent(in) :: matrix
      logical, intent(in) :: few              !! only rows in matrix%changed
      integer, intent(in) :: g                !! group
      integer, intent(inout) :: replaced      !! counts pivots replaced
      real(wp) :: b(6, 6, self%most_before), pivot(6, 6), l(6, 6)
      logical :: ok
      integer :: i, k, m, c, first, last
      do i = self%group(g), self%group(g + 1) - 1
         first = self%before_start(i)
         last = self%before_start(i + 1) - 1
         self%is_new(i) = .true.
         if (few) then
            if (.not. matrix%changed(self%order(i))) then
               self%is_new(i) = .false.
               call follow_columns(self, matrix, i)
               cycle
            end if
         end if
         associate (d => matrix%values(:, :, matrix%row_start(self%order(i))))
            pivot = d
            do k = first, last
               m = k - first + 1
               call take(matrix, self%before_place(k), b(:, :, m))
               call times_transposed(b(:, :, m), self%scale(:, :, self%before_column(k)))
               if (self%modify_pivots) call subtract_square(b(:, :, m), pivot)
            end do
            call factorize_block(pivot, l, ok)
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
            pivot = d
         end associate
         call scale_rows(self%scale(:, :, i), pivot)
         call times_transposed(pivot, self%scale(:, :, i))
         pivot = -pivot
         do c = 1, 6
            pivot(c, c) = pivot(c, c) + 2
         end do
         call lay_out(pivot, self%rest(:, i))
         do k = first, last
            m = k - first + 1
            call scale_rows(self%scale(:, :, i), b(:, :, m))
            call lay_out(b(:, :, m), self%before(:, k))
            if (k < self%own_start(i)) call lay_out_transposed(b(:, :, m), self%after(:, self%twin(k)))
         end do
      end do
   end subroutine factorize_group

   !> Scale those couplings of row i again whose column has a new pivot.
   subroutine follow_columns(self, matrix, i)
      class(splitting_type), intent(inout) :: self
      type(block_matrix_type), intent(in) :: matrix
      integer, intent(in) :: i                !! place of the row
      real(wp) :: b(6, 6)
      integer :: k
      do k = self%before_start(i), self%before_start(i + 1) - 1
         if (.not. self%is_new(self%before_column(k))) cycle
         call take(matrix, self%before_place(k), b)
         call times_transposed(b, self%scale(:, :, self%before_column(k)))
         call scale_rows(self%scale(:, :, i), b)
         call lay_out(b, self%before(:, k))
         if (k < self%own_start(i)) call lay_out_transposed(b, self%after(:, self%twin(k)))
      end do
   end subroutine follow_columns

   !> The block in a place of the matrix, transposed when the place is negative.
   pure subroutine take(matrix, place, a)
      type(block_matrix_type), intent(in) :: matrix
      integer, intent(in) :: place
      real(wp), intent(out) :: a(6, 6)
      integer :: j
      if (place > 0) then
         a = matrix%values(:, :, place)
      else
         do j = 1, 6
            a(j, :) = matrix%values(:, j, -place)
         end do
      end if
   end subroutine take

   !> a := S a with S lower triangular.
   pure subroutine scale_rows(s, a)
      real(wp), intent(in) :: s(6, 6)
      real(wp), intent(inout) :: a(6, 6)
      real(wp) :: b(6)
      integer :: j
      do j = 1, 6
         b = a(:, j)
         a(1:2, j) = s(1:2, 1)*b(1) + s(1:2, 2)*b(2)
         a(3:4, j) = (s(3:4, 1)*b(1) + s(3:4, 2)*b(2)) + (s(3:4, 3)*b(3) + s(3:4, 4)*b(4))
         a(5:6, j) = (s(5:6, 1)*b(1) + s(5:6, 2)*b(2)) + (s(5:6, 3)*b(3) + s(5:6, 4)*b(4)) &
            + (s(5:6, 5)*b(5) + s(5:6, 6)*b(6))
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

   !> d := d - a a^T, at least its lower half.
   pure subroutine subtract_square(a, d)
      real(wp), intent(in) :: a(6, 6)
      real(wp), intent(inout) :: d(6, 6)
      integer :: j
      do j = 1, 2
         d(1:6, j) = d(1:6, j) - ((a(1:6, 1)*a(j, 1) + a(1:6, 2)*a(j, 2)) + (a(1:6, 3)*a(j, 3) + a(1:6, 4)*a(j, 4)) &
                                  + (a(1:6, 5)*a(j, 5) + a(1:6, 6)*a(j, 6)))
      end do
      do j = 3, 4
         d(3:6, j) = d(3:6, j) - ((a(3:6, 1)*a(j, 1) + a(3:6, 2)*a(j, 2)) + (a(3:6, 3)*a(j, 3) + a(3:6, 4)*a(j, 4)) &
                                  + (a(3:6, 5)*a(j, 5) + a(3:6, 6)*a(j, 6)))
      end do
      do j = 5, 6
         d(5:6, j) = d(5:6, j) - ((a(5:6, 1)*a(j, 1) + a(5:6, 2)*a(j, 2)) + (a(5:6, 3)*a(j, 3) + a(5:6, 4)*a(j, 4)) &
                                  + (a(5:6, 5)*a(j, 5) + a(5:6, 6)*a(j, 6)))
      end do
   end subroutine subtract_square

end module rockdda_linear_splitting
