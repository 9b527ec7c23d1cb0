! SPDX-License-Identifier: MIT
!> What changes while blocks move, to and from a checkpoint: all that the next step depends on, and the shapes and
!> bounds of it, which are checked as it is loaded. The model has been loaded before.
!>
!> A component that is added to these types has to be added here; families of interactions have `exchange_state`.
module rockdda_io_checkpoint_state
   use rockdda_base_kinds, only : wp
   use rockdda_base_state_archive, only : positive
   use rockdda_contact_corners, only : corner_station
   use rockdda_contact_table, only : contact_table_type
   use rockdda_model_blocks, only : block_system_type, largest_coordinate
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_state, only : block_state_type, step_record_type
   use rockdda_stepping_construction, only : construction_type
   use rockdda_stepping_control, only : step_control_type
   use rockdda_stepping_ledger, only : ledger_type
   use rockdda_stepping_lodging, only : lodging_type
   use rockdda_stepping_trend, only : steps_of_trend
   use rockdda_io_archive, only : archive_type
   implicit none
   private
   public :: exchange_state, exchange_contacts, exchange_control, exchange_construction, exchange_ledger, &
      exchange_record, exchange_reported

   !> Largest count of steps and of attempts: far more than a run makes, and far below the largest integer.
   integer, parameter :: most_counted = 2**30

