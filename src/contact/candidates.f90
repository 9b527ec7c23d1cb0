! SPDX-License-Identifier: MIT
!> Rows of a contact table to be, as the narrow phase finds them: a list that grows, and the scratch of the search for
!> one pair of blocks, which is kept from pair to pair.
module rockdda_contact_candidates
   use rockdda_base_parallel, only : parallel_contacts
   use rockdda_base_room, only : reserve
   use rockdda_contact_intervals, only : interval_type
   implicit none
   private
   public :: candidate_type, candidate_list_type

   !> A row of the table to be.
   type :: candidate_type
      integer :: vertex = 0, edge = 0
      integer :: partner_vertex = 0, partner_edge = 0   !! identity of the partner row, 0 none
      integer :: alias_vertex = 0, alias_edge = 0       !! row of the last step to go on with, 0 its own
      integer :: station = 0
   end type candidate_type

   !> Growing list of candidate rows and the scratch of the pair search.
   type :: candidate_list_type
      integer :: n = 0
      integer :: room = 0                                        !! size of `rows`
      type(candidate_type), allocatable :: rows(:)
      integer :: n_intervals = 0
      type(interval_type), allocatable :: intervals(:)           !! in the order of the rows of their first stations
      integer, allocatable :: near_a(:), near_b(:)               !! vertices of the pair close to the other block
      integer, allocatable :: edges_a(:), edges_b(:)             !! edges likewise
      integer, allocatable :: corner_pairs(:, :)                 !! (2, n) vertex-vertex contacts of the pair
      integer :: n_near_a = 0, n_near_b = 0, n_edges_a = 0, n_edges_b = 0, n_corners = 0
      integer :: n_kept = 0                                      !! numbers in `kept`
      integer, allocatable :: kept(:)                            !! what was close in pair after pair
   contains
      procedure :: append
      procedure :: append_interval
      procedure :: keep_near
      procedure :: recall_near
      procedure :: add_corners
      procedure :: collect
      procedure :: sort
   end type candidate_list_type

