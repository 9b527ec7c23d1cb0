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
!> For threads the blocks are ordered in chunks, see rockdda_linear_chunk_order.
!>
!> Couplings are stored once, row by row (`lower`). The forward sweep gathers with them: row i sums over its columns.
!> The backward sweep scatters with their transposes: once row i is final, it adds its product to the earlier rows of
!> its chunk. Couplings with rows of other chunks are stored a second time, transposed (`upper`), and the backward sweep
!> gathers with them: no two chunks write to the same place.
!>
!> Single precision is enough because the solver corrects with residuals in working precision.
module rockdda_linear_preconditioner
   use, intrinsic :: iso_c_binding, only : c_int, c_double, c_float
   use rockdda_base_kinds, only : wp
   use rockdda_linear_matrix, only : block_matrix_type
   use rockdda_linear_graph, only : graph_type
   use rockdda_linear_chunk_order, only : chunk_order_type
   use rockdda_linear_small_blocks, only : factorize_packed, invert_packed, n_packed
   use rockdda_linear_kernels, only : sp
   implicit none
   private
   public :: preconditioner_type, eliminate_couplings, scale_diagonal, scale_couplings

   interface
      !> Fetch the diagonal block of a row and its couplings, which are needed soon: rows of the preconditioner are
      !> far from each other in the matrix.
      pure subroutine expect_row(diagonal, first, last, place, values) bind(c, name='rockdda_expect_row')
         import :: c_int, c_double
         integer(c_int), value :: diagonal                !! its place in the matrix
         integer(c_int), value :: first, last             !! couplings
         integer(c_int), intent(in) :: place(*)           !! of the couplings in the matrix, negative: transposed
         real(c_double), intent(in) :: values(36, *)      !! of the matrix
      end subroutine expect_row

      !> b := K_q S_j^T for each coupling q of a row, K_q in place(q) of the matrix (negative: transposed) and
      !> j = column(q); with squares = 1 also d := d - b b^T, at least its lower half.
      pure subroutine eliminate_couplings(first, last, place, column, values, scale, squares, b, d) &
         bind(c, name='rockdda_eliminate_couplings')
         import :: c_int, c_double
         integer(c_int), value :: first, last             !! couplings
         integer(c_int), intent(in) :: place(*), column(*)
         real(c_double), intent(in) :: values(36, *)      !! of the matrix
         real(c_double), intent(in) :: scale(21, *)       !! S, lower triangles, packed
         integer(c_int), value :: squares
         real(c_double), intent(inout) :: b(36, *), d(36)
      end subroutine eliminate_couplings

      !> The remainder 2 I - S d S^T, packed as in rockdda_linear_kernels.
      pure subroutine scale_diagonal(s, d, remainder) bind(c, name='rockdda_scale_diagonal')
         import :: c_double, c_float
         real(c_double), intent(in) :: s(21), d(36)
         real(c_float), intent(inout) :: remainder(36)
      end subroutine scale_diagonal

      !> S b for each coupling q of a row, packed as in rockdda_linear_kernels, in place q of `lower`, and its transpose
      !> in place transposed(q) of `upper`, 0: none.
      pure subroutine scale_couplings(first, last, s, b, transposed, lower, upper) &
         bind(c, name='rockdda_scale_couplings')
         import :: c_int, c_double, c_float
         integer(c_int), value :: first, last             !! couplings
         real(c_double), intent(in) :: s(21), b(36, *)
         integer(c_int), intent(in) :: transposed(*)
         real(c_float), intent(inout) :: lower(36, *), upper(36, *)
      end subroutine scale_couplings
   end interface

   type :: preconditioner_type
      integer :: n = 0
      type(chunk_order_type) :: order          !! "new order" below
      integer, allocatable :: lower_start(:)   !! (n + 1) couplings with blocks of a lower place in the new order
      integer, allocatable :: lower_column(:)
      integer, allocatable :: lower_place(:)   !! place in the matrix, negative: transposed
      integer, allocatable :: own_start(:)     !! (n) the first of them with a block of the same chunk
      integer, allocatable :: transposed(:)    !! place of the coupling in `upper`, 0: none
      integer, allocatable :: upper_start(:)   !! (0:n) couplings with blocks of later chunks, see set_pattern
      integer, allocatable :: upper_column(:)
      real(sp), allocatable :: lower(:, :)     !! (36, couplings) scaled, packed as in rockdda_linear_kernels
      real(sp), allocatable :: upper(:, :)     !! (36, couplings) the transposes
      real(sp), allocatable :: remainder(:, :) !! (36, n) -N^ = 2 I - G^-1 D G^-T
      real(wp), allocatable :: scale(:, :)     !! (n_packed, n) G^-1, lower triangle, packed
      integer :: most_lower = 0                !! largest number of lower couplings of a block
      integer :: replaced_pivots = 0           !! pivots of ic0 that were not well positive
      logical, allocatable, private :: is_new(:)  !! (n) pivots that differ from those before, in the new order
      logical :: has_sweeps = .true.           !! false for jacobi
      logical, private :: modify_pivots = .true.
   contains
      procedure :: choose
      procedure :: set_pattern
      procedure :: set_values
   end type preconditioner_type

   !> Rows after which a row of the matrix is asked for.
   integer, parameter :: rows_ahead = 2

