! SPDX-License-Identifier: MIT
!> DL: from the statistics of joint sets to the lines of a geometry.
!>
!> Each set draws from a random stream of its own, so that one set does not change when another one does. Coordinates
!> are rounded to about 12 digits of the region's extent, so that the last digits of sines and logarithms, which differ
!> between machines, do not reach the file.
module rockdda_lines_generate
   use rockdda_base_kinds, only : wp
   use rockdda_base_room, only : grow
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_base_random, only : random_stream_type, new_stream
   use rockdda_base_strings, only : to_string
   use rockdda_geometry_polygons, only : point_in_polygon, distance_to_outline, polygon_area
   use rockdda_geometry_segments, only : segments_cross
   use rockdda_lines_joint_sets, only : direction_of, line_positions, line_traces, is_endless
   use rockdda_lines_report, only : lines_report_type, set_report_type, sample_type, fill_report
   use rockdda_lines_outlines, only : opening_outline, inner_point, crosses_itself, counter_clockwise, rock_type, &
      clip_segment
   use rockdda_lines_statistics, only : statistics_type, joint_set_type
   use rockdda_model_geometry_input, only : geometry_input_type
   implicit none
   private
   public :: generate_lines

   !> Largest number of traces of all sets together, in the region and in the extent in which they are drawn (larger for
   !> regions oblique to their sets).
   real(wp), parameter :: most_traces = 1.0e6_wp, most_drawn = 5.0e6_wp

   !> Growing list of lines.
   type :: line_list_type
      integer :: n = 0
      real(wp), allocatable :: ends(:, :)      !! (4, at least n)
      integer, allocatable :: material(:)
   contains
      procedure :: add => add_line
   end type line_list_type

