! SPDX-License-Identifier: MIT
!> Does a static stage come to rest, does it move on, has it lost its equilibrium?
!>
!> While a load rises the model follows it with a lag: what inertia carries in a step, the resultants on the blocks,
!> does little work beside what the load has risen by. When the model can no longer follow, all that the load rises by
!> is left to inertia. So both works along the motion of the step are compared, whenever the way of the stage has
!> doubled: what inertia carries with what the load has risen by since the way was a quarter.
module rockdda_stepping_stage_rest
   use rockdda_base_kinds, only : wp
   use rockdda_model_state, only : radius_of_inertia
   use rockdda_interaction_block_forces, only : block_forces_type
   use rockdda_stepping_stage_watch, only : progress_type, stage_watch_type
   use rockdda_stepping_step, only : step_type
   use rockdda_stepping_verdict, only : apart, deformation_of, typical_size
   implicit none
   private
   public :: watch_stage, moves_on

   !> Ways beyond this share of a block's size and this multiple of what the model deforms by are no deformation.
   real(wp), parameter :: most_moved = 0.01_wp, most_deformed = 4.0_wp
   !> Pulls are compared at ways from this share of a block's size on. Steps between two comparisons.
   real(wp), parameter :: falls = 0.25_wp
   integer, parameter :: steps_between = 5
   !> Inertia carries more than this share of what the load has risen by: the model does not follow.
   real(wp), parameter :: much = 0.5_wp
   !> Motions below this number of roundings of the largest coordinate are none.
   real(wp), parameter :: roundings = 10.0_wp
   !> Single loose blocks, up to this share of all, may go on by forces that are small enough. Others move with them, by
   !> less than this multiple of what is no motion.
   real(wp), parameter :: few = 0.05_wp, little_motion = 10.0_wp
   !> Halvings of the time in which the load was lost.
   integer, parameter :: halvings = 40

