! SPDX-License-Identifier: MIT
!> Finding the rows of the last step's contact table by identity (vertex, edge, station).
!>
!> Closed joints that are turned further than the angle tolerance.
!>
!> Edges begin to face each other within the angle tolerance. What carries force stays an interval beyond that: of
!> soft joints up to a larger angle, where corners take its place with its force and its energy; held by a bond that
!> bears tension up to a right angle.
module rockdda_contact_history
   use rockdda_contact_table, only : contact_table_type, contact_state
   use rockdda_base_kinds, only : wp
   use rockdda_contact_outlines, only : outlines_type
   use rockdda_contact_search_limits, only : search_limits_type
   implicit none
   private
   public :: contact_history_type, new_contact_history, faces, held_cosine, pressed_cosine

   !> Cosine of the angle up to which a joint that is pressed together stays an interval: 0.2.
   real(wp), parameter :: pressed_cosine = 0.980066577841241630_wp

   !> Rows of vertex v are start(v)+1 ... start(v+1): a table is sorted by vertex.
   type :: contact_history_type
      integer, allocatable :: start(:)   !! (nv + 1)
   contains
      procedure :: find
   end type contact_history_type

contains

   !> Index a table of a model with nv vertices.
   pure subroutine new_contact_history(nv, table, history)
      integer, intent(in) :: nv
      type(contact_table_type), intent(in) :: table
      type(contact_history_type), intent(inout) :: history
      integer :: c, v
      if (.not. allocated(history%start)) allocate (history%start(nv + 1))
      history%start = 0
      do c = 1, table%n
         history%start(table%vertex(c) + 1) = history%start(table%vertex(c) + 1) + 1
      end do
      do v = 2, nv + 1
         history%start(v) = history%start(v) + history%start(v - 1)
      end do
   end subroutine new_contact_history

   !> Row of (vertex, edge, station) in the indexed table, 0 when it has none.
   pure integer function find(self, table, vertex, edge, station) result(row)
      class(contact_history_type), intent(in) :: self
      type(contact_table_type), intent(in) :: table  !! the table that was indexed
      integer, intent(in) :: vertex, edge
      integer, intent(in), optional :: station       !! default 0
      integer :: wanted
      wanted = 0
      if (present(station)) wanted = station
      do row = self%start(vertex) + 1, self%start(vertex + 1)
         if (table%edge(row) == edge .and. table%station(row) == wanted) return
      end do
      row = 0
   end function find

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
      row = history%find(previous, f, e, 1)
      if (row > 0) faces = is_holding(row, -opposite, limits, previous)
   end function faces

   !> Cosine of an angle that no edges exceed which a bond holds: the least power of two times the tolerance, so that it
   !> changes seldom; up to a right angle.
   pure real(wp) function held_cosine(limits, previous, outlines) result(cosine)
      type(search_limits_type), intent(in) :: limits
      type(contact_table_type), intent(in) :: previous   !! last step's table
      type(outlines_type), intent(in) :: outlines        !! of the vertices now
      real(wp) :: least, turned
      integer :: row
      cosine = limits%cosine
      if (.not. limits%by_length) return
      least = limits%cosine
      do row = 1, previous%n
         if (previous%station(row) /= 1) cycle
         associate (t => outlines%tangent, f => previous%vertex(row), e => previous%edge(row))
            turned = -(t(1, f)*t(1, e) + t(2, f)*t(2, e))
         end associate
         if (turned >= least) cycle
         if (is_holding(row, turned, limits, previous)) least = turned
      end do
      do while (cosine > least .and. cosine > 0)
         ! of twice the angle
         cosine = max(0.0_wp, 2*cosine**2 - 1)
      end do
   end function held_cosine

   !> Does an interval, whose first row in the last step this is, hold its edges together that are turned by an angle?
   pure logical function is_holding(row, cosine, limits, previous)
      integer, intent(in) :: row
      real(wp), intent(in) :: cosine                     !! of the angle
      type(search_limits_type), intent(in) :: limits
      type(contact_table_type), intent(in) :: previous
      is_holding = previous%state(row) /= contact_state%open
      if (.not. is_holding .or. cosine >= pressed_cosine) return
      is_holding = allocated(limits%edge_joint) .and. any(previous%bonded(row:row + 1))
      if (is_holding) is_holding = limits%bears_tension(max(limits%edge_joint(previous%vertex(row)), &
                                                            limits%edge_joint(previous%edge(row))))
   end function is_holding

end module rockdda_contact_history
