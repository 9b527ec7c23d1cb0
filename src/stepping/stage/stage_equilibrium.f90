! SPDX-License-Identifier: MIT
!> Equilibrium of a stage: what may grow, and the error of a stage that does not come to rest.
module rockdda_stepping_stage_equilibrium
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_strings, only : to_string, counted
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_stage_options, only : stage_name, confirming_steps
   use rockdda_model_state, only : block_state_type
   use rockdda_interaction_block_forces, only : block_forces_type
   use rockdda_interaction_joint_response, only : round_off
   use rockdda_interaction_time_tables, only : table_changes
   implicit none
   private
   public :: varies_with_time, base_moves, report_no_equilibrium

   !> Largest number of blocks in a message.
   integer, parameter :: most_listed = 10

contains

   !> Do loads or supports of active blocks still change at a time? Steps are then no longer than dt_max.
   pure logical function varies_with_time(parameters, blocks, active, line_blocks, time, motion_start) result(varies)
      type(parameters_type), intent(in) :: parameters
      type(block_system_type), intent(in) :: blocks
      logical, intent(in) :: active(:)          !! (nb)
      integer, intent(in) :: line_blocks(:)     !! blocks that carry the line loads
      real(wp), intent(in) :: time
      real(wp), intent(in) :: motion_start      !! of the base; huge: not in this stage
      integer :: i
      varies = .false.
      do i = 1, size(parameters%fixed_tables)
         if (active(blocks%fixed%block(i))) varies = varies .or. table_changes(parameters%fixed_tables(i)%rows, time)
      end do
      do i = 1, size(parameters%loading_tables)
         if (active(blocks%loading%block(i))) varies = varies .or. &
                                                       table_changes(parameters%loading_tables(i)%rows, time)
      end do
      do i = 1, size(parameters%line_loads)
         if (active(line_blocks(i))) varies = varies .or. table_changes(parameters%line_loads(i)%table, time)
      end do
      if (allocated(parameters%boundaries)) then
         do i = 1, size(parameters%boundaries)
            varies = varies .or. table_changes(parameters%boundaries(i)%table, time)
         end do
      end if
      varies = varies .or. base_moves(parameters, time, motion_start)
   end function varies_with_time

   !> Does the motion of the base still change at a time?
   pure logical function base_moves(parameters, time, motion_start)
      type(parameters_type), intent(in) :: parameters
      real(wp), intent(in) :: time
      real(wp), intent(in) :: motion_start      !! huge: it has not begun
      integer :: i
      base_moves = .false.
      if (motion_start > time) return
      base_moves = table_changes(parameters%base%table, time - motion_start)
      if (allocated(parameters%quakes)) then
         do i = 1, size(parameters%quakes)
            associate (rows => parameters%quakes(i)%rows)
               base_moves = base_moves .or. time - motion_start < rows(1, size(rows, 2))
            end associate
         end do
      end if
      if (allocated(parameters%base%harmonics)) base_moves = base_moves .or. size(parameters%base%harmonics, 2) > 0
   end function base_moves

   !> The error of a stage that has had all its steps: its name, how far it is from equilibrium, and the blocks that are
   !> pushed most.
   subroutine report_no_equilibrium(parameters, stage, steps, state, forces, unbalanced, stiffest, error)
      type(parameters_type), intent(in) :: parameters
      integer, intent(in) :: stage
      integer, intent(in) :: steps              !! of the stage
      type(block_state_type), intent(in) :: state
      type(block_forces_type), intent(in) :: forces
      real(wp), intent(in) :: unbalanced
      real(wp), intent(in) :: stiffest          !! contact spring [force/length]
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: share(:)
      real(wp) :: rounding
      character(len=:), allocatable :: text
      integer :: i, k, n
      associate (options => parameters%stages(stage))
         text = "stage '"//stage_name(parameters%stages, stage)//"' did not come to equilibrium in "// &
                counted(steps, 'step')//': the unbalanced force is '//to_string(unbalanced, 3)// &
                ' of the mean force, tolerance '//to_string(options%tolerance)
         if (unbalanced <= options%tolerance) text = text//'; so it must be in '//to_string(confirming_steps)// &
            ' steps in a row'
         allocate (share(size(forces%magnitude)), source=0.0_wp)
         do i = 1, size(share)
            if (forces%counts(i, state)) share(i) = forces%force_of(i, state)
         end do
         share = share/max(forces%mean_magnitude(state), tiny(1.0_wp))
         n = count(share > options%tolerance)
         if (n > 0) text = text//new_line('a')//'  '//counted(n, 'block')// &
            trim(merge(' still moves: ', ' still move:  ', n == 1))
         do i = 1, min(n, most_listed)
            k = maxloc(share, dim=1)
            text = text//trim(merge('  ', ', ', i == 1))//' block '//to_string(k)//' at ('// &
                   to_string(state%centroid(1, k) + state%datum(1), 5)//', '// &
                   to_string(state%centroid(2, k) + state%datum(2), 5)//')'
            share(k) = 0
         end do
         if (n > most_listed) text = text//', ...'
         if (steps < options%max_steps) text = text//new_line('a')//'  they run away: the unbalanced force has not '// &
            'fallen to half while they moved on'
      end associate
      ! positions are as wrong as their rounding, and gaps as lengths that count as none; forces by that times the
      ! stiffness
      rounding = stiffest*max(epsilon(1.0_wp)*maxval(abs(state%vertices)), round_off*parameters%w0)/ &
                 max(forces%mean_magnitude(state), tiny(1.0_wp))
      if (rounding > 0.1_wp*parameters%stages(stage)%tolerance) text = text//new_line('a')// &
         '  the contacts are so stiff that the rounding of positions makes '//to_string(rounding, 2)// &
         ' of the mean force: take a smaller stiffness, or a larger tolerance'
      if (steps >= parameters%stages(stage)%max_steps) text = text//new_line('a')// &
         "  give more max_steps, or on_failure = 'continue' to go on with the next stage"
      call make_error(error, error_code%computation, text)
   end subroutine report_no_equilibrium

end module rockdda_stepping_stage_equilibrium
