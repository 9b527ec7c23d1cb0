! SPDX-License-Identifier: MIT
!> The choice between conjugate gradients and a direct solver, made by counting work.
!>
!> The work of a factorisation follows from the pattern, the iterations of PCG from the matrix: moving all blocks
!> together strains no contact, so that the force on block i in this motion, over the force that moves the block
!> alone,
!>
!>     rho_i = e^T sum_j K_ij e / e^T K_ii e,    e = (1, 1, 0, 0, 0, 0),
!>
!> is the share of inertia in the block's stiffness. With rho their geometric mean the condition number is about
!> 1/rho, and PCG needs about 0.36 ln(reduction)/sqrt(rho) iterations with the ic0 preconditioner (on brick
!> walls the factor is 0.32 to 0.41 for stiffness ratios from 1 to 100).
!>
!> This first estimate is then corrected by the iterations that PCG has actually needed. The reduction of the residual
!> is measured when the direct solver seems to be cheaper: at rest the last solution nearly meets the tolerance.
!> Even then PCG is tried first, with as many iterations as cost no more than the direct solve; after a failure it is
!> not tried again for a number of solves, which doubles with each failure.
!>
!> Where many iterations are expected, PCG has a coarse space (rockdda_linear_deflation): with it they hardly depend on
!> the matrix, and their number for each digit is remembered. The correction of the first estimate stays what it was.
!>
!> Solves that may pause need not gain all digits: the open-close iteration continues few of them to the end.
!>
!> A factor serves all solves with one matrix, of which the iteration for friction forces needs several; their recent
!> number enters the estimate, too.
!>
!> Systems of up to some hundred blocks have a direct solver of their own (rockdda_linear_block_cholesky). It costs so
!> little that PCG is not granted more iterations than cost as much, and that after a failure of PCG nothing is counted
!> until it is tried again.
!>
!> The choice depends on counts alone, and `pack` saves its state: the same solve makes the same choice on any machine
!> and after a restart. When PCG does not converge within its limit, the direct solver takes over. The choice stays as
!> long as the matrix does (values_id): a present factor is cheaper than any iteration.
module rockdda_linear_auto
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type
   use rockdda_base_strings, only : to_string
   use rockdda_linear_matrix, only : block_matrix_type, n_stored_blocks
   use rockdda_linear_solver, only : linear_solver_type, solve_report_type, solve_effort_type
   use rockdda_linear_direct, only : direct_solver_type
   use rockdda_linear_block_cholesky, only : most_blocks
   use rockdda_linear_pcg, only : pcg_solver_type, many_iterations
   implicit none
   private
   public :: auto_solver_type

   type, extends(linear_solver_type) :: auto_solver_type
      type(pcg_solver_type) :: pcg
      class(direct_solver_type), allocatable :: direct
      class(direct_solver_type), allocatable :: other   !! for small systems, or for large ones while `direct` is that
      integer :: direct_limit = huge(1)        !! models with more blocks never go to the direct solver
      logical, private :: is_small = .false.   !! `direct` is the solver for small systems
      real(wp), allocatable :: row_sum(:)     !! (n) work
      ! saved by `pack`
      real(wp), private :: correction = 1      !! recent iterations of PCG over those expected
      integer, private :: waiting = 0          !! direct solves before PCG is tried again
      integer, private :: last_wait = 0        !! length of the last wait
      real(wp), private :: reuse = 1           !! recent solves per matrix
      integer, private :: n_solves = 0         !! with the present matrix
      real(wp), private :: last_inertia = 0    !! share of inertia of the last matrix, 0: none
      real(wp), private :: per_digit = 1.5_wp  !! recent iterations with a coarse space for a reduction by e
      ! of the matrix solved last
      integer, private :: values_id = 0
      logical, private :: direct_was_used = .false.
      ! share of inertia, and the matrix it was measured of
      real(wp), private :: inertia = 1
      integer, private :: inertia_id = 0
   contains
      procedure :: solve => solve_auto
      procedure :: pack => pack_auto
      procedure :: unpack => unpack_auto
   end type auto_solver_type

   ! Work in units of 1 ns on the machine the constants were measured on; only their ratios matter.
   real(wp), parameter :: per_iteration = 25      !! PCG, for each stored block
   real(wp), parameter :: per_preparation = 350   !! PCG, for each stored block
   real(wp), parameter :: deflated_cost = 2.0_wp  !! both with a coarse space, over those without
   !> Iterations of PCG with the matrix of the solve before, over those of a first solve: the first guess is close.
   !> In small systems that change their states in many rounds it is not: of the jointed slope in `inputs` 0.6.
   real(wp), parameter :: follow_up = 0.15_wp, follow_up_of_small = 0.6_wp
   !> Up to this number of blocks the direct solver takes less than 0.1 ms for any matrix, and is exact to rounding.
   integer, parameter :: few_blocks = 30
   !> The analysis serves many solves. Without one the direct solver is chosen when PCG is expected to cost more than
   !> this for each block and sqrt(block).
   real(wp), parameter :: analysis_cost = 300, analysis_of_small = 150
   !> Iterations for a condition of one and a reduction by e.
   real(wp), parameter :: iterations_per_digit = 0.36_wp
   !> A coarse space pays from these numbers of iterations for all digits and of blocks on, and when with it they
   !> cost less than this share.
   real(wp), parameter :: many_expected = 150, clearly_less = 0.7_wp
   integer, parameter :: many_blocks = 3000
   !> Limit of iterations, in multiples of those expected.
   real(wp), parameter :: patience = 3
   !> Share of the correction that is kept when a solve needed less: the first round of a step needs most.
   real(wp), parameter :: forget = 0.7_wp
   !> Where steps grow, inertia loses its part in the condition: the iterations grow less than with 1/sqrt(rho).
   real(wp), parameter :: saturation = 0.25_wp
   !> Reduction of the residual, about, at which solves that may pause end.
   real(wp), parameter :: usual_reduction = 3.0e-4_wp
   !> PCG is tried against the estimate when it is expected to cost no more than this many direct solves.
   real(wp), parameter :: max_trial_cost = 8
   integer, parameter :: longest_wait = 63
   !> In small systems, solves before the work is counted again when PCG was too dear to be tried.
   integer, parameter :: wait_of_small = 7
   !> Solves that gain less than this share of all digits do not enter the correction.
   real(wp), parameter :: least_share = 0.1_wp
   !> Blocks, about, at which the share of inertia is measured.
   integer, parameter :: sample = 500
   integer, parameter :: most_iterations = 10000

