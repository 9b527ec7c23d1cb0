! SPDX-License-Identifier: MIT
!> The verdict on a trial: does the model stay, or does it fail? (docs/factor-of-safety.md, "What stable means")
!>
!> A static step ends with the inertia that its motion needs: the resultant of all other forces on a block. While joints
!> and blocks only deform, that pull falls as the block moves, because they take the load over; when it has moved as far
!> as they need, the pull is gone. A block that no deformation can hold keeps its pull however far it moves.
!>
!>     stable    unbalanced <= tolerance in two steps in a row
!>     failing   the distance that some block has moved has grown fourfold and its pull has not fallen to half, beyond
!>               `first_share` of its size and the deformation of the model
module rockdda_run_trial_verdict
   use rockdda_base_kinds, only : wp
   use rockdda_base_sorting, only : sorted_order
   use rockdda_model_state, only : radius_of_inertia
   use rockdda_contact_table, only : contact_state
   use rockdda_stepping_simulation, only : simulation_type
   implicit none
   private
   public :: trial_verdict_type, verdict, typical_size, extent_of

   type :: verdict_enum
      integer :: open = 0       !! neither yet
      integer :: stable = 1
      integer :: failing = 2
   end type verdict_enum
   type(verdict_enum), parameter :: verdict = verdict_enum()

   !> Distances at which pulls are compared: this share of a block's size, or the deformation of the model where that is
   !> larger, and its doubles. Joints and blocks of rock deform by far less (the stable trials of a dam 21 m in size
   !> move it by 3e-5 m). And it must be small: loads that stay in space, such as water below a table, change as the
   !> block moves, and with them what is judged. A sliding dam whose table falls from heel to toe has lost 5 % of its
   !> uplift after 1 % of its size; judged from there on it finds equilibrium up to a factor that is 5 % too large.
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
      real(wp) :: deformation = 0               !! of the model in the settled state [length]
      real(wp), allocatable :: pull(:, :)       !! (n_marks, nb) when the mark was passed [force]
      integer, allocatable :: step(:, :)        !! (n_marks, nb) of the trial, when the mark was passed
      integer, allocatable :: mark(:)           !! (nb) the last mark that was passed
      integer :: steps = 0
      real(wp) :: least = 0                     !! no verdict before a block has moved so far, at least [length]
      integer :: first_failing = 0              !! the block by which the verdict was reached
   contains
      procedure :: begin
      procedure :: measure
      procedure :: judge
   end type trial_verdict_type

