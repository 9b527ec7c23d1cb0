! SPDX-License-Identifier: MIT
!> Ties: intervals by which the cells of intact rock deform as one body, until they break.
!>
!> Three stations that are all stiff would take from cells of uniform strain the freedom to deform. A tie has a stiff
!> mean and a soft linear part: its middle carries 1000 E/h per length, its ends E/h times L/6, E the smaller modulus of
!> both blocks and h the mean of the square roots of their areas. That is a discontinuous method of linear elements
!> with a weak penalty on the linear part of the jump (Brenner, Owens and Sung 2008); it converges to the continuum.
!>
!>     traction on the interval     mean        sum of the forces / L
!>                                  at the ends mean + or - 6 M/L^2,  M = (force 3 - force 1) L/2
!>
!> At the end of a step in which the largest tension exceeds the tensile strength, or the mean shear c + tan(phi)
!> times the mean compression, the whole interval becomes a joint of its material, with the compression and shear that a
!> joint can carry. Without cohesion and tension a tie does not break.
module rockdda_interaction_ties
   use rockdda_base_kinds, only : wp
   use rockdda_contact_table, only : contact_table_type, contact_state
   use rockdda_interaction_contact_law, only : contact_law_type, shear_strength
   use rockdda_interaction_contact_stiffness, only : joint_stiffness_type
   use rockdda_interaction_joint_end, only : spring_energy
   implicit none
   private
   public :: tie_stiffness, break_ties

   !> Stations of a tie.
   integer, parameter, public :: tie_points = 3
   !> Stiffness of the mean jump over E/h. With 100 triangles miss 1 % of a cantilever's deflection.
   real(wp), parameter :: stiff = 1000.0_wp
   !> Stiffness of the linear part over E/h.
   real(wp), parameter :: soft = 1.0_wp

contains

   !> Stiffness of one station [force/length], along the normal and the edge.
   pure real(wp) function tie_stiffness(station, length, modulus, area_a, area_b)
      integer, intent(in) :: station
      real(wp), intent(in) :: length           !! that the station stands for [length]
      real(wp), intent(in) :: modulus          !! the smaller E [force/length^2]
      real(wp), intent(in) :: area_a, area_b   !! of the blocks [length^2]
      real(wp) :: h
      h = 0.5_wp*(sqrt(area_a) + sqrt(area_b))
      if (station == 1 .or. station == tie_points) then
         tie_stiffness = soft*modulus/h*length
      else
         ! the middle stands for 2 L/3, and carries the mean of L
         tie_stiffness = stiff*modulus/h*length*1.5_wp
      end if
   end function tie_stiffness

   !> Break the ties whose traction exceeds their strength. The table is that of the end of the step.
   pure subroutine break_ties(laws, joint_stiffness, table, gap)
      type(contact_law_type), intent(in) :: laws(:)            !! per joint material
      type(joint_stiffness_type), intent(in) :: joint_stiffness
      type(contact_table_type), intent(inout) :: table
      real(wp), intent(in) :: gap(:)                           !! (n) at the end, less the offset [length]
      real(wp) :: length, compression, shear, linear, tension, limit, share
      integer :: c, k
      do c = 1, table%n - 2
         if (.not. table%tied(c) .or. table%station(c) /= 1) cycle
         associate (law => laws(table%joint(c)), n => table%normal_force(c:c + 2), s => table%shear_force(c:c + 2))
            if (.not. (law%cohesion > 0 .or. law%tension > 0)) cycle
            length = sum(table%length(c:c + 2))
            compression = sum(n)/length
            shear = sum(s)/length
            linear = 3*abs(n(3) - n(1))/length
            tension = linear - compression
            limit = shear_strength(law, compression*length, length, .true., 0.0_wp, 0.0_wp)/length
            if (tension <= law%tension .and. abs(shear) <= limit) cycle
            do k = c, c + 2
               share = table%length(k)
               call become_joint(k, joint_stiffness%of_pair(table%joint(c), table%block_a(c), &
                                                          table%block_b(c))*share, &
                                 max(0.0_wp, compression)*share, shear*share, law, gap(k), table)
            end do
         end associate
      end do
   end subroutine break_ties

   !> A station of a joint in place of one of a tie, with the force that a joint can carry.
   pure subroutine become_joint(c, stiffness, compression, shear, law, gap, table)
      integer, intent(in) :: c                     !! row
      real(wp), intent(in) :: stiffness(2)         !! normal, shear [force/length]
      real(wp), intent(in) :: compression, shear   !! of the tie [force]
      type(contact_law_type), intent(in) :: law
      real(wp), intent(in) :: gap                  !! less the offset [length]
      type(contact_table_type), intent(inout) :: table
      real(wp) :: limit
      table%tied(c) = .false.
      table%bonded(c) = .false.
      table%k_n(c) = stiffness(1)
      table%k_s(c) = stiffness(2)
      if (.not. compression > 0) then
         ! closes where the faces meet again
         table%offset(c) = table%offset(c) + min(0.0_wp, gap)
         call table%open_row(c)
         return
      end if
      limit = shear_strength(law, compression, table%length(c), .false., 0.0_wp, 0.0_wp)
      table%offset(c) = table%offset(c) + gap + compression/stiffness(1)
      table%normal_force(c) = compression
      table%shear_force(c) = max(-limit, min(limit, shear))
      table%shear(c) = -table%shear_force(c)/stiffness(2)
      table%state(c) = contact_state%locked
      table%slip_sign(c) = 0
      table%energy(c) = spring_energy(stiffness(1), stiffness(2), -compression/stiffness(1), table%shear(c))
   end subroutine become_joint

end module rockdda_interaction_ties
