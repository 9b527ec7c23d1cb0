! SPDX-License-Identifier: MIT
!> Wall-clock time of a run by phases of a step, and counts of steps, rounds and searches.
!>
!>     call times%start()
!>     ... search ...
!>     call times%lap(phase%search)      adds the time since start or the last lap to the search
!>
!> Read by the caller of the time loop; nothing in a run depends on it. One lap costs one reading of the system clock
!> (about 50 ns), and there are about ten in a step.
module rockdda_base_phase_times
   use rockdda_base_kinds, only : wp, i8
   implicit none
   private
   public :: phase_times_type, phase, n_phases, phase_names

   type :: phase_enum
      integer :: search = 1      !! contacts: broad and narrow phase, history
      integer :: links = 2       !! vectors of contacts and bolts, once a step
      integer :: graph = 3       !! pattern of the matrix and the links of each block
      integer :: block_terms = 4 !! inertia, elasticity, loads, fixed points, once an attempt
      integer :: assembly = 5    !! contact terms and sums, once a round
      integer :: solve = 6
      integer :: judge = 7       !! predicted motion and new states, once a round
      integer :: update = 8      !! energy ledger, motion of the blocks, record
      integer :: other = 9       !! the rest of the time loop
   end type phase_enum
   type(phase_enum), parameter :: phase = phase_enum()
   integer, parameter :: n_phases = 9
   character(len=*), parameter :: phase_names(n_phases) = [character(len=11) :: &
                                  'search', 'links', 'graph', 'block_terms', 'assembly', 'solve', 'judge', 'update', &
                                  'other']

   type :: phase_times_type
      real(wp) :: seconds(n_phases) = 0  !! wall clock, by phase
      integer(i8) :: steps = 0           !! accepted steps
      integer(i8) :: attempts = 0        !! attempts at a step
      integer(i8) :: rounds = 0          !! open-close rounds
      integer(i8) :: searches = 0        !! contact searches
      integer(i8) :: reused = 0          !! of these with the close pairs of an earlier one
      integer(i8) :: patterns = 0        !! patterns of the matrix set up
      integer(i8) :: contacts = 0        !! contacts (closed or not) over all rounds
      integer(i8) :: assembled = 0       !! contacts whose terms were put together, over all rounds
      integer(i8) :: solver_iterations = 0
      integer(i8), private :: last = 0   !! clock at the last lap
   contains
      procedure :: start
      procedure :: lap
   end type phase_times_type

contains

   !> Start the clock; the time since the last lap is not counted.
   subroutine start(self)
      class(phase_times_type), intent(inout) :: self
      call system_clock(self%last)
   end subroutine start

   !> Add the time since the last lap to a phase.
   subroutine lap(self, which)
      class(phase_times_type), intent(inout) :: self
      integer, intent(in) :: which      !! one of phase%...
      integer(i8) :: now, rate
      call system_clock(now, rate)
      self%seconds(which) = self%seconds(which) + real(now - self%last, wp)/real(max(rate, 1_i8), wp)
      self%last = now
   end subroutine lap

end module rockdda_base_phase_times
