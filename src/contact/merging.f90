! SPDX-License-Identifier: MIT
!> The contact table of all blocks from that of a step, which leaves out pairs of resting blocks, and the last one.
module rockdda_contact_merging
   use rockdda_contact_table, only : contact_table_type
   implicit none
   private
   public :: merge_resting

contains

   !> Replace the table of the last step by that of this step and, between resting blocks, the rows of the last one.
   subroutine merge_resting(step, resting, last, room)
      type(contact_table_type), intent(in) :: step       !! rows of all pairs of which one block does not rest
      logical, intent(in) :: resting(:)                  !! (blocks)
      type(contact_table_type), intent(inout) :: last
      type(contact_table_type), intent(inout) :: room    !! scratch
      integer, allocatable :: from_step(:), from_last(:)
      integer :: c, k, n
      logical :: takes_last
      allocate (from_step(step%n), from_last(last%n), source=0)
      n = step%n
      do c = 1, last%n
         if (rests(c)) n = n + 1
      end do
      call room%resize(n)
      c = 1
      k = 1
      do n = 1, room%n
         do while (c <= last%n)
            if (rests(c)) exit
            c = c + 1
         end do
         takes_last = k > step%n
         if (.not. takes_last .and. c <= last%n) takes_last = comes_before(last, c, step, k)
         if (takes_last) then
            call room%take_row(n, last, c)
            from_last(c) = n
            c = c + 1
         else
            call room%take_row(n, step, k)
            from_step(k) = n
            k = k + 1
         end if
      end do
      ! partners are rows of the same blocks
      do k = 1, step%n
         if (step%partner(k) > 0) room%partner(from_step(k)) = from_step(step%partner(k))
      end do
      do c = 1, last%n
         if (from_last(c) == 0) cycle
         if (last%partner(c) > 0) room%partner(from_last(c)) = from_last(last%partner(c))
      end do
      call last%exchange(room)

   contains

      !> Is a row of the last step one between two resting blocks?
      pure logical function rests(row)
         integer, intent(in) :: row
         rests = resting(last%block_a(row)) .and. resting(last%block_b(row))
      end function rests

   end subroutine merge_resting

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
