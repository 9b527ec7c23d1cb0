! SPDX-License-Identifier: MIT
!> The links of a lining in the equations of a step (docs/theory.md, "Linings").
!>
!> A joint of two bodies, beam or tie, has a point on each of them, and axes that turn with the mean rotation of both
!> (beam) or with the segment (tie). With D the way from the first point to the second, its change in a step along an
!> axis n is
!>
!>     n1.D1 - n0.D0 = (n1 + n0)/2 . (D1 - D0) + (n1 - n0).(D1 + D0)/2
!>
!> exactly, linear in the unknowns once the rotations in it are those that are expected.
!>
!> Each round linearises at the motion of the last one, and is repeated until forces follow their laws there.
module rockdda_interaction_liner_links
   use rockdda_base_kinds, only : wp
   use rockdda_interaction_attempt, only : attempt_type
   use rockdda_interaction_joint_strength, only : joint_law_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_equations, only : equations_type
   use rockdda_interaction_finite_rotation, only : moving_block_type, mean_load, mean_displacement
   use rockdda_interaction_liner, only : liner_type, beam_links, moved_beam, moved_tie, on_segment, first_point, acts, &
      respond, largest_pressure
   use rockdda_interaction_liner_beam, only : beam_response_type, respond_beam
   use rockdda_interaction_liner_ties, only : tie_response_type, tie_state
   use rockdda_interaction_time_scheme, only : time_scheme_type
   implicit none
   private
   public :: join_liner, begin_liner, place_liner, add_to_links_of, predict_liner, forces_of_links, &
      measure_placement_of, judge_liner, friction_agreement

   !> Forces agree with their laws to this share; those of friction, which wait for normal forces.
   real(wp), parameter :: agreement = 1.0e-8_wp, friction_agreement = 1.0e-6_wp
   !> Rounding of deformations, as a share of them.
   real(wp), parameter :: rounding = 1.0e-13_wp

