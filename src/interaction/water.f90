! SPDX-License-Identifier: MIT
!> Water in joints and on free edges: its pressure on the edges of blocks.
!>
!> A stretch of an edge is wetted by a group when one of its joint materials is named, or, where it faces no other
!> block, when the group wets surfaces. Both sides of a joint are stretches of two edges, each of which moves with its
!> block. The pressure is that of the place of the edge in the middle of the step, by the motion that is expected of the
!> block (an oscillation in water gains no energy by that), and of the level of the table at the end of the step. A
!> stretch is wetted by the last group that acts.
module rockdda_interaction_water
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_base_parallel, only : parallel_blocks
   use rockdda_base_strings, only : counted, to_string
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_options, only : water_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_regions, only : blocks_of_region, count_words, material_number, same_name, word_of
   use rockdda_model_state, only : energy
   use rockdda_model_water_check, only : acts, title_of
   use rockdda_interaction_balance, only : energy_balance_type
   use rockdda_interaction_block_forces, only : block_forces_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_equations, only : equations_type
   use rockdda_interaction_finite_rotation, only : moving_block_type, new_moving_block, mean_load, mean_displacement
   use rockdda_interaction_interaction, only : interaction_type
   use rockdda_interaction_loads, only : table_value
   use rockdda_interaction_water_edges, only : edge_stretch_type, find_stretches
   use rockdda_interaction_water_pressure, only : water_pressure_type, water_scratch_type, &
      new_water_pressure
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
   end type water_family_type

