! SPDX-License-Identifier: MIT
!> How gap and slip of one contact change with the unknowns of its two blocks, and the dashpot beside its springs.
!>
!> Source: Shi's contact submatrices (thesis Eqs. 3.14-3.21), written with vectors: a length x between two
!> blocks changes by e.d_a + g.d_b in a step, to first order. A spring of stiffness k along it then gives
!> k e e^T, k e g^T, k g g^T and the loads -k x e, -k x g; a force f the loads f e, f g; a dashpot (Voigt) c/dt in
!> place of k and no load (rockdda_interaction_equations).
!> Unknowns per block: d = (u0, v0, r0, ex, ey, gxy) [length, length, rad, -, -, -].
!> Sign: gap > 0 is open. The edge of block b runs counter-clockwise, from s to q, its outward normal is
!> n = (ty, -tx) with t = (q - s)/|q - s|.
!> Not here: detection and states (rockdda_contact), the sums over contacts (rockdda_interaction_equations).
module rockdda_interaction_contact_spring
   use rockdda_base_kinds, only : wp
   implicit none
   private
   public :: spring_vectors, dashpot_coefficient, dashpot_dissipation

contains

   !> First derivatives of gap (1) and slip (2) of one contact: vertex p of block a, an edge of block b.
   !>
   !> Normal: the gap is (p - s).n, s any point of the edge. Its exact first derivative, the turning of the edge
   !> included, is n.(motion of p with block a - motion of the foot p - gap n with block b), which is Eq. 3.14 divided
   !> by the length.
   !> Tangential: the slip is t.(motion of p with block a - motion of p with block b), both at the one point p,
   !> so that the couple of the two shear forces is zero. A rigid motion of both blocks together changes
   !> neither, to first order.
   pure subroutine spring_vectors(p, gap, normal, centroid_a, centroid_b, e, g)
      real(wp), intent(in) :: p(2)           !! vertex of block a [length]
      real(wp), intent(in) :: gap            !! > 0 open, < 0 overlapping [length]
      real(wp), intent(in) :: normal(2)      !! outward unit normal of the edge
      real(wp), intent(in) :: centroid_a(2)  !! [length]
      real(wp), intent(in) :: centroid_b(2)  !! [length]
      real(wp), intent(out) :: e(6, 2)       !! with respect to d_a; slip > 0: p moves along the edge
      real(wp), intent(out) :: g(6, 2)       !! with respect to d_b
      real(wp) :: tangent(2)
      tangent = [-normal(2), normal(1)]
      e(:, 1) = derivative(normal, p - centroid_a)
      g(:, 1) = -derivative(normal, p - gap*normal - centroid_b)
      e(:, 2) = derivative(tangent, p - centroid_a)
      g(:, 2) = -derivative(tangent, p - centroid_b)
   end subroutine spring_vectors

   !> T^T u at a point of a block: `point_load` of the kinematics, here so that the compiler can unfold it.
   pure function derivative(u, x) result(f)
      real(wp), intent(in) :: u(2)   !! unit vector
      real(wp), intent(in) :: x(2)   !! point about the block's centroid [length]
      real(wp) :: f(6)
      f = [u(1), u(2), x(1)*u(2) - x(2)*u(1), x(1)*u(1), x(2)*u(2), 0.5_wp*(x(2)*u(1) + x(1)*u(2))]
   end function derivative

   !> Coefficient of a dashpot from a fraction of critical damping: c = 2 ratio sqrt(k m), with the reduced
   !> mass m = m_a m_b/(m_a + m_b) of the two blocks (central frontal impact of rigid blocks).
   pure real(wp) function dashpot_coefficient(ratio, k, mass_a, mass_b)
      real(wp), intent(in) :: ratio           !! of critical damping [-], >= 0
      real(wp), intent(in) :: k               !! spring stiffness [force/length]
      real(wp), intent(in) :: mass_a, mass_b  !! of the blocks, > 0 [mass]
      dashpot_coefficient = 2*ratio*sqrt(k*mass_a/(mass_a + mass_b)*mass_b)
   end function dashpot_coefficient

   !> Energy that a dashpot takes in a step: c/dt dx**2.
   pure real(wp) function dashpot_dissipation(c, dt, dx)
      real(wp), intent(in) :: c    !! coefficient [force time/length]
      real(wp), intent(in) :: dt   !! step [time]
      real(wp), intent(in) :: dx   !! change of length in the step [length]
      dashpot_dissipation = c/dt*dx*dx
   end function dashpot_dissipation

end module rockdda_interaction_contact_spring
