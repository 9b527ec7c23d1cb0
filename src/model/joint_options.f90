! SPDX-License-Identifier: MIT
!> Joint materials of a run: those of the analysis file, as options change them, and those that options add.
module rockdda_model_joint_options
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_base_strings, only : counted, to_string
   use rockdda_model_analysis_input, only : joint_material_type
   use rockdda_model_material_names, only : most_number, described_materials, check_material_names, take, take_text
   use rockdda_model_material_options, only : friction_option
   use rockdda_model_options, only : is_set
   implicit none
   private
   public :: change_joint, take_joint_options

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
            call messages%add(severity%error, what//'there is no joint material '//to_string(m)//', they are 1 to '// &
                              to_string(size(materials)), laws(i)%origin)
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
      call take_text(group%name, material%name)
      call take(group%friction_angle, material%friction_angle)
      call take(group%cohesion, material%cohesion)
      call take(group%tension, material%tension)
      call take(group%normal_stiffness, material%normal_stiffness)
      call take(group%shear_stiffness, material%shear_stiffness)
      call take_text(group%law, material%law)
      if (allocated(group%parameters)) material%parameters = group%parameters
      call take(group%residual_friction, material%residual_friction)
      call take(group%residual_cohesion, material%residual_cohesion)
      call take(group%residual_tension, material%residual_tension)
      call take(group%slip_length, material%slip_length)
      call take(group%slip_rate, material%slip_rate)
      call take(group%jrc, material%jrc)
      call take(group%jcs, material%jcs)
      call take(group%dilation, material%dilation)
      call take(group%dilation_slip, material%dilation_slip)
      call take(group%damping_ratio, material%damping_ratio)
      call take(group%restitution, material%restitution)
      if (group%brittle_given) material%brittle = group%brittle
      if (group%tie_given) material%tie = group%tie
      material%brittle_given = material%brittle_given .or. group%brittle_given
      material%tie_given = material%tie_given .or. group%tie_given
      material%origin = group%origin
   end subroutine change_joint

end module rockdda_model_joint_options
