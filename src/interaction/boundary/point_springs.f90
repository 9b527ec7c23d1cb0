! SPDX-License-Identifier: MIT
!> Springs that hold points of blocks: of a fixed point, two equal ones along x and y; of a boundary, one along a line.
!>
!> Source: thesis Eqs. 3.11, 3.11.1 (fixed point), with the movement so far kept so that the point does not drift:
!> a spring is as long as moved - target, where `moved` is the displacement of the point since the start and
!> `target` the prescribed one. The point moves by the T of rockdda_interaction_finite_rotation.
module rockdda_interaction_point_springs
   use rockdda_base_kinds, only : wp
   use rockdda_interaction_attempt, only : attempt_type
   use rockdda_interaction_equations, only : equations_type
   use rockdda_interaction_finite_rotation, only : moving_block_type, mean_load, mean_displacement, end_displacement
   use rockdda_geometry_polygons, only : polygon_properties
   use rockdda_geometry_segments, only : distance_to_segment
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_interaction_contact_stiffness, only : set_stiffness
   use rockdda_interaction_ties, only : tie_stiffness
   implicit none
   private
   public :: add_point_spring, add_line_spring, measure_point, spring_step_energy, support_stiffness

contains

   !> Spring of a point to its target: p T^T T to the stiffness, p T^T (target - moved) to the load;
   !> potential 1/2 p |moved + T d - target|**2.
   pure subroutine add_point_spring(p, point, block, moved, target, k, f, level)
      real(wp), intent(in) :: p             !! stiffness [force/length], > 0
      real(wp), intent(in) :: point(2)      !! where the point is at the start of the step [length]
      type(moving_block_type), intent(in) :: block
      real(wp), intent(in) :: moved(2)      !! its displacement since the start [length]
      real(wp), intent(in) :: target(2)     !! prescribed displacement at the end of the step [length]
      real(wp), intent(inout) :: k(6, 6)    !! diagonal block
      real(wp), intent(inout) :: f(6)       !! load
      real(wp), intent(in), optional :: level   !! share of the step's motion after which the force acts; default 1
      real(wp) :: t(2, 6), share
      integer :: j
      share = 1
      if (present(level)) share = level
      t(1, :) = mean_load([1.0_wp, 0.0_wp], point, block)
      t(2, :) = mean_load([0.0_wp, 1.0_wp], point, block)
      do j = 1, 6
         k(:, j) = k(:, j) + share*p*(t(1, :)*t(1, j) + t(2, :)*t(2, j))
      end do
      f = f + mean_load(p*(target - moved), point, block)
   end subroutine add_point_spring

   !> Spring along one line, whose force is `force` less p times the motion of the point:
   !> p (T^T n) (T^T n)^T to the stiffness, force T^T n to the load.
   pure subroutine add_line_spring(p, direction, force, point, block, k, f, magnitude)
      real(wp), intent(in) :: p             !! stiffness [force/length], > 0
      real(wp), intent(in) :: direction(2)  !! n, unit vector
      real(wp), intent(in) :: force         !! on the block along n
      real(wp), intent(in) :: point(2)      !! where the point is at the start of the step [length]
      type(moving_block_type), intent(in) :: block
      real(wp), intent(inout) :: k(21)      !! diagonal block (pack_lower)
      real(wp), intent(inout) :: f(6)       !! load
      real(wp), intent(inout) :: magnitude(6)
      real(wp) :: row(6)
      integer :: j, l
      row = mean_load(direction, point, block)
      l = 0
      do j = 1, 6
         k(l + 1:l + 7 - j) = k(l + 1:l + 7 - j) + p*row(j:6)*row(j)
         l = l + 7 - j
      end do
      f = f + force*row
      magnitude = magnitude + abs(force*row)
   end subroutine add_line_spring

   !> How far the springs of a point are off, by the displacement that the expected motion gives otherwise than the
   !> solution: see `measure_placement` of the interactions.
   pure subroutine measure_point(attempt, p, point, b, equations, direction)
      type(attempt_type), intent(in) :: attempt
      real(wp), intent(in) :: p                       !! stiffness [force/length]
      real(wp), intent(in) :: point(2)                !! at the start of the step [length]
      integer, intent(in) :: b                        !! block
      type(equations_type), intent(inout) :: equations
      real(wp), intent(in), optional :: direction(2)  !! of the spring; without it there is one along x and one along y
      real(wp) :: off(2), length, scale
      off = end_displacement(attempt%moved(b), point) - mean_displacement(equations%x(:, b), point, attempt%moving(b))
      length = maxval(abs(off))
      if (present(direction)) length = abs(dot_product(direction, off))
      scale = equations%block_force(b)
      if (scale > 0) equations%block_off(b) = max(equations%block_off(b), p*length/scale)
   end subroutine measure_point

   !> Energy of one step of a point spring; its stretch goes from x0 to x1 and its target moves by dx. With the
   !> force -p x1 of the spring on the block in the step,
   !>
   !>     external - (work on the block) = -p x1.dx + p x1.(x1 - x0 + dx) = stored + dissipated.
   pure subroutine spring_step_energy(p, x0, x1, dx, stored, dissipated, external, level)
      real(wp), intent(in) :: p             !! stiffness [force/length]
      real(wp), intent(in) :: x0(2)         !! moved - target at the start of the step, old target [length]
      real(wp), intent(in) :: x1(2)         !! moved + T d - target at the end of the step, new target [length]
      real(wp), intent(in) :: dx(2)         !! movement of the target in the step [length]
      real(wp), intent(out) :: stored       !! 1/2 p (x1**2 - x0**2) [energy]
      real(wp), intent(out) :: dissipated   !! 1/2 p (x1 - x0)**2 [energy], >= 0
      real(wp), intent(out) :: external     !! work of whoever moves the target [energy]
      real(wp), intent(in), optional :: level   !! share of the step after which the force acts; default 1, its end
      real(wp) :: after(2)                  !! change of the stretch from there on [length]
      stored = 0.5_wp*p*dot_product(x1 - x0, x1 + x0)
      dissipated = 0.5_wp*p*dot_product(x1 - x0, x1 - x0)
      external = -p*dot_product(x1, dx)
      if (.not. present(level)) return
      after = (1 - level)*(x1 - x0)
      dissipated = dissipated - p*dot_product(after, x1 - x0)
      external = external + p*dot_product(after, dx)
   end subroutine spring_step_energy

   !> With contacts of vertices on edges that is the contact stiffness of the run. By length it is that of a joint along
   !> the longest or stiffest of the block's edges, or of its ties.
   pure real(wp) function support_stiffness(blocks, parameters, block) result(stiffness)
      type(block_system_type), intent(in) :: blocks       !! at the start
      type(parameters_type), intent(in) :: parameters
      integer, intent(in) :: block
      real(wp) :: along(2), distance, largest, length, k_n, k_s, area, centroid(2), moments(3)
      integer :: first, last, v, next
      stiffness = parameters%fixed_stiffness
      if (.not. parameters%by_length) return
      first = blocks%vertex_offset(block) + 1
      last = blocks%vertex_offset(block + 1)
      call polygon_properties(blocks%vertices(:, first:last), area, centroid, moments)
      largest = 0
      do v = first, last
         if (blocks%edge_joint(v) == 0) cycle
         next = merge(first, v + 1, v == last)
         along = blocks%vertices(:, next) - blocks%vertices(:, v)
         length = norm2(along)
         ! from the edge, not from its line: that of an edge of an opening may pass through the centroid
         distance = distance_to_segment(centroid, blocks%vertices(:, v), blocks%vertices(:, next))
         associate (material => parameters%joint_materials(blocks%edge_joint(v)))
            call set_stiffness(parameters, material, length, k_n, k_s)
            ! automatic, by its size: of the largest E, which no stage changes
            if (.not. k_n > 0) k_n = parameters%normal_stiffness/sqrt(area)*length
            largest = max(largest, k_n)
            ! to a block like it
            if (material%tie) largest = max(largest, tie_stiffness(length, 2*distance/ &
               parameters%block_materials(blocks%block_material(block))%youngs_modulus))
         end associate
      end do
      if (largest > 0) stiffness = parameters%fixed_stiffness/parameters%normal_stiffness*largest
   end function support_stiffness

end module rockdda_interaction_point_springs
