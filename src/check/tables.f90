! SPDX-License-Identifier: MIT
!> Tables in time in stages that last until equilibrium: rows that pass while blocks come to rest, where a later stage
!> is dynamic, rows that are never reached, and boundaries that move for ever. Such a stage lasts while a table changes;
!> it does not wait for a table that changes later.
module rockdda_check_tables
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_base_strings, only : counted, to_string
   use rockdda_model_analysis_input, only : time_table_type
   use rockdda_model_options, only : is_set
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_stage_options, only : stage_name, seeks_equilibrium, stage_k01
   use rockdda_interaction_time_tables, only : table_changes, load_factor
   use rockdda_check_base_motion, only : warn_of_motion
   implicit none
   private
   public :: warn_of_tables, unreached_tables_text

   !> A table of a model, with its name for messages and its place.
   type :: named_table_type
      character(len=:), allocatable :: name
      real(wp), allocatable :: rows(:, :)        !! time first
      type(origin_type) :: origin
   end type named_table_type

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

end module rockdda_check_tables
