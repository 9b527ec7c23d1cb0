! SPDX-License-Identifier: MIT
!> Bolts with nodes along their length, in all blocks that they cross (docs/theory.md, "Bolts").
!>
!> A bolt lies in parts of blocks, from its head to its toe; each part has two points that move with its block. Between
!> neighbouring points that hold the bolt it changes its length: by the strain of a block within it, by the motion along
!> the bolt where it crosses a joint. The steel and its grout give forces N on these elongations e and their derivatives
!> D (rockdda_interaction_bar). Each pair of points becomes a link with the stiffness that D has for it: a bolt couples
!> the blocks that it crosses, and no others. The forces are on the links between neighbours alone, and elongations are
!> those of the expected motion, as of the springs in rockdda_interaction_bolts.
!>
!> In static steps a bolt that spans two blocks turns with their motion at the end of the step: its tension is a spring
!> N/L across it. A block that hangs would swing for ever else.
!>
!> Each round linearises at the motion of the last one, and is repeated until forces follow their laws there. Where
!> a joint is crossed a dowel acts at a right angle to the bolt, elastic, perfectly plastic.
module rockdda_interaction_bars
   use rockdda_base_kinds, only : wp
   use rockdda_base_state_archive, only : state_archive_type
   use rockdda_base_strings, only : is_given
   use rockdda_base_value_check, only : value_check_type
   use rockdda_model_blocks, only : block_system_type, largest_coordinate
   use rockdda_model_bolt_layout, only : bolt_line_type, bolt_lines, trace_bolt, rock_at, stage_with
   use rockdda_model_geometry_input, only : is_spring
   use rockdda_model_bolt_numbers, only : bolt_numbers_type, numbers_of_bolt
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_state, only : block_state_type, energy
   use rockdda_interaction_balance, only : energy_balance_type
   use rockdda_interaction_bar, only : bar_type, bar_form_type, bar_state_type, bar_response_type, new_bar, respond, &
      condense, accept, tension, stored_energy, node_forces
   use rockdda_interaction_block_forces, only : block_forces_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_equations, only : equations_type
   use rockdda_interaction_finite_rotation, only : moving_block_type, mean_load, mean_displacement, end_displacement
   use rockdda_interaction_interaction, only : interaction_type
   use rockdda_interaction_kinematics, only : move_point
   implicit none
   private
   public :: bars_type, node_state

   !> Forces agree with their laws to this share.
   real(wp), parameter :: agreement = 1.0e-8_wp
   !> Rounding of lengths, as a share of them.
   real(wp), parameter :: rounding = 1.0e-13_wp
   !> What carries this share of its strength is shown as slipping or yielding, also at rest.
   real(wp), parameter :: at_limit = 1 - 1.0e-6_wp

   !> What a node is at the end of a step.
   type :: node_state_enum
      integer :: absent = 0
      integer :: elastic = 1
      integer :: slipping = 2
      integer :: yielding = 3
      integer :: ruptured = 4
   end type node_state_enum
   type(node_state_enum), parameter :: node_state = node_state_enum()

   !> Forces at some motion of the points, and their derivatives.
   type :: tangent_type
      real(wp), allocatable :: u(:)             !! (points) [length]
      real(wp), allocatable :: force(:)         !! (points) of the rock on the bar
      real(wp), allocatable :: stiffness(:, :)  !! (points, points)
      real(wp), allocatable :: e(:)             !! (neighbours) elongations of the step [length]
   end type tangent_type

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
   end type bolt_type

   type, extends(interaction_type) :: bars_type
      type(bolt_type), allocatable :: bolts(:)
      real(wp) :: work(3) = 0                   !! of slip, of yield, set free by breaking [energy]
      real(wp), private :: level = 1            !! share of the step's motion up to where forces act
   contains
      procedure :: init
      procedure :: begin_stage
      procedure :: start_energy
      procedure :: subtract_datum
      procedure :: n_nodes
      procedure :: show_nodes
      procedure :: show_bolts
      procedure :: count_links
      procedure :: prepare
      procedure :: begin
      procedure :: place
      procedure :: add_to_links
      procedure :: predict
      procedure :: keep
      procedure :: shorten
      procedure :: lawful_forces
      procedure :: measure_placement
      procedure :: judge
      procedure :: add_energies
      procedure :: commit
      procedure :: add_forces
      procedure :: exchange_state
      procedure :: check_state
   end type bars_type

