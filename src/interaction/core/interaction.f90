! SPDX-License-Identifier: MIT
!> What acts on blocks, and how the step uses it.
!>
!> A family (inertia, loads, contacts, ...) extends `interaction_type`, or, where it couples blocks, its extension
!> `linked_interaction_type` (rockdda_interaction_linked_interaction), and overrides what it needs. Marked: families
!> with links alone.
!>
!>     search                     the contact table of the step
!>   * count_links, prepare       geometry at the start of the step
!>     repeat with shorter steps
!>        begin                   trial state that an attempt begins with
!>      * place                   vectors of links for the motion expected of the blocks
!>        add_to_blocks           terms of single blocks for it
!>        repeat until all agree
!>         * add_to_links         stiffness and load of the trial state
!>           (solve)
!>         * predict              motion of the links for the solution
!>         * keep, lawful_forces, shorten        for the line search
!>           measure_placement    if lengths are off by too much: place, add_to_blocks for the motion found, predict
!>         * judge                trial state from the motion
!>     add_energies               read only
!>     commit                     the one place that changes its state
!>     (move the blocks)
!>     add_forces                 read only
!>     exchange_state             with a checkpoint
module rockdda_interaction_interaction
   use rockdda_base_kinds, only : wp
   use rockdda_base_state_archive, only : state_archive_type
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
      procedure :: add_to_blocks
      procedure :: measure_placement
      procedure :: add_energies
      procedure :: commit
      procedure :: add_forces
      procedure :: exchange_state
   end type interaction_type

contains

   !> Begin an attempt: first trial state.
   subroutine begin(self, context, attempt)
      class(interaction_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
   end subroutine begin

   !> Terms of single blocks for the motion that is expected of them, added to block_matrix, block_load and
   !> block_magnitude.
   subroutine add_to_blocks(self, context, attempt, equations)
      class(interaction_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(equations_type), intent(inout) :: equations
   end subroutine add_to_blocks

   !> Forces that come from lengths which the expected motion and the solution x give differently, as a share of the
   !> link's own force, or of the load (with inertia) of the less loaded of its blocks if that is larger: link_off of
   !> the family's links, and block_off, which is only to be raised.
   subroutine measure_placement(self, context, attempt, equations)
      class(interaction_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(equations_type), intent(inout) :: equations
   end subroutine measure_placement

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

   !> Save or load what the family keeps from step to step, beside the contact table and the state of the blocks. What
   !> is loaded is checked by `archive%check`: shapes, and ranges of numbers.
   subroutine exchange_state(self, context, archive)
      class(interaction_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context     !! its blocks and numbers have been checked
      class(state_archive_type), intent(inout) :: archive
   end subroutine exchange_state

end module rockdda_interaction_interaction
