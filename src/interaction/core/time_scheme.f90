! SPDX-License-Identifier: MIT
!> Schemes of time integration: Shi's, and the generalised-alpha scheme of Chung and Hulbert (1993).
!>
!> With the motion d of a step, velocity v and acceleration a,
!>
!>     d  = v0 dt + dt**2 ((1/2 - beta) a0 + beta a1) + dt/2 w
!>     v1 = v0 + dt ((1 - gamma) a0 + gamma a1) + w
!>     M ((1 - alpha_m) a1 + alpha_m a0) = F at the level 1 - alpha_f of the step,      M w = dt F*
!>
!> F are the forces of all springs and loads, F* those of contacts that close in the step: they act at its end, as an
!> impulse, and leave no acceleration behind. Shi's scheme is beta = 1/2, gamma = 1, alpha_m = alpha_f = 0, for which F*
!> is a part of F. With a1 eliminated,
!>
!>     c/dt**2 M d - c/dt M v0 - (c/2 - 1) M a0 = F + c/2 F*,      c = (1 - alpha_m)/beta.
module rockdda_interaction_time_scheme
   use rockdda_base_kinds, only : wp
   implicit none
   private
   public :: time_scheme_type, shi_scheme, generalized_alpha, scheme_of_start, purpose

   !> What equations are for. Those of the start of a step are of motions from rest: velocities have no part in them.
   type :: purpose_enum
      integer :: step = 0            !! the motion of a step
      integer :: acceleration = 1    !! the accelerations at its start
      integer :: turning = 2         !! loads that turn with the blocks: of springs and loads, without dashpots
   end type purpose_enum
   type(purpose_enum), parameter :: purpose = purpose_enum()

   type :: time_scheme_type
      logical :: second_order = .false.    !! accelerations are carried from step to step
      real(wp) :: level = 1                !! 1 - alpha_f: where in the step springs and loads act
      real(wp) :: alpha_m = 0
      real(wp) :: beta = 0.5_wp, gamma = 1
      real(wp) :: inertia = 2              !! c
      real(wp) :: impact = 1               !! c/2: factor of the forces of contacts that close
      real(wp) :: carried = 0              !! of a static step: weight of the change of acceleration since the last step
      integer :: purpose = 0               !! one of purpose%...
      logical :: is_dynamic = .false.      !! velocities are carried on whole: a dynamic stage
   contains
      procedure :: middle
      procedure :: velocity_shares
      procedure :: velocity_of_motion
      procedure :: new_acceleration
      procedure :: velocity_change
      procedure :: inertia_work
   end type time_scheme_type

contains

   !> beta = 1/2, gamma = 1, all forces at the end of the step.
   pure type(time_scheme_type) function shi_scheme()
      shi_scheme = time_scheme_type()
   end function shi_scheme

   !> Equations of the start of a step: Shi's, with forces at this level of the step.
   pure type(time_scheme_type) function scheme_of_start(what_for, level) result(scheme)
      integer, intent(in) :: what_for        !! one of purpose%...
      real(wp), intent(in) :: level          !! 0: at the start
      scheme%purpose = what_for
      scheme%level = level
   end function scheme_of_start

   !> The scheme with the least dissipation of low frequencies for the spectral radius at high frequencies that is
   !> wanted (Chung and Hulbert 1993, Eqs. 17, 20, 25).
   pure type(time_scheme_type) function generalized_alpha(rho_infinity) result(scheme)
      real(wp), intent(in) :: rho_infinity   !! in [0, 1]
      real(wp) :: alpha_f
      alpha_f = rho_infinity/(rho_infinity + 1)
      scheme%second_order = .true.
      scheme%level = 1 - alpha_f
      scheme%alpha_m = (2*rho_infinity - 1)/(rho_infinity + 1)
      scheme%gamma = 0.5_wp - scheme%alpha_m + alpha_f
      scheme%beta = 0.25_wp*(1 - scheme%alpha_m + alpha_f)**2
      scheme%inertia = (1 - scheme%alpha_m)/scheme%beta
      scheme%impact = 0.5_wp*scheme%inertia
   end function generalized_alpha

   !> Where in the step a load acts that is given by its mean: the middle of the time that it is the mean of.
   pure real(wp) function middle(self)
      class(time_scheme_type), intent(in) :: self
      middle = 0.5_wp
      if (self%second_order) middle = self%level
   end function middle

   !> Velocity where the forces of a step act, by its motion and what it starts with: r d/dt + (1 - r) v0 + s dt a0, in
   !> which contacts that close have no part. In Shi's scheme d/dt, its mean.
   pure subroutine velocity_shares(self, r, s)
      class(time_scheme_type), intent(in) :: self
      real(wp), intent(out) :: r, s
      r = 1
      s = 0
      if (.not. self%second_order) return
      r = self%level*self%gamma/self%beta
      s = self%level - 0.5_wp*r
   end subroutine velocity_shares

   !> Velocity at the end of a step for a motion of dt, all else zero.
   pure real(wp) function velocity_of_motion(self)
      class(time_scheme_type), intent(in) :: self
      velocity_of_motion = merge(self%gamma/self%beta, 2.0_wp, self%second_order)
   end function velocity_of_motion

   !> Acceleration at the end of the step.
   elemental real(wp) function new_acceleration(self, d, velocity, acceleration, jump, dt) result(a)
      class(time_scheme_type), intent(in) :: self
      real(wp), intent(in) :: d                          !! motion of the step
      real(wp), intent(in) :: velocity, acceleration     !! at its start
      real(wp), intent(in) :: jump                       !! w
      real(wp), intent(in) :: dt                         !! step [time], > 0
      a = (d - dt*velocity - 0.5_wp*dt*jump - (0.5_wp - self%beta)*dt**2*acceleration)/(self%beta*dt**2)
   end function new_acceleration

   !> v1 - v0, with the acceleration at the end.
   elemental real(wp) function velocity_change(self, acceleration, new, jump, dt) result(change)
      class(time_scheme_type), intent(in) :: self
      real(wp), intent(in) :: acceleration, new          !! at the start and the end of the step
      real(wp), intent(in) :: jump                       !! w
      real(wp), intent(in) :: dt                         !! step [time]
      change = dt*((1 - self%gamma)*acceleration + self%gamma*new) + jump
   end function velocity_change

   !> Work of all forces on a block in the step, d.M ((1 - alpha_m) a1 + alpha_m a0 + w/dt).
   pure real(wp) function inertia_work(self, momentum, acceleration, new, jump, dt) result(work)
      class(time_scheme_type), intent(in) :: self
      real(wp), intent(in) :: momentum(6)                !! M d
      real(wp), intent(in) :: acceleration(6), new(6)    !! at the start and the end of the step
      real(wp), intent(in) :: jump(6)                    !! w
      real(wp), intent(in) :: dt                         !! step [time]
      work = dot_product(momentum, (1 - self%alpha_m)*new + self%alpha_m*acceleration + jump/dt)
   end function inertia_work

end module rockdda_interaction_time_scheme
