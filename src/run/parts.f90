! SPDX-License-Identifier: MIT
!> Parts of a model that options name: regions, cells of blocks, bolts, stages and changes.
module rockdda_run_parts
   use rockdda_base_diagnostics, only : diagnostics_type
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_bolt_numbers, only : bolt_problem
   use rockdda_model_geometry_input, only : is_spring
   use rockdda_model_options, only : run_options_type
   use rockdda_cutting_assignment, only : assign_bolts
   use rockdda_cutting_location, only : block_locator_type
   use rockdda_check_bolts, only : check_bolts
   use rockdda_run_cells, only : number_regions, check_regions, report_cut_blocks, count_regions, &
                                 check_cells, make_cells
   use rockdda_check_linings, only : check_liners
   use rockdda_run_described_materials, only : find_described
   use rockdda_run_input, only : model_input_type
   use rockdda_run_stage_regions, only : number_changes, check_stage_regions
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

end module rockdda_run_parts
