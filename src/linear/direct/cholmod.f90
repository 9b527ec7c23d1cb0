! SPDX-License-Identifier: MIT
!> Sparse Cholesky with CHOLMOD: the only Fortran file that calls it; the C side is cholmod_shim.c.
!>
!> The order of elimination is found on the graph of blocks and each block expanded to its 6 unknowns, which
!> is much cheaper than ordering single unknowns. Ordering and symbolic factorisation are kept while the
!> pattern is the same. Indices are 64 bits wide: the factor of a large model has more than 2^31 entries.
module rockdda_linear_cholmod
   use, intrinsic :: iso_c_binding, only : c_ptr, c_null_ptr, c_associated, c_int, c_int64_t, c_double
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_strings, only : to_string
   use rockdda_linear_matrix, only : block_matrix_type, n_stored_blocks
   use rockdda_linear_direct, only : direct_solver_type, least_pivot, check_workspace
   use rockdda_linear_residual, only : not_positive_definite
   implicit none
   private
   public :: cholmod_solver_type

   integer(c_int), parameter :: cholmod_ok = 0, cholmod_not_positive_definite = 1, cholmod_out_of_memory = -2

   type, extends(direct_solver_type) :: cholmod_solver_type
      private
      type(c_ptr) :: handle = c_null_ptr
      integer, allocatable :: row_start(:), column(:)          !! block pattern that was analysed
      integer(c_int64_t), allocatable :: column_start(:)       !! (6n + 1) columns of the scalar lower triangle, 0-based
      integer(c_int64_t), allocatable :: row(:)                !! (entries) row of each entry, 0-based
      real(c_double), allocatable :: entries(:)                !! (entries) lower triangle, column by column
      real(wp), public :: fill = 0                             !! entries of the factor
      real(wp), public :: operations = 0                       !! floating point operations of a factorisation
   contains
      procedure :: analyze => analyze_cholmod
      procedure :: count_work => count_work_cholmod
      procedure :: factorize => factorize_cholmod
      procedure :: backsolve => backsolve_cholmod
      final :: free_cholmod
   end type cholmod_solver_type

   interface
      function rockdda_cholmod_new() result(handle) bind(c)
         import :: c_ptr
         type(c_ptr) :: handle
      end function rockdda_cholmod_new

      subroutine rockdda_cholmod_free(handle) bind(c)
         import :: c_ptr
         type(c_ptr), value :: handle
      end subroutine rockdda_cholmod_free

      function rockdda_cholmod_analyze(handle, nb, bp, bi, m, p, i, fill, flops) result(status) bind(c)
         import :: c_ptr, c_int, c_int64_t, c_double
         type(c_ptr), value :: handle
         integer(c_int64_t), value :: nb, m
         integer(c_int64_t), intent(in) :: bp(*), bi(*), p(*), i(*)
         real(c_double), intent(inout) :: fill, flops
         integer(c_int) :: status
      end function rockdda_cholmod_analyze

      function rockdda_cholmod_factorize(handle, n, p, i, x, least, failed) result(status) bind(c)
         import :: c_ptr, c_int, c_int64_t, c_double
         type(c_ptr), value :: handle
         integer(c_int64_t), value :: n
         integer(c_int64_t), intent(in) :: p(*), i(*)
         real(c_double), intent(in) :: x(*)
         real(c_double), value :: least
         integer(c_int64_t), intent(out) :: failed
         integer(c_int) :: status
      end function rockdda_cholmod_factorize

      function rockdda_cholmod_solve(handle, n, b, x) result(status) bind(c)
         import :: c_ptr, c_int, c_int64_t, c_double
         type(c_ptr), value :: handle
         integer(c_int64_t), value :: n
         real(c_double), intent(in) :: b(*)
         real(c_double), intent(inout) :: x(*)
         integer(c_int) :: status
      end function rockdda_cholmod_solve
   end interface

