! SPDX-License-Identifier: MIT
!> The verdict on a model in static steps: does it stay, or fail? (docs/factor-of-safety.md, "What stable means")
!>
!> A static step ends with the inertia that its motion needs: the resultant of all other forces on a block. While joints
!> and blocks only deform, that pull falls as the block moves, because they take the load over; when it has moved as far
!> as they need, the pull is gone. A block that no deformation can hold keeps its pull however far it moves.
!>
!>     stable    unbalanced <= tolerance in two steps in a row
!>     failing   a block has moved beyond a share of its size and the deformation of the model, and its pull does not
!>               fall as it continues
module rockdda_stepping_verdict
   use rockdda_base_kinds, only : wp
   use rockdda_base_sorting, only : sorted_order
   use rockdda_model_state, only : radius_of_inertia
   use rockdda_contact_table, only : contact_state, contact_table_type, is_of_interval
   use rockdda_model_stage_options, only : confirming_steps
   use rockdda_interaction_block_forces, only : block_forces_type
   use rockdda_stepping_step, only : step_type
   implicit none
   private
   public :: verdict_type, verdict, typical_size, deformation_of

   type :: verdict_enum
      integer :: open = 0       !! neither yet
      integer :: stable = 1
      integer :: failing = 2
   end type verdict_enum
   type(verdict_enum), parameter :: verdict = verdict_enum()

   !> The first length, on which the distances depend at which pulls are compared in a trial: this share of a block's
   !> size, or the deformation of the model where that is larger. Joints and blocks of rock deform by far less (the
   !> stable trials of a dam 21 m in size move it by 3e-5 m). And it must be small: loads that stay in space, such as
   !> water below a table, change as the block moves, and with them what is judged. A sliding dam whose table falls
   !> from heel to toe has lost 5 % of its uplift after 1 % of its size; judged from there on it finds equilibrium up
   !> to a factor that is 5 % too large.
   real(wp), parameter, public :: usual_share = 0.001_wp
   !> A pull stays when it would be gone no sooner than at twice the distance of now if it went on to fall like it has
   !> since the distance was `apart` times shorter: more than half of it is left. Where loads rise that a model does not
   !> carry yet, one joint after the other begins to slide, and the pull falls for long before it is gone: 3,997 where
   !> a footing carries 4,029 with 16 for `loaded_apart`, 3,933 with 4.
   real(wp), parameter, public :: apart = 4.0_wp, loaded_apart = 32.0_wp
   !> In a trial, which begins at rest, pulls are compared sooner where friction does more than the share `mostly` of
   !> the work of the contacts: joints and blocks have taken over what they can. Then the distance grows by the distance
   !> of two marks or more up to `apart`, and a pull stays when it would be gone no sooner than one that has fallen by
   !> half from one first length to `apart` of them.
   real(wp), parameter :: mostly = 0.95_wp
   !> Pulls are kept at marks, each this multiple as far as the last. The first one is a part of 1/apart of the way
   !> beyond which a block may fail: `apart` first lengths, in a trial that slides one.
   real(wp), parameter :: spacing = sqrt(2.0_wp)
   integer, parameter :: n_marks = 40
   !> Least number of steps between the marks that are compared; of a slide and of a preliminary
   !> verdict, and to be sure: few long steps may pass by an equilibrium, and their pulls hold what a step has not
   !> relaxed yet. By few steps an arch of 20 voussoirs on soft joints fails under a push of 0.455, and stands up to
   !> 0.498.
   integer, parameter :: few_steps = 2, sure_steps = 16

   type :: verdict_type
      real(wp), allocatable :: centroid(:, :)   !! (2, nb) at the beginning
      real(wp), allocatable :: rotation(:)      !! (nb)
      real(wp), allocatable :: moved(:)         !! (nb) distance from there [length]
      real(wp) :: deformation = 0               !! of the model at the beginning [length]
      logical :: begins_at_rest = .true.        !! false: the deformation is that which the model has by now
      logical :: stressed = .false.             !! there was stress before the first step
      real(wp) :: share = usual_share           !! of a block's size: the first length
      logical :: is_trial = .false.             !! of a search, and judged early
      real(wp) :: growth = apart                !! growth of the distance over which pulls are compared
      integer :: between = 0                    !! the same as a number of marks
      real(wp) :: ways = 1                      !! first lengths beyond which a block may fail
      integer, allocatable :: mark(:)           !! (nb) the last mark that was passed
      real(wp), allocatable :: pull(:, :)       !! (between + 1, nb) at the last marks, in turn [force]
      real(wp), allocatable :: least(:, :)      !! the same: the least pull since then [force]
      real(wp), allocatable :: way(:, :)        !! the same: how far the block had moved [length]
      integer, allocatable :: step(:, :)        !! the same: when the mark was passed, counted from the beginning
      integer, allocatable :: first_step(:)     !! (nb) the same of the first mark
      integer :: steps = 0
      integer :: least_steps = sure_steps       !! between the marks that are compared
      logical :: is_sure = .false.              !! it fails by as many steps as are sure
      integer :: first_failing = 0              !! the block by which the verdict was reached
   contains
      procedure :: begin
      procedure :: measure
      procedure :: judge
      procedure :: deformation_by_now
      procedure :: way_moved
      procedure, private :: place_of
      procedure, private :: stays_pulled
   end type verdict_type

