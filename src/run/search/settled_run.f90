! SPDX-License-Identifier: MIT
!> Compute the state from which all trials of a search begin, or take it from the journal.
module rockdda_run_settled_run
   use rockdda_base_error, only : error_type
   use rockdda_base_strings, only : to_string
   use rockdda_base_version, only : version
   use rockdda_stepping_simulation, only : simulation_type
   use rockdda_io_checkpoint, only : checkpoint_facts_type, checkpoint_path
   use rockdda_io_digest, only : digest_length
   use rockdda_io_timestamp, only : utc_now
   use rockdda_run_checkpointing, only : load_checkpoint, save_checkpoint
   use rockdda_run_input, only : model_input_type
   use rockdda_run_search_journal, only : search_journal_type
   use rockdda_run_settled_state, only : is_settled
   use rockdda_run_trial, only : trial_type, search_observer_type
   implicit none
   private
   public :: find_settled_state

contains

   !> The settled state: from the journal, or computed.
   subroutine find_settled_state(input, journal, observer, settled, known, interrupted, error)
      type(model_input_type), intent(in) :: input
      type(search_journal_type), intent(inout) :: journal
      class(search_observer_type), intent(in) :: observer
      type(simulation_type), intent(out) :: settled
      type(trial_type), allocatable, intent(inout) :: known(:)   !! trials of the journal
      logical, intent(out) :: interrupted
      type(error_type), allocatable, intent(out) :: error
      type(checkpoint_facts_type) :: facts
      type(error_type), allocatable :: unusable
      character(len=digest_length) :: digest
      interrupted = .false.
      if (journal%has_state()) then
         call load_checkpoint(checkpoint_path(journal%results()), settled, facts, digest, unusable)
         if (.not. allocated(unusable)) then
            call journal%read(known)
            return
         end if
      end if
      call begin_anew(settled)
      call settled%init(input%blocks, input%parameters, error)
      if (allocated(error)) return
      call settled%set_interruption(observer)
      do while (.not. is_settled(settled))
         call settled%advance(error)
         if (allocated(error)) then
            error%message = error%message//new_line('a')//'  a search begins at rest: '// &
                            "look at the model with 'rockdda run', or name an earlier stage with --stage"
            return
         end if
         interrupted = settled%interrupted .or. observer%is_requested()
         if (interrupted) return
         call observer%progress('state at rest, step '//to_string(settled%state%step)//', unbalanced '// &
                                to_string(settled%record%unbalanced, 2))
      end do
      call begin_journal(input, settled, journal, unusable)
      journal%is_kept = .not. allocated(unusable)
      if (allocated(unusable)) call observer%warn('the search cannot be continued when it is stopped: '// &
                                                  unusable%message)
   end subroutine find_settled_state

   !> A simulation without anything.
   subroutine begin_anew(sim)
      type(simulation_type), intent(out) :: sim
      associate (unused => sim%dt)
      end associate
   end subroutine begin_anew

   !> Write the settled state and an empty list of trials.
   subroutine begin_journal(input, settled, journal, error)
      type(model_input_type), intent(in) :: input
      type(simulation_type), intent(inout) :: settled      !! not changed
      type(search_journal_type), intent(in) :: journal
      type(error_type), allocatable, intent(out) :: error
      type(checkpoint_facts_type) :: facts
      character(len=digest_length) :: digest
      facts%model_file = input%model_file
      facts%analysis_file = input%analysis_file
      facts%config_file = input%config_file
      facts%header%title = input%parameters%title
      facts%header%program_version = version
      facts%header%created = utc_now()
      facts%header%geometry = input%model_text
      facts%header%analysis = input%analysis_text
      facts%header%config = input%config_text
      facts%written = utc_now()
      call save_checkpoint(journal%results(), settled, facts, .true., digest, error)
      if (.not. allocated(error)) call journal%begin(error)
   end subroutine begin_journal

end module rockdda_run_settled_run
