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
!> in working precision, and x is accepted by that residual alone. All sums are taken group by group, in order,
!> so the result does not depend on the number of threads.
module rockdda_linear_pcg
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type
   use rockdda_base_strings, only : to_string
   use rockdda_linear_matrix, only : block_matrix_type
   use rockdda_linear_solver, only : linear_solver_type, solve_report_type
   use rockdda_linear_residual, only : residual_type
   use rockdda_linear_splitting, only : splitting_type, sp
   implicit none
   private
   public :: pcg_solver_type

   type, extends(linear_solver_type) :: pcg_solver_type
      real(wp) :: tolerance = 1.0e-10_wp   !! wanted relative residual, see rockdda_linear_residual
      integer :: max_iterations = 3000
      integer :: passes = 0                !! passes of the last solve
      real(wp) :: first_residual = 0       !! relative residual that the last solve began with
      logical, private :: stale = .true.   !! the splitting is not that of the graph
      integer, private :: values_id = 0    !! matrix whose splitting is at hand, 0 none
      integer, private :: most = 0         !! iterations that a solve with this splitting or those it came from needed
      type(residual_type) :: residual
      type(splitting_type) :: splitting
      real(sp), allocatable :: p(:, :), q(:, :), r(:, :), t(:, :), d(:, :)  !! (6, n) in the splitting's order
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
      beta = 0
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
                                self%sums(1, m))
            end do
            !$omp end do
         end do
         !$omp do schedule(static)
         do m = self%splitting%phase(1), self%splitting%phase(2) - 1
            call sweep_backward(self%splitting, m, alpha, beta, self%q, self%d, self%r, self%p, self%t, &
                                self%sums(1, m))
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
         !$omp barrier
         done = done + 1
         rho = total(1)
         if (.not. rho_start > 0) rho_start = rho
         alpha = 0
         if (total(2) > least_curvature*rho) alpha = real(rho/total(2), sp)
         rho_next = rho - 2*alpha*total(3) + real(alpha, wp)**2*total(4)
         if (.not. (rho_next > reduction**2*rho_start .and. rho_next < divergence*rho_start)) exit
         if (done >= self%max_iterations .or. .not. alpha > 0) exit
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
      real(sp) :: b(6)
      integer :: i
      associate (s => self%splitting)
         do i = s%group(m), s%group(m + 1) - 1
            associate (g => s%scale(:, :, i), r => self%residual%r(:, s%order(i)))
               b = real(weight*((g(:, 1)*r(1) + g(:, 2)*r(2)) + (g(:, 3)*r(3) + g(:, 4)*r(4)) &
                                + (g(:, 5)*r(5) + g(:, 6)*r(6))), sp)
            end associate
            if (s%has_sweeps) call subtract_row(s%before_start(i), s%before_start(i + 1) - 1, s%before_column, &
                                                s%before, self%r, b)
            self%r(:, i) = b
            self%d(:, i) = 0
            self%p(:, i) = 0
            self%q(:, i) = 0
            self%t(:, i) = 0
         end do
      end associate
   end subroutine begin_group

   !> In one group: d := d + alpha t, r := r - alpha (q + t), then p := r + beta p and t := (I + L)^-T p.
   pure subroutine sweep_backward(s, m, alpha, beta, q, d, r, p, t, square)
      type(splitting_type), intent(in) :: s
      integer, intent(in) :: m                     !! group
      real(sp), intent(in) :: alpha, beta
      real(sp), intent(in) :: q(6, *)
      real(sp), intent(inout) :: d(6, *), r(6, *), p(6, *), t(6, *)
      real(wp), intent(out) :: square              !! sum of r r
      real(sp) :: b(6)
      real(wp) :: lane(6)
      integer :: i
      lane = 0
      do i = s%group(m + 1) - 1, s%group(m), -1
         d(:, i) = d(:, i) + alpha*t(:, i)
         b = r(:, i) - alpha*(q(:, i) + t(:, i))
         r(:, i) = b
         lane = lane + real(b, wp)**2
         b = b + beta*p(:, i)
         p(:, i) = b
         if (s%has_sweeps) call subtract_row(s%after_start(i), s%after_start(i - 1) - 1, s%after_column, s%after, t, b)
         t(:, i) = b
      end do
      square = sum(lane)
   end subroutine sweep_backward

   !> In one group: q := (I + L)^-1 (p + N t).
   pure subroutine sweep_forward(s, m, r, p, t, q, sums)
      type(splitting_type), intent(in) :: s
      integer, intent(in) :: m                     !! group
      real(sp), intent(in) :: r(6, *), p(6, *), t(6, *)
      real(sp), intent(inout) :: q(6, *)
      real(wp), intent(out) :: sums(3)             !! p v, r v, v v with v = q + t
      real(sp) :: b(6)
      real(wp) :: v(6), lane(6, 3)
      integer :: i
      lane = 0
      do i = s%group(m), s%group(m + 1) - 1
         b = -p(:, i)
         call subtract_row(1, 1, [1], s%rest(:, i), t(:, i), b)
         if (s%has_sweeps) then
            b = -b
            call subtract_row(s%before_start(i), s%before_start(i + 1) - 1, s%before_column, s%before, q, b)
         else
            call subtract_row(s%before_start(i), s%before_start(i + 1) - 1, s%before_column, s%before, t, b)
            call subtract_row(s%after_start(i), s%after_start(i - 1) - 1, s%after_column, s%after, t, b)
            b = -b
         end if
         q(:, i) = b
         v = real(b + t(:, i), wp)
         lane(:, 1) = lane(:, 1) + real(p(:, i), wp)*v
         lane(:, 2) = lane(:, 2) + real(r(:, i), wp)*v
         lane(:, 3) = lane(:, 3) + v*v
      end do
      sums = sum(lane, dim=1)
   end subroutine sweep_forward

   !> b := b - sum over the couplings first to last of a x, with blocks laid out as in rockdda_linear_splitting.
   pure subroutine subtract_row(first, last, column, a, x, b)
      integer, intent(in) :: first, last           !! couplings of the row
      integer, intent(in) :: column(*)
      real(sp), intent(in) :: a(36, *), x(6, *)
      real(sp), intent(inout) :: b(6)
      real(sp) :: upper(4), lower(4)               ! lower holds rows 5 and 6 twice: of odd and of even columns
      integer :: k, j
      upper = b(1:4)
      lower = 0
      do k = first, last
         j = column(k)
         associate (x1 => x(1, j), x2 => x(2, j), x3 => x(3, j), x4 => x(4, j), x5 => x(5, j), x6 => x(6, j))
            upper = upper - ((a(1:4, k)*x1 + a(5:8, k)*x2) + (a(9:12, k)*x3 + a(13:16, k)*x4) &
                             + (a(17:20, k)*x5 + a(21:24, k)*x6))
            lower = lower - (a(25:28, k)*[x1, x1, x2, x2] + a(29:32, k)*[x3, x3, x4, x4] &
                             + a(33:36, k)*[x5, x5, x6, x6])
         end associate
      end do
      b(1:4) = upper
      b(5) = b(5) + (lower(1) + lower(3))
      b(6) = b(6) + (lower(2) + lower(4))
   end subroutine subtract_row

   !> Make the vectors fit the splitting.
   subroutine make_room(self)
      type(pcg_solver_type), intent(inout) :: self
      if (allocated(self%sums)) deallocate (self%sums)
      allocate (self%sums(4, self%splitting%n_groups))
      if (allocated(self%p)) then
         if (size(self%p, 2) == self%splitting%n) return
         deallocate (self%p, self%q, self%r, self%t, self%d)
      end if
      associate (n => self%splitting%n)
         allocate (self%p(6, n), self%q(6, n), self%r(6, n), self%t(6, n), self%d(6, n))
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
