! SPDX-License-Identifier: MIT
!> Loads: weight, base motion, point loads and line loads, as generalised forces of blocks.
!>
!> Source: thesis 3.2: a force f at (x, y) has the potential -u.f and the load T^T f (Eqs. 3.7,
!> 3.7.1; `mean_load` of rockdda_interaction_finite_rotation). The work of a load in a step is its load
!> vector times d, exactly.
!> Loads act on the arms of the middle of the step, with the value of its end.
module rockdda_interaction_loads
   use rockdda_base_kinds, only : wp, pi
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_base_parallel, only : parallel_blocks, piece, n_pieces
   use rockdda_base_strings, only : to_string
   use rockdda_geometry_polygons, only : distance_to_outline
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_options, only : base_motion_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_state, only : energy
   use rockdda_interaction_balance, only : energy_balance_type
   use rockdda_interaction_block_forces, only : block_forces_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_equations, only : equations_type
   use rockdda_interaction_finite_rotation, only : moving_block_type, new_moving_block, mean_load
   use rockdda_interaction_interaction, only : interaction_type
   use rockdda_interaction_kinematics, only : move_point
   implicit none
   private
   public :: loads_type, body_force, line_load, table_value, load_factor, base_acceleration

   !> Weight, base motion, point loads, line loads. Tables are read at the end of the step; the base acceleration in the
   !> middle of the step, where a constant acceleration over the step gives the velocity to second order.
   type, extends(interaction_type) :: loads_type
      integer, allocatable :: line_blocks(:)        !! (line loads) block that carries each
      real(wp), allocatable :: weight(:, :)         !! (6, nb) gravity
      real(wp), allocatable :: external(:, :)       !! (6, nb) point loads, line loads, base motion
   contains
      procedure :: init
      procedure :: add_to_blocks
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

   !> Value of a table at a time: linear in between, constant beyond the ends, zero for a table without rows.
   !> Where a time is listed more than once the last of these rows holds from then on (a jump).
   pure function table_value(rows, t) result(value)
      real(wp), intent(in) :: rows(:, :)          !! (1 + k, m) time and k values, times not decreasing
      real(wp), intent(in) :: t                   !! [time]
      real(wp) :: value(size(rows, 1) - 1)        !! (k)
      integer :: m, low, high, middle
      real(wp) :: w
      m = size(rows, 2)
      if (m == 0) then
         value = 0
      else if (t < rows(1, 1)) then
         value = rows(2:, 1)
      else if (t >= rows(1, m)) then
         value = rows(2:, m)
      else
         low = 1      ! rows(1, low) <= t < rows(1, high)
         high = m
         do while (high - low > 1)
            middle = (low + high)/2
            if (rows(1, middle) <= t) then
               low = middle
            else
               high = middle
            end if
         end do
         w = (t - rows(1, low))/(rows(1, high) - rows(1, low))
         value = (1 - w)*rows(2:, low) + w*rows(2:, high)
      end if
   end function table_value

   !> Factor of a line load at a time; 1 when there is no table.
   pure real(wp) function load_factor(table, t)
      real(wp), allocatable, intent(in) :: table(:, :)  !! (2, m) time, factor; may be unallocated or empty
      real(wp), intent(in) :: t                         !! [time]
      real(wp) :: value(1)
      load_factor = 1
      if (.not. allocated(table)) return
      if (size(table, 2) == 0) return
      value = table_value(table, t)
      load_factor = value(1)
   end function load_factor

   !> Acceleration of the base at a time: the table, zero before its first and after its last row, plus the
   !> harmonic terms A sin(2 pi f (t - t0) + phase), each zero before its start t0.
   pure function base_acceleration(motion, t) result(a)
      type(base_motion_type), intent(in) :: motion
      real(wp), intent(in) :: t    !! [time]
      real(wp) :: a(2)             !! (ax, ay) [length/time^2]
      real(wp) :: phase
      integer :: i, m
      a = 0
      if (allocated(motion%table)) then
         m = size(motion%table, 2)
         if (m > 0) then
            if (t >= motion%table(1, 1) .and. t <= motion%table(1, m)) a = table_value(motion%table, t)
         end if
      end if
      if (.not. allocated(motion%harmonics)) return
      do i = 1, size(motion%harmonics, 2)
         if (t < motion%harmonics(5, i)) cycle
         phase = 2*pi*motion%harmonics(3, i)*(t - motion%harmonics(5, i)) + motion%harmonics(4, i)
         a = a + sin(phase)*motion%harmonics(1:2, i)
      end do
   end function base_acceleration

   !> Find the block that carries each line load: both ends within e0 of its outline.
   subroutine init(self, blocks, parameters, line_ends, messages)
      class(loads_type), intent(inout) :: self
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      real(wp), allocatable, intent(out) :: line_ends(:, :) !! (4, line loads) at the start
      type(diagnostics_type), intent(inout) :: messages
      real(wp) :: tolerance
      integer :: l, i, first, last, n
      n = size(parameters%line_loads)
      if (allocated(self%weight)) deallocate (self%weight, self%external, self%line_blocks)
      allocate (line_ends(4, n), self%line_blocks(n), self%weight(6, blocks%n_blocks), &
                self%external(6, blocks%n_blocks))
      tolerance = max(blocks%edge_node_distance, 1.0e-9_wp*parameters%w0)
      do l = 1, n
         line_ends(:, l) = parameters%line_loads(l)%ends
         self%line_blocks(l) = 0
         do i = 1, blocks%n_blocks
            first = blocks%vertex_offset(i) + 1
            last = blocks%vertex_offset(i + 1)
            if (distance_to_outline(line_ends(1:2, l), blocks%vertices(:, first:last)) > tolerance) cycle
            if (distance_to_outline(line_ends(3:4, l), blocks%vertices(:, first:last)) > tolerance) cycle
            self%line_blocks(l) = i
            exit
         end do
         if (self%line_blocks(l) == 0) call messages%add(severity%error, 'line load '//to_string(l)// &
            ': no block has both ends ('//to_string(line_ends(1, l))//', '//to_string(line_ends(2, l))//') and ('// &
            to_string(line_ends(3, l))//', '//to_string(line_ends(4, l))//') on its outline', &
            parameters%line_loads(l)%origin)
      end do
   end subroutine init

   !> All loads of the step.
   subroutine add_to_blocks(self, context, equations)
      class(loads_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(equations_type), intent(inout) :: equations
      real(wp) :: base(2), gravity
      integer :: i
      base = -base_acceleration(context%parameters%base, context%state%time + 0.5_wp*context%dt)
      !$omp parallel do default(none) private(i, gravity) schedule(static) shared(self, context, base) &
      !$omp if (context%blocks%n_blocks > parallel_blocks)
      do i = 1, context%blocks%n_blocks
         associate (material => context%parameters%block_materials(context%blocks%block_material(i)))
            gravity = material%weight/material%density
         end associate
         if (context%parameters%gravity >= 0) gravity = context%parameters%gravity
         self%weight(:, i) = body_force(context%state%mass(i), [0.0_wp, -gravity*context%gravity])
         self%external(:, i) = body_force(context%state%mass(i), base)
         if (context%state%active(i)) cycle
         self%weight(:, i) = 0
         self%external(:, i) = 0
      end do
      !$omp end parallel do
      call add_points_and_lines(self, context)
      !$omp parallel do default(none) shared(self, context, equations) private(i) schedule(static) &
      !$omp if (context%blocks%n_blocks > parallel_blocks)
      do i = 1, context%blocks%n_blocks
         equations%block_load(:, i) = equations%block_load(:, i) + self%weight(:, i) + self%external(:, i)
         equations%block_magnitude(:, i) = equations%block_magnitude(:, i) + abs(self%weight(:, i)) + &
                                           abs(self%external(:, i))
      end do
      !$omp end parallel do
   end subroutine add_to_blocks

   !> Point loads and line loads at the end of the step.
   pure subroutine add_points_and_lines(self, context)
      class(loads_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      real(wp) :: force(2), factor, t_end
      integer :: p, b
      t_end = context%state%time + context%dt
      do p = 1, context%blocks%loading%n
         associate (table => context%parameters%loading_tables(p))
            if (.not. allocated(table%rows)) cycle
            if (size(table%rows, 2) == 0) cycle
            b = context%blocks%loading%block(p)
            if (.not. context%state%active(b)) cycle
            force = table_value(table%rows, t_end)
         end associate
         self%external(:, b) = self%external(:, b) + mean_load(force, context%state%loading_position(:, p), &
                                                               context%moving(b))
      end do
      do p = 1, size(self%line_blocks)
         b = self%line_blocks(p)
         if (.not. context%state%active(b)) cycle
         associate (load => context%parameters%line_loads(p), ends => context%line_ends(:, p))
            factor = load_factor(load%table, t_end)
            self%external(:, b) = self%external(:, b) + line_load(ends(1:2), ends(3:4), context%moving(b), &
                                                                  factor*load%force_start, factor*load%force_end)
         end associate
      end do
   end subroutine add_points_and_lines

   !> Work of all loads.
   subroutine add_energies(self, context, d, balance)
      class(loads_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      real(wp), intent(in), contiguous :: d(:, :)
      class(energy_balance_type), intent(inout) :: balance
      integer :: i, p, n
      n = n_pieces(context%blocks%n_blocks)
      call balance%make_room(context%blocks%n_blocks)
      !$omp parallel do default(none) shared(self, context, d, balance, n) private(i, p) schedule(static) &
      !$omp if (context%blocks%n_blocks > parallel_blocks)
      do p = 1, n
         balance%sums(1:2, p) = 0
         do i = (p - 1)*piece + 1, min(p*piece, context%blocks%n_blocks)
            balance%sums(1, p) = balance%sums(1, p) + dot_product(self%external(:, i), d(:, i))
            balance%sums(2, p) = balance%sums(2, p) - dot_product(self%weight(:, i), d(:, i))
         end do
      end do
      !$omp end parallel do
      call balance%add(energy%external, sum(balance%sums(1, 1:n)))
      call balance%add(energy%gravity, sum(balance%sums(2, 1:n)))
   end subroutine add_energies

   !> Line loads move with their blocks.
   subroutine commit(self, context, d)
      class(loads_type), intent(inout) :: self
      type(step_context_type), intent(inout) :: context
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

   !> Loads on the moved blocks.
   subroutine add_forces(self, context, forces)
      class(loads_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(block_forces_type), intent(inout) :: forces
      type(moving_block_type) :: block
      real(wp) :: base(2), force(2), factor, f(6), t_end
      integer :: b, i, p
      t_end = context%state%time + context%dt
      base = -base_acceleration(context%parameters%base, context%state%time + 0.5_wp*context%dt)
      do i = 1, context%blocks%n_blocks
         if (.not. context%state%active(i)) cycle
         call forces%add_load(i, self%weight(1:3, i))
         if (any(abs(base) > 0)) call forces%add_load(i, [context%state%mass(i)*base, 0.0_wp])
      end do
      do p = 1, context%blocks%loading%n
         associate (table => context%parameters%loading_tables(p))
            if (.not. allocated(table%rows)) cycle
            if (size(table%rows, 2) == 0) cycle
            b = context%blocks%loading%block(p)
            if (.not. context%state%active(b)) cycle
            force = table_value(table%rows, t_end)
         end associate
         call forces%add_force(b, force, context%state%loading_position(:, p) - context%state%centroid(:, b))
      end do
      do p = 1, size(self%line_blocks)
         b = self%line_blocks(p)
         if (.not. context%state%active(b)) cycle
         associate (load => context%parameters%line_loads(p), ends => context%line_ends(:, p))
            factor = load_factor(load%table, t_end)
            block = new_moving_block(context%state%centroid(:, b), spread(0.0_wp, 1, 6))
            f = line_load(ends(1:2), ends(3:4), block, factor*load%force_start, factor*load%force_end)
         end associate
         call forces%add_load(b, f(1:3))
      end do
   end subroutine add_forces

end module rockdda_interaction_loads
