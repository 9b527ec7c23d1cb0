! SPDX-License-Identifier: MIT
!> Tractions on edges of boundaries, uniform along an edge: they do the work of two forces at its ends. A traction moves
!> with its edge, a stress or pressure also keeps to its normal.
module rockdda_interaction_boundary_tractions
   use rockdda_base_kinds, only : wp
   use rockdda_model_options, only : boundary_type
   use rockdda_model_state, only : energy
   use rockdda_interaction_attempt, only : attempt_type
   use rockdda_interaction_balance, only : energy_balance_type
   use rockdda_interaction_block_forces, only : block_forces_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_equations, only : equations_type
   use rockdda_interaction_finite_rotation, only : moving_block_type, new_moving_block
   use rockdda_interaction_line_loads, only : line_load
   use rockdda_interaction_time_tables, only : load_factor, table_changes
   implicit none
   private
   public :: boundary_tractions_type

   !> One edge with a traction.
   type :: loaded_edge_type
      integer :: group = 0
      integer :: block = 0
      integer :: vertices(2) = 0
      real(wp) :: force(2) = 0       !! in the step
      real(wp) :: load(6) = 0        !! in the step
   end type loaded_edge_type

   type :: boundary_tractions_type
      type(loaded_edge_type), allocatable :: list(:)
   contains
      procedure :: clear
      procedure :: append_edge
      procedure :: add_to_blocks
      procedure :: add_work
      procedure :: sum_forces
      procedure :: add_forces
   end type boundary_tractions_type

contains

   !> No edges yet.
   pure subroutine clear(self)
      class(boundary_tractions_type), intent(inout) :: self
      if (allocated(self%list)) deallocate (self%list)
      allocate (self%list(0))
   end subroutine clear

   !> The edge of a block between two vertices carries the traction of a boundary.
   pure subroutine append_edge(self, boundary, block, vertices)
      class(boundary_tractions_type), intent(inout) :: self
      integer, intent(in) :: boundary, block, vertices(2)
      self%list = [self%list, loaded_edge_type(boundary, block, vertices)]
   end subroutine append_edge

   !> Loads of all edges of active blocks.
   subroutine add_to_blocks(self, context, attempt, equations)
      class(boundary_tractions_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(equations_type), intent(inout) :: equations
      integer :: i
      do i = 1, size(self%list)
         associate (edge => self%list(i))
            if (.not. context%state%active(edge%block)) then
               edge%force = 0
               edge%load = 0
               cycle
            end if
            call find_traction_load(context, attempt, context%parameters%boundaries(edge%group), &
                                    attempt%moving(edge%block), edge)
            equations%block_load(:, edge%block) = equations%block_load(:, edge%block) + edge%load
            equations%block_magnitude(:, edge%block) = equations%block_magnitude(:, edge%block) + abs(edge%load)
         end associate
      end do
   end subroutine add_to_blocks

   !> Force and load of an edge with a traction: of the end of the step, on the arms of its middle. The traction is
   !> uniform along the edge.
   pure subroutine find_traction_load(context, attempt, group, block, edge)
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(boundary_type), intent(in) :: group
      type(moving_block_type), intent(in) :: block   !! of the edge
      type(loaded_edge_type), intent(inout) :: edge
      real(wp) :: p(2), q(2), normal(2), traction(2)
      p = context%state%vertices(:, edge%vertices(1))
      q = context%state%vertices(:, edge%vertices(2))
      normal = [q(2) - p(2), p(1) - q(1)]/norm2(q - p)
      normal = [block%half(1)*normal(1) - block%half(2)*normal(2), block%half(2)*normal(1) + block%half(1)*normal(2)]
      if (allocated(group%stress)) then
         associate (s => group%stress(:, 1))
            traction = [s(1)*normal(1) + s(3)*normal(2), s(3)*normal(1) + s(2)*normal(2)]
         end associate
      else if (allocated(group%traction)) then
         traction = group%traction(:, 1)
      else
         traction = -group%pressure*normal
      end if
      traction = load_factor(group%table, attempt%load_time(context))*traction
      edge%force = norm2(q - p)*traction
      edge%load = line_load(p, q, block, traction, traction)
   end subroutine find_traction_load

   !> Work of an accepted step.
   subroutine add_work(self, d, balance)
      class(boundary_tractions_type), intent(in) :: self
      real(wp), intent(in), contiguous :: d(:, :)
      class(energy_balance_type), intent(inout) :: balance
      integer :: i
      do i = 1, size(self%list)
         call balance%add(energy%external, dot_product(self%list(i)%load, d(:, self%list(i)%block)))
      end do
   end subroutine add_work

   !> Add the forces of the step, on the blocks, to those of each boundary.
   pure subroutine sum_forces(self, force)
      class(boundary_tractions_type), intent(in) :: self
      real(wp), intent(inout) :: force(:, :)   !! (2, boundaries)
      integer :: i
      do i = 1, size(self%list)
         associate (edge => self%list(i))
            force(:, edge%group) = force(:, edge%group) + edge%force
         end associate
      end do
   end subroutine sum_forces

   !> Forces on the moved blocks; while they change there is no equilibrium.
   subroutine add_forces(self, context, attempt, forces)
      class(boundary_tractions_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(block_forces_type), intent(inout) :: forces
      type(loaded_edge_type) :: edge
      type(moving_block_type) :: block
      integer :: i
      do i = 1, size(self%list)
         edge = self%list(i)
         if (.not. context%state%active(edge%block)) cycle
         block = new_moving_block(context%state%centroid(:, edge%block), spread(0.0_wp, 1, 6))
         call find_traction_load(context, attempt, context%parameters%boundaries(edge%group), block, edge)
         call forces%add_load(edge%block, edge%load(1:3))
         if (table_changes(context%parameters%boundaries(edge%group)%table, context%state%time, &
                           context%state%time + attempt%dt)) forces%driven = .true.
      end do
   end subroutine add_forces

end module rockdda_interaction_boundary_tractions
