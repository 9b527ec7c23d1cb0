! SPDX-License-Identifier: MIT
!> A bolt with nodes in the rock that it crosses: how it is drawn and installed, where its points are, how it is
!> stretched, and the forces that follow (docs/theory.md, "Bolts").
!>
!> A bolt lies in parts of blocks, from its head to its toe; each part has two points that move with its block. Between
!> neighbouring points that hold the bolt it changes its length: by the strain of a block within it, by the motion along
!> the bolt where it crosses a joint. Where a joint is crossed a dowel acts at a right angle to the bolt, elastic,
!> perfectly plastic.
module rockdda_interaction_bar_bolt
   use rockdda_base_kinds, only : wp
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_bolt_layout, only : trace_bolt, hold_ends
   use rockdda_model_bolt_numbers, only : bolt_numbers_type
   use rockdda_interaction_kinematics, only : affine_motion
   use rockdda_interaction_bar, only : bar_type, bar_state_type, bar_response_type, new_bar, respond, condense, &
      tension, stored_energy, largest_share
   use rockdda_interaction_context, only : step_context_type
   implicit none
   private

   !> A bolt is elastic without further inquiry as long as no part of it can reach this share of its strength.
   real(wp), parameter :: surely_elastic = 0.999_wp

   public :: bolt_type, draw_bolt, install, forget_step, measure_bolt, measure_between, find_directions, direction, &
      is_joint, separation, find_points, find_forces, is_straight, continue_forces, chain_forces, dowel_response, &
      energy_of, place_at, is_lost

   !> Forces at the motion of the last round, and their derivatives.
   type :: tangent_type
      real(wp), allocatable :: u(:)             !! (points) [length]
      real(wp), allocatable :: force(:)         !! (points) of the rock on the bar
      real(wp), allocatable :: stiffness(:, :)  !! (points, points)
      real(wp) :: largest = 0                   !! magnitude in it
      real(wp), allocatable :: e(:)             !! (neighbours) elongations of the step [length]
      real(wp), allocatable :: chain(:)         !! (neighbours) forces of their links
      real(wp), allocatable :: links(:, :)      !! (neighbours, neighbours) derivatives of `chain` by `e`
      integer, allocatable :: acting(:)         !! points for which `links` is
      logical :: is_elastic = .false.           !! nothing is at its limit, in the response that it belongs to
      real(wp), allocatable :: share(:)         !! (points) by which the largest share of a strength can grow [1/length]
      ! what `stiffness` follows from: tangents of elements and ties, and the ties that hold nodes
      real(wp), allocatable :: of_steel(:), of_ties(:)
      integer, allocatable :: holder(:)
   end type tangent_type

   !> What a bolt does in a step.
   type :: outcome_type
      type(bar_state_type) :: state               !! at the end of the step
      real(wp), allocatable :: dowel_slip(:)      !! (crossings) [length]
      real(wp) :: work = 0                        !! of the forces that have acted
      real(wp) :: slipped = 0, yielded = 0        !! work of slip and of yield
      real(wp) :: stored(2) = 0                   !! energy at the start and the end
      real(wp) :: freed = 0                       !! before the latter, by what has broken
   end type outcome_type

   !> One bolt.
   type :: bolt_type
      character(len=:), allocatable :: name
      integer :: installs = 0, removes = 0      !! stages; 0: from the start, never
      real(wp) :: spacing = 1                   !! out of the plane [length]
      real(wp) :: pretension = 0
      type(bar_type) :: bar
      integer, allocatable :: block(:)          !! (points) 0: the fixed outside
      real(wp), allocatable :: distance(:)      !! (points) from the head when it was drawn [length]
      integer, allocatable :: used(:)           !! points with a tie, ascending
      integer, allocatable :: crossed(:)        !! blocks of these, each once
      integer, allocatable :: crossing(:)       !! joints with a dowel: between the points c and c + 1
      real(wp) :: dowel_stiffness = 0, dowel_strength = 0
      ! what lasts
      logical :: is_there = .false.
      type(bar_state_type) :: state
      real(wp), allocatable :: place(:, :)      !! (2, points) now [length]
      real(wp), allocatable :: origin(:, :)     !! (2, points) when it was installed [length]
      real(wp), allocatable :: dowel_slip(:)    !! (crossings) displacement without force [length]
      ! of the step
      logical, allocatable :: there(:)          !! (points) the bolt and the block are
      integer, allocatable :: acting(:)         !! of `used`, those whose block is there
      real(wp), allocatable :: apart(:)         !! (neighbours that act) distances when it was installed [length]
      logical, allocatable :: holds(:)          !! (crossings)
      real(wp), allocatable :: start(:)         !! (points) displacements there [length]
      real(wp), allocatable :: across(:)        !! (crossings) displacement of the joint there [length]
      real(wp), allocatable :: parts(:, :)      !! (2, parts) directions there
      real(wp), allocatable :: along(:, :)      !! (2, neighbours that act) directions there
      real(wp), allocatable :: tense(:)         !! (neighbours) N/L across those that sway [force/length]
      ! of the attempt
      real(wp), allocatable :: e(:), kept_e(:)  !! (neighbours) elongations of the step where forces act [length]
      real(wp), allocatable :: shift(:), kept_shift(:)   !! (crossings)
      real(wp), allocatable :: sway(:), kept_sway(:)     !! (neighbours) motion across the bolt [length]
      real(wp), allocatable :: turned(:)        !! (neighbours) that by which the bolt has turned already [length]
      logical, allocatable :: shears(:)         !! (crossings) the dowel is held at its strength
      logical :: is_measured = .false.          !! between steps: what is of the step, and forces without motion
      ! at the motion `e`, once it has been found (find_forces)
      logical :: is_found = .false.
      real(wp), allocatable :: u(:), force(:)   !! (points) displacements [length], forces of the rock on the bar
      ! the last response in full, at `response_u`, of which `force` is the straight continuation
      type(bar_response_type) :: response
      real(wp), allocatable :: response_u(:), response_force(:)   !! (points)
      real(wp) :: share = 0                     !! largest share of a strength in it
      logical :: is_judged = .false.            !! `tangent` belongs to it
      real(wp), allocatable :: chain(:), kept_chain(:)   !! (neighbours) forces of links, there and at `kept_e`
      integer, allocatable :: kept_limits(:)    !! (elements, ties) what was at its limit at `kept_e`
      real(wp) :: stored = 0                    !! at the start of the step [energy]
      type(tangent_type) :: tangent
      integer :: version = 0                    !! counts changes of its vectors and of `tangent%links`
      integer :: first_link = 0
      integer, allocatable :: matrix(:)         !! (pairs of blocks) number among the matrices of the equations
      type(outcome_type) :: outcome             !! of the step, once it has been found
   end type bolt_type

