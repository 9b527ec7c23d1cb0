! SPDX-License-Identifier: MIT
!> The contact table of a step: search, geometry, and the history handed on from the last step's table.
!>
!> Rows come out sorted by (vertex, edge), hence by (block_a, vertex, block_b, edge), whatever the order in which
!> they were found. The pairs of blocks are searched in a few parts, one after the other or side by side; what is found
!> in a pair depends on nothing but the pair.
module rockdda_contact_search
   use rockdda_base_kinds, only : wp
   use rockdda_base_parallel, only : parallel_contacts
   use rockdda_base_room, only : reserve
   use rockdda_model_blocks, only : block_system_type
   use rockdda_contact_table, only : contact_table_type, contact_state
   use rockdda_contact_topology, only : contact_topology_type
   use rockdda_contact_history, only : contact_history_type, new_contact_history
   use rockdda_contact_outlines, only : outlines_type
   use rockdda_contact_broad_phase, only : close_pairs_type
   use rockdda_contact_candidates, only : candidate_list_type
   use rockdda_contact_narrow_phase, only : search_limits_type, search_pair
   implicit none
   private
   public :: contact_search_type, search_limits_type

   !> Parts of the narrow phase in a large model.
   integer, parameter :: many_parts = 16

   !> Scratch of the search; one per run, nothing in it is part of the state.
   type :: contact_search_type
      type(close_pairs_type) :: pairs
      type(outlines_type) :: outlines
      type(candidate_list_type) :: found(many_parts)  !! candidate rows of each part
      type(candidate_list_type) :: list               !! of all parts
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
      real(wp), intent(in), contiguous :: vertices(:, :)               !! (2, nv) now
      type(search_limits_type), intent(in) :: limits
      type(contact_table_type), intent(in) :: previous     !! last step's table
      logical, intent(in) :: first_step                    !! touching contacts are born bonded
      real(wp), intent(in) :: touch                        !! gap below which two blocks touch at the start [length]
      type(contact_table_type), intent(inout) :: table
      integer :: part, n_parts

      call self%pairs%update(blocks, vertices, limits%reach)
      call self%outlines%update(topology, vertices, limits%sine)
      call new_contact_history(size(vertices, 2), previous, self%history)
      n_parts = merge(many_parts, 1, self%pairs%n > parallel_contacts)
      !$omp parallel do default(none) shared(self, blocks, topology, vertices, limits, previous, n_parts) &
      !$omp private(part) schedule(dynamic) if (n_parts > 1)
      do part = 1, n_parts
         call search_part(part, n_parts, self%pairs, blocks, topology, self%outlines, vertices, limits, previous, &
                          self%history, self%found(part))
      end do
      !$omp end parallel do
      call self%list%collect(self%found(1:n_parts))
      call sort_candidates(self%list, size(vertices, 2), self%start, self%order)
      call fill_table(blocks, topology, self%outlines, vertices, limits, self%list, self%order, self%start, table)
      call hand_on_history(previous, self%history, self%list, self%order, first_step, touch, table)
   end subroutine search_contacts

   !> Candidate rows of one part of the pairs.
   pure subroutine search_part(part, n_parts, pairs, blocks, topology, outlines, vertices, limits, previous, history, &
                               list)
      integer, intent(in) :: part, n_parts
      type(close_pairs_type), intent(in) :: pairs
      type(block_system_type), intent(in) :: blocks
      type(contact_topology_type), intent(in) :: topology
      type(outlines_type), intent(in) :: outlines
      real(wp), intent(in), contiguous :: vertices(:, :)
      type(search_limits_type), intent(in) :: limits
      type(contact_table_type), intent(in) :: previous
      type(contact_history_type), intent(in) :: history
      type(candidate_list_type), intent(inout) :: list
      integer :: k, a, b
      list%n = 0
      do k = first_of(part), first_of(part + 1) - 1
         if (.not. pairs%is_close(k)) cycle
         a = pairs%candidates(1, k)
         b = pairs%candidates(2, k)
         call search_pair([blocks%vertex_offset(a) + 1, blocks%vertex_offset(a + 1)], &
                          [blocks%vertex_offset(b) + 1, blocks%vertex_offset(b + 1)], &
                          pairs%boxes(:, a), pairs%boxes(:, b), vertices, topology, outlines, previous, history, &
                          limits, list)
      end do

   contains

      !> First pair of a part.
      pure integer function first_of(part)
         integer, intent(in) :: part
         first_of = int(real(part - 1, wp)/n_parts*pairs%n) + 1
      end function first_of

   end subroutine search_part

   !> Order of the candidates by (vertex, edge): counting sort by vertex, insertion sort within.
   pure subroutine sort_candidates(list, nv, start, order)
      type(candidate_list_type), intent(in) :: list
      integer, intent(in) :: nv
      integer, allocatable, intent(inout) :: start(:)  !! (nv + 1) rows of vertex v: start(v)+1 ... start(v+1)
      integer, allocatable, intent(inout) :: order(:)
      integer :: c, v, k, l
      if (.not. allocated(start)) allocate (start(nv + 1))
      call reserve(order, list%n)
      start = 0
      do c = 1, list%n
         start(list%rows(c)%vertex + 1) = start(list%rows(c)%vertex + 1) + 1
      end do
      do v = 2, nv + 1
         start(v) = start(v) + start(v - 1)
      end do
      order(1:list%n) = 0
      do c = 1, list%n
         v = list%rows(c)%vertex
         k = start(v) + 1
         start(v) = k
         ! insert among the rows of this vertex that are already placed; a place still empty belongs to another vertex
         l = k - 1
         do while (l >= 1)
            if (order(l) == 0) exit
            if (list%rows(order(l))%vertex /= v) exit
            if (list%rows(order(l))%edge <= list%rows(c)%edge) exit
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
   subroutine fill_table(blocks, topology, outlines, vertices, limits, list, order, start, table)
      type(block_system_type), intent(in) :: blocks
      type(contact_topology_type), intent(in) :: topology
      type(outlines_type), intent(in) :: outlines
      real(wp), intent(in), contiguous :: vertices(:, :)
      type(search_limits_type), intent(in) :: limits
      type(candidate_list_type), intent(in) :: list
      integer, intent(in) :: order(:), start(:)
      type(contact_table_type), intent(inout) :: table
      integer :: c, k, v, e, row
      call table%resize(list%n)
      !$omp parallel do default(none) schedule(static) private(c, k, v, e, row) &
      !$omp shared(blocks, topology, outlines, vertices, limits, list, order, start, table) &
      !$omp if (list%n > parallel_contacts)
      do k = 1, list%n
         c = order(k)
         v = list%rows(c)%vertex
         e = list%rows(c)%edge
         table%vertex(k) = v
         table%edge(k) = e
         table%block_a(k) = topology%block(v)
         table%block_b(k) = topology%block(e)
         table%joint(k) = blocks%edge_joint(e)
         table%partner(k) = 0
         if (list%rows(c)%partner_vertex > 0) then
            do row = start(list%rows(c)%partner_vertex) + 1, start(list%rows(c)%partner_vertex + 1)
               if (list%rows(order(row))%edge == list%rows(c)%partner_edge) table%partner(k) = row
            end do
         end if
         call set_geometry(v, e, topology%edge_in(v), topology%next(topology%edge_out(v)), size(vertices, 2), &
                           vertices, outlines%tangent, outlines%length(e), limits%sine, table%normal(:, k), &
                           table%point(:, k), table%gap(k), table%length(k))
      end do
      !$omp end parallel do
   end subroutine fill_table

   !> Normal, place, gap and length of a contact. The length is half the overlap of the edge with each edge at the
   !> vertex that lies face to face with it; zero for a lone vertex.
   pure subroutine set_geometry(v, e, before, after, nv, vertices, tangent, edge_length, sine, normal, point, gap, &
                                length)
      integer, intent(in) :: v, e              !! vertex and edge
      integer, intent(in) :: before, after     !! the vertices before and after v on its block
      integer, intent(in) :: nv
      real(wp), intent(in) :: vertices(2, nv), tangent(2, nv)
      real(wp), intent(in) :: edge_length
      real(wp), intent(in) :: sine             !! of the angle tolerance
      real(wp), intent(out) :: normal(2), point(2), gap, length
      real(wp) :: t(2), p(2), u(2), s0, s1, overlap
      integer :: k
      t = tangent(:, e)
      normal = [t(2), -t(1)]
      point = vertices(:, v)
      p = point - vertices(:, e)
      gap = dot_product(p, normal)
      s0 = p(1)*t(1) + p(2)*t(2)
      length = 0
      do k = 1, 2
         u = vertices(:, merge(after, before, k == 1)) - point
         s1 = u(1)*t(1) + u(2)*t(2)
         ! out edge runs against the edge, in edge comes along it backwards
         if ((k == 1 .and. s1 >= 0) .or. (k == 2 .and. s1 <= 0)) cycle
         if (abs(u(1)*t(2) - u(2)*t(1)) > sine*sqrt(u(1)**2 + u(2)**2)) cycle
         overlap = min(edge_length, max(s0, s0 + s1)) - max(0.0_wp, min(s0, s0 + s1))
         length = length + 0.5_wp*max(0.0_wp, overlap)
      end do
   end subroutine set_geometry

   !> State, shear spring, forces and bond of a contact stay with its identity, or come from its alias: seen from the
   !> other block, gap and slip have the same sign.
   subroutine hand_on_history(previous, history, list, order, first_step, touch, table)
      type(contact_table_type), intent(in) :: previous
      type(contact_history_type), intent(in) :: history
      type(candidate_list_type), intent(in) :: list
      integer, intent(in) :: order(:)
      logical, intent(in) :: first_step
      real(wp), intent(in) :: touch
      type(contact_table_type), intent(inout) :: table
      integer :: k, row
      !$omp parallel do default(none) shared(previous, history, list, order, first_step, touch, table) private(k, row) &
      !$omp schedule(static) if (table%n > parallel_contacts)
      do k = 1, table%n
         if (list%rows(order(k))%alias_vertex > 0) then
            row = history%find(previous, list%rows(order(k))%alias_vertex, list%rows(order(k))%alias_edge)
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
            call table%open_row(k)
            table%bonded(k) = first_step .and. abs(table%gap(k)) <= touch .and. table%length(k) > 0
            ! what touches at the start is in contact; the first solve tells what stays so
            if (first_step .and. abs(table%gap(k)) <= touch .and. table%partner(k) == 0) &
               table%state(k) = contact_state%locked
         end if
      end do
      !$omp end parallel do
      ! of two partners at most one is closed: the one with the larger gap stays
      do k = 1, table%n
         row = table%partner(k)
         if (row <= k) cycle
         if (table%state(k) == contact_state%open .or. table%state(row) == contact_state%open) cycle
         if (table%gap(k) >= table%gap(row)) then
            call table%open_row(row)
         else
            call table%open_row(k)
         end if
      end do
   end subroutine hand_on_history

end module rockdda_contact_search
