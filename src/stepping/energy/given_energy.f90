! SPDX-License-Identifier: MIT
!> Energy that no load and no store has supplied (docs/theory.md, "Energy from nowhere").
!>
!> Two columns of the energy balance may give energy to the blocks: `discarded`, where a contact is found closed with an
!> overlap that no step has built up, and `geometry`, where the gap of a contact at the start of a step is not that of
!> the step before. What a column gives is its largest rise above an earlier value; what k01 takes away does not enter.
!> It is compared with the energy exchanged so far, the sum over the steps of the absolute changes of the kinetic,
!> strain, gravity and spring energies, of the external work, of friction and of the dissipation.
module rockdda_stepping_given_energy
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : to_string
   use rockdda_model_state, only : energy, n_energies
   implicit none
   private
   public :: given_energy_type, given_share, column_name

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
      procedure :: start
      procedure :: add_contact
      procedure :: add_step
      procedure :: false_column
      procedure :: describe
   end type given_energy_type

contains

   !> At time 0 the kinetic energy is there already.
   pure subroutine start(self, kinetic)
      class(given_energy_type), intent(inout) :: self
      real(wp), intent(in) :: kinetic
      self%sum = 0
      self%lowest = 0
      self%given = 0
      self%worst = 0
      self%dissipated = 0
      self%exchanged = kinetic
      self%scale = kinetic
   end subroutine start

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
   pure subroutine add_step(self, before, after, given, weight, w0, n_contacts, stiffness)
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
   end subroutine add_step

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

end module rockdda_stepping_given_energy
