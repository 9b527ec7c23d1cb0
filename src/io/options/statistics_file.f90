! SPDX-License-Identifier: MIT
!> Reader of joint statistics (.dl): a namelist file with the groups and names of docs/joint-networks.md.
module rockdda_io_statistics_file
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : to_string
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_base_random, only : largest_seed
   use rockdda_geometry_polygons, only : polygon_area
   use rockdda_lines_outlines, only : slope_outline, crosses_itself
   use rockdda_lines_statistics, only : statistics_type, region_type, opening_type, extra_line_type, shape_kind
   use rockdda_model_options, only : unset_real, is_set
   use rockdda_io_csv_table, only : read_csv_table
   use rockdda_io_name_hints, only : group_hint
   use rockdda_io_namelist_parser, only : namelist_type, group_type, entry_type, parse_namelist, find_entry, beside
   use rockdda_io_option_values, only : get_real, get_positive, get_integer, get_text, get_choice, get_reals, demand, &
                                        index_of
   use rockdda_io_record_reader, only : append_in_order
   use rockdda_io_source, only : source_type, read_source
   use rockdda_io_statistics_sets, only : read_joint_set, check_bands
   use rockdda_io_statistics_names, only : statistics_groups, statistics_names_of, statistics_name_hint
   implicit none
   private
   public :: read_statistics_file, read_statistics_source

   character(len=*), parameter :: shape_names(4) = [character(len=9) :: 'horseshoe', 'circle', 'rectangle', 'polygon']

