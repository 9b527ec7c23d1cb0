! SPDX-License-Identifier: MIT
!> Compute the state from which all trials of a search begin, or take it from the journal.
!> The model is brought to rest; it stands when no block has moved but by deformation.
module rockdda_run_settled_run
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : to_string, counted
   use rockdda_base_version, only : version
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_block_names, only : block_name
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_stage_options, only : stage_name
   use rockdda_stepping_simulation, only : simulation_type
   use rockdda_stepping_control, only : goes_on
   use rockdda_stepping_stage_equilibrium, only : base_moves
   use rockdda_stepping_stage_watch, only : progress_type
   use rockdda_stepping_verdict, only : apart, typical_size, usual_share, verdict_type, verdict
   use rockdda_io_checkpoint, only : checkpoint_facts_type, checkpoint_path
   use rockdda_io_digest, only : digest_length
   use rockdda_io_timestamp, only : utc_now
   use rockdda_run_checkpointing, only : load_checkpoint, save_checkpoint
   use rockdda_run_input, only : model_input_type
   use rockdda_run_search_journal, only : search_journal_type
   use rockdda_run_search_options, only : search_options_type, search_kind, search_names
   use rockdda_run_searched, only : searched_type
   use rockdda_run_trial, only : trial_type, search_observer_type
   use rockdda_run_settled_state, only : is_settled
   implicit none
   private
   public :: find_settled_state, splinter_text

   !> A model that stands moves no block further than this share of its size, or than four times what it deforms by. On
   !> the way there the pull of a block that slides is found to stay when it has moved four times as far as to the first
   !> mark.
   real(wp), parameter :: most_moved = 0.01_wp, most_deformed = 4.0_wp, first_mark = most_moved/4

   !> Largest multiple of its strength with which a model may stand.
   real(wp), parameter :: most_strength = 64
   !> Blocks are splinters when all that move have less than this share of a typical block's area.
   real(wp), parameter :: splinter = 0.01_wp
   !> A model in which nothing fails misses rest by little when its forces do by less than this times the tolerance.
   real(wp), parameter :: little = 100
   character(len=*), parameter :: what_to_do = "  a search begins at rest: examine the model with 'rockdda run', "// &
                                               'or name an earlier stage with --stage'

