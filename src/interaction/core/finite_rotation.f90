! SPDX-License-Identifier: MIT
!> Rotation of blocks within a step: arms at mid-step, with which lengths are exact at the end of the step.
!>
!> A block turns by r, R = R(r), and a point at a from its centroid goes to u + R (1 + E) a. By
!>
!>     R(r) - 1 = 2 sin(r/2) J R(r/2),      J = [0 -1; 1 0]
!>
!> its displacement is u + r q J R(r/2) a + R E a with q = 2 sin(r/2)/r: linear in the unknowns once the angle in q and
!> R is given. The angle is that of an expected motion. When the solution turns the block by just this angle,
!> displacements T d are exact, and a force does the work T^T f . d = f . displacement: it acts on the arm of the middle
!> of the step. Without a rotation everything here is the T of rockdda_interaction_kinematics.
!>
!> Products of two lengths that both change are taken by the rule r1.n1 - r0.n0 = (r1 - r0).(n1 + n0)/2 +
!> (r1 + r0)/2.(n1 - n0), which is exact.
module rockdda_interaction_finite_rotation
   use, intrinsic :: iso_c_binding, only : c_double
   use rockdda_base_kinds, only : wp
   use rockdda_interaction_kinematics, only : displacement_gradient, direction
   implicit none
   private
   public :: moving_block_type, new_moving_block, moved_block_type, new_moved_block, turns
   public :: mean_load, mean_displacement, end_displacement

   !> Smaller angles are rounding. Much larger ones matter where stiff ties join many blocks.
   real(wp), parameter :: least_angle = 1.0e-12_wp

   !> A block and its expected motion. contact_kernels_shim.c has the same.
   type, bind(c) :: moving_block_type
      real(c_double) :: centroid(2) = 0   !! at the start of the step [length]
      real(c_double) :: d(6) = 0          !! expected motion
      real(c_double) :: angle = 0         !! expected rotation, 0 if it is negligible [rad]
      real(c_double) :: half(2) = [1.0_c_double, 0.0_c_double]   !! cosine and sine of angle/2
      real(c_double) :: full(2) = [1.0_c_double, 0.0_c_double]   !! cosine and sine of the angle
      real(c_double) :: chord = 1         !! 2 sin(angle/2)/angle
   end type moving_block_type

   !> A block and a motion that was found, with exact rotation: all that its points need. contact_kernels_shim.c has the
   !> same.
   type, bind(c) :: moved_block_type
      real(c_double) :: centroid(2) = 0      !! at the start of the step [length]
      real(c_double) :: shift(2) = 0         !! of the centroid [length]
      real(c_double) :: gradient(2, 2) = 0   !! of the displacement
   end type moved_block_type

contains

   !> A block with the motion that is expected of it.
   pure type(moving_block_type) function new_moving_block(centroid, d) result(block)
      real(wp), intent(in) :: centroid(2)   !! at the start of the step [length]
      real(wp), intent(in) :: d(6)
      block%centroid = centroid
      block%d = d
      if (.not. turns(d)) return
      block%angle = d(3)
      block%half = direction(0.5_wp*d(3))
      block%full = direction(d(3))
      block%chord = 2*block%half(2)/d(3)
   end function new_moving_block

   !> A block with a motion that was found.
   pure type(moved_block_type) function new_moved_block(centroid, d, exact) result(block)
      real(wp), intent(in) :: centroid(2)   !! at the start of the step [length]
      real(wp), intent(in) :: d(6)
      logical, intent(in), optional :: exact   !! exact rotation (default), else linear
      block%centroid = centroid
      block%shift = d(1:2)
      block%gradient = 0
      if (all(abs(d) <= 0)) return   ! of blocks asleep
      block%gradient = displacement_gradient(d, .true.)
      if (present(exact)) then
         if (.not. exact) block%gradient = displacement_gradient(d, .false.)
      end if
   end function new_moved_block

   !> Does a motion turn the block by an angle that is not negligible?
   pure logical function turns(d)
      real(wp), intent(in) :: d(6)
      turns = abs(d(3)) > least_angle
   end function turns

   !> A vector turned by an angle, of which cosine and sine are given.
   pure function turned(v, angle)
      real(wp), intent(in) :: v(2), angle(2)
      real(wp) :: turned(2)
      turned = [angle(1)*v(1) - angle(2)*v(2), angle(2)*v(1) + angle(1)*v(2)]
   end function turned

   !> h v, without a call.
   pure function times(h, v)
      real(wp), intent(in) :: h(2, 2), v(2)
      real(wp) :: times(2)
      times = h(:, 1)*v(1) + h(:, 2)*v(2)
   end function times

   !> Load T^T f of a force at a point over the step (thesis Eqs. 3.7, 3.7.1), on the arm of its middle: load . d is the
   !> work for the expected rotation.
   pure function mean_load(force, point, block) result(f)
      real(wp), intent(in) :: force(2)               !! [force]
      real(wp), intent(in) :: point(2)               !! at the start of the step [length]
      type(moving_block_type), intent(in) :: block
      real(wp) :: f(6)                               !! [force, force length]
      real(wp) :: x(2), mid(2), back(2)
      x = point - block%centroid
      mid = middle_arm(x, block)
      back = force
      if (abs(block%angle) > 0) back = turned(force, [block%full(1), -block%full(2)])
      f = [force(1), force(2), mid(1)*force(2) - mid(2)*force(1), x(1)*back(1), x(2)*back(2), &
           0.5_wp*(x(2)*back(1) + x(1)*back(2))]
   end function mean_load

   !> Displacement T d with the T of `mean_load`.
   pure function mean_displacement(d, point, block) result(u)
      real(wp), intent(in) :: d(6)
      real(wp), intent(in) :: point(2)               !! at the start of the step [length]
      type(moving_block_type), intent(in) :: block
      real(wp) :: u(2)                               !! [length]
      real(wp) :: x(2), mid(2)
      x = point - block%centroid
      if (abs(block%angle) <= 0) then
         ! in the order of `displacement_at`
         u(1) = d(1) - d(3)*x(2) + d(4)*x(1) + 0.5_wp*d(6)*x(2)
         u(2) = d(2) + d(3)*x(1) + d(5)*x(2) + 0.5_wp*d(6)*x(1)
      else
         mid = middle_arm(x, block)
         u = d(1:2) + d(3)*[-mid(2), mid(1)] + &
             turned([d(4)*x(1) + 0.5_wp*d(6)*x(2), d(5)*x(2) + 0.5_wp*d(6)*x(1)], block%full)
      end if
   end function mean_displacement

   !> Arm of a point in the middle of the step.
   pure function middle_arm(x, block) result(mid)
      real(wp), intent(in) :: x(2)                   !! from the centroid, at the start [length]
      type(moving_block_type), intent(in) :: block
      real(wp) :: mid(2)
      mid = x
      if (abs(block%angle) > 0) mid = block%chord*turned(x, block%half)
   end function middle_arm

   !> Displacement of a point with exact rotation.
   pure function end_displacement(block, point) result(u)
      type(moved_block_type), intent(in) :: block
      real(wp), intent(in) :: point(2)               !! at the start of the step [length]
      real(wp) :: u(2)                               !! [length]
      u = block%shift + times(block%gradient, point - block%centroid)
   end function end_displacement

end module rockdda_interaction_finite_rotation
