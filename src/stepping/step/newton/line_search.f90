! SPDX-License-Identifier: MIT
!> How far to go from the motion of one open-close round towards that of the next.
!>
!> A round solves the equations that belong to the states found at the last motion: a step of Newton's method for
!>
!>     R(d) = K0 d - f0 + forces of all contacts and bolts at the motion d, by their laws = 0,
!>
!> K0 and f0 the block terms. R is continuous and piecewise linear for Coulomb's law, with a kink wherever a contact
!> changes its state. Where a full step crosses many kinks R may grow, and the rounds then run in circles. So |R| at
!> the full step is compared with |R| where the step began; if it has not fallen enough, the step is shortened
!> to the best of a falling sequence of fractions.
!>
!> |R|^2 is the sum over blocks of r.K_ii^-1 r, K_ii the present diagonal block of the stiffness
!> (rockdda_linear_block_norm). No solve is needed for it. Whether it is below a share of another one is mostly clear
!> from a few of the blocks of that: their part of the sum is a lower bound.
module rockdda_stepping_line_search
   use rockdda_base_kinds, only : wp
   use rockdda_base_parallel, only : parallel_blocks, piece
   use rockdda_base_room, only : resize, reserve
   use rockdda_interaction_equations, only : equations_type
   use rockdda_interaction_link_vectors, only : add_forces
   use rockdda_interaction_families, only : families_type
   use rockdda_linear_block_norm, only : norm_anew_type
   use rockdda_stepping_method, only : method_type
   use rockdda_linear_small_blocks, only : add_symmetric_product, n_packed
   implicit none
   private
   public :: line_search_type

   !> A lower bound of |R| is found from the first `group` of each `stride` blocks; rounding of sums is less than the
   !> share `margin`.
   integer, parameter :: group = 8, stride = 64
   real(wp), parameter :: margin = 1.0e-9_wp

   !> The motion that the last round ended with, and scratch.
   type :: line_search_type
      private
      real(wp), allocatable :: x(:, :)              !! (6, nb)
      type(norm_anew_type) :: weights               !! by K_ii, or by the terms of single blocks
      logical :: by_terms = .false.                 !! the latter
      logical :: has_weights = .true.               !! all blocks of the last norm have a factor
      real(wp) :: reached = 0                       !! |R| where the last search of this attempt has ended; 0: none
      logical :: is_stuck = .false.                 !! the last search of the attempt has found no smaller |R|
      logical :: was_better = .false.               !! the last answer of `is_better`: nothing else depends on it
      real(wp), allocatable :: r(:, :)              !! (6, rows)
      real(wp), allocatable :: force(:, :)          !! (2, >= links) along the lines of each link
      integer, allocatable :: places(:)             !! (>= rows) block of each row
      integer, allocatable :: runs(:, :)            !! (2, >= n) contacts of a few blocks: first and last row
   contains
      procedure :: keep
      procedure :: search
      procedure :: is_better
      procedure :: find_norm
      procedure :: go_back
      procedure, private :: measure
      procedure, private :: measure_part
   end type line_search_type

