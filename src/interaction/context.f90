! SPDX-License-Identifier: MIT
!> What every interaction reads: the model, its state at the start of the step, and the attempt at hand.
module rockdda_interaction_context
   use rockdda_base_kinds, only : wp
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_state, only : block_state_type
   implicit none
   private
   public :: step_context_type

   type :: step_context_type
      ! the model
      type(block_system_type) :: blocks
      type(parameters_type) :: parameters
      ! the state
      type(block_state_type) :: state
      real(wp), allocatable :: line_ends(:, :)  !! (4, line loads) where they are now
      ! the attempt
      real(wp) :: dt = 0                        !! step [time]
      real(wp) :: gravity = 1                   !! factor on all weights
      logical, allocatable :: released(:)       !! (nf) fixed points that were let go
   end type step_context_type

end module rockdda_interaction_context
