! SPDX-License-Identifier: MIT
!> Rows of a contact table to be, as the narrow phase finds them: lists that grow, of intervals and of single rows, and
!> the scratch of the search for one pair of blocks, which is kept from pair to pair.
module rockdda_contact_candidates
   use rockdda_base_room, only : grow
   use rockdda_contact_intervals, only : interval_type
   implicit none
   private
   public :: candidate_type, other_rows_type, candidate_list_type

   !> A row of the table to be that is no station of an interval.
   type :: candidate_type
      integer :: vertex = 0, edge = 0
      integer :: station = 0                            !! of a corner against a corner, or 0
      integer :: others = 0                             !! its `other_rows` in the list, 0 none
   end type candidate_type

   !> Rows that a row between a vertex and an edge refers to.
   type :: other_rows_type
      integer :: partner_vertex = 0, partner_edge = 0   !! identity of the partner row, 0 none
      integer :: alias_vertex = 0, alias_edge = 0       !! row of the last step to go on with, 0 its own
   end type other_rows_type

   !> Growing lists of candidate rows and the scratch of the pair search.
   type :: candidate_list_type
      integer :: n = 0
      integer :: room = 0                                        !! size of `rows`
      type(candidate_type), allocatable :: rows(:)
      integer :: n_others = 0
      type(other_rows_type), allocatable :: others(:)            !! (>= n_others)
      integer :: n_intervals = 0
      integer :: room_for_intervals = 0                          !! size of `intervals`
      type(interval_type), allocatable :: intervals(:)           !! (>= n_intervals) with rows of their own
      integer, allocatable :: near_a(:), near_b(:)               !! vertices of the pair close to the other block
      integer, allocatable :: edges_a(:), edges_b(:)             !! edges likewise
      integer, allocatable :: corner_pairs(:, :)                 !! (2, n) vertex-vertex contacts of the pair
      integer :: n_near_a = 0, n_near_b = 0, n_edges_a = 0, n_edges_b = 0, n_corners = 0
   contains
      procedure :: clear
      procedure :: append
      procedure :: append_with
      procedure :: reserve_intervals
      procedure :: make_room_for_interval
      procedure :: add_corners
   end type candidate_list_type

contains

   !> No rows.
   elemental subroutine clear(self)
      class(candidate_list_type), intent(inout) :: self
      self%n = 0
      self%n_others = 0
      self%n_intervals = 0
   end subroutine clear

   !> Append a candidate row.
   pure subroutine append(self, row)
      class(candidate_list_type), intent(inout) :: self
      type(candidate_type), intent(in) :: row
      if (self%n == self%room) call make_room(self)
      self%n = self%n + 1
      self%rows(self%n) = row
   end subroutine append

   !> Append a candidate row that refers to others.
   pure subroutine append_with(self, row, others)
      class(candidate_list_type), intent(inout) :: self
      type(candidate_type), intent(in) :: row
      type(other_rows_type), intent(in) :: others
      type(other_rows_type), allocatable :: larger(:)
      call self%append(row)
      if (max(others%partner_vertex, others%alias_vertex) == 0) return
      if (.not. allocated(self%others)) allocate (self%others(16))
      if (self%n_others == size(self%others)) then
         allocate (larger(2*self%n_others))
         larger(1:self%n_others) = self%others
         call move_alloc(larger, self%others)
      end if
      self%n_others = self%n_others + 1
      self%others(self%n_others) = others
      self%rows(self%n)%others = self%n_others
   end subroutine append_with

   !> Room for more rows. (Not in `append`, which is called for each row.)
   pure subroutine make_room(self)
      type(candidate_list_type), intent(inout) :: self
      type(candidate_type), allocatable :: larger(:)
      allocate (larger(max(64, 2*self%n)))
      if (self%n > 0) larger(1:self%n) = self%rows(1:self%n)
      call move_alloc(larger, self%rows)
      self%room = size(self%rows)
   end subroutine make_room

   !> Make room for a number of intervals, where there are none yet. What is not used takes no memory.
   pure subroutine reserve_intervals(self, n)
      class(candidate_list_type), intent(inout) :: self
      integer, intent(in) :: n
      if (n <= self%room_for_intervals) return
      if (allocated(self%intervals)) deallocate (self%intervals)
      self%room_for_intervals = n + n/8
      allocate (self%intervals(self%room_for_intervals))
   end subroutine reserve_intervals

   !> Make room for more intervals: each is measured in its place.
   pure subroutine make_room_for_interval(self)
      class(candidate_list_type), intent(inout) :: self
      type(interval_type), allocatable :: larger(:)
      allocate (larger(max(64, 2*self%n_intervals)))
      if (self%n_intervals > 0) larger(1:self%n_intervals) = self%intervals(1:self%n_intervals)
      call move_alloc(larger, self%intervals)
      self%room_for_intervals = size(self%intervals)
   end subroutine make_room_for_interval

   !> Vertex a of the first block of the pair and vertex b of the second meet.
   pure subroutine add_corners(self, a, b)
      class(candidate_list_type), intent(inout) :: self
      integer, intent(in) :: a, b
      self%n_corners = self%n_corners + 1
      call grow(self%corner_pairs, self%n_corners, 2)
      self%corner_pairs(:, self%n_corners) = [a, b]
   end subroutine add_corners

end module rockdda_contact_candidates
