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
   public :: mean_load, mean_displacement, end_displacement, end_point, mean_vectors, end_lengths

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

   !> Arm of a point: from the centroid of its block, at the start and in the middle of the step [length].
   type :: arm_type
      real(wp) :: start(2), mid(2)
   end type arm_type

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

   !> Load of a force at a point over the step, `point_load` on the arm of its middle: load . d is the work for the
   !> expected rotation.
   pure function mean_load(force, point, block) result(f)
      real(wp), intent(in) :: force(2)               !! [force]
      real(wp), intent(in) :: point(2)               !! at the start of the step [length]
      type(moving_block_type), intent(in) :: block
      real(wp) :: f(6)                               !! [force, force length]
      f = load_on(force, new_arm(point, block), block)
   end function mean_load

   !> Displacement T d with the T of `mean_load`.
   pure function mean_displacement(d, point, block) result(u)
      real(wp), intent(in) :: d(6)
      real(wp), intent(in) :: point(2)               !! at the start of the step [length]
      type(moving_block_type), intent(in) :: block
      real(wp) :: u(2)                               !! [length]
      u = displacement_on(d, new_arm(point, block), block)
   end function mean_displacement

   !> Arm of a point: from the centroid to the point, at the start and in the middle of the step.
   pure type(arm_type) function new_arm(point, block) result(arm)
      real(wp), intent(in) :: point(2)               !! at the start of the step [length]
      type(moving_block_type), intent(in) :: block
      arm%start = point - block%centroid
      arm%mid = arm%start
      if (abs(block%angle) > 0) arm%mid = block%chord*turned(arm%start, block%half)
   end function new_arm

   !> `mean_load` on an arm.
   pure function load_on(force, arm, block) result(f)
      real(wp), intent(in) :: force(2)
      type(arm_type), intent(in) :: arm
      type(moving_block_type), intent(in) :: block
      real(wp) :: f(6)
      real(wp) :: back(2)
      associate (x => arm%start)
         back = force
         if (abs(block%angle) > 0) back = turned(force, [block%full(1), -block%full(2)])
         f = [force(1), force(2), arm%mid(1)*force(2) - arm%mid(2)*force(1), x(1)*back(1), x(2)*back(2), &
              0.5_wp*(x(2)*back(1) + x(1)*back(2))]
      end associate
   end function load_on

   !> `mean_displacement` of a point with an arm.
   pure function displacement_on(d, arm, block) result(u)
      real(wp), intent(in) :: d(6)
      type(arm_type), intent(in) :: arm
      type(moving_block_type), intent(in) :: block
      real(wp) :: u(2)
      associate (x => arm%start)
         if (abs(block%angle) <= 0) then
            ! in the order of `displacement_at`
            u(1) = d(1) - d(3)*x(2) + d(4)*x(1) + 0.5_wp*d(6)*x(2)
            u(2) = d(2) + d(3)*x(1) + d(5)*x(2) + 0.5_wp*d(6)*x(1)
         else
            u = d(1:2) + d(3)*[-arm%mid(2), arm%mid(1)] + &
                turned([d(4)*x(1) + 0.5_wp*d(6)*x(2), d(5)*x(2) + 0.5_wp*d(6)*x(1)], block%full)
         end if
      end associate
   end function displacement_on

   !> Displacement of a point with exact rotation.
   pure function end_displacement(block, point) result(u)
      type(moved_block_type), intent(in) :: block
      real(wp), intent(in) :: point(2)               !! at the start of the step [length]
      real(wp) :: u(2)                               !! [length]
      u = block%shift + times(block%gradient, point - block%centroid)
   end function end_displacement

   !> Place of a point at the end of a step.
   pure function end_point(block, point) result(p)
      type(moved_block_type), intent(in) :: block
      real(wp), intent(in) :: point(2)               !! at the start of the step [length]
      real(wp) :: p(2)                               !! [length]
      p = point + block%shift + times(block%gradient, point - block%centroid)
   end function end_point

   !> Vectors of gap (1) and slip (2) of a contact over the step: with the expected motion, gap + e.d_a + g.d_b is the
   !> gap at the end of the step, and the slip is measured along the edge as it lies there. See `spring_vectors`
   !> (rockdda_interaction_contact_lengths), which these become without a rotation. `gap` is that of the points.
   pure subroutine mean_vectors(p, gap, normal, a, b, e, g)
      real(wp), intent(in) :: p(2)                   !! vertex of block a at the start of the step [length]
      real(wp), intent(in) :: gap                    !! there [length]
      real(wp), intent(in) :: normal(2)              !! outward unit normal of the edge of block b, there
      type(moving_block_type), intent(in) :: a, b
      real(wp), intent(out) :: e(6, 2)               !! with respect to d_a
      real(wp), intent(out) :: g(6, 2)               !! with respect to d_b
      real(wp) :: tangent(2), mid_normal(2), mid_tangent(2), foot(2), moved(2), apart(2), slid(2), shear(3)
      type(arm_type) :: on_a, on_foot, on_b
      tangent = [-normal(2), normal(1)]
      foot = p - gap*normal
      on_a = new_arm(p, a)
      on_foot = new_arm(foot, b)
      on_b = new_arm(p, b)
      mid_normal = turned(normal, b%half)
      mid_tangent = [-mid_normal(2), mid_normal(1)]
      moved = displacement_on(a%d, on_a, a)
      ! from the foot to the vertex, and from the point of b where the vertex was, at the end of the step
      apart = gap*normal + (moved - displacement_on(b%d, on_foot, b))
      slid = moved - displacement_on(b%d, on_b, b)
      ! the edge turns by shear.(ex ey gxy) in the axes of its block
      shear = [normal(1)*tangent(1), normal(2)*tangent(2), 0.5_wp*(normal(1)*tangent(2) + normal(2)*tangent(1))]
      e(:, 1) = load_on(b%half(1)*mid_normal, on_a, a)
      g(:, 1) = -load_on(b%half(1)*mid_normal, on_foot, b)
      g(3, 1) = g(3, 1) + 0.5_wp*b%chord*dot_product(mid_tangent, apart + gap*normal)
      g(4:6, 1) = g(4:6, 1) - dot_product(turned(tangent, b%full), apart)*shear
      e(:, 2) = load_on(b%half(1)*mid_tangent, on_a, a)
      g(:, 2) = -load_on(b%half(1)*mid_tangent, on_b, b)
      g(3, 2) = g(3, 2) - 0.5_wp*b%chord*dot_product(mid_normal, slid)
      g(4:6, 2) = g(4:6, 2) + dot_product(turned(normal, b%full), slid)*shear
   end subroutine mean_vectors

   !> Gap and slip at the end of a step, exactly.
   pure function end_lengths(p, gap, normal, a, b) result(lengths)
      real(wp), intent(in) :: p(2)                   !! vertex of block a at the start of the step [length]
      real(wp), intent(in) :: gap                    !! there [length]
      real(wp), intent(in) :: normal(2)              !! of the edge of block b, there
      type(moved_block_type), intent(in) :: a, b
      real(wp) :: lengths(2)                         !! gap, slip [length]
      real(wp) :: moved(2), t(2), x(2)
      t = [-normal(2), normal(1)]
      t = t + times(b%gradient, t)
      t = t/sqrt(t(1)**2 + t(2)**2)
      moved = end_displacement(a, p) - b%shift
      x = gap*normal + moved - times(b%gradient, p - gap*normal - b%centroid)
      lengths(1) = t(2)*x(1) - t(1)*x(2)
      x = moved - times(b%gradient, p - b%centroid)
      lengths(2) = t(1)*x(1) + t(2)*x(2)
   end function end_lengths

end module rockdda_interaction_finite_rotation
