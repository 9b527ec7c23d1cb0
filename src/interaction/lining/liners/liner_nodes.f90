! SPDX-License-Identifier: MIT
!> Axial force, moment and shear force of a lining at its nodes, by statics.
!>
!> A beam carries constant forces from node to node; what acts on a segment acts between the middles of its two beams,
!> its cuts. The forces at a cut are those of the beam; those at the node in between follow from the equilibrium of the
!> part of the segment on either side, with the tractions of its back. With S the force on the section and m its moment
!> about the node, of what lies behind it along the path, and p the tractions:
!>
!>     S = S(cut behind) + sum of p on the part behind + b l       = S(cut before) - sum of p on the part before - ...
!>
!> Both hold with the force b over length of all that acts evenly, weight and inertia, which they give. The tractions of
!> a segment are taken as even over the part of it that is held, with a couple: a rigid back that bridges a joint of the
!> rock has tractions far above what goes through the lining. So a force on a small block makes a peak, and where the
!> rock ends the moment is that of the free side.
!>
!> The moment at a cut is that of loads at the nodes. A load p across the beam at a distance u from a node bends the
!> middle by p u^2/(2 l) more, of a beam of length l that is clamped there: together with the statics of the part that
!> is q l^2/12 at the nodes for an even pressure q.
module rockdda_interaction_liner_nodes
   use rockdda_base_kinds, only : wp
   use rockdda_interaction_joint_strength, only : joint_law_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_liner, only : liner_type, node_state, installed_centroids, on_segment, turned, acts, respond
   use rockdda_interaction_liner_beam, only : beam_state_type, beam_response_type, respond_beam, n_sections, &
      share_of_strength
   use rockdda_interaction_liner_ties, only : tie_type, tie_response_type, tie_state
   implicit none
   private
   public :: show_nodes_of, shares_of_nodes

   !> A line that turns by more has a corner, with forces of its own on both sides: cosine of 30 degrees.
   real(wp), parameter :: corner = 0.866_wp

   !> Tractions on a segment.
   type :: load_type
      real(wp) :: force(2) = 0             !! of all
      real(wp) :: moment = 0               !! about the node
      real(wp) :: ends(2) = [huge(1.0_wp), -huge(1.0_wp)]   !! of what is held, along the path from the node [length]
   end type load_type

   !> Forces on the section at a node, found from one side.
   type :: side_type
      logical :: is_there = .false.        !! a beam, or at a free end nothing
      real(wp) :: force(2) = 0             !! of what lies behind the node on what lies before it
      real(wp) :: moment = 0               !! about the node
      real(wp) :: bent = 0                 !! moment in the middle of the beam by what lies between nodes
      real(wp) :: along(2) = 0             !! direction of the path
      real(wp) :: length = 0               !! of the part between the node and the cut
   end type side_type

