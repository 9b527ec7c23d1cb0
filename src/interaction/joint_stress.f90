! SPDX-License-Identifier: MIT
!> Stresses of joints: the traction at each row of a contact table, from the forces of its springs.
!>
!>     normal stress   - normal force / length       tension positive
!>     shear stress      shear force / length        of the force on block a along the normal, from b to a, turned
!>                                                   by +90 degrees; the same when the blocks are exchanged
!>
!> The middle of a tie carries the mean of the interval and its ends the linear part (rockdda_interaction_ties). The
!> stresses of a tie are the linear traction with the same resultant and moment: mean -/+ 3 (force 3 - force 1)/L at the
!> ends, the mean in the middle.
module rockdda_interaction_joint_stress
   use rockdda_base_kinds, only : wp
   use rockdda_contact_table, only : contact_table_type, contact_state
   use rockdda_interaction_ties, only : tie_points
   implicit none
   private
   public :: joint_stresses

contains

   !> Normal (1) and shear (2) stress of all rows, or of those from `first` on, where no interval is cut; zero for open
   !> rows and for rows without a length.
   pure subroutine joint_stresses(table, stress, first)
      type(contact_table_type), intent(in) :: table
      real(wp), intent(out) :: stress(:, :)        !! (2, rows) [force/length^2]
      integer, intent(in), optional :: first       !! default 1
      integer :: c, k, before
      before = 0
      if (present(first)) before = first - 1
      stress = 0
      do k = 1, min(size(stress, 2), table%n - before)
         c = before + k
         if (table%state(c) == contact_state%open .or. .not. table%length(c) > 0) cycle
         if (.not. table%tied(c)) then
            stress(:, k) = [-table%normal_force(c), table%shear_force(c)]/table%length(c)
         else if (table%station(c) == 1) then
            stress(:, k:k + tie_points - 1) = tie_stress(table, c, c + tie_points - 1)
         end if
      end do
   end subroutine joint_stresses

   !> Stresses of the tie of rows first to last.
   pure function tie_stress(table, first, last) result(stress)
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: first, last
      real(wp) :: stress(2, tie_points)   !! [force/length^2]
      real(wp) :: length, mean(2), linear(2)
      length = sum(table%length(first:last))
      mean = [-sum(table%normal_force(first:last)), sum(table%shear_force(first:last))]/length
      linear = 3*[table%normal_force(first) - table%normal_force(last), &
                  table%shear_force(last) - table%shear_force(first)]/length
      stress(:, 1) = mean - linear
      stress(:, 2) = mean
      stress(:, tie_points) = mean + linear
   end function tie_stress

end module rockdda_interaction_joint_stress
