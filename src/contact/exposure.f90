! SPDX-License-Identifier: MIT
!> What a vertex cannot strike, with contact by length.
!>
!>          |      A       |            A rides on C and comes to D. Its corner v lies a little below the corner of D,
!>          by
!>          |______________v____        the compression of the springs or as rough as the drawing is. The side of D is
!>                 C    | |    D        covered by C, and lies below the edge of A that C bears: v passes over it.
!>
!> Two rules follow from the intervals of the joints, both with a tolerance:
!>     a stretch of an edge that another block's edge covers cannot be struck by a third block's vertex;
!>     a vertex at the end of an edge that another block bears does not strike what lies wholly below the line of that
!>     edge.
module rockdda_contact_exposure
   use rockdda_base_kinds, only : wp
   use rockdda_contact_topology, only : contact_topology_type
   use rockdda_contact_outlines, only : outlines_type, outward
   use rockdda_contact_intervals, only : interval_type
   implicit none
   private
   public :: exposure_type

   type :: exposure_type
      real(wp) :: tolerance = 0                      !! [length]
      logical, allocatable :: is_borne(:)            !! (nv) another block's edge lies against the edge
      real(wp), allocatable :: low(:), high(:)       !! (nv) stretch of the edge that is covered; low > high: none
   contains
      procedure :: clear
      procedure :: cover
      procedure :: is_hidden
   end type exposure_type

contains

   !> No edge is covered.
   pure subroutine clear(self, n_vertices, tolerance)
      class(exposure_type), intent(inout) :: self
      integer, intent(in) :: n_vertices
      real(wp), intent(in) :: tolerance   !! [length]
      self%tolerance = tolerance
      if (.not. allocated(self%is_borne)) then
         allocate (self%is_borne(n_vertices), self%low(n_vertices), self%high(n_vertices))
      end if
      self%is_borne = .false.
      self%low = huge(1.0_wp)
      self%high = -huge(1.0_wp)
   end subroutine clear

   !> Edges f and e face each other on an interval.
   pure subroutine cover(self, f, e, interval, is_tied)
      class(exposure_type), intent(inout) :: self
      integer, intent(in) :: f, e
      type(interval_type), intent(in) :: interval
      logical, intent(in) :: is_tied       !! covers however far it is stretched
      if (min(interval%gap_low, interval%gap_high) > self%tolerance .and. .not. is_tied) return
      self%is_borne(f) = .true.
      self%is_borne(e) = .true.
      if (max(interval%gap_low, interval%gap_high) > self%tolerance .and. .not. is_tied) return
      call widen(self%low(e), self%high(e), interval%low, interval%high, self%tolerance)
      ! along f, which runs the other way
      call widen(self%low(f), self%high(f), interval%start - interval%high, interval%start - interval%low, &
                 self%tolerance)
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

   !> Can vertex v not strike edge e at the distance s from the start of the edge?
   pure logical function is_hidden(self, v, e, s, vertices, topology, outlines)
      class(exposure_type), intent(in) :: self
      integer, intent(in) :: v, e
      real(wp), intent(in) :: s                            !! of the foot of v [length]
      real(wp), intent(in), contiguous :: vertices(:, :)   !! (2, nv) now
      type(contact_topology_type), intent(in) :: topology
      type(outlines_type), intent(in) :: outlines
      is_hidden = s >= self%low(e) - margin(self%low(e)) .and. &
                  s <= self%high(e) + margin(outlines%length(e) - self%high(e))
      if (.not. is_hidden) is_hidden = is_below(topology%edge_in(v))
      if (.not. is_hidden) is_hidden = is_below(topology%edge_out(v))

   contains

      !> How far what is covered hides beyond its end: where more of the edge is left, that is a step, and its foot is
      !> not hidden.
      pure real(wp) function margin(rest)
         real(wp), intent(in) :: rest   !! of the edge beyond the end [length]
         margin = merge(self%tolerance, -self%tolerance, rest <= self%tolerance)
      end function margin

      !> Does edge e lie on the outer side of an edge that is borne?
      pure logical function is_below(f)
         integer, intent(in) :: f
         real(wp) :: n(2)
         is_below = .false.
         if (.not. self%is_borne(f)) return
         n = outward(outlines%tangent(:, f))
         is_below = dot_product(vertices(:, e) - vertices(:, f), n) >= -self%tolerance .and. &
                    dot_product(vertices(:, topology%next(e)) - vertices(:, f), n) >= -self%tolerance
      end function is_below

   end function is_hidden

end module rockdda_contact_exposure
