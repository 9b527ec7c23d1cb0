! SPDX-License-Identifier: MIT
!> The columns of the energy balance, to which every interaction adds its part of a step.
!>
!> An interaction reads its state and the motion of the step, and adds; it changes nothing but the columns here.
module rockdda_interaction_balance
   use rockdda_base_kinds, only : wp
   use rockdda_base_parallel, only : n_pieces
   use rockdda_model_state, only : n_energies
   implicit none
   private
   public :: energy_balance_type

   !> Sums taken at a time, at most.
   integer, parameter :: n_sums = 11

   type :: energy_balance_type
      real(wp) :: total(n_energies) = 0        !! as in step_record_type%energy
      ! in springs at the end of the last step
      real(wp) :: contact_energy = 0
      real(wp) :: resting_energy = 0           !! of it, of contacts that are left out of the step
      real(wp), allocatable :: fixed_energy(:) !! (nf) fixed points
      real(wp) :: bolt_energy = 0
      real(wp) :: bar_energy = 0               !! bolts with nodes
      real(wp), allocatable :: boundary_energy(:)
      real(wp) :: other_energy = 0             !! of interactions beside those of the program, in this step
      ! of the step
      real(wp) :: predicted(2) = 0             !! kinetic and strain energy with the masses and areas of its start
      real(wp) :: moved(2) = 0                 !! the same with those of its end, before k01
      real(wp) :: step_discarded = 0           !! by contacts
      !> (5, 2) contact that gave most by a change of state, and by geometry: amount, blocks, point
      real(wp) :: most_given(5, 2) = 0
      real(wp), allocatable :: sums(:, :)      !! (columns, >= pieces) scratch
   contains
      procedure :: add
      procedure :: make_room
   end type energy_balance_type

contains

   !> Add to one column.
   pure subroutine add(self, column, amount)
      class(energy_balance_type), intent(inout) :: self
      integer, intent(in) :: column   !! one of energy%...
      real(wp), intent(in) :: amount
      self%total(column) = self%total(column) + amount
   end subroutine add

   !> Room for the partial sums over n items.
   pure subroutine make_room(self, n)
      class(energy_balance_type), intent(inout) :: self
      integer, intent(in) :: n
      if (allocated(self%sums)) then
         if (size(self%sums, 2) >= n_pieces(n)) return
         deallocate (self%sums)
      end if
      allocate (self%sums(n_sums, n_pieces(n) + n_pieces(n)/4 + 1))
   end subroutine make_room

end module rockdda_interaction_balance
