! SPDX-License-Identifier: MIT
!> The steel of a bolt and the ties that hold it in the rock, along one line; nothing here refers to blocks.
!>
!> Nodes 1 to n lie along the bar, from the head to the toe; element e joins the nodes e and e + 1. A tie holds a node
!> to the rock: grout that slips at its strength, or a plate or an anchor. The rock is given by points along the bar,
!> two for each part of it that moves as one; a tie lies between the points p and p + 1. With the displacements u of the
!> points along the bar, w of the nodes:
!>
!>     element     f = k (w(e+1) - w(e) - plastic),   |f| <= yield force; without grout 0 <= f: it goes slack
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
      copy_state, tension, stored_energy, node_forces, largest_share

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
      real(wp) :: pushed = 1                  !! share of `yield` that bears compression; 0: none, it goes slack
      real(wp) :: residual = 1                !! share of the strength of ties after slip
      integer, allocatable :: node(:)         !! (ties)
      integer, allocatable :: element(:)      !! (ties) whose half beside the node the grout surrounds; 0: none
      integer, allocatable :: point(:)        !! (ties) first of the two points of the rock
      real(wp), allocatable :: share(:)       !! (ties) 0 at the first one, 1 at the second one
      real(wp), allocatable :: grout(:)       !! (ties) stiffness [force/length]
      real(wp), allocatable :: strength(:)    !! (ties) force
      real(wp) :: stiffest(2) = 0             !! of elements; of elements and ties [force/length]
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

   !> Equilibrium for given displacements of the rock. A variable that is used again keeps its arrays.
   type :: bar_response_type
      real(wp), allocatable :: at(:)          !! (ties) displacement of the rock [length]
      real(wp), allocatable :: w(:)           !! (n) [length]
      integer, allocatable :: holder(:)       !! (n) tie that holds the node without giving way, 0: none
      real(wp), allocatable :: f(:)           !! (n - 1) forces of elements, tension positive
      real(wp), allocatable :: t(:)           !! (ties) forces of ties on the bar, towards the toe
      real(wp), allocatable :: f_tangent(:), t_tangent(:)
      integer, allocatable :: f_limit(:), t_limit(:)   !! 0 elastic, +1 or -1 at that limit
      ! of the state: stiffness (n - 1) and (ties), strength (ties)
      real(wp), allocatable, private :: of_steel(:), of_tie(:), strength(:)
      real(wp), allocatable, private :: missing(:), step(:), last(:)   !! (n) of the search
      logical, private :: has_pivots = .false.                         !! of the present tangents
      real(wp), allocatable, private :: pivot(:), ratio(:)             !! (n), (n - 1) of the elimination
      real(wp), allocatable, private :: moved(:), tie(:)               !! (ties) of the condensation
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
      if (.not. form%grouted) bar%pushed = 0
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
      if (size(from) > 0) then
         if (.not. form%grouted) then
            call hold(bar, 1, 1, 0.0_wp, huge(1.0_wp), 0)
            call hold(bar, bar%n, size(from), 0.0_wp, huge(1.0_wp), 0)
         else if (form%plate_strength > 0) then
            call hold(bar, 1, 1, merge(0.0_wp, rigid*maxval(bar%steel), form%plate_strength > unlimited), &
                      form%plate_strength, 0)
         end if
      end if
      bar%stiffest = [maxval(bar%steel), maxval([bar%steel, bar%grout])]

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

   !> Law of an element or a tie. What bears no compression has no stiffness there.
   elemental subroutine law(stiffness, limit, pushed, stretch, force, tangent, at_limit)
      real(wp), intent(in) :: stiffness    !! [force/length]
      real(wp), intent(in) :: limit        !! force
      real(wp), intent(in) :: pushed       !! share of it in compression, 1 or 0
      real(wp), intent(in) :: stretch      !! elastic, if the limit were not [length]
      real(wp), intent(out) :: force, tangent
      integer, intent(out) :: at_limit     !! +1, -1, or 0: elastic
      force = stiffness*stretch
      tangent = stiffness
      at_limit = 0
      if (force < 0 .and. .not. pushed > 0) then
         at_limit = -1
         force = 0
         tangent = 0
         return
      end if
      if (.not. abs(force) > limit) return
      at_limit = merge(1, -1, force > 0)
      force = at_limit*limit + hardening*(force - at_limit*limit)
      tangent = hardening*stiffness
   end subroutine law

   !> Equilibrium of the nodes for displacements u of the rock.
   pure subroutine respond(bar, state, u, response, pull, near)
      type(bar_type), intent(in) :: bar
      type(bar_state_type), intent(in) :: state
      real(wp), intent(in), contiguous :: u(:)       !! (points) along the bar [length]
      type(bar_response_type), intent(inout) :: response
      real(wp), intent(in), optional :: pull         !! force at the head, away from the toe
      logical, intent(in), optional :: near          !! begin where `response` is: one of the same state
      real(wp) :: load, g, g_start, low, high, a
      integer :: i, k
      logical :: changed, is_near
      load = 0
      if (present(pull)) load = pull
      is_near = .false.
      if (present(near)) is_near = near
      associate (r => response)
         if (is_near) then
            call extrapolate(bar, state, u, r)
         else
            call begin(bar, state, u, r)
         end if
         call measure(bar, state, load, r, changed)
         if (is_near .and. .not. changed) return
         do k = 1, most_steps
            r%step(:) = r%missing
            if (.not. r%has_pivots) call factorize(bar, r)
            call solve_nodes(r, r%step)
            g_start = product_of(r%missing, r%step)
            if (.not. g_start > 0) exit
            if (is_rounding(bar, r)) exit
            r%last(:) = r%w
            a = 1
            low = 0
            high = 1
            do i = 1, most_steps
               r%w(:) = r%last + a*r%step
               call measure(bar, state, load, r, changed)
               g = product_of(r%missing, r%step)
               if (g < -0.5_wp*g_start) then
                  high = a
               else if (g > 0.5_wp*g_start .and. a < 1) then
                  low = a
               else
                  exit
               end if
               a = 0.5_wp*(low + high)
            end do
            if (.not. (a < 1 .or. changed)) exit
         end do
      end associate
   end subroutine respond

   !> Begin at the nodes of a state.
   pure subroutine begin(bar, state, u, r)
      type(bar_type), intent(in) :: bar
      type(bar_state_type), intent(in) :: state
      real(wp), intent(in), contiguous :: u(:)       !! (points) along the bar [length]
      type(bar_response_type), intent(inout) :: r
      integer :: l
      call make_room(bar, r)
      r%has_pivots = .false.
      r%w(:) = state%w
      r%holder(:) = 0
      r%of_steel(:) = merge(0.0_wp, bar%steel, state%broken)
      call place_ties(size(bar%node), bar%point, bar%share, size(u), u, r%at)
      do l = 1, size(bar%node)
         r%of_tie(l) = merge(bar%grout(l), 0.0_wp, state%held(l))
         r%strength(l) = bar%strength(l)*merge(bar%residual, 1.0_wp, state%weak(l))
         if (.not. (state%held(l) .and. bar%strength(l) > unlimited)) cycle
         r%holder(bar%node(l)) = l
         r%w(bar%node(l)) = r%at(l) - state%slip(l)
      end do
   end subroutine begin

   !> Nodes by the tangents of a response of the same state: exact where nothing comes to another limit.
   pure subroutine extrapolate(bar, state, u, r)
      type(bar_type), intent(in) :: bar
      type(bar_state_type), intent(in) :: state
      real(wp), intent(in), contiguous :: u(:)       !! (points) along the bar [length]
      type(bar_response_type), intent(inout) :: r
      integer :: i
      if (.not. r%has_pivots) call factorize(bar, r)
      r%moved(:) = r%at
      call place_ties(size(bar%node), bar%point, bar%share, size(u), u, r%at)
      r%moved(:) = r%at - r%moved
      call load_nodes(bar%n, size(bar%node), bar%node, r%t_tangent, r%moved, r%holder, r%step)
      call solve_nodes(r, r%step)
      r%w(:) = r%w + r%step
      do i = 1, bar%n
         if (r%holder(i) > 0) r%w(i) = r%at(r%holder(i)) - state%slip(r%holder(i))
      end do
   end subroutine extrapolate

   !> Displacements of the rock at the ties.
   pure subroutine place_ties(m, point, share, n, u, at)
      integer, intent(in) :: m, n
      integer, intent(in) :: point(m)
      real(wp), intent(in) :: share(m), u(n)
      real(wp), intent(out) :: at(m)
      integer :: l
      do l = 1, m
         at(l) = (1 - share(l))*u(point(l)) + share(l)*u(point(l) + 1)
      end do
   end subroutine place_ties

   !> Forces on the nodes by the motion of the rock at the ties; where a tie holds a node, its motion.
   pure subroutine load_nodes(n, m, node, tangent, moved, holder, x)
      integer, intent(in) :: n, m
      integer, intent(in) :: node(m), holder(n)
      real(wp), intent(in) :: tangent(m), moved(m)
      real(wp), intent(out) :: x(n)
      integer :: i, l
      x = 0
      do l = 1, m
         x(node(l)) = x(node(l)) + tangent(l)*moved(l)
      end do
      do i = 1, n
         if (holder(i) > 0) x(i) = moved(holder(i))
      end do
   end subroutine load_nodes

   !> Arrays for a bar.
   pure subroutine make_room(bar, response)
      type(bar_type), intent(in) :: bar
      type(bar_response_type), intent(inout) :: response
      type(bar_response_type) :: new
      associate (n => bar%n, m => size(bar%node))
         if (allocated(response%w)) then
            if (size(response%w) == n .and. size(response%t) == m) return
         end if
         allocate (new%w(n), new%missing(n), new%step(n), new%last(n), new%pivot(n), new%ratio(n - 1), new%f(n - 1), &
                   new%f_tangent(n - 1), new%of_steel(n - 1), new%at(m), new%t(m), new%t_tangent(m), new%of_tie(m), &
                   new%strength(m), new%moved(m), new%tie(m), source=0.0_wp)
         allocate (new%holder(n), new%f_limit(n - 1), new%t_limit(m), source=0)
      end associate
      response = new
   end subroutine make_room

   !> a . b, in one order.
   pure real(wp) function product_of(a, b)
      real(wp), intent(in), contiguous :: a(:), b(:)
      integer :: i
      product_of = 0
      do i = 1, size(a)
         product_of = product_of + a(i)*b(i)
      end do
   end function product_of

   !> Is what the nodes lack no more than the rounding of forces and displacements?
   pure logical function is_rounding(bar, r)
      type(bar_type), intent(in) :: bar
      type(bar_response_type), intent(in) :: r
      real(wp), parameter :: share = 16*epsilon(1.0_wp)
      is_rounding = largest(r%missing) <= share*(largest(r%f) + largest(r%t) + bar%stiffest(2)*largest(r%w))

   contains

      !> Largest magnitude.
      pure real(wp) function largest(v)
         real(wp), intent(in), contiguous :: v(:)
         integer :: i
         largest = 0
         do i = 1, size(v)
            largest = max(largest, abs(v(i)))
         end do
      end function largest

   end function is_rounding

   !> Forces, and what the nodes lack to equilibrium: 0 where a tie holds the node.
   pure subroutine measure(bar, state, pull, r, changed)
      type(bar_type), intent(in) :: bar
      type(bar_state_type), intent(in) :: state
      real(wp), intent(in) :: pull          !! force at the head, away from the toe
      type(bar_response_type), intent(inout) :: r
      logical, intent(out) :: changed       !! something has come to another limit than it was at
      integer :: i
      changed = .false.
      call measure_elements(bar%n, r%of_steel, bar%yield, bar%pushed, state%plastic, r%w, r%f, r%f_tangent, r%f_limit, &
                            r%missing, changed)
      call measure_ties(bar%n, size(bar%node), bar%node, r%of_tie, r%strength, state%slip, r%at, r%w, r%t, &
                        r%t_tangent, r%t_limit, r%missing, changed)
      r%missing(1) = r%missing(1) - pull
      do i = 1, bar%n
         if (r%holder(i) == 0) cycle
         r%t(r%holder(i)) = -r%missing(i)
         r%missing(i) = 0
      end do
      if (changed) r%has_pivots = .false.
   end subroutine measure

   !> Forces of elements, and their sum at the nodes.
   pure subroutine measure_elements(n, stiffness, yield, pushed, plastic, w, f, tangent, limit, missing, changed)
      integer, intent(in) :: n
      real(wp), intent(in) :: stiffness(n - 1), yield(n - 1), pushed, plastic(n - 1), w(n)
      real(wp), intent(inout) :: f(n - 1), tangent(n - 1)
      integer, intent(inout) :: limit(n - 1)
      real(wp), intent(out) :: missing(n)
      logical, intent(inout) :: changed
      integer :: e, at_limit
      real(wp) :: before
      before = 0
      do e = 1, n - 1
         call law(stiffness(e), yield(e), pushed, w(e + 1) - w(e) - plastic(e), f(e), tangent(e), at_limit)
         changed = changed .or. at_limit /= limit(e)
         limit(e) = at_limit
         missing(e) = f(e) - before
         before = f(e)
      end do
      missing(n) = -before
   end subroutine measure_elements

   !> Forces of ties, and their sum at the nodes.
   pure subroutine measure_ties(n, m, node, stiffness, strength, slip, at, w, t, tangent, limit, missing, changed)
      integer, intent(in) :: n, m
      integer, intent(in) :: node(m)
      real(wp), intent(in) :: stiffness(m), strength(m), slip(m), at(m), w(n)
      real(wp), intent(inout) :: t(m), tangent(m)
      integer, intent(inout) :: limit(m)
      real(wp), intent(inout) :: missing(n)
      logical, intent(inout) :: changed
      integer :: l, at_limit
      do l = 1, m
         call law(stiffness(l), strength(l), 1.0_wp, at(l) - w(node(l)) - slip(l), t(l), tangent(l), at_limit)
         changed = changed .or. at_limit /= limit(l)
         limit(l) = at_limit
         missing(node(l)) = missing(node(l)) + t(l)
      end do
   end subroutine measure_ties

   !> Elimination of the nodes one after the other, with the tangents of a response. A node that a tie holds has a pivot
   !> of 1 and no neighbours.
   pure subroutine factorize(bar, response)
      type(bar_type), intent(in) :: bar
      type(bar_response_type), intent(inout) :: response
      real(wp) :: least, off
      integer :: i, l
      response%has_pivots = .true.
      associate (d => response%pivot, k => response%f_tangent, holder => response%holder)
         d(1) = 0
         do i = 1, bar%n - 1
            d(i) = k(i) + d(i)
            d(i + 1) = k(i)
         end do
         do l = 1, size(bar%node)
            d(bar%node(l)) = d(bar%node(l)) + response%t_tangent(l)
         end do
         least = least_pivot*bar%stiffest(1)
         do i = 1, bar%n
            if (i > 1) then
               off = k(i - 1)
               if (holder(i - 1) > 0 .or. holder(i) > 0) off = 0
               response%ratio(i - 1) = off/d(i - 1)
               d(i) = d(i) - off**2/d(i - 1)
            end if
            if (holder(i) > 0) then
               d(i) = 1
            else if (.not. d(i) > least) then
               d(i) = bar%stiffest(1)
            end if
         end do
      end associate
   end subroutine factorize

   !> Displacements of the nodes by forces on them, with the pivots of a response.
   pure subroutine solve_nodes(response, x)
      type(bar_response_type), intent(in) :: response
      real(wp), intent(inout), contiguous :: x(:)    !! (n) forces, displacements where a tie holds the node; all those
      call solve_chain(size(x), response%f_tangent, response%holder, response%ratio, response%pivot, x)
   end subroutine solve_nodes

   !> Displacements of n nodes in a row.
   pure subroutine solve_chain(n, k, holder, ratio, pivot, x)
      integer, intent(in) :: n
      real(wp), intent(in) :: k(n - 1), ratio(n - 1), pivot(n)
      integer, intent(in) :: holder(n)
      real(wp), intent(inout) :: x(n)
      integer :: i
      do i = 1, n - 1
         if (holder(i) == 0 .and. holder(i + 1) == 0) cycle
         if (holder(i + 1) == 0) x(i + 1) = x(i + 1) + k(i)*x(i)
         if (holder(i) == 0) x(i) = x(i) + k(i)*x(i + 1)
      end do
      do i = 2, n
         x(i) = x(i) + ratio(i - 1)*x(i - 1)
      end do
      x(n) = x(n)/pivot(n)
      do i = n - 1, 1, -1
         if (holder(i) == 0 .and. holder(i + 1) == 0) then
            x(i) = (x(i) + k(i)*x(i + 1))/pivot(i)
         else
            x(i) = x(i)/pivot(i)
         end if
      end do
   end subroutine solve_chain

   !> Forces on the points of the rock and their derivatives, without the nodes. The force of a point is that which the
   !> rock gives the bar there; all are in equilibrium.
   pure subroutine condense(bar, response, force, stiffness, share)
      type(bar_type), intent(in) :: bar
      type(bar_response_type), intent(inout) :: response      !! the same afterwards
      real(wp), intent(out), contiguous :: force(:)           !! (points)
      real(wp), intent(out), contiguous, optional :: stiffness(:, :)   !! (points, points)
      real(wp), intent(out), contiguous, optional :: share(:)   !! (points) see largest_share [1/length]
      integer :: e, i, l, q
      call on_points(bar, response%t, force)
      if (.not. present(stiffness)) return
      if (.not. response%has_pivots) call factorize(bar, response)
      associate (r => response, x => response%step, moved => response%moved, t => response%tie)
         do q = 1, bar%n_points
            ! displacement of the rock at the ties
            do l = 1, size(bar%node)
               moved(l) = 0
               if (bar%point(l) == q) moved(l) = 1 - bar%share(l)
               if (bar%point(l) + 1 == q) moved(l) = bar%share(l)
            end do
            call load_nodes(bar%n, size(bar%node), bar%node, r%t_tangent, moved, r%holder, x)
            if (any(abs(x) > 0)) call solve_nodes(r, x)
            r%missing(:) = 0
            if (present(share)) share(q) = 0
            do e = 1, bar%n - 1
               if (present(share)) share(q) = max(share(q), abs(r%f_tangent(e)*(x(e + 1) - x(e)))/bar%yield(e))
               associate (f => r%f_tangent(e)*(x(e + 1) - x(e)))
                  r%missing(e) = r%missing(e) + f
                  r%missing(e + 1) = -f
               end associate
            end do
            do l = 1, size(bar%node)
               t(l) = r%t_tangent(l)*(moved(l) - x(bar%node(l)))
               r%missing(bar%node(l)) = r%missing(bar%node(l)) + t(l)
               if (present(share)) share(q) = max(share(q), abs(t(l))/r%strength(l))
            end do
            do i = 1, bar%n
               if (r%holder(i) > 0) t(r%holder(i)) = -r%missing(i)
            end do
            call on_points(bar, t, stiffness(:, q))
         end do
      end associate
      stiffness = 0.5_wp*(stiffness + transpose(stiffness))
   end subroutine condense

   !> Sum of the forces of ties on the points.
   pure subroutine on_points(bar, t, force)
      type(bar_type), intent(in) :: bar
      real(wp), intent(in), contiguous :: t(:)
      real(wp), intent(out), contiguous :: force(:)   !! (points)
      call sum_at_points(size(bar%node), bar%point, bar%share, t, size(force), force)
   end subroutine on_points

   !> Sum of the forces of m ties on n points.
   pure subroutine sum_at_points(m, point, share, t, n, force)
      integer, intent(in) :: m, n
      integer, intent(in) :: point(m)
      real(wp), intent(in) :: share(m), t(m)
      real(wp), intent(out) :: force(n)
      integer :: l
      force = 0
      do l = 1, m
         associate (p => point(l))
            force(p) = force(p) + t(l)*(1 - share(l))
            force(p + 1) = force(p + 1) + t(l)*share(l)
         end associate
      end do
   end subroutine sum_at_points

   !> The largest share of its strength that an element or a tie carries, or lacks of it where it may go slack. By
   !> `share` of condense it grows at most with the motion of a point.
   pure real(wp) function largest_share(bar, response) result(share)
      type(bar_type), intent(in) :: bar
      type(bar_response_type), intent(in) :: response
      integer :: e, l
      share = 0
      do e = 1, bar%n - 1
         share = max(share, abs(response%f(e))/bar%yield(e))
         if (.not. bar%pushed > 0) share = max(share, 1 - response%f(e)/bar%yield(e))
      end do
      do l = 1, size(bar%node)
         if (response%holder(bar%node(l)) /= l) share = max(share, abs(response%t(l))/response%strength(l))
      end do
   end function largest_share

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
      real(wp) :: new
      integer :: e, l
      slipped = 0
      yielded = 0
      associate (r => response)
         do e = 1, bar%n - 1
            if (r%f_limit(e) == 0 .or. r%f_limit(e) < 0 .and. .not. bar%pushed > 0) cycle
            new = r%w(e + 1) - r%w(e) - r%f(e)/bar%steel(e)
            yielded = yielded + r%f(e)*(new - state%plastic(e))
            state%plastic(e) = new
         end do
         do l = 1, size(bar%node)
            if (r%t_limit(l) == 0) cycle
            new = r%at(l) - r%w(bar%node(l)) - r%t(l)/bar%grout(l)
            slipped = slipped + r%t(l)*(new - state%slip(l))
            state%slip(l) = new
            state%weak(l) = state%weak(l) .or. (bar%element(l) > 0 .and. bar%residual < 1)
         end do
         state%w(:) = r%w
         state%broken(:) = state%broken .or. state%plastic > bar%ultimate
      end associate
   end subroutine accept

   !> Copy a state; a variable that is used again keeps its arrays.
   pure subroutine copy_state(from, to)
      type(bar_state_type), intent(in) :: from
      type(bar_state_type), intent(inout) :: to
      if (.not. allocated(to%w)) then
         to = from
         return
      end if
      to%w(:) = from%w
      to%plastic(:) = from%plastic
      to%broken(:) = from%broken
      to%slip(:) = from%slip
      to%weak(:) = from%weak
      to%held(:) = from%held
   end subroutine copy_state

end module rockdda_interaction_bar
