! SPDX-License-Identifier: MIT
!> Warnings of values that are allowed but implausible: inconsistent units, no load, no support, joints without damping
!> in a model whose base moves, and damping of blocks that lets nothing move.
!>
!> Each rule gives one warning at most, with the value that was read and the reason. Only materials that blocks and
!> edges use are checked. The limits allow other units (feet, millimetres), centrifuges and soft rock; they are listed
!> in docs/notes/checks.md.
module rockdda_check_plausibility
   use rockdda_base_kinds, only : wp, pi
   use rockdda_base_strings, only : counted, to_string, is_given
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_model_analysis_input, only : time_table_type
   use rockdda_geometry_polygons, only : polygon_properties
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_in_situ, only : initial_stress_type, find_initial_stress
   use rockdda_model_options, only : run_options_type, is_set
   use rockdda_check_cell_joints, only : check_cell_joints
   use rockdda_check_tables, only : warn_of_harmonics
   use rockdda_check_unlikely, only : check_ground, check_units
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_stage_options, only : has_base_motion
   implicit none
   private
   public :: check_plausibility

   !> Steps in which damping may take the velocity of a block.
   real(wp), parameter :: least_steps = 3.0_wp

   !> Friction angles above 0 and up to this are probably radians [deg].
   real(wp), parameter :: largest_radian = 1.6_wp
   !> Weight over density is an acceleration; 9.81 m/s2 is 9810 mm/s2.
   real(wp), parameter :: smallest_acceleration = 0.1_wp, largest_acceleration = 2.0e4_wp
   !> Unit weights differ from density times gravity by less, when one is rounded.
   real(wp), parameter :: weight_tolerance = 0.02_wp
   !> Largest plausible strain, and penetration over the block size, at the bottom under the weight of the whole height.
   real(wp), parameter :: largest_strain = 0.01_wp, largest_penetration = 0.01_wp
   !> Joints may close under the initial stress by this share of the thickness of a block beside them.
   real(wp), parameter :: largest_closure = 0.2_wp
   !> Contact springs may be softer than the rock by this factor without a warning.
   real(wp), parameter :: smallest_stiffness_ratio = 5.0e-7_wp
   !> Steps of g1 in a period of the base's motion below which they do not follow it, and rows of a record above which a
   !> step does not follow it either.
   real(wp), parameter :: least_of_period = 10, most_of_record = 5
   !> Largest share of the forces that blocks asleep may lack without a warning.
   real(wp), parameter :: largest_sleep = 0.05_wp

   !> What the rules read of a model, and the warnings so far.
   type :: inspection_type
      logical, allocatable :: block_used(:), joint_used(:)         !! materials that blocks and edges use
      real(wp) :: unit_weight = 0                                  !! the largest of the blocks
      real(wp) :: height = 0                                       !! of the model
      character(len=:), allocatable :: analysis_file, options_file
      type(diagnostics_type) :: warnings
   contains
      procedure :: warn
      procedure :: check_friction, check_weight, check_gravity
      procedure :: check_modulus
      procedure :: check_stiffness
      procedure :: check_closure
      procedure :: check_loads
      procedure :: check_supports
      procedure :: check_held_velocity
      procedure :: check_sleep
      procedure :: check_step
   end type inspection_type

