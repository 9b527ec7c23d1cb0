! SPDX-License-Identifier: MIT
!> The rule for contact stiffness (g0), time step (g1) and displacement ratio (g2): docs/contact-numbers.md.
!>
!> A face between two blocks has two contacts of stiffness g0, so that a joint of normal stiffness k_n per area is
!> modelled with g0 = k_n L/2, L the mean length of edges. All numbers that the program advises on come from here.
module rockdda_model_contact_numbers
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : to_string
   use rockdda_model_blocks, only : block_system_type
   implicit none
   private
   public :: automatic_over_e, preset_over_e, highest_over_e, far_over_e, highest_omega
   public :: mean_edge, advised_time_step, advised_step, advised_ratio, largest_ratio, stiffness_advice

   !> Automatic contact stiffness over the largest E: a closed joint of length L then has k_n = 2 E/L, as tight joints
   !> in hard rock have, and is compressed half as much as a square block of side L.
   real(wp), parameter :: automatic_over_e = 1.0_wp
   !> The same with the preset dda_windows, as DDA for Windows begins.
   real(wp), parameter :: preset_over_e = 50.0_wp
   !> Beyond this multiple of E displacements hardly change, but steps are cut.
   real(wp), parameter :: highest_over_e = 10.0_wp
   !> Beyond this multiple of E a warning is given.
   real(wp), parameter :: far_over_e = 100.0_wp
   !> Largest advised dt sqrt(2 g0/m), m the mass of a square block with the mean edge.
   real(wp), parameter :: highest_omega = 10.0_wp
   !> Advised displacement of a step over the mean length of edges, and upper limit of the ratio g2 itself.
   real(wp), parameter :: share_of_edge = 0.02_wp, largest_ratio = 0.01_wp

contains

   !> Mean length of the edges of all blocks; 0 without blocks.
   pure real(wp) function mean_edge(blocks)
      type(block_system_type), intent(in) :: blocks
      integer :: i, v, next
      mean_edge = 0
      if (blocks%n_vertices() == 0) return
      do i = 1, blocks%n_blocks
         do v = blocks%vertex_offset(i) + 1, blocks%vertex_offset(i + 1)
            next = v + 1
            if (next > blocks%vertex_offset(i + 1)) next = blocks%vertex_offset(i) + 1
            mean_edge = mean_edge + norm2(blocks%vertices(:, next) - blocks%vertices(:, v))
         end do
      end do
      mean_edge = mean_edge/blocks%n_vertices()
   end function mean_edge

   !> The longest advised time step, for springs of this stiffness.
   pure real(wp) function advised_time_step(edge, density, stiffness)
      real(wp), intent(in) :: edge        !! mean length of edges [length]
      real(wp), intent(in) :: density, stiffness
      advised_time_step = highest_omega*edge*sqrt(density/(2*stiffness))
   end function advised_time_step

   !> The same for joints of this normal stiffness per length.
   pure real(wp) function advised_step(edge, density, k_n)
      real(wp), intent(in) :: edge        !! mean length of edges [length]
      real(wp), intent(in) :: density     !! mass per area
      real(wp), intent(in) :: k_n         !! stress/length
      advised_step = advised_time_step(edge, density, 0.5_wp*k_n*edge)
   end function advised_step

   !> The advised g2, for edges of this mean length in a model of the length scale w0.
   pure real(wp) function advised_ratio(edge, w0)
      real(wp), intent(in) :: edge, w0   !! [length]
      advised_ratio = largest_ratio
      if (w0 > 0) advised_ratio = min(largest_ratio, share_of_edge*edge/w0)
   end function advised_ratio

   !> The rule for g0, to end a message with.
   pure function stiffness_advice() result(text)
      character(len=:), allocatable :: text
      text = 'take half the joint stiffness times the edge length, or E (g0 = 0), at most '// &
             to_string(nint(highest_over_e))//' E'
   end function stiffness_advice

end module rockdda_model_contact_numbers
