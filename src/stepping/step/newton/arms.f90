! SPDX-License-Identifier: MIT
!> When arms and lengths of forces are measured and turned within the rounds of an attempt.
!>
!> Forces act on arms that have turned with the rotation expected of the blocks. A solve finds another rotation; what
!> the lengths are wrong by then makes a share of the forces on a block (`off`). Within the first `fine_rounds` rounds
!> arms are turned where that is too much, so that states can settle afterwards:
!>
!>     in the last measurement, or before any   states are                    arms are measured
!>     -------------------------------------    --------------------------    ---------------------------------
!>     off > coarse, or round 1                 to be found                   before, states are those on new arms
!>     fine < off <= coarse                     to be found                   after; if turned, states are found again
!>     off <= fine                              to be found                   after, if none of them has changed
!>     any                                      found at the end of friction  before, with off <= fine after
!>
!> In models of few blocks the first row holds in all rounds. After states are found without a change, and while forces
!> do not agree with them yet, measuring waits for the end of friction.
module rockdda_stepping_arms
   use rockdda_base_kinds, only : wp
   use rockdda_interaction_attempt, only : attempt_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_equations, only : equations_type
   use rockdda_interaction_families, only : families_type
   use rockdda_stepping_method, only : method_type
   implicit none
   private
   public :: arms_type, moment

   !> When arms are measured in a round.
   type :: moment_enum
      integer :: never = 0
      integer :: before = 1      !! before states are found
      integer :: after = 2       !! after them; those of turned arms are found anew
      integer :: at_rest = 3     !! after them, if none has changed
   end type moment_enum
   type(moment_enum), parameter :: moment = moment_enum()

   type :: arms_type
      real(wp) :: off = 0           !! share of force by which lengths are wrong
      logical :: turned = .false.   !! arms were turned since the last solve: another one must follow
   contains
      procedure :: moment_of
      procedure :: place
      procedure :: forbid
      procedure :: turn_if_off
   end type arms_type

contains

   !> When are arms measured in this round?
   pure integer function moment_of(self, context, method, round, is_end) result(when)
      class(arms_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(method_type), intent(in) :: method
      integer, intent(in) :: round
      logical, intent(in) :: is_end   !! friction was brought to its end: no other judgement follows in the round
      logical :: has_few
      when = moment%never
      if (.not. context%follows_rotation() .or. round > method%fine_rounds) return
      has_few = context%blocks%n_blocks <= method%few_blocks
      if (round == 1 .or. has_few .or. self%off > method%fine_arms) then
         when = merge(moment%before, moment%after, is_end .or. round == 1 .or. has_few .or. &
                      self%off > method%coarse_arms)
      else
         when = moment%at_rest
      end if
   end function moment_of

   !> Measure by how much arms are wrong; turn them if it is too much.
   subroutine place(self, was_judged, method, context, attempt, families, equations)
      class(arms_type), intent(inout) :: self
      logical, intent(in) :: was_judged   !! states were found by the motion, after the solve
      type(method_type), intent(in) :: method
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(inout) :: attempt
      type(families_type), intent(inout) :: families
      type(equations_type), intent(inout) :: equations
      call measure(was_judged, method, context, attempt, families, equations, self%off)
      self%turned = self%off > merge(method%coarse_arms, method%fine_arms, &
                                     context%blocks%n_blocks > method%few_blocks)
      if (self%turned) call turn(method, context, attempt, families, equations)
   end subroutine place

   !> After the rounds in which arms are turned: are they wrong by so much that the motion cannot be accepted?
   subroutine forbid(self, method, context, attempt, families, equations, forbidden)
      class(arms_type), intent(inout) :: self
      type(method_type), intent(in) :: method
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(inout) :: attempt
      type(families_type), intent(in) :: families
      type(equations_type), intent(inout) :: equations
      logical, intent(out) :: forbidden
      call measure(.false., method, context, attempt, families, equations, self%off)
      forbidden = self%off > method%gross_arms
   end subroutine forbid

   !> Before another round: arms that are wrong by little are made right as well.
   subroutine turn_if_off(self, method, context, attempt, families, equations)
      class(arms_type), intent(inout) :: self
      type(method_type), intent(in) :: method
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(inout) :: attempt
      type(families_type), intent(inout) :: families
      type(equations_type), intent(inout) :: equations
      if (self%turned .or. .not. self%off > method%fine_arms) return
      call turn(method, context, attempt, families, equations)
      self%turned = .true.
   end subroutine turn_if_off

   !> Find the blocks with arms and lengths that are off, and by how much at most.
   subroutine measure(was_judged, method, context, attempt, families, equations, off)
      logical, intent(in) :: was_judged
      type(method_type), intent(in) :: method
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(inout) :: attempt
      type(families_type), intent(in) :: families
      type(equations_type), intent(inout) :: equations
      real(wp), intent(out) :: off   !! share of force
      call attempt%find_moved(context, equations%x)
      call families%measure_placement(context, attempt, was_judged, .false., equations)
      off = largest_off(equations)
      if (off > method%fine_arms) call equations%misplaced_blocks(method%fine_arms, attempt%renewed)
   end subroutine measure

   !> Turn the arms of forces for the rotations of the present motion, of the blocks to be renewed. Where two blocks
   !> that turn alike are joined, and only one of them is renewed, their link is off by more than before: arms of all
   !> blocks are then turned, instead of those of one more row of neighbours in each round.
   subroutine turn(method, context, attempt, families, equations)
      type(method_type), intent(in) :: method
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(inout) :: attempt
      type(families_type), intent(inout) :: families
      type(equations_type), intent(inout) :: equations
      call attempt%expect(context, equations%x)
      call families%place(context, attempt, equations)
      call families%predict(equations)
      if (all(attempt%renewed)) return
      ! other links are right now, or are as they were
      call families%measure_placement(context, attempt, .false., .true., equations)
      if (.not. largest_off(equations) > method%coarse_arms) return
      attempt%renewed = .true.
      call attempt%expect(context, equations%x)
      call families%place(context, attempt, equations)
      call families%predict(equations)
   end subroutine turn

   !> Largest share of force by wrong lengths.
   pure real(wp) function largest_off(equations)
      type(equations_type), intent(in) :: equations
      largest_off = max(maxval(equations%block_off), maxval(equations%link_off(1:equations%n_links)))
   end function largest_off

end module rockdda_stepping_arms
