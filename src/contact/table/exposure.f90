! SPDX-License-Identifier: MIT
!> What a vertex cannot strike, with contact by length and with vertices on edges, but for presets.
!>
!>          |      A       |            A rides on C and comes to D. Its corner v lies a little below that of D, by
!>          |______________v____        the compression of the springs or as rough as the drawing is. The side of D is
!>                 C    | |    D        covered by C, and lies below the edge of A that C bears: v passes over it.
!>
!> Two rules follow from the intervals of the joints, both with a tolerance:
!>     a stretch of an edge that another block's edge covers cannot be struck by a third block's vertex;
!>     a vertex at the end of an edge that another block bears does not strike what lies wholly below the line of that
!>     edge.
module rockdda_contact_exposure
   use rockdda_base_kinds, only : wp, l1
   use rockdda_contact_history, only : contact_history_type
   use rockdda_contact_search_limits, only : search_limits_type
   use rockdda_contact_table, only : contact_table_type, contact_state
   use rockdda_contact_topology, only : contact_topology_type
   use rockdda_contact_outlines, only : outlines_type
   use rockdda_contact_intervals, only : interval_type, measure_interval, is_facing
   implicit none
   private
   public :: exposure_type, search_input_type

   !> Edges bear on each other when they overlap by this share of the shorter one, at any tolerance.
   real(wp), parameter :: bearing_share = 0.25_wp

   !> A block that stands deeper in its surface than this share of its inradius has been struck, or is pressed beyond
   !> what linear elasticity holds for: the corner of the next block is not passed over by as much.
   real(wp), parameter :: most_sunk = 0.02_wp

   type :: exposure_type
      real(wp) :: tolerance = 0                      !! of all edges [length]
      logical :: has_own = .false.                   !! edges have tolerances of their own
      real(wp), allocatable :: own(:)                !! (>= nv) with that, of each edge [length]
      logical(l1), allocatable :: is_borne(:)        !! (nv) another block's edge lies against the edge
      logical(l1), allocatable :: is_tied(:)         !! (nv) and is tied to it
      real(wp), allocatable :: low(:), high(:)       !! (>= nv) stretch of the edge that is covered; low > high: none
   contains
      procedure :: clear
      procedure :: cover
      procedure :: is_hidden
      procedure :: is_passed
      procedure :: between
   end type exposure_type

   !> What the searches of a step read.
   type :: search_input_type
      real(wp), pointer, contiguous :: vertices(:, :) => null()     !! (2, nv) now
      type(contact_topology_type), pointer :: topology => null()
      type(outlines_type), pointer :: outlines => null()            !! of the vertices now
      type(search_limits_type), pointer :: limits => null()
      type(contact_table_type), pointer :: previous => null()       !! last step's table
      type(contact_history_type), pointer :: history => null()      !! its index
      type(exposure_type), pointer :: exposure => null()            !! what is covered
   end type search_input_type