contains

   !> Keep the motion of a round.
   subroutine keep(self, families, equations, round)
      class(line_search_type), intent(inout) :: self
      type(families_type), intent(inout) :: families
      type(equations_type), intent(in) :: equations
      integer, intent(in) :: round      !! that begins there
      if (round <= 2) then
         self%reached = 0
         self%is_stuck = .false.
      end if
      self%x = equations%x
      call families%keep(equations)
   end subroutine keep

   !> Go from the motion that was kept towards the one just solved for; `fraction` is 1 when all the way.
   !> |R| below `negligible` counts as zero.
   subroutine search(self, families, negligible, method, equations, fraction, missing)
      class(line_search_type), intent(inout) :: self
      type(families_type), intent(inout) :: families
      real(wp), intent(in) :: negligible                   !! share of the magnitude of all loads
      type(method_type), intent(in) :: method
      type(equations_type), intent(inout) :: equations
      real(wp), intent(out) :: fraction
      real(wp), intent(out) :: missing                     !! |R| of a shortened motion, as such a share; else 0
      real(wp) :: at_start, least, next, reached, loads, a
      integer :: k

      fraction = 1
      missing = 0
      if (equations%n_rows() == 0) return
      call make_room(self, equations)
      self%by_terms = .false.
      least = self%measure(1.0_wp, families, equations)
      if (.not. self%has_weights) return
      reached = self%reached
      self%reached = least
      if (least <= method%by_far*method%enough*reached) return
      if (least <= method%enough*self%measure_part(0.0_wp, families, equations)) return
      at_start = self%measure(0.0_wp, families, equations)
      if (least <= method%enough*at_start) return
      loads = norm_of_loads(self, equations)
      if (least <= negligible*loads) return
      a = 1
      do k = 1, method%most_trials
         a = method%shorter*a
         next = self%measure(a, families, equations)
         if (next < least) then
            least = next
            fraction = a
         else if (least < at_start) then
            exit
         end if
      end do
      ! a force jumps at the start, such as the cohesion of a joint that opens: by short steps alone the motion stays
      ! there
      self%is_stuck = .not. (self%is_stuck .or. least < at_start)
      if (.not. (self%is_stuck .or. least < at_start)) fraction = 1
      self%reached = least
      if (.not. fraction < 1) return
      missing = least/max(loads, tiny(1.0_wp))
      equations%x = self%x + fraction*(equations%x - self%x)
      call families%shorten(equations, fraction)
   end subroutine search

   !> Is |R| at the present motion below a share of that at the motion that was kept? There need not be a matrix yet:
   !> blocks are weighed with their own terms.
   logical function is_better(self, families, equations, share, clearly_not)
      class(line_search_type), intent(inout) :: self
      type(families_type), intent(in) :: families
      type(equations_type), intent(in) :: equations
      real(wp), intent(in) :: share
      real(wp), intent(in) :: clearly_not   !! times the share: a part of the blocks suffices to see that it is not
      real(wp) :: kept, part, present
      is_better = .false.
      if (equations%n_rows() == 0) return
      call make_room(self, equations)
      self%by_terms = .true.
      ! where the last one was not, a few of the blocks mostly decide; the answer does not depend on the order
      kept = -1
      if (.not. self%was_better) then
         part = self%measure_part(1.0_wp, families, equations)
         kept = self%measure_part(0.0_wp, families, equations)
         if (part > clearly_not*share*kept) return
      end if
      present = self%measure(1.0_wp, families, equations)
      self%was_better = .false.
      if (.not. self%has_weights) return
      if (kept < 0) then
         part = (1 - margin)*norm_of_part(self, equations)
         kept = self%measure_part(0.0_wp, families, equations)
         if (part > clearly_not*share*kept) return
      end if
      is_better = present < share*kept
      self%was_better = is_better
      if (is_better) return
      kept = self%measure(0.0_wp, families, equations)
      if (kept > 0) is_better = present/kept < share
      self%was_better = is_better
   end function is_better

   !> |R| at the present motion; a motion must have been kept.
   subroutine find_norm(self, families, equations, norm)
      class(line_search_type), intent(inout) :: self
      type(families_type), intent(in) :: families
      type(equations_type), intent(in) :: equations
      real(wp), intent(out) :: norm
      norm = 0
      if (equations%n_rows() == 0) return
      call make_room(self, equations)
      self%by_terms = .false.
      norm = self%measure(1.0_wp, families, equations)
      if (.not. self%has_weights) norm = 0
   end subroutine find_norm

   !> Back to the motion that was kept.
   pure subroutine go_back(self, equations)
      class(line_search_type), intent(in) :: self
      type(equations_type), intent(inout) :: equations
      equations%x = self%x
   end subroutine go_back

   !> |R| at the fraction a of the way.
   real(wp) function measure(self, a, families, equations)
      class(line_search_type), intent(inout) :: self
      real(wp), intent(in) :: a
      type(families_type), intent(in) :: families
      type(equations_type), intent(in) :: equations
      integer :: i, k, n
      call families%lawful_forces(a, self%force)
      n = equations%n_rows()
      !$omp parallel do default(none) private(i, k) shared(self, a, equations, n) schedule(static) &
      !$omp if (n > parallel_blocks)
      do k = 1, n
         i = k
         if (allocated(equations%block_of)) i = equations%block_of(k)
         call residual_of_block(i, a, equations, self%x(:, i), self%force, self%r(:, k))
      end do
      !$omp end parallel do
      measure = norm_of(self, equations, self%r)
   end function measure

   !> Lower bound of |R| at the fraction a of the way, by a few of the blocks.
   real(wp) function measure_part(self, a, families, equations) result(least)
      class(line_search_type), intent(inout) :: self
      real(wp), intent(in) :: a
      type(families_type), intent(in) :: families
      type(equations_type), intent(in) :: equations
      integer :: first, i, k, n
      call list_contacts(self%runs, families%contacts%first_link, families%contacts%table%n, equations, n)
      call families%lawful_forces(a, self%force, self%runs(:, 1:n))
      !$omp parallel do default(none) private(first, i, k) shared(self, a, equations) schedule(static) &
      !$omp if (equations%n_rows() > 8*parallel_blocks)
      do first = 1, equations%n_rows(), stride
         do k = first, min(first + group - 1, equations%n_rows())
            i = k
            if (allocated(equations%block_of)) i = equations%block_of(k)
            call residual_of_block(i, a, equations, self%x(:, i), self%force, self%r(:, k))
         end do
      end do
      !$omp end parallel do
      least = (1 - margin)*norm_of_part(self, equations)
   end function measure_part

   !> Contacts of these blocks, each once, as runs of rows.
   pure subroutine list_contacts(runs, first_link, n_contacts, equations, n)
      integer, allocatable, intent(inout) :: runs(:, :)   !! (2, >= n)
      integer, intent(in) :: first_link, n_contacts       !! contact c is the link first_link + c
      type(equations_type), intent(in) :: equations
      integer, intent(out) :: n
      integer :: c, first, i, k, l
      if (allocated(runs)) then
         if (size(runs, 2) < n_contacts + 1) deallocate (runs)
      end if
      if (.not. allocated(runs)) allocate (runs(2, n_contacts + n_contacts/4 + 1))
      n = 0
      do first = 1, equations%n_rows(), stride
         do k = first, min(first + group - 1, equations%n_rows())
            i = k
            if (allocated(equations%block_of)) i = equations%block_of(k)
            do l = equations%start(i) + 1, equations%start(i + 1)
               c = abs(equations%incident(l)) - first_link
               if (c < 1 .or. c > n_contacts) cycle
               ! as its second block: unless it is listed at the first one
               if (equations%incident(l) < 0) then
                  if (is_listed(equations%pair(1, first_link + c))) cycle
               end if
               if (n > 0) then
                  if (runs(2, n) == c - 1 .and. c - runs(1, n) < piece) then
                     runs(2, n) = c
                     cycle
                  end if
               end if
               n = n + 1
               runs(:, n) = c
            end do
         end do
      end do

   contains

      !> Is it the number of a block whose contacts are listed?
      pure logical function is_listed(block)
         integer, intent(in) :: block
         integer :: row
         row = block
         if (allocated(equations%row_of) .and. block > 0) row = equations%row_of(block)
         is_listed = row > 0 .and. mod(row - 1, stride) < group
      end function is_listed

   end subroutine list_contacts

   !> |f| of the magnitudes of all loads.
   real(wp) function norm_of_loads(self, equations) result(norm)
      type(line_search_type), intent(inout) :: self
      type(equations_type), intent(in) :: equations
      if (allocated(equations%block_of)) then
         norm = norm_of(self, equations, equations%magnitude(:, equations%block_of))
      else
         norm = norm_of(self, equations, equations%magnitude)
      end if
   end function norm_of_loads

   !> Norm of forces.
   real(wp) function norm_of(self, equations, v) result(norm)
      type(line_search_type), intent(inout) :: self
      type(equations_type), intent(in) :: equations
      real(wp), intent(in), contiguous :: v(:, :)          !! (6, rows)
      associate (n => equations%n_rows())
         if (.not. self%by_terms) then
            call self%weights%norm(n, v, 36, equations%matrix%values, equations%matrix%row_start, norm, &
                                   self%has_weights)
         else
            call find_places(self, equations)
            call self%weights%norm(n, v, n_packed, equations%block_matrix, self%places, norm, self%has_weights)
         end if
      end associate
   end function norm_of

   !> Find the block of each row of the matrix.
   pure subroutine find_places(self, equations)
      type(line_search_type), intent(inout) :: self
      type(equations_type), intent(in) :: equations
      integer :: i
      call reserve(self%places, equations%n_rows())
      do i = 1, equations%n_rows()
         self%places(i) = i
         if (allocated(equations%block_of)) self%places(i) = equations%block_of(i)
      end do
   end subroutine find_places

   !> Norm of the part of `r` that is a lower bound of the whole.
   real(wp) function norm_of_part(self, equations) result(norm)
      type(line_search_type), intent(inout) :: self
      type(equations_type), intent(in) :: equations
      logical :: ok   ! as it was for all blocks
      associate (n => equations%n_rows())
         if (.not. self%by_terms) then
            call self%weights%norm_of_part(n, self%r, 36, equations%matrix%values, equations%matrix%row_start, group, &
                                           stride, norm, ok)
         else
            call find_places(self, equations)
            call self%weights%norm_of_part(n, self%r, n_packed, equations%block_matrix, self%places, group, stride, &
                                           norm, ok)
         end if
      end associate
   end function norm_of_part

   !> Residual of one block: its own terms and the forces of its links, in the order of the table.
   pure subroutine residual_of_block(i, a, equations, x, force, r)
      integer, intent(in) :: i
      real(wp), intent(in) :: a
      type(equations_type), intent(in) :: equations
      real(wp), intent(in) :: x(6)                     !! motion that was kept
      real(wp), intent(in), contiguous :: force(:, :)  !! (2, >= links)
      real(wp), intent(out) :: r(6)
      real(wp) :: sums(6), y(6)
      sums = -equations%block_load(:, i)
      y = x + a*(equations%x(:, i) - x)
      call add_symmetric_product(equations%block_matrix(:, i), y, sums)
      call add_forces(equations%start(i + 1) - equations%start(i), &
                      equations%incident(equations%start(i) + 1:equations%start(i + 1)), equations%vectors, force, sums)
      r = sums
   end subroutine residual_of_block

   !> Arrays for the present equations.
   pure subroutine make_room(self, equations)
      type(line_search_type), intent(inout) :: self
      type(equations_type), intent(in) :: equations
      integer :: n
      n = equations%n_rows()
      call resize(self%r, 6, n)
      if (allocated(self%force)) then
         if (size(self%force, 2) < equations%n_links) deallocate (self%force)
      end if
      if (.not. allocated(self%force)) allocate (self%force(2, equations%n_links + equations%n_links/4))
   end subroutine make_room

end module rockdda_stepping_line_search