contains

   !> The settled state: from the journal, or computed. A search of the strength begins where the model stands with the
   !> least of 1, 2, 4 ... 64 times the strength of the joints that it reduces.
   subroutine find_settled_state(input, options, searched, journal, observer, settled, known, told, interrupted, error)
      type(model_input_type), intent(in) :: input
      type(search_options_type), intent(in) :: options
      type(searched_type), intent(in) :: searched
      type(search_journal_type), intent(inout) :: journal        !! with the multiple of the strength
      class(search_observer_type), intent(in) :: observer
      type(simulation_type), intent(out) :: settled
      type(trial_type), allocatable, intent(inout) :: known(:)   !! trials of the journal
      character(len=:), allocatable, intent(out) :: told         !! how it differs from the model as drawn; '': not
      logical, intent(out) :: interrupted
      type(error_type), allocatable, intent(out) :: error
      type(checkpoint_facts_type) :: facts
      type(error_type), allocatable :: unusable
      type(parameters_type) :: parameters
      character(len=digest_length) :: digest
      character(len=:), allocatable :: fault, first_fault, splinters
      logical :: nearly_rests
      interrupted = .false.
      told = ''
      if (journal%has_state()) then
         call load_checkpoint(checkpoint_path(journal%results()), settled, facts, digest, unusable)
         if (.not. allocated(unusable)) then
            if (facts%header%geometry == input%model_text .and. facts%header%analysis == input%analysis_text .and. &
                facts%header%config == input%config_text) then
               call journal%read(known)
               if (journal%strength > 1) told = begun_with(journal%strength)
               return
            end if
         end if
      end if
      journal%strength = 1
      do
         parameters = input%parameters
         call searched%scale(searched%value_at_rest(journal%strength), parameters)
         call settle(input%blocks, parameters, journal%strength, observer, settled, told, interrupted, fault, &
                     splinters, nearly_rests, error)
         if (interrupted .or. allocated(error)) return
         if (len(fault) == 0) exit
         if (.not. allocated(first_fault)) first_fault = fault
         if (options%kind /= search_kind%strength .or. .not. journal%strength < most_strength) then
            call refuse(options, journal%strength, fault, splinters, nearly_rests, parameters%max_open_close, error)
            return
         end if
         journal%strength = 2*journal%strength
      end do
      if (allocated(first_fault)) then
         if (len(told) > 0) told = new_line('a')//'  '//told
         told = 'the model does not stand with its strength: '//first_fault//new_line('a')//'  '// &
                begun_with(journal%strength)//told
      end if
      call begin_journal(input, settled, journal, unusable)
      journal%is_kept = .not. allocated(unusable)
      if (allocated(unusable)) call observer%warn('the search cannot be continued when it is stopped: '// &
                                                  unusable%message)
   end subroutine find_settled_state

   !> How a search begins where the model does not stand.
   pure function begun_with(strength) result(text)
      real(wp), intent(in) :: strength      !! times that of the model
      character(len=:), allocatable :: text
      text = 'the search begins from the model at rest with '//to_string(strength)// &
             ' times the strength of the joints that it reduces'
   end function begun_with

   !> The error of a model that does not stand.
   subroutine refuse(options, strength, fault, splinters, nearly_rests, rounds, error)
      type(search_options_type), intent(in) :: options
      real(wp), intent(in) :: strength
      character(len=*), intent(in) :: fault
      character(len=*), intent(in) :: splinters        !! that move alone; '': none
      logical, intent(in) :: nearly_rests              !! nothing fails, and forces are nearly in balance
      integer, intent(in) :: rounds                    !! of open and close that a step may take
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: text
      text = 'the model does not stand'
      if (nearly_rests) text = 'the model did not come to rest'
      if (strength > 1) text = text//' even with '//to_string(strength)//' times the strength of the joints searched'
      text = text//': '//fault//new_line('a')
      if (len(splinters) > 0) then
         text = text//'  what moves is no more than a splinter: '//splinters// &
                ': remove it, or merge it with a neighbour, and search again'
      else if (nearly_rests) then
         text = text//'  nothing was found to slide or fall, and the forces are nearly in balance; contacts that '// &
                'go on opening and closing keep a model so: allow more rounds of them (&time max_open_close = '// &
                to_string(2*rounds)//', now '//to_string(rounds)//"), or more steps (&stage until = 'equilibrium', "// &
                'max_steps)'
      else if (options%kind == search_kind%strength) then
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

   !> Bring a model to rest. `fault`: why it does not stand, '' when it does. Errors: those that no strength changes.
   subroutine settle(blocks, parameters, strength, observer, sim, moved, interrupted, fault, splinters, nearly_rests, &
                     error)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      real(wp), intent(in) :: strength                 !! times that of the model
      class(search_observer_type), intent(in) :: observer
      type(simulation_type), intent(inout) :: sim
      character(len=:), allocatable, intent(out) :: moved   !! a block that has moved on the way; '': none
      logical, intent(out) :: interrupted
      character(len=:), allocatable, intent(out) :: fault
      character(len=:), allocatable, intent(out) :: splinters   !! that move alone where it does not stand; '': none
      logical, intent(out) :: nearly_rests             !! nothing fails, and forces are nearly in balance
      type(error_type), allocatable, intent(out) :: error
      type(verdict_type) :: drawn, judgement
      type(progress_type) :: waiting
      integer :: stage
      logical :: stressed        ! before the first step
      logical :: may_end         ! the model has to come to rest in the stage
      fault = ''
      splinters = ''
      moved = ''
      nearly_rests = .false.
      call begin_anew(sim)
      call sim%init(blocks, parameters, error)
      if (allocated(error)) return
      call sim%set_interruption(observer)
      stressed = any(abs(sim%state%stress) > 0)
      call drawn%begin(sim, first_mark, stressed)
      stage = 0
      do while (.not. is_settled(sim))
         ! while forces grow or are released pulls stay
         if (sim%control%stage /= stage .or. sim%forces%driven) then
            stage = sim%control%stage
            call judgement%begin(sim, first_mark, stressed)
            waiting = progress_type()
         end if
         call sim%advance(error)
         if (allocated(error)) then
            if (error%code /= error_code%computation .or. error%is_fatal) return
            fault = error%message
            deallocate (error)
            if (stage == 0) return
            if (sim%control%steps >= sim%parameters%stages(stage)%max_steps) nearly_rests = is_near_rest(sim, stage)
            return
         end if
         interrupted = sim%interrupted .or. observer%is_requested()
         if (interrupted) return
         may_end = sim%control%stage == stage .and. sim%control%is_static_search(sim%parameters)
         if (may_end) may_end = .not. goes_on(sim%parameters%stages(stage))
         if (may_end) then
            if (judgement%judge(sim, sim%forces) == verdict%failing) then
               fault = slide_text(sim, judgement)
               splinters = splinter_text(sim, moved_blocks(sim, judgement))
            end if
            if (waiting%stalls(sim%record%unbalanced, sim%parameters%stages(stage)%max_steps) .and. &
                len(fault) == 0) then
               fault = restless_text(sim)
               nearly_rests = is_near_rest(sim, stage)
            end if
            if (len(fault) > 0) return
         end if
         call observer%progress('state at rest'//strength_text(strength)//', step '//to_string(sim%state%step)// &
                                ', unbalanced '//to_string(sim%record%unbalanced, 2))
      end do
      if (base_moves(sim%parameters, sim%state%time, sim%control%motion_start)) then
         call make_error(error, error_code%input, 'the base still moves where the search begins; name a stage '// &
                         'before the motion with --stage, or end the motion in a stage')
         return
      end if
      call drawn%measure(sim, sim%forces)
      fault = motion_text(sim, drawn, most_moved)
      if (len(fault) > 0) splinters = splinter_text(sim, moved_blocks(sim, drawn))
      moved = motion_text(sim, drawn, apart*usual_share)
      if (len(moved) > 0) moved = moved//': something may have failed before the search and stopped'
   end subroutine settle

   !> Do forces miss the balance by little?
   pure logical function is_near_rest(sim, stage)
      type(simulation_type), intent(in) :: sim
      integer, intent(in) :: stage
      is_near_rest = .not. sim%record%unbalanced > little*sim%parameters%stages(stage)%tolerance
   end function is_near_rest

   !> " with 4 times the strength".
   pure function strength_text(strength) result(text)
      real(wp), intent(in) :: strength
      character(len=:), allocatable :: text
      text = ''
      if (strength > 1) text = ' with '//to_string(strength)//' times the strength'
   end function strength_text

   !> A block that slides or falls for ever.
   function slide_text(sim, judgement) result(text)
      type(simulation_type), intent(in) :: sim
      type(verdict_type), intent(in) :: judgement
      character(len=:), allocatable :: text
      associate (b => judgement%first_failing)
         text = restless_text(sim)//': '//block_text(sim, b)//' has moved by '// &
                sim%parameters%shown(judgement%moved(b), 'length', 3)//', and the force that moves it does not fall'
      end associate
   end function slide_text

   !> A stage that does not come to rest.
   function restless_text(sim) result(text)
      type(simulation_type), intent(in) :: sim
      character(len=:), allocatable :: text
      text = "stage '"//stage_name(sim%parameters%stages, sim%control%stage)//"' did not come to equilibrium in "// &
             counted(sim%control%steps, 'step')//' (unbalanced '//to_string(sim%record%unbalanced, 3)// &
             ', tolerance '//to_string(sim%parameters%stages(sim%control%stage)%tolerance)//')'
   end function restless_text

   !> A model at rest that is not where it was drawn; '' when it is.
   function motion_text(sim, drawn, share) result(text)
      type(simulation_type), intent(in) :: sim
      type(verdict_type), intent(in) :: drawn
      real(wp), intent(in) :: share            !! of a block's size that it may move
      character(len=:), allocatable :: text
      real(wp) :: allowed(sim%blocks%n_blocks)
      integer :: b
      allowed = motion_that_stands(sim, drawn, share)
      b = maxloc(drawn%moved/allowed, dim=1)
      text = ''
      if (drawn%moved(b) > allowed(b)) text = 'the state at rest is not the one that was drawn: '// &
         block_text(sim, b)//' has moved by '//sim%parameters%shown(drawn%moved(b), 'length', 3)// &
         ', further than '//to_string(100*share, 1)//' % of its size and than the model deforms ('// &
         sim%parameters%shown(allowed(b), 'length', 3)//')'
   end function motion_text

   !> Blocks with their area, where they are splinters beside the others: the model without them has another answer.
   !> Else empty.
   function splinter_text(sim, blocks) result(text)
      type(simulation_type), intent(in) :: sim
      integer, intent(in) :: blocks(:)            !! that move
      character(len=:), allocatable :: text
      real(wp) :: area, typical, share
      integer :: k
      text = ''
      area = sum(sim%state%area(blocks))
      typical = typical_size(sim)
      share = area/typical**2
      if (size(blocks) == 0 .or. .not. share < splinter) return
      do k = 1, min(size(blocks), 3)
         text = text//block_text(sim, blocks(k))//', '
      end do
      if (size(blocks) > 3) text = text//'... ('//to_string(size(blocks))//' blocks), '
      text = text//sim%parameters%shown(area, 'length^2', 2)//', '//to_string(100*share, 2)// &
             ' % of the area of a typical block ('//sim%parameters%shown(typical**2, 'length^2', 2)//')'
   end function splinter_text

   !> How far each block may move while the model stands.
   function motion_that_stands(sim, drawn, share) result(allowed)
      type(simulation_type), intent(in) :: sim
      type(verdict_type), intent(in) :: drawn
      real(wp), intent(in) :: share            !! of a block's size
      real(wp) :: allowed(sim%blocks%n_blocks)
      allowed = max(share*sqrt(sim%state%area), most_deformed*drawn%deformation_by_now(sim, sim%forces))
   end function motion_that_stands

   !> The blocks that have moved further than that.
   function moved_blocks(sim, drawn) result(blocks)
      type(simulation_type), intent(in) :: sim
      type(verdict_type), intent(in) :: drawn
      integer, allocatable :: blocks(:)
      integer :: i
      blocks = pack([(i, i=1, sim%blocks%n_blocks)], drawn%moved > motion_that_stands(sim, drawn, most_moved))
   end function moved_blocks

   !> A block with its place.
   function block_text(sim, b) result(text)
      type(simulation_type), intent(in) :: sim
      integer, intent(in) :: b
      character(len=:), allocatable :: text
      text = block_name(sim%blocks, sim%parameters, b)//' at ('// &
             to_string(sim%state%centroid(1, b) + sim%state%datum(1), 5)//', '// &
             to_string(sim%state%centroid(2, b) + sim%state%datum(2), 5)//')'
   end function block_text

   !> A simulation without anything.
   subroutine begin_anew(sim)
      type(simulation_type), intent(out) :: sim
   end subroutine begin_anew

end module rockdda_run_settled_run
