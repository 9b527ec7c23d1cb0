! SPDX-License-Identifier: MIT
!> Joints that come to bear on more of their edges: springs that grow while they are compressed keep their energy.
module rockdda_contact_new_lengths
   use rockdda_base_kinds, only : wp, i1, l1
   use rockdda_base_parallel, only : parallel_contacts, piece, n_pieces, n_ranges, range_of
   use rockdda_contact_interval_law, only : closed_part_type, depth_of_energy, end_gaps, find_closed_part, overhang, &
      part_energies
   use rockdda_contact_normal_law, only : normal_law_type
   use rockdda_contact_search_limits, only : search_limits_type
   use rockdda_contact_table, only : contact_table_type, contact_state, cut_no_interval, is_of_interval
   implicit none
   private
   public :: new_lengths_type, free_new_lengths

   !> An edge that bears more by less than this share has not grown; energy that rises by less is the same.
   real(wp), parameter :: least_growth = 1.0e-9_wp

   !> Of each edge, kept from step to step as scratch.
   type :: new_lengths_type
      !> (4, nv), or as many numbers in another shape: length that bears, before and now [length]; energy gained by the
      !> springs whose energy rises, and lost by those whose energy falls [energy].
      real(wp), allocatable :: sums(:, :)
      !> (2, >= rows) Half of the energy of the interval of each row that is pressed together, before and now; -1 and -1
      !> for others that bear [energy].
      real(wp), allocatable :: stored(:, :)
   end type new_lengths_type