contains

   !> Read and check a file of joint statistics; every problem is added to `messages`.
   subroutine read_statistics_file(path, statistics, messages)
      character(len=*), intent(in) :: path
      type(statistics_type), intent(out) :: statistics
      type(diagnostics_type), intent(inout) :: messages
      type(source_type) :: source
      logical :: ok
      call read_source(path, source, messages, ok)
      if (ok) call read_statistics_source(source, statistics, messages)
   end subroutine read_statistics_file

   !> Read text in memory as read_statistics_file reads a file; files it names are sought beside `source%file`.
   subroutine read_statistics_source(source, statistics, messages)
      type(source_type), intent(in) :: source
      type(statistics_type), intent(out) :: statistics
      type(diagnostics_type), intent(inout) :: messages
      type(diagnostics_type) :: found
      type(namelist_type) :: namelist
      integer :: i, sections, boundaries
      real(wp) :: azimuth
      allocate (statistics%sets(0), statistics%openings(0), statistics%lines(0), statistics%material_lines(0), &
                statistics%fixed(4, 0), statistics%loading(2, 0), statistics%measured(2, 0))
      allocate (statistics%region%vertices(2, 0))
      call parse_namelist(source, namelist, found)
      azimuth = unset_real
      sections = 0
      boundaries = 0
      do i = 1, namelist%n
         call check_names(namelist, namelist%groups(i), found)
         if (namelist%groups(i)%name == 'section') then
            sections = sections + 1
            call read_section(namelist, namelist%groups(i), azimuth, found)
         else if (namelist%groups(i)%name == 'boundary') then
            boundaries = boundaries + 1
            if (boundaries > 1) call found%add(severity%error, '&boundary: given more than once', &
                                               namelist%origin(namelist%groups(i)%place))
         end if
      end do
      if (sections > 1) call found%add(severity%error, '&section: given more than once', &
                                       namelist%origin(namelist%groups(namelist%n)%place))
      do i = 1, namelist%n
         associate (group => namelist%groups(i))
            select case (group%name)
            case ('boundary'); call read_boundary(namelist, group, statistics, found)
            case ('joint_set'); call read_joint_set(namelist, group, azimuth, statistics, found)
            case ('opening'); call read_opening(namelist, group, statistics, found)
            case ('line'); call read_line(namelist, group, 'joint_material', statistics%lines, found)
            case ('material_line')
               call read_line(namelist, group, 'block_material', statistics%material_lines, found)
            case ('fixed', 'loading', 'measured'); call read_points(namelist, group, statistics, found)
            case ('lines'); call read_lines(namelist, group, statistics, found)
            end select
         end associate
      end do
      if (boundaries == 0) call found%add(severity%error, '&boundary is missing', source%origin(source%n_lines, 1))
      call check_bands(statistics, found)
      call append_in_order(messages, found)
   end subroutine read_statistics_source

   !> Report unknown groups and names, and names given twice.
   subroutine check_names(namelist, group, messages)
      type(namelist_type), intent(in) :: namelist
      type(group_type), intent(in) :: group
      type(diagnostics_type), intent(inout) :: messages
      integer :: i
      if (size(statistics_names_of(group%name)) == 0) then
         call messages%add(severity%error, 'unknown group &'//group%name// &
                           group_hint(group%name, statistics_groups), &
                           namelist%origin(group%place))
         return
      end if
      do i = 1, group%n
         associate (entry => group%entries(i))
            if (.not. any(statistics_names_of(group%name) == entry%name)) then
               call messages%add(severity%error, "unknown name '"//entry%name//"' in &"//group%name// &
                                 statistics_name_hint(entry%name, group%name), &
                                 namelist%origin(entry%place))
            else if (find_entry(group, entry%name) /= i) then
               call messages%add(severity%warning, entry%name//': given again in the same group, the last one counts', &
                                 namelist%origin(entry%place))
            end if
         end associate
      end do
   end subroutine check_names

   !> Read &section: the direction of the x axis.
   subroutine read_section(namelist, group, azimuth, messages)
      type(namelist_type), intent(in) :: namelist
      type(group_type), intent(in) :: group
      real(wp), intent(inout) :: azimuth
      type(diagnostics_type), intent(inout) :: messages
      integer :: i
      do i = 1, group%n
         if (group%entries(i)%name == 'azimuth') call get_real(namelist, group%entries(i), azimuth, messages)
      end do
      if (find_entry(group, 'azimuth') == 0) call messages%add(severity%error, "&section: 'azimuth' is missing", &
                                                               namelist%origin(group%place))
   end subroutine read_section

   !> Read &lines: seed and tolerance.
   subroutine read_lines(namelist, group, statistics, messages)
      type(namelist_type), intent(in) :: namelist
      type(group_type), intent(in) :: group
      type(statistics_type), intent(inout) :: statistics
      type(diagnostics_type), intent(inout) :: messages
      integer :: i
      do i = 1, group%n
         associate (entry => group%entries(i))
            select case (entry%name)
            case ('seed')
               ! a number that no integer holds is refused before it is turned into one
               if (entry%n == 1) then
                  if (abs(entry%values(1)%number) > largest_seed) then
                     call messages%add(severity%error, 'seed: must be between 0 and '//to_string(largest_seed)// &
                                       ", found '"//entry%values(1)%text//"'", namelist%origin(entry%values(1)%place))
                     cycle
                  end if
               end if
               call get_integer(namelist, entry, 0, statistics%seed, messages)
            case ('edge_node_distance')
               call get_positive(namelist, entry, statistics%edge_node_distance, messages)
            end select
         end associate
      end do
   end subroutine read_lines

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
                  'window: expected xmin, ymin, xmax, ymax with xmin < xmax and ymin < ymax', &
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
            region%vertices = reshape(vertices, [2, size(vertices)/2])
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
      character(len=:), allocatable :: name, file
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
            case ('file')
               call get_text(namelist, entry, file, messages)
               if (.not. allocated(file)) cycle
               call demand(namelist, entry, len_trim(file) > 0, 'must name a file', messages)
               if (len_trim(file) > 0) call read_csv_table(beside(namelist%source%file, trim(file)), &
                                                                          ['x', 'y'], opening%vertices, messages, &
                                                                          in_any_order=.true.)
            end select
         end associate
      end do
      call check_opening(namelist, group, opening, messages)
      n = size(statistics%openings)
      allocate (more(n + 1))
      more(1:n) = statistics%openings
      more(n + 1) = opening
      call move_alloc(more, statistics%openings)
   end subroutine read_opening

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
         if (find_entry(group, 'shape') == 0) call complain("'shape' is missing")
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
            call complain("'"//trim(measures(i))//"' is missing for the shape '"//trim(shape_names(opening%shape))//"'")
         else if (.not. wanted(i) .and. find_entry(group, trim(measures(i))) > 0) then
            call complain("'"//trim(measures(i))//"' does not belong to the shape '"// &
                          trim(shape_names(opening%shape))//"'")
         end if
      end do
      if (opening%shape == shape_kind%horseshoe .and. opening%rise > 0.5_wp*opening%width*(1 + 1.0e-9_wp)) &
         call complain('arch_height '//to_string(opening%rise)//' is more than half the span '// &
                       to_string(opening%width))
      if (opening%shape == shape_kind%polygon .and. allocated(opening%vertices)) then
         ! no vertices at all: the file could not be read, which was reported
         if (size(opening%vertices, 2) > 0) call check_polygon(opening%vertices, '&opening', namelist, group, messages)
      end if

   contains

      !> Report a fault of the group as a whole.
      subroutine complain(text)
         character(len=*), intent(in) :: text
         call messages%add(severity%error, '&opening: '//text, namelist%origin(group%place))
      end subroutine complain

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

   !> Read &line and &material_line.
   subroutine read_line(namelist, group, material_name, lines, messages)
      type(namelist_type), intent(in) :: namelist
      type(group_type), intent(in) :: group
      character(len=*), intent(in) :: material_name
      type(extra_line_type), allocatable, intent(inout) :: lines(:)
      type(diagnostics_type), intent(inout) :: messages
      type(extra_line_type) :: line
      type(extra_line_type), allocatable :: more(:)
      real(wp), allocatable :: values(:)
      integer :: i, n
      line%origin = namelist%origin(group%place)
      do i = 1, group%n
         associate (entry => group%entries(i))
            if (entry%name == 'ends') then
               call get_reals(namelist, entry, 4, .false., values, messages)
               if (.not. allocated(values)) cycle
               line%ends = values
               call demand(namelist, entry, norm2(values(3:4) - values(1:2)) > 0, 'the two ends must differ', messages)
            else if (entry%name == material_name) then
               call get_integer(namelist, entry, 1, line%material, messages)
            end if
         end associate
      end do
      if (find_entry(group, 'ends') == 0) call messages%add(severity%error, '&'//group%name//": 'ends' is missing", &
                                                            namelist%origin(group%place))
      n = size(lines)
      allocate (more(n + 1))
      more(1:n) = lines
      more(n + 1) = line
      call move_alloc(more, lines)
   end subroutine read_line

   !> Read &fixed, &loading, &measured.
   subroutine read_points(namelist, group, statistics, messages)
      type(namelist_type), intent(in) :: namelist
      type(group_type), intent(in) :: group
      type(statistics_type), intent(inout) :: statistics
      type(diagnostics_type), intent(inout) :: messages
      real(wp), allocatable :: points(:), lines(:), along(:), row(:, :)
      integer :: i, n
      n = 0
      do i = 1, group%n
         associate (entry => group%entries(i))
            select case (entry%name)
            case ('points'); call get_reals(namelist, entry, 2, .true., points, messages)
            case ('lines'); call get_reals(namelist, entry, 4, .true., lines, messages)
            case ('along'); call get_reals(namelist, entry, 4, .false., along, messages)
            case ('count')
               call get_integer(namelist, entry, 2, n, messages)
               call demand(namelist, entry, n <= 1000000, 'must not be more than 1000000', messages)
            end select
         end associate
      end do
      if (find_entry(group, 'points') + find_entry(group, 'lines') + find_entry(group, 'along') == 0) &
         call messages%add(severity%error, '&'//group%name//": 'points' is missing", namelist%origin(group%place))
      if ((find_entry(group, 'along') > 0) .neqv. (find_entry(group, 'count') > 0)) call messages%add(severity%error, &
         "&measured: 'along' and 'count' go together", namelist%origin(group%place))
      if (allocated(points)) then
         row = reshape(points, [2, size(points)/2])
         select case (group%name)
         case ('fixed'); call join(statistics%fixed, reshape([(row(:, i), row(:, i), i=1, size(row, 2))], &
                                                             [4, size(row, 2)]))
         case ('loading'); call join(statistics%loading, row)
         case default; call join(statistics%measured, row)
         end select
      end if
      if (allocated(lines)) call join(statistics%fixed, reshape(lines, [4, size(lines)/4]))
      if (allocated(along) .and. n >= 2 .and. n <= 1000000) then
         row = reshape([(along(1:2) + (along(3:4) - along(1:2))*real(i, wp)/(n - 1), i=0, n - 1)], [2, n])
         call join(statistics%measured, row)
      end if
   end subroutine read_points

   !> Append columns.
   pure subroutine join(list, more)
      real(wp), allocatable, intent(inout) :: list(:, :)
      real(wp), intent(in) :: more(:, :)
      real(wp), allocatable :: all(:, :)
      allocate (all(size(list, 1), size(list, 2) + size(more, 2)))
      all(:, :size(list, 2)) = list
      all(:, size(list, 2) + 1:) = more
      call move_alloc(all, list)
   end subroutine join

end module rockdda_io_statistics_file