contains

   !> Choose the preconditioner; `known` is false for an unknown name.
   subroutine choose(self, preconditioner, known)
      class(preconditioner_type), intent(inout) :: self
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

   !> Order the blocks of a new graph and list the couplings. An example with three chunks, without phases:
   !>
   !>     place i                        1  2  3 | 4  5  6 | 7  8
   !>     columns of row 6 below i       .  2  . | 4  5
   !>                                       |      |  |
   !>     lower: places k of row 6       k0 .      |  .           k0 = lower_start(6), column 2 in another chunk
   !>                                              k1             k1 = own_start(6), from here the same chunk
   !>     upper: row 2 has column 6, place transposed(k0)
   !>
   !> Columns of a row ascend in both. The backward sweep visits the last block first, and the rows of `upper` lie in
   !> that order: row i has the places upper_start(i) : upper_start(i - 1) - 1.
   subroutine set_pattern(self, graph)
      class(preconditioner_type), intent(inout) :: self
      type(graph_type), intent(in) :: graph
      integer :: n, n_couplings
      call self%order%update(graph)
      n = graph%n
      self%n = n
      if (allocated(self%lower_start)) deallocate (self%lower_start, self%own_start, self%upper_start, self%scale, &
         self%lower_column, self%lower_place, self%transposed, self%upper_column, self%lower, self%upper, &
         self%remainder, self%is_new)
      n_couplings = size(graph%neighbour)/2
      allocate (self%lower_start(n + 1), self%own_start(n), self%upper_start(0:n))
      allocate (self%lower_column(n_couplings), self%lower_place(n_couplings), self%transposed(n_couplings), &
                self%lower(36, n_couplings))
      allocate (self%remainder(36, n), self%scale(n_packed, n), self%is_new(n))
      call list_lower(self, graph)
      call list_upper(self)
   end subroutine set_pattern

   !> The couplings of each row with rows of a lower place.
   subroutine list_lower(self, graph)
      class(preconditioner_type), intent(inout) :: self
      type(graph_type), intent(in) :: graph
      integer :: i, j, k, m, block
      self%lower_start(1) = 1
      self%most_lower = 0
      do i = 1, self%n
         m = 0
         block = self%order%block(i)
         do k = graph%start(block), graph%start(block + 1) - 1
            j = self%order%place(graph%neighbour(k))
            if (j > i) cycle
            m = m + 1
            call insert(j, merge(graph%place(k), -graph%place(k), graph%neighbour(k) > block), &
                        self%lower_start(i), self%lower_start(i) + m - 1)
         end do
         self%most_lower = max(self%most_lower, m)
         self%lower_start(i + 1) = self%lower_start(i) + m
      end do

   contains

      !> Insert a coupling into its row, columns ascending.
      subroutine insert(column, place, first, last)
         integer, intent(in) :: column, place       !! column in the new order, place in the matrix
         integer, intent(in) :: first, last         !! places of the row; the last one is free
         integer :: at
         do at = last, first + 1, -1
            if (self%lower_column(at - 1) < column) exit
            self%lower_column(at) = self%lower_column(at - 1)
            self%lower_place(at) = self%lower_place(at - 1)
         end do
         self%lower_column(at) = column
         self%lower_place(at) = place
      end subroutine insert

   end subroutine list_lower

   !> The transposes of the couplings between different chunks (without sweeps: of all couplings).
   subroutine list_upper(self)
      class(preconditioner_type), intent(inout) :: self
      integer, allocatable :: next(:)      !! (n) first the number of couplings of a row, then its next free place
      integer :: c, i, j, k, n_upper
      allocate (next(self%n), source=0)
      ! columns ascend, so that those of the same chunk come last
      do c = 1, self%order%n_chunks
         do i = self%order%first(c), self%order%first(c + 1) - 1
            k = self%lower_start(i)
            do while (k < self%lower_start(i + 1))
               j = self%lower_column(k)
               if (self%has_sweeps .and. j >= self%order%first(c)) exit
               next(j) = next(j) + 1
               k = k + 1
            end do
            self%own_start(i) = k
         end do
      end do
      self%upper_start(self%n) = 1
      do i = self%n, 1, -1
         self%upper_start(i - 1) = self%upper_start(i) + next(i)
      end do
      n_upper = self%upper_start(0) - 1
      allocate (self%upper_column(n_upper), self%upper(36, n_upper))
      ! rows are visited in order, so that the columns of each row of `upper` ascend
      next = self%upper_start(1:self%n)
      self%transposed = 0
      do i = 1, self%n
         do k = self%lower_start(i), self%own_start(i) - 1
            j = self%lower_column(k)
            self%transposed(k) = next(j)
            self%upper_column(next(j)) = i
            next(j) = next(j) + 1
         end do
      end do
   end subroutine list_upper

   !> Factorise the pivots and scale the couplings. The diagonal blocks have to be positive definite.
   !>
   !> With `changed_rows_only` the preconditioner must be that of the matrix base_id; only rows in `changed` get new
   !> pivots. The later rows of ic0, whose pivots depend on these, keep their pivots: any positive definite pivot is
   !> admissible as long as all uses agree.
   subroutine set_values(self, matrix, changed_rows_only)
      class(preconditioner_type), intent(inout) :: self
      type(block_matrix_type), intent(in) :: matrix
      logical, intent(in) :: changed_rows_only
      integer :: f, g, replaced

      replaced = 0
      if (changed_rows_only) replaced = self%replaced_pivots
      !$omp parallel if(self%order%n_chunks > 3) default(none) &
      !$omp shared(self, matrix, changed_rows_only, replaced) private(f, g)
      do f = 1, 3
         !$omp do schedule(static) reduction(+:replaced)
         do g = self%order%phase(f), self%order%phase(f + 1) - 1
            call factorize_chunk(self, matrix, changed_rows_only, g, replaced)
         end do
         !$omp end do
      end do
      !$omp end parallel
      self%replaced_pivots = replaced
   end subroutine set_values

   !> Pivots and couplings of one chunk.
   subroutine factorize_chunk(self, matrix, changed_rows_only, g, replaced)
      class(preconditioner_type), intent(inout) :: self
      type(block_matrix_type), intent(in) :: matrix
      logical, intent(in) :: changed_rows_only              !! only rows in matrix%changed
      integer, intent(in) :: g                !! chunk
      integer, intent(inout) :: replaced      !! counts pivots replaced
      real(wp) :: b(36, self%most_lower), pivot(6, 6), l(n_packed)
      logical :: ok
      integer :: i, d, first, last, next
      do i = self%order%first(g), self%order%first(g + 1) - 1
         next = min(i + rows_ahead, self%order%first(g + 1) - 1)
         call expect_row(matrix%row_start(self%order%block(next)), self%lower_start(next), &
                         self%lower_start(next + 1) - 1, self%lower_place, matrix%values)
         self%is_new(i) = .true.
         if (changed_rows_only) then
            if (.not. matrix%changed(self%order%block(i))) then
               self%is_new(i) = .false.
               call rescale_row(self, matrix, i)
               cycle
            end if
         end if
         d = matrix%row_start(self%order%block(i))
         first = self%lower_start(i)
         last = self%lower_start(i + 1) - 1
         pivot = matrix%values(:, :, d)
         call eliminate_couplings(first, last, self%lower_place, self%lower_column, matrix%values, self%scale, &
                                  merge(1, 0, self%modify_pivots), b, pivot)
         call factorize_packed(pivot, l, ok)
         if (ok .and. self%modify_pivots) ok = are_large(l, matrix%values(:, :, d))
         if (.not. ok) then
            replaced = replaced + 1
            call factorize_packed(matrix%values(:, :, d), l, ok)
         end if
         call invert_packed(l, self%scale(:, i))
         call scale_diagonal(self%scale(:, i), matrix%values(:, :, d), self%remainder(:, i))
         call scale_couplings(first, last, self%scale(:, i), b, self%transposed, self%lower, self%upper)
      end do
   end subroutine factorize_chunk

   !> Is no pivot of a factor very small against the diagonal entry that it came from?
   pure logical function are_large(l, d)
      real(wp), intent(in) :: l(n_packed)     !! of factorize_packed
      real(wp), intent(in) :: d(6, 6)
      real(wp), parameter :: limit = 1.0e4_wp
      are_large = l(1)**2*d(1, 1) < limit .and. l(7)**2*d(2, 2) < limit .and. l(12)**2*d(3, 3) < limit .and. &
                  l(16)**2*d(4, 4) < limit .and. l(19)**2*d(5, 5) < limit .and. l(21)**2*d(6, 6) < limit
   end function are_large

   !> Scale again the couplings of row i that have a new pivot in their column.
   subroutine rescale_row(self, matrix, i)
      class(preconditioner_type), intent(inout) :: self
      type(block_matrix_type), intent(in) :: matrix
      integer, intent(in) :: i                !! place of the row
      real(wp) :: b(36, 1), unused(36)
      integer :: k
      do k = self%lower_start(i), self%lower_start(i + 1) - 1
         if (.not. self%is_new(self%lower_column(k))) cycle
         call eliminate_couplings(k, k, self%lower_place, self%lower_column, matrix%values, self%scale, 0, b, unused)
         call scale_couplings(k, k, self%scale(:, i), b, self%transposed, self%lower, self%upper)
      end do
   end subroutine rescale_row

end module rockdda_linear_preconditioner