contains

   !> What the joints of both edges bear more than in the last step begins free of force: the length by which both have
   !> grown, and the energy that a spring has more, by its length and its new place, than springs of one of its edges
   !> have lost. Where a block slides from one to the next its edge bears as much as before, and nothing changes.
   subroutine free_new_lengths(previous, source, same_rows, is_taken, pressed, limits, work, table)
      type(contact_table_type), intent(in) :: previous
      integer, intent(in) :: source(:)          !! (>= rows) row of the last step that continues, 0 none
      logical, intent(in) :: same_rows          !! each row continues itself, and there were no others
      logical, intent(in) :: is_taken(0:)       !! (>= rows of the last step) it continues; not set with `same_rows`
      integer, intent(in) :: pressed(:)         !! (nv) row of the last step that is compressed most, of each edge
      type(search_limits_type), intent(in) :: limits
      type(new_lengths_type), intent(inout) :: work
      type(contact_table_type), intent(inout) :: table
      integer :: p, ends(2), ranges, nv
      if (previous%n == 0) return
      nv = size(pressed)
      if (allocated(work%sums)) then
         if (size(work%sums) < 4*nv) deallocate (work%sums)
      end if
      if (.not. allocated(work%sums)) allocate (work%sums(4, nv))
      if (allocated(work%stored)) then
         if (size(work%stored, 2) < table%n) deallocate (work%stored)
      end if
      if (.not. allocated(work%stored)) allocate (work%stored(2, table%n + table%n/4))
      ! every range of edges adds up its own sums, in the order of the rows
      ranges = n_ranges(table%n > parallel_contacts)
      !$omp parallel default(none) private(p, ends) if (table%n > parallel_contacts) &
      !$omp shared(previous, source, same_rows, is_taken, pressed, limits, work, table, ranges, nv)
      !$omp do schedule(static)
      do p = 1, n_pieces(table%n)
         if (same_rows) then
            call compare_energies((p - 1)*piece + 1, min(p*piece, table%n), table%n, limits, table%joint, &
                                  table%station, table%state, table%tied, table%bonded, table%gap, table%shear, &
                                  table%length, previous%length, previous%k_n, &
                                  previous%k_s, previous%energy, work%stored)
         else
            call find_energies((p - 1)*piece + 1, min(p*piece, table%n), previous, source, pressed, limits, table, &
                               work%stored)
         end if
      end do
      !$omp end do
      !$omp do schedule(static)
      do p = 1, ranges
         ends = range_of(p, ranges, nv)
         if (same_rows) then
            call add_up_both(ends(1), ends(2), nv, table%n, table%vertex, table%edge, table%length, previous%length, &
                             work%stored, work%sums)
         else
            call add_up(ends(1), ends(2), nv, previous, is_taken, table, work%stored, work%sums)
         end if
      end do
      !$omp end do
      !$omp do schedule(static)
      do p = 1, n_pieces(table%n)
         ends = [(p - 1)*piece + 1, min(p*piece, table%n)]
         call cut_no_interval(table%n, table%station, ends(1), ends(2))
         call free_rows(ends(1), ends(2), nv, table%n, limits, table%joint, table%bonded, table%station, table%vertex, &
                        table%edge, work%stored, work%sums, table%gap, table%offset, table%shear)
      end do
      !$omp end do
      !$omp end parallel
   end subroutine free_new_lengths

   !> Energies of some of the rows before and now, of those that are compressed; -1 for others that bear, and -2 for
   !> those that do not.
   pure subroutine find_energies(first, last, previous, source, pressed, limits, table, energy)
      integer, intent(in) :: first, last
      type(contact_table_type), intent(in) :: previous
      integer, intent(in) :: source(:), pressed(:)
      type(search_limits_type), intent(in) :: limits
      type(contact_table_type), intent(in) :: table
      real(wp), intent(inout) :: energy(:, :)   !! (2, >= rows)
      integer :: k, r
      do k = first, last
         energy(1, k) = -2
         if (.not. is_bearing(table, k)) cycle
         energy(:, k) = -1
         r = k + 1 - table%station(k)
         if (any(end_gaps(table%gap(r:r + 1)) < 0) .and. .not. table%tied(k)) &
            energy(:, k) = energies(previous, source, pressed(table%vertex(k)), pressed(table%edge(k)), limits, k, &
               table)
      end do
   end subroutine find_energies

   !> `find_energies` where each row continues itself. Many arguments: arrays of constant shape spare the place of
   !> each number.
   pure subroutine compare_energies(first, last, n, limits, joint, station, state, tied, bonded, gap, shear, &
                                    length, length_before, k_n, k_s, energy_before, energy)
      integer, intent(in) :: first, last, n
      type(search_limits_type), intent(in) :: limits
      integer, intent(in) :: joint(n)
      integer(i1), intent(in) :: station(n), state(n)
      logical(l1), intent(in) :: tied(n), bonded(n)
      real(wp), intent(in) :: gap(n), shear(n), length(n)
      !> At the end of the last step.
      real(wp), intent(in) :: length_before(n), k_n(n), k_s(n), energy_before(n)
      real(wp), intent(inout) :: energy(2, n)
      real(wp) :: more
      integer :: k, r
      do k = first, last
         energy(:, k) = -2
         if (.not. (station(k) == 1 .or. station(k) == 2) .or. state(k) == contact_state%open) cycle
         energy(:, k) = -1
         if (tied(k)) cycle
         r = k + 1 - station(k)
         if (.not. min(gap(r), gap(r + 1)) - overhang*abs(gap(r) - gap(r + 1)) < 0) cycle
         if (k > max(r, first) .and. all(abs([length(k), length_before(k), k_n(k), k_s(k)] - &
                                             [length(r), length_before(r), k_n(r), k_s(r)]) <= 0)) then
            energy(:, k) = energy(:, r)
            cycle
         end if
         more = 1
         if (length_before(k) > 0) more = length(k)/length_before(k)
         energy(1, k) = 0.5_wp*(energy_before(r) + energy_before(r + 1))
         energy(2, k) = 0.5_wp*interval_energy(gap(r:r + 1), shear(r:r + 1), more*k_n(k), more*k_s(k), &
                                              limits%law_of(joint(k), logical(bonded(k))))
      end do
   end subroutine compare_energies

   !> Energy of the springs of an interval that is not bonded.
   pure real(wp) function interval_energy(gap, shear, k_n, k_s, law) result(energy)
      real(wp), intent(in) :: gap(2), shear(2)   !! [length]
      real(wp), intent(in) :: k_n, k_s           !! of one of the rows [force/length]
      type(normal_law_type), intent(in) :: law
      type(closed_part_type) :: part
      call find_closed_part(gap, [0.0_wp, 0.0_wp], law, part)
      energy = 0.5_wp*k_s*sum(shear**2) + sum(part_energies(part, 2*k_n, gap))
   end function interval_energy

   !> Of some of the edges: the length that bears before and now, the energy that springs have gained and lost since the
   !> end of the last step.
   pure subroutine add_up(first, last, nv, previous, is_taken, table, energy, sums)
      integer, intent(in) :: first, last        !! edges
      integer, intent(in) :: nv                 !! vertices
      type(contact_table_type), intent(in) :: previous
      logical, intent(in) :: is_taken(0:)
      type(contact_table_type), intent(in) :: table
      real(wp), intent(in), contiguous :: energy(:, :)     !! (2, >= rows) of `find_energies`
      real(wp), intent(inout) :: sums(4, nv)
      real(wp) :: more
      integer :: k
      sums(:, first:last) = 0
      do k = 1, table%n
         if (energy(1, k) < -1) cycle
         more = energy(2, k) - energy(1, k)
         call add(table%vertex(k), table%edge(k), [0.0_wp, table%length(k), max(more, 0.0_wp), max(-more, 0.0_wp)], &
                  first, last, nv, sums)
      end do
      do k = 1, previous%n
         if (.not. is_bearing(previous, k)) cycle
         more = 0
         if (.not. (is_taken(k) .or. previous%tied(k))) more = previous%energy(k)
         call add(previous%vertex(k), previous%edge(k), [previous%length(k), 0.0_wp, 0.0_wp, more], first, last, nv, &
                  sums)
      end do
   end subroutine add_up

   !> `add_up` where each row continues itself: a row that bears has borne, and none was lost. Many arguments: arrays
   !> of constant shape spare the place of each number.
   pure subroutine add_up_both(first, last, nv, n, vertex, edge, length, length_before, energy, sums)
      integer, intent(in) :: first, last        !! edges
      integer, intent(in) :: nv, n              !! vertices, rows
      integer, intent(in) :: vertex(n), edge(n)
      real(wp), intent(in) :: length(n), length_before(n)   !! [length]
      real(wp), intent(in) :: energy(2, n)      !! of `compare_energies`
      real(wp), intent(inout) :: sums(4, nv)
      real(wp) :: more, what(4)
      integer :: k, f, e
      sums(:, first:last) = 0
      do k = 1, n
         if (energy(1, k) < -1) cycle
         more = energy(2, k) - energy(1, k)
         what(1) = length_before(k)
         what(2) = length(k)
         what(3) = max(more, 0.0_wp)
         what(4) = what(3) - more
         f = vertex(k)
         e = edge(k)
         if (f >= first .and. f <= last) sums(:, f) = sums(:, f) + what
         if (e >= first .and. e <= last) sums(:, e) = sums(:, e) + what
      end do
   end subroutine add_up_both

   !> Add to the sums of two edges, if they are among some of the edges.
   pure subroutine add(f, e, what, first, last, nv, sums)
      integer, intent(in) :: f, e
      real(wp), intent(in) :: what(4)
      integer, intent(in) :: first, last, nv
      real(wp), intent(inout) :: sums(4, nv)
      if (f >= first .and. f <= last) sums(:, f) = sums(:, f) + what
      if (e >= first .and. e <= last) sums(:, e) = sums(:, e) + what
   end subroutine add

   !> Free the new lengths of the intervals of some of the rows.
   pure subroutine free_rows(first, last, nv, n, limits, joint, bonded, station, vertex, edge, energy, sums, gap, &
      offset, shear)
      integer, intent(in) :: first, last                   !! no interval is cut
      integer, intent(in) :: nv, n                         !! vertices, rows
      type(search_limits_type), intent(in) :: limits
      integer, intent(in) :: joint(n)
      logical(l1), intent(in) :: bonded(n)
      integer(i1), intent(in) :: station(n)
      integer, intent(in) :: vertex(n), edge(n)
      real(wp), intent(in) :: energy(2, n)                 !! of `find_energies`
      real(wp), intent(in) :: sums(4, nv)
      real(wp), intent(inout) :: gap(n), offset(n), shear(n)
      real(wp) :: growth, rise, share, shift, covered
      integer :: k, f, e
      logical :: grows, rises
      type(normal_law_type) :: law
      do k = first, last
         if (station(k) /= 1 .or. .not. energy(1, k) >= 0) cycle
         f = vertex(k)
         e = edge(k)
         rise = energy(2, k) - energy(1, k)
         rises = rise > least_growth*energy(2, k)
         grows = sums(2, f) > sums(1, f) .and. sums(2, e) > sums(1, e)
         if (.not. (rises .or. grows)) cycle
         share = 1
         if (grows) then
            if (sums(1, f) > 0 .and. sums(1, e) > 0) then
               growth = min(sums(2, f)/sums(1, f), sums(2, e)/sums(1, e))
               if (growth >= 1 + least_growth) share = 1/sqrt(growth)
            end if
         end if
         if (rises) then
            ! share of the rise at an edge that the loss at the same edge covers, of the better one of two edges
            covered = min(1.0_wp, max(sums(4, f)/sums(3, f), sums(4, e)/sums(3, e)))
            share = min(share, sqrt((energy(1, k) + rise*covered)/energy(2, k)))
         end if
         if (share >= 1) cycle
         law = limits%law_of(joint(k), logical(bonded(k)))
         shift = depth_of_energy(gap(k:k + 1), 1.0_wp, law, &
                                 share**2*interval_energy(gap(k:k + 1), [0.0_wp, 0.0_wp], 0.5_wp, 0.0_wp, law))
         offset(k:k + 1) = offset(k:k + 1) + shift
         gap(k:k + 1) = gap(k:k + 1) - shift
         shear(k:k + 1) = shear(k:k + 1)*share
      end do
   end subroutine free_rows

   !> Half of the energy of the springs of the interval of row k: at the end of the last step, and with the length and
   !> the gaps that it has now.
   pure function energies(previous, source, first, second, limits, k, table) result(e)
      type(contact_table_type), intent(in) :: previous
      integer, intent(in) :: source(:)       !! (>= rows) row of the last step that continues, 0 none
      integer, intent(in) :: first, second   !! rows of the last step on its edges, 0 none: for the stiffness
      type(search_limits_type), intent(in) :: limits
      integer, intent(in) :: k
      type(contact_table_type), intent(in) :: table
      real(wp) :: e(2), share
      integer :: i, like, r, row
      e = 0
      r = k + 1 - table%station(k)
      like = 0
      do i = r, r + 1
         row = abs(source(i))
         if (row == 0) cycle
         e(1) = e(1) + 0.5_wp*previous%energy(row)
         if (like == 0) like = row
      end do
      if (like == 0) like = first
      if (like == 0) like = second
      if (like == 0) return
      if (.not. previous%length(like) > 0) then
         e(2) = e(1)
      else
         share = table%length(k)/previous%length(like)
         e(2) = 0.5_wp*interval_energy(table%gap(r:r + 1), table%shear(r:r + 1), share*previous%k_n(like), &
                                       share*previous%k_s(like), &
                                       limits%law_of(table%joint(k), logical(table%bonded(k))))
      end if
   end function energies

   !> Is a row one of a closed interval?
   pure logical function is_bearing(table, k)
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: k
      is_bearing = is_of_interval(table, k) .and. table%state(k) /= contact_state%open
   end function is_bearing

end module rockdda_contact_new_lengths
