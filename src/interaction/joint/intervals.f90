! SPDX-License-Identifier: MIT
!> Intervals among the contacts of a step: whether they are open or closed, and on which part, by their gaps; and what
!> they do with both rows at a time (rockdda_contact_interval_law).
!>
!> Both rows of an interval are open, or none is. Closed on all its length it is two contacts like any others. Closed on
!> a part, or held by a bond, its forces along the normal depend on the gaps of both rows. It slides as two contacts in
!> one place, of which each has half of the force that presses it together and of the length that is closed.
module rockdda_interaction_intervals
   use rockdda_base_kinds, only : wp
   use rockdda_base_parallel, only : parallel_contacts
   use rockdda_contact_interval_law, only : closed_part_type, first_place, overhang, at_end, end_gaps, &
      find_closed_part, cut_bond, part_forces
   use rockdda_contact_table, only : contact_table_type, contact_state, is_of_interval, other_row
   use rockdda_interaction_joint_strength, only : joint_law_type, tension_at
   implicit none
   private
   public :: find_extremes, share_slips, slipping_share, couple_of, end_gap, mean_gap, interval_response_type, &
      is_two_springs, respond, place_to_linearise, bond_after

   !> Largest closure at which a joint that has been open is linearised, share of the largest one of its law.
   real(wp), parameter :: first_closure = 0.9_wp

   !> How far the share by which an interval resists slip goes in a static step towards that which is closed, and by
   !> which share of it both may differ. Shear and what is closed decide on each other from step to step: all the way,
   !> or without play, stiff joints of soft blocks (k L/E = 200) take 100 to 300 steps to come to rest, now 25 to 80.
   real(wp), parameter :: way_to_closed = 0.75_wp, play = 0.1_wp

   !> An interval at a motion.
   type :: interval_response_type
      type(closed_part_type) :: part
      real(wp) :: own(2), cross           !! stiffness along the normal [force/length]
      real(wp) :: push(2)                 !! forces less those of the stiffness at the gaps, 0 of a linear law
      real(wp) :: force(2)                !! of the springs at both points, compression positive
      real(wp) :: energy(2)               !! of the springs: the part of each point
      real(wp) :: pressing                !! half of the whole force, by which each row slides
      real(wp) :: length                  !! half of the length that is closed [length]
      real(wp) :: broken                  !! of that what has lost its bond [length]
      real(wp) :: lowest                  !! smaller gap of both ends [length]
   end type interval_response_type

