! SPDX-License-Identifier: MIT
!> Fixed point of a vector function by Anderson's method (1965, J. ACM 12, 547-560; type II, without damping).
!>
!> For value -> value + miss(value) the next guess is the combination of the last guesses whose misses cancel best,
!> in the least-squares sense, plus that combination of the misses. For one unknown that is the secant method; for a
!> function that is affine it is equivalent to GMRES, so that it converges also where putting the function in
!> for its argument diverges.
module rockdda_contact_mixing
   use rockdda_base_kinds, only : wp
   implicit none
   private
   public :: mixing_type

   !> Differences of guesses that are kept.
   integer, parameter :: depth = 8
   !> A difference whose part that newer ones do not explain is smaller than this (squared) is left out.
   real(wp), parameter :: dependent = 1.0e-10_wp

   type :: mixing_type
      private
      integer :: n_kept = 0
      logical :: has_last = .false.
      real(wp), allocatable :: value(:), miss(:)                     !! (n) of the last guess
      real(wp), allocatable :: value_change(:, :), miss_change(:, :) !! (n, depth) newest first
   contains
      procedure :: restart
      procedure :: improve
   end type mixing_type

contains

   !> Forget all guesses; room for n unknowns.
   pure subroutine restart(self, n)
      class(mixing_type), intent(inout) :: self
      integer, intent(in) :: n
      self%n_kept = 0
      self%has_last = .false.
      if (allocated(self%value)) then
         if (size(self%value) >= n) return
         deallocate (self%value, self%miss, self%value_change, self%miss_change)
      end if
      allocate (self%value(n), self%miss(n), self%value_change(n, depth), self%miss_change(n, depth))
   end subroutine restart

   !> Replace a guess, whose miss was found, by the next one.
   pure subroutine improve(self, value, miss)
      class(mixing_type), intent(inout) :: self
      real(wp), intent(inout) :: value(:)   !! (n)
      real(wp), intent(in) :: miss(:)       !! (n)
      real(wp) :: weight(depth)
      integer :: n, i
      n = size(value)
      if (self%has_last) then
         do i = min(self%n_kept, depth - 1), 1, -1
            self%value_change(1:n, i + 1) = self%value_change(1:n, i)
            self%miss_change(1:n, i + 1) = self%miss_change(1:n, i)
         end do
         self%n_kept = min(self%n_kept + 1, depth)
         self%value_change(1:n, 1) = value - self%value(1:n)
         self%miss_change(1:n, 1) = miss - self%miss(1:n)
      end if
      self%value(1:n) = value
      self%miss(1:n) = miss
      self%has_last = .true.
      call least_squares(self%n_kept, self%miss_change(1:n, :), miss, weight)
      value = value + miss
      do i = 1, self%n_kept
         value = value - weight(i)*(self%value_change(1:n, i) + self%miss_change(1:n, i))
      end do
   end subroutine improve

   !> Weights of the columns of a that come closest to b: normal equations by Cholesky, newest column first.
   pure subroutine least_squares(m, a, b, weight)
      integer, intent(in) :: m
      real(wp), intent(in) :: a(:, :)     !! (n, >= m)
      real(wp), intent(in) :: b(:)        !! (n)
      real(wp), intent(out) :: weight(:)  !! (>= m)
      real(wp) :: l(depth, depth), pivot
      integer :: i, j
      do j = 1, m
         do i = j, m
            l(i, j) = dot_product(a(:, i), a(:, j))
         end do
         weight(j) = dot_product(a(:, j), b)
      end do
      do j = 1, m
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

end module rockdda_contact_mixing
