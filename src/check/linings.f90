! SPDX-License-Identifier: MIT
!> What is wrong with the linings of a model, and what seems wrong: linings beside the wall, without rock behind them,
!> or where there is no free face.
module rockdda_check_linings
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : diagnostics_type, severity, at_word
   use rockdda_base_strings, only : counted, is_given, to_string
   use rockdda_geometry_polygons, only : point_in_polygon, polygon_properties
   use rockdda_geometry_segments, only : segments_cross, distance_to_segment, line_intersection
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_bolt_layout, only : rock_at, stage_with
   use rockdda_model_liner_layout, only : liner_layout_type, new_liner_layout, line_of_liner, title_of_liner, &
      lower_liner, liner_number, layout_problem
   use rockdda_model_support_options, only : liner_problem
   use rockdda_model_options, only : run_options_type, liner_type, is_set
   use rockdda_model_regions, only : has_region, same_name
   use rockdda_model_stage_options, only : stage_name
   use rockdda_interaction_liner_places, only : stretch_type, find_stretches, faces_of_path, segment_outline, &
      opening_side, reach_over_thickness
   use rockdda_check_material_names, only : check_joint_material, stiffens
   use rockdda_check_support_numbers, only : line_type, check_numbers_of_liner, check_change, check_same_place
   use rockdda_base_suggest, only : did_you_mean
   implicit none
   private
   public :: check_liners, liner_names

   !> Lengths over thickness of elements for which a lining is advised.
   real(wp), parameter :: shortest = 0.5_wp, longest = 4
   !> A line that lies closer to the rock than this share of the thickness lies on it.
   real(wp), parameter :: beside = 0.05_wp
   !> Rock that turns by more from edge to edge makes N of a lining more than 3 % too small [rad].
   real(wp), parameter :: coarse_turn = 0.183_wp
   !> What N and M of a lining in a round hole in elastic ground lack over the square of that angle, at most: Einstein
   !> and Schwartz's against those of holes of 24 to 96 edges. A quarter of it is the smaller hole, the rest the cells.
   real(wp), parameter :: lack(2) = [0.9_wp, 1.2_wp]
   !> Shares of the length that matter.
   real(wp), parameter :: least_share = 0.01_wp

