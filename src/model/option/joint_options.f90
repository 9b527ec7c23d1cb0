! SPDX-License-Identifier: MIT
!> The rows of the table of options for a joint material, and the joint materials of a run: those of the analysis file,
!> as options change them, and those that options add.
module rockdda_model_joint_options
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_base_strings, only : counted, to_string
   use rockdda_model_analysis_input, only : joint_material_type
   use rockdda_model_material_names, only : most_number, described_materials, check_material_names
   use rockdda_model_material_options, only : friction_option
   use rockdda_model_option, only : option
   use rockdda_model_option_rows, only : option_rows_type
   use rockdda_model_options, only : is_set
   implicit none
   private
   public :: describe_joint, change_joint, take_joint_options

contains

   !> Change and add materials. Values are not judged here, but numbers and names are; errors are where the group was
   !> read.
   subroutine take_joint_options(added, laws, labelled, materials, messages)
      type(joint_material_type), intent(in) :: added(:)      !! groups that change a material or add one
      type(joint_material_type), intent(in) :: laws(:)       !! groups that change a material, each at most one
      logical, intent(in) :: labelled                        !! of a labelled file: materials have any numbers
      type(joint_material_type), allocatable, intent(inout) :: materials(:)
      type(diagnostics_type), intent(inout) :: messages
      character(len=:), allocatable :: what
      logical, allocatable :: bond_named(:)   !! the options name cohesion or tension of the material
      logical, allocatable :: described(:), has_law(:)
      integer :: i, m, n, n_described
      allocate (described, source=described_materials(size(materials), added, labelled))
      do i = 1, size(materials)
         materials(i)%number = i
      end do
      n_described = size(materials)             ! by the analysis file
      allocate (bond_named(size(described)), has_law(size(described)))
      bond_named = .false.
      has_law = .false.
      do i = 1, size(added)
         m = added(i)%number
         n = size(materials)
         what = 'joint material '//to_string(m)//': '
         if (m < 1 .or. m > most_number) cycle       ! reported by the reader
         if (m > n + 1 .and. .not. labelled) then
            call messages%add(severity%error, what//'there '//trim(merge('is ', 'are', n == 1))//' '// &
                              counted(n, 'joint material')//', the next number is '//to_string(n + 1), added(i)%origin)
            cycle
         end if
         do while (size(materials) < m)
            call append_material(materials)
         end do
         if (m > n_described .and. .not. any(added(1:i - 1)%number == m) .and. &
             .not. is_set(added(i)%friction_angle) .and. .not. has_own_friction(added(i)) .and. &
             .not. messages%has_error_about(friction_option, added(i)%origin)) &
            call messages%add(severity%error, what//'an added material needs its angle of friction', &
                              added(i)%origin)
         if (any(added(1:i - 1)%number == m)) call messages%add(severity%warning, what//'is described twice; what '// &
            'this group names replaces what the one before it has', added(i)%origin)
         call change_joint(added(i), materials(m))
         if (m > n_described .and. is_barton_bandis(materials(m)) .and. .not. is_set(added(i)%friction_angle)) &
            materials(m)%friction_angle = max(materials(m)%residual_friction, 0.0_wp)
         bond_named(m) = bond_named(m) .or. is_set(added(i)%cohesion) .or. is_set(added(i)%tension)
      end do
      do i = 1, size(laws)
         m = laws(i)%number
         what = 'joint law '//to_string(i)//': '
         if (m == 0 .and. allocated(laws(i)%word)) cycle   ! reported by the reader
         if (m < 1 .or. m > size(materials)) then
            call messages%add(severity%error, what//'joint material '//to_string(m)//' is unknown, there '// &
                              trim(merge('is ', 'are', size(materials) == 1))//' '// &
                              counted(size(materials), 'joint material'), laws(i)%origin)
         else if (has_law(m)) then
            call messages%add(severity%error, what//'joint material '//to_string(m)//' already has a law', &
                              laws(i)%origin)
         else
            call change_joint(laws(i), materials(m))
            bond_named(m) = bond_named(m) .or. is_set(laws(i)%cohesion) .or. is_set(laws(i)%tension)
            has_law(m) = .true.
         end if
      end do
      call check_material_names('joint', materials, messages)
      do i = 1, size(materials)
         materials(i)%number = i
         if (.not. allocated(materials(i)%name)) materials(i)%name = ''
         if (.not. allocated(materials(i)%law)) materials(i)%law = 'coulomb'
         if (labelled .and. .not. materials(i)%brittle_given) materials(i)%brittle = .false.
         if (bond_named(i) .and. materials(i)%tension > 0 .and. .not. materials(i)%cohesion > 0 .and. &
             .not. (materials(i)%brittle_given .and. materials(i)%brittle)) &
            call messages%add(severity%error, 'joint material '//to_string(i)//' has tensile strength but no '// &
            'cohesion: a joint in tension then resists no shear, and the least shear breaks it; give it cohesion '// &
            'of '// &
            'at least the tensile strength times the tangent of its angle of friction', materials(i)%origin)
      end do
   end subroutine take_joint_options

   !> Does a material need no angle of friction: a tie without strength, which never slips, or the law barton_bandis,
   !> whose angle of flat surfaces is `residual_friction`?
   pure logical function has_own_friction(group)
      type(joint_material_type), intent(in) :: group
      has_own_friction = group%tie .and. .not. (is_set(group%cohesion) .or. is_set(group%tension))
      has_own_friction = has_own_friction .or. is_barton_bandis(group)
   end function has_own_friction

   pure logical function is_barton_bandis(group)
      type(joint_material_type), intent(in) :: group
      is_barton_bandis = .false.
      if (allocated(group%law)) is_barton_bandis = group%law == 'barton_bandis'
   end function is_barton_bandis

   !> One material more, with the values of a joint without strength.
   subroutine append_material(materials)
      type(joint_material_type), allocatable, intent(inout) :: materials(:)
      type(joint_material_type), allocatable :: more(:)
      integer :: n
      n = size(materials)
      allocate (more(n + 1))
      more(1:n) = materials
      more(n + 1)%number = n + 1
      call move_alloc(more, materials)
   end subroutine append_material

   !> Values that a group names.
   subroutine change_joint(group, material)
      type(joint_material_type), intent(in) :: group
      type(joint_material_type), intent(inout) :: material
      type(option_rows_type) :: given, table
      type(joint_material_type) :: new
      new = group
      call describe_joint(given, new)
      call describe_joint(table, material)
      call table%take_given(given)
      call table%give_back()
      call describe_joint(table, material)
      material%origin = group%origin
   end subroutine change_joint

   !> &joint_material and &joint_law but the number. What is not given stays as it is, so that no row has a constant
   !> default.
   subroutine describe_joint(table, m)
      type(option_rows_type), intent(inout) :: table
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
                            default_text='from the contact stiffness', by_length=.true.), &
                     m%normal_stiffness)
      call table%add(option('maximum_closure', 'largest closure: normal stiffness grows with it by a hyperbola, '// &
                            'from normal_stiffness without stress', unit='length', above=0.0_wp, &
                            default_text='none: constant', by_length=.true., see='theory.md#joints-that-stiffen'), &
                     m%maximum_closure)
      call table%add(option('shear_stiffness', 'shear stiffness per length', unit='stress/length', above=0.0_wp, &
                            default_text='from the contact stiffness', by_length=.true.), &
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
                            by_length=.true.), m%tie, is_given=m%tie_given)
   end subroutine describe_joint

end module rockdda_model_joint_options
