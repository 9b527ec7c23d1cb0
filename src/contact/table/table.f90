! SPDX-License-Identifier: MIT
!> The contact table of one step: structure of arrays, one row per contact point.
!>
!>     row c:   vertex(c) of block_a(c)  against  edge(c) (the edge that starts at vertex edge(c)) of block_b(c)
!>             at station 0; at station 1 and 2 the points of the interval on which the edges that start at vertex(c)
!>             and at edge(c) face each other (rockdda_contact_intervals), one row after the other
!>
!> Rows are sorted by (block_a, vertex, block_b, edge, station): sums over contacts then have one order.
!> A vertex-vertex contact with two entrance lines is two rows that name each other in `partner`;
!> at most one of them is closed.
!>
!> Columns that follow from the identity of rows, or belong to the step at hand alone, can be lent: of two tables one
!> then has them. Shear forces, which a step does not read before it sets them at its end, can stay with the table of
!> the last step until then.
module rockdda_contact_table
   use rockdda_base_kinds, only : wp, i1, l1
   implicit none
   private
   public :: contact_table_type, contact_state, is_of_interval, other_row, cut_no_interval

   type :: contact_state_enum
      integer :: open = 0
      integer :: sliding = 1
      integer :: locked = 2
   end type contact_state_enum
   type(contact_state_enum), parameter :: contact_state = contact_state_enum()

   type :: contact_table_type
      integer :: n = 0
      ! identity
      integer, allocatable :: block_a(:), vertex(:)  !! (n) 1-based; vertex is a global vertex number
      integer, allocatable :: block_b(:), edge(:)    !! (n) edge = global number of its first vertex
      integer(i1), allocatable :: station(:)         !! (n) 0: vertex against edge; > 0: of an interval
      integer, allocatable :: partner(:)             !! (n) other row of a vertex-vertex pair, 0 none
      integer, allocatable :: joint(:)               !! (n) joint material
      ! history, carried from step to step by identity
      integer(i1), allocatable :: state(:)           !! (n) contact_state%...
      real(wp), allocatable :: shear(:)              !! (n) elongation of the shear spring, along the edge
      real(wp), allocatable :: normal_force(:)       !! (n) compression positive, of the last round
      real(wp), allocatable :: shear_force(:)        !! (n) on block a along the edge, of the last round; or no array
      logical(l1), allocatable :: bonded(:)          !! (n) cohesion and tension not yet broken
      logical(l1), allocatable :: tied(:)            !! (n) of an interval of intact rock
      real(wp), allocatable :: total_slip(:)         !! (n) |slip| summed up since the contact closed
      real(wp), allocatable :: energy(:)             !! (n) stored in its springs at the end of the last step
      real(wp), allocatable :: offset(:)             !! (n) gap at which its normal spring is free of force
      !> (n) of intervals: from the first row's to the second's, as shares, the bond is sound; 0 and 0: nowhere
      real(wp), allocatable :: bond_end(:)
      real(wp), allocatable :: closed(:)             !! (n) share of the length by which it resists slip
      real(wp), allocatable :: core(:, :)            !! (2, n) least such share since it slid, elongation of that part
      integer(i1), allocatable :: slip_sign(:)       !! (n) +1/-1: vertex slides along/against the edge; 0
      ! stiffness of its springs in this step [force/length]
      real(wp), allocatable :: k_n(:), k_s(:)        !! (n) normal, shear
      ! geometry at the step's start
      real(wp), allocatable :: distance(:)           !! (n) between the blocks, < 0 where they overlap
      real(wp), allocatable :: gap(:)                !! (n) the same less the offset: of the normal spring, > 0 open
      real(wp), allocatable :: length(:)             !! (n) of the joint, for which the contact stands
      real(wp), allocatable :: normal(:, :)          !! (2, n) outward unit normal of the edge
      real(wp), allocatable :: point(:, :)           !! (2, n) the vertex, or a point between the edges
      real(wp), allocatable :: share(:)              !! (n) of the gap between the point and block a, 0 to 1
      logical :: waits_for_forces = .false.          !! `resize` makes no room for shear forces
      ! rows that have been in use; those behind take no memory yet
      integer, private :: n_begun = 0
   contains
      procedure :: resize
      procedure :: take_forces
      procedure :: exchange
      procedure :: open_row
      procedure :: take_rows
      procedure, private :: clear_rows
   end type contact_table_type

