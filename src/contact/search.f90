! SPDX-License-Identifier: MIT
!> The contact table of a step: search, geometry, and the history handed on from the last step's table.
!>
!> Rows come out sorted by (vertex, edge), hence by (block_a, vertex, block_b, edge), regardless of the order in which
!> they were found. The pairs of blocks are searched in a few parts, one after the other or side by side; what is found
!> in a pair depends on nothing but the pair.
module rockdda_contact_search
   use rockdda_base_kinds, only : wp, i1, l1
   use rockdda_model_blocks, only : block_system_type
   use rockdda_contact_table, only : contact_table_type, contact_state
   use rockdda_contact_topology, only : contact_topology_type
   use rockdda_contact_history, only : contact_history_type, new_contact_history, held_cosine
   use rockdda_contact_outlines, only : outlines_type
   use rockdda_contact_broad_phase, only : close_pairs_type
   use rockdda_contact_exposure, only : exposure_type, search_input_type
   use rockdda_contact_candidates, only : other_rows_type, candidate_list_type
   use rockdda_contact_search_limits, only : search_limits_type, placing_share
   use rockdda_contact_narrow_search, only : narrow_search_type
   use rockdda_contact_inheritance, only : hand_on_history, inheritance_work_type
   use rockdda_contact_corners, only : corner_type, corner_station, meet_corners, vertex_weight
   use rockdda_contact_interval_law, only : n_points
   use rockdda_contact_intervals, only : interval_type, place_intervals
   implicit none
   private
   public :: contact_search_type

   !> Scratch of the search; one per run, nothing in it is part of the state.
   type :: contact_search_type
      type(close_pairs_type) :: pairs
      type(outlines_type) :: outlines
      type(narrow_search_type) :: narrow
      type(exposure_type) :: exposure
      type(contact_history_type) :: history
      type(inheritance_work_type) :: inheritance
      logical, allocatable :: newborn(:)              !! (nb) blocks that have just been placed; not allocated: none
      integer, allocatable :: start(:)
      type(other_rows_type), allocatable :: others(:) !! (>= rows) that each row refers to; size 0 when none does
   contains
      procedure :: run => search_contacts
   end type contact_search_type

