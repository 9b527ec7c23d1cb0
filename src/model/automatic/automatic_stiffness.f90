! SPDX-License-Identifier: MIT
!> Stiffness of joints whose material has none, from the two blocks that meet: docs/contact-numbers.md.
!>
!> With E the harmonic mean of their moduli and h the square root of the smaller area, a joint has per length
!>
!>     k = 2 E/h
!>
!> so that it closes by half of what the smaller block is compressed. How much of a large block is drawn changes
!> nothing: stress spreads in it within the size of the smaller one.
!>
!> times the `stiffening` of the parameters, which is 1 but in a search for the load that a model carries.
!>
!> A slender block that stands free, of height H, base b and weight W, leans by theta before it falls. Its weight bears
!> on its base at the share 9 (W/(k b^2 theta))^2 from the edge (rockdda_contact_interval_law, far open), so that it
!> falls at a tilt that is smaller than that of a rigid block by the least share that both take,
!>
!>     3/2 (6 W H/(k b^3))^(2/3)
!>
!> The stiffness of its joints is as large as keeps that within `lost_tilt`, but not above 200 E/b. In jointed rock,
!> where neighbours hold slender blocks, it would only cost rounds.
module rockdda_model_automatic_stiffness
   use rockdda_base_kinds, only : wp
   use rockdda_geometry_polygons, only : polygon_properties
   use rockdda_model_analysis_input, only : block_material_type
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_contact_numbers, only : automatic_over_e, far_over_e
   use rockdda_model_parameters, only : parameters_type
   implicit none
   private
   public :: stiffening_type, all_stiffenings, stiffness_between, stiffness_range

   !> Share of the tilt of a rigid block at which it falls that the joint below it may take.
   real(wp), parameter, public :: lost_tilt = 0.01_wp
   !> Height over base from which a block falls before it slides, with friction of 30 degrees.
   real(wp), parameter :: slender = 1.75_wp
   !> Blocks within this share of a block's base are its neighbours.
   real(wp), parameter :: beside = 0.01_wp

   !> What a block gives to the stiffness of its joints.
   type :: stiffening_type
      real(wp) :: modulus = 1    !! E [force/length^2]
      real(wp) :: size = 1       !! [length]
      real(wp) :: stands = 0     !! stiffness that it has standing free, 0: it does not [force/length^3]
      real(wp) :: lost = 0       !! share of the tilt that it has then
   end type stiffening_type

contains

   !> Of all blocks, with the materials that they have now.
   pure function all_stiffenings(blocks, parameters) result(all)
      type(block_system_type), intent(in) :: blocks     !! at the start
      type(parameters_type), intent(in) :: parameters
      type(stiffening_type) :: all(blocks%n_blocks)
      real(wp) :: box(4, blocks%n_blocks)               !! xmin ymin xmax ymax
      real(wp) :: area, centroid(2), moments(3)
      integer :: i
      do i = 1, blocks%n_blocks
         associate (v => blocks%vertices(:, blocks%vertex_offset(i) + 1:blocks%vertex_offset(i + 1)))
            box(:, i) = [minval(v, dim=2), maxval(v, dim=2)]
         end associate
      end do
      do i = 1, blocks%n_blocks
         call polygon_properties(blocks%vertices(:, blocks%vertex_offset(i) + 1:blocks%vertex_offset(i + 1)), &
                                 area, centroid, moments)
         associate (material => parameters%block_materials(blocks%block_material(i)))
            all(i) = stiffening_type(modulus=material%youngs_modulus, size=sqrt(area)/parameters%stiffening)
            if (stands_free(i, box)) call stand(material, parameters%gravity, area, moments, all(i))
         end associate
      end do
   end function all_stiffenings

   !> Is a block higher than broad, with no other one beside or above its upper half?
   pure logical function stands_free(block, box)
      integer, intent(in) :: block
      real(wp), intent(in) :: box(:, :)
      real(wp) :: wide(4)
      integer :: i
      wide = box(:, block)
      stands_free = wide(4) - wide(2) > slender*(wide(3) - wide(1))
      if (.not. stands_free) return
      wide(2) = 0.5_wp*(wide(2) + wide(4))
      wide = wide + beside*(wide(3) - wide(1))*[-1, 0, 1, 1]
      do i = 1, size(box, 2)
         if (i == block) cycle
         stands_free = any(box(1:2, i) > wide(3:4)) .or. any(box(3:4, i) < wide(1:2))
         if (.not. stands_free) return
      end do
   end function stands_free

   !> What a block has that stands free.
   pure subroutine stand(material, gravity, area, moments, self)
      type(block_material_type), intent(in) :: material
      real(wp), intent(in) :: gravity                   !! < 0: from the weight of the material
      real(wp), intent(in) :: area                      !! [length^2]
      real(wp), intent(in) :: moments(3)                !! of polygon_properties [length^4]
      type(stiffening_type), intent(inout) :: self
      real(wp) :: extent(2), weight, turning
      ! of the rectangle with the same area and moments
      extent = sqrt(12*moments(1:2)/area)
      weight = abs(material%weight)
      if (gravity >= 0) weight = material%density*gravity
      if (.not. weight > 0) return
      weight = weight*area
      turning = 6*weight*extent(2)/extent(1)**3
      self%stands = min(turning*(1.5_wp/lost_tilt)**1.5_wp, far_over_e*self%modulus/extent(1))
      self%lost = 1.5_wp*(turning/self%stands)**(2/3.0_wp)
   end subroutine stand

   !> Normal stiffness per length of a joint between two blocks.
   pure real(wp) function stiffness_between(a, b) result(k)
      type(stiffening_type), intent(in) :: a, b
      k = max(automatic_over_e*2*a%modulus*b%modulus/((a%modulus + b%modulus)*min(a%size, b%size)), a%stands, b%stands)
   end function stiffness_between

   !> The least and the largest stiffness of joints between two blocks of one kind.
   pure function stiffness_range(stiffenings) result(range)
      type(stiffening_type), intent(in) :: stiffenings(:)
      real(wp) :: range(2)
      real(wp) :: k
      integer :: i
      range = [huge(1.0_wp), 0.0_wp]
      do i = 1, size(stiffenings)
         k = stiffness_between(stiffenings(i), stiffenings(i))
         range = [min(range(1), k), max(range(2), k)]
      end do
   end function stiffness_range

end module rockdda_model_automatic_stiffness
