! SPDX-License-Identifier: MIT
!> What a step begins with: the model, and the state of its blocks. An attempt at the step (rockdda_interaction_attempt)
!> reads both; they change at the end of an accepted step, and where a stage begins.
module rockdda_interaction_context
   use rockdda_base_kinds, only : wp
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_datum, only : move_model
   use rockdda_model_in_situ, only : initial_stress_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_state, only : block_state_type
   use rockdda_interaction_kinematics, only : mass_times
   use rockdda_interaction_ground_motion, only : ground_motion_type
   implicit none
   private
   public :: step_context_type

   type :: step_context_type
      ! the model
      type(block_system_type) :: blocks
      type(parameters_type) :: parameters
      type(ground_motion_type) :: ground_motion !! by records
      logical, allocatable :: bolted(:)         !! (nb) blocks that a bolt with nodes crosses; no array: none
      logical, allocatable :: held(:)           !! (nb) blocks with an edge that a boundary holds in all directions
      ! the state
      type(block_state_type) :: state
      real(wp), allocatable :: line_ends(:, :)  !! (4, line loads) where they are now
      type(initial_stress_type) :: initial_stress   !! the field of which state%stress is the mean at time 0
   contains
      procedure :: follows_rotation
      procedure :: stress_at_start
      procedure :: model_blocks
      procedure :: momentum
   end type step_context_type

contains

   !> Do the arms of forces follow the rotation of the blocks in the step? Not for the linear rotation of Shi's program,
   !> nor in the iteration of DDA for Windows, which takes them at the start of the step.
   pure logical function follows_rotation(self)
      class(step_context_type), intent(in) :: self
      follows_rotation = self%parameters%exact_rotation .and. .not. self%parameters%windows_contacts
   end function follows_rotation

   !> Stress of a block at one of its points at time 0. Without a field it is uniform.
   pure function stress_at_start(self, block, point) result(stress)
      class(step_context_type), intent(in) :: self
      integer, intent(in) :: block
      real(wp), intent(in) :: point(2)
      real(wp) :: stress(3)
      if (allocated(self%initial_stress%stress)) then
         stress = self%initial_stress%at(block, point)
      else
         stress = self%state%stress(:, block)
      end if
   end function stress_at_start

   !> The model in the coordinates of its files.
   function model_blocks(self) result(blocks)
      class(step_context_type), intent(in) :: self
      type(block_system_type) :: blocks
      blocks = self%blocks
      call drop_segments(blocks)
      call move_model(self%state%datum, blocks)
   end function model_blocks

   !> Leave out the segments of linings.
   pure subroutine drop_segments(blocks)
      type(block_system_type), intent(inout) :: blocks
      integer :: n
      if (blocks%n_segments == 0) return
      blocks%n_blocks = blocks%n_blocks - blocks%n_segments
      blocks%n_segments = 0
      n = blocks%n_blocks
      blocks%vertex_offset = blocks%vertex_offset(:n + 1)
      blocks%vertices = blocks%vertices(:, :blocks%n_vertices())
      blocks%edge_joint = blocks%edge_joint(:blocks%n_vertices())
      blocks%block_material = blocks%block_material(:n)
      if (allocated(blocks%file_line)) blocks%file_line = blocks%file_line(:n)
      if (allocated(blocks%parent)) blocks%parent = blocks%parent(:n)
   end subroutine drop_segments

   !> Momentum of a block: its mass matrix times a velocity.
   pure function momentum(self, block, velocity) result(p)
      class(step_context_type), intent(in) :: self
      integer, intent(in) :: block
      real(wp), intent(in) :: velocity(6)
      real(wp) :: p(6)
      p = mass_times(self%state%mass(block), self%state%area(block), self%state%moments(:, block), velocity)
   end function momentum

end module rockdda_interaction_context
