! SPDX-License-Identifier: MIT
!> Directions and lengths of all edges, and which corners are concave: what the narrow phase asks for many times.
module rockdda_contact_outlines
   use rockdda_base_kinds, only : wp, l1
   use rockdda_base_parallel, only : parallel_blocks
   use rockdda_contact_topology, only : contact_topology_type
   implicit none
   private
   public :: outlines_type, outward, is_outside

   type :: outlines_type
      real(wp), allocatable :: tangent(:, :)   !! (2, >= nv) unit vector along the edge that starts at the vertex
      real(wp), allocatable :: length(:)       !! (nv) of that edge
      logical(l1), allocatable :: concave(:)   !! (nv) the outline turns right here, by more than the angle tolerance
   contains
      procedure :: update
   end type outlines_type

contains

   !> For the vertices as they are now.
   subroutine update(self, topology, vertices, sine)
      class(outlines_type), intent(inout) :: self
      type(contact_topology_type), intent(in) :: topology
      real(wp), intent(in), contiguous :: vertices(:, :)   !! (2, nv)
      real(wp), intent(in) :: sine             !! of the angle tolerance
      real(wp) :: t(2), length
      integer :: v, nv
      nv = size(vertices, 2)
      if (allocated(self%tangent)) then
         if (size(self%tangent, 2) < nv) deallocate (self%tangent)
      end if
      if (.not. allocated(self%tangent)) allocate (self%tangent(2, nv))
      if (.not. allocated(self%length)) allocate (self%length(nv), self%concave(nv))
      !$omp parallel default(none) shared(self, topology, vertices, sine, nv) private(v, t, length) &
      !$omp if (nv > 4*parallel_blocks)
      !$omp do schedule(static)
      do v = 1, nv
         t = vertices(:, topology%next(v)) - vertices(:, v)
         length = sqrt(t(1)**2 + t(2)**2)
         self%length(v) = length
         self%tangent(:, v) = t/max(length, tiny(1.0_wp))
      end do
      !$omp end do
      !$omp do schedule(static)
      do v = 1, nv
         associate (into => self%tangent(:, topology%edge_in(v)), outof => self%tangent(:, topology%edge_out(v)))
            self%concave(v) = into(1)*outof(2) - into(2)*outof(1) < -sine
         end associate
      end do
      !$omp end do
      !$omp end parallel
   end subroutine update

   !> Outward normal of an edge of a counter-clockwise block.
   pure function outward(t) result(n)
      real(wp), intent(in) :: t(2)   !! unit vector along the edge
      real(wp) :: n(2)
      n = [t(2), -t(1)]
   end function outward

   !> Do both edges of a corner lie on the side of a line to which n points?
   pure logical function is_outside(into, outof, n, sine)
      real(wp), intent(in) :: into(2), outof(2)   !! unit vectors along the edges that reach and leave the corner
      real(wp), intent(in) :: n(2)                !! unit normal of the line
      real(wp), intent(in) :: sine                !! of the angle tolerance
      is_outside = dot_product(outof, n) >= -sine .and. -dot_product(into, n) >= -sine
   end function is_outside

end module rockdda_contact_outlines
