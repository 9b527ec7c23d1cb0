! SPDX-License-Identifier: MIT
!> Water in joints and on free edges: its pressure on the edges of blocks.
!>
!> A stretch of an edge is wetted by a group when one of its joint materials is named, or, where it faces no other
!> block, when the group wets surfaces. Both sides of a joint are stretches of two
!> edges, each of which moves with its block. A stretch is wetted by the last group
!> that acts.
!>
!> The pressure is that of the place of the edge in the middle of the step, by the motion that is expected of the block
!> (an oscillation in water gains no energy by that), and of the level of the table at the end of the step.
!>
!> Stretches of the edges of blocks at the start: which of them lie on an edge of another block, and which are free.
!>
!>           +-----+             the upper edge of the lower block has three stretches: free, a joint, free
!>           |     |
!>     +-----+-----+------+
!>     | free joint  free |
!>
!> Stretches belong to the material of an edge: they move with it, and do not change.
module rockdda_interaction_water
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_base_parallel, only : parallel_blocks
   use rockdda_base_strings, only : counted, to_string
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_state, only : energy
   use rockdda_model_water_check, only : acts, title_of
   use rockdda_model_options, only : water_type
   use rockdda_model_regions, only : blocks_of_region, count_words, material_number, same_name, word_of
   use rockdda_model_units, only : unit_system_type, unit_system
   use rockdda_interaction_attempt, only : attempt_type
   use rockdda_interaction_balance, only : energy_balance_type
   use rockdda_interaction_block_forces, only : block_forces_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_equations, only : equations_type
   use rockdda_interaction_interaction, only : interaction_type
   use rockdda_interaction_water_pressure, only : water_pressure_type, rise_of, water_scratch_type, new_water_pressure
   use rockdda_interaction_finite_rotation, only : moving_block_type, new_moving_block, mean_load, mean_displacement
   use rockdda_base_sorting, only : sorted_order
   use rockdda_geometry_box_pairs, only : box_pairs_work_type, find_box_pairs
   use rockdda_interaction_boundary_edges, only : common_stretch, next_vertex
   implicit none
   private
   public :: water_family_type, edge_stretch_type, find_stretches

   type :: edge_stretch_type
      integer :: block = 0
      integer :: vertices(2) = 0     !! of the edge
      real(wp) :: ends(2) = 0        !! of the stretch, shares of the edge's length
      integer :: joints(2) = 0       !! materials of the edge and of the one on which the stretch lies, 0: it is free
   end type edge_stretch_type

   !> Where an edge lies on another.
   type :: cover_type
      integer :: edge = 0            !! by its first vertex
      integer :: joint = 0           !! material of the other
      real(wp) :: ends(2) = 0        !! shares
   end type cover_type

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
      procedure :: place
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
   subroutine place(self, context, attempt, equations)
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
   end subroutine place

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

   !> Loads of all stretches: for the motion that is expected of their blocks, for another motion, or, with `at_rest`,
   !> for none. Zero where no group wets the stretch, or its block is not there.
   subroutine find_loads(stretches, group, pressure, context, attempt, loads, motion, at_rest)
      type(edge_stretch_type), intent(in) :: stretches(:)
      integer, intent(in) :: group(:)                     !! that wets each stretch, 0: none does
      type(water_pressure_type), intent(in) :: pressure(:)   !! (groups)
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      real(wp), intent(out), contiguous :: loads(:, :)    !! (6, stretches)
      real(wp), intent(in), contiguous, optional :: motion(:, :)   !! (6, nb)
      logical, intent(in), optional :: at_rest
      type(water_scratch_type) :: scratch
      type(moving_block_type) :: block
      real(wp) :: rises(size(pressure)), d(6)
      integer :: i
      logical :: is_given
      d = 0
      is_given = present(motion) .or. present(at_rest)
      rises = all_rises(size(pressure))
      !$omp parallel do default(none) shared(stretches, group, pressure, context, attempt, loads) &
      !$omp shared(motion, is_given, rises) &
      !$omp private(i, block, scratch) firstprivate(d) schedule(static) if (size(stretches) > parallel_blocks)
      do i = 1, size(stretches)
         associate (b => stretches(i)%block)
            loads(:, i) = 0
            if (group(i) == 0 .or. .not. context%state%active(b)) cycle
            if (present(motion)) d = motion(:, b)
            if (is_given) then
               block = new_moving_block(context%state%centroid(:, b), d)
            else
               block = attempt%moving(b)
            end if
            call find_load(stretches(i), pressure(group(i)), rises(group(i)), block, scratch, loads(:, i))
         end associate
      end do
      !$omp end parallel do

   contains

      !> Load of the pressure on a stretch, at the place that it has in the middle of the step.
      pure subroutine find_load(stretch, pressure, rise, block, scratch, load)
         type(edge_stretch_type), intent(in) :: stretch
         type(water_pressure_type), intent(in) :: pressure
         real(wp), intent(in) :: rise                    !! of the table [length]
         type(moving_block_type), intent(in) :: block    !! with the motion of the step
         type(water_scratch_type), intent(inout) :: scratch
         real(wp), intent(out) :: load(6)
         real(wp) :: p(2), q(2), normal(2), shares(2)
         load = 0
         associate (start => context%state%vertices(:, stretch%vertices))
            p = start(:, 1) + 0.5_wp*mean_displacement(block%d, start(:, 1), block)
            q = start(:, 2) + 0.5_wp*mean_displacement(block%d, start(:, 2), block)
            call pressure%end_shares(p + context%state%datum, q + context%state%datum, stretch%ends, rise, scratch, &
                                     shares)
            if (.not. any(abs(shares) > 0)) return
            ! outward, as long as the edge
            normal = [q(2) - p(2), p(1) - q(1)]
            load = mean_load(-shares(1)*normal, start(:, 1), block) + mean_load(-shares(2)*normal, start(:, 2), block)
         end associate
      end subroutine find_load

      !> Rises of the tables of all groups at the end of the step.
      pure function all_rises(n) result(rises)
         integer, intent(in) :: n          !! groups
         real(wp) :: rises(n)
         integer :: g
         do g = 1, n
            rises(g) = rise_of(context%parameters%water(g), attempt%load_time(context))
         end do
      end function all_rises

   end subroutine find_loads

   !> The stretches that some group wets. Warnings: groups that wet nothing. Error: points that make no triangle. The
   !> groups have been checked (rockdda_model_water_check).
   subroutine find_wetted_edges(blocks, parameters, stretches, wets, pressure, messages)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(edge_stretch_type), allocatable, intent(out) :: stretches(:)
      logical, allocatable, intent(out) :: wets(:, :)                     !! (groups, stretches)
      type(water_pressure_type), allocatable, intent(out) :: pressure(:)  !! (groups)
      type(diagnostics_type), intent(inout) :: messages
      type(edge_stretch_type), allocatable :: all_stretches(:)
      logical, allocatable :: all_wets(:, :)
      integer :: g, n
      n = 0
      if (allocated(parameters%water)) n = size(parameters%water)
      allocate (pressure(n))
      allocate (all_stretches(0))
      if (n > 0) call find_stretches(blocks, max(blocks%edge_node_distance, 1.0e-9_wp*parameters%w0), &
                                     all_stretches)
      allocate (all_wets(n, size(all_stretches)))
      do g = 1, n
         call new_water_pressure(parameters%water(g), pressure(g))
         if (.not. pressure(g)%is_there()) then
            call messages%add(severity%error, title_of(parameters%water(g), g)//': pressure_file: the points make '// &
                              'no triangle: they lie on a line, or two are the same', parameters%water(g)%origin)
            return
         end if
         all_wets(g, :) = wetted_by(parameters%water(g), all_stretches)
      end do
      stretches = pack(all_stretches, any(all_wets, dim=1))
      allocate (wets(n, size(stretches)))
      do g = 1, n
         wets(g, :) = pack(all_wets(g, :), any(all_wets, dim=1))
         call report(wets(g, :), pressure(g), parameters%water(g), unit_system(parameters%units))
         call report_beyond(wets(g, :), pressure(g))
      end do

   contains

      !> A note on what a group wets at the start, or the warning that it wets nothing at any time.
      subroutine report(wets, pressure, group, system)
         logical, intent(in) :: wets(:)                 !! (stretches)
         type(water_pressure_type), intent(in) :: pressure
         type(water_type), intent(in) :: group
         type(unit_system_type), intent(in) :: system
         type(water_scratch_type) :: scratch
         real(wp) :: rises(2), largest, here(2)
         integer :: i, wet(2), time
         rises = rise_of(group, 0.0_wp)
         if (allocated(group%level)) then
            if (size(group%level, 2) > 0) rises(2) = max(rises(1), maxval(group%level(2, :)))
         end if
         wet = 0
         largest = 0
         do i = 1, size(stretches)
            if (.not. wets(i)) cycle
            associate (s => stretches(i), p => blocks%vertices(:, stretches(i)%vertices(1)), &
                       q => blocks%vertices(:, stretches(i)%vertices(2)))
               do time = 1, 2
                  call pressure%largest_on(p, q, s%ends, rises(time), scratch, here(time))
                  if (here(time) > 0) wet(time) = wet(time) + 1
               end do
               largest = max(largest, here(1))
            end associate
         end do
         if (count(wets) == 0) then
            call messages%add(severity%warning, title_of(group, g)//' wets nothing: no edge belongs to its joints, '// &
                              'surfaces and region', group%origin)
         else if (maxval(wet) == 0) then
            call messages%add(severity%warning, title_of(group, g)//' wets nothing: the pressure is 0 on all '// &
                              counted(count(wets), 'piece')//' of edges of its joints, '// &
                              'surfaces and region', group%origin)
         else
            call messages%add(severity%note, title_of(group, g)//': '//counted(wet(1), 'piece')// &
                              ' of edges under water at the start, largest pressure '// &
                              system%shown(largest, 'stress', 6), group%origin)
         end if
      end subroutine report

      !> The warning that blocks reach beyond the points at which the pressure is given.
      subroutine report_beyond(wets, pressure)
         logical, intent(in) :: wets(:)                 !! (stretches)
         type(water_pressure_type), intent(in) :: pressure
         real(wp) :: margin
         integer :: i, n, first
         n = 0
         first = 0
         margin = max(blocks%edge_node_distance, 1.0e-6_wp*parameters%w0)
         if (.not. allocated(pressure%field)) return
         do i = 1, size(stretches)
            if (.not. wets(i)) cycle
            if (pressure%covers(blocks%vertices(:, stretches(i)%vertices(1)), margin)) cycle
            n = n + 1
            if (first == 0) first = stretches(i)%vertices(1)
         end do
         if (n > 0) call messages%add(severity%warning, title_of(parameters%water(g), g)//': '//counted(n, 'piece')// &
            ' of edges begin beyond the points of pressure_file, the first at ('// &
            to_string(blocks%vertices(1, first), 6)//', '//to_string(blocks%vertices(2, first), 6)// &
            '); the pressure there continues as in the nearest triangle', parameters%water(g)%origin)
      end subroutine report_beyond

      !> Which stretches does a group wet?
      pure function wetted_by(group, stretches) result(wets)
         type(water_type), intent(in) :: group
         type(edge_stretch_type), intent(in) :: stretches(:)
         logical :: wets(size(stretches))
         logical :: inside(blocks%n_blocks), joints(size(parameters%joint_materials))
         integer :: i
         inside = blocks_of_group(group)
         joints = named_joints(group)
         do i = 1, size(stretches)
            associate (s => stretches(i))
               wets(i) = group%surfaces
               if (s%joints(2) > 0) wets(i) = any(joints(s%joints))
               wets(i) = wets(i) .and. inside(s%block)
            end associate
         end do
      end function wetted_by

      !> Blocks that a group names.
      pure function blocks_of_group(group) result(inside)
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
      pure function named_joints(group) result(named)
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

   end subroutine find_wetted_edges

   !> All stretches, by blocks and edges. Bridges to islands have none.
   pure subroutine find_stretches(blocks, tolerance, stretches)
      type(block_system_type), intent(in) :: blocks
      real(wp), intent(in) :: tolerance          !! e0: shorter stretches count to their neighbours [length]
      type(edge_stretch_type), allocatable, intent(out) :: stretches(:)
      type(edge_stretch_type), allocatable :: more(:)
      type(cover_type), allocatable :: covers(:)
      integer, allocatable :: order(:)
      real(wp) :: least
      integer :: b, k, n, first, last
      call find_covers(blocks, tolerance, covers)
      allocate (order, source=sorted_order(covers%edge))
      allocate (stretches(blocks%n_vertices() + 2*size(covers)))
      n = 0
      last = 0
      do b = 1, blocks%n_blocks
         do k = blocks%vertex_offset(b) + 1, blocks%vertex_offset(b + 1)
            first = last + 1
            do while (last < size(covers))
               if (covers(order(last + 1))%edge /= k) exit
               last = last + 1
            end do
            if (blocks%edge_joint(k) == 0) cycle
            least = norm2(blocks%vertices(:, next_vertex(blocks, b, k)) - blocks%vertices(:, k))
            if (.not. least > 0) cycle
            least = min(tolerance/least, 0.5_wp)
            call divide_edge(covers(order(first:last)), least, more)
            more%block = b
            more%vertices(1) = k
            more%vertices(2) = next_vertex(blocks, b, k)
            more%joints(1) = blocks%edge_joint(k)
            stretches(n + 1:n + size(more)) = more
            n = n + size(more)
         end do
      end do
      stretches = stretches(1:n)
   end subroutine find_stretches

   !> Stretches of one edge.
   pure subroutine divide_edge(covers, least, stretches)
      type(cover_type), intent(in) :: covers(:)  !! of the edge
      real(wp), intent(in) :: least              !! share of the shortest stretch
      type(edge_stretch_type), allocatable, intent(out) :: stretches(:)
      real(wp) :: cuts(2*size(covers) + 2), all_cuts(2*size(covers))
      integer :: i, c, n
      all_cuts = [covers%ends(1), covers%ends(2)]
      if (size(covers) > 0) all_cuts = all_cuts(sorted_order(all_cuts))
      n = 1
      cuts(1) = 0
      do i = 1, size(all_cuts)
         if (all_cuts(i) - cuts(n) <= least .or. 1 - all_cuts(i) <= least) cycle
         n = n + 1
         cuts(n) = all_cuts(i)
      end do
      cuts(n + 1) = 1
      allocate (stretches(n))
      do i = 1, n
         stretches(i)%ends = cuts(i:i + 1)
         do c = 1, size(covers)
            if (abs(0.5_wp*(cuts(i) + cuts(i + 1)) - 0.5_wp*sum(covers(c)%ends)) > &
                0.5_wp*(covers(c)%ends(2) - covers(c)%ends(1))) cycle
            stretches(i)%joints(2) = covers(c)%joint
            exit
         end do
      end do
   end subroutine divide_edge

   !> Where edges lie on each other.
   pure subroutine find_covers(blocks, tolerance, covers)
      type(block_system_type), intent(in) :: blocks
      real(wp), intent(in) :: tolerance          !! [length]
      type(cover_type), allocatable, intent(out) :: covers(:)
      type(box_pairs_work_type) :: work
      type(cover_type), allocatable :: more(:)
      real(wp), allocatable :: boxes(:, :)
      real(wp) :: stretch(2)
      integer, allocatable :: pairs(:, :)
      integer :: b, i, j, k, l, n_pairs, n, ends(4)
      allocate (boxes(4, blocks%n_blocks), covers(4*blocks%n_vertices()))
      do b = 1, blocks%n_blocks
         associate (v => blocks%vertices(:, blocks%vertex_offset(b) + 1:blocks%vertex_offset(b + 1)))
            boxes(:, b) = [minval(v, dim=2), maxval(v, dim=2)]
         end associate
      end do
      n = 0
      call find_box_pairs(boxes, tolerance, pairs, n_pairs, work)
      do b = 1, n_pairs
         i = pairs(1, b)
         j = pairs(2, b)
         do k = blocks%vertex_offset(i) + 1, blocks%vertex_offset(i + 1)
            do l = blocks%vertex_offset(j) + 1, blocks%vertex_offset(j + 1)
               if (blocks%edge_joint(k) == 0 .or. blocks%edge_joint(l) == 0) cycle
               ends = [k, next_vertex(blocks, i, k), l, next_vertex(blocks, j, l)]
               stretch = common_stretch(blocks%vertices(:, ends(1)), blocks%vertices(:, ends(2)), &
                                        blocks%vertices(:, ends(3)), blocks%vertices(:, ends(4)), tolerance)
               if (.not. stretch(2) > stretch(1)) cycle
               if (n + 2 > size(covers)) then
                  allocate (more(2*n + 2))
                  more(1:n) = covers(1:n)
                  call move_alloc(more, covers)
               end if
               covers(n + 1) = cover_type(k, blocks%edge_joint(l), stretch/length_of(ends(1:2)))
               ! the other edge runs the other way
               stretch = common_stretch(blocks%vertices(:, ends(3)), blocks%vertices(:, ends(4)), &
                                        blocks%vertices(:, ends(1)), blocks%vertices(:, ends(2)), tolerance)
               covers(n + 2) = cover_type(l, blocks%edge_joint(k), stretch/length_of(ends(3:4)))
               n = n + 2
            end do
         end do
      end do
      covers = covers(1:n)

   contains

      !> Length of an edge.
      pure real(wp) function length_of(vertices)
         integer, intent(in) :: vertices(2)
         length_of = norm2(blocks%vertices(:, vertices(2)) - blocks%vertices(:, vertices(1)))
      end function length_of

   end subroutine find_covers

end module rockdda_interaction_water
