! SPDX-License-Identifier: MIT
!> Loads along a segment on the outline of a block.
module rockdda_interaction_line_loads
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_base_strings, only : to_string
   use rockdda_geometry_polygons, only : distance_to_outline
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_interaction_finite_rotation, only : moving_block_type, mean_load
   implicit none
   private
   public :: line_load, find_carriers

contains

   !> Load of a force per length along a segment, linear between its ends (Eq. 3.8.1; its
   !> potential, Eq. 3.8, is the negative of this load times d), integrated exactly:
   !> T and the force are both linear along the segment, so that the integral of their product over the length
   !> l is l (T_s^T (2 f_s + f_q) + T_q^T (f_s + 2 f_q))/6.
   pure function line_load(s, q, block, force_s, force_q) result(f)
      real(wp), intent(in) :: s(2), q(2)    !! ends of the segment [length]
      type(moving_block_type), intent(in) :: block
      real(wp), intent(in) :: force_s(2)    !! (fx, fy) at s [force/length]
      real(wp), intent(in) :: force_q(2)    !! (fx, fy) at q [force/length]
      real(wp) :: f(6)                      !! load
      real(wp) :: l
      l = norm2(q - s)
      f = mean_load(l/6*(2*force_s + force_q), s, block) + mean_load(l/6*(force_s + 2*force_q), q, block)
   end function line_load

   !> Block that carries each line load: both ends within e0 of its outline. Error: there is none.
   subroutine find_carriers(blocks, parameters, carriers, messages)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      integer, intent(out) :: carriers(:)               !! (line loads)
      type(diagnostics_type), intent(inout) :: messages
      real(wp) :: tolerance, ends(4)
      integer :: l, i, first, last
      tolerance = max(blocks%edge_node_distance, 1.0e-9_wp*parameters%w0)
      do l = 1, size(carriers)
         ends = parameters%line_loads(l)%ends
         carriers(l) = 0
         do i = 1, blocks%n_blocks
            first = blocks%vertex_offset(i) + 1
            last = blocks%vertex_offset(i + 1)
            if (distance_to_outline(ends(1:2), blocks%vertices(:, first:last)) > tolerance) cycle
            if (distance_to_outline(ends(3:4), blocks%vertices(:, first:last)) > tolerance) cycle
            carriers(l) = i
            exit
         end do
         if (carriers(l) == 0) call messages%add(severity%error, 'line load '//to_string(l)// &
            ': no block has both ends ('//to_string(ends(1))//', '//to_string(ends(2))//') and ('// &
            to_string(ends(3))//', '//to_string(ends(4))//") on its outline; &boundary kind = 'traction' loads the "// &
            'edges of several blocks', parameters%line_loads(l)%origin)
      end do
   end subroutine find_carriers

end module rockdda_interaction_line_loads
