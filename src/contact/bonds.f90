! SPDX-License-Identifier: MIT
!> Bonded joints that are turned further than the angle tolerance.
!>
!> Edges face each other within the angle tolerance. A bond that bears tension holds its edges together beyond that, as
!> far as its springs let them turn: as long as it lasts they face each other, up to a right angle.
module rockdda_contact_bonds
   use rockdda_base_kinds, only : wp
   use rockdda_contact_history, only : contact_history_type
   use rockdda_contact_intervals, only : most_points
   use rockdda_contact_outlines, only : outlines_type
   use rockdda_contact_search_limits, only : search_limits_type
   use rockdda_contact_table, only : contact_table_type, contact_state
   implicit none
   private
   public :: faces, held_cosine

contains

   !> Do an edge f of one block and an edge e of another, which comes later, face each other: within the angle
   !> tolerance, or held by a bond?
   pure logical function faces(f, e, opposite, limits, previous, history)
      integer, intent(in) :: f, e
      real(wp), intent(in) :: opposite                   !! dot product of their directions
      type(search_limits_type), intent(in) :: limits
      type(contact_table_type), intent(in) :: previous   !! last step's table
      type(contact_history_type), intent(in) :: history  !! its index
      integer :: row
      faces = opposite <= -limits%cosine
      if (faces .or. .not. opposite <= -limits%held_cosine) return
      do row = history%start(f) + 1, history%start(f + 1)
         if (previous%edge(row) /= e) cycle
         faces = is_holding(row, limits, previous)
         if (faces) return
      end do
   end function faces

   !> Cosine of an angle that no edges exceed which a bond holds: the least power of two times the tolerance, so that it
   !> changes seldom; up to a right angle.
   pure real(wp) function held_cosine(limits, previous, outlines) result(cosine)
      type(search_limits_type), intent(in) :: limits
      type(contact_table_type), intent(in) :: previous   !! last step's table
      type(outlines_type), intent(in) :: outlines        !! of the vertices now
      real(wp) :: least
      integer :: row
      cosine = limits%cosine
      if (.not. allocated(limits%edge_joint)) return
      least = limits%cosine
      do row = 1, previous%n
         if (.not. previous%bonded(row)) cycle
         if (.not. is_holding(row, limits, previous)) cycle
         associate (t => outlines%tangent, f => previous%vertex(row), e => previous%edge(row))
            least = min(least, -(t(1, f)*t(1, e) + t(2, f)*t(2, e)))
         end associate
      end do
      do while (cosine > least .and. cosine > 0)
         ! of twice the angle
         cosine = max(0.0_wp, 2*cosine**2 - 1)
      end do
   end function held_cosine

   !> Is a row a station of an interval whose bond bears tension?
   pure logical function is_holding(row, limits, previous)
      integer, intent(in) :: row
      type(search_limits_type), intent(in) :: limits
      type(contact_table_type), intent(in) :: previous
      is_holding = .false.
      if (.not. allocated(limits%edge_joint)) return
      if (previous%station(row) < 1 .or. previous%station(row) > most_points) return
      if (.not. previous%bonded(row) .or. previous%state(row) == contact_state%open) return
      is_holding = limits%bears_tension(max(limits%edge_joint(previous%vertex(row)), &
                                            limits%edge_joint(previous%edge(row))))
   end function is_holding

end module rockdda_contact_bonds