contains

   !> No edge is covered.
   pure subroutine clear(self, n_vertices, tolerance, sunk, block, inradius)
      class(exposure_type), intent(inout) :: self
      integer, intent(in) :: n_vertices
      real(wp), intent(in) :: tolerance            !! [length]
      real(wp), intent(in), optional :: sunk(:)    !! (blocks) tolerance of what touches a block [length]
      integer, intent(in), optional :: block(:)    !! (nv) owner of each vertex
      real(wp), intent(in), optional :: inradius(:)   !! (blocks) that bounds `sunk` [length]
      integer :: v
      self%tolerance = tolerance
      self%has_own = present(sunk) .and. present(block) .and. present(inradius)
      if (.not. allocated(self%is_borne)) allocate (self%is_borne(n_vertices), self%is_tied(n_vertices))
      if (allocated(self%low)) then
         if (min(size(self%low), size(self%high)) < n_vertices) deallocate (self%low, self%high)
      end if
      if (.not. allocated(self%low)) allocate (self%low(n_vertices), self%high(n_vertices))
      if (self%has_own) then
         if (allocated(self%own)) then
            if (size(self%own) < n_vertices) deallocate (self%own)
         end if
         if (.not. allocated(self%own)) allocate (self%own(n_vertices))
         do v = 1, n_vertices
            self%own(v) = min(sunk(block(v)), most_sunk*inradius(block(v)))
         end do
      end if
      self%is_borne = .false.
      self%is_tied = .false.
      self%low(1:n_vertices) = huge(1.0_wp)
      self%high(1:n_vertices) = -huge(1.0_wp)
   end subroutine clear

   !> Tolerance between edges, or vertices, of two blocks.
   pure real(wp) function between(self, f, e)
      class(exposure_type), intent(in) :: self
      integer, intent(in) :: f, e
      between = self%tolerance
      if (self%has_own) between = max(between, self%own(f), self%own(e))
   end function between

   !> The edges of an interval face each other.
   pure subroutine cover(self, interval, is_tied)
      class(exposure_type), intent(inout) :: self
      type(interval_type), intent(in) :: interval
      logical, intent(in) :: is_tied       !! covers however far it is stretched
      real(wp) :: tolerance
      associate (f => interval%f, e => interval%e)
         tolerance = self%tolerance
         if (self%has_own) tolerance = max(tolerance, self%own(f), self%own(e))
         if (min(interval%gap_low, interval%gap_high) > tolerance .and. .not. is_tied) return
         self%is_borne(f) = .true.
         self%is_borne(e) = .true.
         if (is_tied) self%is_tied(f) = .true.
         if (is_tied) self%is_tied(e) = .true.
         if (max(interval%gap_low, interval%gap_high) > tolerance .and. .not. is_tied) return
         call widen(self%low(e), self%high(e), interval%low, interval%high, tolerance)
         ! along f, which runs the other way
         call widen(self%low(f), self%high(f), interval%start - interval%high, interval%start - interval%low, &
                    tolerance)
      end associate
   end subroutine cover

   !> Join a stretch to one that it touches; of two that do not touch the longer stays.
   pure subroutine widen(low, high, first, last, tolerance)
      real(wp), intent(inout) :: low, high
      real(wp), intent(in) :: first, last, tolerance
      if (low > high) then
         low = first
         high = last
      else if (first <= high + tolerance .and. last >= low - tolerance) then
         low = min(low, first)
         high = max(high, last)
      else if (last - first > high - low) then
         low = first
         high = last
      end if
   end subroutine widen

   !> Can vertex v not strike edge e at the distance s from the start of the edge? A vertex that presses on the edge
   !> already is not hidden by what covers the edge: it would go through it.
   pure logical function is_hidden(self, v, e, s, vertices, topology, outlines, presses)
      class(exposure_type), intent(in) :: self
      integer, intent(in) :: v, e
      real(wp), intent(in) :: s                            !! of the foot of v [length]
      real(wp), intent(in), contiguous :: vertices(:, :)   !! (2, nv) now
      type(contact_topology_type), intent(in) :: topology
      type(outlines_type), intent(in) :: outlines
      logical, intent(in), optional :: presses             !! closed at the end of the last step, default .false.
      real(wp) :: tolerance
      tolerance = self%between(v, e)
      is_hidden = s >= self%low(e) - margin(self%low(e)) .and. &
                  s <= self%high(e) + margin(outlines%length(e) - self%high(e))
      if (is_hidden .and. present(presses)) is_hidden = .not. presses
      if (.not. is_hidden) is_hidden = is_below(topology%edge_in(v))
      if (.not. is_hidden) is_hidden = is_below(topology%edge_out(v))

   contains

      !> How far what is covered hides beyond its end: where more of the edge is left, that is a step, and its foot is
      !> not hidden, unless what stands there is tied to it, as a cell of a block.
      pure real(wp) function margin(rest)
         real(wp), intent(in) :: rest   !! of the edge beyond the end [length]
         margin = merge(tolerance, -tolerance, rest <= tolerance .or. self%is_tied(topology%edge_in(v)) .or. &
                        self%is_tied(topology%edge_out(v)))
      end function margin

      !> Does edge e lie on the outer side of an edge that is borne?
      pure logical function is_below(f)
         integer, intent(in) :: f
         real(wp) :: n(2)
         is_below = .false.
         if (.not. self%is_borne(f)) return
         n = [outlines%tangent(2, f), -outlines%tangent(1, f)]
         is_below = dot_product(vertices(:, e) - vertices(:, f), n) >= -tolerance .and. &
                    dot_product(vertices(:, topology%next(e)) - vertices(:, f), n) >= -tolerance
      end function is_below

   end function is_hidden

   !> Does vertex v pass over edge e, with contacts of vertices on edges? A vertex of an edge that lies against e, by
   !> more than the tolerance, bears on it. A shorter overlap is the depth to which blocks stand in the surface that
   !> they slide over: the vertex passes when it, or the vertex at the other end of the overlap, is hidden. A contact
   !> that was closed at the end of the last step stays.
   pure logical function is_passed(self, v, e, given)
      class(exposure_type), intent(in) :: self
      integer, intent(in) :: v, e
      type(search_input_type), intent(in) :: given
      type(interval_type) :: interval
      real(wp) :: enough
      integer :: f, k, row
      is_passed = .false.
      do k = 1, 2
         f = merge(given%topology%edge_in(v), given%topology%edge_out(v), k == 1)
         if (.not. is_facing(f, e, given%outlines, given%limits%cosine)) cycle
         call measure_interval(f, e, given%vertices, given%topology, given%outlines, interval)
         enough = min(self%between(f, e), bearing_share*min(given%outlines%length(f), given%outlines%length(e)))
         if (interval%high - interval%low > enough) return
         if (interval%vertex_low == 0) cycle
         is_passed = is_passed .or. hides(interval%vertex_low, interval%edge_low) .or. &
                     hides(interval%vertex_high, interval%edge_high)
      end do
      if (.not. is_passed) is_passed = hides(v, e)
      if (.not. is_passed) return
      row = given%history%find(given%previous, v, e)
      if (row > 0) is_passed = given%previous%state(row) == contact_state%open

   contains

      !> Is edge b hidden from vertex a?
      pure logical function hides(a, b)
         integer, intent(in) :: a, b
         hides = self%is_hidden(a, b, dot_product(given%vertices(:, a) - given%vertices(:, b), &
                                given%outlines%tangent(:, b)), given%vertices, given%topology, given%outlines)
      end function hides

   end function is_passed

end module rockdda_contact_exposure
