! SPDX-License-Identifier: MIT
!> The links of a bolt with nodes in the equations of a step (docs/theory.md, "Bolts").
!>
!> The steel and its grout give forces N on the elongations e between neighbouring points, and their derivatives D
!> (rockdda_interaction_bar). Each pair of neighbours is a link with its force and its own stiffness; what couples two
!> such links is a matrix for each pair of blocks: a bolt couples the blocks that it crosses, and no others. Elongations
!> are those of the expected motion, as of the springs in rockdda_interaction_bolts.
!>
!> In static steps a bolt that spans two blocks turns with their motion at the end of the step: its tension is a spring
!> N/L across it. A block that hangs would swing for ever else.
!>
!> Each round linearises at the motion of the last one, and is repeated until forces follow their laws there.
module rockdda_interaction_bar_links
   use rockdda_base_kinds, only : wp
   use rockdda_interaction_attempt, only : attempt_type
   use rockdda_interaction_bar, only : bar_response_type, respond, condense
   use rockdda_interaction_bar_bolt, only : bolt_type, find_directions, direction, is_joint, separation, find_points, &
      find_forces, is_straight, continue_forces, chain_forces, dowel_response
   use rockdda_interaction_equations, only : equations_type
   use rockdda_interaction_finite_rotation, only : mean_load, mean_displacement, end_displacement
   implicit none
   private
   public :: links_of, join_bolt, find_tension, place_bolt, add_to_links_of, predict_bolt, forces_of_links, &
      measure_placement_of, judge_bolt, force_across

   !> Forces agree with their laws to this share.
   real(wp), parameter :: agreement = 1.0e-8_wp
   !> Rounding of lengths, as a share of them.
   real(wp), parameter :: rounding = 1.0e-13_wp

