! SPDX-License-Identifier: MIT
!> The steel of a bolt and the ties that hold it in the rock, along one line; nothing here knows of blocks.
!>
!> Nodes 1 to n lie along the bar, from the head to the toe; element e joins the nodes e and e + 1. A tie holds a node
!> to the rock: grout that slips at its strength, or a plate or an anchor. The rock is given by points along the bar,
!> two for each part of it that moves as one; a tie lies between the points p and p + 1. With the displacements u of the
!> points along the bar, w of the nodes:
!>
!>     element     f = k (w(e+1) - w(e) - plastic),   |f| <= yield force
!>     tie         t = k (u - w - slip),              |t| <= strength
!>     node        f(e) - f(e-1) + sum of t = 0
!>
!> All are elastic, perfectly plastic. Beyond a limit the share `hardening` of the stiffness remains, so that the nodes
!> have one place. The incremental energy is convex and its derivative piecewise linear: Newton's method with a search
!> along the line ends after finitely many steps, exactly.
!>
!> `condense` removes the nodes: stiffness and forces of the points alone. What breaks, and grout that has slipped to
!> its residual strength, changes with `accept` only, for the next step.
module rockdda_interaction_bar
   use rockdda_base_kinds, only : wp
   use rockdda_model_bolt_numbers, only : bolt_numbers_type
   implicit none
   private
   public :: bar_type, bar_state_type, bar_response_type, new_bar, respond, condense, accept, &
      tension, &
      stored_energy, node_forces

   !> Share of the stiffness beyond a limit.
   real(wp), parameter :: hardening = 1.0e-9_wp
   !> Grout begins at this share of an element from a joint.
   real(wp), parameter :: beside = 0.05_wp
   !> A plate of limited strength is stiffer than the stiffest element by this factor.
   real(wp), parameter :: rigid = 1.0e4_wp
   !> Ties of at least this strength hold their node without giving way at all.
   real(wp), parameter :: unlimited = 0.5_wp*huge(1.0_wp)
   !> A pivot below this share of the stiffness is that of a piece without ties.
   real(wp), parameter :: least_pivot = 1.0e-14_wp
   integer, parameter :: most_steps = 100

   !> What does not change.
   type :: bar_type
      integer :: n = 0                        !! nodes
      integer :: n_points = 0                 !! of the rock
      real(wp), allocatable :: place(:)       !! (n) distance from the head [length]
      real(wp), allocatable :: steel(:)       !! (n - 1) stiffness [force/length]
      real(wp), allocatable :: ultimate(:)    !! (n - 1) plastic elongation at which an element breaks [length]
      real(wp), allocatable :: yield(:)       !! (n - 1) force in the middle, when it is that of the bolt at an end
      real(wp) :: residual = 1                !! share of the strength of ties after slip
      integer, allocatable :: node(:)         !! (ties)
      integer, allocatable :: element(:)      !! (ties) whose half beside the node the grout surrounds; 0: none
      integer, allocatable :: point(:)        !! (ties) first of the two points of the rock
      real(wp), allocatable :: share(:)       !! (ties) 0 at the first one, 1 at the second one
      real(wp), allocatable :: grout(:)       !! (ties) stiffness [force/length]
      real(wp), allocatable :: strength(:)    !! (ties) force
   end type bar_type

   !> What lasts from step to step.
   type :: bar_state_type
      real(wp), allocatable :: w(:)           !! (n) displacements of nodes [length]
      real(wp), allocatable :: plastic(:)     !! (n - 1) yielded part of the elongation [length]
      logical, allocatable :: broken(:)       !! (n - 1)
      real(wp), allocatable :: slip(:)        !! (ties) [length]
      logical, allocatable :: weak(:)         !! (ties) has slipped to the residual strength
      logical, allocatable :: held(:)         !! (ties) the rock is there
   end type bar_state_type

   !> Equilibrium for given displacements of the rock.
   type :: bar_response_type
      real(wp), allocatable :: at(:)          !! (ties) displacement of the rock [length]
      real(wp), allocatable :: w(:)           !! (n) [length]
      integer, allocatable :: holder(:)       !! (n) tie that holds the node without giving way, 0: none
      real(wp), allocatable :: f(:)           !! (n - 1) forces of elements, tension positive
      real(wp), allocatable :: t(:)           !! (ties) forces of ties on the bar, towards the toe
      real(wp), allocatable :: f_tangent(:), t_tangent(:)
      integer, allocatable :: f_limit(:), t_limit(:)   !! 0 elastic, +1 or -1 at that limit
   end type bar_response_type

