! SPDX-License-Identifier: MIT
!> The normal response of an interval of a joint, integrated exactly over the part that is closed.
!>
!>           gap
!>            |\                      The gap is linear along the interval, s = 0 ... 1 from low to high end, and
!>            |  \                    it is known at the two points of Gauss's rule,
!>         ---+----\-------*---- s
!>            |      \.  |                 s1 = (1 - 1/sqrt(3))/2,   s2 = 1 - s1,   g(s) = N1(s) g1 + N2(s) g2
!>            *        \ |
!>            s1      z  s2           A is the closed part: where g <= 0, or where a bond is sound.
!>
!>     E = k L/2 integral over A of g^2 ds      convex where A is not bonded, with a continuous derivative
!>     F = - k L H g,   H_ij = integral over A of N_i N_j ds      forces at the two points, compression positive
!>
!> The tangent is k L H as well: the gap vanishes where A ends, so that what moves there adds nothing. With both ends
!> closed H is one half of the unit matrix: two springs that do not act on each other. The forces of a part at one end
!> are those of its resultant, a third of its length from the end, moved to the two points: one of them may be negative.
!>
!> Source: Winkler foundation without tension, in closed form.
!>
!> So a hinge of which one end is closed by p and the other one open by q is crushed over a length that depends on k. Of
!> a joint whose stiffness is a property that is right. Where it is a penalty on overlap (that of the run), the edge of
!> the block is to bear:
!>
!>     E = k L p^2 (p + q)/(6 (p + 2 q))      and k L p^2/12 far open, as a corner on an edge
!>
!> It is convex too, has the energy and the forces of above where q = 0, and is homogeneous of degree 2 in the gaps, so
!> that F = - k L H g with H its second derivatives.
!>
!> A law that is curved (rockdda_contact_normal_law) is integrated over the closed part by Gauss's rule, on pieces on
!> which its tangent changes by a factor of 2 at most: to rounding. Then
!>
!>     F = k L (P - H g),   H the second derivatives,
!>
!> P what a force is more than that of springs of the stiffness k L H without stress at the gap 0.
module rockdda_contact_interval_law
   use rockdda_base_kinds, only : wp
   use rockdda_contact_normal_law, only : normal_law_type, place_type
   implicit none
   private
   public :: first_place, second_place, overhang, n_points, at_end, end_gaps, at_point, closed_part_type, &
      find_closed_part, cut_bond, part_forces, part_energies, depth_of_energy, press_points

   !> Rows of an interval in the contact table.
   integer, parameter :: n_points = 2
   !> Places of the two points; over the share that both are apart.
   real(wp), parameter :: apart = 0.577350269189625764509_wp
   real(wp), parameter :: first_place = 0.5_wp*(1 - apart), second_place = 0.5_wp*(1 + apart)
   !> What is linear rises by this share of its difference between both points from the higher one to its end.
   real(wp), parameter :: overhang = first_place/apart
   !> Gauss's rule of 8 points on 0 ... 1.
   real(wp), parameter :: half_gauss(4) = [0.183434642495649805_wp, 0.525532409916328986_wp, 0.796666477413626740_wp, &
                                           0.960289856497536232_wp]
   real(wp), parameter :: half_weight(4) = [0.362683783378361983_wp, 0.313706645877887287_wp, 0.222381034453374471_wp, &
                                            0.101228536290376259_wp]
   real(wp), parameter :: gauss_place(8) = 0.5_wp*[1 - half_gauss, 1 + half_gauss]
   real(wp), parameter :: gauss_weight(8) = 0.5_wp*[half_weight, half_weight]
   !> Rounds of Newton's method at most; far from the solution each halves the distance.
   integer, parameter :: most_rounds = 100

   !> The closed part of an interval.
   type :: closed_part_type
      real(wp) :: length          !! share of the interval
      real(wp) :: middle          !! its middle, share of the interval
      real(wp) :: bears           !! share on which a linear stress has its resultant
      real(wp) :: own(2)          !! H_11, H_22
      real(wp) :: cross           !! H_12
      real(wp) :: push(2)         !! P [length]
      real(wp) :: surplus         !! energy beyond half of the forces times the closures [length^2]
   end type closed_part_type
   !> Nothing, and all of the interval.
   type(closed_part_type), parameter :: nothing = closed_part_type(0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, &
                                                                   0.0_wp)
   type(closed_part_type), parameter :: whole = closed_part_type(1.0_wp, 0.5_wp, 1.0_wp, 0.5_wp, 0.0_wp, 0.0_wp, 0.0_wp)

