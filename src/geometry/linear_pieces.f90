! SPDX-License-Identifier: MIT
!> A function along a segment that is linear in pieces, and integrals of its positive part.
!>
!> Places on the segment are shares s of its length, 0 at its start and 1 at its end:
!>
!>     value
!>       |        ....*
!>       |    *...    |          pieces 1, 2: linear between their ends
!>       |   /        |          integral(1): of (1 - s) f,   integral(2): of s f, where f > 0
!>     0 +--/---------+--- s
!>         /
module rockdda_geometry_linear_pieces
   use rockdda_base_kinds, only : wp
   implicit none
   private
   public :: positive_part_moments, crossings_of_columns

contains

   !> Integrals over s of the positive part of a piece, times 1 - s and times s: shares of the two ends of the segment
   !> in the resultant over the segment's length.
   pure function positive_part_moments(s, f) result(integral)
      real(wp), intent(in) :: s(2)     !! ends of the piece, s(1) <= s(2)
      real(wp), intent(in) :: f(2)     !! values there
      real(wp) :: integral(2)
      real(wp) :: a(2), v(2), zero, width
      integral = 0
      if (.not. any(f > 0)) return
      a = s
      v = max(f, 0.0_wp)
      if (any(f < 0)) then
         ! the value near the crossing is small, so that its rounding hardly counts
         zero = s(1) + (s(2) - s(1))*(f(1)/(f(1) - f(2)))
         if (f(1) < 0) a(1) = zero
         if (f(2) < 0) a(2) = zero
      end if
      width = a(2) - a(1)
      integral(2) = width/6*((2*v(1) + v(2))*a(1) + (v(1) + 2*v(2))*a(2))
      integral(1) = width/6*((2*v(1) + v(2))*(1 - a(1)) + (v(1) + 2*v(2))*(1 - a(2)))
   end function positive_part_moments

   !> Where a segment crosses vertical lines, between the shares `low` and `high`: these and the crossings, ascending.
   pure subroutine crossings_of_columns(p, q, low, high, x, s, n_s)
      real(wp), intent(in) :: p(2), q(2)      !! ends of the segment
      real(wp), intent(in) :: low, high       !! shares, low <= high
      real(wp), intent(in) :: x(:)            !! of the lines, ascending
      real(wp), intent(out) :: s(size(x) + 2)
      integer, intent(out) :: n_s             !! s(1:n_s) are set
      real(wp) :: t
      integer :: i, k, n
      n = size(x)
      s(1) = low
      k = 1
      do i = 1, n
         t = x(merge(i, n + 1 - i, q(1) > p(1))) - p(1)
         ! inside the segment; rules out vertical segments, too
         if (.not. (abs(t) < abs(q(1) - p(1)) .and. t*(q(1) - p(1)) > 0)) cycle
         t = t/(q(1) - p(1))
         if (.not. (t > s(k) .and. t < high)) cycle
         k = k + 1
         s(k) = t
      end do
      n_s = k + 1
      s(n_s) = high
   end subroutine crossings_of_columns

end module rockdda_geometry_linear_pieces
