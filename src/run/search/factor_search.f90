! SPDX-License-Identifier: MIT
!> The search for the critical factor of a model (docs/factor-of-safety.md).
!>
!>     call search%prepare(request, input, options, error)   names, files; nothing is computed
!>     call search%run(observer, error)                      settled state, trials
!>     search%state, search%trials, search%tried             what was found
!>
!> Trials run side by side when `jobs` > 1, each by one thread; which of them count, and in which order, depends on
!> their verdicts alone.
module rockdda_run_factor_search
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_kinds, only : wp, pi
   use rockdda_base_strings, only : counted, to_string
   use rockdda_base_suggest, only : did_you_mean
   use rockdda_model_options, only : is_set, stage_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_units, only : unit_system_type, unit_system
   use rockdda_model_analysis_input, only : joint_material_type
   use rockdda_model_material_names, only : number_of_material
   use rockdda_stepping_lodging, only : lodged_share, lodged_growth
   use rockdda_stepping_simulation, only : simulation_type
   use rockdda_stepping_verdict, only : apart, deformation_of, typical_size, usual_share
   use rockdda_run_input, only : model_input_type
   use rockdda_run_model_run, only : run_type
   use rockdda_run_search_journal, only : search_journal_type, new_journal
   use rockdda_run_search_options, only : search_kind, search_options_type, usual_max_steps, search_names
   use rockdda_run_search_path, only : search_path_type, search_state_type, search_end, new_search_path
   use rockdda_run_design_factors, only : design_factors_type, read_factors
   use rockdda_run_given_loads, only : loads_of, choose_loads, end_tables
   use rockdda_run_open_joints, only : joint_lengths
   use rockdda_run_searched, only : searched_type
   use rockdda_run_settled_run, only : find_settled_state, splinter_text
   use rockdda_run_settled_state, only : add_trial_stage
   use rockdda_run_support_uses, only : find_pushed, n_bolts_of, name_of_support
   use rockdda_run_trial, only : trial_type, search_observer_type, compute_trial, find_inside, most_motion
   implicit none
   private
   public :: factor_search_type

   !> Values below the factor are tried as long as they lie this many tolerances apart.
   real(wp), parameter :: gap = 4
   !> Where joints dilate, as long as they lie further apart than this part of the way from the start to the factor.
   integer, parameter :: parts = 16
   !> This share of the factor is compared with joints that are springs.
   real(wp), parameter :: compared = 0.9_wp
   !> What helps where loads move nothing that could fail.
   character(len=*), parameter :: make_room = 'leave them room (a free face, ground around the load that may move)'

   type :: factor_search_type
      type(search_options_type) :: options
      type(search_state_type) :: state
      type(trial_type), allocatable :: trials(:)     !! those on the way, in order
      type(trial_type), allocatable :: tried(:)      !! all that counted, in order: also those at other values
      type(simulation_type) :: settled               !! the state from which all trials begin
      type(searched_type) :: searched                !! the part of the model that changes
      type(design_factors_type) :: factors           !! with which a design is judged
      type(diagnostics_type) :: warnings             !! what the factor depends on
      real(wp) :: strength = 1                       !! of them in the settled state, times their own
      logical :: interrupted = .false.
      real(wp) :: caught = 0                         !! the model stands at this value, and fails at a lower one
      logical, private :: is_careful = .false.       !! trials fail no longer by few steps: one that did so stands
      type(search_path_type), private :: path
      type(search_journal_type) :: journal
      type(trial_type), allocatable, private :: known(:)   !! all trials with a verdict
   contains
      procedure :: prepare
      procedure :: run => run_search
      procedure :: has_factor
      procedure :: stands
      procedure :: joint_length
      procedure :: limit_trial
      procedure :: share_that_moves
      procedure, private :: compute_some
      procedure, private :: compute_values
      procedure, private :: look_below
      procedure, private :: doubtful_trial
      procedure, private :: drop_doubtful
      procedure, private :: check_solved
      procedure, private :: check_inside
      procedure, private :: compare_springs
      procedure, private :: warn
      procedure, private :: take_loads
   end type factor_search_type

