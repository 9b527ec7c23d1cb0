! SPDX-License-Identifier: MIT
!> Preconditioned conjugate gradients on the block matrix, warm-started.
!>
!> The preconditioner M = (D~ + L) D~^-1 (D~ + L)^T of rockdda_linear_splitting is applied on both sides, as
!> Eisenstat (1981, SIAM J. Sci. Stat. Comput. 2, 1-4) does it: in the scaled variables of the splitting one
!> step needs
!>
!>     t = (I + L)^-T p,    q = t + (I + L)^-1 (p + N t),
!>
!> that is one backward and one forward sweep, instead of a product and two sweeps. The sums that the next step length
!> needs are taken in the forward sweep, so that a group of blocks is updated, swept backward and, where nothing else
!> depends on it, forward again while its vectors are in the cache; there is one place per iteration where all
!> groups have to meet. (The norm of the residual to come follows from the sums, |r - a v|^2 = r r - 2 a r v + a^2 v v;
!> it is only used for the direction and to stop, and the true norm is taken in the next sweep.)
!>
!> The iteration works in single precision on the correction K d = r; after each pass r = f - K x is computed
!> in working precision, and x is accepted by that residual alone. The next pass goes on from the last direction of the
!> one before, so that nothing of what the iteration has found is lost. All sums are taken group by group, in order,
!> so the result does not depend on the number of threads.
module rockdda_linear_pcg
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type
   use rockdda_base_strings, only : to_string
   use rockdda_linear_matrix, only : block_matrix_type
   use rockdda_linear_solver, only : linear_solver_type, solve_report_type
   use rockdda_linear_residual, only : residual_type
   use rockdda_linear_splitting, only : splitting_type
   use rockdda_linear_kernels, only : sp, subtract_products, subtract_transposed, go_on
   implicit none
   private
   public :: pcg_solver_type

   type, extends(linear_solver_type) :: pcg_solver_type
      real(wp) :: tolerance = 1.0e-10_wp   !! wanted relative residual, see rockdda_linear_residual
      integer :: max_iterations = 3000
      integer :: passes = 0                !! passes of the last solve
      logical, private :: stops = .false.  !! a stop was requested during the last solve
      real(wp) :: first_residual = 0       !! relative residual that the last solve began with
      logical, private :: stale = .true.   !! the splitting is not that of the graph
      integer, private :: values_id = 0    !! matrix whose splitting is at hand, 0 none
      integer, private :: most = 0         !! iterations that a solve with this splitting or those it came from needed
      real(wp), private :: growth = 0      !! what the next direction takes of the last one, in its units; 0: nothing
      type(residual_type) :: residual
      type(splitting_type) :: splitting
      real(sp), allocatable :: p(:, :), q(:, :), r(:, :), t(:, :), d(:, :)  !! (6, n) in the splitting's order
      real(sp), allocatable :: handed(:, :)  !! (12, n) what the backward sweep hands on, see rockdda_linear_kernels
      real(wp), allocatable :: sums(:, :)  !! (4, groups) r r, p v, r v, v v with v = q + t
   contains
      procedure :: solve => solve_pcg
      procedure :: name => name_pcg
   end type pcg_solver_type

   !> What one pass gains at most: with more, the rounding of single precision costs more iterations than a restart.
   real(wp), parameter :: smallest_reduction = 1.0e-5_wp
   !> Squared growth of the residual, and curvature of a direction, that no positive definite matrix shows here: the
   !> pass ends before single precision overflows, and the residual in double precision tells the outcome.
   real(wp), parameter :: divergence = 1.0e12_wp, least_curvature = 1.0e-12_wp

   !> With pivots of changed rows only, the preconditioner is a little worse. Where a solve takes more iterations than
   !> this, that costs more than setting all of it up again.
   integer, parameter :: few_iterations = 20
   !> Iterations between two checks for a request to stop.
   integer, parameter :: check_every = 16

