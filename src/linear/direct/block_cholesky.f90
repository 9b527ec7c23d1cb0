! SPDX-License-Identifier: MIT
!> Cholesky factor by blocks of 6x6 for systems of some hundred blocks, where libraries for sparse matrices spend more
!> on their data than on the numbers.
!>
!> Column j of the factor is K's less what the columns k before it with a block L_jk give,
!>
!>     C_ij = K_ij - sum_k L_ik L_jk^T,    L_jj = chol(C_jj),    L_ij = C_ij L_jj^-T,
!>
!> in the order of elimination described below, which is kept while the pattern is the same. When few
!> rows of K have changed, only columns are computed again that have a changed row or follow from one that was; the
!> others would become the same, bit by bit.
!>
!> Eliminating a block joins all its neighbours with each other. The next one is that which adds the fewest new pairs
!> (the third scheme of Tinney and Walker 1967); of equals the one with fewer neighbours, then that with the lower
!> number, so that the order depends on the graph alone. Places in the order are called columns:
!>
!>     column k       row(start(k) : start(k+1)-1)     ascending, the blocks of the factor below the diagonal
!>     place(...)     of the block in the matrix, negative: transposed, 0: not in the matrix
!>     column j       source(source_start(j) : source_start(j+1)-1)   blocks L_jk in row j, by their place in `row`
!>
!> Which blocks are joined is kept as a square array, so that the search takes memory that grows with the square of
!> the number of blocks.
module rockdda_linear_block_cholesky
   use, intrinsic :: iso_c_binding, only : c_int, c_double
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type
   use rockdda_linear_matrix, only : block_matrix_type
   use rockdda_linear_direct, only : direct_solver_type, least_pivot
   use rockdda_linear_residual, only : not_positive_definite
   use rockdda_linear_graph, only : graph_type
   use rockdda_linear_small_blocks, only : factorize_block, solve_lower, solve_lower_transposed
   implicit none
   private
   public :: block_cholesky_type, new_block_cholesky, most_blocks, elimination_type

   type :: elimination_type
      integer :: n = 0                          !! blocks
      integer :: n_blocks = 0                   !! of the factor below the diagonal
      integer :: n_products = 0                 !! of two blocks, in a factorisation
      integer, allocatable :: block(:)          !! (n) block of each column
      integer, allocatable :: start(:)          !! (n + 1)
      integer, allocatable :: row(:), place(:)  !! (n_blocks)
      integer, allocatable :: column(:)         !! (n_blocks) column that each block is in
      integer, allocatable :: first_target(:)   !! (n_blocks) of the products of each block, in `target`
      integer, allocatable :: target(:)         !! places of the products of L_jk with the blocks after it in column k
      integer, allocatable :: source_start(:)   !! (n + 1)
      integer, allocatable :: source(:)         !! (n_blocks)
   contains
      procedure :: analyze => find_order
   end type elimination_type

   interface
      !> Copies of n blocks of the matrix, from number `first` of c on: transposed when the place is negative, zero when
      !> it is 0.
      pure subroutine take_blocks(first, n, place, values, c) bind(c, name='rockdda_take_blocks')
         import :: c_int, c_double
         integer(c_int), value :: first, n
         integer(c_int), intent(in) :: place(*)          !! of each block of c
         real(c_double), intent(in) :: values(6, 6, *)
         real(c_double), intent(inout) :: c(6, 6, *)
      end subroutine take_blocks

      !> Take off a column j of the matrix what the blocks L_jk give that `source` has from `first` to `last`:
      !> L_jk L_jk^T off `own`, at least its lower half, L_ik L_jk^T off the block L_ij of `lower`.
      pure subroutine subtract_sources(first, last, source, column, start, first_target, target, own, lower) &
         bind(c, name='rockdda_subtract_sources')
         import :: c_int, c_double
         integer(c_int), value :: first, last
         integer(c_int), intent(in) :: source(*), column(*), start(*), first_target(*), target(*)   !! of elimination
         real(c_double), intent(inout) :: own(6, 6), lower(6, 6, *)
      end subroutine subtract_sources

      !> C := C L^-T for n blocks, from number `first` of c on, with a factor L of `factorize_block`.
      pure subroutine divide_blocks(first, n, l, c) bind(c, name='rockdda_divide_blocks')
         import :: c_int, c_double
         integer(c_int), value :: first, n
         real(c_double), intent(in) :: l(6, 6)
         real(c_double), intent(inout) :: c(6, 6, *)
      end subroutine divide_blocks

      !> y_i := y_i - A_q x for n blocks A, i = row(q).
      pure subroutine subtract_column(n, row, a, x, y) bind(c, name='rockdda_subtract_column')
         import :: c_int, c_double
         integer(c_int), value :: n
         integer(c_int), intent(in) :: row(*)
         real(c_double), intent(in) :: a(6, 6, *), x(6)
         real(c_double), intent(inout) :: y(6, *)
      end subroutine subtract_column

      !> x := x - sum of A_q^T y_i over n blocks A, i = row(q).
      pure subroutine subtract_row(n, row, a, y, x) bind(c, name='rockdda_subtract_row')
         import :: c_int, c_double
         integer(c_int), value :: n
         integer(c_int), intent(in) :: row(*)
         real(c_double), intent(in) :: a(6, 6, *), y(6, *)
         real(c_double), intent(inout) :: x(6)
      end subroutine subtract_row
   end interface

   !> Up to this number of blocks: the search for the order takes memory and time that grow with its square.
   integer, parameter :: most_blocks = 300

   type, extends(direct_solver_type) :: block_cholesky_type
      private
      type(graph_type) :: graph                      !! that was analysed
      type(elimination_type) :: elimination
      integer :: factor_id = 0                       !! values_id of the matrix of the factor, 0: none
      real(wp), allocatable :: diagonal(:, :, :)     !! (6, 6, n) L_jj, of factorize_block
      real(wp), allocatable :: lower(:, :, :)        !! (6, 6, blocks of the factor) L_ij
      logical, allocatable :: is_new(:)              !! (n) columns that were computed again
      real(wp), allocatable :: y(:, :)               !! (6, n) work, in the order of elimination
   contains
      procedure :: count_work => count_work_by_blocks
      procedure :: factorize => factorize_by_blocks
      procedure :: backsolve => backsolve_by_blocks
      procedure, private :: analyze
   end type block_cholesky_type

