! SPDX-License-Identifier: MIT
!> The equations of one step, K x = f, put together from block terms and links.
!>
!> Block terms (elastic, inertia, loads, fixed points) are set once per attempt of a step. Links are what couples
!> two blocks: contacts first, then bolts. A link acts along two lines, normal (1) and tangential (2), each with a
!> stiffness and a force:
!>
!>     K += stiffness * [v; w] [v; w]^T,   f += force * [v; w]      v, w: see rockdda_interaction_link_vectors
!>
!> so a spring of stiffness k at length s0 has stiffness k and force -k s0, friction is a force alone, a dashpot adds
!> c/dt to the stiffness. Every block gathers its own links in the order of the table: the sums do not depend on
!> threads, and no two threads write one number.
!>
!> Of a few links the whole stiffness between two blocks, or of one block, is given as a matrix (join_matrix,
!> set_matrix): forces along several lines that depend on one another.
!>
!> After the first assembly of a step only the rows of blocks with a changed link are put together again, from all
!> their links in the same order: the numbers are those of a full assembly. So it is where vectors are new.
module rockdda_interaction_equations
   use rockdda_base_kinds, only : wp, i1
   use rockdda_base_parallel, only : parallel_blocks, parallel_contacts
   use rockdda_interaction_link_vectors, only : link_numbers, pack_vectors, unpack_vectors, add_stiffness, &
      add_loads, add_forces, elongations
   use rockdda_linear_matrix, only : block_matrix_type
   use rockdda_linear_pattern, only : build_pattern
   use rockdda_linear_small_blocks, only : n_packed
   implicit none
   private
   public :: equations_type

   !> The parts of a link that have changed since the last assembly.
   type :: change_enum
      integer :: none = 0
      integer :: force = 1
      integer :: stiffness = 2   !! and perhaps the force
   end type change_enum
   type(change_enum), parameter :: change = change_enum()

   type :: equations_type
      integer :: n_blocks = 0
      integer :: n_links = 0
      type(block_matrix_type) :: matrix
      real(wp), allocatable :: f(:, :)               !! (6, nb) right hand side
      real(wp), allocatable :: x(:, :)               !! (6, nb) solution, also the next starting guess
      real(wp), allocatable :: block_matrix(:, :)    !! (n_packed, nb) block terms: lower triangles (pack_lower)
      real(wp), allocatable :: block_load(:, :)      !! (6, nb)
      real(wp), allocatable :: block_magnitude(:, :) !! (6, nb) sum of the magnitudes of what block_load is made of
      real(wp), allocatable :: magnitude(:, :)       !! (6, nb) the same for f
      integer, allocatable :: pair(:, :)             !! (2, links) blocks; 0 = the fixed outside
      integer, allocatable :: slot(:)                !! (links) stored block of the pair, 0 none
      real(wp), allocatable :: vectors(:, :)         !! (link_numbers, links) packed: set_vectors, vectors_of
      real(wp), allocatable :: stiffness(:, :)       !! (2, links) set by set_link
      real(wp), allocatable :: force(:, :)           !! (2, links) set by set_link
      real(wp), allocatable :: coupling(:)           !! (links) along line 1 with the next link, set by set_links
      integer, private :: n_matrices = 0
      integer, allocatable, private :: matrix_link(:)       !! (>= n_matrices) links with a matrix
      real(wp), allocatable, private :: matrices(:, :, :)   !! (6, 6, >= n_matrices) set by set_matrix
      integer, allocatable, private :: matrix_version(:)    !! (>= n_matrices) given with them
      real(wp), allocatable :: link_off(:)           !! (links) share of force by wrong lengths (measure_placement)
      real(wp), allocatable :: block_off(:)          !! (nb) the same for terms of single blocks
      real(wp), allocatable :: block_force(:)        !! (nb) size of the force of block_load (clear_placement)
      integer, allocatable :: start(:), incident(:)  !! links of block i: incident(start(i)+1 : start(i+1)); < 0: as b
      integer(i1), allocatable, private :: changed(:)   !! (links) change%... since the last assembly
      integer, allocatable, private :: row_change(:) !! (nb) the same of rows, in the last assembly
      logical, allocatable, private :: row_new(:)    !! (nb) block terms are new
      logical, private :: all_changed = .true.       !! block terms or vectors are new
      ! blocks asleep have no row of the matrix; no arrays where none is
      integer, allocatable :: block_of(:)            !! (rows) block of each row, ascending
      integer, allocatable :: row_of(:)              !! (nb) row of each block, 0: none
      ! links that slot, start and incident belong to, and the work of making them
      logical :: same_pairs = .false.                !! all of `pair` was set since `set_size`, as it was before
      integer, private :: n_pairs = -1, n_begun = 0  !! n_begun: links in use so far; room behind takes no memory
      integer, allocatable, private :: inner(:, :), inner_slot(:)
   contains
      procedure :: set_size
      procedure :: add_links
      procedure :: set_rows
      procedure :: n_rows
      procedure :: join
      procedure :: join_matrix
      procedure :: set_matrix
      procedure :: has_matrix
      procedure :: set_graph
      procedure :: set_vectors
      procedure :: vectors_of
      procedure :: set_link
      procedure :: set_links
      procedure :: link_motion
      procedure :: link_motions
      procedure :: link_force
      procedure :: add_link_force
      procedure :: clear_blocks
      procedure :: clear_placement
      procedure :: misplaced_blocks
      procedure :: renew
      procedure :: assemble
   end type equations_type

