! SPDX-License-Identifier: MIT
!> Energy ledger of the steps (docs/theory.md, "Energy ledger").
!>
!> balance of a run:   kinetic + strain + gravity + springs - (their sum at the start)
!>                   = external - friction - dissipated - discarded + geometry + residual
!>
!> The work of every implicit term over a step is known exactly, so that `residual` is what the solver left.
module rockdda_stepping_ledger
   use rockdda_base_kinds, only : wp
   use rockdda_model_state, only : energy, n_energies
   use rockdda_interaction_attempt, only : attempt_type
   use rockdda_interaction_balance, only : energy_balance_type
   use rockdda_interaction_bolts, only : is_there
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_families, only : families_type
   use rockdda_stepping_given_energy, only : given_energy_type
   implicit none
   private
   public :: ledger_type

   type, extends(energy_balance_type) :: ledger_type
      real(wp) :: at_start = 0                    !! kinetic + strain + gravity + springs at time 0
      type(given_energy_type) :: given            !! by `discarded` and `geometry`
      real(wp), private :: before(n_energies) = 0 !! `total` at the start of the step
      real(wp), allocatable, private :: holds(:)  !! (nb) of blocks in the step
   contains
      procedure :: start
      procedure :: add_step
      procedure :: close_step
   end type ledger_type

contains

   !> Energies at time 0: initial velocities, initial stresses, pretensioned bolts, springs of boundaries.
   subroutine start(self, context, families)
      class(ledger_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(families_type), intent(in) :: families
      integer :: l
      self%total = 0
      self%contact_energy = 0
      if (allocated(self%fixed_energy)) deallocate (self%fixed_energy)
      allocate (self%fixed_energy(context%blocks%fixed%n), source=0.0_wp)
      self%bolt_energy = 0
      call families%add_moved_energies(context, self)
      self%total(energy%kinetic) = self%moved(1)
      self%total(energy%strain) = self%moved(2)
      associate (bolts => context%blocks%bolts)
         do l = 1, bolts%n
            if (.not. all(is_there(context%state%active, bolts%blocks(:, l)))) cycle
            self%bolt_energy = self%bolt_energy + 0.5_wp*bolts%pretension(l)**2/bolts%stiffness(l)
         end do
      end associate
      self%bar_energy = families%bars%start_energy(context)
      self%boundary_energy = families%boundaries%springs%start_energy(context%blocks%n_blocks)
      self%total(energy%springs) = self%bolt_energy + sum(self%boundary_energy) + self%bar_energy
      self%at_start = sum(self%total(1:4))
      self%before = self%total
      call self%given%start(self%total(energy%kinetic))
   end subroutine start

   !> Work and energies of an accepted step, while all states are those of its start.
   subroutine add_step(self, context, attempt, families, d)
      class(ledger_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(families_type), intent(in) :: families
      real(wp), intent(in), contiguous :: d(:, :)   !! (6, nb) unknowns of the step
      if (context%state%step == 0) then
         ! springs that begin with the force of the initial stress
         associate (table => families%contacts%table)
            self%contact_energy = sum(table%energy(1:table%n))
            self%at_start = self%at_start + self%contact_energy
         end associate
      end if
      self%before = self%total
      self%other_energy = 0
      call families%add_energies(context, attempt, d, self)
   end subroutine add_step

   !> Energies of the moved blocks and the share that k01 takes; close the balance, and judge the columns `discarded`
   !> and `geometry`. With an impact the velocities are not those of the step's equations: what the balance lacks is
   !> what the impact has taken.
   subroutine close_step(self, context, attempt, families, k01, impact)
      class(ledger_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context   !! blocks have moved; time and step are those of the start
      type(attempt_type), intent(in) :: attempt
      type(families_type), intent(in) :: families
      real(wp), intent(in) :: k01                      !! share of the velocity that is carried on
      logical, intent(in) :: impact                    !! some contacts have closed by the law of impact
      real(wp) :: residual
      integer :: column
      call families%add_moved_energies(context, self)
      if (.not. impact) call self%add(energy%geometry, (self%moved(1) - self%predicted(1)) + &
                                      (self%moved(2) - self%predicted(2)))
      residual = self%total(energy%residual)
      call self%add(energy%discarded, (1 - k01**2)*self%moved(1))
      self%total(energy%kinetic) = k01**2*self%moved(1)
      self%total(energy%strain) = self%moved(2)
      self%total(energy%springs) = self%contact_energy + sum(self%fixed_energy) + self%bolt_energy + &
                                   sum(self%boundary_energy) + self%other_energy + self%bar_energy
      self%total(energy%residual) = (sum(self%total(1:4)) - self%at_start) - self%total(energy%external) &
                                    + self%total(energy%friction) + self%total(energy%dissipated) &
                                    + self%total(energy%discarded) - self%total(energy%geometry)
      if (impact) then
         call self%add(energy%dissipated, residual - self%total(energy%residual))
         self%total(energy%residual) = residual
      end if
      do column = 1, 2
         associate (most => self%most_given(:, column))
            call self%given%add_contact(column, most(1), context%state%step + 1, nint(most(2)), nint(most(3)), &
                                        most(4:5))
         end associate
      end do
      if (.not. allocated(self%holds)) allocate (self%holds(context%blocks%n_blocks))
      call context%blocks%count_holds(self%holds, attempt%released, context%held)
      associate (parameters => context%parameters)
         call self%given%add_step(self%before, self%total, [-self%step_discarded, &
                                  self%total(energy%geometry) - self%before(energy%geometry)], &
                                  free_weight(families%loads%weight, self%holds), parameters%w0, &
                                  families%contacts%table%n, parameters%normal_stiffness)
      end associate
   end subroutine close_step

   !> Weight of all blocks but those that are held, which can neither fall nor be thrown: a heavy floor must not hide
   !> what is given to a light block.
   pure real(wp) function free_weight(weight, holds) result(total)
      real(wp), intent(in) :: weight(:, :)   !! (2, nb) [force]
      real(wp), intent(in) :: holds(:)       !! (nb) a block with two cannot move
      integer :: i
      total = 0
      do i = 1, size(holds)
         if (holds(i) < 2) total = total + hypot(weight(1, i), weight(2, i))
      end do
   end function free_weight

end module rockdda_stepping_ledger
