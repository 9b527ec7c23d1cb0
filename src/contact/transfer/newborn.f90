! SPDX-License-Identifier: MIT
!> Contacts of blocks that have just been placed.
module rockdda_contact_newborn
   use rockdda_base_kinds, only : wp
   use rockdda_contact_corners, only : corner_station
   use rockdda_contact_interval_law, only : n_points
   use rockdda_contact_outlines, only : outlines_type
   use rockdda_contact_search_limits, only : placing_share
   use rockdda_contact_table, only : contact_table_type, contact_state
   use rockdda_contact_topology, only : contact_topology_type
   implicit none
   private
   public :: touch_newborn

contains

   !> The contacts of blocks that have just been placed: gaps and overlaps that are small against the shorter edge are
   !> free of stress, and what touches is bonded as at the start of the run.
   subroutine touch_newborn(newborn, topology, outlines, touch, table)
      logical, intent(in) :: newborn(:)           !! (nb)
      type(contact_topology_type), intent(in) :: topology
      type(outlines_type), intent(in) :: outlines
      real(wp), intent(in) :: touch               !! [length]
      type(contact_table_type), intent(inout) :: table
      real(wp) :: shorter
      integer :: c, e, v
      do c = 1, table%n
         if (.not. (newborn(table%block_a(c)) .or. newborn(table%block_b(c)))) cycle
         if (table%partner(c) /= 0) cycle
         e = table%edge(c)
         v = table%vertex(c)
         shorter = min(outlines%length(e), outlines%length(v))
         if (table%station(c) == 0 .or. table%station(c) == corner_station) &
            shorter = min(shorter, outlines%length(topology%edge_in(v)))
         if (table%station(c) == corner_station) shorter = min(shorter, touch/placing_share)
         if (abs(table%distance(c)) > placing_share*shorter) then
            table%tied(c) = .false.
            cycle
         end if
         table%offset(c) = table%distance(c)
         table%gap(c) = 0
         table%state(c) = contact_state%locked
         table%bonded(c) = table%length(c) > 0
         table%tied(c) = table%tied(c) .and. table%bonded(c)
         table%bond_end(c) = merge(1, 0, table%bonded(c) .and. table%station(c) == n_points)
         ! ties get their stiffness with the first step
         table%k_n(c) = 0
      end do
   end subroutine touch_newborn

end module rockdda_contact_newborn