contains

   !> Draw the lines. Problems of the statistics as a whole (openings that overlap, sets that cannot end at others, too
   !> many traces) are added to `messages`; the geometry is invalid then.
   subroutine generate_lines(statistics, geometry, report, messages)
      type(statistics_type), intent(in) :: statistics
      type(geometry_input_type), intent(out) :: geometry
      type(lines_report_type), intent(out) :: report
      type(diagnostics_type), intent(inout) :: messages
      type(rock_type) :: rock
      type(line_list_type) :: lines
      real(wp), allocatable :: holes(:, :), fixed(:, :)
      real(wp) :: extent, e0
      integer :: n_boundary, before, i

      before = messages%n_errors
      rock%region%vertices = statistics%region%vertices
      call counter_clockwise(rock%region%vertices)
      extent = maxval(maxval(rock%region%vertices, dim=2) - minval(rock%region%vertices, dim=2))
      e0 = statistics%edge_node_distance
      if (.not. e0 > 0) then
         e0 = 1.0e-3_wp*extent/20
         do i = 1, size(statistics%sets)
            e0 = min(e0, 1.0e-3_wp*statistics%sets(i)%spacing)
         end do
      end if
      rock%tolerance = e0
      call add_openings(holes)
      if (messages%n_errors > before) return
      call check_amount()
      if (messages%n_errors > before) return

      report%rock_area = polygon_area(rock%region%vertices)
      do i = 1, size(rock%openings)
         report%rock_area = report%rock_area - polygon_area(rock%openings(i)%vertices)
      end do
      allocate (lines%ends(4, 256), lines%material(256))
      call add_boundary(statistics, rock, lines, fixed)
      n_boundary = lines%n
      call add_extra_lines()
      call add_sets()
      if (messages%n_errors > before) return

      call geometry%allocate_all(lines%n, size(statistics%material_lines), 0, size(fixed, 2), &
                                 size(statistics%loading, 2), size(statistics%measured, 2), size(holes, 2))
      geometry%edge_node_distance = e0
      geometry%n_boundary = n_boundary
      geometry%lines = rounded(lines%ends(:, 1:lines%n), extent)
      geometry%line_joint = lines%material(1:lines%n)
      do i = 1, size(statistics%material_lines)
         geometry%material_lines(:, i) = statistics%material_lines(i)%ends
         geometry%line_material(i) = statistics%material_lines(i)%material
      end do
      geometry%fixed_lines = fixed
      geometry%loading_points = statistics%loading
      geometry%measured_points = statistics%measured
      geometry%hole_points = rounded(holes, extent)

   contains

      !> All joint sets.
      subroutine add_sets()
         type(random_stream_type) :: stream
         type(joint_set_type) :: set
         integer :: i
         allocate (report%sets(size(statistics%sets)))
         do i = 1, size(statistics%sets)
            set = statistics%sets(i)
            if (set%avoid_cantilevers) call keep_roof_whole(rock, set)
            call new_stream(statistics%seed, i, stream)
            if (set%ends_at > 0) then
               call add_banded_set(set, stream, report%sets(i), report%n_short)
            else
               call add_set(set, stream, report%sets(i), report%n_short)
            end if
            if (report%sets(i)%n_traces == 0) call messages%add(severity%warning, '&joint_set '//to_string(i)// &
               ' has no trace in the rock', set%origin)
         end do
      end subroutine add_sets

      !> Individual lines, clipped to the rock.
      subroutine add_extra_lines()
         real(wp), allocatable :: pieces(:, :)
         integer :: i, k, n
         logical :: whole
         do i = 1, size(statistics%lines)
            call clip_segment(rock, statistics%lines(i)%ends, pieces, n, report%n_short, whole)
            if (n == 0) call messages%add(severity%warning, '&line '//to_string(i)//' lies outside the rock and is '// &
                                          'left out', statistics%lines(i)%origin)
            do k = 1, n
               call lines%add(pieces(:, k), statistics%lines(i)%material)
            end do
         end do
      end subroutine add_extra_lines

      !> Joints that run between neighbouring lines of an endless set and end there. Each band has a lattice of its own,
      !> shifted by `stagger` spacings from the one below.
      subroutine add_banded_set(set, stream, report, n_short)
         type(joint_set_type), intent(in) :: set
         type(random_stream_type), intent(inout) :: stream
         type(set_report_type), intent(inout) :: report
         integer, intent(inout) :: n_short
         type(joint_set_type) :: other
         type(random_stream_type) :: other_stream
         type(sample_type) :: spacing, trace, bridge
         real(wp), allocatable :: bands(:), positions(:)
         real(wp) :: t(2), normal(2), band_t(2), band_normal(2), across(2), range(2), s(2), foot(2), slope
         integer :: band, k, first_band, first
         logical :: whole
         ! the bands lie between the lines of the other set
         other = statistics%sets(set%ends_at)
         if (other%avoid_cantilevers) call keep_roof_whole(rock, other)
         call new_stream(statistics%seed, set%ends_at, other_stream)
         band_t = direction_of(other%inclination)
         band_normal = [-band_t(2), band_t(1)]
         range = range_along(rock%region%vertices, band_normal)
         call line_positions(other, 0.0_wp, range(1), range(2), other_stream, bands, first_band)
         t = direction_of(set%inclination)
         normal = [-t(2), t(1)]
         slope = dot_product(band_normal, t)
         across = range_along(rock%region%vertices, normal)
         do band = 1, size(bands) - 1
            call line_positions(set, modulo(set%stagger*(first_band + band - 1), 1.0_wp)*set%spacing, across(1), &
                                across(2), stream, positions, first)
            if (bands(band + 1) < range(1) .or. bands(band) > range(2)) cycle
            do k = 1, size(positions)
               if (positions(k) < across(1) .or. positions(k) > across(2)) cycle
               report%n_lines = report%n_lines + 1
               if (k < size(positions)) call spacing%take(positions(k + 1) - positions(k))
               foot = positions(k)*normal
               s = (bands(band:band + 1) - positions(k)*dot_product(band_normal, normal))/slope
               call add_trace(rock, [foot + minval(s)*t, foot + maxval(s)*t], set%material, lines, report, n_short, &
                              whole)
               if (whole) report%n_whole = report%n_whole + 1
               call trace%take(maxval(s) - minval(s))
            end do
         end do
         call fill_report(report, spacing, trace, bridge)
      end subroutine add_banded_set

      !> Lines and traces of a set that does not end at another one.
      subroutine add_set(set, stream, report, n_short)
         type(joint_set_type), intent(in) :: set
         type(random_stream_type), intent(inout) :: stream
         type(set_report_type), intent(inout) :: report
         integer, intent(inout) :: n_short
         type(sample_type) :: spacing, trace, bridge
         real(wp), allocatable :: positions(:), traces(:, :)
         real(wp) :: t(2), normal(2), across(2), along(2), foot(2), margin
         integer :: k, j, first
         logical :: whole
         t = direction_of(set%inclination)
         normal = [-t(2), t(1)]
         across = range_along(rock%region%vertices, normal)
         along = range_along(rock%region%vertices, t)
         margin = 0.01_wp*(along(2) - along(1))
         call line_positions(set, 0.0_wp, across(1), across(2), stream, positions, first)
         do k = 1, size(positions)
            call line_traces(set, first + k - 1, along(1) - margin, along(2) + margin, stream, traces)
            if (positions(k) < across(1) .or. positions(k) > across(2)) cycle
            report%n_lines = report%n_lines + 1
            if (k < size(positions)) call spacing%take(positions(k + 1) - positions(k))
            foot = positions(k)*normal
            do j = 1, size(traces, 2)
               call add_trace(rock, [foot + traces(1, j)*t, foot + traces(2, j)*t], set%material, lines, report, &
                              n_short, whole)
               if (whole) report%n_whole = report%n_whole + 1
               ! unbiased sample: traces that begin in the extent of the region; whole traces alone are shorter on
               ! average
               if (is_endless(set) .or. traces(1, j) < along(1) .or. traces(1, j) > along(2)) cycle
               call trace%take(traces(2, j) - traces(1, j))
               if (j < size(traces, 2)) call bridge%take(traces(1, j + 1) - traces(2, j))
            end do
         end do
         call fill_report(report, spacing, trace, bridge)
      end subroutine add_set

      !> Outlines of the openings, each with a point inside; they must lie in the region and apart from each other.
      subroutine add_openings(holes)
         real(wp), allocatable, intent(out) :: holes(:, :)   !! (2, openings that are empty)
         integer :: i, k, n
         character(len=:), allocatable :: name
         n = size(statistics%openings)
         allocate (rock%openings(n), holes(2, 0))
         do i = 1, n
            associate (origin => statistics%openings(i)%origin)
               name = '&opening '//to_string(i)
               rock%openings(i)%vertices = opening_outline(statistics%openings(i))
               associate (vertices => rock%openings(i)%vertices)
                  if (crosses_itself(vertices)) then
                     call messages%add(severity%error, name//': its outline crosses itself', origin)
                     return
                  end if
                  if (.not. is_inside(vertices, rock%region%vertices, rock%tolerance)) then
                     call messages%add(severity%error, name//' must lie inside the boundary; it reaches from ('// &
                                       to_string(minval(vertices(1, :)))//', '//to_string(minval(vertices(2, :)))// &
                                       ') to ('//to_string(maxval(vertices(1, :)))//', '// &
                                       to_string(maxval(vertices(2, :)))//')', origin)
                     return
                  end if
                  do k = 1, i - 1
                     if (are_apart(vertices, rock%openings(k)%vertices)) cycle
                     call messages%add(severity%error, name//' overlaps &opening '//to_string(k), origin)
                     return
                  end do
                  if (.not. allocated(statistics%openings(i)%outline)) &
                     holes = reshape([holes, inner_point(vertices)], [2, size(holes, 2) + 1])
               end associate
            end associate
         end do
      end subroutine add_openings

      !> Refuse statistics that would make more traces than a computer holds.
      subroutine check_amount()
         real(wp) :: t(2), across(2), along(2), area, n_lines, cell, drawn, all_drawn, all_traces
         integer :: i
         character(len=:), allocatable :: others
         area = polygon_area(rock%region%vertices)
         all_drawn = 0
         all_traces = 0
         others = ''
         do i = 1, size(statistics%sets)
            associate (set => statistics%sets(i))
               t = direction_of(set%inclination)
               across = range_along(rock%region%vertices, [-t(2), t(1)])
               along = range_along(rock%region%vertices, t)
               n_lines = (across(2) - across(1))/set%spacing + 1
               if (set%ends_at > 0) then
                  cell = statistics%sets(set%ends_at)%spacing
               else
                  cell = set%trace + merge(0.0_wp, set%bridge, is_endless(set))
               end if
               drawn = n_lines*((along(2) - along(1))/cell + 1)
               all_drawn = all_drawn + drawn
               all_traces = all_traces + min(drawn, n_lines + area/set%spacing/cell)
               if (all_traces > most_traces) then
                  call messages%add(severity%error, '&joint_set '//to_string(i)//others//' would make about '// &
                                    to_string(all_traces, 3)//' traces; at most '//to_string(most_traces, 3)// &
                                    ' can be made', set%origin)
                  return
               else if (all_drawn > most_drawn) then
                  call messages%add(severity%error, '&joint_set '//to_string(i)//others//' would draw about '// &
                                    to_string(all_drawn, 3)//' traces around the region; at most '// &
                                    to_string(most_drawn, 3)//' can be drawn', set%origin)
                  return
               end if
               others = ' and those before it'
            end associate
         end do
      end subroutine check_amount

   end subroutine generate_lines

   !> Does a polygon lie inside another one, nowhere nearer to its outline than a tolerance?
   pure logical function is_inside(inner, outer, tolerance)
      real(wp), intent(in) :: inner(:, :), outer(:, :), tolerance
      integer :: i
      is_inside = .not. edges_cross(inner, outer)
      do i = 1, size(inner, 2)
         if (.not. point_in_polygon(inner(:, i), outer)) is_inside = .false.
         if (distance_to_outline(inner(:, i), outer) <= tolerance) is_inside = .false.
      end do
   end function is_inside

   !> Have two polygons no point in common?
   pure logical function are_apart(a, b)
      real(wp), intent(in) :: a(:, :), b(:, :)
      are_apart = .not. (edges_cross(a, b) .or. point_in_polygon(a(:, 1), b) .or. point_in_polygon(b(:, 1), a))
   end function are_apart

   !> Do edges of two polygons meet?
   pure logical function edges_cross(a, b)
      real(wp), intent(in) :: a(:, :), b(:, :)
      integer :: i, k
      edges_cross = .false.
      do i = 1, size(a, 2)
         do k = 1, size(b, 2)
            if (segments_cross(a(:, i), a(:, 1 + mod(i, size(a, 2))), b(:, k), b(:, 1 + mod(k, size(b, 2))))) &
               edges_cross = .true.
         end do
      end do
   end function edges_cross

   !> Least and largest component of points along a direction.
   pure function range_along(points, direction) result(range)
      real(wp), intent(in) :: points(:, :), direction(2)
      real(wp) :: range(2)
      range = [minval(direction(1)*points(1, :) + direction(2)*points(2, :)), &
               maxval(direction(1)*points(1, :) + direction(2)*points(2, :))]
   end function range_along

   !> Outline of the region, its frame of fixed blocks, outlines of the openings; the fixed points.
   subroutine add_boundary(statistics, rock, lines, fixed)
      type(statistics_type), intent(in) :: statistics
      type(rock_type), intent(in) :: rock
      type(line_list_type), intent(inout) :: lines
      real(wp), allocatable, intent(out) :: fixed(:, :)   !! (4, n)
      real(wp) :: low(2), high(2), d, box(2, 4), outer(2, 4), side(2), at(2)
      integer :: i, j, n
      call add_outline(rock%region%vertices, statistics%region%material)
      n = size(statistics%fixed, 2)
      d = statistics%region%frame
      if (d > 0) then
         allocate (fixed(4, n + 12))
         low = minval(rock%region%vertices, dim=2)
         high = maxval(rock%region%vertices, dim=2)
         box = reshape([low(1), low(2), high(1), low(2), high(1), high(2), low(1), high(2)], [2, 4])
         outer = box + d*reshape(real([-1, -1, 1, -1, 1, 1, -1, 1], wp), [2, 4])
         call add_outline(outer, statistics%region%material)
         do i = 1, 4
            call lines%add([outer(:, i), box(:, i)], statistics%region%material)
            ! three points of the block along this side, at half its thickness
            j = 1 + mod(i, 4)
            side = 0.5_wp*(box(:, j) + outer(:, j) - box(:, i) - outer(:, i))
            do n = 1, 3
               at = 0.5_wp*(box(:, i) + outer(:, i)) + 0.25_wp*n*side
               fixed(:, 3*(i - 1) + n) = [at, at]
            end do
         end do
         fixed(:, 13:) = statistics%fixed
      else
         fixed = statistics%fixed
      end if
      do i = 1, size(rock%openings)
         call add_outline(rock%openings(i)%vertices, statistics%openings(i)%material)
      end do

   contains

      !> The edges of a polygon.
      subroutine add_outline(vertices, material)
         real(wp), intent(in) :: vertices(:, :)
         integer, intent(in) :: material
         integer :: k, n_corners
         n_corners = size(vertices, 2)
         do k = 1, n_corners
            call lines%add([vertices(:, k), vertices(:, 1 + mod(k, n_corners))], material)
         end do
      end subroutine add_outline

   end subroutine add_boundary

   !> Shift a set so that few beams of rock reach from the roof of the first opening into its sides uncut
   !> (thesis, Fig. 7.2a): lines lie symmetrically about the opening and as near to its walls as their spacing
   !> allows; traces begin at the height of its middle, which puts the bridges above the roof as high as possible.
   subroutine keep_roof_whole(rock, set)
      type(rock_type), intent(in) :: rock
      type(joint_set_type), intent(inout) :: set
      real(wp) :: t(2), across(2), along(2), half, on_axis, beside
      if (size(rock%openings) == 0) return
      t = direction_of(set%inclination)
      across = range_along(rock%openings(1)%vertices, [-t(2), t(1)])
      along = range_along(rock%openings(1)%vertices, t)
      set%start = 0.5_wp*sum(along)
      ! traces of a set with downward direction approach the roof at their ends
      if (t(2) < 0) set%start = set%start - set%trace
      half = 0.5_wp*(across(2) - across(1))
      on_axis = abs(half - set%spacing*anint(half/set%spacing))
      beside = abs(half - set%spacing*(anint(half/set%spacing - 0.5_wp) + 0.5_wp))
      set%offset = 0.5_wp*sum(across)
      if (beside < on_axis*(1 - 1.0e-9_wp)) set%offset = set%offset + 0.5_wp*set%spacing
   end subroutine keep_roof_whole

   !> Append one trace, clipped to the rock.
   subroutine add_trace(rock, ends, material, lines, report, n_short, whole)
      type(rock_type), intent(in) :: rock
      real(wp), intent(in) :: ends(4)
      integer, intent(in) :: material
      type(line_list_type), intent(inout) :: lines
      type(set_report_type), intent(inout) :: report
      integer, intent(inout) :: n_short
      logical, intent(out) :: whole
      real(wp), allocatable :: pieces(:, :)
      integer :: i, n
      call clip_segment(rock, ends, pieces, n, n_short, whole)
      do i = 1, n
         call lines%add(pieces(:, i), material)
         report%length = report%length + hypot(pieces(3, i) - pieces(1, i), pieces(4, i) - pieces(2, i))
      end do
      report%n_traces = report%n_traces + n
   end subroutine add_trace

   !> Round to a power of ten that is about 1e-12 of the extent; no negative zeros.
   pure function rounded(values, extent) result(round)
      real(wp), intent(in) :: values(:, :), extent
      real(wp) :: round(size(values, 1), size(values, 2))
      integer :: digits
      digits = 12 - ceiling(log10(extent))
      if (digits > 0) then
         round = anint(values*10.0_wp**digits)/10.0_wp**digits + 0.0_wp
      else
         round = anint(values/10.0_wp**(-digits))*10.0_wp**(-digits) + 0.0_wp
      end if
   end function rounded

   !> Append a line.
   pure subroutine add_line(self, ends, material)
      class(line_list_type), intent(inout) :: self
      real(wp), intent(in) :: ends(4)
      integer, intent(in) :: material
      self%n = self%n + 1
      call grow(self%ends, self%n, 4)
      call grow(self%material, self%n)
      self%ends(:, self%n) = ends
      self%material(self%n) = material
   end subroutine add_line

end module rockdda_lines_generate