contains

   !> Begin in the present state.
   subroutine begin(self, step, share, stressed, growth, is_trial, preliminary)
      class(verdict_type), intent(out) :: self
      class(step_type), intent(in) :: step
      real(wp), intent(in), optional :: share    !! of a block's size, for a model that does not begin at rest
      logical, intent(in), optional :: stressed  !! there was stress before the first step; default: not
      logical, intent(in), optional :: is_trial  !! of a search, and judged early; default: not
      real(wp), intent(in), optional :: growth   !! of the distance, over which pulls are compared; default: `apart`
      logical, intent(in), optional :: preliminary   !! by few steps: `is_sure` says whether others find the same
      integer :: nb
      nb = step%blocks%n_blocks
      self%centroid = step%state%centroid
      self%rotation = step%state%rotation
      if (present(share)) then
         self%share = share
         self%begins_at_rest = .false.
      else
         self%deformation = deformation_of(step, step%contacts)
      end if
      if (present(stressed)) self%stressed = stressed
      if (present(growth)) self%growth = growth
      if (present(is_trial)) self%is_trial = is_trial
      if (present(preliminary)) self%least_steps = merge(few_steps, sure_steps, preliminary)
      self%between = nint(log(self%growth)/log(spacing))
      if (.not. self%is_trial) self%ways = self%growth
      allocate (self%moved(nb), self%pull(self%between + 1, nb), self%way(self%between + 1, nb), source=0.0_wp)
      allocate (self%least(self%between + 1, nb), source=0.0_wp)
      allocate (self%step(self%between + 1, nb), self%mark(nb), self%first_step(nb), source=0)
   end subroutine begin

   !> Measure how far blocks have moved.
   subroutine measure(self, step, forces)
      class(verdict_type), intent(inout) :: self
      class(step_type), intent(in) :: step
      type(block_forces_type), intent(in) :: forces
      integer :: i
      associate (state => step%state)
         do i = 1, size(self%moved)
            if (.not. forces%counts(i, state)) cycle
            self%moved(i) = norm2(state%centroid(:, i) - self%centroid(:, i)) + &
                            radius_of_inertia(state, i)*abs(state%rotation(i) - self%rotation(i))
         end do
      end associate
   end subroutine measure

   !> The verdict after an accepted step that began at rest.
   integer function judge(self, step, forces) result(outcome)
      class(verdict_type), intent(inout) :: self
      class(step_type), intent(in) :: step
      type(block_forces_type), intent(in) :: forces   !! at the end of the step
      real(wp) :: pull, first
      integer :: i, m
      self%steps = self%steps + 1
      outcome = verdict%open
      call self%measure(step, forces)
      if (.not. self%begins_at_rest) self%deformation = self%deformation_by_now(step, forces)
      do i = 1, size(self%moved)
         if (.not. forces%counts(i, step%state)) cycle
         first = first_length(self, step, i)
         pull = forces%force_of(i, step%state)
         self%least(:, i) = min(self%least(:, i), pull)
         do while (self%mark(i) < n_marks)
            m = self%mark(i) + 1
            if (self%moved(i) < first*self%ways/self%growth*spacing**(m - 1)) exit
            self%mark(i) = m
            self%pull(self%place_of(m), i) = pull
            self%least(self%place_of(m), i) = pull
            self%way(self%place_of(m), i) = self%moved(i)
            self%step(self%place_of(m), i) = self%steps
            if (m == 1) self%first_step(i) = self%steps
         end do
         if (self%moved(i) < self%ways*first) cycle
         if (.not. self%stays_pulled(i, pull, first, step%control%slip_share, self%least_steps)) cycle
         outcome = verdict%failing
         self%is_sure = self%is_sure .or. self%stays_pulled(i, pull, first, step%control%slip_share, sure_steps)
         if (self%first_failing == 0) self%first_failing = i
      end do
      if (outcome == verdict%failing) return
      if (step%control%balanced >= confirming_steps) outcome = verdict%stable
   end function judge

   !> Has the pull of a block stayed since one of the last marks?
   pure logical function stays_pulled(self, i, pull, first, slip, least_steps) result(has_stayed)
      class(verdict_type), intent(in) :: self
      integer, intent(in) :: i
      real(wp), intent(in) :: pull               !! now
      real(wp), intent(in) :: first              !! length
      real(wp), intent(in) :: slip               !! share of friction in the work of the contacts
      integer, intent(in) :: least_steps         !! between marks, but for a slide
      real(wp) :: since, farthest
      integer :: k, mark, between
      logical :: slides
      has_stayed = .false.
      slides = self%is_trial .and. slip > mostly
      if (.not. slides .and. self%moved(i) < self%growth*first) return
      between = merge(few_steps, least_steps, slides)
      do k = merge(1, self%between, slides), min(self%mark(i) - 1, self%between)
         mark = self%place_of(self%mark(i) - k)
         if (self%steps - self%step(mark, i) < between .and. self%steps - self%first_step(i) < 2*between) cycle
         if (slides .and. self%moved(i) < spacing*self%way(mark, i)) cycle
         since = self%moved(i) - self%way(mark, i)
         ! where the pull may be gone by the line through both
         farthest = self%moved(i) + since
         if (slides) farthest = max(farthest, (2*self%growth - 1)*first)
         ! a contact that closes, and dilation by the slip of a long step, push for some steps what nothing pulled
         ! before; over a long distance pulls have dips as well, where a joint locks and slides on
         has_stayed = merge(pull, self%least(mark, i), slides .or. self%growth > apart) >= &
                      self%pull(mark, i)*(1 - since/(farthest - self%way(mark, i)))
         if (has_stayed) return
      end do
   end function stays_pulled

   !> Where a mark is kept.
   pure integer function place_of(self, mark)
      class(verdict_type), intent(in) :: self
      integer, intent(in) :: mark
      place_of = modulo(mark, self%between + 1) + 1
   end function place_of

   !> First length of a block.
   pure real(wp) function first_length(self, step, i)
      class(verdict_type), intent(in) :: self
      class(step_type), intent(in) :: step
      integer, intent(in) :: i
      first_length = max(self%share*sqrt(step%state%area(i)), self%deformation)
   end function first_length

   !> Largest distance that a block has moved, in first lengths.
   pure real(wp) function way_moved(self, step) result(way)
      class(verdict_type), intent(in) :: self
      class(step_type), intent(in) :: step
      integer :: i
      way = 0
      do i = 1, size(self%moved)
         if (self%moved(i) > 0) way = max(way, self%moved(i)/first_length(self, step, i))
      end do
   end function way_moved

   !> What the loads that a model carries by now deform it by, on its way to rest: as `deformation_of`, and where there
   !> was no stress before the first step at least the mean of its displacements, weighted with the loads. That is
   !> twice its elastic energy over them (Clapeyron), bending included; the largest displacement is up to some three
   !> times as large (2.5 times at the tip of a cantilever under its weight).
   function deformation_by_now(self, step, forces) result(deformation)
      class(verdict_type), intent(in) :: self
      class(step_type), intent(in) :: step
      type(block_forces_type), intent(in) :: forces   !! at the end of the step
      real(wp) :: deformation
      real(wp) :: twice_energy, carried
      integer :: c, i
      deformation = deformation_of(step, step%contacts)
      if (self%stressed) return
      twice_energy = 0
      carried = 0
      do i = 1, step%blocks%n_blocks
         if (.not. forces%counts(i, step%state)) cycle
         associate (stress => step%state%stress(:, i))
            twice_energy = twice_energy + step%state%area(i)*(sum(stress(1:2)**2) + 2*stress(3)**2)/ &
               step%parameters%block_materials(step%blocks%block_material(i))%youngs_modulus
         end associate
         associate (loads => step%families%loads)
            if (allocated(loads%external)) then
               carried = carried + norm2(loads%weight(:, i) + loads%external(1:2, i) - forces%resultant(1:2, i))
            else
               carried = carried + norm2(loads%weight(:, i) - forces%resultant(1:2, i))
            end if
         end associate
      end do
      associate (table => step%contacts)
         do c = 1, table%n
            if (table%state(c) == contact_state%open .or. .not. min(table%k_n(c), table%k_s(c)) > 0) cycle
            twice_energy = twice_energy + table%normal_force(c)**2/stiffness_of(step, table, c) + &
                           table%shear_force(c)**2/table%k_s(c)
         end do
      end associate
      if (carried > 0) deformation = max(deformation, twice_energy/carried)
   end function deformation_by_now

   !> Normal force of a contact over its closure.
   pure real(wp) function stiffness_of(step, table, c)
      class(step_type), intent(in) :: step
      type(contact_table_type), intent(in) :: table   !! of the last step
      integer, intent(in) :: c                        !! row
      stiffness_of = step%families%contacts%laws(table%joint(c))%normal%secant(table%k_n(c), table%normal_force(c))
   end function stiffness_of

   !> What its loads deform a model by: the mean strain of blocks, and what joints turn by that close by their mean
   !> closure at one end, times its extent. A trial changes the loads or what carries them by their own order, so that
   !> an elastic answer is of this size, or smaller.
   function deformation_of(step, table) result(deformation)
      class(step_type), intent(in) :: step
      type(contact_table_type), intent(in) :: table   !! of the last step
      real(wp) :: deformation
      real(wp) :: strain, closing, joint_length, modulus
      integer :: c, i, n, n_closed, n_joints
      logical :: can_move(step%blocks%n_blocks)
      can_move = movable(step)
      strain = 0
      closing = 0
      joint_length = 0
      n = 0
      n_closed = 0
      n_joints = 0
      do i = 1, step%blocks%n_blocks
         if (.not. can_move(i)) cycle
         modulus = step%parameters%block_materials(step%blocks%block_material(i))%youngs_modulus
         strain = strain + maxval(abs(step%state%stress(:, i)))/modulus
         n = n + 1
      end do
      deformation = 0
      if (n == 0) return
      do c = 1, table%n
         if (table%state(c) == contact_state%open .or. .not. min(table%k_n(c), table%k_s(c)) > 0) cycle
         closing = closing + hypot(table%normal_force(c)/stiffness_of(step, table, c), &
                                   table%shear_force(c)/table%k_s(c))
         n_closed = n_closed + 1
         if (.not. is_of_interval(table, c)) cycle
         joint_length = joint_length + table%length(c)
         if (table%station(c) == 1) n_joints = n_joints + 1
      end do
      ! a joint may be much shorter than its blocks: the base of a column
      joint_length = merge(min(joint_length/max(1, n_joints), typical_size(step)), typical_size(step), n_joints > 0)
      deformation = (strain/n + closing/max(1, n_closed)/joint_length)*extent_of(step)
   end function deformation_of

   !> Diagonal of the box around the blocks that can move.
   function extent_of(step) result(extent)
      class(step_type), intent(in) :: step
      real(wp) :: extent
      real(wp) :: low(2), high(2)
      integer :: i
      logical :: can_move(step%blocks%n_blocks)
      can_move = movable(step)
      extent = 0
      if (.not. any(can_move)) return
      low = huge(1.0_wp)
      high = -low
      do i = 1, step%blocks%n_blocks
         if (.not. can_move(i)) cycle
         associate (points => step%state%vertices(:, step%blocks%vertex_offset(i) + 1:step%blocks%vertex_offset(i + 1)))
            low = min(low, minval(points, dim=2))
            high = max(high, maxval(points, dim=2))
         end associate
      end do
      extent = norm2(high - low)
   end function extent_of

   !> Blocks that can move: neither inactive nor held at two points or by a boundary. The same for a state that was
   !> computed and one that was read.
   function movable(step) result(can_move)
      class(step_type), intent(in) :: step
      logical :: can_move(step%blocks%n_blocks)
      real(wp) :: holds(step%blocks%n_blocks)
      call step%blocks%count_holds(holds, step%control%released, step%held)
      can_move = step%state%active .and. holds < 2
   end function movable

   !> Median of the sizes of the blocks that can move.
   function typical_size(step) result(median)
      class(step_type), intent(in) :: step
      real(wp) :: median
      real(wp), allocatable :: sizes(:)
      integer, allocatable :: order(:)
      integer :: n
      logical :: can_move(step%blocks%n_blocks)
      can_move = movable(step)
      sizes = pack(sqrt(step%state%area), can_move)
      n = size(sizes)
      median = 0
      if (n == 0) return
      order = sorted_order(sizes)
      median = sizes(order((n + 1)/2))
   end function typical_size

end module rockdda_stepping_verdict
