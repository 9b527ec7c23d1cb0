! SPDX-License-Identifier: MIT
!> What acts on blocks, and how the step uses it.
!>
!> A family (inertia, contacts, bolts, ...) extends `interaction_type` and overrides what it needs:
!>
!>     search                     the contact table of the step
!>     prepare                    geometry at the start of the step; its links, where it couples blocks
!>     repeat with shorter steps
!>        begin                   trial state that an attempt begins with
!>        place, add_to_blocks    vectors of its links and terms of single blocks for the motion expected of the blocks
!>        repeat until all agree
!>           add_to_links         stiffness and load of the trial state
!>           (solve)
!>           predict              motion of the links for the solution
!>           keep, lawful_forces, shorten        for the line search
!>           measure_placement    if lengths are off by too much: place, add_to_blocks for the motion found, predict
!>           judge                trial state from the motion
!>     add_energies               read only
!>     commit                     the one place that changes its state
!>     (move the blocks)
!>     add_moved_energies, add_forces         read only
!>     exchange_state, check_state            with a checkpoint
!>
!> A family owns `n_links` links of the equations, those from first_link + 1 on, and nothing outside of it knows more.
!> Forces of links are positive along the vectors of the link (rockdda_interaction_equations).
module rockdda_interaction_interaction
   use rockdda_base_kinds, only : wp
   use rockdda_base_state_archive, only : state_archive_type
   use rockdda_base_value_check, only : value_check_type
   use rockdda_interaction_balance, only : energy_balance_type
   use rockdda_interaction_block_forces, only : block_forces_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_equations, only : equations_type
   implicit none
   private
   public :: interaction_type

   type, abstract :: interaction_type
      integer :: first_link = 0   !! its links begin after this one
      integer :: n_links = 0      !! set before `prepare`
   contains
      procedure :: count_links
      procedure :: prepare
      procedure :: begin
      procedure :: place
      procedure :: add_to_blocks
      procedure :: add_to_links
      procedure :: predict
      procedure :: keep
      procedure :: shorten
      procedure :: lawful_forces
      procedure :: measure_placement
      procedure :: judge
      procedure :: add_energies
      procedure :: commit
      procedure :: add_moved_energies
      procedure :: add_forces
      procedure :: exchange_state
      procedure :: check_state
   end type interaction_type

