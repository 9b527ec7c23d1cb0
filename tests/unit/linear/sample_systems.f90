! SPDX-License-Identifier: MIT
!> Systems K x = f for the tests of the solvers.
module sample_systems
   use, intrinsic :: iso_fortran_env, only : int64
   use rockdda_base_kinds, only : wp
   use rockdda_linear_matrix, only : block_matrix_type
   use rockdda_linear_pattern, only : build_pattern
   implicit none
   private
   public :: brick_wall, random_system, difference, random_numbers, find_block, full_matrix

   !> A reproducible stream of numbers in [-1, 1).
   type, public :: random_numbers
      integer(int64) :: state = 12345_int64
   contains
      procedure :: next
   end type random_numbers

contains

   !> Place in `values` of block (min(i,j), max(i,j)); 0 when it is not in the pattern.
   pure integer function find_block(matrix, i, j) result(k)
      type(block_matrix_type), intent(in) :: matrix
      integer, intent(in) :: i, j
      do k = matrix%row_start(min(i, j)), matrix%row_start(min(i, j) + 1) - 1
         if (matrix%column(k) == max(i, j)) return
      end do
      k = 0
   end function find_block

   !> The matrix with both halves and its zeros.
   pure function full_matrix(matrix) result(full)
      type(block_matrix_type), intent(in) :: matrix
      real(wp) :: full(6*matrix%n, 6*matrix%n)
      integer :: i, j, k
      full = 0
      do i = 1, matrix%n
         do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
            j = matrix%column(k)
            full(6*i - 5:6*i, 6*j - 5:6*j) = matrix%values(:, :, k)
            full(6*j - 5:6*j, 6*i - 5:6*i) = transpose(matrix%values(:, :, k))
         end do
      end do
   end function full_matrix

   !> Next number of a linear congruential generator (modulus 2^31 - 1, multiplier 48271).
   real(wp) function next(self)
      class(random_numbers), intent(inout) :: self
      self%state = mod(self%state*48271_int64, 2147483647_int64)
      next = 2*real(self%state, wp)/2147483647.0_wp - 1
   end function next

   !> Stiffness and load of a wall of bricks 2 m x 1 m in running bond, every contact closed and locked, the
   !> lowest course held by two stiff points in each brick; load: weight, and a push on every brick.
   subroutine brick_wall(columns, courses, ratio, matrix, f)
      integer, intent(in) :: columns, courses          !! bricks in a course, courses
      real(wp), intent(in) :: ratio                    !! contact stiffness over 2 m / dt^2
      type(block_matrix_type), intent(inout) :: matrix
      real(wp), allocatable, intent(out) :: f(:, :)    !! (6, n)
      real(wp), parameter :: p = 1.0e10_wp, length = 2, height = 1, nu = 0.2_wp
      real(wp) :: inertia, e_plane, weight
      integer, allocatable :: pairs(:, :), slots(:)
      real(wp), allocatable :: points(:, :)            !! (2, contacts)
      logical, allocatable :: level(:)                 !! (contacts) horizontal joint
      type(random_numbers) :: random
      integer :: n, c, i, column, course, first, side

      n = columns*courses
      allocate (pairs(2, 6*n), points(2, 6*n), level(6*n))
      c = 0
      do course = 1, courses
         do column = 1, columns
            i = column + (course - 1)*columns
            if (column < columns) then
               do side = 0, 1
                  call add(i, i + 1, [x_left(column, course) + length, (course - 1 + side)*height], .false.)
               end do
            end if
            if (course == courses) cycle
            ! the bricks above that overlap this one
            do first = max(1, column - 1), min(columns, column + 1)
               if (x_left(first, course + 1) >= x_left(column, course) + length - 0.1_wp) cycle
               if (x_left(first, course + 1) + length <= x_left(column, course) + 0.1_wp) cycle
               call add(i, i + columns + first - column, [max(x_left(first, course + 1), x_left(column, course)), &
                                                          course*height], .true.)
               call add(i, i + columns + first - column, [min(x_left(first, course + 1), x_left(column, course)) &
                                                          + length, course*height], .true.)
            end do
         end do
      end do
      allocate (slots(c), f(6, n))
      call build_pattern(n, pairs(:, 1:c), matrix, slots)
      matrix%values = 0

      inertia = p/ratio
      e_plane = p/50/(1 - nu**2)
      weight = inertia*1.0e-3_wp
      do i = 1, n
         associate (k => matrix%values(:, :, matrix%row_start(i)))
            k(1, 1) = inertia
            k(2, 2) = inertia
            k(3, 3) = inertia*(length**2 + height**2)/12
            k(4, 4) = inertia*length**2/12 + length*height*e_plane
            k(5, 5) = inertia*height**2/12 + length*height*e_plane
            k(6, 6) = inertia*(length**2 + height**2)/48 + length*height*e_plane*(1 - nu)/2
            k(4, 5) = length*height*e_plane*nu
            k(5, 4) = k(4, 5)
            k(3, 6) = inertia*(length**2 - height**2)/24
            k(6, 3) = k(3, 6)
         end associate
         f(:, i) = [0.0_wp, -weight, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
         do side = 1, 6
            f(side, i) = f(side, i) + 0.1_wp*weight*random%next()
         end do
      end do
      do i = 1, columns
         do side = 0, 1
            associate (k => matrix%values(:, :, matrix%row_start(i)))
               call add_spring(100*p, base(i, [x_left(i, 1) + side*length, 0.0_wp], 1), k)
               call add_spring(100*p, base(i, [x_left(i, 1) + side*length, 0.0_wp], 2), k)
            end associate
         end do
      end do
      do i = 1, c
         call add_contact(i, merge(2, 1, level(i)), p)
         call add_contact(i, merge(1, 2, level(i)), p/2.5_wp)
      end do

   contains

      !> Left end of a brick; every other course is shifted by half a brick.
      pure real(wp) function x_left(of_column, of_course)
         integer, intent(in) :: of_column, of_course
         x_left = length*(of_column - 1) + merge(length/2, 0.0_wp, mod(of_course, 2) == 0)
      end function x_left

      !> Note one contact.
      subroutine add(a, b, point, is_level)
         integer, intent(in) :: a, b
         real(wp), intent(in) :: point(2)
         logical, intent(in) :: is_level
         c = c + 1
         pairs(:, c) = [a, b]
         points(:, c) = point
         level(c) = is_level
      end subroutine add

      !> Row of T (thesis Eq. 3.2) at a point of a brick: displacement in direction 1 = x, 2 = y.
      pure function base(block, point, direction) result(t)
         integer, intent(in) :: block, direction
         real(wp), intent(in) :: point(2)
         real(wp) :: t(6), x, y
         integer :: of_course
         of_course = (block - 1)/columns + 1
         x = point(1) - x_left(block - (of_course - 1)*columns, of_course) - length/2
         y = point(2) - (of_course - 0.5_wp)*height
         if (direction == 1) then
            t = [1.0_wp, 0.0_wp, -y, x, 0.0_wp, y/2]
         else
            t = [0.0_wp, 1.0_wp, x, 0.0_wp, y, x/2]
         end if
      end function base

      !> Spring between the two bricks of a contact, both at the contact's point.
      subroutine add_contact(contact, direction, stiffness)
         integer, intent(in) :: contact, direction
         real(wp), intent(in) :: stiffness
         real(wp) :: e(6), g(6)
         e = base(pairs(1, contact), points(:, contact), direction)
         g = -base(pairs(2, contact), points(:, contact), direction)
         call add_spring(stiffness, e, matrix%values(:, :, matrix%row_start(pairs(1, contact))))
         call add_spring(stiffness, g, matrix%values(:, :, matrix%row_start(pairs(2, contact))))
         matrix%values(:, :, slots(contact)) = matrix%values(:, :, slots(contact)) &
            + stiffness*spread(e, 2, 6)*spread(g, 1, 6)
      end subroutine add_contact

      !> k := k + stiffness e e^T.
      pure subroutine add_spring(stiffness, e, k)
         real(wp), intent(in) :: stiffness, e(6)
         real(wp), intent(inout) :: k(6, 6)
         k = k + stiffness*spread(e, 2, 6)*spread(e, 1, 6)
      end subroutine add_spring

   end subroutine brick_wall

   !> A random graph with random blocks, made positive definite by a dominant diagonal.
   subroutine random_system(n, n_pairs, seed, matrix, f)
      integer, intent(in) :: n, n_pairs, seed
      type(block_matrix_type), intent(inout) :: matrix
      real(wp), allocatable, intent(out) :: f(:, :)   !! (6, n)
      type(random_numbers) :: random
      integer :: pairs(2, n_pairs), slots(n_pairs), c, i, j, k
      real(wp) :: a(6, 6)

      random%state = seed
      do c = 1, n_pairs
         pairs(1, c) = 1 + int(0.5_wp*n*(1 + random%next()))
         pairs(2, c) = 1 + mod(pairs(1, c) + int(0.5_wp*(n - 1)*(1 + random%next())), n)
      end do
      call build_pattern(n, pairs, matrix, slots)
      matrix%values = 0
      allocate (f(6, n))
      do i = 1, n
         do j = 1, 6
            f(j, i) = random%next()
            matrix%values(j, j, matrix%row_start(i)) = 1
         end do
      end do
      do c = 1, n_pairs
         do j = 1, 6
            do i = 1, 6
               a(i, j) = random%next()
            end do
         end do
         ! | u_i + A u_j |^2 is never negative
         k = slots(c)
         if (pairs(1, c) < pairs(2, c)) then
            matrix%values(:, :, k) = matrix%values(:, :, k) + a
         else
            matrix%values(:, :, k) = matrix%values(:, :, k) + transpose(a)
         end if
         k = matrix%row_start(pairs(2, c))
         matrix%values(:, :, k) = matrix%values(:, :, k) + matmul(transpose(a), a)
         k = matrix%row_start(pairs(1, c))
         do j = 1, 6
            matrix%values(j, j, k) = matrix%values(j, j, k) + 1
         end do
      end do
   end subroutine random_system

   !> sqrt(sum d^T K_ii d / sum x^T K_ii x), d = x - y: relative difference in the blocks' own energy.
   pure real(wp) function difference(matrix, x, y)
      type(block_matrix_type), intent(in) :: matrix
      real(wp), intent(in) :: x(:, :), y(:, :)   !! (6, n)
      real(wp) :: above, below
      integer :: i, k
      above = 0
      below = 0
      do i = 1, matrix%n
         k = matrix%row_start(i)
         above = above + dot_product(x(:, i) - y(:, i), matmul(matrix%values(:, :, k), x(:, i) - y(:, i)))
         below = below + dot_product(x(:, i), matmul(matrix%values(:, :, k), x(:, i)))
      end do
      difference = sqrt(above/below)
   end function difference

end module sample_systems