contains

   !> What is linear along the interval, at its low (1) or high (2) end, by what it is at that point and the other one.
   elemental real(wp) function at_end(own, other)
      real(wp), intent(in) :: own, other
      at_end = own + overhang*(own - other)
   end function at_end

   !> The same at both ends, by the gaps at both points.
   pure function end_gaps(gap) result(ends)
      real(wp), intent(in) :: gap(2)
      real(wp) :: ends(2)
      ends = [at_end(gap(1), gap(2)), at_end(gap(2), gap(1))]
   end function end_gaps

   !> What is linear along the interval, at a point that is so near (1) or far (2) from an end, by the values at that
   !> end and the other one.
   elemental real(wp) function at_point(own, other)
      real(wp), intent(in) :: own, other
      at_point = own + first_place*(other - own)
   end function at_point

   !> The closed part for gaps at the two points. A bond is sound from bond(1) to bond(2), nowhere when these are not in
   !> this order. With a penalty what is closed on a part, without a bond, presses the edge of the block (`press_edge`).
   pure subroutine find_closed_part(gap, bond, law, part)
      real(wp), intent(in) :: gap(2)        !! [length]
      real(wp), intent(in) :: bond(2)       !! shares of the interval
      type(normal_law_type), intent(in) :: law
      type(closed_part_type), intent(out) :: part
      real(wp) :: ends(2), closed(2)
      ends(1) = at_end(gap(1), gap(2))
      ends(2) = at_end(gap(2), gap(1))
      part = nothing
      closed = [1.0_wp, 0.0_wp]
      if (ends(1) <= 0 .and. ends(2) <= 0) then
         closed = [0.0_wp, 1.0_wp]
      else if (ends(1) < 0) then
         closed = [0.0_wp, ends(1)/(ends(1) - ends(2))]
      else if (ends(2) < 0) then
         closed = [ends(1)/(ends(1) - ends(2)), 1.0_wp]
      end if
      if (.not. bond(2) > bond(1)) then
         if (.not. closed(2) > closed(1)) return
         if (.not. maxval(ends) > 0) then
            part = whole
         else if (law%penalty) then
            call press_edge(ends, closed, part)
         else
            call add_stretch(closed, part)
         end if
      else if (.not. closed(2) > closed(1)) then
         call add_stretch(bond, part)
      else if (bond(1) > closed(2) .or. closed(1) > bond(2)) then
         call add_stretch(closed, part)
         call add_stretch(bond, part)
      else
         call add_stretch([min(closed(1), bond(1)), max(closed(2), bond(2))], part)
      end if
      if (law%is_curved() .and. closed(2) > closed(1)) call bend(closed, ends, law, part)
   end subroutine find_closed_part

   !> Put a curved law in place of the linear one on the closed stretch.
   pure subroutine bend(closed, ends, law, part)
      real(wp), intent(in) :: closed(2)     !! shares of the interval
      real(wp), intent(in) :: ends(2)       !! gaps at both ends [length]
      type(normal_law_type), intent(in) :: law
      type(closed_part_type), intent(inout) :: part
      type(place_type) :: place
      real(wp) :: n(2), s, gap, weight, more
      real(wp), allocatable :: cuts(:)
      integer :: i, k
      allocate (cuts, source=law%cuts(ends(1) + closed*(ends(2) - ends(1))))
      do k = 1, size(cuts) - 1
         do i = 1, size(gauss_place)
            s = closed(1) + (closed(2) - closed(1))*(cuts(k) + gauss_place(i)*(cuts(k + 1) - cuts(k)))
            weight = gauss_weight(i)*(closed(2) - closed(1))*(cuts(k + 1) - cuts(k))
            gap = min(0.0_wp, ends(1) + s*(ends(2) - ends(1)))
            place = law%at(gap)
            n = [second_place - s, s - first_place]/apart
            more = place%tangent - 1
            part%own = part%own + weight*more*n**2
            part%cross = part%cross + weight*more*n(1)*n(2)
            part%push = part%push + weight*(place%stress + place%tangent*gap)*n
            part%surplus = part%surplus + weight*(place%energy + 0.5_wp*place%stress*gap)
         end do
      end do
   end subroutine bend

   !> Second derivatives of the energy of a penalty, with one end closed by p and the other one open by q. A linear
   !> stress with the same resultant bears on three times its distance from the end.
   pure subroutine press_edge(ends, closed, part)
      real(wp), intent(in) :: ends(2)       !! gaps at both ends, of which one is negative [length]
      real(wp), intent(in) :: closed(2)     !! shares of the interval
      type(closed_part_type), intent(inout) :: part
      real(wp) :: w, toe, far, cross, n(2), m(2)
      w = minval(ends)/(minval(ends) - 2*maxval(ends))
      toe = (2 - (1 - w)**3)/6
      far = 2*w**3/3
      cross = w**2*(3 - 2*w)/6
      n = [second_place, -first_place]/apart     ! of the closed end, by the point next to it and the other one
      m = [-first_place, second_place]/apart     ! of the open end
      part%length = closed(2) - closed(1)
      part%middle = 0.5_wp*(closed(1) + closed(2))
      part%bears = 6*w**2/((1 + w)*(2 + w))
      part%own = toe*n**2 + 2*cross*n*m + far*m**2
      part%cross = toe*n(1)*n(2) + cross*(n(1)*m(2) + n(2)*m(1)) + far*m(1)*m(2)
      if (ends(2) < 0) part%own = part%own([2, 1])
   end subroutine press_edge

   !> Add the integrals over a stretch: exact by the midpoint and the slope, N' = 1/apart.
   pure subroutine add_stretch(stretch, part)
      real(wp), intent(in) :: stretch(2)    !! shares of the interval
      type(closed_part_type), intent(inout) :: part
      real(wp) :: length, middle, n(2), slope
      length = stretch(2) - stretch(1)
      if (.not. length > 0) return
      middle = 0.5_wp*(stretch(1) + stretch(2))
      n = [second_place - middle, middle - first_place]/apart
      slope = (length/apart)**2/12
      part%length = part%length + length
      part%bears = part%length
      part%middle = part%middle + (length/part%length)*(middle - part%middle)
      part%own = part%own + length*(n**2 + slope)
      part%cross = part%cross + length*(n(1)*n(2) - slope)
   end subroutine add_stretch

   !> Forces at the two points, compression positive.
   pure function part_forces(part, stiffness, gap) result(force)
      type(closed_part_type), intent(in) :: part
      real(wp), intent(in) :: stiffness     !! of the whole interval, k L [force/length]
      real(wp), intent(in) :: gap(2)        !! [length]
      real(wp) :: force(2)
      force = -stiffness*[part%own(1)*gap(1) + part%cross*gap(2), part%cross*gap(1) + part%own(2)*gap(2)]
      if (any(abs(part%push) > 0)) force = force + stiffness*part%push
   end function part_forces

   !> Energy, of which each point has a part.
   pure function part_energies(part, stiffness, gap) result(energy)
      type(closed_part_type), intent(in) :: part
      real(wp), intent(in) :: stiffness     !! of the whole interval, k L [force/length]
      real(wp), intent(in) :: gap(2)        !! [length]
      real(wp) :: energy(2)
      energy = -0.5_wp*part_forces(part, stiffness, gap)*gap + 0.5_wp*stiffness*part%surplus
   end function part_energies

   !> Gaps at both points at which an interval that is closed on all its length carries forces there: by Newton's
   !> method, from those of each force alone.
   pure function press_points(law, stiffness, force) result(gap)
      type(normal_law_type), intent(in) :: law
      real(wp), intent(in) :: stiffness     !! of the whole interval, k L [force/length]
      real(wp), intent(in) :: force(2)      !! compression positive
      real(wp) :: gap(2), missing(2)
      type(closed_part_type) :: part
      integer :: round
      gap = -force/law%secant(0.5_wp*stiffness, force)
      if (.not. law%is_curved()) return
      do round = 1, most_rounds
         call find_closed_part(gap, [0.0_wp, 0.0_wp], law, part)
         missing = force - part_forces(part, stiffness, gap)
         if (.not. maxval(abs(missing)) > 4*epsilon(1.0_wp)*maxval(abs(force))) return
         gap = gap - [part%own(2)*missing(1) - part%cross*missing(2), part%own(1)*missing(2) - part%cross*missing(1)]/ &
               (stiffness*(part%own(1)*part%own(2) - part%cross**2))
      end do
   end function press_points

   !> How far an interval is to be pressed together, without turning, to have an energy. Without energy it is 0.
   pure real(wp) function depth_of_energy(gap, stiffness, law, energy) result(depth)
      real(wp), intent(in) :: gap(2)        !! [length]
      real(wp), intent(in) :: stiffness     !! of the whole interval, k L [force/length]
      type(normal_law_type), intent(in) :: law
      real(wp), intent(in) :: energy        !! >= 0
      real(wp) :: ends(2), tilt, short, more
      type(closed_part_type) :: part
      integer :: round
      ends = end_gaps(gap)
      depth = 0
      if (.not. (energy > 0 .and. stiffness > 0)) return
      ! closed on a part from one end, where p is the depth of that end
      tilt = maxval(ends) - minval(ends)
      depth = minval(ends)
      if (law%penalty .and. tilt > 0) then
         ! k L p^2 tilt/(6 (2 tilt - p))
         short = 6*energy/(stiffness*tilt)
         depth = depth + 4*short*tilt/(hypot(short, sqrt(8*short*tilt)) + short)
      else
         ! k L p^3/(6 tilt)
         depth = depth + (6*tilt*energy/stiffness)**(1.0_wp/3)
      end if
      ! on all of it: k L/4 times the squares of the depths of both points
      if (.not. depth - minval(ends) < tilt) &
         depth = 0.5_wp*sum(gap) + sqrt(max(0.0_wp, 2*energy/stiffness - 0.25_wp*(gap(1) - gap(2))**2))
      if (.not. law%is_curved()) return
      ! a stiffer law is less deep, and its energy convex: Newton's method comes down to it
      do round = 1, most_rounds
         call find_closed_part(gap - depth, [0.0_wp, 0.0_wp], law, part)
         more = sum(part_energies(part, stiffness, gap - depth)) - energy
         if (.not. more > 4*epsilon(1.0_wp)*energy) return
         depth = depth - more/sum(part_forces(part, stiffness, gap - depth))
      end do
   end function depth_of_energy

   !> Take from a bond what is stretched beyond its strength.
   pure subroutine cut_bond(gap, widest, bond)
      real(wp), intent(in) :: gap(2)        !! [length]
      real(wp), intent(in) :: widest        !! gap at which it breaks [length]
      real(wp), intent(inout) :: bond(2)    !! shares of the interval
      real(wp) :: ends(2), there(2), limit
      if (.not. bond(2) > bond(1)) return
      ends = end_gaps(gap)
      there = ends(1) + bond*(ends(2) - ends(1))
      if (all(there <= widest)) return
      if (all(there > widest)) then
         bond = [1.0_wp, 0.0_wp]
         return
      end if
      limit = bond(1) + (bond(2) - bond(1))*(widest - there(1))/(there(2) - there(1))
      if (there(1) > widest) then
         bond(1) = limit
      else
         bond(2) = limit
      end if
   end subroutine cut_bond

end module rockdda_contact_interval_law
