! SPDX-License-Identifier: MIT
!> Contacts as they are written: intervals by what acts at their two ends, others as they are.
!>
!> What acts at the two points of an interval is moved to its ends, so that forces and moments are the same: of a joint
!> that is closed at one end the forces at both ends press. Each end represents half of the length that is closed, so
!> that length times the stresses at the ends adds up to the force. Both rows have one state: that of the row that is
!> pressed more.
module rockdda_contact_view
   use rockdda_base_kinds, only : wp
   use rockdda_contact_interval_law, only : first_place, second_place
   use rockdda_contact_intervals, only : tie_place
   use rockdda_contact_table, only : contact_table_type, contact_state, is_of_interval, other_row
   implicit none
   private
   public :: contact_view_type, view_contacts, force_on_a

   !> Some rows of a contact table.
   type :: contact_view_type
      integer, allocatable :: blocks(:, :)     !! (2, n) first and second block
      integer, allocatable :: state(:)         !! (n) contact_state%...
      real(wp), allocatable :: point(:, :)     !! (2, n) [length]
      real(wp), allocatable :: force(:, :)     !! (2, n) on the first block, zero when open
      real(wp), allocatable :: opening(:)      !! (n) distance of the blocks [length]
      real(wp), allocatable :: slip(:)         !! (n) summed up [length]
      real(wp), allocatable :: length(:)       !! (n) of joint that each represents [length]
   end type contact_view_type

contains

   !> Rows first to last of a table, which cut no interval.
   pure subroutine view_contacts(table, vertices, first, last, view, holds)
      type(contact_table_type), intent(in) :: table
      real(wp), intent(in) :: vertices(:, :)   !! (2, nv) now
      integer, intent(in) :: first, last
      type(contact_view_type), intent(inout) :: view
      logical, intent(in), optional :: holds(:)   !! (joint materials) bonds carry tension; default: all
      real(wp) :: place
      logical :: bond_holds
      integer :: c, d, k, n
      n = max(0, last - first + 1)
      if (allocated(view%state)) then
         if (size(view%state) /= n) deallocate (view%blocks, view%state, view%point, view%force, view%opening, &
                                                view%slip, view%length)
      end if
      if (.not. allocated(view%state)) allocate (view%blocks(2, n), view%state(n), view%point(2, n), view%force(2, n), &
                                                 view%opening(n), view%slip(n), view%length(n))
      do c = first, last
         k = c - first + 1
         view%blocks(:, k) = [table%block_a(c), table%block_b(c)]
         view%state(k) = table%state(c)
         view%force(:, k) = force_on_a(table, c)
         view%opening(k) = table%distance(c)
         view%slip(k) = table%total_slip(c)
         view%length(k) = table%length(c)
         view%point(:, k) = vertices(:, table%vertex(c))
         if (table%station(c) > 0) view%point(:, k) = table%point(:, c)
         if (.not. is_of_interval(table, c)) cycle
         d = other_row(table, c)
         place = merge(tie_place, first_place, logical(table%tied(c)))
         view%point(:, k) = at_end(table%point(:, c), table%point(:, d), place)
         view%opening(k) = at_end(table%distance(c), table%distance(d), place)
         view%force(:, k) = (1 - place)*view%force(:, k) + place*force_on_a(table, d)
         view%slip(k) = 0.5_wp*(table%total_slip(c) + table%total_slip(d))
         if (table%normal_force(d) > table%normal_force(c)) view%state(k) = table%state(d)
         bond_holds = .true.
         if (present(holds) .and. table%joint(c) > 0) bond_holds = holds(table%joint(c))
         if (.not. table%tied(c)) view%length(k) = closed_length(table, c, d, bond_holds)
      end do
   end subroutine view_contacts

   !> Force of a contact on its first block: compression along the outward normal of the edge, shear along the edge.
   pure function force_on_a(table, c) result(force)
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: c       !! row
      real(wp) :: force(2)
      associate (n => table%normal(:, c))
         ! the tangent is the normal turned by +90 degrees: normal = (t2, -t1)
         force = table%normal_force(c)*n + table%shear_force(c)*[-n(2), n(1)]
      end associate
   end function force_on_a

   !> What is linear along an interval at the end next to a point, by its values there and at the other point.
   elemental real(wp) function at_end(own, other, place)
      real(wp), intent(in) :: own, other
      real(wp), intent(in) :: place      !! share of the interval between the end and the point
      at_end = own + place/(1 - 2*place)*(own - other)
   end function at_end

   !> Half of the closed length of an interval: on which a linear stress without tension has its resultant, and on which
   !> a bond is sound that carries tension.
   pure real(wp) function closed_length(table, c, d, bond_holds) result(length)
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: c, d        !! row next to the end, and the other one
      logical, intent(in) :: bond_holds
      real(wp) :: force(2), place, low, high
      length = 0
      if (table%state(c) == contact_state%open) return
      force = table%normal_force([c, d])
      ! the closed part as shares of the interval, from the end
      low = 0
      high = 1
      if (sum(force) > 0) then
         place = dot_product([first_place, second_place], force)/sum(force)
         if (place < 0.5_wp) high = max(0.0_wp, min(1.0_wp, 3*place))
         if (place > 0.5_wp) low = min(1.0_wp, max(0.0_wp, 3*place - 2))
      end if
      if (bond_holds .and. table%bond_end(max(c, d)) > table%bond_end(min(c, d))) then
         low = min(low, merge(table%bond_end(c), 1 - table%bond_end(c), c < d))
         high = max(high, merge(table%bond_end(d), 1 - table%bond_end(d), c < d))
      end if
      length = 0.5_wp*(table%length(c) + table%length(d))*(high - low)
   end function closed_length

end module rockdda_contact_view
