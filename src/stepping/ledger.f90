! SPDX-License-Identifier: MIT
!> Energy ledger of the steps (docs/theory.md, "Energy ledger").
!>
!> balance of a run:   kinetic + strain + gravity + springs - (their sum at the start)
!>                   = external - friction - dissipated - discarded + geometry + residual
!>
!> The work of every implicit term over a step is known exactly, so that `residual` is what the solver left.
module rockdda_stepping_ledger
   use rockdda_base_kinds, only : wp
   use rockdda_base_parallel, only : parallel_blocks, parallel_contacts, piece, n_pieces
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_state, only : block_state_type, energy, n_energies
   use rockdda_contact_table, only : contact_table_type, contact_state
   use rockdda_interaction_open_close, only : open_close_type
   use rockdda_interaction_kinematics, only : mass_matrix, mass_times
   use rockdda_interaction_elastic, only : strain_energy, elastic_energy, stress_of
   use rockdda_interaction_inertia, only : new_velocity, mass_damping_dissipation
   use rockdda_interaction_joint_law, only : joint_settings_type, joint_type, joint_end_type, end_joint, spring_energy
   use rockdda_interaction_points, only : support_energy
   use rockdda_interaction_bolts, only : bolt_response, bolt_energy
   use rockdda_stepping_loads, only : material_matrices_type, step_loads_type, support_stretch
   use rockdda_stepping_given_energy, only : given_energy_type
   use rockdda_stepping_links, only : bolt_round_type
   implicit none
   private
   public :: ledger_type

   !> Sums taken at a time, at most.
   integer, parameter :: n_sums = 10

   type :: ledger_type
      real(wp) :: total(n_energies) = 0     !! as in step_record_type%energy
      real(wp) :: at_start = 0              !! kinetic + strain + gravity + springs at time 0
      real(wp) :: contact_energy = 0        !! in contact springs at the end of the last step
      real(wp), allocatable :: fixed_energy(:) !! (nf) in the springs of fixed points
      real(wp) :: bolt_energy = 0           !! in bolts
      type(given_energy_type) :: given      !! by `discarded` and `geometry`
      real(wp), private :: before(n_energies) = 0 !! `total` at the start of the step
      real(wp), private :: step_discarded = 0     !! in the step, by contacts
      real(wp), allocatable, private :: sums(:, :) !! (columns, >= pieces) scratch
   contains
      procedure :: start
      procedure :: add_contacts
      procedure :: add_blocks
      procedure :: add_supports
      procedure :: add_motion
      procedure :: predicted_energies
      procedure :: stored_energies
      procedure :: close_step
   end type ledger_type

