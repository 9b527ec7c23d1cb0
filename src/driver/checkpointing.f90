! SPDX-License-Identifier: MIT
!> A simulation into a checkpoint and out of it.
module rockdda_driver_checkpointing
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_stepping_simulation, only : simulation_type
   use rockdda_io_archive, only : archive_type
   use rockdda_io_checkpoint, only : checkpoint_type, checkpoint_facts_type
   use rockdda_io_checkpoint_model, only : exchange_blocks, exchange_parameters
   use rockdda_io_checkpoint_state, only : exchange_state, exchange_contacts, exchange_control, exchange_ledger, &
      exchange_record, state_fits
   use rockdda_io_digest, only : digest_length
   implicit none
   private
   public :: save_checkpoint, load_checkpoint

contains

   !> Write a checkpoint of a simulation beside its results. On error the older one is as it was.
   subroutine save_checkpoint(results, sim, facts, sync, digest, error)
      character(len=*), intent(in) :: results             !! path
      type(simulation_type), intent(inout) :: sim         !! not changed
      type(checkpoint_facts_type), intent(inout) :: facts
      logical, intent(in) :: sync                         !! wait until it is on the disk
      character(len=digest_length), intent(out) :: digest
      type(error_type), allocatable, intent(out) :: error
      type(checkpoint_type) :: checkpoint
      digest = ''
      call checkpoint%begin_saving(results, facts, error)
      if (allocated(error)) return
      call exchange_blocks(checkpoint%archive, sim%blocks)
      call exchange_parameters(checkpoint%archive, sim%parameters)
      call exchange_simulation(checkpoint%archive, sim)
      call checkpoint%end_saving(sync, error)
      digest = checkpoint%digest
   end subroutine save_checkpoint

   !> The simulation of a checkpoint, and what else it says.
   subroutine load_checkpoint(path, sim, facts, digest, error)
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
      call exchange_blocks(checkpoint%archive, blocks)
      call exchange_parameters(checkpoint%archive, parameters)
      if (.not. allocated(checkpoint%archive%error)) call sim%init(blocks, parameters, error)
      if (.not. allocated(error)) call exchange_simulation(checkpoint%archive, sim)
      call checkpoint%end_loading(problem)
      if (.not. allocated(error) .and. allocated(problem)) call move_alloc(problem, error)
   end subroutine load_checkpoint

   !> Everything that the steps to come depend on besides the model.
   subroutine exchange_simulation(archive, sim)
      type(archive_type), intent(inout) :: archive
      type(simulation_type), intent(inout) :: sim
      real(wp), allocatable :: memory(:)
      logical :: complete
      if (allocated(archive%error)) return
      call exchange_state(archive, sim%state)
      call exchange_contacts(archive, sim%contacts)
      call exchange_control(archive, sim%control)
      call exchange_ledger(archive, sim%ledger)
      call exchange_record(archive, sim%record)
      call archive%section('solver')
      call archive%item('line_ends', sim%line_ends)
      call archive%item('last_solution', sim%equations%x)
      if (archive%saving) call sim%solver%pack(memory)
      call archive%item('memory', memory)
      if (archive%saving .or. allocated(archive%error)) return
      if (allocated(memory)) call sim%solver%unpack(memory)
      complete = state_fits(sim%state, sim%blocks) .and. allocated(sim%equations%x) .and. &
                 allocated(sim%line_ends) .and. allocated(sim%control%released) .and. &
                 allocated(sim%ledger%fixed_energy) .and. &
                 allocated(sim%record%measured_displacement) .and. allocated(sim%record%measured_stress) .and. &
                 allocated(sim%record%measured_rotation) .and. allocated(sim%record%fixed_force)
      if (complete) complete = size(sim%equations%x, 2) == sim%blocks%n_blocks
      if (.not. complete) call make_error(archive%error, error_code%input, archive%file%path// &
                                          ': the state does not fit the model')
   end subroutine exchange_simulation

end module rockdda_driver_checkpointing
