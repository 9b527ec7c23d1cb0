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
!> For threads the blocks are cut into chunks; sums are taken chunk by chunk, in order. The factors of four blocks of a
!> chunk that follow one another are computed, stored and used together (norm_kernels_shim.c).
!>
!> The norm of rockdda_linear_block_norm without factors that are kept: each sum factorises the blocks again, which
!> takes no memory, and as long as to read factors from there. For norms of which few are taken with the same blocks.
module rockdda_linear_block_norm
   use, intrinsic :: iso_c_binding, only : c_int, c_double
   use rockdda_base_kinds, only : wp
   use rockdda_linear_matrix, only : block_matrix_type
   use rockdda_linear_small_blocks, only : factorize_packed, n_packed, unpack_lower
   use rockdda_base_parallel, only : parallel_blocks, piece, n_pieces
   use rockdda_base_room, only : reserve
   implicit none
   private
   public :: block_norm_type, norm_anew_type

   type :: norm_anew_type
      real(wp), allocatable, private :: partial(:)   !! (>= pieces) sums
   contains
      procedure :: norm => norm_without_factors
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

   type :: block_norm_type
      !> (4, n_packed, fours) Cholesky factors of D_i, packed: block first(c) + k of chunk c is number 1 + mod(k, 4) of
      !> the four first_four(c) + k/4
      real(wp), allocatable :: factor(:, :, :)
      integer, allocatable :: first_four(:)         !! (chunks + 1)
      integer :: values_id = 0                      !! matrix whose diagonal blocks are factorised, 0 none
      integer :: n_chunks = 1
      integer, allocatable :: first(:)              !! (chunks + 1) blocks first(c) : first(c+1)-1
      real(wp), allocatable :: partial(:)           !! (chunks) sums
      real(wp), allocatable, private :: other(:)    !! (chunks) the same of a second vector
      logical :: uses_threads = .false.
      integer, allocatable, private :: trouble(:)   !! (chunks) first block of the chunk without a factor, or 0
   contains
      procedure :: set_chunks
      procedure :: factorize_diagonal
      procedure :: norm
      procedure :: norm_of_sums
      procedure :: chunk_square
      procedure :: get_factor
   end type block_norm_type

   interface
      !> Factors of the four blocks place(1:4) of `values`, 1; or 0, and no factors, where one of them has none. Those
      !> of the other four places are wanted next.
      integer(c_int) function factorize_four(values, place, factor) bind(c, name='rockdda_factorize_four')
         import :: c_int, c_double
         real(c_double), intent(in) :: values(36, *)
         integer(c_int), intent(in) :: place(8)
         real(c_double), intent(inout) :: factor(4, *)
      end function factorize_four

      !> Sum of r^T D^-1 r over n blocks from the first of a four on.
      pure real(c_double) function sum_of_squares(n, factor, r) bind(c, name='rockdda_sum_of_squares')
         import :: c_int, c_double
         integer(c_int), value :: n
         real(c_double), intent(in) :: factor(4, *), r(6, *)
      end function sum_of_squares
   end interface

