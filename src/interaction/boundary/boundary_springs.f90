! SPDX-License-Identifier: MIT
!> Springs of boundaries that are fixed, move, are rollers, or quiet in static steps, at both ends of each edge: along x
!> and y, or, on a roller or a quiet boundary, along the normal of the polyline's segment, which stays as it is.
!>
!> A spring is as long as moved - target, as that of a fixed point, and begins with the force that the stress of the
!> block exerts on the edge. The traction of a stress that is linear along the edge has the work of two forces at its
!> ends,
!>
!>     at p: L/6 (2 t_p + t_q),     at q: L/6 (t_p + 2 t_q),
!>
!> exactly, for displacements of the block are linear there, too.
!>
!> An edge of a cell that is tied to others is held as a tie holds it (rockdda_interaction_ties): the springs stand
!> close to its middle, so that what is linear along it gives way by the rock between the edge and the centroid,
!>
!>     2 p (h L)**2 = E/d L**3/12,     h of the middle in parts of L.
!>
!> Held at both ends of its edge a cell of uniform strain cannot bend.
module rockdda_interaction_boundary_springs
   use rockdda_base_kinds, only : wp
   use rockdda_geometry_polygons, only : polygon_properties
   use rockdda_geometry_segments, only : distance_to_segment
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_ground_options, only : is_quiet
   use rockdda_model_in_situ, only : initial_stress_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_state, only : energy
   use rockdda_interaction_attempt, only : attempt_type
   use rockdda_interaction_balance, only : energy_balance_type
   use rockdda_interaction_block_forces, only : block_forces_type
   use rockdda_interaction_boundary_edges, only : next_vertex
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_equations, only : equations_type
   use rockdda_interaction_finite_rotation, only : mean_displacement
   use rockdda_interaction_point_springs, only : add_line_spring, measure_point, spring_step_energy, support_stiffness
   use rockdda_interaction_time_tables, only : factor_integral
   implicit none
   private
   public :: boundary_springs_type

   !> One spring, along a direction that is fixed in space.
   type :: boundary_spring_type
      integer :: group = 0
      integer :: block = 0
      integer :: vertex = 0
      integer :: other = 0           !! vertex at the other end of the edge
      real(wp) :: share = 0          !! of the way there at which it stands
      logical :: both = .false.      !! one of two, along x and y
      logical :: quiet = .false.     !! holds in static steps only; then it keeps its force
      real(wp) :: direction(2) = 0
      real(wp) :: stiffness = 0      !! [force/length]
      real(wp) :: start_force = 0    !! on the block, along the direction
      real(wp) :: force = 0          !! the same at the end of the last accepted step
   end type boundary_spring_type

   type :: boundary_springs_type
      type(boundary_spring_type), allocatable :: list(:)
      real(wp), allocatable :: target_start(:, :)   !! (2, boundaries) displacement at the step's start [length]
      real(wp), allocatable :: target_end(:, :)     !! (2, boundaries) and at its end
   contains
      procedure :: clear
      procedure :: append_edge
      procedure :: release
      procedure :: held_blocks
      procedure :: start_energy
      procedure :: leave_to_water
      procedure :: hold_forces
      procedure :: add_to_blocks
      procedure :: measure_placement
      procedure :: add_energies
      procedure :: sum_forces
      procedure :: add_forces
   end type boundary_springs_type

