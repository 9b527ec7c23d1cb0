! SPDX-License-Identifier: MIT
!> Rows of the contact table from the candidates that the search has found: order, identity, partner, geometry.
module rockdda_contact_rows
   use rockdda_base_kinds, only : wp, i1
   use rockdda_base_parallel, only : parallel_contacts, piece, n_pieces
   use rockdda_model_blocks, only : block_system_type
   use rockdda_contact_candidates, only : candidate_type, other_rows_type, candidate_list_type
   use rockdda_contact_corners, only : corner_type, corner_station, meet_corners
   use rockdda_contact_interval_search, only : joint_of
   use rockdda_contact_intervals, only : interval_type, station_type, measure_interval, station_of
   use rockdda_contact_outlines, only : outlines_type
   use rockdda_contact_search_limits, only : search_limits_type
   use rockdda_contact_table, only : contact_table_type
   use rockdda_contact_topology, only : contact_topology_type
   use rockdda_contact_vertex_weight, only : vertex_weight
   implicit none
   private
   public :: sort_rows, fill_table, name_blocks

contains

   !> Identities of the rows of the table, in the order (vertex, edge, station): counting sort by vertex, insertion sort
   !> within.
   pure subroutine sort_rows(lists, nv, start, others, table)
      type(candidate_list_type), intent(in) :: lists(:)                !! candidates, each once
      integer, intent(in) :: nv                                        !! vertices
      integer, allocatable, intent(inout) :: start(:)  !! (nv + 1) rows of vertex v: start(v)+1 ... start(v+1)
      type(other_rows_type), allocatable, intent(inout) :: others(:)   !! (>= rows), or of size 0 when there are none
      type(contact_table_type), intent(inout) :: table
      integer :: c, v, part
      call table%resize(sum(lists%n))
      call make_room(table%n, sum(lists%n_others), others)
      if (.not. allocated(start)) allocate (start(nv + 1))
      start = 0
      do part = 1, size(lists)
         do c = 1, lists(part)%n
            v = lists(part)%rows(c)%vertex
            start(v + 1) = start(v + 1) + 1
         end do
      end do
      do v = 2, nv + 1
         start(v) = start(v) + start(v - 1)
      end do
      table%vertex(1:table%n) = 0
      do part = 1, size(lists)
         do c = 1, lists(part)%n
            associate (row => lists(part)%rows(c))
               start(row%vertex) = start(row%vertex) + 1
               call insert(row, start(row%vertex), lists(part), others, table)
            end associate
         end do
      end do
      do v = nv + 1, 2, -1
         start(v) = start(v - 1)
      end do
      start(1) = 0
   end subroutine sort_rows

   !> Room for what n rows refer to, when any of them does.
   pure subroutine make_room(n, n_others, others)
      integer, intent(in) :: n, n_others
      type(other_rows_type), allocatable, intent(inout) :: others(:)
      if (allocated(others)) then
         if (merge(n, 0, n_others > 0) <= size(others) .and. (n_others > 0 .eqv. size(others) > 0)) return
         deallocate (others)
      end if
      allocate (others(merge(n + n/4 + 16, 0, n_others > 0)))
   end subroutine make_room

   !> Insert a row among those of its vertex that are in the table already, which end before row k. A place still empty
   !> belongs to another vertex.
   pure subroutine insert(row, k, list, others, table)
      type(candidate_type), intent(in) :: row
      integer, intent(in) :: k
      type(candidate_list_type), intent(in) :: list     !! of the row
      type(other_rows_type), intent(inout) :: others(:)
      type(contact_table_type), intent(inout) :: table
      integer :: l
      l = k
      do while (l > 1)
         if (table%vertex(l - 1) /= row%vertex) exit
         if (row%edge > table%edge(l - 1)) exit
         if (row%edge == table%edge(l - 1) .and. row%station >= table%station(l - 1)) exit
         table%edge(l) = table%edge(l - 1)
         table%station(l) = table%station(l - 1)
         if (size(others) > 0) others(l) = others(l - 1)
         l = l - 1
      end do
      table%vertex(k) = row%vertex
      table%edge(l) = row%edge
      table%station(l) = int(row%station, i1)
      if (size(others) == 0) return
      others(l) = other_rows_type()
      if (row%others > 0) others(l) = list%others(row%others)
   end subroutine insert

   !> Partner and geometry of the rows of the table.
   subroutine fill_table(blocks, topology, outlines, vertices, limits, others, start, table)
      type(block_system_type), intent(in) :: blocks
      type(contact_topology_type), intent(in) :: topology
      type(outlines_type), intent(in) :: outlines
      real(wp), intent(in), contiguous :: vertices(:, :)
      type(search_limits_type), intent(in) :: limits
      type(other_rows_type), intent(in) :: others(:)   !! of the rows, or none
      integer, intent(in) :: start(:)                  !! rows of each vertex (sort_rows)
      type(contact_table_type), intent(inout) :: table
      integer :: p
      !$omp parallel do default(none) schedule(static) private(p) if (table%n > parallel_contacts) &
      !$omp shared(blocks, topology, outlines, vertices, limits, others, start, table)
      do p = 1, n_pieces(table%n)
         call fill_rows((p - 1)*piece + 1, min(p*piece, table%n), blocks, topology, outlines, vertices, limits, &
                        others, start, table)
      end do
      !$omp end parallel do
   end subroutine fill_table

   !> `fill_table` for some of the rows, with its arguments.
   pure subroutine fill_rows(first, last, blocks, topology, outlines, vertices, limits, others, start, table)
      integer, intent(in) :: first, last
      type(block_system_type), intent(in) :: blocks
      type(contact_topology_type), intent(in) :: topology
      type(outlines_type), intent(in) :: outlines
      real(wp), intent(in), contiguous :: vertices(:, :)
      type(search_limits_type), intent(in) :: limits
      type(other_rows_type), intent(in) :: others(:)
      integer, intent(in) :: start(:)
      type(contact_table_type), intent(inout) :: table
      type(corner_type) :: corner
      integer :: k, v, e, row
      k = first
      do while (k <= last)
         v = table%vertex(k)
         e = table%edge(k)
         if (table%station(k) > 0 .and. table%station(k) /= corner_station) then
            call fill_interval(v, e, last, blocks, topology, outlines, vertices, limits, k, table)
            cycle
         end if
         table%block_a(k) = topology%block(v)
         table%block_b(k) = topology%block(e)
         table%joint(k) = blocks%edge_joint(e)
         table%share(k) = 0
         table%partner(k) = 0
         if (table%station(k) == corner_station) then
            call meet_corners(v, e, vertices, topology, outlines, limits%sine, limits%cosine, limits%radius, corner)
            table%point(:, k) = corner%point
            table%share(k) = corner%share
            table%normal(:, k) = corner%normal
            table%gap(k) = corner%gap
            table%length(k) = corner%weight
            k = k + 1
            cycle
         end if
         if (size(others) > 0) then
            if (others(k)%partner_vertex > 0) then
               do row = start(others(k)%partner_vertex) + 1, start(others(k)%partner_vertex + 1)
                  if (table%edge(row) == others(k)%partner_edge) table%partner(k) = row
               end do
            end if
         end if
         call set_geometry(v, e, topology%edge_in(v), topology%next(topology%edge_out(v)), size(vertices, 2), &
                           vertices, outlines%tangent, outlines%length(e), limits%sine, table%normal(:, k), &
                           table%point(:, k), table%gap(k), table%length(k))
         if (limits%by_length) table%length(k) = vertex_weight(v, e, table%point(:, k), vertices, topology, outlines, &
                                                               limits%cosine)
         k = k + 1
      end do
   end subroutine fill_rows

   !> The stations of an interval of edges v and e from row k on, as far as they follow one another up to row `last`;
   !> k becomes the row after them. Many arguments: those of `fill_rows`.
   pure subroutine fill_interval(v, e, last, blocks, topology, outlines, vertices, limits, k, table)
      integer, intent(in) :: v, e, last
      type(block_system_type), intent(in) :: blocks
      type(contact_topology_type), intent(in) :: topology
      type(outlines_type), intent(in) :: outlines
      real(wp), intent(in), contiguous :: vertices(:, :)
      type(search_limits_type), intent(in) :: limits
      integer, intent(inout) :: k
      type(contact_table_type), intent(inout) :: table
      type(interval_type) :: interval
      type(station_type) :: station
      integer :: joint, points
      call measure_interval(v, e, vertices, topology, outlines, interval)
      joint = joint_of(v, e, blocks%edge_joint)
      points = limits%points(joint)
      do
         station = station_of(interval, int(table%station(k)), points, v, e, vertices, outlines)
         table%block_a(k) = topology%block(v)
         table%block_b(k) = topology%block(e)
         table%joint(k) = joint
         table%partner(k) = 0
         table%point(:, k) = station%point
         table%share(k) = station%share
         table%normal(:, k) = station%normal
         table%gap(k) = station%gap
         table%length(k) = station%weight
         k = k + 1
         if (k > last) return
         if (table%vertex(k) /= v .or. table%edge(k) /= e .or. table%station(k) == corner_station) return
      end do
   end subroutine fill_interval

   !> Blocks and joints of the rows of a table with contacts by length, of which none has a partner; gap and share are
   !> zero.
   pure subroutine name_blocks(blocks, topology, table)
      type(block_system_type), intent(in) :: blocks
      type(contact_topology_type), intent(in) :: topology
      type(contact_table_type), intent(inout) :: table
      integer :: k
      do k = 1, table%n
         associate (v => table%vertex(k), e => table%edge(k))
            table%block_a(k) = topology%block(v)
            table%block_b(k) = topology%block(e)
            table%joint(k) = blocks%edge_joint(e)
            if (table%station(k) > 0 .and. table%station(k) /= corner_station) &
               table%joint(k) = joint_of(v, e, blocks%edge_joint)
         end associate
         table%partner(k) = 0
         table%gap(k) = 0
         table%share(k) = 0
      end do
   end subroutine name_blocks

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

end module rockdda_contact_rows