contains

   !> Solve K x = f from the guess in x.
   subroutine solve_pcg(self, matrix, f, x, report, error)
      class(pcg_solver_type), intent(inout) :: self
      type(block_matrix_type), intent(in) :: matrix
      real(wp), intent(in), contiguous :: f(:, :)     !! (6, n)
      real(wp), intent(inout), contiguous :: x(:, :)  !! (6, n)
      type(solve_report_type), intent(out) :: report
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: relative, before
      logical :: done, few

      call self%residual%start(matrix, f, self%reference_load, x, report, done, error)
      self%first_residual = 0
      self%stale = self%stale .or. self%residual%new_graph
      if (done .or. allocated(error)) return
      call self%residual%evaluate_again(matrix, f, x, relative)
      if (.not. relative <= self%residual%from_zero) then
         ! a guess worse than none
         x = 0
         call self%residual%evaluate(matrix, f, x, relative)
      end if
      self%first_residual = relative
      self%passes = 0
      self%growth = 0
      self%stops = .false.
      if (relative > self%tolerance) then
         if (self%stale) then
            call self%splitting%set_pattern(self%residual%graph)
            call make_room(self)
            self%stale = .false.
            self%values_id = 0
         end if
         if (matrix%values_id == 0 .or. matrix%values_id /= self%values_id) then
            few = matrix%base_id /= 0 .and. matrix%base_id == self%values_id .and. self%most <= few_iterations
            call self%splitting%set_values(matrix, few)
            if (.not. few) self%most = 0
         end if
         self%values_id = matrix%values_id
      end if
      do while (relative > self%tolerance .and. report%iterations < self%max_iterations)
         before = relative
         self%passes = self%passes + 1
         call correct(self, max(0.5_wp*self%tolerance/relative, smallest_reduction), x, report%iterations)
         report%interrupted = self%stops
         if (report%interrupted) return
         call self%residual%evaluate(matrix, f, x, relative)
         if (.not. relative < 0.5_wp*before) exit
      end do
      self%most = max(self%most, report%iterations)
      call self%residual%judge(matrix, f, x, relative, self%tolerance, report)
      if (.not. report%converged) report%detail = 'PCG after '//to_string(report%iterations)// &
         ' iterations: '//report%detail
   end subroutine solve_pcg

   !> One pass: x := x + d with K d = r, r reduced by the given factor in the preconditioned norm.
   subroutine correct(self, reduction, x, iterations)
      class(pcg_solver_type), intent(inout) :: self
      real(wp), intent(in) :: reduction
      real(wp), intent(inout), contiguous :: x(:, :)   !! (6, n)
      integer, intent(inout) :: iterations             !! counts on
      real(wp) :: norm, rho, rho_start, rho_next, weight, total(4)
      real(sp) :: alpha, beta
      integer :: i, m, phase, done

      ! residual of order one, in the variables of the splitting
      norm = self%residual%r_norm
      weight = 1/norm
      done = iterations
      alpha = 0
      beta = real(self%growth*weight, sp)
      rho_start = 0
      !$omp parallel if(self%splitting%phase(2) > 2) default(none) &
      !$omp shared(self, weight, norm, x, reduction, iterations) &
      !$omp private(i, m, phase, rho, rho_next, total) firstprivate(alpha, beta, rho_start, done)
      do phase = 1, 3
         !$omp do schedule(static)
         do m = self%splitting%phase(phase), self%splitting%phase(phase + 1) - 1
            call begin_group(self, m, weight)
         end do
         !$omp end do
      end do
      do
         do phase = 3, 2, -1
            !$omp do schedule(static)
            do m = self%splitting%phase(phase), self%splitting%phase(phase + 1) - 1
               call sweep_backward(self%splitting, m, alpha, beta, self%q, self%d, self%r, self%p, self%t, &
                                self%handed, self%sums(1, m))
            end do
            !$omp end do
         end do
         !$omp do schedule(static)
         do m = self%splitting%phase(1), self%splitting%phase(2) - 1
            call sweep_backward(self%splitting, m, alpha, beta, self%q, self%d, self%r, self%p, self%t, &
                                self%handed, self%sums(1, m))
            if (self%splitting%has_sweeps) call sweep_forward(self%splitting, m, self%r, self%p, self%t, self%q, &
                                                              self%sums(2:4, m))
         end do
         !$omp end do
         do phase = merge(2, 1, self%splitting%has_sweeps), 3
            !$omp do schedule(static)
            do m = self%splitting%phase(phase), self%splitting%phase(phase + 1) - 1
               call sweep_forward(self%splitting, m, self%r, self%p, self%t, self%q, self%sums(2:4, m))
            end do
            !$omp end do
         end do
         total = sum(self%sums, dim=2)
         done = done + 1
         !$omp master
         if (mod(done, check_every) == 0) self%stops = self%is_interrupted()
         !$omp end master
         !$omp barrier
         rho = total(1)
         if (.not. rho_start > 0) rho_start = rho
         alpha = 0
         if (total(2) > least_curvature*rho) alpha = real(rho/total(2), sp)
         rho_next = rho - 2*alpha*total(3) + real(alpha, wp)**2*total(4)
         if (.not. (rho_next > reduction**2*rho_start .and. rho_next < divergence*rho_start)) exit
         if (done >= self%max_iterations .or. self%stops .or. .not. alpha > 0) exit
         beta = real(rho_next/rho, sp)
      end do
      !$omp do schedule(static)
      do i = 1, self%splitting%n
         call add_correction(norm, self%d(:, i) + alpha*self%t(:, i), self%splitting%scale(:, :, i), &
                             x(:, self%splitting%order(i)))
      end do
      !$omp end do
      !$omp single
      iterations = done
      self%growth = 0
      if (alpha > 0 .and. rho_next > 0 .and. rho_next < rho_start) self%growth = norm*rho_next/rho
      !$omp end single
      !$omp end parallel
   end subroutine correct

   !> x := x + norm G^-T d for one block.
   pure subroutine add_correction(norm, d, scale, x)
      real(wp), intent(in) :: norm
      real(sp), intent(in) :: d(6)
      real(wp), intent(in) :: scale(6, 6)      !! G^-1, lower triangle
      real(wp), intent(inout) :: x(6)
      real(wp) :: v(6)
      integer :: j
      v = norm*real(d, wp)
      do j = 1, 6
         x(j) = x(j) + ((scale(1, j)*v(1) + scale(2, j)*v(2)) + (scale(3, j)*v(3) + scale(4, j)*v(4)) &
                        + (scale(5, j)*v(5) + scale(6, j)*v(6)))
      end do
   end subroutine add_correction

   !> The residual of one group in the variables of the splitting, r := (I + L)^-1 G^-1 r, and no correction yet.
   subroutine begin_group(self, m, weight)
      class(pcg_solver_type), intent(inout) :: self
      integer, intent(in) :: m            !! group
      real(wp), intent(in) :: weight      !! of the residual
      real(sp) :: b(6), sums(4, 3)
      integer :: i
      associate (s => self%splitting)
         do i = s%group(m), s%group(m + 1) - 1
            associate (g => s%scale(:, :, i), r => self%residual%r(:, s%order(i)))
               b = real(weight*((g(:, 1)*r(1) + g(:, 2)*r(2)) + (g(:, 3)*r(3) + g(:, 4)*r(4)) &
                                + (g(:, 5)*r(5) + g(:, 6)*r(6))), sp)
            end associate
            if (s%has_sweeps) then
               sums = 0
               call subtract_products(s%before_start(i), s%before_start(i + 1) - 1, s%before_column, s%before, self%r, &
                                      sums)
               b = b + gathered(sums)
            end if
            self%r(:, i) = b
            self%d(:, i) = 0
            if (.not. self%growth > 0) self%p(:, i) = 0
            self%q(:, i) = 0
            self%t(:, i) = 0
         end do
      end associate
   end subroutine begin_group

   !> In one group: d := d + alpha t, r := r - alpha (q + t), then p := r + beta p and t := (I + L)^-T p.
   pure subroutine sweep_backward(s, m, alpha, beta, q, d, r, p, t, handed, square)
      type(splitting_type), intent(in) :: s
      integer, intent(in) :: m                     !! group
      real(sp), intent(in) :: alpha, beta
      real(sp), intent(in) :: q(6, *)
      real(sp), intent(inout) :: d(6, *), r(6, *), p(6, *), t(6, *)
      real(sp), intent(inout) :: handed(12, *)     !! work
      real(wp), intent(out) :: square              !! sum of r r
      real(sp) :: b(6), sums(4, 3), twice(4, 3)
      real(wp) :: lane(6)
      integer :: first, last, i
      first = s%group(m)
      last = s%group(m + 1) - 1
      square = 0
      if (first > last) return
      lane = 0
      call go_on(6*(last - first + 1), alpha, beta, q(1, first), t(1, first), d(1, first), r(1, first), p(1, first))
      do i = first, last
         lane = lane + real(r(:, i), wp)**2
      end do
      square = sum(lane)
      if (.not. s%has_sweeps) then
         t(:, first:last) = p(:, first:last)
         return
      end if
      handed(:, first:last) = 0
      do i = last, first, -1
         b = p(:, i) + (handed(1:11:2, i) + handed(2:12:2, i))
         if (s%after_start(i) < s%after_start(i - 1)) then
            sums = 0
            call subtract_products(s%after_start(i), s%after_start(i - 1) - 1, s%after_column, s%after, t, sums)
            b = b + gathered(sums)
         end if
         t(:, i) = b
         twice(1:2, 1) = b(1:2)
         twice(3:4, 1) = b(1:2)
         twice(1:2, 2) = b(3:4)
         twice(3:4, 2) = b(3:4)
         twice(1:2, 3) = b(5:6)
         twice(3:4, 3) = b(5:6)
         call subtract_transposed(s%own_start(i), s%before_start(i + 1) - 1, s%before_column, s%before, twice, handed)
      end do
   end subroutine sweep_backward

   !> In one group: q := (I + L)^-1 (p + N t).
   pure subroutine sweep_forward(s, m, r, p, t, q, total)
      type(splitting_type), intent(in) :: s
      integer, intent(in) :: m                     !! group
      real(sp), intent(in) :: r(6, *), p(6, *), t(6, *)
      real(sp), intent(inout) :: q(6, *)
      real(wp), intent(out) :: total(3)            !! p v, r v, v v with v = q + t
      real(sp) :: sums(4, 3)
      real(wp) :: v(6), lane(6, 3)
      integer :: i
      do i = s%group(m), s%group(m + 1) - 1
         sums = 0
         if (s%has_sweeps) then
            call subtract_products(1, 1, [1], s%rest(:, i), t(:, i), sums)
            call subtract_products(s%before_start(i), s%before_start(i + 1) - 1, s%before_column, s%before, q, sums)
         else
            call subtract_products(s%before_start(i), s%before_start(i + 1) - 1, s%before_column, s%before, t, sums)
            call subtract_products(s%after_start(i), s%after_start(i - 1) - 1, s%after_column, s%after, t, sums)
            sums = -sums
            call subtract_products(1, 1, [1], s%rest(:, i), t(:, i), sums)
         end if
         q(:, i) = p(:, i) + gathered(sums)
      end do
      lane = 0
      do i = s%group(m), s%group(m + 1) - 1
         v = real(q(:, i) + t(:, i), wp)
         lane(:, 1) = lane(:, 1) + real(p(:, i), wp)*v
         lane(:, 2) = lane(:, 2) + real(r(:, i), wp)*v
         lane(:, 3) = lane(:, 3) + v*v
      end do
      total = sum(lane, dim=1)
   end subroutine sweep_forward

   !> The vector that lanes add up to.
   pure function gathered(sums) result(b)
      real(sp), intent(in) :: sums(4, 3)
      real(sp) :: b(6)
      b(1:2) = sums(1:2, 1) + sums(3:4, 1)
      b(3:4) = sums(1:2, 2) + sums(3:4, 2)
      b(5:6) = sums(1:2, 3) + sums(3:4, 3)
   end function gathered

   !> Make the vectors fit the splitting.
   subroutine make_room(self)
      type(pcg_solver_type), intent(inout) :: self
      if (allocated(self%sums)) deallocate (self%sums)
      allocate (self%sums(4, self%splitting%n_groups))
      if (allocated(self%p)) then
         if (size(self%p, 2) == self%splitting%n) return
         deallocate (self%p, self%q, self%r, self%t, self%d, self%handed)
      end if
      associate (n => self%splitting%n)
         allocate (self%p(6, n), self%q(6, n), self%r(6, n), self%t(6, n), self%d(6, n), self%handed(12, n))
      end associate
   end subroutine make_room

   !> Name as in the options.
   pure function name_pcg(self) result(name)
      class(pcg_solver_type), intent(in) :: self
      character(len=:), allocatable :: name
      name = 'pcg'
      associate (unused => self%tolerance)
      end associate
   end function name_pcg

end module rockdda_linear_pcg
