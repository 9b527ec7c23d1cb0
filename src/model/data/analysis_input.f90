! SPDX-License-Identifier: MIT
!> What an analysis file (.df, .ana) says: run control and materials. Joint materials have further values, which
!> options give.
module rockdda_model_analysis_input
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : origin_type
   implicit none
   private
   public :: analysis_input_type, named_material_type, block_material_type, joint_material_type, time_table_type
   public :: dialect
   public :: unset_real, unset_block_material, unset_joint_material

   !> Sentinel of a real that was not given.
   real(wp), parameter :: unset_real = -huge(1.0_wp)

   type :: dialect_enum
      integer :: auto = 0   !! decide by counting
      integer :: windows = 1   !! DDA for Windows ('dda_windows'): no contact stiffness, no time tables
      integer :: g0 = 2     !! contact stiffness, time tables
   end type dialect_enum
   type(dialect_enum), parameter :: dialect = dialect_enum()

   !> What block and joint materials have in common.
   type :: named_material_type
      integer :: number = 0              !! from 1
      character(len=:), allocatable :: name
      type(origin_type) :: origin        !! where options of it were read
   end type named_material_type

   !> One block material: 13 numbers of the analysis file, and its name in the options.
   type, extends(named_material_type) :: block_material_type
      real(wp) :: density = 0            !! mass per area (unit thickness), > 0
      real(wp) :: weight = 0             !! weight per area, positive acts in -y
      real(wp) :: youngs_modulus = 0     !! E, > 0
      real(wp) :: poisson_ratio = 0      !! in (-1, 0.5)
      real(wp) :: stress(3) = 0          !! initial s11 s22 s12, tension positive
      real(wp) :: stress_gradient(3) = 0 !! d(stress)/dy: sigma0 = stress + gradient*y at the block centroid
      real(wp) :: velocity(3) = 0        !! initial vx vy vr [length/time, rad/time]
   contains
      procedure :: numbers
      procedure :: set_numbers
   end type block_material_type

   !> One joint material: 3 numbers of the analysis file, and what options say of it. Parameters of laws are unset
   !> where they were not given.
   type, extends(named_material_type) :: joint_material_type
      character(len=:), allocatable :: word   !! of &joint_law: number or name of the material
      real(wp) :: friction_angle = 0     !! [deg] in [0, 90)
      real(wp) :: cohesion = 0           !! stress, >= 0
      real(wp) :: tension = 0            !! tensile strength, stress, >= 0
      real(wp) :: normal_stiffness = 0   !! stress/length, > 0; 0: not given
      real(wp) :: shear_stiffness = 0    !! stress/length, > 0; 0: not given
      real(wp) :: maximum_closure = unset_real   !! [length], > 0; unset: the normal stiffness is constant
      character(len=:), allocatable :: law   !! not allocated or empty: 'coulomb'
      real(wp), allocatable :: parameters(:) !! of the law, in its order (the other way is by name)
      real(wp) :: residual_friction = unset_real  !! [deg] in [0, 90)
      real(wp) :: residual_cohesion = unset_real  !! stress, >= 0
      real(wp) :: residual_tension = unset_real   !! stress, >= 0
      real(wp) :: slip_length = unset_real        !! slip from peak to residual strength [length], > 0
      real(wp) :: slip_rate = unset_real          !! scale of the velocity law [length/time], > 0
      real(wp) :: jrc = unset_real                !! joint roughness coefficient
      real(wp) :: jcs = unset_real                !! joint wall compressive strength, stress, > 0
      real(wp) :: dilation = 0           !! [deg] in [0, 90)
      real(wp) :: dilation_slip = unset_real      !! slip at which dilation ends [length], >= 0; unset: never
      real(wp) :: damping_ratio = 0      !! Voigt dashpot, fraction of critical
      real(wp) :: restitution = unset_real        !! in [0, 1]; unset: no law of impact
      logical :: brittle = .true.        !! cohesion and tension are lost at first slip or opening
      logical :: tie = .false.           !! intact rock: both sides deform as one
      logical :: brittle_given = .false., tie_given = .false.
      real(wp) :: reduction(3) = 1       !! tan(phi), cohesion and tension of the law are divided by these, > 0
      !> Without a stiffness of its own: the edge of a block bears where it opens; a search compares with springs.
      logical :: edge_bears = .true.
   end type joint_material_type

   !> Time-dependent values of one point, linear in between, constant beyond the ends.
   !> For a fixed point x y are prescribed displacements, for a loading point forces.
   type :: time_table_type
      real(wp), allocatable :: rows(:, :) !! (3, m) t x y, t not decreasing; m may be 0
      character(len=:), allocatable :: name !! of the load; empty or not given: none
      type(origin_type) :: origin         !! where they were read
   end type time_table_type

   type :: analysis_input_type
      integer :: dialect = 0                  !! the one found: dialect%windows or dialect%g0
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

contains

   !> The numbers of a block material, in the order of an analysis file.
   pure function numbers(self)
      class(block_material_type), intent(in) :: self
      real(wp) :: numbers(13)
      numbers = [self%density, self%weight, self%youngs_modulus, self%poisson_ratio, self%stress, &
                 self%stress_gradient, self%velocity]
   end function numbers

   !> Set all of them.
   pure subroutine set_numbers(self, values)
      class(block_material_type), intent(inout) :: self
      real(wp), intent(in) :: values(13)
      self%density = values(1)
      self%weight = values(2)
      self%youngs_modulus = values(3)
      self%poisson_ratio = values(4)
      self%stress = values(5:7)
      self%stress_gradient = values(8:10)
      self%velocity = values(11:13)
   end subroutine set_numbers

   !> A block material of which nothing is given yet: of options, each of which changes only what it names.
   pure function unset_block_material() result(material)
      type(block_material_type) :: material
      call material%set_numbers(spread(unset_real, 1, 13))
   end function unset_block_material

   !> A joint material of which nothing is given yet: of options, each of which changes only what it names.
   pure function unset_joint_material() result(material)
      type(joint_material_type) :: material
      material%friction_angle = unset_real
      material%cohesion = unset_real
      material%tension = unset_real
      material%normal_stiffness = unset_real
      material%shear_stiffness = unset_real
      material%dilation = unset_real
      material%damping_ratio = unset_real
   end function unset_joint_material

end module rockdda_model_analysis_input
