! SPDX-License-Identifier: MIT
!> Order of elimination of the blocks of a small system, and the pattern of its Cholesky factor.
!>
!> Eliminating a block joins all its neighbours with each other. The next one is that which adds the fewest new pairs
!> (the third scheme of Tinney and Walker 1967); of equals the one with fewer neighbours, then that with the lower
!> number, so that the order depends on the graph alone. Places in the order are called columns:
!>
!>     column k       row(start(k) : start(k+1)-1)     ascending, the blocks of the factor below the diagonal
!>     place(...)     of the block in the matrix, negative: transposed, 0: not in the matrix
!>     column j       source(source_start(j) : source_start(j+1)-1)   blocks L_jk in row j, by their place in `row`
!>
!> Which blocks are joined is kept as a square array, so that the search takes memory that grows with the square of the
!> number of blocks.
module rockdda_linear_elimination
   use rockdda_linear_graph, only : graph_type
   implicit none
   private
   public :: elimination_type

   type :: elimination_type
      integer :: n = 0                          !! blocks
      integer :: n_blocks = 0                   !! of the factor below the diagonal
      integer :: n_products = 0                 !! of two blocks, in a factorisation
      integer, allocatable :: block(:)          !! (n) block of each column
      integer, allocatable :: start(:)          !! (n + 1)
      integer, allocatable :: row(:), place(:)  !! (n_blocks)
      integer, allocatable :: column(:)         !! (n_blocks) column that each block is in
      integer, allocatable :: first_target(:)   !! (n_blocks) of the products of each block, in `target`
      integer, allocatable :: target(:)         !! places of the products of L_jk with the blocks after it in column k
      integer, allocatable :: source_start(:)   !! (n + 1)
      integer, allocatable :: source(:)         !! (n_blocks)
   contains
      procedure :: analyze
   end type elimination_type

