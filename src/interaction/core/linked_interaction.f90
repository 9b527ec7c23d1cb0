! SPDX-License-Identifier: MIT
!> An interaction that couples blocks by links of the equations: contacts, bolts, linings.
!>
!> A family owns some links, those from first_link + 1 on, and nothing outside of it uses more. Forces of links are
!> positive along the vectors of the link (rockdda_interaction_equations). The order of the calls is that of
!> rockdda_interaction_interaction.
module rockdda_interaction_linked_interaction
   use rockdda_base_kinds, only : wp
   use rockdda_interaction_attempt, only : attempt_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_equations, only : equations_type
   use rockdda_interaction_interaction, only : interaction_type
   implicit none
   private
   public :: linked_interaction_type

   type, abstract, extends(interaction_type) :: linked_interaction_type
      integer :: first_link = 0   !! its links begin after this one; set before `prepare`
   contains
      procedure(count_all_links), deferred :: count_links
      procedure(prepare_links), deferred :: prepare
      procedure(place_links), deferred :: place
      procedure(add_all_links), deferred :: add_to_links
      procedure(predict_links), deferred :: predict
      procedure(keep_motion), deferred :: keep
      procedure(shorten_motion), deferred :: shorten
      procedure(find_lawful_forces), deferred :: lawful_forces
      procedure :: judge
   end type linked_interaction_type

   abstract interface

      !> Number of links that the family needs in this step.
      pure integer function count_all_links(self)
         import :: linked_interaction_type
         class(linked_interaction_type), intent(in) :: self
      end function count_all_links

      !> Pairs of the links, and vectors that do not depend on the motion of the step.
      subroutine prepare_links(self, context, attempt, equations)
         import :: linked_interaction_type, step_context_type, attempt_type, equations_type
         class(linked_interaction_type), intent(inout) :: self
         type(step_context_type), intent(in) :: context
         type(attempt_type), intent(in) :: attempt
         type(equations_type), intent(inout) :: equations
      end subroutine prepare_links

      !> Vectors of the links for the motion that is expected of the blocks: of links to blocks for which it is new.
      subroutine place_links(self, context, attempt, equations)
         import :: linked_interaction_type, step_context_type, attempt_type, equations_type
         class(linked_interaction_type), intent(inout) :: self
         type(step_context_type), intent(in) :: context
         type(attempt_type), intent(in) :: attempt
         type(equations_type), intent(inout) :: equations
      end subroutine place_links

      !> Stiffness and load of all links in the trial state.
      subroutine add_all_links(self, equations)
         import :: linked_interaction_type, equations_type
         class(linked_interaction_type), intent(in) :: self
         type(equations_type), intent(inout) :: equations
      end subroutine add_all_links

      !> Motion of the links for the solution x.
      subroutine predict_links(self, equations)
         import :: linked_interaction_type, equations_type
         class(linked_interaction_type), intent(inout) :: self
         type(equations_type), intent(in) :: equations
      end subroutine predict_links

      !> Keep the present motion.
      subroutine keep_motion(self)
         import :: linked_interaction_type
         class(linked_interaction_type), intent(inout) :: self
      end subroutine keep_motion

      !> Replace the present motion by one between that which was kept (fraction 0) and itself (1).
      subroutine shorten_motion(self, fraction)
         import :: linked_interaction_type, wp
         class(linked_interaction_type), intent(inout) :: self
         real(wp), intent(in) :: fraction
      end subroutine shorten_motion

      !> Forces that the links would have at such a motion if they followed their laws there.
      subroutine find_lawful_forces(self, fraction, force)
         import :: linked_interaction_type, wp
         class(linked_interaction_type), intent(in) :: self
         real(wp), intent(in) :: fraction
         real(wp), intent(inout), contiguous :: force(:, :)   !! (2, >= links) of all families
      end subroutine find_lawful_forces

   end interface

contains

   !> Trial state by the present motion. Links whose force is linear in the motion have none.
   subroutine judge(self, n_changes, n_unsettled)
      class(linked_interaction_type), intent(inout) :: self
      integer, intent(out) :: n_changes     !! changes of state: K is new
      integer, intent(out) :: n_unsettled   !! changes that another solve must follow for any forces
      n_changes = 0
      n_unsettled = 0
   end subroutine judge

end module rockdda_interaction_linked_interaction
