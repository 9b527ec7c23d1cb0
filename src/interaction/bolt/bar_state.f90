! SPDX-License-Identifier: MIT
!> What a bolt with nodes has done at the end of a step, what is shown of it, and what lasts of it in a checkpoint.
module rockdda_interaction_bar_state
   use rockdda_base_kinds, only : wp
   use rockdda_base_state_archive, only : state_archive_type
   use rockdda_model_blocks, only : largest_coordinate
   use rockdda_interaction_bar, only : bar_state_type, respond, accept, copy_state, node_forces
   use rockdda_interaction_bar_bolt, only : bolt_type, find_points, find_forces, dowel_response, energy_of, &
      place_at, is_lost
   implicit none
   private
   public :: node_state, show_nodes_of, show_forces_of, finish_bolt, exchange_bolt

   !> What carries this share of its strength is shown as slipping or yielding, also at rest.
   real(wp), parameter :: at_limit = 1 - 1.0e-6_wp

   !> What a node is at the end of a step.
   type :: node_state_enum
      integer :: absent = 0
      integer :: elastic = 1
      integer :: slipping = 2
      integer :: yielding = 3
      integer :: ruptured = 4
   end type node_state_enum
   type(node_state_enum), parameter :: node_state = node_state_enum()

contains

   !> Place, axial force, slip, largest share of a strength, and state of the nodes of a bolt.
   pure subroutine show_nodes_of(bolt, place, force, slip, use, state)
      type(bolt_type), intent(in) :: bolt                     !! measured between steps
      real(wp), intent(out) :: place(:, :)                    !! (2, nodes) [length]
      real(wp), intent(out) :: force(:), slip(:), use(:)      !! (nodes)
      integer, intent(out) :: state(:)                        !! (nodes) node_state%...
      logical :: lost(bolt%bar%n - 1)
      integer :: e, i, t
      do i = 1, bolt%bar%n
         place(:, i) = place_at(bolt, bolt%bar%place(i))
      end do
      force = 0
      slip = 0
      use = 0
      state = node_state%absent
      if (size(bolt%acting) == 0) return
      force = node_forces(bolt%bar, bolt%response)
      state = node_state%elastic
      lost = is_lost(bolt)
      associate (response => bolt%response)
         do t = 1, size(bolt%bar%node)
            if (bolt%bar%element(t) == 0 .or. .not. bolt%state%held(t)) cycle
            i = bolt%bar%node(t)
            slip(i) = response%w(i) - response%at(t)
            use(i) = max(use(i), abs(response%t(t))/slip_limit(bolt, t))
            if (abs(response%t(t)) >= at_limit*slip_limit(bolt, t)) state(i) = node_state%slipping
         end do
         do i = 1, bolt%bar%n
            e = min(i, bolt%bar%n - 1)
            use(i) = min(1.0_wp, max(use(i), maxval(abs(response%f(max(1, i - 1):e))/bolt%bar%yield(max(1, i - 1):e))))
            if (abs(response%f(e)) >= at_limit*bolt%bar%yield(e)) state(i) = node_state%yielding
            if (all(lost(max(1, i - 1):e))) state(i) = node_state%absent
            if (lost(e) .or. .not. bolt%state%broken(e)) cycle
            state(i) = node_state%ruptured
            use(i) = 1
         end do
      end associate
   end subroutine show_nodes_of

   !> Force at which a tie slips.
   pure real(wp) function slip_limit(bolt, tie)
      type(bolt_type), intent(in) :: bolt
      integer, intent(in) :: tie
      slip_limit = bolt%bar%strength(tie)
      if (bolt%state%weak(tie)) slip_limit = bolt%bar%residual*slip_limit
   end function slip_limit

   !> Largest axial force along a bolt, force at its head, largest force of a dowel; and the stored energy.
   pure subroutine show_forces_of(bolt, largest, head, dowel, stored)
      type(bolt_type), intent(in) :: bolt                     !! measured between steps
      real(wp), intent(out) :: largest, head, dowel, stored
      real(wp) :: force, forces(bolt%bar%n)
      logical :: shears
      integer :: c
      largest = 0
      head = 0
      dowel = 0
      stored = 0
      if (size(bolt%acting) == 0) return
      forces = node_forces(bolt%bar, bolt%response)
      largest = forces(maxloc(abs(forces), 1))
      head = forces(1)
      do c = 1, size(bolt%crossing)
         if (.not. bolt%holds(c)) cycle
         call dowel_response(bolt, bolt%across(c) - bolt%dowel_slip(c), force, shears)
         dowel = max(dowel, abs(force))
      end do
      stored = bolt%stored
   end subroutine show_forces_of

   !> What a bolt does in a step: its outcome.
   pure subroutine finish_bolt(level, bolt)
      real(wp), intent(in) :: level
      type(bolt_type), intent(inout) :: bolt           !! what lasts of it stays
      type(bar_state_type) :: old
      real(wp) :: end(size(bolt%block)), across(size(bolt%crossing)), slip(size(bolt%crossing))
      real(wp) :: work, slipped, yielded, stored(2), freed, dowel, before, more(2)
      logical :: changes, shears
      integer :: c
      if (.not. bolt%is_found) call find_forces(bolt)
      work = dot_product(bolt%chain, bolt%e)/level
      stored(1) = bolt%stored
      across = bolt%across + bolt%shift/level
      slip = bolt%dowel_slip
      call find_points(bolt, bolt%e/level, end)
      call respond(bolt%bar, bolt%state, end, bolt%response, near=.true.)
      bolt%is_found = .false.
      call copy_state(bolt%state, bolt%outcome%state)
      call accept(bolt%bar, bolt%response, bolt%outcome%state, slipped, yielded)
      do c = 1, size(bolt%crossing)
         if (.not. bolt%holds(c)) cycle
         call dowel_response(bolt, bolt%across(c) + bolt%shift(c) - bolt%dowel_slip(c), dowel, shears)
         work = work + dowel*bolt%shift(c)/level
         call dowel_response(bolt, across(c) - bolt%dowel_slip(c), dowel, shears)
         if (.not. shears) cycle
         slip(c) = across(c) - dowel/bolt%dowel_stiffness
         yielded = yielded + dowel*(slip(c) - bolt%dowel_slip(c))
      end do
      work = work/bolt%spacing
      freed = 0
      stored(2) = energy_of(bolt, bolt%response, across, slip)
      changes = .not. same_state(bolt%state, bolt%outcome%state)
      do while (changes .or. any(bolt%response%f_limit /= 0) .or. any(bolt%response%t_limit /= 0))
         ! what has broken or weakened lets the rest of the bolt move at once
         call respond(bolt%bar, bolt%outcome%state, end, bolt%response)
         before = stored(2)
         stored(2) = energy_of(bolt, bolt%response, across, slip)
         if (.not. changes) exit
         call copy_state(bolt%outcome%state, old)
         call accept(bolt%bar, bolt%response, bolt%outcome%state, more(1), more(2))
         slipped = slipped + more(1)
         yielded = yielded + more(2)
         freed = freed + (before - stored(2)) - sum(more)/bolt%spacing
         changes = .not. same_state(old, bolt%outcome%state)
      end do
      bolt%outcome%dowel_slip = slip
      bolt%outcome%work = work
      bolt%outcome%slipped = slipped/bolt%spacing
      bolt%outcome%yielded = yielded/bolt%spacing
      bolt%outcome%stored = stored
      bolt%outcome%freed = freed

   contains

      !> Is nothing more broken or weakened?
      pure logical function same_state(a, b)
         type(bar_state_type), intent(in) :: a, b
         same_state = all(a%broken .eqv. b%broken) .and. all(a%weak .eqv. b%weak)
      end function same_state

   end subroutine finish_bolt

   !> Save or load what lasts of a bolt.
   subroutine exchange_bolt(archive, bolt)
      class(state_archive_type), intent(inout) :: archive     !! in a section of the bolt
      type(bolt_type), intent(inout) :: bolt                  !! as drawn
      integer :: n_elements, n_ties, n_points
      n_elements = size(bolt%state%plastic)
      n_ties = size(bolt%state%slip)
      n_points = size(bolt%place, 2)
      call archive%item('is_there', bolt%is_there)
      call archive%item('displacement', bolt%state%w, size(bolt%state%w))
      call archive%item('plastic', bolt%state%plastic, n_elements)
      call archive%item('broken', bolt%state%broken, n_elements)
      call archive%item('slip', bolt%state%slip, n_ties)
      call archive%item('weak', bolt%state%weak, n_ties)
      call archive%item('place', bolt%place, [2, n_points], largest_coordinate)
      call archive%item('origin', bolt%origin, [2, n_points], largest_coordinate)
      call archive%item('dowel_slip', bolt%dowel_slip, size(bolt%dowel_slip))
   end subroutine exchange_bolt

end module rockdda_interaction_bar_state
