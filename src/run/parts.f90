! SPDX-License-Identifier: MIT
!> Parts of a model that options name: regions, cells of blocks, bolts, stages and changes; whether they exist.
!>
!> Names of joint materials and regions in &water.
!>
!> Loads of the options before a run: loading points that the geometry does not have, and names.
module rockdda_run_parts
   use rockdda_base_diagnostics, only : diagnostics_type, severity, at_word, origin_type
   use rockdda_base_strings, only : to_string
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_bolt_numbers, only : bolt_problem
   use rockdda_model_geometry_input, only : is_spring
   use rockdda_model_options, only : run_options_type, stage_type, change_type, region_type, is_set, water_type
   use rockdda_model_analysis_input, only : block_material_type, joint_material_type
   use rockdda_model_material_names, only : number_of_material, described_materials
   use rockdda_model_regions, only : material_number, count_words, same_name, word_of
   use rockdda_model_stage_options, only : is_given
   use rockdda_cutting_assignment, only : assign_bolts, add_loading_points
   use rockdda_cutting_location, only : block_locator_type
   use rockdda_check_bolts, only : check_bolts
   use rockdda_run_cells, only : number_regions, check_regions, report_cut_blocks, count_regions, check_cells, &
      make_cells, check_names
   use rockdda_check_linings, only : check_liners
   use rockdda_check_material_names, only : no_material, unknown_number, check_joint_material, stiffens
   use rockdda_run_input, only : model_input_type
   use rockdda_model_water_check, only : title_of
   use rockdda_base_suggest, only : did_you_mean
   implicit none
   private
   public :: make_parts, make_parts_of_options, check_stage_water, place_loads, check_load_names, find_described