contains

   !> Warn of implausible values.
   subroutine check_plausibility(blocks, parameters, options, analysis_file, options_file, messages)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(run_options_type), intent(in) :: options
      character(len=*), intent(in) :: analysis_file, options_file   !! for messages
      type(diagnostics_type), intent(inout) :: messages
      type(inspection_type) :: inspection
      integer :: i
      if (blocks%n_blocks == 0) return
      inspection%analysis_file = analysis_file
      inspection%options_file = options_file
      inspection%block_used = [(any(blocks%block_material == i), i=1, size(parameters%block_materials))]
      inspection%joint_used = [(any(blocks%edge_joint == i), i=1, size(parameters%joint_materials))]
      inspection%height = maxval(blocks%vertices(2, :)) - minval(blocks%vertices(2, :))
      associate (materials => parameters%block_materials)
         if (parameters%gravity >= 0) then
            inspection%unit_weight = maxval([0.0_wp, pack(parameters%gravity*materials%density, inspection%block_used)])
         else
            inspection%unit_weight = maxval([0.0_wp, pack(abs(materials%weight), inspection%block_used)])
         end if
      end associate
      call check_units(blocks, parameters, options, analysis_file, options_file, messages)
      if (messages%has_errors()) return
      call inspection%check_friction(parameters)
      call inspection%check_weight(parameters)
      if (is_set(options%gravity)) call inspection%check_gravity(parameters, options%gravity)
      call inspection%check_modulus(parameters)
      call inspection%check_stiffness(parameters, is_set(options%stiffness), options%stiffness_origin)
      call inspection%check_closure(blocks, parameters)
      call inspection%check_loads(blocks, parameters, is_set(options%gravity))
      call inspection%check_supports(blocks, parameters)
      call inspection%check_held_velocity(blocks, parameters)
      if (len(analysis_file) == 0) call check_damping(parameters, inspection%joint_used, inspection%warnings)
      call check_mass_damping(parameters, options%mass_damping_origin, inspection%warnings)
      call warn_of_harmonics(parameters, options%base%harmonics_origin, inspection%warnings)
      call inspection%check_sleep(parameters, options)
      call inspection%check_step(parameters, is_set(options%dt_max), options%dt_max_origin)
      call check_ground(blocks, parameters, inspection%warnings)
      call check_cell_joints(blocks, parameters, inspection%warnings)
      call messages%append(inspection%warnings)
   end subroutine check_plausibility

   !> Add a warning with the file that holds the value.
   subroutine warn(self, text, from_options, place)
      class(inspection_type), intent(inout) :: self
      character(len=*), intent(in) :: text
      logical, intent(in) :: from_options         !! the options file replaces the value of the analysis file
      type(origin_type), intent(in), optional :: place !! of the value, empty when the analysis file has it
      type(origin_type) :: origin
      if (present(place)) then
         if (place%line > 0) then
            call self%warnings%add(severity%warning, text, place)
            return
         end if
      end if
      origin%file = self%analysis_file
      if (len(self%analysis_file) == 0) origin%file = self%options_file
      if (from_options .and. len(self%options_file) > 0) origin%file = self%options_file
      call self%warnings%add(severity%warning, text, origin)
   end subroutine warn

   !> Check that friction angles are in degrees, not radians.
   subroutine check_friction(self, parameters)
      class(inspection_type), intent(inout) :: self
      type(parameters_type), intent(in) :: parameters
      integer :: k
      do k = 1, size(self%joint_used)
         associate (angle => parameters%joint_materials(k)%friction_angle)
            if (.not. self%joint_used(k) .or. .not. angle > 0 .or. angle > largest_radian) cycle
            call self%warn('friction angle of joint material '//to_string(k)//' is '//to_string(angle)// &
                      ' degrees: is it in radians? ('//to_string(angle)//' rad are '// &
                      to_string(angle*180/pi, 3)//' degrees)', .false., parameters%joint_materials(k)%origin)
         end associate
         return
      end do
   end subroutine check_friction

   !> Check that weight and density are in consistent units.
   subroutine check_weight(self, parameters)
      class(inspection_type), intent(inout) :: self
      type(parameters_type), intent(in) :: parameters
      real(wp) :: acceleration
      integer :: k
      if (parameters%gravity >= 0) return
      do k = 1, size(self%block_used)
         associate (m => parameters%block_materials(k))
            acceleration = abs(m%weight)/m%density
            if (.not. self%block_used(k) .or. .not. abs(m%weight) > 0) cycle
            if (acceleration >= smallest_acceleration .and. acceleration <= largest_acceleration) cycle
            call self%warn('weight '//to_string(m%weight)//' and density '//to_string(m%density)// &
                  ' of block material '//to_string(k)//' give an acceleration of '//to_string(acceleration, 3)// &
                           ', not 9.81: do their units fit together (N with kg, kN with t)?', .false., m%origin)
         end associate
         return
      end do
   end subroutine check_weight

   !> Check that a unit weight that is given beside a gravity is density times gravity.
   subroutine check_gravity(self, parameters, gravity)
      class(inspection_type), intent(inout) :: self
      type(parameters_type), intent(in) :: parameters
      real(wp), intent(in) :: gravity            !! of the options
      integer :: k
      if (parameters%gravity >= 0) return        ! no material has a weight of its own
      do k = 1, size(self%block_used)
         associate (m => parameters%block_materials(k))
            if (.not. self%block_used(k)) cycle
            if (abs(m%weight - m%density*gravity) <= weight_tolerance*abs(m%density*gravity)) cycle
            call self%warn('unit_weight '//parameters%shown(m%weight, 'force/length^2', 6)//' of block material '// &
                           to_string(k)//' is not its density times the gravity of &load, '// &
                           parameters%shown(m%density*gravity, 'force/length^2', 6)// &
                           ': the unit weight counts', .false., m%origin)
         end associate
         return
      end do
   end subroutine check_gravity

   !> Check that blocks are stiff enough for their own weight.
   subroutine check_modulus(self, parameters)
      class(inspection_type), intent(inout) :: self
      type(parameters_type), intent(in) :: parameters
      real(wp) :: strain
      integer :: k
      do k = 1, size(self%block_used)
         associate (e => parameters%block_materials(k)%youngs_modulus)
            if (.not. self%block_used(k)) cycle
            strain = self%unit_weight*self%height/e
            if (.not. strain > largest_strain) cycle
            call self%warn('Young''s modulus of block material '//to_string(k)//' is '// &
                      parameters%shown(e, 'stress', 6)// &
                      ': the weight of the model, '//parameters%shown(self%unit_weight, 'force/length^2', 4)// &
                      ' times its height '//parameters%shown(self%height, 'length', 4)// &
                      ', strains such blocks by '//to_string(100*strain, 2)// &
                      ' %: is E in the unit of stress that fits the weights?', .false., &
                           parameters%block_materials(k)%origin)
         end associate
         return
      end do
   end subroutine check_modulus

   !> Check that contact springs are stiff enough for the model.
   subroutine check_stiffness(self, parameters, from_options, place)
      class(inspection_type), intent(inout) :: self
      type(parameters_type), intent(in) :: parameters
      logical, intent(in) :: from_options              !! the options file has the stiffness
      type(origin_type), intent(in) :: place       !! of the value in the options, empty: not there
      real(wp) :: penetration, e_max
      penetration = self%unit_weight*self%height/(2*parameters%normal_stiffness)
      e_max = maxval(parameters%block_materials%youngs_modulus, mask=self%block_used)
      if (penetration > largest_penetration .and. parameters%normal_stiffness >= e_max .and. &
          2*penetration*parameters%normal_stiffness > largest_strain*e_max) then
         ! E is too low already; the contact stiffness follows from it and is not reported again
         return
      else if (penetration > largest_penetration) then
         call self%warn('contact stiffness g0 = '//parameters%shown(parameters%normal_stiffness, 'force/length', 6)// &
            ': under the weight of the model, '//parameters%shown(self%unit_weight, 'force/length^2', 4)// &
            ' times its height '//parameters%shown(self%height, 'length', 4)// &
            ', blocks sink into each other by '//to_string(100*penetration, 2)//' % of their size', from_options, place)
      else if (parameters%normal_stiffness < smallest_stiffness_ratio*e_max) then
         call self%warn('contact stiffness g0 = '//parameters%shown(parameters%normal_stiffness, 'force/length', 6)// &
                   ' is '//to_string(parameters%normal_stiffness/e_max, 2)//' times Young''s modulus '// &
                   parameters%shown(e_max, 'stress', 6)// &
                   ': contacts are far softer than the blocks', from_options, place)
      end if
   end subroutine check_stiffness

   !> Check that joints are stiff enough for the initial stress: splinters that are no thicker than what their joints
   !> close by are pressed through their neighbours when the stress changes.
   subroutine check_closure(self, blocks, parameters)
      class(inspection_type), intent(inout) :: self
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(initial_stress_type) :: initial
      integer, allocatable :: material(:)                 !! joint that closes most, of each block
      real(wp), allocatable :: closure(:), share(:)       !! of it [length], over the thickness of the block
      integer :: i
      if (.not. parameters%by_length) return
      call find_initial_stress(blocks, parameters, initial)
      allocate (material(blocks%n_blocks), source=0)
      allocate (closure(blocks%n_blocks), share(blocks%n_blocks), source=0.0_wp)
      do i = 1, blocks%n_blocks
         associate (first => blocks%vertex_offset(i) + 1, last => blocks%vertex_offset(i + 1))
            call find_softest(blocks%edge_joint(first:last), parameters, material(i))
            if (material(i) == 0) cycle
            closure(i) = -minval(initial%stress(1:2, i))/parameters%joint_materials(material(i))%normal_stiffness
            share(i) = closure(i)/thickness(blocks%vertices(:, first:last))
         end associate
      end do
      if (.not. any(share > largest_closure)) return
      i = maxloc(share, dim=1)
      call self%warn('joints of material '//to_string(material(i))//' close by '// &
                     parameters%shown(closure(i), 'length', 3)// &
                     ' under the initial stress of block '//to_string(i)//' at ('// &
                     to_string(initial%centroid(1, i), 5)//', '//to_string(initial%centroid(2, i), 5)//'), '// &
                     to_string(100*share(i), 2)//' % of its thickness ('// &
                     counted(count(share > largest_closure), 'block')//' by more than '// &
                     to_string(nint(100*largest_closure))//' %): such blocks may be pressed through their '// &
                     'neighbours. Is normal_stiffness in the unit of stress over length? Else cut splinters away', &
                     .false., parameters%joint_materials(material(i))%origin)
   end subroutine check_closure

   !> The joint material with the least stiffness of its own on the edges of a block, 0: none has one. Ties close by
   !> nothing.
   pure subroutine find_softest(joints, parameters, material)
      integer, intent(in) :: joints(:)                    !! joint material of each edge
      type(parameters_type), intent(in) :: parameters
      integer, intent(out) :: material
      real(wp) :: least
      integer :: e
      material = 0
      least = huge(least)
      do e = 1, size(joints)
         if (joints(e) < 1 .or. joints(e) > size(parameters%joint_materials)) cycle
         associate (stiffness => parameters%joint_materials(joints(e))%normal_stiffness)
            if (.not. stiffness > 0 .or. .not. stiffness < least) cycle
            if (parameters%joint_materials(joints(e))%tie) cycle
            least = stiffness
            material = joints(e)
         end associate
      end do
   end subroutine find_softest

   !> Area over the longest edge.
   pure real(wp) function thickness(vertices)
      real(wp), intent(in) :: vertices(:, :)              !! (2, n)
      real(wp) :: area, centroid(2), moments(3), longest
      integer :: k, n
      n = size(vertices, 2)
      call polygon_properties(vertices, area, centroid, moments)
      longest = norm2(vertices(:, 1) - vertices(:, n))
      do k = 2, n
         longest = max(longest, norm2(vertices(:, k) - vertices(:, k - 1)))
      end do
      thickness = area/longest
   end function thickness

   !> Check that there is a load or a motion.
   subroutine check_loads(self, blocks, parameters, has_gravity)
      class(inspection_type), intent(inout) :: self
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      logical, intent(in) :: has_gravity               !! the options give a gravity, which may be 0
      integer :: k
      if (self%unit_weight > 0) return
      if (.not. has_gravity .and. len(self%analysis_file) == 0) then
         call self%warn('the blocks have no weight: no gravity; write &load gravity = 9.81 / (in m and s), '// &
                        'or gravity = 0 where that is meant', .true.)
         return
      end if
      if (size(parameters%line_loads) > 0) return
      if (allocated(parameters%base%table) .or. allocated(parameters%base%harmonics)) return
      if (allocated(parameters%quakes)) then
         if (size(parameters%quakes) > 0) return
      end if
      if (acts(parameters%fixed_tables) .or. acts(parameters%loading_tables)) return
      if (allocated(parameters%in_situ)) then
         if (size(parameters%in_situ) > 0) return
      end if
      if (allocated(parameters%boundaries)) then
         do k = 1, size(parameters%boundaries)
            if (parameters%boundaries(k)%kind == 'moving' .or. parameters%boundaries(k)%kind == 'traction') return
         end do
      end if
      do k = 1, size(self%block_used)
         if (.not. self%block_used(k)) cycle
         associate (m => parameters%block_materials(k))
            if (any(abs([m%stress, m%stress_gradient, m%velocity]) > 0)) return
         end associate
      end do
      if (blocks%bolts%n > 0) then
         if (any(abs(blocks%bolts%pretension) > 0)) return
      end if
      call self%warn('the weight of all blocks is 0 and there is no other load, initial stress or velocity: '// &
                'nothing moves the blocks', .false.)
   end subroutine check_loads

   !> Does one of these tables hold values other than 0?
   pure logical function acts(tables)
      type(time_table_type), intent(in) :: tables(:)
      integer :: k
      acts = .false.
      do k = 1, size(tables)
         if (.not. allocated(tables(k)%rows)) cycle
         acts = acts .or. any(abs(tables(k)%rows(2:3, :)) > 0)
      end do
   end function acts

   !> Check that there is a support or a boundary that holds; a single block, and blocks with an initial velocity, need
   !> none.
   subroutine check_supports(self, blocks, parameters)
      class(inspection_type), intent(inout) :: self
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      integer :: k
      if (.not. self%unit_weight > 0 .or. blocks%fixed%n > 0 .or. blocks%n_blocks == 1) return
      if (allocated(parameters%boundaries)) then
         do k = 1, size(parameters%boundaries)
            if (parameters%boundaries(k)%kind /= 'traction') return
         end do
      end if
      do k = 1, size(self%block_used)
         if (self%block_used(k) .and. any(abs(parameters%block_materials(k)%velocity) > 0)) return
      end do
      if (blocks%bolts%n > 0) then
         if (any(blocks%bolts%blocks == 0)) return
      end if
      call self%warn('the blocks have weight, but no fixed point or boundary holds one of them: all of them fall', &
                     .false.)
   end subroutine check_supports

   !> Check that no block that is held begins with a velocity: supports are springs, on which it swings undamped.
   subroutine check_held_velocity(self, blocks, parameters)
      class(inspection_type), intent(inout) :: self
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      real(wp) :: holds(blocks%n_blocks)
      integer :: i, k
      call blocks%count_holds(holds)
      do i = 1, blocks%n_blocks
         k = blocks%block_material(i)
         if (holds(i) < 2 .or. .not. any(abs(parameters%block_materials(k)%velocity) > 0)) cycle
         call self%warn('block '//to_string(i)//' is held by '//counted(nint(holds(i)), 'fixed point')// &
                        ', and block material '//to_string(k)//' gives it a velocity: it swings on these and '// &
                        'shakes what it touches; give it a material of its own', .false., &
                        parameters%block_materials(k)%origin)
         return
      end do
   end subroutine check_held_velocity

   !> Warn where `sleep = 'on'` has no effect because the model has what no block sleeps with
   !> (rockdda_stepping_acceptance), and where its tolerance is given without it.
   subroutine check_sleep(self, parameters, options)
      class(inspection_type), intent(inout) :: self
      type(parameters_type), intent(in) :: parameters
      type(run_options_type), intent(in) :: options
      character(len=:), allocatable :: what
      real(wp) :: changes, ends
      integer :: k
      if (is_set(options%sleep_tolerance) .and. .not. parameters%sleeps) &
         call self%warn("sleep_tolerance has no effect without sleep = 'on'", .true., options%sleep_tolerance_origin)
      if (.not. parameters%sleeps) return
      what = ''
      ! steps are no longer than dt_max while tables change
      ends = parameters%t_end
      if (parameters%n_steps > 0) ends = min(ends, parameters%n_steps*parameters%dt_max)
      changes = last_change(parameters)
      if (changes > 0 .and. changes >= ends*(1 - 1.0e-9_wp)) &
         what = 'loads, supports or tractions that change until time '//parameters%shown(changes, 'time')// &
                ', when the run is over'
      if (allocated(parameters%base%harmonics)) what = 'a harmonic base motion'
      do k = 1, size(self%joint_used)
         if (self%joint_used(k) .and. is_set(parameters%joint_materials(k)%restitution)) what = 'restitution'
      end do
      if (allocated(parameters%water)) then
         if (size(parameters%water) > 0) what = 'water'
      end if
      if (parameters%sleep_tolerance > largest_sleep) call self%warn('sleep_tolerance = '// &
         to_string(parameters%sleep_tolerance, 3)//': blocks sleep that lack this share of the forces for balance, '// &
         'and do not begin to slide', .true., options%sleep_tolerance_origin)
      if (len(what) > 0) call self%warn("sleep = 'on' has no effect: no block sleeps in a model with "//what, .true., &
                                        options%sleep_origin)
   end subroutine check_sleep

   !> Time at which the last table of loads, supports or tractions ends to change; 0 without such tables.
   pure real(wp) function last_change(parameters)
      type(parameters_type), intent(in) :: parameters
      integer :: i
      last_change = 0
      do i = 1, size(parameters%fixed_tables)
         call take_change(parameters%fixed_tables(i)%rows)
      end do
      do i = 1, size(parameters%loading_tables)
         call take_change(parameters%loading_tables(i)%rows)
      end do
      do i = 1, size(parameters%line_loads)
         call take_change(parameters%line_loads(i)%table)
      end do
      if (.not. allocated(parameters%boundaries)) return
      do i = 1, size(parameters%boundaries)
         call take_change(parameters%boundaries(i)%table)
      end do

   contains

      !> Take the time of the last change in a table.
      pure subroutine take_change(rows)
         real(wp), allocatable, intent(in) :: rows(:, :)   !! time first
         integer :: k
         if (.not. allocated(rows)) return
         do k = 2, size(rows, 2)
            if (any(abs(rows(2:, k) - rows(2:, k - 1)) > 0)) last_change = max(last_change, rows(1, k))
         end do
      end subroutine take_change

   end function last_change

   !> Check that steps are short enough to follow the motion of the base.
   subroutine check_step(self, parameters, from_options, place)
      class(inspection_type), intent(inout) :: self
      type(parameters_type), intent(in) :: parameters
      logical, intent(in) :: from_options      !! dt_max is from the options file
      type(origin_type), intent(in) :: place       !! of the value in the options, empty: not there
      real(wp) :: longest
      integer :: i, n
      character(len=:), allocatable :: what
      longest = huge(1.0_wp)
      what = ''
      if (allocated(parameters%base%harmonics)) then
         do i = 1, size(parameters%base%harmonics, 2)
            associate (frequency => abs(parameters%base%harmonics(3, i)))
               if (.not. frequency*parameters%dt_max*least_of_period > 1) cycle
               if (.not. 1 < longest*least_of_period*frequency) cycle
               longest = 1/(least_of_period*frequency)
               what = 'the base has a period of '//parameters%shown(1/frequency, 'time', 3)
            end associate
         end do
      end if
      if (allocated(parameters%quakes)) then
         do i = 1, size(parameters%quakes)
            if (.not. allocated(parameters%quakes(i)%rows)) cycle
            n = size(parameters%quakes(i)%rows, 2)
            if (n < 2) cycle
            associate (spacing => (parameters%quakes(i)%rows(1, n) - parameters%quakes(i)%rows(1, 1))/(n - 1))
               if (.not. parameters%dt_max > most_of_record*spacing .or. .not. most_of_record*spacing < longest) cycle
               longest = most_of_record*spacing
               what = 'the record has a row each '//parameters%shown(spacing, 'time', 3)
            end associate
         end do
      end if
      if (len(what) > 0) call self%warn('steps of '//parameters%shown(parameters%dt_max, 'time', 3)// &
                                        ' (g1, dt_max) do not follow the motion of the base: '//what// &
                                        '; give dt_max, at most '//parameters%shown(longest, 'time', 3), from_options, &
                                        place)
   end subroutine check_step

   !> Check that joints have damping where the base moves: their springs vibrate, and blocks slip by some percent more
   !> or less than friction lets them, which shorter steps make no better.
   subroutine check_damping(parameters, used, messages)
      type(parameters_type), intent(in) :: parameters
      logical, intent(in) :: used(:)                      !! joint materials of the edges
      type(diagnostics_type), intent(inout) :: messages
      type(origin_type) :: origin
      character(len=:), allocatable :: names
      integer :: k, n
      if (parameters%sliding_damping > 0 .or. .not. has_base_motion(parameters%base, parameters%quakes)) return
      names = ''
      n = 0
      do k = 1, size(used)
         associate (joint => parameters%joint_materials(k))
            if (.not. used(k) .or. joint%damping_ratio > 0 .or. joint%tie) cycle
            n = n + 1
            if (n == 1) origin = joint%origin
            if (n > 1) names = names//', '
            names = names//to_string(k)
            if (is_given(joint%name)) names = names//" ('"//trim(joint%name)//"')"
         end associate
      end do
      if (n == 0) return
      names = 'joint material'//trim(merge(' ', 's', n == 1))//' '//names//' '//trim(merge('has ', 'have', n == 1))
      call messages%add(severity%warning, 'the base moves, and '//names//' no damping_ratio: their springs '// &
                        'vibrate, and blocks slip by some percent more or less than friction lets them, which '// &
                        'shorter steps make no better; give damping_ratio = 0.5, for example', origin)
   end subroutine check_damping

   !> Check that damping in proportion to mass leaves blocks their velocity for some steps.
   subroutine check_mass_damping(parameters, origin, messages)
      type(parameters_type), intent(in) :: parameters
      type(origin_type), intent(in) :: origin             !! of its value
      type(diagnostics_type), intent(inout) :: messages
      if (.not. parameters%mass_damping*parameters%dt_max*least_steps > 1) return
      associate (alpha => parameters%mass_damping)
         call messages%add(severity%warning, 'mass_proportional takes the velocity of blocks within '// &
            parameters%shown(1/alpha, 'time', 3)//', '//to_string(1/(alpha*parameters%dt_max), 2)// &
            ' of the longest step: they fall no faster than '// &
            parameters%shown(parameters%acceleration_of_gravity()/alpha, 'length/time', 3)//' and stand still '// &
            'where they should slide. Critical damping of an oscillation of frequency f is 4 pi f', origin)
      end associate
   end subroutine check_mass_damping

end module rockdda_check_plausibility
