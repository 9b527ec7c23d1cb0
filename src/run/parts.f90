! SPDX-License-Identifier: MIT
!> Parts of a model that options name: regions, cells of blocks, bolts, stages and changes; whether they exist.
module rockdda_run_parts
   use rockdda_base_diagnostics, only : diagnostics_type, severity, at_word
   use rockdda_base_strings, only : to_string
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_bolt_numbers, only : bolt_problem
   use rockdda_model_geometry_input, only : is_spring
   use rockdda_model_options, only : run_options_type, stage_type, change_type, region_type, is_set
   use rockdda_model_analysis_input, only : block_material_type, joint_material_type
   use rockdda_model_material_names, only : number_of_material
   use rockdda_model_regions, only : material_number
   use rockdda_model_stage_options, only : is_given
   use rockdda_cutting_assignment, only : assign_bolts
   use rockdda_cutting_location, only : block_locator_type
   use rockdda_check_bolts, only : check_bolts
   use rockdda_run_cells, only : number_regions, check_regions, report_cut_blocks, count_regions, check_cells, &
      make_cells, check_names
   use rockdda_check_linings, only : check_liners
   use rockdda_check_material_names, only : no_material, unknown_number, check_joint_material, stiffens
   use rockdda_run_described_materials, only : find_described
   use rockdda_run_input, only : model_input_type
   use rockdda_run_water_names, only : check_water_names
   implicit none
   private
   public :: make_parts, make_parts_of_options

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

end module rockdda_run_parts