contains

   !> Number of links that the family needs in this step.
   pure integer function count_links(self, context) result(n)
      class(interaction_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      associate (unused => self%n_links, not_used => context%dt)
      end associate
      n = 0
   end function count_links

   !> Pairs of the links, and vectors that do not depend on the motion of the step.
   subroutine prepare(self, context, equations)
      class(interaction_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(equations_type), intent(inout) :: equations
      associate (unused => self%n_links, not_used => context%dt, nor_this => equations%n_links)
      end associate
   end subroutine prepare

   !> Begin an attempt: first trial state.
   subroutine begin(self, context)
      class(interaction_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      associate (unused => self%n_links, not_used => context%dt)
      end associate
   end subroutine begin

   !> Vectors of the links for the motion that is expected of the blocks: of links to blocks for which it is new.
   subroutine place(self, context, equations)
      class(interaction_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(equations_type), intent(inout) :: equations
      associate (unused => self%n_links, not_used => context%dt, nor_this => equations%n_links)
      end associate
   end subroutine place

   !> Terms of single blocks for the motion that is expected of them, added to block_matrix, block_load and
   !> block_magnitude.
   subroutine add_to_blocks(self, context, equations)
      class(interaction_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(equations_type), intent(inout) :: equations
      associate (unused => self%n_links, not_used => context%dt, nor_this => equations%n_links)
      end associate
   end subroutine add_to_blocks

   !> Stiffness and load of all links in the trial state.
   subroutine add_to_links(self, equations)
      class(interaction_type), intent(in) :: self
      type(equations_type), intent(inout) :: equations
      associate (unused => self%n_links, not_used => equations%n_links)
      end associate
   end subroutine add_to_links

   !> Motion of the links for the solution x.
   subroutine predict(self, equations)
      class(interaction_type), intent(inout) :: self
      type(equations_type), intent(in) :: equations
      associate (unused => self%n_links, not_used => equations%n_links)
      end associate
   end subroutine predict

   !> Keep the present motion.
   subroutine keep(self)
      class(interaction_type), intent(inout) :: self
      associate (unused => self%n_links)
      end associate
   end subroutine keep

   !> Replace the present motion by one between that which was kept (fraction 0) and itself (1).
   subroutine shorten(self, fraction)
      class(interaction_type), intent(inout) :: self
      real(wp), intent(in) :: fraction
      associate (unused => self%n_links, not_used => fraction)
      end associate
   end subroutine shorten

   !> Forces that the links would have at such a motion if they followed their laws there.
   subroutine lawful_forces(self, fraction, force)
      class(interaction_type), intent(in) :: self
      real(wp), intent(in) :: fraction
      real(wp), intent(inout), contiguous :: force(:, :)   !! (2, >= links) of all families
      associate (unused => self%n_links, not_used => fraction, nor_this => force)
      end associate
   end subroutine lawful_forces

   !> Forces that come from lengths which the expected motion and the solution x give differently, as a share of the
   !> link's own force, or of the load (with inertia) of the less loaded of its blocks if that is larger: link_off of
   !> the family's links, and block_off, which is only to be raised.
   subroutine measure_placement(self, context, equations)
      class(interaction_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(equations_type), intent(inout) :: equations
      associate (unused => self%n_links, not_used => context%dt, nor_this => equations%n_links)
      end associate
   end subroutine measure_placement

   !> Trial state by the present motion.
   subroutine judge(self, n_changes, n_unsettled)
      class(interaction_type), intent(inout) :: self
      integer, intent(out) :: n_changes     !! changes of state: K is new
      integer, intent(out) :: n_unsettled   !! changes that another solve must follow whatever the forces are
      associate (unused => self%n_links)
      end associate
      n_changes = 0
      n_unsettled = 0
   end subroutine judge

   !> Work and stored energy of an accepted step, before anything is changed.
   subroutine add_energies(self, context, d, balance)
      class(interaction_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      real(wp), intent(in), contiguous :: d(:, :)   !! (6, nb) unknowns of the step
      class(energy_balance_type), intent(inout) :: balance
      associate (unused => self%n_links, not_used => context%dt, nor_this => d, nor_that => balance%bolt_energy)
      end associate
   end subroutine add_energies

   !> Take the state of the end of an accepted step. Blocks have not moved yet.
   subroutine commit(self, context, d)
      class(interaction_type), intent(inout) :: self
      type(step_context_type), intent(inout) :: context
      real(wp), intent(in), contiguous :: d(:, :)   !! (6, nb) unknowns of the step
      associate (unused => self%n_links, not_used => context%dt, nor_this => d)
      end associate
   end subroutine commit

   !> Energies that depend on the moved blocks.
   subroutine add_moved_energies(self, context, balance)
      class(interaction_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      class(energy_balance_type), intent(inout) :: balance
      associate (unused => self%n_links, not_used => context%dt, nor_this => balance%bolt_energy)
      end associate
   end subroutine add_moved_energies

   !> Forces on the moved blocks: of springs, friction and loads at the end of an accepted step, without inertia and
   !> viscous damping.
   subroutine add_forces(self, context, forces)
      class(interaction_type), intent(in) :: self
      type(step_context_type), intent(in) :: context   !! time and step are those of the start
      type(block_forces_type), intent(inout) :: forces
      associate (unused => self%n_links, not_used => context%dt, nor_this => forces%driven)
      end associate
   end subroutine add_forces

   !> Save or load what the family keeps from step to step, beside the contact table and the state of the blocks
   subroutine exchange_state(self, archive)
      class(interaction_type), intent(inout) :: self
      class(state_archive_type), intent(inout) :: archive
      associate (unused => self%n_links, not_used => archive%saving)
      end associate
   end subroutine exchange_state

   !> Check what `exchange_state` has loaded: shapes, and ranges of numbers
   subroutine check_state(self, context, check)
      class(interaction_type), intent(in) :: self
      type(step_context_type), intent(in) :: context     !! its blocks and numbers are checked
      type(value_check_type), intent(inout) :: check
      associate (unused => self%n_links, not_used => context%dt, nor_this => check%passed())
      end associate
   end subroutine check_state

end module rockdda_interaction_interaction
