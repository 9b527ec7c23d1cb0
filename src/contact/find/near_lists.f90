! SPDX-License-Identifier: MIT
!> Parts of two close blocks that may meet, with contact by length: edges that may face each other, corners that meet
!> corners, and vertices that may strike edges.
!>
!> The lists are made for blocks that move: they hold all that can be in contact while no vertex moves further than
!> `allowance` from its place in `places`, and are kept as long. The search then tests what is listed as it is now, so
!> that what it finds, and in what order, does not depend on when the lists were made. A few entries of a close pair
!> remain of some dozens of combinations.
!>
!> When some blocks have moved further, they get new places, and only their pairs new lists. So that blocks that move
!> together do so at one time, half the allowance is then enough. Blocks that have moved alike, by one translation but
!> for a part of the allowance, are a group: its places are moved by its translation, and the lists of its pairs hold
!> on. Rock that slides as a whole needs new lists along the sliding planes only.
!>
!> Bounds: with every vertex within a = `allowance` of its place the vector between two of them changes by 2 a at most,
!> and an edge of length L turns by asin(2 a/L) <= 2.1 a/L as long as 2 a <= L/2.
module rockdda_contact_near_lists
   use rockdda_base_kinds, only : wp
   use rockdda_base_room, only : grow
   use rockdda_model_blocks, only : block_system_type
   use rockdda_contact_broad_phase, only : close_pairs_type, many_parts, boxes_close
   use rockdda_contact_candidates, only : candidate_list_type
   use rockdda_contact_corner_search, only : corner_zone
   use rockdda_contact_intervals, only : interval_type, measure_interval
   use rockdda_contact_vertex_search, only : collect_pair
   use rockdda_contact_outlines, only : outlines_type
   use rockdda_contact_search_limits, only : search_limits_type
   use rockdda_contact_topology, only : contact_topology_type
   use rockdda_base_parallel, only : parallel_blocks
   implicit none
   private
   public :: near_lists_type, near_part_type, near_pair_type, edges_with_edges, corners_with_corners, &
             vertices_of_first, vertices_of_second, moved_groups_type

   !> Largest number of groups.
   integer, parameter :: most_groups = 16
   !> Blocks have moved when a vertex has, by this share of the allowance; in a group vertices are left, by the second
   !> share at most, beside their new places.
   real(wp), parameter :: far = 0.5_wp, beside = 0.25_wp
   !> Groups of blocks that stay, and of those that have moved alone.
   integer, parameter :: stays = 0, alone = -1

   !> Blocks that have moved from their places, in groups. A pure cache: nothing in it is part of the state.
   type :: moved_groups_type
      logical :: none_has_moved = .false.              !! no vertex further than the allowance: groups are not new
      integer, allocatable, private :: group(:)        !! (nb)
      real(wp), private :: shift(2, most_groups) = 0   !! translations [length]
      integer, private :: n_groups = 0
      integer, private :: n_shifts = 0                 !! of any block since all have moved alone
   contains
      procedure :: find
      procedure :: move_all
      procedure :: move_places
      procedure :: are_together
   end type moved_groups_type

   !> Kinds of entries of a pair, in the order in which they are stored: edges that may face each other, corners that
   !> may meet, vertices of the first block that may strike edges of the second, and the other way round. Each entry has
   !> two numbers, of the first block and of the second, or vertex and edge.
   integer, parameter :: edges_with_edges = 1, corners_with_corners = 2, vertices_of_first = 3, vertices_of_second = 4
   integer, parameter :: n_kinds = 4

   !> Numbers before the entries of a pair: the pair, and how many entries it has of each kind.
   integer, parameter :: n_heads = 1 + n_kinds

   !> An edge that turns by more is taken to point anywhere [rad].
   real(wp), parameter :: any_turn = 4.0_wp

   !> Pairs of one part of the candidates, one after the other; pairs without entries are left out.
   type :: near_part_type
      integer :: n = 0
      integer :: n_faces = 0                       !! edges with edges, of all pairs
      integer, allocatable :: items(:)
      integer, allocatable, private :: last(:)     !! scratch: items before
      type(candidate_list_type), private :: near   !! scratch
   end type near_part_type

   !> One pair of a part, and where its entries lie: entry l of kind k is items(l:l+1), l = first(k), last(k), 2.
   type :: near_pair_type
      integer :: pair = 0                         !! row of the close pairs
      integer :: first(n_kinds) = 0, last(n_kinds) = -1
      integer, private :: done = 0                !! numbers of the part up to the end of this pair
   contains
      procedure :: advance
   end type near_pair_type

   !> A pure cache: nothing in it is part of the state.
   type :: near_lists_type
      logical :: was_kept = .false.              !! the last update did
      type(near_part_type) :: parts(many_parts)
      real(wp), private :: allowance = -1        !! how far vertices may move [length]; < 0: no lists
      type(search_limits_type), private :: limits
      real(wp), allocatable, private :: places(:, :)   !! (2, nv) vertices for which lists were made
      real(wp), allocatable, private :: boxes(:, :)    !! (4, nb) of the places
      type(moved_groups_type), private :: moved        !! blocks that get new places
   contains
      procedure :: update
   end type near_lists_type

