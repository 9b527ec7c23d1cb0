! SPDX-License-Identifier: MIT
!> A coarse space for conjugate gradients: groups of blocks that move like one larger block.
!>
!> Each group has six unknowns, rigid motion and uniform strain about its centre (columns of Z). The iteration is kept
!> free of these motions, which it would find slowest (deflation, Nicolaides 1987, SIAM J. Numer. Anal. 24, 355-365): a
!> direction s = M^-1 r becomes
!>
!>     s - Z a,    (Z^T K Z) a = (K Z)^T s,
!>
!> so that it does no work on them, and each pass begins with their exact correction Z (Z^T K Z)^-1 Z^T r.
!>
!> In the scaled variables of rockdda_linear_preconditioner (^ marks scaled blocks, K^ = G^-1 K G^-T) three arrays are
!> needed, of which a row has one block for itself and, near the border of its group, one for each group beside:
!>
!>     own      Z^ = G^T Z                  of each block, for its own group
!>     later    L^T Z^                      row i: couplings with blocks of later places
!>     forces   (K^ Z^)^T                   group by group: blocks of the group and their neighbours
!>
!> Any division into groups makes a valid coarse space. It is made of the centroids, so that it is the same after a
!> restart of the run, and for any number of threads; sums are taken group by group.
!>
!> The Cholesky factor of Z^T K Z, a small symmetric matrix of 6x6 blocks, is stored from the first block of each row to
!> the diagonal.
!>
!>     row 4      .  K42  K43  K44        first(4) = 2; K43 may be zero, the factor fills it
!>
!> Nothing fills in before the first block of a row.
module rockdda_linear_deflation
   use rockdda_base_kinds, only : wp, i8
   use rockdda_linear_matrix, only : block_matrix_type
   use rockdda_linear_graph, only : graph_type, reverse_cuthill_mckee
   use rockdda_linear_chunk_order, only : chunk_order_type
   use rockdda_linear_preconditioner, only : preconditioner_type
   use rockdda_linear_small_blocks, only : invert_packed, n_packed, scale_rows, unpack_lower, factorize_block, &
      invert_lower
   use rockdda_linear_kernels, only : sp, pack_block, pack_transposed, subtract_products
   implicit none
   private
   public :: deflation_type, divide_by_place, coarse_factor_type

   type :: coarse_factor_type
      integer :: n = 0                          !! rows of blocks
      integer, allocatable :: first(:)          !! (n) first column of each row
      integer, allocatable :: offset(:)         !! (n) block (i, j) is values(:, :, offset(i) + j)
      real(wp), allocatable :: values(:, :, :)  !! (6, 6, blocks) the matrix
      real(wp), allocatable, private :: l(:, :, :)  !! (6, 6, blocks) its factor, the diagonal blocks inverted
   contains
      procedure :: set_pattern => set_coarse_pattern
      procedure :: factorize => factorize_coarse
      procedure :: solve => solve_with_factor
   end type coarse_factor_type

   !> Blocks in a group, about, and the largest number of groups.
   integer, parameter :: group_size = 48, max_groups = 1000

   type :: deflation_type
      integer :: n_groups = 0
      integer, allocatable :: group(:)          !! (n) of the block in each place of the new order
      integer, allocatable :: later_start(:)    !! (n + 1) rows of `later`
      integer, allocatable :: later_group(:)    !! group of each of its blocks
      real(sp), allocatable :: own(:, :)        !! (36, n), packed as in rockdda_linear_kernels
      real(sp), allocatable :: later(:, :)      !! (36, ...)
      real(sp), allocatable :: a(:, :)          !! (6, groups) minus the unknowns of the last coarse solve
      integer, allocatable, private :: member_start(:), member(:)  !! places of the blocks of each group
      integer, allocatable, private :: slot_start(:)   !! (n + 1) groups that a block touches, its own first:
      integer, allocatable, private :: slot_group(:)
      integer, allocatable, private :: slot_force(:)   !! place in `forces`
      integer, allocatable, private :: slot_later(:)   !! place in `later`, 0: none
      integer, allocatable, private :: force_start(:), force_row(:)   !! (groups + 1); place of each block
      real(sp), allocatable, private :: forces(:, :)   !! (36, ...)
      real(wp), allocatable, private :: arm(:, :)      !! (2, n) centroid less the centre of the group
      real(wp), allocatable, private :: load(:, :)     !! (6, groups)
      real(wp), allocatable, private :: centroid(:, :) !! (2, n) of which the groups were made
      integer, private :: graph_id = 0                 !! graph that the lists belong to, 0: none
      type(coarse_factor_type), private :: factor
   contains
      procedure :: set_pattern
      procedure :: set_values
      procedure :: restrict_residual
      procedure :: restrict_sweep
      procedure :: solve_coarse
   end type deflation_type

