! SPDX-License-Identifier: MIT
!> A norm for vectors of forces on blocks, whose components have mixed units.
!>
!> The unknowns of a block have mixed units, and so have the equations: forces, a moment, stress times area.
!> They are made comparable by a stiffness D_i of the block,
!>
!>     |r|^2 = sum_i r_i^T D_i^-1 r_i,
!>
!> that is twice the energy which the forces would put into each block alone. The norm does not depend on units, on the
!> point the unknowns refer to, or on the size of the blocks. D_i is the diagonal block of a matrix, K_ii, or any other
!> positive definite block.
!>
!> For threads the blocks are cut into chunks; sums are taken chunk by chunk, in order.
module rockdda_linear_block_norm
   use rockdda_base_first_use, only : take_pages
   use rockdda_base_kinds, only : wp
   use rockdda_linear_matrix, only : block_matrix_type
   use rockdda_linear_small_blocks, only : factorize_block, n_packed, pack_lower, square_packed
   implicit none
   private
   public :: block_norm_type

   type :: block_norm_type
      real(wp), allocatable :: factor(:, :)         !! (n_packed, n) Cholesky factors of D_i, packed
      integer :: values_id = 0                      !! matrix whose diagonal blocks are factorised, 0 none
      integer :: n_chunks = 1
      integer, allocatable :: first(:)              !! (chunks + 1) blocks first(c) : first(c+1)-1
      real(wp), allocatable :: partial(:)           !! (chunks) sums
      logical :: uses_threads = .false.
      integer, allocatable, private :: trouble(:)   !! (chunks) first block of the chunk without a factor, or 0
   contains
      procedure :: set_chunks
      procedure :: factorize_diagonal
      procedure :: factorize_blocks
      procedure :: norm
      procedure :: norm_of_part
      procedure :: norm_of_sums
      procedure :: chunk_square
   end type block_norm_type

contains

   !> Take n blocks in chunks, given by their first blocks and n + 1.
   pure subroutine set_chunks(self, first, uses_threads)
      class(block_norm_type), intent(inout) :: self
      integer, intent(in) :: first(:)               !! (chunks + 1)
      logical, intent(in) :: uses_threads
      self%values_id = 0
      self%first = first
      self%n_chunks = size(first) - 1
      self%uses_threads = uses_threads
      if (allocated(self%factor)) deallocate (self%factor, self%partial, self%trouble)
      allocate (self%factor(n_packed, first(self%n_chunks + 1) - 1), self%partial(self%n_chunks), &
                self%trouble(self%n_chunks))
      call take_pages(self%factor)
   end subroutine set_chunks

   !> Factorise the diagonal blocks of a matrix, as far as they are new; `bad` is the first block that has no factor.
   subroutine factorize_diagonal(self, matrix, bad)
      class(block_norm_type), intent(inout) :: self
      type(block_matrix_type), intent(in) :: matrix
      integer, intent(out) :: bad                   !! 0: none
      logical :: few, ok
      real(wp) :: l(6, 6)
      integer :: c, i
      bad = 0
      if (matrix%values_id /= 0 .and. matrix%values_id == self%values_id) return
      ! only those of changed rows
      few = matrix%base_id /= 0 .and. matrix%base_id == self%values_id
      self%values_id = 0
      !$omp parallel do if(self%uses_threads) default(none) shared(self, matrix, few) private(c, i, l, ok) &
      !$omp schedule(static)
      do c = 1, self%n_chunks
         self%trouble(c) = 0
         do i = self%first(c), self%first(c + 1) - 1
            if (few) then
               if (.not. matrix%changed(i)) cycle
            end if
            call factorize_block(matrix%values(:, :, matrix%row_start(i)), l, ok)
            call pack_lower(l, self%factor(:, i))
            if (ok) cycle
            self%trouble(c) = i
            exit
         end do
      end do
      !$omp end parallel do
      bad = first_trouble(self)
      if (bad == 0) self%values_id = matrix%values_id
   end subroutine factorize_diagonal

   !> Factorise other blocks; `bad` is the first that has no factor.
   subroutine factorize_blocks(self, blocks, bad)
      class(block_norm_type), intent(inout) :: self
      real(wp), intent(in), contiguous :: blocks(:, :, :)   !! (6, 6, n)
      integer, intent(out) :: bad                   !! 0: none
      logical :: ok
      real(wp) :: l(6, 6)
      integer :: c, i
      self%values_id = 0
      !$omp parallel do if(self%uses_threads) default(none) shared(self, blocks) private(c, i, l, ok) schedule(static)
      do c = 1, self%n_chunks
         self%trouble(c) = 0
         do i = self%first(c), self%first(c + 1) - 1
            call factorize_block(blocks(:, :, i), l, ok)
            call pack_lower(l, self%factor(:, i))
            if (ok) cycle
            self%trouble(c) = i
            exit
         end do
      end do
      !$omp end parallel do
      bad = first_trouble(self)
   end subroutine factorize_blocks

   !> First block without a factor, 0 none.
   pure integer function first_trouble(self)
      type(block_norm_type), intent(in) :: self
      first_trouble = 0
      if (any(self%trouble > 0)) first_trouble = minval(self%trouble, mask=self%trouble > 0)
   end function first_trouble

   !> |v| of a vector of forces.
   real(wp) function norm(self, v)
      class(block_norm_type), intent(inout) :: self
      real(wp), intent(in), contiguous :: v(:, :)   !! (6, n)
      integer :: c
      !$omp parallel do if(self%uses_threads) default(none) shared(self, v) private(c) schedule(static)
      do c = 1, self%n_chunks
         self%partial(c) = self%chunk_square(c, v)
      end do
      !$omp end parallel do
      norm = self%norm_of_sums()
   end function norm

   !> |v| if the forces on all blocks but the first `group` of each `stride` blocks were 0.
   pure real(wp) function norm_of_part(self, v, group, stride) result(norm)
      class(block_norm_type), intent(in) :: self
      real(wp), intent(in), contiguous :: v(:, :)   !! (6, n)
      integer, intent(in) :: group, stride
      real(wp) :: total
      integer :: first, i
      total = 0
      do first = 1, size(v, 2), stride
         do i = first, min(first + group - 1, size(v, 2))
            total = total + square_packed(self%factor(:, i), v(:, i))
         end do
      end do
      norm = sqrt(total)
   end function norm_of_part

   !> The norm from the squares of all chunks in `partial`.
   pure real(wp) function norm_of_sums(self)
      class(block_norm_type), intent(in) :: self
      norm_of_sums = sqrt(sum(self%partial))
   end function norm_of_sums

   !> Square of the norm over one chunk.
   pure real(wp) function chunk_square(self, c, v) result(total)
      class(block_norm_type), intent(in) :: self
      integer, intent(in) :: c                      !! chunk
      real(wp), intent(in), contiguous :: v(:, :)   !! (6, n)
      integer :: i
      total = 0
      do i = self%first(c), self%first(c + 1) - 1
         total = total + square_packed(self%factor(:, i), v(:, i))
      end do
   end function chunk_square

end module rockdda_linear_block_norm
