! SPDX-License-Identifier: MIT
!> Cholesky factor of a small symmetric matrix of 6x6 blocks, stored from the first block of each row to the diagonal.
!>
!>     row 4      .  K42  K43  K44        first(4) = 2; K43 may be zero, the factor fills it
!>
!> Nothing fills in before the first block of a row.
module rockdda_linear_coarse_factor
   use rockdda_base_kinds, only : wp
   use rockdda_linear_small_blocks, only : factorize_block, invert_lower
   implicit none
   private
   public :: coarse_factor_type

   type :: coarse_factor_type
      integer :: n = 0                          !! rows of blocks
      integer, allocatable :: first(:)          !! (n) first column of each row
      integer, allocatable :: offset(:)         !! (n) block (i, j) is values(:, :, offset(i) + j)
      real(wp), allocatable :: values(:, :, :)  !! (6, 6, blocks) the matrix
      real(wp), allocatable, private :: l(:, :, :)  !! (6, 6, blocks) its factor, the diagonal blocks inverted
   contains
      procedure :: set_pattern
      procedure :: factorize
      procedure :: solve
   end type coarse_factor_type

contains

   !> Take the pattern, given by the first column of each row.
   pure subroutine set_pattern(self, first)
      class(coarse_factor_type), intent(inout) :: self
      integer, intent(in) :: first(:)     !! (n) first(i) <= i
      integer :: i, at
      self%n = size(first)
      self%first = first
      if (allocated(self%offset)) deallocate (self%offset, self%values, self%l)
      allocate (self%offset(self%n))
      at = 0
      do i = 1, self%n
         self%offset(i) = at - first(i) + 1
         at = at + i - first(i) + 1
      end do
      allocate (self%values(6, 6, at), self%l(6, 6, at))
   end subroutine set_pattern

   !> Factorise the matrix.
   pure subroutine factorize(self, ok)
      class(coarse_factor_type), intent(inout) :: self
      logical, intent(out) :: ok          !! positive definite and finite
      real(wp) :: s(6, 6), l(6, 6)
      integer :: i, j, k, c
      ok = .true.
      do i = 1, self%n
         do j = self%first(i), i
            s = self%values(:, :, self%offset(i) + j)
            do k = max(self%first(i), self%first(j)), j - 1
               call subtract_product(self%l(:, :, self%offset(i) + k), self%l(:, :, self%offset(j) + k), s)
            end do
            if (j < i) then
               ! times the transpose of the inverse of the diagonal
               associate (inverse => self%l(:, :, self%offset(j) + j))
                  do c = 6, 1, -1
                     s(:, c) = matmul(s(:, 1:c), inverse(c, 1:c))
                  end do
               end associate
               self%l(:, :, self%offset(i) + j) = s
            else
               call factorize_block(s, l, ok)
               if (.not. ok) return
               call invert_lower(l, self%l(:, :, self%offset(i) + i))
            end if
         end do
      end do
   end subroutine factorize

   !> s := s - a b^T.
   pure subroutine subtract_product(a, b, s)
      real(wp), intent(in) :: a(6, 6), b(6, 6)
      real(wp), intent(inout) :: s(6, 6)
      integer :: c
      do c = 1, 6
         s(:, c) = s(:, c) - ((a(:, 1)*b(c, 1) + a(:, 2)*b(c, 2)) + (a(:, 3)*b(c, 3) + a(:, 4)*b(c, 4)) &
                              + (a(:, 5)*b(c, 5) + a(:, 6)*b(c, 6)))
      end do
   end subroutine subtract_product

   !> x := K^-1 x.
   pure subroutine solve(self, x)
      class(coarse_factor_type), intent(in) :: self
      real(wp), intent(inout) :: x(6, self%n)
      real(wp) :: b(6)
      integer :: i, j, c
      do i = 1, self%n
         b = x(:, i)
         do j = self%first(i), i - 1
            call subtract_column(self%l(:, :, self%offset(i) + j), x(:, j), b)
         end do
         x(:, i) = 0
         do c = 1, 6
            x(c:6, i) = x(c:6, i) + self%l(c:6, c, self%offset(i) + i)*b(c)
         end do
      end do
      do i = self%n, 1, -1
         do c = 1, 6
            b(c) = dot_product(self%l(c:6, c, self%offset(i) + i), x(c:6, i))
         end do
         x(:, i) = b
         do j = self%first(i), i - 1
            do c = 1, 6
               x(c, j) = x(c, j) - dot_product(self%l(:, c, self%offset(i) + j), b)
            end do
         end do
      end do
   end subroutine solve

   !> b := b - A x.
   pure subroutine subtract_column(a, x, b)
      real(wp), intent(in) :: a(6, 6), x(6)
      real(wp), intent(inout) :: b(6)
      b = b - ((a(:, 1)*x(1) + a(:, 2)*x(2)) + (a(:, 3)*x(3) + a(:, 4)*x(4)) + (a(:, 5)*x(5) + a(:, 6)*x(6)))
   end subroutine subtract_column

end module rockdda_linear_coarse_factor
