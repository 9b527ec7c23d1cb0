! SPDX-License-Identifier: MIT
!> Which vertex of one block can meet which edge of another one that is close: candidates, which are no contacts yet.
!>
!> The foot of the vertex lies on the edge, both edges at the vertex lie on the outer side of the edge's line, and the
!> gap is within reach. So moving the vertex onto the edge gives no overlap (Shi 1988, Fig. 3.3), within the angle
!> tolerance. A vertex behind an edge must have come through it (`is_entered`): a vertex that only
!> touches a block from another side does not. Concave vertices touch nothing; at a concave end of an edge the foot may
!> lie a little beyond.
!>
!> The other searches beside this one: vertices that meet vertices (rockdda_contact_corner_search), edges that face
!> edges (`search_faces`). rockdda_contact_narrow_search calls all three for all close pairs.
!>
!> The innermost loops of a step read arrays of constant shape: these are arguments beside `given`.
!>
!> A vertex v that touches a block on one side f lies behind the line of its other edges e as well:
!>
!>                  \        /
!>      ---------- v \  B   /      v is at depth |gap| behind e, but it has not come through e: a spring born
!>        A        /  f    /       there would throw the blocks apart
!>                     \__/
!>                      e
!>
!> It has entered through e when it lies in the block, no other edge that its corner can pass is nearer, it is not at
!> another corner of the block, and it is not deeper than a circle that fits into the block. A contact that was closed
!> at the end of the last step has entered, however deep its spring has been compressed since.
module rockdda_contact_vertex_search
   use rockdda_base_kinds, only : wp
   use rockdda_contact_table, only : contact_state
   use rockdda_contact_topology, only : contact_topology_type
   use rockdda_contact_outlines, only : outward, is_outside
   use rockdda_contact_history, only : faces
   use rockdda_contact_search_limits, only : search_limits_type
   use rockdda_contact_candidates, only : candidate_type, candidate_list_type
   use rockdda_contact_corner_search, only : search_corners
   use rockdda_contact_exposure, only : search_input_type
   use rockdda_geometry_polygons, only : point_in_polygon
   implicit none
   private
   public :: search_pair, collect_pair, try_vertex, is_beyond

   !> A vertex that is less deep than this share of the edge's length need not lie in the block: its neighbour may hide
   !> the edge there by the compression of its own spring.
   real(wp), parameter :: shallow = 1.0e-4_wp
   !> The inner point that is tested in place of the vertex lies this share of the edge's length further inside.
   real(wp), parameter :: inwards = 1.0e-6_wp
   !> A vertex nearer to another corner than this share of its depth is at that corner.
   real(wp), parameter :: at_corner = 0.5_wp

