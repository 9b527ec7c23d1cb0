! SPDX-License-Identifier: MIT
!> The verdict on a trial: does the model stay, or does it fail? (docs/factor-of-safety.md, "What stable means")
!>
!> A static step ends with the inertia that its motion needs: the resultant of all other forces on a block. While joints
!> and blocks only deform, that pull falls as the block moves, because they take the load over; when it has moved as far
!> as they need, the pull is gone. A block that no deformation can hold keeps its pull however far it moves.
!>
!>     stable    unbalanced <= tolerance in two steps in a row
!>     failing   the distance that some block has moved has grown fourfold and its pull has not fallen to half, beyond
!>               `first_share` of its size
module rockdda_run_trial_verdict
   use rockdda_base_kinds, only : wp
   use rockdda_base_sorting, only : sorted_order
   use rockdda_stepping_simulation, only : simulation_type
   implicit none
   private
   public :: trial_verdict_type, verdict, typical_size

   type :: verdict_enum
      integer :: open = 0       !! neither yet
      integer :: stable = 1
      integer :: failing = 2
   end type verdict_enum
   type(verdict_enum), parameter :: verdict = verdict_enum()

   !> Distances at which pulls are compared: this share of a block's size, and its doubles. Joints and blocks of rock
   !> deform by far less (the stable trials of a dam 21 m in size move it by 3e-5 m). And it must be small: loads that stay
   !> in space, such as water below a table, change as the block moves, and with them what is judged. A sliding dam whose
   !> table falls from heel to toe has lost 5 % of its uplift after 1 % of its size; judged from there on it finds
   !> equilibrium up to a factor that is 5 % too large.
   real(wp), parameter :: first_share = 0.001_wp
   integer, parameter :: n_marks = 15, marks_between = 2
   !> A pull that falls less than by this factor while the distance grows fourfold stays.
   real(wp), parameter :: stays = 0.5_wp
   !> At least so many steps between the marks that are compared.
   integer, parameter :: steps_between = 2

   type :: trial_verdict_type
      real(wp), allocatable :: centroid(:, :)   !! (2, nb) in the settled state
      real(wp), allocatable :: rotation(:)      !! (nb)
      real(wp), allocatable :: moved(:)         !! (nb) distance from there [length]
      real(wp), allocatable :: pull(:, :)       !! (n_marks, nb) when the mark was passed [force]
      integer, allocatable :: step(:, :)        !! (n_marks, nb) of the trial, when the mark was passed
      integer, allocatable :: mark(:)           !! (nb) the last mark that was passed
      integer :: steps = 0
      integer :: first_failing = 0              !! the block by which the verdict was reached
   contains
      procedure :: begin
      procedure :: judge
   end type trial_verdict_type

contains

   !> Begin a trial in the settled state.
   subroutine begin(self, sim)
      class(trial_verdict_type), intent(out) :: self
      type(simulation_type), intent(in) :: sim
      integer :: nb
      nb = sim%blocks%n_blocks
      self%centroid = sim%state%centroid
      self%rotation = sim%state%rotation
      allocate (self%moved(nb), self%pull(n_marks, nb), source=0.0_wp)
      allocate (self%step(n_marks, nb), self%mark(nb), source=0)
   end subroutine begin

   !> The verdict after an accepted step.
   integer function judge(self, sim) result(outcome)
      class(trial_verdict_type), intent(inout) :: self
      type(simulation_type), intent(in) :: sim
      real(wp) :: pull, size_of
      integer :: i, m
      self%steps = self%steps + 1
      outcome = verdict%open
      do i = 1, size(self%moved)
         if (.not. sim%forces%counts(i, sim%state)) cycle
         associate (state => sim%state)
            self%moved(i) = norm2(state%centroid(:, i) - self%centroid(:, i)) + &
                            sqrt((state%moments(1, i) + state%moments(2, i))/state%area(i))* &
                            abs(state%rotation(i) - self%rotation(i))
            size_of = sqrt(state%area(i))
            pull = sim%forces%force_of(i, state)
         end associate
         do while (self%mark(i) < n_marks)
            m = self%mark(i) + 1
            if (self%moved(i) < first_share*2.0_wp**(m - 1)*size_of) exit
            self%mark(i) = m
            self%pull(m, i) = pull
            self%step(m, i) = self%steps
         end do
         m = self%mark(i)
         if (m <= marks_between) cycle
         if (.not. pull >= stays*self%pull(m - marks_between, i)) cycle
         if (self%steps - self%step(m - marks_between, i) < steps_between .and. self%steps - self%step(1, i) < &
             2*steps_between) cycle
         outcome = verdict%failing
         if (self%first_failing == 0) self%first_failing = i
      end do
      if (outcome == verdict%failing) return
      if (sim%control%balanced >= 2) outcome = verdict%stable
   end function judge

   !> Median of the sizes of the blocks that can move.
   function typical_size(sim) result(median)
      type(simulation_type), intent(in) :: sim
      real(wp) :: median
      real(wp), allocatable :: sizes(:)
      integer, allocatable :: order(:)
      integer :: i, n
      allocate (sizes(0))
      do i = 1, sim%blocks%n_blocks
         if (.not. sim%state%active(i)) cycle
         if (allocated(sim%forces%held)) then
            if (.not. sim%forces%counts(i, sim%state)) cycle
         end if
         sizes = [sizes, sqrt(sim%state%area(i))]
      end do
      n = size(sizes)
      median = 0
      if (n == 0) return
      order = sorted_order(sizes)
      median = sizes(order((n + 1)/2))
   end function typical_size

end module rockdda_run_trial_verdict
