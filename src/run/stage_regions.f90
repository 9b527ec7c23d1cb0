! SPDX-License-Identifier: MIT
!> Regions and materials that stages and changes name: whether they exist.
module rockdda_run_stage_regions
   use rockdda_base_diagnostics, only : diagnostics_type, severity, at_word
   use rockdda_base_strings, only : to_string
   use rockdda_model_analysis_input, only : block_material_type, joint_material_type
   use rockdda_model_material_names, only : number_of_material
   use rockdda_model_options, only : stage_type, change_type, region_type, is_set
   use rockdda_model_regions, only : material_number
   use rockdda_model_stage_options, only : is_given
   use rockdda_run_cells, only : check_names
   use rockdda_check_material_names, only : no_material, unknown_number, check_joint_material, stiffens
   implicit none
   private
   public :: number_changes, check_stage_regions

contains

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

end module rockdda_run_stage_regions
