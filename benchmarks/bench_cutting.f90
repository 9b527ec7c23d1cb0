! SPDX-License-Identifier: MIT
!> Time to cut a perturbed grid of n x n blocks, on one core.
!>
!>   long    2 (n + 1) slightly inclined lines right through the model
!>   short   one line for each side of a cell: 2 n (n + 1) lines that meet in common nodes shifted at random
!>
!> The exponent is log(time ratio)/log(block ratio) to the size before: 1 is proportional.
program bench_cutting
   use, intrinsic :: iso_fortran_env, only : output_unit, error_unit
   use rockdda_base_kinds, only : wp, i8
   use rockdda_base_diagnostics, only : diagnostics_type
   use rockdda_base_error, only : error_type
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_geometry_input, only : geometry_input_type
   use rockdda_cutting_cut, only : cut_blocks, cut_report_type
   implicit none

   integer, parameter :: sizes(5) = [32, 100, 224, 317, 500]
   type(geometry_input_type) :: geometry
   type(block_system_type) :: blocks
   type(cut_report_type) :: report
   type(diagnostics_type) :: messages
   type(error_type), allocatable :: error
   integer(i8) :: from, to, rate
   integer :: k, kind, n_before
   real(wp) :: seconds, seconds_before
   character(len=5), parameter :: kinds(2) = ['long ', 'short']

   write (output_unit, '(a)') 'input   lines   blocks   seconds   microseconds/block   exponent   area error'
   do kind = 1, 2
      do k = 1, size(sizes)
         if (kind == 1) then
            call make_long_lines(sizes(k), geometry)
         else
            call make_short_lines(sizes(k), geometry)
         end if
         call system_clock(from, rate)
         call cut_blocks(geometry, blocks, report, messages, error)
         call system_clock(to)
         if (allocated(error)) then
            write (error_unit, '(a)') error%message
            error stop 1
         end if
         if (blocks%n_blocks /= sizes(k)**2) then
            write (error_unit, '(a,i0,a,i0)') 'expected ', sizes(k)**2, ' blocks, got ', blocks%n_blocks
            error stop 1
         end if
         seconds = real(to - from, wp)/real(rate, wp)
         write (output_unit, '(a,i8,i9,f10.3,f21.2)', advance='no') kinds(kind), report%n_lines, report%n_blocks, &
            seconds, 1.0e6_wp*seconds/report%n_blocks
         if (k > 1) then
            write (output_unit, '(f11.2)', advance='no') &
               log(seconds/seconds_before)/log(real(report%n_blocks, wp)/n_before)
         else
            write (output_unit, '(a11)', advance='no') '-'
         end if
         write (output_unit, '(es13.1)') abs(report%area_sum - report%enclosed_area)/report%enclosed_area
         seconds_before = seconds
         n_before = report%n_blocks
      end do
   end do

contains

   !> Pseudo-random shift between -0.15 and 0.15.
   pure real(wp) function shift(i, k)
      integer, intent(in) :: i, k
      shift = 0.3_wp*(modulo(i*0.754877666246693_wp + k*0.569840290998053_wp, 1.0_wp) - 0.5_wp)
   end function shift

   !> Lines right through the model, ends a little outside.
   subroutine make_long_lines(n, geometry)
      integer, intent(in) :: n
      type(geometry_input_type), intent(inout) :: geometry
      integer :: i
      call geometry%allocate_all(2*(n + 1), 0, 0, 0, 0, 0, 0)
      geometry%edge_node_distance = 1.0e-3_wp
      do i = 0, n
         geometry%lines(:, i + 1) = [-0.5_wp, i + shift(i, 1), n + 0.5_wp, i + shift(i, 2)]
         geometry%lines(:, i + n + 2) = [i + shift(i, 3), -0.5_wp, i + shift(i, 4), n + 0.5_wp]
      end do
   end subroutine make_long_lines

   !> The sides of all cells.
   subroutine make_short_lines(n, geometry)
      integer, intent(in) :: n
      type(geometry_input_type), intent(inout) :: geometry
      integer :: i, j, m
      call geometry%allocate_all(2*n*(n + 1), 0, 0, 0, 0, 0, 0)
      geometry%edge_node_distance = 1.0e-3_wp
      m = 0
      do j = 0, n
         do i = 0, n - 1
            m = m + 2
            geometry%lines(:, m - 1) = [node(i, j), node(i + 1, j)]
            geometry%lines(:, m) = [node(j, i), node(j, i + 1)]
         end do
      end do
   end subroutine make_short_lines

   !> A shifted grid point.
   pure function node(i, j) result(x)
      integer, intent(in) :: i, j
      real(wp) :: x(2)
      x = [i + shift(i + 7*j, 1), j + shift(j - 5*i, 2)]
   end function node

end program bench_cutting
