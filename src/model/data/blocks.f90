! SPDX-License-Identifier: MIT
!> The cut model: blocks as polygons, their materials, and the points and bolts on them.
!>
!> This is what a block file (.blk) holds; nothing here changes while blocks move.
!>
!>     block          1            2
!>     vertex      1 2 3 4      5 6 7        vertices(:, k), counter-clockwise, not closed
!>     offset    0          4         7      block i owns vertices offset(i)+1 ... offset(i+1)
!>     edge k goes from vertex k to the next vertex of the same block and has joint material edge_joint(k)
!>
!> edge_joint = 0 marks a bridge edge from an island to the outline around it (walked twice, no contacts).
module rockdda_model_blocks
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : origin_type
   implicit none
   private
   public :: block_system_type, point_set_type, bolt_set_type, largest_coordinate

   !> Largest coordinate accepted (fourth powers must stay finite).
   real(wp), parameter :: largest_coordinate = 1.0e30_wp

   !> Points that move with blocks.
   type :: point_set_type
      integer :: n = 0
      real(wp), allocatable :: position(:, :)   !! (2, n) at the start
      integer, allocatable :: block(:)          !! (n) 1-based
      type(origin_type), allocatable :: origin(:) !! (n) input line, empty when unknown
      integer, allocatable :: number(:)         !! (n) of the input, from 1, increasing; unallocated: 1 ... n
   contains
      procedure :: numbers
   end type point_set_type

   !> Bolts: axial springs between two points on two blocks (or one end in no block: block 0, a fixed anchor).
   type :: bolt_set_type
      integer :: n = 0
      real(wp), allocatable :: ends(:, :)       !! (4, n) x1 y1 x2 y2 at the start
      integer, allocatable :: blocks(:, :)      !! (2, n) 1-based; 0 = the fixed outside
      real(wp), allocatable :: stiffness(:)     !! (n) force per length, > 0
      real(wp), allocatable :: pretension(:)    !! (n) force at the start, tension positive
      real(wp), allocatable :: strength(:)      !! (n) largest axial force, 0 = unlimited
   end type bolt_set_type

   type :: block_system_type
      integer :: n_blocks = 0
      integer, allocatable :: vertex_offset(:)  !! (n_blocks + 1), first entry 0
      real(wp), allocatable :: vertices(:, :)   !! (2, n_vertices)
      integer, allocatable :: edge_joint(:)     !! (n_vertices) joint material of the edge that starts here
      integer, allocatable :: block_material(:) !! (n_blocks) 1-based
      real(wp) :: edge_node_distance = 0        !! e0 used in cutting
      integer, allocatable :: file_line(:)      !! (n_blocks) line of a block file; unallocated after cutting
      integer, allocatable :: parent(:)         !! (n_blocks) block, 1-based, that a cell was cut from; unallocated
                                                !! when no block was cut into cells
      integer :: n_segments = 0                 !! number of the last blocks that are of linings, none as cut
      type(point_set_type) :: fixed             !! fixed points
      type(point_set_type) :: loading           !! loading points
      type(point_set_type) :: measured          !! measured points
      type(bolt_set_type) :: bolts
   contains
      procedure :: n_vertices
      procedure :: count_holds
   end type block_system_type

contains

   !> Numbers of the points in the input: an ignored point of the input does not renumber the later ones.
   pure function numbers(self) result(list)
      class(point_set_type), intent(in) :: self
      integer, allocatable :: list(:)
      integer :: i
      if (allocated(self%number)) then
         list = self%number(1:self%n)
      else
         list = [(i, i=1, self%n)]
      end if
   end function numbers

   !> Count what holds each block: its fixed points, and two for an edge that a boundary holds. A block with two or more
   !> cannot move.
   pure subroutine count_holds(self, holds, released, at_boundary)
      class(block_system_type), intent(in) :: self
      real(wp), intent(out) :: holds(:)                   !! (n_blocks) a whole number
      logical, intent(in), optional :: released(:)        !! (fixed%n) points that were let go
      logical, intent(in), optional :: at_boundary(:)     !! (n_blocks) with an edge that a boundary holds
      integer :: p
      holds = 0
      if (present(at_boundary)) where (at_boundary) holds = 2
      do p = 1, self%fixed%n
         if (present(released)) then
            if (released(p)) cycle
         end if
         associate (here => holds(self%fixed%block(p)))
            here = here + 1
         end associate
      end do
   end subroutine count_holds

   !> Number of vertices of all blocks.
   pure integer function n_vertices(self)
      class(block_system_type), intent(in) :: self
      n_vertices = 0
      if (allocated(self%vertex_offset)) n_vertices = self%vertex_offset(self%n_blocks + 1)
   end function n_vertices

end module rockdda_model_blocks