contains

   !> Save or load moving blocks and points.
   subroutine exchange_state(archive, blocks, parameters, n_springs, state)
      type(archive_type), intent(inout) :: archive
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      integer, intent(in) :: n_springs         !! of boundaries
      type(block_state_type), intent(inout) :: state
      integer :: nb
      nb = blocks%n_blocks
      call archive%section('state')
      call archive%item('step', state%step, 0, huge(1) - 1)
      call archive%item('time', state%time, 0.0_wp)
      call archive%item('vertices', state%vertices, [2, blocks%n_vertices()], largest_coordinate)
      call archive%item('centroid', state%centroid, [2, nb], largest_coordinate)
      call archive%item('rotation', state%rotation, nb)
      call archive%item('stress', state%stress, [3, nb])
      call archive%item('velocity', state%velocity, [6, nb])
      call archive%item('acceleration', state%acceleration, [6, nb])
      call archive%item('accelerates', state%accelerates)
      call archive%item('quiet', state%quiet)
      call archive%item('quiet_force', state%quiet_force)
      if (.not. allocated(state%quiet_force)) allocate (state%quiet_force(0))
      call archive%demand(size(state%quiet_force) == n_springs .or. (size(state%quiet_force) == 0 .and. &
                                                                     .not. state%quiet), 'quiet_force')
      call archive%item('area', state%area, nb, positive)
      call archive%item('moments', state%moments, [3, nb])
      call archive%item('mass', state%mass, nb, positive)
      call archive%item('active', state%active, nb)
      call archive%item('asleep', state%asleep, nb)
      if (archive%has_loaded()) &
         call archive%demand(.not. any(state%asleep .and. .not. (parameters%sleeps .and. state%active)), 'asleep')
      call archive%item('calm', state%calm, nb, 0, most_counted)
      call archive%item('fixed_position', state%fixed_position, [2, blocks%fixed%n], largest_coordinate)
      call archive%item('loading_position', state%loading_position, [2, blocks%loading%n], largest_coordinate)
      call archive%item('measured_position', state%measured_position, [2, blocks%measured%n], largest_coordinate)
      call archive%item('measured_from', state%measured_from, [3, blocks%measured%n], largest_coordinate)
      call archive%item('bolt_ends', state%bolt_ends, [4, blocks%bolts%n], largest_coordinate)
      call archive%item('bolt_elongation', state%bolt_elongation, blocks%bolts%n)
      call archive%item('bolt_plastic', state%bolt_plastic, blocks%bolts%n)
   end subroutine exchange_state

   !> Save or load contacts of the last step with their history.
   subroutine exchange_contacts(archive, blocks, n_joints, contacts)
      type(archive_type), intent(inout) :: archive
      type(block_system_type), intent(in) :: blocks
      integer, intent(in) :: n_joints          !! joint materials
      type(contact_table_type), intent(inout) :: contacts
      integer :: n, axis
      character(len=*), parameter :: axes(2) = ['x', 'y']
      call archive%section('contacts')
      n = contacts%n
      call archive%item('n', n)
      if (.not. archive%saving) then
         call archive%demand(n >= 0 .and. n == archive%length('vertex'), 'n')
         if (allocated(archive%error)) return
         call contacts%resize(n)
      end if
      call archive%fixed('block_a', contacts%block_a(1:n), 1, blocks%n_blocks)
      call archive%fixed('vertex', contacts%vertex(1:n), 1, blocks%n_vertices())
      call archive%fixed('block_b', contacts%block_b(1:n), 1, blocks%n_blocks)
      call archive%fixed('edge', contacts%edge(1:n), 1, blocks%n_vertices())
      call archive%fixed('partner', contacts%partner(1:n), 0, n)
      call archive%fixed('joint', contacts%joint(1:n), 1, n_joints)
      call archive%fixed('state', contacts%state(1:n), 0, 2)
      call archive%fixed('shear', contacts%shear(1:n))
      call archive%fixed('normal_force', contacts%normal_force(1:n))
      call archive%fixed('shear_force', contacts%shear_force(1:n))
      call archive%fixed('bonded', contacts%bonded(1:n))
      call archive%fixed('total_slip', contacts%total_slip(1:n))
      call archive%fixed('energy', contacts%energy(1:n))
      call archive%fixed('slip_sign', contacts%slip_sign(1:n), -1, 1)
      call archive%fixed('distance', contacts%distance(1:n))
      call archive%fixed('length', contacts%length(1:n))
      call archive%fixed('station', contacts%station(1:n), 0, corner_station)
      call archive%fixed('offset', contacts%offset(1:n))
      call archive%fixed('bond_end', contacts%bond_end(1:n))
      call archive%fixed('closed', contacts%closed(1:n))
      call archive%fixed('core', contacts%core(1, 1:n))
      call archive%fixed('core_shear', contacts%core(2, 1:n))
      call archive%fixed('k_n', contacts%k_n(1:n))
      call archive%fixed('k_s', contacts%k_s(1:n))
      call archive%fixed('tied', contacts%tied(1:n))
      do axis = 1, 2
         call archive%fixed('normal_'//axes(axis), contacts%normal(axis, 1:n))
         call archive%fixed('point_'//axes(axis), contacts%point(axis, 1:n))
      end do
      if (archive%has_loaded()) call check_rows(archive, blocks, contacts)
   end subroutine exchange_contacts

   !> Check that rows of contacts name vertices and edges of their blocks, in order. The partner of a row may have
   !> another partner: a row at the end of an overlap names the row of the corner's other line.
   subroutine check_rows(archive, blocks, contacts)
      type(archive_type), intent(inout) :: archive
      type(block_system_type), intent(in) :: blocks
      type(contact_table_type), intent(in) :: contacts
      integer :: c
      do c = 1, contacts%n
         call archive%demand(owns(contacts%block_a(c), contacts%vertex(c)), 'vertex')
         call archive%demand(owns(contacts%block_b(c), contacts%edge(c)), 'edge')
         call archive%demand(contacts%partner(c) /= c, 'partner')
         call archive%demand(contacts%closed(c) > 0 .and. contacts%closed(c) <= 1, 'closed')
         call archive%demand(contacts%core(1, c) > 0 .and. contacts%core(1, c) <= 1, 'core')
         if (c > 1) call archive%demand(in_order(row(c - 1), row(c)), 'vertex')
      end do

   contains

      !> Is vertex k one of block i?
      pure logical function owns(i, k)
         integer, intent(in) :: i, k
         owns = k > blocks%vertex_offset(i) .and. k <= blocks%vertex_offset(i + 1)
      end function owns

      !> What rows are ordered by.
      pure function row(c) result(key)
         integer, intent(in) :: c
         integer :: key(5)
         key = [contacts%block_a(c), contacts%vertex(c), contacts%block_b(c), contacts%edge(c), &
                int(contacts%station(c))]
      end function row

      !> Does the first key come before the second?
      pure logical function in_order(first, second)
         integer, intent(in) :: first(5), second(5)
         integer :: i
         i = findloc(first /= second, .true., 1)
         in_order = i > 0
         if (in_order) in_order = first(i) < second(i)
      end function in_order

   end subroutine check_rows

   !> Save or load step size and stages.
   subroutine exchange_control(archive, blocks, n_stages, last_step, control)
      type(archive_type), intent(inout) :: archive
      type(block_system_type), intent(in) :: blocks
      integer, intent(in) :: n_stages
      integer, intent(in) :: last_step         !! of the run so far
      type(step_control_type), intent(inout) :: control
      call archive%section('control')
      call archive%item('dt', control%dt, positive)
      call archive%item('last_dt', control%last_dt, 0.0_wp)
      call archive%item('last_displacement', control%last_displacement, 0.0_wp)
      call archive%item('last_k01', control%last_k01, 0.0_wp, 1.0_wp)
      call archive%item('stage', control%stage, 1, n_stages + 1)
      call archive%item('begun', control%begun, 0, n_stages)
      call archive%item('first_step', control%first_step, 0, last_step)
      call archive%item('first_time', control%first_time, 0.0_wp)
      call archive%item('motion_start', control%motion_start)
      call archive%item('steps', control%steps, 0, last_step)
      associate (watch => control%watch)
         call archive%item('watch_grown', watch%grown)
         call archive%item('watch_grown_before', watch%grown_before)
         call archive%item('watch_grown_from', watch%grown_from)
         call archive%item('watch_next_way', watch%next_way)
         call archive%item('watch_least_moving', watch%least)
         call archive%item('watch_least_at_mark', watch%least_at_mark)
         call archive%item('watch_steps', watch%progress%steps, 0, most_counted)
         call archive%item('watch_least', watch%progress%least)
         call archive%item('watch_least_before', watch%progress%least_before)
         call archive%item('watch_runs_away', watch%runs_away)
         call archive%item('watch_marks', watch%marks, 0, most_counted)
         call archive%item('watch_way', watch%way)
         call archive%fixed('watch_times', watch%times)
         call archive%item('watch_is_lost', watch%is_lost)
         call archive%item('watch_lost_share', watch%lost_share)
         call archive%item('watch_lost_time', watch%lost_time)
      end associate
      call archive%item('balanced', control%balanced, 0, most_counted)
      call archive%item('released', control%released, blocks%fixed%n)
      call archive%fixed('cuts', control%cuts, 0, most_counted)
      call archive%item('short_steps', control%short_steps, 0, most_counted)
      call archive%item('slip_share', control%slip_share, 0.0_wp, 1.0_wp)
      call archive%item('trend_steps', control%trend%steps, 0, steps_of_trend)
      call archive%item('trend_share', control%trend%share, 0.0_wp, 1.0_wp)
      associate (time_error => control%time_error)
         call archive%item('error_counts', time_error%counts)
         call archive%item('error_largest', time_error%largest)
         call archive%item('error', time_error%error)
         call archive%item('error_relative', time_error%relative)
         call archive%item('error_of_blocks', time_error%of_blocks)
         call archive%demand(time_error%has_shape(blocks%n_blocks), 'error_of_blocks')
         call archive%item('friction_before', time_error%friction_before)
         call archive%item('friction', time_error%friction)
         call archive%item('largest_kinetic', time_error%largest_kinetic)
      end associate
      call archive%item('strikes_fastest', control%strikes%fastest)
      call archive%item('strikes_of_blocks', control%strikes%of_blocks)
      call archive%demand(control%strikes%has_shape(blocks%n_blocks), 'strikes_of_blocks')
   end subroutine exchange_control

   !> Save or load what stages build: blocks of their regions, as columns of 0 and 1.
   subroutine exchange_construction(archive, parameters, nb, construction, stiffness_is_new)
      type(archive_type), intent(inout) :: archive
      type(parameters_type), intent(in) :: parameters
      integer, intent(in) :: nb                    !! blocks
      type(construction_type), intent(inout) :: construction
      logical, intent(inout) :: stiffness_is_new   !! a step that was stopped had new materials
      call archive%section('construction')
      call archive%item('excavated', construction%excavated, [nb, size(parameters%stages)], 0, 1)
      call archive%item('placed', construction%placed, [nb, size(parameters%stages)], 0, 1)
      call archive%item('changed', construction%changed, [nb, size(parameters%changes)], 0, 1)
      call archive%item('newborn', construction%newborn, nb)
      call archive%item('stiffness_is_new', stiffness_is_new)
   end subroutine exchange_construction

   !> Save or load which pairs of blocks inside each other, and whether a large strain, have been reported.
   subroutine exchange_reported(archive, lodging)
      type(archive_type), intent(inout) :: archive
      type(lodging_type), intent(inout) :: lodging
      integer, allocatable :: blocks(:)
      real(wp), allocatable :: depths(:)
      integer :: k
      if (.not. allocated(lodging%told)) allocate (lodging%told(0))
      blocks = [(lodging%told(k)%blocks, k=1, size(lodging%told))]
      depths = lodging%told%depth
      call archive%section('reported')
      call archive%item('strain', lodging%strain_was_reported)
      call archive%item('lodged_blocks', blocks)
      call archive%item('lodged_depths', depths, size(blocks)/2, positive)
      if (.not. archive%has_loaded()) return
      deallocate (lodging%told)
      allocate (lodging%told(size(depths)))
      do k = 1, size(depths)
         lodging%told(k)%blocks = blocks(2*k - 1:2*k)
         lodging%told(k)%depth = depths(k)
      end do
   end subroutine exchange_reported

   !> Save or load energies.
   subroutine exchange_ledger(archive, blocks, ledger)
      type(archive_type), intent(inout) :: archive
      type(block_system_type), intent(in) :: blocks
      type(ledger_type), intent(inout) :: ledger
      call archive%section('ledger')
      call archive%fixed('total', ledger%total)
      call archive%item('at_start', ledger%at_start)
      call archive%item('contact_energy', ledger%contact_energy)
      call archive%item('fixed_energy', ledger%fixed_energy, blocks%fixed%n)
      call archive%item('bolt_energy', ledger%bolt_energy)
      call archive%item('bar_energy', ledger%bar_energy)
      call archive%item('boundary_energy', ledger%boundary_energy, blocks%n_blocks)
      call archive%item('exchanged', ledger%given%exchanged)
      call archive%item('given_scale', ledger%given%scale)
      call archive%item('most_dissipated', ledger%given%dissipated)
      call archive%fixed('given_sum', ledger%given%sum)
      call archive%fixed('given_lowest', ledger%given%lowest)
      call archive%fixed('given', ledger%given%given)
      call archive%fixed('given_worst_discarded', ledger%given%worst(:, 1))
      call archive%fixed('given_worst_geometry', ledger%given%worst(:, 2))
   end subroutine exchange_ledger

   !> Save or load the record of the last step, which is that of the state.
   subroutine exchange_record(archive, blocks, parameters, state, record)
      type(archive_type), intent(inout) :: archive
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(block_state_type), intent(in) :: state
      type(step_record_type), intent(inout) :: record
      call archive%section('record')
      call archive%item('step', record%step, state%step, state%step)
      call archive%item('time', record%time, state%time, state%time)
      call archive%item('dt', record%dt)
      call archive%item('open_close_iterations', record%open_close_iterations, 0, most_counted)
      call archive%item('attempts', record%attempts, 0, most_counted)
      call archive%item('solver_iterations', record%solver_iterations, 0, most_counted)
      call archive%fixed('contacts', record%contacts, 0, most_counted)
      call archive%item('max_displacement', record%max_displacement)
      call archive%item('unbalanced', record%unbalanced)
      call archive%item('stage', record%stage, 0, size(parameters%stages))
      call archive%item('relaxation', record%relaxation)
      call archive%item('time_error', record%time_error)
      call archive%fixed('energy', record%energy)
      call archive%item('measured_displacement', record%measured_displacement, [2, blocks%measured%n])
      call archive%item('measured_stress', record%measured_stress, [3, blocks%measured%n])
      call archive%item('measured_rotation', record%measured_rotation, blocks%measured%n)
      call archive%item('fixed_force', record%fixed_force, [2, blocks%fixed%n])
      call archive%item('boundary_force', record%boundary_force, [2, size(parameters%boundaries)])
      call archive%item('bolt_force', record%bolt_force)
      call archive%item('bolt_head_force', record%bolt_head_force)
      call archive%item('bolt_dowel', record%bolt_dowel)
      call archive%fixed('bolt_energy', record%bolt_energy)
   end subroutine exchange_record

end module rockdda_io_checkpoint_state
