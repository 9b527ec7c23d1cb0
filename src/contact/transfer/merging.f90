! SPDX-License-Identifier: MIT
!> The contact table of all blocks from that of a step, which leaves out pairs of resting blocks, and the last one.
module rockdda_contact_merging
   use rockdda_contact_table, only : contact_table_type
   implicit none
   private
   public :: merge_resting

   !> Rows that follow one another in one table and in the merged one.
   type :: run_type
      integer :: first = 1            !! in the merged table
      integer :: n = 0
      integer :: begin = 1            !! in their own
      logical :: is_last = .false.    !! of the last step
   end type run_type

contains

   !> Replace the table of the last step by that of this step and, between resting blocks, the rows of the last one.
   !> What keeps its place is not copied, unless rows refer to others as their partners.
   subroutine merge_resting(step, resting, last, room)
      type(contact_table_type), intent(in) :: step       !! rows of all pairs of which one block does not rest
      logical, intent(in) :: resting(:)                  !! (blocks)
      type(contact_table_type), intent(inout) :: last
      type(contact_table_type), intent(inout) :: room    !! scratch
      type(run_type), allocatable :: runs(:)
      integer :: i, n, n_runs, moved
      logical :: in_place
      call list_runs(step, resting, last, runs, n_runs)
      n = 0
      if (n_runs > 0) n = runs(n_runs)%first + runs(n_runs)%n - 1
      do moved = 1, n_runs
         if (runs(moved)%is_last .and. runs(moved)%first /= runs(moved)%begin) exit
      end do
      in_place = allocated(last%gap)
      if (in_place) in_place = n <= min(size(last%vertex), size(last%gap)) .and. .not. has_partners(step) .and. &
                               .not. has_partners(last)
      ! what moves is copied twice then
      if (in_place .and. moved <= n_runs) in_place = runs(moved)%first > n/2
      if (.not. in_place) moved = 1
      call room%resize(n)
      do i = moved, n_runs
         associate (run => runs(i))
            if (run%is_last) then
               call room%take_rows(run%first, run%first + run%n - 1, last, run%begin)
            else
               call room%take_rows(run%first, run%first + run%n - 1, step, run%begin)
            end if
         end associate
      end do
      if (in_place) then
         call last%resize(n)
         do i = 1, moved - 1
            associate (run => runs(i))
               if (.not. run%is_last) call last%take_rows(run%first, run%first + run%n - 1, step, run%begin)
            end associate
         end do
         if (moved <= n_runs) call last%take_rows(runs(moved)%first, n, room, runs(moved)%first)
      else
         call renumber_partners(step%n, last%n, runs(1:n_runs), room)
         call last%exchange(room)
      end if
   end subroutine merge_resting

   !> List the runs of the merged table, by (vertex, edge, station).
   subroutine list_runs(step, resting, last, runs, n_runs)
      type(contact_table_type), intent(in) :: step, last
      logical, intent(in) :: resting(:)
      type(run_type), allocatable, intent(out) :: runs(:)
      integer, intent(out) :: n_runs
      integer :: c, k, n, row, before
      logical :: takes_last, goes_on
      allocate (runs(step%n + last%n))
      n_runs = 0
      n = 0
      c = 1
      k = 1
      do
         do while (c <= last%n)
            if (resting(last%block_a(c)) .and. resting(last%block_b(c))) exit
            c = c + 1
         end do
         if (c > last%n .and. k > step%n) exit
         takes_last = k > step%n
         if (.not. takes_last .and. c <= last%n) takes_last = comes_before(last, c, step, k)
         row = merge(c, k, takes_last)
         n = n + 1
         goes_on = n_runs > 0
         if (goes_on) goes_on = (runs(n_runs)%is_last .eqv. takes_last) .and. runs(n_runs)%begin + runs(n_runs)%n == row
         if (.not. goes_on) then
            n_runs = n_runs + 1
            runs(n_runs) = run_type(n, 0, row, takes_last)
         end if
         runs(n_runs)%n = runs(n_runs)%n + 1
         if (.not. takes_last) then
            k = k + 1
            cycle
         end if
         c = c + 1
         ! rows of vertices before that of the next row of this step
         before = huge(before)
         if (k <= step%n) before = step%vertex(k)
         do while (c <= last%n)
            if (last%vertex(c) >= before) exit
            if (.not. (resting(last%block_a(c)) .and. resting(last%block_b(c)))) exit
            n = n + 1
            runs(n_runs)%n = runs(n_runs)%n + 1
            c = c + 1
         end do
      end do
   end subroutine list_runs

   !> Do rows refer to others?
   pure logical function has_partners(table)
      type(contact_table_type), intent(in) :: table
      has_partners = any(table%partner(1:table%n) > 0)
   end function has_partners

   !> Partners are rows of the same blocks, hence of the same table before.
   subroutine renumber_partners(n_step, n_last, runs, merged)
      integer, intent(in) :: n_step, n_last              !! rows of the two tables
      type(run_type), intent(in) :: runs(:)
      type(contact_table_type), intent(inout) :: merged
      integer, allocatable :: from_step(:), from_last(:)
      integer :: c, i, k
      if (.not. has_partners(merged)) return
      allocate (from_step(n_step), from_last(n_last), source=0)
      do i = 1, size(runs)
         do k = 0, runs(i)%n - 1
            if (runs(i)%is_last) then
               from_last(runs(i)%begin + k) = runs(i)%first + k
            else
               from_step(runs(i)%begin + k) = runs(i)%first + k
            end if
         end do
      end do
      do i = 1, size(runs)
         do c = runs(i)%first, runs(i)%first + runs(i)%n - 1
            if (merged%partner(c) == 0) cycle
            if (runs(i)%is_last) then
               merged%partner(c) = from_last(merged%partner(c))
            else
               merged%partner(c) = from_step(merged%partner(c))
            end if
         end do
      end do
   end subroutine renumber_partners

   !> Does row c of a table come before row k of another one?
   pure logical function comes_before(table, c, other, k)
      type(contact_table_type), intent(in) :: table, other
      integer, intent(in) :: c, k
      comes_before = table%vertex(c) < other%vertex(k)
      if (table%vertex(c) /= other%vertex(k)) return
      comes_before = table%edge(c) < other%edge(k)
      if (table%edge(c) /= other%edge(k)) return
      comes_before = table%station(c) < other%station(k)
   end function comes_before

end module rockdda_contact_merging
