! SPDX-License-Identifier: MIT
!> Stiffness of the springs that hold a block: so many times that of the stiffest contact that it can have.
module rockdda_interaction_support_stiffness
   use rockdda_base_kinds, only : wp
   use rockdda_geometry_polygons, only : polygon_properties
   use rockdda_geometry_segments, only : distance_to_segment
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_interaction_contact_stiffness, only : set_stiffness
   use rockdda_interaction_ties, only : tie_stiffness
   implicit none
   private
   public :: support_stiffness

contains

   !> With contacts of vertices on edges that is the contact stiffness of the run. By length it is that of a joint along
   !> the longest or stiffest of the block's edges, or of its ties.
   pure real(wp) function support_stiffness(blocks, parameters, block) result(stiffness)
      type(block_system_type), intent(in) :: blocks       !! at the start
      type(parameters_type), intent(in) :: parameters
      integer, intent(in) :: block
      real(wp) :: along(2), distance, largest, length, k_n, k_s, area, centroid(2), moments(3)
      integer :: first, last, v, next
      stiffness = parameters%fixed_stiffness
      if (.not. parameters%by_length) return
      first = blocks%vertex_offset(block) + 1
      last = blocks%vertex_offset(block + 1)
      call polygon_properties(blocks%vertices(:, first:last), area, centroid, moments)
      largest = 0
      do v = first, last
         if (blocks%edge_joint(v) == 0) cycle
         next = merge(first, v + 1, v == last)
         along = blocks%vertices(:, next) - blocks%vertices(:, v)
         length = norm2(along)
         ! from the edge, not from its line: that of an edge of an opening may pass through the centroid
         distance = distance_to_segment(centroid, blocks%vertices(:, v), blocks%vertices(:, next))
         associate (material => parameters%joint_materials(blocks%edge_joint(v)))
            call set_stiffness(parameters, material, length, k_n, k_s)
            ! automatic, by its size: of the largest E, which no stage changes
            if (.not. k_n > 0) k_n = parameters%normal_stiffness/sqrt(area)*length
            largest = max(largest, k_n)
            ! to a block like it
            if (material%tie) largest = max(largest, tie_stiffness(length, 2*distance/ &
               parameters%block_materials(blocks%block_material(block))%youngs_modulus))
         end associate
      end do
      if (largest > 0) stiffness = parameters%fixed_stiffness/parameters%normal_stiffness*largest
   end function support_stiffness

end module rockdda_interaction_support_stiffness
