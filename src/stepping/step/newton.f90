! SPDX-License-Identifier: MIT
!> The open-close iteration of one attempt at a step: Newton's method for equilibrium with all laws at the step's end.
!>
!>     do round = 1, max_rounds
!>        solve_round      assemble, solve; normal forces and friction of the contacts that slide agree, states as they
!>                         are; a solve that has paused continues until the states are what the motion misses most
!>        line%search      shorten the change of the motion where the residual grows
!>        judge            arms of forces for the rotation just found (rockdda_stepping_arms), new states of all links,
!>                         and whether their forces follow their laws
!>        end_friction     if no state is new: friction and normal forces agree as an accepted step needs; judge again
!>        if (converged) exit
!>     end do
!>
!> States that are not final need no exact motion: a solve that takes many iterations pauses (an inexact Newton method,
!> Dembo, Eisenstat and Steihaug 1982). It continues while its residual is a large part of |R|, the forces that are
!> missing by the laws of all links (rockdda_stepping_line_search); what is left of |R| only other states can remove.
module rockdda_stepping_newton
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type, error_code
   use rockdda_base_phase_times, only : phase_times_type, phase
   use rockdda_interaction_attempt, only : attempt_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_equations, only : equations_type
   use rockdda_interaction_families, only : families_type
   use rockdda_interaction_open_close, only : count_unsettled, largest_normal
   use rockdda_linear_solver, only : linear_solver_type, solve_report_type, solve_effort_type
   use rockdda_stepping_arms, only : arms_type, moment
   use rockdda_stepping_failure, only : attempt_end
   use rockdda_stepping_line_search, only : line_search_type
   use rockdda_stepping_method, only : method_type
   use rockdda_stepping_motion, only : is_finite_motion
   implicit none
   private
   public :: newton_type, newton_report_type, conditions_type

   !> The parts of the equations that are new since the last solve.
   type :: change_enum
      integer :: nothing = 0    !! a solve that has paused continues
      integer :: friction = 1   !! friction forces found within the round
      integer :: loads = 2      !! only loads: K is the same
      integer :: states = 3
   end type change_enum
   type(change_enum), parameter :: change = change_enum()

   !> Conditions of an attempt.
   type :: conditions_type
      type(method_type) :: method
      real(wp) :: slack = 0              !! share by which forces may miss their laws; 0: the usual ones
      logical :: may_predict = .false.   !! x is the motion of the last step, which had the same length
      logical :: is_like_last = .false.  !! a static step of about the length of the last one, whose motion is in x
      logical :: at_floor = .false.      !! there is no smaller step to fall back to
      logical :: is_trial = .false.      !! of a search
   end type conditions_type

   !> Result of an attempt.
   type :: newton_report_type
      real(wp) :: left = 0                         !! residual with which the last solve has paused; 0: it has ended
      integer :: outcome = attempt_end%not_converged   !! or converged, no_solution, interrupted
      integer :: rounds = 0                        !! of the open-close iteration
      integer :: iterations = 0                    !! of the solver
      character(len=:), allocatable :: detail      !! why there is no solution
   end type newton_report_type

   !> What is found at the motion of a round. Before the first one all states count as new.
   type :: round_type
      integer :: n_changes = 1      !! of states
      logical :: agree = .false.    !! forces and motion agree
      real(wp) :: fraction = 1      !! of the change of the motion; less: it was shortened
      real(wp) :: missing = 0       !! of a shortened motion: |R| over that of all loads
   end type round_type

   type :: newton_type
      type(line_search_type), private :: line
      real(wp), allocatable, private :: largest(:)   !! (nb) work
   contains
      procedure :: find_equilibrium
      procedure, nopass :: solve_once
   end type newton_type

