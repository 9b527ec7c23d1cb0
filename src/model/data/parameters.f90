! SPDX-License-Identifier: MIT
!> The numbers of one run. rockdda_model_resolve makes them from the analysis file, the options and the model's size;
!> nothing changes them during the run.
module rockdda_model_parameters
   use rockdda_base_kinds, only : wp
   use rockdda_model_analysis_input, only : block_material_type, joint_material_type, time_table_type
   use rockdda_model_options, only : stage_type, change_type, line_load_type, base_motion_type, region_type, &
      subdivision_type, boundary_type, in_situ_type, water_type, quake_type, bolt_type, liner_type
   use rockdda_model_units, only : unit_system_type, unit_system
   implicit none
   private
   public :: parameters_type

   type :: parameters_type
      character(len=:), allocatable :: title
      character(len=4) :: units = 'none'      !! system of units of all numbers (rockdda_model_units)
      ! extent of the run
      integer :: n_steps = 0
      real(wp) :: t_end = huge(1.0_wp)
      ! time stepping (DESIGN: theory manual, "time integration")
      real(wp) :: k01 = 1                     !! share of the velocity carried into the next step
      real(wp) :: dt_max = 0, dt_min = 0      !! [time]
      real(wp) :: cut_factor = 0.3_wp         !! step is multiplied by this when cut
      integer :: max_open_close = 20          !! rounds per attempt
      real(wp) :: max_growth = 1000           !! of static steps that search equilibrium, over dt_max
      real(wp) :: displacement_ratio = 0      !! g2
      real(wp) :: w0 = 0                      !! half the model's height or larger extent [length]
      logical :: sleeps = .false.             !! blocks at rest are left out of dynamic steps
      real(wp) :: sleep_tolerance = 1.0e-3_wp !! forces that still act on them, over the sum of their magnitudes
      logical :: exact_rotation = .true.
      logical :: second_order = .false.       !! dynamic steps by the generalised-alpha scheme, not Shi's
      real(wp) :: rho_infinity = 0.8_wp       !! its spectral radius at high frequencies
      ! contacts
      logical :: windows_contacts = .false.      !! closing rule and tolerances of DDA for Windows
      logical :: by_length = .false.          !! formulation 'length': joints are intervals of edges
      real(wp) :: corner_radius = 0.01_wp     !! rounding of corners over the shorter edge
      real(wp) :: normal_stiffness = 0        !! [force/length]
      real(wp) :: shear_stiffness = 0         !! [force/length]
      real(wp) :: fixed_stiffness = 0         !! [force/length]
      real(wp) :: sliding_damping = 0         !! ratio of contacts that slide, of joints without damping
      real(wp) :: search_distance = 0         !! [length]
      real(wp) :: angle_tolerance = 0         !! [rad]
      real(wp) :: close_tolerance = 0         !! an open contact closes beyond this penetration [length]
      real(wp) :: open_tolerance = 0          !! a closed contact opens beyond this gap [length]
      real(wp) :: smooth_step = 0             !! steps of a surface up to this do not stop a block that slides [length]
      real(wp) :: stiffness_length = 1        !! of joint that has the stiffness above; 0: by blocks [length]
      real(wp) :: stiffening = 1              !! of joints whose stiffness follows from their blocks
      logical :: closed_part_slips = .true.   !! in static steps joints resist slip by what is closed (`slipping_share`)
      ! materials
      logical :: plane_strain = .false.
      logical :: mass_from_area = .false.
      type(block_material_type), allocatable :: block_materials(:)
      type(joint_material_type), allocatable :: joint_materials(:)
      real(wp) :: mass_damping = 0            !! [1/time]
      ! loads
      real(wp) :: gravity = -1                !! acceleration in -y, < 0: from weight/density of each material
      real(wp) :: given_gravity = -1          !! also where materials have weights of their own; < 0: not given
      real(wp) :: weight_direction(2) = [0.0_wp, -1.0_wp]   !! of all weights; its length multiplies them
      type(base_motion_type) :: base
      type(line_load_type), allocatable :: line_loads(:)
      type(time_table_type), allocatable :: fixed_tables(:), loading_tables(:)
      type(stage_type), allocatable :: stages(:)
      type(change_type), allocatable :: changes(:)  !! that begin with a stage
      logical :: ends_with_stages = .false.   !! the end of the last stage is the end of the run
      ! blocks: the model holds the cells already
      type(region_type), allocatable :: regions(:)
      type(subdivision_type), allocatable :: subdivisions(:)
      ! the ground around the blocks, and the stress in them
      type(boundary_type), allocatable :: boundaries(:)
      type(in_situ_type), allocatable :: in_situ(:)
      type(water_type), allocatable :: water(:)
      type(quake_type), allocatable :: quakes(:)
      type(bolt_type), allocatable :: bolts(:)    !! of the options: the model holds them already
      type(liner_type), allocatable :: liners(:)
      integer :: first_liner_material = 0         !! of blocks: those of the linings follow; 0: not yet there
      ! solver
      character(len=:), allocatable :: solver_method !! empty: default of the build
      character(len=:), allocatable :: preconditioner
      real(wp) :: solver_tolerance = 1.0e-10_wp !! residual over load norm
      real(wp) :: sor_factor = 1.4_wp
      ! output
      logical :: energy = .true.              !! compute and write the energy balance
      logical :: single_frames = .false.      !! reals of frames, but places and times, of 32 bits
   contains
      procedure :: has_legacy_rules
      procedure :: acceleration_of_gravity
      procedure :: shown
   end type parameters_type

contains

   !> Contacts of vertices on edges as the program has them for which a preset stands: they begin without the initial
   !> stress and with the force of the depth at which they are found, and strike what is covered. Without a preset
   !> these ways are corrected.
   pure logical function has_legacy_rules(self)
      class(parameters_type), intent(in) :: self
      has_legacy_rules = self%windows_contacts .and. .not. self%by_length
   end function has_legacy_rules

   !> Acceleration of gravity [length/time^2]: as given, or the largest weight over density of a material.
   pure real(wp) function acceleration_of_gravity(self) result(g)
      class(parameters_type), intent(in) :: self
      integer :: k
      g = max(0.0_wp, self%given_gravity)
      if (self%given_gravity >= 0 .or. .not. allocated(self%block_materials)) return
      do k = 1, size(self%block_materials)
         associate (m => self%block_materials(k))
            if (m%density > 0) g = max(g, abs(m%weight)/m%density)
         end associate
      end do
   end function acceleration_of_gravity

   !> A value as it is shown in the units of the run, '5.3 mm'; the number alone where they are not known.
   pure function shown(self, value, dimension, digits) result(text)
      class(parameters_type), intent(in) :: self
      real(wp), intent(in) :: value
      character(len=*), intent(in) :: dimension      !! as in rockdda_model_units
      integer, intent(in), optional :: digits        !! default 4
      character(len=:), allocatable :: text
      type(unit_system_type) :: system
      system = unit_system(self%units)
      text = system%shown(value, dimension, digits)
   end function shown

end module rockdda_model_parameters
