! SPDX-License-Identifier: MIT
!> The norm of rockdda_linear_block_norm without factors that are kept: each sum factorises the blocks again, which
!> takes no memory, and as long as to read factors from there. For norms of which few are taken with the same blocks.
module rockdda_linear_norm_anew
   use, intrinsic :: iso_c_binding, only : c_int, c_double
   use rockdda_base_kinds, only : wp
   use rockdda_base_parallel, only : parallel_blocks, piece, n_pieces
   use rockdda_linear_small_blocks, only : unpack_lower
   implicit none
   private
   public :: norm_anew_type

   type :: norm_anew_type
      real(wp), allocatable, private :: partial(:)   !! (>= pieces) sums
   contains
      procedure :: norm
      procedure, nopass :: norm_of_part
   end type norm_anew_type

   interface
      !> Add r^T D^-1 r of n blocks of `values` to a total, 1; or 0 where one of them has no factor.
      integer(c_int) function sum_anew(n, values, place, r, total) bind(c, name='rockdda_sum_anew')
         import :: c_int, c_double
         integer(c_int), value :: n
         real(c_double), intent(in) :: values(36, *)
         integer(c_int), intent(in) :: place(*)       !! (n) of each block in `values`
         real(c_double), intent(in) :: r(6, *)
         real(c_double), intent(inout) :: total
      end function sum_anew
   end interface

contains

   !> |v| of a vector of forces on n blocks. Block i is number place(i) of `values`.
   subroutine norm(self, n, v, width, values, place, size_of_v, ok)
      class(norm_anew_type), intent(inout) :: self
      integer, intent(in) :: n
      real(wp), intent(in), contiguous :: v(:, :)            !! (6, n)
      integer, intent(in) :: width                           !! 36: whole blocks; n_packed: lower triangles
      real(wp), intent(in) :: values(width, *)
      integer, intent(in), contiguous :: place(:)            !! (>= n)
      real(wp), intent(out) :: size_of_v                     !! |v|
      logical, intent(out) :: ok                             !! all blocks have a factor
      integer :: p
      if (allocated(self%partial)) then
         if (size(self%partial) < n_pieces(n)) deallocate (self%partial)
      end if
      if (.not. allocated(self%partial)) allocate (self%partial(n_pieces(n)))
      ok = .true.
      !$omp parallel do default(none) shared(self, n, v, width, values, place) private(p) reduction(.and.:ok) &
      !$omp schedule(static) if (n > parallel_blocks)
      do p = 1, n_pieces(n)
         self%partial(p) = 0
         call add_some((p - 1)*piece + 1, min(p*piece, n), v, width, values, place, self%partial(p), ok)
      end do
      !$omp end parallel do
      size_of_v = sqrt(sum(self%partial(1:n_pieces(n))))
   end subroutine norm

   !> |v| if the forces on all blocks but the first `group` of each `stride` blocks were 0.
   subroutine norm_of_part(n, v, width, values, place, group, stride, size_of_v, ok)
      integer, intent(in) :: n
      real(wp), intent(in), contiguous :: v(:, :)            !! (6, n)
      integer, intent(in) :: width                           !! as above
      real(wp), intent(in) :: values(width, *)
      integer, intent(in), contiguous :: place(:)            !! (>= n)
      integer, intent(in) :: group, stride                   !! group: at most a piece
      real(wp), intent(out) :: size_of_v
      logical, intent(out) :: ok                             !! these blocks have a factor
      real(wp) :: total
      integer :: first
      total = 0
      ok = .true.
      do first = 1, n, stride
         call add_some(first, min(first + group - 1, n), v, width, values, place, total, ok)
      end do
      size_of_v = sqrt(total)
   end subroutine norm_of_part

   !> Add the squares of some blocks, at most a piece of them, to a total.
   subroutine add_some(first, last, v, width, values, place, total, ok)
      integer, intent(in) :: first, last, width
      real(wp), intent(in), contiguous :: v(:, :)
      real(wp), intent(in) :: values(width, *)
      integer, intent(in), contiguous :: place(:)
      real(wp), intent(inout) :: total
      logical, intent(inout) :: ok                           !! false when a block has no factor
      real(wp) :: squares, blocks(6, 6, 4)
      integer :: i, q
      squares = 0
      if (width == 36) then
         if (sum_anew(last - first + 1, values, place(first:last), v(:, first:last), squares) == 0) ok = .false.
      else
         do i = first, last, 4
            do q = 1, min(4, last - i + 1)
               call unpack_lower(values(:, place(i + q - 1)), blocks(:, :, q))
            end do
            if (sum_anew(min(4, last - i + 1), blocks, [1, 2, 3, 4], v(:, i:min(i + 3, last)), squares) == 0) &
               ok = .false.
         end do
      end if
      total = total + squares
   end subroutine add_some

end module rockdda_linear_norm_anew
