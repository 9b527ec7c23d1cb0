! SPDX-License-Identifier: MIT
!> The files of a run: results, log and checkpoint, and which of them are due.
!>
!> The log has files, model, messages, every number of the run with the value that it has, steps, and the end.
!>
!> Steps that are saved as frames: save_every = K: frame k is step k*K. save_dt = T: the first step at or after each
!> multiple of T. Both: both. Neither: K so that the run has about 100 frames; every tenth step, and the last one of
!> each stage, where the run ends with its last stage.
module rockdda_run_files
!$ use omp_lib, only : omp_get_max_threads
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type
   use rockdda_base_diagnostics, only : diagnostics_type
   use rockdda_base_strings, only : as_utf8, counted, to_string
   use rockdda_base_version, only : version, build_description
   use rockdda_contact_view, only : contact_view_type
   use rockdda_model_state, only : bolt_nodes_type, liner_nodes_type
   use rockdda_model_options, only : is_set, run_options_type
   use rockdda_model_stage_options, only : stage_names, water_of_stages
   use rockdda_model_resolve, only : length_scale
   use rockdda_stepping_simulation, only : simulation_type
   use rockdda_io_checkpoint, only : checkpoint_facts_type, checkpoint_path
   use rockdda_io_digest, only : digest_length
   use rockdda_io_log, only : log_path, log_type, model_text, parameters_text, columns_text, step_text
   use rockdda_io_results, only : results_type
   use rockdda_io_timestamp, only : utc_now, wall_seconds
   use rockdda_io_results_tables, only : results_header_type
   use rockdda_run_checkpointing, only : save_checkpoint, remove_checkpoint
   use rockdda_run_input, only : model_input_type
   use rockdda_run_outcome, only : cuts_text, reactions_text, time_error_text, strikes_text
   use rockdda_run_supports, only : supports_text
   use rockdda_model_parameters, only : parameters_type
   implicit none
   private
   public :: checkpoint_timer_type, run_files_type, frame_plan_type, new_frame_plan

   character(len=*), parameter :: nl = new_line('a')

   !> The first checkpoint of a run comes after this time at the latest [s]. A shorter run writes one, at its end.
   real(wp), parameter :: first_interval = 0.2_wp

   type :: checkpoint_timer_type
      real(wp), private :: last = 0           !! wall clock when the run began or its last checkpoint ended [s]
      logical, private :: is_first = .false.  !! no checkpoint has been written yet
   contains
      procedure :: start
      procedure :: waits_for_first
      procedure :: restart
      procedure :: is_due
   end type checkpoint_timer_type

   !> Approximate number of lines for steps.
   integer, parameter :: log_lines = 1000

   type, extends(log_type) :: run_log_type
      integer :: last_step = -1                             !! with a line
      character(len=:), allocatable, private :: choice      !! of the automatic solver, as logged
   contains
      procedure :: begin
      procedure :: reopen
      procedure, nopass :: is_line_due
      procedure :: write_step
      procedure :: write_outcome
   end type run_log_type

   !> Longest time between flushes of the results, at any options [s].
   real(wp), parameter :: longest_flush_interval = 2
   !> Default time between checkpoints [s].
   real(wp), parameter :: usual_checkpoint_interval = 60

   integer, parameter :: usual_frames = 100
   !> Steps from frame to frame where the number of steps is not known before.
   integer, parameter :: usual_steps = 10
   !> Frames beyond which their number does not matter.
   integer, parameter :: many_frames = 10000

   type :: frame_plan_type
      integer :: every = 0                      !! steps; 0: not by steps
      real(wp) :: interval = 0                  !! time; 0: not by time
      integer :: passed = 0                     !! multiples of the interval reached so far
   contains
      procedure :: saves
      procedure :: expected_frames
   end type frame_plan_type

   !> Rows of contacts that a frame takes at a time, about.
   integer, parameter :: slab = 262144

   type :: run_files_type
      character(len=:), allocatable :: output, log_file, checkpoint_file
      type(checkpoint_facts_type) :: facts         !! facts about the run in its checkpoints
      integer :: n_frames = 0                      !! in the results
      integer :: last_frame = -1                   !! step
      character(len=digest_length) :: digest = ''  !! of the loaded checkpoint
      type(results_type) :: results
      type(run_log_type) :: log
      type(frame_plan_type) :: plan
      type(checkpoint_timer_type), private :: timer
      type(contact_view_type), private :: contacts             !! scratch: a slab of contacts
      real(wp), allocatable, private :: stress(:, :)           !! their stresses
   contains
      procedure :: create_files
      procedure :: take_names
      procedure :: take_progress
      procedure :: reopen_files
      procedure :: save_frame
      procedure :: save
      procedure :: is_checkpoint_due
      procedure :: lacks_checkpoint
   end type run_files_type

