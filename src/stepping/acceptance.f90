! SPDX-License-Identifier: MIT
!> The end of a step: its motion becomes the state of the blocks and of all that acts on them, and goes into the record.
module rockdda_stepping_acceptance
   use rockdda_base_kinds, only : wp
   use rockdda_base_phase_times, only : phase
   use rockdda_model_state, only : step_record_type
   use rockdda_contact_merging, only : merge_resting
   use rockdda_contact_table, only : contact_state
   use rockdda_interaction_block_forces, only : block_forces_type
   use rockdda_stepping_stage_equilibrium, only : varies_with_time
   use rockdda_stepping_ledger, only : ledger_type
   use rockdda_stepping_motion, only : move_blocks, measure_points
   use rockdda_stepping_sleep, only : fall_asleep
   use rockdda_stepping_stage_rest, only : watch_stage, moves_on
   use rockdda_stepping_step, only : step_type
   use rockdda_stepping_trial_step, only : trial_report_type
   implicit none
   private
   public :: accept_step, start_record

contains

   !> Take over a step: energies, states of all interactions, motion of the blocks, record.
   subroutine accept_step(step, report, ledger, forces, record)
      type(step_type), intent(inout) :: step
      type(trial_report_type), intent(in) :: report
      type(ledger_type), intent(inout) :: ledger
      type(block_forces_type), intent(inout) :: forces       !! on the blocks at the end of the step
      type(step_record_type), intent(inout) :: record
      real(wp), allocatable :: slip(:), before(:, :)
      real(wp) :: k01
      logical :: is_dynamic, is_static
      logical :: is_first   !! a dynamic part begins, if the step is one
      logical :: has_struck
      call take_attempt()
      k01 = step%control%k01(step%parameters)
      is_dynamic = step%control%is_dynamic(step%parameters)
      is_static = step%control%is_static(step%parameters)
      is_first = .not. step%control%time_error%counts
      associate (context => step%step_context_type, trial => step%trial, attempt => step%trial%attempt_type, &
                 families => step%families, contacts => step%families%contacts, impact => step%trial%impact)
         if (is_dynamic) call step%control%strikes%add(context, attempt, contacts%table, contacts%trial%state_used, &
                                                       contacts%laws%restitution, report%displacement/trial%dt, &
                                                       is_first)
         impact%happened = .false.
         if (.not. is_static) call impact%find(context, attempt, contacts%table, contacts%trial, contacts%settings, &
                                               contacts%laws, step%equations%x)
         if (impact%happened) then
            slip = contacts%trial%slip
            call families%predict(step%equations)
            call impact%keep_slip(slip, contacts%trial)
         end if
         has_struck = contacts%has_struck()
         call families%reach_end(context, attempt, step%equations)
         ledger%resting_energy = 0
         if (step%parameters%energy .and. allocated(trial%resting)) ledger%resting_energy = energy_at_rest(step)
         if (step%parameters%energy) call ledger%add_step(context, attempt, families, step%equations%x)
         call contacts%table%take_forces(step%contacts)
         call families%commit(context, attempt, step%equations%x)
         call step%control%time_error%add(context, attempt, step%equations%x, contacts%table, is_dynamic)
         before = step%state%acceleration
         call move()
         if (impact%happened) then
            call impact%finish(context, contacts%laws, contacts%table, contacts%trial, ledger%contact_energy)
            step%state%accelerates = .false.   ! the motion of the step is not that of its equations
         end if
         ! an end that struck leaves no acceleration behind: it would be thrown back faster than it came
         if (has_struck) step%state%accelerates = .false.
         if (step%parameters%energy) call ledger%close_step(context, attempt, families, k01, impact%happened)
         if (step%parameters%energy .and. is_dynamic) &
            call step%control%time_error%note_energies(is_first, record%energy, ledger%total)
      end associate
      call forces%clear(step%blocks%n_blocks)
      call step%families%add_forces(step%step_context_type, step%trial%attempt_type, forces)
      record%unbalanced = forces%unbalanced(step%state)
      call watch_stage(step, forces, record%unbalanced, report%displacement)
      call step%control%judge_balance(step%parameters, record%unbalanced, forces%driven, &
                                      moves_on(step, record%unbalanced, report%displacement, before))
      step%control%releases = step%families%held%is_releasing()
      if (step%control%is_static_search(step%parameters)) step%control%slip_share = &
         step%families%contacts%slip_share()
      step%state%velocity = k01*step%state%velocity
      if (.not. is_dynamic) call step%families%quiet%field%slow_down(k01)
      step%families%contacts%stiffness_is_new = .false.
      step%state%step = step%state%step + 1
      step%state%time = step%state%time + step%trial%dt
      call choose_next_dt()
      ! the table of this step becomes the last one; the old one is room for the next
      if (allocated(step%trial%resting)) then
         call merge_resting(step%families%contacts%table, step%trial%resting, step%contacts, step%room)
      else
         call step%contacts%exchange(step%families%contacts%table)
      end if
      call let_sleep()
      call fill_record()
      step%times%steps = step%times%steps + 1
      step%times%solver_iterations = step%times%solver_iterations + report%iterations
      call step%times%lap(phase%update)

   contains

      !> Let blocks at rest sleep in dynamic steps while all that acts on them stays as it is; wake them otherwise.
      subroutine let_sleep()
         logical :: may
         if (.not. step%parameters%sleeps) return
         may = is_dynamic .and. .not. (step%control%releases .or. forces%driven)
         ! equilibrium is asked for more exactly than blocks sleep
         may = may .and. .not. step%control%seeks_rest(step%parameters)
         may = may .and. all(step%families%contacts%laws%restitution < 0)
         if (allocated(step%parameters%water)) may = may .and. size(step%parameters%water) == 0
         if (may) may = .not. varies_with_time(step%parameters, step%blocks, step%state%active, &
             step%families%loads%line_blocks, step%state%time, step%control%motion_start)
         if (may) then
            call fall_asleep(step%step_context_type, step%trial%attempt_type, step%equations%x, step%contacts, forces, &
                             ledger)
         else
            step%state%asleep = .false.
            step%state%calm = 0
         end if
      end subroutine let_sleep

      !> The record of an accepted step; its unbalanced force is known.
      subroutine fill_record()
         record%step = step%state%step
         record%time = step%state%time
         record%dt = step%trial%dt
         record%open_close_iterations = report%rounds
         record%attempts = report%attempts
         record%solver_iterations = report%iterations
         record%max_displacement = report%displacement
         record%stage = step%control%stage_index()
         record%time_error = step%control%time_error%relative
         record%relaxation = step%families%held%relaxation(record%relaxation)
         if (step%parameters%energy) record%energy = ledger%total
         associate (states => step%contacts%state(1:step%contacts%n))
            record%contacts = [count(states == contact_state%open), count(states == contact_state%sliding), &
                               count(states == contact_state%locked)]
         end associate
         record%fixed_force = step%families%supports%force
         record%boundary_force = step%families%boundaries%force + step%families%quiet%force
         call measure_points(step%blocks, step%state, record)
         call record_bolts()
      end subroutine fill_record

      !> dt of the next step.
      subroutine choose_next_dt()
         logical :: may_grow
         may_grow = step%control%is_static_search(step%parameters)
         if (may_grow) may_grow = .not. varies_with_time(step%parameters, step%blocks, step%state%active, &
                                                         step%families%loads%line_blocks, step%state%time, &
                                                         step%control%motion_start)
         call step%control%accepted(step%parameters, step%trial%dt, report%displacement, report%shortened, k01, &
                                    report%rounds*report%attempts, may_grow)
         step%control%last_displacement = report%displacement
      end subroutine choose_next_dt

      !> Move the blocks. Accelerations are known afterwards when the scheme carries them, and in static steps: those
      !> that search equilibrium have their own, which the next one may carry on, others that of the last step, for the
      !> trend.
      subroutine move()
         associate (elasticity => step%families%elasticity, d => step%equations%x, control => step%control, &
                    trial => step%trial)
            if (trial%scheme%second_order) then
               call move_blocks(step%blocks, step%parameters, elasticity, trial%dt, d, step%state, trial%scheme, &
                                trial%jump)
            else
               if (control%is_static_search(step%parameters)) step%state%acceleration = &
                  (2/trial%dt**2)*(d - trial%dt*step%state%velocity)
               call move_blocks(step%blocks, step%parameters, elasticity, trial%dt, d, step%state)
            end if
            if (.not. is_static .or. control%is_static_search(step%parameters)) then
               control%trend%steps = 0
               control%trend%share = 0
            else
               call control%trend%follow(control%trend%steps > 0 .and. abs(trial%dt - control%last_dt) <= 0, trial%dt, &
                                         d, trial%last_motion, step%state%acceleration)
            end if
         end associate
         step%state%accelerates = step%trial%scheme%second_order
      end subroutine move

      !> Forces and energies of bolts, where some have nodes: springs first.
      subroutine record_bolts()
         real(wp) :: stored
         integer :: m, n
         m = size(step%families%bars%bolts)
         if (m == 0) return
         n = step%blocks%bolts%n
         if (.not. allocated(record%bolt_force)) allocate (record%bolt_force(n + m), record%bolt_head_force(n + m), &
                                                           record%bolt_dowel(n + m), source=0.0_wp)
         record%bolt_force(:n) = step%families%bolts%present_forces(step%step_context_type)
         record%bolt_head_force(:n) = record%bolt_force(:n)
         call step%families%bars%show_bolts(step%step_context_type, record%bolt_force(n + 1:), &
                                            record%bolt_head_force(n + 1:), record%bolt_dowel(n + 1:), stored)
         record%bolt_energy = [stored, step%families%bars%work]
      end subroutine record_bolts

      !> Take over what the attempt has found of the start of the step, and of blocks asleep.
      subroutine take_attempt()
         if (allocated(step%trial%acceleration)) call move_alloc(step%trial%acceleration, step%state%acceleration)
         step%state%asleep = step%trial%asleep
         step%state%calm = step%trial%calm
         step%control%cuts = step%control%cuts + report%cuts
      end subroutine take_attempt

   end subroutine accept_step

   !> Energy of the springs between resting blocks.
   pure real(wp) function energy_at_rest(step) result(total)
      type(step_type), intent(in) :: step
      integer :: c
      total = 0
      do c = 1, step%contacts%n
         if (step%trial%resting(step%contacts%block_a(c)) .and. step%trial%resting(step%contacts%block_b(c))) &
            total = total + step%contacts%energy(c)
      end do
   end function energy_at_rest

   !> The record at time 0.
   subroutine start_record(step, ledger, record)
      type(step_type), intent(in) :: step
      type(ledger_type), intent(in) :: ledger
      type(step_record_type), intent(out) :: record
      if (step%parameters%energy) record%energy = ledger%total
      associate (measured => step%blocks%measured, boundaries => step%families%boundaries)
         allocate (record%measured_displacement(2, measured%n), record%measured_stress(3, measured%n), &
                   record%fixed_force(2, step%blocks%fixed%n), record%boundary_force(2, size(boundaries%force, 2)), &
                   source=0.0_wp)
         allocate (record%measured_rotation(measured%n), source=0.0_wp)
      end associate
   end subroutine start_record

end module rockdda_stepping_acceptance
