! SPDX-License-Identifier: MIT
!> Preconditioned conjugate gradients on the block matrix, warm-started.
!>
!> The preconditioner M = (D~ + L) D~^-1 (D~ + L)^T of rockdda_linear_splitting is applied on both sides, as
!> Eisenstat (1981, SIAM J. Sci. Stat. Comput. 2, 1-4) does it: in the scaled variables of the splitting one
!> step needs
!>
!>     t = (I + L)^-T p,    q = t + (I + L)^-1 (p + N t),
!>
!> that is one backward and one forward sweep, instead of a product and two sweeps.
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
   use rockdda_linear_graph, only : graph_type
   use rockdda_linear_splitting, only : splitting_type, sp
   implicit none
   private
   public :: pcg_solver_type

   type, extends(linear_solver_type) :: pcg_solver_type
      real(wp) :: tolerance = 1.0e-10_wp   !! wanted relative residual, see rockdda_linear_residual
      integer :: max_iterations = 3000
      integer :: passes = 0                !! passes of the last solve
      type(residual_type) :: residual
      type(graph_type) :: graph
      type(splitting_type) :: splitting
      real(sp), allocatable :: p(:, :), q(:, :), r(:, :), t(:, :), d(:, :)  !! (6, n) in the splitting's order
      real(wp), allocatable :: partial(:)  !! (groups) sums
   contains
      procedure :: solve => solve_pcg
      procedure :: name => name_pcg
   end type pcg_solver_type

   !> What one pass gains at most: with more, the rounding of single precision costs more iterations than a restart.
   real(wp), parameter :: smallest_reduction = 1.0e-4_wp
   !> Squared growth of the residual, and curvature of a direction, that no positive definite matrix shows here: the
   !> pass ends before single precision overflows, and the residual in double precision tells the outcome.
   real(wp), parameter :: divergence = 1.0e12_wp, least_curvature = 1.0e-12_wp

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
      logical :: done, changed

      call self%residual%start(matrix, f, self%reference_load, x, report, done, error)
      if (done .or. allocated(error)) return
      call self%residual%evaluate(matrix, f, x, relative)
      if (.not. relative <= self%residual%from_zero) then
         ! a guess worse than none
         x = 0
         call self%residual%evaluate(matrix, f, x, relative)
      end if
      self%passes = 0
      if (relative > self%tolerance) then
         call self%graph%update(matrix, changed)
         if (changed) then
            call self%splitting%set_pattern(self%graph)
            call make_room(self)
         end if
         call self%splitting%set_values(matrix)
      end if
      do while (relative > self%tolerance .and. report%iterations < self%max_iterations)
         before = relative
         self%passes = self%passes + 1
         call correct(self, max(0.5_wp*self%tolerance/relative, smallest_reduction), x, report%iterations)
         call self%residual%evaluate(matrix, f, x, relative)
         if (.not. relative < 0.5_wp*before) exit
      end do
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
      real(wp) :: norm, rho, rho_start, rho_new, pq, weight
      real(sp) :: alpha, beta
      integer :: i, m, phase
      logical :: go_on

      ! residual of order one, in the variables of the splitting
      norm = self%residual%norm(self%residual%r)
      weight = 1/norm
      go_on = .true.
      rho = 0
      beta = 0
      !$omp parallel if(self%splitting%phase(2) > 2) default(none) &
      !$omp shared(self, weight, norm, x, reduction, iterations) &
      !$omp private(i, m, phase, rho_start, rho_new, pq, alpha) firstprivate(rho, beta, go_on)
      !$omp do schedule(static)
      do m = 1, self%splitting%n_groups
         do i = self%splitting%group(m), self%splitting%group(m + 1) - 1
            self%r(:, i) = real(weight*matmul(self%splitting%scale(:, :, i), &
                                              self%residual%r(:, self%splitting%order(i))), sp)
            self%d(:, i) = 0
            self%p(:, i) = 0
         end do
      end do
      !$omp end do
      do phase = 1, 3
         !$omp do schedule(static)
         do m = self%splitting%phase(phase), self%splitting%phase(phase + 1) - 1
            call sweep_forward(self%splitting, m, self%r)
         end do
         !$omp end do
      end do
      !$omp do schedule(static)
      do m = 1, self%splitting%n_groups
         self%partial(m) = group_product(self%splitting, m, self%r, self%r)
      end do
      !$omp end do
      rho = sum(self%partial)
      rho_start = rho
      !$omp barrier
      do while (go_on)
         do phase = 3, 1, -1
            !$omp do schedule(static)
            do m = self%splitting%phase(phase), self%splitting%phase(phase + 1) - 1
               call sweep_backward(self%splitting, m, beta, self%r, self%p, self%t)
            end do
            !$omp end do
         end do
         do phase = 1, 3
            !$omp do schedule(static)
            do m = self%splitting%phase(phase), self%splitting%phase(phase + 1) - 1
               call apply_rest(self%splitting, m, self%p, self%t, self%q)
               call sweep_forward(self%splitting, m, self%q)
               self%partial(m) = curvature(self%splitting, m, self%t, self%p, self%q)
            end do
            !$omp end do
         end do
         pq = sum(self%partial)
         !$omp barrier
         alpha = 0
         if (pq > least_curvature*rho) alpha = real(rho/pq, sp)
         !$omp do schedule(static)
         do m = 1, self%splitting%n_groups
            self%partial(m) = step_group(self%splitting, m, alpha, self%t, self%q, self%d, self%r)
         end do
         !$omp end do
         rho_new = sum(self%partial)
         beta = 0
         if (rho > 0) beta = real(rho_new/rho, sp)
         rho = rho_new
         !$omp barrier
         !$omp single
         iterations = iterations + 1
         !$omp end single
         go_on = rho > reduction**2*rho_start .and. rho < divergence*rho_start .and. &
                 iterations < self%max_iterations .and. alpha > 0
         !$omp barrier
      end do
      !$omp do schedule(static)
      do i = 1, self%splitting%n
         x(:, self%splitting%order(i)) = x(:, self%splitting%order(i)) &
            + norm*matmul(real(self%d(:, i), wp), self%splitting%scale(:, :, i))
      end do
      !$omp end do
      !$omp end parallel
   end subroutine correct

   !> p := r + beta p, then t = (I + L)^-T p, in one group.
   pure subroutine sweep_backward(s, m, beta, r, p, t)
      type(splitting_type), intent(in) :: s
      integer, intent(in) :: m            !! group
      real(sp), intent(in) :: beta
      real(sp), intent(in), contiguous :: r(:, :)     !! (6, n)
      real(sp), intent(inout), contiguous :: p(:, :), t(:, :)
      real(sp) :: b(6)
      integer :: i, k
      do i = s%group(m + 1) - 1, s%group(m), -1
         b = r(:, i) + beta*p(:, i)
         p(:, i) = b
         if (s%has_sweeps) then
            do k = s%other_after(i), s%other_start(i + 1) - 1
               call subtract_product(s%other(:, :, k), t(:, s%other_column(k)), b)
            end do
            do k = s%upper_start(i), s%upper_start(i + 1) - 1
               call subtract_product(s%upper(:, :, k), t(:, s%upper_column(k)), b)
            end do
         end if
         t(:, i) = b
      end do
   end subroutine sweep_backward

   !> v := (I + L)^-1 v in one group. Each coupling is used where it is stored, in the row of the smaller block.
   pure subroutine sweep_forward(s, m, v)
      type(splitting_type), intent(in) :: s
      integer, intent(in) :: m                           !! group
      real(sp), intent(inout), contiguous :: v(:, :)     !! (6, n)
      real(sp) :: b(6)
      integer :: i, k
      if (.not. s%has_sweeps) return
      do i = s%group(m), s%group(m + 1) - 1
         b = v(:, i)
         do k = s%other_start(i), s%other_after(i) - 1
            call subtract_product(s%other(:, :, k), v(:, s%other_column(k)), b)
         end do
         v(:, i) = b
         do k = s%upper_start(i), s%upper_start(i + 1) - 1
            call subtract_transposed(s%upper(:, :, k), b, v(:, s%upper_column(k)))
         end do
      end do
   end subroutine sweep_forward

   !> q = p + N t in one group.
   pure subroutine apply_rest(s, m, p, t, q)
      type(splitting_type), intent(in) :: s
      integer, intent(in) :: m                                    !! group
      real(sp), intent(in), contiguous :: p(:, :), t(:, :)        !! (6, n)
      real(sp), intent(inout), contiguous :: q(:, :)
      real(sp) :: b(6)
      integer :: i, k
      do i = s%group(m), s%group(m + 1) - 1
         b = -p(:, i)
         call subtract_product(s%rest(:, :, i), t(:, i), b)
         if (.not. s%has_sweeps) then
            do k = s%other_start(i), s%other_start(i + 1) - 1
               call subtract_product(s%other(:, :, k), t(:, s%other_column(k)), b)
            end do
         end if
         q(:, i) = -b
      end do
   end subroutine apply_rest

   !> y := y - a x.
   pure subroutine subtract_product(a, x, y)
      real(sp), intent(in) :: a(6, 6), x(6)
      real(sp), intent(inout) :: y(6)
      y = y - ((a(:, 1)*x(1) + a(:, 2)*x(2)) + (a(:, 3)*x(3) + a(:, 4)*x(4)) + (a(:, 5)*x(5) + a(:, 6)*x(6)))
   end subroutine subtract_product

   !> y := y - a^T x.
   pure subroutine subtract_transposed(a, x, y)
      real(sp), intent(in) :: a(6, 6), x(6)
      real(sp), intent(inout) :: y(6)
      integer :: c
      do c = 1, 6
         y(c) = y(c) - ((a(1, c)*x(1) + a(2, c)*x(2)) + (a(3, c)*x(3) + a(4, c)*x(4)) + (a(5, c)*x(5) + a(6, c)*x(6)))
      end do
   end subroutine subtract_transposed

   !> Sum of p (q + t) over one group: q alone is what later groups still need.
   pure real(wp) function curvature(s, m, t, p, q) result(total)
      type(splitting_type), intent(in) :: s
      integer, intent(in) :: m                                         !! group
      real(sp), intent(in), contiguous :: t(:, :), p(:, :), q(:, :)    !! (6, n)
      real(wp) :: lane(6)
      integer :: i
      lane = 0
      do i = s%group(m), s%group(m + 1) - 1
         lane = lane + real(p(:, i), wp)*real(q(:, i) + t(:, i), wp)
      end do
      total = sum(lane)
   end function curvature

   !> Sum of a b over one group, in working precision.
   pure real(wp) function group_product(s, m, a, b) result(total)
      type(splitting_type), intent(in) :: s
      integer, intent(in) :: m                    !! group
      real(sp), intent(in), contiguous :: a(:, :), b(:, :)    !! (6, n)
      real(wp) :: lane(6)
      integer :: i
      lane = 0
      do i = s%group(m), s%group(m + 1) - 1
         lane = lane + real(a(:, i), wp)*real(b(:, i), wp)
      end do
      total = sum(lane)
   end function group_product

   !> d := d + alpha t, r := r - alpha (q + t) in one group; the result is the sum of r r.
   function step_group(s, m, alpha, t, q, d, r) result(total)
      type(splitting_type), intent(in) :: s
      integer, intent(in) :: m                      !! group
      real(sp), intent(in) :: alpha
      real(sp), intent(in), contiguous :: t(:, :), q(:, :)      !! (6, n)
      real(sp), intent(inout), contiguous :: d(:, :), r(:, :)   !! (6, n)
      real(wp) :: total, lane(6)
      integer :: i
      lane = 0
      do i = s%group(m), s%group(m + 1) - 1
         d(:, i) = d(:, i) + alpha*t(:, i)
         r(:, i) = r(:, i) - alpha*(q(:, i) + t(:, i))
         lane = lane + real(r(:, i), wp)**2
      end do
      total = sum(lane)
   end function step_group

   !> Make the vectors fit the splitting.
   subroutine make_room(self)
      type(pcg_solver_type), intent(inout) :: self
      if (allocated(self%partial)) deallocate (self%partial)
      allocate (self%partial(self%splitting%n_groups))
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
