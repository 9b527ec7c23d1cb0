! SPDX-License-Identifier: MIT
!> Loads: weight, base motion, point loads and line loads, as generalised forces of blocks.
!>
!> Source: thesis 3.2: a force f at (x, y) has the potential -u.f and the load T^T f (Eqs. 3.7,
!> 3.7.1; `mean_load` of rockdda_interaction_finite_rotation). The work of a load in a step is its load
!> vector times d, exactly.
!> Loads act on the arms of the middle of the step, with the value of its end.
module rockdda_interaction_loads
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_base_parallel, only : parallel_blocks, piece, n_pieces
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_state, only : energy
   use rockdda_interaction_attempt, only : attempt_type
   use rockdda_interaction_balance, only : energy_balance_type
   use rockdda_interaction_block_forces, only : block_forces_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_equations, only : equations_type
   use rockdda_interaction_finite_rotation, only : moving_block_type, new_moving_block, mean_load
   use rockdda_interaction_interaction, only : interaction_type
   use rockdda_interaction_kinematics, only : move_point
   use rockdda_interaction_time_tables, only : table_value, table_changes, load_factor, base_acceleration
   use rockdda_base_strings, only : to_string
   use rockdda_geometry_polygons, only : distance_to_outline
   implicit none
   private
   public :: loads_type, body_force, base_motion, line_load, find_carriers

   !> Weight, base motion, point loads, line loads. Tables are read at the end of the step; the base acceleration in the
   !> middle of the step, where a constant acceleration over the step gives the velocity to second order.
   type, extends(interaction_type) :: loads_type
      integer, allocatable :: line_blocks(:)        !! (line loads) block that carries each
      real(wp), allocatable :: weight(:, :)         !! (2, nb) gravity, at the centroids
      real(wp), allocatable :: external(:, :)       !! (6, nb) point loads, line loads, base motion; none: no array
   contains
      procedure :: init
      procedure :: make_room
      procedure :: place
      procedure :: add_energies
      procedure :: commit
      procedure :: add_forces
   end type loads_type

