! SPDX-License-Identifier: MIT
!> Delaunay triangulation of points.
!>
!> Points are added from left to right. A new point lies outside of the triangles so far; it makes a triangle with each
!> edge of their outline that it sees:
!>
!>          +---+
!>         /|   |\         then edges whose opposite corner lies within the circle of the triangle are exchanged for the
!>        / |   | * new    other diagonal, until there is none
!>       +--+---+/
!>
!> Four points on a circle have either diagonal.
module rockdda_geometry_triangulation
   use rockdda_base_kinds, only : wp
   use rockdda_base_sorting, only : sorted_order
   use rockdda_geometry_segments, only : side_of_line
   implicit none
   private
   public :: triangulate

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

contains

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
      integer, allocatable :: more(:, :)
      if (mesh%n_waiting == size(mesh%waiting, 2)) then
         allocate (more(2, 2*mesh%n_waiting))
         more(:, 1:mesh%n_waiting) = mesh%waiting
         call move_alloc(more, mesh%waiting)
      end if
      mesh%n_waiting = mesh%n_waiting + 1
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

end module rockdda_geometry_triangulation