contains

   !> Names of all linings.
   pure function liner_names(options) result(names)
      type(run_options_type), intent(in) :: options
      character(len=80), allocatable :: names(:)
      integer :: k
      allocate (names(size(options%liners)))
      do k = 1, size(names)
         names(k) = title_of_liner(options%liners(k), k)
      end do
   end function liner_names

   !> All linings of the options, and the changes that name one.
   subroutine check_liners(options, n_joints, blocks, messages)
      type(run_options_type), intent(in) :: options
      integer, intent(in) :: n_joints               !! joint materials
      type(block_system_type), intent(in) :: blocks
      type(diagnostics_type), intent(inout) :: messages
      type(line_type) :: lines(size(options%liners))
      logical :: sound(size(options%liners))
      integer :: i, k
      sound = .true.
      do k = 1, size(options%liners)
         allocate (lines(k)%xy(0))
         associate (liner => options%liners(k))
            sound(k) = len(liner_problem(liner)) == 0   ! else it was reported
            do i = 1, k - 1
               if (same_name(title_of_liner(liner, k), title_of_liner(options%liners(i), i))) &
                  call fail("there are two linings of the name '"//title_of_liner(liner, k)//"'", &
                            title_of_liner(liner, k))
            end do
            if (allocated(liner%along) .and. is_given(liner%outline)) call fail('along and outline both name its line')
            if (allocated(liner%along)) then
               if (size(liner%along) < 4 .or. mod(size(liner%along), 2) > 0) &
                  call fail('along takes x and y of two points or more, found '// &
                            counted(size(liner%along), 'number'), 'along')
            end if
            if (is_given(liner%on)) then
               if (lower_liner(options%liners, k) == 0) then
                  call fail("on = '"//trim(adjustl(liner%on))//"' "//on_problem(), liner%on)
               else
                  sound(k) = sound(k) .and. sound(lower_liner(options%liners, k))
                  call check_order()
                  if (.not. has_line_of(options%liners(lower_liner(options%liners, k)), liner)) &
                     call fail('a layer lies on all of the lining that on names: give the same line, or none')
               end if
            else if (is_given(liner%outline)) then
               if (.not. has_region(options%regions, liner%outline)) &
                  call fail("there is no region '"//trim(adjustl(liner%outline))//"'", liner%outline)
            end if
            if (is_given(liner%joint_material)) call check_joint_material('&liner', trim(adjustl( &
               liner%joint_material)), n_joints, [options%joint_materials, options%joint_laws], liner%origin, messages)
            if (is_given(liner%joint_material)) then
               if (stiffens(liner%joint_material, [options%joint_materials, options%joint_laws])) &
                  call fail("the joint of a lining has a constant stiffness, but '"// &
                            trim(adjustl(liner%joint_material))//"' has maximum_closure", liner%joint_material)
            end if
            if (.not. sound(k)) cycle
            if (lower_liner(options%liners, k) == 0) call check_line(k, options, blocks, messages, lines(k)%xy)
            call check_numbers_of_liner(k, options, lines(k)%xy, messages)
            call check_same_place(k, lines(:k), options, messages)
         end associate
      end do
      do i = 1, size(options%changes)
         associate (change => options%changes(i))
            call check_change(change, options, messages)
            if (.not. is_given(change%liner)) cycle
            if (liner_number(options%liners, change%liner) == 0) call messages%add(severity%error, &
               "&change: there is no lining '"//trim(adjustl(change%liner))//"'"// &
               did_you_mean(trim(adjustl(change%liner)), liner_names(options)), at_word(change%origin, change%liner))
         end associate
      end do

   contains

      !> An error of lining k.
      subroutine fail(text, word)
         character(len=*), intent(in) :: text
         character(len=*), intent(in), optional :: word    !! which is wrong
         if (present(word)) then
            call messages%add(severity%error, '&liner: '//text, at_word(options%liners(k)%origin, word))
         else
            call messages%add(severity%error, '&liner: '//text, options%liners(k)%origin)
         end if
         sound(k) = .false.
      end subroutine fail

      !> Does a layer name no line, or that of the lining below?
      pure logical function has_line_of(lower, layer)
         type(liner_type), intent(in) :: lower, layer
         has_line_of = .true.
         if (allocated(layer%along)) then
            has_line_of = allocated(lower%along) .or. is_given(lower%on)
            if (allocated(lower%along)) has_line_of = size(lower%along) == size(layer%along)
            if (has_line_of .and. allocated(lower%along)) has_line_of = .not. any(abs(layer%along - lower%along) > 0)
         else if (is_given(layer%outline)) then
            has_line_of = is_given(lower%on)
            if (is_given(lower%outline)) has_line_of = same_name(lower%outline, layer%outline)
         end if
      end function has_line_of

      !> Why on names no lining below.
      function on_problem() result(text)
         character(len=:), allocatable :: text
         character(len=80), allocatable :: names(:)
         names = liner_names(options)
         associate (j => liner_number(options%liners, options%liners(k)%on))
            if (j == k) then
               text = 'is this lining itself: name one given before it, on which it lies'
            else if (j > k) then
               text = 'is given after this one: give the lower lining first'
            else
               text = 'names no lining before this one'// &
                      did_you_mean(trim(adjustl(options%liners(k)%on)), names(:k - 1))
            end if
         end associate
      end function on_problem

      !> A layer needs the lining below, as long as it is there.
      subroutine check_order()
         integer :: low, mine, lower, gone, last
         low = lower_liner(options%liners, k)
         mine = stage_with(options%stages, title_of_liner(options%liners(k), k), installs=.true.)
         lower = stage_with(options%stages, title_of_liner(options%liners(low), low), installs=.true.)
         gone = stage_with(options%stages, title_of_liner(options%liners(low), low), installs=.false.)
         if (mine < lower .or. (gone > 0 .and. gone <= mine)) call fail("when it is installed the lining '"// &
            title_of_liner(options%liners(low), low)//"' on which it lies is not there")
         last = stage_with(options%stages, title_of_liner(options%liners(k), k), installs=.false.)
         if (gone <= mine .or. (last > 0 .and. last <= gone)) return
         call messages%add(severity%error, "&stage: remove: on lining '"//title_of_liner(options%liners(low), low)// &
                           "' lies the layer '"//title_of_liner(options%liners(k), k)//"', which stays: remove "// &
                           'both, or the layer before', &
                           at_word(options%stages(gone)%origin, title_of_liner(options%liners(low), low)))
      end subroutine check_order

   end subroutine check_liners

   !> The line of a lining where it is installed.
   subroutine check_line(k, options, blocks, messages, line)
      integer, intent(in) :: k
      type(run_options_type), intent(in) :: options
      type(block_system_type), intent(in) :: blocks
      type(diagnostics_type), intent(inout) :: messages
      real(wp), allocatable, intent(inout) :: line(:)   !! x y of its points; empty where it is wrong [length]
      type(liner_layout_type) :: layout
      type(stretch_type), allocatable :: stretches(:)
      logical, allocatable :: rock(:), is_cell(:)
      character(len=:), allocatable :: problem
      real(wp) :: total, covered, blocked, of_cells, far, length, element, point(2), thinner, turn, edge(2), before(2)
      integer :: i, j, n_cells, side
      logical :: meets
      associate (liner => options%liners(k), t => options%liners(k)%thickness)
         line = line_of_liner(options%liners, k, blocks, options%regions)
         problem = layout_problem(line, t, liner%element)
         if (len(problem) > 0) then
            call tell(severity%error, problem)
            line = [real(wp) ::]
            return
         end if
         layout = new_liner_layout(line, t, liner%element)
         if (layout%n == 0) then
            if (is_given(liner%outline)) then
               call tell(severity%error, "region '"//trim(adjustl(liner%outline))//"' has no blocks with an outer line")
            else
               call tell(severity%error, 'the line along has no length')
            end if
            return
         end if
         total = sum([(norm2(layout%path(:, i + 1) - layout%path(:, i)), i=1, size(layout%path, 2) - 1)])
         element = total/merge(layout%n, layout%n - 1, layout%closed)
         if (is_set(liner%element)) then
            if (element < shortest*t*0.95_wp .or. element > longest*t*1.001_wp) call tell(severity%warning, &
               'nodes are '//to_string(element/t, 3)//' thicknesses apart; bending is right for '// &
               to_string(shortest, 2)//' to '//to_string(longest, 2))
         end if
         if (allocated(liner%along)) then
            call find_meeting(reshape(line, [2, size(line)/2]), layout%closed, 1.0e-9_wp*total)
            if (meets) then
               call tell(severity%error, 'the line meets itself at ('//to_string(point(1), 5)//', '// &
                         to_string(point(2), 5)//'); expected one that does not cross nor turn back on itself')
               line = [real(wp) ::]
               return
            end if
         end if
         rock = rock_at(blocks, options%regions, options%stages, &
                        stage_with(options%stages, title_of_liner(liner, k), installs=.true.))
         call find_stretches(layout%path, reach_over_thickness*t, blocks, blocks%vertices, rock, stretches, side)
         if (side == 0) side = opening_side(layout%path, layout%closed)
         i = sharp_turn(layout, t)
         if (i > 0) then
            problem = 'the line turns too sharply for a thickness of '//to_string(t)//' at ('// &
                      to_string(layout%path(1, layout%node(i)), 5)//', '// &
                      to_string(layout%path(2, layout%node(i)), 5)//'): draw it round with more points'
            thinner = t
            do j = 1, 30
               thinner = 0.8_wp*thinner
               if (len(layout_problem(line, thinner, liner%element)) > 0) exit
               if (sharp_turn(new_liner_layout(line, thinner, liner%element), thinner) > 0) cycle
               problem = problem//', or make the lining thinner (accepted is '//to_string(thinner, 3)//')'
               exit
            end do
            call tell(severity%error, problem)
            return
         end if
         covered = 0
         blocked = 0
         is_cell = cells_of()
         of_cells = 0
         n_cells = 0
         turn = 0
         edge = 0
         before = 0
         do j = 1, size(stretches)
            length = (stretches(j)%ends(2) - stretches(j)%ends(1))* &
                     norm2(layout%path(:, stretches(j)%piece + 1) - layout%path(:, stretches(j)%piece))
            covered = covered + length
            if (is_in_rock(stretches(j))) blocked = blocked + length
            if (is_cell(stretches(j)%block)) of_cells = of_cells + length
            ! several elements may lie along one edge
            if (j > 1) then
               if (stretches(j - 1)%block /= stretches(j)%block) then
                  turn = max(turn, smooth_turn(before, edge))
                  before = edge
                  edge = 0
                  if (is_cell(stretches(j)%block)) n_cells = n_cells + 1
               end if
            else if (is_cell(stretches(j)%block)) then
               n_cells = 1
            end if
            edge = edge + (stretches(j)%ends(2) - stretches(j)%ends(1))* &
                   (layout%path(:, stretches(j)%piece + 1) - layout%path(:, stretches(j)%piece))
         end do
         if (element*n_cells < of_cells*0.95_wp) call tell(severity%warning, 'nodes are '//to_string(element, 3)// &
            ' apart, the edges of the cells behind it '//to_string(of_cells/n_cells, 3)//': these stay '// &
            'straight, so that it bends at their corners alone, and too much there; '// &
            'expected smaller cells, or longer elements')
         if (turn > coarse_turn .and. size(line) > size(line_of_liner(options%liners, k, blocks, options%regions, &
            as_drawn=.true.))) call tell(severity%warning, 'it is round, the rock behind it turns by '// &
            to_string(turn*180/acos(-1.0_wp), 3)//' degrees from edge to edge: in continuous ground N is up to '// &
            to_string(100*lack(1)*turn**2, 2)//' % and M up to '//to_string(100*lack(2)*turn**2, 2)// &
            ' % too small; expected edges that turn by 10 degrees or less')
         if (size(stretches) == 0) then
            i = block_at(0.5_wp*(layout%path(:, 1) + layout%path(:, 2)))
            if (i > 0) then
               call tell(severity%warning, 'the line lies inside block '//to_string(i)//', along no edge of a '// &
                         'block: nothing holds the lining; draw it along the wall, or cut the block there')
            else
               call tell(severity%warning, 'no rock lies within half its thickness of the line: nothing holds '// &
                         'the lining')
            end if
            return
         end if
         call report_lost_rock(layout%path)
         if (total - covered > least_share*total) call tell(severity%warning, to_string(100*(1 - covered/total), 2)// &
            ' % of the line lies beside no rock when it is installed; rock that comes there later does not meet it')
         layout = new_liner_layout(line_of_liner(options%liners, k, blocks, options%regions, as_drawn=.true.), t, &
                                   liner%element)
         call find_stretches(layout%path, reach_over_thickness*t, blocks, blocks%vertices, rock, stretches, side)
         far = maxval(stretches%distance)
         if (far > beside*t) call tell(severity%warning, 'the line lies up to '//to_string(far, 3)// &
                                       ' beside the rock: it is held across')
         if (blocked > least_share*total) call tell(severity%warning, 'there is no free face along '// &
            to_string(100*blocked/total, 2)//' % of the line when it is installed: rock lies where the lining is')
      end associate

   contains

      !> A message on the lining.
      subroutine tell(level, text)
         integer, intent(in) :: level
         character(len=*), intent(in) :: text
         call messages%add(level, "liner '"//title_of_liner(options%liners(k), k)//"': "//text, &
                           options%liners(k)%origin)
      end subroutine tell

      !> Angle between two directions; 0 where one is none, and at a corner, of more than 30 degrees.
      pure real(wp) function smooth_turn(a, b) result(angle)
         real(wp), intent(in) :: a(2), b(2)
         angle = 0
         if (norm2(a) > 0 .and. norm2(b) > 0) angle = abs(atan2(a(1)*b(2) - a(2)*b(1), dot_product(a, b)))
         if (angle > acos(-1.0_wp)/6) angle = 0
      end function smooth_turn

      !> Is there rock in the middle of the lining along a stretch?
      pure logical function is_in_rock(stretch)
         type(stretch_type), intent(in) :: stretch
         real(wp) :: along(2)
         associate (p => layout%path(:, stretch%piece), q => layout%path(:, stretch%piece + 1))
            along = q - p
            is_in_rock = block_at(p + 0.5_wp*sum(stretch%ends)*along + side*0.5_wp*options%liners(k)%thickness* &
                                  [-along(2), along(1)]/norm2(along)) > 0
         end associate
      end function is_in_rock

      !> The block around a point, of those that are there; 0: none.
      pure integer function block_at(point) result(b)
         real(wp), intent(in) :: point(2)
         do b = 1, blocks%n_blocks
            if (.not. rock(b)) cycle
            associate (v => blocks%vertices(:, blocks%vertex_offset(b) + 1:blocks%vertex_offset(b + 1)))
               if (any(point < minval(v, 2)) .or. any(point > maxval(v, 2))) cycle
               if (point_in_polygon(point, v)) return
            end associate
         end do
         b = 0
      end function block_at

      !> Stages that take out rock along which a lining was installed.
      subroutine report_lost_rock(path)
         real(wp), intent(in) :: path(:, :)            !! (2, points) of its line [length]
         logical, allocatable :: before(:), after(:)
         character(len=:), allocatable :: name
         real(wp) :: lost
         integer :: gone, j, s
         name = title_of_liner(options%liners(k), k)
         associate (stages => options%stages)
            gone = stage_with(stages, name, installs=.false.)
            if (gone == 0) gone = size(stages) + 1
            do s = stage_with(stages, name, installs=.true.) + 1, gone - 1
               if (.not. is_given(stages(s)%excavate)) cycle
               before = rock_at(blocks, options%regions, stages, s - 1)
               after = rock_at(blocks, options%regions, stages, s)
               lost = 0
               do j = 1, size(stretches)
                  associate (stretch => stretches(j))
                     if (before(stretch%block) .and. .not. after(stretch%block)) lost = lost + &
                        (stretch%ends(2) - stretch%ends(1))*norm2(path(:, stretch%piece + 1) - path(:, stretch%piece))
                  end associate
               end do
               if (lost > least_share*total) call messages%add(severity%warning, stage_name(stages, s)// &
                  ' takes out rock behind '//to_string(100*lost/total, 2)//" % of the line of lining '"//name// &
                  "', which nothing holds there from then on", stages(s)%origin)
            end do
         end associate
      end subroutine report_lost_rock

      !> The first point at which a line crosses or touches itself, or turns back.
      subroutine find_meeting(given, closed, reach)
         real(wp), intent(in) :: given(:, :)           !! (2, n) its points [length]
         logical, intent(in) :: closed                 !! its last point is its first one
         real(wp), intent(in) :: reach                 !! what is nearer touches [length]
         real(wp), allocatable :: p(:, :)
         integer, allocatable :: kept(:)
         real(wp) :: s, t
         integer :: i, j, n
         logical :: parallel
         kept = [1, pack([(i, i=2, size(given, 2))], [(norm2(given(:, i) - given(:, i - 1)) > reach, &
                                                        i=2, size(given, 2))])]
         p = given(:, kept)
         n = size(p, 2) - 1
         meets = .true.
         do i = 1, n
            do j = i + 1, n
               associate (a => p(:, i), b => p(:, i + 1), c => p(:, j), d => p(:, j + 1))
                  ! neighbours share a point
                  if (j > i + 1) then
                     point = c
                     if (distance_to_segment(c, a, b) <= reach) return
                     point = b
                     if (distance_to_segment(b, c, d) <= reach) return
                     if (closed .and. i == 1 .and. j == n) cycle
                     call line_intersection(a, b, c, d, s, t, parallel)
                     point = a + s*(b - a)
                     if (segments_cross(a, b, c, d)) return
                  end if
                  point = d
                  if (distance_to_segment(d, a, b) <= reach) return
                  point = a
                  if (distance_to_segment(a, c, d) <= reach) return
               end associate
            end do
         end do
         meets = .false.
      end subroutine find_meeting

      !> Which blocks &subdivide has cut from others: those that share their parent.
      pure function cells_of() result(is_cell)
         logical :: is_cell(blocks%n_blocks)
         integer, allocatable :: n_pieces(:)
         integer :: i
         is_cell = .false.
         if (.not. allocated(blocks%parent)) return
         allocate (n_pieces(maxval(blocks%parent)), source=0)
         do i = 1, size(blocks%parent)
            n_pieces(blocks%parent(i)) = n_pieces(blocks%parent(i)) + 1
         end do
         is_cell = n_pieces(blocks%parent) > 1
      end function cells_of

   end subroutine check_line

   !> The first segment that has no room where the line turns; 0: none.
   pure integer function sharp_turn(layout, thickness) result(i)
      type(liner_layout_type), intent(in) :: layout
      real(wp), intent(in) :: thickness             !! [length]
      real(wp) :: faces(2, size(layout%path, 2), 2), area, center(2), moments(3), least
      real(wp) :: element
      faces = faces_of_path(layout%path, layout%closed, 1, thickness)
      element = sum(norm2(layout%path(:, 2:) - layout%path(:, :size(layout%path, 2) - 1), 1))/ &
                merge(layout%n, layout%n - 1, layout%closed)
      do i = 1, layout%n
         call polygon_properties(segment_outline(faces, layout%first(i), layout%last(i), 1), area, center, moments)
         least = 0.5_wp*(moments(1) + moments(2)) - norm2([0.5_wp*(moments(1) - moments(2)), moments(3)])
         if (.not. least > 0.1_wp*area*min(thickness, element)**2/12) return
      end do
      i = 0
   end function sharp_turn

end module rockdda_check_linings
