! SPDX-License-Identifier: MIT
!> Options that do not fit the model: reported before a run begins, each where it was read.
!> Also how many blocks stages excavate and place, and what goes and comes with them (points, loads, bolts, boundaries).
!> And parameters with which no run can start, wherever they come from: an analysis file, options or Python.
module rockdda_check_options
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : to_string, counted
   use rockdda_base_diagnostics, only : diagnostics_type, severity, origin_type
   use rockdda_model_analysis_input, only : joint_material_type
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_ground_options, only : is_quiet
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_stage_options, only : stage_name, seeks_equilibrium, is_given, has_base_motion, stage_number, &
      stage_k01
   use rockdda_model_in_situ, only : initial_stress_type, find_initial_stress, check_in_situ, check_in_situ_blocks
   use rockdda_model_water_check, only : check_water
   use rockdda_model_regions, only : blocks_of_region
   use rockdda_model_options, only : is_set
   use rockdda_interaction_joint_strength, only : joint_law_type, new_joint_laws
   use rockdda_interaction_loads, only : loads_type, find_carriers
   use rockdda_interaction_boundaries, only : boundaries_type
   use rockdda_interaction_water, only : water_family_type
   use rockdda_interaction_boundary_edges, only : find_outer_edges, edges_along
   use rockdda_check_tables, only : warn_of_tables, check_motion
   use rockdda_check_boundaries, only : check_boundaries
   implicit none
   private
   public :: check_start, check_options, check_joints, check_parameters

   !> Young's modulus [force/length^2]: the inverse of the largest number that files may hold.
   real(wp), parameter :: smallest_modulus = 1.0e-60_wp

   !> Text behind the number of things.
   character(len=*), parameter :: goes_along = 'on excavated blocks, without effect from then on', &
      comes_along = 'on placed blocks, with effect from then on', &
      bolt_goes = 'with an end in excavated blocks: their force is released with the excavation', &
      bolt_comes = 'with an end in placed blocks, with their pretension from then on'

