! SPDX-License-Identifier: MIT
!> The flat layer under the Python extension `_rockdda` (f2py): numbers, texts and arrays of explicit size.
!>
!> A handle stands for a session (session.f90); Python owns it and passes nothing else. `status` is 0 or an error
!> code of rockdda_base_error; the messages are then fetched as text (`text_size`, `get_text`). Numbers count from 0
!> as in results files, except materials. -1 stands for a whole number that was not given, a negative number for a
!> real one. The lines `!f2py threadsafe` mark what works without the lock of the interpreter. This file is plain
!> ASCII, which f2py needs.
module rockdda_python_api
   ! f2py does not understand `use, intrinsic`
   ! allow(C122)
   use iso_c_binding, only : c_int, c_int64_t, c_double
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_code, make_error
   use rockdda_base_version, only : version, build_description
   use rockdda_model_analysis_input, only : time_table_type
   use rockdda_model_blocks, only : point_set_type
   use rockdda_model_state, only : n_energies, energy_names
   use rockdda_lines_generate, only : generate_lines
   use rockdda_lines_statistics, only : statistics_type
   use rockdda_io_block_writer, only : write_block_file
   use rockdda_io_legacy_writer, only : write_geometry_file
   use rockdda_io_source, only : source_type, new_source
   use rockdda_io_statistics_file, only : read_statistics_file, read_statistics_source
   use rockdda_io_recognise, only : file_kind
   use rockdda_driver_model_input, only : find_files, read_model, read_blocks, recognise_file
   use rockdda_python_session, only : session_type, new_session, get_session, drop_session, messages_text
   implicit none
   private
   public :: draw_file, draw_text, write_network, network_facts
   public :: geometry_sizes, geometry, analysis_sizes, analysis
   public :: create, destroy, request, read_files, read_texts, cut_file, cut_text, write_blocks
   public :: start, advance, finish, sizes, facts, blocks, points, bolts, state, contacts, text_size, get_text

   ! the build stops here if the reals of the library are not those of C
   integer, parameter :: same_kind = 1/merge(1, 0, wp == c_double)

