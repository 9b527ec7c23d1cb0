! SPDX-License-Identifier: MIT
!> Write a simulation to a checkpoint, read it, and check one.
module rockdda_run_checkpointing
   use rockdda_base_kinds, only : wp, i8
   use rockdda_base_error, only : error_type
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_stepping_simulation, only : simulation_type
   use rockdda_io_archive, only : archive_type
   use rockdda_io_checkpoint, only : checkpoint_type, checkpoint_facts_type, results_path
   use rockdda_io_checkpoint_model, only : exchange_blocks, exchange_parameters
   use rockdda_io_checkpoint_state, only : exchange_state, exchange_contacts, exchange_control, &
      exchange_construction, exchange_ledger, exchange_record, exchange_reported
   use rockdda_io_digest, only : digest_length
   use rockdda_io_guard, only : run_in_child, end_child, explain, begin_reading, end_reading, guard
   use rockdda_io_posix, only : get_file_size, get_path_kind, path_kind, remove_file
   implicit none
   private
   public :: save_checkpoint, load_checkpoint, check_checkpoint, remove_checkpoint

   !> Limit of the processor time to read a checkpoint: a constant [s], which is enough under valgrind, and bytes per
   !> second.
   real(wp), parameter :: least_seconds = 4, slowest_reading = 1.0e7_wp

