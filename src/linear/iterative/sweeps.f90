! SPDX-License-Identifier: MIT
!> Sweeps of conjugate gradients over one chunk of blocks, see rockdda_linear_pcg and rockdda_linear_chunk_order. Their
!> kernels are in sweep_kernels_shim.c.
module rockdda_linear_sweeps
   use, intrinsic :: iso_c_binding, only : c_int, c_double, c_float
   use rockdda_base_kinds, only : wp
   use rockdda_linear_preconditioner, only : preconditioner_type
   use rockdda_linear_deflation, only : deflation_type
   use rockdda_linear_kernels, only : sp, subtract_products, cg_update
   implicit none
   private
   public :: start_chunk, add_chunk, update_chunk, sweep_backward, update_and_sweep_backward, sweep_forward, &
      subtract_coarse

   interface
      !> r := weight G^-1 f, and with `sweeps` (1) r := (I + L)^-1 r, in the rows first to last; f is in the order of
      !> the matrix.
      pure subroutine start_rows(first, last, sweeps, lower_start, lower_column, lower, scale, block, weight, f, r) &
         bind(c, name='rockdda_start_rows')
         import :: c_int, c_double, c_float
         integer(c_int), value :: first, last, sweeps
         integer(c_int), intent(in) :: lower_start(*), lower_column(*), block(*)
         real(c_float), intent(in) :: lower(36, *)
         real(c_double), intent(in) :: scale(21, *), f(6, *)
         real(c_double), value :: weight
         real(c_float), intent(inout) :: r(6, *)
      end subroutine start_rows

      !> x := x + norm G^-T (d + alpha t) of the blocks in rows first to last; x is in the order of the matrix.
      pure subroutine add_scaled_rows(first, last, scale, block, norm, alpha, d, t, x) &
         bind(c, name='rockdda_add_scaled')
         import :: c_int, c_double, c_float
         integer(c_int), value :: first, last
         integer(c_int), intent(in) :: block(*)
         real(c_double), intent(in) :: scale(21, *)
         real(c_double), value :: norm
         real(c_float), value :: alpha
         real(c_float), intent(in) :: d(6, *), t(6, *)
         real(c_double), intent(inout) :: x(6, *)
      end subroutine add_scaled_rows

      !> t := (I + L)^-T s in the rows first to last.
      pure subroutine sweep_rows_backward(first, last, upper_start, upper_column, upper, own_start, lower_start, &
                                          lower_column, lower, s, t, back_sum) bind(c, name='rockdda_sweep_backward')
         import :: c_int, c_float
         integer(c_int), value :: first, last
         integer(c_int), intent(in) :: upper_start(*), upper_column(*), own_start(*), lower_start(*), lower_column(*)
         real(c_float), intent(in) :: upper(36, *), lower(36, *), s(6, *)
         real(c_float), intent(inout) :: t(6, *), back_sum(12, *)
      end subroutine sweep_rows_backward

      !> d := d + alpha t, r := r - alpha (q + t), p := r + beta p, then t := (I + L)^-T p in the rows first to last.
      pure subroutine update_and_sweep_rows(first, last, upper_start, upper_column, upper, own_start, lower_start, &
                                            lower_column, lower, alpha, beta, q, d, r, p, t, back_sum) &
         bind(c, name='rockdda_update_and_sweep')
         import :: c_int, c_float
         integer(c_int), value :: first, last
         integer(c_int), intent(in) :: upper_start(*), upper_column(*), own_start(*), lower_start(*), lower_column(*)
         real(c_float), intent(in) :: upper(36, *), lower(36, *), q(6, *)
         real(c_float), value :: alpha, beta
         real(c_float), intent(inout) :: d(6, *), r(6, *), p(6, *), t(6, *), back_sum(12, *)
      end subroutine update_and_sweep_rows

      !> q := (I + L)^-1 (p + N t) in the rows first to last, and r r, p v, r v, v v with v = q + t.
      pure subroutine sweep_rows_forward(first, last, lower_start, lower_column, lower, remainder, r, p, t, q, total) &
         bind(c, name='rockdda_sweep_forward')
         import :: c_int, c_double, c_float
         integer(c_int), value :: first, last
         integer(c_int), intent(in) :: lower_start(*), lower_column(*)
         real(c_float), intent(in) :: lower(36, *), remainder(36, *), r(6, *), p(6, *), t(6, *)
         real(c_float), intent(inout) :: q(6, *)
         real(c_double), intent(inout) :: total(4)
      end subroutine sweep_rows_forward
   end interface

