! SPDX-License-Identifier: MIT
!> Which stretches of edges the groups of &water wet: those of the joints that a group names, and, where it wets
!> surfaces, those that face no other block; of the blocks of its region.
module rockdda_interaction_wetted_edges
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_base_strings, only : counted, to_string
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_options, only : water_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_regions, only : blocks_of_region, count_words, material_number, same_name, word_of
   use rockdda_model_units, only : unit_system_type, unit_system
   use rockdda_model_water_check, only : title_of
   use rockdda_interaction_water_edges, only : edge_stretch_type, find_stretches
   use rockdda_interaction_water_pressure, only : water_pressure_type, water_scratch_type, new_water_pressure, rise_of
   implicit none
   private
   public :: find_wetted_edges

contains

   !> The stretches that some group wets. Warnings: groups that wet nothing. Error: points that make no triangle. The
   !> groups have been checked (rockdda_model_water_check).
   subroutine find_wetted_edges(blocks, parameters, stretches, wets, pressure, messages)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(edge_stretch_type), allocatable, intent(out) :: stretches(:)
      logical, allocatable, intent(out) :: wets(:, :)                     !! (groups, stretches)
      type(water_pressure_type), allocatable, intent(out) :: pressure(:)  !! (groups)
      type(diagnostics_type), intent(inout) :: messages
      type(edge_stretch_type), allocatable :: all_stretches(:)
      logical, allocatable :: all_wets(:, :)
      integer :: g, n
      n = 0
      if (allocated(parameters%water)) n = size(parameters%water)
      allocate (pressure(n))
      allocate (all_stretches(0))
      if (n > 0) call find_stretches(blocks, max(blocks%edge_node_distance, 1.0e-9_wp*parameters%w0), &
                                     all_stretches)
      allocate (all_wets(n, size(all_stretches)))
      do g = 1, n
         call new_water_pressure(parameters%water(g), pressure(g))
         if (.not. pressure(g)%is_there()) then
            call messages%add(severity%error, title_of(parameters%water(g), g)//': pressure_file: the points make '// &
                              'no triangle: they lie on a line, or two are the same', parameters%water(g)%origin)
            return
         end if
         all_wets(g, :) = wetted_by(blocks, parameters, parameters%water(g), all_stretches)
      end do
      stretches = pack(all_stretches, any(all_wets, dim=1))
      allocate (wets(n, size(stretches)))
      do g = 1, n
         wets(g, :) = pack(all_wets(g, :), any(all_wets, dim=1))
         call report(stretches, wets(g, :), pressure(g), blocks, parameters%water(g), g, &
                     unit_system(parameters%units), messages)
         call report_beyond(stretches, wets(g, :), pressure(g), blocks, parameters, g, messages)
      end do
   end subroutine find_wetted_edges

   !> Which stretches does a group wet?
   pure function wetted_by(blocks, parameters, group, stretches) result(wets)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(water_type), intent(in) :: group
      type(edge_stretch_type), intent(in) :: stretches(:)
      logical :: wets(size(stretches))
      logical :: inside(blocks%n_blocks), joints(size(parameters%joint_materials))
      integer :: i
      inside = blocks_of_group(blocks, parameters, group)
      joints = named_joints(parameters, group)
      do i = 1, size(stretches)
         associate (s => stretches(i))
            wets(i) = group%surfaces
            if (s%joints(2) > 0) wets(i) = any(joints(s%joints))
            wets(i) = wets(i) .and. inside(s%block)
         end associate
      end do
   end function wetted_by

   !> Blocks that a group names.
   pure function blocks_of_group(blocks, parameters, group) result(inside)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(water_type), intent(in) :: group
      logical, allocatable :: inside(:)
      character(len=:), allocatable :: names
      names = ''
      if (allocated(group%region)) names = group%region
      if (allocated(parameters%regions)) then
         inside = blocks_of_region(blocks, parameters%regions, names)
      else
         allocate (inside(blocks%n_blocks), source=.true.)
      end if
   end function blocks_of_group

   !> Joint materials that a group names; all of them when it names none.
   pure function named_joints(parameters, group) result(named)
      type(parameters_type), intent(in) :: parameters
      type(water_type), intent(in) :: group
      logical, allocatable :: named(:)          !! (joint materials)
      character(len=:), allocatable :: word, names
      integer :: i, k
      names = ''
      if (allocated(group%joints)) names = group%joints
      allocate (named(size(parameters%joint_materials)), source=len_trim(names) == 0)
      if (len_trim(names) == 0 .or. same_name(names, 'none')) return
      do k = 1, count_words(names)
         word = word_of(names, k)
         do i = 1, size(named)
            if (material_number(word) == i) named(i) = .true.
            if (.not. allocated(parameters%joint_materials(i)%name)) cycle
            if (same_name(word, parameters%joint_materials(i)%name)) named(i) = .true.
         end do
      end do
   end function named_joints

   !> A note on what a group wets at the start, or the warning that it wets nothing at any time.
   subroutine report(stretches, wets, pressure, blocks, group, g, system, messages)
      type(edge_stretch_type), intent(in) :: stretches(:)
      logical, intent(in) :: wets(:)                 !! (stretches)
      type(water_pressure_type), intent(in) :: pressure
      type(block_system_type), intent(in) :: blocks
      type(water_type), intent(in) :: group
      integer, intent(in) :: g
      type(unit_system_type), intent(in) :: system
      type(diagnostics_type), intent(inout) :: messages
      type(water_scratch_type) :: scratch
      real(wp) :: rises(2), largest, here(2)
      integer :: i, wet(2), time
      rises = rise_of(group, 0.0_wp)
      if (allocated(group%level)) then
         if (size(group%level, 2) > 0) rises(2) = max(rises(1), maxval(group%level(2, :)))
      end if
      wet = 0
      largest = 0
      do i = 1, size(stretches)
         if (.not. wets(i)) cycle
         associate (s => stretches(i), p => blocks%vertices(:, stretches(i)%vertices(1)), &
                    q => blocks%vertices(:, stretches(i)%vertices(2)))
            do time = 1, 2
               call pressure%largest_on(p, q, s%ends, rises(time), scratch, here(time))
               if (here(time) > 0) wet(time) = wet(time) + 1
            end do
            largest = max(largest, here(1))
         end associate
      end do
      if (count(wets) == 0) then
         call messages%add(severity%warning, title_of(group, g)//' wets nothing: no edge belongs to its joints, '// &
                           'surfaces and region', group%origin)
      else if (maxval(wet) == 0) then
         call messages%add(severity%warning, title_of(group, g)//' wets nothing: the pressure is 0 on all '// &
                           counted(count(wets), 'piece')//' of edges of its joints, '// &
                           'surfaces and region', group%origin)
      else
         call messages%add(severity%note, title_of(group, g)//': '//counted(wet(1), 'piece')// &
                           ' of edges under water at the start, largest pressure '// &
                           system%shown(largest, 'stress', 6), group%origin)
      end if
   end subroutine report

   !> The warning that blocks reach beyond the points at which the pressure is given.
   subroutine report_beyond(stretches, wets, pressure, blocks, parameters, g, messages)
      type(edge_stretch_type), intent(in) :: stretches(:)
      logical, intent(in) :: wets(:)                 !! (stretches)
      type(water_pressure_type), intent(in) :: pressure
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      integer, intent(in) :: g
      type(diagnostics_type), intent(inout) :: messages
      real(wp) :: margin
      integer :: i, n, first
      n = 0
      first = 0
      margin = max(blocks%edge_node_distance, 1.0e-6_wp*parameters%w0)
      if (.not. allocated(pressure%field)) return
      do i = 1, size(stretches)
         if (.not. wets(i)) cycle
         if (pressure%covers(blocks%vertices(:, stretches(i)%vertices(1)), margin)) cycle
         n = n + 1
         if (first == 0) first = stretches(i)%vertices(1)
      end do
      if (n > 0) call messages%add(severity%warning, title_of(parameters%water(g), g)//': '//counted(n, 'piece')// &
         ' of edges begin beyond the points of pressure_file, the first at ('// &
         to_string(blocks%vertices(1, first), 6)//', '//to_string(blocks%vertices(2, first), 6)// &
         '); the pressure there goes on as in the nearest triangle', parameters%water(g)%origin)
   end subroutine report_beyond

end module rockdda_interaction_wetted_edges
