! SPDX-License-Identifier: MIT
!> Joints that come to bear on more of their edges: springs that grow while they are compressed keep their energy.
module rockdda_contact_new_lengths
   use rockdda_base_first_use, only : take_pages
   use rockdda_base_kinds, only : wp
   use rockdda_base_parallel, only : parallel_contacts, piece, n_pieces, n_ranges, range_of
   use rockdda_contact_corners, only : corner_station
   use rockdda_contact_table, only : contact_table_type, contact_state
   implicit none
   private
   public :: new_lengths_type, free_new_lengths

   !> An edge that bears more by less than this share has not grown; energy that rises by less is the same.
   real(wp), parameter :: least_growth = 1.0e-9_wp

   !> Of each edge, kept from step to step as scratch.
   type :: new_lengths_type
      real(wp), allocatable :: before(:), now(:)     !! (nv) length that bears [length]
      real(wp), allocatable :: gained(:), lost(:)    !! (nv) by the springs whose energy rises, falls [energy]
      !> (2, >= rows) Energy of each row that is compressed, before and now; -1 for others [energy].
      real(wp), allocatable :: stored(:, :)
   contains
      procedure :: make_room
   end type new_lengths_type

contains

   !> Room for the edges of a model.
   pure subroutine make_room(self, n_vertices)
      class(new_lengths_type), intent(inout) :: self
      integer, intent(in) :: n_vertices
      if (allocated(self%before)) return
      allocate (self%before(n_vertices), self%now(n_vertices), self%gained(n_vertices), self%lost(n_vertices))
   end subroutine make_room

   !> What the joints of both edges bear more than in the last step begins free of force: the length by which both have
   !> grown, and the energy that a spring has more, by its length and its new place, than springs of one of its edges
   !> have lost. Where a block slides from one to the next its edge bears as much as before, and nothing changes.
   subroutine free_new_lengths(previous, source, same_rows, is_taken, pressed, work, table)
      type(contact_table_type), intent(in) :: previous
      integer, intent(in) :: source(:)          !! (>= rows) row of the last step that goes on, 0 none
      logical, intent(in) :: same_rows          !! each row goes on with itself, and there were no others
      logical, intent(in) :: is_taken(0:)       !! (>= rows of the last step) it goes on; not set with `same_rows`
      integer, intent(in) :: pressed(:)         !! (nv) row of the last step that is compressed most, of each edge
      type(new_lengths_type), intent(inout) :: work
      type(contact_table_type), intent(inout) :: table
      integer :: p, ends(2), ranges
      if (allocated(work%stored)) then
         if (size(work%stored, 2) < table%n) deallocate (work%stored)
      end if
      if (.not. allocated(work%stored)) then
         allocate (work%stored(2, table%n + table%n/4))
         call take_pages(work%stored(:, 1:table%n))
      end if
      ! every range of edges adds up its own sums, in the order of the rows
      ranges = n_ranges(table%n > parallel_contacts)
      !$omp parallel default(none) shared(previous, source, same_rows, is_taken, pressed, work, table, ranges) &
      !$omp private(p, ends) if (table%n > parallel_contacts)
      !$omp do schedule(static)
      do p = 1, n_pieces(table%n)
         call find_energies((p - 1)*piece + 1, min(p*piece, table%n), previous, source, pressed, table, work%stored)
      end do
      !$omp end do
      !$omp do schedule(static)
      do p = 1, ranges
         ends = range_of(p, ranges, size(work%before))
         associate (first => ends(1), last => ends(2))
            if (same_rows) then
               call add_up_both(first, last, previous, table, work%stored, work%before(first:last), &
                                work%now(first:last), work%gained(first:last), work%lost(first:last))
            else
               call add_up(first, last, previous, is_taken, table, work%stored, work%before(first:last), &
                           work%now(first:last), work%gained(first:last), work%lost(first:last))
            end if
         end associate
      end do
      !$omp end do
      !$omp do schedule(static)
      do p = 1, n_pieces(table%n)
         call free_rows((p - 1)*piece + 1, min(p*piece, table%n), work, table)
      end do
      !$omp end do
      !$omp end parallel
   end subroutine free_new_lengths

   !> Energies of some of the rows before and now, of those that are compressed; -1 for others that bear, and -2.
   pure subroutine find_energies(first, last, previous, source, pressed, table, energy)
      integer, intent(in) :: first, last
      type(contact_table_type), intent(in) :: previous
      integer, intent(in) :: source(:), pressed(:)
      type(contact_table_type), intent(in) :: table
      real(wp), intent(inout) :: energy(:, :)   !! (2, >= rows)
      integer :: k
      do k = first, last
         energy(1, k) = -2
         if (.not. is_bearing(table, k)) cycle
         energy(1, k) = -1
         if (table%gap(k) < 0 .and. .not. table%tied(k)) &
            energy(:, k) = energies(previous, abs(source(k)), pressed(table%vertex(k)), pressed(table%edge(k)), k, &
                                    table)
      end do
   end subroutine find_energies

   !> Of some of the edges: the length that bears before and now, the energy that springs have gained and lost since the
   !> end of the last step.
   pure subroutine add_up(first, last, previous, is_taken, table, energy, before, now, gained, lost)
      integer, intent(in) :: first, last        !! edges
      type(contact_table_type), intent(in) :: previous
      logical, intent(in) :: is_taken(0:)
      type(contact_table_type), intent(in) :: table
      real(wp), intent(in), contiguous :: energy(:, :)     !! (2, >= rows) of `find_energies`
      real(wp), intent(out) :: before(first:last), now(first:last), gained(first:last), lost(first:last)
      real(wp) :: more
      integer :: k
      before = 0
      now = 0
      gained = 0
      lost = 0
      do k = 1, table%n
         if (energy(1, k) < -1) cycle
         associate (f => table%vertex(k), e => table%edge(k))
            call add(f, e, table%length(k), first, last, now)
            if (energy(1, k) < 0) cycle
            more = energy(2, k) - energy(1, k)
            if (more > 0) then
               call add(f, e, more, first, last, gained)
            else
               call add(f, e, -more, first, last, lost)
            end if
         end associate
      end do
      do k = 1, previous%n
         if (.not. is_bearing(previous, k)) cycle
         associate (f => previous%vertex(k), e => previous%edge(k))
            call add(f, e, previous%length(k), first, last, before)
            if (.not. (is_taken(k) .or. previous%tied(k))) call add(f, e, stored(previous, k), first, last, lost)
         end associate
      end do
   end subroutine add_up

   !> `add_up` where each row goes on with itself: a row that bears has borne, and none was lost.
   pure subroutine add_up_both(first, last, previous, table, energy, before, now, gained, lost)
      integer, intent(in) :: first, last        !! edges
      type(contact_table_type), intent(in) :: previous
      type(contact_table_type), intent(in) :: table
      real(wp), intent(in), contiguous :: energy(:, :)
      real(wp), intent(out) :: before(first:last), now(first:last), gained(first:last), lost(first:last)
      integer :: k, side, edge
      before = 0
      now = 0
      gained = 0
      lost = 0
      do k = 1, table%n
         if (energy(1, k) < -1) cycle
         do side = 1, 2
            edge = merge(table%vertex(k), table%edge(k), side == 1)
            if (edge < first .or. edge > last) cycle
            now(edge) = now(edge) + table%length(k)
            before(edge) = before(edge) + previous%length(k)
            if (energy(1, k) < 0) cycle
            if (energy(2, k) - energy(1, k) > 0) then
               gained(edge) = gained(edge) + (energy(2, k) - energy(1, k))
            else
               lost(edge) = lost(edge) - (energy(2, k) - energy(1, k))
            end if
         end do
      end do
   end subroutine add_up_both

   !> Add to the sums of two edges, if they are among some of the edges.
   pure subroutine add(f, e, what, first, last, sums)
      integer, intent(in) :: f, e
      real(wp), intent(in) :: what
      integer, intent(in) :: first, last
      real(wp), intent(inout) :: sums(first:last)
      if (f >= first .and. f <= last) sums(f) = sums(f) + what
      if (e >= first .and. e <= last) sums(e) = sums(e) + what
   end subroutine add

   !> Free the new lengths of some of the rows.
   pure subroutine free_rows(first, last, work, table)
      integer, intent(in) :: first, last
      type(new_lengths_type), intent(in) :: work
      type(contact_table_type), intent(inout) :: table
      real(wp) :: growth, rise(2), share, shift
      integer :: k
      do k = first, last
         rise = work%stored(:, k)
         if (.not. rise(1) >= 0) cycle
         associate (f => table%vertex(k), e => table%edge(k))
            share = 1
            if (min(work%before(f), work%before(e)) > 0 .and. &
                min(work%now(f) - work%before(f), work%now(e) - work%before(e)) > 0) then
               growth = min(work%now(f)/work%before(f), work%now(e)/work%before(e))
               if (growth >= 1 + least_growth) share = 1/sqrt(growth)
            end if
            if (rise(2) - rise(1) > least_growth*rise(2)) &
               share = min(share, sqrt((rise(1) + (rise(2) - rise(1))*covered(f, e))/rise(2)))
         end associate
         if (share >= 1) cycle
         shift = table%gap(k)*(1 - share)
         table%offset(k) = table%offset(k) + shift
         table%gap(k) = table%gap(k) - shift
         table%shear(k) = table%shear(k)*share
      end do

   contains

      !> Share of the rise at an edge that the loss at the same edge covers, of the better one of two edges.
      pure real(wp) function covered(f, e)
         integer, intent(in) :: f, e
         covered = min(1.0_wp, max(work%lost(f)/work%gained(f), work%lost(e)/work%gained(e)))
      end function covered

   end subroutine free_rows

   !> Energy of the springs of row k: at the end of the last step, and with the length and the gap that it has now.
   pure function energies(previous, row, first, second, k, table) result(e)
      type(contact_table_type), intent(in) :: previous
      integer, intent(in) :: row             !! of the last step that goes on as row k, 0 none
      integer, intent(in) :: first, second   !! rows of the last step on its edges, 0 none: for the stiffness
      integer, intent(in) :: k
      type(contact_table_type), intent(in) :: table
      real(wp) :: e(2)
      integer :: like
      e = 0
      if (row > 0) e(1) = stored(previous, row)
      like = row
      if (like == 0) like = first
      if (like == 0) like = second
      if (like == 0) return
      if (.not. previous%length(like) > 0) then
         e(2) = e(1)
      else
         e(2) = 0.5_wp*(table%length(k)/previous%length(like))*(previous%k_n(like)*table%gap(k)**2 + &
                                                               previous%k_s(like)*table%shear(k)**2)
      end if
   end function energies

   !> Energy of the springs of a row at the end of its step.
   pure real(wp) function stored(previous, row)
      type(contact_table_type), intent(in) :: previous
      integer, intent(in) :: row
      stored = 0.5_wp*previous%k_s(row)*previous%shear(row)**2
      if (previous%k_n(row) > 0) stored = stored + 0.5_wp*previous%normal_force(row)**2/previous%k_n(row)
   end function stored

   !> Is a row a closed station of an interval?
   pure logical function is_bearing(table, k)
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: k
      is_bearing = table%station(k) > 0 .and. table%station(k) /= corner_station .and. &
                   table%state(k) /= contact_state%open
   end function is_bearing

end module rockdda_contact_new_lengths