contains

   !> Load of a uniform acceleration field: m a at the centroid (Eqs. 3.9, 3.9.1, the second entry being f_y S).
   !> Gravity is a = (0, -g); a base that moves with acceleration a_b gives a = -a_b.
   pure function body_force(mass, acceleration) result(f)
      real(wp), intent(in) :: mass             !! of the block [mass]
      real(wp), intent(in) :: acceleration(2)  !! (ax, ay) [length/time^2]
      real(wp) :: f(6)                         !! load
      f = 0
      f(1:2) = mass*acceleration
   end function body_force

   !> Acceleration of the base in the step: of tables and harmonic terms that of the middle, of records the mean.
   !> A scheme that takes forces at another level of the step has the middle there.
   pure function base_motion(context, attempt) result(a)
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      real(wp) :: a(2)                !! [length/time^2]
      real(wp) :: middle              !! share of the step
      middle = attempt%scheme%middle()
      a = base_acceleration(context%parameters%base, attempt%motion_time(context, middle))
      if (context%ground_motion%acts('base_acceleration')) a = a + context%ground_motion%mean_acceleration( &
         'base_acceleration', attempt%motion_time(context, middle - 0.5_wp), &
         attempt%motion_time(context, middle + 0.5_wp))
   end function base_motion

   !> Room for the loads, and the blocks that carry the line loads.
   subroutine init(self, blocks, parameters, line_ends, messages)
      class(loads_type), intent(inout) :: self
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      real(wp), allocatable, intent(out) :: line_ends(:, :) !! (4, line loads) at the start
      type(diagnostics_type), intent(inout) :: messages
      integer :: l, n
      n = size(parameters%line_loads)
      if (allocated(self%weight)) deallocate (self%weight, self%line_blocks)
      if (allocated(self%external)) deallocate (self%external)
      allocate (line_ends(4, n), self%line_blocks(n), self%weight(2, blocks%n_blocks))
      do l = 1, n
         line_ends(:, l) = parameters%line_loads(l)%ends
      end do
      call find_carriers(blocks, parameters, self%line_blocks, messages)
   end subroutine init

   !> Room for more blocks, which have no weight yet.
   pure subroutine make_room(self, n_blocks)
      class(loads_type), intent(inout) :: self
      integer, intent(in) :: n_blocks
      if (size(self%weight, 2) == n_blocks) return
      deallocate (self%weight)
      allocate (self%weight(2, n_blocks))
   end subroutine make_room

   !> All loads of the step.
   subroutine place(self, context, attempt, equations)
      class(loads_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(equations_type), intent(inout) :: equations
      real(wp) :: base(2), gravity, f(6)
      integer :: i
      base = -base_motion(context, attempt)
      !$omp parallel do default(none) private(i, gravity, f) shared(self, context, attempt, equations) &
      !$omp schedule(static) if (context%blocks%n_blocks > parallel_blocks)
      do i = 1, context%blocks%n_blocks
         associate (material => context%parameters%block_materials(context%blocks%block_material(i)))
            gravity = material%weight/material%density
         end associate
         if (context%parameters%gravity >= 0) gravity = context%parameters%gravity
         f = 0
         if (context%state%active(i)) f = body_force(context%state%mass(i), &
                                                     gravity*attempt%gravity*context%parameters%weight_direction)
         self%weight(:, i) = f(1:2)
         equations%block_load(1:2, i) = equations%block_load(1:2, i) + self%weight(:, i)
         equations%block_magnitude(1:2, i) = equations%block_magnitude(1:2, i) + abs(self%weight(:, i))
      end do
      !$omp end parallel do
      if (.not. (allocated(self%external) .or. any(abs(base) > 0) .or. context%blocks%loading%n > 0 .or. &
                 size(self%line_blocks) > 0)) return
      if (.not. allocated(self%external)) allocate (self%external(6, context%blocks%n_blocks))
      self%external = 0
      do i = 1, context%blocks%n_blocks
         if (context%state%active(i)) self%external(:, i) = body_force(context%state%mass(i), base)
      end do
      call add_points_and_lines(self, context, attempt)
      !$omp parallel do default(none) shared(self, context, attempt, equations) private(i) schedule(static) &
      !$omp if (context%blocks%n_blocks > parallel_blocks)
      do i = 1, context%blocks%n_blocks
         equations%block_load(:, i) = equations%block_load(:, i) + self%external(:, i)
         equations%block_magnitude(:, i) = equations%block_magnitude(:, i) + abs(self%external(:, i))
      end do
      !$omp end parallel do
   end subroutine place

   !> Point loads and line loads at the time of the step for which forces are taken, its end in Shi's scheme.
   pure subroutine add_points_and_lines(self, context, attempt)
      class(loads_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      real(wp) :: force(2), factor, t_end
      integer :: p, b
      t_end = attempt%load_time(context)
      do p = 1, context%blocks%loading%n
         associate (table => context%parameters%loading_tables(p))
            if (.not. allocated(table%rows)) cycle
            if (size(table%rows, 2) == 0) cycle
            b = context%blocks%loading%block(p)
            if (.not. context%state%active(b)) cycle
            force = table_value(table%rows, t_end)
         end associate
         self%external(:, b) = self%external(:, b) + mean_load(force, context%state%loading_position(:, p), &
                                                               attempt%moving(b))
      end do
      do p = 1, size(self%line_blocks)
         b = self%line_blocks(p)
         if (.not. context%state%active(b)) cycle
         associate (load => context%parameters%line_loads(p), ends => context%line_ends(:, p))
            factor = load_factor(load%table, t_end)
            self%external(:, b) = self%external(:, b) + line_load(ends(1:2), ends(3:4), attempt%moving(b), &
                                                                  factor*load%force_start, factor*load%force_end)
         end associate
      end do
   end subroutine add_points_and_lines

   !> Work of all loads.
   subroutine add_energies(self, context, attempt, d, balance)
      class(loads_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      real(wp), intent(in), contiguous :: d(:, :)
      class(energy_balance_type), intent(inout) :: balance
      integer :: i, p, n
      n = n_pieces(context%blocks%n_blocks)
      call balance%make_room(context%blocks%n_blocks)
      !$omp parallel do default(none) shared(self, context, attempt, d, balance, n) private(i, p) schedule(static) &
      !$omp if (context%blocks%n_blocks > parallel_blocks)
      do p = 1, n
         balance%sums(1:2, p) = 0
         do i = (p - 1)*piece + 1, min(p*piece, context%blocks%n_blocks)
            balance%sums(2, p) = balance%sums(2, p) - dot_product(self%weight(:, i), d(1:2, i))
            if (.not. allocated(self%external)) cycle
            balance%sums(1, p) = balance%sums(1, p) + dot_product(self%external(:, i), d(:, i))
         end do
      end do
      !$omp end parallel do
      call balance%add(energy%external, sum(balance%sums(1, 1:n)))
      call balance%add(energy%gravity, sum(balance%sums(2, 1:n)))
   end subroutine add_energies

   !> Line loads move with their blocks.
   subroutine commit(self, context, attempt, d)
      class(loads_type), intent(inout) :: self
      type(step_context_type), intent(inout) :: context
      type(attempt_type), intent(inout) :: attempt
      real(wp), intent(in), contiguous :: d(:, :)
      integer :: p, b, side
      do p = 1, size(self%line_blocks)
         b = self%line_blocks(p)
         do side = 1, 3, 2
            call move_point(d(:, b), context%state%centroid(:, b), context%parameters%exact_rotation, &
                            context%line_ends(side:side + 1, p))
         end do
      end do
   end subroutine commit

   !> Loads on the moved blocks; while points or lines are loaded more or less there is no equilibrium.
   subroutine add_forces(self, context, attempt, forces)
      class(loads_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(block_forces_type), intent(inout) :: forces
      type(moving_block_type) :: block
      real(wp) :: base(2), force(2), factor, f(6), t_end
      integer :: b, i, p
      t_end = context%state%time + attempt%dt
      base = -base_motion(context, attempt)
      do i = 1, context%blocks%n_blocks
         if (.not. context%state%active(i)) cycle
         call forces%add_load(i, [self%weight(1, i), self%weight(2, i), 0.0_wp])
         if (any(abs(base) > 0)) call forces%add_load(i, [context%state%mass(i)*base, 0.0_wp])
      end do
      do p = 1, context%blocks%loading%n
         associate (table => context%parameters%loading_tables(p))
            if (.not. allocated(table%rows)) cycle
            if (size(table%rows, 2) == 0) cycle
            b = context%blocks%loading%block(p)
            if (.not. context%state%active(b)) cycle
            force = table_value(table%rows, t_end)
            if (table_changes(table%rows, context%state%time, t_end)) forces%driven = .true.
         end associate
         call forces%add_force(b, force, context%state%loading_position(:, p) - context%state%centroid(:, b))
      end do
      do p = 1, size(self%line_blocks)
         b = self%line_blocks(p)
         if (.not. context%state%active(b)) cycle
         associate (load => context%parameters%line_loads(p), ends => context%line_ends(:, p))
            factor = load_factor(load%table, t_end)
            if (table_changes(load%table, context%state%time, t_end)) forces%driven = .true.
            block = new_moving_block(context%state%centroid(:, b), spread(0.0_wp, 1, 6))
            f = line_load(ends(1:2), ends(3:4), block, factor*load%force_start, factor*load%force_end)
         end associate
         call forces%add_load(b, f(1:3))
      end do
   end subroutine add_forces

   !> Load of a force per length along a segment, linear between its ends (Eq. 3.8.1; its
   !> potential, Eq. 3.8, is the negative of this load times d), integrated exactly:
   !> T and the force are both linear along the segment, so that the integral of their product over the length
   !> l is l (T_s^T (2 f_s + f_q) + T_q^T (f_s + 2 f_q))/6.
   pure function line_load(s, q, block, force_s, force_q) result(f)
      real(wp), intent(in) :: s(2), q(2)    !! ends of the segment [length]
      type(moving_block_type), intent(in) :: block
      real(wp), intent(in) :: force_s(2)    !! (fx, fy) at s [force/length]
      real(wp), intent(in) :: force_q(2)    !! (fx, fy) at q [force/length]
      real(wp) :: f(6)                      !! load
      real(wp) :: l
      l = norm2(q - s)
      f = mean_load(l/6*(2*force_s + force_q), s, block) + mean_load(l/6*(force_s + 2*force_q), q, block)
   end function line_load

   !> Block that carries each line load: both ends within e0 of its outline. Error: there is none.
   subroutine find_carriers(blocks, parameters, carriers, messages)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      integer, intent(out) :: carriers(:)               !! (line loads)
      type(diagnostics_type), intent(inout) :: messages
      real(wp) :: tolerance, ends(4)
      integer :: l, i, first, last
      tolerance = max(blocks%edge_node_distance, 1.0e-9_wp*parameters%w0)
      do l = 1, size(carriers)
         ends = parameters%line_loads(l)%ends
         carriers(l) = 0
         do i = 1, blocks%n_blocks
            first = blocks%vertex_offset(i) + 1
            last = blocks%vertex_offset(i + 1)
            if (distance_to_outline(ends(1:2), blocks%vertices(:, first:last)) > tolerance) cycle
            if (distance_to_outline(ends(3:4), blocks%vertices(:, first:last)) > tolerance) cycle
            carriers(l) = i
            exit
         end do
         if (carriers(l) == 0) call messages%add(severity%error, 'line load '//to_string(l)// &
            ': no block has both ends ('//to_string(ends(1))//', '//to_string(ends(2))//') and ('// &
            to_string(ends(3))//', '//to_string(ends(4))//") on its outline; &boundary kind = 'traction' loads the "// &
            'edges of several blocks', parameters%line_loads(l)%origin)
      end do
   end subroutine find_carriers

end module rockdda_interaction_loads
