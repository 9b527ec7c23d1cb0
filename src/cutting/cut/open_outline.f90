! SPDX-License-Identifier: MIT
!> The lines meant as the outer boundary of a model (the first n_boundary): whether they close.
!>
!> A boundary line that bounds blocks along all its length is right, however they are closed. Of the others those are at
!> fault that bound no block at all, and those that belong to no closed loop of boundary lines: there the outline has a
!> gap. What is left are lines of closed loops that go on beyond the corner where they meet, which harms nothing, unless
!> two of them end outside all blocks, far from the corners and close to each other, and go on from corners of the
!> outside: walls and joints that cross the outline leave it where it runs to both sides. Where no line is counted as
!> one of the boundary this is asked of those drawn end to end with another one.
module rockdda_cutting_open_outline
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : diagnostics_type
   use rockdda_base_error, only : error_type
   use rockdda_base_sorting, only : sorted_order
   use rockdda_base_strings, only : to_string
   use rockdda_geometry_segments, only : distance_to_segment, nearest_parameter, segment_point
   use rockdda_model_geometry_input, only : geometry_input_type
   use rockdda_cutting_faces, only : face_set_type, prune_dead_ends, half_edge_origin, twin
   use rockdda_cutting_graph, only : graph_type, pieces_type
   use rockdda_cutting_net, only : make_net
   use rockdda_cutting_overlaps, only : visible_lines_type
   implicit none
   private
   public :: check_outline

   !> Words of the way out.
   character(len=*), parameter :: way_out = '--allow-open runs all the same (&run allow_open)'

   !> Two free ends face each other when they are closer than this share of what hangs free of their lines, and a third
   !> one is further off by this factor.
   real(wp), parameter :: close_by = 0.25_wp, further = 2.0_wp

   !> The net of the boundary lines alone.
   type :: outline_net_type
      logical, allocatable :: closes(:)      !! (lines) part of the line is in a closed loop
      integer, allocatable :: chain(:)       !! (lines) connected lines have one number
      integer :: n_ends = 0                  !! free ends
      integer, allocatable :: end_line(:)    !! (n_ends)
      real(wp), allocatable :: place(:, :)   !! (2, n_ends) [L]
      real(wp), allocatable :: tail(:)       !! (n_ends) what hangs free of the line there [L]
   end type outline_net_type