contains

   !> In one chunk: r := (I + L)^-1 G^-1 f times a weight.
   pure subroutine start_chunk(s, c, weight, f, r)
      type(preconditioner_type), intent(in) :: s
      integer, intent(in) :: c                     !! chunk
      real(wp), intent(in) :: weight
      real(wp), intent(in) :: f(6, *)              !! in the order of the matrix
      real(sp), intent(inout) :: r(6, *)
      call start_rows(s%order%first(c), s%order%first(c + 1) - 1, merge(1, 0, s%has_sweeps), s%lower_start, &
                      s%lower_column, s%lower, s%scale, s%order%block, weight, f, r)
   end subroutine start_chunk

   !> In one chunk: x := x + norm G^-T (d + alpha t).
   subroutine add_chunk(s, c, norm, alpha, d, t, x)
      type(preconditioner_type), intent(in) :: s
      integer, intent(in) :: c                     !! chunk
      real(wp), intent(in) :: norm
      real(sp), intent(in) :: alpha
      real(sp), intent(in) :: d(6, *), t(6, *)
      real(wp), intent(inout) :: x(6, *)           !! in the order of the matrix
      call add_scaled_rows(s%order%first(c), s%order%first(c + 1) - 1, s%scale, s%order%block, norm, alpha, d, t, x)
   end subroutine add_chunk

   !> In one chunk: d := d + alpha t, r := r - alpha (q + t), then p := r + beta p.
   pure subroutine update_chunk(s, c, alpha, beta, q, t, d, r, p)
      type(preconditioner_type), intent(in) :: s
      integer, intent(in) :: c                     !! chunk
      real(sp), intent(in) :: alpha, beta
      real(sp), intent(in) :: q(6, *), t(6, *)
      real(sp), intent(inout) :: d(6, *), r(6, *), p(6, *)
      integer :: first, n
      first = s%order%first(c)
      n = 6*(s%order%first(c + 1) - first)
      if (n > 0) call cg_update(n, alpha, beta, q(1, first), t(1, first), d(1, first), r(1, first), p(1, first))
   end subroutine update_chunk

   !> In one chunk: t := (I + L)^-T p.
   pure subroutine sweep_backward(s, c, p, t, back_sum)
      type(preconditioner_type), intent(in) :: s
      integer, intent(in) :: c                     !! chunk
      real(sp), intent(in) :: p(6, *)
      real(sp), intent(inout) :: t(6, *)
      real(sp), intent(inout) :: back_sum(12, *)   !! (12, rows of the chunk) work, zero before and after
      associate (first => s%order%first(c), last => s%order%first(c + 1) - 1)
         if (s%has_sweeps) then
            call sweep_rows_backward(first, last, s%upper_start, s%upper_column, s%upper, s%own_start, s%lower_start, &
                                     s%lower_column, s%lower, p, t, back_sum)
         else
            t(:, first:last) = p(:, first:last)
         end if
      end associate
   end subroutine sweep_backward

   !> In one chunk: update_chunk, then t := (I + L)^-T p.
   pure subroutine update_and_sweep_backward(s, c, alpha, beta, q, t, d, r, p, back_sum)
      type(preconditioner_type), intent(in) :: s
      integer, intent(in) :: c                     !! chunk
      real(sp), intent(in) :: alpha, beta
      real(sp), intent(in) :: q(6, *)
      real(sp), intent(inout) :: t(6, *), d(6, *), r(6, *), p(6, *)
      real(sp), intent(inout) :: back_sum(12, *)   !! (12, rows of the chunk) work, zero before and after
      associate (first => s%order%first(c), last => s%order%first(c + 1) - 1)
         if (s%has_sweeps) then
            call update_and_sweep_rows(first, last, s%upper_start, s%upper_column, s%upper, s%own_start, &
                                       s%lower_start, s%lower_column, s%lower, alpha, beta, q, d, r, p, t, back_sum)
         else
            call update_chunk(s, c, alpha, beta, q, t, d, r, p)
            t(:, first:last) = p(:, first:last)
         end if
      end associate
   end subroutine update_and_sweep_backward

   !> In one chunk: q := (I + L)^-1 (p + N t).
   pure subroutine sweep_forward(s, c, r, p, t, q, total)
      type(preconditioner_type), intent(in) :: s
      integer, intent(in) :: c                     !! chunk
      real(sp), intent(in) :: r(6, *), p(6, *), t(6, *)
      real(sp), intent(inout) :: q(6, *)
      real(wp), intent(inout) :: total(4)          !! r r, p v, r v, v v with v = q + t
      real(sp) :: sums(4, 3)
      real(wp) :: v(6), lane(6, 4)
      integer :: i
      if (s%has_sweeps) then
         call sweep_rows_forward(s%order%first(c), s%order%first(c + 1) - 1, s%lower_start, s%lower_column, s%lower, &
                                 s%remainder, r, p, t, q, total)
         return
      end if
      lane = 0
      do i = s%order%first(c), s%order%first(c + 1) - 1
         sums = 0
         call subtract_products(s%lower_start(i), s%lower_start(i + 1) - 1, s%lower_column, s%lower, t, sums)
         call subtract_products(s%upper_start(i), s%upper_start(i - 1) - 1, s%upper_column, s%upper, t, sums)
         sums = -sums
         call subtract_products(1, 1, [1], s%remainder(:, i), t(:, i), sums)
         q(:, i) = p(:, i) + row_sum(sums)
         v = real(q(:, i) + t(:, i), wp)
         lane(:, 1) = lane(:, 1) + real(r(:, i), wp)**2
         lane(:, 2) = lane(:, 2) + real(p(:, i), wp)*v
         lane(:, 3) = lane(:, 3) + real(r(:, i), wp)*v
         lane(:, 4) = lane(:, 4) + v*v
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