contains

   !> Blocks of the links of a lining.
   subroutine join_liner(liner, context, equations)
      type(liner_type), intent(inout) :: liner
      type(step_context_type), intent(in) :: context
      type(equations_type), intent(inout) :: equations
      integer :: c, i, l
      c = liner%first_link
      do i = 1, size(liner%joints)
         do l = 1, beam_links
            call equations%join(c + l, liner%joints(i)%block)
         end do
         c = c + beam_links
      end do
      do i = 1, size(liner%ties)
         associate (tie => liner%ties(i))
            tie%acts = acts(context, tie)
            c = c + 1
            call equations%join(c, merge([tie%a, tie%b], 0, tie%acts))
         end associate
      end do
   end subroutine join_liner

   !> Begin an attempt: no motion, and where in the step ties act. One that is open at the start and closes does not
   !> know when: its force at the end is an impulse (rockdda_interaction_time_scheme), or it would give energy.
   subroutine begin_liner(liner, laws, level, scheme)
      type(liner_type), intent(inout) :: liner
      type(joint_law_type), allocatable, intent(in) :: laws(:)   !! of the joint materials
      real(wp), intent(in) :: level          !! share of the step's motion up to where forces act
      type(time_scheme_type), intent(in) :: scheme
      type(tie_response_type) :: at_start
      integer :: i, j
      do j = 1, size(liner%joints)
         liner%joints(j)%move = 0
      end do
      do i = 1, size(liner%ties)
         associate (tie => liner%ties(i))
            tie%move = 0
            tie%level = level
            tie%factor = 1
            if (liner%joint == 0 .or. .not. (scheme%second_order .and. tie%acts)) cycle
            call respond(laws, liner, tie, tie%motion, at_start)
            if (at_start%state /= tie_state%open) cycle
            tie%level = 1
            tie%factor = scheme%impact
         end associate
      end do
   end subroutine begin_liner

   !> Vectors of all links.
   subroutine place_liner(liner, context, attempt, equations)
      type(liner_type), intent(in) :: liner
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(equations_type), intent(inout) :: equations
      real(wp) :: v(6, 2, 2), line(6, 2, 2)
      integer :: c, i, j
      c = liner%first_link
      do i = 1, size(liner%joints)
         associate (joint => liner%joints(i), a => liner%joints(i)%block(1), b => liner%joints(i)%block(2))
            call joint_vectors(attempt%moving(a), attempt%moving(b), on_segment(context, a, joint%arm(:, 1)), &
                               on_segment(context, b, joint%arm(:, 2)), joint%beam%angle + 0.5_wp* &
                               (context%state%rotation(a) + context%state%rotation(b)), [0.5_wp, 0.5_wp], &
                               [.true., .true.], v)
         end associate
         do j = 1, 2
            line = 0
            line(:, 1, :) = v(:, j, :)
            call equations%set_vectors(c + j, line(:, :, 1), line(:, :, 2))
         end do
         line = 0
         line(:, 1, :) = v(:, 1, :)
         call equations%set_vectors(c + 4, line(:, :, 1), line(:, :, 2))
         line = 0
         line(3, 1, 1) = -1
         line(3, 1, 2) = 1
         call equations%set_vectors(c + 3, line(:, :, 1), line(:, :, 2))
         c = c + beam_links
      end do
      do i = 1, size(liner%ties)
         c = c + 1
         associate (tie => liner%ties(i))
            if (.not. tie%acts) cycle
            call joint_vectors(attempt%moving(tie%a), attempt%moving(tie%b), first_point(context, tie), &
                               on_segment(context, tie%b, tie%arm), tie%angle + context%state%rotation(tie%b), &
                               [0.0_wp, 1.0_wp], [.not. tie%on_rock, .true.], v)
            v(4, 1, 2) = tie%shape(1)
            v(5, 2, 2) = tie%shape(2)
            v(6, 1, 2) = tie%shape(3)
            call equations%set_vectors(c, v(:, :, 1), v(:, :, 2))
         end associate
      end do
   end subroutine place_liner

   !> Derivatives of the components of the way between two points, of which axes turn with shares of the rotations of
   !> their blocks.
   pure subroutine joint_vectors(a, b, x, y, angle, share, rigid, v)
      type(moving_block_type), intent(in) :: a, b
      real(wp), intent(in) :: x(2), y(2)         !! points on both blocks at the start of the step [length]
      real(wp), intent(in) :: angle              !! of the first axis there
      real(wp), intent(in) :: share(2)
      logical, intent(in) :: rigid(2)            !! strains of the block do not move its point: it is a segment
      real(wp), intent(out) :: v(6, 2, 2)        !! unknowns, axes, blocks
      real(wp) :: turn, middle, chord, n(2), mean(2), d(6, 2)
      integer :: j
      turn = share(1)*a%angle + share(2)*b%angle
      middle = angle + 0.5_wp*turn
      chord = 1
      if (abs(turn) > 0) chord = 2*sin(0.5_wp*turn)/turn
      d = reshape([a%d, b%d], [6, 2])
      where (spread(rigid, 1, 3)) d(4:6, :) = 0
      mean = (y - x) + 0.5_wp*(mean_displacement(d(:, 2), y, b) - mean_displacement(d(:, 1), x, a))
      n = [cos(middle), sin(middle)]
      do j = 1, 2
         v(:, j, 1) = -mean_load(cos(0.5_wp*turn)*n, x, a)
         v(:, j, 2) = mean_load(cos(0.5_wp*turn)*n, y, b)
         where (spread(rigid, 1, 3)) v(4:6, j, :) = 0
         v(3, j, :) = v(3, j, :) + share*chord*(-n(2)*mean(1) + n(1)*mean(2))
         n = [-n(2), n(1)]
      end do
   end subroutine joint_vectors

   !> Stiffness and load of the links, linear at the motion of the last round.
   subroutine add_to_links_of(liner, level, equations)
      type(liner_type), intent(in) :: liner
      real(wp), intent(in) :: level          !! share of the step's motion up to where forces act
      type(equations_type), intent(inout) :: equations
      real(wp) :: f(3), stiffness(2, beam_links), force(2, beam_links), coupling(beam_links)
      integer, parameter :: rows(beam_links) = [1, 2, 3, 4]
      integer :: c, i
      c = liner%first_link
      do i = 1, size(liner%joints)
         associate (joint => liner%joints(i), t => liner%joints(i)%tangent)
            f = t%f - matmul(t%stiffness, joint%at)
            stiffness = 0
            force = 0
            stiffness(1, :) = level*[t%stiffness(1, 1), t%stiffness(2, 2), t%stiffness(3, 3), 0.0_wp]
            coupling = level*[t%stiffness(1, 2), t%stiffness(2, 3), t%stiffness(3, 1), 0.0_wp]
            force(1, 1:3) = -f
         end associate
         call equations%set_links(beam_links, rows, c, stiffness, force, coupling)
         c = c + beam_links
      end do
      do i = 1, size(liner%ties)
         c = c + 1
         associate (tie => liner%ties(i))
            stiffness = 0
            force = 0
            if (tie%acts) then
               stiffness(:, 1) = tie%tangent
               force(:, 1) = stiffness(:, 1)*tie%at - tie%force
            end if
            call equations%set_links(1, [1], c - 1, tie%factor*tie%level*stiffness(:, 1:1), &
                                     tie%factor*force(:, 1:1), [0.0_wp])
         end associate
      end do
   end subroutine add_to_links_of

   !> Changes of deformation.
   subroutine predict_liner(liner, level, equations)
      type(liner_type), intent(inout) :: liner
      real(wp), intent(in) :: level          !! share of the step's motion up to where forces act
      type(equations_type), intent(in) :: equations
      real(wp) :: motion(2)
      integer :: c, i, j
      c = liner%first_link
      do i = 1, size(liner%joints)
         do j = 1, 3
            call equations%link_motion(c + j, motion)
            liner%joints(i)%move(j) = level*motion(1)
         end do
         c = c + beam_links
      end do
      do i = 1, size(liner%ties)
         c = c + 1
         liner%ties(i)%move = 0
         if (.not. liner%ties(i)%acts) cycle
         call equations%link_motion(c, motion)
         liner%ties(i)%move = liner%ties(i)%level*motion
      end do
   end subroutine predict_liner

   !> Forces by the laws at a fraction of the way.
   subroutine forces_of_links(liner, laws, fraction, force)
      type(liner_type), intent(in) :: liner
      type(joint_law_type), allocatable, intent(in) :: laws(:)   !! of the joint materials
      real(wp), intent(in) :: fraction
      real(wp), intent(inout), contiguous :: force(:, :)
      type(beam_response_type) :: response
      type(tie_response_type) :: of_tie
      integer :: c, i
      c = liner%first_link
      do i = 1, size(liner%joints)
         associate (joint => liner%joints(i))
            call respond_beam(joint%beam, liner%section, joint%state, joint%d + joint%kept + &
                              fraction*(joint%move - joint%kept), response)
         end associate
         force(:, c + 1:c + beam_links) = 0
         force(1, c + 1:c + 3) = response%f
         c = c + beam_links
      end do
      do i = 1, size(liner%ties)
         c = c + 1
         force(:, c) = 0
         associate (tie => liner%ties(i))
            if (.not. tie%acts) cycle
            call respond(laws, liner, tie, tie%motion + tie%kept + fraction*(tie%move - tie%kept), of_tie)
         end associate
         force(:, c) = liner%ties(i)%factor*of_tie%force
      end do
   end subroutine forces_of_links

   !> Deformations that the expected motion gives otherwise than the solution, as shares of the largest force of the
   !> lining.
   subroutine measure_placement_of(liner, level, context, equations)
      type(liner_type), intent(in) :: liner
      real(wp), intent(in) :: level          !! share of the step's motion up to where forces act
      type(step_context_type), intent(in) :: context
      type(equations_type), intent(inout) :: equations
      real(wp) :: way(2), d(3), scale, largest
      integer :: c, i
      ! a link without force among others has lengths that are off by rounding alone
      largest = maxval([0.0_wp, (norm2(liner%joints(i)%tangent%f(1:2)), i=1, size(liner%joints)), &
                        (norm2(liner%ties(i)%force), i=1, size(liner%ties))])
      c = liner%first_link
      do i = 1, size(liner%joints)
         associate (joint => liner%joints(i), a => liner%joints(i)%block(1), b => liner%joints(i)%block(2))
            d = moved_beam(context, joint, equations%x)
            scale = max(largest, min(equations%block_force(a), equations%block_force(b)))
            d = matmul(joint%tangent%stiffness, d - joint%d - joint%move/level)
            if (scale > 0) equations%link_off(c + 1) = norm2(d(1:2))/scale
         end associate
         c = c + beam_links
      end do
      do i = 1, size(liner%ties)
         c = c + 1
         associate (tie => liner%ties(i))
            if (.not. tie%acts) cycle
            way = moved_tie(context, tie, equations%x) - tie%motion - tie%move/tie%level
            scale = max(largest, min(equations%block_force(tie%a), equations%block_force(tie%b)))
            if (scale > 0) equations%link_off(c) = norm2(tie%tangent*way)/scale
         end associate
      end do
   end subroutine measure_placement_of

   !> Linear at the present motion; the last round holds where its forces follow the laws there.
   subroutine judge_liner(liner, laws, n_changes, n_unsettled)
      type(liner_type), intent(inout) :: liner
      type(joint_law_type), allocatable, intent(in) :: laws(:)   !! of the joint materials
      integer, intent(inout) :: n_changes, n_unsettled
      type(beam_response_type) :: response
      type(tie_response_type) :: of_tie
      real(wp) :: missing(3), scale(3), used(2), largest
      integer :: i
      do i = 1, size(liner%joints)
         associate (joint => liner%joints(i), t => liner%joints(i)%tangent)
            call respond_beam(joint%beam, liner%section, joint%state, joint%d + joint%move, response)
            missing = response%f - (t%f + matmul(t%stiffness, joint%move - joint%at))
            scale = sqrt(joint%beam%flexibility)
            if (maxval(abs(missing)*scale) > agreement*maxval(abs(response%f)*scale) + rounding*maxval( &
                (abs(joint%d) + abs(joint%move))*liner%section%modulus/scale)) n_changes = n_changes + 1
            joint%at = joint%move
            joint%tangent = response
         end associate
      end do
      largest = largest_pressure(liner)
      do i = 1, size(liner%ties)
         associate (tie => liner%ties(i))
            if (.not. tie%acts) cycle
            call respond(laws, liner, tie, tie%motion + tie%move, of_tie)
            used = tie%force + tie%tangent*(tie%move - tie%at)
            ! one that slides back holds first
            if (slides(tie%state) .and. slides(of_tie%state) .and. of_tie%force(2)*tie%force(2) < 0) then
               of_tie%state = merge(tie_state%held, tie_state%at_tension, of_tie%state == tie_state%slides)
               of_tie%force(2) = of_tie%trial
               of_tie%stiffness(2) = liner%stiffness(2)*tie%length + tie%drag(2)
            end if
            if (of_tie%state /= tie%state) then
               n_changes = n_changes + 1
               tie%changes = tie%changes + 1
            else if (norm2(of_tie%force - used) > friction_agreement*max(norm2(used), tie%length*largest) .and. &
                     of_tie%state /= tie_state%held) then
               n_unsettled = n_unsettled + 1
            end if
            tie%state = of_tie%state
            tie%force = of_tie%force
            tie%tangent = of_tie%stiffness
            tie%at = tie%move
         end associate
      end do

   contains

      !> Is the shear force of a tie at its limit?
      pure logical function slides(state)
         integer, intent(in) :: state
         slides = state == tie_state%slides .or. state == tie_state%parts
      end function slides

   end subroutine judge_liner

end module rockdda_interaction_liner_links
