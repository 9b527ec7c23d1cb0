! SPDX-License-Identifier: MIT
!> Joints that come to bear on more of their edges: springs that grow while they are compressed keep their energy.
module rockdda_contact_new_lengths
   use rockdda_base_kinds, only : wp
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
      real(wp), allocatable :: stored(:, :)          !! (2, >= rows) energy of each row before and now [energy]
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
   pure subroutine free_new_lengths(previous, source, is_taken, pressed, work, table)
      type(contact_table_type), intent(in) :: previous
      integer, intent(in) :: source(:)          !! (>= rows) row of the last step that goes on, 0 none
      logical, intent(in) :: is_taken(0:)       !! (>= rows of the last step) it goes on
      integer, intent(in) :: pressed(:)         !! (nv) row of the last step that is compressed most, of each edge
      type(new_lengths_type), intent(inout) :: work
      type(contact_table_type), intent(inout) :: table
      real(wp) :: growth, rise(2), share, shift
      integer :: k
      call add_lengths(previous, work%before)
      call add_lengths(table, work%now)
      if (allocated(work%stored)) then
         if (size(work%stored, 2) < table%n) deallocate (work%stored)
      end if
      if (.not. allocated(work%stored)) allocate (work%stored(2, table%n + table%n/4))
      call add_energies(previous, source, is_taken, pressed, table, work%stored, work%gained, work%lost)
      do k = 1, table%n
         if (.not. is_compressed(table, k)) cycle
         associate (f => table%vertex(k), e => table%edge(k))
            share = 1
            if (min(work%before(f), work%before(e)) > 0) then
               growth = min(work%now(f)/work%before(f), work%now(e)/work%before(e))
               if (growth >= 1 + least_growth) share = 1/sqrt(growth)
            end if
            rise = work%stored(:, k)
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

   end subroutine free_new_lengths

   !> Length of each edge that bears.
   pure subroutine add_lengths(table, length)
      type(contact_table_type), intent(in) :: table
      real(wp), intent(inout) :: length(:)   !! (nv)
      integer :: k
      length = 0
      do k = 1, table%n
         if (.not. is_bearing(table, k)) cycle
         length(table%vertex(k)) = length(table%vertex(k)) + table%length(k)
         length(table%edge(k)) = length(table%edge(k)) + table%length(k)
      end do
   end subroutine add_lengths

   !> Energy that the springs of each edge have gained and lost since the end of the last step.
   pure subroutine add_energies(previous, source, is_taken, pressed, table, energy, gained, lost)
      type(contact_table_type), intent(in) :: previous
      integer, intent(in) :: source(:)
      logical, intent(in) :: is_taken(0:)
      integer, intent(in) :: pressed(:)
      type(contact_table_type), intent(in) :: table
      real(wp), intent(inout) :: energy(:, :)         !! (2, >= rows) of compressed rows, before and now
      real(wp), intent(inout) :: gained(:), lost(:)   !! (nv)
      real(wp) :: e(2)
      integer :: k
      gained = 0
      lost = 0
      do k = 1, table%n
         if (.not. is_compressed(table, k)) cycle
         e = energies(previous, abs(source(k)), pressed(table%vertex(k)), pressed(table%edge(k)), k, table)
         energy(:, k) = e
         if (e(2) > e(1)) then
            gained(table%vertex(k)) = gained(table%vertex(k)) + (e(2) - e(1))
            gained(table%edge(k)) = gained(table%edge(k)) + (e(2) - e(1))
         else
            lost(table%vertex(k)) = lost(table%vertex(k)) + (e(1) - e(2))
            lost(table%edge(k)) = lost(table%edge(k)) + (e(1) - e(2))
         end if
      end do
      do k = 1, previous%n
         if (is_taken(k) .or. .not. is_bearing(previous, k) .or. previous%tied(k)) cycle
         lost(previous%vertex(k)) = lost(previous%vertex(k)) + stored(previous, k)
         lost(previous%edge(k)) = lost(previous%edge(k)) + stored(previous, k)
      end do
   end subroutine add_energies

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

   !> Is it one of a joint that is compressed?
   pure logical function is_compressed(table, k)
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: k
      is_compressed = is_bearing(table, k) .and. .not. table%tied(k) .and. table%gap(k) < 0
   end function is_compressed

end module rockdda_contact_new_lengths