contains

   !> Find the stretches that groups wet. Warnings: groups that wet nothing. The groups have been checked
   !> (rockdda_model_water_check).
   subroutine init(self, blocks, parameters, messages)
      class(water_family_type), intent(inout) :: self
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(diagnostics_type), intent(inout) :: messages
      type(edge_stretch_type), allocatable :: all_stretches(:)
      logical, allocatable :: wets(:, :), inside(:), joints(:)
      integer :: g, i, n
      n = 0
      if (allocated(parameters%water)) n = size(parameters%water)
      if (allocated(self%stretches)) deallocate (self%stretches, self%wets, self%group, self%pressure, self%load)
      allocate (self%pressure(n))
      allocate (all_stretches(0))
      if (n > 0) call find_stretches(blocks, max(blocks%edge_node_distance, 1.0e-9_wp*parameters%w0), &
                                     all_stretches)
      allocate (wets(n, size(all_stretches)))
      do g = 1, n
         associate (group => parameters%water(g))
            call new_water_pressure(group, self%pressure(g))
            if (.not. self%pressure(g)%is_there()) then
               call messages%add(severity%error, title_of(group, g)//': pressure_file: the points make no '// &
                                 'triangle: they lie on a line, or two are the same', group%origin)
               return
            end if
            inside = blocks_of_group(blocks, parameters, group)
            joints = named_joints(parameters, group)
            do i = 1, size(all_stretches)
               associate (s => all_stretches(i))
                  wets(g, i) = group%surfaces
                  if (s%joints(2) > 0) wets(g, i) = any(joints(s%joints))
                  wets(g, i) = wets(g, i) .and. inside(s%block)
               end associate
            end do
         end associate
      end do
      self%stretches = pack(all_stretches, any(wets, dim=1))
      allocate (self%wets(n, size(self%stretches)), self%group(size(self%stretches)), &
                self%load(6, size(self%stretches)))
      do g = 1, n
         self%wets(g, :) = pack(wets(g, :), any(wets, dim=1))
         call report(self, blocks, parameters%water(g), g, messages)
         call report_beyond(self, blocks, parameters, g, messages)
      end do
      call self%choose(parameters%water, '')
   end subroutine init

   !> Blocks that a group names.
   pure function blocks_of_group(blocks, parameters, group) result(inside)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(water_type), intent(in) :: group
      logical, allocatable :: inside(:)
      character(len=:), allocatable :: names
      names = ''
      if (allocated(group%region)) names = group%region
      if (allocated(parameters%regions)) then
         inside = blocks_of_region(blocks, parameters%regions, names)
      else
         allocate (inside(blocks%n_blocks), source=.true.)
      end if
   end function blocks_of_group

   !> Joint materials that a group names; all of them when it names none.
   pure function named_joints(parameters, group) result(named)
      type(parameters_type), intent(in) :: parameters
      type(water_type), intent(in) :: group
      logical, allocatable :: named(:)          !! (joint materials)
      character(len=:), allocatable :: word, names
      integer :: i, k
      names = ''
      if (allocated(group%joints)) names = group%joints
      allocate (named(size(parameters%joint_materials)), source=len_trim(names) == 0)
      if (len_trim(names) == 0 .or. same_name(names, 'none')) return
      do k = 1, count_words(names)
         word = word_of(names, k)
         do i = 1, size(named)
            if (material_number(word) == i) named(i) = .true.
            if (.not. allocated(parameters%joint_materials(i)%name)) cycle
            if (same_name(word, parameters%joint_materials(i)%name)) named(i) = .true.
         end do
      end do
   end function named_joints

   !> A note on what a group wets at the start, or the warning that it wets nothing at any time.
   subroutine report(self, blocks, group, g, messages)
      class(water_family_type), intent(in) :: self
      type(block_system_type), intent(in) :: blocks
      type(water_type), intent(in) :: group
      integer, intent(in) :: g
      type(diagnostics_type), intent(inout) :: messages
      type(water_scratch_type) :: scratch
      real(wp) :: rises(2), largest, here(2)
      integer :: i, wet(2), time
      rises = rise_of(group, 0.0_wp)
      if (allocated(group%level)) then
         if (size(group%level, 2) > 0) rises(2) = max(rises(1), maxval(group%level(2, :)))
      end if
      wet = 0
      largest = 0
      do i = 1, size(self%stretches)
         if (.not. self%wets(g, i)) cycle
         associate (s => self%stretches(i), p => blocks%vertices(:, self%stretches(i)%vertices(1)), &
                    q => blocks%vertices(:, self%stretches(i)%vertices(2)))
            do time = 1, 2
               call self%pressure(g)%largest_on(p, q, s%ends, rises(time), scratch, here(time))
               if (here(time) > 0) wet(time) = wet(time) + 1
            end do
            largest = max(largest, here(1))
         end associate
      end do
      if (count(self%wets(g, :)) == 0) then
         call messages%add(severity%warning, title_of(group, g)//' wets nothing: no edge belongs to its joints, '// &
                           'surfaces and region', group%origin)
      else if (maxval(wet) == 0) then
         call messages%add(severity%warning, title_of(group, g)//' wets nothing: the pressure is 0 on all '// &
                           counted(count(self%wets(g, :)), 'piece')//' of edges of its joints, '// &
                           'surfaces and region', group%origin)
      else
         call messages%add(severity%note, title_of(group, g)//': '//counted(wet(1), 'piece')// &
                           ' of edges under water at the start, largest pressure '// &
                           to_string(largest, 6), group%origin)
      end if
   end subroutine report

   !> The warning that blocks reach beyond the points at which the pressure is given.
   subroutine report_beyond(self, blocks, parameters, g, messages)
      class(water_family_type), intent(in) :: self
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      integer, intent(in) :: g
      type(diagnostics_type), intent(inout) :: messages
      real(wp) :: margin
      integer :: i, n, first
      n = 0
      first = 0
      margin = max(blocks%edge_node_distance, 1.0e-6_wp*parameters%w0)
      if (.not. allocated(self%pressure(g)%field)) return
      do i = 1, size(self%stretches)
         if (.not. self%wets(g, i)) cycle
         if (self%pressure(g)%covers(blocks%vertices(:, self%stretches(i)%vertices(1)), margin)) cycle
         n = n + 1
         if (first == 0) first = self%stretches(i)%vertices(1)
      end do
      if (n > 0) call messages%add(severity%warning, title_of(parameters%water(g), g)//': '//counted(n, 'piece')// &
         ' of edges begin beyond the points of pressure_file, the first at ('// &
         to_string(blocks%vertices(1, first), 6)//', '//to_string(blocks%vertices(2, first), 6)// &
         '); the pressure there goes on as in the nearest triangle', parameters%water(g)%origin)
   end subroutine report_beyond

   !> Rise of the table of a group.
   pure real(wp) function rise_of(group, t)
      type(water_type), intent(in) :: group
      real(wp), intent(in) :: t                 !! [time]
      real(wp) :: value(1)
      rise_of = 0
      if (.not. allocated(group%level)) return
      value = table_value(group%level, t)
      rise_of = value(1)
   end function rise_of

   !> Choose the groups that act: names, commas between them; empty: all.
   pure subroutine choose(self, water, names)
      class(water_family_type), intent(inout) :: self
      type(water_type), allocatable, intent(in) :: water(:)
      character(len=*), intent(in) :: names
      integer :: g
      self%chosen = names
      self%group = 0
      do g = 1, size(self%pressure)
         if (.not. acts(water(g), names)) cycle
         where (self%wets(g, :)) self%group = g
      end do
   end subroutine choose

   !> Groups that act in the step.
   subroutine begin(self, context)
      class(water_family_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      if (self%chosen /= context%water) call self%choose(context%parameters%water, context%water)
   end subroutine begin

   !> Pressure on all wetted stretches.
   subroutine add_to_blocks(self, context, equations)
      class(water_family_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(equations_type), intent(inout) :: equations
      type(water_scratch_type) :: scratch
      real(wp), allocatable :: rises(:)
      integer :: i
      if (size(self%stretches) == 0) return
      rises = all_rises(self, context)
      !$omp parallel do default(none) shared(self, context, rises) private(i, scratch) schedule(static) &
      !$omp if (size(self%stretches) > parallel_blocks)
      do i = 1, size(self%stretches)
         call find_load(self, i, context, context%moving(self%stretches(i)%block), rises, scratch, self%load(:, i))
      end do
      !$omp end parallel do
      ! one after the other, so that the order of the sum does not depend on the number of threads
      do i = 1, size(self%stretches)
         associate (b => self%stretches(i)%block)
            equations%block_load(:, b) = equations%block_load(:, b) + self%load(:, i)
            equations%block_magnitude(:, b) = equations%block_magnitude(:, b) + abs(self%load(:, i))
         end associate
      end do
   end subroutine add_to_blocks

   !> Rises of the tables of all groups at the end of the step.
   pure function all_rises(self, context) result(rises)
      type(water_family_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      real(wp) :: rises(size(self%pressure))
      integer :: g
      do g = 1, size(rises)
         rises(g) = rise_of(context%parameters%water(g), context%state%time + context%dt)
      end do
   end function all_rises

   !> Load of the pressure on a stretch, at the place that it has in the middle of the step.
   pure subroutine find_load(self, i, context, block, rises, scratch, load)
      type(water_family_type), intent(in) :: self
      integer, intent(in) :: i
      type(step_context_type), intent(in) :: context
      type(moving_block_type), intent(in) :: block    !! with the motion of the step
      real(wp), intent(in) :: rises(:)                !! (groups)
      type(water_scratch_type), intent(inout) :: scratch
      real(wp), intent(out) :: load(6)
      real(wp) :: p(2), q(2), normal(2), shares(2)
      load = 0
      if (self%group(i) == 0 .or. .not. context%state%active(self%stretches(i)%block)) return
      associate (s => self%stretches(i), start => context%state%vertices(:, self%stretches(i)%vertices))
         p = start(:, 1) + 0.5_wp*mean_displacement(block%d, start(:, 1), block)
         q = start(:, 2) + 0.5_wp*mean_displacement(block%d, start(:, 2), block)
         call self%pressure(self%group(i))%end_shares(p, q, s%ends, rises(self%group(i)), scratch, shares)
         if (.not. any(abs(shares) > 0)) return
         ! outward, as long as the edge
         normal = [q(2) - p(2), p(1) - q(1)]
         load = mean_load(-shares(1)*normal, start(:, 1), block) + mean_load(-shares(2)*normal, start(:, 2), block)
      end associate
   end subroutine find_load

   !> Loads that the expected motion gives otherwise than the solution.
   subroutine measure_placement(self, context, equations)
      class(water_family_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(equations_type), intent(inout) :: equations
      real(wp), allocatable :: rises(:)
      type(water_scratch_type) :: scratch
      real(wp), allocatable :: off(:, :)
      real(wp) :: scale
      integer :: i, b
      if (size(self%stretches) == 0) return
      rises = all_rises(self, context)
      allocate (off(2, size(self%stretches)))
      !$omp parallel do default(none) shared(self, context, equations, rises, off) private(i, scratch) &
      !$omp schedule(static) if (size(self%stretches) > parallel_blocks)
      do i = 1, size(self%stretches)
         call find_off_load(self, i, context, equations%x(:, self%stretches(i)%block), rises, scratch, off(:, i))
      end do
      !$omp end parallel do
      do i = 1, size(self%stretches)
         b = self%stretches(i)%block
         ! not the load, which is nearly nothing where a block floats
         scale = norm2(equations%block_magnitude(1:2, b))
         if (scale > 0) equations%block_off(b) = max(equations%block_off(b), norm2(off(:, i))/scale)
      end do
   end subroutine measure_placement

   !> Force of a stretch at the place of a motion d less the force in the equations.
   pure subroutine find_off_load(self, i, context, d, rises, scratch, off)
      type(water_family_type), intent(in) :: self
      integer, intent(in) :: i
      type(step_context_type), intent(in) :: context
      real(wp), intent(in) :: d(6)
      real(wp), intent(in) :: rises(:)                !! (groups)
      type(water_scratch_type), intent(inout) :: scratch
      real(wp), intent(out) :: off(2)
      real(wp) :: load(6)
      integer :: b
      b = self%stretches(i)%block
      call find_load(self, i, context, new_moving_block(context%state%centroid(:, b), d), rises, scratch, load)
      off = load(1:2) - self%load(1:2, i)
   end subroutine find_off_load

   !> Work of the pressure.
   subroutine add_energies(self, context, d, balance)
      class(water_family_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      real(wp), intent(in), contiguous :: d(:, :)
      class(energy_balance_type), intent(inout) :: balance
      integer :: i
      do i = 1, size(self%stretches)
         call balance%add(energy%external, dot_product(self%load(:, i), d(:, self%stretches(i)%block)))
      end do
      associate (unused => context%dt)
      end associate
   end subroutine add_energies

   !> Pressure on the moved blocks. No equilibrium while a table rises or falls.
   subroutine add_forces(self, context, forces)
      class(water_family_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(block_forces_type), intent(inout) :: forces
      type(water_scratch_type) :: scratch
      real(wp), allocatable :: rises(:)
      real(wp) :: load(6)
      integer :: i, b
      if (size(self%pressure) == 0) return
      rises = all_rises(self, context)
      do i = 1, size(self%stretches)
         b = self%stretches(i)%block
         call find_load(self, i, context, new_moving_block(context%state%centroid(:, b), spread(0.0_wp, 1, 6)), rises, &
                        scratch, load)
         if (any(abs(load) > 0)) call forces%add_load(b, load(1:3))
      end do
      do i = 1, size(rises)
         if (.not. acts(context%parameters%water(i), context%water)) cycle
         if (abs(rises(i) - rise_of(context%parameters%water(i), context%state%time)) > 0) forces%driven = .true.
      end do
   end subroutine add_forces

end module rockdda_interaction_water
