! SPDX-License-Identifier: MIT
!> Diagnosis of a step that cannot be solved: cause, place and advice.
!>
!> A failed attempt is repeated with a shorter step; `report_failure` composes the error of the attempt that fails with
!> the smallest step. Blocks are numbered from 1, coordinates are those at the start of the step.
module rockdda_stepping_failure
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use rockdda_base_kinds, only : wp
   use rockdda_base_parallel, only : parallel_blocks
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_strings, only : to_string
   use rockdda_geometry_polygons, only : inradius_bound
   use rockdda_model_block_names, only : block_name, with_block_names
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_contact_numbers, only : highest_over_e, mean_edge, advised_time_step, advised_ratio, &
      stiffness_advice, springs_of_joint
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_state, only : block_state_type
   use rockdda_contact_table, only : contact_table_type, contact_state
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_open_close, only : open_close_type
   use rockdda_interaction_kinematics, only : displacement_at, displacement_gradient
   use rockdda_stepping_motion, only : largest_displacement
   implicit none
   private
   public :: attempt_end, find_ruined_block, judge_motion, report_failure, most_listed

   !> Outcomes of one attempt at a step.
   type :: attempt_end_enum
      integer :: converged = 1
      integer :: not_converged = 2   !! contacts still change after the last round
      integer :: search_again = 3    !! a vertex moves beyond the search radius
      integer :: no_solution = 4     !! the linear solver failed or did not converge
      integer :: ruined = 5          !! a block is inverted or loses its area
      integer :: thrown = 6          !! a vertex moves by more than w0 in the smallest step
      integer :: interrupted = 7     !! a stop was requested
      integer :: too_far = 8         !! a vertex moves by more than g2 w0
   end type attempt_end_enum
   type(attempt_end_enum), parameter :: attempt_end = attempt_end_enum()

   !> Smallest area of a block after a step: over that before the step, and over that at the start of the run. A motion
   !> that leaves less is rejected.
   real(wp), parameter :: kept_in_step = 0.01_wp, kept_in_run = 1.0e-6_wp
   !> Largest number of contacts in a message.
   integer, parameter :: most_listed = 5

