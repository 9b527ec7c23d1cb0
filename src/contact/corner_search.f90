! SPDX-License-Identifier: MIT
!> Which corners of two close blocks meet.
!>
!> Vertex-vertex: both vertices lie in each other's corner region (no foot further into an adjacent edge than
!> `zone`). Seen from one block, the other vertex is inside when it is behind both entrance lines; a line is an
!> edge of one block that has the other's corner on its outer side. Lines that agree within the angle tolerance
!> (the edges of two blocks face to face) are one: the corner whose foot lies on the other's edge is the vertex of the
!> row. Two lines become two rows, partners, of which the one with the larger gap decides. With that choice a pair of
!> blocks face to face has one row at each end of the shared length, however the blocks are numbered. When one corner
!> slides past the other the roles change, and the new row goes on with the history of the old one (its alias).
!> Edges that run away from the two corners in opposite directions overlap beyond both corners, or not at all. When they
!> do, each corner has a row of its own, as it has outside of the corner region: else the second spring would come into
!> being at depth where the blocks leave it. A row that would begin at depth beside a closed one is not made; the deeper
!> of the two corners has the only one then.
module rockdda_contact_corner_search
   use rockdda_base_kinds, only : wp
   use rockdda_contact_candidates, only : candidate_type, candidate_list_type
   use rockdda_contact_corners, only : corner_type, corner_station, meet_corners
   use rockdda_contact_exposure, only : exposure_type
   use rockdda_contact_history, only : contact_history_type
   use rockdda_contact_intervals, only : interval_type, measure_interval, is_facing
   use rockdda_contact_outlines, only : outlines_type, outward, is_outside
   use rockdda_contact_search_limits, only : search_limits_type
   use rockdda_contact_table, only : contact_table_type, contact_state
   use rockdda_contact_topology, only : contact_topology_type
   implicit none
   private
   public :: search_corners

   !> Of the four lines of two corners (edge that leaves b, reaches b, leaves a, reaches a), the one of the other block
   !> that runs the other way when they are face to face.
   integer, parameter :: opposite(4) = [3, 4, 1, 2]
   !> By length a corner region goes this share of the shortest edge into the edges.
   real(wp), parameter :: corner_zone = 0.25_wp
   !> Edges face to face that overlap beyond two corners by less than this share of their length have one row there: in
   !> rock cut by two continuous joint sets diagonal blocks overlap by what the joints have slipped.
   real(wp), parameter :: least_overlap = 1.0e-3_wp

