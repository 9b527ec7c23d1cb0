! SPDX-License-Identifier: MIT
!> The equations of one step, K x = f, put together from block terms and links.
!>
!> Block terms (elastic, inertia, loads, fixed points) are set once per attempt of a step. Links are what couples
!> two blocks: contacts first, then bolts. A link acts along two lines, normal (1) and tangential (2), each with a
!> stiffness and a force:
!>
!>     K += stiffness * [v; w] [v; w]^T,   f += force * [v; w]      v = vector_a(:, line, link), w = vector_b
!>
!> so a spring of stiffness k at length s0 has stiffness k and force -k s0, friction is a force alone, a dashpot adds
!> c/dt to the stiffness. Every block gathers its own links in the order of the table: the sums do not depend on
!> threads, and no two threads write one number.
module rockdda_assembly_equations
   use rockdda_base_kinds, only : wp
   use rockdda_linear_matrix, only : block_matrix_type
   use rockdda_linear_pattern, only : build_pattern
   implicit none
   private
   public :: equations_type

   type :: equations_type
      integer :: n_blocks = 0
      integer :: n_links = 0
      type(block_matrix_type) :: matrix
      real(wp), allocatable :: f(:, :)               !! (6, nb) right hand side
      real(wp), allocatable :: x(:, :)               !! (6, nb) solution, also the next starting guess
      real(wp), allocatable :: block_matrix(:, :, :) !! (6, 6, nb) block terms
      real(wp), allocatable :: block_load(:, :)      !! (6, nb)
      real(wp), allocatable :: block_magnitude(:, :) !! (6, nb) sum of the magnitudes of what block_load is made of
      real(wp), allocatable :: magnitude(:, :)       !! (6, nb) the same for f, of the last full assembly
      integer, allocatable :: pair(:, :)             !! (2, links) blocks; 0 = the fixed outside
      integer, allocatable :: slot(:)                !! (links) stored block of the pair, 0 none
      real(wp), allocatable :: vector_a(:, :, :)     !! (6, 2, links)
      real(wp), allocatable :: vector_b(:, :, :)     !! (6, 2, links)
      real(wp), allocatable :: stiffness(:, :)       !! (2, links)
      real(wp), allocatable :: force(:, :)           !! (2, links)
      integer, allocatable :: start(:), incident(:)  !! links of block i: incident(start(i)+1 : start(i+1)); < 0: as b
   contains
      procedure :: set_size
      procedure :: set_graph
      procedure :: assemble
      procedure :: assemble_loads
   end type equations_type

