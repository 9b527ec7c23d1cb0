! SPDX-License-Identifier: MIT
!> Numbers that a labelled file may leave out: contact stiffness, time step and displacement ratio that suit the model,
!> each with a note that gives the reason. The rules are in docs/contact-numbers.md.
module rockdda_model_automatic_numbers
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_base_strings, only : to_string, counted
   use rockdda_geometry_polygons, only : polygon_area
   use rockdda_model_automatic_stiffness, only : stiffening_type, all_stiffenings, stiffness_range, lost_tilt
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_contact_numbers, only : mean_edge, advised_ratio, advised_step, automatic_over_e, &
      springs_of_joint
   use rockdda_model_options, only : run_options_type, is_set
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_units, only : unit_system_type, unit_system
   implicit none
   private
   public :: choose_numbers

   !> Share of the time in which a block falls by its own size that a step takes at most.
   real(wp), parameter :: share_of_fall = 0.01_wp
   !> Numbers beyond this, and below its inverse, come from moduli or densities that no unit explains.
   real(wp), parameter :: most_sensible = 1.0e30_wp
   !> Factor of the time step where all of the run is static.
   real(wp), parameter :: static_factor = 4.0_wp

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
      if (.not. is_set(options%stiffness)) call choose_stiffness(blocks, options, edge, parameters, messages)
      if (.not. is_set(options%dt_max)) call choose_step(blocks, options, edge, parameters, messages)
      if (parameters%sliding_damping > 0 .and. .not. is_set(options%sliding_damping) .and. &
          .not. all_static(parameters) .and. any(.not. parameters%joint_materials%damping_ratio > 0)) &
         call messages%add(severity%note, 'contacts that slide in dynamic stages have '// &
            to_string(parameters%sliding_damping, 2)//' of critical damping (sliding_damping), where their '// &
            'joint has no damping_ratio: undamped, they slide further with shorter steps')
   end subroutine choose_numbers

   !> Contact stiffness of joints without a stiffness of their own, and of fixed points: from E, or from the joint
   !> materials where all that are used have their own.
   subroutine choose_stiffness(blocks, options, edge, parameters, messages)
      type(block_system_type), intent(in) :: blocks
      type(run_options_type), intent(in) :: options
      real(wp), intent(in) :: edge               !! mean length of edges
      type(parameters_type), intent(inout) :: parameters
      type(diagnostics_type), intent(inout) :: messages
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
      if (allocated(stiffenings)) call report_soft_stands(stiffenings, messages)
   end subroutine choose_stiffness

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

   !> Blocks that stand so heavily on joints of this stiffness that it decides when they fall.
   subroutine report_soft_stands(stiffenings, messages)
      type(stiffening_type), intent(in) :: stiffenings(:)   !! of all blocks
      type(diagnostics_type), intent(inout) :: messages
      integer :: i
      i = maxloc(stiffenings%lost, dim=1)
      if (.not. stiffenings(i)%lost > 1.001_wp*lost_tilt) return
      call messages%add(severity%warning, 'block '//to_string(i)//' is so slender and heavy that the automatic '// &
         'stiffness of its joints decides when it falls: at about '// &
         to_string(100*min(1.0_wp, stiffenings(i)%lost), 2)// &
         ' % less tilt than a rigid block ('//counted(count(stiffenings%lost > 1.001_wp*lost_tilt), 'block')// &
         ' by more than '//to_string(100*lost_tilt, 2)//' %); give stiffness where that matters')
   end subroutine report_soft_stands

   !> Largest time step: from the time in which a block swings on its joints, and the time in which it falls by
   !> its size.
   subroutine choose_step(blocks, options, edge, parameters, messages)
      type(block_system_type), intent(in) :: blocks
      type(run_options_type), intent(in) :: options
      real(wp), intent(in) :: edge               !! mean length of edges
      type(parameters_type), intent(inout) :: parameters
      type(diagnostics_type), intent(inout) :: messages
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
      k_n = stiffest_joint(blocks, edge, parameters)
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
                           u%shown(parameters%dt_max, 'time')//', '//reason//'; check Young''s moduli and densities', &
                           options%model_origin)
         return
      end if
      call messages%add(severity%note, 'time step (dt_max) is automatic: '//u%shown(parameters%dt_max, 'time')//', '// &
                        reason)
   end subroutine choose_step

   !> Largest normal stiffness per length of the joints that are used.
   pure real(wp) function stiffest_joint(blocks, edge, parameters) result(k_n)
      type(block_system_type), intent(in) :: blocks
      real(wp), intent(in) :: edge
      type(parameters_type), intent(in) :: parameters
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

end module rockdda_model_automatic_numbers
