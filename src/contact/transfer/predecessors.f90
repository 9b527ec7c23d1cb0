! SPDX-License-Identifier: MIT
!> Rows of the last step's contact table in whose place a row of another identity stands, with contact by length: an
!> edge that comes down on its corner turns a vertex into the end of an interval, and back.
module rockdda_contact_predecessors
   use rockdda_contact_corners, only : corner_station
   use rockdda_contact_history, only : contact_history_type
   use rockdda_contact_interval_law, only : n_points
   use rockdda_contact_table, only : contact_table_type, contact_state
   use rockdda_contact_topology, only : contact_topology_type
   implicit none
   private
   public :: predecessor

contains

   !> Row of the last step in whose place row k stands, 0 none: a contact of the same corner, closed and as it lay on
   !> an edge, on a corner or at the end of an interval. Long by its small searches, each for one kind of row.
   pure integer function predecessor(k, previous, history, topology, table) result(row)
      integer, intent(in) :: k
      type(contact_table_type), intent(in) :: previous
      type(contact_history_type), intent(in) :: history
      type(contact_topology_type), intent(in) :: topology
      type(contact_table_type), intent(in) :: table
      integer :: f, e, w
      f = table%vertex(k)
      e = table%edge(k)
      row = 0
      select case (table%station(k))
      case (0)
         row = end_row(topology%edge_in(f), e)
         if (row == 0) row = end_row(topology%edge_out(f), e)
         if (row == 0) row = corner_row(f, topology%owner(e))
         if (row == 0) row = corner_row(f, topology%owner(topology%next(e)))
      case (corner_station)
         w = e
         row = vertex_row(f, topology%edge_in(w))
         if (row == 0) row = vertex_row(f, topology%edge_out(w))
         if (row == 0) row = vertex_row(w, topology%edge_in(f))
         if (row == 0) row = vertex_row(w, topology%edge_out(f))
         if (row == 0) row = end_row(topology%edge_in(f), topology%edge_out(w))
         if (row == 0) row = end_row(topology%edge_out(f), topology%edge_in(w))
      case (1)
         row = vertex_row(topology%next(f), e)
         if (row == 0) row = vertex_row(e, f)
         if (row == 0) row = corner_row(topology%next(f), e)
      case default
         row = vertex_row(f, e)
         if (row == 0) row = vertex_row(topology%next(e), f)
         if (row == 0) row = corner_row(f, topology%next(e))
      end select

   contains

      !> A vertex on an edge.
      pure integer function vertex_row(v, edge)
         integer, intent(in) :: v, edge
         vertex_row = closed_row(history%find(previous, topology%owner(v), edge))
      end function vertex_row

      !> A corner on a corner.
      pure integer function corner_row(a, b)
         integer, intent(in) :: a, b
         if (topology%block(a) < topology%block(b)) then
            corner_row = closed_row(history%find(previous, a, b, corner_station))
         else
            corner_row = closed_row(history%find(previous, b, a, corner_station))
         end if
      end function corner_row

      !> The end of the interval of an edge at vertex f and another edge.
      pure integer function end_row(own, other)
         integer, intent(in) :: own, other
         integer :: n
         logical :: is_first, is_high
         is_first = topology%block(own) < topology%block(other)
         ! the first point is that near the last vertex of the first block's edge
         is_high = topology%edge_out(f) == own .eqv. is_first
         n = merge(n_points, 1, is_high)
         if (is_first) end_row = closed_row(history%find(previous, own, other, n))
         if (.not. is_first) end_row = closed_row(history%find(previous, other, own, n))
      end function end_row

      !> A row of the last step when it was closed, else 0.
      pure integer function closed_row(found)
         integer, intent(in) :: found
         closed_row = 0
         if (found == 0) return
         if (previous%state(found) /= contact_state%open) closed_row = found
      end function closed_row

   end function predecessor

end module rockdda_contact_predecessors
