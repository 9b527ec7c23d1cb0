! SPDX-License-Identifier: MIT
!> The length of each step, and which stage it belongs to.
!>
!> dt starts at dt_max. A step that does not converge, or moves a vertex further than displacement_ratio*w0, is
!> begun again with a smaller dt, not below dt_min (rockdda_stepping_trial_step); after an accepted step dt grows back
!> by at most `growth` towards dt_max, and not beyond what the last step's displacement allows (`accepted`). Ends of
!> stages and runs shorten one step (`step_size`).
!>
!> In a static stage until equilibrium dt grows beyond dt_max, up to max_growth times as far: by `fast_growth` while the
!> open-close iteration needs few rounds, and back when it needs many.
module rockdda_stepping_control
   use rockdda_base_kinds, only : wp
   use rockdda_model_options, only : stage_type, is_set
   use rockdda_model_parameters, only : parameters_type
   use rockdda_interaction_time_scheme, only : time_scheme_type, shi_scheme, generalized_alpha
   use rockdda_stepping_stage_watch, only : stage_watch_type
   use rockdda_stepping_method, only : method_type
   use rockdda_stepping_strikes, only : strikes_type
   use rockdda_stepping_time_error, only : time_error_type
   use rockdda_stepping_trend, only : trend_type
   use rockdda_model_stage_options, only : seeks_equilibrium, is_given, water_of_stage, stage_k01, stage_number, &
      confirming_steps
   implicit none
   private
   public :: step_control_type, new_step_control, cut_for_displacement
   public :: cut_reason, n_cut_reasons, cut_names, goes_on

   !> Why an attempt at a step is repeated with a shorter step.
   type :: cut_reason_enum
      integer :: displacement = 1   !! a vertex would move further than g2 w0
      integer :: contacts = 2       !! contacts still change after the last open-close round
      integer :: solver = 3         !! the equations could not be solved
      integer :: ruined_block = 4   !! a block would invert or vanish
   end type cut_reason_enum
   type(cut_reason_enum), parameter :: cut_reason = cut_reason_enum()
   integer, parameter :: n_cut_reasons = 4
   !> Names for programs.
   character(len=*), parameter :: cut_names(n_cut_reasons) = [character(len=16) :: 'displacement', 'contacts', &
                                                             'solver', 'ruined_block']

   !> Steps of a trial of a search: its verdict matters, and not the place where it comes to rest.
   type :: brisk_type
      logical :: is_on = .false.
      real(wp) :: longest = huge(1.0_wp)           !! no step is longer: a longer one has failed lately [time]
      real(wp) :: last_unbalanced = huge(1.0_wp)   !! of the step before the last accepted one
   end type brisk_type

   !> Brisk steps grow where the unbalanced force falls by less than this share from one to the next.
   real(wp), parameter :: hardly_falls = 0.05_wp

   !> Part of the state of a run.
   type :: step_control_type
      real(wp) :: dt = 0                    !! next step to try [time]
      real(wp) :: last_dt = 0               !! of the last accepted step
      real(wp) :: last_displacement = 0     !! largest vertex displacement of the last accepted step [length]
      real(wp) :: last_k01 = 1              !! with which its velocity was carried on
      integer :: stage = 1                  !! present stage; beyond the list: no stage
      integer :: begun = 0                  !! stages whose start has been carried out
      integer :: first_step = 0             !! steps before the present stage
      real(wp) :: first_time = 0            !! time at its start
      real(wp) :: motion_start = 0          !! time at which base motion begins; huge: not yet
      integer :: balanced = 0               !! last steps in a row that were in equilibrium
      integer :: steps = 0                  !! of the present stage
      type(stage_watch_type) :: watch       !! what shows that the stage does not come to rest
      real(wp) :: unbalanced = 0            !! of the last accepted step
      real(wp) :: slip_share = 0            !! of friction in the work of the contacts in that step
      logical :: idle = .false.             !! that step was solved without an iteration: what it left was small enough
      logical :: releases = .false.         !! forces of excavated blocks are still being released
      logical, allocatable :: released(:)   !! (nf) fixed points let go so far
      integer :: cuts(n_cut_reasons) = 0    !! steps cut so far, by reason
      type(trend_type) :: trend             !! of static steps that do not search equilibrium
      type(time_error_type) :: time_error   !! of dynamic steps
      type(strikes_type) :: strikes         !! of blocks on others in them
      type(method_type) :: method           !! no part of the state
      type(brisk_type) :: brisk             !! no part of the state
      integer :: short_steps = 0            !! accepted steps after which dt could not grow back because of g2 w0
   contains
      procedure :: k01
      procedure :: is_dynamic
      procedure :: is_static
      procedure :: scheme
      procedure :: gravity
      procedure :: water
      procedure :: step_size
      procedure :: accepted
      procedure :: end_stages
      procedure :: next_stage
      procedure :: following_stage
      procedure :: is_static_search
      procedure, private :: is_lenient
      procedure :: seeks_rest
      procedure :: residual_enough
      procedure :: force_slack
      procedure :: is_like_last
      procedure :: carry
      procedure :: begin_release
      procedure :: has_failed
      procedure :: judge_balance
      procedure :: stage_index
      procedure :: skipped
   end type step_control_type

