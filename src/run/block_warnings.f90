! SPDX-License-Identifier: MIT
!> Warnings about blocks at the end of a step: those that stand inside each other, large strains, and linings that have
!> slid far.
module rockdda_run_block_warnings
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : counted, to_string
   use rockdda_interaction_elasticity, only : compliance
   use rockdda_stepping_simulation, only : simulation_type
   implicit none
   private
   public :: lodged_warning, strain_warning, slid_lining_warning, sheared_lining_warning, peaked_lining_warning

   !> Largest strain that linear elasticity is meant for.
   real(wp), parameter :: much_strain = 0.05_wp
   !> Slip over the length of an element at which a lining is no longer beside the rock that it was installed on.
   real(wp), parameter :: far_slid = 0.5_wp
   !> Largest number of pairs named in one message.
   integer, parameter :: most_named = 3

contains

   !> Warning about pairs of blocks that stand inside each other, in the step in which they are found; '' for none.
   function lodged_warning(sim) result(text)
      type(simulation_type), intent(in) :: sim
      character(len=:), allocatable :: text
      integer :: k
      text = ''
      if (size(sim%construction%lodging%found) == 0) return
      associate (pairs => sim%construction%lodging%found)
         do k = 1, min(size(pairs), most_named)
            if (k > 1) text = text//', '
            text = text//'blocks '//to_string(pairs(k)%blocks(1))//' and '//to_string(pairs(k)%blocks(2))//' at '// &
                   at(pairs(k)%place + sim%state%datum)//' by '//sim%parameters%shown(pairs(k)%depth, 'length', 3)// &
                   ' ('//to_string(100*pairs(k)%share, 2)//' % of the inradius of the smaller one)'
         end do
         if (size(pairs) > most_named) text = text//' and '//counted(size(pairs) - most_named, 'more pair')
         text = 'blocks stand inside each other after step '//to_string(sim%state%step)//', time '// &
                sim%parameters%shown(sim%state%time, 'time', 6)//': '//text// &
                '. What follows is not to be trusted: take shorter steps '// &
                '(dt_max, displacement_ratio) or stiffer joints, and look at blocks that are placed or struck'
      end associate
   end function lodged_warning

   !> Warning about the lining that has slid farthest along its rock, where that is more than half of the length of its
   !> elements; '' for none. Its back is held where it was installed: beyond that its ends carry moments that are not
   !> there, and rock that it comes beside does not meet it.
   function slid_lining_warning(sim) result(text)
      type(simulation_type), intent(in) :: sim
      character(len=:), allocatable :: text
      real(wp) :: slid, element, worst
      integer :: k
      text = ''
      worst = far_slid
      associate (liners => sim%families%liners%liners)
         do k = 1, size(liners)
            if (.not. (liners(k)%is_there .and. liners(k)%joint > 0)) cycle
            if (size(liners(k)%ties) == 0) cycle
            element = sum(liners(k)%ties%length)/max(1, liners(k)%layout%n)
            slid = maxval(abs(liners(k)%ties%free(2)), mask=liners(k)%ties%a > 0)
            if (.not. slid > worst*element) cycle
            worst = slid/element
            text = "lining '"//liners(k)%name//"' has slid by "//sim%parameters%shown(slid, 'length', 3)// &
                   ' along its rock, more than half of an element ('//sim%parameters%shown(element, 'length', 3)// &
                   '): its N, M and Q are not to be trusted, and rock that it has come beside does not meet it'
         end do
      end associate
   end function slid_lining_warning

   !> Warning about linings whose mean shear stress is beyond their tensile strength; '' for none. Sections are
   !> limited in N and M alone, and blocks that hang on one are cut out of it by shear.
   function sheared_lining_warning(sim) result(text)
      type(simulation_type), intent(in) :: sim
      character(len=:), allocatable :: text
      real(wp) :: shear
      integer :: k
      text = ''
      do k = 1, size(sim%families%liners%liners)
         shear = sim%families%liners%shear_stress(k)
         associate (liner => sim%families%liners%liners(k))
            if (.not. shear > liner%section%tension) cycle
            text = "lining '"//liner%name//"' has a mean shear stress of "// &
                   sim%parameters%shown(shear, 'stress', 3)// &
                   ', more than its tensile strength ('// &
                   sim%parameters%shown(liner%section%tension, 'stress', 3)// &
                   '): N and M limit its sections, shear does not; check it for blocks that are cut out'
            return
         end associate
      end do
   end function sheared_lining_warning

   !> Warning about linings whose largest axial force, by more than half of it, is that of one element alone; '' for
   !> none. A back that is held without slip takes what a joint of the rock opens or closes on a part of a thickness:
   !> shorter elements make the force larger.
   function peaked_lining_warning(sim) result(text)
      type(simulation_type), intent(in) :: sim
      character(len=:), allocatable :: text
      real(wp) :: peak, beside, largest
      integer :: k
      text = ''
      do k = 1, size(sim%families%liners%liners)
         call sim%families%liners%find_peak(k, peak, beside, largest)
         if (.not. peak - beside > 0.5_wp*largest) cycle
         text = "lining '"//sim%families%liners%liners(k)%name//"' has an axial force of "// &
                sim%parameters%shown(peak, 'thrust', 3)//' in one element, of '// &
                sim%parameters%shown(beside, 'thrust', 3)//' beside it: joints of the rock move below a back that '// &
                'is held without slip, and shorter elements (element) make it larger. Give it a joint_material '// &
                'with the stiffness and strength of its bond'
         return
      end do
   end function peaked_lining_warning

   !> Warning about the block of largest strain; '' when linear elasticity holds.
   function strain_warning(sim) result(text)
      type(simulation_type), intent(in) :: sim
      character(len=:), allocatable :: text
      real(wp), allocatable :: c(:, :, :)
      real(wp) :: e(3), strain, largest
      integer :: i, block
      text = ''
      associate (p => sim%parameters, state => sim%state)
         allocate (c(3, 3, size(p%block_materials)))
         do i = 1, size(p%block_materials)
            c(:, :, i) = compliance(p%block_materials(i)%youngs_modulus, p%block_materials(i)%poisson_ratio, &
                                    p%plane_strain)
         end do
         largest = much_strain
         block = 0
         do i = 1, sim%blocks%n_blocks - sim%blocks%n_segments
            if (.not. state%active(i)) cycle
            e = matmul(c(:, :, sim%blocks%block_material(i)), state%stress(:, i))
            strain = 0.5_wp*(abs(e(1) + e(2)) + sqrt((e(1) - e(2))**2 + e(3)**2))
            if (.not. strain > largest) cycle
            largest = strain
            block = i
         end do
         if (block == 0) return
         text = 'block '//to_string(block)//' at '//at(state%centroid(:, block) + state%datum)//' is strained by '// &
                to_string(100*largest, 2)//' % after step '//to_string(state%step)//', time '// &
                sim%parameters%shown(state%time, 'time', 6)//': blocks are linear elastic, which holds up to about '// &
                to_string(nint(100*much_strain))//' %; are E, density and loads in units that fit together?'
      end associate
   end function strain_warning

   !> A place as text.
   pure function at(place) result(text)
      real(wp), intent(in) :: place(2)
      character(len=:), allocatable :: text
      text = '('//to_string(place(1), 5)//', '//to_string(place(2), 5)//')'
   end function at

end module rockdda_run_block_warnings
