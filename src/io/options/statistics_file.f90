! SPDX-License-Identifier: MIT
!> Reader of joint statistics (.dl): a namelist file with the groups and names of docs/cutting.md. What depends on
!> several values is checked here; a &region of an options file can draw an opening.
module rockdda_io_statistics_file
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : to_string, lower_case, is_given
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_geometry_polygons, only : polygon_area
   use rockdda_lines_outlines, only : slope_outline, crosses_itself
   use rockdda_lines_statistics, only : statistics_type, joint_set_type, opening_type, region_type, points_type, law, &
                                        shape_kind
   use rockdda_lines_statistics_options, only : all_statistics, describe_statistics
   use rockdda_lines_joint_sets, only : direction_of
   use rockdda_model_options, only : is_set
   use rockdda_model_option_rows, only : option_rows_type
   use rockdda_io_csv_table, only : read_csv_table
   use rockdda_io_namelist_parser, only : namelist_type, group_type, parse_namelist, find_entry
   use rockdda_io_option_reader, only : want_groups, read_table
   use rockdda_io_option_values, only : get_text, get_reals, index_of
   use rockdda_io_record_reader, only : append_in_order, comes_before
   use rockdda_io_source, only : source_type, read_source
   implicit none
   private
   public :: read_statistics_source

   !> As law%... and shape_kind%... count them.
   character(len=*), parameter :: law_names(4) = [character(len=11) :: 'uniform', 'normal', 'lognormal', 'exponential']
   character(len=*), parameter :: shape_names(4) = [character(len=9) :: 'horseshoe', 'circle', 'rectangle', 'polygon']

