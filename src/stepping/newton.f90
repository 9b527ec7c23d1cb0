! SPDX-License-Identifier: MIT
!> The open-close iteration of one attempt at a step: Newton's method for equilibrium with all laws at the step's end.
!>
!>     repeat
!>        assemble, solve         with the trial states of the links
!>        settle friction         normal forces and friction of the contacts that slide agree, states as they are
!>        go on                   a solve that has paused, until the states are what the motion misses most
!>        line search             shorten the change of the motion where the residual grows
!>        follow the rotation     arms of forces for the rotation just found, if it differs from the one expected
!>        judge                   new trial states
!>        end friction            if no state is new: until friction and normal forces agree as they must in the end
!>     until the forces of all links follow their laws, at a motion solved for to the end
!>
!> States that are not final need no exact motion: a solve that takes many iterations pauses (an inexact Newton method,
!> Dembo, Eisenstat and Steihaug 1982). It goes on while its residual is a large part of |R|, the forces that are
!> missing by the laws of all links (rockdda_stepping_line_search); what is left of |R| only other states can remove.
module rockdda_stepping_newton
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type, error_code
   use rockdda_base_phase_times, only : phase_times_type, phase
   use rockdda_interaction_contacts, only : contacts_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_equations, only : equations_type
   use rockdda_interaction_families, only : families_type
   use rockdda_interaction_unsettled, only : count_unsettled, largest_normal
   use rockdda_linear_solver, only : linear_solver_type, solve_report_type
   use rockdda_stepping_failure, only : attempt
   use rockdda_stepping_line_search, only : line_search_type
   use rockdda_stepping_motion, only : is_finite_motion
   implicit none
   private
   public :: newton_type, newton_report_type

   !> Friction forces must agree with the normal forces they come from to this share of the largest normal force.
   real(wp), parameter :: friction_tolerance = 1.0e-5_wp
   !> |R| counts as zero below this share of the loads in static steps that search equilibrium, elsewhere below that of
   !> friction. It is over all blocks: contacts that change their states in circles on a few of them are less of it.
   real(wp), parameter :: static_tolerance = 1.0e-8_wp
   !> Contact forces may miss their laws by this share of the largest normal force, or the weight, of the less loaded of
   !> the two blocks; by the second one when the rounds given have not done better.
   real(wp), parameter :: force_tolerance = 1.0e-5_wp, coarse_tolerance = 1.0e-3_wp
   integer, parameter :: fine_rounds = 10
   !> Lengths at the end of the step may be wrong, for a rotation other than the expected one, by what makes this share
   !> of the forces on a block; by the second one in models of so few blocks that another round costs nothing. Where a
   !> round follows anyway they are made right beyond that. It is done in the first `fine_rounds` rounds: states shall
   !> settle. Rounds after these must not end with lengths that are wrong by more than the third one, unless no smaller
   !> step is left: stiff ties of small cells miss the others by rounding, a block that spins into another by thousands.
   real(wp), parameter :: placement_tolerance = 1.0e-4_wp, fine_placement = 1.0e-6_wp, gross_placement = 10.0_wp
   !> The misfit of friction and normal forces is brought down in at most so many solves a round.
   integer, parameter :: friction_solves = 12
   !> Models of so few blocks, for which a solve costs nothing, leave no correction of friction to the next round.
   integer, parameter :: few_blocks = 30
   !> A predicted motion is taken when its residual is below this share of that of the last motion.
   real(wp), parameter :: good_prediction = 0.1_wp
   !> An attempt is given up when so large a share of the rounds allowed, and so many, were shortened in a row. Not in
   !> static steps whose forces may miss their laws: they search equilibrium, to which shorter steps come no nearer.
   real(wp), parameter :: patience = 0.4_wp
   integer, parameter :: least_patience = 6

   !> A solve may pause when its residual is this share of its first one; it goes on while the residual is more than
   !> `small_part` of |R|.
   real(wp), parameter :: coarse_solve = 0.01_wp, small_part = 0.1_wp
   !> After a solve that has paused, a state changes only by a missing force whose energy in the contact's spring is
   !> more than this (squared) of what the mean residual of a block has: smaller ones are of the solver.
   real(wp), parameter :: doubtful = 3.0_wp

   !> What of the equations is new since the last solve.
   type :: change_enum
      integer :: nothing = 0    !! a solve that has paused goes on
      integer :: friction = 1   !! friction forces found within the round
      integer :: loads = 2      !! only loads: K is the same
      integer :: states = 3
   end type change_enum
   type(change_enum), parameter :: change = change_enum()

   !> Result of an attempt.
   type :: newton_report_type
      real(wp) :: left = 0                         !! residual of the last solve if it has paused, else 0
      integer :: outcome = attempt%not_converged   !! attempt%converged, not_converged, no_solution or interrupted
      integer :: rounds = 0                        !! of the open-close iteration
      integer :: iterations = 0                    !! of the solver
      character(len=:), allocatable :: detail      !! why there is no solution
   end type newton_report_type

   !> What is found at the motion of a round.
   type :: judgement_type
      integer :: n_changes = 1      !! of states
      real(wp) :: off = 0           !! share of force by which lengths are wrong
      logical :: turned = .false.   !! arms were turned: another solve must follow
      logical :: agree = .false.    !! forces and motion agree
   end type judgement_type

   type :: newton_type
      real(wp) :: slack = 0              !! share by which forces may miss their laws; 0: the usual ones
      logical :: may_predict = .false.   !! x is the motion of the last step, which had the same length
      logical :: is_like_last = .false.  !! a static step of about the length of the last one, whose motion is in x
      logical :: at_floor = .false.      !! there is no smaller step to fall back to
      type(line_search_type), private :: line
      real(wp), allocatable, private :: largest(:)   !! (nb) work
   contains
      procedure :: find_equilibrium
      procedure, nopass :: solve_once
      procedure :: swap_room
      procedure, private :: predict_motion
      procedure, private :: settle_friction
      procedure, private :: solve_on
   end type newton_type