contains

   !> Is a row one of the two of an interval?
   pure logical function is_of_interval(table, c)
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: c
      is_of_interval = table%station(c) == 1 .or. table%station(c) == 2
   end function is_of_interval

   !> The other row of the interval of a row.
   pure integer function other_row(table, c)
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: c
      other_row = merge(c + 1, c - 1, table%station(c) == 1)
   end function other_row

   !> Move the ends of a run of rows so that it takes the second row of an interval with the first one: runs that follow
   !> one another still do, and are longer by one row at most.
   pure subroutine cut_no_interval(n, station, first, last)
      integer, intent(in) :: n
      integer(i1), intent(in) :: station(n)
      integer, intent(inout) :: first, last
      if (first <= n) then
         if (station(first) == 2) first = first + 1
      end if
      if (last < n) then
         if (station(last + 1) == 2) last = last + 1
      end if
   end subroutine cut_no_interval

   !> Make room for n rows; contents are undefined when the arrays had to grow. Room that is not used is not touched, so
   !> that it takes no memory.
   pure subroutine resize(self, n)
      class(contact_table_type), intent(inout) :: self
      integer, intent(in) :: n
      integer :: m
      self%n = n
      if (allocated(self%vertex)) then
         if (size(self%vertex) < n) &
            deallocate (self%vertex, self%edge, self%state, self%shear, self%normal_force, self%bonded, &
                        self%slip_sign, self%length, self%normal, self%point, self%total_slip, self%energy, &
                        self%k_n, self%k_s, self%offset, self%station, self%tied, self%distance, self%bond_end, &
                        self%closed, self%core, self%block_a, self%block_b, self%partner, self%joint, self%gap, &
                        self%share)
      end if
      if (.not. allocated(self%vertex)) then
         m = n + n/4 + 16
         allocate (self%vertex(m), self%edge(m), self%state(m), self%slip_sign(m), self%station(m), self%bonded(m), &
                   self%tied(m), self%shear(m), self%normal_force(m), self%length(m), self%total_slip(m), &
                   self%energy(m), self%k_n(m), self%k_s(m), self%offset(m), self%distance(m), self%bond_end(m), &
                   self%normal(2, m), self%point(2, m), self%block_a(m), self%block_b(m), self%partner(m), &
                   self%joint(m), self%gap(m), self%share(m), self%closed(m), &
                   self%core(2, m))
         self%n_begun = 0
      end if
      if (self%waits_for_forces) then
         if (allocated(self%shear_force)) deallocate (self%shear_force)
      else
         call resize_forces(self)
      end if
      if (n <= self%n_begun) return
      call self%clear_rows(self%n_begun + 1, n)
      self%n_begun = n
   end subroutine resize

   !> `resize` for shear forces: numbers that there were stay where there is room.
   pure subroutine resize_forces(self)
      class(contact_table_type), intent(inout) :: self
      real(wp), allocatable :: larger(:)
      if (allocated(self%shear_force)) then
         if (size(self%shear_force) >= self%n) return
      end if
      allocate (larger(size(self%vertex)))
      larger(1:self%n) = 0
      call move_alloc(larger, self%shear_force)
   end subroutine resize_forces

   !> Take the place of the shear forces from another table, which then has none, if this one has none. All of them must
   !> then be set.
   pure subroutine take_forces(self, other)
      class(contact_table_type), intent(inout) :: self
      type(contact_table_type), intent(inout) :: other
      if (.not. allocated(self%shear_force)) call move_alloc(other%shear_force, self%shear_force)
      call resize_forces(self)
   end subroutine take_forces

   !> Set rows to zero before their first use.
   pure subroutine clear_rows(self, first, last)
      class(contact_table_type), intent(inout) :: self
      integer, intent(in) :: first, last
      self%block_a(first:last) = 0
      self%block_b(first:last) = 0
      self%partner(first:last) = 0
      self%joint(first:last) = 0
      self%gap(first:last) = 0
      self%share(first:last) = 0
      self%vertex(first:last) = 0
      self%edge(first:last) = 0
      self%station(first:last) = 0
      self%state(first:last) = int(contact_state%open, i1)
      self%slip_sign(first:last) = 0
      self%bonded(first:last) = .false.
      self%tied(first:last) = .false.
      self%shear(first:last) = 0
      self%normal_force(first:last) = 0
      self%total_slip(first:last) = 0
      self%energy(first:last) = 0
      self%offset(first:last) = 0
      self%bond_end(first:last) = 0
      self%closed(first:last) = 1
      self%core(1, first:last) = 1
      self%core(2, first:last) = 0
      self%k_n(first:last) = 0
      self%k_s(first:last) = 0
      self%distance(first:last) = 0
      self%length(first:last) = 0
      self%normal(:, first:last) = 0
      self%point(:, first:last) = 0
   end subroutine clear_rows

   !> A contact that carries nothing and remembers nothing; its bond stays as it is.
   pure subroutine open_row(self, c)
      class(contact_table_type), intent(inout) :: self
      integer, intent(in) :: c   !! row
      self%state(c) = int(contact_state%open, i1)
      self%shear(c) = 0
      self%closed(c) = 1
      self%core(:, c) = [1, 0]
      self%normal_force(c) = 0
      if (allocated(self%shear_force)) self%shear_force(c) = 0
      self%slip_sign(c) = 0
      self%total_slip(c) = 0
      self%energy(c) = 0
   end subroutine open_row

   !> Take rows of another table, as many as from `first` to `last` in this one.
   pure subroutine take_rows(self, first, last, other, begin)
      class(contact_table_type), intent(inout) :: self
      integer, intent(in) :: first, last
      type(contact_table_type), intent(in) :: other
      integer, intent(in) :: begin   !! first of these rows in the other table
      integer :: n
      n = begin + last - first
      self%block_a(first:last) = other%block_a(begin:n)
      self%vertex(first:last) = other%vertex(begin:n)
      self%block_b(first:last) = other%block_b(begin:n)
      self%edge(first:last) = other%edge(begin:n)
      self%partner(first:last) = other%partner(begin:n)
      self%joint(first:last) = other%joint(begin:n)
      self%station(first:last) = other%station(begin:n)
      self%state(first:last) = other%state(begin:n)
      self%shear(first:last) = other%shear(begin:n)
      self%normal_force(first:last) = other%normal_force(begin:n)
      self%shear_force(first:last) = other%shear_force(begin:n)
      self%bonded(first:last) = other%bonded(begin:n)
      self%tied(first:last) = other%tied(begin:n)
      self%total_slip(first:last) = other%total_slip(begin:n)
      self%energy(first:last) = other%energy(begin:n)
      self%offset(first:last) = other%offset(begin:n)
      self%bond_end(first:last) = other%bond_end(begin:n)
      self%closed(first:last) = other%closed(begin:n)
      self%core(:, first:last) = other%core(:, begin:n)
      self%slip_sign(first:last) = other%slip_sign(begin:n)
      self%k_n(first:last) = other%k_n(begin:n)
      self%k_s(first:last) = other%k_s(begin:n)
      self%distance(first:last) = other%distance(begin:n)
      self%gap(first:last) = other%gap(begin:n)
      self%length(first:last) = other%length(begin:n)
      self%share(first:last) = other%share(begin:n)
      self%normal(:, first:last) = other%normal(:, begin:n)
      self%point(:, first:last) = other%point(:, begin:n)
   end subroutine take_rows

   !> Exchange the contents of two tables without copying them.
   pure subroutine exchange(self, other)
      class(contact_table_type), intent(inout) :: self
      type(contact_table_type), intent(inout) :: other
      integer :: n
      n = self%n
      self%n = other%n
      other%n = n
      n = self%n_begun
      self%n_begun = other%n_begun
      other%n_begun = n
      call exchange_integers(self%block_a, other%block_a)
      call exchange_integers(self%vertex, other%vertex)
      call exchange_integers(self%block_b, other%block_b)
      call exchange_integers(self%edge, other%edge)
      call exchange_integers(self%partner, other%partner)
      call exchange_integers(self%joint, other%joint)
      call exchange_bytes(self%state, other%state)
      call exchange_bytes(self%slip_sign, other%slip_sign)
      call exchange_logicals(self%bonded, other%bonded)
      call exchange_logicals(self%tied, other%tied)
      call exchange_reals(self%shear, other%shear)
      call exchange_reals(self%normal_force, other%normal_force)
      call exchange_reals(self%shear_force, other%shear_force)
      call exchange_reals(self%total_slip, other%total_slip)
      call exchange_reals(self%energy, other%energy)
      call exchange_reals(self%k_n, other%k_n)
      call exchange_reals(self%k_s, other%k_s)
      call exchange_reals(self%offset, other%offset)
      call exchange_reals(self%bond_end, other%bond_end)
      call exchange_reals(self%closed, other%closed)
      call exchange_pairs(self%core, other%core)
      call exchange_reals(self%share, other%share)
      call exchange_reals(self%distance, other%distance)
      call exchange_bytes(self%station, other%station)
      call exchange_reals(self%gap, other%gap)
      call exchange_reals(self%length, other%length)
      call exchange_pairs(self%normal, other%normal)
      call exchange_pairs(self%point, other%point)
   end subroutine exchange

   !> Exchange two arrays.
   pure subroutine exchange_integers(a, b)
      integer, allocatable, intent(inout) :: a(:), b(:)
      integer, allocatable :: c(:)
      call move_alloc(a, c)
      call move_alloc(b, a)
      call move_alloc(c, b)
   end subroutine exchange_integers

   !> Exchange two arrays.
   pure subroutine exchange_bytes(a, b)
      integer(i1), allocatable, intent(inout) :: a(:), b(:)
      integer(i1), allocatable :: c(:)
      call move_alloc(a, c)
      call move_alloc(b, a)
      call move_alloc(c, b)
   end subroutine exchange_bytes

   !> Exchange two arrays.
   pure subroutine exchange_logicals(a, b)
      logical(l1), allocatable, intent(inout) :: a(:), b(:)
      logical(l1), allocatable :: c(:)
      call move_alloc(a, c)
      call move_alloc(b, a)
      call move_alloc(c, b)
   end subroutine exchange_logicals

   !> Exchange two arrays.
   pure subroutine exchange_reals(a, b)
      real(wp), allocatable, intent(inout) :: a(:), b(:)
      real(wp), allocatable :: c(:)
      call move_alloc(a, c)
      call move_alloc(b, a)
      call move_alloc(c, b)
   end subroutine exchange_reals

   !> Exchange two arrays.
   pure subroutine exchange_pairs(a, b)
      real(wp), allocatable, intent(inout) :: a(:, :), b(:, :)
      real(wp), allocatable :: c(:, :)
      call move_alloc(a, c)
      call move_alloc(b, a)
      call move_alloc(c, b)
   end subroutine exchange_pairs

end module rockdda_contact_table
