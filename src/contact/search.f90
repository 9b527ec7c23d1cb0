! SPDX-License-Identifier: MIT
!> The contact table of a step: search, geometry, and the history handed on from the last step's table.
!>
!> Rows come out sorted by (vertex, edge), hence by (block_a, vertex, block_b, edge), whatever the order in which
!> they were found. The pairs of blocks are searched in a few parts, one after the other or side by side; what is found
!> in a pair depends on nothing but the pair.
module rockdda_contact_search
   use rockdda_base_kinds, only : wp
   use rockdda_model_blocks, only : block_system_type
   use rockdda_contact_bonds, only : held_cosine
   use rockdda_contact_table, only : contact_table_type
   use rockdda_contact_topology, only : contact_topology_type
   use rockdda_contact_history, only : contact_history_type, new_contact_history
   use rockdda_contact_outlines, only : outlines_type
   use rockdda_contact_broad_phase, only : close_pairs_type
   use rockdda_contact_candidates, only : other_rows_type
   use rockdda_contact_search_limits, only : search_limits_type
   use rockdda_contact_narrow_search, only : narrow_search_type
   use rockdda_contact_inheritance, only : hand_on_history, inheritance_work_type
   use rockdda_contact_newborn, only : touch_newborn
   use rockdda_contact_rows, only : sort_rows, fill_table
   implicit none
   private
   public :: contact_search_type

   !> Scratch of the search; one per run, nothing in it is part of the state.
   type :: contact_search_type
      type(close_pairs_type) :: pairs
      type(outlines_type) :: outlines
      type(narrow_search_type) :: narrow
      type(contact_history_type) :: history
      type(inheritance_work_type) :: inheritance
      logical, allocatable :: newborn(:)              !! (nb) blocks that have just been placed; not allocated: none
      integer, allocatable :: start(:)
      type(other_rows_type), allocatable :: others(:) !! (>= rows) that each row refers to; size 0 when none does
   contains
      procedure :: run => search_contacts
   end type contact_search_type

contains

   !> Fill `table` with every contact within the limits; history comes from `previous`.
   subroutine search_contacts(self, blocks, topology, vertices, limits, previous, first_step, touch, table)
      class(contact_search_type), intent(inout) :: self
      type(block_system_type), intent(in) :: blocks
      type(contact_topology_type), intent(in) :: topology
      real(wp), intent(in), contiguous :: vertices(:, :)               !! (2, nv) now
      type(search_limits_type), intent(inout) :: limits    !! the angle that bonds hold is set here
      type(contact_table_type), intent(in) :: previous     !! last step's table
      logical, intent(in) :: first_step                    !! touching contacts are born bonded
      real(wp), intent(in) :: touch                        !! gap below which two blocks touch at the start [length]
      type(contact_table_type), intent(inout) :: table
      call self%pairs%update(blocks, vertices, limits%reach)
      call self%outlines%update(topology, vertices, limits%sine)
      call new_contact_history(size(vertices, 2), previous, self%history)
      limits%held_cosine = held_cosine(limits, previous, self%outlines)
      limits%touch = merge(touch, huge(touch), first_step)
      if (allocated(limits%is_born)) deallocate (limits%is_born)
      if (first_step) then
         allocate (limits%is_born(blocks%n_blocks), source=.true.)
      else if (allocated(self%newborn)) then
         limits%is_born = self%newborn
      end if
      call self%narrow%run(self%pairs, blocks, topology, self%outlines, vertices, limits, previous, self%history)
      associate (found => self%narrow%found(1:self%pairs%n_parts()), same_rows => self%inheritance%same_rows)
         call sort_rows(found, size(vertices, 2), self%start, self%others, table)
         call fill_table(found, blocks, topology, self%outlines, vertices, limits, self%others, self%start, previous, &
                         table, same_rows)
      end associate
      call hand_on_history(previous, self%history, topology, self%outlines, self%others, limits, first_step, touch, &
                           self%inheritance, table)
      if (allocated(self%newborn)) call touch_newborn(self%newborn, topology, self%outlines, touch, table)
   end subroutine search_contacts

end module rockdda_contact_search
