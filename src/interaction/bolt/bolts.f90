! SPDX-License-Identifier: MIT
!> Bolts: axial springs between two points, with pretension and yield.
!>
!> Source: Shi's bolt (the thesis, 3.1, only names it), written as a spring between two blocks along the bolt's
!> direction (a link of rockdda_interaction_equations): the sum of its vectors at start and end of the step, over the
!> sum of its lengths, by which the change of length is exact for the expected motion.
!>
!> The axial force, tension positive, is pretension + stiffness (elongation - plastic), where the elongation is
!> the length now less the length at the start of the run and `plastic` the part of it that has yielded. At the
!> strength the bolt yields: elastic, perfectly plastic, the same in tension and compression; it does not break
!> and unloads elastically. Strength 0 means unlimited.
!>
!> In a step an elastic bolt is a spring of its stiffness with the force at the start of the step, a yielding one a
!> constant force.
module rockdda_interaction_bolts
   use rockdda_base_kinds, only : wp
   use rockdda_model_blocks, only : bolt_set_type
   use rockdda_model_state, only : energy
   use rockdda_interaction_attempt, only : attempt_type
   use rockdda_interaction_balance, only : energy_balance_type
   use rockdda_interaction_block_forces, only : block_forces_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_equations, only : equations_type
   use rockdda_interaction_finite_rotation, only : moving_block_type, mean_load, mean_displacement, end_displacement
   use rockdda_interaction_linked_interaction, only : linked_interaction_type, motion_change_type
   implicit none
   private
   public :: is_there, bolts_type, bolt_vectors, bolt_force, bolt_response, bolt_energy

   !> All bolts: link l acts along bolt l.
   type, extends(linked_interaction_type) :: bolts_type
      integer, private :: n = 0
      real(wp), allocatable, private :: stiffness(:), strength(:)   !! (n)
      real(wp), allocatable :: force(:)        !! (n) axial force at the step's start
      logical, allocatable :: acts(:)          !! (n) both ends are in active blocks, or outside
      logical, allocatable :: yields(:)        !! (n) trial: force held at the strength
      real(wp), allocatable :: stretch(:)      !! (n) predicted change of length up to where forces act, see `reach_end`
      real(wp), private :: level = 1           !! share of the step's motion up to there
      real(wp), allocatable, private :: kept_stretch(:)   !! (n)
   contains
      procedure :: init
      procedure :: present_forces
      procedure :: prepare
      procedure :: begin
      procedure :: place
      procedure :: add_to_links
      procedure :: set_motion
      procedure :: lawful_forces
      procedure :: measure_placement
      procedure :: judge
      procedure :: add_energies
      procedure :: commit
      procedure :: add_forces
   end type bolts_type