contains

   !> Room for nb blocks and n links.
   pure subroutine set_size(self, n_blocks, n_links)
      class(equations_type), intent(inout) :: self
      integer, intent(in) :: n_blocks, n_links
      integer :: m
      self%n_blocks = n_blocks
      self%n_links = n_links
      if (.not. allocated(self%f)) then
         allocate (self%f(6, n_blocks), self%x(6, n_blocks), self%block_load(6, n_blocks), &
                   self%block_magnitude(6, n_blocks), self%magnitude(6, n_blocks), &
                   self%block_matrix(6, 6, n_blocks), source=0.0_wp)
         allocate (self%start(n_blocks + 1), source=0)
      end if
      if (allocated(self%slot)) then
         if (size(self%slot) >= n_links) return
         deallocate (self%pair, self%slot, self%vector_a, self%vector_b, self%stiffness, self%force, self%incident)
      end if
      m = n_links + n_links/4 + 16
      allocate (self%pair(2, m), self%slot(m), self%incident(2*m), source=0)
      allocate (self%vector_a(6, 2, m), self%vector_b(6, 2, m), self%stiffness(2, m), self%force(2, m), source=0.0_wp)
   end subroutine set_size

   !> Pattern of K and the links of each block, from `pair`.
   subroutine set_graph(self)
      class(equations_type), intent(inout) :: self
      integer, allocatable :: inner(:, :), slots(:), number(:)
      integer :: c, i, k, n_inner, side
      allocate (inner(2, self%n_links), number(self%n_links))
      n_inner = 0
      do c = 1, self%n_links
         self%slot(c) = 0
         if (any(self%pair(:, c) == 0)) cycle
         n_inner = n_inner + 1
         inner(:, n_inner) = self%pair(:, c)
         number(n_inner) = c
      end do
      allocate (slots(n_inner))
      call build_pattern(self%n_blocks, inner(:, 1:n_inner), self%matrix, slots)
      self%slot(number(1:n_inner)) = slots

      self%start = 0
      do c = 1, self%n_links
         do side = 1, 2
            i = self%pair(side, c)
            if (i > 0) self%start(i + 1) = self%start(i + 1) + 1
         end do
      end do
      do i = 2, self%n_blocks + 1
         self%start(i) = self%start(i) + self%start(i - 1)
      end do
      do c = 1, self%n_links
         do side = 1, 2
            i = self%pair(side, c)
            if (i == 0) cycle
            k = self%start(i) + 1
            self%start(i) = k
            self%incident(k) = merge(c, -c, side == 1)
         end do
      end do
      do i = self%n_blocks + 1, 2, -1
         self%start(i) = self%start(i - 1)
      end do
      self%start(1) = 0
   end subroutine set_graph

   !> Block terms plus all links with their present stiffness and force.
   subroutine assemble(self)
      class(equations_type), intent(inout) :: self
      integer :: i
      !$omp parallel do default(none) shared(self) private(i) schedule(static) if (self%n_blocks > 4000)
      do i = 1, self%n_blocks
         call assemble_row(i, self%start(i) + 1, self%start(i + 1), self%matrix%row_start(i), &
                           self%matrix%row_start(i + 1) - 1, self)
      end do
      !$omp end parallel do
      self%matrix%values_id = mod(self%matrix%values_id, huge(1)) + 1
   end subroutine assemble

   !> The load alone, for links whose forces changed while their stiffness did not: the same sums as in `assemble`.
   subroutine assemble_loads(self)
      class(equations_type), intent(inout) :: self
      integer :: i, l, c, line
      !$omp parallel do default(none) shared(self) private(i, l, c, line) schedule(static) if (self%n_blocks > 4000)
      do i = 1, self%n_blocks
         self%f(:, i) = self%block_load(:, i)
         do l = self%start(i) + 1, self%start(i + 1)
            c = abs(self%incident(l))
            do line = 1, 2
               if (.not. abs(self%force(line, c)) > 0) cycle
               if (self%incident(l) > 0) then
                  self%f(:, i) = self%f(:, i) + self%force(line, c)*self%vector_a(:, line, c)
               else
                  self%f(:, i) = self%f(:, i) + self%force(line, c)*self%vector_b(:, line, c)
               end if
            end do
         end do
      end do
      !$omp end parallel do
   end subroutine assemble_loads

   !> One block row: its diagonal block, the stored blocks right of it, its load.
   pure subroutine assemble_row(i, first_link, last_link, first_slot, last_slot, eq)
      integer, intent(in) :: i, first_link, last_link, first_slot, last_slot
      class(equations_type), intent(inout) :: eq
      real(wp) :: v(6), w(6), k
      integer :: l, c, other, line, j, slot
      eq%matrix%values(:, :, first_slot) = eq%block_matrix(:, :, i)
      eq%matrix%values(:, :, first_slot + 1:last_slot) = 0
      eq%f(:, i) = eq%block_load(:, i)
      eq%magnitude(:, i) = eq%block_magnitude(:, i)
      do l = first_link, last_link
         c = abs(eq%incident(l))
         slot = eq%slot(c)
         other = merge(eq%pair(2, c), eq%pair(1, c), eq%incident(l) > 0)
         do line = 1, 2
            if (eq%incident(l) > 0) then
               v = eq%vector_a(:, line, c)
               w = eq%vector_b(:, line, c)
            else
               v = eq%vector_b(:, line, c)
               w = eq%vector_a(:, line, c)
            end if
            k = eq%stiffness(line, c)
            if (abs(k) > 0) then
               do j = 1, 6
                  eq%matrix%values(:, j, first_slot) = eq%matrix%values(:, j, first_slot) + k*(v(j)*v)
               end do
               if (slot > 0 .and. i < other) then
                  do j = 1, 6
                     eq%matrix%values(:, j, slot) = eq%matrix%values(:, j, slot) + (k*w(j))*v
                  end do
               end if
            end if
            if (abs(eq%force(line, c)) > 0) then
               eq%f(:, i) = eq%f(:, i) + eq%force(line, c)*v
               eq%magnitude(:, i) = eq%magnitude(:, i) + abs(eq%force(line, c)*v)
            end if
         end do
      end do
   end subroutine assemble_row

end module rockdda_assembly_equations
