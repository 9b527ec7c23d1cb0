! SPDX-License-Identifier: MIT
!> Reader of run options: a namelist file with the groups and names of docs/file-formats.md.
module rockdda_io_namelist_file
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : to_string
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_model_options, only : run_options_type, stage_type, line_load_type, joint_law_type, is_set
   use rockdda_io_csv_table, only : read_csv_table
   use rockdda_io_namelist_parser, only : namelist_type, group_type, entry_type, parse_namelist, find_entry, &
                                           beside
   use rockdda_io_name_hints, only : group_hint, name_hint
   use rockdda_io_option_names, only : option_groups, names_of
   use rockdda_io_option_values, only : get_real, get_positive, get_integer, get_logical, get_text, get_choice, &
                                        get_reals, get_integers, demand
   use rockdda_io_record_reader, only : append_in_order
   use rockdda_io_source, only : source_type, read_source
   implicit none
   private
   public :: read_options_file, read_options_source

   !> More open-close rounds than this cannot be meant: a step would not end.
   integer, parameter :: most_open_close = 1000

   !> How many of the groups that may be repeated have been read.
   type :: groups_read_type
      integer :: line_loads = 0, joint_laws = 0, stages = 0
   end type groups_read_type

contains

   !> Read and check a file of run options; every problem is added to `messages`.
   subroutine read_options_file(path, options, messages)
      character(len=*), intent(in) :: path
      type(run_options_type), intent(out) :: options
      type(diagnostics_type), intent(inout) :: messages
      type(source_type) :: source
      logical :: ok
      call read_source(path, source, messages, ok)
      if (ok) call read_options_source(source, options, messages)
   end subroutine read_options_file

   !> As read_options_file, from text in memory; files it names are sought beside `source%file`.
   subroutine read_options_source(source, options, messages)
      type(source_type), intent(in) :: source
      type(run_options_type), intent(out) :: options
      type(diagnostics_type), intent(inout) :: messages
      type(diagnostics_type) :: found
      type(namelist_type) :: namelist
      type(groups_read_type) :: done
      integer :: i
      call parse_namelist(source, namelist, found)
      allocate (options%line_loads(n_groups(namelist, 'line_load')), &
                options%joint_laws(n_groups(namelist, 'joint_law')), &
                options%stages(n_groups(namelist, 'stage')))
      do i = 1, namelist%n
         call read_group(namelist, namelist%groups(i), options, done, found)
      end do
      call check_stages(namelist, options, found)
      call append_in_order(messages, found)
   end subroutine read_options_source

   !> One group.
   subroutine read_group(namelist, group, options, done, messages)
      type(namelist_type), intent(in) :: namelist
      type(group_type), intent(in) :: group
      type(run_options_type), intent(inout) :: options
      type(groups_read_type), intent(inout) :: done
      type(diagnostics_type), intent(inout) :: messages
      type(line_load_type) :: line_load
      type(joint_law_type) :: joint_law
      type(stage_type) :: stage
      integer :: i
      if (size(names_of(group%name)) == 0) then
         call messages%add(severity%error, 'unknown group &'//group%name//group_hint(group%name, option_groups), &
                           namelist%origin(group%place))
         return
      end if
      do i = 1, group%n
         associate (entry => group%entries(i))
            if (.not. any(names_of(group%name) == entry%name)) then
               call messages%add(severity%error, "unknown name '"//entry%name//"' in &"//group%name// &
                                 name_hint(entry%name, group%name, option_groups, names_of), &
                                 namelist%origin(entry%place))
               cycle
            end if
            if (is_repeated(group, i)) call messages%add(severity%warning, entry%name// &
               ': given again in the same group, the last one counts', namelist%origin(entry%place))
            select case (group%name)
            case ('run'); call read_run(namelist, entry, options, messages)
            case ('time'); call read_time(namelist, entry, options, messages)
            case ('contact'); call read_contact(namelist, entry, options, messages)
            case ('solver'); call read_solver(namelist, entry, options, messages)
            case ('load'); call read_load(namelist, entry, options, messages)
            case ('line_load'); call read_line_load(namelist, entry, line_load, messages)
            case ('joint_law'); call read_joint_law(namelist, entry, joint_law, messages)
            case ('stage'); call read_stage(namelist, entry, stage, messages)
            case default; call read_other(namelist, entry, options, messages)
            end select
         end associate
      end do
      select case (group%name)
      case ('line_load')
         call require_name(namelist, group, 'ends', messages)
         call require_name(namelist, group, 'force_start', messages)
         if (find_entry(group, 'force_end') == 0) line_load%force_end = line_load%force_start
         line_load%origin = namelist%origin(group%place)
         done%line_loads = done%line_loads + 1
         options%line_loads(done%line_loads) = line_load
      case ('joint_law')
         call require_name(namelist, group, 'material', messages)
         joint_law%origin = namelist%origin(group%place)
         done%joint_laws = done%joint_laws + 1
         options%joint_laws(done%joint_laws) = joint_law
      case ('stage')
         if (find_entry(group, 'until_step') > 0 .and. find_entry(group, 'until_time') > 0) &
            call messages%add(severity%error, &
            '&stage: give until_step or until_time, not both', namelist%origin(group%place))
         stage%origin = namelist%origin(group%place)
         done%stages = done%stages + 1
         options%stages(done%stages) = stage
      end select
   end subroutine read_group

   !> Number of groups of one name.
   pure integer function n_groups(namelist, name)
      type(namelist_type), intent(in) :: namelist
      character(len=*), intent(in) :: name
      integer :: i
      n_groups = 0
      do i = 1, namelist%n
         if (namelist%groups(i)%name == name) n_groups = n_groups + 1
      end do
   end function n_groups

   !> Was entry i's name given before in the group? (`harmonic` may be repeated.)
   pure logical function is_repeated(group, i)
      type(group_type), intent(in) :: group
      integer, intent(in) :: i
      integer :: k
      is_repeated = .false.
      if (group%entries(i)%name == 'harmonic') return
      do k = 1, i - 1
         if (group%entries(k)%name == group%entries(i)%name) is_repeated = .true.
      end do
   end function is_repeated

   !> An error when the group lacks a name.
   subroutine require_name(namelist, group, name, messages)
      type(namelist_type), intent(in) :: namelist
      type(group_type), intent(in) :: group
      character(len=*), intent(in) :: name
      type(diagnostics_type), intent(inout) :: messages
      if (find_entry(group, name) == 0) call messages%add(severity%error, '&'//group%name//": '"//name// &
                                                         "' is missing", namelist%origin(group%place))
   end subroutine require_name

   !> &run
   subroutine read_run(namelist, entry, options, messages)
      type(namelist_type), intent(in) :: namelist
      type(entry_type), intent(in) :: entry
      type(run_options_type), intent(inout) :: options
      type(diagnostics_type), intent(inout) :: messages
      select case (entry%name)
      case ('title'); call get_text(namelist, entry, options%title, messages)
      case ('steps'); call get_integer(namelist, entry, 0, options%steps, messages)
      case ('t_end'); call get_positive(namelist, entry, options%t_end, messages)
      case ('save_every'); call get_integer(namelist, entry, 1, options%save_every, messages)
      case ('save_dt'); call get_positive(namelist, entry, options%save_dt, messages)
      case ('threads'); call get_integer(namelist, entry, 1, options%threads, messages)
      case ('max_wall'); call get_positive(namelist, entry, options%max_wall, messages)
      case ('checkpoint_every'); call get_positive(namelist, entry, options%checkpoint_every, messages)
      case ('strict'); call get_logical(namelist, entry, options%strict, messages)
      end select
   end subroutine read_run

   !> &time
   subroutine read_time(namelist, entry, options, messages)
      type(namelist_type), intent(in) :: namelist
      type(entry_type), intent(in) :: entry
      type(run_options_type), intent(inout) :: options
      type(diagnostics_type), intent(inout) :: messages
      select case (entry%name)
      case ('dt_max'); call get_positive(namelist, entry, options%dt_max, messages)
      case ('dt_min')
         call get_positive(namelist, entry, options%dt_min, messages)
         options%dt_min_origin = namelist%origin(entry%place)
      case ('k01'); call get_k01(namelist, entry, options%k01, messages)
      case ('displacement_ratio'); call get_positive(namelist, entry, options%displacement_ratio, messages)
      case ('length_scale')
         call get_choice(namelist, entry, [character(len=7) :: 'height', 'largest'], options%length_scale, messages)
      case ('rotation')
         call get_choice(namelist, entry, [character(len=6) :: 'exact', 'linear'], options%rotation, messages)
      case ('cut_factor')
         call get_positive(namelist, entry, options%cut_factor, messages)
         call demand(namelist, entry, options%cut_factor < 1, 'must be less than 1', messages)
      case ('max_open_close')
         call get_integer(namelist, entry, 1, options%max_open_close, messages)
         if (is_set(options%max_open_close)) call demand(namelist, entry, options%max_open_close <= most_open_close, &
            'must be at most '//to_string(most_open_close)//': contacts that do not settle by then never do', messages)
      end select
   end subroutine read_time

   !> &contact
   subroutine read_contact(namelist, entry, options, messages)
      type(namelist_type), intent(in) :: namelist
      type(entry_type), intent(in) :: entry
      type(run_options_type), intent(inout) :: options
      type(diagnostics_type), intent(inout) :: messages
      select case (entry%name)
      case ('stiffness')
         call get_real(namelist, entry, options%stiffness, messages)
         if (is_set(options%stiffness)) call demand(namelist, entry, options%stiffness >= 0, &
                                                    'must not be negative (0: automatic)', messages)
      case ('shear_ratio'); call get_positive(namelist, entry, options%shear_ratio, messages)
      case ('search_factor'); call get_positive(namelist, entry, options%search_factor, messages)
      case ('angle_tolerance')
         call get_real(namelist, entry, options%angle_tolerance, messages)
         if (is_set(options%angle_tolerance)) call demand(namelist, entry, options%angle_tolerance >= 0 .and. &
            options%angle_tolerance < 90, 'must be at least 0 and less than 90 degrees', messages)
      case ('close_tolerance')
         call get_real(namelist, entry, options%close_tolerance, messages)
         call demand_tolerance(options%close_tolerance)
      case ('open_tolerance')
         call get_real(namelist, entry, options%open_tolerance, messages)
         call demand_tolerance(options%open_tolerance)
      case ('fixed_stiffness_factor'); call get_positive(namelist, entry, options%fixed_stiffness_factor, messages)
      case ('preset'); call get_choice(namelist, entry, ['peer'], options%preset, messages)
      end select

   contains

      !> A share of half the model's height: zero or below one.
      subroutine demand_tolerance(value)
         real(wp), intent(in) :: value
         if (is_set(value)) call demand(namelist, entry, value >= 0 .and. value < 1, &
                                        'must be at least 0 and less than 1', messages)
      end subroutine demand_tolerance
   end subroutine read_contact

   !> &solver
   subroutine read_solver(namelist, entry, options, messages)
      type(namelist_type), intent(in) :: namelist
      type(entry_type), intent(in) :: entry
      type(run_options_type), intent(inout) :: options
      type(diagnostics_type), intent(inout) :: messages
      select case (entry%name)
      case ('method')
         call get_choice(namelist, entry, [character(len=7) :: 'auto', 'sor', 'pcg', 'cholmod', 'dense'], &
                         options%method, messages)
      case ('tolerance')
         call get_positive(namelist, entry, options%tolerance, messages)
         call demand(namelist, entry, options%tolerance < 1, 'must be less than 1', messages)
      case ('omega')
         call get_real(namelist, entry, options%omega, messages)
         if (is_set(options%omega)) call demand(namelist, entry, options%omega >= 1 .and. options%omega < 2, &
                                                'must be at least 1 and less than 2', messages)
      case ('preconditioner')
         call get_choice(namelist, entry, [character(len=12) :: 'block_jacobi', 'ssor', 'block_ic0'], &
                         options%preconditioner, messages)
      end select
   end subroutine read_solver

   !> &load
   subroutine read_load(namelist, entry, options, messages)
      type(namelist_type), intent(in) :: namelist
      type(entry_type), intent(in) :: entry
      type(run_options_type), intent(inout) :: options
      type(diagnostics_type), intent(inout) :: messages
      character(len=:), allocatable :: file
      real(wp), allocatable :: values(:), terms(:, :)
      integer :: n
      select case (entry%name)
      case ('gravity')
         call get_real(namelist, entry, options%gravity, messages)
         if (is_set(options%gravity)) call demand(namelist, entry, options%gravity >= 0, &
                                                  'must not be negative (it acts in -y)', messages)
      case ('base_acceleration')
         call get_text(namelist, entry, file, messages)
         if (.not. allocated(file)) return
         call demand(namelist, entry, len_trim(file) > 0, 'must name a file', messages)
         if (len_trim(file) > 0) call read_csv_table(beside(namelist%source%file, trim(file)), &
            [character(len=2) :: 't', 'ax', 'ay'], options%base%table, messages)
      case ('harmonic')
         call get_reals(namelist, entry, 5, .true., values, messages)
         if (.not. allocated(values)) return
         n = 0
         if (allocated(options%base%harmonics)) n = size(options%base%harmonics, 2)
         allocate (terms(5, n + size(values)/5))
         if (n > 0) terms(:, 1:n) = options%base%harmonics
         terms(:, n + 1:) = reshape(values, [5, size(values)/5])
         call demand(namelist, entry, all(terms(3, n + 1:) >= 0), 'the frequency must not be negative', messages)
         call move_alloc(terms, options%base%harmonics)
      end select
   end subroutine read_load

   !> &line_load
   subroutine read_line_load(namelist, entry, line_load, messages)
      type(namelist_type), intent(in) :: namelist
      type(entry_type), intent(in) :: entry
      type(line_load_type), intent(inout) :: line_load
      type(diagnostics_type), intent(inout) :: messages
      real(wp), allocatable :: values(:)
      select case (entry%name)
      case ('ends')
         call get_reals(namelist, entry, 4, .false., values, messages)
         if (.not. allocated(values)) return
         line_load%ends = values
         call demand(namelist, entry, abs(values(1) - values(3)) > 0 .or. abs(values(2) - values(4)) > 0, &
                     'the two ends must differ', messages)
      case ('force_start')
         call get_reals(namelist, entry, 2, .false., values, messages)
         if (allocated(values)) line_load%force_start = values
      case ('force_end')
         call get_reals(namelist, entry, 2, .false., values, messages)
         if (allocated(values)) line_load%force_end = values
      case ('table')
         call get_reals(namelist, entry, 2, .true., values, messages)
         if (.not. allocated(values)) return
         line_load%table = reshape(values, [2, size(values)/2])
         associate (t => line_load%table(1, :))
            call demand(namelist, entry, all(t(2:) >= t(:size(t) - 1)), 'the times must not decrease', messages)
         end associate
      end select
   end subroutine read_line_load

   !> &joint_law
   subroutine read_joint_law(namelist, entry, joint_law, messages)
      type(namelist_type), intent(in) :: namelist
      type(entry_type), intent(in) :: entry
      type(joint_law_type), intent(inout) :: joint_law
      type(diagnostics_type), intent(inout) :: messages
      select case (entry%name)
      case ('material'); call get_integer(namelist, entry, 1, joint_law%material, messages)
      case ('law')
         call get_choice(namelist, entry, [character(len=12) :: 'coulomb', 'velocity', 'displacement'], &
                         joint_law%law, messages)
      case ('parameters'); call get_reals(namelist, entry, 1, .true., joint_law%parameters, messages)
      case ('damping_ratio')
         call get_real(namelist, entry, joint_law%damping_ratio, messages)
         call demand(namelist, entry, joint_law%damping_ratio >= 0, 'must not be negative', messages)
      end select
   end subroutine read_joint_law

   !> &stage
   subroutine read_stage(namelist, entry, stage, messages)
      type(namelist_type), intent(in) :: namelist
      type(entry_type), intent(in) :: entry
      type(stage_type), intent(inout) :: stage
      type(diagnostics_type), intent(inout) :: messages
      select case (entry%name)
      case ('until_step'); call get_integer(namelist, entry, 1, stage%until_step, messages)
      case ('until_time'); call get_positive(namelist, entry, stage%until_time, messages)
      case ('k01'); call get_k01(namelist, entry, stage%k01, messages)
      case ('gravity'); call get_real(namelist, entry, stage%gravity, messages)
      case ('release'); call get_integers(namelist, entry, 1, stage%release, messages)
      end select
   end subroutine read_stage

   !> &material, &block_damping, &output
   subroutine read_other(namelist, entry, options, messages)
      type(namelist_type), intent(in) :: namelist
      type(entry_type), intent(in) :: entry
      type(run_options_type), intent(inout) :: options
      type(diagnostics_type), intent(inout) :: messages
      select case (entry%name)
      case ('plane')
         call get_choice(namelist, entry, [character(len=6) :: 'stress', 'strain'], options%plane, messages)
      case ('mass')
         call get_choice(namelist, entry, [character(len=7) :: 'initial', 'area'], options%mass, messages)
      case ('mass_proportional')
         call get_real(namelist, entry, options%mass_damping, messages)
         if (is_set(options%mass_damping)) call demand(namelist, entry, options%mass_damping >= 0, &
                                                       'must not be negative', messages)
      case ('file'); call get_text(namelist, entry, options%output_file, messages)
      case ('frames'); call get_logical(namelist, entry, options%write_frames, messages)
      case ('contacts'); call get_logical(namelist, entry, options%write_contacts, messages)
      end select
   end subroutine read_other

   !> A number between 0 and 1.
   subroutine get_k01(namelist, entry, value, messages)
      type(namelist_type), intent(in) :: namelist
      type(entry_type), intent(in) :: entry
      real(wp), intent(inout) :: value
      type(diagnostics_type), intent(inout) :: messages
      call get_real(namelist, entry, value, messages)
      if (is_set(value)) call demand(namelist, entry, value >= 0 .and. value <= 1, &
                                     'must be between 0 (static) and 1 (dynamic)', messages)
   end subroutine get_k01

   !> Every stage but the last must end, and later than the one before it.
   subroutine check_stages(namelist, options, messages)
      type(namelist_type), intent(in) :: namelist
      type(run_options_type), intent(in) :: options
      type(diagnostics_type), intent(inout) :: messages
      type(origin_type) :: origin
      integer :: i, k, last_step
      real(wp) :: last_time
      last_step = 0
      last_time = 0
      k = 0
      do i = 1, namelist%n
         if (namelist%groups(i)%name /= 'stage') cycle
         k = k + 1
         origin = namelist%origin(namelist%groups(i)%place)
         associate (stage => options%stages(k))
            if (is_set(stage%until_step)) then
               if (stage%until_step <= last_step) call messages%add(severity%error, '&stage '//to_string(k)// &
                  ': must end later than the stage before it', origin)
               last_step = stage%until_step
            else if (is_set(stage%until_time)) then
               if (stage%until_time <= last_time) call messages%add(severity%error, '&stage '//to_string(k)// &
                  ': must end later than the stage before it', origin)
               last_time = stage%until_time
            else if (k < size(options%stages)) then
               call messages%add(severity%error, '&stage '//to_string(k)// &
                                 ': until_step or until_time is missing (only the last stage may go on)', origin)
            end if
         end associate
      end do
   end subroutine check_stages

end module rockdda_io_namelist_file
