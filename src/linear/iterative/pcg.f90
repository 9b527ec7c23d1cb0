! SPDX-License-Identifier: MIT
!> Preconditioned conjugate gradients on the block matrix, warm-started.
!>
!> The preconditioner M = (D~ + L) D~^-1 (D~ + L)^T of rockdda_linear_preconditioner is applied on both sides, as
!> Eisenstat (1981, SIAM J. Sci. Stat. Comput. 2, 1-4) does it: in the scaled variables one iteration
!> needs
!>
!>     t = (I + L)^-T p,    q = t + (I + L)^-1 (p + N t),
!>
!> that is one backward and one forward sweep, instead of a product and two sweeps. The sums for the next step length
!> are taken in the forward sweep, so that a chunk of blocks is updated, swept backward and, where it does not depend on
!> other chunks, forward again while its vectors are in the cache. The threads wait for each other once per phase and
!> once for the sums. (The norm of the next residual follows from the sums, |r - a v|^2 = r r - 2 a r v + a^2 v v;
!> it is used for the direction and the end of the pass only; the next sweep takes the true norm.)
!>
!> The iteration works in single precision on the correction K d = r; after each pass r = f - K x is computed
!> in working precision, and that residual alone decides whether x is accepted. The next pass starts with the last
!> direction of the pass before it, which keeps the conjugacy. All sums are taken chunk by chunk, in order, so that the
!> result does not depend on the number of threads.
!>
!> With a coarse space (rockdda_linear_deflation) directions are kept free of its motions: from s = (I + L)^-T r follows
!> the motion Z a to be taken off, then
!>
!>     t := s + beta t - Z a,    p := r + beta p - (I + L)^T Z a,
!>
!> so that the projection stands between the two sweeps.
!>
!> A solve may pause (`effort`) once it has taken many iterations and has as many to go: the caller then judges the
!> motion, and continues only if it is worth it.
module rockdda_linear_pcg
   use rockdda_base_kinds, only : wp
   use rockdda_base_parallel, only : n_ranges, own_range
   use rockdda_base_room, only : resize
   use rockdda_base_error, only : error_type
   use rockdda_base_strings, only : to_string
   use rockdda_linear_matrix, only : block_matrix_type
   use rockdda_linear_solver, only : linear_solver_type, solve_report_type, solve_effort_type
   use rockdda_linear_residual, only : residual_type
   use rockdda_linear_preconditioner, only : preconditioner_type
   use rockdda_linear_deflation, only : deflation_type
   use rockdda_linear_sweeps, only : start_chunk, add_chunk, update_chunk, sweep_backward, update_and_sweep_backward, &
      sweep_forward, subtract_coarse
   use rockdda_linear_kernels, only : sp
   implicit none
   private
   public :: pcg_solver_type, many_iterations

   type, extends(linear_solver_type) :: pcg_solver_type
      real(wp) :: tolerance = 1.0e-10_wp   !! wanted relative residual, see rockdda_linear_residual
      integer :: max_iterations = 3000
      integer :: passes = 0                !! passes of the last solve
      logical :: deflates = .false.        !! wanted: with the coarse space of rockdda_linear_deflation
      logical, private :: is_deflated = .false.  !! the coarse space of the present matrix is there
      logical, private :: stops = .false.  !! a stop was requested during the last solve
      logical, private :: pauses = .false. !! the last pass ended because it may pause
      real(wp) :: first_residual = 0       !! relative residual that the last solve began with
      integer, private :: graph_id = 0     !! graph of the preconditioner, 0 none
      integer, private :: values_id = 0    !! matrix of the preconditioner, 0 none
      integer, private :: most_iterations = 0 !! of the solves since the last complete set-up of the preconditioner
      real(wp), private :: direction_factor = 0 !! of the last direction in the next pass, times |r|
      type(residual_type) :: residual
      type(preconditioner_type) :: preconditioner
      type(deflation_type) :: deflation
      real(sp), allocatable :: s(:, :)     !! (6, n) (I + L)^-T r of the deflated iteration
      real(sp), allocatable :: p(:, :), q(:, :), r(:, :), t(:, :), d(:, :)  !! (6, n) in the new order
      real(sp), allocatable :: back_sum(:, :)  !! (12, longest*threads) sums of the backward sweep, zero between sweeps
      integer, private :: longest = 0          !! rows of a chunk, at most
      real(wp), allocatable :: sums(:, :)  !! (5, chunks) r r, p v, r v, v v with v = q + t, r p if deflated
   contains
      procedure :: solve => solve_pcg
   end type pcg_solver_type

   !> Smallest reduction of the residual in one pass: below it the rounding of single precision costs more iterations
   !> than a restart.
   real(wp), parameter :: smallest_reduction = 1.0e-5_wp
   !> A pass continues to the end of the solve where that takes no more iterations than these, those of another pass,
   !> and no smaller reduction.
   real(wp), parameter :: iterations_of_pass = 2.0_wp, last_reduction = 5.0e-7_wp
   !> Rounding brings coarse motions back into a deflated iteration. A pass ends when r p, which is r r without them, is
   !> less than this share of it.
   real(wp), parameter :: least_share = 0.5_wp
   !> Bounds of the squared growth of the residual and of the curvature of a direction for positive definite matrices.
   !> Beyond them the pass ends before single precision overflows, and the residual in double precision decides.
   real(wp), parameter :: divergence = 1.0e12_wp, least_curvature = 1.0e-12_wp

   !> New pivots in changed rows only make the preconditioner slightly weaker. When a solve takes more iterations than
   !> this, a complete set-up costs less.
   integer, parameter :: few_iterations = 20, few_deflated = 60
   !> Number of iterations after which a solve may pause when at least as many are left.
   integer, parameter :: many_iterations = 24
   !> Iterations between two checks for a request to stop.
   integer, parameter :: check_every = 16