contains

   !> Write a checkpoint of a simulation beside its results and wait until it is on the disk. On error the older one is
   !> unchanged.
   subroutine save_checkpoint(results, sim, facts, digest, error)
      character(len=*), intent(in) :: results             !! path
      type(simulation_type), intent(inout) :: sim         !! not changed
      type(checkpoint_facts_type), intent(inout) :: facts
      character(len=digest_length), intent(out) :: digest
      type(error_type), allocatable, intent(out) :: error
      type(checkpoint_type) :: checkpoint
      type(block_system_type) :: blocks
      digest = ''
      call checkpoint%begin_saving(results, facts, error)
      if (allocated(error)) return
      blocks = sim%model_blocks()
      call exchange_parameters(checkpoint%archive, sim%parameters)
      call exchange_blocks(checkpoint%archive, sim%parameters, blocks)
      call exchange_simulation(checkpoint%archive, sim, facts)
      call checkpoint%end_saving(error)
      digest = checkpoint%digest
   end subroutine save_checkpoint

   !> Read simulation and facts from a checkpoint. A child process tries it first, because HDF5 does not survive every
   !> damaged file.
   subroutine load_checkpoint(path, sim, facts, digest, error)
      character(len=*), intent(in) :: path
      type(simulation_type), intent(inout) :: sim
      type(checkpoint_facts_type), intent(inout) :: facts
      character(len=digest_length), intent(out) :: digest
      type(error_type), allocatable, intent(out) :: error
      integer :: outcome
      call run_in_child(least_seconds + real(max(0_i8, get_file_size(path)), wp)/slowest_reading, outcome, error)
      if (outcome == guard%in_child) then
         call load_values(path, sim, facts, digest, error)
         call end_child(error)
      end if
      call explain(outcome, path, 'the checkpoint', error)
      if (allocated(error)) return
      call begin_reading(path)
      call load_values(path, sim, facts, digest, error)
      call end_reading()
   end subroutine load_checkpoint

   !> Remove the checkpoint of older results.
   subroutine remove_checkpoint(path)
      character(len=*), intent(in) :: path
      call remove_file(path)
   end subroutine remove_checkpoint

   !> Check a checkpoint completely, and that its results are in the same folder.
   subroutine check_checkpoint(path, messages)
      character(len=*), intent(in) :: path
      type(diagnostics_type), intent(inout) :: messages
      type(simulation_type) :: sim
      type(checkpoint_facts_type) :: facts
      type(error_type), allocatable :: error
      type(origin_type) :: origin
      character(len=digest_length) :: digest
      call load_checkpoint(path, sim, facts, digest, error)
      origin%file = path
      if (allocated(error)) then
         call messages%add(severity%error, error%message(len(path) + 3:), origin)
      else if (get_path_kind(results_path(path, facts%results_ending)) /= path_kind%file) then
         call messages%add(severity%warning, 'its results '//results_path(path, facts%results_ending)// &
                           ' are not beside it', origin)
      end if
   end subroutine check_checkpoint

   !> Read and check everything.
   subroutine load_values(path, sim, facts, digest, error)
      character(len=*), intent(in) :: path
      type(simulation_type), intent(inout) :: sim
      type(checkpoint_facts_type), intent(inout) :: facts
      character(len=digest_length), intent(out) :: digest
      type(error_type), allocatable, intent(out) :: error
      type(checkpoint_type) :: checkpoint
      type(block_system_type) :: blocks
      type(parameters_type) :: parameters
      type(error_type), allocatable :: problem
      call checkpoint%begin_loading(path, facts, error)
      digest = checkpoint%digest
      if (allocated(error)) return
      associate (archive => checkpoint%archive)
         call exchange_parameters(archive, parameters)
         if (.not. allocated(archive%error)) call exchange_blocks(archive, parameters, blocks)
         if (.not. allocated(archive%error)) call sim%init(blocks, parameters, error)
         if (allocated(error)) error%message = path//': the checkpoint is damaged: '//error%message
         if (.not. allocated(error)) call exchange_simulation(archive, sim, facts)
      end associate
      call checkpoint%end_loading(problem)
      if (.not. allocated(error) .and. allocated(problem)) call move_alloc(problem, error)
   end subroutine load_values

   !> Write or read the state that the following steps depend on.
   subroutine exchange_simulation(archive, sim, facts)
      type(archive_type), intent(inout) :: archive
      type(simulation_type), intent(inout) :: sim
      type(checkpoint_facts_type), intent(in) :: facts     !! loaded
      real(wp), allocatable :: memory(:), start_forces(:)
      integer :: nb, n_springs
      if (allocated(archive%error)) return
      nb = sim%blocks%n_blocks
      n_springs = size(sim%families%boundaries%springs%list)
      call exchange_state(archive, sim%blocks, sim%parameters, n_springs, sim%state)
      call archive%demand(sim%state%step == facts%rows%steps, 'step')
      call exchange_contacts(archive, sim%blocks, size(sim%parameters%joint_materials), sim%contacts)
      call exchange_control(archive, sim%blocks, size(sim%parameters%stages), sim%state%step, sim%control)
      call exchange_construction(archive, sim%parameters, nb, sim%construction, &
                                 sim%families%contacts%stiffness_is_new)
      call sim%families%exchange_state(sim%step_context_type, archive)
      call exchange_ledger(archive, sim%blocks, sim%ledger)
      call exchange_reported(archive, sim%construction%lodging)
      call exchange_record(archive, sim%blocks, sim%parameters, sim%state, sim%record)
      call archive%section('solver')
      call archive%item('line_ends', sim%line_ends, [4, size(sim%parameters%line_loads)])
      ! materials that have changed give another stress at the start
      start_forces = sim%families%boundaries%springs%list%start_force
      call archive%item('boundary_start_forces', start_forces, n_springs)
      call archive%item('last_solution', sim%equations%x, [6, nb])
      if (archive%saving) call sim%solver%pack(memory)
      call archive%item('memory', memory)
      if (.not. archive%has_loaded()) return
      sim%families%boundaries%springs%list%start_force = start_forces
      if (.not. allocated(memory)) return
      ! counts of solves
      call archive%demand(all(memory(2:) >= 0 .and. memory(2:) <= 2.0_wp**30), 'memory')
      if (archive%has_loaded()) call sim%solver%unpack(memory)
   end subroutine exchange_simulation

end module rockdda_run_checkpointing