contains

   !> The bolts of a model, those from the start installed. Blocks are where they have been drawn; those with bolts are
   !> marked in the context.
   subroutine init(self, context)
      class(bars_type), intent(inout) :: self
      type(step_context_type), intent(inout) :: context
      type(bolt_line_type), allocatable :: lines(:)
      type(block_system_type) :: blocks
      integer :: l
      if (allocated(self%bolts)) deallocate (self%bolts)
      allocate (self%bolts(0))
      associate (p => context%parameters)
         if (.not. allocated(p%bolts)) return
         if (all(is_spring(p%bolts))) return
         blocks = context%model_blocks()
         call bolt_lines(p%bolts, blocks, p%regions, p%stages, lines)
         deallocate (self%bolts)
         allocate (self%bolts(size(lines)))
         if (allocated(context%bolted)) deallocate (context%bolted)
         allocate (context%bolted(blocks%n_blocks), source=.false.)
         do l = 1, size(lines)
            associate (bolt => self%bolts(l))
               bolt%name = lines(l)%name
               bolt%installs = stage_with(p%stages, p%bolts(lines(l)%group)%name, installs=.true.)
               bolt%removes = stage_with(p%stages, p%bolts(lines(l)%group)%name, installs=.false.)
               call draw_bolt(lines(l)%head - context%state%datum, lines(l)%toe - context%state%datum, &
                              numbers_of_bolt(p%bolts(lines(l)%group), norm2(lines(l)%toe - lines(l)%head)), &
                              context%blocks, rock_at(blocks, p%regions, p%stages, bolt%installs), bolt)
               if (bolt%installs == 0) call install(context, bolt)
               context%bolted(pack(bolt%block, bolt%block > 0)) = .true.
            end associate
         end do
      end associate
   end subroutine init

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
      bolt%bar = new_bar(form_of(numbers, length), from, to)
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

   !> The form of a bar by its numbers.
   pure type(bar_form_type) function form_of(numbers, length) result(form)
      type(bolt_numbers_type), intent(in) :: numbers
      real(wp), intent(in) :: length
      form = bar_form_type(length=length, axial=numbers%axial, yield=numbers%yield, &
                           rupture_strain=numbers%rupture_strain, stroke=numbers%stroke, grouted=numbers%grouted, &
                           element=numbers%element, grout_stiffness=numbers%grout_stiffness, &
                           grout_strength=numbers%grout_strength, grout_residual=numbers%grout_residual, &
                           free=numbers%free, plate_strength=numbers%plate_strength)
   end function form_of

   !> Install a bolt in the present place of its blocks, without stress but for the pretension.
   subroutine install(context, bolt)
      type(step_context_type), intent(in) :: context
      type(bolt_type), intent(inout) :: bolt
      real(wp), allocatable :: affine(:, :)
      integer :: p
      do p = 1, size(bolt%block)
         if (bolt%block(p) == 0) cycle
         affine = motion_so_far(context, bolt%block(p))
         bolt%place(:, p) = affine(:, 1) + matmul(affine(:, 2:3), bolt%place(:, p))
      end do
      bolt%is_there = .true.
      call find_acting(context%state%active, bolt)
      bolt%origin = bolt%place
      bolt%state = tension(bolt%bar, is_held(bolt, context%state%active), bolt%pretension)
      bolt%dowel_slip = joint_motion(bolt)
   end subroutine install

   !> Motion of a block since it was drawn: place = m(:, 1) + m(:, 2:3) place when drawn, by its vertices.
   pure function motion_so_far(context, block) result(m)
      type(step_context_type), intent(in) :: context
      integer, intent(in) :: block
      real(wp) :: m(2, 3), was(2), is(2), a(2, 2), b(2, 2), x(2)
      integer :: first, last, v
      first = context%blocks%vertex_offset(block) + 1
      last = context%blocks%vertex_offset(block + 1)
      associate (old => context%blocks%vertices(:, first:last), new => context%state%vertices(:, first:last))
         m(:, 1) = 0
         m(:, 2:3) = reshape([1.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [2, 2])
         if (all(abs(old - new) <= 0)) return
         was = sum(old, 2)/size(old, 2)
         is = sum(new, 2)/size(new, 2)
         a = 0
         b = 0
         do v = 1, size(old, 2)
            x = old(:, v) - was
            a = a + spread(new(:, v) - is, 2, 2)*spread(x, 1, 2)
            b = b + spread(x, 2, 2)*spread(x, 1, 2)
         end do
         b = reshape([b(2, 2), -b(2, 1), -b(1, 2), b(1, 1)], [2, 2])/(b(1, 1)*b(2, 2) - b(1, 2)*b(2, 1))
         m(:, 2:3) = matmul(a, b)
         m(:, 1) = is - matmul(m(:, 2:3), was)
      end associate
   end function motion_so_far

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

   !> What is known of the bolts at the present places of their points.
   pure subroutine measure_bolt(active, bolt)
      logical, intent(in) :: active(:)     !! (blocks)
      type(bolt_type), intent(inout) :: bolt
      call find_acting(active, bolt)
      bolt%start = points_along(bolt)
      bolt%across = joint_motion(bolt)
   end subroutine measure_bolt

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

   !> Energy of all bolts at the present places of their blocks.
   pure real(wp) function start_energy(self, context) result(stored)
      class(bars_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(bar_response_type) :: response
      type(bolt_type) :: bolt
      integer :: l
      stored = 0
      do l = 1, n_bolts(self)
         bolt = self%bolts(l)
         if (.not. bolt%is_there) cycle
         call measure_bolt(context%state%active, bolt)
         call respond(bolt%bar, bolt%state, bolt%start, response)
         stored = stored + energy_of(bolt, response)
      end do
   end function start_energy

   !> Install and remove bolts when a stage begins. The energy of pretension is work from outside; what bolts lose that
   !> go, or whose rock has gone, is discarded.
   subroutine begin_stage(self, stage, context, balance)
      class(bars_type), intent(inout) :: self
      integer, intent(in) :: stage
      type(step_context_type), intent(in) :: context
      class(energy_balance_type), intent(inout) :: balance
      real(wp) :: left, now
      integer :: l
      if (n_bolts(self) == 0) return
      do l = 1, n_bolts(self)
         if (self%bolts(l)%removes == stage) self%bolts(l)%is_there = .false.
      end do
      left = self%start_energy(context)
      call balance%add(energy%discarded, balance%bar_energy - left)
      do l = 1, n_bolts(self)
         if (self%bolts(l)%installs == stage) call install(context, self%bolts(l))
      end do
      now = self%start_energy(context)
      call balance%add(energy%external, now - left)
      balance%bar_energy = now
   end subroutine begin_stage

   !> Make places relative to a datum.
   pure subroutine subtract_datum(self, datum)
      class(bars_type), intent(inout) :: self
      real(wp), intent(in) :: datum(2)
      integer :: l
      do l = 1, n_bolts(self)
         associate (bolt => self%bolts(l))
            bolt%place = bolt%place - spread(datum, 2, size(bolt%block))
            bolt%origin = bolt%origin - spread(datum, 2, size(bolt%block))
         end associate
      end do
   end subroutine subtract_datum

   !> Nodes of all bolts.
   pure integer function n_nodes(self) result(n)
      class(bars_type), intent(in) :: self
      integer :: l
      n = 0
      do l = 1, n_bolts(self)
         n = n + self%bolts(l)%bar%n
      end do
   end function n_nodes

   !> Place, axial force, slip, largest share of a strength, and state of all nodes.
   pure subroutine show_nodes(self, context, place, force, slip, use, state)
      class(bars_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      real(wp), intent(out) :: place(:, :)       !! (2, nodes) [length]
      real(wp), intent(out) :: force(:), slip(:), use(:) !! (nodes)
      integer, intent(out) :: state(:)           !! (nodes) node_state%...
      type(bar_response_type) :: response
      type(bolt_type) :: bolt
      integer :: e, i, l, n, t
      n = 0
      force = 0
      slip = 0
      use = 0
      state = node_state%absent
      do l = 1, n_bolts(self)
         bolt = self%bolts(l)
         call measure_bolt(context%state%active, bolt)
         do i = 1, bolt%bar%n
            place(:, n + i) = place_at(bolt, bolt%bar%place(i))
         end do
         if (size(bolt%acting) > 0) then
            call respond(bolt%bar, bolt%state, bolt%start, response)
            force(n + 1:n + bolt%bar%n) = node_forces(bolt%bar, response)
            state(n + 1:n + bolt%bar%n) = node_state%elastic
            do t = 1, size(bolt%bar%node)
               if (bolt%bar%element(t) == 0 .or. .not. bolt%state%held(t)) cycle
               i = n + bolt%bar%node(t)
               slip(i) = response%w(bolt%bar%node(t)) - response%at(t)
               use(i) = max(use(i), abs(response%t(t))/slip_limit(bolt, t))
               if (abs(response%t(t)) >= at_limit*slip_limit(bolt, t)) state(i) = node_state%slipping
            end do
            do i = 1, bolt%bar%n
               e = min(i, bolt%bar%n - 1)
               use(n + i) = min(1.0_wp, max(use(n + i), maxval(abs(response%f(max(1, i - 1):e))/ &
                                                               bolt%bar%yield(max(1, i - 1):e))))
               if (abs(response%f(e)) >= at_limit*bolt%bar%yield(e)) state(n + i) = node_state%yielding
               if (.not. bolt%state%broken(e)) cycle
               state(n + i) = node_state%ruptured
               use(n + i) = 1
            end do
         end if
         n = n + bolt%bar%n
      end do
   end subroutine show_nodes

   !> Number of bolts; before `init` there are none.
   pure integer function n_bolts(self)
      class(bars_type), intent(in) :: self
      n_bolts = 0
      if (allocated(self%bolts)) n_bolts = size(self%bolts)
   end function n_bolts

   !> Force at which a tie slips.
   pure real(wp) function slip_limit(bolt, tie)
      type(bolt_type), intent(in) :: bolt
      integer, intent(in) :: tie
      slip_limit = bolt%bar%strength(tie)
      if (bolt%state%weak(tie)) slip_limit = bolt%bar%residual*slip_limit
   end function slip_limit

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

   !> Of each bolt: largest axial force along it, force at its head, largest force of a dowel; and the stored energy.
   pure subroutine show_bolts(self, context, largest, head, dowel, stored)
      class(bars_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      real(wp), intent(out) :: largest(:), head(:), dowel(:)   !! (bolts)
      real(wp), intent(out) :: stored                          !! [energy]
      type(bar_response_type) :: response
      type(bolt_type) :: bolt
      real(wp) :: force
      logical :: shears
      integer :: c, l
      largest = 0
      head = 0
      dowel = 0
      stored = 0
      do l = 1, n_bolts(self)
         bolt = self%bolts(l)
         call measure_bolt(context%state%active, bolt)
         if (size(bolt%acting) == 0) cycle
         call respond(bolt%bar, bolt%state, bolt%start, response)
         associate (forces => node_forces(bolt%bar, response))
            largest(l) = forces(maxloc(abs(forces), 1))
            head(l) = forces(1)
         end associate
         do c = 1, size(bolt%crossing)
            if (.not. bolt%holds(c)) cycle
            call dowel_response(bolt, bolt%across(c) - bolt%dowel_slip(c), force, shears)
            if (abs(force) > abs(dowel(l))) dowel(l) = force
         end do
         stored = stored + energy_of(bolt, response)
      end do
   end subroutine show_bolts

   !> Links of all bolts.
   pure integer function count_links(self, context) result(n)
      class(bars_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      integer :: l
      associate (unused => context%dt)
      end associate
      n = 0
      do l = 1, n_bolts(self)
         n = n + links_of(self%bolts(l))
      end do
   end function count_links

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

   !> Places and blocks at the start of the step.
   subroutine prepare(self, context, equations)
      class(bars_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(equations_type), intent(inout) :: equations
      integer, allocatable :: points(:, :)
      integer :: a, b, c, k, l, m, pair(2)
      c = self%first_link
      do l = 1, n_bolts(self)
         associate (bolt => self%bolts(l))
            bolt%first_link = c
            call measure_bolt(context%state%active, bolt)
            points = link_points(bolt)
            do k = 1, size(points, 2)
               pair = 0
               if (points(1, k) > 0) pair = bolt%block(points(:, k))
               ! within a block: the strain of the block alone
               if (pair(1) == pair(2)) pair(2) = 0
               call equations%join(c + k, pair)
            end do
            c = c + size(points, 2)
            m = 0
            do a = 1, size(bolt%crossed)
               do b = a, size(bolt%crossed)
                  m = m + 1
                  pair = [bolt%crossed(a), merge(0, bolt%crossed(b), a == b)]
                  if (.not. (context%state%active(bolt%crossed(a)) .and. context%state%active(bolt%crossed(b)))) &
                     pair = 0
                  call equations%join_matrix(c + m, pair, bolt%matrix(m))
               end do
            end do
            c = c + m
         end associate
      end do
   end subroutine prepare

   !> Begin an attempt: linearise at the start of the step.
   subroutine begin(self, context)
      class(bars_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      integer :: changes, unsettled, l
      self%level = context%scheme%level
      do l = 1, n_bolts(self)
         self%bolts(l)%e = 0
         self%bolts(l)%shift = 0
         self%bolts(l)%sway = 0
      end do
      call self%judge(changes, unsettled)
      do l = 1, n_bolts(self)
         self%bolts(l)%tense = 0
         if (.not. context%scheme%is_dynamic) call find_tension(self%bolts(l))
      end do
   end subroutine begin

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

   !> Vectors of all links.
   subroutine place(self, context, equations)
      class(bars_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(equations_type), intent(inout) :: equations
      real(wp) :: n(2), a(6, 2), b(6, 2), v(6, 2, 2)
      real(wp), allocatable :: then(:, :)
      integer, allocatable :: points(:, :)
      integer :: k, l, n_axial, p, side
      do l = 1, n_bolts(self)
         associate (bolt => self%bolts(l))
            if (size(bolt%acting) == 0) cycle
            then = bolt%place
            do p = 1, size(bolt%block)
               if (bolt%block(p) > 0) then(:, p) = then(:, p) + &
                  mean_displacement(context%moving(bolt%block(p))%d, bolt%place(:, p), context%moving(bolt%block(p)))
            end do
            points = link_points(bolt)
            n_axial = axial_links(bolt)
            do k = 1, size(points, 2)
               if (points(1, k) == 0) cycle
               n = mean_direction(bolt, then, points(1, k), points(2, k))
               v = 0
               do side = 1, 2
                  associate (block => bolt%block(points(side, k)), x => bolt%place(:, points(side, k)))
                     if (block == 0) cycle
                     v(:, 1, side) = mean_load(merge(-n, n, side == 1), x, context%moving(block))
                     v(:, 2, side) = mean_load(merge(-1, 1, side == 1)*[-n(2), n(1)], x, &
                                                                context%moving(block))
                  end associate
               end do
               a = v(:, :, 1)
               b = v(:, :, 2)
               if (bolt%block(points(1, k)) == bolt%block(points(2, k))) then
                  a = a + b
                  b = 0
               end if
               call equations%set_vectors(bolt%first_link + k, a, b)
               if (k <= n_axial) then
                  associate (p => points(1, k), q => points(2, k))
                     ! the mean direction has turned by half of what is expected
                     bolt%turned(k) = 0.5_wp*dot_product([-n(2), n(1)], (then(:, q) - bolt%place(:, q)) - &
                                                         (then(:, p) - bolt%place(:, p)))
                  end associate
               end if
            end do
         end associate
      end do
   end subroutine place

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

   !> Stiffness and load of the links, by the tangent of the last round.
   subroutine add_to_links(self, equations)
      class(bars_type), intent(in) :: self
      type(equations_type), intent(inout) :: equations
      integer :: l
      do l = 1, n_bolts(self)
         call add_bolt(self%bolts(l), self%level, equations)
      end do
   end subroutine add_to_links

   !> Stiffness and load of the links of one bolt.
   subroutine add_bolt(bolt, level, equations)
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
   end subroutine add_bolt

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

   !> Elongations and displacements of joints.
   subroutine predict(self, equations)
      class(bars_type), intent(inout) :: self
      type(equations_type), intent(in) :: equations
      integer :: c, k, l
      do l = 1, n_bolts(self)
         associate (bolt => self%bolts(l))
            bolt%e = 0
            bolt%sway = 0
            do k = 1, size(bolt%acting) - 1
               bolt%e(k) = self%level*motion_along(bolt%first_link + k, 1)
               if (bolt%tense(k) > 0) bolt%sway(k) = motion_along(bolt%first_link + k, 2)
            end do
            bolt%shift = 0
            do c = 1, size(bolt%crossing)
               if (bolt%holds(c)) bolt%shift(c) = self%level*motion_along(bolt%first_link + axial_links(bolt) + c, 2)
            end do
         end associate
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

   end subroutine predict

   !> Keep the present motion.
   subroutine keep(self)
      class(bars_type), intent(inout) :: self
      integer :: l
      do l = 1, n_bolts(self)
         self%bolts(l)%kept_e = self%bolts(l)%e
         self%bolts(l)%kept_shift = self%bolts(l)%shift
         self%bolts(l)%kept_sway = self%bolts(l)%sway
      end do
   end subroutine keep

   !> A motion at a fraction of the way.
   subroutine shorten(self, fraction)
      class(bars_type), intent(inout) :: self
      real(wp), intent(in) :: fraction
      integer :: l
      do l = 1, n_bolts(self)
         associate (bolt => self%bolts(l))
            bolt%e = bolt%kept_e + fraction*(bolt%e - bolt%kept_e)
            bolt%shift = bolt%kept_shift + fraction*(bolt%shift - bolt%kept_shift)
            bolt%sway = bolt%kept_sway + fraction*(bolt%sway - bolt%kept_sway)
         end associate
      end do
   end subroutine shorten

   !> Forces by the laws at a fraction of the way.
   subroutine lawful_forces(self, fraction, force)
      class(bars_type), intent(in) :: self
      real(wp), intent(in) :: fraction
      real(wp), intent(inout), contiguous :: force(:, :)
      type(bar_response_type) :: response
      real(wp), allocatable :: of_points(:), chain(:)
      real(wp) :: of_dowel
      integer :: c, l, n
      logical :: shears
      do l = 1, n_bolts(self)
         associate (bolt => self%bolts(l))
            n = bolt%first_link
            force(:, n + 1:n + links_of(bolt)) = 0
            if (size(bolt%acting) == 0) cycle
            call respond(bolt%bar, bolt%state, points_with(bolt, bolt%kept_e + fraction*(bolt%e - bolt%kept_e)), &
               response)
            allocate (of_points(size(bolt%block)))
            call condense(bolt%bar, response, of_points)
            chain = chain_forces(bolt, of_points)
            deallocate (of_points)
            force(1, n + 1:n + size(chain)) = chain/bolt%spacing
            force(2, n + 1:n + size(chain)) = across_bolt(bolt, bolt%kept_sway + fraction*(bolt%sway - bolt%kept_sway))
            n = n + axial_links(bolt)
            do c = 1, size(bolt%crossing)
               if (.not. bolt%holds(c)) cycle
               call dowel_response(bolt, bolt%across(c) + bolt%kept_shift(c) + fraction* &
                                   (bolt%shift(c) - bolt%kept_shift(c)) - bolt%dowel_slip(c), of_dowel, shears)
               force(2, n + c) = of_dowel/bolt%spacing
            end do
         end associate
      end do
   end subroutine lawful_forces

   !> Forces across the links of neighbours that act, for their motion across the bolt.
   pure function across_bolt(bolt, sway) result(force)
      type(bolt_type), intent(in) :: bolt
      real(wp), intent(in) :: sway(:)          !! (neighbours) [length]
      real(wp) :: force(max(0, size(bolt%acting) - 1))
      force = bolt%tense(:size(force))*(sway(:size(force)) - bolt%turned(:size(force)))/bolt%spacing
   end function across_bolt

   !> Lengths that the expected motion gives otherwise than the solution.
   subroutine measure_placement(self, context, equations)
      class(bars_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(equations_type), intent(inout) :: equations
      type(bolt_type) :: moved
      real(wp), allocatable :: chain(:)
      real(wp) :: load, scale, off
      integer :: b, k, l, p
      do l = 1, n_bolts(self)
         if (size(self%bolts(l)%acting) < 2) cycle
         moved = self%bolts(l)
         associate (bolt => self%bolts(l), t => self%bolts(l)%tangent)
            do p = 1, size(bolt%block)
               b = bolt%block(p)
               if (b > 0) moved%place(:, p) = bolt%place(:, p) + end_displacement(context%moved(b), bolt%place(:, p))
            end do
            chain = chain_forces(bolt, t%force)
            do k = 1, size(bolt%acting) - 1
               associate (p => bolt%acting(k), q => bolt%acting(k + 1))
                  if (is_joint(bolt, p, q)) cycle
                  off = abs(t%stiffness(p, q)*(separation(bolt, moved%place, p, q) - separation(bolt, bolt%place, &
                     p, q) &
                                               - bolt%e(k)/self%level))
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
         end associate
      end do
   end subroutine measure_placement

   !> Linearise at the present motion; the last round holds where its forces follow the laws there.
   subroutine judge(self, n_changes, n_unsettled)
      class(bars_type), intent(inout) :: self
      integer, intent(out) :: n_changes, n_unsettled
      type(bar_response_type) :: response
      type(tangent_type) :: new
      real(wp), allocatable :: missing(:)
      real(wp) :: force
      logical :: shears
      integer :: c, l
      n_changes = 0
      do l = 1, n_bolts(self)
         associate (bolt => self%bolts(l))
            if (size(bolt%acting) == 0) cycle
            new%u = points_with(bolt, bolt%e)
            new%e = bolt%e
            if (.not. allocated(bolt%tangent%u)) then
               bolt%tangent%u = new%u
               bolt%tangent%e = new%e
               allocate (bolt%tangent%force(size(new%u)), bolt%tangent%stiffness(size(new%u), size(new%u)), &
                  source=0.0_wp)
            end if
            call respond(bolt%bar, bolt%state, new%u, response)
            new%force = new%u
            new%stiffness = bolt%tangent%stiffness
            call condense(bolt%bar, response, new%force, new%stiffness)
            missing = new%force - (bolt%tangent%force + matmul(bolt%tangent%stiffness, new%u - bolt%tangent%u))
            if (maxval(abs(missing)) > agreement*maxval(abs(new%force)) + &
                rounding*maxval(abs(new%stiffness))*maxval(abs(new%u))) n_changes = n_changes + 1
            bolt%tangent = new
            do c = 1, size(bolt%crossing)
               call dowel_response(bolt, bolt%across(c) + bolt%shift(c) - bolt%dowel_slip(c), force, shears)
               if (shears .neqv. bolt%shears(c)) n_changes = n_changes + 1
               bolt%shears(c) = shears
            end do
            deallocate (new%force, new%stiffness)
         end associate
      end do
      n_unsettled = n_changes
   end subroutine judge

   !> What a bolt does in a step.
   pure subroutine finish_bolt(bolt, level, new, work, slipped, yielded, stored, freed)
      type(bolt_type), intent(in) :: bolt
      real(wp), intent(in) :: level
      type(bolt_type), intent(out) :: new              !! with the state of the end of the step
      real(wp), intent(out) :: work                    !! of the forces that have acted
      real(wp), intent(out) :: slipped, yielded        !! work of slip and of yield
      real(wp), intent(out) :: stored(2)               !! energy at the start and the end
      real(wp), intent(out) :: freed                   !! before the latter, by what has broken
      type(bar_response_type) :: response
      type(bar_state_type) :: old
      real(wp) :: force(size(bolt%block)), dowel, before, more(2)
      logical :: changes, shears
      integer :: c
      new = bolt
      call respond(bolt%bar, bolt%state, bolt%start, response)
      stored(1) = energy_of(bolt, response)
      call respond(bolt%bar, bolt%state, points_with(bolt, bolt%e), response)
      call condense(bolt%bar, response, force)
      associate (chain => chain_forces(bolt, force))
         work = dot_product(chain, bolt%e(1:size(chain)))/level
      end associate
      new%start = points_with(bolt, bolt%e/level)
      new%across = bolt%across + bolt%shift/level
      call respond(bolt%bar, bolt%state, new%start, response)
      call accept(bolt%bar, response, new%state, slipped, yielded)
      do c = 1, size(bolt%crossing)
         if (.not. bolt%holds(c)) cycle
         call dowel_response(bolt, bolt%across(c) + bolt%shift(c) - bolt%dowel_slip(c), dowel, shears)
         work = work + dowel*bolt%shift(c)/level
         call dowel_response(bolt, new%across(c) - bolt%dowel_slip(c), dowel, shears)
         if (.not. shears) cycle
         new%dowel_slip(c) = new%across(c) - dowel/bolt%dowel_stiffness
         yielded = yielded + dowel*(new%dowel_slip(c) - bolt%dowel_slip(c))
      end do
      work = work/bolt%spacing
      freed = 0
      stored(2) = energy_of(new, response)
      changes = .not. same_state(bolt%state, new%state)
      do
         ! what has broken or weakened lets the rest of the bolt move at once
         call respond(bolt%bar, new%state, new%start, response)
         before = stored(2)
         stored(2) = energy_of(new, response)
         if (.not. changes) exit
         old = new%state
         call accept(bolt%bar, response, new%state, more(1), more(2))
         slipped = slipped + more(1)
         yielded = yielded + more(2)
         freed = freed + (before - stored(2)) - sum(more)/bolt%spacing
         changes = .not. same_state(old, new%state)
      end do
      slipped = slipped/bolt%spacing
      yielded = yielded/bolt%spacing

   contains

      !> Is nothing more broken or weakened?
      pure logical function same_state(a, b)
         type(bar_state_type), intent(in) :: a, b
         same_state = all(a%broken .eqv. b%broken) .and. all(a%weak .eqv. b%weak)
      end function same_state

   end subroutine finish_bolt

   !> Stored energy, and the work of slip, of yield and of breaking.
   subroutine add_energies(self, context, d, balance)
      class(bars_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      real(wp), intent(in), contiguous :: d(:, :)
      class(energy_balance_type), intent(inout) :: balance
      type(bolt_type) :: new
      real(wp) :: work, slipped, yielded, stored(2), freed, start, end
      integer :: l
      associate (unused => context%dt, not_used => d)
      end associate
      start = 0
      end = 0
      do l = 1, n_bolts(self)
         if (size(self%bolts(l)%acting) == 0) cycle
         call finish_bolt(self%bolts(l), self%level, new, work, slipped, yielded, stored, freed)
         call balance%add(energy%friction, slipped)
         work = work + dot_product(across_bolt(self%bolts(l), self%bolts(l)%sway), &
                                   self%bolts(l)%sway(:size(self%bolts(l)%acting) - 1))
         call balance%add(energy%dissipated, work - (stored(2) - stored(1)) - slipped - freed)
         call balance%add(energy%discarded, freed)
         start = start + stored(1)
         end = end + stored(2)
      end do
      if (n_bolts(self) == 0) return
      call balance%add(energy%geometry, start - balance%bar_energy)
      balance%bar_energy = end
   end subroutine add_energies

   !> States at the end of the step, and new places.
   subroutine commit(self, context, d)
      class(bars_type), intent(inout) :: self
      type(step_context_type), intent(inout) :: context
      real(wp), intent(in), contiguous :: d(:, :)
      type(bolt_type) :: new
      real(wp) :: work, slipped, yielded, stored(2), freed
      integer :: b, l, p
      do l = 1, n_bolts(self)
         if (size(self%bolts(l)%acting) > 0) then
            call finish_bolt(self%bolts(l), self%level, new, work, slipped, yielded, stored, freed)
            self%bolts(l)%state = new%state
            self%bolts(l)%dowel_slip = new%dowel_slip
            self%work = self%work + [slipped, yielded, freed]
         end if
         if (.not. self%bolts(l)%is_there) cycle
         associate (bolt => self%bolts(l))
            do p = 1, size(bolt%block)
               b = bolt%block(p)
               if (b > 0) call move_point(d(:, b), context%state%centroid(:, b), context%parameters%exact_rotation, &
                                          bolt%place(:, p))
            end do
         end associate
      end do
   end subroutine commit

   !> Forces on the blocks at their new places.
   subroutine add_forces(self, context, forces)
      class(bars_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(block_forces_type), intent(inout) :: forces
      type(bar_response_type) :: response
      type(bolt_type) :: bolt
      real(wp), allocatable :: on_bar(:), chain(:)
      real(wp) :: dowel, n(2)
      logical :: shears
      integer :: c, k, l
      do l = 1, n_bolts(self)
         bolt = self%bolts(l)
         call measure_bolt(context%state%active, bolt)
         if (size(bolt%acting) == 0) cycle
         call respond(bolt%bar, bolt%state, bolt%start, response)
         on_bar = bolt%start
         call condense(bolt%bar, response, on_bar)
         chain = chain_forces(bolt, on_bar)
         do k = 1, size(chain)
            n = direction(bolt, bolt%place, bolt%acting(k), bolt%acting(k + 1))
            call add(bolt%acting(k), chain(k)*n)
            call add(bolt%acting(k + 1), -chain(k)*n)
         end do
         do c = 1, size(bolt%crossing)
            if (.not. bolt%holds(c)) cycle
            call dowel_response(bolt, bolt%across(c) - bolt%dowel_slip(c), dowel, shears)
            n = direction(bolt, bolt%place, bolt%crossing(c), bolt%crossing(c) + 1)
            call add(bolt%crossing(c), dowel*[-n(2), n(1)])
            call add(bolt%crossing(c) + 1, -dowel*[-n(2), n(1)])
         end do
      end do

   contains

      !> A force on the block of a point.
      subroutine add(p, force)
         integer, intent(in) :: p
         real(wp), intent(in) :: force(2)
         if (bolt%block(p) == 0) return
         call forces%add_force(bolt%block(p), force/bolt%spacing, bolt%place(:, p) - &
                               context%state%centroid(:, bolt%block(p)))
      end subroutine add

   end subroutine add_forces

   !> Save or load what lasts of all bolts.
   subroutine exchange_state(self, archive)
      class(bars_type), intent(inout) :: self
      class(state_archive_type), intent(inout) :: archive
      real(wp), allocatable :: numbers(:), work(:)
      integer :: l, n
      call archive%section('bars')
      work = self%work
      if (archive%saving) call pack_all(self%bolts, numbers)
      call archive%item('numbers', numbers)
      call archive%item('work', work)
      if (archive%saving .or. .not. (allocated(numbers) .and. allocated(work))) return
      n = 0
      do l = 1, n_bolts(self)
         n = n + n_numbers(self%bolts(l))
      end do
      if (size(numbers) /= n .or. size(work) /= 3) then
         self%work = -1
         return
      end if
      self%work = work
      n = 0
      do l = 1, n_bolts(self)
         call unpack_bolt(numbers(n + 1:n + n_numbers(self%bolts(l))), self%bolts(l))
         n = n + n_numbers(self%bolts(l))
      end do
   end subroutine exchange_state

   !> Numbers of what lasts of a bolt.
   pure integer function n_numbers(bolt)
      type(bolt_type), intent(in) :: bolt
      n_numbers = 1 + bolt%bar%n + 2*(bolt%bar%n - 1) + 2*size(bolt%bar%node) + 4*size(bolt%block) + &
         size(bolt%crossing)
   end function n_numbers

   !> What lasts of all bolts.
   pure subroutine pack_all(bolts, numbers)
      type(bolt_type), intent(in) :: bolts(:)
      real(wp), allocatable, intent(out) :: numbers(:)
      integer :: l
      allocate (numbers(0))
      do l = 1, size(bolts)
         associate (b => bolts(l))
            numbers = [numbers, as_number(b%is_there), b%state%w, b%state%plastic, as_number(b%state%broken), &
                       b%state%slip, as_number(b%state%weak), reshape(b%place, [2*size(b%block)]), &
                          reshape(b%origin, [2*size(b%block)]), &
                          b%dowel_slip]
         end associate
      end do
   end subroutine pack_all

   !> 1 for true.
   elemental real(wp) function as_number(flag)
      logical, intent(in) :: flag
      as_number = merge(1.0_wp, 0.0_wp, flag)
   end function as_number

   !> What lasts of one bolt, from its numbers.
   pure subroutine unpack_bolt(numbers, bolt)
      real(wp), intent(in) :: numbers(:)
      type(bolt_type), intent(inout) :: bolt
      integer :: at
      at = 1
      bolt%is_there = numbers(1) > 0.5_wp
      call take(numbers, at, bolt%state%w)
      call take(numbers, at, bolt%state%plastic)
      bolt%state%broken = numbers(at + 1:at + bolt%bar%n - 1) > 0.5_wp
      at = at + bolt%bar%n - 1
      call take(numbers, at, bolt%state%slip)
      bolt%state%weak = numbers(at + 1:at + size(bolt%bar%node)) > 0.5_wp
      at = at + size(bolt%bar%node)
      bolt%place = reshape(numbers(at + 1:at + 2*size(bolt%block)), [2, size(bolt%block)])
      at = at + 2*size(bolt%block)
      bolt%origin = reshape(numbers(at + 1:at + 2*size(bolt%block)), [2, size(bolt%block)])
      at = at + 2*size(bolt%block)
      call take(numbers, at, bolt%dowel_slip)
   end subroutine unpack_bolt

   !> The next numbers.
   pure subroutine take(numbers, at, values)
      real(wp), intent(in) :: numbers(:)
      integer, intent(inout) :: at
      real(wp), intent(inout) :: values(:)
      values = numbers(at + 1:at + size(values))
      at = at + size(values)
   end subroutine take

   !> Check what was loaded.
   subroutine check_state(self, context, check)
      class(bars_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(value_check_type), intent(inout) :: check
      integer :: l
      associate (unused => context%dt)
      end associate
      check%group = 'bars'
      call check%holds(all(self%work >= 0), 'work')
      do l = 1, n_bolts(self)
         associate (b => self%bolts(l))
            call check%is_finite([b%state%w, b%state%plastic, b%state%slip, b%dowel_slip], 'numbers')
            call check%holds(all(abs(b%place) <= largest_coordinate) .and. &
                             all(abs(b%origin) <= largest_coordinate), 'numbers')
         end associate
      end do
   end subroutine check_state

end module rockdda_interaction_bars
