! SPDX-License-Identifier: MIT
!> The rule for contact stiffness (g0), time step (g1) and displacement ratio (g2): docs/contact-numbers.md.
!>
!> A joint of mean length L and normal stiffness k_n per area has k_n L in all: by length, g0 = k_n L; with formulation
!> 'vertex' two contacts of g0 each, so that g0 = k_n L/2. All numbers that the program advises on come from here.
module rockdda_model_contact_numbers
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : to_string
   use rockdda_model_blocks, only : block_system_type
   implicit none
   private
   public :: automatic_over_e, preset_over_e, highest_over_e, far_over_e, highest_omega
   public :: mean_edge, springs_of_joint, advised_time_step, advised_step, advised_ratio, largest_ratio, &
      stiffness_advice

   !> Automatic stiffness of a joint of mean length over the largest E: k_n = 2 E/L, as tight joints in hard rock have;
   !> a joint is compressed half as much as a square block of side L.
   real(wp), parameter :: automatic_over_e = 2.0_wp
   !> Automatic g0 over the largest E with the preset dda_windows, as DDA for Windows begins.
   real(wp), parameter :: preset_over_e = 50.0_wp
   !> Joints stiffer than this multiple of E hardly change displacements, but steps are cut.
   real(wp), parameter :: highest_over_e = 20.0_wp
   !> Beyond this multiple of E a warning is given.
   real(wp), parameter :: far_over_e = 200.0_wp
   !> Largest advised dt sqrt(k/m), k the stiffness of a joint, m the mass of a square block with the mean edge.
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

   !> How many springs of g0 a joint of mean length has.
   pure real(wp) function springs_of_joint(by_length)
      logical, intent(in) :: by_length   !! formulation 'length'
      springs_of_joint = merge(1.0_wp, 2.0_wp, by_length)
   end function springs_of_joint

   !> The longest advised time step, for joints of this stiffness.
   pure real(wp) function advised_time_step(edge, density, stiffness)
      real(wp), intent(in) :: edge        !! mean length of edges [length]
      real(wp), intent(in) :: density
      real(wp), intent(in) :: stiffness   !! of a joint of mean length [force/length]
      advised_time_step = highest_omega*edge*sqrt(density/stiffness)
   end function advised_time_step

   !> The same for joints of this normal stiffness per length.
   pure real(wp) function advised_step(edge, density, k_n)
      real(wp), intent(in) :: edge        !! mean length of edges [length]
      real(wp), intent(in) :: density     !! mass per area
      real(wp), intent(in) :: k_n         !! stress/length
      advised_step = advised_time_step(edge, density, k_n*edge)
   end function advised_step

   !> The advised g2, for edges of this mean length in a model of the length scale w0.
   pure real(wp) function advised_ratio(edge, w0)
      real(wp), intent(in) :: edge, w0   !! [length]
      advised_ratio = largest_ratio
      if (w0 > 0) advised_ratio = min(largest_ratio, share_of_edge*edge/w0)
   end function advised_ratio

   !> The rule for g0, to end a message with.
   pure function stiffness_advice(by_length) result(text)
      logical, intent(in) :: by_length   !! formulation 'length'
      character(len=:), allocatable :: text
      character(len=:), allocatable :: share
      share = 'half '
      if (by_length) share = ''
      text = 'take '//share//'the joint stiffness times the edge length, or '// &
             multiple_of_e(automatic_over_e)//' (g0 = 0), at most '//multiple_of_e(highest_over_e)

   contains

      !> Such a multiple of E for all springs of a joint, as g0.
      pure function multiple_of_e(ratio) result(words)
         real(wp), intent(in) :: ratio
         character(len=:), allocatable :: words
         words = 'E'
         if (nint(ratio/springs_of_joint(by_length)) /= 1) &
            words = to_string(nint(ratio/springs_of_joint(by_length)))//' E'
      end function multiple_of_e
   end function stiffness_advice

end module rockdda_model_contact_numbers
