! SPDX-License-Identifier: MIT
!> Intervals and corners that take each other's place from one step to the next, with contact by length: an edge that
!> comes down on its corner, or leaves on it, carries on the force and the energy of the springs before.
module rockdda_contact_interval_history
   use rockdda_base_kinds, only : wp
   use rockdda_contact_interval_law, only : at_end, end_gaps, depth_of_energy
   use rockdda_contact_normal_law, only : normal_law_type
   use rockdda_contact_search_limits, only : search_limits_type
   use rockdda_contact_table, only : contact_table_type, contact_state
   implicit none
   private
   public :: stand_for_interval, begin_intervals, keep_deeper, depth_of

contains

   !> The row of a corner stands where an interval was pressed together at that end. It gets the length and the
   !> compression with which one spring has the force and the energy of the whole interval; along the edge the force, or
   !> less where a spring of that length would have more energy with it.
   pure subroutine stand_for_interval(previous, row, k, depth, table)
      type(contact_table_type), intent(in) :: previous
      integer, intent(in) :: row             !! of the interval, at this end
      integer, intent(in) :: k
      real(wp), intent(out) :: depth         !! [length]
      type(contact_table_type), intent(inout) :: table
      real(wp) :: force, energy, shear, most, stiffness, distance(2)
      integer :: other
      other = row + merge(1, -1, previous%station(row) == 1)
      distance = at_end(previous%distance([row, other]), previous%distance([other, row]))
      force = previous%normal_force(row) + previous%normal_force(other)
      energy = sum(normal_energy(previous, [row, other]))
      depth = 0
      if (.not. (force > 0 .and. energy > 0) .or. distance(1) > distance(2)) then
         call table%open_row(k)
         table%offset(k) = min(0.0_wp, table%gap(k))
         return
      end if
      depth = 2*energy/force
      table%normal_force(k) = force
      table%energy(k) = sum(previous%energy([row, other]))
      shear = previous%k_s(row)*(previous%shear(row) + previous%shear(other))
      table%length(k) = force/(previous%k_n(row)/previous%length(row)*depth)
      stiffness = previous%k_s(row)/previous%length(row)*table%length(k)
      most = sqrt(previous%k_s(row)*(previous%shear(row)**2 + previous%shear(other)**2)/stiffness)
      table%shear(k) = sign(min(abs(shear)/stiffness, most), shear)
   end subroutine stand_for_interval

   !> Energy in the normal spring of a row at the end of its step.
   elemental real(wp) function normal_energy_of(energy, k_s, shear)
      real(wp), intent(in) :: energy, k_s, shear
      normal_energy_of = energy - 0.5_wp*k_s*shear**2
   end function normal_energy_of

   !> Energy in the normal springs of some rows at the end of their step.
   pure function normal_energy(table, rows) result(energy)
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: rows(:)
      real(wp) :: energy(size(rows))
      energy = normal_energy_of(table%energy(rows), table%k_s(rows), table%shear(rows))
   end function normal_energy

   !> Intervals without history of their own.
   pure subroutine begin_intervals(previous, source, pressed, limits, table)
      type(contact_table_type), intent(in) :: previous
      integer, intent(in) :: source(:)       !! (>= rows) < 0: row of a corner of the last step at that end; 0 none
      integer, intent(in) :: pressed(:)      !! (nv) row of the last step that is compressed most, of each edge
      type(search_limits_type), intent(in) :: limits
      type(contact_table_type), intent(inout) :: table
      integer :: k
      do k = 1, table%n
         if (table%station(k) /= 1) cycle
         if (source(k) > 0) cycle
         ! free of force, as deep as it is found
         table%offset(k:k + 1) = min(0.0_wp, minval(end_gaps(table%distance(k:k + 1))))
         table%bonded(k:k + 1) = all(table%bonded(k:k + 1))
         table%tied(k:k + 1) = all(table%tied(k:k + 1))
         if (.not. table%bonded(k)) table%bond_end(k:k + 1) = 0
         if (any(table%state(k:k + 1) /= contact_state%open)) table%state(k:k + 1) = contact_state%locked
         table%gap(k:k + 1) = table%distance(k:k + 1) - table%offset(k:k + 1)
         if (any(source(k:k + 1) < 0)) then
            call stand_for_corners(previous, -source(k:k + 1), limits%law_of(table%joint(k)), k, table)
         else
            call press_like_others(previous, pressed, limits, k, table)
         end if
      end do
   end subroutine begin_intervals

   !> An interval that is as close as the corners at its ends were. It is pressed together until it has the energy of
   !> their normal springs, and carries their shear forces.
   pure subroutine stand_for_corners(previous, rows, law, k, table)
      type(contact_table_type), intent(in) :: previous
      integer, intent(in) :: rows(2)         !! of corners at the low and the high end, 0 none
      type(normal_law_type), intent(in) :: law
      integer, intent(in) :: k
      type(contact_table_type), intent(inout) :: table
      real(wp) :: energy, shear, stiffness(2), free
      integer :: i, row
      energy = 0
      shear = 0
      stiffness = 0
      free = 0
      do i = 1, 2
         row = rows(i)
         if (row == 0) cycle
         energy = energy + normal_energy_of(previous%energy(row), previous%k_s(row), previous%shear(row))
         shear = shear + previous%k_s(row)*previous%shear(row)
         stiffness = [previous%k_n(row), previous%k_s(row)]/previous%length(row)
         free = max(free, previous%offset(row))
         table%state(k:k + 1) = previous%state(row)
         table%slip_sign(k:k + 1) = previous%slip_sign(row)
         table%total_slip(k:k + 1) = previous%total_slip(row)
         table%normal_force(k:k + 1) = 0.5_wp*previous%normal_force(row)
      end do
      table%k_n(k:k + 1) = stiffness(1)*table%length(k:k + 1)
      table%k_s(k:k + 1) = stiffness(2)*table%length(k:k + 1)
      table%offset(k:k + 1) = table%offset(k) + &
                              depth_of_energy(table%gap(k:k + 1), sum(table%k_n(k:k + 1)), law, energy)
      table%offset(k:k + 1) = min(free, table%offset(k))
      table%gap(k:k + 1) = table%distance(k:k + 1) - table%offset(k:k + 1)
      table%shear(k:k + 1) = 0.5_wp*shear/table%k_s(k:k + 1)
      table%energy(k:k + 1) = 0.5_wp*sum(previous%energy(pack(rows, rows > 0)))
   end subroutine stand_for_corners

   !> A new interval is as deep in the other block as the springs beside it on the same edges are compressed, the rest
   !> of its depth is free of force. Where these are free of force at a gap, by the initial stress, that is its gap too.
   pure subroutine press_like_others(previous, pressed, limits, k, table)
      type(contact_table_type), intent(in) :: previous
      integer, intent(in) :: pressed(:)
      type(search_limits_type), intent(in) :: limits
      integer, intent(in) :: k
      type(contact_table_type), intent(inout) :: table
      real(wp) :: free, lowest
      integer :: row
      row = max(pressed(table%vertex(k)), 0)
      if (row == 0) then
         row = max(pressed(table%edge(k)), 0)
      else if (pressed(table%edge(k)) > 0) then
         call keep_deeper(previous, limits, pressed(table%edge(k)), row)
      end if
      if (row == 0) return
      free = max(0.0_wp, previous%offset(row))
      lowest = minval(end_gaps(table%distance(k:k + 1)))
      if (lowest >= free) return
      table%offset(k:k + 1) = min(free, lowest + max(0.0_wp, depth_of(previous, limits, row)))
      table%gap(k:k + 1) = table%distance(k:k + 1) - table%offset(k:k + 1)
      table%state(k:k + 1) = previous%state(row)
      table%shear(k:k + 1) = previous%shear(row)
      table%slip_sign(k:k + 1) = previous%slip_sign(row)
      table%total_slip(k:k + 1) = previous%total_slip(row)
      table%normal_force(k:k + 1) = 0
   end subroutine press_like_others

   !> Row c instead of a row that is compressed less.
   pure subroutine keep_deeper(table, limits, c, row)
      type(contact_table_type), intent(in) :: table
      type(search_limits_type), intent(in) :: limits
      integer, intent(in) :: c
      integer, intent(inout) :: row
      if (row > 0) then
         if (depth_of(table, limits, row) >= depth_of(table, limits, c)) return
      end if
      row = c
   end subroutine keep_deeper

   !> Compression of the normal spring of a row at the end of its step.
   pure real(wp) function depth_of(table, limits, row)
      type(contact_table_type), intent(in) :: table
      type(search_limits_type), intent(in) :: limits
      integer, intent(in) :: row
      type(normal_law_type) :: law
      law = limits%law_of(table%joint(row))
      depth_of = table%normal_force(row)/law%secant(table%k_n(row), table%normal_force(row))
   end function depth_of

end module rockdda_contact_interval_history
