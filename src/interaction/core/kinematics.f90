! SPDX-License-Identifier: MIT
!> Displacement field of one block: how its six unknowns move points, mass and stress.
!>
!> Source: Shi's block kinematics (thesis Eq. 3.2): the displacement of the point (x, y) is T(x, y) d, with
!>
!>     T = [ 1  0  -(y-yc)  (x-xc)     0     (y-yc)/2 ]
!>         [ 0  1   (x-xc)     0    (y-yc)   (x-xc)/2 ]
!>
!> Unknowns per block: d = (u0, v0, r0, ex, ey, gxy) [length, length, rad, -, -, -], about the centroid
!> (xc, yc) at the start of the step; gxy is the engineering shear strain. Unit thickness.
!> Not here: polygons and their moments (rockdda_geometry), the springs (rockdda_interaction_contact_lengths).
!>
!> The affine motion of a block since it was drawn, by its vertices: by it points move that are fixed to the block.
module rockdda_interaction_kinematics
   use rockdda_base_kinds, only : wp
   use rockdda_model_blocks, only : block_system_type
   implicit none
   private
   public :: displacement_at, displacement_gradient, move_point, move_points, direction, mass_matrix, mass_times, &
      rotate_stress, rotate_strain_rate, logarithmic_strain, affine_motion

