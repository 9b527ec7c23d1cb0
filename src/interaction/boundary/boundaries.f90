! SPDX-License-Identifier: MIT
!> Boundaries: outer edges of blocks along polylines that are held by springs (rockdda_interaction_boundary_springs) or
!> loaded (rockdda_interaction_boundary_tractions). Those that take up waves are a family of their own
!> (rockdda_interaction_quiet_boundaries).
module rockdda_interaction_boundaries
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_base_strings, only : counted, to_string
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_in_situ, only : initial_stress_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_interaction_attempt, only : attempt_type
   use rockdda_interaction_balance, only : energy_balance_type
   use rockdda_interaction_block_forces, only : block_forces_type
   use rockdda_interaction_boundary_edges, only : find_outer_edges, edges_along, next_vertex, place, &
      report_missing
   use rockdda_interaction_boundary_springs, only : boundary_springs_type
   use rockdda_interaction_boundary_tractions, only : boundary_tractions_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_equations, only : equations_type
   use rockdda_interaction_interaction, only : interaction_type
   implicit none
   private
   public :: boundaries_type

   type, extends(interaction_type) :: boundaries_type
      type(boundary_springs_type) :: springs
      type(boundary_tractions_type) :: tractions
      integer, allocatable :: edges(:, :)           !! (3, edges) boundary, block and first vertex
      real(wp), allocatable :: force(:, :)          !! (2, boundaries) on the blocks, of the last accepted step
   contains
      procedure :: init
      procedure :: become_quiet
      procedure :: add_to_blocks
      procedure :: measure_placement
      procedure :: add_energies
      procedure :: commit
      procedure :: add_forces
   end type boundaries_type