contains

   !> A bolt in blocks as they have been drawn. An end that alone is held, in no block, is held by the fixed outside.
   pure subroutine draw_bolt(head, toe, numbers, blocks, rock, bolt)
      real(wp), intent(in) :: head(2), toe(2)     !! [length]
      type(bolt_numbers_type), intent(in) :: numbers
      type(block_system_type), intent(in) :: blocks
      logical, intent(in) :: rock(:)              !! (blocks) that are there
      type(bolt_type), intent(inout) :: bolt
      real(wp), allocatable :: from(:), to(:)
      integer, allocatable :: block(:)
      real(wp) :: length
      integer :: b, c, j, l
      logical, allocatable :: is_used(:)
      length = norm2(toe - head)
      call trace_bolt(head, toe, blocks, rock, block, from, to)
      if (.not. numbers%grouted) call hold_ends(head, toe, blocks, rock, block, from, to)
      bolt%spacing = numbers%spacing
      bolt%pretension = numbers%pretension
      bolt%dowel_stiffness = numbers%shear_stiffness
      bolt%dowel_strength = numbers%shear_strength
      bolt%bar = new_bar(numbers, from, to)
      allocate (bolt%block(2*size(block)), bolt%distance(2*size(block)), bolt%place(2, 2*size(block)))
      do j = 1, size(block)
         bolt%block(2*j - 1:2*j) = block(j)
         bolt%distance(2*j - 1:2*j) = [from(j), to(j)]
         bolt%place(:, 2*j - 1) = head + from(j)/length*(toe - head)
         bolt%place(:, 2*j) = head + to(j)/length*(toe - head)
      end do
      allocate (is_used(size(bolt%block)), source=.false.)
      do l = 1, size(bolt%bar%node)
         if (bolt%bar%share(l) < 1) is_used(bolt%bar%point(l)) = .true.
         if (bolt%bar%share(l) > 0) is_used(bolt%bar%point(l) + 1) = .true.
      end do
      bolt%used = pack([(j, j=1, size(is_used))], is_used)
      allocate (bolt%crossed(0))
      do j = 1, size(bolt%used)
         b = bolt%block(bolt%used(j))
         if (b > 0 .and. .not. any(bolt%crossed == b)) bolt%crossed = [bolt%crossed, b]
      end do
      allocate (bolt%matrix(size(bolt%crossed)*(size(bolt%crossed) + 1)/2), source=0)
      allocate (bolt%crossing(0))
      if (bolt%dowel_stiffness > 0) bolt%crossing = pack([(2*c, c=1, size(block) - 1)], &
                                                         block(2:) /= block(:size(block) - 1))
      associate (n => size(bolt%crossing), m => max(0, size(bolt%used) - 1))
         allocate (bolt%dowel_slip(n), bolt%across(n), bolt%shift(n), bolt%kept_shift(n), bolt%e(m), bolt%kept_e(m), &
                   bolt%sway(m), bolt%kept_sway(m), bolt%tense(m), bolt%turned(m), bolt%chain(m), &
                   bolt%kept_chain(m), source=0.0_wp)
         allocate (bolt%holds(n), bolt%shears(n), source=.false.)
         allocate (bolt%acting(0))
      end associate
      associate (n => size(bolt%block))
         allocate (bolt%start(n), bolt%u(n), bolt%force(n), bolt%response_u(n), bolt%response_force(n), source=0.0_wp)
      end associate
      allocate (bolt%kept_limits(bolt%bar%n - 1 + size(bolt%bar%node)), source=0)
      allocate (bolt%parts(2, size(bolt%block)/2), bolt%along(2, max(0, size(bolt%used) - 1)))
      call find_directions(bolt%place, bolt%parts)
      bolt%origin = bolt%place
      bolt%state = tension(bolt%bar, spread(.false., 1, size(bolt%bar%node)), 0.0_wp)
   end subroutine draw_bolt

   !> Install a bolt in the present place of its blocks, without stress but for the pretension.
   subroutine install(context, bolt)
      type(step_context_type), intent(in) :: context
      type(bolt_type), intent(inout) :: bolt
      real(wp), allocatable :: affine(:, :)
      integer :: p
      do p = 1, size(bolt%block)
         if (bolt%block(p) == 0) cycle
         affine = affine_motion(context%blocks, context%state%vertices, bolt%block(p))
         bolt%place(:, p) = affine(:, 1) + matmul(affine(:, 2:3), bolt%place(:, p))
      end do
      bolt%is_there = .true.
      bolt%origin = bolt%place
      call forget_step(bolt)
      call find_acting(context%state%active, bolt)
      bolt%state = tension(bolt%bar, is_held(bolt, context%state%active), bolt%pretension)
      call find_directions(bolt%place, bolt%parts)
      bolt%dowel_slip = joint_motion(bolt)
   end subroutine install

   !> Ties whose rock is there.
   pure function is_held(bolt, active) result(held)
      type(bolt_type), intent(in) :: bolt
      logical, intent(in) :: active(:)     !! (blocks)
      logical :: held(size(bolt%bar%node))
      integer :: l
      do l = 1, size(held)
         associate (b => bolt%block(bolt%bar%point(l)))
            held(l) = bolt%is_there
            if (b > 0) held(l) = held(l) .and. active(b)
         end associate
      end do
   end function is_held

   !> Points and dowels that act: those of blocks that are there.
   pure subroutine find_acting(active, bolt)
      logical, intent(in) :: active(:)     !! (blocks)
      type(bolt_type), intent(inout) :: bolt
      logical :: is_there, is_new
      integer :: c, p
      is_new = .not. allocated(bolt%there)
      if (is_new) allocate (bolt%there(size(bolt%block)), source=.false.)
      do p = 1, size(bolt%block)
         is_there = bolt%is_there
         if (bolt%block(p) > 0) is_there = is_there .and. active(bolt%block(p))
         is_new = is_new .or. (is_there .neqv. bolt%there(p))
         bolt%there(p) = is_there
      end do
      if (.not. is_new) return
      bolt%acting = pack(bolt%used, bolt%there(bolt%used))
      do c = 1, size(bolt%crossing)
         bolt%holds(c) = bolt%there(bolt%crossing(c)) .and. bolt%there(bolt%crossing(c) + 1)
      end do
      bolt%state%held = is_held(bolt, active)
      if (bolt%is_there) bolt%state%broken = bolt%state%broken .or. is_lost(bolt)
      call measure_origin(bolt)
   end subroutine find_acting

   !> Elements in blocks that are gone: what excavates the rock takes them out.
   pure function is_lost(bolt)
      type(bolt_type), intent(in) :: bolt
      logical :: is_lost(bolt%bar%n - 1)
      real(wp) :: near
      integer :: j
      near = 1.0e-6_wp*bolt%bar%place(bolt%bar%n)
      is_lost = .false.
      do j = 2, size(bolt%block), 2
         if (bolt%there(j)) cycle
         where (bolt%bar%place(2:) > bolt%distance(j - 1) + near .and. &
                bolt%bar%place(:bolt%bar%n - 1) < bolt%distance(j) - near) is_lost = .true.
      end do
   end function is_lost

   !> Distances of neighbours when the bolt was installed.
   pure subroutine measure_origin(bolt)
      type(bolt_type), intent(inout) :: bolt
      real(wp) :: parts(2, size(bolt%block)/2)
      integer :: k
      call find_directions(bolt%origin, parts)
      bolt%apart = [(separation(bolt, bolt%origin, parts, bolt%acting(k), bolt%acting(k + 1)), &
                     k=1, size(bolt%acting) - 1)]
   end subroutine measure_origin

   !> Forget what follows from places and state: they are new.
   pure subroutine forget_step(bolt)
      type(bolt_type), intent(inout) :: bolt
      if (allocated(bolt%there)) deallocate (bolt%there)
      bolt%is_measured = .false.
   end subroutine forget_step

   !> What is known of a bolt between steps: its points at their present places, and its forces there.
   pure subroutine measure_between(active, bolt)
      logical, intent(in) :: active(:)     !! (blocks)
      type(bolt_type), intent(inout) :: bolt
      call measure_bolt(active, bolt)
      bolt%e = 0
      bolt%is_found = .false.
      if (size(bolt%acting) > 0) then
         call find_forces(bolt)
         bolt%stored = energy_of(bolt, bolt%response, bolt%across, bolt%dowel_slip)
      else
         bolt%stored = 0
      end if
      bolt%is_measured = .true.
   end subroutine measure_between

   !> What is known of the bolts at the present places of their points.
   pure subroutine measure_bolt(active, bolt)
      logical, intent(in) :: active(:)     !! (blocks)
      type(bolt_type), intent(inout) :: bolt
      call find_acting(active, bolt)
      call find_directions(bolt%place, bolt%parts)
      call find_start(bolt)
      bolt%across(:) = joint_motion(bolt)
   end subroutine measure_bolt

   !> Directions of the parts of a bolt, for some places of its points.
   pure subroutine find_directions(place, parts)
      real(wp), intent(in) :: place(:, :)      !! (2, points)
      real(wp), intent(out) :: parts(:, :)     !! (2, parts)
      integer :: j
      real(wp) :: d(2)
      do j = 1, size(parts, 2)
         d = place(:, 2*j) - place(:, 2*j - 1)
         parts(:, j) = unit(d)
      end do
   end subroutine find_directions

   !> Direction of a bolt from point p to point q, for some places of its points: that of the line between them, or, at
   !> a joint, the mean of those of the parts on both sides.
   pure function direction(bolt, place, parts, p, q) result(along)
      type(bolt_type), intent(in) :: bolt
      real(wp), intent(in) :: place(:, :)      !! (2, points)
      real(wp), intent(in) :: parts(:, :)      !! (2, parts) directions there
      integer, intent(in) :: p, q
      real(wp) :: along(2), d(2)
      if (is_joint(bolt, p, q)) then
         d = parts(:, (p + 1)/2) + parts(:, (q + 1)/2)
      else
         d = place(:, q) - place(:, p)
      end if
      along = unit(d)
   end function direction

   !> A vector of the length 1 along another one; 0 where that has no length.
   pure function unit(v)
      real(wp), intent(in) :: v(2)
      real(wp) :: unit(2), length
      unit = v
      length = sqrt(v(1)**2 + v(2)**2)
      if (length > 0) unit = v/length
   end function unit

   !> Do two points lie on both sides of a joint?
   pure logical function is_joint(bolt, p, q)
      type(bolt_type), intent(in) :: bolt
      integer, intent(in) :: p, q
      is_joint = .not. bolt%distance(q) - bolt%distance(p) > 1.0e-9_wp*bolt%distance(size(bolt%distance))
   end function is_joint

   !> Distance of point q from point p along the bolt, for some places of its points.
   pure real(wp) function separation(bolt, place, parts, p, q)
      type(bolt_type), intent(in) :: bolt
      real(wp), intent(in) :: place(:, :)      !! (2, points)
      real(wp), intent(in) :: parts(:, :)      !! (2, parts) directions there
      integer, intent(in) :: p, q
      real(wp) :: along(2)
      along = direction(bolt, place, parts, p, q)
      separation = along(1)*(place(1, q) - place(1, p)) + along(2)*(place(2, q) - place(2, p))
   end function separation

   !> Directions from neighbour to neighbour, and displacements along the bolt since it was installed, from its first
   !> point that acts, of all points that do.
   pure subroutine find_start(bolt)
      type(bolt_type), intent(inout) :: bolt
      integer :: k
      bolt%start = 0
      do k = 2, size(bolt%acting)
         associate (p => bolt%acting(k - 1), q => bolt%acting(k))
            bolt%along(:, k - 1) = direction(bolt, bolt%place, bolt%parts, p, q)
            bolt%start(q) = bolt%start(p) + &
               (dot_product(bolt%along(:, k - 1), bolt%place(:, q) - bolt%place(:, p)) - bolt%apart(k - 1))
         end associate
      end do
   end subroutine find_start

   !> Displacements across the bolt, of the second part against the first one, at the joints with a dowel.
   pure function joint_motion(bolt) result(across)
      type(bolt_type), intent(in) :: bolt
      real(wp) :: across(size(bolt%crossing)), n(2)
      integer :: c
      do c = 1, size(across)
         associate (p => bolt%crossing(c))
            n = direction(bolt, bolt%place, bolt%parts, p, p + 1)
            across(c) = dot_product([-n(2), n(1)], bolt%place(:, p + 1) - bolt%place(:, p))
         end associate
      end do
   end function joint_motion

   !> Displacements of the points where forces act, with elongations of the step.
   pure subroutine find_points(bolt, e, u)
      type(bolt_type), intent(in) :: bolt
      real(wp), intent(in) :: e(:)             !! of neighbours that act [length]
      real(wp), intent(out) :: u(:)            !! (points) [length]
      real(wp) :: sum_e
      integer :: k
      u = bolt%start
      sum_e = 0
      do k = 2, size(bolt%acting)
         sum_e = sum_e + e(k - 1)
         u(bolt%acting(k)) = u(bolt%acting(k)) + sum_e
      end do
   end subroutine find_points

   !> Forces at the present motion.
   pure subroutine find_forces(bolt, near)
      type(bolt_type), intent(inout) :: bolt
      logical, intent(in), optional :: near    !! begin where forces were last found in this attempt
      real(wp) :: share
      integer :: p
      logical :: is_near
      is_near = .false.
      if (present(near)) is_near = near
      call find_points(bolt, bolt%e, bolt%u)
      bolt%is_found = .true.
      if (is_near .and. bolt%tangent%is_elastic) then
         ! what is elastic stays so as long as no strength can be reached
         share = bolt%share
         do p = 1, size(bolt%u)
            share = share + bolt%tangent%share(p)*abs(bolt%u(p) - bolt%response_u(p))
         end do
         if (share < surely_elastic) then
            call continue_forces(size(bolt%u), bolt%response_force, bolt%tangent%stiffness, bolt%response_u, bolt%u, &
                                 bolt%force)
            call chain_forces(bolt, bolt%force, bolt%chain)
            return
         end if
      end if
      call respond(bolt%bar, bolt%state, bolt%u, bolt%response, near=near)
      call condense(bolt%bar, bolt%response, bolt%force)
      call chain_forces(bolt, bolt%force, bolt%chain)
      bolt%response_u(:) = bolt%u
      bolt%response_force(:) = bolt%force
      bolt%share = largest_share(bolt%bar, bolt%response)
      bolt%is_judged = .false.
   end subroutine find_forces

   !> Forces by the tangents at another motion.
   pure subroutine continue_forces(n, known, stiffness, from, u, force)
      integer, intent(in) :: n                           !! points
      real(wp), intent(in) :: known(n), stiffness(n, n)
      real(wp), intent(in) :: from(n), u(n)              !! [length]
      real(wp), intent(out) :: force(n)
      integer :: p
      force = known
      do p = 1, n
         force = force + stiffness(:, p)*(u(p) - from(p))
      end do
   end subroutine continue_forces

   !> Are forces between the motion that was kept and the present one straight in it? What follows one branch of its law
   !> at both ends does so in between, and the nodes are there in between.
   pure logical function is_straight(bolt)
      type(bolt_type), intent(in) :: bolt
      integer :: n
      n = size(bolt%response%f_limit)
      is_straight = all(bolt%kept_limits(:n) == bolt%response%f_limit) .and. &
         all(bolt%kept_limits(n + 1:) == bolt%response%t_limit)
   end function is_straight

   !> Place of a point of the bar, on the line through its points in the rock.
   pure function place_at(bolt, distance) result(place)
      type(bolt_type), intent(in) :: bolt
      real(wp), intent(in) :: distance           !! from the head [length]
      real(wp) :: place(2), share
      integer :: p
      place = 0
      if (size(bolt%block) == 0) return
      do p = 1, size(bolt%block) - 2
         if (bolt%distance(p + 1) >= distance) exit
      end do
      associate (s => bolt%distance(p:p + 1), x => bolt%place(:, p:p + 1))
         share = 0
         if (s(2) > s(1)) share = (distance - s(1))/(s(2) - s(1))
         place = x(:, 1) + share*(x(:, 2) - x(:, 1))
      end associate
   end function place_at

   !> Forces of the links of neighbours: minus the sum of the forces of the rock on the bar on the side of the head.
   pure subroutine chain_forces(bolt, force, chain)
      type(bolt_type), intent(in) :: bolt
      real(wp), intent(in) :: force(:)         !! (points) of the rock on the bar
      real(wp), intent(out) :: chain(:)        !! (neighbours) 0 where there are none that act
      real(wp) :: total
      integer :: k
      chain = 0
      total = 0
      do k = 1, size(bolt%acting) - 1
         total = total - force(bolt%acting(k))
         chain(k) = total
      end do
   end subroutine chain_forces

   !> Force of a dowel.
   pure subroutine dowel_response(bolt, displacement, force, shears)
      type(bolt_type), intent(in) :: bolt
      real(wp), intent(in) :: displacement     !! elastic, if it did not yield [length]
      real(wp), intent(out) :: force
      logical, intent(out) :: shears
      force = bolt%dowel_stiffness*displacement
      shears = abs(force) > bolt%dowel_strength
      if (shears) force = sign(bolt%dowel_strength, force)
   end subroutine dowel_response

   !> Energy that a bolt has stored.
   pure real(wp) function energy_of(bolt, response, across, dowel_slip) result(stored)
      type(bolt_type), intent(in) :: bolt
      type(bar_response_type), intent(in) :: response
      real(wp), intent(in) :: across(:), dowel_slip(:)   !! (crossings) displacement; that without force [length]
      real(wp) :: force
      logical :: shears
      integer :: c
      stored = 0
      if (.not. bolt%is_there) return
      stored = stored_energy(bolt%bar, response)
      do c = 1, size(bolt%crossing)
         if (.not. bolt%holds(c)) cycle
         call dowel_response(bolt, across(c) - dowel_slip(c), force, shears)
         stored = stored + 0.5_wp*force**2/bolt%dowel_stiffness
      end do
      stored = stored/bolt%spacing
   end function energy_of

end module rockdda_interaction_bar_bolt
