! SPDX-License-Identifier: MIT
!> Reader of joint statistics (.dl): a namelist file with the groups and names of docs/cutting.md.
module rockdda_io_statistics_file
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : to_string
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_base_random, only : largest_seed
   use rockdda_lines_statistics, only : statistics_type, extra_line_type, joint_set_type, law
   use rockdda_lines_joint_sets, only : direction_of
   use rockdda_model_options, only : unset_real, is_set
   use rockdda_io_name_hints, only : group_hint
   use rockdda_io_namelist_parser, only : namelist_type, group_type, parse_namelist, find_entry, beside
   use rockdda_io_option_values, only : get_real, get_positive, get_integer, get_reals, demand, get_logical, &
      get_choice, index_of
   use rockdda_io_record_reader, only : append_in_order
   use rockdda_io_source, only : source_type, read_source
   use rockdda_io_statistics_names, only : statistics_groups, statistics_names_of, statistics_name_hint
   use rockdda_io_statistics_outlines, only : read_boundary, read_opening
   implicit none
   private
   public :: read_statistics_file, read_statistics_source

   character(len=*), parameter :: law_names(4) = [character(len=11) :: 'uniform', 'normal', 'lognormal', 'exponential']

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

   !> Read &joint_set.
   subroutine read_joint_set(namelist, group, azimuth, statistics, messages)
      type(namelist_type), intent(in) :: namelist
      type(group_type), intent(in) :: group
      real(wp), intent(in) :: azimuth
      type(statistics_type), intent(inout) :: statistics
      type(diagnostics_type), intent(inout) :: messages
      type(joint_set_type) :: set
      type(joint_set_type), allocatable :: more(:)
      character(len=:), allocatable :: name
      real(wp) :: inclination, dip, dip_direction, randomness
      integer :: i, n
      set%origin = namelist%origin(group%place)
      inclination = unset_real
      dip = unset_real
      dip_direction = unset_real
      randomness = unset_real
      do i = 1, group%n
         associate (entry => group%entries(i))
            select case (entry%name)
            case ('inclination')
               call get_real(namelist, entry, inclination, messages)
               if (is_set(inclination)) call demand(namelist, entry, abs(inclination) <= 360, &
                                                    'must be between -360 and 360 degrees', messages)
            case ('dip')
               call get_real(namelist, entry, dip, messages)
               if (is_set(dip)) call demand(namelist, entry, dip >= 0 .and. dip <= 90, &
                                            'must be between 0 and 90 degrees', messages)
            case ('dip_direction')
               call get_real(namelist, entry, dip_direction, messages)
               if (is_set(dip_direction)) call demand(namelist, entry, abs(dip_direction) <= 360, &
                                                      'must be between -360 and 360 degrees', messages)
            case ('spacing'); call get_positive(namelist, entry, set%spacing, messages)
            case ('trace'); call get_positive(namelist, entry, set%trace, messages)
            case ('bridge')
               call get_real(namelist, entry, set%bridge, messages)
               call demand(namelist, entry, set%bridge >= 0, 'must not be negative', messages)
            case ('randomness')
               call get_real(namelist, entry, randomness, messages)
               if (is_set(randomness)) call demand(namelist, entry, randomness >= 0 .and. randomness <= 0.5_wp, &
                                                   'must be between 0 and 0.5', messages)
            case ('joint_material'); call get_integer(namelist, entry, 1, set%material, messages)
            case ('offset'); call get_real(namelist, entry, set%offset, messages)
            case ('start'); call get_real(namelist, entry, set%start, messages)
            case ('stagger')
               call get_real(namelist, entry, set%stagger, messages)
               call demand(namelist, entry, abs(set%stagger) <= 1, 'must be between -1 and 1', messages)
            case ('distribution')
               if (allocated(name)) deallocate (name)
               call get_choice(namelist, entry, law_names, name, messages)
               if (allocated(name)) set%spacing_law = index_of(name, law_names)
               if (find_entry(group, 'trace_distribution') == 0) set%trace_law = set%spacing_law
            case ('trace_distribution')
               if (allocated(name)) deallocate (name)
               call get_choice(namelist, entry, law_names, name, messages)
               if (allocated(name)) set%trace_law = index_of(name, law_names)
            case ('ends_at'); call get_integer(namelist, entry, 1, set%ends_at, messages)
            case ('avoid_cantilevers'); call get_logical(namelist, entry, set%avoid_cantilevers, messages)
            end select
         end associate
      end do
      call check_joint_set(namelist, group, randomness, set, messages)
      call find_inclination(namelist, group, inclination, dip, dip_direction, azimuth, set, messages)
      n = size(statistics%sets)
      allocate (more(n + 1))
      more(1:n) = statistics%sets
      more(n + 1) = set
      call move_alloc(more, statistics%sets)
   end subroutine read_joint_set

   !> Check the values of a set that depend on each other.
   subroutine check_joint_set(namelist, group, randomness, set, messages)
      type(namelist_type), intent(in) :: namelist
      type(group_type), intent(in) :: group
      real(wp), intent(in) :: randomness
      type(joint_set_type), intent(inout) :: set
      type(diagnostics_type), intent(inout) :: messages
      logical :: has_trace, needs_variation
      has_trace = find_entry(group, 'trace') > 0
      if (find_entry(group, 'spacing') == 0) call report("'spacing' is missing")
      if (set%bridge > 0 .and. .not. has_trace) &
         call report("'bridge' goes with 'trace' (without, traces are endless)")
      if (has_trace .and. set%bridge > set%trace) call report('bridge '//to_string(set%bridge)// &
         ' is longer than trace '//to_string(set%trace))
      needs_variation = any([set%spacing_law, set%trace_law] == law%normal) .or. &
                        any([set%spacing_law, set%trace_law] == law%lognormal)
      if (is_set(randomness)) then
         set%randomness = randomness
      else if (needs_variation) then
         call report("'randomness' is missing: the coefficient of variation of the distribution")
      else if (set%spacing_law == law%exponential .or. set%trace_law == law%exponential) then
         set%randomness = 0.5_wp
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
         call messages%add(severity%error, '&joint_set: '//text, namelist%origin(group%place))
      end subroutine report

   end subroutine check_joint_set

   !> Inclination and spacing in the section. From dip and dip direction: the section is the upright plane whose x axis
   !> points to `azimuth`; a plane with normal n leaves traces across the part of n that lies in the section, and
   !> its spacing grows by one over that part's length.
   subroutine find_inclination(namelist, group, inclination, dip, dip_direction, azimuth, set, messages)
      type(namelist_type), intent(in) :: namelist
      type(group_type), intent(in) :: group
      real(wp), intent(in) :: inclination, dip, dip_direction, azimuth
      type(joint_set_type), intent(inout) :: set
      type(diagnostics_type), intent(inout) :: messages
      real(wp), parameter :: pi = acos(-1.0_wp)
      real(wp), parameter :: nearly_parallel = sin(10*pi/180)
      real(wp) :: n(2), d(2), a(2), length
      logical :: by_dip
      by_dip = is_set(dip) .or. is_set(dip_direction)
      if (is_set(inclination) .eqv. by_dip) then
         call messages%add(severity%error, "&joint_set: give either 'inclination' or 'dip' and 'dip_direction'", &
                           namelist%origin(group%place))
         return
      end if
      if (is_set(inclination)) then
         set%inclination = inclination
         return
      end if
      if (.not. (is_set(dip) .and. is_set(dip_direction))) then
         call messages%add(severity%error, "&joint_set: 'dip' and 'dip_direction' go together", &
                           namelist%origin(group%place))
      else if (.not. is_set(azimuth)) then
         call messages%add(severity%error, '&joint_set: dip and dip_direction need &section with its azimuth', &
                           namelist%origin(group%place))
      else
         d = direction_of(dip)
         a = direction_of(dip_direction - azimuth)
         ! upward normal: sin(dip) towards the dip direction, cos(dip) up
         n = [d(2)*a(1), d(1)]
         length = norm2(n)
         if (length < 0.02_wp) then
            call messages%add(severity%error, '&joint_set: the set is parallel to the section and leaves no traces '// &
                              'in it', namelist%origin(group%place))
            return
         end if
         if (length < nearly_parallel) call messages%add(severity%warning, '&joint_set: the set is nearly parallel '// &
            'to the section ('//to_string(asin(length)*180/pi, 2)//' degrees): its traces are '// &
            to_string(set%spacing/length, 3)//' apart, its planes '//to_string(set%spacing, 3), &
            namelist%origin(group%place))
         set%inclination = atan2(-n(1), n(2))*180/pi
         set%spacing = set%spacing/length
      end if
   end subroutine find_inclination

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
               t = direction_of(set%inclination)
               other_t = direction_of(other%inclination)
               if (abs(t(1)*other_t(2) - t(2)*other_t(1)) < 0.02_wp) call messages%add(severity%error, '&joint_set '// &
                  to_string(i)//' is parallel to set '//to_string(set%ends_at)//', at which it should end', set%origin)
            end associate
         end associate
      end do
   end subroutine check_bands

end module rockdda_io_statistics_file
