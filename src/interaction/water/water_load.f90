! SPDX-License-Identifier: MIT
!> Loads of the pressure of water on stretches of edges.
!>
!> The pressure is that of the place of the edge in the middle of the step, by the motion that is expected of the block
!> (an oscillation in water gains no energy by that), and of the level of the table at the end of the step.
module rockdda_interaction_water_load
   use rockdda_base_kinds, only : wp
   use rockdda_base_parallel, only : parallel_blocks
   use rockdda_interaction_attempt, only : attempt_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_finite_rotation, only : moving_block_type, new_moving_block, mean_load, mean_displacement
   use rockdda_interaction_water_edges, only : edge_stretch_type
   use rockdda_interaction_water_pressure, only : water_pressure_type, water_scratch_type, rise_of
   implicit none
   private
   public :: find_loads

contains

   !> Loads of all stretches: for the motion that is expected of their blocks, for another motion, or, with `at_rest`,
   !> for none. Zero where no group wets the stretch, or its block is not there.
   subroutine find_loads(stretches, group, pressure, context, attempt, loads, motion, at_rest)
      type(edge_stretch_type), intent(in) :: stretches(:)
      integer, intent(in) :: group(:)                     !! that wets each stretch, 0: none does
      type(water_pressure_type), intent(in) :: pressure(:)   !! (groups)
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      real(wp), intent(out), contiguous :: loads(:, :)    !! (6, stretches)
      real(wp), intent(in), contiguous, optional :: motion(:, :)   !! (6, nb)
      logical, intent(in), optional :: at_rest
      type(water_scratch_type) :: scratch
      type(moving_block_type) :: block
      real(wp) :: rises(size(pressure)), d(6)
      integer :: i
      logical :: is_given
      d = 0
      is_given = present(motion) .or. present(at_rest)
      rises = all_rises(context, attempt, size(pressure))
      !$omp parallel do default(none) shared(stretches, group, pressure, context, attempt, loads) &
      !$omp shared(motion, is_given, rises) &
      !$omp private(i, block, scratch) firstprivate(d) schedule(static) if (size(stretches) > parallel_blocks)
      do i = 1, size(stretches)
         associate (b => stretches(i)%block)
            loads(:, i) = 0
            if (group(i) == 0 .or. .not. context%state%active(b)) cycle
            if (present(motion)) d = motion(:, b)
            if (is_given) then
               block = new_moving_block(context%state%centroid(:, b), d)
            else
               block = attempt%moving(b)
            end if
            call find_load(stretches(i), pressure(group(i)), rises(group(i)), context, block, scratch, loads(:, i))
         end associate
      end do
      !$omp end parallel do
   end subroutine find_loads

   !> Rises of the tables of all groups at the end of the step.
   pure function all_rises(context, attempt, n) result(rises)
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      integer, intent(in) :: n          !! groups
      real(wp) :: rises(n)
      integer :: g
      do g = 1, n
         rises(g) = rise_of(context%parameters%water(g), attempt%load_time(context))
      end do
   end function all_rises

   !> Load of the pressure on a stretch, at the place that it has in the middle of the step.
   pure subroutine find_load(stretch, pressure, rise, context, block, scratch, load)
      type(edge_stretch_type), intent(in) :: stretch
      type(water_pressure_type), intent(in) :: pressure
      real(wp), intent(in) :: rise                    !! of the table [length]
      type(step_context_type), intent(in) :: context
      type(moving_block_type), intent(in) :: block    !! with the motion of the step
      type(water_scratch_type), intent(inout) :: scratch
      real(wp), intent(out) :: load(6)
      real(wp) :: p(2), q(2), normal(2), shares(2)
      load = 0
      associate (start => context%state%vertices(:, stretch%vertices))
         p = start(:, 1) + 0.5_wp*mean_displacement(block%d, start(:, 1), block)
         q = start(:, 2) + 0.5_wp*mean_displacement(block%d, start(:, 2), block)
         call pressure%end_shares(p + context%state%datum, q + context%state%datum, stretch%ends, rise, scratch, &
                                  shares)
         if (.not. any(abs(shares) > 0)) return
         ! outward, as long as the edge
         normal = [q(2) - p(2), p(1) - q(1)]
         load = mean_load(-shares(1)*normal, start(:, 1), block) + mean_load(-shares(2)*normal, start(:, 2), block)
      end associate
   end subroutine find_load

end module rockdda_interaction_water_load
