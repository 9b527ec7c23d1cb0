! SPDX-License-Identifier: MIT
!> Random numbers of the fuzzer: the same on every machine, each input with a stream of its own.
module fuzz_random
   use, intrinsic :: iso_fortran_env, only : int64, real64
   implicit none
   private
   public :: random_type, new_random

   type :: random_type
      integer(int64) :: state = 1_int64
   contains
      procedure :: bits
      procedure :: unit
      procedure :: below
      procedure :: chance
   end type random_type

contains

   !> The stream of input number `index` of a run with this seed.
   pure function new_random(seed, index) result(random)
      integer, intent(in) :: seed, index
      type(random_type) :: random
      integer(int64) :: unused
      integer :: i
      random%state = ieor(ishft(int(seed, int64), 33), int(index, int64))
      random%state = ieor(random%state, 2870177450012600261_int64)
      if (random%state == 0) random%state = 88172645463325252_int64
      ! neighbouring states need some rounds to part
      do i = 1, 24
         call random%bits(unused)
      end do
   end function new_random

   !> 64 bits: xorshift (Marsaglia 2003), which needs no products and so cannot overflow.
   pure subroutine bits(self, value)
      class(random_type), intent(inout) :: self
      integer(int64), intent(out) :: value
      self%state = ieor(self%state, ishft(self%state, 13))
      self%state = ieor(self%state, ishft(self%state, -7))
      self%state = ieor(self%state, ishft(self%state, 17))
      value = self%state
   end subroutine bits

   !> A real in [0, 1).
   function unit(self) result(value)
      class(random_type), intent(inout) :: self
      real(real64) :: value
      integer(int64) :: word
      call self%bits(word)
      value = real(ishft(word, -11), real64)*2.0_real64**(-53)
   end function unit

   !> A whole number 0 … n - 1; 0 when n < 1.
   function below(self, n) result(value)
      class(random_type), intent(inout) :: self
      integer, intent(in) :: n
      integer :: value
      value = min(int(self%unit()*max(n, 1)), max(n, 1) - 1)
   end function below

   !> True with this probability.
   function chance(self, probability) result(yes)
      class(random_type), intent(inout) :: self
      real(real64), intent(in) :: probability
      logical :: yes
      yes = self%unit() < probability
   end function chance

end module fuzz_random