contains

   !> Place, forces N, M, Q, motion of the back against what holds it, and state of the nodes of a lining. At a corner
   !> of its line N and Q of both sides differ; the node has those of the larger axial force.
   pure subroutine show_nodes_of(laws, context, liners, k, place, force, beside, back, section, state)
      type(joint_law_type), allocatable, intent(in) :: laws(:)   !! of the joint materials
      type(step_context_type), intent(in) :: context
      type(liner_type), intent(in) :: liners(:)
      integer, intent(in) :: k                   !! the lining; those that lie on it press it
      real(wp), intent(out) :: place(:, :)       !! (2, nodes) [length]
      real(wp), intent(out) :: force(:, :)       !! (3, nodes)
      real(wp), intent(out) :: beside(:, :)      !! (4, nodes) N, Q before the node, N, Q behind it
      real(wp), intent(out) :: back(:, :)        !! (2, nodes) largest opening and slip of its back [length]
      real(wp), intent(out) :: section(:, :)     !! (6, nodes) N, M at the start, middle and end of the beam behind
      integer, intent(out) :: state(:)           !! (nodes) node_state%...
      type(side_type) :: sides(2, size(state))   !! before and behind each node
      type(load_type) :: loads(size(state))
      real(wp) :: bent(size(state))              !! moments in the middle of beams by what lies between nodes
      real(wp) :: center(2, size(state)), eccentricity(size(state))
      type(beam_response_type) :: response
      integer :: i, n, next
      associate (liner => liners(k), layout => liners(k)%layout)
         force = 0
         beside = 0
         back = 0
         section = 0
         state = node_state%absent
         do i = 1, layout%n
            place(:, i) = liner%path(:, layout%node(i))
         end do
         if (.not. liner%is_there) return
         state = node_state%sound
         center = installed_centroids(liner)
         eccentricity = 0
         bent = 0
         do i = 1, layout%n
            place(:, i) = on_segment(context, liner%before + i, place(:, i) - center(:, i))
         end do
         do i = 1, size(liner%joints)
            next = 1 + mod(i, layout%n)
            associate (joint => liner%joints(i))
               call respond_beam(joint%beam, liner%section, joint%state, joint%d, response)
               section(:, i) = [(matmul(joint%beam%of_force(:, :, n), response%f), n=1, n_sections)]
               sides(2, i) = cut_of(i, i, response%f)
               sides(1, next) = cut_of(i, next, response%f)
               eccentricity([i, next]) = eccentricity([i, next]) + 0.5_wp*joint%beam%eccentricity
               state(i) = max(state(i), state_of(joint%state, 1))
               state(next) = max(state(next), state_of(joint%state, n_sections))
            end associate
         end do
         do i = 1, size(liner%ties)
            if (.not. acts(context, liner%ties(i))) cycle
            call add_tie(liner, liner%ties, i, .false., loads)
            n = liner%ties(i)%b - liner%before
            back(:, n) = max(back(:, n), [opening_of(liner, liner%ties(i)), liner%ties(i)%slip])
         end do
         do next = k + 1, size(liners)
            if (liners(next)%lower /= k .or. .not. liners(next)%is_there) cycle
            do i = 1, size(liners(next)%ties)
               if (acts(context, liners(next)%ties(i))) call add_tie(liners(next), liners(next)%ties, i, .true., loads)
            end do
         end do
         do i = 1, layout%n
            if (loads(i)%ends(1) < loads(i)%ends(2)) call add_load(i, loads(i), sides, bent)
         end do
         do i = 1, size(liner%joints)
            next = 1 + mod(i, layout%n)
            sides(2, i)%bent = bent(i)
            sides(1, next)%bent = bent(i)
         end do
         do i = 1, layout%n
            call find_forces(sides(:, i), liner%side, force(2, i), beside(:, i))
            n = merge(1, 3, abs(beside(1, i)) >= abs(beside(3, i)))
            force([1, 3], i) = beside(n:n + 1, i)
         end do
         force(2, :) = force(2, :) + eccentricity*force(1, :)
         ! around a closed line the part N t^2/(12 R) that the mean of N has about the centroid is left out, as in the
         ! theory of thin rings
         if (layout%closed) force(2, :) = force(2, :) - eccentricity*sum(force(1, :))/layout%n
      end associate

   contains

      !> The cut in the middle of beam i, as node n has it.
      pure type(side_type) function cut_of(i, n, f) result(side)
         integer, intent(in) :: i, n
         real(wp), intent(in) :: f(3)            !! forces of the beam
         real(wp) :: arm(2)
         integer :: p
         associate (liner => liners(k), layout => liners(k)%layout, joint => liners(k)%joints(i))
            p = layout%node(n)
            side%is_there = .true.
            side%force = turned(f(1:2), joint%beam%angle)
            arm = joint%arm(:, merge(1, 2, n == i)) + center(:, n) - liner%path(:, p)
            side%moment = f(3) + arm(1)*side%force(2) - arm(2)*side%force(1)
            if (n == i) then
               side%along = liner%path(:, p + 1) - liner%path(:, p)
            else
               side%along = liner%path(:, p) - liner%path(:, p - 1)
            end if
            side%along = side%along/norm2(side%along)
            side%length = 0.5_wp*joint%beam%length
         end associate
      end function cut_of

      !> How far a tie is open; 0 where it holds.
      pure real(wp) function opening_of(liner, tie) result(opening)
         type(liner_type), intent(in) :: liner
         type(tie_type), intent(in) :: tie
         type(tie_response_type) :: response
         call respond(laws, liner, tie, tie%motion, response)
         opening = merge(0.0_wp, max(0.0_wp, tie%motion(1)), any(response%state == [tie_state%held, tie_state%slides]))
      end function opening_of

      !> The traction at a tie. Two ties that represent halves of a stretch lie at the places of Gauss, further apart
      !> than the middles of these.
      pure subroutine add_tie(owner, ties, i, from_above, loads)
         type(liner_type), intent(in) :: owner
         type(tie_type), intent(in) :: ties(:)
         integer, intent(in) :: i
         logical, intent(in) :: from_above       !! of a layer on the lining
         type(load_type), intent(inout) :: loads(:)
         real(wp), parameter :: inwards = 1/sqrt(3.0_wp) - 0.5_wp
         type(tie_response_type) :: response
         real(wp) :: p(2), x(2), u
         integer :: n, other
         associate (liner => liners(k), tie => ties(i))
            call respond(laws, owner, tie, tie%motion, response)
            p = -turned(response%force, tie%angle)
            n = tie%b - liner%before
            x = tie%arm
            if (from_above) then
               p = -p
               n = tie%a - liner%before
               x = tie%at_a
            end if
            x = x + center(:, n) - liner%path(:, liner%layout%node(n))
            loads(n)%force = loads(n)%force + p
            loads(n)%moment = loads(n)%moment + x(1)*p(2) - x(2)*p(1)
            u = dot_product(x, sides(2, n)%along)
            if (sides(1, n)%is_there .and. .not. u > 0) u = min(0.0_wp, dot_product(x, sides(1, n)%along))
            other = pair_of(ties, i)
            if (other > 0) u = u + sign(inwards*tie%length, real(other - i, wp))
            loads(n)%ends = [min(loads(n)%ends(1), u - 0.5_wp*tie%length), max(loads(n)%ends(2), u + 0.5_wp*tie%length)]
         end associate
      end subroutine add_tie

      !> Tractions on segment n, cut at the node.
      pure subroutine add_load(n, load, sides, bent)
         integer, intent(in) :: n
         type(load_type), intent(in) :: load
         type(side_type), intent(inout) :: sides(:, :)
         real(wp), intent(inout) :: bent(:)
         real(wp) :: ends(2, 2), share(2), of_side(2, 2), arm(2, 2), angle(2), q(2), couple
         integer :: j, s
         ends(:, 1) = min(0.0_wp, load%ends)
         ends(:, 2) = max(0.0_wp, load%ends)
         if (.not. sides(1, n)%is_there) ends(:, 1) = 0
         if (.not. sides(2, n)%is_there) ends(:, 2) = 0
         share = ends(2, :) - ends(1, :)
         if (.not. sum(share) > 0) return
         share = share/sum(share)
         ! on a curve they turn with it, from part to part
         angle = turn_of(n)
         q = [sum(share*cos(angle)), sum(share*sin(angle))]
         q = turned(load%force, -atan2(q(2), q(1)))/norm2(q)
         couple = load%moment
         do s = 1, 2
            of_side(:, s) = share(s)*turned(q, angle(s))
            arm(:, s) = 0.5_wp*sum(ends(:, s))*turned(sides(s, n)%along, 0.5_wp*angle(s))
            couple = couple - (arm(1, s)*of_side(2, s) - arm(2, s)*of_side(1, s))
         end do
         do s = 1, 2
            if (.not. share(s) > 0) cycle
            associate (side => sides(s, n))
               q = of_side(:, s)
               j = merge(n, 1 + modulo(n - 2, size(bent)), s == 2)
               bent(j) = bent(j) - (side%along(1)*q(2) - side%along(2)*q(1))* &
                         (ends(1, s)**2 + ends(1, s)*ends(2, s) + ends(2, s)**2)/(12*side%length)
               q = merge(-1, 1, s == 1)*q
               side%force = side%force + q
               side%moment = side%moment + (arm(1, s)*q(2) - arm(2, s)*q(1)) + &
                             merge(-1, 1, s == 1)*share(s)*couple
            end associate
         end do
      end subroutine add_load

      !> Angles from the direction of the path at node n to those of the parts of its segment before and behind it; 0 at
      !> an end, and at a corner.
      pure function turn_of(n) result(angle)
         integer, intent(in) :: n
         real(wp) :: angle(2), a(2), b(2)
         angle = 0
         if (.not. all(sides(:, n)%is_there)) return
         associate (path => liners(k)%path, layout => liners(k)%layout)
            a = path(:, layout%node(n)) - path(:, layout%first(n))
            b = path(:, layout%last(n)) - path(:, layout%node(n))
         end associate
         if (dot_product(a, b) < corner*norm2(a)*norm2(b)) return
         angle = [-0.5_wp, 0.5_wp]*atan2(a(1)*b(2) - a(2)*b(1), dot_product(a, b))
      end function turn_of

   end subroutine show_nodes_of

   !> Largest share of the strength that N and M take together, on both sides of each node and in the sections beside
   !> it: at the end of the beam before, at the start and in the middle of the one behind. Below 0: it has none.
   pure function shares_of_nodes(liner, moment, beside, section, state) result(use)
      type(liner_type), intent(in) :: liner
      real(wp), intent(in) :: moment(:), beside(:, :), section(:, :)   !! as shown
      integer, intent(in) :: state(:)
      real(wp) :: use(size(state)), before(2)
      integer :: i, n
      n = size(state)
      do i = 1, n
         before = section(5:6, 1 + modulo(i - 2, n))
         if (i == 1 .and. .not. liner%layout%closed) before = 0
         use(i) = maxval(share_of_strength(liner%section, state(i) > node_state%sound, &
                                           [beside([1, 3], i), before(1), section([1, 3], i)], &
                                           [moment([i, i]), before(2), section([2, 4], i)]))
      end do
   end function shares_of_nodes

   !> The tie that represents the other half of a stretch; 0: there is none.
   pure integer function pair_of(ties, i) result(other)
      type(tie_type), intent(in) :: ties(:)
      integer, intent(in) :: i
      real(wp), parameter :: apart = 2/sqrt(3.0_wp)
      do other = i - 1, i + 1, 2
         if (other < 1 .or. other > size(ties)) cycle
         associate (a => ties(i), b => ties(other))
            if (a%a /= b%a .or. a%b /= b%b .or. abs(a%length - b%length) > 1.0e-9_wp*a%length) cycle
            if (abs(norm2(b%arm - a%arm) - apart*a%length) <= 1.0e-3_wp*a%length) return
         end associate
      end do
      other = 0
   end function pair_of

   !> The moment at a node, and N and Q on both sides of it.
   pure subroutine find_forces(sides, side, moment, beside)
      type(side_type), intent(in) :: sides(2)
      integer, intent(in) :: side                !! of the opening
      real(wp), intent(out) :: moment
      real(wp), intent(out) :: beside(4)         !! N, Q before the node, N, Q behind it
      real(wp) :: even(2), force(2), moments(2), lengths, along(2, 2)
      integer :: s
      moment = 0
      beside = 0
      lengths = sum(sides%length)
      if (.not. lengths > 0) return
      ! what acts evenly: with it both sides have one force
      even = (sides(1)%force - sides(2)%force)/lengths
      force = sides(2)%force + sides(2)%length*even
      do s = 1, 2
         moments(s) = sides(s)%moment + sides(s)%bent + sides(s)%length**2/3* &
                      (sides(s)%along(1)*even(2) - sides(s)%along(2)*even(1))
      end do
      along = spread(sides(1)%along + sides(2)%along, 2, 2)
      if (all(sides%is_there)) then
         ! beside the end of the rock what lies between nodes is no pressure: the free side is taken
         lengths = sum(sides%bent**2)
         if (lengths > 0) moments = sum(moments*sides([2, 1])%bent**2)/lengths
         if (dot_product(sides(1)%along, sides(2)%along) < corner) &
            along = reshape([sides(1)%along, sides(2)%along], [2, 2])
      end if
      do s = 1, 2
         along(:, s) = along(:, s)/norm2(along(:, s))
         beside(2*s - 1:2*s) = [dot_product(force, along(:, s)), side*(along(1, s)*force(2) - along(2, s)*force(1))]
      end do
      moment = -side*0.5_wp*sum(moments)
   end subroutine find_forces

   !> What a section is.
   pure integer function state_of(state, section)
      type(beam_state_type), intent(in) :: state
      integer, intent(in) :: section
      state_of = node_state%sound
      if (state%cracked(section)) state_of = node_state%cracked
      if (state%crushed(section)) state_of = node_state%crushed
   end function state_of

end module rockdda_interaction_liner_nodes
