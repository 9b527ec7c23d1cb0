! SPDX-License-Identifier: MIT
!> Tables in time in stages that last until equilibrium: rows that pass while blocks come to rest, where a later stage
!> is dynamic, rows that are never reached, and boundaries that move for ever. Such a stage lasts while a table changes;
!> it does not wait for a table that changes later.
!>
!> Motion of the base that does not fit the run: &quake and &load base_acceleration.
module rockdda_check_tables
   use rockdda_base_kinds, only : wp, pi
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_base_strings, only : counted, to_string
   use rockdda_model_analysis_input, only : time_table_type
   use rockdda_model_options, only : is_set, quake_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_stage_options, only : stage_name, seeks_equilibrium, stage_k01, is_given, stage_number
   use rockdda_interaction_time_tables, only : table_changes, load_factor, table_value
   use rockdda_model_quake_options, only : acts_as
   use rockdda_interaction_ground_motion, only : ground_motion_type
   implicit none
   private
   public :: warn_of_tables, unreached_tables_text, check_motion, warn_of_harmonics

   !> A table of a model, with its name for messages and its place.
   type :: named_table_type
      character(len=:), allocatable :: name
      real(wp), allocatable :: rows(:, :)        !! time first
      type(origin_type) :: origin
   end type named_table_type

   !> Largest acceleration that is no slip, over that of gravity: the largest recorded in an earthquake is 4.4 g.
   real(wp), parameter :: most_gravities = 5.0_wp
   !> Acceleration of gravity [m/s^2], where a record names its unit and the model has no weight.
   real(wp), parameter :: gravity_of_records = 9.81_wp
   !> A phase of a turn is rounded by less.
   real(wp), parameter :: rounding_of_turn = 1.0e-3_wp
   !> Velocity of the ground at the start that is rounding, over the largest of the record.
   real(wp), parameter :: rounding = 1.0e-9_wp

