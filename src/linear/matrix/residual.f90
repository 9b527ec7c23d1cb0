! SPDX-License-Identifier: MIT
!> How well x solves K x = f: one measure for every solver.
!>
!>     residual = |f - K x| / max(|f|, |reference load|),
!>
!> with the norm of rockdda_linear_block_norm and the diagonal blocks K_ii: twice the energy which the unbalanced forces
!> would put into each block alone.
!>
!> In working precision f - K x cannot be made smaller than the rounding of the products in K x. Where
!> contact springs are many orders of magnitude stiffer than inertia that may be above the tolerance; x is
!> then accepted as long as its residual is no larger than that rounding, and the rounding itself below
!> `rounding_limit`. Beyond the limit the matrix is too ill-conditioned for this measure, and the report says so; a
!> direct solver then measures the error of the unknowns (rockdda_linear_direct).
!>
!> For threads the rows are cut into chunks, the number of which depends on the size of the model alone. The two
!> halves of K x are added where no other chunk writes, and sums are taken chunk by chunk, in order.
module rockdda_linear_residual
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use rockdda_base_kinds, only : wp, i8
   use rockdda_base_room, only : resize
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_strings, only : to_string
   use rockdda_linear_block_norm, only : block_norm_type
   use rockdda_linear_matrix, only : block_matrix_type, rounding_level, subtract_own, subtract_foreign
   use rockdda_linear_solver, only : solve_report_type
   use rockdda_linear_graph, only : graph_type
   implicit none
   private
   public :: residual_type, sum_of_magnitudes, not_positive_definite, not_finite, rounding_limit

   !> Largest relative rounding error of K x at which a solution still counts.
   real(wp), parameter :: rounding_limit = 1.0e-6_wp
   !> Multiples of epsilon by which a backward stable solution may exceed the rounding of K x.
   real(wp), parameter :: rounding_factor = 16.0_wp
   !> An iteration whose unknowns are larger has diverged; beyond it squares of forces would overflow.
   real(wp), parameter :: diverged = 1.0e60_wp
   !> Blocks in a chunk, at least, and the largest number of chunks.
   integer, parameter :: chunk_size = 256, max_chunks = 64
   !> Up to this number of chunks threads cost more than they save.
   integer, parameter :: few_chunks = 8

   !> Measures residuals; keeps its arrays between solves.
   type :: residual_type
      type(block_norm_type) :: weights           !! the diagonal blocks of the matrix
      real(wp), allocatable :: r(:, :)           !! (6, n) f - K x of the last evaluation
      real(wp) :: r_norm = 0                     !! |r|
      real(wp), allocatable, private :: magnitude(:) !! (chunks) sums of |x|
      type(graph_type) :: graph                  !! of the matrix
      integer :: graph_id = 0                    !! number of the graph, raised whenever it changes
      ! what `r` belongs to, if it is remembered
      real(wp), allocatable, private :: f_last(:, :), x_last(:, :)  !! (6, n)
      integer, private :: id_last = 0            !! values_id of the matrix, 0: `r` belongs to nothing
      real(wp) :: load_norm = 0                  !! |f|, or that of the reference load if it is larger
      real(wp) :: zero_guess_residual = 1        !! relative residual of x = 0
   contains
      procedure :: start
      procedure :: evaluate
      procedure :: remember
      procedure :: evaluate_again
      procedure :: judge
   end type residual_type

