! SPDX-License-Identifier: MIT
!> The constants of the method: when states, forces and arms agree, how far solves and searches go, and how static steps
!> grow. None is an option: `scripts/constants` shows what becomes of small models when each is doubled and halved
!> (docs/theory.md, "Constants of the method").
module rockdda_stepping_method
   use rockdda_base_kinds, only : wp
   implicit none
   private
   public :: method_type, constant_names, scale_constant

   type :: method_type
      ! agreement of forces and motion (rockdda_stepping_newton)
      !> Friction forces must agree with the normal forces they come from to this share of the largest normal force.
      real(wp) :: friction_tolerance = 1.0e-5_wp
      !> |R| counts as zero below this share of the loads in static steps that search equilibrium, elsewhere below that
      !> of friction. It is over all blocks: contacts that change states in circles on a few of them are less of it.
      real(wp) :: static_tolerance = 1.0e-8_wp
      !> Contact forces may miss their laws by this share of the largest normal force, or the weight, of the less loaded
      !> of the two blocks; by the second one when `fine_rounds` rounds have not done better.
      real(wp) :: force_tolerance = 1.0e-5_wp, coarse_tolerance = 1.0e-3_wp
      !> With no smaller step left, and states not settled in `fine_rounds` rounds, a contact force may miss its law by
      !> what moves the lighter of the two blocks by this share of g2 w0, and |R| counts as zero below
      !> `coarse_tolerance` of the loads: a splinter whose states change in circles does not end the run.
      real(wp) :: last_miss = 1.0e-6_wp
      !> The misfit of friction and normal forces is brought down in at most this number of solves a round.
      integer :: friction_solves = 60
      !> A predicted motion is taken when its residual is below this share of that of the last motion; that of some
      !> blocks suffices to reject it when it is this multiple of the share.
      real(wp) :: good_prediction = 0.1_wp, clearly_not = 5.0_wp
      !> An attempt is given up when this share and this number of the rounds allowed were shortened in a row. Not
      !> in static steps whose forces may miss their laws: they search equilibrium, to which shorter steps come no
      !> nearer.
      real(wp) :: patience = 0.4_wp
      integer :: least_patience = 6
      !> A solve may pause when its residual is this share of its first one; it continues while the residual is more
      !> than `small_part` of |R| (an inexact Newton method: Dembo, Eisenstat and Steihaug 1982).
      real(wp) :: coarse_solve = 0.01_wp, small_part = 0.1_wp
      !> After a solve that has paused, a state changes only by a missing force whose energy in the contact's spring is
      !> more than this (squared) of what the mean residual of a block has: smaller ones are of the solver.
      real(wp) :: doubtful = 3.0_wp
      ! arms of forces (rockdda_stepping_arms)
      !> Lengths at the end of the step may be wrong, for a rotation other than the expected one, by what makes this
      !> share of the forces on a block; by the second one in models of so few blocks that another round costs nothing.
      !> Where a round follows anyway they are made right beyond that. It is done in the first `fine_rounds` rounds:
      !> states shall settle. Rounds after these must not end with lengths that are wrong by more than the third one,
      !> unless no smaller step is left: stiff ties of small cells miss the others by rounding, a block that spins into
      !> another by thousands.
      real(wp) :: coarse_arms = 1.0e-4_wp, fine_arms = 1.0e-6_wp, gross_arms = 10.0_wp
      integer :: fine_rounds = 10
      !> Models of so few blocks, for which a solve costs nothing, leave no correction to the next round.
      integer :: few_blocks = 30
      ! the line search (rockdda_stepping_line_search)
      !> A full step is taken when it brings |R| below this share of what it was.
      real(wp) :: enough = 0.5_wp
      !> |R| where the last search has ended is that at the motion kept, but for arms that were turned since and
      !> weights by the new matrix. Where this share of it would be enough, it is not measured again.
      real(wp) :: by_far = 0.5_wp
      !> Each shorter step is this fraction of the last one, at most this number.
      real(wp) :: shorter = 0.6_wp
      integer :: most_trials = 12
      ! length of steps (rockdda_stepping_control)
      !> Largest factor by which the step grows after an accepted step.
      real(wp) :: growth = 1.5_wp
      !> The same in a static stage until equilibrium, where the step took at most `few_rounds` rounds.
      real(wp) :: fast_growth = 4.0_wp
      integer :: few_rounds = 6
      !> Where it took more than this share of the rounds allowed the next step is shorter by `slow_down`.
      real(wp) :: many_rounds = 0.5_wp, slow_down = 0.5_wp
      !> Where blocks come to rest after slip depends on the way there. While friction has a share in the work of the
      !> contacts, steps grow slowly to `held_length` times dt_max and keep this length until the unbalanced force is
      !> below `nearly`, for at most `most_held` steps; where the share is large they then grow slowly.
      real(wp) :: no_slip = 0.005_wp, much_slip = 0.1_wp, nearly = 0.009_wp, very_nearly = 0.001_wp
      real(wp) :: slow_growth = 1.1_wp, held_length = 1.5_wp
      integer :: most_held = 100
      !> A static step counts as like the last one when it is longer by less than this factor.
      real(wp) :: much_longer = 1.14_wp
      !> In a static stage that searches equilibrium the forces of contacts may miss their laws by this share of the
      !> unbalanced force, between both limits. What they miss is made good in the next step; a miss of the size of the
      !> stage's tolerance would stay as it is in steps that move nothing any more.
      real(wp) :: small_miss = 0.1_wp, least_miss = 1.0e-6_wp, largest_miss = 3.0e-3_wp
      !> A stage that releases forces begins with a step this many times as long as dt_max, so that inertia does not
      !> delay its first shares.
      real(wp) :: first_release = 30.0_wp
      !> Residual of the solver over the unbalanced force that is allowed.
      real(wp) :: small_residual = 0.1_wp
   end type method_type

   integer, parameter :: n_constants = 40
   !> Names of all constants.
   character(len=*), parameter :: constant_names(n_constants) = [character(len=18) :: &
      'friction_tolerance', 'static_tolerance', 'force_tolerance', 'coarse_tolerance', 'last_miss', &
      'friction_solves', 'good_prediction', 'clearly_not', 'patience', 'least_patience', 'coarse_solve', 'small_part', &
      'doubtful', 'coarse_arms', 'fine_arms', 'gross_arms', 'fine_rounds', 'few_blocks', 'enough', 'by_far', &
      'shorter', 'most_trials', 'growth', 'fast_growth', 'few_rounds', 'many_rounds', 'slow_down', 'no_slip', &
      'much_slip', 'nearly', 'very_nearly', 'slow_growth', 'held_length', 'most_held', 'much_longer', &
      'small_miss', 'least_miss', 'largest_miss', 'first_release', 'small_residual']

