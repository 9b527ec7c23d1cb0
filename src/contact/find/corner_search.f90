! SPDX-License-Identifier: MIT
!> Which corners of two close blocks meet.
!>
!> Vertex-vertex: both vertices lie in each other's corner region (no foot further into an adjacent edge than
!> `zone`). Seen from one block, the other vertex is inside when it is behind both entrance lines; a line is an
!> edge of one block that has the other's corner on its outer side. Lines that agree within the angle tolerance
!> (the edges of two blocks face to face) are one: the corner whose foot lies on the other's edge is the vertex of the
!> row. Two lines become two rows, partners, of which the one with the larger gap decides. With that choice a pair of
!> blocks face to face has one row at each end of the shared length, however the blocks are numbered. When one corner
!> slides past the other the roles change, and the new row continues the history of the old one (its alias).
!> Edges that run away from the two corners in opposite directions overlap beyond both corners, or not at all. When they
!> do, each corner has a row of its own, as it has outside of the corner region: else the second spring would come into
!> being at depth where the blocks leave it. A row that would begin at depth beside a closed one is not made; the deeper
!> of the two corners has the only one then.
module rockdda_contact_corner_search
   use rockdda_base_kinds, only : wp
   use rockdda_contact_candidates, only : candidate_type, other_rows_type, candidate_list_type
   use rockdda_contact_corners, only : corner_type, corner_station, meet_corners
   use rockdda_contact_exposure, only : search_input_type
   use rockdda_contact_history, only : faces
   use rockdda_contact_intervals, only : interval_type, measure_interval
   use rockdda_contact_outlines, only : outward
   use rockdda_contact_table, only : contact_table_type, contact_state
   implicit none
   private
   public :: search_corners, try_rounded_corner, corner_zone

   !> Of the four lines of two corners (edge that leaves b, reaches b, leaves a, reaches a), the one of the other block
   !> that runs the other way when they are face to face.
   integer, parameter :: opposite(4) = [3, 4, 1, 2]
   !> By length a corner region goes this share of the shortest edge into the edges.
   real(wp), parameter :: corner_zone = 0.25_wp
   !> Edges face to face that overlap beyond two corners by less than this share of their length have one row there: in
   !> rock cut by two continuous joint sets diagonal blocks overlap by what the joints have slipped.
   real(wp), parameter :: least_overlap = 1.0e-3_wp

   !> The four lines that may be the entrance of two corners, in the order of `try_corner`, each with its row to be.
   type :: corner_lines_type
      real(wp) :: r(2)             !! vertex a against vertex b [length]
      integer :: vertex(4), edge(4)
      integer :: row(4)            !! of the last step, 0 none
      real(wp) :: tangent(2, 4)    !! of the edges
      real(wp) :: length(4)        !! of the edges [length]
      real(wp) :: foot(4)          !! how far the foot of the other corner lies inside the edge [length]
      real(wp) :: normal(2, 4)     !! for r
      real(wp) :: gap(4)           !! r along the normal [length]
      integer :: group(4)          !! lines whose normals agree: 1, 2 or 0 (not an entrance line)
      integer :: n_groups
   end type corner_lines_type

