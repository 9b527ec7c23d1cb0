! SPDX-License-Identifier: MIT
!> What changes while blocks move, to and from a checkpoint: all that the next step depends on.
!>
!> A component that is added to these types has to be added here; families of interactions have `exchange_state`.
module rockdda_io_checkpoint_state
   use rockdda_base_kinds, only : i8, wp
   use rockdda_contact_table, only : contact_table_type
   use rockdda_model_state, only : block_state_type, step_record_type
   use rockdda_stepping_construction, only : construction_type
   use rockdda_stepping_control, only : step_control_type
   use rockdda_stepping_ledger, only : ledger_type
   use rockdda_stepping_lodging, only : lodging_type
   use rockdda_io_archive, only : archive_type
   implicit none
   private
   public :: exchange_state, exchange_contacts, exchange_control, exchange_construction, exchange_ledger, &
      exchange_record, exchange_reported

contains

   !> Save or load moving blocks and points.
   subroutine exchange_state(archive, state)
      type(archive_type), intent(inout) :: archive
      type(block_state_type), intent(inout) :: state
      call archive%section('state')
      call archive%item('step', state%step)
      call archive%item('time', state%time)
      call archive%item('vertices', state%vertices)
      call archive%item('centroid', state%centroid)
      call archive%item('rotation', state%rotation)
      call archive%item('stress', state%stress)
      call archive%item('velocity', state%velocity)
      call archive%item('acceleration', state%acceleration)
      call archive%item('accelerates', state%accelerates)
      call archive%item('quiet', state%quiet)
      call archive%item('quiet_force', state%quiet_force)
      call archive%item('area', state%area)
      call archive%item('moments', state%moments)
      call archive%item('mass', state%mass)
      call archive%item('active', state%active)
      call archive%item('asleep', state%asleep)
      call archive%item('calm', state%calm)
      call archive%item('fixed_position', state%fixed_position)
      call archive%item('loading_position', state%loading_position)
      call archive%item('measured_position', state%measured_position)
      call archive%item('measured_from', state%measured_from)
      call archive%item('bolt_ends', state%bolt_ends)
      call archive%item('bolt_elongation', state%bolt_elongation)
      call archive%item('bolt_plastic', state%bolt_plastic)
   end subroutine exchange_state

   !> Save or load contacts of the last step with their history.
   subroutine exchange_contacts(archive, contacts)
      type(archive_type), intent(inout) :: archive
      type(contact_table_type), intent(inout) :: contacts
      integer :: n, axis
      integer(i8) :: rows
      character(len=*), parameter :: axes(2) = ['x', 'y']
      call archive%section('contacts')
      n = contacts%n
      call archive%item('n', n)
      if (.not. archive%saving) then
         rows = archive%length('vertex')
         if (n < 0 .or. n /= rows) call archive%refuse('n', 'holds an impossible number')
         if (allocated(archive%error)) return
         call contacts%resize(n)
      end if
      call archive%part('block_a', n, contacts%block_a)
      call archive%part('vertex', n, contacts%vertex)
      call archive%part('block_b', n, contacts%block_b)
      call archive%part('edge', n, contacts%edge)
      call archive%part('partner', n, contacts%partner)
      call archive%part('joint', n, contacts%joint)
      call archive%part('state', n, contacts%state)
      call archive%part('shear', n, contacts%shear)
      call archive%part('normal_force', n, contacts%normal_force)
      call archive%part('shear_force', n, contacts%shear_force)
      call archive%part('bonded', n, contacts%bonded)
      call archive%part('total_slip', n, contacts%total_slip)
      call archive%part('energy', n, contacts%energy)
      call archive%part('slip_sign', n, contacts%slip_sign)
      call archive%part('distance', n, contacts%distance)
      call archive%part('length', n, contacts%length)
      call archive%part('station', n, contacts%station)
      call archive%part('offset', n, contacts%offset)
      call archive%part('bond_end', n, contacts%bond_end)
      call archive%part('k_n', n, contacts%k_n)
      call archive%part('k_s', n, contacts%k_s)
      call archive%part('tied', n, contacts%tied)
      do axis = 1, 2
         call archive%fixed('normal_'//axes(axis), contacts%normal(axis, 1:n))
         call archive%fixed('point_'//axes(axis), contacts%point(axis, 1:n))
      end do
   end subroutine exchange_contacts

   !> Save or load step size and stages.
   subroutine exchange_control(archive, control)
      type(archive_type), intent(inout) :: archive
      type(step_control_type), intent(inout) :: control
      call archive%section('control')
      call archive%item('dt', control%dt)
      call archive%item('last_dt', control%last_dt)
      call archive%item('last_displacement', control%last_displacement)
      call archive%item('last_k01', control%last_k01)
      call archive%item('stage', control%stage)
      call archive%item('begun', control%begun)
      call archive%item('first_step', control%first_step)
      call archive%item('first_time', control%first_time)
      call archive%item('motion_start', control%motion_start)
      call archive%item('steps', control%steps)
      associate (watch => control%watch)
         call archive%item('watch_grown', watch%grown)
         call archive%item('watch_grown_before', watch%grown_before)
         call archive%item('watch_grown_from', watch%grown_from)
         call archive%item('watch_next_way', watch%next_way)
         call archive%item('watch_least_moving', watch%least)
         call archive%item('watch_least_at_mark', watch%least_at_mark)
         call archive%item('watch_steps', watch%progress%steps)
         call archive%item('watch_least', watch%progress%least)
         call archive%item('watch_least_before', watch%progress%least_before)
         call archive%item('watch_runs_away', watch%runs_away)
         call archive%item('watch_marks', watch%marks)
         call archive%item('watch_way', watch%way)
         call archive%fixed('watch_times', watch%times)
         call archive%item('watch_is_lost', watch%is_lost)
         call archive%item('watch_lost_share', watch%lost_share)
         call archive%item('watch_lost_time', watch%lost_time)
      end associate
      call archive%item('balanced', control%balanced)
      call archive%item('released', control%released)
      call archive%fixed('cuts', control%cuts)
      call archive%item('short_steps', control%short_steps)
      call archive%item('slip_share', control%slip_share)
      call archive%item('trend_steps', control%trend%steps)
      call archive%item('trend_share', control%trend%share)
      associate (time_error => control%time_error)
         call archive%item('error_counts', time_error%counts)
         call archive%item('error_largest', time_error%largest)
         call archive%item('error', time_error%error)
         call archive%item('error_relative', time_error%relative)
         call archive%item('error_of_blocks', time_error%of_blocks)
         call archive%item('friction_before', time_error%friction_before)
         call archive%item('friction', time_error%friction)
         call archive%item('largest_kinetic', time_error%largest_kinetic)
      end associate
      call archive%item('strikes_fastest', control%strikes%fastest)
      call archive%item('strikes_of_blocks', control%strikes%of_blocks)
   end subroutine exchange_control

   !> Save or load what stages build: blocks of their regions.
   subroutine exchange_construction(archive, construction, stiffness_is_new)
      type(archive_type), intent(inout) :: archive
      type(construction_type), intent(inout) :: construction
      logical, intent(inout) :: stiffness_is_new   !! a step that was stopped had new materials
      call archive%section('construction')
      call archive%item('excavated', construction%excavated)
      call archive%item('placed', construction%placed)
      call archive%item('changed', construction%changed)
      call archive%item('newborn', construction%newborn)
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
      call archive%item('lodged_depths', depths)
      if (archive%saving .or. allocated(archive%error)) return
      if (size(blocks) /= 2*size(depths) .or. .not. all(depths > 0 .and. depths <= huge(1.0_wp))) then
         call archive%refuse('lodged_depths', 'holds impossible numbers')
         return
      end if
      deallocate (lodging%told)
      allocate (lodging%told(size(depths)))
      do k = 1, size(depths)
         lodging%told(k)%blocks = blocks(2*k - 1:2*k)
         lodging%told(k)%depth = depths(k)
      end do
   end subroutine exchange_reported

   !> Save or load energies.
   subroutine exchange_ledger(archive, ledger)
      type(archive_type), intent(inout) :: archive
      type(ledger_type), intent(inout) :: ledger
      call archive%section('ledger')
      call archive%fixed('total', ledger%total)
      call archive%item('at_start', ledger%at_start)
      call archive%item('contact_energy', ledger%contact_energy)
      call archive%item('fixed_energy', ledger%fixed_energy)
      call archive%item('bolt_energy', ledger%bolt_energy)
      call archive%item('bar_energy', ledger%bar_energy)
      call archive%item('boundary_energy', ledger%boundary_energy)
      call archive%item('exchanged', ledger%given%exchanged)
      call archive%item('given_scale', ledger%given%scale)
      call archive%item('most_dissipated', ledger%given%dissipated)
      call archive%fixed('given_sum', ledger%given%sum)
      call archive%fixed('given_lowest', ledger%given%lowest)
      call archive%fixed('given', ledger%given%given)
      call archive%fixed('given_worst_discarded', ledger%given%worst(:, 1))
      call archive%fixed('given_worst_geometry', ledger%given%worst(:, 2))
   end subroutine exchange_ledger

   !> Save or load the record of the last step.
   subroutine exchange_record(archive, record)
      type(archive_type), intent(inout) :: archive
      type(step_record_type), intent(inout) :: record
      call archive%section('record')
      call archive%item('step', record%step)
      call archive%item('time', record%time)
      call archive%item('dt', record%dt)
      call archive%item('open_close_iterations', record%open_close_iterations)
      call archive%item('attempts', record%attempts)
      call archive%item('solver_iterations', record%solver_iterations)
      call archive%fixed('contacts', record%contacts)
      call archive%item('max_displacement', record%max_displacement)
      call archive%item('unbalanced', record%unbalanced)
      call archive%item('stage', record%stage)
      call archive%item('relaxation', record%relaxation)
      call archive%item('time_error', record%time_error)
      call archive%fixed('energy', record%energy)
      call archive%item('measured_displacement', record%measured_displacement)
      call archive%item('measured_stress', record%measured_stress)
      call archive%item('measured_rotation', record%measured_rotation)
      call archive%item('fixed_force', record%fixed_force)
      call archive%item('boundary_force', record%boundary_force)
      call archive%item('bolt_force', record%bolt_force)
      call archive%item('bolt_head_force', record%bolt_head_force)
      call archive%item('bolt_dowel', record%bolt_dowel)
      call archive%fixed('bolt_energy', record%bolt_energy)
   end subroutine exchange_record

end module rockdda_io_checkpoint_state
