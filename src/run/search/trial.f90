! SPDX-License-Identifier: MIT
!> One trial of a search: the settled state under one value of the searched quantity.
!>
!> The limit is guessed from the last step of a trial that fails. At the end of a static step inertia takes what no
!> other force holds. Its work P along the motion of the step is zero
!> at the limit. What the searched quantity does to P is known when normal forces and mechanism stay as they are: the
!> friction of the searched joints, of work R, is R f/F at a factor F instead of f, so that P is zero at f R/(R + P);
!> loads whose direction changes do more work. It is a guess, by which a search chooses the next value to try.
!>
!> The pace is that of static steps, and of steps that carry velocities on where static ones hardly move. Every
!> static step begins at rest, so that a constant pull P moves a mass m by P dt**2/(2 m) in each step. Where
!> contacts open and close all the time, steps stay short, and a mechanism whose forces miss equilibrium by a thousandth
!> needs thousands of steps to move as far as its verdict needs. Steps that carry velocities on move it by n**2 times as
!> much in n steps. So velocities are carried on, for a while, when
!>
!>     the model is stuck     the unbalanced force no longer falls and blocks hardly move
!>     the model slides       all that contacts do is friction, and the unbalanced force falls far less than the way
!>                            grows
!>
!> and static steps follow, one of which shows whether a model that slides continues alike. The verdict is reached in
!> static steps alone: it compares pulls of blocks that begin at rest. A block that is slowed down loses its velocity,
!> so that it goes past the place where it would rest by no more than one step, as in static steps.
module rockdda_run_trial
   use rockdda_base_kinds, only : wp, pi
   use rockdda_base_error, only : error_type, error_code, add_context
   use rockdda_base_interruption, only : interruption_type
   use rockdda_base_strings, only : to_string
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_units, only : unit_system_type, unit_system
   use rockdda_model_state, only : radius_of_inertia
   use rockdda_stepping_lodging, only : lodging_type
   use rockdda_stepping_simulation, only : simulation_type
   use rockdda_io_timestamp, only : wall_seconds
   use rockdda_run_mechanism, only : mechanism_type, find_mechanism
   use rockdda_run_model_run, only : run_type
   use rockdda_run_open_joints, only : joint_lengths, open_shares
   use rockdda_run_search_options, only : search_options_type, search_kind
   use rockdda_run_searched, only : searched_type
   use rockdda_run_settled_state, only : copy_simulation
   use rockdda_run_support_uses, only : support_use_type, find_uses, find_unused, friction_work
   use rockdda_stepping_stage_watch, only : progress_type
   use rockdda_stepping_verdict, only : loaded_apart, verdict_type, verdict, typical_size, usual_share
   implicit none
   private
   public :: trial_facts_type, trial_type, search_observer_type, compute_trial, begin_trial, find_inside, most_motion

   !> A stable trial that moves a block by more than this share of a typical block's size has moved something. So far
   !> elastic bolts are waited for.
   real(wp), parameter :: most_motion = 0.01_wp

   !> Static steps after which the least unbalanced force is compared with the least one before: while steps are shorter
   !> than dt_max, else; when velocities have been carried, so few that they show whether the pull has stayed.
   integer, parameter :: short_steps = 10, static_steps = 20, checking_steps = 10
   !> Velocities are carried when the unbalanced force is still more than the first share, and the largest distance from
   !> the settled state has grown by less than the second factor in these steps.
   real(wp), parameter :: no_progress = 0.5_wp, farther = 1.5_wp
   !> They are carried over this number of steps, until the distance has grown by `farther`: verdicts compare pulls at
   !> distances that lie as far apart, or until blocks swing back.
   integer, parameter :: carried_steps = 100
   !> A model slides when `sliding_steps` steps in a row have a larger share of friction than this in the work of the
   !> contacts, it has moved by more than this part of a first length, and the logarithm of the unbalanced force has
   !> fallen by less than this part of the rise of that of the distance. It slides on alike when the unbalanced force
   !> after the steps that carry is more than this share of that before.
   real(wp), parameter :: mostly = 0.9_wp, least_way = 0.25_wp, hardly_falls = 0.15_wp, alike = 0.98_wp
   integer, parameter :: sliding_steps = 3
   !> After a step that had to be cut no longer one than this part of it is tried for this number of steps.
   real(wp), parameter :: shorter_step = 0.7_wp
   integer, parameter :: cautious_steps = 15
   !> Share of the velocity that is carried on. Below 1, so that blocks that ring about their place come to rest.
   real(wp), parameter :: carried = 0.95_wp

   type :: trial_pace_type
      logical :: carries = .false.                       !! the next step begins with the velocities of this one
      integer, private :: steps = 0                      !! since the pace has changed, or was checked
      integer, private :: enough = static_steps
      real(wp), private :: least = huge(1.0_wp)          !! unbalanced force of these steps
      real(wp), private :: least_before = huge(1.0_wp)
      real(wp), private :: start = 0                     !! distance when the pace changed, or was checked [length]
      integer, private :: slides = 0                     !! static steps in a row in which the model slides
      logical, private :: has_slid = .false.             !! velocities were carried because it did
      real(wp), private :: sliding_pull = 0              !! unbalanced force then
      real(wp), private :: last_distance = 0, last_unbalanced = 0   !! after the last static step
      integer, private :: since_cut = 0                  !! steps
      real(wp), private :: farthest = 0                  !! distance while velocities are carried [length]
      real(wp), private :: dt = 0                        !! longest step that carries velocities [time]
   contains
      procedure :: follow
      procedure, private :: set
      procedure, private :: watch_slide
      procedure, private :: watch_cuts
   end type trial_pace_type

   !> What the journal keeps of a trial in the order of its components.
   type :: trial_facts_type
      real(wp) :: value = 0
      logical :: stable = .false.
      logical :: decided = .true.          !! false: neither at rest nor moving on when the steps were used up
      logical :: is_sure = .true.          !! false: it fails by few steps
      integer :: steps = 0
      integer :: beginning = 1             !! > 1: begun again with shorter steps
      real(wp) :: unbalanced = 0           !! of the last step
      real(wp) :: displacement = 0         !! largest of a block since the settled state [length]
      real(wp) :: pull = 0                 !! of what fails, over its area; 0: stable, or not decided
      real(wp) :: limit = 0                !! value at which its work would be none; 0: not known
      real(wp) :: shear = 0                !! largest of a lining over its tensile strength, at the end
      real(wp) :: inside = 0               !! depth of blocks in each other at the end, over the smaller inradius
      integer :: inside_blocks(2) = 0      !! those that are deepest; 0: none
      real(wp) :: inside_place(2) = 0      !! of these [length]
      integer :: unused = 0                !! a bolt that could hold what fails, alone or with others; 0: none could
      real(wp) :: seconds = 0              !! on the wall clock
   end type trial_facts_type

   type, extends(trial_facts_type) :: trial_type
      character(len=2000) :: fault = ''    !! why it has no solution; '': it has one
      type(mechanism_type) :: mechanism    !! of a failing trial
      real(wp), allocatable :: open(:)     !! (joint materials) share of their joints that is open at the end
      type(support_use_type), allocatable :: supports(:)   !! springs, bolts, linings at the end
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
   !> The limit of a failing trial is the nearest one of this number of last static steps: what rattles works too.
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
   end subroutine begin_trial

   !> Compute a trial until its verdict. `run` holds the simulation; when its results are open they are written.
   !> `interrupted`: a stop was requested, and there is no verdict. Error: the steps cannot be solved.
   subroutine compute_trial(settled, options, searched, value, preliminary, observer, run, trial, interrupted, error)
      type(simulation_type), intent(in) :: settled
      type(search_options_type), intent(in) :: options
      type(searched_type), intent(in) :: searched
      real(wp), intent(in) :: value
      logical, intent(in) :: preliminary         !! it may fail by few steps
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
         ! one trial at a time makes texts: gfortran keeps the lengths of those that functions return in static memory
         !$omp critical (rockdda_trial_text)
         if (.not. run%is_open) call begin_trial(settled, searched, value, beginning, run%sim, error)
         !$omp end critical (rockdda_trial_text)
         trial%beginning = beginning
         if (allocated(error)) return
         ! loads that a model does not carry yet move it by more than its deformation before
         run%sim%control%brisk%is_on = searched%kind /= search_kind%load
         call run%sim%set_interruption(observer)
         call advance_trial(options, searched, preliminary, observer, run, trial, interrupted, error)
         if (.not. allocated(error)) exit
         if (error%code /= error_code%computation .or. error%is_fatal .or. run%is_open) exit
      end do
      if (.not. (interrupted .or. allocated(error))) then
         trial%open = open_shares(run%sim, joint_lengths(settled))
         trial%shear = shear_of_linings(run%sim)
         call find_inside(run%sim, trial%inside, trial%inside_blocks, trial%inside_place)
         call find_uses(run%sim, trial%supports)
      end if
      trial%seconds = wall_seconds() - start
      if (allocated(error)) call add_context(error, 'the trial of '//to_string(value, 6)//' has no verdict')
   end subroutine compute_trial

   !> Depth of blocks in each other, over the inradius of the smaller one, where a run would report it, and the two that
   !> are deepest; else 0.
   subroutine find_inside(sim, depth, blocks, place)
      type(simulation_type), intent(in) :: sim
      real(wp), intent(out) :: depth
      integer, intent(out) :: blocks(2)
      real(wp), intent(out) :: place(2)      !! [length]
      type(lodging_type) :: lodging
      integer :: k
      depth = 0
      blocks = 0
      place = 0
      call lodging%look(sim%blocks, sim%state)
      k = maxloc(lodging%found%share, dim=1)
      if (k == 0) return
      depth = lodging%found(k)%share
      blocks = lodging%found(k)%blocks
      place = lodging%found(k)%place + sim%state%datum
   end subroutine find_inside

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
   subroutine advance_trial(options, searched, preliminary, observer, run, trial, interrupted, error)
      type(search_options_type), intent(in) :: options
      type(searched_type), intent(in) :: searched
      logical, intent(in) :: preliminary
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
         call judgement%begin(run%sim, usual_share, any(abs(run%sim%state%stress) > 0), growth=loaded_apart, &
                              preliminary=preliminary)
      else
         call judgement%begin(run%sim, is_trial=.true., preliminary=preliminary)
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
            if (outcome == verdict%failing) then
               ! bolts bear what has moved far enough
               call find_uses(run%sim, trial%supports)
               trial%unused = find_unused(run%sim, trial%supports, inertia_work(run%sim))
               if (trial%unused > 0 .and. .not. maxval(judgement%moved) > most_motion*typical_size(run%sim)) &
                  outcome = verdict%open
            end if
         end if
         call pace%follow(maxval(judgement%moved), judgement%way_moved(run%sim), run%sim)
         call run%write_step(error)
         if (allocated(error)) return
         trial%unbalanced = run%sim%record%unbalanced
         trial%displacement = maxval(judgement%moved)
         !$omp critical (rockdda_trial_text)
         call observer%progress(to_string(trial%value, 6)//', step '//to_string(trial%steps)//', unbalanced '// &
                                to_string(trial%unbalanced, 2)//', moved '// &
                                system%shown(trial%displacement, 'length', 2))
         !$omp end critical (rockdda_trial_text)
         interrupted = observer%is_requested()
         if (interrupted) return
         if (waiting%stalls(trial%unbalanced, options%max_steps)) exit
      end do
      trial%decided = outcome /= verdict%open
      trial%stable = outcome == verdict%stable
      if (outcome == verdict%failing) then
         trial%is_sure = judgement%is_sure
         trial%pull = pull
         if (any(abs(limits) > 0)) trial%limit = limits(minloc(abs(limits - trial%value), dim=1, mask=abs(limits) > 0))
      end if
      if (.not. trial%stable) call find_mechanism(run%sim, judgement, trial%mechanism)
   end subroutine advance_trial

   !> The work of inertia in the last, static step over the motion of all areas, which is what carries a mechanism away,
   !> and the value at which it would be none; 0: not known.
   subroutine find_limit(sim, searched, value, pull, limit)
      type(simulation_type), intent(in) :: sim
      type(searched_type), intent(in) :: searched
      real(wp), intent(in) :: value
      real(wp), intent(out) :: pull              !! [force/area]
      real(wp), intent(out) :: limit
      real(wp) :: work, moved, change, turned(2)
      integer :: i
      limit = 0
      work = inertia_work(sim)
      moved = 0
      change = 0
      associate (d => sim%equations%x, weight => sim%families%loads%weight, state => sim%state)
         do i = 1, sim%blocks%n_blocks
            if (.not. state%active(i)) cycle
            moved = moved + state%area(i)*(norm2(d(1:2, i)) + radius_of_inertia(state, i)*abs(d(3, i)))
            select case (searched%kind)
            case (search_kind%tilt)
               turned = [-weight(2, i), weight(1, i)]*pi/180
            case (search_kind%push)
               turned = [-weight(2, i), 0.0_wp]
            case default
               turned = 0
            end select
            change = change + dot_product(turned, d(1:2, i))
         end do
      end associate
      select case (searched%kind)
      case (search_kind%strength)
         change = friction_work(sim, searched%joints)
         if (change > 0 .and. work > 0) limit = value*change/(change + work)
      case (search_kind%tilt, search_kind%push)
         if (abs(change) > 0 .and. work > 0) limit = value - work/change
      end select
      pull = work/max(moved, tiny(1.0_wp))
   end subroutine find_limit

   !> Work of inertia in the last step.
   pure real(wp) function inertia_work(sim) result(work)
      type(simulation_type), intent(in) :: sim
      integer :: i
      work = 0
      associate (d => sim%equations%x, state => sim%state)
         do i = 1, sim%blocks%n_blocks
            if (state%active(i)) work = work + state%mass(i)* &
               (dot_product(state%acceleration(1:2, i), d(1:2, i)) + &
                radius_of_inertia(state, i)**2*state%acceleration(3, i)*d(3, i))
         end do
      end associate
   end function inertia_work

   !> Choose how the next step begins.
   subroutine follow(self, distance, way, sim)
      class(trial_pace_type), intent(inout) :: self
      real(wp), intent(in) :: distance               !! largest of a block from the settled state [length]
      real(wp), intent(in) :: way                    !! largest of a block in first lengths
      type(simulation_type), intent(inout) :: sim    !! after an accepted step of the trial
      logical :: stuck
      integer :: most        ! static steps before they are judged
      self%steps = self%steps + 1
      call self%watch_cuts(sim)
      call self%watch_slide(distance, way, sim)
      if (self%carries) then
         ! as long as static steps: only these may grow beyond dt_max
         sim%control%dt = min(self%dt, sim%control%brisk%longest, sim%control%method%growth*sim%control%last_dt)
         if (self%steps < carried_steps .and. distance < farther*self%start .and. .not. distance < self%farthest .and. &
             sim%control%balanced == 0) then
            self%farthest = distance
            call stop_slowed(sim)
            return
         end if
         call self%set(.false., distance, sim)
         self%enough = checking_steps
         return
      end if
      if (self%slides >= sliding_steps .or. (self%has_slid .and. self%steps == 1 .and. &
                                             sim%record%unbalanced > alike*self%sliding_pull)) then
         self%has_slid = .true.
         self%sliding_pull = sim%record%unbalanced
         call self%set(.true., distance, sim)
         return
      end if
      self%has_slid = .false.
      self%least = min(self%least, sim%record%unbalanced)
      most = merge(short_steps, static_steps, sim%control%last_dt < sim%parameters%dt_max)
      if (self%steps < min(self%enough, most)) return
      stuck = self%least > no_progress*self%least_before .and. &
              distance < self%start*farther**(real(self%steps, wp)/most)
      self%least_before = min(self%least, self%least_before)
      call self%set(stuck, distance, sim)
   end subroutine follow

   !> Take the velocity of blocks that are slowed down.
   pure subroutine stop_slowed(sim)
      type(simulation_type), intent(inout) :: sim
      integer :: i
      associate (v => sim%state%velocity, a => sim%state%acceleration)
         do i = 1, sim%blocks%n_blocks
            if (dot_product(v(1:2, i), a(1:2, i)) + radius_of_inertia(sim%state, i)**2*v(3, i)*a(3, i) < 0) v(:, i) = 0
         end do
      end associate
   end subroutine stop_slowed

   !> Does the model slide?
   subroutine watch_slide(self, distance, way, sim)
      class(trial_pace_type), intent(inout) :: self
      real(wp), intent(in) :: distance               !! largest of a block from the settled state [length]
      real(wp), intent(in) :: way                    !! the same in first lengths
      type(simulation_type), intent(in) :: sim
      logical :: slides
      if (self%carries) return
      slides = sim%control%slip_share > mostly .and. way > least_way .and. &
               self%last_distance > 0 .and. distance > self%last_distance .and. sim%record%unbalanced > 0
      if (slides) slides = log(self%last_unbalanced/sim%record%unbalanced) < hardly_falls* &
                           log(distance/self%last_distance)
      self%slides = merge(self%slides + 1, 0, slides)
      self%last_distance = distance
      self%last_unbalanced = sim%record%unbalanced
   end subroutine watch_slide

   !> Try no step for a while that is as long as one that had to be cut.
   subroutine watch_cuts(self, sim)
      class(trial_pace_type), intent(inout) :: self
      type(simulation_type), intent(inout) :: sim
      associate (longest => sim%control%brisk%longest, record => sim%record)
         self%since_cut = self%since_cut + 1
         if (record%attempts > 1) then
            self%since_cut = 0
            longest = max(sim%parameters%dt_max, &
                          shorter_step*record%dt/sim%parameters%cut_factor**(record%attempts - 1))
         else if (self%since_cut > cautious_steps) then
            longest = huge(1.0_wp)
         end if
         sim%control%dt = max(sim%parameters%dt_min, min(sim%control%dt, longest))
      end associate
   end subroutine watch_cuts

   !> Carry velocities from now on, or not.
   subroutine set(self, carries, distance, sim)
      class(trial_pace_type), intent(inout) :: self
      logical, intent(in) :: carries
      real(wp), intent(in) :: distance               !! largest of a block from the settled state [length]
      type(simulation_type), intent(inout) :: sim
      self%steps = 0
      self%start = distance
      self%farthest = 0
      self%enough = static_steps
      self%least = huge(1.0_wp)
      if (carries .eqv. self%carries) return
      self%carries = carries
      if (carries) self%dt = max(sim%control%dt, sim%parameters%dt_max)
      sim%parameters%stages(size(sim%parameters%stages))%k01 = merge(carried, 0.0_wp, carries)
      sim%control%balanced = 0
      if (.not. carries) sim%state%velocity = 0
   end subroutine set

end module rockdda_run_trial
