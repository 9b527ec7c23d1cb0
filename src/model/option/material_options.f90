! SPDX-License-Identifier: MIT
!> The part of the table of options that makes an options file a whole model: `&model`, `&block_material`, and the time
!> tables of points, `&fixed_point` and `&loading_point`. What the groups say of block materials is put together here.
module rockdda_model_material_options
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_base_strings, only : counted, to_string
   use rockdda_model_analysis_input, only : block_material_type, time_table_type, unset_block_material
   use rockdda_model_material_names, only : most_number, described_materials, check_material_names
   use rockdda_model_option, only : option, list_rule
   use rockdda_model_option_rows, only : option_rows_type
   use rockdda_model_options, only : run_options_type, point_table_type, is_set
   implicit none
   private
   public :: describe_model, describe_block_materials, describe_point_tables
   public :: friction_option
   public :: take_block_options, take_point_tables

   !> Name of the friction of a joint material in the options.
   character(len=*), parameter :: friction_option = 'friction'

contains

   !> &model
   subroutine describe_model(table, o)
      type(option_rows_type), intent(inout) :: table
      type(run_options_type), intent(inout) :: o
      call table%begin('model', 'A labelled file: a whole model but its lines or blocks. It is run by itself.')
      call table%add(option('geometry', 'geometry or block file, relative to the folder of this file', &
                            required=.true., not_blank=.true.), o%geometry)
      call table%locate(o%geometry_origin)
      call table%add(option('analysis', 'analysis file, relative to the folder of this file, which wins', &
                            default_text='none'), o%analysis)
      call table%locate(o%analysis_origin)
      call table%add(option('title', 'title of the results; that of &run wins', &
                            default_text='stem of the file'), o%model_title)
      call table%add(option('units', 'units of all numbers: SI (m, kg, s, N, Pa), kN (m, t, s, kN, kPa), '// &
                            'mm (mm, t, s, N, MPa), or none: any consistent ones, which nothing checks', &
                            choices='SI|kN|mm|none', default_text='SI', see='file-formats.md#units'), o%units)
   end subroutine describe_model

   !> &block_material
   subroutine describe_block_materials(table, materials)
      type(option_rows_type), intent(inout) :: table
      type(block_material_type), allocatable, intent(inout) :: materials(:)
      integer :: i
      call table%begin_list('block_material', 'A block material: changes what it names of one of the analysis '// &
                            'file, or adds one.')
      if (.not. allocated(materials)) then
         allocate (materials(table%n_wanted()))
         do i = 1, size(materials)
            materials(i) = unset_block_material()
         end do
      end if
      do i = 1, size(materials)
         call table%start_element(i, materials(i)%origin)
         call describe_block_material(table, materials(i))
      end do
   end subroutine describe_block_materials

   !> One &block_material. What is not given stays as it is, so that no row has a constant default.
   subroutine describe_block_material(table, m)
      type(option_rows_type), intent(inout) :: table
      type(block_material_type), intent(inout) :: m
      character(len=*), parameter :: needed = 'as it is; an added material needs it', stays = 'as it is, else 0'
      call table%add(option('number', 'number of the block material in the geometry; beside an analysis '// &
                            'file the next free one adds a material', least=1.0_wp, &
                            most=real(most_number, wp), required=.true.), m%number)
      call table%add(option('name', 'name of the material', default_text='none'), m%name)
      call table%add(option('density', 'mass per area', unit='mass/length^2', above=0.0_wp, default_text=needed), &
                     m%density)
      call table%add(option('young', 'Young''s modulus', unit='stress', above=0.0_wp, default_text=needed), &
                     m%youngs_modulus)
      call table%add(option('poisson', 'Poisson''s ratio', above=-1.0_wp, below=0.5_wp, default_text=needed), &
                     m%poisson_ratio)
      call table%add(option('unit_weight', 'weight per area; acts in -y', unit='force/length^2', &
                            default_text='as it is, else density times &load gravity'), m%weight)
      call table%add_reals(option('stress', 'initial stress at y = 0, tension positive', unit='stress', &
                                  columns='s11, s22, s12', default_text=stays), m%stress)
      call table%add_reals(option('stress_gradient', 'change of the initial stress with y', unit='stress/length', &
                                  columns='t11, t22, t12', default_text=stays), m%stress_gradient)
      call table%add_reals(option('velocity', 'initial velocity, and rate of rotation [1/time]', unit='length/time', &
                                  columns='vx, vy, vr', n_in_unit=2, default_text=stays), m%velocity)
   end subroutine describe_block_material

   !> &fixed_point and &loading_point
   subroutine describe_point_tables(table, fixed, loading)
      type(option_rows_type), intent(inout) :: table
      type(point_table_type), allocatable, intent(inout) :: fixed(:), loading(:)
      integer :: i
      call table%begin_list('fixed_point', 'Prescribed displacement of fixed points.')
      if (.not. allocated(fixed)) allocate (fixed(table%n_wanted()))
      do i = 1, size(fixed)
         call table%start_element(i, fixed(i)%origin)
         call table%add(option('points', 'numbers of the fixed points', least=1.0_wp, default_text='all'), &
                        fixed(i)%points)
         call table%add(option('displacement', 'displacement in time, linear in between', unit='time, length', &
                               columns='t, x, y', required=.true., rule=list_rule%rising), fixed(i)%rows)
      end do
      call table%begin_list('loading_point', 'Force on loading points.')
      if (.not. allocated(loading)) allocate (loading(table%n_wanted()))
      do i = 1, size(loading)
         call table%start_element(i, loading(i)%origin)
         call table%add(option('name', 'name of the load, for rockdda fos; loads of one name belong together', &
                               default_text='none', see='factor-of-safety.md#load-factor'), loading(i)%name)
         call table%add(option('points', 'numbers of the loading points', least=1.0_wp, &
                               default_text='all of the geometry, or at'), loading(i)%points)
         call table%add(option('at', 'points that the geometry does not have, instead of numbers; each has the '// &
                               'force', unit='length', columns='x, y', default_text='none'), loading(i)%at)
         call table%add(option('force', 'force in time, linear in between; two numbers fx, fy are a constant force', &
                               unit='time, force', columns='t, fx, fy', required=.true., &
                               rule=list_rule%or_constant), loading(i)%rows)
      end do
   end subroutine describe_point_tables

   !> Change and add block materials. The unit weight of a material that does not name it is its density times the
   !> gravity of the options, where there is one. Numbers between those that are described are no material; they
   !> get the values of one that is, which nothing uses.
   subroutine take_block_options(groups, labelled, gravity, materials, messages)
      type(block_material_type), intent(in) :: groups(:)
      logical, intent(in) :: labelled             !! of a labelled file: materials have any numbers
      real(wp), intent(inout) :: gravity          !! of the run; becomes -1 when the weights say it all
      type(block_material_type), allocatable, intent(inout) :: materials(:)
      type(diagnostics_type), intent(inout) :: messages
      type(block_material_type), allocatable :: more(:)
      logical, allocatable :: own_weight(:), described(:)
      integer :: i, k, n, m
      n = size(materials)
      allocate (described, source=described_materials(n, groups, labelled))
      allocate (more(size(described)), own_weight(size(described)))
      own_weight = .false.
      more(1:n) = materials
      do i = 1, size(more)
         if (i > n) more(i) = unset_block_material()
         more(i)%number = i
      end do
      do i = 1, size(groups)
         m = groups(i)%number
         if (m < 1 .or. m > most_number) cycle   ! reported by the reader
         if (m > size(more)) then
            call messages%add(severity%error, 'block material '//to_string(m)//': there '// &
                              trim(merge('is ', 'are', size(more) == 1))//' '//counted(size(more), 'block material')// &
                              ', the next number is '//to_string(size(more) + 1), groups(i)%origin)
            cycle
         end if
         if (any(groups(1:i - 1)%number == m)) call messages%add(severity%warning, 'block material '//to_string(m)// &
            ': is described twice; what this group names replaces what the one before it has', groups(i)%origin)
         call change(groups(i), more(m))
         own_weight(m) = own_weight(m) .or. is_set(groups(i)%weight)
      end do
      do i = n + 1, size(more)
         if (described(i)) call complete(more(i), messages)
      end do
      call check_material_names('block', more, messages)
      if (gravity >= 0 .and. any(own_weight)) then
         do i = 1, size(more)
            if (.not. own_weight(i)) more(i)%weight = gravity*more(i)%density
         end do
         gravity = -1
      end if
      do i = 1, size(more)
         if (.not. is_set(more(i)%weight)) more(i)%weight = max(gravity, 0.0_wp)*more(i)%density
      end do
      do i = 1, size(more)
         if (.not. allocated(more(i)%name)) more(i)%name = ''
         if (described(i)) cycle
         do k = 1, size(more)
            if (described(k)) exit
         end do
         more(i) = more(k)
         more(i)%number = i
         more(i)%name = ''
      end do
      call move_alloc(more, materials)
   end subroutine take_block_options

   !> Values that a group names.
   subroutine change(group, material)
      type(block_material_type), intent(in) :: group
      type(block_material_type), intent(inout) :: material
      type(option_rows_type) :: given, table
      type(block_material_type) :: new
      new = group
      call describe_block_material(given, new)
      call describe_block_material(table, material)
      call table%take_given(given)
      call table%give_back()
      call describe_block_material(table, material)
      material%origin = group%origin
   end subroutine change

   !> An added material has density, Young's modulus and Poisson's ratio; stress and velocity are 0 unless given.
   subroutine complete(material, messages)
      type(block_material_type), intent(inout) :: material
      type(diagnostics_type), intent(inout) :: messages
      call demand('density', material%density)
      call demand('young', material%youngs_modulus)
      call demand('poisson', material%poisson_ratio)
      if (.not. is_set(material%stress(1))) material%stress = 0
      if (.not. is_set(material%stress_gradient(1))) material%stress_gradient = 0
      if (.not. is_set(material%velocity(1))) material%velocity = 0

   contains

      !> One value that must be given.
      subroutine demand(name, value)
         character(len=*), intent(in) :: name
         real(wp), intent(inout) :: value
         if (is_set(value)) return
         if (.not. messages%has_error_about(name, material%origin)) call messages%add(severity%error, &
            'block material '//to_string(material%number)//": '"//name//"' is missing", material%origin)
         value = 1
      end subroutine demand

   end subroutine complete

   !> Put the tables of groups in place of those of the points that they name.
   subroutine take_point_tables(what, groups, tables, messages)
      character(len=*), intent(in) :: what       !! 'fixed point'
      type(point_table_type), intent(in) :: groups(:)
      type(time_table_type), intent(inout) :: tables(:)
      type(diagnostics_type), intent(inout) :: messages
      integer, allocatable :: points(:)
      integer :: i, k
      do i = 1, size(groups)
         if (.not. allocated(groups(i)%rows)) cycle   ! reported by the reader
         points = [(k, k=1, size(tables))]
         if (allocated(groups(i)%points)) points = groups(i)%points
         if (size(points) == 0) call messages%add(severity%warning, 'the model has no '//what, groups(i)%origin)
         do k = 1, size(points)
            if (points(k) >= 1 .and. points(k) <= size(tables)) then
               tables(points(k))%rows = groups(i)%rows
               tables(points(k))%name = groups(i)%name
               tables(points(k))%origin = groups(i)%origin
            else
               call messages%add(severity%error, what//' '//to_string(points(k))//' does not exist, the model has '// &
                                 counted(size(tables), what), groups(i)%origin)
            end if
         end do
      end do
   end subroutine take_point_tables

end module rockdda_model_material_options
