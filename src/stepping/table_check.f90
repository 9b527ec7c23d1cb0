! SPDX-License-Identifier: MIT
!> Tables in time in stages that last until equilibrium: rows that pass while blocks come to rest, where a later stage
!> is dynamic, and boundaries that move for ever.
module rockdda_stepping_table_check
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_base_strings, only : to_string
   use rockdda_model_analysis_input, only : time_table_type
   use rockdda_model_options, only : is_set
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_stage_options, only : stage_name, seeks_equilibrium, stage_k01
   use rockdda_interaction_time_tables, only : table_changes, load_factor
   use rockdda_stepping_motion_check, only : warn_of_motion
   implicit none
   private
   public :: warn_of_tables

contains

   !> Warn of motion that does not fit the run, of tables that run out in a stage until equilibrium, and of movements
   !> that let it have none.
   subroutine warn_of_tables(parameters, messages)
      type(parameters_type), intent(in) :: parameters
      type(diagnostics_type), intent(inout) :: messages
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
      call check_points('fixed point', parameters%fixed_tables)
      call check_points('loading point', parameters%loading_tables)
      if (allocated(parameters%line_loads)) then
         do i = 1, size(parameters%line_loads)
            associate (load => parameters%line_loads(i))
               if (table_changes(load%table, start)) &
                  call report('the table of &line_load '//to_string(i), load%table, load%origin)
            end associate
         end do
      end if
      if (allocated(parameters%water)) then
         do i = 1, size(parameters%water)
            associate (water => parameters%water(i))
               if (table_changes(water%level, start)) &
                  call report('the level of &water '//to_string(i), water%level, water%origin)
            end associate
         end do
      end if

   contains

      !> A boundary that moves at all times, or whose table runs out.
      subroutine check_boundary(g)
         integer, intent(in) :: g
         real(wp) :: factor
         associate (group => parameters%boundaries(g))
            factor = load_factor(group%table, huge(1.0_wp))
            if (group%kind == 'moving' .and. abs(factor) > 0) then
               if (any(abs(group%velocity) > 0)) then
                  call messages%add(severity%warning, '&boundary '//to_string(g)//' moves at all times, so that '// &
                                    "stage '"//stage_name(parameters%stages, first)//"' never comes to "// &
                                    'equilibrium: give the boundary a table that ends with 0, or the stage an '// &
                                    'until_time or a duration', group%origin)
                  return
               end if
            end if
            if (last > 0 .and. table_changes(group%table, start)) &
               call report('the table of &boundary '//to_string(g), group%table, group%origin)
         end associate
      end subroutine check_boundary

      !> Tables of fixed or loading points.
      subroutine check_points(what, tables)
         character(len=*), intent(in) :: what
         type(time_table_type), intent(in) :: tables(:)
         integer :: k
         do k = 1, size(tables)
            if (is_new(tables(k)%rows, tables(1:k - 1)%origin, tables(k)%origin)) &
               call report('the table of '//what//' '//to_string(k), tables(k)%rows, tables(k)%origin)
         end do
      end subroutine check_points

      !> Does a table change, and is it not that of a group of which another point has been reported?
      logical function is_new(rows, others, origin)
         real(wp), allocatable, intent(in) :: rows(:, :)
         type(origin_type), intent(in) :: others(:), origin
         integer :: k
         is_new = table_changes(rows, start)
         do k = 1, size(others)
            if (origin%line > 0 .and. others(k)%line == origin%line .and. others(k)%column == origin%column) &
               is_new = .false.
         end do
      end function is_new

      !> Warn of a table.
      subroutine report(what, rows, origin)
         character(len=*), intent(in) :: what
         real(wp), intent(in) :: rows(:, :)
         type(origin_type), intent(in) :: origin
         call messages%add(severity%warning, what//" counts from time 0 of the run and is over when stage '"// &
                           stage_name(parameters%stages, first)//"' ends, which lasts until equilibrium: stage '"// &
                           stage_name(parameters%stages, last)//"' begins with its last row, of time "// &
                           to_string(rows(1, size(rows, 2)), 5)//'. To let other rows act there, end the stage '// &
                           'before by until_time', origin)
      end subroutine report

   end subroutine warn_of_tables

end module rockdda_stepping_table_check
