! SPDX-License-Identifier: MIT
!> DC: cuts the plane into blocks along the input lines.
!>
!>     call cut_blocks(geometry, blocks, report, messages, error)
!>
!> Steps, one module each: parts of lines that lie on each other (overlaps), meetings of lines (intersections), merging
!> into nodes (nodes), repeated cleaning until no two pieces cross (cleaning), distinct edges (graph), dead ends and
!> faces (faces), islands (nesting), polygons and their order (outlines), holes, materials, points and bolts
!> (assignment).
!>
!> Boundary lines (the first n_boundary) are cut like all others.
!>
!> Tolerances
!>   * e0, the edge-node distance of the input, is the smallest length that the cutter resolves: nodes closer
!>     than e0 are one node, a line end closer than e0 to a line ends on it, a line that passes a node closer than e0
!>     goes through it, lines side by side closer than e0 are one line. No point moves by e0 or more in one step, and
!>     points on long lines move last.
!>   * If e0 is 0 or below 1e-10 of the model's extent, that is taken in its place: coordinates computed from
!>     double precision numbers do not carry more.
!>   * A node that joins just two edges of one joint material is dropped when that moves the edge by less than
!>     e0/1000 (the accuracy of lines in input of 6 to 9 digits). A corner that other blocks touch is dropped from
!>     the straight side only when it is straight up to rounding (rockdda_cutting_outlines), so that areas add up.
!>   * Before it returns, the result is checked: Euler's relation, and the sum of all areas against the area within
!>     the outer contours, to 1e-9 and rounding. A contradiction is an error, not a result.
module rockdda_cutting_cut
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_strings, only : counted, to_string
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_geometry_input, only : geometry_input_type
   use rockdda_cutting_assignment, only : mark_holes, assign_materials, assign_points, assign_bolts
   use rockdda_cutting_faces, only : face_set_type, prune_dead_ends, trace_faces, straighten
   use rockdda_cutting_graph, only : graph_type, pieces_type
   use rockdda_cutting_line_report, only : moves_type, report_lines, find_moves, report_moves
   use rockdda_cutting_location, only : block_locator_type
   use rockdda_cutting_net, only : make_net
   use rockdda_cutting_nesting, only : nesting_type, find_nesting
   use rockdda_cutting_outlines, only : outline_set_type, make_outlines
   use rockdda_cutting_overlaps, only : visible_lines_type
   implicit none
   private
   public :: cut_blocks, cut_report_type

   !> Numbers of the cut.
   type :: cut_report_type
      integer :: n_lines = 0            !! input lines
      integer :: n_dropped_lines = 0    !! that bound no block
      integer :: n_shortened_lines = 0  !! that lost a free end
      integer :: n_nodes = 0            !! nodes of the net without dead ends
      integer :: n_edges = 0            !! edges of it
      integer :: n_faces = 0            !! closed faces = blocks + holes
      integer :: n_groups = 0           !! connected groups of lines
      integer :: n_blocks = 0
      integer :: n_islands = 0          !! groups inside a face
      integer :: n_touching = 0         !! corners that the outline of a block visits again
      integer :: n_holes = 0            !! faces deleted by hole points
      integer :: n_rounds = 0           !! rounds of cleaning with changes
      real(wp) :: merging_distance = 0  !! e0, or the smallest length for the coordinates [L]
      real(wp) :: area_sum = 0          !! of the blocks [L^2]
      real(wp) :: hole_area = 0         !! of the deleted faces [L^2]
      real(wp) :: enclosed_area = 0     !! within the outer contours, computed on its own [L^2]
   end type cut_report_type

