! SPDX-License-Identifier: MIT
!> One trial of a search: the settled state under one value of the searched quantity.
module rockdda_run_trial
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type, error_code, add_context
   use rockdda_base_interruption, only : interruption_type
   use rockdda_base_strings, only : to_string
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_units, only : unit_system_type, unit_system
   use rockdda_stepping_simulation, only : simulation_type
   use rockdda_io_timestamp, only : wall_seconds
   use rockdda_run_limit_by_work, only : find_limit
   use rockdda_run_mechanism, only : mechanism_type, find_mechanism
   use rockdda_run_model_run, only : run_type
   use rockdda_run_open_joints, only : joint_lengths, open_shares
   use rockdda_run_search_options, only : search_options_type, search_kind
   use rockdda_run_searched, only : searched_type
   use rockdda_run_settled_state, only : copy_simulation
   use rockdda_run_trial_pace, only : trial_pace_type
   use rockdda_stepping_stage_watch, only : progress_type
   use rockdda_stepping_verdict, only : verdict_type, verdict, typical_size, usual_share
   implicit none
   private
   public :: trial_type, search_observer_type, compute_trial, begin_trial

   type :: trial_type
      real(wp) :: value = 0
      logical :: stable = .false.
      logical :: decided = .true.          !! false: neither at rest nor moving on when the steps were used up
      integer :: steps = 0
      integer :: beginning = 1             !! > 1: begun again with shorter steps
      real(wp) :: unbalanced = 0           !! of the last step
      real(wp) :: displacement = 0         !! largest of a block since the settled state [length]
      real(wp) :: pull = 0                 !! of what fails, over its area; 0: stable, or not decided
      real(wp) :: limit = 0                !! value at which its work would be none; 0: not known
      real(wp) :: shear = 0                !! largest of a lining over its tensile strength, at the end
      real(wp) :: seconds = 0              !! on the wall clock
      type(mechanism_type) :: mechanism    !! of a failing trial
      real(wp), allocatable :: open(:)     !! (joint materials) share of their joints that is open at the end
   end type trial_type

   !> What the caller of a search sees of it, and its way to stop it. The defaults do nothing.
   type, extends(interruption_type) :: search_observer_type
   contains
      procedure :: is_requested => never
      procedure :: progress
      procedure :: warn
   end type search_observer_type

   !> Vertices move no further in a step than this share of the size of a typical block.
   real(wp), parameter :: step_share = 0.01_wp
   !> A trial whose steps cannot be solved is begun again with steps shorter by this factor, so often.
   real(wp), parameter :: shorter = 0.1_wp
   integer, parameter :: most_beginnings = 3
   !> The limit of a failing trial is the nearest one of so many static steps, the last ones: what rattles works too.
   integer, parameter :: last_steps = 5

