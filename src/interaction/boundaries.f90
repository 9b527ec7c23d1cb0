! SPDX-License-Identifier: MIT
!> Boundaries: outer edges of blocks along polylines that are held, moved or loaded.
!>
!> An edge that is held or moved has springs at both its ends: along x and y, or, on a roller, along the normal of
!> the polyline's segment, which stays as it is. A spring is as long as moved - target, as that of a fixed point
!> (rockdda_interaction_supports), and begins with the force that the stress of the block exerts on the edge. The
!> traction of a stress that is linear along the edge has the work of two forces at its ends,
!>
!>     at p: L/6 (2 t_p + t_q),     at q: L/6 (t_p + 2 t_q),
!>
!> exactly, for displacements of the block are linear there, too. In the same way a traction acts on its edge; it
!> follows the edge, a stress or pressure also its normal.
module rockdda_interaction_boundaries
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_base_strings, only : counted, to_string
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_in_situ, only : initial_stress_type
   use rockdda_model_options, only : boundary_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_state, only : energy
   use rockdda_interaction_balance, only : energy_balance_type
   use rockdda_interaction_block_forces, only : block_forces_type
   use rockdda_interaction_boundary_edges, only : find_outer_edges, edges_along, nearest_outer_edge, next_vertex
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_equations, only : equations_type
   use rockdda_interaction_finite_rotation, only : moving_block_type, new_moving_block, mean_load, mean_displacement, &
      end_displacement
   use rockdda_interaction_interaction, only : interaction_type
   use rockdda_interaction_loads, only : line_load, load_factor
   use rockdda_interaction_support_stiffness, only : support_stiffness
   use rockdda_interaction_supports, only : support_energy
   implicit none
   private
   public :: boundaries_type, factor_integral

   !> One spring, along a direction that is fixed in space.
   type :: boundary_spring_type
      integer :: group = 0
      integer :: block = 0
      integer :: vertex = 0
      logical :: both = .false.      !! one of two, along x and y
      real(wp) :: direction(2) = 0
      real(wp) :: stiffness = 0      !! [force/length]
      real(wp) :: start_force = 0    !! on the block, along the direction
   end type boundary_spring_type

   !> One edge with a traction.
   type :: loaded_edge_type
      integer :: group = 0
      integer :: block = 0
      integer :: vertices(2) = 0
      real(wp) :: force(2) = 0       !! in the step
      real(wp) :: load(6) = 0        !! in the step
   end type loaded_edge_type

   type, extends(interaction_type) :: boundaries_type
      type(boundary_spring_type), allocatable :: springs(:)
      type(loaded_edge_type), allocatable :: loaded(:)
      integer, allocatable :: edges(:, :)           !! (2, edges) boundary and first vertex
      real(wp), allocatable :: target_start(:, :)   !! (2, boundaries) displacement at the step's start [length]
      real(wp), allocatable :: target_end(:, :)     !! (2, boundaries) and at its end
      real(wp), allocatable :: force(:, :)          !! (2, boundaries) on the blocks, of the last accepted step
   contains
      procedure :: init
      procedure :: start_energy
      procedure :: held_blocks
      procedure :: add_to_blocks
      procedure :: measure_placement
      procedure :: add_energies
      procedure :: commit
      procedure :: add_forces
   end type boundaries_type