contains

   !> Gap at the end that row c of an interval is next to, by the gaps of both rows; of other contacts their gap.
   pure real(wp) function end_gap(table, gap, c)
      type(contact_table_type), intent(in) :: table
      real(wp), intent(in), contiguous :: gap(:)       !! (>= rows) [length]
      integer, intent(in) :: c
      end_gap = gap(c)
      if (is_of_interval(table, c)) end_gap = at_end(gap(c), gap(other_row(table, c)))
   end function end_gap

   !> Gap by which the springs of row c are pressed that its friction depends on: its own, or the mean of both rows of
   !> an interval.
   pure real(wp) function mean_gap(table, gap, c)
      type(contact_table_type), intent(in) :: table
      real(wp), intent(in), contiguous :: gap(:)       !! (>= rows) [length]
      integer, intent(in) :: c
      mean_gap = gap(c)
      if (is_of_interval(table, c)) mean_gap = 0.5_wp*(gap(c) + gap(other_row(table, c)))
   end function mean_gap

   !> By which gaps contacts are open or closed: the gap, or the smaller one of both ends of an interval (`lowest`), and
   !> the gap, or what is beyond any limit where an interval is not closed on all its length (`widest`); and `mean_gap`.
   pure subroutine find_extremes(table, first, last, gap, lowest, widest, mean)
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: first, last               !! rows; no interval is cut
      real(wp), intent(in), contiguous :: gap(:)       !! (last - first + 1) [length]
      real(wp), intent(inout), contiguous :: lowest(:), widest(:), mean(:)   !! (>= last - first + 1) [length]
      real(wp) :: beyond, most
      integer :: c, k
      c = first
      do while (c <= last)
         k = c - first + 1
         if (table%station(c) == 1) then
            ! `end_gaps`, without a call
            beyond = overhang*abs(gap(k) - gap(k + 1))
            lowest(k:k + 1) = min(gap(k), gap(k + 1)) - beyond
            most = max(gap(k), gap(k + 1)) + beyond
            widest(k:k + 1) = merge(most, huge(1.0_wp), most <= 0)
            mean(k:k + 1) = 0.5_wp*(gap(k) + gap(k + 1))
            c = c + 2
         else
            lowest(k) = gap(k)
            widest(k) = gap(k)
            mean(k) = gap(k)
            c = c + 1
         end if
      end do
   end subroutine find_extremes

   !> Are the rows of an interval two springs like others at these gaps: by a linear law, closed on all its length?
   pure logical function is_two_springs(law, gap)
      type(joint_law_type), intent(in) :: law
      real(wp), intent(in) :: gap(2)                   !! [length]
      is_two_springs = maxval(end_gaps(gap)) <= 0 .and. .not. law%normal%is_curved()
   end function is_two_springs

   !> How rows slip in a step. Both of an interval slip in the middle of the part that is closed (`lean`), others at
   !> their points: that blocks of other strain stretch along each other costs nothing. With a slip at each point layers
   !> that a stiff joint bonds bend by 3 to 80 % of a beam of the same cells.
   !>
   !> Its springs have in the step the stiffness of what is closed and the elongation of that. Between steps the
   !> elongation is the mean of the interval: force = k_s of the whole length times elongation, at any closure. Half
   !> of what the elongations of both rows differ by, of a stress that varies along a joint, is kept (`twist`): a couple
   !> that stretches the blocks along each other, until the joint slides.
   subroutine share_slips(laws, table, lean, twist)
      type(joint_law_type), intent(in) :: laws(:)           !! per joint material
      type(contact_table_type), intent(inout) :: table        !! of the step's start
      !> (3, >= rows) From the point of each row, and the distance of the blocks there; of a vertex 0 [length].
      real(wp), allocatable, intent(inout) :: lean(:, :)
      !> (>= rows) Elongation less that of the interval, 0 of other rows [length].
      real(wp), allocatable, intent(inout) :: twist(:)
      real(wp) :: high, way(3)
      integer :: c
      if (allocated(twist)) then
         if (size(twist) < table%n) deallocate (lean, twist)
      end if
      if (.not. allocated(twist)) allocate (lean(3, table%n + table%n/4), twist(table%n + table%n/4))
      !$omp parallel do default(none) shared(laws, table, lean, twist) private(c, high, way) &
      !$omp schedule(static) if (table%n > parallel_contacts)
      do c = 1, table%n
         if (table%station(c) == 2) cycle
         twist(c) = 0
         lean(1:2, c) = 0
         lean(3, c) = merge(table%distance(c), 0.0_wp, table%share(c) > 0 .and. table%share(c) < 1)
         if (table%station(c) /= 1) cycle
         twist(c + 1) = 0
         high = 0.5_wp
         if (table%state(c) /= contact_state%open .and. .not. table%tied(c)) then
            high = middle_of(laws(table%joint(c)), table, c)
            if (abs(table%shear(c) - table%shear(c + 1)) > 0) call part_shears(c, table, twist)
            table%closed(c + 1) = table%closed(c)
            associate (closed => table%closed(c))
               if (closed < 1) then
                  table%k_s(c:c + 1) = closed*table%k_s(c:c + 1)
                  table%shear(c:c + 1) = table%shear(c:c + 1)/closed
                  twist(c:c + 1) = twist(c:c + 1)/closed
               end if
            end associate
         end if
         way = rows_apart(table, c)
         lean(:, c) = lean(:, c) + high*way
         lean(:, c + 1) = [0.0_wp, 0.0_wp, table%distance(c + 1)] - (1 - high)*way
      end do
      !$omp end parallel do
   end subroutine share_slips

   !> Middle of the closed part of an interval between its points, 0 ... 1.
   pure real(wp) function middle_of(law, table, c) result(high)
      type(joint_law_type), intent(in) :: law
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: c                         !! first row
      type(interval_response_type) :: interval
      real(wp) :: bond(2)
      high = 0.5_wp
      if (maxval(end_gaps(table%gap(c:c + 1))) <= 0) return
      ! where it touches without force, rounding would decide on which part it is closed
      if (.not. any(abs(table%normal_force(c:c + 1)) > 0)) return
      bond = table%bond_end(c:c + 1)
      call respond(law, table, c, logical(table%bonded(c) .and. table%bonded(c + 1)), &
                   table%gap(c:c + 1), 0.0_wp, bond, interval)
      if (interval%part%length > 0) high = (interval%part%middle - first_place)/(1 - 2*first_place)
   end function middle_of

   !> Share of its length by which an interval resists slip after a static step, by that of this one and by what is
   !> closed at its end; all of it where the stiffness is a penalty. (In dynamic steps it stays: a joint that rocks
   !> would lose a part of its shear in each cycle, which only the elongation of each of its points gives right.)
   pure real(wp) function slipping_share(law, now, part) result(next)
      type(joint_law_type), intent(in) :: law
      real(wp), intent(in) :: now                      !! > 0
      type(closed_part_type), intent(in) :: part
      next = now
      if (law%normal%penalty .or. .not. part%length > 0) return
      if (abs(part%length - now) > play*now) next = now + way_to_closed*(part%length - now)
   end function slipping_share

   !> The mean elongation for both rows of an interval, and what they differ by, until the joint slides.
   pure subroutine part_shears(c, table, twist)
      integer, intent(in) :: c                         !! first row
      type(contact_table_type), intent(inout) :: table
      real(wp), intent(inout), contiguous :: twist(:)  !! (>= rows) [length]
      if (.not. any(table%total_slip(c:c + 1) > 0)) &
         twist(c:c + 1) = [0.5_wp, -0.5_wp]*(table%shear(c) - table%shear(c + 1))
      table%shear(c:c + 1) = 0.5_wp*(table%shear(c) + table%shear(c + 1))
   end subroutine part_shears

   !> Couple by which the shear springs of an interval stretch its blocks along each other: load on the strains of its
   !> first block, of the second one the negative.
   pure function couple_of(table, twist, c) result(load)
      type(contact_table_type), intent(in) :: table           !! of the step's start
      real(wp), intent(in), contiguous :: twist(:)     !! (>= rows) of `share_slips` [length]
      integer, intent(in) :: c                         !! first row
      real(wp) :: load(3)                              !! [force*length]
      real(wp) :: way(3), t(2)
      way = rows_apart(table, c)
      t = [-table%normal(2, c), table%normal(1, c)]
      load = table%k_s(c)*twist(c)*dot_product(way(1:2), t)*[t(1)**2, t(2)**2, t(1)*t(2)]
   end function couple_of

   !> From the first row of an interval to the second one: of their points, and of the distance of the blocks there.
   pure function rows_apart(table, c) result(way)
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: c                         !! first row
      real(wp) :: way(3)                               !! [length]
      way = [table%point(1, c + 1) - table%point(1, c), table%point(2, c + 1) - table%point(2, c), &
             table%distance(c + 1) - table%distance(c)]
   end function rows_apart

   !> Part of an interval on which a bond is sound at the end of a step: what slip and opening do not break for good is
   !> sound wherever the interval is closed.
   pure function bond_after(law, bond, gap) result(after)
      type(joint_law_type), intent(in) :: law
      real(wp), intent(in) :: bond(2)                  !! in the step
      real(wp), intent(in) :: gap(2)                   !! at its end [length]
      real(wp) :: after(2), ends(2), closed(2)
      after = bond
      if (.not. law%residual_tension > 0) return
      ends = end_gaps(gap)
      if (.not. any(ends < 0)) return
      closed = [0.0_wp, 1.0_wp]
      if (ends(1) > 0) closed(1) = ends(1)/(ends(1) - ends(2))
      if (ends(2) > 0) closed(2) = ends(1)/(ends(1) - ends(2))
      after = closed
      if (bond(2) > bond(1)) after = [min(bond(1), closed(1)), max(bond(2), closed(2))]
   end function bond_after

   !> An interval at a motion. Its bond breaks where it is stretched beyond its strength, or, without tensile strength,
   !> where it opens.
   pure subroutine respond(law, table, c, bonded, gap, slack, bond, interval)
      type(joint_law_type), intent(in) :: law
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: c                         !! first row
      logical, intent(in) :: bonded                    !! both rows
      real(wp), intent(in) :: gap(2)                   !! [length]
      real(wp), intent(in) :: slack                    !! gap up to which it is not open [length]
      real(wp), intent(inout) :: bond(2)               !! part on which the bond is sound
      type(interval_response_type), intent(out) :: interval
      real(wp) :: stiffness, length, tension
      real(wp) :: holding(2)   ! part on which the bond carries tension
      holding = 0
      stiffness = table%k_n(c) + table%k_n(c + 1)
      length = table%length(c) + table%length(c + 1)
      interval%lowest = min(gap(1), gap(2)) - overhang*abs(gap(1) - gap(2))
      if (bond(2) > bond(1)) then
         tension = tension_at(law, maxval(table%total_slip(c:c + 1)), bonded)
         if (tension > 0 .and. stiffness > 0) then
            call cut_bond(gap, tension*length/stiffness, bond)
            if (bond(2) > bond(1)) holding = bond
         else
            ! it carries shear alone, where the gap is not open
            call cut_bond(gap, slack, bond)
         end if
         if (.not. bond(2) > bond(1)) bond = 0
      end if
      call find_closed_part(gap, holding, law%normal, interval%part)
      interval%own = stiffness*interval%part%own
      interval%cross = stiffness*interval%part%cross
      interval%push = stiffness*interval%part%push
      interval%force = part_forces(interval%part, stiffness, gap)
      ! half of force times closure, and of a curved law what it has beyond
      interval%energy = 0.5_wp*stiffness*interval%part%surplus - 0.5_wp*interval%force*gap
      interval%pressing = 0.5_wp*sum(interval%force)
      interval%length = 0.5_wp*length*interval%part%bears
      interval%broken = broken_length(interval%length, bond(2) - bond(1), interval%part%length)
   end subroutine respond

   !> Gaps of both rows at which a curved law of an interval is to be linearised after a solve. Those of the motion,
   !> unless the law is so curved that its stiffness there says nothing of the one at the force that the solve gave it:
   !> then those at which it has this force. One that has been open has no force yet, and begins within the curve.
   pure function place_to_linearise(law, k_n, gap, used) result(place)
      type(joint_law_type), intent(in) :: law
      real(wp), intent(in) :: k_n                      !! of one of the rows [force/length]
      real(wp), intent(in) :: gap(2)                   !! of the motion [length]
      real(wp), intent(in) :: used(2)                  !! forces of the solve, compression positive
      real(wp) :: place(2)
      place = gap
      if (all(used > 0)) then
         place = -used/law%normal%secant(k_n, used)
         if (.not. law%normal%is_stiff_at(minval(end_gaps(gap)), minval(end_gaps(place)))) place = gap
      else if (.not. any(abs(used) > 0)) then
         place = gap + max(0.0_wp, -first_closure*law%normal%largest - minval(end_gaps(gap)))
      end if
   end function place_to_linearise

   !> Part of a length of a closed interval that has lost its bond.
   pure real(wp) function broken_length(length, sound, closed) result(broken)
      real(wp), intent(in) :: length           !! of what is closed [length]
      real(wp), intent(in) :: sound, closed    !! shares of the interval
      broken = 0
      if (closed > 0) broken = length*(1 - min(1.0_wp, sound/closed))
   end function broken_length

end module rockdda_interaction_intervals
