! SPDX-License-Identifier: MIT
!> Compute the state from which all trials of a search begin, or take it from the journal.
module rockdda_run_settled_run
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : counted, to_string
   use rockdda_base_version, only : version
   use rockdda_model_stage_options, only : stage_name
   use rockdda_stepping_simulation, only : simulation_type
   use rockdda_io_checkpoint, only : checkpoint_facts_type, checkpoint_path
   use rockdda_io_digest, only : digest_length
   use rockdda_io_timestamp, only : utc_now
   use rockdda_run_checkpointing, only : load_checkpoint, save_checkpoint
   use rockdda_run_input, only : model_input_type
   use rockdda_run_search_journal, only : search_journal_type
   use rockdda_run_settled_state, only : is_settled
   use rockdda_run_trial, only : trial_type, search_observer_type
   use rockdda_run_trial_verdict, only : extent_of, trial_verdict_type, verdict
   implicit none
   private
   public :: find_settled_state

   !> A block that has moved by this share of the extent of the model and is still pulled as before will not stop.
   real(wp), parameter :: slides_far = 0.25_wp
   !> A state at rest that is farther than this share of the extent from the one drawn is worth a warning.
   real(wp), parameter :: far_from_drawn = 0.01_wp
   character(len=*), parameter :: what_to_do = "  a search begins at rest: look at the model with 'rockdda run', "// &
                                               'or name an earlier stage with --stage'

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
      type(trial_verdict_type) :: judgement
      real(wp), allocatable :: drawn(:, :)     !! (2, nb) centroids
      real(wp) :: far
      integer :: stage
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
      drawn = settled%state%centroid
      stage = 0
      do while (.not. is_settled(settled))
         if (settled%control%stage /= stage) then
            stage = settled%control%stage
            far = slides_far*extent_of(settled)
            call judgement%begin(settled, far)
         end if
         call settled%advance(error)
         if (allocated(error)) then
            error%message = error%message//new_line('a')//what_to_do
            return
         end if
         interrupted = settled%interrupted .or. observer%is_requested()
         if (interrupted) return
         if (settled%control%stage == stage .and. settled%control%is_static_search(settled%parameters)) then
            if (judgement%judge(settled) == verdict%failing) then
               call report_slide(settled, judgement, error)
               return
            end if
         end if
         call observer%progress('state at rest, step '//to_string(settled%state%step)//', unbalanced '// &
                                to_string(settled%record%unbalanced, 2))
      end do
      call tell_displacement(settled, drawn, observer)
      call begin_journal(input, settled, journal, unusable)
      journal%is_kept = .not. allocated(unusable)
      if (allocated(unusable)) call observer%warn('the search cannot be continued when it is stopped: '// &
                                                  unusable%message)
   end subroutine find_settled_state

   !> The error of a stage in which a block slides or falls for ever.
   subroutine report_slide(sim, judgement, error)
      type(simulation_type), intent(in) :: sim
      type(trial_verdict_type), intent(in) :: judgement
      type(error_type), allocatable, intent(out) :: error
      associate (b => judgement%first_failing, stage => sim%control%stage)
         call make_error(error, error_code%computation, "stage '"//stage_name(sim%parameters%stages, stage)// &
            "' did not come to equilibrium: after "//counted(sim%control%steps, 'step')//' block '//to_string(b)// &
            ' at ('// &
            to_string(sim%state%centroid(1, b) + sim%state%datum(1), 5)//', '// &
            to_string(sim%state%centroid(2, b) + sim%state%datum(2), 5)//') has moved by '// &
            to_string(judgement%moved(b), 3)//', and the force that moves it does not fall (unbalanced '// &
            to_string(sim%record%unbalanced, 3)//')'//new_line('a')// &
            '  the model is not stable as it is: for a factor below 1 give the joints N times their tan(friction), '// &
            'cohesion and tension, and divide the factor found by N'//new_line('a')//what_to_do)
      end associate
   end subroutine report_slide

   !> Tell when the state at rest is far from the one that was drawn.
   subroutine tell_displacement(sim, drawn, observer)
      type(simulation_type), intent(in) :: sim
      real(wp), intent(in) :: drawn(:, :)      !! (2, nb) centroids
      class(search_observer_type), intent(in) :: observer
      real(wp) :: way, largest
      integer :: b, i
      largest = 0
      b = 0
      do i = 1, sim%blocks%n_blocks
         if (.not. sim%state%active(i)) cycle
         way = norm2(sim%state%centroid(:, i) - drawn(:, i))
         if (.not. way > largest) cycle
         largest = way
         b = i
      end do
      if (.not. largest > far_from_drawn*extent_of(sim)) return
      call observer%warn('the state at rest, from which the search begins, is not the one that was drawn: block '// &
                         to_string(b)//' has moved by '//to_string(largest, 3)//'; look at it with '// &
                         "'rockdda run': the factor is that of the model after this motion")
   end subroutine tell_displacement

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
      call save_checkpoint(journal%results(), settled, facts, digest, error)
      if (.not. allocated(error)) call journal%begin(error)
   end subroutine begin_journal

end module rockdda_run_settled_run
