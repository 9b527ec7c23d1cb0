! SPDX-License-Identifier: MIT
!> Water in joints and on free edges: its pressure on the edges of blocks.
!>
!> A stretch of an edge is wetted by a group when one of its joint materials is named, or, where it faces no other
!> block, when the group wets surfaces (rockdda_interaction_wetted_edges). Both sides of a joint are stretches of two
!> edges, each of which moves with its block (rockdda_interaction_water_load). A stretch is wetted by the last group
!> that acts.
module rockdda_interaction_water
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : diagnostics_type
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_state, only : energy
   use rockdda_model_water_check, only : acts
   use rockdda_interaction_attempt, only : attempt_type
   use rockdda_interaction_balance, only : energy_balance_type
   use rockdda_interaction_block_forces, only : block_forces_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_equations, only : equations_type
   use rockdda_interaction_interaction, only : interaction_type
   use rockdda_interaction_water_edges, only : edge_stretch_type
   use rockdda_interaction_water_load, only : find_loads
   use rockdda_interaction_water_pressure, only : water_pressure_type, rise_of
   use rockdda_interaction_wetted_edges, only : find_wetted_edges
   implicit none
   private
   public :: water_family_type

   type, extends(interaction_type) :: water_family_type
      type(edge_stretch_type), allocatable :: stretches(:)   !! those that some group wets
      logical, allocatable :: wets(:, :)                     !! (groups, stretches)
      integer, allocatable :: group(:)                       !! (stretches) that wets it now, 0: none does
      type(water_pressure_type), allocatable :: pressure(:)  !! (groups)
      character(len=:), allocatable, private :: chosen       !! names of the groups that act; empty: all
      real(wp), allocatable :: load(:, :)                    !! (6, stretches) in the step
   contains
      procedure :: init
      procedure :: begin
      procedure :: add_to_blocks
      procedure :: measure_placement
      procedure :: add_energies
      procedure :: add_forces
      procedure, private :: choose
      procedure :: rise
   end type water_family_type

contains

   !> Find the stretches that groups wet: see `find_wetted_edges` for the messages.
   subroutine init(self, blocks, parameters, messages)
      class(water_family_type), intent(inout) :: self
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(diagnostics_type), intent(inout) :: messages
      if (allocated(self%group)) deallocate (self%group, self%load)
      call find_wetted_edges(blocks, parameters, self%stretches, self%wets, self%pressure, messages)
      if (.not. allocated(self%wets)) return
      allocate (self%group(size(self%stretches)), self%load(6, size(self%stretches)))
      call self%choose(parameters, '')
   end subroutine init

   !> Rise of the table at time 0 of the group that wets a stretch now.
   pure real(wp) function rise(self, parameters, stretch)
      class(water_family_type), intent(in) :: self
      type(parameters_type), intent(in) :: parameters
      integer, intent(in) :: stretch
      rise = rise_of(parameters%water(self%group(stretch)), 0.0_wp)
   end function rise

   !> Choose the groups that act: names, commas between them; empty: all.
   pure subroutine choose(self, parameters, names)
      class(water_family_type), intent(inout) :: self
      type(parameters_type), intent(in) :: parameters
      character(len=*), intent(in) :: names
      integer :: g
      self%chosen = names
      self%group = 0
      do g = 1, size(self%pressure)
         if (.not. acts(parameters%water(g), names)) cycle
         where (self%wets(g, :)) self%group = g
      end do
   end subroutine choose

   !> Groups that act in the step.
   subroutine begin(self, context, attempt)
      class(water_family_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      if (self%chosen /= attempt%water) call self%choose(context%parameters, attempt%water)
   end subroutine begin

   !> Pressure on all wetted stretches.
   subroutine add_to_blocks(self, context, attempt, equations)
      class(water_family_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(equations_type), intent(inout) :: equations
      integer :: i
      if (size(self%stretches) == 0) return
      call find_loads(self%stretches, self%group, self%pressure, context, attempt, self%load)
      ! one after the other, so that the order of the sum does not depend on the number of threads
      do i = 1, size(self%stretches)
         associate (b => self%stretches(i)%block)
            equations%block_load(:, b) = equations%block_load(:, b) + self%load(:, i)
            equations%block_magnitude(:, b) = equations%block_magnitude(:, b) + abs(self%load(:, i))
         end associate
      end do
   end subroutine add_to_blocks

   !> Loads that the expected motion gives otherwise than the solution.
   subroutine measure_placement(self, context, attempt, equations)
      class(water_family_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(equations_type), intent(inout) :: equations
      real(wp), allocatable :: found(:, :)
      real(wp) :: scale
      integer :: i, b
      if (size(self%stretches) == 0) return
      allocate (found(6, size(self%stretches)))
      call find_loads(self%stretches, self%group, self%pressure, context, attempt, found, motion=equations%x)
      do i = 1, size(self%stretches)
         b = self%stretches(i)%block
         ! not the load, which is nearly nothing where a block floats
         scale = norm2(equations%block_magnitude(1:2, b))
         if (scale > 0) equations%block_off(b) = max(equations%block_off(b), &
                                                     norm2(found(1:2, i) - self%load(1:2, i))/scale)
      end do
   end subroutine measure_placement

   !> Work of the pressure.
   subroutine add_energies(self, context, attempt, d, balance)
      class(water_family_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      real(wp), intent(in), contiguous :: d(:, :)
      class(energy_balance_type), intent(inout) :: balance
      integer :: i
      do i = 1, size(self%stretches)
         call balance%add(energy%external, dot_product(self%load(:, i), d(:, self%stretches(i)%block)))
      end do
   end subroutine add_energies

   !> Pressure on the moved blocks. No equilibrium while a table rises or falls.
   subroutine add_forces(self, context, attempt, forces)
      class(water_family_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(block_forces_type), intent(inout) :: forces
      real(wp), allocatable :: load(:, :)
      integer :: i
      if (size(self%pressure) == 0) return
      allocate (load(6, size(self%stretches)))
      call find_loads(self%stretches, self%group, self%pressure, context, attempt, load, at_rest=.true.)
      do i = 1, size(self%stretches)
         if (any(abs(load(:, i)) > 0)) call forces%add_load(self%stretches(i)%block, load(1:3, i))
      end do
      do i = 1, size(self%pressure)
         associate (group => context%parameters%water(i), time => context%state%time)
            if (.not. acts(group, attempt%water)) cycle
            if (abs(rise_of(group, time + attempt%dt) - rise_of(group, time)) > 0) forces%driven = .true.
         end associate
      end do
   end subroutine add_forces

end module rockdda_interaction_water
