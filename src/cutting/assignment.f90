! SPDX-License-Identifier: MIT
!> Assign materials, fixed, loading and measured points and bolts of the input to blocks; find the holes.
!>
!>   * A material line gives its material to every block that it crosses (farther than e0 from the outline);
!>     the last line prevails. Of length below e0 it is a point and applies to the block that contains the point.
!>   * A fixed line fixes every block that it crosses at both ends of each of its parts in that block: at entry, at
!>     exit, or at the end of the line. A crossing of an edge that two blocks share gives a point on
!>     each of them. A part along an outline (closer than e0) fixes the block of the smallest number there, and so
!>     does an end that only touches a block. Of length below e0 a fixed line is a point.
!>     Points of one line on one block that are closer than e0 are one point.
!>     Order: lines as in the input, along each line, then block numbers.
!>   * Points belong to blocks by the rule of rockdda_cutting_location.
module rockdda_cutting_assignment
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_base_sorting, only : sorted_order
   use rockdda_base_strings, only : is_given, to_string
   use rockdda_geometry_segments, only : segment_point
   use rockdda_model_blocks, only : block_system_type, point_set_type
   use rockdda_model_geometry_input, only : geometry_input_type, bolt_type
   use rockdda_cutting_location, only : block_locator_type, line_part_type, line_part
   implicit none
   private
   public :: mark_holes, assign_materials, assign_points, add_loading_points, assign_bolts

   !> Points of one fixed line.
   type :: line_points_type
      integer :: n = 0
      real(wp), allocatable :: parameter(:)
      integer, allocatable :: block(:)
   end type line_points_type

