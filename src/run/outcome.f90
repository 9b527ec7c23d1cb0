! SPDX-License-Identifier: MIT
!> Report at the end of a run: computed share of the planned time, and reasons for short steps.
module rockdda_run_outcome
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : counted, is_given, to_string
   use rockdda_model_options, only : is_set
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_stage_options, only : stage_name, has_base_motion, seeks_equilibrium
   use rockdda_stepping_control, only : step_control_type, n_cut_reasons
   use rockdda_check_tables, only : unreached_tables_text
   use rockdda_stepping_simulation, only : simulation_type
   use rockdda_interaction_elasticity, only : compliance
   implicit none
   private
   public :: done_share, stage_share, last_stage, short_run_warning, cuts_text, weak_start_warning, &
      skipped_stages_warning, reactions_text, time_error_text, time_error_warning, strikes_text, strikes_warning, &
      share_after_strikes, overlaps_warning, unrested_warning, lost_text, lodged_warning, strain_warning, &
      slid_lining_warning, sheared_lining_warning, peaked_lining_warning, &
      unreached_stages_warning, unreached_tables_text

   !> Largest strain that linear elasticity is meant for.
   real(wp), parameter :: much_strain = 0.05_wp
   !> Slip over the length of an element at which a lining is no longer beside the rock that it was installed on.
   real(wp), parameter :: far_slid = 0.5_wp
   !> Largest number of pairs named in one message.
   integer, parameter :: most_named = 3

   !> Warn when all steps cover less than this share of the planned time.
   real(wp), parameter :: least_share = 0.8_wp
   !> Warn of an estimated error in time, and of motion after strikes, above this share of the largest displacement.
   real(wp), parameter :: much_error = 0.05_wp
   !> The same where the base moves and blocks slide: the error of friction that turns is several times the estimate.
   real(wp), parameter :: much_turning = 0.01_wp
   !> Blocks slide when friction has taken this share of the largest kinetic energy.
   real(wp), parameter :: little_friction = 0.01_wp
   !> Blocks that move by less than these shares of w0, and of g2 w0, to which errors are compared, are at rest.
   real(wp), parameter :: at_rest(2) = [2.0e-5_wp, 5.0e-3_wp]
   !> Unbalanced force that counts as equilibrium where no stage says it.
   real(wp), parameter :: usual_tolerance = 1.0e-5_wp
   character(len=*), parameter :: cut_texts(n_cut_reasons) = [character(len=46) :: &
                                                              'a vertex would have moved further than g2*w0', &
                                                              'contacts did not settle', &
                                                              'the equations could not be solved', &
                                                              'a block would have inverted or vanished']