contains

   !> First-order displacement T d of one point (thesis Eq. 3.2), or its velocity when d is a velocity.
   pure function displacement_at(d, point, centroid) result(u)
      real(wp), intent(in) :: d(6)         !! unknowns of the block
      real(wp), intent(in) :: point(2)     !! [length]
      real(wp), intent(in) :: centroid(2)  !! of the block [length]
      real(wp) :: u(2)                     !! [length]
      real(wp) :: x, y
      x = point(1) - centroid(1)
      y = point(2) - centroid(2)
      u(1) = d(1) - d(3)*y + d(4)*x + 0.5_wp*d(6)*y
      u(2) = d(2) + d(3)*x + d(5)*y + 0.5_wp*d(6)*x
   end function displacement_at

   !> Gradient H of the motion of a step: a point moves by (u0, v0) + H (x - c).
   !>
   !> linear: H = e + r0 J with J = [0 -1; 1 0]: thesis Eq. 3.2. A finite r0 then stretches the block by
   !> sqrt(1 + r0**2) in all directions.
   !>
   !> exact: I + H = R (I + e), R the rotation by r0, e = [ex gxy/2; gxy/2 ey]: the block is strained along the
   !> axes in which the step measured the strain (those of its start) and then turned, the polar decomposition
   !> of the motion. A pure rotation is then an isometry, the stress at the end is the one that the step
   !> computed turned by the same R (`rotate_stress`), and to first order in d it is T d. Straining after the
   !> turn, (I + e) R, agrees to first order too, but would strain along axes that the computed strain does not
   !> belong to.
   pure function displacement_gradient(d, exact) result(h)
      real(wp), intent(in) :: d(6)    !! unknowns of the step
      logical, intent(in) :: exact    !! exact rotation, else linear
      real(wp) :: h(2, 2)             !! [-]
      real(wp) :: s, c1, shear
      shear = 0.5_wp*d(6)
      if (exact) then
         s = sine(d(3))
         c1 = -2*sine(0.5_wp*d(3))**2     ! cos(r0) - 1 without cancellation
         ! strain, turn, and turn times strain
         h(1, 1) = (d(4) + c1) + (c1*d(4) - s*shear)
         h(2, 1) = (shear + s) + (s*d(4) + c1*shear)
         h(1, 2) = (shear - s) + (c1*shear - s*d(5))
         h(2, 2) = (d(5) + c1) + (s*shear + c1*d(5))
      else
         h(:, 1) = [d(4), shear + d(3)]
         h(:, 2) = [shear - d(3), d(5)]
      end if
   end function displacement_gradient

   !> Sine of an angle. That of a block that hardly turns is the angle, to the last bit.
   elemental real(wp) function sine(angle)
      real(wp), intent(in) :: angle   !! [rad]
      sine = angle
      if (.not. is_tiny(angle)) sine = sin(angle)
   end function sine

   !> Cosine and sine of an angle.
   pure function direction(angle)
      real(wp), intent(in) :: angle   !! [rad]
      real(wp) :: direction(2)
      if (is_tiny(angle)) then
         direction = [1.0_wp, angle]
      else
         direction = [cos(angle), sin(angle)]
      end if
   end function direction

   !> Is the cosine of an angle 1, and its sine the angle, to the last bit?
   elemental logical function is_tiny(angle)
      real(wp), intent(in) :: angle   !! [rad]
      is_tiny = angle**2 < 0.5_wp*epsilon(angle)
   end function is_tiny

   !> Move one point of a block by the unknowns of a step; see `displacement_gradient` for the two rules.
   !> The centroid moves by exactly (u0, v0).
   pure subroutine move_point(d, centroid, exact, point)
      real(wp), intent(in) :: d(6)             !! unknowns of the step
      real(wp), intent(in) :: centroid(2)      !! at the start of the step [length]
      logical, intent(in) :: exact             !! exact rotation, else linear
      real(wp), intent(inout) :: point(2)      !! from start to end of the step [length]
      real(wp) :: h(2, 2)
      h = displacement_gradient(d, exact)
      point = point + d(1:2) + matmul(h, point - centroid)
   end subroutine move_point

   !> Move many points of one block.
   pure subroutine move_points(d, centroid, exact, points)
      real(wp), intent(in) :: d(6)             !! unknowns of the step
      real(wp), intent(in) :: centroid(2)      !! at the start of the step [length]
      logical, intent(in) :: exact             !! exact rotation, else linear
      real(wp), intent(inout) :: points(:, :)  !! (2, n) from start to end of the step [length]
      real(wp) :: h(2, 2)
      integer :: i
      h = displacement_gradient(d, exact)
      do i = 1, size(points, 2)
         points(:, i) = points(:, i) + d(1:2) + matmul(h, points(:, i) - centroid)
      end do
   end subroutine move_points

   !> Logarithm of the stretch I + e of a step, e - e^2/2 + e^3/3.
   !>
   !> Stretches of steps multiply, their logarithms add up: with these as strains the stress of a block that is
   !> stretched along the same axes follows from its shape at the end and not from the number of steps. With e itself
   !> the shapes of one and of many steps to the same stress differ by half the strain.
   pure function logarithmic_strain(strain) result(log_strain)
      real(wp), intent(in) :: strain(3)   !! ex ey gxy of the step
      real(wp) :: log_strain(3)           !! the same components
      real(wp) :: ex, ey, exy, xx, yy, xy
      ex = strain(1)
      ey = strain(2)
      exy = 0.5_wp*strain(3)
      xx = ex*ex + exy*exy
      yy = ey*ey + exy*exy
      xy = exy*(ex + ey)
      log_strain(1) = ex - 0.5_wp*xx + (xx*ex + xy*exy)/3
      log_strain(2) = ey - 0.5_wp*yy + (xy*exy + yy*ey)/3
      log_strain(3) = strain(3) - xy + 2*(xx*exy + xy*ey)/3
   end function logarithmic_strain

   !> Mass matrix M = (m/S) integral of T^T T over the block (thesis Eq. 3.10.3), exact: the first moments
   !> about the centroid are zero, the second moments are those of the polygon.
   pure function mass_matrix(mass, area, moments) result(m)
      real(wp), intent(in) :: mass        !! of the block, > 0 [mass]
      real(wp), intent(in) :: area        !! of the polygon now, > 0 [length^2]
      real(wp), intent(in) :: moments(3)  !! Sxx Syy Sxy = integrals of X^2, Y^2, XY about the centroid [length^4]
      real(wp) :: m(6, 6)                 !! symmetric [mass, mass length, mass length^2]
      real(wp) :: xx, yy, xy
      xx = mass*moments(1)/area
      yy = mass*moments(2)/area
      xy = mass*moments(3)/area
      m = 0
      m(1, 1) = mass
      m(2, 2) = mass
      m(3:6, 3) = [xx + yy, -xy, xy, 0.5_wp*(xx - yy)]
      m(3:6, 4) = [-xy, xx, 0.0_wp, 0.5_wp*xy]
      m(3:6, 5) = [xy, 0.0_wp, yy, 0.5_wp*xy]
      m(3:6, 6) = [0.5_wp*(xx - yy), 0.5_wp*xy, 0.5_wp*xy, 0.25_wp*(xx + yy)]
   end function mass_matrix

   !> M v, with the M of `mass_matrix`, without its zeros: the momentum of a block.
   pure function mass_times(mass, area, moments, v) result(p)
      real(wp), intent(in) :: mass        !! of the block, > 0 [mass]
      real(wp), intent(in) :: area        !! of the polygon now, > 0 [length^2]
      real(wp), intent(in) :: moments(3)  !! Sxx Syy Sxy about the centroid [length^4]
      real(wp), intent(in) :: v(6)        !! velocity or other unknowns of the block
      real(wp) :: p(6)
      real(wp) :: xx, yy, xy
      xx = mass*moments(1)/area
      yy = mass*moments(2)/area
      xy = mass*moments(3)/area
      p(1) = mass*v(1)
      p(2) = mass*v(2)
      p(3) = (xx + yy)*v(3) + xy*(v(5) - v(4)) + 0.5_wp*(xx - yy)*v(6)
      p(4) = xx*v(4) + xy*(0.5_wp*v(6) - v(3))
      p(5) = yy*v(5) + xy*(0.5_wp*v(6) + v(3))
      p(6) = 0.5_wp*((xx - yy)*v(3) + xy*(v(4) + v(5))) + 0.25_wp*(xx + yy)*v(6)
   end function mass_times

   !> Stress carried along by a rotation of the block: R s R^T.
   pure function rotate_stress(stress, angle) result(rotated)
      real(wp), intent(in) :: stress(3)  !! sx sy txy [force/length^2]
      real(wp), intent(in) :: angle      !! counter-clockwise [rad]
      real(wp) :: rotated(3)             !! [force/length^2]
      real(wp) :: turn(2), c, s
      turn = direction(angle)
      c = turn(1)
      s = turn(2)
      rotated(1) = c*c*stress(1) + s*s*stress(2) - 2*c*s*stress(3)
      rotated(2) = s*s*stress(1) + c*c*stress(2) + 2*c*s*stress(3)
      rotated(3) = c*s*(stress(1) - stress(2)) + (c*c - s*s)*stress(3)
   end function rotate_stress

   !> Strain (or strain rate) carried along by a rotation of the block: R e R^T with engineering shear.
   pure function rotate_strain_rate(strain_rate, angle) result(rotated)
      real(wp), intent(in) :: strain_rate(3)  !! ex ey gxy, per time: velocity(4:6)
      real(wp), intent(in) :: angle           !! counter-clockwise [rad]
      real(wp) :: rotated(3)                  !! ex ey gxy in the turned block
      real(wp) :: turn(2), c, s
      turn = direction(angle)
      c = turn(1)
      s = turn(2)
      rotated(1) = c*c*strain_rate(1) + s*s*strain_rate(2) - c*s*strain_rate(3)
      rotated(2) = s*s*strain_rate(1) + c*c*strain_rate(2) + c*s*strain_rate(3)
      rotated(3) = 2*c*s*(strain_rate(1) - strain_rate(2)) + (c*c - s*s)*strain_rate(3)
   end function rotate_strain_rate

   !> Motion of a block since it was drawn: place = m(:, 1) + m(:, 2:3) place when drawn, the least-squares fit of its
   !> vertices.
   pure function affine_motion(blocks, vertices, block) result(m)
      type(block_system_type), intent(in) :: blocks   !! as drawn
      real(wp), intent(in) :: vertices(:, :)          !! (2, vertices) where they are now [length]
      integer, intent(in) :: block
      real(wp) :: m(2, 3), was(2), is(2), a(2, 2), b(2, 2), x(2)
      integer :: first, last, v
      first = blocks%vertex_offset(block) + 1
      last = blocks%vertex_offset(block + 1)
      associate (old => blocks%vertices(:, first:last), new => vertices(:, first:last))
         m(:, 1) = 0
         m(:, 2:3) = reshape([1.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [2, 2])
         if (all(abs(old - new) <= 0)) return
         was = sum(old, 2)/size(old, 2)
         is = sum(new, 2)/size(new, 2)
         a = 0
         b = 0
         do v = 1, size(old, 2)
            x = old(:, v) - was
            a = a + spread(new(:, v) - is, 2, 2)*spread(x, 1, 2)
            b = b + spread(x, 2, 2)*spread(x, 1, 2)
         end do
         b = reshape([b(2, 2), -b(2, 1), -b(1, 2), b(1, 1)], [2, 2])/(b(1, 1)*b(2, 2) - b(1, 2)*b(2, 1))
         m(:, 2:3) = matmul(a, b)
         m(:, 1) = is - matmul(m(:, 2:3), was)
      end associate
   end function affine_motion

end module rockdda_interaction_kinematics