contains

   !> Warn of motion that does not fit the run, of tables that run out in a stage until equilibrium, and of movements
   !> that let it have none.
   subroutine warn_of_tables(parameters, messages)
      type(parameters_type), intent(in) :: parameters
      type(diagnostics_type), intent(inout) :: messages
      type(named_table_type), allocatable :: tables(:)
      real(wp) :: start             !! of the first such stage, at the earliest [time]
      integer :: i, first, last     !! `last`: the first dynamic stage after it, 0: none
      call warn_of_motion(parameters, messages)
      if (.not. allocated(parameters%stages)) return
      associate (stages => parameters%stages)
         first = 0
         start = 0
         do i = 1, size(stages)
            if (seeks_equilibrium(stages(i))) then
               first = i
               exit
            else if (is_set(stages(i)%until_time)) then
               start = max(start, stages(i)%until_time)
            else if (is_set(stages(i)%duration)) then
               start = start + stages(i)%duration
            end if
         end do
         if (first == 0) return
         last = 0
         do i = size(stages), first + 1, -1
            if (stage_k01(stages(i), parameters%k01) > 0) last = i
         end do
      end associate
      if (allocated(parameters%boundaries)) then
         do i = 1, size(parameters%boundaries)
            call check_boundary(i)
         end do
      end if
      if (last == 0) return
      tables = tables_of(parameters)
      do i = 1, size(tables)
         if (table_changes(tables(i)%rows, start)) call report(tables(i))
      end do

   contains

      !> A boundary that moves at all times.
      subroutine check_boundary(g)
         integer, intent(in) :: g
         associate (group => parameters%boundaries(g))
            if (group%kind /= 'moving') return
            if (.not. any(abs(group%velocity) > 0)) return
            if (.not. abs(load_factor(group%table, huge(1.0_wp))) > 0) return
            ! it stands while the stage may come to equilibrium
            if (first_change(group%table, start) > start .and. .not. abs(load_factor(group%table, start)) > 0) return
            call messages%add(severity%warning, '&boundary '//to_string(g)//' moves at all times, so that '// &
                              "stage '"//stage_name(parameters%stages, first)//"' never comes to "// &
                              'equilibrium: give the boundary a table that ends with 0, or the stage an '// &
                              'until_time or a duration', group%origin)
         end associate
      end subroutine check_boundary

      !> Warn of a table.
      subroutine report(table)
         type(named_table_type), intent(in) :: table
         character(len=:), allocatable :: text
         real(wp) :: change
         change = first_change(table%rows, start)
         if (change > start) then
            text = " counts from time 0 of the run, and stage '"//stage_name(parameters%stages, first)// &
                   "', which lasts until equilibrium, does not wait for its first change at time "// &
                   parameters%shown(change, 'time', 5)// &
                   '. To let it act in a stage of its own, end the stage before by until_time'
         else
            text = " counts from time 0 of the run and is over when stage '"//stage_name(parameters%stages, first)// &
                   "' ends, which lasts until equilibrium: stage '"//stage_name(parameters%stages, last)// &
                   "' begins with its last row, of time "// &
                   parameters%shown(table%rows(1, size(table%rows, 2)), 'time', 5)// &
                   '. To let other rows act there, end the stage before by until_time'
         end if
         call messages%add(severity%warning, table%name//text, table%origin)
      end subroutine report

   end subroutine warn_of_tables

   !> Name the tables that change after the end of a run. Empty: no table does, or the model gives the end of the run.
   function unreached_tables_text(parameters, step, time) result(text)
      type(parameters_type), intent(in) :: parameters
      integer, intent(in) :: step                !! the last one
      real(wp), intent(in) :: time               !! of the end
      character(len=:), allocatable :: text
      type(named_table_type), allocatable :: tables(:)
      integer :: i, n
      text = ''
      if (.not. allocated(parameters%stages)) return
      if (.not. any([(seeks_equilibrium(parameters%stages(i)), i=1, size(parameters%stages))])) return
      associate (last => parameters%stages(size(parameters%stages)))
         if (is_set(last%until_time) .or. is_set(last%until_step)) return
      end associate
      if (step >= parameters%n_steps .or. (parameters%t_end > 0 .and. time >= parameters%t_end)) return
      tables = tables_of(parameters)
      n = 0
      do i = 1, size(tables)
         if (.not. table_changes(tables(i)%rows, time)) cycle
         n = n + 1
         if (n > 1) cycle
         text = tables(i)%name
         if (tables(i)%origin%line > 0) text = text//' ('//tables(i)%origin%file//':'// &
                                               to_string(tables(i)%origin%line)//')'
         text = text//' was used up to time '//parameters%shown(time, 'time', 5)//' of '// &
                parameters%shown(tables(i)%rows(1, size(tables(i)%rows, 2)), 'time', 5)
      end do
      if (n == 0) return
      if (n > 1) text = text//', and '//counted(n - 1, 'more table')//' too'
      text = text//': the run ended before, since stages until equilibrium do not wait for a table that changes '// &
             'later: end them by until_time'
   end function unreached_tables_text

   !> Time from which a table changes, at the earliest `start`; huge: it does not.
   pure real(wp) function first_change(rows, start) result(time)
      real(wp), allocatable, intent(in) :: rows(:, :)    !! time first; may be unallocated
      real(wp), intent(in) :: start
      integer :: k
      time = huge(1.0_wp)
      if (.not. allocated(rows)) return
      do k = size(rows, 2), 2, -1
         if (rows(1, k) > start .and. any(abs(rows(2:, k) - rows(2:, k - 1)) > 0)) time = max(start, rows(1, k - 1))
      end do
   end function first_change

   !> All tables of loads and supports; the last ones may have no rows. Of points with one place, a group's, the first.
   function tables_of(parameters) result(tables)
      type(parameters_type), intent(in) :: parameters
      type(named_table_type), allocatable :: tables(:)
      integer :: i, n
      n = size(parameters%fixed_tables) + size(parameters%loading_tables)
      if (allocated(parameters%boundaries)) n = n + size(parameters%boundaries)
      if (allocated(parameters%line_loads)) n = n + size(parameters%line_loads)
      if (allocated(parameters%water)) n = n + size(parameters%water)
      allocate (tables(n))
      n = 0
      if (allocated(parameters%boundaries)) then
         do i = 1, size(parameters%boundaries)
            associate (group => parameters%boundaries(i))
               call add('the table of &boundary ', i, group%table, group%origin)
            end associate
         end do
      end if
      call add_points('the table of fixed point ', parameters%fixed_tables)
      call add_points('the table of loading point ', parameters%loading_tables)
      if (allocated(parameters%line_loads)) then
         do i = 1, size(parameters%line_loads)
            associate (load => parameters%line_loads(i))
               call add('the table of &line_load ', i, load%table, load%origin)
            end associate
         end do
      end if
      if (allocated(parameters%water)) then
         do i = 1, size(parameters%water)
            associate (water => parameters%water(i))
               call add('the level of &water ', i, water%level, water%origin)
            end associate
         end do
      end if

   contains

      !> Tables of fixed or loading points.
      subroutine add_points(what, of_points)
         character(len=*), intent(in) :: what
         type(time_table_type), intent(in) :: of_points(:)
         integer :: k
         do k = 1, size(of_points)
            associate (origin => of_points(k)%origin)
               if (origin%line > 0 .and. any(of_points(1:k - 1)%origin%line == origin%line .and. &
                                             of_points(1:k - 1)%origin%column == origin%column)) cycle
               call add(what, k, of_points(k)%rows, origin)
            end associate
         end do
      end subroutine add_points

      !> A table, where there is one.
      subroutine add(what, number, rows, origin)
         character(len=*), intent(in) :: what
         integer, intent(in) :: number
         real(wp), allocatable, intent(in) :: rows(:, :)
         type(origin_type), intent(in) :: origin
         if (.not. allocated(rows)) return
         n = n + 1
         tables(n)%name = what//to_string(number)
         tables(n)%rows = rows
         tables(n)%origin = origin
      end subroutine add

   end function tables_of

   !> Report records that leave the ground in motion at their time 0, at which the blocks rest, or that end before it.
   subroutine check_motion(parameters, messages)
      type(parameters_type), intent(in) :: parameters
      type(diagnostics_type), intent(inout) :: messages
      character(len=:), allocatable :: apply, title
      type(quake_type), allocatable :: one(:)
      type(ground_motion_type) :: ground
      real(wp) :: v(2)
      integer :: i, n
      if (.not. allocated(parameters%quakes)) return
      do i = 1, size(parameters%quakes)
         associate (quake => parameters%quakes(i))
            if (.not. allocated(quake%rows)) cycle
            n = size(quake%rows, 2)
            if (n < 2) cycle
            title = '&quake '//to_string(i)
            if (quake%rows(1, n) <= 0) then
               call messages%add(severity%error, title//': the record ends at t = '// &
                                 parameters%shown(quake%rows(1, n), 'time', 5)// &
                                 ', before the motion begins (t = 0): shift its times', quake%origin)
               cycle
            end if
            if (.not. quake%rows(1, 1) < 0 .or. acts_as(quake, 'base_acceleration')) cycle
            apply = 'base_motion'
            if (acts_as(quake, 'viscous_base')) apply = 'viscous_base'
            one = [quake]
            call ground%init(one)
            v = ground%velocity(apply, 0.0_wp)
            if (maxval(abs(v)) <= rounding*ground%largest_velocity()) cycle
            call messages%add(severity%error, title//': the record begins at t = '// &
                              parameters%shown(quake%rows(1, 1), 'time', 5)// &
                              ', and at t = 0, when the blocks are at rest, the ground would move at '// &
                              parameters%shown(maxval(abs(v)), 'length/time')//': cut the record there '// &
                              '(rockdda-post record '//quake%file//' --from 0 --write CUT.csv) or shift its times', &
                              quake%origin)
         end associate
      end do
   end subroutine check_motion

   !> Warn of motion that does not act as it stands there, and of one that no earthquake has.
   subroutine warn_of_motion(parameters, messages)
      type(parameters_type), intent(in) :: parameters
      type(diagnostics_type), intent(inout) :: messages
      type(origin_type) :: nowhere
      real(wp) :: gravity, g, span
      integer :: i
      gravity = parameters%acceleration_of_gravity()
      span = longest_motion(parameters)
      call warn_of_jumps()
      if (allocated(parameters%base%table)) call warn(parameters%base%table, 1.0_wp, gravity, &
                                                      'the table of base_acceleration', .true., nowhere)
      if (.not. allocated(parameters%quakes)) return
      do i = 1, size(parameters%quakes)
         associate (quake => parameters%quakes(i))
            if (.not. allocated(quake%rows)) cycle
            g = gravity
            if (.not. g > 0 .and. quake%unit > 0) g = gravity_of_records*quake%scale/quake%unit
            call warn(quake%rows, quake%scale, g, 'the record of &quake '//to_string(i), &
                      acts_as(quake, 'base_acceleration'), quake%origin)
         end associate
      end do

   contains

      !> Warn of fixed points that are not where they stand at time 0.
      subroutine warn_of_jumps()
         real(wp) :: u(2)
         integer :: k
         if (.not. allocated(parameters%fixed_tables)) return
         do k = 1, size(parameters%fixed_tables)
            associate (table => parameters%fixed_tables(k))
               if (.not. allocated(table%rows)) cycle
               if (size(table%rows, 2) == 0) cycle
               u = table_value(table%rows, 0.0_wp)
               if (.not. any(abs(u) > 0)) cycle
               call messages%add(severity%warning, 'the table of fixed point '//to_string(k)//' gives a displace'// &
                                 'ment of '//parameters%shown(u(1), 'length')//', '// &
                                 parameters%shown(u(2), 'length')//' at time 0: the '// &
                                 'point jumps there in the first step; begin with 0, 0', table%origin)
               return
            end associate
         end do
      end subroutine warn_of_jumps

      !> Warn of one table.
      subroutine warn(rows, scale, g, what, is_load, origin)
         real(wp), intent(in) :: rows(:, :)        !! time first
         real(wp), intent(in) :: scale
         real(wp), intent(in) :: g                 !! 0: unknown
         character(len=*), intent(in) :: what
         logical, intent(in) :: is_load            !! rows before t = 0 do not act
         type(origin_type), intent(in) :: origin
         real(wp) :: largest
         integer :: n
         n = size(rows, 2)
         if (n == 0) return
         largest = abs(scale)*maxval(abs(rows(2:, :)))
         if (rows(1, 1) >= span) call messages%add(severity%warning, what//' begins at t = '// &
            parameters%shown(rows(1, 1), 'time', 5)//', and the run ends '//parameters%shown(span, 'time', 5)// &
            ' after the motion has begun: it does not act', origin)
         if (rows(1, 1) < 0 .and. is_load) call messages%add(severity%warning, what//' begins at t = '// &
            parameters%shown(rows(1, 1), 'time', 5)//': what it does before t = 0 does not act', origin)
         if (g > 0 .and. largest > most_gravities*g) call messages%add(severity%warning, what//' reaches '// &
            to_string(largest/g, 3)//' times the acceleration of gravity ('// &
            parameters%shown(largest, 'length/time^2')//'), as no '// &
            'earthquake has: is the unit of its values that of the model (scale)?', origin)
      end subroutine warn

   end subroutine warn_of_motion

   !> Warn of harmonic terms that no earthquake has, and of phases in degrees.
   subroutine warn_of_harmonics(parameters, origin, messages)
      type(parameters_type), intent(in) :: parameters
      type(origin_type), intent(in) :: origin      !! of the terms
      type(diagnostics_type), intent(inout) :: messages
      real(wp) :: g, largest
      integer :: i
      if (.not. allocated(parameters%base%harmonics)) return
      g = parameters%acceleration_of_gravity()
      do i = 1, size(parameters%base%harmonics, 2)
         associate (term => parameters%base%harmonics(:, i))
            largest = maxval(abs(term(1:2)))
            if (g > 0 .and. largest > most_gravities*g) call messages%add(severity%warning, 'harmonic: '// &
               parameters%shown(largest, 'length/time^2')//' of term '//to_string(i)//' is '// &
               to_string(largest/g, 3)//' times the acceleration of gravity, as no earthquake has: is its unit '// &
               'that of the model?', origin)
            if (abs(term(4)) > 2*pi*(1 + rounding_of_turn)) call messages%add(severity%warning, 'harmonic: phase '// &
               to_string(term(4))//' of term '//to_string(i)//' is in rad, where a turn is 2 pi = 6.283: is it in '// &
               'degrees? ('//to_string(term(4))//' degrees are '//to_string(term(4)*pi/180, 4)//' rad)', origin)
         end associate
      end do
   end subroutine warn_of_harmonics

   !> Longest time from the start of the motion to the end of the run.
   pure real(wp) function longest_motion(parameters) result(span)
      type(parameters_type), intent(in) :: parameters
      real(wp) :: start, time        !! of the motion at the earliest; of the end of a stage
      integer :: i, first
      span = parameters%t_end
      if (parameters%n_steps < huge(1)) span = min(span, parameters%n_steps*parameters%dt_max)
      if (.not. allocated(parameters%stages)) return
      first = 1
      if (is_given(parameters%base%stage)) first = max(1, stage_number(parameters%stages, parameters%base%stage))
      start = 0
      time = 0
      do i = 1, size(parameters%stages)
         if (i == first) start = time
         associate (stage => parameters%stages(i))
            if (is_set(stage%until_time)) then
               time = max(time, stage%until_time)
            else if (is_set(stage%duration)) then
               time = time + stage%duration
            else if (i >= first) then
               time = huge(1.0_wp)
               exit
            end if
         end associate
      end do
      if (parameters%ends_with_stages) span = min(span, time)
      if (span < huge(1.0_wp)) span = span - start
   end function longest_motion

end module rockdda_check_tables
