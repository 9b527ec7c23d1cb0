! SPDX-License-Identifier: MIT
!> Directions and lengths of all edges, and which corners are concave: what the narrow phase reads many times.
module rockdda_contact_outlines
   use rockdda_base_kinds, only : wp, l1
   use rockdda_base_parallel, only : parallel_blocks
   use rockdda_contact_topology, only : contact_topology_type
   implicit none
   private
   public :: outlines_type, outward, is_outside

   type :: outlines_type
      real(wp), allocatable :: tangent(:, :)   !! (2, >= nv) unit vector along the edge that starts at the vertex
      real(wp), allocatable :: length(:)       !! (>= nv) of that edge
      logical(l1), allocatable :: concave(:)   !! (nv) the outline turns right here, by more than the angle tolerance
   contains
      procedure :: update
      procedure :: update_some
   end type outlines_type

contains

   !> For the vertices as they are now.
   subroutine update(self, topology, vertices, sine)
      class(outlines_type), intent(inout) :: self
      type(contact_topology_type), intent(in) :: topology
      real(wp), intent(in), contiguous :: vertices(:, :)   !! (2, nv)
      real(wp), intent(in) :: sine             !! of the angle tolerance
      integer :: v, nv
      nv = size(vertices, 2)
      call make_room(self, nv)
      !$omp parallel default(none) shared(self, topology, vertices, sine, nv) private(v) &
      !$omp if (nv > 4*parallel_blocks)
      !$omp do schedule(static)
      do v = 1, nv
         call set_edge(vertices(:, v), vertices(:, topology%next(v)), self%tangent(:, v), self%length(v))
      end do
      !$omp end do
      !$omp do schedule(static)
      do v = 1, nv
         self%concave(v) = turns_right(self%tangent(:, topology%edge_in(v)), self%tangent(:, topology%edge_out(v)), &
                                       sine)
      end do
      !$omp end do
      !$omp end parallel
   end subroutine update

   !> The same for some of the blocks; what there is of others is undefined.
   subroutine update_some(self, topology, vertices, sine, chosen)
      class(outlines_type), intent(inout) :: self
      type(contact_topology_type), intent(in) :: topology
      real(wp), intent(in), contiguous :: vertices(:, :)   !! (2, nv)
      real(wp), intent(in) :: sine             !! of the angle tolerance
      logical, intent(in) :: chosen(:)         !! (nb)
      integer :: b, v
      call make_room(self, size(vertices, 2))
      !$omp parallel do default(none) shared(self, topology, vertices, sine, chosen) private(b, v) schedule(static) &
      !$omp if (size(chosen) > parallel_blocks)
      do b = 1, size(chosen)
         if (.not. chosen(b)) cycle
         do v = topology%first(b), topology%first(b + 1) - 1
            call set_edge(vertices(:, v), vertices(:, topology%next(v)), self%tangent(:, v), self%length(v))
         end do
         do v = topology%first(b), topology%first(b + 1) - 1
            self%concave(v) = turns_right(self%tangent(:, topology%edge_in(v)), &
                                          self%tangent(:, topology%edge_out(v)), sine)
         end do
      end do
      !$omp end parallel do
   end subroutine update_some

   !> Arrays for nv edges.
   pure subroutine make_room(self, nv)
      class(outlines_type), intent(inout) :: self
      integer, intent(in) :: nv
      if (allocated(self%tangent)) then
         if (size(self%tangent, 2) < nv) deallocate (self%tangent)
      end if
      if (.not. allocated(self%tangent)) allocate (self%tangent(2, nv))
      if (allocated(self%length)) then
         if (size(self%length) < nv) deallocate (self%length)
      end if
      if (.not. allocated(self%length)) allocate (self%length(nv))
      if (.not. allocated(self%concave)) allocate (self%concave(nv))
   end subroutine make_room

   !> Direction and length of an edge.
   pure subroutine set_edge(from, to, tangent, length)
      real(wp), intent(in) :: from(2), to(2)
      real(wp), intent(out) :: tangent(2), length
      real(wp) :: t(2)
      t = to - from
      length = sqrt(t(1)**2 + t(2)**2)
      tangent = t/max(length, tiny(1.0_wp))
   end subroutine set_edge

   !> Does the outline turn right between two edges, by more than the angle tolerance?
   pure logical function turns_right(into, outof, sine)
      real(wp), intent(in) :: into(2), outof(2)   !! unit vectors
      real(wp), intent(in) :: sine
      turns_right = into(1)*outof(2) - into(2)*outof(1) < -sine
   end function turns_right

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