contains

   !> Number of the first block that the motion d inverts, or whose new area is too small or infinite; 0: none.
   !> The motion of a block is an affine map: the outline keeps its orientation and does not cross itself exactly when
   !> the determinant is positive.
   subroutine find_ruined_block(blocks, parameters, state, d, block, factor)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(block_state_type), intent(in) :: state
      real(wp), intent(in) :: d(:, :)       !! (6, nb)
      integer, intent(out) :: block
      real(wp), intent(out) :: factor       !! its area after the step over that before
      real(wp) :: at_start
      integer :: i
      block = blocks%n_blocks + 1
      !$omp parallel do default(none) shared(blocks, parameters, state, d) private(i, factor, at_start) &
      !$omp reduction(min:block) schedule(static) if (blocks%n_blocks > parallel_blocks)
      do i = 1, blocks%n_blocks
         at_start = 0
         if (.not. parameters%mass_from_area) &
            at_start = state%mass(i)/parameters%block_materials(blocks%block_material(i))%density
         ! rotation and strains this small, as in nearly all steps, leave more than half of the area
         if (abs(d(3, i)) + abs(d(4, i)) + abs(d(5, i)) + abs(d(6, i)) < 0.25_wp .and. &
             0.5_wp*state%area(i) > kept_in_run*at_start) cycle
         factor = kept_area(d(:, i), parameters%exact_rotation)
         if (factor > kept_in_step .and. factor*state%area(i) > kept_in_run*at_start .and. ieee_is_finite(factor)) cycle
         block = min(block, i)
      end do
      !$omp end parallel do
      factor = 1
      if (block > blocks%n_blocks) then
         block = 0
      else
         factor = kept_area(d(:, block), parameters%exact_rotation)
      end if
   end subroutine find_ruined_block

   !> Can the motion of an attempt that has converged be accepted? Else `outcome` says why not.
   subroutine judge_motion(context, d, reach, at_floor, displacement, outcome)
      class(step_context_type), intent(in) :: context
      real(wp), intent(in) :: d(:, :)          !! (6, nb)
      real(wp), intent(in) :: reach            !! of the search that found the contacts [length]
      logical, intent(in) :: at_floor          !! there is no smaller step to fall back to
      real(wp), intent(out) :: displacement    !! largest of any vertex [length]
      integer, intent(inout) :: outcome        !! one of attempt%...
      real(wp) :: limit, factor
      integer :: ruined
      associate (blocks => context%blocks, parameters => context%parameters, state => context%state)
         displacement = largest_displacement(blocks, state, d)
         limit = parameters%displacement_ratio*parameters%w0
         call find_ruined_block(blocks, parameters, state, d, ruined, factor)
         if (ruined > 0) then
            outcome = attempt_end%ruined
         else if (.not. displacement <= limit .and. .not. at_floor) then
            outcome = attempt_end%too_far
         else if (.not. displacement <= max(limit, parameters%w0)) then
            outcome = attempt_end%thrown
         else if (2*displacement > reach .and. displacement <= 1.0e3_wp*parameters%w0) then
            outcome = attempt_end%search_again
         end if
      end associate
   end subroutine judge_motion

   !> Area of a block after a motion over that before; negative when the block is inverted.
   pure real(wp) function kept_area(d, exact)
      real(wp), intent(in) :: d(6)       !! unknowns of the step
      logical, intent(in) :: exact       !! exact rotation, else linear
      real(wp) :: h(2, 2)
      h = displacement_gradient(d, exact)
      kept_area = (1 + h(1, 1))*(1 + h(2, 2)) - h(1, 2)*h(2, 1)
   end function kept_area

   !> Compose the error that ends the run: step, time, cause, place and advice.
   subroutine report_failure(outcome, dt, detail, blocks, parameters, state, table, trial, of_linings, x, error)
      integer, intent(in) :: outcome                    !! one of attempt%..., not converged
      real(wp), intent(in) :: dt                        !! of the attempt
      character(len=*), intent(in) :: detail            !! message of the linear solver
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(block_state_type), intent(in) :: state       !! at the start of the step
      type(contact_table_type), intent(in) :: table
      type(open_close_type), intent(in) :: trial
      character(len=*), intent(in) :: of_linings        !! lines on their ties that changed most often
      real(wp), intent(in) :: x(:, :)                   !! (6, nb) unknowns of the last round
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: text
      integer :: crushed        ! block that linear elasticity would leave no width; 0: none
      crushed = find_crushed(blocks, parameters, state)
      text = 'step '//to_string(state%step + 1)//' at time '//parameters%shown(state%time, 'time', 10)// &
             ' cannot be solved with the smallest time step '//parameters%shown(dt, 'time')//': '
      if (outcome == attempt_end%no_solution) then
         call tell_no_solution(dt, detail, blocks, parameters, state, text)
      else if (outcome == attempt_end%ruined) then
         call tell_ruined()
      else if (outcome == attempt_end%thrown) then
         call tell_thrown()
      else
         call tell_flipping()
      end if
      call make_error(error, error_code%computation, text)

   contains

      !> Append the block that is inverted or loses its area, with its strains, stress and E.
      subroutine tell_ruined()
         real(wp) :: factor, stiffness
         integer :: block
         call find_ruined_block(blocks, parameters, state, x, block, factor)
         if (block == 0) return
         stiffness = parameters%block_materials(blocks%block_material(block))%youngs_modulus
         if (factor > 0 .and. ieee_is_finite(factor)) then
            text = text//block_at(blocks, parameters, state, block)//' loses its area: the step would multiply '// &
                   parameters%shown(state%area(block), 'length^2')//' by '//to_string(factor)
         else
            text = text//block_at(blocks, parameters, state, block)// &
                   ' is inverted: the step would multiply its area of '// &
                   parameters%shown(state%area(block), 'length^2')//' by '//to_string(factor)
         end if
         text = text//new_line('a')//'  strains of the step: ex = '//to_string(x(4, block))//', ey = '// &
                to_string(x(5, block))//', gxy = '//to_string(x(6, block))//'; largest stress component before it: '// &
                parameters%shown(maxval(abs(state%stress(:, block))), 'stress')//', E = '// &
                parameters%shown(stiffness, 'stress')
         call advise(text, 'strains of this size need stresses as large as E: check the units of E, density, loads '// &
                     'and contact stiffness')
         call advise(text, 'a block with far larger stresses than its neighbours may be a splinter (use a larger '// &
                     'e0) or overlap them at the start')
      end subroutine tell_ruined

      !> Append the vertex with the largest displacement, and the deepest overlap.
      subroutine tell_thrown()
         real(wp) :: largest, u(2)
         integer :: i, v, block, vertex, deepest
         largest = -1
         block = 1
         vertex = 1
         do i = 1, blocks%n_blocks
            do v = blocks%vertex_offset(i) + 1, blocks%vertex_offset(i + 1)
               u = displacement_at(x(:, i), state%vertices(:, v), state%centroid(:, i))
               if (norm2(u) <= largest) cycle
               largest = norm2(u)
               block = i
               vertex = v
            end do
         end do
         text = text//block_name(blocks, parameters, block)//' moves by '// &
                parameters%shown(largest, 'length')//' at its vertex '//at(state%vertices(:, vertex) + state%datum)// &
                ', more than w0 = '// &
                parameters%shown(parameters%w0, 'length')//', half the size of the model (speed '// &
                parameters%shown(largest/dt, 'length/time')//')'
         if (table%n > 0) then
            deepest = minloc(table%gap(1:table%n), dim=1)
            if (table%gap(deepest) < 0) then
               text = text//new_line('a')//'  deepest overlap: '// &
                      parameters%shown(-table%gap(deepest), 'length')//', block '// &
                      to_string(table%block_a(deepest))//' in block '//to_string(table%block_b(deepest))//' at '// &
                      at(table%point(:, deepest) + state%datum)
               if (-table%gap(deepest) > 1.0e-3_wp*parameters%w0) call advise(text, &
                  'contact springs push overlapping blocks apart: correct the geometry, or reduce the time step '// &
                  'if the overlap arose during the run')
            end if
         end if
         call advise(text, 'check that density, E, stiffness, loads and initial velocities use one system of units')
         call advise_numbers(merge(block, 0, crushed == 0))
         if (crushed == 0) call advise(text, 'shorter steps (&time dt_min) close contacts at a smaller overlap; '// &
                                       'k01 below 1 damps the motion')
         call tell_crushed()
      end subroutine tell_thrown

      !> Append the contacts that changed their state most often.
      subroutine tell_flipping()
         logical, allocatable :: told(:)
         integer :: k, c, thinnest
         text = text//'contacts still change state after '//to_string(parameters%max_open_close)// &
                ' open-close rounds'//new_line('a')//'  those that changed most often:'
         thinnest = 0
         allocate (told(table%n), source=.false.)
         do k = 1, min(most_listed, table%n)
            c = maxloc(trial%changes(1:table%n), dim=1, mask=.not. told)
            told(c) = .true.
            if (trial%changes(c) == 0) exit
            text = text//new_line('a')//'  block '//to_string(table%block_a(c))//' against block '// &
                   to_string(table%block_b(c))//' at '//at(table%point(:, c) + state%datum)//': '// &
                   to_string(int(trial%changes(c)))//' changes, now '//state_name(int(trial%joint(c)%state))// &
                   ', gap '//parameters%shown(trial%gap(c), 'length')//', force residual '// &
                   parameters%shown(trial%miss(c), 'force')
            thinnest = thinner(thinnest, table%block_a(c))
            thinnest = thinner(thinnest, table%block_b(c))
         end do
         text = text//of_linings
         if (parameters%max_open_close < 20) call advise(text, 'allow more rounds: &time max_open_close, now '// &
                                                         to_string(parameters%max_open_close)//', 20 by default')
         if (parameters%dt_min > 1.0e-4_wp*parameters%dt_max .and. crushed == 0) call advise(text, &
            'allow shorter steps: &time dt_min, now '//parameters%shown(parameters%dt_min, 'time'))
         call advise_numbers(thinnest)
         if (parameters%k01 >= 1) call advise(text, 'k01 slightly below 1 (0.98) damps the vibration that keeps '// &
                                              'contacts changing')
         call advise(text, 'contacts of splinters and of overlapping blocks may never converge: check the blocks '// &
                     'listed here')
         call tell_crushed()
      end subroutine tell_flipping

      !> Append a block that is crushed: no step mends that.
      subroutine tell_crushed()
         if (crushed == 0) return
         call advise(text, block_at(blocks, parameters, state, crushed)//', '// &
                     parameters%shown(thickness(crushed), 'length')//' thick, is crushed to a strain of '// &
                     to_string(100*strain_of(parameters, blocks, state, crushed), 2)//' %, where linear elasticity '// &
                     'has ended: merge it with a neighbour, or remove it (a larger e0); shorter steps do not help')
      end subroutine tell_crushed

      !> Append advice on g0, g1 and g2 where they are far from the rules of docs/contact-numbers.md.
      subroutine advise_numbers(block)
         integer, intent(in) :: block   !! the thinnest block that the message names; 0: none
         real(wp) :: ratio, dt, moved, width, springs
         springs = springs_of_joint(parameters%by_length)
         ratio = parameters%normal_stiffness/maxval(parameters%block_materials%youngs_modulus)
         if (ratio > highest_over_e/springs) call advise(text, 'the contact stiffness (g0) is '//to_string(ratio)// &
            ' times the largest E: '//stiffness_advice(parameters%by_length))
         dt = advised_time_step(mean_edge(blocks), &
              sum(state%mass(1:blocks%n_blocks))/sum(state%area(1:blocks%n_blocks)), &
              springs*parameters%normal_stiffness)
         if (parameters%dt_max > dt) call advise(text, 'the time step (g1) of '//parameters%shown(parameters%dt_max, &
                                                 'time')//' is long for this block size and contact stiffness: at '// &
                                                 'most '//parameters%shown(dt, 'time')//' is advised')
         if (block == 0) return
         moved = parameters%displacement_ratio*parameters%w0
         width = thickness(block)
         if (moved <= width) return
         call advise(text, 'the displacement ratio (g2) allows displacements of '// &
                     parameters%shown(moved, 'length')//' in a step, more than the thickness '// &
                     parameters%shown(width, 'length')//' of '//block_at(blocks, parameters, state, block)// &
                     ': reduce g2 from '// &
                     to_string(parameters%displacement_ratio)//' to '// &
                     to_string(min(advised_ratio(mean_edge(blocks), parameters%w0), width/parameters%w0)))
      end subroutine advise_numbers

      !> The thinner of two blocks; 0: none.
      pure integer function thinner(a, b)
         integer, intent(in) :: a, b
         thinner = b
         if (a == 0) return
         if (thickness(a) <= thickness(b)) thinner = a
      end function thinner

      !> Width of a long block [length].
      pure real(wp) function thickness(block)
         integer, intent(in) :: block
         thickness = inradius_bound(state%vertices(:, blocks%vertex_offset(block) + 1:blocks%vertex_offset(block + 1)))
      end function thickness

   end subroutine report_failure

   !> The block with the largest strain, where that is 1 or more, and would leave it no width; 0: none.
   pure integer function find_crushed(blocks, parameters, state) result(block)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(block_state_type), intent(in) :: state
      integer :: i
      block = maxloc([(strain_of(parameters, blocks, state, i), i=1, blocks%n_blocks)], dim=1)
      if (.not. strain_of(parameters, blocks, state, block) >= 1) block = 0
   end function find_crushed

   !> Largest stress of a block over E.
   pure real(wp) function strain_of(parameters, blocks, state, i) result(strain)
      type(parameters_type), intent(in) :: parameters
      type(block_system_type), intent(in) :: blocks
      type(block_state_type), intent(in) :: state
      integer, intent(in) :: i
      strain = 0
      if (state%active(i)) strain = maxval(abs(state%stress(:, i)))/ &
                                    parameters%block_materials(blocks%block_material(i))%youngs_modulus
   end function strain_of

   !> Append the message of the linear solver, a block with values that are not finite, and the ratio of contact
   !> stiffness to inertia.
   subroutine tell_no_solution(dt, detail, blocks, parameters, state, text)
      real(wp), intent(in) :: dt   !! step [time]
      character(len=*), intent(in) :: detail
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(block_state_type), intent(in) :: state
      character(len=:), allocatable, intent(inout) :: text
      real(wp) :: ratio
      integer :: i, lightest
      text = text//with_block_names(detail, blocks, parameters)
      do i = 1, blocks%n_blocks
         if (is_finite(i)) cycle
         text = text//new_line('a')//'  '//block_at(blocks, parameters, state, i)// &
                ' has a velocity, stress or position that is not finite'
         exit
      end do
      lightest = max(1, minloc(state%mass(1:blocks%n_blocks), 1, state%active(1:blocks%n_blocks)))
      ratio = 0.5_wp*parameters%normal_stiffness*dt**2/max(state%mass(lightest), tiny(1.0_wp))
      text = text//new_line('a')//'  the contact stiffness is '//to_string(ratio)//' times the inertia 2m/dt^2'// &
             ' of the lightest block, '//block_at(blocks, parameters, state, lightest)
      if (ratio > 1.0e6_wp) then
         call advise(text, 'above about 1e6 round-off errors dominate the solution: reduce the contact stiffness '// &
                     '(g0) or the time step (g1, dt_max, dt_min), or remove splinters by a larger e0')
      end if
      call advise(text, 'check that density, E, stiffness, loads and initial velocities use one system of units')
      call advise(text, 'if the solver is iterative, try --solver cholmod or --solver dense')

   contains

      !> Are velocity, stress, centroid and area of a block finite?
      pure logical function is_finite(i)
         integer, intent(in) :: i
         is_finite = all(ieee_is_finite(state%velocity(:, i))) .and. all(ieee_is_finite(state%stress(:, i))) .and. &
                     all(ieee_is_finite(state%centroid(:, i))) .and. ieee_is_finite(state%area(i))
      end function is_finite

   end subroutine tell_no_solution

   !> Append a line of advice.
   subroutine advise(text, what)
      character(len=:), allocatable, intent(inout) :: text
      character(len=*), intent(in) :: what
      text = text//new_line('a')//'  advice: '//what
   end subroutine advise

   !> 'block 7 at (1.5, 2)', or a segment of a lining.
   pure function block_at(blocks, parameters, state, block) result(text)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(block_state_type), intent(in) :: state
      integer, intent(in) :: block
      character(len=:), allocatable :: text
      text = block_name(blocks, parameters, block)//' at '//at(state%centroid(:, block) + state%datum)
   end function block_at

   !> '(1.5, 2)'.
   pure function at(point) result(text)
      real(wp), intent(in) :: point(2)
      character(len=:), allocatable :: text
      text = '('//to_string(point(1))//', '//to_string(point(2))//')'
   end function at

   !> Name of a contact state.
   pure function state_name(state) result(name)
      integer, intent(in) :: state
      character(len=:), allocatable :: name
      name = 'open'
      if (state == contact_state%sliding) name = 'sliding'
      if (state == contact_state%locked) name = 'locked'
   end function state_name

end module rockdda_stepping_failure
