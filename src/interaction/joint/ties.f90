! SPDX-License-Identifier: MIT
!> Ties: intervals by which the cells of intact rock deform as one body, until they break.
!>
!> Stiff springs along an interval would take from cells of uniform strain the freedom to deform. A tie has a stiff mean
!> and, along the normal, a soft linear part: the rock between the centroids of both cells, each with its own modulus,
!>
!>     k = 1/(d_1/E_1 + d_2/E_2),   d the distance of a centroid from the joint,
!>
!> so that a row of cells bends as a beam does; the mean is 1000 times as stiff. Both are those of two equal springs of
!> 1000 k L/2 that stand close to the middle (rockdda_contact_intervals); along the edge these act in the middle
!> (`share_slips`). That is a discontinuous method of linear elements with a weak penalty on the linear part of the jump
!> (Brenner, Owens and Sung 2008); it converges to the continuum.
!>
!>     traction on the interval     mean        sum of the forces / L
!>                                  at the ends mean + or - 6 M/L^2,  M = (force 2 - force 1) a, both a from the middle
!>
!> At the end of a step in which the largest tension exceeds the tensile strength, or the mean shear c + tan(phi)
!> times the mean compression, the whole interval becomes a joint of its material, with the compression and shear that a
!> joint can carry. Without cohesion and tension a tie does not break.
module rockdda_interaction_ties
   use rockdda_base_kinds, only : wp
   use rockdda_contact_interval_law, only : end_gaps, first_place
   use rockdda_contact_intervals, only : tie_place
   use rockdda_contact_table, only : contact_table_type, contact_state
   use rockdda_interaction_joint_strength, only : joint_law_type, shear_strength
   use rockdda_interaction_contact_stiffness, only : joint_stiffness_type
   use rockdda_interaction_joint_response, only : spring_energy
   implicit none
   private
   public :: tie_stiffness, tie_stresses, break_ties

   !> Stiffness of the mean jump over that of the linear part. With 100 triangles miss 1 % of a cantilever's deflection.
   real(wp), parameter :: stiff = 1000.0_wp

contains

   !> Stiffness of one of the two springs [force/length], along the normal and the edge.
   pure real(wp) function tie_stiffness(length, compliance)
      real(wp), intent(in) :: length           !! that the row represents [length]
      real(wp), intent(in) :: compliance       !! of the rock between both centroids [length^3/force]
      tie_stiffness = stiff*length/compliance
   end function tie_stiffness

   !> Stresses of the tie of rows c and c + 1: mean, and what is to be taken from it at the low end and added at the
   !> high one; normal (1), tension positive, and shear (2).
   pure subroutine tie_stresses(table, c, mean, linear)
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: c                     !! first row
      real(wp), intent(out) :: mean(2), linear(2)  !! [force/length^2]
      real(wp) :: length
      length = table%length(c) + table%length(c + 1)
      mean = [-sum(table%normal_force(c:c + 1)), sum(table%shear_force(c:c + 1))]/length
      ! a couple of force times distance is L^2/6 of the linear traction
      linear = 6*(0.5_wp - tie_place)*[table%normal_force(c) - table%normal_force(c + 1), &
                                       table%shear_force(c + 1) - table%shear_force(c)]/length
   end subroutine tie_stresses

   !> Break the ties whose traction exceeds their strength. The table is that of the end of the step.
   pure subroutine break_ties(laws, joint_stiffness, table, gap)
      type(joint_law_type), intent(in) :: laws(:)            !! per joint material
      type(joint_stiffness_type), intent(in) :: joint_stiffness
      type(contact_table_type), intent(inout) :: table
      real(wp), intent(in) :: gap(:)                           !! (n) at the end, less the offset [length]
      real(wp) :: mean(2), linear(2), length, compression, limit
      integer :: c
      do c = 1, table%n - 1
         if (.not. table%tied(c) .or. table%station(c) /= 1) cycle
         associate (law => laws(table%joint(c)))
            if (.not. (law%cohesion > 0 .or. law%tension > 0)) cycle
            call tie_stresses(table, c, mean, linear)
            length = table%length(c) + table%length(c + 1)
            compression = -mean(1)
            limit = shear_strength(law, compression*length, length, .true., 0.0_wp, 0.0_wp)/length
            if (abs(linear(1)) - compression <= law%tension .and. abs(mean(2)) <= limit) cycle
            call become_joint(c, joint_stiffness%of_pair(table%joint(c), table%block_a(c), table%block_b(c)), &
                              max(0.0_wp, compression), mean(2), law, gap(c:c + 1), table)
         end associate
      end do
   end subroutine break_ties

   !> A joint in place of a tie, with the force that a joint can carry.
   pure subroutine become_joint(c, stiffness, compression, shear, law, gap, table)
      integer, intent(in) :: c                     !! first row
      real(wp), intent(in) :: stiffness(2)         !! normal, shear [force/length^2]
      real(wp), intent(in) :: compression, shear   !! of the tie [force/length]
      type(joint_law_type), intent(in) :: law
      real(wp), intent(in) :: gap(2)               !! less the offset [length]
      type(contact_table_type), intent(inout) :: table
      real(wp) :: limit, apart(2), along(2, 2)
      integer :: i, k
      ! from the points of a tie to those of a joint
      apart = spread_out(gap)
      table%offset(c:c + 1) = spread_out(table%offset(c:c + 1))
      table%distance(c:c + 1) = spread_out(table%distance(c:c + 1))
      do i = 1, 2
         along(i, :) = spread_out(table%point(i, c:c + 1))
      end do
      table%point(:, c:c + 1) = along
      table%tied(c:c + 1) = .false.
      table%bonded(c:c + 1) = .false.
      table%bond_end(c:c + 1) = 0
      do k = c, c + 1
         associate (share => table%length(k))
            table%k_n(k) = stiffness(1)*share
            table%k_s(k) = stiffness(2)*share
            if (.not. compression > 0) then
               ! closes where the faces meet again
               table%offset(k) = table%offset(k) + min(0.0_wp, minval(end_gaps(apart)))
               call table%open_row(k)
               cycle
            end if
            limit = shear_strength(law, compression*share, share, .false., 0.0_wp, 0.0_wp)
            table%offset(k) = table%offset(k) + apart(k - c + 1) + compression/stiffness(1)
            table%normal_force(k) = compression*share
            table%shear_force(k) = max(-limit, min(limit, shear*share))
            table%shear(k) = -table%shear_force(k)/table%k_s(k)
            table%state(k) = contact_state%locked
            table%slip_sign(k) = 0
            table%energy(k) = spring_energy(table%k_n(k), table%k_s(k), -compression/stiffness(1), table%shear(k))
         end associate
      end do
   end subroutine become_joint

   !> What is linear along an interval, at the points of a joint, by its values at those of a tie.
   pure function spread_out(at_tie) result(there)
      real(wp), intent(in) :: at_tie(2)
      real(wp) :: there(2)
      there = 0.5_wp*(at_tie(1) + at_tie(2)) + [-0.5_wp, 0.5_wp]*(at_tie(2) - at_tie(1))* &
              ((0.5_wp - first_place)/(0.5_wp - tie_place))
   end function spread_out

end module rockdda_interaction_ties
