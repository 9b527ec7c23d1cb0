! SPDX-License-Identifier: MIT
!> Blocks that stages place and excavate, and the forces that are held when they go.
!>
!> Which blocks belong to the regions of stages is found at the start of the run, and kept.
module rockdda_stepping_construction
   use rockdda_base_kinds, only : wp
   use rockdda_geometry_box_pairs, only : box_pairs_work_type, find_box_pairs
   use rockdda_geometry_common_area, only : shape_type, set_polygon, common_area
   use rockdda_geometry_polygons, only : polygon_properties
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_regions, only : blocks_of_region
   use rockdda_model_stage_options, only : is_given
   use rockdda_model_state, only : block_state_type, energy
   use rockdda_contact_table, only : contact_table_type, contact_state
   use rockdda_contact_view, only : force_on_a
   use rockdda_interaction_balance, only : energy_balance_type
   use rockdda_interaction_bolts, only : bolt_force
   use rockdda_interaction_held_forces, only : held_forces_type
   use rockdda_stepping_lodging, only : lodging_type
   implicit none
   private
   public :: construction_type

   !> Blocks lie on each other with more than this share of their area.
   real(wp), parameter :: least_share = 0.01_wp

   !> Part of the state of a run.
   type :: construction_type
      integer, allocatable :: excavated(:, :)   !! (nb, stages) 1: the block is taken out when the stage begins
      integer, allocatable :: placed(:, :)      !! (nb, stages) 1: it is absent until then
      integer, allocatable :: changed(:, :)     !! (nb, changes) 1: it belongs to the regions of the change
      logical, allocatable :: newborn(:)        !! (nb) placed, and without a step since
      integer, allocatable :: overlaps(:, :)    !! (2, n) blocks placed for the last step, and those they lie on
      type(lodging_type) :: lodging             !! blocks inside each other, and what has been reported
   contains
      procedure :: init
      procedure :: make_room
      procedure :: absent_at_start
      procedure :: comes_back
      procedure :: place
      procedure :: excavate
   end type construction_type

