! SPDX-License-Identifier: MIT
!> Bolts: axial springs between two points, with pretension and yield.
!>
!> Source: Shi's bolt (the thesis, 3.1, only names it), written as a spring between two blocks along the bolt's
!> direction at the start of the step (a link of rockdda_interaction_equations).
!>
!> The axial force, tension positive, is pretension + stiffness (elongation - plastic), where the elongation is
!> the length now less the length at the start of the run and `plastic` the part of it that has yielded. At the
!> strength the bolt yields: elastic, perfectly plastic, the same in tension and compression; it does not break
!> and unloads elastically. Strength 0 means unlimited.
!>
!> In a step an elastic bolt is a spring of its stiffness with the force at the start of the step, a yielding one a
!> constant force.
module rockdda_interaction_bolts
   use rockdda_base_kinds, only : wp
   use rockdda_interaction_kinematics, only : point_load
   implicit none
   private
   public :: bolt_vectors, bolt_force, bolt_response, bolt_energy

contains

   !> Length of a bolt and its derivatives: length changes by e.d_1 + g.d_2 to first order.
   !> An end in no block has a zero vector, and so has a bolt whose ends coincide (it has no direction).
   pure subroutine bolt_vectors(ends, blocks, centroid_1, centroid_2, length, e, g)
      real(wp), intent(in) :: ends(4)         !! x1 y1 x2 y2 at the start of the step [length]
      integer, intent(in) :: blocks(2)        !! of the two ends, 0: the fixed outside
      real(wp), intent(in) :: centroid_1(2)   !! of the block of end 1, not used if there is none [length]
      real(wp), intent(in) :: centroid_2(2)   !! of the block of end 2, not used if there is none [length]
      real(wp), intent(out) :: length         !! [length]
      real(wp), intent(out) :: e(6), g(6)     !! d(length)/d(d_1), d(length)/d(d_2)
      real(wp) :: b(2)
      b = ends(3:4) - ends(1:2)
      length = norm2(b)
      e = 0
      g = 0
      if (length <= 0) return
      b = b/length
      if (blocks(1) > 0) e = point_load(-b, ends(1:2), centroid_1)
      if (blocks(2) > 0) g = point_load(b, ends(3:4), centroid_2)
   end subroutine bolt_vectors

   !> Axial force at the start of a step.
   pure real(wp) function bolt_force(stiffness, pretension, elongation, plastic)
      real(wp), intent(in) :: stiffness    !! [force/length], > 0
      real(wp), intent(in) :: pretension   !! force at the start of the run, tension positive
      real(wp), intent(in) :: elongation   !! length now - length at the start of the run [length]
      real(wp), intent(in) :: plastic      !! yielded part of the elongation [length]
      bolt_force = pretension + stiffness*(elongation - plastic)
   end function bolt_force

   !> The law of a bolt: its force after a change of length, and what yields.
   pure subroutine bolt_response(stiffness, strength, force, stretch, new_force, yields, yielded)
      real(wp), intent(in) :: stiffness    !! [force/length], > 0
      real(wp), intent(in) :: strength     !! largest axial force, 0 = unlimited
      real(wp), intent(in) :: force        !! at the start of the step
      real(wp), intent(in) :: stretch      !! e.d_1 + g.d_2 of the step [length]
      real(wp), intent(out) :: new_force   !! at the end of the step
      logical, intent(out) :: yields       !! the force is held at the strength
      real(wp), intent(out) :: yielded     !! plastic elongation of the step, 0 if elastic [length]
      new_force = force + stiffness*stretch
      yielded = 0
      yields = .false.
      if (strength <= 0) return
      yields = abs(new_force) > strength
      if (.not. yields) return
      yielded = (new_force - sign(strength, new_force))/stiffness
      new_force = sign(strength, new_force)
   end subroutine bolt_response

   !> Energy of one step: new_force*stretch = stored + dissipated + plastic.
   pure subroutine bolt_energy(stiffness, force, new_force, yielded, stored, dissipated, plastic)
      real(wp), intent(in) :: stiffness    !! [force/length], > 0
      real(wp), intent(in) :: force        !! at the start of the step
      real(wp), intent(in) :: new_force    !! at the end of the step
      real(wp), intent(in) :: yielded      !! plastic elongation of the step [length]
      real(wp), intent(out) :: stored      !! change of force**2/(2 stiffness) [energy]
      real(wp), intent(out) :: dissipated  !! numerical: (change of force)**2/(2 stiffness) [energy], >= 0
      real(wp), intent(out) :: plastic     !! work of yielding [energy], >= 0
      stored = 0.5_wp*(new_force - force)*(new_force + force)/stiffness
      dissipated = 0.5_wp*(new_force - force)**2/stiffness
      plastic = new_force*yielded
   end subroutine bolt_energy

end module rockdda_interaction_bolts