contains

   !> Multiply one constant; ratios of one step to the next are raised to the power: doubled, they act as if twice.
   subroutine scale_constant(name, factor, method, value, known)
      character(len=*), intent(in) :: name           !! one of `constant_names`
      real(wp), intent(in) :: factor
      type(method_type), intent(inout) :: method
      real(wp), intent(out) :: value                 !! of the constant afterwards
      logical, intent(out) :: known
      known = any(constant_names == name)
      value = 0
      select case (name)
      case ('friction_tolerance'); call scale_real(method%friction_tolerance)
      case ('static_tolerance'); call scale_real(method%static_tolerance)
      case ('force_tolerance'); call scale_real(method%force_tolerance)
      case ('coarse_tolerance'); call scale_real(method%coarse_tolerance)
      case ('last_miss'); call scale_real(method%last_miss)
      case ('friction_solves'); call scale_count(method%friction_solves)
      case ('good_prediction'); call scale_real(method%good_prediction)
      case ('clearly_not'); call scale_real(method%clearly_not)
      case ('patience'); call scale_real(method%patience)
      case ('least_patience'); call scale_count(method%least_patience)
      case ('coarse_solve'); call scale_real(method%coarse_solve)
      case ('small_part'); call scale_real(method%small_part)
      case ('doubtful'); call scale_real(method%doubtful)
      case ('coarse_arms'); call scale_real(method%coarse_arms)
      case ('fine_arms'); call scale_real(method%fine_arms)
      case ('gross_arms'); call scale_real(method%gross_arms)
      case ('fine_rounds'); call scale_count(method%fine_rounds)
      case ('few_blocks'); call scale_count(method%few_blocks)
      case ('enough'); call scale_real(method%enough)
      case ('by_far'); call scale_real(method%by_far)
      case ('shorter'); call scale_ratio(method%shorter)
      case ('most_trials'); call scale_count(method%most_trials)
      case ('growth'); call scale_ratio(method%growth)
      case ('fast_growth'); call scale_ratio(method%fast_growth)
      case ('few_rounds'); call scale_count(method%few_rounds)
      case ('many_rounds'); call scale_real(method%many_rounds)
      case ('slow_down'); call scale_ratio(method%slow_down)
      case ('no_slip'); call scale_real(method%no_slip)
      case ('much_slip'); call scale_real(method%much_slip)
      case ('nearly'); call scale_real(method%nearly)
      case ('very_nearly'); call scale_real(method%very_nearly)
      case ('slow_growth'); call scale_ratio(method%slow_growth)
      case ('held_length'); call scale_ratio(method%held_length)
      case ('most_held'); call scale_count(method%most_held)
      case ('much_longer'); call scale_ratio(method%much_longer)
      case ('small_miss'); call scale_real(method%small_miss)
      case ('least_miss'); call scale_real(method%least_miss)
      case ('largest_miss'); call scale_real(method%largest_miss)
      case ('first_release'); call scale_real(method%first_release)
      case ('small_residual'); call scale_real(method%small_residual)
      end select

   contains

      subroutine scale_real(constant)
         real(wp), intent(inout) :: constant
         constant = factor*constant
         value = constant
      end subroutine scale_real

      subroutine scale_ratio(constant)
         real(wp), intent(inout) :: constant
         constant = constant**factor
         value = constant
      end subroutine scale_ratio

      subroutine scale_count(constant)
         integer, intent(inout) :: constant
         constant = nint(factor*constant)
         value = constant
      end subroutine scale_count

   end subroutine scale_constant

end module rockdda_stepping_method