contains

   !> Name of the stage of the last step.
   pure function last_stage(sim) result(name)
      type(simulation_type), intent(in) :: sim
      character(len=:), allocatable :: name
      name = stage_name(sim%parameters%stages, sim%record%stage + 1)
   end function last_stage

   !> Share of the planned time that has been computed, 1 when no time was planned.
   pure real(wp) function done_share(sim)
      type(simulation_type), intent(in) :: sim
      done_share = 1
      if (sim%planned_time() > 0) done_share = min(1.0_wp, sim%state%time/sim%planned_time())
   end function done_share

   !> Share of the present stage that is done, for a display: of its time or its steps, or on the way of the unbalanced
   !> force to its tolerance, by the logarithm; 0 where nothing says it.
   pure real(wp) function stage_share(sim)
      type(simulation_type), intent(in) :: sim
      real(wp) :: still
      stage_share = 0
      if (sim%control%stage > size(sim%parameters%stages)) return
      associate (stage => sim%parameters%stages(sim%control%stage), control => sim%control, state => sim%state)
         if (is_set(stage%duration)) then
            stage_share = (state%time - control%first_time)/stage%duration
         else if (is_set(stage%until_time)) then
            stage_share = (state%time - control%first_time)/(stage%until_time - control%first_time)
         else if (is_set(stage%until_step)) then
            stage_share = real(state%step - control%first_step, wp)/real(stage%until_step - control%first_step, wp)
         else if (seeks_equilibrium(stage) .and. state%step > control%first_step) then
            still = min(1.0_wp, max(sim%record%unbalanced, stage%tolerance))
            stage_share = log(still)/log(stage%tolerance)
         end if
      end associate
      stage_share = min(1.0_wp, max(0.0_wp, stage_share))
   end function stage_share

   !> Warning about a run whose steps cover only part of the planned time; '' otherwise.
   function short_run_warning(sim) result(text)
      type(simulation_type), intent(in) :: sim
      character(len=:), allocatable :: text
      text = ''
      if (done_share(sim) >= least_share) return
      ! the stages have ended the run
      associate (p => sim%parameters)
         if (p%ends_with_stages .and. sim%state%step < p%n_steps .and. sim%state%time < p%t_end) return
      end associate
      text = 'only '//to_string(100*done_share(sim), 3)//' % of the planned time was computed: '// &
             to_string(sim%state%step)//' steps ended at time '//sim%parameters%shown(sim%state%time, 'time', 6)// &
             ' instead of '//sim%parameters%shown(sim%planned_time(), 'time', 6)//'. '//cuts_text(sim)// &
             '. Do not take the state at the end for the final one: --t-end computes up to a time'
   end function short_run_warning

   !> Warning about stress in the ground that joints cannot carry, after the first step; '' otherwise.
   function weak_start_warning(sim) result(text)
      type(simulation_type), intent(in) :: sim
      character(len=:), allocatable :: text
      integer :: n(2)
      text = ''
      n = sim%weak_starts()
      if (size(sim%parameters%in_situ) == 0 .or. all(n == 0)) return
      text = 'the blocks will move from the stress of &in_situ: '
      if (n(1) > 0) text = text//'its shear exceeds the strength of '//counted(n(1), 'contact point')
      if (all(n > 0)) text = text//', and '
      if (n(2) > 0) text = text//counted(n(2), 'contact point')//' would be in tension'
   end function weak_start_warning

   !> Warning about stages that were over before they began; '' otherwise. At the end of a run those after which nothing
   !> was computed.
   function skipped_stages_warning(sim, at_end) result(text)
      type(simulation_type), intent(in) :: sim
      logical, intent(in) :: at_end
      character(len=:), allocatable :: text
      type(step_control_type) :: control
      integer, allocatable :: stages(:)
      integer :: i
      text = ''
      if (at_end) then
         control = sim%control
         call control%end_stages(sim%parameters, sim%state%step, sim%state%time)
         stages = control%skipped(sim%parameters)
      else if (allocated(sim%skipped)) then
         stages = sim%skipped
      else
         return
      end if
      do i = 1, size(stages)
         if (i > 1) text = text//'; '
         text = text//"stage '"//stage_name(sim%parameters%stages, stages(i))//"' was over before it began: "
         associate (stage => sim%parameters%stages(stages(i)))
            if (is_set(stage%until_step)) then
               text = text//'until_step '//to_string(stage%until_step)//' had passed'
            else if (is_set(stage%until_time)) then
               text = text//'until_time '//sim%parameters%shown(stage%until_time, 'time', 6)//' had passed'
            else
               text = text//'its duration of '//sim%parameters%shown(stage%duration, 'time', 6)//' had passed'
            end if
         end associate
         if (at_end) then
            text = text//', nothing of it was done'
         else
            text = text//', what happens at its start was done with the next stage'
         end if
      end do
      if (len(text) > 0) text = text//' (duration counts from the start of a stage)'
   end function skipped_stages_warning

   !> Warning about stages that have not begun at the end of a run; '' otherwise.
   function unreached_stages_warning(sim) result(text)
      type(simulation_type), intent(in) :: sim
      character(len=:), allocatable :: text
      type(step_control_type) :: control
      integer :: i, first
      text = ''
      control = sim%control
      call control%end_stages(sim%parameters, sim%state%step, sim%state%time)
      first = max(control%begun + 1, control%stage)
      do i = first, size(sim%parameters%stages)
         text = text//", '"//stage_name(sim%parameters%stages, i)//"'"
      end do
      if (len(text) == 0) return
      text = 'stage'//trim(merge(' ', 's', first == size(sim%parameters%stages)))//text(2:)// &
             ' not reached: the run ends with step '//to_string(sim%state%step)//' at time '// &
             sim%parameters%shown(sim%state%time, 'time', 6)//', by '
      if (sim%state%step >= sim%parameters%n_steps) then
         text = text//'steps = '//to_string(sim%parameters%n_steps)
      else
         text = text//'t_end = '//sim%parameters%shown(sim%parameters%t_end, 'time', 6)
      end if
   end function unreached_stages_warning

   !> Warning about a static stage that ends without equilibrium, however it ends, after its last step; '' otherwise,
   !> and where the next step is an error.
   function unrested_warning(sim) result(text)
      type(simulation_type), intent(in) :: sim
      character(len=:), allocatable :: text
      real(wp) :: tolerance
      text = ''
      associate (control => sim%control, p => sim%parameters, state => sim%state)
         if (.not. control%is_static(p)) return
         tolerance = usual_tolerance
         if (control%stage <= size(p%stages)) tolerance = p%stages(control%stage)%tolerance
         if (.not. (sim%record%unbalanced > tolerance .or. control%watch%restless > 0)) return
         if (.not. sim%is_finished() .and. control%following_stage(p, state%step, state%time) == control%stage) return
         if (.not. sim%record%unbalanced > tolerance) then
            text = "stage '"//stage_name(p%stages, control%stage)//"' ended while block "// &
                   to_string(control%watch%restless)//' at ('// &
                   to_string(state%centroid(1, control%watch%restless) + state%datum(1), 5)//', '// &
                   to_string(state%centroid(2, control%watch%restless) + state%datum(2), 5)//') still moves, by '// &
                   sim%parameters%shown(sim%record%max_displacement, 'length', 3)// &
                   ' in the last step: the forces on it are below the tolerance, but do not fall; '// &
                   'a smaller tolerance follows it'
            return
         end if
         text = "stage '"//stage_name(p%stages, control%stage)//"' ended without equilibrium after "// &
                counted(control%steps, 'step')//': the unbalanced force is '//to_string(sim%record%unbalanced, 3)// &
                ' of the mean force, tolerance '//to_string(tolerance)
      end associate
   end function unrested_warning

   !> The error of a static stage in which the model no longer follows the load; '' otherwise.
   function lost_text(sim) result(text)
      type(simulation_type), intent(in) :: sim
      character(len=:), allocatable :: text
      text = ''
      associate (watch => sim%control%watch)
         if (.not. watch%is_lost) return
         text = "stage '"//stage_name(sim%parameters%stages, sim%control%stage)//"': lost equilibrium at "// &
                to_string(watch%lost_share, 2)//' of the load table, t = '// &
                sim%parameters%shown(watch%lost_time, 'time', 3)//': the load rises on and the blocks run away (at '// &
                't = '//sim%parameters%shown(sim%state%time, 'time', 3)//' the unbalanced force is '// &
                to_string(sim%record%unbalanced, 3)//' of the mean force). The faster a table rises, the more '// &
                "of it inertia carries, and the later this is found: 'rockdda fos --search load' finds the limit itself"
      end associate
   end function lost_text

   !> Warning about blocks that were placed where others lay, after the first step with them; '' otherwise.
   function overlaps_warning(sim) result(text)
      type(simulation_type), intent(in) :: sim
      character(len=:), allocatable :: text
      text = ''
      if (.not. allocated(sim%construction%overlaps)) return
      associate (pairs => sim%construction%overlaps)
         if (size(pairs, 2) == 0) return
         text = "stage '"//stage_name(sim%parameters%stages, sim%control%begun)// &
                "' places blocks where others have moved to: block "//to_string(pairs(1, 1))//' on block '// &
                to_string(pairs(2, 1))
         if (size(pairs, 2) > 1) text = text//', and '//counted(size(pairs, 2) - 1, 'more pair')
         text = text//'. They will be pressed apart; excavate what lies there before'
      end associate
   end function overlaps_warning

   !> The estimated error in time at the end of a run with dynamic steps; '' without.
   pure function time_error_text(sim) result(text)
      type(simulation_type), intent(in) :: sim
      character(len=:), allocatable :: text
      text = ''
      if (sim%record%time_error > 0) text = 'estimated time error '//to_string(sim%record%time_error, 2)// &
                                            ' of the largest displacement'
   end function time_error_text

   !> Warning about an answer that depends on the time step; '' otherwise.
   pure function time_error_warning(sim) result(text)
      type(simulation_type), intent(in) :: sim
      character(len=:), allocatable :: text
      text = ''
      ! where the dynamic part has moved the blocks by next to nothing, the estimate is that of rounding
      if (sim%control%time_error%largest < rest(sim%parameters)) return
      if (.not. sim%record%time_error > merge(much_turning, much_error, slides_on_base(sim))) return
      text = 'the answer may depend on the time step: '//time_error_text(sim)
      if (slides_on_base(sim)) text = text//', and where friction turns the error is several times as large'
      text = text//'; compare with half of dt_max'//undamped_text(sim)
   end function time_error_warning

   !> The joint materials of the blocks in which nothing takes up vibrations, or the rebound after strikes; '' where all
   !> have what does, or no contact is closed.
   pure function undamped_text(sim, strikes) result(text)
      type(simulation_type), intent(in) :: sim
      logical, intent(in), optional :: strikes   !! default: vibrations
      character(len=:), allocatable :: text
      logical :: rebounds
      integer :: k, n
      text = ''
      n = 0
      rebounds = .false.
      if (present(strikes)) rebounds = strikes
      do k = 1, size(sim%parameters%joint_materials)
         associate (joint => sim%parameters%joint_materials(k))
            if (joint%damping_ratio > 0 .or. joint%tie .or. .not. any(sim%blocks%edge_joint == k)) cycle
            if (rebounds .and. is_set(joint%restitution)) cycle
            n = n + 1
            if (n > 1) text = text//', '
            text = text//to_string(k)
            if (is_given(joint%name)) text = text//" ('"//trim(joint%name)//"')"
         end associate
      end do
      if (n == 0) return
      text = '. Joint material'//trim(merge(' ', 's', n == 1))//' '//text//' '//trim(merge('has ', 'have', n == 1))
      if (rebounds) then
         text = text//' neither restitution nor damping_ratio: springs and time step decide the rebound; give '// &
                'restitution, for example'
      else
         text = text//' no damping_ratio: springs vibrate, which shorter steps make no better; give '// &
                'damping_ratio = 0.5, for example'
      end if
   end function undamped_text

   !> Displacement below which blocks are at rest [length].
   pure real(wp) function rest(p)
      type(parameters_type), intent(in) :: p
      rest = min(at_rest(1), at_rest(2)*p%displacement_ratio)*p%w0
   end function rest

   !> Does the base move under blocks that slide? Without a ledger they may.
   pure logical function slides_on_base(sim)
      type(simulation_type), intent(in) :: sim
      associate (p => sim%parameters, error => sim%control%time_error)
         slides_on_base = has_base_motion(p%base, p%quakes)
         if (slides_on_base .and. p%energy) slides_on_base = error%friction > little_friction*error%largest_kinetic
      end associate
   end function slides_on_base

   !> Largest displacement of a block after it struck another one, over the largest displacement.
   pure real(wp) function share_after_strikes(sim) result(share)
      type(simulation_type), intent(in) :: sim
      share = 0
      if (sim%control%time_error%largest > 0) share = sim%control%strikes%way_after(sim%step_context_type, &
                                                                sim%trial%attempt_type)/sim%control%time_error%largest
   end function share_after_strikes

   !> Blocks that struck others, and how far they moved on; '' without. The estimated error leaves it out.
   pure function strikes_text(sim) result(text)
      type(simulation_type), intent(in) :: sim
      character(len=:), allocatable :: text
      integer :: n
      text = ''
      n = sim%control%strikes%count_struck()
      if (n > 0) text = counted(n, 'block')//' struck others and then moved by up to '// &
                        to_string(share_after_strikes(sim), 2)//' of the largest displacement'
   end function strikes_text

   !> Warning about motion after strikes, which depends on each step; '' otherwise, and where another warning about
   !> the error in time shows it.
   pure function strikes_warning(sim) result(text)
      type(simulation_type), intent(in) :: sim
      character(len=:), allocatable :: text
      text = ''
      if (.not. share_after_strikes(sim) > much_error .or. len(time_error_warning(sim)) > 0) return
      if (.not. sim%control%strikes%way_after(sim%step_context_type, sim%trial%attempt_type) > rest(sim%parameters)) &
          return
      text = 'where blocks end may depend on the time step more than the estimated time error says: '// &
             strikes_text(sim)//'; compare with half of dt_max'//undamped_text(sim, strikes=.true.)
   end function strikes_warning

   !> Forces of the boundaries on the blocks, a line for each.
   function reactions_text(sim) result(text)
      type(simulation_type), intent(in) :: sim
      character(len=:), allocatable :: text
      integer :: g
      text = ''
      do g = 1, size(sim%record%boundary_force, 2)
         if (g > 1) text = text//new_line('a')
         text = text//'# boundary '//to_string(g)//' ('//sim%parameters%boundaries(g)%kind// &
                '): force on the blocks ('//sim%parameters%shown(sim%record%boundary_force(1, g), 'force', 10)//', '// &
                sim%parameters%shown(sim%record%boundary_force(2, g), 'force', 10)//')'
      end do
   end function reactions_text

   !> How often steps were cut, by reason.
   function cuts_text(sim) result(text)
      type(simulation_type), intent(in) :: sim
      character(len=:), allocatable :: text
      integer :: i
      text = ''
      do i = 1, n_cut_reasons
         if (sim%control%cuts(i) == 0) cycle
         if (len(text) > 0) text = text//', '
         text = text//to_string(sim%control%cuts(i))//' times because '//trim(cut_texts(i))
      end do
      if (len(text) == 0) then
         text = 'No step was cut'
      else
         text = 'Steps were cut '//text
      end if
      if (sim%control%short_steps > 0) text = text//'; after '//to_string(sim%control%short_steps)// &
         ' steps the limit g2*w0 kept the next one short'
   end function cuts_text

   !> Warning about pairs of blocks that stand inside each other, in the step in which they are found; '' for none.
   function lodged_warning(sim) result(text)
      type(simulation_type), intent(in) :: sim
      character(len=:), allocatable :: text
      integer :: k
      text = ''
      if (size(sim%construction%lodging%found) == 0) return
      associate (pairs => sim%construction%lodging%found)
         do k = 1, min(size(pairs), most_named)
            if (k > 1) text = text//', '
            text = text//'blocks '//to_string(pairs(k)%blocks(1))//' and '//to_string(pairs(k)%blocks(2))//' at '// &
                   at(pairs(k)%place + sim%state%datum)//' by '//sim%parameters%shown(pairs(k)%depth, 'length', 3)// &
                   ' ('//to_string(100*pairs(k)%share, 2)//' % of the inradius of the smaller one)'
         end do
         if (size(pairs) > most_named) text = text//' and '//counted(size(pairs) - most_named, 'more pair')
         text = 'blocks stand inside each other after step '//to_string(sim%state%step)//', time '// &
                sim%parameters%shown(sim%state%time, 'time', 6)//': '//text// &
                '. What follows is not to be trusted: take shorter steps '// &
                '(dt_max, displacement_ratio) or stiffer joints, and examine blocks that are placed or struck'
      end associate
   end function lodged_warning

   !> Warning about the lining that has slid farthest along its rock, where that is more than half of the length of its
   !> elements; '' for none. Its back is held where it was installed: beyond that its ends carry moments that are not
   !> there, and rock that it comes beside does not meet it.
   function slid_lining_warning(sim) result(text)
      type(simulation_type), intent(in) :: sim
      character(len=:), allocatable :: text
      real(wp) :: slid, element, worst
      integer :: k
      text = ''
      worst = far_slid
      associate (liners => sim%families%liners%liners)
         do k = 1, size(liners)
            if (.not. (liners(k)%is_there .and. liners(k)%joint > 0)) cycle
            if (size(liners(k)%ties) == 0) cycle
            element = sum(liners(k)%ties%length)/max(1, liners(k)%layout%n)
            slid = maxval(abs(liners(k)%ties%free(2)), mask=liners(k)%ties%a > 0)
            if (.not. slid > worst*element) cycle
            worst = slid/element
            text = "lining '"//liners(k)%name//"' has slid by "//sim%parameters%shown(slid, 'length', 3)// &
                   ' along its rock, more than half of an element ('//sim%parameters%shown(element, 'length', 3)// &
                   '): its N, M and Q are not to be trusted, and rock that it has come beside does not meet it'
         end do
      end associate
   end function slid_lining_warning

   !> Warning about linings whose mean shear stress is beyond their tensile strength; '' for none. Sections are
   !> limited in N and M alone, and blocks that hang on one are cut out of it by shear.
   function sheared_lining_warning(sim) result(text)
      type(simulation_type), intent(in) :: sim
      character(len=:), allocatable :: text
      real(wp) :: shear
      integer :: k
      text = ''
      do k = 1, size(sim%families%liners%liners)
         shear = sim%families%liners%shear_stress(k)
         associate (liner => sim%families%liners%liners(k))
            if (.not. shear > liner%section%tension) cycle
            text = "lining '"//liner%name//"' has a mean shear stress of "// &
                   sim%parameters%shown(shear, 'stress', 3)// &
                   ', more than its tensile strength ('// &
                   sim%parameters%shown(liner%section%tension, 'stress', 3)// &
                   '): N and M limit its sections, shear does not; check it for blocks that are cut out'
            return
         end associate
      end do
   end function sheared_lining_warning

   !> Warning about linings whose largest axial force, by more than half of it, is that of one element alone; '' for
   !> none. A back that is held without slip takes what a joint of the rock opens or closes on a part of a thickness:
   !> shorter elements make the force larger.
   function peaked_lining_warning(sim) result(text)
      type(simulation_type), intent(in) :: sim
      character(len=:), allocatable :: text
      real(wp) :: peak, beside, largest
      integer :: k
      text = ''
      do k = 1, size(sim%families%liners%liners)
         call sim%families%liners%find_peak(k, peak, beside, largest)
         if (.not. peak - beside > 0.5_wp*largest) cycle
         text = "lining '"//sim%families%liners%liners(k)%name//"' has an axial force of "// &
                sim%parameters%shown(peak, 'thrust', 3)//' in one element, of '// &
                sim%parameters%shown(beside, 'thrust', 3)//' beside it: joints of the rock move below a back that '// &
                'is held without slip, and shorter elements (element) make it larger. Give it a joint_material '// &
                'with the stiffness and strength of its bond'
         return
      end do
   end function peaked_lining_warning

   !> Warning about the block of largest strain; '' when linear elasticity holds.
   function strain_warning(sim) result(text)
      type(simulation_type), intent(in) :: sim
      character(len=:), allocatable :: text
      real(wp), allocatable :: c(:, :, :)
      real(wp) :: e(3), strain, largest
      integer :: i, block
      text = ''
      associate (p => sim%parameters, state => sim%state)
         allocate (c(3, 3, size(p%block_materials)))
         do i = 1, size(p%block_materials)
            c(:, :, i) = compliance(p%block_materials(i)%youngs_modulus, p%block_materials(i)%poisson_ratio, &
                                    p%plane_strain)
         end do
         largest = much_strain
         block = 0
         do i = 1, sim%blocks%n_blocks - sim%blocks%n_segments
            if (.not. state%active(i)) cycle
            e = matmul(c(:, :, sim%blocks%block_material(i)), state%stress(:, i))
            strain = 0.5_wp*(abs(e(1) + e(2)) + sqrt((e(1) - e(2))**2 + e(3)**2))
            if (.not. strain > largest) cycle
            largest = strain
            block = i
         end do
         if (block == 0) return
         text = 'block '//to_string(block)//' at '//at(state%centroid(:, block) + state%datum)//' is strained by '// &
                to_string(100*largest, 2)//' % after step '//to_string(state%step)//', time '// &
                sim%parameters%shown(state%time, 'time', 6)//': blocks are linear elastic, which holds up to about '// &
                to_string(nint(100*much_strain))//' %; are E, density and loads in units that fit together?'
      end associate
   end function strain_warning

   !> A place as text.
   pure function at(place) result(text)
      real(wp), intent(in) :: place(2)
      character(len=:), allocatable :: text
      text = '('//to_string(place(1), 5)//', '//to_string(place(2), 5)//')'
   end function at

end module rockdda_run_outcome
