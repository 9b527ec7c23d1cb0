! SPDX-License-Identifier: MIT
!> Contacts whose forces miss their laws by more than is accepted, after a round of the open-close iteration.
module rockdda_interaction_unsettled
   use rockdda_base_kinds, only : wp
   use rockdda_base_parallel, only : parallel_contacts
   use rockdda_contact_table, only : contact_table_type
   use rockdda_interaction_open_close, only : open_close_type
   implicit none
   private
   public :: count_unsettled, largest_normal

contains

   !> Contacts that the rounds have not settled: the force that the last solve gave them misses their law at its motion
   !> by more than `tolerance` times the largest force on the less loaded of their two blocks, and, if it is only the
   !> friction force of a contact that goes on sliding, by more than `small`. Forces on a block are the normal forces of
   !> its contacts and the one given, its weight: in blocks that fall together normal forces are rounding.
   subroutine count_unsettled(trial, table, tolerance, small, largest, n)
      type(open_close_type), intent(in) :: trial
      type(contact_table_type), intent(in) :: table
      real(wp), intent(in) :: tolerance
      real(wp), intent(in) :: small           !! [force]
      real(wp), intent(inout) :: largest(:)   !! (blocks) weight on entry [force]; the largest force
      integer, intent(out) :: n
      real(wp) :: allowed
      integer :: c
      n = 0
      !$omp parallel do default(none) shared(trial, table) private(c) reduction(+:n) schedule(static) &
      !$omp if (table%n > parallel_contacts)
      do c = 1, table%n
         if (trial%miss(c) > 0) n = n + 1
      end do
      !$omp end parallel do
      if (n == 0) return
      n = 0
      do c = 1, table%n
         associate (a => table%block_a(c), b => table%block_b(c), force => trial%normal_force(c))
            largest(a) = max(largest(a), force)
            largest(b) = max(largest(b), force)
         end associate
      end do
      do c = 1, table%n
         if (.not. trial%miss(c) > 0) cycle
         allowed = tolerance*min(largest(table%block_a(c)), largest(table%block_b(c)))
         if (trial%joint(c)%state == trial%state_used(c) .and. trial%joint(c)%slip_sign == trial%sign_used(c)) &
            allowed = max(allowed, small)
         if (trial%miss(c) > allowed) n = n + 1
      end do
   end subroutine count_unsettled

   !> Largest normal force of the last solve, of n contacts.
   real(wp) function largest_normal(trial, n) result(largest)
      type(open_close_type), intent(in) :: trial
      integer, intent(in) :: n
      integer :: c
      largest = 0
      !$omp parallel do default(none) shared(trial, n) private(c) reduction(max:largest) schedule(static) &
      !$omp if (n > parallel_contacts)
      do c = 1, n
         largest = max(largest, abs(trial%normal_force(c)))
      end do
      !$omp end parallel do
   end function largest_normal

end module rockdda_interaction_unsettled