contains

   !> Report gaps, and boundary lines that bound no block.
   subroutine check_outline(geometry, graph, faces, kept, lost, skip, e0, level, at_fault, messages, error)
      type(geometry_input_type), intent(in) :: geometry
      type(graph_type), intent(in) :: graph    !! of all lines, without dead ends
      type(face_set_type), intent(in) :: faces !! of the graph
      logical, intent(in) :: kept(:)           !! (lines) bounds a block
      logical, intent(in) :: lost(:)           !! (lines) has a part that bounds none
      logical, intent(in) :: skip(:)           !! (lines) shorter than e0
      real(wp), intent(in) :: e0               !! [L]
      integer, intent(in) :: level             !! of the messages, one of severity%...
      logical, intent(out) :: at_fault(:)      !! (lines) there is a message about the line or its chain
      type(diagnostics_type), intent(inout) :: messages
      type(error_type), allocatable, intent(out) :: error
      type(outline_net_type) :: net
      logical, allocatable :: told(:), no_part(:)
      integer :: n, i
      at_fault = .false.
      n = min(geometry%n_boundary, size(skip))
      if (n == 0) n = size(skip)
      allocate (no_part(n), source=skip(1:n))
      if (geometry%n_boundary == 0) no_part(:) = skip .or. .not. drawn_on(geometry%lines)
      if (all((kept(1:n) .and. .not. lost(1:n)) .or. no_part)) return
      call trace_boundary(geometry%lines(:, 1:n), no_part, net, error)
      if (allocated(error)) return
      if (geometry%n_boundary > 0) &
         at_fault(1:n) = .not. skip(1:n) .and. (.not. kept(1:n) .or. (lost(1:n) .and. .not. net%closes))
      call find_facing_ends(geometry%lines(:, 1:n), lost(1:n), at_fault(1:n))
      if (.not. any(at_fault)) return
      allocate (told(n), source=.false.)
      call report_gaps(at_fault(1:n))
      do i = 1, n
         if (at_fault(i) .and. .not. told(net%chain(i))) call messages%add(level, 'line '//to_string(i)// &
            ' of the boundary, from '//at(geometry%lines(1:2, i))//' to '//at(geometry%lines(3:4, i))// &
            ', bounds no block: delete it, or draw it as a joint; '//way_out, geometry%line_origin(i))
      end do

   contains

      !> A message for each gap: the free end of a line at fault, and the nearest free end of another line, or the
      !> nearest line if that is less than half as far.
      subroutine report_gaps(at_fault)
         logical, intent(in) :: at_fault(:)        !! (boundary lines)
         logical :: is_left(net%n_ends)
         real(wp) :: distance, nearest, foot(2)
         character(len=:), allocatable :: other
         integer :: i, k, best(2), line
         is_left = .true.
         other = ''
         do
            nearest = huge(nearest)
            best = 0
            do i = 1, net%n_ends
               if (.not. is_left(i) .or. .not. at_fault(net%end_line(i))) cycle
               do k = 1, net%n_ends
                  if (.not. is_left(k) .or. net%end_line(k) == net%end_line(i)) cycle
                  distance = norm2(net%place(:, k) - net%place(:, i))
                  if (.not. distance < nearest) cycle
                  nearest = distance
                  best = [i, k]
               end do
            end do
            if (best(1) == 0) return
            is_left(best) = .false.
            i = best(1)
            call find_nearest_line(geometry%lines(:, 1:size(at_fault)), i, line, foot)
            other = 'line '//to_string(net%end_line(best(2)))//' at '//at(net%place(:, best(2)))
            told(net%chain(net%end_line(best))) = .true.
            if (line > 0) then
               distance = norm2(foot - net%place(:, i))
               if (2*distance < nearest) then
                  other = 'passes line '//to_string(line)//' at '//at(foot)
                  nearest = distance
                  is_left(best(2)) = .true.
               end if
            end if
            call messages%add(level, 'the outline does not close: line '//to_string(net%end_line(i))//' ends at '// &
                              at(net%place(:, i))//' and '//other//', '//to_string(nearest, 3)//' apart: let both '// &
                              'end at one point, or draw the boundary line between them; '//way_out, &
                              geometry%line_origin(net%end_line(i)))
         end do
      end subroutine report_gaps

      !> The boundary line that a free end is nearest to, between its ends: none that meets the line of the end.
      pure subroutine find_nearest_line(lines, i, line, foot)
         real(wp), intent(in) :: lines(:, :)       !! (4, n)
         integer, intent(in) :: i                  !! free end
         integer, intent(out) :: line              !! 0: none
         real(wp), intent(out) :: foot(2)
         real(wp) :: t, distance, nearest
         integer :: k
         line = 0
         foot = 0
         nearest = huge(nearest)
         do k = 1, size(lines, 2)
            if (k == net%end_line(i) .or. meet(lines(:, k), lines(:, net%end_line(i)))) cycle
            t = nearest_parameter(net%place(:, i), lines(1:2, k), lines(3:4, k))
            if (.not. (t > 0 .and. t < 1)) cycle
            distance = norm2(segment_point(lines(1:2, k), lines(3:4, k), t) - net%place(:, i))
            if (.not. distance < nearest) cycle
            nearest = distance
            line = k
            foot = segment_point(lines(1:2, k), lines(3:4, k), t)
         end do
      end subroutine find_nearest_line

      !> Lines at fault that end outside all blocks and face each other.
      pure subroutine find_facing_ends(lines, lost, at_fault)
         real(wp), intent(in) :: lines(:, :)        !! (4, n)
         logical, intent(in) :: lost(:)             !! (lines)
         logical, intent(inout) :: at_fault(:)      !! (lines)
         integer :: nearest(net%n_ends), i, k
         real(wp) :: first(net%n_ends), second(net%n_ends), distance
         first = huge(first)
         second = first
         nearest = 0
         do i = 1, net%n_ends
            if (.not. lost(net%end_line(i))) cycle
            do k = 1, net%n_ends
               if (net%end_line(k) == net%end_line(i)) cycle
               distance = norm2(net%place(:, k) - net%place(:, i))
               if (distance < first(i)) then
                  second(i) = first(i)
                  first(i) = distance
                  nearest(i) = k
               else
                  second(i) = min(second(i), distance)
               end if
            end do
         end do
         do i = 1, net%n_ends
            k = nearest(i)
            if (k < i) cycle
            if (nearest(k) /= i .or. min(second(i), second(k)) < further*first(i)) cycle
            if (first(i) > close_by*min(net%tail(i), net%tail(k))) cycle
            if (.not. is_outside(0.5_wp*(net%place(:, i) + net%place(:, k)))) cycle
            if (.not. (leaves_corner(lines, net%end_line([i, k]), net%place(:, i)) .and. &
                       leaves_corner(lines, net%end_line([k, i]), net%place(:, k)))) cycle
            at_fault(net%end_line([i, k])) = .true.
         end do
      end subroutine find_facing_ends

      !> Cut the boundary lines alone.
      subroutine trace_boundary(lines, skip, net, error)
         real(wp), intent(in) :: lines(:, :)      !! (4, n)
         logical, intent(in) :: skip(:)           !! (n)
         type(outline_net_type), intent(out) :: net
         type(error_type), allocatable, intent(out) :: error
         type(visible_lines_type) :: visible
         type(pieces_type) :: pieces
         type(graph_type) :: graph
         integer, allocatable :: degree(:), line_at(:)
         logical, allocatable :: is_closed(:)         !! (parts of lines)
         integer :: n, k, e, i, rounds
         n = size(skip)
         call make_net(lines, skip, e0, visible, pieces, graph, rounds, error)
         if (allocated(error)) return
         allocate (degree(graph%n_nodes), line_at(graph%n_nodes), source=0)
         do e = 1, graph%n_edges
            degree(graph%ends(:, e)) = degree(graph%ends(:, e)) + 1
         end do
         do k = 1, pieces%n
            line_at(pieces%ends(:, k)) = pieces%line(k)
         end do
         net%n_ends = count(degree == 1)
         net%end_line = pack(line_at, degree == 1)
         allocate (net%place(2, net%n_ends))
         do i = 1, 2
            net%place(i, :) = pack(graph%position(i, :), degree == 1)
         end do
         call number_chains(pieces, graph%n_nodes, n, net%chain)
         call prune_dead_ends(graph)
         allocate (net%tail(net%n_ends))
         do i = 1, net%n_ends
            net%tail(i) = norm2(lines(3:4, net%end_line(i)) - lines(1:2, net%end_line(i)))
            do k = 1, pieces%n
               if (pieces%line(k) /= net%end_line(i) .or. .not. graph%alive(graph%piece_edge(k))) cycle
               do e = 1, 2
                  net%tail(i) = min(net%tail(i), norm2(graph%position(:, pieces%ends(e, k)) - net%place(:, i)))
               end do
            end do
         end do
         allocate (net%closes(n), is_closed(visible%n), source=.false.)
         do k = 1, pieces%n
            if (graph%alive(graph%piece_edge(k))) is_closed(visible%part(k)) = .true.
         end do
         do i = 1, n
            net%closes(i) = any(is_closed(visible%along(visible%from(i):visible%to(i))))
         end do
      end subroutine trace_boundary

      !> Do the lines drawn end to end from a free end leave the blocks at a corner, a node of no more than two edges,
      !> or lead to the other free end without a block?
      pure logical function leaves_corner(lines, pair, place)
         real(wp), intent(in) :: lines(:, :)        !! (4, n)
         integer, intent(in) :: pair(2)             !! lines of the free end and of the other one
         real(wp), intent(in) :: place(2)           !! of the free end
         real(wp) :: from(2), distance, nearest, p(2), q(2)
         integer :: at, step, e, k, node
         leaves_corner = .false.
         from = place
         at = pair(1)
         do step = 1, size(lines, 2)
            nearest = huge(nearest)
            node = 0
            p = lines(1:2, at)
            q = lines(3:4, at)
            do e = 1, graph%n_edges
               if (.not. graph%alive(e)) cycle
               if (distance_to_segment(graph%position(:, graph%ends(1, e)), p, q) > e0) cycle
               if (distance_to_segment(graph%position(:, graph%ends(2, e)), p, q) > e0) cycle
               do k = 1, 2
                  distance = norm2(graph%position(:, graph%ends(k, e)) - from)
                  if (.not. distance < nearest) cycle
                  nearest = distance
                  node = graph%ends(k, e)
               end do
            end do
            if (node > 0) then
               leaves_corner = count(graph%alive .and. (graph%ends(1, :) == node .or. graph%ends(2, :) == node)) <= 2
               return
            end if
            leaves_corner = at == pair(2)
            if (leaves_corner) return
            ! nothing of this line bounds a block: the next one begins at its other end
            if (norm2(p - from) > norm2(q - from)) q = p
            from = q
            do k = 1, size(lines, 2)
               if (k /= at .and. (all(abs(lines(1:2, k) - from) <= 0) .or. all(abs(lines(3:4, k) - from) <= 0))) exit
            end do
            if (k > size(lines, 2)) return
            at = k
         end do
      end function leaves_corner

      !> Is a point outside all blocks: does a line from it to the right meet the contour of each connected group of
      !> lines an even number of times?
      pure logical function is_outside(point)
         real(wp), intent(in) :: point(2)
         logical :: within(faces%n_cycles)
         integer :: h
         real(wp) :: p(2), q(2)
         within = .false.
         do h = 1, 2*graph%n_edges
            if (faces%cycle(h) == 0) cycle
            p = graph%position(:, half_edge_origin(graph, h)) - point
            q = graph%position(:, half_edge_origin(graph, twin(h))) - point
            if ((p(2) > 0) .eqv. (q(2) > 0)) cycle
            if (p(1) - p(2)*(q(1) - p(1))/(q(2) - p(2)) > 0) within(faces%cycle(h)) = .not. within(faces%cycle(h))
         end do
         is_outside = .not. any(within .and. faces%area < 0)
      end function is_outside

      !> Number connected lines alike: by the smallest of them.
      pure subroutine number_chains(pieces, n_nodes, n_lines, chain)
         type(pieces_type), intent(in) :: pieces
         integer, intent(in) :: n_nodes, n_lines
         integer, allocatable, intent(out) :: chain(:)      !! (n_lines)
         integer :: at_node(n_nodes), k, least
         logical :: changed
         allocate (chain(n_lines))
         chain = [(k, k=1, n_lines)]
         at_node = n_lines
         changed = .true.
         do while (changed)
            changed = .false.
            do k = 1, pieces%n
               least = min(chain(pieces%line(k)), at_node(pieces%ends(1, k)), at_node(pieces%ends(2, k)))
               if (chain(pieces%line(k)) == least .and. all(at_node(pieces%ends(:, k)) == least)) cycle
               chain(pieces%line(k)) = least
               at_node(pieces%ends(:, k)) = least
               changed = .true.
            end do
         end do
      end subroutine number_chains

   end subroutine check_outline

   !> Is an end of a line also one of another line?
   pure function drawn_on(lines)
      real(wp), intent(in) :: lines(:, :)      !! (4, n)
      logical :: drawn_on(size(lines, 2))
      real(wp) :: ends(2, 2*size(lines, 2))
      integer :: second(2*size(lines, 2)), order(2*size(lines, 2)), i, n
      n = size(lines, 2)
      ends = reshape(lines, [2, 2*n])
      ! stable sorting twice: equal ends follow each other
      second = sorted_order(ends(2, :))
      order = second(sorted_order(ends(1, second)))
      drawn_on = .false.
      do i = 2, 2*n
         if (any(abs(ends(:, order(i)) - ends(:, order(i - 1))) > 0)) cycle
         drawn_on((order([i - 1, i]) + 1)/2) = .true.
      end do
   end function drawn_on

   !> Do two lines have an end in common?
   pure logical function meet(a, b)
      real(wp), intent(in) :: a(4), b(4)
      meet = all(abs(a(1:2) - b(1:2)) <= 0) .or. all(abs(a(1:2) - b(3:4)) <= 0) .or. &
             all(abs(a(3:4) - b(1:2)) <= 0) .or. all(abs(a(3:4) - b(3:4)) <= 0)
   end function meet

   !> A place as text.
   pure function at(place) result(text)
      real(wp), intent(in) :: place(2)
      character(len=:), allocatable :: text
      text = '('//to_string(place(1))//', '//to_string(place(2))//')'
   end function at

end module rockdda_cutting_open_outline
