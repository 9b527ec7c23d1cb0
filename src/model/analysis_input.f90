! SPDX-License-Identifier: MIT
!> Content of an analysis file (.df, .ana): run control and materials.
module rockdda_model_analysis_input
   use rockdda_base_kinds, only : wp
   implicit none
   private
   public :: analysis_input_type, block_material_type, joint_material_type, time_table_type, dialect

   type :: dialect_enum
      integer :: auto = 0   !! decide by counting
      integer :: peer = 1   !! DDA for Windows ('dda_windows'): no contact stiffness, no time tables
      integer :: g0 = 2     !! contact stiffness, time tables
   end type dialect_enum
   type(dialect_enum), parameter :: dialect = dialect_enum()

   !> One block material: 13 numbers of the analysis file.
   type :: block_material_type
      real(wp) :: density = 0            !! mass per area (unit thickness), > 0
      real(wp) :: weight = 0             !! weight per area, positive acts in -y
      real(wp) :: youngs_modulus = 0     !! E, > 0
      real(wp) :: poisson_ratio = 0      !! in (-1, 0.5)
      real(wp) :: stress(3) = 0          !! initial s11 s22 s12, tension positive
      real(wp) :: stress_gradient(3) = 0 !! d(stress)/dy: sigma0 = stress + gradient*y at the block centroid
      real(wp) :: velocity(3) = 0        !! initial vx vy vr [length/time, rad/time]
   end type block_material_type

   !> One joint material: 3 numbers of the analysis file.
   type :: joint_material_type
      real(wp) :: friction_angle = 0     !! [deg] in [0, 90)
      real(wp) :: cohesion = 0           !! stress, >= 0
      real(wp) :: tension = 0            !! tensile strength, stress, >= 0
   end type joint_material_type

   !> Time-dependent values of one point, linear in between, constant beyond the ends.
   !> For a fixed point x y are prescribed displacements, for a loading point forces.
   type :: time_table_type
      real(wp), allocatable :: rows(:, :) !! (3, m) t x y, t not decreasing; m may be 0
   end type time_table_type

   type :: analysis_input_type
      integer :: dialect = 0                  !! the one found: dialect%peer or dialect%g0
      real(wp) :: k01 = 0                     !! 0 static ... 1 dynamic
      integer :: n_steps = 0
      real(wp) :: displacement_ratio = 0      !! g2, allowed displacement per step over w0, > 0
      real(wp) :: dt_max = 0                  !! g1, largest time step, > 0
      real(wp) :: stiffness = 0               !! g0, contact spring stiffness, 0 = automatic
      real(wp) :: sor_factor = 1.4_wp         !! in [1, 2)
      type(block_material_type), allocatable :: block_materials(:)
      type(joint_material_type), allocatable :: joint_materials(:)
      type(time_table_type), allocatable :: fixed_tables(:)    !! one per fixed point, or size 0
      type(time_table_type), allocatable :: loading_tables(:)  !! one per loading point, or size 0
   end type analysis_input_type

end module rockdda_model_analysis_input