contains

   !> Names of log and checkpoint, from that of the results.
   subroutine take_names(self)
      class(run_files_type), intent(inout) :: self
      self%log_file = log_path(self%output)
      self%checkpoint_file = checkpoint_path(self%output)
   end subroutine take_names

   !> How far the run was, by its facts.
   subroutine take_progress(self, step)
      class(run_files_type), intent(inout) :: self
      integer, intent(in) :: step     !! of the checkpoint
      self%plan%every = self%facts%frame_every
      self%plan%interval = self%facts%frame_interval
      self%plan%passed = self%facts%frames_passed
      self%last_frame = self%facts%last_frame
      self%n_frames = self%facts%rows%frames
      self%log%last_step = step
   end subroutine take_progress

   !> Create results and log. The first checkpoint follows when it is due.
   subroutine create_files(self, input, replace, sim, messages, error)
      class(run_files_type), intent(inout) :: self
      type(model_input_type), intent(in) :: input
      logical, intent(in) :: replace               !! results that exist
      type(simulation_type), intent(in) :: sim     !! at time 0
      type(diagnostics_type), intent(in) :: messages
      type(error_type), allocatable, intent(out) :: error
      call self%take_names()
      call start_facts(input, sim, self%facts)
      self%plan = new_frame_plan(input%options, input%parameters)
      self%facts%header%n_frames_expected = self%plan%expected_frames(input%parameters)
      call self%results%create(self%output, replace, self%facts%header, input%blocks, sim%state, error)
      if (allocated(error)) return
      call self%save_frame(sim, error)
      if (allocated(error)) then
         call self%results%discard()
      else
         call self%results%publish(error)
      end if
      if (allocated(error)) return
      ! that of an older run
      call remove_checkpoint(self%checkpoint_file)
      call self%log%begin(self%log_file, input, self%facts%header, self%output, self%plan, messages, error)
      call self%timer%start(wall_seconds())
   end subroutine create_files

   !> Reopen results and log at the checkpoint.
   subroutine reopen_files(self, sim, messages, error)
      class(run_files_type), intent(inout) :: self
      type(simulation_type), intent(in) :: sim
      type(diagnostics_type), intent(in) :: messages
      type(error_type), allocatable, intent(out) :: error
      call describe_run(sim, self%facts%checkpoint_every, self%facts%header)
      call self%results%reopen(self%output, self%facts%header, self%digest, self%facts%rows, sim%model_blocks(), &
                               sim%record, error)
      if (allocated(error)) return
      call self%timer%restart(wall_seconds())
      call self%log%reopen(self%log_file, sim, messages, error)
   end subroutine reopen_files

   !> Save a frame.
   subroutine save_frame(self, sim, error)
      class(run_files_type), intent(inout) :: self
      type(simulation_type), intent(in) :: sim
      type(error_type), allocatable, intent(out) :: error
      type(bolt_nodes_type) :: nodes
      type(liner_nodes_type) :: liner_nodes
      integer :: first, last
      self%last_frame = sim%state%step
      if (.not. self%facts%header%frames) return
      call sim%show_bolts(nodes)
      call sim%show_liners(liner_nodes)
      call self%results%append_frame(sim%state, sim%contacts%n, nodes%force, error, nodes, liner_nodes)
      last = 0
      do while (last < sim%contacts%n .and. .not. allocated(error))
         first = last + 1
         call sim%contact_slab(first, slab, last, self%contacts, self%stress)
         call self%results%append_contacts(sim%state%datum, self%contacts, self%stress, error)
      end do
      self%n_frames = self%n_frames + 1
   end subroutine save_frame

   !> Is a checkpoint due?
   logical function is_checkpoint_due(self, sim)
      class(run_files_type), intent(in) :: self
      type(simulation_type), intent(in) :: sim
      is_checkpoint_due = self%timer%is_due(wall_seconds(), self%facts%checkpoint_every, sim%is_finished())
   end function is_checkpoint_due

   !> Has a new run no checkpoint yet?
   pure logical function lacks_checkpoint(self)
      class(run_files_type), intent(in) :: self
      lacks_checkpoint = self%timer%waits_for_first()
   end function lacks_checkpoint

   !> Write a checkpoint of the last accepted step. The results reach the disk first, so that they contain all its rows.
   !> On error the older checkpoint and its undo file are unchanged.
   subroutine save(self, sim, error)
      class(run_files_type), intent(inout) :: self
      type(simulation_type), intent(inout) :: sim      !! not changed
      type(error_type), allocatable, intent(out) :: error
      character(len=digest_length) :: digest
      call self%timer%restart(wall_seconds())
      call self%results%flush(error)
      if (.not. allocated(error)) call self%results%sync(error)
      if (allocated(error) .or. self%results%has_failed()) return
      self%facts%rows = self%results%rows()
      self%facts%written = utc_now()
      self%facts%frame_every = self%plan%every
      self%facts%frame_interval = self%plan%interval
      self%facts%frames_passed = self%plan%passed
      self%facts%last_frame = self%last_frame
      call save_checkpoint(self%output, sim, self%facts, digest, error)
      call self%timer%restart(wall_seconds())
      if (.not. allocated(error)) call self%results%keep_undo(digest, error)
   end subroutine save

   !> Facts of a run that begins, with the header of its results.
   subroutine start_facts(input, sim, facts)
      type(model_input_type), intent(in) :: input
      type(simulation_type), intent(in) :: sim             !! at time 0
      type(checkpoint_facts_type), intent(inout) :: facts
      facts%model_file = input%model_file
      facts%analysis_file = input%analysis_file
      facts%config_file = input%config_file
      if (is_set(input%options%threads)) facts%threads = input%options%threads
      facts%checkpoint_every = usual_checkpoint_interval
      if (is_set(input%options%checkpoint_every)) facts%checkpoint_every = input%options%checkpoint_every
      associate (header => facts%header)
         header%title = as_utf8(input%parameters%title)
         header%program_version = version
         header%created = utc_now()
         header%geometry = input%model_text
         header%analysis = input%analysis_text
         header%config = input%config_text
         header%frames = input%options%write_frames
         header%contacts = input%options%write_contacts
         call sim%list_boundaries(header%n_boundaries, header%boundary_edges, header%boundary_kinds)
         call sim%list_water(header%water_edges, header%water_ends)
         header%water = sim%parameters%water
         header%stage_water = water_of_stages(input%parameters%stages)
      end associate
      call describe_run(sim, facts%checkpoint_every, facts%header)
   end subroutine start_facts

   !> The part of the header that follows from the run, and is not kept in checkpoints.
   subroutine describe_run(sim, checkpoint_every, header)
      type(simulation_type), intent(in) :: sim
      real(wp), intent(in) :: checkpoint_every             !! [s]
      type(results_header_type), intent(inout) :: header
      header%flush_interval = min(longest_flush_interval, checkpoint_every)
      header%single = sim%parameters%single_frames
      header%units = sim%parameters%units
      header%n_boundaries = size(sim%parameters%boundaries)
      call sim%list_bolts(header%n_bolt_nodes, header%bolt_names, header%bolt_first, header%bolt_spacing)
      call sim%list_liners(header%n_liner_nodes, header%liner_names, header%liner_first, header%liner_section)
      header%stage_names = stage_names(sim%parameters%stages, sim%parameters%ends_with_stages)
      allocate (header%stage_resets(size(header%stage_names)), source=0)
      associate (stages => sim%parameters%stages)
         header%stage_resets(:size(stages)) = merge(1, 0, stages%reset_displacement)
      end associate
   end subroutine describe_run

   !> Open the log, and write its head.
   subroutine begin(self, path, input, header, output, plan, messages, error)
      class(run_log_type), intent(inout) :: self
      character(len=*), intent(in) :: path
      type(model_input_type), intent(in) :: input
      type(results_header_type), intent(in) :: header
      character(len=*), intent(in) :: output              !! path of the results
      type(frame_plan_type), intent(in) :: plan
      type(diagnostics_type), intent(in) :: messages
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: text
      call self%open(path, error)
      if (allocated(error)) return
      text = build_description()//nl//'title: '//header%title//nl//'created: '//header%created//nl// &
             'geometry or blocks: '//input%model_file//nl
      if (len(input%analysis_file) > 0) text = text//'analysis: '//input%analysis_file//nl
      if (len(input%config_file) > 0) text = text//'options: '//input%config_file//nl
      call self%put(text//'results: '//output//nl//model_text(input%blocks)//nl//lines_of(messages)// &
                    parameters_text(input%parameters, options_in_effect(input, output, plan))//nl//columns_text(), &
                    error)
      if (.not. allocated(error)) call self%flush(error)
   end subroutine begin

   !> The options, those that were not given with the value that the run takes instead.
   function options_in_effect(input, output, plan) result(options)
      type(model_input_type), intent(in) :: input
      character(len=*), intent(in) :: output
      type(frame_plan_type), intent(in) :: plan
      type(run_options_type) :: options
      options = input%options
      options%save_every = plan%every
      options%output_file = output
      options%threads = 1
