! SPDX-License-Identifier: MIT
!> Order of the blocks of a graph in chunks that threads can sweep at the same time.
!>
!> An order that keeps neighbours close is cut into subdomains, whose number depends on the size of the model alone. The
!> blocks s that touch an earlier subdomain separate it from the interior of their own:
!>
!>     reverse Cuthill-McKee order   |   interior 1   | s2 | interior 2 | s3 | interior 3 |
!>                                   |  subdomain 1   |  subdomain 2    |  subdomain 3    |
!>
!> The new order has the interiors first (phase 1), then the separators (phase 2), and last those separator blocks that
!> touch an earlier separator (phase 3, mostly empty):
!>
!>     new order    | interior 1 | interior 2 | interior 3 | s1 | s2 | s3 |  last  |       s1 is empty
!>     chunk        |      1     |      2     |      3     | 4  | 5  | 6  |   7    |
!>     phase        |                  1                   |      2       |   3    |
!>
!> Chunks of one phase have no coupling with each other, and no coupling is dropped.
module rockdda_linear_chunk_order
   use rockdda_base_kinds, only : i8
   use rockdda_linear_graph, only : graph_type, reverse_cuthill_mckee
   implicit none
   private
   public :: chunk_order_type

   !> Blocks in a subdomain, about, and the largest number of subdomains.
   integer, parameter :: subdomain_size = 1250
   integer, parameter :: max_subdomains = 32

   type :: chunk_order_type
      integer :: n = 0                      !! blocks
      integer :: n_chunks = 0
      integer, allocatable :: first(:)      !! (n_chunks + 1) blocks first(c) : first(c+1)-1 of the new order
      integer :: phase(4) = 1               !! chunks phase(f) : phase(f+1)-1 belong to phase f
      integer, allocatable :: block(:)      !! (n) number of the block in place i of the new order
      integer, allocatable :: place(:)      !! (n) its inverse: place of block b in the new order
   contains
      procedure :: update
   end type chunk_order_type

contains

   !> Order the blocks of a graph.
   subroutine update(self, graph)
      class(chunk_order_type), intent(inout) :: self
      type(graph_type), intent(in) :: graph
      integer, allocatable :: order(:), subdomain(:), phase(:)
      integer :: n_subdomains, i, f
      n_subdomains = max(1, min(max_subdomains, graph%n/subdomain_size))
      allocate (order(graph%n), subdomain(graph%n), phase(graph%n))
      call reverse_cuthill_mckee(graph, order)
      do i = 1, graph%n
         subdomain(order(i)) = 1 + int(int(i - 1, i8)*n_subdomains/graph%n)
      end do
      call find_phases(graph, subdomain, phase)

      self%n = graph%n
      self%n_chunks = 2*n_subdomains + 1
      self%phase = [1, n_subdomains + 1, 2*n_subdomains + 1, 2*n_subdomains + 2]
      if (allocated(self%first)) deallocate (self%first, self%block, self%place)
      allocate (self%first(self%n_chunks + 1), self%block(graph%n), self%place(graph%n))
      self%first(1) = 1
      do f = 1, 3
         call list_phase(self, f, order, subdomain, phase)
      end do
      do i = 1, graph%n
         self%place(self%block(i)) = i
      end do
   end subroutine update

   !> Phase of each block: 1 interior, 2 separator, 3 separator that touches an earlier separator.
   pure subroutine find_phases(graph, subdomain, phase)
      type(graph_type), intent(in) :: graph
      integer, intent(in) :: subdomain(:)   !! (n) of each block
      integer, intent(out) :: phase(:)      !! (n)
      integer :: i, k
      phase = 1
      do i = 1, graph%n
         do k = graph%start(i), graph%start(i + 1) - 1
            if (subdomain(graph%neighbour(k)) < subdomain(i)) phase(i) = 2
         end do
      end do
      do i = 1, graph%n
         if (phase(i) == 1) cycle
         do k = graph%start(i), graph%start(i + 1) - 1
            if (phase(graph%neighbour(k)) > 1 .and. subdomain(graph%neighbour(k)) < subdomain(i)) phase(i) = 3
         end do
      end do
   end subroutine find_phases

   !> Append the blocks of one phase, subdomain by subdomain; phase 3 has one chunk for all subdomains.
   pure subroutine list_phase(self, f, order, subdomain, phase)
      type(chunk_order_type), intent(inout) :: self
      integer, intent(in) :: f                                 !! phase
      integer, intent(in) :: order(:), subdomain(:), phase(:)  !! (n) subdomains ascend along `order`
      integer :: i, c, chunk, at
      c = self%phase(f)
      at = self%first(c) - 1
      do i = 1, size(order)
         if (phase(order(i)) /= f) cycle
         chunk = min(self%phase(f) + subdomain(order(i)), self%phase(f + 1)) - 1
         do while (c < chunk)
            c = c + 1
            self%first(c) = at + 1
         end do
         at = at + 1
         self%block(at) = order(i)
      end do
      self%first(c + 1:self%phase(f + 1)) = at + 1
   end subroutine list_phase

end module rockdda_linear_chunk_order