contains

   !> Contacts of some vertices of one block with some of the other. Most pairs are too far apart.
   pure subroutine search_corners(near_a, n_near_a, near_b, n_near_b, nv, vertices, topology, outlines, previous, &
                                  history, exposure, limits, list)
      integer, intent(in) :: n_near_a, n_near_b, nv
      integer, intent(in) :: near_a(n_near_a), near_b(n_near_b)
      real(wp), intent(in) :: vertices(2, nv)
      type(contact_topology_type), intent(in) :: topology
      type(outlines_type), intent(in) :: outlines
      type(contact_table_type), intent(in) :: previous
      type(contact_history_type), intent(in) :: history
      type(exposure_type), intent(in) :: exposure
      type(search_limits_type), intent(in) :: limits
      type(candidate_list_type), intent(inout) :: list
      real(wp) :: x, y, far
      integer :: i, j
      if (limits%by_length) then
         do i = 1, n_near_a
            do j = 1, n_near_b
               call try_rounded_corner(near_a(i), near_b(j), vertices, topology, outlines, exposure, limits, list)
            end do
         end do
         return
      end if
      far = max(limits%reach, 2*limits%zone)**2
      do i = 1, n_near_a
         x = vertices(1, near_a(i))
         y = vertices(2, near_a(i))
         do j = 1, n_near_b
            if ((x - vertices(1, near_b(j)))**2 + (y - vertices(2, near_b(j)))**2 > far) cycle
            call try_corner(near_a(i), near_b(j), vertices, topology, outlines, previous, history, exposure, limits, &
                            list)
         end do
      end do
   end subroutine search_corners

   !> Vertex-vertex contact of vertex a (block a) and vertex b (block b), close to each other.
   !>
   !>              block a              the four lines that may be the entrance, numbered as below:
   !>        4 \         / 3              1  the edge that leaves b      vertex a meets it
   !>           \       /                 2  the edge that reaches b     vertex a meets it
   !>    in of a \     / out of a         3  the edge that leaves a      vertex b meets it
   !>             \   /                   4  the edge that reaches a     vertex b meets it
   !>               a
   !>               b                   A line counts when the whole corner of the other block lies outside of it.
   !>    out of b /   \ in of b          Lines whose normals agree are one group: face to face 1 goes with 3, 2 with 4.
   !>          1 /     \ 2               One group gives one row, two groups give two rows that are partners.
   !>              block b
   !>
   !> Of a group the line with the foot furthest inside is taken, unless a contact closed in the last step is in it.
   !> Long, for the choice of rows is one decision with one set of numbers.
   pure subroutine try_corner(a, b, vertices, topology, outlines, previous, history, exposure, limits, list)
      integer, intent(in) :: a, b
      real(wp), intent(in), contiguous :: vertices(:, :)
      type(contact_topology_type), intent(in) :: topology
      type(outlines_type), intent(in) :: outlines
      type(contact_table_type), intent(in) :: previous
      type(contact_history_type), intent(in) :: history
      type(exposure_type), intent(in) :: exposure
      type(search_limits_type), intent(in) :: limits
      type(candidate_list_type), intent(inout) :: list
      real(wp) :: r(2), in_a(2), out_a(2), in_b(2), out_b(2), length(4), normal(2, 4), foot(4), overlap
      integer :: vertex(4), edge(4), group(4), chosen(2), closed(2), alias_vertex(2), alias_edge(2)
      integer :: ends(2), k, g, n_groups, row
      logical :: passes(4)

      r = vertices(:, a) - vertices(:, b)
      if (outlines%concave(a) .or. outlines%concave(b)) return
      in_a = outlines%tangent(:, topology%edge_in(a))
      out_a = outlines%tangent(:, topology%edge_out(a))
      in_b = outlines%tangent(:, topology%edge_in(b))
      out_b = outlines%tangent(:, topology%edge_out(b))
      length = outlines%length([topology%edge_in(a), topology%edge_out(a), topology%edge_in(b), topology%edge_out(b)])
      ! each vertex in the other's corner region
      if (dot_product(r, out_b) > min(limits%zone, 0.25_wp*length(4))) return
      if (-dot_product(r, in_b) > min(limits%zone, 0.25_wp*length(3))) return
      if (-dot_product(r, out_a) > min(limits%zone, 0.25_wp*length(2))) return
      if (dot_product(r, in_a) > min(limits%zone, 0.25_wp*length(1))) return

      ! the four possible entrance lines; normals are for the relative position r of a against b
      vertex = [a, a, b, b]
      edge = [topology%edge_out(b), topology%edge_in(b), topology%edge_out(a), topology%edge_in(a)]
      normal(:, 1) = [out_b(2), -out_b(1)]
      normal(:, 2) = [in_b(2), -in_b(1)]
      normal(:, 3) = [-out_a(2), out_a(1)]
      normal(:, 4) = [-in_a(2), in_a(1)]
      do k = 1, 2
         passes(k) = is_outside(in_a, out_a, normal(:, k), limits%sine)
         passes(k + 2) = is_outside(in_b, out_b, -normal(:, k + 2), limits%sine)
      end do
      if (limits%corrected) then
         do k = 1, 4
            if (passes(k)) passes(k) = .not. exposure%is_passed(vertex(k), edge(k), vertices, topology, outlines, &
                                                                limits%cosine, previous, history)
         end do
      end if
      if (.not. any(passes)) return
      if (maxval(matmul(r, normal), mask=passes) < -limits%penetration) return
      call group_lines(normal, passes, limits%cosine, group, n_groups)

      foot = [dot_product(r, out_b), -dot_product(r, in_b), -dot_product(r, out_a), dot_product(r, in_a)]
      chosen = 0
      closed = 0
      do k = 1, 4
         if (group(k) == 0) cycle
         row = history%find(previous, vertex(k), edge(k))
         if (row > 0) then
            if (previous%state(row) /= contact_state%open .and. closed(group(k)) == 0) closed(group(k)) = k
         end if
         if (chosen(group(k)) == 0) then
            chosen(group(k)) = k
         else if (foot(k) > foot(chosen(group(k)))) then
            chosen(group(k)) = k
         end if
      end do
      alias_vertex = 0
      alias_edge = 0
      do k = 1, n_groups
         if (closed(k) == 0) cycle
         if (foot(closed(k)) >= -1.0e-9_wp*maxval(length)) then
            chosen(k) = closed(k)
         else if (chosen(k) /= closed(k)) then
            alias_vertex(k) = vertex(closed(k))
            alias_edge(k) = edge(closed(k))
         end if
      end do
      call list%add_corners(a, b)
      ! edges that run away from the two corners in opposite directions and overlap have a row at each end
      ends = 0
      do g = 1, n_groups
         k = opposite(chosen(g))
         if (group(k) /= g) cycle
         overlap = min(foot(k), foot(chosen(g)))
         if (overlap <= 0) cycle
         if (overlap <= least_overlap*min(length(5 - k), length(5 - chosen(g)))) cycle
         if (closed(g) > 0 .and. dot_product(r, normal(:, k)) < 0) then
            if (history%find(previous, vertex(k), edge(k)) == 0) then
               ! a spring would come into being at depth: the deeper end alone, with the one spring there is
               if (chosen(g) == closed(g) .and. dot_product(r, normal(:, k) - normal(:, chosen(g))) < 0) then
                  chosen(g) = k
                  alias_vertex(g) = vertex(closed(g))
                  alias_edge(g) = edge(closed(g))
               end if
               cycle
            end if
         end if
         ends(g) = k
      end do
      if (n_groups == 1) then
         call list%append(candidate_type(vertex(chosen(1)), edge(chosen(1)), 0, 0, alias_vertex(1), alias_edge(1)))
         if (ends(1) > 0) call list%append(candidate_type(vertex(ends(1)), edge(ends(1))))
      else
         call list%append(candidate_type(vertex(chosen(1)), edge(chosen(1)), vertex(chosen(2)), edge(chosen(2)), &
                                          alias_vertex(1), alias_edge(1)))
         call list%append(candidate_type(vertex(chosen(2)), edge(chosen(2)), vertex(chosen(1)), edge(chosen(1)), &
                                          alias_vertex(2), alias_edge(2)))
         do g = 1, 2
            if (ends(g) > 0) call list%append(candidate_type(vertex(ends(g)), edge(ends(g)), &
                                                              vertex(chosen(3 - g)), edge(chosen(3 - g))))
         end do
      end if
   end subroutine try_corner

   !> Corner a of one block and corner b of another with contact by length: a row, unless their edges face each other,
   !> or lie in one plane so that one corner passes over the other, or a side is hidden.
   pure subroutine try_rounded_corner(a, b, vertices, topology, outlines, exposure, limits, list)
      integer, intent(in) :: a, b
      real(wp), intent(in), contiguous :: vertices(:, :)
      type(contact_topology_type), intent(in) :: topology
      type(outlines_type), intent(in) :: outlines
      type(exposure_type), intent(in) :: exposure
      type(search_limits_type), intent(in) :: limits
      type(candidate_list_type), intent(inout) :: list
      type(corner_type) :: corner
      real(wp) :: r(2), zone
      integer :: k, edge(4), v, e
      if (outlines%concave(a) .or. outlines%concave(b)) return
      r = vertices(:, a) - vertices(:, b)
      edge = [topology%edge_out(b), topology%edge_in(b), topology%edge_out(a), topology%edge_in(a)]
      ! each vertex in the other's corner region, which holds the arc: it depends on the blocks alone
      zone = corner_zone*minval(outlines%length(edge))
      do k = 1, 4
         if (into_edge(k) > zone) return
      end do
      if (is_lateral(edge(2), edge(3)) .or. is_lateral(edge(4), edge(1))) return
      call meet_corners(a, b, vertices, topology, outlines, limits%sine, limits%cosine, limits%radius, corner)
      if (.not. corner%exists) return
      if (corner%gap < -limits%penetration .or. corner%gap > limits%reach) return
      do k = 1, 2
         e = corner%edge(k)
         if (e == 0) cycle
         v = corner%vertex(k)
         if (exposure%is_hidden(v, e, dot_product(vertices(:, v) - vertices(:, e), outlines%tangent(:, e)), vertices, &
                                topology, outlines)) return
      end do
      call list%add_corners(a, b)
      call list%append(candidate_type(a, b, station=corner_station))

   contains

      !> How far the foot of the other corner lies inside an edge.
      pure real(wp) function into_edge(k)
         integer, intent(in) :: k
         into_edge = dot_product(r, outlines%tangent(:, edge(k)))
         if (k == 2 .or. k == 3) into_edge = -into_edge
      end function into_edge

      !> Do these edges at the two corners face each other on an interval, or lie in one plane?
      pure logical function is_lateral(e, f)
         integer, intent(in) :: e, f
         type(interval_type) :: interval
         is_lateral = .false.
         if (.not. is_facing(f, e, outlines, limits%cosine)) return
         call measure_interval(f, e, vertices, topology, outlines, interval)
         is_lateral = interval%exists .or. &
                      abs(dot_product(r, outward(outlines%tangent(:, e)))) <= exposure%between(f, e)
      end function is_lateral

   end subroutine try_rounded_corner

   !> Lines whose normals agree are one group; at most two groups stay (the most different ones).
   pure subroutine group_lines(normal, passes, cosine, group, n_groups)
      real(wp), intent(in) :: normal(2, 4)
      logical, intent(in) :: passes(4)
      real(wp), intent(in) :: cosine
      integer, intent(out) :: group(4)   !! 1, 2 or 0 (not an entrance line)
      integer, intent(out) :: n_groups
      integer :: k, first, second
      real(wp) :: least, c
      group = 0
      n_groups = 0
      first = 0
      do k = 1, 4
         if (passes(k)) then
            first = k
            exit
         end if
      end do
      if (first == 0) return
      group(first) = 1
      n_groups = 1
      second = 0
      least = cosine
      do k = first + 1, 4
         if (.not. passes(k)) cycle
         c = dot_product(normal(:, first), normal(:, k))
         if (c >= cosine) then
            group(k) = 1
         else if (c < least) then
            least = c
            second = k
         end if
      end do
      if (second == 0) return
      n_groups = 2
      do k = first + 1, 4
         if (.not. passes(k) .or. group(k) == 1) cycle
         if (dot_product(normal(:, second), normal(:, k)) >= cosine) group(k) = 2
      end do
      group(second) = 2
   end subroutine group_lines

end module rockdda_contact_corner_search
