! SPDX-License-Identifier: MIT
!> Motion of the base that does not fit the run: &quake and &load base_acceleration.
module rockdda_check_base_motion
   use rockdda_base_kinds, only : wp, pi
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_base_strings, only : to_string
   use rockdda_model_options, only : quake_type, is_set
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_quake_options, only : acts_as
   use rockdda_model_stage_options, only : is_given, stage_number
   use rockdda_interaction_ground_motion, only : ground_motion_type
   use rockdda_interaction_time_tables, only : table_value
   implicit none
   private
   public :: check_motion, warn_of_motion, warn_of_harmonics

   !> Largest acceleration that is no slip, over that of gravity: the largest recorded in an earthquake is 4.4 g.
   real(wp), parameter :: most_gravities = 5.0_wp
   !> Acceleration of gravity [m/s^2], where a record names its unit and the model has no weight.
   real(wp), parameter :: gravity_of_records = 9.81_wp
   !> A phase of a turn is rounded by less.
   real(wp), parameter :: rounding_of_turn = 1.0e-3_wp
   !> Velocity of the ground at the start that is rounding, over the largest of the record.
   real(wp), parameter :: rounding = 1.0e-9_wp

contains

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

end module rockdda_check_base_motion
