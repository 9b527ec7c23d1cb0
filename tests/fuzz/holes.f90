! SPDX-License-Identifier: MIT
!> Geometry files with many holes, and islands in them.
module fuzz_holes
   use fuzz_random, only : random_type
   implicit none
   private
   public :: draw_holes

   character(len=1), parameter :: nl = achar(10)
   double precision, parameter :: pi = acos(-1d0)

contains

   !> A rectangle with holes in the cells of a lattice. Of half of the files the holes have as many corners each, and
   !> are so many that the chain of the outer block, with two entries for each bridge, ends at about 64, 128, 256 or
   !> 512 entries. Some holes hold others, touch the next one or the rectangle, or are cut by joints.
   function draw_holes(random) result(text)
      type(random_type), intent(inout) :: random
      character(len=:), allocatable :: text
      character(len=:), allocatable :: rows
      double precision :: center(2), turn, radius, reach
      integer :: corners, n, n_lines, i, k, side, depth
      logical :: alike, aligned
      rows = ''
      n_lines = 0
      alike = random%chance(0.5d0)
      corners = 3 + random%below(6)
      if (alike) then
         n = (2**(6 + random%below(4)) - 4)/(corners + 2) + random%below(3) - 1
      else
         n = 1 + random%below(2**(3 + random%below(6)))
      end if
      aligned = random%chance(0.3d0)                ! the same turn and place in the cell: bridges along one line
      reach = 0.25d0
      if (random%chance(0.2d0)) reach = 0.5d0       ! neighbours may touch and overlap
      side = ceiling(sqrt(dble(n)))
      if (random%chance(0.3d0)) side = 1 + random%below(n)
      center = [dble(side), dble((n + side - 1)/side)]
      call put_ring([0d0, 0d0, center(1), 0d0, center(1), center(2), 0d0, center(2)])
      do i = 1, n
         if (.not. alike) corners = 3 + random%below(6)
         center = [mod(i - 1, side), (i - 1)/side] + 0.5d0
         turn = 0.25d0*pi
         if (.not. aligned) then
            center = center + 0.2d0*[random%unit() - 0.5d0, random%unit() - 0.5d0]
            turn = 2*pi*random%unit()
         end if
         radius = reach*(0.4d0 + 0.6d0*random%unit())
         depth = 0
         do
            call put_ring([(center + radius*[cos(turn + 2*pi*k/corners), sin(turn + 2*pi*k/corners)], k=1, corners)])
            depth = depth + 1
            if (alike .or. depth > 3 .or. .not. random%chance(0.2d0)) exit
            radius = radius*0.4d0
         end do
      end do
      if (.not. alike) then
         do i = 1, random%below(4)
            call put_line([-1d0, dble(n)*random%unit()/side, side + 1d0, dble(n)*random%unit()/side])
         end do
      end if
      text = '0.001'//nl//number(n_lines)//' 0'//nl//'0 0 0 0 0 0'//nl//rows

   contains

      !> The sides of a polygon.
      subroutine put_ring(points)
         double precision, intent(in) :: points(:)
         integer :: last, next
         do last = 1, size(points) - 1, 2
            next = mod(last + 1, size(points)) + 1
            call put_line([points(last:last + 1), points(next:next + 1)])
         end do
      end subroutine put_ring

      subroutine put_line(ends)
         double precision, intent(in) :: ends(4)
         character(len=120) :: row
         write (row, '(4(f0.6,1x),i0)') ends, 1 + random%below(3)
         rows = rows//trim(row)//nl
         n_lines = n_lines + 1
      end subroutine put_line

   end function draw_holes

   pure function number(value)
      integer, intent(in) :: value
      character(len=:), allocatable :: number
      character(len=12) :: buffer
      write (buffer, '(i0)') value
      number = trim(buffer)
   end function number

end module fuzz_holes
