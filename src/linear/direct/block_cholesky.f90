! SPDX-License-Identifier: MIT
!> Cholesky factor by blocks of 6x6 for systems of some hundred blocks, where libraries for sparse matrices spend more
!> on their data than on the numbers.
!>
!> Column j of the factor is K's less what the columns k before it with a block L_jk give,
!>
!>     C_ij = K_ij - sum_k L_ik L_jk^T,    L_jj = chol(C_jj),    L_ij = C_ij L_jj^-T,
!>
!> in the order of elimination of rockdda_linear_elimination, which is kept while the pattern is the same. When few rows
!> of K have changed, only columns are computed again that have a changed row or follow from one that was; the others
!> would become the same, bit by bit.
module rockdda_linear_block_cholesky
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type
   use rockdda_linear_matrix, only : block_matrix_type
   use rockdda_linear_direct, only : direct_solver_type, least_pivot
   use rockdda_linear_residual, only : not_positive_definite
   use rockdda_linear_graph, only : graph_type
   use rockdda_linear_elimination, only : elimination_type
   use rockdda_linear_small_blocks, only : factorize_block, solve_lower, solve_lower_transposed
   use rockdda_linear_block_kernels, only : take_blocks, subtract_sources, divide_blocks, subtract_column, subtract_row
   implicit none
   private
   public :: block_cholesky_type, new_block_cholesky, most_blocks

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
      procedure :: name => name_by_blocks
      procedure, private :: analyze
   end type block_cholesky_type

contains

   !> The solver, with its times.
   pure function new_block_cholesky(tolerance) result(solver)
      real(wp), intent(in) :: tolerance   !! wanted relative residual
      type(block_cholesky_type) :: solver
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

   !> Name in the log.
   pure function name_by_blocks(self) result(name)
      class(block_cholesky_type), intent(in) :: self
      character(len=:), allocatable :: name
      name = 'cholesky'
   end function name_by_blocks

end module rockdda_linear_block_cholesky