contains

   !> The solver, with its times.
   pure function new_block_cholesky(tolerance) result(solver)
      real(wp), intent(in) :: tolerance   !! wanted relative residual
      type(block_cholesky_type) :: solver
      solver%label = 'cholesky'
      solver%tolerance = tolerance
      solver%per_operation = 0.15_wp
      solver%per_fill = 1.5_wp
      solver%per_backsolve = 0.7_wp
   end function new_block_cholesky

   !> Find the order of elimination, unless the pattern is that of the last matrix.
   subroutine analyze(self, matrix)
      class(block_cholesky_type), intent(inout) :: self
      type(block_matrix_type), intent(in) :: matrix
      logical :: changed
      call self%graph%update(matrix, changed)
      if (.not. changed) return
      call self%elimination%analyze(self%graph)
      self%factor_id = 0
      if (allocated(self%lower)) deallocate (self%lower, self%diagonal, self%is_new, self%y)
      allocate (self%lower(6, 6, self%elimination%n_blocks), self%diagonal(6, 6, matrix%n), self%is_new(matrix%n), &
                self%y(6, matrix%n))
   end subroutine analyze

   !> Operations and fill of the factor.
   subroutine count_work_by_blocks(self, matrix, operations, fill, error)
      class(block_cholesky_type), intent(inout) :: self
      type(block_matrix_type), intent(in) :: matrix
      real(wp), intent(out) :: operations, fill
      type(error_type), allocatable, intent(out) :: error
      call self%analyze(matrix)
      operations = 432.0_wp*self%elimination%n_products + 216.0_wp*self%elimination%n_blocks + 100.0_wp*matrix%n
      fill = 36.0_wp*self%elimination%n_blocks + 21.0_wp*matrix%n
   end subroutine count_work_by_blocks

   !> Factorise K, or its changed rows and what follows from them.
   subroutine factorize_by_blocks(self, matrix, error)
      class(block_cholesky_type), intent(inout) :: self
      type(block_matrix_type), intent(in) :: matrix
      type(error_type), allocatable, intent(out) :: error
      logical :: few
      integer :: j
      call self%analyze(matrix)
      few = matrix%base_id /= 0 .and. matrix%base_id == self%factor_id
      self%factor_id = 0
      associate (elimination => self%elimination)
         do j = 1, elimination%n
            self%is_new(j) = .not. few
            if (few) self%is_new(j) = matrix%changed(elimination%block(j))
         end do
         do j = 1, elimination%n
            if (.not. self%is_new(j)) cycle
            ! the first block below the diagonal is in the column that follows from this one, as do all others from that
            if (elimination%start(j + 1) > elimination%start(j)) &
               self%is_new(elimination%row(elimination%start(j))) = .true.
            call compute_column(self, matrix, j, error)
            if (allocated(error)) return
         end do
      end associate
      self%factor_id = matrix%values_id
   end subroutine factorize_by_blocks

   !> Compute column j of the factor from the columns before it.
   subroutine compute_column(self, matrix, j, error)
      type(block_cholesky_type), intent(inout) :: self
      type(block_matrix_type), intent(in) :: matrix
      integer, intent(in) :: j
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: own(6, 6)
      integer :: c, i, n
      logical :: ok
      associate (e => self%elimination)
         i = e%block(j)
         n = e%start(j + 1) - e%start(j)
         own = matrix%values(:, :, matrix%row_start(i))
         call take_blocks(e%start(j), n, e%place, matrix%values, self%lower)
         call subtract_sources(e%source_start(j), e%source_start(j + 1) - 1, e%source, e%column, e%start, &
                               e%first_target, e%target, own, self%lower)
         call factorize_block(own, self%diagonal(:, :, j), ok)
         if (ok) then
            do c = 1, 6
               ! written so that a pivot that is not a number fails too
               ok = ok .and. 1 > least_pivot*matrix%values(c, c, matrix%row_start(i))*self%diagonal(c, c, j)**2
            end do
         end if
         if (.not. ok) then
            call not_positive_definite(i, error)
            return
         end if
         call divide_blocks(e%start(j), n, self%diagonal(:, :, j), self%lower)
      end associate
   end subroutine compute_column

   !> x = K^-1 b.
   subroutine backsolve_by_blocks(self, b, x, error)
      class(block_cholesky_type), intent(inout) :: self
      real(wp), intent(in), contiguous :: b(:, :)
      real(wp), intent(inout), contiguous :: x(:, :)
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: y(6)
      integer :: j, n, p
      if (allocated(error)) return
      associate (e => self%elimination, lower => self%lower)
         do j = 1, e%n
            self%y(:, j) = b(:, e%block(j))
         end do
         do j = 1, e%n
            p = e%start(j)
            n = e%start(j + 1) - p
            y = self%y(:, j)
            call solve_lower(self%diagonal(:, :, j), y)
            self%y(:, j) = y
            call subtract_column(n, e%row(p:p + n - 1), lower(:, :, p:p + n - 1), y, self%y)
         end do
         do j = e%n, 1, -1
            p = e%start(j)
            n = e%start(j + 1) - p
            y = self%y(:, j)
            call subtract_row(n, e%row(p:p + n - 1), lower(:, :, p:p + n - 1), self%y, y)
            call solve_lower_transposed(self%diagonal(:, :, j), y)
            self%y(:, j) = y
            x(:, e%block(j)) = y
         end do
      end associate
   end subroutine backsolve_by_blocks

   !> Find the order and the pattern for a graph.
   subroutine find_order(self, graph)
      class(elimination_type), intent(inout) :: self
      type(graph_type), intent(in) :: graph
      integer, allocatable :: column_of(:)   !! (n)
      integer, allocatable :: later(:, :)    !! (n, n) blocks that each column is joined with when it is eliminated
      integer, allocatable :: n_later(:)     !! (n)
      integer :: k, m, p
      self%n = graph%n
      allocate (column_of(graph%n), later(graph%n, graph%n), n_later(graph%n))
      call eliminate(graph, self%block, later, n_later)
      do k = 1, self%n
         column_of(self%block(k)) = k
      end do
      self%n_blocks = sum(n_later)
      self%n_products = sum((n_later*(n_later + 1))/2)
      if (allocated(self%start)) deallocate (self%start, self%row, self%place, self%column, self%source_start, &
                                             self%source, self%first_target, self%target)
      allocate (self%start(self%n + 1), self%row(self%n_blocks), self%place(self%n_blocks), &
                self%column(self%n_blocks), self%source_start(self%n + 1), self%source(self%n_blocks), &
                self%first_target(self%n_blocks), self%target(self%n_products - self%n_blocks))
      self%start(1) = 1
      do k = 1, self%n
         self%start(k + 1) = self%start(k) + n_later(k)
         associate (rows => self%row(self%start(k):self%start(k + 1) - 1))
            rows = column_of(later(1:n_later(k), k))
            call sort(rows)
         end associate
         self%column(self%start(k):self%start(k + 1) - 1) = k
      end do
      call find_places(self, graph, column_of)
      ! columns are visited in order, so that those of each row ascend
      n_later = 0
      do p = 1, self%n_blocks
         n_later(self%row(p)) = n_later(self%row(p)) + 1
      end do
      self%source_start(1) = 1
      do k = 1, self%n
         self%source_start(k + 1) = self%source_start(k) + n_later(k)
      end do
      n_later = self%source_start(1:self%n)
      do p = 1, self%n_blocks
         m = self%row(p)
         self%source(n_later(m)) = p
         n_later(m) = n_later(m) + 1
      end do
      call find_targets(self)
   end subroutine find_order

   !> Places of the products L_ik L_jk^T in column j.
   pure subroutine find_targets(self)
      type(elimination_type), intent(inout) :: self
      integer :: m, n, p, q
      n = 0
      do p = 1, self%n_blocks
         self%first_target(p) = n + 1
         ! rows of column k after j are rows of column j, too, in the same order
         m = self%start(self%row(p))
         do q = p + 1, self%start(self%column(p) + 1) - 1
            do while (self%row(m) /= self%row(q))
               m = m + 1
            end do
            n = n + 1
            self%target(n) = m
         end do
      end do
   end subroutine find_targets

   !> The order, and the blocks that remain joined with each when it is eliminated.
   pure subroutine eliminate(graph, order, later, n_later)
      type(graph_type), intent(in) :: graph
      integer, allocatable, intent(out) :: order(:)    !! (n)
      integer, intent(out) :: later(:, :)              !! (n, n)
      integer, intent(out) :: n_later(:)               !! (n)
      integer, allocatable :: near(:, :)               !! (n, n) blocks that each is joined with
      integer :: n_near(graph%n), fill(graph%n)
      logical, allocatable :: joined(:, :)             !! (n, n)
      logical :: is_new(graph%n), is_done(graph%n)
      integer :: i, j, k, a, b, chosen
      allocate (near(graph%n, graph%n))
      allocate (joined(graph%n, graph%n), source=.false.)
      do i = 1, graph%n
         n_near(i) = graph%start(i + 1) - graph%start(i)
         near(1:n_near(i), i) = graph%neighbour(graph%start(i):graph%start(i + 1) - 1)
         joined(near(1:n_near(i), i), i) = .true.
      end do
      allocate (order(graph%n))
      is_done = .false.
      is_new = .true.
      do k = 1, graph%n
         chosen = 0
         do i = 1, graph%n
            if (is_done(i)) cycle
            if (is_new(i)) fill(i) = missing_pairs(near(1:n_near(i), i), joined)
            is_new(i) = .false.
            if (chosen > 0) then
               if (fill(i) > fill(chosen)) cycle
               if (fill(i) == fill(chosen) .and. n_near(i) >= n_near(chosen)) cycle
            end if
            chosen = i
         end do
         order(k) = chosen
         is_done(chosen) = .true.
         n_later(k) = n_near(chosen)
         later(1:n_later(k), k) = near(1:n_later(k), chosen)
         do a = 1, n_later(k)
            i = later(a, k)
            call remove(chosen, near(:, i), n_near(i))
         end do
         do a = 1, n_later(k)
            i = later(a, k)
            if (fill(chosen) > 0) then
               do b = 1, n_later(k)
                  j = later(b, k)
                  if (j == i .or. joined(j, i)) cycle
                  joined(j, i) = .true.
                  n_near(i) = n_near(i) + 1
                  near(n_near(i), i) = j
               end do
               is_new(near(1:n_near(i), i)) = .true.
            end if
            is_new(i) = .true.
         end do
      end do
   end subroutine eliminate

   !> Pairs of these blocks that are not joined.
   pure integer function missing_pairs(near, joined) result(n)
      integer, intent(in) :: near(:)
      logical, intent(in) :: joined(:, :)
      integer :: a, b
      n = 0
      do a = 2, size(near)
         do b = 1, a - 1
            if (.not. joined(near(b), near(a))) n = n + 1
         end do
      end do
   end function missing_pairs

   !> Remove a number from a list.
   pure subroutine remove(number, list, n)
      integer, intent(in) :: number
      integer, intent(inout) :: list(:), n
      integer :: a
      do a = 1, n
         if (list(a) /= number) cycle
         list(a) = list(n)
         n = n - 1
         return
      end do
   end subroutine remove

   !> Sort a short list.
   pure subroutine sort(list)
      integer, intent(inout) :: list(:)
      integer :: a, b, number
      do a = 2, size(list)
         number = list(a)
         do b = a - 1, 1, -1
            if (list(b) <= number) exit
            list(b + 1) = list(b)
         end do
         list(b + 1) = number
      end do
   end subroutine sort

   !> Places of the blocks of the factor in the matrix.
   pure subroutine find_places(self, graph, column_of)
      type(elimination_type), intent(inout) :: self
      type(graph_type), intent(in) :: graph
      integer, intent(in) :: column_of(:)       !! (n)
      integer :: at(graph%n), i, j, k, m, p
      at = 0
      do k = 1, self%n
         self%place(self%start(k):self%start(k + 1) - 1) = 0
         do p = self%start(k), self%start(k + 1) - 1
            at(self%row(p)) = p
         end do
         i = self%block(k)
         do m = graph%start(i), graph%start(i + 1) - 1
            j = graph%neighbour(m)
            if (column_of(j) < k) cycle
            ! L_jk belongs to K_ji: stored as K_ij where i is the lower number
            self%place(at(column_of(j))) = merge(-graph%place(m), graph%place(m), i < j)
         end do
      end do
   end subroutine find_places

end module rockdda_linear_block_cholesky
