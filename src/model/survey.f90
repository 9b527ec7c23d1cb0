! SPDX-License-Identifier: MIT
!> What an engineer reads of a model before its run: sizes of blocks, the sharpest corner, the stress of the overburden
!> and what joints can bear under it.
module rockdda_model_survey
   use rockdda_base_kinds, only : wp, pi
   use rockdda_geometry_polygons, only : polygon_area
   use rockdda_model_analysis_input, only : joint_material_type
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_options, only : is_set
   use rockdda_model_parameters, only : parameters_type
   implicit none
   private
   public :: survey_type, survey_model, unit_weight_of, joint_strength

   type :: survey_type
      real(wp) :: x_min = 0, x_max = 0, y_min = 0, y_max = 0 !! extent of the blocks [length]
      real(wp) :: area = 0                       !! of all blocks
      real(wp) :: smallest_area = 0, mean_area = 0, largest_area = 0
      integer :: smallest_block = 0
      real(wp) :: smallest_place(2) = 0          !! its centre
      real(wp) :: smallest_angle = 180           !! of a corner [deg]
      integer :: angle_block = 0
      real(wp) :: angle_place(2) = 0             !! the corner
      real(wp) :: shortest_edge = huge(1.0_wp), mean_edge = 0
      real(wp) :: unit_weight = 0                !! largest of the blocks, down
      real(wp) :: base_stress = 0                !! weight of a column of the height of the model, and surcharge
      real(wp), allocatable :: joint_length(:)   !! (joint materials) of edges; both sides of a joint count
      integer, allocatable :: blocks_of(:)       !! (block materials)
   end type survey_type

contains

   !> Survey a model with at least one block.
   pure function survey_model(blocks, parameters) result(survey)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(survey_type) :: survey
      real(wp) :: surcharge
      integer :: i
      survey%x_min = minval(blocks%vertices(1, :))
      survey%x_max = maxval(blocks%vertices(1, :))
      survey%y_min = minval(blocks%vertices(2, :))
      survey%y_max = maxval(blocks%vertices(2, :))
      survey%smallest_area = huge(1.0_wp)
      allocate (survey%joint_length(size(parameters%joint_materials)), source=0.0_wp)
      allocate (survey%blocks_of(size(parameters%block_materials)), source=0)
      do i = 1, blocks%n_blocks
         call add_block(blocks, i, survey)
         survey%unit_weight = max(survey%unit_weight, unit_weight_of(parameters, blocks%block_material(i)))
      end do
      survey%mean_area = survey%area/blocks%n_blocks
      survey%mean_edge = survey%mean_edge/blocks%n_vertices()
      survey%base_stress = survey%unit_weight*(survey%y_max - survey%y_min)
      if (.not. allocated(parameters%in_situ)) return
      surcharge = 0
      do i = 1, size(parameters%in_situ)
         if (is_set(parameters%in_situ(i)%surcharge)) surcharge = max(surcharge, parameters%in_situ(i)%surcharge)
      end do
      survey%base_stress = survey%base_stress + surcharge
   end function survey_model

   !> Add one block to a survey.
   pure subroutine add_block(blocks, i, survey)
      type(block_system_type), intent(in) :: blocks
      integer, intent(in) :: i
      type(survey_type), intent(inout) :: survey
      real(wp) :: area, a(2), b(2), length, angle
      integer :: k, n, before, after, joint
      associate (v => blocks%vertices(:, blocks%vertex_offset(i) + 1:blocks%vertex_offset(i + 1)))
         n = size(v, 2)
         area = polygon_area(v)
         survey%area = survey%area + area
         survey%largest_area = max(survey%largest_area, area)
         survey%blocks_of(blocks%block_material(i)) = survey%blocks_of(blocks%block_material(i)) + 1
         if (area < survey%smallest_area) then
            survey%smallest_area = area
            survey%smallest_block = i
            survey%smallest_place = sum(v, dim=2)/n
         end if
         do k = 1, n
            before = modulo(k - 2, n) + 1
            after = modulo(k, n) + 1
            a = v(:, after) - v(:, k)
            b = v(:, before) - v(:, k)
            length = norm2(a)
            survey%shortest_edge = min(survey%shortest_edge, length)
            survey%mean_edge = survey%mean_edge + length
            joint = blocks%edge_joint(blocks%vertex_offset(i) + k)
            if (joint > 0) survey%joint_length(joint) = survey%joint_length(joint) + length
            ! of bridges to islands both directions count as edges; their corners are no corners
            if (joint == 0 .or. blocks%edge_joint(blocks%vertex_offset(i) + before) == 0) cycle
            angle = modulo(atan2(a(1)*b(2) - a(2)*b(1), dot_product(a, b))*180/pi, 360.0_wp)
            if (angle >= survey%smallest_angle) cycle
            survey%smallest_angle = angle
            survey%angle_block = i
            survey%angle_place = v(:, k)
         end do
      end associate
   end subroutine add_block

   !> Weight per area of a block material, down.
   pure real(wp) function unit_weight_of(parameters, material)
      type(parameters_type), intent(in) :: parameters
      integer, intent(in) :: material
      unit_weight_of = parameters%block_materials(material)%weight
      if (parameters%gravity >= 0) unit_weight_of = parameters%gravity*parameters%block_materials(material)%density
   end function unit_weight_of

   !> Shear strength of a joint by Mohr and Coulomb, of its peak, under a pressure.
   pure real(wp) function joint_strength(joint, pressure)
      type(joint_material_type), intent(in) :: joint
      real(wp), intent(in) :: pressure           !! > 0 in compression
      joint_strength = joint%cohesion + max(pressure, 0.0_wp)*tan(joint%friction_angle*pi/180)
   end function joint_strength

end module rockdda_model_survey
