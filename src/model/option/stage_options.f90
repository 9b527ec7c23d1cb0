! SPDX-License-Identifier: MIT
!> Rows of the table of options for stages and what changes with them: &stage, &change.
module rockdda_model_stage_options
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : to_string, is_given
   use rockdda_model_option, only : option
   use rockdda_model_option_rows, only : option_rows_type
   use rockdda_model_options, only : stage_type, change_type, base_motion_type, quake_type, is_set
   use rockdda_model_regions, only : same_name
   implicit none
   private
   public :: describe_stage, describe_new_values, stage_name, seeks_equilibrium, has_end, is_plain, stage_names, &
      is_given, water_of_stage, water_of_stages, stage_k01, has_base_motion, first_dynamic_stage, stage_number, &
      least_extent

   !> Number of steps in a row that must be in equilibrium.
   integer, parameter, public :: confirming_steps = 2

   character(len=*), parameter :: guide = 'user-guide.md#stages'

contains

   !> &stage.
   subroutine describe_stage(table, stage)
      type(option_rows_type), intent(inout) :: table
      type(stage_type), intent(inout) :: stage
      character(len=*), parameter :: with_end = "until = 'equilibrium'", regions = 'names of regions, commas '// &
                                     'between them: '
      call table%add(option('name', 'name of the stage', default_text="'stage N'", not_blank=.true.), stage%name)
      call table%add(option('kind', 'static: every step starts at rest, k01 = 0; dynamic: k01 = 1', &
                            choices='static|dynamic', default_text="static with until = 'equilibrium', else k01", &
                            see=guide), stage%kind)
      call table%add(option('until', 'the stage ends when the blocks are in equilibrium', choices='equilibrium', &
                            default_text='none', see=guide), stage%until)
      call table%add(option('tolerance', 'largest unbalanced force over the mean force in equilibrium', &
                            above=0.0_wp, below=1.0_wp, applies=with_end), stage%tolerance)
      call table%add(option('max_steps', 'largest number of steps of the stage to equilibrium', least=1.0_wp, &
                            applies=with_end), stage%max_steps)
      call table%add(option('on_failure', 'without equilibrium after max_steps: end the run (exit 3), or go on '// &
                            'with the next stage', choices='stop|continue', default_text='stop', applies=with_end), &
                     stage%on_failure)
      call table%add(option('until_step', 'last step of the stage, counted from the start of the run', least=1.0_wp, &
                            default_text='another end; only the last stage may have none'), stage%until_step)
      call table%add(option('until_time', 'end time of the stage', unit='time', above=0.0_wp, &
                            default_text='another end'), stage%until_time)
      call table%add(option('duration', 'time that the stage lasts', unit='time', above=0.0_wp, &
                            default_text='another end'), stage%duration)
      call table%add(option('k01', 'as in &time, for this stage', least=0.0_wp, most=1.0_wp, &
                            remark='0 static, 1 dynamic', default_text='that of the run'), stage%k01)
      call table%add(option('gravity', 'factor of all weights'), stage%gravity)
      call table%add(option('release', 'numbers of the fixed points that are released when the stage ends', &
                            least=1.0_wp, default_text='none'), stage%release)
      call table%add(option('reset_displacement', 'measured displacements and rotations count from the start of '// &
                            'the stage'), stage%reset_displacement)
      call table%add(option('excavate', regions//'their blocks are taken out when the stage begins', &
                            default_text='none', not_blank=.true., see=guide), stage%excavate)
      call table%add(option('relax', 'share, counted from the excavation, of the forces of excavated blocks on the '// &
                            'others that is released; the rest stays as a load', least=0.0_wp, most=1.0_wp, &
                            default_text='1 where blocks are excavated', see=guide), stage%relax)
      call table%add(option('relax_steps', 'number of steps in which that share is released, in equal parts', &
                            least=1.0_wp), stage%relax_steps)
      call table%add(option('place', regions//'their blocks are absent until the stage begins', &
                            default_text='none', not_blank=.true., see=guide), stage%place)
      call table%add(option('install', &
         'names of bolts and linings that are installed when the stage begins, commas between them', &
                            default_text='none', not_blank=.true.), stage%install)
      call table%add(option('remove', &
         'names of bolts and linings that are removed when the stage begins, commas between them', &
                            default_text='none', not_blank=.true.), stage%remove)
      call table%add(option('water', "names of the groups of &water that act from the stage on, commas between "// &
                            "them; 'none': none of them", &
                            default_text='those of the stage before; in the first stage all', &
                            see='user-guide.md#water'), stage%water)
   end subroutine describe_stage

   !> Go on to the earliest end of a stage: time and number of steps since the start of the run.
   pure subroutine least_extent(stage, time, steps)
      type(stage_type), intent(in) :: stage
      real(wp), intent(inout) :: time
      integer, intent(inout) :: steps
      if (is_set(stage%until_step)) steps = max(steps, stage%until_step)
      if (is_set(stage%until_time)) time = max(time, stage%until_time)
      if (is_set(stage%duration)) time = time + stage%duration
      if (seeks_equilibrium(stage)) steps = steps + confirming_steps
   end subroutine least_extent

   !> Names of the groups of &water that act in stage i: those of the last stage up to it that names some; empty: all.
   pure function water_of_stage(stages, i) result(names)
      type(stage_type), intent(in) :: stages(:)
      integer, intent(in) :: i
      character(len=:), allocatable :: names
      integer :: k
      names = ''
      do k = 1, min(i, size(stages))
         if (is_given(stages(k)%water)) names = trim(adjustl(stages(k)%water))
      end do
   end function water_of_stage

   !> The same of all stages; one without stages.
   pure function water_of_stages(stages) result(names)
      type(stage_type), intent(in) :: stages(:)
      character(len=80), allocatable :: names(:)
      integer :: i
      allocate (names(max(1, size(stages))))
      do i = 1, size(names)
         names(i) = water_of_stage(stages, i)
      end do
   end function water_of_stages

   !> The rows of &change that no joint material has.
   subroutine describe_new_values(table, change)
      type(option_rows_type), intent(inout) :: table
      type(change_type), intent(inout) :: change
      character(len=*), parameter :: of_blocks = 'block_material or region'
      call table%add(option('stage', 'name of the stage from whose start the values hold', required=.true., &
                            not_blank=.true.), change%stage)
      call table%add(option('joint_material', 'number or name of the joint material that has the new values', &
                            default_text='none', not_blank=.true., or_number=.true.), change%joint_material)
      call table%add(option('block_material', 'number of the block material that has the new values; with region: '// &
                            'the material of its blocks', default_text='none', not_blank=.true., or_number=.true.), &
                     change%block_material)
      call table%add(option('region', 'names of regions, commas between them: the new values hold for their blocks', &
                            default_text='none', not_blank=.true.), change%region)
      call table%add(option('liner', "name of a lining, whose Young's modulus changes: stress stays", &
                            default_text='none', not_blank=.true.), change%liner)
      call table%add(option('density', 'mass per area', unit='mass/length^2', above=0.0_wp, applies=of_blocks, &
                            default_text='as it was'), change%density)
      call table%add(option('young', "Young's modulus", unit='stress', above=0.0_wp, applies=of_blocks, &
                            default_text='as it was'), change%young)
      call table%add(option('poisson', "Poisson's ratio", above=-1.0_wp, below=0.5_wp, applies=of_blocks, &
                            default_text='as it was'), change%poisson)
      call table%add(option('unit_weight', 'weight per area', unit='force/length^2', applies=of_blocks, &
                            default_text='as it was; density times &load gravity while no unit_weight is given '// &
                            'for any material'), change%unit_weight)
   end subroutine describe_new_values

   !> Name of stage i.
   pure function stage_name(stages, i) result(name)
      type(stage_type), intent(in) :: stages(:)
      integer, intent(in) :: i
      character(len=:), allocatable :: name
      name = 'stage '//to_string(i)
      if (i > size(stages)) return
      if (is_given(stages(i)%name)) name = trim(adjustl(stages(i)%name))
   end function stage_name

   !> Names of all stages, and of what follows the last one where the run continues.
   pure function stage_names(stages, ends_with_stages) result(names)
      type(stage_type), intent(in) :: stages(:)
      logical, intent(in) :: ends_with_stages
      character(len=:), allocatable :: names(:)
      integer :: i, longest, n
      n = size(stages)
      if (n == 0) then
         n = 1
      else if (has_end(stages(n)) .and. .not. ends_with_stages) then
         n = n + 1
      end if
      longest = 0
      do i = 1, n
         longest = max(longest, len(stage_name(stages, i)))
      end do
      allocate (character(len=longest) :: names(n))
      do i = 1, n
         names(i) = stage_name(stages, i)
      end do
   end function stage_names

   !> k01 of a stage in a run with this one.
   pure real(wp) function stage_k01(stage, k01)
      type(stage_type), intent(in) :: stage
      real(wp), intent(in) :: k01            !! of the run
      stage_k01 = k01
      if (is_set(stage%k01)) then
         stage_k01 = stage%k01
      else if (is_given(stage%kind)) then
         stage_k01 = merge(0.0_wp, 1.0_wp, stage%kind == 'static')
      else if (seeks_equilibrium(stage)) then
         stage_k01 = 0
      end if
   end function stage_k01

   !> Does the ground move at some time?
   pure logical function has_base_motion(base, quakes)
      type(base_motion_type), intent(in) :: base
      type(quake_type), allocatable, intent(in) :: quakes(:)
      has_base_motion = .false.
      if (allocated(base%table)) has_base_motion = size(base%table, 2) > 0
      if (allocated(base%harmonics)) has_base_motion = has_base_motion .or. size(base%harmonics, 2) > 0
      if (allocated(quakes)) has_base_motion = has_base_motion .or. size(quakes) > 0
   end function has_base_motion

   !> Number of the first dynamic stage, 0: there is none.
   pure integer function first_dynamic_stage(stages, k01) result(first)
      type(stage_type), intent(in) :: stages(:)
      real(wp), intent(in) :: k01            !! of the run
      do first = 1, size(stages)
         if (stage_k01(stages(first), k01) > 0) return
      end do
      first = 0
   end function first_dynamic_stage

   !> Number of the stage of a name, 0: there is none.
   pure integer function stage_number(stages, name) result(i)
      type(stage_type), intent(in) :: stages(:)
      character(len=*), intent(in) :: name
      do i = 1, size(stages)
         if (same_name(stage_name(stages, i), name)) return
      end do
      i = 0
   end function stage_number

   !> Does the stage end by equilibrium?
   pure logical function seeks_equilibrium(stage)
      type(stage_type), intent(in) :: stage
      seeks_equilibrium = .false.
      if (allocated(stage%until)) seeks_equilibrium = stage%until == 'equilibrium'
   end function seeks_equilibrium

   !> Does the stage have an end of its own?
   pure logical function has_end(stage)
      type(stage_type), intent(in) :: stage
      has_end = is_set(stage%until_step) .or. is_set(stage%until_time) .or. is_set(stage%duration) .or. &
                seeks_equilibrium(stage)
   end function has_end

   !> Is it a stage as older files have them, with until_step, until_time, k01, gravity and release alone? After the
   !> last of such stages the run continues.
   pure logical function is_plain(stage)
      type(stage_type), intent(in) :: stage
      is_plain = .not. (is_given(stage%name) .or. is_given(stage%kind) .or. is_given(stage%until) .or. &
                        is_set(stage%duration) .or. is_set(stage%relax) .or. is_given(stage%excavate) .or. &
                        is_given(stage%place) .or. stage%reset_displacement)
   end function is_plain

end module rockdda_model_stage_options
