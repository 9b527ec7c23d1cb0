! SPDX-License-Identifier: MIT
!> The ligament of a cracked joint: what is left of an interval with tensile strength, by whose largest stress it
!> breaks on.
!>
!> The stations of an interval stand for shares of its length. Once the bond of an end has broken, the station beside
!> it carries the mean stress of its share, not the peak at the tip of the crack: a joint of three stations would hold
!> twice the moment that cracks it. The ligament from a to b is taken as a cross-section that stays plane,
!>
!>     N = sum f_i,   M = sum f_i (x_i - (a + b)/2),   stress at the tip = N/(b - a) + 6 M/(b - a)^2  (at b; - at a)
!>
!> with f_i the tension of its stations at the start of the step. The station at the tip opens where the stress at the
!> tip reaches the tensile strength: its strength is lowered by the ratio of its own stress to that of the tip.
module rockdda_interaction_ligament
   use rockdda_base_kinds, only : wp
   use rockdda_contact_table, only : contact_table_type, contact_state
   use rockdda_interaction_closed_part, only : last_of_interval
   use rockdda_interaction_contact_law, only : contact_law_type, tension_at
   use rockdda_interaction_joint_law, only : joint_extra_type
   implicit none
   private
   public :: set_tip_strengths, tip_shares

contains

   !> Set `extra%tension_share` of all stations beside a broken bond.
   pure subroutine set_tip_strengths(table, laws, extra)
      type(contact_table_type), intent(in) :: table
      type(contact_law_type), intent(in) :: laws(:)    !! per joint material
      type(joint_extra_type), intent(inout) :: extra(:)   !! (>= table%n) at the start of the step
      integer :: first, last
      if (.not. any(laws%tension > 0)) return
      first = 1
      do while (first <= table%n)
         last = last_of_interval(table, first)
         if (last > first .and. .not. table%tied(first)) then
            if (laws(table%joint(first))%tension > 0) &
               call set_tip_strength(table, first, last, laws(table%joint(first)), extra)
         end if
         first = last + 1
      end do
   end subroutine set_tip_strengths

   !> The same for one interval.
   pure subroutine set_tip_strength(table, first, last, law, extra)
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: first, last               !! rows
      type(contact_law_type), intent(in) :: law
      type(joint_extra_type), intent(inout) :: extra(:)
      real(wp) :: position(last - first + 1)
      logical :: bonded(last - first + 1)
      integer :: c
      bonded = table%state(first:last) /= contact_state%open .and. &
               tension_at(law, table%total_slip(first:last), logical(table%bonded(first:last))) > 0
      if (all(bonded) .or. .not. any(bonded)) return
      ! the first station lies at the end of its share, one inside the interval in the middle of it
      position(1) = merge(0.0_wp, 0.5_wp*table%length(first), table%station(first) == 1)
      do c = first + 1, last
         position(c - first + 1) = position(1) + norm2(table%point(:, c) - table%point(:, first))
      end do
      extra(first:last)%tension_share = tip_shares(position, table%length(first:last), &
                                                   -table%normal_force(first:last), bonded)
   end subroutine set_tip_strength

   !> Shares of the tensile strength of the stations of an interval, 1 where they are not at the tip of a crack or carry
   !> no tension.
   pure function tip_shares(position, length, tension, bonded) result(share)
      real(wp), intent(in) :: position(:)   !! of the stations from the beginning of the interval, ascending [length]
      real(wp), intent(in) :: length(:)     !! that they stand for, one after the other [length]
      real(wp), intent(in) :: tension(:)    !! normal forces, tension positive [force]
      logical, intent(in) :: bonded(:)
      real(wp) :: share(size(position))
      real(wp) :: ends(0:size(position)), width, mean, linear
      integer :: a, b, k, n
      n = size(position)
      share = 1
      ends(0) = 0
      do k = 1, n
         ends(k) = ends(k - 1) + length(k)
      end do
      a = 1
      do while (a <= n)
         b = a
         if (bonded(a)) then
            do while (b < n)
               if (.not. bonded(b + 1)) exit
               b = b + 1
            end do
            width = ends(b) - ends(a - 1)
            mean = sum(tension(a:b))/width
            linear = 6*sum(tension(a:b)*(position(a:b) - 0.5_wp*(ends(a - 1) + ends(b))))/width**2
            if (a > 1) share(a) = min(share(a), ratio(tension(a)/length(a), mean - linear))
            if (b < n) share(b) = min(share(b), ratio(tension(b)/length(b), mean + linear))
         end if
         a = b + 1
      end do
   end function tip_shares

   !> Stress of a station over that at the tip, 1 where it is no tension or the larger one.
   pure real(wp) function ratio(own, tip)
      real(wp), intent(in) :: own, tip      !! tension positive [stress]
      ratio = 1
      if (own > 0 .and. tip > own) ratio = own/tip
   end function ratio

end module rockdda_interaction_ligament
