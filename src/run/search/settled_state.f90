! SPDX-License-Identifier: MIT
!> The state from which all trials of a search begin: the model at rest at the end of a stage.
!>
!> The stages after that one are dropped. Where it does not end with equilibrium, a static stage until equilibrium
!> follows it; behind that stands the stage of the trial, in which nothing but the searched quantity changes. Neither
!> has a coarser tolerance than the default, even if the stage has one.
module rockdda_run_settled_state
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_kinds, only : wp
   use rockdda_model_options, only : change_type, stage_type, unset_integer, unset_real
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_regions, only : same_name
   use rockdda_model_stage_options, only : has_end, is_given, seeks_equilibrium, stage_name
   use rockdda_base_suggest, only : did_you_mean
   use rockdda_interaction_joint_strength, only : joint_law_type
   use rockdda_stepping_control, only : step_control_type
   use rockdda_stepping_simulation, only : simulation_type
   use rockdda_run_search_options, only : usual_max_steps
   implicit none
   private
   public :: add_trial_stage, is_settled, copy_simulation

contains

   !> Keep the stages up to the named one and append those of the search. An unknown name is an error.
   subroutine add_trial_stage(name, parameters, error)
      character(len=*), intent(in) :: name             !! of the last stage before the search; '': the last one
      type(parameters_type), intent(inout) :: parameters
      type(error_type), allocatable, intent(out) :: error
      type(stage_type), allocatable :: stages(:)
      type(stage_type) :: settle, trial
      character(len=80), allocatable :: names(:)
      integer :: i, last
      last = size(parameters%stages)
      if (len_trim(name) > 0) then
         allocate (names(last))
         last = 0
         do i = 1, size(names)
            names(i) = stage_name(parameters%stages, i)
            if (same_name(names(i), name)) last = i
         end do
         if (last == 0) then
            call make_error(error, error_code%input, "option --stage: the model has no stage '"//trim(name)//"'"// &
                            did_you_mean(name, names)//trim(merge('; it has no stages', '                  ', &
                                                                   size(names) == 0)))
            return
         end if
      end if
      settle%name = 'settled'
      settle%kind = 'static'
      settle%until = 'equilibrium'
      settle%max_steps = usual_max_steps
      allocate (stages(0))
      do i = 1, last
         stages = [stages, parameters%stages(i)]
      end do
      if (last > 0) then
         ! a last stage without an end would run for ever
         if (.not. has_end(stages(last))) then
            stages(last)%until = 'equilibrium'
            stages(last)%kind = 'static'
            stages(last)%k01 = unset_real
         end if
         ! a coarser tolerance than the default would take blocks that slide slowly for blocks at rest
         settle%tolerance = min(stages(last)%tolerance, settle%tolerance)
         stages(last)%tolerance = settle%tolerance
         settle%gravity = stages(last)%gravity
      end if
      if (.not. ends_at_rest(stages)) stages = [stages, settle]
      trial = settle
      trial%name = 'trial'
      trial%max_steps = huge(1)
      parameters%stages = [stages, trial]
      if (allocated(parameters%changes)) parameters%changes = changes_of(parameters)
      parameters%ends_with_stages = .true.
      parameters%n_steps = huge(1)
      parameters%t_end = huge(1.0_wp)
   end subroutine add_trial_stage

   !> Does the last stage end with equilibrium?
   pure logical function ends_at_rest(stages)
      type(stage_type), intent(in) :: stages(:)
      integer :: n
      n = size(stages)
      ends_at_rest = .false.
      if (n == 0) return
      ends_at_rest = seeks_equilibrium(stages(n))
      if (is_given(stages(n)%on_failure)) ends_at_rest = ends_at_rest .and. stages(n)%on_failure /= 'continue'
      ends_at_rest = ends_at_rest .and. .not. (stages(n)%until_step > unset_integer .or. &
                     stages(n)%until_time > unset_real .or. stages(n)%duration > unset_real)
   end function ends_at_rest

   !> The changes that belong to the stages that are left.
   pure function changes_of(parameters) result(changes)
      type(parameters_type), intent(in) :: parameters
      type(change_type), allocatable :: changes(:)
      integer :: i, s
      allocate (changes(0))
      do i = 1, size(parameters%changes)
         do s = 1, size(parameters%stages)
            if (.not. same_name(parameters%changes(i)%stage, stage_name(parameters%stages, s))) cycle
            changes = [changes, parameters%changes(i)]
            exit
         end do
      end do
   end function changes_of

   !> Have all stages before that of the trial ended?
   pure logical function is_settled(sim)
      type(simulation_type), intent(in) :: sim
      type(step_control_type) :: next
      next = sim%control
      call next%end_stages(sim%parameters, sim%state%step, sim%state%time)
      is_settled = next%stage >= size(sim%parameters%stages)
   end function is_settled

   !> A simulation in the state of another, with other parameters: the state is what a checkpoint holds.
   subroutine copy_simulation(from, parameters, to, error)
      type(simulation_type), intent(in) :: from
      type(parameters_type), intent(in) :: parameters
      type(simulation_type), intent(out) :: to
      type(error_type), allocatable, intent(out) :: error
      type(joint_law_type), allocatable :: laws(:)
      real(wp), allocatable :: memory(:)
      call to%init(from%model_blocks(), parameters, error)
      if (allocated(error)) return
      to%state = from%state
      to%contacts = from%contacts
      to%control = from%control
      to%construction = from%construction
      ! all that families keep is a state, but the laws of joints are those of the trial
      call move_alloc(to%families%contacts%laws, laws)
      to%families = from%families
      call move_alloc(laws, to%families%contacts%laws)
      to%ledger = from%ledger
      to%record = from%record
      to%line_ends = from%line_ends
      to%families%boundaries%springs%list%start_force = from%families%boundaries%springs%list%start_force
      to%equations%x = from%equations%x
      call from%solver%pack(memory)
      call to%solver%unpack(memory)
   end subroutine copy_simulation

end module rockdda_run_settled_state
