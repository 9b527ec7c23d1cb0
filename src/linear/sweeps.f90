! SPDX-License-Identifier: MIT
!> Sweeps of conjugate gradients over one chunk of blocks, see rockdda_linear_pcg and rockdda_linear_chunk_order.
module rockdda_linear_sweeps
   use rockdda_base_kinds, only : wp
   use rockdda_linear_preconditioner, only : preconditioner_type
   use rockdda_linear_deflation, only : deflation_type
   use rockdda_linear_kernels, only : sp, subtract_products, subtract_transposed, cg_update
   implicit none
   private
   public :: update_chunk, sweep_backward, sweep_forward, subtract_coarse, row_sum

contains

   !> In one chunk: d := d + alpha t, r := r - alpha (q + t), then p := r + beta p.
   pure subroutine update_chunk(s, c, alpha, beta, q, t, d, r, p, square)
      type(preconditioner_type), intent(in) :: s
      integer, intent(in) :: c                     !! chunk
      real(sp), intent(in) :: alpha, beta
      real(sp), intent(in) :: q(6, *), t(6, *)
      real(sp), intent(inout) :: d(6, *), r(6, *), p(6, *)
      real(wp), intent(out) :: square              !! sum of r r
      real(wp) :: lane(6)
      integer :: first, last, i
      first = s%order%first(c)
      last = s%order%first(c + 1) - 1
      square = 0
      if (first > last) return
      lane = 0
      call cg_update(6*(last - first + 1), alpha, beta, q(1, first), t(1, first), d(1, first), r(1, first), p(1, first))
      do i = first, last
         lane = lane + real(r(:, i), wp)**2
      end do
      square = sum(lane)
   end subroutine update_chunk

   !> In one chunk: t := (I + L)^-T p.
   pure subroutine sweep_backward(s, c, p, t, back_sum)
      type(preconditioner_type), intent(in) :: s
      integer, intent(in) :: c                     !! chunk
      real(sp), intent(in) :: p(6, *)
      real(sp), intent(inout) :: t(6, *)
      real(sp), intent(inout) :: back_sum(12, *)   !! work
      real(sp) :: b(6), sums(4, 3), twice(4, 3)
      integer :: first, last, i
      first = s%order%first(c)
      last = s%order%first(c + 1) - 1
      if (.not. s%has_sweeps) then
         t(:, first:last) = p(:, first:last)
         return
      end if
      back_sum(:, first:last) = 0
      do i = last, first, -1
         b = p(:, i) + (back_sum(1:11:2, i) + back_sum(2:12:2, i))
         if (s%upper_start(i) < s%upper_start(i - 1)) then
            sums = 0
            call subtract_products(s%upper_start(i), s%upper_start(i - 1) - 1, s%upper_column, s%upper, t, sums)
            b = b + row_sum(sums)
         end if
         t(:, i) = b
         twice(1:2, 1) = b(1:2)
         twice(3:4, 1) = b(1:2)
         twice(1:2, 2) = b(3:4)
         twice(3:4, 2) = b(3:4)
         twice(1:2, 3) = b(5:6)
         twice(3:4, 3) = b(5:6)
         call subtract_transposed(s%own_start(i), s%lower_start(i + 1) - 1, s%lower_column, s%lower, twice, back_sum)
      end do
   end subroutine sweep_backward

   !> In one chunk: q := (I + L)^-1 (p + N t).
   pure subroutine sweep_forward(s, c, r, p, t, q, total)
      type(preconditioner_type), intent(in) :: s
      integer, intent(in) :: c                     !! chunk
      real(sp), intent(in) :: r(6, *), p(6, *), t(6, *)
      real(sp), intent(inout) :: q(6, *)
      real(wp), intent(out) :: total(3)            !! p v, r v, v v with v = q + t
      real(sp) :: sums(4, 3)
      real(wp) :: v(6), lane(6, 3)
      integer :: i
      do i = s%order%first(c), s%order%first(c + 1) - 1
         sums = 0
         if (s%has_sweeps) then
            call subtract_products(1, 1, [1], s%remainder(:, i), t(:, i), sums)
            call subtract_products(s%lower_start(i), s%lower_start(i + 1) - 1, s%lower_column, s%lower, q, sums)
         else
            call subtract_products(s%lower_start(i), s%lower_start(i + 1) - 1, s%lower_column, s%lower, t, sums)
            call subtract_products(s%upper_start(i), s%upper_start(i - 1) - 1, s%upper_column, s%upper, t, sums)
            sums = -sums
            call subtract_products(1, 1, [1], s%remainder(:, i), t(:, i), sums)
         end if
         q(:, i) = p(:, i) + row_sum(sums)
      end do
      lane = 0
      do i = s%order%first(c), s%order%first(c + 1) - 1
         v = real(q(:, i) + t(:, i), wp)
         lane(:, 1) = lane(:, 1) + real(p(:, i), wp)*v
         lane(:, 2) = lane(:, 2) + real(r(:, i), wp)*v
         lane(:, 3) = lane(:, 3) + v*v
      end do
      total = sum(lane, dim=1)
   end subroutine sweep_forward

   !> The vector that lanes add up to.
   pure function row_sum(sums) result(b)
      real(sp), intent(in) :: sums(4, 3)
      real(sp) :: b(6)
      b(1:2) = sums(1:2, 1) + sums(3:4, 1)
      b(3:4) = sums(1:2, 2) + sums(3:4, 2)
      b(5:6) = sums(1:2, 3) + sums(3:4, 3)
   end function row_sum

   !> In one chunk: t := t - w, p := p - (I + L)^T w with the motion w = Z a of the coarse space.
   pure subroutine subtract_coarse(s, deflation, c, t, p)
      type(preconditioner_type), intent(in) :: s
      type(deflation_type), intent(in) :: deflation
      integer, intent(in) :: c                     !! chunk
      real(sp), intent(inout) :: t(6, *), p(6, *)
      real(sp) :: sums(4, 3), w(6)
      integer :: i
      do i = s%order%first(c), s%order%first(c + 1) - 1
         sums = 0
         call subtract_products(1, 1, deflation%group(i:i), deflation%own(:, i), deflation%a, sums)
         w = row_sum(sums)
         t(:, i) = t(:, i) + w
         sums = 0
         call subtract_products(deflation%later_start(i), deflation%later_start(i + 1) - 1, deflation%later_group, &
                                deflation%later, deflation%a, sums)
         p(:, i) = p(:, i) + (w + row_sum(sums))
      end do
   end subroutine subtract_coarse

end module rockdda_linear_sweeps
