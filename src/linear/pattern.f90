! SPDX-License-Identifier: MIT
!> From the contact graph to the pattern of the block matrix.
!>
!> Linear in the number of blocks and pairs: two counting sorts, first by the larger, then by the smaller
!> block number, leave every row ascending and the duplicates of a pair side by side.
module rockdda_linear_pattern
   use rockdda_base_kinds, only : wp
   use rockdda_base_room, only : reserve
   use rockdda_linear_matrix, only : block_matrix_type
   implicit none
   private
   public :: build_pattern, pattern_work_type

   !> Arrays of `build_pattern`; a caller that keeps them saves their allocation.
   type :: pattern_work_type
      integer, allocatable :: start(:), by_large(:), by_small(:), row_start(:), column(:)
   end type pattern_work_type

contains

   !> Set row_start and column of a matrix from the pairs of blocks that touch, and make room for its values.
   !>
   !> The diagonal block of row i is always stored, at row_start(i). `column` and `values` are kept when they
   !> are large enough, so they may be longer than row_start(n + 1) - 1. When the pattern is what the matrix
   !> held before, nothing changes, neither values nor pattern_id; otherwise values are undefined.
   subroutine build_pattern(n, pairs, matrix, slots, work)
      integer, intent(in) :: n                         !! number of blocks
      integer, intent(in), contiguous :: pairs(:, :)   !! (2, m) blocks of each contact, any order, repeats allowed
      type(block_matrix_type), intent(inout) :: matrix !! receives the pattern
      integer, intent(out), contiguous :: slots(:)     !! (m) place k in values of block (min, max) of each pair
      type(pattern_work_type), intent(inout), optional :: work !! kept by callers that come often
      type(pattern_work_type) :: own
      if (present(work)) then
         call build_with(n, pairs, matrix, slots, work)
      else
         call build_with(n, pairs, matrix, slots, own)
      end if
   end subroutine build_pattern

   !> `build_pattern` with the arrays given.
   subroutine build_with(n, pairs, matrix, slots, work)
      integer, intent(in) :: n
      integer, intent(in), contiguous :: pairs(:, :)
      type(block_matrix_type), intent(inout) :: matrix
      integer, intent(out), contiguous :: slots(:)
      type(pattern_work_type), intent(inout) :: work
      integer :: n_stored
      call make_room(work, n, size(pairs, 2))
      call sort_pairs(n, size(pairs, 2), pairs, slots, work%start, work%by_large, work%by_small, work%row_start, &
                      work%column)
      if (is_same_pattern(matrix, n, work%row_start(1:n + 1), work%column)) return
      if (matrix%n /= n .and. allocated(matrix%row_start)) deallocate (matrix%row_start)
      if (.not. allocated(matrix%row_start)) allocate (matrix%row_start(n + 1))
      matrix%n = n
      matrix%pattern_id = matrix%pattern_id + 1
      matrix%row_start(1:n + 1) = work%row_start(1:n + 1)
      n_stored = matrix%row_start(n + 1) - 1
      call reserve_blocks(matrix, n_stored)
      matrix%column(1:n_stored) = work%column(1:n_stored)
   end subroutine build_with

   !> Room for n rows and m pairs.
   pure subroutine make_room(work, n, m)
      type(pattern_work_type), intent(inout) :: work
      integer, intent(in) :: n, m
      call reserve(work%start, n + 1)
      call reserve(work%row_start, n + 1)
      call reserve(work%by_large, m)
      call reserve(work%by_small, m)
      call reserve(work%column, n + m)
   end subroutine make_room

   !> Rows of the upper half with their columns ascending, and the place of each pair.
   pure subroutine sort_pairs(n, m, pairs, slots, start, by_large, by_small, row_start, column)
      integer, intent(in) :: n, m
      integer, intent(in) :: pairs(2, m)
      integer, intent(out) :: slots(m)
      integer, intent(inout) :: start(n + 1), by_large(m), by_small(m)   !! work
      integer, intent(inout) :: row_start(n + 1)
      integer, intent(inout) :: column(n + m)
      integer :: c, i, j, k, lo, hi
      start = 0
      do c = 1, m
         hi = max(pairs(1, c), pairs(2, c))
         start(hi + 1) = start(hi + 1) + 1
      end do
      call counts_to_starts(start)
      do c = 1, m
         hi = max(pairs(1, c), pairs(2, c))
         by_large(start(hi)) = c
         start(hi) = start(hi) + 1
      end do

      start = 0
      do c = 1, m
         lo = min(pairs(1, c), pairs(2, c))
         start(lo + 1) = start(lo + 1) + 1
      end do
      call counts_to_starts(start)
      row_start = start
      do i = 1, m
         c = by_large(i)
         lo = min(pairs(1, c), pairs(2, c))
         by_small(start(lo)) = c
         start(lo) = start(lo) + 1
      end do

      ! start(i) is now the end of row i, row_start(i) its beginning: drop the duplicates
      k = 0
      do i = 1, n
         k = k + 1
         column(k) = i
         j = row_start(i)
         row_start(i) = k
         do j = j, start(i) - 1
            c = by_small(j)
            hi = max(pairs(1, c), pairs(2, c))
            if (column(k) /= hi) then
               k = k + 1
               column(k) = hi
            end if
            slots(c) = k
         end do
      end do
      row_start(n + 1) = k + 1
   end subroutine sort_pairs

   !> Turn counts, shifted by one, into the places where the groups begin.
   pure subroutine counts_to_starts(start)
      integer, intent(inout) :: start(:) !! start(i + 1) = members of group i on entry
      integer :: i
      start(1) = 1
      do i = 2, size(start)
         start(i) = start(i) + start(i - 1)
      end do
   end subroutine counts_to_starts

   !> Does the matrix have this pattern already?
   pure logical function is_same_pattern(matrix, n, row_start, column)
      type(block_matrix_type), intent(in) :: matrix
      integer, intent(in) :: n, row_start(:), column(:) !! new pattern
      integer :: n_stored
      is_same_pattern = .false.
      if (matrix%n /= n .or. .not. allocated(matrix%row_start)) return
      if (any(matrix%row_start /= row_start)) return
      n_stored = row_start(n + 1) - 1
      is_same_pattern = all(matrix%column(1:n_stored) == column(1:n_stored))
   end function is_same_pattern

   !> Make room for the stored blocks; what is there is kept only when it is large enough.
   subroutine reserve_blocks(matrix, n_stored)
      type(block_matrix_type), intent(inout) :: matrix
      integer, intent(in) :: n_stored  !! number of stored blocks
      integer :: room
      if (allocated(matrix%column)) then
         if (size(matrix%column) >= n_stored) return
         deallocate (matrix%column, matrix%values)
      end if
      ! a tenth more, so that a graph that grows slowly does not allocate in every step
      room = n_stored + n_stored/10
      allocate (matrix%column(room), matrix%values(6, 6, room))
      matrix%column = 0
      matrix%values = 0.0_wp
   end subroutine reserve_blocks

end module rockdda_linear_pattern
