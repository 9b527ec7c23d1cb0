! SPDX-License-Identifier: MIT
!> The contact table of a step: search, geometry, and the history handed on from the last step's table.
!>
!> Rows come out sorted by (vertex, edge), hence by (block_a, vertex, block_b, edge), whatever the order in which
!> they were found. The pairs of blocks are searched in a few parts, one after the other or side by side; what is found
!> in a pair depends on nothing but the pair.
module rockdda_contact_search
   use rockdda_base_kinds, only : wp
   use rockdda_base_parallel, only : parallel_contacts, piece, n_pieces
   use rockdda_base_room, only : reserve
   use rockdda_model_blocks, only : block_system_type
   use rockdda_contact_table, only : contact_table_type, contact_state
   use rockdda_contact_topology, only : contact_topology_type
   use rockdda_contact_history, only : contact_history_type, new_contact_history
   use rockdda_contact_outlines, only : outlines_type
   use rockdda_contact_broad_phase, only : close_pairs_type
   use rockdda_contact_candidates, only : candidate_type, candidate_list_type
   use rockdda_contact_search_limits, only : search_limits_type
   use rockdda_contact_narrow_phase, only : search_pair
   use rockdda_contact_corners, only : corner_type, corner_station, meet_corners
   use rockdda_contact_exposure, only : exposure_type
   use rockdda_contact_interval_search, only : search_intervals, joint_of
   use rockdda_contact_intervals, only : interval_type, station_type, measure_interval, station_of
   use rockdda_contact_inheritance, only : hand_on_history, inheritance_work_type
   use rockdda_contact_vertex_weight, only : vertex_weight
   implicit none
   private
   public :: contact_search_type, search_limits_type

   !> Parts of the narrow phase in a large model.
   integer, parameter :: many_parts = 16
   !> Gaps and overlaps up to this share of the shorter edge are free of stress where a block is placed.
   real(wp), parameter, public :: placing_share = 0.01_wp

   !> Scratch of the search; one per run, nothing in it is part of the state.
   type :: contact_search_type
      type(close_pairs_type) :: pairs
      type(outlines_type) :: outlines
      type(candidate_list_type) :: found(many_parts)  !! candidate rows of each part
      type(candidate_list_type) :: list               !! of all parts
      type(contact_history_type) :: history
      type(exposure_type) :: exposure
      type(inheritance_work_type) :: inheritance
      logical, allocatable :: newborn(:)              !! (nb) blocks that have just been placed; not allocated: none
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
      self%found%n = 0
      if (limits%by_length .or. limits%corrected) &
         call search_faces(self, n_parts, blocks, topology, vertices, limits, previous)
      !$omp parallel do default(none) shared(self, blocks, topology, vertices, limits, previous, n_parts) &
      !$omp private(part) schedule(dynamic) if (n_parts > 1)
      do part = 1, n_parts
         call search_part(part, n_parts, self%pairs, blocks, topology, self%outlines, vertices, limits, previous, &
                          self%history, self%exposure, self%found(part))
      end do
      !$omp end parallel do
      call self%list%collect(self%found(1:n_parts))
      call sort_candidates(self%list, size(vertices, 2), self%start, self%order)
      call fill_table(blocks, topology, self%outlines, vertices, limits, self%list, self%order, self%start, table)
      call hand_on_history(previous, self%history, topology, self%outlines, self%list, self%order, limits, &
                           first_step, touch, self%inheritance, table)
      if (allocated(self%newborn)) call touch_newborn(self%newborn, topology, self%outlines, limits%is_tied, touch, &
                                                      table)
   end subroutine search_contacts

   !> The contacts of blocks that have just been placed: gaps and overlaps that are small against the shorter edge are
   !> free of stress, and what touches is bonded as at the start of the run.
   subroutine touch_newborn(newborn, topology, outlines, is_tied, touch, table)
      logical, intent(in) :: newborn(:)           !! (nb)
      type(contact_topology_type), intent(in) :: topology
      type(outlines_type), intent(in) :: outlines
      logical, intent(in) :: is_tied(:)           !! (joints) intact rock
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
         if (abs(table%distance(c)) > placing_share*shorter) cycle
         table%offset(c) = table%distance(c)
         table%gap(c) = 0
         table%state(c) = contact_state%locked
         table%bonded(c) = table%length(c) > 0
         table%tied(c) = table%bonded(c) .and. table%station(c) > 0 .and. table%station(c) /= corner_station .and. &
                         is_tied(table%joint(c))
         ! ties get their stiffness with the first step
         table%k_n(c) = 0
      end do
   end subroutine touch_newborn

   !> Candidate rows of one part of the pairs.
   pure subroutine search_part(part, n_parts, pairs, blocks, topology, outlines, vertices, limits, previous, history, &
                               exposure, list)
      integer, intent(in) :: part, n_parts
      type(close_pairs_type), intent(in) :: pairs
      type(block_system_type), intent(in) :: blocks
      type(contact_topology_type), intent(in) :: topology
      type(outlines_type), intent(in) :: outlines
      real(wp), intent(in), contiguous :: vertices(:, :)
      type(search_limits_type), intent(in) :: limits
      type(contact_table_type), intent(in) :: previous
      type(contact_history_type), intent(in) :: history
      type(exposure_type), intent(in) :: exposure
      type(candidate_list_type), intent(inout) :: list
      integer :: k, a, b
      do k = first_of(part, n_parts, pairs%n), first_of(part + 1, n_parts, pairs%n) - 1
         if (.not. pairs%is_close(k)) cycle
         a = pairs%candidates(1, k)
         b = pairs%candidates(2, k)
         call search_pair([blocks%vertex_offset(a) + 1, blocks%vertex_offset(a + 1)], &
                          [blocks%vertex_offset(b) + 1, blocks%vertex_offset(b + 1)], &
                          pairs%boxes(:, a), pairs%boxes(:, b), vertices, topology, outlines, previous, history, &
                          exposure, limits, list)
      end do
   end subroutine search_part

   !> First pair of a part.
   pure integer function first_of(part, n_parts, n)
      integer, intent(in) :: part, n_parts
      integer, intent(in) :: n   !! pairs
      first_of = int(real(part - 1, wp)/n_parts*n) + 1
   end function first_of

   !> Intervals of all joints, and what they cover. Contacts of vertices on edges need but the latter.
   subroutine search_faces(self, n_parts, blocks, topology, vertices, limits, previous)
      class(contact_search_type), intent(inout) :: self
      integer, intent(in) :: n_parts
      type(block_system_type), intent(in) :: blocks
      type(contact_topology_type), intent(in) :: topology
      real(wp), intent(in), contiguous :: vertices(:, :)
      type(search_limits_type), intent(in) :: limits
      type(contact_table_type), intent(in) :: previous   !! last step's table, of which the history is the index
      integer :: part, k, a, b, before, n
      logical :: is_tied
      self%found%n_intervals = 0
      !$omp parallel do default(none) shared(self, blocks, topology, vertices, limits, n_parts) &
      !$omp private(part, k, a, b) schedule(dynamic) if (n_parts > 1)
      do part = 1, n_parts
         do k = first_of(part, n_parts, self%pairs%n), first_of(part + 1, n_parts, self%pairs%n) - 1
            if (.not. self%pairs%is_close(k)) cycle
            a = self%pairs%candidates(1, k)
            b = self%pairs%candidates(2, k)
            call search_intervals([blocks%vertex_offset(a) + 1, blocks%vertex_offset(a + 1)], &
                                  [blocks%vertex_offset(b) + 1, blocks%vertex_offset(b + 1)], &
                                  self%pairs%boxes(:, a), self%pairs%boxes(:, b), vertices, topology, self%outlines, &
                                  blocks%edge_joint, limits, self%found(part))
         end do
      end do
      !$omp end parallel do
      if (allocated(limits%sunk)) then
         call self%exposure%clear(size(vertices, 2), limits%smooth, limits%sunk, topology%block)
      else
         call self%exposure%clear(size(vertices, 2), limits%smooth)
      end if
      do part = 1, n_parts
         n = 0
         do k = 1, self%found(part)%n
            associate (row => self%found(part)%rows(k))
               if (row%station /= 1) cycle
               n = n + 1
               before = self%history%find(previous, row%vertex, row%edge, 1)
               is_tied = .false.
               if (before > 0) is_tied = previous%tied(before)
               call self%exposure%cover(row%vertex, row%edge, self%found(part)%intervals(n), is_tied)
            end associate
         end do
      end do
      if (.not. limits%by_length) self%found%n = 0
      do part = 1, merge(n_parts, 0, limits%by_length)
         call drop_hidden_intervals(self%exposure, self%outlines, topology, vertices, self%found(part))
      end do
   end subroutine search_faces

   !> A block that rides on another, and stands deeper in it than the surface ahead, faces the side of the next block by
   !> that depth: too short an interval to count, when its corner cannot strike that side.
   pure subroutine drop_hidden_intervals(exposure, outlines, topology, vertices, list)
      type(exposure_type), intent(in) :: exposure
      type(outlines_type), intent(in) :: outlines
      type(contact_topology_type), intent(in) :: topology
      real(wp), intent(in), contiguous :: vertices(:, :)
      type(candidate_list_type), intent(inout) :: list
      integer :: i, k, n
      logical :: is_dropped
      i = 0
      n = 0
      is_dropped = .false.
      do k = 1, list%n
         if (list%rows(k)%station == 1) then
            i = i + 1
            is_dropped = .false.
            associate (interval => list%intervals(i))
               if (interval%high - interval%low <= exposure%between(list%rows(k)%vertex, list%rows(k)%edge)) &
                  is_dropped = is_end_hidden(interval%vertex_low, interval%edge_low) .or. &
                               is_end_hidden(interval%vertex_high, interval%edge_high)
            end associate
         end if
         if (is_dropped) cycle
         n = n + 1
         list%rows(n) = list%rows(k)
      end do
      list%n = n

   contains

      !> Is the corner at an end of the interval one that cannot strike the edge?
      pure logical function is_end_hidden(v, e)
         integer, intent(in) :: v, e
         real(wp) :: foot
         foot = dot_product(vertices(:, v) - vertices(:, e), outlines%tangent(:, e))
         is_end_hidden = exposure%is_hidden(v, e, foot, vertices, topology, outlines)
      end function is_end_hidden

   end subroutine drop_hidden_intervals

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
            if (.not. comes_before(list%rows(c), list%rows(order(l)))) exit
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

   !> Does row a come before row b of the same vertex?
   pure logical function comes_before(a, b)
      type(candidate_type), intent(in) :: a, b
      comes_before = a%edge < b%edge .or. (a%edge == b%edge .and. a%station < b%station)
   end function comes_before

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
      integer :: p
      call table%resize(list%n)
      !$omp parallel do default(none) schedule(static) private(p) if (list%n > parallel_contacts) &
      !$omp shared(blocks, topology, outlines, vertices, limits, list, order, start, table)
      do p = 1, n_pieces(list%n)
         call fill_rows((p - 1)*piece + 1, min(p*piece, list%n), blocks, topology, outlines, vertices, limits, list, &
                        order, start, table)
      end do
      !$omp end parallel do
   end subroutine fill_table

   !> `fill_table` for some of the rows, with its arguments.
   pure subroutine fill_rows(first, last, blocks, topology, outlines, vertices, limits, list, order, start, table)
      integer, intent(in) :: first, last
      type(block_system_type), intent(in) :: blocks
      type(contact_topology_type), intent(in) :: topology
      type(outlines_type), intent(in) :: outlines
      real(wp), intent(in), contiguous :: vertices(:, :)
      type(search_limits_type), intent(in) :: limits
      type(candidate_list_type), intent(in) :: list
      integer, intent(in) :: order(:), start(:)
      type(contact_table_type), intent(inout) :: table
      type(interval_type) :: interval
      type(station_type) :: station
      type(corner_type) :: corner
      integer :: c, k, v, e, row, measured(2)
      measured = 0
      do k = first, last
         c = order(k)
         v = list%rows(c)%vertex
         e = list%rows(c)%edge
         table%vertex(k) = v
         table%edge(k) = e
         table%block_a(k) = topology%block(v)
         table%block_b(k) = topology%block(e)
         table%joint(k) = blocks%edge_joint(e)
         table%station(k) = list%rows(c)%station
         table%share(k) = 0
         table%partner(k) = 0
         if (table%station(k) == corner_station) then
            call meet_corners(v, e, vertices, topology, outlines, limits%sine, limits%cosine, limits%radius, corner)
            table%point(:, k) = corner%point
            table%share(k) = corner%share
            table%normal(:, k) = corner%normal
            table%gap(k) = corner%gap
            table%length(k) = corner%weight
            cycle
         else if (table%station(k) > 0) then
            ! the stations of an interval follow one another
            if (any(measured /= [v, e])) call measure_interval(v, e, vertices, topology, outlines, interval)
            measured = [v, e]
            table%joint(k) = joint_of(v, e, blocks%edge_joint)
            station = station_of(interval, table%station(k), limits%points(table%joint(k)), v, e, vertices, outlines)
            table%point(:, k) = station%point
            table%share(k) = station%share
            table%normal(:, k) = station%normal
            table%gap(k) = station%gap
            table%length(k) = station%weight
            cycle
         end if
         if (list%rows(c)%partner_vertex > 0) then
            do row = start(list%rows(c)%partner_vertex) + 1, start(list%rows(c)%partner_vertex + 1)
               if (list%rows(order(row))%edge == list%rows(c)%partner_edge) table%partner(k) = row
            end do
         end if
         call set_geometry(v, e, topology%edge_in(v), topology%next(topology%edge_out(v)), size(vertices, 2), &
                           vertices, outlines%tangent, outlines%length(e), limits%sine, table%normal(:, k), &
                           table%point(:, k), table%gap(k), table%length(k))
         if (limits%by_length) table%length(k) = vertex_weight(v, e, table%point(:, k), vertices, topology, outlines, &
                                                               limits%cosine)
      end do
   end subroutine fill_rows

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

end module rockdda_contact_search
