! SPDX-License-Identifier: MIT
!> A family that the program does not have: a spring between a point of a block and the ground (docs/architecture.md).
module ground_spring
   use rockdda_base_kinds, only : wp
   use rockdda_model_state, only : energy
   use rockdda_interaction_attempt, only : attempt_type
   use rockdda_interaction_balance, only : energy_balance_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_equations, only : equations_type
   use rockdda_interaction_finite_rotation, only : mean_load
   use rockdda_interaction_kinematics, only : move_point
   use rockdda_interaction_linked_interaction, only : linked_interaction_type, motion_change_type
   implicit none
   private
   public :: ground_spring_type

   type, extends(linked_interaction_type) :: ground_spring_type
      integer :: block = 0
      real(wp) :: point(2) = 0       !! on the block, now [length]
      real(wp) :: direction(2) = 0   !! unit vector from the ground to the point
      real(wp) :: stiffness = 0      !! [force/length]
      real(wp) :: elongation = 0     !! at the start of the step [length]
      real(wp) :: stretch(1) = 0     !! predicted change in the step [length]
      real(wp) :: kept(1) = 0        !! the same at the motion that was kept [length]
   contains
      procedure :: prepare
      procedure :: place
      procedure :: add_to_links
      procedure :: set_motion
      procedure :: lawful_forces
      procedure :: add_energies
      procedure :: commit
   end type ground_spring_type

contains

   !> One link, between the block and the fixed outside.
   subroutine prepare(self, context, attempt, equations)
      class(ground_spring_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(equations_type), intent(inout) :: equations
      call equations%add_links(merge(1, 0, self%block > 0), self%first_link)
      if (self%block > 0) equations%pair(:, self%first_link + 1) = [self%block, 0]
   end subroutine prepare

   !> Derivative of the elongation with respect to the unknowns of the block.
   subroutine place(self, context, attempt, equations)
      class(ground_spring_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(equations_type), intent(inout) :: equations
      real(wp) :: a(6, 2), b(6, 2)
      if (self%block == 0) return
      a = 0
      a(:, 1) = mean_load(self%direction, self%point, attempt%moving(self%block))
      b = 0
      call equations%set_vectors(self%first_link + 1, a, b)
   end subroutine place

   !> Stiffness, and the load of the elongation at the start of the step.
   subroutine add_to_links(self, equations)
      class(ground_spring_type), intent(in) :: self
      type(equations_type), intent(inout) :: equations
      if (self%block == 0) return
      call equations%set_link(self%first_link + 1, [self%stiffness, 0.0_wp], [-self%stiffness*self%elongation, 0.0_wp])
   end subroutine add_to_links

   !> Change of the elongation.
   subroutine set_motion(self, equations, change)
      class(ground_spring_type), intent(inout) :: self
      type(equations_type), intent(in) :: equations
      type(motion_change_type), intent(in) :: change
      real(wp) :: a(6, 2)
      if (self%block == 0) return
      if (change%to_solution) then
         a = equations%vectors_of(self%first_link + 1, 1)
         self%stretch = [dot_product(a(:, 1), equations%x(:, self%block))]
      else
         call change%apply(self%stretch, self%kept)
      end if
   end subroutine set_motion

   !> Force by the law.
   subroutine lawful_forces(self, fraction, force)
      class(ground_spring_type), intent(in) :: self
      real(wp), intent(in) :: fraction
      real(wp), intent(inout), contiguous :: force(:, :)
      if (self%block == 0) return
      force(:, self%first_link + 1) = [self%stiffness*(self%elongation + self%kept + &
                                                       fraction*(self%stretch - self%kept)), 0.0_wp]
   end subroutine lawful_forces

   !> Stored energy, and what the implicit step dissipates.
   subroutine add_energies(self, context, attempt, d, balance)
      class(ground_spring_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      real(wp), intent(in), contiguous :: d(:, :)
      class(energy_balance_type), intent(inout) :: balance
      balance%other_energy = balance%other_energy + 0.5_wp*self%stiffness*(self%elongation + self%stretch(1))**2
      call balance%add(energy%dissipated, 0.5_wp*self%stiffness*self%stretch(1)**2)
   end subroutine add_energies

   !> Elongation and point at the end of the step.
   subroutine commit(self, context, attempt, d)
      class(ground_spring_type), intent(inout) :: self
      type(step_context_type), intent(inout) :: context
      type(attempt_type), intent(inout) :: attempt
      real(wp), intent(in), contiguous :: d(:, :)
      if (self%block == 0) return
      self%elongation = self%elongation + self%stretch(1)
      call move_point(d(:, self%block), context%state%centroid(:, self%block), context%parameters%exact_rotation, &
                      self%point)
   end subroutine commit

end module ground_spring