contains

   !> Find the order and the pattern for a graph.
   subroutine analyze(self, graph)
      class(elimination_type), intent(inout) :: self
      type(graph_type), intent(in) :: graph
      integer, allocatable :: column_of(:)   !! (n)
      integer, allocatable :: later(:, :)    !! (n, n) blocks that each column is joined with when it is eliminated
      integer, allocatable :: n_later(:)     !! (n)
      integer :: k, m, p
      self%n = graph%n
      allocate (column_of(graph%n), later(graph%n, graph%n), n_later(graph%n))
      call eliminate(graph, self%block, later, n_later)
      do k = 1, self%n
         column_of(self%block(k)) = k
      end do
      self%n_blocks = sum(n_later)
      self%n_products = sum((n_later*(n_later + 1))/2)
      if (allocated(self%start)) deallocate (self%start, self%row, self%place, self%column, self%source_start, &
                                             self%source, self%first_target, self%target)
      allocate (self%start(self%n + 1), self%row(self%n_blocks), self%place(self%n_blocks), &
                self%column(self%n_blocks), self%source_start(self%n + 1), self%source(self%n_blocks), &
                self%first_target(self%n_blocks), self%target(self%n_products - self%n_blocks))
      self%start(1) = 1
      do k = 1, self%n
         self%start(k + 1) = self%start(k) + n_later(k)
         associate (rows => self%row(self%start(k):self%start(k + 1) - 1))
            rows = column_of(later(1:n_later(k), k))
            call sort(rows)
         end associate
         self%column(self%start(k):self%start(k + 1) - 1) = k
      end do
      call find_places(self, graph, column_of)
      ! columns are visited in order, so that those of each row ascend
      n_later = 0
      do p = 1, self%n_blocks
         n_later(self%row(p)) = n_later(self%row(p)) + 1
      end do
      self%source_start(1) = 1
      do k = 1, self%n
         self%source_start(k + 1) = self%source_start(k) + n_later(k)
      end do
      n_later = self%source_start(1:self%n)
      do p = 1, self%n_blocks
         m = self%row(p)
         self%source(n_later(m)) = p
         n_later(m) = n_later(m) + 1
      end do
      call find_targets(self)
   end subroutine analyze

   !> Places of the products L_ik L_jk^T in column j.
   pure subroutine find_targets(self)
      type(elimination_type), intent(inout) :: self
      integer :: m, n, p, q
      n = 0
      do p = 1, self%n_blocks
         self%first_target(p) = n + 1
         ! rows of column k after j are rows of column j, too, in the same order
         m = self%start(self%row(p))
         do q = p + 1, self%start(self%column(p) + 1) - 1
            do while (self%row(m) /= self%row(q))
               m = m + 1
            end do
            n = n + 1
            self%target(n) = m
         end do
      end do
   end subroutine find_targets

   !> The order, and the blocks that remain joined with each when it is eliminated.
   pure subroutine eliminate(graph, order, later, n_later)
      type(graph_type), intent(in) :: graph
      integer, allocatable, intent(out) :: order(:)    !! (n)
      integer, intent(out) :: later(:, :)              !! (n, n)
      integer, intent(out) :: n_later(:)               !! (n)
      integer, allocatable :: near(:, :)               !! (n, n) blocks that each is joined with
      integer :: n_near(graph%n), fill(graph%n)
      logical, allocatable :: joined(:, :)             !! (n, n)
      logical :: is_new(graph%n), is_done(graph%n)
      integer :: i, j, k, a, b, chosen
      allocate (near(graph%n, graph%n))
      allocate (joined(graph%n, graph%n), source=.false.)
      do i = 1, graph%n
         n_near(i) = graph%start(i + 1) - graph%start(i)
         near(1:n_near(i), i) = graph%neighbour(graph%start(i):graph%start(i + 1) - 1)
         joined(near(1:n_near(i), i), i) = .true.
      end do
      allocate (order(graph%n))
      is_done = .false.
      is_new = .true.
      do k = 1, graph%n
         chosen = 0
         do i = 1, graph%n
            if (is_done(i)) cycle
            if (is_new(i)) fill(i) = missing_pairs(near(1:n_near(i), i), joined)
            is_new(i) = .false.
            if (chosen > 0) then
               if (fill(i) > fill(chosen)) cycle
               if (fill(i) == fill(chosen) .and. n_near(i) >= n_near(chosen)) cycle
            end if
            chosen = i
         end do
         order(k) = chosen
         is_done(chosen) = .true.
         n_later(k) = n_near(chosen)
         later(1:n_later(k), k) = near(1:n_later(k), chosen)
         do a = 1, n_later(k)
            i = later(a, k)
            call remove(chosen, near(:, i), n_near(i))
         end do
         do a = 1, n_later(k)
            i = later(a, k)
            if (fill(chosen) > 0) then
               do b = 1, n_later(k)
                  j = later(b, k)
                  if (j == i .or. joined(j, i)) cycle
                  joined(j, i) = .true.
                  n_near(i) = n_near(i) + 1
                  near(n_near(i), i) = j
               end do
               is_new(near(1:n_near(i), i)) = .true.
            end if
            is_new(i) = .true.
         end do
      end do
   end subroutine eliminate

   !> Pairs of these blocks that are not joined.
   pure integer function missing_pairs(near, joined) result(n)
      integer, intent(in) :: near(:)
      logical, intent(in) :: joined(:, :)
      integer :: a, b
      n = 0
      do a = 2, size(near)
         do b = 1, a - 1
            if (.not. joined(near(b), near(a))) n = n + 1
         end do
      end do
   end function missing_pairs

   !> Remove a number from a list.
   pure subroutine remove(number, list, n)
      integer, intent(in) :: number
      integer, intent(inout) :: list(:), n
      integer :: a
      do a = 1, n
         if (list(a) /= number) cycle
         list(a) = list(n)
         n = n - 1
         return
      end do
   end subroutine remove

   !> Sort a short list.
   pure subroutine sort(list)
      integer, intent(inout) :: list(:)
      integer :: a, b, number
      do a = 2, size(list)
         number = list(a)
         do b = a - 1, 1, -1
            if (list(b) <= number) exit
            list(b + 1) = list(b)
         end do
         list(b + 1) = number
      end do
   end subroutine sort

   !> Places of the blocks of the factor in the matrix.
   pure subroutine find_places(self, graph, column_of)
      type(elimination_type), intent(inout) :: self
      type(graph_type), intent(in) :: graph
      integer, intent(in) :: column_of(:)       !! (n)
      integer :: at(graph%n), i, j, k, m, p
      at = 0
      do k = 1, self%n
         self%place(self%start(k):self%start(k + 1) - 1) = 0
         do p = self%start(k), self%start(k + 1) - 1
            at(self%row(p)) = p
         end do
         i = self%block(k)
         do m = graph%start(i), graph%start(i + 1) - 1
            j = graph%neighbour(m)
            if (column_of(j) < k) cycle
            ! L_jk belongs to K_ji: stored as K_ij where i is the lower number
            self%place(at(column_of(j))) = merge(-graph%place(m), graph%place(m), i < j)
         end do
      end do
   end subroutine find_places

end module rockdda_linear_elimination
