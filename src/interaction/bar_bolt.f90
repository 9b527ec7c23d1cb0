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
   use rockdda_model_bolt_layout, only : trace_bolt
   use rockdda_model_bolt_numbers, only : bolt_numbers_type
   use rockdda_interaction_affine_motion, only : affine_motion
   use rockdda_interaction_bar, only : bar_type, bar_state_type, bar_response_type, new_bar, tension, stored_energy
   use rockdda_interaction_context, only : step_context_type
   implicit none
   private
   public :: bolt_type, tangent_type, outcome_type, draw_bolt, install, measure_bolt, direction, is_joint, separation, &
      points_with, chain_forces, dowel_response, energy_of, place_at

   !> Forces at some motion of the points, and their derivatives.
   type :: tangent_type
      real(wp), allocatable :: u(:)             !! (points) [length]
      real(wp), allocatable :: force(:)         !! (points) of the rock on the bar
      real(wp), allocatable :: stiffness(:, :)  !! (points, points)
      real(wp), allocatable :: e(:)             !! (neighbours) elongations of the step [length]
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
      integer, allocatable :: acting(:)         !! of `used`, those whose block is there
      logical, allocatable :: holds(:)          !! (crossings)
      real(wp), allocatable :: start(:)         !! (points) displacements there [length]
      real(wp), allocatable :: across(:)        !! (crossings) displacement of the joint there [length]
      real(wp), allocatable :: tense(:)         !! (neighbours) N/L across those that sway [force/length]
      ! of the attempt
      real(wp), allocatable :: e(:), kept_e(:)  !! (neighbours) elongations of the step where forces act [length]
      real(wp), allocatable :: shift(:), kept_shift(:)   !! (crossings)
      real(wp), allocatable :: sway(:), kept_sway(:)     !! (neighbours) motion across the bolt [length]
      real(wp), allocatable :: turned(:)        !! (neighbours) that by which the bolt has turned already [length]
      logical, allocatable :: shears(:)         !! (crossings) the dowel is held at its strength
      type(tangent_type) :: tangent
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
      real(wp) :: length, near
      integer :: b, c, j, l
      logical, allocatable :: is_used(:)
      length = norm2(toe - head)
      near = 1.0e-6_wp*length
      call trace_bolt(head, toe, blocks, rock, block, from, to)
      if (.not. numbers%grouted) then
         if (size(block) == 0) then
            block = [0]
            from = [0.0_wp]
            to = [length]
         end if
         if (from(1) > near) then
            block = [0, block]
            from = [0.0_wp, from]
            to = [0.0_wp, to]
         end if
         if (to(size(to)) < length - near) then
            block = [block, 0]
            from = [from, length]
            to = [to, length]
         end if
      end if
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
         allocate (bolt%dowel_slip(n), bolt%across(n), bolt%shift(n), &
            bolt%kept_shift(n), &
                   bolt%e(m), bolt%kept_e(m), bolt%sway(m), bolt%kept_sway(m), bolt%tense(m), bolt%turned(m), &
                   bolt%start(size(bolt%block)), source=0.0_wp)
         allocate (bolt%holds(n), bolt%shears(n), source=.false.)
         allocate (bolt%acting(0))
      end associate
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
      call find_acting(context%state%active, bolt)
      bolt%origin = bolt%place
      bolt%state = tension(bolt%bar, is_held(bolt, context%state%active), bolt%pretension)
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
      logical :: there(size(bolt%block))
      integer :: c
      there = bolt%is_there
      where (bolt%block > 0) there = there .and. active(max(1, bolt%block))
      bolt%acting = pack(bolt%used, there(bolt%used))
      do c = 1, size(bolt%crossing)
         bolt%holds(c) = there(bolt%crossing(c)) .and. there(bolt%crossing(c) + 1)
      end do
      bolt%state%held = is_held(bolt, active)
   end subroutine find_acting

   !> What is known of the bolts at the present places of their points.
   pure subroutine measure_bolt(active, bolt)
      logical, intent(in) :: active(:)     !! (blocks)
      type(bolt_type), intent(inout) :: bolt
      call find_acting(active, bolt)
      bolt%start = points_along(bolt)
      bolt%across = joint_motion(bolt)
   end subroutine measure_bolt

   !> Direction of a bolt from point p to point q, for some places of its points: that of the line between them, or, at
   !> a joint, the mean of those of the parts on both sides.
   pure function direction(bolt, place, p, q) result(along)
      type(bolt_type), intent(in) :: bolt
      real(wp), intent(in) :: place(:, :)      !! (2, points)
      integer, intent(in) :: p, q
      real(wp) :: along(2)
      if (is_joint(bolt, p, q)) then
         along = of_part((p + 1)/2) + of_part((q + 1)/2)
      else
         along = place(:, q) - place(:, p)
      end if
      if (norm2(along) > 0) along = along/norm2(along)

   contains

      !> Direction of a part.
      pure function of_part(part) result(n)
         integer, intent(in) :: part
         real(wp) :: n(2)
         n = place(:, 2*part) - place(:, 2*part - 1)
         if (norm2(n) > 0) n = n/norm2(n)
      end function of_part

   end function direction

   !> Do two points lie on both sides of a joint?
   pure logical function is_joint(bolt, p, q)
      type(bolt_type), intent(in) :: bolt
      integer, intent(in) :: p, q
      is_joint = .not. bolt%distance(q) - bolt%distance(p) > 1.0e-9_wp*bolt%distance(size(bolt%distance))
   end function is_joint

   !> Distance of point q from point p along the bolt, for some places of its points.
   pure real(wp) function separation(bolt, place, p, q)
      type(bolt_type), intent(in) :: bolt
      real(wp), intent(in) :: place(:, :)      !! (2, points)
      integer, intent(in) :: p, q
      separation = dot_product(direction(bolt, place, p, q), place(:, q) - place(:, p))
   end function separation

   !> Displacements along the bolt since it was installed, from its first point that acts, of all points that do.
   pure function points_along(bolt) result(u)
      type(bolt_type), intent(in) :: bolt
      real(wp) :: u(size(bolt%block))
      integer :: k
      u = 0
      do k = 2, size(bolt%acting)
         associate (p => bolt%acting(k - 1), q => bolt%acting(k))
            u(q) = u(p) + (separation(bolt, bolt%place, p, q) - separation(bolt, bolt%origin, p, q))
         end associate
      end do
   end function points_along

   !> Displacements across the bolt, of the second part against the first one, at the joints with a dowel.
   pure function joint_motion(bolt) result(across)
      type(bolt_type), intent(in) :: bolt
      real(wp) :: across(size(bolt%crossing)), n(2)
      integer :: c
      do c = 1, size(across)
         associate (p => bolt%crossing(c))
            n = direction(bolt, bolt%place, p, p + 1)
            across(c) = dot_product([-n(2), n(1)], bolt%place(:, p + 1) - bolt%place(:, p))
         end associate
      end do
   end function joint_motion

   !> Displacements of the points where forces act, with elongations of the step.
   pure function points_with(bolt, e) result(u)
      type(bolt_type), intent(in) :: bolt
      real(wp), intent(in) :: e(:)             !! of neighbours that act [length]
      real(wp) :: u(size(bolt%block)), sum_e
      integer :: k
      u = bolt%start
      sum_e = 0
      do k = 2, size(bolt%acting)
         sum_e = sum_e + e(k - 1)
         u(bolt%acting(k)) = u(bolt%acting(k)) + sum_e
      end do
   end function points_with

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
   pure function chain_forces(bolt, force) result(chain)
      type(bolt_type), intent(in) :: bolt
      real(wp), intent(in) :: force(:)         !! (points) of the rock on the bar
      real(wp) :: chain(max(0, size(bolt%acting) - 1)), total
      integer :: k
      total = 0
      do k = 1, size(chain)
         total = total - force(bolt%acting(k))
         chain(k) = total
      end do
   end function chain_forces

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

   !> Energy that a bolt has stored, at its present place.
   pure real(wp) function energy_of(bolt, response) result(stored)
      type(bolt_type), intent(in) :: bolt
      type(bar_response_type), intent(in) :: response
      real(wp) :: force
      logical :: shears
      integer :: c
      stored = 0
      if (.not. bolt%is_there) return
      stored = stored_energy(bolt%bar, response)
      do c = 1, size(bolt%crossing)
         if (.not. bolt%holds(c)) cycle
         call dowel_response(bolt, bolt%across(c) - bolt%dowel_slip(c), force, shears)
         stored = stored + 0.5_wp*force**2/bolt%dowel_stiffness
      end do
      stored = stored/bolt%spacing
   end function energy_of

end module rockdda_interaction_bar_bolt