contains

   !> With what no run can start: joint laws, numbers, points that stages release, line loads, boundaries, stress in the
   !> ground. What a run makes of them is dropped here.
   subroutine check_start(blocks, parameters, messages)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(diagnostics_type), intent(inout) :: messages
      type(joint_law_type), allocatable :: laws(:)
      type(loads_type) :: loads
      real(wp), allocatable :: line_ends(:, :)
      call new_joint_laws(parameters%joint_materials, laws, messages)
      call check_parameters(parameters, messages)
      call check_releases(blocks%fixed%n)
      call loads%init(blocks, parameters, line_ends, messages)
      call check_ground()

   contains

      !> Report what is wrong in the groups, boundaries without an edge, and water that wets nothing.
      subroutine check_ground()
         type(boundaries_type) :: boundaries
         type(water_family_type) :: water
         type(initial_stress_type) :: field
         integer :: before
         call check_motion(parameters, messages)
         before = messages%n_errors
         if (allocated(parameters%in_situ)) call check_in_situ(parameters%in_situ, messages)
         if (allocated(parameters%boundaries)) call check_boundaries(parameters%boundaries, messages)
         if (allocated(parameters%water)) call check_water(parameters%water, messages)
         if (messages%n_errors > before) return
         if (allocated(parameters%in_situ)) call check_in_situ_blocks(blocks, parameters, messages)
         call find_initial_stress(blocks, parameters, field)
         call boundaries%init(blocks, parameters, field, spread(.true., 1, blocks%n_blocks), messages)
         call water%init(blocks, parameters, messages)
      end subroutine check_ground

      !> Stages may release only fixed points that exist.
      subroutine check_releases(n_fixed)
         integer, intent(in) :: n_fixed
         integer :: i, p
         do i = 1, size(parameters%stages)
            if (.not. allocated(parameters%stages(i)%release)) cycle
            do p = 1, size(parameters%stages(i)%release)
               if (parameters%stages(i)%release(p) < 1 .or. parameters%stages(i)%release(p) > n_fixed) then
                  call messages%add(severity%error, 'stage '//to_string(i)//' releases fixed point '// &
                                    to_string(parameters%stages(i)%release(p))//', but the model has '// &
                                    to_string(n_fixed), parameters%stages(i)%origin)
               end if
            end do
         end do
      end subroutine check_releases

   end subroutine check_start

   !> The same before the run begins, with warnings.
   subroutine check_options(blocks, parameters, messages)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(diagnostics_type), intent(inout) :: messages
      call check_start(blocks, parameters, messages)
      call warn_of_time()
      call warn_of_weight()
      call warn_of_velocity()
      call warn_of_supports()
      call warn_of_tables(parameters, messages)
      if (.not. messages%has_errors()) call report_stage_effects(blocks, parameters, messages)

   contains

      !> Warn of supports that are soft beside joints which stiffen: they are springs of a multiple of the stiffness
      !> that these begin with.
      subroutine warn_of_supports()
         integer :: i
         if (blocks%fixed%n == 0 .and. size(parameters%boundaries) == 0) return
         do i = 1, size(parameters%joint_materials)
            if (.not. parameters%joint_materials(i)%maximum_closure > 0) cycle
            call messages%add(severity%warning, 'joint material '//to_string(i)// &
                              ' stiffens (maximum_closure): fixed points and boundaries are springs of a multiple '// &
                              '(&contact fixed_stiffness_factor) of the stiffness with which joints begin, and '// &
                              'sink by stress over that; where that counts, give a larger one', &
                              parameters%joint_materials(i)%origin)
            return
         end do
      end subroutine warn_of_supports

      !> Warn of weight that nothing carries: quiet boundaries hold in static steps only.
      subroutine warn_of_weight()
         real(wp) :: k01
         integer :: g
         if (.not. allocated(parameters%boundaries)) return
         if (allocated(parameters%in_situ)) then
            if (size(parameters%in_situ) > 0) return
         end if
         k01 = parameters%k01
         if (allocated(parameters%stages)) then
            if (size(parameters%stages) > 0) k01 = stage_k01(parameters%stages(1), k01)
         end if
         if (k01 < 1 .or. .not. any(abs(parameters%block_materials%weight) > 0)) return
         do g = 1, size(parameters%boundaries)
            if (.not. is_quiet(parameters%boundaries(g))) cycle
            call messages%add(severity%warning, '&boundary '//to_string(g)//' ('//parameters%boundaries(g)%kind// &
                              ') holds in static steps only, but the run begins with dynamic ones: nothing carries '// &
                              "the weight there; begin with a stage until = 'equilibrium'", &
                              parameters%boundaries(g)%origin)
            return
         end do
      end subroutine warn_of_weight

      !> Warn of velocities that a static stage takes away before they act.
      subroutine warn_of_velocity()
         real(wp) :: k01
         integer :: i
         k01 = parameters%k01
         if (allocated(parameters%stages)) then
            if (size(parameters%stages) > 0) k01 = stage_k01(parameters%stages(1), k01)
         end if
         if (k01 > 0) return
         do i = 1, size(parameters%block_materials)
            if (.not. any(abs(parameters%block_materials(i)%velocity) > 0)) cycle
            call messages%add(severity%warning, 'block material '//to_string(i)// &
                              ' has a velocity, but the run begins with static steps, which begin at rest: it is '// &
                              'lost; begin with a dynamic stage', parameters%block_materials(i)%origin)
            return
         end do
      end subroutine warn_of_velocity

      !> Warn of base motion that passes while blocks come to rest.
      subroutine warn_of_time()
         character(len=:), allocatable :: since
         integer :: i, first
         if (.not. allocated(parameters%stages)) return
         if (.not. has_base_motion(parameters%base, parameters%quakes)) return
         first = 1
         since = 'time 0 of the run'
         if (is_given(parameters%base%stage)) then
            first = max(1, stage_number(parameters%stages, parameters%base%stage))
            since = "the start of stage '"//parameters%base%stage//"'"
         end if
         do i = first, size(parameters%stages)
            if (.not. seeks_equilibrium(parameters%stages(i))) cycle
            call messages%add(severity%warning, "stage '"//stage_name(parameters%stages, i)// &
                              "' lasts until equilibrium, but base motion counts from "//since// &
                              ' and acts in it: let the motion begin with a later stage (&load base_stage)', &
                              parameters%stages(i)%origin)
         end do
      end subroutine warn_of_time

   end subroutine check_options

   !> Joint laws alone.
   subroutine check_joints(joints, messages)
      type(joint_material_type), intent(in) :: joints(:)
      type(diagnostics_type), intent(inout) :: messages
      type(joint_law_type), allocatable :: laws(:)
      call new_joint_laws(joints, laws, messages)
   end subroutine check_joints

   !> The number of blocks that each stage places and takes out; a warning for each kind of thing on blocks that go, but
   !> a note for edges of boundaries, and a note for each on blocks that come. Errors: a stage takes out the last block,
   !> or blocks that it places. The names of the regions have been checked.
   subroutine report_stage_effects(blocks, parameters, messages)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(diagnostics_type), intent(inout) :: messages
      logical :: there(blocks%n_blocks), goes(blocks%n_blocks), comes(blocks%n_blocks)
      integer, allocatable :: carriers(:), edge_blocks(:)
      integer :: i
      if (.not. allocated(parameters%regions)) return
      if (.not. any_builds(parameters)) return
      call find_places(carriers, edge_blocks)
      ! absent at the start are blocks that are placed before they are excavated, if ever
      there = .true.
      goes = .false.
      do i = 1, size(parameters%stages)
         associate (stage => parameters%stages(i))
            if (is_given(stage%place)) there = there .and. (goes .or. .not. in_regions(stage%place))
            if (is_given(stage%excavate)) goes = goes .or. in_regions(stage%excavate)
         end associate
      end do
      do i = 1, size(parameters%stages)
         associate (stage => parameters%stages(i), name => "&stage '"//stage_name(parameters%stages, i)//"'")
            if (is_given(stage%place)) then
               comes = in_regions(stage%place) .and. .not. there
               call report_number(name//' places ', count(comes), stage%origin)
               call report(comes, name//':', comes_along, bolt_comes, severity%note, stage%origin)
               there = there .or. comes
            end if
            if (.not. is_given(stage%excavate)) cycle
            goes = in_regions(stage%excavate) .and. there
            call report_number(name//' excavates ', count(goes), stage%origin)
            if (is_given(stage%place)) then
               if (any(goes .and. in_regions(stage%place))) call messages%add(severity%error, name// &
                  ' places and excavates the same blocks', stage%origin)
            end if
            call report(goes, name//':', goes_along, bolt_goes, severity%warning, stage%origin)
            there = there .and. .not. goes
            if (.not. any(there)) call messages%add(severity%error, name//' excavates the last block', stage%origin)
         end associate
      end do

   contains

      !> Blocks of some regions.
      function in_regions(names)
         character(len=*), intent(in) :: names
         logical :: in_regions(blocks%n_blocks)
         in_regions = blocks_of_region(blocks, parameters%regions, names)
      end function in_regions

      !> What is on some blocks.
      subroutine report(chosen, name, words, bolt_words, level, origin)
         logical, intent(in) :: chosen(:)
         character(len=*), intent(in) :: name, words, bolt_words
         integer, intent(in) :: level
         type(origin_type), intent(in) :: origin
         character(len=max(len(name), len(words), len(bolt_words))) :: around(2)
         around = name
         around(2) = words
         call count_all(blocks, chosen, carriers, edge_blocks, around, level, origin, messages)
         around(2) = bolt_words
         call count_bolts(chosen, around, level, origin)
      end subroutine report

      !> Count the bolts with an end in some blocks.
      subroutine count_bolts(chosen, words, level, origin)
         logical, intent(in) :: chosen(:)                         !! (nb)
         character(len=*), intent(in) :: words(2)                 !! before and after the number
         integer, intent(in) :: level                             !! one of severity%...
         type(origin_type), intent(in) :: origin
         integer :: l, n
         n = 0
         do l = 1, blocks%bolts%n
            associate (pair => blocks%bolts%blocks(:, l))
               if (is_one_of(chosen, pair(1)) .or. is_one_of(chosen, pair(2))) n = n + 1
            end associate
         end do
         if (n > 0) call messages%add(level, trim(words(1))//' '//counted(n, 'bolt')//' '//trim(words(2)), origin)
      end subroutine count_bolts

      !> Blocks that carry the line loads, and those of the edges of boundaries.
      subroutine find_places(carriers, edge_blocks)
         integer, allocatable, intent(out) :: carriers(:)      !! (line loads), 0: none
         integer, allocatable, intent(out) :: edge_blocks(:)   !! (edges)
         type(diagnostics_type) :: told_elsewhere
         logical, allocatable :: outer(:)
         integer, allocatable :: edges(:), their_blocks(:)
         real(wp), allocatable :: normals(:, :)
         real(wp) :: tolerance
         integer :: g
         allocate (carriers(size(parameters%line_loads)), edge_blocks(0))
         call find_carriers(blocks, parameters, carriers, told_elsewhere)
         if (.not. allocated(parameters%boundaries)) return
         tolerance = max(blocks%edge_node_distance, 1.0e-9_wp*parameters%w0)
         outer = find_outer_edges(blocks, tolerance)
         do g = 1, size(parameters%boundaries)
            if (.not. allocated(parameters%boundaries(g)%along)) cycle
            call edges_along(blocks, outer, parameters%boundaries(g)%along, tolerance, edges, their_blocks, normals)
            edge_blocks = [edge_blocks, their_blocks]
         end do
      end subroutine find_places

      !> A note with a number of blocks, a warning where there are none.
      subroutine report_number(what, n, origin)
         character(len=*), intent(in) :: what
         integer, intent(in) :: n
         type(origin_type), intent(in) :: origin
         call messages%add(merge(severity%note, severity%warning, n > 0), what//counted(n, 'block'), origin)
      end subroutine report_number

   end subroutine report_stage_effects

   !> Does a stage excavate or place blocks?
   pure logical function any_builds(parameters)
      type(parameters_type), intent(in) :: parameters
      integer :: i
      any_builds = .false.
      if (.not. allocated(parameters%stages)) return
      do i = 1, size(parameters%stages)
         any_builds = any_builds .or. is_given(parameters%stages(i)%excavate) .or. &
                      is_given(parameters%stages(i)%place)
      end do
   end function any_builds

   !> Count points, line loads and edges of boundaries on some blocks, a message for each kind.
   subroutine count_all(blocks, chosen, carriers, edge_blocks, words, level, origin, messages)
      type(block_system_type), intent(in) :: blocks
      logical, intent(in) :: chosen(:)                         !! (nb)
      integer, intent(in) :: carriers(:), edge_blocks(:)       !! blocks of line loads and of edges, 0: none
      character(len=*), intent(in) :: words(2)                 !! before and after the number
      integer, intent(in) :: level                             !! one of severity%..., but of edges a note
      type(origin_type), intent(in) :: origin
      type(diagnostics_type), intent(inout) :: messages
      if (blocks%fixed%n > 0) call report(blocks%fixed%block(1:blocks%fixed%n), 'fixed point', level)
      if (blocks%loading%n > 0) call report(blocks%loading%block(1:blocks%loading%n), 'loading point', level)
      call report(carriers, 'line load', level)
      if (blocks%measured%n > 0) call report(blocks%measured%block(1:blocks%measured%n), 'measured point', level)
      ! an edge that is gone needs no support: who takes out a centring takes out what holds it, too
      call report(edge_blocks, 'boundary edge', severity%note)

   contains

      !> Those of one kind.
      subroutine report(on, noun, level)
         integer, intent(in) :: on(:)     !! blocks
         character(len=*), intent(in) :: noun
         integer, intent(in) :: level     !! one of severity%...
         integer :: i, n
         n = 0
         do i = 1, size(on)
            if (is_one_of(chosen, on(i))) n = n + 1
         end do
         if (n > 0) call messages%add(level, trim(words(1))//' '//counted(n, noun)//' '//trim(words(2)), origin)
      end subroutine report

   end subroutine count_all

   !> Is a block, 0 for none, one of those chosen?
   pure logical function is_one_of(chosen, block)
      logical, intent(in) :: chosen(:)
      integer, intent(in) :: block
      is_one_of = .false.
      if (block > 0) is_one_of = chosen(block)
   end function is_one_of

   !> Every number must be finite, and those that end a loop must lie in their range.
   subroutine check_parameters(parameters, messages)
      type(parameters_type), intent(in) :: parameters
      type(diagnostics_type), intent(inout) :: messages
      integer :: i
      associate (p => parameters)
         call demand('finite', messages, 't_end', [p%t_end])
         call demand('finite', messages, 'k01', [p%k01])
         call demand('finite and above 0', messages, 'dt_max (g1)', [p%dt_max])
         call demand('finite and above 0', messages, 'dt_min', [p%dt_min])
         call demand('finite and above 0', messages, 'displacement_ratio (g2)', [p%displacement_ratio])
         call demand('finite', messages, 'w0', [p%w0])
         call demand('finite and above 0', messages, 'cut_factor', [p%cut_factor])
         if (.not. p%cut_factor < 1) call messages%add(severity%error, 'cut_factor must be below 1, found '// &
                                                       to_string(p%cut_factor))
         call demand('finite and above 0', messages, 'contact stiffness (g0)', [p%normal_stiffness])
         call demand('finite', messages, 'shear stiffness', [p%shear_stiffness])
         call demand('finite', messages, 'stiffness of fixed points', [p%fixed_stiffness])
         call demand('finite', messages, 'search distance', [p%search_distance])
         call demand('finite', messages, 'angle_tolerance', [p%angle_tolerance])
         call demand('finite', messages, 'close_tolerance', [p%close_tolerance])
         call demand('finite', messages, 'open_tolerance', [p%open_tolerance])
         call demand('finite', messages, 'mass_proportional', [p%mass_damping])
         call demand('finite', messages, 'gravity', [p%gravity])
         call demand('finite and above 0', messages, 'solver tolerance', [p%solver_tolerance])
         call demand('finite', messages, 'SOR factor', [p%sor_factor])
      end associate
      if (allocated(parameters%block_materials)) then
         do i = 1, size(parameters%block_materials)
            associate (m => parameters%block_materials(i))
               call demand('finite', messages, 'block material '//to_string(i), m%numbers(), m%origin)
               call demand_modulus(messages, 'block material '//to_string(i), m%youngs_modulus, m%origin)
            end associate
         end do
      end if
      if (allocated(parameters%changes)) then
         do i = 1, size(parameters%changes)
            if (is_set(parameters%changes(i)%young)) &
               call demand_modulus(messages, '&change '//to_string(i), parameters%changes(i)%young, &
                                   parameters%changes(i)%origin)
         end do
      end if
      if (allocated(parameters%joint_materials)) then
         do i = 1, size(parameters%joint_materials)
            associate (m => parameters%joint_materials(i))
               call demand('finite', messages, 'joint material '//to_string(i), &
                           [m%friction_angle, m%cohesion, m%tension], m%origin)
            end associate
         end do
      end if
      if (allocated(parameters%stages)) then
         do i = 1, size(parameters%stages)
            associate (m => parameters%stages(i))
               call demand('finite', messages, 'stage '//to_string(i), [m%until_time, m%k01, m%gravity], &
                           m%origin)
            end associate
         end do
      end if
   end subroutine check_parameters

   !> Strains under any stress that a model may have must be finite numbers, and their energies.
   subroutine demand_modulus(messages, name, modulus, origin)
      type(diagnostics_type), intent(inout) :: messages
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: modulus
      type(origin_type), intent(in) :: origin            !! where the group was read that has it; or empty
      if (modulus < smallest_modulus) call messages%add(severity%error, name//": Young's modulus must be at least "// &
                                                        to_string(smallest_modulus)//', found '//to_string(modulus), &
                                                        origin)
   end subroutine demand_modulus

   !> A value, or all values of a material or stage, must lie in a range.
   subroutine demand(range, messages, name, values, origin)
      character(len=*), intent(in) :: range              !! 'finite' or 'finite and above 0'
      type(diagnostics_type), intent(inout) :: messages
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: values(:)
      type(origin_type), intent(in), optional :: origin  !! as of `demand_modulus`
      if (all(ieee_is_finite(values)) .and. (range == 'finite' .or. all(values > 0))) return
      if (size(values) == 1) then
         call messages%add(severity%error, name//' must be '//range//', found '//to_string(values(1)))
      else
         call messages%add(severity%error, name//': all values must be '//range, origin)
      end if
   end subroutine demand

end module rockdda_check_options