!$    options%threads = omp_get_max_threads()
      options%length_scale = length_scale(input%options%length_scale, input%analysis%dialect)
   end function options_in_effect

   !> Open the log of a run that continues from a checkpoint, at its end.
   subroutine reopen(self, path, sim, messages, error)
      class(run_log_type), intent(inout) :: self
      character(len=*), intent(in) :: path
      type(simulation_type), intent(in) :: sim
      type(diagnostics_type), intent(in) :: messages
      type(error_type), allocatable, intent(out) :: error
      call self%open(path, error, append=.true.)
      if (.not. allocated(error)) call self%put('resumed: from step '//to_string(sim%state%step)//' at time '// &
         to_string(sim%state%time, 10)//', '//utc_now()//nl//lines_of(messages)//columns_text(), error)
   end subroutine reopen

   !> Notes and warnings, each with a line end.
   function lines_of(messages) result(text)
      type(diagnostics_type), intent(in) :: messages
      character(len=:), allocatable :: text
      integer :: i
      text = ''
      do i = 1, messages%n
         text = text//messages%items(i)%format()//nl
      end do
   end function lines_of

   !> Is a line due for the last step? For the first one, for steps with several attempts or a frame, and so often
   !> that the log has about `log_lines`.
   pure logical function is_line_due(sim, has_frame)
      type(simulation_type), intent(in) :: sim
      logical, intent(in) :: has_frame
      integer :: every
      every = 1
      if (sim%parameters%n_steps < huge(1)) every = max(1, sim%parameters%n_steps/log_lines)
      is_line_due = has_frame .or. sim%state%step == 1 .or. mod(sim%state%step, every) == 0 .or. &
                    sim%record%attempts > 1
   end function is_line_due

   !> Write the line of a step, and one more when the automatic solver has changed its method.
   subroutine write_step(self, sim, error)
      class(run_log_type), intent(inout) :: self
      type(simulation_type), intent(in) :: sim
      type(error_type), allocatable, intent(out) :: error
      call self%put(step_text(sim%record, sim%parameters), error)
      if (.not. allocated(error)) call write_choice(self, sim, error)
      self%last_step = sim%state%step
   end subroutine write_step

   !> Write a line when the automatic solver has changed its method.
   subroutine write_choice(self, sim, error)
      type(run_log_type), intent(inout) :: self
      type(simulation_type), intent(in) :: sim
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: name
      if (.not. allocated(sim%solver%choice)) return
      name = sim%solver%choice(1:scan(sim%solver%choice//' ', ' :') - 1)
      if (allocated(self%choice)) then
         if (self%choice == name) return
      end if
      call self%put('# solver from here on: '//sim%solver%choice, error)
      self%choice = name
   end subroutine write_choice

   !> Write forces of boundaries, supports, planned time and cut steps.
   subroutine write_outcome(self, sim, error)
      class(run_log_type), intent(inout) :: self
      type(simulation_type), intent(in) :: sim
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: text, supports
      text = ''
      if (size(sim%parameters%boundaries) > 0) text = reactions_text(sim)//nl
      supports = supports_text(sim, '# ')
      if (len(supports) > 0) text = text//supports//nl
      text = text//'# planned time: '
      if (sim%planned_time() > 0) then
         text = text//to_string(sim%planned_time(), 10)
      else
         text = text//'none, the stages decide'
      end if
      text = text//'. '//cuts_text(sim)
      if (len(time_error_text(sim)) > 0) text = text//nl//'# '//time_error_text(sim)
      if (len(strikes_text(sim)) > 0) text = text//nl//'# '//strikes_text(sim)
      if (sim%parameters%sleeps) text = text//nl//'# asleep: '//to_string(count(sim%state%asleep))//' of '// &
         counted(sim%blocks%n_blocks - sim%blocks%n_segments, 'block')//'; the unbalanced force is that of the others'
      call self%put(text, error)
   end subroutine write_outcome

   !> A new run begins at this time.
   subroutine start(self, now)
      class(checkpoint_timer_type), intent(inout) :: self
      real(wp), intent(in) :: now             !! wall clock [s]
      self%last = now
      self%is_first = .true.
   end subroutine start

   !> Has a new run no checkpoint yet?
   pure logical function waits_for_first(self)
      class(checkpoint_timer_type), intent(in) :: self
      waits_for_first = self%is_first
   end function waits_for_first

   !> A checkpoint ended at this time.
   subroutine restart(self, now)
      class(checkpoint_timer_type), intent(inout) :: self
      real(wp), intent(in) :: now             !! wall clock [s]
      self%last = now
      self%is_first = .false.
   end subroutine restart

   !> Has the interval passed since the last checkpoint, or a shorter one since the start? A run that is finished writes
   !> its checkpoint at the close.
   pure logical function is_due(self, now, interval, is_finished)
      class(checkpoint_timer_type), intent(in) :: self
      real(wp), intent(in) :: now             !! wall clock [s]
      real(wp), intent(in) :: interval        !! [s]
      logical, intent(in) :: is_finished
      real(wp) :: wait
      wait = interval
      if (self%is_first) wait = min(first_interval, interval)
      is_due = now - self%last >= wait .and. .not. is_finished
   end function is_due

   !> The plan of a run.
   pure function new_frame_plan(options, parameters) result(plan)
      type(run_options_type), intent(in) :: options
      type(parameters_type), intent(in) :: parameters
      type(frame_plan_type) :: plan
      real(wp) :: steps
      if (is_set(options%save_every)) plan%every = max(1, options%save_every)
      if (is_set(options%save_dt)) plan%interval = max(0.0_wp, options%save_dt)
      if (plan%every > 0 .or. plan%interval > 0) return
      if (parameters%n_steps == huge(1) .and. .not. parameters%t_end < huge(1.0_wp)) then
         ! how many steps the stages need is not known; each also ends with a frame
         plan%every = usual_steps
         return
      end if
      steps = parameters%n_steps
      if (parameters%t_end < steps*parameters%dt_max) steps = parameters%t_end/parameters%dt_max
      plan%every = max(1, int(min(steps/usual_frames, 1.0e9_wp)))
   end function new_frame_plan

   !> Is this accepted step a frame? Call it once for each step, in order.
   logical function saves(self, step, time)
      class(frame_plan_type), intent(inout) :: self
      integer, intent(in) :: step
      real(wp), intent(in) :: time               !! at the end of the step
      integer :: reached
      saves = .false.
      if (self%every > 0) saves = mod(step, self%every) == 0
      if (.not. self%interval > 0) return
      ! a step that ends on a multiple up to rounding has reached it
      reached = int(min(time/self%interval*(1 + 1.0e-12_wp), real(huge(1), wp)))
      if (reached > self%passed) saves = .true.
      self%passed = max(self%passed, reached)
   end function saves

   !> Number of frames when no step is cut; 0 where the number of steps is not known before.
   pure integer function expected_frames(self, parameters)
      class(frame_plan_type), intent(in) :: self
      type(parameters_type), intent(in) :: parameters
      real(wp) :: frames, steps
      steps = huge(1.0_wp)
      if (parameters%n_steps < huge(1)) steps = parameters%n_steps
      frames = 0
      if (self%every > 0 .and. steps < huge(1.0_wp)) frames = steps/self%every
      if (self%interval > 0) then
         if (parameters%t_end < huge(1.0_wp)) frames = frames + parameters%t_end/self%interval
         if (steps < huge(1.0_wp)) frames = min(frames, steps)
      end if
      expected_frames = int(min(frames, real(many_frames, wp)))
   end function expected_frames

end module rockdda_run_files
