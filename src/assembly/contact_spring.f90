! SPDX-License-Identifier: MIT
!> Springs, dashpots and forces between two blocks, or between a block and the fixed outside.
!>
!> Source: Shi's contact submatrices (thesis Eqs. 3.14-3.21), written with vectors: a length x between two
!> blocks changes by e.d_a + g.d_b in a step, to first order.
!> Unknowns per block: d = (u0, v0, r0, ex, ey, gxy) [length, length, rad, -, -, -].
!> Sign: gap > 0 is open. The edge of block b runs counter-clockwise, from s to q, its outward normal is
!> n = (ty, -tx) with t = (q - s)/|q - s|.
!> Not here: detection and states (rockdda_contact), the loop over contacts (rockdda_stepping).
module rockdda_assembly_contact_spring
   use rockdda_base_kinds, only : wp
   use rockdda_assembly_kinematics, only : point_load
   implicit none
   private
   public :: contact_vectors, add_pair_spring, add_pair_force, add_pair_dashpot
   public :: spring_energy, dashpot_coefficient, dashpot_dissipation

contains

   !> Gap and first derivatives of gap and slip of one contact: vertex p of block a, edge s to q of block b.
   !>
   !> Normal: the gap is (p - s).n. Its exact first derivative, the turning of the edge included, is n.(motion
   !> of p with block a - motion of the foot p - gap n with block b), which is Eq. 3.14 divided by the length.
   !> Tangential: the slip is t.(motion of p with block a - motion of p with block b), both at the one point p,
   !> so that the couple of the two shear forces is zero. A rigid motion of both blocks together changes
   !> neither, to first order.
   pure subroutine contact_vectors(p, s, q, centroid_a, centroid_b, gap, normal, tangent, e_n, g_n, e_t, g_t)
      real(wp), intent(in) :: p(2)           !! vertex of block a [length]
      real(wp), intent(in) :: s(2), q(2)     !! start and end of the edge of block b, apart [length]
      real(wp), intent(in) :: centroid_a(2)  !! [length]
      real(wp), intent(in) :: centroid_b(2)  !! [length]
      real(wp), intent(out) :: gap           !! > 0 open, < 0 overlapping [length]
      real(wp), intent(out) :: normal(2)     !! outward unit normal of the edge
      real(wp), intent(out) :: tangent(2)    !! unit vector along the edge
      real(wp), intent(out) :: e_n(6)        !! d(gap)/d(d_a)
      real(wp), intent(out) :: g_n(6)        !! d(gap)/d(d_b)
      real(wp), intent(out) :: e_t(6)        !! d(slip)/d(d_a), slip > 0: p moves along the tangent
      real(wp), intent(out) :: g_t(6)        !! d(slip)/d(d_b)
      tangent = (q - s)/norm2(q - s)
      normal = [tangent(2), -tangent(1)]
      gap = dot_product(p - s, normal)
      e_n = point_load(normal, p, centroid_a)
      g_n = -point_load(normal, p - gap*normal, centroid_b)
      e_t = point_load(tangent, p, centroid_a)
      g_t = -point_load(tangent, p, centroid_b)
   end subroutine contact_vectors

   !> Spring between two blocks: potential 1/2 k (s0 + e.d_a + g.d_b)**2 (thesis Eqs. 3.15-3.21).
   !> K_ba is the transpose of K_ab. With block b the fixed outside take g = 0 and drop the b terms.
   pure subroutine add_pair_spring(k, s0, e, g, k_aa, k_ab, k_bb, f_a, f_b)
      real(wp), intent(in) :: k               !! stiffness [force/length], > 0
      real(wp), intent(in) :: s0              !! gap or stretch at the start of the step [length]
      real(wp), intent(in) :: e(6), g(6)      !! d(length)/d(d_a), d(length)/d(d_b)
      real(wp), intent(inout) :: k_aa(6, 6)   !! diagonal block of a
      real(wp), intent(inout) :: k_ab(6, 6)   !! rows of a, columns of b
      real(wp), intent(inout) :: k_bb(6, 6)   !! diagonal block of b
      real(wp), intent(inout) :: f_a(6)       !! load of block a
      real(wp), intent(inout) :: f_b(6)       !! load of block b
      integer :: j
      do j = 1, 6
         k_aa(:, j) = k_aa(:, j) + k*(e*e(j))
         k_ab(:, j) = k_ab(:, j) + k*(e*g(j))
         k_bb(:, j) = k_bb(:, j) + k*(g*g(j))
      end do
      f_a = f_a - (k*s0)*e
      f_b = f_b - (k*s0)*g
   end subroutine add_pair_spring

   !> Known force between two blocks: friction (e, g tangential; the force on block a along the tangent), a
   !> bolt at yield (e, g of its elongation; minus the tension). It does the work force*(e.d_a + g.d_b).
   pure subroutine add_pair_force(force, e, g, f_a, f_b)
      real(wp), intent(in) :: force        !! in the direction in which the length grows [force]
      real(wp), intent(in) :: e(6), g(6)   !! d(length)/d(d_a), d(length)/d(d_b)
      real(wp), intent(inout) :: f_a(6)    !! load of block a
      real(wp), intent(inout) :: f_b(6)    !! load of block b
      f_a = f_a + force*e
      f_b = f_b + force*g
   end subroutine add_pair_force

   !> Viscous dashpot beside a spring (Voigt): force -c x' with x' = (e.d_a + g.d_b)/dt.
   pure subroutine add_pair_dashpot(c, dt, e, g, k_aa, k_ab, k_bb)
      real(wp), intent(in) :: c               !! coefficient [force time/length], >= 0
      real(wp), intent(in) :: dt              !! step [time], > 0
      real(wp), intent(in) :: e(6), g(6)      !! d(length)/d(d_a), d(length)/d(d_b)
      real(wp), intent(inout) :: k_aa(6, 6)   !! diagonal block of a
      real(wp), intent(inout) :: k_ab(6, 6)   !! rows of a, columns of b
      real(wp), intent(inout) :: k_bb(6, 6)   !! diagonal block of b
      real(wp) :: f(6), f2(6)
      f = 0
      f2 = 0
      call add_pair_spring(c/dt, 0.0_wp, e, g, k_aa, k_ab, k_bb, f, f2)
   end subroutine add_pair_dashpot

   !> Energy of an implicit spring whose length goes from x0 to x1 in a step. The work done on it is
   !> k x1 (x1 - x0) = stored + dissipated, to the last digit: the second part is numerical dissipation.
   pure subroutine spring_energy(k, x0, x1, stored, dissipated)
      real(wp), intent(in) :: k             !! stiffness [force/length]
      real(wp), intent(in) :: x0, x1        !! at start and end of the step [length]
      real(wp), intent(out) :: stored       !! 1/2 k (x1**2 - x0**2) [energy]
      real(wp), intent(out) :: dissipated   !! 1/2 k (x1 - x0)**2 [energy], >= 0
      stored = 0.5_wp*k*(x1 - x0)*(x1 + x0)
      dissipated = 0.5_wp*k*(x1 - x0)**2
   end subroutine spring_energy

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

end module rockdda_assembly_contact_spring
