! SPDX-License-Identifier: MIT
!> What is given in time: tables of loads and movements, and the motion of the base.
module rockdda_interaction_time_tables
   use rockdda_base_kinds, only : wp, pi
   use rockdda_model_options, only : base_motion_type
   implicit none
   private
   public :: table_value, table_changes, load_factor, factor_integral, base_acceleration

contains

   !> Value of a table at a time: linear in between, constant beyond the ends, zero for a table without rows.
   !> Where a time is listed more than once the last of these rows holds from then on (a jump).
   pure function table_value(rows, t) result(value)
      real(wp), intent(in) :: rows(:, :)          !! (1 + k, m) time and k values, times not decreasing
      real(wp), intent(in) :: t                   !! [time]
      real(wp) :: value(size(rows, 1) - 1)        !! (k)
      integer :: m, low, high, middle
      real(wp) :: w
      m = size(rows, 2)
      if (m == 0) then
         value = 0
      else if (t < rows(1, 1)) then
         value = rows(2:, 1)
      else if (t >= rows(1, m)) then
         value = rows(2:, m)
      else
         low = 1      ! rows(1, low) <= t < rows(1, high)
         high = m
         do while (high - low > 1)
            middle = (low + high)/2
            if (rows(1, middle) <= t) then
               low = middle
            else
               high = middle
            end if
         end do
         w = (t - rows(1, low))/(rows(1, high) - rows(1, low))
         value = (1 - w)*rows(2:, low) + w*rows(2:, high)
      end if
   end function table_value

   !> Does a table have different values between two times?
   pure logical function table_changes(rows, from, to) result(changes)
      real(wp), allocatable, intent(in) :: rows(:, :)   !! time first; may be unallocated
      real(wp), intent(in) :: from
      real(wp), intent(in), optional :: to              !! default: any later time
      integer :: k
      changes = .false.
      if (.not. allocated(rows)) return
      do k = 2, size(rows, 2)
         if (.not. rows(1, k) > from) cycle
         if (present(to)) then
            if (.not. (rows(1, k - 1) < to .or. rows(1, k) <= to)) exit
         end if
         changes = changes .or. any(abs(rows(2:, k) - rows(2:, k - 1)) > 0)
      end do
   end function table_changes

   !> Factor of a line load at a time; 1 when there is no table.
   pure real(wp) function load_factor(table, t)
      real(wp), allocatable, intent(in) :: table(:, :)  !! (2, m) time, factor; may be unallocated or empty
      real(wp), intent(in) :: t                         !! [time]
      real(wp) :: value(1)
      load_factor = 1
      if (.not. allocated(table)) return
      if (size(table, 2) == 0) return
      value = table_value(table, t)
      load_factor = value(1)
   end function load_factor

   !> Integral of the factor of a table from time 0 to t.
   pure real(wp) function factor_integral(table, t) result(total)
      real(wp), allocatable, intent(in) :: table(:, :)   !! (2, m) time, factor; may be unallocated or empty
      real(wp), intent(in) :: t                          !! [time], >= 0
      real(wp) :: from, to
      integer :: k, m
      total = t
      if (.not. allocated(table)) return
      m = size(table, 2)
      if (m == 0) return
      ! constant before the first row and after the last one
      total = table(2, 1)*max(0.0_wp, min(t, table(1, 1))) + table(2, m)*max(0.0_wp, t - max(0.0_wp, table(1, m)))
      do k = 1, m - 1
         from = max(0.0_wp, table(1, k))
         to = min(t, table(1, k + 1))
         if (to > from) total = total + 0.5_wp*(to - from)*(value(from) + value(to))
      end do

   contains

      !> Factor between rows k and k + 1.
      pure real(wp) function value(at)
         real(wp), intent(in) :: at
         value = table(2, k) + (at - table(1, k))/(table(1, k + 1) - table(1, k))*(table(2, k + 1) - table(2, k))
      end function value

   end function factor_integral

   !> Acceleration of the base at a time: the table, zero before its first and after its last row, plus the
   !> harmonic terms A sin(2 pi f (t - t0) + phase), each zero before its start t0.
   pure function base_acceleration(motion, t) result(a)
      type(base_motion_type), intent(in) :: motion
      real(wp), intent(in) :: t    !! [time]
      real(wp) :: a(2)             !! (ax, ay) [length/time^2]
      real(wp) :: phase
      integer :: i, m
      a = 0
      if (allocated(motion%table)) then
         m = size(motion%table, 2)
         if (m > 0) then
            if (t >= motion%table(1, 1) .and. t <= motion%table(1, m)) a = table_value(motion%table, t)
         end if
      end if
      if (.not. allocated(motion%harmonics)) return
      do i = 1, size(motion%harmonics, 2)
         if (t < motion%harmonics(5, i)) cycle
         phase = 2*pi*motion%harmonics(3, i)*(t - motion%harmonics(5, i)) + motion%harmonics(4, i)
         a = a + sin(phase)*motion%harmonics(1:2, i)
      end do
   end function base_acceleration

end module rockdda_interaction_time_tables
