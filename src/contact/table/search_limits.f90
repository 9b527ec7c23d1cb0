! SPDX-License-Identifier: MIT
!> Distances and angles within which contacts are searched for, and which contacts they are.
module rockdda_contact_search_limits
   use rockdda_base_kinds, only : wp
   use rockdda_contact_normal_law, only : normal_law_type
   implicit none
   private
   public :: search_limits_type, placing_share

   !> Gaps and overlaps up to this share of the shorter edge are free of stress where a block is placed.
   real(wp), parameter :: placing_share = 0.01_wp

   !> Distances and angles of one search.
   type :: search_limits_type
      real(wp) :: reach = 0        !! largest gap of a candidate [length]
      real(wp) :: zone = 0         !! how far a corner region goes into the adjacent edges [length]
      real(wp) :: penetration = 0  !! deepest overlap that is taken for a contact [length]
      real(wp) :: sine = 0         !! sine of the angle tolerance
      real(wp) :: cosine = 1       !! cosine of the angle tolerance
      real(wp) :: held_cosine = 1  !! of the angle that no edges exceed which a bond holds; > cosine: the tolerance
      logical :: by_length = .false.  !! edges that face each other are intervals; vertices strike what is exposed
      logical :: corrected = .false.  !! vertices on edges, which strike what is exposed and begin without energy
      logical, allocatable :: is_tied(:)    !! (joints) intact rock, where blocks touch at the start
      logical, allocatable :: is_born(:)    !! (blocks) contacts begin as at the start; or none
      real(wp) :: touch = 0                 !! gap up to which they touch, at most [length]
      logical, allocatable :: bears_tension(:)   !! (joints) their bonds do
      logical, allocatable :: weakens(:)    !! (joints) their bonds do, by slip; not allocated: none
      type(normal_law_type), allocatable :: normal(:)   !! (joints) laws along the normal; not allocated: all linear
      integer, allocatable :: edge_joint(:) !! (nv) joint material of each edge; not allocated: no bond bears tension
      real(wp) :: radius = 0.01_wp !! of rounded corners, share of the shortest edge
      real(wp) :: smooth = 0       !! steps of a surface up to this count as plane [length]
      real(wp), allocatable :: sunk(:)      !! (blocks) the same, for what touches a block; or none [length]
   contains
      procedure :: law_of
      procedure :: facing_sine
   end type search_limits_type

contains

   !> Law of a joint material along the normal. What a bond holds presses no edge.
   pure type(normal_law_type) function law_of(self, joint, bonded) result(law)
      class(search_limits_type), intent(in) :: self
      integer, intent(in) :: joint
      logical, intent(in), optional :: bonded   !! absent: no
      if (allocated(self%normal)) law = self%normal(joint)
      if (present(bonded)) law%penalty = law%penalty .and. .not. bonded
   end function law_of

   !> Sine of the widest angle that edges have which face each other.
   pure real(wp) function facing_sine(self)
      class(search_limits_type), intent(in) :: self
      facing_sine = sqrt(1 - min(self%cosine, self%held_cosine)**2)
   end function facing_sine

end module rockdda_contact_search_limits