contains

   !> Contacts of some vertices of one block with some of the other. Most pairs are too far apart.
   pure subroutine search_corners(near_a, n_near_a, near_b, n_near_b, nv, vertices, given, list)
      integer, intent(in) :: n_near_a, n_near_b, nv
      integer, intent(in) :: near_a(n_near_a), near_b(n_near_b)
      real(wp), intent(in) :: vertices(2, nv)
      type(search_input_type), intent(in) :: given
      type(candidate_list_type), intent(inout) :: list
      real(wp) :: x, y, far
      integer :: i, j
      far = max(given%limits%reach, 2*given%limits%zone)**2
      do i = 1, n_near_a
         x = vertices(1, near_a(i))
         y = vertices(2, near_a(i))
         do j = 1, n_near_b
            if ((x - vertices(1, near_b(j)))**2 + (y - vertices(2, near_b(j)))**2 > far) cycle
            call try_corner(near_a(i), near_b(j), given, list)
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
   pure subroutine try_corner(a, b, given, list)
      integer, intent(in) :: a, b
      type(search_input_type), intent(in) :: given
      type(candidate_list_type), intent(inout) :: list
      type(corner_lines_type) :: lines
      integer :: k
      logical :: passes(4)
      if (given%outlines%concave(a) .or. given%outlines%concave(b)) return
      lines%r = given%vertices(:, a) - given%vertices(:, b)
      lines%vertex = [a, a, b, b]
      lines%edge = [given%topology%edge_out(b), given%topology%edge_in(b), given%topology%edge_out(a), &
                                            given%topology%edge_in(a)]
      do k = 1, 4
         lines%tangent(:, k) = given%outlines%tangent(:, lines%edge(k))
         lines%length(k) = given%outlines%length(lines%edge(k))
         lines%foot(k) = lines%r(1)*lines%tangent(1, k) + lines%r(2)*lines%tangent(2, k)
         if (k == 2 .or. k == 3) lines%foot(k) = -lines%foot(k)
         ! each vertex in the other's corner region
         if (lines%foot(k) > min(given%limits%zone, 0.25_wp*lines%length(k))) return
      end do
      call set_normals(given%limits%sine, lines, passes)
      if (given%limits%corrected) then
         do k = 1, 4
            if (passes(k)) passes(k) = .not. given%exposure%is_passed(lines%vertex(k), lines%edge(k), given)
         end do
      end if
      if (.not. any(passes .and. lines%gap >= -given%limits%penetration)) return
      call group_lines(lines%normal, passes, given%limits%cosine, lines%group, lines%n_groups)
      do k = 1, 4
         lines%row(k) = 0
         if (lines%group(k) > 0) lines%row(k) = given%history%find(given%previous, lines%vertex(k), lines%edge(k))
      end do
      call list%add_corners(a, b)
      call append_rows(lines, given%previous, list)
   end subroutine try_corner

   !> Normals of the four lines, for the relative position r of a against b, and gaps; a line passes when both edges of
   !> the other corner lie outside of it.
   pure subroutine set_normals(sine, lines, passes)
      real(wp), intent(in) :: sine           !! of the angle tolerance
      type(corner_lines_type), intent(inout) :: lines
      logical, intent(out) :: passes(4)
      real(wp) :: leaving, reaching
      integer :: k
      do k = 1, 4
         associate (t => lines%tangent, n => lines%normal(:, k))
            if (k <= 2) then
               n = [t(2, k), -t(1, k)]
               leaving = t(1, 3)*n(1) + t(2, 3)*n(2)
               reaching = t(1, 4)*n(1) + t(2, 4)*n(2)
            else
               n = [-t(2, k), t(1, k)]
               leaving = -(t(1, 1)*n(1) + t(2, 1)*n(2))
               reaching = -(t(1, 2)*n(1) + t(2, 2)*n(2))
            end if
            lines%gap(k) = lines%r(1)*n(1) + lines%r(2)*n(2)
         end associate
         ! `is_outside`, in place
         passes(k) = leaving >= -sine .and. -reaching >= -sine
      end do
   end subroutine set_normals

   !> Rows of two corners that meet: those of the lines chosen, then those at the far ends of edges that overlap.
   pure subroutine append_rows(lines, previous, list)
      type(corner_lines_type), intent(in) :: lines
      type(contact_table_type), intent(in) :: previous
      type(candidate_list_type), intent(inout) :: list
      type(other_rows_type) :: others
      integer :: chosen(2), alias(2), far_end(2), g
      do g = 1, lines%n_groups
         call choose_line(g, lines, previous, chosen(g), alias(g))
         call find_far_end(g, lines, previous, chosen(g), alias(g), far_end(g))
      end do
      do g = 1, lines%n_groups
         others = partner_of(g)
         if (alias(g) > 0) others%alias_vertex = lines%vertex(alias(g))
         if (alias(g) > 0) others%alias_edge = lines%edge(alias(g))
         call list%append_with(line_row(chosen(g)), others)
      end do
      do g = 1, lines%n_groups
         if (far_end(g) > 0) call list%append_with(line_row(far_end(g)), partner_of(g))
      end do

   contains

      !> Row along line k.
      pure type(candidate_type) function line_row(k)
         integer, intent(in) :: k
         line_row = candidate_type(lines%vertex(k), lines%edge(k))
      end function line_row

      !> The row of the other group is the partner of those of group g.
      pure type(other_rows_type) function partner_of(g)
         integer, intent(in) :: g
         if (lines%n_groups == 1) return
         partner_of%partner_vertex = lines%vertex(chosen(3 - g))
         partner_of%partner_edge = lines%edge(chosen(3 - g))
      end function partner_of

   end subroutine append_rows

   !> Of a group the line with the foot furthest inside is taken, unless a contact closed in the last step is in it and
   !> its foot has not left the edge: else the row continues with that one as its alias.
   pure subroutine choose_line(g, lines, previous, chosen, alias)
      integer, intent(in) :: g               !! group
      type(corner_lines_type), intent(in) :: lines
      type(contact_table_type), intent(in) :: previous
      integer, intent(out) :: chosen, alias  !! lines; alias 0: none
      integer :: k, closed
      chosen = 0
      do k = 1, 4
         if (lines%group(k) /= g) cycle
         if (chosen == 0) then
            chosen = k
         else if (lines%foot(k) > lines%foot(chosen)) then
            chosen = k
         end if
      end do
      alias = 0
      closed = closed_line(g, lines, previous)
      if (closed == 0) return
      if (lines%foot(closed) >= -1.0e-9_wp*maxval(lines%length)) then
         chosen = closed
      else if (chosen /= closed) then
         alias = closed
      end if
   end subroutine choose_line

   !> First line of a group whose contact was closed in the last step, 0 none.
   pure integer function closed_line(g, lines, previous) result(k)
      integer, intent(in) :: g               !! group
      type(corner_lines_type), intent(in) :: lines
      type(contact_table_type), intent(in) :: previous
      do k = 1, 4
         if (lines%group(k) /= g .or. lines%row(k) == 0) cycle
         if (previous%state(lines%row(k)) /= contact_state%open) return
      end do
      k = 0
   end function closed_line

   !> Edges that run away from the two corners in opposite directions and overlap have a row at each end: the line of
   !> the second one, 0 none. A spring that would come into being at depth does not: the deeper end is chosen alone,
   !> with the one spring that there is.
   pure subroutine find_far_end(g, lines, previous, chosen, alias, far_end)
      integer, intent(in) :: g               !! group
      type(corner_lines_type), intent(in) :: lines
      type(contact_table_type), intent(in) :: previous
      integer, intent(inout) :: chosen, alias
      integer, intent(out) :: far_end
      real(wp) :: overlap
      integer :: k, closed
      far_end = 0
      k = opposite(chosen)
      if (lines%group(k) /= g) return
      overlap = min(lines%foot(k), lines%foot(chosen))
      if (overlap <= 0) return
      if (overlap <= least_overlap*min(lines%length(k), lines%length(chosen))) return
      closed = closed_line(g, lines, previous)
      if (closed > 0 .and. lines%gap(k) < 0 .and. lines%row(k) == 0) then
         if (chosen == closed .and. dot_product(lines%r, lines%normal(:, k) - lines%normal(:, chosen)) < 0) then
            chosen = k
            alias = closed
         end if
      else
         far_end = k
      end if
   end subroutine find_far_end

   !> Corner a of one block and corner b of another with contact by length: a row, unless their edges face each other,
   !> or lie in one plane so that one corner passes over the other, or a side is hidden.
   pure subroutine try_rounded_corner(a, b, given, list)
      integer, intent(in) :: a, b
      type(search_input_type), intent(in) :: given
      type(candidate_list_type), intent(inout) :: list
      type(corner_type) :: corner
      real(wp) :: r(2), zone
      integer :: k, edge(4), v, e
      if (given%outlines%concave(a) .or. given%outlines%concave(b)) return
      r(1) = given%vertices(1, a) - given%vertices(1, b)
      r(2) = given%vertices(2, a) - given%vertices(2, b)
      edge(1) = given%topology%edge_out(b)
      edge(2) = given%topology%edge_in(b)
      edge(3) = given%topology%edge_out(a)
      edge(4) = given%topology%edge_in(a)
      ! each vertex in the other's corner region, which holds the arc: it depends on the blocks alone
      associate (t => given%outlines%tangent, length => given%outlines%length)
         zone = corner_zone*min(length(edge(1)), length(edge(2)), length(edge(3)), length(edge(4)))
         if (r(1)*t(1, edge(1)) + r(2)*t(2, edge(1)) > zone) return
         if (-(r(1)*t(1, edge(2)) + r(2)*t(2, edge(2))) > zone) return
         if (-(r(1)*t(1, edge(3)) + r(2)*t(2, edge(3))) > zone) return
         if (r(1)*t(1, edge(4)) + r(2)*t(2, edge(4)) > zone) return
      end associate
      if (may_face(edge(3), edge(2))) then
         if (is_lateral(edge(2), edge(3))) return
      end if
      if (may_face(edge(4), edge(1))) then
         if (is_lateral(edge(4), edge(1))) return
      end if
      call meet_corners(a, b, given%vertices, given%topology, given%outlines, given%limits%sine, given%limits%cosine, &
                        given%limits%radius, corner, is_weighed=.false.)
      if (.not. corner%exists) return
      if (corner%gap < -given%limits%penetration .or. corner%gap > given%limits%reach) return
      if (given%topology%lets_in_corner(a, b, -corner%gap, given%outlines%length)) return
      if (given%topology%lets_in_corner(b, a, -corner%gap, given%outlines%length)) return
      do k = 1, 2
         e = corner%edge(k)
         if (e == 0) cycle
         v = corner%vertex(k)
         if (given%exposure%is_hidden(v, e, dot_product(given%vertices(:, v) - given%vertices(:, e), &
             given%outlines%tangent(:, e)), given%vertices, given%topology, given%outlines)) return
      end do
      call list%add_corners(a, b)
      call list%append(candidate_type(a, b, station=corner_station))

   contains

      !> Do an edge at corner a and one at corner b face each other, as far as their directions show?
      pure logical function may_face(f, e)
         integer, intent(in) :: f, e
         real(wp) :: opposite
         opposite = given%outlines%tangent(1, f)*given%outlines%tangent(1, e) + given%outlines%tangent(2, &
                                           f)*given%outlines%tangent(2, e)
         may_face = opposite <= -min(given%limits%cosine, given%limits%held_cosine)
         if (may_face) may_face = faces(f, e, opposite, given%limits, given%previous, given%history)
      end function may_face

      !> Do these edges at the two corners, which run in opposite directions, face each other on an interval, or lie in
      !> one plane?
      pure logical function is_lateral(e, f)
         integer, intent(in) :: e, f
         type(interval_type) :: interval
         call measure_interval(f, e, given%vertices, given%topology, given%outlines, interval)
         is_lateral = interval%exists .or. &
                      abs(dot_product(r, outward(given%outlines%tangent(:, e)))) <= given%exposure%between(f, e)
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
