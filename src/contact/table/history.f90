! SPDX-License-Identifier: MIT
!> Finding the rows of the last step's contact table by identity (vertex, edge, station).
module rockdda_contact_history
   use rockdda_contact_table, only : contact_table_type
   implicit none
   private
   public :: contact_history_type, new_contact_history

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

end module rockdda_contact_history
