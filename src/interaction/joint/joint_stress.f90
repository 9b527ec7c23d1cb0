! SPDX-License-Identifier: MIT
!> Stresses of joints: the traction at each row of a contact table, from the forces of its springs.
!>
!>     normal stress   - normal force / length       tension positive
!>     shear stress      shear force / length        of the force on block a along the normal, from b to a, turned
!>                                                   by +90 degrees; the same when the blocks are exchanged
!>
!> Stresses of an interval are those at its two ends: of a joint k g where it is closed, of a tie the linear traction
!> with the resultant and the moment of its springs. And the share of their shear strength that joints mobilise, by the
!> laws of the joints with the bonds and the slip that they have.
module rockdda_interaction_joint_stress
   use rockdda_base_kinds, only : wp
   use rockdda_contact_interval_law, only : first_place, second_place
   use rockdda_contact_table, only : contact_table_type, contact_state, is_of_interval
   use rockdda_interaction_joint_strength, only : joint_law_type
   use rockdda_interaction_intervals, only : interval_response_type, respond
   use rockdda_interaction_joint_response, only : joint_settings_type, joint_type, joint_extra_type, recall_joint, &
      strength
   use rockdda_interaction_ties, only : tie_stresses
   implicit none
   private
   public :: joint_stresses, mobilised_shares

   !> Points of an interval.
   real(wp), parameter :: places(2) = [first_place, second_place]

contains

   !> Normal (1) and shear (2) stress of all rows, or of those from `first` on, where no interval is cut; zero for open
   !> rows and for rows without a length.
   pure subroutine joint_stresses(table, stress, first, holds)
      type(contact_table_type), intent(in) :: table
      real(wp), intent(out) :: stress(:, :)        !! (2, rows) [force/length^2]
      integer, intent(in), optional :: first       !! default 1
      logical, intent(in), optional :: holds(:)    !! (joint materials) bonds carry tension; default: all
      real(wp) :: mean(2), linear(2)
      logical :: bond_holds
      integer :: c, k, before
      before = 0
      if (present(first)) before = first - 1
      stress = 0
      do k = 1, min(size(stress, 2), table%n - before)
         c = before + k
         if (table%state(c) == contact_state%open .or. .not. table%length(c) > 0) cycle
         if (.not. is_of_interval(table, c)) then
            stress(:, k) = [-table%normal_force(c), table%shear_force(c)]/table%length(c)
         else if (table%station(c) == 1) then
            if (table%tied(c)) then
               call tie_stresses(table, c, mean, linear)
               stress(:, k) = mean - linear
               stress(:, k + 1) = mean + linear
            else
               bond_holds = .true.
               if (present(holds) .and. table%joint(c) > 0) bond_holds = holds(table%joint(c))
               stress(:, k:k + 1) = interval_stresses(table, c, bond_holds)
            end if
         end if
      end do
   end subroutine joint_stresses

   !> Shear force over shear strength of all rows, or of those from `first` on, where no interval is cut: both rows of
   !> an interval have that of the interval; 1 where a joint slides. 0 for open rows and where there is no strength:
   !> ties that do not break, joints without friction and cohesion.
   pure subroutine mobilised_shares(laws, table, share, first)
      type(joint_law_type), intent(in) :: laws(:)     !! per joint material
      type(contact_table_type), intent(in) :: table
      real(wp), intent(out) :: share(:)                 !! (rows) [-]
      integer, intent(in), optional :: first            !! default 1
      integer :: c, k, before
      before = 0
      if (present(first)) before = first - 1
      share = 0
      do k = 1, min(size(share), table%n - before)
         c = before + k
         if (table%state(c) == contact_state%open .or. table%station(c) == 2) cycle
         if (table%station(c) == 1) then
            share(k:k + 1) = mobilised(laws(table%joint(c)), table, c, c + 1)
         else
            share(k) = mobilised(laws(table%joint(c)), table, c, c)
         end if
      end do
   end subroutine mobilised_shares

   !> `mobilised_shares` of a contact, or of an interval.
   pure real(wp) function mobilised(law, table, first, last) result(share)
      type(joint_law_type), intent(in) :: law
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: first, last                !! rows
      type(joint_extra_type), allocatable :: none(:)
      type(interval_response_type) :: interval
      type(joint_type) :: joint
      real(wp) :: bond(2), limit, pressing
      share = 0
      if (table%tied(first) .and. .not. (law%cohesion > 0 .or. law%tension > 0)) return
      joint%bonded = table%tied(first) .or. all(table%bonded(first:last))
      call recall_joint(table, first, joint%joint_state_type, none, joint)
      pressing = sum(table%normal_force(first:last))/(last - first + 1)
      joint%length = sum(table%length(first:last))/(last - first + 1)
      if (last > first .and. .not. table%tied(first)) then
         bond = table%bond_end(first:last)
         call respond(law, table, first, logical(joint%bonded), table%gap(first:last), 0.0_wp, bond, interval)
         joint%length = interval%length
         joint%broken = interval%broken
      end if
      limit = strength(law, joint_settings_type(), joint, pressing, logical(joint%bonded), 0.0_wp)
      if (limit > 0) share = abs(sum(table%shear_force(first:last)))/((last - first + 1)*limit)
      if (limit > 0 .and. any(table%state(first:last) == contact_state%sliding)) share = 1
   end function mobilised

   !> Stresses at both ends of the interval of rows c and c + 1, by the resultant and its place: trapezoidal while it
   !> lies within the middle third, or where a bond that carries tension is sound, else triangular on three times its
   !> distance from the end, in shear as well.
   pure function interval_stresses(table, c, bond_holds) result(stress)
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: c
      logical, intent(in) :: bond_holds
      real(wp) :: stress(2, 2)   !! (normal and shear, ends) [force/length^2]
      real(wp) :: force(2), length, total, place, closed
      length = table%length(c) + table%length(c + 1)
      force = table%normal_force(c:c + 1)
      total = sum(force)
      stress(1, :) = -[4*total - 6*dot_product(force, places), 6*dot_product(force, places) - 2*total]/length
      stress(2, :) = sum(table%shear_force(c:c + 1))/length
      if (.not. total > 0 .or. (bond_holds .and. table%bond_end(c + 1) > table%bond_end(c))) return
      place = dot_product(force, places)/total
      closed = min(place, 1 - place)
      if (3*closed >= 1) return
      stress(1, :) = merge(-2*total/(3*closed*length), 0.0_wp, [place < 0.5_wp, place > 0.5_wp])
      stress(2, :) = merge(2*stress(2, :)/(3*closed), 0.0_wp, abs(stress(1, :)) > 0)
   end function interval_stresses

end module rockdda_interaction_joint_stress
