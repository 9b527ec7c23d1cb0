! SPDX-License-Identifier: MIT
!> Joint materials of a run: those of the analysis file, as options change them, and those that options add.
module rockdda_model_joint_options
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_base_strings, only : counted, to_string
   use rockdda_model_analysis_input, only : joint_material_type
   use rockdda_model_options, only : is_set
   use rockdda_model_regions, only : material_number, same_name
   implicit none
   private
   public :: take_joint_options, count_joint_materials, joint_number

contains

   !> Change and add materials. Values are not judged here, but numbers and names are; errors are where the group was
   !> read.
   subroutine take_joint_options(added, laws, materials, messages)
      type(joint_material_type), intent(in) :: added(:)      !! groups that change a material or add the next one
      type(joint_material_type), intent(in) :: laws(:)       !! groups that change a material, each at most one
      type(joint_material_type), allocatable, intent(inout) :: materials(:)
      type(diagnostics_type), intent(inout) :: messages
      character(len=:), allocatable :: what
      logical, allocatable :: bond_named(:)   !! the options name cohesion or tension of the material
      integer :: i, m, n
      do i = 1, size(materials)
         materials(i)%number = i
      end do
      allocate (bond_named(size(materials) + size(added)))
      bond_named = .false.
      do i = 1, size(added)
         m = added(i)%number
         n = size(materials)
         what = 'joint material '//to_string(m)//': '
         if (m < 1) cycle
         if (m > n + 1) then
            call messages%add(severity%error, what//'there '//trim(merge('is ', 'are', n == 1))//' '// &
                              counted(n, 'joint material')//', the next number is '//to_string(n + 1), added(i)%origin)
            cycle
         end if
         if (m == n + 1) then
            if (.not. is_set(added(i)%friction_angle)) call messages%add(severity%error, what// &
               'an added material needs its angle of friction', added(i)%origin)
            call append_material(materials)
         end if
         call change(added(i), materials(m))
         bond_named(m) = bond_named(m) .or. is_set(added(i)%cohesion) .or. is_set(added(i)%tension)
         call check_name(materials, m, messages)
      end do
      do i = 1, size(laws)
         m = laws(i)%number
         what = 'joint law '//to_string(i)//': '
         if (m < 1 .or. m > size(materials)) then
            call messages%add(severity%error, what//'there is no joint material '//to_string(m)//', they are 1 to '// &
                              to_string(size(materials)), laws(i)%origin)
         else if (any(laws(1:i - 1)%number == m)) then
            call messages%add(severity%error, what//'joint material '//to_string(m)//' already has a law', &
                              laws(i)%origin)
         else
            call change(laws(i), materials(m))
            bond_named(m) = bond_named(m) .or. is_set(laws(i)%cohesion) .or. is_set(laws(i)%tension)
            call check_name(materials, m, messages)
         end if
      end do
      do i = 1, size(materials)
         if (.not. allocated(materials(i)%name)) materials(i)%name = ''
         if (.not. allocated(materials(i)%law)) materials(i)%law = 'coulomb'
         if (bond_named(i) .and. materials(i)%tension > 0 .and. .not. materials(i)%cohesion > 0) &
            call messages%add(severity%error, 'joint material '//to_string(i)//' has tensile strength but no '// &
            'cohesion: a joint in tension then resists no shear, and the least shear breaks it; give it cohesion '// &
            'of '// &
            'at least the tensile strength times the tangent of its angle of friction', materials(i)%origin)
      end do
   end subroutine take_joint_options

   !> Number of joint materials, with those that groups add to the n of the analysis file.
   pure integer function count_joint_materials(n, added) result(total)
      integer, intent(in) :: n
      type(joint_material_type), allocatable, intent(in) :: added(:)
      integer :: i
      total = n
      if (.not. allocated(added)) return
      do i = 1, size(added)
         if (added(i)%number == total + 1) total = total + 1
      end do
   end function count_joint_materials

   !> Number of the joint material that a word stands for: a number, or a name that a group gives; 0 if there is none.
   pure integer function joint_number(word, groups)
      character(len=*), intent(in) :: word
      type(joint_material_type), intent(in) :: groups(:)     !! of the options
      integer :: i
      joint_number = material_number(trim(adjustl(word)))
      if (joint_number > 0 .or. len_trim(word) == 0) return
      do i = 1, size(groups)
         if (.not. allocated(groups(i)%name)) cycle
         if (same_name(groups(i)%name, word)) joint_number = groups(i)%number
      end do
   end function joint_number

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
   subroutine change(group, material)
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
   end subroutine change

   !> A number, when it is given.
   pure subroutine take(given, value)
      real(wp), intent(in) :: given
      real(wp), intent(inout) :: value
      if (is_set(given)) value = given
   end subroutine take

   !> A text, when it is given and not blank.
   pure subroutine take_text(given, value)
      character(len=:), allocatable, intent(in) :: given
      character(len=:), allocatable, intent(inout) :: value
      if (.not. allocated(given)) return
      if (len_trim(given) > 0) value = trim(adjustl(given))
   end subroutine take_text

   !> No two materials have one name.
   subroutine check_name(materials, m, messages)
      type(joint_material_type), intent(in) :: materials(:)
      integer, intent(in) :: m
      type(diagnostics_type), intent(inout) :: messages
      integer :: i
      if (.not. allocated(materials(m)%name)) return
      do i = 1, size(materials)
         if (i == m .or. .not. allocated(materials(i)%name)) cycle
         if (same_name(materials(i)%name, materials(m)%name)) call messages%add(severity%error, 'joint materials '// &
            to_string(min(i, m))//' and '//to_string(max(i, m))//" have one name, '"//materials(m)%name//"'", &
            materials(m)%origin)
      end do
   end subroutine check_name

end module rockdda_model_joint_options