contains

   !> Blocks that contain a hole point.
   subroutine mark_holes(geometry, blocks, locator, is_hole, messages)
      type(geometry_input_type), intent(in) :: geometry
      type(block_system_type), intent(in) :: blocks
      type(block_locator_type), intent(inout) :: locator
      logical, intent(out) :: is_hole(:)                 !! (blocks)
      type(diagnostics_type), intent(inout) :: messages
      integer :: k, block
      is_hole = .false.
      do k = 1, size(geometry%hole_points, 2)
         block = locator%block_at(blocks, geometry%hole_points(:, k))
         if (block > 0) then
            is_hole(block) = .true.
         else
            call messages%add(severity%warning, 'hole point '//to_string(k)//' at '// &
                              place(geometry%hole_points(:, k))//' lies in no block: ignored', geometry%hole_origin(k))
         end if
      end do
   end subroutine mark_holes

   !> Block materials from material lines; 1 for blocks without one.
   subroutine assign_materials(geometry, blocks, locator, messages)
      type(geometry_input_type), intent(in) :: geometry
      type(block_system_type), intent(inout) :: blocks
      type(block_locator_type), intent(inout) :: locator
      type(diagnostics_type), intent(inout) :: messages
      type(line_part_type), allocatable :: parts(:)
      integer, allocatable :: near(:)
      real(wp) :: p(2), q(2)
      integer :: k, i
      logical :: found
      blocks%block_material = 1
      do k = 1, size(geometry%material_lines, 2)
         p = geometry%material_lines(1:2, k)
         q = geometry%material_lines(3:4, k)
         found = .false.
         if (is_point(p, q, locator%e0)) then
            i = locator%block_at(blocks, p)
            found = i > 0
            if (found) blocks%block_material(i) = geometry%line_material(k)
         else
            call locator%blocks_near_line(p, q, near)
            do i = 1, size(near)
               call locator%parts_in_block(blocks, near(i), p, q, parts)
               if (.not. any(parts%kind == line_part%inside)) cycle
               found = .true.
               blocks%block_material(near(i)) = geometry%line_material(k)
            end do
         end if
         if (.not. found) call messages%add(severity%warning, 'material line '//to_string(k)//' from '//place(p)// &
                                            ' to '//place(q)//' goes through no block: ignored', &
                                            geometry%material_line_origin(k))
      end do
   end subroutine assign_materials

   !> Fixed, loading and measured points.
   subroutine assign_points(geometry, blocks, locator, messages)
      type(geometry_input_type), intent(in) :: geometry
      type(block_system_type), intent(inout) :: blocks
      type(block_locator_type), intent(inout) :: locator
      type(diagnostics_type), intent(inout) :: messages
      type(line_points_type) :: points
      integer :: k, i
      real(wp) :: p(2), q(2)
      call begin_set(blocks%fixed)
      do k = 1, size(geometry%fixed_lines, 2)
         p = geometry%fixed_lines(1:2, k)
         q = geometry%fixed_lines(3:4, k)
         call points_of_fixed_line(blocks, locator, p, q, points)
         do i = 1, points%n
            call add_point(blocks%fixed, segment_point(p, q, points%parameter(i)), points%block(i), &
                           geometry%fixed_origin(k), blocks%fixed%n + 1)
         end do
         if (points%n > 0) cycle
         if (is_point(p, q, locator%e0)) then
            call messages%add(severity%error, 'fixed point '//to_string(k)//' at '//place(p)//' lies in no block', &
                              geometry%fixed_origin(k))
         else
            call messages%add(severity%error, 'fixed line '//to_string(k)//' from '//place(p)//' to '//place(q)// &
                              ' meets no block', geometry%fixed_origin(k))
         end if
      end do
      call trim_set(blocks%fixed)
      call assign_set(geometry%loading_points, geometry%loading_origin, 'loading', &
                      severity%error, blocks, locator, blocks%loading, messages)
      call assign_set(geometry%measured_points, geometry%measured_origin, 'measured', severity%warning, blocks, &
                      locator, blocks%measured, messages)
   end subroutine assign_points

   !> Add loading points that the geometry does not have.
   subroutine add_loading_points(positions, origin, locator, blocks, messages)
      real(wp), intent(in) :: positions(:, :)            !! (2, n)
      type(origin_type), intent(in) :: origin            !! where they were read
      type(block_locator_type), intent(inout) :: locator
      type(block_system_type), intent(inout) :: blocks
      type(diagnostics_type), intent(inout) :: messages
      integer :: k, block
      associate (set => blocks%loading)
         if (set%n == 0) then
            call begin_set(set)
         else
            set%number = set%numbers()
            if (.not. allocated(set%origin)) allocate (set%origin(set%n))
         end if
         do k = 1, size(positions, 2)
            block = locator%block_at(blocks, positions(:, k))
            if (block == 0) then
               call messages%add(severity%error, 'loading point at '//place(positions(:, k))//' lies in no block', &
                                 origin)
               cycle
            end if
            call resize_set(set, set%n + 1)
            call add_point(set, positions(:, k), block, origin, maxval([0, set%number(1:set%n)]) + 1)
         end do
         call trim_set(set)
      end associate
   end subroutine add_loading_points

   !> One set of points.
   subroutine assign_set(positions, origins, name, level, blocks, locator, set, messages)
      real(wp), intent(in) :: positions(:, :)            !! (2, n)
      type(origin_type), intent(in) :: origins(:)        !! (n)
      character(len=*), intent(in) :: name               !! for messages
      integer, intent(in) :: level                       !! severity of a point in no block
      type(block_system_type), intent(in) :: blocks
      type(block_locator_type), intent(inout) :: locator
      type(point_set_type), intent(inout) :: set
      type(diagnostics_type), intent(inout) :: messages
      integer :: k, block
      character(len=:), allocatable :: text
      call begin_set(set)
      do k = 1, size(positions, 2)
         block = locator%block_at(blocks, positions(:, k))
         if (block > 0) then
            call add_point(set, positions(:, k), block, origins(k), k)
            cycle
         end if
         text = name//' point '//to_string(k)//' at '//place(positions(:, k))//' lies in no block'
         if (level == severity%warning) text = text//': ignored'
         call messages%add(level, text, origins(k))
      end do
      call trim_set(set)
   end subroutine assign_set

   !> Points of a fixed line on blocks, along the line.
   subroutine points_of_fixed_line(blocks, locator, p, q, points)
      type(block_system_type), intent(in) :: blocks
      type(block_locator_type), intent(inout) :: locator
      real(wp), intent(in) :: p(2), q(2)
      type(line_points_type), intent(out) :: points
      type(line_part_type), allocatable :: parts(:)
      integer, allocatable :: near(:), order(:)
      integer :: i, k, pass, block
      real(wp) :: reach, t
      allocate (points%parameter(0), points%block(0))
      if (is_point(p, q, locator%e0)) then
         block = locator%block_at(blocks, p)
         if (block > 0) call put(0.0_wp, block)
         return
      end if
      reach = locator%e0/hypot(q(1) - p(1), q(2) - p(2))
      call locator%blocks_near_line(p, q, near)
      ! first the parts through blocks, then the parts along outlines without a fixed point
      do pass = 1, 2
         do i = 1, size(near)
            call locator%parts_in_block(blocks, near(i), p, q, parts)
            do k = 1, size(parts)
               if (pass == 1 .and. parts(k)%kind == line_part%inside) then
                  if (is_free(parts(k)%from, near(i))) call put(parts(k)%from, near(i))
                  if (is_free(parts(k)%to, near(i))) call put(parts(k)%to, near(i))
               else if (pass == 2 .and. parts(k)%kind == line_part%along) then
                  if (.not. parts(k)%to - parts(k)%from > reach) cycle
                  if (is_free(parts(k)%from, 0)) call put(parts(k)%from, near(i))
                  if (is_free(parts(k)%to, 0)) call put(parts(k)%to, near(i))
               end if
            end do
         end do
      end do
      ! ends that only touch a block
      do i = 0, 1
         t = i
         if (.not. is_free(t, 0)) cycle
         block = locator%block_at(blocks, segment_point(p, q, t))
         if (block > 0) call put(t, block)
      end do
      order = sorted_order(points%block)
      order = order(sorted_order(points%parameter(order)))
      points%parameter = points%parameter(order)
      points%block = points%block(order)

   contains

      !> Is there no point closer than e0 yet, on this block (0: on any)?
      pure logical function is_free(t, on_block)
         real(wp), intent(in) :: t
         integer, intent(in) :: on_block
         integer :: m
         is_free = .true.
         do m = 1, points%n
            if (on_block > 0 .and. points%block(m) /= on_block) cycle
            if (abs(points%parameter(m) - t) < reach) is_free = .false.
         end do
      end function is_free

      !> Append a point.
      subroutine put(t, on_block)
         real(wp), intent(in) :: t
         integer, intent(in) :: on_block
         points%n = points%n + 1
         points%parameter = [points%parameter, t]
         points%block = [points%block, on_block]
      end subroutine put

   end subroutine points_of_fixed_line

   !> Add bolts between blocks.
   subroutine assign_bolts(bolts, blocks, locator, messages)
      type(bolt_type), intent(in) :: bolts(:)
      type(block_system_type), intent(inout) :: blocks
      type(block_locator_type), intent(inout) :: locator
      type(diagnostics_type), intent(inout) :: messages
      character(len=:), allocatable :: title
      integer :: ends(2, size(bolts)), k, n
      logical :: holds(size(bolts))
      holds = .false.
      do k = 1, size(bolts)
         associate (bolt => bolts(k))
            title = 'bolt '//to_string(k)
            if (is_given(bolt%name)) title = "bolt '"//trim(adjustl(bolt%name))//"'"
            ends(:, k) = [locator%block_at(blocks, bolt%from), locator%block_at(blocks, bolt%to)]
            if (ends(1, k) == 0) call report_outside(bolt%from)
            if (ends(2, k) == 0) call report_outside(bolt%to)
            if (any(ends(:, k) == 0)) cycle
            if (ends(1, k) == ends(2, k)) then
               call messages%add(severity%warning, title//' has both ends in block '//to_string(ends(1, k))// &
                                 ': ignored', bolt%origin)
            else if (.not. bolt%stiffness > 0) then
               call messages%add(severity%warning, title//' has no stiffness: ignored', bolt%origin)
            else
               holds(k) = .true.
            end if
         end associate
      end do
      associate (all => blocks%bolts)
         if (.not. allocated(all%ends)) &
            allocate (all%ends(4, 0), all%blocks(2, 0), all%stiffness(0), all%pretension(0), all%strength(0))
         n = all%n + count(holds)
         all%ends = reshape([all%ends, pack([(bolts(k)%from, bolts(k)%to, k=1, size(bolts))], &
                                            [(spread(holds(k), 1, 4), k=1, size(bolts))])], [4, n])
         all%blocks = reshape([all%blocks, pack(ends, spread(holds, 1, 2))], [2, n])
         all%stiffness = [all%stiffness, pack(bolts%stiffness, holds)]
         all%pretension = [all%pretension, pack(bolts%pretension, holds)]
         all%strength = [all%strength, pack(bolts%yield_force, holds)]
         all%n = n
      end associate

   contains

      !> An end that no block holds.
      subroutine report_outside(x)
         real(wp), intent(in) :: x(2)
         call messages%add(severity%error, title//': its end at '//place(x)//' lies in no block', bolts(k)%origin)
      end subroutine report_outside

   end subroutine assign_bolts

   !> Is a line so short that it represents a point?
   pure logical function is_point(p, q, e0)
      real(wp), intent(in) :: p(2), q(2), e0
      is_point = hypot(q(1) - p(1), q(2) - p(2)) < e0
   end function is_point

   !> A place as text.
   pure function place(x) result(text)
      real(wp), intent(in) :: x(2)
      character(len=:), allocatable :: text
      text = '('//to_string(x(1))//', '//to_string(x(2))//')'
   end function place

   !> Empty set of points.
   pure subroutine begin_set(set)
      type(point_set_type), intent(inout) :: set
      set%n = 0
      if (allocated(set%block)) deallocate (set%position, set%block, set%origin, set%number)
      allocate (set%position(2, 16), set%block(16), set%origin(16), set%number(16))
   end subroutine begin_set

   !> Append a point.
   pure subroutine add_point(set, position, block, origin, number)
      type(point_set_type), intent(inout) :: set
      real(wp), intent(in) :: position(2)
      integer, intent(in) :: block
      type(origin_type), intent(in) :: origin
      integer, intent(in) :: number                      !! of the input
      if (set%n == size(set%block)) call resize_set(set, 2*set%n)
      set%n = set%n + 1
      set%position(:, set%n) = position
      set%block(set%n) = block
      set%origin(set%n) = origin
      set%number(set%n) = number
   end subroutine add_point

   !> Shorten the arrays to their contents.
   pure subroutine trim_set(set)
      type(point_set_type), intent(inout) :: set
      call resize_set(set, set%n)
   end subroutine trim_set

   !> Change the length of the arrays.
   pure subroutine resize_set(set, length)
      type(point_set_type), intent(inout) :: set
      integer, intent(in) :: length
      real(wp), allocatable :: position(:, :)
      integer, allocatable :: block(:), number(:)
      type(origin_type), allocatable :: origin(:)
      allocate (position(2, length), block(length), origin(length), number(length))
      position(:, 1:set%n) = set%position(:, 1:set%n)
      block(1:set%n) = set%block(1:set%n)
      origin(1:set%n) = set%origin(1:set%n)
      number(1:set%n) = set%number(1:set%n)
      call move_alloc(position, set%position)
      call move_alloc(block, set%block)
      call move_alloc(origin, set%origin)
      call move_alloc(number, set%number)
   end subroutine resize_set

end module rockdda_cutting_assignment
