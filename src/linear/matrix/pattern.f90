! SPDX-License-Identifier: MIT
!> Pattern of the block matrix from the pairs of blocks in contact.
!>
!> Two counting sorts, first by the larger, then by the smaller block number, make every row ascend and put the
!> duplicates of a pair side by side. The cost is linear in the number of blocks and pairs.
!>
!>     pair       1      2      3      4                row        1           2        3
!>     blocks     3 1    2 3    1 2    1 3              column     1  2  3     2  3     3
!>     slots      3      5      2      3                place k    1  2  3     4  5     6
module rockdda_linear_pattern
   use rockdda_base_room, only : reserve
   use rockdda_linear_matrix, only : block_matrix_type
   implicit none
   private
   public :: build_pattern

contains

   !> Set row_start and column of a matrix from the pairs of blocks in contact, and allocate its values.
   !>
   !> The diagonal block of row i is always stored, at row_start(i). `column` and `values` are kept when they
   !> are large enough, so they may be longer than row_start(n + 1) - 1. When the pattern is that of
   !> the matrix already, values and pattern_id stay as they are; otherwise values are undefined.
   subroutine build_pattern(n, pairs, matrix, slots)
      integer, intent(in) :: n                         !! number of blocks
      integer, intent(in), contiguous :: pairs(:, :)   !! (2, m) blocks of each contact, any order, repeats allowed
      type(block_matrix_type), intent(inout) :: matrix !! receives the pattern
      integer, intent(out), contiguous :: slots(:)     !! (m) place k in values of block (min, max) of each pair
      integer :: n_stored, m
      m = size(pairs, 2)
      call reserve(matrix%scratch, 3*n + 2*m + 2)
      call sort_pairs(n, m, pairs, slots, matrix%scratch(2*n + m + 2:), matrix%scratch(3*n + m + 3:), &
                      matrix%scratch, matrix%scratch(n + 2:))
      if (is_same_pattern(matrix, n, matrix%scratch(:n + 1), matrix%scratch(n + 2:2*n + m + 1))) return
      if (matrix%n /= n .and. allocated(matrix%row_start)) deallocate (matrix%row_start)
      if (.not. allocated(matrix%row_start)) allocate (matrix%row_start(n + 1))
      matrix%n = n
      matrix%pattern_id = matrix%pattern_id + 1
      matrix%row_start(1:n + 1) = matrix%scratch(:n + 1)
      n_stored = matrix%row_start(n + 1) - 1
      call reserve_blocks(matrix, n_stored)
      matrix%column(1:n_stored) = matrix%scratch(n + 2:n + 1 + n_stored)
   end subroutine build_pattern

   !> Rows of the upper half with their columns ascending, and the place of each pair.
   pure subroutine sort_pairs(n, m, pairs, slots, start, by_small, row_start, column)
      integer, intent(in) :: n, m
      integer, intent(in) :: pairs(2, m)
      integer, intent(out) :: slots(m)                      !! at first the pairs in the order of their larger block
      integer, intent(inout) :: start(n + 1), by_small(m)   !! work
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
         slots(start(hi)) = c
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
         c = slots(i)
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

   !> Turn counts, shifted by one, into the places where the rows begin.
   pure subroutine counts_to_starts(start)
      integer, intent(inout) :: start(:) !! start(i + 1) = entries of row i on entry
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

   !> Allocate at least n_stored blocks; arrays that are large enough stay.
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
      ! the room is not touched, so that it takes no memory
      matrix%column(:n_stored) = 0
      matrix%values(:, :, :n_stored) = 0
   end subroutine reserve_blocks

end module rockdda_linear_pattern
