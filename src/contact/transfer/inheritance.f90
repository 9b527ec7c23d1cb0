! SPDX-License-Identifier: MIT
!> What the contacts of a step take over from those of the last one.
!>
!> A contact continues with the row of the same identity. By length a row without one may stand where another
!> stood: an edge that comes down on its corner turns a vertex into the end of an interval, and back; an edge that
!> slides from one block to the next begins a new interval with the pressure of the one it leaves.
!>
!> A row that is found at depth begins with a gap that is free of force, its offset, so that it gives no energy; the
!> offset goes back to zero as the blocks leave each other. The same holds for vertices on edges, but for presets, which
!> keep the ways of the programs that they reproduce: there a row begins with the force of its depth.
module rockdda_contact_inheritance
   use rockdda_base_kinds, only : wp, i1, l1
   use rockdda_base_parallel, only : parallel_contacts, piece
   use rockdda_base_room, only : reserve
   use rockdda_contact_exposure, only : search_input_type
   use rockdda_contact_table, only : contact_table_type, contact_state, is_of_interval, cut_no_interval
   use rockdda_contact_candidates, only : other_rows_type
   use rockdda_contact_corners, only : corner_station
   use rockdda_contact_interval_law, only : n_points, end_gaps, at_end, depth_of_energy
   use rockdda_contact_intervals, only : is_facing
   use rockdda_contact_new_lengths, only : new_lengths_type, free_new_lengths
   use rockdda_contact_search_limits, only : search_limits_type
   use rockdda_contact_normal_law, only : normal_law_type
   implicit none
   private
   public :: hand_on_history, inheritance_work_type

   !> Blocks further apart than this share of the smaller inradius do not touch at the start.
   real(wp), parameter :: touching_share = 1.0e-3_wp

   !> A corner that is found deeper than this times the compression of its spring has not moved there: the blocks turn
   !> by too little in a step.
   real(wp), parameter :: most_deeper = 2.0_wp

   !> Pieces of rows that are copied at once where each row continues itself: the longer a copy, the faster.
   integer, parameter :: copied = 8

   !> Scratch, kept from step to step.
   type :: inheritance_work_type
      integer, allocatable :: source(:)            !! (>= rows) row of the last step that continues
      logical, allocatable :: is_taken(:)          !! (0:>= rows of the last step)
      logical :: same_rows = .false.               !! by length: rows are those of the last step, in the same order
      !> (nv) Row of the last step that is compressed most, of each edge on which a row begins; 0 none, < 0 not sought.
      integer, allocatable :: pressed(:)
      type(new_lengths_type) :: new_lengths
   end type inheritance_work_type

