! SPDX-License-Identifier: MIT
!> What is wrong with the bolts of a model, and what seems wrong: bolts that cross no joint, lie outside the rock, or
!> whose head does not lie on a free face.
module rockdda_check_bolts
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity, at_word
   use rockdda_base_strings, only : counted, is_given, to_string
   use rockdda_geometry_polygons, only : distance_to_outline, point_in_polygon
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_bolt_layout, only : bolt_line_type, bolt_lines, trace_bolt, hold_ends, rock_at, stage_with, &
      title_of_bolt, most_bolts
   use rockdda_model_liner_layout, only : liner_number, title_of_liner
   use rockdda_model_bolt_numbers, only : bolt_numbers_type, numbers_of_bolt, bolt_problem
   use rockdda_model_geometry_input, only : is_spring
   use rockdda_model_options, only : run_options_type
   use rockdda_model_regions, only : count_words, word_of, same_name, has_region
   use rockdda_model_stage_options, only : stage_name
   use rockdda_base_suggest, only : did_you_mean
   use rockdda_check_linings, only : liner_names
   use rockdda_check_support_numbers, only : check_numbers_of_bolt
   implicit none
   private
   public :: check_bolts

contains

   !> All bolts of the options, and their names in stages.
   subroutine check_bolts(options, blocks, messages)
      type(run_options_type), intent(in) :: options
      type(block_system_type), intent(in) :: blocks
      type(diagnostics_type), intent(inout) :: messages
      type(bolt_line_type), allocatable :: lines(:)
      logical, allocatable :: rock(:)
      integer :: g, l, last, s
      logical :: ok
      ok = .true.
      do g = 1, size(options%bolts)
         ok = ok .and. len(bolt_problem(options%bolts(g))) == 0   ! else it was reported
         if (.not. is_given(options%bolts(g)%outline)) cycle
         if (has_region(options%regions, options%bolts(g)%outline)) cycle
         ok = .false.
         call messages%add(severity%error, "&bolt: there is no region '"//trim(adjustl(options%bolts(g)%outline))// &
                           "'", at_word(options%bolts(g)%origin, options%bolts(g)%outline))
      end do
      call check_stage_names(options, messages)
      if (.not. ok .or. all(is_spring(options%bolts))) return
      call bolt_lines(options%bolts, blocks, options%regions, options%stages, lines)
      do g = 1, size(options%bolts)
         if (count([(lines(l)%group == g, l=1, size(lines))]) >= most_bolts) call messages%add(severity%error, &
            '&bolt: spacing gives more than '//to_string(most_bolts)//' bolts', options%bolts(g)%origin)
         if (is_spring(options%bolts(g)) .or. any([(lines(l)%group == g, l=1, size(lines))])) cycle
         call messages%add(severity%error, '&bolt: the line has no room for a bolt: offset and spacing are longer', &
                           options%bolts(g)%origin)
      end do
      do g = 1, size(options%bolts)
         call check_numbers_of_bolt(g, options, messages)
      end do
      last = 0
      do l = 1, size(lines)
         ! bolts of a group are installed together
         if (lines(l)%group /= last) rock = rock_at(blocks, options%regions, options%stages, &
            stage_with(options%stages, options%bolts(lines(l)%group)%name, installs=.true.))
         last = lines(l)%group
         call check_line(lines(l), options, blocks, rock, messages)
      end do
      call report_equal_bolts(lines, options, messages)
      do s = 1, size(options%stages)
         if (is_given(options%stages(s)%excavate)) call report_lost_parts(s, lines, options, blocks, messages)
      end do
   end subroutine check_bolts

   !> Bolts of two groups from one place to another, there at the same time: once for two groups.
   subroutine report_equal_bolts(lines, options, messages)
      type(bolt_line_type), intent(in) :: lines(:)
      type(run_options_type), intent(in) :: options
      type(diagnostics_type), intent(inout) :: messages
      real(wp) :: reach
      integer :: there(2, size(options%bolts)), g, k, l, n(size(options%bolts)), first(size(options%bolts))
      do g = 1, size(options%bolts)
         there(:, g) = [stage_with(options%stages, options%bolts(g)%name, installs=.true.), &
                        stage_with(options%stages, options%bolts(g)%name, installs=.false.)]
         if (there(2, g) == 0) there(2, g) = huge(1)
      end do
      do g = 1, size(options%bolts)
         n = 0
         do l = 1, size(lines)
            if (lines(l)%group /= g) cycle
            reach = 1.0e-6_wp*norm2(lines(l)%toe - lines(l)%head)
            do k = 1, l - 1
               if (all(abs(lines(k)%head - lines(l)%head) <= reach) .and. &
                   all(abs(lines(k)%toe - lines(l)%toe) <= reach)) exit
            end do
            if (k == l) cycle
            associate (other => lines(k)%group)
               if (there(1, other) >= there(2, g) .or. there(1, g) >= there(2, other)) cycle
               n(other) = n(other) + 1
               if (n(other) == 1) first(other) = l
            end associate
         end do
         do k = 1, size(n)
            if (n(k) == 0) cycle
            associate (line => lines(first(k)))
               call messages%add(severity%warning, "bolt '"//line%name//"', from "//place(line%head)//' to '// &
                  place(line%toe)//", lies where one of '"//title_of_bolt(options%bolts(k), k)// &
                  "' lies at the same time ("//counted(n(k), 'bolt')//' of the group): both carry. Is one given '// &
                  'twice?', options%bolts(g)%origin)
            end associate
         end do
      end do

   contains

      !> '(1, 2.5)'
      function place(x) result(text)
         real(wp), intent(in) :: x(2)
         character(len=:), allocatable :: text
         text = '('//to_string(x(1), 5)//', '//to_string(x(2), 5)//')'
      end function place

   end subroutine report_equal_bolts

   !> Bolts that lose a part of the rock around them with a stage.
   subroutine report_lost_parts(stage, lines, options, blocks, messages)
      integer, intent(in) :: stage
      type(bolt_line_type), intent(in) :: lines(:)
      type(run_options_type), intent(in) :: options
      type(block_system_type), intent(in) :: blocks
      type(diagnostics_type), intent(inout) :: messages
      real(wp), allocatable :: from(:), to(:)
      integer, allocatable :: block(:)
      logical, allocatable :: before(:), after(:)
      integer :: l, n
      n = 0
      before = rock_at(blocks, options%regions, options%stages, stage - 1)
      after = rock_at(blocks, options%regions, options%stages, stage)
      do l = 1, size(lines)
         if (stage_with(options%stages, options%bolts(lines(l)%group)%name, installs=.true.) >= stage) cycle
         call trace_bolt(lines(l)%head, lines(l)%toe, blocks, before .and. .not. after, block, from, to)
         if (size(block) > 0) n = n + 1
      end do
      if (n > 0) call messages%add(severity%warning, stage_name(options%stages, stage)//' takes out rock around '// &
                                   counted(n, 'bolt')//', which lose that part and go on with the rest', &
                                   options%stages(stage)%origin)
   end subroutine report_lost_parts

   !> One bolt where it lies when it is installed.
   subroutine check_line(line, options, blocks, rock, messages)
      type(bolt_line_type), intent(in) :: line
      type(run_options_type), intent(in) :: options
      type(block_system_type), intent(in) :: blocks
      logical, intent(in) :: rock(:)              !! (blocks) that are there
      type(diagnostics_type), intent(inout) :: messages
      type(bolt_numbers_type) :: numbers
      real(wp), allocatable :: from(:), to(:)
      integer, allocatable :: block(:)
      real(wp), parameter :: stand_off = 0.1_wp   !! share of the length by which a plate may stand before the rock
      real(wp) :: length, reach
      associate (bolt => options%bolts(line%group))
         length = norm2(line%toe - line%head)
         reach = 1.0e-6_wp*length
         numbers = numbers_of_bolt(bolt, length)
         call trace_bolt(line%head, line%toe, blocks, rock, block, from, to)
         if (.not. numbers%grouted) call hold_ends(line%head, line%toe, blocks, rock, block, from, to)
         if (all(block == 0)) then
            call messages%add(merge(severity%error, severity%warning, numbers%grouted), &
               text('lies outside the rock'), &
                              bolt%origin)
            return
         end if
         if (numbers%grouted .and. numbers%plate_strength > 0 .and. from(1) > stand_off*length) &
            call messages%add(severity%error, text('has a plate at its head, which lies outside the rock'), &
               bolt%origin)
         if (numbers%grouted .and. all(from >= numbers%free(1) .and. to <= numbers%free(2))) &
            call messages%add(severity%error, text('has no grout in the rock'), bolt%origin)
         if (any(block == 0)) then
            call messages%add(severity%warning, text('lies outside the rock in part: an end there is a fixed point'), &
                              bolt%origin)
         else if (from(1) > reach .or. to(size(to)) < length - reach) then
            call messages%add(severity%warning, text('lies outside the rock in part'), bolt%origin)
         end if
         if (all(block == block(1))) call messages%add(severity%warning, text('crosses no joint'), bolt%origin)
         if (.not. is_at_face(line%head)) call messages%add(severity%warning, &
                                                            text('has its head on no free face'), bolt%origin)
      end associate

   contains

      !> A message on this bolt.
      function text(fact)
         character(len=*), intent(in) :: fact
         character(len=:), allocatable :: text
         text = "bolt '"//line%name//"' "//fact
      end function text

      !> Does a point lie on the edge of the rock? It does where there is none on some side.
      logical function is_at_face(point)
         real(wp), intent(in) :: point(2)
         real(wp), parameter :: pi = acos(-1.0_wp)
         integer, parameter :: n_around = 16
         real(wp) :: around(2)
         integer :: i, k
         integer, allocatable :: near(:)     !! blocks
         is_at_face = .true.
         near = pack([(i, i=1, blocks%n_blocks)], [(rock(i) .and. is_near(i), i=1, blocks%n_blocks)])
         do k = 1, n_around
            around = point + 1.0e-3_wp*length*[cos((2*k + 1)*pi/n_around), sin((2*k + 1)*pi/n_around)]
            do i = 1, size(near)
               associate (v => blocks%vertices(:, blocks%vertex_offset(near(i)) + 1:blocks%vertex_offset(near(i) + 1)))
                  if (point_in_polygon(around, v)) exit
                  if (distance_to_outline(around, v) <= reach) exit
               end associate
            end do
            if (i > size(near)) return
         end do
         is_at_face = .false.
      end function is_at_face

      !> May a block be within 1e-3 of the length from the head? It is when its box is.
      pure logical function is_near(i)
         integer, intent(in) :: i            !! block
         integer :: axis
         is_near = .true.
         do axis = 1, 2
            associate (x => blocks%vertices(axis, blocks%vertex_offset(i) + 1:blocks%vertex_offset(i + 1)))
               is_near = is_near .and. any(x > line%head(axis) - 2.0e-3_wp*length) .and. &
                  any(x < line%head(axis) + 2.0e-3_wp*length)
            end associate
         end do
      end function is_near

   end subroutine check_line

   !> Stages name bolts that there are.
   subroutine check_stage_names(options, messages)
      type(run_options_type), intent(in) :: options
      type(diagnostics_type), intent(inout) :: messages
      character(len=80), allocatable :: known(:)
      integer :: g, s
      allocate (known(size(options%bolts)))
      do g = 1, size(options%bolts)
         known(g) = ''
         if (is_given(options%bolts(g)%name) .and. .not. is_spring(options%bolts(g))) &
            known(g) = title_of_bolt(options%bolts(g), g)
      end do
      do g = 1, size(known)
         if (len_trim(known(g)) == 0) cycle
         if (liner_number(options%liners, trim(known(g))) == 0) cycle
         call messages%add(severity%error, "&bolt: there is a lining of the name '"//trim(known(g))// &
                           "', too: stages install and remove both by it; give the bolts another one", &
                           at_word(options%bolts(g)%origin, trim(known(g))))
      end do
      known = [known, liner_names(options)]
      do s = 1, size(options%stages)
         if (allocated(options%stages(s)%install)) call check_list(options%stages(s)%install, 'install')
         if (allocated(options%stages(s)%remove)) call check_list(options%stages(s)%remove, 'remove')
      end do
      if (.not. messages%has_errors()) call report_unnamed(options, messages)   ! a misspelt name has its error already

   contains

      !> The names of one list.
      subroutine check_list(list, what)
         character(len=*), intent(in) :: list, what
         character(len=:), allocatable :: word
         integer :: i, k
         do k = 1, count_words(list)
            word = word_of(list, k)
            if (any([(same_name(known(i), word) .and. len_trim(known(i)) > 0, i=1, size(known))])) then
               i = stage_with(options%stages, word, installs=what == 'install')
               if (i < s) call messages%add(severity%error, '&stage: '//what//": '"//word//"' is there already in "// &
                  what//" of stage '"//stage_name(options%stages, i)//"': a support comes once, and goes once", &
                  at_word(options%stages(s)%origin, word))
               if (what == 'remove' .and. s <= max(1, stage_with(options%stages, word, installs=.true.))) &
                  call messages%add(severity%error, "&stage: remove: '"//word//"' is removed in stage '"// &
                                    stage_name(options%stages, s)//"', before it has been there in a step", &
                                    at_word(options%stages(s)%origin, word))
               cycle
            end if
            call messages%add(severity%error, &
               '&stage: '//what//": there is no &bolt '"//word//"' with a kind other "// &
                              "than 'spring', nor a &liner"//did_you_mean(word, known), &
                              at_word(options%stages(s)%origin, word))
         end do
      end subroutine check_list

   end subroutine check_stage_names

   !> Bolts and linings that no stage installs are there from the start: a warning where stages install others, a note
   !> where one excavates.
   subroutine report_unnamed(options, messages)
      type(run_options_type), intent(in) :: options
      type(diagnostics_type), intent(inout) :: messages
      character(len=:), allocatable :: why
      integer :: g, s, level
      why = ''
      do s = size(options%stages), 1, -1
         if (is_given(options%stages(s)%excavate)) why = ", before stage '"//stage_name(options%stages, s)// &
                                                         "' excavates"
      end do
      level = severity%note
      do s = size(options%stages), 1, -1
         if (.not. is_given(options%stages(s)%install)) cycle
         why = ", while stage '"//stage_name(options%stages, s)//"' installs others"
         level = severity%warning
      end do
      if (len(why) == 0) return
      do g = 1, size(options%bolts)
         if (is_spring(options%bolts(g))) cycle
         call report("bolt '", title_of_bolt(options%bolts(g), g), options%bolts(g)%origin)
      end do
      do g = 1, size(options%liners)
         call report("liner '", title_of_liner(options%liners(g), g), options%liners(g)%origin)
      end do

   contains

      !> One of them.
      subroutine report(what, name, origin)
         character(len=*), intent(in) :: what, name
         type(origin_type), intent(in) :: origin
         if (stage_with(options%stages, name, installs=.true.) > 0) return
         if (stage_with(options%stages, name, installs=.false.) > 0) return   ! a stage removes it: on purpose
         call messages%add(level, what//name//"' is named in install of no stage: it is there from the start"//why// &
                           '. Where that is meant, let the first stage install it', origin)
      end subroutine report

   end subroutine report_unnamed

end module rockdda_check_bolts