contains

   !> Room for nb blocks and n links.
   pure subroutine set_size(self, n_blocks, n_links)
      class(equations_type), intent(inout) :: self
      integer, intent(in) :: n_blocks, n_links
      integer :: before
      self%n_blocks = n_blocks
      self%n_links = 0
      self%same_pairs = .false.
      self%n_matrices = 0
      if (.not. allocated(self%f)) then
         allocate (self%f(6, n_blocks), self%x(6, n_blocks), self%block_load(6, n_blocks), self%block_off(n_blocks), &
                   self%block_magnitude(6, n_blocks), self%magnitude(6, n_blocks), self%block_force(n_blocks), &
                   source=0.0_wp)
         allocate (self%block_matrix(n_packed, n_blocks))
         self%block_matrix = 0
         allocate (self%start(n_blocks + 1), self%row_change(n_blocks), source=0)
         allocate (self%row_new(n_blocks), source=.false.)
      end if
      call self%add_links(n_links, before)
   end subroutine set_size

   !> n links more, after `before`. Room that is not used is not touched, so that it takes no memory.
   pure subroutine add_links(self, n, before)
      class(equations_type), intent(inout) :: self
      integer, intent(in) :: n
      integer, intent(out) :: before
      integer, allocatable :: joined(:, :)
      integer :: m, n_links
      before = self%n_links
      n_links = before + n
      self%n_links = n_links
      if (allocated(self%slot)) then
         if (size(self%slot) < n_links) then
            joined = self%pair(:, 1:before)
            deallocate (self%pair, self%slot, self%vectors, self%force, self%stiffness, self%incident, self%changed, &
                        self%inner, self%inner_slot, self%link_off, self%coupling)
         end if
      end if
      if (.not. allocated(self%slot)) then
         m = n_links + n_links/4 + 16
         allocate (self%pair(2, m), self%slot(m), self%incident(2*m), self%changed(m), self%inner(2, m), &
                   self%inner_slot(m), self%vectors(link_numbers, m), self%stiffness(2, m), self%force(2, m), &
                   self%link_off(m), self%coupling(m))
         self%n_pairs = -1
         self%n_begun = 0
      end if
      if (n_links <= self%n_begun) return
      m = self%n_begun + 1
      self%pair(:, m:n_links) = 0
      self%changed(m:n_links) = int(change%none, i1)
      self%vectors(:, m:n_links) = 0
      self%stiffness(:, m:n_links) = 0
      self%force(:, m:n_links) = 0
      self%coupling(m:n_links) = 0
      self%n_begun = n_links
      if (allocated(joined)) self%pair(:, 1:before) = joined
   end subroutine add_links

   !> Give rows of the matrix to all blocks but those asleep, which keep their places.
   subroutine set_rows(self, asleep)
      class(equations_type), intent(inout) :: self
      logical, intent(in) :: asleep(:)   !! (nb)
      integer :: i
      if (.not. any(asleep)) then
         if (allocated(self%row_of)) then
            deallocate (self%row_of, self%block_of)
            self%n_pairs = -1
         end if
         return
      end if
      if (allocated(self%row_of)) then
         if (all(asleep .eqv. self%row_of == 0)) return
      end if
      self%n_pairs = -1
      self%block_of = pack([(i, i=1, size(asleep))],.not. asleep)
      if (.not. allocated(self%row_of)) allocate (self%row_of(size(asleep)))
      self%row_of = 0
      do i = 1, size(self%block_of)
         self%row_of(self%block_of(i)) = i
      end do
      do i = 1, size(asleep)
         if (asleep(i)) self%x(:, i) = 0
      end do
   end subroutine set_rows

   !> Rows of the matrix.
   pure integer function n_rows(self)
      class(equations_type), intent(in) :: self
      n_rows = self%n_blocks
      if (allocated(self%block_of)) n_rows = size(self%block_of)
   end function n_rows

   !> A link joins two blocks, 0 none.
   pure subroutine join(self, c, blocks)
      class(equations_type), intent(inout) :: self
      integer, intent(in) :: c, blocks(2)
      self%same_pairs = self%same_pairs .and. all(self%pair(:, c) == blocks)
      self%pair(:, c) = blocks
      ! the place may have been that of a contact, which was coupled with the next one
      self%coupling(c) = 0
   end subroutine join

   !> A link with a matrix joins two blocks, or has one (and 0); it has the number `at` among them. Its lines are not in
   !> use.
   pure subroutine join_matrix(self, c, blocks, at)
      class(equations_type), intent(inout) :: self
      integer, intent(in) :: c, blocks(2)
      integer, intent(out) :: at
      integer, allocatable :: links(:), versions(:)
      real(wp), allocatable :: matrices(:, :, :)
      integer :: room
      call self%join(c, blocks)
      self%vectors(:, c) = 0
      self%stiffness(:, c) = 0
      self%force(:, c) = 0
      if (.not. allocated(self%matrix_link)) allocate (self%matrix_link(0), self%matrices(6, 6, 0), &
                                                       self%matrix_version(0))
      at = self%n_matrices + 1
      if (at > size(self%matrix_link)) then
         room = 2*at
         allocate (links(room), matrices(6, 6, room), versions(room))
         links(:at - 1) = self%matrix_link(:at - 1)
         matrices(:, :, :at - 1) = self%matrices(:, :, :at - 1)
         versions(:at - 1) = self%matrix_version(:at - 1)
         call move_alloc(links, self%matrix_link)
         call move_alloc(versions, self%matrix_version)
         call move_alloc(matrices, self%matrices)
      end if
      self%n_matrices = at
      self%matrix_link(at) = c
      self%matrices(:, :, at) = 0
      self%matrix_version(at) = 0
   end subroutine join_matrix

   !> The matrix of a link: rows are those of the first block of its pair, columns those of the second, or of the first.
   pure subroutine set_matrix(self, at, values, version)
      class(equations_type), intent(inout) :: self
      integer, intent(in) :: at
      real(wp), intent(in) :: values(6, 6)
      integer, intent(in), optional :: version       !! > 0, of its owner: see has_matrix
      if (present(version)) self%matrix_version(at) = version
      if (all(abs(values - self%matrices(:, :, at)) <= 0)) return
      self%matrices(:, :, at) = values
      self%changed(self%matrix_link(at)) = int(change%stiffness, i1)
   end subroutine set_matrix

   !> Has a matrix been set in this step, in this version?
   pure logical function has_matrix(self, at, version)
      class(equations_type), intent(in) :: self
      integer, intent(in) :: at, version
      has_matrix = self%matrix_version(at) == version
   end function has_matrix

   !> Pattern of K and the links of each block, from `pair`. Nothing to do when the links join the same blocks, in the
   !> same order, as before.
   subroutine set_graph(self)
      class(equations_type), intent(inout) :: self
      integer :: c, n, n_inner, n_ends
      self%all_changed = .true.
      n = self%n_links
      if (self%same_pairs .and. self%n_pairs == n) return
      n_ends = 0
      n_inner = 0
      !$omp parallel do default(none) shared(self, n) private(c) reduction(+:n_ends, n_inner) schedule(static) &
      !$omp if (n > parallel_contacts)
      do c = 1, n
         n_ends = n_ends + count(self%pair(:, c) > 0)
         if (couples(self, c)) n_inner = n_inner + 1
      end do
      !$omp end parallel do
      if (self%n_pairs == n .and. n_ends == self%start(self%n_blocks + 1)) then
         if (joins_the_same()) return
      end if
      self%n_pairs = n
      if (n_inner == n .and. .not. allocated(self%row_of)) then
         call build_pattern(self%n_blocks, self%pair(:, 1:n), self%matrix, self%slot(1:n))
      else
         n_inner = 0
         do c = 1, n
            if (.not. couples(self, c)) cycle
            n_inner = n_inner + 1
            self%inner(:, n_inner) = self%pair(:, c)
            if (allocated(self%row_of)) self%inner(:, n_inner) = self%row_of(self%pair(:, c))
         end do
         call build_pattern(self%n_rows(), self%inner(:, 1:n_inner), self%matrix, self%inner_slot(1:n_inner))
         n_inner = 0
         do c = 1, n
            self%slot(c) = 0
            if (.not. couples(self, c)) cycle
            n_inner = n_inner + 1
            self%slot(c) = self%inner_slot(n_inner)
         end do
      end if
      call list_links(self%n_blocks, n, self%pair, self%start, self%incident)

   contains

      !> Is each link that is listed at a block one that joins it? Of as many as there are the lists are then complete.
      logical function joins_the_same()
         integer :: i, l, n_other
         n_other = 0
         !$omp parallel do default(none) shared(self) private(i, l) reduction(+:n_other) schedule(static) &
         !$omp if (self%n_blocks > parallel_blocks)
         do i = 1, self%n_blocks
            do l = self%start(i) + 1, self%start(i + 1)
               if (self%pair(merge(1, 2, self%incident(l) > 0), abs(self%incident(l))) /= i) n_other = n_other + 1
            end do
         end do
         !$omp end parallel do
         joins_the_same = n_other == 0
      end function joins_the_same

   end subroutine set_graph

   !> Does a link join two blocks that have rows?
   pure logical function couples(self, c)
      class(equations_type), intent(in) :: self
      integer, intent(in) :: c
      couples = self%pair(1, c) > 0 .and. self%pair(2, c) > 0
      if (couples .and. allocated(self%row_of)) couples = all(self%row_of(self%pair(:, c)) > 0)
   end function couples

   !> Vectors of a link, of the first block and of the second. That of the fixed outside is not used.
   pure subroutine set_vectors(self, c, a, b)
      class(equations_type), intent(inout) :: self
      integer, intent(in) :: c
      real(wp), intent(in) :: a(6, 2), b(6, 2)
      real(wp) :: first(6, 2)
      first = a
      if (self%pair(1, c) == 0) first(1:2, :) = -b(1:2, :)
      call pack_vectors(first, b, self%vectors(:, c))
   end subroutine set_vectors

   !> Vectors of a link along its two lines, of its first (1) or second block.
   pure function vectors_of(self, c, side) result(v)
      class(equations_type), intent(in) :: self
      integer, intent(in) :: c, side
      real(wp) :: v(6, 2)
      call unpack_vectors(self%vectors(:, c), side == 1, v)
   end function vectors_of

   !> Stiffness and force of a link, along its two lines.
   pure subroutine set_link(self, c, stiffness, force)
      class(equations_type), intent(inout) :: self
      integer, intent(in) :: c
      real(wp), intent(in) :: stiffness(2), force(2)
      ! what is not a number differs from everything: the solver shall see it
      if (self%all_changed) then
         continue
      else if (.not. (abs(stiffness(1) - self%stiffness(1, c)) <= 0 .and. &
                 abs(stiffness(2) - self%stiffness(2, c)) <= 0)) then
         self%changed(c) = int(change%stiffness, i1)
      else if (.not. (abs(force(1) - self%force(1, c)) <= 0 .and. abs(force(2) - self%force(2, c)) <= 0)) then
         self%changed(c) = max(self%changed(c), int(change%force, i1))
      end if
      self%stiffness(:, c) = stiffness
      self%force(:, c) = force
   end subroutine set_link

   !> Stiffness and force of n links, before + rows(1) to before + rows(n). Two links of the same blocks, one after the
   !> other, may be coupled: the first one adds coupling * (v v'^T + v' v^T) to K, v' the vector of the next one.
   pure subroutine set_links(self, n, rows, before, stiffness, force, coupling)
      class(equations_type), intent(inout) :: self
      integer, intent(in) :: n, before
      integer, intent(in) :: rows(n)
      real(wp), intent(in) :: stiffness(2, n), force(2, n)
      real(wp), intent(in) :: coupling(n)            !! [force/length]
      integer :: k
      do k = 1, n
         associate (kept => self%coupling(before + rows(k)))
            if (abs(coupling(k) - kept) > 0) then
               self%changed(before + rows(k)) = int(change%stiffness, i1)
               kept = coupling(k)
            end if
         end associate
         call set_link(self, before + rows(k), stiffness(:, k), force(:, k))
      end do
   end subroutine set_links

   !> Relative motion of the blocks of a link along its two lines, by the solution. It has two blocks.
   pure subroutine link_motion(self, c, along)
      class(equations_type), intent(in) :: self
      integer, intent(in) :: c
      real(wp), intent(out) :: along(2)
      call elongations(1, self%vectors(:, c), self%pair(:, c), self%x, along)
   end subroutine link_motion

   !> `link_motion` of links one after the other.
   pure subroutine link_motions(self, first, last, along)
      class(equations_type), intent(in) :: self
      integer, intent(in) :: first, last
      real(wp), intent(inout), contiguous :: along(:, :)   !! (2, >= last - first + 1)
      call elongations(last - first + 1, self%vectors(:, first:last), self%pair(:, first:last), self%x, along)
   end subroutine link_motions

   !> Forces along the two lines of a link that stand in the equations, for the solution.
   pure function link_force(self, c) result(force)
      class(equations_type), intent(in) :: self
      integer, intent(in) :: c
      real(wp) :: force(2), along(2)
      call self%link_motion(c, along)
      force = self%stiffness(:, c)*along - self%force(:, c)
      if (abs(self%coupling(c)) > 0) then
         call self%link_motion(c + 1, along)
         force(1) = force(1) + self%coupling(c)*along(1)
      end if
      if (c == 1) return
      if (abs(self%coupling(c - 1)) > 0) then
         call self%link_motion(c - 1, along)
         force(1) = force(1) + self%coupling(c - 1)*along(1)
      end if
   end function link_force

   !> Forces along the two lines of a link, on both of its blocks.
   pure subroutine add_link_force(self, c, force, f)
      class(equations_type), intent(in) :: self
      integer, intent(in) :: c
      real(wp), intent(in) :: force(2)
      real(wp), intent(inout), contiguous :: f(:, :)       !! (6, nb)
      call add_forces(1, [1], self%vectors(:, c), force, f(:, self%pair(1, c)))
      call add_forces(1, [-1], self%vectors(:, c), force, f(:, self%pair(2, c)))
   end subroutine add_link_force

   !> Begin with new terms of single blocks: all of them, and all vectors, are new, or those of some blocks.
   subroutine clear_blocks(self, new)
      class(equations_type), intent(inout) :: self
      logical, intent(in), contiguous, optional :: new(:)   !! (nb)
      integer :: c, i
      if (present(new)) then
         self%row_new = self%row_new .or. new
         !$omp parallel do default(none) shared(self, new) private(c) schedule(static) &
         !$omp if (self%n_links > parallel_contacts)
         do c = 1, self%n_links
            if (all(abs(self%stiffness(:, c)) <= 0) .and. all(abs(self%force(:, c)) <= 0)) cycle
            if (any(belongs(self%pair(:, c)))) self%changed(c) = int(change%stiffness, i1)
         end do
         !$omp end parallel do
      else
         call self%renew()
      end if
      !$omp parallel do default(none) shared(self) private(i) schedule(static) if (self%n_blocks > parallel_blocks)
      do i = 1, self%n_blocks
         self%block_matrix(:, i) = 0
         self%block_load(:, i) = 0
         self%block_magnitude(:, i) = 0
      end do
      !$omp end parallel do

   contains

      !> Is it the number of a block whose vectors are new?
      elemental logical function belongs(i)
         integer, intent(in) :: i
         belongs = i > 0 .and. new(max(i, 1))
      end function belongs

   end subroutine clear_blocks

   !> Before `measure_placement` of the families.
   subroutine clear_placement(self)
      class(equations_type), intent(inout) :: self
      integer :: i
      self%block_off = 0
      do i = 1, self%n_blocks
         self%block_force(i) = norm2(self%block_load(1:2, i))
      end do
      self%link_off(1:self%n_links) = 0
   end subroutine clear_placement

   !> Blocks with a term or a link that is off by more than a limit.
   subroutine misplaced_blocks(self, limit, blocks)
      class(equations_type), intent(in) :: self
      real(wp), intent(in) :: limit
      logical, intent(inout), contiguous :: blocks(:)   !! (nb)
      integer :: i, l
      !$omp parallel do default(none) shared(self, limit, blocks) private(i, l) schedule(static) &
      !$omp if (self%n_blocks > parallel_blocks)
      do i = 1, self%n_blocks
         blocks(i) = self%block_off(i) > limit
         do l = self%start(i) + 1, self%start(i + 1)
            if (self%link_off(abs(self%incident(l))) > limit) blocks(i) = .true.
         end do
      end do
      !$omp end parallel do
   end subroutine misplaced_blocks

   !> Block terms or vectors of links are new: the next assembly is a full one.
   pure subroutine renew(self)
      class(equations_type), intent(inout) :: self
      self%all_changed = .true.
   end subroutine renew

   !> Block terms plus all links with their present stiffness and force.
   subroutine assemble(self, n_assembled)
      class(equations_type), intent(inout) :: self
      integer, intent(out), optional :: n_assembled   !! links whose stiffness was new
      integer :: i, c, k, n, what, most, n_new
      most = change%none
      n = self%n_rows()
      !$omp parallel do default(none) shared(self, n) private(i, k, what) reduction(max:most) schedule(static) &
      !$omp if (n > parallel_blocks)
      do k = 1, n
         i = k
         if (allocated(self%block_of)) i = self%block_of(k)
         what = change%stiffness
         if (.not. (self%all_changed .or. self%row_new(i))) what = change_of_row(self, i)
         self%row_new(i) = .false.
         if (what == change%stiffness) call assemble_row(i, self%matrix%row_start(k), &
                                                         self%matrix%row_start(k + 1) - 1, self)
         if (what /= change%none) call assemble_load(i, self)
         self%row_change(k) = what
         most = max(most, what)
      end do
      !$omp end parallel do
      call add_matrices(self)
      if (most == change%stiffness) then
         self%matrix%base_id = merge(0, self%matrix%values_id, self%all_changed)
         self%matrix%values_id = mod(self%matrix%values_id, huge(1)) + 1
         self%matrix%changed = self%row_change(1:n) == change%stiffness
      end if
      n_new = 0
      !$omp parallel do default(none) shared(self) private(c) reduction(+:n_new) schedule(static) &
      !$omp if (self%n_links > parallel_contacts)
      do c = 1, self%n_links
         if (self%changed(c) == change%stiffness) n_new = n_new + 1
         self%changed(c) = int(change%none, i1)
      end do
      !$omp end parallel do
      if (self%all_changed) n_new = self%n_links
      self%all_changed = .false.
      if (present(n_assembled)) n_assembled = n_new
   end subroutine assemble

   !> Matrices of links in the rows that are new.
   subroutine add_matrices(self)
      class(equations_type), intent(inout) :: self
      integer :: at, rows(2), side
      do at = 1, self%n_matrices
         associate (c => self%matrix_link(at))
            rows = 0
            do side = 1, 2
               if (self%pair(side, c) == 0) cycle
               rows(side) = self%pair(side, c)
               if (allocated(self%row_of)) rows(side) = self%row_of(rows(side))
            end do
            if (rows(1) == 0) cycle
            if (self%pair(2, c) == 0) then
               if (self%row_change(rows(1)) == change%stiffness) call add(self%matrix%row_start(rows(1)), &
                                                                          self%matrices(:, :, at))
            else if (rows(2) > 0) then
               if (self%row_change(minval(rows)) /= change%stiffness) cycle
               if (rows(1) < rows(2)) then
                  call add(self%slot(c), self%matrices(:, :, at))
               else
                  call add(self%slot(c), transpose(self%matrices(:, :, at)))
               end if
            end if
         end associate
      end do

   contains

      !> Add to a stored block.
      subroutine add(slot, values)
         integer, intent(in) :: slot
         real(wp), intent(in) :: values(6, 6)
         self%matrix%values(:, :, slot) = self%matrix%values(:, :, slot) + values
      end subroutine add

   end subroutine add_matrices

   !> The greatest change among the links of a block.
   pure integer function change_of_row(self, i) result(what)
      class(equations_type), intent(in) :: self
      integer, intent(in) :: i
      integer :: l
      what = change%none
      do l = self%start(i) + 1, self%start(i + 1)
         what = max(what, int(self%changed(abs(self%incident(l)))))
      end do
   end function change_of_row

   !> The load of one block, and the sum of the magnitudes of its parts.
   pure subroutine assemble_load(i, eq)
      integer, intent(in) :: i
      class(equations_type), intent(inout) :: eq
      real(wp) :: f(6), magnitude(6)
      f = eq%block_load(:, i)
      magnitude = eq%block_magnitude(:, i)
      call add_loads(eq%start(i + 1) - eq%start(i), eq%incident(eq%start(i) + 1:eq%start(i + 1)), eq%vectors, &
                     eq%force, f, magnitude)
      eq%f(:, i) = f
      eq%magnitude(:, i) = magnitude
   end subroutine assemble_load

   !> One block row: its diagonal block and the stored blocks right of it.
   pure subroutine assemble_row(i, first_slot, last_slot, eq)
      integer, intent(in) :: i, first_slot, last_slot
      class(equations_type), intent(inout) :: eq
      call add_stiffness(i, eq%start(i + 1) - eq%start(i), eq%incident(eq%start(i) + 1:eq%start(i + 1)), eq%pair, &
                         eq%slot, eq%vectors, eq%stiffness, eq%coupling, eq%block_matrix(:, i), first_slot, &
                         last_slot - first_slot, eq%matrix%values)
   end subroutine assemble_row

   !> Links of each block, in their order: those of block i are incident(start(i)+1 : start(i+1)), negative where the
   !> block is the second of their pair.
   pure subroutine list_links(n_blocks, n_links, pair, start, incident)
      integer, intent(in) :: n_blocks, n_links
      integer, intent(in) :: pair(2, n_links)
      integer, intent(out) :: start(n_blocks + 1), incident(2*n_links)
      integer :: c, i, k, side
      start = 0
      do c = 1, n_links
         do side = 1, 2
            i = pair(side, c)
            if (i > 0) start(i + 1) = start(i + 1) + 1
         end do
      end do
      do i = 2, n_blocks + 1
         start(i) = start(i) + start(i - 1)
      end do
      do c = 1, n_links
         do side = 1, 2
            i = pair(side, c)
            if (i == 0) cycle
            k = start(i) + 1
            start(i) = k
            incident(k) = merge(c, -c, side == 1)
         end do
      end do
      do i = n_blocks + 1, 2, -1
         start(i) = start(i - 1)
      end do
      start(1) = 0
   end subroutine list_links

end module rockdda_interaction_equations
