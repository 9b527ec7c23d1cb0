! SPDX-License-Identifier: MIT
!> Fixed points and points with a prescribed movement: two equal springs to a target.
!>
!> Source: thesis Eqs. 3.11, 3.11.1 (fixed point), with the movement so far kept so that the point does not drift:
!> the spring is as long as moved - target, where `moved` is the displacement of the point since the start and
!> `target` the prescribed one (zero for a fixed point).
module rockdda_interaction_points
   use rockdda_base_kinds, only : wp
   use rockdda_interaction_kinematics, only : displacement_rows, point_load
   implicit none
   private
   public :: add_point_spring, support_energy

contains

   !> Spring of a point to its target: p T^T T to the stiffness, p T^T (target - moved) to the load;
   !> potential 1/2 p |moved + T d - target|**2.
   pure subroutine add_point_spring(p, point, centroid, moved, target, k, f)
      real(wp), intent(in) :: p             !! stiffness [force/length], > 0
      real(wp), intent(in) :: point(2)      !! where the point is at the start of the step [length]
      real(wp), intent(in) :: centroid(2)   !! of the block [length]
      real(wp), intent(in) :: moved(2)      !! its displacement since the start [length]
      real(wp), intent(in) :: target(2)     !! prescribed displacement at the end of the step [length]
      real(wp), intent(inout) :: k(6, 6)    !! diagonal block
      real(wp), intent(inout) :: f(6)       !! load
      real(wp) :: t(2, 6)
      integer :: j
      t = displacement_rows(point, centroid)
      do j = 1, 6
         k(:, j) = k(:, j) + p*(t(1, :)*t(1, j) + t(2, :)*t(2, j))
      end do
      f = f + point_load(p*(target - moved), point, centroid)
   end subroutine add_point_spring

   !> Energy of one step of a point spring; its stretch goes from x0 to x1 and its target moves by dx. With the
   !> force -p x1 of the support on the block in the step,
   !>
   !>     external - (work on the block) = -p x1.dx + p x1.(x1 - x0 + dx) = stored + dissipated.
   pure subroutine support_energy(p, x0, x1, dx, stored, dissipated, external)
      real(wp), intent(in) :: p             !! stiffness [force/length]
      real(wp), intent(in) :: x0(2)         !! moved - target at the start of the step, old target [length]
      real(wp), intent(in) :: x1(2)         !! moved + T d - target at the end of the step, new target [length]
      real(wp), intent(in) :: dx(2)         !! movement of the target in the step [length]
      real(wp), intent(out) :: stored       !! 1/2 p (x1**2 - x0**2) [energy]
      real(wp), intent(out) :: dissipated   !! 1/2 p (x1 - x0)**2 [energy], >= 0
      real(wp), intent(out) :: external     !! work of whoever moves the target [energy]
      stored = 0.5_wp*p*dot_product(x1 - x0, x1 + x0)
      dissipated = 0.5_wp*p*dot_product(x1 - x0, x1 - x0)
      external = -p*dot_product(x1, dx)
   end subroutine support_energy

end module rockdda_interaction_points
