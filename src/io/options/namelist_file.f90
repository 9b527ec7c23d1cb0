! SPDX-License-Identifier: MIT
!> Reader of run options: a namelist file with the groups and names of the table of options
!> (rockdda_model_option_table, docs/file-formats.md), and check of stages and changes against each other.
module rockdda_io_namelist_file
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : to_string
   use rockdda_base_diagnostics, only : diagnostics_type, severity, at_word, place_text
   use rockdda_model_analysis_input, only : joint_material_type
   use rockdda_model_joint_options, only : describe_joint
   use rockdda_model_option_rows, only : option_rows_type, has_value
   use rockdda_model_material_names, only : number_of_material
   use rockdda_model_options, only : run_options_type, stage_type, change_type, base_motion_type, is_set
   use rockdda_io_namelist_parser, only : namelist_type, parse_namelist
   use rockdda_io_option_reader, only : read_options
   use rockdda_io_record_reader, only : append_in_order
   use rockdda_model_bolt_numbers, only : bolt_problem
   use rockdda_model_support_options, only : liner_problem
   use rockdda_model_regions, only : count_words, same_name, word_of
   use rockdda_model_stage_options, only : stage_name, seeks_equilibrium, has_end, is_given, stage_number, &
      confirming_steps, describe_new_values
   use rockdda_io_source, only : source_type, read_source
   use rockdda_base_suggest, only : did_you_mean
   implicit none
   private
   public :: read_options_source, list_given_options, given_group_type

   !> Defaults of &stage: what differs was given.
   type(stage_type), parameter :: default = stage_type()

   !> A group of a file as it stands there.
   type :: given_group_type
      character(len=:), allocatable :: name
      character(len=:), allocatable :: entries   !! names, ', ' between them
   end type given_group_type

