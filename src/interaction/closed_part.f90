! SPDX-License-Identifier: MIT
!> The part of an interval that is closed, by which its cohesion acts.
!>
!> A station stands for a share of its interval: with three stations an open end would take L/6 of the cohesion away,
!> however short the open part is. The gap is linear between stations, so that the end of the closed part lies
!>
!>     d_c/(d_c + d_o) of the way from a closed station to an open one,     d = |gap - gap at which the joint opens|
!>
!> Closed stations share the cohesion of the closed part in proportion to their lengths. The gaps are those at the start
!> of the step.
module rockdda_interaction_closed_part
   use rockdda_base_kinds, only : wp
   use rockdda_contact_table, only : contact_table_type, contact_state
   use rockdda_interaction_contact_law, only : contact_law_type
   use rockdda_interaction_joint_law, only : joint_extra_type, joint_type, joint_settings_type, opening_gap
   implicit none
   private
   public :: has_closed_part, set_closed_parts, closed_length, last_of_interval

contains

   !> Has a joint material cohesion that slip does not break?
   elemental logical function has_closed_part(law)
      type(contact_law_type), intent(in) :: law
      has_closed_part = .not. law%brittle .and. (law%cohesion > 0 .or. law%residual_cohesion > 0)
   end function has_closed_part

   !> Set `extra%more_length` of all closed stations of intervals whose cohesion stays.
   pure subroutine set_closed_parts(table, laws, settings, extra)
      type(contact_table_type), intent(in) :: table
      type(contact_law_type), intent(in) :: laws(:)    !! per joint material
      type(joint_settings_type), intent(in) :: settings
      type(joint_extra_type), intent(inout) :: extra(:)   !! (>= table%n) at the start of the step
      integer :: first, last
      first = 1
      do while (first <= table%n)
         last = last_of_interval(table, first)
         if (last > first .and. .not. table%tied(first)) then
            if (has_closed_part(laws(table%joint(first)))) &
               call set_closed_part(table, first, last, laws(table%joint(first)), settings, extra)
         end if
         first = last + 1
      end do
   end subroutine set_closed_parts

   !> Last row of the interval that begins with a row.
   pure integer function last_of_interval(table, first) result(last)
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: first
      last = first
      if (table%station(first) == 0) return
      do while (last < table%n)
         if (table%station(last + 1) <= table%station(last) .or. table%vertex(last + 1) /= table%vertex(first) .or. &
             table%edge(last + 1) /= table%edge(first) .or. table%block_b(last + 1) /= table%block_b(first)) return
         last = last + 1
      end do
   end function last_of_interval

   !> The same for one interval, of which some stations are open.
   pure subroutine set_closed_part(table, first, last, law, settings, extra)
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: first, last               !! rows
      type(contact_law_type), intent(in) :: law
      type(joint_settings_type), intent(in) :: settings
      type(joint_extra_type), intent(inout) :: extra(:)
      type(joint_type) :: joint
      real(wp) :: excess(last - first + 1), position(last - first + 1), stations, all_stations, part
      logical :: closed(last - first + 1)
      integer :: c, k
      closed = table%state(first:last) /= contact_state%open
      if (all(closed) .or. .not. any(closed)) return
      do c = first, last
         k = c - first + 1
         joint%total_slip = table%total_slip(c)
         joint%bonded = table%bonded(c)
         joint%tension_share = extra(c)%tension_share
         joint%length = table%length(c)
         joint%k_n = table%k_n(c)
         excess(k) = abs(table%gap(c) - opening_gap(law, settings, joint))
         position(k) = norm2(table%point(:, c) - table%point(:, first))
      end do
      all_stations = sum(table%length(first:last))
      stations = sum(table%length(first:last), mask=closed)
      if (.not. stations > 0 .or. .not. position(last - first + 1) > 0) return
      ! stations at the ends of edges may be left out: the others stand for the whole
      part = closed_length(position, excess, closed)/position(last - first + 1)*all_stations
      do c = first, last
         if (closed(c - first + 1)) extra(c)%more_length = table%length(c)*(part/stations - 1)
      end do
   end subroutine set_closed_part

   !> Length of the closed part between the first and the last station [length].
   pure real(wp) function closed_length(position, excess, closed) result(length)
      real(wp), intent(in) :: position(:)   !! of the stations, ascending [length]
      real(wp), intent(in) :: excess(:)     !! by which the gap is away from opening or closing, >= 0 [length]
      logical, intent(in) :: closed(:)
      real(wp) :: share
      integer :: k
      length = 0
      do k = 1, size(position) - 1
         share = merge(1.0_wp, 0.0_wp, closed(k))
         if (closed(k) .neqv. closed(k + 1)) then
            share = 0.5_wp
            if (excess(k) + excess(k + 1) > 0) share = merge(excess(k), excess(k + 1), closed(k))/ &
                                                        (excess(k) + excess(k + 1))
         end if
         length = length + share*(position(k + 1) - position(k))
      end do
   end function closed_length

end module rockdda_interaction_closed_part
