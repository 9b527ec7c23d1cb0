! SPDX-License-Identifier: MIT
!> Symmetric block-sparse matrix with 6x6 blocks: the stiffness of a block system.
!>
!> Stored is the upper half with the diagonal, row by row, columns ascending; the diagonal block comes first:
!>
!>     row        1              2        3
!>     column     1  2  5        2  3     3  4          column(row_start(i) : row_start(i+1)-1)
!>     values     6x6 each: values(:, :, k) is K_ij with j = column(k) >= i
!>
!> The pattern comes from the contact graph; `pattern_id` changes with it, and a solver then repeats its analysis.
!> `values_id` changes whenever values may have changed: while it is the same number, not 0, a solver may reuse its
!> factors of the matrix. When few rows change, `base_id` is the number of the matrix before and `changed` marks these
!> rows: K_ij differs from its value in that matrix only if rows i and j both are marked.
module rockdda_linear_matrix
   use rockdda_base_kinds, only : wp
   implicit none
   private
   public :: block_matrix_type

   type :: block_matrix_type
      integer :: n = 0                          !! block rows
      integer :: pattern_id = 0                 !! differs whenever the pattern differs
      integer :: values_id = 0                  !! differs whenever values differ; 0: not tracked
      integer :: base_id = 0                    !! values_id from which only rows in `changed` differ; 0: unknown
      logical, allocatable :: changed(:)        !! (n) valid where base_id is not 0
      integer, allocatable :: row_start(:)      !! (n + 1)
      integer, allocatable :: column(:)         !! (number of stored blocks)
      real(wp), allocatable :: values(:, :, :)  !! (6, 6, number of stored blocks)
   end type block_matrix_type

end module rockdda_linear_matrix
