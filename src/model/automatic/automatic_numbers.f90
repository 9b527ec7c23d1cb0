! SPDX-License-Identifier: MIT
!> Numbers that a labelled file may leave out: contact stiffness, time step and displacement ratio that suit the model,
!> each with a note that gives the reason. The rules are in docs/contact-numbers.md.
!>
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
module rockdda_model_automatic_numbers
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_base_strings, only : to_string, counted
   use rockdda_geometry_polygons, only : polygon_area, polygon_properties
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_contact_numbers, only : mean_edge, advised_ratio, advised_step, automatic_over_e, &
      springs_of_joint, far_over_e
   use rockdda_model_options, only : run_options_type, is_set
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_units, only : unit_system_type, unit_system
   use rockdda_model_analysis_input, only : block_material_type
   implicit none
   private
   public :: choose_numbers, stiffening_type, all_stiffenings, stiffness_between, stiffness_range

   !> Share of the time in which a block falls by its own size that a step takes at most.
   real(wp), parameter :: share_of_fall = 0.01_wp
   !> Numbers beyond this, and below its inverse, come from moduli or densities that no unit explains.
   real(wp), parameter :: most_sensible = 1.0e30_wp
   !> Factor of the time step where all of the run is static.
   real(wp), parameter :: static_factor = 4.0_wp

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

   !> Choose what the options do not give.
   subroutine choose_numbers(blocks, options, parameters, messages)
      type(block_system_type), intent(in) :: blocks
      type(run_options_type), intent(in) :: options
      type(parameters_type), intent(inout) :: parameters   !! with materials, w0 and all that the options give
      type(diagnostics_type), intent(inout) :: messages
      real(wp) :: edge
      type(unit_system_type) :: u
      u = unit_system(parameters%units)
      edge = max(mean_edge(blocks), tiny(1.0_wp))
      if (.not. is_set(options%displacement_ratio)) then
         parameters%displacement_ratio = advised_ratio(edge, parameters%w0)
         call messages%add(severity%note, 'displacement ratio (g2) is automatic: '// &
            to_string(parameters%displacement_ratio, 4)//', the smaller of 0.01 and 0.02 mean edges of '// &
            u%shown(edge, 'length')//' over w0 = '//u%shown(parameters%w0, 'length')// &
            ': a block moves by at most '//u%shown(parameters%displacement_ratio*parameters%w0, 'length')// &
            ' in a step')
      end if
      if (.not. is_set(options%stiffness)) call choose_stiffness()
      if (.not. is_set(options%dt_max)) call choose_step()
      if (parameters%sliding_damping > 0 .and. .not. is_set(options%sliding_damping) .and. &
          .not. all_static(parameters) .and. any(.not. parameters%joint_materials%damping_ratio > 0)) &
         call messages%add(severity%note, 'contacts that slide in dynamic stages have '// &
            to_string(parameters%sliding_damping, 2)//' of critical damping (sliding_damping), where their '// &
            'joint has no damping_ratio: undamped, they slide further with shorter steps')
      if (.not. all_static(parameters) .and. .not. all(is_set(parameters%joint_materials%restitution))) &
         call messages%add(severity%note, 'blocks that strike each other in dynamic stages rebound by the springs '// &
            'of joints without restitution, by a speed that depends on the time step')

   contains

      !> Contact stiffness of joints without a stiffness of their own, and of fixed points: from E, or from the joint
      !> materials where all that are used have their own.
      subroutine choose_stiffness()
         character(len=:), allocatable :: reason
         logical, allocatable :: used(:)
         type(stiffening_type), allocatable :: stiffenings(:)
         real(wp) :: e_max, k_n
         type(unit_system_type) :: u
         integer :: i
         u = unit_system(parameters%units)
         allocate (used(size(parameters%joint_materials)))
         used = [(any(blocks%edge_joint == i), i=1, size(used))]
         e_max = maxval(parameters%block_materials(blocks%block_material)%youngs_modulus)
         k_n = 0
         if (any(used)) then
            if (all(parameters%joint_materials%normal_stiffness > 0 .or. .not. used)) &
               k_n = maxval(parameters%joint_materials%normal_stiffness, mask=used)
         end if
         if (k_n > 0 .and. parameters%by_length) then
            parameters%normal_stiffness = k_n*edge
            reason = 'the largest normal stiffness of the joints, '// &
                     u%shown(k_n, 'stress/length')//', times the mean edge of '//u%shown(edge, 'length')// &
                     '; it holds fixed points, joints have their own'
         else if (parameters%by_length) then
            stiffenings = all_stiffenings(blocks, parameters)
            parameters%normal_stiffness = automatic_over_e*e_max
            reason = 'twice the largest E of the blocks; '//range_text(stiffenings, u)
         else
            parameters%normal_stiffness = automatic_over_e/springs_of_joint(.false.)*e_max
            reason = 'the largest E of the blocks, at both ends of a joint, so that it closes by half of what the '// &
                     'block behind it is compressed'
         end if
         if (.not. is_sensible(parameters%normal_stiffness)) then
            call messages%add(severity%error, 'contact stiffness (g0) cannot be automatic: it would be '// &
                              u%shown(parameters%normal_stiffness, 'force/length')//', '//reason// &
                              '; check Young''s moduli', &
                              options%model_origin)
            return
         end if
         call messages%add(severity%note, 'contact stiffness (g0) is automatic: '// &
                           u%shown(parameters%normal_stiffness, 'force/length')//', '//reason)
         if (allocated(stiffenings)) call report_soft_stands(stiffenings)
      end subroutine choose_stiffness

      !> Largest time step: from the time in which a block swings on its joints, and the time in which it falls by
      !> its size.
      subroutine choose_step()
         character(len=:), allocatable :: reason
         real(wp) :: density, k_n, acceleration, fall, area, mass, a
         type(unit_system_type) :: u
         integer :: i
         u = unit_system(parameters%units)
         area = 0
         mass = 0
         acceleration = 0
         do i = 1, blocks%n_blocks
            associate (m => parameters%block_materials(blocks%block_material(i)))
               a = polygon_area(blocks%vertices(:, blocks%vertex_offset(i) + 1:blocks%vertex_offset(i + 1)))
               area = area + a
               mass = mass + a*m%density
               acceleration = max(acceleration, abs(m%weight)/m%density)
            end associate
         end do
         if (parameters%gravity >= 0) acceleration = parameters%gravity
         density = mass/area
         k_n = stiffest_joint()
         parameters%dt_max = advised_step(edge, density, k_n)
         reason = '10 times the time sqrt(density L/k_n) in which a block of the mean edge L = '// &
                  u%shown(edge, 'length')//' swings on joints of k_n = '//u%shown(k_n, 'stress/length')
         if (all_static(parameters)) then
            parameters%dt_max = static_factor*parameters%dt_max
            reason = to_string(nint(static_factor))//' (static) times '//reason
         end if
         if (acceleration > 0) then
            fall = share_of_fall*sqrt(2*edge/acceleration)
            if (fall < parameters%dt_max .and. .not. all_static(parameters)) then
               parameters%dt_max = fall
               reason = '1 % of the time in which a block falls by the mean edge '//u%shown(edge, 'length')
            end if
         end if
         if (.not. is_sensible(parameters%dt_max)) then
            call messages%add(severity%error, 'time step (dt_max) cannot be automatic: it would be '// &
                              u%shown(parameters%dt_max, 'time')//', '//reason//'; check Young''s moduli and '// &
                              'densities', options%model_origin)
            return
         end if
         call messages%add(severity%note, 'time step (dt_max) is automatic: '//u%shown(parameters%dt_max, 'time')// &
                           ', '//reason)
      end subroutine choose_step

      !> Largest normal stiffness per length of the joints that are used.
      pure real(wp) function stiffest_joint() result(k_n)
         real(wp) :: of_run
         integer :: i
         of_run = springs_of_joint(parameters%by_length)*parameters%normal_stiffness/edge
         k_n = 0
         do i = 1, size(parameters%joint_materials)
            if (.not. any(blocks%edge_joint == i)) cycle
            associate (own => parameters%joint_materials(i)%normal_stiffness)
               k_n = max(k_n, merge(own, of_run, own > 0 .and. parameters%by_length))
            end associate
         end do
         if (.not. k_n > 0) k_n = of_run
      end function stiffest_joint

      !> Blocks that stand so heavily on joints of this stiffness that it decides when they fall.
      subroutine report_soft_stands(stiffenings)
         type(stiffening_type), intent(in) :: stiffenings(:)   !! of all blocks
         integer :: i
         i = maxloc(stiffenings%lost, dim=1)
         if (.not. stiffenings(i)%lost > 1.001_wp*lost_tilt) return
         call messages%add(severity%warning, 'block '//to_string(i)//' is so slender and heavy that the automatic '// &
            'stiffness of its joints decides when it falls: at about '// &
            to_string(100*min(1.0_wp, stiffenings(i)%lost), 2)// &
            ' % less tilt than a rigid block ('//counted(count(stiffenings%lost > 1.001_wp*lost_tilt), 'block')// &
            ' by more than '//to_string(100*lost_tilt, 2)//' %); give stiffness where that matters')
      end subroutine report_soft_stands

   end subroutine choose_numbers

   !> What joints without a stiffness of their own have, from the least to the most of the blocks.
   pure function range_text(stiffenings, u) result(text)
      type(stiffening_type), intent(in) :: stiffenings(:)   !! of all blocks
      type(unit_system_type), intent(in) :: u
      character(len=:), allocatable :: text
      real(wp) :: range(2)
      range = stiffness_range(stiffenings)
      text = 'joints without normal_stiffness have '//u%shown(range(1), 'stress/length')
      if (range(2) > range(1)) text = text//' to '//u%shown(range(2), 'stress/length')
      text = text//trim(merge('           ', ' per length', u%is_known()))// &
             ', by the blocks that meet: 2 E over the square root of the smaller area, '// &
             'more where a slender block stands free'
   end function range_text

   !> Is this number one that some units explain?
   pure logical function is_sensible(number)
      real(wp), intent(in) :: number
      is_sensible = number < most_sensible .and. number > 1/most_sensible
   end function is_sensible

   !> Is k01 0 all the time?
   pure logical function all_static(parameters)
      type(parameters_type), intent(in) :: parameters
      integer :: i
      all_static = .not. parameters%k01 > 0
      do i = 1, size(parameters%stages)
         if (is_set(parameters%stages(i)%k01)) all_static = all_static .and. .not. parameters%stages(i)%k01 > 0
      end do
   end function all_static

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

end module rockdda_model_automatic_numbers