contains

   !> No request to stop.
   logical function never(self)
      class(search_observer_type), intent(in) :: self
      never = .false.
   end function never

   !> Called after each step.
   subroutine progress(self, text)
      class(search_observer_type), intent(in) :: self
      character(len=*), intent(in) :: text
   end subroutine progress

   !> Called with a warning about a trial.
   subroutine warn(self, text)
      class(search_observer_type), intent(in) :: self
      character(len=*), intent(in) :: text
   end subroutine warn

   !> The settled state with the parameters of a trial.
   subroutine begin_trial(settled, searched, value, beginning, sim, error)
      type(simulation_type), intent(in) :: settled
      type(searched_type), intent(in) :: searched
      real(wp), intent(in) :: value
      integer, intent(in) :: beginning          !! from 1; each further one has shorter steps
      type(simulation_type), intent(out) :: sim
      type(error_type), allocatable, intent(out) :: error
      type(parameters_type) :: parameters
      real(wp) :: shortening
      parameters = settled%parameters
      call searched%scale(value, parameters)
      parameters%displacement_ratio = min(parameters%displacement_ratio, &
                                          step_share*typical_size(settled)/parameters%w0)
      shortening = shorter**(beginning - 1)
      parameters%dt_max = parameters%dt_max*shortening
      parameters%dt_min = parameters%dt_min*shortening**2
      call copy_simulation(settled, parameters, sim, error)
      if (allocated(error)) return
      sim%control%dt = min(sim%control%dt, parameters%dt_max)
      ! loads that a model does not carry yet move it by more than its deformation before
      sim%control%brisk%is_on = searched%kind /= search_kind%load
   end subroutine begin_trial

   !> Compute a trial until its verdict. `run` holds the simulation; when its results are open they are written.
   !> `interrupted`: a stop was requested, and there is no verdict. Error: the steps cannot be solved.
   subroutine compute_trial(settled, options, searched, value, observer, run, trial, interrupted, error)
      type(simulation_type), intent(in) :: settled
      type(search_options_type), intent(in) :: options
      type(searched_type), intent(in) :: searched
      real(wp), intent(in) :: value
      class(search_observer_type), intent(in) :: observer
      type(run_type), intent(inout) :: run
      type(trial_type), intent(out) :: trial
      logical, intent(out) :: interrupted
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: start
      integer :: beginning
      start = wall_seconds()
      trial%value = value
      do beginning = 1, most_beginnings
         if (.not. run%is_open) call begin_trial(settled, searched, value, beginning, run%sim, error)
         trial%beginning = beginning
         if (allocated(error)) return
         call run%sim%set_interruption(observer)
         call advance_trial(options, searched, observer, run, trial, interrupted, error)
         if (.not. allocated(error)) exit
         if (error%code /= error_code%computation .or. error%is_fatal .or. run%is_open) exit
      end do
      if (.not. (interrupted .or. allocated(error))) then
         trial%open = open_shares(run%sim, joint_lengths(settled))
         trial%shear = shear_of_linings(run%sim)
      end if
      trial%seconds = wall_seconds() - start
      if (allocated(error)) call add_context(error, 'the trial of '//to_string(value, 6)//' has no verdict')
   end subroutine compute_trial

   !> Largest mean shear stress of a lining, over its tensile strength.
   real(wp) function shear_of_linings(sim) result(largest)
      type(simulation_type), intent(in) :: sim
      integer :: k
      largest = 0
      do k = 1, size(sim%families%liners%liners)
         associate (section => sim%families%liners%liners(k)%section)
            largest = max(largest, sim%families%liners%shear_stress(k)/section%tension)
         end associate
      end do
   end function shear_of_linings

   !> The steps of a trial.
   subroutine advance_trial(options, searched, observer, run, trial, interrupted, error)
      type(search_options_type), intent(in) :: options
      type(searched_type), intent(in) :: searched
      class(search_observer_type), intent(in) :: observer
      type(run_type), intent(inout) :: run
      type(trial_type), intent(inout) :: trial
      logical, intent(out) :: interrupted
      type(error_type), allocatable, intent(out) :: error
      type(verdict_type) :: judgement
      real(wp) :: pull, limits(last_steps)
      type(progress_type) :: waiting
      type(trial_pace_type) :: pace
      integer :: outcome
      type(unit_system_type) :: system
      interrupted = .false.
      system = unit_system(run%sim%parameters%units)
      outcome = verdict%open
      limits = 0
      if (options%kind == search_kind%load) then
         ! the model at rest does not carry these loads yet
         call judgement%begin(run%sim, usual_share, any(abs(run%sim%state%stress) > 0))
      else
         call judgement%begin(run%sim, is_trial=.true.)
      end if
      trial%steps = 0
      do while (outcome == verdict%open .and. trial%steps < options%max_steps)
         call run%sim%advance(error)
         if (allocated(error)) return
         interrupted = run%sim%interrupted
         if (interrupted) return
         trial%steps = trial%steps + 1
         if (pace%carries) then
            call judgement%measure(run%sim, run%sim%forces)
         else
            outcome = judgement%judge(run%sim, run%sim%forces)
            call find_limit(run%sim, searched, trial%value, pull, limits(1 + modulo(judgement%steps, last_steps)))
         end if
         call pace%follow(maxval(judgement%moved), judgement%way_moved(run%sim), run%sim)
         call run%write_step(error)
         if (allocated(error)) return
         trial%unbalanced = run%sim%record%unbalanced
         trial%displacement = maxval(judgement%moved)
         call observer%progress(to_string(trial%value, 6)//', step '//to_string(trial%steps)//', unbalanced '// &
                                to_string(trial%unbalanced, 2)//', moved '// &
                                system%shown(trial%displacement, 'length', 2))
         interrupted = observer%is_requested()
         if (interrupted) return
         if (waiting%stalls(trial%unbalanced, options%max_steps)) exit
      end do
      trial%decided = outcome /= verdict%open
      trial%stable = outcome == verdict%stable
      if (outcome == verdict%failing) then
         trial%pull = pull
         if (any(abs(limits) > 0)) trial%limit = limits(minloc(abs(limits - trial%value), dim=1, mask=abs(limits) > 0))
      end if
      if (.not. trial%stable) call find_mechanism(run%sim, judgement, trial%mechanism)
   end subroutine advance_trial

end module rockdda_run_trial