contains

   !> Blocks of all regions. Those that a stage places before any takes them out are not there at the start.
   subroutine init(self, blocks, parameters, state)
      class(construction_type), intent(inout) :: self
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(block_state_type), intent(inout) :: state
      integer :: i, n
      if (allocated(self%newborn)) deallocate (self%newborn, self%excavated, self%placed, self%changed)
      n = 0
      if (allocated(parameters%changes)) n = size(parameters%changes)
      allocate (self%newborn(blocks%n_blocks), source=.false.)
      allocate (self%excavated(blocks%n_blocks, size(parameters%stages)), &
                self%placed(blocks%n_blocks, size(parameters%stages)), self%changed(blocks%n_blocks, n), source=0)
      if (.not. allocated(parameters%regions)) return
      do i = 1, size(parameters%stages)
         associate (stage => parameters%stages(i))
            if (is_given(stage%excavate)) self%excavated(:, i) = mask(stage%excavate)
            if (is_given(stage%place)) self%placed(:, i) = mask(stage%place)
         end associate
      end do
      do i = 1, n
         if (is_given(parameters%changes(i)%region)) self%changed(:, i) = mask(parameters%changes(i)%region)
      end do
      do i = 1, blocks%n_blocks
         if (self%absent_at_start(i)) call retire_block(state, i)
      end do

   contains

      !> 1 for the blocks of some regions.
      function mask(names)
         character(len=*), intent(in) :: names
         integer :: mask(blocks%n_blocks)
         mask = merge(1, 0, blocks_of_region(blocks, parameters%regions, names))
      end function mask

   end subroutine init

   !> Room for more blocks, which belong to no region.
   pure subroutine make_room(self, n_blocks)
      class(construction_type), intent(inout) :: self
      integer, intent(in) :: n_blocks
      integer :: n
      n = n_blocks - size(self%newborn)
      if (n == 0) return
      self%newborn = [self%newborn, spread(.false., 1, n)]
      self%excavated = longer(self%excavated)
      self%placed = longer(self%placed)
      self%changed = longer(self%changed)

   contains

      !> A table with more rows, of zeros.
      pure function longer(table)
         integer, intent(in) :: table(:, :)
         integer :: longer(n_blocks, size(table, 2))
         longer = 0
         longer(:size(table, 1), :) = table
      end function longer

   end subroutine make_room

   !> Is a block absent until a stage places it? Not when a stage takes it out before.
   pure logical function absent_at_start(self, i)
      class(construction_type), intent(in) :: self
      integer, intent(in) :: i
      integer :: s
      absent_at_start = .false.
      do s = 1, size(self%placed, 2)
         absent_at_start = self%placed(i, s) > 0
         if (absent_at_start .or. self%excavated(i, s) > 0) return
      end do
   end function absent_at_start

   !> Has a block been taken out and placed again by a stage?
   pure logical function comes_back(self, i, stage)
      class(construction_type), intent(in) :: self
      integer, intent(in) :: i, stage
      integer :: s
      logical :: gone
      comes_back = .false.
      gone = .false.
      do s = 1, min(stage, size(self%placed, 2))
         comes_back = comes_back .or. (gone .and. self%placed(i, s) > 0)
         gone = gone .or. self%excavated(i, s) > 0
      end do
   end function comes_back

   !> A block that is not there has neither stress nor velocity.
   pure subroutine retire_block(state, i)
      type(block_state_type), intent(inout) :: state
      integer, intent(in) :: i
      state%active(i) = .false.
      state%stress(:, i) = 0
      state%velocity(:, i) = 0
   end subroutine retire_block

   !> Place the blocks of a stage where they were drawn, free of stress. Bolts with an end in them have their pretension
   !> from now on.
   subroutine place(self, stage, blocks, parameters, state, balance)
      class(construction_type), intent(inout) :: self
      integer, intent(in) :: stage
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(block_state_type), intent(inout) :: state
      class(energy_balance_type), intent(inout) :: balance
      real(wp) :: stored
      integer :: i, l
      do i = 1, blocks%n_blocks
         if (self%placed(i, stage) > 0 .and. .not. state%active(i) .and. self%comes_back(i, stage)) &
            call draw_again(parameters%block_materials(blocks%block_material(i))%density)
         self%newborn(i) = self%newborn(i) .or. (self%placed(i, stage) > 0 .and. .not. state%active(i))
         state%active(i) = state%active(i) .or. self%placed(i, stage) > 0
      end do
      do l = 1, blocks%bolts%n
         if (.not. any(on(blocks%bolts%blocks(:, l), self%newborn)) .or. &
             any(on(blocks%bolts%blocks(:, l), .not. state%active))) cycle
         state%bolt_plastic(l) = state%bolt_elongation(l)
         stored = 0.5_wp*blocks%bolts%pretension(l)**2/blocks%bolts%stiffness(l)
         balance%bolt_energy = balance%bolt_energy + stored
         call balance%add(energy%external, stored)
      end do
      call find_overlaps()

   contains

      !> Blocks that have moved to where others are placed: pairs that have more than 1 % of the smaller one in common.
      subroutine find_overlaps()
         type(box_pairs_work_type) :: work
         real(wp) :: boxes(4, blocks%n_blocks)
         integer, allocatable :: pairs(:, :)
         integer :: n, n_found, p, k, m
         if (.not. any(self%placed(:, stage) > 0)) return
         do k = 1, blocks%n_blocks
            associate (v => state%vertices(:, blocks%vertex_offset(k) + 1:blocks%vertex_offset(k + 1)))
               boxes(:, k) = [minval(v, dim=2), maxval(v, dim=2)]
            end associate
         end do
         call find_box_pairs(boxes, 0.0_wp, pairs, n, work)
         n_found = 0
         do p = 1, n
            k = pairs(1, p)
            m = pairs(2, p)
            if (max(k, m) > blocks%n_blocks - blocks%n_segments) cycle
            if (.not. (state%active(k) .and. state%active(m)) .or. (self%newborn(k) .eqv. self%newborn(m))) cycle
            if (.not. lie_on(k, m)) cycle
            n_found = n_found + 1
            ! the placed block first
            pairs(:, n_found) = merge([k, m], [m, k], self%newborn(k))
         end do
         self%overlaps = pairs(:, :n_found)
      end subroutine find_overlaps

      !> Have two blocks more than a small share of the smaller one's area in common?
      pure logical function lie_on(k, m)
         integer, intent(in) :: k, m
         type(shape_type) :: shape(1)
         call set_polygon(shape(1), state%vertices(:, blocks%vertex_offset(m) + 1:blocks%vertex_offset(m + 1)))
         lie_on = common_area(state%vertices(:, blocks%vertex_offset(k) + 1:blocks%vertex_offset(k + 1)), shape) > &
                  least_share*min(state%area(k), state%area(m))
      end function lie_on

      !> A block that had been taken out as it was drawn, with its points and ends of bolts.
      subroutine draw_again(density)
         real(wp), intent(in) :: density
         integer :: l, p, side
         associate (first => blocks%vertex_offset(i) + 1, last => blocks%vertex_offset(i + 1))
            state%vertices(:, first:last) = blocks%vertices(:, first:last)
            call polygon_properties(state%vertices(:, first:last), state%area(i), state%centroid(:, i), &
                                    state%moments(:, i))
         end associate
         state%mass(i) = density*state%area(i)
         state%rotation(i) = 0
         do p = 1, blocks%fixed%n
            if (blocks%fixed%block(p) == i) state%fixed_position(:, p) = blocks%fixed%position(:, p)
         end do
         do p = 1, blocks%loading%n
            if (blocks%loading%block(p) == i) state%loading_position(:, p) = blocks%loading%position(:, p)
         end do
         do p = 1, blocks%measured%n
            if (blocks%measured%block(p) /= i) cycle
            state%measured_position(:, p) = blocks%measured%position(:, p)
            state%measured_from(:, p) = [state%measured_position(:, p), 0.0_wp]
         end do
         do l = 1, blocks%bolts%n
            do side = 1, 2
               if (blocks%bolts%blocks(side, l) == i) state%bolt_ends(2*side - 1:2*side, l) = &
                  blocks%bolts%ends(2*side - 1:2*side, l)
            end do
            state%bolt_elongation(l) = norm2(state%bolt_ends(3:4, l) - state%bolt_ends(1:2, l)) &
                                       - norm2(blocks%bolts%ends(3:4, l) - blocks%bolts%ends(1:2, l))
         end do
      end subroutine draw_again

   end subroutine place

   !> Take out the blocks of a stage; the forces that they gave are held. Their energy, and that of bolts that end in
   !> them, is discarded; that of their contacts and supports in the next step.
   subroutine excavate(self, stage, blocks, contacts, strain_and_kinetic, state, held, balance, first)
      class(construction_type), intent(in) :: self
      integer, intent(in) :: stage
      type(block_system_type), intent(in) :: blocks
      type(contact_table_type), intent(in) :: contacts         !! of the last step
      real(wp), intent(in) :: strain_and_kinetic(:)            !! (nb) energy of each block
      type(block_state_type), intent(inout) :: state
      type(held_forces_type), intent(inout) :: held
      class(energy_balance_type), intent(inout) :: balance
      integer, intent(out) :: first                            !! of the forces that are new
      logical :: goes(blocks%n_blocks)
      integer :: i
      goes = self%excavated(:, stage) > 0 .and. state%active
      call held%drop(state%active .and. .not. goes)
      first = held%n + 1
      if (.not. any(goes)) return
      call hold_contact_forces()
      call hold_bolt_forces()
      do i = 1, size(goes)
         if (.not. goes(i)) cycle
         call balance%add(energy%discarded, strain_and_kinetic(i))
         call retire_block(state, i)
      end do

   contains

      !> Hold the forces of bolts between a block that goes and one that stays.
      subroutine hold_bolt_forces()
         real(wp) :: along(2), force, length
         integer :: l, side
         do l = 1, blocks%bolts%n
            associate (pair => blocks%bolts%blocks(:, l), ends => state%bolt_ends(:, l), k => blocks%bolts%stiffness(l))
               if (.not. any(on(pair, goes)) .or. any(on(pair, .not. state%active))) cycle
               force = bolt_force(k, blocks%bolts%pretension(l), state%bolt_elongation(l), state%bolt_plastic(l))
               balance%bolt_energy = balance%bolt_energy - 0.5_wp*force**2/k
               call balance%add(energy%discarded, 0.5_wp*force**2/k)
               if (pair(1) == pair(2)) cycle
               along = ends(3:4) - ends(1:2)
               length = norm2(along)
               if (.not. length > 0) cycle
               do side = 1, 2
                  if (pair(side) < 1) cycle
                  if (goes(pair(side))) cycle
                  call held%hold(pair(side), ends(2*side - 1:2*side), merge(force, -force, side == 1)*along/length)
               end do
            end associate
         end do
      end subroutine hold_bolt_forces

      !> Hold the forces of contacts between a block that goes and one that stays.
      subroutine hold_contact_forces()
         real(wp) :: force(2), point(2)
         integer :: c
         do c = 1, contacts%n
            if (contacts%state(c) == contact_state%open) cycle
            associate (a => contacts%block_a(c), b => contacts%block_b(c))
               if (goes(a) .eqv. goes(b)) cycle
               force = force_on_a(contacts, c)
               point = contacts%point(:, c)
               if (contacts%station(c) == 0) point = state%vertices(:, contacts%vertex(c))
               if (goes(a)) call held%hold(b, point, -force)
               if (goes(b)) call held%hold(a, point, force)
            end associate
         end do
      end subroutine hold_contact_forces

   end subroutine excavate

   !> Is a block of an end one of a set? Not the fixed outside.
   pure function on(pair, set)
      integer, intent(in) :: pair(2)
      logical, intent(in) :: set(:)
      logical :: on(2)
      integer :: side
      on = .false.
      do side = 1, 2
         if (pair(side) > 0) on(side) = set(pair(side))
      end do
   end function on

end module rockdda_stepping_construction
