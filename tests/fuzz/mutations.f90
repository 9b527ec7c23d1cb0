! SPDX-License-Identifier: MIT
!> Ways to spoil a file.
module fuzz_mutations
   use fuzz_groups, only : change_groups, has_groups
   use fuzz_random, only : random_type
   implicit none
   private
   public :: mutate_text, mutate_bytes

   character(len=1), parameter :: nl = achar(10)
   character(len=*), parameter :: blanks = ' ,'//achar(9)//achar(10)//achar(13)
   !> A mutated file is not longer than this.
   integer, parameter :: longest = 300000

   !> Numbers that are hard to digest.
   character(len=*), parameter :: extremes(58) = [character(len=24) :: &
      '1e308', '-1e308', '1e309', '1.7976931348623157e308', '1e-308', '4.9e-324', '1e-400', '1d400', '1e99999999999', &
      '-0', '-0.0', '0', '0.0', 'nan', 'inf', '-inf', 'infinity', '1000000000', '2147483647', '2147483648', &
      '-2147483648', '-1', '9223372036854775807', '99999999999999999999', '1e9', '1e60', '1e61', '-1e60', '1e-60', &
      '1e-300', '1e300', '1e154', '1e155', '1e30', '1e15', '1e16', '0.5', '1', '2', '3', '90', '89.999999', &
      '0.4999999', '1e-12', '1e+', '1e', '.', '+', '-', '--1', '0x10', '1_000', '1,5', '3*1.0', '1000000*1', &
      '1000000000*1', '1/3', '١٢٣']

   !> Words of the formats.
   character(len=*), parameter :: words(92) = [character(len=24) :: &
      '&run', '&time', '&contact', '&solver', '&material', '&load', '&line_load', '&joint_law', '&block_damping', &
      '&stage', '&output', '/', '&end', '$run', 'title', 'steps =', 't_end =', 'save_every =', 'save_dt =', &
      'threads =', 'dt_max =', 'dt_min =', 'k01 =', 'displacement_ratio =', 'cut_factor =', 'max_open_close =', &
      'stiffness =', 'search_factor =', 'angle_tolerance =', 'preset = ''dda_windows''', 'method = ''sor''', &
      'method = ''dense''', 'method = ''pcg''', 'method = ''cholmod''', 'tolerance =', 'omega =', 'gravity =', &
      'base_acceleration =', 'mass = ''area''', 'rotation = ''linear''', 'law =', 'damping_ratio =', &
      'until_step =', 'until_time =', 'release =', 'ends =', '''', '"', '=', ',', '!', '#', '(', '%', &
      'blocks', 'vertices', 'end', 'block', 'point', 'bolt', 'fixed', 'loading', 'measured', '<xml>', &
      '.true.', '&boundary', '&model', '&block_material', '&joint_material', '&change', '&region', '&subdivide', &
      '&in_situ', '&water', '&quake', '&fixed_point', '&loading_point', 'until = ''equilibrium''', 'excavate =', &
      'place =', 'relax =', 'relax_steps =', 'reset_displacement =', 'on_failure =', 'max_steps =', 'duration =', &
      'kind = ''free_field''', 'kind = ''viscous''', 'surface =', 'profile =', 'level =', 'record =']

