! SPDX-License-Identifier: MIT
!> The flat layer under the Python extension `_rockdda` (f2py): the data of a session, as numbers and arrays of explicit
!> size.
!>
!> The caller gets the sizes first (`sizes`, `geometry_sizes`, `analysis_sizes`). Numbers count from 0 as in results
!> files, except materials. This file is plain ASCII, which f2py needs.
module rockdda_python_values
   ! f2py does not parse `use, intrinsic`
   ! allow(C122)
   use iso_c_binding, only : c_int, c_int64_t, c_double
   use rockdda_model_analysis_input, only : time_table_type
   use rockdda_model_blocks, only : point_set_type
   use rockdda_model_state, only : n_energies
   use rockdda_python_session, only : session_type, get_session
   implicit none
   private
   public :: geometry_sizes, geometry, analysis_sizes, analysis, network_facts
   public :: sizes, facts, blocks, points, bolts, state, contacts, motion

contains

   !> Sizes of the geometry: lines, boundary lines, material lines, bolts, fixed lines, loading, measured and hole
   !> points, joint sets that were drawn; all 0 when there is no geometry.
   subroutine geometry_sizes(handle, values)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(out) :: values(9)
      type(session_type), pointer :: session
      call get_session(handle, session)
      values = 0
      associate (g => session%input%geometry)
         if (.not. allocated(g%line_joint)) return
         values(1:8) = [size(g%line_joint), g%n_boundary, size(g%line_material), size(g%bolts), &
                        size(g%fixed_lines, 2), size(g%loading_points, 2), size(g%measured_points, 2), &
                        size(g%hole_points, 2)]
         if (allocated(session%drawn%sets)) values(9) = size(session%drawn%sets)
      end associate
   end subroutine geometry_sizes

   !> The geometry before cutting; sizes from `geometry_sizes`.
   subroutine geometry(handle, n_lines, n_materials, n_bolts, n_fixed, n_loading, n_measured, n_holes, e0, lines, &
                       line_joint, material_lines, line_material, bolt_ends, bolt_values, fixed, loading, measured, &
                       holes)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: n_lines, n_materials, n_bolts, n_fixed, n_loading, n_measured, n_holes
      real(c_double), intent(out) :: e0
      real(c_double), intent(out) :: lines(4, n_lines), material_lines(4, n_materials), bolt_ends(4, n_bolts)
      integer(c_int), intent(out) :: line_joint(n_lines), line_material(n_materials)
      real(c_double), intent(out) :: bolt_values(3, n_bolts)    !! stiffness, pretension, strength
      real(c_double), intent(out) :: fixed(4, n_fixed), loading(2, n_loading), measured(2, n_measured)
      real(c_double), intent(out) :: holes(2, n_holes)
      type(session_type), pointer :: session
      integer :: i
      call get_session(handle, session)
      associate (g => session%input%geometry)
         e0 = g%edge_node_distance
         lines = g%lines
         line_joint = g%line_joint
         material_lines = g%material_lines
         line_material = g%line_material
         do i = 1, n_bolts
            bolt_ends(:, i) = [g%bolts(i)%from, g%bolts(i)%to]
            bolt_values(:, i) = [g%bolts(i)%stiffness, g%bolts(i)%pretension, g%bolts(i)%yield_force]
         end do
         fixed = g%fixed_lines
         loading = g%loading_points
         measured = g%measured_points
         holes = g%hole_points
      end associate
   end subroutine geometry

   !> Times and values of the record that was read.
   subroutine motion(handle, n, rows)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: n                           !! from `motion_sizes`
      real(c_double), intent(out) :: rows(2, n)
      type(session_type), pointer :: session
      call get_session(handle, session)
      rows = session%motion
   end subroutine motion

   !> Sizes of the analysis: block materials, joint materials, points with tables, rows of all tables; number of
   !> steps; dialect.
   subroutine analysis_sizes(handle, values)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(out) :: values(6)
      type(session_type), pointer :: session
      integer :: i
      call get_session(handle, session)
      values = 0
      associate (a => session%input%analysis)
         if (.not. allocated(a%block_materials)) return
         values = [size(a%block_materials), size(a%joint_materials), 0, 0, a%n_steps, a%dialect]
         if (allocated(a%fixed_tables)) then
            do i = 1, size(a%fixed_tables)
               values(3:4) = values(3:4) + [1, size(a%fixed_tables(i)%rows, 2)]
            end do
         end if
         if (allocated(a%loading_tables)) then
            do i = 1, size(a%loading_tables)
               values(3:4) = values(3:4) + [1, size(a%loading_tables(i)%rows, 2)]
            end do
         end if
      end associate
   end subroutine analysis_sizes

   !> The analysis; sizes from `analysis_sizes`. Tables of fixed points come before those of loading points.
   subroutine analysis(handle, n_blocks, n_joints, n_tables, n_rows, numbers, block_materials, joint_materials, &
                       table_size, rows)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: n_blocks, n_joints, n_tables, n_rows
      real(c_double), intent(out) :: numbers(5)                 !! k01, g2, g1, g0, SOR factor
      real(c_double), intent(out) :: block_materials(13, n_blocks), joint_materials(3, n_joints)
      integer(c_int), intent(out) :: table_size(n_tables)
      real(c_double), intent(out) :: rows(3, n_rows)            !! t x y
      type(session_type), pointer :: session
      integer :: i, table, row
      call get_session(handle, session)
      associate (a => session%input%analysis)
         numbers = [a%k01, a%displacement_ratio, a%dt_max, a%stiffness, a%sor_factor]
         do i = 1, n_blocks
            block_materials(:, i) = a%block_materials(i)%numbers()
         end do
         do i = 1, n_joints
            associate (m => a%joint_materials(i))
               joint_materials(:, i) = [m%friction_angle, m%cohesion, m%tension]
            end associate
         end do
         table = 0
         row = 0
         if (allocated(a%fixed_tables)) call copy(a%fixed_tables)
         if (allocated(a%loading_tables)) call copy(a%loading_tables)
      end associate

   contains

      !> The tables of one kind of points.
      subroutine copy(tables)
         type(time_table_type), intent(in) :: tables(:)
         integer :: k, n
         do k = 1, size(tables)
            n = size(tables(k)%rows, 2)
            table = table + 1
            table_size(table) = n
            rows(:, row + 1:row + n) = tables(k)%rows
            row = row + n
         end do
      end subroutine copy

   end subroutine analysis

   !> Numbers of what was drawn: edge-node distance and area of the rock; and for each joint set: lines, traces, whole
   !> traces, traces and bridges in the statistics, mean and deviation of spacing, trace and bridge, length of all
   !> traces.
   subroutine network_facts(handle, n_sets, values, sets)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: n_sets                      !! from `geometry_sizes`
      real(c_double), intent(out) :: values(2)
      real(c_double), intent(out) :: sets(12, n_sets)
      type(session_type), pointer :: session
      integer :: i
      call get_session(handle, session)
      values = [session%input%geometry%edge_node_distance, session%drawn%rock_area]
      do i = 1, n_sets
         associate (r => session%drawn%sets(i))
            sets(1:5, i) = [r%n_lines, r%n_traces, r%n_whole, r%n_drawn, r%n_bridges]
            sets(6:12, i) = [r%spacing, r%spacing_deviation, r%trace, r%trace_deviation, r%bridge, &
                             r%bridge_deviation, r%length]
         end associate
      end do
   end subroutine network_facts

   !> Sizes of arrays and counters, in this order: blocks, vertices, fixed, loading and measured points, bolts,
   !> contacts, steps done, frames written, steps asked for; lines, dropped lines, shortened lines, islands and holes
   !> of the cut.
   subroutine sizes(handle, values)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(out) :: values(15)
      type(session_type), pointer :: session
      call get_session(handle, session)
      values = 0
      associate (b => session%input%blocks, r => session%run, c => session%input%cut)
         values(1:6) = [b%n_blocks, b%n_vertices(), b%fixed%n, b%loading%n, b%measured%n, b%bolts%n]
         if (session%is_started) &
            values(7:10) = [r%sim%contacts%n, r%sim%state%step, r%n_frames, r%sim%parameters%n_steps]
         values(11:15) = [c%n_lines, c%n_dropped_lines, c%n_shortened_lines, c%n_islands, c%n_holes]
      end associate
   end subroutine sizes

   !> Numbers, in this order: time, length of the last step, share of the run that is done; area of the blocks, area
   !> of the holes and enclosed area of the cut; then the energies.
   subroutine facts(handle, values)
      integer(c_int64_t), intent(in) :: handle
      real(c_double), intent(out) :: values(16)
      type(session_type), pointer :: session
      call get_session(handle, session)
      values = 0
      associate (r => session%run, c => session%input%cut)
         if (session%is_started) then
            values(1:3) = [r%sim%state%time, r%sim%record%dt, r%fraction_done()]
            values(7:6 + n_energies) = r%sim%record%energy
         end if
         values(4:6) = [c%area_sum, c%hole_area, c%enclosed_area]
      end associate
   end subroutine facts

   !> The blocks at the start.
   subroutine blocks(handle, nb, nv, vertex_offset, vertices, edge_joint, block_material)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: nb, nv                      !! from `sizes`
      integer(c_int), intent(out) :: vertex_offset(nb + 1)
      real(c_double), intent(out) :: vertices(2, nv)
      integer(c_int), intent(out) :: edge_joint(nv), block_material(nb)
      type(session_type), pointer :: session
      call get_session(handle, session)
      vertex_offset = 0
      if (nb == 0) return
      associate (b => session%input%blocks)
         vertex_offset = b%vertex_offset(1:nb + 1)
         vertices = b%vertices(:, 1:nv)
         edge_joint = b%edge_joint(1:nv)
         block_material = b%block_material(1:nb)
      end associate
   end subroutine blocks

   !> Points on blocks at the start; `line` is that of the input file, 0 unknown, `number` that of the point there.
   subroutine points(handle, kind, n, position, block, line, number)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: kind                        !! 1 fixed, 2 loading, 3 measured
      integer(c_int), intent(in) :: n                           !! from `sizes`
      real(c_double), intent(out) :: position(2, n)
      integer(c_int), intent(out) :: block(n), line(n), number(n)
      type(session_type), pointer :: session
      call get_session(handle, session)
      select case (kind)
      case (1); call copy(session%input%blocks%fixed)
      case (2); call copy(session%input%blocks%loading)
      case default; call copy(session%input%blocks%measured)
      end select

   contains

      !> The points of one kind.
      subroutine copy(set)
         type(point_set_type), intent(in) :: set
         integer :: i
         line = 0
         if (n == 0) return
         position = set%position(:, 1:n)
         block = set%block(1:n) - 1
         number = set%numbers()
         if (.not. allocated(set%origin)) return
         do i = 1, n
            line(i) = set%origin(i)%line
         end do
      end subroutine copy

   end subroutine points

   !> Bolts at the start.
   subroutine bolts(handle, n, ends, block, values)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: n                           !! from `sizes`
      real(c_double), intent(out) :: ends(4, n)
      integer(c_int), intent(out) :: block(2, n)                !! -1: the fixed outside
      real(c_double), intent(out) :: values(3, n)               !! stiffness, pretension, strength
      type(session_type), pointer :: session
      if (n == 0) return
      call get_session(handle, session)
      associate (b => session%input%blocks%bolts)
         ends = b%ends(:, 1:n)
         block = b%blocks(:, 1:n) - 1
         values(1, :) = b%stiffness(1:n)
         values(2, :) = b%pretension(1:n)
         values(3, :) = b%strength(1:n)
      end associate
   end subroutine bolts

   !> The moving blocks after the last step.
   subroutine state(handle, nb, nv, vertices, centroid, rotation, stress, velocity, area)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: nb, nv                      !! from `sizes`
      real(c_double), intent(out) :: vertices(2, nv), centroid(2, nb), rotation(nb), stress(3, nb), velocity(6, nb)
      real(c_double), intent(out) :: area(nb)
      type(session_type), pointer :: session
      call get_session(handle, session)
      associate (s => session%run%sim%state)
         vertices = s%vertices(:, 1:nv) + spread(s%datum, 2, nv)
         centroid = s%centroid(:, 1:nb) + spread(s%datum, 2, nb)
         rotation = s%rotation(1:nb)
         stress = s%stress(:, 1:nb)
         velocity = s%velocity(:, 1:nb)
         area = s%area(1:nb)
      end associate
   end subroutine state

   !> The contacts of the last step, as in a frame of the results.
   subroutine contacts(handle, n, point, force, contact_state, block)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: n                           !! from `sizes`
      real(c_double), intent(out) :: point(2, n), force(2, n)
      integer(c_int), intent(out) :: contact_state(n), block(2, n)
      type(session_type), pointer :: session
      integer :: k
      if (n == 0) return
      call get_session(handle, session)
      associate (contacts => session%contacts)
         do k = 1, n
            point(:, k) = contacts%point(:, k) + session%run%sim%state%datum
         end do
         block = contacts%blocks(:, 1:n) - 1
         force = contacts%force(:, 1:n)
         contact_state = contacts%state(1:n)
      end associate
   end subroutine contacts

end module rockdda_python_values
