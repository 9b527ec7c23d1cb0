! SPDX-License-Identifier: MIT
!> Messages about input lines: those that bound no block, that lie on another line, and an outline that does not close.
module rockdda_cutting_line_report
   use rockdda_base_kinds, only : wp, pi
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_base_error, only : error_type
   use rockdda_base_strings, only : to_string
   use rockdda_geometry_segments, only : cross_product, distance_to_segment
   use rockdda_model_geometry_input, only : geometry_input_type
   use rockdda_cutting_faces, only : face_set_type
   use rockdda_cutting_graph, only : graph_type, pieces_type
   use rockdda_cutting_open_outline, only : check_outline
   use rockdda_cutting_overlaps, only : visible_lines_type
   implicit none
   private
   public :: moves_type, report_lines, find_moves, report_moves

   !> What merging with the edge-node distance has done to the lines.
   type :: moves_type
      real(wp), allocatable :: distance(:)     !! (lines) from the line to the farthest of its nodes
      real(wp), allocatable :: place(:, :)     !! (2, lines) that node
      integer, allocatable :: other(:)         !! (lines) a line that shares edges with it; 0: none
      logical, allocatable :: alone(:)         !! (lines) has it edges that it does not share?
   end type moves_type

contains

   !> Report the lines that bound no block, and an outline that does not close; count those that lost an end.
   subroutine report_lines(geometry, skip, e0, visible, graph, faces, n_dropped, n_shortened, messages, found, error)
      type(geometry_input_type), intent(in) :: geometry
      logical, intent(in) :: skip(:)
      real(wp), intent(in) :: e0
      type(visible_lines_type), intent(in) :: visible
      type(graph_type), intent(in) :: graph
      type(face_set_type), intent(in) :: faces
      integer, intent(out) :: n_dropped                          !! lines that bound no block
      integer, intent(out) :: n_shortened                        !! lines that lost an end
      type(diagnostics_type), intent(inout) :: messages          !! warnings
      type(diagnostics_type), intent(inout) :: found             !! errors
      type(error_type), allocatable, intent(out) :: error
      logical, dimension(size(skip)) :: met, kept, lost, at_fault
      integer, dimension(size(skip)) :: told
      integer, dimension(0:visible%n) :: alive, dead   !! pieces of the parts along overlapping lines, running sums
      integer :: first(visible%n + 1), i, j, k, summary
      integer, allocatable :: edges(:), next(:)        !! along overlapping lines; the next one that is on another line
      character(len=:), allocatable :: name
      ! those that overlap others meet them
      met = visible%to > visible%from .or. visible%line(visible%along(visible%from)) /= [(i, i=1, size(skip))]
      do k = 1, visible%meetings%n
         if (visible%meetings%lines(2, k) == 0) cycle
         met(visible%line(visible%meetings%lines(:, k))) = .true.
      end do
      first = 1
      do k = 1, size(visible%part)
         first(visible%part(k) + 1) = first(visible%part(k) + 1) + 1
      end do
      do i = 2, visible%n + 1
         first(i) = first(i - 1) + first(i) - 1
      end do
      alive = 0
      dead = 0
      do k = 1, visible%n
         j = visible%along(k)
         associate (e => graph%piece_edge(first(j):first(j + 1) - 1))
            alive(k) = alive(k - 1) + count(graph%alive(e))
            dead(k) = dead(k - 1) + count(.not. graph%alive(e))
         end associate
      end do
      kept = alive(visible%to) > alive(visible%from - 1)
      lost = dead(visible%to) > dead(visible%from - 1)
      allocate (edges(alive(visible%n)), next(alive(visible%n)))
      do k = 1, visible%n
         j = visible%along(k)
         associate (e => graph%piece_edge(first(j):first(j + 1) - 1))
            edges(alive(k - 1) + 1:alive(k)) = pack(e, graph%alive(e))
         end associate
      end do
      do k = size(edges), 1, -1
         next(k) = k + 1
         if (k == size(edges)) cycle
         if (graph%line(edges(k + 1)) == graph%line(edges(k))) next(k) = next(k + 1)
      end do
      told = 0
      do i = 1, size(skip)
         k = alive(visible%from(i) - 1) + 1
         do while (k <= alive(visible%to(i)))
            call tell_other(i, edges(k))
            k = next(k)
         end do
      end do
      n_dropped = count(.not. kept)
      n_shortened = count(kept .and. lost)
      if (geometry%allow_open) then
         call check_outline(geometry, graph, faces, kept, lost, skip, e0, severity%warning, at_fault, messages, error)
      else
         call check_outline(geometry, graph, faces, kept, lost, skip, e0, severity%error, at_fault, found, error)
      end if
      if (allocated(error)) return
      ! these have a message
      kept = kept .or. at_fault
      summary = 0
      if (count(.not. (kept .or. skip)) > 1) call summarise_lines(geometry, kept .or. skip, met, messages, summary)
      do i = 1, size(skip)
         if (kept(i)) cycle
         ! the reader has warned of a line without length
         if (all(abs(geometry%lines(1:2, i) - geometry%lines(3:4, i)) <= 0)) cycle
         name = 'line '//to_string(i)//' from ('//to_string(geometry%lines(1, i))//', '// &
                to_string(geometry%lines(2, i))//') to ('//to_string(geometry%lines(3, i))//', '// &
                to_string(geometry%lines(4, i))//') '
         if (skip(i)) then
            name = name//'is shorter than the edge-node distance: dropped'
         else if (.not. met(i)) then
            name = name//'meets no other line: dropped'
         else
            name = name//'bounds no block: dropped'
         end if
         call messages%add(severity%warning, name, geometry%line_origin(i), merge(0, summary, skip(i)))
      end do

   contains

      !> Report another line on an edge of line i, of another joint material.
      subroutine tell_other(i, e)
         integer, intent(in) :: i, e
         if (graph%line(e) == i .or. graph%line(e) == told(i)) return
         if (geometry%line_joint(graph%line(e)) == geometry%line_joint(i)) return
         told(i) = graph%line(e)
         call messages%add(severity%warning, meeting_of(geometry%lines, i, told(i), e0, &
                                                        graph%position(:, graph%ends(1, e)))// &
                           ': the joint material of line '//to_string(told(i))//' holds there', &
                           geometry%line_origin(i))
      end subroutine tell_other

   end subroutine report_lines

   !> Find how far the nodes of edges that bound blocks have left their lines.
   pure subroutine find_moves(lines, pieces, graph, moves)
      real(wp), intent(in) :: lines(:, :)      !! (4, n)
      type(pieces_type), intent(in) :: pieces  !! nodes by their numbers in the graph
      type(graph_type), intent(in) :: graph
      type(moves_type), intent(out) :: moves
      real(wp) :: d
      integer :: k, j, i, e, n_lines(graph%n_edges)
      n_lines = 0
      do k = 1, pieces%n
         e = graph%piece_edge(k)
         n_lines(e) = n_lines(e) + 1
      end do
      allocate (moves%alone(size(lines, 2)), source=.false.)
      allocate (moves%distance(size(lines, 2)), moves%place(2, size(lines, 2)), source=0.0_wp)
      allocate (moves%other(size(lines, 2)), source=0)
      do k = 1, pieces%n
         e = graph%piece_edge(k)
         if (.not. graph%alive(e)) cycle
         i = pieces%line(k)
         if (n_lines(e) == 1) moves%alone(i) = .true.
         if (graph%line(e) /= i) then
            moves%other(i) = graph%line(e)
            moves%other(graph%line(e)) = i
         end if
         do j = 1, 2
            associate (node => graph%position(:, pieces%ends(j, k)))
               d = distance_to_segment(node, lines(1:2, i), lines(3:4, i))
               if (.not. d > moves%distance(i)) cycle
               moves%distance(i) = d
               moves%place(:, i) = node
            end associate
         end do
      end do
   end subroutine find_moves

   !> Warn of lines that merging has moved by more than a share of the size of a block, or made one of two with more
   !> than that share of its area between them.
   subroutine report_moves(geometry, moves, e0, block_size, messages)
      type(geometry_input_type), intent(in) :: geometry
      type(moves_type), intent(in) :: moves
      real(wp), intent(in) :: e0
      real(wp), intent(in) :: block_size       !! side of a square of the mean area
      type(diagnostics_type), intent(inout) :: messages
      real(wp), parameter :: largest_share = 0.05_wp
      character(len=:), allocatable :: text, tail
      logical :: told(size(moves%distance)), lost(size(moves%distance))
      integer :: i, n, worst, summary
      ! what lay between two lines
      lost = moves%other > 0 .and. .not. moves%alone .and. moves%distance* &
             norm2(geometry%lines(3:4, :) - geometry%lines(1:2, :), 1) > largest_share*block_size**2
      told = lost .or. moves%distance > largest_share*block_size
      n = count(told)
      if (n == 0) return
      ! first of all a joint that is lost
      worst = maxloc(moves%distance, 1, merge(lost, told, any(lost)))
      tail = ', '//to_string(100*moves%distance(worst)/block_size, 2)//' % of the size of a block: the edge-node '// &
             'distance '//to_string(e0)//' merges what is closer; a smaller one keeps lines apart'
      summary = 0
      if (n > 1) call messages%add_summary(severity%warning, n, moved(worst)//tail//' ('// &
                                           to_string(n)//' lines are moved)', geometry%line_origin(worst), &
                                           summary)
      do i = 1, size(moves%distance)
         if (.not. told(i)) cycle
         text = moved(i)
         if (n == 1) text = text//tail
         call messages%add(severity%warning, text, geometry%line_origin(i), summary)
      end do

   contains

      !> "line 3 is moved by 0.5 near (10, 5)", and which line it has become one with.
      function moved(i) result(text)
         integer, intent(in) :: i
         character(len=:), allocatable :: text
         text = 'line '//to_string(i)//' is moved by '//to_string(moves%distance(i), 3)//' near ('// &
                to_string(moves%place(1, i), 6)//', '//to_string(moves%place(2, i), 6)//')'
         if (lost(i)) text = text//' and is one with line '//to_string(moves%other(i))
      end function moved

   end subroutine report_moves

   !> "line 3 lies on line 5", or where they cross at so small an angle that they share an edge, or end so close to each
   !> other.
   pure function meeting_of(lines, i, k, e0, place) result(text)
      real(wp), intent(in) :: lines(:, :)      !! (4, n)
      integer, intent(in) :: i, k
      real(wp), intent(in) :: e0, place(2)     !! place: where they share an edge
      character(len=:), allocatable :: text
      real(wp) :: u(2), v(2), sine
      u = lines(3:4, i) - lines(1:2, i)
      v = lines(3:4, k) - lines(1:2, k)
      sine = abs(cross_product(u, v))/(norm2(u)*norm2(v))
      text = 'line '//to_string(i)//' lies on line '//to_string(k)
      ! lines side by side are within e0 all along the shorter of them
      if (sine*min(norm2(u), norm2(v)) <= 2*e0) return
      if (sine > 0.5_wp) then
         text = 'line '//to_string(i)//' and line '//to_string(k)//' share an edge near ('//to_string(place(1), 6)// &
                ', '//to_string(place(2), 6)//'), where nodes are closer than the edge-node distance '//to_string(e0)
         return
      end if
      text = 'line '//to_string(i)//' crosses line '//to_string(k)//' near ('//to_string(place(1), 6)//', '// &
             to_string(place(2), 6)//') at an angle of '//to_string(asin(min(1.0_wp, sine))*180/pi, 2)// &
             ' degrees, closer than the edge-node distance over '//to_string(e0/sine, 2)
   end function meeting_of

   !> One warning for all lines that bound no block: random networks have dozens of them.
   subroutine summarise_lines(geometry, is_other, met, messages, summary)
      type(geometry_input_type), intent(in) :: geometry
      logical, intent(in) :: is_other(:)       !! not one of these lines
      logical, intent(in) :: met(:)            !! meets another line
      type(diagnostics_type), intent(inout) :: messages
      integer, intent(out) :: summary
      integer, parameter :: most_named = 3
      type(origin_type) :: file
      character(len=:), allocatable :: text
      integer :: i, n, n_alone, named
      n = count(.not. is_other)
      n_alone = count(.not. (is_other .or. met))
      text = to_string(n)//' lines bound no block: dropped'
      if (n_alone > 0) text = text//' ('//to_string(n_alone)//' of them meet no other line)'
      named = 0
      do i = 1, size(is_other)
         if (is_other(i)) cycle
         if (named == most_named) exit
         named = named + 1
         text = text//trim(merge(': ', ', ', named == 1))//' line '//to_string(i)
         associate (origin => geometry%line_origin(i))
            if (.not. allocated(origin%file)) cycle
            file%file = origin%file
            if (origin%line > 0) text = text//' ('//origin%file//':'//to_string(origin%line)//')'
         end associate
      end do
      if (n > most_named) text = text//" and "//to_string(n - most_named)//" more; 'rockdda check' lists all"
      call messages%add_summary(severity%warning, n, text, file, summary)
   end subroutine summarise_lines

end module rockdda_cutting_line_report
