! SPDX-License-Identifier: MIT
!> The table of options: all that an options file may hold. A new option is one row here, its component in
!> rockdda_model_options and, when the run keeps it under a name of its own, in rockdda_model_parameters. Reader,
!> hints, defaults, log, checkpoint, documents and schema follow from the row.
module rockdda_model_option_table
   use rockdda_base_kinds, only : wp
   use rockdda_model_analysis_input, only : joint_material_type, unset_joint_material
   use rockdda_model_material_options, only : describe_model, describe_block_materials, describe_point_tables
   use rockdda_model_options, only : run_options_type, stage_type, change_type, line_load_type, &
      dda_windows, old_dda_windows, most_threads
   use rockdda_model_boundary_options, only : describe_boundaries
   use rockdda_model_quake_options, only : describe_quakes
   use rockdda_model_region_options, only : describe_regions
   use rockdda_model_water_options, only : describe_water
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_option, only : option_visitor_type, option, list_rule
   use rockdda_model_stage_options, only : describe_stage, describe_new_values
   implicit none
   private
   public :: describe_options, describe_settings, describe_lists, describe_changes

contains

   !> Visit the whole table, bound to these options and parameters.
   subroutine describe_options(table, options, parameters)
      class(option_visitor_type), intent(inout) :: table
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
   end subroutine describe_options

   !> Visit the groups that are not lists.
   subroutine describe_settings(table, options, parameters)
      class(option_visitor_type), intent(inout) :: table
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
      class(option_visitor_type), intent(inout) :: table
      type(line_load_type), allocatable, intent(inout) :: line_loads(:)
      type(joint_material_type), allocatable, intent(inout) :: joint_materials(:)
      type(stage_type), allocatable, intent(inout) :: stages(:)
      integer :: i, n
      if (.not. allocated(line_loads)) allocate (line_loads(0))
      if (.not. allocated(stages)) allocate (stages(0))

      call table%begin('line_load', 'A force along one edge of a block.', is_list=.true.)
      n = size(line_loads)
      call table%resize(n)
      if (n /= size(line_loads)) deallocate (line_loads)
      if (.not. allocated(line_loads)) allocate (line_loads(n))
      do i = 1, n
         call table%start_element(i, line_loads(i)%origin)
         call describe_line_load(table, line_loads(i))
      end do

      call table%begin('joint_material', 'A joint material: changes what it names of one of the analysis file, or '// &
                       'adds one.', is_list=.true.)
      call resize_joints(table, joint_materials)
      do i = 1, size(joint_materials)
         call table%start_element(i, joint_materials(i)%origin)
         call table%add(option('number', 'number of the joint material; beside an analysis file the next free '// &
                               'one adds a material', least=1.0_wp, most=999.0_wp, required=.true.), &
                        joint_materials(i)%number)
         call describe_joint(table, joint_materials(i))
      end do

      call table%begin('stage', 'One part of the run; stages follow one another in the order of the file.', &
                       is_list=.true.)
      n = size(stages)
      call table%resize(n)
      if (n /= size(stages)) deallocate (stages)
      if (.not. allocated(stages)) allocate (stages(n))
      do i = 1, n
         call table%start_element(i, stages(i)%origin)
         call describe_stage(table, stages(i))
      end do
   end subroutine describe_lists

   !> &change
   subroutine describe_changes(table, changes)
      class(option_visitor_type), intent(inout) :: table
      type(change_type), allocatable, intent(inout) :: changes(:)
      type(change_type), allocatable :: more(:)
      integer :: i, n, kept
      if (.not. allocated(changes)) allocate (changes(0))
      call table%begin('change', 'New values from the start of a stage on: of a joint material, of a block '// &
                       'material, or of the blocks of regions.', is_list=.true.)
      n = size(changes)
      call table%resize(n)
      allocate (more(n))
      kept = min(n, size(changes))
      more(1:kept) = changes(1:kept)
      do i = kept + 1, n
         more(i)%joint = unset_joint_material()
      end do
      call move_alloc(more, changes)
      do i = 1, n
         call table%start_element(i, changes(i)%origin)
         call describe_new_values(table, changes(i))
         call describe_joint(table, changes(i)%joint)
      end do
   end subroutine describe_changes

   !> The groups that change joint materials of the analysis file.
   subroutine describe_joint_laws(table, joint_laws)
      class(option_visitor_type), intent(inout) :: table
      type(joint_material_type), allocatable, intent(inout) :: joint_laws(:)
      integer :: i
      call table%begin('joint_law', 'Law of one joint material: as joint_material, for a material that there is.', &
                       is_list=.true.)
      call resize_joints(table, joint_laws)
      do i = 1, size(joint_laws)
         call table%start_element(i, joint_laws(i)%origin)
         call table%add(option('material', 'number or name of the joint material', required=.true., &
                               or_number=.true.), joint_laws(i)%word)
         call describe_joint(table, joint_laws(i))
      end do
   end subroutine describe_joint_laws

   !> As many joint materials as the visitor wants; of new ones nothing is given.
   subroutine resize_joints(table, joints)
      class(option_visitor_type), intent(inout) :: table
      type(joint_material_type), allocatable, intent(inout) :: joints(:)
      type(joint_material_type), allocatable :: more(:)
      integer :: n, i
      if (.not. allocated(joints)) allocate (joints(0))
      n = size(joints)
      call table%resize(n)
      if (n == size(joints)) return
      allocate (more(n))
      do i = 1, n
         if (i <= size(joints)) more(i) = joints(i)
         if (i > size(joints)) more(i) = unset_joint_material()
      end do
      call move_alloc(more, joints)
   end subroutine resize_joints

   !> &run
   subroutine describe_run(table, o, p)
      class(option_visitor_type), intent(inout) :: table
      type(run_options_type), intent(inout) :: o
      type(parameters_type), intent(inout) :: p
      call table%begin('run', 'Extent of the run, and what it takes of the machine.')
      call table%add(option('title', 'title of the results', default_text='that of &model, else the stem of the '// &
                            'analysis file or of the file with &model'), o%title, p%title)
      call table%add(option('steps', 'number of time steps', quantity='number of steps', least=0.0_wp, &
                            in_analysis=.true.), o%steps, p%n_steps)
      call table%add(option('t_end', 'end time; the last step is shortened to end there', unit='time', &
                            quantity='end time', above=0.0_wp, default_text='none'), o%t_end, p%t_end)
      call table%add(option('save_every', 'a frame every so many steps', least=1.0_wp, &
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
   end subroutine describe_run

   !> Visit &time.
   subroutine describe_time(table, o, p)
      class(option_visitor_type), intent(inout) :: table
      type(run_options_type), intent(inout) :: o
      type(parameters_type), intent(inout) :: p
      call table%begin('time', 'Time steps.')
      call table%add(option('dt_max', 'largest time step (g1)', unit='time', quantity='largest time step (g1)', &
                            above=0.0_wp, in_analysis=.true., see='contact-numbers.md'), o%dt_max, p%dt_max)
      call table%add(option('dt_min', 'smallest time step', unit='time', quantity='smallest time step', above=0.0_wp, &
                            default_text='dt_max/1000 (dialect '//dda_windows//': dt_max/100)'), &
                     o%dt_min, p%dt_min, o%dt_min_origin)
      call table%add(option('k01', 'share of the velocity that the next step starts with: 0 static, 1 dynamic', &
                            least=0.0_wp, most=1.0_wp, remark='0 static, 1 dynamic', in_analysis=.true.), o%k01, p%k01)
      call table%add(option('displacement_ratio', 'largest displacement of a step over w0 (g2)', &
                            quantity='displacement ratio (g2)', above=0.0_wp, in_analysis=.true., &
                            see='contact-numbers.md'), o%displacement_ratio, p%displacement_ratio)
      call table%add(option('length_scale', 'w0 is half of this extent of the model', choices='height|largest', &
                            default_text='height (dialect '//dda_windows//': largest)'), o%length_scale)
      call table%used('reference length w0', p%w0, 'w0')
      call table%add_choice(option('rotation', 'update of positions at the end of a step', choices='exact|linear', &
                                   default_word='exact'), o%rotation, p%exact_rotation, 1)
      call table%add(option('cut_factor', 'a step that fails is repeated with its time step times this factor', &
                            quantity='factor of a cut step', above=0.0_wp, below=1.0_wp, default=0.3_wp), &
                     o%cut_factor, p%cut_factor)
      call table%add(option('max_open_close', 'largest number of open-close rounds of one attempt', &
                            quantity='open-close rounds at most', least=1.0_wp, most=1000.0_wp, default=20.0_wp, &
                            preset_default=8.0_wp, &
                            remark='contacts that have not settled after 1000 rounds do not settle'), &
                     o%max_open_close, p%max_open_close)
      call table%add_choice(option('integrator', 'time integration of dynamic steps (k01 = 1); others have shi', &
                                   choices='shi|generalized_alpha', default_word='shi', &
                                   default_text='shi; generalized_alpha in a file with &model', &
                                   see='theory.md#generalised-alpha-scheme'), o%integrator, p%second_order, 2)
      call table%add(option('rho_infinity', 'factor by which oscillations far too fast for the step decay in '// &
                            'each step', least=0.0_wp, most=1.0_wp, default=0.8_wp, &
                            applies='integrator generalized_alpha'), &
                     o%rho_infinity, p%rho_infinity)
      call table%add(option('max_growth', 'largest static step over dt_max in a stage until equilibrium', &
                            least=1.0_wp, default=1000.0_wp, see='user-guide.md#stages'), &
                     o%max_growth, p%max_growth)
      call table%add(option('accuracy', 'wanted error of dynamic steps in time over the largest displacement: they '// &
                            'grow and shrink by its estimate, which misses some 1e-4 where friction turns or '// &
                            'loads are sudden', least=1.0e-6_wp, most=0.1_wp, &
                            default_text='none: steps up to dt_max', see='user-guide.md#accuracy-in-time'), &
                     o%accuracy, p%accuracy, o%accuracy_origin)
      call table%used('longest step with accuracy', p%dt_bound, 'dt_bound')
      call table%add_choice(option('sleep', 'blocks at rest are left out of dynamic steps until something disturbs '// &
                                   'them', choices='off|on', default_word='off', see='theory.md#blocks-asleep'), &
                            o%sleep, p%sleeps, 2)
      call table%add(option('sleep_tolerance', 'resultant force with which a block may sleep, over the sum of '// &
                            'magnitudes of its forces; beyond twice as much it wakes', above=0.0_wp, below=1.0_wp, &
                            default=1.0e-3_wp, applies='sleep on'), &
                     o%sleep_tolerance, p%sleep_tolerance)
   end subroutine describe_time

   !> Visit &contact.
   subroutine describe_contact(table, o, p)
      class(option_visitor_type), intent(inout) :: table
      type(run_options_type), intent(inout) :: o
      type(parameters_type), intent(inout) :: p
      call table%begin('contact', 'Contact search, springs and tolerances.')
      call table%add_choice(option('preset', 'closing rule and tolerances of DDA for Windows', &
                                   quantity='contact preset', choices=dda_windows, old_choice=old_dda_windows, &
                                   default_text='none'), o%preset, p%peer_contacts, 1)
      call table%add_choice(option('formulation', 'a contact is a stretch of two edges that face each other, or a '// &
                                   'vertex on an edge', quantity='contact formulation', choices='length|vertex', &
                                   default_word='length', preset_word='vertex'), o%formulation, p%by_length, 1)
      call table%locate(o%formulation_origin)
      call table%add(option('points', 'no effect: a joint is integrated exactly over the part that is closed', &
                            least=3.0_wp, most=5.0_wp, default_text='none'), o%points)
      call table%locate(o%points_origin)
      call table%add(option('corner_radius', 'radius of corners over the shorter of their edges', &
                            applies='formulation length', quantity='corner radius over the shorter edge', &
                            least=0.0_wp, below=0.5_wp, default=0.01_wp), o%corner_radius, p%corner_radius)
      call table%locate(o%corner_radius_origin)
      call table%add(option('stiffness', 'stiffness of contact springs (g0); left out: by the blocks that meet; '// &
                            '0: twice the largest E (vertex: E, preset: 50 E)', unit='force/length', &
                            quantity='contact stiffness (g0)', least=0.0_wp, remark='0: automatic', &
                            in_analysis=.true., see='contact-numbers.md'), o%stiffness, p%normal_stiffness)
      call table%used('length of joint with this stiffness (0: by the blocks that meet)', p%stiffness_length, &
                      'stiffness_length')
      call table%used('largest step in a surface that a block slides over', p%smooth_step, 'smooth_step')
      call table%add(option('shear_ratio', 'normal over shear stiffness', above=0.0_wp, default=2.5_wp), o%shear_ratio)
      call table%add(option('sliding_damping', 'dashpot of contacts that slide in dynamic stages, fraction of '// &
                            'critical, of joints without damping_ratio', least=0.0_wp, default=0.0_wp, &
                            remark='labelled files with contact by length: 0.5', see='theory.md#5-time-integration'), &
                     o%sliding_damping, p%sliding_damping)
      call table%used('contact stiffness, shear', p%shear_stiffness, 'shear_stiffness')
      call table%add(option('fixed_stiffness_factor', 'stiffness of fixed points over that of contacts', &
                            above=0.0_wp, default=100.0_wp), o%fixed_stiffness_factor)
      call table%used('stiffness of fixed points', p%fixed_stiffness, 'fixed_stiffness')
      call table%add(option('search_factor', 'search distance of contacts over g2 w0', above=0.0_wp, &
                            default=2.5_wp), o%search_factor)
      call table%used('contact search distance', p%search_distance, 'search_distance')
      call table%add(option('angle_tolerance', 'largest angle of edges that count as parallel, if no bond holds them', &
                            unit='deg', least=0.0_wp, below=90.0_wp, default=3.0_wp), o%angle_tolerance)
      call table%used('angle tolerance [rad]', p%angle_tolerance)
      call table%add(option('close_tolerance', 'an open contact closes beyond this penetration over w0', &
                            least=0.0_wp, below=1.0_wp, default=1.0e-12_wp, preset_default=2.0e-4_wp), &
                     o%close_tolerance)
      call table%used('closing tolerance', p%close_tolerance)
      call table%add(option('open_tolerance', 'a closed contact opens beyond this gap over w0', &
                            least=0.0_wp, below=1.0_wp, default=1.0e-12_wp, preset_default=2.0e-7_wp), &
                     o%open_tolerance)
      call table%used('opening tolerance', p%open_tolerance)
   end subroutine describe_contact

   !> Visit &solver.
   subroutine describe_solver(table, o, p)
      class(option_visitor_type), intent(inout) :: table
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
                            below=1.0_wp, default=1.0e-10_wp, applies='methods sor and pcg'), &
                     o%tolerance, p%solver_tolerance)
      call table%add(option('omega', 'relaxation factor', quantity='SOR factor', least=1.0_wp, below=2.0_wp, &
                            in_analysis=.true., applies='method sor'), o%omega, p%sor_factor)
   end subroutine describe_solver

   !> Visit &material, &load, &block_damping.
   subroutine describe_material(table, o, p)
      class(option_visitor_type), intent(inout) :: table
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
      call table%add_file(option('base_acceleration', 'file with the acceleration of the base, see below', &
                                 columns='t, ax, ay', quantity='base acceleration'), o%base%table, p%base%table, &
                          o%base%file)
      call table%add(option('harmonic', &
                            'acceleration a sin(2 pi f (t - t0) + phase) of the base, 0 before t0, f in '// &
                            '1/time, phase in rad; may hold several terms, or be given again', &
                            columns='ax, ay, f, phase, t0', &
                            quantity='harmonic base acceleration', adds_up=.true., rule=list_rule%frequency), &
                     o%base%harmonics, p%base%harmonics)
      call table%add(option('base_stage', 'name of the stage with whose start base_acceleration, harmonic and '// &
                            '&quake begin', &
                            quantity='stage with which base motion begins', default_text='the first dynamic '// &
                            'stage in a file with &model, else time 0 of the run', not_blank=.true.), &
                     o%base%stage, p%base%stage)
      call table%locate(o%base%stage_origin)
      call table%begin('block_damping', 'Damping of all blocks.')
      call table%add(option('mass_proportional', 'damping force over mass and velocity', unit='1/time', &
                            quantity='mass-proportional damping', least=0.0_wp, default=0.0_wp), &
                     o%mass_damping, p%mass_damping)
   end subroutine describe_material

   !> Visit &output.
   subroutine describe_output(table, o, p)
      class(option_visitor_type), intent(inout) :: table
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

   !> Visit &line_load.
   subroutine describe_line_load(table, load)
      class(option_visitor_type), intent(inout) :: table
      type(line_load_type), intent(inout) :: load
      call table%add(option('name', 'name of the load, for rockdda fos; loads of one name belong together', &
                            default_text='none', see='factor-of-safety.md#load-factor'), load%name)
      call table%add_reals(option('ends', "along one block's edge", unit='length', columns='x1, y1, x2, y2', &
                            required=.true., rule=list_rule%two_points), load%ends)
      call table%add_reals(option('force_start', 'force per length at (x1, y1)', unit='force/length', &
                                  columns='fx, fy', required=.true.), load%force_start)
      call table%add_reals(option('force_end', 'force per length at (x2, y2), linear in between', unit='force/length', &
                            columns='fx, fy', default_text='force_start'), load%force_end, otherwise=load%force_start)
      call table%add(option('table', 'factor of the force in time, linear in between', columns='t, factor', &
                            default_text='1', rule=list_rule%rising), load%table)
   end subroutine describe_line_load

   !> &joint_material and &joint_law but the number. What is not given stays as it is, so that no row has a constant
   !> default.
   subroutine describe_joint(table, m)
      class(option_visitor_type), intent(inout) :: table
      type(joint_material_type), intent(inout) :: m
      character(len=*), parameter :: stays = 'as it is, else 0', laws = 'theory.md#6-contacts'
      call table%add(option('name', 'name of the material', default_text='none'), m%name)
      call table%add(option('friction', 'friction angle, of the peak where a law weakens it', unit='deg', &
                            least=0.0_wp, below=90.0_wp, &
                            default_text='as it is; an added material needs it, but with barton_bandis'), &
                     m%friction_angle)
      call table%add(option('cohesion', 'shear strength without normal stress', unit='stress', least=0.0_wp, &
                            default_text=stays), m%cohesion)
      call table%add(option('tension', 'tensile strength', unit='stress', least=0.0_wp, default_text=stays, &
                            applies='needs cohesion'), m%tension)
      call table%add(option('normal_stiffness', 'normal stiffness per length', unit='stress/length', above=0.0_wp, &
                            default_text='from the contact stiffness', applies='formulation length'), &
                     m%normal_stiffness)
      call table%add(option('shear_stiffness', 'shear stiffness per length', unit='stress/length', above=0.0_wp, &
                            default_text='from the contact stiffness', applies='formulation length'), &
                     m%shear_stiffness)
      call table%add(option('law', 'law of the strength', &
                            choices='coulomb|velocity|displacement|residual|barton_bandis', &
                            default_text='as it is, else coulomb', see=laws), m%law)
      call table%add(option('parameters', 'parameters of law velocity (friction angle at high rates, slip_rate) or '// &
                            'displacement (residual_friction, slip_length), instead of their names', &
                            default_text='none'), m%parameters)
      call table%add(option('residual_friction', 'friction angle after slip (laws displacement, residual), at high '// &
                            'rates (velocity), of flat surfaces (barton_bandis)', unit='deg', least=0.0_wp, &
                            below=90.0_wp, default_text='residual: friction; else the law needs it', see=laws), &
                     m%residual_friction)
      call table%add(option('residual_cohesion', 'cohesion after slip', unit='stress', least=0.0_wp, &
                            default_text='0', applies='law residual', see=laws), m%residual_cohesion)
      call table%add(option('residual_tension', 'tensile strength after slip', unit='stress', least=0.0_wp, &
                            default_text='0', applies='law residual', see=laws), m%residual_tension)
      call table%add(option('slip_length', 'slip from peak to residual strength', unit='length', above=0.0_wp, &
                            default_text='a law that weakens needs it', applies='laws displacement, residual', &
                            see=laws), m%slip_length)
      call table%add(option('slip_rate', 'rate at which friction has come down to 1/e of its fall', &
                            unit='length/time', above=0.0_wp, default_text='the law needs it', &
                            applies='law velocity', see=laws), m%slip_rate)
      call table%add(option('jrc', 'joint roughness coefficient', least=0.0_wp, default_text='the law needs it', &
                            applies='law barton_bandis', see=laws), m%jrc)
      call table%add(option('jcs', 'compressive strength of the joint walls', unit='stress', above=0.0_wp, &
                            default_text='the law needs it', applies='law barton_bandis', see=laws), m%jcs)
      call table%add(option('dilation', 'angle at which a joint that slips opens', unit='deg', least=0.0_wp, &
                            below=90.0_wp, default_text=stays, see=laws), m%dilation)
      call table%add(option('dilation_slip', 'slip beyond which a joint dilates no more', unit='length', least=0.0_wp, &
                            default_text='none', see=laws), m%dilation_slip)
      call table%add(option('damping_ratio', 'dashpot of closed contacts, fraction of critical', least=0.0_wp, &
                            default_text=stays), m%damping_ratio)
      call table%add(option('restitution', 'speed after an impact over the speed before it, along the normal', &
                            least=0.0_wp, most=1.0_wp, default_text='none: what springs and time step give', &
                            see=laws), m%restitution)
      call table%add(option('brittle', 'cohesion and tension are lost at first slip or opening; .false.: they stay', &
                            default_text='.true.; .false. in a file with &model', see=laws), m%brittle, &
                     is_given=m%brittle_given)
      call table%add(option('tie', 'both sides deform as one body until the strength is reached; .false.: a joint', &
                            applies='formulation length'), m%tie, is_given=m%tie_given)
   end subroutine describe_joint

end module rockdda_model_option_table