contains

   !> Kinetic and strain energy of all blocks with the masses and areas of the state.
   subroutine stored_energies(self, blocks, matrices, state, kinetic, strain)
      class(ledger_type), intent(inout) :: self
      type(block_system_type), intent(in) :: blocks
      type(material_matrices_type), intent(in) :: matrices
      type(block_state_type), intent(in) :: state
      real(wp), intent(out) :: kinetic, strain    !! [energy]
      integer :: p, i
      call make_room(self, blocks%n_blocks)
      !$omp parallel do default(none) shared(self, blocks, matrices, state) private(p, i) schedule(static) &
      !$omp if (blocks%n_blocks > parallel_blocks)
      do p = 1, n_pieces(blocks%n_blocks)
         self%sums(1:2, p) = 0
         do i = (p - 1)*piece + 1, min(p*piece, blocks%n_blocks)
            call add_energies(i, blocks, matrices, state, state%velocity(:, i), &
                              state%stress(:, i), self%sums(1:2, p))
         end do
      end do
      !$omp end parallel do
      kinetic = sum(self%sums(1, 1:n_pieces(blocks%n_blocks)))
      strain = sum(self%sums(2, 1:n_pieces(blocks%n_blocks)))
   end subroutine stored_energies

   !> Kinetic and strain energy after the step d with the masses and areas of its start (the state given).
   subroutine predicted_energies(self, blocks, matrices, state, dt, d, kinetic, strain)
      class(ledger_type), intent(inout) :: self
      type(block_system_type), intent(in) :: blocks
      type(material_matrices_type), intent(in) :: matrices
      type(block_state_type), intent(in) :: state
      real(wp), intent(in) :: dt                  !! [time]
      real(wp), intent(in) :: d(:, :)             !! (6, nb) unknowns of the step
      real(wp), intent(out) :: kinetic, strain    !! [energy]
      real(wp) :: velocity(6), stress(3)
      integer :: p, i
      call make_room(self, blocks%n_blocks)
      !$omp parallel do default(none) shared(self, blocks, matrices, state, dt, d) private(p, i, velocity, stress) &
      !$omp schedule(static) if (blocks%n_blocks > parallel_blocks)
      do p = 1, n_pieces(blocks%n_blocks)
         self%sums(1:2, p) = 0
         do i = (p - 1)*piece + 1, min(p*piece, blocks%n_blocks)
            velocity = new_velocity(d(:, i), state%velocity(:, i), dt)
            stress = state%stress(:, i) + stress_of(matrices%e(:, :, blocks%block_material(i)), d(4:6, i))
            call add_energies(i, blocks, matrices, state, velocity, stress, self%sums(1:2, p))
         end do
      end do
      !$omp end parallel do
      kinetic = sum(self%sums(1, 1:n_pieces(blocks%n_blocks)))
      strain = sum(self%sums(2, 1:n_pieces(blocks%n_blocks)))
   end subroutine predicted_energies

   !> Kinetic and strain energy of block i with a given velocity and stress.
   pure subroutine add_energies(i, blocks, matrices, state, velocity, stress, sums)
      integer, intent(in) :: i
      type(block_system_type), intent(in) :: blocks
      type(material_matrices_type), intent(in) :: matrices
      type(block_state_type), intent(in) :: state
      real(wp), intent(in) :: velocity(6), stress(3)
      real(wp), intent(inout) :: sums(2)
      sums(1) = sums(1) + 0.5_wp*dot_product(velocity, mass_times(state%mass(i), state%area(i), state%moments(:, i), &
                                                                  velocity))
      sums(2) = sums(2) + strain_energy(stress, matrices%c(:, :, blocks%block_material(i)), state%area(i))
   end subroutine add_energies

   !> Room for the partial sums over n items.
   pure subroutine make_room(self, n)
      class(ledger_type), intent(inout) :: self
      integer, intent(in) :: n
      if (allocated(self%sums)) then
         if (size(self%sums, 2) >= n_pieces(n)) return
         deallocate (self%sums)
      end if
      allocate (self%sums(n_sums, n_pieces(n) + n_pieces(n)/4 + 1))
   end subroutine make_room

   !> Energies at time 0: initial velocities, initial stresses, pretensioned bolts.
   subroutine start(self, blocks, matrices, state)
      class(ledger_type), intent(inout) :: self
      type(block_system_type), intent(in) :: blocks
      type(material_matrices_type), intent(in) :: matrices
      type(block_state_type), intent(in) :: state
      integer :: l
      self%total = 0
      self%contact_energy = 0
      if (allocated(self%fixed_energy)) deallocate (self%fixed_energy)
      allocate (self%fixed_energy(blocks%fixed%n), source=0.0_wp)
      self%bolt_energy = 0
      call self%stored_energies(blocks, matrices, state, self%total(energy%kinetic), self%total(energy%strain))
      do l = 1, blocks%bolts%n
         self%bolt_energy = self%bolt_energy + 0.5_wp*blocks%bolts%pretension(l)**2/blocks%bolts%stiffness(l)
      end do
      self%total(energy%springs) = self%bolt_energy
      self%at_start = sum(self%total(1:4))
      self%before = self%total
      call self%given%start(self%total(energy%kinetic))
   end subroutine start

   !> Contacts of an accepted step: springs, friction, dashpots, changes of state. The table is that of the step's start.
   subroutine add_contacts(self, settings, trial, step, table)
      class(ledger_type), intent(inout) :: self
      type(joint_settings_type), intent(in) :: settings
      type(open_close_type), intent(in) :: trial
      integer, intent(in) :: step   !! number of the step
      type(contact_table_type), intent(in) :: table
      real(wp) :: carried, friction, dissipated, discarded, geometry, stored
      integer :: p, n, column, c
      n = n_pieces(table%n)
      self%before = self%total
      call make_room(self, table%n)
      !$omp parallel do default(none) shared(self, settings, trial, table, n) private(p) &
      !$omp schedule(static) if (table%n > parallel_contacts)
      do p = 1, n
         call measure_contacts((p - 1)*piece + 1, min(p*piece, table%n), settings, trial, table, self%sums(:, p))
      end do
      !$omp end parallel do
      carried = sum(self%sums(1, 1:n))
      friction = sum(self%sums(2, 1:n))
      dissipated = sum(self%sums(3, 1:n))
      discarded = sum(self%sums(4, 1:n))
      geometry = sum(self%sums(5, 1:n))
      stored = sum(self%sums(6, 1:n))
      ! closed contacts that the search no longer found
      discarded = discarded + (self%contact_energy - carried)
      self%contact_energy = stored
      self%step_discarded = discarded
      do column = 1, 2
         if (n == 0) exit
         p = maxloc(self%sums(5 + 2*column, 1:n), dim=1)
         c = nint(self%sums(6 + 2*column, p))
         if (c > 0) call self%given%add_contact(column, self%sums(5 + 2*column, p), step, &
                                                table%block_a(c), table%block_b(c), table%point(:, c))
      end do
      call add(self, energy%friction, friction)
      call add(self, energy%dissipated, dissipated)
      call add(self, energy%discarded, discarded)
      call add(self, energy%geometry, geometry)
   end subroutine add_contacts

   !> The part of `add_contacts` for some of the contacts.
   pure subroutine measure_contacts(first, last, settings, trial, table, sums)
      integer, intent(in) :: first, last
      type(joint_settings_type), intent(in) :: settings
      type(open_close_type), intent(in) :: trial
      type(contact_table_type), intent(in) :: table
      !> carried, friction, dissipated, discarded, geometry, stored; what the contact that gives most by a change of
      !> state gives and its number, the same by geometry
      real(wp), intent(out) :: sums(n_sums)
      type(joint_type) :: joint
      type(joint_end_type) :: after
      real(wp) :: x0, x1, s0, s1, before, carried, friction, dissipated, discarded, geometry, stored, worst(4)
      integer :: c
      logical :: was_closed
      carried = 0
      friction = 0
      dissipated = 0
      discarded = 0
      geometry = 0
      stored = 0
      worst = 0
      associate (kn => settings%k_n, ks => settings%k_s)
         do c = first, last
            was_closed = table%state(c) /= contact_state%open
            x0 = table%gap(c)
            s0 = table%shear(c)
            before = 0
            if (was_closed) before = spring_energy(settings, x0, s0)
            carried = carried + table%energy(c)
            geometry = geometry + (before - table%energy(c))
            if (before - table%energy(c) > worst(3)) worst(3:4) = [before - table%energy(c), real(c, wp)]
            joint = trial%joint_used(table, c)
            if (joint%state == contact_state%open) then
               discarded = discarded + before
               cycle
            end if
            x1 = trial%gap(c)
            after = end_joint(settings, joint, x1, trial%slip(c))
            s1 = after%shear
            if (was_closed .or. x0 < 0) then
               dissipated = dissipated + 0.5_wp*kn*(x1 - x0)**2
               if (.not. was_closed) then
                  discarded = discarded - 0.5_wp*kn*x0**2
                  if (0.5_wp*kn*x0**2 > worst(1)) worst(1:2) = [0.5_wp*kn*x0**2, real(c, wp)]
               end if
            else
               dissipated = dissipated + (kn*x1*(x1 - x0) - 0.5_wp*kn*x1**2)
            end if
            dissipated = dissipated + joint%normal_drag*(x1 - x0)*(x1 - x0)
            if (joint%state == contact_state%locked) then
               dissipated = dissipated + 0.5_wp*ks*(s1 - s0)**2
               dissipated = dissipated + joint%drag*(s1 - s0)*(s1 - s0)
            else
               friction = friction + joint%slip_sign*joint%friction*trial%slip(c) - 0.5_wp*ks*(s1**2 - s0**2)
            end if
            stored = stored + after%energy
         end do
      end associate
      sums = [carried, friction, dissipated, discarded, geometry, stored, worst]
   end subroutine measure_contacts

   !> Blocks of an accepted step: loads, elastic dissipation, damping; state is that of the step's start.
   subroutine add_blocks(self, blocks, parameters, matrices, state, loads, dt, d)
      class(ledger_type), intent(inout) :: self
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(material_matrices_type), intent(in) :: matrices
      type(block_state_type), intent(in) :: state
      type(step_loads_type), intent(in) :: loads
      real(wp), intent(in) :: dt   !! step [time]
      real(wp), intent(in) :: d(:, :)            !! (6, nb) unknowns of the step
      integer :: i, p, n
      n = n_pieces(blocks%n_blocks)
      call make_room(self, blocks%n_blocks)
      !$omp parallel do default(none) shared(self, blocks, parameters, matrices, state, loads, dt, d, n) private(p, i) &
      !$omp schedule(static) if (blocks%n_blocks > parallel_blocks)
      do p = 1, n
         self%sums(1:3, p) = 0
         do i = (p - 1)*piece + 1, min(p*piece, blocks%n_blocks)
            call end_block(i, blocks, parameters, matrices, state, loads, dt, d(:, i), self%sums(1:3, p))
         end do
      end do
      !$omp end parallel do
      call add(self, energy%external, sum(self%sums(1, 1:n)))
      call add(self, energy%gravity, sum(self%sums(2, 1:n)))
      call add(self, energy%dissipated, sum(self%sums(3, 1:n)))
   end subroutine add_blocks

   !> The part of `add_blocks` for one block.
   pure subroutine end_block(i, blocks, parameters, matrices, state, loads, dt, d, sums)
      integer, intent(in) :: i
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(material_matrices_type), intent(in) :: matrices
      type(block_state_type), intent(in) :: state
      type(step_loads_type), intent(in) :: loads
      real(wp), intent(in) :: dt, d(6)
      real(wp), intent(inout) :: sums(3)   !! external work, gravity, dissipated
      real(wp) :: stored, lost
      call elastic_energy(matrices%e(:, :, blocks%block_material(i)), state%stress(:, i), d(4:6), state%area(i), &
                          stored, lost)
      if (parameters%mass_damping > 0) lost = lost + mass_damping_dissipation( &
         parameters%mass_damping, mass_matrix(state%mass(i), state%area(i), state%moments(:, i)), dt, d)
      sums(1) = sums(1) + dot_product(loads%external(:, i), d)
      sums(2) = sums(2) - dot_product(loads%weight(:, i), d)
      sums(3) = sums(3) + lost
   end subroutine end_block

   !> Fixed points and bolts of an accepted step; state is that of the step's start.
   pure subroutine add_supports(self, blocks, parameters, state, loads, released, bolts, d)
      class(ledger_type), intent(inout) :: self
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(block_state_type), intent(in) :: state
      type(step_loads_type), intent(in) :: loads
      logical, intent(in) :: released(:)          !! (nf)
      type(bolt_round_type), intent(in) :: bolts
      real(wp), intent(in) :: d(:, :)             !! (6, nb)
      real(wp) :: x0(2), x1(2), pulled(2), stored, lost, external, start_energy, end_energy, plastic, force, yielded
      integer :: p, l
      logical :: yields
      do p = 1, blocks%fixed%n
         if (released(p)) then
            ! what its spring held when it was let go is gone
            call add(self, energy%discarded, self%fixed_energy(p))
            self%fixed_energy(p) = 0
            cycle
         end if
         call support_stretch(p, blocks, state, loads, d, x0, x1)
         pulled = loads%target_end(:, p) - loads%target_start(:, p)
         call support_energy(parameters%fixed_stiffness, x0, x1, pulled, stored, lost, external)
         start_energy = 0.5_wp*parameters%fixed_stiffness*(x0(1)**2 + x0(2)**2)
         call add(self, energy%geometry, start_energy - self%fixed_energy(p))
         self%fixed_energy(p) = start_energy + stored
         call add(self, energy%dissipated, lost)
         call add(self, energy%external, external)
      end do
      start_energy = 0
      end_energy = 0
      do l = 1, blocks%bolts%n
         call bolt_response(blocks%bolts%stiffness(l), blocks%bolts%strength(l), bolts%force(l), bolts%stretch(l), &
                            force, yields, yielded)
         call bolt_energy(blocks%bolts%stiffness(l), bolts%force(l), force, yielded, stored, lost, plastic)
         start_energy = start_energy + 0.5_wp*bolts%force(l)**2/blocks%bolts%stiffness(l)
         end_energy = end_energy + 0.5_wp*force**2/blocks%bolts%stiffness(l)
         call add(self, energy%dissipated, lost + plastic)
      end do
      call add(self, energy%geometry, start_energy - self%bolt_energy)
      self%bolt_energy = end_energy
   end subroutine add_supports

   !> Kinetic and strain energy after the blocks have moved, and what k01 takes away.
   pure subroutine add_motion(self, kinetic_predicted, strain_predicted, kinetic_moved, strain_moved, k01)
      class(ledger_type), intent(inout) :: self
      real(wp), intent(in) :: kinetic_predicted, strain_predicted  !! with the masses and areas of the step's start
      real(wp), intent(in) :: kinetic_moved, strain_moved          !! with those of its end, before k01
      real(wp), intent(in) :: k01                                  !! share of the velocity that is carried on
      call add(self, energy%geometry, (kinetic_moved - kinetic_predicted) + (strain_moved - strain_predicted))
      call add(self, energy%discarded, (1 - k01**2)*kinetic_moved)
      self%total(energy%kinetic) = k01**2*kinetic_moved
      self%total(energy%strain) = strain_moved
   end subroutine add_motion

   !> Sum up the springs, close the balance, and judge what `discarded` and `geometry` gave.
   pure subroutine close_step(self, parameters, loads, n_contacts)
      class(ledger_type), intent(inout) :: self
      type(parameters_type), intent(in) :: parameters
      type(step_loads_type), intent(in) :: loads
      integer, intent(in) :: n_contacts   !! of the step
      self%total(energy%springs) = self%contact_energy + sum(self%fixed_energy) + self%bolt_energy
      self%total(energy%residual) = (sum(self%total(1:4)) - self%at_start) - self%total(energy%external) &
                                    + self%total(energy%friction) + self%total(energy%dissipated) &
                                    + self%total(energy%discarded) - self%total(energy%geometry)
      call self%given%add_step(self%before, self%total, [-self%step_discarded, &
                               self%total(energy%geometry) - self%before(energy%geometry)], &
                               sum(hypot(loads%weight(1, :), loads%weight(2, :))), parameters%w0, n_contacts, &
                               parameters%normal_stiffness)
   end subroutine close_step

   !> Add to one column.
   pure subroutine add(self, column, amount)
      class(ledger_type), intent(inout) :: self
      integer, intent(in) :: column
      real(wp), intent(in) :: amount
      self%total(column) = self%total(column) + amount
   end subroutine add

end module rockdda_stepping_ledger
