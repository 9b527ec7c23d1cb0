! SPDX-License-Identifier: MIT
!> Validate facts and state of a checkpoint, whose model has been checked (rockdda_io_checkpoint_model_check).
module rockdda_io_checkpoint_state_check
   use rockdda_base_kinds, only : wp
   use rockdda_contact_corners, only : corner_station
   use rockdda_contact_table, only : contact_table_type
   use rockdda_model_blocks, only : block_system_type, largest_coordinate
   use rockdda_model_options, only : most_threads
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_state, only : block_state_type, step_record_type
   use rockdda_stepping_control, only : step_control_type
   use rockdda_stepping_ledger, only : ledger_type
   use rockdda_stepping_simulation, only : simulation_type
   use rockdda_stepping_trend, only : steps_of_trend
   use rockdda_io_checkpoint, only : checkpoint_facts_type
   use rockdda_io_construction_check, only : construction_problem
   use rockdda_base_value_check, only : value_check_type
   implicit none
   private
   public :: facts_problem, state_problem

   !> Largest count of steps and of attempts: far more than a run makes, and far below the largest integer.
   integer, parameter :: most_counted = 2**30

contains

   !> Facts about the run. `results_ending` becomes part of a path.
   function facts_problem(facts) result(problem)
      type(checkpoint_facts_type), intent(in) :: facts
      character(len=:), allocatable :: problem
      type(value_check_type) :: check
      check%group = 'input'
      call check%is_there(allocated(facts%header%geometry), 'geometry')
      call check%is_there(allocated(facts%header%analysis), 'analysis')
      call check%is_there(allocated(facts%header%config), 'config')
      call check%is_there(allocated(facts%model_file), 'model_file')
      call check%is_there(allocated(facts%analysis_file), 'analysis_file')
      call check%is_there(allocated(facts%config_file), 'config_file')
      check%group = 'results'
      call check%is_there(allocated(facts%header%title), 'title')
      call check%is_there(allocated(facts%header%created), 'created')
      call check%is_there(allocated(facts%written), 'written')
      call check%is_there(allocated(facts%results_ending), 'ending')
      if (check%passed()) then
         associate (ending => facts%results_ending)
            call check%holds(any(ending == [character(len=5) :: '', '.h5', '.hdf5', '.hdf']) .and. &
                             len(ending) == len_trim(ending), 'ending')
         end associate
      end if
      call check%holds(facts%rows%steps >= 0 .and. facts%rows%steps < huge(1), 'history_rows')
      call check%holds(facts%rows%frames >= 0 .and. facts%rows%frames <= facts%rows%steps + 1, 'frame_rows')
      call check%holds(facts%rows%contacts >= 0, 'contact_rows')
      call check%holds(facts%frame_every >= 0, 'frame_every')
      call check%holds(facts%frame_interval >= 0 .and. facts%frame_interval <= huge(1.0_wp), 'frame_interval')
      call check%holds(facts%frames_passed >= 0, 'frames_passed')
      call check%holds(facts%last_frame >= -1 .and. facts%last_frame <= facts%rows%steps, 'last_frame')
      call check%holds(facts%threads >= 0 .and. facts%threads <= most_threads, 'threads')
      call check%holds(facts%checkpoint_every > 0 .and. facts%checkpoint_every <= huge(1.0_wp), 'checkpoint_every')
      problem = check%problem()
   end function facts_problem

   !> What stages build, moving blocks, contacts, step control, energies, the last record, and the memory of the solver.
   function state_problem(sim, facts, memory, check) result(problem)
      class(simulation_type), intent(in) :: sim             !! its model is checked
      type(checkpoint_facts_type), intent(in) :: facts      !! checked
      real(wp), allocatable, intent(in) :: memory(:)        !! of the solver
      type(value_check_type), intent(inout) :: check        !! that of the families' states is behind it
      character(len=:), allocatable :: problem
      problem = construction_problem(sim%blocks, sim%parameters, sim%construction)
      if (len(problem) > 0) return
      call check_motion(check, sim%blocks, sim%parameters, sim%state)
      call check%holds(sim%state%step == facts%rows%steps, 'step')
      call check_contacts(check, sim%blocks, sim%parameters, sim%contacts)
      call check_control(check, sim%blocks, sim%parameters, sim%state, sim%control)
      call check_ledger(check, sim%blocks, sim%ledger)
      call check_record(check, sim%blocks, sim%parameters, sim%state, sim%record)
      check%group = 'solver'
      call check%table(sim%line_ends, 4, size(sim%parameters%line_loads), 'line_ends')
      call check%table(sim%equations%x, 6, sim%blocks%n_blocks, 'last_solution')
      if (allocated(memory)) then
         call check%is_finite(memory, 'memory')
         ! counts of solves
         call check%holds(all(memory(2:) >= 0 .and. memory(2:) <= 2.0_wp**30), 'memory')
      end if
      problem = check%problem()
   end function state_problem

   !> Check step size and stage.
   subroutine check_control(check, blocks, p, state, control)
      type(value_check_type), intent(inout) :: check
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: p
      type(block_state_type), intent(in) :: state
      type(step_control_type), intent(in) :: control
      check%group = 'control'
      call check%holds(control%dt > 0 .and. control%dt <= huge(1.0_wp), 'dt')
      call check%holds(control%last_dt >= 0 .and. control%last_dt <= huge(1.0_wp), 'last_dt')
      call check%holds(control%last_displacement >= 0 .and. control%last_displacement <= huge(1.0_wp), &
                       'last_displacement')
      call check%holds(control%last_k01 >= 0 .and. control%last_k01 <= 1, 'last_k01')
      call check%holds(control%stage >= 1 .and. control%stage <= size(p%stages) + 1, 'stage')
      call check%in_range([control%begun], 0, size(p%stages), 'begun')
      call check%in_range([control%first_step], 0, state%step, 'first_step')
      call check%holds(control%first_time >= 0 .and. control%first_time <= huge(1.0_wp), 'first_time')
      call check%in_range([control%balanced], 0, most_counted, 'balanced')
      call check%in_range(control%cuts, 0, most_counted, 'cuts')
      call check%in_range([control%short_steps], 0, most_counted, 'short_steps')
      associate (watch => control%watch)
         call check%is_finite([watch%grown, watch%grown_before, watch%grown_from, watch%next_way, watch%least, &
                               watch%least_at_mark, watch%progress%least, watch%progress%least_before, &
                               watch%way, watch%times, watch%lost_share, watch%lost_time], 'watch')
         call check%in_range([watch%progress%steps, watch%marks], 0, most_counted, 'watch')
      end associate
      call check%holds(control%slip_share >= 0 .and. control%slip_share <= 1, 'slip_share')
      call check%in_range([control%trend%steps], 0, steps_of_trend, 'trend_steps')
      call check%holds(control%trend%share >= 0 .and. control%trend%share <= 1, 'trend_share')
      call check%in_range([control%steps], 0, state%step, 'steps')
      call check%is_there(allocated(control%released), 'released')
      if (check%passed()) call check%has_shape(size(control%released) == blocks%fixed%n, 'released')
      associate (time_error => control%time_error)
         call check%is_finite([time_error%largest, time_error%error, time_error%relative], 'error')
         call check%has_shape(time_error%has_shape(blocks%n_blocks), 'error_of_blocks')
         if (check%passed()) call check%is_finite(reshape(time_error%of_blocks, [size(time_error%of_blocks)]), &
                                                  'error_of_blocks')
      end associate
      associate (strikes => control%strikes)
         call check%is_finite([strikes%fastest], 'strikes_fastest')
         call check%has_shape(strikes%has_shape(blocks%n_blocks), 'strikes_of_blocks')
         if (check%passed()) call check%is_finite(reshape(strikes%of_blocks, [size(strikes%of_blocks)]), &
                                                  'strikes_of_blocks')
      end associate
      associate (error => control%time_error)
         call check%is_finite([error%friction_before, error%friction, error%largest_kinetic], 'friction')
      end associate
   end subroutine check_control

   !> Check energies.
   subroutine check_ledger(check, blocks, ledger)
      type(value_check_type), intent(inout) :: check
      type(block_system_type), intent(in) :: blocks
      type(ledger_type), intent(in) :: ledger
      check%group = 'ledger'
      call check%is_finite(ledger%total, 'total')
      call check%is_finite([ledger%at_start], 'at_start')
      call check%is_finite([ledger%contact_energy], 'contact_energy')
      call check%is_finite([ledger%bolt_energy, ledger%bar_energy], 'bolt_energy')
      call check%list(ledger%boundary_energy, blocks%n_blocks, 'boundary_energy')
      call check%list(ledger%fixed_energy, blocks%fixed%n, 'fixed_energy')
   end subroutine check_ledger

   !> Check the record of the last step.
   subroutine check_record(check, blocks, p, state, record)
      type(value_check_type), intent(inout) :: check
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: p
      type(block_state_type), intent(in) :: state
      type(step_record_type), intent(in) :: record
      check%group = 'record'
      call check%holds(record%step == state%step, 'step')
      call check%holds(.not. abs(record%time - state%time) > 0, 'time')
      call check%is_finite([record%time], 'time')
      call check%is_finite([record%dt], 'dt')
      call check%in_range([record%open_close_iterations], 0, most_counted, 'open_close_iterations')
      call check%in_range([record%attempts], 0, most_counted, 'attempts')
      call check%in_range([record%solver_iterations], 0, most_counted, 'solver_iterations')
      call check%in_range(record%contacts, 0, most_counted, 'contacts')
      call check%is_finite([record%max_displacement, record%unbalanced, record%relaxation, record%time_error], &
                           'max_displacement')
      call check%in_range([record%stage], 0, size(p%stages), 'stage')
      call check%is_finite(record%energy, 'energy')
      call check%table(record%measured_displacement, 2, blocks%measured%n, 'measured_displacement')
      call check%table(record%measured_stress, 3, blocks%measured%n, 'measured_stress')
      call check%list(record%measured_rotation, blocks%measured%n, 'measured_rotation')
      call check%table(record%fixed_force, 2, blocks%fixed%n, 'fixed_force')
      call check%table(record%boundary_force, 2, size(p%boundaries), 'boundary_force')
   end subroutine check_record

   !> Check positions, stresses and velocities of blocks and points.
   subroutine check_motion(check, blocks, p, state)
      type(value_check_type), intent(inout) :: check
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: p
      type(block_state_type), intent(in) :: state
      integer :: nb
      nb = blocks%n_blocks
      check%group = 'state'
      call check%holds(state%step >= 0 .and. state%step < huge(1), 'step')
      call check%holds(state%time >= 0 .and. state%time <= huge(1.0_wp), 'time')
      call check%table(state%vertices, 2, blocks%n_vertices(), 'vertices', largest_coordinate)
      call check%table(state%centroid, 2, nb, 'centroid', largest_coordinate)
      call check%list(state%rotation, nb, 'rotation')
      call check%table(state%stress, 3, nb, 'stress')
      call check%table(state%velocity, 6, nb, 'velocity')
      call check%table(state%acceleration, 6, nb, 'acceleration')
      call check%is_there(allocated(state%quiet_force), 'quiet_force')
      if (check%passed()) call check%is_finite(state%quiet_force, 'quiet_force')
      call check%list(state%area, nb, 'area')
      call check%table(state%moments, 3, nb, 'moments')
      call check%list(state%mass, nb, 'mass')
      call check%is_there(allocated(state%active), 'active')
      if (check%passed()) call check%has_shape(size(state%active) == nb, 'active')
      call check%is_there(allocated(state%asleep), 'asleep')
      if (check%passed()) call check%has_shape(size(state%asleep) == nb, 'asleep')
      if (check%passed()) call check%holds(.not. any(state%asleep .and. .not. (p%sleeps .and. state%active)), 'asleep')
      call check%is_there(allocated(state%calm), 'calm')
      if (check%passed()) call check%has_shape(size(state%calm) == nb, 'calm')
      if (check%passed()) call check%in_range(state%calm, 0, most_counted, 'calm')
      if (check%passed()) then
         call check%holds(all(state%area > 0), 'area')
         call check%holds(all(state%mass > 0), 'mass')
      end if
      call check%table(state%fixed_position, 2, blocks%fixed%n, 'fixed_position', largest_coordinate)
      call check%table(state%loading_position, 2, blocks%loading%n, 'loading_position', largest_coordinate)
      call check%table(state%measured_position, 2, blocks%measured%n, 'measured_position', largest_coordinate)
      call check%table(state%measured_from, 3, blocks%measured%n, 'measured_from', largest_coordinate)
      call check%table(state%bolt_ends, 4, blocks%bolts%n, 'bolt_ends', largest_coordinate)
      call check%list(state%bolt_elongation, blocks%bolts%n, 'bolt_elongation')
      call check%list(state%bolt_plastic, blocks%bolts%n, 'bolt_plastic')
   end subroutine check_motion

   !> Rows of contacts: vertices and edges of their blocks, in order. The partner of a row may have another partner:
   !> a row at the end of an overlap names the row of the corner's other line.
   subroutine check_contacts(check, blocks, p, contacts)
      type(value_check_type), intent(inout) :: check
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: p
      type(contact_table_type), intent(in) :: contacts
      integer :: n, c
      if (.not. check%passed()) return
      check%group = 'contacts'
      n = contacts%n
      associate (t => contacts)
         call check%in_range(t%block_a(1:n), 1, blocks%n_blocks, 'block_a')
         call check%in_range(t%block_b(1:n), 1, blocks%n_blocks, 'block_b')
         call check%in_range(t%partner(1:n), 0, n, 'partner')
         call check%in_range(t%joint(1:n), 1, size(p%joint_materials), 'joint')
         call check%in_range(int(t%state(1:n)), 0, 2, 'state')
         call check%in_range(int(t%slip_sign(1:n)), -1, 1, 'slip_sign')
         call check%in_range(int(t%station(1:n)), 0, corner_station, 'station')
         if (.not. check%passed()) return
         do c = 1, n
            call check%holds(owns(t%block_a(c), t%vertex(c)), 'vertex')
            call check%holds(owns(t%block_b(c), t%edge(c)), 'edge')
            call check%holds(t%partner(c) /= c, 'partner')
            if (c > 1) call check%holds(in_order(c), 'vertex')
            if (.not. check%passed()) return
         end do
         call check%is_finite(t%shear(1:n), 'shear')
         call check%is_finite(t%normal_force(1:n), 'normal_force')
         call check%is_finite(t%shear_force(1:n), 'shear_force')
         call check%is_finite(t%total_slip(1:n), 'total_slip')
         call check%is_finite(t%energy(1:n), 'energy')
         call check%is_finite(t%distance(1:n), 'distance')
         call check%is_finite(t%length(1:n), 'length')
         call check%is_finite(t%offset(1:n), 'offset')
         call check%is_finite(t%bond_end(1:n), 'bond_end')
         call check%is_finite(t%k_n(1:n), 'k_n')
         call check%is_finite(t%k_s(1:n), 'k_s')
         call check%is_finite(t%normal(:, 1:n), 'normal_x')
         call check%is_finite(t%point(:, 1:n), 'point_x')
      end associate

   contains

      !> Is vertex k one of block i?
      pure logical function owns(i, k)
         integer, intent(in) :: i, k
         owns = k > blocks%vertex_offset(i) .and. k <= blocks%vertex_offset(i + 1)
      end function owns

      !> Is row r in order after row r - 1?
      pure logical function in_order(r)
         integer, intent(in) :: r
         integer :: one(5), other(5), i
         one = [contacts%block_a(r - 1), contacts%vertex(r - 1), contacts%block_b(r - 1), contacts%edge(r - 1), &
                int(contacts%station(r - 1))]
         other = [contacts%block_a(r), contacts%vertex(r), contacts%block_b(r), contacts%edge(r), &
                  int(contacts%station(r))]
         in_order = .false.
         do i = 1, 5
            if (one(i) == other(i)) cycle
            in_order = one(i) < other(i)
            return
         end do
      end function in_order

   end subroutine check_contacts

end module rockdda_io_checkpoint_state_check
