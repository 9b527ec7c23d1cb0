! SPDX-License-Identifier: MIT
!> Fixed point of a vector function by Anderson acceleration (1965, J. ACM 12, 547-560; type II, without damping).
!>
!> The fixed point of g is found from iterates x_k and their residuals r_k = g(x_k) - x_k. With the differences of the
!> last m iterates as columns,
!>
!>     dX = [x_k - x_(k-1), x_(k-1) - x_(k-2), ...],    dR = [r_k - r_(k-1), r_(k-1) - r_(k-2), ...],
!>
!> the next iterate is
!>
!>     x_(k+1) = x_k + r_k - (dX + dR) w,    w = arg min |r_k - dR w|.
!>
!> For one unknown and m = 1 that is the secant method. For an affine g it is equivalent to GMRES, so that it converges
!> also where the iteration x_(k+1) = g(x_k) diverges.
module rockdda_linear_anderson
   use rockdda_base_kinds, only : wp
   implicit none
   private
   public :: anderson_type

   !> Largest number of differences m: as many as friction in a net of blocks needs; fewer where they take much memory.
   integer, parameter :: depth = 40, least_depth = 8, many_unknowns = 100000
   !> A difference is left out when the share of it that is orthogonal to the newer ones is smaller than this (squared).
   real(wp), parameter :: dependent = 1.0e-10_wp

   type :: anderson_type
      private
      integer :: n_kept = 0, depth = 0
      logical :: has_last = .false.
      real(wp), allocatable :: value(:), residual(:)                     !! (n) x and r of the last iterate
      real(wp), allocatable :: value_change(:, :), residual_change(:, :) !! (n, self%depth) dX and dR, newest first
      real(wp) :: products(depth, depth)                                 !! of two columns of dR, the newer one second
   contains
      procedure :: restart
      procedure :: next => next_iterate
   end type anderson_type

contains

   !> Clear the history; allocate arrays for n unknowns.
   pure subroutine restart(self, n)
      class(anderson_type), intent(inout) :: self
      integer, intent(in) :: n
      self%n_kept = 0
      self%has_last = .false.
      if (allocated(self%value)) then
         if (size(self%value) >= n) return
         deallocate (self%value, self%residual, self%value_change, self%residual_change)
      end if
      self%depth = merge(depth, least_depth, n <= many_unknowns)
      allocate (self%value(n), self%residual(n), self%value_change(n, self%depth), self%residual_change(n, self%depth))
   end subroutine restart

   !> Replace the iterate x by the next one.
   pure subroutine next_iterate(self, value, residual)
      class(anderson_type), intent(inout) :: self
      real(wp), intent(inout) :: value(:)   !! (n) x
      real(wp), intent(in) :: residual(:)    !! (n) g(x) - x
      real(wp) :: weight(depth)
      integer :: n, i
      n = size(value)
      if (self%has_last) then
         do i = min(self%n_kept, self%depth - 1), 1, -1
            self%value_change(1:n, i + 1) = self%value_change(1:n, i)
            self%residual_change(1:n, i + 1) = self%residual_change(1:n, i)
            self%products(i + 1, 2:i + 1) = self%products(i, 1:i)
         end do
         self%n_kept = min(self%n_kept + 1, self%depth)
         self%value_change(1:n, 1) = value - self%value(1:n)
         self%residual_change(1:n, 1) = residual - self%residual(1:n)
         do i = 1, self%n_kept
            self%products(i, 1) = dot_product(self%residual_change(1:n, i), self%residual_change(1:n, 1))
         end do
      end if
      self%value(1:n) = value
      self%residual(1:n) = residual
      self%has_last = .true.
      do i = 1, self%n_kept
         weight(i) = dot_product(self%residual_change(1:n, i), residual)
      end do
      call least_squares(self%n_kept, self%products, weight)
      value = value + residual
      do i = 1, self%n_kept
         value = value - weight(i)*(self%value_change(1:n, i) + self%residual_change(1:n, i))
      end do
   end subroutine next_iterate

   !> Least-squares solution of a w = b: normal equations by Cholesky, newest column first.
   pure subroutine least_squares(m, products, weight)
      integer, intent(in) :: m
      real(wp), intent(in) :: products(:, :)   !! (>= m, >= m) a' a, lower triangle
      real(wp), intent(inout) :: weight(:)     !! (>= m) a' b, then w
      real(wp) :: l(depth, depth), pivot
      integer :: i, j
      do j = 1, m
         l(j:m, j) = products(j:m, j)
         pivot = l(j, j) - sum(l(j, 1:j - 1)**2)
         if (.not. pivot > dependent*l(j, j)) then
            l(j:m, j) = 0
            weight(j) = 0
            cycle
         end if
         do i = j + 1, m
            l(i, j) = (l(i, j) - dot_product(l(i, 1:j - 1), l(j, 1:j - 1)))/sqrt(pivot)
         end do
         l(j, j) = sqrt(pivot)
         weight(j) = (weight(j) - dot_product(l(j, 1:j - 1), weight(1:j - 1)))/l(j, j)
      end do
      do j = m, 1, -1
         if (l(j, j) > 0) weight(j) = (weight(j) - dot_product(l(j + 1:m, j), weight(j + 1:m)))/l(j, j)
      end do
   end subroutine least_squares

end module rockdda_linear_anderson