contains

   !> A bar in the rock, whose part j lies from `from(j)` to `to(j)`: points 2 j - 1 and 2 j.
   pure type(bar_type) function new_bar(form, from, to) result(bar)
      type(bolt_numbers_type), intent(in) :: form
      real(wp), intent(in) :: from(:), to(:)   !! distances from the head, ascending [length]
      real(wp), allocatable :: crossing(:)
      real(wp) :: near, x, step
      integer :: e, i, j, k, m
      near = 1.0e-9_wp*form%length
      allocate (crossing(0))
      bar%n_points = 2*size(from)
      bar%residual = form%grout_residual
      allocate (bar%place(2))
      bar%place = [0.0_wp, form%length]
      if (form%grouted) then
         do j = 1, size(from)
            call insert(bar%place, near, from(j))
            call insert(bar%place, near, to(j))
         end do
         call insert(bar%place, near, form%free(1))
         call insert(bar%place, near, form%free(2))
         ! grout on both sides of a joint must not hold one node: it would carry force past the steel
         do j = 1, size(from) - 1
            if (from(j + 1) - to(j) > near) cycle
            step = min(beside*form%element, 0.25_wp*(to(j) - from(j)), 0.25_wp*(to(j + 1) - from(j + 1)))
            if (.not. step > 2*near) cycle
            crossing = [crossing, to(j)]
            if (is_grouted(to(j) - step)) call insert(bar%place, near, to(j) - step)
            if (is_grouted(to(j) + step)) call insert(bar%place, near, to(j) + step)
         end do
         i = 1
         do while (i < size(bar%place))
            m = 1
            if (is_grouted(0.5_wp*(bar%place(i) + bar%place(i + 1)))) &
               m = max(1, ceiling((bar%place(i + 1) - bar%place(i))/form%element - 1.0e-6_wp))
            step = (bar%place(i + 1) - bar%place(i))/m
            x = bar%place(i)
            bar%place = [bar%place(:i), [(x + k*step, k=1, m - 1)], bar%place(i + 1:)]
            i = i + m
         end do
      end if
      bar%n = size(bar%place)
      bar%steel = form%axial/(bar%place(2:) - bar%place(:bar%n - 1))
      allocate (bar%yield(bar%n - 1), source=form%yield)
      bar%ultimate = bar%place(2:) - bar%place(:bar%n - 1)
      do e = 1, bar%n - 1
         ! beside a joint steel yields on as much as an element
         if (at_crossing(e) .and. e < bar%n - 1) bar%ultimate(e) = bar%place(e + 2) - bar%place(e)
         if (at_crossing(e + 1) .and. e > 1) bar%ultimate(e) = bar%place(e + 1) - bar%place(e - 1)
      end do
      bar%ultimate = min(form%rupture_strain*bar%ultimate, form%stroke)
      allocate (bar%node(0), bar%point(0), bar%share(0), bar%grout(0), bar%strength(0), bar%element(0))
      if (form%grouted) then
         do e = 1, bar%n - 1
            x = 0.5_wp*(bar%place(e) + bar%place(e + 1))
            if (.not. is_grouted(x)) cycle
            do j = 1, size(from)
               if (x < from(j) .or. x > to(j)) cycle
               step = 0.5_wp*(bar%place(e + 1) - bar%place(e))
               call hold(bar, merge(e + 1, e, at_crossing(e)), j, step*form%grout_stiffness, &
                         step*form%grout_strength, e)
               call hold(bar, merge(e, e + 1, at_crossing(e + 1)), j, step*form%grout_stiffness, &
                         step*form%grout_strength, e)
               ! where steel yields, grout slips
               if (.not. (at_crossing(e) .or. at_crossing(e + 1))) &
                  bar%yield(e) = max(0.5_wp*form%yield, form%yield - step*form%grout_strength*form%grout_residual)
               exit
            end do
         end do
      end if
      if (size(from) == 0) return
      if (.not. form%grouted) then
         call hold(bar, 1, 1, 0.0_wp, huge(1.0_wp), 0)
         call hold(bar, bar%n, size(from), 0.0_wp, huge(1.0_wp), 0)
      else if (form%plate_strength > 0) then
         call hold(bar, 1, 1, merge(0.0_wp, rigid*maxval(bar%steel), form%plate_strength > unlimited), &
                   form%plate_strength, 0)
      end if

   contains

      !> Is there grout around the bar?
      pure logical function is_grouted(s)
         real(wp), intent(in) :: s
         is_grouted = any(s > from .and. s < to) .and. .not. (s > form%free(1) .and. s < form%free(2))
      end function is_grouted

      !> Does a joint cross the bar at a node?
      pure logical function at_crossing(node)
         integer, intent(in) :: node
         at_crossing = any(abs(bar%place(node) - crossing) <= near)
      end function at_crossing

      !> One more tie.
      pure subroutine hold(bar, node, part, stiffness, strength, element)
         type(bar_type), intent(inout) :: bar
         integer, intent(in) :: node, part, element
         real(wp), intent(in) :: stiffness, strength
         real(wp) :: at
         at = 0
         if (to(part) - from(part) > near) at = min(1.0_wp, max(0.0_wp, (bar%place(node) - from(part))/ &
                                                                (to(part) - from(part))))
         bar%node = [bar%node, node]
         bar%element = [bar%element, element]
         bar%point = [bar%point, 2*part - 1]
         bar%share = [bar%share, at]
         bar%grout = [bar%grout, stiffness]
         bar%strength = [bar%strength, strength]
      end subroutine hold

   end function new_bar

   !> One more node.
   pure subroutine insert(place, near, s)
      real(wp), allocatable, intent(inout) :: place(:)
      real(wp), intent(in) :: near, s
      if (any(abs(place - s) <= near) .or. s < place(1) .or. s > place(size(place))) return
      place = [pack(place, place < s), s, pack(place, place > s)]
   end subroutine insert

   !> A bar free of stress.
   pure type(bar_state_type) function fresh_state(bar) result(state)
      type(bar_type), intent(in) :: bar
      allocate (state%w(bar%n), state%plastic(bar%n - 1), state%slip(size(bar%node)), source=0.0_wp)
      allocate (state%broken(bar%n - 1), state%weak(size(bar%node)), source=.false.)
      allocate (state%held(size(bar%node)), source=.true.)
   end function fresh_state

   !> The state in which a bar begins: tensioned to a force. A plate or an anchor at the head takes the force after the
   !> bar has been pulled there against the rock; without one the bar is stretched before the grout holds it.
   pure type(bar_state_type) function tension(bar, held, force) result(state)
      type(bar_type), intent(in) :: bar
      logical, intent(in) :: held(:)       !! (ties) the rock is there
      real(wp), intent(in) :: force
      type(bar_response_type) :: response
      integer :: head
      state = fresh_state(bar)
      state%held = held
      if (.not. abs(force) > 0) return
      head = findloc(bar%node == 1 .and. bar%element == 0, .true., 1)
      if (head == 0) then
         state%plastic = -force/bar%steel
         return
      end if
      state%held(head) = .false.
      call respond(bar, state, spread(0.0_wp, 1, bar%n_points), response, pull=force)
      state%w = response%w
      state%held = held
      ! u - w - slip = -force/stiffness: it pulls the head towards the outside
      state%slip(head) = -response%w(1)
      if (bar%grout(head) > 0) state%slip(head) = state%slip(head) + force/bar%grout(head)
   end function tension

   !> Law of an element or a tie.
   elemental subroutine law(stiffness, limit, stretch, force, tangent, at_limit)
      real(wp), intent(in) :: stiffness    !! [force/length]
      real(wp), intent(in) :: limit        !! force
      real(wp), intent(in) :: stretch      !! elastic, if the limit were not [length]
      real(wp), intent(out) :: force, tangent
      integer, intent(out) :: at_limit     !! +1, -1, or 0: elastic
      force = stiffness*stretch
      tangent = stiffness
      at_limit = 0
      if (.not. abs(force) > limit) return
      at_limit = merge(1, -1, force > 0)
      force = at_limit*limit + hardening*(force - at_limit*limit)
      tangent = hardening*stiffness
   end subroutine law

   !> Equilibrium of the nodes for displacements u of the rock.
   pure subroutine respond(bar, state, u, response, pull)
      type(bar_type), intent(in) :: bar
      type(bar_state_type), intent(in) :: state
      real(wp), intent(in) :: u(:)                   !! (points) along the bar [length]
      type(bar_response_type), intent(out) :: response
      real(wp), intent(in), optional :: pull         !! force at the head, away from the toe
      real(wp) :: missing(bar%n), step(bar%n), w(bar%n), load, g, g_start, low, high, a
      integer :: f_limit(bar%n - 1), t_limit(size(bar%node)), i, k, l
      load = 0
      if (present(pull)) load = pull
      response%at = (1 - bar%share)*u(bar%point) + bar%share*u(bar%point + 1)
      allocate (response%w, source=state%w)
      allocate (response%holder(bar%n), source=0)
      do l = 1, size(bar%node)
         if (.not. (state%held(l) .and. bar%strength(l) > unlimited)) cycle
         response%holder(bar%node(l)) = l
         response%w(bar%node(l)) = response%at(l) - state%slip(l)
      end do
      allocate (response%f(bar%n - 1), response%f_tangent(bar%n - 1), response%f_limit(bar%n - 1))
      allocate (response%t, response%t_tangent, source=response%at)
      allocate (response%t_limit(size(bar%node)))
      call measure(bar, state, load, response, missing)
      do k = 1, most_steps
         step = missing
         call solve_nodes(bar, response, step)
         g_start = dot_product(missing, step)
         if (.not. g_start > 0 .or. is_rounding(bar, response, missing)) exit
         w = response%w
         f_limit = response%f_limit
         t_limit = response%t_limit
         a = 1
         low = 0
         high = 1
         do i = 1, most_steps
            response%w = w + a*step
            call measure(bar, state, load, response, missing)
            g = dot_product(missing, step)
            if (g < -0.5_wp*g_start) then
               high = a
            else if (g > 0.5_wp*g_start .and. a < 1) then
               low = a
            else
               exit
            end if
            a = 0.5_wp*(low + high)
         end do
         if (.not. a < 1 .and. all(f_limit == response%f_limit) .and. all(t_limit == response%t_limit)) exit
      end do
   end subroutine respond

   !> Is what the nodes lack no more than the rounding of forces and displacements?
   pure logical function is_rounding(bar, r, missing)
      type(bar_type), intent(in) :: bar
      type(bar_response_type), intent(in) :: r
      real(wp), intent(in) :: missing(:)    !! (n)
      real(wp), parameter :: share = 16*epsilon(1.0_wp)
      is_rounding = maxval(abs(missing)) <= share*(maxval(abs(r%f)) + maxval([0.0_wp, abs(r%t)]) + &
                                                   maxval([bar%steel, bar%grout])*maxval(abs(r%w)))
   end function is_rounding

   !> Forces, and what the nodes lack to equilibrium.
   pure subroutine measure(bar, state, pull, r, missing)
      type(bar_type), intent(in) :: bar
      type(bar_state_type), intent(in) :: state
      real(wp), intent(in) :: pull          !! force at the head, away from the toe
      type(bar_response_type), intent(inout) :: r
      real(wp), intent(out) :: missing(:)   !! (n) 0 where a tie holds the node
      integer :: i
      call law(merge(0.0_wp, bar%steel, state%broken), bar%yield, r%w(2:) - r%w(:bar%n - 1) - state%plastic, r%f, &
               r%f_tangent, r%f_limit)
      call law(merge(bar%grout, 0.0_wp, state%held), bar%strength*merge(bar%residual, 1.0_wp, state%weak), &
               r%at - r%w(bar%node) - state%slip, r%t, r%t_tangent, r%t_limit)
      missing = on_nodes(bar, r%f, r%t)
      missing(1) = missing(1) - pull
      do i = 1, bar%n
         if (r%holder(i) == 0) cycle
         r%t(r%holder(i)) = -missing(i)
         missing(i) = 0
      end do
   end subroutine measure

   !> Sum of the forces of elements and ties on the nodes.
   pure function on_nodes(bar, f, t) result(force)
      type(bar_type), intent(in) :: bar
      real(wp), intent(in) :: f(:), t(:)
      real(wp) :: force(bar%n)
      integer :: l
      force = [f, 0.0_wp] - [0.0_wp, f]
      do l = 1, size(bar%node)
         force(bar%node(l)) = force(bar%node(l)) + t(l)
      end do
   end function on_nodes

   !> Displacements of the nodes by forces on them, with the tangents of a response.
   pure subroutine solve_nodes(bar, response, x)
      type(bar_type), intent(in) :: bar
      type(bar_response_type), intent(in) :: response
      real(wp), intent(inout) :: x(:)    !! (n) forces, displacements where a tie holds the node; displacements
      real(wp) :: d(bar%n), off(bar%n - 1), least
      integer :: i, l
      d = [response%f_tangent, 0.0_wp] + [0.0_wp, response%f_tangent]
      off = response%f_tangent
      do l = 1, size(bar%node)
         d(bar%node(l)) = d(bar%node(l)) + response%t_tangent(l)
      end do
      where (response%holder > 0) d = 1
      do i = 1, bar%n - 1
         associate (ends => response%holder(i:i + 1))
            if (all(ends == 0)) cycle
            if (ends(2) == 0) x(i + 1) = x(i + 1) + off(i)*x(i)
            if (ends(1) == 0) x(i) = x(i) + off(i)*x(i + 1)
            off(i) = 0
         end associate
      end do
      least = least_pivot*maxval(bar%steel)
      if (response%holder(1) == 0 .and. .not. d(1) > least) d(1) = maxval(bar%steel)
      do i = 2, bar%n
         d(i) = d(i) - off(i - 1)**2/d(i - 1)
         if (response%holder(i) == 0 .and. .not. d(i) > least) d(i) = maxval(bar%steel)
         x(i) = x(i) + off(i - 1)/d(i - 1)*x(i - 1)
      end do
      x(bar%n) = x(bar%n)/d(bar%n)
      do i = bar%n - 1, 1, -1
         x(i) = (x(i) + off(i)*x(i + 1))/d(i)
      end do
   end subroutine solve_nodes

   !> Forces on the points of the rock and their derivatives, without the nodes. The force of a point is that which the
   !> rock gives the bar there; all are in equilibrium.
   pure subroutine condense(bar, response, force, stiffness)
      type(bar_type), intent(in) :: bar
      type(bar_response_type), intent(in) :: response
      real(wp), intent(out) :: force(:)                       !! (points)
      real(wp), intent(out), optional :: stiffness(:, :)      !! (points, points)
      real(wp) :: x(bar%n), moved(size(bar%node)), t(size(bar%node)), missing(bar%n)
      integer :: i, q
      force = on_points(bar, response%t)
      if (.not. present(stiffness)) return
      do q = 1, bar%n_points
         ! displacement of the rock at the ties
         moved = merge(1 - bar%share, merge(bar%share, 0.0_wp, bar%point + 1 == q), bar%point == q)
         x = on_nodes(bar, spread(0.0_wp, 1, bar%n - 1), response%t_tangent*moved)
         do i = 1, bar%n
            if (response%holder(i) > 0) x(i) = moved(response%holder(i))
         end do
         if (any(abs(x) > 0)) call solve_nodes(bar, response, x)
         t = response%t_tangent*(moved - x(bar%node))
         missing = on_nodes(bar, response%f_tangent*(x(2:) - x(:bar%n - 1)), t)
         do i = 1, bar%n
            if (response%holder(i) > 0) t(response%holder(i)) = -missing(i)
         end do
         stiffness(:, q) = on_points(bar, t)
      end do
      stiffness = 0.5_wp*(stiffness + transpose(stiffness))
   end subroutine condense

   !> Sum of the forces of ties on the points.
   pure function on_points(bar, t) result(force)
      type(bar_type), intent(in) :: bar
      real(wp), intent(in) :: t(:)
      real(wp) :: force(bar%n_points)
      integer :: l
      force = 0
      do l = 1, size(bar%node)
         associate (p => bar%point(l))
            force(p:p + 1) = force(p:p + 1) + t(l)*[1 - bar%share(l), bar%share(l)]
         end associate
      end do
   end function on_points

   !> Axial force at the nodes, on their side of the toe; at the toe itself on the other one.
   pure function node_forces(bar, response) result(force)
      type(bar_type), intent(in) :: bar
      type(bar_response_type), intent(in) :: response
      real(wp) :: force(bar%n)
      integer :: l
      force = [response%f, response%f(bar%n - 1)]
      do l = 1, size(bar%node)
         associate (i => bar%node(l))
            if (bar%element(l) == i) force(i) = force(i) + response%t(l)
            if (i == bar%n .and. bar%element(l) > 0) force(i) = force(i) - response%t(l)
         end associate
      end do
   end function node_forces

   !> Elastic energy.
   pure real(wp) function stored_energy(bar, response) result(stored)
      type(bar_type), intent(in) :: bar
      type(bar_response_type), intent(in) :: response
      stored = 0.5_wp*(sum(response%f**2/bar%steel) + sum(response%t**2/bar%grout, bar%grout > 0))
   end function stored_energy

   !> The state at the end of a step, and the work of slip and of yielding in it. What breaks, or weakens, gives its
   !> energy with the next response.
   pure subroutine accept(bar, response, state, slipped, yielded)
      type(bar_type), intent(in) :: bar
      type(bar_response_type), intent(in) :: response
      type(bar_state_type), intent(inout) :: state
      real(wp), intent(out) :: slipped, yielded      !! [energy]
      real(wp) :: plastic(bar%n - 1), slip(size(bar%node))
      associate (r => response)
         plastic = merge(state%plastic, r%w(2:) - r%w(:bar%n - 1) - r%f/bar%steel, r%f_limit == 0)
         slip = state%slip
         where (r%t_limit /= 0) slip = r%at - r%w(bar%node) - r%t/bar%grout
         slipped = sum(r%t*(slip - state%slip))
         yielded = sum(r%f*(plastic - state%plastic))
         state%w = r%w
         state%plastic = plastic
         state%slip = slip
         state%broken = state%broken .or. plastic > bar%ultimate
         state%weak = state%weak .or. (bar%element > 0 .and. r%t_limit /= 0 .and. bar%residual < 1)
      end associate
   end subroutine accept

end module rockdda_interaction_bar
