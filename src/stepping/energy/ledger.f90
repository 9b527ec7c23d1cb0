! SPDX-License-Identifier: MIT
!> Energy ledger of the steps (docs/theory.md, "Energy ledger").
!>
!> balance of a run:   kinetic + strain + gravity + springs - (their sum at the start)
!>                   = external - friction - dissipated - discarded + geometry + residual
!>
!> The work of every implicit term over a step is known exactly, so that `residual` is what the solver left.
!>
!> Energy that no load and no store has supplied (docs/theory.md, "Energy from nowhere"): two columns of the balance
!> may give energy to the blocks: `discarded`, where a contact is found closed with an overlap that no step has built
!> up, and `geometry`, where the gap of a contact at the start of a step is not that of the step before. What a column
!> gives is its largest rise above an earlier value; what k01 takes away does not enter. It is compared with the energy
!> exchanged so far, the sum over the steps of the absolute changes of the kinetic, strain, gravity and spring
!> energies, of the external work, of friction and of the dissipation.
module rockdda_stepping_ledger
   use rockdda_base_kinds, only : wp
   use rockdda_model_state, only : energy, n_energies
   use rockdda_interaction_attempt, only : attempt_type
   use rockdda_interaction_balance, only : energy_balance_type
   use rockdda_interaction_bolts, only : is_there
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_families, only : families_type
   use rockdda_base_strings, only : to_string
   implicit none
   private
   public :: ledger_type, given_energy_type

   !> A column that gives more than this share of the energy exchanged, or of weight times w0, is false.
   real(wp), parameter :: given_share = 1.0e-3_wp
   !> Overlaps below this share of w0 are round-off: contacts may give their energy.
   real(wp), parameter :: negligible_overlap = 1.0e-9_wp
   !> Numerical dissipation may be negative for some steps, by the periods that a time scheme does not resolve; where it
   !> falls by more than this share of the energy supplied it has moved the blocks, however small that is against their
   !> weight times w0: a blow on a sliver may double the speed of what falls on it by a hair.
   real(wp), parameter :: gained_share = 0.05_wp
   !> Columns that enter the energy exchanged.
   integer, parameter :: exchanged_columns(7) = [energy%kinetic, energy%strain, energy%gravity, energy%springs, &
                                                 energy%external, energy%friction, energy%dissipated]
   character(len=*), parameter :: column_names(2) = [character(len=9) :: 'discarded', 'geometry']

   !> Part of the state of a run. Index 1: by changes of state (`discarded`), 2: by geometry.
   type :: given_energy_type
      real(wp) :: exchanged = 0        !! energy exchanged so far
      real(wp) :: sum(2) = 0           !! given less taken since the start
      real(wp) :: lowest(2) = 0        !! smallest value of `sum` so far
      real(wp) :: given(2) = 0         !! largest rise of `sum` above an earlier value
      real(wp) :: scale = 0            !! energy that the given one is compared with
      real(wp) :: round_off = 0        !! energy of negligible overlaps
      real(wp) :: dissipated = 0       !! largest value of numerical dissipation so far
      !> (6, 2) of the contact that gave most in one step: amount, step, blocks (from 1), point
      real(wp) :: worst(6, 2) = 0
   contains
      procedure :: start => start_given
      procedure :: add_contact
      procedure :: add_step => add_given
      procedure :: false_column
      procedure :: describe
   end type given_energy_type

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

   !> At time 0 the kinetic energy is there already.
   pure subroutine start_given(self, kinetic)
      class(given_energy_type), intent(inout) :: self
      real(wp), intent(in) :: kinetic
      self%sum = 0
      self%lowest = 0
      self%given = 0
      self%worst = 0
      self%dissipated = 0
      self%exchanged = kinetic
      self%scale = kinetic
   end subroutine start_given

   !> The contact that gave most in a step, if it is the largest amount so far.
   pure subroutine add_contact(self, column, amount, step, block_a, block_b, point)
      class(given_energy_type), intent(inout) :: self
      integer, intent(in) :: column      !! 1 or 2
      real(wp), intent(in) :: amount     !! [energy]
      integer, intent(in) :: step, block_a, block_b
      real(wp), intent(in) :: point(2)   !! [length]
      if (amount > self%worst(1, column)) self%worst(:, column) = [amount, real(step, wp), real(block_a, wp), &
                                                                   real(block_b, wp), point]
   end subroutine add_contact

   !> One accepted step.
   pure subroutine add_given(self, before, after, given, weight, w0, n_contacts, stiffness)
      class(given_energy_type), intent(inout) :: self
      real(wp), intent(in) :: before(n_energies), after(n_energies)   !! columns of the balance
      real(wp), intent(in) :: given(2)     !! less taken, in this step: by changes of state, by geometry
      real(wp), intent(in) :: weight       !! sum over the blocks that are not held [force]
      real(wp), intent(in) :: w0           !! [length]
      integer, intent(in) :: n_contacts
      real(wp), intent(in) :: stiffness    !! of a contact [force/length]
      self%exchanged = self%exchanged + sum(abs(after(exchanged_columns) - before(exchanged_columns)))
      self%dissipated = max(self%dissipated, after(energy%dissipated))
      self%sum = self%sum + given
      self%lowest = min(self%lowest, self%sum)
      self%given = max(self%given, self%sum - self%lowest)
      self%round_off = 0.5_wp*n_contacts*stiffness*(negligible_overlap*w0)**2
      self%scale = max(self%exchanged, weight*w0) + self%round_off/given_share
   end subroutine add_given

   !> Column that gives most, where that is more than it may; else 0.
   pure integer function false_column(self)
      class(given_energy_type), intent(in) :: self
      false_column = maxloc(self%given, dim=1)
      ! the negation, so that an amount that is no number counts
      if (self%given(false_column) <= given_share*self%scale) false_column = 0
      if (any(.not. abs(self%sum) <= huge(1.0_wp))) false_column = maxloc(merge(1, 0, .not. abs(self%sum) <= &
                                                                                huge(1.0_wp)), dim=1)
   end function false_column

   !> What is wrong, where, and advice; empty where nothing is.
   pure function describe(self, step, dissipation, supplied) result(text)
      class(given_energy_type), intent(in) :: self
      integer, intent(in) :: step            !! present one
      real(wp), intent(in) :: dissipation    !! column of the balance [energy]
      real(wp), intent(in) :: supplied       !! at the start, by gravity and by external work [energy]
      character(len=:), allocatable :: text
      real(wp) :: regained
      integer :: column
      column = self%false_column()
      text = ''
      if (column == 0) then
         ! what impacts and dampers took before does not excuse it
         regained = self%dissipated - dissipation
         if (regained > max(gained_share*supplied, given_share*self%exchanged) + self%round_off) &
            text = 'energy from nowhere: up to step '//to_string(step)// &
               " the energy column 'numerical_dissipation' "// &
                   'gave '//to_string(regained)//', '//to_string(regained/supplied)//' of the energy '// &
                   'supplied so far (at most '//to_string(gained_share)// &
                      ' is accepted): impacts within a step have '// &
                   'thrown blocks. Give joints a restitution, or use shorter steps'
         return
      end if
      associate (w => self%worst(:, column))
         text = 'energy from nowhere: up to step '//to_string(step)//" the energy column '"//column_name(column)// &
                "' gave "//to_string(self%given(column))//', '//to_string(self%given(column)/self%scale)// &
                ' of the larger of the energy exchanged so far and weight of free blocks times w0 (at most '// &
                to_string(given_share)//' is accepted)'
         if (w(1) > 0) text = text//'; most at one contact: '//to_string(w(1))//' in step '// &
                              to_string(nint(w(2)))//' where block '//to_string(nint(w(3)))//' meets block '// &
                              to_string(nint(w(4)))//' at ('//to_string(w(5))//', '//to_string(w(6))//')'
         text = text//'. Check for blocks that overlap at the start, and use shorter steps (g1, g2)'
      end associate
   end function describe

   !> Name of the column in the results.
   pure function column_name(column) result(name)
      integer, intent(in) :: column   !! 1 or 2
      character(len=:), allocatable :: name
      name = trim(column_names(column))
   end function column_name

end module rockdda_stepping_ledger
