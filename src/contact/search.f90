! SPDX-License-Identifier: MIT
!> The contact table of a step: search, geometry, and the history handed on from the last step's table.
!>
!> Rows come out sorted by (vertex, edge), hence by (block_a, vertex, block_b, edge), whatever the order in which
!> they were found.
module rockdda_contact_search
   use rockdda_base_kinds, only : wp
   use rockdda_model_blocks, only : block_system_type
   use rockdda_contact_table, only : contact_table_type, contact_state
   use rockdda_contact_topology, only : contact_topology_type
   use rockdda_contact_history, only : contact_history_type, new_contact_history
   use rockdda_contact_broad_phase, only : find_close_pairs
   use rockdda_contact_narrow_phase, only : candidate_list_type, search_limits_type, search_pair
   implicit none
   private
   public :: contact_search_type, search_limits_type

   !> Scratch of the search; one per run, nothing in it is part of the state.
   type :: contact_search_type
      real(wp), allocatable :: boxes(:, :)   !! (4, nb)
      integer, allocatable :: pairs(:, :)    !! (2, >= n_pairs) close pairs of blocks
      integer :: n_pairs = 0
      type(candidate_list_type) :: list
      type(contact_history_type) :: history
      integer, allocatable :: order(:), start(:)
   contains
      procedure :: run => search_contacts
   end type contact_search_type