contains

   !> Control at the start of a run.
   pure subroutine new_step_control(parameters, n_fixed, control)
      type(parameters_type), intent(in) :: parameters
      integer, intent(in) :: n_fixed
      type(step_control_type), intent(out) :: control
      control%dt = parameters%dt_max
      allocate (control%released(n_fixed), source=.false.)
      call control%time_error%init()
      call control%strikes%init()
      if (.not. is_given(parameters%base%stage)) return
      ! a search leaves out the stages behind its own
      if (stage_number(parameters%stages, parameters%base%stage) /= 1) control%motion_start = huge(1.0_wp)
   end subroutine new_step_control

   !> k01 of the present stage.
   pure real(wp) function k01(self, parameters)
      class(step_control_type), intent(in) :: self
      type(parameters_type), intent(in) :: parameters
      k01 = parameters%k01
      if (self%stage <= size(parameters%stages)) k01 = stage_k01(parameters%stages(self%stage), k01)
   end function k01

   !> Are velocities carried on whole in the present stage?
   pure logical function is_dynamic(self, parameters)
      class(step_control_type), intent(in) :: self
      type(parameters_type), intent(in) :: parameters
      is_dynamic = self%k01(parameters) >= 1
   end function is_dynamic

   !> Does each step of the present stage begin at rest? Stages in between lose a part of the velocity in each step.
   pure logical function is_static(self, parameters)
      class(step_control_type), intent(in) :: self
      type(parameters_type), intent(in) :: parameters
      is_static = self%k01(parameters) <= 0
   end function is_static

   !> Time integration of the present stage: static stages, and those that lose velocity, have Shi's.
   pure type(time_scheme_type) function scheme(self, parameters)
      class(step_control_type), intent(in) :: self
      type(parameters_type), intent(in) :: parameters
      scheme = shi_scheme()
      if (.not. self%is_dynamic(parameters)) return
      if (parameters%second_order) scheme = generalized_alpha(parameters%rho_infinity)
      scheme%is_dynamic = .true.
   end function scheme

   !> Does a static stage search equilibrium with steps that may grow?
   pure logical function is_static_search(self, parameters)
      class(step_control_type), intent(in) :: self
      type(parameters_type), intent(in) :: parameters
      is_static_search = .false.
      if (self%stage > size(parameters%stages)) return
      is_static_search = seeks_equilibrium(parameters%stages(self%stage)) .and. self%is_static(parameters) .and. &
                         parameters%max_growth > 1
   end function is_static_search

   !> May a step leave forces that are small beside the unbalanced one to the next step? Static ones that search
   !> equilibrium may, and in a trial those that carry velocities on.
   pure logical function is_lenient(self, parameters)
      class(step_control_type), intent(in) :: self
      type(parameters_type), intent(in) :: parameters
      is_lenient = self%is_static_search(parameters)
      if (self%brisk%is_on) is_lenient = is_lenient .or. (self%seeks_rest(parameters) .and. parameters%max_growth > 1)
   end function is_lenient

   !> Does the present stage end with equilibrium?
   pure logical function seeks_rest(self, parameters)
      class(step_control_type), intent(in) :: self
      type(parameters_type), intent(in) :: parameters
      seeks_rest = .false.
      if (self%stage <= size(parameters%stages)) seeks_rest = seeks_equilibrium(parameters%stages(self%stage))
   end function seeks_rest

   !> Relative residual at which the solver may stop, 0: its own tolerance. What it leaves is a force on the blocks,
   !> which the next step takes up; where a static stage searches equilibrium it only has to be small beside the
   !> unbalanced force that the stage allows. The residual is over all blocks: even the whole of it on one block is then
   !> small. Residuals are weighted by flexibilities, so that beside loose blocks it may not be small on stiff ones:
   !> when a step has needed no iteration the next one is solved to the tolerance of the solver.
   pure real(wp) function residual_enough(self, parameters, n_blocks)
      class(step_control_type), intent(in) :: self
      type(parameters_type), intent(in) :: parameters
      integer, intent(in) :: n_blocks
      residual_enough = 0
      if (self%is_lenient(parameters) .and. .not. (self%idle .and. self%steps > 0)) residual_enough = &
         self%method%small_residual*parameters%stages(self%stage)%tolerance/sqrt(real(n_blocks, wp))
   end function residual_enough

   !> Share of the largest normal force by which contact forces may miss their laws, 0: their own tolerance, with which
   !> a stage begins.
   pure real(wp) function force_slack(self, parameters)
      class(step_control_type), intent(in) :: self
      type(parameters_type), intent(in) :: parameters
      force_slack = 0
      if (self%is_lenient(parameters) .and. self%steps > 0) &
         force_slack = max(self%method%least_miss, min(self%method%small_miss*self%unbalanced, &
                                                       self%method%largest_miss))
   end function force_slack

   !> Is a static step that searches equilibrium much like the last one, and no shorter?
   pure logical function is_like_last(self, parameters, dt)
      class(step_control_type), intent(in) :: self
      type(parameters_type), intent(in) :: parameters
      real(wp), intent(in) :: dt             !! step [time]
      is_like_last = self%is_static_search(parameters) .and. self%steps > 0 .and. .not. dt < self%last_dt .and. &
                dt < self%method%much_longer*self%last_dt
   end function is_like_last

   !> Weight with which a static step takes the change of acceleration since the last step into account, so that blocks
   !> that slip go the way of steps of dt_max in longer ones.
   !>
   !> With k01 = 0 the inertia of a step is a damper: M y' = F, of which a step is Euler's implicit one of length
   !> s = dt**2/2. Its leading error, s/2 y'', vanishes with the difference of second order (weight w = s/(s + s0), s0
   !> that of the last step). Of this weight the share 1 - dt_max**2/dt**2 is taken, which leaves the error of a step of
   !> dt_max.
   pure real(wp) function carry(self, parameters, dt) result(weight)
      class(step_control_type), intent(in) :: self
      type(parameters_type), intent(in) :: parameters
      real(wp), intent(in) :: dt             !! step [time]
      weight = 0
      if (.not. self%is_like_last(parameters, dt) .or. self%releases) return
      if (self%slip_share > self%method%no_slip .and. dt > parameters%dt_max) &
         weight = (1 - (parameters%dt_max/dt)**2)*dt**2/(dt**2 + self%last_dt**2)
   end function carry

   !> Let a stage that releases forces begin with a long step.
   pure subroutine begin_release(self, parameters)
      class(step_control_type), intent(inout) :: self
      type(parameters_type), intent(in) :: parameters
      if (self%is_static_search(parameters)) &
         self%dt = max(self%dt, min(self%method%first_release, parameters%max_growth)*parameters%dt_max)
   end subroutine begin_release

   !> Number of the present stage in the results, from 0; after the last stage one more.
   pure integer function stage_index(self)
      class(step_control_type), intent(in) :: self
      stage_index = self%stage - 1
   end function stage_index

   !> Stages that are over, but whose start has not been carried out: their ends had passed before they began.
   pure function skipped(self, parameters) result(stages)
      class(step_control_type), intent(in) :: self
      type(parameters_type), intent(in) :: parameters
      integer, allocatable :: stages(:)
      integer :: i
      stages = [(i, i=self%begun + 1, min(self%stage - 1, size(parameters%stages)))]
   end function skipped

   !> Factor on the weights in the present stage.
   pure real(wp) function gravity(self, parameters)
      class(step_control_type), intent(in) :: self
      type(parameters_type), intent(in) :: parameters
      gravity = 1
      if (self%stage <= size(parameters%stages)) gravity = parameters%stages(self%stage)%gravity
   end function gravity

   !> Names of the groups of &water that act in the present stage: those of the last stage that names some; empty: all.
   pure function water(self, parameters) result(names)
      class(step_control_type), intent(in) :: self
      type(parameters_type), intent(in) :: parameters
      character(len=:), allocatable :: names
      names = water_of_stage(parameters%stages, self%stage)
   end function water

   !> The step to try from `time`: dt, or what is left to the next end of a stage or of the run.
   pure real(wp) function step_size(self, parameters, time) result(dt)
      class(step_control_type), intent(in) :: self
      type(parameters_type), intent(in) :: parameters
      real(wp), intent(in) :: time
      real(wp) :: target
      dt = self%dt
      target = parameters%t_end
      if (self%stage <= size(parameters%stages)) then
         associate (stage => parameters%stages(self%stage))
            if (is_set(stage%until_time)) target = min(target, stage%until_time)
            if (is_set(stage%duration)) target = min(target, self%first_time + stage%duration)
         end associate
      end if
      ! a remainder below 1e-6 dt is taken along, so that round-off in the time makes no extra step
      if (time + dt*(1 + 1.0e-6_wp) >= target .and. target > time) dt = target - time
   end function step_size

   !> Next dt after an accepted step.
   pure subroutine accepted(self, parameters, dt, displacement, shortened, k01_used, rounds, may_grow)
      class(step_control_type), intent(inout) :: self
      type(parameters_type), intent(in) :: parameters
      real(wp), intent(in) :: dt             !! step [time]
      real(wp), intent(in) :: displacement   !! largest of any vertex [length]
      logical, intent(in) :: shortened     !! dt was shortened to land on an end: keep the dt that was wanted
      real(wp), intent(in) :: k01_used
      integer, intent(in), optional :: rounds    !! of all attempts at the step
      logical, intent(in), optional :: may_grow  !! beyond dt_max; default: not
      real(wp) :: limit, wanted
      self%last_dt = dt
      self%last_displacement = displacement
      self%last_k01 = k01_used
      limit = parameters%displacement_ratio*parameters%w0
      if (shortened) return
      wanted = min(parameters%dt_max, self%method%growth*dt)
      if (present(may_grow) .and. present(rounds)) then
         if (may_grow) wanted = grown_step(self, parameters, dt, rounds)
      end if
      if (displacement*wanted > 0.9_wp*limit*dt .and. wanted > dt) then
         wanted = max(dt, min(wanted, 0.9_wp*limit*dt/displacement))
         self%short_steps = self%short_steps + 1
      end if
      self%dt = max(parameters%dt_min, wanted)
   end subroutine accepted

   !> Smaller step after one that moved too far.
   pure real(wp) function cut_for_displacement(parameters, dt, displacement) result(smaller)
      type(parameters_type), intent(in) :: parameters
      real(wp), intent(in) :: dt             !! step [time]
      real(wp), intent(in) :: displacement   !! largest of any vertex [length]
      real(wp) :: limit
      limit = parameters%displacement_ratio*parameters%w0
      smaller = max(parameters%dt_min, dt*max(parameters%cut_factor, min(0.9_wp, 0.8_wp*limit/displacement)))
   end function cut_for_displacement

   !> Next step of a static stage until equilibrium.
   pure real(wp) function grown_step(self, parameters, dt, rounds) result(wanted)
      class(step_control_type), intent(in) :: self
      type(parameters_type), intent(in) :: parameters
      real(wp), intent(in) :: dt             !! step [time]
      integer, intent(in) :: rounds          !! of all attempts at the step
      associate (m => self%method)
         wanted = dt*merge(m%fast_growth, m%growth, rounds <= m%few_rounds)
         ! while forces are released their shares are the way, which inertia would only delay
         if (.not. self%releases) then
            if (self%slip_share > m%much_slip) &
               wanted = dt*merge(m%slow_growth, m%growth, self%unbalanced > m%very_nearly)
            if (self%slip_share > m%no_slip .and. self%unbalanced > m%nearly .and. self%steps < m%most_held) &
               wanted = min(max(m%held_length*parameters%dt_max, dt), m%slow_growth*dt)
            if (self%brisk%is_on) then
               if (self%unbalanced > (1 - hardly_falls)*self%brisk%last_unbalanced) wanted = max(wanted, m%growth*dt)
               wanted = min(wanted, self%brisk%longest)
            end if
            ! a step that was cut grows back as everywhere
            wanted = max(wanted, min(parameters%dt_max, m%growth*dt))
         end if
         if (rounds > m%many_rounds*parameters%max_open_close) wanted = m%slow_down*dt
      end associate
      wanted = max(parameters%dt_min, min(wanted, parameters%dt_max*parameters%max_growth))
   end function grown_step

   !> Leave the stages that have ended; their fixed points to release are marked.
   pure subroutine end_stages(self, parameters, step, time)
      class(step_control_type), intent(inout) :: self
      type(parameters_type), intent(in) :: parameters
      integer, intent(in) :: step      !! accepted steps so far
      real(wp), intent(in) :: time
      integer :: i
      do while (self%stage <= size(parameters%stages))
         associate (stage => parameters%stages(self%stage))
            if (.not. has_ended(stage)) return
            if (allocated(stage%release)) then
               do i = 1, size(stage%release)
                  if (stage%release(i) >= 1 .and. stage%release(i) <= size(self%released)) &
                     self%released(stage%release(i)) = .true.
               end do
            end if
         end associate
         self%stage = self%stage + 1
         self%first_step = step
         self%steps = 0
         self%first_time = time
         if (is_given(parameters%base%stage)) then
            if (stage_number(parameters%stages, parameters%base%stage) == self%stage) self%motion_start = time
         end if
         self%balanced = 0
         ! a static stage may have grown its steps; another one continues with them
         if (.not. self%is_static_search(parameters)) self%dt = min(self%dt, parameters%dt_max)
      end do

   contains

      !> Is the stage over?
      pure logical function has_ended(stage)
         type(stage_type), intent(in) :: stage
         has_ended = .false.
         if (is_set(stage%until_step)) has_ended = step >= stage%until_step
         if (is_set(stage%until_time)) has_ended = has_ended .or. &
                                                   time >= stage%until_time*(1 - 1.0e-12_wp)
         if (is_set(stage%duration)) has_ended = has_ended .or. &
                                                 time >= (self%first_time + stage%duration)*(1 - 1.0e-12_wp)
         if (.not. seeks_equilibrium(stage)) return
         has_ended = has_ended .or. self%balanced >= confirming_steps
         if (goes_on(stage)) has_ended = has_ended .or. step - self%first_step >= stage%max_steps
      end function has_ended

   end subroutine end_stages

   !> Is a stage without equilibrium to be followed by the next one?
   pure logical function goes_on(stage)
      type(stage_type), intent(in) :: stage
      goes_on = .false.
      if (allocated(stage%on_failure)) goes_on = stage%on_failure == 'continue'
   end function goes_on

   !> Has the present stage, which has not ended, had all its steps without coming to equilibrium, or does it run away?
   pure logical function has_failed(self, parameters, step)
      class(step_control_type), intent(in) :: self
      type(parameters_type), intent(in) :: parameters
      integer, intent(in) :: step      !! accepted steps so far
      has_failed = .false.
      if (self%stage > size(parameters%stages)) return
      associate (stage => parameters%stages(self%stage))
         if (.not. seeks_equilibrium(stage)) return
         has_failed = self%balanced < confirming_steps .and. (step - self%first_step >= stage%max_steps .or. &
                      self%watch%runs_away .and. .not. goes_on(stage))
      end associate
   end function has_failed

   !> The stage that the next step belongs to. In runs that do not end with their last stage the present one.
   pure integer function next_stage(self, parameters, step, time)
      class(step_control_type), intent(in) :: self
      type(parameters_type), intent(in) :: parameters
      integer, intent(in) :: step      !! accepted steps so far
      real(wp), intent(in) :: time
      next_stage = self%stage
      if (parameters%ends_with_stages) next_stage = self%following_stage(parameters, step, time)
   end function next_stage

   !> The stage that `end_stages` continues with.
   pure integer function following_stage(self, parameters, step, time)
      class(step_control_type), intent(in) :: self
      type(parameters_type), intent(in) :: parameters
      integer, intent(in) :: step      !! accepted steps so far
      real(wp), intent(in) :: time
      type(step_control_type) :: next
      ! only what determines when stages end: other parts hold numbers of all blocks
      next%stage = self%stage
      next%first_step = self%first_step
      next%first_time = self%first_time
      next%balanced = self%balanced
      next%released = self%released
      call next%end_stages(parameters, step, time)
      following_stage = next%stage
   end function following_stage

   !> Count the steps in a row that end in equilibrium.
   pure subroutine judge_balance(self, parameters, unbalanced, is_driven, moves_on)
      class(step_control_type), intent(inout) :: self
      type(parameters_type), intent(in) :: parameters
      real(wp), intent(in) :: unbalanced   !! at the end of the step
      logical, intent(in) :: is_driven     !! supports move, or forces are still being released
      logical, intent(in) :: moves_on      !! small forces have moved the blocks: another step confirms the rest
      self%brisk%last_unbalanced = self%unbalanced
      self%unbalanced = unbalanced
      self%steps = self%steps + 1
      if (self%stage > size(parameters%stages)) return
      associate (stage => parameters%stages(self%stage))
         if (.not. seeks_equilibrium(stage)) return
         self%balanced = merge(self%balanced + 1, 0, unbalanced <= stage%tolerance .and. .not. is_driven)
         if (moves_on) self%balanced = min(self%balanced, confirming_steps - 1)
      end associate
   end subroutine judge_balance

end module rockdda_stepping_control
