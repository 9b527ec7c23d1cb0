! SPDX-License-Identifier: MIT
!> An interaction that couples blocks by links of the equations: contacts, bolts, linings.
!>
!> A family owns some links, those from first_link + 1 on, and nothing outside of it uses more. Forces of links are
!> positive along the vectors of the link (rockdda_interaction_equations). The order of the calls is that of
!> rockdda_interaction_interaction.
module rockdda_interaction_linked_interaction
   use rockdda_base_kinds, only : wp
   use rockdda_base_parallel, only : parallel_contacts
   use rockdda_interaction_attempt, only : attempt_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_equations, only : equations_type
   use rockdda_interaction_interaction, only : interaction_type
   implicit none
   private
   public :: linked_interaction_type, motion_change_type

   !> What becomes of the motion of the links.
   type :: motion_change_type
      logical :: to_solution = .false.   !! it is that for the solution x
      logical :: keeps = .false.         !! it is kept, where a line search begins
      real(wp) :: fraction = 1           !! else: it is one between that which was kept (0) and itself (1)
   contains
      procedure :: apply
   end type motion_change_type

   type, abstract, extends(interaction_type) :: linked_interaction_type
      integer :: first_link = 0   !! its links begin after this one
   contains
      procedure(prepare_links), deferred :: prepare
      procedure(add_all_links), deferred :: add_to_links
      procedure(change_motion), deferred :: set_motion
      procedure(find_lawful_forces), deferred :: lawful_forces
      procedure :: judge
   end type linked_interaction_type

   abstract interface

      !> Links of the step (`add_links` of the equations), their pairs, and vectors that do not depend on its motion.
      subroutine prepare_links(self, context, attempt, equations)
         import :: linked_interaction_type, step_context_type, attempt_type, equations_type
         class(linked_interaction_type), intent(inout) :: self
         type(step_context_type), intent(in) :: context
         type(attempt_type), intent(in) :: attempt
         type(equations_type), intent(inout) :: equations
      end subroutine prepare_links

      !> Stiffness and load of all links in the trial state.
      subroutine add_all_links(self, equations)
         import :: linked_interaction_type, equations_type
         class(linked_interaction_type), intent(in) :: self
         type(equations_type), intent(inout) :: equations
      end subroutine add_all_links

      !> Motion of the links: that for the solution x, or as `change%apply` makes it of the present one.
      subroutine change_motion(self, equations, change)
         import :: linked_interaction_type, equations_type, motion_change_type
         class(linked_interaction_type), intent(inout) :: self
         type(equations_type), intent(in) :: equations
         type(motion_change_type), intent(in) :: change
      end subroutine change_motion

      !> Forces that the links would have at a motion between the one that was kept (fraction 0) and the present one (1)
      !> if they followed their laws there.
      subroutine find_lawful_forces(self, fraction, force)
         import :: linked_interaction_type, wp
         class(linked_interaction_type), intent(in) :: self
         real(wp), intent(in) :: fraction
         real(wp), intent(inout), contiguous :: force(:, :)   !! (2, >= links) of all families
      end subroutine find_lawful_forces

   end interface

contains

   !> Keep numbers of the present motion, or replace them by those between the kept ones and themselves.
   subroutine apply(self, present, kept)
      class(motion_change_type), intent(in) :: self
      real(wp), intent(inout), contiguous :: present(:), kept(:)
      integer :: i
      if (self%keeps) then
         !$omp parallel do default(none) shared(present, kept) private(i) schedule(static) &
         !$omp if (size(present) > parallel_contacts)
         do i = 1, size(present)
            kept(i) = present(i)
         end do
         !$omp end parallel do
      else
         present = kept + self%fraction*(present - kept)
      end if
   end subroutine apply

   !> Trial state by the present motion. Links whose force is linear in the motion have none.
   subroutine judge(self, n_changes, n_unsettled)
      class(linked_interaction_type), intent(inout) :: self
      integer, intent(out) :: n_changes     !! changes of state: K is new
      integer, intent(out) :: n_unsettled   !! changes that another solve must follow for any forces
      n_changes = 0
      n_unsettled = 0
   end subroutine judge

end module rockdda_interaction_linked_interaction