contains

   !> Read and check a file of joint statistics; every problem is added to `messages`.
   subroutine read_statistics_source(source, statistics, messages)
      type(source_type), intent(in) :: source
      type(statistics_type), intent(out) :: statistics
      type(diagnostics_type), intent(inout) :: messages
      type(namelist_type), target :: namelist
      type(option_rows_type) :: table
      integer :: i, n_read, section, boundary
      call parse_namelist(source, namelist)
      call want_groups(table, namelist)
      call describe_statistics(table, statistics)
      call read_table(namelist, table, all_statistics)
      call describe_statistics(table, statistics)
      n_read = namelist%messages%n

      call expect_once('section', section)
      call expect_once('boundary', boundary)
      if (boundary == 0) then
         call namelist%messages%add(severity%error, '&boundary is missing', source%origin(source%n_lines, 1))
      else
         statistics%region%origin = namelist%origin(namelist%groups(boundary)%place)
         if (is_sound(statistics%region%origin)) call settle_boundary(statistics%region, namelist%messages)
      end if
      do i = 1, size(statistics%sets)
         if (.not. is_sound(statistics%sets(i)%origin)) cycle
         call settle_set(statistics%sets(i), namelist%messages)
         call settle_direction(statistics%sets(i), statistics%azimuth, namelist%messages)
      end do
      do i = 1, size(statistics%openings)
         if (is_sound(statistics%openings(i)%origin)) &
            call settle_opening(statistics%openings(i), options_beside(source%file), namelist%messages)
      end do
      call settle_points('fixed', pack_sound(statistics%fixed_groups), statistics%fixed, namelist%messages)
      call settle_points('loading', pack_sound(statistics%loading_groups), statistics%loading, namelist%messages)
      call settle_points('measured', pack_sound(statistics%measured_groups), statistics%measured, namelist%messages)
      statistics%loading = statistics%loading(1:2, :)
      statistics%measured = statistics%measured(1:2, :)
      call check_bands(statistics, namelist%messages)
      call append_in_order(messages, namelist%messages)

   contains

      !> Find a group, and report it where it is given again.
      subroutine expect_once(name, first)
         character(len=*), intent(in) :: name
         integer, intent(out) :: first         !! 0: there is none
         integer :: k
         first = 0
         do k = 1, namelist%n
            if (namelist%groups(k)%name /= name) cycle
            if (first > 0) call namelist%messages%add(severity%error, '&'//name//': given more than once', &
                                          namelist%origin(namelist%groups(k)%place))
            if (first == 0) first = k
         end do
      end subroutine expect_once

      !> Were all values of the group at this place read? What depends on several of them is judged then.
      logical function is_sound(place)
         type(origin_type), intent(in) :: place
         integer :: k
         is_sound = .true.
         do k = 1, n_read
            if (namelist%messages%items(k)%severity == severity%error) &
               is_sound = is_sound .and. group_at(namelist%messages%items(k)%origin) /= group_at(place)
         end do
      end function is_sound

      !> Number of the group in which a place lies.
      integer function group_at(place)
         type(origin_type), intent(in) :: place
         integer :: k
         group_at = count([(.not. comes_before(place, namelist%origin(namelist%groups(k)%place)), k=1, namelist%n)])
      end function group_at

      !> The groups that are sound.
      function pack_sound(groups) result(sound)
         type(points_type), intent(in) :: groups(:)
         type(points_type), allocatable :: sound(:)
         integer :: k
         sound = pack(groups, [(is_sound(groups(k)%origin), k=1, size(groups))])
      end function pack_sound

   end subroutine read_statistics_source

   !> Outline of the region from a window, perhaps with a slope, or from vertices.
   subroutine settle_boundary(region, messages)
      type(region_type), intent(inout) :: region
      type(diagnostics_type), intent(inout) :: messages
      logical :: has_window, has_toe, has_angle
      has_window = is_set(region%window(1))
      has_toe = is_set(region%slope_toe(1))
      has_angle = is_set(region%slope_angle)
      if (has_window .eqv. allocated(region%vertices)) then
         call report("give either 'window' or 'vertices'")
      else if (allocated(region%vertices)) then
         if (region%frame > 0 .or. has_toe .or. has_angle) &
            call report("'frame' and 'slope_toe' go with 'window', not with 'vertices'")
         region%vertices = open_ring(region%vertices)
         call check_polygon(region%vertices, '&boundary', region%origin, messages)
      else if (has_toe .neqv. has_angle) then
         call report("'slope_toe' and 'slope_angle' go together")
      else if (has_toe) then
         region%vertices = slope_outline(region%window, region%slope_toe, region%slope_angle)
         if (size(region%vertices, 2) == 0) call report('toe and crest of the slope must lie inside the window')
         if (region%frame > 0) call report("a slope has no 'frame'")
      else
         region%vertices = corners_of(region%window)
      end if

   contains

      !> Report a fault of the group as a whole.
      subroutine report(text)
         character(len=*), intent(in) :: text
         call messages%add(severity%error, '&boundary: '//text, region%origin)
      end subroutine report

   end subroutine settle_boundary

   !> Corners (2, 4) of a box xmin, ymin, xmax, ymax, counter-clockwise.
   pure function corners_of(box) result(vertices)
      real(wp), intent(in) :: box(4)
      real(wp) :: vertices(2, 4)
      vertices = reshape([box(1), box(2), box(3), box(2), box(3), box(4), box(1), box(4)], [2, 4])
   end function corners_of

   !> Points and lines of groups as columns x1, y1, x2, y2: a point is a line without length.
   subroutine settle_points(name, groups, ends, messages)
      character(len=*), intent(in) :: name
      type(points_type), intent(in) :: groups(:)
      real(wp), allocatable, intent(out) :: ends(:, :)      !! (4, n)
      type(diagnostics_type), intent(inout) :: messages
      integer :: i, k
      allocate (ends(4, 0))
      do i = 1, size(groups)
         associate (group => groups(i))
            if (.not. (allocated(group%points) .or. allocated(group%lines) .or. is_set(group%along(1)))) &
               call messages%add(severity%error, '&'//name//": 'points' is missing", group%origin)
            if (is_set(group%along(1)) .neqv. group%count > 0) &
               call messages%add(severity%error, '&'//name//": 'along' and 'count' go together", group%origin)
            if (allocated(group%points)) call append_points(group%points)
            if (allocated(group%lines)) call append(reshape(group%lines, [size(group%lines)]))
            if (is_set(group%along(1)) .and. group%count > 1) call append_points(reshape([(group%along(1:2) + &
               (group%along(3:4) - group%along(1:2))*real(k, wp)/(group%count - 1), k=0, group%count - 1)], &
               [2, group%count]))
         end associate
      end do

   contains

      !> Append points.
      subroutine append_points(points)
         real(wp), intent(in) :: points(:, :)      !! (2, n)
         call append([(points(:, k), points(:, k), k=1, size(points, 2))])
      end subroutine append_points

      !> Append columns.
      subroutine append(more)
         real(wp), intent(in) :: more(:)
         ends = reshape([ends, more], [4, size(ends, 2) + size(more)/4])
      end subroutine append

   end subroutine settle_points

   !> Check the values of a set that depend on each other, and find its laws and its randomness.
   subroutine settle_set(set, messages)
      type(joint_set_type), intent(inout) :: set
      type(diagnostics_type), intent(inout) :: messages
      logical :: has_trace
      integer :: laws(2)
      if (allocated(set%distribution)) set%spacing_law = index_of(set%distribution, law_names)
      if (allocated(set%trace_distribution)) set%trace_law = index_of(set%trace_distribution, law_names)
      laws = [set%spacing_law, set%trace_law]
      has_trace = set%trace < huge(1.0_wp)
      if (set%bridge > 0 .and. .not. has_trace) &
         call report("'bridge' goes with 'trace' (without, traces are endless)")
      if (has_trace .and. set%bridge > set%trace) call report('bridge '//to_string(set%bridge)// &
         ' is longer than trace '//to_string(set%trace))
      if (.not. is_set(set%randomness)) then
         if (any(laws == law%normal .or. laws == law%lognormal)) &
            call report("'randomness' is missing: the coefficient of variation of the distribution")
         set%randomness = merge(0.5_wp, 0.0_wp, any(laws == law%exponential))
      end if
      if (set%ends_at > 0) then
         if (has_trace) call report("joints that end at another set ('ends_at') have no 'trace' of their own")
         if (set%avoid_cantilevers) call report("'avoid_cantilevers' does not go with 'ends_at'")
      end if
      if (set%avoid_cantilevers .and. abs(set%stagger) > 0) &
         call report("'avoid_cantilevers' does not go with 'stagger'")

   contains

      !> Report a fault of the group as a whole.
      subroutine report(text)
         character(len=*), intent(in) :: text
         call messages%add(severity%error, '&joint_set: '//text, set%origin)
      end subroutine report

   end subroutine settle_set

   !> Inclination and spacing in the section. From dip and dip direction: the section is the upright plane whose x axis
   !> points to `azimuth`; a plane with normal n leaves traces across the part of n that lies in the section, and
   !> its spacing grows by one over that part's length.
   subroutine settle_direction(set, azimuth, messages)
      type(joint_set_type), intent(inout) :: set
      real(wp), intent(in) :: azimuth
      type(diagnostics_type), intent(inout) :: messages
      real(wp), parameter :: pi = acos(-1.0_wp)
      real(wp), parameter :: nearly_parallel = sin(10*pi/180)
      real(wp) :: n(2), d(2), a(2), length
      if (is_set(set%inclination) .eqv. (is_set(set%dip) .or. is_set(set%dip_direction))) then
         call report(severity%error, "give either 'inclination' or 'dip' and 'dip_direction'")
      else if (is_set(set%inclination)) then
         return
      else if (.not. (is_set(set%dip) .and. is_set(set%dip_direction))) then
         call report(severity%error, "'dip' and 'dip_direction' go together")
      else if (.not. is_set(azimuth)) then
         call report(severity%error, 'dip and dip_direction need &section with its azimuth')
      else
         d = direction_of(set%dip)
         a = direction_of(set%dip_direction - azimuth)
         ! upward normal: sin(dip) towards the dip direction, cos(dip) up
         n = [d(2)*a(1), d(1)]
         length = norm2(n)
         if (length < 0.02_wp) then
            call report(severity%error, 'the set is parallel to the section and leaves no traces in it')
            return
         end if
         if (length < nearly_parallel) call report(severity%warning, 'the set is nearly parallel to the section ('// &
            to_string(asin(length)*180/pi, 2)//' degrees): its traces are '//to_string(set%spacing/length, 3)// &
            ' apart, its planes '//to_string(set%spacing, 3))
         set%inclination = atan2(-n(1), n(2))*180/pi
         set%spacing = set%spacing/length
      end if

   contains

      !> Report a fault of the group as a whole.
      subroutine report(level, text)
         integer, intent(in) :: level
         character(len=*), intent(in) :: text
         call messages%add(level, '&joint_set: '//text, set%origin)
      end subroutine report

   end subroutine settle_direction

   !> Check the sets that end at others: those must exist, be endless, and have another direction.
   subroutine check_bands(statistics, messages)
      type(statistics_type), intent(in) :: statistics
      type(diagnostics_type), intent(inout) :: messages
      real(wp) :: t(2), other_t(2)
      integer :: i
      do i = 1, size(statistics%sets)
         associate (set => statistics%sets(i))
            if (set%ends_at == 0) cycle
            if (set%ends_at > size(statistics%sets) .or. set%ends_at == i) then
               call messages%add(severity%error, '&joint_set '//to_string(i)//': ends_at = '//to_string(set%ends_at)// &
                                 ', but it must be the number of another set (1 to '// &
                                 to_string(size(statistics%sets))//')', set%origin)
               cycle
            end if
            associate (other => statistics%sets(set%ends_at))
               if (other%trace < huge(1.0_wp) .or. other%ends_at > 0) &
                  call messages%add(severity%error, '&joint_set '// &
                  to_string(i)//': set '//to_string(set%ends_at)//', at which it ends, must be endless (no trace, '// &
                  'no ends_at)', set%origin)
               if (.not. (is_set(set%inclination) .and. is_set(other%inclination))) cycle
               t = direction_of(set%inclination)
               other_t = direction_of(other%inclination)
               if (abs(t(1)*other_t(2) - t(2)*other_t(1)) < 0.02_wp) call messages%add(severity%error, '&joint_set '// &
                  to_string(i)//' is parallel to set '//to_string(set%ends_at)//', at which it should end', set%origin)
            end associate
         end associate
      end do
   end subroutine check_bands

   !> Check that an opening has the measures of its shape and no others, and read the files that it names.
   subroutine settle_opening(opening, options_file, messages)
      type(opening_type), intent(inout) :: opening
      character(len=*), intent(in) :: options_file       !! that draws outlines unless another is named
      type(diagnostics_type), intent(inout) :: messages
      character(len=*), parameter :: measures(8) = [character(len=11) :: 'span', 'wall_height', 'arch_height', &
                                                    'radius', 'width', 'height', 'vertices', 'file']
      logical :: is_wanted(size(measures)), has(size(measures))
      integer :: i
      has = [is_set(opening%span), is_set(opening%wall_height), is_set(opening%arch_height), is_set(opening%radius), &
             is_set(opening%width), is_set(opening%height), allocated(opening%vertices), is_given(opening%file)]
      if (allocated(opening%shape_name)) opening%shape = index_of(opening%shape_name, shape_names)
      if (allocated(opening%outline)) then
         if (opening%shape > 0) call refuse('shape')
         if (any(abs(opening%center) > 0)) call refuse('center')
         do i = 1, 7
            if (has(i)) call refuse(trim(measures(i)))
         end do
         if (.not. is_given(opening%file)) opening%file = options_file
         call read_region_outline(opening%file, opening%outline, opening, messages)
         if (allocated(opening%vertices)) opening%vertices = open_ring(opening%vertices)
         return
      end if
      is_wanted = .false.
      select case (opening%shape)
      case (0)
         call report("'shape' is missing")
         return
      case (1); is_wanted(1:3) = .true.
      case (2); is_wanted(4) = .true.
      case (3); is_wanted(5:6) = .true.
      case default; is_wanted(7:8) = [.not. has(8), has(8)]
      end select
      do i = 1, size(measures)
         if (is_wanted(i) .and. .not. has(i)) then
            call report("'"//trim(measures(i))//"' is missing for the shape '"//opening%shape_name//"'")
         else if (has(i) .and. .not. is_wanted(i)) then
            call report("'"//trim(measures(i))//"' does not belong to the shape '"//opening%shape_name//"'")
         end if
      end do
      if (any(is_wanted .neqv. has)) return
      if (opening%shape == shape_kind%horseshoe .and. opening%arch_height > 0.5_wp*opening%span*(1 + 1.0e-9_wp)) &
         call report('arch_height '//to_string(opening%arch_height)//' is more than half the span '// &
                     to_string(opening%span))
      if (has(8)) call read_csv_table(opening%file, ['x', 'y'], opening%vertices, messages, &
                                                        in_any_order=.true.)
      if (.not. allocated(opening%vertices)) return
      opening%vertices = open_ring(opening%vertices)
      ! no vertices at all: the file could not be read, which was reported
      if (size(opening%vertices, 2) > 0) call check_polygon(opening%vertices, '&opening', opening%origin, messages)

   contains

      !> Report a fault of the group as a whole.
      subroutine report(text)
         character(len=*), intent(in) :: text
         call messages%add(severity%error, '&opening: '//text, opening%origin)
      end subroutine report

      !> Report a measure beside an outline.
      subroutine refuse(name)
         character(len=*), intent(in) :: name
         call report("'"//name//"' does not go with 'outline': the region has the shape")
      end subroutine refuse

   end subroutine settle_opening

   !> Vertices without the last one where it repeats the first, as files of maps have them.
   pure function open_ring(vertices) result(ring)
      real(wp), intent(in) :: vertices(:, :)   !! (2, n)
      real(wp), allocatable :: ring(:, :)
      integer :: n
      n = size(vertices, 2)
      if (n > 1) then
         if (all(abs(vertices(:, n) - vertices(:, 1)) <= 0)) n = n - 1
      end if
      ring = vertices(:, 1:n)
   end function open_ring

   !> The options file of the same name as a statistics file.
   pure function options_beside(file) result(path)
      character(len=*), intent(in) :: file
      character(len=:), allocatable :: path
      integer :: dot
      dot = index(file, '.', back=.true.)
      if (dot <= index(file, '/', back=.true.)) dot = len(file) + 1
      path = file(:dot - 1)//'.nml'
   end function options_beside

   !> Check that a polygon has three corners or more, an area, and no crossing.
   subroutine check_polygon(vertices, name, origin, messages)
      real(wp), intent(in) :: vertices(:, :)
      character(len=*), intent(in) :: name
      type(origin_type), intent(in) :: origin
      type(diagnostics_type), intent(inout) :: messages
      character(len=:), allocatable :: problem
      problem = ''
      if (size(vertices, 2) < 3) then
         problem = 'expected at least 3 vertices, found '//to_string(size(vertices, 2))
      else if (crosses_itself(vertices)) then
         problem = 'its outline crosses or touches itself'
      else if (.not. abs(polygon_area(vertices)) > 0) then
         problem = 'its outline has no area'
      end if
      if (len(problem) > 0) call messages%add(severity%error, name//': '//problem, origin)
   end subroutine check_polygon

   !> Set the shape of an opening to that of the region of a name: one polygon, box or circle.
   subroutine read_region_outline(path, wanted, opening, messages)
      character(len=*), intent(in) :: path     !! of the options file
      character(len=*), intent(in) :: wanted
      type(opening_type), intent(inout) :: opening
      type(diagnostics_type), intent(inout) :: messages
      type(source_type) :: source
      type(namelist_type) :: namelist            !! its faults are reported where it is read
      character(len=:), allocatable :: name, known
      integer :: i, found, n_found
      logical :: ok
      call read_source(path, source, messages, ok)
      if (.not. ok) return
      call parse_namelist(source, namelist)
      known = ''
      n_found = 0
      found = 0
      do i = 1, namelist%n
         associate (group => namelist%groups(i))
            if (group%name /= 'region' .or. find_entry(group, 'name') == 0) cycle
            call get_text(namelist, group%entries(find_entry(group, 'name')), name)
            if (.not. allocated(name)) cycle
            if (len(known) > 0) known = known//', '
            known = known//"'"//trim(adjustl(name))//"'"
            if (lower_case(trim(adjustl(name))) /= lower_case(trim(adjustl(wanted)))) cycle
            n_found = n_found + 1
            found = i
         end associate
      end do
      if (n_found == 1) then
         call set_outline(namelist, namelist%groups(found), opening, ok)
         if (.not. ok) call report("the region '"//trim(wanted)//"' of "//path// &
                                   ' is not drawn by one polygon, one box or one circle')
      else if (n_found > 1) then
         call report(to_string(n_found)//" groups of &region '"//trim(wanted)//"' in "//path// &
                     ': expected one, with a polygon, a box or a circle')
      else if (len(known) > 0) then
         call report("no &region '"//trim(wanted)//"' in "//path//': its regions are '//known)
      else
         call report("no &region '"//trim(wanted)//"' in "//path//', which has no regions')
      end if

   contains

      !> Report a fault of the reference.
      subroutine report(text)
         character(len=*), intent(in) :: text
         call messages%add(severity%error, '&opening: outline: '//text, opening%origin)
      end subroutine report

   end subroutine read_region_outline

   !> Set the shape to the polygon, box or circle of a region.
   subroutine set_outline(namelist, group, opening, ok)
      type(namelist_type), intent(inout) :: namelist
      type(group_type), intent(in) :: group
      type(opening_type), intent(inout) :: opening
      logical, intent(out) :: ok
      real(wp), allocatable :: box(:), circle(:), polygon(:)
      integer :: i, before
      before = namelist%messages%n_errors
      ok = .true.
      do i = 1, group%n
         select case (group%entries(i)%name)
         case ('name')
         case ('box'); call get_reals(namelist, group%entries(i), 4, .false., box)
         case ('circle'); call get_reals(namelist, group%entries(i), 3, .false., circle)
         case ('polygon'); call get_reals(namelist, group%entries(i), 2, .true., polygon)
         case default; ok = .false.
         end select
      end do
      ok = ok .and. namelist%messages%n_errors == before .and. &
           count([allocated(box), allocated(circle), allocated(polygon)]) == 1
      if (.not. ok) return
      opening%center = 0
      opening%shape = shape_kind%polygon
      if (allocated(box)) then
         opening%vertices = corners_of(box)
      else if (allocated(circle)) then
         opening%shape = shape_kind%circle
         opening%center = circle(1:2)
         opening%radius = circle(3)
      else
         opening%vertices = reshape(polygon, [2, size(polygon)/2])
      end if
      if (allocated(circle)) ok = opening%radius > 0
   end subroutine set_outline

end module rockdda_io_statistics_file