contains

   !> A new session.
   subroutine create(handle)
      integer(c_int64_t), intent(out) :: handle
      call new_session(handle)
   end subroutine create

   !> The end of a session; its handle is worth nothing afterwards.
   subroutine destroy(handle)
      integer(c_int64_t), intent(in) :: handle
      !f2py threadsafe
      call drop_session(handle)
   end subroutine destroy

   !> What is asked for beside the files. Texts may be empty.
   subroutine request(handle, output, solver, dialect, threads, steps, save_every, t_end, max_wall, checkpoint_every, &
                      force)
      integer(c_int64_t), intent(in) :: handle
      character(len=*), intent(in) :: output, solver
      integer(c_int), intent(in) :: dialect                     !! 0 auto, 1 peer, 2 g0
      integer(c_int), intent(in) :: threads, steps, save_every
      real(c_double), intent(in) :: t_end, max_wall, checkpoint_every
      integer(c_int), intent(in) :: force                       !! 0 or 1
      type(session_type), pointer :: session
      call get_session(handle, session)
      session%request%output = output
      session%request%solver = solver
      session%request%dialect = dialect
      if (threads > 0) session%request%threads = threads
      if (steps >= 0) session%request%steps = steps
      if (save_every > 0) session%request%save_every = save_every
      if (t_end > 0) session%request%t_end = t_end
      if (max_wall > 0) session%request%max_wall = max_wall
      if (checkpoint_every > 0) session%request%checkpoint_every = checkpoint_every
      session%request%force = force /= 0
   end subroutine request

   !> Read the files of a run, and cut if need be.
   subroutine read_files(handle, model, analysis, config, status)
      integer(c_int64_t), intent(in) :: handle
      character(len=*), intent(in) :: model, analysis, config   !! analysis empty: model is a folder
      integer(c_int), intent(out) :: status
      type(session_type), pointer :: session
      !f2py threadsafe
      call get_session(handle, session)
      associate (s => session)
         call find_files(model, analysis, config, s%input, s%messages, s%error)
         if (s%status() == 0) call read_model(s%request, s%input, s%messages, s%error)
      end associate
      status = session%status()
   end subroutine read_files

   !> The same from texts in memory; the names are for messages. An empty options file has an empty name.
   subroutine read_texts(handle, model, analysis, config, model_text, analysis_text, config_text, status)
      integer(c_int64_t), intent(in) :: handle
      character(len=*), intent(in) :: model, analysis, config
      character(len=*), intent(in) :: model_text, analysis_text, config_text
      integer(c_int), intent(out) :: status
      type(session_type), pointer :: session
      !f2py threadsafe
      call get_session(handle, session)
      associate (s => session)
         s%input%in_memory = .true.
         s%input%model_kind = file_kind%geometry
         s%input%model_file = model
         s%input%analysis_file = analysis
         s%input%config_file = config
         s%input%model_text = model_text
         s%input%analysis_text = analysis_text
         s%input%config_text = config_text
         call read_model(s%request, s%input, s%messages, s%error)
      end associate
      status = session%status()
   end subroutine read_texts

   !> Cut a geometry file, or read a block file.
   subroutine cut_file(handle, model, status)
      integer(c_int64_t), intent(in) :: handle
      character(len=*), intent(in) :: model
      integer(c_int), intent(out) :: status
      type(session_type), pointer :: session
      logical :: ok
      !f2py threadsafe
      call get_session(handle, session)
      associate (s => session)
         s%input%model_file = model
         call recognise_file(model, s%input%model_kind, s%messages, ok)
         if (ok .and. s%input%model_kind /= file_kind%geometry .and. s%input%model_kind /= file_kind%blocks) &
            call make_error(s%error, error_code%input, model//': error: expected a geometry or block file')
         if (s%status() == 0) call read_blocks(s%input, s%messages, s%error)
      end associate
      status = session%status()
   end subroutine cut_file

   !> Cut the text of a geometry file.
   subroutine cut_text(handle, model, model_text, status)
      integer(c_int64_t), intent(in) :: handle
      character(len=*), intent(in) :: model, model_text
      integer(c_int), intent(out) :: status
      type(session_type), pointer :: session
      !f2py threadsafe
      call get_session(handle, session)
      associate (s => session)
         s%input%in_memory = .true.
         s%input%model_kind = file_kind%geometry
         s%input%model_file = model
         s%input%model_text = model_text
         call read_blocks(s%input, s%messages, s%error)
      end associate
      status = session%status()
   end subroutine cut_text

   !> Write the blocks as a block file.
   subroutine write_blocks(handle, path, status)
      integer(c_int64_t), intent(in) :: handle
      character(len=*), intent(in) :: path
      integer(c_int), intent(out) :: status
      type(session_type), pointer :: session
      !f2py threadsafe
      call get_session(handle, session)
      call write_block_file(path, session%input%blocks, session%error)
      status = session%status()
   end subroutine write_blocks

   !> Draw the lines of a joint statistics file.
   subroutine draw_file(handle, path, seed, status)
      integer(c_int64_t), intent(in) :: handle
      character(len=*), intent(in) :: path
      integer(c_int), intent(in) :: seed                        !! -1: that of the file
      integer(c_int), intent(out) :: status
      type(session_type), pointer :: session
      type(statistics_type) :: statistics
      integer :: kind
      logical :: ok
      !f2py threadsafe
      call get_session(handle, session)
      call recognise_file(path, kind, session%messages, ok)
      if (ok .and. kind /= file_kind%statistics) &
         call make_error(session%error, error_code%input, path//': error: expected a joint statistics file')
      if (session%status() == 0) call read_statistics_file(path, statistics, session%messages)
      call draw(session, statistics, seed)
      status = session%status()
   end subroutine draw_file

   !> The same from text in memory.
   subroutine draw_text(handle, name, text, seed, status)
      integer(c_int64_t), intent(in) :: handle
      character(len=*), intent(in) :: name, text                !! name: for messages
      integer(c_int), intent(in) :: seed                        !! -1: that of the text
      integer(c_int), intent(out) :: status
      type(session_type), pointer :: session
      type(statistics_type) :: statistics
      type(source_type) :: source
      !f2py threadsafe
      call get_session(handle, session)
      call new_source(name, text, source)
      call read_statistics_source(source, statistics, session%messages)
      call draw(session, statistics, seed)
      status = session%status()
   end subroutine draw_text

   !> Statistics to lines.
   subroutine draw(session, statistics, seed)
      type(session_type), intent(inout) :: session
      type(statistics_type), intent(inout) :: statistics
      integer(c_int), intent(in) :: seed
      if (session%status() /= 0) return
      if (seed >= 0) statistics%seed = seed
      call generate_lines(statistics, session%input%geometry, session%drawn, session%messages)
   end subroutine draw

   !> Write the lines as a geometry file.
   subroutine write_network(handle, path, status)
      integer(c_int64_t), intent(in) :: handle
      character(len=*), intent(in) :: path
      integer(c_int), intent(out) :: status
      type(session_type), pointer :: session
      !f2py threadsafe
      call get_session(handle, session)
      call write_geometry_file(path, session%input%geometry, session%error)
      status = session%status()
   end subroutine write_network

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
         values(1:8) = [size(g%line_joint), g%n_boundary, size(g%line_material), size(g%bolts, 2), &
                        size(g%fixed_lines, 2), size(g%loading_points, 2), size(g%measured_points, 2), &
                        size(g%hole_points, 2)]
         if (allocated(session%drawn%sets)) values(9) = size(session%drawn%sets)
      end associate
   end subroutine geometry_sizes

   !> The geometry before cutting; sizes as `geometry_sizes` says.
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
      call get_session(handle, session)
      associate (g => session%input%geometry)
         e0 = g%edge_node_distance
         lines = g%lines
         line_joint = g%line_joint
         material_lines = g%material_lines
         line_material = g%line_material
         bolt_ends = g%bolts
         bolt_values = g%bolt_values
         fixed = g%fixed_lines
         loading = g%loading_points
         measured = g%measured_points
         holes = g%hole_points
      end associate
   end subroutine geometry

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

   !> The analysis; sizes as `analysis_sizes` says. Tables of fixed points come before those of loading points.
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
            associate (m => a%block_materials(i))
               block_materials(:, i) = [m%density, m%weight, m%youngs_modulus, m%poisson_ratio, m%stress, &
                                        m%stress_gradient, m%velocity]
            end associate
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
      integer(c_int), intent(in) :: n_sets                      !! as `geometry_sizes` says
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

   !> Put the simulation into its state at time 0; with results, begin to write them.
   subroutine start(handle, write_results, status)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: write_results               !! 0 or 1
      integer(c_int), intent(out) :: status
      type(session_type), pointer :: session
      !f2py threadsafe
      call get_session(handle, session)
      call session%start(write_results /= 0)
      status = session%status()
   end subroutine start

   !> Do steps: at most n_steps, and no new one after so many seconds. Results end by themselves only on failure.
   subroutine advance(handle, n_steps, seconds, n_done, finished, status)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: n_steps
      real(c_double), intent(in) :: seconds
      integer(c_int), intent(out) :: n_done
      integer(c_int), intent(out) :: finished                   !! 1: the run has reached its last step or end time
      integer(c_int), intent(out) :: status
      type(session_type), pointer :: session
      !f2py threadsafe
      call get_session(handle, session)
      call session%advance(n_steps, seconds, n_done)
      finished = merge(1_c_int, 0_c_int, session%run%sim%is_finished())
      status = session%status()
   end subroutine advance

   !> Close the results. A run that has not come to its end is said to have ended for this reason.
   subroutine finish(handle, reason, status)
      integer(c_int64_t), intent(in) :: handle
      character(len=*), intent(in) :: reason
      integer(c_int), intent(out) :: status
      type(session_type), pointer :: session
      !f2py threadsafe
      call get_session(handle, session)
      call session%finish(reason)
      status = session%status()
   end subroutine finish

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
      integer(c_int), intent(in) :: nb, nv                      !! as `sizes` says
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

   !> Points on blocks at the start; `line` is that of the input file, 0 unknown.
   subroutine points(handle, kind, n, position, block, line)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: kind                        !! 1 fixed, 2 loading, 3 measured
      integer(c_int), intent(in) :: n                           !! as `sizes` says
      real(c_double), intent(out) :: position(2, n)
      integer(c_int), intent(out) :: block(n), line(n)
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
         if (.not. allocated(set%origin)) return
         do i = 1, n
            line(i) = set%origin(i)%line
         end do
      end subroutine copy

   end subroutine points

   !> Bolts at the start.
   subroutine bolts(handle, n, ends, block, values)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: n                           !! as `sizes` says
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
      integer(c_int), intent(in) :: nb, nv                      !! as `sizes` says
      real(c_double), intent(out) :: vertices(2, nv), centroid(2, nb), rotation(nb), stress(3, nb), velocity(6, nb)
      real(c_double), intent(out) :: area(nb)
      type(session_type), pointer :: session
      call get_session(handle, session)
      associate (s => session%run%sim%state)
         vertices = s%vertices(:, 1:nv)
         centroid = s%centroid(:, 1:nb)
         rotation = s%rotation(1:nb)
         stress = s%stress(:, 1:nb)
         velocity = s%velocity(:, 1:nb)
         area = s%area(1:nb)
      end associate
   end subroutine state

   !> The contacts of the last step, as a frame of the results holds them.
   subroutine contacts(handle, n, point, force, contact_state, block)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: n                           !! as `sizes` says
      real(c_double), intent(out) :: point(2, n), force(2, n)
      integer(c_int), intent(out) :: contact_state(n), block(2, n)
      type(session_type), pointer :: session
      integer :: c
      if (n == 0) return
      call get_session(handle, session)
      associate (t => session%run%sim%contacts)
         do c = 1, n
            point(:, c) = session%run%sim%state%vertices(:, t%vertex(c))
            block(:, c) = [t%block_a(c), t%block_b(c)] - 1
         end do
         force = session%force(:, 1:n)
         contact_state = t%state(1:n)
      end associate
   end subroutine contacts

   !> Prepare a text to be fetched, and tell its length in bytes. Which: 1 all messages (see messages_text), 2 the
   !> last failure, 3 path of the results, 4 path of the log, 5 why the run ended, 6 title, 7 version, 8 build,
   !> 9 names of the energies, one on each line, 10 geometry or block file, 11 analysis file, 12 options file, 13 what
   !> the options file says.
   subroutine text_size(handle, which, n)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: which
      integer(c_int), intent(out) :: n
      type(session_type), pointer :: session
      integer :: i
      call get_session(handle, session)
      associate (s => session)
         s%text = ''
         select case (which)
         case (1); s%text = messages_text(s%messages)
         case (2); if (allocated(s%error)) s%text = s%error%message
         case (3); if (allocated(s%run%output)) s%text = s%run%output
         case (4); if (allocated(s%run%log_file)) s%text = s%run%log_file
         case (5); if (allocated(s%run%reason)) s%text = s%run%reason
         case (6); if (allocated(s%input%parameters%title)) s%text = s%input%parameters%title
         case (7); s%text = version
         case (8); s%text = build_description()
         case (10); if (allocated(s%input%model_file)) s%text = s%input%model_file
         case (11); if (allocated(s%input%analysis_file)) s%text = s%input%analysis_file
         case (12); if (allocated(s%input%config_file)) s%text = s%input%config_file
         case (13); if (allocated(s%input%config_text)) s%text = s%input%config_text
         case default
            do i = 1, n_energies
               s%text = s%text//trim(energy_names(i))//new_line('a')
            end do
         end select
         n = len(s%text)
      end associate
   end subroutine text_size

   !> The text that `text_size` prepared, byte by byte.
   subroutine get_text(handle, n, codes)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: n
      integer(c_int), intent(out) :: codes(n)                   !! 0 ... 255
      type(session_type), pointer :: session
      integer :: i
      call get_session(handle, session)
      do i = 1, min(n, len(session%text))
         codes(i) = ichar(session%text(i:i))
      end do
   end subroutine get_text

end module rockdda_python_api