contains

   !> Exchange scratch of two numbers for each link, of which nothing is kept from one attempt to the next.
   pure subroutine swap_room(self, room)
      class(newton_type), intent(inout) :: self
      real(wp), allocatable, intent(inout) :: room(:, :)
      call self%line%swap_room(room)
   end subroutine swap_room

   !> Find the motion x and the states of all links at the end of a step. Block terms and first trial states are set.
   subroutine find_equilibrium(self, context, families, equations, solver, times, report, error)
      class(newton_type), intent(inout) :: self
      type(step_context_type), intent(inout) :: context
      type(families_type), intent(inout) :: families
      type(equations_type), intent(inout) :: equations
      class(linear_solver_type), intent(inout) :: solver
      type(phase_times_type), intent(inout) :: times
      type(newton_report_type), intent(out) :: report
      type(error_type), allocatable, intent(out) :: error
      type(judgement_type) :: found
      integer :: n_shortened, round
      real(wp) :: fraction
      logical :: peer, solved, later   ! later: arms are measured after states are judged
      peer = families%contacts%settings%peer
      report%detail = ''
      if ((self%may_predict .or. self%is_like_last) .and. .not. peer) &
         call self%predict_motion(context, families, equations, times)
      call families%contacts%friction%forget()
      n_shortened = 0
      do round = 1, context%parameters%max_open_close
         report%rounds = round
         solver%pause = merge(0.0_wp, coarse_solve, peer)
         if (.not. peer) call self%line%keep(families, equations, round)
         call solve(merge(change%states, change%loads, found%n_changes > 0 .or. found%turned .or. peer), families, &
                    equations, solver, times, report, solved, error)
         if (solved) call self%settle_friction(.false., families, equations, solver, times, report, solved, error)
         if (solved) call self%solve_on(families, equations, solver, times, report, solved, error)
         if (.not. solved) return
         fraction = 1
         if (round > 1 .and. .not. peer) call self%line%search(families, merge(static_tolerance, &
                                                               friction_tolerance, self%slack > 0), equations, fraction)
         n_shortened = merge(n_shortened + 1, 0, fraction < 1)
         call judge_round(.true.)
         if (report%left > 0 .and. .not. (fraction < 1 .or. found%turned) .and. &
             (found%agree .or. found%n_changes == 0)) then
            ! what may be accepted is solved for to the end
            solver%pause = 0
            call self%solve_on(families, equations, solver, times, report, solved, error)
            if (.not. solved) return
            families%contacts%judges_again = .true.
            call judge_round(.true.)
         end if
         if (.not. (found%agree .or. found%turned .or. fraction < 1 .or. peer) .and. found%n_changes == 0) then
            ! friction, with the states and the matrix that it has in the end
            solver%pause = 0
            call solve(change%loads, families, equations, solver, times, report, solved, error)
            if (solved) call self%settle_friction(.true., families, equations, solver, times, report, solved, error)
            if (.not. solved) return
            call judge_round(.false.)
         end if
         call times%lap(phase%judge)
         if (n_shortened >= max(least_patience, nint(patience*context%parameters%max_open_close)) .and. &
             .not. (self%at_floor .or. self%slack > 0)) return
         if (found%agree .and. .not. fraction < 1) then
            if (.not. families%contacts%settings%sticks) then
               report%outcome = attempt%converged
               return
            end if
            families%contacts%settings%sticks = .false.
         end if
         if (found%turned .or. .not. found%off > fine_placement) cycle
         call turn_arms(context, families, equations)
         found%turned = .true.
      end do

   contains

      !> Judge the motion of the round: turn arms that are wrong, find new states, and whether all agrees. Arms hardly
      !> wrong in the last round may wait for the end of friction, where no state changes.
      subroutine judge_round(may_wait)
         logical, intent(in) :: may_wait
         integer :: n_unsettled
         real(wp) :: last_off
         logical :: may_turn, is_measured
         may_turn = context%follows_rotation() .and. round <= fine_rounds
         ! where arms were right in the last round they wait until no state changes
         last_off = found%off
         is_measured = may_turn .and. (round == 1 .or. last_off > fine_placement .or. &
                                       context%blocks%n_blocks <= few_blocks)
         found = judgement_type()
         later = may_wait .and. round > 1 .and. last_off <= placement_tolerance .and. &
                 context%blocks%n_blocks > few_blocks
         if (is_measured .and. .not. later) call place_arms()
         families%contacts%trial%doubt = doubtful*report%left/sqrt(real(max(1, equations%n_rows()), wp))
         call families%judge(found%n_changes, n_unsettled)
         found%agree = n_unsettled == 0 .and. .not. found%turned
         if (found%agree) found%agree = forces_agree(self, families, context%blocks%n_blocks, round)
         if (later .and. found%n_changes == 0 .and. .not. (found%agree .or. fraction < 1)) then
            found%off = last_off
            return
         end if
         if (may_turn .and. merge(later, found%n_changes == 0, is_measured)) call place_arms()
         found%agree = found%agree .and. .not. found%turned
         if (found%turned .and. is_measured .and. later) then
            ! states by gaps on the new arms
            families%contacts%judges_again = .true.
            call families%judge(found%n_changes, n_unsettled)
         end if
         if (.not. (found%agree .and. context%follows_rotation() .and. round > fine_rounds) .or. self%at_floor) return
         call measure_placement(context, families, equations, found%off)
         found%agree = .not. found%off > gross_placement
      end subroutine judge_round

      !> Measure by how much arms are wrong; turn them if it is too much.
      subroutine place_arms()
         context%has_judged = later
         call measure_placement(context, families, equations, found%off)
         context%has_judged = .false.
         found%turned = found%off > merge(placement_tolerance, fine_placement, context%blocks%n_blocks > few_blocks)
         if (found%turned) call turn_arms(context, families, equations)
      end subroutine place_arms

   end subroutine find_equilibrium

   !> After a solve that has paused: go on while its residual is a large part of |R|, or to the end if it may not pause
   !> any more.
   subroutine solve_on(self, families, equations, solver, times, report, solved, error)
      class(newton_type), intent(inout) :: self
      type(families_type), intent(inout) :: families
      type(equations_type), intent(inout) :: equations
      class(linear_solver_type), intent(inout) :: solver
      type(phase_times_type), intent(inout) :: times
      type(newton_report_type), intent(inout) :: report
      logical, intent(out) :: solved
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: missing
      solved = .true.
      do while (report%left > 0)
         if (solver%pause > 0) then
            call self%line%find_norm(families, equations, missing)
            if (report%left < small_part*missing) return
            solver%pause = max(coarse_solve, min(0.5_wp, 0.5_wp*small_part* &
                                                 sqrt(max(0.0_wp, (missing/report%left)**2 - 1))))
         end if
         call times%lap(phase%judge)
         call solve(change%nothing, families, equations, solver, times, report, solved, error)
         if (.not. solved) return
      end do
   end subroutine solve_on

   !> Find the blocks with arms and lengths that are off, and by how much at most.
   subroutine measure_placement(context, families, equations, off)
      type(step_context_type), intent(inout) :: context
      type(families_type), intent(in) :: families
      type(equations_type), intent(inout) :: equations
      real(wp), intent(out) :: off   !! share of force
      call context%find_moved(equations%x)
      call families%measure_placement(context, equations)
      off = max(maxval(equations%block_off), maxval(equations%link_off(1:equations%n_links)))
      if (off > fine_placement) call equations%misplaced_blocks(fine_placement, context%renewed)
   end subroutine measure_placement

   !> The arms of forces for the rotations of the present motion, of the blocks to be renewed. Where two blocks that
   !> turn alike are joined, and only one of them is renewed, their link is off by more than before: arms of all blocks
   !> are then turned, instead of those of one more row of neighbours in each round.
   subroutine turn_arms(context, families, equations)
      type(step_context_type), intent(inout) :: context
      type(families_type), intent(inout) :: families
      type(equations_type), intent(inout) :: equations
      real(wp) :: off
      call context%expect(equations%x)
      call families%place(context, equations)
      call families%predict(equations)
      if (all(context%renewed)) return
      ! other links are right now, or are as they were
      context%measures_mixed = .true.
      call families%measure_placement(context, equations)
      context%measures_mixed = .false.
      off = max(maxval(equations%block_off), maxval(equations%link_off(1:equations%n_links)))
      if (.not. off > placement_tolerance) return
      context%renewed = .true.
      call context%expect(equations%x)
      call families%place(context, equations)
      call families%predict(equations)
   end subroutine turn_arms

   !> Share by which forces may miss their laws, given the usual one.
   pure real(wp) function accepted_miss(self, usual)
      class(newton_type), intent(in) :: self
      real(wp), intent(in) :: usual
      accepted_miss = merge(self%slack, usual, self%slack > 0)
   end function accepted_miss

   !> Do the forces of the last solve follow the laws of the contacts at its motion?
   logical function forces_agree(self, families, n_blocks, round)
      type(newton_type), intent(inout) :: self
      type(families_type), intent(in) :: families
      integer, intent(in) :: n_blocks, round
      real(wp) :: share
      integer :: i, n_unsettled
      if (.not. allocated(self%largest)) allocate (self%largest(n_blocks))
      share = merge(accepted_miss(self, force_tolerance), coarse_tolerance, round <= fine_rounds)
      self%largest = 0
      if (.not. families%contacts%settings%peer) then
         do i = 1, n_blocks
            self%largest(i) = norm2(families%loads%weight(1:2, i))
         end do
      end if
      associate (contacts => families%contacts)
         call count_unsettled(contacts%trial, contacts%table, share, accepted_miss(self, friction_tolerance)* &
                              largest_normal(contacts%trial, contacts%table%n), self%largest, n_unsettled)
      end associate
      forces_agree = n_unsettled == 0
   end function forces_agree

   !> In dynamics: the motion of the step if accelerations stayed what they were in the last one, d = v dt + a dt^2/2
   !> with a dt^2/2 = v dt - (last motion), by whose rotations arms have been turned. If it comes much closer to
   !> equilibrium than the last motion, it is where the first solve starts, and the first states are judged by it; else
   !> arms are turned by the velocity at the start of the step. Where contacts vibrate from step to step
   !> (stiff springs, long steps) it does not. In statics the first states are judged by the last motion.
   subroutine predict_motion(self, context, families, equations, times)
      class(newton_type), intent(inout) :: self
      type(step_context_type), intent(inout) :: context
      type(families_type), intent(inout) :: families
      type(equations_type), intent(inout) :: equations
      type(phase_times_type), intent(inout) :: times
      logical :: is_good
      is_good = .true.
      call families%predict(equations)
      if (self%may_predict) then
         call self%line%keep(families, equations, 1)
         equations%x = 2*context%dt*context%state%velocity - equations%x
         call families%predict(equations)
         is_good = self%line%is_better(families, equations, good_prediction)
      end if
      if (is_good) then
         call families%contacts%foresee()
      else
         call self%line%go_back(equations)
      end if
      call times%lap(phase%judge)
   end subroutine predict_motion

   !> Assemble and solve the equations with the present states and friction forces, or go on with the last solve, and
   !> predict the motion of all links, or, with new friction forces, of the contacts that slide.
   subroutine solve(what_is_new, families, equations, solver, times, report, solved, error)
      integer, intent(in) :: what_is_new   !! one of change%...
      type(families_type), intent(inout) :: families
      type(equations_type), intent(inout) :: equations
      class(linear_solver_type), intent(inout) :: solver
      type(phase_times_type), intent(inout) :: times
      type(newton_report_type), intent(inout) :: report
      logical, intent(out) :: solved       !! else the report or `error` says why
      type(error_type), allocatable, intent(out) :: error
      type(solve_report_type) :: solution
      integer :: n_assembled
      solved = .false.
      if (solver%is_interrupted()) then
         report%outcome = attempt%interrupted
         return
      end if
      if (what_is_new /= change%nothing) then
         if (what_is_new == change%friction) then
            call families%contacts%add_friction(equations)
         else
            call families%add_to_links(equations)
         end if
         call equations%assemble(n_assembled)
         times%rounds = times%rounds + 1
         times%contacts = times%contacts + families%contacts%table%n
         times%assembled = times%assembled + n_assembled
         call times%lap(phase%assembly)
      end if
      solver%goes_on = what_is_new == change%nothing
      call solve_rows(equations, equations%f, what_is_new == change%states, solver, solution, error)
      call times%lap(phase%solve)
      call check_solution(solution, equations%x, report, solved, error)
      if (.not. solved) return
      if (what_is_new == change%friction) then
         call families%contacts%predict_sliding(equations)
      else
         call families%predict(equations)
      end if
   end subroutine solve

   !> Solve the assembled equations for a load, of all blocks or of those that are awake.
   subroutine solve_rows(equations, load, measures_load, solver, solution, error)
      type(equations_type), intent(inout) :: equations
      real(wp), intent(in), contiguous :: load(:, :)        !! (6, nb)
      logical, intent(in) :: measures_load                  !! residuals are measured by the loads as they are now
      class(linear_solver_type), intent(inout) :: solver
      type(solve_report_type), intent(out) :: solution
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: f(:, :), x(:, :)
      if (.not. allocated(equations%block_of)) then
         if (measures_load) solver%reference_load = equations%magnitude
         call solver%solve(equations%matrix, load, equations%x, solution, error)
         return
      end if
      associate (rows => equations%block_of)
         solution%converged = .true.
         if (size(rows) == 0) return
         if (measures_load) solver%reference_load = equations%magnitude(:, rows)
         f = load(:, rows)
         x = equations%x(:, rows)
         call solver%solve(equations%matrix, f, x, solution, error)
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
      solver%pause = 0
      solver%goes_on = .false.
      call solve_rows(equations, load, .true., solver, solution, error)
      call check_solution(solution, equations%x, report, solved, error)
      if (solved) report%outcome = attempt%converged
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
         report%outcome = attempt%no_solution
         if (error%code /= error_code%computation .or. error%is_fatal) return
         report%detail = error%message
         deallocate (error)
         return
      end if
      report%iterations = report%iterations + solution%iterations
      report%left = solution%left
      if (.not. solution%converged) then
         report%outcome = merge(attempt%interrupted, attempt%no_solution, solution%interrupted)
         if (allocated(solution%detail)) report%detail = solution%detail
         return
      end if
      solved = is_finite_motion(x)
      if (solved) return
      report%outcome = attempt%no_solution
      report%detail = 'the solution is not finite'
   end subroutine check_solution

   !> Find the friction forces that agree with the normal forces they cause, for the states as they are: with the
   !> last solve that makes a full step of Newton's method, without an unsymmetric matrix. Only loads change.
   subroutine settle_friction(self, to_end, families, equations, solver, times, report, solved, error)
      class(newton_type), intent(in) :: self
      logical, intent(in) :: to_end     !! as well as a step must be accepted, else as well as other states need it
      type(families_type), intent(inout) :: families
      type(equations_type), intent(inout) :: equations
      class(linear_solver_type), intent(inout) :: solver
      type(phase_times_type), intent(inout) :: times
      type(newton_report_type), intent(inout) :: report
      logical, intent(out) :: solved
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: worst, small
      integer :: k
      logical :: is_enough, may_leave
      solved = .true.
      ! a small correction may be left to the next round
      may_leave = size(equations%x, 2) > few_blocks
      associate (contacts => families%contacts, friction => families%contacts%friction)
         call friction%begin(contacts%table, contacts%trial)
         small = accepted_miss(self, friction_tolerance)*friction%deepest
         do k = 1, friction_solves
            call friction%improve(contacts%table, contacts%laws, contacts%settings, contacts%trial, worst)
            call friction%assess(worst, small, may_leave, is_enough)
            if (to_end) is_enough = worst <= 0.5_wp*small
            if (is_enough) then
               call friction%take_used(contacts%trial)
               exit
            end if
            call solve(change%friction, families, equations, solver, times, report, solved, error)
            if (.not. solved) return
         end do
      end associate
      if (k > 1) call families%predict(equations)
   end subroutine settle_friction

end module rockdda_stepping_newton