contains

   !> Append a candidate row.
   pure subroutine append(self, row)
      class(candidate_list_type), intent(inout) :: self
      type(candidate_type), intent(in) :: row
      if (self%n == self%room) call make_room(self)
      self%n = self%n + 1
      self%rows(self%n) = row
   end subroutine append

   !> Room for more rows. (Not in `append`, which is called for each row.)
   pure subroutine make_room(self)
      type(candidate_list_type), intent(inout) :: self
      type(candidate_type), allocatable :: larger(:)
      allocate (larger(max(64, 2*self%n)))
      if (self%n > 0) larger(1:self%n) = self%rows(1:self%n)
      call move_alloc(larger, self%rows)
      self%room = size(self%rows)
   end subroutine make_room

   !> Append the interval of which the rows that follow are stations.
   pure subroutine append_interval(self, interval)
      class(candidate_list_type), intent(inout) :: self
      type(interval_type), intent(in) :: interval
      type(interval_type), allocatable :: larger(:)
      if (.not. allocated(self%intervals)) allocate (self%intervals(64))
      if (self%n_intervals == size(self%intervals)) then
         allocate (larger(2*self%n_intervals))
         larger(1:self%n_intervals) = self%intervals
         call move_alloc(larger, self%intervals)
      end if
      self%n_intervals = self%n_intervals + 1
      self%intervals(self%n_intervals) = interval
   end subroutine append_interval

   !> Keep the vertices and edges of the pair that are close to the other block.
   pure subroutine keep_near(self)
      class(candidate_list_type), intent(inout) :: self
      integer, allocatable :: larger(:)
      integer :: n
      n = self%n_kept + 4 + self%n_near_a + self%n_edges_a + self%n_near_b + self%n_edges_b
      if (.not. allocated(self%kept)) allocate (self%kept(256))
      if (n > size(self%kept)) then
         allocate (larger(2*n))
         larger(1:self%n_kept) = self%kept(1:self%n_kept)
         call move_alloc(larger, self%kept)
      end if
      n = self%n_kept
      self%kept(n + 1:n + 4) = [self%n_near_a, self%n_edges_a, self%n_near_b, self%n_edges_b]
      n = n + 4
      call put(self%near_a, self%n_near_a, self%kept, n)
      call put(self%edges_a, self%n_edges_a, self%kept, n)
      call put(self%near_b, self%n_near_b, self%kept, n)
      call put(self%edges_b, self%n_edges_b, self%kept, n)
      self%n_kept = n
   end subroutine keep_near

   !> Append a few numbers.
   pure subroutine put(list, m, kept, n)
      integer, allocatable, intent(in) :: list(:)
      integer, intent(in) :: m
      integer, intent(inout) :: kept(:), n
      integer :: k
      do k = 1, m
         kept(n + k) = list(k)
      end do
      n = n + m
   end subroutine put

   !> Take the next pair that was kept, and move `place` to the one after it; 0 is that of the first.
   pure subroutine recall_near(self, place)
      class(candidate_list_type), intent(inout) :: self
      integer, intent(inout) :: place
      self%n_near_a = self%kept(place + 1)
      self%n_edges_a = self%kept(place + 2)
      self%n_near_b = self%kept(place + 3)
      self%n_edges_b = self%kept(place + 4)
      place = place + 4
      call get(self%near_a, self%n_near_a, self%kept, place)
      call get(self%edges_a, self%n_edges_a, self%kept, place)
      call get(self%near_b, self%n_near_b, self%kept, place)
      call get(self%edges_b, self%n_edges_b, self%kept, place)
   end subroutine recall_near

   !> The next few numbers.
   pure subroutine get(list, m, kept, n)
      integer, allocatable, intent(inout) :: list(:)   !! has had room for them
      integer, intent(in) :: m, kept(:)
      integer, intent(inout) :: n
      integer :: k
      do k = 1, m
         list(k) = kept(n + k)
      end do
      n = n + m
   end subroutine get

   !> Vertex a of the first block of the pair and vertex b of the second meet.
   pure subroutine add_corners(self, a, b)
      class(candidate_list_type), intent(inout) :: self
      integer, intent(in) :: a, b
      integer, allocatable :: larger(:, :)
      if (.not. allocated(self%corner_pairs)) allocate (self%corner_pairs(2, 16))
      if (self%n_corners == size(self%corner_pairs, 2)) then
         allocate (larger(2, 2*self%n_corners))
         larger(:, 1:self%n_corners) = self%corner_pairs
         call move_alloc(larger, self%corner_pairs)
      end if
      self%n_corners = self%n_corners + 1
      self%corner_pairs(:, self%n_corners) = [a, b]
   end subroutine add_corners

   !> The rows of several lists, one after the other.
   subroutine collect(self, lists)
      class(candidate_list_type), intent(inout) :: self
      type(candidate_list_type), intent(in) :: lists(:)
      integer :: k, n, first(size(lists))
      n = 0
      do k = 1, size(lists)
         first(k) = n
         n = n + lists(k)%n
      end do
      if (allocated(self%rows)) then
         if (size(self%rows) < n) deallocate (self%rows)
      end if
      if (.not. allocated(self%rows)) allocate (self%rows(n + n/4 + 16))
      self%room = size(self%rows)
      self%n = n
      !$omp parallel do default(none) shared(self, lists, first) private(k) schedule(static) &
      !$omp if (n > parallel_contacts)
      do k = 1, size(lists)
         if (lists(k)%n > 0) self%rows(first(k) + 1:first(k) + lists(k)%n) = lists(k)%rows(1:lists(k)%n)
      end do
      !$omp end parallel do
   end subroutine collect

   !> Order of the candidates by (vertex, edge): counting sort by vertex, insertion sort within.
   pure subroutine sort(self, nv, start, order)
      class(candidate_list_type), intent(in) :: self
      integer, intent(in) :: nv
      integer, allocatable, intent(inout) :: start(:)  !! (nv + 1) rows of vertex v: start(v)+1 ... start(v+1)
      integer, allocatable, intent(inout) :: order(:)
      integer :: c, v, k, l
      if (.not. allocated(start)) allocate (start(nv + 1))
      call reserve(order, self%n)
      start = 0
      do c = 1, self%n
         start(self%rows(c)%vertex + 1) = start(self%rows(c)%vertex + 1) + 1
      end do
      do v = 2, nv + 1
         start(v) = start(v) + start(v - 1)
      end do
      order(1:self%n) = 0
      do c = 1, self%n
         v = self%rows(c)%vertex
         k = start(v) + 1
         start(v) = k
         ! insert among the rows of this vertex that are already placed; a place still empty belongs to another vertex
         l = k - 1
         do while (l >= 1)
            if (order(l) == 0) exit
            if (self%rows(order(l))%vertex /= v) exit
            if (.not. comes_before(self%rows(c), self%rows(order(l)))) exit
            order(l + 1) = order(l)
            l = l - 1
         end do
         order(l + 1) = c
      end do
      do v = nv + 1, 2, -1
         start(v) = start(v - 1)
      end do
      start(1) = 0
   end subroutine sort

   !> Does row a come before row b of the same vertex?
   pure logical function comes_before(a, b)
      type(candidate_type), intent(in) :: a, b
      comes_before = a%edge < b%edge .or. (a%edge == b%edge .and. a%station < b%station)
   end function comes_before

end module rockdda_contact_candidates
