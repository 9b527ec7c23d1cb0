! SPDX-License-Identifier: MIT
!> Makes the numbers of a run from the analysis file, the options and the model's size. Options win over the analysis
!> file, which wins over the defaults of the table of options.
!>
!> The formulation of contacts that a run takes, and options that have no effect in it.
!>
!> The word of the user prevails, also over a preset: `preset` with formulation = 'length' has contacts by length with
!> the closing rule and the tolerances of the preset. Ties exist by length only: tie = .true. makes all contacts of the
!> run those by length; a preset without a word for the formulation contradicts it.
!>
!> Materials and tables of points: those of the analysis file with what the options say about them; the end of the run.
module rockdda_model_resolve
   use rockdda_base_kinds, only : wp, pi
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_base_strings, only : to_string
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_analysis_input, only : analysis_input_type, dialect, joint_material_type
   use rockdda_model_automatic_numbers, only : choose_numbers
   use rockdda_model_kinks, only : report_tips
   use rockdda_model_contact_numbers, only : automatic_over_e, preset_over_e, far_over_e, mean_edge, advised_ratio, &
      stiffness_advice, springs_of_joint
   use rockdda_model_option_rows, only : option_rows_type, fill_defaults, transfer_options
   use rockdda_model_option_table, only : describe_options
   use rockdda_model_options, only : run_options_type, dda_windows, old_dda_windows, is_set
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_quake_options, only : settle_quakes
   use rockdda_model_stage_options, only : has_end, is_plain, is_given, has_base_motion, first_dynamic_stage, &
      stage_name, least_extent
   use rockdda_model_joint_options, only : take_joint_options
   use rockdda_model_material_options, only : take_block_options, take_point_tables
   implicit none
   private
   public :: resolve_parameters, length_scale, units_of, put_materials_together

   !> Ratio of critical damping: with 0.1 stiff joints still feed their vibration by friction, with 1 blocks slip less.
   real(wp), parameter :: damps_sliding = 0.5_wp

   character(len=*), parameter :: by_length = 'length'