contains

   !> Go to the next pair of a part.
   pure subroutine advance(self, part, found)
      class(near_pair_type), intent(inout) :: self
      type(near_part_type), intent(in) :: part
      logical, intent(out) :: found               !! false: there is none
      integer :: k, place
      found = self%done < part%n
      if (.not. found) return
      self%pair = part%items(self%done + 1)
      place = self%done + n_heads
      do k = 1, n_kinds
         self%first(k) = place + 1
         place = place + 2*part%items(self%done + 1 + k)
         self%last(k) = place
      end do
      self%done = place
   end subroutine advance

   !> Lists for the pairs as they are now.
   subroutine update(self, pairs, blocks, topology, outlines, vertices, limits)
      class(near_lists_type), intent(inout) :: self
      type(close_pairs_type), intent(in) :: pairs
      type(block_system_type), intent(in) :: blocks
      type(contact_topology_type), intent(in) :: topology
      type(outlines_type), intent(in) :: outlines          !! of the vertices now
      real(wp), intent(in), contiguous :: vertices(:, :)   !! (2, nv) now
      type(search_limits_type), intent(in) :: limits
      type(outlines_type) :: at_places                     ! where some of the blocks have moved
      logical, allocatable :: chosen(:)
      integer :: part
      logical :: are_some
      are_some = pairs%was_kept .and. self%allowance >= 0
      if (are_some) are_some = is_within(limits, self%limits)
      self%was_kept = .false.
      if (are_some) then
         call self%moved%find(blocks, vertices, self%places, self%allowance)
         self%was_kept = self%moved%none_has_moved
         if (self%was_kept) return
         call self%moved%move_places(blocks, vertices, pairs%boxes, self%places, self%boxes)
         allocate (chosen(blocks%n_blocks))
         call choose_blocks(pairs%candidates(:, 1:pairs%n), self%moved, chosen)
         call at_places%update_some(topology, self%places, limits%sine, chosen)
      else
         self%allowance = pairs%allowance()
         ! limits change by factors of two
         self%limits%reach = 2*limits%reach
         self%limits%zone = 2*limits%zone
         self%limits%penetration = 1.5_wp*limits%penetration
         self%limits%sine = limits%sine
         self%limits%cosine = limits%cosine
         self%limits%held_cosine = min(limits%cosine, limits%held_cosine)
         call self%moved%move_all(blocks%n_blocks)
         associate (nv => size(vertices, 2))
            if (.not. allocated(self%places)) allocate (self%places(2, nv), self%boxes(4, blocks%n_blocks))
         end associate
         call self%moved%move_places(blocks, vertices, pairs%boxes, self%places, self%boxes)
      end if
      !$omp parallel do default(none) shared(self, pairs, blocks, topology, outlines, at_places, are_some) &
      !$omp private(part) schedule(dynamic) if (pairs%n_parts() > 1)
      do part = 1, pairs%n_parts()
         if (are_some) then
            call list_part(part, pairs, blocks, topology, at_places, self%places, self%boxes, self%limits, &
                           self%allowance, self%moved, are_some, self%parts(part))
         else
            call list_part(part, pairs, blocks, topology, outlines, self%places, self%boxes, self%limits, &
                           self%allowance, self%moved, are_some, self%parts(part))
         end if
      end do
      !$omp end parallel do
   end subroutine update

   !> Choose the blocks of pairs that need new lists.
   pure subroutine choose_blocks(pairs, moved, chosen)
      integer, intent(in) :: pairs(:, :)                   !! (2, n) blocks
      type(moved_groups_type), intent(in) :: moved
      logical, intent(out) :: chosen(:)                    !! (nb)
      integer :: k
      chosen = .false.
      do k = 1, size(pairs, 2)
         if (moved%are_together(pairs(1, k), pairs(2, k))) cycle
         chosen(pairs(1, k)) = .true.
         chosen(pairs(2, k)) = .true.
      end do
   end subroutine choose_blocks

   !> Are these limits those for which lists were made, or closer ones?
   pure logical function is_within(limits, of_lists)
      type(search_limits_type), intent(in) :: limits, of_lists
      is_within = limits%reach <= of_lists%reach .and. limits%zone <= of_lists%zone .and. &
                  limits%penetration <= of_lists%penetration .and. abs(limits%sine - of_lists%sine) <= 0 .and. &
                  abs(limits%cosine - of_lists%cosine) <= 0 .and. &
                  min(limits%cosine, limits%held_cosine) >= of_lists%held_cosine
   end function is_within

   !> Lists of one part of the pairs.
   pure subroutine list_part(part, pairs, blocks, topology, outlines, vertices, boxes, limits, allowance, &
                             moved, are_some, list)
      integer, intent(in) :: part
      type(close_pairs_type), intent(in) :: pairs
      type(block_system_type), intent(in) :: blocks
      type(contact_topology_type), intent(in) :: topology
      type(outlines_type), intent(in) :: outlines          !! of the places
      real(wp), intent(in), contiguous :: vertices(:, :)   !! (2, nv) the places
      real(wp), intent(in), contiguous :: boxes(:, :)      !! (4, nb) of the places
      type(search_limits_type), intent(in) :: limits
      real(wp), intent(in) :: allowance                    !! [length]
      type(moved_groups_type), intent(in) :: moved
      logical, intent(in) :: are_some                      !! there are lists for blocks that are together
      type(near_part_type), intent(inout) :: list
      integer, allocatable :: spare(:)
      integer :: k, head, n(n_kinds), at, n_last, n_same
      n_last = 0
      if (are_some) n_last = list%n
      call move_alloc(list%last, spare)
      call move_alloc(list%items, list%last)
      call move_alloc(spare, list%items)
      list%n = 0
      list%n_faces = 0
      at = 0
      do k = pairs%first_of(part), pairs%first_of(part + 1) - 1
         associate (a => pairs%candidates(1, k), b => pairs%candidates(2, k), near => list%near)
            ! numbers of the pair in the lists before; 0: it had no entries
            n_same = 0
            if (at < n_last) then
               if (list%last(at + 1) == k) n_same = n_heads + 2*sum(list%last(at + 2:at + n_heads))
            end if
            at = at + n_same
            if (moved%are_together(a, b)) then
               if (n_same == 0) cycle
               list%n_faces = list%n_faces + list%last(at - n_same + 1 + edges_with_edges)
               call append(list, list%last(at - n_same + 1:at))
               cycle
            end if
            if (.not. boxes_close(boxes(:, a), boxes(:, b), limits%reach + 2*allowance)) cycle
            call collect_pair([blocks%vertex_offset(a) + 1, blocks%vertex_offset(a + 1)], &
                              [blocks%vertex_offset(b) + 1, blocks%vertex_offset(b + 1)], boxes(:, a), &
                              boxes(:, b), vertices, topology, limits%reach + 2*allowance, near)
            if (near%n_near_a == 0 .and. near%n_edges_a == 0) cycle
            head = list%n
            call append(list, [k, spread(0, 1, n_kinds)])
            call list_faces(near, vertices, outlines, limits, allowance, list, n(edges_with_edges))
            call list_corners(near, vertices, topology, outlines, limits, allowance, list, &
                              n(corners_with_corners))
            call list_vertices(near%near_a, near%n_near_a, near%edges_b, near%n_edges_b, vertices, topology, outlines, &
                               limits, allowance, list, n(vertices_of_first))
            call list_vertices(near%near_b, near%n_near_b, near%edges_a, near%n_edges_a, vertices, topology, outlines, &
                               limits, allowance, list, n(vertices_of_second))
         end associate
         list%items(head + 2:head + n_heads) = n
         list%n_faces = list%n_faces + n(edges_with_edges)
         if (all(n == 0)) list%n = head
      end do
   end subroutine list_part

   !> Edges that may face each other: their directions, and where they lie, differ by less than the tolerance and what
   !> both may change.
   pure subroutine list_faces(near, vertices, outlines, limits, allowance, list, n)
      type(candidate_list_type), intent(in) :: near        !! what is close in the pair
      real(wp), intent(in), contiguous :: vertices(:, :)
      type(outlines_type), intent(in) :: outlines
      type(search_limits_type), intent(in) :: limits
      real(wp), intent(in) :: allowance
      type(near_part_type), intent(inout) :: list
      integer, intent(out) :: n                            !! entries
      real(wp) :: d(2), turns(2), along, gap, slack, size_of_d, sine
      integer :: i, j, f, e
      n = 0
      sine = limits%facing_sine()
      do i = 1, near%n_edges_a
         f = near%edges_a(i)
         do j = 1, near%n_edges_b
            e = near%edges_b(j)
            associate (t => outlines%tangent, length => outlines%length)
               turns = turn_of([length(f), length(e)], allowance)
               if (t(1, f)*t(1, e) + t(2, f)*t(2, e) > -limits%held_cosine + turns(1) + turns(2)) cycle
               d(1) = vertices(1, f) - vertices(1, e)
               d(2) = vertices(2, f) - vertices(2, e)
               along = d(1)*t(1, e) + d(2)*t(2, e)
               gap = d(1)*t(2, e) - d(2)*t(1, e)
               size_of_d = abs(d(1)) + abs(d(2))
               ! positions along e and gaps on the interval differ from these by the sine of the angle
               slack = (sine + 1.0e-9_wp)*(size_of_d + length(f) + length(e) + 8*allowance) + &
                       6*allowance + size_of_d*turns(2)
               if (along < -slack .or. along - length(f) > length(e) + slack) cycle
               if (gap > limits%reach + slack .or. gap < -limits%penetration - slack) cycle
            end associate
            n = n + 1
            call append(list, [f, e])
         end do
      end do
   end subroutine list_faces

   !> Corners that may come into each other's regions.
   pure subroutine list_corners(near, vertices, topology, outlines, limits, allowance, list, n)
      type(candidate_list_type), intent(in) :: near
      real(wp), intent(in), contiguous :: vertices(:, :)
      type(contact_topology_type), intent(in) :: topology
      type(outlines_type), intent(in) :: outlines
      type(search_limits_type), intent(in) :: limits
      real(wp), intent(in) :: allowance
      type(near_part_type), intent(inout) :: list
      integer, intent(out) :: n
      real(wp) :: r(2), foot, zone
      integer :: i, j, k, a, b, edge(4)
      logical :: may_meet
      n = 0
      do i = 1, near%n_near_a
         a = near%near_a(i)
         do j = 1, near%n_near_b
            b = near%near_b(j)
            edge = [topology%edge_out(b), topology%edge_in(b), topology%edge_out(a), topology%edge_in(a)]
            zone = corner_zone*(min(outlines%length(edge(1)), outlines%length(edge(2)), outlines%length(edge(3)), &
                                    outlines%length(edge(4))) + 2*allowance)
            r = vertices(:, a) - vertices(:, b)
            may_meet = .true.
            do k = 1, 4
               foot = r(1)*outlines%tangent(1, edge(k)) + r(2)*outlines%tangent(2, edge(k))
               if (k == 2 .or. k == 3) foot = -foot
               may_meet = foot <= zone + 2*allowance + &
                          (abs(r(1)) + abs(r(2)))*turn_of(outlines%length(edge(k)), allowance)
               if (.not. may_meet) exit
            end do
            if (.not. may_meet) cycle
            if (stays_lateral(edge(3), edge(2)) .or. stays_lateral(edge(1), edge(4))) cycle
            n = n + 1
            call append(list, [a, b])
         end do
      end do

   contains

      !> Do two edges face each other on an interval, although both move?
      pure logical function stays_lateral(f, e)
         integer, intent(in) :: f, e
         type(interval_type) :: interval
         real(wp) :: change, depth, overlap, turn
         turn = turn_of(outlines%length(f), allowance) + turn_of(outlines%length(e), allowance)
         stays_lateral = stays_facing(outlines%tangent(:, f), outlines%tangent(:, e), turn, limits)
         if (.not. stays_lateral) return
         call measure_interval(f, e, vertices, topology, outlines, interval)
         stays_lateral = interval%exists
         if (.not. stays_lateral) return
         change = 6*allowance + (outlines%length(f) + outlines%length(e))*turn
         depth = change - min(interval%gap_low, interval%gap_high)
         overlap = interval%high - interval%low - change
         stays_lateral = depth < min(overlap, topology%inradius(topology%block(f)), &
                                     topology%inradius(topology%block(e))) .and. &
                         overlap > 1.0e-6_wp*min(outlines%length(f), outlines%length(e))
      end function stays_lateral

   end subroutine list_corners

   !> Vertices that may strike edges: not those at the end of an edge that faces the other one, nor of a corner that
   !> points away from it, for any motion of their blocks.
   pure subroutine list_vertices(near, n_near, edges, n_edges, vertices, topology, outlines, limits, allowance, &
                                 list, n)
      integer, intent(in) :: n_near, n_edges
      integer, intent(in) :: near(:), edges(:)             !! vertices of one block, edges of the other
      real(wp), intent(in), contiguous :: vertices(:, :)
      type(contact_topology_type), intent(in) :: topology
      type(outlines_type), intent(in) :: outlines
      type(search_limits_type), intent(in) :: limits
      real(wp), intent(in) :: allowance
      type(near_part_type), intent(inout) :: list
      integer, intent(out) :: n
      real(wp) :: r(2), t(2), into(2), outof(2), turns(2), turn, change, gap, along
      integer :: i, j, v, e
      n = 0
      do i = 1, n_near
         v = near(i)
         into = outlines%tangent(:, topology%edge_in(v))
         outof = outlines%tangent(:, topology%edge_out(v))
         turns = turn_of(outlines%length([topology%edge_in(v), topology%edge_out(v)]), allowance)
         if (into(1)*outof(2) - into(2)*outof(1) < -limits%sine - turns(1) - turns(2)) cycle
         do j = 1, n_edges
            e = edges(j)
            r(1) = vertices(1, v) - vertices(1, e)
            r(2) = vertices(2, v) - vertices(2, e)
            t = outlines%tangent(:, e)
            turn = turn_of(outlines%length(e), allowance)
            change = 4*allowance + (abs(r(1)) + abs(r(2)))*turn
            gap = r(1)*t(2) - r(2)*t(1)
            if (gap > limits%reach + change .or. gap < -limits%penetration - change) cycle
            along = r(1)*t(1) + r(2)*t(2)
            if (along < -limits%zone - change .or. along > outlines%length(e) + limits%zone + change) cycle
            if (outof(1)*t(2) - outof(2)*t(1) < -limits%sine - turns(2) - turn) cycle
            if (into(2)*t(1) - into(1)*t(2) < -limits%sine - turns(1) - turn) cycle
            if (stays_facing(into, t, turns(1) + turn, limits)) cycle
            if (stays_facing(outof, t, turns(2) + turn, limits)) cycle
            n = n + 1
            call append(list, [v, e])
         end do
      end do
   end subroutine list_vertices

   !> By how much an edge turns at most [rad].
   elemental real(wp) function turn_of(length, allowance)
      real(wp), intent(in) :: length                       !! of the edge, at its place [length]
      real(wp), intent(in) :: allowance
      turn_of = any_turn
      if (4*allowance < length) turn_of = 2.1_wp*allowance/length
   end function turn_of

   !> Do two edges run in opposite directions within the angle tolerance, although both turn?
   pure logical function stays_facing(one, other, turn, limits)
      real(wp), intent(in) :: one(2), other(2)             !! unit vectors
      real(wp), intent(in) :: turn                         !! of both [rad]
      type(search_limits_type), intent(in) :: limits
      ! cos(tolerance - turn) is less
      stays_facing = one(1)*other(1) + one(2)*other(2) <= -(limits%cosine + limits%facing_sine()*turn) &
         - 4*epsilon(turn) .and. &
                     turn < limits%sine
   end function stays_facing

   !> Append numbers.
   pure subroutine append(list, numbers)
      type(near_part_type), intent(inout) :: list
      integer, intent(in) :: numbers(:)
      integer :: k
      call grow(list%items, list%n + size(numbers))
      do k = 1, size(numbers)
         list%items(list%n + k) = numbers(k)
      end do
      list%n = list%n + size(numbers)
   end subroutine append

   !> All blocks get new places of their own.
   pure subroutine move_all(self, n_blocks)
      class(moved_groups_type), intent(inout) :: self
      integer, intent(in) :: n_blocks
      if (allocated(self%group)) then
         if (size(self%group) /= n_blocks) deallocate (self%group)
      end if
      if (.not. allocated(self%group)) allocate (self%group(n_blocks))
      self%group = alone
      self%n_groups = 0
      self%n_shifts = 0
   end subroutine move_all

   !> Have two blocks kept their places against each other?
   elemental logical function are_together(self, a, b)
      class(moved_groups_type), intent(in) :: self
      integer, intent(in) :: a, b                      !! blocks
      are_together = self%group(a) == self%group(b) .and. self%group(a) /= alone
   end function are_together

   !> Has no vertex moved further than the allowance? Else put blocks into groups. There is a bound for the rounding of
   !> coordinates, and of places that were moved.
   subroutine find(self, blocks, vertices, places, allowance)
      class(moved_groups_type), intent(inout) :: self
      type(block_system_type), intent(in) :: blocks
      real(wp), intent(in), contiguous :: vertices(:, :), places(:, :)   !! (2, nv)
      real(wp), intent(in) :: allowance                                  !! [length]
      real(wp) :: square, most, rounding, mean(2)
      integer :: members(most_groups), b, g, v
      square = 0
      most = 0
      !$omp parallel do default(none) shared(vertices, places) private(v) reduction(max:square, most) schedule(static) &
      !$omp if (size(vertices, 2) > 4*parallel_blocks)
      do v = 1, size(vertices, 2)
         square = max(square, (vertices(1, v) - places(1, v))**2 + (vertices(2, v) - places(2, v))**2)
         most = max(most, abs(vertices(1, v)), abs(vertices(2, v)))
      end do
      !$omp end parallel do
      rounding = (16 + 2*self%n_shifts)*epsilon(most)*most
      self%none_has_moved = sqrt(square) + rounding <= allowance
      if (self%none_has_moved) return
      self%n_groups = 0
      members = 0
      do b = 1, blocks%n_blocks
         associate (first => blocks%vertex_offset(b) + 1, last => blocks%vertex_offset(b + 1))
            self%group(b) = stays
            if (is_near([0.0_wp, 0.0_wp], far)) cycle
            self%group(b) = alone
            do g = 1, self%n_groups
               if (.not. is_near(self%shift(:, g), beside)) cycle
               self%group(b) = g
               members(g) = members(g) + 1
               exit
            end do
            if (self%group(b) /= alone .or. self%n_groups == most_groups) cycle
            mean = 0
            do v = first, last
               mean = mean + (vertices(:, v) - places(:, v))
            end do
            mean = mean/(last - first + 1)
            if (.not. is_near(mean, beside)) cycle
            self%n_groups = self%n_groups + 1
            self%group(b) = self%n_groups
            self%shift(:, self%n_groups) = mean
            members(self%n_groups) = 1
         end associate
      end do
      self%n_shifts = self%n_shifts + 1
      ! what is alone stands in its places exactly
      do b = 1, blocks%n_blocks
         if (self%group(b) <= stays) cycle
         if (members(self%group(b)) == 1) self%group(b) = alone
      end do

   contains

      !> Are the vertices of block b within a share of the allowance of their places, moved by `shift`? Written so that
      !> a place that is no number is not near.
      pure logical function is_near(shift, share)
         real(wp), intent(in) :: shift(2)              !! [length]
         real(wp), intent(in) :: share
         real(wp) :: limit
         integer :: i
         limit = share*allowance - rounding
         is_near = limit > 0
         do i = blocks%vertex_offset(b) + 1, blocks%vertex_offset(b + 1)
            if (.not. is_near) return
            is_near = (vertices(1, i) - places(1, i) - shift(1))**2 + &
                      (vertices(2, i) - places(2, i) - shift(2))**2 <= limit**2
         end do
      end function is_near

   end subroutine find

   !> New places of the blocks that have moved, and the boxes of these.
   subroutine move_places(self, blocks, vertices, boxes, places, boxes_of_places)
      class(moved_groups_type), intent(in) :: self
      type(block_system_type), intent(in) :: blocks
      real(wp), intent(in), contiguous :: vertices(:, :)       !! (2, nv) now
      real(wp), intent(in), contiguous :: boxes(:, :)          !! (4, nb) of these
      real(wp), intent(inout), contiguous :: places(:, :), boxes_of_places(:, :)
      integer :: b, v
      !$omp parallel do default(none) shared(self, blocks, vertices, boxes, places, boxes_of_places) private(b, v) &
      !$omp schedule(static) if (blocks%n_blocks > parallel_blocks)
      do b = 1, blocks%n_blocks
         associate (g => self%group(b))
            if (g == stays) cycle
            if (g == alone) then
               boxes_of_places(:, b) = boxes(:, b)
               do v = blocks%vertex_offset(b) + 1, blocks%vertex_offset(b + 1)
                  places(:, v) = vertices(:, v)
               end do
            else
               boxes_of_places(1:2, b) = boxes_of_places(1:2, b) + self%shift(:, g)
               boxes_of_places(3:4, b) = boxes_of_places(3:4, b) + self%shift(:, g)
               do v = blocks%vertex_offset(b) + 1, blocks%vertex_offset(b + 1)
                  places(:, v) = places(:, v) + self%shift(:, g)
               end do
            end if
         end associate
      end do
      !$omp end parallel do
   end subroutine move_places

end module rockdda_contact_near_lists
