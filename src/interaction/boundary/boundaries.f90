! SPDX-License-Identifier: MIT
!> Boundaries: outer edges of blocks along polylines that are held by springs (rockdda_interaction_boundary_springs) or
!> loaded (rockdda_interaction_boundaries). Those that take up waves are a family of their own
!> (rockdda_interaction_quiet_boundaries).
!>
!> Tractions on edges of boundaries, uniform along an edge: they do the work of two forces at its ends. A traction
!> moves with its edge, a stress or pressure also keeps to its normal.
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
   use rockdda_interaction_boundary_edges, only : find_outer_edges, edges_along, next_vertex, place, report_missing
   use rockdda_interaction_boundary_springs, only : boundary_springs_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_equations, only : equations_type
   use rockdda_interaction_interaction, only : interaction_type
   use rockdda_model_options, only : boundary_type
   use rockdda_model_state, only : energy
   use rockdda_interaction_finite_rotation, only : moving_block_type, new_moving_block
   use rockdda_interaction_loads, only : line_load
   use rockdda_interaction_time_tables, only : load_factor, table_changes
   implicit none
   private
   public :: boundaries_type

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
      procedure :: clear => clear_tractions
      procedure :: append_edge => append_loaded_edge
      procedure :: add_to_blocks => add_tractions
      procedure :: add_work
      procedure :: sum_forces => sum_tractions
      procedure :: add_forces => add_traction_forces
   end type boundary_tractions_type

   type, extends(interaction_type) :: boundaries_type
      type(boundary_springs_type) :: springs
      type(boundary_tractions_type) :: tractions
      integer, allocatable :: edges(:, :)           !! (3, edges) boundary, block and first vertex
      real(wp), allocatable :: force(:, :)          !! (2, boundaries) on the blocks, of the last accepted step
   contains
      procedure :: init
      procedure :: become_quiet
      procedure :: place => place_forces
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
   subroutine place_forces(self, context, attempt, equations)
      class(boundaries_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(equations_type), intent(inout) :: equations
      call self%springs%add_to_blocks(context, attempt, equations)
      call self%tractions%add_to_blocks(context, attempt, equations)
   end subroutine place_forces

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

   !> No edges yet.
   pure subroutine clear_tractions(self)
      class(boundary_tractions_type), intent(inout) :: self
      if (allocated(self%list)) deallocate (self%list)
      allocate (self%list(0))
   end subroutine clear_tractions

   !> The edge of a block between two vertices carries the traction of a boundary.
   pure subroutine append_loaded_edge(self, boundary, block, vertices)
      class(boundary_tractions_type), intent(inout) :: self
      integer, intent(in) :: boundary, block, vertices(2)
      self%list = [self%list, loaded_edge_type(boundary, block, vertices)]
   end subroutine append_loaded_edge

   !> Loads of all edges of active blocks.
   subroutine add_tractions(self, context, attempt, equations)
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
   end subroutine add_tractions

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
   pure subroutine sum_tractions(self, force)
      class(boundary_tractions_type), intent(in) :: self
      real(wp), intent(inout) :: force(:, :)   !! (2, boundaries)
      integer :: i
      do i = 1, size(self%list)
         associate (edge => self%list(i))
            force(:, edge%group) = force(:, edge%group) + edge%force
         end associate
      end do
   end subroutine sum_tractions

   !> Forces on the moved blocks; while they change there is no equilibrium.
   subroutine add_traction_forces(self, context, attempt, forces)
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
   end subroutine add_traction_forces

end module rockdda_interaction_boundaries
