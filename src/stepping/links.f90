! SPDX-License-Identifier: MIT
!> Contacts and bolts as links of the equations: vectors once a step, stiffness and force once a round.
module rockdda_stepping_links
   use rockdda_base_kinds, only : wp
   use rockdda_base_parallel, only : parallel_contacts
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_state, only : block_state_type
   use rockdda_contact_table, only : contact_table_type
   use rockdda_interaction_friction_search, only : friction_search_type
   use rockdda_interaction_contact_law, only : contact_law_type
   use rockdda_interaction_open_close, only : open_close_type
   use rockdda_interaction_contact_spring, only : spring_vectors, dashpot_coefficient
   use rockdda_interaction_joint_law, only : joint_settings_type, linearise_joint
   use rockdda_interaction_bolts, only : bolt_vectors, bolt_force, bolt_response
   use rockdda_interaction_equations, only : equations_type
   implicit none
   private
   public :: bolt_round_type, set_drag, set_link_vectors, set_link_forces, set_friction_forces, &
      predict_contacts, predict_sliding, judge_bolts, commit_bolts

   !> Bolts in the open-close loop.
   type :: bolt_round_type
      real(wp), allocatable :: force(:)     !! (n) axial force at the step's start
      logical, allocatable :: yields(:)     !! (n) trial: force held at the strength
      real(wp), allocatable :: stretch(:)   !! (n) predicted change of length
   end type bolt_round_type