contains

   !> Follow a static stage by an accepted step whose forces are known; blocks have moved, the time has not.
   subroutine watch_stage(step, forces, unbalanced, displacement)
      class(step_type), intent(inout) :: step
      type(block_forces_type), intent(in) :: forces    !! at the end of the step
      real(wp), intent(in) :: unbalanced
      real(wp), intent(in) :: displacement             !! largest of any vertex [length]
      logical :: stalls
      if (step%control%steps == 0) step%control%watch = stage_watch_type()
      step%control%watch%grown = step%control%watch%grown + displacement
      if (.not. step%control%is_static(step%parameters)) return
      if (forces%driven .or. step%control%watch%marks > 0) call watch_load(step, forces)
      associate (control => step%control, watch => step%control%watch)
         if (.not. control%is_static_search(step%parameters)) return
         if (forces%driven) then
            watch%progress = progress_type()
            watch%grown_before = watch%grown
            watch%grown_from = watch%grown
            watch%next_way = 0
            watch%least = huge(1.0_wp)
            watch%least_at_mark = huge(1.0_wp)
            return
         end if
         watch%least = min(watch%least, unbalanced)
         if (mod(watch%progress%steps, steps_between) == 0) call compare_pulls(step)
         stalls = watch%progress%stalls(unbalanced, step%parameters%stages(control%stage)%max_steps)
         if (watch%progress%least < huge(1.0_wp)) return
         if (stalls) watch%runs_away = watch%grown - watch%grown_before > beyond_deformation(step)
         watch%grown_before = watch%grown
      end associate
   end subroutine watch_stage

   !> Does the unbalanced force stay while the way grows by the factor `apart`, from a share of a block's size on? A
   !> search for a factor finds so that a block fails (rockdda_stepping_verdict); here it is the model as a whole.
   subroutine compare_pulls(step)
      class(step_type), intent(inout) :: step
      real(wp) :: way
      associate (watch => step%control%watch)
         way = watch%grown - watch%grown_from
         if (way < watch%next_way) return
         if (.not. watch%next_way > 0) then
            watch%next_way = max(falls*typical_size(step), beyond_deformation(step))
            return
         end if
         if (watch%least_at_mark < huge(1.0_wp) .and. 2*watch%least > watch%least_at_mark) watch%runs_away = .true.
         watch%least_at_mark = watch%least
         watch%next_way = apart*way
      end associate
   end subroutine compare_pulls

   !> A way that is no deformation [length].
   real(wp) function beyond_deformation(step) result(way)
      class(step_type), intent(in) :: step
      way = max(most_moved*typical_size(step), most_deformed*deformation_of(step, step%families%contacts%table))
   end function beyond_deformation

   !> Does a static step that ends in equilibrium leave the blocks a way to go, beside the way of the stage or what the
   !> model deforms by, if that is more? What is slender goes far by small forces.
   !>
   !> A static step is Euler's implicit one of M y' = F. With the ratio r of the resultants at its end to those before,
   !> in the mean over the work on its motion, what is left of the way is r/(1 - r) times its motion, however long the
   !> step is. Where the resultants do not fall no place of rest is known: then a step may move a few loose blocks, one
   !> that is no shorter than the last: shorter ones move blocks less, for any forces.
   logical function moves_on(step, unbalanced, displacement, before)
      class(step_type), intent(inout) :: step
      real(wp), intent(in) :: unbalanced
      real(wp), intent(in) :: displacement             !! largest of any vertex [length]
      real(wp), intent(in), contiguous :: before(:, :) !! (6, nb) acceleration at the end of the last step
      real(wp) :: small, r
      step%control%watch%restless = 0
      moves_on = step%control%is_static_search(step%parameters)
      if (.not. moves_on) return
      associate (tolerance => step%parameters%stages(step%control%stage)%tolerance)
         moves_on = .not. unbalanced > tolerance
         if (.not. moves_on) return
         ! blocks also move by the rounding of their positions
         small = max(tolerance*step%control%watch%grown, roundings*epsilon(1.0_wp)*maxval(abs(step%state%vertices)))
         r = decay(step, before)
         call judge_motion()
         if (.not. (moves_on .or. step%control%watch%restless > 0)) return
         small = max(small, tolerance*deformation_of(step, step%families%contacts%table))
         call judge_motion()
      end associate

   contains

      !> Is what is left of the way, or the motion of many blocks, more than is small?
      subroutine judge_motion()
         if (r < 1) then
            moves_on = displacement*max(r, 0.0_wp) > small*(1 - r)
         else
            call find_movers(step, little_motion*small, moves_on, step%control%watch%restless)
            moves_on = moves_on .or. step%trial%dt < step%control%last_dt
         end if
      end subroutine judge_motion

   end function moves_on

   !> Ratio of the resultants at the end of a static step to those of the last one, along its motion; 1 where
   !> they do not fall, or none is known; negative where the motion turns back.
   real(wp) function decay(step, before) result(r)
      class(step_type), intent(in) :: step
      real(wp), intent(in), contiguous :: before(:, :)   !! (6, nb)
      real(wp) :: work(2), inertia(3)
      integer :: i
      r = 1
      if (step%control%steps == 0) return
      work = 0
      do i = 1, step%blocks%n_blocks
         if (.not. step%state%active(i)) cycle
         inertia = step%state%mass(i)*[1.0_wp, 1.0_wp, radius_of_inertia(step%state, i)**2]
         associate (d => step%equations%x(1:3, i))
            work(1) = work(1) + dot_product(inertia*d, step%state%acceleration(1:3, i))
            work(2) = work(2) + dot_product(inertia*d, before(1:3, i))
         end associate
      end do
      if (work(2) > 0) r = min(work(1)/work(2), 1.0_wp)
      ! blocks go back and forth, by what contacts may miss their laws: they have no way to go
      if (work(2) < 0) r = work(1)/work(2)
   end function decay

   !> Which blocks have moved in a step?
   subroutine find_movers(step, small, are_many, most_moved)
      class(step_type), intent(in) :: step
      real(wp), intent(in) :: small          !! motion that does not count [length]
      logical, intent(out) :: are_many
      integer, intent(out) :: most_moved     !! the block that has moved most; 0: none has
      real(wp) :: motion, largest
      integer :: i, n
      n = 0
      most_moved = 0
      largest = small
      do i = 1, step%blocks%n_blocks
         if (.not. step%state%active(i)) cycle
         motion = norm2(step%equations%x(1:2, i))
         if (.not. motion > small) cycle
         n = n + 1
         if (.not. motion > largest) cycle
         largest = motion
         most_moved = i
      end do
      are_many = n > few*count(step%state%active)
   end subroutine find_movers

   !> Whenever the way has doubled: does the model follow the load?
   subroutine watch_load(step, forces)
      class(step_type), intent(inout) :: step
      type(block_forces_type), intent(in) :: forces
      real(wp) :: now, rise, excess, first, early, late, middle, last
      integer :: i
      associate (watch => step%control%watch)
         if (watch%is_lost .or. watch%grown < 2*watch%way .or. .not. watch%grown > 0) return
         if (watch%marks == 0) watch%times = step%state%time
         watch%way = watch%grown
         watch%marks = watch%marks + 1
         watch%times = [watch%times(2:3), step%state%time + step%trial%dt]
         excess = 0
         do i = 1, step%blocks%n_blocks
            if (forces%counts(i, step%state)) excess = excess + dot_product(forces%resultant(:, i), &
                                                                            step%equations%x(1:3, i))
         end do
         now = work_at(watch%times(3))
         rise = now - work_at(watch%times(1))
         ! when the load was that which the model carries
         early = step%control%first_time
         late = watch%times(3)
         do i = 1, halvings
            middle = 0.5_wp*(early + late)
            if (work_at(middle) < now - excess) then
               early = middle
            else
               late = middle
            end if
         end do
         watch%lost_time = max(watch%lost_time, early)
         if (watch%marks < 3 .or. .not. (rise > 0 .and. excess > much*rise)) return
         if (.not. watch%grown > beyond_deformation(step)) return
         watch%is_lost = .true.
         first = work_at(step%control%first_time)
         last = work_at(0.5_wp*huge(1.0_wp))
         if (abs(last - first) > 0) &
            watch%lost_share = max(0.0_wp, min(1.0_wp, (work_at(watch%lost_time) - first)/(last - first)))
      end associate

   contains

      !> Work of the loads of a time along the motion of the step.
      real(wp) function work_at(time) result(work)
         real(wp), intent(in) :: time
         type(block_forces_type) :: loads
         real(wp) :: present_time
         integer :: b
         call loads%clear(step%blocks%n_blocks)
         present_time = step%state%time
         step%state%time = time - step%trial%dt
         call step%families%loads%add_forces(step%step_context_type, step%trial%attempt_type, loads)
         call step%families%boundaries%tractions%add_forces(step%step_context_type, step%trial%attempt_type, loads)
         step%state%time = present_time
         work = 0
         do b = 1, step%blocks%n_blocks
            work = work + dot_product(loads%resultant(:, b), step%equations%x(1:3, b))
         end do
      end function work_at

   end subroutine watch_load

end module rockdda_stepping_stage_rest
