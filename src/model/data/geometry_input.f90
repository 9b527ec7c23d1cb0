! SPDX-License-Identifier: MIT
!> Content of a geometry file (.dc, .geo): lines and points before cutting.
!>
!> Units are the user's own consistent set. Lines keep their place in the file, for messages
!> about dropped lines.
module rockdda_model_geometry_input
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : origin_type
   use rockdda_base_strings, only : is_given, lower_case
   use rockdda_model_analysis_input, only : unset_real
   implicit none
   private
   public :: geometry_input_type, bolt_type, is_spring

   !> A bolt, from its columns in a geometry file (a spring) or from options.
   type :: bolt_type
      character(len=:), allocatable :: name   !! not given in a geometry file
      character(len=:), allocatable :: kind   !! 'grouted' | 'end_anchored' | 'yielding' | 'friction'; else a spring
      real(wp), allocatable :: from(:), to(:) !! (2) its ends at the start, the head first [length]
      !> x y of the points of a line on which the heads of a pattern lie [length]
      real(wp), allocatable :: along(:)
      character(len=:), allocatable :: outline   !! region instead of it
      real(wp) :: spacing = unset_real        !! of the heads [length]
      real(wp) :: length = unset_real         !! of the bolts [length]
      real(wp) :: angle = unset_real          !! from the normal of the line [degrees]
      real(wp) :: offset = unset_real         !! of the first head from the start of the line [length]
      real(wp) :: stiffness = unset_real      !! of a spring [force/length], > 0
      real(wp) :: diameter = unset_real, area = unset_real   !! of the steel [length, length^2]
      real(wp) :: young = unset_real          !! [stress]
      real(wp) :: pretension = 0              !! [force]
      real(wp) :: yield_force = 0             !! [force], 0: unlimited
      real(wp) :: rupture_strain = unset_real !! plastic strain
      real(wp) :: spacing_out_of_plane = unset_real   !! [length]
      real(wp) :: grout_stiffness = unset_real   !! [force/length^2]
      real(wp) :: grout_strength = unset_real    !! [force/length]
      real(wp) :: grout_residual = unset_real    !! share of the strength after slip
      real(wp), allocatable :: free_length(:) !! (2) part without grout, from the head [length]
      real(wp) :: plate_strength = unset_real !! [force]
      real(wp) :: element = unset_real        !! distance of nodes [length]
      real(wp) :: plateau_force = unset_real  !! [force]
      real(wp) :: stroke = unset_real         !! [length]
      character(len=:), allocatable :: shear_stiffness   !! of the dowel, a number or 'auto' [force/length]
      character(len=:), allocatable :: shear_strength    !! of the dowel, a number or 'auto' [force], 0: unlimited
      real(wp) :: bedding_stiffness = unset_real   !! [stress]
      type(origin_type) :: origin             !! where it was read
   end type bolt_type

   type :: geometry_input_type
      real(wp) :: edge_node_distance = 0      !! e0, smallest distance between a node and an edge [length]
      integer :: n_boundary = 0               !! the first n_boundary lines are boundary lines
      logical :: allow_open = .false.         !! boundary lines that do not close are a warning, not an error
      real(wp), allocatable :: lines(:, :)          !! (4, n) x1 y1 x2 y2
      integer, allocatable :: line_joint(:)         !! (n) joint material, 1-based
      real(wp), allocatable :: material_lines(:, :) !! (4, n)
      integer, allocatable :: line_material(:)      !! (n) block material, 1-based
      type(bolt_type), allocatable :: bolts(:)
      real(wp), allocatable :: fixed_lines(:, :)    !! (4, n) a point when both ends agree
      real(wp), allocatable :: loading_points(:, :) !! (2, n)
      real(wp), allocatable :: measured_points(:, :) !! (2, n)
      real(wp), allocatable :: hole_points(:, :)    !! (2, n)
      type(origin_type), allocatable :: line_origin(:), material_line_origin(:)
      type(origin_type), allocatable :: fixed_origin(:), loading_origin(:), measured_origin(:), hole_origin(:)
   contains
      procedure :: allocate_all
   end type geometry_input_type

contains

   !> Is a bolt a spring between its ends?
   elemental logical function is_spring(bolt)
      type(bolt_type), intent(in) :: bolt
      is_spring = .true.
      if (is_given(bolt%kind)) is_spring = lower_case(trim(adjustl(bolt%kind))) == 'spring'
   end function is_spring

   !> Allocate every array (all zero, all origins empty), also those of length 0.
   pure subroutine allocate_all(self, n_lines, n_material_lines, n_bolts, n_fixed, n_loading, n_measured, n_holes)
      class(geometry_input_type), intent(inout) :: self
      integer, intent(in) :: n_lines, n_material_lines, n_bolts, n_fixed, n_loading, n_measured, n_holes
      call drop_all(self)
      allocate (self%lines(4, n_lines), self%material_lines(4, n_material_lines), self%fixed_lines(4, n_fixed), &
                self%loading_points(2, n_loading), self%measured_points(2, n_measured), self%hole_points(2, n_holes), &
                source=0.0_wp)
      allocate (self%line_joint(n_lines), self%line_material(n_material_lines), source=1)
      allocate (self%bolts(n_bolts))
      allocate (self%line_origin(n_lines), self%material_line_origin(n_material_lines), &
                self%fixed_origin(n_fixed), self%loading_origin(n_loading), &
                self%measured_origin(n_measured), self%hole_origin(n_holes))
   end subroutine allocate_all

   !> Deallocate every array.
   pure subroutine drop_all(self)
      class(geometry_input_type), intent(inout) :: self
      if (.not. allocated(self%lines)) return
      deallocate (self%lines, self%material_lines, self%bolts, self%fixed_lines, &
                  self%loading_points, self%measured_points, self%hole_points, self%line_joint, self%line_material, &
                  self%line_origin, self%material_line_origin, self%fixed_origin, &
                  self%loading_origin, self%measured_origin, self%hole_origin)
   end subroutine drop_all

end module rockdda_model_geometry_input
