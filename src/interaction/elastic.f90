! SPDX-License-Identifier: MIT
!> Elastic strain and initial stress of one block, with their energy.
!>
!> Source: thesis Eqs. 3.5.1 and 3.6.1; the submatrix is S E, without 1/2, and the load of a stress (tension
!> positive) is -S s.
!> Strains are (ex, ey, gxy) with engineering shear, stresses (sx, sy, txy), tension positive, unit thickness;
!> both are constant in a block. They act on rows 4 to 6 of the block's unknowns.
!> Not here: the rotation of stresses with the block (rockdda_interaction_kinematics).
module rockdda_interaction_elastic
   use rockdda_base_kinds, only : wp
   implicit none
   private
   public :: elasticity, compliance, stress_of, add_elastic, add_stress, strain_energy, elastic_energy

contains

   !> Elasticity matrix of an isotropic material: stress = E strain.
   pure function elasticity(youngs, poisson, plane_strain) result(e)
      real(wp), intent(in) :: youngs         !! Young's modulus, > 0 [force/length^2]
      real(wp), intent(in) :: poisson        !! in (-1, 0.5)
      logical, intent(in) :: plane_strain    !! else plane stress
      real(wp) :: e(3, 3)                    !! symmetric [force/length^2]
      real(wp) :: direct, cross
      if (plane_strain) then
         direct = youngs*(1 - poisson)/((1 + poisson)*(1 - 2*poisson))
         cross = youngs*poisson/((1 + poisson)*(1 - 2*poisson))
      else
         direct = youngs/(1 - poisson**2)
         cross = poisson*direct
      end if
      e = reshape([direct, cross, 0.0_wp, cross, direct, 0.0_wp, &
                   0.0_wp, 0.0_wp, youngs/(2*(1 + poisson))], [3, 3])
   end function elasticity

   !> Inverse of the elasticity matrix: strain = C stress.
   pure function compliance(youngs, poisson, plane_strain) result(c)
      real(wp), intent(in) :: youngs         !! Young's modulus, > 0 [force/length^2]
      real(wp), intent(in) :: poisson        !! in (-1, 0.5)
      logical, intent(in) :: plane_strain    !! else plane stress
      real(wp) :: c(3, 3)                    !! symmetric [length^2/force]
      real(wp) :: direct, cross
      direct = 1/youngs
      cross = -poisson/youngs
      if (plane_strain) then
         direct = (1 - poisson**2)/youngs
         cross = -poisson*(1 + poisson)/youngs
      end if
      c = reshape([direct, cross, 0.0_wp, cross, direct, 0.0_wp, &
                   0.0_wp, 0.0_wp, 2*(1 + poisson)/youngs], [3, 3])
   end function compliance

   !> Stress of a strain, E e; written out, for matmul makes a temporary array.
   pure function stress_of(e, strain) result(stress)
      real(wp), intent(in) :: e(3, 3)        !! elasticity matrix [force/length^2]
      real(wp), intent(in) :: strain(3)
      real(wp) :: stress(3)
      stress = e(:, 1)*strain(1) + e(:, 2)*strain(2) + e(:, 3)*strain(3)
   end function stress_of

   !> Elastic stiffness S E of a block (Eq. 3.5.1): potential 1/2 S de^T E de of the strain of the step.
   pure subroutine add_elastic(e, area, k)
      real(wp), intent(in) :: e(3, 3)        !! elasticity matrix [force/length^2]
      real(wp), intent(in) :: area           !! at the start of the step [length^2]
      real(wp), intent(inout) :: k(6, 6)     !! diagonal block
      k(4:6, 4:6) = k(4:6, 4:6) + area*e
   end subroutine add_elastic

   !> Load -S s of the stress that a block has at the start of the step (Eq. 3.6.1): potential S s^T de.
   pure subroutine add_stress(stress, area, f)
      real(wp), intent(in) :: stress(3)      !! sx sy txy at the start of the step, tension positive
      real(wp), intent(in) :: area           !! at the start of the step [length^2]
      real(wp), intent(inout) :: f(6)        !! load
      f(4:6) = f(4:6) - area*stress
   end subroutine add_stress

   !> Elastic energy 1/2 S s^T C s of a block.
   pure real(wp) function strain_energy(stress, c, area)
      real(wp), intent(in) :: stress(3)      !! sx sy txy
      real(wp), intent(in) :: c(3, 3)        !! compliance
      real(wp), intent(in) :: area           !! [length^2]
      strain_energy = 0.5_wp*area*dot_product(stress, matmul(c, stress))
   end function strain_energy

   !> Energy of one step. The work done on the block, S s1.de with s1 = s0 + E de, is stored + dissipated:
   !> stored is the change of `strain_energy`, dissipated the numerical part of the implicit step.
   pure subroutine elastic_energy(e, stress, strain, area, stored, dissipated)
      real(wp), intent(in) :: e(3, 3)        !! elasticity matrix
      real(wp), intent(in) :: stress(3)      !! at the start of the step
      real(wp), intent(in) :: strain(3)      !! of the step: d(4:6)
      real(wp), intent(in) :: area           !! at the start of the step [length^2]
      real(wp), intent(out) :: stored        !! [energy]
      real(wp), intent(out) :: dissipated    !! [energy], >= 0
      dissipated = 0.5_wp*area*dot_product(strain, matmul(e, strain))
      stored = area*dot_product(stress, strain) + dissipated
   end subroutine elastic_energy

end module rockdda_interaction_elastic