contains

   !> Order the blocks and factorise symbolically, unless this pattern has been analysed already.
   subroutine analyze_cholmod(self, matrix, error)
      class(cholmod_solver_type), intent(inout) :: self
      type(block_matrix_type), intent(in) :: matrix
      type(error_type), allocatable, intent(out) :: error
      integer(c_int64_t), allocatable :: block_start(:), block_row(:)
      integer(c_int) :: status
      integer :: n_stored

      n_stored = n_stored_blocks(matrix)
      if (allocated(self%row_start)) then
         if (size(self%row_start) == matrix%n + 1 .and. size(self%column) == n_stored) then
            if (all(self%row_start == matrix%row_start) .and. all(self%column == matrix%column(1:n_stored))) return
         end if
         deallocate (self%row_start)
      end if
      if (.not. c_associated(self%handle)) then
         call check_workspace('cholmod', error)
         if (allocated(error)) return
         self%handle = rockdda_cholmod_new()
      end if
      if (.not. c_associated(self%handle)) then
         call report_status(cholmod_out_of_memory, 'start', error)
         return
      end if
      call scalar_pattern(matrix, self%column_start, self%row)
      if (allocated(self%entries)) deallocate (self%entries)
      allocate (self%entries(size(self%row)))
      block_start = int(matrix%row_start, c_int64_t) - 1
      block_row = int(matrix%column(1:n_stored), c_int64_t) - 1
      status = rockdda_cholmod_analyze(self%handle, int(matrix%n, c_int64_t), block_start, block_row, 6_c_int64_t, &
                                       self%column_start, self%row, self%fill, self%operations)
      if (status /= cholmod_ok) then
         call report_status(status, 'analysis', error)
         return
      end if
      self%column = matrix%column(1:n_stored)
      self%row_start = matrix%row_start
   end subroutine analyze_cholmod

   !> Operations and fill of the symbolic factorisation.
   subroutine count_work_cholmod(self, matrix, operations, fill, error)
      class(cholmod_solver_type), intent(inout) :: self
      type(block_matrix_type), intent(in) :: matrix
      real(wp), intent(out) :: operations, fill
      type(error_type), allocatable, intent(out) :: error
      call self%analyze(matrix, error)
      operations = self%operations
      fill = self%fill
   end subroutine count_work_cholmod

   !> Factorise K, with the present analysis when the pattern is the same.
   subroutine factorize_cholmod(self, matrix, error)
      class(cholmod_solver_type), intent(inout) :: self
      type(block_matrix_type), intent(in) :: matrix
      type(error_type), allocatable, intent(out) :: error
      integer(c_int64_t) :: failed
      integer(c_int) :: status
      call self%analyze(matrix, error)
      if (allocated(error)) return
      call fill_entries(matrix, self%entries)
      status = rockdda_cholmod_factorize(self%handle, 6_c_int64_t*matrix%n, self%column_start, self%row, &
                                         self%entries, least_pivot, failed)
      if (status == cholmod_not_positive_definite) then
         call not_positive_definite(int(failed/6) + 1, error)
      else if (status /= cholmod_ok) then
         call report_status(status, 'factorisation', error)
      end if
   end subroutine factorize_cholmod

   !> x = K^-1 b.
   subroutine backsolve_cholmod(self, b, x, error)
      class(cholmod_solver_type), intent(inout) :: self
      real(wp), intent(in), contiguous :: b(:, :)
      real(wp), intent(inout), contiguous :: x(:, :)
      type(error_type), allocatable, intent(out) :: error
      integer(c_int) :: status
      status = rockdda_cholmod_solve(self%handle, int(size(b), c_int64_t), b, x)
      if (status /= cholmod_ok) call report_status(status, 'solution', error)
   end subroutine backsolve_cholmod

   !> Pattern of the lower triangle in scalar compressed columns: row i of the upper half, transposed, is
   !> block column i of the lower one.
   subroutine scalar_pattern(matrix, column_start, row)
      type(block_matrix_type), intent(in) :: matrix
      integer(c_int64_t), allocatable, intent(out) :: column_start(:)  !! (6n + 1), 0-based
      integer(c_int64_t), allocatable, intent(out) :: row(:)           !! 0-based
      integer(c_int64_t) :: place
      integer :: i, k, c, r
      allocate (column_start(6*matrix%n + 1))
      allocate (row(21_c_int64_t*matrix%n + 36_c_int64_t*(n_stored_blocks(matrix) - matrix%n)))
      place = 0
      do i = 1, matrix%n
         do c = 1, 6
            column_start(6*(i - 1) + c) = place
            do r = c, 6
               place = place + 1
               row(place) = 6*(i - 1) + r - 1
            end do
            do k = matrix%row_start(i) + 1, matrix%row_start(i + 1) - 1
               do r = 1, 6
                  place = place + 1
                  row(place) = 6*(matrix%column(k) - 1) + r - 1
               end do
            end do
         end do
      end do
      column_start(6*matrix%n + 1) = place
   end subroutine scalar_pattern

   !> Values in the order of `scalar_pattern`.
   pure subroutine fill_entries(matrix, entries)
      type(block_matrix_type), intent(in) :: matrix
      real(c_double), intent(inout) :: entries(:)   !! (entries)
      integer(c_int64_t) :: place
      integer :: i, k, c
      place = 0
      do i = 1, matrix%n
         do c = 1, 6
            entries(place + 1:place + 7 - c) = matrix%values(c:6, c, matrix%row_start(i))
            place = place + 7 - c
            do k = matrix%row_start(i) + 1, matrix%row_start(i + 1) - 1
               entries(place + 1:place + 6) = matrix%values(c, :, k)
               place = place + 6
            end do
         end do
      end do
   end subroutine fill_entries

   !> Turn a status of CHOLMOD into an error.
   pure subroutine report_status(status, what, error)
      integer(c_int), intent(in) :: status        !! CHOLMOD_... of cholmod_core.h
      character(len=*), intent(in) :: what        !! the operation, for the message
      type(error_type), allocatable, intent(out) :: error
      if (status == cholmod_out_of_memory) then
         call make_error(error, error_code%computation, 'CHOLMOD '//what//': out of memory; choose pcg', &
                         is_fatal=.true.)
      else
         call make_error(error, error_code%internal, 'CHOLMOD '//what//' failed with status '//to_string(int(status)))
      end if
   end subroutine report_status

   !> Free the memory of CHOLMOD.
   impure elemental subroutine free_cholmod(self)
      type(cholmod_solver_type), intent(inout) :: self
      if (c_associated(self%handle)) call rockdda_cholmod_free(self%handle)
      self%handle = c_null_ptr
   end subroutine free_cholmod

end module rockdda_linear_cholmod