contains

   !> Read and check a file of run options; every problem is added to `messages`.
   subroutine read_options_source(source, options, messages)
      type(source_type), intent(in) :: source
      type(run_options_type), intent(out) :: options
      type(diagnostics_type), intent(inout) :: messages
      type(namelist_type), target :: namelist
      character(len=:), allocatable :: problem
      integer :: i
      call parse_namelist(source, namelist)
      call read_options(namelist, options)
      options%labelled = any([(namelist%groups(i)%name == 'model', i=1, namelist%n)])
      do i = namelist%n, 1, -1
         if (namelist%groups(i)%name == 'model') options%model_origin = namelist%origin(namelist%groups(i)%place)
      end do
      do i = 1, size(options%joint_laws)
         if (.not. allocated(options%joint_laws(i)%word)) cycle
         options%joint_laws(i)%number = number_of_material(options%joint_laws(i)%word, options%joint_materials)
         if (options%joint_laws(i)%number == 0) call namelist%messages%add(severity%error, &
            "&joint_law: there is no joint material '"//options%joint_laws(i)%word//"'"// &
            did_you_mean(options%joint_laws(i)%word, joint_names(options%joint_materials)), &
            at_word(options%joint_laws(i)%origin, options%joint_laws(i)%word))
      end do
      do i = 1, size(options%bolts)
         problem = bolt_problem(options%bolts(i))
         if (len(problem) > 0) call namelist%messages%add(severity%error, '&bolt: '//problem, options%bolts(i)%origin)
      end do
      do i = 1, size(options%liners)
         problem = liner_problem(options%liners(i))
         ! what was given, but could not be read, is not missing
         if (namelist%messages%has_error_about(problem(:max(0, index(problem, ' ') - 1)), &
             options%liners(i)%origin)) cycle
         if (len(problem) > 0) call namelist%messages%add(severity%error, '&liner: '//problem, options%liners(i)%origin)
      end do
      call check_stages(options%stages, options%changes, namelist%messages)
      do i = 2, size(options%changes)
         call check_given_again(options, i, namelist%messages)
      end do
      call check_base_stage(options%stages, options%base, namelist%messages)
      call append_in_order(messages, namelist%messages)
   end subroutine read_options_source

   !> Names of joint materials.
   pure function joint_names(materials) result(names)
      type(joint_material_type), intent(in) :: materials(:)
      character(len=80) :: names(size(materials))
      integer :: i
      names = ''
      do i = 1, size(materials)
         if (allocated(materials(i)%name)) names(i) = adjustl(materials(i)%name)
      end do
   end function joint_names

   !> List the groups of a file with the names in them, none when it cannot be read.
   subroutine list_given_options(path, groups)
      character(len=*), intent(in) :: path
      type(given_group_type), allocatable, intent(out) :: groups(:)
      type(namelist_type) :: namelist
      type(source_type) :: source
      type(diagnostics_type) :: ignored
      integer :: i, k
      logical :: ok
      call read_source(path, source, ignored, ok)
      if (ok) call parse_namelist(source, namelist)
      allocate (groups(namelist%n))
      do i = 1, namelist%n
         associate (given => namelist%groups(i))
            groups(i)%name = given%name
            groups(i)%entries = ''
            do k = 1, given%n
               if (k > 1) groups(i)%entries = groups(i)%entries//', '
               groups(i)%entries = groups(i)%entries//given%entries(k)%name
            end do
         end associate
      end do
   end subroutine list_given_options

   !> Every problem that can be seen without the model.
   subroutine check_stages(stages, changes, messages)
      type(stage_type), intent(in) :: stages(:)
      type(change_type), intent(in) :: changes(:)
      type(diagnostics_type), intent(inout) :: messages
      integer :: i
      call check_ends(stages, messages)
      do i = 1, size(stages)
         call check_stage(stages, i, messages)
      end do
      do i = 1, size(changes)
         call check_change(stages, changes(i), messages)
      end do
   end subroutine check_stages

   !> Base motion begins with a stage that there is.
   subroutine check_base_stage(stages, base, messages)
      type(stage_type), intent(in) :: stages(:)
      type(base_motion_type), intent(in) :: base
      type(diagnostics_type), intent(inout) :: messages
      character(len=80) :: known(size(stages))
      integer :: i
      if (.not. is_given(base%stage)) return
      if (stage_number(stages, base%stage) > 0) return
      do i = 1, size(stages)
         known(i) = stage_name(stages, i)
      end do
      call messages%add(severity%error, "base_stage: there is no stage '"//trim(adjustl(base%stage))//"'"// &
                        did_you_mean(trim(adjustl(base%stage)), known), at_word(base%stage_origin, base%stage))
   end subroutine check_base_stage

   !> Every stage but the last has an end, later than that of the one before it.
   subroutine check_ends(stages, messages)
      type(stage_type), intent(in) :: stages(:)
      type(diagnostics_type), intent(inout) :: messages
      integer :: i, last_step
      real(wp) :: last_time
      character(len=:), allocatable :: ends
      logical :: in_order, is_known
      last_step = 0
      last_time = 0
      is_known = .true.
      do i = 1, size(stages)
         associate (stage => stages(i))
            if (count([is_set(stage%until_step), is_set(stage%until_time), is_set(stage%duration), &
                       seeks_equilibrium(stage)]) > 1) call messages%add(severity%error, &
               '&stage: give one of until_step or until_time, duration, until, not several', stage%origin)
            in_order = .true.
            if (is_set(stage%until_step)) then
               in_order = stage%until_step > last_step
               ends = 'until_step = '//to_string(stage%until_step)//' after '//to_string(last_step)
               last_step = stage%until_step
            else if (is_set(stage%until_time)) then
               in_order = stage%until_time > last_time
               ends = 'until_time = '//to_string(stage%until_time)//' after '//to_string(last_time)
               last_time = stage%until_time
               if (in_order .and. .not. is_known) call messages%add(severity%warning, '&stage '//to_string(i)// &
                  ': until_time counts from the start of the run, and how long the stages before it take to come '// &
                  'to equilibrium is not known: when the time has passed by then the stage is left out; duration '// &
                  'counts from its start', stage%origin)
            else if (is_set(stage%duration)) then
               last_time = last_time + stage%duration
            else if (seeks_equilibrium(stage)) then
               ! at least as many as confirm it
               last_step = last_step + confirming_steps
               is_known = .false.
            else if (.not. has_end(stage) .and. i < size(stages)) then
               call messages%add(severity%error, '&stage '//to_string(i)//': until_step or until_time is missing, '// &
                                 "or another end: duration, until = 'equilibrium' (only the last stage may have "// &
                                 'none)', stage%origin)
            end if
            if (.not. in_order) call messages%add(severity%error, '&stage '//to_string(i)// &
                                                  ': must end later than the stage before it, found '//ends, &
                                                  stage%origin)
         end associate
      end do
   end subroutine check_ends

   !> One stage.
   subroutine check_stage(stages, i, messages)
      type(stage_type), intent(in) :: stages(:)
      integer, intent(in) :: i
      type(diagnostics_type), intent(inout) :: messages
      character(len=:), allocatable :: name
      integer :: k
      associate (stage => stages(i))
         name = stage_name(stages, i)
         do k = 1, i - 1
            if (same_name(stage_name(stages, k), name)) call fail("there is already a stage '"//name//"'")
         end do
         if (is_given(stage%kind) .and. is_set(stage%k01)) call fail('give kind or k01, not both')
         if (.not. seeks_equilibrium(stage)) then
            if (abs(stage%tolerance - default%tolerance) > 0) call fail("tolerance needs until = 'equilibrium'")
            if (stage%max_steps /= default%max_steps) call fail("max_steps needs until = 'equilibrium'")
            if (is_given(stage%on_failure)) call fail("on_failure needs until = 'equilibrium'")
         else if (stage%max_steps < least_steps(stage)) then
            call fail('max_steps: equilibrium takes at least '//to_string(least_steps(stage))//' steps: '// &
                      'those in which forces are released (relax_steps), and '//to_string(confirming_steps)// &
                      ' in a row that are in equilibrium; found '//to_string(stage%max_steps))
         end if
         if (.not. any([(is_given(stages(k)%excavate), k=1, i)])) then
            if (is_set(stage%relax)) call fail('relax needs excavate, here or in an earlier stage')
         end if
         if (stage%relax_steps /= default%relax_steps .and. .not. (is_set(stage%relax) .or. &
             is_given(stage%excavate))) call fail('relax_steps needs relax or excavate')
      end associate

   contains

      !> An error about the stage.
      subroutine fail(text)
         character(len=*), intent(in) :: text
         call messages%add(severity%error, '&stage: '//text, stages(i)%origin)
      end subroutine fail

   end subroutine check_stage

   !> Least number of steps of a stage until equilibrium.
   pure integer function least_steps(stage)
      type(stage_type), intent(in) :: stage
      logical :: releases
      least_steps = confirming_steps
      releases = is_given(stage%excavate) .or. is_set(stage%relax)
      if (is_set(stage%relax)) releases = stage%relax > 0
      ! the last part of the forces goes in a step that may be one of them
      if (releases) least_steps = least_steps + stage%relax_steps - 1
   end function least_steps

   !> One change.
   subroutine check_change(stages, change, messages)
      type(stage_type), intent(in) :: stages(:)
      type(change_type), intent(in) :: change
      type(diagnostics_type), intent(inout) :: messages
      character(len=80) :: known(size(stages))
      logical :: of_joint, of_block
      integer :: i
      do i = 1, size(stages)
         known(i) = stage_name(stages, i)
      end do
      if (is_given(change%stage)) then
         if (.not. any([(same_name(stage_name(stages, i), change%stage), i=1, size(stages))])) &
            call messages%add(severity%error, "&change: there is no stage '"//trim(adjustl(change%stage))//"'"// &
                              did_you_mean(trim(adjustl(change%stage)), known), at_word(change%origin, change%stage))
      end if
      of_joint = joint_given()
      of_block = is_set(change%density) .or. is_set(change%young) .or. is_set(change%poisson) .or. &
                 is_set(change%unit_weight)
      if (is_given(change%joint%name)) call fail('the name of a material does not change')
      if (is_given(change%liner)) then
         if (is_given(change%joint_material) .or. is_given(change%block_material) .or. is_given(change%region)) &
            call fail('give liner, joint_material, or block_material or region')
         if (of_joint .or. is_set(change%density) .or. is_set(change%poisson) .or. is_set(change%unit_weight)) &
            call fail('of a lining young alone changes')
         if (.not. is_set(change%young)) call fail('young of the lining is missing')
      else if (is_given(change%joint_material)) then
         if (is_given(change%block_material) .or. is_given(change%region)) &
            call fail('give joint_material, or block_material or region')
         if (of_block) call fail('density, young, poisson and unit_weight are not those of a joint material')
         if (.not. of_joint) call fail('no new value is given')
      else if (is_given(change%block_material) .or. is_given(change%region)) then
         if (of_joint) call fail('values of joints need joint_material')
         if (.not. of_block .and. .not. (is_given(change%block_material) .and. is_given(change%region))) &
            call fail('no new value is given')
      else
         call fail('joint_material, block_material, region or liner is missing')
      end if

   contains

      !> Is a value of a joint material given, beside a name?
      logical function joint_given()
         type(option_rows_type) :: table
         type(joint_material_type) :: joint
         joint = change%joint
         if (allocated(joint%name)) deallocate (joint%name)
         call describe_joint(table, joint)
         joint_given = any([(has_value(table%rows(i)), i=1, table%n)])
      end function joint_given

      !> An error about the change.
      subroutine fail(text)
         character(len=*), intent(in) :: text
         call messages%add(severity%error, '&change: '//text, change%origin)
      end subroutine fail

   end subroutine check_change

   !> Warn of what change i and one before it give the same material, region or lining in the same stage.
   subroutine check_given_again(options, i, messages)
      type(run_options_type), intent(in) :: options
      integer, intent(in) :: i
      type(diagnostics_type), intent(inout) :: messages
      type(option_rows_type) :: before, now
      type(change_type) :: earlier, change
      integer :: k, r
      change = options%changes(i)
      call describe_change(now, change)
      do k = i - 1, 1, -1
         earlier = options%changes(k)
         if (.not. same_subject()) cycle
         before = option_rows_type()
         call describe_change(before, earlier)
         do r = 1, now%n
            if (.not. (has_value(now%rows(r)) .and. has_value(before%rows(r)))) cycle
            call messages%add(severity%warning, '&change: '//now%rows(r)%name//' of the same'//subject()// &
                              ' is given again in the stage, the last one counts; before: '// &
                              place_text(earlier%origin), change%origin)
         end do
      end do

   contains

      !> The rows of a change, without what it is of; the material of a region is a value.
      subroutine describe_change(table, one)
         type(option_rows_type), intent(inout) :: table
         type(change_type), intent(in) :: one
         type(change_type) :: values
         values = one
         if (allocated(values%stage)) deallocate (values%stage)
         if (allocated(values%joint_material)) deallocate (values%joint_material)
         if (allocated(values%block_material) .and. .not. is_given(one%region)) deallocate (values%block_material)
         if (allocated(values%region)) deallocate (values%region)
         if (allocated(values%liner)) deallocate (values%liner)
         if (allocated(values%joint%name)) deallocate (values%joint%name)
         call describe_new_values(table, values)
         call describe_joint(table, values%joint)
      end subroutine describe_change

      !> Do both change the same from the same stage on?
      logical function same_subject()
         integer :: a, b
         same_subject = .false.
         if (.not. (is_given(change%stage) .and. is_given(earlier%stage))) return
         if (.not. same_name(change%stage, earlier%stage)) return
         if (is_given(change%region)) then
            if (.not. is_given(earlier%region)) return
            do a = 1, count_words(change%region)
               do b = 1, count_words(earlier%region)
                  same_subject = same_subject .or. same_name(word_of(change%region, a), word_of(earlier%region, b))
               end do
            end do
         else if (is_given(earlier%region)) then
            return
         else if (is_given(change%liner) .and. is_given(earlier%liner)) then
            same_subject = same_name(change%liner, earlier%liner)
         else if (is_given(change%joint_material) .and. is_given(earlier%joint_material)) then
            same_subject = number_of_material(change%joint_material, options%joint_materials) == &
                           number_of_material(earlier%joint_material, options%joint_materials)
         else if (is_given(change%block_material) .and. is_given(earlier%block_material)) then
            same_subject = number_of_material(change%block_material, options%block_materials) == &
                           number_of_material(earlier%block_material, options%block_materials)
         end if
      end function same_subject

      !> What it is.
      function subject() result(text)
         character(len=:), allocatable :: text
         text = ' material'
         if (is_given(change%region)) text = ' region'
         if (is_given(change%liner)) text = ' lining'
      end function subject

   end subroutine check_given_again

end module rockdda_io_namelist_file
