! SPDX-License-Identifier: MIT
!> Motion of the ground by records: acceleration, and its integrals in closed form.
!>
!> Between its rows a record is linear; before the first and after the last one the acceleration is zero. Velocity and
!> displacement begin with zero at the first row, or, where that stands before t = 0, the displacement at t = 0. They
!> are the exact integrals of these straight lines,
!>
!>     v = v_k + a_k s + j s**2/2,   u = u_k + v_k s + a_k s**2/2 + j s**3/6,
!>     s = t - t_k,   j = (a_k+1 - a_k)/(t_k+1 - t_k);
!>
!> after the last row the velocity stays.
module rockdda_interaction_ground_motion
   use rockdda_base_kinds, only : wp
   use rockdda_model_options, only : quake_type
   use rockdda_model_quake_options, only : acts_as
   implicit none
   private
   public :: ground_motion_type

   !> One record, scaled.
   type :: record_type
      character(len=:), allocatable :: apply   !! as in the options
      real(wp) :: direction(2) = 0             !! unit vector
      real(wp), allocatable :: time(:)
      real(wp), allocatable :: acceleration(:), velocity(:), displacement(:)   !! at these times
   end type record_type

   !> All records of a run.
   type :: ground_motion_type
      type(record_type), allocatable, private :: records(:)
   contains
      procedure :: init
      procedure :: acts
      procedure :: mean_acceleration
      procedure :: velocity
      procedure :: displacement
      procedure :: largest_velocity
   end type ground_motion_type

contains

   !> Scale and integrate the records.
   pure subroutine init(self, quakes)
      class(ground_motion_type), intent(inout) :: self
      type(quake_type), allocatable, intent(in) :: quakes(:)
      real(wp) :: dt, at_start(2)
      integer :: i, k, n
      if (allocated(self%records)) deallocate (self%records)
      n = 0
      if (allocated(quakes)) n = size(quakes)
      allocate (self%records(n))
      do i = 1, n
         associate (record => self%records(i), quake => quakes(i))
            record%apply = 'base_acceleration'
            if (acts_as(quake, 'base_motion')) record%apply = 'base_motion'
            if (acts_as(quake, 'viscous_base')) record%apply = 'viscous_base'
            record%direction = [1.0_wp, 0.0_wp]
            if (quake%direction == 'y') record%direction = [0.0_wp, 1.0_wp]
            record%time = quake%rows(1, :)
            record%acceleration = quake%scale*quake%rows(2, :)
            allocate (record%velocity(size(record%time)), record%displacement(size(record%time)), source=0.0_wp)
            do k = 2, size(record%time)
               dt = record%time(k) - record%time(k - 1)
               associate (a0 => record%acceleration(k - 1), a1 => record%acceleration(k), v0 => record%velocity(k - 1))
                  record%velocity(k) = v0 + 0.5_wp*dt*(a0 + a1)
                  record%displacement(k) = record%displacement(k - 1) + dt*(v0 + dt*(2*a0 + a1)/6)
               end associate
            end do
            ! the ground is where it is at t = 0, regardless of the record before
            at_start = motion_at(record, 0.0_wp)
            record%displacement = record%displacement - at_start(2)
         end associate
      end do
   end subroutine init

   !> Is there a record that is applied in this way?
   pure logical function acts(self, apply)
      class(ground_motion_type), intent(in) :: self
      character(len=*), intent(in) :: apply
      integer :: i
      acts = .false.
      if (.not. allocated(self%records)) return
      do i = 1, size(self%records)
         acts = acts .or. self%records(i)%apply == apply
      end do
   end function acts

   !> Mean acceleration from t0 to t1, exactly; zero where both are so far away that they are one number.
   pure function mean_acceleration(self, apply, t0, t1) result(a)
      class(ground_motion_type), intent(in) :: self
      character(len=*), intent(in) :: apply
      real(wp), intent(in) :: t0, t1       !! [time], t1 >= t0
      real(wp) :: a(2)                     !! [length/time^2]
      a = 0
      if (t1 > t0 .and. self%acts(apply)) a = (self%velocity(apply, t1) - self%velocity(apply, t0))/(t1 - t0)
   end function mean_acceleration

   !> Velocity of the ground by all records that are applied in this way.
   pure function velocity(self, apply, t) result(v)
      class(ground_motion_type), intent(in) :: self
      character(len=*), intent(in) :: apply
      real(wp), intent(in) :: t            !! [time]
      real(wp) :: v(2)                     !! [length/time]
      real(wp) :: motion(2)
      integer :: i
      v = 0
      if (.not. allocated(self%records)) return
      do i = 1, size(self%records)
         if (self%records(i)%apply /= apply) cycle
         motion = motion_at(self%records(i), t)
         v = v + motion(1)*self%records(i)%direction
      end do
   end function velocity

   !> Displacement of the ground by all records that are applied in this way.
   pure function displacement(self, apply, t) result(u)
      class(ground_motion_type), intent(in) :: self
      character(len=*), intent(in) :: apply
      real(wp), intent(in) :: t            !! [time]
      real(wp) :: u(2)                     !! [length]
      real(wp) :: motion(2)
      integer :: i
      u = 0
      if (.not. allocated(self%records)) return
      do i = 1, size(self%records)
         if (self%records(i)%apply /= apply) cycle
         motion = motion_at(self%records(i), t)
         u = u + motion(2)*self%records(i)%direction
      end do
   end function displacement

   !> Largest velocity at the rows of any record, of either sign.
   pure real(wp) function largest_velocity(self)
      class(ground_motion_type), intent(in) :: self
      integer :: i
      largest_velocity = 0
      do i = 1, size(self%records)
         largest_velocity = max(largest_velocity, maxval(abs(self%records(i)%velocity)))
      end do
   end function largest_velocity

   !> Velocity and displacement of one record.
   pure function motion_at(record, t) result(motion)
      type(record_type), intent(in) :: record
      real(wp), intent(in) :: t            !! [time]
      real(wp) :: motion(2)
      real(wp) :: s, slope
      integer :: low, high, middle, n
      n = size(record%time)
      motion = 0
      if (n == 0) return
      if (t <= record%time(1)) return
      if (t >= record%time(n)) then
         motion = [record%velocity(n), record%displacement(n) + (t - record%time(n))*record%velocity(n)]
         return
      end if
      low = 1      ! time(low) <= t < time(high)
      high = n
      do while (high - low > 1)
         middle = (low + high)/2
         if (record%time(middle) <= t) then
            low = middle
         else
            high = middle
         end if
      end do
      s = t - record%time(low)
      associate (a => record%acceleration(low))
         slope = (record%acceleration(high) - a)/(record%time(high) - record%time(low))
         motion(1) = record%velocity(low) + s*(a + 0.5_wp*s*slope)
         motion(2) = record%displacement(low) + s*(record%velocity(low) + s*(0.5_wp*a + s*slope/6))
      end associate
   end function motion_at

end module rockdda_interaction_ground_motion
