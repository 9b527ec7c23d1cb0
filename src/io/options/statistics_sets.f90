! SPDX-License-Identifier: MIT
!> The &joint_set groups of joint statistics files.
module rockdda_io_statistics_sets
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : to_string
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_lines_joint_sets, only : direction_of
   use rockdda_lines_statistics, only : statistics_type, joint_set_type, law
   use rockdda_model_options, only : unset_real, is_set
   use rockdda_io_namelist_parser, only : namelist_type, group_type, find_entry
   use rockdda_io_option_values, only : get_real, get_positive, get_integer, get_logical, get_choice, demand, index_of
   implicit none
   private
   public :: read_joint_set, check_bands

   character(len=*), parameter :: law_names(4) = [character(len=11) :: 'uniform', 'normal', 'lognormal', 'exponential']

contains

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

end module rockdda_io_statistics_sets
