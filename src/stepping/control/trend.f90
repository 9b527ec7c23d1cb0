! SPDX-License-Identifier: MIT
!> The motion with which a static step begins to solve, from the trend of the last ones.
!>
!> Steps of one length without velocity move blocks nearly alike, and what changes from one to the next continues to
!> change: with the motions d0, d1 and d2 of three steps
!>
!>     d2 - d1 = share (d1 - d0)
!>
!> in the mean of least squares over the displacements of all blocks, and d2 + share (d2 - d1) is expected of the next
!> one. It is only where the solver begins.
module rockdda_stepping_trend
   use rockdda_base_kinds, only : wp
   use rockdda_base_parallel, only : parallel_blocks, piece, n_pieces
   implicit none
   private
   public :: trend_type, steps_of_trend

   !> Steps of one length in a row from which on there is a trend.
   integer, parameter :: steps_of_trend = 3

   type :: trend_type
      integer :: steps = 0    !! of one length in a row, at most `steps_of_trend`
      real(wp) :: share = 0   !! of the last change of the motion, in the change that is expected next; between 0 and 1
   contains
      procedure :: follow
      procedure :: expect
   end type trend_type

contains

   !> Take in an accepted step.
   subroutine follow(self, continues, dt, d, last, acceleration)
      class(trend_type), intent(inout) :: self
      logical, intent(in) :: continues                          !! the last step was such a one of the same length
      real(wp), intent(in) :: dt                                !! [time]
      real(wp), intent(in), contiguous :: d(:, :)               !! (6, nb) motion of the step
      real(wp), intent(in), contiguous :: last(:, :)            !! (6, nb) of the last one
      real(wp), intent(inout), contiguous :: acceleration(:, :) !! (6, nb) of the one before that, then of the last one
      real(wp) :: part(2, n_pieces(size(d, 2))), total(2)
      integer :: p, i, n
      self%steps = merge(min(self%steps + 1, steps_of_trend), 1, continues)
      self%share = 0
      if (self%steps < 2) return
      n = size(d, 2)
      !$omp parallel do default(none) shared(d, last, acceleration, part, dt, n) private(p, i) schedule(static) &
      !$omp if (n > parallel_blocks)
      do p = 1, size(part, 2)
         part(:, p) = 0
         do i = (p - 1)*piece + 1, min(p*piece, n)
            associate (before => last(1:2, i) - 0.5_wp*dt**2*acceleration(1:2, i), now => d(1:2, i) - last(1:2, i))
               part(1, p) = part(1, p) + (now(1)*before(1) + now(2)*before(2))
               part(2, p) = part(2, p) + (before(1)**2 + before(2)**2)
            end associate
            acceleration(:, i) = (2/dt**2)*last(:, i)
         end do
      end do
      !$omp end parallel do
      if (self%steps < steps_of_trend) return
      total = sum(part, dim=2)
      if (total(2) > 0) self%share = min(max(total(1)/total(2), 0.0_wp), 1.0_wp)
   end subroutine follow

   !> From the motion of the last step to that which is expected of the next one.
   subroutine expect(self, dt, acceleration, d)
      class(trend_type), intent(in) :: self
      real(wp), intent(in) :: dt                                !! of both [time]
      real(wp), intent(in), contiguous :: acceleration(:, :)    !! (6, nb) of the one before the last
      real(wp), intent(inout), contiguous :: d(:, :)            !! (6, nb)
      integer :: i
      if (.not. self%share > 0) return
      !$omp parallel do default(none) shared(self, dt, acceleration, d) private(i) schedule(static) &
      !$omp if (size(d, 2) > parallel_blocks)
      do i = 1, size(d, 2)
         d(:, i) = d(:, i) + self%share*(d(:, i) - 0.5_wp*dt**2*acceleration(:, i))
      end do
      !$omp end parallel do
   end subroutine expect

end module rockdda_stepping_trend