contains

   !> No springs yet, of n boundaries.
   pure subroutine clear(self, n)
      class(boundary_springs_type), intent(inout) :: self
      integer, intent(in) :: n
      if (allocated(self%list)) deallocate (self%list, self%target_start, self%target_end)
      allocate (self%list(0))
      allocate (self%target_start(2, n), self%target_end(2, n), source=0.0_wp)
   end subroutine clear

   !> Springs at both ends of edge k of block b, which carry the traction of the stress at the start.
   pure subroutine append_edge(self, blocks, parameters, field, g, b, k, normal)
      class(boundary_springs_type), intent(inout) :: self
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(initial_stress_type), intent(in) :: field
      integer, intent(in) :: g, b, k          !! boundary, block, edge
      real(wp), intent(in) :: normal(2)       !! of the polyline's segment
      type(boundary_spring_type) :: spring
      real(wp) :: forces(2, 2), directions(2, 2), from_middle
      integer :: i, side, vertices(2), n
      vertices = [k, next_vertex(blocks, b, k)]
      forces = end_forces(blocks, field, b, vertices)
      spring%group = g
      spring%block = b
      spring%stiffness = support_stiffness(blocks, parameters, b)
      directions = reshape([1.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [2, 2])
      n = 2
      spring%quiet = is_quiet(parameters%boundaries(g))
      if (parameters%boundaries(g)%kind == 'roller' .or. spring%quiet) then
         n = 1
         directions(:, 1) = normal
      end if
      spring%both = n == 2
      from_middle = place_of_springs(blocks, parameters, b, vertices, spring%stiffness)
      if (spring%quiet) from_middle = 0.5_wp
      spring%share = 0.5_wp - from_middle
      if (spring%share > 0) then
         do i = 1, 2
            forces(i, :) = moved_in(forces(i, :), from_middle)
         end do
      end if
      do side = 1, 2
         do i = 1, n
            spring%vertex = vertices(side)
            spring%other = vertices(3 - side)
            spring%direction = directions(:, i)
            spring%start_force = dot_product(directions(:, i), forces(:, side))
            self%list = [self%list, spring]
         end do
      end do
   end subroutine append_edge

   !> Distance of the springs of an edge from its middle, in parts of its length.
   pure real(wp) function place_of_springs(blocks, parameters, b, vertices, stiffness) result(from_middle)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      integer, intent(in) :: b, vertices(2)       !! block; of the edge
      real(wp), intent(in) :: stiffness           !! of one spring [force/length]
      real(wp) :: edge(2), area, centroid(2), moments(3), distance, young
      integer :: k
      from_middle = 0.5_wp
      if (.not. parameters%by_length) return
      do k = blocks%vertex_offset(b) + 1, blocks%vertex_offset(b + 1)
         if (blocks%edge_joint(k) < 1) cycle
         if (.not. parameters%joint_materials(blocks%edge_joint(k))%tie) cycle
         edge = blocks%vertices(:, vertices(2)) - blocks%vertices(:, vertices(1))
         call polygon_properties(blocks%vertices(:, blocks%vertex_offset(b) + 1:blocks%vertex_offset(b + 1)), area, &
                                 centroid, moments)
         distance = distance_to_segment(centroid, blocks%vertices(:, vertices(1)), blocks%vertices(:, vertices(2)))
         young = parameters%block_materials(blocks%block_material(b))%youngs_modulus
         if (distance > 0) from_middle = min(0.5_wp, sqrt(young*norm2(edge)/(24*distance*stiffness)))
         return
      end do
   end function place_of_springs

   !> Forces with the same sum and moment as those at both ends of an edge.
   pure function moved_in(at_ends, from_middle) result(forces)
      real(wp), intent(in) :: at_ends(2), from_middle
      real(wp) :: forces(2)
      forces = 0.5_wp*sum(at_ends) + [-0.25_wp, 0.25_wp]*(at_ends(2) - at_ends(1))/from_middle
   end function moved_in

   !> Where a spring stands.
   pure function place_of(spring, vertices) result(place)
      type(boundary_spring_type), intent(in) :: spring
      real(wp), intent(in) :: vertices(:, :)      !! (2, nv)
      real(wp) :: place(2)
      place = vertices(:, spring%vertex)
      if (spring%share > 0) place = place + spring%share*(vertices(:, spring%other) - place)
   end function place_of

   !> Take the load of the water on edge k of block b off the springs that were added last.
   pure subroutine leave_to_water(self, blocks, b, k, pressure)
      class(boundary_springs_type), intent(inout) :: self
      type(block_system_type), intent(in) :: blocks
      integer, intent(in) :: b, k
      real(wp), intent(in) :: pressure(2)     !! shares of both ends [stress]
      real(wp) :: edge(2), shares(2)
      integer :: i
      edge = blocks%vertices(:, next_vertex(blocks, b, k)) - blocks%vertices(:, k)
      shares = pressure
      associate (s => self%list(size(self%list)))
         if (s%share > 0) shares = moved_in(pressure, 0.5_wp - s%share)
      end associate
      do i = size(self%list) - merge(3, 1, self%list(size(self%list))%both), size(self%list)
         associate (s => self%list(i))
            ! its force on the block: the pressure against the outward normal (edge_y, -edge_x)/L
            s%start_force = s%start_force - merge(shares(1), shares(2), s%vertex == k)* &
                            dot_product(s%direction, [-edge(2), edge(1)])
         end associate
      end do
   end subroutine leave_to_water

   !> Forces at both ends of an edge that represent the traction of the stress in the block.
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

   !> The springs of blocks that are not there yet begin without force.
   pure subroutine release(self, active)
      class(boundary_springs_type), intent(inout) :: self
      logical, intent(in) :: active(:)        !! (nb)
      integer :: i
      do i = 1, size(self%list)
         if (.not. active(self%list(i)%block)) self%list(i)%start_force = 0
      end do
   end subroutine release

   !> Blocks with an edge that is fixed or moved.
   pure function held_blocks(self, n_blocks) result(held)
      class(boundary_springs_type), intent(in) :: self
      integer, intent(in) :: n_blocks
      logical :: held(n_blocks)
      integer :: i
      held = .false.
      do i = 1, size(self%list)
         if (self%list(i)%both) held(self%list(i)%block) = .true.
      end do
   end function held_blocks

   !> Energy of the springs of each block at time 0.
   pure function start_energy(self, n_blocks) result(stored)
      class(boundary_springs_type), intent(in) :: self
      integer, intent(in) :: n_blocks
      real(wp) :: stored(n_blocks)
      integer :: i
      stored = 0
      do i = 1, size(self%list)
         associate (s => self%list(i))
            stored(s%block) = stored(s%block) + 0.5_wp*s%start_force**2/s%stiffness
         end associate
      end do
   end function start_energy

   !> Displacement of a boundary at a time: of its own, and of the ground by records.
   pure function target_of(context, attempt, g, t) result(target)
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      integer, intent(in) :: g      !! boundary
      real(wp), intent(in) :: t     !! [time]
      real(wp) :: target(2)         !! [length]
      target = context%ground_motion%displacement('base_motion', t - attempt%motion_start)
      associate (group => context%parameters%boundaries(g))
         if (group%kind == 'moving') target = target + factor_integral(group%table, t)*group%velocity(:, 1)
      end associate
   end function target_of

   !> Before the first dynamic step: the forces that springs of quiet boundaries keep. What they have stored
   !> is discarded.
   subroutine hold_forces(self, context, attempt, balance)
      class(boundary_springs_type), intent(in) :: self
      type(step_context_type), intent(inout) :: context
      type(attempt_type), intent(in) :: attempt
      class(energy_balance_type), intent(inout) :: balance
      real(wp) :: force(size(self%list)), stored
      integer :: i
      force = 0
      do i = 1, size(self%list)
         associate (s => self%list(i))
            if (.not. s%quiet .or. .not. context%state%active(s%block)) cycle
            force(i) = -s%stiffness*stretch_at_start(s, context, attempt)
            stored = 0.5_wp*force(i)**2/s%stiffness
            balance%boundary_energy(s%block) = balance%boundary_energy(s%block) - stored
            call balance%add(energy%discarded, stored)
         end associate
      end do
      context%state%quiet_force = force
   end subroutine hold_forces

   !> Is the spring one of a quiet boundary that only keeps its force?
   pure logical function is_held(self, i, context)
      class(boundary_springs_type), intent(in) :: self
      integer, intent(in) :: i       !! spring
      type(step_context_type), intent(in) :: context
      is_held = self%list(i)%quiet .and. context%state%quiet
   end function is_held

   !> Springs of all active blocks.
   subroutine add_to_blocks(self, context, attempt, equations)
      class(boundary_springs_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(equations_type), intent(inout) :: equations
      integer :: g, i
      do g = 1, size(self%target_end, 2)
         self%target_start(:, g) = target_of(context, attempt, g, context%state%time)
         self%target_end(:, g) = target_of(context, attempt, g, context%state%time + attempt%dt)
      end do
      do i = 1, size(self%list)
         associate (s => self%list(i), b => self%list(i)%block)
            if (.not. context%state%active(b)) cycle
            if (is_held(self, i, context)) then
               call add_line_spring(0.0_wp, s%direction, context%state%quiet_force(i), &
                                    place_of(s, context%state%vertices), attempt%moving(b), &
                                    equations%block_matrix(:, b), equations%block_load(:, b), &
                                    equations%block_magnitude(:, b))
               cycle
            end if
            call add_line_spring(attempt%scheme%level*s%stiffness, s%direction, -s%stiffness* &
                                 (stretch_at_start(s, context, attempt) - attempt%scheme%level*pulled_by(self, s)), &
                                 place_of(s, context%state%vertices), attempt%moving(b), &
                                 equations%block_matrix(:, b), equations%block_load(:, b), &
                                 equations%block_magnitude(:, b))
         end associate
      end do
   end subroutine add_to_blocks

   !> Stretch of a spring at the start of a step, with the target of that time: its force is -stiffness*stretch.
   pure real(wp) function stretch_at_start(spring, context, attempt) result(x)
      type(boundary_spring_type), intent(in) :: spring
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      real(wp) :: moved(2)
      moved = place_of(spring, context%state%vertices) - place_of(spring, context%blocks%vertices)
      x = dot_product(spring%direction, moved - target_of(context, attempt, spring%group, context%state%time)) - &
          spring%start_force/spring%stiffness
   end function stretch_at_start

   !> How far the target of a spring moves in the step, along the spring.
   pure real(wp) function pulled_by(self, spring) result(dx)
      type(boundary_springs_type), intent(in) :: self
      type(boundary_spring_type), intent(in) :: spring
      dx = dot_product(spring%direction, self%target_end(:, spring%group) - self%target_start(:, spring%group))
   end function pulled_by

   !> Stretch of a spring at the end of a step, with the target of that time.
   pure real(wp) function stretch_at_end(self, spring, context, attempt, d) result(x)
      type(boundary_springs_type), intent(in) :: self
      type(boundary_spring_type), intent(in) :: spring
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      real(wp), intent(in) :: d(6)    !! motion of the block
      x = stretch_at_start(spring, context, attempt) - pulled_by(self, spring) + &
          moved_along(spring, context, attempt, d)
   end function stretch_at_end

   !> Motion of the point of a spring in the step, along it.
   pure real(wp) function moved_along(spring, context, attempt, d) result(u)
      type(boundary_spring_type), intent(in) :: spring
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      real(wp), intent(in) :: d(6)    !! motion of the block
      u = dot_product(spring%direction, mean_displacement(d, place_of(spring, context%state%vertices), &
                                                          attempt%moving(spring%block)))
   end function moved_along

   !> Displacements of springs that the expected motion gives otherwise than the solution.
   subroutine measure_placement(self, context, attempt, equations)
      class(boundary_springs_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(equations_type), intent(inout) :: equations
      integer :: i
      do i = 1, size(self%list)
         if (is_held(self, i, context)) cycle
         associate (s => self%list(i))
            call measure_point(attempt, s%stiffness, place_of(s, context%state%vertices), s%block, equations, &
                               s%direction)
         end associate
      end do
   end subroutine measure_placement

   !> Stored and lost energy, and work of moving boundaries.
   subroutine add_energies(self, context, attempt, d, balance)
      class(boundary_springs_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      real(wp), intent(in), contiguous :: d(:, :)
      class(energy_balance_type), intent(inout) :: balance
      real(wp) :: x0, x1, dx, stored, lost, external
      real(wp), allocatable :: before(:), after(:)   !! (nb)
      integer :: i
      allocate (before(context%blocks%n_blocks), after(context%blocks%n_blocks), source=0.0_wp)
      do i = 1, size(self%list)
         if (.not. context%state%active(self%list(i)%block)) cycle
         associate (s => self%list(i))
            if (is_held(self, i, context)) then
               call balance%add(energy%external, context%state%quiet_force(i)* &
                                moved_along(s, context, attempt, d(:, s%block)))
               cycle
            end if
            x0 = stretch_at_start(s, context, attempt)
            x1 = stretch_at_end(self, s, context, attempt, d(:, s%block))
            dx = pulled_by(self, s)
            call spring_step_energy(s%stiffness, [x0, 0.0_wp], [x1, 0.0_wp], [dx, 0.0_wp], stored, lost, external, &
                                    attempt%scheme%level)
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
   end subroutine add_energies

   !> Find the forces at the end of the step, on the blocks, and add them to those of each boundary.
   !>
   !> They are those of the solution. Positions that have been moved by it are rounded: by 1e-18 in a model of 10 mm,
   !> which on springs of 1e12 is a force beyond the share of the weights that equilibrium allows.
   pure subroutine sum_forces(self, context, attempt, d, force)
      class(boundary_springs_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      real(wp), intent(in), contiguous :: d(:, :)
      real(wp), intent(inout) :: force(:, :)          !! (2, boundaries)
      integer :: i
      do i = 1, size(self%list)
         if (.not. context%state%active(self%list(i)%block)) cycle
         associate (s => self%list(i))
            if (is_held(self, i, context)) then
               s%force = context%state%quiet_force(i)
            else
               s%force = -s%stiffness*stretch_at_end(self, s, context, attempt, d(:, s%block))
            end if
            force(:, s%group) = force(:, s%group) + s%force*s%direction
         end associate
      end do
   end subroutine sum_forces

   !> Forces on the moved blocks, which of them are held at a point along both axes, and whether a boundary moves.
   subroutine add_forces(self, context, forces)
      class(boundary_springs_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(block_forces_type), intent(inout) :: forces
      integer :: i
      forces%driven = forces%driven .or. any(abs(self%target_end - self%target_start) > 0)
      do i = 1, size(self%list)
         if (.not. context%state%active(self%list(i)%block)) cycle
         associate (s => self%list(i))
            call forces%add_force(s%block, s%force*s%direction, &
                                  place_of(s, context%state%vertices) - context%state%centroid(:, s%block))
            ! two springs at a vertex hold it, one of them is along x
            if (s%both .and. s%direction(1) > 0) forces%held(s%block) = forces%held(s%block) + 1
         end associate
      end do
   end subroutine add_forces

end module rockdda_interaction_boundary_springs
