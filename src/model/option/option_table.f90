! SPDX-License-Identifier: MIT
!> The table of options: all that an options file may hold. A new option is one row here, its component in
!> rockdda_model_options and, when the run keeps it under a name of its own, in rockdda_model_parameters. Reader,
!> hints, defaults, log, checkpoint, documents and schema are loops over the rows (rockdda_model_option_rows).
module rockdda_model_option_table
   use rockdda_base_kinds, only : wp
   use rockdda_model_analysis_input, only : joint_material_type, unset_joint_material
   use rockdda_model_material_options, only : describe_model, describe_block_materials, describe_point_tables
   use rockdda_model_options, only : run_options_type, stage_type, change_type, line_load_type, &
      dda_windows, old_dda_windows, most_threads
   use rockdda_model_support_options, only : describe_bolts, describe_liners
   use rockdda_model_joint_options, only : describe_joint
   use rockdda_model_quake_options, only : describe_quakes
   use rockdda_model_region_options, only : describe_regions
   use rockdda_model_ground_options, only : describe_water, describe_boundaries
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_option, only : option, list_rule
   use rockdda_model_option_rows, only : option_rows_type
   use rockdda_model_stage_options, only : describe_stage, describe_new_values
   implicit none
   private
   public :: all_options, describe_options, describe_parameters

