! SPDX-License-Identifier: MIT
!> Compute the state from which all trials of a search begin, or take it from the journal.
module rockdda_run_settled_run
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : to_string
   use rockdda_base_version, only : version
   use rockdda_model_parameters, only : parameters_type
   use rockdda_stepping_simulation, only : simulation_type
   use rockdda_io_checkpoint, only : checkpoint_facts_type, checkpoint_path
   use rockdda_io_digest, only : digest_length
   use rockdda_io_timestamp, only : utc_now
   use rockdda_run_checkpointing, only : load_checkpoint, save_checkpoint
   use rockdda_run_input, only : model_input_type
   use rockdda_run_search_journal, only : search_journal_type
   use rockdda_run_search_options, only : search_options_type, search_kind, search_names
   use rockdda_run_searched, only : searched_type
   use rockdda_run_settling, only : settle
   use rockdda_run_trial, only : trial_type, search_observer_type
   implicit none
   private
   public :: find_settled_state, settled_text

   !> Largest multiple of its strength with which a model may stand.
   real(wp), parameter :: most_strength = 64
   character(len=*), parameter :: what_to_do = "  a search begins at rest: look at the model with 'rockdda run', "// &
                                               'or name an earlier stage with --stage'

contains

   !> The settled state: from the journal, or computed. A search of the strength begins where the model stands with the
   !> least of 1, 2, 4 ... 64 times the strength of the joints that it reduces.
   subroutine find_settled_state(input, options, searched, journal, observer, settled, known, interrupted, error)
      type(model_input_type), intent(in) :: input
      type(search_options_type), intent(in) :: options
      type(searched_type), intent(in) :: searched
      type(search_journal_type), intent(inout) :: journal        !! with the multiple of the strength
      class(search_observer_type), intent(in) :: observer
      type(simulation_type), intent(out) :: settled
      type(trial_type), allocatable, intent(inout) :: known(:)   !! trials of the journal
      logical, intent(out) :: interrupted
      type(error_type), allocatable, intent(out) :: error
      type(checkpoint_facts_type) :: facts
      type(error_type), allocatable :: unusable
      type(parameters_type) :: parameters
      character(len=digest_length) :: digest
      character(len=:), allocatable :: fault, first_fault
      interrupted = .false.
      if (journal%has_state()) then
         call load_checkpoint(checkpoint_path(journal%results()), settled, facts, digest, unusable)
         if (.not. allocated(unusable)) then
            call journal%read(known)
            return
         end if
      end if
      journal%strength = 1
      do
         parameters = input%parameters
         call searched%scale(searched%value_at_rest(journal%strength), parameters)
         call settle(input%blocks, parameters, journal%strength, observer, settled, interrupted, fault, error)
         if (interrupted .or. allocated(error)) return
         if (len(fault) == 0) exit
         if (.not. allocated(first_fault)) first_fault = fault
         if (options%kind /= search_kind%strength .or. .not. journal%strength < most_strength) then
            call refuse(options, journal%strength, fault, error)
            return
         end if
         journal%strength = 2*journal%strength
      end do
      if (allocated(first_fault)) call observer%warn('the model does not stand with its strength: '//first_fault// &
         new_line('a')//'  '//settled_text(journal%strength))
      call begin_journal(input, settled, journal, unusable)
      journal%is_kept = .not. allocated(unusable)
      if (allocated(unusable)) call observer%warn('the search cannot be continued when it is stopped: '// &
                                                  unusable%message)
   end subroutine find_settled_state

   !> How a search begins where the model does not stand.
   pure function settled_text(strength) result(text)
      real(wp), intent(in) :: strength      !! times that of the model
      character(len=:), allocatable :: text
      text = 'the search begins from the model at rest with '//to_string(strength)// &
             ' times the strength of the joints that it reduces'
   end function settled_text

   !> The error of a model that does not stand.
   subroutine refuse(options, strength, fault, error)
      type(search_options_type), intent(in) :: options
      real(wp), intent(in) :: strength
      character(len=*), intent(in) :: fault
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: text
      text = 'the model does not stand'
      if (strength > 1) text = text//' even with '//to_string(strength)//' times the strength of the joints searched'
      text = text//': '//fault//new_line('a')
      if (options%kind == search_kind%strength) then
         text = text//'  what fails has no finite factor: supports, gaps, blocks that topple, joints that --joints '// &
                'leaves out'
      else
         text = text//'  a search of the '//trim(search_names(options%kind))//' begins with a model that stands: '// &
                'give its joints more strength, or find its factor with --search strength'
      end if
      call make_error(error, error_code%computation, text//new_line('a')//what_to_do)
   end subroutine refuse

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
      call save_checkpoint(journal%results(), settled, facts, digest, error)
      if (.not. allocated(error)) call journal%begin(error)
   end subroutine begin_journal

end module rockdda_run_settled_run