contains

   !> Fill `table` with every contact within the limits; history comes from `previous`.
   subroutine search_contacts(self, blocks, topology, vertices, limits, previous, first_step, touch, table)
      class(contact_search_type), intent(inout), target :: self
      type(block_system_type), intent(in) :: blocks
      type(contact_topology_type), intent(in), target :: topology
      real(wp), intent(in), contiguous, target :: vertices(:, :)       !! (2, nv) now
      type(search_limits_type), intent(inout), target :: limits        !! the angle that bonds hold is set here
      type(contact_table_type), intent(in), target :: previous         !! last step's table
      logical, intent(in) :: first_step                    !! touching contacts are born bonded
      real(wp), intent(in) :: touch                        !! gap below which two blocks touch at the start [length]
      type(contact_table_type), intent(inout) :: table
      type(search_input_type) :: given
      call self%pairs%update(blocks, vertices, limits%reach)
      call self%outlines%update(topology, vertices, limits%sine)
      call new_contact_history(size(vertices, 2), previous, self%history)
      limits%held_cosine = held_cosine(limits, previous, self%outlines)
      limits%touch = merge(touch, huge(touch), first_step)
      if (allocated(limits%is_born)) deallocate (limits%is_born)
      if (first_step) then
         allocate (limits%is_born(blocks%n_blocks), source=.true.)
      else if (allocated(self%newborn)) then
         limits%is_born = self%newborn
      end if
      given = search_input_type(vertices, topology, self%outlines, limits, previous, self%history, self%exposure)
      call self%narrow%run(self%pairs, blocks, given)
      associate (found => self%narrow%found(1:self%pairs%n_parts()), same_rows => self%inheritance%same_rows)
         call sort_rows(found, size(vertices, 2), self%start, self%others, table)
         call fill_table(found, blocks, given, self%others, self%start, table, same_rows)
      end associate
      call hand_on_history(given, self%others, first_step, touch, self%inheritance, table)
      if (allocated(self%newborn)) call touch_newborn(self%newborn, topology, self%outlines, touch, table)
   end subroutine search_contacts

   !> Identities of the rows of the table, in the order (vertex, edge, station): counting sort by vertex, insertion sort
   !> within. The stations of an interval stay together.
   pure subroutine sort_rows(lists, nv, start, others, table)
      type(candidate_list_type), intent(inout) :: lists(:)             !! candidates, each once
      integer, intent(in) :: nv                                        !! vertices
      integer, allocatable, intent(inout) :: start(:)  !! (nv + 1) rows of vertex v: start(v)+1 ... start(v+1)
      type(other_rows_type), allocatable, intent(inout) :: others(:)   !! (>= rows), or of size 0 when there are none
      type(contact_table_type), intent(inout) :: table
      integer :: i, c, k, v, part
      if (.not. allocated(start)) allocate (start(nv + 1))
      start = 0
      do part = 1, size(lists)
         do i = 1, lists(part)%n_intervals
            associate (interval => lists(part)%intervals(i))
               start(interval%f + 1) = start(interval%f + 1) + n_points
            end associate
         end do
         do c = 1, lists(part)%n
            v = lists(part)%rows(c)%vertex
            start(v + 1) = start(v + 1) + 1
         end do
      end do
      do v = 2, nv + 1
         start(v) = start(v) + start(v - 1)
      end do
      call table%resize(start(nv + 1))
      call make_room(table%n, sum(lists%n_others), others)
      table%vertex(1:table%n) = 0
      do part = 1, size(lists)
         do i = 1, lists(part)%n_intervals
            associate (interval => lists(part)%intervals(i))
               k = start(interval%f) + 1
               start(interval%f) = start(interval%f) + n_points
               call insert(interval%f, interval%e, 1, n_points, k, others, table)
               interval%row = k
            end associate
         end do
      end do
      do part = 1, size(lists)
         do c = 1, lists(part)%n
            associate (row => lists(part)%rows(c))
               k = start(row%vertex) + 1
               start(row%vertex) = k
               call insert(row%vertex, row%edge, row%station, 1, k, others, table)
               if (row%others > 0) others(k) = lists(part)%others(row%others)
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

   !> Insert n rows, of one station or of the stations of an interval, among those of their vertex that are in the table
   !> already, which end before row k; k becomes the first of them. A place still empty belongs to another vertex.
   pure subroutine insert(v, e, station, n, k, others, table)
      integer, intent(in) :: v, e
      integer, intent(in) :: station                    !! of the first row
      integer, intent(in) :: n
      integer, intent(inout) :: k
      type(other_rows_type), intent(inout) :: others(:)
      type(contact_table_type), intent(inout) :: table
      integer :: l
      table%vertex(k:k + n - 1) = v
      do while (k > 1)
         if (table%vertex(k - 1) /= v) exit
         if (e > table%edge(k - 1)) exit
         if (e == table%edge(k - 1) .and. station >= table%station(k - 1)) exit
         k = k - 1
         table%edge(k + n) = table%edge(k)
         table%station(k + n) = table%station(k)
         if (size(others) > 0) others(k + n) = others(k)
      end do
      do l = k, k + n - 1
         table%edge(l) = e
         table%station(l) = int(station + l - k, i1)
         if (size(others) > 0) others(l) = other_rows_type()
      end do
   end subroutine insert

   !> Partner and geometry of the rows of the table. Are they, by length, those of the last step, in the same order?
   subroutine fill_table(lists, blocks, given, others, start, table, same_rows)
      type(candidate_list_type), intent(inout) :: lists(:)   !! rows of the intervals
      type(block_system_type), intent(in) :: blocks
      type(search_input_type), intent(in) :: given
      type(other_rows_type), intent(in) :: others(:)   !! of the rows, or none
      integer, intent(in) :: start(:)                  !! rows of each vertex (sort_rows)
      type(contact_table_type), intent(inout) :: table
      logical, intent(out) :: same_rows
      integer :: part
      logical :: may_be_same
      may_be_same = given%limits%by_length .and. given%previous%n == table%n
      same_rows = may_be_same
      !$omp parallel do default(none) schedule(dynamic) private(part) if (size(lists) > 1) &
      !$omp shared(lists, blocks, given, others, start, table, may_be_same) reduction(.and.:same_rows)
      do part = 1, size(lists)
         ! each thread begins with .true.
         same_rows = same_rows .and. may_be_same
         if (lists(part)%n_intervals > 0) then
            associate (intervals => lists(part)%intervals(1:lists(part)%n_intervals))
               call find_rows(table%n, table%edge, table%station, intervals)
               if (same_rows) call compare_rows(table%n, given%previous%vertex, given%previous%edge, &
                                                given%previous%station, intervals, same_rows)
               call fill_intervals(intervals, given%topology%block, table%n, table%block_a, table%block_b, &
                                   table%joint, table%partner, table%tied)
               call place_intervals(intervals, size(given%vertices, 2), given%vertices, given%outlines%tangent, &
                                    table%n, table%point, table%share, table%normal, table%gap, table%length)
            end associate
         end if
         call fill_rows(lists(part), blocks, given, others, start, table, same_rows)
      end do
      !$omp end parallel do
   end subroutine fill_table

   !> Where the rows of some intervals are now: others have come before them since they were inserted.
   pure subroutine find_rows(n, edge, station, intervals)
      integer, intent(in) :: n                         !! rows
      integer, intent(in) :: edge(n)
      integer(i1), intent(in) :: station(n)
      type(interval_type), intent(inout) :: intervals(:)
      integer :: i
      do i = 1, size(intervals)
         associate (interval => intervals(i))
            do while (edge(interval%row) /= interval%e .or. station(interval%row) /= 1)
               interval%row = interval%row + 1
            end do
         end associate
      end do
   end subroutine find_rows

   !> Are the rows of some intervals those of the last step?
   pure subroutine compare_rows(n, vertex, edge, station, intervals, same_rows)
      integer, intent(in) :: n                         !! rows
      integer, intent(in) :: vertex(n), edge(n)        !! of the last step
      integer(i1), intent(in) :: station(n)
      type(interval_type), intent(in) :: intervals(:)
      logical, intent(inout) :: same_rows
      integer :: i, k, last
      do i = 1, size(intervals)
         k = intervals(i)%row
         last = k + n_points - 1
         same_rows = vertex(k) == intervals(i)%f .and. edge(k) == intervals(i)%e .and. station(k) == 1 .and. &
                     vertex(last) == intervals(i)%f .and. edge(last) == intervals(i)%e .and. &
                     station(last) == n_points
         if (.not. same_rows) return
      end do
   end subroutine compare_rows

   !> Blocks, joints and ties of the rows of some intervals.
   pure subroutine fill_intervals(intervals, block, n, block_a, block_b, joint, partner, tied)
      type(interval_type), intent(in) :: intervals(:)
      integer, intent(in) :: block(:)                  !! (nv) of each vertex
      integer, intent(in) :: n                         !! rows
      integer, intent(inout) :: block_a(n), block_b(n), joint(n), partner(n)
      logical(l1), intent(inout) :: tied(n)
      integer :: i, k
      do i = 1, size(intervals)
         associate (interval => intervals(i))
            do k = interval%row, interval%row + n_points - 1
               block_a(k) = block(interval%f)
               block_b(k) = block(interval%e)
               joint(k) = interval%joint
               partner(k) = 0
               tied(k) = interval%is_tied
            end do
         end associate
      end do
   end subroutine fill_intervals

   !> Rows of one part that are no stations of intervals.
   pure subroutine fill_rows(list, blocks, given, others, start, table, same_rows)
      type(candidate_list_type), intent(in) :: list
      type(block_system_type), intent(in) :: blocks
      type(search_input_type), intent(in) :: given
      type(other_rows_type), intent(in) :: others(:)
      integer, intent(in) :: start(:)
      type(contact_table_type), intent(inout) :: table
      logical, intent(inout) :: same_rows              !! so far
      type(corner_type) :: corner
      integer :: c, k, v, e, row, joint
      do c = 1, list%n
         v = list%rows(c)%vertex
         e = list%rows(c)%edge
         k = start(v) + 1
         do while (table%edge(k) /= e .or. table%station(k) /= list%rows(c)%station)
            k = k + 1
         end do
         if (same_rows) same_rows = given%previous%vertex(k) == v .and. given%previous%edge(k) == e .and. &
                                    given%previous%station(k) == table%station(k)
         table%block_a(k) = given%topology%block(v)
         table%block_b(k) = given%topology%block(e)
         table%joint(k) = blocks%edge_joint(e)
         table%share(k) = 0
         table%partner(k) = 0
         table%tied(k) = .false.
         if (table%station(k) == corner_station) then
            call meet_corners(v, e, given%vertices, given%topology, given%outlines, given%limits%sine, &
                              given%limits%cosine, given%limits%radius, corner)
            table%point(:, k) = corner%point
            table%share(k) = corner%share
            table%normal(:, k) = corner%normal
            table%gap(k) = corner%gap
            table%length(k) = corner%weight
            joint = max(facing_joint(v, -corner%normal), facing_joint(e, corner%normal))
            if (joint > 0) table%joint(k) = joint
            cycle
         end if
         if (size(others) > 0) then
            if (others(k)%partner_vertex > 0) then
               do row = start(others(k)%partner_vertex) + 1, start(others(k)%partner_vertex + 1)
                  if (table%edge(row) == others(k)%partner_edge) table%partner(k) = row
               end do
            end if
         end if
         call set_geometry(v, e, given%topology%edge_in(v), given%topology%next(given%topology%edge_out(v)), &
                           size(given%vertices, 2), given%vertices, given%outlines%tangent, given%outlines%length(e), &
                           given%limits%sine, table%normal(:, k), table%point(:, k), table%gap(k), table%length(k))
         if (.not. given%limits%by_length) cycle
         table%length(k) = vertex_weight(v, e, table%point(:, k), given%vertices, given%topology, given%outlines, &
                                         given%limits%cosine)
         table%joint(k) = max(table%joint(k), facing_joint(v, -table%normal(:, k)))
      end do

   contains

      !> Joint material of that edge at a vertex which faces a direction most, of those that no other block bears; 0
      !> without any.
      pure integer function facing_joint(vertex, direction)
         integer, intent(in) :: vertex
         real(wp), intent(in) :: direction(2)
         real(wp) :: faces, most
         integer :: edge(2), k
         edge = [given%topology%edge_in(vertex), given%topology%edge_out(vertex)]
         facing_joint = 0
         most = -huge(most)
         do k = 1, 2
            if (given%exposure%is_borne(edge(k))) cycle
            faces = given%outlines%tangent(2, edge(k))*direction(1) - given%outlines%tangent(1, edge(k))*direction(2)
            if (faces > most) facing_joint = blocks%edge_joint(edge(k))
            most = max(most, faces)
         end do
      end function facing_joint

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

end module rockdda_contact_search
