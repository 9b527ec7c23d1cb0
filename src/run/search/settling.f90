! SPDX-License-Identifier: MIT
!> Bring a model to rest before a search, and find out whether it stands: it does when no block has moved but by
!> deformation.
module rockdda_run_settling
   use rockdda_base_error, only : error_type, error_code
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : counted, to_string
   use rockdda_model_block_names, only : block_name
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_stage_options, only : stage_name
   use rockdda_stepping_control, only : goes_on
   use rockdda_stepping_simulation, only : simulation_type
   use rockdda_stepping_stage_watch, only : progress_type
   use rockdda_stepping_verdict, only : verdict_type, verdict
   use rockdda_run_settled_state, only : is_settled
   use rockdda_run_trial, only : search_observer_type
   implicit none
   private
   public :: settle

   !> A model that stands moves no block further than this share of its size, or than four times what it deforms by. On
   !> the way there the pull of a block that slides is found to stay when it has moved four times as far as to the first
   !> mark.
   real(wp), parameter :: most_moved = 0.01_wp, most_deformed = 4.0_wp, first_mark = most_moved/4

contains

   !> Bring a model to rest. `fault`: why it does not stand, '' when it does. Errors: those that no strength changes.
   subroutine settle(blocks, parameters, strength, observer, sim, interrupted, fault, error)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      real(wp), intent(in) :: strength                 !! times that of the model
      class(search_observer_type), intent(in) :: observer
      type(simulation_type), intent(inout) :: sim
      logical, intent(out) :: interrupted
      character(len=:), allocatable, intent(out) :: fault
      type(error_type), allocatable, intent(out) :: error
      type(verdict_type) :: drawn, judgement
      type(progress_type) :: waiting
      integer :: stage
      logical :: stressed        ! before the first step
      logical :: may_end         ! the model has to come to rest in the stage
      fault = ''
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
            return
         end if
         interrupted = sim%interrupted .or. observer%is_requested()
         if (interrupted) return
         may_end = sim%control%stage == stage .and. sim%control%is_static_search(sim%parameters)
         if (may_end) may_end = .not. goes_on(sim%parameters%stages(stage))
         if (may_end) then
            if (judgement%judge(sim, sim%forces) == verdict%failing) fault = slide_text(sim, judgement)
            if (waiting%stalls(sim%record%unbalanced, sim%parameters%stages(stage)%max_steps) .and. len(fault) == 0) &
               fault = restless_text(sim)
            if (len(fault) > 0) return
         end if
         call observer%progress('state at rest'//strength_text(strength)//', step '//to_string(sim%state%step)// &
                                ', unbalanced '//to_string(sim%record%unbalanced, 2))
      end do
      call drawn%measure(sim, sim%forces)
      fault = motion_text(sim, drawn)
   end subroutine settle

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
             counted(sim%control%steps, 'step')//' (unbalanced '//to_string(sim%record%unbalanced, 3)//')'
   end function restless_text

   !> A model at rest that is not where it was drawn; '' when it is.
   function motion_text(sim, drawn) result(text)
      type(simulation_type), intent(in) :: sim
      type(verdict_type), intent(in) :: drawn
      character(len=:), allocatable :: text
      real(wp) :: allowed(sim%blocks%n_blocks)
      integer :: b
      allowed = max(most_moved*sqrt(sim%state%area), most_deformed*drawn%deformation_by_now(sim, sim%forces))
      b = maxloc(drawn%moved/allowed, dim=1)
      text = ''
      if (drawn%moved(b) > allowed(b)) text = 'the state at rest is not the one that was drawn: '// &
         block_text(sim, b)//' has moved by '//sim%parameters%shown(drawn%moved(b), 'length', 3)// &
         ', further than 1 % of its size and than the model deforms ('// &
         sim%parameters%shown(allowed(b), 'length', 3)//')'
   end function motion_text

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

end module rockdda_run_settling
