! SPDX-License-Identifier: MIT
!> Input of a joint network: the region, its openings, and the statistics of the joint sets.
!>
!> Lengths are in the user's unit L; angles in degrees. docs/cutting.md explains the values.
module rockdda_lines_statistics
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : origin_type
   use rockdda_model_options, only : unset_real
   implicit none
   private
   public :: joint_set_type, opening_type, region_type, extra_line_type, points_type, &
             statistics_type, law, shape_kind

   !> Laws of spacing and length.
   type :: law_enum
      integer :: uniform = 1      !! Shi and Goodman's perturbation of a lattice
      integer :: normal = 2       !! randomness is the coefficient of variation
      integer :: lognormal = 3    !! randomness is the coefficient of variation
      integer :: exponential = 4  !! coefficient of variation 1
   end type law_enum
   type(law_enum), parameter :: law = law_enum()

   type :: shape_enum
      integer :: horseshoe = 1
      integer :: circle = 2
      integer :: rectangle = 3
      integer :: polygon = 4
   end type shape_enum
   type(shape_enum), parameter :: shape_kind = shape_enum()

   type :: joint_set_type
      type(origin_type) :: origin
      real(wp) :: inclination = unset_real   !! of the traces, counter-clockwise from +x
      real(wp) :: dip = unset_real, dip_direction = unset_real   !! of the planes, in place of the inclination
      real(wp) :: spacing = 0           !! mean distance of neighbouring lines, in the section [L]
      real(wp) :: trace = huge(1.0_wp)  !! mean length of a trace [L]; huge: endless
      real(wp) :: bridge = 0            !! mean gap between the traces of a line [L]
      real(wp) :: randomness = unset_real    !! degree of randomness D_r, or coefficient of variation
      real(wp) :: offset = 0            !! distance of a line of the lattice from the origin, along the set's normal [L]
      real(wp) :: start = 0             !! start of a trace of line 0, along the line from the foot of the origin [L]
      real(wp) :: stagger = 0           !! shift of the traces from line to line, as a share of trace + bridge
      character(len=:), allocatable :: distribution, trace_distribution
      integer :: spacing_law = 1        !! one of law%..., by their names
      integer :: trace_law = 1
      integer :: ends_at = 0            !! set between whose neighbouring lines these joints run; 0: none
      integer :: material = 1           !! joint material
      logical :: avoid_cantilevers = .false.
   end type joint_set_type

   !> An opening. Measures that its shape does not have are unset.
   type :: opening_type
      type(origin_type) :: origin
      character(len=:), allocatable :: shape_name
      integer :: shape = 0                     !! one of shape_kind%..., by its name
      real(wp) :: center(2) = 0                !! of the box around it; polygon: added to the vertices
      real(wp) :: span = unset_real, wall_height = unset_real, arch_height = unset_real   !! horseshoe [L]
      real(wp) :: width = unset_real, height = unset_real                                 !! rectangle [L]
      real(wp) :: radius = unset_real          !! circle [L]
      integer :: segments = 0                  !! straight pieces of the arch or circle; 0: as fine as 10 degrees
      real(wp), allocatable :: vertices(:, :)  !! (2, n) polygon
      character(len=:), allocatable :: file    !! of the vertices, or of the options that draw the outline
      character(len=:), allocatable :: outline !! region of that file; stages excavate the opening
      integer :: material = 1                  !! joint material of the wall
   end type opening_type

   type :: region_type
      type(origin_type) :: origin
      real(wp) :: window(4) = unset_real       !! xmin, ymin, xmax, ymax
      real(wp) :: slope_toe(2) = unset_real
      real(wp) :: slope_angle = unset_real
      real(wp), allocatable :: vertices(:, :)  !! (2, n) outline, counter-clockwise
      real(wp) :: frame = 0                    !! thickness of the four fixed blocks around a window [L]; 0: none
      integer :: material = 1                  !! joint material of the outline
   end type region_type

   type :: extra_line_type
      type(origin_type) :: origin
      real(wp) :: ends(4) = 0
      integer :: material = 1                  !! joint material, or block material of a material line
   end type extra_line_type

   !> Points as they are given.
   type :: points_type
      type(origin_type) :: origin
      real(wp), allocatable :: points(:, :)    !! (2, n)
      real(wp), allocatable :: lines(:, :)     !! (4, n)
      real(wp) :: along(4) = unset_real        !! ends of a line of `count` points
      integer :: count = 0
   end type points_type

   type :: statistics_type
      integer :: seed = 1
      real(wp) :: edge_node_distance = 0       !! e0 of the geometry [L]; 0: a thousandth of the smallest spacing
      real(wp) :: azimuth = unset_real         !! of the x axis
      type(region_type) :: region
      type(joint_set_type), allocatable :: sets(:)
      type(opening_type), allocatable :: openings(:)
      type(extra_line_type), allocatable :: lines(:)
      type(extra_line_type), allocatable :: material_lines(:)
      type(points_type), allocatable :: fixed_groups(:), loading_groups(:), measured_groups(:)
      real(wp), allocatable :: fixed(:, :)     !! (4, n) points or lines of these groups
      real(wp), allocatable :: loading(:, :)   !! (2, n)
      real(wp), allocatable :: measured(:, :)  !! (2, n)
   end type statistics_type

end module rockdda_lines_statistics