contains

   !> Take over model and options. `input` gets the stages of the search. Errors: unknown names, impossible values.
   subroutine prepare(self, input, options, stem, error)
      class(factor_search_type), intent(inout) :: self
      type(model_input_type), intent(inout) :: input
      type(search_options_type), intent(in) :: options
      character(len=*), intent(in) :: stem              !! of the results: the journal stands beside them
      type(error_type), allocatable, intent(out) :: error
      self%options = options
      if (.not. is_set(self%options%max_steps)) self%options%max_steps = usual_max_steps
      self%path = new_search_path(options, 1.0_wp)
      call check_combination(self%options, error)
      if (allocated(error)) return
      call choose_joints(self%options, input%parameters%joint_materials, self%searched%joints, error)
      if (.not. allocated(error)) call check_values(self%options, self%path%tolerance, error)
      if (.not. allocated(error)) call self%take_loads(input%parameters, error)
      if (.not. allocated(error)) call add_trial_stage(options%stage, input%parameters, error)
      if (.not. allocated(error)) call check_tolerance(self%options%kind, self%path, input%parameters%stages, error)
      if (allocated(error)) return
      self%journal = new_journal(stem, input, self%options)
   end subroutine prepare

   !> Loads that the search multiplies, and design factors, with which the model is multiplied.
   subroutine take_loads(self, parameters, error)
      class(factor_search_type), intent(inout) :: self
      type(parameters_type), intent(inout) :: parameters
      type(error_type), allocatable, intent(out) :: error
      self%searched%kind = self%options%kind
      self%searched%loads = loads_of(parameters)
      allocate (self%searched%load_names(0))
      if (self%options%has_factors()) then
         call read_factors(self%options%factors, self%options%loads, self%searched%loads, self%factors, error)
         if (.not. allocated(error)) call self%factors%multiply(self%searched%loads, parameters, error)
         self%searched%factors = self%factors%strength
      else if (self%options%kind == search_kind%load) then
         call choose_loads(self%searched%loads, self%options%loads, '--loads', self%searched%load_names, error)
         if (allocated(error)) return
         call end_tables(self%searched%load_names, parameters)
         self%searched%loads = loads_of(parameters)
      end if
   end subroutine take_loads

   !> Find the settled state, then try values until the search ends. `interrupted`: a stop was requested; the same
   !> search continues from its journal. Errors: no settled state, a trial without a solution, no factor between the
   !> ends (code computation).
   subroutine run_search(self, input, observer, error)
      class(factor_search_type), intent(inout) :: self
      type(model_input_type), intent(in) :: input
      class(search_observer_type), intent(in) :: observer
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: told
      type(error_type), allocatable :: refusal
      integer :: i, doubtful
      real(wp) :: probe
      real(wp), allocatable :: looked(:)      ! values that were tried below the factor
      real(wp), allocatable :: tried(:)       ! all values that counted
      logical :: is_shorter
      allocate (self%known(0), looked(0), tried(0))
      call find_settled_state(input, self%options, self%searched, self%journal, observer, self%settled, self%known, &
                              told, self%interrupted, error)
      if (allocated(error) .or. self%interrupted) return
      call self%warn(observer, told)
      self%strength = self%journal%strength
      self%path = new_search_path(self%options, self%strength)
      do
         call self%drop_doubtful(looked, tried)
         call self%path%follow(self%known%value, self%known%stable, self%known%pull, self%known%limit, self%state)
         ! of a way that is not at its end trials that were computed ahead may be a part
         if (self%state%outcome /= search_end%open) call add_new(self%known(self%state%used)%value, tried)
         doubtful = self%doubtful_trial()
         if (self%state%outcome == search_end%open) then
            call self%compute_some(observer, error)
         else if (doubtful > 0) then
            call self%compute_values([self%known(doubtful)%value], .false., observer, error)
         else
            call self%look_below(looked, probe, is_shorter)
            if (is_shorter) cycle
            if (.not. abs(probe) > 0) exit
            if (.not. any(abs(self%known%value - probe) <= 0)) call self%compute_values([probe], &
               .not. self%is_careful, observer, error)
            looked = [looked, probe]
            call add_new([probe], tried)
         end if
         if (allocated(error) .or. self%interrupted) return
      end do
      self%trials = self%known(self%state%used)
      self%tried = self%known([(findloc(abs(self%known%value - tried(i)) <= 0, .true., dim=1), i=1, size(tried))])
      call self%check_solved(looked, observer, error)
      if (allocated(error)) return
      do i = 1, size(self%trials)
         if (self%trials(i)%decided .or. len_trim(self%trials(i)%fault) > 0) cycle
         call self%warn(observer, 'the trial of '//to_string(self%trials(i)%value, 6)// &
                        ' neither came to rest nor moved on in '//to_string(self%trials(i)%steps)// &
                        ' steps: it counts as failing; --max-steps gives it more')
      end do
      call self%warn(observer, describe_motion(self%trials, self%state%stable, self%settled, self%path))
      call self%warn(observer, describe_caught(self))
      call self%check_inside(observer, refusal)
      call self%warn(observer, describe_shear(self%trials))
      call self%warn(observer, describe_unused(self%limit_trial(stable=.false.), self%settled))
      call self%warn(observer, describe_pushed(self%limit_trial(stable=.true.), self%settled))
      call self%warn(observer, describe_splinter(self))
      if (allocated(refusal)) then
         call move_alloc(refusal, error)
         return
      end if
      if (self%has_factor()) then
         call self%compare_springs(observer, error)
         return
      end if
      ! a design without a finite reserve stands
      if (self%state%outcome == search_end%never_fails .and. self%options%has_factors()) return
      call make_error(error, error_code%computation, no_factor(self))
   end subroutine run_search

   !> No factor rests on a stable trial in which blocks stand inside each other, beyond what they do in the model at
   !> rest, where thin ones are by the closure of their joints: what stops them there is no contact that a model of rock
   !> has. Loads grow until something fails, and press blocks that nothing else lets move into each other: the search
   !> has no factor beyond the depth that a run reports; other searches beyond that which a run reports again. Less is a
   !> warning.
   subroutine check_inside(self, observer, error)
      class(factor_search_type), intent(inout) :: self
      class(search_observer_type), intent(in) :: observer
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: text
      real(wp) :: most, at_rest, place(2)
      integer :: i, sound, blocks(2)
      i = maxloc([0.0_wp, self%trials%inside], mask=[.true., self%trials%stable], dim=1) - 1
      if (i == 0) return
      most = lodged_share
      if (self%options%kind /= search_kind%load) most = lodged_growth*lodged_share
      call find_inside(self%settled, at_rest, blocks, place)
      most = most + at_rest
      associate (one => self%trials(i))
         text = 'blocks stand inside each other in the stable trial of '//to_string(one%value, 6)//', by up to '// &
                to_string(100*one%inside, 2)//' % of the inradius of the smaller one (blocks '// &
                to_string(one%inside_blocks(1))//' and '//to_string(one%inside_blocks(2))//' at ('// &
                to_string(one%inside_place(1), 5)//', '//to_string(one%inside_place(2), 5)//'))'
      end associate
      if (.not. (self%has_factor() .and. self%trials(i)%inside > most)) then
         call self%warn(observer, text//': what holds there is not to be trusted; rock or joints that are too '// &
                        'soft, or a sharp corner in a kink of the ground, let them')
         return
      end if
      text = 'no factor: '//text
      sound = maxloc(self%path%sign*self%trials%value, dim=1, &
                     mask=self%trials%stable .and. .not. self%trials%inside > 0)
      if (sound > 0) text = text//'; the model stands without it up to '//to_string(self%trials(sound)%value, 6)
      if (self%options%kind == search_kind%load) then
         text = text//new_line('a')//'  loads press blocks into each other where they cannot give way: '//make_room// &
                ', or give rock and joints the stiffness that they have'
      else
         text = text//new_line('a')//'  rock or joints that are too soft, or a sharp corner in a kink of the '// &
                'ground, let them: examine the model in a run'
      end if
      call make_error(error, error_code%computation, text)
   end subroutine check_inside

   !> The search fails where its answer rests on a trial without a solution; the nearest other one is reported.
   subroutine check_solved(self, looked, observer, error)
      class(factor_search_type), intent(inout) :: self
      real(wp), intent(in) :: looked(:)          !! values that were tried below the factor
      class(search_observer_type), intent(in) :: observer
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: text
      integer :: i, nearest, n
      n = 0
      nearest = 0
      do i = 1, size(self%known)
         associate (one => self%known(i))
            if (len_trim(one%fault) == 0) cycle
            if (any(self%state%used == i)) then
               if (.not. abs(one%value - self%state%failing) > 0) then
                  call make_error(error, error_code%computation, trim(one%fault))
                  return
               end if
            else if (.not. any(abs(looked - one%value) <= 0)) then
               cycle
            end if
            n = n + 1
            if (n == 1) nearest = i
            if (abs(one%value - self%state%failing) < abs(self%known(nearest)%value - self%state%failing)) nearest = i
         end associate
      end do
      if (n == 0) return
      text = trim(self%known(nearest)%fault)
      if (index(text, new_line('a')) > 0) text = text(:index(text, new_line('a')) - 1)
      text = text//new_line('a')//'  '
      if (any(self%state%used == nearest)) then
         text = text//'it counts as failing; the factor does not rest on it'
      else
         text = text//'whether the model fails there, below the factor, is not known'
      end if
      if (n > 1) text = text//' ('//to_string(n - 1)//' more)'
      call self%warn(observer, text)
   end subroutine check_solved

   !> A warning when the model fails well below its factor with joints that are springs of the same stiffness. Blocks
   !> that only touch may hold each other by friction, pressed by nothing but their own thrust. Statics has no say
   !> whether they do: the edge of a block that bears without giving way lets them, a spring of rock does not.
   subroutine compare_springs(self, observer, error)
      class(factor_search_type), intent(inout) :: self
      class(search_observer_type), intent(in) :: observer
      type(error_type), allocatable, intent(out) :: error
      type(searched_type) :: springs
      type(run_type), allocatable :: run
      type(trial_type) :: trial
      real(wp) :: value
      if (.not. any(self%settled%families%contacts%laws%normal%penalty)) return
      springs = self%searched
      springs%springs = .true.
      associate (rest => springs%value_at_rest(self%strength))
         value = rest + compared*(self%state%stable - rest)
      end associate
      allocate (run)
      call compute_trial(self%settled, self%options, springs, value, .false., observer, run, trial, &
                         self%interrupted, error)
      if (self%interrupted) return
      if (allocated(error)) then
         if (error%code /= error_code%computation .or. error%is_fatal) return
         deallocate (error)
      else if (trial%stable) then
         return
      end if
      call self%warn(observer, 'joints take their stiffness from their blocks; as springs of that stiffness they '// &
                     'let the model fail at '//to_string(value, 4)//': blocks hold each other by friction that '// &
                     'only their own thrust presses on, and a gap or a softer joint takes it from them; give '// &
                     'joints their stiffness (normal_stiffness)')
   end subroutine compare_springs

   !> Report what the factor depends on, and keep it; nothing when the text is empty.
   subroutine warn(self, observer, text)
      class(factor_search_type), intent(inout) :: self
      class(search_observer_type), intent(in) :: observer
      character(len=*), intent(in) :: text
      if (len(text) == 0) return
      call observer%warn(text)
      call self%warnings%add(severity%warning, text)
   end subroutine warn

   !> Do joints of the model dilate?
   pure logical function dilates(self)
      class(factor_search_type), intent(in) :: self
      dilates = any(self%settled%families%contacts%laws%dilation > 0)
   end function dilates

   !> Has it found a factor? A design may stand without a finite one.
   pure logical function has_factor(self)
      class(factor_search_type), intent(in) :: self
      has_factor = self%state%outcome == search_end%found
   end function has_factor

   !> Does the model stand with the values that it has? A search of the strength tries them.
   pure logical function stands(self)
      class(factor_search_type), intent(in) :: self
      stands = .not. self%state%stable < 1
   end function stands

   !> Length of the joints of each material in the settled state.
   pure function joint_length(self) result(length)
      class(factor_search_type), intent(in) :: self
      real(wp) :: length(size(self%searched%joints))
      length = joint_lengths(self%settled)
   end function joint_length

   !> The stable or the failing trial nearest to the factor; without supports where there is none.
   pure type(trial_type) function limit_trial(self, stable) result(trial)
      class(factor_search_type), intent(in) :: self
      logical, intent(in) :: stable
      integer :: i
      allocate (trial%open(size(self%searched%joints)), source=0.0_wp)
      allocate (trial%supports(0))
      do i = 1, size(self%trials)
         if ((self%trials(i)%stable .eqv. stable) .and. &
             .not. abs(self%trials(i)%value - merge(self%state%stable, self%state%failing, stable)) > 0) &
            trial = self%trials(i)
      end do
   end function limit_trial

   !> Area of what moves in the failing trial nearest to the factor, over that of a typical block.
   real(wp) function share_that_moves(self) result(share)
      class(factor_search_type), intent(in) :: self
      type(trial_type) :: failing
      share = 0
      if (.not. self%has_factor()) return
      failing = self%limit_trial(stable=.false.)
      share = sum(self%settled%state%area(failing%mechanism%blocks))/typical_size(self%settled)**2
   end function share_that_moves

   !> Compute the next trial, and as many of those that may follow it as there are jobs.
   subroutine compute_some(self, observer, error)
      class(factor_search_type), intent(inout) :: self
      class(search_observer_type), intent(in) :: observer
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: values(:)
      call self%path%candidates(self%known%value, self%known%stable, self%known%pull, self%known%limit, &
                                max(1, self%options%jobs), values)
      call self%compute_values(values, .not. self%is_careful, observer, error)
   end subroutine compute_some

   !> The failing trial on which the answer rests, when it failed by few steps; 0: it is sure, or there is none.
   pure integer function doubtful_trial(self) result(doubtful)
      class(factor_search_type), intent(in) :: self
      logical :: is_it(size(self%known))
      doubtful = 0
      if (self%state%outcome == search_end%never_fails) return
      is_it = abs(self%known%value - self%state%failing) <= 0
      ! it was repeated, and has no solution where it goes
      if (any(is_it .and. len_trim(self%known%fault) > 0)) return
      doubtful = findloc(is_it .and. .not. (self%known%stable .or. self%known%is_sure), .true., dim=1, back=.true.)
   end function doubtful_trial

   !> Leave out trials that failed by few steps and were repeated since. The way keeps their pulls when they fail
   !> again. When one of them stands, no trial that failed so counts any more, and the way begins anew.
   subroutine drop_doubtful(self, looked, tried)
      class(factor_search_type), intent(inout) :: self
      real(wp), allocatable, intent(inout) :: looked(:)   !! values that were tried below the factor
      real(wp), allocatable, intent(inout) :: tried(:)    !! all values that counted
      logical :: counts(size(self%known))
      integer :: i, k
      counts = .true.
      do i = 1, size(counts)
         if (self%known(i)%stable .or. self%known(i)%is_sure) cycle
         do k = 1, size(counts)
            if (k == i .or. abs(self%known(k)%value - self%known(i)%value) > 0) cycle
            if (len_trim(self%known(k)%fault) > 0) cycle
            counts(i) = .false.
            if (.not. self%known(k)%stable) then
               self%known(k)%pull = self%known(i)%pull
               self%known(k)%limit = self%known(i)%limit
            else if (.not. self%is_careful) then
               self%is_careful = .true.
               self%caught = 0
               self%path = new_search_path(self%options, self%strength)
               looked = [real(wp) ::]
               tried = [real(wp) ::]
            end if
         end do
      end do
      if (self%is_careful) counts = self%known%stable .or. self%known%is_sure
      if (.not. all(counts)) self%known = self%known(pack([(i, i=1, size(counts))], counts))
   end subroutine drop_doubtful

   !> Add values that are not there yet.
   pure subroutine add_new(values, all)
      real(wp), intent(in) :: values(:)
      real(wp), allocatable, intent(inout) :: all(:)
      integer :: i
      do i = 1, size(values)
         if (.not. any(abs(all - values(i)) <= 0)) all = [all, values(i)]
      end do
   end subroutine add_new

   !> A value below the factor that is still to be tried, 0: none. Where the nearest stable trial has moved as far as
   !> others before they fail, blocks may fail at lower values and be caught at this one: values are tried halfway to
   !> the highest one that is stable without such a motion. Where joints dilate, slip may clamp at one value what opens
   !> before it slips at a lower one: values are tried in the middle of the widest interval between stable ones.
   !> One that fails ends the way there: `is_shorter`. Trials that were computed ahead do not count before it is their
   !> turn.
   subroutine look_below(self, looked, probe, is_shorter)
      class(factor_search_type), intent(inout) :: self
      real(wp), intent(in) :: looked(:)          !! values that were tried so
      real(wp), intent(out) :: probe
      logical, intent(out) :: is_shorter
      real(wp) :: low, high, values(size(self%known))
      real(wp), allocatable :: stable(:)
      logical :: calm(size(self%known)), counts(size(self%known)), widens
      integer :: i
      probe = 0
      is_shorter = .false.
      if (self%state%outcome /= search_end%found .or. self%options%kind == search_kind%load) return
      values = self%path%sign*self%known%value
      high = self%path%sign*self%state%stable
      counts = [(any(self%state%used == i) .or. any(abs(looked - self%known(i)%value) <= 0), i=1, size(counts))]
      widens = dilates(self)
      allocate (stable(0))
      if (widens) then
         stable = pack(values(self%state%used), self%known(self%state%used)%stable)
         low = minval(stable)
      else
         calm = counts .and. self%known%stable .and. .not. self%known%displacement > apart* &
                max(usual_share*typical_size(self%settled), deformation_of(self%settled, self%settled%contacts))
         if (any(calm .and. abs(values - high) <= 0) .or. .not. any(calm .and. values < high)) return
         low = maxval(values, mask=calm .and. values < high)
         if (low < self%path%start) return
      end if
      do
         if (widens) then
            call take_widest(stable, max(gap*self%path%tolerance, (self%path%sign*self%state%stable - low)/parts), high)
            if (.not. high > low) exit
         else
            if (.not. high - low > gap*self%path%tolerance) exit
            high = low + (high - low)/2
         end if
         probe = self%path%sign*high
         i = findloc(counts .and. abs(values - high) <= 0, .true., dim=1)
         if (i == 0) return
         is_shorter = .not. (self%known(i)%stable .or. len_trim(self%known(i)%fault) > 0)
         if (is_shorter) exit
         if (widens) stable = [stable, high]
      end do
      probe = 0
      if (.not. is_shorter) return
      self%caught = self%state%stable
      self%path%has_end = .true.
      self%path%end = high
   end subroutine look_below

   !> The middle of the widest interval between values; -huge where none is wider than `least`.
   pure subroutine take_widest(values, least, middle)
      real(wp), intent(in) :: values(:)
      real(wp), intent(in) :: least
      real(wp), intent(out) :: middle
      real(wp) :: widest, above
      integer :: i
      widest = least
      middle = -huge(middle)
      do i = 1, size(values)
         above = minval(values, mask=values > values(i))
         if (.not. (any(values > values(i)) .and. above - values(i) > widest)) cycle
         widest = above - values(i)
         middle = values(i) + widest/2
      end do
   end subroutine take_widest

   !> Compute trials side by side, and keep them. Only an error of the first one ends the search. Trials without a
   !> solution are not written: they are computed again when the search continues.
   subroutine compute_values(self, values, preliminary, observer, error)
      class(factor_search_type), intent(inout) :: self
      real(wp), intent(in) :: values(:)
      logical, intent(in) :: preliminary         !! they may fail by few steps
      class(search_observer_type), intent(in) :: observer
      type(error_type), allocatable, intent(out) :: error
      type(error_type), allocatable :: problem, failure
      type(trial_type), allocatable :: trials(:)
      logical, allocatable :: done(:)
      integer :: i
      allocate (trials(size(values)), done(size(values)))
      done = .false.
      !$omp parallel do num_threads(size(values)) schedule(static, 1) private(i) shared(self, observer, trials, done, &
      !$omp values, preliminary, error)
      do i = 1, size(values)
         call compute_one(self, observer, values(i), preliminary, trials(i), done(i), i == 1, error)
      end do
      !$omp end parallel do
      do i = 1, size(values)
         if (.not. done(i)) cycle
         self%known = [self%known, trials(i)]
         if (len_trim(trials(i)%fault) > 0) cycle
         call self%journal%add(trials(i), problem)
         if (allocated(problem)) call move_alloc(problem, failure)
      end do
      if (.not. done(1) .and. .not. allocated(error)) self%interrupted = .true.
      if (allocated(failure) .and. .not. allocated(error)) call move_alloc(failure, error)
   end subroutine compute_values

   !> One trial. One without a solution counts as failing; the error of one that may never count is none.
   subroutine compute_one(self, observer, value, preliminary, trial, done, counts, error)
      class(factor_search_type), intent(in) :: self
      class(search_observer_type), intent(in) :: observer
      real(wp), intent(in) :: value
      logical, intent(in) :: preliminary
      type(trial_type), intent(out) :: trial
      logical, intent(out) :: done
      logical, intent(in) :: counts
      type(error_type), allocatable, intent(inout) :: error
      type(run_type), allocatable :: run
      type(error_type), allocatable :: failure
      logical :: interrupted
      allocate (run)
      call compute_trial(self%settled, self%options, self%searched, value, preliminary, observer, run, trial, &
                         interrupted, failure)
      if (allocated(failure)) then
         if (failure%code == error_code%computation .and. .not. failure%is_fatal) then
            trial%fault = failure%message
            trial%decided = .false.
            deallocate (failure)
         end if
      end if
      done = .not. (interrupted .or. allocated(failure))
      if (allocated(failure) .and. counts) call move_alloc(failure, error)
   end subroutine compute_one

   !> A warning when a stable trial came to rest only after motion, beyond any deformation: a mechanism may have moved
   !> and stopped below the factor, so that verdicts need not be monotonic. It names the trial on which the factor
   !> rests, where that has moved so, and the one nearest to the start. Else empty.
   function describe_motion(trials, last, settled, path) result(text)
      type(trial_type), intent(in) :: trials(:)      !! those on the way, in order
      real(wp), intent(in) :: last                   !! value of the stable one on which the factor rests
      type(simulation_type), intent(in) :: settled
      type(search_path_type), intent(in) :: path
      character(len=:), allocatable :: text
      logical :: has_moved(size(trials))
      integer :: first, own
      type(unit_system_type) :: system
      text = ''
      system = unit_system(settled%parameters%units)
      has_moved = trials%stable .and. trials%displacement > most_motion*typical_size(settled)
      if (.not. any(has_moved)) return
      first = minloc(abs(path%sign*trials%value - path%start), dim=1, mask=has_moved)
      own = findloc(has_moved .and. abs(trials%value - last) <= 0, .true., dim=1)
      if (own == 0) own = first
      text = 'the trial of '//to_string(trials(own)%value, 6)//' came to rest only after a motion of '// &
             system%shown(trials(own)%displacement, 'length', 3)
      if (own /= first) text = text//', and that of '//to_string(trials(first)%value, 6)//', the nearest to the '// &
                               'start that moved so, after '//system%shown(trials(first)%displacement, 'length', 3)
      text = text//': something may have failed below the factor and stopped; '// &
             'examine it with --to '//to_string(trials(first)%value, 6)//' and a model in which it cannot stop'
   end function describe_motion

   !> A warning when the model fails at lower values than one at which it stands. Else empty.
   function describe_caught(search) result(text)
      class(factor_search_type), intent(in) :: search
      character(len=:), allocatable :: text
      text = ''
      if (.not. abs(search%caught) > 0) return
      text = 'the model stands at '//to_string(search%caught, 6)
      if (.not. dilates(search)) text = text//' after a motion'
      text = text//', and fails at lower values, up to which the factor is taken'
      if (dilates(search)) text = text//': slip clamps joints that dilate there, and here they open first; which '// &
         'happens depends on their stiffness: compare with a quarter of it and with four times it'
   end function describe_caught

   !> A warning when what fails is much smaller than a block: the model without it has another factor. Else empty.
   function describe_splinter(search) result(text)
      class(factor_search_type), intent(in) :: search
      character(len=:), allocatable :: text
      type(trial_type) :: failing
      text = ''
      failing = search%limit_trial(stable=.false.)
      if (.not. allocated(failing%mechanism%blocks)) return
      text = splinter_text(search%settled, failing%mechanism%blocks)
      if (len(text) == 0) return
      if (search%has_factor()) then
         text = 'the factor is that of a splinter: '//text//'; what is larger may fail at another one'
      else
         text = 'what fails at '//to_string(failing%value, 6)//' is no more than a splinter: '//text
      end if
      text = text//': remove it, or merge it with a neighbour, and search again'
   end function describe_splinter

   !> A warning when elastic bolts could hold what fails: they take their force as blocks move. Else empty.
   function describe_unused(failing, settled) result(text)
      type(trial_type), intent(in) :: failing
      type(simulation_type), intent(in) :: settled
      character(len=:), allocatable :: text
      text = ''
      if (failing%unused == 0) return
      associate (one => failing%supports(failing%unused))
         text = "bolt '"//name_of_support(settled, failing%unused)//"' carries "
         if (one%use > 0) then
            text = text//to_string(100*one%use, 2)//' % of its strength'
         else
            text = text//settled%parameters%shown(one%force, 'force', 3)//' without a limit'
         end if
         text = text//' in the trial of '//to_string(failing%value, 6)//', which fails after a motion of '// &
                settled%parameters%shown(failing%displacement, 'length', 2)// &
                ': further motion may let it hold the blocks, and the factor does not count on that; give it its '// &
                'pretension, or examine that motion in a run with reduced strength'
      end associate
   end function describe_unused

   !> A warning when bolts prop what stands: grout and springs bear compression, and steel does not buckle. Else empty.
   function describe_pushed(stable, settled) result(text)
      type(trial_type), intent(in) :: stable
      type(simulation_type), intent(in) :: settled
      character(len=:), allocatable :: text
      integer, allocatable :: pushed(:)
      text = ''
      if (.not. allocated(stable%supports)) return
      pushed = find_pushed(stable%supports(:min(size(stable%supports), n_bolts_of(settled))))
      if (size(pushed) == 0) return
      associate (one => stable%supports(pushed(1)))
         text = "bolt '"//name_of_support(settled, pushed(1))//"' "
         if (size(pushed) > 1) text = counted(size(pushed), 'bolt')//', the first '//text
         text = text//'props what stands in the trial of '//to_string(stable%value, 6)//', with '// &
                settled%parameters%shown(-one%force, 'force', 3)//' of compression: steel does not buckle in the '// &
                "model, and the factor counts on it; kind = 'end_anchored' bears tension alone"
      end associate
   end function describe_pushed

   !> A warning when a lining bears more shear in a stable trial than its tensile strength: N and M limit its sections,
   !> shear does not, and the factor rests on it. Else empty.
   pure function describe_shear(trials) result(text)
      type(trial_type), intent(in) :: trials(:)
      character(len=:), allocatable :: text
      real(wp) :: shear
      shear = maxval([0.0_wp, trials%shear], mask=[.false., trials%stable])
      text = ''
      if (.not. shear > 1) return
      text = 'a lining without tensile strength bears shear'
      if (shear <= huge(shear)) text = 'a lining has a mean shear stress of up to '//to_string(shear, 3)// &
                                       ' times its tensile strength'
      text = text//' where the model stands: N and M limit its sections, shear does not; the factor rests on what '// &
             'it may not bear'
   end function describe_shear

   !> Why there is no factor, and what to do.
   function no_factor(search) result(text)
      class(factor_search_type), intent(in) :: search
      character(len=:), allocatable :: text
      type(search_options_type) :: options
      type(trial_type) :: last
      real(wp) :: value
      logical :: never_stable
      options = search%options
      last = search%trials(size(search%trials))
      value = last%value
      never_stable = search%state%outcome == search_end%never_stable
      if (options%kind == search_kind%load .and. never_stable) then
         text = 'fails under '//to_string(value, 3)//' times the loads: nothing carries them'
         if (is_set(options%from)) text = 'not stable under '//to_string(value, 6)// &
                                          ' times the loads, the lower end of the search: begin lower with --from'
         return
      end if
      if (never_stable .and. .not. last%decided .and. len_trim(last%fault) == 0) then
         text = 'not found to be stable at '//to_string(value, 6)//', the lower end of the search: that trial '// &
                'neither came to rest nor moved on in '//counted(last%steps, 'step')//'; give it more with '// &
                '--max-steps, now '//to_string(options%max_steps)
         return
      end if
      if (never_stable) then
         text = 'not stable at '//to_string(value, 6)//', the lower end of the search of the '
      else
         text = 'stable at '//to_string(value, 6)//', the upper end of the search of the '
      end if
      select case (options%kind)
      case (search_kind%tilt); text = text//'tilt'
      case (search_kind%push); text = text//'push'
      case default; text = text//trim(search_names(options%kind))
      end select
      if (never_stable) then
         text = text//': begin lower with --from, or make the model stable there'
         return
      end if
      ! what a search does not try by itself is hardly meant
      if (path_is_short()) then
         text = text//': search further with --to, or check that something can fail (joints, cohesion, supports)'
         return
      end if
      select case (options%kind)
      case (search_kind%load)
         text = text//' and the largest value that is tried without --to: '
         if (last%displacement > apart*usual_share*typical_size(search%settled)) then
            text = text//'blocks have moved by up to '// &
                   search%settled%parameters%shown(last%displacement, 'length', 3)//' and bear it without a '// &
                   'mechanism, confined by each other or by what is fixed; '//make_room
         else
            text = text//'blocks have moved by no more than '// &
                   search%settled%parameters%shown(last%displacement, 'length', 2)//'; give larger loads'
         end if
      case (search_kind%gravity)
         text = text//': friction bears any weight as it bears that of the model, and cohesion alone has a factor, '// &
                'which --to may find: search the strength'
      case (search_kind%strength)
         text = text//': shape or supports hold the model, or cohesion beyond any need: check what can fail (a '// &
                'free face, supports, cohesion)'
      case default
         text = text//': nothing slides or falls: check that something can (a free face, cohesion, supports)'
      end select

   contains

      !> Does --to end the search before it would end by itself?
      pure logical function path_is_short()
         path_is_short = .false.
         if (is_set(options%to)) path_is_short = abs(options%to) < search%path%highest
      end function path_is_short

   end function no_factor

   !> Which joint materials the search reduces.
   subroutine choose_joints(options, materials, chosen, error)
      type(search_options_type), intent(in) :: options
      type(joint_material_type), intent(in) :: materials(:)
      logical, allocatable, intent(out) :: chosen(:)      !! per material
      type(error_type), allocatable, intent(out) :: error
      character(len=80), allocatable :: names(:)
      character(len=:), allocatable :: rest, word
      integer :: comma, i, m
      allocate (chosen(size(materials)), source=len_trim(options%joints) == 0)
      if (len_trim(options%joints) == 0) return
      if (options%kind /= search_kind%strength) then
         call make_error(error, error_code%input, 'option --joints: only a search of the strength changes joints')
         return
      end if
      allocate (names(size(materials)))
      do i = 1, size(materials)
         names(i) = ''
         if (allocated(materials(i)%name)) names(i) = materials(i)%name
      end do
      rest = options%joints//','
      do while (len(rest) > 0)
         comma = index(rest, ',')
         word = trim(adjustl(rest(1:comma - 1)))
         rest = rest(comma + 1:)
         m = number_of_material(word, materials)
         if (m >= 1 .and. m <= size(materials)) then
            chosen(m) = .true.
            cycle
         end if
         call make_error(error, error_code%input, "option --joints: there is no joint material '"//word//"'"// &
                            did_you_mean(word, names))
         return
      end do
   end subroutine choose_joints

   !> Options that belong to another search.
   subroutine check_combination(options, error)
      type(search_options_type), intent(in) :: options
      type(error_type), allocatable, intent(out) :: error
      if (.not. options%has_factors()) then
         if (len_trim(options%loads) > 0 .and. options%kind /= search_kind%load) call make_error(error, &
            error_code%input, 'option --loads: only --search load and --factors ec7 multiply loads')
      else if (options%kind /= search_kind%strength) then
         call make_error(error, error_code%input, 'option --factors: the reserve of a design is one of strength, '// &
                         'not of --search '//trim(search_names(options%kind)))
      else if (is_set(options%from) .or. is_set(options%to)) then
         call make_error(error, error_code%input, 'options --from, --to: with --factors the search begins at 1')
      end if
   end subroutine check_combination

   !> A tolerance that is none: as large as what is searched, or below what trials can resolve, whose forces at rest are
   !> in balance up to a share of them.
   subroutine check_tolerance(kind, path, stages, error)
      integer, intent(in) :: kind                      !! one of search_kind%...
      type(search_path_type), intent(in) :: path
      type(stage_type), intent(in) :: stages(:)        !! the last one is that of the trials
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: unit
      real(wp) :: balance, least, most
      balance = stages(size(stages))%tolerance
      unit = ''
      select case (kind)
      case (search_kind%load)
         least = balance
         most = 1
         unit = ' of the load'
      case (search_kind%tilt)
         least = balance*180/pi
         unit = ' degrees'
      case (search_kind%push)
         least = balance
      case default
         least = balance*abs(path%start)
      end select
      if (kind /= search_kind%load) most = merge(path%end, path%highest, path%has_end) - path%start
      if (path%tolerance < most .and. .not. path%tolerance < least) return
      if (.not. (path%tolerance < least .or. most > 0)) return
      call make_error(error, error_code%input, 'option --tolerance: '//to_string(path%tolerance)//' must be at '// &
                      'least '//to_string(least, 2)//unit//' (forces of a trial at rest are in balance up to '// &
                      to_string(balance)//' of them), and less than '//to_string(most)//unit//', which is searched')
   end subroutine check_tolerance

   !> Values that the search cannot have.
   subroutine check_values(options, tolerance, error)
      type(search_options_type), intent(in) :: options
      real(wp), intent(in) :: tolerance
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: name
      logical :: has_both
      real(wp) :: least, start
      associate (o => options)
         name = trim(search_names(o%kind))
         has_both = is_set(o%from) .and. is_set(o%to)
         if (has_both) then
            least = tolerance
            if (o%kind == search_kind%load) least = tolerance*max(abs(o%from), abs(o%to))
            if (.not. abs(o%to - o%from) > least) then
               call make_error(error, error_code%input, 'options --from, --to: must be further apart than the '// &
                               'tolerance, '//to_string(least))
               return
            end if
         end if
         select case (o%kind)
         case (search_kind%strength, search_kind%gravity)
            start = 1
            if (is_set(o%from)) start = o%from
            if (.not. (is_set(o%to) .or. tolerance < start)) call make_error( &
               error, error_code%input, 'option --tolerance: '// &
               to_string(tolerance)//' must be less than the value where the search begins, '//to_string(start))
            if (is_set(o%from) .and. .not. o%from > 0) call make_error(error, error_code%input, &
               'option --from: a search of the '//name//' needs a value above 0')
            if (is_set(o%to) .and. .not. o%to > 0) call make_error(error, error_code%input, &
               'option --to: a search of the '//name//' needs a value above 0')
            if (has_both .and. .not. o%to > o%from) call make_error(error, error_code%input, &
               'options --from, --to: the model has to be stable at --from and fail at --to, which must be larger')
         case (search_kind%tilt)
            if ((is_set(o%from) .and. abs(o%from) > 90) .or. (is_set(o%to) .and. abs(o%to) > 90)) call make_error( &
               error, error_code%input, 'options --from, --to: a tilt is an angle from -90 to 90 degrees')
            if (has_both .and. .not. allocated(error)) call check_way()
         case (search_kind%push, search_kind%load)
            if (has_both) call check_way()
         end select
      end associate

   contains

      !> A value between 0 and --from is as stable: the search goes away from 0, or to the other side of it.
      subroutine check_way()
         if (abs(options%to) < abs(options%from) .and. options%to*options%from >= 0) call make_error(error, &
            error_code%input, 'options --from, --to: the model has to be stable at --from and fail at --to, which '// &
            'must be further from 0, or on its other side')
      end subroutine check_way

   end subroutine check_values

end module rockdda_run_factor_search
