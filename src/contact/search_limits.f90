! SPDX-License-Identifier: MIT
!> Distances and angles within which contacts are searched for, and which contacts they are.
module rockdda_contact_search_limits
   use rockdda_base_kinds, only : wp
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
      integer, allocatable :: points(:)     !! (joints) stations of an interval
      logical, allocatable :: is_tied(:)    !! (joints) intact rock, where blocks touch at the start
      logical, allocatable :: bears_tension(:)   !! (joints) their bonds do
      integer, allocatable :: edge_joint(:) !! (nv) joint material of each edge; not allocated: no bond bears tension
      real(wp) :: radius = 0.01_wp !! of rounded corners, share of the shortest edge
      real(wp) :: smooth = 0       !! steps of a surface up to this count as plane [length]
      real(wp), allocatable :: sunk(:)      !! (blocks) the same, for what touches a block; or none [length]
   end type search_limits_type

end module rockdda_contact_search_limits