contains

   !> Fill `table` with every contact within the limits; history comes from `previous`.
   subroutine search_contacts(self, blocks, topology, vertices, limits, previous, first_step, touch, table)
      class(contact_search_type), intent(inout) :: self
      type(block_system_type), intent(in) :: blocks
      type(contact_topology_type), intent(in) :: topology
      real(wp), intent(in) :: vertices(:, :)               !! (2, nv) now
      type(search_limits_type), intent(in) :: limits
      type(contact_table_type), intent(in) :: previous     !! last step's table
      logical, intent(in) :: first_step                    !! touching contacts are born bonded
      real(wp), intent(in) :: touch                        !! gap below which two blocks touch at the start [length]
      type(contact_table_type), intent(inout) :: table
      integer :: k, a, b
      integer :: range_a(2), range_b(2)

      call update_boxes(blocks, vertices, self%boxes)
      call find_close_pairs(self%boxes, limits%reach, self%pairs, self%n_pairs)
      call new_contact_history(size(vertices, 2), previous, self%history)
      self%list%n = 0
      do k = 1, self%n_pairs
         a = self%pairs(1, k)
         b = self%pairs(2, k)
         range_a = [blocks%vertex_offset(a) + 1, blocks%vertex_offset(a + 1)]
         range_b = [blocks%vertex_offset(b) + 1, blocks%vertex_offset(b + 1)]
         call search_pair(range_a, range_b, self%boxes(:, [a, b]), vertices, topology, previous, self%history, &
                          limits, self%list)
      end do
      call sort_candidates(self%list, size(vertices, 2), self%start, self%order)
      call fill_table(blocks, topology, vertices, limits, self%list, self%order, self%start, table)
      call hand_on_history(previous, self%history, self%list, self%order, first_step, touch, table)
   end subroutine search_contacts

   !> Bounding boxes of all blocks.
   pure subroutine update_boxes(blocks, vertices, boxes)
      type(block_system_type), intent(in) :: blocks
      real(wp), intent(in) :: vertices(:, :)
      real(wp), allocatable, intent(inout) :: boxes(:, :)
      integer :: i, first, last
      if (.not. allocated(boxes)) allocate (boxes(4, blocks%n_blocks))
      do i = 1, blocks%n_blocks
         first = blocks%vertex_offset(i) + 1
         last = blocks%vertex_offset(i + 1)
         boxes(1, i) = minval(vertices(1, first:last))
         boxes(2, i) = minval(vertices(2, first:last))
         boxes(3, i) = maxval(vertices(1, first:last))
         boxes(4, i) = maxval(vertices(2, first:last))
      end do
   end subroutine update_boxes

   !> Order of the candidates by (vertex, edge): counting sort by vertex, insertion sort within.
   pure subroutine sort_candidates(list, nv, start, order)
      type(candidate_list_type), intent(in) :: list
      integer, intent(in) :: nv
      integer, allocatable, intent(inout) :: start(:)  !! (nv + 1) rows of vertex v: start(v)+1 ... start(v+1)
      integer, allocatable, intent(inout) :: order(:)
      integer :: c, v, k, l
      if (.not. allocated(start)) allocate (start(nv + 1))
      if (allocated(order)) then
         if (size(order) < list%n) deallocate (order)
      end if
      if (.not. allocated(order)) allocate (order(list%n + list%n/4 + 16))
      start = 0
      do c = 1, list%n
         start(list%vertex(c) + 1) = start(list%vertex(c) + 1) + 1
      end do
      do v = 2, nv + 1
         start(v) = start(v) + start(v - 1)
      end do
      order(1:list%n) = 0
      do c = 1, list%n
         v = list%vertex(c)
         k = start(v) + 1
         start(v) = k
         ! insert among the rows of this vertex that are already placed; a place still empty belongs to another vertex
         l = k - 1
         do while (l >= 1)
            if (order(l) == 0) exit
            if (list%vertex(order(l)) /= v) exit
            if (list%edge(order(l)) <= list%edge(c)) exit
            order(l + 1) = order(l)
            l = l - 1
         end do
         order(l + 1) = c
      end do
      do v = nv + 1, 2, -1
         start(v) = start(v - 1)
      end do
      start(1) = 0
   end subroutine sort_candidates

   !> Rows of the table from the ordered candidates: identity, partner, geometry.
   pure subroutine fill_table(blocks, topology, vertices, limits, list, order, start, table)
      type(block_system_type), intent(in) :: blocks
      type(contact_topology_type), intent(in) :: topology
      real(wp), intent(in) :: vertices(:, :)
      type(search_limits_type), intent(in) :: limits
      type(candidate_list_type), intent(in) :: list
      integer, intent(in) :: order(:), start(:)
      type(contact_table_type), intent(inout) :: table
      real(wp) :: t(2), length
      integer :: c, k, v, e, row
      call table%resize(list%n)
      do k = 1, list%n
         c = order(k)
         v = list%vertex(c)
         e = list%edge(c)
         table%vertex(k) = v
         table%edge(k) = e
         table%block_a(k) = topology%block(v)
         table%block_b(k) = topology%block(e)
         table%joint(k) = blocks%edge_joint(e)
         table%partner(k) = 0
         if (list%partner_vertex(c) > 0) then
            do row = start(list%partner_vertex(c)) + 1, start(list%partner_vertex(c) + 1)
               if (list%edge(order(row)) == list%partner_edge(c)) table%partner(k) = row
            end do
         end if
         t = vertices(:, topology%next(e)) - vertices(:, e)
         length = sqrt(t(1)**2 + t(2)**2)
         t = t/length
         table%normal(:, k) = [t(2), -t(1)]
         table%point(:, k) = vertices(:, v)
         table%gap(k) = dot_product(vertices(:, v) - vertices(:, e), table%normal(:, k))
         table%length(k) = contact_length(vertices, topology, v, e, t, length, limits)
      end do
   end subroutine fill_table

   !> Half the overlap of the edge with each edge at the vertex that lies face to face with it;
   !> zero for a lone vertex.
   pure real(wp) function contact_length(vertices, topology, v, e, t, length, limits)
      real(wp), intent(in) :: vertices(:, :), t(2), length
      type(contact_topology_type), intent(in) :: topology
      integer, intent(in) :: v, e
      type(search_limits_type), intent(in) :: limits
      real(wp) :: q(2), u(2), s0, s1, overlap
      integer :: k
      contact_length = 0
      s0 = dot_product(vertices(:, v) - vertices(:, e), t)
      do k = 1, 2
         if (k == 1) then
            q = vertices(:, topology%next(topology%edge_out(v)))
         else
            q = vertices(:, topology%edge_in(v))
         end if
         u = q - vertices(:, v)
         s1 = dot_product(u, t)
         ! out edge runs against the edge, in edge comes along it backwards
         if ((k == 1 .and. s1 >= 0) .or. (k == 2 .and. s1 <= 0)) cycle
         if (abs(u(1)*t(2) - u(2)*t(1)) > limits%sine*sqrt(u(1)**2 + u(2)**2)) cycle
         overlap = min(length, max(s0, s0 + s1)) - max(0.0_wp, min(s0, s0 + s1))
         contact_length = contact_length + 0.5_wp*max(0.0_wp, overlap)
      end do
   end function contact_length

   !> State, shear spring, forces and bond of a contact stay with its identity, or come from its alias: seen from the
   !> other block, gap and slip have the same sign.
   pure subroutine hand_on_history(previous, history, list, order, first_step, touch, table)
      type(contact_table_type), intent(in) :: previous
      type(contact_history_type), intent(in) :: history
      type(candidate_list_type), intent(in) :: list
      integer, intent(in) :: order(:)
      logical, intent(in) :: first_step
      real(wp), intent(in) :: touch
      type(contact_table_type), intent(inout) :: table
      integer :: k, row
      do k = 1, table%n
         if (list%alias_vertex(order(k)) > 0) then
            row = history%find(previous, list%alias_vertex(order(k)), list%alias_edge(order(k)))
         else
            row = history%find(previous, table%vertex(k), table%edge(k))
         end if
         if (row > 0) then
            table%state(k) = previous%state(row)
            table%shear(k) = previous%shear(row)
            table%normal_force(k) = previous%normal_force(row)
            table%shear_force(k) = previous%shear_force(row)
            table%bonded(k) = previous%bonded(row)
            table%slip_sign(k) = previous%slip_sign(row)
            table%total_slip(k) = previous%total_slip(row)
            table%energy(k) = previous%energy(row)
         else
            table%state(k) = contact_state%open
            table%shear(k) = 0
            table%normal_force(k) = 0
            table%shear_force(k) = 0
            table%slip_sign(k) = 0
            table%total_slip(k) = 0
            table%energy(k) = 0
            table%bonded(k) = first_step .and. abs(table%gap(k)) <= touch .and. table%length(k) > 0
            ! what touches at the start is in contact; the first solve tells what stays so
            if (first_step .and. abs(table%gap(k)) <= touch .and. table%partner(k) == 0) &
               table%state(k) = contact_state%locked
         end if
      end do
      ! of two partners at most one is closed: the one with the larger gap stays
      do k = 1, table%n
         row = table%partner(k)
         if (row <= k) cycle
         if (table%state(k) == contact_state%open .or. table%state(row) == contact_state%open) cycle
         if (table%gap(k) >= table%gap(row)) then
            call open_row(table, row)
         else
            call open_row(table, k)
         end if
      end do
   end subroutine hand_on_history

   !> Forget a closed contact.
   pure subroutine open_row(table, k)
      type(contact_table_type), intent(inout) :: table
      integer, intent(in) :: k
      table%state(k) = contact_state%open
      table%shear(k) = 0
      table%normal_force(k) = 0
      table%shear_force(k) = 0
      table%slip_sign(k) = 0
      table%total_slip(k) = 0
      table%energy(k) = 0
   end subroutine open_row

end module rockdda_contact_search
