! SPDX-License-Identifier: MIT
!> Loads of one block as generalised forces, and their values in time.
!>
!> Source: thesis 3.2: a force f at (x, y) has the potential -u.f and the load T^T f (Eqs. 3.7,
!> 3.7.1; `point_load` of rockdda_interaction_kinematics). The work of a load in a step is its load
!> vector times d, exactly.
!> Loads act where their points are at the start of the step, with the value of its end.
module rockdda_interaction_loads
   use rockdda_base_kinds, only : wp, pi
   use rockdda_interaction_kinematics, only : point_load
   use rockdda_model_options, only : base_motion_type
   implicit none
   private
   public :: body_force, line_load, table_value, load_factor, base_acceleration

contains

   !> Load of a uniform acceleration field: m a at the centroid (Eqs. 3.9, 3.9.1, the second entry being f_y S).
   !> Gravity is a = (0, -g); a base that moves with acceleration a_b gives a = -a_b.
   pure function body_force(mass, acceleration) result(f)
      real(wp), intent(in) :: mass             !! of the block [mass]
      real(wp), intent(in) :: acceleration(2)  !! (ax, ay) [length/time^2]
      real(wp) :: f(6)                         !! load
      f = 0
      f(1:2) = mass*acceleration
   end function body_force

   !> Load of a force per length along a segment, linear between its ends (Eq. 3.8.1; its
   !> potential, Eq. 3.8, is the negative of this load times d), integrated exactly:
   !> T and the force are both linear along the segment, so that the integral of their product over the length
   !> l is l (T_s^T (2 f_s + f_q) + T_q^T (f_s + 2 f_q))/6.
   pure function line_load(s, q, centroid, force_s, force_q) result(f)
      real(wp), intent(in) :: s(2), q(2)    !! ends of the segment [length]
      real(wp), intent(in) :: centroid(2)   !! of the block [length]
      real(wp), intent(in) :: force_s(2)    !! (fx, fy) at s [force/length]
      real(wp), intent(in) :: force_q(2)    !! (fx, fy) at q [force/length]
      real(wp) :: f(6)                      !! load
      real(wp) :: l
      l = norm2(q - s)
      f = point_load(l/6*(2*force_s + force_q), s, centroid) + point_load(l/6*(force_s + 2*force_q), q, centroid)
   end function line_load

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

end module rockdda_interaction_loads
