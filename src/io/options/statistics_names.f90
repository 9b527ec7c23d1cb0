! SPDX-License-Identifier: MIT
!> Groups and names of joint statistics files (.dl).
module rockdda_io_statistics_names
   use rockdda_model_option, only : name_length
   use rockdda_io_name_hints, only : name_hint
   implicit none
   private
   public :: statistics_groups, statistics_names_of, statistics_name_hint

   character(len=*), parameter :: statistics_groups(10) = [character(len=name_length) :: 'boundary', 'joint_set', &
      'opening', 'line', 'fixed', 'loading', 'measured', 'material_line', 'section', 'lines']
   character(len=*), parameter :: boundary_names(6) = [character(len=name_length) :: 'window', 'vertices', &
      'slope_toe', 'slope_angle', 'frame', 'joint_material']
   character(len=*), parameter :: joint_set_names(15) = [character(len=name_length) :: 'inclination', 'dip', &
      'dip_direction', 'spacing', 'trace', 'bridge', 'randomness', 'joint_material', 'offset', 'start', 'stagger', &
      'distribution', 'trace_distribution', 'ends_at', 'avoid_cantilevers']
   character(len=*), parameter :: opening_names(13) = [character(len=name_length) :: 'shape', 'span', 'wall_height', &
      'arch_height', 'radius', 'width', 'height', 'vertices', 'center', 'segments', 'joint_material', 'file', &
      'outline']
   character(len=*), parameter :: line_names(2) = [character(len=name_length) :: 'ends', 'joint_material']
   character(len=*), parameter :: fixed_names(2) = [character(len=name_length) :: 'points', 'lines']
   character(len=*), parameter :: loading_names(1) = [character(len=name_length) :: 'points']
   character(len=*), parameter :: measured_names(3) = [character(len=name_length) :: 'points', 'along', 'count']
   character(len=*), parameter :: material_line_names(2) = [character(len=name_length) :: 'ends', 'block_material']
   character(len=*), parameter :: section_names(1) = [character(len=name_length) :: 'azimuth']
   character(len=*), parameter :: lines_names(2) = [character(len=name_length) :: 'seed', 'edge_node_distance']

contains

   !> Names of a group; none when the group is unknown.
   pure function statistics_names_of(group) result(names)
      character(len=*), intent(in) :: group
      character(len=name_length), allocatable :: names(:)
      select case (group)
      case ('boundary'); names = boundary_names
      case ('joint_set'); names = joint_set_names
      case ('opening'); names = opening_names
      case ('line'); names = line_names
      case ('fixed'); names = fixed_names
      case ('loading'); names = loading_names
      case ('measured'); names = measured_names
      case ('material_line'); names = material_line_names
      case ('section'); names = section_names
      case ('lines'); names = lines_names
      case default; allocate (names(0))
      end select
   end function statistics_names_of

   !> Hint for an unknown name.
   pure function statistics_name_hint(name, group) result(text)
      character(len=*), intent(in) :: name, group
      character(len=:), allocatable :: text
      character(len=name_length), allocatable :: names(:), group_of(:)
      integer :: i
      allocate (names(0), group_of(0))
      do i = 1, size(statistics_groups)
         associate (more => statistics_names_of(trim(statistics_groups(i))))
            names = [names, more]
            group_of = [group_of, spread(statistics_groups(i), 1, size(more))]
         end associate
      end do
      text = name_hint(name, group, group_of, names)
      if (group == 'opening' .and. any(name == ['name  ', 'region'])) text = &
         '; draw it as &region of the options file, which stages name, and take its outline here: outline = ''NAME'''
   end function statistics_name_hint

end module rockdda_io_statistics_names