contains

   !> Error for a matrix that has no Cholesky factor.
   pure subroutine not_positive_definite(block, error)
      integer, intent(in) :: block    !! block number of the failed pivot
      type(error_type), allocatable, intent(out) :: error
      call make_error(error, error_code%computation, &
                      'the stiffness matrix is not positive definite: pivot of block '//to_string(block)//' failed')
   end subroutine not_positive_definite

   !> Error that names the first stored block of the matrix which is not finite, if there is one.
   pure subroutine not_finite(matrix, error)
      type(block_matrix_type), intent(in) :: matrix
      type(error_type), allocatable, intent(out) :: error
      integer :: i, k
      do i = 1, matrix%n
         do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
            if (all(ieee_is_finite(matrix%values(:, :, k)))) cycle
            if (matrix%column(k) == i) then
               call make_error(error, error_code%computation, 'the stiffness of block '//to_string(i)//' is not finite')
            else
               call make_error(error, error_code%computation, 'the stiffness that couples blocks '//to_string(i)// &
                               ' and '//to_string(matrix%column(k))//' is not finite')
            end if
            return
         end do
      end do
   end subroutine not_finite

   !> Take a new system: factorise the diagonal blocks and measure the load.
   !>
   !> Without a usable load the report is final: `done` with x = 0 for a zero load, not converged for a
   !> load that is not finite.
   subroutine start(self, matrix, f, reference, x, report, done, error)
      class(residual_type), intent(inout) :: self
      type(block_matrix_type), intent(in) :: matrix
      real(wp), intent(in), contiguous :: f(:, :)      !! (6, n)
      real(wp), intent(in), allocatable :: reference(:, :) !! (6, n) reference load, may be unallocated
      real(wp), intent(inout), contiguous :: x(:, :)   !! (6, n) set to zero when done
      type(solve_report_type), intent(inout) :: report
      logical, intent(out) :: done                     !! nothing is left to solve
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: norms(2)
      integer :: i, bad

      done = .true.
      call make_room(self, matrix)
      call self%weights%factorize_diagonal(matrix, bad, f, reference, norms)
      if (bad > 0) then
         call not_finite(matrix, error)
         if (.not. allocated(error)) call not_positive_definite(bad, error)
         return
      end if
      if (.not. ieee_is_finite(norms(1))) then
         do i = 1, matrix%n
            if (all(ieee_is_finite(f(:, i)))) cycle
            report%detail = 'the load of block '//to_string(i)//' is not finite'
            report%residual = huge(1.0_wp)
            return
         end do
      end if
      self%load_norm = norms(1)
      done = .not. self%load_norm > 0
      if (.not. done) then
         if (allocated(reference)) self%load_norm = max(self%load_norm, norms(2))
         self%zero_guess_residual = norms(1)/self%load_norm
         return
      end if
      x = 0
      report%converged = .true.
   end subroutine start

   !> Room and chunks for a matrix.
   subroutine make_room(self, matrix)
      class(residual_type), intent(inout) :: self
      type(block_matrix_type), intent(in) :: matrix
      integer, allocatable :: first(:)
      integer :: c, n_chunks
      logical :: is_new
      if (allocated(self%r)) then
         if (size(self%r, 2) /= matrix%n) deallocate (self%r)
         if (.not. allocated(self%r)) self%id_last = 0
      end if
      call self%graph%update(matrix, is_new)
      if (is_new) self%graph_id = self%graph_id + 1
      if (allocated(self%r)) return
      allocate (self%r(6, matrix%n))
      n_chunks = max(1, min(max_chunks, matrix%n/chunk_size))
      first = [(1 + int(int(c - 1, i8)*matrix%n/n_chunks), c=1, n_chunks + 1)]
      if (allocated(self%magnitude)) deallocate (self%magnitude)
      allocate (self%magnitude(n_chunks))
      call self%weights%set_chunks(first, n_chunks > few_chunks)
   end subroutine make_room

   !> Relative residual of x; leaves f - K x in `r`. huge() when x is not finite or so large (diverged) that
   !> its square could not be trusted to be.
   subroutine evaluate(self, matrix, f, x, relative)
      class(residual_type), intent(inout) :: self
      type(block_matrix_type), intent(in) :: matrix
      real(wp), intent(in), contiguous :: f(:, :), x(:, :)   !! (6, n)
      real(wp), intent(out) :: relative                      !! |f - K x| / |f|
      integer :: c
      relative = huge(1.0_wp)
      self%id_last = 0
      ! what earlier rows hold is in the cache when a chunk comes to it
      !$omp parallel do if(self%weights%uses_threads) default(none) shared(self, matrix, f, x) private(c) &
      !$omp schedule(static)
      do c = 1, self%weights%n_chunks
         self%magnitude(c) = sum_of_magnitudes(self%weights%first(c), self%weights%first(c + 1) - 1, x)
         call subtract_own(self%weights%first(c), self%weights%first(c + 1) - 1, matrix%row_start, matrix%column, &
                           matrix%values, f, x, self%r)
         call subtract_foreign(self%weights%first(c), self%weights%first(c + 1) - 1, self%graph%start, &
                               self%graph%neighbour, self%graph%place, matrix%values, x, self%r)
         self%weights%partial(c) = self%weights%chunk_square(c, self%r)
      end do
      !$omp end parallel do
      if (.not. sum(self%magnitude) <= diverged) return
      call finish_evaluation(self, relative)
   end subroutine evaluate

   !> Sum of the magnitudes of the unknowns of some of the blocks.
   pure real(wp) function sum_of_magnitudes(first, last, x) result(total)
      integer, intent(in) :: first, last
      real(wp), intent(in) :: x(6, *)
      real(wp) :: lane(6)
      integer :: i
      lane = 0
      do i = first, last
         lane = lane + abs(x(:, i))
      end do
      total = sum(lane)
   end function sum_of_magnitudes

   !> Remember load and unknowns of the last evaluation, for `evaluate_again`.
   subroutine remember(self, matrix, f, x)
      class(residual_type), intent(inout) :: self
      type(block_matrix_type), intent(in) :: matrix
      real(wp), intent(in), contiguous :: f(:, :), x(:, :)   !! (6, n)
      integer :: i
      if (self%id_last /= 0) return
      call resize(self%f_last, 6, matrix%n)
      call resize(self%x_last, 6, matrix%n)
      !$omp parallel do if(self%weights%uses_threads) default(none) shared(self, matrix, f, x) private(i) &
      !$omp schedule(static)
      do i = 1, matrix%n
         self%f_last(:, i) = f(:, i)
         self%x_last(:, i) = x(:, i)
      end do
      !$omp end parallel do
      self%id_last = matrix%values_id
   end subroutine remember

   !> `evaluate` where only the load may have changed since the evaluation that is remembered:
   !> f - K x = r + (f - last f).
   subroutine evaluate_again(self, matrix, f, x, relative)
      class(residual_type), intent(inout) :: self
      type(block_matrix_type), intent(in) :: matrix
      real(wp), intent(in), contiguous :: f(:, :), x(:, :)   !! (6, n)
      real(wp), intent(out) :: relative                      !! |f - K x| / |f|
      logical :: same
      integer :: c, i
      same = self%id_last /= 0 .and. self%id_last == matrix%values_id
      if (same) same = all(abs(x - self%x_last) <= 0)
      if (.not. same) then
         call self%evaluate(matrix, f, x, relative)
         return
      end if
      !$omp parallel do if(self%weights%uses_threads) default(none) shared(self, f) private(c, i) schedule(static)
      do c = 1, self%weights%n_chunks
         do i = self%weights%first(c), self%weights%first(c + 1) - 1
            self%r(:, i) = self%r(:, i) + (f(:, i) - self%f_last(:, i))
            self%f_last(:, i) = f(:, i)
         end do
         self%weights%partial(c) = self%weights%chunk_square(c, self%r)
      end do
      !$omp end parallel do
      call finish_evaluation(self, relative)
   end subroutine evaluate_again

   !> Norms of the residual from the sums of all chunks.
   pure subroutine finish_evaluation(self, relative)
      class(residual_type), intent(inout) :: self
      real(wp), intent(out) :: relative
      self%r_norm = self%weights%norm_of_sums()
      relative = self%r_norm/self%load_norm
      if (.not. ieee_is_finite(relative)) relative = huge(1.0_wp)
   end subroutine finish_evaluation

   !> Fill the report for x with the given relative residual.
   subroutine judge(self, matrix, f, x, relative, tolerance, report)
      class(residual_type), intent(inout) :: self
      type(block_matrix_type), intent(in) :: matrix
      real(wp), intent(in), contiguous :: f(:, :), x(:, :)   !! (6, n)
      real(wp), intent(in) :: relative                       !! from `evaluate`
      real(wp), intent(in) :: tolerance                      !! wanted relative residual
      type(solve_report_type), intent(inout) :: report
      type(error_type), allocatable :: error
      real(wp), allocatable :: level(:, :)                   ! of rounding; few solves need it
      real(wp) :: attainable
      report%residual = relative
      report%converged = relative <= tolerance
      if (report%converged) return
      if (.not. relative < huge(1.0_wp)) then
         report%detail = 'the solution is not finite'
         call not_finite(matrix, error)
         if (allocated(error)) report%detail = error%message
         return
      end if
      allocate (level(6, matrix%n))
      call rounding_level(matrix, x, f, level)
      attainable = rounding_factor*epsilon(1.0_wp)*self%weights%norm(level)/self%load_norm
      report%converged = relative <= attainable .and. attainable <= rounding_limit
      if (report%converged) then
         report%detail = 'residual '//to_string(relative)//' is at the rounding of K x, above the tolerance '// &
            to_string(tolerance)
      else if (relative <= attainable) then
         report%detail = 'the matrix is too ill-conditioned: rounding alone leaves a residual of '//to_string(relative)
      else
         report%detail = 'residual '//to_string(relative)//' is above the tolerance '//to_string(tolerance)
      end if
   end subroutine judge

end module rockdda_linear_residual
