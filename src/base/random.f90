! SPDX-License-Identifier: MIT
!> Random numbers that are the same on every machine.
!>
!> MRG32k3a (L'Ecuyer, "Good parameters and implementations for combined multiple recursive random number
!> generators", Operations Research 47, 1999): two recurrences of order three, combined; period about 2^191. All
!> products stay below 2^53, so that 64-bit integers never overflow and nothing is rounded. The intrinsic generator
!> of Fortran differs between compilers.
!>
!> A stream is given by a seed and a number: a stream does not depend on how many numbers others have drawn.
module rockdda_base_random
   use rockdda_base_kinds, only : wp, i8
   implicit none
   private
   public :: random_stream_type, new_stream, largest_seed

   integer, parameter :: largest_seed = 2147483646   !! seeds are 0 to this

   integer(i8), parameter :: m1 = 4294967087_i8, m2 = 4294944443_i8
   integer(i8), parameter :: a12 = 1403580_i8, a13 = 810728_i8, a21 = 527612_i8, a23 = 1370589_i8

   type :: random_stream_type
      integer(i8), private :: s1(3) = 12345_i8, s2(3) = 12345_i8
   contains
      procedure :: uniform
      procedure :: normal
      procedure :: exponential
   end type random_stream_type

contains

   !> A stream at its start.
   pure subroutine new_stream(seed, number, stream)
      integer, intent(in) :: seed      !! 0 to largest_seed
      integer, intent(in) :: number    !! of the stream, 0 or more
      type(random_stream_type), intent(out) :: stream
      integer(i8) :: x
      integer :: i
      real(wp) :: ignored
      ! the six words come from a multiplicative generator (Park and Miller) that begins with seed and number
      x = 1 + modulo(int(seed, i8) + 7919_i8*int(number, i8), 2147483646_i8)
      do i = 1, 16
         x = modulo(48271_i8*x + int(number, i8), 2147483647_i8)
         if (x == 0) x = 1
      end do
      do i = 1, 3
         x = modulo(48271_i8*x, 2147483647_i8)
         stream%s1(i) = x
         x = modulo(48271_i8*x, 2147483647_i8)
         stream%s2(i) = x
      end do
      do i = 1, 8
         call stream%uniform(ignored)
      end do
   end subroutine new_stream

   !> A number between 0 and 1, both excluded.
   pure subroutine uniform(self, value)
      class(random_stream_type), intent(inout) :: self
      real(wp), intent(out) :: value
      integer(i8) :: p1, p2
      p1 = modulo(a12*self%s1(2) - a13*self%s1(1), m1)
      self%s1 = [self%s1(2), self%s1(3), p1]
      p2 = modulo(a21*self%s2(3) - a23*self%s2(1), m2)
      self%s2 = [self%s2(2), self%s2(3), p2]
      p1 = modulo(p1 - p2, m1)
      if (p1 == 0) p1 = m1
      value = real(p1, wp)/real(m1 + 1, wp)
   end subroutine uniform

   !> A number of the standard normal distribution (Box and Muller).
   pure subroutine normal(self, value)
      class(random_stream_type), intent(inout) :: self
      real(wp), intent(out) :: value
      real(wp), parameter :: pi = acos(-1.0_wp)
      real(wp) :: u, v
      call self%uniform(u)
      call self%uniform(v)
      value = sqrt(-2*log(u))*cos(2*pi*v)
   end subroutine normal

   !> A number of the exponential distribution of mean 1.
   pure subroutine exponential(self, value)
      class(random_stream_type), intent(inout) :: self
      real(wp), intent(out) :: value
      real(wp) :: u
      call self%uniform(u)
      value = -log(u)
   end subroutine exponential

end module rockdda_base_random
