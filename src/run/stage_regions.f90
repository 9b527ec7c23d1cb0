! SPDX-License-Identifier: MIT
!> Regions and materials that stages and changes name: whether they exist, and what else is on the blocks that are
!> excavated or placed.
module rockdda_run_stage_regions
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_base_strings, only : counted, to_string
   use rockdda_model_analysis_input, only : block_material_type, joint_material_type
   use rockdda_model_blocks, only : block_system_type, point_set_type
   use rockdda_model_joint_options, only : joint_number
   use rockdda_model_material_options, only : block_number
   use rockdda_model_options, only : stage_type, change_type, region_type
   use rockdda_model_regions, only : blocks_of_region, material_number
   use rockdda_model_stage_options, only : stage_name, is_given
   use rockdda_run_cells, only : check_names
   use rockdda_run_material_names, only : no_block_material, no_joint_material
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
         m = block_number(word, materials)
         if (m < 1) call messages%add(severity%error, '&change: '//no_block_material(word, materials), &
                                      changes(i)%origin)
         changes(i)%block_material = to_string(max(1, m))
      end do
   end subroutine number_changes

   !> Errors for names that do not exist, and warnings about points, bolts and loads on blocks that go.
   subroutine check_stage_regions(blocks, stages, changes, regions, n_materials, n_joints, named_joints, messages)
      type(block_system_type), intent(in) :: blocks
      type(stage_type), intent(in) :: stages(:)
      type(change_type), intent(in) :: changes(:)
      type(region_type), intent(in) :: regions(:)
      integer, intent(in) :: n_materials, n_joints               !! block and joint materials
      type(joint_material_type), intent(in) :: named_joints(:)   !! groups of the options that may name joint materials
      type(diagnostics_type), intent(inout) :: messages
      logical, allocatable :: there(:), goes(:), comes(:)
      integer :: i, before
      before = messages%n_errors
      do i = 1, size(stages)
         if (is_given(stages(i)%excavate)) call check_names('&stage', regions, stages(i)%excavate, stages(i)%origin, &
                                                            messages)
         if (is_given(stages(i)%place)) call check_names('&stage', regions, stages(i)%place, stages(i)%origin, messages)
      end do
      do i = 1, size(changes)
         call check_change(changes(i), regions, n_materials, n_joints, named_joints, messages)
      end do
      if (messages%n_errors > before) return
      ! absent at the start are blocks that are placed before they are excavated, if ever
      allocate (there(blocks%n_blocks), goes(blocks%n_blocks))
      there = .true.
      goes = .false.
      do i = 1, size(stages)
         if (is_given(stages(i)%place)) there = there .and. &
            (goes .or. .not. blocks_of_region(blocks, regions, stages(i)%place))
         if (is_given(stages(i)%excavate)) goes = goes .or. blocks_of_region(blocks, regions, stages(i)%excavate)
      end do
      do i = 1, size(stages)
         associate (stage => stages(i), name => "&stage '"//stage_name(stages, i)//"'")
            if (is_given(stage%place)) then
               comes = blocks_of_region(blocks, regions, stage%place) .and. .not. there
               call tell_number(name//' places ', count(comes), stage%origin, messages)
               there = there .or. comes
            end if
            if (.not. is_given(stage%excavate)) cycle
            goes = blocks_of_region(blocks, regions, stage%excavate) .and. there
            call tell_number(name//' excavates ', count(goes), stage%origin, messages)
            if (is_given(stage%place)) then
               if (any(goes .and. blocks_of_region(blocks, regions, stage%place))) call messages%add(severity%error, &
                  name//' places and excavates the same blocks', stage%origin)
            end if
            if (any(goes)) call tell_what_goes(blocks, goes, name, stage%origin, messages)
            there = there .and. .not. goes
            if (.not. any(there)) call messages%add(severity%error, name//' excavates the last block', stage%origin)
         end associate
      end do
   end subroutine check_stage_regions

   !> A note with a number of blocks, a warning where there are none.
   subroutine tell_number(what, n, origin, messages)
      character(len=*), intent(in) :: what
      integer, intent(in) :: n
      type(origin_type), intent(in) :: origin
      type(diagnostics_type), intent(inout) :: messages
      call messages%add(merge(severity%note, severity%warning, n > 0), what//counted(n, 'block'), origin)
   end subroutine tell_number

   !> Warn about what is on excavated blocks: it goes with them.
   subroutine tell_what_goes(blocks, goes, name, origin, messages)
      type(block_system_type), intent(in) :: blocks
      logical, intent(in) :: goes(:)             !! (nb)
      character(len=*), intent(in) :: name       !! of the stage
      type(origin_type), intent(in) :: origin
      type(diagnostics_type), intent(inout) :: messages
      integer :: l, n
      call tell_points(blocks%fixed, 'fixed point')
      call tell_points(blocks%loading, 'loading point')
      call tell_points(blocks%measured, 'measured point')
      n = 0
      do l = 1, blocks%bolts%n
         associate (pair => blocks%bolts%blocks(:, l))
            if (any([(pair(1) > 0 .and. goes(max(1, pair(1)))), (pair(2) > 0 .and. goes(max(1, pair(2))))])) n = n + 1
         end associate
      end do
      if (n > 0) call messages%add(severity%warning, name//': '//counted(n, 'bolt')//' with an end in excavated '// &
         'blocks: their force is released with the excavation', origin)

   contains

      !> Points of one kind.
      subroutine tell_points(points, noun)
         type(point_set_type), intent(in) :: points
         character(len=*), intent(in) :: noun
         integer :: p
         n = 0
         do p = 1, points%n
            if (points%block(p) > 0) n = n + merge(1, 0, goes(max(1, points%block(p))))
         end do
         if (n > 0) call messages%add(severity%warning, name//': '//counted(n, noun)// &
            ' on excavated blocks, without effect from then on', &
                                      origin)
      end subroutine tell_points

   end subroutine tell_what_goes

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
         m = joint_number(change%joint_material, named_joints)
         if (m < 1 .or. m > n_joints) call fail(no_joint_material(trim(adjustl(change%joint_material)), named_joints))
      end if
      if (.not. is_given(change%block_material)) return
      m = material_number(trim(adjustl(change%block_material)))
      if (m < 1 .or. m > n_materials) call fail("block material '"// &
         trim(adjustl(change%block_material))//"' is unknown; there "//trim(merge('is ', 'are', n_materials == 1))// &
         ' '//counted(n_materials, 'block material'))

   contains

      !> An error about the change.
      subroutine fail(text)
         character(len=*), intent(in) :: text
         call messages%add(severity%error, '&change: '//text, change%origin)
      end subroutine fail

   end subroutine check_change

end module rockdda_run_stage_regions
