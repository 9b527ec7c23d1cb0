! SPDX-License-Identifier: MIT
!> A field with values at points, linear in triangles, and its values along segments.
!>
!> Points on a regular grid (all pairs of some x and some y) make four triangles in each of its cells, with the mean of
!> the corners in the middle. Other points are joined by Delaunay's triangulation. Beyond the outline the field extends
!> as in the nearest triangle.
!>
!> For the triangulation points are added from left to right. A new point lies outside of the triangles so far; it makes
!> a triangle with each edge of their outline that it sees:
!>
!>        +---+
!>       /|   |\          then edges whose opposite corner lies within the circle of the triangle are exchanged
!>      / |   | * new     for the other diagonal, until there is none
!>     +--+---+/
!>
!> Four points on a circle have either diagonal.
module rockdda_geometry_triangle_field
   use rockdda_base_kinds, only : wp
   use rockdda_base_room, only : grow
   use rockdda_base_sorting, only : sorted_order
   use rockdda_geometry_grid, only : grid_type, grid_query_type
   use rockdda_geometry_segments, only : distance_to_segment, segment_point, side_of_line
   implicit none
   private
   public :: triangle_field_type, triangulate

   !> Sine of the angle below which three points are on a line, and rounding of the test of a circle.
   real(wp), parameter :: straight = 1.0e-12_wp, on_circle = 1.0e-12_wp

   !> Triangles under construction.
   type :: mesh_type
      real(wp), allocatable :: points(:, :)
      integer :: n = 0
      integer :: rightmost = 0                   !! point of the outline
      integer, allocatable :: corners(:, :)      !! (3, triangles) counter-clockwise
      integer, allocatable :: beyond(:, :)       !! (3, triangles) neighbour opposite each corner, 0: none
      integer, allocatable :: next(:), last(:)   !! outline, counter-clockwise
      integer, allocatable :: triangle(:)        !! of the outline's edge from a point to the next
      integer, allocatable :: waiting(:, :)      !! (2, :) edges to be tested: triangle, corner opposite
      integer :: n_waiting = 0
   end type mesh_type

   !> A segment along a side of a triangle is in it: share of the triangle's height.
   real(wp), parameter :: slack = 1.0e-12_wp

   type :: triangle_field_type
      real(wp), allocatable :: points(:, :)      !! (2, n)
      real(wp), allocatable :: values(:)         !! (n)
      integer, allocatable :: corners(:, :)      !! (3, triangles), counter-clockwise
      integer, allocatable :: outline(:, :)      !! (3, edges) two points and the triangle at them
      type(grid_type) :: grid                    !! of the triangles
   contains
      procedure :: init
      procedure :: along
      procedure :: is_inside
      procedure, private :: value_in
   end type triangle_field_type

