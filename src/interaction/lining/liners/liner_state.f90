! SPDX-License-Identifier: MIT
!> What a lining has done at the end of a step, its forces on the blocks, and what lasts of it in a checkpoint.
module rockdda_interaction_liner_state
   use rockdda_base_kinds, only : wp
   use rockdda_base_state_archive, only : state_archive_type, positive
   use rockdda_base_strings, only : to_string
   use rockdda_model_blocks, only : largest_coordinate
   use rockdda_interaction_block_forces, only : block_forces_type
   use rockdda_interaction_joint_strength, only : joint_law_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_equations, only : equations_type
   use rockdda_interaction_kinematics, only : move_point
   use rockdda_interaction_liner, only : liner_joint_type, liner_type, set_modulus, on_segment, turned, moved_beam, &
      moved_tie, first_point, by_shape, acts, beam_links, respond
   use rockdda_interaction_liner_beam, only : beam_response_type, respond_beam, accept_beam, n_sections
   use rockdda_interaction_liner_placing, only : join_segments
   use rockdda_interaction_liner_ties, only : tie_type, tie_after_type, tie_response_type, tie_state
   implicit none
   private
   public :: finish_liner, commit_liner, add_forces_of, exchange_liner

contains

   !> What a lining does in a step: its outcome is set, and the states that its beams and ties then have. The work is
   !> that of the forces in the equations, which miss the laws by as much as a round may.
   pure subroutine finish_liner(laws, level, equations, liner)
      type(joint_law_type), allocatable, intent(in) :: laws(:)   !! of the joint materials
      real(wp), intent(in) :: level          !! share of the step's motion up to where forces act
      type(equations_type), intent(in) :: equations
      type(liner_type), intent(inout) :: liner
      type(beam_response_type) :: response
      type(tie_response_type) :: of_tie, last
      type(tie_type) :: after
      real(wp) :: motion(2), d(3), change
      integer :: i, l
      liner%work = 0
      liner%slipped = 0
      liner%stored = 0
      liner%freed = 0
      if (.not. liner%is_there) return
      l = liner%first_link
      do i = 1, beam_links*size(liner%joints)
         liner%work = liner%work + work_on(l + i)
      end do
      l = l + beam_links*size(liner%joints)
      do i = 1, size(liner%ties)
         if (liner%ties(i)%acts) liner%work = liner%work + work_on(l + i)/liner%ties(i)%factor
      end do
      do i = 1, size(liner%joints)
         associate (joint => liner%joints(i))
            call respond_beam(joint%beam, liner%section, joint%state, joint%d, response)
            liner%stored(1) = liner%stored(1) + response%energy
            d = joint%d + joint%move/level
            call respond_beam(joint%beam, liner%section, joint%state, d, response)
            change = response%energy
            joint%state_after = joint%state
            call accept_beam(liner%section, response, joint%state_after)
            call respond_beam(joint%beam, liner%section, joint%state_after, d, response)
            liner%freed = liner%freed + (change - response%energy)
            liner%stored(2) = liner%stored(2) + response%energy
         end associate
      end do
      do i = 1, size(liner%ties)
         associate (tie => liner%ties(i))
            if (.not. tie%acts) cycle
            call respond(laws, liner, tie, tie%motion, of_tie)
            liner%stored(1) = liner%stored(1) + of_tie%energy
            after = tie
            after%drag = 0
            motion = tie%motion + tie%move/tie%level
            call respond(laws, liner, after, motion, last)
            after%sliding = last%state == tie_state%slides
            after%parted = .not. any(last%state == [tie_state%held, tie_state%slides])
            change = 0
            if (last%state == tie_state%slides .or. last%state == tie_state%parts) then
               change = (motion(2) - last%force(2)/(liner%stiffness(2)*tie%length)) - tie%free(2)
            else if (last%state == tie_state%open) then
               change = motion(2) - tie%free(2)
            end if
            after%free(2) = tie%free(2) + change
            after%slip = tie%slip + abs(change)
            liner%slipped = liner%slipped + last%force(2)*change
            if (last%breaks) after%bonded = .false.
            change = last%energy
            call respond(laws, liner, after, motion, last)
            liner%freed = liner%freed + (change - last%energy)
            liner%stored(2) = liner%stored(2) + last%energy
            tie%after = tie_after_type(after%free, after%slip, after%bonded, after%parted, after%sliding)
         end associate
      end do

   contains

      !> Work of a link.
      pure real(wp) function work_on(l)
         integer, intent(in) :: l
         real(wp) :: motion(2)
         call equations%link_motion(l, motion)
         work_on = dot_product(equations%link_force(l), motion)
      end function work_on

   end subroutine finish_liner

   !> The states of the end of the step, and places in the rock.
   subroutine commit_liner(context, d, liner)
      type(step_context_type), intent(in) :: context
      real(wp), intent(in), contiguous :: d(:, :)    !! (6, nb)
      type(liner_type), intent(inout) :: liner
      integer :: i
      do i = 1, size(liner%joints)
         liner%joints(i)%d = moved_beam(context, liner%joints(i), d)
         liner%joints(i)%state = liner%joints(i)%state_after
      end do
      do i = 1, size(liner%ties)
         associate (tie => liner%ties(i))
            tie%drag = 0
            if (tie%acts) then
               tie%motion = moved_tie(context, tie, d)
               tie%bent = tie%bent + by_shape(tie, d(4:6, tie%b))
               tie%free = tie%after%free
               tie%slip = tie%after%slip
               tie%bonded = tie%after%bonded
               tie%parted = tie%after%parted
               tie%sliding = tie%after%sliding
            end if
            if (tie%a > 0 .and. tie%on_rock) call move_point(d(:, tie%a), context%state%centroid(:, tie%a), &
                                                             context%parameters%exact_rotation, tie%at_a)
         end associate
      end do
   end subroutine commit_liner

   !> Forces of a lining on the blocks at their new places.
   subroutine add_forces_of(laws, context, liner, forces)
      type(joint_law_type), allocatable, intent(in) :: laws(:)   !! of the joint materials
      type(step_context_type), intent(in) :: context
      type(liner_type), intent(in) :: liner
      type(block_forces_type), intent(inout) :: forces
      type(beam_response_type) :: response
      type(tie_response_type) :: of_tie
      real(wp) :: x(2), y(2)
      integer :: i
      do i = 1, size(liner%joints)
         associate (joint => liner%joints(i), a => liner%joints(i)%block(1), b => liner%joints(i)%block(2))
            call respond_beam(joint%beam, liner%section, joint%state, joint%d, response)
            x = on_segment(context, a, joint%arm(:, 1))
            y = on_segment(context, b, joint%arm(:, 2))
            call add(a, b, x, y, turned(response%f(1:2), joint%beam%angle + 0.5_wp* &
                     (context%state%rotation(a) + context%state%rotation(b))), [0.5_wp, 0.5_wp])
            call forces%add_load(a, [0.0_wp, 0.0_wp, response%f(3)])
            call forces%add_load(b, [0.0_wp, 0.0_wp, -response%f(3)])
         end associate
      end do
      do i = 1, size(liner%ties)
         associate (tie => liner%ties(i))
            if (.not. acts(context, tie)) cycle
            call respond(laws, liner, tie, tie%motion, of_tie)
            call add(tie%a, tie%b, first_point(context, tie), on_segment(context, tie%b, tie%arm), &
                     turned(of_tie%force, tie%angle + context%state%rotation(tie%b)), [0.0_wp, 1.0_wp])
         end associate
      end do

   contains

      !> A force that pulls two points together, and the moment that the way between them gives it.
      subroutine add(a, b, x, y, force, share)
         integer, intent(in) :: a, b
         real(wp), intent(in) :: x(2), y(2), force(2), share(2)
         real(wp) :: moment
         call forces%add_force(a, force, x - context%state%centroid(:, a))
         call forces%add_force(b, -force, y - context%state%centroid(:, b))
         moment = (y(1) - x(1))*force(2) - (y(2) - x(2))*force(1)
         call forces%add_load(a, [0.0_wp, 0.0_wp, share(1)*moment])
         call forces%add_load(b, [0.0_wp, 0.0_wp, share(2)*moment])
      end subroutine add

   end subroutine add_forces_of

   !> Save or load what lasts of a lining: a section for it, and one for each of its ties and joints.
   subroutine exchange_liner(archive, name, n_blocks, liner)
      class(state_archive_type), intent(inout) :: archive
      character(len=*), intent(in) :: name                 !! of its sections
      integer, intent(in) :: n_blocks
      type(liner_type), intent(inout) :: liner             !! as drawn
      integer, allocatable :: behind(:)
      real(wp) :: modulus
      integer :: i
      if (liner%layout%n == 0) return
      call archive%section(name)
      call archive%item('is_there', liner%is_there)
      call archive%item('side', liner%side, -1, 1)
      modulus = liner%section%modulus
      call archive%item('modulus', modulus, positive)
      if (archive%has_loaded()) call set_modulus(modulus, liner)
      call archive%item('path', liner%path, shape(liner%path), largest_coordinate)
      behind = liner%ties%a
      call archive%item('behind', behind, least=0, most=n_blocks)
      if (archive%has_loaded() .and. allocated(behind)) then
         deallocate (liner%ties)
         allocate (liner%ties(size(behind)))
         liner%ties%a = behind
      end if
      do i = 1, size(liner%ties)
         call archive%section(name//'_tie_'//to_string(i))
         call exchange_tie(liner%ties(i))
      end do
      if (archive%has_loaded() .and. liner%is_there) call join_segments(liner)
      do i = 1, merge(size(liner%joints), 0, liner%is_there)
         call archive%section(name//'_joint_'//to_string(i))
         call exchange_joint(liner%joints(i))
      end do

   contains

      !> What lasts of a tie.
      subroutine exchange_tie(tie)
         type(tie_type), intent(inout) :: tie
         call archive%item('segment', tie%b, liner%before + 1, liner%before + liner%layout%n)
         call archive%item('on_rock', tie%on_rock)
         call archive%fixed('place', tie%at_a, -largest_coordinate, largest_coordinate)
         call archive%fixed('arm', tie%arm, -largest_coordinate, largest_coordinate)
         call archive%item('angle', tie%angle, -1.0e9_wp, 1.0e9_wp)
         call archive%item('length', tie%length, positive, largest_coordinate)
         call archive%fixed('shape', tie%shape)
         call archive%fixed('motion', tie%motion)
         call archive%fixed('bent', tie%bent)
         call archive%fixed('free', tie%free, -largest_coordinate, largest_coordinate)
         call archive%item('slip', tie%slip, 0.0_wp, largest_coordinate)
         call archive%item('bonded', tie%bonded)
         call archive%item('parted', tie%parted)
         call archive%item('sliding', tie%sliding)
      end subroutine exchange_tie

      !> What lasts of a joint of two segments.
      subroutine exchange_joint(joint)
         type(liner_joint_type), intent(inout) :: joint
         integer :: marks(n_sections)                    !! 1: cracked, 2: crushed, 3: both
         call archive%fixed('deformation', joint%d)
         call archive%fixed('free_deformation', joint%state%free)
         marks = merge(1, 0, joint%state%cracked) + merge(2, 0, joint%state%crushed)
         call archive%fixed('marks', marks, 0, 3)
         joint%state%cracked = btest(marks, 0)
         joint%state%crushed = btest(marks, 1)
      end subroutine exchange_joint

   end subroutine exchange_liner

end module rockdda_interaction_liner_state
