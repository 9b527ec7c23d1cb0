! SPDX-License-Identifier: MIT
!> Ways to spoil an options file that keep its format: groups and assignments that come, go and change places.
module fuzz_groups
   use fuzz_random, only : random_type
   implicit none
   private
   public :: has_groups, change_groups

   !> Pieces of a text that are remembered at most.
   integer, parameter :: most = 2000

   !> Pieces text(first(i):last(i)).
   type :: pieces_type
      integer :: n = 0
      integer :: first(most) = 0, last(most) = 0
   end type pieces_type

contains

   !> Is this an options file?
   pure logical function has_groups(text)
      character(len=*), intent(in) :: text
      has_groups = index(text, '&model') > 0 .or. index(text, '&stage') > 0
   end function has_groups

   !> Spoil an options file in one way; groups and assignments also come from another file.
   subroutine change_groups(random, text, other)
      type(random_type), intent(inout) :: random
      character(len=:), allocatable, intent(inout) :: text
      character(len=*), intent(in) :: other
      type(pieces_type) :: groups
      integer :: i, k
      groups = groups_of(text)
      if (groups%n < 2) return
      i = 1 + random%below(groups%n)
      k = 1 + random%below(groups%n)
      select case (random%below(10))
      case (0, 1)
         call insert_piece(text, groups%first(i) - 1, piece_of(random, other, groups_of(other)))
      case (2)
         text = text(1:groups%first(i) - 1)//text(groups%last(i) + 1:)
      case (3)
         ! a group of the file once more, somewhere
         call insert_piece(text, groups%first(i) - 1, text(groups%first(k):groups%last(k)))
      case (4); call copy_assignment(random, text, groups, i, other)
      case (5); call copy_assignment(random, text, groups, i, text)
      case (6); call drop_assignment(random, text, groups, i)
      case default; call copy_quoted(random, text)
      end select
   end subroutine change_groups

   !> An assignment of `source` gets into group i, mostly one of a group of the same name.
   subroutine copy_assignment(random, text, groups, i, source)
      type(random_type), intent(inout) :: random
      character(len=:), allocatable, intent(inout) :: text
      type(pieces_type), intent(in) :: groups
      integer, intent(in) :: i
      character(len=*), intent(in) :: source
      type(pieces_type) :: others
      character(len=:), allocatable :: group, name
      integer :: attempt
      name = name_of(text(groups%first(i):groups%last(i)))
      others = groups_of(source)
      do attempt = 1, 8
         group = piece_of(random, source, others)
         if (name_of(group) == name .or. random%chance(0.1d0)) exit
      end do
      ! in front of the slash
      call insert_piece(text, groups%last(i) - 1, ', '//piece_of(random, group, assignments_of(group)))
   end subroutine copy_assignment

   !> An assignment of group i goes.
   subroutine drop_assignment(random, text, groups, i)
      type(random_type), intent(inout) :: random
      character(len=:), allocatable, intent(inout) :: text
      type(pieces_type), intent(in) :: groups
      integer, intent(in) :: i
      type(pieces_type) :: found
      integer :: k, first
      first = groups%first(i)
      found = assignments_of(text(first:groups%last(i)))
      if (found%n == 0) return
      k = 1 + random%below(found%n)
      text = text(1:first + found%first(k) - 2)//text(first + found%last(k):)
   end subroutine drop_assignment

   !> A text in quotes takes the place of another.
   subroutine copy_quoted(random, text)
      type(random_type), intent(inout) :: random
      character(len=:), allocatable, intent(inout) :: text
      type(pieces_type) :: quoted
      integer :: i, k
      quoted = quoted_of(text)
      if (quoted%n == 0) return
      i = 1 + random%below(quoted%n)
      k = 1 + random%below(quoted%n)
      text = text(1:quoted%first(i) - 1)//text(quoted%first(k):quoted%last(k))//text(quoted%last(i) + 1:)
   end subroutine copy_quoted

   !> Put a piece behind this place.
   subroutine insert_piece(text, place, piece)
      character(len=:), allocatable, intent(inout) :: text
      integer, intent(in) :: place
      character(len=*), intent(in) :: piece
      text = text(1:place)//piece//' '//text(place + 1:)
   end subroutine insert_piece

   !> Some piece; empty when there is none.
   function piece_of(random, text, pieces) result(piece)
      type(random_type), intent(inout) :: random
      character(len=*), intent(in) :: text
      type(pieces_type), intent(in) :: pieces
      character(len=:), allocatable :: piece
      integer :: i
      piece = ''
      if (pieces%n == 0) return
      i = 1 + random%below(pieces%n)
      piece = text(pieces%first(i):pieces%last(i))
   end function piece_of

   !> Name of a group, with its ampersand.
   pure function name_of(group) result(name)
      character(len=*), intent(in) :: group
      character(len=:), allocatable :: name
      integer :: n
      n = scan(group//' ', ' '//achar(9)//achar(10)//achar(13)) - 1
      name = group(1:n)
   end function name_of

   !> Groups, from the ampersand to the slash.
   pure type(pieces_type) function groups_of(text) result(groups)
      character(len=*), intent(in) :: text
      character(len=1) :: quote
      integer :: i, first
      quote = ' '
      first = 0
      do i = 1, len(text)
         if (quote /= ' ') then
            if (text(i:i) == quote) quote = ' '
         else if (scan(text(i:i), '''"') > 0) then
            quote = text(i:i)
         else if (text(i:i) == '&') then
            first = i
         else if (text(i:i) == '/' .and. first > 0 .and. groups%n < most) then
            groups%n = groups%n + 1
            groups%first(groups%n) = first
            groups%last(groups%n) = i
            first = 0
         end if
      end do
   end function groups_of

   !> Assignments of a group, without the comma behind them.
   pure type(pieces_type) function assignments_of(group) result(found)
      character(len=*), intent(in) :: group
      character(len=1) :: quote
      integer :: i, k
      quote = ' '
      do i = 1, len(group)
         if (quote /= ' ') then
            if (group(i:i) == quote) quote = ' '
         else if (scan(group(i:i), '''"') > 0) then
            quote = group(i:i)
         else if (group(i:i) == '=' .and. found%n < most) then
            k = i - 1
            do while (k > 1)
               if (group(k:k) /= ' ') exit
               k = k - 1
            end do
            k = scan(group(1:k), ' ,'//achar(9)//achar(10)//achar(13), back=.true.) + 1
            if (found%n > 0) found%last(found%n) = end_of(group(1:k - 1))
            found%n = found%n + 1
            found%first(found%n) = k
            found%last(found%n) = max(k, end_of(group(1:len(group) - 1)))
         end if
      end do
   end function assignments_of

   !> Last character that is no blank and no comma.
   pure integer function end_of(text)
      character(len=*), intent(in) :: text
      end_of = verify(text, ' ,'//achar(9)//achar(10)//achar(13), back=.true.)
   end function end_of

   !> Texts between quotes, without these.
   pure type(pieces_type) function quoted_of(text) result(quoted)
      character(len=*), intent(in) :: text
      integer :: i, first
      first = 0
      do i = 1, len(text)
         if (text(i:i) /= '''') cycle
         if (first == 0) then
            first = i + 1
         else
            if (quoted%n < most) then
               quoted%n = quoted%n + 1
               quoted%first(quoted%n) = first
               quoted%last(quoted%n) = i - 1
            end if
            first = 0
         end if
      end do
   end function quoted_of

end module fuzz_groups
