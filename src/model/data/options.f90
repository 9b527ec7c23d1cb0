! SPDX-License-Identifier: MIT
!> What the user chose for a run beyond the two legacy files: the namelist file and the command line.
!>
!> `unset` (a NaN-free sentinel for reals, -1 for integers, '' for text) means: not given, take the legacy
!> file's value or the program's default. `resolve_parameters` (module rockdda_model_resolve) turns
!> input plus options into the numbers of the run.
module rockdda_model_options
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : origin_type
   use rockdda_model_geometry_input, only : bolt_type
   use rockdda_model_analysis_input, only : block_material_type, joint_material_type, unset_real
   implicit none
   private
   public :: run_options_type, stage_type, change_type, line_load_type, base_motion_type, region_type, &
             subdivision_type, point_table_type, boundary_type, in_situ_type, water_type, quake_type, bolt_type, &
             liner_type
   public :: unset_real, unset_integer, is_set, dda_windows, old_dda_windows, most_threads

   !> The preset and the dialect of DDA for Windows, and how both were spelled at first (still accepted).
   character(len=*), parameter :: dda_windows = 'dda_windows', old_dda_windows = 'peer'

   !> Largest number of threads: a larger one is a slip, which the operating system might refuse in the midst of a run.
   integer, parameter :: most_threads = 1024

   !> Sentinel of an integer option that was not given.
   integer, parameter :: unset_integer = -huge(1)

   interface is_set
      module procedure real_is_set
      module procedure integer_is_set
   end interface is_set

   !> A part of the run: what happens at its start, its own k01 and gravity factor, and its end.
   type :: stage_type
      character(len=:), allocatable :: name      !! not given: 'stage N'
      character(len=:), allocatable :: kind      !! 'static' | 'dynamic', instead of k01
      character(len=:), allocatable :: until     !! 'equilibrium'
      real(wp) :: tolerance = 1.0e-5_wp          !! of `unbalanced`
      integer :: max_steps = 5000                !! to come to equilibrium, from the start of the stage
      character(len=:), allocatable :: on_failure   !! 'stop' | 'continue' without equilibrium
      real(wp) :: duration = unset_real          !! time from the start of the stage
      integer :: until_step = unset_integer      !! last step of the stage
      real(wp) :: until_time = unset_real        !! or its end time (the step is shortened to land on it)
      real(wp) :: k01 = unset_real               !! unset: as before
      real(wp) :: gravity = 1                    !! factor on all block weights
      integer, allocatable :: release(:)         !! fixed points (numbers from 1) released when the stage ends
      logical :: reset_displacement = .false.    !! measured displacements count from its start
      character(len=:), allocatable :: excavate  !! regions, commas between them
      real(wp) :: relax = unset_real             !! share of the forces of excavated blocks that is released
      integer :: relax_steps = 10                !! number of steps for it
      character(len=:), allocatable :: place     !! regions that are absent until the stage begins
      character(len=:), allocatable :: install, remove   !! names of bolts and linings
      character(len=:), allocatable :: water     !! groups of &water that act from the stage on
      type(origin_type) :: origin                !! where it was read
   end type stage_type

   !> New values of a material from a stage on; or a material, or values, for the blocks of a region.
   type :: change_type
      character(len=:), allocatable :: stage
      character(len=:), allocatable :: joint_material   !! number or name
      character(len=:), allocatable :: block_material   !! number or name
      character(len=:), allocatable :: region           !! names, commas between them
      character(len=:), allocatable :: liner            !! name
      type(joint_material_type) :: joint                !! new values of a joint material
      !> of a block material: density, Young's modulus, Poisson's ratio, weight per area
      real(wp) :: density = unset_real, young = unset_real, poisson = unset_real, unit_weight = unset_real
      type(origin_type) :: origin                       !! where it was read
   end type change_type

   !> A lining along a line, or a layer of one.
   type :: liner_type
      character(len=:), allocatable :: name
      real(wp), allocatable :: along(:)          !! x y of the points of its line [length]
      character(len=:), allocatable :: outline   !! region whose outer line it follows
      character(len=:), allocatable :: on        !! the lining on which this layer lies
      real(wp) :: thickness = unset_real         !! [length]
      real(wp) :: young = unset_real, poisson = unset_real
      real(wp) :: density = unset_real           !! [mass/length^2]
      real(wp) :: compressive_strength = unset_real, tensile_strength = unset_real
      character(len=:), allocatable :: joint_material   !! between rock and lining: number or name
      real(wp) :: element = unset_real           !! largest distance of nodes [length]
      type(origin_type) :: origin                !! where it was read
   end type liner_type

   !> Force per length along a line of block edges, linear between the ends, times a factor of time.
   type :: line_load_type
      real(wp) :: ends(4) = 0                    !! x1 y1 x2 y2 at the start; on one block's edge
      real(wp) :: force_start(2) = 0             !! force per length at (x1, y1)
      real(wp) :: force_end(2) = 0               !! force per length at (x2, y2)
      real(wp), allocatable :: table(:, :)       !! (2, m) t, factor; absent or m = 0: factor 1
      character(len=:), allocatable :: name      !! empty or not given: none
      type(origin_type) :: origin                !! where it was read
   end type line_load_type

   !> Base acceleration: a table and/or harmonic terms; acts as load -m a.
   type :: base_motion_type
      real(wp), allocatable :: table(:, :)       !! (3, m) t ax ay, linear in between, zero beyond the ends
      character(len=:), allocatable :: file      !! of the table, as the options name it
      !> (5, m) amplitudes ax ay, frequency f [1/time], phase [rad], start t0: a = A sin(2 pi f (t - t0) + phase)
      real(wp), allocatable :: harmonics(:, :)
      character(len=:), allocatable :: stage     !! name of the stage with which it begins; empty: time 0 of the run
      type(origin_type) :: stage_origin, harmonics_origin   !! where they were read
   end type base_motion_type

   !> Blocks whose centroid at the start lies in boxes, circles or a polygon, or that are of a material. One of these in
   !> each group; groups of one name add up.
   type :: region_type
      character(len=:), allocatable :: name
      real(wp), allocatable :: boxes(:, :)       !! (4, m) xmin ymin xmax ymax
      real(wp), allocatable :: circles(:, :)     !! (3, m) x y r
      real(wp), allocatable :: polygon(:, :)     !! (2, m) x y
      character(len=:), allocatable :: material  !! block materials, commas between them
      character(len=:), allocatable :: outline   !! names of regions before it, commas between them: a ring around them
      real(wp) :: width = unset_real             !! of the ring [length]
      type(origin_type) :: origin                !! where it was read
   end type region_type

   !> Blocks that are cut into cells.
   type :: subdivision_type
      character(len=:), allocatable :: region    !! names, commas between them; not given: all blocks
      real(wp) :: size = unset_real              !! of the cells [length]
      character(len=:), allocatable :: kind      !! 'rectangles' | 'triangles'
      character(len=:), allocatable :: joint_material   !! between the cells of a block: number or name
      type(origin_type) :: origin                !! where it was read
   end type subdivision_type

   !> Time table of fixed or loading points.
   type :: point_table_type
      character(len=:), allocatable :: name      !! of the load; empty or not given: none
      integer, allocatable :: points(:)          !! numbers from 1; not given: all
      real(wp), allocatable :: at(:, :)          !! (2, m) x y of loading points that the geometry does not have
      real(wp), allocatable :: rows(:, :)        !! (3, m) t x y
      type(origin_type) :: origin                !! where it was read
   end type point_table_type

   !> Outer edges of blocks along a polyline: how they are held, moved or loaded.
   type :: boundary_type
      character(len=:), allocatable :: name      !! of the load; empty or not given: none
      real(wp), allocatable :: along(:, :)       !! (2, m) x y
      character(len=:), allocatable :: kind      !! fixed, roller, moving or traction
      real(wp), allocatable :: velocity(:, :)    !! (2, 1) vx vy, of kind moving
      real(wp), allocatable :: stress(:, :)      !! (3, 1) s11 s22 s12, of kind traction
      real(wp), allocatable :: traction(:, :)    !! (2, 1) tx ty, of kind traction
      real(wp) :: pressure = unset_real          !! positive into the block, of kind traction
      real(wp), allocatable :: table(:, :)       !! (2, m) t, factor; absent or m = 0: factor 1
      type(origin_type) :: origin                !! where it was read
   end type boundary_type

   !> Stress in the ground: by the weight above under a surface, or given.
   type :: in_situ_type
      real(wp) :: surface = unset_real           !! its y
      real(wp), allocatable :: profile(:, :)     !! (2, m) x y of the surface, x increasing
      real(wp) :: k0 = unset_real                !! horizontal over vertical stress
      real(wp) :: unit_weight = unset_real       !! unset: of the blocks
      real(wp) :: surcharge = unset_real         !! pressure on the surface
      real(wp), allocatable :: stress(:, :)      !! (3, 1) s11 s22 s12 at y = 0
      real(wp), allocatable :: gradient(:, :)    !! (3, 1) its change with y
      character(len=:), allocatable :: region    !! names, commas between them; not given: all blocks
      type(origin_type) :: origin                !! where it was read
   end type in_situ_type

   !> Water in joints and on free edges: its pressure by a table, or at points.
   type :: water_type
      character(len=:), allocatable :: name      !! empty or not given: none
      real(wp), allocatable :: table(:, :)       !! (2, m) x y, x increasing
      character(len=:), allocatable :: file      !! of the pressure, as the options name it
      real(wp), allocatable :: pressure(:, :)    !! (3, m) x y p
      real(wp) :: unit_weight = unset_real       !! of the water
      character(len=:), allocatable :: joints    !! joint materials, commas between them; not given: all
      logical :: surfaces = .true.               !! edges that face no other block are wetted, too
      character(len=:), allocatable :: region    !! names, commas between them; not given: all blocks
      real(wp), allocatable :: level(:, :)       !! (2, m) t dy: rise of the table
      type(origin_type) :: origin                !! where it was read
   end type water_type

   !> A record of ground acceleration, and what it moves.
   type :: quake_type
      character(len=:), allocatable :: file      !! of the record, as the options name it
      character(len=:), allocatable :: form      !! 'csv' | 'at2'
      character(len=:), allocatable :: column    !! of a csv file: name or number; not given: the second
      real(wp) :: scale = unset_real             !! factor of the values; unset: their unit, 1 where it is not named
      real(wp) :: unit = 0                       !! of the values, as the file names it [m/s^2]; 0: not named
      character(len=:), allocatable :: direction !! 'x' | 'y'
      character(len=:), allocatable :: apply     !! 'base_acceleration' | 'base_motion' | 'viscous_base'
      real(wp), allocatable :: rows(:, :)        !! (2, m) t and values as they stand in the file
      type(origin_type) :: origin                !! where it was read
   end type quake_type

   type :: run_options_type
      ! &model: a labelled file, which names its geometry and describes the materials
      logical :: labelled = .false.
      type(origin_type) :: model_origin
      type(origin_type) :: geometry_origin, analysis_origin   !! where they were read
      character(len=:), allocatable :: geometry   !! path of the geometry or block file, relative to that of the options
      character(len=:), allocatable :: analysis   !! path of an analysis file; empty or not allocated: none
      character(len=:), allocatable :: model_title
      character(len=:), allocatable :: units      !! 'si' | 'kn' | 'mm' | 'none'; not given: SI in a labelled file
      type(block_material_type), allocatable :: block_materials(:) !! groups that describe or change block materials
      type(point_table_type), allocatable :: fixed_points(:), loading_points(:)
      ! &run
      character(len=:), allocatable :: title
      integer :: steps = unset_integer
      real(wp) :: t_end = unset_real
      type(origin_type) :: t_end_origin, strict_origin   !! where they were read
      integer :: save_every = unset_integer       !! steps from one frame to the next
      real(wp) :: save_dt = unset_real            !! and/or a frame every so much time
      integer :: threads = unset_integer
      real(wp) :: max_wall = unset_real           !! [s]
      real(wp) :: checkpoint_every = unset_real   !! [s], default 60
      logical :: allow_open = .false.             !! an outline that does not close is a warning
      logical :: strict = .false.                 !! an answer that is not to be trusted ends the run
      ! &time
      real(wp) :: dt_max = unset_real, dt_min = unset_real, k01 = unset_real, displacement_ratio = unset_real
      type(origin_type) :: dt_max_origin, dt_min_origin, ratio_origin   !! where they, displacement_ratio were read
      type(origin_type) :: sleep_origin, sleep_tolerance_origin         !! where they were read
      character(len=:), allocatable :: length_scale  !! 'height' | 'largest'
      character(len=:), allocatable :: rotation      !! 'exact' | 'linear'
      real(wp) :: cut_factor = unset_real
      integer :: max_open_close = unset_integer
      real(wp) :: max_growth = unset_real             !! of static steps over dt_max
      character(len=:), allocatable :: integrator     !! 'shi' | 'generalized_alpha'
      real(wp) :: rho_infinity = unset_real
      character(len=:), allocatable :: sleep          !! 'off' | 'on'
      real(wp) :: sleep_tolerance = unset_real
      ! &contact
      real(wp) :: stiffness = unset_real, shear_ratio = unset_real, search_factor = unset_real
      real(wp) :: sliding_damping = unset_real
      real(wp) :: angle_tolerance = unset_real        !! [deg]
      real(wp) :: close_tolerance = unset_real        !! penetration that closes a contact, over w0
      real(wp) :: open_tolerance = unset_real         !! gap that opens one, over w0
      real(wp) :: fixed_stiffness_factor = unset_real
      character(len=:), allocatable :: preset         !! '' | dda_windows
      character(len=:), allocatable :: formulation    !! 'length' | 'vertex'
      integer :: points = unset_integer               !! contact points of an interval
      real(wp) :: corner_radius = unset_real          !! over the shorter edge
      type(origin_type) :: formulation_origin, points_origin, corner_radius_origin, stiffness_origin   !! likewise
      ! &solver
      character(len=:), allocatable :: method         !! auto|sor|pcg|cholmod|dense
      real(wp) :: tolerance = unset_real, omega = unset_real
      character(len=:), allocatable :: preconditioner !! block_jacobi|ssor|block_ic0
      ! &material
      character(len=:), allocatable :: plane          !! 'stress' | 'strain'
      character(len=:), allocatable :: mass           !! 'initial' | 'area'
      ! &load
      real(wp) :: gravity = unset_real                !! acceleration in -y, instead of the file's weight
      type(base_motion_type) :: base
      type(line_load_type), allocatable :: line_loads(:)
      type(joint_material_type), allocatable :: joint_materials(:) !! groups that change or add joint materials
      type(joint_material_type), allocatable :: joint_laws(:)      !! the same for materials of the analysis file
      real(wp) :: mass_damping = unset_real           !! &block_damping mass_proportional [1/time]
      type(origin_type) :: gravity_origin, mass_damping_origin          !! where they were read
      type(stage_type), allocatable :: stages(:)
      type(change_type), allocatable :: changes(:)
      type(region_type), allocatable :: regions(:)
      type(subdivision_type), allocatable :: subdivisions(:)
      type(boundary_type), allocatable :: boundaries(:)
      type(in_situ_type), allocatable :: in_situ(:)
      type(water_type), allocatable :: water(:)
      type(quake_type), allocatable :: quakes(:)
      type(bolt_type), allocatable :: bolts(:)
      type(liner_type), allocatable :: liners(:)
      ! &output
      character(len=:), allocatable :: output_file
      logical :: write_frames = .true.
      logical :: write_contacts = .true.
      character(len=:), allocatable :: precision      !! 'double' | 'single': of frames
      logical :: energy = .true.                      !! compute and write the energy balance
   end type run_options_type

contains

   !> Was this real given?
   elemental logical function real_is_set(value)
      real(wp), intent(in) :: value
      real_is_set = value > 0.5_wp*unset_real
   end function real_is_set

   !> Was this integer given?
   elemental logical function integer_is_set(value)
      integer, intent(in) :: value
      integer_is_set = value > unset_integer
   end function integer_is_set

end module rockdda_model_options
