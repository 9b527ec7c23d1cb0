! SPDX-License-Identifier: MIT
!> A field with values at points, linear in triangles, and its values along segments.
!>
!> Points on a regular grid (all pairs of some x and some y) make four triangles in each of its cells, with the mean of
!> the corners in the middle. Other points are joined by Delaunay's triangulation. Beyond the outline the field goes on
!> as in the nearest triangle.
module rockdda_geometry_triangle_field
   use rockdda_base_kinds, only : wp
   use rockdda_base_sorting, only : sorted_order
   use rockdda_geometry_grid, only : grid_type, grid_query_type
   use rockdda_geometry_segments, only : distance_to_segment, segment_point, side_of_line
   use rockdda_geometry_triangulation, only : triangulate
   implicit none
   private
   public :: triangle_field_type

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

end module rockdda_geometry_triangle_field
