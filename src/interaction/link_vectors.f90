! SPDX-License-Identifier: MIT
!> Vectors of a link: the derivatives of its elongations along two lines with respect to the unknowns of its blocks.
!>
!> The line of a force is the same for both blocks, and the second line is the first one turned by 90 degrees. With n
!> the direction of the first line the vectors are
!>
!>                   first block a               second block b
!>     line 1        [ n1   n2   a(3:6, 1)]      [-n1  -n2   b(3:6, 1)]
!>     line 2        [-n2   n1   a(3:6, 2)]      [ n2  -n1   b(3:6, 2)]
!>
!> Of these 24 numbers 18 are stored: n, a(3:6, 1), a(3:6, 2), b(3:6, 1), b(3:6, 2).
module rockdda_interaction_link_vectors
   use rockdda_base_kinds, only : wp
   implicit none
   private
   public :: link_numbers, pack_vectors, unpack_vectors, elongations, many_elongations
   public :: add_stiffness, add_loads, add_forces, add_force

   !> Numbers that are stored of a link.
   integer, parameter :: link_numbers = 18

contains

   !> Store the vectors of a link. A line of which the link has neither stiffness nor force may have any.
   pure subroutine pack_vectors(a, b, p)
      real(wp), intent(in) :: a(6, 2), b(6, 2)   !! of the first and the second block
      real(wp), intent(out) :: p(link_numbers)
      p(1:2) = a(1:2, 1)
      p(3:6) = a(3:6, 1)
      p(7:10) = a(3:6, 2)
      p(11:14) = b(3:6, 1)
      p(15:18) = b(3:6, 2)
   end subroutine pack_vectors

   !> The vectors of the first block of a link, or of the second one.
   pure subroutine unpack_vectors(p, is_first, v)
      real(wp), intent(in) :: p(link_numbers)
      logical, intent(in) :: is_first
      real(wp), intent(out) :: v(6, 2)
      real(wp) :: side
      integer :: k
      side = merge(1.0_wp, -1.0_wp, is_first)
      k = merge(0, 8, is_first)
      v(1, 1) = side*p(1)
      v(2, 1) = side*p(2)
      v(3:6, 1) = p(k + 3:k + 6)
      v(1, 2) = -side*p(2)
      v(2, 2) = side*p(1)
      v(3:6, 2) = p(k + 7:k + 10)
   end subroutine unpack_vectors

   !> Elongations of a link along its two lines, for the unknowns of its blocks: sums of six, which a register of two
   !> numbers adds up.
   pure subroutine elongations(p, xa, xb, along)
      real(wp), intent(in) :: p(link_numbers)
      real(wp), intent(in) :: xa(6), xb(6)
      real(wp), intent(out) :: along(2)
      real(wp) :: t(2), n(2)
      n = p(1:2)
      t = ((n*xa(1:2) + p(3:4)*xa(3:4)) + p(5:6)*xa(5:6)) + ((-n*xb(1:2) + p(11:12)*xb(3:4)) + p(13:14)*xb(5:6))
      along(1) = t(1) + t(2)
      n = [-p(2), p(1)]
      t = ((n*xa(1:2) + p(7:8)*xa(3:4)) + p(9:10)*xa(5:6)) + ((-n*xb(1:2) + p(15:16)*xb(3:4)) + p(17:18)*xb(5:6))
      along(2) = t(1) + t(2)
   end subroutine elongations

   !> Elongations of links with two blocks, one after the other.
   pure subroutine many_elongations(vectors, pair, x, along)
      real(wp), intent(in), contiguous :: vectors(:, :)   !! (link_numbers, n)
      integer, intent(in), contiguous :: pair(:, :)       !! (2, n) their blocks
      real(wp), intent(in), contiguous :: x(:, :)         !! (6, nb)
      real(wp), intent(inout), contiguous :: along(:, :)  !! (2, n)
      integer :: l
      do l = 1, size(along, 2)
         call elongations(vectors(:, l), x(:, pair(1, l)), x(:, pair(2, l)), along(:, l))
      end do
   end subroutine many_elongations

   !> Stiffness of the links of block i, added to its diagonal block and to its couplings with blocks of larger numbers.
   pure subroutine add_stiffness(i, incident, pair, slot, vectors, stiffness, diagonal, values)
      integer, intent(in) :: i
      integer, intent(in), contiguous :: incident(:)            !! its links, < 0: as their second block
      integer, intent(in), contiguous :: pair(:, :)             !! (2, links)
      integer, intent(in), contiguous :: slot(:)                !! (links) stored block of each pair, 0 none
      real(wp), intent(in), contiguous :: vectors(:, :)         !! (link_numbers, links)
      real(wp), intent(in), contiguous :: stiffness(:, :)       !! (2, links)
      real(wp), intent(inout) :: diagonal(6, 6)
      real(wp), intent(inout), contiguous :: values(:, :, :)    !! (6, 6, stored blocks)
      integer :: c, l
      logical :: is_first
      do l = 1, size(incident)
         c = abs(incident(l))
         if (.not. (abs(stiffness(1, c)) > 0 .or. abs(stiffness(2, c)) > 0)) cycle
         is_first = incident(l) > 0
         call add_diagonal(vectors(:, c), is_first, stiffness(:, c), diagonal)
         if (slot(c) > 0 .and. i < pair(merge(2, 1, is_first), c)) &
            call add_coupling(vectors(:, c), is_first, stiffness(:, c), values(:, :, slot(c)))
      end do
   end subroutine add_stiffness

   !> d += k1 v1 v1^T + k2 v2 v2^T, at least its lower half, v the vectors of one of the blocks.
   pure subroutine add_diagonal(p, is_first, k, d)
      real(wp), intent(in) :: p(link_numbers)
      logical, intent(in) :: is_first
      real(wp), intent(in) :: k(2)
      real(wp), intent(inout) :: d(6, 6)
      real(wp) :: n(2), t(2), a, b
      integer :: i, j
      call unpack_lines(p, is_first, n, t, i)
      do j = 1, 2
         a = k(1)*n(j)
         b = k(2)*t(j)
         d(1:2, j) = d(1:2, j) + (a*n + b*t)
         d(3:6, j) = d(3:6, j) + (a*p(i + 1:i + 4) + b*p(i + 5:i + 8))
      end do
      do j = 1, 2
         a = k(1)*p(i + j)
         b = k(2)*p(i + 4 + j)
         d(3:6, 2 + j) = d(3:6, 2 + j) + (a*p(i + 1:i + 4) + b*p(i + 5:i + 8))
      end do
      do j = 3, 4
         a = k(1)*p(i + j)
         b = k(2)*p(i + 4 + j)
         d(5:6, 2 + j) = d(5:6, 2 + j) + (a*p(i + 3:i + 4) + b*p(i + 7:i + 8))
      end do
   end subroutine add_diagonal

   !> m += k1 v1 w1^T + k2 v2 w2^T, v the vectors of one of the blocks, w those of the other one.
   pure subroutine add_coupling(p, is_first, k, m)
      real(wp), intent(in) :: p(link_numbers)
      logical, intent(in) :: is_first
      real(wp), intent(in) :: k(2)
      real(wp), intent(inout) :: m(6, 6)
      real(wp) :: n(2), t(2), a, b
      integer :: i, j, other
      call unpack_lines(p, is_first, n, t, i)
      other = merge(10, 2, is_first)
      do j = 1, 2
         a = -(k(1)*n(j))
         b = -(k(2)*t(j))
         m(1:2, j) = m(1:2, j) + (a*n + b*t)
         m(3:6, j) = m(3:6, j) + (a*p(i + 1:i + 4) + b*p(i + 5:i + 8))
      end do
      do j = 1, 4
         a = k(1)*p(other + j)
         b = k(2)*p(other + 4 + j)
         m(1:2, 2 + j) = m(1:2, 2 + j) + (a*n + b*t)
         m(3:6, 2 + j) = m(3:6, 2 + j) + (a*p(i + 1:i + 4) + b*p(i + 5:i + 8))
      end do
   end subroutine add_coupling

   !> Directions of both lines, as the first two numbers of the vectors of one of the blocks. The other four are
   !> p(i + 1:i + 4) of line 1 and p(i + 5:i + 8) of line 2.
   pure subroutine unpack_lines(p, is_first, n, t, i)
      real(wp), intent(in) :: p(link_numbers)
      logical, intent(in) :: is_first
      real(wp), intent(out) :: n(2), t(2)
      integer, intent(out) :: i
      if (is_first) then
         n = p(1:2)
         i = 2
      else
         n = -p(1:2)
         i = 10
      end if
      t(1) = -n(2)
      t(2) = n(1)
   end subroutine unpack_lines

   !> Forces of the links of a block, with their signs and without.
   pure subroutine add_loads(incident, vectors, force, f, magnitude)
      integer, intent(in), contiguous :: incident(:)        !! its links, < 0: as their second block
      real(wp), intent(in), contiguous :: vectors(:, :)     !! (link_numbers, links)
      real(wp), intent(in), contiguous :: force(:, :)       !! (2, links)
      real(wp), intent(inout) :: f(6), magnitude(6)
      real(wp) :: n(2), t(2)
      integer :: c, i, l
      do l = 1, size(incident)
         c = abs(incident(l))
         if (abs(force(1, c)) <= 0 .and. abs(force(2, c)) <= 0) cycle
         call unpack_lines(vectors(:, c), incident(l) > 0, n, t, i)
         f(1:2) = f(1:2) + (force(1, c)*n + force(2, c)*t)
         magnitude(1:2) = magnitude(1:2) + (abs(force(1, c)*n) + abs(force(2, c)*t))
         f(3:6) = f(3:6) + (force(1, c)*vectors(i + 1:i + 4, c) + force(2, c)*vectors(i + 5:i + 8, c))
         magnitude(3:6) = magnitude(3:6) + (abs(force(1, c)*vectors(i + 1:i + 4, c)) + &
                                            abs(force(2, c)*vectors(i + 5:i + 8, c)))
      end do
   end subroutine add_loads

   !> Forces of the links of a block.
   pure subroutine add_forces(incident, vectors, force, r)
      integer, intent(in), contiguous :: incident(:)        !! its links, < 0: as their second block
      real(wp), intent(in), contiguous :: vectors(:, :)     !! (link_numbers, links)
      real(wp), intent(in), contiguous :: force(:, :)       !! (2, >= links)
      real(wp), intent(inout) :: r(6)
      integer :: c, l
      do l = 1, size(incident)
         c = abs(incident(l))
         if (.not. (abs(force(1, c)) > 0 .or. abs(force(2, c)) > 0)) cycle
         call add_force(vectors(:, c), incident(l) > 0, force(:, c), r)
      end do
   end subroutine add_forces

   !> Forces along both lines of a link on one of its blocks.
   pure subroutine add_force(p, is_first, force, r)
      real(wp), intent(in) :: p(link_numbers)
      logical, intent(in) :: is_first
      real(wp), intent(in) :: force(2)
      real(wp), intent(inout) :: r(6)
      real(wp) :: n(2), t(2)
      integer :: i
      call unpack_lines(p, is_first, n, t, i)
      r(1:2) = r(1:2) + (force(1)*n + force(2)*t)
      r(3:6) = r(3:6) + (force(1)*p(i + 1:i + 4) + force(2)*p(i + 5:i + 8))
   end subroutine add_force

end module rockdda_interaction_link_vectors