contains

   !> Length of a bolt and its derivatives: the length changes by e.d_1 + g.d_2, exactly for the expected motion.
   !> An end in no block has a zero vector, and so has a bolt whose ends coincide (it has no direction).
   pure subroutine bolt_vectors(ends, blocks, moving, length, e, g)
      real(wp), intent(in) :: ends(4)         !! x1 y1 x2 y2 at the start of the step [length]
      integer, intent(in) :: blocks(2)        !! of the two ends, 0: the fixed outside
      type(moving_block_type), intent(in) :: moving(2)   !! blocks of the ends; of an end in no block it is not used
      real(wp), intent(out) :: length         !! [length]
      real(wp), intent(out) :: e(6), g(6)     !! d(length)/d(d_1), d(length)/d(d_2)
      real(wp) :: b(2), b_end(2)
      b = ends(3:4) - ends(1:2)
      length = norm2(b)
      e = 0
      g = 0
      if (length <= 0) return
      b_end = b
      if (blocks(1) > 0) b_end = b_end - mean_displacement(moving(1)%d, ends(1:2), moving(1))
      if (blocks(2) > 0) b_end = b_end + mean_displacement(moving(2)%d, ends(3:4), moving(2))
      b = (b + b_end)/(length + norm2(b_end))
      if (blocks(1) > 0) e = mean_load(-b, ends(1:2), moving(1))
      if (blocks(2) > 0) g = mean_load(b, ends(3:4), moving(2))
   end subroutine bolt_vectors

   !> Axial force at the start of a step.
   pure real(wp) function bolt_force(stiffness, pretension, elongation, plastic)
      real(wp), intent(in) :: stiffness    !! [force/length], > 0
      real(wp), intent(in) :: pretension   !! force at the start of the run, tension positive
      real(wp), intent(in) :: elongation   !! length now - length at the start of the run [length]
      real(wp), intent(in) :: plastic      !! yielded part of the elongation [length]
      bolt_force = pretension + stiffness*(elongation - plastic)
   end function bolt_force

   !> The law of a bolt: its force after a change of length, and what yields.
   pure subroutine bolt_response(stiffness, strength, force, stretch, new_force, yields, yielded)
      real(wp), intent(in) :: stiffness    !! [force/length], > 0
      real(wp), intent(in) :: strength     !! largest axial force, 0 = unlimited
      real(wp), intent(in) :: force        !! at the start of the step
      real(wp), intent(in) :: stretch      !! e.d_1 + g.d_2 of the step [length]
      real(wp), intent(out) :: new_force   !! at the end of the step
      logical, intent(out) :: yields       !! the force is held at the strength
      real(wp), intent(out) :: yielded     !! plastic elongation of the step, 0 if elastic [length]
      new_force = force + stiffness*stretch
      yielded = 0
      yields = .false.
      if (strength <= 0) return
      yields = abs(new_force) > strength
      if (.not. yields) return
      yielded = (new_force - sign(strength, new_force))/stiffness
      new_force = sign(strength, new_force)
   end subroutine bolt_response

   !> Energy of one step: new_force*stretch = stored + dissipated + plastic.
   pure subroutine bolt_energy(stiffness, force, new_force, yielded, stored, dissipated, plastic)
      real(wp), intent(in) :: stiffness    !! [force/length], > 0
      real(wp), intent(in) :: force        !! at the start of the step
      real(wp), intent(in) :: new_force    !! at the end of the step
      real(wp), intent(in) :: yielded      !! plastic elongation of the step [length]
      real(wp), intent(out) :: stored      !! change of force**2/(2 stiffness) [energy]
      real(wp), intent(out) :: dissipated  !! numerical: (change of force)**2/(2 stiffness) [energy], >= 0
      real(wp), intent(out) :: plastic     !! work of yielding [energy], >= 0
      stored = 0.5_wp*(new_force - force)*(new_force + force)/stiffness
      dissipated = 0.5_wp*(new_force - force)**2/stiffness
      plastic = new_force*yielded
   end subroutine bolt_energy

   !> The bolts of a model.
   pure subroutine init(self, bolts)
      class(bolts_type), intent(inout) :: self
      type(bolt_set_type), intent(in) :: bolts
      self%n = bolts%n
      if (allocated(self%force)) deallocate (self%stiffness, self%strength, self%force, self%acts, self%yields, &
                                             self%stretch, self%kept_stretch)
      allocate (self%stiffness(self%n), self%strength(self%n), self%force(self%n), self%stretch(self%n), &
                self%kept_stretch(self%n), source=0.0_wp)
      allocate (self%yields(self%n), source=.false.)
      allocate (self%acts(self%n), source=.true.)
      if (self%n == 0) return
      self%stiffness = bolts%stiffness(1:self%n)
      self%strength = bolts%strength(1:self%n)
   end subroutine init

   !> One link per bolt, its blocks, and forces at the start of the step.
   subroutine prepare(self, context, attempt, equations)
      class(bolts_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(equations_type), intent(inout) :: equations
      integer :: c, l, pair(2)
      call equations%add_links(self%n, self%first_link)
      do l = 1, self%n
         c = self%first_link + l
         pair = context%blocks%bolts%blocks(:, l)
         self%force(l) = present_force(self, context, l)
         self%acts(l) = all(is_there(context%state%active, pair))
         ! both ends in one block: it holds nothing together, only the block's own strain would change it
         if (pair(1) == pair(2) .or. .not. self%acts(l)) pair = 0
         call equations%join(c, pair)
      end do
   end subroutine prepare

   !> Axial forces in the present state, tension positive; 0 where a block of an end is not there.
   pure function present_forces(self, context) result(force)
      class(bolts_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      real(wp) :: force(self%n)
      integer :: l
      do l = 1, self%n
         force(l) = present_force(self, context, l)
      end do
   end function present_forces

   !> The same for one bolt.
   pure real(wp) function present_force(self, context, l) result(force)
      class(bolts_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      integer, intent(in) :: l       !! bolt
      force = 0
      associate (bolts => context%blocks%bolts, state => context%state)
         if (.not. all(is_there(state%active, bolts%blocks(:, l)))) return
         force = bolt_force(self%stiffness(l), bolts%pretension(l), state%bolt_elongation(l), state%bolt_plastic(l))
      end associate
   end function present_force

   !> Is the block of an end there? The fixed outside always is.
   pure function is_there(active, pair)
      logical, intent(in) :: active(:)   !! (nb)
      integer, intent(in) :: pair(2)
      logical :: is_there(2)
      integer :: side
      is_there = .true.
      do side = 1, 2
         if (pair(side) > 0) is_there(side) = active(pair(side))
      end do
   end function is_there

   !> Begin an attempt: no bolt yields.
   subroutine begin(self, context, attempt)
      class(bolts_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      self%level = attempt%scheme%level
      self%yields = .false.
      self%stretch = 0
   end subroutine begin

   !> Directions of all bolts.
   subroutine place(self, context, attempt, equations)
      class(bolts_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(equations_type), intent(inout) :: equations
      real(wp) :: length, a(6, 2), b(6, 2)
      integer :: c, l
      a = 0
      b = 0
      do l = 1, self%n
         c = self%first_link + l
         call bolt_vectors(context%state%bolt_ends(:, l), equations%pair(:, c), &
                           blocks_of_ends(attempt, equations%pair(:, c)), length, a(:, 1), b(:, 1))
         call equations%set_vectors(c, a, b)
      end do
   end subroutine place

   !> The moving blocks of the two ends; one that does not move for an end in no block.
   pure function blocks_of_ends(attempt, pair) result(moving)
      type(attempt_type), intent(in) :: attempt
      integer, intent(in) :: pair(2)
      type(moving_block_type) :: moving(2)
      integer :: side
      do side = 1, 2
         if (pair(side) > 0) moving(side) = attempt%moving(pair(side))
      end do
   end function blocks_of_ends

   !> A spring with the force at the step's start, or, where the bolt yields, a constant force.
   subroutine add_to_links(self, equations)
      class(bolts_type), intent(in) :: self
      type(equations_type), intent(inout) :: equations
      real(wp) :: stiffness(2), force(2), yielded
      integer :: l
      logical :: yields
      do l = 1, self%n
         stiffness = [self%level*self%stiffness(l), 0.0_wp]
         force = [-self%force(l), 0.0_wp]
         if (self%yields(l)) then
            call bolt_response(self%stiffness(l), self%strength(l), self%force(l), self%stretch(l), force(1), yields, &
                               yielded)
            stiffness(1) = 0
            force(1) = -force(1)
         end if
         call equations%set_link(self%first_link + l, stiffness, force)
      end do
   end subroutine add_to_links

   !> Change of length of every bolt.
   subroutine set_motion(self, equations, change)
      class(bolts_type), intent(inout) :: self
      type(equations_type), intent(in) :: equations
      type(motion_change_type), intent(in) :: change
      real(wp) :: v(6, 2)
      integer :: c, l, side
      if (self%n == 0) return
      if (.not. change%to_solution) then
         call change%apply(self%stretch, self%kept_stretch)
         return
      end if
      do l = 1, self%n
         c = self%first_link + l
         self%stretch(l) = 0
         do side = 1, 2
            if (equations%pair(side, c) == 0) cycle
            v = equations%vectors_of(c, side)
            self%stretch(l) = self%stretch(l) + dot_product(v(:, 1), equations%x(:, equations%pair(side, c)))
         end do
         self%stretch(l) = self%level*self%stretch(l)
      end do
   end subroutine set_motion

   !> Forces by the law of the bolts at a fraction of the way.
   subroutine lawful_forces(self, fraction, force)
      class(bolts_type), intent(in) :: self
      real(wp), intent(in) :: fraction
      real(wp), intent(inout), contiguous :: force(:, :)
      real(wp) :: new_force, yielded
      logical :: yields
      integer :: l
      do l = 1, self%n
         call bolt_response(self%stiffness(l), self%strength(l), self%force(l), self%kept_stretch(l) + &
                            fraction*(self%stretch(l) - self%kept_stretch(l)), new_force, yields, yielded)
         force(:, self%first_link + l) = [new_force, 0.0_wp]
      end do
   end subroutine lawful_forces

   !> Lengths that the expected motion gives otherwise than the solution.
   subroutine measure_placement(self, context, attempt, equations)
      class(bolts_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(equations_type), intent(inout) :: equations
      real(wp) :: ends(4), load, scale, off
      integer :: b, c, l, side
      do l = 1, self%n
         c = self%first_link + l
         ends = context%state%bolt_ends(:, l)
         off = -norm2(ends(3:4) - ends(1:2)) - self%stretch(l)/self%level
         ! without a direction it does not act
         if (all(abs(ends(3:4) - ends(1:2)) <= 0)) cycle
         load = huge(load)
         do side = 1, 2
            b = equations%pair(side, c)
            if (b == 0) cycle
            ends(2*side - 1:2*side) = ends(2*side - 1:2*side) + &
                                      end_displacement(attempt%moved(b), ends(2*side - 1:2*side))
            load = min(load, equations%block_force(b))
         end do
         if (all(equations%pair(:, c) == 0)) cycle
         scale = max(load, abs(self%force(l) + self%stiffness(l)*self%stretch(l)))
         if (scale > 0) equations%link_off(c) = self%stiffness(l)*abs(off + norm2(ends(3:4) - ends(1:2)))/scale
      end do
   end subroutine measure_placement

   !> Which bolts yield at the predicted motion.
   subroutine judge(self, n_changes, n_unsettled)
      class(bolts_type), intent(inout) :: self
      integer, intent(out) :: n_changes, n_unsettled
      real(wp) :: force, yielded
      logical :: yields
      integer :: l
      n_changes = 0
      do l = 1, self%n
         call bolt_response(self%stiffness(l), self%strength(l), self%force(l), self%stretch(l), force, yields, yielded)
         if (yields .neqv. self%yields(l)) n_changes = n_changes + 1
         self%yields(l) = yields
      end do
      n_unsettled = n_changes
   end subroutine judge

   !> Stored and plastic work.
   subroutine add_energies(self, context, attempt, d, balance)
      class(bolts_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      real(wp), intent(in), contiguous :: d(:, :)
      class(energy_balance_type), intent(inout) :: balance
      real(wp) :: start_energy, end_energy, force, yielded, stored, lost, plastic, work
      logical :: yields
      integer :: l
      start_energy = 0
      end_energy = 0
      do l = 1, self%n
         call bolt_response(self%stiffness(l), self%strength(l), self%force(l), self%stretch(l), force, yields, yielded)
         call bolt_energy(self%stiffness(l), self%force(l), force, yielded, stored, lost, plastic)
         if (self%level < 1) then
            ! the force that has acted in the step, and that of its end
            work = force*self%stretch(l)/self%level
            call bolt_response(self%stiffness(l), self%strength(l), self%force(l), self%stretch(l)/self%level, force, &
                               yields, yielded)
            lost = work - 0.5_wp*(force - self%force(l))*(force + self%force(l))/self%stiffness(l)
            plastic = 0
         end if
         start_energy = start_energy + 0.5_wp*self%force(l)**2/self%stiffness(l)
         end_energy = end_energy + 0.5_wp*force**2/self%stiffness(l)
         call balance%add(energy%dissipated, lost + plastic)
      end do
      call balance%add(energy%geometry, start_energy - balance%bolt_energy)
      balance%bolt_energy = end_energy
   end subroutine add_energies

   !> Plastic elongation at the end of the step.
   subroutine commit(self, context, attempt, d)
      class(bolts_type), intent(inout) :: self
      type(step_context_type), intent(inout) :: context
      type(attempt_type), intent(inout) :: attempt
      real(wp), intent(in), contiguous :: d(:, :)
      real(wp) :: force, yielded
      logical :: yields
      integer :: l
      do l = 1, self%n
         call bolt_response(self%stiffness(l), self%strength(l), self%force(l), self%stretch(l)/self%level, force, &
                            yields, yielded)
         context%state%bolt_plastic(l) = context%state%bolt_plastic(l) + yielded
      end do
   end subroutine commit

   !> Axial forces on the blocks of both ends.
   subroutine add_forces(self, context, attempt, forces)
      class(bolts_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(block_forces_type), intent(inout) :: forces
      real(wp) :: along(2), force, length
      integer :: b, l, side
      do l = 1, self%n
         associate (ends => context%state%bolt_ends(:, l), pair => context%blocks%bolts%blocks(:, l))
            if (pair(1) == pair(2) .or. .not. self%acts(l)) cycle
            along = ends(3:4) - ends(1:2)
            length = norm2(along)
            if (.not. length > 0) cycle
            force = present_force(self, context, l)
            do side = 1, 2
               b = pair(side)
               if (b < 1) cycle
               call forces%add_force(b, merge(force, -force, side == 1)*along/length, &
                                     ends(2*side - 1:2*side) - context%state%centroid(:, b))
            end do
         end associate
      end do
   end subroutine add_forces

end module rockdda_interaction_bolts
