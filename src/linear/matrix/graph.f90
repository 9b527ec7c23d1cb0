! SPDX-License-Identifier: MIT
!> Graph of the blocks in contact: neighbours on both sides of the diagonal, orderings, colours.
!>
!> The matrix stores its upper half; the graph lists all neighbours of every block, each with the place of the
!> stored 6x6 block, to be transposed when the neighbour has the smaller number:
!>
!>     row i      neighbour(start(i) : start(i+1)-1)   ascending, without i
!>                place(...)                           of block (min, max) in the matrix
module rockdda_linear_graph
   use rockdda_linear_matrix, only : block_matrix_type, n_stored_blocks
   implicit none
   private
   public :: graph_type, reverse_cuthill_mckee, colour_blocks

   type :: graph_type
      integer :: n = 0                       !! blocks
      integer, allocatable :: start(:)       !! (n + 1)
      integer, allocatable :: neighbour(:)   !! (2 * off-diagonal blocks)
      integer, allocatable :: place(:)       !! (2 * off-diagonal blocks)
      integer, allocatable, private :: row_start(:), column(:)  !! pattern of the matrix it belongs to
   contains
      procedure :: update
   end type graph_type

contains

   !> Update to the graph of a matrix; `changed` is true when it differs from the graph before.
   subroutine update(self, matrix, changed)
      class(graph_type), intent(inout) :: self
      type(block_matrix_type), intent(in) :: matrix
      logical, intent(out) :: changed
      integer, allocatable :: next(:)
      integer :: i, j, k, n_stored

      n_stored = n_stored_blocks(matrix)
      changed = .true.
      if (allocated(self%row_start)) then
         if (size(self%row_start) == matrix%n + 1 .and. size(self%column) == n_stored) changed = &
            any(self%row_start /= matrix%row_start) .or. any(self%column /= matrix%column(1:n_stored))
      end if
      if (.not. changed) return

      self%n = matrix%n
      self%row_start = matrix%row_start
      self%column = matrix%column(1:n_stored)
      if (allocated(self%start)) deallocate (self%start, self%neighbour, self%place)
      allocate (self%start(matrix%n + 1), self%neighbour(2*(n_stored - matrix%n)), self%place(2*(n_stored - matrix%n)))
      allocate (next(matrix%n))
      do i = 1, matrix%n
         next(i) = matrix%row_start(i + 1) - matrix%row_start(i) - 1
      end do
      do k = 1, n_stored
         j = matrix%column(k)
         next(j) = next(j) + 1
      end do
      ! the diagonal was counted as its own neighbour
      self%start(1) = 1
      do i = 1, matrix%n
         self%start(i + 1) = self%start(i) + next(i) - 1
      end do
      next = self%start(1:matrix%n)
      ! smaller neighbours first: rows are visited in order, so both halves of a row ascend
      do i = 1, matrix%n
         do k = matrix%row_start(i) + 1, matrix%row_start(i + 1) - 1
            call append(matrix%column(k), i, k)
         end do
      end do
      do i = 1, matrix%n
         do k = matrix%row_start(i) + 1, matrix%row_start(i + 1) - 1
            call append(i, matrix%column(k), k)
         end do
      end do

   contains

      !> Block `to` is a neighbour of block `of`.
      subroutine append(of, to, k)
         integer, intent(in) :: of, to, k
         self%neighbour(next(of)) = to
         self%place(next(of)) = k
         next(of) = next(of) + 1
      end subroutine append

   end subroutine update

   !> Order that keeps neighbours close (Cuthill and McKee 1969, reversed): order(k) is the block in place k.
   !>
   !> Each connected component starts at the end of a longest path found by two searches; among the neighbours of
   !> a block those with few neighbours come first, equals by number. Linear in the size of the graph.
   subroutine reverse_cuthill_mckee(graph, order)
      type(graph_type), intent(in) :: graph
      integer, intent(out) :: order(:)   !! (n)
      integer, allocatable :: mark(:)
      integer :: first, last, i, root, pass

      allocate (mark(graph%n))
      mark = 0
      last = 0
      do i = 1, graph%n
         if (mark(i) /= 0) cycle
         root = i
         first = last + 1
         do pass = 1, 3
            call search(root, pass)
            root = order(last)
            if (pass < 3) last = first - 1
         end do
      end do
      order = order(graph%n:1:-1)

   contains

      !> Breadth-first search from a root; fills order(first:last).
      subroutine search(from, stamp)
         integer, intent(in) :: from, stamp
         integer :: head, k, at, begin, m, candidate
         last = first
         order(last) = from
         mark(from) = stamp
         head = first
         do while (head <= last)
            begin = last + 1
            do k = graph%start(order(head)), graph%start(order(head) + 1) - 1
               candidate = graph%neighbour(k)
               if (mark(candidate) == stamp) cycle
               mark(candidate) = stamp
               last = last + 1
               ! insertion keeps the few new ones in order of their degree
               at = last
               do m = last - 1, begin, -1
                  if (degree(order(m)) <= degree(candidate)) exit
                  order(m + 1) = order(m)
                  at = m
               end do
               order(at) = candidate
            end do
            head = head + 1
         end do
      end subroutine search

      !> Number of neighbours.
      pure integer function degree(block)
         integer, intent(in) :: block
         degree = graph%start(block + 1) - graph%start(block)
      end function degree

   end subroutine reverse_cuthill_mckee

   !> Colours such that neighbours differ; blocks in the order of their colour, by number within a colour.
   subroutine colour_blocks(graph, first, order)
      type(graph_type), intent(in) :: graph
      integer, allocatable, intent(out) :: first(:)   !! (colours + 1) order(first(c) : first(c+1)-1) has colour c
      integer, allocatable, intent(out) :: order(:)   !! (n)
      integer, allocatable :: colour(:), seen(:), next(:)
      integer :: i, k, c, n_colours

      allocate (colour(graph%n), order(graph%n), seen(graph%n + 1))
      colour = 0
      seen = 0
      n_colours = 0
      do i = 1, graph%n
         do k = graph%start(i), graph%start(i + 1) - 1
            c = colour(graph%neighbour(k))
            if (c > 0) seen(c) = i
         end do
         c = 1
         do while (seen(c) == i)
            c = c + 1
         end do
         colour(i) = c
         n_colours = max(n_colours, c)
      end do
      allocate (first(n_colours + 1), next(n_colours))
      first = 0
      do i = 1, graph%n
         first(colour(i) + 1) = first(colour(i) + 1) + 1
      end do
      first(1) = 1
      do c = 1, n_colours
         first(c + 1) = first(c + 1) + first(c)
      end do
      next = first(1:n_colours)
      do i = 1, graph%n
         order(next(colour(i))) = i
         next(colour(i)) = next(colour(i)) + 1
      end do
   end subroutine colour_blocks

end module rockdda_linear_graph