contains

   !> Cut. Warnings are added to `messages`; all problems that prevent a result are returned in one `error`.
   subroutine cut_blocks(geometry, blocks, report, messages, error)
      type(geometry_input_type), intent(in) :: geometry        !! all arrays allocated
      type(block_system_type), intent(out) :: blocks
      type(cut_report_type), intent(out) :: report
      type(diagnostics_type), intent(inout) :: messages
      type(error_type), allocatable, intent(out) :: error
      type(visible_lines_type) :: visible
      type(pieces_type) :: pieces
      type(graph_type) :: graph
      type(face_set_type) :: faces
      type(nesting_type) :: nesting
      type(outline_set_type) :: outlines
      type(moves_type) :: moves
      type(diagnostics_type) :: found
      logical, allocatable :: skip(:)
      real(wp) :: e0
      integer :: n
      n = size(geometry%lines, 2)
      report%n_lines = n
      call check_input(error)
      if (allocated(error)) return
      e0 = merging_distance(geometry)
      report%merging_distance = e0

      skip = hypot(geometry%lines(3, :) - geometry%lines(1, :), geometry%lines(4, :) - geometry%lines(2, :)) < e0
      if (all(skip)) then  ! also when there are none
         call refuse()
         return
      end if
      call make_net(geometry%lines, skip, e0, visible, pieces, graph, report%n_rounds, error)
      if (allocated(error)) return
      call prune_dead_ends(graph)
      call trace_faces(graph, faces)
      call report_lines(geometry, skip, e0, visible, graph, faces, report%n_dropped_lines, report%n_shortened_lines, &
                        messages, found, error)
      if (allocated(error)) return
      if (faces%n_groups == 0 .and. .not. found%has_errors()) then
         call refuse()
         return
      end if
      call found%to_error(error)
      if (allocated(error)) return
      call find_moves(geometry%lines, pieces, graph, moves)
      call straighten(graph, geometry%line_joint, 1.0e-3_wp*e0)
      call trace_faces(graph, faces)
      call find_nesting(graph, faces, nesting)
      call make_outlines(graph, faces, nesting, geometry%line_joint, e0, outlines)
      call check_result(error)
      if (allocated(error)) return

      call make_blocks()
      call found%to_error(error)
      if (allocated(error)) return
      call report_moves(geometry, moves, e0, sqrt(report%area_sum/report%n_blocks), messages)

   contains

      !> There is not one block.
      subroutine refuse()
         call found%add(severity%error, 'no closed block: of '//counted(n, 'line')//' none closes a block', &
                        last_origin(geometry))
         call found%to_error(error)
      end subroutine refuse

      !> Blocks from polygons; holes, materials, points, bolts.
      subroutine make_blocks()
         type(block_locator_type) :: locator
         type(diagnostics_type) :: told
         logical :: is_hole(outlines%n)
         integer :: number(outlines%n), i
         is_hole = .false.
         call select_blocks(is_hole, geometry%edge_node_distance)
         call locator%init(blocks, e0)
         if (size(geometry%hole_points, 2) > 0) then
            call mark_holes(geometry, blocks, locator, is_hole, messages)
            call select_blocks(is_hole, geometry%edge_node_distance)
            call locator%init(blocks, e0)
         end if
         report%n_holes = count(is_hole)
         report%n_blocks = blocks%n_blocks
         report%hole_area = sum(outlines%area, mask=is_hole)
         report%area_sum = sum(outlines%area, mask=.not. is_hole)
         report%n_touching = sum(outlines%n_touching, mask=.not. is_hole)
         if (blocks%n_blocks == 0) then
            call found%add(severity%error, 'no block left: hole points delete '// &
                           trim(merge('the one block', 'all blocks   ', outlines%n == 1)), &
                           geometry%hole_origin(size(geometry%hole_origin)))
            return
         end if
         number = 0
         number(pack([(i, i=1, outlines%n)],.not. is_hole)) = [(i, i=1, blocks%n_blocks)]
         call report_islands(number)
         call assign_materials(geometry, blocks, locator, told)
         call assign_points(geometry, blocks, locator, told)
         call assign_bolts(geometry%bolts, blocks, locator, told)
         do i = 1, told%n
            if (told%items(i)%severity == severity%error) then
               call found%add(severity%error, told%items(i)%message, told%items(i)%origin)
            else
               call messages%add(told%items(i)%severity, told%items(i)%message, told%items(i)%origin)
            end if
         end do
      end subroutine make_blocks

      !> Warn of islands and of outlines that touch themselves.
      subroutine report_islands(number)
         integer, intent(in) :: number(:)                         !! final number of each polygon, 0: hole
         type(origin_type) :: file
         integer :: of_face(faces%n_cycles), g, i, line
         real(wp) :: place(2)
         of_face = 0
         of_face(outlines%face) = number
         do g = 1, faces%n_groups
            if (nesting%face(g) == 0) cycle
            if (of_face(nesting%face(g)) == 0) cycle
            line = graph%line((faces%first(faces%contour(g)) + 1)/2)
            call messages%add(severity%warning, 'line '//to_string(line)//' belongs to '// &
                              trim(merge('an opening: a closed loop', 'an island: a closed loop ', &
                              all(of_face == 0 .or. faces%group /= g)))//' inside block '// &
                              to_string(of_face(nesting%face(g)))//' that touches nothing around it; the block is '// &
                              'joined to it by a bridge without contacts', geometry%line_origin(line))
         end do
         if (allocated(geometry%line_origin(1)%file)) file%file = geometry%line_origin(1)%file
         do i = 1, outlines%n
            if (number(i) == 0 .or. outlines%n_touching(i) == 0) cycle
            place = graph%position(:, outlines%touching(i))
            call messages%add(severity%warning, 'the outline of block '//to_string(number(i))// &
                              ' touches itself at a corner near ('//to_string(place(1))//', '//to_string(place(2))// &
                              ')', file)
         end do
      end subroutine report_islands

      !> Euler's relation and the sum of areas; fills the numbers of the report that belong to the net.
      subroutine check_result(error)
         type(error_type), allocatable, intent(out) :: error
         real(wp) :: length, rounding, d(2)
         integer :: g, e
         report%n_nodes = faces%n_used_nodes
         report%n_edges = faces%n_used_edges
         report%n_groups = faces%n_groups
         report%n_faces = outlines%n
         report%n_islands = count(nesting%face > 0)
         ! V - E + F = 1 + C, where F counts the open plane too
         if (any(faces%contour == 0) .or. &
             report%n_nodes - report%n_edges + report%n_faces + 1 /= 1 + report%n_groups) then
            call make_error(error, error_code%internal, 'cutting contradicts Euler''s relation: '// &
                            to_string(report%n_nodes)//' nodes, '//to_string(report%n_edges)//' edges, '// &
                            to_string(report%n_faces)//' faces, '//to_string(report%n_groups)//' groups')
            return
         end if
         do g = 1, faces%n_groups
            if (nesting%face(g) == 0) report%enclosed_area = report%enclosed_area - faces%area(faces%contour(g))
         end do
         length = 0
         do e = 1, graph%n_edges
            if (.not. graph%alive(e)) cycle
            d = graph%position(:, graph%ends(2, e)) - graph%position(:, graph%ends(1, e))
            length = length + hypot(d(1), d(2))
         end do
         ! coordinates are rounded to epsilon of their size, which moves edges sideways
         rounding = 16*epsilon(1.0_wp)*maxval(abs(graph%position))*length
         if (any(.not. outlines%area > 0) .or. .not. abs(sum(outlines%area) - report%enclosed_area) <= &
             1.0e-9_wp*report%enclosed_area + rounding) then
            call make_error(error, error_code%internal, 'cutting lost area: blocks have '// &
                            to_string(sum(outlines%area), 17)//', the outer contours enclose '// &
                            to_string(report%enclosed_area, 17))
         end if
      end subroutine check_result

      !> Blocks from the polygons that are not holes.
      subroutine select_blocks(is_hole, e0)
         logical, intent(in) :: is_hole(:)
         real(wp), intent(in) :: e0
         integer :: i, n, first, last, to
         n = 0
         do i = 1, outlines%n
            if (.not. is_hole(i)) n = n + outlines%offset(i + 1) - outlines%offset(i)
         end do
         if (allocated(blocks%vertices)) &
            deallocate (blocks%vertex_offset, blocks%vertices, blocks%edge_joint, blocks%block_material)
         blocks%n_blocks = count(.not. is_hole)
         blocks%edge_node_distance = e0
         allocate (blocks%vertex_offset(blocks%n_blocks + 1), blocks%vertices(2, n), blocks%edge_joint(n))
         allocate (blocks%block_material(blocks%n_blocks), source=1)
         blocks%vertex_offset(1) = 0
         n = 0
         do i = 1, outlines%n
            if (is_hole(i)) cycle
            n = n + 1
            first = outlines%offset(i) + 1
            last = outlines%offset(i + 1)
            to = blocks%vertex_offset(n) + last - first + 1
            blocks%vertex_offset(n + 1) = to
            blocks%vertices(:, blocks%vertex_offset(n) + 1:to) = graph%position(:, outlines%node(first:last))
            blocks%edge_joint(blocks%vertex_offset(n) + 1:to) = outlines%joint(first:last)
         end do
      end subroutine select_blocks

      !> Check the numbers of the input.
      subroutine check_input(error)
         type(error_type), allocatable, intent(out) :: error
         type(diagnostics_type) :: found
         integer :: i
         logical :: usable
         usable = ieee_is_finite(geometry%edge_node_distance)
         if (usable) usable = geometry%edge_node_distance >= 0
         if (.not. usable) &
            call found%add(severity%error, 'edge-node distance must be 0 or more, found '// &
                           to_string(geometry%edge_node_distance))
         do i = 1, size(geometry%lines, 2)
            if (.not. all(ieee_is_finite(geometry%lines(:, i)))) then
               call found%add(severity%error, 'line '//to_string(i)//' has an end that is not finite', &
                              geometry%line_origin(i))
            else if (any(abs(geometry%lines(:, i)) > 1.0e100_wp)) then
               call found%add(severity%error, 'line '//to_string(i)//' has an end beyond 1e100', &
                              geometry%line_origin(i))
            end if
            if (geometry%line_joint(i) < 1) &
               call found%add(severity%error, 'line '//to_string(i)//': joint material must be 1 or more, found '// &
                              to_string(geometry%line_joint(i)), geometry%line_origin(i))
         end do
         call found%to_error(error)
      end subroutine check_input

   end subroutine cut_blocks

   !> e0, or the smallest length that coordinates of this size resolve.
   pure real(wp) function merging_distance(geometry)
      type(geometry_input_type), intent(in) :: geometry
      real(wp) :: extent
      merging_distance = geometry%edge_node_distance
      if (size(geometry%lines, 2) == 0) return
      extent = max(maxval(geometry%lines([1, 3], :)) - minval(geometry%lines([1, 3], :)), &
                   maxval(geometry%lines([2, 4], :)) - minval(geometry%lines([2, 4], :)))
      merging_distance = max(merging_distance, 1.0e-10_wp*extent, 64*epsilon(1.0_wp)*maxval(abs(geometry%lines)))
      if (.not. merging_distance > 0) merging_distance = tiny(1.0_wp)
   end function merging_distance

   !> The last place of the input, for problems that belong to no line of it.
   function last_origin(geometry) result(origin)
      type(geometry_input_type), intent(in) :: geometry
      type(origin_type) :: origin
      call look_at(geometry%line_origin)
      call look_at(geometry%material_line_origin)
      call look_at(geometry%bolts%origin)
      call look_at(geometry%fixed_origin)
      call look_at(geometry%loading_origin)
      call look_at(geometry%measured_origin)
      call look_at(geometry%hole_origin)

   contains

      !> Keep the last one in the file.
      subroutine look_at(origins)
         type(origin_type), intent(in) :: origins(:)
         integer :: i
         do i = 1, size(origins)
            if (allocated(origins(i)%file) .and. origins(i)%line >= origin%line) origin = origins(i)
         end do
      end subroutine look_at

   end function last_origin

end module rockdda_cutting_cut
