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
   use rockdda_interaction_bar, only : bar_response_type, respond, condense
   use rockdda_interaction_bar_bolt, only : bolt_type, tangent_type, direction, is_joint, separation, points_with, &
      chain_forces, dowel_response
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_equations, only : equations_type
   use rockdda_interaction_finite_rotation, only : mean_load, mean_displacement, end_displacement
   implicit none
   private
   public :: links_of, join_bolt, find_tension, place_bolt, add_to_links_of, predict_bolt, forces_of_links, &
      measure_placement_of, judge_bolt, across_bolt

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
      real(wp) :: chain(max(0, size(bolt%acting) - 1))
      integer :: k
      if (size(chain) == 0) return
      chain = chain_forces(bolt, bolt%tangent%force)
      do k = 1, size(chain)
         associate (p => bolt%acting(k), q => bolt%acting(k + 1))
            if (bolt%block(p) == bolt%block(q) .or. is_joint(bolt, p, q)) cycle
            bolt%tense(k) = max(0.0_wp, chain(k))/norm2(bolt%place(:, q) - bolt%place(:, p))
         end associate
      end do
   end subroutine find_tension

   !> Vectors of the links of a bolt.
   subroutine place_bolt(bolt, context, equations)
      type(bolt_type), intent(inout) :: bolt
      type(step_context_type), intent(in) :: context
      type(equations_type), intent(inout) :: equations
      integer :: points(2, axial_links(bolt) + size(bolt%crossing)), k, p, side
      real(wp) :: then(2, size(bolt%block)), n(2), a(6, 2), b(6, 2), v(6, 2, 2)
      then = bolt%place
      do p = 1, size(bolt%block)
         if (bolt%block(p) > 0) then(:, p) = then(:, p) + &
            mean_displacement(context%moving(bolt%block(p))%d, bolt%place(:, p), context%moving(bolt%block(p)))
      end do
      points = link_points(bolt)
      do k = 1, size(points, 2)
         if (points(1, k) == 0) cycle
         n = mean_direction(bolt, then, points(1, k), points(2, k))
         v = 0
         do side = 1, 2
            associate (block => bolt%block(points(side, k)), x => bolt%place(:, points(side, k)))
               if (block == 0) cycle
               v(:, 1, side) = mean_load(merge(-n, n, side == 1), x, context%moving(block))
               v(:, 2, side) = mean_load(merge(-1, 1, side == 1)*[-n(2), n(1)], x, context%moving(block))
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

   !> Mean of the directions between two points at the start and the end of the step; between points that have a
   !> distance weighed so that its change is exact.
   pure function mean_direction(bolt, then, p, q) result(n)
      type(bolt_type), intent(in) :: bolt
      real(wp), intent(in) :: then(:, :)       !! (2, points) places at the end of the step
      integer, intent(in) :: p, q
      real(wp) :: n(2), length(2)
      if (is_joint(bolt, p, q)) then
         n = direction(bolt, bolt%place, p, q) + direction(bolt, then, p, q)
         if (norm2(n) > 0) n = n/norm2(n)
      else
         length = [norm2(bolt%place(:, q) - bolt%place(:, p)), norm2(then(:, q) - then(:, p))]
         n = 0
         if (sum(length) > 0) n = ((bolt%place(:, q) - bolt%place(:, p)) + (then(:, q) - then(:, p)))/sum(length)
      end if
   end function mean_direction

   !> Derivatives of the forces of the links of neighbours with respect to their elongations.
   pure function chain_stiffness(bolt, stiffness) result(d)
      type(bolt_type), intent(in) :: bolt
      real(wp), intent(in) :: stiffness(:, :)  !! (points, points) of the forces of the rock on the bar
      real(wp) :: d(max(0, size(bolt%acting) - 1), max(0, size(bolt%acting) - 1))
      integer :: i, j, n
      n = size(d, 1)
      ! of the points on the side of the head by those on the side of the toe
      do j = 1, n
         d(:, j) = -stiffness(bolt%acting(1:n), bolt%acting(j + 1))
      end do
      do j = n - 1, 1, -1
         d(:, j) = d(:, j) + d(:, j + 1)
      end do
      do i = 2, n
         d(i, :) = d(i, :) + d(i - 1, :)
      end do
      d = 0.5_wp*(d + transpose(d))
   end function chain_stiffness

   !> Stiffness and load of the links of one bolt.
   subroutine add_to_links_of(bolt, level, equations)
      type(bolt_type), intent(in) :: bolt
      real(wp), intent(in) :: level
      type(equations_type), intent(inout) :: equations
      real(wp) :: chain(max(0, size(bolt%acting) - 1)), d(size(chain), size(chain)), k, f, force
      logical :: shears
      integer :: c, i
      if (size(chain) > 0) then
         chain = chain_forces(bolt, bolt%tangent%force)
         d = chain_stiffness(bolt, bolt%tangent%stiffness)
         call add_matrices(bolt, level*d/bolt%spacing, equations)
      end if
      do i = 1, axial_links(bolt)
         k = 0
         f = 0
         if (i <= size(chain)) then
            k = d(i, i)
            f = dot_product(d(:, i), bolt%tangent%e(1:size(chain))) - chain(i)
         end if
         call equations%set_link(bolt%first_link + i, [level*k, bolt%tense(i)]/bolt%spacing, &
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

   !> What the elongation of one link between neighbours does to the force of another one.
   subroutine add_matrices(bolt, d, equations)
      type(bolt_type), intent(in) :: bolt
      real(wp), intent(in) :: d(:, :)          !! (neighbours, neighbours) [force/length]
      type(equations_type), intent(inout) :: equations
      real(wp) :: g(6, size(d, 1), size(bolt%crossed)), v(6, 2), others(size(d, 1), size(d, 1))
      integer :: a, b, i, m, side
      g = 0
      others = d
      do i = 1, size(d, 1)
         others(i, i) = 0
         do side = 1, 2
            associate (block => equations%pair(side, bolt%first_link + i))
               if (block == 0) cycle
               v = equations%vectors_of(bolt%first_link + i, side)
               a = findloc(bolt%crossed, block, 1)
               g(:, i, a) = v(:, 1)
            end associate
         end do
      end do
      m = 0
      do a = 1, size(bolt%crossed)
         do b = a, size(bolt%crossed)
            m = m + 1
            call equations%set_matrix(bolt%matrix(m), matmul(matmul(g(:, :, a), others), transpose(g(:, :, b))))
         end do
      end do
   end subroutine add_matrices

   !> Elongations of a bolt, displacements of its joints, and its motion across, for the solution.
   subroutine predict_bolt(bolt, level, equations)
      type(bolt_type), intent(inout) :: bolt
      real(wp), intent(in) :: level
      type(equations_type), intent(in) :: equations
      integer :: c, k
      bolt%e = 0
      bolt%sway = 0
      do k = 1, size(bolt%acting) - 1
         bolt%e(k) = level*motion_along(bolt%first_link + k, 1)
         if (bolt%tense(k) > 0) bolt%sway(k) = motion_along(bolt%first_link + k, 2)
      end do
      bolt%shift = 0
      do c = 1, size(bolt%crossing)
         if (bolt%holds(c)) bolt%shift(c) = level*motion_along(bolt%first_link + axial_links(bolt) + c, 2)
      end do

   contains

      !> Motion of a link along one of its lines.
      pure real(wp) function motion_along(link, line)
         integer, intent(in) :: link, line
         real(wp) :: v(6, 2)
         integer :: side
         motion_along = 0
         do side = 1, 2
            if (equations%pair(side, link) == 0) cycle
            v = equations%vectors_of(link, side)
            motion_along = motion_along + dot_product(v(:, line), equations%x(:, equations%pair(side, link)))
         end do
      end function motion_along

   end subroutine predict_bolt

   !> Forces of the links by their laws, at a fraction of the way.
   subroutine forces_of_links(bolt, fraction, force)
      type(bolt_type), intent(in) :: bolt
      real(wp), intent(in) :: fraction
      real(wp), intent(inout), contiguous :: force(:, :)   !! (2, links)
      type(bar_response_type) :: response
      real(wp) :: of_points(size(bolt%block)), of_dowel
      integer :: c, n
      logical :: shears
      n = bolt%first_link
      force(:, n + 1:n + links_of(bolt)) = 0
      if (size(bolt%acting) == 0) return
      call respond(bolt%bar, bolt%state, points_with(bolt, bolt%kept_e + fraction*(bolt%e - bolt%kept_e)), response)
      call condense(bolt%bar, response, of_points)
      associate (chain => chain_forces(bolt, of_points))
         force(1, n + 1:n + size(chain)) = chain/bolt%spacing
         force(2, n + 1:n + size(chain)) = across_bolt(bolt, bolt%kept_sway + fraction*(bolt%sway - bolt%kept_sway))
      end associate
      n = n + axial_links(bolt)
      do c = 1, size(bolt%crossing)
         if (.not. bolt%holds(c)) cycle
         call dowel_response(bolt, bolt%across(c) + bolt%kept_shift(c) + fraction* &
                             (bolt%shift(c) - bolt%kept_shift(c)) - bolt%dowel_slip(c), of_dowel, shears)
         force(2, n + c) = of_dowel/bolt%spacing
      end do
   end subroutine forces_of_links

   !> Forces across the links of neighbours that act, for their motion across the bolt.
   pure function across_bolt(bolt, sway) result(force)
      type(bolt_type), intent(in) :: bolt
      real(wp), intent(in) :: sway(:)          !! (neighbours) [length]
      real(wp) :: force(max(0, size(bolt%acting) - 1))
      force = bolt%tense(:size(force))*(sway(:size(force)) - bolt%turned(:size(force)))/bolt%spacing
   end function across_bolt

   !> Lengths of a bolt that the expected motion gives otherwise than the solution.
   subroutine measure_placement_of(bolt, level, context, equations)
      type(bolt_type), intent(in) :: bolt
      real(wp), intent(in) :: level
      type(step_context_type), intent(in) :: context
      type(equations_type), intent(inout) :: equations
      real(wp) :: moved(2, size(bolt%block)), chain(max(0, size(bolt%acting) - 1)), load, scale, off
      integer :: b, k, p
      if (size(chain) == 0) return
      moved = bolt%place
      do p = 1, size(bolt%block)
         b = bolt%block(p)
         if (b > 0) moved(:, p) = bolt%place(:, p) + end_displacement(context%moved(b), bolt%place(:, p))
      end do
      chain = chain_forces(bolt, bolt%tangent%force)
      do k = 1, size(chain)
         associate (p => bolt%acting(k), q => bolt%acting(k + 1))
            if (is_joint(bolt, p, q)) cycle
            off = abs(bolt%tangent%stiffness(p, q)*(separation(bolt, moved, p, q) - &
                                                    separation(bolt, bolt%place, p, q) - bolt%e(k)/level))
         end associate
         load = huge(load)
         do p = k, k + 1
            b = bolt%block(bolt%acting(p))
            if (b > 0) load = min(load, equations%block_force(b))
         end do
         if (load >= huge(load)) cycle
         scale = max(load, abs(chain(k))/bolt%spacing)
         if (scale > 0) equations%link_off(bolt%first_link + k) = off/bolt%spacing/scale
      end do
   end subroutine measure_placement_of

   !> Does the stiffness that is known belong to a response?
   pure logical function has_tangents(tangent, response)
      type(tangent_type), intent(in) :: tangent
      type(bar_response_type), intent(in) :: response
      has_tangents = .false.
      if (.not. allocated(tangent%of_steel)) return
      has_tangents = all(abs(tangent%of_steel - response%f_tangent) <= 0) .and. &
         all(abs(tangent%of_ties - response%t_tangent) <= 0) .and. all(tangent%holder == response%holder)
   end function has_tangents

   !> Linearise at the present motion; the last round holds where its forces follow the laws there.
   subroutine judge_bolt(bolt, n_changes)
      type(bolt_type), intent(inout) :: bolt
      integer, intent(inout) :: n_changes
      type(bar_response_type) :: response
      type(tangent_type) :: new
      real(wp) :: missing(size(bolt%block)), force
      logical :: shears
      integer :: c
      if (size(bolt%acting) == 0) return
      new%u = points_with(bolt, bolt%e)
      new%e = bolt%e
      if (.not. allocated(bolt%tangent%u)) then
         bolt%tangent%u = new%u
         bolt%tangent%e = new%e
         allocate (bolt%tangent%force(size(new%u)), bolt%tangent%stiffness(size(new%u), size(new%u)), source=0.0_wp)
      end if
      call respond(bolt%bar, bolt%state, new%u, response)
      new%force = new%u
      new%stiffness = bolt%tangent%stiffness
      if (has_tangents(bolt%tangent, response)) then
         call condense(bolt%bar, response, new%force)
      else
         call condense(bolt%bar, response, new%force, new%stiffness)
      end if
      new%of_steel = response%f_tangent
      new%of_ties = response%t_tangent
      new%holder = response%holder
      missing = new%force - (bolt%tangent%force + matmul(bolt%tangent%stiffness, new%u - bolt%tangent%u))
      if (maxval(abs(missing)) > agreement*maxval(abs(new%force)) + &
          rounding*maxval(abs(new%stiffness))*maxval(abs(new%u))) n_changes = n_changes + 1
      bolt%tangent = new
      do c = 1, size(bolt%crossing)
         call dowel_response(bolt, bolt%across(c) + bolt%shift(c) - bolt%dowel_slip(c), force, shears)
         if (shears .neqv. bolt%shears(c)) n_changes = n_changes + 1
         bolt%shears(c) = shears
      end do
   end subroutine judge_bolt

end module rockdda_interaction_bar_links
