! SPDX-License-Identifier: MIT
!> What acts on blocks, and how the step uses it.
!>
!> A family (inertia, loads, contacts, ...) extends `interaction_type`, or, where it couples blocks, its extension
!> `linked_interaction_type` (rockdda_interaction_linked_interaction), and overrides what it needs. Marked: families
!> with links alone.
!>
!>     search                     the contact table of the step
!>   * prepare                    links, and geometry at the start of the step
!>     repeat with shorter steps
!>        begin                   trial state that an attempt begins with
!>        place                   terms of blocks and vectors of links for the motion expected of the blocks
!>        repeat until all agree
!>         * add_to_links         stiffness and load of the trial state
!>           (solve)
!>         * set_motion           motion of the links for the solution
!>         * lawful_forces        for the line search, which keeps and shortens motions (set_motion)
!>           (arms)               where lengths are off by too much: place for the motion found, set_motion
!>         * judge                trial state from the motion
!>     add_energies               read only
!>     commit                     the one place that changes its state
!>     (move the blocks)
!>     add_forces                 read only
!>
!> How far lengths are off (`measure_placement`), and what lasts from step to step (`exchange_state`), the families that
!> have either offer beside: see rockdda_interaction_families.
module rockdda_interaction_interaction
   use rockdda_base_kinds, only : wp
   use rockdda_interaction_attempt, only : attempt_type
   use rockdda_interaction_balance, only : energy_balance_type
   use rockdda_interaction_block_forces, only : block_forces_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_equations, only : equations_type
   implicit none
   private
   public :: interaction_type

   type, abstract :: interaction_type
   contains
      procedure :: begin
      procedure :: place
      procedure :: add_energies
      procedure :: commit
      procedure :: add_forces
   end type interaction_type

contains

   !> Begin an attempt: first trial state.
   subroutine begin(self, context, attempt)
      class(interaction_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
   end subroutine begin

   !> Terms of blocks, added to block_matrix, block_load and block_magnitude, and vectors of links, for the motion that
   !> is expected of the blocks.
   subroutine place(self, context, attempt, equations)
      class(interaction_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(equations_type), intent(inout) :: equations
   end subroutine place

   !> Work and stored energy of an accepted step, before anything is changed.
   subroutine add_energies(self, context, attempt, d, balance)
      class(interaction_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      real(wp), intent(in), contiguous :: d(:, :)   !! (6, nb) unknowns of the step
      class(energy_balance_type), intent(inout) :: balance
   end subroutine add_energies

   !> Take the state of the end of an accepted step. Blocks have not moved yet.
   subroutine commit(self, context, attempt, d)
      class(interaction_type), intent(inout) :: self
      type(step_context_type), intent(inout) :: context
      type(attempt_type), intent(inout) :: attempt
      real(wp), intent(in), contiguous :: d(:, :)   !! (6, nb) unknowns of the step
   end subroutine commit

   !> Forces on the moved blocks: of springs, friction and loads at the end of an accepted step, without inertia and
   !> viscous damping.
   subroutine add_forces(self, context, attempt, forces)
      class(interaction_type), intent(in) :: self
      type(step_context_type), intent(in) :: context   !! time and step are those of the start
      type(attempt_type), intent(in) :: attempt
      type(block_forces_type), intent(inout) :: forces
   end subroutine add_forces

end module rockdda_interaction_interaction