contains

   !> Regions, the cells of blocks, by the names of their materials, and bolts.
   subroutine make_parts(input, messages)
      type(model_input_type), intent(inout) :: input
      type(diagnostics_type), intent(inout) :: messages
      type(diagnostics_type) :: counts, found
      logical, allocatable :: described_blocks(:), described_joints(:)
      integer :: n(2)
      call find_described(input, described_blocks, described_joints)
      n = [size(described_blocks), size(described_joints)]
      call number_regions(input%options%block_materials, input%options%regions, messages)
      call check_regions(input%blocks, input%options%regions, n(1), messages)
      call check_water_names(input%options, n(2), messages)
      if (messages%has_errors()) then
         call check_cells(input%options%regions, input%options%subdivisions, n(2), &
                          [input%options%joint_materials, input%options%joint_laws], messages)
         return
      end if
      ! how many blocks a region has before they are cut, noted when no error of the cutting is in the way
      call count_regions(input%blocks, input%options%regions, counts)
      call make_cells(input%options%regions, input%options%subdivisions, n(2), &
                      [input%options%joint_materials, input%options%joint_laws], input%blocks, found)
      if (.not. found%has_errors()) call messages%append(counts)
      call messages%append(found)
      if (.not. messages%has_errors()) call report_cut_blocks(input%blocks, input%options%regions, messages)
      call add_bolts(input%options, input%blocks, messages)
      call check_liners(input%options, n(2), input%blocks, messages)
      call number_changes(input%options%block_materials, input%options%changes, messages)
      call check_stage_regions(input%options%stages, input%options%changes, input%options%regions, n(1), &
                               n(2), [input%options%joint_materials, input%options%joint_laws], messages)
   end subroutine make_parts

   !> Which materials are described, by their numbers.
   subroutine find_described(input, blocks, joints)
      type(model_input_type), intent(in) :: input
      logical, allocatable, intent(out) :: blocks(:), joints(:)
      integer :: n(2)
      n = 0
      if (allocated(input%analysis%block_materials)) n = [size(input%analysis%block_materials), &
                                                          size(input%analysis%joint_materials)]
      allocate (blocks, source=described_materials(n(1), input%options%block_materials, input%labelled))
      allocate (joints, source=described_materials(n(2), input%options%joint_materials, input%labelled))
   end subroutine find_described

   !> Cells of blocks and bolts as an options file has them. Materials are not known here.
   subroutine make_parts_of_options(options, blocks, messages)
      type(run_options_type), intent(inout) :: options
      type(block_system_type), intent(inout) :: blocks
      type(diagnostics_type), intent(inout) :: messages
      if (.not. messages%has_errors()) call number_regions(options%block_materials, options%regions, messages)
      if (.not. messages%has_errors()) call check_regions(blocks, options%regions, huge(1), messages)
      if (.not. messages%has_errors()) call make_cells(options%regions, options%subdivisions, huge(1), &
                                                       [options%joint_materials, options%joint_laws], blocks, messages)
      if (.not. messages%has_errors()) call report_cut_blocks(blocks, options%regions, messages)
      if (.not. messages%has_errors()) call add_bolts(options, blocks, messages)
      if (.not. messages%has_errors()) call check_liners(options, huge(1), blocks, messages)
   end subroutine make_parts_of_options

   !> Check the bolts of the options, and add those that are springs; an end is in a block or one of its cells.
   subroutine add_bolts(options, blocks, messages)
      type(run_options_type), intent(in) :: options
      type(block_system_type), intent(inout) :: blocks
      type(diagnostics_type), intent(inout) :: messages
      type(block_locator_type) :: locator
      logical :: usable(size(options%bolts))
      integer :: i
      call check_bolts(options, blocks, messages)
      usable = [(is_spring(options%bolts(i)) .and. len(bolt_problem(options%bolts(i))) == 0, i=1, size(usable))]
      if (.not. any(usable)) return
      call locator%init(blocks, blocks%edge_node_distance)
      call assign_bolts(pack(options%bolts, usable), blocks, locator, messages)
   end subroutine add_bolts

   !> Put numbers in place of the names of block materials in changes.
   subroutine number_changes(materials, changes, messages)
      type(block_material_type), intent(in) :: materials(:)   !! groups of the options that may name block materials
      type(change_type), intent(inout) :: changes(:)
      type(diagnostics_type), intent(inout) :: messages
      character(len=:), allocatable :: word
      integer :: i, m
      do i = 1, size(changes)
         if (.not. is_given(changes(i)%block_material)) cycle
         ! a variable: gfortran 12 frees the text of an associate-name twice here
         word = trim(adjustl(changes(i)%block_material))
         m = number_of_material(word, materials)
         if (m < 1) call messages%add(severity%error, '&change: '//no_material('block', word, materials), &
                                      at_word(changes(i)%origin, word))
         changes(i)%block_material = to_string(max(1, m))
      end do
   end subroutine number_changes

   !> Errors for names that do not exist.
   subroutine check_stage_regions(stages, changes, regions, n_materials, n_joints, named_joints, messages)
      type(stage_type), intent(in) :: stages(:)
      type(change_type), intent(in) :: changes(:)
      type(region_type), intent(in) :: regions(:)
      integer, intent(in) :: n_materials, n_joints               !! block and joint materials
      type(joint_material_type), intent(in) :: named_joints(:)   !! groups of the options that may name joint materials
      type(diagnostics_type), intent(inout) :: messages
      integer :: i
      do i = 1, size(stages)
         if (is_given(stages(i)%excavate)) call check_names('&stage', regions, stages(i)%excavate, stages(i)%origin, &
                                                            messages)
         if (is_given(stages(i)%place)) call check_names('&stage', regions, stages(i)%place, stages(i)%origin, messages)
      end do
      do i = 1, size(changes)
         call check_change(changes(i), regions, n_materials, n_joints, named_joints, messages)
      end do
   end subroutine check_stage_regions

   !> Materials and regions of a change exist.
   subroutine check_change(change, regions, n_materials, n_joints, named_joints, messages)
      type(change_type), intent(in) :: change
      type(region_type), intent(in) :: regions(:)
      integer, intent(in) :: n_materials, n_joints
      type(joint_material_type), intent(in) :: named_joints(:)
      type(diagnostics_type), intent(inout) :: messages
      integer :: m
      if (is_given(change%region)) call check_names('&change', regions, change%region, change%origin, messages)
      if (is_given(change%joint_material)) then
         call check_joint_material('&change', change%joint_material, n_joints, named_joints, change%origin, messages)
         if (is_set(change%joint%maximum_closure)) then
            call fail('maximum_closure cannot change with a stage', 'maximum_closure')
         else if (is_set(change%joint%normal_stiffness) .and. stiffens(change%joint_material, named_joints)) then
            call fail('the normal_stiffness of a joint with maximum_closure cannot change with a stage', &
                      'normal_stiffness')
         end if
      end if
      if (.not. is_given(change%block_material)) return
      ! `number_changes` has put a number there
      m = material_number(trim(adjustl(change%block_material)))
      if (m > n_materials) call messages%add(severity%error, '&change: '//unknown_number('block', m, n_materials), &
                                             at_word(change%origin, change%block_material))

   contains

      !> An error about the change.
      subroutine fail(text, word)
         character(len=*), intent(in) :: text
         character(len=*), intent(in) :: word     !! which is wrong
         call messages%add(severity%error, '&change: '//text, at_word(change%origin, word))
      end subroutine fail

   end subroutine check_change

   !> All names of all groups.
   subroutine check_water_names(options, n_joints, messages)
      type(run_options_type), intent(in) :: options    !! with its lists of regions and joint materials
      integer, intent(in) :: n_joints                  !! joint materials
      type(diagnostics_type), intent(inout) :: messages
      integer :: g
      if (.not. allocated(options%water)) return
      call check_water_joints(options%water, n_joints, [options%joint_materials, options%joint_laws], messages)
      do g = 1, size(options%water)
         if (allocated(options%water(g)%region)) call check_names(title_of(options%water(g), g), options%regions, &
            options%water(g)%region, options%water(g)%origin, messages)
      end do
   end subroutine check_water_names

   !> Stages name groups that there are, or 'none'.
   subroutine check_stage_water(options, messages)
      type(run_options_type), intent(in) :: options
      type(diagnostics_type), intent(inout) :: messages
      character(len=80), allocatable :: known(:)
      character(len=:), allocatable :: word
      integer :: g, i, k, n
      if (.not. allocated(options%stages)) return
      n = 0
      if (allocated(options%water)) n = size(options%water)
      allocate (known(n + 1))
      known = 'none'
      do g = 1, n
         known(g) = ''
         if (is_given(options%water(g)%name)) known(g) = adjustl(options%water(g)%name)
      end do
      do i = 1, size(options%stages)
         associate (stage => options%stages(i))
            if (.not. is_given(stage%water)) cycle
            if (same_name(stage%water, 'none')) cycle
            do k = 1, count_words(stage%water)
               word = word_of(stage%water, k)
               if (any([(same_name(known(g), word), g=1, n)])) cycle
               call messages%add(severity%error, "&stage: there is no &water '"//word//"'"// &
                                 did_you_mean(word, known), at_word(stage%origin, word))
            end do
         end associate
      end do
   end subroutine check_stage_water

   !> Each word of the lists of joints is the name or number of a joint material.
   subroutine check_water_joints(water, n_joints, named_joints, messages)
      type(water_type), intent(in) :: water(:)
      integer, intent(in) :: n_joints                          !! joint materials
      type(joint_material_type), intent(in) :: named_joints(:) !! groups of the options that may name joint materials
      type(diagnostics_type), intent(inout) :: messages
      integer :: g, k
      do g = 1, size(water)
         if (.not. allocated(water(g)%joints)) cycle
         if (len_trim(water(g)%joints) == 0 .or. same_name(water(g)%joints, 'none')) cycle
         do k = 1, count_words(water(g)%joints)
            call check_joint_material(title_of(water(g), g), word_of(water(g)%joints, k), n_joints, named_joints, &
                                      water(g)%origin, messages)
         end do
      end do
   end subroutine check_water_joints

   !> Add the points of &loading_point at to the model. A group then has the numbers of its points; one that names none
   !> has all of the geometry.
   subroutine place_loads(options, blocks, messages)
      type(run_options_type), intent(inout) :: options
      type(block_system_type), intent(inout) :: blocks
      type(diagnostics_type), intent(inout) :: messages
      type(block_locator_type) :: locator
      integer :: i, k, before, given
      given = blocks%loading%n
      if (.not. any([(allocated(options%loading_points(i)%at), i=1, size(options%loading_points))])) return
      call locator%init(blocks, blocks%edge_node_distance)
      do i = 1, size(options%loading_points)
         associate (group => options%loading_points(i))
            if (.not. allocated(group%at)) then
               if (.not. allocated(group%points)) group%points = [(k, k=1, given)]
               cycle
            end if
            if (allocated(group%points)) then
               call messages%add(severity%error, '&loading_point: give points or at, not both', group%origin)
               cycle
            end if
            before = blocks%loading%n
            call add_loading_points(group%at, group%origin, locator, blocks, messages)
            group%points = [(k, k=before + 1, blocks%loading%n)]
         end associate
      end do
   end subroutine place_loads

   !> Names of loads are words that the command line can list.
   subroutine check_load_names(options, messages)
      type(run_options_type), intent(in) :: options
      type(diagnostics_type), intent(inout) :: messages
      integer :: i
      if (allocated(options%loading_points)) then
         do i = 1, size(options%loading_points)
            call check('loading_point', options%loading_points(i)%name, options%loading_points(i)%origin)
         end do
      end if
      if (allocated(options%line_loads)) then
         do i = 1, size(options%line_loads)
            call check('line_load', options%line_loads(i)%name, options%line_loads(i)%origin)
         end do
      end if
      if (allocated(options%boundaries)) then
         do i = 1, size(options%boundaries)
            call check('boundary', options%boundaries(i)%name, options%boundaries(i)%origin)
         end do
      end if

   contains

      !> One name.
      subroutine check(group, name, origin)
         character(len=*), intent(in) :: group
         character(len=:), allocatable, intent(in) :: name
         type(origin_type), intent(in) :: origin
         if (.not. allocated(name)) return
         if (scan(trim(name), ',=') > 0) call messages%add(severity%error, '&'//group// &
            ": the name of a load has neither a comma nor '=', found '"//trim(name)//"'", origin)
      end subroutine check

   end subroutine check_load_names

end module rockdda_run_parts
