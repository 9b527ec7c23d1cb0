! SPDX-License-Identifier: MIT
!> The numbers of one run, resolved from the analysis file, the options and the model's size.
!> Immutable while the run goes on.
module rockdda_model_parameters
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_base_strings, only : to_string
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_analysis_input, only : analysis_input_type, block_material_type, joint_material_type, &
      time_table_type, dialect
   use rockdda_model_options, only : run_options_type, stage_type, line_load_type, joint_law_type, &
      base_motion_type, is_set
   use rockdda_model_contact_numbers, only : automatic_over_e, far_over_e, mean_edge, advised_ratio, stiffness_advice
   implicit none
   private
   public :: parameters_type, resolve_parameters

   type :: parameters_type
      character(len=:), allocatable :: title
      ! extent of the run
      integer :: n_steps = 0
      real(wp) :: t_end = huge(1.0_wp)
      ! time stepping (DESIGN: theory manual, "time integration")
      real(wp) :: k01 = 1                     !! share of the velocity carried into the next step
      real(wp) :: dt_max = 0, dt_min = 0      !! [time]
      real(wp) :: cut_factor = 0.3_wp         !! step is multiplied by this when cut
      integer :: max_open_close = 20          !! rounds per attempt
      real(wp) :: displacement_ratio = 0      !! g2
      real(wp) :: w0 = 0                      !! half the model's height or larger extent [length]
      logical :: exact_rotation = .true.
      ! contacts
      logical :: peer_contacts = .false.      !! the peer's tolerances
      real(wp) :: normal_stiffness = 0        !! [force/length]
      real(wp) :: shear_stiffness = 0         !! [force/length]
      real(wp) :: fixed_stiffness = 0         !! [force/length]
      real(wp) :: search_distance = 0         !! [length]
      real(wp) :: angle_tolerance = 0         !! [rad]
      real(wp) :: close_tolerance = 0         !! an open contact closes beyond this penetration [length]
      real(wp) :: open_tolerance = 0          !! a closed contact opens beyond this gap [length]
      ! materials
      logical :: plane_strain = .false.
      logical :: mass_from_area = .false.
      type(block_material_type), allocatable :: block_materials(:)
      type(joint_material_type), allocatable :: joint_materials(:)
      type(joint_law_type), allocatable :: joint_laws(:)
      real(wp) :: mass_damping = 0            !! [1/time]
      ! loads
      real(wp) :: gravity = -1                !! acceleration in -y, < 0: from weight/density of each material
      type(base_motion_type) :: base
      type(line_load_type), allocatable :: line_loads(:)
      type(time_table_type), allocatable :: fixed_tables(:), loading_tables(:)
      type(stage_type), allocatable :: stages(:)
      ! solver
      character(len=:), allocatable :: solver_method !! empty: default of the build
      character(len=:), allocatable :: preconditioner
      real(wp) :: solver_tolerance = 1.0e-10_wp !! residual over load norm
      real(wp) :: sor_factor = 1.4_wp
   end type parameters_type

