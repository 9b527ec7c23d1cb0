! SPDX-License-Identifier: MIT
!> The distance over which a step has to search for contacts.
module rockdda_stepping_reach
   use rockdda_base_kinds, only : wp, pi
   use rockdda_base_parallel, only : parallel_blocks, parallel_contacts
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_analysis_input, only : joint_material_type
   use rockdda_model_options, only : is_set
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_state, only : block_state_type, radius_of_inertia
   use rockdda_contact_interval_law, only : overhang
   use rockdda_contact_normal_law, only : normal_law_type, new_normal_law
   use rockdda_contact_table, only : contact_table_type, contact_state, is_of_interval
   use rockdda_contact_search_limits, only : search_limits_type
   use rockdda_contact_history, only : pressed_cosine
   use rockdda_stepping_control, only : step_control_type
   implicit none
   private
   public :: predicted_reach, set_search_limits, quantised

contains

   !> The distance of the search: four times the displacement expected in the step, at least a little,
   !> rounded up to a power of two (times w0) so that the graph of candidates changes seldom.
   real(wp) function predicted_reach(blocks, parameters, state, control, dt) result(reach)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(block_state_type), intent(in) :: state
      type(step_control_type), intent(in) :: control
      real(wp), intent(in) :: dt   !! step [time]
      real(wp) :: fastest, acceleration, expected, arm
      integer :: i
      acceleration = 0
      do i = 1, size(parameters%block_materials)
         associate (m => parameters%block_materials(i))
            acceleration = max(acceleration, abs(m%weight)/m%density)
         end associate
      end do
      if (parameters%gravity >= 0) acceleration = parameters%gravity
      fastest = 0
      !$omp parallel do default(none) shared(blocks, state) private(i, arm) reduction(max:fastest) schedule(static) &
      !$omp if (blocks%n_blocks > parallel_blocks)
      do i = 1, blocks%n_blocks
         arm = radius_of_inertia(state, i)
         fastest = max(fastest, norm2(state%velocity(1:2, i)) + &
                       2*arm*(abs(state%velocity(3, i)) + norm2(state%velocity(4:6, i))))
      end do
      !$omp end parallel do
      acceleration = acceleration*norm2(parameters%weight_direction)
      expected = fastest*dt + 0.5_wp*acceleration*abs(control%gravity(parameters))*dt**2
      if (control%last_dt > 0) expected = max(expected, control%last_displacement*dt/control%last_dt)
      ! what moves further than the search distance allows will be cut; looking that far could make every pair of
      ! blocks a candidate
      reach = parameters%search_distance
      if (4*expected < reach) reach = min(quantised(4*expected, parameters%w0), reach)
   end function predicted_reach

   !> Distances and angles of a search for contacts over this distance, and further where contacts of the last step need
   !> it: a corner that lies deep behind a face must not count as one that has left the region of the other's
   !> corner, and a bond that is stretched, or a joint that dilation has opened, further than blocks will move in this
   !> step must not be lost.
   subroutine set_search_limits(contacts, parameters, n_blocks, reach, limits, has_placed)
      type(contact_table_type), intent(in) :: contacts   !! of the last step
      type(parameters_type), intent(in) :: parameters
      integer, intent(in) :: n_blocks
      real(wp), intent(in) :: reach                      !! [length]
      type(search_limits_type), intent(inout) :: limits
      logical, intent(in), optional :: has_placed        !! contacts of placed blocks may be free of stress at a gap
      real(wp) :: deepest, widest, pulled
      logical :: placed
      logical :: opens                                   !! closed contacts may have a gap without being bonded
      real(wp), allocatable :: depth(:)                  !! of `pressed_depth` [length]
      integer :: c
      deepest = 0
      widest = 0
      pulled = 0
      opens = .false.
      if (allocated(parameters%joint_materials)) opens = any(parameters%joint_materials%dilation > 0 .or. &
                                                             parameters%joint_materials%tension > 0)
      placed = .false.
      if (present(has_placed)) placed = has_placed
      opens = opens .or. placed
      if (.not. allocated(limits%is_tied)) allocate (limits%is_tied(size(parameters%joint_materials)), &
                                                     limits%bears_tension(size(parameters%joint_materials)), &
                                                     limits%weakens(size(parameters%joint_materials)), &
                                                     limits%normal(size(parameters%joint_materials)))
      limits%is_tied(:) = parameters%joint_materials%tie
      limits%normal(:) = new_normal_law(parameters%joint_materials, parameters%by_length)
      limits%bears_tension(:) = parameters%joint_materials%tension > 0 .or. limits%is_tied
      limits%weakens(:) = is_set(parameters%joint_materials%slip_length)
      allocate (depth(contacts%n))
      !$omp parallel do default(none) shared(contacts, parameters, limits, opens, placed, depth) private(c) &
      !$omp reduction(max:deepest, widest, pulled) schedule(static) if (contacts%n > parallel_contacts)
      do c = 1, contacts%n
         ! what the springs are compressed by, less that of the stress with which the contact began
         depth(c) = pressed_depth(contacts, c, limits%normal(contacts%joint(c)))
         deepest = max(deepest, depth(c))
         if (opens) then
            widest = max(widest, opened(parameters%joint_materials(contacts%joint(c)), c))
            if (placed .and. contacts%state(c) /= contact_state%open) widest = max(widest, contacts%offset(c))
            pulled = max(pulled, -contacts%normal_force(c)/contacts%k_n(c))
         end if
         if (.not. contacts%bonded(c)) cycle
         widest = max(widest, abs(contacts%shear(c)))
         pulled = max(pulled, -contacts%normal_force(c)/contacts%k_n(c))
      end do
      !$omp end parallel do
      widest = max(widest, pulled)
      limits%reach = reach
      if (2*widest > reach) limits%reach = quantised(2*widest, parameters%w0)
      limits%zone = max(0.5_wp*limits%reach, quantised(2*deepest, parameters%w0))
      limits%penetration = max(limits%reach, 0.3_wp*parameters%search_distance, 2*deepest)
      limits%sine = sin(parameters%angle_tolerance)
      limits%cosine = cos(parameters%angle_tolerance)
      if (parameters%by_length) limits%cosine = pressed_cosine
      limits%by_length = parameters%by_length
      limits%corrected = .not. (parameters%by_length .or. parameters%has_legacy_rules())
      limits%radius = parameters%corner_radius
      limits%smooth = max(parameters%smooth_step, 1.0e-9_wp*parameters%w0)
      ! a block stands in the surface that bears it by the compression of its own springs
      if (.not. allocated(limits%sunk)) allocate (limits%sunk(n_blocks))
      limits%sunk = 0
      do c = 1, merge(contacts%n, 0, limits%by_length .or. limits%corrected)
         associate (a => contacts%block_a(c), b => contacts%block_b(c))
            limits%sunk(a) = max(limits%sunk(a), 2*depth(c))
            limits%sunk(b) = max(limits%sunk(b), 2*depth(c))
         end associate
      end do

   contains

      !> Gap that dilation has opened.
      pure real(wp) function opened(material, c)
         type(joint_material_type), intent(in) :: material
         integer, intent(in) :: c     !! row
         opened = contacts%total_slip(c)
         if (is_set(material%dilation_slip)) opened = min(opened, material%dilation_slip)
         opened = opened*tan(material%dilation*pi/180)
      end function opened

   end subroutine set_search_limits

   !> How deep a contact has pressed the blocks into each other; an interval at the end where it is deepest.
   pure real(wp) function pressed_depth(contacts, c, law) result(depth)
      type(contact_table_type), intent(in) :: contacts   !! of the last step
      integer, intent(in) :: c                           !! row
      type(normal_law_type), intent(in) :: law
      integer :: r
      depth = contacts%normal_force(c)/law%secant(contacts%k_n(c), contacts%normal_force(c)) - &
              max(0.0_wp, contacts%offset(c))
      if (contacts%state(c) == contact_state%open .or. contacts%tied(c) .or. .not. is_of_interval(contacts, c)) return
      r = c + 1 - contacts%station(c)
      associate (low => contacts%distance(r), high => contacts%distance(r + 1))
         depth = max(depth, min(0.0_wp, contacts%offset(c)) - (min(low, high) - overhang*abs(low - high)))
      end associate
   end function pressed_depth

   !> The next power of two times w0, at least 1e-7 w0.
   pure real(wp) function quantised(length, w0)
      real(wp), intent(in) :: length, w0   !! [length]
      quantised = w0*2.0_wp**ceiling(log(max(length/w0, 1.0e-7_wp))/log(2.0_wp))
   end function quantised

end module rockdda_stepping_reach