contains

   !> Take n blocks in chunks, given by their first blocks and n + 1.
   pure subroutine set_chunks(self, first, uses_threads)
      class(block_norm_type), intent(inout) :: self
      integer, intent(in) :: first(:)               !! (chunks + 1)
      logical, intent(in) :: uses_threads
      integer :: c
      self%values_id = 0
      self%first = first
      self%n_chunks = size(first) - 1
      self%uses_threads = uses_threads
      if (allocated(self%factor)) deallocate (self%factor, self%partial, self%other, self%trouble, &
         self%first_four)
      allocate (self%partial(self%n_chunks), self%other(self%n_chunks), self%trouble(self%n_chunks), &
                self%first_four(self%n_chunks + 1))
      self%first_four(1) = 1
      do c = 1, self%n_chunks
         self%first_four(c + 1) = self%first_four(c) + (first(c + 1) - first(c) + 3)/4
      end do
      allocate (self%factor(4, n_packed, self%first_four(self%n_chunks + 1) - 1))
   end subroutine set_chunks

   !> Factorise the diagonal blocks of a matrix, as far as they are new; `bad` is the first block that has no factor.
   !> Norms of vectors of forces are taken while the factors are in the cache.
   subroutine factorize_diagonal(self, matrix, bad, v, w, norms)
      class(block_norm_type), intent(inout) :: self
      type(block_matrix_type), intent(in) :: matrix
      integer, intent(out) :: bad                   !! 0: none
      real(wp), intent(in), contiguous, optional :: v(:, :)      !! (6, n)
      real(wp), intent(in), allocatable, optional :: w(:, :)     !! (6, n), may be unallocated
      real(wp), intent(out), optional :: norms(2)   !! |v| and |w|; 0: not given, or no factors
      logical :: is_new, few, has_other
      integer :: c
      bad = 0
      is_new = matrix%values_id == 0 .or. matrix%values_id /= self%values_id
      if (present(norms)) norms = 0
      if (.not. (is_new .or. present(norms))) return
      ! only those of changed rows
      few = matrix%base_id /= 0 .and. matrix%base_id == self%values_id
      has_other = .false.
      if (present(w)) has_other = allocated(w)
      if (is_new) self%values_id = 0
      !$omp parallel do if(self%uses_threads) default(none) shared(self, matrix, is_new, few, v, w, has_other) &
      !$omp private(c) schedule(static)
      do c = 1, self%n_chunks
         self%trouble(c) = 0
         if (is_new) call factorize_chunk(self, c, matrix, few)
         if (self%trouble(c) > 0) cycle
         if (present(v)) self%partial(c) = self%chunk_square(c, v)
         if (has_other) self%other(c) = self%chunk_square(c, w)
      end do
      !$omp end parallel do
      bad = first_trouble(self)
      if (bad > 0) return
      self%values_id = matrix%values_id
      if (.not. present(norms)) return
      if (present(v)) norms(1) = self%norm_of_sums()
      if (has_other) norms(2) = sqrt(sum(self%other))
   end subroutine factorize_diagonal

   !> Factorise the diagonal blocks of one chunk.
   subroutine factorize_chunk(self, c, matrix, few)
      type(block_norm_type), intent(inout) :: self
      integer, intent(in) :: c
      type(block_matrix_type), intent(in) :: matrix
      logical, intent(in) :: few                    !! only those of changed rows
      integer :: i, k, last, place(8)
      do i = self%first(c), self%first(c + 1) - 1, 4
         last = min(i + 3, self%first(c + 1) - 1)
         if (few) then
            if (.not. any(matrix%changed(i:last))) cycle
         end if
         do k = 1, 8
            place(k) = matrix%row_start(min(i + k - 1, merge(last, self%first(c + 1) - 1, k <= 4)))
         end do
         call factorize_part(self, c, i, last, matrix%values, place)
         if (self%trouble(c) > 0) exit
      end do
   end subroutine factorize_chunk

   !> Factorise the blocks i to `last`, at most four, of a chunk.
   subroutine factorize_part(self, c, i, last, values, place)
      type(block_norm_type), intent(inout) :: self
      integer, intent(in) :: c, i, last
      real(wp), intent(in) :: values(6, 6, *)
      integer, intent(in) :: place(8)               !! of the blocks in `values`; that of `last` for those beyond it,
                                                    !! and of the next four
      real(wp) :: l(n_packed)
      integer :: g, q
      logical :: ok
      g = self%first_four(c) + (i - self%first(c))/4
      if (factorize_four(values, place, self%factor(:, :, g)) == 1) return
      do q = 1, last - i + 1
         call factorize_packed(values(:, :, place(q)), l, ok)
         self%factor(q, :, g) = l
         if (ok) cycle
         self%trouble(c) = i + q - 1
         return
      end do
   end subroutine factorize_part

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

   !> The packed factor of block i.
   pure subroutine get_factor(self, i, l)
      class(block_norm_type), intent(in) :: self
      integer, intent(in) :: i
      real(wp), intent(out) :: l(n_packed)
      integer :: low, high, middle
      low = 1
      high = self%n_chunks
      do while (low < high)
         middle = (low + high + 1)/2
         if (self%first(middle) <= i) then
            low = middle
         else
            high = middle - 1
         end if
      end do
      l = self%factor(1 + mod(i - self%first(low), 4), :, self%first_four(low) + (i - self%first(low))/4)
   end subroutine get_factor

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
      total = 0
      if (self%first(c + 1) > self%first(c)) &
         total = sum_of_squares(self%first(c + 1) - self%first(c), self%factor(:, :, self%first_four(c)), &
                                v(:, self%first(c):self%first(c + 1) - 1))
   end function chunk_square

   !> |v| of a vector of forces on n blocks. Block i is number place(i) of `values`.
   subroutine norm_without_factors(self, n, v, width, values, place, size_of_v, ok)
      class(norm_anew_type), intent(inout) :: self
      integer, intent(in) :: n
      real(wp), intent(in), contiguous :: v(:, :)            !! (6, n)
      integer, intent(in) :: width                           !! 36: whole blocks; n_packed: lower triangles
      real(wp), intent(in) :: values(width, *)
      integer, intent(in), contiguous :: place(:)            !! (>= n)
      real(wp), intent(out) :: size_of_v                     !! |v|
      logical, intent(out) :: ok                             !! all blocks have a factor
      integer :: p
      call reserve(self%partial, n_pieces(n))
      ok = .true.
      !$omp parallel do default(none) shared(self, n, v, width, values, place) private(p) reduction(.and.:ok) &
      !$omp schedule(static) if (n > parallel_blocks)
      do p = 1, n_pieces(n)
         self%partial(p) = 0
         call add_some((p - 1)*piece + 1, min(p*piece, n), v, width, values, place, self%partial(p), ok)
      end do
      !$omp end parallel do
      size_of_v = sqrt(sum(self%partial(1:n_pieces(n))))
   end subroutine norm_without_factors

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

end module rockdda_linear_block_norm