contains

   !> Turn what the files and the user said into the numbers of a run.
   !> Options win over the analysis file, which wins over the defaults; each override is a note in `messages`.
   subroutine resolve_parameters(blocks, analysis, options, parameters, messages)
      type(block_system_type), intent(in) :: blocks
      type(analysis_input_type), intent(in) :: analysis
      type(run_options_type), intent(in) :: options
      type(parameters_type), intent(out) :: parameters
      type(diagnostics_type), intent(inout) :: messages !! notes and errors are appended
      logical :: peer_dialect, by_height
      real(wp) :: extent(2), e_max, edge
      integer :: i

      peer_dialect = analysis%dialect == dialect%peer
      parameters%title = text_or(options%title, '')
      parameters%n_steps = analysis%n_steps
      if (is_set(options%steps)) then
         call note_override('number of steps', real(analysis%n_steps, wp), real(options%steps, wp))
         parameters%n_steps = options%steps
      end if
      if (is_set(options%t_end)) then
         parameters%t_end = options%t_end
         ! with only an end time given, the analysis file's number of steps is not a limit
         if (.not. is_set(options%steps)) then
            parameters%n_steps = huge(1)
            call messages%add(severity%note, 'end time '//to_string(options%t_end)//' replaces the number of steps '// &
                              to_string(analysis%n_steps)//' of the analysis file')
         end if
      end if

      parameters%k01 = analysis%k01
      call override('k01', options%k01, parameters%k01)
      parameters%dt_max = analysis%dt_max
      call override('largest time step (g1)', options%dt_max, parameters%dt_max)
      parameters%dt_min = 1.0e-3_wp*parameters%dt_max
      if (peer_dialect) parameters%dt_min = 1.0e-2_wp*parameters%dt_max
      if (is_set(options%dt_min)) parameters%dt_min = options%dt_min
      if (parameters%dt_min > parameters%dt_max) call messages%add(severity%error, 'dt_min = '// &
         to_string(parameters%dt_min)//' is larger than the largest time step '//to_string(parameters%dt_max), &
         options%dt_min_origin)
      parameters%displacement_ratio = analysis%displacement_ratio
      call override('displacement ratio (g2)', options%displacement_ratio, parameters%displacement_ratio)
      if (is_set(options%cut_factor)) parameters%cut_factor = options%cut_factor

      parameters%peer_contacts = text_or(options%preset, '') == 'peer'
      if (parameters%peer_contacts) parameters%max_open_close = 8
      if (is_set(options%max_open_close)) parameters%max_open_close = options%max_open_close
      parameters%exact_rotation = text_or(options%rotation, 'exact') /= 'linear'

      by_height = .not. peer_dialect
      if (allocated(options%length_scale)) then
         if (len(options%length_scale) > 0) by_height = options%length_scale /= 'largest'
      end if
      extent = 0
      if (blocks%n_vertices() > 0) extent = maxval(blocks%vertices, dim=2) - minval(blocks%vertices, dim=2)
      parameters%w0 = 0.5_wp*merge(extent(2), maxval(extent), by_height)

      e_max = 0
      do i = 1, size(analysis%block_materials)
         e_max = max(e_max, analysis%block_materials(i)%youngs_modulus)
      end do
      parameters%normal_stiffness = analysis%stiffness
      call override('contact stiffness (g0)', options%stiffness, parameters%normal_stiffness)
      if (parameters%normal_stiffness <= 0) then
         parameters%normal_stiffness = automatic_over_e*e_max
         call messages%add(severity%note, 'contact stiffness (g0) is automatic: the largest E = '// &
                           to_string(parameters%normal_stiffness)//', constant in the run')
      else if (parameters%normal_stiffness > far_over_e*e_max) then
         call messages%add(severity%warning, 'the contact stiffness (g0) is '// &
                           to_string(parameters%normal_stiffness/e_max)//' times the largest E: '//stiffness_advice())
      end if
      parameters%shear_stiffness = parameters%normal_stiffness/real_or(options%shear_ratio, 2.5_wp)
      parameters%fixed_stiffness = parameters%normal_stiffness*real_or(options%fixed_stiffness_factor, 100.0_wp)
      ! a step that moves blocks further than this searches again; to begin with, blocks further away than their
      ! neighbours' neighbours are no candidates
      parameters%search_distance = min(real_or(options%search_factor, 2.5_wp)*parameters%displacement_ratio* &
                                       parameters%w0, 2*mean_diameter(blocks))
      edge = mean_edge(blocks)
      if (parameters%displacement_ratio*parameters%w0 > edge .and. edge > 0) call messages%add(severity%warning, &
         'the displacement ratio (g2) lets a block move by '// &
         to_string(parameters%displacement_ratio*parameters%w0)//' in a step, more than the mean length of edges, '// &
         to_string(edge)//': g2 = '//to_string(advised_ratio(edge, parameters%w0))//' is advised')
      parameters%angle_tolerance = real_or(options%angle_tolerance, 3.0_wp)*acos(-1.0_wp)/180
      parameters%close_tolerance = merge(2.0e-4_wp, 1.0e-12_wp, parameters%peer_contacts)
      parameters%open_tolerance = merge(2.0e-7_wp, 1.0e-12_wp, parameters%peer_contacts)
      parameters%close_tolerance = real_or(options%close_tolerance, parameters%close_tolerance)*parameters%w0
      parameters%open_tolerance = real_or(options%open_tolerance, parameters%open_tolerance)*parameters%w0

      parameters%plane_strain = text_or(options%plane, 'stress') == 'strain'
      parameters%mass_from_area = text_or(options%mass, 'initial') == 'area'
      parameters%block_materials = analysis%block_materials
      parameters%joint_materials = analysis%joint_materials
      allocate (parameters%joint_laws(0), parameters%line_loads(0), parameters%stages(0))
      if (allocated(options%joint_laws)) parameters%joint_laws = options%joint_laws
      if (allocated(options%line_loads)) parameters%line_loads = options%line_loads
      if (allocated(options%stages)) parameters%stages = options%stages
      if (is_set(options%mass_damping)) parameters%mass_damping = options%mass_damping
      if (is_set(options%gravity)) then
         parameters%gravity = options%gravity
         call messages%add(severity%note, 'gravity '//to_string(options%gravity)// &
                           ' replaces weight over density of the analysis file')
      end if
      parameters%base = options%base
      allocate (parameters%fixed_tables(blocks%fixed%n), parameters%loading_tables(blocks%loading%n))
      if (allocated(analysis%fixed_tables)) then
         if (size(analysis%fixed_tables) == blocks%fixed%n) parameters%fixed_tables = analysis%fixed_tables
      end if
      if (allocated(analysis%loading_tables)) then
         if (size(analysis%loading_tables) == blocks%loading%n) parameters%loading_tables = analysis%loading_tables
      end if

      parameters%solver_method = text_or(options%method, '')
      parameters%preconditioner = text_or(options%preconditioner, '')
      parameters%solver_tolerance = real_or(options%tolerance, 1.0e-10_wp)
      parameters%sor_factor = analysis%sor_factor
      call override('SOR factor', options%omega, parameters%sor_factor)

   contains

      !> Take an option over the file's value and say so.
      subroutine override(name, option, value)
         character(len=*), intent(in) :: name
         real(wp), intent(in) :: option
         real(wp), intent(inout) :: value
         if (.not. is_set(option)) return
         call note_override(name, value, option)
         value = option
      end subroutine override

      !> Say that an option replaces a value of the file, if it differs.
      subroutine note_override(name, old, new)
         character(len=*), intent(in) :: name
         real(wp), intent(in) :: old, new
         if (abs(old - new) > 0) call messages%add(severity%note, name//' '//to_string(new)// &
                                                   ' replaces '//to_string(old)//' of the analysis file')
      end subroutine note_override

   end subroutine resolve_parameters

   !> Mean diagonal of the blocks' bounding boxes at the start.
   pure real(wp) function mean_diameter(blocks)
      type(block_system_type), intent(in) :: blocks
      integer :: i
      mean_diameter = 0
      do i = 1, blocks%n_blocks
         associate (v => blocks%vertices(:, blocks%vertex_offset(i) + 1:blocks%vertex_offset(i + 1)))
            mean_diameter = mean_diameter + norm2(maxval(v, dim=2) - minval(v, dim=2))
         end associate
      end do
      mean_diameter = mean_diameter/max(1, blocks%n_blocks)
   end function mean_diameter

   !> The option's text, or a default when it was not given.
   pure function text_or(option, default) result(text)
      character(len=:), allocatable, intent(in) :: option
      character(len=*), intent(in) :: default
      character(len=:), allocatable :: text
      text = default
      if (allocated(option)) then
         if (len_trim(option) > 0) text = trim(option)
      end if
   end function text_or

   !> The option's value, or a default when it was not given.
   pure real(wp) function real_or(option, default)
      real(wp), intent(in) :: option, default
      real_or = default
      if (is_set(option)) real_or = option
   end function real_or

end module rockdda_model_parameters