contains

   !> Find the edges of all boundaries. Errors: boundaries without an edge, edges that two boundaries hold. The groups
   !> have been checked (rockdda_check_boundaries).
   subroutine init(self, blocks, parameters, field, active, messages, pressure)
      class(boundaries_type), intent(inout) :: self
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(initial_stress_type), intent(in) :: field     !! stress at the start
      logical, intent(in) :: active(:)                   !! (nb) the others are placed later, free of stress
      type(diagnostics_type), intent(inout) :: messages
      real(wp), intent(in), optional :: pressure(:, :)   !! (2, nv) of water (`pressure_on_edges`)
      logical, allocatable :: outer(:)
      integer, allocatable :: edges(:), edge_blocks(:), holder(:)
      real(wp), allocatable :: normals(:, :)
      real(wp) :: tolerance
      integer :: g, i, n
      n = 0
      if (allocated(parameters%boundaries)) n = size(parameters%boundaries)
      call self%springs%clear(n)
      call self%tractions%clear()
      if (allocated(self%edges)) deallocate (self%edges, self%force)
      allocate (self%edges(3, 0))
      allocate (self%force(2, n), source=0.0_wp)
      if (n == 0) return
      tolerance = max(blocks%edge_node_distance, 1.0e-9_wp*parameters%w0)
      outer = find_outer_edges(blocks, tolerance)
      allocate (holder(size(outer)))
      holder = 0
      do g = 1, n
         associate (group => parameters%boundaries(g))
            if (.not. (allocated(group%along) .and. allocated(group%kind))) cycle   ! reported by the reader
            call edges_along(blocks, outer, group%along, tolerance, edges, edge_blocks, normals)
            if (size(edges) == 0) then
               call report_missing(blocks, outer, parameters, g, tolerance, messages)
            else
               call messages%add(severity%note, '&boundary '//to_string(g)//' ('//group%kind//'): '// &
                                 counted(size(edges), 'edge')//' of blocks', group%origin)
            end if
            do i = 1, size(edges)
               associate (b => edge_blocks(i), k => edges(i))
                  self%edges = reshape([self%edges, g, b, k], [3, size(self%edges, 2) + 1])
                  if (group%kind == 'free_field' .and. .not. is_upright(blocks, b, k)) then
                     call messages%add(severity%error, '&boundary '//to_string(g)//": kind 'free_field' is for the "// &
                        'sides of a model; the edge from '//place(blocks%vertices(:, k))//' to '// &
                        place(blocks%vertices(:, next_vertex(blocks, b, k)))//' is no upright one', group%origin)
                     exit
                  end if
                  if (group%kind == 'traction') then
                     call self%tractions%append_edge(g, b, [k, next_vertex(blocks, b, k)])
                     cycle
                  end if
                  if (holder(k) > 0) then
                     call messages%add(severity%error, '&boundary '//to_string(g)//": kind '"//group%kind// &
                        "' holds the edge from "//place(blocks%vertices(:, k))//' to '// &
                        place(blocks%vertices(:, next_vertex(blocks, b, k)))//', which boundary '// &
                        to_string(holder(k))//' holds already', group%origin)
                     exit
                  end if
                  holder(k) = g
                  call self%springs%append_edge(blocks, parameters, field, g, b, k, normals(:, i))
                  if (present(pressure)) call self%springs%leave_to_water(blocks, b, k, pressure(:, k))
               end associate
            end do
         end associate
      end do
      call self%springs%release(active)
   end subroutine init

   !> Is an edge within 45 degrees of the vertical?
   pure logical function is_upright(blocks, b, k)
      type(block_system_type), intent(in) :: blocks
      integer, intent(in) :: b, k
      real(wp) :: along(2)
      along = blocks%vertices(:, next_vertex(blocks, b, k)) - blocks%vertices(:, k)
      is_upright = abs(along(2)) >= abs(along(1))
   end function is_upright

   !> Before the first dynamic step: from now on quiet boundaries keep the forces that they have, and their dashpots
   !> act.
   subroutine become_quiet(self, context, attempt, balance)
      class(boundaries_type), intent(in) :: self
      type(step_context_type), intent(inout) :: context
      type(attempt_type), intent(in) :: attempt
      class(energy_balance_type), intent(inout) :: balance
      if (context%state%quiet) return
      call self%springs%hold_forces(context, attempt, balance)
      context%state%quiet = .true.
   end subroutine become_quiet

   !> Springs and tractions.
   subroutine add_to_blocks(self, context, attempt, equations)
      class(boundaries_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(equations_type), intent(inout) :: equations
      call self%springs%add_to_blocks(context, attempt, equations)
      call self%tractions%add_to_blocks(context, attempt, equations)
   end subroutine add_to_blocks

   !> Displacements of springs that the expected motion gives otherwise than the solution.
   subroutine measure_placement(self, context, attempt, equations)
      class(boundaries_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(equations_type), intent(inout) :: equations
      call self%springs%measure_placement(context, attempt, equations)
   end subroutine measure_placement

   !> Springs, and work of moving boundaries and tractions.
   subroutine add_energies(self, context, attempt, d, balance)
      class(boundaries_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      real(wp), intent(in), contiguous :: d(:, :)
      class(energy_balance_type), intent(inout) :: balance
      if (size(self%edges, 2) == 0) return
      call self%springs%add_energies(context, attempt, d, balance)
      call self%tractions%add_work(d, balance)
   end subroutine add_energies

   !> Forces of the boundaries at the end of the step.
   subroutine commit(self, context, attempt, d)
      class(boundaries_type), intent(inout) :: self
      type(step_context_type), intent(inout) :: context
      type(attempt_type), intent(inout) :: attempt
      real(wp), intent(in), contiguous :: d(:, :)
      self%force = 0
      call self%springs%sum_forces(context, attempt, d, self%force)
      call self%tractions%sum_forces(self%force)
   end subroutine commit

   !> Forces on the moved blocks.
   subroutine add_forces(self, context, attempt, forces)
      class(boundaries_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(block_forces_type), intent(inout) :: forces
      call self%springs%add_forces(context, forces)
      call self%tractions%add_forces(context, attempt, forces)
   end subroutine add_forces

end module rockdda_interaction_boundaries