contains

   !> Find the motion x and the states of all links at the end of a step. Block terms and first trial states are set.
   subroutine find_equilibrium(self, conditions, context, attempt, families, equations, solver, times, report, error)
      class(newton_type), intent(inout) :: self
      type(conditions_type), intent(in) :: conditions
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(inout) :: attempt
      type(families_type), intent(inout) :: families
      type(equations_type), intent(inout) :: equations
      class(linear_solver_type), intent(inout) :: solver
      type(phase_times_type), intent(inout) :: times
      type(newton_report_type), intent(out) :: report
      type(error_type), allocatable, intent(out) :: error
      type(round_type) :: found
      type(arms_type) :: arms
      integer :: n_shortened    ! rounds in a row with a shortened motion
      integer :: new_parts, round
      real(wp) :: negligible    ! share of the loads below which |R| counts as zero
      logical :: windows_rules, solved
      associate (method => conditions%method)
         ! contacts in the way of DDA for Windows: without prediction, line search and paused solves
         windows_rules = families%contacts%settings%windows_rules
         report%detail = ''
         if ((conditions%may_predict .or. conditions%is_like_last) .and. .not. windows_rules) call predict_motion()
         call families%contacts%friction%forget()
         n_shortened = 0
         do round = 1, context%parameters%max_open_close
            report%rounds = round
            if (.not. windows_rules) call self%line%keep(families, equations, round)
            new_parts = merge(change%states, change%loads, found%n_changes > 0 .or. arms%turned .or. windows_rules)
            call solve_round(new_parts, merge(0.0_wp, method%coarse_solve, windows_rules))
            if (.not. solved) return
            found%fraction = 1
            negligible = merge(method%static_tolerance, method%friction_tolerance, conditions%slack > 0)
            if (is_last_resort()) negligible = method%coarse_tolerance
            if (round > 1 .and. .not. windows_rules) &
               call self%line%search(families, negligible, method, equations, found%fraction, found%missing)
            n_shortened = merge(n_shortened + 1, 0, found%fraction < 1)
            call judge(is_end=.false., again=.false.)
            if (report%left > 0 .and. is_of_solve() .and. (found%agree .or. found%n_changes == 0)) then
               ! the solve has paused, and its motion may be accepted: solve to the end
               call solve_on(0.0_wp)
               if (.not. solved) return
               call judge(is_end=.false., again=.true.)
            end if
            if (found%n_changes == 0 .and. is_of_solve() .and. .not. (found%agree .or. windows_rules)) then
               call end_friction()
               if (.not. solved) return
               call judge(is_end=.true., again=.false.)
            end if
            call times%lap(phase%judge)
            ! give up for a shorter step: the line search shortens round after round
            if (n_shortened >= max(method%least_patience, &
                                   nint(method%patience*context%parameters%max_open_close)) .and. &
                .not. (conditions%at_floor .or. conditions%slack > 0)) return
            if (is_lost()) return
            if (converged()) then
               report%outcome = attempt_end%converged
               return
            end if
            ! blocks have come to lean on each other: friction acts from here on
            if (found%agree .and. .not. found%fraction < 1) families%contacts%settings%sticks = .false.
            call arms%turn_if_off(method, context, attempt, families, equations)
         end do
      end associate

   contains

      !> Is the motion of the round the solution? All forces follow their laws at it, and contacts slide by their
      !> friction. In a trial of a search a shortened motion suffices when even the whole of its residual on one block
      !> is no larger than what a force may miss; the energies of a run would miss its work.
      pure logical function converged()
         converged = found%agree .and. .not. families%contacts%settings%sticks
         if (converged .and. found%fraction < 1) converged = conditions%is_trial .and. .not. report%left > 0 .and. &
            found%missing <= conditions%slack/sqrt(real(equations%n_rows(), wp))
      end function converged

      !> Do forces miss their laws by more than all loads together, in a trial that can fall back to a shorter step?
      !> Rounds do not find back from such a motion.
      pure logical function is_lost()
         is_lost = conditions%is_trial .and. found%missing > 1 .and. .not. conditions%at_floor
      end function is_lost

      !> Is the motion the whole one of the last solve, with the arms that it had?
      pure logical function is_of_solve()
         is_of_solve = .not. (found%fraction < 1 .or. arms%turned)
      end function is_of_solve

      !> Have many rounds not settled the states, with no smaller step to fall back to?
      pure logical function is_last_resort()
         is_last_resort = conditions%at_floor .and. round > conditions%method%fine_rounds .and. &
                          .not. (conditions%slack > 0 .or. windows_rules)
      end function is_last_resort

      !> Solve the equations of a round.
      subroutine solve_round(what_is_new, pause)
         integer, intent(in) :: what_is_new   !! one of change%...
         real(wp), intent(in) :: pause        !! share of its first residual at which a solve may pause, 0: never
         call solve(what_is_new, pause)
         if (solved) call settle_friction(.false., pause)
         if (solved) call solve_on(pause)
      end subroutine solve_round

      !> When no state is new: solve with these states to the end, and find friction forces as exactly as an accepted
      !> step needs them.
      subroutine end_friction()
         call solve(change%loads, 0.0_wp)
         if (solved) call settle_friction(.true., 0.0_wp)
      end subroutine end_friction

      !> Judge the motion of the round: turn arms that are wrong, find new states, and whether all agrees. When arms are
      !> measured is said in rockdda_stepping_arms.
      subroutine judge(is_end, again)
         logical, intent(in) :: is_end             !! after `end_friction`
         logical, intent(in) :: again              !! in place of the last judgement, which is taken back
         integer :: n_unsettled, when
         real(wp) :: last_off
         logical :: forbidden
         when = arms%moment_of(context, conditions%method, round, is_end)
         last_off = arms%off
         arms = arms_type()
         if (when == moment%before) call arms%place(.false., conditions%method, context, attempt, families, equations)
         families%contacts%trial%doubt = conditions%method%doubtful*report%left/ &
                                         sqrt(real(max(1, equations%n_rows()), wp))
         if (again) call families%contacts%take_back()
         call families%judge(found%n_changes, n_unsettled)
         found%agree = n_unsettled == 0 .and. .not. arms%turned
         if (found%agree) found%agree = forces_agree()
         if ((when == moment%after .or. (when == moment%at_rest .and. .not. is_end)) .and. found%n_changes == 0 .and. &
             .not. (found%agree .or. found%fraction < 1)) then
            ! not yet: `end_friction` and another judgement follow, which measures
            arms%off = last_off
            return
         end if
         if (when == moment%after .or. (when == moment%at_rest .and. found%n_changes == 0)) &
            call arms%place(.true., conditions%method, context, attempt, families, equations)
         found%agree = found%agree .and. .not. arms%turned
         if (arms%turned .and. when == moment%after) then
            ! states by gaps on the new arms
            call families%contacts%take_back()
            call families%judge(found%n_changes, n_unsettled)
         end if
         if (found%agree .and. context%follows_rotation() .and. round > conditions%method%fine_rounds .and. &
             .not. conditions%at_floor) then
            call arms%forbid(conditions%method, context, attempt, families, equations, forbidden)
            found%agree = .not. forbidden
         end if
      end subroutine judge

      !> After a solve that has paused: continue while its residual is a large part of |R|, or to the end if it may no
      !> longer pause.
      subroutine solve_on(pause)
         real(wp), intent(in) :: pause        !! > 0: it may pause again; 0: it may not
         real(wp) :: missing, next_pause
         solved = .true.
         next_pause = 0
         do while (report%left > 0)
            if (pause > 0) then
               call self%line%find_norm(families, equations, missing)
               if (report%left < conditions%method%small_part*missing) return
               ! what only other states can remove is sqrt(missing^2 - left^2): solve to half of a small part of it
               next_pause = max(conditions%method%coarse_solve, min(0.5_wp, 0.5_wp*conditions%method%small_part* &
                                                  sqrt(max(0.0_wp, (missing/report%left)**2 - 1))))
            end if
            call times%lap(phase%judge)
            call solve(change%nothing, next_pause)
            if (.not. solved) return
         end do
      end subroutine solve_on

      !> Share by which forces may miss their laws, given the usual one.
      pure real(wp) function accepted_miss(usual)
         real(wp), intent(in) :: usual
         accepted_miss = merge(conditions%slack, usual, conditions%slack > 0)
      end function accepted_miss

      !> Do the forces of the last solve follow the laws of the contacts at its motion?
      logical function forces_agree()
         real(wp) :: share
         integer :: i, n_unsettled
         if (.not. allocated(self%largest)) allocate (self%largest(context%blocks%n_blocks))
         share = merge(accepted_miss(conditions%method%force_tolerance), conditions%method%coarse_tolerance, &
                       round <= conditions%method%fine_rounds)
         self%largest = 0
         if (.not. windows_rules) then
            do i = 1, context%blocks%n_blocks
               self%largest(i) = norm2(families%loads%weight(1:2, i))
            end do
         end if
         if (is_last_resort()) self%largest = max(self%largest, context%state%mass*conditions%method%last_miss* &
            context%parameters%displacement_ratio*context%parameters%w0/(attempt%dt**2*share))
         associate (contacts => families%contacts)
            call count_unsettled(contacts%trial, contacts%table, share, &
                                 accepted_miss(conditions%method%friction_tolerance)* &
                                 largest_normal(contacts%trial, contacts%table%n), self%largest, n_unsettled)
         end associate
         forces_agree = n_unsettled == 0
      end function forces_agree

      !> First states, judged by a predicted motion; x is the last motion. In statics that is the prediction. In
      !> dynamics it is the motion with the acceleration of the last step, d = v dt + a dt^2/2 with a dt^2/2 = v dt -
      !> (last motion); `expect_motion` of the attempt has turned arms by its rotations. If its |R| is far below that of
      !> the last motion, the first solve starts there. Where contacts vibrate from step to step (stiff springs, long
      !> steps) it is not: the first solve starts at the last motion, no state is judged.
      subroutine predict_motion()
         logical :: is_good
         is_good = .true.
         call families%predict(equations)
         if (conditions%may_predict) then
            call self%line%keep(families, equations, 1)
            equations%x = 2*attempt%dt*context%state%velocity - equations%x
            call families%predict(equations)
            is_good = self%line%is_better(families, equations, conditions%method%good_prediction, &
                                          conditions%method%clearly_not)
         end if
         if (is_good) then
            call families%contacts%foresee()
         else
            call self%line%go_back(equations)
         end if
         call times%lap(phase%judge)
      end subroutine predict_motion

      !> Assemble and solve the equations with the present states and friction forces, or continue the last solve, and
      !> predict the motion of all links, or, with new friction forces, of the contacts that slide. Unless it is solved
      !> the report or `error` says why.
      subroutine solve(what_is_new, pause)
         integer, intent(in) :: what_is_new   !! one of change%...
         real(wp), intent(in) :: pause        !! share of its first residual at which the solve may pause, 0: never
         type(solve_report_type) :: solution
         integer :: n_assembled
         solved = .false.
         if (solver%is_interrupted()) then
            report%outcome = attempt_end%interrupted
            return
         end if
         if (what_is_new /= change%nothing) then
            if (what_is_new == change%friction) then
               call families%contacts%add_friction(equations)
               call families%liners%add_friction(equations)
            else
               call families%add_to_links(equations)
            end if
            call equations%assemble(n_assembled)
            times%rounds = times%rounds + 1
            times%contacts = times%contacts + families%contacts%table%n
            times%assembled = times%assembled + n_assembled
            call times%lap(phase%assembly)
         end if
         call solve_rows(equations, equations%f, what_is_new == change%states, &
                         solve_effort_type(pause, what_is_new == change%nothing), solver, solution, error)
         call times%lap(phase%solve)
         call check_solution(solution, equations%x, report, solved, error)
         if (.not. solved) return
         if (what_is_new == change%friction) then
            call families%contacts%predict_sliding(equations)
            call families%liners%predict_sliding(equations)
         else
            call families%predict(equations)
         end if
      end subroutine solve

      !> Find the friction forces that agree with the normal forces they cause, for the states as they are, by solves in
      !> which only loads change. Together with the last solve that is a full step of Newton's method, without an
      !> unsymmetric matrix.
      subroutine settle_friction(to_end, pause)
         logical, intent(in) :: to_end     !! as well as a step must be accepted, else as well as other states need it
         real(wp), intent(in) :: pause     !! share of its first residual at which a solve may pause, 0: never
         real(wp) :: worst, small
         integer :: k
         logical :: contacts_agree, liners_agree, may_leave
         solved = .true.
         ! a small correction may be left to the next round
         may_leave = size(equations%x, 2) > conditions%method%few_blocks
         associate (contacts => families%contacts, friction => families%contacts%friction, liners => families%liners)
            call friction%begin(contacts%table, contacts%trial)
            call liners%begin_friction()
            ! not what a step may miss: a round whose friction is off by more than |R| leads nowhere
            small = conditions%method%friction_tolerance*friction%deepest
            do k = 1, conditions%method%friction_solves
               call friction%improve(contacts%table, contacts%laws, contacts%settings, contacts%trial, worst)
               call friction%assess(worst, small, may_leave, contacts_agree)
               if (to_end) contacts_agree = worst <= 0.5_wp*small
               call liners%improve_friction(to_end, liners_agree)
               if (contacts_agree .and. liners_agree) then
                  call friction%take_used(contacts%trial)
                  exit
               end if
               call solve(change%friction, pause)
               if (.not. solved) return
            end do
         end associate
         if (k > 1) call families%predict(equations)
      end subroutine settle_friction

   end subroutine find_equilibrium

   !> Solve the assembled equations for a load, of all blocks or of those that are awake.
   subroutine solve_rows(equations, load, measures_load, effort, solver, solution, error)
      type(equations_type), intent(inout) :: equations
      real(wp), intent(in), contiguous :: load(:, :)        !! (6, nb)
      logical, intent(in) :: measures_load                  !! residuals are measured by the loads as they are now
      type(solve_effort_type), intent(in) :: effort
      class(linear_solver_type), intent(inout) :: solver
      type(solve_report_type), intent(out) :: solution
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: f(:, :), x(:, :)
      if (.not. allocated(equations%block_of)) then
         if (measures_load) solver%reference_load = equations%magnitude
         call solver%solve(equations%matrix, load, equations%x, solution, error, effort)
         return
      end if
      associate (rows => equations%block_of)
         solution%converged = .true.
         if (size(rows) == 0) return
         if (measures_load) solver%reference_load = equations%magnitude(:, rows)
         f = load(:, rows)
         x = equations%x(:, rows)
         call solver%solve(equations%matrix, f, x, solution, error, effort)
         equations%x(:, rows) = x
      end associate
   end subroutine solve_rows

   !> Solve the assembled equations for a load.
   subroutine solve_once(equations, load, solver, report, error)
      type(equations_type), intent(inout) :: equations
      real(wp), intent(in), contiguous :: load(:, :)        !! (6, nb)
      class(linear_solver_type), intent(inout) :: solver
      type(newton_report_type), intent(out) :: report
      type(error_type), allocatable, intent(out) :: error
      type(solve_report_type) :: solution
      logical :: solved
      report%detail = ''
      call solve_rows(equations, load, .true., solve_effort_type(), solver, solution, error)
      call check_solution(solution, equations%x, report, solved, error)
      if (solved) report%outcome = attempt_end%converged
   end subroutine solve_once

   !> Is a solution one to go on with? A failure that a shorter step may avoid is no error.
   subroutine check_solution(solution, x, report, solved, error)
      type(solve_report_type), intent(in) :: solution
      real(wp), intent(in), contiguous :: x(:, :)
      type(newton_report_type), intent(inout) :: report
      logical, intent(out) :: solved
      type(error_type), allocatable, intent(inout) :: error
      solved = .false.
      if (allocated(error)) then
         report%outcome = attempt_end%no_solution
         if (error%code /= error_code%computation .or. error%is_fatal) return
         report%detail = error%message
         deallocate (error)
         return
      end if
      report%iterations = report%iterations + solution%iterations
      report%left = solution%left
      if (.not. solution%converged) then
         report%outcome = merge(attempt_end%interrupted, attempt_end%no_solution, solution%interrupted)
         if (allocated(solution%detail)) report%detail = solution%detail
         return
      end if
      solved = is_finite_motion(x)
      if (solved) return
      report%outcome = attempt_end%no_solution
      report%detail = 'the solution is not finite'
   end subroutine check_solution

end module rockdda_stepping_newton