contains

   !> State, shear spring, forces and bond of a contact stay with its identity, or come from its alias: seen from the
   !> other block, gap and slip have the same sign.
   subroutine hand_on_history(given, others, first_step, touch, work, table)
      type(search_input_type), intent(in) :: given
      type(other_rows_type), intent(in) :: others(:)  !! (>= rows) that each row refers to, or none
      logical, intent(in) :: first_step
      real(wp), intent(in) :: touch         !! gap below which two blocks touch at the start [length]
      type(inheritance_work_type), intent(inout) :: work
      type(contact_table_type), intent(inout) :: table
      integer :: first, last, p, rows
      call make_room(work, given%previous%n, table%n, size(given%topology%block))
      if (.not. work%same_rows) then
         call find_sources(given, others, table, work%source, work%is_taken)
         if (given%limits%by_length .or. given%limits%corrected) &
            call find_pressed(given, table, work%source, work%pressed)
      end if
      rows = merge(copied, 1, work%same_rows)*piece
      !$omp parallel do default(none) private(p, first, last) schedule(static) if (table%n > parallel_contacts) &
      !$omp shared(given, first_step, touch, work, table, rows)
      do p = 1, (table%n + rows - 1)/rows
         first = (p - 1)*rows + 1
         last = min(p*rows, table%n)
         call cut_no_interval(table%n, table%station, first, last)
         call begin_rows(first, last, given, first_step, touch, work, table)
      end do
      !$omp end parallel do
      if (allocated(given%limits%weakens)) then
         if (given%limits%by_length .and. any(given%limits%weakens)) &
            call keep_bonds(given%previous, work%source, work%same_rows, given%limits%weakens, table)
      end if
      if (given%limits%by_length .and. .not. work%same_rows) &
         call begin_intervals(given, work%source, work%pressed, table)
      if (given%limits%by_length) call free_new_lengths(given%previous, work%source, work%same_rows, work%is_taken, &
         work%pressed, given%limits, work%new_lengths, table)
      ! rows have partners where vertices meet edges only
      if (size(others) > 0) call part_partners(table)
   end subroutine hand_on_history

   !> Of two partners at most one is closed: the one with the larger gap stays.
   pure subroutine part_partners(table)
      type(contact_table_type), intent(inout) :: table
      integer :: k, row
      do k = 1, table%n
         row = table%partner(k)
         if (row <= k) cycle
         if (table%state(k) == contact_state%open .or. table%state(row) == contact_state%open) cycle
         if (table%distance(k) >= table%distance(row)) then
            call table%open_row(row)
         else
            call table%open_row(k)
         end if
      end do
   end subroutine part_partners

   !> `hand_on_history` for some of the rows, each by itself, with its arguments.
   pure subroutine begin_rows(first, last, given, first_step, touch, work, table)
      integer, intent(in) :: first, last
      type(search_input_type), intent(in) :: given
      logical, intent(in) :: first_step
      real(wp), intent(in) :: touch
      type(inheritance_work_type), intent(in) :: work
      type(contact_table_type), intent(inout) :: table
      integer :: k, row
      logical :: is_own, touches
      if (work%same_rows) call go_on(first, last, given, table)
      do k = merge(last + 1, first, work%same_rows), last
         row = abs(work%source(k))
         is_own = work%source(k) > 0
         if (is_of_interval(table, k) .and. .not. is_own) row = 0
         if (row > 0) then
            call take_over(given%previous, row, k, given%limits%by_length, table)
            table%energy(k) = given%previous%energy(row)
            table%offset(k) = given%previous%offset(row)
            ! gaps of intervals follow those of both rows
            if (is_of_interval(table, k)) cycle
            if (given%limits%by_length .or. given%limits%corrected) then
               call keep_energy(given, row, is_own, k, table)
            else if (table%offset(k) < 0) then
               call follow_gap(table%state(k) /= contact_state%open, table%gap(k), table%offset(k))
            end if
         else
            call table%open_row(k)
            table%offset(k) = 0
            touches = first_step .and. abs(table%gap(k)) <= near_gap(table, k, given, touch)
            table%bonded(k) = touches .and. table%length(k) > 0
            if (first_step) table%tied(k) = table%tied(k) .and. table%bonded(k)
            table%bond_end(k) = merge(1, 0, table%bonded(k) .and. table%station(k) == n_points)
            ! what touches at the start is in contact; the first solve shows what stays so
            if (touches .and. table%partner(k) == 0) table%state(k) = contact_state%locked
            if ((given%limits%by_length .or. given%limits%corrected) .and. .not. is_of_interval(table, k)) &
               call begin_row(given, work%pressed, facing_edge(table, k, given), k, table)
         end if
         table%distance(k) = table%gap(k)
         table%gap(k) = table%gap(k) - table%offset(k)
      end do
      if (.not. work%same_rows) call follow_intervals(first, last, table%n, table%station, work%source, table%state, &
         table%tied, table%bonded, table%total_slip, given%previous%length, table%gap, table%offset, table%length, &
         table%distance)
   end subroutine begin_rows

   !> `begin_rows` where each row continues itself, by length: whole runs of rows are copied.
   pure subroutine go_on(first, last, given, table)
      integer, intent(in) :: first, last
      type(search_input_type), intent(in) :: given
      type(contact_table_type), intent(inout) :: table
      integer :: k
      table%state(first:last) = given%previous%state(first:last)
      table%shear(first:last) = given%previous%shear(first:last)
      table%normal_force(first:last) = given%previous%normal_force(first:last)
      table%bonded(first:last) = given%previous%bonded(first:last)
      table%tied(first:last) = given%previous%tied(first:last)
      table%k_n(first:last) = given%previous%k_n(first:last)
      table%k_s(first:last) = given%previous%k_s(first:last)
      table%slip_sign(first:last) = given%previous%slip_sign(first:last)
      table%total_slip(first:last) = given%previous%total_slip(first:last)
      table%energy(first:last) = given%previous%energy(first:last)
      table%offset(first:last) = given%previous%offset(first:last)
      table%bond_end(first:last) = given%previous%bond_end(first:last)
      table%closed(first:last) = given%previous%closed(first:last)
      table%core(:, first:last) = given%previous%core(:, first:last)
      call follow_intervals(first, last, table%n, table%station, state=table%state, tied=table%tied, &
                            bonded=table%bonded, total_slip=table%total_slip, length_before=given%previous%length, &
                            gap=table%gap, offset=table%offset, length=table%length, distance=table%distance)
      do k = first, last
         if (is_of_interval(table, k)) cycle
         call keep_energy(given, k, .true., k, table)
         table%distance(k) = table%gap(k)
         table%gap(k) = table%gap(k) - table%offset(k)
      end do
   end subroutine go_on

   !> `keep_energy` for intervals that go on with themselves, and their gaps. Many arguments: arrays of constant shape
   !> spare the place of each number.
   pure subroutine follow_intervals(first, last, n, station, source, state, tied, bonded, total_slip, length_before, &
                                    gap, offset, length, distance)
      integer, intent(in) :: first, last, n   !! no interval is cut
      integer(i1), intent(in) :: station(n), state(n)
      integer, intent(in), optional :: source(n)   !! row of the last step that continues; absent: each with itself
      logical(l1), intent(in) :: tied(n), bonded(n)
      real(wp), intent(in) :: total_slip(n)
      real(wp), intent(in) :: length_before(*)     !! of the last step
      real(wp), intent(inout) :: gap(n), offset(n), length(n), distance(n)
      real(wp) :: lowest
      integer :: i, k, row
      do k = first, last - 1
         if (station(k) /= 1) cycle
         if (present(source)) then
            if (source(k) <= 0) cycle
         end if
         do i = k, k + 1
            row = i
            if (present(source)) row = source(i)
            ! what comes to face each other later is not bonded: the bond keeps its own length until it slips
            if (tied(i)) then
               length(i) = length_before(row)
            else if (bonded(i) .and. .not. total_slip(i) > 0) then
               length(i) = min(length(i), length_before(row))
            end if
            distance(i) = gap(i)
         end do
         if (state(k) == contact_state%open) then
            ! it closes without force
            lowest = minval(end_gaps(distance(k:k + 1)))
            offset(k:k + 1) = min(max(0.0_wp, offset(k:k + 1)), lowest)
         end if
         gap(k:k + 1) = distance(k:k + 1) - offset(k:k + 1)
      end do
   end subroutine follow_intervals

   !> What comes to face each other later is not bonded once a bond slips, either: its sound part stays in the middle
   !> between both blocks as they slide along each other by what their interval grows or shrinks, half at either end.
   pure subroutine keep_bonds(previous, source, same_rows, weakens, table)
      type(contact_table_type), intent(in) :: previous
      integer, intent(in) :: source(:)     !! (>= rows) row of the last step that continues
      logical, intent(in) :: same_rows     !! each row continues itself, `source` is not set
      logical, intent(in) :: weakens(:)    !! (joints) their bonds do, by slip
      type(contact_table_type), intent(inout) :: table
      real(wp) :: bond(2), length, before  ! shares of the interval; of it now and in the last step [length]
      integer :: k, row
      do k = 1, table%n
         if (table%station(k) /= 1 .or. .not. (table%bonded(k) .and. weakens(table%joint(k)))) cycle
         row = k
         if (.not. same_rows) row = source(k)
         if (row <= 0 .or. .not. any(table%total_slip(k:k + 1) > 0)) cycle
         bond = table%bond_end(k:k + 1)
         length = sum(table%length(k:k + 1))
         before = sum(previous%length(row:row + 1))
         if (.not. (bond(2) > bond(1) .and. abs(length - before) > 0)) cycle
         bond = min(1.0_wp, max(0.0_wp, (before*bond + 0.5_wp*(length - before))/length))
         if (.not. bond(2) > bond(1)) bond = 0
         table%bond_end(k:k + 1) = bond
      end do
   end subroutine keep_bonds

   !> Gap below which the blocks of a row touch at the start: of small blocks in a large model a share of their size,
   !> but for presets.
   pure real(wp) function near_gap(table, k, given, touch)
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: k
      type(search_input_type), intent(in) :: given
      real(wp), intent(in) :: touch         !! of the model [length]
      near_gap = touch
      if (given%limits%by_length .or. given%limits%corrected) near_gap = min(touch, touching_share* &
         min(given%topology%inradius(table%block_a(k)), given%topology%inradius(table%block_b(k))))
   end function near_gap

   !> Arrays of the size that this step needs.
   pure subroutine make_room(work, n_before, n, n_vertices)
      type(inheritance_work_type), intent(inout) :: work
      integer, intent(in) :: n_before, n, n_vertices   !! rows of the last step and of this one, vertices
      call reserve(work%source, n)
      if (allocated(work%is_taken)) then
         if (size(work%is_taken) <= n_before) deallocate (work%is_taken)
      end if
      if (.not. allocated(work%is_taken)) allocate (work%is_taken(0:n_before + n_before/4 + 16))
      if (allocated(work%pressed)) return
      allocate (work%pressed(n_vertices))
   end subroutine make_room

   !> For each row the one of the last step that it continues, 0 none; negative where that had another identity. No
   !> row continues twice.
   subroutine find_sources(given, others, table, source, is_taken)
      type(search_input_type), intent(in) :: given
      type(other_rows_type), intent(in) :: others(:)
      type(contact_table_type), intent(in) :: table
      integer, intent(inout) :: source(:)        !! (>= rows)
      logical, intent(inout) :: is_taken(0:)     !! (>= rows of the last step) by length, rows that go on
      integer :: k, row, alias
      !$omp parallel do default(none) private(k, row, alias) schedule(static) if (table%n > parallel_contacts) &
      !$omp shared(given, others, table, source)
      do k = 1, table%n
         alias = 0
         if (size(others) > 0) alias = others(k)%alias_vertex
         if (alias > 0) then
            row = given%history%find(given%previous, alias, others(k)%alias_edge)
            if (given%limits%corrected) row = -row
         else
            row = 0
            ! the same row as in the last step, as it is while no row comes or goes
            if (k <= given%previous%n) then
               if (given%previous%vertex(k) == table%vertex(k) .and. given%previous%edge(k) == table%edge(k) .and. &
                   given%previous%station(k) == table%station(k)) row = k
            end if
            if (row == 0) row = given%history%find(given%previous, table%vertex(k), table%edge(k), &
                int(table%station(k)))
         end if
         source(k) = row
      end do
      !$omp end parallel do
      if (.not. given%limits%by_length) return
      is_taken = .false.
      is_taken(source(1:table%n)) = .true.
      is_taken(0) = .false.
      do k = 1, table%n
         if (source(k) > 0) cycle
         row = predecessor(k, given, table)
         if (is_taken(row)) cycle
         is_taken(row) = row > 0
         source(k) = -row
      end do
   end subroutine find_sources

   !> State of row k from a row of the last step.
   pure subroutine take_over(previous, row, k, by_length, table)
      type(contact_table_type), intent(in) :: previous
      integer, intent(in) :: row, k
      logical, intent(in) :: by_length
      type(contact_table_type), intent(inout) :: table
      table%state(k) = previous%state(row)
      table%shear(k) = previous%shear(row)
      table%normal_force(k) = previous%normal_force(row)
      table%bonded(k) = previous%bonded(row)
      table%tied(k) = previous%tied(row)
      table%bond_end(k) = 0
      if (is_of_interval(table, k) .and. table%station(k) == previous%station(row)) &
         table%bond_end(k) = previous%bond_end(row)
      table%closed(k) = merge(previous%closed(row), 1.0_wp, is_of_interval(table, k))
      table%core(:, k) = merge(previous%core(:, row), [1.0_wp, 0.0_wp], is_of_interval(table, k))
      ! of ties: other joints get the stiffness of the length for which they stand now
      if (by_length) then
         table%k_n(k) = previous%k_n(row)
         table%k_s(k) = previous%k_s(row)
      end if
      table%slip_sign(k) = previous%slip_sign(row)
      table%total_slip(k) = previous%total_slip(row)
   end subroutine take_over

   !> A row continues without a gift of energy: a closed contact of a corner keeps its stiffness, one in another's
   !> place is compressed no more than that was, and what is free of force at depth follows the blocks as they part.
   pure subroutine keep_energy(given, row, is_own, k, table)
      type(search_input_type), intent(in) :: given
      integer, intent(in) :: row
      logical, intent(in) :: is_own        !! the row has the same identity
      integer, intent(in) :: k
      type(contact_table_type), intent(inout) :: table
      real(wp) :: depth
      logical :: is_closed
      is_closed = table%state(k) /= contact_state%open
      if (table%tied(k)) then
         table%length(k) = given%previous%length(row)
         return
      end if
      if (given%limits%by_length .and. is_closed .and. (table%station(k) == 0 .or. &
          table%station(k) == corner_station)) table%length(k) = given%previous%length(row)
      ! what comes to face each other later is not bonded: the bond keeps its own length until it slips
      if (given%limits%by_length .and. table%bonded(k) .and. .not. given%previous%total_slip(row) > 0) &
         table%length(k) = min(table%length(k), given%previous%length(row))
      if (.not. is_own .and. is_closed) then
         if (is_of_interval(given%previous, row)) then
            call stand_for_interval(given%previous, row, k, depth, table)
            if (table%state(k) == contact_state%open) return
         else
            depth = max(0.0_wp, depth_of(given%previous, given%limits, row))
         end if
         table%offset(k) = min(max(0.0_wp, given%previous%offset(row)), table%gap(k) + depth)
      else
         call follow_gap(is_closed, table%gap(k), table%offset(k))
         if (.not. (given%limits%by_length .and. is_closed) .or. table%bonded(k)) return
         if (table%station(k) /= 0 .and. table%station(k) /= corner_station) return
         ! the normal between two corners has turned, or passed to another edge: the spring is compressed as it was
         depth = max(0.0_wp, depth_of(given%previous, given%limits, row))
         if (table%gap(k) - table%offset(k) < -most_deeper*depth) table%offset(k) = table%gap(k) + depth
      end if
   end subroutine keep_energy

   !> Let the offset of a row follow the blocks as they part, up to zero. That of an open row is never above the gap: it
   !> closes without force.
   pure subroutine follow_gap(is_closed, gap, offset)
      logical, intent(in) :: is_closed
      real(wp), intent(in) :: gap          !! between the blocks [length]
      real(wp), intent(inout) :: offset    !! gap that is free of force [length]
      if (.not. is_closed) then
         offset = min(max(0.0_wp, offset), gap)
      else if (offset < 0) then
         offset = min(0.0_wp, max(offset, gap))
      end if
   end subroutine follow_gap

   !> For each edge on which a row begins the row of the last step, of an interval or of two edges that lie against each
   !> other, that is compressed most; 0 none. For other edges -1.
   pure subroutine find_pressed(given, table, source, pressed)
      type(search_input_type), intent(in) :: given
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: source(:)       !! (>= rows) row of the last step that continues, 0 none
      integer, intent(inout) :: pressed(:)   !! (nv)
      integer :: c, f, k
      pressed = -1
      if (all(source(1:table%n) /= 0)) return
      do k = 1, table%n
         if (source(k) /= 0) cycle
         f = facing_edge(table, k, given)
         if (f > 0) pressed(f) = 0
         pressed(table%vertex(k)) = 0
         pressed(table%edge(k)) = 0
      end do
      if (all(pressed < 0)) return
      do c = 1, given%previous%n
         if (given%previous%state(c) == contact_state%open) cycle
         f = facing_edge(given%previous, c, given)
         if (f == 0) cycle
         if (pressed(f) >= 0) call keep_deeper(given%previous, given%limits, c, pressed(f))
         if (pressed(given%previous%edge(c)) >= 0) call keep_deeper(given%previous, given%limits, c, &
            pressed(given%previous%edge(c)))
      end do
   end subroutine find_pressed

   !> Edge of the first block that lies against the edge of a row, 0 none: that of an interval, or with contacts of
   !> vertices the one of the vertex that faces the other edge.
   pure integer function facing_edge(table, c, given) result(f)
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: c                 !! row
      type(search_input_type), intent(in) :: given
      f = 0
      if (given%limits%by_length) then
         if (table%station(c) > 0 .and. table%station(c) /= corner_station) f = table%vertex(c)
      else if (table%length(c) > 0) then
         f = given%topology%edge_in(table%vertex(c))
         if (is_facing(f, table%edge(c), given%outlines, given%limits%cosine)) return
         f = given%topology%edge_out(table%vertex(c))
         if (.not. is_facing(f, table%edge(c), given%outlines, given%limits%cosine)) f = 0
      end if
   end function facing_edge

   !> A row without a predecessor. Behind the edge it is as deep as the springs beside it on the same edges compressed
   !> like them, the rest of its depth is free of force. Where these springs are free of force at a gap, by the initial
   !> stress, that is its gap too.
   pure subroutine begin_row(given, pressed, f, k, table)
      type(search_input_type), intent(in) :: given
      integer, intent(in) :: pressed(:)
      integer, intent(in) :: f             !! edge that lies against that of the row, 0 none
      integer, intent(in) :: k
      type(contact_table_type), intent(inout) :: table
      real(wp) :: depth, free
      integer :: row
      table%offset(k) = min(0.0_wp, table%gap(k))
      if (f == 0) return
      row = pressed(f)
      if (row == 0) then
         row = pressed(table%edge(k))
      else if (pressed(table%edge(k)) > 0) then
         if (depth_of(given%previous, given%limits, pressed(table%edge(k))) > depth_of(given%previous, given%limits, &
             row)) row = pressed(table%edge(k))
      end if
      if (row == 0) return
      free = max(0.0_wp, given%previous%offset(row))
      if (table%gap(k) >= free) return
      depth = max(0.0_wp, depth_of(given%previous, given%limits, row))
      table%offset(k) = min(free, table%gap(k) + depth)
      table%state(k) = given%previous%state(row)
      table%shear(k) = given%previous%shear(row)
      table%slip_sign(k) = given%previous%slip_sign(row)
      table%total_slip(k) = given%previous%total_slip(row)
      table%normal_force(k) = 0
   end subroutine begin_row

   !> Row of the last step in whose place row k stands, 0 none: a contact of the same corner, closed and as it lay on
   !> an edge, on a corner or at the end of an interval. Long by its small searches, each for one kind of row.
   pure integer function predecessor(k, given, table) result(row)
      integer, intent(in) :: k
      type(search_input_type), intent(in) :: given
      type(contact_table_type), intent(in) :: table
      integer :: f, e, w
      f = table%vertex(k)
      e = table%edge(k)
      row = 0
      select case (table%station(k))
      case (0)
         row = end_row(given%topology%edge_in(f), e)
         if (row == 0) row = end_row(given%topology%edge_out(f), e)
         if (row == 0) row = corner_row(f, given%topology%owner(e))
         if (row == 0) row = corner_row(f, given%topology%owner(given%topology%next(e)))
      case (corner_station)
         w = e
         row = vertex_row(f, given%topology%edge_in(w))
         if (row == 0) row = vertex_row(f, given%topology%edge_out(w))
         if (row == 0) row = vertex_row(w, given%topology%edge_in(f))
         if (row == 0) row = vertex_row(w, given%topology%edge_out(f))
         if (row == 0) row = end_row(given%topology%edge_in(f), given%topology%edge_out(w))
         if (row == 0) row = end_row(given%topology%edge_out(f), given%topology%edge_in(w))
      case (1)
         row = vertex_row(given%topology%next(f), e)
         if (row == 0) row = vertex_row(e, f)
         if (row == 0) row = corner_row(given%topology%next(f), e)
      case default
         row = vertex_row(f, e)
         if (row == 0) row = vertex_row(given%topology%next(e), f)
         if (row == 0) row = corner_row(f, given%topology%next(e))
      end select

   contains

      !> A vertex on an edge.
      pure integer function vertex_row(v, edge)
         integer, intent(in) :: v, edge
         vertex_row = closed_row(given%history%find(given%previous, given%topology%owner(v), edge))
      end function vertex_row

      !> A corner on a corner.
      pure integer function corner_row(a, b)
         integer, intent(in) :: a, b
         if (given%topology%block(a) < given%topology%block(b)) then
            corner_row = closed_row(given%history%find(given%previous, a, b, corner_station))
         else
            corner_row = closed_row(given%history%find(given%previous, b, a, corner_station))
         end if
      end function corner_row

      !> The end of the interval of an edge at vertex f and another edge.
      pure integer function end_row(own, other)
         integer, intent(in) :: own, other
         integer :: n
         logical :: is_first, is_high
         is_first = given%topology%block(own) < given%topology%block(other)
         ! the first point is that near the last vertex of the first block's edge
         is_high = given%topology%edge_out(f) == own .eqv. is_first
         n = merge(n_points, 1, is_high)
         if (is_first) end_row = closed_row(given%history%find(given%previous, own, other, n))
         if (.not. is_first) end_row = closed_row(given%history%find(given%previous, other, own, n))
      end function end_row

      !> A row of the last step when it was closed, else 0.
      pure integer function closed_row(found)
         integer, intent(in) :: found
         closed_row = 0
         if (found == 0) return
         if (given%previous%state(found) /= contact_state%open) closed_row = found
      end function closed_row

   end function predecessor

   !> The row of a corner stands where an interval was pressed together at that end. It gets the length and the
   !> compression with which one spring has the force and the energy of the whole interval; along the edge the force, or
   !> less where a spring of that length would have more energy with it.
   pure subroutine stand_for_interval(previous, row, k, depth, table)
      type(contact_table_type), intent(in) :: previous
      integer, intent(in) :: row             !! of the interval, at this end
      integer, intent(in) :: k
      real(wp), intent(out) :: depth         !! [length]
      type(contact_table_type), intent(inout) :: table
      real(wp) :: force, energy, shear, most, stiffness, distance(2)
      integer :: other
      other = row + merge(1, -1, previous%station(row) == 1)
      distance = at_end(previous%distance([row, other]), previous%distance([other, row]))
      force = previous%normal_force(row) + previous%normal_force(other)
      energy = sum(normal_energy_of(previous%energy([row, other]), previous%k_s([row, other]), previous%shear([row, &
               other])))
      depth = 0
      if (.not. (force > 0 .and. energy > 0) .or. distance(1) > distance(2)) then
         call table%open_row(k)
         table%offset(k) = min(0.0_wp, table%gap(k))
         return
      end if
      depth = 2*energy/force
      table%normal_force(k) = force
      table%energy(k) = sum(previous%energy([row, other]))
      shear = previous%k_s(row)*(previous%shear(row) + previous%shear(other))
      table%length(k) = force/(previous%k_n(row)/previous%length(row)*depth)
      stiffness = previous%k_s(row)/previous%length(row)*table%length(k)
      most = sqrt(previous%k_s(row)*(previous%shear(row)**2 + previous%shear(other)**2)/stiffness)
      table%shear(k) = sign(min(abs(shear)/stiffness, most), shear)
   end subroutine stand_for_interval

   !> Energy in the normal spring of a row at the end of its step.
   elemental real(wp) function normal_energy_of(energy, k_s, shear)
      real(wp), intent(in) :: energy, k_s, shear
      normal_energy_of = energy - 0.5_wp*k_s*shear**2
   end function normal_energy_of

   !> Intervals without history of their own.
   pure subroutine begin_intervals(given, source, pressed, table)
      type(search_input_type), intent(in) :: given
      integer, intent(in) :: source(:)       !! (>= rows) < 0: row of a corner of the last step at that end; 0 none
      integer, intent(in) :: pressed(:)      !! (nv) row of the last step that is compressed most, of each edge
      type(contact_table_type), intent(inout) :: table
      integer :: k
      do k = 1, table%n
         if (table%station(k) /= 1) cycle
         if (source(k) > 0) cycle
         ! free of force, as deep as it is found
         table%offset(k:k + 1) = min(0.0_wp, minval(end_gaps(table%distance(k:k + 1))))
         table%bonded(k:k + 1) = all(table%bonded(k:k + 1))
         table%tied(k:k + 1) = all(table%tied(k:k + 1))
         if (.not. table%bonded(k)) table%bond_end(k:k + 1) = 0
         if (any(table%state(k:k + 1) /= contact_state%open)) table%state(k:k + 1) = contact_state%locked
         table%gap(k:k + 1) = table%distance(k:k + 1) - table%offset(k:k + 1)
         if (any(source(k:k + 1) < 0)) then
            call stand_for_corners(given%previous, -source(k:k + 1), given%limits%law_of(table%joint(k)), k, table)
         else
            call press_like_others(given%previous, pressed, given%limits, k, table)
         end if
      end do
   end subroutine begin_intervals

   !> An interval that is as close as the corners at its ends were. It is pressed together until it has the energy of
   !> their normal springs, and carries their shear forces.
   pure subroutine stand_for_corners(previous, rows, law, k, table)
      type(contact_table_type), intent(in) :: previous
      integer, intent(in) :: rows(2)         !! of corners at the low and the high end, 0 none
      type(normal_law_type), intent(in) :: law
      integer, intent(in) :: k
      type(contact_table_type), intent(inout) :: table
      real(wp) :: energy, shear, stiffness(2), free
      integer :: i, row
      energy = 0
      shear = 0
      stiffness = 0
      free = 0
      do i = 1, 2
         row = rows(i)
         if (row == 0) cycle
         energy = energy + normal_energy_of(previous%energy(row), previous%k_s(row), previous%shear(row))
         shear = shear + previous%k_s(row)*previous%shear(row)
         stiffness = [previous%k_n(row), previous%k_s(row)]/previous%length(row)
         free = max(free, previous%offset(row))
         table%state(k:k + 1) = previous%state(row)
         table%slip_sign(k:k + 1) = previous%slip_sign(row)
         table%total_slip(k:k + 1) = previous%total_slip(row)
         table%normal_force(k:k + 1) = 0.5_wp*previous%normal_force(row)
      end do
      table%k_n(k:k + 1) = stiffness(1)*table%length(k:k + 1)
      table%k_s(k:k + 1) = stiffness(2)*table%length(k:k + 1)
      table%offset(k:k + 1) = table%offset(k) + &
                              depth_of_energy(table%gap(k:k + 1), sum(table%k_n(k:k + 1)), law, energy)
      table%offset(k:k + 1) = min(free, table%offset(k))
      table%gap(k:k + 1) = table%distance(k:k + 1) - table%offset(k:k + 1)
      table%shear(k:k + 1) = 0.5_wp*shear/table%k_s(k:k + 1)
      table%energy(k:k + 1) = 0.5_wp*sum(previous%energy(pack(rows, rows > 0)))
   end subroutine stand_for_corners

   !> A new interval is as deep in the other block as the springs beside it on the same edges are compressed, the rest
   !> of its depth is free of force. Where these are free of force at a gap, by the initial stress, that is its gap too.
   pure subroutine press_like_others(previous, pressed, limits, k, table)
      type(contact_table_type), intent(in) :: previous
      integer, intent(in) :: pressed(:)
      type(search_limits_type), intent(in) :: limits
      integer, intent(in) :: k
      type(contact_table_type), intent(inout) :: table
      real(wp) :: free, lowest
      integer :: row
      row = max(pressed(table%vertex(k)), 0)
      if (row == 0) then
         row = max(pressed(table%edge(k)), 0)
      else if (pressed(table%edge(k)) > 0) then
         call keep_deeper(previous, limits, pressed(table%edge(k)), row)
      end if
      if (row == 0) return
      free = max(0.0_wp, previous%offset(row))
      lowest = minval(end_gaps(table%distance(k:k + 1)))
      if (lowest >= free) return
      table%offset(k:k + 1) = min(free, lowest + max(0.0_wp, depth_of(previous, limits, row)))
      table%gap(k:k + 1) = table%distance(k:k + 1) - table%offset(k:k + 1)
      table%state(k:k + 1) = previous%state(row)
      table%shear(k:k + 1) = previous%shear(row)
      table%slip_sign(k:k + 1) = previous%slip_sign(row)
      table%total_slip(k:k + 1) = previous%total_slip(row)
      table%normal_force(k:k + 1) = 0
   end subroutine press_like_others

   !> Row c instead of a row that is compressed less.
   pure subroutine keep_deeper(table, limits, c, row)
      type(contact_table_type), intent(in) :: table
      type(search_limits_type), intent(in) :: limits
      integer, intent(in) :: c
      integer, intent(inout) :: row
      if (row > 0) then
         if (depth_of(table, limits, row) >= depth_of(table, limits, c)) return
      end if
      row = c
   end subroutine keep_deeper

   !> Compression of the normal spring of a row at the end of its step.
   pure real(wp) function depth_of(table, limits, row)
      type(contact_table_type), intent(in) :: table
      type(search_limits_type), intent(in) :: limits
      integer, intent(in) :: row
      type(normal_law_type) :: law
      law = limits%law_of(table%joint(row))
      depth_of = table%normal_force(row)/law%secant(table%k_n(row), table%normal_force(row))
   end function depth_of

end module rockdda_contact_inheritance
