! SPDX-License-Identifier: MIT
!> The files of a run: results, log and checkpoint, and what of them is due.
module rockdda_run_files
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type
   use rockdda_base_diagnostics, only : diagnostics_type
   use rockdda_contact_view, only : contact_view_type
   use rockdda_model_state, only : bolt_nodes_type, liner_nodes_type
   use rockdda_stepping_simulation, only : simulation_type
   use rockdda_io_checkpoint, only : checkpoint_facts_type, checkpoint_path
   use rockdda_io_digest, only : digest_length
   use rockdda_io_log, only : log_path
   use rockdda_io_results, only : results_type
   use rockdda_io_timestamp, only : utc_now, wall_seconds
   use rockdda_run_checkpoint_timer, only : checkpoint_timer_type
   use rockdda_run_checkpointing, only : save_checkpoint, remove_checkpoint
   use rockdda_run_frame_plan, only : frame_plan_type, new_frame_plan
   use rockdda_run_input, only : model_input_type
   use rockdda_run_log, only : run_log_type
   use rockdda_run_results_head, only : start_facts, describe_run
   implicit none
   private
   public :: run_files_type

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

end module rockdda_run_files
