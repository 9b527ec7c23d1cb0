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
!>
!> Sums over many links are in link_kernels_shim.c.
module rockdda_interaction_link_vectors
   use, intrinsic :: iso_c_binding, only : c_int, c_double
   use rockdda_base_kinds, only : wp
   implicit none
   private
   public :: link_numbers, pack_vectors, unpack_vectors, elongations, add_stiffness, add_loads, add_forces

   !> Numbers that are stored of a link.
   integer, parameter :: link_numbers = 18

   interface
      !> Elongations of n links with two blocks, one after the other.
      pure subroutine elongations(n, vectors, pair, x, along) bind(c, name='rockdda_many_elongations')
         import :: c_int, c_double
         integer(c_int), value :: n
         real(c_double), intent(in) :: vectors(18, *)     !! of the n links
         integer(c_int), intent(in) :: pair(2, *)         !! their blocks
         real(c_double), intent(in) :: x(6, *)            !! of all blocks
         real(c_double), intent(inout) :: along(2, *)     !! of the n links
      end subroutine elongations

      !> Stiffness of the links of block i and its own terms, as its diagonal block; stiffness of the links as its
      !> couplings with blocks of larger numbers, which follow the diagonal block.
      pure subroutine add_stiffness(i, n, incident, pair, slot, vectors, stiffness, coupling, terms, diagonal, &
                                    n_couplings, values) bind(c, name='rockdda_add_stiffness')
         import :: c_int, c_double
         integer(c_int), value :: i
         integer(c_int), value :: n                       !! links of the block
         integer(c_int), intent(in) :: incident(*)        !! which they are, < 0: as their second block
         integer(c_int), intent(in) :: pair(2, *)         !! of all links
         integer(c_int), intent(in) :: slot(*)            !! stored block of each pair, 0 none
         real(c_double), intent(in) :: vectors(18, *), stiffness(2, *)
         real(c_double), intent(in) :: coupling(*)        !! of a link with the next one, along line 1
         real(c_double), intent(in) :: terms(21)          !! lower triangle (pack_lower)
         integer(c_int), value :: diagonal                !! stored block of the diagonal
         integer(c_int), value :: n_couplings             !! that are stored behind it
         real(c_double), intent(inout) :: values(6, 6, *) !! stored blocks
      end subroutine add_stiffness

      !> Forces of the n links of a block, with their signs and without.
      pure subroutine add_loads(n, incident, vectors, force, f, magnitude) bind(c, name='rockdda_add_loads')
         import :: c_int, c_double
         integer(c_int), value :: n
         integer(c_int), intent(in) :: incident(*)        !! its links, < 0: as their second block
         real(c_double), intent(in) :: vectors(18, *), force(2, *)   !! of all links
         real(c_double), intent(inout) :: f(6), magnitude(6)
      end subroutine add_loads

      !> Forces of the n links of a block.
      pure subroutine add_forces(n, incident, vectors, force, r) bind(c, name='rockdda_add_forces')
         import :: c_int, c_double
         integer(c_int), value :: n
         integer(c_int), intent(in) :: incident(*)        !! its links, < 0: as their second block
         real(c_double), intent(in) :: vectors(18, *), force(2, *)   !! of all links
         real(c_double), intent(inout) :: r(6)
      end subroutine add_forces
   end interface

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

end module rockdda_interaction_link_vectors