contains

   !> Solve K x = f with the solver of least expected work.
   subroutine solve_auto(self, matrix, f, x, report, error, effort)
      class(auto_solver_type), intent(inout) :: self
      type(block_matrix_type), intent(in) :: matrix
      real(wp), intent(in), contiguous :: f(:, :)     !! (6, n)
      real(wp), intent(inout), contiguous :: x(:, :)  !! (6, n)
      type(solve_report_type), intent(out) :: report
      type(error_type), allocatable, intent(out) :: error
      type(solve_effort_type), intent(in), optional :: effort
      real(wp) :: first_guess, expected, share
      integer :: granted, wasted
      logical :: use_direct, may_pause, continues
      character(len=:), allocatable :: failure

      may_pause = .false.
      continues = .false.
      if (present(effort)) then
         may_pause = effort%pause > 0
         continues = effort%continues
      end if
      call take_direct(matrix%n)
      call pass_settings()
      if (matrix%values_id == 0 .or. matrix%values_id /= self%inertia_id) then
         call measure_inertia(self%inertia)
         self%inertia_id = matrix%values_id
         if (self%last_inertia > 0) self%correction = self%correction*(self%inertia/self%last_inertia)**saturation
         self%last_inertia = self%inertia
      end if
      first_guess = iterations_per_digit*log(1/wanted(self))/sqrt(self%inertia)
      expected = self%correction*first_guess
      granted = nint(min(patience*expected + 100, real(most_iterations, wp)))
      if (matrix%values_id == 0 .or. matrix%values_id /= self%values_id) self%pcg%deflates = &
         allocated(self%centroid) .and. matrix%n >= many_blocks .and. expected > many_expected .and. &
         deflated_cost*self%per_digit*log(1/wanted(self)) < clearly_less*expected
      if (self%pcg%deflates) then
         first_guess = log(1/wanted(self))
         expected = self%per_digit*first_guess
      end if
      if (matrix%values_id /= 0 .and. matrix%values_id == self%values_id) then
         use_direct = self%direct_was_used
      else
         self%reuse = max(1.0_wp, real(self%n_solves, wp), forget*self%reuse)
         self%n_solves = 0
         call choose()
      end if
      if (.not. continues) self%n_solves = self%n_solves + 1
      self%values_id = matrix%values_id
      self%direct_was_used = use_direct
      wasted = 0
      if (.not. use_direct) then
         self%pcg%max_iterations = granted
         call lend(self, self%pcg)
         call self%pcg%solve(matrix, f, x, report, error, effort)
         call lend(self%pcg, self)
         if (allocated(error) .or. report%interrupted) return
         if (report%converged) then
            share = share_of_digits(self, report%residual)
            if (share >= least_share) call remember(report%iterations/(first_guess*share), forget)
            self%last_wait = merge(self%last_wait/2, 0, self%is_small)
         end if
         if (report%converged .or. matrix%n > self%direct_limit) then
            if (.not. allocated(report%detail)) report%detail = self%choice
            return
         end if
         wasted = report%iterations
         failure = report%detail
         self%direct_was_used = .true.
         self%last_wait = min(2*self%last_wait + 1, longest_wait)
         self%waiting = self%last_wait
         call remember(2*wasted/first_guess, 1.0_wp)
      end if
      report%interrupted = self%is_interrupted()
      if (report%interrupted) return
      call lend(self, self%direct)
      call self%direct%solve(matrix, f, x, report, error)
      call lend(self%direct, self)
      report%iterations = wasted
      if (allocated(failure)) self%choice = trim(self%direct%label)//' took over: '//failure
      if (.not. allocated(report%detail)) report%detail = self%choice

   contains

      !> Remember iterations over those of the first guess, or a share of what was remembered if that is more.
      subroutine remember(needed, kept)
         real(wp), intent(in) :: needed, kept
         if (self%pcg%deflates) then
            self%per_digit = max(needed, kept*self%per_digit)
         else
            self%correction = max(needed, kept*self%correction)
         end if
      end subroutine remember

      !> Choose the solver and the limit of iterations for PCG.
      subroutine choose()
         type(error_type), allocatable :: error
         type(solve_report_type) :: report
         logical :: done
         real(wp) :: work_pcg, work_direct, operations, fill, affordable, solves, each, preparation
         real(wp) :: share   !! of all digits, to be gained
         use_direct = .false.
         if (matrix%n <= few_blocks) then
            use_direct = .true.
            self%choice = trim(self%direct%label)//': few blocks'
            return
         end if
         if (self%is_small .and. self%waiting > 0) then
            use_direct = .true.
            self%waiting = self%waiting - 1
            return
         end if
         each = merge(deflated_cost, 1.0_wp, self%pcg%deflates)*per_iteration
         preparation = merge(deflated_cost, 1.0_wp, self%pcg%deflates)*per_preparation
         solves = 1 + merge(follow_up_of_small, follow_up, self%is_small)*(self%reuse - 1)
         share = 1
         if (may_pause .and. expected > 2*many_iterations) share = min(share, log(usual_reduction)/log(wanted(self)))
         work_pcg = n_stored_blocks(matrix)*(preparation + solves*share*expected*each)
         self%choice = kind_of_pcg()//'about '//to_string(nint(min(share*expected, 1.0e9_wp)))//' iterations expected'
         if (matrix%n > self%direct_limit .or. work_pcg <= &
             merge(analysis_of_small, analysis_cost, self%is_small)*real(matrix%n, wp)**1.5_wp) return
         call self%direct%count_work(matrix, operations, fill, error)
         ! too little memory for the analysis: PCG solves
         if (allocated(error)) return
         work_direct = self%direct%per_operation*operations + &
                       (self%direct%per_fill + (self%reuse - 1)*self%direct%per_backsolve)*fill
         if (work_pcg <= work_direct) then
            ! PCG that needs more than that pays no more: in small systems the direct solver is at hand
            affordable = (work_direct/n_stored_blocks(matrix) - preparation)/(solves*each)
            if (self%is_small) granted = min(granted, max(1, nint(affordable)))
            return
         end if
         call self%pcg%residual%start(matrix, f, self%reference_load, x, report, done, error)
         if (done .or. allocated(error)) return
         call self%pcg%residual%evaluate(matrix, f, x, self%pcg%first_residual)
         call self%pcg%residual%remember(matrix, f, x)
         self%pcg%first_residual = min(self%pcg%first_residual, self%pcg%residual%zero_guess_residual)
         share = min(share, share_of_digits(self))
         work_pcg = n_stored_blocks(matrix)*(preparation + solves*share*expected*each)
         self%choice = kind_of_pcg()//'about '//to_string(nint(min(share*expected, 1.0e9_wp)))//' iterations expected'
         if (work_pcg <= work_direct) return
         affordable = (work_direct/n_stored_blocks(matrix) - preparation)/(solves*each)
         if (self%waiting == 0 .and. work_pcg < max_trial_cost*work_direct .and. affordable >= 1) then
            granted = nint(min(affordable, real(most_iterations, wp)))
            self%choice = kind_of_pcg()//'tried with '//to_string(granted)// &
                          ' iterations, which cost as much as '//trim(self%direct%label)
            return
         end if
         use_direct = .true.
         self%waiting = merge(wait_of_small, max(0, self%waiting - 1), self%is_small)
         self%choice = trim(self%direct%label)//': counted work is '//to_string(work_direct/work_pcg)//' of that of pcg'
      end subroutine choose

      !> Geometric mean of rho_i, see the head of the module, over some hundred blocks.
      subroutine measure_inertia(share)
         real(wp), intent(out) :: share   !! between 1e-12 and 1
         real(wp) :: total
         integer :: i, j, k, stride
         if (allocated(self%row_sum)) then
            if (size(self%row_sum) /= matrix%n) deallocate (self%row_sum)
         end if
         if (.not. allocated(self%row_sum)) allocate (self%row_sum(matrix%n))
         stride = max(1, matrix%n/sample)
         associate (row_sum => self%row_sum)
            row_sum = 0
            do i = 1, matrix%n
               do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
                  j = matrix%column(k)
                  if (mod(i, stride) /= 0 .and. mod(j, stride) /= 0) cycle
                  total = sum(matrix%values(1:2, 1:2, k))
                  row_sum(i) = row_sum(i) + total
                  if (j /= i) row_sum(j) = row_sum(j) + total
               end do
            end do
            total = 0
            do i = stride, matrix%n, stride
               associate (alone => sum(matrix%values(1:2, 1:2, matrix%row_start(i))))
                  if (alone > 0) total = total + log(min(1.0_wp, max(1.0e-12_wp, row_sum(i)/alone)))
               end associate
            end do
         end associate
         share = exp(total/max(1, matrix%n/stride))
      end subroutine measure_inertia

      !> Let `direct` be the direct solver for systems of this size.
      subroutine take_direct(n)
         integer, intent(in) :: n   !! blocks
         class(direct_solver_type), allocatable :: last
         if (.not. allocated(self%other) .or. (self%is_small .eqv. n <= most_blocks)) return
         call move_alloc(self%direct, last)
         call move_alloc(self%other, self%direct)
         call move_alloc(last, self%other)
         self%is_small = .not. self%is_small
      end subroutine take_direct

      !> Pass requests to stop, and where to stop, to the solvers.
      subroutine pass_settings()
         if (allocated(self%pcg%interruption)) deallocate (self%pcg%interruption)
         if (allocated(self%interruption)) allocate (self%pcg%interruption, source=self%interruption)
         self%pcg%enough = self%enough
      end subroutine pass_settings

      !> How PCG iterates, to begin the reason of a choice.
      pure function kind_of_pcg() result(text)
         character(len=:), allocatable :: text
         text = 'pcg: '
         if (self%pcg%deflates) text = 'pcg: with a coarse space, '
      end function kind_of_pcg

   end subroutine solve_auto

   !> Digits that PCG has to gain from its first residual, over those from a residual of one.
   pure real(wp) function share_of_digits(self, residual) result(share)
      class(auto_solver_type), intent(in) :: self
      real(wp), intent(in), optional :: residual   !! of a solve that may have paused; default: the one wanted
      real(wp) :: last
      last = wanted(self)
      if (present(residual)) last = max(last, residual)
      share = 0
      if (self%pcg%first_residual > last) &
         share = min(1.0_wp, log(self%pcg%first_residual/last)/log(1/wanted(self)))
   end function share_of_digits

   !> Relative residual at which PCG stops.
   pure real(wp) function wanted(self)
      class(auto_solver_type), intent(in) :: self
      wanted = max(self%pcg%tolerance, self%enough)
   end function wanted

   !> Correction of the estimate, solves to wait, last wait, recent solves per matrix, solves with the last matrix, its
   !> share of inertia, iterations with a coarse space for a reduction by e.
   pure subroutine pack_auto(self, memory)
      class(auto_solver_type), intent(in) :: self
      real(wp), allocatable, intent(out) :: memory(:)
      memory = [self%correction, real(self%waiting, wp), real(self%last_wait, wp), self%reuse, &
                real(self%n_solves, wp), self%last_inertia, self%per_digit]
   end subroutine pack_auto

   !> Restore the state from `pack`.
   pure subroutine unpack_auto(self, memory)
      class(auto_solver_type), intent(inout) :: self
      real(wp), intent(in) :: memory(:)
      if (size(memory) /= 7) return
      self%correction = memory(1)
      self%waiting = nint(memory(2))
      self%last_wait = nint(memory(3))
      self%reuse = memory(4)
      self%n_solves = nint(memory(5))
      self%last_inertia = memory(6)
      self%per_digit = memory(7)
   end subroutine unpack_auto

   !> Let another solver have the reference load and the centroids.
   pure subroutine lend(from, to)
      class(linear_solver_type), intent(inout) :: from, to
      call move_alloc(from%reference_load, to%reference_load)
      call move_alloc(from%centroid, to%centroid)
   end subroutine lend

end module rockdda_linear_auto