contains

   !> All options, one element of each list, as they are before anything is given.
   function all_options() result(table)
      type(option_rows_type) :: table
      type(run_options_type) :: options
      type(parameters_type) :: parameters
      call table%want_one_each()
      call describe_options(table, options, parameters)
   end function all_options

   !> The whole table, bound to these options and parameters.
   subroutine describe_options(table, options, parameters)
      type(option_rows_type), intent(inout) :: table
      type(run_options_type), intent(inout) :: options
      type(parameters_type), intent(inout) :: parameters
      call describe_model(table, options)
      call describe_block_materials(table, options%block_materials)
      call describe_settings(table, options, parameters)
      call describe_lists(table, options%line_loads, options%joint_materials, options%stages)
      call describe_changes(table, options%changes)
      call describe_joint_laws(table, options%joint_laws)
      call describe_point_tables(table, options%fixed_points, options%loading_points)
      call describe_regions(table, options%regions, options%subdivisions)
      call describe_boundaries(table, options%boundaries, options%in_situ)
      call describe_water(table, options%water)
      call describe_quakes(table, options%quakes)
      call describe_bolts(table, options%bolts)
      call describe_liners(table, options%liners)
   end subroutine describe_options

   !> What the parameters of a run keep of the table.
   subroutine describe_parameters(table, options, parameters)
      type(option_rows_type), intent(inout) :: table
      type(run_options_type), intent(inout) :: options        !! of which no list counts
      type(parameters_type), intent(inout) :: parameters
      call describe_settings(table, options, parameters)
      call describe_lists(table, parameters%line_loads, parameters%joint_materials, parameters%stages)
      call describe_changes(table, parameters%changes)
      call describe_regions(table, parameters%regions, parameters%subdivisions)
      call describe_boundaries(table, parameters%boundaries, parameters%in_situ)
      call describe_water(table, parameters%water)
      call describe_quakes(table, parameters%quakes)
      call describe_bolts(table, parameters%bolts)
      call describe_liners(table, parameters%liners)
   end subroutine describe_parameters

   !> The groups that are not lists.
   subroutine describe_settings(table, options, parameters)
      type(option_rows_type), intent(inout) :: table
      type(run_options_type), intent(inout) :: options
      type(parameters_type), intent(inout) :: parameters
      call describe_run(table, options, parameters)
      call describe_time(table, options, parameters)
      call describe_contact(table, options, parameters)
      call describe_solver(table, options, parameters)
      call describe_material(table, options, parameters)
      call describe_output(table, options, parameters)
   end subroutine describe_settings

   !> The groups each of which is an element of a list.
   subroutine describe_lists(table, line_loads, joint_materials, stages)
      type(option_rows_type), intent(inout) :: table
      type(line_load_type), allocatable, intent(inout) :: line_loads(:)
      type(joint_material_type), allocatable, intent(inout) :: joint_materials(:)
      type(stage_type), allocatable, intent(inout) :: stages(:)
      integer :: i

      call table%begin_list('line_load', 'A force along one edge of a block.')
      if (.not. allocated(line_loads)) allocate (line_loads(table%n_wanted()))
      do i = 1, size(line_loads)
         call table%start_element(i, line_loads(i)%origin)
         call describe_line_load(table, line_loads(i))
      end do

      call table%begin_list('joint_material', 'A joint material: changes what it names of one of the analysis '// &
                            'file, or adds one.')
      if (.not. allocated(joint_materials)) call create_joints(table%n_wanted(), joint_materials)
      do i = 1, size(joint_materials)
         call table%start_element(i, joint_materials(i)%origin)
         call table%add(option('number', 'number of the joint material; beside an analysis file the next free '// &
                               'one adds a material', least=1.0_wp, most=999.0_wp, required=.true.), &
                        joint_materials(i)%number)
         call describe_joint(table, joint_materials(i))
      end do

      call table%begin_list('stage', 'One part of the run; stages follow one another in the order of the file.')
      if (.not. allocated(stages)) allocate (stages(table%n_wanted()))
      do i = 1, size(stages)
         call table%start_element(i, stages(i)%origin)
         call describe_stage(table, stages(i))
      end do
   end subroutine describe_lists

   !> &change
   subroutine describe_changes(table, changes)
      type(option_rows_type), intent(inout) :: table
      type(change_type), allocatable, intent(inout) :: changes(:)
      integer :: i
      call table%begin_list('change', 'New values from the start of a stage on: of a joint material, of a block '// &
                            'material, or of the blocks of regions.')
      if (.not. allocated(changes)) then
         allocate (changes(table%n_wanted()))
         do i = 1, size(changes)
            changes(i)%joint = unset_joint_material()
         end do
      end if
      do i = 1, size(changes)
         call table%start_element(i, changes(i)%origin)
         call describe_new_values(table, changes(i))
         call describe_joint(table, changes(i)%joint)
      end do
   end subroutine describe_changes

   !> The groups that change joint materials of the analysis file.
   subroutine describe_joint_laws(table, joint_laws)
      type(option_rows_type), intent(inout) :: table
      type(joint_material_type), allocatable, intent(inout) :: joint_laws(:)
      integer :: i
      call table%begin_list('joint_law', 'Law of one joint material: as joint_material, for a material that there '// &
                            'is.')
      if (.not. allocated(joint_laws)) call create_joints(table%n_wanted(), joint_laws)
      do i = 1, size(joint_laws)
         call table%start_element(i, joint_laws(i)%origin)
         call table%add(option('material', 'number or name of the joint material', required=.true., &
                               or_number=.true.), joint_laws(i)%word)
         call describe_joint(table, joint_laws(i))
      end do
   end subroutine describe_joint_laws

   !> A number of joint materials of which nothing is given.
   pure subroutine create_joints(n, joints)
      integer, intent(in) :: n
      type(joint_material_type), allocatable, intent(out) :: joints(:)
      integer :: i
      allocate (joints(n))
      do i = 1, n
         joints(i) = unset_joint_material()
      end do
   end subroutine create_joints

   !> &run
   subroutine describe_run(table, o, p)
      type(option_rows_type), intent(inout) :: table
      type(run_options_type), intent(inout) :: o
      type(parameters_type), intent(inout) :: p
      call table%begin('run', 'Extent of the run, and what it takes of the machine.')
      call table%add(option('title', 'title of the results', default_text='that of &model, else the stem of the '// &
                            'analysis file or of the file with &model'), o%title, p%title)
      call table%add(option('steps', 'number of time steps', quantity='number of steps', least=0.0_wp, &
                            in_analysis=.true.), o%steps, p%n_steps)
      call table%add(option('t_end', 'end time; the last step is shortened to end there', unit='time', &
                            quantity='end time', above=0.0_wp, default_text='none'), o%t_end, p%t_end)
      call table%locate(o%t_end_origin)
      call table%add(option('save_every', 'steps from one frame to the next', least=1.0_wp, &
                            default_text='about 100 frames in the run'), o%save_every)
      call table%add(option('save_dt', 'a frame every so much time; where save_every is given, too, both count', &
                            unit='time', above=0.0_wp, default_text='none'), o%save_dt)
      call table%add(option('threads', 'number of OpenMP threads', least=1.0_wp, most=real(most_threads, wp), &
                            default_text='by blocks and free cores'), o%threads)
      call table%add(option('max_wall', 'wall-clock time after which the run stops with a checkpoint (exit 4)', &
                            unit='s', above=0.0_wp, default_text='none', applies='not to a resumed run'), o%max_wall)
      call table%add(option('checkpoint_every', 'wall-clock time between checkpoints', unit='s', above=0.0_wp, &
                            default=60.0_wp), o%checkpoint_every)
      call table%add(option('allow_open', 'boundary lines that leave a gap or bound no block are a warning; '// &
                            '.false.: an error', see='cutting.md', applies='a geometry file'), o%allow_open)
      call table%add(option('strict', 'energy from nowhere, blocks inside each other, or a static stage that ends '// &
                            'without equilibrium, ends the run (exit 3); .false.: a warning', &
                            see='theory.md#9-energy-ledger', applies='not to a resumed run'), o%strict)
      call table%locate(o%strict_origin)
   end subroutine describe_run

   !> &time.
   subroutine describe_time(table, o, p)
      type(option_rows_type), intent(inout) :: table
      type(run_options_type), intent(inout) :: o
      type(parameters_type), intent(inout) :: p
      call table%begin('time', 'Time steps.')
      call table%add(option('dt_max', 'largest time step (g1)', unit='time', quantity='largest time step (g1)', &
                            above=0.0_wp, in_analysis=.true., see='contact-numbers.md'), o%dt_max, p%dt_max)
      call table%locate(o%dt_max_origin)
      call table%add(option('dt_min', 'smallest time step', unit='time', quantity='smallest time step', above=0.0_wp, &
                            default_text='dt_max/1000 (dialect '//dda_windows//': dt_max/100)'), &
                     o%dt_min, p%dt_min)
      call table%locate(o%dt_min_origin)
      call table%add(option('k01', 'share of the velocity that the next step starts with: 0 static, 1 dynamic', &
                            least=0.0_wp, most=1.0_wp, remark='0 static, 1 dynamic', in_analysis=.true.), o%k01, p%k01)
      call table%add(option('displacement_ratio', 'largest displacement of a step over w0 (g2)', &
                            quantity='displacement ratio (g2)', above=0.0_wp, in_analysis=.true., &
                            see='contact-numbers.md'), o%displacement_ratio, p%displacement_ratio)
      call table%locate(o%ratio_origin)
      call table%add(option('length_scale', 'w0 is half of this extent of the model', choices='height|largest', &
                            default_text='height (dialect '//dda_windows//': largest)'), o%length_scale)
      call table%add_computed('w0', 'reference length w0', 'length', p%w0)
      call table%add_choice(option('rotation', 'update of positions at the end of a step', choices='exact|linear', &
                                   default_word='exact'), o%rotation, p%exact_rotation, 1)
      call table%add(option('cut_factor', 'a step that fails is repeated with its time step times this factor', &
                            quantity='factor of a cut step', above=0.0_wp, below=1.0_wp), &
                     o%cut_factor, p%cut_factor)
      call table%add(option('max_open_close', 'largest number of open-close rounds of one attempt', &
                            quantity='open-close rounds at most', least=1.0_wp, most=1000.0_wp, &
                            preset_default=8.0_wp, &
                            remark='contacts that have not settled after 1000 rounds do not settle'), &
                     o%max_open_close, p%max_open_close)
      call table%add_choice(option('integrator', 'time integration of dynamic steps (k01 = 1); others have shi', &
                                   choices='shi|generalized_alpha', default_word='shi', &
                                   default_text='shi; generalized_alpha in a file with &model', &
                                   see='theory.md#generalised-alpha-scheme'), o%integrator, p%second_order, 2)
      call table%add(option('rho_infinity', 'factor by which oscillations far too fast for the step decay in '// &
                            'each step', least=0.0_wp, most=1.0_wp, &
                            applies='integrator generalized_alpha'), &
                     o%rho_infinity, p%rho_infinity)
      call table%add(option('max_growth', 'largest static step over dt_max in a stage until equilibrium', &
                            least=1.0_wp, see='user-guide.md#stages'), &
                     o%max_growth, p%max_growth)
      call table%add_choice(option('sleep', 'blocks at rest are left out of dynamic steps until something disturbs '// &
                                   'them', choices='off|on', default_word='off', see='theory.md#blocks-asleep'), &
                            o%sleep, p%sleeps, 2)
      call table%locate(o%sleep_origin)
      call table%add(option('sleep_tolerance', 'resultant force with which a block may sleep, over the sum of '// &
                            'magnitudes of its forces; beyond twice as much it wakes', above=0.0_wp, below=1.0_wp, &
                            applies='sleep on'), &
                     o%sleep_tolerance, p%sleep_tolerance)
      call table%locate(o%sleep_tolerance_origin)
   end subroutine describe_time

   !> &contact.
   subroutine describe_contact(table, o, p)
      type(option_rows_type), intent(inout) :: table
      type(run_options_type), intent(inout) :: o
      type(parameters_type), intent(inout) :: p
      call table%begin('contact', 'Contact search, springs and tolerances.')
      call table%add_choice(option('preset', 'closing rule and tolerances of DDA for Windows', &
                                   quantity='contact preset', choices=dda_windows, old_choice=old_dda_windows, &
                                   default_text='none'), o%preset, p%windows_contacts, 1)
      call table%add_choice(option('formulation', 'a contact is a stretch of two edges that face each other, or a '// &
                                   'vertex on an edge', quantity='contact formulation', choices='length|vertex', &
                                   default_word='length', preset_word='vertex'), o%formulation, p%by_length, 1)
      call table%locate(o%formulation_origin)
      call table%add(option('points', 'no effect: a joint is integrated exactly over the part that is closed', &
                            least=3.0_wp, most=5.0_wp, default_text='none'), o%points)
      call table%locate(o%points_origin)
      call table%add(option('corner_radius', 'radius of corners over the shorter of their edges', &
                            by_length=.true., quantity='corner radius over the shorter edge', &
                            least=0.0_wp, below=0.5_wp), o%corner_radius, p%corner_radius)
      call table%locate(o%corner_radius_origin)
      call table%add(option('stiffness', 'stiffness of contact springs (g0); left out: by the blocks that meet; '// &
                            '0: twice the largest E (vertex: E, preset: 50 E)', unit='force/length', &
                            quantity='contact stiffness (g0)', least=0.0_wp, remark='0: automatic', &
                            in_analysis=.true., see='contact-numbers.md'), o%stiffness, p%normal_stiffness)
      call table%locate(o%stiffness_origin)
      call table%add_computed('stiffness_length', 'length of joint with this stiffness (0: by the blocks that meet)', &
                              'length', p%stiffness_length)
      call table%add_computed('smooth_step', 'largest step in a surface that a block slides over', 'length', &
                              p%smooth_step)
      call table%add(option('shear_ratio', 'normal over shear stiffness', above=0.0_wp, default=2.5_wp), o%shear_ratio)
      call table%add(option('sliding_damping', 'dashpot of contacts that slide in dynamic stages, fraction of '// &
                            'critical, of joints without damping_ratio', least=0.0_wp, &
                            default_text='0; 0.5 in a file with &model and contacts by length', &
                            see='theory.md#5-time-integration'), &
                     o%sliding_damping, p%sliding_damping)
      call table%add_computed('shear_stiffness', 'contact stiffness, shear', 'force/length', p%shear_stiffness)
      call table%add(option('fixed_stiffness_factor', 'stiffness of fixed points over that of contacts', &
                            above=0.0_wp, default=100.0_wp), o%fixed_stiffness_factor)
      call table%add_computed('fixed_stiffness', 'stiffness of fixed points', 'force/length', p%fixed_stiffness)
      call table%add(option('search_factor', 'search distance of contacts over g2 w0', above=0.0_wp, &
                            default=2.5_wp), o%search_factor)
      call table%add_computed('search_distance', 'contact search distance', 'length', p%search_distance)
      call table%add(option('angle_tolerance', 'largest angle of edges that count as parallel, if no bond holds them', &
                            unit='deg', least=0.0_wp, below=90.0_wp, default=3.0_wp), o%angle_tolerance)
      call table%add_computed('angle_tolerance', 'angle tolerance [rad]', '', p%angle_tolerance)
      call table%add(option('close_tolerance', 'an open contact closes beyond this penetration over w0', &
                            least=0.0_wp, below=1.0_wp, default=1.0e-12_wp, preset_default=2.0e-4_wp), &
                     o%close_tolerance)
      call table%add_computed('close_tolerance', 'closing tolerance', 'length', p%close_tolerance)
      call table%add(option('open_tolerance', 'a closed contact opens beyond this gap over w0', &
                            least=0.0_wp, below=1.0_wp, default=1.0e-12_wp, preset_default=2.0e-7_wp), &
                     o%open_tolerance)
      call table%add_computed('open_tolerance', 'opening tolerance', 'length', p%open_tolerance)
   end subroutine describe_contact

   !> &solver.
   subroutine describe_solver(table, o, p)
      type(option_rows_type), intent(inout) :: table
      type(run_options_type), intent(inout) :: o
      type(parameters_type), intent(inout) :: p
      call table%begin('solver', 'Solution of the linear equations.')
      call table%add(option('method', 'solver; auto: conjugate gradients or a direct one, whichever takes less work', &
                            quantity='solver', choices='auto|sor|pcg|cholmod|dense', default_text='auto'), &
                     o%method, p%solver_method)
      call table%add(option('preconditioner', 'preconditioner', choices='block_jacobi|ssor|block_ic0', &
                            applies='method pcg', default_text='chosen by the solver'), &
                     o%preconditioner, p%preconditioner)
      call table%add(option('tolerance', 'residual over load', quantity='solver tolerance', above=0.0_wp, &
                            below=1.0_wp, applies='methods sor and pcg'), &
                     o%tolerance, p%solver_tolerance)
      call table%add(option('omega', 'relaxation factor', quantity='SOR factor', least=1.0_wp, below=2.0_wp, &
                            in_analysis=.true., applies='method sor'), o%omega, p%sor_factor)
   end subroutine describe_solver

   !> &material, &load, &block_damping.
   subroutine describe_material(table, o, p)
      type(option_rows_type), intent(inout) :: table
      type(run_options_type), intent(inout) :: o
      type(parameters_type), intent(inout) :: p
      call table%begin('material', 'Materials as a whole.')
      call table%add_choice(option('plane', 'state of plane', choices='stress|strain', default_word='stress', &
                                   default_text='stress; strain in a file with &model'), o%plane, &
                            p%plane_strain, 2)
      call table%add_choice(option('mass', 'mass of the start, or density times the present area', &
                                   choices='initial|area', default_word='initial'), o%mass, p%mass_from_area, 2)
      call table%begin('load', 'Loads on all blocks.')
      call table%add(option('gravity', 'acceleration in -y of every block', unit='length/time^2', least=0.0_wp, &
                            remark='it acts in -y', default_text='weight/density of each material of the '// &
                            'analysis file, else 0'), o%gravity, p%gravity)
      call table%locate(o%gravity_origin)
      call table%add_file(option('base_acceleration', 'file with the acceleration of the base, see below', &
                                 columns='t, ax, ay', quantity='base acceleration'), o%base%table, o%base%file, &
                          p%base%table)
      call table%add(option('harmonic', &
                            'acceleration a sin(2 pi f (t - t0) + phase) of the base, 0 before t0, f in '// &
                            '1/time, phase in rad; may hold several terms, or be given again', &
                            columns='ax, ay, f, phase, t0', &
                            quantity='harmonic base acceleration', adds_up=.true., rule=list_rule%frequency), &
                     o%base%harmonics, p%base%harmonics)
      call table%locate(o%base%harmonics_origin)
      call table%add(option('base_stage', 'name of the stage with whose start base_acceleration, harmonic and '// &
                            '&quake begin', &
                            quantity='stage with which base motion begins', default_text='the first dynamic '// &
                            'stage in a file with &model, else time 0 of the run', not_blank=.true.), &
                     o%base%stage, p%base%stage)
      call table%locate(o%base%stage_origin)
      call table%begin('block_damping', 'Damping of all blocks.')
      call table%add(option('mass_proportional', 'damping force over mass and velocity', unit='1/time', &
                            quantity='mass-proportional damping', least=0.0_wp), &
                     o%mass_damping, p%mass_damping)
      call table%locate(o%mass_damping_origin)
   end subroutine describe_material

   !> &output.
   subroutine describe_output(table, o, p)
      type(option_rows_type), intent(inout) :: table
      type(run_options_type), intent(inout) :: o
      type(parameters_type), intent(inout) :: p
      call table%begin('output', 'What is written.')
      call table%add(option('file', 'path of the results', default_text='stem of the analysis file, or of the '// &
                            'file with &model, + .h5', not_blank=.true.), o%output_file)
      call table%add(option('frames', 'write the frames'), o%write_frames)
      call table%add(option('contacts', 'write the contacts of frames'), o%write_contacts)
      call table%add_choice(option('precision', 'reals of frames but places and times: of 64 or 32 bits', &
                                   choices='double|single', default_word='double', &
                                   see='file-formats.md#results'), o%precision, p%single_frames, 2)
      call table%add(option('energy', 'compute and write the energy balance', quantity='energy balance'), &
                     o%energy, p%energy)
   end subroutine describe_output

   !> &line_load.
   subroutine describe_line_load(table, load)
      type(option_rows_type), intent(inout) :: table
      type(line_load_type), intent(inout) :: load
      call table%add(option('name', 'name of the load, for rockdda fos; loads of one name belong together', &
                            default_text='none', see='factor-of-safety.md#load-factor'), load%name)
      call table%add_reals(option('ends', "along one block's edge", unit='length', columns='x1, y1, x2, y2', &
                            required=.true., rule=list_rule%two_points), load%ends)
      call table%add_reals(option('force_start', 'force per length at (x1, y1)', unit='force/length', &
                                  columns='fx, fy', required=.true.), load%force_start)
      call table%add_reals(option('force_end', 'force per length at (x2, y2), linear in between', unit='force/length', &
                                  columns='fx, fy', default_from='force_start'), load%force_end)
      call table%add(option('table', 'factor of the force in time, linear in between', columns='t, factor', &
                            default_text='1', rule=list_rule%rising), load%table)
   end subroutine describe_line_load

end module rockdda_model_option_table