contains

   !> Blocks, directions and sizes of all links at the start of a step; the graph of the equations is then to be set.
   subroutine set_link_vectors(blocks, state, table, bolts, equations)
      type(block_system_type), intent(in) :: blocks
      type(block_state_type), intent(in) :: state
      type(contact_table_type), intent(in) :: table
      type(bolt_round_type), intent(inout) :: bolts
      type(equations_type), intent(inout) :: equations
      real(wp) :: centroid(2, 2), length
      integer :: c, a, b, l, side

      call equations%set_size(blocks%n_blocks, table%n + blocks%bolts%n)
      !$omp parallel do default(none) shared(table, state, equations) private(c, a, b) schedule(static) &
      !$omp if (table%n > parallel_contacts)
      do c = 1, table%n
         a = table%block_a(c)
         b = table%block_b(c)
         equations%pair(:, c) = [a, b]
         call spring_vectors(table%point(:, c), table%gap(c), table%normal(:, c), state%centroid(:, a), &
                             state%centroid(:, b), equations%vector_a(:, :, c), equations%vector_b(:, :, c))
      end do
      !$omp end parallel do
      if (.not. allocated(bolts%force)) allocate (bolts%force(blocks%bolts%n), bolts%stretch(blocks%bolts%n), &
                                                  bolts%yields(blocks%bolts%n))
      bolts%yields = .false.
      bolts%stretch = 0
      do l = 1, blocks%bolts%n
         c = table%n + l
         equations%pair(:, c) = blocks%bolts%blocks(:, l)
         centroid = 0
         do side = 1, 2
            if (equations%pair(side, c) > 0) centroid(:, side) = state%centroid(:, equations%pair(side, c))
         end do
         call bolt_vectors(state%bolt_ends(:, l), blocks%bolts%blocks(:, l), centroid(:, 1), centroid(:, 2), length, &
                           equations%vector_a(:, 1, c), equations%vector_b(:, 1, c))
         if (equations%pair(1, c) == equations%pair(2, c)) then
            ! both ends in one block: it holds nothing together, only the block's own strain would feel it
            equations%pair(:, c) = 0
            equations%vector_a(:, 1, c) = 0
            equations%vector_b(:, 1, c) = 0
         end if
         equations%vector_a(:, 2, c) = 0
         equations%vector_b(:, 2, c) = 0
         bolts%force(l) = bolt_force(blocks%bolts%stiffness(l), blocks%bolts%pretension(l), &
                                     state%bolt_elongation(l), state%bolt_plastic(l))
      end do
   end subroutine set_link_vectors

   !> Dashpot coefficients of a contact: normal and shear [force time/length].
   pure function contact_dashpots(law, parameters, mass_a, mass_b) result(c)
      type(contact_law_type), intent(in) :: law
      type(parameters_type), intent(in) :: parameters
      real(wp), intent(in) :: mass_a, mass_b
      real(wp) :: c(2)
      c = 0
      if (.not. law%damping_ratio > 0) return
      c(1) = dashpot_coefficient(law%damping_ratio, parameters%normal_stiffness, mass_a, mass_b)
      c(2) = dashpot_coefficient(law%damping_ratio, parameters%shear_stiffness, mass_a, mass_b)
   end function contact_dashpots

   !> Dashpots of all contacts in a step of this length.
   pure subroutine set_drag(parameters, laws, state, table, dt, trial)
      type(parameters_type), intent(in) :: parameters
      type(contact_law_type), intent(in) :: laws(:)
      type(block_state_type), intent(in) :: state
      type(contact_table_type), intent(in) :: table
      real(wp), intent(in) :: dt   !! step [time]
      type(open_close_type), intent(inout) :: trial
      real(wp) :: damping(2)
      integer :: c
      if (.not. any(laws%damping_ratio > 0)) return
      do c = 1, table%n
         damping = contact_dashpots(laws(table%joint(c)), parameters, state%mass(table%block_a(c)), &
                                    state%mass(table%block_b(c)))
         trial%normal_drag(c) = damping(1)/dt
         trial%drag(c) = damping(2)/dt
      end do
   end subroutine set_drag

   !> Stiffness and force of all links for the trial states of a round.
   subroutine set_link_forces(blocks, settings, table, trial, bolts, equations)
      type(block_system_type), intent(in) :: blocks
      type(joint_settings_type), intent(in) :: settings
      type(contact_table_type), intent(in) :: table
      type(open_close_type), intent(in) :: trial
      type(bolt_round_type), intent(in) :: bolts
      type(equations_type), intent(inout) :: equations
      real(wp) :: stiffness(2), force(2), yielded
      integer :: c, l
      logical :: yields
      !$omp parallel do default(none) shared(settings, table, trial, equations) private(c, stiffness, force) &
      !$omp schedule(static) if (table%n > parallel_contacts)
      do c = 1, table%n
         call linearise_joint(settings, trial%joint_of(table, c), stiffness, force)
         call equations%set_link(c, stiffness, force)
      end do
      !$omp end parallel do
      do l = 1, blocks%bolts%n
         stiffness = [blocks%bolts%stiffness(l), 0.0_wp]
         force = [-bolts%force(l), 0.0_wp]
         if (bolts%yields(l)) then
            call bolt_response(blocks%bolts%stiffness(l), blocks%bolts%strength(l), bolts%force(l), bolts%stretch(l), &
                               force(1), yields, yielded)
            stiffness(1) = 0
            force(1) = -force(1)
         end if
         call equations%set_link(table%n + l, stiffness, force)
      end do
   end subroutine set_link_forces

   !> The friction forces alone, where all states are those of the last solve.
   subroutine set_friction_forces(search, trial, equations)
      type(friction_search_type), intent(in) :: search   !! knows the rows
      type(open_close_type), intent(in) :: trial
      type(equations_type), intent(inout) :: equations
      integer :: c, i
      !$omp parallel do default(none) shared(search, trial, equations) private(c, i) if (search%n > parallel_contacts)
      do i = 1, search%n
         c = search%rows(i)
         call equations%set_link(c, equations%stiffness(:, c), &
                                 [equations%force(1, c), -trial%slip_sign(c)*trial%friction(c)])
      end do
      !$omp end parallel do
   end subroutine set_friction_forces

   !> Predicted gap and slip of one contact for the solution x.
   pure subroutine predict_contact(table, equations, c, gap, slip)
      type(contact_table_type), intent(in) :: table
      type(equations_type), intent(in) :: equations
      integer, intent(in) :: c
      real(wp), intent(out) :: gap, slip
      associate (xa => equations%x(:, equations%pair(1, c)), xb => equations%x(:, equations%pair(2, c)))
         gap = table%gap(c) + along(equations%vector_a(:, 1, c), xa, equations%vector_b(:, 1, c), xb)
         slip = along(equations%vector_a(:, 2, c), xa, equations%vector_b(:, 2, c), xb)
      end associate
   end subroutine predict_contact

   !> v . x + w . y: two sums of six, which a register of two numbers adds up.
   pure real(wp) function along(v, x, w, y)
      real(wp), intent(in) :: v(6), x(6), w(6), y(6)
      real(wp) :: t(2)
      t = ((v(1:2)*x(1:2) + v(3:4)*x(3:4)) + v(5:6)*x(5:6)) + ((w(1:2)*y(1:2) + w(3:4)*y(3:4)) + w(5:6)*y(5:6))
      along = t(1) + t(2)
   end function along

   !> Predicted gap and slip of the contacts whose friction forces are searched for.
   subroutine predict_sliding(table, equations, search, trial)
      type(contact_table_type), intent(in) :: table
      type(equations_type), intent(in) :: equations
      type(friction_search_type), intent(in) :: search   !! knows the rows
      type(open_close_type), intent(inout) :: trial
      integer :: c, i
      !$omp parallel do default(none) shared(table, equations, search, trial) private(c, i) &
      !$omp if (search%n > parallel_contacts)
      do i = 1, search%n
         c = search%rows(i)
         call predict_contact(table, equations, c, trial%gap(c), trial%slip(c))
      end do
      !$omp end parallel do
   end subroutine predict_sliding

   !> Predicted gap and slip of every contact, stretch of every bolt, for the solution x.
   subroutine predict_contacts(table, equations, n_bolts, trial, bolts)
      type(contact_table_type), intent(in) :: table
      type(equations_type), intent(in) :: equations
      integer, intent(in) :: n_bolts
      type(open_close_type), intent(inout) :: trial
      type(bolt_round_type), intent(inout) :: bolts
      integer :: c, l
      !$omp parallel do default(none) shared(table, equations, trial) private(c) if (table%n > parallel_contacts)
      do c = 1, table%n
         call predict_contact(table, equations, c, trial%gap(c), trial%slip(c))
      end do
      !$omp end parallel do
      do l = 1, n_bolts
         c = table%n + l
         bolts%stretch(l) = 0
         if (equations%pair(1, c) > 0) bolts%stretch(l) = bolts%stretch(l) + &
            dot_product(equations%vector_a(:, 1, c), equations%x(:, equations%pair(1, c)))
         if (equations%pair(2, c) > 0) bolts%stretch(l) = bolts%stretch(l) + &
            dot_product(equations%vector_b(:, 1, c), equations%x(:, equations%pair(2, c)))
      end do
   end subroutine predict_contacts

   !> Plastic elongation of the bolts at the end of an accepted step.
   pure subroutine commit_bolts(blocks, bolts, plastic)
      type(block_system_type), intent(in) :: blocks
      type(bolt_round_type), intent(in) :: bolts
      real(wp), intent(inout) :: plastic(:)   !! (bolts) [length]
      real(wp) :: force, yielded
      logical :: yields
      integer :: l
      do l = 1, blocks%bolts%n
         call bolt_response(blocks%bolts%stiffness(l), blocks%bolts%strength(l), bolts%force(l), bolts%stretch(l), &
                            force, yields, yielded)
         plastic(l) = plastic(l) + yielded
      end do
   end subroutine commit_bolts

   !> Which bolts yield at the predicted motion.
   pure subroutine judge_bolts(blocks, bolts, n_changes)
      type(block_system_type), intent(in) :: blocks
      type(bolt_round_type), intent(inout) :: bolts
      integer, intent(out) :: n_changes
      real(wp) :: force, yielded
      logical :: yields
      integer :: l
      n_changes = 0
      do l = 1, blocks%bolts%n
         call bolt_response(blocks%bolts%stiffness(l), blocks%bolts%strength(l), bolts%force(l), bolts%stretch(l), &
                            force, yields, yielded)
         if (yields .neqv. bolts%yields(l)) n_changes = n_changes + 1
         bolts%yields(l) = yields
      end do
   end subroutine judge_bolts

end module rockdda_stepping_links