contains

   !> Begin a trial in the settled state.
   subroutine begin(self, sim, least)
      class(trial_verdict_type), intent(out) :: self
      type(simulation_type), intent(in) :: sim
      real(wp), intent(in), optional :: least    !! no verdict before a block has moved so far, at least [length]
      integer :: nb
      nb = sim%blocks%n_blocks
      self%centroid = sim%state%centroid
      self%rotation = sim%state%rotation
      self%deformation = deformation_of(sim)
      if (present(least)) self%least = least
      allocate (self%moved(nb), self%pull(n_marks, nb), source=0.0_wp)
      allocate (self%step(n_marks, nb), self%mark(nb), source=0)
   end subroutine begin

   !> Measure how far blocks have moved.
   subroutine measure(self, sim)
      class(trial_verdict_type), intent(inout) :: self
      type(simulation_type), intent(in) :: sim
      integer :: i
      associate (state => sim%state)
         do i = 1, size(self%moved)
            if (.not. sim%forces%counts(i, state)) cycle
            self%moved(i) = norm2(state%centroid(:, i) - self%centroid(:, i)) + &
                            radius_of_inertia(state, i)*abs(state%rotation(i) - self%rotation(i))
         end do
      end associate
   end subroutine measure

   !> The verdict after an accepted step that began at rest.
   integer function judge(self, sim) result(outcome)
      class(trial_verdict_type), intent(inout) :: self
      type(simulation_type), intent(in) :: sim
      real(wp) :: pull, first
      integer :: i, m
      self%steps = self%steps + 1
      outcome = verdict%open
      call self%measure(sim)
      do i = 1, size(self%moved)
         if (.not. sim%forces%counts(i, sim%state)) cycle
         first = max(first_share*sqrt(sim%state%area(i)), self%deformation, self%least/2**marks_between)
         pull = sim%forces%force_of(i, sim%state)
         do while (self%mark(i) < n_marks)
            m = self%mark(i) + 1
            if (self%moved(i) < first*2.0_wp**(m - 1)) exit
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

   !> What its loads deform a model by: the mean strain of blocks and joints times its extent. A trial changes the loads
   !> or what carries them by their own order, so that an elastic answer is of this size, or smaller.
   function deformation_of(sim) result(deformation)
      type(simulation_type), intent(in) :: sim
      real(wp) :: deformation
      real(wp) :: strain, closing, modulus
      integer :: c, i, n, n_closed
      logical :: can_move(sim%blocks%n_blocks)
      can_move = movable(sim)
      strain = 0
      closing = 0
      n = 0
      n_closed = 0
      do i = 1, sim%blocks%n_blocks
         if (.not. can_move(i)) cycle
         modulus = sim%parameters%block_materials(sim%blocks%block_material(i))%youngs_modulus
         strain = strain + maxval(abs(sim%state%stress(:, i)))/modulus
         n = n + 1
      end do
      deformation = 0
      if (n == 0) return
      associate (table => sim%contacts)
         do c = 1, table%n
            if (table%state(c) == contact_state%open .or. .not. min(table%k_n(c), table%k_s(c)) > 0) cycle
            closing = closing + hypot(table%normal_force(c)/table%k_n(c), table%shear_force(c)/table%k_s(c))
            n_closed = n_closed + 1
         end do
      end associate
      deformation = (strain/n + closing/max(1, n_closed)/typical_size(sim))*extent_of(sim)
   end function deformation_of

   !> Diagonal of the box around the blocks that can move.
   function extent_of(sim) result(extent)
      type(simulation_type), intent(in) :: sim
      real(wp) :: extent
      real(wp) :: low(2), high(2)
      integer :: i
      logical :: can_move(sim%blocks%n_blocks)
      can_move = movable(sim)
      extent = 0
      if (.not. any(can_move)) return
      low = huge(1.0_wp)
      high = -low
      do i = 1, sim%blocks%n_blocks
         if (.not. can_move(i)) cycle
         associate (points => sim%state%vertices(:, sim%blocks%vertex_offset(i) + 1:sim%blocks%vertex_offset(i + 1)))
            low = min(low, minval(points, dim=2))
            high = max(high, maxval(points, dim=2))
         end associate
      end do
      extent = norm2(high - low)
   end function extent_of

   !> Blocks that can move: neither inactive nor held at two points or by a boundary. The same for a state that was
   !> computed and one that was read.
   function movable(sim) result(can_move)
      type(simulation_type), intent(in) :: sim
      logical :: can_move(sim%blocks%n_blocks)
      real(wp) :: holds(sim%blocks%n_blocks)
      call sim%blocks%count_holds(holds, sim%control%released, sim%held)
      can_move = sim%state%active .and. holds < 2
   end function movable

   !> Median of the sizes of the blocks that can move.
   function typical_size(sim) result(median)
      type(simulation_type), intent(in) :: sim
      real(wp) :: median
      real(wp), allocatable :: sizes(:)
      integer, allocatable :: order(:)
      integer :: i, n
      logical :: can_move(sim%blocks%n_blocks)
      can_move = movable(sim)
      allocate (sizes(0))
      do i = 1, sim%blocks%n_blocks
         if (.not. can_move(i)) cycle
         sizes = [sizes, sqrt(sim%state%area(i))]
      end do
      n = size(sizes)
      median = 0
      if (n == 0) return
      order = sorted_order(sizes)
      median = sizes(order((n + 1)/2))
   end function typical_size

end module rockdda_run_trial_verdict