contains

   !> Find the numbers of a run; each value of the analysis file that an option replaces is a note in `messages`.
   subroutine resolve_parameters(blocks, analysis, options, parameters, messages)
      type(block_system_type), intent(in) :: blocks
      type(analysis_input_type), intent(in) :: analysis
      type(run_options_type), intent(in) :: options
      type(parameters_type), intent(out) :: parameters
      type(diagnostics_type), intent(inout) :: messages !! notes and errors are appended
      type(run_options_type) :: settings
      type(option_rows_type) :: defaults, choices
      type(diagnostics_type) :: replaced
      logical :: is_windows, has_preset
      logical :: alone                                  !! a labelled file without an analysis file
      integer :: i

      is_windows = analysis%dialect == dialect%windows
      alone = .not. allocated(analysis%block_materials)
      call take_analysis()
      parameters%units = units_of(options)
      settings = options
      has_preset = .false.
      if (allocated(options%preset)) has_preset = any(options%preset == [character(len=len(dda_windows)) :: &
                                                                         dda_windows, old_dda_windows])
      if (options%labelled) call take_labelled_defaults(settings, alone .and. .not. has_preset)
      call describe_options(defaults, settings, parameters)
      call fill_defaults(defaults, has_preset)
      call defaults%give_back()
      call describe_options(defaults, settings, parameters)
      call choose_formulation()
      call describe_options(choices, settings, parameters)
      call transfer_options(choices, replaced)
      call choices%give_back()
      call describe_options(choices, settings, parameters)
      ! contacts by length that slide are damped, unless the file says something else
      if (alone .and. .not. has_preset .and. parameters%by_length .and. .not. is_set(options%sliding_damping)) &
         parameters%sliding_damping = damps_sliding
      if (.not. alone) then
         call note_extent()
         call messages%append(replaced)
      end if
      if (.not. parameters%by_length) call report_unused()
      if (is_set(options%points)) call messages%add(severity%warning, 'points has no effect: a joint is integrated '// &
         'exactly over the part that is closed', options%points_origin)
      if (is_set(options%gravity) .and. .not. alone) call messages%add(severity%note, 'gravity '// &
         parameters%shown(options%gravity, 'length/time^2')//' replaces weight over density of the analysis file')
      parameters%line_loads = settings%line_loads
      parameters%stages = settings%stages
      parameters%changes = settings%changes
      parameters%boundaries = settings%boundaries
      parameters%quakes = settings%quakes
      call settle_quakes(parameters%quakes, parameters%units, any([(parameters%boundaries(i)%kind == 'viscous', &
                                                  i=1, size(parameters%boundaries))]), messages)
      call note_stages()
      if (options%labelled) call choose_base_stage(parameters, messages)
      call put_materials_together(analysis, settings, parameters, messages)
      call take_point_tables('fixed point', settings%fixed_points, parameters%fixed_tables, messages)
      call take_point_tables('loading point', settings%loading_points, parameters%loading_tables, messages)
      parameters%regions = settings%regions
      parameters%subdivisions = settings%subdivisions
      parameters%in_situ = settings%in_situ
      parameters%water = settings%water
      parameters%bolts = settings%bolts
      parameters%liners = settings%liners

      parameters%w0 = reference_length(blocks, length_scale(settings%length_scale, analysis%dialect))
      if (alone) call choose_numbers(blocks, options, parameters, messages)
      call report_unreached(parameters, messages)
      if (.not. is_set(options%dt_min)) parameters%dt_min = merge(1.0e-2_wp, 1.0e-3_wp, is_windows)*parameters%dt_max
      if (parameters%dt_min > parameters%dt_max) call messages%add(severity%error, 'dt_min = '// &
         parameters%shown(parameters%dt_min, 'time', 6)//' is larger than the largest time step '// &
         parameters%shown(parameters%dt_max, 'time', 6), options%dt_min_origin)
      call refuse_short_times(options, parameters, messages)
      if (is_set(options%save_every) .and. is_set(options%save_dt)) call messages%add(severity%note, &
         'save_every and save_dt are both given: a frame is saved every '//to_string(options%save_every)// &
         ' steps and every '//parameters%shown(options%save_dt, 'time')//' of time')
      if (settings%strict .and. .not. parameters%energy) call messages%add(severity%error, &
         'strict needs the energy balance, but &output energy is .false.: leave one of them out', options%strict_origin)
      if (parameters%by_length) call report_tips(blocks, messages)
      call resolve_stiffness()
      call resolve_lengths(alone .and. parameters%by_length .and. .not. parameters%windows_contacts .and. &
                           .not. is_set(options%stiffness))

   contains

      !> Find search distance and tolerances.
      subroutine resolve_lengths(by_blocks)
         logical, intent(in) :: by_blocks   !! joints without a stiffness of their own take it from their blocks
         real(wp) :: edge
         ! a step that moves blocks further than this searches again; to begin with, blocks further away than their
         ! neighbours' neighbours are no candidates
         parameters%search_distance = min(settings%search_factor*parameters%displacement_ratio*parameters%w0, &
                                          2*mean_diameter(blocks))
         edge = mean_edge(blocks)
         if (parameters%displacement_ratio*parameters%w0 > edge .and. edge > 0) call messages%add(severity%warning, &
            'the displacement ratio (g2) lets a block move by '// &
            parameters%shown(parameters%displacement_ratio*parameters%w0, 'length')// &
            ' in a step, more than the mean length of edges, '//parameters%shown(edge, 'length')//': g2 = '// &
            to_string(advised_ratio(edge, parameters%w0))//' is advised', settings%ratio_origin)
         parameters%angle_tolerance = settings%angle_tolerance*pi/180
         parameters%smooth_step = blocks%edge_node_distance
         parameters%stiffness_length = merge(0.0_wp, edge, by_blocks)
         parameters%close_tolerance = settings%close_tolerance*parameters%w0
         parameters%open_tolerance = settings%open_tolerance*parameters%w0
      end subroutine resolve_lengths

      !> Remove the limit of the number of steps where only an end time is given.
      subroutine note_extent()
         if (is_set(options%steps) .or. .not. is_set(options%t_end)) return
         parameters%n_steps = huge(1)
         call messages%add(severity%note, 'end time '//parameters%shown(options%t_end, 'time', 10)// &
                           ' replaces the number of steps '//to_string(analysis%n_steps)//' of the analysis file')
      end subroutine note_extent

      !> Settle the formulation: `settings` holds the options with their defaults.
      subroutine choose_formulation()
         type(joint_material_type) :: tied
         character(len=:), allocatable :: what
         logical :: is_given, has_tie
         is_given = .false.
         if (allocated(options%formulation)) is_given = len_trim(options%formulation) > 0
         if (settings%formulation == by_length) then
            if (has_preset .and. is_given) call messages%add(severity%note, "formulation 'length' is given: of the "// &
               "preset '"//options%preset//"' the closing rule, tolerances and defaults hold, its contacts do not", &
               options%formulation_origin)
            return
         end if
         call find_tie(settings, tied, has_tie)
         if (.not. has_tie) return
         what = 'joint material '//to_string(tied%number)//": tie = .true. needs formulation 'length'"
         if (has_preset) then
            call messages%add(severity%error, what//", and the preset '"//options%preset//"' has 'vertex': leave "// &
                              "out the tie or the preset, or give &contact formulation = 'length'", tied%origin)
         else if (is_given) then
            call messages%add(severity%warning, what//", which all contacts of the run take in place of 'vertex'", &
                              tied%origin)
         else
            call messages%add(severity%note, what//', which all contacts of the run take', tied%origin)
         end if
         settings%formulation = by_length
      end subroutine choose_formulation

      !> Take the values of the analysis file.
      subroutine take_analysis()
         if (.not. allocated(analysis%block_materials)) then
            allocate (parameters%fixed_tables(blocks%fixed%n), parameters%loading_tables(blocks%loading%n))
            parameters%k01 = 1
            return
         end if
         parameters%n_steps = analysis%n_steps
         parameters%k01 = analysis%k01
         parameters%dt_max = analysis%dt_max
         parameters%displacement_ratio = analysis%displacement_ratio
         parameters%normal_stiffness = analysis%stiffness
         parameters%sor_factor = analysis%sor_factor
         allocate (parameters%fixed_tables(blocks%fixed%n), parameters%loading_tables(blocks%loading%n))
         if (allocated(analysis%fixed_tables)) then
            if (size(analysis%fixed_tables) == blocks%fixed%n) parameters%fixed_tables = analysis%fixed_tables
         end if
         if (allocated(analysis%loading_tables)) then
            if (size(analysis%loading_tables) == blocks%loading%n) parameters%loading_tables = analysis%loading_tables
         end if
      end subroutine take_analysis

      !> Find the stiffness of contacts and fixed points.
      subroutine resolve_stiffness()
         character(len=:), allocatable :: text
         real(wp) :: e_max, springs
         springs = springs_of_joint(parameters%by_length)
         e_max = max(0.0_wp, maxval(parameters%block_materials%youngs_modulus))
         if (parameters%normal_stiffness <= 0) then
            if (parameters%windows_contacts) then
               parameters%normal_stiffness = preset_over_e*e_max
               text = to_string(preset_over_e)//' times the largest E, as the preset has it, = '
            else
               parameters%normal_stiffness = automatic_over_e/springs*e_max
               text = trim(merge('twice the largest E', 'the largest E      ', parameters%by_length))//' = '
            end if
            call messages%add(severity%note, 'contact stiffness (g0) is automatic: '//text// &
                              parameters%shown(parameters%normal_stiffness, 'force/length')//', constant in the run')
         else if (parameters%normal_stiffness > far_over_e/springs*e_max) then
            call messages%add(severity%warning, 'the contact stiffness (g0) is '// &
                              to_string(parameters%normal_stiffness/e_max)//' times the largest E: '// &
                              stiffness_advice(parameters%by_length), settings%stiffness_origin)
         end if
         parameters%shear_stiffness = parameters%normal_stiffness/settings%shear_ratio
         parameters%fixed_stiffness = parameters%normal_stiffness*settings%fixed_stiffness_factor
      end subroutine resolve_stiffness

      !> Does the run end with its last stage? Then the number of steps of the analysis file does not count. It does in
      !> a labelled file; after stages as older files have them it continues.
      subroutine note_stages()
         integer :: i, n
         n = size(parameters%stages)
         if (n == 0) return
         if (.not. has_end(parameters%stages(n))) return
         parameters%ends_with_stages = options%labelled .or. .not. all([(is_plain(parameters%stages(i)), i=1, n)])
         if (.not. parameters%ends_with_stages .or. is_set(options%steps) .or. is_set(options%t_end)) return
         if (parameters%n_steps > 0 .and. parameters%n_steps < huge(1)) call messages%add(severity%note, 'the end '// &
            'of the last stage replaces the number of steps '//to_string(parameters%n_steps)//' of the analysis file')
         parameters%n_steps = huge(1)
      end subroutine note_stages

      !> Warn of numbers that have no effect with contacts of vertices on edges, where they were read.
      subroutine report_unused()
         type(option_rows_type) :: table
         type(run_options_type) :: given
         type(parameters_type) :: none
         integer :: i
         given = options
         call describe_options(table, given, none)
         do i = 1, table%n
            associate (row => table%rows(i))
               if (row%by_length .and. (is_set(row%given%number) .or. is_set(row%given%whole))) &
                  call messages%add(severity%warning, row%name//" has no effect with formulation 'vertex': there a "// &
                  'contact is one vertex, with a sharp corner, on an edge, and has the stiffness g0', row%origin)
            end associate
         end do
      end subroutine report_unused

   end subroutine resolve_parameters

   !> Steps, and what they are shortened to land on: inertia and accelerations divide by the square of a time.
   subroutine refuse_short_times(options, parameters, messages)
      type(run_options_type), intent(in) :: options
      type(parameters_type), intent(in) :: parameters
      type(diagnostics_type), intent(inout) :: messages
      !> Far below any time that matters; its square divides masses and displacements of any unit.
      real(wp), parameter :: shortest = 1.0e-100_wp
      integer :: i
      call need(parameters%t_end, 'end time (t_end)', options%t_end_origin)
      call need(parameters%dt_max, 'largest time step (dt_max)', options%dt_max_origin)
      call need(parameters%dt_min, 'smallest time step (dt_min)', options%dt_min_origin)
      do i = 1, size(parameters%stages)
         associate (stage => parameters%stages(i))
            call need(stage%until_time, 'end time (until_time) of stage '//to_string(i), stage%origin)
            call need(stage%duration, 'duration of stage '//to_string(i), stage%origin)
         end associate
      end do

   contains

      !> Refuse a time that is given and too short.
      subroutine need(time, name, origin)
         real(wp), intent(in) :: time
         character(len=*), intent(in) :: name
         type(origin_type), intent(in) :: origin
         if (time > 0 .and. time < shortest) call messages%add(severity%error, name//' is too short: '// &
            parameters%shown(time, 'time')//'; at least '//parameters%shown(shortest, 'time'), origin)
      end subroutine need

   end subroutine refuse_short_times

   !> The system of units of the input: SI in a labelled file that does not say it, none in others.
   pure function units_of(options) result(units)
      type(run_options_type), intent(in) :: options
      character(len=4) :: units
      units = trim(merge('SI  ', 'none', options%labelled))
      if (.not. allocated(options%units)) return
      if (len_trim(options%units) > 0) units = options%units
   end function units_of

   !> Options whose default is another one in a labelled file: plane strain, and dynamic steps of second order.
   pure subroutine take_labelled_defaults(settings, second_order)
      type(run_options_type), intent(inout) :: settings
      logical, intent(in) :: second_order          !! neither an analysis file nor a preset wants Shi's scheme
      if (.not. allocated(settings%plane)) settings%plane = ''
      if (len_trim(settings%plane) == 0) settings%plane = 'strain'
      if (.not. allocated(settings%integrator)) settings%integrator = ''
      if (len_trim(settings%integrator) == 0 .and. second_order) settings%integrator = 'generalized_alpha'
      if (.not. allocated(settings%title)) settings%title = ''
      if (len_trim(settings%title) == 0 .and. allocated(settings%model_title)) settings%title = settings%model_title
   end subroutine take_labelled_defaults

   !> Warn of stages that cannot begin before the run ends.
   subroutine report_unreached(parameters, messages)
      type(parameters_type), intent(in) :: parameters
      type(diagnostics_type), intent(inout) :: messages
      character(len=:), allocatable :: text
      real(wp) :: time      !! the stages up to i take at least so long,
      integer :: i, steps   !! and number of steps
      time = 0
      steps = 0
      do i = 1, size(parameters%stages) - 1
         call least_extent(parameters%stages(i), time, steps)
         text = ''
         if (.not. time < parameters%t_end) text = 'at t_end = '//parameters%shown(parameters%t_end, 'time', 6)
         if (steps >= parameters%n_steps) text = 'after steps = '//to_string(parameters%n_steps)
         if (len(text) == 0) cycle
         text = "stage '"//stage_name(parameters%stages, i + 1)//"' is not reached: the run ends "//text//', and '// &
                'the stages before it last '
         if (.not. time < parameters%t_end) text = text//'until '//parameters%shown(time, 'time', 6)
         if (steps >= parameters%n_steps) text = text//'at least '//to_string(steps)//' steps'
         call messages%add(severity%warning, text, parameters%stages(i + 1)%origin)
         return
      end do
   end subroutine report_unreached

   !> In a labelled file base motion begins with the first dynamic stage: blocks that come to rest before it do not use
   !> up the record.
   subroutine choose_base_stage(parameters, messages)
      type(parameters_type), intent(inout) :: parameters
      type(diagnostics_type), intent(inout) :: messages
      integer :: i
      if (.not. has_base_motion(parameters%base, parameters%quakes) .or. is_given(parameters%base%stage)) return
      i = first_dynamic_stage(parameters%stages, parameters%k01)
      if (i < 2) return
      parameters%base%stage = stage_name(parameters%stages, i)
      call messages%add(severity%note, "base motion begins with stage '"//parameters%base%stage// &
                        "', the first dynamic one", parameters%stages(i)%origin)
   end subroutine choose_base_stage

   !> The extent of which w0 is half: the option, or where it is not given that of the dialect.
   pure function length_scale(given, of_dialect) result(scale)
      character(len=:), allocatable, intent(in) :: given
      integer, intent(in) :: of_dialect                 !! one of dialect%...
      character(len=:), allocatable :: scale
      scale = ''
      if (allocated(given)) scale = trim(given)
      if (len(scale) == 0) scale = trim(merge('largest', 'height ', of_dialect == dialect%windows))
   end function length_scale

   !> Half the model's height or larger extent.
   pure real(wp) function reference_length(blocks, scale)
      type(block_system_type), intent(in) :: blocks
      character(len=*), intent(in) :: scale   !! 'height' or 'largest'
      real(wp) :: extent(2)
      extent = 0
      if (blocks%n_vertices() > 0) extent = maxval(blocks%vertices, dim=2) - minval(blocks%vertices, dim=2)
      reference_length = 0.5_wp*merge(maxval(extent), extent(2), scale == 'largest')
   end function reference_length

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

   !> A group by which a material is tied, and that no later group takes back.
   subroutine find_tie(settings, tied, has_tie)
      type(run_options_type), intent(in) :: settings
      type(joint_material_type), intent(out) :: tied
      logical, intent(out) :: has_tie
      type(joint_material_type), allocatable :: groups(:)
      integer :: i, k
      allocate (groups(0))
      if (allocated(settings%joint_materials)) groups = [groups, settings%joint_materials]
      if (allocated(settings%joint_laws)) groups = [groups, settings%joint_laws]
      has_tie = .false.
      do i = 1, size(groups)
         if (.not. (groups(i)%tie_given .and. groups(i)%tie)) cycle
         if (any([(groups(k)%tie_given .and. groups(k)%number == groups(i)%number .and. .not. groups(k)%tie, &
                   k=i + 1, size(groups))])) cycle
         tied = groups(i)
         has_tie = .true.
         return
      end do
   end subroutine find_tie

   !> Materials of the analysis file and the options; without an analysis file also the end of the run.
   subroutine put_materials_together(analysis, options, parameters, messages)
      type(analysis_input_type), intent(in) :: analysis
      type(run_options_type), intent(in) :: options             !! with all lists
      type(parameters_type), intent(inout) :: parameters
      type(diagnostics_type), intent(inout) :: messages
      if (allocated(analysis%block_materials)) then
         parameters%block_materials = analysis%block_materials
         parameters%joint_materials = analysis%joint_materials
      else
         if (allocated(parameters%block_materials)) deallocate (parameters%block_materials, parameters%joint_materials)
         allocate (parameters%block_materials(0), parameters%joint_materials(0))
         call find_extent(options, parameters, messages)
      end if
      parameters%given_gravity = parameters%gravity
      call take_block_options(options%block_materials, options%labelled, parameters%gravity, &
                              parameters%block_materials, messages)
      call take_joint_options(options%joint_materials, options%joint_laws, options%labelled, &
                              parameters%joint_materials, messages)
   end subroutine put_materials_together

   !> Where a run without an analysis file ends: its number of steps, its end time, or the end of its last stage.
   subroutine find_extent(options, parameters, messages)
      type(run_options_type), intent(in) :: options
      type(parameters_type), intent(inout) :: parameters
      type(diagnostics_type), intent(inout) :: messages
      if (.not. is_set(options%steps)) parameters%n_steps = huge(1)
      if (allocated(options%stages)) then
         if (size(options%stages) > 0) then
            associate (last => options%stages(size(options%stages)))
               if (has_end(last)) return
            end associate
         end if
      end if
      if (is_set(options%steps) .or. is_set(options%t_end)) return
      call messages%add(severity%error, 'the run has no end: give &run steps or t_end, or an end to the last &stage', &
                        options%model_origin)
   end subroutine find_extent

end module rockdda_model_resolve
