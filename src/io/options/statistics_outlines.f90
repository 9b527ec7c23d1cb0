! SPDX-License-Identifier: MIT
!> Boundary and openings of a file of joint statistics. A &region of an options file can draw an opening.
module rockdda_io_statistics_outlines
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : to_string, lower_case
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_geometry_polygons, only : polygon_area
   use rockdda_lines_outlines, only : slope_outline, crosses_itself
   use rockdda_lines_statistics, only : statistics_type, region_type, opening_type, shape_kind
   use rockdda_model_options, only : unset_real, is_set
   use rockdda_io_csv_table, only : read_csv_table
   use rockdda_io_namelist_parser, only : namelist_type, group_type, find_entry, parse_namelist
   use rockdda_io_option_values, only : get_real, get_positive, get_integer, get_text, get_file, get_choice, &
      get_reals, demand, index_of
   use rockdda_io_source, only : source_type, read_source
   implicit none
   private
   public :: read_boundary, read_opening

   character(len=*), parameter :: shape_names(4) = [character(len=9) :: 'horseshoe', 'circle', 'rectangle', 'polygon']

contains

   !> Read &boundary: a window, perhaps with a slope or a frame, or a polygon.
   subroutine read_boundary(namelist, group, statistics, messages)
      type(namelist_type), intent(in) :: namelist
      type(group_type), intent(in) :: group
      type(statistics_type), intent(inout) :: statistics
      type(diagnostics_type), intent(inout) :: messages
      type(origin_type) :: origin
      real(wp), allocatable :: window(:), vertices(:), toe(:)
      real(wp) :: angle
      integer :: i, before
      before = messages%n_errors
      angle = unset_real
      statistics%region = region_type()
      statistics%region%origin = namelist%origin(group%place)
      allocate (statistics%region%vertices(2, 0))
      do i = 1, group%n
         associate (entry => group%entries(i))
            select case (entry%name)
            case ('window')
               call get_reals(namelist, entry, 4, .false., window, messages)
               if (.not. allocated(window)) cycle
               if (.not. (window(3) > window(1) .and. window(4) > window(2))) call messages%add(severity%error, &
                  'window: expected xmin, ymin, xmax, ymax with xmin < xmax and ymin < ymax, found '// &
                  to_string(window(1))//', '//to_string(window(2))//', '//to_string(window(3))//', '// &
                  to_string(window(4)), &
                  namelist%origin(entry%place))
            case ('vertices'); call get_reals(namelist, entry, 2, .true., vertices, messages)
            case ('slope_toe'); call get_reals(namelist, entry, 2, .false., toe, messages)
            case ('slope_angle')
               call get_real(namelist, entry, angle, messages)
               if (is_set(angle)) call demand(namelist, entry, angle > 0 .and. angle < 180, &
                                              'must be between 0 and 180 degrees', messages)
            case ('frame'); call get_positive(namelist, entry, statistics%region%frame, messages)
            case ('joint_material'); call get_integer(namelist, entry, 1, statistics%region%material, messages)
            end select
         end associate
      end do
      if (messages%n_errors > before) return
      origin = namelist%origin(group%place)
      associate (region => statistics%region)
         if (allocated(window) .eqv. allocated(vertices)) then
            call messages%add(severity%error, "&boundary: give either 'window' or 'vertices'", origin)
         else if (allocated(vertices)) then
            if (region%frame > 0 .or. allocated(toe) .or. is_set(angle)) call messages%add(severity%error, &
               "&boundary: 'frame' and 'slope_toe' go with 'window', not with 'vertices'", origin)
            region%vertices = open_ring(reshape(vertices, [2, size(vertices)/2]))
            call check_polygon(region%vertices, '&boundary', namelist, group, messages)
         else if (allocated(toe) .neqv. is_set(angle)) then
            call messages%add(severity%error, "&boundary: 'slope_toe' and 'slope_angle' go together", origin)
         else if (allocated(toe)) then
            region%vertices = slope_outline(window, toe, angle)
            if (size(region%vertices, 2) == 0) call messages%add(severity%error, &
               '&boundary: toe and crest of the slope must lie inside the window', origin)
            if (region%frame > 0) call messages%add(severity%error, "&boundary: a slope has no 'frame'", origin)
         else
            region%vertices = reshape([window(1), window(2), window(3), window(2), window(3), window(4), &
                                       window(1), window(4)], [2, 4])
         end if
      end associate
   end subroutine read_boundary

   !> Read &opening.
   subroutine read_opening(namelist, group, statistics, messages)
      type(namelist_type), intent(in) :: namelist
      type(group_type), intent(in) :: group
      type(statistics_type), intent(inout) :: statistics
      type(diagnostics_type), intent(inout) :: messages
      type(opening_type) :: opening
      type(opening_type), allocatable :: more(:)
      character(len=:), allocatable :: name, file, path, region
      real(wp), allocatable :: values(:)
      integer :: i, n
      opening%origin = namelist%origin(group%place)
      do i = 1, group%n
         associate (entry => group%entries(i))
            select case (entry%name)
            case ('shape')
               call get_choice(namelist, entry, shape_names, name, messages)
               if (allocated(name)) opening%shape = index_of(name, shape_names)
            case ('span', 'width'); call get_positive(namelist, entry, opening%width, messages)
            case ('height'); call get_positive(namelist, entry, opening%height, messages)
            case ('wall_height')
               call get_real(namelist, entry, opening%height, messages)
               call demand(namelist, entry, opening%height >= 0, 'must not be negative', messages)
            case ('arch_height'); call get_positive(namelist, entry, opening%rise, messages)
            case ('radius'); call get_positive(namelist, entry, opening%radius, messages)
            case ('segments'); call get_integer(namelist, entry, 3, opening%segments, messages)
            case ('joint_material'); call get_integer(namelist, entry, 1, opening%material, messages)
            case ('center')
               call get_reals(namelist, entry, 2, .false., values, messages)
               if (allocated(values)) opening%center = values
            case ('vertices')
               call get_reals(namelist, entry, 2, .true., values, messages)
               if (allocated(values)) opening%vertices = reshape(values, [2, size(values)/2])
            case ('outline'); call get_text(namelist, entry, region, messages)
            case ('file'); call get_file(namelist, entry, file, path, messages)
            end select
         end associate
      end do
      if (find_entry(group, 'outline') > 0) then
         opening%is_hole = .false.
         if (find_entry(group, 'file') == 0) path = options_beside(namelist%source%file)
         do i = 1, group%n
            if (any(group%entries(i)%name == [character(len=14) :: 'outline', 'file', 'joint_material', &
                                              'segments'])) cycle
            call messages%add(severity%error, "&opening: '"//group%entries(i)%name//"' does not go with 'outline': "// &
                              'the region has the shape', namelist%origin(group%entries(i)%place))
         end do
         if (allocated(region) .and. allocated(path)) call read_region_outline(path, region, opening, messages)
      else if (allocated(path)) then
         call read_csv_table(path, ['x', 'y'], opening%vertices, messages, in_any_order=.true.)
      end if
      if (allocated(opening%vertices)) opening%vertices = open_ring(opening%vertices)
      if (opening%is_hole) call check_opening(namelist, group, opening, messages)
      if (opening%shape == 0) return
      if (opening%shape == shape_kind%polygon .and. .not. allocated(opening%vertices)) return
      n = size(statistics%openings)
      allocate (more(n + 1))
      more(1:n) = statistics%openings
      more(n + 1) = opening
      call move_alloc(more, statistics%openings)
   end subroutine read_opening

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

   !> Check that an opening has the measures of its shape and no others.
   subroutine check_opening(namelist, group, opening, messages)
      type(namelist_type), intent(in) :: namelist
      type(group_type), intent(in) :: group
      type(opening_type), intent(in) :: opening
      type(diagnostics_type), intent(inout) :: messages
      character(len=*), parameter :: measures(8) = [character(len=11) :: 'span', 'wall_height', 'arch_height', &
                                                    'radius', 'width', 'height', 'vertices', 'file']
      logical :: wanted(size(measures))
      integer :: i
      if (opening%shape == 0) then
         if (find_entry(group, 'shape') == 0) call report("'shape' is missing")
         return
      end if
      select case (opening%shape)
      case (1); wanted = [.true., .true., .true., .false., .false., .false., .false., .false.]
      case (2); wanted = [.false., .false., .false., .true., .false., .false., .false., .false.]
      case (3); wanted = [.false., .false., .false., .false., .true., .true., .false., .false.]
      case default
         wanted = .false.
         wanted(7:8) = [find_entry(group, 'file') == 0, find_entry(group, 'file') > 0]
      end select
      do i = 1, size(measures)
         if (wanted(i) .and. find_entry(group, trim(measures(i))) == 0) then
            call report("'"//trim(measures(i))//"' is missing for the shape '"//trim(shape_names(opening%shape))//"'")
         else if (.not. wanted(i) .and. find_entry(group, trim(measures(i))) > 0) then
            call report("'"//trim(measures(i))//"' does not belong to the shape '"// &
                          trim(shape_names(opening%shape))//"'")
         end if
      end do
      if (opening%shape == shape_kind%horseshoe .and. opening%rise > 0.5_wp*opening%width*(1 + 1.0e-9_wp)) &
         call report('arch_height '//to_string(opening%rise)//' is more than half the span '// &
                       to_string(opening%width))
      if (opening%shape == shape_kind%polygon .and. allocated(opening%vertices)) then
         ! no vertices at all: the file could not be read, which was reported
         if (size(opening%vertices, 2) > 0) call check_polygon(opening%vertices, '&opening', namelist, group, messages)
      end if

   contains

      !> Report a fault of the group as a whole.
      subroutine report(text)
         character(len=*), intent(in) :: text
         call messages%add(severity%error, '&opening: '//text, namelist%origin(group%place))
      end subroutine report

   end subroutine check_opening

   !> Check that a polygon has three corners or more, an area, and no crossing.
   subroutine check_polygon(vertices, name, namelist, group, messages)
      real(wp), intent(in) :: vertices(:, :)
      character(len=*), intent(in) :: name
      type(namelist_type), intent(in) :: namelist
      type(group_type), intent(in) :: group
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
      if (len(problem) > 0) call messages%add(severity%error, name//': '//problem, namelist%origin(group%place))
   end subroutine check_polygon

   !> Set the shape of an opening to that of the region of a name: one polygon, box or circle.
   subroutine read_region_outline(path, wanted, opening, messages)
      character(len=*), intent(in) :: path     !! of the options file
      character(len=*), intent(in) :: wanted
      type(opening_type), intent(inout) :: opening
      type(diagnostics_type), intent(inout) :: messages
      type(source_type) :: source
      type(namelist_type) :: namelist
      type(diagnostics_type) :: reported_there   !! faults of the options file are reported where it is read
      character(len=:), allocatable :: name, known
      integer :: i, found, n_found
      logical :: ok
      call read_source(path, source, messages, ok)
      if (.not. ok) return
      call parse_namelist(source, namelist, reported_there)
      known = ''
      n_found = 0
      found = 0
      do i = 1, namelist%n
         associate (group => namelist%groups(i))
            if (group%name /= 'region' .or. find_entry(group, 'name') == 0) cycle
            call get_text(namelist, group%entries(find_entry(group, 'name')), name, reported_there)
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
      type(namelist_type), intent(in) :: namelist
      type(group_type), intent(in) :: group
      type(opening_type), intent(inout) :: opening
      logical, intent(out) :: ok
      type(diagnostics_type) :: reported_there
      real(wp), allocatable :: box(:), circle(:), polygon(:)
      integer :: i
      ok = .true.
      do i = 1, group%n
         select case (group%entries(i)%name)
         case ('name')
         case ('box'); call get_reals(namelist, group%entries(i), 4, .false., box, reported_there)
         case ('circle'); call get_reals(namelist, group%entries(i), 3, .false., circle, reported_there)
         case ('polygon'); call get_reals(namelist, group%entries(i), 2, .true., polygon, reported_there)
         case default; ok = .false.
         end select
      end do
      ok = ok .and. .not. reported_there%has_errors() .and. &
           count([allocated(box), allocated(circle), allocated(polygon)]) == 1
      if (.not. ok) return
      opening%center = 0
      opening%shape = shape_kind%polygon
      if (allocated(box)) then
         opening%vertices = reshape([box(1), box(2), box(3), box(2), box(3), box(4), box(1), box(4)], [2, 4])
      else if (allocated(circle)) then
         opening%shape = shape_kind%circle
         opening%center = circle(1:2)
         opening%radius = circle(3)
      else
         opening%vertices = reshape(polygon, [2, size(polygon)/2])
      end if
      if (allocated(circle)) ok = opening%radius > 0
   end subroutine set_outline

end module rockdda_io_statistics_outlines