contains

   !> Spoil a text in one to five ways; `other` is another file to splice with. Half of the texts keep their format:
   !> only numbers change in them. Of options files more than half keep theirs: groups, assignments and numbers change.
   subroutine mutate_text(random, text, other)
      type(random_type), intent(inout) :: random
      character(len=:), allocatable, intent(inout) :: text
      character(len=*), intent(in) :: other
      logical :: gentle, grouped
      integer :: i, n
      gentle = random%chance(0.5d0)
      grouped = has_groups(text)
      if (grouped) grouped = random%chance(0.6d0)
      do n = 1, 4
         if (.not. random%chance(0.45d0)) exit
      end do
      do i = 1, n
         if (grouped .and. random%chance(0.7d0)) then
            call change_groups(random, text, other)
         else if (gentle .or. grouped) then
            call change_number(random, text)
         else
            call mutate_once(random, text, other)
         end if
         if (len(text) > longest) text = text(1:longest)
      end do
   end subroutine mutate_text

   !> A number changes, the format holds.
   subroutine change_number(random, text)
      type(random_type), intent(inout) :: random
      character(len=:), allocatable, intent(inout) :: text
      select case (random%below(25))
      case (0); call scale_rows(random, text)
      case (1); call move_vertices(random, text)
      case (2:12); call bend_number(random, text)
      case (13:20); call copy_number(random, text)
      case default; call replace_number(random, text)
      end select
   end subroutine change_number

   !> One way to spoil a text; numbers are met most often, because there the format still holds.
   subroutine mutate_once(random, text, other)
      type(random_type), intent(inout) :: random
      character(len=:), allocatable, intent(inout) :: text
      character(len=*), intent(in) :: other
      integer :: first, last, at, n
      character(len=:), allocatable :: piece
      select case (random%below(34))
      case (0:5); call replace_number(random, text)
      case (6:9); call bend_number(random, text)
      case (10:12); call copy_token(random, text)
      case (13, 14)
         call pick_token(random, text, first, last)
         at = 1 + random%below(size(words))
         if (last >= first) text = text(1:first - 1)//trim(words(at))//text(last + 1:)
      case (15)
         call pick_token(random, text, first, last)
         if (last >= first) text = text(1:first - 1)//text(last + 1:)
      case (16, 17)
         call pick_line(random, text, first, last)
         text = text(1:first - 1)//text(last + 1:)
      case (18, 19)
         call pick_line(random, text, first, last)
         text = text(1:last)//text(first:)
      case (20, 21); call swap_lines(random, text)
      case (22)
         at = random%below(len(text) + 1)
         text = text(1:at)
      case (23)
         at = random%below(len(text) + 1)
         n = random%below(len(other) + 1)
         text = text(1:at)//other(n + 1:)
      case (24); call flip_bytes(random, text)
      case (25)
         at = random%below(len(text) + 1)
         piece = garbage(random)
         text = text(1:at)//piece//text(at + 1:)
      case (26)
         at = random%below(len(text) + 1)
         n = random%below(40)
         text = text(1:at)//text(min(at + n, len(text)) + 1:)
      case (27); call change_system(random, text)
      case (28)
         at = 0
         if (random%chance(0.3d0)) at = random%below(len(text) + 1)
         text = text(1:at)//char(239)//char(187)//char(191)//text(at + 1:)
      case (29)
         ! again and again
         call pick_line(random, text, first, last)
         n = 2**random%below(11)
         n = max(1, min(n, (longest - len(text))/max(1, last - first + 1)))
         text = text(1:last)//repeat(text(first:last), n)//text(last + 1:)
      case (30)
         call pick_token(random, text, first, last)
         piece = text(first:last)
         n = max(1, min(2**random%below(14), (longest - len(text))/max(1, len(piece))))
         text = text(1:last)//repeat(piece, n)//text(last + 1:)
      case (31)
         ! one long line
         do at = 1, len(text)
            if (text(at:at) == nl) text(at:at) = ' '
         end do
      case (32)
         at = random%below(len(text) + 1)
         n = 2**random%below(17)
         text = text(1:at)//repeat(' ', n)//text(at + 1:)
      case default
         call pick_token(random, text, first, last)
         at = 1 + random%below(size(words))
         n = 1 + random%below(size(extremes))
         if (last >= first) text = text(1:last)//' '//trim(words(at))//' '//trim(extremes(n))//' '//text(last + 1:)
      end select
   end subroutine mutate_once

   !> Spoil a binary file in one to four ways.
   subroutine mutate_bytes(random, text, other)
      type(random_type), intent(inout) :: random
      character(len=:), allocatable, intent(inout) :: text
      character(len=*), intent(in) :: other
      character(len=8), parameter :: eights(6) = [repeat(char(255), 8), repeat(char(0), 8), &
         char(255)//char(255)//char(255)//char(127)//repeat(char(0), 4), repeat(char(0), 7)//char(128), &
         char(0)//char(202)//char(154)//char(59)//repeat(char(0), 4), repeat(char(0), 6)//char(248)//char(127)]
      integer :: at, from, n, i, ways
      ways = 1 + random%below(4)
      do i = 1, ways
         at = random%below(len(text))
         ! the heads of the format are small and near the beginning
         if (random%chance(0.4d0)) at = random%below(min(len(text), 4096))
         n = min(1 + random%below(64), len(text) - at)
         select case (random%below(9))
         case (0:2)
            call flip_bytes(random, text)
         case (3:4)
            n = min(8, n)
            from = 1 + random%below(size(eights))
            if (n == 8) text(at + 1:at + 8) = eights(from)
         case (5)
            if (n > 0) text(at + 1:at + n) = repeat(char(0), n)
         case (6)
            from = random%below(max(1, len(text) - n))
            if (n > 0) text(at + 1:at + n) = text(from + 1:from + n)
         case (7)
            text = text(1:at)
         case default
            from = random%below(len(other) + 1)
            if (random%chance(0.5d0)) then
               text = text(1:at)//other(min(at, len(other)) + 1:)
            else
               text = text//other(from + 1:)
            end if
         end select
         if (len(text) == 0) return
      end do
   end subroutine mutate_bytes

   !> A number becomes an extreme one.
   subroutine replace_number(random, text)
      type(random_type), intent(inout) :: random
      character(len=:), allocatable, intent(inout) :: text
      integer :: first, last, which
      call pick_number(random, text, first, last)
      which = 1 + random%below(size(extremes))
      if (last >= first) text = text(1:first - 1)//trim(extremes(which))//text(last + 1:)
   end subroutine replace_number

   !> A number changes a little, or in sign or size, and stays a number.
   subroutine bend_number(random, text)
      type(random_type), intent(inout) :: random
      character(len=:), allocatable, intent(inout) :: text
      character(len=32) :: buffer
      double precision :: value
      integer :: first, last, status
      call pick_number(random, text, first, last)
      if (last < first .or. last - first > 30) return
      read (text(first:last), *, iostat=status) value
      if (status /= 0) return
      ! the value may be anything: no arithmetic that overflows
      if (.not. abs(value) < 1d200) return
      select case (random%below(9))
      case (0); value = -value
      case (1); value = value*10d0**(random%below(13) - 6)
      case (2); value = value + 1
      case (3); value = value - 1
      case (4); value = value*(1 + 1d-9*(random%below(3) - 1))
      case (5); value = value + 1d-3*(random%unit() - 0.5d0)
      case (6); value = value*random%unit()
      case (7); value = anint(value)
      case default; value = value*10d0**(random%below(101) - 50)
      end select
      if (abs(value) < 1d9 .and. value - anint(value) <= 0 .and. value - anint(value) >= 0) then
         write (buffer, '(i0)') nint(value)
      else
         write (buffer, '(es24.16e3)') value
      end if
      text = text(1:first - 1)//trim(adjustl(buffer))//text(last + 1:)
   end subroutine bend_number

   !> Another unit: the first four numbers of every row of five or more, and the first number of the file, times a
   !> power of ten.
   subroutine scale_rows(random, text)
      type(random_type), intent(inout) :: random
      character(len=:), allocatable, intent(inout) :: text
      character(len=:), allocatable :: scaled, row
      character(len=200) :: buffer
      double precision :: values(5), factor
      integer :: first, last, n, status
      factor = 10d0**(random%below(101) - 50)
      if (random%chance(0.5d0)) factor = 10d0**(random%below(600) - 300)
      scaled = ''
      first = 1
      do while (first <= len(text))
         n = index(text(first:), nl)
         last = merge(len(text), first + n - 1, n == 0)
         row = text(first:last)
         values = 0
         read (row, *, iostat=status) values
         buffer = ''
         if (status == 0 .and. all(abs(values(1:4)) < 1d5)) then
            write (buffer, '(4(es24.16e3,1x),es24.16e3)') values(1:4)*factor, values(5)
         else if (first == 1) then
            read (row, *, iostat=status) values(1)
            if (status == 0 .and. abs(values(1)) < 1d5) write (buffer, '(es24.16e3)') values(1)*factor
         end if
         if (len_trim(buffer) > 0) row = trim(buffer)//nl
         scaled = scaled//row
         first = last + 1
      end do
      text = scaled
   end subroutine scale_rows

   !> The vertices of a block file (rows of three numbers) far from the origin, and some or all of their edges
   !> bridges.
   subroutine move_vertices(random, text)
      type(random_type), intent(inout) :: random
      character(len=:), allocatable, intent(inout) :: text
      character(len=:), allocatable :: moved, row
      character(len=80) :: buffer
      double precision :: values(3), shift, share
      integer :: first, last, n, status
      shift = 10d0**random%below(16)
      share = random%unit()*merge(2d0, 0.1d0, random%chance(0.5d0))
      moved = ''
      first = 1
      do while (first <= len(text))
         n = index(text(first:), nl)
         last = merge(len(text), first + n - 1, n == 0)
         row = text(first:last)
         read (row, *, iostat=status) values
         if (status == 0 .and. all(abs(values) < 1d9)) then
            if (random%chance(share)) values(3) = 0
            write (buffer, '(2(es24.16e3,1x),i0)') values(1:2) + shift, nint(values(3))
            row = trim(buffer)//nl
         end if
         moved = moved//row
         first = last + 1
      end do
      text = moved
   end subroutine move_vertices

   !> A number takes the place of another.
   subroutine copy_number(random, text)
      type(random_type), intent(inout) :: random
      character(len=:), allocatable, intent(inout) :: text
      integer :: first, last, from, to
      call pick_number(random, text, first, last)
      call pick_number(random, text, from, to)
      if (last >= first .and. to >= from) text = text(1:first - 1)//text(from:to)//text(last + 1:)
   end subroutine copy_number

   !> A token takes the place of another, or both exchange theirs: numbers that agree, lines on lines.
   subroutine copy_token(random, text)
      type(random_type), intent(inout) :: random
      character(len=:), allocatable, intent(inout) :: text
      integer :: first, last, from, to
      logical :: exchange
      call pick_token(random, text, first, last)
      call pick_token(random, text, from, to)
      if (last < first .or. to < from) return
      exchange = random%chance(0.5d0)
      if (exchange .and. last < from) then
         text = text(1:first - 1)//text(from:to)//text(last + 1:from - 1)//text(first:last)//text(to + 1:)
      else
         text = text(1:first - 1)//text(from:to)//text(last + 1:)
      end if
   end subroutine copy_token

   !> Two lines exchange their places.
   subroutine swap_lines(random, text)
      type(random_type), intent(inout) :: random
      character(len=:), allocatable, intent(inout) :: text
      integer :: first, last, from, to
      call pick_line(random, text, first, last)
      call pick_line(random, text, from, to)
      if (last >= from) return
      text = text(1:first - 1)//text(from:to)//text(last + 1:from - 1)//text(first:last)//text(to + 1:)
   end subroutine swap_lines

   !> Some bytes change.
   subroutine flip_bytes(random, text)
      type(random_type), intent(inout) :: random
      character(len=*), intent(inout) :: text
      integer :: i, at
      if (len(text) == 0) return
      do i = 1, 1 + random%below(4)
         at = 1 + random%below(len(text))
         if (random%chance(0.5d0)) then
            text(at:at) = char(ieor(ichar(text(at:at)), 2**random%below(8)))
         else
            text(at:at) = char(random%below(256))
         end if
      end do
   end subroutine flip_bytes

   !> Bytes that are no text of any encoding, or text of another one.
   function garbage(random) result(piece)
      type(random_type), intent(inout) :: random
      character(len=:), allocatable :: piece
      integer :: i
      select case (random%below(5))
      case (0); piece = repeat(char(0), 1 + random%below(4))
      case (1); piece = 'Größe µ – “x” ﹟ １２'
      case (2); piece = char(228)//char(246)//char(252)//char(128)//char(192)
      case (3); piece = achar(27)//'[31m'//achar(8)//achar(7)//achar(13)//achar(12)
      case default
         piece = repeat(' ', 1 + random%below(60))
         do i = 1, len(piece)
            piece(i:i) = char(random%below(256))
         end do
      end select
   end function garbage

   !> Line ends and encodings of other systems.
   subroutine change_system(random, text)
      type(random_type), intent(inout) :: random
      character(len=:), allocatable, intent(inout) :: text
      integer :: i
      select case (random%below(4))
      case (0); call use_crlf(text)
      case (1)
         do i = 1, len(text)
            if (text(i:i) == nl) text(i:i) = achar(13)
         end do
      case (2); call use_utf_16(text)
      case (3); text = text//achar(26)
      end select
   end subroutine change_system

   !> UTF-16 with a mark.
   subroutine use_utf_16(text)
      character(len=:), allocatable, intent(inout) :: text
      character(len=:), allocatable :: longer
      integer :: i
      longer = repeat(achar(0), 2*len(text))
      do i = 1, len(text)
         longer(2*i - 1:2*i - 1) = text(i:i)
      end do
      text = char(255)//char(254)//longer
   end subroutine use_utf_16

   !> CR LF at each line end.
   subroutine use_crlf(text)
      character(len=:), allocatable, intent(inout) :: text
      character(len=:), allocatable :: longer
      integer :: i, n
      longer = repeat(' ', 2*len(text))
      n = 0
      do i = 1, len(text)
         if (text(i:i) == nl) then
            n = n + 1
            longer(n:n) = achar(13)
         end if
         n = n + 1
         longer(n:n) = text(i:i)
      end do
      text = longer(1:n)
   end subroutine use_crlf

   !> Some token, at text(first:last); none when last < first.
   subroutine pick_token(random, text, first, last)
      type(random_type), intent(inout) :: random
      character(len=*), intent(in) :: text
      integer, intent(out) :: first, last
      first = 1
      last = 0
      if (len(text) == 0) return
      ! the counts stand at the beginning
      first = 1 + random%below(len(text))
      if (random%chance(0.25d0)) first = 1 + random%below(min(len(text), 60))
      do while (first < len(text) .and. scan(text(first:first), blanks) > 0)
         first = first + 1
      end do
      if (scan(text(first:first), blanks) > 0) return
      do while (first > 1)
         if (scan(text(first - 1:first - 1), blanks) > 0) exit
         first = first - 1
      end do
      last = scan(text(first:), blanks)
      last = merge(len(text), first + last - 2, last == 0)
   end subroutine pick_token

   !> Some token that begins as a number does, if one is found soon.
   subroutine pick_number(random, text, first, last)
      type(random_type), intent(inout) :: random
      character(len=*), intent(in) :: text
      integer, intent(out) :: first, last
      integer :: i
      do i = 1, 20
         call pick_token(random, text, first, last)
         if (last < first) cycle
         if (scan(text(first:first), '0123456789.-+') > 0) return
      end do
      last = first - 1
   end subroutine pick_number

   !> Some line with its line end.
   subroutine pick_line(random, text, first, last)
      type(random_type), intent(inout) :: random
      character(len=*), intent(in) :: text
      integer, intent(out) :: first, last
      first = 1
      last = 0
      if (len(text) == 0) return
      first = 1 + random%below(len(text))
      last = index(text(first:), nl)
      last = merge(len(text), first + last - 1, last == 0)
      if (first > 1) first = index(text(1:first - 1), nl, back=.true.) + 1
   end subroutine pick_line

end module fuzz_mutations
