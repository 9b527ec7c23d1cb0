! SPDX-License-Identifier: MIT
!> Names of joint materials and regions in &water.
module rockdda_run_water_names
   use rockdda_base_diagnostics, only : diagnostics_type, severity, at_word
   use rockdda_model_analysis_input, only : joint_material_type
   use rockdda_model_options, only : run_options_type, water_type
   use rockdda_model_regions, only : count_words, same_name, word_of
   use rockdda_model_stage_options, only : is_given
   use rockdda_model_water_check, only : title_of
   use rockdda_base_suggest, only : did_you_mean
   use rockdda_run_cells, only : check_names
   use rockdda_check_material_names, only : check_joint_material
   implicit none
   private
   public :: check_water_names, check_stage_water

contains

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

end module rockdda_run_water_names
