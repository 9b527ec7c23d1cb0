! SPDX-License-Identifier: MIT
!> Inertia and mass-proportional damping of one block.
!>
!> Source: thesis Eqs. 3.10.3, 3.10.4 and 3.23, Newmark with beta = 1/2, gamma = 1: the acceleration is constant
!> in the step,
!>
!>     d = v0 dt + a dt**2/2,   v1 = 2/dt d - v0,
!>
!> and the inertia force is M a = 2/dt**2 M d - 2/dt M v0. Its work in a step is the change of the kinetic
!> energy: d.M(v1 - v0)/dt = 1/2 v1.M v1 - 1/2 v0.M v0.
!> Not here: M itself (rockdda_interaction_kinematics), the share k01 of v1 that the next step starts with.
module rockdda_interaction_inertia
   use rockdda_base_kinds, only : wp
   implicit none
   private
   public :: add_inertia, new_velocity, add_mass_damping, mass_damping_dissipation

contains

   !> Inertia of one step: 2/dt**2 M to the stiffness, 2/dt M v to the load.
   pure subroutine add_inertia(m, velocity, dt, k, f)
      real(wp), intent(in) :: m(6, 6)        !! mass matrix
      real(wp), intent(in) :: velocity(6)    !! at the start of the step
      real(wp), intent(in) :: dt             !! step [time], > 0
      real(wp), intent(inout) :: k(6, 6)     !! diagonal block
      real(wp), intent(inout) :: f(6)        !! load
      k = k + (2/dt**2)*m
      f = f + (2/dt)*matmul(m, velocity)
   end subroutine add_inertia

   !> Velocity at the end of the step.
   pure function new_velocity(d, velocity, dt) result(v)
      real(wp), intent(in) :: d(6)           !! unknowns of the step
      real(wp), intent(in) :: velocity(6)    !! at the start of the step
      real(wp), intent(in) :: dt             !! step [time], > 0
      real(wp) :: v(6)
      v = (2/dt)*d - velocity
   end function new_velocity

   !> Damping force -alpha M d/dt of one step: alpha/dt M to the stiffness.
   pure subroutine add_mass_damping(alpha, m, dt, k)
      real(wp), intent(in) :: alpha          !! coefficient [1/time], >= 0
      real(wp), intent(in) :: m(6, 6)        !! mass matrix
      real(wp), intent(in) :: dt             !! step [time], > 0
      real(wp), intent(inout) :: k(6, 6)     !! diagonal block
      k = k + (alpha/dt)*m
   end subroutine add_mass_damping

   !> Energy that mass-proportional damping takes in a step: alpha/dt d.M d.
   pure real(wp) function mass_damping_dissipation(alpha, m, dt, d)
      real(wp), intent(in) :: alpha          !! coefficient [1/time]
      real(wp), intent(in) :: m(6, 6)        !! mass matrix
      real(wp), intent(in) :: dt             !! step [time], > 0
      real(wp), intent(in) :: d(6)           !! unknowns of the step
      mass_damping_dissipation = alpha/dt*dot_product(d, matmul(m, d))
   end function mass_damping_dissipation

end module rockdda_interaction_inertia