contains

   !> Find the edges of all boundaries. Errors: boundaries without an edge, edges that two boundaries hold. The groups
   !> have been checked (rockdda_model_boundary_check).
   subroutine init(self, blocks, parameters, field, active, messages)
      class(boundaries_type), intent(inout) :: self
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(initial_stress_type), intent(in) :: field     !! stress at the start
      logical, intent(in) :: active(:)                   !! (nb) the others are placed later, free of stress
      type(diagnostics_type), intent(inout) :: messages
      logical, allocatable :: outer(:)
      integer, allocatable :: edges(:), edge_blocks(:), holder(:)
      real(wp), allocatable :: normals(:, :)
      real(wp) :: tolerance
      integer :: g, i, n
      n = 0
      if (allocated(parameters%boundaries)) n = size(parameters%boundaries)
      if (allocated(self%springs)) deallocate (self%springs, self%loaded, self%edges, self%target_start, &
                                                self%target_end, self%force)
      allocate (self%springs(0), self%loaded(0), self%edges(2, 0))
      allocate (self%target_start(2, n), self%target_end(2, n), self%force(2, n), source=0.0_wp)
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
               call report_missing(blocks, outer, group, g, tolerance, messages)
            else
               call messages%add(severity%note, '&boundary '//to_string(g)//' ('//group%kind//'): '// &
                                 counted(size(edges), 'edge')//' of blocks', group%origin)
            end if
            do i = 1, size(edges)
               associate (b => edge_blocks(i), k => edges(i))
                  self%edges = reshape([self%edges, g, k], [2, size(self%edges, 2) + 1])
                  if (group%kind == 'traction') then
                     self%loaded = [self%loaded, loaded_edge_type(g, b, [k, next_vertex(blocks, b, k)])]
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
                  call add_springs(self, blocks, parameters, field, g, b, k, normals(:, i))
               end associate
            end do
         end associate
      end do
      do i = 1, size(self%springs)
         if (.not. active(self%springs(i)%block)) self%springs(i)%start_force = 0
      end do
   end subroutine init

   !> Springs at both ends of edge k of block b, which carry the traction of the stress at the start.
   pure subroutine add_springs(self, blocks, parameters, field, g, b, k, normal)
      class(boundaries_type), intent(inout) :: self
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(initial_stress_type), intent(in) :: field
      integer, intent(in) :: g, b, k          !! boundary, block, edge
      real(wp), intent(in) :: normal(2)       !! of the polyline's segment
      type(boundary_spring_type) :: spring
      real(wp) :: forces(2, 2), directions(2, 2)
      integer :: i, side, vertices(2), n
      vertices = [k, next_vertex(blocks, b, k)]
      forces = end_forces(blocks, field, b, vertices)
      spring%group = g
      spring%block = b
      spring%stiffness = support_stiffness(blocks, parameters, b)
      directions = reshape([1.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [2, 2])
      n = 2
      if (parameters%boundaries(g)%kind == 'roller') then
         n = 1
         directions(:, 1) = normal
      end if
      spring%both = n == 2
      do side = 1, 2
         do i = 1, n
            spring%vertex = vertices(side)
            spring%direction = directions(:, i)
            spring%start_force = dot_product(directions(:, i), forces(:, side))
            self%springs = [self%springs, spring]
         end do
      end do
   end subroutine add_springs

   !> Forces at both ends of an edge that stand for the traction of the stress in the block.
   pure function end_forces(blocks, field, b, vertices) result(forces)
      type(block_system_type), intent(in) :: blocks
      type(initial_stress_type), intent(in) :: field
      integer, intent(in) :: b, vertices(2)
      real(wp) :: forces(2, 2)                !! on the block
      real(wp) :: edge(2), traction(2, 2), s(3)
      integer :: side
      edge = blocks%vertices(:, vertices(2)) - blocks%vertices(:, vertices(1))
      do side = 1, 2
         s = field%at(b, blocks%vertices(:, vertices(side)))
         ! times the length of the edge: its outward normal is (edge_y, -edge_x)/L
         traction(:, side) = [s(1)*edge(2) - s(3)*edge(1), s(3)*edge(2) - s(2)*edge(1)]
      end do
      forces(:, 1) = (2*traction(:, 1) + traction(:, 2))/6
      forces(:, 2) = (traction(:, 1) + 2*traction(:, 2))/6
   end function end_forces

   !> A boundary without an edge.
   subroutine report_missing(blocks, outer, group, g, tolerance, messages)
      type(block_system_type), intent(in) :: blocks
      logical, intent(in) :: outer(:)
      type(boundary_type), intent(in) :: group
      integer, intent(in) :: g
      real(wp), intent(in) :: tolerance          !! [length]
      type(diagnostics_type), intent(inout) :: messages
      character(len=:), allocatable :: text
      real(wp) :: distance
      integer :: edge, block
      text = '&boundary '//to_string(g)//': no outer edge of a block has both ends within '//to_string(tolerance)// &
             ' of the polyline'
      call nearest_outer_edge(blocks, outer, group%along, edge, block, distance)
      if (edge > 0) then
         text = text//'; the nearest one leads from '//place(blocks%vertices(:, edge))//' to '// &
                place(blocks%vertices(:, next_vertex(blocks, block, edge)))//', '
         if (distance > tolerance) then
            text = text//to_string(distance, 4)//' away'
         else
            text = text//'across it'
         end if
      end if
      call messages%add(severity%error, text, group%origin)
   end subroutine report_missing

   !> "(1, 2.5)"
   pure function place(point) result(text)
      real(wp), intent(in) :: point(2)
      character(len=:), allocatable :: text
      text = '('//to_string(point(1), 6)//', '//to_string(point(2), 6)//')'
   end function place

   !> Blocks with an edge that is fixed or moved.
   pure function held_blocks(self, n_blocks) result(held)
      class(boundaries_type), intent(in) :: self
      integer, intent(in) :: n_blocks
      logical :: held(n_blocks)
      integer :: i
      held = .false.
      do i = 1, size(self%springs)
         if (self%springs(i)%both) held(self%springs(i)%block) = .true.
      end do
   end function held_blocks

   !> Energy of the springs of each block at time 0.
   pure function start_energy(self, n_blocks) result(stored)
      class(boundaries_type), intent(in) :: self
      integer, intent(in) :: n_blocks
      real(wp) :: stored(n_blocks)
      integer :: i
      stored = 0
      do i = 1, size(self%springs)
         associate (s => self%springs(i))
            stored(s%block) = stored(s%block) + 0.5_wp*s%start_force**2/s%stiffness
         end associate
      end do
   end function start_energy

   !> Integral of the factor of a table from time 0 to t.
   pure real(wp) function factor_integral(table, t) result(total)
      real(wp), allocatable, intent(in) :: table(:, :)   !! (2, m) time, factor; may be unallocated or empty
      real(wp), intent(in) :: t                          !! [time], >= 0
      real(wp) :: from, to
      integer :: k, m
      total = t
      if (.not. allocated(table)) return
      m = size(table, 2)
      if (m == 0) return
      ! constant before the first row and after the last one
      total = table(2, 1)*max(0.0_wp, min(t, table(1, 1))) + table(2, m)*max(0.0_wp, t - max(0.0_wp, table(1, m)))
      do k = 1, m - 1
         from = max(0.0_wp, table(1, k))
         to = min(t, table(1, k + 1))
         if (to > from) total = total + 0.5_wp*(to - from)*(value(from) + value(to))
      end do

   contains

      !> Factor between rows k and k + 1.
      pure real(wp) function value(at)
         real(wp), intent(in) :: at
         value = table(2, k) + (at - table(1, k))/(table(1, k + 1) - table(1, k))*(table(2, k + 1) - table(2, k))
      end function value

   end function factor_integral

   !> Displacement of a moving boundary at a time; zero for others.
   pure function target_of(group, t) result(target)
      type(boundary_type), intent(in) :: group
      real(wp), intent(in) :: t     !! [time]
      real(wp) :: target(2)         !! [length]
      target = 0
      if (group%kind == 'moving') target = factor_integral(group%table, t)*group%velocity(:, 1)
   end function target_of

   !> Springs and tractions.
   subroutine add_to_blocks(self, context, equations)
      class(boundaries_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(equations_type), intent(inout) :: equations
      real(wp) :: row(6), force
      integer :: g, i, j
      do g = 1, size(self%force, 2)
         self%target_start(:, g) = target_of(context%parameters%boundaries(g), context%state%time)
         self%target_end(:, g) = target_of(context%parameters%boundaries(g), context%state%time + context%dt)
      end do
      do i = 1, size(self%springs)
         if (.not. context%state%active(self%springs(i)%block)) cycle
         associate (s => self%springs(i))
            row = mean_load(s%direction, context%state%vertices(:, s%vertex), context%moving(s%block))
            force = -s%stiffness*(stretch_at_start(s, context) - pulled_by(self, s))
            associate (k => equations%block_matrix(:, :, s%block))
               do j = 1, 6
                  k(:, j) = k(:, j) + s%stiffness*row*row(j)
               end do
            end associate
            equations%block_load(:, s%block) = equations%block_load(:, s%block) + force*row
            equations%block_magnitude(:, s%block) = equations%block_magnitude(:, s%block) + abs(force*row)
         end associate
      end do
      do i = 1, size(self%loaded)
         if (.not. context%state%active(self%loaded(i)%block)) then
            self%loaded(i)%force = 0
            self%loaded(i)%load = 0
            cycle
         end if
         associate (edge => self%loaded(i))
            call find_traction_load(context, context%parameters%boundaries(edge%group), &
                                    context%moving(edge%block), edge)
            equations%block_load(:, edge%block) = equations%block_load(:, edge%block) + edge%load
            equations%block_magnitude(:, edge%block) = equations%block_magnitude(:, edge%block) + abs(edge%load)
         end associate
      end do
   end subroutine add_to_blocks

   !> Stretch of a spring at the start of a step, with the target of that time: its force is -stiffness*stretch.
   pure real(wp) function stretch_at_start(spring, context) result(x)
      type(boundary_spring_type), intent(in) :: spring
      type(step_context_type), intent(in) :: context
      real(wp) :: moved(2)
      moved = context%state%vertices(:, spring%vertex) - context%blocks%vertices(:, spring%vertex)
      x = dot_product(spring%direction, moved - target_of(context%parameters%boundaries(spring%group), &
                                                          context%state%time)) - spring%start_force/spring%stiffness
   end function stretch_at_start

   !> How far the target of a spring moves in the step, along the spring.
   pure real(wp) function pulled_by(self, spring) result(dx)
      type(boundaries_type), intent(in) :: self
      type(boundary_spring_type), intent(in) :: spring
      dx = dot_product(spring%direction, self%target_end(:, spring%group) - self%target_start(:, spring%group))
   end function pulled_by

   !> Force and load of an edge with a traction: of the end of the step, on the arms of its middle. The traction is
   !> uniform along the edge.
   pure subroutine find_traction_load(context, group, block, edge)
      type(step_context_type), intent(in) :: context
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
      traction = load_factor(group%table, context%state%time + context%dt)*traction
      edge%force = norm2(q - p)*traction
      edge%load = line_load(p, q, block, traction, traction)
   end subroutine find_traction_load

   !> Displacements of springs that the expected motion gives otherwise than the solution.
   subroutine measure_placement(self, context, equations)
      class(boundaries_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(equations_type), intent(inout) :: equations
      real(wp) :: off(2), scale
      integer :: i
      do i = 1, size(self%springs)
         associate (s => self%springs(i), point => context%state%vertices(:, self%springs(i)%vertex), &
                    d => equations%x(:, self%springs(i)%block), block => context%moving(self%springs(i)%block))
            off = end_displacement(context%moved(s%block), point) - mean_displacement(d, point, block)
            scale = norm2(equations%block_load(1:2, s%block))
            if (scale > 0) equations%block_off(s%block) = max(equations%block_off(s%block), &
               s%stiffness*abs(dot_product(s%direction, off))/scale)
         end associate
      end do
   end subroutine measure_placement

   !> Springs, and work of moving boundaries and tractions.
   subroutine add_energies(self, context, d, balance)
      class(boundaries_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      real(wp), intent(in), contiguous :: d(:, :)
      class(energy_balance_type), intent(inout) :: balance
      real(wp) :: x0, x1, dx, stored, lost, external
      real(wp), allocatable :: before(:), after(:)   !! (nb)
      integer :: i
      if (size(self%springs) == 0 .and. size(self%loaded) == 0) return
      allocate (before(context%blocks%n_blocks), after(context%blocks%n_blocks), source=0.0_wp)
      do i = 1, size(self%springs)
         if (.not. context%state%active(self%springs(i)%block)) cycle
         associate (s => self%springs(i))
            x0 = stretch_at_start(s, context)
            x1 = stretch_at_end(self, s, context, d(:, s%block))
            dx = pulled_by(self, s)
            call support_energy(s%stiffness, [x0, 0.0_wp], [x1, 0.0_wp], [dx, 0.0_wp], stored, lost, external)
            before(s%block) = before(s%block) + 0.5_wp*s%stiffness*x0**2
            after(s%block) = after(s%block) + (0.5_wp*s%stiffness*x0**2 + stored)
            call balance%add(energy%dissipated, lost)
            call balance%add(energy%external, external)
         end associate
      end do
      do i = 1, context%blocks%n_blocks
         if (context%state%active(i)) then
            call balance%add(energy%geometry, before(i) - balance%boundary_energy(i))
         else
            ! the block has been taken out, and the energy of its springs with it
            call balance%add(energy%discarded, balance%boundary_energy(i))
         end if
      end do
      balance%boundary_energy = after
      do i = 1, size(self%loaded)
         call balance%add(energy%external, dot_product(self%loaded(i)%load, d(:, self%loaded(i)%block)))
      end do
   end subroutine add_energies

   !> Stretch of a spring at the end of a step, with the target of that time.
   pure real(wp) function stretch_at_end(self, spring, context, d) result(x)
      type(boundaries_type), intent(in) :: self
      type(boundary_spring_type), intent(in) :: spring
      type(step_context_type), intent(in) :: context
      real(wp), intent(in) :: d(6)    !! motion of the block
      x = stretch_at_start(spring, context) - pulled_by(self, spring) + &
          dot_product(spring%direction, mean_displacement(d, context%state%vertices(:, spring%vertex), &
                                                          context%moving(spring%block)))
   end function stretch_at_end

   !> Forces of the boundaries at the end of the step.
   subroutine commit(self, context, d)
      class(boundaries_type), intent(inout) :: self
      type(step_context_type), intent(inout) :: context
      real(wp), intent(in), contiguous :: d(:, :)
      integer :: i
      self%force = 0
      do i = 1, size(self%springs)
         if (.not. context%state%active(self%springs(i)%block)) cycle
         associate (s => self%springs(i))
            self%force(:, s%group) = self%force(:, s%group) - &
                                     s%stiffness*stretch_at_end(self, s, context, d(:, s%block))*s%direction
         end associate
      end do
      do i = 1, size(self%loaded)
         associate (edge => self%loaded(i))
            self%force(:, edge%group) = self%force(:, edge%group) + edge%force
         end associate
      end do
   end subroutine commit

   !> Forces on the moved blocks, which of them are held at a point along both axes, and whether a boundary moves.
   subroutine add_forces(self, context, forces)
      class(boundaries_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(block_forces_type), intent(inout) :: forces
      type(loaded_edge_type) :: edge
      type(moving_block_type) :: block
      real(wp) :: moved(2), stretch
      integer :: i
      forces%driven = forces%driven .or. any(abs(self%target_end - self%target_start) > 0)
      do i = 1, size(self%springs)
         if (.not. context%state%active(self%springs(i)%block)) cycle
         associate (s => self%springs(i))
            moved = context%state%vertices(:, s%vertex) - context%blocks%vertices(:, s%vertex)
            stretch = dot_product(s%direction, moved - self%target_end(:, s%group)) - s%start_force/s%stiffness
            call forces%add_force(s%block, -s%stiffness*stretch*s%direction, &
                                  context%state%vertices(:, s%vertex) - context%state%centroid(:, s%block))
            ! two springs at a vertex hold it, one of them is along x
            if (context%parameters%boundaries(s%group)%kind /= 'roller' .and. s%direction(1) > 0) &
               forces%held(s%block) = forces%held(s%block) + 1
         end associate
      end do
      do i = 1, size(self%loaded)
         edge = self%loaded(i)
         if (.not. context%state%active(edge%block)) cycle
         block = new_moving_block(context%state%centroid(:, edge%block), spread(0.0_wp, 1, 6))
         call find_traction_load(context, context%parameters%boundaries(edge%group), block, edge)
         call forces%add_load(edge%block, edge%load(1:3))
      end do
   end subroutine add_forces

end module rockdda_interaction_boundaries