contains

   !> Solve K x = f from the guess in x.
   subroutine solve_pcg(self, matrix, f, x, report, error, effort)
      class(pcg_solver_type), intent(inout) :: self
      type(block_matrix_type), intent(in) :: matrix
      real(wp), intent(in), contiguous :: f(:, :)     !! (6, n)
      real(wp), intent(inout), contiguous :: x(:, :)  !! (6, n)
      type(solve_report_type), intent(out) :: report
      type(error_type), allocatable, intent(out) :: error
      type(solve_effort_type), intent(in), optional :: effort
      real(wp) :: relative, before, pause_at, tolerance
      logical :: done, changed_rows_only, has_paused

      tolerance = max(self%tolerance, self%enough)
      pause_at = 0
      if (present(effort)) pause_at = effort%pause
      call self%residual%start(matrix, f, self%reference_load, x, report, done, error)
      self%first_residual = 0
      if (done .or. allocated(error)) return
      call self%residual%evaluate_again(matrix, f, x, relative)
      if (.not. relative <= self%residual%zero_guess_residual) then
         ! a guess worse than none
         x = 0
         call self%residual%evaluate(matrix, f, x, relative)
      end if
      self%first_residual = relative
      self%passes = 0
      self%direction_factor = 0
      self%stops = .false.
      has_paused = .false.
      if (relative > tolerance) then
         if (self%graph_id /= self%residual%graph_id) then
            call self%preconditioner%set_pattern(self%residual%graph)
            associate (n => self%preconditioner%n)
               call resize(self%p, 6, n)
               call resize(self%q, 6, n)
               call resize(self%r, 6, n)
               call resize(self%t, 6, n)
               call resize(self%d, 6, n)
               call resize(self%sums, 5, self%preconditioner%order%n_chunks)
            end associate
            self%sums = 0
            self%longest = 0
            self%graph_id = self%residual%graph_id
            self%values_id = 0
         end if
         if (matrix%values_id == 0 .or. matrix%values_id /= self%values_id) then
            changed_rows_only = matrix%base_id /= 0 .and. matrix%base_id == self%values_id .and. &
                                self%most_iterations <= merge(few_deflated, few_iterations, self%is_deflated)
            call self%preconditioner%set_values(matrix, changed_rows_only)
            if (.not. changed_rows_only) self%most_iterations = 0
            call prepare_coarse_space(self, matrix, changed_rows_only)
         end if
         self%values_id = matrix%values_id
         call make_room_for_sums(self)
      end if
      do while (relative > tolerance .and. report%iterations < self%max_iterations)
         before = relative
         self%passes = self%passes + 1
         call correct(self, tolerance/relative, &
                      pause_at*self%first_residual/relative, x, report%iterations)
         report%interrupted = self%stops
         if (report%interrupted) return
         call self%residual%evaluate(matrix, f, x, relative)
         has_paused = self%pauses .and. relative > tolerance .and. relative < self%first_residual
         if (has_paused) exit
         if (relative < 0.5_wp*before) cycle
         if (.not. self%is_deflated) exit
         ! on without the coarse space, which single precision is not enough for
         self%is_deflated = .false.
         self%direction_factor = 0
      end do
      self%most_iterations = max(self%most_iterations, report%iterations)
      call self%residual%remember(matrix, f, x)
      if (has_paused) then
         report%residual = relative
         report%left = self%residual%r_norm
         report%converged = .true.
         return
      end if
      call self%residual%judge(matrix, f, x, relative, tolerance, report)
      if (.not. report%converged) report%detail = 'PCG after '//to_string(report%iterations)// &
         ' iterations: '//report%detail
   end subroutine solve_pcg

   !> Each thread has room for the backward sweep of one chunk, which stays in its cache.
   subroutine make_room_for_sums(self)
      class(pcg_solver_type), intent(inout) :: self
      integer :: m
      associate (first => self%preconditioner%order%first, n => self%preconditioner%order%n_chunks)
         if (self%longest == 0) self%longest = max(1, maxval(first(2:n + 1) - first(1:n)))
      end associate
      m = self%longest*n_ranges(.true.)
      if (allocated(self%back_sum)) then
         if (size(self%back_sum, 2) == m) return
      end if
      call resize(self%back_sum, 12, m)
      self%back_sum = 0
   end subroutine make_room_for_sums

   !> Where the room of the calling thread begins in `back_sum`.
   integer function own_sums(self)
      class(pcg_solver_type), intent(in) :: self
      own_sums = (own_range() - 1)*self%longest + 1
   end function own_sums

   !> Prepare the coarse space for a new matrix, if it is wanted.
   subroutine prepare_coarse_space(self, matrix, changed_rows_only)
      class(pcg_solver_type), intent(inout) :: self
      type(block_matrix_type), intent(in) :: matrix
      logical, intent(in) :: changed_rows_only   !! of the preconditioner
      logical :: was_deflated, is_new
      was_deflated = self%is_deflated
      self%is_deflated = self%deflates .and. self%preconditioner%has_sweeps .and. allocated(self%centroid)
      if (self%is_deflated) self%is_deflated = size(self%centroid, 2) == matrix%n
      if (.not. self%is_deflated) return
      associate (graph => self%residual%graph)
         call self%deflation%set_pattern(graph, self%graph_id, self%preconditioner%order, self%centroid, is_new)
         call self%deflation%set_values(matrix, graph, self%preconditioner, &
                                        changed_rows_only .and. was_deflated .and. .not. is_new, self%is_deflated)
      end associate
      call resize(self%s, 6, matrix%n)
   end subroutine prepare_coarse_space

   !> One pass: x := x + d with K d = r, where d reduces r in the preconditioned norm as far as it may, and not much
   !> further than the solve needs.
   !>
   !> All threads run the whole pass: each has the same alpha and beta, and the loops over chunks divide the work.
   subroutine correct(self, last, pause_at, x, iterations)
      class(pcg_solver_type), intent(inout) :: self
      real(wp), intent(in) :: last                     !! reduction that ends the solve
      real(wp), intent(in) :: pause_at                    !! reduction at which it may pause, 0: never
      real(wp), intent(inout), contiguous :: x(:, :)   !! (6, n)
      integer, intent(inout) :: iterations             !! raised by those of this pass
      real(wp) :: norm, rho, rho_start, rho_next, ratio, descent, reduction, total(5)
      real(sp) :: alpha, beta
      integer :: done
      logical :: pauses, drifts

      pauses = .false.
      norm = self%residual%r_norm
      done = iterations
      alpha = 0
      beta = real(self%direction_factor*(1/norm), sp)
      rho_start = 0
      reduction = max(0.5_wp*last, smallest_reduction)
      !$omp parallel if(self%preconditioner%order%phase(2) > 2) default(none) &
      !$omp shared(self, norm, x, last, pause_at, iterations) private(rho, rho_next, ratio, descent, drifts, total) &
      !$omp firstprivate(alpha, beta, rho_start, done, pauses, reduction)
      call start_pass(self, 1/norm, beta)
      if (self%is_deflated) call start_coarse(self, 1/norm, rho_start)
      do
         if (self%is_deflated) then
            call sweep_deflated(self, alpha, beta)
         else
            call sweep(self, done == iterations, alpha, beta)
         end if
         total = sum(self%sums, dim=2)
         done = done + 1
         !$omp master
         if (mod(done, check_every) == 0) self%stops = self%is_interrupted()
         !$omp end master
         !$omp barrier
         rho = total(1)
         if (.not. rho_start > 0) rho_start = rho
         alpha = 0
         descent = rho
         if (self%is_deflated) descent = total(5)
         if (total(2) > least_curvature*rho) alpha = real(descent/total(2), sp)
         rho_next = rho - 2*alpha*total(3) + real(alpha, wp)**2*total(4)
         ! the first directions contain that of the pass before
         drifts = descent < least_share*rho .and. done > iterations + 2
         if (.not. rho_next > reduction**2*rho_start) then
            if (.not. is_near(0.5_wp*last, rho_next, rho_start, done - iterations)) exit
            reduction = 0.5_wp*last
         end if
         if (.not. rho_next < divergence*rho_start) exit
         if (drifts) exit
         if (rho_next <= pause_at**2*rho_start) then
            ratio = 0.5_wp*log(rho_next/rho_start)
            pauses = is_long(done - iterations, -ratio, ratio - log(last))
            if (pauses) exit
         end if
         if (done >= self%max_iterations .or. self%stops .or. .not. alpha > 0) exit
         beta = real(rho_next/rho, sp)
      end do
      call add_correction(self, norm, alpha, x)
      !$omp single
      iterations = done
      self%pauses = pauses
      self%direction_factor = 0
      if (alpha > 0 .and. rho_next > 0 .and. rho_next < rho_start .and. .not. drifts) &
         self%direction_factor = norm*rho_next/rho
      !$omp end single
      !$omp end parallel
   end subroutine correct

   !> Does a pass that has reduced its residual by much reach the end of the solve in a few more iterations?
   pure logical function is_near(last, rho, rho_start, iterations)
      real(wp), intent(in) :: last               !! reduction at which the solve ends
      real(wp), intent(in) :: rho, rho_start     !! squares of the residual now and at the start of the pass
      integer, intent(in) :: iterations          !! so far
      real(wp) :: gained
      is_near = .false.
      if (.not. (last >= last_reduction .and. rho > last**2*rho_start)) return
      gained = 0.5_wp*log(rho_start/rho)
      is_near = (-log(last) - gained)*iterations <= iterations_of_pass*gained
   end function is_near

   !> Has a pass taken many iterations, and are as many left to the end of the solve?
   pure logical function is_long(iterations, gained, left)
      integer, intent(in) :: iterations
      real(wp), intent(in) :: gained, left    !! logarithms of the residual's reduction
      is_long = iterations >= many_iterations .and. iterations*left > many_iterations*gained
   end function is_long

   !> Start a pass with the scaled residual, of order one, and with the first direction. Called by all threads.
   subroutine start_pass(self, weight, beta)
      class(pcg_solver_type), intent(inout) :: self
      real(wp), intent(in) :: weight      !! of the residual
      real(sp), intent(in) :: beta        !! factor of the last direction, 0: none
      integer :: phase, c
      associate (order => self%preconditioner%order)
         do phase = 1, 3
            !$omp do schedule(static)
            do c = order%phase(phase), order%phase(phase + 1) - 1
               call start_chunk(self%preconditioner, c, weight, self%residual%r, self%r)
               call set_vectors(order%first(c), order%first(c + 1) - 1)
            end do
            !$omp end do
         end do
      end associate

   contains

      !> The other vectors of some of the rows.
      subroutine set_vectors(first, last)
         integer, intent(in) :: first, last
         self%d(:, first:last) = 0
         if (self%is_deflated) then
            self%q(:, first:last) = 0
            if (.not. beta > 0) self%p(:, first:last) = 0
            if (.not. beta > 0) self%t(:, first:last) = 0
         else if (beta > 0) then
            self%p(:, first:last) = self%r(:, first:last) + beta*self%p(:, first:last)
         else
            self%p(:, first:last) = self%r(:, first:last)
         end if
      end subroutine set_vectors

   end subroutine start_pass

   !> Update the vectors with the last step length and direction, but in the first sweep of a pass, and apply the
   !> operator to the new direction. Called by all threads.
   !>
   !>     phase         3    2    1    2    3
   !>     backward      x    x    x                  phase 1: backward and forward while its vectors are in the cache
   !>     forward                 x    x    x
   subroutine sweep(self, is_first, alpha, beta)
      class(pcg_solver_type), intent(inout) :: self
      logical, intent(in) :: is_first        !! of the pass
      real(sp), intent(in) :: alpha, beta    !! step length, factor of the last direction
      integer :: phase, c
      associate (m => self%preconditioner, order => self%preconditioner%order)
         do phase = 3, 2, -1
            !$omp do schedule(static)
            do c = order%phase(phase), order%phase(phase + 1) - 1
               call go_backward(c)
            end do
            !$omp end do
         end do
         !$omp do schedule(static)
         do c = order%phase(1), order%phase(2) - 1
            call go_backward(c)
            if (m%has_sweeps) call sweep_forward(m, c, self%r, self%p, self%t, self%q, self%sums(1:4, c))
         end do
         !$omp end do
         do phase = merge(2, 1, m%has_sweeps), 3
            !$omp do schedule(static)
            do c = order%phase(phase), order%phase(phase + 1) - 1
               call sweep_forward(m, c, self%r, self%p, self%t, self%q, self%sums(1:4, c))
            end do
            !$omp end do
         end do
      end associate

   contains

      !> t := (I + L)^-T p of one chunk.
      subroutine go_backward(c)
         integer, intent(in) :: c            !! chunk
         associate (m => self%preconditioner)
            if (is_first) then
               call sweep_backward(m, c, self%p, self%t, self%back_sum(1, own_sums(self)))
            else
               call update_and_sweep_backward(m, c, alpha, beta, self%q, self%t, self%d, self%r, self%p, &
                                              self%back_sum(1, own_sums(self)))
            end if
         end associate
      end subroutine go_backward

   end subroutine sweep

   !> Begin a deflated pass with the exact correction in the coarse space, d := Z a. Called by all threads.
   subroutine start_coarse(self, weight, square)
      class(pcg_solver_type), intent(inout) :: self
      real(wp), intent(in) :: weight      !! of the residual
      real(wp), intent(out) :: square     !! r r before
      integer :: phase, c, g
      associate (m => self%preconditioner, order => self%preconditioner%order)
         !$omp do schedule(static)
         do g = 1, self%deflation%n_groups
            call self%deflation%restrict_residual(order, self%residual%r, weight, g)
         end do
         !$omp end do
         !$omp single
         call self%deflation%solve_coarse(-1.0_wp)
         !$omp end single
         do phase = 1, 3
            !$omp do schedule(static)
            do c = order%phase(phase), order%phase(phase + 1) - 1
               associate (first => order%first(c), last => order%first(c + 1) - 1)
                  self%s(:, first:last) = 0
                  call subtract_coarse(m, self%deflation, c, self%d, self%s)
                  call sweep_forward(m, c, self%r, self%s, self%d, self%q, self%sums(1:4, c))
                  self%sums(1, c) = sum(real(self%r(:, first:last), wp)**2)
                  self%r(:, first:last) = self%r(:, first:last) - (self%q(:, first:last) + self%d(:, first:last))
               end associate
            end do
            !$omp end do
         end do
      end associate
      square = sum(self%sums(1, :))
      !$omp barrier
   end subroutine start_coarse

   !> `sweep` for directions without motions of the coarse space: s = (I + L)^-T r, then t := s + beta t - Z a and p so
   !> that t = (I + L)^-T p. Called by all threads.
   subroutine sweep_deflated(self, alpha, beta)
      class(pcg_solver_type), intent(inout) :: self
      real(sp), intent(in) :: alpha, beta    !! step length, factor of the last direction
      integer :: phase, c, g
      associate (m => self%preconditioner, order => self%preconditioner%order)
         do phase = 3, 1, -1
            !$omp do schedule(static)
            do c = order%phase(phase), order%phase(phase + 1) - 1
               call update_chunk(m, c, alpha, beta, self%q, self%t, self%d, self%r, self%p)
               call sweep_backward(m, c, self%r, self%s, self%back_sum(1, own_sums(self)))
            end do
            !$omp end do
         end do
         !$omp do schedule(static)
         do g = 1, self%deflation%n_groups
            call self%deflation%restrict_sweep(self%s, g)
         end do
         !$omp end do
         !$omp single
         call self%deflation%solve_coarse(1.0_wp)
         !$omp end single
         do phase = 1, 3
            !$omp do schedule(static)
            do c = order%phase(phase), order%phase(phase + 1) - 1
               associate (first => order%first(c), last => order%first(c + 1) - 1)
                  self%t(:, first:last) = self%s(:, first:last) + beta*self%t(:, first:last)
               end associate
               call subtract_coarse(m, self%deflation, c, self%t, self%p)
               self%sums(5, c) = sum(real(self%r(:, order%first(c):order%first(c + 1) - 1), wp) &
                                     *self%p(:, order%first(c):order%first(c + 1) - 1))
               call sweep_forward(m, c, self%r, self%p, self%t, self%q, self%sums(1:4, c))
            end do
            !$omp end do
         end do
      end associate
   end subroutine sweep_deflated

   !> x := x + norm G^-T (d + alpha t). Called by all threads.
   subroutine add_correction(self, norm, alpha, x)
      class(pcg_solver_type), intent(in) :: self
      real(wp), intent(in) :: norm
      real(sp), intent(in) :: alpha
      real(wp), intent(inout), contiguous :: x(:, :)   !! (6, n)
      integer :: c
      !$omp do schedule(static)
      do c = 1, self%preconditioner%order%n_chunks
         call add_chunk(self%preconditioner, c, norm, alpha, self%d, self%t, x)
      end do
      !$omp end do
   end subroutine add_correction

end module rockdda_linear_pcg
