! SPDX-License-Identifier: MIT
!> The contacts of a step: how far to look for them, and the search.
module rockdda_stepping_contact_finder
   use rockdda_base_kinds, only : wp
   use rockdda_model_blocks, only : block_system_type
   use rockdda_contact_search, only : contact_search_type
   use rockdda_contact_search_limits, only : search_limits_type, placing_share
   use rockdda_contact_table, only : contact_table_type
   use rockdda_contact_topology, only : contact_topology_type, new_contact_topology
   use rockdda_interaction_attempt, only : attempt_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_stepping_control, only : step_control_type
   use rockdda_stepping_reach, only : predicted_reach, set_search_limits, quantised
   implicit none
   private
   public :: contact_finder_type

   !> Gaps up to this share of w0 count as touching at the start of a run.
   real(wp), parameter :: touching = 1.0e-6_wp

   !> Scratch; nothing in it is part of the state.
   type :: contact_finder_type
      type(contact_search_type) :: search       !! search%pairs%keep = .false.: never with pairs of an earlier step
      type(contact_topology_type), private :: topology
      type(search_limits_type), private :: limits
      logical, private :: places = .false.      !! some stage places blocks
      logical :: needs_forces = .false.               !! shear forces are read before the end of the step
   contains
      procedure :: init
      procedure :: show_blocks
      procedure :: first_reach
      procedure, nopass :: longer_reach
      procedure :: find
   end type contact_finder_type

contains

   !> Who is whose neighbour on the outlines of the blocks.
   subroutine init(self, blocks)
      class(contact_finder_type), intent(inout) :: self
      type(block_system_type), intent(in) :: blocks
      call new_contact_topology(blocks, self%topology)
   end subroutine init

   !> Let the search find no contacts of blocks that are not there, and make those of new ones free of stress.
   pure subroutine show_blocks(self, active, newborn, places)
      class(contact_finder_type), intent(inout) :: self
      logical, intent(in) :: active(:), newborn(:)   !! (nb)
      logical, intent(in) :: places                  !! some stage of the run places blocks
      if (allocated(self%search%pairs%active)) deallocate (self%search%pairs%active)
      if (.not. all(active)) self%search%pairs%active = active
      if (allocated(self%search%newborn)) deallocate (self%search%newborn)
      if (any(newborn)) self%search%newborn = newborn
      self%places = places
   end subroutine show_blocks

   !> How far the first search of a step looks [length].
   real(wp) function first_reach(self, context, control, dt) result(reach)
      class(contact_finder_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(step_control_type), intent(in) :: control
      real(wp), intent(in) :: dt                         !! step [time]
      reach = predicted_reach(context%blocks, context%parameters, context%state, control, dt)
      if (allocated(self%search%newborn)) reach = max(reach, quantised(2*placing_share*longest_edge( &
         context%blocks, self%search%newborn), context%parameters%w0))
   end function first_reach

   !> How far to look when the motion found is too large for the contacts that were found [length].
   pure real(wp) function longer_reach(reach, displacement, w0)
      real(wp), intent(in) :: reach          !! of the search before [length]
      real(wp), intent(in) :: displacement   !! largest of any vertex [length]
      real(wp), intent(in) :: w0             !! [length]
      longer_reach = max(2*reach, quantised(2.5_wp*displacement, w0))
   end function longer_reach

   !> Find the contacts of a step from the state at its start, with the history of those of the last one.
   subroutine find(self, context, attempt, last, reach, table)
      class(contact_finder_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(contact_table_type), intent(in) :: last       !! of the last accepted step
      real(wp), intent(in) :: reach                      !! [length]
      type(contact_table_type), intent(inout) :: table
      ! pairs of blocks asleep, among others that are, are left out
      if (allocated(self%search%pairs%asleep)) deallocate (self%search%pairs%asleep)
      if (any(attempt%asleep)) self%search%pairs%asleep = attempt%asleep
      associate (parameters => context%parameters)
         call set_search_limits(last, parameters, context%blocks%n_blocks, reach, self%limits, self%places)
         if (parameters%by_length .and. any(self%limits%bears_tension) .and. .not. allocated(self%limits%edge_joint)) &
            self%limits%edge_joint = context%blocks%edge_joint
         table%waits_for_forces = .not. (parameters%sleeps .or. self%needs_forces)
         call self%search%run(context%blocks, self%topology, context%state%vertices, self%limits, last, &
                              context%state%step == 0, touching*parameters%w0, table)
      end associate
   end subroutine find

   !> Length of the longest edge of some blocks.
   pure real(wp) function longest_edge(blocks, chosen) result(longest)
      type(block_system_type), intent(in) :: blocks
      logical, intent(in) :: chosen(:)               !! (nb)
      integer :: i, v, next
      longest = 0
      do i = 1, blocks%n_blocks
         if (.not. chosen(i)) cycle
         do v = blocks%vertex_offset(i) + 1, blocks%vertex_offset(i + 1)
            next = merge(blocks%vertex_offset(i) + 1, v + 1, v == blocks%vertex_offset(i + 1))
            longest = max(longest, norm2(blocks%vertices(:, next) - blocks%vertices(:, v)))
         end do
      end do
   end function longest_edge

end module rockdda_stepping_contact_finder