contains

   !> Divide the blocks into groups and list what touches what, unless nothing is new.
   subroutine set_pattern(self, graph, graph_id, order, centroid, is_new)
      class(deflation_type), intent(inout) :: self
      type(graph_type), intent(in) :: graph
      integer, intent(in) :: graph_id          !! number of the graph, > 0
      type(chunk_order_type), intent(in) :: order
      real(wp), intent(in) :: centroid(:, :)   !! (2, n) [length]
      logical, intent(out) :: is_new
      integer, allocatable :: group(:), place(:)
      integer :: i
      logical :: same
      same = self%graph_id == graph_id
      if (same) same = size(self%centroid, 2) == graph%n
      if (same) same = all(abs(self%centroid - centroid) <= 0)
      is_new = .not. same
      if (same) return
      self%graph_id = graph_id
      self%centroid = centroid
      self%n_groups = max(1, min(max_groups, graph%n/group_size))
      allocate (group(graph%n), place(self%n_groups))
      call divide_by_place(centroid, self%n_groups, group)
      call order_groups(graph, group, self%n_groups, place)
      self%group = [(place(group(order%block(i))), i=1, graph%n)]
      call list_members(self, order)
      call list_slots(self, graph, order)
      call list_forces(self)
   end subroutine set_pattern

   !> Places of the groups in an order that keeps those in contact close.
   subroutine order_groups(graph, group, n_groups, place)
      type(graph_type), intent(in) :: graph
      integer, intent(in) :: group(:)     !! (n) of each block
      integer, intent(in) :: n_groups
      integer, intent(out) :: place(:)    !! (groups)
      type(graph_type) :: between
      logical, allocatable :: touch(:, :)
      integer, allocatable :: order(:)
      integer :: i, k, g
      allocate (touch(n_groups, n_groups), source=.false.)
      do i = 1, graph%n
         do k = graph%start(i), graph%start(i + 1) - 1
            touch(group(graph%neighbour(k)), group(i)) = .true.
         end do
      end do
      allocate (between%start(n_groups + 1), between%neighbour(count(touch)), order(n_groups))
      between%n = n_groups
      between%start(1) = 1
      do g = 1, n_groups
         touch(g, g) = .false.
         between%start(g + 1) = between%start(g) + count(touch(:, g))
         between%neighbour(between%start(g):between%start(g + 1) - 1) = pack([(i, i=1, n_groups)], touch(:, g))
      end do
      call reverse_cuthill_mckee(between, order)
      place(order) = [(g, g=1, n_groups)]
   end subroutine order_groups

   !> Blocks of each group, and their arms.
   subroutine list_members(self, order)
      class(deflation_type), intent(inout) :: self
      type(chunk_order_type), intent(in) :: order
      real(wp), allocatable :: centre(:, :)
      integer :: i, g
      call count_into(self%group, self%n_groups, self%member_start, self%member)
      allocate (centre(2, self%n_groups))
      do g = 1, self%n_groups
         centre(:, g) = 0
         do i = self%member_start(g), self%member_start(g + 1) - 1
            centre(:, g) = centre(:, g) + self%centroid(:, order%block(self%member(i)))
         end do
         centre(:, g) = centre(:, g)/max(1, self%member_start(g + 1) - self%member_start(g))
      end do
      if (allocated(self%arm)) deallocate (self%arm)
      allocate (self%arm(2, order%n))
      do i = 1, order%n
         self%arm(:, i) = self%centroid(:, order%block(i)) - centre(:, self%group(i))
      end do
   end subroutine list_members

   !> Numbers 1, 2, ... sorted by their keys, equal ones ascending: those of key g are item(start(g):start(g+1)-1).
   pure subroutine count_into(key, n_keys, start, item)
      integer, intent(in) :: key(:)      !! 1 to n_keys
      integer, intent(in) :: n_keys
      integer, allocatable, intent(out) :: start(:)   !! (n_keys + 1)
      integer, allocatable, intent(out) :: item(:)    !! (size(key))
      integer :: next(n_keys), i
      allocate (start(n_keys + 1), item(size(key)))
      start = 0
      do i = 1, size(key)
         start(key(i) + 1) = start(key(i) + 1) + 1
      end do
      start(1) = 1
      do i = 1, n_keys
         start(i + 1) = start(i + 1) + start(i)
      end do
      next = start(1:n_keys)
      do i = 1, size(key)
         item(next(key(i))) = i
         next(key(i)) = next(key(i)) + 1
      end do
   end subroutine count_into

   !> Groups that each block touches, and rows of `later`.
   subroutine list_slots(self, graph, order)
      class(deflation_type), intent(inout) :: self
      type(graph_type), intent(in) :: graph
      type(chunk_order_type), intent(in) :: order
      integer :: i, j, k, g, block, n_slots, n_later, most
      most = order%n + size(graph%neighbour)
      if (allocated(self%slot_start)) deallocate (self%slot_start, self%slot_group, self%slot_later, self%later_start, &
         self%later_group, self%later, self%own)
      allocate (self%slot_start(order%n + 1), self%slot_group(most), self%slot_later(most), &
                self%later_start(order%n + 1), self%later_group(most))
      n_slots = 0
      n_later = 0
      do i = 1, order%n
         self%slot_start(i) = n_slots + 1
         self%later_start(i) = n_later + 1
         block = order%block(i)
         call touch(self%group(i), .false.)
         do k = graph%start(block), graph%start(block + 1) - 1
            j = order%place(graph%neighbour(k))
            call touch(self%group(j), j > i)
         end do
      end do
      self%slot_start(order%n + 1) = n_slots + 1
      self%later_start(order%n + 1) = n_later + 1
      self%slot_group = self%slot_group(1:n_slots)
      self%slot_later = self%slot_later(1:n_slots)
      self%later_group = self%later_group(1:n_later)
      allocate (self%later(36, n_later), self%own(36, order%n))

   contains

      !> Block i touches a group, with a block of a later place or not.
      subroutine touch(touched, is_later)
         integer, intent(in) :: touched
         logical, intent(in) :: is_later
         do g = self%slot_start(i), n_slots
            if (self%slot_group(g) == touched) exit
         end do
         if (g > n_slots) then
            n_slots = g
            self%slot_group(g) = touched
            self%slot_later(g) = 0
         end if
         if (self%slot_later(g) /= 0 .or. .not. is_later) return
         n_later = n_later + 1
         self%slot_later(g) = n_later
         self%later_group(n_later) = touched
      end subroutine touch

   end subroutine list_slots

   !> Rows of `forces`, and the pattern of the coarse matrix.
   subroutine list_forces(self)
      class(deflation_type), intent(inout) :: self
      integer, allocatable :: slot(:), first(:)
      integer :: i, k
      call count_into(self%slot_group, self%n_groups, self%force_start, slot)
      allocate (first(self%n_groups))
      first = [(i, i=1, self%n_groups)]
      if (allocated(self%slot_force)) deallocate (self%slot_force, self%force_row, self%forces, self%load, self%a)
      allocate (self%slot_force(size(slot)), self%force_row(size(slot)), self%forces(36, size(slot)), &
                self%load(6, self%n_groups), self%a(6, self%n_groups))
      do k = 1, size(slot)
         self%slot_force(slot(k)) = k
      end do
      do i = 1, size(self%group)
         do k = self%slot_start(i), self%slot_start(i + 1) - 1
            self%force_row(self%slot_force(k)) = i
            first(self%group(i)) = min(first(self%group(i)), self%slot_group(k))
         end do
      end do
      call self%factor%set_pattern(first)
   end subroutine list_forces

   !> Products with a new matrix, prepared in the preconditioner, and the factor of the coarse matrix.
   subroutine set_values(self, matrix, graph, preconditioner, changed_rows_only, ok)
      class(deflation_type), intent(inout) :: self
      type(block_matrix_type), intent(in) :: matrix
      type(graph_type), intent(in) :: graph
      type(preconditioner_type), intent(in) :: preconditioner
      logical, intent(in) :: changed_rows_only !! the values present are those of the matrix base_id
      logical, intent(out) :: ok               !! the coarse matrix is positive definite
      integer :: g
      !$omp parallel do default(none) shared(self, matrix, graph, preconditioner, changed_rows_only) private(g) &
      !$omp schedule(static) if (preconditioner%order%n_chunks > 3)
      do g = 1, self%n_groups
         if (changed_rows_only) then
            associate (members => self%member(self%member_start(g):self%member_start(g + 1) - 1))
               if (.not. any(matrix%changed(preconditioner%order%block(members)))) cycle
            end associate
         end if
         call multiply_group(self, matrix, graph, preconditioner, g)
      end do
      !$omp end parallel do
      call self%factor%factorize(ok)
   end subroutine set_values

   !> Products of the rows of one group.
   subroutine multiply_group(self, matrix, graph, preconditioner, g)
      class(deflation_type), intent(inout) :: self
      type(block_matrix_type), intent(in) :: matrix
      type(graph_type), intent(in) :: graph
      type(preconditioner_type), intent(in) :: preconditioner
      integer, intent(in) :: g
      real(wp), allocatable :: all_of(:, :, :), later(:, :, :)
      real(wp) :: scale(6, 6)
      integer :: m, i, k, most
      associate (coarse => self%factor)
         coarse%values(:, :, coarse%offset(g) + coarse%first(g):coarse%offset(g) + g) = 0
         most = 1
         do m = self%member_start(g), self%member_start(g + 1) - 1
            most = max(most, self%slot_start(self%member(m) + 1) - self%slot_start(self%member(m)))
         end do
         allocate (all_of(6, 6, most), later(6, 6, most))
         do m = self%member_start(g), self%member_start(g + 1) - 1
            i = self%member(m)
            call multiply_row(self, matrix, graph, preconditioner%order, i, all_of, later)
            call unpack_lower(preconditioner%scale(:, i), scale)
            do k = self%slot_start(i), self%slot_start(i + 1) - 1
               associate (product => all_of(:, :, k - self%slot_start(i) + 1))
                  if (self%slot_group(k) <= g) call add_from_left( &
                     product, self%arm(:, i), coarse%values(:, :, coarse%offset(g) + self%slot_group(k)))
                  call scale_rows(scale, product)
                  call pack_transposed(product, self%forces(:, self%slot_force(k)))
               end associate
               if (self%slot_later(k) == 0) cycle
               call scale_rows(scale, later(:, :, k - self%slot_start(i) + 1))
               call pack_block(later(:, :, k - self%slot_start(i) + 1), self%later(:, self%slot_later(k)))
            end do
            call pack_own(preconditioner%scale(:, i), self%arm(:, i), self%own(:, i))
         end do
      end associate
   end subroutine multiply_group

   !> Row i of K Z, and of its part with blocks of later places, one block for each group that it touches.
   subroutine multiply_row(self, matrix, graph, order, i, all_of, later)
      class(deflation_type), intent(in) :: self
      type(block_matrix_type), intent(in) :: matrix
      type(graph_type), intent(in) :: graph
      type(chunk_order_type), intent(in) :: order
      integer, intent(in) :: i
      real(wp), intent(inout) :: all_of(6, 6, *), later(6, 6, *)   !! one for each slot
      real(wp) :: b(6, 6)
      integer :: block, j, k, s
      s = self%slot_start(i + 1) - self%slot_start(i)
      later(:, :, 1:s) = 0
      all_of(:, :, 2:s) = 0
      block = order%block(i)
      all_of(:, :, 1) = matrix%values(:, :, matrix%row_start(block))
      call times_modes(all_of(:, :, 1), self%arm(:, i))
      do k = graph%start(block), graph%start(block + 1) - 1
         j = order%place(graph%neighbour(k))
         call take(matrix, merge(graph%place(k), -graph%place(k), graph%neighbour(k) > block), b)
         call times_modes(b, self%arm(:, j))
         s = 1
         do while (self%slot_group(self%slot_start(i) + s - 1) /= self%group(j))
            s = s + 1
         end do
         all_of(:, :, s) = all_of(:, :, s) + b
         if (j > i) later(:, :, s) = later(:, :, s) + b
      end do
   end subroutine multiply_row

   !> a := a R: R is the motion of a block for rigid motion and strain of its group about a point at -arm.
   pure subroutine times_modes(a, arm)
      real(wp), intent(inout) :: a(6, 6)
      real(wp), intent(in) :: arm(2)
      a(:, 3) = a(:, 3) + (arm(1)*a(:, 2) - arm(2)*a(:, 1))
      a(:, 4) = a(:, 4) + arm(1)*a(:, 1)
      a(:, 5) = a(:, 5) + arm(2)*a(:, 2)
      a(:, 6) = a(:, 6) + 0.5_wp*(arm(2)*a(:, 1) + arm(1)*a(:, 2))
   end subroutine times_modes

   !> c := c + R^T a.
   pure subroutine add_from_left(a, arm, c)
      real(wp), intent(in) :: a(6, 6), arm(2)
      real(wp), intent(inout) :: c(6, 6)
      integer :: j
      do j = 1, 6
         c(1:2, j) = c(1:2, j) + a(1:2, j)
         c(3, j) = c(3, j) + (a(3, j) + (arm(1)*a(2, j) - arm(2)*a(1, j)))
         c(4, j) = c(4, j) + (a(4, j) + arm(1)*a(1, j))
         c(5, j) = c(5, j) + (a(5, j) + arm(2)*a(2, j))
         c(6, j) = c(6, j) + (a(6, j) + 0.5_wp*(arm(2)*a(1, j) + arm(1)*a(2, j)))
      end do
   end subroutine add_from_left

   !> G^T R of a block.
   pure subroutine pack_own(scale, arm, packed)
      real(wp), intent(in) :: scale(n_packed)  !! G^-1, lower triangle
      real(wp), intent(in) :: arm(2)
      real(sp), intent(out) :: packed(36)
      integer, parameter :: diagonal(6) = [1, 7, 12, 16, 19, 21]
      real(wp) :: l(n_packed), inverse(n_packed), g(6, 6)
      l = scale
      l(diagonal) = 1/l(diagonal)
      call invert_packed(l, inverse)
      call unpack_lower(inverse, g)
      g = transpose(g)
      call times_modes(g, arm)
      call pack_block(g, packed)
   end subroutine pack_own

   !> The block in a place of the matrix, transposed when the place is negative.
   pure subroutine take(matrix, place, a)
      type(block_matrix_type), intent(in) :: matrix
      integer, intent(in) :: place
      real(wp), intent(out) :: a(6, 6)
      integer :: j
      if (place > 0) then
         a = matrix%values(:, :, place)
      else
         do j = 1, 6
            a(j, :) = matrix%values(:, j, -place)
         end do
      end if
   end subroutine take

   !> Load of a group by forces on its blocks, Z^T r times a weight.
   pure subroutine restrict_residual(self, order, r, weight, g)
      class(deflation_type), intent(inout) :: self
      type(chunk_order_type), intent(in) :: order
      real(wp), intent(in) :: r(:, :)     !! (6, n) by number of the block
      real(wp), intent(in) :: weight
      integer, intent(in) :: g
      real(wp) :: b(6)
      integer :: m
      b = 0
      do m = self%member_start(g), self%member_start(g + 1) - 1
         associate (f => r(:, order%block(self%member(m))), arm => self%arm(:, self%member(m)))
            b = b + (f + [0.0_wp, 0.0_wp, arm(1)*f(2) - arm(2)*f(1), arm(1)*f(1), arm(2)*f(2), &
                          0.5_wp*(arm(2)*f(1) + arm(1)*f(2))])
         end associate
      end do
      self%load(:, g) = weight*b
   end subroutine restrict_residual

   !> Load of a group by the motion s of all blocks, (K^ Z^)^T s.
   pure subroutine restrict_sweep(self, s, g)
      class(deflation_type), intent(inout) :: self
      real(sp), intent(in) :: s(6, *)
      integer, intent(in) :: g
      real(sp) :: sums(4, 3)
      sums = 0
      call subtract_products(self%force_start(g), self%force_start(g + 1) - 1, self%force_row, self%forces, s, sums)
      self%load(1:2, g) = -real(sums(1:2, 1) + sums(3:4, 1), wp)
      self%load(3:4, g) = -real(sums(1:2, 2) + sums(3:4, 2), wp)
      self%load(5:6, g) = -real(sums(1:2, 3) + sums(3:4, 3), wp)
   end subroutine restrict_sweep

   !> Solve for the coarse unknowns of the loads; a := sign times them.
   pure subroutine solve_coarse(self, sign)
      class(deflation_type), intent(inout) :: self
      real(wp), intent(in) :: sign
      call self%factor%solve(self%load)
      self%a = real(sign*self%load, sp)
   end subroutine solve_coarse

   !> Divide blocks into groups of equal number, to one block, by recursive bisection across the longer side of the box
   !> around the centroids of a group (Berger and Bokhari 1987). Equal coordinates: by number of the block.
   pure subroutine divide_by_place(centroid, n_groups, group)
      real(wp), intent(in) :: centroid(:, :)   !! (2, n) [length]
      integer, intent(in) :: n_groups          !! >= 1, at most n
      integer, intent(out) :: group(:)         !! (n) group of each block, 1 to n_groups
      integer :: block(size(group))
      integer :: first(n_groups), groups(n_groups)   ! of the pieces: place of the first block, groups to be made of it
      integer :: i, at, n_pieces, last, middle, left, axis
      block = [(i, i=1, size(group))]
      first(1) = 1
      groups(1) = n_groups
      n_pieces = 1
      at = 1
      do while (at <= n_pieces)
         if (groups(at) == 1) then
            at = at + 1
            cycle
         end if
         last = size(group)
         if (at < n_pieces) last = first(at + 1) - 1
         left = groups(at)/2
         middle = first(at) - 1 + int(int(last - first(at) + 1, i8)*left/groups(at))
         axis = longer_side(centroid, block(first(at):last))
         call part(centroid, axis, middle, first(at), last, block)
         first(at + 2:n_pieces + 1) = first(at + 1:n_pieces)
         groups(at + 2:n_pieces + 1) = groups(at + 1:n_pieces)
         first(at + 1) = middle + 1
         groups(at + 1) = groups(at) - left
         groups(at) = left
         n_pieces = n_pieces + 1
      end do
      do at = 1, n_pieces
         last = size(group)
         if (at < n_pieces) last = first(at + 1) - 1
         group(block(first(at):last)) = at
      end do
   end subroutine divide_by_place

   !> Axis of the longer side of the box around some blocks.
   pure integer function longer_side(centroid, block)
      real(wp), intent(in) :: centroid(:, :)   !! (2, n)
      integer, intent(in) :: block(:)
      real(wp) :: low(2), high(2)
      integer :: i
      low = huge(1.0_wp)
      high = -huge(1.0_wp)
      do i = 1, size(block)
         low = min(low, centroid(:, block(i)))
         high = max(high, centroid(:, block(i)))
      end do
      longer_side = merge(1, 2, high(1) - low(1) >= high(2) - low(2))
   end function longer_side

   !> Order block(first:last) such that none up to place `middle` comes after one beyond it (quickselect, Hoare 1961).
   pure subroutine part(centroid, axis, middle, first, last, block)
      real(wp), intent(in) :: centroid(:, :)  !! (2, n)
      integer, intent(in) :: axis, middle, first, last
      integer, intent(inout) :: block(:)      !! (n)
      integer :: low, high, i, j, pivot, other
      low = first
      high = last
      do while (low < high)
         pivot = block(low + (high - low)/2)
         i = low
         j = high
         do
            do while (comes_before(block(i), pivot))
               i = i + 1
            end do
            do while (comes_before(pivot, block(j)))
               j = j - 1
            end do
            if (i <= j) then
               other = block(i)
               block(i) = block(j)
               block(j) = other
               i = i + 1
               j = j - 1
            end if
            if (i > j) exit
         end do
         if (j < middle) low = i
         if (middle < i) high = j
      end do

   contains

      !> Order by coordinate, then by number.
      pure logical function comes_before(a, b)
         integer, intent(in) :: a, b
         comes_before = centroid(axis, a) < centroid(axis, b)
         if (.not. (comes_before .or. centroid(axis, b) < centroid(axis, a))) comes_before = a < b
      end function comes_before

   end subroutine part

   !> Take the pattern, given by the first column of each row.
   pure subroutine set_coarse_pattern(self, first)
      class(coarse_factor_type), intent(inout) :: self
      integer, intent(in) :: first(:)     !! (n) first(i) <= i
      integer :: i, at
      self%n = size(first)
      self%first = first
      if (allocated(self%offset)) deallocate (self%offset, self%values, self%l)
      allocate (self%offset(self%n))
      at = 0
      do i = 1, self%n
         self%offset(i) = at - first(i) + 1
         at = at + i - first(i) + 1
      end do
      allocate (self%values(6, 6, at), self%l(6, 6, at))
   end subroutine set_coarse_pattern

   !> Factorise the matrix.
   pure subroutine factorize_coarse(self, ok)
      class(coarse_factor_type), intent(inout) :: self
      logical, intent(out) :: ok          !! positive definite and finite
      real(wp) :: s(6, 6), l(6, 6)
      integer :: i, j, k, c
      ok = .true.
      do i = 1, self%n
         do j = self%first(i), i
            s = self%values(:, :, self%offset(i) + j)
            do k = max(self%first(i), self%first(j)), j - 1
               call subtract_product(self%l(:, :, self%offset(i) + k), self%l(:, :, self%offset(j) + k), s)
            end do
            if (j < i) then
               ! times the transpose of the inverse of the diagonal
               associate (inverse => self%l(:, :, self%offset(j) + j))
                  do c = 6, 1, -1
                     s(:, c) = matmul(s(:, 1:c), inverse(c, 1:c))
                  end do
               end associate
               self%l(:, :, self%offset(i) + j) = s
            else
               call factorize_block(s, l, ok)
               if (.not. ok) return
               call invert_lower(l, self%l(:, :, self%offset(i) + i))
            end if
         end do
      end do
   end subroutine factorize_coarse

   !> s := s - a b^T.
   pure subroutine subtract_product(a, b, s)
      real(wp), intent(in) :: a(6, 6), b(6, 6)
      real(wp), intent(inout) :: s(6, 6)
      integer :: c
      do c = 1, 6
         s(:, c) = s(:, c) - ((a(:, 1)*b(c, 1) + a(:, 2)*b(c, 2)) + (a(:, 3)*b(c, 3) + a(:, 4)*b(c, 4)) &
                              + (a(:, 5)*b(c, 5) + a(:, 6)*b(c, 6)))
      end do
   end subroutine subtract_product

   !> x := K^-1 x.
   pure subroutine solve_with_factor(self, x)
      class(coarse_factor_type), intent(in) :: self
      real(wp), intent(inout) :: x(6, self%n)
      real(wp) :: b(6)
      integer :: i, j, c
      do i = 1, self%n
         b = x(:, i)
         do j = self%first(i), i - 1
            call subtract_column(self%l(:, :, self%offset(i) + j), x(:, j), b)
         end do
         x(:, i) = 0
         do c = 1, 6
            x(c:6, i) = x(c:6, i) + self%l(c:6, c, self%offset(i) + i)*b(c)
         end do
      end do
      do i = self%n, 1, -1
         do c = 1, 6
            b(c) = dot_product(self%l(c:6, c, self%offset(i) + i), x(c:6, i))
         end do
         x(:, i) = b
         do j = self%first(i), i - 1
            do c = 1, 6
               x(c, j) = x(c, j) - dot_product(self%l(:, c, self%offset(i) + j), b)
            end do
         end do
      end do
   end subroutine solve_with_factor

   !> b := b - A x.
   pure subroutine subtract_column(a, x, b)
      real(wp), intent(in) :: a(6, 6), x(6)
      real(wp), intent(inout) :: b(6)
      b = b - ((a(:, 1)*x(1) + a(:, 2)*x(2)) + (a(:, 3)*x(3) + a(:, 4)*x(4)) + (a(:, 5)*x(5) + a(:, 6)*x(6)))
   end subroutine subtract_column

end module rockdda_linear_deflation
