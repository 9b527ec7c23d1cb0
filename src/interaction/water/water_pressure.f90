! SPDX-License-Identifier: MIT
!> Pressure of water, and its integrals along the edge of a block.
!>
!>     table      p = unit weight * (y of the table at x + its rise - y), where that is positive
!>     points     p linear in triangles between points, where that is positive (rockdda_geometry_triangle_field)
!>
!> Along an edge the pressure is linear in pieces: they end under the points of the table and where the edge crosses
!> it, or at the sides of the triangles and where the pressure becomes zero. Displacements of a block are linear along
!> its edges, so that two forces at the ends of an edge,
!>
!>     at P: L n integral of (1 - s) p ds,     at Q: L n integral of s p ds,      s = 0 ... 1 from P to Q
!>
!> do the work of the pressure exactly.
module rockdda_interaction_water_pressure
   use rockdda_base_kinds, only : wp
   use rockdda_geometry_grid, only : grid_query_type
   use rockdda_geometry_linear_pieces, only : positive_part_moments, crossings_of_columns
   use rockdda_geometry_segments, only : segment_point
   use rockdda_geometry_triangle_field, only : triangle_field_type
   use rockdda_model_options, only : water_type
   use rockdda_interaction_time_tables, only : table_value
   implicit none
   private
   public :: water_pressure_type, water_scratch_type, new_water_pressure, rise_of

   !> Scratch of `end_shares`, one for each thread.
   type :: water_scratch_type
      private
      type(grid_query_type) :: query
      real(wp), allocatable :: s(:, :), f(:, :)
   end type water_scratch_type

   type :: water_pressure_type
      real(wp), allocatable :: table(:, :)   !! (2, m) x y
      real(wp) :: unit_weight = 0
      type(triangle_field_type), allocatable :: field   !! instead of the table
   contains
      procedure :: end_shares
      procedure :: largest_on
      procedure :: is_there
      procedure :: covers
      procedure, private :: depth
   end type water_pressure_type

contains

   !> The pressure of a group that has been checked.
   subroutine new_water_pressure(group, pressure)
      type(water_type), intent(in) :: group
      type(water_pressure_type), intent(out) :: pressure
      if (allocated(group%table)) then
         pressure%table = group%table
         pressure%unit_weight = group%unit_weight
      else
         allocate (pressure%field)
         call pressure%field%init(group%pressure(1:2, :), group%pressure(3, :))
      end if
   end subroutine new_water_pressure

   !> Rise of the table of a group.
   pure real(wp) function rise_of(group, t)
      type(water_type), intent(in) :: group
      real(wp), intent(in) :: t                 !! [time]
      real(wp) :: value(1)
      rise_of = 0
      if (.not. allocated(group%level)) return
      value = table_value(group%level, t)
      rise_of = value(1)
   end function rise_of

   !> Is there a pressure? Not when the points make no triangle.
   pure logical function is_there(self)
      class(water_pressure_type), intent(in) :: self
      is_there = allocated(self%table)
      if (allocated(self%field)) is_there = size(self%field%corners, 2) > 0
   end function is_there

   !> Is the pressure given at a place, or no further than a distance from it?
   pure logical function covers(self, point, distance)
      class(water_pressure_type), intent(in) :: self
      real(wp), intent(in) :: point(2), distance
      covers = .true.
      if (allocated(self%field)) covers = self%field%is_inside(point, distance)
   end function covers

   !> Integrals of (1 - s) p and s p over a stretch of an edge from p to q.
   pure subroutine end_shares(self, p, q, stretch, rise, scratch, shares)
      class(water_pressure_type), intent(in) :: self
      real(wp), intent(in) :: p(2), q(2)     !! ends of the edge
      real(wp), intent(in) :: stretch(2)     !! s at the ends of the stretch
      real(wp), intent(in) :: rise           !! of the table [length]
      type(water_scratch_type), intent(inout) :: scratch
      real(wp), intent(out) :: shares(2)     !! [stress]
      integer :: i, n
      if (.not. allocated(self%field)) then
         call shares_of_table(self, p, q, stretch, rise, shares)
         return
      end if
      shares = 0
      call self%field%along(p, q, stretch(1), stretch(2), scratch%query, n, scratch%s, scratch%f)
      do i = 1, n
         shares = shares + positive_part_moments(scratch%s(:, i), scratch%f(:, i))
      end do
   end subroutine end_shares

   !> The integrals for a table.
   pure subroutine shares_of_table(self, p, q, stretch, rise, shares)
      class(water_pressure_type), intent(in) :: self
      real(wp), intent(in) :: p(2), q(2), stretch(2), rise
      real(wp), intent(out) :: shares(2)
      real(wp) :: f(2)
      real(wp) :: s(size(self%table, 2) + 2)
      integer :: i, n
      shares = 0
      ! above the whole table
      if (min(p(2), q(2)) >= maxval(self%table(2, :)) + rise) return
      call crossings_of_columns(p, q, stretch(1), stretch(2), self%table(1, :), s, n)
      f(2) = self%depth(segment_point(p, q, s(1)), rise)
      do i = 2, n
         f(1) = f(2)
         f(2) = self%depth(segment_point(p, q, s(i)), rise)
         shares = shares + self%unit_weight*positive_part_moments(s(i - 1:i), f)
      end do
   end subroutine shares_of_table

   !> Largest pressure on a stretch of an edge.
   pure subroutine largest_on(self, p, q, stretch, rise, scratch, largest)
      class(water_pressure_type), intent(in) :: self
      real(wp), intent(in) :: p(2), q(2), stretch(2), rise
      type(water_scratch_type), intent(inout) :: scratch
      real(wp), intent(out) :: largest       !! [stress]
      real(wp), allocatable :: s(:)
      integer :: i, n
      largest = 0
      if (allocated(self%field)) then
         call self%field%along(p, q, stretch(1), stretch(2), scratch%query, n, scratch%s, scratch%f)
         largest = max(0.0_wp, maxval(scratch%f(:, 1:n)))
         return
      end if
      allocate (s(size(self%table, 2) + 2))
      call crossings_of_columns(p, q, stretch(1), stretch(2), self%table(1, :), s, n)
      do i = 1, n
         largest = max(largest, self%unit_weight*self%depth(segment_point(p, q, s(i)), rise))
      end do
   end subroutine largest_on

   !> Depth of a point below the table, negative above it.
   pure real(wp) function depth(self, point, rise)
      class(water_pressure_type), intent(in) :: self
      real(wp), intent(in) :: point(2)
      real(wp), intent(in) :: rise           !! [length]
      integer :: low, high, middle
      real(wp) :: w
      associate (x => self%table(1, :), y => self%table(2, :))
         high = size(x)
         if (point(1) <= x(1)) then
            depth = y(1)
         else if (point(1) >= x(high)) then
            depth = y(high)
         else
            low = 1      ! x(low) <= point(1) < x(high)
            do while (high - low > 1)
               middle = (low + high)/2
               if (x(middle) <= point(1)) then
                  low = middle
               else
                  high = middle
               end if
            end do
            w = (point(1) - x(low))/(x(high) - x(low))
            depth = (1 - w)*y(low) + w*y(high)
         end if
      end associate
      depth = depth + rise - point(2)
   end function depth

end module rockdda_interaction_water_pressure