contains

   !> Append the candidates of blocks a < b: find what is close, and search there.
   pure subroutine search_pair(range_a, range_b, box_a, box_b, given, list)
      integer, intent(in) :: range_a(2), range_b(2)   !! first and last vertex of each block
      real(wp), intent(in) :: box_a(4), box_b(4)      !! xmin ymin xmax ymax
      type(search_input_type), intent(in) :: given
      type(candidate_list_type), intent(inout) :: list
      call collect_pair(range_a, range_b, box_a, box_b, given%vertices, given%topology, given%limits%reach, list)
      if (list%n_near_a == 0 .and. list%n_edges_a == 0) return
      list%n_corners = 0
      call search_corners(list%near_a, list%n_near_a, list%near_b, list%n_near_b, size(given%vertices, 2), &
                          given%vertices, given, list)
      call search_edges(list%near_a, list%n_near_a, list%edges_b, list%n_edges_b, 1, size(given%vertices, 2), &
                        given%vertices, given%outlines%tangent, given%outlines%length, given, list)
      call search_edges(list%near_b, list%n_near_b, list%edges_a, list%n_edges_a, 2, size(given%vertices, 2), &
                        given%vertices, given%outlines%tangent, given%outlines%length, given, list)
   end subroutine search_pair

   !> Vertices and edges of two blocks that are close to the other one.
   pure subroutine collect_pair(range_a, range_b, box_a, box_b, vertices, topology, reach, list)
      integer, intent(in) :: range_a(2), range_b(2)
      real(wp), intent(in) :: box_a(4), box_b(4)
      real(wp), intent(in), contiguous :: vertices(:, :)
      type(contact_topology_type), intent(in) :: topology
      real(wp), intent(in) :: reach
      type(candidate_list_type), intent(inout) :: list
      list%n_near_b = 0
      list%n_edges_b = 0
      call collect_near(range_a, box_b, size(vertices, 2), vertices, topology, reach, list%near_a, list%n_near_a, &
                        list%edges_a, list%n_edges_a)
      if (list%n_near_a == 0 .and. list%n_edges_a == 0) return
      call collect_near(range_b, box_a, size(vertices, 2), vertices, topology, reach, list%near_b, list%n_near_b, &
                        list%edges_b, list%n_edges_b)
   end subroutine collect_pair

   !> Vertices inside the other block's widened box, and edges whose boxes meet it.
   pure subroutine collect_near(range, box, nv, vertices, topology, reach, near, n_near, edges, n_edges)
      integer, intent(in) :: range(2), nv
      real(wp), intent(in) :: vertices(2, nv)
      real(wp), intent(in) :: box(4), reach
      type(contact_topology_type), intent(in) :: topology
      integer, allocatable, intent(inout) :: near(:), edges(:)
      integer, intent(out) :: n_near, n_edges
      real(wp) :: low(2), high(2)
      integer :: k, n, sides, next_sides, first_sides
      n = range(2) - range(1) + 1
      if (.not. allocated(near)) allocate (near(n), edges(n))
      if (size(near) < n) then
         deallocate (near, edges)
         allocate (near(2*n), edges(2*n))
      end if
      low = box(1:2) - reach
      high = box(3:4) + reach
      n_near = 0
      n_edges = 0
      first_sides = sides_of(vertices(1, range(1)), vertices(2, range(1)))
      next_sides = first_sides
      do k = range(1), range(2)
         sides = next_sides
         next_sides = first_sides
         if (k < range(2)) next_sides = sides_of(vertices(1, k + 1), vertices(2, k + 1))
         if (sides == 0 .and. topology%active(k)) then
            n_near = n_near + 1
            near(n_near) = k
         end if
         ! an edge misses the box of the other block when both ends lie beyond one of its sides
         if (iand(sides, next_sides) == 0 .and. topology%is_edge(k)) then
            n_edges = n_edges + 1
            edges(n_edges) = k
         end if
      end do

   contains

      !> The sides of the widened box beyond which a point lies: a bit for each.
      pure integer function sides_of(x, y)
         real(wp), intent(in) :: x, y
         sides_of = merge(1, 0, x < low(1)) + merge(2, 0, x > high(1)) + merge(4, 0, y < low(2)) + &
                    merge(8, 0, y > high(2))
      end function sides_of

   end subroutine collect_near

   !> Candidates of some vertices of one block with some edges of the other. Most pairs are out of reach. (With arrays
   !> of constant shape, here and below, the program need not work out where each element lies.)
   pure subroutine search_edges(near, n_near, edges, n_edges, side, nv, vertices, tangent, length, given, list)
      integer, intent(in) :: n_near, n_edges, nv
      integer, intent(in) :: near(n_near), edges(n_edges)
      integer, intent(in) :: side   !! 1: the vertices are those of the first block of the pair; 2: of the second
      real(wp), intent(in) :: vertices(2, nv)
      real(wp), intent(in) :: tangent(2, nv), length(nv)   !! of `outlines`
      type(search_input_type), intent(in) :: given
      type(candidate_list_type), intent(inout) :: list
      real(wp) :: gap, s, into(2), outof(2)
      integer :: i, j, v, e
      do i = 1, n_near
         v = near(i)
         if (given%outlines%concave(v)) cycle
         into = tangent(:, given%topology%edge_in(v))
         outof = tangent(:, given%topology%edge_out(v))
         do j = 1, n_edges
            e = edges(j)
            call place_on_edge(vertices(:, v), vertices(:, e), tangent(:, e), gap, s)
            if (is_off_edge(gap, s, length(e), given%limits)) cycle
            if (given%limits%corrected) then
               if (given%exposure%is_passed(v, e, given)) cycle
            end if
            call try_edge(v, e, gap, s, into, outof, side, nv, vertices, tangent, length, given, list)
         end do
      end do
   end subroutine search_edges

   !> Candidate of a vertex with an edge of the other block, with contacts by length: within reach, unless an edge at
   !> the vertex faces the other edge (an interval has both then), or something hides the vertex.
   pure subroutine try_vertex(v, e, side, own_box, other_box, nv, vertices, tangent, length, given, list)
      integer, intent(in) :: v, e, nv
      integer, intent(in) :: side                          !! 1: v is on the first block of the pair; 2: on the second
      real(wp), intent(in) :: own_box(4), other_box(4)     !! of the blocks of v and e
      real(wp), intent(in) :: vertices(2, nv)
      real(wp), intent(in) :: tangent(2, nv), length(nv)   !! of `outlines`
      type(search_input_type), intent(in) :: given
      type(candidate_list_type), intent(inout) :: list
      real(wp) :: t(2), gap, s, into(2), outof(2)
      if (given%outlines%concave(v)) return
      t = tangent(:, e)
      call place_on_edge(vertices(:, v), vertices(:, e), t, gap, s)
      if (is_off_edge(gap, s, length(e), given%limits)) return
      into = tangent(:, given%topology%edge_in(v))
      outof = tangent(:, given%topology%edge_out(v))
      if (is_its_end(given%topology%edge_in(v), into(1)*t(1) + into(2)*t(2))) return
      if (is_its_end(given%topology%edge_out(v), outof(1)*t(1) + outof(2)*t(2))) return
      if (is_beyond(vertices(:, v), vertices(:, v), other_box, given%limits%reach)) return
      if (is_beyond(vertices(:, e), vertices(:, given%topology%next(e)), own_box, given%limits%reach)) return
      if (given%topology%lets_in(v, e, -gap, length)) return
      if (given%exposure%is_hidden(v, e, s, vertices, given%topology, given%outlines)) then
         if (.not. was_closed(v, e, given)) return
         if (given%exposure%is_hidden(v, e, s, vertices, given%topology, given%outlines, presses=.true.)) return
      end if
      call try_edge(v, e, gap, s, into, outof, side, nv, vertices, tangent, length, given, list)

   contains

      !> Does edge f at the vertex face e?
      pure logical function is_its_end(f, opposite)
         integer, intent(in) :: f
         real(wp), intent(in) :: opposite   !! dot product of the directions
         is_its_end = opposite <= -min(given%limits%cosine, given%limits%held_cosine)
         if (is_its_end) is_its_end = faces(merge(f, e, side == 1), merge(e, f, side == 1), opposite, given%limits, &
                                            given%previous, given%history)
      end function is_its_end

   end subroutine try_vertex

   !> Gap of a point before an edge, and how far its foot lies from the start of the edge.
   pure subroutine place_on_edge(p, start, t, gap, s)
      real(wp), intent(in) :: p(2), start(2)
      real(wp), intent(in) :: t(2)              !! unit vector along the edge
      real(wp), intent(out) :: gap, s           !! [length]; gap < 0 inside the block of the edge
      real(wp) :: r(2)
      r = p - start
      gap = r(1)*t(2) - r(2)*t(1)
      s = r(1)*t(1) + r(2)*t(2)
   end subroutine place_on_edge

   !> Is a point out of reach of an edge, or its foot beyond one of the ends?
   pure logical function is_off_edge(gap, s, length, limits)
      real(wp), intent(in) :: gap, s            !! by `place_on_edge`
      real(wp), intent(in) :: length            !! of the edge
      type(search_limits_type), intent(in) :: limits
      is_off_edge = gap > limits%reach .or. gap < -limits%penetration .or. &
                    s < -limits%zone .or. s > length + limits%zone
   end function is_off_edge

   !> Do both points lie beyond the same side of a box that is widened by the reach? The points are the ends of an edge,
   !> or twice the same vertex.
   pure logical function is_beyond(p, q, box, reach)
      real(wp), intent(in) :: p(2), q(2)
      real(wp), intent(in) :: box(4), reach                !! xmin ymin xmax ymax [length]
      is_beyond = max(p(1), q(1)) < box(1) - reach .or. max(p(2), q(2)) < box(2) - reach .or. &
                  min(p(1), q(1)) > box(3) + reach .or. min(p(2), q(2)) > box(4) + reach
   end function is_beyond

   !> Append the candidate of a vertex with an edge within its reach, unless the vertex was paired with an end of the
   !> edge as a corner.
   !>
   !>                 v          gap > 0: v lies outside. Its foot is at the distance s from `first`; it counts
   !>                 |  gap     between the ends, and a little beyond an end whose corner is concave.
   !>     last -------+--------- first
   !>         |       e |<- s ->|    gap < 0: of this edge and its neighbours at convex corners the one with the
   !>         |     block       |    larger gap decides, and v must have come in through e.
   !>
   !> Arrays and their size are arguments of their own for speed: this is the innermost procedure of the search.
   pure subroutine try_edge(v, e, gap, s, into, outof, side, nv, vertices, tangent, lengths, given, list)
      integer, intent(in) :: v, e, nv
      real(wp), intent(in) :: gap   !! of the vertex [length]
      real(wp), intent(in) :: s     !! how far its foot lies from the start of the edge [length]
      real(wp), intent(in) :: into(2), outof(2)   !! unit vectors along the edges that reach and leave v
      integer, intent(in) :: side   !! 1: v is on the first block of the pair; 2: on the second
      real(wp), intent(in) :: vertices(2, nv)
      real(wp), intent(in) :: tangent(2, nv), lengths(nv)   !! of `outlines`
      type(search_input_type), intent(in) :: given
      type(candidate_list_type), intent(inout) :: list
      real(wp) :: t(2), n(2), r(2), length, zone, gap_there, s_there
      integer :: first, last, neighbour, k
      logical :: concave_first, concave_last

      length = lengths(e)
      first = given%topology%owner(e)
      last = given%topology%next(e)
      if (list%n_corners > 0) then
         zone = min(given%limits%zone, 0.25_wp*length)
         if (given%limits%by_length) zone = length
         if (s <= zone) then
            if (are_paired(v, first, side, list%n_corners, list%corner_pairs)) return
         end if
         if (length - s <= zone) then
            if (are_paired(v, last, side, list%n_corners, list%corner_pairs)) return
         end if
      end if
      concave_first = given%outlines%concave(first)
      concave_last = given%outlines%concave(last)
      if (s < 0 .and. .not. concave_first) return
      if (s > length .and. .not. concave_last) return
      t = tangent(:, e)
      n = [t(2), -t(1)]
      ! `is_outside`, in place
      if (.not. (outof(1)*n(1) + outof(2)*n(2) >= -given%limits%sine .and. &
                 -(into(1)*n(1) + into(2)*n(2)) >= -given%limits%sine)) return
      if (gap < 0) then
         ! at a convex corner the line with the larger gap decides
         do k = 1, 2
            if (merge(concave_first, concave_last, k == 1)) cycle
            neighbour = merge(given%topology%edge_in(first), given%topology%edge_out(last), k == 1)
            r = vertices(:, v) - vertices(:, neighbour)
            t = tangent(:, neighbour)
            gap_there = r(1)*t(2) - r(2)*t(1)
            if (gap_there <= gap .or. gap_there > given%limits%reach) cycle
            ! a corner that touches the end of that edge may lie beyond it by an overlap
            s_there = r(1)*t(1) + r(2)*t(2)
            if (s_there < -given%limits%zone .or. s_there > lengths(neighbour) + given%limits%zone) cycle
            if (is_outside(into, outof, outward(t), given%limits%sine)) return
         end do
         if (.not. is_entered(v, e, gap, s, given, was_closed(v, e, given))) return
      end if
      call list%append(candidate_type(v, e))
   end subroutine try_edge

   !> Was the contact of a vertex with an edge closed at the end of the last step?
   pure logical function was_closed(v, e, given)
      integer, intent(in) :: v, e
      type(search_input_type), intent(in) :: given
      integer :: row
      row = given%history%find(given%previous, v, e)
      was_closed = row > 0
      if (was_closed) was_closed = given%previous%state(row) /= contact_state%open
   end function was_closed

   !> Was this vertex already paired with that corner of the other block?
   pure logical function are_paired(v, corner, side, n, pairs)
      integer, intent(in) :: v, corner
      integer, intent(in) :: side      !! 1: v is on the first block of the pair; 2: on the second
      integer, intent(in) :: n
      integer, intent(in) :: pairs(2, n)
      integer :: k
      are_paired = .true.
      do k = 1, n
         if (pairs(side, k) == v .and. pairs(3 - side, k) == corner) return
      end do
      are_paired = .false.
   end function are_paired

   !> Has vertex v entered the block of edge e through e?
   pure logical function is_entered(v, e, gap, s, given, was_closed)
      integer, intent(in) :: v, e
      real(wp), intent(in) :: gap          !! of the vertex, < 0 [length]
      real(wp), intent(in) :: s            !! distance of its foot from the start of the edge [length]
      type(search_input_type), intent(in) :: given
      logical, intent(in) :: was_closed    !! the contact was closed at the end of the last step
      real(wp) :: point(2), r(2), t(2), in_v(2), out_v(2), gap_k, foot, length
      integer :: k, last
      is_entered = .false.
      length = given%outlines%length(e)
      if (gap < -shallow*length) then
         t = given%outlines%tangent(:, e)
         point = given%vertices(:, v) + inwards*((0.5_wp*length - s)*t - length*outward(t))
         if (.not. is_inside(point, e, given%vertices, given%topology)) return
      end if
      is_entered = .true.
      if (was_closed) return
      is_entered = .false.
      if (gap < -given%topology%inradius(given%topology%block(e))) return
      in_v = given%outlines%tangent(:, given%topology%edge_in(v))
      out_v = given%outlines%tangent(:, given%topology%edge_out(v))
      last = given%topology%next(e)
      k = last
      do while (k /= e)
         r = given%vertices(:, v) - given%vertices(:, k)
         if (k /= last) then
            if (r(1)**2 + r(2)**2 < (at_corner*gap)**2) return
         end if
         if (given%topology%is_edge(k)) then
            t = given%outlines%tangent(:, k)
            gap_k = r(1)*t(2) - r(2)*t(1)
            foot = r(1)*t(1) + r(2)*t(2)
            if (abs(gap_k) < -gap .and. foot >= 0 .and. foot <= given%outlines%length(k)) then
               if (is_outside(in_v, out_v, outward(t), given%limits%sine)) return
            end if
         end if
         k = given%topology%next(k)
      end do
      is_entered = .true.
   end function is_entered

   !> Does a point lie in the block that owns edge e?
   pure logical function is_inside(point, e, vertices, topology)
      real(wp), intent(in), contiguous :: vertices(:, :)   !! (2, nv)
      real(wp), intent(in) :: point(2)
      integer, intent(in) :: e
      type(contact_topology_type), intent(in) :: topology
      integer :: block
      block = topology%block(e)
      is_inside = point_in_polygon(point, vertices(:, topology%first(block):topology%first(block + 1) - 1))
   end function is_inside

end module rockdda_contact_vertex_search