contains

   !> Join the points by triangles; there are none when all points lie on a line or two are the same.
   subroutine init(self, points, values)
      class(triangle_field_type), intent(out) :: self
      real(wp), intent(in) :: points(:, :), values(:)
      real(wp), allocatable :: boxes(:, :)
      integer :: t
      call take_grid(points, values, self%points, self%values, self%corners)
      if (size(self%corners, 2) == 0) then
         self%points = points
         self%values = values
         call triangulate(points, self%corners)
      end if
      if (size(self%corners, 2) == 0) return
      allocate (boxes(4, size(self%corners, 2)))
      do t = 1, size(boxes, 2)
         associate (v => self%points(:, self%corners(:, t)))
            boxes(:, t) = [minval(v, dim=2), maxval(v, dim=2)]
         end associate
      end do
      call self%grid%build_boxes(boxes, 0.0_wp)
      call find_outline(self)
   end subroutine init

   !> Triangles of a regular grid; none when the points are not one.
   subroutine take_grid(given, given_values, points, values, corners)
      real(wp), intent(in) :: given(:, :), given_values(:)
      real(wp), allocatable, intent(out) :: points(:, :), values(:)
      integer, allocatable, intent(out) :: corners(:, :)
      real(wp), allocatable :: x(:), y(:)
      integer, allocatable :: at(:, :), column(:), row(:)
      integer :: n, nx, ny, i, j, c, k(4)
      n = size(given, 2)
      allocate (corners(3, 0))
      call distinct(given(1, :), x, column)
      call distinct(given(2, :), y, row)
      nx = size(x)
      ny = size(y)
      if (nx < 2 .or. ny < 2) return
      if (mod(n, nx) /= 0 .or. n/nx /= ny) return
      allocate (at(nx, ny), source=0)
      do i = 1, n
         if (at(column(i), row(i)) > 0) return
         at(column(i), row(i)) = i
      end do
      allocate (points(2, n + (nx - 1)*(ny - 1)), values(n + (nx - 1)*(ny - 1)))
      points(:, 1:n) = given
      values(1:n) = given_values
      deallocate (corners)
      allocate (corners(3, 4*(nx - 1)*(ny - 1)))
      c = 0
      do j = 1, ny - 1
         do i = 1, nx - 1
            k = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]
            c = c + 1
            points(:, n + c) = 0.5_wp*[x(i) + x(i + 1), y(j) + y(j + 1)]
            values(n + c) = 0.25_wp*sum(given_values(k))
            corners(:, 4*c - 3) = [k(1), k(2), n + c]
            corners(:, 4*c - 2) = [k(2), k(3), n + c]
            corners(:, 4*c - 1) = [k(3), k(4), n + c]
            corners(:, 4*c) = [k(4), k(1), n + c]
         end do
      end do
   end subroutine take_grid

   !> Distinct numbers among `all`, ascending, and which of them each is. Numbers within 1e-9 of their range are one.
   subroutine distinct(all, values, which)
      real(wp), intent(in) :: all(:)
      real(wp), allocatable, intent(out) :: values(:)
      integer, allocatable, intent(out) :: which(:)
      integer, allocatable :: order(:)
      real(wp) :: least
      integer :: i, n
      allocate (values(size(all)), which(size(all)))
      order = sorted_order(all)
      least = 1.0e-9_wp*(maxval(all) - minval(all))
      n = 0
      do i = 1, size(all)
         if (n == 0) then
            n = 1
            values(1) = all(order(1))
         else if (all(order(i)) - values(n) > least) then
            n = n + 1
            values(n) = all(order(i))
         end if
         which(order(i)) = n
      end do
      values = values(1:n)
   end subroutine distinct

   !> Edges that only one triangle has.
   subroutine find_outline(self)
      class(triangle_field_type), intent(inout) :: self
      integer, allocatable :: edges(:, :), order(:)
      logical, allocatable :: outer(:)
      integer :: t, k, n, i
      n = 3*size(self%corners, 2)
      allocate (edges(3, n), outer(n))
      do t = 1, n/3
         do k = 1, 3
            edges(:, 3*t - 3 + k) = [self%corners(k, t), self%corners(1 + modulo(k, 3), t), t]
         end do
      end do
      ! both sides of an edge become neighbours in the order of its lower and its higher point
      order = sorted_order(max(edges(1, :), edges(2, :)))
      order = order(sorted_order(min(edges(1, order), edges(2, order))))
      outer = .true.
      do i = 2, n
         associate (a => edges(1:2, order(i - 1)), b => edges(1:2, order(i)))
            if (a(1) /= b(2) .or. a(2) /= b(1)) cycle
            outer(order(i - 1:i)) = .false.
         end associate
      end do
      n = count(outer)
      allocate (self%outline(3, n))
      self%outline = reshape(pack(edges, spread(outer, 1, 3)), [3, n])
   end subroutine find_outline

   !> The field along the segment from p to q between the shares low and high of its length: pieces 1 to n, in each of
   !> which it is linear, by their ends s(:, i) and the values f(:, i) there.
   pure subroutine along(self, p, q, low, high, query, n, s, f)
      class(triangle_field_type), intent(in) :: self
      real(wp), intent(in) :: p(2), q(2)
      real(wp), intent(in) :: low, high
      type(grid_query_type), intent(inout) :: query        !! scratch
      integer, intent(out) :: n
      real(wp), allocatable, intent(inout) :: s(:, :), f(:, :)   !! (2, >= n)
      real(wp), allocatable :: inside(:, :), cuts(:)
      real(wp) :: a(2), b(2), middle
      integer, allocatable :: triangles(:)
      integer :: i, k, m, t
      a = segment_point(p, q, low)
      b = segment_point(p, q, high)
      call self%grid%query_segment(a, b, 0.0_wp, query)
      allocate (inside(2, query%n), triangles(query%n))
      m = 0
      do i = 1, query%n
         inside(:, m + 1) = clip(self%points(:, self%corners(:, query%ids(i))), p, q, low, high)
         if (.not. inside(2, m + 1) > inside(1, m + 1)) cycle
         m = m + 1
         triangles(m) = query%ids(i)
      end do
      cuts = [low, inside(1, 1:m), inside(2, 1:m), high]
      cuts = cuts(sorted_order(cuts))
      if (allocated(s)) then
         if (size(s, 2) < size(cuts)) deallocate (s, f)
      end if
      if (.not. allocated(s)) allocate (s(2, size(cuts)), f(2, size(cuts)))
      n = 0
      do i = 2, size(cuts)
         if (.not. cuts(i) > cuts(i - 1)) cycle
         middle = 0.5_wp*(cuts(i - 1) + cuts(i))
         t = 0
         do k = 1, m
            if (inside(1, k) <= middle .and. middle <= inside(2, k)) then
               t = triangles(k)
               exit
            end if
         end do
         if (t == 0) t = nearest_triangle(self, segment_point(p, q, middle))
         n = n + 1
         s(:, n) = cuts(i - 1:i)
         f(:, n) = [self%value_in(t, segment_point(p, q, cuts(i - 1))), self%value_in(t, segment_point(p, q, cuts(i)))]
      end do
   end subroutine along

   !> Shares of the segment from p to q between which it is in a triangle, within low and high.
   pure function clip(v, p, q, low, high) result(s)
      real(wp), intent(in) :: v(2, 3)          !! corners, counter-clockwise
      real(wp), intent(in) :: p(2), q(2), low, high
      real(wp) :: s(2)
      real(wp) :: area, a, b
      integer :: k
      s = [low, high]
      area = side_of_line(v(:, 1), v(:, 2), v(:, 3))
      do k = 1, 3
         ! barycentric coordinate at both ends
         a = side_of_line(v(:, k), v(:, 1 + modulo(k, 3)), p)/area
         b = side_of_line(v(:, k), v(:, 1 + modulo(k, 3)), q)/area
         if (abs(a) <= slack .and. abs(b) <= slack) cycle
         if (a < -slack .and. b < -slack) then
            s(2) = s(1)
         else if (b > a) then
            s(1) = max(s(1), -a/(b - a))
         else if (b < a) then
            s(2) = min(s(2), a/(a - b))
         end if
      end do
   end function clip

   !> Value of the linear function of a triangle.
   pure real(wp) function value_in(self, t, point)
      class(triangle_field_type), intent(in) :: self
      integer, intent(in) :: t
      real(wp), intent(in) :: point(2)
      real(wp) :: w(3)
      associate (v => self%points(:, self%corners(:, t)))
         w(1) = side_of_line(v(:, 2), v(:, 3), point)
         w(2) = side_of_line(v(:, 3), v(:, 1), point)
         w(3) = side_of_line(v(:, 1), v(:, 2), point)
      end associate
      value_in = dot_product(w, self%values(self%corners(:, t)))/sum(w)
   end function value_in

   !> Triangle at the edge of the outline that is nearest to a point.
   pure integer function nearest_triangle(self, point)
      class(triangle_field_type), intent(in) :: self
      real(wp), intent(in) :: point(2)
      real(wp) :: distance, least
      integer :: i
      least = huge(least)
      nearest_triangle = 1
      do i = 1, size(self%outline, 2)
         distance = distance_to_segment(point, self%points(:, self%outline(1, i)), self%points(:, self%outline(2, i)))
         if (distance >= least) cycle
         least = distance
         nearest_triangle = self%outline(3, i)
      end do
   end function nearest_triangle

   !> Is a point within the outline, or no further than a distance from it?
   pure logical function is_inside(self, point, distance)
      class(triangle_field_type), intent(in) :: self
      real(wp), intent(in) :: point(2), distance
      type(grid_query_type) :: query
      integer :: i
      is_inside = .true.
      call self%grid%query_point(point, query)
      do i = 1, query%n
         associate (v => self%points(:, self%corners(:, query%ids(i))))
            if (side_of_line(v(:, 1), v(:, 2), point) >= 0 .and. side_of_line(v(:, 2), v(:, 3), point) >= 0 .and. &
                side_of_line(v(:, 3), v(:, 1), point) >= 0) return
         end associate
      end do
      do i = 1, size(self%outline, 2)
         if (distance_to_segment(point, self%points(:, self%outline(1, i)), self%points(:, self%outline(2, i))) <= &
             distance) return
      end do
      is_inside = .false.
   end function is_inside

   !> Triangles of all points. None, when all points lie on a line or two are the same.
   subroutine triangulate(points, triangles)
      real(wp), intent(in) :: points(:, :)             !! (2, n)
      integer, allocatable, intent(out) :: triangles(:, :)   !! (3, m) corners, counter-clockwise
      type(mesh_type) :: mesh
      integer, allocatable :: order(:)
      integer :: n, i, first
      n = size(points, 2)
      allocate (triangles(3, 0))
      if (n < 3) return
      order = sorted_order(points(2, :))
      order = order(sorted_order(points(1, order)))
      mesh%points = points(:, order)
      do i = 2, n
         if (all(abs(mesh%points(:, i) - mesh%points(:, i - 1)) <= 0)) return
      end do
      allocate (mesh%corners(3, 2*n), mesh%beyond(3, 2*n), mesh%next(n), mesh%last(n), mesh%triangle(n), &
                mesh%waiting(2, 64))
      mesh%beyond = 0
      do first = 3, n
         if (abs(turn(mesh, 1, first - 1, first)) > 0) exit
      end do
      if (first > n) return
      call begin_with_fan(mesh, first)
      call exchange_diagonals(mesh)
      do i = first + 1, n
         call add_point(mesh, i)
         call exchange_diagonals(mesh)
      end do
      deallocate (triangles)
      allocate (triangles(3, mesh%n))
      do i = 1, mesh%n
         triangles(:, i) = order(mesh%corners(:, i))
      end do
   end subroutine triangulate

   !> Twice the area of a triangle, positive when it is counter-clockwise; 0 when its corners are on a line.
   pure real(wp) function turn(mesh, i, j, k)
      type(mesh_type), intent(in) :: mesh
      integer, intent(in) :: i, j, k
      associate (p => mesh%points(:, i), q => mesh%points(:, j), r => mesh%points(:, k))
         turn = side_of_line(p, q, r)
         if (abs(turn) <= straight*norm2(q - p)*norm2(r - p)) turn = 0
      end associate
   end function turn

   !> The first points, all on a line, and the first one beside it.
   subroutine begin_with_fan(mesh, first)
      type(mesh_type), intent(inout) :: mesh
      integer, intent(in) :: first        !! the point beside the line of those before it
      integer :: i
      logical :: left
      left = turn(mesh, 1, first - 1, first) > 0
      do i = 1, first - 2
         if (left) call add_triangle(mesh, [i, i + 1, first])
         if (.not. left) call add_triangle(mesh, [i + 1, i, first])
         if (i == 1) cycle
         call wait(mesh, mesh%n, merge(2, 1, left))
         ! corner opposite the edge to the former triangle: the far end on the line
         mesh%beyond(merge(2, 1, left), mesh%n) = mesh%n - 1
         mesh%beyond(merge(1, 2, left), mesh%n - 1) = mesh%n
      end do
      do i = 1, first
         if (left) then
            mesh%next(i) = merge(1, i + 1, i == first)
            mesh%triangle(i) = min(i, first - 2)
         else
            mesh%next(i) = merge(first, i - 1, i == 1)
            mesh%triangle(i) = max(i - 1, 1)
         end if
      end do
      if (left) mesh%triangle(first) = 1
      if (.not. left) mesh%triangle(first) = first - 2
      if (.not. left) mesh%next(first) = first - 1
      do i = 1, first
         mesh%last(mesh%next(i)) = i
      end do
      mesh%rightmost = first
   end subroutine begin_with_fan

   !> One more triangle.
   subroutine add_triangle(mesh, corners)
      type(mesh_type), intent(inout) :: mesh
      integer, intent(in) :: corners(3)
      mesh%n = mesh%n + 1
      mesh%corners(:, mesh%n) = corners
      mesh%beyond(:, mesh%n) = 0
   end subroutine add_triangle

   !> Triangles of a point with the edges of the outline that it sees, beginning at the rightmost point of the outline.
   subroutine add_point(mesh, i)
      type(mesh_type), intent(inout) :: mesh
      integer, intent(in) :: i
      integer :: upper, lower, a, b, first_new, t
      upper = mesh%rightmost
      lower = mesh%rightmost
      do while (turn(mesh, upper, mesh%next(upper), i) < 0)
         upper = mesh%next(upper)
      end do
      do while (turn(mesh, mesh%last(lower), lower, i) < 0)
         lower = mesh%last(lower)
      end do
      if (upper == lower) return          ! on a line with both edges: too close to be a point of its own
      first_new = mesh%n + 1
      a = lower
      do while (a /= upper)
         b = mesh%next(a)
         ! edge a b of the outline runs clockwise in the new triangle
         call add_triangle(mesh, [b, a, i])
         t = mesh%triangle(a)
         mesh%beyond(3, mesh%n) = t
         mesh%beyond(opposite(mesh, t, a, b), t) = mesh%n
         if (mesh%n > first_new) then
            ! they share the edge from a to i
            mesh%beyond(1, mesh%n) = mesh%n - 1
            mesh%beyond(2, mesh%n - 1) = mesh%n
         end if
         call wait(mesh, mesh%n, 3)
         a = b
      end do
      mesh%next(lower) = i
      mesh%last(i) = lower
      mesh%triangle(lower) = first_new
      mesh%next(i) = upper
      mesh%last(upper) = i
      mesh%triangle(i) = mesh%n
      mesh%rightmost = i
   end subroutine add_point

   !> Corner of a triangle that is none of these two.
   pure integer function opposite(mesh, t, a, b)
      type(mesh_type), intent(in) :: mesh
      integer, intent(in) :: t, a, b
      do opposite = 1, 3
         if (mesh%corners(opposite, t) /= a .and. mesh%corners(opposite, t) /= b) return
      end do
      opposite = 0
   end function opposite

   !> Test the edge opposite a corner later.
   subroutine wait(mesh, t, corner)
      type(mesh_type), intent(inout) :: mesh
      integer, intent(in) :: t, corner
      mesh%n_waiting = mesh%n_waiting + 1
      call grow(mesh%waiting, mesh%n_waiting, 2)
      mesh%waiting(:, mesh%n_waiting) = [t, corner]
   end subroutine wait

   !> Exchange diagonals until no waiting edge has a corner within the circle of its other triangle.
   subroutine exchange_diagonals(mesh)
      type(mesh_type), intent(inout) :: mesh
      integer :: t, u, k, m
      do while (mesh%n_waiting > 0)
         t = mesh%waiting(1, mesh%n_waiting)
         k = mesh%waiting(2, mesh%n_waiting)
         mesh%n_waiting = mesh%n_waiting - 1
         u = mesh%beyond(k, t)
         if (u == 0) cycle
         m = opposite(mesh, u, mesh%corners(1 + modulo(k, 3), t), mesh%corners(1 + modulo(k + 1, 3), t))
         if (.not. in_circle(mesh%points(:, mesh%corners(:, t)), mesh%points(:, mesh%corners(m, u)))) cycle
         call exchange_diagonal(mesh, t, k, u, m)
      end do
   end subroutine exchange_diagonals

   !> Exchange the edge b c between the triangles t = a b c and u = d c b for a d.
   subroutine exchange_diagonal(mesh, t, k, u, m)
      type(mesh_type), intent(inout) :: mesh
      integer, intent(in) :: t, k, u, m      !! corner k of t is a, corner m of u is d
      integer :: a, b, c, d, ab, ca, bd, dc
      a = mesh%corners(k, t)
      b = mesh%corners(1 + modulo(k, 3), t)
      c = mesh%corners(1 + modulo(k + 1, 3), t)
      d = mesh%corners(m, u)
      ab = mesh%beyond(1 + modulo(k + 1, 3), t)
      ca = mesh%beyond(1 + modulo(k, 3), t)
      dc = mesh%beyond(opposite(mesh, u, d, c), u)
      bd = mesh%beyond(opposite(mesh, u, b, d), u)
      mesh%corners(:, t) = [a, b, d]
      mesh%beyond(:, t) = [bd, u, ab]
      mesh%corners(:, u) = [a, d, c]
      mesh%beyond(:, u) = [dc, ca, t]
      call lead_back(mesh, bd, b, d, t)
      call lead_back(mesh, ca, c, a, u)
      call lead_back(mesh, ab, a, b, t)
      call lead_back(mesh, dc, d, c, u)
      call wait(mesh, t, 1)
      call wait(mesh, u, 1)
      call wait(mesh, t, 3)
      call wait(mesh, u, 2)
   end subroutine exchange_diagonal

   !> What lies beyond the edge a b of a triangle, or of the outline where there is none, is now t.
   subroutine lead_back(mesh, neighbour, a, b, t)
      type(mesh_type), intent(inout) :: mesh
      integer, intent(in) :: neighbour, a, b, t
      if (neighbour > 0) then
         mesh%beyond(opposite(mesh, neighbour, a, b), neighbour) = t
      else if (mesh%next(a) == b) then
         mesh%triangle(a) = t
      else
         mesh%triangle(b) = t
      end if
   end subroutine lead_back

   !> Does a point lie within the circle through the corners of a triangle, counter-clockwise?
   pure logical function in_circle(corners, point)
      real(wp), intent(in) :: corners(2, 3), point(2)
      real(wp) :: v(2, 3), s(3), minors(3)
      integer :: i
      do i = 1, 3
         v(:, i) = corners(:, i) - point
         s(i) = v(1, i)**2 + v(2, i)**2
      end do
      minors = [s(1)*(v(1, 2)*v(2, 3) - v(2, 2)*v(1, 3)), s(2)*(v(1, 3)*v(2, 1) - v(2, 3)*v(1, 1)), &
                s(3)*(v(1, 1)*v(2, 2) - v(2, 1)*v(1, 2))]
      in_circle = sum(minors) > on_circle*(s(1)*sqrt(s(2)*s(3)) + s(2)*sqrt(s(3)*s(1)) + s(3)*sqrt(s(1)*s(2)))
   end function in_circle

end module rockdda_geometry_triangle_field