contains

   !> Links of one bolt: one for each two neighbours of the points with a tie, one for each dowel, and the matrices of
   !> each block and of each pair of blocks.
   pure integer function links_of(bolt) result(n)
      type(bolt_type), intent(in) :: bolt
      n = axial_links(bolt) + size(bolt%crossing) + size(bolt%matrix)
   end function links_of

   !> Links between neighbours.
   pure integer function axial_links(bolt) result(n)
      type(bolt_type), intent(in) :: bolt
      n = max(0, size(bolt%used) - 1)
   end function axial_links

   !> Points of the links between neighbours that act, then of the dowels.
   pure function link_points(bolt) result(points)
      type(bolt_type), intent(in) :: bolt
      integer :: points(2, axial_links(bolt) + size(bolt%crossing))     !! 0: the link is not in use
      integer :: c, k, n
      points = 0
      do k = 1, size(bolt%acting) - 1
         points(:, k) = bolt%acting(k:k + 1)
      end do
      n = axial_links(bolt)
      do c = 1, size(bolt%crossing)
         if (bolt%holds(c)) points(:, n + c) = [bolt%crossing(c), bolt%crossing(c) + 1]
      end do
   end function link_points

   !> Blocks of the links of a bolt.
   subroutine join_bolt(bolt, active, equations)
      type(bolt_type), intent(inout) :: bolt
      logical, intent(in) :: active(:)     !! (blocks)
      type(equations_type), intent(inout) :: equations
      integer :: points(2, axial_links(bolt) + size(bolt%crossing)), a, b, k, m, n, pair(2)
      bolt%version = bolt%version + 1
      points = link_points(bolt)
      n = size(points, 2)
      do k = 1, n
         pair = 0
         if (points(1, k) > 0) pair = bolt%block(points(:, k))
         ! within a block: the strain of the block alone
         if (pair(1) == pair(2)) pair(2) = 0
         call equations%join(bolt%first_link + k, pair)
      end do
      m = 0
      do a = 1, size(bolt%crossed)
         do b = a, size(bolt%crossed)
            m = m + 1
            pair = [bolt%crossed(a), merge(0, bolt%crossed(b), a == b)]
            if (.not. (active(bolt%crossed(a)) .and. active(bolt%crossed(b)))) pair = 0
            call equations%join_matrix(bolt%first_link + n + m, pair, bolt%matrix(m))
         end do
      end do
   end subroutine join_bolt

   !> Tension at the start of the step over the length of the bolt between two blocks, or a block and the outside.
   pure subroutine find_tension(bolt)
      type(bolt_type), intent(inout) :: bolt
      integer :: k
      do k = 1, size(bolt%acting) - 1
         associate (p => bolt%acting(k), q => bolt%acting(k + 1))
            if (bolt%block(p) == bolt%block(q) .or. is_joint(bolt, p, q)) cycle
            bolt%tense(k) = max(0.0_wp, bolt%tangent%chain(k))/norm2(bolt%place(:, q) - bolt%place(:, p))
         end associate
      end do
   end subroutine find_tension

   !> Vectors of the links of a bolt.
   subroutine place_bolt(bolt, attempt, equations)
      type(bolt_type), intent(inout) :: bolt
      type(attempt_type), intent(in) :: attempt
      type(equations_type), intent(inout) :: equations
      integer :: points(2, axial_links(bolt) + size(bolt%crossing)), k, p, side
      real(wp) :: then(2, size(bolt%block)), parts(2, size(bolt%block)/2), n(2), a(6, 2), b(6, 2), v(6, 2, 2)
      bolt%version = bolt%version + 1
      then = bolt%place
      do p = 1, size(bolt%block)
         if (bolt%block(p) > 0) then(:, p) = then(:, p) + &
            mean_displacement(attempt%moving(bolt%block(p))%d, bolt%place(:, p), attempt%moving(bolt%block(p)))
      end do
      call find_directions(then, parts)
      points = link_points(bolt)
      do k = 1, size(points, 2)
         if (points(1, k) == 0) cycle
         n = mean_direction(bolt, then, parts, points(1, k), points(2, k))
         v = 0
         do side = 1, 2
            associate (block => bolt%block(points(side, k)), x => bolt%place(:, points(side, k)))
               if (block == 0) cycle
               v(:, 1, side) = mean_load(merge(-n, n, side == 1), x, attempt%moving(block))
               if (acts_across(bolt, k)) &
                  v(:, 2, side) = mean_load(merge(-1, 1, side == 1)*[-n(2), n(1)], x, attempt%moving(block))
            end associate
         end do
         a = v(:, :, 1)
         b = v(:, :, 2)
         if (bolt%block(points(1, k)) == bolt%block(points(2, k))) then
            a = a + b
            b = 0
         end if
         call equations%set_vectors(bolt%first_link + k, a, b)
         if (k > axial_links(bolt)) cycle
         associate (p => points(1, k), q => points(2, k))
            ! the mean direction has turned by half of what is expected
            bolt%turned(k) = 0.5_wp*dot_product([-n(2), n(1)], (then(:, q) - bolt%place(:, q)) - &
                                                (then(:, p) - bolt%place(:, p)))
         end associate
      end do
   end subroutine place_bolt

   !> Does a link act across the bolt?
   pure logical function acts_across(bolt, k)
      type(bolt_type), intent(in) :: bolt
      integer, intent(in) :: k                 !! link of neighbours, then of dowels
      acts_across = .true.
      if (k <= axial_links(bolt)) acts_across = bolt%tense(k) > 0
   end function acts_across

   !> Mean of the directions between two points at the start and the end of the step; between points that have a
   !> distance weighed so that its change is exact.
   pure function mean_direction(bolt, then, parts, p, q) result(n)
      type(bolt_type), intent(in) :: bolt
      real(wp), intent(in) :: then(:, :)       !! (2, points) places at the end of the step
      real(wp), intent(in) :: parts(:, :)      !! (2, parts) directions there
      integer, intent(in) :: p, q
      real(wp) :: n(2), length(2)
      if (is_joint(bolt, p, q)) then
         n = direction(bolt, bolt%place, bolt%parts, p, q) + direction(bolt, then, parts, p, q)
         if (norm2(n) > 0) n = n/norm2(n)
      else
         length = [norm2(bolt%place(:, q) - bolt%place(:, p)), norm2(then(:, q) - then(:, p))]
         n = 0
         if (sum(length) > 0) n = ((bolt%place(:, q) - bolt%place(:, p)) + (then(:, q) - then(:, p)))/sum(length)
      end if
   end function mean_direction

   !> Derivatives of the forces of the links of neighbours with respect to their elongations.
   pure subroutine chain_stiffness(bolt, stiffness, d)
      type(bolt_type), intent(in) :: bolt
      real(wp), intent(in) :: stiffness(:, :)  !! (points, points) of the forces of the rock on the bar
      real(wp), intent(out) :: d(:, :)         !! (neighbours, neighbours) 0 where there are none that act
      integer :: i, j, n
      d = 0
      n = size(bolt%acting) - 1
      ! of the points on the side of the head by those on the side of the toe
      do j = 1, n
         do i = 1, n
            d(i, j) = -stiffness(bolt%acting(i), bolt%acting(j + 1))
         end do
      end do
      do j = n - 1, 1, -1
         d(:, j) = d(:, j) + d(:, j + 1)
      end do
      do i = 2, n
         d(i, :) = d(i, :) + d(i - 1, :)
      end do
      do j = 1, n
         do i = 1, j - 1
            d(i, j) = 0.5_wp*(d(i, j) + d(j, i))
            d(j, i) = d(i, j)
         end do
      end do
   end subroutine chain_stiffness

   !> Stiffness and load of the links of one bolt.
   subroutine add_to_links_of(bolt, level, equations)
      type(bolt_type), intent(in) :: bolt
      real(wp), intent(in) :: level
      type(equations_type), intent(inout) :: equations
      real(wp) :: k, f, force
      logical :: shears
      integer :: c, i
      if (size(bolt%acting) == 0) then
         do i = 1, axial_links(bolt) + size(bolt%crossing)
            call equations%set_link(bolt%first_link + i, [0.0_wp, 0.0_wp], [0.0_wp, 0.0_wp])
         end do
         return
      end if
      if (size(bolt%acting) > 1) call add_matrices(bolt, level/bolt%spacing, equations)
      do i = 1, axial_links(bolt)
         f = product_of(axial_links(bolt), bolt%tangent%links(:, i), bolt%tangent%e) - bolt%tangent%chain(i)
         call equations%set_link(bolt%first_link + i, [level*bolt%tangent%links(i, i), bolt%tense(i)]/bolt%spacing, &
                                 [f, bolt%tense(i)*bolt%turned(i)]/bolt%spacing)
      end do
      do c = 1, size(bolt%crossing)
         k = 0
         f = 0
         if (bolt%holds(c)) then
            k = bolt%dowel_stiffness
            f = -k*(bolt%across(c) - bolt%dowel_slip(c))
            if (bolt%shears(c)) then
               call dowel_response(bolt, bolt%across(c) + bolt%shift(c) - bolt%dowel_slip(c), force, shears)
               k = 0
               f = -force
            end if
         end if
         call equations%set_link(bolt%first_link + axial_links(bolt) + c, [0.0_wp, level*k]/bolt%spacing, &
                                 [0.0_wp, f]/bolt%spacing)
      end do
   end subroutine add_to_links_of

   !> a . b, in one order.
   pure real(wp) function product_of(n, a, b)
      integer, intent(in) :: n
      real(wp), intent(in) :: a(n), b(n)
      integer :: i
      product_of = 0
      do i = 1, n
         product_of = product_of + a(i)*b(i)
      end do
   end function product_of

   !> What the elongation of one link between neighbours does to the force of another one: of the blocks a and b the sum
   !> of D(i, j) v(i) v(j)^T, v(i) the vector of the link i at block a, v(j) that of j at b. Few links end at a block.
   subroutine add_matrices(bolt, share, equations)
      type(bolt_type), intent(in) :: bolt
      real(wp), intent(in) :: share            !! by which derivatives count [1/length]
      type(equations_type), intent(inout) :: equations
      real(wp), allocatable :: v(:, :), by(:, :)
      real(wp) :: both(6, 2), m(6, 6), k
      integer, allocatable :: link(:), first(:)
      integer :: a, b, c, i, j, n, side, at
      if (size(bolt%matrix) == 0) return
      if (equations%has_matrix(bolt%matrix(1), bolt%version)) return
      n = size(bolt%acting) - 1
      ! ends of links, block after block: those of crossed(a) are first(a) to first(a + 1) - 1
      allocate (v(6, 2*n), link(2*n), first(size(bolt%crossed) + 1), by(6, n))
      at = 0
      do a = 1, size(bolt%crossed)
         first(a) = at + 1
         do i = 1, n
            do side = 1, 2
               if (equations%pair(side, bolt%first_link + i) /= bolt%crossed(a)) cycle
               at = at + 1
               link(at) = i
               both = equations%vectors_of(bolt%first_link + i, side)
               v(:, at) = both(:, 1)
            end do
         end do
      end do
      first(size(first)) = at + 1
      do b = 1, size(bolt%crossed)
         by = 0
         do j = first(b), first(b + 1) - 1
            do i = 1, n
               if (i == link(j)) cycle
               k = share*bolt%tangent%links(i, link(j))
               do c = 1, 6
                  by(c, i) = by(c, i) + k*v(c, j)
               end do
            end do
         end do
         do a = 1, b
            m = 0
            do i = first(a), first(a + 1) - 1
               do c = 1, 6
                  m(:, c) = m(:, c) + v(:, i)*by(c, link(i))
               end do
            end do
            ! pairs (a, b) in the order of join_bolt
            at = (a - 1)*size(bolt%crossed) - (a - 1)*(a - 2)/2 + b - a + 1
            call equations%set_matrix(bolt%matrix(at), m, bolt%version)
         end do
      end do
   end subroutine add_matrices

   !> Elongations of a bolt, displacements of its joints, and its motion across, for the solution; forces by its laws.
   subroutine predict_bolt(bolt, level, equations)
      type(bolt_type), intent(inout) :: bolt
      real(wp), intent(in) :: level
      type(equations_type), intent(in) :: equations
      real(wp) :: along(2)
      integer :: c, k
      bolt%e = 0
      bolt%sway = 0
      do k = 1, size(bolt%acting) - 1
         call find_motion(bolt%first_link + k)
         bolt%e(k) = level*along(1)
         if (bolt%tense(k) > 0) bolt%sway(k) = along(2)
      end do
      bolt%shift = 0
      do c = 1, size(bolt%crossing)
         if (.not. bolt%holds(c)) cycle
         call find_motion(bolt%first_link + axial_links(bolt) + c)
         bolt%shift(c) = level*along(2)
      end do
      call find_forces(bolt, near=.true.)

   contains

      !> Motion of a link along its two lines.
      subroutine find_motion(link)
         integer, intent(in) :: link
         real(wp) :: v(6, 2)
         integer :: line, side
         associate (pair => equations%pair(:, link))
            if (all(pair > 0)) then
               call equations%link_motion(link, along)
               return
            end if
            along = 0
            do side = 1, 2
               if (pair(side) == 0) cycle
               v = equations%vectors_of(link, side)
               do line = 1, 2
                  along(line) = along(line) + dot_product(v(:, line), equations%x(:, pair(side)))
               end do
            end do
         end associate
      end subroutine find_motion

   end subroutine predict_bolt

   !> Forces of the links by their laws, at a fraction of the way: 0, 1, or in between.
   subroutine forces_of_links(bolt, fraction, response, force)
      type(bolt_type), intent(in) :: bolt
      real(wp), intent(in) :: fraction
      type(bar_response_type), intent(inout) :: response   !! work
      real(wp), intent(inout), contiguous :: force(:, :)   !! (2, links)
      real(wp) :: of_dowel
      integer :: c, k, n
      logical :: shears
      n = bolt%first_link
      force(:, n + 1:n + links_of(bolt)) = 0
      if (size(bolt%acting) == 0) return
      associate (chain => force(1, n + 1:n + axial_links(bolt)))
         if (.not. abs(fraction) > 0) then
            chain = bolt%kept_chain
         else if (bolt%is_found .and. .not. abs(fraction - 1) > 0) then
            chain = bolt%chain
         else if (bolt%is_found .and. is_straight(bolt)) then
            chain = bolt%kept_chain + fraction*(bolt%chain - bolt%kept_chain)
         else
            call find_chain(chain)
         end if
         chain = chain/bolt%spacing
      end associate
      do k = 1, axial_links(bolt)
         force(2, n + k) = force_across(bolt, k, bolt%kept_sway(k) + fraction*(bolt%sway(k) - bolt%kept_sway(k)))
      end do
      n = n + axial_links(bolt)
      do c = 1, size(bolt%crossing)
         if (.not. bolt%holds(c)) cycle
         call dowel_response(bolt, bolt%across(c) + bolt%kept_shift(c) + fraction* &
                             (bolt%shift(c) - bolt%kept_shift(c)) - bolt%dowel_slip(c), of_dowel, shears)
         force(2, n + c) = of_dowel/bolt%spacing
      end do

   contains

      !> Forces of the links of neighbours where laws have kinks on the way.
      subroutine find_chain(chain)
         real(wp), intent(out) :: chain(:)
         real(wp) :: of_points(size(bolt%block)), u(size(bolt%block))
         call find_points(bolt, bolt%kept_e + fraction*(bolt%e - bolt%kept_e), u)
         call respond(bolt%bar, bolt%state, u, response)
         call condense(bolt%bar, response, of_points)
         call chain_forces(bolt, of_points, chain)
      end subroutine find_chain

   end subroutine forces_of_links

   !> Force across the link of two neighbours, for their motion across the bolt; 0 where none acts.
   pure real(wp) function force_across(bolt, k, sway)
      type(bolt_type), intent(in) :: bolt
      integer, intent(in) :: k                 !! neighbours k and k + 1
      real(wp), intent(in) :: sway             !! [length]
      force_across = bolt%tense(k)*(sway - bolt%turned(k))/bolt%spacing
   end function force_across

   !> Lengths of a bolt that the expected motion gives otherwise than the solution.
   subroutine measure_placement_of(bolt, level, attempt, equations)
      type(bolt_type), intent(in) :: bolt
      real(wp), intent(in) :: level
      type(attempt_type), intent(in) :: attempt
      type(equations_type), intent(inout) :: equations
      real(wp) :: moved(2, size(bolt%block)), parts(2, size(bolt%block)/2), load, scale, off
      integer :: b, k, p
      if (size(bolt%acting) < 2) return
      moved = bolt%place
      do p = 1, size(bolt%block)
         b = bolt%block(p)
         if (b > 0) moved(:, p) = bolt%place(:, p) + end_displacement(attempt%moved(b), bolt%place(:, p))
      end do
      call find_directions(moved, parts)
      do k = 1, size(bolt%acting) - 1
         associate (p => bolt%acting(k), q => bolt%acting(k + 1))
            if (is_joint(bolt, p, q)) cycle
            off = abs(bolt%tangent%stiffness(p, q)*(separation(bolt, moved, parts, p, q) - &
                                                    separation(bolt, bolt%place, bolt%parts, p, q) - bolt%e(k)/level))
         end associate
         load = huge(load)
         do p = k, k + 1
            b = bolt%block(bolt%acting(p))
            if (b > 0) load = min(load, equations%block_force(b))
         end do
         if (load >= huge(load)) cycle
         scale = max(load, abs(bolt%tangent%chain(k))/bolt%spacing)
         if (scale > 0) equations%link_off(bolt%first_link + k) = off/bolt%spacing/scale
      end do
   end subroutine measure_placement_of

   !> Does the stiffness that is known belong to the present response?
   pure logical function has_tangents(bolt)
      type(bolt_type), intent(in) :: bolt
      integer :: i
      has_tangents = bolt%is_judged
      if (has_tangents .or. .not. allocated(bolt%tangent%acting)) return
      associate (known => bolt%tangent, response => bolt%response)
         has_tangents = size(known%acting) == size(bolt%acting)
         if (.not. has_tangents) return
         has_tangents = all(known%acting == bolt%acting) .and. all(known%holder == response%holder)
         do i = 1, size(known%of_steel)
            has_tangents = has_tangents .and. abs(known%of_steel(i) - response%f_tangent(i)) <= 0
         end do
         do i = 1, size(known%of_ties)
            has_tangents = has_tangents .and. abs(known%of_ties(i) - response%t_tangent(i)) <= 0
         end do
      end associate
   end function has_tangents

   !> Stiffness by the present response.
   subroutine take_tangents(bolt)
      type(bolt_type), intent(inout) :: bolt
      real(wp) :: force(size(bolt%block))
      associate (t => bolt%tangent)
         call condense(bolt%bar, bolt%response, force, t%stiffness, t%share)
         t%is_elastic = all(bolt%response%f_limit == 0) .and. all(bolt%response%t_limit == 0)
         t%largest = maxval(abs(t%stiffness))
         t%of_steel = bolt%response%f_tangent
         t%of_ties = bolt%response%t_tangent
         t%holder = bolt%response%holder
         t%acting = bolt%acting
         call chain_stiffness(bolt, t%stiffness, t%links)
         bolt%version = bolt%version + 1
      end associate
   end subroutine take_tangents

   !> Linearise at the present motion; the last round holds where its forces follow the laws there.
   subroutine judge_bolt(bolt, n_changes)
      type(bolt_type), intent(inout) :: bolt
      integer, intent(inout) :: n_changes
      real(wp) :: expected(size(bolt%block)), force, missing, most(2)
      logical :: shears
      integer :: c, i, n
      if (size(bolt%acting) == 0) return
      if (.not. bolt%is_found) call find_forces(bolt, near=.true.)
      n = size(bolt%block)
      associate (t => bolt%tangent)
         if (.not. allocated(t%u)) then
            t%u = bolt%u
            t%e = bolt%e
            t%chain = bolt%e
            allocate (t%force(n), t%stiffness(n, n), t%links(axial_links(bolt), axial_links(bolt)), &
                      t%share(n), source=0.0_wp)
         end if
         call continue_forces(n, t%force, t%stiffness, t%u, bolt%u, expected)
         if (.not. has_tangents(bolt)) call take_tangents(bolt)
         missing = 0
         most = 0
         do i = 1, n
            missing = max(missing, abs(bolt%force(i) - expected(i)))
            most = max(most, abs([bolt%force(i), bolt%u(i)]))
         end do
         if (missing > agreement*most(1) + rounding*t%largest*most(2)) n_changes = n_changes + 1
         bolt%is_judged = .true.
         t%u(:) = bolt%u
         t%force(:) = bolt%force
         t%e(:) = bolt%e
         t%chain(:) = bolt%chain
      end associate
      do c = 1, size(bolt%crossing)
         call dowel_response(bolt, bolt%across(c) + bolt%shift(c) - bolt%dowel_slip(c), force, shears)
         if (shears .neqv. bolt%shears(c)) n_changes = n_changes + 1
         bolt%shears(c) = shears
      end do
   end subroutine judge_bolt

end module rockdda_interaction_bar_links
