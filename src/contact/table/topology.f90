! SPDX-License-Identifier: MIT
!> Who is whose neighbour on a block outline, as contacts see it.
!>
!> Bridge edges (joint material 0, from an island to the outline around it, walked twice) take no part in
!> contacts: each bridge end exists twice, and the outline continues across the bridge. Here every vertex gets its
!> real incoming and outgoing edge, and the second copy of a bridge end is switched off.
!>
!>     ... p -> v1 =bridge=> w1 -> ...island... -> w2 =bridge=> v2 -> q ...
!>     v1: active, edge_in = p, edge_out = v2 (the edge v2 -> q);   v2: not active
!>     w2: active, edge_in = before w2, edge_out = w1;              w1: not active
module rockdda_contact_topology
   use rockdda_base_kinds, only : wp, l1
   use rockdda_geometry_bridges, only : match_bridges
   use rockdda_geometry_polygons, only : inradius_bound
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_kinks, only : kinks_type, find_kinks, crushed
   implicit none
   private
   public :: contact_topology_type, new_contact_topology

   type :: contact_topology_type
      integer, allocatable :: block(:)     !! (nv) owner of the vertex
      integer, allocatable :: next(:)      !! (nv) end vertex of the edge that starts here (bridges included)
      integer, allocatable :: edge_out(:)  !! (nv) real edge that leaves the vertex
      integer, allocatable :: edge_in(:)   !! (nv) real edge that arrives at the vertex
      integer, allocatable :: owner(:)     !! (nv) the active copy of this vertex (itself, if active)
      logical(l1), allocatable :: active(:)    !! (nv) takes part in contacts as a vertex
      logical(l1), allocatable :: is_edge(:)   !! (nv) the edge that starts here takes part in contacts
      integer, allocatable :: first(:)     !! (nb + 1) vertices of block i: first(i) : first(i+1)-1
      type(kinks_type) :: kinks            !! at the start
      real(wp), allocatable :: inradius(:) !! (nb) bound of the inradius at the start, 2 A/perimeter [length]
   contains
      procedure :: lets_in
      procedure :: lets_in_corner
   end type contact_topology_type

contains

   !> Build the neighbourhood of all vertices.
   pure subroutine new_contact_topology(blocks, topology)
      type(block_system_type), intent(in) :: blocks
      type(contact_topology_type), intent(out) :: topology
      integer, allocatable :: twin(:)
      integer :: nv, i, k, j, first, last, arriving, turns
      nv = blocks%n_vertices()
      topology%first = blocks%vertex_offset + 1
      allocate (topology%block(nv), topology%next(nv), topology%edge_out(nv), topology%edge_in(nv), &
                topology%owner(nv), twin(nv), source=0)
      allocate (topology%active(nv), topology%is_edge(nv), source=.true._l1)
      do i = 1, blocks%n_blocks
         first = blocks%vertex_offset(i) + 1
         last = blocks%vertex_offset(i + 1)
         do k = first, last
            topology%block(k) = i
            topology%next(k) = k + 1
         end do
         topology%next(last) = first
      end do
      do k = 1, nv
         topology%is_edge(k) = blocks%edge_joint(k) > 0
      end do
      do i = 1, blocks%n_blocks
         first = blocks%vertex_offset(i) + 1
         last = blocks%vertex_offset(i + 1)
         if (all(topology%is_edge(first:last))) cycle
         twin(first:last) = match_bridges(blocks%vertices(:, first:last), blocks%edge_joint(first:last) <= 0)
         where (twin(first:last) > 0) twin(first:last) = twin(first:last) + first - 1
      end do
      do k = 1, nv
         first = blocks%vertex_offset(topology%block(k)) + 1
         last = blocks%vertex_offset(topology%block(k) + 1)
         arriving = merge(last, k - 1, k == first)
         topology%edge_in(k) = arriving
         topology%active(k) = topology%is_edge(arriving)
         ! turn around the vertex from bridge to bridge; never more often than the block has edges
         j = k
         do turns = first, last
            if (topology%is_edge(j) .or. twin(j) == 0) exit
            j = topology%next(twin(j))
         end do
         topology%edge_out(k) = j
      end do
      allocate (topology%inradius(blocks%n_blocks))
      do i = 1, blocks%n_blocks
         topology%inradius(i) = inradius_bound(blocks%vertices(:, topology%first(i):topology%first(i + 1) - 1))
      end do
      topology%kinks = find_kinks(blocks)
      topology%owner = [(k, k=1, nv)]
      do k = 1, nv
         if (topology%active(k)) topology%owner(topology%edge_out(k)) = k
      end do
   end subroutine new_contact_topology

   !> Does an edge that ends in a kink let in the tip v of it that deep? Those along the edges of the tip do not.
   pure logical function lets_in(self, v, e, depth, length)
      class(contact_topology_type), intent(in) :: self
      integer, intent(in) :: v, e
      real(wp), intent(in) :: depth                  !! [length]
      real(wp), intent(in), contiguous :: length(:)  !! (nv) of edges [length]
      lets_in = .false.
      if (self%kinks%met(v) == 0) return
      associate (kinks => self%kinks)
         lets_in = any(kinks%node([e, self%next(e)]) == kinks%node(v)) .and. all(kinks%beside(:, v) /= e)
         if (lets_in) lets_in = depth < crushed*min(length(self%edge_in(v)), length(self%edge_out(v)))
      end associate
   end function lets_in

   !> Does corner w in a kink let in the tip v of it that deep?
   pure logical function lets_in_corner(self, v, w, depth, length)
      class(contact_topology_type), intent(in) :: self
      integer, intent(in) :: v, w
      real(wp), intent(in) :: depth                  !! [length]
      real(wp), intent(in), contiguous :: length(:)  !! (nv) of edges [length]
      lets_in_corner = self%lets_in(v, self%edge_in(w), depth, length) .and. &
                       self%lets_in(v, self%edge_out(w), depth, length)
   end function lets_in_corner

end module rockdda_contact_topology
