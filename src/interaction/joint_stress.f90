! SPDX-License-Identifier: MIT
!> Stresses of joints: the traction at each row of a contact table, from the forces of its springs.
!>
!>     normal stress   - normal force / length       tension positive
!>     shear stress      shear force / length        of the force on block a along the normal, from b to a, turned
!>                                                   by +90 degrees; the same when the blocks are exchanged
!>
!> Stresses of an interval are those at its two ends: of a joint k g where it is closed, of a tie the linear traction with
!> the resultant and the moment of its springs.
module rockdda_interaction_joint_stress
   use rockdda_base_kinds, only : wp
   use rockdda_contact_interval_law, only : first_place, second_place
   use rockdda_contact_table, only : contact_table_type, contact_state, is_of_interval
   use rockdda_interaction_ties, only : tie_stresses
   implicit none
   private
   public :: joint_stresses

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

   !> Stresses at both ends of the interval of rows c and c + 1, by the resultant and its place: trapezoidal while it lies
   !> within the middle third, or where a bond that carries tension is sound, else triangular on three times its distance
   !> from the end, in shear as well.
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
